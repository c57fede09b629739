"""Folds with drag: where the n-th pair of equilibria appears, where it ends, and the cusp above which it never exists.

At a fold the radius of the tow point, as a function of that of the fish, has an extremum at the tow radius itself:
log rho = 0 and its slope in log r_f is 0. From the n-th fold of the vacuum a curve of folds sets out in (r_f, gamma,
C). Along it C rises to the cusp, C*_n, where the second slope vanishes too, and falls again. Before the cusp the
extremum is a maximum: as gamma passes it, two equilibria appear. After it, a minimum: the outer of the two meets the
next equilibrium outside and both are gone, so that a cable that sat there has to jump. A pair that meets no minimum up
to GAMMA_MAX does not end: such are all pairs of the vacuum.
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_order, check_positive_finite, check_real
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.limits import unchecked_excess_length
from towatlas.numerics.curves import Curve, Steps, follow
from towatlas.numerics.rows import EPS, newton, solve_systems
from towatlas.results import DragFolds
from towatlas.solve.critical import solve_rows
from towatlas.solve.folds import folds_in_speed
from towatlas.solve.jets import jets_of
from towatlas.solve.shots import Array, Integers, direction_of, shoot
from towatlas.system import System, nondense_rows

FOLD = jets_of(2, gamma=True, parameter=True)
AT_DRAG = jets_of(2, gamma=True)
CUSP = jets_of(3, gamma=True, parameter=True)

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

Booleans = NDArray[np.bool_]


def trace_folds(*, lam: Array, w_f: Array, n: Integers) -> tuple[list[Curve], Integers]:
    """Curves of folds of the rows given, from the vacuum over the cusp to the highest speed or the next turn of C.

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
        return (z[:, 1] > np.log(GAMMA_MAX)) | turned[i] & (direction[:, 2] > 0.0) & (second[:, 0] > 1.0)

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
        return *_cusp_equations(z, lam=lam[i], w_f=w_f[i]), np.ones(len(z), bool)

    found, _, solved = newton(
        residuals, z, rounds=ROUNDS, longest=1.0, settled=lambda step, size, last: size < np.sqrt(SETTLED)
    )
    return found, np.where(solved, status.OK, status.NOT_CONVERGED)


def cusp_errors(z: Array, *, lam: Array, w_f: Array) -> Array:
    """Estimated relative errors of C at cusps: twice what one more step of Newton would move it by, and rounding."""
    errors = np.full(len(z), np.nan)
    i = np.flatnonzero(np.isfinite(z).all(axis=1))
    value, jacobian = _cusp_equations(z[i], lam=lam[i], w_f=w_f[i])
    step = solve_systems(jacobian, -value)
    # log rho and its slope alone fix speed and drag at the cusp: what their rounding moves log C by.
    along, bent = jacobian[:, 0], jacobian[:, 1]
    with np.errstate(all="ignore"):
        determinant = along[:, 1] * bent[:, 2] - along[:, 2] * bent[:, 1]
        rounding = ROUNDINGS * EPS * (np.abs(along[:, 1]) + np.abs(bent[:, 1])) / np.abs(determinant)
    # The step is the error but for its own: twice it is no less.
    errors[i] = 2.0 * np.abs(step[:, 2]) + rounding
    return errors


def _cusp_equations(z: Array, *, lam: Array, w_f: Array) -> tuple[Array, Array]:
    """log rho and its first two slopes, and their Jacobian in log r, log gamma, log C."""
    at = CUSP.at
    systems = nondense_rows(lam=lam, w_f=w_f, C=np.exp(z[:, 2]))
    jet = shoot(np.exp(z[:, 0]), np.exp(z[:, 1]), systems, CUSP, directions=direction_of(DRAG, systems)).log_rho
    along = [((k + 1) * jet[:, at(k + 1, 0, 0)], jet[:, at(k, 1, 0)], jet[:, at(k, 0, 1)]) for k in range(3)]
    return jet[:, [at(k, 0, 0) for k in range(3)]], np.stack([np.stack(row, axis=1) for row in along], axis=1)


