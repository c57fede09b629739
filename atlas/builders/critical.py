"""Building an atlas of critical states: the grids, the sweeps over them, and what goes into the file."""

import math
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from towatlas.builders.file import Summary, limited_threads, progress_bar, provenance, write_atlas
from towatlas.builders.grids import WHOLE_SCAN, Grid, ScanSettings
from towatlas.builders.scan import Facts, scan_table, witness
from towatlas.cf import WITNESS, plain_table, root_attributes, symbol_attributes
from towatlas.checks import check_choice
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.limits import W_SCALE, unchecked_excess_length, unchecked_threshold_length
from towatlas.numerics import chebyshev
from towatlas.numerics.errormap import SAFETY, stated_error, worst_of_blocks
from towatlas.solve.critical import solve_rows
from towatlas.tables.critical import FIELDS, INTERPOLANT, METHOD, CriticalAxes, to_field
from towatlas.tables.seal import check_writable

METHODS = (METHOD, "scan")

Array = NDArray[np.float64]


def build_atlas(
    path: str | os.PathLike,
    method: str = "fold",
    *,
    grid: Grid | None = None,
    scan: ScanSettings | None = None,
    threads: int | None = None,
    progress: bool = True,
    extra: Mapping[str, xr.Dataset] | None = None,
    more_facts: Facts = (),
    options: str = "",
) -> Summary:
    """Build an atlas file and move it into place.

    Parameters
    ----------
    path : path
        Where the file goes; what is there stays whole until the new one is.
    method : {"fold", "scan"}
        Direct solution of every fold, with a scan of some cables beside it as a witness; or a table by scan alone.
    grid : Grid, optional
        Where `fold` tabulates.
    scan : ScanSettings, optional
        What `scan` looks at: the witness, or the whole table.
    threads : int, optional
        Threads to use; all by default. The file does not depend on it.
    progress : bool
        Whether to show a progress bar on standard error, if that is a terminal.
    extra : mapping of xarray.Dataset, optional
        Further groups, by name.
    more_facts : tuple of (str, str)
        What there is to say of those.
    options : str
        Of `towatlas build`, where there are further groups.

    Returns
    -------
    Summary

    Raises
    ------
    ValueError
        For a method that does not exist, and more threads than there are.
    AtlasFileError
        If the file cannot be written.
    RuntimeError
        If a fold does not converge, which is a defect.
    """
    start = time.perf_counter()
    check_choice("method", method, METHODS)
    path = Path(path)
    check_writable(path)
    grid = grid or Grid()
    scan = scan or (ScanSettings() if method == METHOD else WHOLE_SCAN)
    total = scan.size + (grid.size if method == METHOD else 0)
    groups: dict[str, xr.Dataset] = dict(extra or {})
    with patience(math.inf), limited_threads(threads), progress_bar(total, "fold", progress) as bar:
        if method == METHOD:
            root, parts, facts = _build_fold(grid, scan, bar)
            groups = parts | groups
        else:
            root, facts = scan_table(scan, bar)
        bar.set_description("writing")
        root.attrs = root_attributes(method, provenance(options or f"--method {method}") | root.attrs)
        write_atlas(path, root, groups)
    return Summary(path, f"method {method}", (*facts, *more_facts), time.perf_counter() - start)


