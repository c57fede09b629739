"""Series through folds with drag, summed. Needs numpy only.

Chebyshev series in log(lambda), log(1 + w_f / (W_SHARE lambda)) and sigma, with C = C*_n (1 - sigma^2): on sigma > 0
the pair appears, from the vacuum at 1 to the cusp at 0, on sigma < 0 it ends. The curve of folds is smooth through the
cusp in sigma, where gamma as a function of C has its two branches meet. From about sigma_min on C is the function, of
gamma^-2, smooth to infinite speed, where weight no longer matters: a drag is looked for along it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import unchecked_excess_length
from towatlas.numerics.axes import LinearAxis, LogAxis, ShiftedLogAxis
from towatlas.numerics.chebyshev import at_points, polynomials
from towatlas.numerics.errormap import block_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# Fish weight over that of the cable at which its coordinate turns from linear to logarithmic.
W_SHARE = 0.01
FIELDS = ("gamma", "r_f")
FIELDS_BY_SPEED = ("C_by_speed", "r_f_by_speed")
SERIES = tuple(f"{name}_series" for name in (*FIELDS, "C_cusp", *FIELDS_BY_SPEED))
ERRORS = ("gamma_error", "C_cusp_error", "C_by_speed_error")
AXES = ("lam_min", "lam_max", "w_f_max", "sigma_min", "gamma_max")
# Numbers of the table's answers, and their statuses.
NUMBERS = (
    "appears",
    "r_f_appears",
    "ends",
    "r_f_ends",
    "again",
    "r_f_again",
    "C_cusp",
    "gamma_cusp",
    "C_lasting",
    "error",
    "error_ends",
    "error_again",
    "error_cusp",
    "error_lasting",
)
STATUSES = ("status", "status_ends", "status_again", "status_cusp")
# The series of the pair's end by speed begin at this share of sigma_min, so that the two overlap.
OVERLAP = 0.9
# Points at which such a series is looked at for a drag; points of the table that are looked at together.
LOOKED, TOGETHER = 129, 2048
# A speed that the error of the series leaves open by more than this share is not told.
VAGUE = 0.01
# Of the least of so many values beside the least between them, in the logarithm.
LEAST_ERROR = 1e-4
# Over which a slope is taken, of the coordinate of the speed.
SLOPE_STEP = 1e-4


@dataclass(frozen=True)
class DragAxes:
    """The domain of the series and its axes.

    Attributes
    ----------
    lam_min, lam_max : float
        Shortest and longest cable [-], > 0.
    w_f_max : float
        Heaviest fish [-], > 0.
    sigma_min : float
        Where the series end beyond the cusp [-], < 0; they begin at sigma = 1, the vacuum.
    gamma_max : float
        The highest speed at which the end of a pair is held [-], > 0.
    """

    lam_min: float
    lam_max: float
    w_f_max: float
    sigma_min: float
    gamma_max: float

    @property
    def lam(self) -> LogAxis:
        """Of lambda."""
        return LogAxis(self.lam_min, self.lam_max)

    @property
    def sigma(self) -> LinearAxis:
        """Of sigma."""
        return LinearAxis(self.sigma_min, 1.0)

    def w_f(self, lam: Array) -> ShiftedLogAxis:
        """Of w_f.

        Parameters
        ----------
        lam : ndarray, shape (points,)
            Cable lengths [-], on which it depends.

        Returns
        -------
        ShiftedLogAxis
        """
        return ShiftedLogAxis(self.w_f_max, W_SHARE * lam)

    def speeds(self, gamma_series: Array, y: Array, x: Array) -> "SpeedAxis":
        """Of the speed at which pairs end.

        Parameters
        ----------
        gamma_series : ndarray, shape (sigma, w_f, lam)
            Of one n.
        y, x : ndarray, shape (points,)
            Coordinates of w_f and lambda, -1 to 1.

        Returns
        -------
        SpeedAxis
        """
        begin = self.sigma.coordinate(np.full(len(x), OVERLAP * self.sigma_min))
        return SpeedAxis(at_points(gamma_series, begin, y, x), float(np.log(self.gamma_max)))


@dataclass(frozen=True)
class SpeedAxis:
    """Of gamma^-2, for each point: 1 at the slowest speed, where the series begin, -1 at the fastest.

    Attributes
    ----------
    slowest : ndarray, shape (points,)
        Logarithm of that speed.
    fastest : float
        The same.
    """

    slowest: Array
    fastest: float

    def log_gamma(self, v: Array) -> Array:
        """Logarithms of speeds at coordinates.

        Parameters
        ----------
        v : ndarray, shape (points, ...)

        Returns
        -------
        ndarray, of the shape of v
        """
        slowest = self.slowest.reshape(-1, *[1] * (v.ndim - 1))
        least = np.exp(2.0 * (slowest - self.fastest))
        return slowest - 0.5 * np.log(least + (1.0 - least) * 0.5 * (1.0 + v))

    def coordinate(self, log_gamma: Array) -> Array:
        """Coordinates of speeds.

        Parameters
        ----------
        log_gamma : ndarray, shape (points, ...)

        Returns
        -------
        ndarray, of the shape of log_gamma
            -1 to 1.
        """
        slowest = self.slowest.reshape(-1, *[1] * (log_gamma.ndim - 1))
        least = np.exp(2.0 * (slowest - self.fastest))
        return np.clip(2.0 * (np.exp(2.0 * (slowest - log_gamma)) - least) / (1.0 - least) - 1.0, -1.0, 1.0)


@dataclass(frozen=True)
class DragSeries:
    """Series through folds with drag.

    Attributes
    ----------
    axes : DragAxes
        Their domain.
    arrays : dict of ndarray
        SERIES, over (n, degree in sigma or in the speed, in w_f, in lambda), C_cusp_series without the second: the
        coefficients of the logarithms. ERRORS, over (n, blocks of w_f, of lambda): relative.
    """

    axes: DragAxes
    arrays: dict[str, Array]

    @property
    def n_max(self) -> int:
        """Highest transition held, >= 1."""
        return len(self.arrays["C_cusp_series"])

    def interpolate(
        self, good: NDArray[np.bool_], *, lam: Array, w_f: Array, C: Array, n: Integers
    ) -> dict[str, NDArray[Any]]:
        """Where the n-th pair appears, ends and appears again, and C*_n.

        Parameters
        ----------
        good : ndarray of bool, shape (points,)
            Which of the points are such as there may be.
        lam, w_f, C : ndarray, shape (points,)
            Cable length, fish weight and drag constant [-].
        n : ndarray of int, shape (points,)

        Returns
        -------
        dict of ndarray, shape (points,)
            NUMBERS and STATUSES.
        """
        axes = self.axes
        with np.errstate(invalid="ignore", over="ignore"):
            absent = good & (unchecked_excess_length(lam=lam, w_f=w_f, n=n) <= 0.0)
        inside = good & ~absent & (n <= self.n_max)
        inside &= (lam >= axes.lam_min) & (lam <= axes.lam_max) & (w_f <= axes.w_f_max)
        table: dict[str, NDArray[Any]] = {name: np.full(len(n), np.nan) for name in NUMBERS}
        unknown = np.full(len(n), status.OUTSIDE, np.int8)
        unknown[~good], unknown[absent] = status.BAD_INPUT, status.NO_TRANSITION
        codes, codes_ends, codes_again, codes_cusp = (unknown.copy() for _ in STATUSES)
        for order in np.unique(n[inside]):
            i = np.flatnonzero(inside & (n == order))
            y, x = axes.w_f(lam[i]).coordinate(w_f[i]), axes.lam.coordinate(lam[i])
            gamma_series, cusp_series = self.arrays["gamma_series"][order - 1], self.arrays["C_cusp_series"][order - 1]
            cusp = np.exp(at_points(cusp_series[None], np.zeros(len(i)), y, x))
            blocks = self.arrays["gamma_error"].shape[1]
            block = order - 1, block_of(y, blocks), block_of(x, blocks)
            margin = self.arrays["C_cusp_error"][block]
            at_cusp = axes.sigma.coordinate(np.zeros(len(i)))
            table["gamma_cusp"][i] = np.exp(at_points(gamma_series, at_cusp, y, x))
            table["C_cusp"][i], table["error_cusp"][i] = cusp, margin
            codes_cusp[i] = status.OK
            above = C[i] > cusp * (1.0 + margin)
            codes[i[above]] = codes_ends[i[above]] = codes_again[i[above]] = status.NO_PAIR
            sigma = np.sqrt(np.maximum(1.0 - C[i] / cusp, 0.0))
            below = C[i] < cusp * (1.0 - margin)
            # Where the series by speed say more, they come after.
            for side, wanted, kept, suffix in (
                (1.0, below, codes, "appears"),
                (-1.0, below & (-sigma >= axes.sigma_min), codes_ends, "ends"),
            ):
                k = i[wanted]
                s = axes.sigma.coordinate(side * sigma[wanted])
                for name, field in (("gamma", suffix), ("r_f", f"r_f_{suffix}")):
                    table[field][k] = np.exp(
                        at_points(self.arrays[f"{name}_series"][order - 1], s, y[wanted], x[wanted])
                    )
                table["error" if side > 0.0 else "error_ends"][k] = self.arrays["gamma_error"][block][wanted]
                kept[k] = status.OK
            for begin in range(0, len(i), TOGETHER):
                part = slice(begin, begin + TOGETHER)
                some = i[part]
                found = self._by_speed_at(order - 1, y[part], x[part], np.log(np.maximum(C[some], 1e-300)))
                table["C_lasting"][some], table["error_lasting"][some] = found["C_lasting"], found["error_lasting"]
                for suffix, kept, open_ in (
                    ("ends", codes_ends, below[part] & (-sigma[part] < axes.sigma_min)),
                    ("again", codes_again, below[part]),
                ):
                    k = some[open_]
                    kept[k] = found[f"status_{suffix}"][open_]
                    for name in (suffix, f"r_f_{suffix}", f"error_{suffix}"):
                        table[name][k] = found[name][open_]
        return table | dict(zip(STATUSES, (codes, codes_ends, codes_again, codes_cusp), strict=True))

    def _by_speed_at(self, row: int, y: Array, x: Array, log_c: Array) -> dict[str, NDArray[Any]]:
        """Where the pair of one n ends and appears again, and below which drag it does not end, from the series by
        speed at coordinates of w_f and lambda."""
        along = self.axes.speeds(self.arrays["gamma_series"][row], y, x)
        blocks = self.arrays["C_by_speed_error"].shape[1]
        margin = self.arrays["C_by_speed_error"][row, block_of(y, blocks), block_of(x, blocks)]
        shape = self.arrays["C_by_speed_series"].shape
        by_y, by_x = polynomials(y, shape[2]), polynomials(x, shape[3])
        # Plain sums, the same for any number of threads.
        terms = {
            name: np.einsum(
                "kjp,jp->pk",
                np.einsum("kji,ip->kjp", self.arrays[f"{name}_series"][row], by_x, optimize=False),
                by_y,
                optimize=False,
            )
            for name in FIELDS_BY_SPEED
        }
        # In the order of rising speed.
        v = np.linspace(1.0, -1.0, LOOKED)
        heights = np.einsum("pk,kv->pv", terms["C_by_speed"], polynomials(v, shape[1]), optimize=False) - log_c[:, None]
        least = heights.argmin(axis=1)
        result: dict[str, NDArray[Any]] = {
            "C_lasting": np.exp(heights.min(axis=1) + log_c),
            # The least of all points that were looked at is not that between them.
            "error_lasting": margin + LEAST_ERROR,
        }
        never = heights.min(axis=1) > margin
        for side in ("ends", "again"):
            rises = side == "again"
            change = (heights[:, :-1] < 0.0) != (heights[:, 1:] < 0.0)
            # One end of a pair: it is gone before the least drag is reached, and comes again after it.
            change &= (np.arange(LOOKED - 1) >= least[:, None]) == rises
            some = np.flatnonzero(change.any(axis=1))
            k = change[some].argmax(axis=1)
            low, high = v[k + 1], v[k]
            inside = heights[some, k + 1] < 0.0
            for _ in range(50):
                middle = 0.5 * (low + high)
                below = _sum(terms["C_by_speed"][some], middle) < log_c[some]
                low, high = np.where(below == inside, middle, low), np.where(below == inside, high, middle)
            root = 0.5 * (low + high)
            columns = {name: np.full(len(x), np.nan) for name in (side, f"r_f_{side}", f"error_{side}")}
            codes = np.full(len(x), status.OUTSIDE if not rises else status.NOT_AGAIN, np.int8)
            codes[never] = status.NEVER_ENDS
            here = SpeedAxis(along.slowest[some], along.fastest)
            log_gamma = here.log_gamma(root)
            near = np.clip(root + SLOPE_STEP * np.where(root > 0.0, -1.0, 1.0), -1.0, 1.0)
            with np.errstate(divide="ignore"):
                steep = np.abs(
                    (_sum(terms["C_by_speed"][some], near) - log_c[some]) / (here.log_gamma(near) - log_gamma)
                )
                error = margin[some] / steep
            columns[side][some], columns[f"error_{side}"][some] = np.exp(log_gamma), error
            columns[f"r_f_{side}"][some] = np.exp(_sum(terms["r_f_by_speed"][some], root))
            codes[some] = np.where(error < VAGUE, status.OK, status.OUTSIDE)
            for column in columns.values():
                column[codes != status.OK] = np.nan
            result |= columns | {f"status_{side}": codes}
        # Within the error of the least drag, or of that at the highest speed, it is open whether there is an end.
        open_ = ~never & (result["status_ends"] != status.OK) & (heights[:, 0] > 0.0)
        result["status_again"][open_] = result["status_ends"][open_]
        vague = np.abs(heights[:, -1]) < margin
        result["status_again"][vague & (result["status_again"] == status.NOT_AGAIN)] = status.OUTSIDE
        return result


def _sum(terms: Array, v: Array) -> Array:
    """Sums of series, one for each point; shape (points,)."""
    return np.einsum("pk,kp->p", terms, polynomials(v, terms.shape[1]))
