"""The equations with drag as jets, from the fish up: one unknown, the radius of the fish.

NRL Report 7048, Eqs. (12), (15b), (20), (21). Lengths over g / Omega^2, axes turned so that the fish is at (r, 0, 0),
u the arc length from the fish, h the height above it, V = (-Y, X, 0), F the force of the cable:

    dX/du = -F_x / T,  dY/du = -F_y / T,  dh/du = F_z / T,
    dF/du = (X, Y, w) - kappa |V_n| V_n - kappa_t |V_t| V_t,   kappa = C / gamma^2,   kappa_t = C_t / gamma^2
    at u = 0:  F = (gamma^2 m_f r, -C_f r^2, gamma^2 w_f)

The tow point is where X^2 + Y^2 = gamma^4 at u = gamma^2 lambda. In d(sigma) = du / T, with m = X F_y - Y F_x the
moment about the axis, b = m / T^2 and g = T |V_n| = sqrt(F_z^2 (X^2 + Y^2) + (X F_x + Y F_y)^2),

    X' = -F_x,  Y' = -F_y,  h' = F_z,  u' = T,  e = kappa g b + kappa_t m b
    F_x' = T X + kappa g Y + e F_x,  F_y' = T Y - kappa g X + e F_y,  F_z' = w T + e F_z
    T' = X F_x + Y F_y + w F_z + kappa_t m b T

The normal drag does no work along the cable, so T + (X^2 + Y^2) / 2 - w h stays, but for the tangential drag. From
m <= 0 at the fish m only falls: the flow along the cable never turns, and |V_t| V_t is smooth. |V_n| V_n is not where
the cable meets the axis, where the steps shrink to the distance from it.
"""

from math import log, sqrt
from typing import Any, NamedTuple

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.compiling import helper, kernel
from towatlas.kernels.series import FIRST, ORDER, PRODUCT, RATE, RATIO, ROOT, T, U, clear, march_of, reach, run, value
from towatlas.kernels.system import C_F, C_T, LAM, M_F, W_F, C, W

X, Y, H, FX, FY, FZ = range(FIRST, FIRST + 6)
STATE = 8  # quantities up to here are marched, the rest are intermediate
# X^2 + Y^2, F_z^2, X F_x + Y F_y, g^2, g, kappa g, m, T^2, b, m b, kappa_t m b, kappa_t m b T, kappa g b
RHO2, FZ2, D, G2, G, KG, M, T2, B, MB, TB, TBT, E = range(STATE, STATE + 13)
# Parameters as jets, in the coefficient of order 0: radius of the fish, gamma^2, kappa, kappa_t, w, 1.
R, SPEED2, KAPPA, KAPPA_T, WEIGHT, ONE = range(STATE + 13, STATE + 19)
# Room for the start: root(1 + 4 e^2), sine and cosine, the tangent, the load over T'.
SLANT, SINE, COSINE, TX, TY, TZ, UPRIGHT = range(STATE + 19, STATE + 26)
QUANTITIES = STATE + 26
# Rows of the result: the state, and log(rho / gamma^2), zero at an equilibrium.
RESULT_ROWS = STATE - FIRST + 2
TENSION_ROW, LOG_RHO_ROW = STATE - FIRST, STATE - FIRST + 1
# Where the shot of a bare tip begins, in units of its load: an error of this size squared is forgotten on the way.
TIP_REACH = 1e-9
# Error of the force, in units of that of the wave, at which a step has gone past the axis.
PAST_AXIS = 1e-15


ALWAYS, MOMENT, NORMAL, TANGENTIAL = range(4)
ALL = np.array([True, True, True, True])

