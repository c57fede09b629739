"""Growth rates on their grid, curves of Krein collisions, the sheets through them, and what all these are wrong by."""

from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from towatlas.builders.grids import StabilityGrid
from towatlas.kernels import status
from towatlas.limits import unchecked_threshold_length
from towatlas.numerics.errormap import stated_error
from towatlas.numerics.lagrange import middles
from towatlas.results_motion import Boundary
from towatlas.solve.critical import solve_rows
from towatlas.solve.krein import SPEED, Collisions, Domain, S, X, begins, boundaries
from towatlas.solve.members import shoot_lanes, solve_members
from towatlas.solve.spectra import growth_columns
from towatlas.system import nondense_rows
from towatlas.tables.stability import GrowthGrid, StabilityAxes, cell_of, sheet_at

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# A collision solved for is no farther than this from where it was expected, in log gamma and in s: of a guess
# along a curve, and from a neighbour.
NEAR, FAR = 0.05, 0.1
# Rounds of Newton's method: one that needs more was no neighbour.
ROUNDS = 8
# Two of them this near to each other, in log gamma and s, are one.
SAME = 1e-6


@dataclass(frozen=True)
class Rates:
    """Growth rates of shapes over Omega; what is not known is nan and -1.

    Attributes
    ----------
    growth, frequency, error, offset : ndarray
        offset is the logarithm of that of the fish over g / Omega^2.
    unstable : ndarray of int
    """

    growth: Array
    frequency: Array
    error: Array
    offset: Array
    unstable: Integers


def domain_of(axes: StabilityAxes) -> Domain:
    """That of curves: they are followed down to the fold.

    Parameters
    ----------
    axes : StabilityAxes

    Returns
    -------
    Domain
    """
    return Domain((axes.excess_min, axes.excess_max), axes.speed_max)


def folds_at(n: int, *, excess: Array, w_f: Array) -> Array:
    """gamma_cn.

    Parameters
    ----------
    n : int
    excess, w_f : ndarray, shape (points,)

    Returns
    -------
    ndarray, shape (points,)
    """
    lam = unchecked_threshold_length(w_f, n) + excess
    return np.asarray(solve_rows(lam=lam, w_f=w_f, n=np.full(len(w_f), n), excess=excess)["gamma"])


def rates_at(n: int, *, excess: Array, w_f: Array, gamma: Array) -> Rates:
    """Growth rates of inner shapes, solved directly; neighbours next to each other are fastest.

    Parameters
    ----------
    n : int
    excess, w_f, gamma : ndarray, shape (points,)

    Returns
    -------
    Rates
    """
    count = len(gamma)
    lam, orders = unchecked_threshold_length(w_f, n) + excess, np.full(count, n)
    shapes = solve_members(lam=lam, w_f=w_f, gamma=gamma, n=orders, outer=np.zeros(count, bool), shoot=shoot_lanes)
    known = np.where(shapes.status == status.OK, np.abs(shapes.x_f), np.nan)[:, None]
    found = growth_columns(
        nondense_rows(lam=lam, w_f=w_f, C=np.zeros(count)),
        gamma,
        r_f=known,
        nodes=orders[:, None],
        index=2 * orders[:, None],
        error=shapes.error[:, None],
    )
    growth, frequency, error = (found[name][:, 0] / gamma for name in ("growth", "frequency", "growth_error"))
    counted = (found["growth_status"][:, 0] == status.OK) & np.isfinite(growth)
    unstable = np.where(counted, found["unstable"][:, 0], -1)
    return Rates(growth, frequency, error, np.log(shapes.a), unstable)


