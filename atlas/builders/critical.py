"""Building an atlas file: the grids, the sweeps over them, and what goes into the file."""

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from towatlas.builders.file import provenance, write_atlas
from towatlas.builders.grids import WHOLE_SCAN, Grid, ScanSettings
from towatlas.cf import WITNESS, plain_table, root_attributes, symbol_attributes, variable
from towatlas.kernels import status
from towatlas.kernels.sweeps import scan_systems_parallel
from towatlas.limits import unchecked_excess_length, unchecked_threshold_length
from towatlas.numerics import chebyshev as interpolant
from towatlas.solve.critical import solve_rows
from towatlas.tables.critical import INTERPOLANT
from towatlas.tables.seal import check_writable

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Summary:
    """What a finished build has to say for itself."""

    path: Path
    method: str
    ranges: str
    folds: int
    worst_error: float
    worst_at: str
    witness: str
    seconds: float
    bytes: int
    drag: str = ""

    def __str__(self) -> str:
        lines = [
            f"{self.path}  ({self.bytes / 1e6:.2f} MB, method {self.method})",
            f"  ranges       {self.ranges}",
            f"  folds        {self.folds}",
            f"  worst error  {self.worst_error:.1e} relative (estimated), {self.worst_at}",
        ]
        if self.witness:
            lines.append(f"  witness      {self.witness}")
        if self.drag:
            lines.append(f"  drag         {self.drag}")
        return "\n".join([*lines, f"  time         {self.seconds:.1f} s"])


@contextmanager
def limited_threads(count: int | None) -> Iterator[None]:
    """All parallel kernels within the block run on so many threads; None for all there are."""
    before = numba.get_num_threads()
    limit = int(numba.config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]
    if count is not None:
        if not 1 <= count <= limit:
            raise ValueError(f"threads must be 1 to {limit} on this machine, got {count}")
        numba.set_num_threads(count)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def progress_bar(total: int, unit: str, wanted: bool) -> tqdm:
    """A bar on standard error; none where that is no terminal."""
    return tqdm(total=total, unit=unit, disable=None if wanted else True, leave=False)


def build_atlas(
    path: Path,
    method: str = "fold",
    *,
    grid: Grid | None = None,
    scan: ScanSettings | None = None,
    threads: int | None = None,
    progress: bool = True,
    extra: Mapping[str, xr.Dataset] | None = None,
) -> Summary:
    """Build an atlas file and move it into place.

    Parameters
    ----------
    path : Path
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

    Returns
    -------
    Summary
    """
    start = time.perf_counter()
    if method not in ("fold", "scan"):
        raise ValueError(f"method must be fold or scan, got {method!r}")
    check_writable(path)
    grid = grid or Grid()
    scan = scan or (ScanSettings() if method == "fold" else WHOLE_SCAN)
    total = scan.size + (grid.size if method == "fold" else 0)
    with (
        limited_threads(threads),
        tqdm(total=total, unit="fold", disable=None if progress else True, leave=False) as bar,
    ):
        if method == "fold":
            root, groups, facts = _build_fold(grid, scan, bar)
        else:
            root, groups, facts = _build_scan(scan, bar)
        bar.set_description("writing")
        options = "--drag" if extra else f"--method {method}"
        root.attrs = root_attributes(method, provenance(options) | facts.pop("attributes"))
        write_atlas(path, root, groups | dict(extra or {}))
    return Summary(path=path, method=method, seconds=time.perf_counter() - start, bytes=path.stat().st_size, **facts)


def _solve_grid(
    shape: tuple[int, ...], bar: tqdm, label: str, guess: tuple[Array, Array] | None = None, **columns: NDArray[Any]
) -> dict[str, NDArray[Any]]:
    """Solve the folds of arrays that broadcast to `shape`, one transition (first axis) at a time."""
    bar.set_description(label)
    flat = {name: np.broadcast_to(column, shape) for name, column in columns.items()}
    parts = []
    for k in range(shape[0]):
        rows = {name: column[k].ravel() for name, column in flat.items()}
        part = solve_rows(
            rows["n"], rows["w_f"], rows["lam"], rows["excess"], guess and (guess[0][k].ravel(), guess[1][k].ravel())
        )
        parts.append(part)
        bar.update(len(part["gamma"]))
    return {name: np.stack([part[name] for part in parts]).reshape(shape) for name in parts[0]}


