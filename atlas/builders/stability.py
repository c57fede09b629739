"""Building the group of growth rates and boundaries of flutter of an atlas."""

import math
import os
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from towatlas.builders.critical import build_atlas
from towatlas.builders.file import Summary, limited_threads, progress_bar
from towatlas.builders.grids import Grid, ScanSettings, StabilityGrid
from towatlas.builders.stability_grid import (
    Rates,
    Sheets,
    complete_columns,
    crossed_cells,
    curves_of,
    direct_points,
    growth_errors,
    on_grid,
    sheets_of,
)
from towatlas.effort import patience
from towatlas.numerics.errormap import SAFETY
from towatlas.results_motion import Boundary
from towatlas.tables.seal import check_writable
from towatlas.tables.stability import AXES, STABILITY_GROUP, W_SCALE, GrowthGrid

Array = NDArray[np.float64]
END_KINDS = ("length", "speed", "fold", "real", "unknown")


def stability_group(grid: StabilityGrid, threads: int | None = None, progress: bool = True) -> xr.Dataset:
    """Growth rates and boundaries of flutter as a group of an atlas, and what they are wrong by.

    Parameters
    ----------
    grid : StabilityGrid
    threads : int, optional
        Threads to use; all by default.
    progress : bool
        Whether to show a progress bar on standard error, if that is a terminal.

    Returns
    -------
    xarray.Dataset
    """
    from towatlas.kernels.sweeps import threads as available

    every: list[tuple[Rates, tuple[Array, Array], list[Boundary], Sheets]] = []
    columns, points = [], []
    with (
        patience(math.inf),
        limited_threads(threads),
        progress_bar(grid.size, "shape", progress) as bar,
        ThreadPoolExecutor(threads or available()) as pool,
    ):
        for n in range(1, grid.n_max + 1):
            bar.set_description(f"n = {n}")
            nodes, between = on_grid(grid, n, False, bar), on_grid(grid, n, True, bar)
            curves = curves_of(grid, n, nodes, pool)
            sheets = sheets_of(grid, n, nodes, curves, pool)
            every.append((nodes, growth_errors(nodes, between, crossed_cells(grid, sheets, curves)), curves, sheets))
            columns.append(complete_columns(grid, nodes, sheets))
            points.append(direct_points(grid, n))
            bar.update(grid.checks)
    rates = _rates(grid, [one[0] for one in every], [one[1] for one in every], np.stack(columns))
    checked = "; ".join(_checked(n, *every[n - 1][:2], *points[n - 1]) for n in range(1, grid.n_max + 1))
    attributes = {name: getattr(grid.axes, name) for name in AXES} | {"w_f_scale": W_SCALE, "checked": checked}
    return xr.merge(
        [rates, _sheets([one[3] for one in every]), _curves([curve for one in every for curve in one[2]])],
        combine_attrs="override",
    ).assign_attrs(
        title="Growth rates of inner shapes in a vacuum, and where they flutter",
        comment="Of the inner shape of n nodes. Nodes are evenly spaced in log(1 + w_f / w_f_scale), from 0 to "
        "w_f_max; in log(lam - lambda_cn), from excess_min to excess_max; and in sqrt(log(gamma / gamma_cn)), from "
        "speed_min to speed_max. Growth and frequency, over Omega, are of the leading eigenvalue, of a shape that "
        "lasts 0 and that of the slowest mode. Their errors are missing in cells a boundary passes, or whose nodes or "
        "middle are not all of one kind: nothing is interpolated there. A sheet is a boundary over the weights and "
        "lengths, missing where it is not; its error is missing in cells where it was not found in the middle. Curves "
        "are boundaries at the weights of the nodes, one after another, each solved for by arclength; row_size is how "
        "many points each has.",
        **attributes,
    )


