"""All shapes of a system as one of its numbers moves, and where two of them meet and are gone, or come to be.

Columns, all shapes at one value, are put side by side until each shape of one is plainly that of the next, or two of
them have met in a fold, solved for by Newton's method. Pairs that come and go between two columns show as extrema of
the radius of the tow point that are about to reach the tow radius: those are halved, too. So folds are found wherever
they come from, closed curves of shapes with them.
"""

from dataclasses import dataclass
from itertools import pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS
from towatlas.numerics.rows import EPS, newton
from towatlas.solve.jets import Jets
from towatlas.solve.looks import SLOPE
from towatlas.solve.search import search
from towatlas.solve.shots import Array, Ends, Integers, direction_of, shoot

Booleans = NDArray[np.bool_]
# Columns at first, in the logarithm of what moves; two so near that they are not halved again.
SPACING, FEWEST, NEAREST = 0.12, 9, 1e-10
ROUNDS = 48
# How far a shape may be from where the slopes at both columns have it: over the way to the next shape, and in x.
ASTRAY, ASTRAY_IN_X = 0.1, 0.01
# Extrema of log rho so near to zero are watched; which part of the way to the next column one may be from reaching it.
WATCHED, REACHES = 0.5, 0.6
# The same beside a fold, where others are more likely.
BESIDE_FOLD = 2.0
# For differences in x, on both sides, and in t.
BESIDE_X, BESIDE_T = 1e-5, 1e-7
# Newton's method for a fold.
FOLD_ROUNDS, LONGEST, SETTLED = 24, 1.0, 1e-11
ROUNDINGS = 64.0


@dataclass(frozen=True)
class Path:
    """Systems as one number moves by its logarithm t.

    Attributes
    ----------
    row : ndarray, shape (columns,)
        The system where t = 0, as of `System.row`.
    gamma : float
        The speed there [-]; a turn to port where negative.
    moved : tuple of str
        "gamma", or the columns of the system that move by one factor.
    """

    row: Array
    gamma: float
    moved: tuple[str, ...]

    @property
    def by_speed(self) -> bool:
        """Whether it is the speed that moves."""
        return self.moved == ("gamma",)

    def at(self, t: Array) -> tuple[Array, Array]:
        """Systems and speeds.

        Parameters
        ----------
        t : ndarray, shape (points,)

        Returns
        -------
        ndarray, shape (points, columns)
        ndarray, shape (points,)
        """
        factor = np.exp(t)
        rows = np.tile(self.row, (len(t), 1))
        gamma = np.full(len(t), self.gamma)
        if self.by_speed:
            return rows, gamma * factor
        chosen = [COLUMNS.index(name) for name in self.moved]
        rows[:, chosen] *= factor[:, None]
        return rows, gamma

    def shots(self, x: Array, t: Array, jets: Jets) -> Ends:
        """Shots from points.

        Parameters
        ----------
        x, t : ndarray, shape (points,)
            log of the radius of the fish over g / Omega^2.
        jets : Jets

        Returns
        -------
        Ends
        """
        rows, gamma = self.at(t)
        return shoot(np.exp(x), gamma, rows, jets, directions=direction_of(self.moved, rows))

    def log_rho(self, x: Array, t: Array) -> tuple[Array, Array, Booleans]:
        """log rho and its derivatives; all but itself and its slope by differences, to about 1e-5.

        Parameters
        ----------
        x, t : ndarray, shape (points,)
            log of the radius of the fish over g / Omega^2.

        Returns
        -------
        ndarray, shape (points, 3)
            log rho, its slope and its second derivative in x.
        ndarray, shape (points, 2)
            Derivatives of log rho and of its slope by t.
        ndarray of bool, shape (points,)
            Whether the shots were made.
        """
        # Slopes of four shots take a third of the time of one shot with all derivatives.
        every = np.concatenate([x, x, x - BESIDE_X, x + BESIDE_X]), np.concatenate([t, t + BESIDE_T, t, t])
        ends = self.shots(*every, SLOPE)
        here, later, inner, outer = ends.log_rho[:, :2].reshape(4, len(x), 2)
        bend = (outer[:, 1] - inner[:, 1]) / (2.0 * BESIDE_X)
        sound = (ends.status == status.OK) & np.isfinite(ends.log_rho).all(axis=1)
        return np.column_stack([here, bend]), (later - here) / BESIDE_T, sound.reshape(4, -1).all(axis=0)


@dataclass(frozen=True)
class Column:
    """All shapes at one t.

    Attributes
    ----------
    t : float
    x, moves, slopes, bends : ndarray, shape (shapes,)
        log of the radius of the fish, rising, how it moves with t, the slope of log rho there, and how that moves.
    peaks, heights, rises : ndarray, shape (extrema,)
        Where log rho has an extremum near zero, its height, and how that moves.
    whole : bool
        Whether all of the range of x was searched.
    """

    t: float
    x: Array
    moves: Array
    slopes: Array
    bends: Array
    peaks: Array
    heights: Array
    rises: Array
    whole: bool


