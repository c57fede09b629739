"""Folds with drag: what happens at them, the cusp, the file, its lookup, the shell."""

import dataclasses
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
import reference_drag
from helpers import SMALL_GRID, SMALL_SCAN, run
from tqdm import tqdm

import towatlas
from towatlas import TooMuchWork, open_atlas
from towatlas.builders import drag_folds as drag_builder
from towatlas.builders import drag_series
from towatlas.builders.critical import build_atlas
from towatlas.builders.drag_folds import build_drag
from towatlas.builders.grids import DragGrid
from towatlas.commands import critical_drag
from towatlas.kernels import status
from towatlas.solve.drag_folds import _cusp_equations, _cusp_errors, solve_cusps, solve_drag_folds, trace_folds
from towatlas.system import System

# Of a file that takes half a minute.
pytestmark = pytest.mark.slow

TINY = DragGrid(
    n_max=1,
    lam_min=12.0,
    lam_max=14.0,
    w_f_max=1.0,
    stages=((2, 2), (4, 3)),
    series_sigma=8,
    checks=6,
    traced_checks=2,
    looked=2,
    error_blocks=2,
    w_f=np.array([0.0, 1.0]),
    lam=np.array([12.0, 14.0]),
    C=np.array([0.0, 0.01, 0.03, 0.1]),
)


def build(path, grid=TINY, **more):
    return build_drag(path, grid=grid, vacuum=SMALL_GRID, scan=SMALL_SCAN, progress=False, **more)


@pytest.fixture(scope="module")
def drag_file(tmp_path_factory):
    path = tmp_path_factory.mktemp("drag") / "atlas.nc"
    return path, build(path)


@pytest.mark.parametrize(("lam", "w_f", "C", "n"), [(37.8, 1352, 0.01, 2), (10, 0, 0.03, 1)])
def test_two_equilibria_more_and_two_fewer(lam, w_f, C, n):
    """The search in the radius of the fish, which knows nothing of folds, finds what they say."""
    folds = solve_drag_folds(lam, w_f, C, n)
    appears, ends = float(folds.appears), float(folds.ends)
    count = [len(towatlas.equilibria(lam, w_f, g, C=C)) for g in (appears * 0.9999, appears * 1.0001)]
    assert count[1] == count[0] + 2
    count = [len(towatlas.equilibria(lam, w_f, g, C=C)) for g in (ends * 0.9999, ends * 1.0001)]
    assert count[1] == count[0] - 2


def test_from_the_vacuum_to_the_cusp():
    faint = solve_drag_folds(37.8, 1352, [0.0, 1e-9, 1e-5], 2)
    vacuum = towatlas.solve_critical(37.8, 1352, 2)
    assert faint.appears[0] == float(vacuum.gamma)
    np.testing.assert_allclose(faint.appears, float(vacuum.gamma), rtol=1e-8)
    assert (faint.status_ends == status.NEVER_ENDS).all()
    cusp = float(faint.C_cusp[0])
    # The speeds of both folds meet at the cusp like (C* - C)^(3/2).
    near = solve_drag_folds(37.8, 1352, cusp * (1 - np.array([1e-2, 1e-4, -1e-6])), 2)
    gap = near.ends[:2] - near.appears[:2]
    assert (gap > 0).all()
    assert gap[0] / gap[1] == pytest.approx(1000, rel=0.1)
    assert near.status[2] == near.status_ends[2] == status.NO_PAIR
    assert np.isnan(near.appears[2])
    assert near.sentence(2) == status.SENTENCES[status.NO_PAIR]


def test_the_report_s_cable():
    """At C = 0.018 the second pair is gone, the third comes and goes, the first stays for good."""
    folds = solve_drag_folds(37.8, 1352, 0.018, [1, 2, 3])
    assert list(folds.status) == [status.OK, status.NO_PAIR, status.OK]
    assert list(folds.status_ends) == [status.NEVER_ENDS, status.NO_PAIR, status.OK]
    assert folds.C_cusp[1] == pytest.approx(0.0141650, rel=1e-5)
    assert 6.5 < folds.appears[2] < folds.ends[2] < 7.1


