"""What the page cannot compute itself, as JSON: every branch of a scene over its speed, what lasts, and its shapes."""

from base64 import b64encode
from dataclasses import asdict
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience
from towatlas.results import Equilibria
from towatlas.results_motion import Branch
from towatlas.scene.diagrams import SceneDiagram, scene_diagram, to_starboard
from towatlas.scene.models import system_of
from towatlas.scene.scene import Scene
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.seen import Stretch
from towatlas.solve.shapes import shape_of

Array = NDArray[np.float64]

# Speeds of the table, as shares of that of the scene.
RANGE = (0.25, 2.0)
# Points along a shape; samples of a branch to a shape, before there are more where they change fast, to this share of
# the speed, and fewer where they do not.
POINTS, COARSE, CLOSEST = 49, 8, 1e-3
# Within which share of its width, length and largest tension a shape is told by those beside it: the width of a line.
TOLD = 5e-3
# A shape is one of a branch if log r_f is as near as this, and that of any other so many times as far.
LIKE, CLEAR = 0.1, 5.0
# Whole numbers of two bytes, to the largest.
STEPS = 32767
# Of a scene, by the vacuum.
NEEDED = ("title", "length", "mass_per_length", "fish_mass", "radius", "speed", "gravity", "density")
# Digits of samples: a thousandth of a picture.
DIGITS = 6


def table_of(scene: Scene, model: str | None = None) -> dict[str, Any]:
    """Branches of a scene over its speed, what of them lasts, and their shapes, for the page.

    Parameters
    ----------
    scene : Scene
        With a length.
    model : str, optional
        As of `towatlas.scene.diagrams.scene_diagram`.

    Returns
    -------
    dict
        For JSON, in SI. `scene`: what the vacuum needs, and what tells how much it leaves out. `branches`: samples,
        points where a branch begins, changes and ends, and `shapes` at some of the speeds: x, y, z and tension at 49
        points evenly along the cable from the tow point down, as base64 of little-endian int16 over 32767: x and y in
        units of `width`, z in those of the length, tensions in those of the largest of each. `rising`, `falling`: what
        is seen.

    Raises
    ------
    ValueError
        If the scene has no length.
    ArithmeticError
        If shapes cannot be computed, or the work takes longer than `towatlas.patience` allows (TooMuchWork).
    """
    if not isfinite(scene.length):
        raise ValueError(f"{scene.source}: cable.length is missing: the page draws one cable")
    ends = (RANGE[0] * scene.speed, RANGE[1] * scene.speed)
    found = scene_diagram(scene, speed=ends, model=model)
    shapes = _Shapes(scene, found.model)
    return {
        "name": Path(scene.source).stem,
        "scene": {
            name: None if (value := getattr(scene, name)) != value else value
            for name in (*NEEDED, "displaced_per_length", "diameter", "drag_coefficient")
        },
        "model": found.model,
        "turn": scene.turn,
        "low": found.low,
        "high": found.high,
        "complete": found.complete,
        "looked_at": found.looked_at,
        "branches": [_branch(branch, shapes) for branch in found.branches],
        "rising": _seen(found, found.rising()),
        "falling": _seen(found, found.falling()),
    }


def _seen(found: SceneDiagram, parts: list[Any]) -> list[dict[str, Any]]:
    return [
        {"what": "stretch" if isinstance(part, Stretch) else "jump"}
        | {name: _plain(value) for name, value in asdict(part).items()}
        for part in parts
    ]


def _branch(branch: Branch, shapes: "_Shapes") -> dict[str, Any]:
    samples = {
        name: _plain(getattr(branch, name)) for name in ("value", "r_f", "z_f", "tension", "growth", "frequency")
    }
    return {
        "name": branch.name,
        **samples,
        "nodes": branch.nodes.tolist(),
        "points": [{name: _plain(value) for name, value in asdict(point).items()} for point in branch.points],
        "between": list(branch.between),
        "shapes": shapes.along(branch),
    }


def _plain(value: Any) -> Any:
    """Numbers of a few digits; None for nan, which JSON has not."""
    if isinstance(value, np.ndarray):
        return [_plain(one) for one in value.tolist()]
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}") if isfinite(value) else None
    return value


