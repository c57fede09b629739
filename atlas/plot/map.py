"""The figure of a map: where one shape is, where three, and where the one to be expected lasts."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from towatlas.kernels import status
from towatlas.maps.layout import KINDS
from towatlas.maps.lookup import Map
from towatlas.nomenclature import DRAG, EQUILIBRIUM

# By number of shapes: 1, 3, 5 and more.
SHADES = ("#ffffff", "#cfe1f2", "#8fbbdc", "#4f8fc0")
MARKS = {"flutter": ("#D55E00", "."), "divergence": ("#7b2d8b", "x")}
FAILED = "0.6"
PANELS = 6


def plot_map(known: Map) -> Figure:
    """Numbers of shapes over the last two axes of a map, a panel for each value of the first of three.

    Parameters
    ----------
    known : Map
        Of kind, branches "expected", and two or three axes.

    Returns
    -------
    Figure

    Raises
    ------
    ValueError
        For another one.
    """
    axes = list(known.axes)
    panels = len(known.axes[axes[0]]) if len(axes) == 3 else 1
    if "kind" not in known.dataset or known.dataset.attrs["branches"] != "expected":
        raise ValueError(
            'this figure shows whether the shape expected lasts: it needs "kind" and branches = "expected"'
        )
    if not 2 <= len(axes) <= 3 or panels > PANELS:
        raise ValueError(f"this figure has two axes, and a third one of at most {PANELS} values; got {', '.join(axes)}")
    figure, grid = plt.subplots(
        1, panels, figsize=(1.2 + 3.0 * panels, 4.0), layout="constrained", sharey=True, squeeze=False
    )
    for k, ax in enumerate(grid[0]):
        _panel(ax, known, k if len(axes) == 3 else None)
        ax.set_xlabel(_label(axes[-1]))
        if len(axes) == 3:
            ax.set_title(f"{_symbol(axes[0])} = {known.axes[axes[0]][k]:g}")
    grid[0, 0].set_ylabel(_label(axes[-2]))
    names = ("one shape", "three shapes", "five", "more")
    most = int(known.dataset["count"].max())
    handles: list[Artist] = [
        Patch(facecolor=colour, edgecolor="0.6", label=name)
        for k, (colour, name) in enumerate(zip(SHADES, names, strict=True))
        if most >= 2 * k + 1
    ]
    handles.append(plt.Line2D([], [], color="black", linewidth=1.2, label="jump: the number changes"))
    for kind, (colour, mark) in MARKS.items():
        if (known.dataset.kind == KINDS.index(kind)).any():
            line = plt.Line2D([], [], color=colour, marker=mark, linestyle="", label=f"the shape expected: {kind}")
            handles.append(line)
    if (known.dataset.status != status.OK).any():
        handles.append(Patch(facecolor=FAILED, label="not computed"))
    figure.legend(handles=handles, loc="outside lower center", ncols=min(4, panels + 1), frameon=False)
    return figure


def _panel(ax: Axes, known: Map, first: int | None) -> None:
    part = known.dataset if first is None else known.dataset.isel({next(iter(known.axes)): first})
    y, x = (known.axes[name] for name in list(known.axes)[-2:])
    count = part["count"].values
    norm = BoundaryNorm([0, 2, 4, 6, 1000], 4)
    ax.pcolormesh(x, y, count, cmap=ListedColormap(SHADES), norm=norm, shading="nearest", rasterized=True)
    failed = part.status.values != status.OK
    if failed.any():
        ax.pcolormesh(x, y, np.ma.masked_where(~failed, failed), cmap=ListedColormap([FAILED]), shading="nearest")
    if count.max() > 1:
        ax.contour(x, y, count, levels=[2, 4, 6], colors="black", linewidths=1.2)
    for kind, (colour, mark) in MARKS.items():
        i, j = np.nonzero(part.kind.values[..., 0] == KINDS.index(kind))
        ax.plot(x[j], y[i], mark, color=colour, markersize=2.0, markeredgewidth=0.6)
    for name, axis in zip(list(known.axes)[-2:], ("y", "x"), strict=True):
        if known.dataset[name].attrs["spacing"] == "log":
            ax.set(**{f"{axis}scale": "log"})
            scale = ax.xaxis if axis == "x" else ax.yaxis
            scale.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            scale.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            scale.set_minor_formatter(NullFormatter())


def _symbol(name: str) -> str:
    known = DRAG | EQUILIBRIUM
    return known[name].tex.split(" = ")[0] if name in known else name


def _label(name: str) -> str:
    known = DRAG | EQUILIBRIUM
    return known[name].axis if name in known else name
