"""The benchmarks, run once with small sizes so that they cannot rot. No test asserts a time."""

import csv

import numpy as np
import pytest

from benchmarks import (
    after_jump,
    digits,
    drag,
    figures,
    folds,
    lookup,
    methods_shots,
    peers_drag,
    peers_folds,
    peers_stability,
    report,
    samples,
    samples_drag,
    shots,
    stability,
    targets,
    targets_drag,
    validation,
    waiting,
)
from benchmarks.timing import LOST, Row
from towatlas import answer_scene, read_scene
from towatlas.limits import threshold_length


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return lookup.open_or_build(tmp_path_factory.mktemp("bench") / "atlas.nc")


@pytest.fixture(scope="module")
def shot_rows():
    return {(row.method, row.setting): row for row in shots.measure(rows=48, slow_rows=4, full=False)}


def test_the_files_hold_what_they_say():
    """Samples are drawn anew, three answers of each file computed anew."""
    exact = samples.shot_reference()
    a, mu, tau = samples.shots(samples.SHOTS)
    np.testing.assert_allclose(exact.tau, tau, rtol=1e-9)
    np.testing.assert_allclose(exact.a, a, rtol=1e-9)
    np.testing.assert_allclose(exact.mu, mu, rtol=1e-9)
    short = np.argsort(exact.tau / np.hypot(1.0, exact.a))[:3]
    for i, row in zip(short, samples.exact_shots(exact.a[short], exact.mu[short], exact.tau[short]), strict=True):
        assert exact.p[0][i] == float(row["p"])
        assert exact.q[0][i] == float(row["q"])
    critical = samples.fold_reference()
    n, w_f, lam = samples.cables(samples.FOLDS)
    for ours, drawn in ((critical.n, n), (critical.w_f, w_f), (critical.lam, lam)):
        np.testing.assert_allclose(ours, drawn, rtol=1e-12)


@pytest.mark.slow
def test_the_files_have_the_digits_that_they_say():
    """All 34 of them, by shots in 66: of the shortest shots, and of the fold nearest to its threshold, the hardest."""
    known = samples.columns(samples.DATA / "reference_shots.csv")
    a, mu, tau = samples.shots_of_file()
    i = np.argsort(tau / np.hypot(1.0, a))[:2]
    again = samples.exact_shots(a[i], mu[i], tau[i], digits.CHECK)
    assert [[known[name][j] for name in "pqf"] for j in i] == [[row[name] for name in "pqf"] for row in again]
    cables = samples.cables(samples.FOLDS)
    near = np.argmin(samples.fold_reference().lam - threshold_length(cables[1], cables[0]))
    row = samples.exact_folds(*(column[near : near + 1] for column in cables), digits.CHECK)[0]
    assert samples.columns(samples.DATA / "reference_folds.csv")["gamma"][near] == row["gamma"]


def test_every_method_converges_to_the_reference(shot_rows):
    """Each method, at its most accurate small setting, in the median; what it should be, not what it was."""
    bounds = {
        ("Taylor, this project", "order 20"): 1e-14,
        ("Taylor, other orders", "order 12"): 1e-14,
        ("order 8, adaptive", "rtol 1e-07"): 1e-6,
        ("SciPy DOP853", "rtol 1e-07"): 1e-5,
        ("SciPy LSODA", "rtol 1e-07"): 1e-4,
        ("RK4 forward (Skop)", "N = 100"): 1e-2,
        ("RK4 fish-up in t", "N = 100"): 1e-2,
        ("RK4 fish-up in sqrt(t)", "N = 100"): 1e-2,
        ("RK4 fish-up in sigma", "N = 100"): 1e-2,
    }
    for key, bound in bounds.items():
        assert shot_rows[key].quantile("p", 0.5) < bound, key


@pytest.mark.parametrize(("variable", "order"), [("t", 4), ("sqrt(t)", 4), ("sigma", 4)])
def test_runge_kutta_has_its_order(variable, order):
    shot = np.array([0.5]), np.array([2.0]), np.array([30.0])
    length = methods_shots.lengths(*shot)
    exact = methods_shots.march(*shot)[0][0]
    miss = [abs(methods_shots.rk4_fish_up(variable, *shot, length, n)[0][0] - exact) for n in (400, 800, 1600)]
    assert np.log2(miss[1] / miss[2]) == pytest.approx(order, abs=0.4)


