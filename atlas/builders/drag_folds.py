"""Building the group of folds with drag: folds on Chebyshev points, series through them, plain tables.

The first stage traces curves of folds from the vacuum at a few cables; from the series through them Newton finds the
folds of all others, at a fraction of the cost.
"""

import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from tqdm import tqdm

from towatlas.builders.critical import Summary, build_atlas, limited_threads
from towatlas.builders.grids import Grid, ScanSettings
from towatlas.cf import symbol_attributes
from towatlas.kernels import status
from towatlas.nomenclature import DRAG
from towatlas.numerics.chebyshev import coefficients, midpoints, nodes, transform
from towatlas.solve.drag_folds import Curve, crossing, polish_cusps, solve_at, solve_cusps, trace_folds
from towatlas.tables.drag_folds import DRAG_GROUP, FIELDS, W_SHARE, DragAxes, block_of, evaluate
from towatlas.tables.seal import check_writable

Array = NDArray[np.float64]

# Cables traced together: enough for all threads, few enough for the bar to move.
BATCH = 40
# The error of a series is taken as this many times the worst found at points between its nodes.
MARGIN = 3.0
# A solution this far from what the series before predicts, in any logarithm, may be another: it is traced instead.
STRAYED = 0.3
# A last step of Newton after which its error, the square of it, is far below that of the series.
LAST_STEP = 1e-6
VACUUM = 1e-12
NEAR_CUSP = 0.05


def _c_grid() -> Array:
    return np.concatenate([[0.0], 10.0 ** np.linspace(-4.0, 1.0, 41)])


@dataclass(frozen=True)
class DragGrid:
    """Where folds with drag are tabulated. The defaults take a few minutes.

    stages : nodes in w_f and lambda of the cables traced, and of the series that follow, each predicted by the one
    before; the last is kept. series_sigma : nodes in sigma, none of them next to the cusp at 0. checks : cables between
    the nodes for the error, of which traced_checks are traced.
    """

    n_max: int = 3
    lam_min: float = 16.0
    lam_max: float = 60.0
    w_f_max: float = 2000.0
    sigma_min: float = -0.5
    stages: tuple[tuple[int, int], ...] = ((9, 4), (29, 11))
    series_sigma: int = 15
    checks: int = 160
    traced_checks: int = 5
    error_blocks: int = 6
    w_f: Array = field(default_factory=lambda: np.concatenate([[0.0], 10.0 ** np.linspace(-1.0, 3.25, 18)]))
    lam: Array = field(default_factory=lambda: np.geomspace(16.0, 60.0, 14))
    C: Array = field(default_factory=_c_grid)

    @property
    def axes(self) -> DragAxes:
        """The domain of the series."""
        return DragAxes(self.lam_min, self.lam_max, self.w_f_max, self.sigma_min)

    @property
    def size(self) -> int:
        """Number of cables to solve."""
        return self.n_max * (sum(w_f * lam for w_f, lam in self.stages) + self.checks)


def drag_group(grid: DragGrid, threads: int | None = None, progress: bool = True) -> xr.Dataset:
    """Folds with drag as a group of an atlas: plain tables, the series for lookup, and what these are wrong by.

    Raises
    ------
    ArithmeticError
        If a curve on the grid has no cusp: the series would cross its disappearance.
    """
    with limited_threads(threads), tqdm(total=grid.size, unit="cable", disable=not progress, leave=False) as bar:
        bar.set_description("drag")
        series, errors = [], []
        for n in range(1, grid.n_max + 1):
            series.append(_series(grid, n, bar))
            errors.append(_errors(grid, n, series[-1], bar))
    tables = _plain_tables(grid, series)
    return tables.merge(_series_variables(grid, series, *np.stack(errors, axis=1)), combine_attrs="no_conflicts")


