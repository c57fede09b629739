"""Answers from an atlas file. Needs numpy and netCDF4 only."""

import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_order, check_outside, check_real
from towatlas.kernels import status
from towatlas.limits import unchecked_excess_length, unchecked_threshold_length
from towatlas.nomenclature import SYMBOLS
from towatlas.numerics import chebyshev as interpolant
from towatlas.solve.critical import CriticalStates, solve_rows
from towatlas.tables.seal import AtlasFileError, read_sealed

SCHEMA_VERSION = 1
INTERPOLANT = "support/interpolant"  # the group of the series
EPS = np.finfo(float).eps
MOST_SLACK = 1e-6
ROUNDINGS = 48.0  # as in towatlas.kernels.folds, whose import would bring numba (test_error_constants_agree)

QUANTITIES = ("gamma", "R_x0", "x_f", "z_f", "tension", "error", "status")

Array = NDArray[np.float64]

_NETCDF = threading.Lock()


def default_path() -> Path:
    """The atlas used when none is named: $TOWATLAS_FILE, else build/atlas.nc."""
    return Path(os.environ.get("TOWATLAS_FILE", "build/atlas.nc"))


def _dataset(path: Path, data: bytes) -> netCDF4.Dataset:
    try:
        file = netCDF4.Dataset(path.name, memory=data)
    except (OSError, RuntimeError) as error:
        raise AtlasFileError(f"{path} is not a readable NetCDF-4 file: {error}") from None
    file.set_auto_mask(False)
    return file


@contextmanager
def open_group(path: Path, data: bytes) -> Iterator[netCDF4.Dataset]:
    """The file whose bytes these are, for reading at once: the NetCDF library is not safe to call from two threads."""
    with _NETCDF, _dataset(path, data) as file:
        yield file


def read_root(path: Path) -> tuple[dict[str, Any], bytes, str]:
    """Global attributes, bytes and seal of any towatlas file, an atlas or a plain table; errors as `open_atlas`."""
    data, seal = read_sealed(path)
    with open_group(path, data) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    version = attributes.get("schema_version")
    if version is None:
        raise AtlasFileError(f"{path} is not an atlas: it has no schema_version")
    if version > SCHEMA_VERSION:
        raise AtlasFileError(
            f"{path} has schema version {version}, this towatlas reads up to {SCHEMA_VERSION}; upgrade towatlas"
        )
    return attributes, data, seal


def open_atlas(path: str | os.PathLike | None = None) -> "Atlas":
    """Open an atlas file and check that it is whole.

    Parameters
    ----------
    path : path, optional
        The file; without it $TOWATLAS_FILE, else build/atlas.nc.

    Returns
    -------
    Atlas

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    AtlasFileError
        If the file is damaged (a single changed bit is noticed), is no atlas, or was written by a newer version.

    Examples
    --------
    >>> atlas = open_atlas()                                    # doctest: +SKIP
    >>> float(atlas.critical_speed(37.8, 1352, n=2))            # doctest: +SKIP
    3.41756706...
    """
    return Atlas(default_path() if path is None else Path(path))


