"""The figure of a bifurcation diagram: branches over speed or length, what lasts solid, and where that changes."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from towatlas.solve.seen import LASTING, landing

if TYPE_CHECKING:
    from towatlas.results_motion import Diagram
    from towatlas.scene.diagrams import SceneDiagram

# What is drawn, the field of a branch, its axis without and with units, and whether it is logarithmic where it is wide.
SHOWN = {
    "x_f": ("x_f", "position of the fish over tow radius, x_f", "position of the fish away from the axis, m", False),
    "r_f": ("r_f", "distance of the fish from the axis over tow radius", "distance of the fish from the axis, m", True),
    "depth": ("z_f", "depth of the fish over tow radius", "depth of the fish below the tow point, m", False),
    "tension": ("tension", "tension at the tow point over (mu + rho A) g R", "tension at the tow point, N", True),
}
VALUES = {"gamma": "speed gamma = Omega sqrt(R/g)", "lam": "length of the cable over tow radius, lambda"}
STYLES: dict[str, dict[str, Any]] = {
    "stable": {"color": "#1f4e9c", "linewidth": 2.0, "linestyle": "-"},
    "weak": {"color": "#1f4e9c", "linewidth": 1.4, "linestyle": (0, (6, 1.5, 1, 1.5))},
    "flutter": {"color": "#c2571a", "linewidth": 1.8, "linestyle": (0, (1, 1))},
    "divergence": {"color": "0.45", "linewidth": 1.1, "linestyle": (0, (4, 2.5))},
    "unknown": {"color": "0.7", "linewidth": 0.9, "linestyle": (0, (1, 3))},
}
LABELS = {
    "stable": "stable",
    "weak": "weak growth",
    "flutter": "flutter",
    "divergence": "left without turning",
    "unknown": "not counted",
}
MARKERS = {"fold": ("o", "fold"), "hopf": ("D", "Hopf point"), "krein": ("D", "Krein collision")}
MARK: dict[str, Any] = {"color": "white", "markeredgecolor": "0.15", "markersize": 4.5}
WIDE = 30.0
# Values of special points next to each other than this part of the axis are not both written.
APART = 0.016


def plot_diagram(found: "Diagram | SceneDiagram", axes: Axes, show: str = "r_f") -> list[Line2D]:
    """Branches over speed or length; solid where they last, with folds and edges of flutter, and where a jump goes.

    Parameters
    ----------
    found : Diagram or SceneDiagram
        From `towatlas.diagram` or `towatlas.scene.diagrams.scene_diagram`.
    axes : Axes
        To draw on.
    show : {"x_f", "r_f", "depth", "tension"}
        What is drawn.

    Returns
    -------
    list of Line2D
        The stretches of the branches.
    """
    unit, size = getattr(found, "unit", ""), getattr(found, "size", 1.0)
    field, plain, named, logarithmic = SHOWN[show]
    lines, kinds, marks = [], set(), {}
    # What is said first where there is no room for all: folds, then where a shape begins or ceases to last.
    rank: dict[float, int] = {}
    every = np.concatenate([getattr(branch, field) for branch in found.branches])
    for branch in found.branches:
        heights = getattr(branch, field)
        for (low, high), kind in zip(pairwise(branch.points), branch.between, strict=True):
            inside = (branch.value > low.value) & (branch.value < high.value)
            values = np.array([low.value, *branch.value[inside], high.value]) / size
            lines += axes.plot(values, [getattr(low, field), *heights[inside], getattr(high, field)], **STYLES[kind])
            kinds.add(kind)
        for k, point in enumerate(branch.points):
            if point.kind in MARKERS:
                value = point.value / size
                marks[value, getattr(point, field)] = point.kind
                sides = {kind in LASTING for kind in branch.between[max(0, k - 1) : k + 1]}
                rank[value] = min(rank.get(value, 2), 0 if point.kind == "fold" else 3 - len(sides))
    axes.set_xlim(found.low / size, found.high / size)
    if logarithmic and every.min() > 0.0 and every.max() > WIDE * every.min():
        axes.set_yscale("log")
    if show == "depth":
        axes.invert_yaxis()
    for (value, height), kind in marks.items():
        axes.plot(value, height, MARKERS[kind][0], **MARK, zorder=5, clip_on=False)
    jumps = _jumps(found, field)
    for value, start, end in jumps:
        arrow = {"arrowstyle": "-|>", "color": "#a61e3c", "linewidth": 1.2}
        axes.annotate("", (value / size, end), (value / size, start), arrowprops=arrow)
    _write_values(axes, sorted(rank, key=lambda value: (rank[value], value)))
    moved = found.moved
    axes.set_xlabel(VALUES.get(moved, f"{moved}, {unit}"))
    axes.set_ylabel(plain if moved in VALUES else named)
    axes.grid(color="0.92", linewidth=0.6)
    handles = [Line2D([], [], **STYLES[kind], label=LABELS[kind]) for kind in STYLES if kind in kinds]
    handles += [
        Line2D([], [], marker=mark, linestyle="", **MARK, label=text)
        for kind, (mark, text) in MARKERS.items()
        if kind in marks.values()
    ]
    if jumps:
        handles.append(Line2D([], [], color="#a61e3c", marker=">", markersize=4, label="where a jump may go"))
    axes.figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False, fontsize=8)
    return lines


def _jumps(found: "Diagram | SceneDiagram", field: str) -> list[tuple[float, float, float]]:
    """Folds at which a shape that lasts ends: the value, there, and where a cable may land."""
    jumps = []
    for k, branch in enumerate(found.branches):
        for end, kind in ((0, branch.between[0]), (-1, branch.between[-1])):
            point = branch.points[end]
            if point.kind != "fold" or kind not in LASTING:
                continue
            if (to := landing(found.branches, k, point.value)) >= 0:
                target = found.branches[to]
                height = float(np.interp(point.value, target.value, getattr(target, field)))
                jumps.append((point.value, getattr(point, field), height))
    return jumps


def _write_values(axes: Axes, values: list[float]) -> None:
    """Where folds and edges are along the top, the first ones that have room."""
    low, high = axes.get_xlim()
    kept: list[float] = []
    for value in values:
        if all(abs(value - other) > APART * (high - low) for other in kept):
            kept.append(value)
    top = axes.secondary_xaxis("top")
    top.set_xticks(kept, [f"{value:.4g}" for value in kept], rotation=90, fontsize=7)
    top.tick_params(length=2)
