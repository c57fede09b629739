"""Folds with drag: where the n-th pair of equilibria appears, where it ends, and the cusp above which it never exists.

At a fold the radius of the tow point, as a function of that of the fish, has an extremum at the tow radius itself:
log rho = 0 and its slope in log r_f is 0. From the n-th fold of the vacuum a curve of folds sets out in (r_f, gamma,
C). Along it C rises to the cusp, C*_n, where the second slope vanishes too, and falls again. Before the cusp the
extremum is a maximum: as gamma passes it, two equilibria appear. After it, a minimum: the outer of the two meets the
next equilibrium outside and both are gone, so that a cable that sat there has to jump. A pair that meets no minimum up
to GAMMA_MAX does not end: such are all pairs of the vacuum.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_order, check_positive_finite, check_real
from towatlas.kernels import status
from towatlas.limits import unchecked_excess_length
from towatlas.solve.critical import solve_rows
from towatlas.solve.drag_shots import Array, shoot
from towatlas.solve.jets import jets_of

FOLD = jets_of(2, gamma=True, drag=True)
AT_DRAG = jets_of(2, gamma=True)
CUSP = jets_of(3, gamma=True, drag=True)

GAMMA_MAX = 50.0
# Drag so small that the vacuum's fold is a first guess of it.
FAINT = 1e-6
# Arclength in (log r, log gamma, log C): first step, longest, shortest; Newton is near when its steps are this small.
FIRST_STEP, LONGEST, SHORTEST = 2.0, 2.0, 1e-4
NEAR = 1e-4
# A correction longer than this share of the step says that the curve has bent away.
BENT = 0.25
POINTS = 200
ROUNDS = 12
EPS = 2.0**-52
ROUNDINGS = 64.0
SETTLED = 1e-11


@dataclass(frozen=True)
class DragFolds:
    """Folds of towed cables with drag; all arrays of one shape, all dimensionless, nan where status says why.

    n, lam, w_f, C : what was asked. appears : gamma at which the n-th pair of equilibria appears. r_f_appears : radius
    of the fish there. ends : gamma at which the outer member of the pair is gone, with r_f_ends. C_cusp : C*_n, the
    drag constant above which there is no n-th pair, with gamma_cusp; nan where there is none. C_lasting : drag below
    which the pair never ends, as far as GAMMA_MAX. error : estimated relative error of `appears`. status, status_ends,
    status_cusp : codes of `towatlas.kernels.status` of `appears`, `ends` and C_cusp.
    """

    n: NDArray[np.int64]
    lam: Array
    w_f: Array
    C: Array
    appears: Array
    r_f_appears: Array
    ends: Array
    r_f_ends: Array
    C_cusp: Array
    gamma_cusp: Array
    C_lasting: Array
    error: Array
    status: NDArray[np.int8]
    status_ends: NDArray[np.int8]
    status_cusp: NDArray[np.int8]

    def sentence(self, index: Any = ()) -> str:
        """The status of one fold in words."""
        return status.SENTENCES[int(self.status[index])]


@dataclass(frozen=True)
class Curve:
    """Folds of one cable along their curve: rows log r, log gamma, log C; their tangents; second slopes of log rho.

    complete : whether it was followed to GAMMA_MAX, or to where C rises again after the cusp.
    """

    points: Array
    tangents: Array
    curvatures: Array
    complete: bool
    status: int


def _systems(lam: Array, w_f: Array, c: Array) -> Array:
    table = np.zeros((len(lam), 7))
    table[:, 0], table[:, 1], table[:, 2], table[:, 3], table[:, 5] = lam, w_f, w_f, c, 1.0
    return table


def _residuals(z: Array, lam: Array, w_f: Array, parallel: bool) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """log rho and its slope, their Jacobian in z = (log r, log gamma, log C), second slopes, and whether sound."""
    ends = shoot(np.exp(z[:, 0]), np.exp(z[:, 1]), _systems(lam, w_f, np.exp(z[:, 2])), FOLD, parallel)
    jet, at = ends.log_rho, FOLD.at
    second = 2.0 * jet[:, at(2, 0, 0)]
    value = np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1)
    along_value = np.stack([value[:, 1], jet[:, at(0, 1, 0)], jet[:, at(0, 0, 1)]], axis=1)
    along_slope = np.stack([second, jet[:, at(1, 1, 0)], jet[:, at(1, 0, 1)]], axis=1)
    sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1)
    return value, np.stack([along_value, along_slope], axis=1), second, sound


def _solve_systems(matrix: Array, right: Array) -> Array:
    """Solutions of small systems, nan where singular."""
    with np.errstate(all="ignore"):
        bad = ~(np.isfinite(matrix).all(axis=(1, 2)) & (np.abs(np.linalg.det(matrix)) > 0.0))
    matrix = np.where(bad[:, None, None], np.eye(matrix.shape[1]), matrix)
    return np.where(bad[:, None], np.nan, np.linalg.solve(matrix, right[:, :, None])[:, :, 0])


def trace_folds(n: NDArray[np.int64], lam: Array, w_f: Array, parallel: bool = False) -> list[Curve]:
    """Curves of folds of the rows given, from the vacuum over the cusp to the highest speed or the next turn of C."""
    rows = len(n)
    vacuum = solve_rows(n, w_f, lam, unchecked_excess_length(lam, w_f, n))
    codes = vacuum["status"].astype(np.int64)
    with np.errstate(invalid="ignore"):
        gamma = vacuum["gamma"]
        z = np.stack([np.log(np.abs(vacuum["x_f"]) * gamma**2), np.log(gamma), np.full(rows, np.log(FAINT))], axis=1)
    tangent = np.tile([0.0, 0.0, 1.0], (rows, 1))
    step = np.zeros(rows)
    history: list[list[tuple[Array, Array, float]]] = [[] for _ in range(rows)]
    turned, complete = np.zeros(rows, bool), np.zeros(rows, bool)
    active = codes == status.OK
    for _ in range(POINTS):
        i = np.flatnonzero(active)
        if not len(i):
            break
        reached, jacobian, second, good, quick = _correct(z[i], tangent[i], step[i], lam[i], w_f[i], parallel)
        step[i[~good]] *= 0.5
        active[i[~good & (step[i] < SHORTEST)]] = False
        k = i[good]
        z[k] = reached[good]
        new = np.cross(jacobian[good, 0], jacobian[good, 1])
        new /= np.linalg.norm(new, axis=1)[:, None]
        new *= np.where(np.sum(new * tangent[k], axis=1) < 0.0, -1.0, 1.0)[:, None]
        turned[k] |= second[good] > 0.0
        done = (z[k, 1] > np.log(GAMMA_MAX)) | turned[k] & (new[:, 2] > 0.0) & (second[good] > 1.0)
        complete[k] |= done
        for row, where, direction, curvature in zip(k, z[k], new, second[good], strict=True):
            history[row].append((where, direction, curvature))
        tangent[k] = new
        step[k] = np.where(step[k] == 0.0, FIRST_STEP, step[k] * np.where(quick[good], 1.6, 1.0)).clip(None, LONGEST)
        active[k[done]] = False
    curves = []
    for row in range(rows):
        if codes[row] == status.OK and not (complete[row] or turned[row]):
            codes[row] = status.NOT_CONVERGED
        at, along, curvatures = ([entry[k] for entry in history[row]] for k in range(3))
        points, tangents = (np.array(column).reshape(-1, 3) for column in (at, along))
        curves.append(Curve(points, tangents, np.array(curvatures), bool(complete[row]), int(codes[row])))
    return curves


def _correct(
    z: Array, tangent: Array, step: Array, lam: Array, w_f: Array, parallel: bool
) -> tuple[Array, Array, Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Step along the tangents and come back to the curve: points, Jacobians, second slopes, success, and ease."""
    start = z + step[:, None] * tangent
    x = start.copy()
    rows = len(x)
    jacobian, second = np.full((rows, 2, 3), np.nan), np.full(rows, np.nan)
    good, failed, quick = np.zeros(rows, bool), np.zeros(rows, bool), np.zeros(rows, bool)
    for round_ in range(6):
        i = np.flatnonzero(~good & ~failed)
        if not len(i):
            break
        value, jac, curve, sound = _residuals(x[i], lam[i], w_f[i], parallel)
        jacobian[i], second[i] = jac, curve
        matrix = np.concatenate([jac, tangent[i][:, None, :]], axis=1)
        away = np.sum(tangent[i] * (start[i] - x[i]), axis=1)
        correction = _solve_systems(matrix, np.stack([-value[:, 0], -value[:, 1], away], axis=1))
        size = np.linalg.norm(correction, axis=1)
        bad = ~sound | ~(size <= np.maximum(BENT * step[i], 0.1 * (step[i] == 0.0)))
        failed[i[bad]] = True
        x[i[~bad]] += correction[~bad]
        near = ~bad & (size < NEAR)
        good[i[near]] = True
        quick[i[near]] = round_ <= 1
    return x, jacobian, second, good, quick


