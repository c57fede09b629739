"""The shots that a search looks around with, against exact ones, and what energy says against what a search finds."""

import numpy as np
import pytest

import towatlas
from benchmarks.samples_drag import SAMPLES, arrays
from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS
from towatlas.solve.looks import LONG, SLOPE, TOLERANCE, look
from towatlas.solve.search import BEYOND, least_radius
from towatlas.solve.shots import shoot
from towatlas.system import System

# Trailing in strong drag: a fish with weight, one without drag of its own, and a bare end.
TRAILING = [
    (System.of(159.4, 0.617, C=2e4, m_f=1.745, C_f=500.0, w=0.332), 0.3725),
    (System.of(152.3, 4.121, C=1070.0, m_f=11.35, w=0.814), 0.8664),
    (System.of(2.34, 0.0, C=863.0, w=0.524), 0.181),
    (System.of(185.4, 0.161, C=9400.0, m_f=0.425, w=0.295, C_t=0.1), 0.165),
    (System.of(60.0, 0.161, C=9400.0, m_f=0.425, w=0.295, C_s=30.0, b_s=0.4), 0.165),
]


@pytest.mark.parametrize(("system", "gamma"), TRAILING)
@pytest.mark.parametrize("port", [False, True])
def test_rough_shots_are_as_good_as_they_say(system, gamma, port):
    gamma = -gamma if port else gamma
    r = gamma**2 * np.geomspace(1e-3, 1.0 + system.lam, 10)
    speeds, rows = np.full(len(r), gamma), np.repeat(system.row()[None], len(r), axis=0)
    exact = shoot(r, speeds, rows, SLOPE, max_steps=30_000)
    short = exact.status == status.OK
    r, speeds, rows = r[short], speeds[short], rows[short]
    exact = shoot(r, speeds, rows, SLOPE)
    found = look(r, speeds, rows)
    # Not a test of nothing: some are rough, and these would have been long.
    assert found.rough.any()
    assert (exact.steps[found.rough] > LONG).all()
    assert (found.status == status.OK).all()
    # Errors of the steps add up along the cable, to some hundred of them, and a position turns with its angle.
    rho = np.hypot(exact.X[:, 0], exact.Y[:, 0]) / gamma**2
    for ours, theirs in ((found.X, exact.X), (found.Y, exact.Y)):
        wrong = np.abs(ours - theirs / gamma**2)[:, 0] / rho
        assert wrong[found.rough].max() < 1e4 * TOLERANCE
        assert wrong[~found.rough].max(initial=0.0) < 1e-9
    wrong = np.abs(found.log_rho - exact.log_rho)
    assert wrong[found.rough].max() < 300 * TOLERANCE
    assert np.abs(found.angle - exact.angle).max() < 1e4 * TOLERANCE


def test_derivative_of_rough_shots_is_theirs():
    system, gamma = TRAILING[1]
    r = gamma**2 * 90.0 * np.exp([-1e-4, 0.0, 1e-4])
    found = look(r, np.full(3, gamma), np.repeat(system.row()[None], 3, axis=0))
    assert found.rough.all()
    # Steps differ from shot to shot: a difference knows as much as the tolerance over its width.
    assert (found.X[2, 0] - found.X[0, 0]) / 2e-4 == pytest.approx(found.X[1, 1], rel=0.02, abs=0.1)


@pytest.mark.parametrize("family", SAMPLES)
def test_nothing_is_found_where_energy_allows_nothing(family):
    systems, gamma = SAMPLES[family](400, 77)
    columns = arrays(systems)
    rows = np.stack([np.broadcast_to(columns.get(name, np.inf if name == "b_s" else 0.0), 400) for name in COLUMNS], 1)
    least = least_radius(rows, gamma)
    bounded = np.flatnonzero(least > 0.0)
    if family == "air":
        assert len(bounded) > 50
    # Shots from below it: none gets to the tow radius, not even one that ends early.
    shares = np.random.default_rng(7).uniform(0.2, 1.0, len(bounded))
    r = least[bounded] * (1.0 - 1e-6) * gamma[bounded] ** 2
    ends = shoot(r, gamma[bounded], rows[bounded], SLOPE, shares=shares, max_steps=20_000)
    good = ends.status == status.OK
    assert good.sum() > 0.8 * len(bounded)
    assert (ends.log_rho[good, 0] < 0.0).all()


def test_energy_is_no_bound_with_tangential_drag():
    row = System.of(1.0, 0.0, C=0.1, C_t=0.01).row()[None]
    assert least_radius(row, np.array([10.0]))[0] == 0.0
    row[0, COLUMNS.index("C_t")] = 0.0
    assert least_radius(row, np.array([10.0]))[0] == pytest.approx(np.sqrt(1.0 - 2.0 * 0.01), rel=1e-9)


def test_energy_bound_is_met_by_a_shape_that_all_but_reaches_it():
    # Fast, short and light: the tension at the tow point is that of the cable alone.
    system = System.of(1e-3, 0.0)
    found = towatlas.equilibria_many(1e-3, 0.0, 50.0)
    least = least_radius(system.row()[None], np.array([50.0]))[0]
    radii = found.r_f.values[np.isfinite(found.r_f.values)]
    assert (radii > least / BEYOND).all()
    assert radii.min() < least * 1.01


@pytest.mark.parametrize(
    "row",
    [
        # Shots of more than 100,000 steps, where the search gave up; the shape needs some of 300,000.
        {"lam": 3.0346968306264883, "w_f": 0.0, "C": 63213.317859078685, "w": 0.25759514178212345},
    ],
)
def test_shapes_of_bare_ends_in_strong_drag_are_found(row):
    found = towatlas.equilibria(gamma=0.2623308428258069, **row)
    assert len(found) == 1
    assert found.r_f[0] == pytest.approx(1.00586011, rel=1e-8)
    assert "not from" not in found.searched
