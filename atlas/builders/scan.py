"""Critical speeds by Skop's own method, a scan: the witness of an atlas, and a plain table."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from towatlas.builders.grids import ScanSettings
from towatlas.cf import plain_table, variable
from towatlas.kernels import status
from towatlas.kernels.sweeps import scan_systems_parallel, threads
from towatlas.limits import unchecked_excess_length, unchecked_threshold_length
from towatlas.solve.critical import solve_rows

Array = NDArray[np.float64]
# Labels and what they say, of a summary.
Facts = tuple[tuple[str, str], ...]


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
    block = 8 * threads()
    for begin in range(0, w_f.size, block):
        part = slice(begin, begin + block)
        scan_systems_parallel(
            lam[part],
            w_f[part],
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
    excess = unchecked_excess_length(lam=lam[:, None], w_f=w_f[:, None], n=np.arange(1, scan.n_max + 1))
    statuses[(excess <= 0.0) & (statuses == status.NOT_FOUND)] = status.NO_TRANSITION
    return results.reshape(*shape, scan.n_max, 4), statuses.reshape(*shape, scan.n_max).astype(np.int8)


def witness(scan: ScanSettings, bar: tqdm) -> xr.Dataset:
    """Critical speeds of some cables by the report's own method, as a group of an atlas.

    Parameters
    ----------
    scan : ScanSettings
    bar : tqdm
        Told of every fold looked for.

    Returns
    -------
    xarray.Dataset
    """
    results, statuses = _scan_grid(scan, bar, "witness")
    results, statuses = np.moveaxis(results, 2, 0), np.moveaxis(statuses, 2, 0)
    n = np.arange(1, scan.n_max + 1)
    shape = statuses.shape
    orders = np.broadcast_to(n[:, None, None], shape)
    w_f, lam = (np.broadcast_to(a, shape) for a in (scan.w_f[:, None], scan.lam))
    cables: dict[str, Any] = {"lam": lam.ravel(), "w_f": w_f.ravel(), "n": orders.ravel()}
    direct = solve_rows(**cables, excess=unchecked_excess_length(**cables))
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


def scan_table(scan: ScanSettings, bar: tqdm) -> tuple[xr.Dataset, Facts]:
    """A plain table by scan alone.

    Parameters
    ----------
    scan : ScanSettings
    bar : tqdm
        Told of every fold looked for.

    Returns
    -------
    xarray.Dataset
        The root of the file.
    tuple of (str, str)
        What there is to say of it.
    """
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
    root = plain_table(
        n=n, w_f=scan.w_f, lam=scan.lam, lambda_c=unchecked_threshold_length(scan.w_f, n[:, None]), table=table
    )
    found = statuses == status.OK
    worst = np.unravel_index(np.argmax(np.where(found, table["error"], 0.0)), found.shape)
    at = f"n = {n[worst[0]]}, w_f = {scan.w_f[worst[1]]:g}, lambda = {scan.lam[worst[2]]:g}"
    facts = (
        (
            "ranges",
            f"n 1..{scan.n_max}, w_f {scan.w_f.min():g}..{scan.w_f.max():g}, "
            f"lambda {scan.lam.min():g}..{scan.lam.max():g}, gamma to {scan.gamma_max:g}",
        ),
        ("folds", f"{found.sum()}"),
        ("worst error", f"{table['error'][worst]:.1e} relative (estimated), {at}"),
        ("missed", f"{np.sum(statuses == status.NOT_FOUND)} transitions not seen or beyond gamma = {scan.gamma_max:g}"),
    )
    root.attrs = {f"scan_{name}": value for name, value in scan.attributes().items()}
    return root, facts
