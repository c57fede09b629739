"""Nothing a user calls takes for ever: it answers, or refuses with a reason, within the time it is given."""

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from helpers import run

import towatlas
from benchmarks import patience as random_commands
from towatlas import TooMuchWork, effort
from towatlas.commands import common
from towatlas.effort import check_foreseen, check_patience, patience, scaled
from towatlas.kernels import status
from towatlas.numerics.rows import EPS
from towatlas.scene.file import SceneFileError, make_scene, read_scene
from towatlas.scene.jumps import answer_scene
from towatlas.scene.units import parse_quantity
from towatlas.solve.batches import batches
from towatlas.solve.critical import solve_rows
from towatlas.solve.growth import Spectrum
from towatlas.solve.jets import jets_of
from towatlas.solve.members import expected_work, shoot_lanes, shoot_singly
from towatlas.solve.passed import folds_passed, guess_passed, guess_speed
from towatlas.solve.shots import STEPS, shoot
from towatlas.system import System

# What may be added to the patience: one call of a kernel, and slow machines.
SLACK = 10.0


@pytest.fixture
def clock(monkeypatch):
    """CPU time as the test says."""
    now = [0.0]
    monkeypatch.setattr(time, "process_time", lambda: now[0])
    return now


# The budget.


def test_a_budget_runs_out(clock):
    with patience(5.0):
        check_patience("waiting", "wait less")
        clock[0] += 5.1
        match = r"waiting, 2 of 7 done: not finished in 5 s of CPU; wait less, or go on with --patience SECONDS"
        with pytest.raises(TooMuchWork, match=match):
            check_patience("waiting", "wait less", done=2, of=7)
    check_patience("waiting", "wait less")


def test_the_outermost_budget_counts(clock):
    with patience(5.0), patience(math.inf), patience():
        clock[0] += 6.0
        with pytest.raises(TooMuchWork, match="in 5 s"):
            check_patience("waiting", "")
    with patience(math.inf), patience(5.0):
        clock[0] += 1e9
        check_patience("waiting", "")


def test_one_of_many_has_its_own_share():
    with patience(math.inf, each=60.0):
        assert scaled(10, 10**6) == 20
    with patience(90.0), patience(math.inf, each=60.0):
        assert scaled(10, 10**6) == 30
    with pytest.raises(ValueError, match="each must be"), patience(1.0, each=0.0):
        pass


def test_with_more_patience_longer_shots_with_drag_are_made():
    # A bare stranded cable in drag so strong that it trails along its circle with hardly any tension.
    row = System.of(lam=0.6, w_f=0.0, C=9600.0, C_s=330.0, b_s=0.16).row()
    with patience(30.0):
        few = shoot(1.1, 1.3, row, jets_of(0))
    with patience(300.0):
        more = shoot(1.1, 1.3, row, jets_of(0))
    assert (few.status[0], few.steps[0], more.status[0]) == (status.STEP_LIMIT, STEPS, status.OK)
    assert STEPS < more.steps[0] < 10 * STEPS


def test_what_is_foreseen_is_refused_at_once(clock):
    check_foreseen(1e9, "shapes", "")
    with patience(5.0):
        check_foreseen(4.0, "shapes", "")
        check_foreseen(float("nan"), "shapes", "")
        clock[0] += 2.0
        with pytest.raises(
            TooMuchWork, match=r"shapes, too many for the 3 s left of 5 s of CPU: 4 s or more; fewer, or go on"
        ):
            check_foreseen(4.0, "shapes", "fewer")
        with pytest.raises(TooMuchWork, match="a million s or more"):
            check_foreseen(1e300, "shapes", "fewer")


def test_limits_of_one_call_grow_with_patience():
    assert scaled(100, 1000) == 1000
    for seconds, limit in ((30.0, 100), (60.0, 200), (3.0, 10), (1e-9, 1), (1e9, 1000), (math.inf, 1000)):
        with patience(seconds):
            assert scaled(100, 1000) == limit


@pytest.mark.parametrize("bad", [0, -1.0, math.nan, "30", True, None])
def test_patience_is_a_positive_number(bad):
    with pytest.raises(ValueError, match="seconds must be a positive number"), patience(bad):
        pass


def test_listener_hears_of_work_and_of_its_end(clock):
    heard = []
    effort.listen(heard.append)
    try:
        with patience(5.0):
            with patience():
                check_patience("waiting", "", done=1, of=4)
            check_patience("again", "")
    finally:
        effort.listen(repr)
    assert [entry and entry.words for entry in heard] == ["waiting, 1 of 4 done", None, "again"]


