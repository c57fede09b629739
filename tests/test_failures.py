"""Where methods fail: each failure shown to happen in the usual method, and not to happen in this program."""

import csv
import math

import mpmath as mp
import numpy as np
import pytest
import reference
from helpers import boundary_error, shoot
from hypothesis import example, given, settings
from hypothesis import strategies as st

import towatlas
from benchmarks import failures
from towatlas.kernels import status
from towatlas.limits import excess_length, long_cable, massless_cable, threshold_length
from towatlas.report.nrl7048.published import rk4_root


def exact_root(lam, w_f, gamma, x_f):
    """R_x0 of the equilibrium near a fish offset: Newton on shots of 34 digits."""
    with mp.workdps(34):
        gamma2 = mp.mpf(gamma) ** 2
        a, sign = abs(mp.mpf(x_f)) * gamma2, 1 if x_f > 0 else -1
        for _ in range(3):
            end = reference.shot(a, gamma2 * mp.mpf(w_f), gamma2 * mp.mpf(lam))
            a -= (end.p - sign * gamma2) / end.q
        return float(sign * (end.f + end.v * (sign * gamma2 - end.p) / end.q) / gamma2)


# Layers thinner than a step.


@pytest.mark.parametrize(("lam", "w_f", "gamma"), [(10.0, 1.0, 10.0), (5.0, 1.0, 20.0)])
def test_layers_thinner_than_a_step(lam, w_f, gamma):
    """Uniform steps in s: R_x crosses zero within less than one of a hundred. Nor do twice as many bring order four."""
    e = towatlas.equilibria(lam, w_f, gamma)
    # Two of them, the 34 digits take their time: the first of those with two nodes, and the one with most nodes.
    crossed = np.array([np.flatnonzero(e.nodes == 2)[0], e.nodes.argmax()])
    # The fish-up shots, steps even in d(sigma): 34 digits agree.
    exact = [exact_root(lam, w_f, gamma, e.x_f[k]) for k in crossed]
    assert np.abs(e.R_x0[crossed] / exact - 1).max() < 1e-12
    # Forward, from the true root: what should be zero is percents of the largest force there is.
    coarse, fine = (np.abs(boundary_error(w_f, lam, gamma, e.R_x0[crossed], k)) for k in (100, 200))
    assert coarse.max() > 0.01 * gamma**2
    assert (fine > coarse / 16).any()
    # And the root that 100 segments lead to, where there is one, is not the one of the equations.
    k = crossed[-1]
    off = abs(rk4_root(lam=lam, w_f=w_f, gamma=gamma, guess=e.R_x0[k]) - e.R_x0[k]) / e.tension[k]
    assert off > 1e-3


# The tip of a bare cable when R_x0 is no root.


@pytest.mark.parametrize("system", [(6.0, 0.0, 2.0)])
def test_tip_of_a_bare_cable(system):
    """Off a root the tension vanishes at the tip faster than R_x, dx/ds jumps, and the fourth order is lost."""
    lam, w_f, gamma = system
    e = towatlas.equilibria(*system)
    k = len(e) // 2
    segments = np.array([100, 800])
    beside = e.R_x0[k] * (1 - 1e-4)
    at_root = [abs(boundary_error(w_f, lam, gamma, e.R_x0[k], s)[0]) for s in segments]
    fine = boundary_error(w_f, lam, gamma, beside, 400_000)[0]
    off_root = [abs(boundary_error(w_f, lam, gamma, beside, s)[0] - fine) for s in segments]
    assert math.log2(at_root[0] / at_root[1]) / 3 > 3.3
    assert math.log2(off_root[0] / off_root[1]) / 3 < 0.5
    # From the tip up every shot is smooth, whatever its offset.
    a = abs(e.x_f[k]) * gamma**2 * (1 - 1e-4)
    ours, exact = shoot(a, 0.0, gamma**2 * lam), reference.shot(a, 0.0, gamma**2 * lam)
    assert abs(ours.p[0] - exact.p) < 1e-13 * exact.amplitude
    assert abs(ours.f[0] - exact.f) < 1e-13 * exact.amplitude * mp.sqrt(exact.r)


# Pairs closer than the scan.


