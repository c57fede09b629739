"""Where inner shapes in a vacuum begin and cease to flutter: Krein collisions over the length of the cable.

With sigma = i sqrt(s), D is real for real s, and even in sigma, so that it is smooth in s: two oscillations meet where
D and its derivative in s are zero. Unknowns are the offset of the fish, the speed, the length and s; a curve ends at
the limits of length and speed, at a fold of the statics, or at s = 0, beyond which growth rates are real.
"""

from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience
from towatlas.kernels import status
from towatlas.limits import unchecked_threshold_length
from towatlas.numerics.curves import Curve, Steps, follow, tangents
from towatlas.numerics.rows import solve_systems
from towatlas.results_motion import Boundary
from towatlas.solve.critical import solve_rows
from towatlas.solve.jets import jets_of
from towatlas.solve.motion import Array, Integers, Motion, Motions, motions
from towatlas.solve.positions import ROUNDED
from towatlas.solve.shots import shoot
from towatlas.solve.spectrum import noise_of
from towatlas.system import nondense_rows

# log of the offset of the fish, of the speed, of the length beyond the threshold, and s.
X, SPEED, EXCESS, S = range(4)
UNKNOWNS = 4
# Differences of the unknowns for slopes; circle of D around s, and points of its upper half.
DIFFERENCE, RADIUS, HALF = 1e-5, 0.15, 17
# With so many, enough to follow a curve by, what is past the end of the series moves speeds by up to 2e-3; points are
# then solved for by so many steps of Newton's method, none of them longer than the last.
HALF_FOLLOWED, POLISHING, FAR = 9, 12, 0.02
STEPS = Steps(first=0.01, longest=0.25, shortest=1e-6, near=1e-6, bent=0.3, easy=3, corrections=8, points=400)
ROUNDS, LONGEST, SETTLED, NOISE = 20, 0.2, 1e-11, 1e-8
# Solved for side by side: the series of their shapes are held in memory.
TOGETHER = 64
REMEDY = "a smaller n has fewer of them"
SLOPE = jets_of(1)


@dataclass(frozen=True)
class Domain:
    """How far curves are followed.

    Attributes
    ----------
    excess : (float, float)
        Of lambda - lambda_cn [-], > 0.
    speeds : float
        The highest speed over gamma_cn [-], > 1.
    """

    excess: tuple[float, float] = (1e-2, 1e2)
    speeds: float = 3.0


