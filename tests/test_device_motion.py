"""Motions of the device: series, cycles, homoclinic orbits, against DOP853 and Fourier series."""

import math

import numpy as np
import pytest
from device_reference import extreme, fourier_cycle, homoclinic_alpha, integrate, refined, rhs, scatter
from scipy.optimize import brentq, minimize_scalar

from towatlas.solve.device.bifurcations import bifurcations
from towatlas.solve.device.cycles import cycles, may_close, returns
from towatlas.solve.device.flow import evaluate, expand_motion, follow_arcs, lanes_of, step_of
from towatlas.solve.device.homoclinics import Saddle, gaps
from towatlas.solve.device.local import at_alpha, hopf_device, hopf_velocity
from towatlas.solve.device.model import Device, expand, tension
from towatlas.solve.device.points import points

INWARD = -0.5 * math.pi
ALPHA_C = math.acos(1.0 / 3.0)


def test_series():
    """Against DOP853, and the integral of the divergence against what differences of F_z sum to."""
    rows = scatter(20, 20)
    lanes = lanes_of([Device(k, alpha) for k, alpha, _ in rows], [R for *_, R in rows])
    phi, z = np.linspace(-1.5, 1.5, 20), np.linspace(-0.5, 0.5, 20)
    series = expand_motion(lanes, phi, z)
    step = step_of(series)
    after = evaluate(series, step)
    for i, (k, alpha, R) in enumerate(rows):
        done = integrate(k, alpha, R, (phi[i], z[i]), step[i], dense_output=True)
        assert after[:2, i] == pytest.approx(done.y[:, -1], rel=1e-11, abs=1e-12)
        nodes, weights = np.polynomial.legendre.leggauss(12)
        p, v = done.sol(0.5 * step[i] * (1.0 + nodes))
        h = 1e-5
        slope = (rhs(k, alpha, R, p, v + h) - rhs(k, alpha, R, p, v - h)) / (2 * h)
        # Differences: h^2 times a third derivative that goes with 1/S.
        assert after[2, i] == pytest.approx(0.5 * step[i] * slope @ weights, rel=1e-6, abs=1e-8)


def test_order_of_series():
    """A step twice as long is off by 2^25 as much."""
    lanes = lanes_of([Device(1.0, -1.4)], [1.5])
    start = np.array([0.3]), np.array([0.2])
    done = integrate(1.0, -1.4, 1.5, (0.3, 0.2), 2.0, dense_output=True)
    coarse = expand_motion(lanes, *start, 6)
    errors = [abs(evaluate(coarse, np.array([t]))[0, 0] - done.sol(t)[0]) for t in (0.2, 0.1)]
    assert 2.0**6 < errors[0] / errors[1] < 2.0**8


@pytest.mark.parametrize(
    ("alpha", "starts"), [(INWARD, (-1.35, -1.2)), pytest.param(-INWARD, (1.2, 1.0), marks=pytest.mark.slow)]
)
def test_right_angles_are_reversible(alpha, starts):
    """Closed orbits: after 100 turns each is where it began, to 1e-12."""
    lanes, begun = lanes_of([Device(1.0, alpha)] * 2, [3.0] * 2), np.array(starts)
    u, w = 1.0 + 3.0 * np.sin(begun), 3.0 * np.cos(begun)
    rises = w - np.hypot(u, w) * (lanes.a * u - lanes.b * w) > 0
    assert rises.all() or not rises.any()
    phi = begun.copy()
    for _ in range(100):
        for side in (1.0, -1.0) if rises.all() else (-1.0, 1.0):
            phi = follow_arcs(lanes, phi, np.zeros(2), side).phi
    assert phi == pytest.approx(begun, abs=1e-12)


