"""Growth rates and boundaries of flutter in an atlas: the file, its errors, its lookup, the shell."""

import json
import os
import shutil
import subprocess
import sys

import netCDF4
import numpy as np
import pandas as pd
import pytest
from helpers import SMALL_GRID, SMALL_SCAN, run

import towatlas
from towatlas import open_atlas
from towatlas.builders.critical import build_atlas
from towatlas.builders.grids import Grid, StabilityGrid
from towatlas.builders.stability import build_stability
from towatlas.kernels import status
from towatlas.limits import unchecked_threshold_length
from towatlas.tables.stability import GrowthGrid, StabilityAxes, sheet_at

# Of heavy fish, which one boundary begins in a narrow range of lengths.
TINY = StabilityGrid(
    n_max=1, axes=StabilityAxes(3.0, 10.0, 20.0, 1.005, 2.0), w_f=7, excess=6, speed=13, curves_every=3, checks=40
)
# Critical speeds to a part in a million, with which the table is looked up.
VACUUM = Grid(
    n_max=2, series_w_f=40, series_excess=40, error_blocks=2, w_f=np.array([0.0, 1.0]), lam=np.array([3.0, 9.0])
)


def build(path, **more):
    return build_stability(path, grid=TINY, vacuum=VACUUM, scan=SMALL_SCAN, progress=False, **more)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path = tmp_path_factory.mktemp("stability") / "atlas.nc"
    return path, build(path)


def cables(count, seed):
    """Random cables of the table, and speeds."""
    axes = TINY.axes
    y, x, v = np.random.default_rng(seed).uniform(-1.0, 1.0, (3, count))
    w_f = axes.w_f.value(y)
    lam = unchecked_threshold_length(w_f, 1) + axes.excess.value(x)
    return lam, w_f, np.exp(axes.root.value(v) ** 2) * towatlas.solve_critical(lam, w_f, 1).gamma


def test_nodes_are_not_mixed_with_those_of_another_kind():
    """A cubic is exact where all nodes about a cell are alike; a cell with two kinds has no answer."""
    y, x, v = np.meshgrid(*(np.linspace(-1.0, 1.0, k) for k in (5, 6, 7)), indexing="ij")
    square = 2.0 + 0.3 * y**3 - 0.2 * x * v**2
    unstable = np.full(y.shape, 2)
    unstable[-1, -1, -1] = 0
    grid = GrowthGrid(np.sqrt(square), np.sqrt(0.5 * square), unstable)
    at = np.array([-0.9, 0.9]), np.array([-0.7, 0.9]), np.array([0.3, 0.9])
    growth, frequency, count = grid.at(at)
    exact = 2.0 + 0.3 * at[0] ** 3 - 0.2 * at[1] * at[2] ** 2
    np.testing.assert_allclose([growth[0], frequency[0]], np.sqrt([exact[0], 0.5 * exact[0]]), rtol=1e-13)
    assert np.isnan([growth[1], frequency[1]]).all()
    assert count.tolist() == [2, -1]


def test_a_sheet_ends_where_its_nodes_do():
    y, x = np.meshgrid(np.linspace(-1.0, 1.0, 5), np.linspace(-1.0, 1.0, 6), indexing="ij")
    values = np.stack([y**3 + x, y + x])
    values[1, :, 3:] = np.nan
    assert sheet_at(values, 0.3, -0.1) == pytest.approx([0.3**3 - 0.1, np.nan], nan_ok=True)
    # Fewer than four nodes on one axis: a plane through two.
    assert sheet_at(values, 0.3, -0.5)[1] == pytest.approx(-0.2)


def test_growth_is_that_of_stability(file):
    table = open_atlas(file[0])
    lam, w_f, gamma = cables(60, 5)
    found = table.growth(lam, w_f, gamma, n=1, outside="nan")
    held = found.status == status.OK
    assert held.mean() > 0.4
    for k in np.flatnonzero(held)[:25]:
        direct = towatlas.stability(lam[k], w_f[k], gamma[k])
        at = list(direct.equilibria.branch).index("1 inner")
        assert found.unstable[k] == direct.unstable[at]
        assert abs(found.growth[k] - direct.growth[at]) < found.error[k]
        assert abs(found.frequency[k] - direct.frequency[at]) < found.error[k]
    # What is left out is solved, by another way than the list of all shapes.
    solved = table.growth(lam[~held][:3], w_f[~held][:3], gamma[~held][:3], n=1, outside="solve")
    assert (solved.status == status.OK).all()
    direct = towatlas.stability(lam[~held][0], w_f[~held][0], gamma[~held][0])
    at = list(direct.equilibria.branch).index("1 inner")
    assert solved.growth[0] == pytest.approx(direct.growth[at], abs=1e-9)