def on_grid(grid: StabilityGrid, n: int, at_middles: bool, bar: tqdm) -> Rates:
    """Growth rates at nodes, or in the middle of cells.

    Parameters
    ----------
    grid : StabilityGrid
    n : int
    at_middles : bool
    bar : tqdm

    Returns
    -------
    Rates
        Of shape (w_f, excess, speed).
    """
    axes = grid.axes
    y, x, v = (np.linspace(-1.0, 1.0, count) for count in (grid.w_f, grid.excess, grid.speed))
    if at_middles:
        y, x, v = middles(y), middles(x), middles(v)
    rows = []
    for w_f in axes.w_f.value(y):
        excess = np.repeat(axes.excess.value(x), len(v))
        weights = np.full(len(excess), w_f)
        ratio = np.exp(np.tile(axes.root.value(v), len(x)) ** 2)
        rows.append(rates_at(n, excess=excess, w_f=weights, gamma=ratio * folds_at(n, excess=excess, w_f=weights)))
        bar.update(len(excess))
    shape = len(y), len(x), len(v)
    return Rates(*(np.stack([getattr(row, name) for row in rows]).reshape(shape) for name in Rates.__annotations__))


def growth_errors(nodes: Rates, between: Rates, crossed: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Absolute errors of growth and frequency over gamma in each cell; nan where it is not to be interpolated.

    Parameters
    ----------
    nodes, between : Rates
        At nodes and in the middle of cells.
    crossed : ndarray of bool, of the shape of the cells
        Which cells boundaries pass.

    Returns
    -------
    tuple of ndarray, of the shape of the cells
    """
    held = GrowthGrid(nodes.growth, nodes.frequency, nodes.unstable)
    places = np.meshgrid(*(middles(axis) for axis in held.nodes), indexing="ij")
    y, x, v = (part.ravel() for part in places)
    growth, frequency, unstable = (part.reshape(between.growth.shape) for part in held.at((y, x, v)))
    same = (unstable >= 0) & (unstable == between.unstable) & ~crossed
    # The same number grows, but with another frequency: real or not.
    same &= (frequency > 0.0) == (between.frequency > 0.0)
    rounding = float(np.where(same, between.error, 0.0).max())
    errors = []
    for mine, true in ((growth, between.growth), (frequency, between.frequency)):
        measured = np.where(same, np.abs(mine - true), 0.0)
        errors.append(np.where(same, stated_error(measured, rounding), np.nan))
    return errors[0], errors[1]


def curves_of(grid: StabilityGrid, n: int, nodes: Rates, pool: Executor | None) -> list[Boundary]:
    """All curves at some of the weights of the grid, from where the number of what grows changes between its nodes.

    Parameters
    ----------
    grid : StabilityGrid
    n : int
    nodes : Rates
    pool : Executor

    Returns
    -------
    list of Boundary
    """
    axes, domain = grid.axes, domain_of(grid.axes)
    before, after = nodes.unstable[:, :, :-1], nodes.unstable[:, :, 1:]
    # Curves end at the limits of length: they are begun within.
    inside = np.zeros(before.shape, bool)
    inside[:: grid.curves_every, 1:-1] = True
    j, i, k = np.nonzero((before != after) & (np.minimum(before, after) >= 0) & inside)
    grows = np.where(after[j, i, k] > before[j, i, k], k + 1, k)
    w_f = axes.w_f.value(np.linspace(-1.0, 1.0, grid.w_f))[j]
    excess = axes.excess.value(np.linspace(-1.0, 1.0, grid.excess))[i]
    root = axes.root.value(np.linspace(-1.0, 1.0, grid.speed))
    speed = np.log(folds_at(n, excess=excess, w_f=w_f)) + 0.5 * (root[k] ** 2 + root[k + 1] ** 2)
    offset = 0.5 * (nodes.offset[j, i, k] + nodes.offset[j, i, k + 1])
    start = np.stack([offset, speed, np.log(excess), nodes.frequency[j, i, grows] ** 2], axis=1)
    orders = np.full(len(start), n)
    found, good = Collisions(orders, w_f, domain, pool).solve(start, np.arange(len(start)), -1)
    good &= (np.abs(found - start)[:, SPEED] < NEAR) & (found[:, S] >= 0.0)
    return boundaries(found[good], orders[good], w_f[good], domain, pool)


@dataclass(frozen=True)
class Sheets:
    """Boundaries of one n over the weights and the lengths of the grid.

    Attributes
    ----------
    begins : ndarray of bool, shape (sheets,)
        Whether flutter begins there as the speed rises, or ceases.
    speed, frequency : ndarray, shape (sheets, w_f, excess)
        log(gamma / gamma_cn), and the frequency over Omega; nan where the sheet is not.
    error : ndarray, shape (sheets, w_f - 1, excess - 1)
        Relative, of gamma, of each cell; nan where it is not to be interpolated.
    """

    begins: NDArray[np.bool_]
    speed: Array
    frequency: Array
    error: Array


class Columns:
    """Collisions at the weights and lengths of the grid, and of which stretch of a curve each is.

    Parameters
    ----------
    grid : StabilityGrid
    n : int
    nodes : Rates
    pool : Executor
    """

    def __init__(self, grid: StabilityGrid, n: int, nodes: Rates, pool: Executor | None):
        self.grid, self.n, self.pool, self.nodes = grid, n, pool, nodes
        self.weights = grid.axes.w_f.value(np.linspace(-1.0, 1.0, grid.w_f))
        self.excess = grid.axes.excess.value(np.linspace(-1.0, 1.0, grid.excess))
        self.root = grid.axes.root.value(np.linspace(-1.0, 1.0, grid.speed))
        flat = [column.ravel() for column in np.meshgrid(self.weights, self.excess, indexing="ij")]
        self.folds = np.log(folds_at(n, w_f=flat[0], excess=flat[1])).reshape(grid.w_f, grid.excess)
        # Of each column: log(gamma / gamma_cn), s and the logarithm of the offset, whether it begins, which stretch.
        self.points: dict[tuple[int, int], list[tuple[Array, bool, int]]] = {}
        # Of each stretch: with which it is one, where it is, whether flutter begins there.
        self.same: list[int] = []
        self.places: list[set[tuple[int, int]]] = []
        self.begun: list[bool | None] = []

    def stretch(self, begun: bool | None = None) -> int:
        """A number for another stretch."""
        self.same.append(len(self.same))
        self.places.append(set())
        self.begun.append(begun)
        return len(self.same) - 1

    def first(self, stretch: int) -> int:
        """The first of all stretches that are one with a stretch."""
        while self.same[stretch] != stretch:
            stretch = self.same[stretch]
        return stretch

    def guessed_offset(self, j: int, i: int, speed: float) -> float:
        """The logarithm of the offset of the shape at a speed, from its nodes."""
        return float(np.interp(np.sqrt(max(speed, 0.0)), self.root, self.nodes.offset[j, i]))

    def add(self, places: list[tuple[int, int]], guesses: Array, stretches: list[int], near: float) -> None:
        """Solve for collisions near log(gamma / gamma_cn), s and the offset, and keep those that are new.

        Parameters
        ----------
        places : list of (int, int)
            Weight and length.
        guesses : ndarray, shape (points, 3)
        stretches : list of int
        near : float
            How near.
        """
        if not places:
            return
        j, i = np.array(places).T
        speed, square, offset = guesses.T
        start = np.stack([offset, speed + self.folds[j, i], np.log(self.excess[i]), square], axis=1)
        rows = np.arange(len(start))
        equations = Collisions(np.full(len(start), self.n), self.weights[j], domain_of(self.grid.axes), self.pool)
        found, good = equations.solve(start, rows, -1, ROUNDS)
        good &= (np.abs(found - start)[:, [SPEED, S]] < near).all(axis=1) & (found[:, S] >= 0.0)
        if not good.any():
            return
        begin = np.zeros(len(start), bool)
        begin[good] = begins(equations(found[good], rows[good])[1])
        for k in np.flatnonzero(good):
            point = np.array([found[k, SPEED] - self.folds[j[k], i[k]], found[k, S], found[k, X]])
            here, own = self.points.setdefault(places[k], []), self.first(stretches[k])
            if self.begun[own] not in (None, bool(begin[k])):
                continue
            known = [one[2] for one in here if (np.abs(one[0] - point)[:2] < SAME).all()]
            if known:
                self.join(self.first(known[0]), own)
            elif places[k] not in self.places[own]:
                here.append((point, bool(begin[k]), own))
                self.places[own].add(places[k])
                self.begun[own] = bool(begin[k])

    def join(self, one: int, other: int) -> None:
        """Two stretches are one, if they have no column in common: a boundary turns, and is two above a cable."""
        one, other = sorted((one, other))
        if one != other and not self.places[one] & self.places[other]:
            self.same[other] = one
            self.places[one] |= self.places[other]
            if self.begun[one] is None:
                self.begun[one] = self.begun[other]

    def add_changes(self) -> None:
        """Those where the number of what grows changes between nodes and none is known, each a stretch of its own."""
        places, guesses = [], []
        for j, i in np.ndindex(self.folds.shape):
            known = self.points.get((j, i), [])
            speed, begun = np.array([one[0][0] for one in known]), np.array([one[1] for one in known], bool)
            unstable = self.nodes.unstable[j, i]
            for k in np.flatnonzero(np.diff(unstable) != changes_of(self.root, speed, begun)):
                if min(unstable[k], unstable[k + 1]) >= 0:
                    middle = 0.5 * (self.root[k] ** 2 + self.root[k + 1] ** 2)
                    grows = k + 1 if unstable[k + 1] > unstable[k] else k
                    square = self.nodes.frequency[j, i, grows] ** 2
                    places.append((j, i))
                    guesses.append([middle, square, self.guessed_offset(j, i, middle)])
        self.add(places, np.array(guesses).reshape(-1, 3), [self.stretch() for _ in places], NEAR)

    def add_curve(self, curve: Boundary) -> None:
        """Those of a curve, each part between turning points a stretch."""
        row = int(np.argmin(np.abs(self.weights - curve.w_f)))
        log_excess = np.log(self.excess)
        along = np.log(curve.lam - float(unchecked_threshold_length(curve.w_f, self.n)))
        flips = np.flatnonzero(curve.begins[1:] != curve.begins[:-1])
        # Where two edges cross, or at a turning point.
        cuts = [0, *sorted({*curve.turns.tolist(), *flips.tolist()}), len(along) - 1]
        for begin, end in pairwise(cuts):
            part = np.arange(begin, end + 1)
            part = part if along[end] > along[begin] else part[::-1]
            # Ends at the limits of length are known to rounding.
            columns = np.flatnonzero((log_excess > along[part[0]] - 1e-9) & (log_excess < along[part[-1]] + 1e-9))
            if len(part) > 1 and len(columns):
                values = np.log(curve.gamma), np.square(curve.omega), np.log(curve.r_f * curve.gamma**2)
                guess = np.stack([np.interp(log_excess[columns], along[part], value[part]) for value in values], axis=1)
                guess[:, 0] -= self.folds[row, columns]
                self.add([(row, int(i)) for i in columns], guess, [self.stretch()] * len(columns), NEAR)

    def spread(self, down: int, right: int) -> None:
        """From each column to the next, in weight or in length, by Newton's method."""
        shape = self.folds.shape
        lines = [list(range(count)) for count in shape]
        if down + right < 0:
            lines = [line[::-1] for line in lines]
        along, across = (0, 1) if down else (1, 0)
        for one in lines[along][:-1]:
            places, guesses, stretches = [], [], []
            for other in lines[across]:
                j, i = (one, other) if down else (other, one)
                to = j + down, i + right
                there = self.points.get(to, [])
                for point, _, stretch in self.points.get((j, i), []):
                    own = self.first(stretch)
                    if any(self.first(known[2]) == own for known in there):
                        continue
                    before = [k[0] for k in self.points.get((j - down, i - right), []) if self.first(k[2]) == own]
                    speed, square = (2.0 * point - before[0] if len(before) == 1 else point)[:2]
                    moved = self.guessed_offset(*to, speed) - self.guessed_offset(j, i, point[0])
                    places.append(to)
                    guesses.append([speed, square, point[2] + moved])
                    stretches.append(stretch)
            self.add(places, np.array(guesses).reshape(-1, 3), stretches, FAR)

    def sheets(self) -> Sheets:
        """Stretches that are one."""
        numbers = sorted({self.first(one[2]) for points in self.points.values() for one in points})
        values = np.full((3, len(numbers), self.grid.w_f, self.grid.excess), np.nan)
        for (j, i), points in self.points.items():
            for point, _, stretch in points:
                values[:, numbers.index(self.first(stretch)), j, i] = point
        begin = np.array([self.begun[number] for number in numbers], bool)
        return Sheets(begin, values[0], np.sqrt(values[1]), self.errors(values))

    def errors(self, values: Array) -> Array:
        """Of cells of sheets, from collisions solved for in their middle."""
        axes = self.grid.axes
        y, x = middles(np.linspace(-1.0, 1.0, self.grid.w_f)), middles(np.linspace(-1.0, 1.0, self.grid.excess))
        found = np.full((3, values.shape[1], len(y), len(x)), np.nan)
        for j, i in np.ndindex(len(y), len(x)):
            for k in range(3):
                found[k, :, j, i] = sheet_at(values[k], float(y[j]), float(x[i]))
        one = np.isfinite(found).all(axis=0)
        sheet, row, column = np.nonzero(one)
        measured, held = np.zeros(one.shape), np.zeros(one.shape, bool)
        if len(sheet):
            w_f, excess = axes.w_f.value(y)[row], axes.excess.value(x)[column]
            guess = found[:, sheet, row, column]
            folds = np.log(folds_at(self.n, excess=excess, w_f=w_f))
            start = np.stack([guess[2], guess[0] + folds, np.log(excess), guess[1]], axis=1)
            equations = Collisions(np.full(len(start), self.n), w_f, domain_of(axes), self.pool)
            solved, good = equations.solve(start, np.arange(len(start)), -1, ROUNDS)
            moved = np.abs(solved - start)
            good &= (moved[:, [SPEED, S]] < NEAR).all(axis=1)
            place = sheet[good], row[good], column[good]
            measured[place], held[place] = moved[good, SPEED], True
        stated = [stated_error(part, np.finfo(float).eps) for part in measured]
        return np.where(held, np.array(stated).reshape(held.shape), np.nan)


def sheets_of(grid: StabilityGrid, n: int, nodes: Rates, curves: list[Boundary], pool: Executor | None) -> Sheets:
    """Where curves pass the lengths of the grid, and from there at its other weights, all solved for.

    Parameters
    ----------
    grid : StabilityGrid
    n : int
    nodes : Rates
    curves : list of Boundary
    pool : Executor or None

    Returns
    -------
    Sheets
    """
    columns = Columns(grid, n, nodes, pool)
    for curve in curves:
        columns.add_curve(curve)
    columns.add_changes()
    for down, right in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        columns.spread(down, right)
    return columns.sheets()


def changes_of(root: Array, speed: Array, begins: NDArray[np.bool_]) -> Integers:
    """How the number of what grows changes between nodes of the speed, by boundaries.

    Parameters
    ----------
    root : ndarray, shape (nodes,)
        Of log(gamma / gamma_cn).
    speed : ndarray, shape (boundaries,)
        log(gamma / gamma_cn).
    begins : ndarray of bool, shape (boundaries,)

    Returns
    -------
    ndarray of int, shape (nodes - 1,)
    """
    changes = np.zeros(len(root) + 1, np.int64)
    np.add.at(changes, np.searchsorted(root**2, speed), np.where(begins, 2, -2))
    return changes[1:-1]


def crossed_cells(grid: StabilityGrid, sheets: Sheets, curves: list[Boundary]) -> NDArray[np.bool_]:
    """Cells of the grid of growth rates that a boundary may pass.

    Parameters
    ----------
    grid : StabilityGrid
    sheets : Sheets
    curves : list of Boundary

    Returns
    -------
    ndarray of bool, shape (w_f - 1, excess - 1, speed - 1)
    """
    axes = grid.axes
    crossed = np.zeros((grid.w_f - 1, grid.excess - 1, grid.speed - 1), bool)
    for speed in sheets.speed:
        for j, i in np.ndindex(*crossed.shape[:2]):
            corners = speed[j : j + 2, i : i + 2]
            here = corners[np.isfinite(corners)]
            if len(here):
                at = axes.root.coordinate(np.sqrt(np.maximum([here.min(), here.max()], 0.0)))
                low, high = cell_of(at, grid.speed)
                # Where a sheet ends in the cell, it may go on past its corners; a sheet may bulge.
                slack = 1 if len(here) == 4 else 2
                crossed[j, i, max(low - slack, 0) : high + slack + 1] = True
    for curve in curves:
        excess = curve.lam - unchecked_threshold_length(curve.w_f, curve.n)
        ratio = curve.gamma / folds_at(curve.n, excess=excess, w_f=np.full(len(excess), curve.w_f))
        k = cell_of(axes.root.coordinate(np.sqrt(np.log(np.maximum(ratio, 1.0)))), grid.speed)
        i = cell_of(axes.excess.coordinate(excess), grid.excess)
        j = int(np.round(0.5 * (axes.w_f.coordinate(np.array([curve.w_f]))[0] + 1.0) * (grid.w_f - 1)))
        for beside in {max(j - 1, 0), min(j, grid.w_f - 2)}:
            crossed[beside, i, k] = True
    return crossed


def complete_columns(grid: StabilityGrid, nodes: Rates, sheets: Sheets) -> NDArray[np.bool_]:
    """Whether boundaries account for every change of the number of what grows between nodes of the speed.

    Parameters
    ----------
    grid : StabilityGrid
    nodes : Rates
    sheets : Sheets

    Returns
    -------
    ndarray of bool, shape (w_f, excess)
    """
    root = grid.axes.root.value(np.linspace(-1.0, 1.0, grid.speed))
    complete = np.zeros((grid.w_f, grid.excess), bool)
    for j, i in np.ndindex(complete.shape):
        here = np.isfinite(sheets.speed[:, j, i])
        changes = changes_of(root, sheets.speed[here, j, i], sheets.begins[here])
        complete[j, i] = (np.diff(nodes.unstable[j, i]) == changes).all() and (nodes.unstable[j, i] >= 0).all()
    return complete


def direct_points(grid: StabilityGrid, n: int) -> tuple[tuple[Array, Array, Array], Rates]:
    """Random points of the domain, and growth rates solved there directly.

    Parameters
    ----------
    grid : StabilityGrid
    n : int

    Returns
    -------
    places : tuple of three ndarray, shape (checks,)
        Their coordinates of w_f, excess and speed, -1 to 1.
    rates : Rates
    """
    axes = grid.axes
    y, x, v = np.random.default_rng(7048 + n).uniform(-1.0, 1.0, (3, grid.checks))
    w_f, excess = axes.w_f.value(y), axes.excess.value(x)
    gamma = np.exp(axes.root.value(v) ** 2) * folds_at(n, excess=excess, w_f=w_f)
    return (y, x, v), rates_at(n, excess=excess, w_f=w_f, gamma=gamma)
