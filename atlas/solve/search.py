"""All shapes of many systems, each at one speed: roots in x = log r, the radius of the fish, of one function.

The radius of the tow point, as a function of that of the fish, is sampled with its slope until cubics predict it
wherever it may be the tow radius; its extrema near there are found, for they part the pairs; between them Newton's
method in brackets finds the roots. Systems are worked on side by side: every round of shots is one call.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_foreseen, each_allowed, limited
from towatlas.kernels import status
from towatlas.kernels.system import C_F, C_T, LAM, M_F, W_F, W
from towatlas.numerics.hermite import cubic, cubic_coefficients
from towatlas.numerics.rows import bracket
from towatlas.solve.looks import SLOPE, look
from towatlas.solve.shots import REMEDY, Array, Integers, shoot

# Points a decade at first; halvings of an interval at most; how well the interpolant of the tow point must predict the
# middle of an interval, in tow radii; an extremum of log rho predicted to be this near to zero is solved for.
PER_DECADE = 6
HALVINGS = 40
PREDICTED = 1e-3
NEAR_FOLD = 0.01
# The same where the radius rises by less than this a unit of x.
FLAT, PREDICTED_FLAT = 0.05, 1e-9
# How much of the width of an interval an error of the slope in its middle counts.
SLOPE_SHARE = 0.25
# Half an interval over which the tow point turns about the axis by more than this is halved again [rad].
TURNED = 2.0
# Where the search begins: shots so near the axis that the radius at the tow point is proportional to that at the fish,
# looked for in steps of DOWN.
LINEAR = 1e-3
FIRST_LOW, SMALLEST, DOWN = 1e-6, 1e-18, 100.0
# The fish is never farther out than a straight cable reaches.
BEYOND = 1.0 + 1e-9
# Shares of an interval at which its interpolant is looked at.
LOOKS = np.linspace(0.0, 1.0, 17)
# Steps this small, in log r, are the last: the square of them is rounding.
LAST_STEP = 1e-9
# Where shots are made to foresee how long the others are, as shares of the range, of so many of the systems; about how
# many those are, and more where the angle of the tow point turns, a radian; steps of so many seconds of CPU.
PROBES, PROBED = np.array([0.0, 0.2, 0.4, 0.6, 0.8, 0.95]), 4
EXPECTED_SHOTS, SHOTS_A_RADIAN, SECONDS_A_STEP = 100, 1.0, 5e-7
# Systems worked on at a time: their samples are what memory holds.
BLOCK = 512


@dataclass(frozen=True)
class Found:
    """Shapes found, sorted by system and from the axis outwards.

    Attributes
    ----------
    row : ndarray of int, shape (shapes,)
        Of the system.
    x : ndarray, shape (shapes,)
        log r of the fish, lengths over g / Omega^2.
    peaks : ndarray, shape (extrema, 3)
        Extrema of log rho as the interpolants have them: system, x, log rho.
    low : ndarray, shape (systems,)
        x where the search began.
    shots : ndarray of int, shape (systems,)
        Made with derivative.
    unsearched : ndarray, shape (systems, 2)
        Between which x shots failed; nan where none did.
    status : ndarray of int, shape (systems,)
        Codes of `towatlas.kernels.status`: OK where all of the range was searched.
    """

    row: Integers
    x: Array
    peaks: Array
    low: Array
    shots: Integers
    unsearched: Array
    status: Integers


def search(systems: Array, gamma: Array) -> Found:
    """All shapes that a search finds of systems at speeds.

    Parameters
    ----------
    systems : ndarray, shape (systems, columns)
        As of `System.row`.
    gamma : ndarray, shape (systems,)
        Speeds [-].

    Returns
    -------
    Found
    """
    parts = [
        _Search(systems[k : k + BLOCK], np.asarray(gamma, float)[k : k + BLOCK], k).found()
        for k in range(0, len(systems), BLOCK)
    ]
    return Found(*(np.concatenate([getattr(part, name) for part in parts]) for name in Found.__annotations__))


class _Search:
    """A block of systems; points are kept sorted by system and x, with X, Y and their slopes over tow radius, log rho
    and its slope, and the angle of the tow point, nan where a shot failed; steps of the shot, and whether it is rough.
    """

    def __init__(self, systems: Array, gamma: Array, first: int):
        self.systems, self.gamma, self.first = systems, gamma, first
        self.scale = np.square(gamma)
        self.shots, self.steps = np.zeros((2, len(gamma)), np.int64)
        self.codes = np.full(len(gamma), status.OK)
        self.unsearched = np.full((len(gamma), 2), np.nan)

    def found(self) -> Found:
        self._foresee()
        low, high = self._range()
        rows, x = self._first_points(low, high)
        rows, x, values = self._refined(rows, x)
        peaks = _peaks(rows, x, values)
        roots_row, roots = self._roots(rows, x, values, peaks)
        return Found(
            roots_row + self.first,
            roots,
            np.stack([peaks[0] + self.first, peaks[1], peaks[2]], axis=1),
            low,
            self.shots,
            self.unsearched,
            self.codes,
        )

    def _look(self, rows: Integers, x: Array, rough: bool = True) -> Array:
        """Values at points; shape (9, points)."""
        found = look(np.exp(x), self.gamma[rows], self.systems[rows], rough=rough)
        np.add.at(self.shots, rows, 1)
        np.add.at(self.steps, rows, found.steps)
        bad = self._note(rows, x, found.status)
        values = np.stack(
            [
                *found.X[:, :1].T,
                *found.Y[:, :1].T,
                found.X[:, 1],
                found.Y[:, 1],
                *found.log_rho.T,
                found.angle,
                found.steps,
                found.rough,
            ]
        )
        values[:-2, bad | ~np.isfinite(values).all(axis=0)] = np.nan
        return values

    def _shoot(self, rows: Integers, x: Array) -> Array:
        """log rho and its slope at points, as well as they can be; shape (2, points)."""
        ends = shoot(np.exp(x), self.gamma[rows], self.systems[rows], SLOPE)
        np.add.at(self.shots, rows, 1)
        values = ends.log_rho.T.copy()
        values[:, self._note(rows, x, ends.status)] = np.nan
        return values

    def _note(self, rows: Integers, x: Array, codes: Integers) -> NDArray[np.bool_]:
        """Which shots failed; noted down."""
        bad = codes != status.OK
        self.codes[rows[bad]] = codes[bad]
        np.fmin.at(self.unsearched[:, 0], rows[bad], x[bad])
        np.fmax.at(self.unsearched[:, 1], rows[bad], x[bad])
        return bad

    def _range(self) -> tuple[Array, Array]:
        """Bounds of x: from the linear limit to a straight cable."""
        low, high = self._bounds()
        # Where energy bounds the range nothing is below it.
        open_ = np.flatnonzero(low <= np.log(FIRST_LOW * self.scale))
        while len(open_):
            log_rho, slope = self._look(open_, low[open_])[4:6]
            linear = (log_rho < np.log(LINEAR)) & (np.abs(slope - 1.0) < LINEAR)
            open_ = open_[~linear & (low[open_] > np.log(SMALLEST * self.scale[open_]))]
            low[open_] -= np.log(DOWN)
        # What failed below the range that is searched does not matter.
        self.codes[:], self.unsearched[:] = status.OK, np.nan
        return low, high

    def _bounds(self) -> tuple[Array, Array]:
        """Of x, at first."""
        low = np.maximum(FIRST_LOW, least_radius(self.systems, self.gamma) / BEYOND)
        return np.log(low * self.scale), np.log(self.scale * (1.0 + self.systems[:, LAM]) * BEYOND)

    def _foresee(self) -> None:
        """Refuse at once what would take longer than there is patience for, by a few shots of some systems."""
        count = len(self.gamma)
        if not limited() or not count:
            return
        some = np.unique(np.linspace(0, count - 1, PROBED).astype(np.int64))
        low, high = (bound[some, None] for bound in self._bounds())
        x = low + PROBES * (high - low)
        rows = np.repeat(some, len(PROBES))
        found = look(np.exp(x.ravel()), self.gamma[rows], self.systems[rows])
        values = np.stack([found.angle, found.steps]).reshape(2, *x.shape)
        least = np.full((len(some), len(PROBES) - 1), EXPECTED_SHOTS / (len(PROBES) - 1.0))
        _check_foreseen(values[..., :-1], values[..., 1:], least, count / len(some))

    def _first_points(self, low: Array, high: Array) -> tuple[Integers, Array]:
        counts = np.ceil((high - low) / np.log(10.0) * PER_DECADE).astype(np.int64) + 1
        rows = np.repeat(np.arange(len(low)), counts)
        place = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = place / (counts[rows] - 1)
        return rows, low[rows] + share * (high - low)[rows]

    def _refined(self, rows: Integers, x: Array) -> tuple[Integers, Array, Array]:
        """Points halved until cubics through them tell the tow point wherever it may lie at the tow radius."""
        values = self._look(rows, x)
        failed = np.isnan(values[4])
        # Between two shots that failed a third would.
        active = (rows[1:] == rows[:-1]) & ~(failed[1:] & failed[:-1])
        for _ in range(HALVINGS):
            active &= ~self._gives_up(rows, values, active)[rows[:-1]]
            i = np.flatnonzero(active)
            if not len(i):
                break
            _check_foreseen(values[6:8, i], values[6:8, i + 1], np.ones(len(i)))
            middle, width = 0.5 * (x[i] + x[i + 1]), x[i + 1] - x[i]
            new = self._look(rows[i], middle)
            split, flat = _to_split(values[:, i], values[:, i + 1], new, width)
            vague = np.flatnonzero(flat & (values[8, i] + values[8, i + 1] + new[8] > 0.0))
            if len(vague):
                k = i[vague]
                for points in (k, k + 1):
                    values[:, points] = self._look(rows[points], x[points], rough=False)
                new[:, vague] = self._look(rows[k], middle[vague], rough=False)
                split, _ = _to_split(values[:, i], values[:, i + 1], new, width)
            order = np.lexsort((np.concatenate([x, middle]), np.concatenate([rows, rows[i]])))
            again = np.zeros(len(x), bool)
            again[i] = split
            active = np.concatenate([again, split])[order][:-1]
            rows, x = np.concatenate([rows, rows[i]])[order], np.concatenate([x, middle])[order]
            values = np.concatenate([values, new], axis=1)[:, order]
        # The sides that roots are bracketed by.
        vague = np.flatnonzero((values[8] > 0.0) & (np.abs(values[4]) < NEAR_FOLD))
        values[:, vague] = self._look(rows[vague], x[vague], rough=False)
        known = (self.codes != status.UNFINISHED)[rows]
        return rows[known], x[known], values[:, known]

    def _gives_up(self, rows: Integers, values: Array, active: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Which systems are given up for the steps that one of many may take; noted down."""
        i = np.flatnonzero(active)
        steps = _foreseen(values[6:8, i], values[6:8, i + 1], np.ones(len(i)))[1]
        foreseen = self.steps + np.bincount(rows[i], steps, minlength=len(self.steps))
        given_up = foreseen > each_allowed() / SECONDS_A_STEP
        self.codes[given_up] = status.UNFINISHED
        return np.asarray(given_up)

    def _roots(self, rows: Integers, x: Array, values: Array, peaks: tuple[Integers, Array, Array, Integers]) -> tuple:
        """All roots of log rho between the points, extrema solved for first so that they part the pairs."""
        rows, x, height = self._parted(rows, x, values, peaks)
        together = rows[1:] == rows[:-1]
        k = np.flatnonzero(together & (height[:-1] * height[1:] < 0.0) | together & (height[1:] == 0.0))
        rising = np.where(height[k + 1] > height[k], 1.0, -1.0)

        def radius(z: Array, i: Integers) -> tuple[Array, Array]:
            value, slope = self._shoot(rows[k[i]], z) * rising[i]
            return value, slope

        found, solved = bracket(radius, x[k], x[k + 1], last_step=LAST_STEP)
        lost = rows[k[~solved]]
        self.codes[lost[self.codes[lost] == status.OK]] = status.NOT_CONVERGED
        good = solved & np.isfinite(found)
        return rows[k[good]], found[good]

    def _parted(
        self, rows: Integers, x: Array, values: Array, peaks: tuple[Integers, Array, Array, Integers]
    ) -> tuple[Integers, Array, Array]:
        """Points with those added that part pairs of roots: extrema on the other side of zero than both ends."""
        peak_row, peak, predicted, left = peaks
        at_left, at_right = values[4][left], values[4][left + 1]
        hidden = (at_left * at_right > 0.0) & (predicted * at_left < 0.0) | (np.abs(predicted) < NEAR_FOLD)
        i = np.flatnonzero(hidden)
        if not len(i):
            return rows, x, values[4]
        near = np.abs(predicted[i]) < NEAR_FOLD
        peak, peak_row, left = peak[i], peak_row[i], left[i]
        height = self._shoot(peak_row, peak)[0]
        # Those near zero, and those that are not where they were predicted, by false position on the slope, if the
        # slopes at the ends of their interval say that there is one extremum in it.
        side = np.where(values[5][left] > 0.0, -1.0, 1.0)
        exact = np.flatnonzero(
            (near | (height * values[4][left] > 0.0)) & (values[5][left] * values[5][left + 1] < 0.0)
        )

        def slope(z: Array, k: Integers) -> tuple[Array, Array]:
            along = self._shoot(peak_row[exact[k]], z)[1] * side[exact[k]]
            return along, np.full(len(z), np.nan)

        if len(exact):
            where, solved = bracket(slope, x[left[exact]], x[left[exact] + 1], start=peak[exact], resolution=LAST_STEP)
            good = solved & np.isfinite(where)
            peak[exact[good]] = where[good]
            height[exact[good]] = self._shoot(peak_row[exact[good]], where[good])[0]
        rows, x = np.concatenate([rows, peak_row]), np.concatenate([x, peak])
        order = np.lexsort((x, rows))
        return rows[order], x[order], np.concatenate([values[4], height])[order]


