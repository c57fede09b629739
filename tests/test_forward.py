"""Skop's own shots: his printed digits, order, symmetry."""

import math

import numpy as np
import pytest
from helpers import boundary_error, root_near
from hypothesis import given
from hypothesis import strategies as st

from towatlas.kernels.calls import forward_shots
from towatlas.kernels.compiling import opened
from towatlas.kernels.steppers import rk4_forward
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


def test_mirror():
    """(x, R_x) -> (-x, -R_x) is a symmetry: E is odd, shown by the difference of two shots about x = 1 to -1."""
    step = opened(rk4_forward)
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
