"""Folds with drag interpolated from an atlas. Needs numpy and netCDF4 only.

Chebyshev series in log(lambda), log(1 + w_f / (W_SHARE lambda)) and sigma, with C = C*_n (1 - sigma^2): on sigma > 0
the pair appears, from the vacuum at 1 to the cusp at 0, on sigma < 0 it ends. The curve of folds is smooth through the
cusp in sigma, where gamma as a function of C has its two branches meet.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import unchecked_excess_length
from towatlas.numerics.axes import LinearAxis, LogAxis, ShiftedLogAxis
from towatlas.numerics.chebyshev import at_points
from towatlas.numerics.errormap import block_of
from towatlas.tables import direct
from towatlas.tables.domain import complaint, sound

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# Fish weight over that of the cable at which its coordinate turns from linear to logarithmic.
W_SHARE = 0.01
FIELDS = ("gamma", "r_f")
DRAG_GROUP = "support/drag"
# Numbers of the table's answers, and their statuses; C_lasting is not tabulated.
NUMBERS = (
    "appears",
    "r_f_appears",
    "ends",
    "r_f_ends",
    "C_cusp",
    "gamma_cusp",
    "C_lasting",
    "error",
    "error_cusp",
)
STATUSES = ("status", "status_ends", "status_cusp")


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
    """

    lam_min: float
    lam_max: float
    w_f_max: float
    sigma_min: float

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


class DragFoldTable:
    """The part of an atlas that holds folds with drag in a nondense fluid.

    Attributes
    ----------
    axes : DragAxes
        The domain.
    n_max : int
        Highest transition held, >= 1.
    """

    holds = "folds with drag"
    made_by = "towatlas build --drag"

    def __init__(self, file: Any):
        group = file[DRAG_GROUP]
        names = ("lam_min", "lam_max", "w_f_max", "sigma_min")
        self.axes = DragAxes(**{name: float(group.getncattr(name)) for name in names})
        self._series = {name: np.asarray(group[f"drag_{name}_series"][:], np.float64) for name in FIELDS}
        self._cusp = np.asarray(group["drag_C_cusp_series"][:], np.float64)
        self._error = np.asarray(group["drag_gamma_error"][:], np.float64)
        self._cusp_error = np.asarray(group["drag_C_cusp_error"][:], np.float64)
        self.n_max = len(self._cusp)

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
        return "support" in file.groups and "drag" in file["support"].groups

    def domain(self) -> dict[str, str]:
        """Ranges of what is held, in words.

        Returns
        -------
        dict of str
            By quantity.
        """
        axes = self.axes
        return {
            "n with drag": f"1 .. {self.n_max}",
            "w_f with drag": f"0 .. {axes.w_f_max:g}",
            "lam with drag": f"{axes.lam_min:g} .. {axes.lam_max:g}",
            "sigma, C = C*_n (1 - sigma^2)": f"{axes.sigma_min:g} .. 1",
        }

    def answer(self, outside: str, *, lam: Array, w_f: Array, C: Array, n: Integers) -> dict[str, NDArray[Any]]:
        """Where the n-th pair appears and ends, and C*_n, of checked rows.

        Parameters
        ----------
        outside : {"raise", "nan", "solve"}
            What becomes of points outside.
        lam, w_f, C : ndarray, shape (points,)
            Cable length, fish weight and drag constant [-].
        n : ndarray of int, shape (points,)

        Returns
        -------
        dict of ndarray, shape (points,)
            NUMBERS and STATUSES.

        Raises
        ------
        ValueError
            For points outside with outside="raise".
        """
        point: dict[str, NDArray[Any]] = {"n": n, "lam": lam, "w_f": w_f, "C": C}
        good = sound(point)
        table = self._interpolate(good, **point)
        bad = ~good | (table["status"] == status.OUTSIDE)
        if outside == "raise" and bad.any():
            axes = self.axes
            limits = {"n": (1, self.n_max), "lam": (axes.lam_min, axes.lam_max), "w_f": (0.0, axes.w_f_max)}
            near = "closer to C*_{} than the series tells them apart"
            raise ValueError(complaint(point, limits, bad, lambda i: f"C = {C[i]:.15g} is {near.format(n[i])}"))
        missing = good & ((table["status"] == status.OUTSIDE) | (table["status_ends"] == status.OUTSIDE))
        if outside == "solve" and missing.any():
            solved = direct.drag_folds(**{name: column[missing] for name, column in point.items()})
            for name in table:
                table[name][missing] = getattr(solved, name)
        return table

    def _interpolate(
        self, good: NDArray[np.bool_], *, lam: Array, w_f: Array, C: Array, n: Integers
    ) -> dict[str, NDArray[Any]]:
        axes = self.axes
        with np.errstate(invalid="ignore", over="ignore"):
            absent = good & (unchecked_excess_length(lam=lam, w_f=w_f, n=n) <= 0.0)
        inside = good & ~absent & (n <= self.n_max)
        inside &= (lam >= axes.lam_min) & (lam <= axes.lam_max) & (w_f <= axes.w_f_max)
        table: dict[str, NDArray[Any]] = {name: np.full(len(n), np.nan) for name in NUMBERS}
        unknown = np.full(len(n), status.OUTSIDE, np.int8)
        unknown[~good], unknown[absent] = status.BAD_INPUT, status.NO_TRANSITION
        codes, codes_ends, codes_cusp = (unknown.copy() for _ in STATUSES)
        for order in np.unique(n[inside]):
            i = np.flatnonzero(inside & (n == order))
            y, x = axes.w_f(lam[i]).coordinate(w_f[i]), axes.lam.coordinate(lam[i])
            gamma_series, cusp_series = self._series["gamma"][order - 1], self._cusp[order - 1]
            cusp = np.exp(at_points(cusp_series[None], np.zeros(len(i)), y, x))
            blocks = self._error.shape[1]
            block = order - 1, block_of(y, blocks), block_of(x, blocks)
            margin = self._cusp_error[block]
            at_cusp = axes.sigma.coordinate(np.zeros(len(i)))
            table["gamma_cusp"][i] = np.exp(at_points(gamma_series, at_cusp, y, x))
            table["C_cusp"][i], table["error_cusp"][i], table["error"][i] = cusp, margin, self._error[block]
            codes_cusp[i] = status.OK
            above = C[i] > cusp * (1.0 + margin)
            codes[i[above]] = codes_ends[i[above]] = status.NO_PAIR
            sigma = np.sqrt(np.maximum(1.0 - C[i] / cusp, 0.0))
            below = C[i] < cusp * (1.0 - margin)
            for side, wanted, kept, suffix in (
                (1.0, below, codes, "appears"),
                (-1.0, below & (-sigma >= axes.sigma_min), codes_ends, "ends"),
            ):
                k = i[wanted]
                s = axes.sigma.coordinate(side * sigma[wanted])
                for name, field in (("gamma", suffix), ("r_f", f"r_f_{suffix}")):
                    table[field][k] = np.exp(at_points(self._series[name][order - 1], s, y[wanted], x[wanted]))
                kept[k] = status.OK
        table["error"][(codes != status.OK) & (codes_ends != status.OK)] = np.nan
        return table | dict(zip(STATUSES, (codes, codes_ends, codes_cusp), strict=True))