# Derivatives from thirteen values H apart, exact to the twelfth order: with nine, 0.005 apart, the first was off by up
# to 2e-13, and with smaller H the rounding of long doubles is as much.
FIRST = np.array([5, -72, 495, -2200, 7425, -23760, 0, 23760, -7425, 2200, -495, 72, -5], np.longdouble) / 27720
SECOND = np.array([-50, 864, -7425, 44000, -222750, 1425600, 0], np.longdouble) / 831600
SECOND = np.concatenate([SECOND[:6], [-2 * SECOND.sum()], SECOND[5::-1]])
H = np.longdouble(0.007)


@pytest.mark.parametrize(("lam", "w_f", "n"), [(37.8, 1352.0, 2), (10.0, 0.0, 1), (20.0, 5.0, 2)])
def test_cusps_within_their_error(lam, w_f, n):
    """Shots in long double about the cusp, differences for slopes: C*_n is off by no more than the error says."""
    cable = {"lam": np.array([lam]), "w_f": np.array([w_f])}
    cusps, _ = solve_cusps(*trace_folds(**cable, n=np.array([n])), **cable)
    log_r, log_gamma, log_c = cusps[0].astype(np.longdouble)
    gamma, system = np.exp(log_gamma), System(lam, w_f, w_f, C=np.exp(log_c))
    around = [reference_drag.shot(np.exp(log_r + k * H) / gamma**2, gamma, system)[:2] for k in range(-6, 7)]
    values = np.array([np.log(x * x + y * y) / 2 for x, y in around])
    residual = np.array([values[6], FIRST @ values / H, SECOND @ values / (2 * H * H)], float)
    _, jacobian, _ = _cusp_equations(cusps, **cable)
    moved = np.linalg.solve(jacobian[0], -residual)[2]
    error = _cusp_errors(cusps, **cable)[0]
    assert abs(moved) <= error < 1e-9
    assert float(solve_drag_folds(lam, w_f, 0.01, n).error_cusp) == error


def test_where_there_is_none():
    folds = solve_drag_folds([1.5, 3.0], 0.0, 0.05, 1)
    assert folds.status[0] == status.NO_TRANSITION
    assert np.isnan(folds.appears[0])
    # A short cable's fold leaves to infinite speed instead of turning at a cusp.
    assert folds.status_cusp[1] == status.NO_CUSP
    assert folds.status[1] == status.OK
    with pytest.raises(ValueError, match="C must be finite and not negative"):
        solve_drag_folds(5, 1, -1)
    with pytest.raises(ValueError, match="whole number from 1"):
        solve_drag_folds(5, 1, 1, 0)


def test_lookup_within_its_error(drag_file):
    table = open_atlas(drag_file[0])
    rng = np.random.default_rng(3)
    lam, w_f = rng.uniform(12, 14, 8), rng.uniform(0, 1, 8)
    cusp = table.folds(lam, w_f, 0.0).C_cusp
    c = cusp * np.array([0.01, 0.3, 0.5, 0.7, 0.78, 0.85, 0.95, 2.0])
    found = table.folds(lam, w_f, c)
    direct = solve_drag_folds(lam, w_f, c)
    np.testing.assert_array_equal(found.status, direct.status)
    assert found.status[-1] == status.NO_PAIR
    assert (np.abs(found.C_cusp / direct.C_cusp - 1) < found.error_cusp).all()
    solved = found.status == status.OK
    assert (np.abs(found.appears / direct.appears - 1) < found.error)[solved].all()
    there = found.status_ends == status.OK
    assert list(there) == [False, False, True, True, True, True, True, False]
    for name in ("status_ends", "status_again", "status_cusp"):
        np.testing.assert_array_equal(getattr(found, name), getattr(direct, name))
    assert (np.abs(found.ends / direct.ends - 1) < found.error_ends)[there].all()
    assert (np.abs(found.r_f_ends / direct.r_f_ends - 1) < 0.02)[there].all()
    assert (np.abs(found.C_lasting / direct.C_lasting - 1) < found.error_lasting).all()
    # Of a file as small as this; what a real one states is in docs/drag.md.
    assert (found.error[solved] < 2e-3).all()
    assert (found.error_cusp < 0.01).all()


