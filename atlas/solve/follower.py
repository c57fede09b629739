"""The modes of motion of shapes, followed along every branch as speed or length moves, and where they begin to grow."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from towatlas.effort import TooMuchWork, check_patience
from towatlas.kernels import status
from towatlas.kernels.system import LAM
from towatlas.numerics.rows import EPS
from towatlas.results_motion import Window
from towatlas.solve.drag_equilibria import errors_of
from towatlas.solve.growth import WEAK, Spectrum, has_drag, reach_of
from towatlas.solve.looks import SLOPE
from towatlas.solve.motion import Complex, Motion, motions
from towatlas.solve.paths import Fold, Path, Trace, trace
from towatlas.solve.positions import with_fish_moved
from towatlas.solve.shots import Array
from towatlas.solve.spectrum import CLOSE, polish, together
from towatlas.system import System

# Speeds, or lengths, looked at are no further apart than this part of them.
SPACING = 0.01
# Halvings of a step across an edge by counts, then rounds of secants on what is zero there.
HALVINGS, ROUNDS = 12, 40
# Of log gamma, at which an edge is found, and growth that is none there, in units of Omega.
SETTLED, NO_GROWTH = 1e-13, 1e-9
# A step of Newton's method, in log r_f, at most as long as which it ends for want of digits.
NEAR = 1e-7
# Circle around two modes that meet without drag, and how far a mode may move from one sample to the next, in units of
# Omega.
CIRCLE, FAR = 0.05, 0.2
# Shapes of a branch that are made ready together.
AT_ONCE = 8
# So near to what is weak growth is looked at between samples.
ALMOST = 0.9
REMEDY = "a narrower range, a lower speed or a shorter cable has fewer shapes to look at"


@dataclass(frozen=True)
class Sample:
    """A shape of one branch: the logarithm t of its speed, or length, over the lowest, that of the radius of its fish
    over g / Omega^2, its nodes, its number from the axis outwards, and how it moves."""

    t: float
    x: float
    nodes: int
    place: int
    spectrum: Spectrum


@dataclass(frozen=True)
class Known:
    """What the growth rates of a shape are found from: its nodes, the error of the radius of its fish over that, and
    small motions about it and by `with_fish_moved`."""

    nodes: int
    error: float
    bodies: tuple[Motion, Motion]


@dataclass(frozen=True)
class Edge:
    """Where a mode begins or ceases to grow, or to be followed."""

    kind: str
    t: float
    frequency: float


@dataclass
class Mode:
    """A mode that grows over a stretch of one branch: growth rates in units of Omega."""

    start: Edge
    end: Edge
    samples: list[Sample]
    sigma: list[complex]


def followed(
    system: System, low: float, high: float, *, gamma: float | None = None, at: float | None = None
) -> "tuple[Trace, Follower]":
    """All shapes between two speeds, or two lengths, and what follows their modes.

    Parameters
    ----------
    system : System
    low, high : float
        Speeds [-], 0 < low < high; lengths, where a speed is given.
    gamma : float, optional
        The speed, > 0, where it is the length that moves [-].
    at : float, optional
        A value between them to be among those that are looked at, for `through`; without it they are close enough for
        windows.

    Returns
    -------
    Trace
    Follower
    """
    if gamma is None:
        path = Path(system.row(), low, ("gamma",))
    else:
        path = Path(replace(system, lam=low).row(), gamma, ("lam",))
    end = float(np.log(high / low))
    values = np.linspace(0.0, end, _steps(end) + 1) if at is None else np.array([np.log(at / low)])
    return trace(path, 0.0, end, at=values), Follower(system, path)


class Follower:
    """Follows the modes of the shapes of one system from speed to speed, or from length to length."""

    def __init__(self, system: System, path: Path):
        self.system, self.path = system, path
        self.drag = has_drag(system)

    def speed(self, t: float) -> float:
        return float(self.path.gamma * np.exp(t)) if self.path.by_speed else self.path.gamma

    def value(self, t: float) -> float:
        """Of what moves."""
        return self.speed(t) if self.path.by_speed else self.system_at(t).lam

    def system_at(self, t: float) -> System:
        if self.path.by_speed:
            return self.system
        return replace(self.system, lam=float(self.path.row[LAM] * np.exp(t)))

    def motion(self, t: float, x: float, reach: float) -> Motion:
        speed = self.speed(t)
        row = self.system_at(t).row()[None]
        return motions(np.array([np.exp(x) / speed**2]), np.array([speed]), row, reach)[0]

    def branches(self, traced: Trace) -> Iterator[tuple[list[Sample], Fold | None, Fold | None]]:
        """Samples of each branch, and the folds that begin and end it."""
        found = _places(traced)
        total, done = sum(len(places) for places in found), 0
        for places in found:
            points = [(traced.columns[i].t, float(traced.columns[i].x[k]), k) for i, k in places]
            samples = []
            for begin in range(0, len(points), AT_ONCE):
                some = points[begin : begin + AT_ONCE]
                for point, known in zip(some, self._bodies(some), strict=True):
                    check_patience("growth rates along the branches", REMEDY, done=done, of=total)
                    samples.append(self._sample(*point, known))
                    done += 1
            yield samples, *_folds(traced, places)

    def through(
        self, traced: Trace, t: float, x: float, enough: Callable[[list[Sample]], bool]
    ) -> tuple[list[Sample], Fold | None, Fold | None]:
        """The same of the branch that passes a shape: from it outwards, each way until there are enough samples, in
        the order of their distance, or the time is used up."""
        columns = traced.columns
        i = int(np.argmin([abs(column.t - t) for column in columns]))
        k = int(np.argmin(np.abs(columns[i].x - x)))
        places = next(places for places in _places(traced) if (i, k) in places)
        points = self._points(traced, places)
        order = sorted(range(len(points)), key=lambda j: abs(points[j][0] - t))
        samples: dict[int, Sample] = {}
        bodies: dict[int, Known] = {}
        for place, j in enumerate(order):
            way = [samples[m] for m in samples if (m - order[0]) * (j - order[0]) >= 0]
            if way and enough(way):
                continue
            try:
                check_patience("growth rates along the branch", REMEDY, done=len(samples), of=len(points))
                if j not in bodies:
                    # Some at once: few shots leave lanes idle.
                    some = order[place : place + AT_ONCE]
                    bodies |= zip(some, self._bodies([points[m] for m in some]), strict=True)
                samples[j] = self._sample(*points[j], bodies[j])
            except TooMuchWork:
                if not samples:
                    raise
                break
        found = [samples[j] for j in sorted(samples)]
        began, ended = _folds(traced, places)
        return found, began if 0 in samples else None, ended if len(points) - 1 in samples else None

    def _points(self, traced: Trace, places: list[tuple[int, int]]) -> list[tuple[float, float, int]]:
        """t, x and place of the shapes of a branch, close enough for windows: of columns, between them, and on to the
        folds in which it begins and ends."""
        columns = traced.columns
        known = [(columns[i].t, float(columns[i].x[k]), k, float(columns[i].moves[k])) for i, k in places]
        points = [(t, x, k) for t, x, k, _ in known]
        guesses: list[tuple[Array, Array, int]] = []
        for (t, x, k, moves), (later, y, _, moved) in pairwise(known):
            step = later - t
            share = np.arange(1, _steps(step)) / _steps(step)
            # The cubic through both.
            bent = (1.0 - share) * (moves * step - (y - x)) + share * ((y - x) - moved * step)
            guesses.append((t + share * step, x + share * (y - x) + share * (1.0 - share) * bent, k))
        for fold, (t, x, k, moves) in zip(_folds(traced, places), (known[0], known[-1]), strict=True):
            if fold is None:
                continue
            step = fold.t - t
            share = np.arange(1, _steps(abs(step))) / _steps(abs(step))
            # The parabola with its vertex in the fold, bent to leave the column as the branch does.
            left = np.sqrt(1.0 - share)
            most = -2.0 * moves * step - (x - fold.x)
            guesses.append((t + share * step, fold.x + left * (x - fold.x) + left * (left - 1.0) * most, k))
        for at, guess, k in guesses:
            found = self._offsets(guess, at)
            if np.isnan(found).any():
                raise _LostError("a shape is lost between two that are known")
            points += zip(at, found, [k] * len(at), strict=True)
        return sorted(points)

    def sample(self, t: float, x: float, place: int) -> Sample:
        return self._sample(t, x, place, self._bodies([(t, x, place)])[0])

    def _sample(self, t: float, x: float, place: int, known: Known) -> Sample:
        r_f = float(np.exp(x) / self.speed(t) ** 2)
        spectrum = Spectrum(self.system_at(t), self.speed(t), r_f, known.error, bodies=known.bodies)
        return Sample(t, x, known.nodes, place, spectrum)

    def _bodies(self, points: list[tuple[float, float, int]]) -> list[Known]:
        t, x, _ = (np.array(column) for column in zip(*points, strict=True))
        ends = self.path.shots(x, t, SLOPE)
        nodes = np.floor(ends.angle / np.pi + 0.5).astype(int)
        systems, speeds = [self.system_at(one) for one in t], np.array([self.speed(one) for one in t])
        rows = np.stack([system.row() for system in systems])
        reach = np.array([reach_of(system, speed) for system, speed in zip(systems, speeds, strict=True)])
        errors, r_f = errors_of(x, ends, speeds), np.exp(x) / speeds**2
        bodies = motions(r_f, speeds, rows, reach)
        moved = with_fish_moved(bodies, r_f, speeds, rows, errors)
        pairs = zip(bodies, moved, strict=True)
        return [Known(*of) for of in zip(nodes.tolist(), errors.tolist(), pairs, strict=True)]

    def between(self, a: Sample, b: Sample, t: float) -> Sample:
        """The shape of the branch of two samples at a speed between them."""
        return self.sample(t, self.offset(a, b, t), a.place)

    def offset(self, a: Sample, b: Sample, t: float) -> float:
        """Log of the radius of the fish of that shape."""
        x = a.x + (t - a.t) / (b.t - a.t) * (b.x - a.x)
        found = float(self._offsets(np.array([x]), np.array([t]))[0])
        if np.isnan(found):
            raise _LostError
        return found

    def _offsets(self, x: Array, t: Array) -> Array:
        """Log of the radius of the fish of shapes near by, by Newton's method; nan where it does not settle."""
        x, going, last = x.copy(), np.arange(len(x)), np.full(len(x), np.inf)
        for _ in range(ROUNDS):
            ends = self.path.shots(x[going], t[going], SLOPE)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = ends.log_rho[:, 0] / ends.log_rho[:, 1]
            sound = (ends.status == status.OK) & np.isfinite(step)
            x[going[sound]] -= step[sound]
            last[going] = np.where(sound, np.abs(step), np.inf)
            going = going[sound & (np.abs(step) >= 8.0 * EPS)]
            if not len(going):
                break
        # Where rounding is amplified the steps end at its size.
        return np.where(last < NEAR, x, np.nan)

    def modes(self, samples: list[Sample], began: Fold | None, ended: Fold | None) -> list[Mode]:
        """Modes that grow somewhere on a branch."""
        first = samples[0]
        kind, t = ("fold", began.t) if began is not None else ("range", first.t)
        over: list[Mode] = []
        open_ = [_begun(Edge(kind, t, float(s.imag)), first, complex(s)) for s in first.spectrum.growing]
        for a, b in pairwise(samples):
            known = a.spectrum.status == b.spectrum.status == status.OK
            old, new = [mode.sigma[-1] for mode in open_], [complex(s) for s in b.spectrum.growing]
            pairs = _matched(old, new, a.spectrum.unstable == b.spectrum.unstable)
            going = {i for i, _ in pairs}
            for i, mode in enumerate(open_):
                if i not in going:
                    mode.end = self.edge(b, a, old[i]) if known else Edge("unknown", a.t, old[i].imag)
                    over.append(mode)
            for i, k in pairs:
                open_[i].samples.append(b)
                open_[i].sigma.append(new[k])
            open_ = [open_[i] for i, _ in pairs]
            for k in set(range(len(new))) - {k for _, k in pairs}:
                start = self.edge(a, b, new[k]) if known else Edge("unknown", b.t, new[k].imag)
                open_.append(_begun(start, b, new[k]))
        kind, t = ("fold", ended.t) if ended is not None else ("range", samples[-1].t)
        for mode in open_:
            mode.end = Edge(kind, t, mode.sigma[-1].imag)
        return over + open_

    def edge(self, still: Sample, growing: Sample, sigma: complex) -> Edge:
        """Where a mode, that grows at one of two samples, begins to."""
        try:
            t, frequency = self.hopf(still, growing, sigma) if self.drag else self.krein(still, growing, sigma)
        except _LostError:
            return Edge("unknown", growing.t, sigma.imag)
        return Edge("hopf" if self.drag else "krein", t, frequency)

    def hopf(self, still: Sample, growing: Sample, sigma: complex) -> tuple[float, float]:
        """Where the growth of a mode is zero."""
        for _ in range(HALVINGS):
            t, here = self._zero_growth(still, growing, sigma)
            if abs(here.real) < NO_GROWTH:
                return t, here.imag
            # Another mode has come in between: nearer samples tell them apart.
            middle = self.between(still, growing, 0.5 * (still.t + growing.t))
            near = [complex(s) for s in middle.spectrum.growing if abs(s - sigma) < FAR]
            if near:
                growing, sigma = middle, min(near, key=lambda s: abs(s - sigma))
            else:
                still = middle
        raise _LostError

    def _zero_growth(self, still: Sample, growing: Sample, sigma: complex) -> tuple[float, complex]:
        """The same by secants that keep their bracket, and the growth rate where they end."""
        others = np.concatenate([still.spectrum.roots.sigma, still.spectrum.rest])
        ends = [(still.t, _nearest(others[others.real <= 0.0], sigma)), (growing.t, sigma)]
        heights = [ends[0][1].real, sigma.real]
        t, here, side = growing.t, sigma, 1
        for _ in range(ROUNDS):
            share = heights[0] / (heights[0] - heights[1])
            last, t = t, ends[0][0] + share * (ends[1][0] - ends[0][0])
            here = self.mode(still, growing, t, ends[0][1] + share * (ends[1][1] - ends[0][1]))
            again, side = side, int(here.real > 0.0)
            if side == again:
                # The other end has stayed: it counts half, so that it is not kept for ever.
                heights[1 - side] *= 0.5
            ends[side], heights[side] = (t, here), here.real
            if abs(t - last) < SETTLED or abs(here.real) < EPS:
                break
        return t, here

    def mode(self, a: Sample, b: Sample, t: float, guess: complex) -> complex:
        """The growth rate next to a guess, of the shape between two samples."""
        reach = max(reach_of(self.system_at(t), self.speed(t)), 1.1 * abs(guess))
        motion = self.motion(t, self.offset(a, b, t), reach)
        roots, found = polish(motion, np.array([guess]), np.array([guess]))
        if found[0] and abs(roots.sigma[0] - guess) < CLOSE:
            return complex(roots.sigma[0])
        return _nearest(self.between(a, b, t).spectrum.roots.sigma, guess)

    def krein(self, still: Sample, growing: Sample, sigma: complex) -> tuple[float, float]:
        """Where two oscillations meet without drag: a zero of the square of half their distance."""
        ends = [still, growing]
        centre = sigma
        for _ in range(HALVINGS):
            middle = self.between(still, growing, 0.5 * (ends[0].t + ends[1].t))
            near = [complex(s) for s in middle.spectrum.growing if abs(s - centre) < FAR]
            if near:
                centre = min(near, key=lambda s: abs(s - centre))
            ends[1 if near else 0] = middle
        centre = 1j * centre.imag
        heights = [self._height(sample, centre) for sample in ends]
        sample = ends[1]
        for _ in range(ROUNDS):
            t = ends[1].t - heights[1] * (ends[1].t - ends[0].t) / (heights[1] - heights[0])
            if not min(still.t, growing.t) <= t <= max(still.t, growing.t):
                raise _LostError
            sample = self.between(still, growing, t)
            ends, heights = [ends[1], sample], [heights[1], self._height(sample, centre)]
            if abs(ends[1].t - ends[0].t) < SETTLED or heights[1] == heights[0]:
                break
        return sample.t, centre.imag

    def _height(self, sample: Sample, centre: complex) -> float:
        motion = self.motion(sample.t, sample.x, 1.0 + abs(centre))
        near = together(motion, centre, CIRCLE).sigma
        if len(near) < 2:
            raise _LostError
        one, other = near[np.argsort(np.abs(near - centre))[:2]]
        return float((((one - other) / 2.0) ** 2).real)

    def windows(self, modes: list[Mode], branch: str) -> Iterator[Window]:
        """A window a mode of a branch; one without an edge of its own goes with that which it is inside of."""
        groups: list[list[Mode]] = []
        weak = {id(mode): max(s.real for s in mode.sigma) < WEAK for mode in modes}
        # Long ones first, strong ones before weak ones.
        for mode in sorted(modes, key=lambda mode: (weak[id(mode)], mode.start.t - mode.end.t)):
            own = {mode.start.kind, mode.end.kind} & {"hopf", "krein"}
            within = (g for g in groups if g[0].start.t <= mode.start.t and mode.end.t <= g[0].end.t)
            group = None if own else next(within, None)
            if group is None:
                groups.append([mode])
            else:
                group.append(mode)
        for group in sorted(groups, key=lambda group: group[0].start.t):
            yield self.window(group, branch)

    def window(self, modes: list[Mode], branch: str) -> Window:
        """The window of the first of some modes."""
        first, last = modes[0].start, modes[0].end
        best, sample, growth = modes[0], modes[0].samples[0], 0.0
        for mode in modes:
            for at, sigma in zip(mode.samples, mode.sigma, strict=True):
                if sigma.real * self.speed(at.t) > growth:
                    best, sample, growth = mode, at, sigma.real * self.speed(at.t)
        sample, growth = self._summit(best, sample, growth)
        low, high = self.speed(first.t), self.speed(last.t)
        return Window(
            branch=branch,
            nodes=sample.nodes,
            low=low,
            high=high,
            low_kind=first.kind,
            high_kind=last.kind,
            low_frequency=first.frequency * low,
            high_frequency=last.frequency * high,
            growth=growth,
            gamma=self.speed(sample.t),
            weak=growth < WEAK * self.speed(sample.t),
        )

    def is_strong(self, mode: Mode, low: float = -np.inf, high: float = np.inf) -> bool:
        """Whether it grows somewhere between two t by so much that it is not weak, if only between samples."""
        inside = [k for k, sample in enumerate(mode.samples) if low <= sample.t <= high]
        if not inside:
            return False
        k = max(inside, key=lambda k: mode.sigma[k].real)
        rate = mode.sigma[k].real
        if not ALMOST * WEAK < rate < WEAK:
            return bool(rate >= WEAK)
        sample, growth = self._summit(mode, mode.samples[k], rate * self.speed(mode.samples[k].t))
        return low <= sample.t <= high and growth >= WEAK * self.speed(sample.t)

    def _summit(self, mode: Mode, sample: Sample, growth: float) -> tuple[Sample, float]:
        """The largest growth between samples, where a parabola through three of them has its vertex."""
        k = mode.samples.index(sample)
        if not 0 < k < len(mode.samples) - 1:
            return sample, growth
        around = range(k - 1, k + 2)
        t = [mode.samples[i].t for i in around]
        rates = [mode.sigma[i].real * self.speed(mode.samples[i].t) for i in around]
        slopes = [(rates[i + 1] - rates[i]) / (t[i + 1] - t[i]) for i in range(2)]
        middles = [0.5 * (t[i + 1] + t[i]) for i in range(2)]
        if not slopes[0] > slopes[1]:
            return sample, growth
        top = middles[0] + slopes[0] * (middles[1] - middles[0]) / (slopes[0] - slopes[1])
        if not t[0] < top < t[2]:
            return sample, growth
        try:
            there = self.between(mode.samples[k - 1], mode.samples[k + 1], top)
        except _LostError:
            return sample, growth
        if there.spectrum.unstable < 1:
            return sample, growth
        rate = _nearest(there.spectrum.growing, mode.sigma[k]).real * self.speed(there.t)
        return (there, rate) if rate > growth else (sample, growth)

    def name(self, samples: list[Sample], began: Fold | None) -> str:
        """As of `Equilibria`, with drag where the branch begins: after it the same number may be another's."""
        first, last = samples[0], samples[-1]
        if not self.system.in_vacuum:
            return f"shape {first.place + 1}" + ("" if began is None else f" from {self.value(began.t):.5g}")
        if last.nodes == 0:
            return "outward"
        return f"{last.nodes} {'outer' if last.spectrum.index % 2 else 'inner'}"


