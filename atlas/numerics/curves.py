"""Curves of solutions of n - 1 equations in n unknowns, followed by arclength, many at once, with events on them.

A curve is known at points, with its direction there, and between them by cubics. Monitors are functions watched along
it: an event is where one of them changes sign.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.numerics.hermite import cubic
from towatlas.numerics.rows import Booleans, Integers, solve_systems

Array = NDArray[np.float64]
# Points (rows, n) and which rows -> values (rows, n - 1), Jacobian (rows, n - 1, n), monitors (rows, m), whether sound.
Equations = Callable[[Array, Integers], tuple[Array, Array, Array, Booleans]]
# Points, directions and monitors reached, and of which rows -> which curves end there.
Stop = Callable[[Array, Array, Array, Integers], Booleans]


@dataclass(frozen=True)
class Steps:
    """How a curve is followed.

    Attributes
    ----------
    first, longest, shortest : float
        Steps in arclength, > 0: after the point it begins with, at most, and below which it is given up.
    near : float
        A point is on the curve when Newton's correction is this short; > 0.
    bent : float
        A correction longer than this share of the step, 0 to 1, says that the curve has bent away: the step is halved.
    easy : int
        Corrections up to which the next step may be longer, by the factor `growth`; >= 0.
    growth : float
        >= 1.
    straight : float
        Least cosine of the angle between the directions of a point and the next, below 1: where it is smaller the step
        is halved, so that no step leads over to another curve, or back.
    corrections, points : int
        At most; >= 1.
    """

    first: float
    longest: float
    shortest: float
    near: float = 1e-4
    bent: float = 0.25
    easy: int = 2
    growth: float = 1.6
    straight: float = 0.0
    corrections: int = 6
    points: int = 200


@dataclass(frozen=True)
class Curve:
    """One curve.

    Attributes
    ----------
    points, tangents : ndarray, shape (points, n)
        Unknowns, and the direction of the curve, of length 1.
    monitors : ndarray, shape (points, m)
        Functions watched along it.
    complete : bool
        Whether it was followed to where it was to stop.
    """

    points: Array
    tangents: Array
    monitors: Array
    complete: bool

    def __len__(self) -> int:
        return len(self.points)

    def between(self, k: int, share: float) -> Array:
        """Point on the cubic between two points.

        Parameters
        ----------
        k : int
            The first of them.
        share : float
            Of the way to the next, 0 to 1.

        Returns
        -------
        ndarray, shape (n,)
        """
        a, b = self.points[k], self.points[k + 1]
        return cubic(a, b, self.tangents[k], self.tangents[k + 1], np.linalg.norm(b - a), share)

    def event(self, monitor: int = 0) -> int:
        """Which point is the last before a monitor first rises through zero.

        Parameters
        ----------
        monitor : int

        Returns
        -------
        int
            -1 if it never does.
        """
        values = self.monitors[:, monitor] if len(self) else np.empty(0)
        change = np.flatnonzero((values[:-1] < 0.0) & (values[1:] >= 0.0))
        return int(change[0]) if len(change) else -1

    def at_event(self, k: int, monitor: int = 0) -> Array:
        """Point where a monitor, taken as linear between points k and k + 1, is zero.

        Parameters
        ----------
        k : int
            From `event`.
        monitor : int

        Returns
        -------
        ndarray, shape (n,)
        """
        return self.between(k, self.share(k, monitor))

    def share(self, k: int, monitor: int = 0) -> float:
        """The share of the way from point k to the next at which a monitor, taken as linear, is zero.

        Parameters
        ----------
        k : int
            From `event`.
        monitor : int

        Returns
        -------
        float
            0 to 1.
        """
        a, b = self.monitors[k, monitor], self.monitors[k + 1, monitor]
        return float(a / (a - b))


def tangents(jacobian: Array) -> Array:
    """Directions that Jacobians map to zero.

    Parameters
    ----------
    jacobian : ndarray, shape (rows, n - 1, n)

    Returns
    -------
    ndarray, shape (rows, n)
        Of length 1.

    Notes
    -----
    The generalised cross product of the rows: component k is, up to sign, the minor without column k. Minors of the
    first rows, one row more at a time, give those of all.
    """
    equations, unknowns = jacobian.shape[1:]
    minors: dict[tuple[int, ...], Array] = {(k,): jacobian[:, 0, k] for k in range(unknowns)}
    for row in range(1, equations):
        larger: dict[tuple[int, ...], Array] = {}
        for columns in {tuple(sorted((*chosen, k))) for chosen in minors for k in range(unknowns) if k not in chosen}:
            total = np.zeros(len(jacobian))
            for place, k in enumerate(columns):
                rest = minors[columns[:place] + columns[place + 1 :]]
                total = total + (1.0 if (row + place) % 2 == 0 else -1.0) * jacobian[:, row, k] * rest
            larger[columns] = total
        minors = larger
    every = tuple(range(unknowns))
    direction = np.stack([(1.0 if k % 2 == 0 else -1.0) * minors[every[:k] + every[k + 1 :]] for k in every], axis=1)
    with np.errstate(invalid="ignore"):
        return direction / np.linalg.norm(direction, axis=1)[:, None]


def follow(equations: Equations, start: Array, tangent: Array, stop: Stop, steps: Steps) -> list[Curve]:
    """Curves through points near `start`, in the direction of `tangent`, until each is to stop.

    Parameters
    ----------
    equations : callable
        Points and which rows to values, Jacobian, monitors, and whether they are sound (`Equations`).
    start, tangent : ndarray, shape (rows, n)
        Rows of `start` with a nan are not followed: their curves have no points.
    stop : callable
        Points, directions and monitors reached, and of which rows, to which curves end there (`Stop`).
    steps : Steps

    Returns
    -------
    list of Curve
        One for each row.
    """
    rows = len(start)
    z, tangent = start.copy(), tangent.copy()
    step, bend = np.zeros(rows), np.zeros_like(start)
    active, complete = np.asarray(np.isfinite(start).all(axis=1)), np.zeros(rows, bool)
    history: list[list[tuple[Array, Array, Array]]] = [[] for _ in range(rows)]
    for _ in range(steps.points):
        i = np.flatnonzero(active)
        if not len(i):
            break
        reached, jacobian, monitors, good, easy = _correct(
            equations, _ahead(z[i], tangent[i], bend[i], step[i]), tangent[i], step[i], i, steps
        )
        new = tangents(jacobian)
        along = np.sum(new * tangent[i], axis=1)
        new *= np.where(along < 0.0, -1.0, 1.0)[:, None]
        good &= ~(np.abs(along) < steps.straight) | (step[i] == 0.0)
        step[i[~good]] *= 0.5
        active[i[~good & (step[i] < steps.shortest)]] = False
        k, new = i[good], new[good]
        z[k] = reached[good]
        done = stop(z[k], new, monitors[good], k)
        complete[k] |= done
        for row, *entry in zip(k, z[k], new, monitors[good], strict=True):
            history[row].append(tuple(entry))  # type: ignore[arg-type]
        with np.errstate(divide="ignore", invalid="ignore"):
            turned = (new - tangent[k]) / step[k, None]
        bend[k] = np.where(step[k, None] > 0.0, turned, 0.0)
        tangent[k] = new
        longer = step[k] * np.where(easy[good], steps.growth, 1.0)
        step[k] = np.where(step[k] == 0.0, steps.first, longer).clip(None, steps.longest)
        active[k[done]] = False
    return [_curve(entries, start.shape[1], bool(whole)) for entries, whole in zip(history, complete, strict=True)]


def _curve(entries: list[tuple[Array, Array, Array]], unknowns: int, complete: bool) -> Curve:
    points, directions, monitors = ([entry[k] for entry in entries] for k in range(3))
    return Curve(
        np.array(points).reshape(-1, unknowns),
        np.array(directions).reshape(-1, unknowns),
        np.array(monitors) if entries else np.empty((0, 0)),
        complete,
    )


def _ahead(z: Array, tangent: Array, bend: Array, step: Array) -> Array:
    """A step along the parabolas through points."""
    return z + step[:, None] * (tangent + 0.5 * step[:, None] * bend)


def _correct(
    equations: Equations, start: Array, tangent: Array, step: Array, rows: Integers, steps: Steps
) -> tuple[Array, Array, Array, Booleans, Booleans]:
    """Come back to the curve, across the tangents: points, Jacobians, monitors, success, and ease."""
    x = start.copy()
    count, unknowns = x.shape
    jacobian = np.full((count, unknowns - 1, unknowns), np.nan)
    watched: Array | None = None
    good, failed, easy = np.zeros(count, bool), np.zeros(count, bool), np.zeros(count, bool)
    for round_ in range(steps.corrections):
        i = np.flatnonzero(~good & ~failed)
        if not len(i):
            break
        value, jac, monitors, sound = equations(x[i], rows[i])
        if watched is None:
            watched = np.full((count, monitors.shape[1]), np.nan)
        jacobian[i], watched[i] = jac, monitors
        matrix = np.concatenate([jac, tangent[i][:, None, :]], axis=1)
        away = np.sum(tangent[i] * (start[i] - x[i]), axis=1)
        correction = solve_systems(matrix, np.concatenate([-value, away[:, None]], axis=1))
        size = np.linalg.norm(correction, axis=1)
        bad = ~sound | ~(size <= np.maximum(steps.bent * step[i], 0.1 * (step[i] == 0.0)))
        failed[i[bad]] = True
        x[i[~bad]] += correction[~bad]
        near = ~bad & (size < steps.near)
        good[i[near]] = True
        easy[i[near]] = round_ < steps.easy
    return x, jacobian, np.empty((count, 0)) if watched is None else watched, good, easy