# What takes long, in calls that do not.


def test_batches():
    rng = np.random.default_rng(3)
    work = np.append(10.0 ** rng.uniform(-2, 3, 500), [np.nan, 0.0, 1e300])
    parts = list(batches(work, 100.0))
    assert [part.start for part in parts[1:]] == [part.stop for part in parts[:-1]]
    assert (parts[0].start, parts[-1].stop) == (0, len(work))
    for part in parts:
        rows = np.minimum(np.nan_to_num(work[part]), 100.0)
        assert rows.sum() <= 100.0 * (1 + 1e-9) or len(rows) == 1
    assert list(batches(np.empty(0), 1.0)) == []


@pytest.mark.parametrize("shoot", [shoot_lanes, shoot_singly])
def test_batches_of_shots_are_the_same_bits(shoot, monkeypatch):
    rng = np.random.default_rng(4)
    a, mu, tau = (10.0 ** rng.uniform(*decades, 60) for decades in ((-3, 3), (-2, 2), (0, 5)))
    whole = shoot(a, mu, tau)
    monkeypatch.setattr("towatlas.solve.members.STEPS_IN_LANES", 3000)
    monkeypatch.setattr("towatlas.solve.members.STEPS_SINGLY", 3000)
    for one, other in zip(whole, shoot(a, mu, tau), strict=True):
        np.testing.assert_array_equal(one, other)


def test_batches_of_folds_are_the_same_bits(monkeypatch):
    n = np.arange(1, 60)
    cables = {"lam": np.full(len(n), 150.0), "w_f": np.full(len(n), 2.0), "n": n}
    cables["excess"] = cables["lam"] - 2.0 * n + 1.0 - (math.hypot(1.0, 2.0) - 2.0)
    whole = solve_rows(**cables)
    monkeypatch.setattr("towatlas.solve.critical.HALF_WAVES_A_CALL", 100)
    for name, column in solve_rows(**cables).items():
        np.testing.assert_array_equal(column, whole[name])


def test_expected_work():
    """Half waves fewer than there are, but not by much; a count is exact to one."""
    rng = np.random.default_rng(5)
    a, mu, tau = (10.0 ** rng.uniform(*decades, 200) for decades in ((-6, 6), (-6, 6), (0, 9)))
    half_waves, _ = expected_work(a, mu, tau)
    few = half_waves < 3000
    _, counts, codes = shoot_lanes(a[few], mu[few], tau[few])
    assert (codes == status.OK).all()
    assert few.sum() > 100
    assert (counts >= half_waves[few] - 1.0).all()
    assert (counts <= 1.5 * half_waves[few] + 1.0).all()


def test_a_shot_that_is_too_long_is_not_begun():
    with patience():
        began = time.process_time()
        ends, _, codes = shoot_singly(np.array([1.0, 1.0]), np.ones(2), np.array([1e18, 1.0]))
        assert time.process_time() - began < SLACK
    assert list(codes) == [status.STEP_LIMIT, status.OK]
    assert np.isnan(ends[0]).all()
    assert np.isfinite(ends[1]).all()


def test_critical_speeds_below_a_speed_are_counted_as_one_by_one():
    rng = np.random.default_rng(6)
    for lam, w_f, gamma in 10.0 ** rng.uniform([-1, -4, -2], [2, 4, 2], (100, 3)):
        n = np.arange(1, int(lam / 2) + 3)
        below = np.nan_to_num(towatlas.solve_critical(lam, w_f, n).gamma, nan=np.inf) < gamma
        assert (np.diff(below.astype(int)) <= 0).all()
        cable = {name: np.array([value]) for name, value in (("lam", lam), ("w_f", w_f), ("gamma", gamma))}
        assert folds_passed(**cable) == below.sum()


def test_guess_of_the_count_is_the_inverse_of_that_of_the_speed():
    n = np.arange(1, 400)
    cable = {"lam": np.full(len(n), 1000.0), "w_f": np.full(len(n), 3.0)}
    speed = guess_speed(**cable, n=n)
    for share, passed in ((1.0 + 1e6 * EPS, n), (1.0 - 1e6 * EPS, n - 1)):
        np.testing.assert_array_equal(guess_passed(**cable, gamma=speed * share), passed)


@pytest.mark.parametrize(("gamma", "passed"), [(1e-160, 0), (1e-9, 2**31 - 1), (1e300, 2**31 - 1)])
def test_guess_of_the_count_at_the_ends(gamma, passed):
    assert guess_passed(lam=np.array([1e300]), w_f=np.array([1.0]), gamma=np.array([gamma]))[0] == passed


