"""Numerical methods that know nothing of cables: series, axes, cubics, rows, curves, error maps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import chebyshev as numpys

from towatlas.numerics import chebyshev, curves, errormap, lagrange
from towatlas.numerics.axes import LinearAxis, LogAxis, ShiftedLogAxis
from towatlas.numerics.cells import BLOCK, CELLS, Cells, Place, Places, Work
from towatlas.numerics.hermite import cubic, cubic_coefficients
from towatlas.numerics.rows import bracket, newton, solve_systems
from towatlas.tables.critical import from_field, to_field

# Series.


def test_series_through_the_nodes():
    values = np.random.default_rng(0).normal(size=(3, 7, 10))
    series = chebyshev.coefficients(values)
    np.testing.assert_allclose(chebyshev.on_grid(series, chebyshev.nodes(7), chebyshev.nodes(10)), values, atol=1e-13)


def test_middles_of_all_cells_are_interpolated_as_points_are():
    rng = np.random.default_rng(3)
    axes = tuple(np.cumsum(rng.uniform(0.5, 1.5, count)) for count in (7, 8, 9))
    values = rng.normal(size=(7, 8, 9))
    cells = tuple(c.ravel() for c in np.indices((6, 7, 8)))
    points = tuple(lagrange.middles(axis)[cell] for axis, cell in zip(axes, cells, strict=True))
    for width in (2, 4, 6):
        single = lagrange.interpolate((values,), axes, cells, points, width)[0]
        np.testing.assert_allclose(lagrange.at_middles(values, axes, width).ravel(), single, atol=1e-13)


def test_equal_patches_are_the_series_on_their_parts():
    series = np.random.default_rng(2).normal(size=(2, 5, 7))
    short = chebyshev.equal_patches(series, (3, 2), 8)
    assert short.shape == (2, 3, 2, 8, 8)
    for row, column in ((0, 0), (1, 1), (2, 0)):
        y, x = np.array([-1.0, -0.3, 0.9]), np.array([0.2, -0.8, 1.0])
        whole = (y + 2 * row + 1) / 3 - 1, (x + 2 * column + 1) / 2 - 1
        for k in range(2):
            got = np.polynomial.chebyshev.chebval2d(y, x, short[k, row, column])
            np.testing.assert_allclose(got, np.polynomial.chebyshev.chebval2d(*whole, series[k]), atol=1e-13)


def test_cells_are_numpys_chebyshev_sum():
    """Cells of a series that falls as those of an atlas do, against the sum of the whole series; ends included."""
    rng = np.random.default_rng(1)
    decay = 10.0 ** (-np.add.outer(np.arange(96) / 96, np.arange(112) / 112) * 20)
    series = rng.normal(size=(96, 112)) * decay
    x, y = rng.uniform(-1, 1, 10000), rng.uniform(-1, 1, 10000)
    x[:4], y[:4] = [-1, -1, 1, 1], [-1, 1, -1, 1]
    x[4 : 5 + CELLS] = chebyshev.nodes(CELLS + 1)
    expected = numpys.chebval2d(y, x, series)
    table, work = Cells(series), Work(len(x))
    parts = [slice(begin, begin + BLOCK) for begin in range(0, len(x), BLOCK)]
    found = np.concatenate([table.sums(0, Places(x[part], y[part]), work) for part in parts])
    # What the degree of a cell leaves out of so rough a series.
    np.testing.assert_allclose(found, expected, atol=1e-10)
    one = [Cells(series).values(Place(*at))[0] for at in zip(x[:200].tolist(), y[:200].tolist(), strict=True)]
    np.testing.assert_allclose(one, found[:200], rtol=0, atol=1e-14 * np.abs(series).sum())


def test_sums_at_points_are_numpys():
    rng = np.random.default_rng(2)
    series, points = rng.normal(size=(4, 5, 6)), rng.uniform(-1, 1, (3, 50))
    np.testing.assert_allclose(chebyshev.at_points(series, *points), numpys.chebval3d(*points, series), atol=1e-13)
    np.testing.assert_allclose(
        chebyshev.at_points(series[0], *points[1:]), numpys.chebval2d(*points[1:], series[0]), atol=1e-13
    )


def test_midpoints_lie_between_nodes():
    nodes, between = chebyshev.nodes(9), chebyshev.midpoints(9)
    assert (nodes[:-1] < between).all()
    assert (between < nodes[1:]).all()


# Axes.

AXES = (LinearAxis(-0.5, 1.0), LogAxis(1e-3, 1e3), ShiftedLogAxis(1e4, 0.03))


@pytest.mark.parametrize("axis", AXES)
@given(coordinate=st.floats(-1, 1))
def test_coordinates_and_back(axis, coordinate):
    value = axis.value(np.float64(coordinate))
    assert axis.coordinate(value) == pytest.approx(coordinate, abs=1e-14)


def test_ends_of_the_axes():
    for axis, low in zip(AXES, (-0.5, 1e-3, 0.0), strict=True):
        assert axis.value(np.array([-1.0, 1.0])) == pytest.approx([low, axis.high], rel=1e-13)
        assert axis.coordinate(np.array([low, axis.high])) == pytest.approx([-1.0, 1.0])
        assert axis.coordinate(np.array([2.0 * axis.high])) == 1.0
    # To the last digit: a cable without a fish is one.
    assert AXES[2].value(np.array(-1.0)) == 0.0


@pytest.mark.parametrize(("name", "value"), [("gamma", 2.5), ("R_x0", -7.0), ("z_f", 0.1)])
def test_fields_and_back(name, value):
    excess, n = np.array([0.3]), np.array([1])
    field = to_field(name, np.array([value]), excess)
    assert from_field(name, field, excess, n) == pytest.approx(value, rel=1e-15)


def test_sign_of_the_fish_offset():
    x_f = [from_field("x_f", to_field("x_f", np.array(-3.0), 1.0), 1.0, n) for n in (1, 2)]
    assert x_f == pytest.approx([-3, 3], rel=1e-15)


# Cubics.


def test_cubics_are_exact_for_cubics():
    exact = np.polynomial.Polynomial([1.0, -2.0, 0.5, 3.0])
    slope, low, width = exact.deriv(), 0.4, 1.7
    ends = exact(low), exact(low + width), slope(low), slope(low + width), width
    t = np.linspace(0, 1, 7)
    np.testing.assert_allclose(cubic(*ends, t), exact(low + width * t), rtol=1e-14)
    np.testing.assert_allclose(np.polyval(cubic_coefficients(*ends), t), exact(low + width * t), rtol=1e-13)


# Error maps.


def test_what_is_stated_covers_what_was_measured():
    """Of a block and its neighbours, the corners' too; nothing spreads farther."""
    measured = np.zeros((5, 6))
    measured[1, 4] = 2.0
    stated = errormap.stated_error(measured, 1e-3)
    near = np.zeros_like(measured, bool)
    near[:3, 3:] = True
    assert (stated[near] == errormap.SAFETY * 2.0 + 1e-3).all()
    assert (stated[~near] == 1e-3).all()


