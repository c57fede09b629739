"""The benchmarks, run once with small sizes so that they cannot rot. No test asserts a time."""

import pytest

from benchmarks import measure


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return measure.open_or_build(tmp_path_factory.mktemp("bench") / "atlas.nc")


def test_lookup_errors(table):
    worst = measure.lookup_errors(table, 3000)
    assert worst.pop("error estimates that hold")[0] == 1.0
    for name, (value, where) in worst.items():
        assert value < 1e-8, (name, where)


def test_methods(table):
    rows = {row.method.split(",")[0]: row for row in measure.methods(table, rows=200, peer_rows=3)}
    assert rows["lookup from the atlas"].error < 1e-8
    assert rows["direct solution"].error < 1e-12
    assert rows["Skop's scan"].error < 1e-2
    assert rows["SciPy `solve_ivp` + `root`"].error < 1e-6