class Collisions:
    """Equations of Krein collisions, of rows of n and w_f."""

    def __init__(self, n: Integers, w_f: Array, domain: Domain, pool: Executor | None = None, half: int = HALF):
        self.n, self.w_f, self.domain, self.pool, self.half = n, w_f, domain, pool, half
        self.threshold = unchecked_threshold_length(w_f, n)

    def systems(self, z: Array, rows: Integers) -> Array:
        """As the kernels take them."""
        lam = self.threshold[rows] + np.exp(z[:, EXCESS])
        return nondense_rows(lam=lam, w_f=self.w_f[rows], C=np.zeros(len(rows)))

    def values(self, z: Array, rows: Integers) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
        """How far points are from being collisions, shape (points, 3), the slope of that in s, slopes of the radius of
        the tow point along shots, and whether they are sound."""
        gamma, systems = np.exp(z[:, SPEED]), self.systems(z, rows)
        r = np.exp(z[:, X])
        ends = shoot(r, gamma, systems, SLOPE)
        miss = np.log(np.hypot(ends.X[:, 0], ends.Y[:, 0])) - 2.0 * z[:, SPEED]
        bodies = self._bodies(z, rows)
        sound = (ends.status == status.OK) & np.array([body.status == status.OK for body in bodies])
        terms, _ = self._series(z, bodies)
        slope = np.stack([np.zeros(len(z)), terms[:, 1] / RADIUS, 2.0 * terms[:, 2] / RADIUS], axis=1)
        return np.stack([miss, terms[:, 0], terms[:, 1]], axis=1), slope, ends.log_rho[:, 1], sound

    def noise(self, z: Array, rows: Integers) -> Array:
        """What values are not known by: rounding, and what is past the end of the series, shape (points, 3)."""
        bodies = self._bodies(z, rows)
        terms, size = self._series(z, bodies)
        steps = np.array([len(body.sizes) for body in bodies])
        # Terms fall ever faster: twice as far along they are less than the square.
        of_series = noise_of(steps, size, np.zeros(len(z), complex)) + np.square(terms[:, -1])
        return np.stack([ROUNDED * np.sqrt(steps), of_series, of_series], axis=1)

    def _bodies(self, z: Array, rows: Integers) -> list[Motion]:
        gamma = np.exp(z[:, SPEED])
        reach = 1.0 + np.sqrt(np.abs(z[:, S]) + RADIUS)
        return motions(np.exp(z[:, X]) / gamma**2, gamma, self.systems(z, rows), reach, pool=self.pool)

    def _series(self, z: Array, bodies: list[Motion]) -> tuple[Array, Array]:
        """Of D in s over the radius of the circle, shape (points, half), of unit length, and how long they were."""
        turn = np.exp(1j * np.pi * np.arange(self.half) / (self.half - 1))
        points = z[:, S, None] + RADIUS * turn
        owner = np.repeat(np.arange(len(z)), self.half)
        values, logs = Motions(bodies, self.pool).evans(owner, 1j * np.sqrt(points.astype(complex)).ravel())
        values, logs = values.reshape(points.shape), logs.reshape(points.shape)
        values = values * np.exp(logs - logs.max(axis=1)[:, None])
        circle = np.concatenate([values, values[:, -2:0:-1].conj()], axis=1)
        series = np.fft.fft(circle, axis=1).real[:, : self.half] / circle.shape[1]
        size = np.sqrt(np.square(series).sum(axis=1))
        return series / size[:, None], size

    # Newton's method may go far astray: what overflows there is not sound.
    @np.errstate(over="ignore", divide="ignore", invalid="ignore")
    def __call__(self, z: Array, rows: Integers) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
        """As `towatlas.numerics.curves.Equations`."""
        aside = DIFFERENCE * np.eye(UNKNOWNS)[:S]
        steps = np.concatenate([np.zeros((1, UNKNOWNS)), aside, -aside])
        every = (z[:, None] + steps).reshape(-1, UNKNOWNS)
        values, by_s, slope, sound = self.values(every, np.repeat(rows, len(steps)))
        values, by_s = (part.reshape(len(z), len(steps), 3) for part in (values, by_s))
        by_others = (values[:, 1 : S + 1] - values[:, S + 1 :]) / (2.0 * DIFFERENCE)
        jacobian = np.concatenate([by_others, by_s[:, :1]], axis=1)
        slope = slope.reshape(len(z), -1)
        sound = np.asarray(sound.reshape(len(z), -1).all(axis=1) & np.isfinite(values).all(axis=(1, 2)))
        return values[:, 0], np.swapaxes(jacobian, 1, 2), self.limits(z, rows, slope[:, 0]), sound

    @np.errstate(over="ignore", invalid="ignore")
    def limits(self, z: Array, rows: Integers, slope: Array) -> Array:
        """What is positive within the domain: of length, at both ends, speed, fold, and s."""
        low, high = np.log(self.domain.excess)
        excess = np.exp(z[:, EXCESS])
        fold = solve_rows(lam=self.threshold[rows] + excess, w_f=self.w_f[rows], n=self.n[rows], excess=excess)["gamma"]
        speed = np.log(self.domain.speeds * fold) - z[:, SPEED]
        # Along shots of inner shapes the radius of the tow point rises.
        return np.stack([z[:, EXCESS] - low, high - z[:, EXCESS], speed, slope, z[:, S]], axis=1)

    def solve(self, z: Array, rows: Integers, fixed: int, rounds: int = ROUNDS) -> tuple[Array, NDArray[np.bool_]]:
        """Collisions near points, by Newton's method, with one of the limits fixed at zero, or where `fixed` is -1 the
        length as it is; and which were found."""
        if len(z) > TOGETHER:
            parts = np.split(np.arange(len(z)), range(TOGETHER, len(z), TOGETHER))
            solved = [self.solve(z[part], rows[part], fixed, rounds) for part in parts]
            return np.concatenate([one[0] for one in solved]), np.concatenate([one[1] for one in solved])
        z, good, last = z.copy(), np.ones(len(z), bool), np.full(len(z), np.inf)
        i = np.arange(len(z))
        for _ in range(rounds):
            check_patience("where flutter begins and ends", REMEDY)
            value, jacobian, limits, sound = self(z[i], rows[i])
            wanted, gradient = np.zeros(len(i)), np.zeros((len(i), 1, UNKNOWNS))
            if fixed < 0:
                gradient[:, 0, EXCESS] = 1.0
            else:
                wanted = limits[:, fixed]
                for k in range(UNKNOWNS):
                    shift = DIFFERENCE * np.eye(UNKNOWNS)[k]
                    ahead, behind = (self._limit(z[i] + side * shift, rows[i], fixed) for side in (1.0, -1.0))
                    gradient[:, 0, k] = (ahead - behind) / (2.0 * DIFFERENCE)
            matrix = np.concatenate([jacobian, gradient], axis=1)
            step = solve_systems(matrix, -np.concatenate([value, wanted[:, None]], axis=1))
            length = np.linalg.norm(step, axis=1)
            good[i] = sound & np.isfinite(length)
            step *= np.minimum(1.0, LONGEST / np.maximum(length, 1e-300))[:, None]
            z[i[good[i]]] += step[good[i]]
            # A step that no longer shrinks is rounding.
            over = ~good[i] | (length < SETTLED) | ((length < NOISE) & (length > 0.5 * last[i]))
            last[i] = length
            i = i[~over]
            if not len(i):
                break
        return z, good & (last < NOISE)

    def _limit(self, z: Array, rows: Integers, fixed: int) -> Array:
        slope = np.zeros(len(z))
        if fixed == FOLD:
            ends = shoot(np.exp(z[:, X]), np.exp(z[:, SPEED]), self.systems(z, rows), SLOPE)
            slope = ends.log_rho[:, 1]
        return self.limits(z, rows, slope)[:, fixed]