def _solve_grid(shape: tuple[int, ...], bar: tqdm, label: str, **columns: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Solve the folds of arrays that broadcast to `shape`, one transition (first axis) at a time."""
    bar.set_description(label)
    flat = {name: np.broadcast_to(column, shape) for name, column in columns.items()}
    parts = []
    for k in range(shape[0]):
        rows = {name: column[k].ravel() for name, column in flat.items()}
        part = solve_rows(
            n=rows["n"],
            w_f=rows["w_f"],
            lam=rows["lam"],
            excess=rows["excess"],
        )
        parts.append(part)
        bar.update(len(part["gamma"]))
    return {name: np.stack([part[name] for part in parts]).reshape(shape) for name in parts[0]}


def _build_fold(grid: Grid, scan: ScanSettings, bar: tqdm) -> tuple[xr.Dataset, dict[str, xr.Dataset], Facts]:
    axes = CriticalAxes.over(grid.excess_min, grid.excess_max, grid.w_f_max)
    series, series_error = _fit_series(grid, axes, bar)
    n = np.arange(1, grid.n_max + 1)
    orders = n[:, None, None]
    w_f = grid.w_f[:, None]
    shape = (grid.n_max, len(grid.w_f), len(grid.lam))
    excess = unchecked_excess_length(lam=grid.lam, w_f=w_f, n=orders)
    table = _solve_grid(shape, bar, "table", n=orders, w_f=w_f, lam=grid.lam, excess=excess)
    root = plain_table(
        n=n, w_f=grid.w_f, lam=grid.lam, lambda_c=unchecked_threshold_length(grid.w_f, n[:, None]), table=table
    )
    groups = {INTERPOLANT: _interpolant_group(axes, series, series_error), WITNESS: witness(scan, bar)}

    solved = table["status"] == status.OK
    known = solved | np.isin(table["status"], (status.NO_TRANSITION, status.LOST_IN_ROUNDING))
    if not known.all():
        raise RuntimeError(f"{np.sum(~known)} folds of the table did not converge; this is a defect, please report it")
    domain = solved & (excess >= grid.excess_min)
    nearer = float(np.nanmax(table["error"]))
    worst = np.unravel_index(np.argmax(np.where(domain, table["error"], 0.0)), shape)
    difference = np.abs(groups[WITNESS]["difference"].values)
    found = np.isfinite(difference)
    missed = int(np.sum(groups[WITNESS]["missed"].values))
    root.attrs = {
        "solver_tolerance": "8 eps (1 + lambda / (lambda - lambda_cn)) in the last step",
        "worst_table_error": float(table["error"][worst]),
        "worst_table_error_nearer_the_threshold": nearer,
        "worst_lookup_error": float(series_error.max()),
    }
    at = f"n = {n[worst[0]]}, w_f = {grid.w_f[worst[1]]:g}, lambda = {grid.lam[worst[2]]:g}"
    facts = (
        (
            "ranges",
            f"n 1..{grid.n_max}, w_f 0..{grid.w_f_max:g}, lambda - lambda_cn {grid.excess_min:g}..{grid.excess_max:g}",
        ),
        ("folds", f"{int(solved.sum()) + series['gamma'].size}"),
        (
            "worst error",
            f"{table['error'][worst]:.1e} relative (estimated), {at}; between nodes {series_error.max():.1e}; "
            f"nearer the threshold than {grid.excess_min:g}, {nearer:.1e}",
        ),
        (
            "witness",
            f"{found.sum()} folds by scan, largest difference {difference[found].max():.1e}; "
            f"{missed} transitions the scan did not see",
        ),
    )
    return root, groups, facts


def _fit_series(grid: Grid, axes: CriticalAxes, bar: tqdm) -> tuple[dict[str, Array], Array]:
    """Chebyshev series of every field, and the error map of gamma.

    The errors are measured against the direct solver half way between the nodes, the largest of any field.
    """
    orders = np.arange(1, grid.n_max + 1)[:, None, None]

    def solve(x: Array, y: Array, label: str) -> dict[str, Array]:
        excess, w_f = axes.excess.value(x), axes.w_f.value(y)[:, None]
        shape = (grid.n_max, len(y), len(x))
        columns = {"n": orders, "w_f": w_f, "lam": unchecked_threshold_length(w_f, orders) + excess, "excess": excess}
        solved = _solve_grid(shape, bar, label, **columns)
        if (solved["status"] != status.OK).any():
            raise RuntimeError("a fold inside the domain did not converge; this is a defect, please report it")
        return {name: to_field(name, solved[name], excess) for name in FIELDS}

    x, y = chebyshev.nodes(grid.series_excess), chebyshev.nodes(grid.series_w_f)
    series = {name: chebyshev.coefficients(values) for name, values in solve(x, y, "series").items()}

    x, y = chebyshev.midpoints(grid.series_excess), chebyshev.midpoints(grid.series_w_f)
    between = {name: chebyshev.on_grid(series[name], y, x) for name in FIELDS}
    exact = solve(x, y, "checking")
    difference = np.max([np.abs(between[name] - exact[name]) for name in FIELDS], axis=0)
    measured = [worst_of_blocks(one, y[:, None], x, grid.error_blocks) for one in difference]
    return series, np.stack([stated_error(one) for one in measured])


def _interpolant_group(axes: CriticalAxes, series: dict[str, Array], error_map: Array) -> xr.Dataset:
    dims = ("series_n", "w_f_degree", "excess_degree")
    variables: dict[str, xr.Variable] = {}
    for name, values in series.items():
        attributes = symbol_attributes(name) | {
            "long_name": f"Chebyshev series for {name}, see the comment of this group"
        }
        variables[f"{name}_series"] = xr.Variable(dims, values, attributes)
    variables["gamma_error"] = xr.Variable(
        ("series_n", "w_f_block", "excess_block"),
        error_map,
        {
            "long_name": "relative interpolation error of the worst field in each block of the unit square, "
            f"{SAFETY:g} times the largest measured in it and those about it",
            "units": "1",
        },
    )
    return xr.Dataset(
        variables,
        attrs={
            "excess_min": axes.excess.low,
            "excess_max": axes.excess.high,
            "w_f_max": axes.w_f.high,
            "w_f_scale": W_SCALE,
            "comment": "Let x be linear in log(lam - lambda_c), from -1 at lam - lambda_c = excess_min to 1 at "
            "excess_max, and y linear in log(1 + w_f / w_f_scale), from -1 at w_f = 0 to 1 at w_f_max, with the n-th "
            "lambda_c = 2 n - 1 + 1 / (w_f + sqrt(1 + w_f^2)). With T_k the Chebyshev polynomial cos(k arccos x) and "
            "i, j from 0, the sum over i and j of series[n, i, j] T_i(y) T_j(x) is log(gamma_c sqrt(lam - lambda_c)), "
            "log(-R_x0_c), log(abs(x_f)) and log(z_f) for the four series; x_f has the sign of (-1)^n. Not valid "
            "outside [-1, 1]. Nodes of the plain table closer to the threshold than excess_min lie outside.",
        },
    )
