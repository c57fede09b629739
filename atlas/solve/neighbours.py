"""Growth rates of many shapes side by side, those of each from those of a neighbour.

Zeros of D of a neighbour, moved on as they moved before, are polished with the rough Evans function, and counted: with
drag all those right of a line that the leading one is right of, without drag all in the disc that holds what grows.
Only the leading ones are solved for to rounding. A shape whose zeros do not follow so, or are not all of them, has its
own `Spectrum`, as the first one has.
"""

from collections.abc import Sequence
from concurrent.futures import Executor
from contextvars import copy_context
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.kernels.system import C_F, C_S, C_T, LAM, C
from towatlas.solve.growth import STILL, Spectrum, reach_at
from towatlas.solve.motion import Array, Complex, Integers, Motion, Motions, motions
from towatlas.solve.positions import errors_with_fish, with_fish_moved
from towatlas.solve.spectrum import FINE, ROUGH, Function, Roots, noise_of, room_of, rough_zeros, secants
from towatlas.solve.winding import count_zeros
from towatlas.system import System

# Zeros are followed to this many times the reach; the disc without drag is so much larger than that of what grows.
FOLLOWED, SLACK = 1.25, 1.02
# A zero that moved by more from one shape to the next, in units of Omega, is not foretold to move on.
MOVED = 0.1
# Zeros this close to the imaginary axis, or to the leading one, are solved for to rounding.
CLOSE = 1e-3
# The line that zeros are counted to the right of is between these distances from the leading one.
LINE = (0.005, 0.06)


@dataclass(frozen=True)
class Zeros:
    """Zeros of the Evans function of one shape in the upper half of the plane, in units of Omega.

    Attributes
    ----------
    sigma : ndarray of complex, shape (zeros,)
    before : ndarray of complex, shape (zeros,)
        Those of the shape before; nan where not known.
    slope : ndarray of complex, shape (zeros,)
        Of D over its value at the reach; nan where not known.
    """

    sigma: Complex
    before: Complex
    slope: Complex

    def foretold(self) -> Complex:
        """Where they are of the next shape."""
        with np.errstate(invalid="ignore"):
            moved = self.sigma - self.before
            return np.where(np.abs(moved) < MOVED, self.sigma + moved, self.sigma)


@dataclass(frozen=True)
class Answer:
    """Of one shape: its leading growth rate and the error of it, in units of Omega, nan where there is none, and the
    rest as of `Spectrum`; with zeros for its neighbours."""

    sigma: complex
    error: float
    unstable: int
    index: int
    status: int
    zeros: Zeros | None


@dataclass(frozen=True)
class Shapes:
    """Some shapes, in drag all or none of them.

    Attributes
    ----------
    systems : ndarray, shape (shapes, columns)
    gamma, r_f, relative : ndarray, shape (shapes,)
        Speeds, distances of the fish from the axis over tow radius, and errors of these over them [-].
    index : ndarray of int, shape (shapes,)
        As of `Spectrum`.
    """

    systems: Array
    gamma: Array
    r_f: Array
    relative: Array
    index: Integers

    def part(self, which: NDArray) -> "Shapes":
        """Some of them."""
        return Shapes(*(of[which] for of in (self.systems, self.gamma, self.r_f, self.relative, self.index)))

    @property
    def drag(self) -> NDArray[np.bool_]:
        """Whether the fluid does work on motions."""
        return np.asarray((self.systems[:, [C, C_F, C_T, C_S]] != 0.0).any(axis=1))

    def with_fish_moved(self, bodies: Sequence[Motion], pool: Executor) -> list[Motion]:
        """As `towatlas.solve.positions.with_fish_moved`."""
        return with_fish_moved(bodies, self.r_f, self.gamma, self.systems, self.relative, pool)


