"""Figures of where inner shapes last in a vacuum: speed against cable length, by fish weights."""

from itertools import pairwise
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import unchecked_threshold_length
from towatlas.nomenclature import SYMBOLS
from towatlas.results_motion import Boundary
from towatlas.solve.critical import solve_critical
from towatlas.solve.flutter_boundaries import krein_boundaries
from towatlas.solve.krein import Domain
from towatlas.solve.members import shoot_lanes, solve_members
from towatlas.solve.spectra import growth_columns
from towatlas.system import nondense_rows
from towatlas.tables.atlas import Atlas

Array = NDArray[np.float64]
FOLD, EDGE, FLUTTERS = "#000000", "#D55E00", "#F6D9B8"
# Columns of what flutters.
COLUMNS = 160


def plot_boundaries(w_f: tuple[float, ...] = (0.0, 1.0, 10.0, 1352.0), axes: list[Axes] | None = None) -> list[Line2D]:
    """Where the inner shape with one node appears, and where it flutters, in speed against cable length, in a vacuum.

    Parameters
    ----------
    w_f : tuple of float
        Fish weights [-].
    axes : list of Axes, optional
        One for each; new ones by default.

    Returns
    -------
    list of Line2D
        Edges of flutter.
    """
    if axes is None:
        rows = (len(w_f) + 1) // 2
        _, grid = plt.subplots(rows, 2, figsize=(7.2, 3.2 * rows), layout="constrained", squeeze=False)
        axes = list(grid.ravel())
    lines: list[Line2D] = []
    domain = Domain()
    for ax, weight in zip(axes, w_f, strict=False):
        threshold = float(unchecked_threshold_length(weight, 1))
        excess = np.geomspace(*domain.excess, COLUMNS + 1)
        folds = solve_critical(threshold + excess, weight, 1).gamma
        curves = krein_boundaries(weight)
        _shade(ax, curves, weight, threshold, excess, domain)
        ax.plot(excess, folds, color=FOLD, linewidth=1.5)
        ax.plot(excess, domain.speeds * folds, color="0.6", linewidth=0.8, linestyle=(0, (1, 2)))
        for curve in curves:
            lines += ax.plot(curve.lam - threshold, curve.gamma, color=EDGE, linewidth=1.3)
            ax.plot(curve.lam[curve.turns] - threshold, curve.gamma[curve.turns], "o", color=EDGE, markersize=3.5)
        ax.set(xscale="log", yscale="log", title=f"{SYMBOLS['w_f'].tex} = {weight:g}", xlim=domain.excess)
        ax.grid(which="major", color="0.9", linewidth=0.6)
        ax.set_xlabel(r"$\lambda - \lambda_{c1}$")
        ax.set_ylabel(r"$\gamma = \Omega\sqrt{R/g}$")
    handles = [
        *_edges(),
        Line2D([], [], color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), label="3 times the fold: no further looked"),
        Line2D([], [], color=FLUTTERS, linewidth=7, label="does not last"),
    ]
    axes[0].figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)  # type: ignore[union-attr]
    return lines


