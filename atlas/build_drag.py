"""Building a file of folds with drag: curves of folds on Chebyshev points, series through them, a plain table."""

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from atlas.build import Summary, limited_threads, provenance
from atlas.dataset import root_attributes, symbol_attributes, write_atlas
from atlas.drag_folds import Curve, crossing, solve_at, solve_cusps, trace_folds
from atlas.drag_table import FIELDS, DragAxes, evaluate
from atlas.interpolant import coefficients, nodes, transform
from atlas.lookup import INTERPOLANT
from atlas.nomenclature import DRAG
from atlas.seal import check_writable
from kernels import status

Array = NDArray[np.float64]

# Curves traced together: enough for all threads, few enough for the bar to move.
BATCH = 40
# The error of a series is taken as this many times the worst found at points between its nodes.
MARGIN = 3.0


def _c_grid() -> Array:
    return np.concatenate([[0.0], 10.0 ** np.linspace(-4.0, 1.0, 41)])


@dataclass(frozen=True)
class DragGrid:
    """Where folds with drag are tabulated. The defaults take a few minutes."""

    n_max: int = 3
    lam_min: float = 16.0
    lam_max: float = 60.0
    w_f_max: float = 2000.0
    sigma_min: float = -0.5
    series_lam: int = 5
    series_w_f: int = 8
    series_sigma: int = 10
    checks: int = 6
    w_f: Array = field(default_factory=lambda: np.concatenate([[0.0], 10.0 ** np.linspace(-1.0, 3.25, 18)]))
    lam: Array = field(default_factory=lambda: np.geomspace(16.0, 60.0, 14))
    C: Array = field(default_factory=_c_grid)

    @property
    def axes(self) -> DragAxes:
        """The domain of the series."""
        return DragAxes(self.lam_min, self.lam_max, self.w_f_max, self.sigma_min)

    @property
    def size(self) -> int:
        """Number of curves to trace."""
        return self.n_max * (self.series_lam * self.series_w_f + self.checks)


def build_drag(
    path: Path, *, grid: DragGrid | None = None, threads: int | None = None, progress: bool = True
) -> Summary:
    """Build a file of folds with drag and move it into place.

    Parameters
    ----------
    path : Path
        Where the file goes; what is there stays whole until the new one is.
    grid : DragGrid, optional
        What is tabulated.
    threads : int, optional
        Threads to use; all by default. The file does not depend on it.
    progress : bool
        Whether to show a progress bar on standard error.

    Raises
    ------
    ArithmeticError
        If a curve on the grid has no cusp: the series would cross its disappearance.
    """
    begin = time.perf_counter()
    check_writable(path)
    grid = grid or DragGrid()
    with limited_threads(threads), tqdm(total=grid.size, unit="curve", disable=not progress, leave=False) as bar:
        series, cusp_series = _series(grid, bar)
        error, cusp_error = _errors(grid, series, cusp_series, bar)
    root, folds = _plain_tables(grid, series, cusp_series)
    group = _interpolant_group(grid, series, cusp_series, error, cusp_error)
    worst = int(np.argmax(error))
    ranges = (
        f"n 1..{grid.n_max}, w_f 0..{grid.w_f_max:g}, lambda {grid.lam_min:g}..{grid.lam_max:g}, C from 0 to C*_n, "
        f"where pairs end from {1.0 - grid.sigma_min**2:g} C*_n"
    )
    root.attrs = root_attributes("drag", provenance("--drag")) | {
        "title": "Folds of a cable towed in a circle, with drag",
        "comment": "In a nondense fluid, m_f = w_f, w = 1, no drag on the fish. C_cusp[n, w_f, lam] is the drag "
        "constant C*_n above which the n-th pair of equilibria does not exist; appears and ends are the speeds "
        "Omega sqrt(R/g) at which it appears and its outer member is gone, missing where C is above C*_n and, for "
        "ends, where it is below those of the series.",
        "folds_traced": "from the n-th fold of the vacuum; folds not connected with it are not in this file",
    }
    write_atlas(path, root, {INTERPOLANT: group})
    return Summary(
        path=path,
        method="drag",
        ranges=ranges,
        folds=folds,
        worst_error=float(error[worst]),
        worst_at=f"n = {worst + 1}; C*_n {cusp_error.max():.1e}",
        witness="",
        seconds=time.perf_counter() - begin,
        bytes=path.stat().st_size,
    )


