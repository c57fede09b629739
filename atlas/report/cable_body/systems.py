"""The systems of the text: its cable and body behind a ship, at its speeds, radii and weights, over the length."""

from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.results import Folds
from towatlas.scene.file import make_scene
from towatlas.scene.scene import Scene
from towatlas.scene.sweeps import sweep
from towatlas.solve.cusps import cusp_equations
from towatlas.solve.folds import folds, solve_folds_between
from towatlas.solve.shots import direction_of
from towatlas.system import System

Array = NDArray[np.float64]
KNOT = 1852.0 / 3600.0  # [m/s]
# Coefficients of the drag across and along the cable, on its diameter.
NORMAL, TANGENTIAL = 1.27, 0.062
# Of the figures: radius [ft], speeds [kn], weights of the body [lbf].
RADIUS, SPEEDS, WEIGHTS = 3000.0, (1.0, 3.0, 5.0), (250.0, 500.0, 1000.0)
FIRST, MIDDLE = WEIGHTS[0], SPEEDS[1]
# Table 1: radii [ft], speeds [kn], weights [lbf].
TABLE_1 = tuple(product((2000.0, 6000.0, 10000.0), SPEEDS, WEIGHTS))
SHORTEST, LONGEST = 0.1, 12.0
# Lengths over the tow radius, closer where curves bend.
COARSE = np.unique(
    np.concatenate([np.geomspace(SHORTEST, 1.0, 16), np.linspace(1.0, 4.0, 31), np.linspace(4, LONGEST, 17)])
)
FINE = np.unique(np.concatenate([np.geomspace(SHORTEST, 1.0, 40), np.linspace(1.0, LONGEST, 111)]))
# Newton's method for a cusp; where it begins in the tangential coefficient.
ROUNDS, LONGEST_STEP, BEGIN = 40, 0.3, 0.01


@dataclass(frozen=True)
class Curve:
    """Shapes of a system over the length of its cable, in the order in which they lie on one curve.

    Attributes
    ----------
    ratio : ndarray, shape (shapes,)
        Length over tow radius [-].
    verticality : ndarray, shape (shapes,)
        Depth of the body over the length [-].
    radius : ndarray, shape (shapes,)
        Distance of the body from the axis over the tow radius [-].
    phase_deg : ndarray, shape (shapes,)
        From the tow point to the body, not wrapped [deg].
    tension : ndarray, shape (shapes,)
        At the tow point over the weight of the cable in air [-].
    folds : ndarray, shape (folds,)
        Ratios at which two shapes meet [-].
    most : int
        Largest number of shapes at one length.
    """

    ratio: Array
    verticality: Array
    radius: Array
    phase_deg: Array
    tension: Array
    folds: Array
    most: int

    def at(self, name: str, ratio: float) -> float:
        """A quantity at one of the lengths computed, where there is one shape.

        Parameters
        ----------
        name : str
            Of a field.
        ratio : float

        Returns
        -------
        float
        """
        (k,) = np.flatnonzero(np.abs(self.ratio - ratio) < 1e-9 * ratio)
        return float(getattr(self, name)[k])

    @property
    def least(self) -> tuple[float, float]:
        """Ratio at which the cable is least vertical, and how vertical it is there, by a parabola."""
        order = np.argsort(self.ratio)
        x, y = self.ratio[order], self.verticality[order]
        k = int(np.clip(np.argmin(y), 1, len(y) - 2))
        p = np.polyfit(x[k - 1 : k + 2] - x[k], y[k - 1 : k + 2], 2)
        off = -0.5 * p[1] / p[0]
        return float(x[k] + off), float(np.polyval(p, off))


