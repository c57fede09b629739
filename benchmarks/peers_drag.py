"""Equilibria and folds with drag as a SciPy user would solve for them, Eqs. (19)-(23) in arc length.

Down from the tow point, where three reactions are unknown, as the report expects; up from the fish, where its radius
is; and by collocation. Axes turn with the tow, z down; lengths over the tow radius.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import brentq, root

from benchmarks.peers_folds import OutOfPatienceError
from towatlas.system import System

Array = np.ndarray
# Right-hand sides that one answer may ask for, a second or so, before it counts as lost.
PATIENCE = 200_000
MAX_NODES = 5000
# Of a bare cable so much is left out at its end, where the equations are 0/0; the square of it counts.
TIP = 1e-8
# Step of derivatives by complex numbers: nothing is subtracted.
COMPLEX = 1e-30
# Roots nearer to each other than this are one.
SAME = 1e-4


def slopes(y: Any, gamma: Any, system: System) -> tuple:
    """d(x, y, z, R)/ds; of numbers real or complex, or of arrays."""
    px, py, _, a, b, c = y
    tension = (a * a + b * b + c * c) ** 0.5
    a, b, c = a / tension, b / tension, c / tension
    along = px * b - py * a
    vx, vy, vz = -py - along * a, px - along * b, -along * c
    across = system.C * (vx * vx + vy * vy + vz * vz) ** 0.5
    past = system.C_t * (along * along) ** 0.5 * along
    g2 = gamma * gamma
    return (
        *(a, b, c, -g2 * (px - across * vx - past * a), -g2 * (py - across * vy - past * b)),
        g2 * (across * vz + past * c) - system.w,
    )


def end_force(x: Any, y: Any, gamma: Any, system: System) -> tuple:
    """Force of the cable at its lower end: that of the fish, Eqs. (22)-(23); of a bare tip, TIP above it."""
    g2, r = gamma * gamma, (x * x + y * y) ** 0.5
    if system.m_f or system.w_f or system.C_f:
        out, back, down = g2 * system.m_f * r, g2 * system.C_f * r * r, system.w_f
    else:
        # The load across the tip vanishes.
        load, drag = (system.w**2 + (g2 * r) ** 2) ** 0.5, system.C * g2 * r * r
        sine = 2.0 * drag / (load + (load * load + 4.0 * drag * drag) ** 0.5)
        cosine = (1.0 - sine * sine) ** 0.5
        tension = TIP * (load * cosine + system.C_t * g2 * (r * sine) ** 2)
        out, back, down = tension * cosine * g2 * r / load, tension * sine, tension * cosine * system.w / load
    return (out * x + back * y) / r, (out * y - back * x) / r, down


def paid_out(system: System) -> float:
    """Cable that is integrated over."""
    return system.lam if system.m_f or system.w_f or system.C_f else system.lam - TIP


class _Counted:
    """The right-hand side for solve_ivp, in Python's own numbers, which are faster than arrays of six."""

    def __init__(self, system: System):
        self.system, self.calls = system, 0

    def __call__(self, s: float, y: Array, gamma: Any) -> tuple:
        self.calls += 1
        if self.calls > PATIENCE:
            raise OutOfPatienceError
        return slopes(y.tolist(), gamma, self.system)

    def march(self, y: Any, length: float, gamma: Any, rtol: float) -> Array:
        found = solve_ivp(self, (0.0, length), np.array(y), "DOP853", rtol=rtol, atol=1e-13, args=(gamma,))
        return found.y[:, -1]

    def log_rho(self, x: Any, gamma: Any, rtol: float) -> Any:
        """Of a shot up from a fish of log radius x."""
        r = np.exp(x)
        up = (r, 0.0 * r, 0.0 * r, *end_force(r, 0.0 * r, gamma, self.system))
        end = self.march(up, -paid_out(self.system), gamma, rtol)
        return 0.5 * np.log(end[0] ** 2 + end[1] ** 2)


@contextmanager
def quiet() -> Iterator[None]:
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


def _try(solve: Callable[[], Any]) -> Any:
    """None where it gives up."""
    try:
        return solve()
    except (OutOfPatienceError, ValueError, ZeroDivisionError, OverflowError, np.linalg.LinAlgError):
        return None


def _distinct(radii: list[float]) -> Array:
    found: list[float] = []
    for r in sorted(radii):
        if not found or r > found[-1] * (1.0 + SAME):
            found.append(r)
    return np.array(found)