def solve_shapes(shapes: Shapes, parents: Sequence[Zeros | None], pool: Executor) -> list[Answer]:
    """Growth rates of shapes.

    Parameters
    ----------
    shapes : Shapes
    parents : sequence of Zeros or None, shape (shapes,)
        Of their neighbours.
    pool : Executor
        Of threads.

    Returns
    -------
    list of Answer
    """
    found: list[Answer | None] = [None] * len(parents)
    drag, known = shapes.drag, np.array([zeros is not None for zeros in parents], bool)
    for kind in (True, False):
        which = np.flatnonzero(known & (drag == kind))
        if len(which):
            some = _Followed(shapes.part(which), [z for k in which if (z := parents[int(k)]) is not None], kind, pool)
            for k, answer in zip(which, some.answers(), strict=True):
                found[k] = answer
    rest = np.array([k for k, answer in enumerate(found) if answer is None], np.int64)
    if len(rest):
        some_rest = shapes.part(rest)
        reach = reach_at(lam=some_rest.systems[:, LAM], gamma=some_rest.gamma, drag=some_rest.drag)
        bodies = motions(some_rest.r_f, some_rest.gamma, some_rest.systems, reach, pool=pool)
        moved = some_rest.with_fish_moved(bodies, pool)

        def alone(k: int) -> Answer:
            system, index = System(*(float(value) for value in some_rest.systems[k])), int(some_rest.index[k])
            gamma, r_f, relative = (float(of[k]) for of in (some_rest.gamma, some_rest.r_f, some_rest.relative))
            return _alone(Spectrum(system, gamma, r_f, relative, index, (bodies[k], moved[k])))

        # With the patience of the caller.
        contexts = [copy_context() for _ in rest]
        for k, answer in zip(rest, pool.map(lambda i: contexts[i].run(alone, i), range(len(rest))), strict=True):
            found[k] = answer
    return [answer for answer in found if answer is not None]


def _alone(spectrum: Spectrum) -> Answer:
    """Of a shape by itself."""
    roots, guesses = spectrum.roots, spectrum.guesses
    zeros = None
    if spectrum.status == status.OK and guesses is not None:
        near = guesses.sigma[np.abs(guesses.sigma) < FOLLOWED * spectrum.reach]
        near = np.where(np.abs(near.imag) < STILL, near.real + 0j, near)
        near = near if spectrum.drag else _on_axes(near)
        apart = np.abs(near[:, None] - roots.sigma).min(axis=1, initial=np.inf)
        sigma = np.concatenate([roots.sigma, near[apart > CLOSE]])
        nothing = np.full(len(sigma), np.nan + 0j)
        zeros = Zeros(sigma, nothing, nothing) if len(sigma) else None
    return Answer(spectrum.leading, spectrum.error, spectrum.counted, spectrum.index, spectrum.status, zeros)


