"""Chebyshev series: through values on their nodes, and their sums at points and on grids."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def nodes(count: int) -> Array:
    """Chebyshev points of the second kind on [-1, 1], both ends included, in rising order.

    Parameters
    ----------
    count : int
        >= 2.

    Returns
    -------
    ndarray, shape (count,)

    Examples
    --------
    >>> nodes(3).tolist()
    [-1.0, 0.0, 1.0]
    """
    return np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, count))


def midpoints(count: int) -> Array:
    """The points half way (in angle) between nodes: where the interpolation error peaks.

    Parameters
    ----------
    count : int
        Number of nodes, >= 2.

    Returns
    -------
    ndarray, shape (count - 1,)
    """
    angles = np.linspace(-1.0, 1.0, count)
    return np.sin(0.25 * np.pi * (angles[1:] + angles[:-1]))


def polynomials(x: Array, count: int) -> Array:
    """Chebyshev polynomials T_0..T_{count-1}.

    Parameters
    ----------
    x : ndarray, shape (points,)
        -1 to 1.
    count : int
        >= 1.

    Returns
    -------
    ndarray, shape (count, points)
    """
    values = np.empty((count, len(x)))
    values[0] = 1.0
    if count > 1:
        values[1] = x
    twice = 2.0 * x
    for k in range(2, count):
        np.multiply(twice, values[k - 1], out=values[k])
        values[k] -= values[k - 2]
    return values


def transform(count: int) -> Array:
    """Matrix from values on `nodes(count)` to the coefficients of the Chebyshev series through them.

    Parameters
    ----------
    count : int
        >= 2.

    Returns
    -------
    ndarray, shape (count, count)
    """
    k = np.arange(count)
    table = np.cos(np.pi * np.outer(k, k[::-1]) / (count - 1)) * (2.0 / (count - 1))
    table[:, [0, -1]] *= 0.5
    table[[0, -1], :] *= 0.5
    return table


def coefficients(values: Array) -> Array:
    """Coefficients of the Chebyshev series through values on `nodes`, along both last axes.

    Parameters
    ----------
    values : ndarray, shape (..., y nodes, x nodes)

    Returns
    -------
    ndarray, shape (..., y degree, x degree)
        The same bits for any number of threads.
    """
    for axis in (-2, -1):
        table = transform(values.shape[axis])
        # einsum with optimize=False: plain sums, so that the file does not depend on the threads of a BLAS.
        values = np.einsum("ki,...ij->...kj" if axis == -2 else "kj,...ij->...ik", table, values, optimize=False)
    return values


def equal_patches(series: Array, counts: tuple[int, int], terms: int) -> Array:
    """Short series on equal parts of the unit square, from long ones.

    Parameters
    ----------
    series : ndarray, shape (..., y degree, x degree)
    counts : pair of int
        Parts along y and x, >= 1.
    terms : int
        Of a short series along each axis, >= 2.

    Returns
    -------
    ndarray, shape (..., *counts, terms, terms)
        y first. The same bits for any number of threads.
    """
    at_y, at_x = ((np.arange(count)[:, None] * 2.0 + 1.0 + nodes(terms)).ravel() / count - 1.0 for count in counts)
    along_y, along_x = (
        np.ascontiguousarray(polynomials(at, degree).T)
        for at, degree in zip((at_y, at_x), series.shape[-2:], strict=True)
    )
    values = np.einsum("pj,...ij->...pi", along_x, series, optimize=False)
    values = np.einsum("...pi,qi->...qp", values, along_y, optimize=False)
    shape = (*series.shape[:-2], counts[0], terms, counts[1], terms)
    return coefficients(values.reshape(shape).swapaxes(-3, -2))


def on_grid(series: Array, y: Array, x: Array) -> Array:
    """Sums of series on a grid.

    Parameters
    ----------
    series : ndarray, shape (n, y degree, x degree)
    y, x : ndarray
        Axes of the grid, -1 to 1.

    Returns
    -------
    ndarray, shape (n, len(y), len(x))
        The same bits for any number of threads.
    """
    along_x = np.einsum("nij,jp->nip", series, polynomials(x, series.shape[2]), optimize=False)
    return np.einsum("nip,iq->nqp", along_x, polynomials(y, series.shape[1]), optimize=False)


def at_points(series: Array, *coordinates: Array) -> Array:
    """Sum of a series at points.

    Parameters
    ----------
    series : ndarray
        An axis for each of the coordinates.
    *coordinates : ndarray, shape (points,)
        -1 to 1.

    Returns
    -------
    ndarray, shape (points,)
    """
    *others, last = coordinates
    along = np.einsum("...i,ip->...p", series, polynomials(last, series.shape[-1]), optimize=False)
    for x in reversed(others):
        along = np.einsum("...ip,ip->...p", along, polynomials(x, along.shape[-2]), optimize=False)
    return along
