"""Between which speeds the shape expected of a scene flutters: the edges next to its speed."""

from dataclasses import dataclass
from math import nan, pi

import numpy as np

from towatlas.effort import at_most
from towatlas.kernels import status
from towatlas.scene.diagrams import to_starboard
from towatlas.scene.jumps import SceneAnswer
from towatlas.scene.models import solve_model, with_drag
from towatlas.scene.verdicts import rate_unit
from towatlas.solve.follower import Mode, Sample, followed
from towatlas.solve.growth import WEAK

# Looked at between these shares of the speed unless more is asked for, with so much of the patience for following the
# shape, and for all of it.
LOOKED, FOLLOWING, SHARE = (0.8, 1.25), 0.1, 0.2
# Of log speed: the same speed.
CLOSE = 1e-9


@dataclass(frozen=True)
class FlutterEdge:
    """The edge of flutter next to the speed of a scene on one side.

    Attributes
    ----------
    speed : float
        Of the tow point [m/s], > 0.
    distance : float
        That over the speed of the scene, less 1 [-].
    enters : bool
        Whether the shape flutters beyond it, and not before, as it does in the other case.
    frequency : float
        Of the motion there [Hz], >= 0.
    """

    speed: float
    distance: float
    enters: bool
    frequency: float


@dataclass(frozen=True)
class FlutterEdges:
    """Edges of flutter of the shape expected.

    Attributes
    ----------
    model : str
        By which they were looked for, in a fluid one with drag unless another was named.
    below, above : FlutterEdge or None
        None where there is none up to where was looked.
    low, high : float
        Between which speeds that shape was followed [m/s]; nan where it was not.
    complete : bool
        Whether it was, all the way or to where it ends, and what grows was counted.
    failure : str
        Why not; else empty.
    """

    model: str
    below: FlutterEdge | None
    above: FlutterEdge | None
    low: float
    high: float
    complete: bool
    failure: str


def flutter_edges(answer: SceneAnswer, reach: float = 0.0) -> FlutterEdges:
    """The edges of flutter next to the speed of a scene, along the branch of the shape expected.

    Parameters
    ----------
    answer : SceneAnswer
        From `towatlas.answer_scene`.
    reach : float
        Share of the speed within which they are looked for [-], below 1; 0.2 below and 0.25 above at least.

    Returns
    -------
    FlutterEdges

    Notes
    -----
    Growth is counted at speeds 1 % apart at most, from the scene's outwards until an edge is passed; a narrower window
    may be missed. What grows by less than 0.01 gamma is no flutter. A fifth of the patience is used at most; what could
    not be had is said, and nothing is raised.

    Examples
    --------
    >>> from towatlas import answer_scene, read_scene
    >>> found = flutter_edges(answer_scene(read_scene("skop-fig3").at(gamma=3.2), model="air", asked=["nodes"]))
    >>> [(round(edge.speed, 4), edge.enters) for edge in (found.below, found.above)]
    [(1.2115, True), (1.3667, True)]
    """
    model = answer.choice.model if answer.choice.forced else with_drag(answer.scene, answer.choice.model)
    low, high = min(LOOKED[0], 1.0 - reach), max(LOOKED[1], 1.0 + reach)
    try:
        with at_most(SHARE):
            return _edges(answer, model, low, high)
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        return FlutterEdges(model, None, None, nan, nan, False, str(error))


def _edges(answer: SceneAnswer, model: str, low: float, high: float) -> FlutterEdges:
    scene = answer.scene
    known = next((one for one in answer.choice.answers if one.model == model), None)
    known = solve_model(scene, model) if known is None else known
    shapes = known.equilibria
    system, gamma = to_starboard(known.system, scene.gamma)
    traced, follower = followed(system, low * gamma, high * gamma, at=gamma)
    t = -np.log(low)
    with at_most(FOLLOWING / SHARE):
        x = float(np.log(shapes.r_f[shapes.expected] * gamma**2))
        samples, began, ended = follower.through(traced, t, x, _decided)
    first, last = samples[0].t, samples[-1].t
    spans = _merged([mode for mode in follower.modes(samples, began, ended) if follower.is_strong(mode)])
    unit = scene.speed_of(1.0)

    def edge(at: float, rate: float, enters: bool) -> FlutterEdge:
        speed = follower.speed(at)
        return FlutterEdge(speed * unit, speed / gamma - 1.0, enters, rate * speed * rate_unit(scene) / (2.0 * pi))

    below = [(at, rate, at is not span[0]) for span in spans for at, rate in _solved(span) if at <= t]
    above = [(at, rate, at is span[0]) for span in spans for at, rate in _solved(span) if at > t]
    end = float(np.log(high / low)) * (1.0 - 1e-12)
    whole = (
        began is not None or first <= 0.0 or _decided([one for one in samples[::-1] if one.t <= t + CLOSE]),
        ended is not None or last >= end or _decided([one for one in samples if one.t >= t - CLOSE]),
    )
    counted = all(sample.spectrum.status == status.OK for sample in samples)
    reason = "" if all(whole) else "the patience was used up"
    if not counted:
        code = next(sample.spectrum.status for sample in samples if sample.spectrum.status != status.OK)
        reason = status.SENTENCES[code]
    return FlutterEdges(
        model=model,
        below=edge(*max(below)) if below else None,
        above=edge(*min(above)) if above else None,
        low=follower.speed(first) * unit,
        high=follower.speed(last) * unit,
        complete=traced.certain and all(whole) and counted,
        failure=reason,
    )


def _decided(samples: list[Sample]) -> bool:
    """Whether samples from the shape outwards reach beyond the first edge: there are both such as flutter and such as
    do not, and what grows at the last may not prove to be weak further on."""
    growing = [sample.spectrum.growing.real for sample in samples]
    strong = [bool((rates >= WEAK).any()) for rates in growing]
    return any(strong) and not all(map(len, growing)) and bool((growing[-1] >= WEAK).all())


Span = tuple[float, float, dict[float, float]]


def _merged(modes: list[Mode]) -> list[Span]:
    """Where a shape flutters, by modes that are not weak: begins, ends, and which of both are edges, with the frequency
    there."""
    spans: list[Span] = []
    for mode in sorted(modes, key=lambda mode: mode.start.t):
        edges = {edge.t: edge.frequency for edge in (mode.start, mode.end) if edge.kind in ("hopf", "krein")}
        if spans and mode.start.t <= spans[-1][1]:
            start, end, known = spans[-1]
            spans[-1] = (start, max(end, mode.end.t), known | edges)
        else:
            spans.append((mode.start.t, mode.end.t, edges))
    return spans


def _solved(span: Span) -> list[tuple[float, float]]:
    return [(at, span[2][at]) for at in span[:2] if at in span[2]]
