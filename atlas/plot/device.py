"""Figures of the lateral force device: bifurcations, phase portraits, least turning radii, bearings of two lines."""

from functools import cache
from itertools import pairwise
from math import cos, degrees, hypot

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from towatlas.solve.device.bifurcations import bifurcations
from towatlas.solve.device.cycles import cycles, tension_along
from towatlas.solve.device.flow import Array, evaluate, expand_motion, lanes_of, step_of
from towatlas.solve.device.homoclinics import homoclinics_at_alpha
from towatlas.solve.device.local import Bifurcation, hopf_device, hopf_velocity
from towatlas.solve.device.model import RIGHT_ANGLE, Device, expand
from towatlas.solve.device.points import points, saddle_nodes, velocity
from towatlas.solve.device.tangling import Line, tangle
from towatlas.solve.device.turning import turn

SADDLE_NODE, HOPF, HOMOCLINIC, FOLD, NEUTRAL = "#1f4e9c", "#c2571a", "#2a7f4f", "#a61e3c", "0.55"
COLOURS = ("#a61e3c", "#c2571a", "#b08a1e", "#2a7f4f", "#1f4e9c", "#7a3e9d")
# Where homoclinic orbits are computed for the diagram [rad], and saddle-nodes of cycles too; lines between are
# straight.
WITH_CYCLES = (-1.56, -1.51, -1.46, -1.43, -1.405)
ORBITS_ALONE = (-1.385, -1.38, -1.35, -1.32, -1.28, -1.25)
# What a portrait shows: so many motions from its edges, for so long, in 1/omega.
STARTS, TIME, SAMPLES = 9, 25.0, 10
# Of the chart of least turning radii.
STRENGTHS = (0.5, 1.0, 3.0, 10.0, 30.0, 100.0)


@cache
def global_bifurcations(k: float) -> tuple[Bifurcation, ...]:
    """Homoclinic orbits and saddle-nodes of cycles on some lines of the diagram, some seconds each.

    Parameters
    ----------
    k : float
        [-], > 0

    Returns
    -------
    tuple of Bifurcation
    """
    kinds = ("homoclinic", "cycle-saddle-node")
    found = [one for alpha in WITH_CYCLES for one in bifurcations(k, alpha=alpha) if one.kind in kinds]
    return (*found, *(one for alpha in ORBITS_ALONE for one in homoclinics_at_alpha(Device(k, alpha))))


def local_curves(k: float) -> list[tuple[str, Array, Array]]:
    """Curves of local bifurcations over alpha and R.

    Parameters
    ----------
    k : float
        [-], > 0

    Returns
    -------
    list of (str, ndarray, ndarray)
        Kind, alpha [rad], R [-].
    """
    # Closer to right angles, where R changes as a root.
    alphas = RIGHT_ANGLE * np.sin(np.linspace(-1.0, 1.0, 2001) * RIGHT_ANGLE)[1:-1]
    rows: dict[int, list[tuple[float, float]]] = {0: [], 1: [], 2: []}
    for alpha in alphas:
        device = Device(k, float(alpha))
        places = [(1, x) for x in saddle_nodes(device, 1)] + [(-1, x) for x in saddle_nodes(device, -1)]
        for row, (side, x) in enumerate(places):
            u, w = velocity(device, side, x)
            rows[row].append((float(alpha), hypot(u - 1.0, w)))
    curves = [("saddle-node", *np.array(row).T) for row in rows.values()]
    slopes = -np.geomspace(1e-3, 1e3, 801)
    for sign in (-1, 1):
        kinds, place = [], []
        for p in slopes:
            device, (u, w) = hopf_device(k, float(p)), hopf_velocity(k, float(p), sign)
            kinds.append(expand(device, u, w).b10 < 0.0)
            place.append((device.alpha, hypot(u - 1.0, w)))
        for kind, which in (("hopf", np.array(kinds)), ("neutral-saddle", ~np.array(kinds))):
            if which.any():
                curves.append((kind, *np.where(which, np.array(place).T, np.nan)))
    return curves


