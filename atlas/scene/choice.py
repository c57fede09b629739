"""The least of the models of the report's Table 1 that answers for a scene.

A model is kept if its answers are those of every larger one within the scene's tolerance. The next larger one alone
would not do: to a cable towed slowly in water drag adds nothing, buoyancy much.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, isnan, nan

import numpy as np

from towatlas.effort import TooMuchWork
from towatlas.kernels import status
from towatlas.results import Folds
from towatlas.scene.models import (
    QUESTIONS,
    Finder,
    ModelAnswer,
    check_questions,
    solvable_models,
    solve_jumps,
    solve_model,
)
from towatlas.scene.scene import Scene, check_model


@dataclass(frozen=True)
class Difference:
    """One quantity by two models.

    Attributes
    ----------
    smaller, larger : str
        The models, of MODELS.
    question : str
        One of QUESTIONS.
    quantity : str
        In words.
    unit : str
        Of the values: "m", "N", "m/s"; empty for whole numbers.
    by_smaller, by_larger : float
        The values; of a position its distance from the tow point. nan where a status says why.
    relative : float
        Their difference [-], >= 0; nan where none can be given.
    agrees : bool
        Within the tolerance. Whole numbers agree if they are the same, jumps if neither exists; what is not known does
        not agree.
    status_smaller, status_larger : int
        Codes of `towatlas.kernels.status`.
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
    status_smaller: int = status.OK
    status_larger: int = status.OK

    @property
    def words(self) -> str:
        """The difference as a percentage, or the two values where it has none."""
        if isfinite(self.relative):
            return percent(self.relative)
        return ", ".join(self.values("{:.4g}"))

    def values(self, form: str) -> tuple[str, str]:
        """Both values in words.

        Parameters
        ----------
        form : str
            How numbers are formatted, as "{:.4g}".

        Returns
        -------
        by_smaller, by_larger : str
            "none" for what there is not between the speeds looked at, "not known" for what could not be had.
        """
        by_smaller, by_larger = (
            form.format(value) if code == status.OK else "none" if code == status.NOT_FOUND else "not known"
            for value, code in ((self.by_smaller, self.status_smaller), (self.by_larger, self.status_larger))
        )
        return by_smaller, by_larger


@dataclass(frozen=True)
class Choice:
    """The model used, and why.

    Attributes
    ----------
    model : str
        One of MODELS.
    forced : bool
        Whether it was named.
    tolerance : float
        Of the comparisons, relative [-], > 0.
    asked : tuple of str
        Of QUESTIONS.
    answers : tuple of ModelAnswer
        Of each model that was solved, in rising order; one at least.
    differences : tuple of Difference
        Between them.
    untried : dict of str
        Models left out, and why.
    """

    model: str
    forced: bool
    tolerance: float
    asked: tuple[str, ...]
    answers: tuple[ModelAnswer, ...]
    differences: tuple[Difference, ...]
    untried: dict[str, str]

    @property
    def answer(self) -> ModelAnswer:
        """The answer of the model used."""
        return next(answer for answer in self.answers if answer.model == self.model)

    @property
    def reason(self) -> str:
        """Why this model, with the numbers, in one sentence."""
        if self.forced:
            return f"{self.model} was asked for, and compared with no other"
        if len(self.answers) == 1 and not self.untried:
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
        parts += [f"{name} was not tried: {why}" for name, why in self.untried.items()]
        return "; ".join(parts)

    def largest(self, smaller: str) -> Difference | None:
        """The largest relative difference of a model from larger ones.

        Parameters
        ----------
        smaller : str
            The model.

        Returns
        -------
        Difference or None
            None where none was compared.
        """
        finite = [d for d in self.differences if d.smaller == smaller and isfinite(d.relative)]
        return max(finite, key=lambda d: d.relative, default=None)

    def _objection(self, smaller: str) -> str:
        """What a model differs in from the first larger one that it does not agree with."""
        unlike = [d for d in self.differences if d.smaller == smaller and not d.agrees]
        larger = unlike[0].larger
        words = ", ".join(f"{d.quantity} ({d.words})" for d in unlike if d.larger == larger)
        return f"{smaller} differs from {larger} in {words}"


def percent(share: float) -> str:
    """A share as a percentage: two digits, or all before the point.

    Parameters
    ----------
    share : float
        [-], >= 0.

    Returns
    -------
    str

    Examples
    --------
    >>> percent(0.01234), percent(2.5)
    ('1.2 %', '250 %')
    """
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{100.0 * share:.0f} %"


