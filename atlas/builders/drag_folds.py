"""Building the group of folds with drag of an atlas: plain tables, the series for lookup, and their errors."""

import math
import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from towatlas.builders.critical import build_atlas
from towatlas.builders.drag_series import Series, fit_series, measure_errors
from towatlas.builders.file import Summary, limited_threads, progress_bar
from towatlas.builders.grids import DragGrid, Grid, ScanSettings
from towatlas.cf import symbol_attributes
from towatlas.effort import patience
from towatlas.nomenclature import DRAG
from towatlas.numerics.chebyshev import at_points
from towatlas.numerics.errormap import SAFETY
from towatlas.tables.drag_folds import DRAG_GROUP, FIELDS, W_SHARE
from towatlas.tables.seal import check_writable

Array = NDArray[np.float64]


def drag_group(grid: DragGrid, threads: int | None = None, progress: bool = True) -> xr.Dataset:
    """Folds with drag as a group of an atlas: plain tables, the series for lookup, and what these are wrong by.

    Parameters
    ----------
    grid : DragGrid
    threads : int, optional
        Threads to use; all by default.
    progress : bool
        Whether to show a progress bar on standard error, if that is a terminal.

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    ArithmeticError
        If a curve on the grid has no cusp: the series would cross its disappearance.
    """
    with patience(math.inf), limited_threads(threads), progress_bar(grid.size, "cable", progress) as bar:
        bar.set_description("drag")
        series, errors = [], []
        for n in range(1, grid.n_max + 1):
            series.append(fit_series(grid, n, bar))
            errors.append(measure_errors(grid, n, series[-1], bar))
    tables = _plain_tables(grid, series)
    return tables.merge(_series_variables(grid, series, *np.stack(errors, axis=1)), combine_attrs="no_conflicts")


def build_drag(
    path: str | os.PathLike,
    *,
    grid: DragGrid | None = None,
    vacuum: Grid | None = None,
    scan: ScanSettings | None = None,
    threads: int | None = None,
    progress: bool = True,
) -> Summary:
    """Build an atlas with a group of folds with drag and move it into place.

    Parameters
    ----------
    path : path
        Where the file goes; what is there stays whole until the new one is.
    grid : DragGrid, optional
        What is tabulated with drag.
    vacuum, scan : Grid, ScanSettings, optional
        What is tabulated of the vacuum; see `towatlas.builders.critical.build_atlas`.
    threads : int, optional
        Threads to use; all by default. The file does not depend on it.
    progress : bool
        Whether to show a progress bar on standard error, if that is a terminal.

    Returns
    -------
    Summary

    Raises
    ------
    ArithmeticError
        If a curve on the grid has no cusp: the series would cross its disappearance.
    AtlasFileError
        If the file cannot be written.
    """
    begin = time.perf_counter()
    path = Path(path)
    check_writable(path)
    grid = grid or DragGrid()
    group = drag_group(grid, threads, progress)
    gamma, cusp = group["drag_gamma_error"].values, group["drag_C_cusp_error"].values
    said = (
        f"n 1..{grid.n_max}, w_f 0..{grid.w_f_max:g}, lambda {grid.lam_min:g}..{grid.lam_max:g}, C from 0 to C*_n; "
        f"error (estimated) of gamma: median {np.median(gamma):.1e}, worst {gamma.max():.1e}; "
        f"of C*_n: median {np.median(cusp):.1e}, worst {cusp.max():.1e}"
    )
    summary = build_atlas(
        path,
        grid=vacuum,
        scan=scan,
        threads=threads,
        progress=progress,
        extra={DRAG_GROUP: group},
        more_facts=(("drag", said),),
    )
    return replace(summary, seconds=time.perf_counter() - begin)


