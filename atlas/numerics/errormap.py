"""From the errors measured of a table to those it states, by one rule.

What is measured is the difference from an independent solution at points between the nodes. Such points are few: the
error of a block may peak elsewhere in it, or be small at its points by chance. So the error stated of a block is SAFETY
times the largest measured in it and in its neighbours, and the rounding of what is tabulated.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Measured: with 5, 13 of 400 000 random points of the table of fish positions lie beyond what is stated of them.
SAFETY = 5.0


def block_of(coordinate: Array, blocks: int) -> NDArray[np.int64]:
    """Which of equal blocks of [-1, 1] coordinates lie in.

    Parameters
    ----------
    coordinate : ndarray, shape (...)
        -1 to 1.
    blocks : int
        How many, >= 1.

    Returns
    -------
    ndarray of int, shape (...)
    """
    return np.minimum((0.5 * (coordinate + 1.0) * blocks).astype(np.int64), blocks - 1)


def worst_of_blocks(measured: Array, y: Array, x: Array, blocks: int) -> Array:
    """Largest error measured in each block.

    Parameters
    ----------
    measured : ndarray
        Errors, >= 0.
    y, x : ndarray
        Coordinates of the points, -1 to 1; all three broadcast.
    blocks : int
        Along each axis.

    Returns
    -------
    ndarray, shape (blocks, blocks)
        y first; 0 where nothing was measured.
    """
    worst = np.zeros((blocks, blocks))
    np.maximum.at(worst, (block_of(y, blocks), block_of(x, blocks)), measured)
    return worst


def with_neighbours(values: Array) -> Array:
    """Largest value of each block and those around it, along all axes.

    Parameters
    ----------
    values : ndarray

    Returns
    -------
    ndarray
        Of the same shape.
    """
    for axis in range(values.ndim):
        moved = np.moveaxis(values, axis, 0)
        padded = np.concatenate([moved[:1], moved, moved[-1:]])
        values = np.moveaxis(np.max([padded[:-2], moved, padded[2:]], axis=0), 0, axis)
    return values


def stated_error(measured: Array, rounding: float = 0.0) -> Array:
    """Relative error stated of each block.

    Parameters
    ----------
    measured : ndarray
        The largest measured in each, >= 0.
    rounding : float
        Of what is tabulated.

    Returns
    -------
    ndarray
        Of the same shape: SAFETY times the largest in a block and its neighbours, and the rounding.
    """
    return SAFETY * with_neighbours(measured) + rounding
