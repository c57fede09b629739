"""Fish-up shots: accuracy, limits, counts, statuses."""

import math

import mpmath as mp
import numpy as np
import pytest
import reference
from helpers import boundary_error, shoot
from hypothesis import given
from hypothesis import strategies as st

from towatlas.kernels import status
from towatlas.kernels.compiling import opened
from towatlas.kernels.steppers import make_taylor_step
from towatlas.kernels.sweeps import limited_threads

EPS = 2.0**-52

# a, mu, tau: the corners that are hard. Layers thinner than any uniform step; the removable 0/0 at the bare tip, and
# fish so light that they differ from it by less than rounding; a fish far heavier than the cable; many nodes.
HARD = {
    "bare tip, small": (1e-6, 0.0, 30.0),
    "bare tip": (0.7, 0.0, 40.0),
    "bare tip, layers": (900.0, 0.0, 1.6e4),
    "bare tip, thin layers": (3e7, 0.0, 2e8),
    "whole shot inside the tip series": (2.0, 0.0, 1e-6),
    "feather": (0.7, 1e-300, 40.0),
    "feather, layers": (1e4, 1e-12, 1e5),
    "very light fish": (0.7, 1e-8, 40.0),
    "very light fish, hardly any cable": (0.7, 1e-10, 1e-11),
    "light fish": (5.0, 1e-3, 300.0),
    "fish of the report": (20.0, 1352 * 5.94**2, 37.8 * 5.94**2),
    "heavy fish, short cable": (3.0, 1e4, 0.5),
    "heavy fish, no cable to speak of": (1e-3, 1e8, 1e-4),
    "heavy fish, fast": (1e6, 1e12, 1e9),
    "far overshot": (1e8, 1e12, 1e5),
    "many nodes": (1e-3, 0.0, 4000.0),
    "slow": (1e-4, 1e-4, 1e-2),
}


@pytest.mark.parametrize("case", HARD)
def test_shot_against_mpmath(case):
    a, mu, tau = HARD[case]
    ours = shoot(a, mu, tau)
    exact = reference.shot(a, mu, tau)
    assert ours.status[0] == status.OK
    # 1e-13 of the local amplitude, or what one rounding of the offset does to the shot.
    amplitude = float(exact.amplitude)
    assert abs(ours.p[0] - exact.p) <= max(1e-13 * amplitude, 4 * EPS * a * abs(float(exact.q)))
    f_amplitude = float(mp.sqrt(exact.r)) * amplitude
    assert abs(ours.f[0] - exact.f) <= max(1e-13 * f_amplitude, 4 * EPS * a * abs(float(exact.v)))
    assert abs(ours.z[0] / exact.z - 1) <= 1e-12
    assert abs(ours.q[0] - exact.q) <= 1e-12 * float(exact.q_amplitude)


def test_linear_shot_is_bessel():
    """For a -> 0 the shot from a bare tip is p = a J0(2 sqrt t): its folds are the zeros of J0."""
    ours = shoot(1e-9, 0.0, math.inf, 1, 30)
    exact = [float(mp.besseljzero(0, k) ** 2 / 4) for k in range(1, 31)]
    assert ours.folds[0, :, 0] == pytest.approx(exact, rel=4e-15)


def test_zero_fish_is_the_limit_of_light_fish():
    """|p(mu) - p(0)| = O(mu): no jump at w_f = 0, nor where the tip series takes over."""
    mu = np.array([0.0, 1e-300, 1e-15, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8])
    ours = shoot(0.8, mu, 25.0)
    assert np.abs(ours.p - ours.p[0]).max() < 1e-7
    slope = (ours.p[1:] - ours.p[0]) / mu[1:]
    assert slope[-4:] == pytest.approx(slope[-1], rel=1e-4)


def test_odd_in_the_offset():
    a, mu, tau = np.array([0.3, 40.0, 7.0]), np.array([0.0, 2.0, 500.0]), np.array([30.0, 900.0, 200.0])
    plus, minus = shoot(a, mu, tau), shoot(-a, mu, tau)
    np.testing.assert_array_equal(plus.p, -minus.p)
    np.testing.assert_array_equal(plus.q, minus.q)
    np.testing.assert_array_equal(plus.count, minus.count)


def test_every_point_of_a_shot_solves_the_forward_problem():
    """Scaling: gamma^2 = |p|, lambda = tau/|p|, w_f = mu/|p|, R_x0 = f/|p| is an equilibrium of Eqs. (29)-(33)."""
    rng = np.random.default_rng(4)
    a, mu = 10 ** rng.uniform(-1, 1, 40), np.where(rng.random(40) < 0.3, 0.0, 10 ** rng.uniform(-1, 2, 40))
    ends = shoot(a, mu, 10 ** rng.uniform(0, 1.7, 40))
    scale, sign = np.abs(ends.p), np.sign(ends.p)
    keep = (scale > 0.05 * a) & (mu > 0)
    error = boundary_error(mu / scale, ends.tau / scale, np.sqrt(scale), sign * ends.f / scale, segments=20000)[keep]
    size = (np.abs(ends.f) / scale + ends.tau / scale * scale + mu * a / scale)[keep]
    # 20000 Runge-Kutta segments leave 1e-12 of the forces at play at these speeds.
    assert np.abs(error / size).max() < 1e-9


