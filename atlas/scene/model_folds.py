"""Critical speeds of a cable by the models with drag: those of a nondense fluid, followed into a dense one."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.scene.scene import Groups
from towatlas.solve.drag_folds import solve_drag_folds
from towatlas.solve.drag_shots import System, shoot
from towatlas.solve.jets import jets_of

FOLD = jets_of(2, gamma=True)
# Steps from the nondense fluid to the dense one, Newton steps on each, and the longest and the last of those.
STEPS, ROUNDS = 12, 10
LONGEST, LAST = 0.5, 1e-9

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModelFolds:
    """Critical speeds of some pairs of equilibria; arrays of shape (pairs,), dimensionless.

    n : number of the pair. appears : speed at which it appears. ends : at which its outer member meets another and is
    gone. inf where there is no such speed, nan where it is not known. C_cusp : the drag constant above which the pair
    never appears.
    """

    n: NDArray[np.int64]
    appears: Array
    ends: Array
    C_cusp: Array

    @classmethod
    def of_vacuum(cls, n: Sequence[int], gamma: Sequence[float]) -> "ModelFolds":
        """Of a vacuum, where no pair ends."""
        appears = np.array(gamma, float)
        return cls(np.array(n, np.int64), appears, np.full(len(appears), inf), np.full(len(appears), nan))

    def gamma(self, n: int) -> float:
        """Speed at which the n-th pair appears; inf for one that is not among these."""
        at = np.flatnonzero(self.n == n)
        return float(self.appears[at[0]]) if len(at) else inf


def model_folds(groups: Groups, n: Sequence[int]) -> ModelFolds:
    """Folds of some pairs, by the nondense solver, then with the weight, mass and drag of cable and fish as they are.

    A pair that drag takes away in the nondense fluid of the same drag constant is not looked for in the dense one.
    """
    orders = np.array(n, np.int64)
    if not len(orders):
        return ModelFolds(orders, np.empty(0), np.empty(0), np.empty(0))
    folds = solve_drag_folds(groups.lam, groups.w_f, groups.C, n=orders)
    none = np.isin(folds.status, (status.NO_PAIR, status.NO_TRANSITION))
    appears = np.where(folds.status == status.OK, folds.appears, np.where(none, inf, nan))
    never = none | (folds.status_ends == status.NEVER_ENDS)
    ends = np.where(folds.status_ends == status.OK, folds.ends, np.where(never, inf, nan))
    if (groups.m_f, groups.C_f, groups.w) == (groups.w_f, 0.0, 1.0):
        return ModelFolds(orders, appears, ends, folds.C_cusp)
    thin = System(groups.lam, groups.w_f, groups.w_f, groups.C)
    full = System(groups.lam, groups.w_f, groups.m_f, groups.C, groups.C_f, groups.w)
    appears = follow_folds(folds.r_f_appears, appears, thin, full)
    ends = follow_folds(folds.r_f_ends, ends, thin, full)
    return ModelFolds(orders, appears, ends, np.full(len(orders), nan))


def follow_folds(r_f: Array, gamma: Array, start: System, end: System) -> Array:
    """Speeds of folds as the medium changes from one to another; nan where a fold is lost, not finite ones as they are.

    At a fold log rho of the shot and its slope in log r vanish, rho the radius at the tow point over the tow radius.

    Parameters
    ----------
    r_f, gamma : ndarray, shape (folds,)
        Radius of the fish over the tow radius, and speed, in the first medium.
    start, end : System
    """
    result = gamma.copy()
    with np.errstate(invalid="ignore"):
        rows = np.flatnonzero(np.isfinite(gamma) & (r_f > 0.0))
    result[np.isfinite(gamma)] = nan
    z = np.log(np.stack([r_f[rows] * gamma[rows] ** 2, gamma[rows]], axis=1))
    for share in np.linspace(0.0, 1.0, STEPS + 1)[1:]:
        system = (1.0 - share) * start.row() + share * end.row()
        z = _newton(z, system)
    result[rows] = np.exp(z[:, 1])
    return result


def _newton(z: Array, system: Array) -> Array:
    """Folds of one system from guesses of log r and log gamma, rows of z; nan where they do not converge."""
    z = z.copy()
    active = np.isfinite(z[:, 0] + z[:, 1])
    z[~active] = nan
    at = FOLD.at
    for _ in range(ROUNDS):
        i = np.flatnonzero(active)
        if not len(i):
            return z
        ends = shoot(np.exp(z[i, 0]), np.exp(z[i, 1]), system, FOLD)
        jet = ends.log_rho
        value, slope, second = jet[:, 0], jet[:, at(1, 0, 0)], 2.0 * jet[:, at(2, 0, 0)]
        value_speed, slope_speed = jet[:, at(0, 1, 0)], jet[:, at(1, 1, 0)]
        with np.errstate(all="ignore"):
            determinant = slope * slope_speed - second * value_speed
            step = np.stack([value_speed * slope - slope_speed * value, second * value - slope * slope], axis=1)
            step /= determinant[:, None]
            size = np.abs(step).max(axis=1)
        lost = (ends.status != status.OK) | ~(size < LONGEST)
        z[i] += np.where(lost[:, None], nan, step)
        # Speed depends on the radius to the second order only.
        active[i[lost | (size < np.sqrt(LAST)) & (np.abs(step[:, 1]) < LAST)]] = False
    z[active] = nan
    return z
