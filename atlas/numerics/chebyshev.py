"""Chebyshev series: through values on their nodes, and their sums at points, on grids, and by patches."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

# Patches along each axis, and nodes of a patch along each: measured to agree with the whole series within 1e-13.
PATCHES = 16
PATCH_NODES = 20
# Points evaluated together, whose polynomials then stay in the cache; and points of one matrix product, few enough that
# BLAS does not wake its threads, whose waiting costs more than the work.
BLOCK, PRODUCT = 4096, 512

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


def _patch_edges() -> Array:
    return nodes(PATCHES + 1)


def patches(series: Array) -> Array:
    """Short series on PATCHES^2 parts of the unit square that sum to one long series, to 1e-13.

    A sum of four hundred terms instead of ten thousand: what makes lookup fast.

    Parameters
    ----------
    series : ndarray, shape (y degree, x degree)

    Returns
    -------
    ndarray, shape (PATCHES, PATCHES, PATCH_NODES, PATCH_NODES)
        y first.
    """
    edges = _patch_edges()
    at = (0.5 * (edges[1:] + edges[:-1])[:, None] + 0.5 * np.diff(edges)[:, None] * nodes(PATCH_NODES)).ravel()
    values = polynomials(at, series.shape[0]).T @ (series @ polynomials(at, series.shape[1]))
    return coefficients(values.reshape(PATCHES, PATCH_NODES, PATCHES, PATCH_NODES).swapaxes(1, 2))


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


def patch_sums(tables: Sequence[Mapping[int, Array]], n: NDArray[np.int64], x: Array, y: Array) -> list[Array]:
    """Values at points of several tables.

    Parameters
    ----------
    tables : sequence of mapping
        tables[k][n] are the `patches` of one n.
    n : ndarray of int, shape (points,)
    x, y : ndarray, shape (points,)
        -1 to 1.

    Returns
    -------
    list of ndarray, shape (points,)
        One for each table.
    """
    edges = _patch_edges()
    middle, half = 0.5 * (edges[1:] + edges[:-1]), 0.5 * np.diff(edges)
    column, row = _patch_at(x), _patch_at(y)
    # Points of one patch together: then each patch is one small matrix product.
    patch = ((n * PATCHES + row) * PATCHES + column).astype(np.uint16 if n.max() < 200 else np.int64)
    order = np.argsort(patch, kind="stable")
    patch, column, row, x, y = patch[order], column[order], row[order], x[order], y[order]
    results = [np.empty(len(x)) for _ in tables]
    for begin in range(0, len(x), BLOCK):
        block = slice(begin, begin + BLOCK)
        along_x = polynomials((x[block] - middle[column[block]]) / half[column[block]], PATCH_NODES)
        along_y = polynomials((y[block] - middle[row[block]]) / half[row[block]], PATCH_NODES)
        inside = patch[block]
        changes = (np.flatnonzero(inside[1:] != inside[:-1]) + 1).tolist()
        ends = sorted({*changes, *range(PRODUCT, len(inside), PRODUCT), len(inside)})
        for first, last in zip([0, *ends[:-1]], ends, strict=True):
            place = begin + first
            which, at = int(inside[first]) // PATCHES**2, (row[place], column[place])
            for table, result in zip(tables, results, strict=True):
                terms = table[which][at] @ along_x[:, first:last]
                terms *= along_y[:, first:last]
                result[order[place : begin + last]] = terms.sum(axis=0)
    return results


def _patch_at(x: Array) -> NDArray[np.int64]:
    """Which of the PATCHES a coordinate lies in; on an edge either will do."""
    return np.clip(((0.5 + np.arcsin(x) / np.pi) * PATCHES).astype(np.int64), 0, PATCHES - 1)


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
