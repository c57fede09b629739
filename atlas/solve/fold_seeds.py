"""Guesses for tables of critical states.

Over the domain of the atlas they come from its own series, shortened, which the package brings along: within 1e-8, so
that one shot and a first-order correction are enough. Beyond it a few cables are solved from cold and the rest
interpolated: the few are Chebyshev nodes of the box that the table fills in the coordinates of the atlas, one box for
each n; they are solved the same way, from fewer still.
"""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import W_SCALE, unchecked_threshold_length
from towatlas.numerics import chebyshev

Array = NDArray[np.float64]

# Made by `make seeds` (towatlas.builders.fold_series).
SERIES = Path(__file__).parent / "fold_series.npz"
# Patches along each axis on which it is summed: with more, its own error is what is left.
PATCHES = 24
# A node costs as much as three seeded rows, and saves a row two thirds of its time.
ROWS_A_NODE = 8
FEWEST_ROWS = 64
# Nodes for each e-fold that a box spans, and for any box: measured, more gain nothing.
NODES_AN_EFOLD = 2.0
NODES_OF_ANY = 6
# Of a box, to a patch of the kernel's eight terms.
NODES_A_PATCH = 3
# On an axis along which a table hardly extends: three nodes over this width give its slope.
FEWEST_NODES, LEAST_WIDTH = 3, 0.1
# Where rounding of lambda is a large part of the excess length, a series through such rows would be noise.
MOST_ROUNDING = 1e8


def seed(
    *, lam: Array, w_f: Array, n: NDArray[np.int64], excess: Array, solve: Callable[..., dict[str, NDArray[Any]]]
) -> tuple[Array, Array, Array]:
    """Guesses of (a, gamma) and their slopes, as `towatlas.kernels.folds.solve_folds` takes them.

    Parameters
    ----------
    lam, w_f, n, excess : ndarray, shape (rows,)
        The cables.
    solve : callable
        `towatlas.solve.critical.solve_rows`, for the nodes.

    Returns
    -------
    a, gamma : ndarray, shape (rows,)
        Zero for rows without a guess.
    slopes : ndarray, shape (rows, 8)
        nan for rows without a guess.
    """
    rows = len(n)
    a, gamma, slopes = np.zeros(rows), np.zeros(rows), np.full((rows, 8), np.nan)
    if rows < FEWEST_ROWS:
        return a, gamma, slopes
    with np.errstate(invalid="ignore", divide="ignore"):
        sound = np.isfinite(lam) & np.isfinite(w_f) & (w_f >= 0.0) & (n > 0)
        sound &= (excess > 0.0) & (lam < MOST_ROUNDING * excess)
    for order in np.unique(n[sound]):
        group = np.flatnonzero(sound & (n == order))
        if len(group) < FEWEST_ROWS:
            continue
        held = _held(int(order), w_f[group], excess[group])
        inside, beyond = group[held], group[~held]
        if len(inside):
            a[inside], gamma[inside], slopes[inside] = seed_held(int(order), w_f[inside], excess[inside])
        if len(beyond) >= FEWEST_ROWS:
            found = _seed_box(int(order), w_f[beyond], excess[beyond], solve)
            if found is not None:
                a[beyond], gamma[beyond], slopes[beyond] = found
    return a, gamma, slopes


@cache
def _domain() -> tuple[int, Array, Array]:
    """Of the series of the package: highest n; lowest and highest excess length, and w_f."""
    with np.load(SERIES) as file:
        return len(file["n"]), file["excess"], file["w_f"]


def _held(n: int, w_f: Array, excess: Array) -> NDArray[np.bool_]:
    n_max, (low, high), (_, heaviest) = _domain()
    return (n <= n_max) & (excess >= low) & (excess <= high) & (w_f <= heaviest)


@cache
def _held_patches(n: int) -> tuple[Array, Array]:
    """The series of the package for one n, on patches, and its span in x and y."""
    with np.load(SERIES) as file:
        series = file[f"series_{n}"]
    _, excess, w_f = _domain()
    return patches_of(series, (PATCHES, PATCHES)), np.concatenate([np.log(excess), np.log1p(w_f / W_SCALE)])