def plot_held(atlas: Atlas, axes: NDArray[Any]) -> list[Line2D]:
    """Boundaries of flutter of an atlas over the length, the speed over that of the fold, a row each n.

    Parameters
    ----------
    atlas : Atlas
        With growth rates.
    axes : ndarray of Axes, shape (n, weights)
        Of so many weights that have curves, spread evenly among these.

    Returns
    -------
    list of Line2D
    """
    table = atlas.stability
    weights = sorted({curve.w_f for curve in table.curves})
    shown = [weights[k] for k in np.linspace(0, len(weights) - 1, axes.shape[1]).round().astype(int)]
    lines: list[Line2D] = []
    for row, n in zip(axes, range(1, table.n_max + 1), strict=False):
        for ax, w_f in zip(row, shown, strict=True):
            threshold = float(unchecked_threshold_length(w_f, n))
            for curve in table.curves:
                if (curve.n, curve.w_f) == (n, w_f):
                    ratio = curve.gamma / atlas.critical_speed(curve.lam, w_f, n, outside="solve")
                    lines += ax.plot(curve.lam - threshold, ratio, color=EDGE, linewidth=0.9)
            ax.axhline(1.0, color=FOLD, linewidth=1.5)
            limits = (table.axes.excess_min, table.axes.excess_max)
            ax.set(xscale="log", xlim=limits, ylim=(0.97, table.axes.speed_max))
            ax.grid(which="major", color="0.92", linewidth=0.5)
            if n == 1:
                ax.set_title(f"{SYMBOLS['w_f'].tex} = {w_f:.3g}", fontsize=9)
            if n == table.n_max:
                ax.set_xlabel(r"$\lambda - \lambda_{cn}$")
        row[0].set_ylabel(rf"$\gamma / \gamma_{{c{n}}}$")
    axes.flat[0].figure.legend(handles=_edges(), loc="outside lower center", ncols=2, frameon=False)
    return lines


def _edges() -> list[Line2D]:
    return [
        Line2D([], [], color=FOLD, linewidth=1.5, label="fold: the shape appears"),
        Line2D([], [], color=EDGE, linewidth=1.3, label="flutter begins or ends"),
    ]


def _shade(ax: Axes, curves: tuple[Boundary, ...], w_f: float, threshold: float, excess: Array, domain: Domain) -> None:
    """Between edges, at a speed in the middle, what grows is counted."""
    middle = np.sqrt(excess[1:] * excess[:-1])
    folds = solve_critical(threshold + middle, w_f, 1).gamma
    pieces: list[tuple[int, float, float]] = []
    for k, (distance, fold) in enumerate(zip(middle, folds, strict=True)):
        speeds = np.sort(
            np.concatenate([[fold, domain.speeds * fold], *(_crossings(c, threshold + distance) for c in curves)])
        )
        pieces += [(k, low, high) for low, high in pairwise(speeds) if high > low]
    columns, low, high = (np.array(part) for part in zip(*pieces, strict=True))
    gamma, lam = np.sqrt(low * high), threshold + middle[columns]
    order, weights = np.ones(len(gamma), np.int64), np.full(len(gamma), w_f)
    shapes = solve_members(
        lam=lam, w_f=weights, gamma=gamma, n=order, outer=np.zeros(len(gamma), bool), shoot=shoot_lanes
    )
    known = np.where(shapes.status == status.OK, np.abs(shapes.x_f), np.nan)[:, None]
    # Neighbours are those above and below the same edges.
    sort = np.lexsort((columns, np.arange(len(columns)) - np.searchsorted(columns, columns)))
    rates = growth_columns(
        nondense_rows(lam=lam, w_f=weights, C=np.zeros(len(gamma)))[sort],
        gamma[sort],
        r_f=known[sort],
        nodes=order[sort, None],
        index=2 * order[sort, None],
        error=shapes.error[sort, None],
    )
    grows = np.empty(len(gamma), bool)
    grows[sort] = rates["unstable"][:, 0] > 0
    corners = [
        [(excess[k], a), (excess[k + 1], a), (excess[k + 1], b), (excess[k], b)]
        for k, a, b in zip(columns[grows], low[grows], high[grows], strict=True)
    ]
    ax.add_collection(PolyCollection(corners, facecolor=FLUTTERS, edgecolor=FLUTTERS, linewidth=0.2, zorder=0))


def _crossings(curve: Boundary, lam: float) -> Array:
    """Speeds of a curve at one length, between its points in the logarithms."""
    a, b = curve.lam[:-1], curve.lam[1:]
    k = np.flatnonzero((a < lam) != (b < lam))
    share = np.log(lam / a[k]) / np.log(b[k] / a[k])
    return np.asarray(curve.gamma[k] ** (1.0 - share) * curve.gamma[k + 1] ** share)
