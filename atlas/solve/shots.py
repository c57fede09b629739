"""Shots with drag for the user's side: arrays made, mirrors undone, results by name."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.effort import check_patience, count_steps, limited, scaled
from towatlas.kernels.system import C_S, COLUMNS, W_F, W
from towatlas.solve.jets import Jets

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

# Of a shot: with the usual patience, and with any. More are taken by cables that all but float, bare at their end, in
# drag so strong that they trail along their circle.
STEPS, MOST_STEPS = 5 * 10**5, 10**7
# Shots between two looks at the clock: at most, first and at least; about so many steps of them, some seconds. Where
# nobody looks, so many, for at the end of each batch the longest shot leaves the other lanes idle.
BATCH, FIRST_BATCH, LEAST_BATCH, STEPS_A_BATCH, UNWATCHED = 128, 32, 16, 4 * 10**6, 8192
REMEDY = "a shorter cable, a lower speed or less drag makes shots shorter"


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
    angle : ndarray, shape (shots,)
        Of the tow point about the axis, from that of the fish, carried along the cable [rad], >= 0.
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
    angle: Array
    steps: Integers
    status: Integers


def shoot(
    r: ArrayLike,
    gamma: ArrayLike,
    systems: Array,
    jets: Jets,
    *,
    directions: Array | None = None,
    shares: ArrayLike = 1.0,
    looseness: float = 1.0,
    max_steps: int | None = None,
) -> Ends:
    """Shots from the fish to the tow point.

    Parameters
    ----------
    r : array_like, shape (shots,)
        Radius of the fish in g / Omega^2, > 0.
    gamma : array_like, shape (shots,) or ()
        Speed [-]; a turn to port where negative.
    systems : ndarray, shape (shots, columns) or (columns,)
        As of `System.row`.
    jets : Jets
        Which derivatives come with the results; those by the speed are by log |gamma|.
    directions : ndarray, shape (shots, columns) or (columns,), optional
        How systems move with the parameter among the unknowns.
    shares : array_like, shape (shots,) or ()
        The part of the cable to shoot over, 0 to 1.
    looseness : float
        How much larger than rounding the error of a step may be, >= 1.
    max_steps : int, optional
        Of a shot, as far as patience goes by default.

    Returns
    -------
    Ends

    Notes
    -----
    Computed with the weights upright and the turn to starboard: what has w < 0, or w = 0 and w_f < 0, hangs upwards as
    its mirror image in z hangs down, and a turn to port is one to starboard seen in a mirror. The side force changes
    its sign in both.
    """
    from towatlas.kernels.calls import RESULT_ROWS, TRUNCATION, Algebra, Reached, Shots
    from towatlas.kernels.sweeps import shoot_drag_threads

    r = np.array(r, float, ndmin=1)
    rows = len(r)
    speed, part = np.empty(rows), np.empty(rows)
    speed[:], part[:] = gamma, shares
    table, moved = np.empty((rows, len(COLUMNS))), np.zeros((rows, len(COLUMNS)))
    table[:] = systems
    if directions is not None:
        moved[:] = directions
    upward, port = upright(table, speed, moved)
    state, steps = np.empty((rows, RESULT_ROWS, len(jets))), np.empty(rows, np.int64)
    turns, codes = np.empty((rows, 2), np.int64), np.empty(rows, np.int64)
    shots, algebra = Shots(r, np.square(speed), table, moved, part), Algebra(*jets.algebra)
    reached = Reached(state, steps, turns, codes)
    if max_steps is None:
        max_steps = scaled(STEPS, MOST_STEPS)
    begin, batch = 0, FIRST_BATCH if limited() else UNWATCHED
    while begin < rows:
        check_patience("shots with drag", REMEDY)
        stop = min(rows, begin + batch)
        shoot_drag_threads(shots, algebra, TRUNCATION * looseness, max_steps, reached, begin, stop)
        if limited():
            batch = int(np.clip(STEPS_A_BATCH / max(1.0, steps[begin:stop].mean()), LEAST_BATCH, BATCH))
        begin = stop
    count_steps(float(steps.sum()))
    x, y = state[:, 0, 0], state[:, 1, 0]
    # Where no drag takes the cable out of its plane the angle grows by half a turn at every crossing of the axis.
    angle = np.where(y == 0.0, np.pi * turns[:, 1], np.arctan2(y, x) + 2.0 * np.pi * turns[:, 0])
    state[port, 1] *= -1.0
    state[port, 4] *= -1.0
    state[upward, 2] *= -1.0
    state[upward, 5] *= -1.0
    return Ends(*np.moveaxis(state, 1, 0), angle=angle, steps=steps, status=codes)  # type: ignore[misc]


def upright(systems: Array, gamma: Array, *others: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Mirror systems, in place, so that they hang down and turn to starboard.

    Parameters
    ----------
    systems : ndarray, shape (shots, columns)
        As of `System.row`.
    gamma : ndarray, shape (shots,)
        Speed [-].
    *others : ndarray, shape (shots, columns)
        What is mirrored with them.

    Returns
    -------
    upward, port : ndarray of bool, shape (shots,)
        What was mirrored in z, and what in y.
    """
    upward = (systems[:, W] < 0.0) | ((systems[:, W] == 0.0) & (systems[:, W_F] < 0.0))
    port = gamma < 0.0
    for rows_of in (systems, *others):
        rows_of[upward, W] *= -1.0
        rows_of[upward, W_F] *= -1.0
        rows_of[upward != port, C_S] *= -1.0
    return upward, port


def direction_of(names: Sequence[str], systems: Array) -> Array:
    """How systems move with the logarithm of some of their numbers, all by one factor.

    Parameters
    ----------
    names : sequence of str
        Of `towatlas.kernels.system.COLUMNS`.
    systems : ndarray, shape (..., columns)

    Returns
    -------
    ndarray, shape (..., columns)
    """
    chosen = np.array([name in names for name in COLUMNS])
    return np.where(chosen, systems, 0.0)