def between(curve: Curve, k: int, share: float) -> Array:
    """Point on the cubic between points k and k + 1 of a curve."""
    a, b = curve.points[k], curve.points[k + 1]
    length = np.linalg.norm(b - a)
    s, t = 1.0 - share, share
    return (
        s * s * (1.0 + 2.0 * t) * a
        + t * t * (1.0 + 2.0 * s) * b
        + s * t * length * (s * curve.tangents[k] - t * curve.tangents[k + 1])
    )


def cusp_index(curve: Curve) -> int:
    """Which point of a curve is the last before the cusp, -1 if it has none."""
    change = np.flatnonzero((curve.curvatures[:-1] < 0.0) & (curve.curvatures[1:] >= 0.0))
    return int(change[0]) if len(change) else -1


def solve_cusps(curves: list[Curve], lam: Array, w_f: Array, parallel: bool = False) -> tuple[Array, NDArray[np.int64]]:
    """Cusps of curves: rows log r, log gamma, log C, where log rho and its first two slopes vanish; statuses."""
    z, codes = np.full((len(curves), 3), np.nan), np.full(len(curves), status.NOT_CONVERGED)
    for row, curve in enumerate(curves):
        k = cusp_index(curve)
        if curve.status != status.OK or k < 0:
            codes[row] = curve.status if curve.status != status.OK else status.NO_CUSP
            continue
        a, b = curve.curvatures[k], curve.curvatures[k + 1]
        z[row] = between(curve, k, a / (a - b))
    solved, solved_codes = polish_cusps(z, lam, w_f, parallel)
    return solved, np.where(np.isfinite(z).all(axis=1), solved_codes, codes)


