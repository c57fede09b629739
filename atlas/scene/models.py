"""What the models of the report's Table 1 answer about a scene."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.results import Equilibria
from towatlas.scene.pairs import PairSpeeds, pair_speeds
from towatlas.scene.scene import MODELS, Scene, check_model
from towatlas.solve.equilibria import solve_equilibria
from towatlas.system import System

# What may be asked about a scene. Critical speeds go with the number of equilibria, which tells folds passed.
QUESTIONS = ("nodes", "position", "tension", "speeds")

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModelAnswer:
    """What one model answers about a scene.

    Attributes
    ----------
    model : str
        One of MODELS.
    system : System
        The groups of the scene by this model.
    equilibria : Equilibria
        Dimensionless; nodes, position and tension are those of the one expected.
    nodes : int
        Number of nodes [-], >= 0.
    position : ndarray, shape (3,)
        x, y, z of the fish [m]; the tow point is at (R, 0, 0), z points down from it.
    tension : float
        At the tow point [N], > 0.
    speeds : PairSpeeds
        Of the pairs asked for, dimensionless.
    """

    model: str
    system: System
    equilibria: Equilibria
    nodes: int
    position: Array
    tension: float
    speeds: PairSpeeds

    @property
    def number(self) -> int:
        """How many equilibria there are."""
        return len(self.equilibria)


def check_questions(asked: Sequence[str]) -> tuple[str, ...]:
    """What may be asked about a scene.

    Parameters
    ----------
    asked : sequence of str

    Returns
    -------
    tuple of str
        The same, in the order of QUESTIONS.

    Raises
    ------
    ValueError
        For others, and for none.
    """
    if isinstance(asked, str):
        asked = [asked]
    unknown = [name for name in asked if name not in QUESTIONS]
    if unknown or not asked:
        raise ValueError(f"asked must be some of {', '.join(QUESTIONS)}; got {', '.join(unknown) or 'none'}")
    return tuple(name for name in QUESTIONS if name in asked)


def solvable_models(scene: Scene) -> tuple[list[str], list[str]]:
    """Models whose groups the scene gives, and those that lack a key; in a vacuum there is one.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    known, untried : list of str
    """
    if scene.density == 0.0:
        return ["vacuum"], []
    known = [model for model in MODELS if not scene.system(model).missing]
    return known, [model for model in MODELS if model not in known]


def solve_model(scene: Scene, model: str, vacuum: PairSpeeds | None = None) -> ModelAnswer:
    """What one model answers about a scene.

    Parameters
    ----------
    scene : Scene
    model : str
        One of MODELS.
    vacuum : PairSpeeds, optional
        The pairs whose critical speeds are asked for, by the vacuum model; none by default.

    Returns
    -------
    ModelAnswer

    Raises
    ------
    ValueError
        If this model has no such cable, as one that floats without a fish.
    ArithmeticError
        If the computation overflows or does not converge.
    """
    groups = scene.system(check_model(model))
    system = System.of(groups.lam, groups.w_f, C=groups.C, m_f=groups.m_f, C_f=groups.C_f, w=groups.w)
    found = solve_equilibria(system, scene.gamma)
    k = found.expected
    if k < 0:
        raise ArithmeticError(f"no equilibrium was found, or none that is to be expected; searched: {found.searched}")
    pairs = PairSpeeds.of_vacuum() if vacuum is None else vacuum
    return ModelAnswer(
        model=model,
        system=system,
        equilibria=found,
        nodes=int(found.nodes[k]),
        position=np.array([found.x_f[k], found.y_f[k], found.z_f[k]]) * scene.radius,
        tension=float(found.tension[k]) * scene.force_unit(model),
        # A fluid without drag and buoyancy is a vacuum.
        speeds=pairs if system.in_vacuum else pair_speeds(system, pairs.n),
    )