# What was without end.


def table(**changes):
    scene = {
        "cable": {"length": "5000 km", "mass_per_length": "0.18 g/ft"},
        "fish": {"mass": "14 g"},
        "tow": {"radius": "1 m", "speed": "30 kn"},
        "fluid": {"name": "vacuum"},
    }
    for name, value in changes.items():
        section, _, key = name.partition("__")
        scene[section][key] = value
    return scene


def test_a_scene_names_its_keys_in_the_units_of_the_user():
    match = (
        r"cable.length = 5000 km with tow.radius = 1 m makes lam = 5e\+06, tow.speed = 30 kn makes gamma = 4.928\d+: "
        r"[\w ,]+, too many for 30 s of CPU: [\d,]+ s or more; a shorter cable"
    )
    began = time.process_time()
    with pytest.raises(TooMuchWork, match=match):
        answer_scene(make_scene(table()))
    assert time.process_time() - began < SLACK


def test_a_number_alone_is_named_with_its_unit():
    scene = make_scene(table(cable__length=5e6, tow__speed=15))
    assert scene.described().startswith("cable.length = 5e+06 m with tow.radius = 1 m makes lam = 5e+06, ")
    assert "tow.speed = 15 m/s makes gamma" in scene.described()
    assert "a speed of 3 m/s makes gamma" in scene.at(speed=3).described()
    assert "tow.gamma = 2.97 makes gamma = 2.97" in read_scene("skop-fig3").described()


def test_a_design_of_metres_for_inches():
    scene = read_scene("skop-fig3")
    with pytest.raises(TooMuchWork, match=r"--depth 25000 m, .*tow.radius = 11/16 in makes lam = .*too many to search"):
        towatlas.design(scene, 25000.0, model="vacuum")
    # Enough to find the cables; which of them last is not known of all.
    with patience(20.0):
        assert len(towatlas.design(scene, 25.0, model="vacuum").cables) == 7


@pytest.mark.parametrize(
    "text",
    [
        "1e999999999 m",
        "1e999999999/1e999999999 m",
        "1/1e999999999 m",
        "9" * 5000 + " m",
        "1 m**9**9**9**9",
        "1 m^(9^9^9^9)",
        "1 9**9**9**9 m",
        "1 " + "m " * 40 + "!",
        "1 " + "m" * 90 + "!",
        "1 " + "(" * 90,
        "1 (((Ym^9)^9)^9)^9",
        "1e300 Ym",
        10**400,
        pytest.param(16**20000, id="twenty thousand digits"),
    ],
)
def test_quantities_that_would_take_for_ever(text):
    began = time.process_time()
    with pytest.raises(ValueError, match="length = "):
        parse_quantity("length", text, "m")
    assert time.process_time() - began < SLACK


def test_a_number_too_small_is_zero():
    assert parse_quantity("length", "1e-999999999 m", "m") == 0.0


@pytest.mark.parametrize(
    ("unit", "wanted"),
    [("kg*m/s^2", "N"), ("(kg*m)/s**2", "N"), ("kg m s^-2", "N"), ("m^2·m^-1", "m"), ("1/m*m^2", "m"), ("µm", "m")],
)
def test_units_that_are_read(unit, wanted):
    assert parse_quantity("x", f"2 {unit}", wanted) == pytest.approx(2e-6 if unit == "µm" else 2.0)


@pytest.mark.parametrize(
    "content", ["gravity = " + "9" * 5000, "gravity = " + "[" * 5000, "title = '" + "x" * 10**6 + "'"]
)
def test_files_that_are_no_scene(tmp_path, content):
    path = tmp_path / "scene.toml"
    path.write_text(content)
    with pytest.raises(SceneFileError, match="is no scene"):
        read_scene(path)


# The shell.


def test_patience_in_the_shell(capsys):
    code, _, err = run(capsys, "equilibria", "--lam", 1e5, "--wf", 1, "--gamma", 100)
    assert code == 1
    assert "nodes, too many for 30 s of CPU" in err
    code, _, err = run(capsys, "equilibria", "--lam", 1e5, "--wf", 1, "--gamma", 100, "--patience", 7)
    assert "too many for 7 s" in err
    for bad in ("0", "-1", "nan", "long"):
        code, _, err = run(capsys, "equilibria", "--lam", 1, "--wf", 1, "--gamma", 1, f"--patience={bad}")
        assert code == 2
        assert "--patience" in err