@pytest.mark.parametrize(
    ("lam", "w_f", "gamma", "seen"),
    [(37.8, 1352.0, 5.94, 3), (10.0, 1.0, 0.466173258416 * (1 + 1e-7), 1), (50.0, 0.0, 15.0, None)],
)
def test_pairs_closer_than_the_scan(lam, w_f, gamma, seen):
    one = np.array([lam]), np.array([gamma])
    scanned = failures.scanned_roots(w_f, *one)[0]
    e = towatlas.equilibria(lam, w_f, gamma)
    assert len(scanned) < len(e)
    assert seen is None or len(scanned) == seen
    # Every one found by the count is a root of E of forward shots, of segments enough: a change of sign.
    if seen is not None:
        width = np.minimum(np.diff(e.R_x0, prepend=-np.inf), np.diff(e.R_x0, append=np.inf)) / 4
        width = np.minimum(width, np.abs(e.R_x0) * 1e-3)
        left, right = (boundary_error(w_f, lam, gamma, e.R_x0 + s * width, 20_000) for s in (-1, 1))
        assert (left * right < 0).all()
        assert (right[::2] > 0).all()


# Newton and bracketing at a fold.


def newton(lam, w_f, gamma, a, sign, rounds):
    """Newton's method on sign p(t_e; a) = gamma^2, with the exact slope; the offsets it passes."""
    path = [a]
    for _ in range(rounds):
        end = shoot(path[-1], w_f * gamma**2, lam * gamma**2)
        path.append(path[-1] - (end.p[0] - sign * gamma**2) / end.q[0])
    return np.array(path)


def test_newton_at_a_fold():
    """At the double root each round gains one bit, and half the digits are all there are; the fold has them all."""
    lam, w_f = 3.0, 1.0
    fold = towatlas.solve_critical(lam, w_f, 1)
    gamma, a = float(fold.gamma), abs(float(fold.x_f)) * float(fold.gamma) ** 2
    miss = np.abs(newton(lam, w_f, gamma, 1.1 * a, -1.0, 20) / a - 1)
    assert miss[1:12] / miss[:11] == pytest.approx(0.5, abs=0.05)
    assert miss.min() > 1e-9
    # A little below the fold, where there is no root, it wanders off and says nothing.
    lost = newton(lam, w_f, gamma * (1 - 1e-4), 1.1 * a, -1.0, 40)
    assert np.ptp(lost[-20:]) > 0.01 * a
    for error in reference.fold_error(1, w_f, lam, a, gamma):
        assert error < 1e-12


@pytest.mark.parametrize("distance", [0.0, 1e-9])
def test_bracketing_at_a_fold(distance):
    """A double root, or a pair about it, changes no sign on either side; the count tells none from two."""
    lam, w_f, n = 12.0, 5.0, 1
    fold = towatlas.solve_critical(lam, w_f, n)
    gamma = float(fold.gamma) * (1 + distance)
    around = float(fold.R_x0) * np.array([0.99, 1.01])
    left, right = boundary_error(w_f, lam, gamma, around, 2000)
    assert left * right > 0
    numbers = [len(towatlas.equilibria(lam, w_f, float(fold.gamma) * (1 + s * 1e-9))) for s in (-1, 1)]
    assert numbers == [1, 3]


# Interpolation across the threshold.


def test_interpolation_across_the_threshold(atlas_file):
    """gamma_cn is infinite at lambda_cn(w_f): a table in lambda and w_f answers where there is nothing, and wrongly."""
    w_f = 0.0
    lam = np.arange(1.6, 4.0, 0.1)
    nodes = towatlas.solve_critical(lam, w_f, 1).gamma
    table = lam[np.isfinite(nodes)], nodes[np.isfinite(nodes)]
    # No transition at 1.9, but linear interpolation, held at its last node, has one.
    assert np.isfinite(np.interp(1.9, *table))
    assert np.isnan(atlas_file.critical_speed(1.9, w_f, 1, outside="nan"))
    assert towatlas.solve_critical(1.9, w_f, 1).status == status.NO_TRANSITION
    # Between the threshold and its first nodes it is off by tens of percents.
    between = np.array([2.02, 2.05, 2.15])
    exact = towatlas.solve_critical(between, w_f, 1).gamma
    miss = np.abs(np.interp(between, *table) / exact - 1)
    assert (miss > [0.4, 0.2, 0.02]).all()
    assert np.abs(atlas_file.critical_speed(between, w_f, 1) / exact - 1).max() < 1e-10
    # Along w_f too: at lambda = 1.5 the transition begins at w_f = 0.75.
    weights = np.arange(0.0, 4.0, 0.5)
    speeds = towatlas.solve_critical(1.5, weights, 1).gamma
    some = np.isfinite(speeds)
    assert np.isfinite(np.interp(0.7, weights[some], speeds[some]))
    assert np.isnan(atlas_file.critical_speed(1.5, 0.7, 1, outside="nan"))
    exact = towatlas.solve_critical(1.5, 0.8, 1).gamma
    assert abs(np.interp(0.8, weights[some], speeds[some]) / exact - 1) > 0.3
    assert abs(atlas_file.critical_speed(1.5, 0.8, 1) / exact - 1) < 1e-10


