"""The linearised motion about an equilibrium, from the fish up: coefficients on the equilibrium's own shot.

Units and axes of `kernels.drag`: lengths over g / Omega^2, times over 1 / Omega, u the arc length from the fish,
position (X, Y, -h), F the force of the cable, pointing down it, T its size, V = (-Y, X, 0) the flow. With a
perturbation eta exp(sigma t) of the position and phi exp(sigma t) of the force, S = k x, P = 1 - F F^T / T^2 and
d(tau) = du / T,

    eta' = -P phi,   phi' = -T (sigma + S)^2 eta - T A (sigma + S) eta + E P phi
    at the fish:  phi = -[gamma^2 m_f (sigma + S)^2 + A_f (sigma + S)] eta,   A_f = C_f r (1 + e_y e_y^T)
    at the tow point:  eta = 0

where A is minus the derivative of the drag with respect to the velocity, E that with respect to the direction of the
cable. With b = m / T^2, m = V . F, N = V - b F the flow across the cable and G = T |N|,

    T A = kappa (G P + T^2 N N^T / G) - 2 kappa_t b F F^T - kappa_s (W (c V - 2 beta d N)^T + rho A F x)
    E P = kappa (G b P + m N N^T / G + (G / T^2) F N^T) + kappa_t b (2 F N^T + m P)
          + kappa_s (2 beta d b W N^T - rho A V x P)

with W = F x V, A of the side force as in `kernels.drag`, d = A^2 / rho and c = 3 A / rho - 2 d (m <= 0, see there).
Growth rates are the zeros of a function of its solutions (`kernels.evans`).
"""

from typing import Any

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.calls import MOTION_ROWS, MOTION_TERMS, ORDER, TRUNCATION
from towatlas.kernels.compiling import helper, kernel
from towatlas.kernels.drag import (
    ACROSS,
    ALWAYS,
    BETA,
    FIRST,
    FX,
    FY,
    FZ,
    GROUPS,
    KA,
    KAPPA,
    KAPPA_S,
    KAPPA_T,
    KEPT,
    KG,
    NORMAL,
    ON_NORMAL,
    ON_SIDE,
    ON_TANGENT,
    ONE,
    PACE,
    PARAMETERS,
    PRODUCT,
    QUANTITIES,
    RATIO,
    RHO,
    ROUND,
    SCALED,
    SIDE,
    STATE,
    TANGENTIAL,
    ZERO,
    A,
    B,
    D,
    G,
    M,
    T,
    U,
    X,
    Y,
    advance_jets,
    expand_jets,
    step_lengths,
    values,
)
from towatlas.kernels.drag_shots import IDLE, begin_lanes, landing, past_axis
from towatlas.kernels.system import C_F, M_F, W_F
from towatlas.kernels.vector import LANES, absolute, aligned, broadcast, load, square_root, store, where_less

# Quantities after those of kernels.drag: what the matrices are made of, then these, by rows.
UNIT, TT, KGB, KB, MKB, AR, A2R, KC, BA, KBA, KAX, KAY = np.arange(QUANTITIES, QUANTITIES + 12)
SLOPE, BF, N, NG, KN, KS, KBF, WV, KWV, KBW, BKBW, KAF = np.arange(QUANTITIES + 12, QUANTITIES + 48).reshape(12, 3)
KNN, P, TA, EP = np.arange(QUANTITIES + 48, QUANTITIES + 84).reshape(4, 3, 3)
ALL_QUANTITIES = np.int64(QUANTITIES + 84)
FORCE = (FX, FY, FZ)


