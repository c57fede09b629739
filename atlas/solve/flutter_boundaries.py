"""All curves at which inner shapes in a vacuum begin or cease to flutter, of a pair and a weight of the fish."""

import numpy as np

from towatlas.checks import check_one, check_order
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.limits import unchecked_threshold_length
from towatlas.results_motion import Boundary
from towatlas.solve.critical import solve_rows
from towatlas.solve.krein import SPEED, Collisions, Domain, S, boundaries
from towatlas.solve.members import shoot_lanes, solve_members
from towatlas.solve.motion import Array
from towatlas.solve.spectra import growth_columns
from towatlas.system import nondense_rows

# Lengths and speeds at which growth is counted first; a collision solved for is between its two speeds or this near.
LENGTHS, SPEEDS, NEAR = 21, 56, 0.04


def krein_boundaries(w_f: float, n: int = 1) -> tuple[Boundary, ...]:
    """Speeds at which the inner shape of n nodes in a vacuum begins or ceases to flutter, as curves over the length.

    Parameters
    ----------
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0.
    n : int
        Of the pair of shapes, >= 1.

    Returns
    -------
    tuple of Boundary
        For lambda - lambda_cn from 0.01 to 100 and gamma up to 3 gamma_cn.

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If shapes cannot be computed, or the work takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    Two oscillations meet there, one of negative energy: a double root of the Evans function D on the imaginary axis.
    Curves of D = dD / d(sigma^2) = 0 are followed by arclength from where, at 21 lengths and 56 speeds, the shape lasts
    on one side and not on the other; curves wholly between those are missed. Of n > 1, where two modes may flutter, a
    curve goes on where the other flutters already.

    Examples
    --------
    >>> curves = krein_boundaries(1352.0)
    >>> any("speed" in curve.kinds for curve in curves), bool(max(c.error.max() for c in curves) < 1e-8)
    (True, True)
    """
    w_f, n = check_one("w_f", w_f, zero=True), int(check_order(n))
    with patience():
        domain = Domain()
        start = _starts(n, w_f, domain)
        rows = len(start)
        if not rows:
            return ()
        orders, weights = np.full(rows, n), np.full(rows, w_f)
        found, good = Collisions(orders, weights, domain).solve(start, np.arange(rows), -1)
        # With s below zero two real growth rates meet.
        good &= (np.abs(found - start)[:, SPEED] < NEAR) & (found[:, S] >= 0.0)
        return tuple(boundaries(found[good], orders[good], weights[good], domain))


def _starts(n: int, w_f: float, domain: Domain) -> Array:
    """About where growth begins or ends, as `towatlas.solve.krein.boundaries` takes it."""
    # Off the limits, at which curves end.
    low, high = domain.excess
    excess = low * (high / low) ** ((np.arange(LENGTHS) + 0.5) / LENGTHS)
    lam = unchecked_threshold_length(w_f, n) + excess
    folds = solve_rows(lam=lam, w_f=np.full(LENGTHS, w_f), n=np.full(LENGTHS, n), excess=excess)["gamma"]
    share = (np.arange(SPEEDS) + 0.5) / SPEEDS
    gamma = (folds[:, None] * domain.speeds**share).ravel()
    cables = {"lam": np.repeat(lam, SPEEDS), "w_f": np.full(len(gamma), w_f), "gamma": gamma}
    orders = np.full(len(gamma), n)
    shapes = solve_members(**cables, n=orders, outer=np.zeros(len(gamma), bool), shoot=shoot_lanes)
    systems = nondense_rows(lam=cables["lam"], w_f=cables["w_f"], C=np.zeros(len(gamma)))
    known = np.where(shapes.status == status.OK, np.abs(shapes.x_f), np.nan)[:, None]
    column = orders[:, None]
    rates = growth_columns(systems, gamma, r_f=known, nodes=column, index=2 * column, error=shapes.error[:, None])
    unstable, speed = rates["unstable"].reshape(LENGTHS, SPEEDS), np.log(gamma).reshape(LENGTHS, SPEEDS)
    offset = np.log(shapes.a).reshape(LENGTHS, SPEEDS)
    squares = np.square(rates["frequency"][:, 0] / gamma).reshape(LENGTHS, SPEEDS)
    before, after = unstable[:, :-1], unstable[:, 1:]
    rows, columns = np.nonzero((np.minimum(before, after) == 0) & (np.maximum(before, after) > 0))
    grows = np.where(unstable[rows, columns] > 0, columns, columns + 1)
    middle = [0.5 * (part[rows, columns] + part[rows, columns + 1]) for part in (offset, speed)]
    return np.stack([*middle, np.log(excess)[rows], squares[rows, grows]], axis=1)
