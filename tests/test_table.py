"""The table of equilibria: complete, accurate, the same bytes again, and never interpolated across a fold."""

import json
import os
import shutil
import subprocess
import sys

import mpmath as mp
import numpy as np
import pytest
import reference
import xarray as xr
from helpers import run

import towatlas
from towatlas.builders.fish import build_equilibria
from towatlas.builders.grids import EquilibriaGrid
from towatlas.kernels import status
from towatlas.solve.equilibria import solve_branch
from towatlas.solve.passed import folds_passed
from towatlas.tables.seal import AtlasFileError, read_sealed


@pytest.fixture(scope="module")
def table(equilibria_path):
    return towatlas.open_atlas(equilibria_path)


def points(rows, seed):
    rng = np.random.default_rng(seed)
    w_f = np.where(rng.random(rows) < 0.1, 0.0, 10 ** rng.uniform(-4, 2, rows))
    return 10 ** rng.uniform(0, 1, rows), w_f, 10 ** rng.uniform(-1, 0.5, rows)


def test_a_stranger_finds_both_branches(equilibria_path):
    with xr.open_dataset(equilibria_path) as file:
        assert file.x_f.dims == ("branch", "w_f", "lam", "gamma")
        assert file.branch.attrs["flag_meanings"] == "outward median"
        for name in ("R_x0", "x_f", "z_f", "tension", "nodes", "count", "gamma", "lam", "w_f"):
            assert file[name].attrs["long_name"]
            assert "critical" not in file[name].attrs["long_name"]
        assert bool((file["status"] == status.OK).all())
        outward, median = file.sel(branch=0), file.sel(branch=1)
        assert bool((outward.nodes == 0).all())
        assert bool((2 * median.nodes + 1 == file["count"]).all())
        alone = file["count"] == 1
        assert 0.1 < float(alone.mean()) < 0.9
        assert bool((outward.x_f == median.x_f).where(alone, True).all())
        assert bool((np.abs(median.x_f) < outward.x_f).where(~alone, True).all())
        assert bool((np.sign(median.x_f) == 1 - 2 * (median.nodes % 2)).all())
        np.testing.assert_allclose(file.tension, np.hypot(file.w_f + file.lam, file.R_x0).transpose(*file.x_f.dims))
        assert float(file.error.max()) < 1e-11


def test_nodes_agree_with_the_critical_speeds(equilibria_path, equilibria_grid):
    with (
        xr.open_dataset(equilibria_path) as file,
        xr.open_dataset(equilibria_path, group="support/critical") as critical,
    ):
        gamma_c = critical.gamma.values
        assert np.nanmin(gamma_c) > 0
        passed = np.sum(gamma_c[..., None] < equilibria_grid.gamma, axis=0)
        np.testing.assert_array_equal(file.nodes.sel(branch=1), passed)
        exact = towatlas.solve_critical(equilibria_grid.lam, equilibria_grid.w_f[:, None], 1)
        known = np.isfinite(gamma_c[0])
        np.testing.assert_allclose(gamma_c[0][known], exact.gamma[known], rtol=1e-11)


def test_against_34_digits(equilibria_path):
    rng = np.random.default_rng(5)
    with xr.open_dataset(equilibria_path) as file:
        for _ in range(12):
            k = {name: int(rng.integers(file.sizes[name])) for name in ("branch", "w_f", "lam", "gamma")}
            at = file.isel(k)
            with mp.workdps(34):
                gamma2 = mp.mpf(float(at.gamma)) ** 2
                mu, tau = gamma2 * mp.mpf(float(at.w_f)), gamma2 * mp.mpf(float(at.lam))
                a = abs(mp.mpf(float(at.x_f))) * gamma2
                for _ in range(3):
                    end = reference.shot(a, mu, tau)
                    a -= (end.p - mp.sign(end.p) * gamma2) / end.q
                assert abs(a / gamma2 - abs(float(at.x_f))) < 1e-11 * a / gamma2
                assert abs(end.z / gamma2 - float(at.z_f)) < 1e-11 * end.z / gamma2
                sign = mp.sign(end.p)
                assert abs(sign * end.f / gamma2 - float(at.R_x0)) < 1e-11 * (abs(end.f) + end.v * a) / gamma2


