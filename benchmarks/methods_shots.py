"""Ways to integrate a shot, for comparison only: Runge-Kutta with fixed steps, of order 8, Taylor of other orders.

Each takes the same start as the kernels (towatlas.kernels.vacuum.start, the series at a bare tip) and returns (p, q).
"""

from collections.abc import Callable
from math import sqrt
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np
from scipy.integrate._ivp import dop853_coefficients as dop853

import towatlas.kernels.lanes
from towatlas.kernels import calls, steppers
from towatlas.kernels.calls import END_COLUMNS, FOLD_COLUMNS
from towatlas.kernels.compiling import opened
from towatlas.kernels.steppers import taylor_step
from towatlas.kernels.vacuum import boundary_error, start

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract"}}
LANES = 32
STAGES = dop853.N_STAGES
A, B, C = (np.ascontiguousarray(x) for x in (dop853.A[:STAGES, :STAGES], dop853.B, dop853.C[:STAGES]))
E3, E5 = dop853.E3.copy(), dop853.E5.copy()

Array = np.ndarray


def march(a: Array, mu: Array, tau: Array, kernel: Callable = calls.march) -> tuple[Array, Array]:
    """The kernel of this project, to the end of the cable."""
    rows = len(a)
    ends, folds = np.empty((rows, END_COLUMNS)), np.empty((rows, 1, FOLD_COLUMNS))
    orders = np.ones(rows, np.int64), np.zeros(rows, np.int64)
    kernel(a, mu, tau, *orders, 10**7, ends, folds, np.empty(rows, np.int64), np.empty(rows, np.int64), 0, rows)
    return ends[:, 2], ends[:, 5]


def march_of_order(order: int, truncation: float = steppers.TRUNCATION) -> Callable:
    """`march` with the Taylor step of another order, compiled for the occasion and not kept."""
    before = steppers.TRUNCATION
    try:
        steppers.TRUNCATION = truncation
        step = steppers.make_taylor_step(order)
    finally:
        steppers.TRUNCATION = before
    source = Path(towatlas.kernels.lanes.__file__).read_text()
    module = ModuleType(f"shots_of_order_{order}")
    module.__dict__["__file__"] = towatlas.kernels.lanes.__file__
    for old, new in (
        (
            "from towatlas.kernels.compiling import helper, inlined, kernel\n",
            "from towatlas.kernels.compiling import helper, inlined\n",
        ),
        ("from towatlas.kernels.steppers import taylor_step\n", ""),
        ("@kernel\n", "@helper\n"),
    ):
        assert old in source
        source = source.replace(old, new)
    module.__dict__["taylor_step"] = step
    exec(compile(source, f"<march of order {order}>", "exec"), module.__dict__)
    return opened(module.__dict__["march"])


@numba.njit(forceinline=True, **OPTIONS)
def _slopes(kind, s, t, f, p, v, q):
    """Slopes of (t, f, p, v, q) in t (kind 0), sqrt(t) (1) or sigma (2)."""
    r = sqrt(t * t + f * f)
    u = t / r
    w = 1.0 if kind == 0 else (2.0 * s if kind == 1 else r)
    return w, w * p, -w * f / r, w * q, -w * u * u * v / r


@numba.njit(forceinline=True, **OPTIONS)
def _rk4(kind, s, h, t, f, p, v, q):
    k1 = _slopes(kind, s, t, f, p, v, q)
    g = 0.5 * h
    k2 = _slopes(kind, s + g, t + g * k1[0], f + g * k1[1], p + g * k1[2], v + g * k1[3], q + g * k1[4])
    k3 = _slopes(kind, s + g, t + g * k2[0], f + g * k2[1], p + g * k2[2], v + g * k2[3], q + g * k2[4])
    k4 = _slopes(kind, s + h, t + h * k3[0], f + h * k3[1], p + h * k3[2], v + h * k3[3], q + h * k3[4])
    g = h * (1.0 / 6.0)
    return (
        t + g * (k1[0] + 2.0 * (k2[0] + k3[0]) + k4[0]),
        f + g * (k1[1] + 2.0 * (k2[1] + k3[1]) + k4[1]),
        p + g * (k1[2] + 2.0 * (k2[2] + k3[2]) + k4[2]),
        v + g * (k1[3] + 2.0 * (k2[3] + k3[3]) + k4[3]),
        q + g * (k1[4] + 2.0 * (k2[4] + k3[4]) + k4[4]),
    )