def test_time_runs_out(capsys):
    began = time.process_time()
    code, _, err = run(capsys, "equilibria", "--lam", 2e4, "--wf", 1, "--gamma", 10, "--patience", 2)
    assert time.process_time() - began < 2.0 + SLACK
    assert code == 1
    assert "not finished in 2 s of CPU" in err


def test_an_order_too_high_says_that_patience_helps(capsys):
    code, _, err = run(capsys, "critical", "--lam", 1e9, "--wf", 1, "--n", 10**8, "--solve")
    assert code == 1
    assert "with more patience longer ones are made" in err


def test_points_of_a_shape_are_limited(capsys):
    code, _, err = run(capsys, "shape", "--lam", 3, "--wf", 1, "--gamma", 1, "--points", 10**9)
    assert code == 2
    assert "up to 1,000,000" in err


def test_a_bar_for_who_waits_at_a_terminal(monkeypatch, capsys, clock):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    with common.shown_progress(), patience(30.0), patience():
        check_patience("searching", "", done=1, of=2)
        assert capsys.readouterr().err == ""
        now[0] = clock[0] = 3.0
        check_patience("searching", "", done=1, of=2)
        now[0] = 4.0
        check_patience("within", "")
    assert "searching, 1 of 2 done: 3 of 30 s of CPU" in (said := capsys.readouterr().err)
    assert "within" not in said
    assert effort._listener is repr


def test_no_bar_where_nobody_sees_it(capsys, clock):
    with common.shown_progress(), patience(30.0):
        clock[0] = 20.0
        check_patience("searching", "", done=1, of=2)
    assert capsys.readouterr().err == ""


# Random commands.


def test_a_case_depends_on_the_seed_and_its_number_alone():
    some, more = (random_commands.cases(count, 7) for count in (5, 30))
    assert some == more[:5]
    assert {case.arguments[0] for case in random_commands.cases(200, 7)} == set(random_commands.COMMANDS)


@pytest.mark.slow
def test_random_commands_answer_or_refuse(tmp_path):
    """A hundred of those of benchmarks/patience.py, with less patience."""
    allowed = 2.0
    random_commands.make_tables(tmp_path)
    runs = []
    for case in random_commands.cases(100, 2026, ["vacuum"], allowed):
        runs.append(random_commands.run_case(case, tmp_path))
        assert 0 <= runs[-1].exit <= 5, runs[-1]
        assert runs[-1].seconds < allowed + SLACK, runs[-1]
        assert (runs[-1].exit == 0) or runs[-1].message, runs[-1]
    random_commands.write(runs, tmp_path / "runs.csv.gz")
    assert len(random_commands.summary(runs).splitlines()) > 20


@pytest.mark.slow
def test_a_worker_that_takes_too_long_is_killed_and_started_anew(monkeypatch):
    short = random_commands.Case(1, "vacuum", ["equilibria", "--lam=5", "--wf=1", "--gamma=1"], "")
    long = random_commands.Case(0, "vacuum", ["equilibria", "--lam=1e4", "--wf=1", "--gamma=10", "--patience=inf"], "")
    runs = list(random_commands.run_all([long, short, short], 1.0))
    assert runs[0].exit == random_commands.KILLED
    assert [run.exit for run in runs[1:]] == [0, 0]


def test_one_of_many_systems_is_given_up_and_the_others_are_as_without_it():
    speeds = [47.94544119868787, 0.5]
    with towatlas.patience(math.inf, each=0.05):
        found = towatlas.equilibria_many(166.20785511752527, 727.7026322970036, speeds, C=0.0027414292615361062)
    alone = towatlas.equilibria_many(166.20785511752527, 727.7026322970036, speeds[1:], C=0.0027414292615361062)
    assert found.status.values.tolist() == [status.UNFINISHED, status.OK]
    assert found["count"].values.tolist() == [0, 1]
    assert found.r_f.values[1, 0] == alone.r_f.values[0, 0]


def test_growth_rates_that_cannot_be_had_take_time_too():
    """A shape of too many steps has a status, and costs what they took: many such are no reason to go on."""
    system = System.of(10.0, 1.0)
    lost = replace(Spectrum(system, 1.4, 0.5, 1e-15).motion(1.0), status=status.STEP_LIMIT)
    assert Spectrum(system, 1.4, 0.5, 1e-15, bodies=(lost, lost)).status == status.STEP_LIMIT
    with patience(1e-9), pytest.raises(TooMuchWork, match="growth rates"):
        Spectrum(system, 1.4, 0.5, 1e-15, bodies=(lost, lost))