def patches_of(series: Array, counts: tuple[int, int]) -> Array:
    """Series of all fields on patches, as `towatlas.kernels.fold_predictor.seed_folds` takes them.

    Parameters
    ----------
    series : ndarray, shape (4, y degree, x degree)
    counts : pair of int
        Patches along y and x, >= 1.

    Returns
    -------
    ndarray, shape (*counts, 4, 8, 8)
        x degree first; at an address from which vectors are loaded whole.
    """
    from towatlas.kernels.calls import FIELDS, NODES

    short = chebyshev.equal_patches(series, counts, NODES).transpose(1, 2, 0, 4, 3)
    room = np.empty(counts[0] * counts[1] * FIELDS * NODES**2 + NODES)
    first = -(room.ctypes.data // room.itemsize) % NODES
    whole = room[first : first + short.size].reshape(short.shape)
    whole[:] = short
    return whole


def _summed(patches: Array, span: Array, w_f: Array, excess: Array) -> tuple[Array, Array, Array]:
    from towatlas.kernels.calls import SLOPES, seed_folds

    rows = len(w_f)
    a, gamma, slopes = np.empty(rows), np.empty(rows), np.empty((rows, SLOPES))
    seed_folds(patches, w_f, excess, span, W_SCALE, a, gamma, slopes, 0, rows)
    return a, gamma, slopes


def seed_held(n: int, w_f: Array, excess: Array) -> tuple[Array, Array, Array]:
    """Guesses and slopes for rows of one n within the series of the package.

    Parameters
    ----------
    n : int
        Number of the transition, of those held.
    w_f, excess : ndarray, shape (rows,)
        Fish weight and lambda - lambda_cn [-], in the domain.

    Returns
    -------
    a, gamma : ndarray, shape (rows,)
    slopes : ndarray, shape (rows, 8)
    """
    return _summed(*_held_patches(n), w_f, excess)


def _seed_box(n: int, w_f: Array, excess: Array, solve: Callable) -> tuple[Array, Array, Array] | None:
    """Guesses and slopes for rows of one n; None where no box of nodes pays or one of its nodes fails."""
    x, y = np.log(excess), np.log1p(w_f / W_SCALE)
    span = _box(x, y)
    counts = _node_counts(span, len(w_f) / ROWS_A_NODE)
    if counts is None:
        return None
    node_x, node_y = (
        0.5 * (low + high) + 0.5 * (high - low) * chebyshev.nodes(count)
        for low, high, count in zip(span[::2], span[1::2], counts, strict=True)
    )
    node_w_f, node_excess = (
        np.ascontiguousarray(grid.ravel())
        for grid in np.meshgrid(W_SCALE * np.expm1(node_y), np.exp(node_x), indexing="ij")
    )
    threshold = unchecked_threshold_length(node_w_f, n)
    nodes = solve(lam=threshold + node_excess, w_f=node_w_f, n=np.full(len(node_w_f), n), excess=node_excess)
    if (nodes["status"] != status.OK).any():
        return None
    log_gamma = np.log(nodes["gamma"])
    fields = (
        np.log(np.abs(nodes["x_f"])) + 2.0 * log_gamma + np.log(node_excess),
        log_gamma + 0.5 * np.log(node_excess),
        np.log(-nodes["R_x0"]),
        np.log(nodes["z_f"]),
    )
    series = chebyshev.coefficients(np.stack([field.reshape(len(node_y), len(node_x)) for field in fields]))
    parts = tuple(-(-count // NODES_A_PATCH) for count in (len(node_y), len(node_x)))
    return _summed(patches_of(series, (parts[0], parts[1])), span, w_f, excess)


def _box(x: Array, y: Array) -> Array:
    """Lowest and highest x, then y; widened where that is too little to tell a slope."""
    span = np.array([x.min(), x.max(), y.min(), y.max()])
    for axis in (0, 2):
        short = LEAST_WIDTH - (span[axis + 1] - span[axis])
        if short > 0.0:
            # Upwards in y: there is no fish lighter than none.
            span[axis] -= 0.5 * short if axis == 0 else 0.0
            span[axis + 1] += 0.5 * short if axis == 0 else short
    return span


def _node_counts(span: Array, most: float) -> tuple[int, int] | None:
    """Nodes in x and y for a box; None where `most` nodes are too few for it."""
    wanted = NODES_OF_ANY + NODES_AN_EFOLD * (span[1::2] - span[::2])
    wanted[span[1::2] - span[::2] <= 1.01 * LEAST_WIDTH] = FEWEST_NODES
    wide = wanted > FEWEST_NODES
    spare = most / np.prod(wanted)
    if spare < 1.0:
        wanted[wide] *= spare ** (1.0 / max(1, wide.sum()))
    counts = wanted.astype(int)
    return (counts[0], counts[1]) if counts.min() >= FEWEST_NODES else None