def polish_cusps(z: Array, lam: Array, w_f: Array, parallel: bool = False) -> tuple[Array, NDArray[np.int64]]:
    """Cusps near the guesses z, rows log r, log gamma, log C, by Newton; statuses; nan rows pass."""
    z, codes = z.copy(), np.full(len(z), status.NOT_CONVERGED)
    active = np.asarray(np.isfinite(z).all(axis=1))
    at = CUSP.at
    for _ in range(ROUNDS):
        i = np.flatnonzero(active)
        if not len(i):
            break
        jet = shoot(np.exp(z[i, 0]), np.exp(z[i, 1]), _systems(lam[i], w_f[i], np.exp(z[i, 2])), CUSP, parallel).log_rho
        along = [((k + 1) * jet[:, at(k + 1, 0, 0)], jet[:, at(k, 1, 0)], jet[:, at(k, 0, 1)]) for k in range(3)]
        matrix = np.stack([np.stack(row, axis=1) for row in along], axis=1)
        step = _solve_systems(matrix, -jet[:, [at(k, 0, 0) for k in range(3)]])
        size = np.abs(step).max(axis=1)
        far = ~(size < 1.0)
        z[i] += np.where(far[:, None], np.nan, step)
        settled = size < np.sqrt(SETTLED)
        codes[i[settled]] = status.OK
        active[i[far | settled]] = False
    z[codes != status.OK] = np.nan
    return z, codes


