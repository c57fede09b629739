"""Building the table of equilibria: the median branch and the outward one over (w_f, lambda, gamma)."""

import math
import os
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from towatlas.builders.file import Summary, limited_threads, progress_bar, provenance, write_atlas
from towatlas.builders.grids import EquilibriaGrid
from towatlas.cf import equilibria_attributes, equilibrium_variable, variable
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.limits import W_SCALE, unchecked_excess_length
from towatlas.numerics.errormap import SAFETY, stated_error
from towatlas.numerics.lagrange import at_middles, middles, weights, windows
from towatlas.solve.critical import solve_rows
from towatlas.solve.members import shoot_lanes, solve_members
from towatlas.tables.fish import BRANCHES, CELLS, CRITICAL, WIDTHS, coordinates
from towatlas.tables.seal import check_writable

Array = NDArray[np.float64]

FIELDS = ("R_x0", "x_f", "z_f", "error", "status")
# Share of what the critical speeds of the cables about a cell differ by that a fold may lie beyond them.
MARGIN = 0.2
# Beyond this error a cell is not interpolated.
WORST_ERROR = 1e-3
# Speeds from which the next is guessed, at most: measured, more save no shots to speak of.
POINTS = 8
# Of a table near machine accuracy.
ROUNDING = 1e-11


def build_equilibria(
    path: str | os.PathLike, *, grid: EquilibriaGrid | None = None, threads: int | None = None, progress: bool = True
) -> Summary:
    """Build a table of equilibria and move it into place.

    Parameters
    ----------
    path : path
        Where the file goes; what is there stays whole until the new one is.
    grid : EquilibriaGrid, optional
        Where it is tabulated.
    threads : int, optional
        Threads to use; all by default. The file does not depend on it.
    progress : bool
        Whether to show a progress bar on standard error, if that is a terminal.

    Returns
    -------
    Summary

    Raises
    ------
    AtlasFileError
        If the file cannot be written.
    RuntimeError
        If an equilibrium does not converge, which is a defect.
    """
    start = time.perf_counter()
    path = Path(path)
    check_writable(path)
    grid = grid or EquilibriaGrid()
    between = _between(grid)
    total = grid.size + between.size
    with patience(math.inf), limited_threads(threads), progress_bar(total, "cable", progress) as bar:
        critical, solved = _solve(grid, bar, "equilibria")
        critical_between, exact = _solve(between, bar, "checking")
        sheets = _one_sheet(grid, critical["gamma"], critical_between["gamma"])
        cells = _cells(grid, solved, exact, sheets)
        bar.set_description("writing")
        root = _plain(grid, solved)
        root.attrs = equilibria_attributes(provenance("--equilibria"))
        write_atlas(path, root, {CRITICAL: _critical_group(grid, critical), CELLS: cells})
    facts = (
        (
            "ranges",
            f"w_f 0..{grid.w_f.max():g}, lambda {grid.lam.min():g}..{grid.lam.max():g}, "
            f"gamma {grid.gamma.min():g}..{grid.gamma.max():g}",
        ),
        (
            "equilibria",
            f"{2 * grid.size}, on the median and the outward branch; at most {2 * solved['nodes'].max() + 1} a cable",
        ),
        ("worst error", f"{solved['error'].max():.1e} relative (estimated)"),
        ("lookup", f"interpolates in {np.mean(cells['width'].values[1] > 0):.0%} of the cells of the median branch"),
    )
    return Summary(path, "equilibria", facts, time.perf_counter() - start)


def _solve(grid: EquilibriaGrid, bar: tqdm, label: str) -> tuple[dict[str, Array], dict[str, NDArray[Any]]]:
    """Critical speeds and both branches of every cable of a grid."""
    bar.set_description(label)
    critical = _critical_speeds(grid)
    solved = _march_in_speed(grid, critical, bar)
    if failed := int(np.sum(solved["status"] != status.OK)):
        raise RuntimeError(f"{failed} equilibria did not converge; this is a defect, please report it")
    return critical, solved


