"""Which of the photographed shapes last: growth rates, windows of flutter, and what moves their edges."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise
from math import log, nan, pi

import numpy as np

from towatlas.effort import check_patience
from towatlas.kernels import status
from towatlas.report.nrl7048.photographs import DRAG, PHOTOGRAPHS, Case, Photograph
from towatlas.results import Array, Equilibria
from towatlas.results_motion import Window
from towatlas.solve.equilibria import equilibria
from towatlas.solve.follower import Follower
from towatlas.solve.growth import reach_of
from towatlas.solve.motion import motions
from towatlas.solve.paths import Path, trace
from towatlas.solve.spectrum import polish
from towatlas.solve.stability import spectrum_of
from towatlas.system import System

# Speeds at which growth is counted are no further apart than this part of them; from so far below the slowest
# photograph of a cable to so far above the fastest one.
SPACING, MARGIN = 0.025, 0.055
# Secants on a growth rate: first step, and the change, both relative, with which they are done.
FIRST, SETTLED, ROUNDS = 1e-4, 1e-10, 20
REMEDY = "there is no smaller page"


@dataclass(frozen=True)
class Seen:
    """How a shape moves.

    Attributes
    ----------
    nodes : int
        Of the shape, >= 0.
    kind : str
        As of `towatlas.Stability`.
    growth, frequency : float
        Of the leading eigenvalue, over sqrt(g/R) [-].
    turns : float
        Turns of the tow point in which the motion grows by a factor of e [-], > 0; nan where it does not.
    """

    nodes: int
    kind: str
    growth: float
    frequency: float
    turns: float


@dataclass(frozen=True)
class Stretch:
    """The shape next to the axis of one cable in air, over the speeds of its photographs.

    Attributes
    ----------
    low, high : float
        Speeds looked at [-], > 0.
    windows : tuple of Window
        In which it does not last.
    gamma, growth : ndarray, shape (speeds,)
        Speed, and factors of e by which a motion grows in a turn of the tow point [-], >= 0.
    one_more_node : tuple of (float, float)
        Speeds between which it gains a node [-].
    shapes : tuple of int
        How many shapes the cable has, each number once.
    """

    low: float
    high: float
    windows: tuple[Window, ...]
    gamma: Array
    growth: Array
    one_more_node: tuple[tuple[float, float], ...]
    shapes: tuple[int, ...]


@dataclass(frozen=True)
class MovedEdge:
    """The edge of a window that is nearest to a photograph, and where it is for other cables.

    Attributes
    ----------
    photograph : Photograph
    window : Window
    gamma : float
        Of the edge [-].
    longer, heavier, more_drag : float
        Of the edge with CHANGE more of lam, of w_f, of C [-].
    """

    photograph: Photograph
    window: Window
    gamma: float
    longer: float
    heavier: float
    more_drag: float


# By which part numbers are changed to see how edges move, and in how many steps.
CHANGE, STAGES = 0.01, 2


@cache
def shapes(case: Case) -> Equilibria:
    """As `towatlas.equilibria`, each once.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Equilibria
    """
    return equilibria(case.lam, case.w_f, case.gamma, C=case.C)


@cache
def seen(case: Case, branch: str = "") -> Seen:
    """How a shape moves.

    Parameters
    ----------
    case : Case
    branch : str
        Name of the shape, as of `Equilibria`; the one that is expected by default.

    Returns
    -------
    Seen

    Examples
    --------
    >>> found = seen(Case(37.8, 1352.0, 5.94))
    >>> found.kind, round(found.growth, 5)
    ('flutter', 0.15222)
    """
    check_patience("growth rates of the page", REMEDY)
    found = shapes(case)
    k = list(found.branch).index(branch) if branch else found.expected
    spectrum = spectrum_of(found, k)
    sigma = spectrum.leading * case.gamma
    turns = case.gamma / (2.0 * pi * sigma.real) if sigma.real > 0.0 else nan
    return Seen(int(found.nodes[k]), spectrum.kind, float(sigma.real), float(sigma.imag), turns)


@cache
def stretch(cable: tuple[float, float]) -> Stretch:
    """The shape next to the axis over the speeds of the photographs of its cable.

    Parameters
    ----------
    cable : (float, float)
        Length and weight of the fish [-], of a photograph.

    Returns
    -------
    Stretch
    """
    lam, w_f = cable
    shown = [p.gamma for p in PHOTOGRAPHS if p.case.cable == cable]
    low, high = min(shown) * (1.0 - MARGIN), max(shown) * (1.0 + MARGIN)
    path, end = Path(System.of(lam, w_f, C=DRAG).row(), low, ("gamma",)), log(high / low)
    traced = trace(path, 0.0, end, at=np.linspace(0.0, end, int(np.ceil(end / SPACING)) + 1))
    if any(fold is not None for fold in traced.folds):
        raise ArithmeticError(f"lambda = {lam:g}, w_f = {w_f:g} has folds in air, between which shapes change places")
    follower, samples = Follower(System.of(lam, w_f, C=DRAG), path), []
    for done, column in enumerate(traced.columns):
        check_patience("growth rates of the page", REMEDY, done=done, of=len(traced.columns))
        samples.append(follower.sample(column.t, float(column.x[0]), 0))
    if any(sample.spectrum.status != status.OK for sample in samples):
        raise ArithmeticError(f"lambda = {lam:g}, w_f = {w_f:g}: not all that grows was counted")
    found = follower.windows(follower.modes(samples, None, None), follower.name(samples, None))
    windows = tuple(sorted(found, key=lambda window: window.low))
    speeds = [follower.speed(sample.t) for sample in samples]
    growth = [max(0.0, 2.0 * pi * float(sample.spectrum.roots.sigma[0].real)) for sample in samples]
    edges = [edge for w in windows for edge in (w.low, w.high) if not any(o.low < edge < o.high for o in windows)]
    order = np.argsort([*speeds, *edges])
    return Stretch(
        speeds[0],
        speeds[-1],
        windows,
        np.array([*speeds, *edges])[order],
        np.array([*growth, *np.zeros(len(edges))])[order],
        tuple((speeds[k], speeds[k + 1]) for k, (a, b) in enumerate(pairwise(samples)) if b.nodes > a.nodes),
        tuple(sorted({len(column.x) for column in traced.columns})),
    )


def still(case: Callable[[float], tuple[System, float]], x: float, sigma: complex) -> tuple[float, complex]:
    """Where a mode neither grows nor damps, of the shape that is expected.

    Parameters
    ----------
    case : callable
        From a number to a system and a speed.
    x : float
        The number to begin with, not zero.
    sigma : complex
        The mode there, about, in units of Omega.

    Returns
    -------
    x : float
        The number; nan where the mode is lost.
    sigma : complex
        The mode there.
    """
    guess = sigma

    def growth(x: float) -> float:
        nonlocal guess
        if not np.isfinite(x):
            return nan
        system, speed = case(x)
        found = equilibria(system.lam, system.w_f, speed, C=system.C)
        r_f = found.r_f[found.expected : found.expected + 1]
        motion = motions(r_f, np.array([speed]), system.row()[None], max(reach_of(system, speed), 1.1 * abs(guess)))[0]
        roots, good = polish(motion, np.array([guess]), np.array([guess]))
        if not good[0]:
            return nan
        guess = complex(roots.sigma[0])
        return guess.real

    old, new = x, x * (1.0 + FIRST)
    before, here = growth(old), growth(new)
    for _ in range(ROUNDS):
        step = -here * (new - old) / (here - before) if here != before else 0.0
        if abs(step) < SETTLED * abs(new):
            return new, guess
        old, new, before = new, new + step, here
        here = growth(new)
    return nan, guess


@cache
def moved_edge(photograph: Photograph) -> MovedEdge:
    """The edge of a window nearest to a photograph, computed anew for a longer cable, a heavier fish and more drag.

    Parameters
    ----------
    photograph : Photograph

    Returns
    -------
    MovedEdge
    """
    p = photograph
    edges = [
        (gamma, frequency / gamma, window)
        for window in stretch(p.case.cable).windows
        for gamma, frequency, kind in (
            (window.low, window.low_frequency, window.low_kind),
            (window.high, window.high_frequency, window.high_kind),
        )
        if kind == "hopf"
    ]
    gamma, frequency, window = min(edges, key=lambda edge: abs(log(edge[0] / p.gamma)))

    def moved(*names: str) -> float:
        """Step by step, so that the mode stays in sight; the speed of a step is as far from the last as that before."""
        speeds, sigma = [gamma, gamma], 1j * frequency
        for part in np.linspace(0.0, CHANGE, STAGES + 1)[1:]:
            cable = {"lam": p.lam, "w_f": p.w_f, "C": DRAG}
            system = System.of(**cable | {name: cable[name] * (1.0 + float(part)) for name in names})
            speed, sigma = still(partial(_at_speed, system), 2.0 * speeds[-1] - speeds[-2], sigma)
            speeds.append(speed)
        return speeds[-1]

    return MovedEdge(p, window, gamma, moved("lam"), moved("w_f"), moved("C"))


def _at_speed(system: System, speed: float) -> tuple[System, float]:
    return system, speed


def lasting_length(photograph: Photograph) -> float:
    """Length next to that of a photograph with which its shape neither flutters nor lasts.

    Parameters
    ----------
    photograph : Photograph
        Of a shape that flutters.

    Returns
    -------
    float
        [-]; nan where the mode is lost on the way.
    """
    p, here = photograph, seen(photograph.case)
    sigma = complex(here.growth, here.frequency) / p.gamma
    return still(lambda lam: (System.of(lam, p.w_f, C=DRAG), p.gamma), p.lam, sigma)[0]