def crossing(curve: Curve, log_c: float, before: bool) -> Array | None:
    """First point of a curve with this log C, before or after its cusp; None if it has none."""
    last = cusp_index(curve)
    heights = curve.points[:, 2] - log_c
    if before and heights[0] >= 0.0:
        return curve.points[0].copy()
    if last < 0:
        last = len(heights) if before else len(heights) - 1
    span = range(min(last + 1, len(heights) - 1)) if before else range(last, len(heights) - 1)
    for k in span:
        end = _cusp_height(curve, last) - log_c if before and k == last else heights[k + 1]
        begin = _cusp_height(curve, last) - log_c if not before and k == last else heights[k]
        if (begin < 0.0 <= end) if before else (begin > 0.0 >= end):
            shares = np.linspace(0.0, 1.0, 65)
            line = np.array([between(curve, k, share)[2] for share in shares]) - log_c
            sign = (line[:-1] < 0.0) & (line[1:] >= 0.0) if before else (line[:-1] > 0.0) & (line[1:] <= 0.0)
            hits = np.flatnonzero(sign)
            j = int(hits[0]) if len(hits) else int(np.argmin(np.abs(line[:-1])))
            gap = line[j] - line[j + 1]
            return between(curve, k, shares[j] + (line[j] / gap / 64.0 if len(hits) else 0.0))
    return None


def _cusp_height(curve: Curve, k: int) -> float:
    a, b = curve.curvatures[k], curve.curvatures[k + 1]
    return float(between(curve, k, a / (a - b))[2])


