"""How far a scene is from trouble: the nearest jumps, what they cost, and the largest tension along its cable."""

from contextlib import suppress
from dataclasses import dataclass
from math import isnan, nan

import numpy as np

from towatlas.results import Equilibria, Folds
from towatlas.scene.edges import FlutterEdge, FlutterEdges, flutter_edges
from towatlas.scene.jumps import LOOKED, SceneAnswer
from towatlas.scene.scene import Scene, patient_with
from towatlas.scene.sensitivities import Sensitivities, sensitivities_of
from towatlas.solve.drag_equilibria import quantities
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.tensions import largest_tension

# Shapes beside a jump are found at a speed this far from it, where the two that meet are not there: the others are as
# at the jump within about as much.
BESIDE = 1e-9
# Standard deviations from a jump within which a scene may be on its other side.
SURE = 2.0


@dataclass(frozen=True)
class Hanging:
    """Where one shape has the fish, and how it pulls.

    Attributes
    ----------
    nodes : int
        Number of nodes [-], >= 0.
    depth : float
        Of the fish below the tow point [m].
    radius : float
        Of the fish from the axis [m], >= 0.
    tension : float
        At the tow point [N], > 0.
    """

    nodes: int
    depth: float
    radius: float
    tension: float


@dataclass(frozen=True)
class Cost:
    """What is lost at a jump, going from the speed of the scene.

    Attributes
    ----------
    meeting : Hanging
        The shape in which two meet.
    before, after : Hanging
        The shape expected just short of the jump, and just beyond it.
    ends : bool
        Whether the two are there before, and not after: a cable in either has to jump.
    expected : str
        What becomes of the shape expected before: "lost" where it is one of the two that end, "overtaken" where it goes
        on but another is expected, "goes on".
    """

    meeting: Hanging
    before: Hanging
    after: Hanging
    ends: bool
    expected: str


@dataclass(frozen=True)
class NearestJump:
    """The jump next to the speed of a scene on one side.

    Attributes
    ----------
    side : str
        "below" or "above".
    speed : float
        Of the tow point [m/s]; nan where there is none.
    looked : float
        Speed to which jumps were looked for [m/s].
    distance : float
        Its speed over that of the scene, less 1 [-]; nan where there is none.
    deviation : float
        Standard deviation of its speed [m/s]; 0 where no key is uncertain, nan where not known.
    distance_deviation : float
        Standard deviation of the difference of the speeds [m/s]; the same.
    cost : Cost or None
        None where there is no jump, or it could not be computed.
    failure : str
        Why not; else empty.
    """

    side: str
    speed: float
    looked: float
    distance: float
    deviation: float
    distance_deviation: float
    cost: Cost | None
    failure: str

    @property
    def exists(self) -> bool:
        """Whether there is one up to `looked`."""
        return self.speed == self.speed

    @property
    def may_be_passed(self) -> bool:
        """Whether the inputs are so uncertain that the scene may be on its other side."""
        apart = abs(self.distance) / (1.0 + self.distance) * self.speed
        return apart < SURE * self.distance_deviation


