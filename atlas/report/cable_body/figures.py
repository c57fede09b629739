"""The figures of the text drawn from the program, and those of the systems with several shapes."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from towatlas.plot.sweep import COLOURS
from towatlas.report.cable_body.claims import by_speed, by_weight
from towatlas.report.cable_body.several import (
    AIR_TANGENTIAL,
    FAST,
    JUMP_RATIO,
    RADII,
    air_curve,
    bent_curve,
    cusp,
    jumps,
)
from towatlas.report.cable_body.systems import FIRST, KNOT, TANGENTIAL, Curve, make_system
from towatlas.scene.sweeps import sweep

DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (5, 2, 1, 2)), (0, (2, 1.5)))
NAMES = {
    "verticality": "depth of the body / length",
    "radius": "radius of the body / tow radius",
    "tension": "tension / weight of the cable",
    "phase_deg": "phase (degrees)",
}
RATIO = "length / tow radius"
# Width and height of each figure [in].
SIZES = {"fig3": (8.2, 8.6), "fig4": (8.2, 5.9), "water": (8.2, 3.7), "air": (5.6, 3.7)}


def draw_speeds(drawing: Figure) -> None:
    """Fig. 3: verticality and radius of short and long cables, tension and phase, at three speeds.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """
    curves = {f"{speed:g} kn": one for speed, one in by_speed(fine=True).items()}
    (a, b), (c, d), (e, f) = drawing.subplots(3, 2)
    for ax, name, ends, heights in (
        (a, "verticality", (0.0, 1.0), (0.2, 1.05)),
        (b, "radius", (0.0, 1.0), (0.8, 1.01)),
        (c, "verticality", (1.0, 10.0), (0.2, 1.05)),
        (d, "radius", (1.0, 10.0), (0.0, 1.02)),
        (e, "tension", (0.0, 10.0), (0.0, 3.2)),
        (f, "phase_deg", (0.0, 6.0), (0.0, 265.0)),
    ):
        _panel(ax, curves, name, ends, heights)
    _letters(np.array([a, b, c, d, e, f]))
    f.axhline(250.0, color="0.6", linewidth=0.8, linestyle=(0, (1, 2)))


def draw_weights(drawing: Figure) -> None:
    """Fig. 4: the same with three bodies, on the axes of the text.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """
    curves = {f"{weight:g} lbf": one for weight, one in by_weight(fine=True).items()}
    (a, b), (c, d) = drawing.subplots(2, 2)
    for ax, name, heights in (
        (a, "verticality", (0.4, 1.2)),
        (b, "radius", (0.0, 1.02)),
        (c, "tension", (0.0, 10.0)),
        (d, "phase_deg", (0.0, 265.0)),
    ):
        _panel(ax, curves, name, (0.0, 10.0), heights)
    _letters(np.array([a, b, c, d]))


def draw_water(drawing: Figure) -> None:
    """Shapes of the largest system: over the length with drag along the cable and without, and over the speed.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """
    left, right = drawing.subplots(1, 2)
    closing = cusp(RADII[-1])[1]
    for k, along in enumerate((0.0, closing, 2.0 * closing, TANGENTIAL)):
        one = bent_curve(along)
        label = f"$C_{{DT}}$ = {along:.2g}"
        left.plot(one.ratio, one.radius, color=COLOURS[k], linestyle=DASHES[k], linewidth=1.6, label=label)
    left.set(xlim=(2.3, 3.1), ylim=(0.0, 0.8))
    left.set_xlabel(RATIO)
    left.set_ylabel(NAMES["radius"])
    left.legend(frameon=False, loc="upper right", fontsize=9)
    _draw_jumps(right)
    _letters(np.array([left, right]))


def _draw_jumps(ax: Axes) -> None:
    scene = make_system(RADII[-1], FAST, FIRST, tangential=0.0, ratio=JUMP_RATIO)
    made, _ = jumps()
    low, high = made[0].speed, made[1].speed
    part = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 31)[1:-1]))
    speeds = np.union1d(np.linspace(4.0, 6.0, 41), low + (high - low) * part) * KNOT
    found = sweep(scene, speed=speeds, model="water").isel(member=0)
    there = np.isfinite(found.depth.values)
    speed = np.broadcast_to(found.speed.values[:, None] / KNOT, there.shape)[there]
    depth = found.depth.values[there] / 1000.0
    # Speed is a function of the depth: in this order it is one line, folds and all.
    order = np.argsort(depth)
    ax.plot(speed[order], depth[order], color=COLOURS[0], linewidth=1.6)
    for jump in made:
        ax.annotate(
            "",
            (jump.speed, jump.depth[1]),
            (jump.speed, jump.depth[0]),
            arrowprops={"arrowstyle": "-|>", "color": COLOURS[1], "linewidth": 1.4, "shrinkA": 0, "shrinkB": 0},
        )
        ax.text(
            jump.speed + (0.03 if jump.rising else -0.03),
            0.5 * sum(jump.depth),
            f"{jump.speed:.3f} kn",
            ha="left" if jump.rising else "right",
            color=COLOURS[1],
            fontsize=9,
        )
    ax.set(xlim=(4.0, 6.0), ylim=(6.5, 1.5))
    ax.set_xlabel("speed (kn)")
    ax.set_ylabel("depth of the body (km)")


def draw_air(drawing: Figure) -> None:
    """The same cable behind an aircraft.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """
    ax = drawing.subplots()
    for k, along in enumerate(AIR_TANGENTIAL):
        one = air_curve(along)
        label = f"$C_{{DT}}$ = {along:g}"
        ax.plot(one.ratio, one.radius, color=COLOURS[k], linestyle=DASHES[k], linewidth=1.6, label=label)
    ax.set(xlim=(2.0, 7.0), ylim=(0.0, 1.6))
    ax.set_xlabel(RATIO)
    ax.set_ylabel(NAMES["radius"])
    ax.legend(frameon=False, loc="upper right", fontsize=9)


def _panel(
    ax: Axes, curves: dict[str, Curve], name: str, ends: tuple[float, float], heights: tuple[float, float]
) -> None:
    for k, (label, one) in enumerate(curves.items()):
        ax.plot(one.ratio, getattr(one, name), color=COLOURS[k], linestyle=DASHES[k], linewidth=1.6, label=label)
    ax.set(xlim=ends, ylim=heights)
    ax.set_xlabel(RATIO)
    ax.set_ylabel(NAMES[name])
    ax.legend(frameon=False, fontsize=9)


def _letters(axes: Any) -> None:
    for ax, letter in zip(axes, "abcdef", strict=False):
        ax.set_title(letter, loc="left", fontsize=10, fontweight="bold")
        ax.tick_params(labelsize=9)
        ax.xaxis.label.set_size(9.5)
        ax.yaxis.label.set_size(9.5)