def from_tow_point(system: System, gamma: float, rtol: float, guesses: int = 12) -> Array:
    """r_f by solve_ivp down from the tow point and root on its three reactions, from several guesses.

    Guesses are of a rigid cable whose fish is so far out and so far behind; the first reactions of the pendulum.
    """
    count = _Counted(system)
    weight, length = system.w_f + system.w * system.lam, paid_out(system)

    def down(reactions: Array) -> Array:
        return count.march((1.0, 0.0, 0.0, *reactions * weight), length, gamma, rtol)

    def residual(reactions: Array) -> Array:
        end = down(reactions)
        return (end[3:] - end_force(end[0], end[1], gamma, system)) / weight

    radii: list[float] = []
    for k in range(guesses):
        r, angle = (1.0 + system.lam) ** (k // 4 / max(1, (guesses - 1) // 4)) * 0.5, 0.5 * np.pi * (k % 4)
        pull = gamma**2 * (system.m_f + system.lam) * r / weight
        guess = np.array([pull * np.cos(angle), -pull * np.sin(angle), 1.0])
        count.calls = 0
        found = _try(lambda guess=guess: root(residual, guess, tol=1e-10, options={"maxfev": 100}))
        # By its own tolerance `root` may end short of success at the rounding of the shots: judged by what is left.
        if found is not None and np.abs(found.fun).max() < max(1e-8, 10.0 * rtol):
            end = _try(lambda x=found.x: down(x))
            if end is not None:
                radii.append(float(np.hypot(end[0], end[1])))
    return _distinct(radii)


def from_fish(system: System, gamma: float, rtol: float, points: int = 60) -> Array:
    """r_f by solve_ivp up from the fish: a scan of its radius, and brentq where the tow point crosses its circle."""
    count = _Counted(system)
    x = np.linspace(np.log(1e-4), np.log(1.0 + system.lam), points)

    def miss(z: float) -> float:
        count.calls = 0
        value = _try(lambda: count.log_rho(z, gamma, rtol))
        return np.nan if value is None else float(value)

    value = [miss(z) for z in x]
    radii = []
    for k in range(points - 1):
        if value[k] * value[k + 1] < 0.0:
            at = _try(lambda k=k: brentq(miss, x[k], x[k + 1], xtol=1e-15, rtol=1e-14))
            if at is not None and np.isfinite(at):
                radii.append(float(np.exp(at)))
    return _distinct(radii)


def by_collocation(system: System, gamma: float, shape: Array, tolerance: float) -> float:
    """r_f by solve_bvp on the six equations from a guess of the shape, (6, nodes) at equal arc lengths; nan if lost."""
    mesh = np.linspace(0.0, paid_out(system), shape.shape[1])

    def conditions(low: Array, high: Array) -> Array:
        force = end_force(high[0], high[1], gamma, system)
        return np.array([low[0] - 1.0, low[1], low[2], *(high[3:] - force)])

    def solve() -> Any:
        return solve_bvp(
            lambda s, y: np.array(slopes(y, gamma, system)),
            conditions,
            mesh,
            shape,
            tol=tolerance,
            max_nodes=MAX_NODES,
        )

    found = _try(solve)
    return float(np.hypot(*found.y[:2, -1])) if found is not None and found.success else np.nan


def fold_by_root(system: System, guess: tuple[float, float], rtol: float) -> float:
    """gamma of a fold by solve_ivp and root on log rho and its slope, from (r_f, gamma); slopes by complex numbers."""
    count = _Counted(system)

    def residual(z: Array) -> Array:
        value = count.log_rho(complex(z[0], COMPLEX), complex(np.exp(z[1])), rtol)
        return np.array([value.real, value.imag / COMPLEX])

    found = _try(lambda: root(residual, np.log(guess), tol=1e-12, options={"maxfev": 60}))
    good = found is not None and np.abs(found.fun).max() < max(1e-7, 100.0 * rtol)
    return float(np.exp(found.x[1])) if good else np.nan


def fold_by_collocation(system: System, guess: tuple[float, float], tolerance: float) -> float:
    """gamma of a fold by solve_bvp on the equations and their first variation, log r_f and log gamma unknown."""

    def varied(y: Array, gamma: Array) -> Array:
        both = np.array(slopes(y[:6] + 1j * COMPLEX * y[6:], gamma, system))
        return -system.lam * np.concatenate([both.real, both.imag / COMPLEX])

    def begin(p: Array) -> Array:
        r = np.exp(complex(p[0], COMPLEX))
        state = np.array([r, 0.0, 0.0, *end_force(r, 0.0, np.exp(p[1]), system)])
        return np.concatenate([state.real, state.imag / COMPLEX])

    def conditions(low: Array, high: Array, p: Array) -> Array:
        slope = high[0] * high[6] + high[1] * high[7]
        return np.array([*(low - begin(p)), high[0] ** 2 + high[1] ** 2 - 1.0, slope])

    def solve() -> Any:
        p, mesh = np.log(guess), np.linspace(0.0, 1.0, 60)
        shot = solve_ivp(
            lambda s, y: varied(y[:, None], np.exp(p[1]))[:, 0], (0.0, 1.0), begin(p), "DOP853", mesh, rtol=1e-6
        )
        return solve_bvp(
            lambda s, y, p: varied(y, np.exp(p[1])), conditions, shot.t, shot.y, p, tol=tolerance, max_nodes=MAX_NODES
        )

    found = _try(solve)
    return float(np.exp(found.p[1])) if found is not None and found.success else np.nan