# No fish, and almost none.


def naive_shot(a, mu, t_end, steps=4000):
    """p at t_end by Runge-Kutta steps even in the root of t, from the equations as they are written."""

    def slopes(root, f, p):
        t = root * root
        return 2 * root * p, -2 * root * f / np.sqrt(t * t + f * f)

    root, f, p = math.sqrt(mu), np.float64(mu * a), np.float64(a)
    h = (math.sqrt(t_end) - root) / steps
    with np.errstate(invalid="ignore"):
        for _ in range(steps):
            k1 = slopes(root, f, p)
            k2 = slopes(root + h / 2, f + h / 2 * k1[0], p + h / 2 * k1[1])
            k3 = slopes(root + h / 2, f + h / 2 * k2[0], p + h / 2 * k2[1])
            k4 = slopes(root + h, f + h * k3[0], p + h * k3[1])
            f = f + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
            p = p + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
            root += h
    return float(p)


def test_no_fish_and_almost_none():
    """Without a fish the equations begin with 0/0; a small one put in its place is an error of its own size."""
    a, t_end = 0.8, 25.0
    exact = reference.shot(a, 0.0, t_end)
    assert math.isnan(naive_shot(a, 0.0, t_end))
    instead = [abs(naive_shot(a, mu, t_end) - float(exact.p)) for mu in (1e-2, 1e-3)]
    assert instead[1] > 1e-4
    assert instead[0] / instead[1] == pytest.approx(10, rel=0.3)
    assert abs(shoot(a, 0.0, t_end).p[0] - exact.p) < 1e-14 * exact.amplitude
    # From no fish to some, in the shots and in the speeds, nothing jumps.
    mu = np.array([1e-300, 1e-12, 1e-9, 1e-6])
    for light, ours in zip(mu, shoot(a, mu, t_end).p, strict=True):
        assert abs(ours - reference.shot(a, light, t_end).p) < 1e-13 * exact.amplitude
    speeds = towatlas.solve_critical(10.0, [0.0, 5e-324, 1e-300, 1e-16], 3).gamma
    assert (np.abs(speeds / speeds[0] - 1) < 1e-14).all()


# A fish far heavier than the cable.


def test_cancellation_under_a_heavy_fish():
    """t - mu and sqrt(1 + w_f^2) - w_f as they are written lose what is left of the cable."""
    lam, w_f = 10.0, 1e12
    fold = towatlas.solve_critical(lam, w_f, 1)
    gamma2 = float(fold.gamma) ** 2
    mu, tau = gamma2 * w_f, gamma2 * lam
    assert abs(((mu + tau) - mu) / tau - 1) > 1e-6
    end = shoot(abs(float(fold.x_f)) * gamma2, mu, math.inf, 1, 1).folds[0, 0]
    assert abs(end[0] / abs(end[2]) / lam - 1) < 1e-12
    assert abs(float(fold.gamma) / float(massless_cable(lam)) - 1) < 1e-10
    assert 1 - 1e9 + math.sqrt(1 + 1e18) == 1.0
    with mp.workdps(40):
        beyond = mp.sqrt(1 + mp.mpf(1e9) ** 2) - mp.mpf(1e9)
        # lambda, the fish and so the threshold: what is asked for is known to its last digit.
        assert float(excess_length(1.0, 1e9, 1)) == pytest.approx(float(-beyond), rel=1e-14)


# The map.


