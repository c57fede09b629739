"""The least of the models of the report's Table 1 that answers for a scene.

A model is kept if its answers are those of every larger one within the scene's tolerance. The next larger one alone
would not do: to a cable towed slowly in water drag adds nothing, buoyancy much.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from math import inf, isfinite, isnan, nan

import numpy as np
from numpy.typing import NDArray

from towatlas.scene.model_folds import ModelFolds, model_folds
from towatlas.scene.scene import MODELS, Groups, Scene, check_model
from towatlas.solve.drag_equilibria import DragEquilibria
from towatlas.solve.equilibria import Equilibria, equilibria, vacuum_equilibria

# What may be asked about a scene. Critical speeds go with the number of equilibria, which tells folds passed.
QUESTIONS = ("nodes", "position", "tension", "speeds")

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ModelAnswer:
    """What one model answers about a scene, in SI.

    groups : dimensionless. equilibria : dimensionless. expected : which of them is expected to be seen, the median root
    or, with drag, the one nearest to the axis; nodes, position (x, y, z) [m] and tension [N] are its own. folds : of
    the pairs asked for, dimensionless speeds.
    """

    model: str
    groups: Groups
    equilibria: Equilibria | DragEquilibria
    expected: int
    nodes: int
    position: Array
    tension: float
    folds: ModelFolds

    @property
    def number(self) -> int:
        """How many equilibria there are."""
        return len(self.equilibria)


@dataclass(frozen=True)
class Difference:
    """One quantity by two models.

    question : one of QUESTIONS. quantity : in words. by_smaller, by_larger : values, in `unit`; of a position its
    distance from the tow point; inf where a critical speed does not exist, nan where it is not known. relative :
    difference, nan where none can be given. agrees : within the tolerance; whole numbers agree if they are the same,
    and what is not known does not agree.
    """

    smaller: str
    larger: str
    question: str
    quantity: str
    unit: str
    by_smaller: float
    by_larger: float
    relative: float
    agrees: bool

    @property
    def words(self) -> str:
        """The difference as a percentage, or the two values where it has none."""
        if isfinite(self.relative):
            return percent(self.relative)
        values = (self.by_smaller, self.by_larger)
        return ", ".join("none" if v == inf else "not known" if v != v else f"{v:.4g}" for v in values)


@dataclass(frozen=True)
class Choice:
    """The model used, and why.

    forced : whether it was named. tolerance : of the comparisons, relative. asked : of QUESTIONS. answers : of each
    model that was solved, in rising order. differences : between them. untried : models left out for want of keys.
    """

    model: str
    forced: bool
    tolerance: float
    asked: tuple[str, ...]
    answers: tuple[ModelAnswer, ...]
    differences: tuple[Difference, ...]
    untried: tuple[str, ...]

    @property
    def answer(self) -> ModelAnswer:
        """The answer of the model used."""
        return next(answer for answer in self.answers if answer.model == self.model)

    @property
    def reason(self) -> str:
        """Why this model, with the numbers, in one sentence."""
        if self.forced:
            return f"{self.model} was asked for, and compared with no other"
        if len(self.answers) == 1:
            return "towed in a vacuum there is nothing to add"
        place = [answer.model for answer in self.answers].index(self.model)
        parts = [self._objection(answer.model) for answer in self.answers[:place]]
        larger = [answer.model for answer in self.answers[place + 1 :]]
        if larger:
            parts.append(f"{self.model} agrees with {' and '.join(larger)} within {100 * self.tolerance:g} %")
            if (most := self.largest(self.model)) is not None:
                parts[-1] += f", at most {percent(most.relative)} in the {most.quantity}"
        else:
            parts.append(f"{self.model} is the largest model that the scene has the keys for")
        parts += [f"{name} was not tried: it needs fish.volume or fish.submerged_weight" for name in self.untried]
        return "; ".join(parts)

    def largest(self, smaller: str) -> Difference | None:
        """The largest relative difference of a model from larger ones, None where none was compared."""
        finite = [d for d in self.differences if d.smaller == smaller and isfinite(d.relative)]
        return max(finite, key=lambda d: d.relative, default=None)

    def _objection(self, smaller: str) -> str:
        """What a model differs in from the first larger one that it does not agree with."""
        unlike = [d for d in self.differences if d.smaller == smaller and not d.agrees]
        larger = unlike[0].larger
        words = ", ".join(f"{d.quantity} ({d.words})" for d in unlike if d.larger == larger)
        return f"{smaller} differs from {larger} in {words}"


def percent(share: float) -> str:
    """Two digits, or all before the point."""
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.0f} %"


def check_questions(asked: Sequence[str]) -> tuple[str, ...]:
    """Some of QUESTIONS, in their order, or ValueError."""
    unknown = [name for name in asked if name not in QUESTIONS]
    if unknown or not asked:
        raise ValueError(f"asked must be some of {', '.join(QUESTIONS)}; got {', '.join(unknown) or 'none'}")
    return tuple(name for name in QUESTIONS if name in asked)


def solvable_models(scene: Scene) -> tuple[list[str], list[str]]:
    """Models whose groups the scene gives, and those that lack a key; in a vacuum there is one."""
    if scene.density == 0.0:
        return ["vacuum"], []
    known = [model for model in MODELS if not any(isnan(value) for value in astuple(scene.groups(model)))]
    return known, [model for model in MODELS if model not in known]


def solve_model(scene: Scene, model: str, orders: Sequence[int] = (), vacuum: Sequence[float] = ()) -> ModelAnswer:
    """What one model answers about a scene.

    Parameters
    ----------
    scene : Scene
    model : str
    orders : sequence of int
        Pairs of equilibria whose critical speeds are asked for.
    vacuum : sequence of float
        Those speeds by the vacuum model, dimensionless.

    Raises
    ------
    ValueError
        If this model has no such cable, as one that floats without a fish.
    ArithmeticError
        If the computation overflows or does not converge.
    """
    groups = scene.groups(check_model(model))
    unit = scene.force_unit(model)
    if model == "vacuum":
        bare = vacuum_equilibria(groups.lam, groups.w_f, groups.gamma)
        k = int(np.flatnonzero(bare.median)[0])
        found: Equilibria | DragEquilibria = bare
        y_f = 0.0
        folds = ModelFolds.of_vacuum(orders, vacuum)
    else:
        found = equilibria(groups.lam, groups.w_f, groups.gamma, groups.C, groups.m_f, groups.C_f, groups.w)
        if isinstance(found, DragEquilibria):
            k = int(np.flatnonzero(found.near_axis)[0])
            y_f = float(found.y_f[k])
            folds = model_folds(groups, orders)
        else:
            # A fluid without drag and buoyancy.
            k, y_f = int(np.flatnonzero(found.median)[0]), 0.0
            folds = ModelFolds.of_vacuum(orders, vacuum)
    return ModelAnswer(
        model=model,
        groups=groups,
        equilibria=found,
        expected=k,
        nodes=int(found.nodes[k]),
        position=np.array([found.x_f[k], y_f, found.z_f[k]]) * scene.radius,
        tension=float(found.tension[k]) * unit,
        folds=folds,
    )


def compare(smaller: ModelAnswer, larger: ModelAnswer, scene: Scene, orders: Sequence[int]) -> list[Difference]:
    """All quantities of two models; critical speeds of the pairs given.

    The position is compared as a share of the slant range, from the tow point to the fish by the larger model: as
    errors of positions taken from the tow point are stated, and never small beside the cable. Tension and speeds are
    shares of the larger model's.
    """

    def difference(question: str, quantity: str, unit: str, a: float, b: float) -> Difference:
        relative = abs(a / b - 1.0) if isfinite(a) and isfinite(b) and unit else nan
        # Two speeds that do not exist agree; nan, not known, agrees with nothing.
        agrees = bool(a == b or relative <= scene.tolerance)
        return Difference(smaller.model, larger.model, question, quantity, unit, a, b, relative, agrees)

    tow_point = np.array([scene.radius, 0.0, 0.0])
    near, slant = (float(np.linalg.norm(answer.position - tow_point)) for answer in (smaller, larger))
    moved = float(np.linalg.norm(smaller.position - larger.position)) / slant
    found = [
        difference("nodes", "number of nodes", "", smaller.nodes, larger.nodes),
        Difference(
            smaller=smaller.model,
            larger=larger.model,
            question="position",
            quantity="position of the fish",
            unit="m",
            by_smaller=near,
            by_larger=slant,
            relative=moved,
            agrees=bool(moved <= scene.tolerance),
        ),
        difference("tension", "tow tension", "N", smaller.tension, larger.tension),
        difference("speeds", "number of equilibria", "", smaller.number, larger.number),
    ]
    for n in orders:
        a, b = (scene.speed_of(answer.folds.gamma(n)) for answer in (smaller, larger))
        found.append(difference("speeds", f"critical speed {n}", "m/s", a, b))
    return found


def least_model(
    scene: Scene,
    model: str | None = None,
    asked: Sequence[str] = QUESTIONS,
    orders: Sequence[int] = (),
    vacuum: Sequence[float] = (),
    compared: Sequence[int] = (),
) -> Choice:
    """The least model whose answers to what is asked are those of all larger ones within the scene's tolerance.

    Parameters
    ----------
    scene : Scene
        With a length.
    model : str, optional
        The model to use whatever the others say; they are not solved.
    asked : sequence of str
        Some of QUESTIONS.
    orders, vacuum
        See `solve_model`.
    compared : sequence of int
        Those of `orders` that are compared.

    Raises
    ------
    ValueError
        For names out of range, and if one of the models has no such cable.
    ArithmeticError
        If a computation overflows or does not converge.
    """
    asked = check_questions(asked)
    known, untried = ([check_model(model)], []) if model is not None else solvable_models(scene)
    missing = [name for name, value in vars(scene.groups(known[-1])).items() if isnan(value)]
    if missing:
        raise ValueError(f"the {known[-1]} model needs {', '.join(missing)}, for which keys of the scene are missing")
    with_speeds = "speeds" in asked
    orders = orders if with_speeds else ()
    answers = [_solved(scene, name, orders, vacuum, len(known) > 1) for name in known]
    return choose(scene, answers, asked, compared if with_speeds else (), model is not None, untried)


def choose(
    scene: Scene,
    answers: Sequence[ModelAnswer],
    asked: Sequence[str],
    compared: Sequence[int] = (),
    forced: bool = False,
    untried: Sequence[str] = (),
) -> Choice:
    """The first of some answers, of models in rising order, that agrees with all after it in what is asked."""
    differences = [
        difference
        for place, smaller in enumerate(answers)
        for larger in answers[place + 1 :]
        for difference in compare(smaller, larger, scene, compared)
        if difference.question in asked
    ]
    unlike = {difference.smaller for difference in differences if not difference.agrees}
    return Choice(
        model=next(answer.model for answer in answers if answer.model not in unlike),
        forced=forced,
        tolerance=scene.tolerance,
        asked=tuple(asked),
        answers=tuple(answers),
        differences=tuple(differences),
        untried=tuple(untried),
    )


def _solved(scene: Scene, model: str, orders: Sequence[int], vacuum: Sequence[float], compared: bool) -> ModelAnswer:
    try:
        return solve_model(scene, model, orders, vacuum)
    except (ValueError, ArithmeticError) as error:
        hint = "; a smaller one named by --model answers without it" if compared and model != "vacuum" else ""
        raise type(error)(f"the {model} model has no answer: {error}{hint}") from None