def test_depth_is_the_energy_integral():
    """z = (r + p^2/2) - (mu sqrt(1 + a^2) + a^2/2), an invariant the march does not use."""
    a, mu = np.array([0.5, 3.0, 12.0]), np.array([0.1, 5.0, 70.0])
    ends = shoot(a, mu, np.array([20.0, 200.0, 90.0]))
    energy = np.hypot(mu + ends.tau, ends.f) + ends.p**2 / 2
    assert ends.z == pytest.approx(energy - mu * np.sqrt(1 + a * a) - a * a / 2, rel=1e-12)


def test_count_and_folds_agree():
    """Zeros of q recorded one by one, and counted up to ends on either side of each."""
    a, mu = 2.0, 3.0
    folds = shoot(a, mu, math.inf, 1, 8).folds[0, :, 0]
    assert np.all(np.diff(folds) > 0)
    before, after = shoot(a, mu, folds * (1 - 1e-10)), shoot(a, mu, folds * (1 + 1e-10))
    np.testing.assert_array_equal(before.count, np.arange(8))
    np.testing.assert_array_equal(after.count, np.arange(1, 9))
    on_the_way = shoot(a, mu, folds[5] * 1.001, 1, 8)
    assert on_the_way.folds[0, :6, 0] == pytest.approx(folds[:6], rel=1e-15)
    assert np.isnan(on_the_way.folds[0, 6:]).all()
    assert on_the_way.count[0] == 6


@pytest.mark.slow
@pytest.mark.parametrize("order", [4, 8, 12])
def test_order_of_the_taylor_step(order):
    """Halving a forced step divides the error of one step by 2^(order + 1)."""
    step, exact_step = opened(make_taylor_step(order)), opened(make_taylor_step(28))
    state = (3.0, 1.1, 0.7, 2.0, 0.9)

    def error(h):
        return abs(step(*state, h)[3] - exact_step(*state, h)[3])

    h = {4: 0.05, 8: 0.2, 12: 0.4}[order]
    observed = math.log2(error(h) / error(h / 2)) - 1
    assert observed == pytest.approx(order, abs=0.3)


def test_threads_do_not_matter():
    rng = np.random.default_rng(8)
    a, mu, tau = 10 ** rng.uniform(-2, 3, 3000), 10 ** rng.uniform(-3, 3, 3000), 10 ** rng.uniform(-1, 3, 3000)
    serial = shoot(a, mu, tau, 1, 3)
    for threads in (1, 2):
        with limited_threads(threads):
            parallel = shoot(a, mu, tau, 1, 3, parallel=True)
        for name in ("tau", "f", "p", "z", "v", "q", "folds", "count", "status"):
            np.testing.assert_array_equal(getattr(serial, name), getattr(parallel, name))


@pytest.mark.parametrize(
    ("a", "mu", "tau"),
    [
        (np.nan, 1.0, 1.0),
        (1.0, np.nan, 1.0),
        (1.0, 1.0, np.nan),
        (np.inf, 1.0, 1.0),
        (0.0, 1.0, 1.0),
        (1.0, -1.0, 1.0),
        (1.0, 1.0, -1.0),
    ],
)
def test_bad_start_is_a_status_and_spoils_no_other_shot(a, mu, tau):
    good = shoot([0.5] * 40, 1.0, 10.0)
    mixed = shoot([0.5] * 20 + [a] + [0.5] * 19, [1.0] * 20 + [mu] + [1.0] * 19, [10.0] * 20 + [tau] + [10.0] * 19)
    assert mixed.status[20] == status.BAD_INPUT
    assert np.isnan(mixed.p[20])
    np.testing.assert_array_equal(np.delete(mixed.p, 20), good.p[:39])


def test_step_limit_is_a_status():
    ends = shoot([1e-3, 0.5], 0.0, [1e6, 1.0], max_steps=50)
    assert list(ends.status) == [status.STEP_LIMIT, status.OK]


def test_overflow_is_a_status():
    ends = shoot([1e200, 1e30, 1e60], [1e200, 1e30, 0.0], [1e300, 1e30, 1e60])
    assert set(ends.status) == {status.BAD_INPUT}


@given(
    log_gamma=st.floats(-2, 4),
    log_lam=st.floats(-2, 3),
    w_f=st.one_of(st.just(0.0), st.floats(-300, 4).map(lambda e: 10.0**e)),
    share=st.floats(-8, 0),
)
def test_every_shot_of_the_domain_ends_well(log_gamma, log_lam, w_f, share):
    gamma2, lam = 10.0 ** (2 * log_gamma), 10.0**log_lam
    # As many nodes as a test has time for.
    if 2 * (math.sqrt(gamma2 * (w_f + lam)) - math.sqrt(gamma2 * w_f)) > 3e4:
        lam = 1e-2
    ends = shoot(gamma2 * (1 + lam) * 10.0**share, w_f * gamma2, lam * gamma2)
    assert ends.status[0] == status.OK
    assert np.isfinite([ends.f[0], ends.p[0], ends.q[0]]).all()
    assert 0.0 < ends.z[0] <= lam * gamma2 * (1 + 1e-12)
