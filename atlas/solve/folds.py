"""All folds of a system as one of its numbers moves: where two of its shapes meet and are gone, or come to be.

Columns, all shapes at one value, are put side by side until each shape of one is plainly that of the next, or two of
them have met in a fold, solved for by Newton's method. Pairs that come and go between two columns show as extrema of
the radius of the tow point that are about to reach the tow radius: those are halved, too. So folds are found wherever
they come from, closed curves of shapes with them. Which fold of the vacuum one comes from is found by following it to
where there is no fluid.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_real, check_speed
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS, M_F, W_F, W
from towatlas.numerics.curves import Steps, follow
from towatlas.numerics.rows import EPS, newton
from towatlas.results import Folds
from towatlas.solve.critical import solve_critical
from towatlas.solve.jets import Jets, jets_of
from towatlas.solve.passed import folds_passed
from towatlas.solve.search import search
from towatlas.solve.shots import Array, Integers, direction_of, shoot
from towatlas.system import System

Booleans = NDArray[np.bool_]
# Columns at first, in the logarithm of what moves; two so near that they are not halved again.
SPACING, FEWEST, NEAREST = 0.12, 9, 1e-10
ROUNDS = 48
# How far a shape may be from where the slopes at both columns have it: over the way to the next shape, and in x.
ASTRAY, ASTRAY_IN_X = 0.1, 0.01
# Extrema of log rho so near to zero are watched; which part of the way to the next column one may be from reaching it.
WATCHED, REACHES = 0.5, 0.6
# Newton's method for a fold.
FOLD_ROUNDS, LONGEST, SETTLED = 24, 1.0, 1e-11
ROUNDINGS = 64.0
# The way to the vacuum: so little of the fluid is none; speeds and fluids at which it is given up.
FAINT = 1e-6
SLOWEST, FASTEST, DENSEST = 1e-5, 1e3, 30.0
STEPS = Steps(first=2.0, longest=2.0, shortest=1e-2)


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

    def jets(self, degree: int) -> Jets:
        """Jets in log r to a degree, and in t.

        Parameters
        ----------
        degree : int

        Returns
        -------
        Jets
        """
        return jets_of(degree, gamma=self.by_speed, parameter=not self.by_speed)

    def log_rho(self, x: Array, t: Array, degree: int) -> tuple[Array, Array, Booleans]:
        """log rho and its derivatives.

        Parameters
        ----------
        x, t : ndarray, shape (points,)
            log of the radius of the fish over g / Omega^2 - at fixed radius over the tow radius, t moves the speed.
        degree : int
            Highest derivative in x.

        Returns
        -------
        ndarray, shape (points, degree + 1)
            Derivatives in x.
        ndarray, shape (points, degree)
            Those of the first by t.
        ndarray of bool, shape (points,)
            Whether the shots were made.
        """
        rows, gamma = self.at(t)
        jets = self.jets(degree)
        ends = shoot(np.exp(x), gamma, rows, jets, directions=direction_of(self.moved, rows))
        factorial = np.cumprod([1.0, *range(1, degree + 1)])
        along = [factorial[k] * ends.log_rho[:, jets.at(k, 0, 0)] for k in range(degree + 1)]
        place = (lambda k: (k, 1, 0)) if self.by_speed else (lambda k: (k, 0, 1))
        across = [factorial[k] * ends.log_rho[:, jets.at(*place(k))] for k in range(degree)]
        sound = (ends.status == status.OK) & np.isfinite(ends.log_rho).all(axis=1)
        return np.stack(along, axis=1), np.stack(across, axis=1), sound


@dataclass(frozen=True)
class _Column:
    """All shapes at one t: x of each, how it moves with t, the slope of log rho there and how that moves; extrema near
    zero, their height and how that moves."""

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
class _Fold:
    t: float
    x: float
    error: float


def _columns(path: Path, t: Array) -> list[_Column]:
    rows, gamma = path.at(t)
    found = search(rows, gamma)
    near = np.abs(found.peaks[:, 2]) < WATCHED
    peak_row, peak = found.peaks[near, 0].astype(np.int64), found.peaks[near, 1]
    every = np.concatenate([found.row, peak_row])
    along, across, _ = path.log_rho(np.concatenate([found.x, peak]), t[every], 2)
    count = len(found.x)
    with np.errstate(divide="ignore", invalid="ignore"):
        moves = -across[:count, 0] / along[:count, 1]
        bends = along[:count, 2] * moves + across[:count, 1]
    columns = []
    for k in range(len(t)):
        here, there = found.row == k, peak_row == k
        columns.append(
            _Column(
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


def _goes_on(a: _Column, b: _Column, drop_a: int = -1, drop_b: int = -1) -> bool:
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


def _about_to(column: _Column, step: float) -> bool:
    """Whether within a step an extremum of a column may reach the tow radius, or a shape be where two more begin.

    Where the slope at a shape falls towards zero and rises again there is a cusp near by, with two folds on one side
    of it, as close together as one likes.
    """
    reaches = column.heights * column.rises * step < 0.0
    reaches &= np.abs(column.heights) < REACHES * np.abs(column.rises * step)
    folds = column.slopes * column.bends * step < 0.0
    folds &= np.abs(column.slopes) < np.abs(column.bends * step)
    return bool(reaches.any() or folds.any())


def _solve_folds(path: Path, x: Array, t: Array) -> tuple[Array, Array, Array, Booleans]:
    """Folds near guesses: x, t, error of t, and whether they were found."""
    rate = np.full(len(x), np.nan)

    def residuals(z: Array, i: Integers) -> tuple[Array, Array, Booleans]:
        along, across, sound = path.log_rho(z[:, 0], z[:, 1], 2)
        rate[i] = across[:, 0]
        matrix = np.stack([along[:, 1], across[:, 0], along[:, 2], across[:, 1]], axis=1).reshape(-1, 2, 2)
        return along[:, :2], matrix, sound

    def settled(step: Array, size: Array, last: Array) -> Booleans:
        # At a fold t depends on x to the second order only: t is done before x.
        return (size < SETTLED) | (np.abs(step[:, 1]) < SETTLED) & (size > 0.5 * last) & (size < 1e-4)

    z, step, solved = newton(residuals, np.stack([x, t], axis=1), rounds=FOLD_ROUNDS, longest=LONGEST, settled=settled)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.abs(step[:, 1]) + ROUNDINGS * EPS / np.abs(rate)
    return z[:, 0], z[:, 1], error, solved


def _meeting(path: Path, fewer: _Column, more: _Column) -> _Fold | None:
    """The fold in which a pair of one column meets before the other, if that is all that happens between them."""
    if len(more.x) != len(fewer.x) + 2:
        return None
    low, high = sorted((fewer.t, more.t))
    pairs = np.array([k for k in range(len(more.x) - 1) if _goes_on(fewer, more, drop_b=k)], np.int64)
    if not len(pairs):
        return None
    guess = 0.5 * (more.x[pairs] + more.x[pairs + 1])
    x, t, error, solved = _solve_folds(path, guess, np.full(len(pairs), more.t))
    gap = more.x[pairs + 1] - more.x[pairs]
    good = solved & (t >= low) & (t <= high) & (np.abs(x - guess) < gap)
    if good.sum() != 1:
        return None
    k = int(np.flatnonzero(good)[0])
    return _Fold(float(t[k]), float(x[k]), float(error[k]))


def find_folds(path: Path, low: float, high: float) -> tuple[list[tuple[_Fold, int, int]], int, bool]:
    """All folds of a path with t between two values.

    Parameters
    ----------
    path : Path
    low, high : float
        Of t, low < high.

    Returns
    -------
    list of (fold, int, int)
        In rising order of t, with the number of shapes below and above each.
    int
        Number of columns looked at.
    bool
        Whether every pair of columns was made out, and each was searched in whole.
    """
    count = max(FEWEST, int(np.ceil((high - low) / SPACING)) + 1)
    columns = _columns(path, np.linspace(low, high, count))
    total, certain = count, all(column.whole for column in columns)
    open_ = [True] * (count - 1)
    folds: list[_Fold | None] = [None] * (count - 1)
    for _ in range(ROUNDS):
        halved: list[int] = []
        for k, (a, b) in enumerate(pairwise(columns)):
            if not open_[k]:
                continue
            step = b.t - a.t
            if len(a.x) == len(b.x):
                plain = _goes_on(a, b) and not _about_to(a, step) and not _about_to(b, -step)
            else:
                folds[k] = _meeting(path, a, b) if len(a.x) < len(b.x) else _meeting(path, b, a)
                plain = folds[k] is not None
            if plain:
                open_[k] = False
            elif step > NEAREST:
                halved.append(k)
            else:
                open_[k], certain = False, False
        if not halved:
            break
        new = _columns(path, np.array([0.5 * (columns[k].t + columns[k + 1].t) for k in halved]))
        total += len(new)
        certain &= all(column.whole for column in new)
        for k, column in zip(reversed(halved), reversed(new), strict=True):
            columns.insert(k + 1, column)
            open_[k : k + 1] = [True, True]
            folds[k : k + 1] = [None, None]
    certain &= not any(open_)
    found = [(fold, len(columns[k].x), len(columns[k + 1].x)) for k, fold in enumerate(folds) if fold is not None]
    return found, total, certain


def folds(
    lam: float | Sequence[float],
    w_f: float | Sequence[float],
    gamma: float | Sequence[float],
    *,
    C: float | Sequence[float] = 0.0,
    m_f: float | None = None,
    C_f: float | Sequence[float] = 0.0,
    w: float = 1.0,
    C_t: float | Sequence[float] = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> Folds:
    """All folds of a towed cable in any medium, as its speed moves between two values, or one of its other numbers.

    At each of them the number of shapes changes by two: a cable that sits in one of the two has to jump.

    Parameters
    ----------
    lam : float or (float, float)
        Cable length over tow radius [-], > 0. Of lam, w_f, gamma, C, C_f and C_t exactly one is a pair (low, high):
        that one moves, the others stay.
    w_f : float or (float, float)
        Fish weight over (mu + rho A) g R [-]; its mass moves with it unless m_f is given.
    gamma : float or (float, float)
        Speed Omega sqrt(R/g) [-]; negative in a turn to port.
    C : float or (float, float)
        Drag constant of the cable [-], >= 0.
    m_f : float, optional
        Fish mass over (mu + rho A) R [-], >= 0; equal to w_f by default.
    C_f : float or (float, float)
        Drag constant of the fish [-], >= 0.
    w : float
        Weight of the cable [-], above -1, at most 1.
    C_t : float or (float, float)
        Tangential drag constant of the cable [-], >= 0.
    C_s, b_s : float
        Side force constant of a stranded cable, and the sine at which that force is largest [-], as of `equilibria`.

    Returns
    -------
    Folds
        In rising order of what moves.

    Raises
    ------
    ValueError
        For numbers out of range, and where not exactly one of them is a pair.

    Notes
    -----
    At a fold log rho = 0, rho the radius at the tow point over the tow radius, and its slope in log r_f is 0. All
    shapes are found at values SPACING apart in the logarithm and closer, until between neighbours nothing happens that
    the slopes of shapes and of extrema do not tell, or one fold. That none is missed is not proved: a pair of folds
    nearer to each other than that whose extremum none of the values shows would be.

    In a vacuum the folds in speed are the critical speeds gamma_cn, and proved to be all.

    References
    ----------
    The equations: NRL Report 7048, Eqs. (12)-(23).

    Examples
    --------
    >>> found = folds(16, 3, (2, 3), C=5.6)
    >>> [round(float(g), 6) for g in found.gamma], found.shapes_above.tolist(), str(found.origin[0])
    ([2.327475], [3], 'drag')
    """
    given = {"lam": lam, "w_f": w_f, "gamma": gamma, "C": C, "C_f": C_f, "C_t": C_t}
    arrays = {name: check_real(name, value) for name, value in given.items()}
    pairs = [name for name, array in arrays.items() if array.ndim]
    if len(pairs) != 1:
        raise ValueError(
            f"exactly one of {', '.join(given)} must be a pair (low, high), the one that moves; got {len(pairs)}"
        )
    (name,) = pairs
    ends = arrays[name]
    if ends.shape != (2,) or not np.isfinite(ends).all() or not ends[0] < ends[1] or not ends[0] * ends[1] > 0.0:
        raise ValueError(f"{name} must be two finite numbers of one sign, low < high, got {given[name]!r}")
    numbers = {key: float(array) if key != name else float(ends[0]) for key, array in arrays.items()}
    low, high = sorted(np.abs(ends))
    speed = check_speed(numbers.pop("gamma"))
    if name == "gamma":
        speed = float(np.copysign(low, speed))
    system = System.of(**numbers, m_f=m_f, w=w, C_s=C_s, b_s=b_s)
    moved = ("w_f", "m_f") if name == "w_f" and m_f is None else (name,)
    with patience():
        if name == "gamma":
            return folds_in_speed(system, speed, float(np.copysign(high, speed)))
        return solve_folds_between(system, speed, moved, high / low)


def folds_in_speed(system: System, low: float, high: float, named: bool = True) -> Folds:
    """Folds of a system between two speeds; no checks.

    Parameters
    ----------
    system : System
    low, high : float
        [-], of one sign, the slower first.
    named : bool
        Whether it is found out where each comes from, which takes longer than finding them; else `name_folds` does it.

    Returns
    -------
    Folds
    """
    if system.in_vacuum:
        return _in_vacuum(system, abs(low), abs(high), np.sign(low))
    return solve_folds_between(system, low, ("gamma",), high / low, named)


def name_folds(folds: Folds) -> Folds:
    """Folds in speed with n and origin.

    Parameters
    ----------
    folds : Folds
        From `folds_in_speed`.

    Returns
    -------
    Folds
    """
    if folds.system.in_vacuum:
        return folds
    x = np.log(folds.r_f * np.square(folds.gamma))
    n = _numbers(x, np.tile(folds.system.row(), (len(x), 1)), folds.gamma, folds.system.w_f >= 0.0)
    return replace(folds, n=n, origin=_origins(n))


def _origins(n: Integers) -> NDArray[np.str_]:
    return np.where(n > 0, "vacuum", "drag").astype(np.str_)


def solve_folds_between(
    system: System, gamma: float, moved: tuple[str, ...], factor: float, named: bool = True
) -> Folds:
    """Folds from a system to what it becomes as some of its numbers grow by a factor; no checks.

    Parameters
    ----------
    system : System
    gamma : float
        Speed [-]; a turn to port where negative.
    moved : tuple of str
        "gamma", or names of numbers of the system.
    factor : float
        > 1.
    named : bool
        Whether it is found out where each comes from.

    Returns
    -------
    Folds
    """
    by_speed = moved == ("gamma",)
    path = Path(system.row(), gamma, moved)
    found, columns, certain = find_folds(path, 0.0, float(np.log(factor)))
    t = np.array([fold.t for fold, _, _ in found])
    x = np.array([fold.x for fold, _, _ in found])
    rows, speeds = path.at(t)
    n = _numbers(x, rows, speeds, named and system.w_f >= 0.0)
    first = gamma if by_speed else getattr(system, moved[0])
    name = moved[0]
    searched = (
        f"{name} {first:.6g} to {first * factor:.6g}, all shapes at {columns} values of it, at most {SPACING:g} apart "
        "in its logarithm and closer until the shapes of neighbours were each other's; "
        + ("that there are no others is not proved" if certain else "not everywhere made out: some may be missing")
    )
    return Folds(
        system=system,
        moved=name,
        value=first * np.exp(t),
        gamma=speeds,
        r_f=np.exp(x) / np.square(speeds),
        shapes_below=np.array([below for _, below, _ in found], np.int64),
        shapes_above=np.array([above for _, _, above in found], np.int64),
        n=n,
        # Not found out is neither.
        origin=_origins(n) if named else np.full(len(n), ""),
        error=np.array([fold.error for fold, _, _ in found]),
        status=np.full(len(t), status.OK, np.int8),
        complete=certain,
        searched=searched,
    )


def _in_vacuum(system: System, low: float, high: float, sign: float) -> Folds:
    """Critical speeds between two: all there are."""
    passed = folds_passed(lam=np.full(2, system.lam), w_f=np.full(2, system.w_f), gamma=np.array([low, high]))
    n = np.arange(passed[0] + 1, passed[1] + 1)
    states = solve_critical(system.lam, system.w_f, n)
    return Folds(
        system=system,
        moved="gamma",
        value=sign * states.gamma,
        gamma=sign * states.gamma,
        r_f=np.abs(states.x_f),
        shapes_below=2 * n - 1,
        shapes_above=2 * n + 1,
        n=n,
        origin=np.full(len(n), "vacuum"),
        error=states.error,
        status=states.status,
        complete=True,
        searched=f"gamma {low:.6g} to {high:.6g}: all critical speeds of the vacuum, which are counted",
    )


def _numbers(x: Array, rows: Array, gamma: Array, heavy: bool) -> Integers:
    """Numbers of the folds of the vacuum that folds are continued from; 0 for those that drag makes.

    Each is followed, one way and the other, along the curve of folds of systems between the vacuum and its own and
    beyond.
    """
    n = np.zeros(len(x), np.int64)
    if not heavy or not len(x):
        return n
    empty = rows.copy()
    empty[:, M_F], empty[:, W] = rows[:, W_F], 1.0
    empty[:, [COLUMNS.index(name) for name in ("C", "C_f", "C_t", "C_s")]] = 0.0
    fluid = np.where(np.isfinite(rows), rows - np.where(np.isfinite(rows), empty, 0.0), 0.0)
    faint = np.log(FAINT / np.maximum(1.0, np.abs(fluid).max(axis=1)))
    for way in (-1.0, 1.0):
        left = np.flatnonzero(n == 0)
        start = np.stack([x[left], np.log(np.abs(gamma[left])), np.zeros(len(left))], axis=1)
        n[left] = _follow(start, way, empty[left], fluid[left], np.sign(gamma[left]), faint[left])
    return n


def _follow(start: Array, way: float, empty: Array, fluid: Array, sign: Array, faint: Array) -> Integers:
    """Nodes of folds where the curves through them come to the vacuum; 0 where they do not."""
    jets = jets_of(2, gamma=True, parameter=True)
    at = jets.at

    def equations(z: Array, i: Integers) -> tuple[Array, Array, Array, Booleans]:
        share = np.exp(z[:, 2])[:, None]
        rows, moved = empty[i] + share * fluid[i], share * fluid[i]
        ends = shoot(np.exp(z[:, 0]), sign[i] * np.exp(z[:, 1]), rows, jets, directions=moved)
        jet = ends.log_rho
        value = np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1)
        along_value = np.stack([value[:, 1], jet[:, at(0, 1, 0)], jet[:, at(0, 0, 1)]], axis=1)
        along_slope = np.stack([2.0 * jet[:, at(2, 0, 0)], jet[:, at(1, 1, 0)], jet[:, at(1, 0, 1)]], axis=1)
        sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1) & (rows[:, W] > -1.0)
        nodes = np.floor(ends.angle / np.pi + 0.5)
        return value, np.stack([along_value, along_slope], axis=1), nodes[:, None], sound

    def stop(z: Array, direction: Array, nodes: Array, i: Integers) -> Booleans:
        out = (z[:, 1] > np.log(FASTEST)) | (z[:, 1] < np.log(SLOWEST)) | (z[:, 2] > np.log(DENSEST))
        return out | (z[:, 2] < faint[i])

    curves = follow(equations, start, np.tile([0.0, 0.0, way], (len(start), 1)), stop, STEPS)
    n = np.zeros(len(start), np.int64)
    for k, curve in enumerate(curves):
        if len(curve) and curve.points[-1, 2] < faint[k]:
            n[k] = int(curve.monitors[-1, 0])
    return n