def plot_diagram(ax: Axes, k: float = 1.0, *, whole: bool = True) -> list[Artist]:
    """Bifurcation diagram over alpha and R, with regions by their number of fixed points.

    Parameters
    ----------
    ax : Axes
    k : float
        [-], > 0
    whole : bool
        All alpha, or what is near -90 degrees, with homoclinic orbits and cycles.

    Returns
    -------
    list of Artist
    """
    styles = {
        "saddle-node": {"color": SADDLE_NODE, "linewidth": 1.6},
        "hopf": {"color": HOPF, "linewidth": 1.6},
        "neutral-saddle": {"color": NEUTRAL, "linewidth": 1.2, "linestyle": ":"},
    }
    names = {"saddle-node": "saddle-node", "hopf": "Hopf", "neutral-saddle": "neutral saddle, no bifurcation"}
    drawn: list[Artist] = []
    for kind, alpha, R in local_curves(k):
        label = names.pop(kind, "")
        drawn += ax.plot(np.degrees(alpha), R, label=label or "_", **styles[kind])  # type: ignore[arg-type]
    if not whole:
        drawn += _plot_global(ax, k)
    marks = {"degenerate-hopf": "D", "takens-bogdanov": "s", "cusp": "^", "hopf-limit": "o"}
    words = {
        "degenerate-hopf": "degenerate Hopf",
        "takens-bogdanov": "Takens-Bogdanov",
        "cusp": "cusp",
        "hopf-limit": r"$\cos\alpha = 1/3$",
    }
    for one in bifurcations(k):
        label = words.pop(one.kind, "_")
        drawn += ax.plot(degrees(one.alpha), one.R, marks[one.kind], color="0.15", mfc="white", ms=5, label=label)
    ax.set_xlabel(r"$\alpha$ (degrees)")
    ax.set_ylabel("$R$ (line lengths)")
    if whole:
        ax.set_xlim(-92.0, 90.0)
        ax.set_ylim(0.0, 3.2)
        for x, y, count in ((15.0, 0.25, 0), (15.0, 1.5, 2), (-72.0, 1.45, 4)):
            ax.text(x, y, str(count), ha="center", va="center", fontsize=13, color="0.3")
    else:
        ax.set_xlim(-90.0, -65.0)
        ax.set_ylim(0.95, 1.9)
    ax.legend(fontsize=8, loc="upper right" if whole else "lower left")
    return drawn


def _plot_global(ax: Axes, k: float) -> list[Artist]:
    found, special = global_bifurcations(k), bifurcations(k)
    orbits = [one for one in found if one.kind == "homoclinic"]
    # Both curves begin at one radius of -90 degrees; the upper one turns back in alpha, the lower one in R.
    middle = 0.5 * (orbits[0].R + orbits[1].R)
    bogdanov = [one for one in special if one.kind == "takens-bogdanov"]
    upper = sorted((one for one in orbits if middle < one.R), key=lambda one: one.R)
    lower = sorted((one for one in orbits if middle > one.R), key=lambda one: one.alpha) + bogdanov
    folds = [one for one in found if one.kind == "cycle-saddle-node"]
    folds += [one for one in special if one.kind == "degenerate-hopf" and one.physical]
    drawn: list[Artist] = []
    for curve, style in (
        (upper, {"color": HOMOCLINIC, "label": "homoclinic"}),
        (lower, {"color": HOMOCLINIC}),
        (folds, {"color": FOLD, "linestyle": (0, (4, 2)), "label": "saddle-node of cycles"}),
    ):
        place = [degrees(one.alpha) for one in curve], [one.R for one in curve]
        drawn += ax.plot(*place, linewidth=1.4, **style)  # type: ignore[arg-type]
    return drawn


def motion(device: Device, R: float, phi: float, z: float, time: float) -> tuple[Array, Array]:
    """A motion of the device.

    Parameters
    ----------
    device : Device
    R : float
        Turning radius [-].
    phi, z : float
        Where it begins [rad], [-].
    time : float
        How long it is [-]; negative for back in time.

    Returns
    -------
    phi, z : ndarray, shape (samples,)
    """
    lanes, sense, left = lanes_of([device], [R]), np.sign(time), abs(time)
    place, pieces = np.array([[phi], [z]]), []
    while left > 0.0 and abs(place[1, 0]) < 20.0 * (1.0 + R):
        series = expand_motion(lanes, place[0], place[1])
        step = min(left, float(step_of(series)[0]))
        shares = sense * step * np.linspace(0.0, 1.0, SAMPLES)
        pieces.append(evaluate(np.repeat(series[:2], SAMPLES, axis=2), shares))
        place, left = pieces[-1][:, -1:], left - step
    whole = np.concatenate(pieces, axis=1)
    return whole[0], whole[1]


