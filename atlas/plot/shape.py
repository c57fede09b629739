"""The figure of the shape of one equilibrium."""

from typing import TYPE_CHECKING, Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from towatlas.nomenclature import EQUILIBRIUM

if TYPE_CHECKING:
    import xarray

# Least width of the drawing of a slender cable, as a share of its height.
SLENDER = 0.3
AXIS: dict[str, Any] = {"color": "0.55", "linewidth": 0.9, "zorder": 1}


def plot_shape(curve: "xarray.Dataset", ax: Axes | None = None) -> LineCollection:
    """The shape of one equilibrium in true proportions, coloured by its tension, with its nodes marked.

    Drawn is the plane through the axis and the tow point, the x and z of the shape.

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
    ax.axvline(0.0, **AXIS, linestyle=(0, (8, 3, 2, 3)))
    ax.add_collection(cable)
    ax.plot(x[0], z[0], marker="v", color="k", markersize=8, linestyle="none", label="tow point", zorder=4)
    fish = "fish" if curve.attrs["w_f"] > 0 else "end of the cable"
    ax.plot(x[-1], z[-1], marker="o", color="k", markersize=10, linestyle="none", label=fish, zorder=4)
    if curve.attrs["nodes"]:
        nodes = curve.z_node.values
        style: dict[str, Any] = {"marker": "o", "mfc": "white", "mec": "k", "markersize": 5, "linestyle": "none"}
        # Above the fish, which hides a node next to it.
        ax.plot(0.0 * nodes, nodes, label="node" if not np.any(curve.y.values) else "$x = 0$", zorder=5, **style)
    low, high = min(0.0, x.min()), max(0.0, x.max())
    width = 1.12 * max(high - low, SLENDER * (z.max() - z.min()))
    middle = 0.5 * (low + high)
    ax.set(xlim=(middle - 0.5 * width, middle + 0.5 * width), ylim=(z.max() + 0.04 * width, z.min() - 0.04 * width))
    ax.set_aspect("equal")
    ax.margins(0.05)
    seen = ", seen along the way of the tow point" if np.any(curve.y.values) else ""
    ax.set_xlabel(f"radius  {EQUILIBRIUM['x'].tex}  (tow radii){seen}")
    ax.set_ylabel(f"depth  {EQUILIBRIUM['z'].tex}  (tow radii)")
    ax.set_title(
        f"{EQUILIBRIUM['lam'].tex} = {curve.attrs['lam']:g},  {EQUILIBRIUM['w_f'].tex} = {curve.attrs['w_f']:g},  "
        rf"$\gamma$ = {curve.attrs['gamma']:g}" + (f",  $C$ = {curve.attrs['C']:g}" if curve.attrs["C"] else ""),
        fontsize=10,
    )
    bar = ax.figure.colorbar(cable, ax=ax, shrink=0.7)
    bar.set_label(r"tension  $T$ over $(\mu + \rho A) g R$")
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=3, frameon=False, fontsize=9)
    return cable
