"""The figure of a scene: its shapes from the side and from above in true proportion, and the jumps about its speed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from textwrap import fill
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator
from numpy.typing import NDArray

from towatlas.plot.labels import Label, place_labels
from towatlas.plot.speeds import plot_speeds
from towatlas.scene.jumps import SceneAnswer
from towatlas.scene.scene import KNOT, Scene

Array = NDArray[np.float64]

STYLE: Any = {"font.size": 8.5, "axes.titlesize": 9.0, "axes.axisbelow": True}
# Width of the figure and heights of its rows: all shapes, the one that matters, the speeds, what is written [in].
WIDTH, ALL, ALONE, SPEEDS, WORDS = 8.6, 3.9, 3.3, 1.8, 1.0
# That one is drawn by itself, too, where it fills less than this share of a view of all, or is more slender from the
# side than this; then it is stretched, by one of these numbers.
SMALL, SLENDER = 0.4, 6.0
FACTORS = np.array([digit * 10.0**power for power in range(6) for digit in (1, 2, 5)])
# A plane through tow point and fish that passes the axis by less than this share of the tow radius is one through it.
NEAR = 0.05
MARGIN, ARROW = 0.08, 0.15
# A circle so many times as wide as the shape itself is not measured from its axis.
FAR = 20.0
# Points along the shape that matters and along others, and on each half wave of them, at least.
POINTS, SMOOTH = (401, 121), (24, 12)
LINE = 100
OTHER: dict[str, Any] = {"color": "0.6", "linewidth": 1.0, "linestyle": (0, (4, 2)), "zorder": 2}
AXIS: dict[str, Any] = {"color": "0.45", "linewidth": 0.8, "linestyle": (0, (8, 3, 2, 3)), "zorder": 1}
CENTRE: dict[str, Any] = {"color": "0.45", "marker": "+", "markersize": 7, "linestyle": "none", "zorder": 1}
CIRCLE: dict[str, Any] = {"color": "0.45", "linewidth": 0.8, "zorder": 1}
TOW: dict[str, Any] = {"marker": "v", "color": "k", "markersize": 6, "linestyle": "none", "zorder": 5}
FISH: dict[str, Any] = {"marker": "o", "color": "k", "markersize": 5, "linestyle": "none", "zorder": 5}


@dataclass(frozen=True)
class _Cable:
    """A shape: its name, number of nodes, points [m] and tensions [N]."""

    name: str
    nodes: int
    points: Array
    tension: Array


@dataclass(frozen=True)
class _View:
    """A way to look: what is drawn across and down is `seen @ (points - origin)`."""

    title: str
    across: str
    down: str
    seen: Array
    origin: Array
    # From the side there may be the axis, from above there is the circle; distances may grow to the left.
    side: bool
    axis: bool = False
    leftwards: bool = False

    def of(self, points: Array) -> Array:
        return self.seen @ (points - self.origin[:, None])


@dataclass(frozen=True)
class _Panel:
    """Cables seen in a view, the first in colour, within bounds across and down, stretched across by a factor."""

    view: _View
    cables: Sequence[_Cable]
    bounds: Array
    stretch: float = 1.0
    alone: bool = False


def plot_scene(answer: SceneAnswer, branch: str | None = None, figure: Figure | None = None) -> Figure:
    """The shapes of a scene in true proportion from the side and from above, in m, and its jumps on an axis of speeds.

    Parameters
    ----------
    answer : SceneAnswer
        From `towatlas.answer_scene`.
    branch : str, optional
        Name of a shape, drawn alone and without speeds; by default the one expected, coloured by its tension, and all
        others, dashed.
    figure : Figure, optional
        An empty one to draw on, which gets the size it needs; a new one by default.

    Returns
    -------
    Figure
        The same; its `savefig` writes it.

    Notes
    -----
    From the side one looks square to the line from the tow point to the fish of the shape in colour, so that their
    distance is a true one; where that line meets the axis, square to the radius of the tow point. From above x is to
    the right and y down the page: a turn to starboard goes clockwise. Where the shape in colour fills little of a view
    it is drawn by itself below, and one more slender than 6 to 1 is stretched there, by what the title says. Labels
    without a free place are left out.
    """
    figure = figure or Figure()
    with matplotlib.rc_context(STYLE):
        _draw_all(figure, answer, branch)
    return figure


def _draw_all(figure: Figure, answer: SceneAnswer, branch: str | None) -> None:
    scene, found = answer.scene, answer.equilibria
    row = found.expected if branch is None else int(np.flatnonzero(found.branch == branch)[0])
    main = _cable(answer, row, 0)
    cables = [main] + [_cable(answer, k, 1) for k in range(len(found)) if k != row and branch is None]
    columns = [_panels(view, cables, scene) for view in (_from_side(scene, main), _from_above(scene))]
    rows = max(len(column) for column in columns)
    speeds = branch is None and answer.folds is not None
    heights = [ALL] + [ALONE] * (rows - 1) + [SPEEDS] * speeds
    figure.set_size_inches(WIDTH, sum(heights) + WORDS)
    figure.set_layout_engine("constrained")
    grid = figure.add_gridspec(len(heights), 2, height_ratios=heights)
    drawn = [
        (figure.add_subplot(grid[k, place]), panel)
        for place, column in enumerate(columns)
        for k, panel in enumerate(column)
    ]
    low, high = main.tension.min(), main.tension.max()
    colours = Normalize(low, max(high, low + 1e-9 * abs(low)))
    for axes, panel in drawn:
        _draw(axes, panel, scene, colours)
    panels = [axes for axes, _ in drawn]
    bar = figure.colorbar(
        panels[0].collections[0], ax=panels, shrink=0.6, aspect=30, pad=0.02, label=f"tension of {main.name} (N)"
    )
    bar.ax.ticklabel_format(useOffset=False)
    figure.suptitle(_title(answer), x=0.01, ha="left", fontsize=10, parse_math=False)
    handles = _handles(scene, columns[0][0])
    if free := [place for place, column in enumerate(columns) if len(column) < rows]:
        # In the place of a view by itself that is not needed.
        empty = figure.add_subplot(grid[1, free[0]])
        empty.set_axis_off()
        empty.legend(handles=handles, loc="center", frameon=False)
    else:
        figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    write = plot_speeds(answer, figure.add_subplot(grid[-1, :])) if speeds else None
    # Labels are placed between things that stand where they are going to stand: the layout follows from the texts at
    # ticks, they from proportions, and those from the layout.
    for _ in range(2):
        figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes, panel in drawn:
        _name(axes, panel, scene)
    if write:
        write()


def _cable(answer: SceneAnswer, row: int, rank: int) -> _Cable:
    nodes = int(answer.equilibria.nodes[row])
    count = max(POINTS[rank], SMOOTH[rank] * (nodes + 1))
    curve = answer.shape(row, np.linspace(0.0, answer.scene.length, count))
    points = np.stack([curve[name].values for name in ("x", "y", "z")])
    return _Cable(str(answer.equilibria.branch[row]), nodes, points, curve["T"].values)


def _from_side(scene: Scene, main: _Cable) -> _View:
    tow, fish = main.points[:, 0], main.points[:, -1]
    way = (fish - tow)[:2]
    distance = float(np.hypot(*way))
    # A fish next to below the tow point gives no direction to speak of.
    if distance <= NEAR * np.hypot(*np.ptp(main.points[:2], axis=1)) or abs(way[1]) <= NEAR * distance:
        seen = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        return _View("side view", "x (m), radially from the axis", "depth (m)", seen, np.zeros(3), side=True, axis=True)
    seen = np.array([[*(way / distance), 0.0], [0.0, 0.0, 1.0]])
    words = "distance from the tow point towards the fish (m)"
    return _View("side view", words, "depth (m)", seen, tow, side=True, leftwards=True)


def _from_above(scene: Scene) -> _View:
    seen = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    return _View(f"from above, turning to {scene.turn}", "x (m)", "y (m)", seen, np.zeros(3), side=False)


def _panels(view: _View, cables: Sequence[_Cable], scene: Scene) -> list[_Panel]:
    """All shapes with the axis or the circle, and where that shows little of the first, that one by itself."""
    main, radius = cables[0], scene.radius
    marks = np.zeros((3, int(view.axis)))
    if not view.side:
        marks = radius * np.array([[-1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    bounds = _bounds(view, [cable.points for cable in cables] + [marks])
    closer = _bounds(view, [main.points])
    stretch = _stretch(closer) if view.side else 1.0
    panels = [_Panel(view, cables, bounds)]
    if stretch != 1.0 or _span(closer) < SMALL * _span(bounds):
        width = _span(closer) if stretch == 1.0 else np.ptp(closer[0])
        if radius > FAR * width and not view.leftwards:
            view = replace(view, origin=main.points[:, 0], across="x from the tow point (m)")
            closer = _bounds(view, [main.points])
        panels.append(_Panel(view, [main], closer, stretch, alone=True))
    return panels


def _bounds(view: _View, points: Sequence[Array]) -> Array:
    """Least and largest across, and down."""
    seen = view.of(np.concatenate(points, axis=1))
    return np.stack([seen.min(axis=1), seen.max(axis=1)], axis=1)


def _span(bounds: Array) -> float:
    return float(np.ptp(bounds, axis=1).max())


def _stretch(bounds: Array) -> float:
    """How many times the width of what is slender is to be drawn too large; below 1 if the depth is."""
    across, down = np.ptp(bounds, axis=1)
    ratio = max(across, down) / max(min(across, down), 1e-9 * max(across, down))
    if not SLENDER < ratio < FACTORS[-1]:
        return 1.0
    factor = float(FACTORS[ratio >= FACTORS][-1])
    return factor if down > across else 1.0 / factor


def _draw(axes: Axes, panel: _Panel, scene: Scene, colours: Normalize) -> None:
    view, (main, *others) = panel.view, panel.cables
    across, down = view.of(main.points)
    path = np.stack([across, down], axis=1)
    tension = 0.5 * (main.tension[1:] + main.tension[:-1])
    segments = list(np.stack([path[:-1], path[1:]], axis=1))
    style: dict[str, Any] = {"cmap": "viridis_r", "linewidth": 2.2, "capstyle": "round", "zorder": 3}
    axes.add_collection(LineCollection(segments, array=tension, norm=colours, **style))
    if view.axis:
        axes.axvline(-view.origin[0], **AXIS)
    if not view.side:
        turn = np.linspace(0.0, 2.0 * np.pi, 721)
        circle = scene.radius * np.stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
        axes.plot(*view.of(circle), **CIRCLE)
        axes.plot(*view.of(np.zeros((3, 1))), **CENTRE)
    for cable in others:
        other = view.of(cable.points)
        axes.plot(*other, **OTHER)
        axes.plot(*other[:, -1], **FISH | {"color": "0.6"})
    axes.plot(across[-1], down[-1], **FISH)
    axes.plot(across[0], down[0], **TOW)
    _frame(axes, panel)
    if not view.side:
        _point_ahead(axes, panel, scene)


def _frame(axes: Axes, panel: _Panel) -> None:
    view, stretch = panel.view, panel.stretch
    margin = MARGIN * _span(panel.bounds) * np.array([1.0 / max(stretch, 1.0), min(stretch, 1.0)])
    (left, right), (top, bottom) = panel.bounds + margin[:, None] * [-1.0, 1.0]
    # Left open, for the proportion widens one of them.
    axes.set_xlim(*((right, left) if view.leftwards else (left, right)), auto=True)
    axes.set_ylim(bottom, top, auto=True)
    axes.set_aspect(1.0 / stretch, adjustable="datalim")
    title = f"{panel.cables[0].name} alone, {view.title.partition(',')[0]}" if panel.alone else view.title
    if stretch != 1.0:
        title += f", {'width' if stretch > 1.0 else 'depth'} stretched {max(stretch, 1.0 / stretch):g} times"
    axes.set(title=title, xlabel=view.across, ylabel=view.down)
    for axis, most in ((axes.xaxis, 4), (axes.yaxis, 7)):
        axis.set_major_locator(MaxNLocator(most))
        axis.set_major_formatter(FuncFormatter(_written))
    axes.grid(color="0.93", linewidth=0.6)


def _tip(panel: _Panel, scene: Scene) -> float:
    """Where an arrow from the tow point ends that shows its way, in y."""
    return (-1.0 if scene.turn == "port" else 1.0) * ARROW * _span(panel.bounds)


def _written(value: float, _: int | None) -> str:
    """A number on an axis, by itself: nothing is put apart at the end of the axis."""
    return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")


def _point_ahead(axes: Axes, panel: _Panel, scene: Scene) -> None:
    tip = _tip(panel, scene)
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, 1.1 * tip), min(top, 1.1 * tip), auto=True)
    arrow = {"arrowstyle": "-|>", "color": "k", "linewidth": 1.0, "shrinkA": 0.0, "shrinkB": 0.0}
    at = scene.radius - panel.view.origin[0]
    axes.annotate("", (at, tip), (at, 0.0), arrowprops=arrow)


def _name(axes: Axes, panel: _Panel, scene: Scene) -> None:
    """The names of the shapes, at their fish."""
    labels = []
    for k, cable in enumerate(panel.cables):
        across, down = panel.view.of(cable.points)[:, -1]
        labels.append(Label(cable.name, across, down, "0.4" if k else "k"))
    at = scene.radius - panel.view.origin[0]
    arrow = [([at, at], [0.0, _tip(panel, scene)])]
    place_labels(axes, labels, [] if panel.view.side else arrow)


def _title(answer: SceneAnswer) -> str:
    scene = answer.scene
    return (
        f"{fill(scene.title or scene.source, LINE)}\n{scene.speed:.5g} m/s, {scene.speed / KNOT:.5g} kn, "
        f"{scene.rpm_of(abs(scene.gamma)):.5g} rpm; {answer.choice.model} model"
    )


def _handles(scene: Scene, side: _Panel) -> list[Line2D]:
    main, *others = side.cables
    nodes = "no node" if main.nodes == 0 else f"{main.nodes} node{'s' if main.nodes > 1 else ''}"
    name = f"{main.name}, expected, {nodes}" if others else f"{main.name}, {nodes}"
    handles = [Line2D([], [], color="#31688e", linewidth=2.2, label=name)]
    handles += [Line2D([], [], **OTHER, label="other shapes")] if others else []
    handles += [
        Line2D([], [], **TOW, label="tow point, arrow ahead"),
        Line2D([], [], **FISH, label="fish" if scene.fish_mass else "end of the cable"),
        Line2D([], [], **CIRCLE, label="towing circle"),
        Line2D([], [], **CENTRE, label="axis, from above"),
    ]
    return handles + ([Line2D([], [], **AXIS, label="axis, from the side")] if side.view.axis else [])