def _critical_speeds(grid: EquilibriaGrid) -> dict[str, Array]:
    """gamma_cn and |x_f| there of every cable, shape (n, w_f, lam), inf and nan beyond the fastest speed."""
    w_f, lam = (a.ravel() for a in np.meshgrid(grid.w_f, grid.lam, indexing="ij"))
    gammas, offsets = [], []
    left = np.arange(len(w_f))
    n = 1
    while True:
        excess = unchecked_excess_length(lam=lam[left], w_f=w_f[left], n=n)
        left, excess = left[excess > 0.0], excess[excess > 0.0]
        gamma, offset = np.full(len(w_f), np.inf), np.full(len(w_f), np.nan)
        if len(left):
            rows = solve_rows(lam=lam[left], w_f=w_f[left], n=np.full(len(left), n), excess=excess)
            known = rows["status"] == status.OK
            # Lost in rounding are only folds next to their threshold, faster than any table.
            if not (known | (rows["status"] == status.LOST_IN_ROUNDING)).all():
                raise RuntimeError("a critical speed did not converge; this is a defect, please report it")
            reached = known & (rows["gamma"] < grid.gamma.max())
            left = left[reached]
            gamma[left], offset[left] = rows["gamma"][reached], np.abs(rows["x_f"][reached])
        if not len(left):
            break
        gammas.append(gamma)
        offsets.append(offset)
        n += 1
    shape = (len(gammas), len(grid.w_f), len(grid.lam))
    return {"gamma": np.reshape(gammas, shape), "x_f": np.reshape(offsets, shape)}


def _march_in_speed(grid: EquilibriaGrid, critical: dict[str, Array], bar: tqdm) -> dict[str, NDArray[Any]]:
    """Both branches of every cable, from slow to fast: every FIELD and the nodes, shape (branch, w_f, lam, gamma)."""
    w_f, lam = (a.ravel() for a in np.meshgrid(grid.w_f, grid.lam, indexing="ij"))
    cables, speeds = len(w_f), len(grid.gamma)
    gamma_c, x_fold = (critical[name].reshape(-1, cables) for name in ("gamma", "x_f"))
    branches = {name: np.zeros((len(BRANCHES), cables, speeds)) for name in FIELDS}
    nodes = np.zeros((len(BRANCHES), cables, speeds), np.int64)
    same_before = np.zeros((len(BRANCHES), cables), np.int64)
    reach = np.full((len(BRANCHES), cables), np.nan)
    for j, speed in enumerate(grid.gamma):
        nodes[1, :, j] = np.sum(gamma_c < speed, axis=0)
        for k in range(len(BRANCHES)):
            n = nodes[k, :, j]
            unsolved = np.arange(cables)
            if k == 1:
                # Up to the first transition the two branches are one.
                for name in FIELDS:
                    branches[name][1, :, j] = branches[name][0, :, j]
                unsolved = np.flatnonzero(n > 0)
            # Speeds before at which the shape has the same number of nodes.
            same = np.where(n == nodes[k, :, j - 1], np.minimum(same_before[k] + 1, POINTS), 0) if j else 0 * n
            same_before[k] = same
            guess = _extrapolated(np.abs(branches["x_f"][k]), grid.gamma, j, same)
            if k == 1:
                new = np.flatnonzero((same == 0) & (n > 0))
                guess[new] = x_fold[n[new] - 1, new]
            members = solve_members(
                lam=lam[unsolved],
                w_f=w_f[unsolved],
                gamma=np.full(len(unsolved), speed),
                n=n[unsolved],
                outer=np.zeros(len(unsolved), bool),
                shoot=shoot_lanes,
                guess=guess[unsolved] * speed**2,
                reach=np.where(same > 0, reach[k], np.nan)[unsolved],
            )
            reach[k, unsolved] = members.reach
            for name in FIELDS:
                branches[name][k, unsolved, j] = getattr(members, name)
        bar.update(cables)
    shape = (len(BRANCHES), len(grid.w_f), len(grid.lam), speeds)
    return {name: values.reshape(shape) for name, values in (branches | {"nodes": nodes}).items()}