def least_radius(systems: Array, gamma: Array) -> Array:
    """A radius of the fish, over tow radius, below which no cable reaches the tow radius.

    Parameters
    ----------
    systems : ndarray, shape (systems, columns)
        As of `System.row`.
    gamma : ndarray, shape (systems,)
        Speed [-].

    Returns
    -------
    ndarray, shape (systems,)
        Zero where there is none.

    Notes
    -----
    Without tangential drag T + (X^2 + Y^2) / 2 - w h is the same all along the cable. At the tow point T > 0 and
    |h| <= lam, so that at the fish T + r^2 / 2 exceeds 1 / 2 - |w| lam / gamma^2, lengths over tow radius.
    """
    wanted = 0.5 - np.abs(systems[:, W]) * systems[:, LAM] / gamma**2
    wanted[systems[:, C_T] != 0.0] = 0.0
    low, high = np.zeros(len(gamma)), np.ones(len(gamma))
    for _ in range(40):
        r = 0.5 * (low + high)
        tension = np.sqrt(
            (systems[:, M_F] * r) ** 2 + (systems[:, C_F] * r * r) ** 2 + (systems[:, W_F] / gamma**2) ** 2
        )
        below = tension + 0.5 * r * r < wanted
        low, high = np.where(below, r, low), np.where(below, high, r)
    return low