EQUATIONS = np.array(
    [
        (RATE, T, X, FX, 1, ALWAYS),
        (RATE, T, Y, FY, 1, ALWAYS),
        (RATE, X, FX, T, 1, ALWAYS),
        (RATE, Y, FY, T, 1, ALWAYS),
        (PRODUCT, X, FY, M, 1, MOMENT),
        (PRODUCT, Y, FX, M, -1, MOMENT),
        (PRODUCT, T, T, T2, 1, MOMENT),
        (RATIO, M, T2, B, 1, MOMENT),
        (PRODUCT, X, X, RHO2, 1, NORMAL),
        (PRODUCT, Y, Y, RHO2, 1, NORMAL),
        (PRODUCT, FZ, FZ, FZ2, 1, NORMAL),
        (PRODUCT, X, FX, D, 1, NORMAL),
        (PRODUCT, Y, FY, D, 1, NORMAL),
        (PRODUCT, FZ2, RHO2, G2, 1, NORMAL),
        (PRODUCT, D, D, G2, 1, NORMAL),
        (ROOT, G2, G2, G, 1, NORMAL),
        (PRODUCT, KAPPA, G, KG, 1, NORMAL),
        (RATE, KG, Y, FX, 1, NORMAL),
        (RATE, KG, X, FY, -1, NORMAL),
        (PRODUCT, KG, B, E, 1, NORMAL),
        (PRODUCT, M, B, MB, 1, TANGENTIAL),
        (PRODUCT, KAPPA_T, MB, TB, 1, TANGENTIAL),
        (RATE, TB, T, T, 1, TANGENTIAL),
        (PRODUCT, ONE, TB, E, 1, TANGENTIAL),
        (RATE, E, FX, FX, 1, MOMENT),
        (RATE, E, FY, FY, 1, MOMENT),
        (RATE, E, FZ, FZ, 1, MOMENT),
    ]
)
TENSION = np.array(
    [
        (PRODUCT, FX, FX, T2, 1, ALWAYS),
        (PRODUCT, FY, FY, T2, 1, ALWAYS),
        (PRODUCT, FZ, FZ, T2, 1, ALWAYS),
        (ROOT, T2, T2, T, 1, ALWAYS),
    ]
)
FISH = np.array([(PRODUCT, R, SPEED2, TX, 1, ALWAYS), (PRODUCT, R, R, TY, -1, ALWAYS)])
# A bare tip hangs where the load across it is none: with e the drag over the load in the vertical plane, behind that
# load by the angle of sine 2 e / (1 + sqrt(1 + 4 e^2)). The tension rises as T2 = load cosine + kappa_t r^2 sine^2.
TIP = np.array(
    [
        (PRODUCT, R, R, RHO2, 1, ALWAYS),
        (PRODUCT, R, R, G2, 1, ALWAYS),
        (PRODUCT, WEIGHT, WEIGHT, G2, 1, ALWAYS),
        (ROOT, G2, G2, G, 1, ALWAYS),
        (PRODUCT, KAPPA, RHO2, KG, 1, ALWAYS),
        (RATIO, KG, G, E, 1, ALWAYS),
        (PRODUCT, ONE, ONE, D, 1, ALWAYS),
        (PRODUCT, E, E, D, 4, ALWAYS),
        (ROOT, D, D, SLANT, 1, ALWAYS),
        (PRODUCT, ONE, ONE, SLANT, 1, ALWAYS),
        (PRODUCT, ONE, E, M, 2, ALWAYS),
        (RATIO, M, SLANT, SINE, 1, ALWAYS),
        (PRODUCT, ONE, ONE, FZ2, 1, ALWAYS),
        (PRODUCT, SINE, SINE, FZ2, -1, ALWAYS),
        (ROOT, FZ2, FZ2, COSINE, 1, ALWAYS),
        (PRODUCT, SINE, SINE, MB, 1, ALWAYS),
        (PRODUCT, MB, RHO2, TB, 1, ALWAYS),
        (PRODUCT, KAPPA_T, TB, T2, 1, ALWAYS),
        (PRODUCT, G, COSINE, T2, 1, ALWAYS),
        (RATIO, COSINE, G, UPRIGHT, 1, ALWAYS),
        (PRODUCT, UPRIGHT, R, TX, 1, ALWAYS),
        (PRODUCT, ONE, SINE, TY, -1, ALWAYS),
        (PRODUCT, UPRIGHT, WEIGHT, TZ, 1, ALWAYS),
        (PRODUCT, TX, T2, FX, 1, ALWAYS),
        (PRODUCT, TY, T2, FY, 1, ALWAYS),
        (PRODUCT, TZ, T2, FZ, 1, ALWAYS),
    ]
)
RADIUS = np.array([(PRODUCT, X, X, RHO2, 1, ALWAYS), (PRODUCT, Y, Y, RHO2, 1, ALWAYS)])
POWERS = np.array([(PRODUCT, D, D, MB, 1, ALWAYS), (PRODUCT, MB, D, TB, 1, ALWAYS)])


@helper
def _tension(c, jets):
    clear(c, T, T + 1, 0)
    clear(c, T2, T2 + 1, 0)
    run(c, TENSION, 0, jets, ALL)


