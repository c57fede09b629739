"""What a SciPy user would write: the fish-up shot and its variation with solve_ivp, the fold with root."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root


def _shot(a: float, mu: float, tau: float, rtol: float) -> np.ndarray:
    """State (f, p, v, q) at the end of a fish-up shot in t."""

    def slopes(t, y):
        f, p, v, q = y
        r = np.hypot(t, f)
        return p, -f / r, q, -(t**2) * v / r**3

    # The 0/0 at a bare tip is stepped over with the first term of its series.
    start = max(mu, 1e-9)
    solution = solve_ivp(slopes, (start, mu + tau), (start * a, a, start, 1.0), method="DOP853", rtol=rtol, atol=1e-14)
    return solution.y[:, -1]


def critical_speed(lam: float, w_f: float, n: int, a: float, gamma: float, rtol: float = 1e-10) -> float:
    """gamma_cn from a guess (a, gamma) of the fish offset and the speed."""
    sign = 1.0 if n % 2 == 0 else -1.0

    def residual(x):
        gamma2 = np.exp(2.0 * x[1])
        _, p, _, q = _shot(np.exp(x[0]), gamma2 * w_f, gamma2 * lam, rtol)
        return q, sign * p / gamma2 - 1.0

    found = root(residual, (np.log(a), np.log(gamma)), tol=1e-12)
    return float(np.exp(found.x[1]))