def test_a_prediction_that_fails_is_traced(monkeypatch):
    """With no trust in the predictions every cable is traced, and the answers are the same."""
    grid = dataclasses.replace(TINY, stages=((2, 2), (3, 2)), series_sigma=5)
    predicted = drag_series.fit_series(grid, 1, tqdm(disable=True))
    traced = []
    trace = drag_series._traced
    monkeypatch.setattr(drag_series, "STRAYED", 0.0)

    def counted(cables, *rest):
        traced.append(len(cables))
        return trace(cables, *rest)

    monkeypatch.setattr(drag_series, "_traced", counted)
    again = drag_series.fit_series(grid, 1, tqdm(disable=True))
    assert traced == [4, 6]
    for name in ("gamma", "r_f", "C_cusp", "C_by_speed", "r_f_by_speed"):
        np.testing.assert_allclose(getattr(again, name), getattr(predicted, name), rtol=0, atol=1e-7)


# A cable whose second pair ends and appears again.
RETURNING = dataclasses.replace(
    TINY, n_max=2, lam_min=17.5, lam_max=18.5, w_f_max=0.5, stages=((5, 4),), series_speed=24, looked=1
)
CABLE = 17.9, 0.321


def test_a_pair_that_appears_again():
    """Between C of the least drag at which it ends and that at infinite speed; by counting shapes, too."""
    folds = solve_drag_folds(*CABLE, [0.0255, 0.0265, 0.0275, 0.03], 2)
    assert list(folds.status_ends) == [status.NEVER_ENDS] + [status.OK] * 3
    assert list(folds.status_again) == [status.NEVER_ENDS, status.OK, status.OK, status.NOT_AGAIN]
    assert folds.C_lasting[0] == pytest.approx(0.02595368, rel=1e-6)
    for C, ends, again in zip((0.0265, 0.0275), folds.ends[1:3], folds.again[1:3], strict=True):
        all_of_them = towatlas.folds(*CABLE, (0.99 * ends, 1.01 * again), C=C)
        of_pair = all_of_them.part(all_of_them.n == 2)
        np.testing.assert_allclose(of_pair.gamma, [ends, again], rtol=1e-11)
        assert list(of_pair.shapes_above - of_pair.shapes_below) == [-2, 2]
        count = [len(towatlas.equilibria(*CABLE, g, C=C)) for g in (again * 0.999, again * 1.001)]
        assert count[1] == count[0] + 2


def test_a_table_over_a_pair_that_appears_again(tmp_path, capsys):
    build(tmp_path / "drag.nc", RETURNING)
    table = open_atlas(tmp_path / "drag.nc")
    C = [0.025, 0.0265, 0.027, 0.0275, 0.03, 0.05]
    found, direct = table.folds(*CABLE, C, 2, outside="nan"), solve_drag_folds(*CABLE, C, 2)
    for side in ("ends", "again"):
        codes, right = (getattr(folds, f"status_{side}") for folds in (found, direct))
        # What the error leaves open is not told.
        told = codes != status.OUTSIDE
        np.testing.assert_array_equal(codes[told], right[told])
        there = codes == status.OK
        assert there.sum() >= 2
        wrong = np.abs(getattr(found, side) / getattr(direct, side) - 1)[there]
        assert (wrong < getattr(found, f"error_{side}")[there]).all()
    code, out, err = run(
        capsys, "critical", "--lam", 17.9, "--wf", 0.321, "--C", 0.027, "--atlas", tmp_path / "drag.nc"
    )
    assert (code, out.count("vacuum")) == (0, 3)
    assert "at 1 cables" in err