def _matrices() -> list[tuple[Any, ...]]:
    """The matrices as rows of a program like those of `kernels.drag`."""
    axes = range(3)
    rows = [(PRODUCT, T, T, TT, 1, ALWAYS)]
    rows += [(RATIO, FORCE[i], TT, SLOPE[i], 1, ALWAYS) for i in axes]
    rows += [(SCALED, ONE, UNIT, P[i, i], 1, ALWAYS) for i in axes]
    rows += [(PRODUCT, FORCE[i], SLOPE[j], P[i, j], -1, ALWAYS) for i in axes for j in axes]
    rows += [(PRODUCT, B, FORCE[i], BF[i], 1, ROUND) for i in axes]
    rows += [(SCALED, ONE, Y, N[0], -1, ROUND), (SCALED, ONE, X, N[1], 1, ROUND)]
    rows += [(SCALED, ONE, BF[i], N[i], -1, ROUND) for i in axes]
    rows += [(PRODUCT, KG, B, KGB, 1, ON_NORMAL), (SCALED, KAPPA_T, B, KB, 1, ON_TANGENT)]
    rows += [(PRODUCT, M, KB, MKB, 1, ON_TANGENT)]
    for i in axes:
        rows += [(RATIO, N[i], G, NG[i], 1, ON_NORMAL), (SCALED, KAPPA, NG[i], KN[i], 1, ON_NORMAL)]
        rows += [(PRODUCT, KG, SLOPE[i], KS[i], 1, ON_NORMAL), (PRODUCT, KB, FORCE[i], KBF[i], 1, ON_TANGENT)]
    for i in axes:
        for j in axes:
            rows += [
                (PRODUCT, N[i], KN[j], KNN[i, j], 1, ON_NORMAL),
                (PRODUCT, KG, P[i, j], TA[i, j], 1, ON_NORMAL),
                (PRODUCT, TT, KNN[i, j], TA[i, j], 1, ON_NORMAL),
                (PRODUCT, KBF[i], FORCE[j], TA[i, j], -2, ON_TANGENT),
                (PRODUCT, KGB, P[i, j], EP[i, j], 1, ON_NORMAL),
                (PRODUCT, M, KNN[i, j], EP[i, j], 1, ON_NORMAL),
                (PRODUCT, KS[i], N[j], EP[i, j], 1, ON_NORMAL),
                (PRODUCT, KBF[i], N[j], EP[i, j], 2, ON_TANGENT),
                (PRODUCT, MKB, P[i, j], EP[i, j], 1, ON_TANGENT),
            ]
    return rows + _side_force()


def _side_force() -> list[tuple[Any, ...]]:
    """What the side force adds to the matrices."""
    axes = range(3)
    rows = [(RATIO, A, RHO, AR, 1, ON_SIDE), (PRODUCT, A, AR, A2R, 1, ON_SIDE)]
    rows += [(SCALED, KAPPA_S, AR, KC, 3, ON_SIDE), (SCALED, KAPPA_S, A2R, KC, -2, ON_SIDE)]
    rows += [(SCALED, BETA, A2R, BA, 1, ON_SIDE), (SCALED, KAPPA_S, BA, KBA, 1, ON_SIDE)]
    rows += [(PRODUCT, KA, X, KAX, 1, ON_SIDE), (PRODUCT, KA, Y, KAY, 1, ON_SIDE)]
    rows += [
        (PRODUCT, FZ, X, WV[0], -1, ON_SIDE),
        (PRODUCT, FZ, Y, WV[1], -1, ON_SIDE),
        (SCALED, ONE, D, WV[2], 1, ON_SIDE),
    ]
    rows += [(PRODUCT, KA, FORCE[i], KAF[i], 1, ON_SIDE) for i in axes]
    for i in axes:
        rows += [(PRODUCT, KC, WV[i], KWV[i], 1, ON_SIDE), (PRODUCT, KBA, WV[i], KBW[i], 1, ON_SIDE)]
        rows += [(PRODUCT, KBW[i], B, BKBW[i], 1, ON_SIDE)]
        rows += [(PRODUCT, KWV[i], Y, TA[i, 0], 1, ON_SIDE), (PRODUCT, KWV[i], X, TA[i, 1], -1, ON_SIDE)]
        rows += [(PRODUCT, KBW[i], N[j], TA[i, j], 2, ON_SIDE) for j in axes]
        rows += [(PRODUCT, BKBW[i], N[j], EP[i, j], 2, ON_SIDE) for j in axes]
        # F x, by its columns.
        j, k = (i + 1) % 3, (i + 2) % 3
        rows += [(SCALED, ONE, KAF[k], TA[i, j], 1, ON_SIDE), (SCALED, ONE, KAF[j], TA[i, k], -1, ON_SIDE)]
    for j in axes:
        rows += [(PRODUCT, KAX, P[2, j], EP[0, j], -1, ON_SIDE), (PRODUCT, KAY, P[2, j], EP[1, j], -1, ON_SIDE)]
        rows += [(PRODUCT, KAX, P[0, j], EP[2, j], 1, ON_SIDE), (PRODUCT, KAY, P[1, j], EP[2, j], 1, ON_SIDE)]
    return rows


