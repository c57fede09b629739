"""How many critical speeds of a cable lie below a speed: each number tried is solved, few have to be."""

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience
from towatlas.kernels import status
from towatlas.limits import threshold_offset, unchecked_excess_length
from towatlas.solve.critical import solve_rows
from towatlas.solve.members import REMEDY

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Numbers tried by the closed form, before what is left is halved.
GUESSES = 6
# As many transitions as are counted; n is no larger anywhere.
MOST = 2.0**31 - 1.0


def folds_passed(*, lam: Array, w_f: Array, gamma: Array) -> Integers:
    """Number of critical speeds below gamma, for each row; no checks.

    Parameters
    ----------
    lam, w_f, gamma : ndarray, shape (rows,)
        Cable length, fish weight and speed [-].

    Returns
    -------
    ndarray of int, shape (rows,)
        -1 where a shot to one of them takes too many steps.

    Notes
    -----
    Critical speeds rise with n (docs/proofs.md, Theorem 5): between one below gamma and one that is not, the next tried
    is where the closed form of the guesses, scaled to the last speed found, has gamma.
    """
    low, high = np.zeros(len(lam), np.int64), _most_transitions(lam=lam, w_f=w_f) + 1
    scale = np.ones(len(lam))
    rows = np.flatnonzero(high > 1)
    round_ = 0
    while len(rows):
        check_patience("counting critical speeds", REMEDY, done=len(lam) - len(rows), of=len(lam))
        length, weight = lam[rows], w_f[rows]
        n = guess_passed(lam=length, w_f=weight, gamma=gamma[rows] / scale[rows])
        if round_ >= GUESSES:
            n = (low[rows] + high[rows]) // 2
        n = np.clip(n, low[rows] + 1, high[rows] - 1)
        states = solve_rows(lam=length, w_f=weight, n=n, excess=unchecked_excess_length(lam=length, w_f=weight, n=n))
        # One that rounding hides lies next to its threshold, beyond any speed.
        known = states["status"] == status.OK
        below = known & (states["gamma"] < gamma[rows])
        low[rows[below]], high[rows[~below]] = n[below], n[~below]
        low[rows[states["status"] == status.STEP_LIMIT]] = -1
        scale[rows[known]] = states["gamma"][known] / guess_speed(lam=length, w_f=weight, n=n)[known]
        rows = rows[(low[rows] >= 0) & (high[rows] - low[rows] > 1)]
        round_ += 1
    return low


def _most_transitions(*, lam: Array, w_f: Array) -> Integers:
    """How many transitions cables have, as `towatlas.limits.transitions`; at most 2^31 - 1, as n may be."""
    return np.clip(np.ceil(0.5 * (lam + 1.0 - threshold_offset(w_f))) - 1.0, 0.0, MOST).astype(np.int64)


def guess_speed(*, lam: Array, w_f: Array, n: Integers) -> Array:
    """Critical speed of a wave of n - 1 half-lengths above a pendulum, as `towatlas.kernels.folds` guesses it.

    Parameters
    ----------
    lam, w_f : ndarray, shape (rows,)
        Cable length and fish weight [-].
    n : ndarray of int, shape (rows,)
        Numbers of transitions, >= 1, that exist.

    Returns
    -------
    ndarray, shape (rows,)
        gamma [-], right within a factor of about two.
    """
    waves, pendulum = _wave(lam=lam, w_f=w_f)
    with np.errstate(all="ignore"):
        return (waves * (n - 1) + pendulum) / np.sqrt(unchecked_excess_length(lam=lam, w_f=w_f, n=n))


def guess_passed(*, lam: Array, w_f: Array, gamma: Array) -> Integers:
    """How many critical speeds lie below gamma, by `guess_speed`.

    Parameters
    ----------
    lam, w_f, gamma : ndarray, shape (rows,)
        Cable length, fish weight and speed [-].

    Returns
    -------
    ndarray of int, shape (rows,)
        >= 0, at most 2^31 - 1.
    """
    waves, pendulum = _wave(lam=lam, w_f=w_f)
    with np.errstate(all="ignore"):
        # (waves k + pendulum)^2 = gamma^2 (longest - 2 k) with k = n - 1, over gamma^2: the root above zero.
        slope, start = waves / gamma, pendulum / gamma
        longest = lam - 1.0 - threshold_offset(w_f)
        half = slope * start + 1.0
        missing = longest - start * start
        # Without the squares, which overflow; where the first speed is above gamma, k is negative or nan.
        k = missing / (half + np.hypot(half, slope * np.sqrt(missing)))
        return np.nan_to_num(np.clip(np.floor(k) + 1.0, 0.0, MOST)).astype(np.int64)


def _wave(*, lam: Array, w_f: Array) -> tuple[Array, Array]:
    """gamma sqrt(lambda - lambda_cn) of each further half wave, and of the pendulum below the first."""
    m = np.sqrt(w_f / lam)
    half = 0.5 * (np.sqrt(1.0 + m * m) + m)
    return np.pi * half, half / (m + 4.0 / (3.0 * np.pi))
