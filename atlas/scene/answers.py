"""What is asked about a scene: its critical speeds, its shapes, and the cables that bring the fish to a depth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_one
from towatlas.kernels import status
from towatlas.limits import transitions
from towatlas.scene.models import QUESTIONS, Choice, least_model
from towatlas.scene.scene import Scene
from towatlas.solve.critical import solve_critical
from towatlas.solve.depths import Placements, cables_to_depth
from towatlas.solve.drag_equilibria import DragEquilibria
from towatlas.solve.equilibria import Equilibria
from towatlas.tables.critical import Atlas

# A jump is near where its speed is within this share of the scene's.
NEAR = 0.1
# Transitions listed at least, and asked for at a time.
BLOCK = 6
# What the model of a design is chosen for: where the fish hangs.
DESIGN_QUESTIONS = ("nodes", "position", "tension")
# Cables are searched up to this many times the way from the tow point to the depth wanted, below the centre.
LONGEST = 10.0

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Jumps:
    """Critical speeds of one cable, in rising order; arrays of shape (transitions,). nan and a status where it failed.

    n : number. gamma : dimensionless. error : estimated relative error. looked_up : in an atlas, otherwise solved.
    status : codes of `towatlas.kernels.status`. existing : how many transitions the cable has in all.
    """

    n: NDArray[np.int64]
    gamma: Array
    error: Array
    looked_up: NDArray[np.bool_]
    status: NDArray[np.int8]
    existing: int

    def near(self, gamma: float) -> NDArray[np.bool_]:
        """Which are within 10 % of a speed."""
        return np.abs(self.gamma / gamma - 1.0) <= NEAR

    def nearest(self, gamma: float) -> int:
        """Row of the nearest one, -1 where there is none."""
        known = np.isfinite(self.gamma)
        return int(np.argmin(np.where(known, np.abs(self.gamma - gamma), np.inf))) if known.any() else -1


@dataclass(frozen=True)
class SceneAnswer:
    """A scene's critical speeds in a vacuum, the model chosen for it and what that one answers.

    jumps : dimensionless, by the vacuum model. choice : the model used and why, with its answers in SI.
    """

    scene: Scene
    jumps: Jumps
    choice: Choice

    @property
    def equilibria(self) -> Equilibria | DragEquilibria:
        """Those of the model used, dimensionless, as its groups."""
        return self.choice.answer.equilibria


@dataclass(frozen=True)
class Design:
    """Cables that put the fish of a scene at one depth; lengths in rising order.

    cables : all of them, up to the longest searched. chosen : those within the radius asked for. jumps : of each cable
    the critical speeds about the scene's speed. longest : [m].
    """

    scene: Scene
    depth: float
    max_radius: float
    longest: float
    cables: Placements
    chosen: NDArray[np.bool_]
    jumps: list[Jumps]

    @property
    def median(self) -> NDArray[np.bool_]:
        """Which of the cables have their median root there, the shape that is expected to be seen."""
        passed = np.array([int(np.sum(jumps.gamma < self.scene.gamma)) for jumps in self.jumps], int)
        return (self.cables.nodes == passed) & ~self.cables.outer

    def choices(self, model: str | None = None) -> dict[int, Choice]:
        """The least model for nodes, position and tension of each cable chosen that is a median one, by row.

        Parameters, errors as `towatlas.scene.models.least_model`.
        """
        return {
            int(k): least_model(
                replace(self.scene, length=float(self.cables.lam[k]) * self.scene.radius),
                model,
                DESIGN_QUESTIONS,
            )
            for k in np.flatnonzero(self.chosen & self.median)
        }


def critical_speeds(
    lam: float,
    w_f: float,
    gamma: float,
    atlas: Atlas | None = None,
) -> Jumps:
    """Critical speeds of a cable, the lowest six and on, until they leave a speed behind by 10 %.

    Parameters
    ----------
    lam, w_f, gamma : float
        The cable and the speed, dimensionless.
    atlas : Atlas, optional
        Where they are looked up if it holds them; what it does not hold is solved directly.
    """
    existing = transitions(lam, w_f)
    parts: list[dict[str, NDArray]] = []
    first = 1
    while first <= existing:
        n = np.arange(first, min(first + BLOCK, existing + 1))
        parts.append(_block(lam, w_f, n, atlas))
        highest = parts[-1]["gamma"][-1]
        # One that fails lies at its threshold, where critical speeds are boundless.
        if not highest <= gamma * (1.0 + NEAR):
            break
        first += BLOCK
    columns = {
        name: np.concatenate([part[name] for part in parts]) if parts else np.empty(0, kind)
        for name, kind in (("n", int), ("gamma", float), ("error", float), ("looked_up", bool), ("status", np.int8))
    }
    return Jumps(**columns, existing=existing)


def _block(lam: float, w_f: float, n: NDArray[np.int64], atlas: Atlas | None) -> dict[str, NDArray]:
    names = ("gamma", "error", "status")
    if atlas is None:
        there = np.zeros(len(n), bool)
        columns = {name: np.empty(len(n), np.int8 if name == "status" else float) for name in names}
    else:
        states = atlas.states(lam, w_f, n, outside="nan")
        there = states.status != status.OUTSIDE
        columns = {name: getattr(states, name).copy() for name in names}
    if not there.all():
        solved = solve_critical(lam, w_f, n[~there])
        for name in names:
            columns[name][~there] = getattr(solved, name)
    return {"n": n, "looked_up": there, **columns}


def answer_scene(
    scene: Scene,
    atlas: Atlas | None = None,
    model: str | None = None,
    asked: Sequence[str] = QUESTIONS,
) -> SceneAnswer:
    """Critical speeds and equilibria of a scene, by the least model that answers what is asked.

    Parameters
    ----------
    scene : Scene
    atlas : Atlas, optional
        Where critical speeds are looked up if it holds them.
    model, asked
        See `towatlas.scene.models.least_model`.

    Raises
    ------
    ValueError
        If the scene has no length, or one of the models no such cable.
    ArithmeticError
        If the computation overflows or does not converge.

    Examples
    --------
    >>> from towatlas.scene.file import read_scene
    >>> answer = answer_scene(read_scene("skop-fig3"), model="vacuum")
    >>> answer.equilibria.nodes[answer.equilibria.median]
    array([1])
    """
    groups = scene.groups("vacuum")
    if not np.isfinite(groups.lam):
        raise ValueError(f"{scene.source}: cable.length is missing; a design finds one: towatlas design --help")
    jumps = critical_speeds(groups.lam, groups.w_f, groups.gamma, atlas)
    passed = int(np.sum(jumps.gamma < groups.gamma))
    # The pairs that decide where the cable jumps, as it slows down and speeds up; one more should the second be gone.
    there = (jumps.n >= passed) & (jumps.n <= passed + 2)
    choice = least_model(
        scene,
        model,
        asked,
        orders=jumps.n[there].tolist(),
        vacuum=jumps.gamma[there].tolist(),
        compared=[n for n in (passed, passed + 1) if n in jumps.n],
    )
    return SceneAnswer(scene=scene, jumps=jumps, choice=choice)


def longest_searched(scene: Scene, depth: float, max_length: float | None = None) -> float:
    """Longest cable [m] that a design looks at."""
    return LONGEST * float(np.hypot(depth, scene.radius)) if max_length is None else check_one("length", max_length)


def design(
    scene: Scene,
    depth: float,
    max_radius: float = np.inf,
    max_length: float | None = None,
    atlas: Atlas | None = None,
) -> Design:
    """Cable lengths that put the fish at a depth, by the vacuum model; the length of the scene is not used.

    Parameters
    ----------
    scene : Scene
    depth : float
        Below the plane of the towing circle [m], > 0.
    max_radius : float
        How far from the axis the fish may be [m], > 0.
    max_length : float, optional
        Longest cable searched [m]; without it 10 times the distance from the tow point to the axis at that depth.
    atlas
        See `critical_speeds`.

    Returns
    -------
    Design
        All cables found, also those outside the radius.

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If the computation overflows or does not converge.
    """
    depth = check_one("depth", depth)
    if not max_radius > 0.0:
        raise ValueError(f"max_radius must be positive, got {max_radius:g}")
    longest = longest_searched(scene, depth, max_length)
    groups = scene.groups("vacuum")
    cables = cables_to_depth(groups.w_f, groups.gamma, depth / scene.radius, longest / scene.radius)
    return Design(
        scene=scene,
        depth=depth,
        max_radius=max_radius,
        longest=longest,
        cables=cables,
        chosen=np.abs(cables.x_f) * scene.radius <= max_radius,
        jumps=[critical_speeds(float(lam), groups.w_f, groups.gamma, atlas) for lam in cables.lam],
    )
