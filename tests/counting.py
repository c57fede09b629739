"""Equilibria counted with no scan grid: bisection on the number of zeros of q along the shot."""

import numpy as np
from helpers import shoot


def count_equilibria(w_f, lam, gamma):
    """Number of equilibria of each system, shape (systems,).

    The number of zeros of q before t_e falls from its linear limit to 0 as the offset a grows. Each fall is an extremum
    of p(t_e; a); between neighbouring extrema p is monotone, so its values there say how often it meets +-gamma^2.
    """
    gamma2 = gamma**2
    mu, tau = gamma2 * w_f, gamma2 * lam
    tiny = np.full(len(mu), 1e-9)
    falls = shoot(tiny, mu, tau, parallel=True).count
    system = np.repeat(np.arange(len(mu)), falls)
    k = np.concatenate([np.arange(1, m + 1) for m in falls]) if len(system) else np.array([], int)
    low = np.full(len(system), np.log(1e-9))
    high = np.log(4 * (gamma2 * (1 + lam) + 1))[system]
    for _ in range(60):
        middle = 0.5 * (low + high)
        above = shoot(np.exp(middle), mu[system], tau[system], parallel=True).count >= k
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    p = shoot(np.exp(0.5 * (low + high)), mu[system], tau[system], parallel=True).p
    total = np.empty(len(mu), int)
    for i in range(len(mu)):
        # From a = 0 (p = 0) through the extrema, the last fall first met, to a -> infinity (p -> infinity).
        path = np.concatenate([[0.0], p[system == i][::-1], [np.inf]])
        total[i] = sum(((path[1:] > level) != (path[:-1] > level)).sum() for level in (gamma2[i], -gamma2[i]))
    return total
