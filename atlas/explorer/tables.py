"""What the page cannot compute itself, as JSON: every branch of a scene over its speed, what lasts, and its shapes."""

from base64 import b64encode
from dataclasses import asdict
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
# Points along a shape, and shapes along a branch before those are left out that their neighbours tell.
POINTS, SHAPES = 49, 64
# Within which share of the width and the length of all shapes of a branch they have to tell it: the width of a line.
TOLD = 4e-3
# Whole numbers of two bytes, to the largest.
STEPS = 32767
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
        For JSON, in SI. `scene`: what the vacuum needs. `branches`: samples, points where a branch begins, changes and
        ends, and `shapes` at some of the speeds: x, y, z and tension at 49 points evenly along the cable from the tow
        point down, as base64 of little-endian int16 over 32767: x and y in units of `width`, z in those of the length,
        tensions in those of the largest of each. `rising`, `falling`: what is seen.

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
            name: getattr(scene, name)
            for name in ("title", "length", "mass_per_length", "fish_mass", "radius", "speed", "gravity", "density")
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
    """Shapes of one scene by one model, at its speeds."""

    def __init__(self, scene: Scene, model: str) -> None:
        self.scene = scene
        self.system, _ = to_starboard(system_of(scene, model), scene.gamma)
        self.force = scene.force_unit(model)
        self.known: dict[float, Equilibria] = {}

    def along(self, branch: Branch) -> dict[str, Any]:
        """Shapes at some of the speeds of a branch, such that those between them are told by the two next to them."""
        rows = np.unique(np.linspace(0, len(branch.value) - 1, SHAPES).round().astype(int))
        speeds, columns = [], []
        for k in rows:
            curve = self._at(float(branch.value[k]), float(branch.r_f[k]))
            if curve is not None:
                speeds.append(float(branch.value[k]))
                columns.append(curve)
        curves = np.array(columns)
        width, largest = float(np.abs(curves[:, :2]).max()), curves[:, 3].max(axis=1)
        curves[:, :2] /= width
        curves[:, 2] /= self.scene.length
        curves[:, 3] /= largest[:, None]
        kept = told(np.array(speeds), curves, TOLD)
        whole = np.round(curves[kept] * STEPS).astype("<i2")
        return {
            "value": [speeds[k] for k in kept],
            "width": width,
            "largest": _plain(largest[kept]),
            "points": POINTS,
            "packed": b64encode(whole.tobytes()).decode("ascii"),
        }

    def _at(self, speed: float, r_f: float) -> Array | None:
        """x, y, z [m] and tension [N] of the shape whose fish is there; None where another is nearer, as at a fold."""
        check_patience("drawing shapes", "a narrower range takes less")
        if speed not in self.known:
            self.known[speed] = solve_equilibria(self.system, abs(self.scene.at(speed=speed).gamma))
        found = self.known[speed]
        far = np.abs(np.log(found.r_f * self.scene.radius / r_f))
        if not len(far) or far.min() > 1e-3:
            return None
        curve = shape_of(found, int(far.argmin()), np.linspace(0.0, self.system.lam, POINTS))
        # The mirror image of a turn to port is turned back.
        y = curve.y.values * (-1.0 if self.scene.turn == "port" else 1.0)
        radius = self.scene.radius
        return np.array([curve.x * radius, y * radius, curve.z * radius, curve["T"] * self.force])


def told(value: Array, curves: Array, within: float) -> list[int]:
    """Which curves tell the others by straight lines between neighbours.

    Parameters
    ----------
    value : ndarray, shape (curves,)
        Rising.
    curves : ndarray, shape (curves, ...)
    within : float
        By how much a coordinate of what is left out may be off, > 0.

    Returns
    -------
    list of int
        The first and the last among them.
    """
    kept, first = [0], 0
    while first < len(value) - 1:
        last = len(value) - 1
        while last > first + 1:
            share = (value[first + 1 : last] - value[first]) / (value[last] - value[first])
            share = share.reshape(-1, *[1] * (curves.ndim - 1))
            line = curves[first] + share * (curves[last] - curves[first])
            if np.abs(line - curves[first + 1 : last]).max() <= within:
                break
            last -= 1
        kept.append(last)
        first = last
    return kept