def solve_at(
    z: Array, lam: Array, w_f: Array, parallel: bool = False, settled_at: float = SETTLED
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Folds at the drags of the guesses z: the same columns, relative errors of gamma, statuses; nan rows pass.

    Newton's last step is at most `settled_at`, in log r and log gamma.
    """
    z = z.copy()
    error, codes = np.full(len(z), np.nan), np.full(len(z), status.NOT_CONVERGED)
    active = np.asarray(np.isfinite(z).all(axis=1))
    last = np.full(len(z), np.inf)
    at = AT_DRAG.at
    for _ in range(3 * ROUNDS):
        i = np.flatnonzero(active)
        if not len(i):
            break
        ends = shoot(np.exp(z[i, 0]), np.exp(z[i, 1]), _systems(lam[i], w_f[i], np.exp(z[i, 2])), AT_DRAG, parallel)
        jet, along_gamma = ends.log_rho, ends.log_rho[:, at(0, 1, 0)]
        sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1)
        entries = (jet[:, at(1, 0, 0)], along_gamma, 2.0 * jet[:, at(2, 0, 0)], jet[:, at(1, 1, 0)])
        jacobian = np.stack(entries, axis=1).reshape(-1, 2, 2)
        step = _solve_systems(jacobian, -np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1))
        size = np.abs(step).max(axis=1)
        far = ~sound | ~(size < 1.0)
        z[i, :2] += np.where(far[:, None], np.nan, step)
        # At a fold gamma depends on r to the second order only: gamma is done before r.
        settled = ~far & ((size < settled_at) | (np.abs(step[:, 1]) < SETTLED) & (size > 0.5 * last[i]) & (size < 1e-4))
        rounding = ROUNDINGS * EPS / np.abs(along_gamma)
        error[i[settled]] = (np.abs(step[:, 1]) + rounding)[settled]
        codes[i[settled]] = status.OK
        last[i] = size
        active[i[far | settled]] = False
    z[codes != status.OK] = np.nan
    return z, error, codes


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

    Raises
    ------
    ValueError
        For numbers out of range, and what is not a number.

    Notes
    -----
    Continued from the n-th fold of the vacuum: folds that are not connected with one, if there are any, are not found.

    References
    ----------
    The equations: NRL Report 7048, Eqs. (12)-(23). gamma_cn(lambda, C, w_f): the section "Some empirical results".

    Examples
    --------
    >>> folds = solve_drag_folds(37.8, 1352, [0.005, 0.018], n=2)
    >>> folds.sentence(1)
    'too much drag: the pair never appears'
    """
    arrays = {"lam": check_real("lam", lam), "w_f": check_real("w_f", w_f), "C": check_real("C", C)}
    check_positive_finite("lam", arrays["lam"])
    check_positive_finite("w_f", arrays["w_f"], zero=True)
    check_positive_finite("C", arrays["C"], zero=True)
    lam, w_f, C, n = check_broadcast(**arrays, n=check_order(n))
    flat = [np.ascontiguousarray(column.ravel()) for column in (n, lam, w_f, C)]
    cables, which = np.unique(np.stack(flat[:3], axis=1), axis=0, return_inverse=True)
    table = _fold_rows(cables[:, 0].astype(np.int64), cables[:, 1].copy(), cables[:, 2].copy(), which.ravel(), flat[3])
    return DragFolds(n, lam, w_f, C, **{name: column.reshape(n.shape) for name, column in table.items()})


def _fold_rows(
    n: NDArray[np.int64], lam: Array, w_f: Array, which: NDArray[np.int64], c: Array
) -> dict[str, NDArray[Any]]:
    """Folds at drags c of the cables `which` of those given."""
    curves = trace_folds(n, lam, w_f)
    cusps, cusp_codes = solve_cusps(curves, lam, w_f)
    lasting = np.array([curve.points[-1, 2] if len(curve.points) else np.nan for curve in curves])
    rows = len(c)
    sides = {}
    with np.errstate(divide="ignore"):
        log_c = np.log(c)
    vacuum = solve_rows(n, w_f, lam, unchecked_excess_length(lam, w_f, n))
    for before in (True, False):
        guess = np.full((rows, 3), np.nan)
        codes = np.full(rows, status.NO_PAIR if before else status.NEVER_ENDS)
        for row in range(rows):
            curve, cusp_code = curves[which[row]], cusp_codes[which[row]]
            if cusp_code not in (status.OK, status.NO_CUSP):
                codes[row] = cusp_code
            elif log_c[row] >= cusps[which[row], 2]:
                codes[row] = status.NO_PAIR
            elif (found := crossing(curve, log_c[row], before)) is not None:
                guess[row], codes[row] = found, status.OK
            elif not before and cusp_code == status.NO_CUSP:
                codes[row] = status.NEVER_ENDS if log_c[row] < curve.points[-1, 2] else status.NO_PAIR
            elif not before and not curve.complete:
                codes[row] = status.NOT_CONVERGED
        guess[:, 2] = np.where(np.isfinite(guess[:, 2]), log_c, np.nan)
        z, error, solved = solve_at(np.where(np.isfinite(guess), guess, np.nan), lam[which], w_f[which])
        tried = np.isfinite(guess).all(axis=1)
        codes = np.where(tried, solved, codes)
        sides[before] = np.exp(z[:, 1]), np.exp(z[:, 0] - 2.0 * z[:, 1]), error, codes
    appears, r_f, error, codes = (column.copy() for column in sides[True])
    still = np.asarray((c == 0.0) & (vacuum["status"][which] == status.OK))
    for column, name in ((appears, "gamma"), (r_f, "x_f"), (error, "error")):
        column[still] = np.abs(vacuum[name][which])[still]
    codes[still] = status.OK
    return {
        "appears": appears,
        "r_f_appears": r_f,
        "ends": sides[False][0],
        "r_f_ends": sides[False][1],
        "C_cusp": np.exp(cusps[which, 2]),
        "gamma_cusp": np.exp(cusps[which, 1]),
        "C_lasting": np.exp(lasting[which]),
        "error": error,
        "status": codes.astype(np.int8),
        "status_ends": np.where(still, status.NEVER_ENDS, sides[False][3]).astype(np.int8),
        "status_cusp": cusp_codes[which].astype(np.int8),
    }