class _Followed:
    """Shapes, all of them in drag or none, whose zeros are looked for next to those of their neighbours."""

    def __init__(self, shapes: Shapes, parents: Sequence[Zeros], drag: bool, pool: Executor):
        self.drag, self.pool = drag, pool
        own = reach_at(lam=shapes.systems[:, LAM], gamma=shapes.gamma, drag=shapes.drag)
        slowest = np.array([np.abs(zeros.sigma).min() for zeros in parents])
        self.bodies = motions(
            shapes.r_f,
            shapes.gamma,
            shapes.systems,
            np.maximum(own if drag else SLACK * own, 1.1 * slowest),
            pool=pool,
        )
        sound = [body.status == status.OK and body.fastest_flow <= 1.0 for body in self.bodies]
        self.which = np.flatnonzero(sound)
        self.shapes, self.parents = shapes, parents

    def answers(self) -> list[Answer | None]:
        """None where they were not found, or are not all."""
        found: list[Answer | None] = [None] * len(self.parents)
        if not len(self.which):
            return found
        zeros = self._follow()
        # Where everything is damped faster than the reach, there is no line within it to count right of.
        kept = np.array(
            [
                _distinct(part.sigma) and (not self.drag or _line(part.sigma) > -self.bodies[k].reach)
                for k, part in zip(self.which, zeros, strict=True)
            ]
        )
        self.which, zeros = self.which[kept], [part for part, well in zip(zeros, kept, strict=True) if well]
        if not zeros:
            return found
        every = Motions([self.bodies[k] for k in self.which], self.pool)
        lines = np.array([_line(part.sigma) for part in zeros]) if self.drag else None
        counts = count_zeros(every, [part.sigma for part in zeros], lines)
        reach = [body.reach for body in every.each]
        held = [_inside(zeros[k].sigma, reach[k], None if lines is None else lines[k]) for k in range(len(zeros))]
        whole = np.flatnonzero(counts == np.array(held))
        for k, roots in zip(whole, self._leading([zeros[i] for i in whole], whole), strict=True):
            if roots is not None:
                found[self.which[k]] = self._answer(self.which[k], roots, zeros[k])
        return self._with_errors(found)

    def _with_errors(self, found: list[Answer | None]) -> list[Answer | None]:
        """With what leading ones move by as the fish does."""
        which = [k for k, answer in enumerate(found) if answer is not None]
        if not which:
            return found
        shapes, bodies = self.shapes.part(np.array(which)), [self.bodies[k] for k in which]
        sigma = np.array([answer.sigma for answer in found if answer is not None])
        moved = shapes.with_fish_moved(bodies, self.pool)
        moves = dict(zip(which, errors_with_fish(bodies, moved, sigma, shapes.relative, self.pool), strict=True))
        return [answer and replace(answer, error=answer.error + moves[k]) for k, answer in enumerate(found)]

    def _function(self, owner: Integers, which: Integers, rough: bool) -> tuple[Function, Array]:
        """D over its value at the reach, of points of shapes; and the logarithms that it had last over those of D."""
        bodies = Motions([self.bodies[k] for k in which], self.pool)
        ends = np.array([body.reach + 0j for body in bodies.each])
        values, at = bodies.evans(np.arange(len(ends)), ends, rough=True)
        at = at + np.log(np.abs(values))
        moved = np.zeros(len(owner))

        def function(points: Integers, sigma: Complex) -> Complex:
            found, logs = bodies.evans(owner[points], sigma, rough)
            moved[points] = logs - at[owner[points]]
            return np.asarray(found * np.exp(moved[points]))

        return function, moved

    def _follow(self) -> list[Zeros]:
        """Zeros of each by rough secants, where these do not settle from circles."""
        parents = [self.parents[int(k)] for k in self.which]
        foretold = [zeros.foretold() for zeros in parents]
        within = [
            np.abs(guess) < FOLLOWED * self.bodies[k].reach for k, guess in zip(self.which, foretold, strict=True)
        ]
        pairs = list(zip(foretold, within, strict=True))
        start = np.concatenate([guess[part] for guess, part in pairs])
        room = np.concatenate([room_of(guess[part], _images(guess, self.drag)) for guess, part in pairs])
        slope = np.concatenate([zeros.slope[part] for zeros, part in zip(parents, within, strict=True)])
        owner = np.repeat(np.arange(len(parents)), [int(part.sum()) for part in within])
        function, _ = self._function(owner, self.which, rough=True)
        found = secants(function, start, room, ROUGH, slope, _lines_of(start, self.drag))
        zeros = []
        for k, (body, part) in enumerate(zip(self.which, within, strict=True)):
            mine, before = owner == k, parents[k].sigma[part]
            settled = found.settled[mine]
            sigma = found.sigma[mine]
            if not settled.all():
                sigma = rough_zeros(self.bodies[body], np.where(settled, sigma, start[mine]), settled)
                sigma = sigma if self.drag else _on_axes(sigma)
            lost = np.full(len(sigma) - int(settled.sum()), np.nan + 0j)
            zeros.append(
                Zeros(
                    sigma,
                    np.concatenate([before[settled], lost]),
                    np.concatenate([found.slope[mine][settled], lost]),
                )
            )
        return zeros

    def _leading(self, zeros: list[Zeros], which: Integers) -> list[Roots | None]:
        """To rounding those that may be the leading ones, or are next to the imaginary axis; and all that grow."""
        wanted = [np.flatnonzero(_wanted(part.sigma, self.drag)) for part in zeros]
        if not wanted:
            return []
        owner = np.repeat(np.arange(len(zeros)), [len(some) for some in wanted])
        start, slope = (
            np.concatenate([getattr(part, name)[some] for part, some in zip(zeros, wanted, strict=True)])
            for name in ("sigma", "slope")
        )
        function, moved = self._function(owner, self.which[which], rough=False)
        room = np.full(len(start), 10.0 * CLOSE)
        found = secants(function, start, room, FINE, slope, _lines_of(start, self.drag))
        steps = np.array([len(self.bodies[k].sizes) for k in self.which[which]])
        noise = noise_of(steps[owner], np.abs(found.slope * np.exp(-moved)), found.sigma)
        roots: list[Roots | None] = []
        for k, (part, some) in enumerate(zip(zeros, wanted, strict=True)):
            mine = owner == k
            if not found.settled[mine].all():
                roots.append(None)
                continue
            part.sigma[some] = found.sigma[mine]
            others = np.setdiff1d(np.flatnonzero(part.sigma.real > CLOSE), some)
            sigma = np.concatenate([found.sigma[mine], part.sigma[others]])
            error = np.concatenate([np.maximum(found.error, noise)[mine], np.full(len(others), ROUGH)])
            order = np.lexsort((np.abs(sigma.imag), -sigma.real))
            roots.append(Roots(sigma[order], error[order]))
        return roots

    def _answer(self, k: int, roots: Roots, zeros: Zeros) -> Answer | None:
        grows = (roots.sigma.real > np.maximum(roots.error, STILL)) & (np.abs(roots.sigma) < self.bodies[k].reach)
        unstable = int(np.where(roots.sigma[grows].imag == 0.0, 1, 2).sum())
        index = int(self.shapes.index[k])
        if not self.drag and (index < 0 or unstable > index or (index - unstable) % 2):
            return None
        leading, error = complex(roots.sigma[0]), float(roots.error[0])
        return Answer(leading, error, unstable, index, status.OK, zeros)