@helper
def _expand(c, paid, w, jets):
    """Taylor coefficients in sigma of the equations above."""
    normal, tangential = c[KAPPA, 0, 0] != 0.0, c[KAPPA_T, 0, 0] != 0.0
    groups = np.array([True, normal or tangential, normal, tangential])
    _tension(c, jets)
    for k in range(ORDER):
        clear(c, STATE, R, k)
        share = 1.0 / (k + 1)
        for n in range(c.shape[1]):
            c[U, n, k + 1] = share * c[T, n, k]
            c[X, n, k + 1] = -share * c[FX, n, k]
            c[Y, n, k + 1] = -share * c[FY, n, k]
            c[H, n, k + 1] = share * c[FZ, n, k]
            c[FX, n, k + 1] = c[FY, n, k + 1] = 0.0
            c[FZ, n, k + 1] = share * w * c[T, n, k]
            c[T, n, k + 1] = share * w * c[FZ, n, k]
        run(c, EQUATIONS, k, jets, groups)


@helper
def _length(c):
    """Step at which the last two terms reach the truncation bound, relative to the local amplitudes.

    The amplitude is that of the wave, sqrt(rho^2 + f^2 / T), f the horizontal force. The first variation is held to
    its own, the others to the larger of their own and that of the solution.
    """
    tension = c[T, 0, 0]
    h = np.inf
    first = 0.0
    for n in range(c.shape[1]):
        radial = c[X, n, 0] ** 2 + c[Y, n, 0] ** 2
        amplitude = sqrt(radial + (c[FX, n, 0] ** 2 + c[FY, n, 0] ** 2) / tension)
        if n == 0:
            first = amplitude
        elif n > 1 or amplitude == 0.0:
            amplitude = max(amplitude, first)
        scale = amplitude * sqrt(tension)
        upright = tension * max(1.0, amplitude / first)
        for k in (ORDER - 1, ORDER):
            size = max(
                max(abs(c[X, n, k]), abs(c[Y, n, k])) / amplitude,
                max(max(abs(c[FX, n, k]), abs(c[FY, n, k])) / scale, abs(c[FZ, n, k]) / upright),
            )
            h = min(h, reach(max(size, abs(c[H, n, k]) / upright), k))
    return h


@helper
def _check_axis(c, new, h):
    """-1 where a step has gone past the axis: 0 otherwise.

    Close by, g = T |V_n| is all but the absolute value of a smooth function, of which the series knows one branch only
    and its last terms nothing: the drag at the end of the step tells.
    """
    if c[KAPPA, 0, 0] == 0.0:
        return 0
    x, y, fx, fy, fz = new[X, 0], new[Y, 0], new[FX, 0], new[FY, 0], new[FZ, 0]
    g = sqrt(fz * fz * (x * x + y * y) + (x * fx + y * fy) ** 2)
    wrong = c[KAPPA, 0, 0] * abs(value(c, G, 0, h) - g) * h
    return -1 if wrong > PAST_AXIS * sqrt(c[T, 0, 0]) else 0


_march = march_of(_expand, _length, _check_axis)


@helper
def _set_parameters(c, r, gamma2, system, places):
    """Jets of the parameters: r, gamma and C times the exponentials of their monomials.

    places : the monomials of the first three powers in log r, and of the first in log gamma and log C; 0 if absent.
    """
    clear(c, 0, QUANTITIES, 0)
    c[ONE, 0, 0] = 1.0
    c[WEIGHT, 0, 0] = system[W]
    c[R, 0, 0] = r
    c[SPEED2, 0, 0] = gamma2
    c[KAPPA, 0, 0] = system[C] / gamma2
    c[KAPPA_T, 0, 0] = system[C_T] / gamma2
    factor = r
    for power in range(1, 4):
        factor /= power
        if places[power - 1] > 0:
            c[R, places[power - 1], 0] = factor
    if places[3] > 0:
        c[SPEED2, places[3], 0] = 2.0 * gamma2
        c[KAPPA, places[3], 0] = -2.0 * c[KAPPA, 0, 0]
        c[KAPPA_T, places[3], 0] = -2.0 * c[KAPPA_T, 0, 0]
    if places[4] > 0:
        c[KAPPA, places[4], 0] = c[KAPPA, 0, 0]


