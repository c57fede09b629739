"""Folds with drag from an atlas: what `towatlas.builders.drag_folds` wrote. Needs numpy and netCDF4 only.

Chebyshev series in log(lambda), log(1 + w_f / (W_SHARE lambda)) and sigma, with C = C*_n (1 - sigma^2): on sigma > 0
the pair appears, from the vacuum at 1 to the cusp at 0, on sigma < 0 it ends. The curve of folds is smooth through the
cusp in sigma, where gamma as a function of C has its two branches meet.
"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_order, check_outside, check_positive_finite, check_real
from towatlas.kernels import status
from towatlas.numerics.chebyshev import polynomials
from towatlas.tables.critical import default_path, open_group, read_root
from towatlas.tables.seal import AtlasFileError

Array = NDArray[np.float64]
# Fish weight over that of the cable at which its coordinate turns from linear to logarithmic.
W_SHARE = 0.01
FIELDS = ("gamma", "r_f")
DRAG_GROUP = "support/drag"


@dataclass(frozen=True)
class DragAxes:
    """The domain of the series and the map from it to [-1, 1]^3."""

    lam_min: float
    lam_max: float
    w_f_max: float
    sigma_min: float

    def x(self, lam: Array) -> Array:
        """Coordinate of lambda."""
        low, high = np.log(self.lam_min), np.log(self.lam_max)
        return np.clip((2.0 * np.log(lam) - low - high) / (high - low), -1.0, 1.0)

    def y(self, w_f: Array, lam: Array) -> Array:
        """Coordinate of w_f on a cable of length lambda."""
        scale = W_SHARE * lam
        return np.clip(2.0 * np.log1p(w_f / scale) / np.log1p(self.w_f_max / scale) - 1.0, -1.0, 1.0)

    def s(self, sigma: Array) -> Array:
        """Coordinate of sigma."""
        return np.clip((2.0 * sigma - self.sigma_min - 1.0) / (1.0 - self.sigma_min), -1.0, 1.0)

    def lam(self, x: Array) -> Array:
        """lambda at coordinate x."""
        low, high = np.log(self.lam_min), np.log(self.lam_max)
        return np.exp(0.5 * (low + high + x * (high - low)))

    def w_f(self, y: Array, lam: Array) -> Array:
        """w_f at coordinate y; exactly 0 at y = -1."""
        scale = W_SHARE * lam
        return scale * np.expm1(0.5 * (y + 1.0) * np.log1p(self.w_f_max / scale))

    def sigma(self, s: Array) -> Array:
        """sigma at coordinate s."""
        return 0.5 * (1.0 + self.sigma_min + s * (1.0 - self.sigma_min))


@dataclass(frozen=True)
class DragLookup:
    """Folds looked up; arrays of one shape, nan where the status says why.

    appears, ends : gamma where the n-th pair appears and where it ends; r_f_appears, r_f_ends : radius of the fish over
    the tow radius there. C_cusp : C*_n. error : estimated relative error of the speeds, error_cusp of C*_n. status,
    status_ends : codes of `towatlas.kernels.status`.
    """

    n: NDArray[np.int64]
    lam: Array
    w_f: Array
    C: Array
    appears: Array
    r_f_appears: Array
    ends: Array
    r_f_ends: Array
    C_cusp: Array
    error: Array
    error_cusp: Array
    status: NDArray[np.int8]
    status_ends: NDArray[np.int8]


def block_of(coordinate: Array, blocks: int) -> NDArray[np.int64]:
    """Which block of the error map a coordinate in [-1, 1] lies in."""
    return np.minimum((0.5 * (coordinate + 1.0) * blocks).astype(np.int64), blocks - 1)


def evaluate(series: Array, s: Array, y: Array, x: Array) -> Array:
    """Sum of a series of shape (s, y, x) at points, all of shape (points,)."""
    along = np.einsum("kji,ip->kjp", series, polynomials(x, series.shape[2]), optimize=False)
    along = np.einsum("kjp,jp->kp", along, polynomials(y, series.shape[1]), optimize=False)
    return np.einsum("kp,kp->p", along, polynomials(s, series.shape[0]), optimize=False)


def open_drag(path: str | os.PathLike | None = None) -> "DragTable":
    """Open the folds with drag of an atlas and check that it is whole.

    Parameters
    ----------
    path : path, optional
        An atlas made by `towatlas build --drag`; without it $TOWATLAS_FILE, else build/atlas.nc.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    AtlasFileError
        If the file is damaged, holds no folds with drag, or was written by a newer version.
    """
    return DragTable(default_path() if path is None else Path(path))


class DragTable:
    """Folds with drag in a nondense fluid, interpolated from a file. Made by `open_drag`."""

    def __init__(self, path: Path):
        self.path = path
        self.attributes, data, self.sha256 = read_root(path)
        with open_group(path, data) as file:
            try:
                group = file[DRAG_GROUP]
            except IndexError:
                raise AtlasFileError(
                    f"{path} holds no folds with drag; `towatlas build --drag` makes an atlas that does"
                ) from None
            names = ("lam_min", "lam_max", "w_f_max", "sigma_min")
            self.axes = DragAxes(**{name: float(group.getncattr(name)) for name in names})
            self._series = {name: np.asarray(group[f"drag_{name}_series"][:], np.float64) for name in FIELDS}
            self._cusp = np.asarray(group["drag_C_cusp_series"][:], np.float64)
            self._error = np.asarray(group["drag_gamma_error"][:], np.float64)
            self._cusp_error = np.asarray(group["drag_C_cusp_error"][:], np.float64)
        self.n_max = len(self._cusp)

    def folds(
        self, lam: ArrayLike, w_f: ArrayLike, C: ArrayLike, n: ArrayLike = 1, outside: str = "raise"
    ) -> DragLookup:
        """Where the n-th pair appears and ends, and C*_n.

        Parameters
        ----------
        lam, w_f, C : array_like
            Cable length, fish weight and drag constant of the cable [-].
        n : array_like of int
            Number of the transition.
        outside : {"raise", "nan", "solve"}
            What becomes of points outside the table: a ValueError that says how, nan, or the direct solver.

        Notes
        -----
        Nothing is extrapolated, and nothing is interpolated across the cusp: C within the error of C*_n, and `ends` at
        drags below those of the series, are outside.
        """
        check_outside(outside)
        arrays = {"lam": check_real("lam", lam), "w_f": check_real("w_f", w_f), "C": check_real("C", C)}
        check_positive_finite("lam", arrays["lam"])
        check_positive_finite("w_f", arrays["w_f"], zero=True)
        check_positive_finite("C", arrays["C"], zero=True)
        lam, w_f, C, n = check_broadcast(**arrays, n=check_order(n))
        flat = n.ravel(), lam.ravel(), w_f.ravel(), C.ravel()
        table = self._answer(*flat)
        missing = (table["status"] == status.OUTSIDE) | (table["status_ends"] == status.OUTSIDE)
        if outside == "raise" and (table["status"] == status.OUTSIDE).any():
            raise ValueError(self._complaint(*(column[table["status"] == status.OUTSIDE][0] for column in flat)))
        if outside == "solve" and missing.any():
            from towatlas.solve.drag_folds import solve_drag_folds

            solved = solve_drag_folds(flat[1][missing], flat[2][missing], flat[3][missing], flat[0][missing])
            for name in table:
                table[name][missing] = getattr(solved, name) if name != "error_cusp" else solved.error
        return DragLookup(n, lam, w_f, C, **{name: column.reshape(n.shape) for name, column in table.items()})

    def _answer(self, n: NDArray[np.int64], lam: Array, w_f: Array, c: Array) -> dict[str, NDArray[Any]]:
        axes = self.axes
        inside = (n <= self.n_max) & (lam >= axes.lam_min) & (lam <= axes.lam_max) & (w_f <= axes.w_f_max)
        names = ("appears", "r_f_appears", "ends", "r_f_ends", "C_cusp", "error", "error_cusp")
        table: dict[str, NDArray[Any]] = {name: np.full(len(n), np.nan) for name in names}
        codes, codes_ends = np.full(len(n), status.OUTSIDE), np.full(len(n), status.OUTSIDE)
        for order in np.unique(n[inside]):
            i = np.flatnonzero(inside & (n == order))
            y, x = axes.y(w_f[i], lam[i]), axes.x(lam[i])
            cusp = np.exp(evaluate(self._cusp[order - 1][None], np.zeros(len(i)), y, x))
            blocks = self._error.shape[1]
            block = order - 1, block_of(y, blocks), block_of(x, blocks)
            margin = self._cusp_error[block]
            table["C_cusp"][i], table["error_cusp"][i], table["error"][i] = cusp, margin, self._error[block]
            above = c[i] > cusp * (1.0 + margin)
            codes[i[above]] = codes_ends[i[above]] = status.NO_PAIR
            sigma = np.sqrt(np.maximum(1.0 - c[i] / cusp, 0.0))
            below = c[i] < cusp * (1.0 - margin)
            for side, wanted, kept, suffix in (
                (1.0, below, codes, "appears"),
                (-1.0, below & (-sigma >= axes.sigma_min), codes_ends, "ends"),
            ):
                k = i[wanted]
                s = axes.s(side * sigma[wanted])
                for name, field in (("gamma", suffix), ("r_f", f"r_f_{suffix}")):
                    table[field][k] = np.exp(evaluate(self._series[name][order - 1], s, y[wanted], x[wanted]))
                kept[k] = status.OK
        return table | {"status": codes.astype(np.int8), "status_ends": codes_ends.astype(np.int8)}

    def _complaint(self, n: int, lam: float, w_f: float, c: float) -> str:
        axes = self.axes
        remedy = '; outside="solve" computes such points directly, outside="nan" leaves them out'
        if n > self.n_max:
            return f"n = {n} is outside the file, 1 to {self.n_max}{remedy}"
        if not axes.lam_min <= lam <= axes.lam_max:
            return f"lam = {lam:.15g} is outside the file, {axes.lam_min:g} to {axes.lam_max:g}{remedy}"
        if w_f > axes.w_f_max:
            return f"w_f = {w_f:.15g} is outside the file, 0 to {axes.w_f_max:g}{remedy}"
        return f"C = {c:.15g} is closer to C*_{n} than the series tells them apart{remedy}"
