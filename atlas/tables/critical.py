"""Critical states interpolated from an atlas. Needs numpy and netCDF4 only.

Chebyshev series in coordinates in which the critical states are smooth to both ends of the domain:

    x = log(lambda - lambda_cn),  y = log(1 + w_f / W_SCALE)
    log(gamma sqrt(lambda - lambda_cn)),  log(-R_x0),  log|x_f|,  log z_f

gamma grows as (lambda - lambda_cn)^(-1/2) at the threshold and every quantity is a power of lambda far from it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import W_SCALE, unchecked_excess_length, unchecked_threshold_length
from towatlas.numerics import chebyshev
from towatlas.numerics.axes import LogAxis, ShiftedLogAxis
from towatlas.numerics.errormap import block_of
from towatlas.tables import direct
from towatlas.tables.domain import complaint

METHOD = "fold"
INTERPOLANT = "support/interpolant"  # the group of the series
FIELDS = ("gamma", "R_x0", "x_f", "z_f")
QUANTITIES = (*FIELDS, "tension", "error", "status")
EPS = np.finfo(float).eps
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


def from_field(name: str, field: Array, excess: Array, n: Integers) -> Array:
    """A critical state, from the smooth function: R_x0 is negative, x_f has the sign of (-1)^n (its nodes).

    Parameters
    ----------
    name : str
        One of FIELDS.
    field, excess : ndarray, shape (points,)
        The function, and lambda - lambda_cn [-].
    n : ndarray of int, shape (points,)

    Returns
    -------
    ndarray, shape (points,)
    """
    value = np.exp(field)
    if name == "gamma":
        return value / np.sqrt(excess)
    if name == "R_x0":
        return -value
    if name == "x_f":
        return np.where(n % 2 == 0, value, -value)
    return value


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
        self._patches: dict[str, dict[int, Array]] = {name: {} for name in FIELDS}

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
        unanswered = ~(inside | absent)
        if outside == "raise" and unanswered.any():
            raise ValueError(self._complaint(unanswered, lam=lam, w_f=w_f, n=n))
        table: dict[str, NDArray[Any]] = {name: np.full(len(n), np.nan) for name in names if name != "status"}
        self._interpolate(table, inside, excess, lam=lam, w_f=w_f, n=n)
        table["status"] = codes
        again = unanswered & sound
        if outside == "solve" and again.any():
            solved = direct.critical_states(lam=lam[again], w_f=w_f[again], n=n[again], excess=excess[again])
            for name in table:
                table[name][again] = solved[name]
        return table

    def _interpolate(
        self,
        table: dict[str, NDArray[Any]],
        inside: NDArray[np.bool_],
        excess: Array,
        *,
        lam: Array,
        w_f: Array,
        n: Integers,
    ) -> None:
        n, w_f, lam, excess = n[inside], w_f[inside], lam[inside], excess[inside]
        if not len(n):
            return
        x, y = self.axes.excess.coordinate(excess), self.axes.w_f.coordinate(w_f)
        fields = [name for name in FIELDS if name in table or (name == "R_x0" and "tension" in table)]
        sums = chebyshev.patch_sums([self._patches_of(name, n) for name in fields], n, x, y) if fields else []
        values = {name: from_field(name, field, excess, n) for name, field in zip(fields, sums, strict=True)}
        if "tension" in table:
            values["tension"] = np.hypot(w_f + lam, values["R_x0"])
        if "error" in table:
            at = (block_of(c, count) for c, count in zip((y, x), self._error.shape[1:], strict=True))
            values["error"] = self._error[n - 1, *at] + ROUNDINGS * EPS * (1.0 + lam / excess)
        for name in table.keys() & values.keys():
            table[name][inside] = values[name]

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

    def _patches_of(self, name: str, n: Integers) -> dict[int, Array]:
        """Patches of a field, made for each n when first asked for; two threads at once make the same."""
        made = self._patches[name]
        for order in range(int(n.min()), int(n.max()) + 1):
            if order not in made:
                made[order] = chebyshev.patches(self.series(name, order))
        return made

    def _complaint(self, bad: NDArray[np.bool_], *, lam: Array, w_f: Array, n: Integers) -> str:
        def too_short_or_long(i: int) -> str:
            threshold = float(unchecked_threshold_length(w_f[i], n[i]))
            return (
                f"lam = {lam[i]:.15g} is outside the atlas: for n = {n[i]}, w_f = {w_f[i]:.15g} it holds lam from "
                f"{threshold + self.axes.excess.low:.10g} to {threshold + self.axes.excess.high:.10g}"
            )

        limits = {"w_f": (0.0, self.axes.w_f.high), "n": (1, self.n_max)}
        return complaint({"lam": lam, "w_f": w_f, "n": n}, limits, bad, too_short_or_long)