def growing(lam, w_f, gamma):
    """How many motions grow about the inner shape of one node."""
    found = towatlas.stability(lam, w_f, gamma)
    return int(found.unstable[list(found.equilibria.branch).index("1 inner")])


def test_at_boundaries_what_grows_changes(file):
    table, answered = open_atlas(file[0]), 0
    for lam, w_f, _ in zip(*cables(12, 8), strict=True):
        found = table.flutter(lam, w_f)
        for k, (gamma, error) in enumerate(zip(found.gamma, found.error, strict=True)):
            apart = np.abs(np.delete(found.gamma, k) / gamma - 1.0).min(initial=1.0)
            if error < 0.05 and apart > 4.0 * error:
                change = growing(lam, w_f, gamma * (1.0 + error)) - growing(lam, w_f, gamma * (1.0 - error))
                assert change == (2 if found.begins[k] else -2)
                answered += 1
    assert answered > 5


def test_a_boundary_is_an_edge_of_flutter(file):
    """`flutter` follows modes from speed to speed, and solves for the square of their distance."""
    lam, w_f = 8.0, 0.0
    found = open_atlas(file[0]).flutter(lam, w_f)
    gamma, error = found.gamma[0], found.error[0]
    windows = towatlas.flutter(lam, w_f, (gamma * (1.0 - error), gamma * (1.0 + error))).windows
    (edge,) = (w.low if found.begins[0] else w.high for w in windows if w.branch == "1 inner")
    assert abs(edge / gamma - 1.0) < error


def test_curves_are_solved_and_whole(file):
    """At lengths and weights of the nodes sheets and curves meet."""
    xarray = pytest.importorskip("xarray")
    with xarray.open_dataset(file[0], group="support/stability") as group:
        assert int(group.stability_row_size.sum()) == group.sizes["stability_point"]
        assert (group.stability_curve_error < 1e-8).all()
        assert set(group.stability_curve_w_f.values) <= set(group.stability_w_f.values[::3])
        assert not (group.stability_curve_start == 4).any()
        assert group.stability_complete.mean() > 0.9
        assert group.stability_growth.sel(stability_n=1).sizes["stability_w_f"] == TINY.w_f
        assert "are held" in group.attrs["checked"]


def test_nothing_is_extrapolated(file):
    table = open_atlas(file[0])
    threshold = float(unchecked_threshold_length(5.0, 1))
    fold = float(towatlas.solve_critical(threshold + 5.0, 5.0, 1).gamma)
    for cable, words in (
        ((threshold + 11.0, 5.0, 0.7, 1), "lam - lambda_c1 of 3 to 10"),
        ((threshold + 5.0, 25.0, 0.7), "w_f = 25 is outside"),
        ((threshold + 5.0, 5.0, 2.1 * fold, 1), "gamma / gamma_c1 of 1.005 to 2"),
        ((threshold + 5.0, 5.0, 1.001 * fold, 1), "gamma / gamma_c1 of 1.005 to 2"),
        ((threshold + 5.0, 5.0, 0.7, 2), "held are 1 to 1"),
        ((np.nan, 5.0, 0.7), "lam = nan"),
    ):
        with pytest.raises(ValueError, match=words):
            table.growth(*cable)
    # Up to the first critical speed there is one shape, and it is stable.
    slow = table.growth(threshold + 5.0, 5.0, 0.9 * fold)
    assert (int(slow.n), str(slow.kind), float(slow.growth), int(slow.status)) == (0, "stable", 0.0, status.OK)
    with pytest.raises(ValueError, match="boundaries are held for lam - lambda_c1 of 3 to 10"):
        table.flutter(threshold + 11.0, 5.0)
    with pytest.raises(ValueError, match="n = 2 is outside"):
        table.flutter(threshold + 5.0, 5.0, 2)
    edges = table.flutter(threshold + 5.0, 5.0)
    assert repr(edges).startswith(f"FlutterSpeeds, {len(edges.gamma)} edges\n")
    assert edges.to_dataframe().gamma.tolist() == edges.gamma.tolist()
    frame = pd.DataFrame({"w_f": 5.0, "gamma": 0.9 * fold, "lam": threshold + 5.0}, index=["a", "b"])
    assert table.growth(frame).kind.to_dict() == {"a": "stable", "b": "stable"}
    assert table.flutter(threshold + 11.0, 5.0, outside="nan").status == status.OUTSIDE
    assert table.flutter(0.5, 5.0).status == status.NO_TRANSITION