@dataclass(frozen=True)
class Fold:
    """Where two shapes meet.

    Attributes
    ----------
    t, x : float
        There.
    error : float
        Of t, > 0.
    pair : int
        The first of the two in the column beside it that has them, >= 0.
    """

    t: float
    x: float
    error: float
    pair: int


@dataclass(frozen=True)
class Trace:
    """All shapes at values of t, each of which is plainly one of the next value's, or meets another in a fold between.

    Attributes
    ----------
    path : Path
    columns : list of Column
        In rising order of t.
    folds : list of Fold or None
        Between each and the next.
    certain : bool
        Whether all of that was made out, and each column was searched in whole.
    """

    path: Path
    columns: list[Column]
    folds: list[Fold | None]
    certain: bool

    def branches(self) -> list[Integers]:
        """Which branch each shape of each column is on: the same number as long as no fold ends it.

        Returns
        -------
        list of ndarray of int, shape (shapes,)
        """
        labels = [np.arange(len(self.columns[0].x))]
        fresh = len(labels[0])
        for fold, (a, b) in zip(self.folds, pairwise(self.columns), strict=True):
            old = labels[-1]
            if fold is not None and len(b.x) > len(a.x):
                old = np.insert(old, fold.pair, [fresh, fresh + 1])
                fresh += 2
            elif fold is not None:
                old = np.delete(old, [fold.pair, fold.pair + 1])
            elif len(a.x) != len(b.x):
                # Not made out: what follows has nothing to do with what was.
                old, fresh = np.arange(fresh, fresh + len(b.x)), fresh + len(b.x)
            labels.append(old)
        return labels


def _columns(path: Path, t: Array) -> list[Column]:
    rows, gamma = path.at(t)
    found = search(rows, gamma)
    near = np.abs(found.peaks[:, 2]) < WATCHED
    peak_row, peak = found.peaks[near, 0].astype(np.int64), found.peaks[near, 1]
    every = np.concatenate([found.row, peak_row])
    along, across, _ = path.log_rho(np.concatenate([found.x, peak]), t[every])
    count = len(found.x)
    with np.errstate(divide="ignore", invalid="ignore"):
        moves = -across[:count, 0] / along[:count, 1]
        bends = along[:count, 2] * moves + across[:count, 1]
    columns = []
    for k in range(len(t)):
        here, there = found.row == k, peak_row == k
        columns.append(
            Column(
                float(t[k]),
                found.x[here],
                moves[here],
                along[:count, 1][here],
                bends[here],
                peak[there],
                along[count:, 0][there],
                across[count:, 0][there],
                bool(found.status[k] == status.OK),
            )
        )
    return columns


def _goes_on(a: Column, b: Column, drop_a: int = -1, drop_b: int = -1) -> bool:
    """Whether the shapes of two columns are plainly the same, but for a pair of one of them."""
    keep_a = np.delete(np.arange(len(a.x)), [drop_a, drop_a + 1] if drop_a >= 0 else [])
    keep_b = np.delete(np.arange(len(b.x)), [drop_b, drop_b + 1] if drop_b >= 0 else [])
    x, y = a.x[keep_a], b.x[keep_b]
    if len(x) != len(y):
        return False
    apart = np.abs(y - x - 0.5 * (b.t - a.t) * (a.moves[keep_a] + b.moves[keep_b]))
    gaps = np.ones(len(x))
    for column, keep in ((a, keep_a), (b, keep_b)):
        between = np.diff(column.x)
        nearest = np.fmin(np.append(between, inf), np.insert(between, 0, inf))
        gaps = np.fmin(gaps, nearest[keep])
    return bool((apart <= np.fmin(ASTRAY * gaps, ASTRAY_IN_X)).all())


def _about_to(column: Column, step: float, fold: Fold | None = None, has_pair: bool = False) -> bool:
    """Whether within a step an extremum of a column may reach the tow radius, or a shape be where two more begin, but
    for a fold that is known, of a pair that the column has or has not.

    Where the slope at a shape falls towards zero and rises again there is a cusp near by, with two folds on one side
    of it, as close together as one likes.
    """
    reaches = column.heights * column.rises * step < 0.0
    reaches &= np.abs(column.heights) < (REACHES if fold is None else BESIDE_FOLD) * np.abs(column.rises * step)
    folds = column.slopes * column.bends * step < 0.0
    folds &= np.abs(column.slopes) < np.abs(column.bends * step)
    if fold is not None and reaches.any():
        reaches[np.argmin(np.where(reaches, np.abs(column.peaks - fold.x), inf))] = False
    if fold is not None and has_pair:
        folds[fold.pair : fold.pair + 2] = False
    return bool(reaches.any() or folds.any())


