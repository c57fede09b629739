"""Small motions about equilibria: coefficients along shapes, and the Evans function of their growth rates."""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience
from towatlas.kernels import status
from towatlas.kernels.system import C_F, C_S, C_T, M_F, C
from towatlas.solve.batches import batches
from towatlas.solve.jets import jets_of
from towatlas.solve.shots import upright

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Complex = NDArray[np.complex128]

# Growth of the solutions in a step, by which the last of twenty terms is rounding: 1.5^20 / 20! = 1.4e-15, of a
# solution that has grown by 4.5.
BOUND = 1.5
# Steps of a shape for which there is room, at first and at most: a series of a step takes 4.5 kB.
ROOM, MOST_ROOM = 256, 2048
# Steps of solutions between two looks at the clock: about a second.
STEPS_A_CALL = 300_000
# With threads so many parts, none of fewer steps.
PARTS, STEPS_A_PART = 8, 2_000
# Terms of a step, and steps between two times that solutions are made orthonormal, where four digits suffice:
# 1.5^10 / 10! = 2e-5, and a shot's own series, to rounding at 20, are to its root.
ROUGH_TERMS, ROUGH_EVERY = 10, 3
# Two terms in a row that are together below this end a series, of solutions of size 1: what follows, less than a tenth,
# is lost in rounding.
SMALL, ROUGH_SMALL = 2.0**-50, 1e-7
REMEDY = "a shorter cable, a lower speed or less drag needs fewer steps"
# Shapes side by side.
TOGETHER = 8


@dataclass(frozen=True)
class Motion:
    """Small motion about one equilibrium. Lengths over g / Omega^2, times over 1 / Omega, as in `kernels.variation`.

    Attributes
    ----------
    series : ndarray, shape (steps, terms, rows)
        Taylor coefficients of T and of the matrices P, T A and E P, in the part of a step, from the fish up.
    sizes : ndarray, shape (steps,)
        Of the steps, in tau, of which d(tau) = du / T.
    start : ndarray, shape (3,)
        As of `kernels.variation.expand_shapes`.
    fish : ndarray, shape (2,)
        Mass of the fish, and C_f r.
    drag : bool
        Whether there is drag along the cable, or a side force.
    reach : float
        |sigma| up to which the steps are short enough.
    status : int
        A code of `towatlas.kernels.status`.
    """

    series: Array
    sizes: Array
    start: Array
    fish: Array
    drag: bool
    reach: float
    status: int

    @property
    def fastest_flow(self) -> float:
        """Largest speed of the flow along the cable over that of its waves [-], 0 without drag."""
        return float(self.start[2])

    def evans(self, sigma: Complex, rough: bool = False) -> tuple[Complex, Array]:
        """D(sigma), zero at the growth rates.

        Parameters
        ----------
        sigma : ndarray of complex, shape (points,)
            In units of Omega.
        rough : bool
            To four digits or so, in a quarter of the time.

        Returns
        -------
        values : ndarray of complex, shape (points,)
        logs : ndarray, shape (points,)
            D is values times exp(logs).
        """
        return Motions([self]).evans(np.zeros(len(sigma), np.int64), sigma, rough)