def test_no_answer_across_a_boundary(file):
    """Both sides of a boundary that is known: either the right one, or none."""
    table = open_atlas(file[0])
    for curve in towatlas.krein_boundaries(5.0):
        threshold = float(unchecked_threshold_length(5.0, 1))
        for k in np.flatnonzero((curve.lam - threshold > 3.0) & (curve.lam - threshold < 10.0))[::3]:
            for side in (0.98, 0.999, 1.001, 1.02):
                found = table.growth(curve.lam[k], 5.0, side * curve.gamma[k], n=1, outside="nan")
                if found.status == status.OK:
                    assert int(found.unstable) == growing(curve.lam[k], 5.0, side * curve.gamma[k])


@pytest.mark.slow
def test_the_same_bytes_for_any_number_of_threads(file, tmp_path):
    path, summary = file
    build(tmp_path / "one.nc", threads=1)
    assert (tmp_path / "one.nc").read_bytes() == path.read_bytes()
    assert "curves; error of gamma on sheets" in str(summary)


def test_a_damaged_file_is_refused(file, tmp_path):
    data = bytearray(file[0].read_bytes())
    with netCDF4.Dataset(file[0]) as whole:
        assert "stability" in whole["support"].groups
    data[len(data) // 2] ^= 1
    (tmp_path / "bad.nc").write_bytes(data)
    with pytest.raises(towatlas.AtlasFileError, match="damaged"):
        open_atlas(tmp_path / "bad.nc")


def test_cf_compliance(file):
    checker = shutil.which("compliance-checker", path=os.path.dirname(sys.executable))
    assert checker, "compliance-checker is not installed: pip install towatlas[test]"
    done = subprocess.run([checker, "-t", "cf:1.11", "-c", "strict", file[0]], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]


def test_shell(capsys, file, tmp_path):
    fold = float(towatlas.solve_critical(8.0, 5.0, 1).gamma)
    cable = "stability", "--lam", "8", "--wf", "5", "--atlas", file[0]
    code, out, err = run(capsys, *cable, "--gamma", 1.2 * fold, "--json")
    (row,) = json.loads(out)
    direct = json.loads(run(capsys, *cable[:-2], "--gamma", 1.2 * fold, "--json")[1])
    (mine,) = (one for one in direct if one["branch"] == "1 inner")
    assert code == 0
    assert row.keys() == mine.keys()
    assert (row["branch"], row["kind"], row["index"]) == (mine["branch"], mine["kind"], mine["index"])
    assert abs(row["frequency"] - mine["frequency"]) < row["error"]
    assert "looked up" in err
    code, out, _ = run(capsys, *cable, "--gamma", 1.2 * fold)
    assert (code, "1 inner" in out) == (0, True)
    code, out, err = run(capsys, *cable, "--gamma", 2.2 * fold)
    assert (code, out) == (3, "")
    assert "without --atlas it is computed" in err
    assert run(capsys, *cable, "--gamma", "0.5", "--C", "0.01")[0] == 2
    build_atlas(tmp_path / "plain.nc", grid=SMALL_GRID, scan=SMALL_SCAN, progress=False)
    code, _, err = run(capsys, *cable[:-1], tmp_path / "plain.nc", "--gamma", "0.5")
    assert code == 5
    assert "towatlas build --stability" in err
    code, out, _ = run(capsys, "info", file[0])
    assert (code, "growth rates checked" in out) == (0, True)
    for other in (("--method", "scan"), ("--equilibria",), ("--drag",)):
        assert run(capsys, "build", "--stability", *other, "--out", tmp_path / "none.nc")[0] == 2
    assert not (tmp_path / "none.nc").exists()
