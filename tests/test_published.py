"""The numbers of the report: recomputed, and what is said to explain each difference does."""

import numpy as np
import pytest
from helpers import boundary_error

from towatlas.report.nrl7048.published import PUBLISHED, compare, euler_root, rk4_root

ROWS = {row.published.quantity: row for row in compare()}


def row(beginning):
    return next(r for name, r in ROWS.items() if name.startswith(beginning))


def test_every_digit_right_or_explained():
    """Whatever is printed as a value and not recomputed to its last digit has a method that comes close to it."""
    assert len(ROWS) == len(PUBLISHED)
    for name, r in ROWS.items():
        p = r.published
        if p.relation in "<>":
            assert r.agrees, name
        elif p.relation == "=" and not r.agrees:
            assert p.method, name
            assert abs(r.as_then - p.printed) < abs(r.recomputed - p.printed) / 20, name


@pytest.mark.parametrize("gamma", [1.64, 2.97, 5.94])
def test_median_roots_with_100_segments(gamma):
    """To one unit of the last digit printed."""
    r = row(f"median R_x0 at lambda = 37.8, w_f = 1352, gamma = {gamma:g}")
    assert abs(r.as_then - r.published.printed) <= 1e-6


def test_root_of_fig_11_is_of_first_order():
    """3.79886 is no root; Euler's differs from the true one by as much, an error that falls as the step."""
    r = row("R_x0 at lambda = 2")
    assert abs(rk4_root(lam=2.0, w_f=0.0, gamma=1.0, guess=3.8) - r.recomputed) < 1e-8
    assert boundary_error(0.0, 2.0, 1.0, r.published.printed)[0] == pytest.approx(-0.018, abs=1e-3)
    errors = np.array(
        [euler_root(lam=2.0, w_f=0.0, gamma=1.0, guess=3.8, steps=steps) - r.recomputed for steps in (50, 100, 200)]
    )
    assert np.log2(errors[:2] / errors[1:]) == pytest.approx([1, 1], abs=0.05)
    assert errors[1] == pytest.approx(r.published.printed - r.recomputed, rel=2e-3)
    # Not to the last digit: the explanation is the best known, not a proof.
    assert abs(r.as_then - r.published.printed) > 1e-5


@pytest.mark.parametrize(("curve", "beginning"), [(5.0, "gamma_c1(2.1"), (0.0, "gamma_c1(10"), (1.0, "gamma_c2(10")])
def test_speeds_read_off_lie_between_two_curves(curve, beginning):
    r = row(beginning)
    assert curve < r.recomputed <= r.published.printed


def test_text():
    assert row("gamma_c1(2.1").text() == ("~ 6.2", "5.720", "")
    assert row("R_x0 at").text() == ("3.79886", "3.8194580", "3.7988815")
    assert row("number").text() == ("1", "1", "")
