"""What is not known of growth rates because the place of the fish is known to rounding only.

Where a long cable turns many times, or all but meets the axis, they may move a million times as far as the fish does.
"""

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from towatlas.effort import to_the_end
from towatlas.kernels import status
from towatlas.solve.motion import Array, Complex, Motion, Motions, motions

# Step of sigma over 1 + |sigma|; what a step of a shot rounds counts as so much of r_f.
STEP, ROUNDED = 1e-4, 2.0 * 2.0**-52


def with_fish_moved(
    bodies: Sequence[Motion], r_f: Array, gamma: Array, systems: Array, relative: Array, pool: Executor | None = None
) -> list[Motion]:
    """Small motions about shapes, had their fish been a little farther out.

    Parameters
    ----------
    bodies : sequence of Motion, shape (shapes,)
        About the shapes.
    r_f, gamma, systems, pool
        As of `towatlas.solve.motion.motions`.
    relative : ndarray, shape (shapes,)
        Errors of r_f over r_f [-], > 0.

    Returns
    -------
    list of Motion
        For `errors_with_fish`.
    """
    reach = np.array([body.reach for body in bodies])
    rounded = ROUNDED * np.sqrt([len(body.sizes) for body in bodies])
    # No farther, though D is known to rounding only: some shapes are another's within a part in 1e10.
    return motions(r_f * (1.0 + relative + rounded), gamma, systems, reach, pool=pool)


def errors_with_fish(
    bodies: Sequence[Motion],
    moved: Sequence[Motion],
    sigma: Complex,
    relative: Array,
    pool: Executor | None = None,
) -> Array:
    """How far growth rates move as the fish does by its error.

    Parameters
    ----------
    bodies, moved : sequence of Motion, shape (shapes,)
        About the shapes, and by `with_fish_moved`.
    sigma : ndarray of complex, shape (shapes,)
        A growth rate of each, in units of Omega.
    relative : ndarray, shape (shapes,)
        Errors of r_f over r_f [-], > 0.
    pool : Executor, optional
        For threads.

    Returns
    -------
    ndarray, shape (shapes,)
        In units of Omega: by what D changes by with r_f and with sigma, to second order where two zeros are close; at
        least that of r_f, which is what a shot rounds on its way. inf where there is no motion with the fish moved.
    """
    count = len(sigma)
    step = STEP * (1.0 + np.abs(sigma))
    owner = np.repeat(np.arange(2 * count), np.repeat([3, 1], count))
    points = np.concatenate([np.stack([sigma, sigma - step, sigma + step], axis=1).ravel(), sigma])
    with to_the_end():
        values, logs = Motions([*bodies, *moved], pool).evans(owner, points)
    largest = np.maximum(logs[: 3 * count].reshape(count, 3).max(axis=1), logs[3 * count :])
    values = values * np.exp(logs - largest[owner % count])
    at, below, above = values[: 3 * count].reshape(count, 3).T
    change = np.abs(values[3 * count :] - at)
    slope, curve = np.abs(above - below) / (2.0 * step), np.abs(above - 2.0 * at + below) / step**2
    with np.errstate(divide="ignore", invalid="ignore"):
        errors = np.fmin(change / slope, np.sqrt(2.0 * change / curve))
    sound = np.array([motion.status == status.OK for motion in moved])
    return np.where(sound & np.isfinite(errors), np.maximum(errors, relative), np.inf)
