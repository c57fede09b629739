"""What is seen as the speed, or the length, rises or falls: along which branches, in what motion, with which jumps."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from towatlas.results_motion import Branch

# A cable stays in such a shape.
LASTING = ("stable", "weak")


@dataclass(frozen=True)
class Stretch:
    """Part of a branch along which one thing is seen.

    Attributes
    ----------
    branch : int
        Which of the branches.
    kind : str
        As of `towatlas.results_motion.Stability`.
    low, high : float
        Between which values of what moves, low < high.
    nodes : (int, int)
        Fewest and most [-], >= 0.
    growth, frequency : float
        Of the leading eigenvalue where it grows most, in the units of the branches; nan where not known.
    """

    branch: int
    kind: str
    low: float
    high: float
    nodes: tuple[int, int]
    growth: float
    frequency: float


@dataclass(frozen=True)
class Jump:
    """Where a shape ends, or is left.

    Attributes
    ----------
    value : float
        Of what moves.
    start, end : int
        From which branch to which; -1 where no shape lasts.
    """

    value: float
    start: int
    end: int


def seen(branches: Sequence[Branch], rising: bool, start: int) -> list[Stretch | Jump]:
    """What is seen from one end of the branches to the other.

    Parameters
    ----------
    branches : sequence of Branch
        Of one diagram.
    rising : bool
        Whether what moves rises.
    start : int
        Which of the branches is begun with: one that reaches that end.

    Returns
    -------
    list of Stretch or Jump
        In the order in which they are met; the last is a Jump to -1 where no shape lasts.

    Notes
    -----
    Where a cable comes to rest after a jump needs its motion: a guess, as of `landing`.
    """
    found: list[Stretch | Jump] = []
    k, value = start, None
    while k >= 0:
        parts = _parts(branches[k], k, value, rising)
        left = next((i for i, part in enumerate(parts) if part.kind == "divergence"), len(parts))
        found += parts[:left]
        last = branches[k].points[-1 if rising else 0]
        if left == len(parts) and last.kind != "fold":
            break
        value = last.value if left == len(parts) else (parts[left].low if rising else parts[left].high)
        end = landing(branches, k, value)
        found.append(Jump(value, k, end))
        k = end
    return found


def _parts(branch: Branch, k: int, value: float | None, rising: bool) -> list[Stretch]:
    """Stretches of one branch beyond a value, neighbours of one kind together, in the order in which they are met."""
    spans: list[tuple[str, float, float]] = []
    for (low, high), kind in zip(pairwise(branch.points), branch.between, strict=True):
        begin, end = low.value, high.value
        if value is not None and rising:
            begin = max(begin, value)
        elif value is not None:
            end = min(end, value)
        if not begin < end:
            continue
        if spans and spans[-1][0] == kind:
            spans[-1] = (kind, spans[-1][1], end)
        else:
            spans.append((kind, begin, end))
    parts = [_stretch(branch, k, *span) for span in spans]
    return parts if rising else parts[::-1]


def _stretch(branch: Branch, k: int, kind: str, low: float, high: float) -> Stretch:
    inside = np.flatnonzero((branch.value >= low) & (branch.value <= high))
    if not len(inside):
        inside = np.array([int(np.argmin(np.abs(branch.value - 0.5 * (low + high))))])
    # One next to an edge may be of the neighbour's kind.
    same = branch.kind[inside] == kind
    if kind == "flutter" and not same.any():
        # It is that between samples of weak growth only.
        same = branch.kind[inside] == "weak"
    rates = np.where(same, branch.growth[inside], np.nan)
    growth, frequency = np.nan, np.nan
    if not np.isnan(rates).all():
        most = int(np.nanargmax(rates))
        growth, frequency = float(rates[most]), float(branch.frequency[inside[most]])
    nodes = branch.nodes[inside]
    return Stretch(k, kind, low, high, (int(nodes.min()), int(nodes.max())), growth, frequency)


def kind_at(branch: Branch, value: float) -> str:
    """What becomes of the shape of a branch at a value.

    Parameters
    ----------
    branch : Branch
    value : float
        Of what moves, between the ends of the branch.

    Returns
    -------
    str
    """
    at = int(np.searchsorted([point.value for point in branch.points], value)) - 1
    return branch.between[min(max(at, 0), len(branch.between) - 1)]


def radius_at(branch: Branch, value: float) -> float:
    """Distance of the fish from the axis.

    Parameters
    ----------
    branch : Branch
    value : float
        Of what moves.

    Returns
    -------
    float
        In the unit of the branch.
    """
    return float(np.interp(value, branch.value, branch.r_f))


def expected_at(branches: Sequence[Branch], value: float) -> int:
    """Which branch has the shape expected, as of `Equilibria`.

    Parameters
    ----------
    branches : sequence of Branch
    value : float
        Of what moves.

    Returns
    -------
    int
    """
    there = [k for k, branch in enumerate(branches) if branch.points[0].value <= value <= branch.points[-1].value]
    inner = [k for k in there if branches[k].name.endswith("inner")]
    if inner:
        return max(inner, key=lambda k: int(branches[k].name.split()[0]))
    return min(there, key=lambda k: radius_at(branches[k], value))


def landing(branches: Sequence[Branch], start: int, value: float) -> int:
    """Where a cable may land that leaves a shape: in the shape expected if that lasts, else in the nearest that does.

    Parameters
    ----------
    branches : sequence of Branch
    start : int
        Which it leaves.
    value : float
        Of what moves.

    Returns
    -------
    int
        -1 where none lasts.
    """
    inside = [k for k, one in enumerate(branches) if _passes(one, value) and k != start]
    lasting = [k for k in inside if kind_at(branches[k], value) in LASTING]
    if not lasting:
        return -1
    expected = expected_at([branches[k] for k in inside], value)
    if inside[expected] in lasting:
        return inside[expected]
    here = radius_at(branches[start], value)
    return min(lasting, key=lambda k: abs(np.log(radius_at(branches[k], value) / here)))


def _passes(branch: Branch, value: float) -> bool:
    """Whether a branch is there at a value, and does not just begin or end."""
    first, last = branch.points[0], branch.points[-1]
    after = first.value < value or (first.value == value and first.kind != "fold")
    return after and (value < last.value or (value == last.value and last.kind != "fold"))