def test_no_cycles_where_cos_alpha_is_a_third_or_more():
    """The divergence has one sign there, for all velocities; a little beyond it has both."""
    psi = np.linspace(-math.pi, math.pi, 100001)
    for alpha in (0.0, 1.0, -1.2, ALPHA_C - 1e-6, 1e-6 - ALPHA_C):
        assert (3.0 * math.cos(alpha) + np.cos(2.0 * psi + alpha)).min() > 0.0
        assert not may_close(Device(1.0, alpha))
        assert cycles(2.0, alpha, 1.5) == ()
    assert (3.0 * math.cos(ALPHA_C + 1e-3) + np.cos(2.0 * psi + ALPHA_C + 1e-3)).min() < 0.0
    assert may_close(Device(1.0, ALPHA_C + 1e-3))
    h = 1e-6
    for k, alpha, R in scatter(50, 21):
        phi, z = 0.7, -0.3
        U, w = 1.0 + R * math.sin(phi) + z, R * math.cos(phi)
        direction, S = math.atan2(w, U), math.hypot(U, w)
        numeric = (rhs(k, alpha, R, phi, z + h) - rhs(k, alpha, R, phi, z - h)) / (2 * h)
        stated = -0.5 * k * S * (3.0 * math.cos(alpha) + math.cos(2.0 * direction + alpha))
        assert numeric == pytest.approx(stated, abs=1e-7 * (1 + k) * (1 + R))


def sampled(k, alpha, R, cycle, count=400):
    done = integrate(k, alpha, R, (cycle.phi_max, 0.0), cycle.period, dense_output=True)
    return done.sol(np.arange(count) / count * cycle.period)[0]


@pytest.mark.parametrize(
    ("k", "alpha", "R"), [(1.0, -1.4, 2.0), (1.0, -1.46, 1.5), (0.5, -1.35, 3.2), (3.0, -1.45, 1.4), (50.0, -1.4, 1.02)]
)
def test_cycles_two_other_ways(k, alpha, R):
    """Least and greatest phi, period and least tension: Fourier collocation, and DOP853 once round."""
    found = cycles(k, alpha, R)
    assert found
    for cycle in found:
        phi, z, period, _ = fourier_cycle(k, alpha, R, (sampled(k, alpha, R, cycle), cycle.period), 90)
        fine, rate = refined(phi), refined(z)
        assert cycle.period == pytest.approx(period, rel=1e-8)
        assert (cycle.phi_min, cycle.phi_max) == pytest.approx((extreme(fine), -extreme(-fine)), abs=1e-8)
        U, w = 1.0 + R * np.sin(fine) + rate, R * np.cos(fine)
        a, b = math.cos(alpha), math.sin(alpha)
        force = k * np.hypot(U, w) * (b * U + a * w) + 1.0 + R * np.sin(fine) + 2.0 * rate + rate**2
        assert cycle.tension_min == pytest.approx(extreme(force), abs=1e-8)
        assert cycle.slack == pytest.approx((force <= 0.0).mean(), abs=2e-3)
        done = integrate(k, alpha, R, (cycle.phi_min, 0.0), cycle.period)
        assert done.y[:, -1] == pytest.approx([cycle.phi_min, 0.0], abs=1e-8)


def test_multipliers():
    """Against the motion beside a cycle, once round."""
    for cycle in cycles(1.0, -1.46, 1.5):
        lanes = lanes_of([Device(1.0, -1.46)] * 2, [1.5] * 2)
        there = returns(lanes, cycle.phi_min + np.array([-1e-6, 1e-6]))[0]
        assert np.diff(there)[0] / 2e-6 == pytest.approx(cycle.multiplier, rel=1e-6)
        assert cycle.stable == (cycle.multiplier < 1.0)


