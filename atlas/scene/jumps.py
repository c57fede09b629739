"""The jumps of a scene: its critical speeds, and the shapes between them, by the least model that answers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.effort import check_foreseen, check_patience
from towatlas.kernels import status
from towatlas.labelled import Answer
from towatlas.limits import transitions
from towatlas.results import Equilibria, Folds
from towatlas.scene.angles import Angles, angles_along, extrapolation
from towatlas.scene.choice import Choice, least_model
from towatlas.scene.models import QUESTIONS, Finder, solve_jumps
from towatlas.scene.scene import Scene, patient_with
from towatlas.scene.shapes import shape_in_si
from towatlas.solve.critical import SECONDS_A_HALF_WAVE, solve_critical
from towatlas.solve.folds import name_folds
from towatlas.solve.members import REMEDY
from towatlas.solve.passed import guess_passed
from towatlas.tables.atlas import Atlas
from towatlas.tables.critical import CriticalTable

if TYPE_CHECKING:
    import xarray

# A jump is near where its speed is within this share of the scene's.
NEAR = 0.1
# Jumps with drag are looked for between these shares of the speed.
LOOKED = (1.0 / 30.0, 3.0)
# Transitions listed at least, and asked for at a time.
BLOCK = 6

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class Jumps(Answer):
    """Critical speeds of one cable in a vacuum, in rising order.

    Attributes
    ----------
    n : ndarray of int, shape (transitions,)
        Number of the transition [-], >= 1.
    gamma : ndarray, shape (transitions,)
        Speed Omega sqrt(R/g) [-], > 0; nan where status says why.
    error : ndarray, shape (transitions,)
        Estimated relative error of gamma [-], > 0.
    looked_up : ndarray of bool, shape (transitions,)
        In an atlas; else solved.
    status : ndarray of int8, shape (transitions,)
        Codes of `towatlas.kernels.status`.
    existing : int
        How many transitions the cable has in all, >= 0.
    """

    DIMENSION: ClassVar[str] = "transition"

    n: NDArray[np.int64]
    gamma: Array
    error: Array
    looked_up: NDArray[np.bool_]
    status: NDArray[np.int8]
    existing: int

    def near(self, gamma: float) -> NDArray[np.bool_]:
        """Which are within 10 % of a speed.

        Parameters
        ----------
        gamma : float
            [-], > 0.

        Returns
        -------
        ndarray of bool, shape (transitions,)
        """
        return np.abs(self.gamma / gamma - 1.0) <= NEAR


@dataclass(frozen=True, repr=False)
class SceneAnswer:
    """A scene, the model chosen for it and what that one answers.

    Attributes
    ----------
    scene : Scene
        What was asked about.
    jumps : Jumps or None
        Critical speeds by the vacuum model, dimensionless; None where another model is used and that one not compared.
    choice : Choice
        The model used and why, with its answers in SI.
    folds : Folds or None
        All jumps of the model used between the speeds looked at, dimensionless; None where none were asked for.
    angles : list of Angles or None
        Between cable and stream in each equilibrium; None where it is not said where the cable was measured.
    """

    scene: Scene
    jumps: Jumps | None
    choice: Choice
    folds: Folds | None
    angles: list[Angles | None]

    def __repr__(self) -> str:
        held = {"jumps": self.jumps, "folds": self.folds, "equilibria": self.equilibria}
        parts = [f"SceneAnswer to {self.scene.title!r}: {self.choice.reason}"]
        parts += [f"{name}: {value!r}" for name, value in held.items() if value is not None]
        return "\n".join(parts)

    @property
    def notes(self) -> list[str]:
        """What whoever asks should know: of the scene, what no model looked at, where laws are extrapolated."""
        notes = [*self.scene.notes, *self.scene.not_given(self.choice.model)]
        largest = self.choice.answers[-1].model
        # What a larger model confirmed is known to do nothing.
        if self.scene.density and (keys := self.scene.left_out.get(largest)):
            notes.append(f"the {largest} model leaves out {', '.join(keys)}")
        if text := extrapolation(self.scene, self.angles[self.equilibria.expected]):
            notes.append(text)
        return notes

    @property
    def equilibria(self) -> Equilibria:
        """Those of the model used, dimensionless."""
        return self.choice.answer.equilibria

    def shape(self, root: str | int = "expected", s: ArrayLike | None = None) -> "xarray.Dataset":
        """Shape, forces and tension of one of the equilibria, in SI.

        Parameters
        ----------
        root : str or int
            Which, as in `towatlas.shape`: "expected", the name of a branch, or a row of the equilibria.
        s : array_like, optional
            Arc lengths from the tow point [m], from 0 to the length of the cable in any order; 401 of them, evenly
            spaced, by default.

        Returns
        -------
        xarray.Dataset
            As of `towatlas.shape`: x, y, z [m], R_x, R_y, R_z, T [N] over the coordinate s [m], and s_node, z_node [m].
            Attributes: the scene, the model and its groups, branch, nodes, whether it is expected, the position of the
            fish, tension and reaction at the tow point, and error.

        Raises
        ------
        ValueError
            For a root that does not exist, and arc lengths off the cable.
        ArithmeticError
            If the computation overflows.

        Examples
        --------
        >>> from towatlas.scene.file import read_scene
        >>> curve = answer_scene(read_scene("skop-fig3"), model="vacuum").shape(s=[0.0, 0.6604])
        >>> [round(float(x), 4) for x in curve.x], curve.x.attrs["units"]
        ([0.0175, -0.0008], 'm')
        """
        return shape_in_si(self.scene, self.choice.model, self.equilibria, root, s)


def critical_speeds(*, lam: float, w_f: float, gamma: float, atlas: Atlas | None = None) -> Jumps:
    """Critical speeds of a cable, the lowest six and on, until they leave a speed behind by 10 %.

    Parameters
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-].
    atlas : Atlas, optional
        Where they are looked up if it holds them; what it does not hold is solved directly.

    Returns
    -------
    Jumps
    """
    existing = transitions(lam=lam, w_f=w_f)
    cable = {"lam": np.array([lam]), "w_f": np.array([w_f])}
    listed = min(existing, int(guess_passed(**cable, gamma=np.array([gamma * (1.0 + NEAR)]))[0]))
    # Each is solved by itself, on shots of as many half waves as its number.
    check_foreseen(0.5 * SECONDS_A_HALF_WAVE * listed**2, f"{listed:,} critical speeds below the speed", REMEDY)
    parts: list[dict[str, NDArray]] = []
    first = 1
    while first <= existing:
        check_patience("critical speeds below the speed", REMEDY, done=first - 1, of=max(listed, first - 1))
        n = np.arange(first, min(first + BLOCK, existing + 1))
        parts.append(_block(n, lam=lam, w_f=w_f, atlas=atlas))
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


def _block(n: NDArray[np.int64], *, lam: float, w_f: float, atlas: Atlas | None) -> dict[str, NDArray]:
    names = ("gamma", "error", "status")
    if atlas is None or CriticalTable.holds not in atlas.holds:
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
    compare: bool = False,
    find: Finder = solve_jumps,
) -> SceneAnswer:
    """Jumps and equilibria of a scene, by the least model that answers what is asked.

    Parameters
    ----------
    scene : Scene
        From `towatlas.read_scene`, with a length.
    atlas : Atlas, optional
        Where critical speeds are looked up if it holds them.
    model : str, optional
        The model to use whatever the others say, one of "vacuum", "air", "water"; by default the least.
    asked : sequence of str
        What it has to answer, some of "nodes", "position", "tension", "speeds".
    compare : bool
        Whether critical speeds by the vacuum model are wanted whatever the model used.
    find : callable
        What finds jumps with drag, (system, slow, fast) to Folds; by default they are solved for.

    Returns
    -------
    SceneAnswer

    Raises
    ------
    ValueError
        If the scene has no length, or one of the models no such cable.
    ArithmeticError
        If the computation overflows, does not converge, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Examples
    --------
    >>> from towatlas.scene.file import read_scene
    >>> answer = answer_scene(read_scene("skop-fig3"), model="vacuum")
    >>> int(answer.equilibria.nodes[answer.equilibria.expected])
    1
    """
    if not np.isfinite(scene.system("vacuum").lam):
        raise ValueError(f"{scene.source}: cable.length is missing; a design finds one: towatlas design --help")
    with patient_with(scene):
        return _answer(scene, atlas, model, asked, compare, find)


def _answer(
    scene: Scene, atlas: Atlas | None, model: str | None, asked: Sequence[str], compare: bool, find: Finder
) -> SceneAnswer:
    gamma = scene.gamma
    looked = (gamma * LOOKED[0], gamma * LOOKED[1])
    choice = least_model(scene, model, asked, looked, find=find)
    jumps = None
    if compare or choice.model == "vacuum":
        groups = scene.system("vacuum")
        jumps = critical_speeds(lam=groups.lam, w_f=groups.w_f, gamma=abs(gamma), atlas=atlas)
    folds = choice.answer.folds
    found = choice.answer.equilibria
    return SceneAnswer(
        scene=scene,
        jumps=jumps,
        choice=choice,
        folds=None if folds is None else name_folds(folds),
        angles=[angles_along(scene, found, k) for k in range(len(found))],
    )