def test_blocks():
    coordinates = np.array([-1.0, -0.01, 0.01, 1.0])
    np.testing.assert_array_equal(errormap.block_of(coordinates, 2), [0, 0, 1, 1])
    worst = errormap.worst_of_blocks(np.array([3.0, 1.0, 5.0, 4.0]), coordinates, -coordinates, 2)
    np.testing.assert_array_equal(worst, [[0.0, 3.0], [5.0, 0.0]])


# Rows.


def test_newton_row_by_row():
    """Square roots; a row whose guess is far, one without a guess and one whose Jacobian is singular are lost alone."""
    wanted = np.array([[4.0, 9.0], [2.0, 3.0], [1.0, 1.0], [5.0, 5.0]])
    guess = np.array([[2.1, 2.9], [1e9, 1.0], [np.nan, 1.0], [0.0, 2.0]])
    asked = []

    def residuals(z, i):
        asked.append(list(i))
        return z * z - wanted[i], 2.0 * z[:, :, None] * np.eye(2), np.ones(len(z), bool)

    z, step, solved = newton(residuals, guess, rounds=20, longest=10.0, settled=lambda step, size, last: size < 1e-9)
    assert solved.tolist() == [True, False, False, False]
    assert z[0] == pytest.approx([2.0, 3.0], rel=1e-15)
    assert np.isnan(z[1:]).all()
    assert np.abs(step[0]).max() < 1e-9
    assert asked[0] == [0, 1, 3]
    assert all(rows == [0] for rows in asked[1:])