def begins(jacobian: Array) -> NDArray[np.bool_]:
    """Whether flutter begins as the speed rises, or ceases, from the slopes of the equations at collisions."""
    # Along the branch D = (its slope) (log gamma - there) + (half its curvature) (s - there)^2.
    with np.errstate(invalid="ignore", divide="ignore"):
        along = -jacobian[:, 0, SPEED] / jacobian[:, 0, X]
    return np.asarray((jacobian[:, 1, SPEED] + along * jacobian[:, 1, X]) * jacobian[:, 2, S] > 0.0)


SHORT, LONG, FAST, FOLD, REAL = range(5)
KINDS = ("length", "length", "speed", "fold", "real")


def boundaries(start: Array, n: Integers, w_f: Array, domain: Domain, pool: Executor | None = None) -> list[Boundary]:
    """Whole curves through collisions; those that are on the curve of one before are left out.

    Parameters
    ----------
    start : ndarray, shape (points, 4)
        Collisions: log of the offset of the fish, of the speed, of lambda - lambda_cn, and s.
    n : ndarray of int, shape (points,)
    w_f : ndarray, shape (points,)
    domain : Domain
    pool : Executor, optional
        For threads.

    Returns
    -------
    list of Boundary
    """
    found: list[Boundary] = []
    left = np.arange(len(start))
    while len(left):
        # One curve of each n and w_f at a time.
        _, first = np.unique(np.stack([n[left].astype(float), w_f[left]]), axis=1, return_index=True)
        now = left[np.sort(first)]
        equations = Collisions(n[now], w_f[now], domain, pool, HALF_FOLLOWED)
        rows = np.arange(len(now))
        direction = tangents(equations(start[now], rows)[1])
        halves = [follow(equations, start[now], side * direction, _stop, STEPS) for side in (1.0, -1.0)]
        gone = set(now.tolist())
        for row, k in enumerate(now):
            if not len(halves[0][row].points) or not len(halves[1][row].points):
                continue
            one = Collisions(n[k : k + 1], w_f[k : k + 1], domain, pool)
            boundary, points = _whole(one, halves[0][row], halves[1][row])
            found.append(boundary)
            same = [i for i in left if n[i] == n[k] and w_f[i] == w_f[k]]
            gone |= {i for i in same if _on_curve(points, start[i])}
        left = np.array([i for i in left if i not in gone], np.int64)
    return found


def _stop(z: Array, tangent: Array, monitors: Array, rows: Integers) -> NDArray[np.bool_]:
    return np.asarray((monitors < 0.0).any(axis=1))