class Motions:
    """Small motions about several equilibria.

    Parameters
    ----------
    each : sequence of Motion
    pool : Executor, optional
        For threads.
    """

    def __init__(self, each: Sequence[Motion], pool: Executor | None = None):
        self.each, self.pool = each, pool
        alone = len(each) == 1
        self.steps = np.array([len(motion.sizes) for motion in each])
        self.first = np.cumsum(self.steps) - self.steps
        self.series = each[0].series if alone else np.concatenate([motion.series for motion in each])
        self.sizes = each[0].sizes if alone else np.concatenate([motion.sizes for motion in each])
        self.starts, self.fish = (np.stack([getattr(motion, name) for motion in each]) for name in ("start", "fish"))
        self.drag = np.array([motion.drag for motion in each])

    def evans(self, shape: Integers, sigma: Complex, rough: bool = False) -> tuple[Complex, Array]:
        """D(sigma) of each point's shape.

        Parameters
        ----------
        shape : ndarray of int, shape (points,)
            Which of the motions; four of one next to each other take as long as two apart.
        sigma, rough
            As of `Motion.evans`.

        Returns
        -------
        values : ndarray of complex, shape (points,)
        logs : ndarray, shape (points,)
        """
        from towatlas.kernels.calls import MOTION_TERMS, evans

        sigma = np.ascontiguousarray(sigma, np.complex128)
        values, logs = np.empty(len(sigma), np.complex128), np.empty(len(sigma))
        terms, every, small = (ROUGH_TERMS, ROUGH_EVERY, ROUGH_SMALL) if rough else (MOTION_TERMS, 1, SMALL)
        of_shapes = self.series, self.sizes, self.first, self.steps, self.starts, self.fish, self.drag

        def some(part: slice) -> None:
            evans(*of_shapes, terms, every, small, shape, sigma, values, logs, part.start, part.stop)

        work = self.steps[shape].astype(float)
        most = STEPS_A_CALL if self.pool is None else min(STEPS_A_CALL, max(work.sum() / PARTS, STEPS_A_PART))
        parts = list(batches(work, most))
        if self.pool is None:
            for part in parts:
                check_patience("growth rates", REMEDY)
                some(part)
        else:
            check_patience("growth rates", REMEDY)
            list(self.pool.map(some, parts))
        return values, logs


def motions(
    r_f: Array,
    gamma: Array,
    systems: Array,
    reach: float | Array,
    bound: float = BOUND,
    pool: Executor | None = None,
) -> list[Motion]:
    """Small motions about equilibria.

    Parameters
    ----------
    r_f : ndarray, shape (shapes,)
        Distance of the fish from the axis over tow radius [-], > 0.
    gamma : ndarray, shape (shapes,)
        Speed [-].
    systems : ndarray, shape (shapes, columns)
        As of `System.row`.
    reach : float or ndarray, shape (shapes,)
        |sigma| for which they are wanted, in units of Omega, > 0.
    bound : float
        Logarithm of what solutions for such a sigma may grow by in a step, > 0.
    pool : Executor, optional
        For threads.

    Returns
    -------
    list of Motion
    """
    systems = systems.copy()
    upright(systems, gamma)
    reaches = np.full(len(r_f), reach, float) if np.ndim(reach) == 0 else np.asarray(reach, float)
    parts = [slice(begin, begin + TOGETHER) for begin in range(0, len(r_f), TOGETHER)]

    def some(part: slice) -> list[Motion]:
        return _side_by_side(r_f[part], gamma[part], systems[part], reaches[part], bound)

    found = map(some, parts) if pool is None else pool.map(some, parts)
    return [motion for part in found for motion in part]


def _side_by_side(r_f: Array, gamma: Array, systems: Array, reach: Array, bound: float) -> list[Motion]:
    from towatlas.kernels.calls import MOTION_ROWS, MOTION_TERMS, Algebra, Shots, expand_shapes

    rows, gamma2 = len(r_f), np.square(gamma)
    algebra = Algebra(*jets_of(0).algebra)
    shots = Shots(r_f * gamma2, gamma2, systems, np.zeros_like(systems), np.ones(rows))
    room = ROOM
    while True:
        series, sizes = np.empty((rows, room, MOTION_TERMS, MOTION_ROWS)), np.empty((rows, room))
        starts, steps, codes = np.empty((rows, 3)), np.empty(rows, np.int64), np.empty(rows, np.int64)
        expand_shapes(shots, algebra, reach, bound, series, sizes, starts, steps, codes, 0, rows)
        room *= 8
        if room > MOST_ROOM or not (codes == status.STEP_LIMIT).any():
            break
    found = []
    for i in range(rows):
        system, count = systems[i], steps[i]
        fish = np.array([gamma2[i] * system[M_F], system[C_F] * shots.r[i]])
        drag = bool(system[C] or system[C_T] or system[C_S])
        part = series[i, :count].copy(), sizes[i, :count].copy(), starts[i].copy()
        found.append(Motion(*part, fish, drag, float(reach[i]), int(codes[i])))
    return found
