"""Skop's own shots: his printed digits, order, symmetry."""

import math

import numpy as np
import pytest
from helpers import boundary_error, forward_step, root_near
from hypothesis import given
from hypothesis import strategies as st

from towatlas.kernels import vacuum
from towatlas.kernels.calls import forward_shots
from towatlas.kernels.compiling import opened
from towatlas.kernels.sweeps import forward_shots_parallel

# NRL Report 7048, Eqs. after (36): the median roots of the system of Fig. 16, all digits as printed there, and the
# roots of the equations themselves.
PRINTED = [(1.64, 5.543629, 5.5436291), (2.97, 552.265381, 552.2654082), (5.94, 534.242818, 534.2432718)]


@pytest.mark.parametrize(("gamma", "printed", "exact"), PRINTED)
def test_report_digits(gamma, printed, exact):
    """100 segments give the digits printed in 1970, truncation error and all; many segments give the true root.

    Within one unit of the last printed digit: the report iterated to |E| < 1e-5 in the arithmetic of its time.
    """
    assert root_near(1352, 37.8, gamma, printed, segments=100) == pytest.approx(printed, abs=1e-6)
    assert root_near(1352, 37.8, gamma, exact, segments=20000) == pytest.approx(exact, abs=6e-8)


def test_report_zero_node_root_is_not_reproduced():
    """The printed R_x0 = 3.79886 of Fig. 11 is no root; the equations, and 100 segments, give 3.81946."""
    assert root_near(0.0, 2.0, 1.0, 3.82, segments=100) == pytest.approx(3.8194580, abs=5e-7)
    assert abs(boundary_error(0.0, 2.0, 1.0, 3.79886)[0]) > 0.01


@pytest.mark.parametrize("w_f", [0.5, 20.0])
def test_fourth_order(w_f):
    segments = np.array([40, 80, 160])
    ends = [boundary_error(w_f, 3.0, 1.2, 4.0, n)[0] for n in [*segments, 5120]]
    errors = np.abs(np.array(ends[:3]) - ends[3])
    assert np.log2(errors[:2] / errors[1:]) == pytest.approx([4, 4], abs=0.25)


def test_inverse_root_is_rounded_as_well_as_a_root_and_a_division():
    """To the 1.5 units that a root and a quotient, each rounded, may miss by."""
    inverse_root = opened(vacuum.inverse_root)
    x = 10.0 ** np.random.default_rng(0).uniform(-300, 300, 5000)
    exact = 1 / np.sqrt(x.astype(np.longdouble))
    assert np.abs([inverse_root(value) for value in x] / exact - 1).max() < 1.5 * 2.0**-53
    assert 0.0 * inverse_root(0.0) == 0.0


def test_shots_are_those_of_long_double():
    """Rounding alone: E and x at the fish against the same 100 steps in long double, with its roots and divisions.

    Over what E and x are differences of; where waves magnify rounding, as much as they magnify that of R_x0.
    """
    rng = np.random.default_rng(4)
    w_f, lam, gamma = 10.0 ** rng.uniform(-1, 3, 200), 10.0 ** rng.uniform(0, 1, 200), 10.0 ** rng.uniform(-1, 0.3, 200)
    r_x0 = -(gamma**2) * lam

    def slopes(x, force, below):
        return force / np.sqrt(below * below + force * force), -(gamma**2) * x

    def exact(r_x0):
        x, force = np.ones(200, np.longdouble), r_x0.astype(np.longdouble)
        ds = lam.astype(np.longdouble) / 100
        for k in range(100, 0, -1):
            below = w_f + k * ds
            x1, f1 = slopes(x, force, below)
            x2, f2 = slopes(x + ds / 2 * x1, force + ds / 2 * f1, below - ds / 2)
            x3, f3 = slopes(x + ds / 2 * x2, force + ds / 2 * f2, below - ds / 2)
            x4, f4 = slopes(x + ds * x3, force + ds * f3, below - ds)
            x, force = x + ds / 6 * (x1 + 2 * x2 + 2 * x3 + x4), force + ds / 6 * (f1 + 2 * f2 + 2 * f3 + f4)
        return x, force

    errors, x_end, force_end = (np.empty(200) for _ in range(3))
    forward_shots(lam, w_f, gamma, r_x0, 100, errors, x_end, force_end, 0, 200)
    x, force = exact(r_x0)
    moved = np.abs(exact(r_x0 * (1 + 1e-9))[0] - x) * 1e9
    assert (np.abs(x_end - x) <= 1e-13 * (1 + np.abs(x) + moved)).all()
    size = np.abs(force) + w_f * gamma**2 * (1 + np.abs(x) + moved)
    assert (np.abs(errors - (force - w_f * gamma**2 * x)) <= 1e-13 * size).all()


def test_mirror():
    """(x, R_x) -> (-x, -R_x) is a symmetry: E is odd, shown by the difference of two shots about x = 1 to -1."""
    step = forward_step()
    right, left = (1.0, 3.0), (-1.0, -3.0)
    for k in range(50):
        right = step(*right, 7.0 - 0.1 * k, 1.7, 0.1)
        left = step(*left, 7.0 - 0.1 * k, 1.7, 0.1)
    assert left == (-right[0], -right[1])


@given(
    w_f=st.floats(0, 1e4),
    lam=st.floats(0.01, 1e3),
    gamma=st.floats(0.01, 20),
    share=st.floats(-0.5, 1.5),
    tail=st.integers(1, 70),
)
def test_bounds_of_eq_35(w_f, lam, gamma, share, tail):
    """Below the lower bound E < 0, above the upper E > 0, for any cable (500 segments keep |dx/ds| <= 1)."""
    low = -(gamma**2) * (lam**2 / 2 + lam * (w_f - 1) - w_f)
    high = gamma**2 * (lam**2 / 2 + lam * (w_f + 1) + w_f)
    r_x0 = low + share * (high - low)
    error = boundary_error(w_f, lam, gamma, [r_x0] * tail, 500)
    assert len(set(error)) == 1
    if share < -0.01:
        assert error[0] < 0
    if share > 1.01:
        assert error[0] > 0


def test_parallel_build_gives_the_same_bits():
    rng = np.random.default_rng(0)
    columns = (
        10 ** rng.uniform(-1, 2, 5001),
        10 ** rng.uniform(0, 2, 5001),
        10 ** rng.uniform(-1, 1, 5001),
        rng.normal(0, 50, 5001),
    )
    outputs = []
    for build, rows in ((forward_shots, (0, 5001)), (forward_shots_parallel, ())):
        out = [np.empty(5001) for _ in range(3)]
        build(*columns, 100, *out, *rows)
        outputs.append(out)
    np.testing.assert_array_equal(*outputs)
    assert math.isfinite(outputs[0][0].sum())