def make_system(
    radius: float,
    speed: float,
    weight: float,
    *,
    tangential: float = TANGENTIAL,
    ratio: float = 1.0,
    fluid: str = "seawater",
    cable: dict[str, Any] | None = None,
    turn: str = "starboard",
) -> Scene:
    """The cable and body of the text, as this page reads it.

    Parameters
    ----------
    radius : float
        Of the tow point [ft].
    speed : float
        Of the tow point [kn].
    weight : float
        Of the body in air [lbf].
    tangential : float
        Drag coefficient along the cable, on its diameter [-].
    ratio : float
        Length of the cable over the radius [-].
    fluid : str
    cable : dict, optional
        More keys of the cable.
    turn : {"starboard", "port"}

    Returns
    -------
    Scene
    """
    keys = {
        "length": f"{ratio * radius!r} ft",
        "mass_per_length": "0.3 lb/ft",
        "diameter": "1/2 in",
        "drag_coefficient": NORMAL,
        "tangential_drag_coefficient": tangential,
        "tangential_drag_on": "d",
    }
    return make_scene(
        {
            "cable": keys | (cable or {}),
            "fish": {"mass": f"{weight!r} lb", "diameter": "1.2 ft", "drag_coefficient": 0.2},
            "tow": {"radius": f"{radius!r} ft", "speed": f"{speed!r} kn", "turn": turn},
            "fluid": {"name": fluid},
        }
    )


@cache
def curve(
    radius: float,
    speed: float,
    weight: float,
    tangential: float = TANGENTIAL,
    fluid: str = "seawater",
    fine: bool = False,
) -> Curve:
    """All shapes of a system at lengths from SHORTEST to LONGEST tow radii.

    Parameters
    ----------
    radius, speed, weight, tangential, fluid
        As of `make_system`.
    fine : bool
        Whether for a figure.

    Returns
    -------
    Curve
    """
    return curve_of(make_system(radius, speed, weight, tangential=tangential, fluid=fluid), FINE if fine else COARSE)


def curve_of(scene: Scene, ratios: Array) -> Curve:
    """All shapes of a system at some lengths.

    Parameters
    ----------
    scene : Scene
    ratios : ndarray, shape (lengths,)
        Over the tow radius [-].

    Returns
    -------
    Curve
    """
    found = sweep(scene, length=scene.radius * ratios, model="water").isel(member=0)
    there = np.isfinite(found.radius_ratio.values)
    columns = {name: found[name].values[there] for name in ("y_over_l", "radius_ratio", "phase_deg", "t_over_mgl")}
    ratio = np.broadcast_to(found.length.values[:, None] / scene.radius, there.shape)[there]
    order = _along(found.branch.values[there], ratio)
    return Curve(
        ratio=ratio[order],
        verticality=columns["y_over_l"][order],
        radius=columns["radius_ratio"][order],
        phase_deg=columns["phase_deg"][order],
        tension=columns["t_over_mgl"][order],
        folds=found.jump.values / scene.radius,
        most=int(found.shapes.max()),
    )


def _along(branch: NDArray[np.int64], ratio: Array) -> NDArray[np.int64]:
    """Order in which shapes lie on one curve that turns at folds: outwards on one branch, back on the next."""
    found, first = [], [float(ratio[branch == one].min()) for one in np.unique(branch)]
    last = [float(ratio[branch == one].max()) for one in np.unique(branch)]
    # From the shortest cable to the longest; what is between those two branches is run through backwards.
    for k, one in sorted(enumerate(np.unique(branch)), key=lambda pair: (last[pair[0]] == max(last), first[pair[0]])):
        its = np.flatnonzero(branch == one)
        its = its[np.argsort(ratio[its])]
        ends = first[k] == min(first) or last[k] == max(last)
        found.append(its if ends else its[::-1])
    return np.concatenate(found)


def strength(scene: Scene) -> float:
    """Drag of a length of the cable, across the flow, over its weight in the fluid: C gamma^2 / w.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    float
    """
    system = scene.system("water")
    return system.C * scene.gamma**2 / system.w


