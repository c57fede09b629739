"""Chebyshev series and the coordinates they live in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import chebyshev

from towatlas.numerics import chebyshev as interpolant

AXES = interpolant.Axes(1e-3, 1e3, 1e4)


def test_series_through_the_nodes():
    values = np.random.default_rng(0).normal(size=(3, 7, 10))
    series = interpolant.coefficients(values)
    np.testing.assert_allclose(
        interpolant.tensor(series, interpolant.nodes(10), interpolant.nodes(7)), values, atol=1e-13
    )


def test_evaluate_is_numpys_chebyshev_sum():
    """Patches of a series that falls as those of an atlas do, against the sum of the whole series; ends included."""
    rng = np.random.default_rng(1)
    decay = 10.0 ** (-np.add.outer(np.arange(96) / 96, np.arange(112) / 112) * 20)
    series = rng.normal(size=(3, 96, 112)) * decay
    n, x, y = rng.integers(1, 4, 10000), rng.uniform(-1, 1, 10000), rng.uniform(-1, 1, 10000)
    x[:4], y[:4] = [-1, -1, 1, 1], [-1, 1, -1, 1]
    x[4 : 5 + interpolant.PATCHES] = interpolant.nodes(interpolant.PATCHES + 1)
    expected = np.array([chebyshev.chebval2d(*at, series[k - 1]) for k, *at in zip(n, y, x, strict=True)])
    table = {k: interpolant.patches(series[k - 1]) for k in (1, 2, 3)}
    twice = interpolant.evaluate([table, table], n, x, y)
    np.testing.assert_array_equal(twice[0], twice[1])
    np.testing.assert_allclose(twice[0], expected, atol=1e-11)


def test_midpoints_lie_between_nodes():
    nodes, between = interpolant.nodes(9), interpolant.midpoints(9)
    assert (nodes[:-1] < between).all()
    assert (between < nodes[1:]).all()


@given(log_excess=st.floats(-3, 3), w_f=st.floats(0, 1e4))
def test_coordinates_and_back(log_excess, w_f):
    excess = 10.0**log_excess
    assert AXES.excess(AXES.x(excess)) == pytest.approx(excess, rel=1e-13)
    assert AXES.w_f(AXES.y(w_f)) == pytest.approx(w_f, rel=1e-12, abs=1e-16)


def test_ends_of_the_coordinates():
    assert AXES.w_f(np.array(-1.0)) == 0.0
    assert AXES.y(np.array([0.0, 1e4])) == pytest.approx([-1.0, 1.0])
    assert AXES.x(np.array([1e-3, 1e3])) == pytest.approx([-1.0, 1.0])


@pytest.mark.parametrize(("name", "value"), [("gamma", 2.5), ("R_x0", -7.0), ("z_f", 0.1)])
def test_fields_and_back(name, value):
    excess, n = np.array([0.3]), np.array([1])
    field = interpolant.to_field(name, np.array([value]), excess)
    assert interpolant.from_field(name, field, excess, n) == pytest.approx(value, rel=1e-15)


def test_sign_of_the_fish_offset():
    one, n = np.ones(2), np.array([1, 2])
    x_f = interpolant.from_field("x_f", interpolant.to_field("x_f", -3 * one, one), one, n)
    assert x_f == pytest.approx([-3, 3], rel=1e-15)