def test_systems():
    matrix = np.array([[[2.0, 0.0], [0.0, 4.0]], [[1.0, 1.0], [1.0, 1.0]], [[np.nan, 0.0], [0.0, 1.0]]])
    np.testing.assert_array_equal(solve_systems(matrix, np.ones((3, 2)))[0], [0.5, 0.25])
    assert np.isnan(solve_systems(matrix, np.ones((3, 2)))[1:]).all()


HARD = {
    "smooth": (lambda x: x**3 - 2.0, lambda x: 3 * x**2, 2 ** (1 / 3)),
    "flat about its root": (lambda x: (x - 0.7) ** 9, lambda x: 9 * (x - 0.7) ** 8, 0.7),
    "a step": (lambda x: np.where(x < 1.234, -1.0, 1.0), lambda x: 0.0 * x, 1.234),
    "a wall": (lambda x: np.exp(40 * (x - 1.9)) - 1e-9, lambda x: 40 * np.exp(40 * (x - 1.9)), 1.9 + np.log(1e-9) / 40),
    "a root at an end": (lambda x: x - 3.0, lambda x: 1.0 + 0.0 * x, 3.0),
    "slopes that lie": (lambda x: x - 0.1, lambda x: 1e-6 + 0.0 * x, 0.1),
}


@pytest.mark.parametrize("with_slope", [True, False])
@pytest.mark.parametrize("name", HARD)
def test_roots_in_brackets(name, with_slope):
    value, slope, exact = HARD[name]
    calls = []

    def function(x, i):
        calls.append(len(i))
        return value(x), slope(x) if with_slope else np.full(len(x), np.nan)

    found, solved = bracket(function, np.array([0.0]), np.array([3.0]))
    assert solved.all()
    # Where the function is flat its rounding hides the root.
    assert found == pytest.approx(exact, rel=1e-15 if name != "flat about its root" else 1e-2)
    assert len(calls) < (300 if name.startswith("flat") else 100)


def test_a_bracket_without_a_root():
    """Rows are on their own: one whose function is negative at the upper end is nan, the other solved."""
    roots = np.array([5.0, 1.0])
    found, solved = bracket(lambda x, i: (x - roots[i], np.ones(len(x))), np.zeros(2), np.full(2, 3.0))
    assert solved.all()
    assert np.isnan(found[0])
    assert found[1] == 1.0


def test_newton_from_where_a_function_falls():
    """Above the root a step upwards leads to no other end of the bracket: that is not the root."""
    u = np.linspace(0.0, 5.0, 1001)
    assert (np.sin(u) + 0.22 * u > 0.0)[1:].all()
    found, solved = bracket(
        lambda x, i: (np.sin(x - 1.0) + 0.22 * (x - 1.0), np.cos(x - 1.0) + 0.22), np.zeros(1), np.full(1, 6.0)
    )
    assert solved[0]
    assert found[0] == pytest.approx(1.0, rel=1e-15)


def test_a_bracket_of_nothing_but_negative_values():
    """Without slopes the upper end is looked at before an answer is given; a root at it is one."""
    none = np.full(1, np.nan)
    found, solved = bracket(lambda x, i: (-1.0 + 0.0 * x, none), np.zeros(1), np.ones(1))
    assert solved[0]
    assert np.isnan(found[0])
    found, solved = bracket(lambda x, i: (x - 1.0, none), np.zeros(1), np.ones(1))
    assert (found[0], solved[0]) == (1.0, True)