def _checked(
    n: int, nodes: Rates, errors: tuple[Array, Array], places: tuple[Array, Array, Array], direct: Rates
) -> str:
    """What random points say of the table, in words."""
    held = GrowthGrid(nodes.growth, nodes.frequency, nodes.unstable)
    growth, frequency, unstable = held.at(places)
    cells = held.cells(places)
    answered = np.isfinite(errors[0][cells]) & (direct.unstable >= 0)
    wrong = answered & (unstable != direct.unstable)
    off = np.abs(growth - direct.growth), np.abs(frequency - direct.frequency)
    beyond = answered & ~wrong & ((off[0] > errors[0][cells]) | (off[1] > errors[1][cells]))
    return (
        f"n = {n}: of {len(growth)} random points {answered.sum()} are held, {wrong.sum()} of these with another "
        f"number of what grows than solved directly, {beyond.sum()} more with an error beyond that stated"
    )


def build_stability(
    path: str | os.PathLike,
    *,
    grid: StabilityGrid | None = None,
    vacuum: Grid | None = None,
    scan: ScanSettings | None = None,
    threads: int | None = None,
    progress: bool = True,
) -> Summary:
    """Build an atlas with a group of growth rates and move it into place.

    Parameters
    ----------
    path : path
        Where the file goes; what is there stays whole until the new one is.
    grid : StabilityGrid, optional
        Where growth rates are tabulated.
    vacuum, scan : Grid, ScanSettings, optional
        What is tabulated of critical speeds; see `towatlas.builders.critical.build_atlas`.
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
    """
    begin = time.perf_counter()
    path = Path(path)
    check_writable(path)
    grid = grid or StabilityGrid()
    group = stability_group(grid, threads, progress)
    errors = np.maximum(group["stability_growth_error"].values, group["stability_frequency_error"].values)
    held, sheets = np.isfinite(errors), group["stability_sheet_error"].values
    edges = np.isfinite(sheets)
    said = (
        f"n 1..{grid.n_max}; {held.mean():.0%} of cells held, error (estimated) over gamma: median "
        f"{np.median(errors[held]):.1e}, worst {errors[held].max():.1e}; {group.sizes['stability_curve']} curves; "
        f"error of gamma on sheets: median {np.median(sheets[edges]):.1e}, worst {sheets[edges].max():.1e}; "
        f"{group.attrs['checked']}"
    )
    summary = build_atlas(
        path,
        grid=vacuum,
        scan=scan,
        threads=threads,
        progress=progress,
        extra={STABILITY_GROUP: group},
        more_facts=(("stability", said),),
        options="--stability",
    )
    return replace(summary, seconds=time.perf_counter() - begin)


def _about(dims: tuple[str, ...], data: NDArray[Any], text: str, **attributes: Any) -> xr.Variable:
    return xr.Variable(dims, data, {"long_name": text, "units": "1"} | attributes)


def _flags(dims: tuple[str, ...], data: NDArray[Any], text: str, *meanings: str) -> xr.Variable:
    values = np.arange(len(meanings), dtype=np.int8)
    return xr.Variable(
        dims, data.astype(np.int8), {"long_name": text, "flag_values": values, "flag_meanings": " ".join(meanings)}
    )


