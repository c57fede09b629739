"""Bifurcation diagrams: all branches of shapes of one cable over its speed or its length, and what of them lasts."""

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_speed
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.results_motion import Array, Branch, Diagram, Point
from towatlas.solve.drag_equilibria import quantities
from towatlas.solve.flutter import looked_at
from towatlas.solve.follower import Follower, Mode, Sample, followed
from towatlas.solve.paths import Fold
from towatlas.system import System

SHOWN = ("x_f", "r_f", "z_f", "tension")


def diagram(
    lam: float,
    w_f: float,
    gamma: Sequence[float],
    *,
    C: float = 0.0,
    m_f: float | None = None,
    C_f: float = 0.0,
    w: float = 1.0,
    C_t: float = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> Diagram:
    """All branches of shapes of a towed cable between two speeds, with what lasts.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0.
    w_f : float
        Fish weight over (mu + rho A) g R [-].
    gamma : (float, float)
        From which speed Omega sqrt(R/g) to which [-], > 0, a turn to starboard; one to port is its mirror image, with
        -C_s.
    C, m_f, C_f, w, C_t, C_s, b_s : float
        The fluid, as in `equilibria`; a vacuum by default.

    Returns
    -------
    Diagram

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If shapes cannot be computed, or the work takes longer than `towatlas.patience` allows (TooMuchWork).

    Examples
    --------
    >>> diagram(10, 1, (0.3, 0.6)).branches[0]
    Branch 'outward': 0.3 (range) stable 0.6 (range)
    """
    low, high = (check_speed(speed) for speed in gamma)
    if not 0.0 < low < high:
        raise ValueError(f"gamma must be two positive speeds, the lower first, got {gamma!r}")
    with patience():
        return diagram_of(System.of(lam, w_f, C=C, m_f=m_f, C_f=C_f, w=w, C_t=C_t, C_s=C_s, b_s=b_s), low, high)


def diagram_of(system: System, low: float, high: float, *, gamma: float | None = None) -> Diagram:
    """As `diagram`, of a system already checked, or over the length of its cable.

    Parameters
    ----------
    system : System
    low, high : float
        Speeds [-], 0 < low < high; lengths, where a speed is given.
    gamma : float, optional
        The speed, > 0, where it is the length that moves [-].

    Returns
    -------
    Diagram
    """
    traced, follower = followed(system, low, high, gamma=gamma)
    branches, counted = [], True
    for samples, began, ended in follower.branches(traced):
        counted &= all(sample.spectrum.status == status.OK for sample in samples)
        modes = follower.modes(samples, began, ended)
        branches.append(_branch(follower, samples, modes, began, ended))
    order = sorted(branches, key=lambda branch: (branch.value[0], -branch.r_f[-1]))
    certain, moved = traced.certain and counted, follower.path.moved[0]
    about = looked_at(low, high, traced.certain, counted, moved)
    return Diagram(system, moved, low, high, tuple(order), certain, about)


def _branch(
    follower: Follower, samples: list[Sample], modes: list[Mode], began: Fold | None, ended: Fold | None
) -> Branch:
    t = np.array([sample.t for sample in samples])
    values, speeds = (np.array([of(one) for one in t]) for of in (follower.value, follower.speed))
    columns = _columns(follower, np.array([sample.x for sample in samples]), t)
    leading = np.array([sample.spectrum.leading for sample in samples])
    kinds = np.array([sample.spectrum.kind for sample in samples], np.str_)

    def point(kind: str, at: float, fold: Fold | None = None) -> Point:
        if fold is None:
            heights = {name: float(np.interp(at, t, columns[name])) for name in SHOWN}
        else:
            found = _columns(follower, np.array([fold.x]), np.array([at]))
            heights = {name: float(found[name][0]) for name in SHOWN}
        return Point(kind, follower.value(at), **heights)

    ends = [
        point("range" if fold is None else "fold", (fold or sample).t, fold)
        for fold, sample in ((began, samples[0]), (ended, samples[-1]))
    ]
    edges = {(edge.t, edge.kind) for mode in modes for edge in (mode.start, mode.end)}
    inner = sorted((at, kind) for at, kind in edges if kind in ("hopf", "krein", "unknown"))
    points = [ends[0], *(point(kind, at) for at, kind in inner), ends[1]]
    between = _between(values, kinds, points)
    for k, (low, high) in enumerate(pairwise([t[0], *(at for at, _ in inner), t[-1]])):
        strong = [mode for mode in modes if between[k] == "weak" and follower.is_strong(mode, low, high)]
        if strong:
            between[k] = "flutter" if any(mode.sigma[-1].imag for mode in strong) else "divergence"
    return Branch(
        name=follower.name(samples, began),
        value=values,
        gamma=speeds,
        nodes=columns["nodes"],
        **{name: columns[name] for name in SHOWN},
        growth=leading.real * speeds,
        frequency=leading.imag * speeds,
        unstable=np.array([sample.spectrum.unstable for sample in samples]),
        kind=kinds,
        points=tuple(points),
        between=tuple(between),
    )


def _columns(follower: Follower, x: Array, t: Array) -> dict[str, Any]:
    rows, speeds = follower.path.at(t)
    return quantities(np.arange(len(x)), x, rows, speeds)


def _between(values: Array, kinds: NDArray[np.str_], points: list[Point]) -> list[str]:
    """The kind that most samples have between each point and the next, the nearest where there is none.

    What flutters somewhere in a stretch of weak growth is a window of flutter, and what is not everywhere known to last
    is not said to."""
    found = []
    for low, high in pairwise(points):
        inside = kinds[(values >= low.value) & (values <= high.value)]
        if not len(inside):
            inside = kinds[[int(np.argmin(np.abs(values - 0.5 * (low.value + high.value))))]]
        names, counts = np.unique(inside, return_counts=True)
        kind = str(names[np.argmax(counts)])
        if kind == "weak" and "flutter" in names:
            kind = "flutter"
        found.append("unknown" if kind in ("stable", "weak") and "unknown" in names else kind)
    return found
