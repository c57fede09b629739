"""What the models of the report's Table 1 answer about a scene."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.results import Equilibria, Folds
from towatlas.scene.scene import MODELS, Scene, check_model
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.folds import folds_in_speed
from towatlas.system import System

# What may be asked about a scene. Critical speeds go with the number of equilibria, which tells folds passed.
QUESTIONS = ("nodes", "position", "tension", "speeds")

Array = NDArray[np.float64]
# Folds of a system between two speeds, the slower first, named or not.
Finder = Callable[[System, float, float], Folds]


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
    folds : Folds or None
        Jumps between the speeds looked at, dimensionless; None where none were asked for. Where they come from may
        not be known.
    """

    model: str
    system: System
    equilibria: Equilibria
    nodes: int
    position: Array
    tension: float
    folds: Folds | None

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


def with_drag(scene: Scene, model: str) -> str:
    """The model, or in a fluid the least with drag: what lasts where nothing damps may not last there.

    Parameters
    ----------
    scene : Scene
    model : str
        One of MODELS.

    Returns
    -------
    str
    """
    known = solvable_models(scene)[0]
    return known[1] if model == "vacuum" and len(known) > 1 else model


def system_of(scene: Scene, model: str) -> System:
    """The groups of a scene by a model, as what is solved.

    Parameters
    ----------
    scene : Scene
    model : str
        One of MODELS.

    Returns
    -------
    System

    Raises
    ------
    ValueError
        If this model has no such cable, as one that nothing holds down or up.
    """
    return System.of(**asdict(scene.system(check_model(model))))


def solve_jumps(system: System, slow: float, fast: float) -> Folds:
    """Folds of a system between two speeds, solved for; where they come from is not found out.

    Parameters
    ----------
    system : System
    slow, fast : float
        [-], of one sign, the slower first.

    Returns
    -------
    Folds
    """
    return folds_in_speed(system, slow, fast, named=False)


def solve_model(
    scene: Scene,
    model: str,
    looked: tuple[float, float] | None = None,
    vacuum: Folds | None = None,
    find: Finder = solve_jumps,
) -> ModelAnswer:
    """What one model answers about a scene.

    Parameters
    ----------
    scene : Scene
    model : str
        One of MODELS.
    looked : (float, float), optional
        Speeds between which jumps are looked for [-]; without it none are.
    vacuum : Folds, optional
        Those of the vacuum model, if they are known.
    find : callable
        What finds the others.

    Returns
    -------
    ModelAnswer

    Raises
    ------
    ValueError
        If this model has no such cable, as one that nothing holds down or up.
    ArithmeticError
        If the computation overflows or does not converge.
    """
    system = system_of(scene, model)
    found = solve_equilibria(system, scene.gamma)
    k = found.expected
    if k < 0:
        raise ArithmeticError(f"no equilibrium was found, or none that is to be expected; searched: {found.searched}")
    jumps = None
    if looked is not None:
        # A fluid without drag and buoyancy is a vacuum.
        jumps = vacuum if system.in_vacuum and vacuum is not None else find(system, *looked)
    return ModelAnswer(
        model=model,
        system=system,
        equilibria=found,
        nodes=int(found.nodes[k]),
        position=np.array([found.x_f[k], found.y_f[k], found.z_f[k]]) * scene.radius,
        tension=float(found.tension[k]) * scene.force_unit(model),
        folds=jumps,
    )