def _traced(n: int, lam: Array, w_f: Array, bar: tqdm) -> tuple[list[Curve], Array]:
    """Curves of folds and their cusps."""
    curves: list[Curve] = []
    for first in range(0, len(lam), BATCH):
        part = slice(first, first + BATCH)
        curves += trace_folds(np.full(len(lam[part]), n), lam[part].copy(), w_f[part].copy(), parallel=True)
        bar.update(len(lam[part]))
    cusps, codes = solve_cusps(curves, lam, w_f, parallel=True)
    if (codes != status.OK).any():
        k = int(np.flatnonzero(codes != status.OK)[0])
        raise ArithmeticError(f"n = {n}, lam = {lam[k]:g}, w_f = {w_f[k]:g}: {status.SENTENCES[int(codes[k])]}")
    return curves, cusps


def _solved(curves: list[Curve], cusps: Array, lam: Array, w_f: Array, sigma: Array) -> Array:
    """log gamma and log r_f, shape (2, cables, sigma), of folds at C = C* (1 - sigma^2)."""
    guess = np.empty((len(curves), len(sigma), 3))
    for row, curve in enumerate(curves):
        for k, value in enumerate(sigma):
            log_c = cusps[row, 2] + np.log1p(-value * value) if value < 1.0 else -np.inf
            found = crossing(curve, log_c, bool(value > 0.0))
            guess[row, k] = np.nan if found is None else found
            guess[row, k, 2] = log_c
    flat = guess.reshape(-1, 3)
    vacuum = np.isneginf(flat[:, 2])
    # The fold of the vacuum is a drag too faint to be seen.
    flat[vacuum, 2] = np.log(1e-12)
    z, _, codes = solve_at(flat, np.repeat(lam, len(sigma)), np.repeat(w_f, len(sigma)), parallel=True)
    if (codes != status.OK).any():
        k, j = divmod(int(np.flatnonzero(codes != status.OK)[0]), len(sigma))
        raise ArithmeticError(f"lam = {lam[k]:g}, w_f = {w_f[k]:g}: the fold at sigma = {sigma[j]:.3g} was not solved")
    z = z.reshape(guess.shape)
    return np.stack([z[:, :, 1], z[:, :, 0] - 2.0 * z[:, :, 1]])


def _series(grid: DragGrid, bar: tqdm) -> tuple[dict[str, Array], Array]:
    """Series of log gamma and log r_f, shape (n, sigma, w_f, lam), and of log C*, shape (n, w_f, lam)."""
    axes = grid.axes
    w_f, lam = (
        column.ravel()
        for column in np.meshgrid(axes.w_f(nodes(grid.series_w_f)), axes.lam(nodes(grid.series_lam)), indexing="ij")
    )
    sigma = axes.sigma(nodes(grid.series_sigma))
    shape = (grid.series_w_f, grid.series_lam)
    fields, cusps = [], []
    for n in range(1, grid.n_max + 1):
        curves, cusp = _traced(n, lam, w_f, bar)
        solved = _solved(curves, cusp, lam, w_f, sigma).reshape(2, *shape, grid.series_sigma)
        plane = coefficients(np.moveaxis(solved, -1, 1))
        fields.append(np.einsum("ks,fsji->fkji", transform(grid.series_sigma), plane, optimize=False))
        cusps.append(coefficients(cusp[:, 2].reshape(shape)))
    table = np.stack(fields, axis=1)
    return dict(zip(FIELDS, table, strict=True)), np.stack(cusps)


def _errors(grid: DragGrid, series: dict[str, Array], cusp_series: Array, bar: tqdm) -> tuple[Array, Array]:
    """Relative errors of gamma and C* for each n, from points spread over the domain."""
    axes = grid.axes
    # A rank-1 lattice: evenly spread, and the same everywhere.
    k = np.arange(grid.checks) + 0.5
    y, x = (2.0 * np.modf(k * ratio)[0] - 1.0 for ratio in (1.0 / grid.checks, 0.6180339887498949))
    w_f, lam = axes.w_f(y), axes.lam(x)
    sigma = np.array([-0.4, -0.15, 0.1, 0.35, 0.6, 0.85])
    error, cusp_error = np.empty(grid.n_max), np.empty(grid.n_max)
    for n in range(1, grid.n_max + 1):
        curves, cusps = _traced(n, lam, w_f, bar)
        log_gamma = _solved(curves, cusps, lam, w_f, sigma)[0]
        wrong = [
            np.abs(evaluate(series["gamma"][n - 1], np.full(len(x), s), y, x) - log_gamma[:, j]).max()
            for j, s in enumerate(axes.s(sigma))
        ]
        error[n - 1] = MARGIN * max(wrong)
        cusp = evaluate(cusp_series[n - 1][None], np.zeros(len(x)), y, x)
        cusp_error[n - 1] = MARGIN * np.abs(cusp - cusps[:, 2]).max()
    return error, cusp_error