@dataclass(frozen=True)
class Margins:
    """How far a scene is from trouble.

    Attributes
    ----------
    scene : Scene
    jumps : tuple of NearestJump
        Below and above; none where jumps were not asked for.
    complete : bool
        Whether all jumps were made out.
    largest_tension : float
        Along the cable in the shape expected [N], > 0; nan where it could not be computed.
    at : float
        Where, along the cable from the tow point [m], >= 0.
    of_others : float
        Largest tension along the cable in any other shape [N], > 0; nan without one, or where it could not be computed.
    deviations : dict of float
        Standard deviations to first order of "depth" [m], "tension" and "largest_tension" [N], and of what the strength
        has left over, "breaking_margin" [N]; empty where no key is uncertain, nan where not known.
    failure : str
        Why they are not known; else empty.
    idle : tuple of str
        Uncertain keys that have no part in the model used.
    flutter : FlutterEdges or None
        Edges of flutter of the shape expected, which count as jumps; None where jumps were not asked for.
    """

    scene: Scene
    jumps: tuple[NearestJump, ...]
    complete: bool
    largest_tension: float
    at: float
    of_others: float
    deviations: dict[str, float]
    failure: str
    idle: tuple[str, ...]
    flutter: FlutterEdges | None

    @property
    def breaking_ratio(self) -> float:
        """Largest tension over breaking strength [-]; nan where that is not given."""
        return self.largest_tension / self.scene.breaking_strength

    @property
    def breaks(self) -> bool:
        """Whether the largest tension is above the breaking strength, or one standard deviation of the two from it."""
        left = self.scene.breaking_strength - self.largest_tension
        return not (isnan(left) or left >= self.deviations.get("breaking_margin", 0.0))

    def within(self, distance: float) -> list[NearestJump]:
        """Jumps nearer to the speed of the scene than a distance, at the near end of their intervals if that is known.

        Parameters
        ----------
        distance : float
            [m/s], > 0.

        Returns
        -------
        list of NearestJump
        """
        speed = self.scene.speed
        return [
            jump
            for jump in self.jumps
            if jump.exists and not abs(jump.speed - speed) - jump.distance_deviation > distance
        ]

    def edges_within(self, distance: float) -> list[FlutterEdge]:
        """Edges of flutter nearer to the speed of the scene than a distance; their intervals are not known.

        Parameters
        ----------
        distance : float
            [m/s], > 0.

        Returns
        -------
        list of FlutterEdge
        """
        edges = () if self.flutter is None else (self.flutter.below, self.flutter.above)
        return [edge for edge in edges if edge is not None and not abs(edge.speed - self.scene.speed) > distance]


def margins_of(answer: SceneAnswer, known: Sensitivities | None = None, reach: float = 0.0) -> Margins:
    """How far the answer for a scene is from trouble.

    Parameters
    ----------
    answer : SceneAnswer
        From `towatlas.answer_scene`.
    known : Sensitivities, optional
        Of it; they are computed where a key is uncertain.
    reach : float
        As of `towatlas.scene.edges.flutter_edges`.

    Returns
    -------
    Margins

    Raises
    ------
    ArithmeticError
        If the computation overflows, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    Which shape a cable lands on needs its motion; the shape expected beyond the jump is the one that it may land on.
    Standard deviations are of first order, keys independent.

    Examples
    --------
    >>> from towatlas import answer_scene, read_scene
    >>> found = margins_of(answer_scene(read_scene("skop-fig3"), model="air"))
    >>> [(jump.side, round(jump.distance, 3), jump.cost.expected) for jump in found.jumps]
    [('below', -0.941, 'lost'), ('above', 1.292, 'overtaken')]
    """
    scene, found = answer.scene, answer.equilibria
    failure = ""
    with patient_with(scene):
        # What cannot be had is said: the answer for the scene stands.
        if known is None and scene.deviations:
            try:
                known = sensitivities_of(answer)
            except ArithmeticError as error:
                failure = str(error)
        tension, at = nan, nan
        if known is not None:
            tension, at = known["largest_tension"].value, known.place
        else:
            with suppress(ArithmeticError):
                tension, at = largest_tension(found, found.expected)
                tension, at = tension * scene.force_unit(answer.choice.model), at * scene.radius
        of_others = nan
        with suppress(ArithmeticError):
            others = [largest_tension(found, k)[0] for k in range(len(found)) if k != found.expected]
            of_others = max(others, default=nan) * scene.force_unit(answer.choice.model)
        jumps: tuple[NearestJump, ...] = ()
        if (folds := answer.folds) is not None:
            sides = zip(("below", "above"), folds.beside(scene.gamma), strict=True)
            jumps = tuple(_jump(answer, folds, side, k, known) for side, k in sides)
        flutter = flutter_edges(answer, reach) if jumps else None
    return Margins(
        scene=scene,
        jumps=jumps,
        complete=answer.folds is None or answer.folds.complete,
        largest_tension=tension,
        at=at,
        of_others=of_others,
        deviations=_deviations(scene, known) if scene.deviations else {},
        failure=failure,
        idle=() if known is None else tuple(known.idle),
        flutter=flutter,
    )