MATRICES = np.array(_matrices())
# What is kept of a step: the tension, then the matrices P, T A and E P by rows.
KEPT_ROWS = np.array([T, *P.ravel(), *TA.ravel(), *EP.ravel()])
# Orders of their series: the equations know no more.
TERMS, TWO = np.int64(MOTION_TERMS), np.int64(2)
# Last terms of the series of the matrices over a step, as parts of what they change of a wave, and of a wave itself.
# Steps are shortened for a wave's where they are so many times larger.
LEFT, LARGER = 1e-15, 4.0


@helper
def _expand_matrices(c, p, groups):
    """Series of the matrices, after those of the shot, row by row: all they are made of is known to all orders."""
    for place in range(QUANTITIES * KEPT, ALL_QUANTITIES * KEPT):
        store(c, place, broadcast(0.0))
    store(c, UNIT * KEPT, broadcast(1.0))
    for row in range(MATRICES.shape[0]):
        operation, factor = MATRICES[row, 0], np.float64(MATRICES[row, 4])
        a, b, q = MATRICES[row, 1] * KEPT, MATRICES[row, 2] * KEPT, MATRICES[row, 3] * KEPT
        if not groups[MATRICES[row, 5]]:
            continue
        if operation == PRODUCT:
            for k in range(np.int64(ORDER)):
                one = broadcast(0.0)
                for o in range(k + 1):
                    one = one + load(c, a + o) * load(c, b + k - o)
                store(c, q + k, load(c, q + k) + factor * one)
        elif operation == SCALED:
            weight = factor * load(p, MATRICES[row, 1])
            for k in range(np.int64(ORDER)):
                store(c, q + k, load(c, q + k) + weight * load(c, b + k))
        else:
            # RATIO
            for k in range(np.int64(ORDER)):
                one = load(c, a + k)
                for o in range(k):
                    one = one - load(c, q + o) * load(c, b + k - o)
                store(c, q + k, one / load(c, b))


@helper
def _norm(c, first, lane):
    """Root of the sum of squares of the leading coefficients of a matrix."""
    total = 0.0
    for at in range(first, first + 9):
        total += c[at * KEPT * LANES + lane] ** 2
    return np.sqrt(total)


@helper
def _largest(c, first, k, lane):
    """Largest coefficient of order k of a matrix."""
    largest = 0.0
    for at in range(first, first + 9):
        largest = max(largest, abs(c[(at * KEPT + k) * LANES + lane]))
    return largest


@helper
def _wave_left(c, h, phase, lane, room):
    """Last term of a wave over the step h, by absolute values; phase: of the step, with its first tension.

    Above a light fish the tension grows by several times within a step, and the terms fall later.
    """
    tension = c[T * KEPT * LANES + lane]
    room[:] = 1.0
    for k in range(ORDER):
        total, power = 0.0, 1.0
        for o in range(k + 1):
            total += abs(c[(T * KEPT + o) * LANES + lane]) * power * room[0, k - o]
            power *= h
        room[0, k + 1] = phase * room[1, k] / (k + 1)
        room[1, k + 1] = phase * total / tension / (k + 1)
    return max(room[0, ORDER], room[1, ORDER])


