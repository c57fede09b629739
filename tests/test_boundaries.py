"""Where flutter begins and ends, as curves: against windows of speed, a closed form, and what is between."""

import numpy as np
import pytest

import towatlas
from towatlas.limits import unchecked_threshold_length
from towatlas.solve.krein import SPEED, Collisions, Domain, begins
from towatlas.tables.stability import cell_of


@pytest.fixture(scope="module")
def light():
    return towatlas.krein_boundaries(10.0)


def pendulum(lam):
    """Speed at which the conical pendulum begins to flutter."""
    low, high = 0.01, 0.75
    for _ in range(60):
        S = 0.5 * (low + high)
        low, high = (S, high) if lam < 16.0 * (1.0 - S**2) / (S * (4.0 - 3.0 * S**2) ** 2) else (low, S)
    return np.sqrt(S / ((lam * S - 1.0) * np.sqrt(1.0 - S**2)))


def test_edges_are_those_of_the_windows_of_speed(light):
    """`flutter` follows modes from speed to speed, and solves for the square of their distance."""
    curve = max(light, key=lambda curve: curve.lam.max())
    k = int(np.argmin(np.abs(curve.lam - 3.0)))
    gamma = float(curve.gamma[k])
    found = towatlas.flutter(float(curve.lam[k]), 10.0, (0.98 * gamma, 1.02 * gamma))
    edges = [
        edge
        for window in found.windows
        for edge, kind in ((window.low, window.low_kind), (window.high, window.high_kind))
        if kind == "krein" and window.nodes == 1
    ]
    # A zero of a difference of roots that meet is known to rounding over the slope of its square.
    assert np.abs(np.array(edges) / gamma - 1.0).min() < 1e-9


def test_a_heavy_fish_is_a_conical_pendulum():
    """Up to the weight of the cable over that of the fish."""
    errors = []
    for w_f in (1e3, 1e4):
        points = [
            (lam, gamma)
            for curve in towatlas.krein_boundaries(w_f)
            for lam, gamma in zip(curve.lam, curve.gamma, strict=True)
            if 1.8 < lam < 3.0 and gamma < 3.0
        ]
        assert len(points) > 2
        errors.append(max(abs(gamma / pendulum(lam) - 1.0) for lam, gamma in points))
    assert errors[0] < 1e-2
    # The largest of points that are not the same.
    assert errors[1] == pytest.approx(0.1 * errors[0], rel=0.3)


def test_ends_and_errors(light):
    threshold = float(unchecked_threshold_length(10.0, 1))
    assert {kind for curve in light for kind in curve.kinds} == {"length", "speed", "real"}
    for curve in light:
        assert curve.error.max() < 1e-8
        for end, kind in ((0, curve.kinds[0]), (-1, curve.kinds[1])):
            excess = curve.lam[end] - threshold
            if kind == "length":
                assert min(abs(excess / 0.01 - 1.0), abs(excess / 100.0 - 1.0)) < 1e-9
            elif kind == "speed":
                fold = float(towatlas.solve_critical(curve.lam[end], 10.0, 1).gamma)
                assert curve.gamma[end] == pytest.approx(3.0 * fold, rel=1e-10)
            else:
                assert curve.omega[end] < 1e-5


def test_two_edges_meet_in_a_cusp():
    """Where three oscillations are one a curve turns in length and speed; between its halves the shape lasts."""
    curve = next(curve for curve in towatlas.krein_boundaries(1.0) if len(curve.turns))
    k = int(curve.turns[0])
    for values in (curve.lam, curve.gamma):
        around = values[[k - 1, k + 1]] - values[k]
        assert (around > 0.0).all() or (around < 0.0).all()
    lam, gamma = float(curve.lam[k + 4]), float(curve.gamma[k + 4])
    before = np.argsort(curve.lam[:k])
    apart = float(np.interp(lam, curve.lam[:k][before], curve.gamma[:k][before])) - gamma
    kinds = []
    for share in (-0.5, 0.5):
        found = towatlas.stability(lam, 1.0, gamma + share * apart)
        kinds.append(str(found.kind[list(found.equilibria.branch).index("1 inner")]))
    assert kinds == ["flutter", "stable"]


@pytest.mark.slow
def test_windows_of_the_shape_with_two_nodes():
    """Where flutter of the report's cable ceases, begins and ceases, known to 13 digits, lies on its curves."""
    curves = towatlas.krein_boundaries(1352.0, 2)
    assert len(curves) > 8
    assert all("unknown" not in curve.kinds and curve.error.max() < 1e-8 for curve in curves)
    start = []
    for curve in curves:
        away = np.log(curve.lam / 37.8)
        excess = np.full(len(away), np.log(37.8 - float(unchecked_threshold_length(1352.0, 2))))
        z = np.stack([np.log(curve.r_f * curve.gamma**2), np.log(curve.gamma), excess, curve.omega**2], axis=1)
        for k in np.flatnonzero((away[:-1] < 0.0) != (away[1:] < 0.0)):
            start.append(z[k] + away[k] / (away[k] - away[k + 1]) * (z[k + 1] - z[k]))
    rows = np.arange(len(start))
    collisions = Collisions(np.full(len(rows), 2), np.full(len(rows), 1352.0), Domain())
    found, good = collisions.solve(np.stack(start), rows, -1)
    begun = begins(collisions(found[good], rows[good])[1])
    gammas = np.exp(found[good, SPEED])
    for gamma, begin in ((3.643306226987, False), (3.887892146622, True), (4.635754473627, False)):
        assert np.abs(gammas / gamma - 1.0)[begun == begin].min() < 1e-10


def test_bad_numbers():
    for w_f, n, words in ((-1.0, 1, "w_f"), (1.0, 0, "whole number")):
        with pytest.raises(ValueError, match=words):
            towatlas.krein_boundaries(w_f, n)


def test_where_newton_goes_astray():
    """No warning, which `build --stability` printed, and no point."""
    collisions = Collisions(np.array([1]), np.array([1.0]), Domain())
    for far in (800.0, -800.0):
        values, _, _, sound = collisions(np.full((1, 4), far), np.array([0]))
        assert values.shape == (1, 3)
        assert not sound.any()
    assert cell_of(np.array([np.nan, -1.0, 1.0]), 5).tolist() == [0, 0, 3]


@pytest.mark.slow
@pytest.mark.parametrize(("w_f", "n"), [(1e4, 3), (2.1082391344554146, 2)])
def test_a_turn_next_to_a_cusp_stays_on_its_curve(w_f, n):
    """Secants on the direction of the curve went astray: a point at lambda_c3 + 0.277, gamma 0."""
    for curve in towatlas.krein_boundaries(w_f, n):
        assert (curve.gamma > 0.1).all()
        assert curve.error.max() < 1e-6
        assert np.abs(np.diff(np.log(curve.gamma))).max(initial=0.0) < 0.5
