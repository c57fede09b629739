"""Equilibria of a cable towed through a fluid, found from the fish up with one unknown, the radius of the fish."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_one, check_real
from towatlas.kernels import status
from towatlas.solve.drag_shots import Array, Integers, System, shoot, trace
from towatlas.solve.jets import jets_of

SLOPE = jets_of(1)
EPS = 2.0**-52

# The search. Points a decade at first; halvings of an interval at most; how well the interpolant of the tow point
# must predict the middle of an interval, in tow radii; an extremum of its radius this near to 1 is looked at closely.
PER_DECADE = 12
HALVINGS = 40
PREDICTED = 1e-3
NEAR_FOLD = 0.05
# Where the search begins: shots so near the axis that the radius at the tow point is proportional to that at the fish.
LINEAR = 1e-3
SMALLEST = 1e-18
TINY = 1e-300
# The fish is never farther out than a straight cable reaches.
BEYOND = 1.0 + 1e-9
# Steps in log C of the continuation from a vacuum, from a drag so small that it is one.
CONTINUATION_STEPS = 24
VACUUM = 1e-3
SAME_ROOT = 1e-7
# Steps this small, in log r, are the last: the square of them is rounding.
LAST_STEP = 1e-9
ROUNDS = 100
ROUNDINGS = 16.0


@dataclass(frozen=True)
class DragEquilibria:
    """Equilibria of one cable with drag, in rising order of the radius of the fish; arrays of shape (equilibria,).

    lam, w_f, gamma, C, m_f, C_f, w, C_t : the system. R_x0, R_y0, R_z0 : reaction at the tow point, which is at
    (1, 0, 0) and moves along y. x_f, y_f, z_f : position of the fish. r_f : its distance from the axis. lag : angle of
    the fish behind the tow point, -pi to pi [rad]. tension : at the tow point. nodes : sign changes of x along the
    cable. near_axis : which one has its fish nearest to the axis, the one that the median root of the vacuum becomes.
    error : estimated relative error of r_f. searched : what was searched; completeness is not proved.
    """

    lam: float
    w_f: float
    gamma: float
    C: float
    m_f: float
    C_f: float
    w: float
    C_t: float
    R_x0: Array
    R_y0: Array
    R_z0: Array
    x_f: Array
    y_f: Array
    z_f: Array
    r_f: Array
    lag: Array
    tension: Array
    nodes: Integers
    near_axis: NDArray[np.bool_]
    error: Array
    searched: str

    def __len__(self) -> int:
        return len(self.r_f)

    @property
    def system(self) -> System:
        """The cable and its medium."""
        return System(self.lam, self.w_f, self.m_f, self.C, self.C_f, self.w, self.C_t)


def check_system(lam: float, w_f: float, C: float, m_f: float | None, C_f: float, w: float, C_t: float) -> System:
    """A system of numbers in range, or ValueError."""
    weight = check_real("w", w)
    if weight.ndim or not -1.0 < weight <= 1.0:
        raise ValueError(f"w = (mu - rho A) / (mu + rho A) must be one number above -1 and at most 1, got {w!r}")
    lam, w_f = check_one("lam", lam), check_one("w_f", w_f, zero=True)
    m_f = w_f if m_f is None else check_one("m_f", m_f, zero=True)
    if weight <= 0.0 and w_f == m_f == 0.0:
        raise ValueError("a cable without weight (w <= 0) and without a fish has no shape to hang in; give it a fish")
    return System(
        lam=lam,
        w_f=w_f,
        m_f=m_f,
        C=check_one("C", C, zero=True),
        C_f=check_one("C_f", C_f, zero=True),
        w=float(weight),
        C_t=check_one("C_t", C_t, zero=True),
    )


def solve_drag_equilibria(system: System, gamma: float, vacuum_r_f: ArrayLike = ()) -> DragEquilibria:
    """Equilibria with drag; no checks.

    Parameters
    ----------
    system : System
    gamma : float
    vacuum_r_f : array_like
        Radii of the fish over the tow radius of the equilibria in a vacuum, to be continued to this drag.

    Raises
    ------
    ArithmeticError
        If a shot fails.
    """
    low, high = _range(system, gamma)
    points, values, shots = _sample(system, gamma, low, high)
    roots = _roots(system, gamma, points, values)
    continued = _continue(system, gamma, np.asarray(vacuum_r_f, float) * gamma**2)
    missed = [x for x in continued if not len(roots) or np.abs(roots - x).min() > SAME_ROOT]
    roots = np.sort(np.concatenate([roots, missed]))
    searched = (
        f"fish radius {np.exp(low) / gamma**2:.1e} to {np.exp(high) / gamma**2:.6g} tow radii, {shots} shots with "
        f"derivative, refined until each predicts its neighbours within {PREDICTED:g} tow radii"
    )
    if np.size(vacuum_r_f):
        searched += (
            f"; {len(continued)} of {np.size(vacuum_r_f)} vacuum equilibria lead here, "
            f"{len(missed)} of them to what the shots had missed"
        )
    return _collect(system, gamma, np.exp(roots), searched)


def raise_failures(ends_status: Integers, system: System, gamma: float) -> None:
    """ArithmeticError with the sentence of the first shot that failed, if any did."""
    bad = ends_status[ends_status != status.OK]
    if len(bad):
        raise ArithmeticError(f"{system}, gamma = {gamma:g}: {status.SENTENCES[int(bad[0])]}")


def _shoot_slopes(system: System, gamma: float, x: Array) -> Array:
    """Rows X, Y at the tow point over the tow radius and their slopes in x = log r; then log rho and its slope."""
    ends = shoot(np.exp(x), gamma, system.row(), SLOPE)
    raise_failures(ends.status, system, gamma)
    scale = gamma**-2
    return np.stack(
        [ends.X[:, 0] * scale, ends.Y[:, 0] * scale, ends.X[:, 1] * scale, ends.Y[:, 1] * scale, *ends.log_rho.T]
    )


def _range(system: System, gamma: float) -> tuple[float, float]:
    """Bounds of log r of the fish: from the linear limit to a straight cable."""
    high = np.log(gamma**2 * (1.0 + system.lam) * BEYOND)
    x = np.log(1e-6 * gamma**2)
    while True:
        log_rho, slope = _shoot_slopes(system, gamma, np.array([x]))[4:, 0]
        if (log_rho < np.log(LINEAR) and abs(slope - 1.0) < LINEAR) or x < np.log(SMALLEST * gamma**2):
            return float(x), float(high)
        x -= np.log(100.0)


def _hermite(a: Array, b: Array, width: Array, t: float) -> Array:
    """Tow point at the share t of intervals, from values and slopes at their ends; shape (2, intervals)."""
    s = 1.0 - t
    return s * s * (1.0 + 2.0 * t) * a[:2] + t * t * (1.0 + 2.0 * s) * b[:2] + s * t * width * (s * a[2:4] - t * b[2:4])


def _sample(system: System, gamma: float, low: float, high: float) -> tuple[Array, Array, int]:
    """Sample log r until cubics through the samples tell the tow point wherever it may lie at the tow radius."""
    x = np.linspace(low, high, int(np.ceil((high - low) / np.log(10.0) * PER_DECADE)) + 1)
    values = _shoot_slopes(system, gamma, x)
    active = np.ones(len(x) - 1, bool)
    for _ in range(HALVINGS):
        i = np.flatnonzero(active)
        if not len(i):
            break
        middle = 0.5 * (x[i] + x[i + 1])
        new = _shoot_slopes(system, gamma, middle)
        width = x[i + 1] - x[i]
        a, b = values[:, i], values[:, i + 1]
        wrong = np.hypot(*(_hermite(a, b, width, 0.5) - new[:2]))
        nearest = np.full(len(i), np.inf)
        for t in np.linspace(0.0, 1.0, 17):
            nearest = np.minimum(nearest, np.abs(np.hypot(*_hermite(a, b, width, t)) - 1.0))
        # Far from the tow radius by more than twice what the cubic is wrong, or right.
        split = (wrong > PREDICTED) & (nearest < 2.0 * wrong)
        order = np.argsort(np.concatenate([x, middle]), kind="stable")
        again = np.zeros(len(x), bool)
        again[i] = split
        active = np.concatenate([again, split])[order][:-1]
        x = np.concatenate([x, middle])[order]
        values = np.concatenate([values, new], axis=1)[:, order]
    return x, values, len(x)


def _roots(system: System, gamma: float, x: Array, values: Array) -> Array:
    """All roots of log rho between the samples, extrema found first so that they part the pairs."""
    extrema, heights = _extrema(x, values)
    close = extrema[np.abs(np.log(heights)) < NEAR_FOLD]
    between = np.concatenate([extrema, _polish_extrema(system, gamma, close)])
    at, height = np.concatenate([x, between]), values[4]
    if len(between):
        height = np.concatenate([height, _shoot_slopes(system, gamma, between)[4]])
    order = np.argsort(at)
    at, height = at[order], height[order]
    i = np.flatnonzero((height[:-1] < 0.0) != (height[1:] < 0.0))
    return _solve(lambda x: _shoot_slopes(system, gamma, x)[4:], at[i], at[i + 1])


def _extrema(x: Array, values: Array) -> tuple[Array, Array]:
    """Where the cubics between the samples have an extremum of the radius, and the radius there."""
    found = []
    for k in range(len(x) - 1):
        width = x[k + 1] - x[k]
        a, b = values[:4, k], values[:4, k + 1]
        radius2 = np.zeros(7)
        for axis in range(2):
            da, db = width * a[2 + axis], width * b[2 + axis]
            rise = b[axis] - a[axis]
            cubic = np.array([da + db - 2.0 * rise, 3.0 * rise - 2.0 * da - db, da, a[axis]])
            radius2 += np.convolve(cubic, cubic)
        slopes = np.polyder(radius2)
        if (np.diff(np.sign(np.polyval(slopes, np.linspace(0.0, 1.0, 9)))) != 0.0).any():
            for t in np.roots(slopes):
                if abs(t.imag) < 1e-9 and 0.0 < t.real < 1.0:
                    # A sum of squares that may vanish, but for rounding.
                    height = max(float(np.polyval(radius2, t.real)), TINY)
                    found.append((x[k] + width * t.real, np.sqrt(height)))
    table = np.array(found).reshape(-1, 2)
    return table[:, 0], table[:, 1]


def _polish_extrema(system: System, gamma: float, x: Array) -> Array:
    """Extrema of log rho by Newton, those that stay where they were."""
    jets = jets_of(2)
    start = x.copy()
    for _ in range(8 if len(x) else 0):
        ends = shoot(np.exp(x), gamma, system.row(), jets)
        raise_failures(ends.status, system, gamma)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -ends.log_rho[:, 1] / (2.0 * ends.log_rho[:, 2])
        x = x + np.where(np.isfinite(step), np.clip(step, -0.1, 0.1), 0.0)
    return x[np.abs(x - start) < 0.2]


def _solve(function: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """Roots of functions, each given with its slope, in brackets: Newton, halving where it leaves them."""
    low, high = low.copy(), high.copy()
    rising = function(high)[0] > 0.0 if len(high) else np.zeros(0, bool)
    x = 0.5 * (low + high)
    active = np.ones(len(x), bool)
    for round_ in range(ROUNDS):
        i = np.flatnonzero(active)
        if not len(i):
            break
        value, slope = function(x[i])
        above = (value > 0.0) == rising[i]
        high[i[above]], low[i[~above]] = x[i[above]], x[i[~above]]
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -value / slope
        trial = x[i] + step
        inside = (trial >= low[i]) & (trial <= high[i]) & (round_ % 8 != 7)
        x[i] = np.where(inside, trial, 0.5 * (low[i] + high[i]))
        done = inside & (np.abs(step) <= LAST_STEP) | (high[i] - low[i] <= 4.0 * EPS * np.abs(x[i]))
        active[i[done]] = False
    return x


def _continue(system: System, gamma: float, r: Array) -> Array:
    """Roots in log r that the equilibria in a vacuum become as the drag rises to its value; fewer if some meet."""
    x = np.log(r)
    jets = jets_of(1, drag=True)
    along_r, along_drag = jets.at(1, 0, 0), jets.at(0, 0, 1)
    row = system.row()
    drags = row[[3, 4, 6]]
    previous, drift = VACUUM, np.zeros(len(x))
    for share in np.geomspace(VACUUM, 1.0, CONTINUATION_STEPS):
        if not len(x):
            break
        row[[3, 4, 6]] = share * drags
        x = x + drift * np.log(share / previous)
        step = np.full(len(x), np.inf)
        for _ in range(6):
            ends = shoot(np.exp(x), gamma, row, jets)
            raise_failures(ends.status, system, gamma)
            with np.errstate(divide="ignore", invalid="ignore"):
                step = -ends.log_rho[:, 0] / ends.log_rho[:, along_r]
                drift = -ends.log_rho[:, along_drag] / ends.log_rho[:, along_r]
            x = x + np.where(np.abs(step) < 0.3, step, np.nan)
            keep = np.isfinite(x)
            x, step, drift = x[keep], step[keep], drift[keep]
            if not len(x):
                break
        kept = np.abs(step) < LAST_STEP
        x, drift = x[kept], drift[kept]
        previous = share
    order = np.argsort(x)
    x = x[order]
    return x[np.concatenate([[True], np.diff(x) > SAME_ROOT])] if len(x) else x


def _collect(system: System, gamma: float, r: Array, searched: str) -> DragEquilibria:
    """Quantities of the equilibria at fish radii r, turned so that the tow point is at (1, 0, 0)."""
    gamma2 = gamma**2
    ends = shoot(r, gamma, system.row(), SLOPE)
    angle = np.arctan2(ends.Y[:, 0], ends.X[:, 0])
    cos, sin = np.cos(angle), np.sin(angle)
    fx, fy = ends.FX[:, 0] / gamma2, ends.FY[:, 0] / gamma2
    amplitude = np.hypot(1.0, np.hypot(fx, fy) / gamma / np.sqrt(ends.T[:, 0] / gamma2))
    rounding = ROUNDINGS * EPS * amplitude * np.sqrt(1.0 + ends.steps)
    return DragEquilibria(
        **{name: getattr(system, name) for name in ("lam", "w_f", "C", "m_f", "C_f", "w", "C_t")},
        gamma=gamma,
        R_x0=fx * cos + fy * sin,
        R_y0=fy * cos - fx * sin,
        R_z0=ends.FZ[:, 0] / gamma2,
        x_f=r / gamma2 * cos,
        y_f=-r / gamma2 * sin,
        z_f=ends.H[:, 0] / gamma2,
        r_f=r / gamma2,
        lag=angle,
        tension=ends.T[:, 0] / gamma2,
        nodes=np.array([_nodes(system, gamma, *pair) for pair in zip(r, angle, strict=True)], np.int64),
        near_axis=np.arange(len(r)) == 0,
        error=rounding / np.abs(ends.log_rho[:, 1]),
        searched=searched,
    )


def _nodes(system: System, gamma: float, r: float, angle: float) -> int:
    """Sign changes of x between the fish and the tow point, on cubics through the steps of the shot."""
    rows, _, _ = trace(r, gamma, system, np.empty(0))
    u, big_x, big_y, _, fx, fy, fz = rows.T
    x = big_x * np.cos(angle) + big_y * np.sin(angle)
    slope = -(fx * np.cos(angle) + fy * np.sin(angle)) / np.sqrt(fx * fx + fy * fy + fz * fz)
    # From the fish to the first step nothing turns over.
    x = np.concatenate([[r * np.cos(angle)], x])
    slope = np.concatenate([[(x[1] - x[0]) / u[0]], slope])
    u = np.concatenate([[0.0], u])
    width = np.diff(u)
    t = np.linspace(0.0, 1.0, 9)[1:, None]
    s = 1.0 - t
    inside = (
        s * s * (1.0 + 2.0 * t) * x[:-1]
        + t * t * (1.0 + 2.0 * s) * x[1:]
        + s * t * width * (s * slope[:-1] - t * slope[1:])
    )
    line = np.concatenate([x[:1], inside.T.ravel()])
    return int(np.sum((line[:-1] < 0.0) != (line[1:] < 0.0)))
