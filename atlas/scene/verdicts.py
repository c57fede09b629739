"""Which shapes of a scene last, and how fast the others are left."""

from dataclasses import dataclass
from math import isfinite, nan, pi, sqrt

import numpy as np

from towatlas.effort import at_most
from towatlas.kernels import status
from towatlas.results import Equilibria
from towatlas.scene.jumps import SceneAnswer
from towatlas.scene.models import system_of, with_drag
from towatlas.scene.scene import MODELS, Scene, patient_with
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.stability import looked_at, spectrum_of

# Of the patience with a scene; the shapes themselves stand without.
SHARE = 0.2
WORDS = {
    "stable": "stable",
    "divergence": "left without turning back",
    "flutter": "flutters",
    "weak": "grows weakly",
    "unknown": "not known",
}


@dataclass(frozen=True)
class Verdict:
    """What becomes of a small push to one shape.

    Attributes
    ----------
    kind : str
        As of `towatlas.results_motion.Stability`.
    growth : float
        Of the leading eigenvalue [1/s]; nan where reason says why.
    frequency : float
        Of the same [Hz], >= 0.
    error : float
        Estimated absolute error of growth [1/s], > 0.
    unstable : int
        Number of eigenvalues that grow, >= 0; -1 if not counted.
    code : int
        Of `towatlas.kernels.status`.
    reason : str
        Why they were not counted; else empty.
    """

    kind: str
    growth: float
    frequency: float
    error: float
    unstable: int
    code: int
    reason: str

    @property
    def words(self) -> str:
        """In words, with the time in which a push grows or shrinks by e."""
        text = WORDS[self.kind]
        if self.growth and isfinite(self.growth):
            turning = f" at {self.frequency:.4g} Hz" if self.frequency else ""
            larger = "larger" if self.growth > 0.0 else "smaller"
            text += f", e times {larger} in {1.0 / abs(self.growth):.4g} s{turning}"
        elif self.growth == 0.0 and self.frequency:
            text += f", swings at {self.frequency:.4g} Hz, which nothing damps"
        return f"{text} ({self.reason})" if self.reason else text


@dataclass(frozen=True)
class Verdicts:
    """Which shapes of a scene last.

    Attributes
    ----------
    shapes : tuple of Verdict
        In the order of the equilibria of the model used.
    by_larger : dict of Verdict
        Of the shape expected by each larger model that was solved.
    looked_at : str
        Which growth rates were looked for.
    """

    shapes: tuple[Verdict, ...]
    by_larger: dict[str, Verdict]
    looked_at: str


def rate_unit(scene: Scene) -> float:
    """What growth rates are divided by.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    float
        sqrt(g/R) [1/s].
    """
    return sqrt(scene.gravity / scene.radius)


def verdict_of(scene: Scene, found: Equilibria, k: int) -> Verdict:
    """What becomes of a small push to one shape; what cannot be had in time is said, and nothing is raised.

    Parameters
    ----------
    scene : Scene
    found : Equilibria
        Of it, by one of its models.
    k : int
        Which of them.

    Returns
    -------
    Verdict
    """
    try:
        answer = spectrum_of(found, k)
    except (ArithmeticError, np.linalg.LinAlgError) as reason:
        return Verdict("unknown", nan, nan, nan, -1, status.NOT_COUNTED, str(reason))
    unit = abs(found.gamma) * rate_unit(scene)
    return Verdict(
        kind=answer.kind,
        growth=answer.leading.real * unit,
        frequency=answer.leading.imag * unit / (2.0 * pi),
        error=answer.error * unit,
        unstable=answer.counted,
        code=answer.status,
        reason="" if answer.status == status.OK else status.SENTENCES[answer.status],
    )


def verdict_with_drag(scene: Scene, model: str, found: Equilibria, k: int) -> Verdict:
    """What becomes of a small push to one shape, in a fluid by a model with drag, if that has the same shape.

    Parameters
    ----------
    scene : Scene
    model : str
        By which the shape was found, one of MODELS.
    found : Equilibria
    k : int
        Which of them.

    Returns
    -------
    Verdict
        Not known where the model with drag has no such shape within the scene's tolerance.
    """
    other = with_drag(scene, model)
    if other == model:
        return verdict_of(scene, found, k)
    try:
        larger = solve_equilibria(system_of(scene, other), scene.gamma)
    except ArithmeticError as error:
        return Verdict("unknown", nan, nan, nan, -1, status.NOT_COUNTED, str(error))
    here = np.array([found.x_f[k], found.y_f[k], found.z_f[k]])
    apart = np.linalg.norm(np.stack([larger.x_f, larger.y_f, larger.z_f], axis=1) - here, axis=1)
    at = int(np.argmin(apart))
    if not apart[at] <= scene.tolerance * np.linalg.norm(here - [1.0, 0.0, 0.0]):
        reason = f"the {other} model has no such shape, and nothing damps in the {model} model"
        return Verdict("unknown", nan, nan, nan, -1, status.NOT_COUNTED, reason)
    return verdict_of(scene, larger, at)


def verdicts_of(answer: SceneAnswer) -> Verdicts:
    """Which shapes of a scene last, by the model that answers it, the shape expected by larger ones, too.

    Parameters
    ----------
    answer : SceneAnswer
        From `towatlas.answer_scene`.

    Returns
    -------
    Verdicts

    Notes
    -----
    A fifth of the patience is used at most, for the shape expected first; what is not reached has the kind "unknown".

    Examples
    --------
    >>> from towatlas import answer_scene, read_scene
    >>> found = verdicts_of(answer_scene(read_scene("skop-fig3").at(gamma=5.94), model="air"))
    >>> [shape.kind for shape in found.shapes], round(1.0 / found.shapes[1].growth, 3)
    (['divergence', 'flutter', 'stable'], 0.283)
    """
    scene, found = answer.scene, answer.equilibria
    order = sorted(range(len(found)), key=lambda k: k != found.expected)
    with patient_with(scene), at_most(SHARE):
        shapes = {k: verdict_of(scene, found, k) for k in order[:1]}
        larger = [one for one in answer.choice.answers if MODELS.index(one.model) > MODELS.index(answer.choice.model)]
        by_larger = {one.model: verdict_of(scene, one.equilibria, one.equilibria.expected) for one in larger}
        shapes |= {k: verdict_of(scene, found, k) for k in order[1:]}
    return Verdicts(tuple(shapes[k] for k in range(len(found))), by_larger, looked_at(found))