@helper
def _shorten(c, p, h, lane, reach, bound, room):
    """Step within h in which solutions for |sigma| <= reach change by a factor of about exp(bound), and which their
    series and those of the matrices resolve: in a layer, where the cable turns, and where it has passed the axis, the
    shot's own step need not."""
    tension = c[T * KEPT * LANES + lane]
    fast = reach + 1.0
    wave = np.sqrt(fast * (tension * fast + _norm(c, TA[0, 0], lane)))
    rate, pace = max(wave, _norm(c, EP[0, 0], lane)), p[PACE * LANES + lane]
    h = min(h, bound / (rate * pace))
    for k in range(ORDER - 2, ORDER):
        # phi is sqrt(T) fast times eta, and entries of P are at most 1.
        left = _largest(c, P[0, 0], k, lane)
        left = max(left, h * pace * _largest(c, TA[0, 0], k, lane) / np.sqrt(tension))
        left = max(left, h * pace * _largest(c, EP[0, 0], k, lane))
        if left * h**k > LEFT:
            h = (LEFT / left) ** (1.0 / k)
    for _ in range(2):
        left = _wave_left(c, h, h * pace * wave, lane, room)
        if left > LEFT * LARGER:
            h *= (LEFT / left) ** (1.0 / ORDER)
    return h


@helper
def _past_axis(c, p, new, h, groups, room):
    """Into room: what steps past the axis leave of T A, above 1 where too much.

    The force is as the square of the distance there, but T A as the distance, of which series know one branch only:
    see `kernels.drag_shots.past_axis`.
    """
    x, y, fx, fy, fz = (load(new, X), load(new, Y), load(new, FX), load(new, FY), load(new, FZ))
    rho, along = square_root(x * x + y * y), x * fx + y * fy
    step, tension = load(h, ZERO), load(c, T * KEPT)
    normal = absolute(values(c, G * KEPT, ZERO, step) - square_root(fz * fz * rho * rho + along * along))
    off = load(p, KAPPA) * normal
    if groups[ON_SIDE]:
        side = absolute(values(c, RHO * KEPT, ZERO, step) - rho) * tension
        off = off + absolute(load(p, KAPPA_S)) * side
    # Of the step, what is past the axis.
    past, whole = rho / square_root(fx * fx + fy * fy), step * load(p, PACE)
    store(room, ZERO, off * where_less(past, whole, past, whole) / (square_root(tension) * LEFT))


