"""Figures. Each function draws on the axes given, or on new ones, and returns the artists that carry data."""

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from towatlas.limits import long_cable, massless_cable, unchecked_excess_length, unchecked_threshold_length
from towatlas.nomenclature import EQUILIBRIUM, SYMBOLS
from towatlas.tables.critical import Atlas

if TYPE_CHECKING:
    import xarray

# Dark to light, so that they differ in grey too, and told apart by dashes besides (Okabe and Ito's safe colours).
STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#000000", "linestyle": "-"},
    {"color": "#0072B2", "linestyle": (0, (7, 2))},
    {"color": "#D55E00", "linestyle": (0, (4, 1.5, 1, 1.5))},
    {"color": "#E69F00", "linestyle": (0, (1.5, 1.5))},
)
# Least width of the drawing of a slender cable, as a share of its height.
SLENDER = 0.3
LIMIT: dict[str, Any] = {"color": "0.55", "linewidth": 0.9, "zorder": 1}


def plot_critical(
    atlas: Atlas,
    w_f: tuple[float, ...] = (0.0, 1.0, 100.0, 10000.0),
    orders: tuple[int, ...] = (1, 2, 3),
    ax: Axes | None = None,
) -> list[Line2D]:
    """Critical speeds against cable length for several fish weights, with thresholds and limits.

    Parameters
    ----------
    atlas : Atlas
        Where the speeds come from.
    w_f : tuple of float
        Fish weights [-], four at most.
    orders : tuple of int
        Transitions to draw.
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Line2D
        One curve for each order and weight, orders outermost.
    """
    if len(w_f) > len(STYLES):
        raise ValueError(f"at most {len(STYLES)} fish weights can be told apart, got {len(w_f)}")
    if ax is None:
        _, ax = plt.subplots(figsize=(7.2, 4.8), layout="constrained")
    ax.set(xscale="log", yscale="log", xlim=(0.9, 1000.0), ylim=(0.02, 40.0))
    curves = []
    for n in orders:
        for weight, style in zip(w_f, STYLES, strict=False):
            excess = np.geomspace(atlas.axes.excess_min, atlas.axes.excess_max, 600)
            lam = unchecked_threshold_length(weight, n) + excess
            inside = lam <= 1000.0
            gamma = atlas.critical_speed(lam[inside], weight, n)
            label = f"{SYMBOLS['w_f'].tex} = {weight:g}" if n == orders[0] else None
            curves += ax.plot(lam[inside], gamma, linewidth=1.7, label=label, **style)
    _draw_limits(ax, orders)
    _label_orders(ax, atlas, orders, w_f)
    ax.set_xlabel(SYMBOLS["lam"].axis)
    ax.set_ylabel(SYMBOLS["gamma"].axis)
    ax.grid(which="major", color="0.9", linewidth=0.6)
    ax.legend(handles=curves[: len(w_f)], title="fish weight", frameon=False, loc="upper right")
    return curves


def _draw_limits(ax: Axes, orders: tuple[int, ...]) -> None:
    """Thresholds without a fish, long cables without a fish, and the massless cable, with a legend of their own."""
    lam = np.geomspace(1.0001, 1000.0, 800)
    handles = []
    for n in orders:
        handles = [
            ax.axvline(
                float(unchecked_threshold_length(0.0, n)),
                **LIMIT,
                linestyle=(0, (1, 2)),
                label="threshold $2n$, no fish",
            )
        ]
        far = lam[unchecked_excess_length(lam, 0.0, n) > 6.0 * n]
        chain = np.sqrt(float(long_cable(n)) / far)
        handles += ax.plot(far, chain, **LIMIT, label=r"hanging chain, no fish: $j_{0,n}/(2\sqrt{\lambda})$")
    massless = r"massless cable, $n = 1$: $(\lambda^{2/3} - 1)^{-3/4}$"
    # Above the curve of the heaviest fish, which it all but covers.
    handles += ax.plot(lam, massless_cable(lam), **LIMIT | {"color": "0.1", "zorder": 4}, label=massless)
    ax.add_artist(
        ax.legend(handles=handles, title="limits", loc="lower left", fontsize=8, framealpha=1, edgecolor="none")
    )


def _label_orders(ax: Axes, atlas: Atlas, orders: tuple[int, ...], w_f: tuple[float, ...]) -> None:
    """Name the transitions at the right edge, on the lightest and the heaviest fish."""
    named: list[float] = []
    for weight, style in ((w_f[0], STYLES[0]), (w_f[-1], STYLES[len(w_f) - 1])):
        for n in orders:
            gamma = float(atlas.critical_speed(1000.0, weight, n))
            if all(abs(np.log(gamma / other)) > 0.2 for other in named):
                ax.annotate(
                    f"$n = {n}$", (1000.0, gamma), (4, 0), textcoords="offset points", va="center", color=style["color"]
                )
                named.append(gamma)


def plot_shape(curve: "xarray.Dataset", ax: Axes | None = None) -> LineCollection:
    """The shape of one equilibrium in true proportions, coloured by its tension, with its nodes marked.

    Parameters
    ----------
    curve : xarray.Dataset
        From `towatlas.shape`.
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    LineCollection
        The cable.
    """
    if ax is None:
        _, ax = plt.subplots(figsize=(5.2, 6.4), layout="compressed")
    x, z, tension = curve.x.values, curve.z.values, curve["T"].values
    points = np.stack([x, z], axis=1)
    cable = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)),
        array=0.5 * (tension[1:] + tension[:-1]),
        cmap="viridis_r",
        linewidth=2.2,
        capstyle="round",
    )
    ax.axvline(0.0, **LIMIT, linestyle=(0, (8, 3, 2, 3)))
    ax.add_collection(cable)
    ax.plot(x[0], z[0], marker="v", color="k", markersize=8, linestyle="none", label="tow point", zorder=4)
    fish = "fish" if curve.attrs["w_f"] > 0 else "end of the cable"
    ax.plot(x[-1], z[-1], marker="o", color="k", markersize=10, linestyle="none", label=fish, zorder=4)
    if curve.attrs["nodes"]:
        nodes = curve.z_node.values
        style: dict[str, Any] = {"marker": "o", "mfc": "white", "mec": "k", "markersize": 5, "linestyle": "none"}
        # Above the fish, which hides a node next to it.
        ax.plot(0.0 * nodes, nodes, label="node", zorder=5, **style)
    low, high = min(0.0, x.min()), max(0.0, x.max())
    width = 1.12 * max(high - low, SLENDER * (z.max() - z.min()))
    middle = 0.5 * (low + high)
    ax.set(xlim=(middle - 0.5 * width, middle + 0.5 * width), ylim=(z.max() + 0.04 * width, z.min() - 0.04 * width))
    ax.set_aspect("equal")
    ax.margins(0.05)
    ax.set_xlabel(f"radius  {EQUILIBRIUM['x'].tex}  (tow radii)")
    ax.set_ylabel(f"depth  {EQUILIBRIUM['z'].tex}  (tow radii)")
    ax.set_title(
        f"{EQUILIBRIUM['lam'].tex} = {curve.attrs['lam']:g},  {EQUILIBRIUM['w_f'].tex} = {curve.attrs['w_f']:g},  "
        rf"$\gamma$ = {curve.attrs['gamma']:g}",
        fontsize=10,
    )
    bar = ax.figure.colorbar(cable, ax=ax, shrink=0.7)
    bar.set_label(r"tension  $T$ over $(\mu + \rho A) g R$")
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=3, frameon=False, fontsize=9)
    return cable