def _build_fold(grid: Grid, scan: ScanSettings, bar: tqdm) -> tuple[xr.Dataset, dict[str, xr.Dataset], dict[str, Any]]:
    axes = interpolant.Axes(grid.excess_min, grid.excess_max, grid.w_f_max)
    series, series_error = _fit_series(grid, axes, bar)
    n = np.arange(1, grid.n_max + 1)
    orders = n[:, None, None]
    w_f = grid.w_f[:, None]
    shape = (grid.n_max, len(grid.w_f), len(grid.lam))
    excess = unchecked_excess_length(grid.lam, w_f, orders)
    table = _solve_grid(shape, bar, "table", n=orders, w_f=w_f, lam=grid.lam, excess=excess)
    root = plain_table(n, grid.w_f, grid.lam, unchecked_threshold_length(grid.w_f, n[:, None]), table)
    groups = {INTERPOLANT: _interpolant_group(axes, series, series_error), WITNESS: _witness(scan, bar)}

    solved = table["status"] == status.OK
    failed = int(
        np.sum(~solved & (table["status"] != status.NO_TRANSITION) & (table["status"] != status.LOST_IN_ROUNDING))
    )
    if failed:
        raise RuntimeError(f"{failed} folds of the table did not converge; this is a defect, please report it")
    domain = solved & (excess >= grid.excess_min)
    nearer = float(np.nanmax(table["error"]))
    worst = np.unravel_index(np.argmax(np.where(domain, table["error"], 0.0)), shape)
    lookup_worst = float(series_error.max())
    difference = np.abs(groups[WITNESS]["difference"].values)
    found = np.isfinite(difference)
    missed = int(np.sum(groups[WITNESS]["missed"].values))
    facts: dict[str, Any] = {
        "ranges": f"n 1..{grid.n_max}, w_f 0..{grid.w_f_max:g}, "
        f"lambda - lambda_cn {grid.excess_min:g}..{grid.excess_max:g}",
        "folds": int(solved.sum()) + series["gamma"].size,
        "worst_error": float(table["error"][worst]),
        "worst_at": f"n = {n[worst[0]]}, w_f = {grid.w_f[worst[1]]:g}, lambda = {grid.lam[worst[2]]:g}; "
        f"between nodes {lookup_worst:.1e}; nearer the threshold than {grid.excess_min:g}, {nearer:.1e}",
        "witness": f"{found.sum()} folds by scan, largest difference {difference[found].max():.1e}; "
        f"{missed} transitions the scan did not see",
        "attributes": {
            "solver_tolerance": "8 eps (1 + lambda / (lambda - lambda_cn)) in the last step",
            "worst_table_error": float(table["error"][worst]),
            "worst_table_error_nearer_the_threshold": nearer,
            "worst_lookup_error": lookup_worst,
        },
    }
    return root, groups, facts


