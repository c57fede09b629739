"""The interpretation that NRL Report 7048 gives of its solution curves, step by step, each with what holds."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from math import inf

import numpy as np

from towatlas.limits import threshold_length
from towatlas.report.claims import FAILS, PART, Claim, judged
from towatlas.report.frame import number
from towatlas.report.nrl7048.lasting import Seen, seen, shapes
from towatlas.report.nrl7048.photographs import FIG_6, PHOTOGRAPHS, Case
from towatlas.results import Equilibria
from towatlas.solve.critical import solve_critical

# Cables of the report, and one between.
CABLES = ((2.1, 0.0), (10.0, 0.0), (10.0, 10.0), (37.8, 1352.0), (52.4, 1571.0))
# Transitions looked at, a step beyond them and one before, and shares of the way from one to the next, in log gamma.
TRANSITIONS = (1, 2, 3)
BESIDE = 1e-3
SHARES = (0.05, 0.2, 0.4, 0.6, 0.8)
# Where there is no further transition, speeds end so many times beyond the last.
END = 4.0


@dataclass(frozen=True)
class Place:
    """A cable in a vacuum, some time after its n-th transition.

    Attributes
    ----------
    case : Case
        The cable and its speed.
    n : int
        Transitions below that speed, >= 0.
    """

    case: Case
    n: int

    @property
    def found(self) -> Equilibria:
        """All shapes."""
        return shapes(self.case)

    @property
    def median(self) -> Seen:
        """How the median root moves."""
        return seen(self.case)

    def lasts(self, branch: str) -> bool:
        """Whether a shape is stable.

        Parameters
        ----------
        branch : str
            Its name.

        Returns
        -------
        bool
        """
        return seen(self.case, branch).kind == "stable"


@cache
def critical(cable: tuple[float, float], n: int) -> float:
    """The n-th critical speed of a vacuum, infinite where there is none.

    Parameters
    ----------
    cable : (float, float)
        Length and weight of the fish [-].
    n : int
        Which, >= 1.

    Returns
    -------
    float
    """
    lam, w_f = cable
    return float(solve_critical(lam, w_f, n).gamma) if lam > threshold_length(w_f, n) else inf


@cache
def beside(n: int) -> tuple[Place, ...]:
    """Just beyond the n-th transition of every cable that has it.

    Parameters
    ----------
    n : int

    Returns
    -------
    tuple of Place
    """
    speeds = [(cable, critical(cable, n)) for cable in CABLES]
    return tuple(Place(Case(*cable, gamma * (1.0 + BESIDE), 0.0), n) for cable, gamma in speeds if gamma < inf)


@cache
def between(n: int) -> tuple[Place, ...]:
    """From the n-th transition to the next.

    Parameters
    ----------
    n : int

    Returns
    -------
    tuple of Place
    """
    places = []
    for cable in CABLES:
        low, high = critical(cable, n), critical(cable, n + 1)
        if low < inf:
            wide = np.log(min(high / low, END))
            places += [Place(Case(*cable, float(low * np.exp(share * wide)), 0.0), n) for share in SHARES]
    return tuple(places)


def all_claims() -> list[Claim]:
    """The six steps, and what the report concludes from experiment and theory.

    Returns
    -------
    list of Claim
    """
    return [claim() for claim in CLAIMS]


def _one() -> Claim:
    places = [
        Place(Case(*cable, critical(cable, 1) * share, 0.0), 0)
        for cable in CABLES
        for share in (0.1, 0.5, 1.0 - BESIDE)
    ]
    only = [list(p.found.branch) == ["outward"] for p in places]
    return Claim(
        "Step 1",
        "At low speed there is one shape, without a node",
        judged(only),
        f"{sum(only)} of {len(only)} cases up to {100 * BESIDE:g} % below &gamma;<sub>c1</sub>; it is stable in "
        f"{sum(p.lasts('outward') for p in places)}.",
    )


def _two() -> Claim:
    places = beside(1)
    left = [list(p.found.branch) == ["1 outer", "1 inner", "outward"] for p in places]
    node = [bool((p.found.nodes[:2] == 1).all()) for p in places]
    leaves = [not p.lasts("outward") for p in places]
    return Claim(
        "Step 2",
        "Of a cable longer than &lambda;<sub>c</sub> a double root appears left of the only one; its speed is a "
        "transitional instability, &gamma;<sub>c1</sub>",
        PART if all(left) and all(node) and not any(leaves) else judged(left + node + leaves),
        f"The root, its place and its node: {sum(a and b for a, b in zip(left, node, strict=True))} of {len(places)} "
        "cables. But nothing becomes unstable there: beyond it the shape without a node lasts in "
        f"{sum(not x for x in leaves)} "
        f"of {len(places)}, as at every speed, for its energy is least.",
    )


def _median(places: tuple[Place, ...]) -> tuple[list[bool], str]:
    """Whether the median root lasts at some places, and where it grows most."""
    lasts = [place.median.kind == "stable" for place in places]
    worst = max(places, key=lambda place: place.median.growth / place.case.gamma)
    where = (
        f"most, by {number(worst.median.growth, '.3f')}, at &lambda; = {worst.case.lam:g}, <i>w</i><sub>f</sub> = "
        f"{worst.case.w_f:g}, &gamma; = {number(worst.case.gamma, '.3f')}"
    )
    return lasts, f"It lasts in {sum(lasts)} of {len(lasts)} cases and grows in {len(lasts) - sum(lasts)}, {where}."


def _three() -> Claim:
    lasts, words = _median(beside(1) + between(1))
    return Claim("Step 3", "Then the median root is the stable shape", judged(lasts), words)


def _four() -> Claim:
    places = [p for n in TRANSITIONS[1:] for p in beside(n)]
    order = []
    for p in places:
        names = list(p.found.branch)
        at = names.index(f"{p.n - 1} outer")
        order.append(names[at : at + 4] == [f"{p.n - 1} outer", f"{p.n} outer", f"{p.n} inner", f"{p.n - 1} inner"])
    goes = [p.lasts(f"{p.n - 1} inner") for p in places]
    before = [Place(replace(p.case, gamma=critical(p.case.cable, p.n) * (1.0 - BESIDE)), p.n - 1) for p in places]
    same = [(old.median.kind == "stable") == on for old, on in zip(before, goes, strict=True)]
    return Claim(
        "Step 4",
        "Of a long cable a double root appears again, between the median root and the next to its left; "
        "there, at &gamma;<sub>c2</sub>, the cable goes over from one node to two",
        PART if all(order) and all(same) else judged(order + same),
        f"The place of the double root: {sum(order)} of {len(order)} transitions, the second and third ones. But the "
        f"shape that was the median root goes on: {100 * BESIDE:g} % below and above the transition it is the same, "
        f"stable or not, in {sum(same)} of {len(same)}, and stable above it in {sum(goes)}. The fold makes two new "
        "shapes and takes none.",
    )


def _five() -> Claim:
    lasts, words = _median(tuple(p for n in TRANSITIONS[1:] for p in beside(n) + between(n)))
    return Claim("Step 5", "Beyond it the new median root is the stable shape", judged(lasts), words)


def _six() -> Claim:
    lam, w_f = FIG_6.cable
    last = max(n for n in range(1, 60) if threshold_length(w_f, n) < lam)
    fast = critical(FIG_6.cable, last)
    return Claim(
        "Step 6",
        "Of a sufficiently long cable steps 4 and 5 go on and on",
        PART if fast < inf and critical(FIG_6.cable, last + 1) == inf else FAILS,
        f"As often as it is long enough: the n-th transition takes &lambda; > 2 n &minus; 1 + "
        "&radic;(1 + <i>w</i><sub>f</sub><sup>2</sup>) &minus; <i>w</i><sub>f</sub>. "
        f"That of Fig. 3, &lambda; = {lam:g}, has {last}, "
        f"the last at &gamma; = {number(fast, '.2f')}, and then no more.",
    )


def _none_stable() -> Claim:
    near = seen(FIG_6)
    kinds = [seen(FIG_6, str(branch)).kind for branch in shapes(FIG_6).branch]
    return Claim(
        "Abstract",
        "At some speeds no equilibrium is stable",
        FAILS if "stable" in kinds else PART,
        f"One is at &gamma; = {FIG_6.gamma:g} of Fig. 6, too: the cable flung far out. True is that the one next to "
        f"the axis is not; it is left in {near.kind}, growing by {number(near.growth, '.3f')}.",
    )


def _lengths() -> Claim:
    falls = []
    for w_f in (0.0, 1.0, 10.0, 100.0, 1352.0):
        for n in TRANSITIONS:
            speeds = [critical((lam, w_f), n) for lam in (2.1, 3.5, 5.5, 8.0, 12.0, 20.0, 37.8, 52.4)]
            known = [speed for speed in speeds if speed < inf]
            falls += [b < a for a, b in pairwise(known)]
    return Claim("Eq. (24)", "Critical speeds fall with the length", judged(falls), _count(falls, "pairs of lengths"))


def _weights() -> Claim:
    rises = []
    for lam in (2.1, 10.0, 37.8, 52.4):
        for n in TRANSITIONS:
            speeds = [critical((lam, w_f), n) for w_f in (0.0, 0.3, 1.0, 10.0, 100.0, 1352.0, 1571.0)]
            rises += [b > a for a, b in pairwise(speeds) if a < inf]
    return Claim(
        "Eq. (25)",
        "Critical speeds rise with the weight of the fish",
        judged(rises),
        _count(rises, "pairs of weights") + " The report says itself that this is not always so.",
    )


def _reactions() -> Claim:
    negative, rising = [], []
    for n in TRANSITIONS:
        negative += [bool(p.found.R_x0[p.found.expected] < 0.0) for p in beside(n)]
        for cable in CABLES:
            places = [p for p in beside(n) + between(n) if p.case.cable == cable]
            r_x0 = [float(p.found.R_x0[p.found.expected]) for p in places]
            rising += [b > a for a, b in pairwise(r_x0)]
    return Claim(
        "Eq. (26)",
        "Just after a transition <i>R</i><sub>x0</sub> of the median root is negative; then it rises with the speed",
        judged(negative + rising),
        f"Negative in {sum(negative)} of {len(negative)} transitions; rising in {sum(rising)} of {len(rising)} steps.",
    )


def _centrifugal() -> Claim:
    shown = [(f"Fig. {p.figure}", p.case) for p in PHOTOGRAPHS] + [("Fig. 6", FIG_6)]
    cases = [(name, case) for name, case in shown if seen(case).kind == "flutter"]
    same = [seen(case.vacuum).kind == "flutter" for _, case in cases]
    listed = "; ".join(
        f"{name}: {number(seen(case.vacuum).growth, '.3f')} in a vacuum, {number(seen(case).growth, '.3f')} in air"
        for name, case in cases
    )
    return Claim(
        "Conclusions",
        "As there is no drag in a vacuum, what makes the motion is the centrifugal force",
        judged(same),
        f"The median root flutters in a vacuum, too, in {sum(same)} of the {len(same)} cases in which the cable "
        f"flutters in air ({listed}). With the forces of the turning frame alone shapes do flutter; which ones, drag "
        "decides, too.",
    )


def _count(cases: list[bool], of: str) -> str:
    return f"{sum(cases)} of {len(cases)} {of}."


CLAIMS: tuple[Callable[[], Claim], ...] = (
    *(_one, _two, _three, _four, _five, _six),
    *(_none_stable, _lengths, _weights, _reactions, _centrifugal),
)
