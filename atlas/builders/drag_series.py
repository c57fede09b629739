"""Series through folds with drag: folds on Chebyshev points, series through them, and what these are wrong by.

The first stage traces curves of folds from the vacuum at a few cables; from the series through them Newton finds the
folds of all others, at a fraction of the cost. Where pairs end, from about sigma_min on, the drag is found for each of
some speeds instead, for it changes less and less with them.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from towatlas.builders.grids import DragGrid
from towatlas.kernels import status
from towatlas.numerics.chebyshev import at_points, coefficients, midpoints, nodes, transform
from towatlas.numerics.curves import Curve
from towatlas.numerics.errormap import stated_error, worst_of_blocks
from towatlas.solve.drag_folds import (
    at_speeds,
    crossing,
    fold_at,
    fold_at_speed,
    polish_cusps,
    solve_cusps,
    trace_folds,
)
from towatlas.system import nondense_rows
from towatlas.tables.drag_series import DragAxes

Array = NDArray[np.float64]

# Cables traced together: enough for all threads, few enough for the bar to move.
BATCH = 40
# A solution this far from what the series before predicts, in any logarithm, may be another: it is traced instead.
STRAYED = 0.3
# A last step of Newton after which its error, the square of it, is far below that of the series.
LAST_STEP = 1e-6
VACUUM = 1e-12
NEAR_CUSP = 0.05


@dataclass(frozen=True)
class Series:
    """Chebyshev series of one n.

    Attributes
    ----------
    gamma, r_f : ndarray, shape (sigma, w_f, lam)
        Coefficients of log gamma and log r_f.
    C_cusp : ndarray, shape (w_f, lam)
        Those of log C*.
    C_by_speed, r_f_by_speed : ndarray, shape (speed, w_f, lam)
        Those of log C and log r_f where pairs end.
    """

    gamma: Array
    r_f: Array
    C_cusp: Array
    C_by_speed: Array
    r_f_by_speed: Array

    def guess(self, at_sigma: float, y: Array, x: Array) -> Array:
        """Folds at one sigma.

        Parameters
        ----------
        at_sigma : float
            Coordinate of sigma, -1 to 1.
        y, x : ndarray, shape (points,)
            Coordinates of w_f and lambda, -1 to 1.

        Returns
        -------
        ndarray, shape (2, points)
            log r, log gamma.
        """
        s = np.full(len(x), at_sigma)
        log_gamma = at_points(self.gamma, s, y, x)
        return np.stack([at_points(self.r_f, s, y, x) + 2.0 * log_gamma, log_gamma])

    def guess_by_speed(self, axes: DragAxes, log_gamma: Array, y: Array, x: Array) -> Array:
        """Folds at given speeds, where pairs end.

        Parameters
        ----------
        axes : DragAxes
        log_gamma : ndarray, shape (points, speeds)
        y, x : ndarray, shape (points,)
            Coordinates of w_f and lambda, -1 to 1.

        Returns
        -------
        ndarray, shape (points, speeds, 2)
            log r, log C.
        """
        v = axes.speeds(self.gamma, y, x).coordinate(log_gamma)
        count = v.shape[1]
        at = v.ravel(), np.repeat(y, count), np.repeat(x, count)
        log_r_f, log_c = (at_points(series, *at).reshape(v.shape) for series in (self.r_f_by_speed, self.C_by_speed))
        return np.stack([log_r_f + 2.0 * log_gamma, log_c], axis=2)

    def log_cusp(self, y: Array, x: Array) -> Array:
        """Drag constants at the cusp.

        Parameters
        ----------
        y, x : ndarray, shape (points,)
            Coordinates of w_f and lambda, -1 to 1.

        Returns
        -------
        ndarray, shape (points,)
            log C*.
        """
        return at_points(self.C_cusp[None], np.zeros(len(x)), y, x)


@dataclass(frozen=True)
class Cables:
    """Cables of one n.

    Attributes
    ----------
    n : int
        Number of the transition, >= 1.
    y, x : ndarray, shape (cables,)
        Coordinates of w_f and lambda, -1 to 1.
    w_f, lam : ndarray, shape (cables,)
        Fish weight, >= 0, and cable length, > 0 [-].
    """

    n: int
    y: Array
    x: Array
    w_f: Array
    lam: Array

    @classmethod
    def at(cls, axes: DragAxes, n: int, y: Array, x: Array) -> "Cables":
        """Cables at coordinates.

        Parameters
        ----------
        axes : DragAxes
        n : int
        y, x : ndarray, shape (cables,)
            -1 to 1.

        Returns
        -------
        Cables
        """
        lam = axes.lam.value(x)
        return cls(n, y, x, axes.w_f(lam).value(y), lam)

    @classmethod
    def grid(cls, axes: DragAxes, n: int, y: Array, x: Array) -> "Cables":
        """Cables on the product of two axes, y first.

        Parameters
        ----------
        axes : DragAxes
        n : int
        y, x : ndarray
            -1 to 1.

        Returns
        -------
        Cables
        """
        y, x = (column.ravel() for column in np.meshgrid(y, x, indexing="ij"))
        return cls.at(axes, n, y, x)

    def part(self, which: NDArray[Any]) -> "Cables":
        """Some of them.

        Parameters
        ----------
        which : ndarray of int or bool
            Rows.

        Returns
        -------
        Cables
        """
        return Cables(self.n, *(column[which] for column in (self.y, self.x, self.w_f, self.lam)))

    def __len__(self) -> int:
        return len(self.x)


def _curves(cables: Cables, bar: tqdm | None = None) -> tuple[list[Curve], NDArray[np.int64]]:
    """Curves of folds, from the vacuum on, and their statuses."""
    curves: list[Curve] = []
    statuses = []
    for first in range(0, len(cables), BATCH):
        part = cables.part(np.arange(first, min(first + BATCH, len(cables))))
        some, codes = trace_folds(lam=part.lam, w_f=part.w_f, n=np.full(len(part), part.n))
        curves += some
        statuses.append(codes)
        if bar is not None:
            bar.update(len(part))
    return curves, np.concatenate(statuses)


def _traced(cables: Cables, sigma: Array, bar: tqdm) -> tuple[Array, Array, list[Curve]]:
    """log C*, shape (cables,), log gamma and log r_f of folds, shape (2, cables, sigma), from the vacuum on, and the
    curves of folds."""
    curves, statuses = _curves(cables, bar)
    cusps, codes = solve_cusps(curves, statuses, lam=cables.lam, w_f=cables.w_f)
    if (codes != status.OK).any():
        k = int(np.flatnonzero(codes != status.OK)[0])
        raise ArithmeticError(
            f"n = {cables.n}, lam = {cables.lam[k]:g}, w_f = {cables.w_f[k]:g}: {status.SENTENCES[int(codes[k])]}"
        )
    log_c = _log_drag(cusps[:, 2], sigma)
    guess = np.full((len(cables), len(sigma), 2), np.nan)
    for row, curve in enumerate(curves):
        for k, value in enumerate(sigma):
            if (found := crossing(curve, log_c[row, k], "appears" if value > 0.0 else "ends")) is not None:
                guess[row, k] = found[:2]
    values, solved = _folds(cables, guess, log_c)
    if not solved.all():
        k, j = (int(place[0]) for place in np.nonzero(~solved))
        raise ArithmeticError(
            f"n = {cables.n}, lam = {cables.lam[k]:g}, w_f = {cables.w_f[k]:g}: "
            f"the fold at sigma = {sigma[j]:.3g} was not solved"
        )
    return cusps[:, 2], values, curves


def _predicted(cables: Cables, series: Series, axes: DragAxes, sigma: Array, bar: tqdm) -> tuple[Array, Array]:
    """The same by Newton from what a series with fewer nodes says; cables for which that fails are traced."""
    guess = series.guess(axes.sigma.coordinate(np.zeros(1))[0], cables.y, cables.x)
    start = np.stack([*guess, series.log_cusp(cables.y, cables.x)], axis=1)
    cusps, codes = polish_cusps(start, lam=cables.lam, w_f=cables.w_f)
    good = (codes == status.OK) & (np.abs(cusps - start).max(axis=1) < STRAYED)
    log_c = _log_drag(cusps[:, 2], sigma)
    folds = np.stack([series.guess(s, cables.y, cables.x).T for s in axes.sigma.coordinate(sigma)], axis=1)
    folds[~good] = np.nan
    values, solved = _folds(cables, folds, log_c)
    strayed = np.abs(values[0] - folds[:, :, 1]).max(axis=1) > STRAYED
    again = np.flatnonzero(~good | ~solved.all(axis=1) | strayed)
    bar.update(len(cables) - len(again))
    log_cusp = cusps[:, 2]
    if len(again):
        log_cusp[again], values[:, again], _ = _traced(cables.part(again), sigma, bar)
    return log_cusp, values


def _log_drag(log_cusp: Array, sigma: Array) -> Array:
    """log C at C = C* (1 - sigma^2), shape (cables, sigma); the vacuum is a drag too faint to be seen."""
    with np.errstate(divide="ignore"):
        return np.maximum(log_cusp[:, None] + np.log1p(-(np.minimum(sigma, 1.0) ** 2)), np.log(VACUUM))


def _folds(cables: Cables, guess: Array, log_c: Array) -> tuple[Array, NDArray[np.bool_]]:
    """log gamma and log r_f, shape (2, cables, sigma), from guesses of log r and log gamma; and which are solved."""
    count = log_c.shape[1]
    systems = nondense_rows(lam=np.repeat(cables.lam, count), w_f=np.repeat(cables.w_f, count), C=np.exp(log_c.ravel()))
    z, _, codes = fold_at(guess.reshape(-1, 2), systems, settled_at=LAST_STEP)
    z = z.reshape(*log_c.shape, 2)
    return np.stack([z[:, :, 1], z[:, :, 0] - 2.0 * z[:, :, 1]]), (codes == status.OK).reshape(log_c.shape)


def _by_speed(cables: Cables, guess: Array, log_gamma: Array) -> Array:
    """log C and log r_f where pairs end at given speeds, shape (2, cables, speeds), from guesses of log r and log C.

    Cables of which one is not found, or not near its guess, are traced from the vacuum.
    """
    count = log_gamma.shape[1]
    long = {"lam": np.repeat(cables.lam, count), "w_f": np.repeat(cables.w_f, count)}
    z, solved = fold_at_speed(guess.reshape(-1, 2), log_gamma.ravel(), **long)
    z, solved = z.reshape(guess.shape), solved.reshape(log_gamma.shape)
    again = np.flatnonzero((~solved | (np.abs(z - guess).max(axis=2) > STRAYED)).any(axis=1))
    if len(again):
        curves, _ = _curves(cables.part(again))
        traced = np.stack([at_speeds(curve, log_gamma[k])[:, [0, 2]] for k, curve in zip(again, curves, strict=True)])
        rows = (again[:, None] * count + np.arange(count)).ravel()
        found, well = fold_at_speed(
            traced.reshape(-1, 2), log_gamma.ravel()[rows], **{name: column[rows] for name, column in long.items()}
        )
        if not well.all():
            k, j = divmod(int(rows[np.flatnonzero(~well)[0]]), count)
            raise ArithmeticError(
                f"n = {cables.n}, lam = {cables.lam[k]:g}, w_f = {cables.w_f[k]:g}: "
                f"no end of the pair was found at gamma = {np.exp(log_gamma[k, j]):.6g}"
            )
        z[again] = found.reshape(len(again), count, 2)
    return np.stack([z[:, :, 1], z[:, :, 0] - 2.0 * log_gamma])


def fit_series(grid: DragGrid, n: int, bar: tqdm) -> Series:
    """Series of one n: the first stage traced from the vacuum, each other predicted by the one before it."""
    axes = grid.axes
    sigma, v = axes.sigma.value(nodes(grid.series_sigma)), nodes(grid.series_speed)
    traced, *refined = (Cables.grid(axes, n, *(nodes(count) for count in stage)) for stage in grid.stages)
    log_cusp, values, curves = _traced(traced, sigma, bar)
    series = _through(log_cusp, values, grid.stages[0])
    log_gamma = axes.speeds(series.gamma, traced.y, traced.x).log_gamma(np.tile(v, (len(traced), 1)))
    guess = np.stack([at_speeds(curve, speeds)[:, [0, 2]] for curve, speeds in zip(curves, log_gamma, strict=True)])
    series = _with_speeds(series, _by_speed(traced, guess, log_gamma), grid.stages[0])
    for cables, shape in zip(refined, grid.stages[1:], strict=True):
        finer = _through(*_predicted(cables, series, axes, sigma, bar), shape)
        log_gamma = axes.speeds(finer.gamma, cables.y, cables.x).log_gamma(np.tile(v, (len(cables), 1)))
        guess = series.guess_by_speed(axes, log_gamma, cables.y, cables.x)
        series = _with_speeds(finer, _by_speed(cables, guess, log_gamma), shape)
    return series


def _through(log_cusp: Array, values: Array, shape: tuple[int, int]) -> Series:
    """Series through log C*, shape (cables,), and log gamma and log r_f, shape (2, cables, sigma), on nodes `shape`."""
    none = np.empty((0, *shape))
    gamma, r_f = _coefficients(values, shape)
    return Series(gamma, r_f, coefficients(log_cusp.reshape(shape)), none, none)


def _with_speeds(series: Series, values: Array, shape: tuple[int, int]) -> Series:
    """The same with those by speed, through log C and log r_f, shape (2, cables, speeds)."""
    log_c, log_r_f = _coefficients(values, shape)
    return replace(series, C_by_speed=log_c, r_f_by_speed=log_r_f)


def _coefficients(values: Array, shape: tuple[int, int]) -> Array:
    plane = coefficients(np.moveaxis(values.reshape(len(values), *shape, -1), -1, 1))
    return np.einsum("ks,fsji->fkji", transform(values.shape[-1]), plane, optimize=False)


def measure_errors(grid: DragGrid, n: int, series: Series, bar: tqdm) -> tuple[Array, ...]:
    """Relative errors of gamma at given C, of C*, and of C at given gamma, in blocks of w_f and lambda.

    From cables spread over the domain, some of them traced from the vacuum and so independent of the series.
    """
    axes = grid.axes
    # A rank-1 lattice: evenly spread, and the same everywhere.
    k = np.arange(grid.checks) + 0.5
    y, x = (2.0 * np.modf(k * ratio)[0] - 1.0 for ratio in (1.0 / grid.checks, 0.6180339887498949))
    cables = Cables.at(axes, n, y, x)
    sigma = axes.sigma.value(midpoints(grid.series_sigma))[::2]
    # Next to the cusp folds at a given drag are ill posed, and gamma is that of the cusp.
    sigma = sigma[np.abs(sigma) > NEAR_CUSP]
    traced = np.arange(grid.checks) % max(grid.checks // grid.traced_checks, 1) == 0
    log_cusp, log_gamma = np.empty(len(cables)), np.empty((len(cables), len(sigma)))
    log_cusp[traced], (log_gamma[traced], _), curves = _traced(cables.part(traced), sigma, bar)
    log_cusp[~traced], (log_gamma[~traced], _) = _predicted(cables.part(~traced), series, axes, sigma, bar)
    moved = log_cusp - series.log_cusp(y, x)
    wrong = np.zeros(len(cables))
    for j, value in enumerate(sigma):
        # The drag is what is asked for: an error of C* moves the place on the curve.
        there = np.sign(value) * np.sqrt(np.maximum(1.0 - (1.0 - value * value) * np.exp(moved), 0.0))
        wrong = np.maximum(wrong, np.abs(at_points(series.gamma, axes.sigma.coordinate(there), y, x) - log_gamma[:, j]))
    at = axes.speeds(series.gamma, y, x).log_gamma(np.tile(midpoints(grid.series_speed), (len(cables), 1)))
    guess = series.guess_by_speed(axes, at, y, x)
    said = guess[:, :, 1].copy()
    for row, curve in zip(np.flatnonzero(traced), curves, strict=True):
        guess[row] = at_speeds(curve, at[row])[:, [0, 2]]
    wrong_by_speed = np.abs(_by_speed(cables, guess, at)[0] - said).max(axis=1)
    return tuple(
        stated_error(worst_of_blocks(measured, y, x, grid.error_blocks))
        for measured in (wrong, np.abs(moved), wrong_by_speed)
    )