class _Shapes:
    """Shapes of one scene by one model, at its speeds: x, y, z [m] and tension [N], shape (4, points)."""

    def __init__(self, scene: Scene, model: str) -> None:
        self.scene = scene
        self.system, _ = to_starboard(system_of(scene, model), scene.gamma)
        self.force = scene.force_unit(model)
        self.known: dict[float, Equilibria] = {}

    def along(self, branch: Branch) -> dict[str, Any]:
        """Shapes at some of the speeds of a branch, such that those between them are told by the two next to them."""
        coarse = branch.value[np.unique(np.r_[0 : len(branch.value) : COARSE, len(branch.value) - 1])].tolist()
        found = {speed: curve for speed in coarse if (curve := self._at(branch, speed)) is not None}
        for low, high in pairwise(sorted(found)):
            self._refine(branch, low, high, found)
        speeds = np.array(sorted(found))
        curves = np.array([found[speed] for speed in speeds.tolist()])
        kept = told(speeds, curves, TOLD * self._sizes(curves))
        width, largest = float(np.abs(curves[kept, :2]).max()), curves[kept, 3].max(axis=1)
        units = np.stack(np.broadcast_arrays(width, width, self.scene.length, largest), axis=1)
        whole = np.round(curves[kept] / units[:, :, None] * STEPS).astype("<i2")
        return {
            "value": speeds[kept].tolist(),
            "width": width,
            "largest": _plain(largest),
            "points": POINTS,
            "packed": b64encode(whole.tobytes()).decode("ascii"),
        }

    def _refine(self, branch: Branch, low: float, high: float, found: dict[float, Array]) -> None:
        """More shapes between two speeds, until the middle one is told by those beside it."""
        middle = 0.5 * (low + high)
        if high - low < CLOSEST * high or (curve := self._at(branch, middle)) is None:
            return
        found[middle] = curve
        off = np.abs(0.5 * (found[low] + found[high]) - curve)
        if (off > TOLD * self._sizes(curve[None])[0]).any():
            self._refine(branch, low, middle, found)
            self._refine(branch, middle, high, found)

    def _sizes(self, curves: Array) -> Array:
        """What is small beside each of the curves, shape (curves, 4, 1): width, length, largest tension."""
        width, largest = np.abs(curves[:, :2]).max(axis=(1, 2)), curves[:, 3].max(axis=1)
        sizes = np.broadcast_arrays(width, width, self.scene.length, largest)
        return np.stack(sizes, axis=1)[:, :, None]

    def _at(self, branch: Branch, speed: float) -> Array | None:
        """The shape of a branch; None where two are as near, as next to a fold."""
        check_patience("drawing shapes", "a scene at a lower speed takes less")
        if speed not in self.known:
            self.known[speed] = solve_equilibria(self.system, abs(self.scene.at(speed=speed).gamma))
        found, radius = self.known[speed], self.scene.radius
        far = np.abs(np.log(found.r_f * radius / np.interp(speed, branch.value, branch.r_f)))
        order = np.argsort(far)
        if not len(order) or far[order[0]] > LIKE or (len(order) > 1 and far[order[1]] < CLEAR * far[order[0]]):
            return None
        curve = shape_of(found, int(order[0]), np.linspace(0.0, self.system.lam, POINTS))
        # The mirror image of a turn to port is turned back.
        y = curve.y.values * (-1.0 if self.scene.turn == "port" else 1.0)
        return np.array([curve.x * radius, y * radius, curve.z * radius, curve["T"] * self.force])


def told(value: Array, curves: Array, within: Array) -> list[int]:
    """Which curves tell the others by straight lines between neighbours.

    Parameters
    ----------
    value : ndarray, shape (curves,)
        Rising.
    curves : ndarray, shape (curves, ...)
    within : ndarray
        By how much numbers of what is left out may be off, > 0; of a shape that broadcasts with that of the curves.

    Returns
    -------
    list of int
        The first and the last among them.
    """
    within = np.broadcast_to(within, curves.shape)
    kept, first = [0], 0
    while first < len(value) - 1:
        last = len(value) - 1
        while last > first + 1:
            inside = slice(first + 1, last)
            share = (value[inside] - value[first]) / (value[last] - value[first])
            share = share.reshape(-1, *[1] * (curves.ndim - 1))
            line = curves[first] + share * (curves[last] - curves[first])
            if (np.abs(line - curves[inside]) <= within[inside]).all():
                break
            last -= 1
        kept.append(last)
        first = last
    return kept