def _make_rk4_fish_up(kind: int) -> Callable:
    @numba.njit(**OPTIONS)
    def shots(a, mu, tau, length, segments, p_end, q_end):
        t, f, p, v, q = np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES), np.empty(LANES)
        s, h = np.empty(LANES), np.empty(LANES)
        rows = len(a)
        for block in range(0, rows, LANES):
            for lane in range(LANES):
                i = min(block + lane, rows - 1)
                paid, f[lane], p[lane], _, v[lane], q[lane], _ = start(a[i], mu[i], tau[i])
                t[lane] = mu[i] + paid
                end = mu[i] + tau[i]
                s[lane] = sqrt(t[lane]) if kind == 1 else t[lane]
                far = end if kind == 0 else (sqrt(end) if kind == 1 else s[lane] + length[i])
                h[lane] = (far - s[lane]) / segments
            for _ in range(segments):
                for lane in range(LANES):
                    t[lane], f[lane], p[lane], v[lane], q[lane] = _rk4(
                        kind, s[lane], h[lane], t[lane], f[lane], p[lane], v[lane], q[lane]
                    )
                    s[lane] += h[lane]
            for lane in range(min(LANES, rows - block)):
                i = block + lane
                # What truncation leaves of t, in one more step.
                rest = mu[i] + tau[i] - t[lane]
                end = _rk4(0, t[lane], rest, t[lane], f[lane], p[lane], v[lane], q[lane])
                p_end[i], q_end[i] = end[2], end[4]

    return shots


RK4_FISH_UP = {name: _make_rk4_fish_up(kind) for kind, name in enumerate(("t", "sqrt(t)", "sigma"))}


def rk4_fish_up(variable: str, a: Array, mu: Array, tau: Array, length: Array, segments: int) -> tuple[Array, Array]:
    """Classical Runge-Kutta in equal steps of a variable; sigma is given its `length`, which a user would not know."""
    p, q = np.empty(len(a)), np.empty(len(a))
    RK4_FISH_UP[variable](a, mu, tau, length, segments, p, q)
    return p, q


@numba.njit(**OPTIONS)
def _lengths(a, mu, tau, length):
    for i in range(len(a)):
        paid, f, p, _, v, q, _ = start(a[i], mu[i], tau[i])
        total, low, high, forced = 0.0, 0.0, 0.0, 0.0
        while True:
            dt, _, f_new, p_new, v_new, q_new, h = taylor_step(mu[i] + paid, f, p, v, q, forced)
            beyond = paid + dt >= tau[i]
            if forced == 0.0 and not beyond:
                paid, f, p, v, q = paid + dt, f_new, p_new, v_new, q_new
                total += h
                continue
            # From here on the step that overshoots is bisected.
            if beyond:
                high = h
            else:
                low = h
            forced = 0.5 * (low + high)
            if high - low <= 1e-16 * (total + high) or not low < forced < high:
                break
        length[i] = total + high


def lengths(a: Array, mu: Array, tau: Array) -> Array:
    """Lengths of shots in sigma."""
    length = np.empty(len(a))
    _lengths(a, mu, tau, length)
    return length


@numba.njit(**OPTIONS)
def _derivative(t, y, dy):
    f, v = y[0], y[2]
    r = sqrt(t * t + f * f)
    u = t / r
    dy[0], dy[1], dy[2], dy[3] = y[1], -f / r, y[3], -u * u * v / r


@numba.njit(**OPTIONS)
def _stages(t, y, h, k, work):
    for stage in range(1, STAGES):
        for j in range(4):
            total = 0.0
            for m in range(stage):
                total += A[stage, m] * k[m, j]
            work[j] = y[j] + h * total
        _derivative(t + C[stage] * h, work, k[stage])
    for j in range(4):
        total = 0.0
        for m in range(STAGES):
            total += B[m] * k[m, j]
        work[j] = y[j] + h * total
    _derivative(t + h, work, k[STAGES])


