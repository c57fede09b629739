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
from towatlas.numerics.errormap import SAFETY
from towatlas.results import SIDES
from towatlas.solve.folds import folds_in_speed, name_folds
from towatlas.system import System
from towatlas.tables.drag_folds import DRAG_GROUP
from towatlas.tables.drag_series import AXES, ERRORS, FIELDS, FIELDS_BY_SPEED, OVERLAP, W_SHARE, DragSeries
from towatlas.tables.seal import check_writable

Array = NDArray[np.float64]
# Of points spread evenly: shares of the golden ratio and of the plastic one.
LATTICE = (0.6180339887498949, 0.7548776662466927)
# Folds are looked for so far beyond those of the series.
BEYOND = 1.2


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
        arrays = {f"{name}_series": np.stack([getattr(one, name) for one in series]) for name in Series.__annotations__}
        arrays |= dict(zip(ERRORS, np.stack(errors, axis=1), strict=True))
        held = DragSeries(grid.axes, arrays)
        tables = _plain_tables(grid, held).assign_attrs(folds_looked_for=_looked_for(grid, held))
    return tables.merge(_series_variables(held), combine_attrs="no_conflicts")


def _looked_for(grid: DragGrid, series: DragSeries) -> str:
    """All folds of some cables beside those of the series, in words; ArithmeticError where the two contradict."""
    axes = grid.axes
    k = np.arange(grid.looked) + 0.5
    y, x, share = (2.0 * np.modf(k * ratio)[0] - 1.0 for ratio in (1.0 / max(1, grid.looked), *LATTICE))
    lam = axes.lam.value(x)
    w_f = axes.w_f(lam).value(y)
    orders = np.arange(1, grid.n_max + 1)
    made, higher, drags = 0, 0, []
    for cable in range(grid.looked):
        same: dict[str, Any] = {"lam": np.full(grid.n_max, lam[cable]), "w_f": np.full(grid.n_max, w_f[cable])}
        good = np.ones(grid.n_max, bool)
        cusps = series.interpolate(good, **same, C=np.zeros(grid.n_max), n=orders)
        # Up to the drag above which none of the pairs is left, and down to where all last.
        low, high = np.log([0.3 * np.nanmin(cusps["C_lasting"]), cusps["C_cusp"].max()])
        drag = float(np.exp(low + 0.5 * (1.0 + share[cable]) * (high - low)))
        table = series.interpolate(good, **same, C=np.full(grid.n_max, drag), n=orders)
        speeds = np.concatenate([table[side] for side in SIDES])
        errors = np.concatenate([table[name] for name in ("error", "error_ends", "error_again")])
        known = np.isfinite(speeds)
        speeds, errors = speeds[known], errors[known]
        system = System.of(lam=float(lam[cable]), w_f=float(w_f[cable]), C=drag)
        found = folds_in_speed(system, float(speeds.min()) / BEYOND, float(speeds.max()) * BEYOND, named=False)
        apart = np.abs(found.gamma[:, None] / speeds - 1.0)
        if found.complete and not (apart.min(axis=0, initial=np.inf) <= errors + found.error.max(initial=0.0)).all():
            raise ArithmeticError(f"{system}: the folds {speeds} of the series are not among {found.gamma}")
        others = name_folds(found.part(~(apart <= errors).any(axis=1)))
        drags += [drag] * int((others.n == 0).sum())
        made, higher = made + int((others.n == 0).sum()), higher + int((others.n > grid.n_max).sum())
    text = (
        f"at {grid.looked} cables with a drag each all folds between the slowest and the fastest of these pairs, and "
        f"{BEYOND - 1.0:.0%} beyond, were looked for: they hold those of the pairs, {higher} of later pairs and {made} "
        "that drag makes"
    )
    return text + (f", these at C from {min(drags):.3g}" if drags else "")


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
        options="--drag",
    )
    return replace(summary, seconds=time.perf_counter() - begin)