def test_map_of_failures(tmp_path):
    """Small: at low speed the procedure finds all, to many digits; at high speed it does not, and invents some."""
    lam, gamma = np.array([10.0, 60.0]), np.array([0.2, 18.0])
    cells = failures.failure_map(1.0, lam, gamma)
    assert [(c.lam, c.gamma) for c in cells] == [(10.0, 0.2), (10.0, 18.0), (60.0, 0.2), (60.0, 18.0)]
    slow, fast, long_slow, long_fast = cells
    for c in (slow, long_slow):
        assert (c.found, c.false_roots) == (c.equilibria, 0)
        assert c.largest_error < 1e-6
        assert c.median_root_error < 1e-6
    assert [c.equilibria for c in cells] == [len(towatlas.equilibria(c.lam, 1.0, c.gamma)) for c in cells]
    assert fast.largest_error > 1e-4
    assert long_fast.found < long_fast.equilibria / 5
    assert long_fast.false_roots > 0
    path = tmp_path / "data" / "failures.csv"
    failures.write_csv({1.0: cells}, path)
    lines = path.read_text().splitlines()
    comments = [line for line in lines if line.startswith("#")]
    assert "100 segments" in comments[0]
    assert "200 guesses" in comments[0]
    rows = list(csv.DictReader(lines[len(comments) :]))
    assert [int(row["found"]) for row in rows] == [c.found for c in cells]
    assert "| 1 |" in failures.summary({1.0: cells})
    failures.draw({1.0: cells, 0.0: cells}, lam, gamma, [tmp_path / "a.svg", tmp_path / "a.png"])
    assert (tmp_path / "a.svg").read_text().count("<image") >= 6


def test_tables_of_the_page():
    """The page shows the numbers as they are recomputed, and the marks that the program writes between."""
    page = (failures.DOCS / "failures.md").read_text()
    assert failures.put(page, "published", failures.published_table()) == page
    assert failures.put(page, "summary", "") != page


def test_pairing_of_roots():
    """Nearest of the same slope; one root to an equilibrium; none beyond 1 % of the tension."""
    true = np.array([-100.0, 10.0, 200.0])
    judge = failures.judge
    assert judge(0.0, 1.0, 1.0, true, true).found == 3
    assert judge(0.0, 1.0, 1.0, true, true).largest_error == 0.0
    only = judge(0.0, 1.0, 1.0, true, np.array([200.1]))
    assert (only.found, only.false_roots) == (1, 0)
    assert only.median_root_error > 1
    far = judge(0.0, 1.0, 1.0, true, np.array([-100.0, 11.0, 200.0]))
    assert (far.found, far.false_roots) == (2, 1)
    crowd = judge(0.0, 1.0, 1.0, true, np.array([-100.1, -100.05, -100.0, 10.0, 200.0]))
    assert (crowd.found, crowd.false_roots) == (3, 2)


# The edges of what this program can do: a right number, a status, or a clear error, and soon.

ANY_SIZE = st.floats(-320, 308).map(lambda e: 10.0**e)
LARGE_OR_SMALL = st.floats(-10, 10).map(lambda e: 10.0**e)


@pytest.mark.slow
@given(lam=ANY_SIZE, w_f=st.one_of(st.just(0.0), ANY_SIZE), n=st.integers(1, 10**4))
def test_critical_state_of_any_size(lam, w_f, n):
    if not lam > 0:
        return
    state = towatlas.solve_critical(lam, w_f, n)
    assert int(state.status) in status.SENTENCES
    if state.status == status.OK:
        assert state.gamma > 0
        assert state.R_x0 < 0
        assert 0 < state.error <= 1e-4
        assert lam > threshold_length(w_f, n)
    else:
        assert np.isnan([state.gamma, state.R_x0, state.x_f, state.z_f, state.error]).all()