@numba.njit(**OPTIONS)
def _dop853(a, mu, tau, segments, rtol, p_end, q_end):
    """Order 8, Hairer, Norsett and Wanner; `segments` equal steps in t, or as many as rtol asks for where it is 0."""
    k, y, work = np.empty((STAGES + 1, 4)), np.empty(4), np.empty(4)
    for i in range(len(a)):
        paid, y[0], y[1], _, y[2], y[3], _ = start(a[i], mu[i], tau[i])
        t, end = mu[i] + paid, mu[i] + tau[i]
        h = (end - t) / segments if segments > 0 else min(end - t, 1e-2 * sqrt(1.0 + a[i] * a[i]))
        _derivative(t, y, k[0])
        steps = 0
        while t < end and steps < 10**6:
            steps += 1
            last = steps == segments if segments > 0 else h >= end - t
            h = end - t if last else h
            _stages(t, y, h, k, work)
            grow = 1.0
            if segments == 0:
                third, fifth = 0.0, 0.0
                for j in range(4):
                    e3, e5 = 0.0, 0.0
                    for m in range(STAGES + 1):
                        e3 += E3[m] * k[m, j]
                        e5 += E5[m] * k[m, j]
                    scale = rtol * max(abs(y[j]), abs(work[j])) + 1e-14
                    third += (e3 / scale) ** 2
                    fifth += (e5 / scale) ** 2
                size = h * fifth / sqrt((fifth + 0.01 * third) * 4.0) if fifth > 0.0 else 0.0
                grow = min(10.0, max(0.2, 0.9 * size ** (-0.125))) if size > 0.0 else 10.0
                if not size < 1.0:
                    h *= min(1.0, grow)
                    continue
            t = end if last else t + h
            for j in range(4):
                y[j] = work[j]
                k[0, j] = k[STAGES, j]
            h *= grow
        p_end[i], q_end[i] = (y[1], y[3]) if t >= end else (np.nan, np.nan)


def order_8(a: Array, mu: Array, tau: Array, segments: int = 0, rtol: float = 0.0) -> tuple[Array, Array]:
    """DOP853, compiled, in t: `segments` equal steps, or steps of its own choice to `rtol`."""
    p, q = np.empty(len(a)), np.empty(len(a))
    _dop853(a, mu, tau, segments, rtol, p, q)
    return p, q


@numba.njit
def _forward_slopes(x, force, below, gamma2):
    return force / sqrt(below * below + force * force), -gamma2 * x


@numba.njit(parallel=True)
def scalar_forward_shots(lam, w_f, gamma, r_x0, segments, errors):
    """Skop's forward shots, one after the other in a parallel loop: what `forward_shots` is measured by."""
    for i in numba.prange(len(w_f)):
        x, force = 1.0, r_x0[i]
        gamma2, ds = gamma[i] * gamma[i], lam[i] / segments
        for k in range(segments):
            below = w_f[i] + (segments - k) * ds
            x1, f1 = _forward_slopes(x, force, below, gamma2)
            x2, f2 = _forward_slopes(x + 0.5 * ds * x1, force + 0.5 * ds * f1, below - 0.5 * ds, gamma2)
            x3, f3 = _forward_slopes(x + 0.5 * ds * x2, force + 0.5 * ds * f2, below - 0.5 * ds, gamma2)
            x4, f4 = _forward_slopes(x + ds * x3, force + ds * f3, below - ds, gamma2)
            x += ds / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4)
            force += ds / 6.0 * (f1 + 2.0 * f2 + 2.0 * f3 + f4)
        errors[i] = boundary_error(x, force, w_f[i], gamma2)


@numba.njit(**OPTIONS)
def roots_and_divisions(values, rounds, out):
    """As many vector square roots and divisions as `rounds` right-hand sides need, and nothing else: their bound."""
    x = np.empty(LANES)
    for block in range(0, len(values), LANES):
        for lane in range(LANES):
            x[lane] = values[min(block + lane, len(values) - 1)]
        for _ in range(rounds // 4):
            for lane in range(LANES):
                y = x[lane]
                y = y / sqrt(y)
                y = y / sqrt(y)
                y = y / sqrt(y)
                x[lane] = y / sqrt(y)
        for lane in range(min(LANES, len(values) - block)):
            out[block + lane] = x[lane]