def test_a_function_that_becomes_nan_is_not_solved():
    found, solved = bracket(lambda x, i: (np.where(x > 0.3, np.nan, -1.0), 1.0 + 0.0 * x), np.zeros(1), np.ones(1))
    assert not solved[0]
    assert np.isnan(found[0])


# Curves.


@pytest.mark.parametrize("unknowns", [2, 3, 4, 6])
def test_tangents_span_the_kernel(unknowns):
    jacobian = np.random.default_rng(unknowns).normal(size=(40, unknowns - 1, unknowns))
    along = curves.tangents(jacobian)
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1.0, rtol=1e-14)
    assert np.abs(np.einsum("rij,rj->ri", jacobian, along)).max() < 1e-12
    kernel = np.linalg.svd(jacobian)[2][:, -1]
    assert np.abs(np.abs(np.sum(along * kernel, axis=1)) - 1.0).max() < 1e-10
    if unknowns == 3:
        crossed = np.cross(jacobian[:, 0], jacobian[:, 1])
        np.testing.assert_array_equal(along, crossed / np.linalg.norm(crossed, axis=1)[:, None])


def helix(unknowns):
    """x_0 = r cos t, x_1 = r sin t, and others powers of t = the last unknown; a curve in any number of unknowns."""

    def equations(z, i):
        t, rows = z[:, -1], len(z)
        value = np.empty((rows, unknowns - 1))
        jacobian = np.zeros((rows, unknowns - 1, unknowns))
        targets = [(np.cos(t), -np.sin(t)), (np.sin(t), np.cos(t))]
        targets += [(0.1 * t**k, 0.1 * k * t ** (k - 1)) for k in range(1, unknowns - 2)]
        for k, (target, slope) in enumerate(targets[: unknowns - 1]):
            value[:, k] = z[:, k] - target
            jacobian[:, k, k], jacobian[:, k, -1] = 1.0, -slope
        return value, jacobian, np.stack([np.sin(t - 1.0)], axis=1), np.ones(rows, bool)

    return equations


@pytest.mark.parametrize("unknowns", [2, 3, 5])
def test_curves_are_followed_and_their_events_found(unknowns):
    """Two helices to t = 2 and to t = 3, with an event at t = 1; a row that begins nowhere has no points."""
    last = np.array([2.0, 3.0, 2.0])
    start, ahead = np.zeros((3, unknowns)), np.zeros((3, unknowns))
    start[:, 0], ahead[:, -1] = 1.0, 1.0
    start[2] = np.nan
    found = curves.follow(
        helix(unknowns),
        start,
        ahead,
        lambda z, along, monitors, i: z[:, -1] > last[i],
        curves.Steps(first=0.1, longest=0.15, shortest=1e-6, near=1e-8),
    )
    assert [curve.complete for curve in found] == [True, True, False]
    assert len(found[2]) == 0
    assert found[2].event() == -1
    for curve, end in zip(found[:2], last[:2], strict=True):
        assert curve.points[-2, -1] < end < curve.points[-1, -1]
        t = curve.points[:, -1]
        np.testing.assert_allclose(curve.points[:, 0], np.cos(t), atol=1e-8)
        k = curve.event()
        assert t[k] < 1.0 <= t[k + 1]
        assert curve.at_event(k)[-1] == pytest.approx(1.0, abs=1e-3)
        middle = curve.between(k, 0.5)
        assert middle[0] == pytest.approx(np.cos(middle[-1]), abs=1e-4)


def test_a_curve_that_ends_is_given_up():
    """x = 0 along t: beyond t = 1 the equations are not sound, and the steps shrink until the curve is left."""

    def equations(z, i):
        along = np.stack([np.ones((len(z), 1)), np.zeros((len(z), 1))], axis=2)
        return z[:, :1], along, z[:, 1:], z[:, 1] < 1.0

    steps = curves.Steps(first=0.3, longest=0.3, shortest=1e-3)
    (curve,) = curves.follow(
        equations, np.zeros((1, 2)), np.array([[0.0, 1.0]]), lambda z, along, monitors, i: z[:, 1] > 5.0, steps
    )
    assert not curve.complete
    assert 0.99 < curve.points[-1, 1] < 1.0