def _steps(length: float) -> int:
    """Into how many parts a stretch of t is cut."""
    return max(1, int(np.ceil(length / np.log1p(SPACING))))


def _places(traced: Trace) -> list[list[tuple[int, int]]]:
    """Of each branch the columns in which it is, and where."""
    found: dict[int, list[tuple[int, int]]] = {}
    for i, column in enumerate(traced.branches()):
        for k, label in enumerate(column):
            found.setdefault(int(label), []).append((i, k))
    return list(found.values())


def _folds(traced: Trace, places: list[tuple[int, int]]) -> tuple[Fold | None, Fold | None]:
    """Those in which a branch begins and ends."""
    first, last = places[0][0], places[-1][0]
    before = traced.folds[first - 1] if first > 0 else None
    return before, traced.folds[last] if last < len(traced.folds) else None


class _LostError(ArithmeticError):
    """A mode cannot be followed."""


def _begun(start: Edge, sample: Sample, sigma: complex) -> Mode:
    return Mode(start, start, [sample], [sigma])


def _nearest(sigma: Complex, guess: complex) -> complex:
    if not len(sigma):
        raise _LostError
    return complex(sigma[np.argmin(np.abs(sigma - guess))])


def _matched(old: list[complex], new: list[complex], all_of: bool) -> list[tuple[int, int]]:
    """Pairs of modes of two samples, nearest first; none far apart, unless all go on."""
    apart = np.abs(np.subtract.outer(np.array(old, complex), np.array(new, complex)))
    pairs: list[tuple[int, int]] = []
    for place in np.argsort(apart, axis=None):
        i, k = divmod(int(place), len(new))
        if all(i != pair[0] and k != pair[1] for pair in pairs) and (all_of or apart[i, k] < FAR):
            pairs.append((i, k))
    return sorted(pairs)
