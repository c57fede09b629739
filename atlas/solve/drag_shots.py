"""Shots with drag for the user's side: arrays made, results by name."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.kernels.system import COLUMNS
from towatlas.solve.jets import Jets, jets_of
from towatlas.system import System

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

MAX_STEPS = 10**5


@dataclass(frozen=True)
class Ends:
    """Tow points of shots, jets all, in axes in which the fish is at (r, 0); lengths over g / Omega^2.

    Attributes
    ----------
    X, Y : ndarray, shape (shots, monomials)
        Position.
    H : ndarray, shape (shots, monomials)
        Height above the fish.
    FX, FY, FZ : ndarray, shape (shots, monomials)
        Force of the cable, pointing down it.
    T : ndarray, shape (shots, monomials)
        Tension.
    log_rho : ndarray, shape (shots, monomials)
        log(sqrt(X^2 + Y^2) / gamma^2), zero at an equilibrium.
    steps : ndarray of int, shape (shots,)
        Taylor steps taken.
    status : ndarray of int, shape (shots,)
        Codes of `towatlas.kernels.status`.
    """

    X: Array
    Y: Array
    H: Array
    FX: Array
    FY: Array
    FZ: Array
    T: Array
    log_rho: Array
    steps: Integers
    status: Integers


def shoot(r: ArrayLike, gamma: ArrayLike, systems: Array, jets: Jets, parallel: bool = False) -> Ends:
    """Shots from the fish to the tow point.

    Parameters
    ----------
    r : array_like, shape (shots,)
        Radius of the fish in g / Omega^2, > 0.
    gamma : array_like, shape (shots,) or ()
        Speed [-], > 0.
    systems : ndarray, shape (shots, columns) or (columns,)
        As of `System.row`.
    jets : Jets
        Which derivatives come with the results.
    parallel : bool
        On all threads; the results are the same bits.

    Returns
    -------
    Ends
    """
    from towatlas.kernels.drag import RESULT_ROWS, STATE, Algebra, Reached, Shots, shoot_drag

    r = np.array(r, float, ndmin=1)
    rows = len(r)
    gamma2 = np.empty(rows)
    gamma2[:] = np.square(gamma)
    table = np.empty((rows, len(COLUMNS)))
    table[:] = systems
    shots = Shots(r, gamma2, table, np.ones(rows))
    algebra = Algebra(jets.products, jets.places, jets.degree)
    reached = Reached(np.empty((rows, RESULT_ROWS, len(jets))), np.empty(rows, np.int64), np.empty(rows, np.int64))
    if parallel:
        from towatlas.kernels.sweeps import shoot_drag_parallel

        shoot_drag_parallel(*shots, *algebra, MAX_STEPS, *reached)
    else:
        shoot_drag(shots, algebra, MAX_STEPS, np.empty((0, STATE - 1)), reached, 0, rows)
    return Ends(*np.moveaxis(reached.state, 1, 0), steps=reached.steps, status=reached.statuses)  # type: ignore[misc]


def trace(r: float, gamma: float, system: System, arc: Array) -> tuple[Array, Array, Integers]:
    """One shot along its cable.

    Parameters
    ----------
    r : float
        Radius of the fish in g / Omega^2, > 0.
    gamma : float
        Speed [-], > 0.
    system : System
    arc : ndarray, shape (points,)
        Arc lengths from the fish over that of the cable, 0 to 1.

    Returns
    -------
    ndarray, shape (steps, 7)
        u, X, Y, H, FX, FY, FZ at the end of each step.
    ndarray, shape (points, 8)
        The same, without u, at the arc lengths asked for, with T and log_rho.
    ndarray of int, shape (points + 1,)
        Statuses of the points and of the whole.
    """
    from towatlas.kernels.drag import RESULT_ROWS, STATE, Algebra, Reached, Shots, shoot_drag

    jets = jets_of(0)
    shares = np.append(arc, 1.0)
    rows = len(shares)
    shots = Shots(np.full(rows, r), np.full(rows, gamma * gamma), np.tile(system.row(), (rows, 1)), shares)
    algebra = Algebra(jets.products, jets.places, jets.degree)
    reached = Reached(np.empty((rows, RESULT_ROWS, 1)), np.empty(rows, np.int64), np.empty(rows, np.int64))
    made = np.empty((0, STATE - 1))
    for _ in range(2):
        shoot_drag(shots, algebra, MAX_STEPS, made, reached, 0, rows)
        if reached.steps[-1] == len(made):
            break
        made = np.empty((reached.steps[-1], STATE - 1))
    return made, reached.state[:-1, :, 0], reached.statuses