def _extrapolated(x_f: Array, gamma: Array, j: int, same: NDArray[np.int64]) -> Array:
    """Guess of |x_f| at the j-th speed from the `same` speeds before, log|x_f| a polynomial in log(gamma)."""
    guess = np.full(len(x_f), np.nan)
    nodes = np.log(gamma)
    for count in range(1, min(j, POINTS) + 1):
        rows = np.flatnonzero(same == count)
        shares = weights(nodes[j : j + 1], nodes, np.array([j - count]), count)[0]
        guess[rows] = np.exp(np.einsum("rk,k->r", np.log(x_f[rows, j - count : j]), shares, optimize=False))
    return guess


def _between(grid: EquilibriaGrid) -> EquilibriaGrid:
    """The middles of all cells, in the coordinates of interpolation."""
    axes = [middles(axis) for axis in coordinates(lam=grid.lam, w_f=grid.w_f, gamma=grid.gamma)]
    return EquilibriaGrid(w_f=W_SCALE * np.expm1(axes[0]), lam=np.exp(axes[1]), gamma=np.exp(axes[2]))


def _one_sheet(grid: EquilibriaGrid, gamma_c: Array, gamma_between: Array) -> tuple[NDArray[np.bool_], NDArray[Any]]:
    """Whether no fold passes a cell, and the nodes of the median branch there: arrays over the cells.

    What the folds do within a cell is read off its four cables and the one in its middle, with a margin: a fifth of
    what they differ by, for a surface that is curved between them.
    """
    orders = max(len(gamma_c), len(gamma_between))
    logs = [
        np.log(np.concatenate([part, np.full((orders - len(part), *part.shape[1:]), np.inf)]))
        for part in (gamma_c, gamma_between)
    ]
    corners = logs[0]
    about = np.stack([corners[:, :-1, :-1], corners[:, 1:, :-1], corners[:, :-1, 1:], corners[:, 1:, 1:], logs[1]])
    low, high = about.min(axis=0), about.max(axis=0)
    with np.errstate(invalid="ignore"):
        margin = np.where(np.isfinite(high), MARGIN * (high - low), MARGIN)
    log_gamma = np.log(grid.gamma)
    before = np.sum((high + margin)[..., None] < log_gamma[:-1], axis=0)
    beyond = np.sum((low - margin)[..., None] < log_gamma[1:], axis=0)
    return before == beyond, before


def _cells(grid: EquilibriaGrid, solved: dict[str, Any], exact: dict[str, Any], sheets: Any) -> xr.Dataset:
    """How each cell is interpolated: the width of least error in its middle among those that stay on one branch."""
    axes = coordinates(lam=grid.lam, w_f=grid.w_f, gamma=grid.gamma)
    counts = tuple(len(axis) - 1 for axis in axes)
    fields = {name: np.log(np.abs(solved[name])) for name in ("x_f", "z_f")}
    truth = {name: np.log(np.abs(exact[name])) for name in ("x_f", "z_f")}
    one_sheet, nodes_between = sheets
    width = np.zeros((len(BRANCHES), *counts), np.int64)
    error = np.full((len(BRANCHES), *counts), np.inf)
    for k in range(len(BRANCHES)):
        for trial in WIDTHS:
            miss = np.max(
                [np.abs(at_middles(fields[name][k], axes, trial) - truth[name][k]) for name in fields], axis=0
            )
            usable = np.ones(counts, bool)
            if k == 1:
                low, high = _extremes(solved["nodes"][1], counts, trial)
                usable = one_sheet & (low == high) & (low == nodes_between)
            miss = stated_error(np.where(usable, miss, 0.0), ROUNDING)
            better = usable & (miss < error[k])
            width[k][better] = trial
            error[k][better] = miss[better]
    bad = error > WORST_ERROR
    width[bad], error[bad] = 0, np.nan
    dims = ("branch", "w_f_cell", "lam_cell", "gamma_cell")
    return xr.Dataset(
        {
            "width": xr.Variable(
                dims,
                width.astype(np.int8),
                {
                    "long_name": "nodes on each axis through which a cell between eight nodes is interpolated, "
                    "0 for none",
                    "units": "1",
                },
            ),
            "position_error": xr.Variable(
                dims,
                error.astype(np.float32),
                {"long_name": "relative error of x_f and z_f interpolated in a cell", "units": "1"},
            ),
        },
        attrs={
            "worst_error": WORST_ERROR,
            "comment": "log(abs(x_f)) and log(z_f) are interpolated by Lagrange polynomials in log(1 + w_f / "
            f"{W_SCALE:g}), log(lam) and log(gamma) through width nodes on each axis, as many on either side of the "
            "cell, or the outermost. A cell of width 0 is not interpolated: a fold passes it, or the error would be "
            f"above worst_error. The error is {SAFETY:g} times the largest measured in the middles of the cell and its "
            "neighbours.",
        },
    )


