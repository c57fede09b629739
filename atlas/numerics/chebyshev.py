"""Chebyshev series of the critical states in coordinates in which they are smooth to both ends of the domain.

    x = log(lambda - lambda_cn),  y = log(1 + w_f / W_SCALE)
    log(gamma sqrt(lambda - lambda_cn)),  log(-R_x0),  log|x_f|,  log z_f

gamma grows as (lambda - lambda_cn)^(-1/2) at the threshold and every quantity is a power of lambda far from it; in w_f
the states have a term w_f^2 log w_f at zero, which W_SCALE makes small. Needs numpy only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Fish weight at which y turns from linear to logarithmic: smaller, and y spans more; larger, and w_f^2 log w_f shows.
W_SCALE = 0.03
FIELDS = ("gamma", "R_x0", "x_f", "z_f")
# Patches along each axis, and nodes of a patch along each: measured to agree with the whole series within 1e-13.
PATCHES = 16
PATCH_NODES = 20
# Points evaluated together, whose polynomials then stay in the cache; and points of one matrix product, few enough that
# BLAS does not wake its threads, whose waiting costs more than the work.
BLOCK, PRODUCT = 4096, 512

Array = NDArray[np.float64]


def nodes(count: int) -> Array:
    """Chebyshev points of the second kind on [-1, 1], both ends included, in rising order."""
    return np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, count))


def midpoints(count: int) -> Array:
    """The points half way (in angle) between `nodes(count)`: where the interpolation error peaks."""
    angles = np.linspace(-1.0, 1.0, count)
    return np.sin(0.25 * np.pi * (angles[1:] + angles[:-1]))


def polynomials(x: Array, count: int) -> Array:
    """Chebyshev polynomials T_0..T_{count-1} at x, shape (count, len(x))."""
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
    """Matrix from values on `nodes(count)` to the coefficients of the Chebyshev series through them."""
    k = np.arange(count)
    table = np.cos(np.pi * np.outer(k, k[::-1]) / (count - 1)) * (2.0 / (count - 1))
    table[:, [0, -1]] *= 0.5
    table[[0, -1], :] *= 0.5
    return table


def coefficients(values: Array) -> Array:
    """Coefficients of the Chebyshev series through values on `nodes`, along both last axes."""
    for axis in (-2, -1):
        table = transform(values.shape[axis])
        # einsum with optimize=False: plain sums, so that the file does not depend on the threads of a BLAS.
        values = np.einsum("ki,...ij->...kj" if axis == -2 else "kj,...ij->...ik", table, values, optimize=False)
    return values


@dataclass(frozen=True)
class Axes:
    """The domain of a table and the map from it to the unit square [-1, 1]^2."""

    excess_min: float
    excess_max: float
    w_f_max: float

    def x(self, excess: Array) -> Array:
        """Coordinate of lambda - lambda_cn."""
        low, high = np.log(self.excess_min), np.log(self.excess_max)
        return np.clip((2.0 * np.log(excess) - low - high) / (high - low), -1.0, 1.0)

    def y(self, w_f: Array) -> Array:
        """Coordinate of w_f."""
        return np.clip(2.0 * np.log1p(w_f / W_SCALE) / np.log1p(self.w_f_max / W_SCALE) - 1.0, -1.0, 1.0)

    def excess(self, x: Array) -> Array:
        """lambda - lambda_cn at coordinate x."""
        low, high = np.log(self.excess_min), np.log(self.excess_max)
        return np.exp(0.5 * (low + high + x * (high - low)))

    def w_f(self, y: Array) -> Array:
        """w_f at coordinate y; exactly 0 at y = -1."""
        return W_SCALE * np.expm1(0.5 * (y + 1.0) * np.log1p(self.w_f_max / W_SCALE))

    def holds(self, excess: Array, w_f: Array, slack: Array) -> NDArray[np.bool_]:
        """Whether points lie in the domain; the rounding of lambda, `slack` of the excess, is let pass at its ends."""
        return (
            (excess >= self.excess_min * (1.0 - slack))
            & (excess <= self.excess_max * (1.0 + slack))
            & (w_f >= 0.0)
            & (w_f <= self.w_f_max)
        )


def to_field(name: str, value: Array, excess: Array) -> Array:
    """The smooth function that is interpolated, from a critical state."""
    return np.log(np.abs(value)) + (0.5 * np.log(excess) if name == "gamma" else 0.0)


def from_field(name: str, field: Array, excess: Array, n: NDArray[np.int64]) -> Array:
    """A critical state, from the smooth function: R_x0 is negative, x_f has the sign of (-1)^n (its nodes)."""
    value = np.exp(field)
    if name == "gamma":
        return value / np.sqrt(excess)
    if name == "R_x0":
        return -value
    if name == "x_f":
        return np.where(n % 2 == 0, value, -value)
    return value


def _patch_edges() -> Array:
    return nodes(PATCHES + 1)


def patches(series: Array) -> Array:
    """Short series on PATCHES^2 parts of the unit square that sum to one long series, to 1e-13.

    series : shape (y degree, x degree). Returns shape (PATCHES, PATCHES, PATCH_NODES, PATCH_NODES), y first. A sum of
    four hundred terms instead of ten thousand: what makes lookup fast.
    """
    edges = _patch_edges()
    at = (0.5 * (edges[1:] + edges[:-1])[:, None] + 0.5 * np.diff(edges)[:, None] * nodes(PATCH_NODES)).ravel()
    values = polynomials(at, series.shape[0]).T @ (series @ polynomials(at, series.shape[1]))
    return coefficients(values.reshape(PATCHES, PATCH_NODES, PATCHES, PATCH_NODES).swapaxes(1, 2))


def evaluate(tables: Sequence[Mapping[int, Array]], n: NDArray[np.int64], x: Array, y: Array) -> list[Array]:
    """Values at points (x, y), all of shape (points,), of several tables; tables[k][n] are the `patches` of one n."""
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


def tensor(series: Array, x: Array, y: Array) -> Array:
    """Sum of the series on the grid y, x: shape (n_max, len(y), len(x)). The same bits for any number of threads."""
    along_x = np.einsum("nij,jp->nip", series, polynomials(x, series.shape[2]), optimize=False)
    return np.einsum("nip,iq->nqp", along_x, polynomials(y, series.shape[1]), optimize=False)