def test_same_bytes_for_any_number_of_threads(tmp_path, equilibria_path, equilibria_grid):
    again = tmp_path / "again.nc"
    build_equilibria(again, grid=equilibria_grid, threads=1, progress=False)
    assert again.read_bytes() == equilibria_path.read_bytes()


@pytest.mark.parametrize("branch", ["median", "outward"])
def test_lookup_is_as_good_as_it_says(table, branch):
    lam, w_f, gamma = points(20_000, 3)
    found = table.fish(lam, w_f, gamma, branch, near="nan")
    nodes, exact = solve_branch(branch=branch, w_f=w_f, lam=lam, gamma=gamma)
    assert (exact.status == status.OK).all()
    inside = found.interpolated
    assert inside.mean() > (0.5 if branch == "median" else 0.98)
    assert (found.status[~inside] == status.NEAR_FOLD).all()
    np.testing.assert_array_equal(found.nodes[inside], nodes[inside])
    misses = np.max([np.abs(getattr(found, k) / getattr(exact, k) - 1) for k in ("x_f", "z_f")], axis=0)[inside]
    assert (misses <= found.error[inside]).mean() > 0.999
    assert misses.max() < table.positions.worst_error
    assert np.median(misses) < 1e-6
    # With the direct solution next to folds every point has an answer.
    whole = table.fish(lam, w_f, gamma, branch)
    assert (whole.status == status.OK).all()
    np.testing.assert_array_equal(whole.x_f[~inside], exact.x_f[~inside])


@pytest.mark.parametrize(
    ("lam", "w_f", "n"), [(9.0, 0.0, 1), (9.0, 0.0, 2), (7.3, 0.7, 1), (9.1, 5.0, 2), (3.3, 90, 1)]
)
def test_never_across_a_fold(table, lam, w_f, n):
    """However close to the critical speed, below it the shape before the jump, above it the one after."""
    gamma_c = float(towatlas.solve_critical(lam, w_f, n).gamma)
    distance = np.concatenate([-np.logspace(-1.5, -10, 60), np.logspace(-10, -1.5, 60)])
    gamma = gamma_c * (1 + distance)
    found = table.fish(lam, w_f, gamma)
    cables = {"lam": np.full(len(gamma), lam), "w_f": np.full(len(gamma), w_f), "gamma": gamma}
    np.testing.assert_array_equal(found.nodes, folds_passed(**cables))
    assert ((found.nodes == n) == (distance > 0)).all()
    assert (np.sign(found.x_f) == 1 - 2 * (found.nodes % 2)).all()
    at = [towatlas.equilibria(lam, w_f, g) for g in gamma[::10]]
    exact = np.array([e.x_f[e.expected] for e in at])
    np.testing.assert_allclose(found.x_f[::10], exact, rtol=2e-3)


def test_edges_and_outside(table, equilibria_grid):
    corner = table.fish(
        [equilibria_grid.lam[0], equilibria_grid.lam[-1]],
        [equilibria_grid.w_f[0], equilibria_grid.w_f[-1]],
        [equilibria_grid.gamma[0], equilibria_grid.gamma[-1]],
    )
    assert (corner.status == status.OK).all()
    for point, axis in (((0.9, 1, 1), "lam = 0.9"), ((2, 101, 1), "w_f = 101"), ((2, 1, 0.05), "gamma = 0.05")):
        with pytest.raises(ValueError, match=f'{axis} is outside the atlas, .* to .*outside="solve"'):
            table.fish(*point)
        assert table.fish(*point, outside="nan").status == status.OUTSIDE
        assert np.isnan(table.fish(*point, outside="nan").x_f)
        solved = table.fish(*point, outside="solve")
        e = towatlas.equilibria(*point)
        assert float(solved.x_f) == pytest.approx(e.x_f[e.expected], rel=1e-11)
    bad = table.fish([2.0, np.nan, -1.0, 2.0], [-1.0, 1, 1, 1], [1, 1, 1, np.inf], outside="solve")
    assert (bad.status == status.BAD_INPUT).all()
    with pytest.raises(ValueError, match=r"lam = nan is not finite.*\(1 of 2 points"):
        table.fish([2.0, np.nan], 1, 1)


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ({"branch": "upper"}, "branch must be one of outward, median"),
        ({"near": "guess"}, "near must be one of solve, nan"),
        ({"outside": "guess"}, "outside must be one of"),
        ({"gamma": "1"}, "gamma must be a real number"),
    ],
)
def test_bad_input(table, more, match):
    with pytest.raises(ValueError, match=match):
        table.fish(**{"lam": 2.0, "w_f": 1.0, "gamma": 1.0} | more)


