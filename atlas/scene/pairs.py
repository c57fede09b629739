"""Critical speeds of a scene's cable by each model: those of a nondense fluid, followed into a dense one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.kernels import status
from towatlas.solve.drag_folds import fold_at, solve_drag_folds
from towatlas.system import System

# Steps from the nondense fluid to the dense one.
STEPS = 12
# Outcomes that say that a speed does not exist, not only that it is not known.
ABSENT = (status.NO_TRANSITION, status.NO_PAIR, status.NEVER_ENDS)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PairSpeeds:
    """Critical speeds of some pairs of equilibria by one model.

    Attributes
    ----------
    n : ndarray of int, shape (pairs,)
        Number of the pair, that of the transition in a vacuum [-], >= 1.
    appears : ndarray, shape (pairs,)
        Speed Omega sqrt(R/g) at which it appears [-], > 0; nan where status says why.
    ends : ndarray, shape (pairs,)
        Speed at which its outer member meets another equilibrium and is gone [-], > 0; nan where status_ends says why.
    C_cusp : ndarray, shape (pairs,)
        Drag constant above which the pair never appears [-], > 0; nan where not known.
    status, status_ends : ndarray of int8, shape (pairs,)
        Codes of `towatlas.kernels.status`.
    """

    n: NDArray[np.int64]
    appears: Array
    ends: Array
    C_cusp: Array
    status: NDArray[np.int8]
    status_ends: NDArray[np.int8]

    @classmethod
    def of_vacuum(cls, n: ArrayLike = (), gamma: ArrayLike = (), codes: ArrayLike = ()) -> "PairSpeeds":
        """Of a vacuum, where no pair ends: none by default.

        Parameters
        ----------
        n : array_like of int, shape (pairs,)
        gamma : array_like, shape (pairs,)
            Critical speeds [-].
        codes : array_like of int, shape (pairs,)
            Their statuses.

        Returns
        -------
        PairSpeeds
        """
        orders, none = np.array(n, np.int64), np.full(np.size(n), np.nan)
        lasting = np.full(len(orders), status.NEVER_ENDS, np.int8)
        return cls(orders, np.array(gamma, float), none, none, np.array(codes, np.int8), lasting)

    def at(self, n: int) -> tuple[float, int]:
        """Speed at which the n-th pair appears, and the status.

        Parameters
        ----------
        n : int

        Returns
        -------
        gamma : float
            [-]; nan where status is not OK.
        code : int
            NO_TRANSITION for one that is not among these: it does not exist.
        """
        row = np.flatnonzero(self.n == n)
        return (float(self.appears[row[0]]), int(self.status[row[0]])) if len(row) else (np.nan, status.NO_TRANSITION)


def pair_speeds(system: System, n: Sequence[int] | NDArray[np.int64]) -> PairSpeeds:
    """Critical speeds of some pairs, by the nondense solver, then with weight, mass and drag as they are.

    Parameters
    ----------
    system : System
    n : sequence of int
        Numbers of the pairs.

    Returns
    -------
    PairSpeeds

    Notes
    -----
    A pair that drag takes away in the nondense fluid of the same drag constant is not looked for in the dense one.
    """
    orders = np.array(n, np.int64)
    folds = solve_drag_folds(system.lam, system.w_f, system.C, n=orders)
    speeds = PairSpeeds(orders, folds.appears, folds.ends, folds.C_cusp, folds.status, folds.status_ends)
    if system.nondense or not len(orders):
        return speeds
    thin = System(system.lam, system.w_f, system.w_f, system.C)
    appears, codes = follow_folds(folds.r_f_appears, folds.appears, folds.status, thin, system)
    ends, codes_ends = follow_folds(folds.r_f_ends, folds.ends, folds.status_ends, thin, system)
    return PairSpeeds(orders, appears, ends, np.full(len(orders), np.nan), codes, codes_ends)


def follow_folds(
    r_f: Array, gamma: Array, codes: NDArray[np.int8], start: System, end: System
) -> tuple[Array, NDArray[np.int8]]:
    """Speeds of folds as the medium changes from one to another.

    Parameters
    ----------
    r_f, gamma : ndarray, shape (folds,)
        Distance of the fish from the axis over tow radius, and speed, in the first medium.
    codes : ndarray of int8, shape (folds,)
        Their statuses; folds that are not OK are not followed.
    start, end : System
        The two media.

    Returns
    -------
    gamma : ndarray, shape (folds,)
        nan where status is not OK.
    codes : ndarray of int8, shape (folds,)
        NOT_CONVERGED for a fold that is lost on the way.
    """
    with np.errstate(invalid="ignore"):
        z = np.log(np.stack([r_f * gamma**2, gamma], axis=1))
    z[codes != status.OK] = np.nan
    for share in np.linspace(0.0, 1.0, STEPS + 1)[1:]:
        system = (1.0 - share) * start.row() + share * end.row()
        z, _, _ = fold_at(z, np.tile(system, (len(z), 1)))
    found = np.exp(z[:, 1])
    lost = (codes == status.OK) & np.isnan(found)
    return found, np.where(lost, status.NOT_CONVERGED, codes).astype(np.int8)