def _whole(equations: Collisions, ahead: Curve, back: Curve) -> tuple[Boundary, Array]:
    """Both halves as one curve, its ends and turning points solved for; and its points."""
    parts, kinds = [], []
    for curve in (back, ahead):
        points, kind = curve.points, "unknown"
        if curve.complete and len(points) > 1:
            crossed = int(np.flatnonzero(curve.monitors[-1] < 0.0)[0])
            a, b = curve.monitors[-2, crossed], curve.monitors[-1, crossed]
            guess = curve.between(len(points) - 2, float(a / (a - b)))[None]
            end, good = equations.solve(guess, np.zeros(1, np.int64), crossed)
            near = np.linalg.norm(end[0] - guess[0]) < STEPS.longest
            points = points[:-1]
            if good[0] and near:
                points, kind = np.concatenate([points, end]), KINDS[crossed]
        parts.append(points)
        kinds.append(kind)
    points = np.concatenate([parts[0][::-1], parts[1][1:]])
    turns: list[int] = []
    k = 1
    while k < len(points) - 1:
        before, after = points[k, EXCESS] - points[k - 1, EXCESS], points[k + 1, EXCESS] - points[k, EXCESS]
        if before * after < 0.0:
            turned = _turning(equations, points[k])
            # Next to a cusp the curve turns about, and secants on its direction may go astray: there the point stays.
            room = max(np.linalg.norm(points[k + side] - points[k]) for side in (-1, 1))
            if np.linalg.norm(turned - points[k]) <= room:
                points[k] = turned
            turns.append(k)
        k += 1
    rows = np.zeros(len(points), np.int64)
    matrix, step = _newton(equations, points)
    for _ in range(POLISHING):
        size = np.linalg.norm(step, axis=1)
        left = np.flatnonzero((size > SETTLED) & (size < FAR))
        if not len(left):
            break
        # Next to a cusp steps may lead astray: a point stays where the next one is no shorter.
        tried = points[left] + step[left]
        there, further = _newton(equations, tried)
        better = np.linalg.norm(further, axis=1) < size[left]
        k = left[better]
        points[k], matrix[k], step[k] = tried[better], there[better], further[better]
    jacobian, error = matrix[:, :3], np.abs(step[:, SPEED])
    noise = equations.noise(points, rows)
    for k in range(noise.shape[1]):
        error += np.abs(solve_systems(matrix, noise[:, k, None] * np.eye(UNKNOWNS)[k])[:, SPEED])
    gamma = np.exp(points[:, SPEED])
    found = Boundary(
        n=int(equations.n[0]),
        w_f=float(equations.w_f[0]),
        lam=equations.threshold[0] + np.exp(points[:, EXCESS]),
        gamma=gamma,
        omega=np.sqrt(np.maximum(points[:, S], 0.0)),
        r_f=np.exp(points[:, X]) / gamma**2,
        turns=np.array(turns, np.int64),
        error=error,
        begins=begins(jacobian),
        kinds=(kinds[0], kinds[1]),
    )
    return found, points


def _newton(equations: Collisions, points: Array) -> tuple[Array, Array]:
    """Matrices of Newton's method across a curve, and its steps."""
    value, jacobian, _, _ = equations(points, np.zeros(len(points), np.int64))
    matrix = np.concatenate([jacobian, tangents(jacobian)[:, None]], axis=1)
    return matrix, solve_systems(matrix, np.concatenate([-value, np.zeros((len(points), 1))], axis=1))


def _turning(equations: Collisions, z: Array) -> Array:
    """Where the length along a curve is at an extremum, near a point: secants on its direction."""
    zero = np.zeros(1, np.int64)
    z, heights, shift = z.copy(), [], 1e-3
    places = [0.0]
    start, direction = None, np.zeros(UNKNOWNS)
    for _ in range(ROUNDS):
        for _ in range(4):
            value, jacobian, _, _ = equations(z[None], zero)
            direction = tangents(jacobian)[0]
            step = solve_systems(
                np.concatenate([jacobian, direction[None, None]], axis=1), np.append(-value[0], 0.0)[None]
            )
            z = z + step[0]
            if np.linalg.norm(step) < SETTLED:
                break
        start = direction if start is None else start
        direction = direction * np.sign(direction @ start)
        heights.append(direction[EXCESS])
        if len(heights) > 1:
            if heights[-1] == heights[-2] or abs(heights[-1]) < SETTLED:
                break
            shift = -heights[-1] * (places[-1] - places[-2]) / (heights[-1] - heights[-2])
        shift = float(np.clip(shift, -STEPS.longest, STEPS.longest))
        places.append(places[-1] + shift)
        z = z + shift * direction
    return z


def _on_curve(points: Array, z: Array) -> bool:
    """Whether a point lies on a curve, between its points within what it may be bent."""
    a, b = points[:-1], points[1:]
    along = b - a
    share = np.clip(((z - a) * along).sum(1) / np.maximum(np.square(along).sum(1), 1e-300), 0.0, 1.0)
    return bool((np.linalg.norm(a + share[:, None] * along - z, axis=1) < 0.02).any())