def _extremes(nodes: NDArray[Any], counts: tuple[int, ...], width: int) -> tuple[NDArray[Any], NDArray[Any]]:
    """Fewest and most nodes of the shapes that the interpolation of each cell uses."""
    low = high = nodes
    for axis, count in enumerate(counts):
        first = windows(np.arange(count), count + 1, width)
        low = np.min([np.take(low, first + k, axis=axis) for k in range(width)], axis=0)
        high = np.max([np.take(high, first + k, axis=axis) for k in range(width)], axis=0)
    return low, high


def _plain(grid: EquilibriaGrid, solved: dict[str, Any]) -> xr.Dataset:
    """The root of the file: every quantity over (branch, w_f, lam, gamma)."""
    dims = ("branch", "w_f", "lam", "gamma")
    variables = {
        name: equilibrium_variable(dims, name, solved[name].astype(np.int8) if name == "status" else solved[name])
        for name in ("R_x0", "x_f", "z_f", "status")
    }
    tension = np.hypot((grid.w_f[:, None] + grid.lam)[None, :, :, None], solved["R_x0"])
    variables["tension"] = equilibrium_variable(dims, "tension", tension)
    variables["error"] = xr.Variable(
        dims, solved["error"].astype(np.float32), {"long_name": "estimated relative error of x_f", "units": "1"}
    )
    variables["nodes"] = equilibrium_variable(dims, "nodes", solved["nodes"].astype(np.int16))
    variables["count"] = equilibrium_variable(dims[1:], "count", (2 * solved["nodes"][1] + 1).astype(np.int16))
    return xr.Dataset(
        variables,
        {
            "branch": xr.Variable(
                ("branch",),
                np.arange(len(BRANCHES), dtype=np.int8),
                {
                    "long_name": "branch of equilibria",
                    "flag_values": np.arange(len(BRANCHES), dtype=np.int8),
                    "flag_meanings": " ".join(BRANCHES),
                },
            ),
            "w_f": variable(("w_f",), "w_f", grid.w_f),
            "lam": variable(("lam",), "lam", grid.lam),
            "gamma": equilibrium_variable(("gamma",), "gamma", grid.gamma),
        },
    )


def _critical_group(grid: EquilibriaGrid, critical: dict[str, Array]) -> xr.Dataset:
    dims = ("fold_n", "fold_w_f", "fold_lam")
    known = np.isfinite(critical["gamma"])
    return xr.Dataset(
        {name: variable(dims, name, np.where(known, critical[name], np.nan)) for name in ("gamma", "x_f")},
        {
            "fold_n": variable(("fold_n",), "n", np.arange(1, len(known) + 1)),
            "fold_w_f": variable(("fold_w_f",), "w_f", grid.w_f),
            "fold_lam": variable(("fold_lam",), "lam", grid.lam),
        },
        attrs={
            "comment": "gamma is the speed at which the n-th pair of equilibria of a cable of the table appears, and "
            "abs(x_f) the distance of the fish from the axis there; missing where that is beyond the speeds of the "
            "table or never."
        },
    )
