"""Folds with drag: where the n-th pair of equilibria appears, where it ends, and the cusp above which it never exists.

At a fold the radius of the tow point, as a function of that of the fish, has an extremum at the tow radius itself:
log rho = 0 and its slope in log r_f is 0. From the n-th fold of the vacuum a curve of folds sets out in (r_f, gamma,
C). Along it C rises to the cusp, C*_n, where the second slope vanishes too, and falls again. Before the cusp the
extremum is a maximum: as gamma passes it, two equilibria appear. After it, a minimum: the outer of the two meets the
next equilibrium outside and both are gone, so that a cable that sat there has to jump. A pair that meets no minimum up
to GAMMA_MAX does not end: such are all pairs of the vacuum. Towards high speed C settles, for weight no longer matters;
where it comes to that from below, the pair of a drag in between ends and appears again.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_order, check_positive_finite, check_real
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.labelled import takes_frames
from towatlas.limits import unchecked_excess_length
from towatlas.numerics.curves import Curve, Steps, follow
from towatlas.numerics.hermite import cubic
from towatlas.numerics.rows import EPS, newton
from towatlas.results import SIDES, DragFolds
from towatlas.solve.critical import solve_rows
from towatlas.solve.cusps import cusp_equations, cusp_errors
from towatlas.solve.folds import folds_in_speed
from towatlas.solve.jets import jets_of
from towatlas.solve.shots import Array, Integers, direction_of, shoot
from towatlas.system import System, nondense_rows

FOLD = jets_of(2, gamma=True, parameter=True)
AT_DRAG = jets_of(2, gamma=True)
AT_SPEED = jets_of(2, parameter=True)

# The number that the parameter moves, by its logarithm.
DRAG = ("C",)
GAMMA_MAX = 50.0
# Drag moves the speed of a pair down to no less than this share of that in a vacuum, as far as was seen.
SLOWER = 0.2
# Drag so small that the vacuum's fold is a first guess of it.
FAINT = 1e-6
# Along a curve, in the arclength of (log r, log gamma, log C).
STEPS = Steps(first=2.0, longest=2.0, shortest=1e-4)
ROUNDS = 12
ROUNDINGS = 64.0
SETTLED = 1e-11
# Points between two of a curve at which its cubic is looked at.
FINE = 64
# Distances in log gamma of the speeds between which the least drag is found, one after the other.
LEAST_SPREAD = (0.05, 0.02, 0.005)

Booleans = NDArray[np.bool_]


def trace_folds(*, lam: Array, w_f: Array, n: Integers) -> tuple[list[Curve], Integers]:
    """Curves of folds of the rows given, from the vacuum over the cusp to the highest speed or the next cusp.

    Parameters
    ----------
    lam, w_f : ndarray, shape (rows,)
        Cable length and fish weight [-]; no checks.
    n : ndarray of int, shape (rows,)
        Number of the transition.

    Returns
    -------
    list of Curve
        Unknowns log r, log gamma, log C; monitored is the second slope of log rho, zero at the cusp.
    ndarray of int, shape (rows,)
        Statuses.
    """
    vacuum = solve_rows(lam=lam, w_f=w_f, n=n, excess=unchecked_excess_length(lam=lam, w_f=w_f, n=n))
    codes = vacuum["status"].astype(np.int64)
    with np.errstate(invalid="ignore"):
        gamma = vacuum["gamma"]
        start = np.log(np.stack([np.abs(vacuum["x_f"]) * gamma**2, gamma, np.full(len(n), FAINT)], axis=1))
    turned = np.zeros(len(n), bool)
    densest = np.full(len(n), -np.inf)

    def equations(z: Array, i: Integers) -> tuple[Array, Array, Array, Booleans]:
        systems = nondense_rows(lam=lam[i], w_f=w_f[i], C=np.exp(z[:, 2]))
        ends = shoot(np.exp(z[:, 0]), np.exp(z[:, 1]), systems, FOLD, directions=direction_of(DRAG, systems))
        jet, at = ends.log_rho, FOLD.at
        second = 2.0 * jet[:, at(2, 0, 0)]
        value = np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1)
        along_value = np.stack([value[:, 1], jet[:, at(0, 1, 0)], jet[:, at(0, 0, 1)]], axis=1)
        along_slope = np.stack([second, jet[:, at(1, 1, 0)], jet[:, at(1, 0, 1)]], axis=1)
        sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1)
        return value, np.stack([along_value, along_slope], axis=1), second[:, None], sound

    def stop(z: Array, direction: Array, second: Array, i: Integers) -> Booleans:
        turned[i] |= second[:, 0] > 0.0
        densest[i] = np.maximum(densest[i], z[:, 2])
        # A pair that comes again does so at less drag than at the cusp.
        left = (second[:, 0] < 0.0) | (direction[:, 2] > 0.0) & (second[:, 0] > 1.0) & (z[:, 2] >= densest[i])
        return (z[:, 1] > np.log(GAMMA_MAX)) | turned[i] & left

    curves = follow(equations, start, np.tile([0.0, 0.0, 1.0], (len(n), 1)), stop, STEPS)
    complete = np.array([curve.complete for curve in curves], bool)
    codes[(codes == status.OK) & ~complete & ~turned] = status.NOT_CONVERGED
    return curves, codes


def solve_cusps(curves: list[Curve], codes: Integers, *, lam: Array, w_f: Array) -> tuple[Array, Integers]:
    """Cusps of curves that were traced.

    Parameters
    ----------
    curves : list of Curve
        From `trace_folds`.
    codes : ndarray of int, shape (rows,)
        Their statuses.
    lam, w_f : ndarray, shape (rows,)
        Cable length and fish weight [-].

    Returns
    -------
    ndarray, shape (rows, 3)
        log r, log gamma, log C.
    ndarray of int, shape (rows,)
        Statuses; NO_CUSP for a curve along which C rises on.
    """
    z, codes = np.full((len(curves), 3), np.nan), codes.copy()
    for row, curve in enumerate(curves):
        if codes[row] == status.OK:
            k = curve.event()
            codes[row] = status.NO_CUSP if k < 0 else status.NOT_CONVERGED
            if k >= 0:
                z[row] = curve.at_event(k)
    solved, solved_codes = polish_cusps(z, lam=lam, w_f=w_f)
    return solved, np.where(np.isfinite(z).all(axis=1), solved_codes, codes)


def polish_cusps(z: Array, *, lam: Array, w_f: Array) -> tuple[Array, Integers]:
    """Cusps near guesses, where log rho and its first two slopes vanish, by Newton.

    Parameters
    ----------
    z : ndarray, shape (rows, 3)
        Guesses of log r, log gamma, log C; rows with a nan are passed over.
    lam, w_f : ndarray, shape (rows,)
        Cable length and fish weight [-].

    Returns
    -------
    ndarray, shape (rows, 3)
        log r, log gamma, log C.
    ndarray of int, shape (rows,)
        Statuses.
    """

    def residuals(z: Array, i: Integers) -> tuple[Array, Array, Booleans]:
        return _cusp_equations(z, lam=lam[i], w_f=w_f[i])

    found, _, solved = newton(
        residuals, z, rounds=ROUNDS, longest=1.0, settled=lambda step, size, last: size < np.sqrt(SETTLED)
    )
    return found, np.where(solved, status.OK, status.NOT_CONVERGED)


def _cusp_errors(z: Array, *, lam: Array, w_f: Array) -> Array:
    """Estimated relative errors of C at cusps."""
    errors = np.full(len(z), np.nan)
    i = np.flatnonzero(np.isfinite(z).all(axis=1))
    value, jacobian, _ = _cusp_equations(z[i], lam=lam[i], w_f=w_f[i])
    errors[i] = cusp_errors(value, jacobian)[:, 1]
    return errors


def _cusp_equations(z: Array, *, lam: Array, w_f: Array) -> tuple[Array, Array, Booleans]:
    systems = nondense_rows(lam=lam, w_f=w_f, C=np.exp(z[:, 2]))
    return cusp_equations(z[:, 0], np.exp(z[:, 1]), systems, direction_of(DRAG, systems))


def crossing(curve: Curve, log_c: float, side: str) -> Array | None:
    """First point of a curve with a drag constant.

    Parameters
    ----------
    curve : Curve
        From `trace_folds`.
    log_c : float
        Logarithm of the drag constant.
    side : {"appears", "ends", "again"}
        Before the cusp, where the drag rises along the curve; after it, where it falls; after that, where it rises.

    Returns
    -------
    ndarray, shape (3,), or None
        log r, log gamma, log C; None if there is none.
    """
    rises = side != "ends"
    points = _fine(curve, before=side == "appears")
    if side == "appears" and len(points) and points[0, 2] >= log_c:
        return curve.points[0].copy()
    heights = points[:, 2] - log_c
    if side == "again" and len(heights):
        heights[: int(np.argmin(heights))] = np.inf
    with np.errstate(invalid="ignore"):
        hits = np.flatnonzero(
            (heights[:-1] < 0.0) & (heights[1:] >= 0.0) if rises else (heights[:-1] > 0.0) & (heights[1:] <= 0.0)
        )
    if not len(hits):
        return None
    k = int(hits[0])
    return points[k] + (points[k + 1] - points[k]) * heights[k] / (heights[k] - heights[k + 1])


def at_speeds(curve: Curve, log_gamma: Array) -> Array:
    """Points of a curve after its cusp with given speeds; nan where there are none.

    Parameters
    ----------
    curve : Curve
        From `trace_folds`.
    log_gamma : ndarray, shape (speeds,)

    Returns
    -------
    ndarray, shape (speeds, 3)
        log r, log gamma, log C.
    """
    return _at_speeds(_fine(curve, before=False), log_gamma)


def _at_speeds(points: Array, log_gamma: Array) -> Array:
    if not len(points):
        return np.full((len(log_gamma), 3), np.nan)
    # At the cusp itself the speed stands still.
    falls = np.flatnonzero(np.diff(points[:, 1]) <= 0.0)
    points = points[falls[-1] + 1 :] if len(falls) else points
    columns = [np.interp(log_gamma, points[:, 1], column, np.nan, np.nan) for column in points.T]
    return np.stack(columns, axis=1)


def _fine(curve: Curve, before: bool) -> Array:
    """A curve up to its cusp, or from there on, on FINE points for each of its own; shape (points, 3)."""
    last = curve.event()
    count = len(curve)
    if (not before and last < 0) or count < 2:
        return np.empty((0, 3))
    cusp = last + curve.share(last) if last >= 0 else count - 1.0
    first, end = (0.0, cusp) if before else (cusp, count - 1.0)
    places = np.unique(np.concatenate([[first, end], np.arange(np.ceil(first * FINE), end * FINE) / FINE]))
    k = np.minimum(places.astype(np.int64), count - 2)
    a, b = curve.points[k], curve.points[k + 1]
    length, share = np.linalg.norm(b - a, axis=1)[:, None], (places - k)[:, None]
    return cubic(a, b, curve.tangents[k], curve.tangents[k + 1], length, share)


def fold_at(guess: Array, systems: Array, *, settled_at: float = SETTLED) -> tuple[Array, Array, Integers]:
    """Folds of systems near guesses, by Newton.

    Parameters
    ----------
    guess : ndarray, shape (rows, 2)
        log r and log gamma; rows with a nan are passed over.
    systems : ndarray, shape (rows, columns)
        As of `System.row`.
    settled_at : float
        Newton's last step is at most this long, in log r and log gamma.

    Returns
    -------
    ndarray, shape (rows, 2)
        log r, log gamma.
    ndarray, shape (rows,)
        Estimated relative error of gamma.
    ndarray of int, shape (rows,)
        Statuses.
    """
    at = AT_DRAG.at
    along_gamma = np.full(len(guess), np.nan)

    def residuals(z: Array, i: Integers) -> tuple[Array, Array, Booleans]:
        ends = shoot(np.exp(z[:, 0]), np.exp(z[:, 1]), systems[i], AT_DRAG)
        jet = ends.log_rho
        along_gamma[i] = jet[:, at(0, 1, 0)]
        sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1)
        entries = (jet[:, at(1, 0, 0)], jet[:, at(0, 1, 0)], 2.0 * jet[:, at(2, 0, 0)], jet[:, at(1, 1, 0)])
        return (
            np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1),
            np.stack(entries, axis=1).reshape(-1, 2, 2),
            sound,
        )

    def settled(step: Array, size: Array, last: Array) -> Booleans:
        # At a fold gamma depends on r to the second order only: gamma is done before r.
        return (size < settled_at) | (np.abs(step[:, 1]) < SETTLED) & (size > 0.5 * last) & (size < 1e-4)

    known = np.asarray(~np.isnan(systems).any(axis=1))
    guess = np.where(known[:, None], guess, np.nan)
    z, step, solved = newton(residuals, guess, rounds=3 * ROUNDS, longest=1.0, settled=settled)
    error = np.where(solved, np.abs(step[:, 1]) + ROUNDINGS * EPS / np.abs(along_gamma), np.nan)
    return z, error, np.where(solved, status.OK, status.NOT_CONVERGED)


def fold_at_speed(guess: Array, log_gamma: Array, *, lam: Array, w_f: Array) -> tuple[Array, Booleans]:
    """Folds of cables at given speeds near guesses, with the drag among the unknowns, by Newton.

    Parameters
    ----------
    guess : ndarray, shape (rows, 2)
        log r and log C; rows with a nan are passed over.
    log_gamma, lam, w_f : ndarray, shape (rows,)
        Logarithm of the speed, cable length and fish weight.

    Returns
    -------
    ndarray, shape (rows, 2)
        log r, log C.
    ndarray of bool, shape (rows,)
        Which were solved.
    """
    at = AT_SPEED.at

    def residuals(z: Array, i: Integers) -> tuple[Array, Array, Booleans]:
        systems = nondense_rows(lam=lam[i], w_f=w_f[i], C=np.exp(z[:, 1]))
        ends = shoot(np.exp(z[:, 0]), np.exp(log_gamma[i]), systems, AT_SPEED, directions=direction_of(DRAG, systems))
        jet = ends.log_rho
        sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1)
        entries = (jet[:, at(1, 0, 0)], jet[:, at(0, 0, 1)], 2.0 * jet[:, at(2, 0, 0)], jet[:, at(1, 0, 1)])
        return (
            np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1),
            np.stack(entries, axis=1).reshape(-1, 2, 2),
            sound,
        )

    def settled(step: Array, size: Array, last: Array) -> Booleans:
        return (size < SETTLED) | (np.abs(step[:, 1]) < SETTLED) & (size < 1e-4)

    z, _, solved = newton(residuals, guess, rounds=3 * ROUNDS, longest=1.0, settled=settled)
    return z, solved


@takes_frames
def solve_drag_folds(lam: ArrayLike, w_f: ArrayLike, C: ArrayLike, n: ArrayLike = 1) -> DragFolds:
    """Folds of cables towed in a nondense fluid (m_f = w_f, w = 1), each solved directly.

    Parameters
    ----------
    lam, w_f : array_like
        Cable length over tow radius, > 0, and fish weight, >= 0 [-].
    C : array_like
        Drag constant of the cable, (1/2) rho C_D d R / (mu + rho A) [-], >= 0.
    n : array_like of int
        Number of the transition in a vacuum, >= 1.

    Returns
    -------
    DragFolds
        Arrays of the broadcast shape; nan where a status says why.

    Raises
    ------
    ValueError
        For numbers out of range, and what is not a number.

    Notes
    -----
    At a fold log rho = 0, rho the radius at the tow point over the tow radius, and its slope in log r_f is 0; at the
    cusp its second slope, too. Continued from the n-th fold of the vacuum; folds that drag makes are not among these,
    but in `folds`.

    References
    ----------
    The equations: NRL Report 7048, Eqs. (12)-(23). gamma_cn(lambda, C, w_f): the section "Some empirical results".

    Examples
    --------
    >>> folds = solve_drag_folds(37.8, 1352, [0.005, 0.018], n=2)
    >>> folds.sentence(1)
    'too much drag: the n-th pair of the vacuum never appears; drag may make others, see towatlas folds'
    """
    arrays = {"lam": check_real("lam", lam), "w_f": check_real("w_f", w_f), "C": check_real("C", C)}
    check_positive_finite("lam", arrays["lam"])
    check_positive_finite("w_f", arrays["w_f"], zero=True)
    check_positive_finite("C", arrays["C"], zero=True)
    lam, w_f, C, n = check_broadcast(**arrays, n=check_order(n))
    flat = [np.ascontiguousarray(column.ravel()) for column in (n, lam, w_f)]
    cables, which = np.unique(np.stack(flat, axis=1), axis=0, return_inverse=True)
    with patience():
        table = _fold_rows(
            lam=cables[:, 1].copy(),
            w_f=cables[:, 2].copy(),
            n=cables[:, 0].astype(np.int64),
            which=which.ravel(),
            c=C.ravel(),
        )
    shaped = {name: column.reshape(n.shape) for name, column in table.items()}
    return DragFolds(n=n, lam=lam, w_f=w_f, C=C, **shaped)


def _fold_rows(*, lam: Array, w_f: Array, n: Integers, which: Integers, c: Array) -> dict[str, NDArray[Any]]:
    """Folds at drags c of the cables `which` of those given."""
    curves, traced = trace_folds(lam=lam, w_f=w_f, n=n)
    cusps, cusp_codes = solve_cusps(curves, traced, lam=lam, w_f=w_f)
    cusp_error = _cusp_errors(cusps, lam=lam, w_f=w_f)
    lasting, lasting_error = _lasting(curves, lam=lam, w_f=w_f)
    vacuum = solve_rows(lam=lam, w_f=w_f, n=n, excess=unchecked_excess_length(lam=lam, w_f=w_f, n=n))
    with np.errstate(divide="ignore"):
        log_c = np.log(c)
    systems = nondense_rows(lam=lam[which], w_f=w_f[which], C=np.exp(log_c))
    sides = {}
    for side, without in zip(SIDES, (status.NO_PAIR, status.NEVER_ENDS, status.NOT_AGAIN), strict=True):
        guess = np.full((len(c), 2), np.nan)
        codes = np.full(len(c), without)
        for row, cable in enumerate(which):
            curve, cusp_code = curves[cable], cusp_codes[cable]
            if cusp_code not in (status.OK, status.NO_CUSP):
                codes[row] = cusp_code
            elif len(curve) < 2:
                codes[row] = status.BEYOND
            elif log_c[row] >= cusps[cable, 2] or (cusp_code == status.NO_CUSP and log_c[row] >= lasting[cable]):
                codes[row] = status.NO_PAIR
            elif np.isfinite(log_c[row]) and (found := crossing(curve, log_c[row], side)) is not None:
                guess[row], codes[row] = found[:2], status.OK
            elif not curve.complete or (side == "appears" and np.isfinite(log_c[row])):
                codes[row] = status.NOT_CONVERGED
        z, error, solved = fold_at(guess, systems)
        tried = np.isfinite(guess).all(axis=1)
        sides[side] = [np.exp(z[:, 1]), np.exp(z[:, 0] - 2.0 * z[:, 1]), error, np.where(tried, solved, codes)]
    still = np.asarray((c == 0.0) & (vacuum["status"][which] == status.OK))
    for column, name in zip(sides["appears"], ("gamma", "x_f", "error"), strict=False):
        column[still] = np.abs(vacuum[name][which])[still]
    table: dict[str, NDArray[Any]] = {}
    for side, without in zip(SIDES, (status.OK, status.NEVER_ENDS, status.NEVER_ENDS), strict=True):
        table[side], table[f"r_f_{side}"], error, codes = sides[side]
        table["error" if side == "appears" else f"error_{side}"] = error
        codes[still] = without
        table["status" if side == "appears" else f"status_{side}"] = codes.astype(np.int8)
    table["status_again"] = np.where(
        table["status_ends"] == status.OK, table["status_again"], table["status_ends"]
    ).astype(np.int8)
    table |= {
        "C_cusp": np.exp(cusps[which, 2]),
        "gamma_cusp": np.exp(cusps[which, 1]),
        "C_lasting": np.exp(lasting[which]),
        "error_cusp": cusp_error[which],
        "error_lasting": lasting_error[which],
        "status_cusp": cusp_codes[which].astype(np.int8),
    }
    lost = np.any([table[name] == status.NOT_CONVERGED for name in ("status", "status_ends", "status_again")], axis=0)
    for k in np.flatnonzero(lost & (vacuum["status"][which] == status.OK)):
        _look(table, int(k), systems[k], int(n[which[k]]), float(vacuum["gamma"][which[k]]))
    return table


def _lasting(curves: list[Curve], *, lam: Array, w_f: Array) -> tuple[Array, Array]:
    """log C below which pairs do not end, and its errors: the least after the cusp, or that at the highest speed."""
    rows = len(curves)
    best, error, at = np.full(rows, np.nan), np.full(rows, np.nan), np.full((rows, 2), np.nan)
    highest = np.log(GAMMA_MAX)
    for row, curve in enumerate(curves):
        if len(curve) > 1 and curve.complete:
            points = _fine(curve, before=curve.event() < 0)
            k = int(np.argmin(points[:, 2])) if curve.event() >= 0 else len(points) - 1
            # The last point lies beyond the highest speed.
            place = points[k] if points[k, 1] < highest else _at_speeds(points, np.array([highest]))[0]
            at[row], best[row] = place[[1, 0]], place[2]
    inside = at[:, 0] < highest - LEAST_SPREAD[0]
    for spread in LEAST_SPREAD:
        # A parabola through three speeds: its vertex is wrong by the square of their distance, its value by the fourth.
        speeds = at[:, :1] + spread * np.where(inside[:, None], np.array([-1.0, 0.0, 1.0]), 0.0)
        # The fish stays where it is, in tow radii.
        log_r = at[:, 1:] + 2.0 * (speeds - at[:, :1])
        guess = np.stack([log_r.ravel(), np.repeat(best, 3)], axis=1)
        long = {"lam": np.repeat(lam, 3), "w_f": np.repeat(w_f, 3)}
        z, solved = fold_at_speed(guess, speeds.ravel(), **long)
        z = np.where(solved[:, None], z, np.nan).reshape(rows, 3, 2)
        left, middle, right = z[:, :, 1].T
        slope, bend = 0.5 * (right - left), left - 2.0 * middle + right
        with np.errstate(divide="ignore", invalid="ignore"):
            least = np.where(inside, middle - 0.5 * slope**2 / bend, middle)
            moved = np.where(inside, np.clip(-slope / bend, -1.0, 1.0) * spread, 0.0)
        error = np.abs(least - best) + ROUNDINGS * EPS
        best, at = least, np.stack([at[:, 0] + moved, z[:, 1, 0] + 2.0 * moved], axis=1)
    return best, error


def _look(table: dict[str, NDArray[Any]], row: int, system: Array, n: int, gamma: float) -> None:
    """Put in the pair of a system whose curve of folds could not be followed, from all its folds in speed."""
    found = folds_in_speed(System(*system.tolist()), SLOWER * gamma, GAMMA_MAX)
    if not found.complete:
        return
    rises = found.shapes_above > found.shapes_below
    of_pair = np.flatnonzero(found.n == n)
    appears, falls = of_pair[rises[of_pair]], of_pair[~rises[of_pair]]
    places = {"appears": appears[:1], "ends": falls[:1], "again": appears[1:2]}
    before = status.OK
    for side, without in zip(SIDES, (status.NO_PAIR, status.NEVER_ENDS, status.NOT_AGAIN), strict=True):
        suffix = "" if side == "appears" else f"_{side}"
        there = len(places[side]) > 0
        k = int(places[side][0]) if there else 0
        table[side][row] = found.gamma[k] if there else np.nan
        table[f"r_f_{side}"][row] = found.r_f[k] if there else np.nan
        table[f"error{suffix}"][row] = found.error[k] if there else np.nan
        # What never begins, or ends, has nothing after it.
        table[f"status{suffix}"][row] = status.OK if there else without if before == status.OK else before
        before = int(table[f"status{suffix}"][row])
