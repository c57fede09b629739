"""Equations solved row by row, all rows at once: Newton's method, and roots inside brackets.

A row is one problem; arrays have it first. Rows drop out as they are done, so that the last ones cost no more than
their own share. Functions are called with the rows still open, `i`, and give values for those alone.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
# Unknowns (rows, n) and which rows -> residuals (rows, n), their Jacobian (rows, n, n), and whether they are sound.
Residuals = Callable[[Array, Integers], tuple[Array, Array, Booleans]]
# Steps (rows, n), the size of each, that of the step before -> which of them were the last.
Settled = Callable[[Array, Array, Array], Booleans]
# Points (rows,) and which rows -> values and slopes; a slope that is not known is nan.
Function = Callable[[Array, Integers], tuple[Array, Array]]

EPS = 2.0**-52
# Every so many rounds a bracket is halved, whatever Newton or false position say, and there are rounds enough to halve
# it down to the rounding of a root of its own size: none takes for ever, however flat the function.
HALVED_EVERY, HALVED_EVERY_WITHOUT_SLOPE = 8, 3
BRACKET_ROUNDS = 500


def solve_systems(matrix: Array, right: Array) -> Array:
    """Solutions of small linear systems.

    Parameters
    ----------
    matrix : ndarray, shape (rows, n, n)
    right : ndarray, shape (rows, n)

    Returns
    -------
    ndarray, shape (rows, n)
        nan where singular or not finite.
    """
    with np.errstate(all="ignore"):
        bad = ~(np.isfinite(matrix).all(axis=(1, 2)) & (np.abs(np.linalg.det(matrix)) > 0.0))
    matrix = np.where(bad[:, None, None], np.eye(matrix.shape[1]), matrix)
    return np.where(bad[:, None], np.nan, np.linalg.solve(matrix, right[:, :, None])[:, :, 0])


def newton(
    residuals: Residuals, z: Array, *, rounds: int, longest: float, settled: Settled
) -> tuple[Array, Array, Booleans]:
    """Roots near the guesses z, shape (rows, n).

    Parameters
    ----------
    residuals : callable
    z : ndarray, shape (rows, n)
        Guesses; rows with a nan are passed over.
    rounds : int
        Steps at most.
    longest : float
        A row whose step is longer in any unknown, or whose residuals are not sound, is lost.
    settled : callable

    Returns
    -------
    z : ndarray, shape (rows, n)
        nan for rows that are not solved.
    step : ndarray, shape (rows, n)
        The last of each row.
    solved : ndarray of bool, shape (rows,)
    """
    z, steps, solved = np.array(z, float), np.full(z.shape, np.nan), np.zeros(len(z), bool)
    last = np.full(len(z), np.inf)
    active = np.asarray(np.isfinite(z).all(axis=1))
    for _ in range(rounds):
        i = np.flatnonzero(active)
        if not len(i):
            break
        value, jacobian, sound = residuals(z[i], i)
        step = solve_systems(jacobian, -value)
        size = np.abs(step).max(axis=1)
        lost = ~sound | ~(size < longest)
        z[i] += np.where(lost[:, None], np.nan, step)
        steps[i] = step
        done = ~lost & settled(step, size, last[i])
        solved[i[done]] = True
        last[i] = size
        active[i[lost | done]] = False
    z[~solved] = np.nan
    return z, steps, solved


def bracket(
    function: Function,
    low: Array,
    high: Array,
    *,
    start: Array | None = None,
    resolution: float | Array = 0.0,
    last_step: float | Array = 0.0,
) -> tuple[Array, Booleans]:
    """Roots of rising functions inside brackets, by Newton where it stays inside, by false position without a slope.

    Parameters
    ----------
    function : callable
    low, high : ndarray, shape (rows,)
        Ends, finite; a function is taken to be negative at `low`. That it is positive at `high` need not be known.
    start : ndarray, shape (rows,), optional
        First points tried; the middles by default.
    resolution : float or ndarray, shape (rows,)
        What a root need not be known better than, beside its own rounding; a root at zero needs one.
    last_step : float or ndarray, shape (rows,)
        A step of Newton this short is the last: the square of it is below the resolution.

    Returns
    -------
    x : ndarray, shape (rows,)
        nan where the function is negative at `high`.
    solved : ndarray of bool, shape (rows,)
        Whether a row came to an end: False, and nan, for one whose function became nan or that needs more rounds.
    """
    rows = len(low)
    low, high = low.copy(), high.copy()
    at_low, at_high = np.full(rows, np.nan), np.full(rows, np.nan)
    x = 0.5 * (low + high) if start is None else np.clip(start, low, high)
    resolution, last_step = np.broadcast_to(resolution, rows), np.broadcast_to(last_step, rows)
    side, same = np.full(rows, -1), np.zeros(rows, np.int64)
    solved, lost = np.zeros(rows, bool), np.zeros(rows, bool)
    for round_ in range(BRACKET_ROUNDS):
        i = np.flatnonzero(~solved & ~lost)
        if not len(i):
            break
        value, slope = function(x[i], i)
        lost[i[np.isnan(value)]] = True
        above = value > 0.0
        beyond = (value < 0.0) & (x[i] >= high[i])
        high[i[above]], at_high[i[above]] = x[i[above]], value[above]
        low[i[~above]], at_low[i[~above]] = x[i[~above]], value[~above]
        # Illinois: an end that stays put twice counts half, so that false position comes to it.
        same[i] = np.where(side[i] == above, same[i] + 1, 0)
        side[i] = above
        stuck = i[same[i] > 0]
        at_low[stuck[side[stuck] == 1]] *= 0.5
        at_high[stuck[side[stuck] == 0]] *= 0.5
        with np.errstate(all="ignore"):
            step = -value / slope
            between = low[i] - at_low[i] * (high[i] - low[i]) / (at_high[i] - at_low[i])
        known = np.isfinite(slope)
        # Beyond the upper end nothing is sought; a step up from above the root, where the slope falls, is none at all.
        trial = np.where(known, np.where(above, x[i] + step, np.minimum(x[i] + step, high[i])), between)
        every = np.where(known, HALVED_EVERY, HALVED_EVERY_WITHOUT_SLOPE)
        inside = (trial >= low[i]) & (trial <= high[i]) & (round_ % every != every - 1)
        tiny = np.maximum(4.0 * EPS * np.abs(x[i]), resolution[i])
        moved = np.abs(trial - x[i])
        done = inside & (moved <= np.maximum(np.where(known, last_step[i], 0.0), tiny))
        narrow = high[i] - low[i] <= tiny
        # Whether there is a root at all is not known before the upper end has been looked at.
        unseen = np.isnan(at_high[i]) & ~beyond & (value != 0.0) & (narrow | (done & (trial >= high[i])))
        done = (done | narrow | (value == 0.0) | beyond) & ~unseen
        x[i] = np.where(value == 0.0, x[i], np.where(inside, trial, 0.5 * (low[i] + high[i])))
        x[i[unseen]] = high[i[unseen]]
        x[i[beyond]] = np.nan
        solved[i[done]] = True
    solved &= ~lost
    x[~solved] = np.nan
    return x, solved


def root(function: Callable[[float], float], low: float, high: float) -> float:
    """The root of one function between two ends at which it has different signs, to rounding.

    Parameters
    ----------
    function : callable
        Of one number.
    low, high : float
        Finite; the signs at them differ, or one value is zero.

    Returns
    -------
    float

    Raises
    ------
    ArithmeticError
        Where the signs are the same, or the function becomes nan.

    Notes
    -----
    Chandrupatla (1997): inverse quadratic interpolation where the three last values allow it, halving otherwise.

    Examples
    --------
    >>> round(root(lambda x: x * x - 2.0, 1.0, 2.0), 12)
    1.414213562373
    """
    a, b = high, low
    at_a, at_b = function(a), function(b)
    if not at_a * at_b <= 0.0:
        raise ArithmeticError(f"the function has one sign, or none, at {low:g} and {high:g}: {at_b:g} and {at_a:g}")
    c, at_c, share = a, at_a, 0.5
    for _ in range(BRACKET_ROUNDS):
        best, at_best = (a, at_a) if abs(at_a) < abs(at_b) else (b, at_b)
        smallest = 2.0 * EPS * abs(best)
        if at_best == 0.0 or abs(b - a) <= 2.0 * smallest:
            return best
        share = min(max(share, smallest / abs(b - a)), 1.0 - smallest / abs(b - a))
        x = a + share * (b - a)
        at_x = function(x)
        if at_x != at_x:
            raise ArithmeticError(f"the function is nan at {x:g}")
        if (at_x > 0.0) == (at_a > 0.0):
            c, at_c = a, at_a
        else:
            c, b, at_c, at_b = b, a, at_b, at_a
        a, at_a = x, at_x
        xi, phi = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b) if at_c != at_b else 2.0
        share = 0.5
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            share = at_a / (at_b - at_a) * at_c / (at_b - at_c)
            share += (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
    raise ArithmeticError(f"no root was found between {low:g} and {high:g} in {BRACKET_ROUNDS} rounds")
