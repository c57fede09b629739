"""Local interpolation on a grid: Lagrange polynomials through the nodes about a cell. Needs numpy only."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# Points interpolated together: what they gather stays in the cache.
BLOCK = 2048


def middles(nodes: Array) -> Array:
    """The middle of each cell of an axis.

    Parameters
    ----------
    nodes : ndarray, shape (nodes,)

    Returns
    -------
    ndarray, shape (nodes - 1,)
    """
    return 0.5 * (nodes[1:] + nodes[:-1])


def windows(cells: Integers, nodes: int, width: int) -> Integers:
    """First of the nodes about each cell: as many on either side, or the outermost at the ends of the axis.

    Parameters
    ----------
    cells : ndarray of int, shape (cells,)
    nodes : int
        Of the axis.
    width : int
        How many about a cell, even.

    Returns
    -------
    ndarray of int, shape (cells,)
    """
    return np.clip(cells - (width // 2 - 1), 0, nodes - width)


def weights(x: Array, nodes: Array, first: Integers, width: int) -> Array:
    """Lagrange weights of nodes first..first+width-1.

    Parameters
    ----------
    x : ndarray, shape (points,)
    nodes : ndarray, shape (nodes,)
    first : ndarray of int, shape (points,)
        From `windows`.
    width : int

    Returns
    -------
    ndarray, shape (points, width)
    """
    about = nodes[first[:, None] + np.arange(width)]
    result = np.ones((len(x), width))
    for k in range(width):
        for other in range(width):
            if other != k:
                result[:, k] *= (x - about[:, other]) / (about[:, k] - about[:, other])
    return result


def at_middles(values: Array, axes: tuple[Array, ...], width: int) -> Array:
    """What `interpolate` finds in the middles of all cells, one axis after the other.

    Parameters
    ----------
    values : ndarray, shape (len(axes[0]), len(axes[1]), len(axes[2]))
    axes : tuple of three ndarray
        Coordinates of the nodes, rising.
    width : int
        Nodes used on each axis, even.

    Returns
    -------
    ndarray, one less along each axis
    """
    for axis, nodes in enumerate(axes):
        first = windows(np.arange(len(nodes) - 1), len(nodes), width)
        shares = weights(middles(nodes), nodes, first, width)
        shares = shares.T.reshape(width, *(-1 if other == axis else 1 for other in range(len(axes))))
        values = sum(share * np.take(values, first + k, axis=axis) for k, share in enumerate(shares))
    return values


def interpolate(
    values: tuple[Array, ...], axes: tuple[Array, ...], cells: tuple[Integers, ...], x: tuple[Array, ...], width: int
) -> list[Array]:
    """Each of `values`, arrays over a grid of three axes, at points x in the cells given.

    Parameters
    ----------
    values : tuple of ndarray, shape (len(axes[0]), len(axes[1]), len(axes[2]))
    axes : tuple of three ndarray
        Coordinates of the nodes, rising.
    cells : tuple of three ndarray of int, shape (points,)
        Index of the node before each point; results are polynomials of degree width - 1 on each axis.
    x : tuple of three ndarray, shape (points,)
    width : int
        Nodes used on each axis, even.

    Returns
    -------
    list of ndarray, shape (points,)
    """
    results = [np.empty(len(x[0])) for _ in values]
    steps = np.arange(width)
    for begin in range(0, len(x[0]), BLOCK):
        part = slice(begin, begin + BLOCK)
        first = [windows(cell[part], len(nodes), width) for cell, nodes in zip(cells, axes, strict=True)]
        shares = [weights(at[part], nodes, f, width) for at, nodes, f in zip(x, axes, first, strict=True)]
        stencil = np.ix_(*(steps,) * 3)
        near = tuple(f[:, None, None, None] + step for f, step in zip(first, stencil, strict=True))
        for result, value in zip(results, values, strict=True):
            result[part] = np.einsum("pijk,pi,pj,pk->p", value[near], *shares, optimize=False)
    return results