def test_order_8_has_its_order():
    shot = np.array([0.5]), np.array([2.0]), np.array([30.0])
    exact = methods_shots.march(*shot)[0][0]
    miss = [abs(methods_shots.order_8(*shot, segments=n)[0][0] - exact) for n in (8, 16)]
    assert np.log2(miss[0] / miss[1]) > 7.0


def test_folds(table):
    rows = {row.method: row for row in folds.measure(table, rows=40, slow_rows=3, full=False)}
    assert rows["direct, table"].quantile("gamma", 1.0) < 1e-11
    assert rows["direct, one by one"].quantile("gamma", 1.0) < 1e-11
    assert rows["lookup from the atlas"].quantile("gamma", 1.0) < 1e-10
    assert rows["Skop's scan"].failures.endswith("of 3")


def test_peers_find_the_fold():
    """Where nothing is difficult, the SciPy methods are right."""
    assert peers_folds.by_root(1, 1.0, 10.0, rtol=1e-10) == pytest.approx(0.466173258416, rel=1e-8)
    near = np.log([0.95, 0.465])
    curve = peers_folds.bvp_curve(1, 1.0, np.array([10.0, 10.1]), near, tolerance=1e-6)
    assert curve[0] == pytest.approx(0.466173258416, rel=1e-6)


def test_the_files_with_drag_hold_what_they_say():
    """Systems are drawn anew, the shapes of a short shot and a fold computed anew."""
    exact = samples_drag.shape_reference()
    drawn = [samples_drag.SAMPLES[family](samples_drag.SYSTEMS) for family in samples_drag.FAMILIES]
    assert exact.systems == [system for systems, _ in drawn for system in systems]
    np.testing.assert_array_equal([given["gamma"] for given in exact.given], np.concatenate([g for _, g in drawn]))
    k = int(np.flatnonzero(exact.row == 8)[0])
    again = samples_drag.exact_shape(exact.exact[0][k], exact.given[8]["gamma"], exact.systems[8])
    assert np.longdouble(again) == pytest.approx(exact.exact[0][k], rel=1e-15)
    folds_ = samples_drag.fold_reference("octaves")
    gamma = float(folds_.exact[0][0])
    near = drag.towatlas.folds(gamma=(0.99 * gamma, 1.01 * gamma), **samples_drag.named(folds_.systems[0]))
    assert float(samples_drag.exact_fold(float(near.r_f[0]), gamma, folds_.systems[0])) == pytest.approx(
        gamma, rel=1e-15
    )


def test_equilibria_with_drag(tmp_path):
    rows = {row.method: row for row in drag.equilibria(np.array([3, 19, 42]), full=False)}
    for method in (drag.MANY, "equilibria, one a call"):
        assert rows[method].quantile("r_f", 1.0) < 1e-12
        assert rows[method].failures == "3 of 3 systems whole"
    # Where there is one shape, the SciPy methods find it.
    assert rows["SciPy up from the fish"].quantile("r_f", 0.5) < 1e-6
    assert rows["SciPy down from the tow"].quantile("r_f", 0.5) < 1e-6
    assert rows["SciPy solve_bvp"].quantile("r_f", 0.5) < 1e-3
    figures.drag_equilibria(list(rows.values()), tmp_path / "drag")
    assert {path.suffix for path in tmp_path.iterdir()} == {".svg", ".png"}


def test_folds_with_drag(tmp_path):
    pairs, octaves = drag.pairs(2, full=False), drag.octaves(1, full=False)
    worst = {row.method: row.quantile("gamma", 1.0) for row in (*pairs, *octaves)}
    assert worst[drag.PAIRS] < 1e-12
    assert worst[drag.OCTAVES] < 1e-12
    assert worst["counts of shapes"] < 1e-2
    assert worst["SciPy solve_ivp + root"] < 1e-6
    figures.drag_folds(pairs, octaves, tmp_path / "drag")


def test_a_bare_tip_of_the_peers_is_ours():
    system = samples_drag.System(3.0, 0.0, 0.0, C=1.0)
    found = drag.towatlas.equilibria(gamma=0.8, **samples_drag.named(system))
    radii = peers_drag.from_fish(system, 0.8, 1e-10, 20)
    np.testing.assert_allclose(radii, found.r_f, rtol=1e-8)


