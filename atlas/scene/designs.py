"""The cables that bring the fish of a scene to a depth, to a distance from the axis, or to a tension."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_one
from towatlas.effort import TooMuchWork, check_patience
from towatlas.results import Equilibria, Folds
from towatlas.scene.angles import Angles, angles_along, extrapolation
from towatlas.scene.choice import least_model
from towatlas.scene.models import solvable_models, system_of
from towatlas.scene.scene import MODELS, Scene, check_model, patient_with
from towatlas.scene.verdicts import Verdict, verdict_of, verdict_with_drag
from towatlas.solve.depths import cables_to_depth
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.folds import folds_in_speed
from towatlas.solve.lengths import QUANTITIES, cables_for
from towatlas.solve.shots import REMEDY
from towatlas.system import System

# What the model of a design is chosen for: where the fish hangs.
DESIGN_QUESTIONS = ("nodes", "position", "tension")
# Cables are searched up to this many times the way from the tow point to where the fish is wanted, below the centre.
LONGEST = 10.0
# The shortest searched is this share of the longest, if nothing says more.
SHORTEST = 1e-3
# Jumps of a cable are looked for between these shares of the speed.
LOOKED = (0.5, 2.0)
# A shape found by itself is the one meant where quantity and radius of the fish are this near.
NEAR = 1e-6
UNITS = {"depth": "m", "radius": "m", "tension": "N"}

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cable:
    """One cable that does what is wanted.

    Attributes
    ----------
    length : float
        [m], > 0.
    error : float
        Estimated relative error of length [-], > 0; nan by the vacuum model, where it is rounding.
    shape, shapes : int
        Which of the shapes of this cable has the fish there, in rising order of R_x0 from 0, and how many it has.
    expected : bool
        Whether it is the one that is to be expected, as of `Equilibria`.
    nodes : int
        Number of nodes [-], >= 0.
    position : ndarray, shape (3,)
        x, y, z of the fish [m]; the tow point is at (R, 0, 0), z points down from it.
    phase_deg : float
        Angle of the fish behind the tow point [degree].
    tension : float
        At the tow point [N], > 0.
    jumps : Folds
        Between LOOKED times the speed, dimensionless; where they come from is not found out.
    angles : Angles or None
        Between cable and stream; None where it is not said where the cable was measured.
    equilibria : Equilibria
        All shapes of this cable, dimensionless.
    verdict : Verdict or None
        Whether the shape lasts; in a fluid by a model with drag unless another was named. None within the computation.
    """

    length: float
    error: float
    shape: int
    shapes: int
    expected: bool
    nodes: int
    position: Array
    phase_deg: float
    tension: float
    jumps: Folds
    angles: Angles | None
    equilibria: Equilibria
    verdict: Verdict | None

    @property
    def radius(self) -> float:
        """Distance of the fish from the axis [m]."""
        return float(np.hypot(self.position[0], self.position[1]))

    def nearest(self, gamma: float) -> int:
        """Which of the jumps is nearest to a speed.

        Parameters
        ----------
        gamma : float
            [-].

        Returns
        -------
        int
            -1 where there is none.
        """
        return int(np.argmin(np.abs(np.abs(self.jumps.gamma) - abs(gamma)))) if len(self.jumps) else -1


@dataclass(frozen=True, repr=False)
class Design:
    """Cables that bring the fish of a scene to where it is wanted, in rising order of length.

    Attributes
    ----------
    scene : Scene
        The scene, whose length is not used.
    quantity : str
        "depth", "radius" or "tension".
    value : float
        Of it [m or N], > 0.
    model : str
        The model by which they are found, of MODELS.
    reason : str
        Why this one.
    forced : bool
        Whether it was named, or is all there is, and was compared with no other.
    longest : float
        Longest cable searched [m], > 0.
    cables : tuple of Cable
        All of them.
    chosen : tuple of Cable
        Those within the limits asked for.
    least, most : float
        Of the quantity, over all shapes of all lengths searched [m or N]; of the longest alone where no shorter one can
        do; nan where not looked at.
    complete : bool
        Whether everything that was looked at was made out.
    """

    scene: Scene
    quantity: str
    value: float
    model: str
    reason: str
    forced: bool
    longest: float
    cables: tuple[Cable, ...]
    chosen: tuple[Cable, ...]
    least: float
    most: float
    complete: bool

    def __repr__(self) -> str:
        what = f"{self.quantity} {self.value:.6g} {UNITS[self.quantity]}"
        lines = [f"Design for {self.scene.title!r}: {what}, {self.model} model, {len(self.chosen)} cables"]
        for one in self.chosen:
            last = f", {one.verdict.kind}" if one.verdict else ""
            seen = ", expected" if one.expected else ""
            lines.append(
                f"  {one.length:.6g} m: {one.nodes} nodes, radius {one.radius:.6g} m, {one.tension:.6g} N{last}{seen}"
            )
        return "\n".join(lines)

    @property
    def notes(self) -> list[str]:
        """What whoever asks should know: of the scene, what the model leaves out, where laws are extrapolated."""
        notes = [*self.scene.notes, *self.scene.not_given(self.model)]
        # What larger models confirmed is known to do nothing.
        if self.forced and self.scene.density and (keys := self.scene.left_out.get(self.model)):
            notes.append(f"the {self.model} model leaves out {', '.join(keys)}")
        for cable in self.chosen:
            if cable.expected and (text := extrapolation(self.scene, cable.angles)):
                return [*notes, text]
        return notes


def design(
    scene: Scene,
    depth: float | None = None,
    *,
    radius: float | None = None,
    tension: float | None = None,
    max_radius: float = np.inf,
    max_tension: float = np.inf,
    max_length: float | None = None,
    model: str | None = None,
    stable_only: bool = False,
) -> Design:
    """Cable lengths that bring the fish to a depth, a radius or a tension; the length of the scene is not used.

    Parameters
    ----------
    scene : Scene
        From `towatlas.read_scene`.
    depth : float, optional
        Below the plane of the towing circle [m], > 0. Exactly one of depth, radius and tension is wanted.
    radius : float, optional
        Distance of the fish from the axis [m], > 0.
    tension : float, optional
        Of the cable at the tow point [N], > 0.
    max_radius : float
        How far from the axis the fish may be [m], > 0.
    max_tension : float
        What the cable may pull at the tow point [N], > 0.
    max_length : float, optional
        Longest cable searched [m]; without it 10 times the distance from the tow point to the axis at that depth.
    model : str, optional
        "vacuum", "air" or "water"; by default the least whose answers about each expected cable are those of the larger
        ones.
    stable_only : bool
        Whether only shapes that last are chosen.

    Returns
    -------
    Design
        All cables found, and those within the limits.

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If the computation overflows, does not converge, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    Each cable is solved again by itself, as `equilibria` does, and kept if one of its shapes has the fish there.

    Examples
    --------
    >>> from towatlas import read_scene
    >>> scene = read_scene("skop-fig3").at(gamma=5.94)
    >>> found = design(scene, depth=0.6, model="vacuum")
    >>> [round(cable.length, 4) for cable in found.cables if cable.expected]
    [0.6075]
    """
    given = {"depth": depth, "radius": radius, "tension": tension}
    wanted = {name: check_one(name, value) for name, value in given.items() if value is not None}
    if len(wanted) != 1:
        raise ValueError(f"exactly one of {', '.join(QUANTITIES)} is wanted, got {', '.join(wanted) or 'none'}")
    for name, value in (("max_radius", max_radius), ("max_tension", max_tension)):
        if not value > 0.0:
            raise ValueError(f"{name} must be positive, got {value:g}")
    ((quantity, value),) = wanted.items()
    far = float(np.hypot(depth or 0.0, max(scene.radius, radius or 0.0)))
    longest = check_one("length", LONGEST * far if max_length is None else max_length)
    names = [check_model(model)] if model is not None else solvable_models(with_length(scene, longest))[0]
    unit = UNITS[quantity]
    with patient_with(scene, f"--{quantity} {value:g} {unit}, --max-length {longest:g} m", longest / scene.radius):
        found = _by_least(scene, names, quantity, value, longest)
        found = replace(found, cables=tuple(_judged(found, cable, model) for cable in found.cables))
    chosen = [cable for cable in found.cables if cable.radius <= max_radius and cable.tension <= max_tension]
    if stable_only:
        chosen = [cable for cable in chosen if cable.verdict is not None and cable.verdict.kind == "stable"]
    return replace(found, chosen=tuple(chosen), forced=len(names) == 1)


def _judged(found: Design, cable: Cable, named: str | None) -> Cable:
    """The cable with its verdict."""
    check_patience("growth rates of cables", REMEDY)
    scene = with_length(found.scene, cable.length)
    shapes = cable.equilibria
    of = verdict_of(scene, shapes, cable.shape) if named else verdict_with_drag(scene, found.model, shapes, cable.shape)
    return replace(cable, verdict=of)


def _by_least(scene: Scene, names: Sequence[str], quantity: str, value: float, longest: float) -> Design:
    """By the first of some models that holds for each expected cable that it finds."""
    reason = "" if len(names) > 1 else f"{names[0]} was asked for, or is all there is, and compared with no other"
    for name in names:
        last = name == names[-1]
        try:
            found = _by_model(scene, name, quantity, value, longest)
        except TooMuchWork as error:
            # A larger model may have fewer shapes.
            if last:
                raise
            reason = f"{name} takes too long: {error}"
            continue
        if last:
            return replace(found, reason=reason or f"{name} is the largest model that the scene has the keys for")
        expected = [cable for cable in found.cables if cable.expected]
        choices = [least_model(with_length(scene, cable.length), None, DESIGN_QUESTIONS) for cable in expected]
        larger = [choice for choice in choices if MODELS.index(choice.model) > MODELS.index(name)]
        if expected and not larger:
            return replace(found, reason=choices[0].reason)
        reason = larger[0].reason if larger else f"{name} has no cable to judge it by"
    raise AssertionError("no model")


def with_length(scene: Scene, length: float) -> Scene:
    """The same scene with a cable of another length.

    Parameters
    ----------
    scene : Scene
    length : float
        [m], > 0.

    Returns
    -------
    Scene
    """
    return replace(
        scene,
        length=length,
        given=scene.given | {"cable.length": f"{length:g} m"},
        values=scene.values | {"cable.length": length},
        deviations={key: value for key, value in scene.deviations.items() if key != "cable.length"},
    )


def _by_model(scene: Scene, model: str, quantity: str, value: float, longest: float) -> Design:
    unit = scene.force_unit(model) if quantity == "tension" else scene.radius
    target, gamma = value / unit, scene.gamma
    lam, error, r_f, least, most, complete = _lengths(scene, model, quantity, target, longest)
    cables = []
    for k in range(len(lam)):
        check_patience("shapes and jumps of cables", REMEDY, done=k, of=len(lam))
        system = system_of(with_length(scene, float(lam[k]) * scene.radius), model)
        shapes = solve_equilibria(system, gamma)
        miss = np.abs(_columns(shapes)[quantity] / target - 1.0) + np.abs(np.log(shapes.r_f / r_f[k]))
        at = int(np.argmin(miss))
        if not miss[at] < max(NEAR, 100.0 * float(shapes.error[at])):
            complete = False
            continue
        position = np.array([shapes.x_f[at], shapes.y_f[at], shapes.z_f[at]]) * scene.radius
        cables.append(
            Cable(
                length=float(lam[k]) * scene.radius,
                error=float(error[k]),
                shape=at,
                shapes=len(shapes),
                expected=at == shapes.expected,
                nodes=int(shapes.nodes[at]),
                position=position,
                phase_deg=float(shapes.phase_deg[at]),
                tension=float(shapes.tension[at]) * scene.force_unit(model),
                jumps=folds_in_speed(system, gamma * LOOKED[0], gamma * LOOKED[1], named=False),
                angles=angles_along(scene, shapes, at),
                equilibria=shapes,
                verdict=None,
            )
        )
    return Design(
        scene=scene,
        quantity=quantity,
        value=value,
        model=model,
        reason="",
        forced=False,
        longest=longest,
        cables=tuple(cables),
        chosen=(),
        least=least * unit,
        most=most * unit,
        complete=complete,
    )


def _lengths(
    scene: Scene, model: str, quantity: str, target: float, longest: float
) -> tuple[Array, Array, Array, float, float, bool]:
    """Lengths and their errors, radii of the fish, least and most of the quantity, and whether all was made out."""
    far = longest / scene.radius
    shortest = far * SHORTEST
    if quantity == "depth":
        # The fish is never deeper than the cable is long.
        shortest = target * (1.0 - NEAR)
    elif quantity == "radius":
        shortest = max(shortest, abs(target - 1.0) * (1.0 - NEAR))
    longest_system = system_of(with_length(scene, longest), model)
    if shortest >= far:
        none = np.empty(0)
        return none, none, none, *_extremes(longest_system, scene.gamma, quantity), True
    system = replace(longest_system, lam=shortest)
    if system.in_vacuum and quantity == "depth":
        exact = cables_to_depth(w_f=system.w_f, gamma=abs(scene.gamma), z_f=target, lam_max=far)
        least, most = (np.nan, np.nan) if len(exact) else _extremes(longest_system, scene.gamma, quantity)
        return exact.lam, np.full(len(exact), np.nan), np.abs(exact.x_f), least, most, True
    found = cables_for(system, scene.gamma, quantity, target, far)
    return found.lam, found.error, found.r_f, found.least, found.most, found.complete


def _extremes(system: System, gamma: float, quantity: str) -> tuple[float, float]:
    """Least and most of a quantity over the shapes of one cable."""
    values = _columns(solve_equilibria(system, gamma))[quantity]
    return float(values.min()), float(values.max())


def _columns(shapes: Equilibria) -> dict[str, Array]:
    return {"depth": shapes.z_f, "radius": shapes.r_f, "tension": shapes.tension}