@kernel
def expand_shapes(shots, algebra, reach, bound, series, sizes, starts, steps, statuses, begin, stop):
    """Series of the coefficients along the shapes begin..stop-1, for |sigma| <= reach of each, eight side by side.

    series : shape (rows, most steps, TERMS, MOTION_ROWS), in the part of a step; sizes : shape (rows, most steps),
    of the steps in tau; starts : shape (rows, 3), the length of a bare tip that is left out, whether it is bare, and
    the largest flow along the cable over the speed of its waves.
    """
    count = np.int64(1)
    c, scratch = aligned(ALL_QUANTITIES * KEPT), aligned(QUANTITIES * KEPT)
    p, new, h, target, ends = aligned(PARAMETERS), aligned(STATE), aligned(1), aligned(1), aligned(1)
    room, left = aligned(3), aligned(1)
    paid, low = np.zeros(LANES), np.zeros(LANES)
    work = (c, scratch, p, ends, paid, low)
    groups, terms = np.full(GROUPS, True), np.empty((2, ORDER + 1))
    for first in range(begin, stop, LANES):
        jobs, fresh, ended = np.full(LANES, IDLE), np.zeros(LANES, np.bool_), np.zeros(LANES, np.bool_)
        for lane in range(LANES):
            fresh[lane] = first + lane < stop
            jobs[lane] = first + lane if fresh[lane] else IDLE
        begin_lanes(shots, algebra, jobs, fresh, work, count)
        groups[ON_NORMAL] = groups[ON_TANGENT] = groups[ON_SIDE] = False
        for lane in range(LANES):
            i = jobs[lane]
            if i != IDLE:
                system = shots.systems[i]
                steps[i], statuses[i] = 0, status.OK
                starts[i, 0], starts[i, 2] = paid[lane], 0.0
                starts[i, 1] = system[W_F] == 0.0 and system[M_F] == 0.0 and system[C_F] == 0.0
                groups[ON_NORMAL] |= p[NORMAL * LANES + lane] != 0.0
                groups[ON_TANGENT] |= p[TANGENTIAL * LANES + lane] != 0.0
                groups[ON_SIDE] |= p[SIDE * LANES + lane] != 0.0
        groups[ACROSS] = groups[ON_NORMAL] or groups[ON_SIDE]
        groups[ROUND] = groups[ACROSS] or groups[ON_TANGENT]
        busy = True
        while busy:
            expand_jets(c, p, algebra.products, algebra.pairs, count, groups)
            _expand_matrices(c, p, groups)
            step_lengths(c, p, count, TRUNCATION, room, h)
            for lane in range(LANES):
                if jobs[lane] != IDLE:
                    h[lane] = _shorten(c, p, h[lane], lane, reach[jobs[lane]], bound, terms)
            store(room, TWO, values(c, U * KEPT, FIRST, load(h, ZERO)))
            for lane in range(LANES):
                ended[lane] = False
                if jobs[lane] == IDLE:
                    h[lane] = 0.0
                    continue
                remaining = (ends[lane] - paid[lane]) - low[lane]
                if not h[lane] * room[2 * LANES + lane] < remaining:
                    h[lane] = landing(c, p[PACE * LANES + lane], count, lane, remaining, h[lane])
                    ended[lane] = True
            again = True
            while again:
                advance_jets(c, p, new, h, target, algebra.products, count, algebra.degree)
                again = False
                if not groups[ACROSS]:
                    break
                past_axis(c, p, new, h, count, TRUNCATION, room)
                _past_axis(c, p, new, h, groups, left)
                for lane in range(LANES):
                    past = room[lane] > 1.0 or (groups[ON_SIDE] and room[LANES + lane] > 1.0)
                    if (past or left[lane] > 1.0) and jobs[lane] != IDLE:
                        h[lane] *= 0.5
                        ended[lane] = False
                        again = True
            busy = False
            for lane in range(LANES):
                i = jobs[lane]
                if i == IDLE:
                    continue
                if steps[i] == series.shape[1]:
                    statuses[i], jobs[lane] = status.STEP_LIMIT, IDLE
                    continue
                # m is kept where there is drag only.
                along = abs(c[M * KEPT * LANES + lane]) if groups[ROUND] else 0.0
                starts[i, 2] = max(starts[i, 2], along * c[T * KEPT * LANES + lane] ** -1.5)
                power = 1.0
                for k in range(TERMS):
                    for row in range(MOTION_ROWS):
                        series[i, steps[i], k, row] = c[(KEPT_ROWS[row] * KEPT + k) * LANES + lane] * power
                    power *= h[lane]
                sizes[i, steps[i]] = h[lane] * p[PACE * LANES + lane]
                steps[i] += 1
                add = new[U * LANES + lane] + low[lane]
                total = paid[lane] + add
                part = total - paid[lane]
                low[lane] = (paid[lane] - (total - part)) + (add - part)
                paid[lane] = total
                p[PACE * LANES + lane] *= h[lane]
                if not np.isfinite(total):
                    statuses[i], jobs[lane] = status.BAD_INPUT, IDLE
                elif ended[lane]:
                    jobs[lane] = IDLE
                busy = busy or jobs[lane] != IDLE
            for q in range(X, STATE):
                store(c, q * KEPT, load(new, q))