def test_a_table_that_contradicts_the_folds_is_not_built(monkeypatch, tmp_path):
    found = drag_builder.folds_in_speed
    monkeypatch.setattr(drag_builder, "folds_in_speed", lambda *args, **more: found(*args, **more).part([]))
    with pytest.raises(ArithmeticError, match="are not among"):
        build(tmp_path / "drag.nc")
    assert not list(tmp_path.iterdir())


def test_nothing_is_extrapolated(drag_file):
    table = open_atlas(drag_file[0])
    for cable, message in (((15, 0, 0.01), "lam = 15"), ((13, 2, 0.01), "w_f = 2"), ((13, 0, 0.01, 2), "n = 2")):
        with pytest.raises(ValueError, match=message):
            table.folds(*cable)
        assert table.folds(*cable, outside="nan").status == status.OUTSIDE
    cusp = float(table.folds(13, 0.5, 0).C_cusp)
    with pytest.raises(ValueError, match=r"closer to C\*_1"):
        table.folds(13, 0.5, cusp)
    bad = table.folds([np.nan, -1.0, 13.0, 13.0], [0.0, 0.0, -1.0, 0.5], 0.01, outside="nan")
    assert list(bad.status) == [status.BAD_INPUT] * 3 + [status.OK]
    assert list(bad.status_ends[:3]) == [status.BAD_INPUT] * 3
    assert np.isnan([bad.appears[:3], bad.error[:3], bad.C_cusp[:3]]).all()
    with pytest.raises(ValueError, match="lam = nan is not finite and positive"):
        table.folds(np.nan, 0.0, 0.01)
    short = table.folds(2.0, 0.0, 0.1, 3)
    assert short.status == short.status_ends == short.status_cusp == status.NO_TRANSITION
    gone = table.folds(13, 0.5, 2 * cusp)
    assert (gone.status, np.isnan(gone.error)) == (status.NO_PAIR, True)
    assert gone.sentence(of="ends") == status.SENTENCES[status.NO_PAIR]
    assert gone.sentence(of="cusp") == "computed"
    solved = table.folds([15, 13], 0.0, 0.01, outside="solve")
    assert (solved.status == status.OK).all()
    assert solved.appears[0] == float(solve_drag_folds(15, 0, 0.01).appears)


def test_the_same_bytes_for_any_number_of_threads(drag_file, tmp_path):
    path, summary = drag_file
    build(tmp_path / "one.nc", threads=1)
    assert (tmp_path / "one.nc").read_bytes() == path.read_bytes()
    assert "drag" in str(summary)
    assert "of C*_n: median" in str(summary)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    (tmp_path / "bad.nc").write_bytes(data)
    with pytest.raises(towatlas.AtlasFileError, match="damaged"):
        open_atlas(tmp_path / "bad.nc")


def test_a_grid_over_the_end_of_a_cusp_is_refused(tmp_path):
    short = dataclasses.replace(TINY, lam_min=2.5, lam_max=4.0, stages=((2, 2),))
    with pytest.raises(ArithmeticError, match="no cusp"):
        build(tmp_path / "drag.nc", short)
    assert not list(tmp_path.iterdir())


def test_an_atlas_without_drag_says_how_to_get_it(capsys, tmp_path, drag_file):
    atlas_path = tmp_path / "vacuum.nc"
    build_atlas(atlas_path, grid=SMALL_GRID, scan=SMALL_SCAN, progress=False)
    with pytest.raises(towatlas.AtlasFileError, match="only critical speeds; `towatlas build --drag`"):
        open_atlas(atlas_path).folds(13, 0.5, 0.01)
    code, _, err = run(capsys, "critical", "--lam", "13", "--wf", "0.5", "--C", "0.01", "--atlas", atlas_path)
    assert code == 5
    assert "towatlas build --drag" in err
    # With drag it is an atlas like any other.
    vacuum, gamma = towatlas.open_atlas(drag_file[0]), float(towatlas.solve_critical(8, 0.5).gamma)
    assert vacuum.critical_speed(8, 0.5) == pytest.approx(gamma, rel=float(vacuum.error(8, 0.5)))