@pytest.mark.parametrize("k", [1.0, *(pytest.param(k, marks=pytest.mark.slow) for k in (0.5, 3.0))])
def test_cycles_are_born_as_sigma_says(k):
    """Just beside Hopf points above and below the degenerate one: a small cycle on one side, stable or unstable."""
    for p in (-0.6, -2.0, -4.0, -12.0):
        device, (u, w) = hopf_device(k, p), hopf_velocity(k, p, -1)
        R = math.hypot(u - 1.0, w)
        expansion = expand(device, u, w)
        born_stable = expansion.sigma > 0.0
        (hopf,) = [one for one in at_alpha(device) if one.kind == "hopf" and abs(one.R - R) < 1e-9]
        # On the side where the point is unstable a stable cycle, on the other an unstable one.
        outside = 1.0 if (hopf.stable_side == "below") == born_stable else -1.0
        small = [c for c in cycles(k, device.alpha, R * (1.0 + 1e-5 * outside)) if c.amplitude < 0.1]
        assert [c.stable for c in small] == [born_stable]
        assert not [c for c in cycles(k, device.alpha, R * (1.0 - 1e-5 * outside)) if c.amplitude < 0.01]


HOMOCLINIC = -1.460200689


def saddle_and_focus(R):
    def saddle(alpha):
        return next(p.phi for p in points(1.0, alpha, R) if p.eigenvalues[0].real > 0 > p.eigenvalues[1].real)

    def focus(alpha):
        return next(p.phi for p in points(1.0, alpha, R) if p.physical)

    return saddle, focus


def test_homoclinic_by_another_way():
    """k = 1, R = 1.5: manifolds by DOP853 from elsewhere, met on another section; and cycles of rising period."""
    (one,) = [b for b in bifurcations(1.0, R=1.5) if b.kind == "homoclinic"]
    assert one.alpha == pytest.approx(HOMOCLINIC, abs=1e-9)
    other = homoclinic_alpha(1.0, 1.5, *saddle_and_focus(1.5), (-1.4605, -1.4600))
    assert one.alpha == pytest.approx(other, abs=1e-8)
    assert not one.physical
    near = [cycles(1.0, one.alpha + step, 1.5) for step in (1e-4, 1e-7)]
    assert near[0][0].period < near[1][0].period
    assert near[1][0].phi_min == pytest.approx(one.phi, abs=1e-3)
    assert len(cycles(1.0, one.alpha - 1e-5, 1.5)) == 1


def test_hopf_and_homoclinic_curves_cross():
    """k = 1: along the curve of Hopf points the gap of the manifolds closes once."""

    def gap(p):
        device, (u, w) = hopf_device(1.0, p), hopf_velocity(1.0, p, -1)
        R = math.hypot(u - 1.0, w)
        saddle = next(
            p for p in points(1.0, device.alpha, R) if p.eigenvalues[0].real > 0 and p.eigenvalues[1].real < 0
        )
        return gaps([Saddle(device, 1.0 + R * math.sin(saddle.phi), R * math.cos(saddle.phi))], 1.0)[0]

    p = brentq(gap, -8.0, -6.0, xtol=1e-13)
    u, w = hopf_velocity(1.0, p, -1)
    assert (math.hypot(u - 1.0, w), hopf_device(1.0, p).alpha) == pytest.approx((1.521489649, -1.445424143), abs=1e-9)


@pytest.mark.slow
def test_both_ways_to_homoclinics():
    """Those along R at an alpha are those along alpha at an R."""
    (upper, lower) = [b for b in bifurcations(1.0, alpha=-1.46) if b.kind == "homoclinic"]
    for one in (upper, lower):
        near = [b.alpha for b in bifurcations(1.0, R=one.R) if b.kind == "homoclinic"]
        assert min(abs(alpha + 1.46) for alpha in near) < 1e-10