def _check_foreseen(a: Array, b: Array, least: Array, times: float = 1.0) -> None:
    """Refuse what would take longer than there is patience for, as `_foreseen`, and so many times as long."""
    steps, count = (float(np.sum(part) * times) for part in _foreseen(a, b, least)[::-1])
    check_foreseen(
        steps * SECONDS_A_STEP,
        f"shots with drag of about {steps / max(count, 1.0):,.0f} steps, some {float(f'{count:.2g}'):,.0f} of them",
        REMEDY,
    )


def _foreseen(a: Array, b: Array, least: Array) -> tuple[Array, Array]:
    """Shots, and steps of them, in intervals, by angle and steps of shots at both ends, shape (2, ...); at least so
    many shots in each."""
    shots = np.maximum(least, SHOTS_A_RADIAN * np.nan_to_num(np.abs(b[0] - a[0])))
    return shots, shots * 0.5 * (a[1] + b[1])


def _to_split(a: Array, b: Array, new: Array, width: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which intervals, of values at their ends and in their middle, are to be halved once more, and which are flat."""
    # By value and by slope: where the points are too few for what goes on between, one of them may agree by accident.
    middle_slope = 1.5 * (b[:2] - a[:2]) / width - 0.25 * (a[2:4] + b[2:4])
    wrong = np.hypot(*(_between(a, b, width, 0.5) - new[:2]))
    wrong = np.maximum(wrong, SLOPE_SHARE * width * np.hypot(*(middle_slope - new[2:4])))
    line = _between(a[..., None], b[..., None], width[:, None], LOOKS)
    away = np.hypot(*line) - 1.0
    nearest = np.abs(away).min(axis=1)
    # Next to a cusp three roots are where the radius hardly changes: the points must tell its smallest waves.
    level = np.abs(np.diff(away, axis=1)) * (len(LOOKS) - 1) < FLAT * width[:, None]
    flat = (level & (np.abs(away[:, 1:]) < NEAR_FOLD)).any(axis=1)
    tolerance = np.where(flat, PREDICTED_FLAT, PREDICTED)
    # Far from the tow radius by more than twice what the cubic is wrong, or right. Beside a shot that failed nothing is
    # known, and nothing gained by more of them.
    split = (wrong > tolerance) & (nearest < np.maximum(2.0 * wrong, np.where(flat, NEAR_FOLD, 0.0)))
    # The angle about the axis counts nodes: where it changes more, waves may hide between the points.
    split |= np.maximum(np.abs(new[6] - a[6]), np.abs(new[6] - b[6])) > TURNED
    return split, flat


def _between(a: Array, b: Array, width: Array, t: float | Array) -> Array:
    """Tow point at the share t of intervals, from values and slopes at their ends; shape (2, intervals)."""
    return cubic(a[:2], b[:2], a[2:4], b[2:4], width, t)


def _peaks(rows: Integers, x: Array, values: Array) -> tuple[Integers, Array, Array, Integers]:
    """Where the cubics between points have an extremum of the radius: system, x, log rho, and the point before."""
    i = np.flatnonzero(rows[1:] == rows[:-1])
    a, b = values[:4, i], values[:4, i + 1]
    width = x[i + 1] - x[i]
    squared = np.zeros((7, len(i)))
    for axis in range(2):
        terms = cubic_coefficients(a[axis], b[axis], a[2 + axis], b[2 + axis], width)
        for m in range(4):
            for n in range(4):
                squared[m + n] += terms[m] * terms[n]
    slopes = squared[:-1] * np.arange(6.0, 0.0, -1.0)[:, None]
    line = np.polyval(slopes[..., None], LOOKS)
    with np.errstate(invalid="ignore"):
        interval, look = np.nonzero((line[:, :-1] < 0.0) != (line[:, 1:] < 0.0))
        known = np.isfinite(line).all(axis=1)[interval]
    interval, look = interval[known], look[known]
    low, high = LOOKS[look].copy(), LOOKS[look + 1].copy()
    falls = line[interval, look] >= 0.0
    for _ in range(30):
        middle = 0.5 * (low + high)
        above = (np.polyval(slopes[:, interval], middle) >= 0.0) == falls
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    t = 0.5 * (low + high)
    # A sum of squares that may vanish, but for rounding.
    height = np.maximum(np.polyval(squared[:, interval], t), 1e-300)
    left = i[interval]
    return rows[left], x[left] + t * (x[left + 1] - x[left]), 0.5 * np.log(height), left