def _plain_tables(grid: DragGrid, series: list[Series]) -> xr.Dataset:
    """C*_n on (n, w_f, lam), folds on (n, C, w_f, lam)."""
    axes = grid.axes
    inside = (grid.lam >= axes.lam_min) & (grid.lam <= axes.lam_max)
    lam, w_f = grid.lam[inside], grid.w_f[grid.w_f <= axes.w_f_max]
    c, w, length = (column.ravel() for column in np.meshgrid(grid.C, w_f, lam, indexing="ij"))
    y, x = axes.w_f(length).coordinate(w), axes.lam.coordinate(length)
    shape = (len(grid.C), len(w_f), len(lam))
    appears, ends = np.full((2, grid.n_max, *shape), np.nan)
    cusps = np.empty((grid.n_max, *shape[1:]))
    for n, of_n in enumerate(series):
        cusp = np.exp(of_n.log_cusp(y, x))
        cusps[n] = cusp.reshape(shape)[0]
        with np.errstate(invalid="ignore"):
            sigma = np.sqrt(1.0 - c / cusp)
        for table, side in ((appears, 1.0), (ends, -1.0)):
            good = side * sigma >= axes.sigma_min
            values = np.full(len(c), np.nan)
            s = axes.sigma.coordinate(side * sigma[good])
            values[good] = np.exp(at_points(of_n.gamma, s, y[good], x[good]))
            table[n] = values.reshape(shape)
    # Names of their own: a reader that merges the groups must not take these axes for those of the vacuum.
    axis = {name: f"drag_{name}" for name in ("n", "C", "w_f", "lam")}
    dims = tuple(axis.values())
    return xr.Dataset(
        {
            "C_cusp": _variable((dims[0], *dims[2:]), "C_cusp", cusps),
            "appears": _variable(dims, "appears", appears),
            "ends": _variable(dims, "ends", ends),
        },
        {
            axis[name]: _variable((axis[name],), name, values)
            for name, values in (("n", np.arange(1, grid.n_max + 1)), ("C", grid.C), ("w_f", w_f), ("lam", lam))
        },
        attrs={
            "title": "Folds of a cable towed in a circle, with drag",
            "comment": "In a nondense fluid, m_f = w_f, w = 1, no drag on the fish. C_cusp[n, w_f, lam] is the drag "
            "constant C*_n above which the n-th pair of equilibria does not exist; appears and ends are the speeds "
            "Omega sqrt(R/g) at which it appears and its outer member is gone, missing where C is above C*_n and, for "
            "ends, where it is below those of the series. Coordinates of the series, in [-1, 1]: of log(lam); of "
            "log(1 + w_f / (w_f_share lam)), -1 at w_f = 0 and 1 at w_f_max; of sigma from sigma_min to 1, with "
            "C = C_cusp (1 - sigma^2), sigma > 0 where the pair appears, < 0 where it ends.",
            "folds_traced": "from the n-th fold of the vacuum; folds not connected with it are not in this file",
        },
    )


def _variable(dims: tuple[str, ...], name: str, data: NDArray[Any]) -> xr.Variable:
    return xr.Variable(dims, np.asarray(data, np.int32) if name == "n" else data, symbol_attributes(name, DRAG))


def _series_variables(grid: DragGrid, series: list[Series], error: Array, cusp_error: Array) -> xr.Dataset:
    dims = ("drag_n", "sigma_degree", "drag_w_f_degree", "drag_lam_degree")
    blocks = ("drag_n", "drag_w_f_block", "drag_lam_block")
    one = {"units": "1"}
    variables = {
        f"drag_{name}_series": xr.Variable(
            dims,
            np.stack([getattr(of_n, name) for of_n in series]),
            {"long_name": f"Chebyshev coefficients of log {name}"} | one,
        )
        for name in FIELDS
    }
    variables["drag_C_cusp_series"] = xr.Variable(
        (dims[0], *dims[2:]),
        np.stack([of_n.cusp for of_n in series]),
        {"long_name": "Chebyshev coefficients of log C_cusp"} | one,
    )
    for name, values in (("gamma", error), ("C_cusp", cusp_error)):
        text = f"relative error of {name} in each block, {SAFETY:g} times the worst measured in it and those about it"
        variables[f"drag_{name}_error"] = xr.Variable(blocks, values, {"long_name": text} | one)
    axes = grid.axes
    names = ("lam_min", "lam_max", "w_f_max", "sigma_min")
    return xr.Dataset(variables, attrs={name: getattr(axes, name) for name in names} | {"w_f_share": W_SHARE})