def folds_in_length(system: System, gamma: float) -> Array:
    """Lengths over the tow radius at which two shapes meet, from SHORTEST to LONGEST.

    Parameters
    ----------
    system : System
    gamma : float
        Its speed [-].

    Returns
    -------
    ndarray, shape (folds,)
    """
    start = replace(system, lam=SHORTEST)
    return solve_folds_between(start, gamma, ("lam",), LONGEST / SHORTEST, named=False).value


def without_inertia(scene: Scene, factor: float = 1e8) -> tuple[System, float]:
    """A system that turns so slowly that no centrifugal force is left, in a fluid so thick that it has all its drag.

    Parameters
    ----------
    scene : Scene
    factor : float
        By which the square of the speed is divided, and the drag constants are multiplied.

    Returns
    -------
    System
    gamma : float
        Its speed [-].
    """
    system = scene.system("water")
    grown = {name: factor * getattr(system, name) for name in ("C", "C_f", "C_t")}
    return replace(system, **grown), scene.gamma / factor**0.5


def hysteresis(scene: Scene, low: float, high: float) -> tuple[Folds, Array]:
    """Folds between two speeds.

    Parameters
    ----------
    scene : Scene
    low, high : float
        Speeds [kn].

    Returns
    -------
    Folds
    ndarray, shape (folds,)
        Their speeds [kn].
    """
    system, unit = scene.system("water"), scene.gamma / (scene.speed / KNOT)
    keys = {name: getattr(system, name) for name in ("C", "m_f", "C_f", "w", "C_t")}
    found = folds(system.lam, system.w_f, (low * unit, high * unit), **keys)
    return found, found.gamma / unit


def cusp_in_drag(scene: Scene) -> tuple[float, float]:
    """The tangential coefficient above which a system has one shape at every length.

    Parameters
    ----------
    scene : Scene
        Without tangential drag two folds in length.

    Returns
    -------
    ratio : float
        Length over tow radius at which the two folds meet [-].
    tangential : float
        The coefficient, on the diameter [-].

    Raises
    ------
    ArithmeticError
        If Newton's method does not settle.

    Notes
    -----
    log rho, rho the radius at the tow point over the tow radius, and its first two slopes in the logarithm of the place
    of the body vanish; unknown are that place, the length and the coefficient.
    """
    bare = replace(scene.system("water"), lam=SHORTEST, C_t=0.0)
    unit = bare.C / NORMAL
    found = solve_folds_between(bare, scene.gamma, ("lam",), LONGEST / SHORTEST, named=False)
    gamma = np.array([scene.gamma])
    x = np.log(found.r_f * scene.gamma**2).mean()
    z = np.array([x, np.log(found.value).mean(), np.log(BEGIN * unit)])
    for _ in range(ROUNDS):
        row = replace(bare, lam=float(np.exp(z[1])), C_t=float(np.exp(z[2]))).row()[None]
        value, along, made = cusp_equations(z[:1], gamma, row, direction_of(("lam",), row))
        _, aside, _ = cusp_equations(z[:1], gamma, row, direction_of(("C_t",), row))
        if not made.all():
            break
        jacobian = np.stack([along[0][:, 0], along[0][:, 2], aside[0][:, 2]], axis=1)
        step = np.linalg.solve(jacobian, -value[0])
        z = z + step * min(1.0, LONGEST_STEP / float(np.abs(step).max()))
        if np.abs(step).max() < 1e-12:
            return float(np.exp(z[1])), float(np.exp(z[2])) / unit
    raise ArithmeticError(status.SENTENCES[status.NOT_CONVERGED])


def without_apparent_mass(scene: Scene) -> System:
    """The system if the water that a shape moves aside had no inertia: masses alone, weights in water.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    System
    """
    system = scene.system("water")
    share = scene.mass_unit("water") / scene.mass_per_length
    bare = {name: share * getattr(system, name) for name in ("w_f", "C", "C_f", "C_t", "w")}
    mass = scene.fish_mass / (scene.mass_per_length * scene.radius)
    return replace(system, **bare, m_f=mass)