def compare(smaller: ModelAnswer, larger: ModelAnswer, scene: Scene) -> list[Difference]:
    """All quantities of two models; where both looked for jumps, the nearest below and above the speed, too.

    Parameters
    ----------
    smaller, larger : ModelAnswer
    scene : Scene
        Whose tolerance decides.

    Returns
    -------
    list of Difference

    Notes
    -----
    The position is compared as a share of the slant range, from the tow point to the fish by the larger model: as
    errors of positions taken from the tow point are stated, and never small beside the cable. Tension and speeds are
    shares of the larger model's.
    """

    def difference(question: str, quantity: str, unit: str, a: float, b: float, relative: float) -> Difference:
        agrees = a == b if isnan(relative) else relative <= scene.tolerance
        return Difference(smaller.model, larger.model, question, quantity, unit, a, b, relative, bool(agrees))

    tow_point = np.array([scene.radius, 0.0, 0.0])
    near, slant = (float(np.linalg.norm(answer.position - tow_point)) for answer in (smaller, larger))
    moved = float(np.linalg.norm(smaller.position - larger.position)) / slant
    pulled = abs(smaller.tension / larger.tension - 1.0)
    found = [
        difference("nodes", "number of nodes", "", smaller.nodes, larger.nodes, nan),
        difference("position", "position of the fish", "m", near, slant, moved),
        difference("tension", "tow tension", "N", smaller.tension, larger.tension, pulled),
        difference("speeds", "number of equilibria", "", smaller.number, larger.number, nan),
    ]
    if smaller.folds is not None and larger.folds is not None:
        found += [_jump_difference(smaller, larger, scene, above) for above in (False, True)]
    return found


def _nearest(folds: Folds, gamma: float, above: bool) -> tuple[float, int]:
    """The jump next to a speed, and a status: NOT_FOUND where there is none between the speeds looked at."""
    if not folds.complete:
        return nan, status.NOT_CONVERGED
    jumps = np.abs(folds.gamma)
    beyond = jumps[jumps > abs(gamma)] if above else jumps[jumps <= abs(gamma)]
    if not len(beyond):
        return nan, status.NOT_FOUND
    return float(beyond.min() if above else beyond.max()), status.OK


def _jump_difference(smaller: ModelAnswer, larger: ModelAnswer, scene: Scene, above: bool) -> Difference:
    """The jump next to the speed by two models; two that do not exist agree, one that is not known with nothing."""
    assert smaller.folds is not None
    assert larger.folds is not None
    (a, code_a), (b, code_b) = (_nearest(folds, scene.gamma, above) for folds in (smaller.folds, larger.folds))
    known = code_a == code_b == status.OK
    relative = abs(a / b - 1.0) if known else nan
    return Difference(
        smaller=smaller.model,
        larger=larger.model,
        question="speeds",
        quantity=f"jump {'above' if above else 'below'}",
        unit="m/s",
        by_smaller=scene.speed_of(a),
        by_larger=scene.speed_of(b),
        relative=relative,
        agrees=relative <= scene.tolerance if known else code_a == code_b == status.NOT_FOUND,
        status_smaller=code_a,
        status_larger=code_b,
    )


def least_model(
    scene: Scene,
    model: str | None = None,
    asked: Sequence[str] = QUESTIONS,
    looked: tuple[float, float] | None = None,
    vacuum: Folds | None = None,
    find: Finder = solve_jumps,
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
    looked : (float, float), optional
        Speeds between which jumps are looked for [-]; without it none are.
    vacuum : Folds, optional
        Those of the vacuum model, if they are known.
    find : callable
        What finds jumps.

    Returns
    -------
    Choice

    Raises
    ------
    ValueError
        For names out of range, and if one of the models has no such cable.
    ArithmeticError
        If a computation overflows or does not converge.
    """
    asked = check_questions(asked)
    known, untried = ([check_model(model)], []) if model is not None else solvable_models(scene)
    missing = scene.system(known[-1]).missing
    if missing:
        raise ValueError(f"the {known[-1]} model needs {', '.join(missing)}, for which keys of the scene are missing")
    if "speeds" not in asked:
        looked = None
    left_out = dict.fromkeys(untried, "it needs fish.volume or fish.submerged_weight")
    answers = []
    for name in known:
        try:
            answers.append(_solved(scene, name, looked, vacuum, find, len(known) > 1))
        except TooMuchWork as error:
            # A larger model may have fewer shapes, and shorter shots.
            if name == known[-1]:
                raise
            left_out[name] = f"it takes too long: {error}"
    return choose(scene, answers, asked, model is not None, left_out)


def choose(
    scene: Scene,
    answers: Sequence[ModelAnswer],
    asked: Sequence[str],
    forced: bool = False,
    untried: Mapping[str, str] | None = None,
) -> Choice:
    """The first of some answers that agrees with all after it in what is asked.

    Parameters
    ----------
    scene : Scene
    answers : sequence of ModelAnswer
        Of models in rising order.
    asked : sequence of str
        Some of QUESTIONS.
    forced : bool
        Whether the model was named.
    untried : mapping of str, optional
        Models left out, and why.

    Returns
    -------
    Choice
    """
    differences = [
        difference
        for place, smaller in enumerate(answers)
        for larger in answers[place + 1 :]
        for difference in compare(smaller, larger, scene)
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
        untried=dict(untried or {}),
    )


def _solved(
    scene: Scene,
    model: str,
    looked: tuple[float, float] | None,
    vacuum: Folds | None,
    find: Finder,
    compared: bool,
) -> ModelAnswer:
    try:
        return solve_model(scene, model, looked, vacuum, find)
    except TooMuchWork:
        raise
    except (ValueError, ArithmeticError) as error:
        hint = "; a smaller one named by --model answers without it" if compared and model != "vacuum" else ""
        raise type(error)(f"the {model} model has no answer: {error}{hint}") from None