class Atlas:
    """Critical states of the vacuum problem, interpolated from an atlas file. Made by `open_atlas`.

    The methods `critical_speed`, `reaction`, `fish_offset`, `fish_depth`, `tow_tension`, `error` and `status` take
    (lam, w_f, n=1, outside="raise"), scalars, arrays that broadcast or xarray DataArrays, and return one quantity;
    `states` takes scalars and plain arrays and returns all of them. Safe to share between threads.

    lam : cable length over tow radius [-]; w_f : fish weight [-]; n : number of the transition.
    outside : what becomes of points the table does not hold (too close to the threshold, too long a cable, too heavy
    a fish, n beyond the table, nan): "raise" a ValueError that names the axis, the value and the limits; "nan", with
    the reason in the status; or "solve" them directly. Nothing is ever extrapolated. A cable no longer than lambda_cn
    has no n-th transition: the answer is nan, its status NO_TRANSITION.
    """

    def __init__(self, path: Path):
        self.path = path
        self.attributes, data, self.sha256 = read_root(path)
        if self.attributes.get("method") != "fold":
            raise AtlasFileError(
                f"{path} was built with --method {self.attributes.get('method')} and holds a plain table only; "
                "lookup needs an atlas built with --method fold"
            )
        with open_group(path, data) as file:
            group = file[INTERPOLANT]
            self.axes = interpolant.Axes(
                excess_min=float(group.excess_min), excess_max=float(group.excess_max), w_f_max=float(group.w_f_max)
            )
            self._series: dict[str, Array] = {
                name: np.asarray(group[f"{name}_series"][:], np.float64) for name in interpolant.FIELDS
            }
            self._error_map: Array = np.asarray(group["gamma_error"][:], np.float64)
        self.n_max = len(self._error_map)
        self._patches: dict[str, dict[int, Array]] = {name: {} for name in interpolant.FIELDS}

    def states(self, lam: ArrayLike, w_f: ArrayLike, n: ArrayLike = 1, outside: str = "raise") -> CriticalStates:
        """All quantities of the critical states, with error estimate and status; see the class for the parameters."""
        check_outside(outside)
        lam, w_f, n = check_broadcast(lam=check_real("lam", lam), w_f=check_real("w_f", w_f), n=check_order(n))
        flat = n.ravel(), w_f.ravel(), lam.ravel()
        table = self._answer(*flat, outside, QUANTITIES)
        return CriticalStates(
            n=n, lam=lam, w_f=w_f, **{name: column.reshape(n.shape) for name, column in table.items()}
        )

    def critical_speed(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Critical speed gamma_cn = Omega sqrt(R/g) [-]; relative error estimate: `error`."""
        return self._quantity("gamma", lam, w_f, n, outside)

    def reaction(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Radial reaction at the tow point R_x0^cn [-], over (mu + rho A) g R; negative."""
        return self._quantity("R_x0", lam, w_f, n, outside)

    def fish_offset(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Radial position of the fish x_f [-], over the tow radius."""
        return self._quantity("x_f", lam, w_f, n, outside)

    def fish_depth(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Depth of the fish z_f [-], over the tow radius."""
        return self._quantity("z_f", lam, w_f, n, outside)

    def tow_tension(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Cable tension at the tow point [-], over (mu + rho A) g R."""
        return self._quantity("tension", lam, w_f, n, outside)

    def error(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Estimated relative error of the critical speed [-]."""
        return self._quantity("error", lam, w_f, n, outside)

    def status(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Status codes, `towatlas.kernels.status`."""
        return self._quantity("status", lam, w_f, n, outside)

    def _quantity(self, name: str, lam: Any, w_f: Any, n: Any, outside: str) -> Any:
        def plain(lam: Any, w_f: Any, n: Any) -> Any:
            check_outside(outside)
            lam, w_f, n = check_broadcast(lam=check_real("lam", lam), w_f=check_real("w_f", w_f), n=check_order(n))
            return self._answer(n.ravel(), w_f.ravel(), lam.ravel(), outside, (name,))[name].reshape(n.shape)[()]

        return _with_xarray(plain, name, lam, w_f, n)

    def _answer(
        self, n: NDArray[np.int64], w_f: Array, lam: Array, outside: str, names: tuple[str, ...]
    ) -> dict[str, NDArray[Any]]:
        """The quantities named, with status, of checked rows."""
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            excess = unchecked_excess_length(lam, w_f, n)
            sound = np.isfinite(lam) & np.isfinite(w_f) & (lam > 0.0) & (w_f >= 0.0)
            absent = sound & (excess <= 0.0)
            # Capped: next to the threshold rounding is all there is of the excess, and would let anything pass.
            slack = np.minimum(4.0 * EPS * (1.0 + np.abs(lam / excess)), MOST_SLACK)
            inside = sound & ~absent & self.axes.holds(excess, w_f, slack) & (n <= self.n_max)
        codes = np.full(len(n), status.OUTSIDE, np.int8)
        codes[~sound] = status.BAD_INPUT
        codes[absent] = status.NO_TRANSITION
        codes[inside] = status.OK
        unanswered = ~(inside | absent)
        if outside == "raise" and unanswered.any():
            raise ValueError(self._complaint(n, w_f, lam, unanswered))
        table: dict[str, NDArray[Any]] = {name: np.full(len(n), np.nan) for name in names if name != "status"}
        self._interpolate(table, inside, n, w_f, lam, excess)
        table["status"] = codes
        again = unanswered & sound
        if outside == "solve" and again.any():
            solved = solve_rows(n[again], w_f[again], lam[again], excess[again])
            for name in table:
                table[name][again] = solved[name]
        return table

    def _interpolate(
        self,
        table: dict[str, NDArray[Any]],
        inside: NDArray[np.bool_],
        n: NDArray[np.int64],
        w_f: Array,
        lam: Array,
        excess: Array,
    ) -> None:
        n, w_f, lam, excess = n[inside], w_f[inside], lam[inside], excess[inside]
        if not len(n):
            return
        x, y = self.axes.x(excess), self.axes.y(w_f)
        fields = [name for name in interpolant.FIELDS if name in table or (name == "R_x0" and "tension" in table)]
        sums = interpolant.evaluate([self._patches_of(name, n) for name in fields], n, x, y) if fields else []
        values = {
            name: interpolant.from_field(name, field, excess, n) for name, field in zip(fields, sums, strict=True)
        }
        if "tension" in table:
            values["tension"] = np.hypot(w_f + lam, values["R_x0"])
        if "error" in table:
            blocks = self._error_map.shape[1:]
            at = [
                np.minimum((0.5 * (c + 1.0) * count).astype(int), count - 1)
                for c, count in zip((y, x), blocks, strict=True)
            ]
            values["error"] = self._error_map[n - 1, at[0], at[1]] + ROUNDINGS * EPS * (1.0 + lam / excess)
        for name in table.keys() & values.keys():
            table[name][inside] = values[name]

    def series(self, name: str, n: int) -> Array:
        """Chebyshev coefficients, shape (w_f degree, excess degree), of one quantity."""
        return self._series[name][n - 1]

    def _patches_of(self, name: str, n: NDArray[np.int64]) -> dict[int, Array]:
        """Patches of a field, made for each n when first asked for; two threads at once make the same."""
        made = self._patches[name]
        for order in range(int(n.min()), int(n.max()) + 1):
            if order not in made:
                made[order] = interpolant.patches(self.series(name, order))
        return made

    def _complaint(self, n: NDArray[np.int64], w_f: Array, lam: Array, bad: NDArray[np.bool_]) -> str:
        """What is wrong with the first unanswered point, and how many there are."""
        remedy = '; outside="solve" computes such points directly, outside="nan" leaves them out'
        i = int(np.flatnonzero(bad)[0])
        axes = self.axes
        if not (np.isfinite(lam[i]) and lam[i] > 0.0):
            reason = f"lam = {lam[i]:.15g} is not finite and positive"
            remedy = '; outside="nan" leaves such points out'
        elif not (np.isfinite(w_f[i]) and w_f[i] >= 0.0):
            reason = f"w_f = {w_f[i]:.15g} is not finite, or negative"
            remedy = '; outside="nan" leaves such points out'
        elif w_f[i] > axes.w_f_max:
            reason = f"w_f = {w_f[i]:.15g} is outside the atlas, 0 to {axes.w_f_max:g}"
        elif n[i] > self.n_max:
            reason = f"n = {n[i]} is outside the atlas, 1 to {self.n_max}"
        else:
            threshold = float(unchecked_threshold_length(w_f[i], n[i]))
            reason = (
                f"lam = {lam[i]:.15g} is outside the atlas: for n = {n[i]}, w_f = {w_f[i]:.15g} it holds lam from "
                f"{threshold + axes.excess_min:.10g} to {threshold + axes.excess_max:.10g}"
            )
        others = f" ({bad.sum()} of {len(bad)} points are outside)" if len(bad) > 1 else ""
        return reason + others + remedy


def _with_xarray(plain: Callable, name: str, lam: Any, w_f: Any, n: Any) -> Any:
    """Apply a function of arrays to arguments some of which may be xarray objects; then the result is one too."""
    # Whoever passes an xarray object has imported xarray: no need to import it to find out.
    xarray = sys.modules.get("xarray")
    labelled = [value for value in (lam, w_f, n) if hasattr(value, "dims")]
    if xarray is None or not labelled:
        return plain(lam, w_f, n)
    if not all(isinstance(value, xarray.DataArray) for value in labelled):
        raise ValueError("labelled arguments must be xarray DataArrays; take one variable out of a Dataset")
    result = xarray.apply_ufunc(plain, lam, w_f, n)
    symbol = SYMBOLS[name]
    result.name = symbol.name
    result.attrs = {"long_name": symbol.long_name, "units": "1"}
    return result
