"""Small motions about equilibria: coefficients along shapes, and the Evans function of their growth rates."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience
from towatlas.kernels import status
from towatlas.kernels.system import C_F, C_S, C_T, M_F, C
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
REMEDY = "a shorter cable, a lower speed or less drag needs fewer steps"
# Shapes side by side.
TOGETHER = 8


@dataclass(frozen=True)
class Motion:
    """Small motion about one equilibrium. Lengths over g / Omega^2, times over 1 / Omega, as in `kernels.variation`.

    Attributes
    ----------
    series : ndarray, shape (steps, rows, terms)
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

    def evans(self, sigma: Complex) -> tuple[Complex, Array]:
        """D(sigma), zero at the growth rates.

        Parameters
        ----------
        sigma : ndarray of complex, shape (points,)
            In units of Omega.

        Returns
        -------
        values : ndarray of complex, shape (points,)
        logs : ndarray, shape (points,)
            D is values times exp(logs).
        """
        from towatlas.kernels.variation import evans

        sigma = np.ascontiguousarray(sigma, np.complex128)
        values, logs = np.empty(len(sigma), np.complex128), np.empty(len(sigma))
        steps = len(self.sizes)
        each = max(2, STEPS_A_CALL // steps)
        for begin in range(0, len(sigma), each):
            check_patience("growth rates", REMEDY)
            some = slice(begin, begin + each)
            evans(
                self.series, self.sizes, self.start, steps, self.fish, self.drag, sigma[some], values[some], logs[some]
            )
        return values, logs


def motions(r_f: Array, gamma: Array, systems: Array, reach: float, bound: float = BOUND) -> list[Motion]:
    """Small motions about equilibria.

    Parameters
    ----------
    r_f : ndarray, shape (shapes,)
        Distance of the fish from the axis over tow radius [-], > 0.
    gamma : ndarray, shape (shapes,)
        Speed [-].
    systems : ndarray, shape (shapes, columns)
        As of `System.row`.
    reach : float
        |sigma| for which they are wanted, in units of Omega, > 0.
    bound : float
        Logarithm of what solutions for such a sigma may grow by in a step, > 0.

    Returns
    -------
    list of Motion
    """
    from towatlas.kernels.drag_shots import Algebra, Shots
    from towatlas.kernels.variation import ROWS, TERMS, expand_shapes

    found: list[Motion] = []
    systems = systems.copy()
    upright(systems, gamma)
    gamma2 = np.square(gamma)
    algebra = Algebra(*jets_of(0).algebra)
    for begin in range(0, len(r_f), TOGETHER):
        some = slice(begin, begin + TOGETHER)
        rows = len(r_f[some])
        shots = Shots(
            r_f[some] * gamma2[some], gamma2[some], systems[some], np.zeros_like(systems[some]), np.ones(rows)
        )
        room = ROOM
        while True:
            series, sizes = np.empty((rows, room, ROWS, TERMS)), np.empty((rows, room))
            starts, steps, codes = np.empty((rows, 3)), np.empty(rows, np.int64), np.empty(rows, np.int64)
            expand_shapes(shots, algebra, reach, bound, series, sizes, starts, steps, codes, 0, rows)
            room *= 8
            if room > MOST_ROOM or not (codes == status.STEP_LIMIT).any():
                break
        for i in range(rows):
            system, count = shots.systems[i], steps[i]
            fish = np.array([shots.gamma2[i] * system[M_F], system[C_F] * shots.r[i]])
            drag = bool(system[C] or system[C_T] or system[C_S])
            part = series[i, :count].copy(), sizes[i, :count].copy(), starts[i].copy()
            found.append(Motion(*part, fish, drag, reach, int(codes[i])))
    return found
