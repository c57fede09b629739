"""Shots that a search looks around with: as good as the search needs, in a fraction of the time of exact ones."""

from dataclasses import dataclass

import numpy as np

from towatlas.effort import check_patience, count_steps, limited
from towatlas.kernels import status
from towatlas.solve.jets import jets_of
from towatlas.solve.shots import LEAST_BATCH, REMEDY, Array, Ends, Integers, shoot, upright

SLOPE = jets_of(1)
# Errors of the steps, in units of rounding.
LOOSE = 1e4
# Shots of more steps are made otherwise if they take more than so many for each radian about the axis.
LONG, STEPS_A_RADIAN = 600, 10.0
# Of stiff shots: the error of a step over the state, and steps; a step costs as much as so many Taylor steps.
TOLERANCE, STIFF_STEPS, DEARER = 1e-5, 10_000, 2


@dataclass(frozen=True)
class Looks:
    """Tow points of shots, lengths over tow radius.

    Attributes
    ----------
    X, Y, log_rho : ndarray, shape (shots, 2)
        As of `towatlas.solve.shots.Ends`, with derivatives by log r.
    angle : ndarray, shape (shots,)
        Of the tow point about the axis, from that of the fish, carried along the cable [rad], >= 0.
    steps : ndarray of int, shape (shots,)
        Taylor steps that take as long.
    status : ndarray of int, shape (shots,)
        Codes of `towatlas.kernels.status`.
    rough : ndarray of bool, shape (shots,)
        Whether X, Y, log_rho have errors of about 1e-4; else below 1e-10.
    """

    X: Array
    Y: Array
    log_rho: Array
    angle: Array
    steps: Integers
    status: Integers
    rough: Array


def look(r: Array, gamma: Array, systems: Array, *, rough: bool = True) -> Looks:
    """Shots from the fish to the tow point, with derivatives by log r.

    Parameters
    ----------
    r : ndarray, shape (shots,)
        Radius of the fish in g / Omega^2, > 0.
    gamma : ndarray, shape (shots,)
        Speed [-]; a turn to port where negative.
    systems : ndarray, shape (shots, columns)
        As of `System.row`.
    rough : bool
        Whether shots may be rough where the others would be long.

    Returns
    -------
    Looks
    """
    scale = np.square(gamma)[:, None]
    ends = shoot(r, gamma, systems, SLOPE, looseness=LOOSE, max_steps=LONG if rough else None)
    found = Looks(
        ends.X / scale, ends.Y / scale, ends.log_rho, ends.angle, ends.steps, ends.status, np.zeros(len(r), bool)
    )
    long = np.flatnonzero(ends.status == status.STEP_LIMIT) if rough else np.empty(0, np.int64)
    if not len(long):
        return found
    stiff = long[ends.steps[long] > STEPS_A_RADIAN * (1.0 + ends.angle[long])]
    if len(stiff):
        _put(found, stiff, look_stiffly(r[stiff], gamma[stiff], systems[stiff]))
    left = long[found.status[long] != status.OK]
    if len(left):
        _put(found, left, look(r[left], gamma[left], systems[left], rough=False))
    return found


def _put(found: Looks, rows: Integers, other: Looks) -> None:
    for name in Looks.__annotations__:
        getattr(found, name)[rows] = getattr(other, name)


def look_stiffly(r: Array, gamma: Array, systems: Array) -> Looks:
    """Rough shots, with steps that drag does not hold short, however strong it is.

    Parameters
    ----------
    r, gamma, systems : ndarray
        As of `look`; systems with normal drag.

    Returns
    -------
    Looks
    """
    from towatlas.kernels.calls import TINY, Marched
    from towatlas.kernels.sweeps import shoot_stiff_threads

    systems, gamma = systems.copy(), gamma.copy()
    _, port = upright(systems, gamma)
    gamma = np.abs(gamma)
    rows, scale = len(r), np.square(gamma)
    # The bit of a bare tip that a shot begins with is nothing here.
    ends: Ends = shoot(r, gamma, systems, SLOPE, shares=0.0)
    states = np.stack([q[:, 0] + TINY * 1j * q[:, 1] for q in (ends.X, ends.Y, ends.FX, ends.FY, ends.FZ)], axis=1)
    steps, codes, angle = np.zeros(rows, np.int64), ends.status.copy(), ends.angle.copy()
    marched = Marched(states, np.zeros(rows), scale, angle, steps, codes)
    batch = LEAST_BATCH if limited() else rows
    for begin in range(0, rows, batch):
        check_patience("shots with drag", REMEDY)
        shoot_stiff_threads(marched, systems, TOLERANCE, STIFF_STEPS, begin, min(rows, begin + batch))
    count_steps(DEARER * float(steps.sum()))
    states[port, 1] *= -1.0
    x, y = states[:, 0], states[:, 1]
    rho2 = x.real**2 + y.real**2
    along = (x.real * x.imag + y.real * y.imag) / TINY / rho2
    return Looks(
        np.stack([x.real, x.imag / TINY], axis=1) / scale[:, None],
        np.stack([y.real, y.imag / TINY], axis=1) / scale[:, None],
        np.stack([0.5 * np.log(rho2) - np.log(scale), along], axis=1),
        angle,
        DEARER * steps,
        codes,
        np.ones(rows, bool),
    )