@pytest.mark.slow
@example(lam=1.0, w_f=0.0, gamma=1e-155)
@example(lam=1.0, w_f=0.0, gamma=1e-161)
@example(lam=2.5e-16, w_f=8.5e-11, gamma=57559.0)
@example(lam=0.05, w_f=2.6e86, gamma=5.7e-35)
@settings(max_examples=50)
@given(lam=LARGE_OR_SMALL, w_f=st.one_of(st.just(0.0), LARGE_OR_SMALL), gamma=LARGE_OR_SMALL)
def test_equilibria_of_any_size(lam, w_f, gamma):
    if not (lam > 0 and gamma > 0):
        return
    # As much work as a test has time for; beyond, until it is refused, it is more of the same.
    half_waves = gamma * (lam / (math.sqrt(w_f + lam) + math.sqrt(w_f)))
    if 3e4 < half_waves * (1 + min(lam, half_waves)) < 1e8:
        return
    try:
        e = towatlas.equilibria(lam, w_f, gamma)
    except towatlas.TooMuchWork:
        return
    except ArithmeticError as error:
        reason = str(error).split(": ", 1)[1]
    else:
        reason = ""
    if reason:
        assert reason in status.SENTENCES.values()
        return
    assert len(e) % 2 == 1
    assert np.isfinite([e.R_x0, e.x_f, e.z_f, e.tension]).all()
    assert (np.abs(e.x_f) <= (1 + lam) * (1 + 1e-12)).all()
    # The last step in the offset, up to 1e-8 of it, is made on z to first order.
    assert (e.z_f <= lam * (1 + 1e-8)).all()
    assert (e.z_f >= -1e-8 * lam).all()


@settings(max_examples=50)
@given(
    a=LARGE_OR_SMALL,
    mu=st.one_of(st.just(0.0), LARGE_OR_SMALL),
    tau=LARGE_OR_SMALL,
)
def test_shot_of_any_size(a, mu, tau):
    """Two programs of the same series: both give the same end or neither gives any."""
    from towatlas.solve.members import shoot_singly

    ours = shoot(a, mu, tau, max_steps=20_000)
    assert ours.status[0] in (status.OK, status.STEP_LIMIT, status.BAD_INPUT)
    if ours.status[0] == status.OK:
        assert np.isfinite([ours.p[0], ours.z[0], ours.q[0]]).all()
        assert 0 <= ours.z[0] <= tau * (1 + 1e-12)
        single, count, code = shoot_singly(np.array([a]), np.array([mu]), np.array([tau]))
        assert code[0] == status.OK
        assert count[0] == ours.count[0]
        amplitude = np.hypot(ours.p[0], ours.f[0] / np.sqrt(np.hypot(mu + tau, ours.f[0])))
        assert abs(single[0, 2] - ours.p[0]) <= 1e-12 * (1 + count[0]) * amplitude


# How far the accuracy goes: the table of docs/failures.md.


@pytest.mark.parametrize("n", [100, 10_000, 300_000])
def test_limit_in_n(n):
    """Folds of the linear shot against zeros of J0: rounding, not 1e-12, after 300 000 of them."""
    fold = shoot(1e-9, 0.0, math.inf, n, n).folds[0, 0, 0]
    assert abs(fold / float(long_cable(n)) - 1) < 4e-15


@pytest.mark.parametrize(
    ("lam", "w_f", "bound"),
    [(1e6, 0.0, 1e-12), (1e9, 0.0, 1e-10), (1e12, 0.0, 1e-8), (10.0, 1e15, 1e-14), (10.0, 1e30, 1e-12)],
)
def test_limit_in_length_and_weight(lam, w_f, bound):
    """Long bare cables: p at the fold is a^2 of the wave's amplitude, and a falls as lambda^(-1/3)."""
    fold = towatlas.solve_critical(lam, w_f, 1)
    a, gamma = abs(float(fold.x_f)) * float(fold.gamma) ** 2, float(fold.gamma)
    assert reference.fold_error(1, w_f, lam, a, gamma)[1] < bound


@pytest.mark.parametrize(("lam", "w_f"), [(1e15, 0.0), (1e100, 0.0), (10.0, 1e60), (10.0, 1e200)])
def test_beyond_the_limits_is_a_status(lam, w_f):
    fold = towatlas.solve_critical(lam, w_f, 1)
    assert fold.status == status.NOT_CONVERGED
    assert np.isnan(fold.gamma)


@pytest.mark.parametrize("gamma", [1e2, 1e5])
def test_limit_in_gamma(gamma):
    e = towatlas.equilibria(2.5, 1.0, gamma)
    exact = [exact_root(2.5, 1.0, gamma, x_f) for x_f in e.x_f]
    assert np.abs(e.R_x0 / exact - 1).max() < 1e-14