def _fit_series(grid: Grid, axes: interpolant.Axes, bar: tqdm) -> tuple[dict[str, Array], Array]:
    """Chebyshev series of every field, and the error map of gamma.

    The error map is measured against the direct solver half way between the nodes: in each of error_blocks squares of
    the unit square the largest difference, of any field, twice over.
    """
    orders = np.arange(1, grid.n_max + 1)[:, None, None]

    def solve(
        x: Array, y: Array, label: str, guess: tuple[Array, Array] | None = None
    ) -> tuple[dict[str, Array], Array]:
        excess, w_f = axes.excess(x), axes.w_f(y)[:, None]
        shape = (grid.n_max, len(y), len(x))
        columns = {"n": orders, "w_f": w_f, "lam": unchecked_threshold_length(w_f, orders) + excess, "excess": excess}
        solved = _solve_grid(shape, bar, label, guess, **columns)
        if (solved["status"] != status.OK).any():
            raise RuntimeError("a fold inside the domain did not converge; this is a defect, please report it")
        return {name: interpolant.to_field(name, solved[name], excess) for name in interpolant.FIELDS}, excess

    x, y = interpolant.nodes(grid.series_excess), interpolant.nodes(grid.series_w_f)
    series = {name: interpolant.coefficients(values) for name, values in solve(x, y, "series")[0].items()}

    x, y = interpolant.midpoints(grid.series_excess), interpolant.midpoints(grid.series_w_f)
    between = {name: interpolant.tensor(series[name], x, y) for name in interpolant.FIELDS}
    gamma = np.exp(between["gamma"]) / np.sqrt(axes.excess(x))
    exact, _ = solve(x, y, "checking", (np.exp(between["x_f"]) * gamma**2, gamma))
    difference = np.max([np.abs(between[name] - exact[name]) for name in interpolant.FIELDS], axis=0)
    blocks = grid.error_blocks
    rows, columns = (np.minimum((0.5 * (c + 1.0) * blocks).astype(int), blocks - 1) for c in (y, x))
    error_map = np.zeros((grid.n_max, blocks, blocks))
    for k in range(grid.n_max):
        np.maximum.at(error_map[k], (rows[:, None], columns), 2.0 * difference[k])
    return series, error_map


def _interpolant_group(axes: interpolant.Axes, series: dict[str, Array], error_map: Array) -> xr.Dataset:
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
            "long_name": "relative interpolation error in each block of the unit square, of the worst field",
            "units": "1",
        },
    )
    return xr.Dataset(
        variables,
        attrs={
            "excess_min": axes.excess_min,
            "excess_max": axes.excess_max,
            "w_f_max": axes.w_f_max,
            "w_f_scale": interpolant.W_SCALE,
            "comment": "Let x be linear in log(lam - lambda_c), from -1 at lam - lambda_c = excess_min to 1 at "
            "excess_max, and y linear in log(1 + w_f / w_f_scale), from -1 at w_f = 0 to 1 at w_f_max, with the n-th "
            "lambda_c = 2 n - 1 + 1 / (w_f + sqrt(1 + w_f^2)). With T_k the Chebyshev polynomial cos(k arccos x) and "
            "i, j from 0, the sum over i and j of series[n, i, j] T_i(y) T_j(x) is log(gamma_c sqrt(lam - lambda_c)), "
            "log(-R_x0_c), log(abs(x_f)) and log(z_f) for the four series; x_f has the sign of (-1)^n. Not valid "
            "outside [-1, 1]. Nodes of the plain table closer to the threshold than excess_min lie outside.",
        },
    )


def _scan_grid(scan: ScanSettings, bar: tqdm, label: str) -> tuple[Array, NDArray[np.int8]]:
    """Scan every cable of the settings: results of shape (w_f, lam, n, 4), statuses (w_f, lam, n)."""
    bar.set_description(label)
    shape = (len(scan.w_f), len(scan.lam))
    w_f, lam = (a.ravel() for a in np.meshgrid(scan.w_f, scan.lam, indexing="ij"))
    results = np.empty((w_f.size, scan.n_max, 4))
    statuses = np.empty((w_f.size, scan.n_max), np.int64)
    # No fold lies below the resonance of a pendulum as long as the cable, gamma^2 lambda = 1.
    low = 0.95 / np.sqrt(lam)
    high = np.full(w_f.size, scan.gamma_max)
    block = 8 * numba.get_num_threads()
    for begin in range(0, w_f.size, block):
        part = slice(begin, begin + block)
        scan_systems_parallel(
            w_f[part],
            lam[part],
            low[part],
            high[part],
            scan.speeds,
            scan.guesses,
            scan.segments,
            scan.n_max,
            scan.tolerance,
            results[part],
            statuses[part],
        )
        bar.update(len(w_f[part]) * scan.n_max)
    excess = unchecked_excess_length(lam[:, None], w_f[:, None], np.arange(1, scan.n_max + 1))
    statuses[(excess <= 0.0) & (statuses == status.NOT_FOUND)] = status.NO_TRANSITION
    return results.reshape(*shape, scan.n_max, 4), statuses.reshape(*shape, scan.n_max).astype(np.int8)