@helper
def _start(c, system, jets):
    """State at the fish, or just above a bare tip; returns the cable paid out."""
    bare = system[W_F] == 0.0 and system[M_F] == 0.0 and system[C_F] == 0.0
    run(c, TIP if bare else FISH, 0, jets, ALL)
    u = TIP_REACH * c[T2, 0, 0] / (1.0 + c[KAPPA, 0, 0] * c[R, 0, 0]) if bare else 0.0
    for n in range(c.shape[1]):
        c[X, n, 0] = c[R, n, 0] - u * c[TX, n, 0]
        c[Y, n, 0] = -u * c[TY, n, 0]
        c[H, n, 0] = u * c[TZ, n, 0]
        c[FX, n, 0] = u * c[FX, n, 0] if bare else system[M_F] * c[TX, n, 0]
        c[FY, n, 0] = u * c[FY, n, 0] if bare else system[C_F] * c[TY, n, 0]
        c[FZ, n, 0] = u * c[FZ, n, 0] if bare else system[W_F] * c[SPEED2, n, 0]
    if not bare:
        for n in range(c.shape[1]):
            c[Y, n, 0] = c[H, n, 0] = 0.0
    return u


@helper
def _finish(c, jets, result):
    """Copy the state reached, its tension and log(rho / gamma^2), jets, into the result."""
    _tension(c, jets)
    clear(c, STATE, R, 0)
    run(c, RADIUS, 0, jets, ALL)
    # log(c (1 + x)) = log c + x - x^2 / 2 + x^3 / 3, x without a constant: nothing follows in a jet of third degree.
    leading = c[RHO2, 0, 0]
    for n in range(1, c.shape[1]):
        c[D, n, 0] = c[RHO2, n, 0] / leading
    run(c, POWERS, 0, jets, ALL)
    for n in range(c.shape[1]):
        for q in range(FIRST, STATE):
            result[q - FIRST, n] = c[q, n, 0]
        result[TENSION_ROW, n] = c[T, n, 0]
        # gamma^2 moves with log gamma.
        shift = c[SPEED2, n, 0] / c[SPEED2, 0, 0]
        result[LOG_RHO_ROW, n] = 0.5 * (c[D, n, 0] - c[MB, n, 0] / 2.0 + c[TB, n, 0] / 3.0) - shift
    result[LOG_RHO_ROW, 0] = 0.5 * log(leading) - log(c[SPEED2, 0, 0])


class Shots(NamedTuple):
    """Shots to make, a row each: radius r of the fish and speed gamma^2, lengths over g / Omega^2.

    systems : shape (rows, len(COLUMNS)), as kernels.system names them. shares : the part of the cable to shoot over.
    """

    r: Any
    gamma2: Any
    systems: Any
    shares: Any


class Algebra(NamedTuple):
    """A kind of jet: products and places as in `towatlas.solve.jets`, and the degree."""

    products: Any
    places: Any
    degree: Any


class Reached(NamedTuple):
    """What the shots came to: state : shape (rows, RESULT_ROWS, monomials), X, Y, h, F_x, F_y, F_z, T and
    log(rho / gamma^2) at the end; steps made; statuses.
    """

    state: Any
    steps: Any
    statuses: Any


@helper
def _shoot(c, new, shots, i, algebra, max_steps, trace, result):
    """One shot over a share of the cable; returns steps and a status."""
    system, jets = shots.systems[i], algebra.products
    _set_parameters(c, shots.r[i], shots.gamma2[i], system, algebra.places)
    paid = _start(c, system, jets)
    end = np.empty(c.shape[1])
    for n in range(len(end)):
        end[n] = system[LAM] * shots.shares[i] * c[SPEED2, n, 0]
    outcome, steps = status.OK, 0
    if paid < end[0]:
        _, steps, outcome = _march(c, new, system[W], jets, algebra.degree, paid, 0.0, end, max_steps, trace)
    _finish(c, jets, result)
    if not np.isfinite(result[LOG_RHO_ROW, 0]) and outcome == status.OK:
        outcome = status.BAD_INPUT
    return steps, outcome


@kernel
def shoot_drag(shots, algebra, max_steps, trace, reached, begin, stop):
    """Shots begin..stop-1 of those given; results go to the same rows of `reached`.

    trace : u, X, Y, h, F after each step of the last shot, as many as there is room for.
    """
    c = np.zeros((QUANTITIES, reached.state.shape[2], ORDER + 1))
    new = np.zeros((STATE, reached.state.shape[2]))
    for i in range(begin, stop):
        reached.steps[i], reached.statuses[i] = _shoot(c, new, shots, i, algebra, max_steps, trace, reached.state[i])
