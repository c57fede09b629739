"""Critical speeds solved directly, without an atlas."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_order, check_positive_finite, check_real
from towatlas.effort import check_foreseen, check_patience, patience, scaled
from towatlas.kernels import status
from towatlas.labelled import takes_frames
from towatlas.limits import unchecked_excess_length
from towatlas.results import CriticalStates
from towatlas.solve.batches import batches
from towatlas.solve.fold_seeds import seed
from towatlas.solve.members import FEWEST

Array = NDArray[np.float64]

# From here on the parallel build, whose call costs a millisecond, is the faster one.
PARALLEL_FROM = 256
# Steps of one shot: with the default patience, some ten of which a fold takes, a few seconds together; at most.
STEPS, MOST_STEPS = 4 * 10**5, 10**7
# Half waves up to the folds of one call, each about 5 microseconds where there are many folds, up to ten times as much
# next to thresholds: a second or three. More than 30 where there is one fold.
HALF_WAVES_A_CALL = 1e5
SECONDS_A_HALF_WAVE = 5e-6
REMEDY = "a lower number of the transition (n), or fewer cables, take less"


def solve_rows(
    *, lam: Array, w_f: Array, n: NDArray[np.int64], excess: Array, guess: tuple[Array, Array] | None = None
) -> dict[str, NDArray[Any]]:
    """Critical states of the rows given, by the direct solver; no checks.

    Parameters
    ----------
    lam, w_f, n, excess : ndarray, shape (rows,)
        `excess` is lambda - lambda_cn, given apart so that it may be known better than lambda's rounding allows.
    guess : pair of ndarray, shape (rows,), optional
        Fish offset gamma^2 x_f and gamma to start from.

    Returns
    -------
    dict of ndarray, shape (rows,)
        gamma, R_x0, x_f, z_f, tension, error, status. nan where status is not OK.
    """
    from towatlas.kernels.calls import SLOPES, Cables, Folds, solve_folds
    from towatlas.kernels.sweeps import solve_folds_parallel

    lam, w_f, excess = (np.array(column, float, order="C") for column in (lam, w_f, excess))
    n = np.array(n, np.int64, order="C")
    rows = len(n)
    if guess is None:
        a, gamma, slopes = seed(lam=lam, w_f=w_f, n=n, excess=excess, solve=solve_rows)
    else:
        a, gamma, slopes = np.abs(guess[0]), guess[1].copy(), np.full((rows, SLOPES), np.nan)
    states = np.empty((rows, 4))
    error = np.empty(rows)
    codes = np.empty(rows, np.int64)
    columns = [lam, w_f, n, excess]
    solved = a, gamma, slopes, states, error, codes
    max_steps = scaled(STEPS, MOST_STEPS)
    # A shot to a fold with more of them than that ends at its last step.
    half_waves = np.where(columns[3] > 0.0, np.minimum(columns[2], max_steps / FEWEST), 0.0)
    check_foreseen(SECONDS_A_HALF_WAVE * half_waves.sum(), f"{rows:,} critical states", REMEDY)
    for part in batches(1.0 + half_waves, HALF_WAVES_A_CALL):
        check_patience("critical states", REMEDY, done=part.start, of=rows)
        some, into = [column[part] for column in columns], [column[part] for column in solved]
        if len(some[0]) >= PARALLEL_FROM:
            solve_folds_parallel(Cables(*some), Folds(*into), max_steps)
        else:
            solve_folds(Cables(*some), Folds(*into), max_steps, 0, len(some[0]))
    with np.errstate(over="ignore"):
        tension = np.where(codes == status.OK, np.hypot(w_f + lam, states[:, 1]), np.nan)
    return {
        "gamma": states[:, 0],
        "R_x0": states[:, 1],
        "x_f": states[:, 2],
        "z_f": states[:, 3],
        "tension": tension,
        "error": error,
        "status": codes.astype(np.int8),
    }


@takes_frames
def solve_critical(lam: ArrayLike, w_f: ArrayLike, n: ArrayLike = 1) -> CriticalStates:
    """Critical states of towed cables, each solved directly.

    Parameters
    ----------
    lam : array_like
        Cable length over tow radius [-], > 0.
    w_f : array_like
        Fish weight over (mu + rho A) g R [-], >= 0.
    n : array_like of int
        Number of the transition, >= 1; no upper limit.

    Returns
    -------
    CriticalStates
        Arrays of the broadcast shape. nan where there is no such transition (status NO_TRANSITION).

    Raises
    ------
    ValueError
        For numbers out of range, and what is not a number.
    TooMuchWork
        If they take longer than `towatlas.patience` allows; one row too long for it has the status STEP_LIMIT.

    Notes
    -----
    A shot from the fish up with offset a at t = mu satisfies the boundary condition at the fish; the n-th zero of
    q = dp/da on it is the n-th fold, of the cable ``gamma^2 = |p|, lambda = (t - mu)/|p|, w_f = mu/|p|``. Two unknowns
    (a, gamma) are found by Newton in the logarithms; there is exactly one such pair (docs/proofs.md, Theorem 5).
    Relative error of gamma: `error`, about 48 eps (1 + lambda / (lambda - lambda_cn)).

    References
    ----------
    The problem: NRL Report 7048, Eqs. (29)-(33). The heavy rotating string: Kolodner, Comm. Pure Appl. Math. 8 (1955).

    Examples
    --------
    >>> round(float(solve_critical(10.0, 0.0).gamma), 10)
    0.4928896763
    """
    lam, w_f = check_real("lam", lam), check_real("w_f", w_f)
    check_positive_finite("lam", lam)
    check_positive_finite("w_f", w_f, zero=True)
    lam, w_f, n = check_broadcast(lam=lam, w_f=w_f, n=check_order(n))
    cables: dict[str, Any] = {"lam": lam.ravel(), "w_f": w_f.ravel(), "n": n.ravel()}
    with patience():
        columns = solve_rows(**cables, excess=unchecked_excess_length(**cables))
    return CriticalStates(n=n, lam=lam, w_f=w_f, **{name: column.reshape(n.shape) for name, column in columns.items()})