def _witness(scan: ScanSettings, bar: tqdm) -> xr.Dataset:
    results, statuses = _scan_grid(scan, bar, "witness")
    results, statuses = np.moveaxis(results, 2, 0), np.moveaxis(statuses, 2, 0)
    n = np.arange(1, scan.n_max + 1)
    shape = statuses.shape
    orders = np.broadcast_to(n[:, None, None], shape)
    w_f, lam = (np.broadcast_to(a, shape) for a in (scan.w_f[:, None], scan.lam))
    flat = orders.ravel(), w_f.ravel(), lam.ravel()
    direct = solve_rows(*flat, unchecked_excess_length(flat[2], flat[1], flat[0]))
    gamma = direct["gamma"].reshape(shape)
    missed = (statuses != status.OK) & (gamma < scan.gamma_max)
    # Names of their own: a reader that merges the groups must not take these axes for those of the table.
    dims = ("scan_n", "scan_w_f", "scan_lam")
    one = {"units": "1"}
    return xr.Dataset(
        {
            "gamma_scan": variable(dims, "gamma", results[..., 0]),
            "R_x0_scan": variable(dims, "R_x0", results[..., 1]),
            "gamma_resolution": xr.Variable(
                dims, results[..., 2], {"long_name": "absolute resolution of gamma_scan"} | one
            ),
            "R_x0_resolution": xr.Variable(
                dims, results[..., 3], {"long_name": "absolute resolution of R_x0_scan"} | one
            ),
            "difference": xr.Variable(
                dims, results[..., 0] / gamma - 1.0, {"long_name": "gamma_scan over the direct solution, minus 1"} | one
            ),
            "missed": xr.Variable(
                dims,
                missed.astype(np.int8),
                {"long_name": "transitions below gamma_max that the scan did not see"} | one,
            ),
            "status": variable(dims, "status", statuses),
        },
        {
            "scan_n": variable(("scan_n",), "n", n),
            "scan_w_f": variable(("scan_w_f",), "w_f", scan.w_f),
            "scan_lam": variable(("scan_lam",), "lam", scan.lam),
        },
        attrs=scan.attributes(),
    )


def _build_scan(scan: ScanSettings, bar: tqdm) -> tuple[xr.Dataset, dict[str, xr.Dataset], dict[str, Any]]:
    results, statuses = _scan_grid(scan, bar, "scan")
    results, statuses = np.moveaxis(results, 2, 0), np.moveaxis(statuses, 2, 0)
    n = np.arange(1, scan.n_max + 1)
    table = {
        "gamma": results[..., 0],
        "R_x0": results[..., 1],
        "tension": np.hypot((scan.w_f[:, None] + scan.lam), results[..., 1]),
        "error": results[..., 2] / results[..., 0],
        "status": statuses,
    }
    root = plain_table(n, scan.w_f, scan.lam, unchecked_threshold_length(scan.w_f, n[:, None]), table)
    found = statuses == status.OK
    worst = np.unravel_index(np.argmax(np.where(found, table["error"], 0.0)), found.shape)
    facts: dict[str, Any] = {
        "ranges": f"n 1..{scan.n_max}, w_f {scan.w_f.min():g}..{scan.w_f.max():g}, "
        f"lambda {scan.lam.min():g}..{scan.lam.max():g}, gamma to {scan.gamma_max:g}",
        "folds": int(found.sum()),
        "worst_error": float(table["error"][worst]),
        "worst_at": f"n = {n[worst[0]]}, w_f = {scan.w_f[worst[1]]:g}, lambda = {scan.lam[worst[2]]:g}",
        "witness": f"{np.sum(statuses == status.NOT_FOUND)} transitions not seen or beyond gamma = {scan.gamma_max:g}",
        "attributes": {f"scan_{name}": value for name, value in scan.attributes().items()},
    }
    return root, {}, facts
