"""Where the text's cable has several shapes: in water without drag along the cable, and behind an aircraft."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from towatlas.report.cable_body.systems import (
    FIRST,
    KNOT,
    NORMAL,
    RADIUS,
    TANGENTIAL,
    Curve,
    curve_of,
    cusp_in_drag,
    folds_in_length,
    hysteresis,
    make_system,
    strength,
    without_inertia,
)
from towatlas.scene.file import make_scene
from towatlas.scene.models import solve_model

Array = NDArray[np.float64]
# Radii [ft] of the systems of 5 kn and 250 lbf that are looked at.
RADII, FAST = (2000.0, RADIUS, 6000.0, 10000.0), 5.0
# Beyond Table 1: speed [kn] and a tangential coefficient as of stranded cables, 0.02 of the normal one.
FASTER, STRANDED = 7.0, 0.025
# Of the jump: length over tow radius; of the air: speeds [kn] and coefficients along the cable.
JUMP_RATIO = 2.69
AIR_SPEEDS, AIR_TANGENTIAL = (100.0, 150.0, 200.0, 250.0), (0.0, 0.02, TANGENTIAL)
AIR_DRAWN = 200.0


@dataclass(frozen=True)
class Window:
    """Lengths over the tow radius between which a system has three shapes.

    Attributes
    ----------
    radius, speed : float
        Of the tow point [ft, kn].
    tangential : float
        Drag coefficient along the cable [-].
    fluid : str
    strength : float
        Of the drag, as of `towatlas.report.cable_body.systems.strength`.
    folds : ndarray, shape (folds,)
        Empty where there is one shape at every length.
    """

    radius: float
    speed: float
    tangential: float
    fluid: str
    strength: float
    folds: Array


@dataclass(frozen=True)
class Jump:
    """Where the body goes when its shape ends as the speed changes.

    Attributes
    ----------
    speed : float
        [kn].
    depth, radius : tuple of two float
        Of the body before and after [km].
    rising : bool
        Whether the speed rises.
    """

    speed: float
    depth: tuple[float, float]
    radius: tuple[float, float]
    rising: bool


@cache
def window(radius: float, speed: float, tangential: float, fluid: str = "seawater") -> Window:
    """Where a system with the lightest body has three shapes.

    Parameters
    ----------
    radius, speed, tangential, fluid
        As of `towatlas.report.cable_body.systems.make_system`.

    Returns
    -------
    Window
    """
    scene = make_system(radius, speed, FIRST, tangential=tangential, fluid=fluid)
    found = folds_in_length(scene.system("water"), scene.gamma)
    return Window(radius, speed, tangential, fluid, strength(scene), found)


@cache
def window_without_inertia(radius: float) -> Array:
    """The window of a system at 5 kn without drag along the cable, were there no centrifugal force.

    Parameters
    ----------
    radius : float
        [ft].

    Returns
    -------
    ndarray, shape (folds,)
    """
    return folds_in_length(*without_inertia(make_system(radius, FAST, FIRST, tangential=0.0)))


@cache
def cusp(radius: float) -> tuple[float, float]:
    """Length over tow radius and coefficient along the cable at which the window of a system at 5 kn closes.

    Parameters
    ----------
    radius : float
        [ft].

    Returns
    -------
    tuple of two float
    """
    return cusp_in_drag(make_system(radius, FAST, FIRST))


@cache
def small_window() -> Array:
    """The window of a small system: 300 m and 1.5 m/s, a cable of 10 mm, a body of 10 N in water.

    Returns
    -------
    ndarray, shape (folds,)
    """
    cable = {"mass_per_length": 0.11, "diameter": 0.01, "drag_coefficient": NORMAL, "length": 300.0}
    along = {"tangential_drag_coefficient": STRANDED, "tangential_drag_on": "d"}
    fish = {"mass": 1.5, "submerged_weight": 10.0, "drag_coefficient": 0.0}
    tow = {"radius": 300.0, "speed": 1.5}
    scene = make_scene({"cable": cable | along, "fish": fish, "tow": tow, "fluid": {"name": "seawater"}})
    return folds_in_length(scene.system("water"), scene.gamma)


@cache
def jumps() -> tuple[tuple[Jump, ...], tuple[str, ...]]:
    """Jumps of the largest system as its speed rises and falls, and where the folds come from.

    Returns
    -------
    tuple of Jump
    tuple of str
        "drag" or "vacuum", of each.
    """
    scene = make_system(RADII[-1], FAST, FIRST, tangential=0.0, ratio=JUMP_RATIO)
    found, speeds = hysteresis(scene, 3.0, FASTER)
    made = []
    for k, speed in enumerate(speeds):
        # Below the first fold and above the second there is one shape.
        rising = bool(found.shapes_above[k] < found.shapes_below[k])
        beyond = solve_model(scene.at(speed=speed * KNOT * (1.0 + (1e-7 if rising else -1e-7))), "water").equilibria
        at = solve_model(scene.at(speed=speed * KNOT * (1.0 - (1e-7 if rising else -1e-7))), "water").equilibria
        before = int(np.argmin(np.abs(at.r_f - found.r_f[k])))
        km = scene.radius / 1000.0
        depth = float(at.z_f[before]) * km, float(beyond.z_f[0]) * km
        made.append(Jump(float(speed), depth, (float(at.r_f[before]) * km, float(beyond.r_f[0]) * km), rising))
    return tuple(made), tuple(str(origin) for origin in found.origin)


def bent_curve(tangential: float) -> Curve:
    """Shapes of the largest system at 5 kn about its window, close to each other.

    Parameters
    ----------
    tangential : float

    Returns
    -------
    Curve
    """
    scene = make_system(RADII[-1], FAST, FIRST, tangential=tangential)
    # Where the folds meet the curve is upright.
    steps = np.geomspace(1e-5, 1e-2, 16)
    upright = cusp(RADII[-1])[0] + np.concatenate([-steps, steps])
    ratios = np.union1d(np.linspace(2.3, 3.1, 61), upright)
    return curve_of(scene, _closer(ratios, window(RADII[-1], FAST, tangential).folds))


def air_curve(tangential: float) -> Curve:
    """Shapes of the text's cable behind an aircraft.

    Parameters
    ----------
    tangential : float

    Returns
    -------
    Curve
    """
    scene = make_system(RADIUS, AIR_DRAWN, FIRST, tangential=tangential, fluid="air")
    return curve_of(scene, _closer(np.linspace(2.0, 7.0, 91), window(RADIUS, AIR_DRAWN, tangential, "air").folds))


def _closer(ratios: Array, folds: Array) -> Array:
    """With more of them within a window, and close to its ends, where the curve turns."""
    if len(folds) != 2:
        return ratios
    low, high = folds
    part = 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, 51)[1:-1]))
    return np.union1d(ratios, low + (high - low) * part)