def test_plain_reader(drag_file):
    import xarray

    with xarray.open_dataset(drag_file[0], group="support/drag") as group:
        at = group.sel(drag_n=1, drag_w_f=0, drag_lam=12)
        assert float(at.appears.sel(drag_C=0)) == pytest.approx(float(towatlas.solve_critical(12, 0).gamma), rel=1e-4)
        assert np.isnan(at.appears.sel(drag_C=0.1))
        assert float(at.C_cusp) == pytest.approx(float(solve_drag_folds(12, 0, 0.01).C_cusp), rel=1e-2)


def test_cf_compliance(drag_file):
    checker = shutil.which("compliance-checker", path=os.path.dirname(sys.executable))
    assert checker, "compliance-checker is not installed: pip install towatlas[test]"
    done = subprocess.run([checker, "-t", "cf:1.11", "-c", "strict", drag_file[0]], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
    assert "All tests passed" in done.stdout


def test_shell(capsys, drag_file, tmp_path, monkeypatch):
    cable = "critical", "--lam", "13", "--wf", "0.5", "--atlas", drag_file[0]
    code, out, _ = run(capsys, *cable, "--C", "0.01", "--n", "1", "--json")
    answer = json.loads(out)
    (fold,), (cusp,) = answer["folds"], answer["cusps"]
    assert (code, fold["status"], fold["n"], fold["change"], cusp["status_ends"]) == (0, "computed", 1, 2, "never_ends")
    code, out, err = run(capsys, *cable, "--C", "0.01", "--solve")
    assert code == 0
    assert f"{fold['gamma']:.3f}"[:4] in out
    assert "1 to 3" in out
    assert f"C*_1 = {cusp['C_cusp']:.4f}"[:12] in out
    assert "all shapes at" in err
    # What takes too long is said, and the pairs are answered.

    def refuse(*arguments, **more):
        raise TooMuchWork("too long")

    monkeypatch.setattr(critical_drag, "folds", refuse)
    code, out, err = run(capsys, *cable, "--C", "0.01", "--solve")
    assert (code, "+2" in out, "too long" in err) == (0, True, True)
    assert run(capsys, *cable, "--C", "0.01", "--n", "2")[0] == 3
    code, _, err = run(capsys, *cable, "--C", "1", "--n", "1")
    assert code == 4
    assert "too much drag" in err
    assert run(capsys, *cable, "--C", "-1")[0] == 2
    for other in (("--method", "scan"), ("--equilibria",)):
        assert run(capsys, "build", "--drag", *other, "--out", tmp_path / "none.nc")[0] == 2
    assert not (tmp_path / "none.nc").exists()
    code, _, err = run(capsys, "plot", "drag", "--out", tmp_path / "drag.svg")
    assert code == 0
    assert (tmp_path / "drag.svg").stat().st_size > 5000


def test_a_pair_that_appears_beyond_the_speeds_looked_at(capsys):
    """There is nothing to follow from the vacuum on, and that is said."""
    found = towatlas.solve_drag_folds(5.91588, 9749.99, 0.0146273, [1, 2, 3])
    assert list(found.status) == [status.OK, status.BEYOND, status.BEYOND]
    assert (towatlas.solve_critical(5.91588, 9749.99, [2, 3]).gamma > 50.0).all()
    assert np.isnan(found.appears[1:]).all()
    for cable in (("--lam=6.52262", "--wf=14342.7", "--C=3.7385e-07"), ("--lam=5.9", "--wf=9750", "--n=2", "--C=0.01")):
        code, _, err = run(capsys, "critical", *cable, "--solve")
        assert code == (0 if "--n=2" not in cable else 4)
        assert "beyond the highest speed" in err