def crossing(curve: Curve, log_c: float, before: bool) -> Array | None:
    """First point of a curve with a drag constant.

    Parameters
    ----------
    curve : Curve
        From `trace_folds`.
    log_c : float
        Logarithm of the drag constant.
    before : bool
        Before the cusp, where the pair appears; else after it, where it ends.

    Returns
    -------
    ndarray, shape (3,), or None
        log r, log gamma, log C; None if there is none.
    """
    last = curve.event()
    heights = curve.points[:, 2] - log_c
    if before and heights[0] >= 0.0:
        return curve.points[0].copy()
    if last < 0:
        last = len(heights) if before else len(heights) - 1
    span = range(min(last + 1, len(heights) - 1)) if before else range(last, len(heights) - 1)
    for k in span:
        end = float(curve.at_event(last)[2]) - log_c if before and k == last else heights[k + 1]
        begin = float(curve.at_event(last)[2]) - log_c if not before and k == last else heights[k]
        if (begin < 0.0 <= end) if before else (begin > 0.0 >= end):
            shares = np.linspace(0.0, 1.0, 65)
            line = np.array([curve.between(k, share)[2] for share in shares]) - log_c
            sign = (line[:-1] < 0.0) & (line[1:] >= 0.0) if before else (line[:-1] > 0.0) & (line[1:] <= 0.0)
            hits = np.flatnonzero(sign)
            j = int(hits[0]) if len(hits) else int(np.argmin(np.abs(line[:-1])))
            gap = line[j] - line[j + 1]
            return curve.between(k, shares[j] + (line[j] / gap / 64.0 if len(hits) else 0.0))
    return None


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
    cusp_error = cusp_errors(cusps, lam=lam, w_f=w_f)
    lasting = np.array([curve.points[-1, 2] if len(curve) and curve.complete else np.nan for curve in curves])
    vacuum = solve_rows(lam=lam, w_f=w_f, n=n, excess=unchecked_excess_length(lam=lam, w_f=w_f, n=n))
    with np.errstate(divide="ignore"):
        log_c = np.log(c)
    systems = nondense_rows(lam=lam[which], w_f=w_f[which], C=np.exp(log_c))
    sides = {}
    for before in (True, False):
        guess = np.full((len(c), 2), np.nan)
        codes = np.full(len(c), status.NO_PAIR if before else status.NEVER_ENDS)
        for row, cable in enumerate(which):
            curve, cusp_code = curves[cable], cusp_codes[cable]
            if cusp_code not in (status.OK, status.NO_CUSP):
                codes[row] = cusp_code
            elif log_c[row] >= cusps[cable, 2]:
                codes[row] = status.NO_PAIR
            elif (found := crossing(curve, log_c[row], before)) is not None and np.isfinite(log_c[row]):
                guess[row], codes[row] = found[:2], status.OK
            elif not before and cusp_code == status.NO_CUSP:
                codes[row] = status.NEVER_ENDS if log_c[row] < curve.points[-1, 2] else status.NO_PAIR
            elif not curve.complete if not before else np.isfinite(log_c[row]):
                codes[row] = status.NOT_CONVERGED
        z, error, solved = fold_at(guess, systems)
        tried = np.isfinite(guess).all(axis=1)
        sides[before] = np.exp(z[:, 1]), np.exp(z[:, 0] - 2.0 * z[:, 1]), error, np.where(tried, solved, codes)
    appears, r_f, error, codes = (column.copy() for column in sides[True])
    still = np.asarray((c == 0.0) & (vacuum["status"][which] == status.OK))
    for column, name in ((appears, "gamma"), (r_f, "x_f"), (error, "error")):
        column[still] = np.abs(vacuum[name][which])[still]
    codes[still] = status.OK
    table = {
        "appears": appears,
        "r_f_appears": r_f,
        "ends": sides[False][0],
        "r_f_ends": sides[False][1],
        "C_cusp": np.exp(cusps[which, 2]),
        "gamma_cusp": np.exp(cusps[which, 1]),
        "C_lasting": np.exp(lasting[which]),
        "error": np.fmax(error, sides[False][2]),
        "error_cusp": cusp_error[which],
        "status": codes.astype(np.int8),
        "status_ends": np.where(still, status.NEVER_ENDS, sides[False][3]).astype(np.int8),
        "status_cusp": cusp_codes[which].astype(np.int8),
    }
    lost = (table["status"] == status.NOT_CONVERGED) | (table["status_ends"] == status.NOT_CONVERGED)
    for k in np.flatnonzero(lost & (vacuum["status"][which] == status.OK)):
        _look(table, int(k), systems[k], int(n[which[k]]), float(vacuum["gamma"][which[k]]))
    return table


def _look(table: dict[str, NDArray[Any]], row: int, system: Array, n: int, gamma: float) -> None:
    """Put in the pair of a system whose curve of folds could not be followed, from all its folds in speed."""
    found = folds_in_speed(System(*system.tolist()), SLOWER * gamma, GAMMA_MAX)
    if not found.complete:
        return
    for name, wanted, rises in (("appears", "", True), ("ends", "_ends", False)):
        of_pair = np.flatnonzero((found.n == n) & ((found.shapes_above > found.shapes_below) == rises))
        there = len(of_pair) > 0
        k = int(of_pair[0 if rises else -1]) if there else 0
        table[name][row] = found.gamma[k] if there else np.nan
        table[f"r_f_{name}"][row] = found.r_f[k] if there else np.nan
        table[f"status{wanted}"][row] = status.OK if there else status.NO_PAIR if rises else status.NEVER_ENDS
        if there:
            table["error"][row] = np.fmax(table["error"][row], found.error[k])
    if table["status"][row] == status.NO_PAIR:
        table["status_ends"][row] = status.NO_PAIR