def plot_portrait(ax: Axes, device: Device, R: float, window: tuple[float, float, float, float]) -> list[Artist]:
    """Phase portrait: motions, cycles, manifolds of saddles, fixed points; shaded where the line is slack.

    Parameters
    ----------
    ax : Axes
    device : Device
    R : float
        Turning radius [-].
    window : tuple of four float
        phi from and to [rad], z from and to [-].

    Returns
    -------
    list of Artist
        Of cycles and fixed points.
    """
    low, high, bottom, top = window
    grid = np.meshgrid(np.linspace(low, high, 201), np.linspace(bottom, top, 201))
    force = tension_along(lanes_of([device], [R]), *grid)
    ax.contourf(np.degrees(grid[0]), grid[1], force, levels=[-np.inf, 0.0], colors=["0.92"], zorder=0)
    sides = np.linspace(bottom, top, STARTS)
    for phi, z in [(low, z) for z in sides if z > 0.0] + [(high, z) for z in sides if z < 0.0]:
        ax.plot(*_in_degrees(motion(device, R, phi, z, TIME)), color="0.7", linewidth=0.5, zorder=1)
    drawn: list[Artist] = []
    for point in points(device.k, device.alpha, R):
        first, second = point.eigenvalues
        if first.real > 0.0 > second.real:
            for rate, sense in ((first.real, 1.0), (second.real, -1.0)):
                for side in (1e-4, -1e-4):
                    way = motion(device, R, point.phi + side, side * rate, sense * 1.6 * TIME)
                    ax.plot(*_in_degrees(way), color="0.25", linewidth=0.8, zorder=2, ls="-" if sense > 0 else "--")
        elif low < point.phi < high and first.imag != 0.0:
            ax.plot(*_in_degrees(motion(device, R, point.phi + 0.05, 0.0, TIME)), color="0.7", linewidth=0.5, zorder=1)
        full = point.stable
        drawn += ax.plot(degrees(point.phi), 0.0, "o", ms=5, color="0.1", mfc="0.1" if full else "white", zorder=5)
    for cycle in cycles(device.k, device.alpha, R):
        style = "-" if cycle.stable else (0, (3, 1.5))
        way = motion(device, R, cycle.phi_min, 0.0, cycle.period)
        drawn += ax.plot(*_in_degrees(way), color=FOLD, linewidth=2.0, linestyle=style, zorder=4)
    ax.set_xlim(degrees(low), degrees(high))
    ax.set_ylim(bottom, top)
    return drawn


def _in_degrees(way: tuple[Array, Array]) -> tuple[Array, Array]:
    return np.degrees(way[0]), way[1]


def plot_turns(ax: Axes) -> list[Artist]:
    """Least turning radius over alpha for devices of different strength, and second ranges below it.

    Parameters
    ----------
    ax : Axes

    Returns
    -------
    list of Artist
    """
    alphas = RIGHT_ANGLE * np.sin(np.linspace(-1.0, 1.0, 601) * RIGHT_ANGLE)[1:-1]
    drawn: list[Artist] = []
    for k, colour in zip(STRENGTHS, COLOURS, strict=True):
        found = [turn(k, float(alpha)) for alpha in alphas]
        # A jump where Hopf points begin is no slope.
        least = np.array([one.R_min for one in found])
        least[:-1][np.array([one.kind != other.kind for one, other in pairwise(found)])] = np.nan
        drawn += ax.plot(np.degrees(alphas), least, color=colour, linewidth=1.6, label=f"$k L/m$ = {k:g}")
        second = [one for one in found if len(one.ranges) > 1]
        slants = [degrees(one.alpha) for one in second]
        ends = np.array([one.ranges[1] for one in second])
        drawn.append(ax.fill_between(slants, ends[:, 0], ends[:, 1], color=colour, alpha=0.18, linewidth=0.8))
    limit = [1.0 if alpha <= 0.0 else cos(alpha) for alpha in alphas]
    drawn += ax.plot(np.degrees(alphas), limit, color="0.2", linestyle="--", linewidth=1.0, label=r"$k L/m \to \infty$")
    ax.set_xlim(-90.0, 90.0)
    ax.set_ylim(0.0, 5.0)
    ax.set_yscale("function", functions=(np.sqrt, np.square))
    ax.set_yticks([0.05, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0])
    ax.set_xlabel(r"$\alpha$ (degrees): inwards, outwards")
    ax.set_ylabel("least turning radius (line lengths)")
    ax.grid(color="0.9", linewidth=0.6)
    ax.legend(fontsize=8)
    return drawn


def plot_bearings(ax: Axes, one: Line, other: Line) -> list[Artist]:
    """Angles of two taut lines over the turning radius; where they cross the lines tangle.

    Parameters
    ----------
    ax : Axes
    one, other : Line

    Returns
    -------
    list of Artist
    """
    drawn: list[Artist] = []
    for line, colour, name in ((one, SADDLE_NODE, "first"), (other, HOPF, "second")):
        # Along the sheet of taut lines, from its saddle-node on.
        (least,) = saddle_nodes(line.device, 1)
        for xs, style in ((np.geomspace(1.0, 30.0, 300) * least, "-"), (np.geomspace(0.02, 1.0, 200) * least, "--")):
            places = np.array([velocity(line.device, 1, float(x)) for x in xs])
            R = line.length * np.hypot(places[:, 0] - 1.0, places[:, 1])
            label = f"{name} line, {line.length:g} m" if style == "-" else "_"
            angles = np.degrees(np.arctan2(places[:, 0] - 1.0, places[:, 1]))
            drawn += ax.plot(R, angles, style, color=colour, linewidth=1.6, label=label)
    for found in tangle(one, other):
        if found.physical:
            drawn += ax.plot(found.R, degrees(found.phi), "o", color="0.1", mfc="white", ms=7, zorder=5)
    ax.set_xlim(0.0, 700.0)
    ax.set_xlabel("turning radius (m)")
    ax.set_ylabel(r"$\phi$ (degrees)")
    ax.grid(color="0.9", linewidth=0.6)
    ax.legend(fontsize=8)
    return drawn