def _plain_tables(grid: DragGrid, series: dict[str, Array], cusp_series: Array) -> tuple[xr.Dataset, int]:
    """C*_n on (n, w_f, lam), folds on (n, C, w_f, lam)."""
    axes = grid.axes
    inside = (grid.lam >= axes.lam_min) & (grid.lam <= axes.lam_max)
    lam, w_f = grid.lam[inside], grid.w_f[grid.w_f <= axes.w_f_max]
    c, w, length = (column.ravel() for column in np.meshgrid(grid.C, w_f, lam, indexing="ij"))
    y, x = axes.y(w), axes.x(length)
    shape = (len(grid.C), len(w_f), len(lam))
    appears, ends = np.full((2, grid.n_max, *shape), np.nan)
    cusps = np.empty((grid.n_max, *shape[1:]))
    for n in range(grid.n_max):
        cusp = np.exp(evaluate(cusp_series[n][None], np.zeros(len(x)), y, x))
        cusps[n] = cusp.reshape(shape)[0]
        with np.errstate(invalid="ignore"):
            sigma = np.sqrt(1.0 - c / cusp)
        for table, side in ((appears, 1.0), (ends, -1.0)):
            good = side * sigma >= axes.sigma_min
            values = np.full(len(c), np.nan)
            s = axes.s(side * sigma[good])
            values[good] = np.exp(evaluate(series["gamma"][n], s, y[good], x[good]))
            table[n] = values.reshape(shape)
    dims = ("n", "C", "w_f", "lam")
    dataset = xr.Dataset(
        {
            "C_cusp": _variable(("n", "w_f", "lam"), "C_cusp", cusps),
            "appears": _variable(dims, "appears", appears),
            "ends": _variable(dims, "ends", ends),
        },
        {
            "n": _variable(("n",), "n", np.arange(1, grid.n_max + 1)),
            "C": _variable(("C",), "C", grid.C),
            "w_f": _variable(("w_f",), "w_f", w_f),
            "lam": _variable(("lam",), "lam", lam),
        },
    )
    return dataset, int(np.isfinite(appears).sum() + np.isfinite(ends).sum())


def _variable(dims: tuple[str, ...], name: str, data: NDArray[Any]) -> xr.Variable:
    return xr.Variable(dims, np.asarray(data, np.int32) if name == "n" else data, symbol_attributes(name, DRAG))


def _interpolant_group(
    grid: DragGrid, series: dict[str, Array], cusp_series: Array, error: Array, cusp_error: Array
) -> xr.Dataset:
    dims = ("series_n", "sigma_degree", "w_f_degree", "lam_degree")
    one = {"units": "1"}
    variables = {
        f"{name}_series": xr.Variable(dims, values, {"long_name": f"Chebyshev coefficients of log {name}"} | one)
        for name, values in series.items()
    }
    variables["C_cusp_series"] = xr.Variable(
        (dims[0], *dims[2:]), cusp_series, {"long_name": "Chebyshev coefficients of log C_cusp"} | one
    )
    for name, values in (("gamma_error", error), ("C_cusp_error", cusp_error)):
        text = f"relative error of {name.removesuffix('_error')}, {MARGIN:g} times the worst between nodes"
        variables[name] = xr.Variable(dims[:1], values, {"long_name": text} | one)
    axes = grid.axes
    return xr.Dataset(
        variables,
        attrs={name: getattr(axes, name) for name in ("lam_min", "lam_max", "w_f_max", "sigma_min")}
        | {
            "comment": "Coordinates in [-1, 1]: of log(lam); of log(1 + w_f / 0.03); of sigma from sigma_min to 1, "
            "with C = C_cusp (1 - sigma^2), sigma > 0 where the pair appears, < 0 where it ends.",
        },
    )
