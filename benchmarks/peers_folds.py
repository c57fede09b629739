"""Critical speeds as a SciPy user would solve for them: shots with root, or the extended problem with solve_bvp."""

import warnings
from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import root

from towatlas.kernels.compiling import opened
from towatlas.kernels.folds import _first_guess
from towatlas.limits import excess_length

Array = np.ndarray
MAX_NODES = 5000
# Right-hand sides that `root` may ask for on one cable, a second or so, before it counts as lost.
PATIENCE = 100_000
# A bare tip, where the equations are 0/0, is given a fish of this weight over gamma^2.
LIGHTEST = 1e-9


class OutOfPatienceError(Exception):
    """A shot, or a search, took too long."""


@cache
def _opened_guess() -> Callable:
    return opened(_first_guess)


def guess(n: int, w_f: float, lam: float) -> tuple[float, float]:
    """The closed-form guess that the direct solver of this project starts from: (log a, log gamma)."""
    return _opened_guess()(lam, w_f, float(excess_length(lam, w_f, n)), n)


def _slopes(xi: Array, y: Array, parameters: Array, w_f: float, lam: float) -> Array:
    """Slopes of (p, f, q, v) in xi = (t - mu)/(gamma^2 lambda)."""
    gamma2 = np.exp(2.0 * parameters[1])
    t = max(gamma2 * w_f, LIGHTEST) + gamma2 * lam * xi
    p, f, q, v = y
    r = np.hypot(t, f)
    return gamma2 * lam * np.array([-f / r, p, -((t / r) ** 2) * v / r, q])


def _start(parameters: Array, w_f: float) -> Array:
    a, mu = np.exp(parameters[0]), max(w_f * np.exp(2.0 * parameters[1]), LIGHTEST)
    return np.array([a, mu * a, 1.0, mu])


def by_root(n: int, w_f: float, lam: float, rtol: float) -> float:
    """gamma_cn by `solve_ivp` (DOP853) and `root` from the closed-form guess; nan where it gives up."""
    sign = 1.0 if n % 2 == 0 else -1.0
    calls = 0

    def residual(parameters: Array) -> Array:
        def slopes(xi: float, y: Array) -> Array:
            nonlocal calls
            calls += 1
            if calls > PATIENCE:
                raise OutOfPatienceError
            return _slopes(xi, y, parameters, w_f, lam)

        found = solve_ivp(slopes, (0.0, 1.0), _start(parameters, w_f), "DOP853", rtol=rtol, atol=1e-14)
        p, _, q, _ = found.y[:, -1]
        return np.array([q, sign * p / np.exp(2.0 * parameters[1]) - 1.0])

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            found = root(residual, guess(n, w_f, lam), tol=1e-12, options={"maxfev": 60})
        except (OutOfPatienceError, ValueError):  # the latter from solve_ivp, for a state that overflowed
            return np.nan
    # By its own tolerance `root` may end short of success at the rounding of the shots: judged by what is left.
    return float(np.exp(found.x[1])) if np.abs(found.fun).max() < max(1e-8, 10.0 * rtol) else np.nan


def solve_extended(
    n: int, w_f: float, lam: float, mesh: Array, y: Array, parameters: Array, tolerance: float, max_nodes: int
) -> tuple[float, Array, Array, Array]:
    """gamma_cn, mesh, state and parameters by `solve_bvp` on (p, f, q, v) with log a and log gamma unknown."""
    sign = 1.0 if n % 2 == 0 else -1.0

    def conditions(low: Array, high: Array, parameters: Array) -> Array:
        gamma2 = np.exp(2.0 * parameters[1])
        return np.array([*(low - _start(parameters, w_f)), high[2], sign * high[0] / gamma2 - 1.0])

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        found = solve_bvp(
            lambda xi, y, parameters: _slopes(xi, y, parameters, w_f, lam),
            conditions,
            mesh,
            y,
            p=parameters,
            tol=tolerance,
            max_nodes=max_nodes,
        )
    return float(np.exp(found.p[1])) if found.success else np.nan, found.x, found.y, found.p


def first_state(w_f: float, lam: float, parameters: Array) -> tuple[Array, Array]:
    """A mesh, and the shot of these parameters on it."""
    mesh = np.linspace(0.0, 1.0, 60)
    with np.errstate(all="ignore"):
        shot = solve_ivp(
            _slopes,
            (0.0, 1.0),
            _start(parameters, w_f),
            "DOP853",
            rtol=1e-6,
            atol=1e-9,
            t_eval=mesh,
            args=(parameters, w_f, lam),
        )
    return shot.t, shot.y


def by_bvp(n: int, w_f: float, lam: float, tolerance: float) -> float:
    """gamma_cn by `solve_bvp` from the closed-form guess; nan where it gives up."""
    parameters = np.array(guess(n, w_f, lam))
    mesh, y = first_state(w_f, lam, parameters)
    return solve_extended(n, w_f, lam, mesh, y, parameters, tolerance, MAX_NODES)[0]


def bvp_curve(n: int, w_f: float, lam: Array, parameters: Array, tolerance: float) -> Array:
    """gamma_cn along a curve of cables, each from the one before; `parameters` are those of a cable near the first."""
    mesh, y = first_state(w_f, float(lam[0]), parameters)
    gamma = np.empty(len(lam))
    for i, length in enumerate(lam):
        gamma[i], mesh, y, parameters = solve_extended(
            n, w_f, float(length), mesh, y, parameters, tolerance, 10 * MAX_NODES
        )
    return gamma