def solve_folds(path: Path, x: Array, t: Array) -> tuple[Array, Array, Array, Booleans, Booleans]:
    """Folds near guesses.

    Parameters
    ----------
    path : Path
    x, t : ndarray, shape (folds,)
        log of the radius of the fish over g / Omega^2, and where on the path.

    Returns
    -------
    x, t, error : ndarray, shape (folds,)
        The error is that of t.
    begins : ndarray of bool, shape (folds,)
        Whether two shapes begin there as t rises, or else meet.
    solved : ndarray of bool, shape (folds,)
    """
    rate, bend = np.full(len(x), np.nan), np.full(len(x), np.nan)

    def residuals(z: Array, i: Integers) -> tuple[Array, Array, Booleans]:
        along, across, sound = path.log_rho(z[:, 0], z[:, 1])
        rate[i], bend[i] = across[:, 0], along[:, 2]
        matrix = np.stack([along[:, 1], across[:, 0], along[:, 2], across[:, 1]], axis=1).reshape(-1, 2, 2)
        return along[:, :2], matrix, sound

    def settled(step: Array, size: Array, last: Array) -> Booleans:
        # At a fold t depends on x to the second order only: t is done before x.
        return (size < SETTLED) | (np.abs(step[:, 1]) < SETTLED) & (size > 0.5 * last) & (size < 1e-4)

    z, step, solved = newton(residuals, np.stack([x, t], axis=1), rounds=FOLD_ROUNDS, longest=LONGEST, settled=settled)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.abs(step[:, 1]) + ROUNDINGS * EPS / np.abs(rate)
    return z[:, 0], z[:, 1], error, rate * bend < 0.0, solved


def _meetings(path: Path, between: list[tuple[Column, Column]]) -> list[Fold | None]:
    """The folds in which a pair of one column meets before the other, where that is all that happens between them.

    All are solved for at once: few shots leave lanes idle.
    """
    each = [_candidates(a, b) if len(a.x) < len(b.x) else _candidates(b, a) for a, b in between]
    owner = np.repeat(np.arange(len(each)), [len(pairs) for pairs in each])
    if not len(owner):
        return [None] * len(between)
    pairs = np.concatenate(each)
    more = [a if len(a.x) > len(b.x) else b for a, b in between]
    inner, outer = (np.array([more[i].x[pair + k] for i, pair in zip(owner, pairs, strict=True)]) for k in (0, 1))
    guess = 0.5 * (inner + outer)
    x, t, error, begins, solved = solve_folds(path, guess, np.array([more[i].t for i in owner]))
    low, high = (np.array([columns[k].t for columns in between])[owner] for k in (0, 1))
    rising = np.array([len(b.x) > len(a.x) for a, b in between])[owner]
    good = solved & (t >= low) & (t <= high) & (np.abs(x - guess) < outer - inner) & (begins == rising)
    folds: list[Fold | None] = []
    for i in range(len(between)):
        found = np.flatnonzero(good & (owner == i))
        k = int(found[0]) if len(found) == 1 else -1
        folds.append(Fold(float(t[k]), float(x[k]), float(error[k]), int(pairs[k])) if k >= 0 else None)
    return folds


def _candidates(fewer: Column, more: Column) -> Integers:
    """The first of each two shapes of a column without which it goes on as the other."""
    if len(more.x) != len(fewer.x) + 2:
        return np.empty(0, np.int64)
    return np.array([k for k in range(len(more.x) - 1) if _goes_on(fewer, more, drop_b=k)], np.int64)


def trace(path: Path, low: float, high: float, at: Array | None = None) -> Trace:
    """All shapes of a path, and all its folds, with t between two values.

    Parameters
    ----------
    path : Path
    low, high : float
        Of t, low < high.
    at : ndarray, shape (values,), optional
        Values of t between them to be among those that are looked at.

    Returns
    -------
    Trace
    """
    count = max(FEWEST, int(np.ceil((high - low) / SPACING)) + 1)
    columns = _columns(path, np.union1d(np.linspace(low, high, count), [] if at is None else at))
    certain = all(column.whole for column in columns)
    open_ = [True] * (len(columns) - 1)
    folds: list[Fold | None] = [None] * (len(columns) - 1)
    for _ in range(ROUNDS):
        halved: list[int] = []
        differing = [k for k, (a, b) in enumerate(pairwise(columns)) if open_[k] and len(a.x) != len(b.x)]
        for k, fold in zip(differing, _meetings(path, [(columns[k], columns[k + 1]) for k in differing]), strict=True):
            folds[k] = fold
        for k, (a, b) in enumerate(pairwise(columns)):
            if not open_[k]:
                continue
            step, fold = b.t - a.t, folds[k]
            plain = fold is not None or (len(a.x) == len(b.x) and _goes_on(a, b))
            plain = plain and not _about_to(a, step, fold, len(a.x) > len(b.x))
            plain = plain and not _about_to(b, -step, fold, len(b.x) > len(a.x))
            if plain:
                open_[k] = False
            elif step > NEAREST:
                halved.append(k)
            else:
                open_[k], certain = False, False
        if not halved:
            break
        new = _columns(path, np.array([0.5 * (columns[k].t + columns[k + 1].t) for k in halved]))
        certain &= all(column.whole for column in new)
        for k, column in zip(reversed(halved), reversed(new), strict=True):
            columns.insert(k + 1, column)
            open_[k : k + 1] = [True, True]
            folds[k : k + 1] = [None, None]
    return Trace(path, columns, folds, certain and not any(open_))
