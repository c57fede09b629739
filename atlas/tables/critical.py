"""Critical states interpolated from an atlas. Needs numpy and netCDF4 only.

Chebyshev series in coordinates in which the critical states are smooth to both ends of the domain:

    x = log(lambda - lambda_cn),  y = log(1 + w_f / W_SCALE)
    log(gamma sqrt(lambda - lambda_cn)),  log(-R_x0),  log|x_f|,  log z_f

gamma grows as (lambda - lambda_cn)^(-1/2) at the threshold and every quantity is a power of lambda far from it.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import W_SCALE, unchecked_excess_length, unchecked_threshold_length
from towatlas.numerics.axes import LogAxis, ShiftedLogAxis
from towatlas.numerics.cells import BLOCK, Cells, Place, Places, Work
from towatlas.numerics.errormap import block_of
from towatlas.tables import direct
from towatlas.tables.domain import complaint

METHOD = "fold"
INTERPOLANT = "support/interpolant"  # the group of the series
FIELDS = ("gamma", "R_x0", "x_f", "z_f")
QUANTITIES = (*FIELDS, "tension", "error", "status")
HELD = np.int8(status.OK)
EPS = float(np.finfo(float).eps)
MOST_SLACK = 1e-6
ROUNDINGS = 48.0  # as in kernels.folds, whose import would bring numba (test_error_constants_agree)

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class CriticalAxes:
    """The domain of the series and its axes.

    Attributes
    ----------
    excess : LogAxis
        Of lambda - lambda_cn [-], > 0.
    w_f : ShiftedLogAxis
        Of the weight of the fish [-], from 0.
    """

    excess: LogAxis
    w_f: ShiftedLogAxis

    @classmethod
    def over(cls, excess_min: float, excess_max: float, w_f_max: float) -> "CriticalAxes":
        """Axes that end there.

        Parameters
        ----------
        excess_min, excess_max, w_f_max : float
            Ends [-], > 0.

        Returns
        -------
        CriticalAxes
        """
        return cls(LogAxis(excess_min, excess_max), ShiftedLogAxis(w_f_max, W_SCALE))

    def hold(self, excess: Array, w_f: Array, slack: Array) -> NDArray[np.bool_]:
        """Whether points lie in the domain.

        Parameters
        ----------
        excess, w_f : ndarray, shape (points,)
            lambda - lambda_cn and fish weight [-].
        slack : ndarray, shape (points,)
            Rounding of lambda, as a share of the excess, that is let pass at the ends.

        Returns
        -------
        ndarray of bool, shape (points,)
        """
        inside = (excess >= self.excess.low * (1.0 - slack)) & (excess <= self.excess.high * (1.0 + slack))
        return inside & (w_f >= 0.0) & (w_f <= self.w_f.high)


def to_field(name: str, value: Array, excess: Array) -> Array:
    """The smooth function that is interpolated, from a critical state.

    Parameters
    ----------
    name : str
        One of FIELDS.
    value, excess : ndarray
        The quantity, and lambda - lambda_cn [-].

    Returns
    -------
    ndarray
        Its logarithm, of gamma that of gamma sqrt(lambda - lambda_cn).
    """
    return np.log(np.abs(value)) + (0.5 * np.log(excess) if name == "gamma" else 0.0)


def from_field(name: str, field: Any, excess: Any, n: int) -> Any:
    """A critical state, from the smooth function: R_x0 is negative, x_f has the sign of (-1)^n (its nodes).

    Parameters
    ----------
    name : str
        One of FIELDS.
    field, excess : float or ndarray, shape (points,)
        The function, and lambda - lambda_cn [-].
    n : int

    Returns
    -------
    float or ndarray, shape (points,)
    """
    value = np.exp(field)
    if name == "gamma":
        return value / excess**0.5
    return -value if name == "R_x0" or (name == "x_f" and n % 2) else value


class CriticalTable:
    """The part of an atlas that holds critical states. Safe to share between threads.

    Attributes
    ----------
    axes : CriticalAxes
        The domain.
    n_max : int
        Highest transition held, >= 1.
    """

    holds = "critical speeds"
    made_by = "towatlas build"

    def __init__(self, file: Any):
        group = file[INTERPOLANT]
        self.axes = CriticalAxes.over(
            *(float(getattr(group, name)) for name in ("excess_min", "excess_max", "w_f_max"))
        )
        self._series = {name: np.asarray(group[f"{name}_series"][:], np.float64) for name in FIELDS}
        self._error: Array = np.asarray(group["gamma_error"][:], np.float64)
        self.n_max = len(self._error)
        self._cells: dict[int, Cells] = {}
        self._log_excess = float(np.log(self.axes.excess.low)), float(np.log(self.axes.excess.high))
        self._log_w_f = float(np.log1p(self.axes.w_f.high / W_SCALE))

    @staticmethod
    def in_file(file: Any, method: str) -> bool:
        """Whether a file holds this part.

        Parameters
        ----------
        file : netCDF4.Dataset
        method : str
            How it was built, its attribute.

        Returns
        -------
        bool
        """
        return method == METHOD

    def __repr__(self) -> str:
        return f"{self.holds}: {', '.join(f'{name} {held}' for name, held in self.domain().items())}"

    def domain(self) -> dict[str, str]:
        """Ranges of what is held, in words.

        Returns
        -------
        dict of str
            By quantity.
        """
        return {
            "n": f"1 .. {self.n_max}",
            "w_f": f"0 .. {self.axes.w_f.high:g}",
            "lam - lambda_c": f"{self.axes.excess.low:g} .. {self.axes.excess.high:g}",
        }

    def answer(
        self, names: tuple[str, ...], outside: str, *, lam: Array, w_f: Array, n: Integers
    ) -> dict[str, NDArray[Any]]:
        """The quantities named, with status, of checked rows.

        Parameters
        ----------
        names : tuple of str
            Some of QUANTITIES.
        outside : {"raise", "nan", "solve"}
            What becomes of points outside.
        lam, w_f : ndarray, shape (points,)
            Cable length and fish weight [-].
        n : ndarray of int, shape (points,)

        Returns
        -------
        dict of ndarray, shape (points,)

        Raises
        ------
        ValueError
            For points outside with outside="raise".
        """
        excess, codes = self._classify(lam=lam, w_f=w_f, n=n)
        inside = codes == status.OK
        unanswered = ~(inside | (codes == status.NO_TRANSITION))
        if outside == "raise" and unanswered.any():
            raise ValueError(self._complaint(unanswered, lam=lam, w_f=w_f, n=n))
        table: dict[str, NDArray[Any]] = {name: np.full(len(n), np.nan) for name in names if name != "status"}
        work = Work(len(n))
        for order in np.flatnonzero(np.bincount(n[inside])).tolist():
            rows = np.flatnonzero(inside & (n == order))
            for begin in range(0, len(rows), BLOCK):
                block = slice(begin, begin + BLOCK)
                some = block if len(rows) == len(n) else rows[block]
                values = self._interpolate(table, order, work, lam=lam[some], w_f=w_f[some], excess=excess[some])
                for name, column in values.items():
                    table[name][some] = column
        table["status"] = codes
        again = codes == status.OUTSIDE
        if outside == "solve" and again.any():
            solved = direct.critical_states(lam=lam[again], w_f=w_f[again], n=n[again], excess=excess[again])
            for name in table:
                table[name][again] = solved[name]
        return table

    def _classify(self, *, lam: Array, w_f: Array, n: Integers) -> tuple[Array, NDArray[np.int8]]:
        """Excess lengths, and status of each point: whether the table holds it."""
        excess, codes = np.empty(len(n)), np.empty(len(n), np.int8)
        for begin in range(0, len(n), BLOCK):
            some = slice(begin, begin + BLOCK)
            excess[some], codes[some] = self._classify_block(lam=lam[some], w_f=w_f[some], n=n[some])
        return excess, codes

    def _classify_block(self, *, lam: Array, w_f: Array, n: Integers) -> tuple[Array, NDArray[np.int8]]:
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            excess = unchecked_excess_length(lam=lam, w_f=w_f, n=n)
            sound = np.isfinite(lam) & np.isfinite(w_f) & (lam > 0.0) & (w_f >= 0.0)
            absent = sound & (excess <= 0.0)
            # Capped: next to the threshold rounding is all there is of the excess, and would let anything pass.
            slack = np.minimum(4.0 * EPS * (1.0 + np.abs(lam / excess)), MOST_SLACK)
            inside = sound & ~absent & self.axes.hold(excess, w_f, slack) & (n <= self.n_max)
        codes = np.full(len(n), status.OUTSIDE, np.int8)
        codes[~sound] = status.BAD_INPUT
        codes[absent] = status.NO_TRANSITION
        codes[inside] = status.OK
        return excess, codes

    def _interpolate(
        self, names: Collection[str], n: int, work: Work, *, lam: Array, w_f: Array, excess: Array
    ) -> dict[str, Array]:
        x, y = self.axes.excess.coordinate(excess), self.axes.w_f.coordinate(w_f)
        places, values, cells = Places(x, y), {}, self._cells_of(n)
        for k, name in enumerate(FIELDS):
            if name in names or (name == "R_x0" and "tension" in names):
                values[name] = from_field(name, cells.sums(k, places, work), excess, n)
        if "tension" in names:
            values["tension"] = np.hypot(w_f + lam, values["R_x0"])
        if "error" in names:
            at = (block_of(c, count) for c, count in zip((y, x), self._error.shape[1:], strict=True))
            values["error"] = self._error[n - 1, *at] + ROUNDINGS * EPS * (1.0 + lam / excess)
        return {name: column for name, column in values.items() if name in names}

    def one(self, *, lam: float, w_f: float, n: float) -> dict[str, Any] | None:
        """As `answer`, all QUANTITIES of one point inside the table; in plain floats, twenty times faster for one.

        Parameters
        ----------
        lam, w_f, n : float
            Cable length, fish weight, number of the transition [-].

        Returns
        -------
        dict of float, status an int8, or None
            None where the table does not hold the point, and for what is no cable: `answer` says why.
        """
        if not (1.0 <= n <= self.n_max and n == int(n) and 0.0 < lam < math.inf and 0.0 <= w_f <= self.axes.w_f.high):
            return None
        # As arrays get it, to the last bit: near the threshold it would show. So would numpy's functions from those of
        # `math`.
        excess = (lam - (2.0 * n - 1.0)) - 1.0 / (w_f + math.sqrt(1.0 + w_f * w_f))
        if not excess > 0.0:
            return None
        longer = 1.0 + lam / excess
        slack = min(4.0 * EPS * longer, MOST_SLACK)
        if not self.axes.excess.low * (1.0 - slack) <= excess <= self.axes.excess.high * (1.0 + slack):
            return None
        low, high = self._log_excess
        x = (2.0 * float(np.log(excess)) - low - high) / (high - low)
        y = 2.0 * float(np.log1p(w_f / W_SCALE)) / self._log_w_f - 1.0
        x, y = -1.0 if x < -1.0 else x if x < 1.0 else 1.0, -1.0 if y < -1.0 else y if y < 1.0 else 1.0
        order = int(n)
        gamma, R_x0, x_f, z_f = self._cells_of(order).values(Place(x, y))
        R_x0 = -math.exp(R_x0)
        _, rows, columns = self._error.shape
        row, column = min(int(0.5 * (y + 1.0) * rows), rows - 1), min(int(0.5 * (x + 1.0) * columns), columns - 1)
        return {
            "gamma": math.exp(gamma) / excess**0.5,
            "R_x0": R_x0,
            "x_f": -math.exp(x_f) if order % 2 else math.exp(x_f),
            "z_f": math.exp(z_f),
            "tension": abs(complex(w_f + lam, R_x0)),
            "error": self._error.item(order - 1, row, column) + ROUNDINGS * EPS * longer,
            "status": HELD,
        }

    def series(self, name: str, n: int) -> Array:
        """Chebyshev coefficients of one quantity.

        Parameters
        ----------
        name : str
            One of FIELDS.
        n : int
            1 to n_max.

        Returns
        -------
        ndarray, shape (w_f degree, excess degree)
        """
        return self._series[name][n - 1]

    def _cells_of(self, n: int) -> Cells:
        """The polynomials of all FIELDS, when first asked for; two threads at once make the same."""
        if n not in self._cells:
            self._cells[n] = Cells(*(self.series(name, n) for name in FIELDS))
        return self._cells[n]

    def _complaint(self, bad: NDArray[np.bool_], *, lam: Array, w_f: Array, n: Integers) -> str:
        def too_short_or_long(i: int) -> str:
            threshold = float(unchecked_threshold_length(w_f[i], n[i]))
            return (
                f"lam = {lam[i]:.15g} is outside the atlas: for n = {n[i]}, w_f = {w_f[i]:.15g} it holds lam from "
                f"{threshold + self.axes.excess.low:.10g} to {threshold + self.axes.excess.high:.10g}"
            )

        limits = {"w_f": (0.0, self.axes.w_f.high), "n": (1, self.n_max)}
        return complaint({"lam": lam, "w_f": w_f, "n": n}, limits, bad, too_short_or_long)
