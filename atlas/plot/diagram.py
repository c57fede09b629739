"""The figure of a bifurcation diagram: branches over the speed, what lasts solid, and where that changes."""

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

if TYPE_CHECKING:
    from towatlas.results_motion import Branch, Diagram

# What is drawn, its axis, and whether that is logarithmic where it is wide.
SHOWN = {
    "x_f": ("position of the fish over tow radius, x_f", False),
    "r_f": ("distance of the fish from the axis over tow radius", True),
    "depth": ("depth of the fish over tow radius", False),
    "tension": ("tension at the tow point over (mu + rho A) g R", True),
}
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
APART = 0.035


def plot_diagram(found: "Diagram", axes: Axes, show: str = "r_f") -> list[Line2D]:
    """Branches over the speed; solid where they last, with folds and the edges of flutter, and where a jump goes.

    Parameters
    ----------
    found : Diagram
        From `towatlas.diagram`.
    axes : Axes
        To draw on.
    show : {"x_f", "r_f", "depth", "tension"}
        Over the speed.

    Returns
    -------
    list of Line2D
        The stretches of the branches.
    """
    field = {"depth": "z_f"}.get(show, show)
    title, logarithmic = SHOWN[show]
    lines, kinds, marks = [], set(), {}
    every = np.concatenate([getattr(branch, field) for branch in found.branches])
    for branch in found.branches:
        values = getattr(branch, field)
        for (low, high), kind in zip(pairwise(branch.points), branch.between, strict=True):
            inside = (branch.gamma > low.gamma) & (branch.gamma < high.gamma)
            speeds = [low.gamma, *branch.gamma[inside], high.gamma]
            heights = [getattr(low, field), *values[inside], getattr(high, field)]
            lines += axes.plot(speeds, heights, **STYLES[kind])
            kinds.add(kind)
        for point in branch.points:
            if point.kind in MARKERS:
                marks[point.gamma, getattr(point, field)] = point.kind
    axes.set_xlim(found.low, found.high)
    if logarithmic and every.min() > 0.0 and every.max() > WIDE * every.min():
        axes.set_yscale("log")
    if show == "depth":
        axes.invert_yaxis()
    for (gamma, value), kind in marks.items():
        axes.plot(
            gamma,
            value,
            MARKERS[kind][0],
            color="white",
            markeredgecolor="0.15",
            markersize=4.5,
            zorder=5,
            clip_on=False,
        )
    for gamma, start, end in _jumps(found, field):
        axes.annotate(
            "", (gamma, end), (gamma, start), arrowprops={"arrowstyle": "-|>", "color": "#a61e3c", "linewidth": 1.2}
        )
    _write_speeds(axes, sorted({gamma for gamma, _ in marks}))
    axes.set_xlabel("speed gamma = Omega sqrt(R/g)")
    axes.set_ylabel(title)
    axes.grid(color="0.92", linewidth=0.6)
    handles = [Line2D([], [], **STYLES[kind], label=LABELS[kind]) for kind in STYLES if kind in kinds]
    handles += [
        Line2D([], [], marker=mark, linestyle="", **MARK, label=text)
        for kind, (mark, text) in MARKERS.items()
        if kind in marks.values()
    ]
    if list(_jumps(found, field)):
        handles.append(Line2D([], [], color="#a61e3c", marker=">", markersize=4, label="where a jump may go"))
    axes.figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False, fontsize=8)
    return lines


def _jumps(found: "Diagram", field: str) -> list[tuple[float, float, float]]:
    """Folds at which a shape that lasts ends: the speed, there, and the nearest shape that lasts."""
    jumps = []
    for branch in found.branches:
        for end, kind in ((0, branch.between[0]), (-1, branch.between[-1])):
            point = branch.points[end]
            if point.kind != "fold" or kind not in ("stable", "weak"):
                continue
            others = [_there(other, point.gamma) for other in found.branches if other is not branch]
            places = [place for place in others if place is not None]
            if not places:
                continue
            start = point.r_f
            target, k = min(places, key=lambda place: abs(np.log(float(place[0].r_f[place[1]]) / start)))
            jumps.append((point.gamma, getattr(point, field), float(getattr(target, field)[k])))
    return jumps


def _there(branch: "Branch", gamma: float) -> "tuple[Branch, int] | None":
    """The sample of a branch at a speed, if it lasts there."""
    if not branch.points[0].gamma < gamma < branch.points[-1].gamma:
        return None
    k = int(np.argmin(np.abs(branch.gamma - gamma)))
    return (branch, k) if branch.kind[k] in ("stable", "weak") else None


def _write_speeds(axes: Axes, speeds: list[float]) -> None:
    """Speeds of folds and edges along the top, those that have room."""
    low, high = axes.get_xlim()
    kept: list[float] = []
    for speed in speeds:
        if not kept or speed - kept[-1] > APART * (high - low):
            kept.append(speed)
    top = axes.secondary_xaxis("top")
    top.set_xticks(kept, [f"{speed:.4g}" for speed in kept], rotation=90, fontsize=7)
    top.tick_params(length=2)