def test_other_files_are_refused(equilibria_path, atlas_path, tmp_path):
    with pytest.raises(AtlasFileError, match=r"no fish positions, only critical speeds; .*--equilibria"):
        towatlas.open_atlas(atlas_path).fish(2.0, 1.0, 1.0)
    with pytest.raises(AtlasFileError, match="no critical speeds, only fish positions"):
        towatlas.open_atlas(equilibria_path).critical_speed(5.0, 1.0)
    assert towatlas.open_atlas(equilibria_path).holds == ("fish positions",)
    torn = tmp_path / "torn.nc"
    torn.write_bytes(equilibria_path.read_bytes()[:-1])
    with pytest.raises(AtlasFileError, match="damaged"):
        towatlas.open_atlas(torn)
    with pytest.raises(FileNotFoundError):
        towatlas.open_atlas(tmp_path / "none.nc")


def test_shell(capsys, equilibria_path, monkeypatch, tmp_path):
    system = ("fish", "--table", equilibria_path, "--lam", 8, "--wf", 1)
    code, out, err = run(capsys, *system, "--gamma", 0.9, "--json")
    rows = json.loads(out)
    assert (code, err) == (0, "")
    assert [row["branch"] for row in rows] == ["median", "outward"]
    assert rows[0]["nodes"] == 1
    e = towatlas.equilibria(8, 1, 0.9)
    assert rows[0]["x_f"] == pytest.approx(e.x_f[e.expected], rel=rows[0]["error"])
    code, out, _ = run(capsys, *system, "--gamma", 0.9, "--branch", "median")
    assert code == 0
    assert len(out.splitlines()) == 2
    code, out, err = run(capsys, *system, "--gamma", 50)
    assert (code, out) == (3, "")
    assert "outside the atlas" in err
    assert "--solve" in err
    assert run(capsys, *system, "--gamma", 50, "--solve")[0] == 0
    assert run(capsys, "fish", "--table", tmp_path / "no.nc", "--lam", 8, "--wf", 1, "--gamma", 1)[0] == 5
    code, out, _ = run(capsys, "info", equilibria_path)
    assert code == 0
    assert "0.1 .. 3.16228" in out
    code, _, err = run(capsys, "build", "--equilibria", "--method", "scan")
    assert code == 2
    assert "one method" in err


def test_the_shell_builds_it(capsys, monkeypatch, tmp_path, equilibria_grid):
    import towatlas.builders.fish as module

    small = {"w_f": equilibria_grid.w_f[:7], "lam": equilibria_grid.lam[:8], "gamma": equilibria_grid.gamma[:9]}
    monkeypatch.setattr(module, "EquilibriaGrid", lambda **axes: EquilibriaGrid(**small | axes))
    code, out, _ = run(capsys, "build", "--equilibria", "--quiet", "--out", tmp_path / "small.nc")
    assert code == 0
    assert "1008" in out
    read_sealed(tmp_path / "small.nc")


def test_cf_compliance(equilibria_path):
    checker = shutil.which("compliance-checker", path=os.path.dirname(sys.executable))
    assert checker, "compliance-checker is not installed: pip install towatlas[test]"
    done = subprocess.run(
        [checker, "-t", "cf:1.11", "-c", "strict", str(equilibria_path)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
    assert "All tests passed" in done.stdout