def _deviations(scene: Scene, known: Sensitivities | None) -> dict[str, float]:
    names = ("depth", "tension", "largest_tension")
    found = {name: nan if known is None else known.deviation(known[name].slopes) for name in names}
    strength = scene.deviations.get("cable.breaking_strength", 0.0)
    return found | {"breaking_margin": float(np.hypot(found["largest_tension"], strength))}


def _jump(answer: SceneAnswer, folds: Folds, side: str, at: int, known: Sensitivities | None) -> NearestJump:
    scene = answer.scene
    looked = scene.speed * LOOKED[side == "above"]
    if at < 0:
        return NearestJump(side, nan, looked, nan, 0.0, 0.0, None, "")
    speed = float(scene.speed_of(abs(folds.gamma[at])))
    deviation = apart = nan if scene.deviations else 0.0
    if known is not None and scene.deviations:
        slopes = known[f"jump_{side}"].slopes
        deviation, apart = known.deviation(slopes), known.deviation(slopes - known["speed"].slopes)
    cost, failure = None, ""
    try:
        cost = _cost(answer, folds, at, side == "above")
    except ArithmeticError as error:
        failure = str(error)
    return NearestJump(side, speed, looked, speed / scene.speed - 1.0, deviation, apart, cost, failure)


def _cost(answer: SceneAnswer, folds: Folds, at: int, above: bool) -> Cost:
    system, gamma = folds.system, float(folds.gamma[at])
    born = bool(folds.shapes_above[at] > folds.shapes_below[at])
    off = max(BESIDE, 10.0 * float(folds.error[at]))
    # Where the two that meet are not there.
    fewer = solve_equilibria(system, gamma * (1.0 - off if born else 1.0 + off))
    x = np.log([folds.r_f[at] * gamma**2])
    # The error of a radius at given speed, which has no bounds where two meet, is not asked for.
    with np.errstate(divide="ignore"):
        there = quantities(np.zeros(1, np.int64), x, system.row()[None], np.array([gamma]))
    meeting = _hanging(answer, {name: column[0] for name, column in there.items()})
    goes_on = _hanging(answer, {name: getattr(fewer, name)[fewer.expected] for name in there if name != "near_axis"})
    takes_over = _expects(fewer, float(there["R_x0"][0]), float(folds.r_f[at]))
    with_pair = meeting if takes_over else goes_on
    ends = born != above
    return Cost(
        meeting=meeting,
        before=with_pair if ends else goes_on,
        after=goes_on if ends else with_pair,
        ends=ends,
        expected=("lost" if ends else "overtaken") if takes_over else "goes on",
    )


def _expects(others: Equilibria, R_x0: float, r_f: float) -> bool:
    """Whether one of a pair that is not there yet will be the shape expected: as `Equilibria.expected` has it."""
    if not others.system.in_vacuum:
        return r_f < others.r_f[others.expected]
    below = int((others.R_x0 < R_x0).sum())
    # The median of all with the pair, which takes two places.
    return below <= (len(others) + 2) // 2 <= below + 1


def _hanging(answer: SceneAnswer, of: dict[str, float]) -> Hanging:
    scene = answer.scene
    return Hanging(
        nodes=int(of["nodes"]),
        depth=float(of["z_f"] * scene.radius),
        radius=float(of["r_f"] * scene.radius),
        tension=float(of["tension"] * scene.force_unit(answer.choice.model)),
    )
