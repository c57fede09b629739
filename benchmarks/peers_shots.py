"""The same shots by other people's integrators: SciPy, heyoka, CyRK. Those not installed are left out, and said so."""

import importlib.util
from collections.abc import Callable
from functools import cache
from typing import Any

import numba
import numpy as np
from scipy.integrate import solve_ivp

from towatlas.kernels.compiling import opened
from towatlas.kernels.vacuum import start

Array = np.ndarray
BATCH = 8
PEERS = {"heyoka": "heyoka", "CyRK": "CyRK"}


def missing() -> list[str]:
    """Peers not installed."""
    return [name for name, module in PEERS.items() if importlib.util.find_spec(module) is None]


@cache
def _begin() -> Callable:
    return opened(start)


def starts(a: Array, mu: Array, tau: Array) -> Array:
    """Rows t, f, p, v, q that shots start from."""
    begin = _begin()
    found = np.array([begin(*row) for row in zip(a, mu, tau, strict=True)])
    return np.stack([mu + found[:, 0], found[:, 1], found[:, 2], found[:, 4], found[:, 5]])


def _slopes(t: float, y: Array) -> tuple:
    f, p, v, q = y
    r = np.hypot(t, f)
    return p, -f / r, q, -(t**2) * v / r**3


def scipy_shots(a: Array, mu: Array, tau: Array, method: str, rtol: float) -> tuple[Array, Array]:
    """SciPy's solve_ivp in t, one shot after the other."""
    ends = []
    for (t, *state), end in zip(starts(a, mu, tau).T, mu + tau, strict=True):
        found = solve_ivp(_slopes, (t, end), state, method=method, rtol=rtol, atol=1e-14)
        ends.append(found.y[:, -1] if found.success else np.full(4, np.nan))
    return np.array(ends)[:, 1], np.array(ends)[:, 3]


@cache
def _cyrk_loop() -> Callable:
    """CyRK's DOP853 called from compiled code, one shot after the other."""
    from CyRK import nbsolve_ivp

    @numba.njit
    def slopes(t, y):
        r = np.sqrt(t * t + y[0] * y[0])
        return np.array([y[1], -y[0] / r, y[3], -t * t * y[2] / r**3])

    @numba.njit
    def loop(states, end, rtol, ends):
        for i in range(len(end)):
            found = nbsolve_ivp(
                slopes, (states[0, i], end[i]), states[1:, i].copy(), rtol=rtol, atol=1e-14, rk_method=2, warnings=False
            )
            for j in range(4):
                ends[i, j] = found.y[j, -1] if found.success else np.nan

    return loop


def cyrk_shots(a: Array, mu: Array, tau: Array, rtol: float) -> tuple[Array, Array]:
    """CyRK's DOP853."""
    ends = np.empty((len(a), 4))
    _cyrk_loop()(starts(a, mu, tau), mu + tau, rtol, ends)
    return ends[:, 1], ends[:, 3]


class Heyoka:
    """heyoka's Taylor integrator, one shot at a time or BATCH at once, in t or in sigma.

    In sigma the equations are those of the Taylor step, without root or division. With `event` a shot in sigma ends
    where t says so; without, it is told its length, which a user would not know. Batches take shots sorted by their
    number of steps, so that no lane waits long for another; they know no event, which would stop all lanes at once.
    """

    def __init__(self, variable: str, tolerance: float = 2.2e-16, event: bool = False):
        import heyoka as hy

        self.in_sigma, self.event = variable == "sigma", event
        if self.in_sigma:
            p, f, t, H, q, v, h, k = hy.make_vars("p", "f", "t", "H", "q", "v", "h", "k")
            r, g = H - 0.5 * p * p, h - p * q
            system: list[Any] = [(p, -f), (f, p * r), (t, r), (H, t), (q, -v), (v, q * r + p * g), (h, k), (k, g)]
        else:
            f, p, v, q = hy.make_vars("f", "p", "v", "q")
            r2 = hy.time**2 + f**2
            system = [(f, p), (p, -f * r2**-0.5), (v, q), (q, -(hy.time**2) * v * r2**-1.5)]
        rows = len(system)
        options: dict[str, Any] = {"tol": tolerance}
        if event:
            end = hy.t_event(t - hy.par[0], direction=hy.event_direction.positive)
            options |= {"t_events": [end], "pars": [1.0]}
        self.one = hy.taylor_adaptive(system, np.ones(rows), **options)
        self.many = hy.taylor_adaptive_batch(system, np.ones((rows, BATCH)), tol=tolerance)

    def _begin(self, a: Array, mu: Array, tau: Array, length: Array) -> tuple[Array, Array, Array]:
        """Times to start from and to reach, and states."""
        t, f, p, v, q = starts(a, mu, tau)
        if not self.in_sigma:
            return t, mu + tau, np.stack([f, p, v, q])
        r = np.hypot(t, f)
        states = np.stack([p, f, t, r + 0.5 * p * p, q, v, f * v / r + p * q, np.zeros_like(p)])
        return np.zeros_like(t), length, states

    def _answer(self, ends: Array, far: Array) -> tuple[Array, Array]:
        if not self.in_sigma:
            return ends[1], ends[3]
        p, f, t, H, q, v, _, k = ends
        r = H - 0.5 * p * p
        # What rounding of the length leaves of t.
        rest = far - t
        return p - f / r * rest, q + f / r * k - (t / r) ** 2 * v / r * rest

    def scalar(self, a: Array, mu: Array, tau: Array, length: Array) -> tuple[Array, Array, Array]:
        """p, q and the number of steps of each shot."""
        begin, far, states = self._begin(a, mu, tau, length)
        ends, steps = np.empty_like(states), np.empty(len(a))
        one = self.one
        for i in range(len(a)):
            one.time = begin[i]
            one.state[:] = states[:, i]
            if self.event:
                one.pars[0] = mu[i] + tau[i]
                one.reset_cooldowns()
            steps[i] = one.propagate_until(1e300 if self.event else far[i])[3]
            ends[:, i] = one.state
        return *self._answer(ends, mu + tau), steps

    def batch(self, a: Array, mu: Array, tau: Array, length: Array) -> tuple[Array, Array]:
        """p and q; shots come sorted, in a multiple of BATCH."""
        begin, far, states = self._begin(a, mu, tau, length)
        ends = np.empty_like(states)
        many = self.many
        for first in range(0, len(a), BATCH):
            part = slice(first, first + BATCH)
            many.set_time(begin[part])
            many.state[:] = states[:, part]
            many.propagate_until(far[part])
            ends[:, part] = many.state
        return self._answer(ends, mu + tau)