def _wanted(sigma: Complex, drag: bool) -> NDArray[np.bool_]:
    """Which zeros may be the leading ones, or grow."""
    if drag:
        return np.asarray((np.abs(sigma.real) < CLOSE) | (sigma.real > sigma.real.max() - CLOSE))
    grow = sigma.real > 0.0
    return np.asarray(grow if grow.any() else np.abs(sigma) == np.abs(sigma).min())


def _lines_of(sigma: Complex, drag: bool) -> Complex:
    """What is real stays so, and what does not grow without drag."""
    on = np.where(sigma.imag == 0.0, 1.0 + 0j, 0j)
    return on if drag else np.where(sigma.real == 0.0, 1j, on)


def _line(sigma: Complex) -> float:
    """Real part of a line left of the leading zero, in the widest gap between zeros."""
    leading = min(0.0, float(sigma.real.max()))
    low, high = leading - LINE[1], leading - LINE[0]
    places = np.sort(np.concatenate([[low, high], sigma.real[(sigma.real > low) & (sigma.real < high)]]))
    k = int(np.argmax(np.diff(places)))
    return float(0.5 * (places[k] + places[k + 1]))


def _on_axes(sigma: Complex) -> Complex:
    """Without drag: what is beside the imaginary axis by rounding on it, and one of each pair of images."""
    sigma = np.where(np.abs(sigma.real) < CLOSE, 1j * sigma.imag, sigma)
    return sigma[(sigma.real >= 0.0) & (sigma.imag >= 0.0)]


def _images(sigma: Complex, drag: bool) -> Complex:
    both = np.concatenate([sigma, sigma.conj()])
    return both if drag else np.concatenate([both, -both])


def _inside(known: Complex, reach: float, line: float | None) -> int:
    """How many zeros and their images are where they are counted."""
    images = np.where(known.imag == 0.0, 1, 2)
    if line is None:
        return int((images * np.where(known.real == 0.0, 1, 2))[np.abs(known) < reach].sum())
    return int(images[(np.abs(known) < reach) & (known.real > line)].sum())


def _distinct(sigma: Complex) -> bool:
    apart = np.abs(sigma[:, None] - sigma) + np.eye(len(sigma))
    return len(sigma) > 0 and bool(apart.min() > CLOSE)