@pytest.mark.slow
def test_saddle_node_of_cycles_by_another_way():
    """k = 1, R = 1.5: the extremum of alpha along cycles as Fourier series of given amplitude."""
    (one,) = [b for b in bifurcations(1.0, R=1.5) if b.kind == "cycle-saddle-node"]
    inside = one.alpha - 1e-4
    cycle = cycles(1.0, inside, 1.5)[-1]
    guess = sampled(1.0, inside, 1.5, cycle), cycle.period

    def alpha(amplitude):
        return -fourier_cycle(1.0, inside, 1.5, guess, 40, free=amplitude)[3]

    best = minimize_scalar(alpha, bounds=(0.3, 0.5), method="bounded", options={"xatol": 1e-6})
    assert one.alpha == pytest.approx(-best.fun, abs=1e-8)
    assert one.alpha == pytest.approx(-1.45745, abs=6e-6)
    assert one.stable_side == "below"
    counts = [len(cycles(1.0, one.alpha + step, 1.5)) for step in (-1e-5, 1e-5)]
    assert counts == [2, 0]


@pytest.mark.slow
def test_continuation_stops_short_of_the_degenerate_hopf():
    """At AUTO's row for k = 0.5, 2e-4 below, the cycles that meet are wide, and yet no curve has left the other."""
    (degenerate,) = [b for b in bifurcations(0.5) if b.kind == "degenerate-hopf" and b.physical]
    at_auto = [b for b in bifurcations(0.5, R=2.454374) if b.kind == "cycle-saddle-node"]
    (fold,) = at_auto
    (hopf,) = [b for b in bifurcations(0.5, R=2.454374) if b.kind == "hopf" and b.physical]
    # The wedge between both curves is that thin, and continuation cannot tell them apart.
    assert 0.0 < fold.alpha - hopf.alpha < 1e-6
    assert abs(fold.phi - hopf.phi) > 0.01
    assert pytest.approx(2.07e-4, abs=1e-6) == degenerate.R - 2.454374


@pytest.mark.parametrize("count", [4, pytest.param(30, marks=pytest.mark.slow)])
def test_motions_end_where_the_lists_say(count):
    """Let go beside an unstable point on a taut line: the motion ends on a stable cycle, at a point, or goes round."""
    rng = np.random.default_rng(22)
    swinging = 0
    for _ in range(count):
        k, alpha = 10.0 ** rng.uniform(-0.5, 0.7), rng.uniform(-1.5, -ALPHA_C)
        radii = sorted(b.R for b in at_alpha(Device(k, alpha)) if b.kind == "hopf" and b.physical)
        R = rng.uniform(*radii)
        everything = points(k, alpha, R)
        (point,) = [p for p in everything if p.physical]
        rate = point.eigenvalues[0].real
        if rate < 0.02:
            continue
        time = 30.0 / rate
        done = integrate(k, alpha, R, (point.phi + 1e-3, 0.0), time, rtol=1e-10, atol=1e-12, dense_output=True)
        late = done.sol(np.linspace(0.9 * time, time, 4000))[0]
        if np.ptp(late) < 1e-2:
            assert any(p.stable and abs(p.phi - late[-1]) < 2e-2 for p in everything)
        elif np.ptp(late) < 2.0 * math.pi:
            swinging += 1
            ends = [(c.phi_min, c.phi_max) for c in cycles(k, alpha, R) if c.stable]
            # Samples miss the extremes by the square of their distance.
            assert any((late.min(), late.max()) == pytest.approx(one, abs=1e-3) for one in ends)
    assert swinging


def test_round_the_ship_no_line_stays_taut():
    """Motions that lead round the ship, which cycles leave out: each has a stretch of negative tension."""
    for k, alpha, R in scatter(12, 23, k=(-1.0, 1.0)):
        for z in (-3.0, 3.0):
            done = integrate(k, alpha, R, (0.0, z), 60.0, rtol=1e-9, atol=1e-11, dense_output=True)
            phi, rate = done.sol(np.linspace(20.0, 60.0, 4000))
            if abs(phi[-1] - phi[0]) < 4.0 * math.pi:
                continue
            forces = [
                tension(Device(k, alpha), 1.0 + R * math.sin(p), R * math.cos(p), v)
                for p, v in zip(phi, rate, strict=True)
            ]
            assert min(forces) < 0.0