def test_targets_with_drag():
    assert all(target.value > 0.0 for target in targets_drag.measure(8, (2, 2), 16, full=False, growth=(1, 3)))


def test_growth_rates(tmp_path):
    """Each method converges; what its order says of it, not what it was."""
    rows = {row.method: row for row in stability.measure(full=False)}
    bounds = {
        stability.OURS: 1e-14,
        "Evans, SciPy DOP853": 1e-7,
        "Galerkin, panels of 5": 1e-6,
        "finite differences, eigs": 1e-3,
        "chain of links": 1e-2,
    }
    assert set(rows) == set(bounds)
    for method, bound in bounds.items():
        assert rows[method].quantile("sigma", 0.5) < bound, method
    figures.stability(list(rows.values()), tmp_path / "stability")
    assert {path.suffix for path in tmp_path.iterdir()} == {".svg", ".png"}


def test_finite_differences_are_of_second_order():
    case = stability.CASES[0]
    errors = [
        abs(peers_stability.by_finite_differences(case.found, case.found.expected, stability.reference()[0], n) - exact)
        for n in (100, 200)
        for exact in stability.reference()[:1]
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.2)


def test_the_file_of_growth_rates_holds_what_it_says():
    """The shortest of its shots computed anew, on a mesh that is none of this project's."""
    k = [case.name for case in stability.CASES].index("water")
    case, exact = stability.CASES[k], stability.reference()[k]
    again = peers_stability.exact(case.found, case.found.expected, exact * (1.0 + 1e-6), np.ones(40))
    assert abs(again - exact) < 1e-15


def test_lookup(table):
    rows, construct = lookup.measure(table, points=2000)
    worst = {row.method: row.quantile("gamma", 1.0) for row in rows}
    assert worst["this project"] < 1e-10
    assert worst["RegularGridInterpolator cubic"] < worst["RegularGridInterpolator linear"] < LOST
    assert worst["xarray.interp linear"] == pytest.approx(worst["RegularGridInterpolator linear"], rel=1e-6)
    assert set(construct) == set(worst) - {"this project"}
    assert all(target.value > 0.0 for target in targets.of_lookup(rows) + targets.of_one_lookup(lookup.of_one(table)))
    errors = lookup.whole_domain(table, 2000)
    assert errors.pop("error estimates that hold") == 1.0
    assert max(errors.values()) < 1e-8


def test_figures_and_tables(shot_rows, tmp_path, monkeypatch):
    rows = list(shot_rows.values())
    figures.shots(rows, tmp_path / "shots")
    assert {path.suffix for path in tmp_path.iterdir()} == {".svg", ".png"}
    monkeypatch.setattr(report, "DATA", tmp_path)
    report.chart_csv("shots", rows, shots.REFERENCE_METHOD)
    with (tmp_path / "shots.csv").open() as file:
        lines = list(csv.DictReader(line for line in file if not line.startswith("#")))
    assert len(lines) == len(rows)
    assert float(lines[0]["ratio"]) == 1.0
    table = report.chart_table(rows, shots.REFERENCE_METHOD, ["p", "q"]).splitlines()
    assert len(table) == 2 + len(rows)
    assert len({line.count("|") for line in table}) == 1
    document = tmp_path / "page.md"
    document.write_text("a\n<!-- x: written by make bench -->\nold\n<!-- end of x -->\nb\n")
    report.put(document, "x", "new\n")
    assert document.read_text() == "a\n<!-- x: written by make bench -->\nnew\n<!-- end of x -->\nb\n"


def test_lost_answers_are_counted_and_not_averaged():
    errors = np.array([1e-9, 1e-9, np.nan, 0.5])
    row = Row("m", "s", 4, {"p": errors}, 1.0)
    assert row.failure_rate == 0.5
    assert row.quantile("p", 0.5) == 1e-9
    assert row.columns(2.0)["ratio"] == "0.5"