def build_drag(
    path: Path,
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
    path : Path
        Where the file goes; what is there stays whole until the new one is.
    grid : DragGrid, optional
        What is tabulated with drag.
    vacuum, scan : Grid, ScanSettings, optional
        What is tabulated of the vacuum; see `towatlas.builders.critical.build_atlas`.
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
    group = drag_group(grid, threads, progress)
    summary = build_atlas(path, grid=vacuum, scan=scan, threads=threads, progress=progress, extra={DRAG_GROUP: group})
    gamma, cusp = group["drag_gamma_error"].values, group["drag_C_cusp_error"].values
    drag = (
        f"n 1..{grid.n_max}, w_f 0..{grid.w_f_max:g}, lambda {grid.lam_min:g}..{grid.lam_max:g}, C from 0 to C*_n; "
        f"error (estimated) of gamma: median {np.median(gamma):.1e}, worst {gamma.max():.1e}; "
        f"of C*_n: median {np.median(cusp):.1e}, worst {cusp.max():.1e}"
    )
    return replace(summary, drag=drag, seconds=time.perf_counter() - begin)


@dataclass(frozen=True)
class Series:
    """Chebyshev series of one n: log gamma and log r_f, shape (sigma, w_f, lam), and log C*, shape (w_f, lam)."""

    gamma: Array
    r_f: Array
    cusp: Array

    def guess(self, at_sigma: float, y: Array, x: Array) -> Array:
        """log r, log gamma, shape (2, points), at one coordinate of sigma and others of shape (points,)."""
        s = np.full(len(x), at_sigma)
        log_gamma = evaluate(self.gamma, s, y, x)
        return np.stack([evaluate(self.r_f, s, y, x) + 2.0 * log_gamma, log_gamma])

    def log_cusp(self, y: Array, x: Array) -> Array:
        """log C* at coordinates of shape (points,)."""
        return evaluate(self.cusp[None], np.zeros(len(x)), y, x)


@dataclass(frozen=True)
class Cables:
    """Cables of one n, arrays of shape (cables,): coordinates y and x, w_f and lam."""

    n: int
    y: Array
    x: Array
    w_f: Array
    lam: Array

    @classmethod
    def at(cls, axes: DragAxes, n: int, y: Array, x: Array) -> "Cables":
        """Cables at coordinates."""
        lam = axes.lam(x)
        return cls(n, y, x, axes.w_f(y, lam), lam)

    @classmethod
    def grid(cls, axes: DragAxes, n: int, y: Array, x: Array) -> "Cables":
        """Cables on the product of two axes, y first."""
        y, x = (column.ravel() for column in np.meshgrid(y, x, indexing="ij"))
        return cls.at(axes, n, y, x)

    def part(self, which: NDArray[Any]) -> "Cables":
        """Some of them."""
        return Cables(self.n, *(column[which] for column in (self.y, self.x, self.w_f, self.lam)))

    def __len__(self) -> int:
        return len(self.x)


def _traced(cables: Cables, sigma: Array, bar: tqdm) -> tuple[Array, Array]:
    """log C*, shape (cables,), and log gamma and log r_f of folds, shape (2, cables, sigma), from the vacuum on."""
    curves: list[Curve] = []
    for first in range(0, len(cables), BATCH):
        part = cables.part(np.arange(first, min(first + BATCH, len(cables))))
        curves += trace_folds(np.full(len(part), part.n), part.lam, part.w_f, parallel=True)
        bar.update(len(part))
    cusps, codes = solve_cusps(curves, cables.lam, cables.w_f, parallel=True)
    if (codes != status.OK).any():
        k = int(np.flatnonzero(codes != status.OK)[0])
        raise ArithmeticError(
            f"n = {cables.n}, lam = {cables.lam[k]:g}, w_f = {cables.w_f[k]:g}: {status.SENTENCES[int(codes[k])]}"
        )
    log_c = _log_drag(cusps[:, 2], sigma)
    guess = np.full((len(cables), len(sigma), 2), np.nan)
    for row, curve in enumerate(curves):
        for k, value in enumerate(sigma):
            if (found := crossing(curve, log_c[row, k], bool(value > 0.0))) is not None:
                guess[row, k] = found[:2]
    values, solved = _folds(cables, guess, log_c)
    if not solved.all():
        k, j = (int(place[0]) for place in np.nonzero(~solved))
        raise ArithmeticError(
            f"n = {cables.n}, lam = {cables.lam[k]:g}, w_f = {cables.w_f[k]:g}: "
            f"the fold at sigma = {sigma[j]:.3g} was not solved"
        )
    return cusps[:, 2], values


def _predicted(cables: Cables, series: Series, axes: DragAxes, sigma: Array, bar: tqdm) -> tuple[Array, Array]:
    """The same by Newton from what a series with fewer nodes says; cables for which that fails are traced."""
    guess = series.guess(axes.s(np.zeros(1))[0], cables.y, cables.x)
    start = np.stack([*guess, series.log_cusp(cables.y, cables.x)], axis=1)
    cusps, codes = polish_cusps(start, cables.lam, cables.w_f, parallel=True)
    good = (codes == status.OK) & (np.abs(cusps - start).max(axis=1) < STRAYED)
    log_c = _log_drag(cusps[:, 2], sigma)
    folds = np.stack([series.guess(s, cables.y, cables.x).T for s in axes.s(sigma)], axis=1)
    folds[~good] = np.nan
    values, solved = _folds(cables, folds, log_c)
    strayed = np.abs(values[0] - folds[:, :, 1]).max(axis=1) > STRAYED
    again = np.flatnonzero(~good | ~solved.all(axis=1) | strayed)
    bar.update(len(cables) - len(again))
    log_cusp = cusps[:, 2]
    if len(again):
        log_cusp[again], values[:, again] = _traced(cables.part(again), sigma, bar)
    return log_cusp, values


def _log_drag(log_cusp: Array, sigma: Array) -> Array:
    """log C at C = C* (1 - sigma^2), shape (cables, sigma); the vacuum is a drag too faint to be seen."""
    with np.errstate(divide="ignore"):
        return np.maximum(log_cusp[:, None] + np.log1p(-(np.minimum(sigma, 1.0) ** 2)), np.log(VACUUM))


def _folds(cables: Cables, guess: Array, log_c: Array) -> tuple[Array, NDArray[np.bool_]]:
    """log gamma and log r_f, shape (2, cables, sigma), from guesses of log r and log gamma; and which are solved."""
    count = log_c.shape[1]
    flat = np.concatenate([guess, log_c[:, :, None]], axis=2).reshape(-1, 3)
    z, _, codes = solve_at(
        flat, np.repeat(cables.lam, count), np.repeat(cables.w_f, count), parallel=True, settled_at=LAST_STEP
    )
    z = z.reshape(*log_c.shape, 3)
    return np.stack([z[:, :, 1], z[:, :, 0] - 2.0 * z[:, :, 1]]), (codes == status.OK).reshape(log_c.shape)


def _series(grid: DragGrid, n: int, bar: tqdm) -> Series:
    """Series of one n: the first stage traced from the vacuum, each other predicted by the one before it."""
    axes = grid.axes
    sigma = axes.sigma(nodes(grid.series_sigma))
    traced, *refined = (Cables.grid(axes, n, *(nodes(count) for count in stage)) for stage in grid.stages)
    series = _through(*_traced(traced, sigma, bar), grid.stages[0])
    for cables, shape in zip(refined, grid.stages[1:], strict=True):
        series = _through(*_predicted(cables, series, axes, sigma, bar), shape)
    return series


def _through(log_cusp: Array, values: Array, shape: tuple[int, int]) -> Series:
    """Series through log C*, shape (cables,), and log gamma and log r_f, shape (2, cables, sigma), on nodes `shape`."""
    sigma_nodes = values.shape[-1]
    plane = coefficients(np.moveaxis(values.reshape(2, *shape, sigma_nodes), -1, 1))
    fields = np.einsum("ks,fsji->fkji", transform(sigma_nodes), plane, optimize=False)
    return Series(fields[0], fields[1], coefficients(log_cusp.reshape(shape)))


def _errors(grid: DragGrid, n: int, series: Series, bar: tqdm) -> tuple[Array, Array]:
    """Relative errors of gamma at given C, and of C*, in blocks of the coordinates of w_f and lambda.

    From cables spread over the domain, some of them traced from the vacuum and so independent of the series.
    """
    axes = grid.axes
    # A rank-1 lattice: evenly spread, and the same everywhere.
    k = np.arange(grid.checks) + 0.5
    y, x = (2.0 * np.modf(k * ratio)[0] - 1.0 for ratio in (1.0 / grid.checks, 0.6180339887498949))
    cables = Cables.at(axes, n, y, x)
    sigma = axes.sigma(midpoints(grid.series_sigma))[::2]
    # Next to the cusp folds at a given drag are ill posed, and gamma is that of the cusp.
    sigma = sigma[np.abs(sigma) > NEAR_CUSP]
    traced = np.arange(grid.checks) % max(grid.checks // grid.traced_checks, 1) == 0
    log_cusp, log_gamma = np.empty(len(cables)), np.empty((len(cables), len(sigma)))
    log_cusp[traced], (log_gamma[traced], _) = _traced(cables.part(traced), sigma, bar)
    log_cusp[~traced], (log_gamma[~traced], _) = _predicted(cables.part(~traced), series, axes, sigma, bar)
    moved = log_cusp - series.log_cusp(y, x)
    wrong = np.zeros(len(cables))
    for j, value in enumerate(sigma):
        # The drag is what is asked for: an error of C* moves the place on the curve.
        there = np.sign(value) * np.sqrt(np.maximum(1.0 - (1.0 - value * value) * np.exp(moved), 0.0))
        wrong = np.maximum(wrong, np.abs(evaluate(series.gamma, axes.s(there), y, x) - log_gamma[:, j]))
    row, column = block_of(y, grid.error_blocks), block_of(x, grid.error_blocks)
    error, cusp_error = np.zeros((2, grid.error_blocks, grid.error_blocks))
    np.maximum.at(error, (row, column), MARGIN * wrong)
    np.maximum.at(cusp_error, (row, column), MARGIN * np.abs(moved))
    return _with_neighbours(error), _with_neighbours(cusp_error)


def _with_neighbours(error: Array) -> Array:
    """The worst of each block and of those around it: the few points in a block may all be far from its corners."""
    rows, columns = error.shape
    framed = np.pad(error, 1)
    return np.max([framed[i : i + rows, j : j + columns] for i in range(3) for j in range(3)], axis=0)


def _plain_tables(grid: DragGrid, series: list[Series]) -> xr.Dataset:
    """C*_n on (n, w_f, lam), folds on (n, C, w_f, lam)."""
    axes = grid.axes
    inside = (grid.lam >= axes.lam_min) & (grid.lam <= axes.lam_max)
    lam, w_f = grid.lam[inside], grid.w_f[grid.w_f <= axes.w_f_max]
    c, w, length = (column.ravel() for column in np.meshgrid(grid.C, w_f, lam, indexing="ij"))
    y, x = axes.y(w, length), axes.x(length)
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
            s = axes.s(side * sigma[good])
            values[good] = np.exp(evaluate(of_n.gamma, s, y[good], x[good]))
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
        text = f"relative error of {name} in each block of the coordinates, {MARGIN:g} times the worst between nodes"
        variables[f"drag_{name}_error"] = xr.Variable(blocks, values, {"long_name": text} | one)
    axes = grid.axes
    names = ("lam_min", "lam_max", "w_f_max", "sigma_min")
    return xr.Dataset(variables, attrs={name: getattr(axes, name) for name in names} | {"w_f_share": W_SHARE})