def _rates(grid: StabilityGrid, nodes: list[Rates], errors: list[tuple[Array, Array]], complete: Array) -> xr.Dataset:
    axes = grid.axes
    dims = ("stability_n", "stability_w_f", "stability_excess", "stability_speed")
    cells = (dims[0], "stability_w_f_cell", "stability_excess_cell", "stability_speed_cell")
    y, x, v = (np.linspace(-1.0, 1.0, count) for count in (grid.w_f, grid.excess, grid.speed))
    stacked = {name: np.stack([getattr(one, name) for one in nodes]) for name in ("growth", "frequency", "unstable")}
    beside = {"ancillary_variables": "stability_growth_error stability_frequency_error"}
    return xr.Dataset(
        {
            "stability_growth": _about(
                dims, stacked["growth"], "growth of the leading eigenvalue over Omega", **beside
            ),
            "stability_frequency": _about(dims, stacked["frequency"], "frequency of the leading eigenvalue over Omega"),
            "stability_unstable": _about(
                dims, stacked["unstable"].astype(np.int8), "number of eigenvalues that grow, -1 if not counted"
            ),
            **{
                f"stability_{name}_error": _about(
                    cells,
                    np.stack([one[k] for one in errors]),
                    f"error of {name} over Omega in each cell, {SAFETY:g} times the worst measured in the middle of it "
                    "and of those about it",
                )
                for k, name in enumerate(("growth", "frequency"))
            },
            "stability_complete": _flags(
                dims[:3], complete, "whether sheets account for all changes between nodes of speed", "no", "yes"
            ),
        },
        {
            dims[0]: _about(dims[:1], np.arange(1, grid.n_max + 1, dtype=np.int32), "number of the pair, and nodes"),
            dims[1]: _about(dims[1:2], axes.w_f.value(y), "fish weight over (mu + rho A) g R"),
            dims[2]: _about(dims[2:3], axes.excess.value(x), "lam - lambda_cn"),
            dims[3]: _about(dims[3:], np.exp(axes.root.value(v) ** 2), "gamma over gamma_cn"),
        },
    )


def _sheets(sheets: list[Sheets]) -> xr.Dataset:
    dims = ("stability_sheet", "stability_w_f", "stability_excess")
    cells = (dims[0], "stability_w_f_cell", "stability_excess_cell")
    orders = np.repeat(np.arange(1, len(sheets) + 1, dtype=np.int32), [len(one.begins) for one in sheets])
    joined = {name: np.concatenate([getattr(one, name) for one in sheets]) for name in Sheets.__annotations__}
    return xr.Dataset(
        {
            "stability_sheet_n": _about(dims[:1], orders, "number of the pair"),
            "stability_sheet_begins": _flags(
                dims[:1], joined["begins"], "what flutter does there as the speed rises", "ceases", "begins"
            ),
            "stability_sheet_speed": _about(dims, joined["speed"], "log(gamma / gamma_cn) of the boundary"),
            "stability_sheet_frequency": _about(dims, joined["frequency"], "frequency there over Omega"),
            "stability_sheet_error": _about(
                cells,
                joined["error"],
                f"relative error of gamma in each cell, {SAFETY:g} times the worst measured in the middle of it and of "
                "those about it",
            ),
        }
    )


def _curves(curves: list[Boundary]) -> xr.Dataset:
    one, points = ("stability_curve",), ("stability_point",)
    turn = [np.isin(np.arange(len(curve.lam)), curve.turns) for curve in curves]

    def joined(parts: list[NDArray[Any]]) -> NDArray[Any]:
        return np.concatenate(parts) if parts else np.empty(0)

    def ends(side: int) -> NDArray[Any]:
        return np.array([END_KINDS.index(curve.kinds[side]) for curve in curves], np.int8)

    return xr.Dataset(
        {
            "stability_curve_n": _about(one, np.array([c.n for c in curves], np.int32), "number of the pair"),
            "stability_curve_w_f": _about(one, np.array([c.w_f for c in curves]), "fish weight over (mu + rho A) g R"),
            "stability_row_size": _about(
                one,
                np.array([len(c.lam) for c in curves], np.int32),
                "points of each curve",
                sample_dimension="stability_point",
            ),
            "stability_curve_start": _flags(one, ends(0), "what is where the curve begins", *END_KINDS),
            "stability_curve_end": _flags(one, ends(1), "what is where the curve ends", *END_KINDS),
            **{
                f"stability_curve_{name}": _about(points, joined([getattr(c, name) for c in curves]), text)
                for name, text in (
                    ("lam", "length over tow radius"),
                    ("gamma", "speed Omega sqrt(R/g)"),
                    ("omega", "frequency of the two oscillations that meet, over Omega"),
                    ("r_f", "distance of the fish from the axis over tow radius"),
                    ("error", "estimated relative error of gamma"),
                )
            },
            "stability_curve_turn": _flags(points, joined(turn), "whether two edges meet there in a cusp", "no", "yes"),
        }
    )