def _plain_tables(grid: DragGrid, series: DragSeries) -> xr.Dataset:
    """C*_n on (n, w_f, lam), folds on (n, C, w_f, lam)."""
    axes = grid.axes
    inside = (grid.lam >= axes.lam_min) & (grid.lam <= axes.lam_max)
    lam, w_f, orders = grid.lam[inside], grid.w_f[grid.w_f <= axes.w_f_max], np.arange(1, grid.n_max + 1)
    shape = (len(orders), len(grid.C), len(w_f), len(lam))
    n, c, w, length = (column.ravel() for column in np.meshgrid(orders, grid.C, w_f, lam, indexing="ij"))
    every: dict[str, NDArray[Any]] = {"lam": length, "w_f": w, "C": c, "n": n}
    table = series.interpolate(np.ones(len(n), bool), **every)
    folds = {name: table[name].reshape(shape) for name in (*SIDES, "C_cusp")}
    # Names of their own: a reader that merges the groups must not take these axes for those of the vacuum.
    axis = {name: f"drag_{name}" for name in ("n", "C", "w_f", "lam")}
    dims = tuple(axis.values())
    return xr.Dataset(
        {
            "C_cusp": _variable((dims[0], *dims[2:]), "C_cusp", folds["C_cusp"][:, 0]),
            **{name: _variable(dims, name, folds[name]) for name in SIDES},
        },
        {
            axis[name]: _variable((axis[name],), name, values)
            for name, values in (("n", orders), ("C", grid.C), ("w_f", w_f), ("lam", lam))
        },
        attrs={
            "title": "Folds of a cable towed in a circle, with drag",
            "comment": "In a nondense fluid, m_f = w_f, w = 1, no drag on the fish. C_cusp[n, w_f, lam] is the drag "
            "constant C*_n above which the n-th pair of equilibria does not exist; appears, ends and again are the "
            "speeds Omega sqrt(R/g) at which it appears, its outer member is gone, and it appears again, missing where "
            "C is above C*_n or there is no such speed up to gamma_max. Coordinates of the series, in [-1, 1]: of "
            "log(lam); of log(1 + w_f / (w_f_share lam)), -1 at w_f = 0 and 1 at w_f_max; of sigma from sigma_min to "
            "1, with C = C_cusp (1 - sigma^2), sigma > 0 where the pair appears, < 0 where it ends; of gamma^-2, from "
            "-1 at gamma_max to 1 at the speed where sigma is overlap * sigma_min.",
            "folds_traced": "from the n-th fold of the vacuum; folds not connected with it are not in this file",
        },
    )


def _variable(dims: tuple[str, ...], name: str, data: NDArray[Any]) -> xr.Variable:
    return xr.Variable(dims, np.asarray(data, np.int32) if name == "n" else data, symbol_attributes(name, DRAG))


def _series_variables(series: DragSeries) -> xr.Dataset:
    plane, blocks = ("drag_w_f_degree", "drag_lam_degree"), ("drag_n", "drag_w_f_block", "drag_lam_block")
    degrees = {"C_cusp_series": ()} | {f"{name}_series": ("sigma_degree",) for name in FIELDS}
    degrees |= {f"{name}_series": ("speed_degree",) for name in FIELDS_BY_SPEED}
    about = {f"{name}_series": f"log {name}" for name in (*FIELDS, "C_cusp")}
    about |= {f"{name}_series": f"log {name.removesuffix('_by_speed')} where pairs end" for name in FIELDS_BY_SPEED}
    about = {name: f"Chebyshev coefficients of {text}" for name, text in about.items()}
    spread = f"{SAFETY:g} times the worst measured in it and those about it"
    for name, text in zip(ERRORS, ("gamma", "C_cusp", "C where pairs end"), strict=True):
        about[name] = f"relative error of {text} in each block, {spread}"
    variables = {
        f"drag_{name}": xr.Variable(
            ("drag_n", *degrees[name], *plane) if name in degrees else blocks,
            series.arrays[name],
            {"long_name": text, "units": "1"},
        )
        for name, text in about.items()
    }
    attributes = {name: getattr(series.axes, name) for name in AXES} | {"w_f_share": W_SHARE, "overlap": OVERLAP}
    return xr.Dataset(variables, attrs=attributes)
