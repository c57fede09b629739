"""Equilibria of a cable towed through a fluid, found from the fish up with one unknown, the radius of the fish."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.kernels import status
from towatlas.kernels.system import C_F, C_T, C
from towatlas.numerics.hermite import cubic, cubic_coefficients
from towatlas.numerics.rows import EPS, bracket, newton
from towatlas.results import Equilibria
from towatlas.solve.drag_shots import Array, Integers, shoot, trace
from towatlas.solve.jets import jets_of
from towatlas.system import System

SLOPE = jets_of(1)

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
# Newton steps of the continuation, and how long one may be; those on an extremum, and how far it may lie from where the
# cubics have it.
CORRECTIONS, LONGEST_CORRECTION = 6, 0.3
POLISHING_ROUNDS, STAYS = 12, 0.2
# Steps this small, in log r, are the last: the square of them is rounding.
LAST_STEP = 1e-9
ROUNDINGS = 16.0


def solve_drag_equilibria(
    system: System, gamma: float, vacuum_r_f: ArrayLike = (), vacuum_branch: Sequence[str] | NDArray[np.str_] = ()
) -> Equilibria:
    """Equilibria with drag, found from the fish up; no checks.

    Parameters
    ----------
    system : System
    gamma : float
        Speed Omega sqrt(R/g) [-], > 0.
    vacuum_r_f : array_like, shape (vacuum equilibria,)
        Distances of the fish from the axis over tow radius of the equilibria in a vacuum, to be continued to this drag.
    vacuum_branch : sequence of str
        What those are called.

    Returns
    -------
    Equilibria

    Raises
    ------
    ArithmeticError
        If a shot fails.
    """
    low, high = _range(system, gamma)
    points, values, shots = _sample(system, gamma, low, high)
    roots = _roots(system, gamma, points, values)
    continued, origin = _continue(system, gamma, np.asarray(vacuum_r_f, float) * gamma**2)
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
    searched += "; that there are no others is not proved"
    return _collect(system, gamma, np.exp(roots), _named(roots, continued, origin, vacuum_branch), searched)


def _named(
    roots: Array, continued: Array, origin: Integers, vacuum_branch: Sequence[str] | NDArray[np.str_]
) -> NDArray[np.str_]:
    """What the roots are called: after the equilibrium of the vacuum that leads to them, or by their number."""
    names, others = [], 0
    for x in roots:
        at = np.flatnonzero(np.abs(continued - x) <= SAME_ROOT)
        others += not len(at)
        names.append(str(vacuum_branch[origin[at[0]]]) if len(at) else f"drag {others}")
    return np.array(names, np.str_)


def raise_failures(ends_status: Integers, system: System, gamma: float) -> None:
    """Refuse shots that failed.

    Parameters
    ----------
    ends_status : ndarray of int, shape (shots,)
        Codes of `towatlas.kernels.status`.
    system : System
    gamma : float
        What was shot, for the message.

    Raises
    ------
    ArithmeticError
        With the sentence of the first shot that failed, if any did.
    """
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


def _between(a: Array, b: Array, width: Array, t: float) -> Array:
    """Tow point at the share t of intervals, from values and slopes at their ends; shape (2, intervals)."""
    return cubic(a[:2], b[:2], a[2:4], b[2:4], width, t)


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
        wrong = np.hypot(*(_between(a, b, width, 0.5) - new[:2]))
        nearest = np.full(len(i), np.inf)
        for t in np.linspace(0.0, 1.0, 17):
            nearest = np.minimum(nearest, np.abs(np.hypot(*_between(a, b, width, t)) - 1.0))
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
    k = np.flatnonzero((height[:-1] < 0.0) != (height[1:] < 0.0))
    rising = np.where(height[k + 1] > height[k], 1.0, -1.0)

    def radius(x: Array, i: Integers) -> tuple[Array, Array]:
        value, slope = _shoot_slopes(system, gamma, x)[4:] * rising[i]
        return value, slope

    found, solved = bracket(radius, at[k], at[k + 1], last_step=LAST_STEP)
    if not solved.all():
        raise ArithmeticError(f"{system}, gamma = {gamma:g}: {status.SENTENCES[status.NOT_CONVERGED]}")
    return found


def _extrema(x: Array, values: Array) -> tuple[Array, Array]:
    """Where the cubics between the samples have an extremum of the radius, and the radius there."""
    found = []
    for k in range(len(x) - 1):
        width = x[k + 1] - x[k]
        a, b = values[:4, k], values[:4, k + 1]
        radius2 = np.zeros(7)
        for axis in range(2):
            terms = cubic_coefficients(a[axis], b[axis], a[2 + axis], b[2 + axis], width)
            radius2 += np.convolve(terms, terms)
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
    """Extrema of log rho by Newton, those that stay near where they were looked for."""
    jets = jets_of(2)

    def slopes(z: Array, i: Integers) -> tuple[Array, Array, NDArray[np.bool_]]:
        ends = shoot(np.exp(z[:, 0]), gamma, system.row(), jets)
        raise_failures(ends.status, system, gamma)
        return ends.log_rho[:, 1:2], 2.0 * ends.log_rho[:, 2:3, None], np.ones(len(z), bool)

    found, _, _ = newton(
        slopes, x[:, None], rounds=POLISHING_ROUNDS, longest=STAYS, settled=lambda step, size, last: size < LAST_STEP
    )
    return found[np.abs(found[:, 0] - x) < STAYS, 0]


def _continue(system: System, gamma: float, r: Array) -> tuple[Array, Integers]:
    """Roots in log r that the equilibria in a vacuum become as the drag rises to its value, and which become them.

    In rising order; fewer than there are in the vacuum if some meet.
    """
    jets = jets_of(1, drag=True)
    along_r, along_drag = jets.at(1, 0, 0), jets.at(0, 0, 1)
    row = system.row()
    every = [C, C_F, C_T]
    drags = row[every]
    x, drift, origin = np.log(r), np.zeros(len(r)), np.arange(len(r))
    previous = VACUUM

    def radius(z: Array, i: Integers) -> tuple[Array, Array, NDArray[np.bool_]]:
        ends = shoot(np.exp(z[:, 0]), gamma, row, jets)
        raise_failures(ends.status, system, gamma)
        slope = ends.log_rho[:, along_r]
        with np.errstate(divide="ignore", invalid="ignore"):
            drift[i] = -ends.log_rho[:, along_drag] / slope
        return ends.log_rho[:, :1], slope[:, None, None], np.ones(len(z), bool)

    for share in np.geomspace(VACUUM, 1.0, CONTINUATION_STEPS):
        row[every] = share * drags
        guess = x + drift * np.log(share / previous)
        found, _, solved = newton(
            radius,
            guess[:, None],
            rounds=CORRECTIONS,
            longest=LONGEST_CORRECTION,
            settled=lambda step, size, last: size < LAST_STEP,
        )
        x, drift, origin = found[solved, 0], drift[solved], origin[solved]
        previous = share
    order = np.argsort(x)
    x, origin = x[order], origin[order]
    apart = np.concatenate([np.ones(min(len(x), 1), bool), np.diff(x) > SAME_ROOT])
    return x[apart], origin[apart]


def _collect(system: System, gamma: float, r: Array, branch: NDArray[np.str_], searched: str) -> Equilibria:
    """Quantities of the equilibria at fish radii r, turned so that the tow point is at (1, 0, 0)."""
    gamma2 = gamma**2
    ends = shoot(r, gamma, system.row(), SLOPE)
    angle = np.arctan2(ends.Y[:, 0], ends.X[:, 0])
    cos, sin = np.cos(angle), np.sin(angle)
    fx, fy = ends.FX[:, 0] / gamma2, ends.FY[:, 0] / gamma2
    amplitude = np.hypot(1.0, np.hypot(fx, fy) / gamma / np.sqrt(ends.T[:, 0] / gamma2))
    rounding = ROUNDINGS * EPS * amplitude * np.sqrt(1.0 + ends.steps)
    columns = {
        "R_x0": fx * cos + fy * sin,
        "R_y0": fy * cos - fx * sin,
        "R_z0": ends.FZ[:, 0] / gamma2,
        "x_f": r / gamma2 * cos,
        "y_f": -r / gamma2 * sin,
        "z_f": ends.H[:, 0] / gamma2,
        "r_f": r / gamma2,
        "lag": angle,
        "tension": ends.T[:, 0] / gamma2,
        "nodes": np.array([_nodes(system, gamma, *pair) for pair in zip(r, angle, strict=True)], np.int64),
        "error": rounding / np.abs(ends.log_rho[:, 1]),
        "branch": branch,
        "boundary_error": np.full(len(r), np.nan),
    }
    order = np.argsort(columns["R_x0"])
    return Equilibria(
        **{name: column[order] for name, column in columns.items()},
        system=system,
        gamma=gamma,
        # From the axis outwards is the order that they come in.
        expected=int(np.argmin(order)) if len(r) else -1,
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
    inside = cubic(x[:-1], x[1:], slope[:-1], slope[1:], width, np.linspace(0.0, 1.0, 9)[1:, None])
    line = np.concatenate([x[:1], inside.T.ravel()])
    return int(np.sum((line[:-1] < 0.0) != (line[1:] < 0.0)))