def test_guard_names_what_got_worse(tmp_path, monkeypatch):
    path = tmp_path / "ratios.json"
    kept = [targets.Target("a", 10.0, 9.0), targets.Target("b", 10.0, None)]
    assert "no committed ratios" in targets.compare(kept, path)[0]
    targets.keep(kept, path)
    assert targets.kept(path)[targets.processor()] == kept
    assert "no ratio is worse" in targets.compare([targets.Target("a", 8.6, 9.0), kept[1]], path)[0]
    verdict = targets.compare([targets.Target("a", 8.4, 9.0)], path)
    assert verdict[0].startswith("WORSE: a")
    assert verdict[1] == "not measured: b"
    monkeypatch.setattr(targets, "processor", lambda: "another")
    assert targets.compare(kept, path)[0].startswith("not compared")


def test_each_processor_keeps_its_ratios(tmp_path, monkeypatch):
    """And what one of them does not reach is in the table, with its name."""
    path = tmp_path / "ratios.json"
    for name, value in (("first", 10.0), ("second", 8.0), ("second", 8.5)):
        monkeypatch.setattr(targets, "processor", lambda name=name: name)
        targets.keep([targets.Target("a", value, 9.0, f"of {name}"), targets.Target(name, 1.0, None)], path)
    entries = targets.kept(path)
    assert [entries[name][0].value for name in ("first", "second")] == [10.0, 8.5]
    table = report.ratios_table(entries).splitlines()
    assert table[0] == "| ratio | at least | first | second | | |"
    assert table[2] == "| a | 9 | 10 | 8.5 | not reached: second | of first |"
    assert table[4] == "| second |  |  | 1 | watched |  |"
    assert len({line.count("|") for line in table}) == 1


def test_waiting(tmp_path):
    """Of the shortest command; a command that was measured before is one that is measured."""
    assert set(waiting.before()) == set(waiting.COMMANDS)
    version = waiting.measure({"critical": "--version"}, repeats=1)
    assert version[0].cold > 0.0
    earlier = {"critical": waiting.Wait("critical", 12.0, float("nan"))}
    assert waiting.table(version, earlier).splitlines()[2].startswith("| critical | 12 s | ")
    figures.waiting([(version[0], earlier["critical"])], tmp_path / "waiting")
    assert {path.suffix for path in tmp_path.iterdir()} == {".svg", ".png"}


def test_targets_say_whether_they_are_reached():
    verdicts = [targets.Target("a", value, wanted).verdict for value, wanted in ((2.0, 1.0), (0.5, 1.0), (2.0, None))]
    assert verdicts == ["reached", "not reached", "watched"]
    assert all(target.value > 0.0 for target in targets.of_forward_shots(rows=64, segments=10))


def test_a_scene_beside_the_chain():
    """Extrapolation of second order leaves a tenth of what it changes at most, and all numbers are there."""
    found = validation.compare("skop-fig5", 40)
    assert [row.quantity for row in found] == ["fish from the axis", "its depth", "tow tension", "growth", "frequency"]
    assert all(row.apart < 0.1 * row.change / row.size for row in found)
    assert validation.table(found).count("skop-fig5") == 5


def test_speeds_that_change_in_moordyn():
    """A tenth of a turn, ever faster: all rows are there, and so is the angle that the speeds make."""
    pytest.importorskip("moordyn", reason="moordyn is not installed: pip install '.[peers]'")
    answer = answer_scene(read_scene("skop-fig3"), model="air", asked=("position",))
    speeds = answer.scene.speed * np.linspace(1.0, 1.1, 20)
    track = after_jump.march(answer, 10, 1e4, speeds)
    np.testing.assert_allclose(track.turns, np.cumsum(speeds) / answer.scene.speed / after_jump.ROWS, rtol=1e-12)
    assert np.isfinite([track.radius, track.depth, track.tension]).all()


def test_growth_of_a_swing_is_its_exponent():
    turns = np.arange(40 * after_jump.ROWS) / after_jump.ROWS
    swing = 1.0 + 1e-3 * np.exp(0.15 * turns) * np.cos(2.0 * np.pi * 3.0 / 7.0 * turns)
    track = after_jump.Track(turns, turns, turns, turns, swing)
    # A straight line taken off three periods takes some of a growing swing, the same share of each.
    assert after_jump.growth(track, 5, 30) == pytest.approx(0.15, rel=0.01)
