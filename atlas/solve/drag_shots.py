"""Shots with drag for the user's side: systems as rows, results by name."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.solve.jets import Jets, jets_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

MAX_STEPS = 10**5


@dataclass(frozen=True)
class System:
    """A cable, its fish and the medium, all dimensionless as in NRL Report 7048."""

    lam: float
    w_f: float
    m_f: float
    C: float = 0.0
    C_f: float = 0.0
    w: float = 1.0
    C_t: float = 0.0

    @property
    def in_vacuum(self) -> bool:
        """Whether this is the report's vacuum: no drag, and weights that are masses."""
        return (self.C, self.C_f, self.C_t, self.w, self.m_f) == (0.0, 0.0, 0.0, 1.0, self.w_f)

    def row(self) -> Array:
        """The system as the kernels take it."""
        return np.array([self.lam, self.w_f, self.m_f, self.C, self.C_f, self.w, self.C_t])


@dataclass(frozen=True)
class Ends:
    """Tow points of shots, jets all: arrays of shape (shots, monomials), lengths over g / Omega^2.

    X, Y : in axes in which the fish is at (r, 0). H : height above the fish. FX, FY, FZ : force of the cable, pointing
    down it. T : tension. log_rho : log(sqrt(X^2 + Y^2) / gamma^2), zero at an equilibrium. steps, status : (shots,).
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
    """Shots from fish at radius `r` in g / Omega^2; arrays of shape (shots,), systems (shots, 7) or (7,)."""
    from towatlas.kernels.drag import RESULT_ROWS, STATE, shoot_drag

    r = np.array(r, float, ndmin=1)
    rows = len(r)
    gamma2 = np.empty(rows)
    gamma2[:] = np.square(gamma)
    table = np.empty((rows, 7))
    table[:] = systems
    results = np.empty((rows, RESULT_ROWS, len(jets)))
    steps, codes = np.empty(rows, np.int64), np.empty(rows, np.int64)
    arguments = (r, gamma2, table, np.ones(rows), jets.products, jets.places, jets.degree, MAX_STEPS)
    if parallel:
        from towatlas.kernels.sweeps import shoot_drag_parallel

        shoot_drag_parallel(*arguments, results, steps, codes)
    else:
        shoot_drag(*arguments, np.empty((0, STATE - 1)), results, steps, codes, 0, rows)
    return Ends(*np.moveaxis(results, 1, 0), steps=steps, status=codes)  # type: ignore[misc]


def trace(r: float, gamma: float, system: System, arc: Array) -> tuple[Array, Array, Integers]:
    """One shot along its cable.

    Parameters
    ----------
    r : float
        Radius of the fish in g / Omega^2.
    arc : ndarray, shape (points,)
        Arc lengths from the fish over that of the cable, 0 to 1.

    Returns
    -------
    ndarray, shape (steps, 7)
        u, X, Y, H, FX, FY, FZ at the end of each step.
    ndarray, shape (points, 8)
        The same, without u, at the arc lengths asked for, with T and log_rho.
    ndarray, shape (points + 1,)
        Statuses of the points and of the whole.
    """
    from towatlas.kernels.drag import RESULT_ROWS, STATE, shoot_drag

    jets = jets_of(0)
    shares = np.append(arc, 1.0)
    rows = len(shares)
    results, steps, codes = np.empty((rows, RESULT_ROWS, 1)), np.empty(rows, np.int64), np.empty(rows, np.int64)
    cables = np.full(rows, r), np.full(rows, gamma * gamma), np.tile(system.row(), (rows, 1))
    made = np.empty((0, STATE - 1))
    for _ in range(2):
        arguments = (*cables, shares, jets.products, jets.places, 0, MAX_STEPS, made, results, steps, codes)
        shoot_drag(*arguments, 0, rows)
        if steps[-1] == len(made):
            break
        made = np.empty((steps[-1], STATE - 1))
    return made, results[:-1, :, 0], codes
