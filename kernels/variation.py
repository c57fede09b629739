"""The linearised motion about an equilibrium, from the fish up: coefficients on the equilibrium's own shot, and the
Evans function.

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
D(sigma) = det eta at the tow point, of the three solutions with eta = 1 at the fish, is zero at the growth rates and
nowhere else. It is an entire function, real on the real axis.
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
from towatlas.kernels.vector import LANES, aligned, broadcast, load, store

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
TERMS = np.int64(MOTION_TERMS)
TWO, SIX = np.int64(2), np.int64(6)
# Of the series of P, whose entries are at most 1, and of a wave at the end of a step: its last terms. Steps are
# shortened for a wave's where they are so many times larger.
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
def _turn_left(c, k, lane):
    """Largest coefficient of order k of P."""
    largest = 0.0
    for at in range(P[0, 0], P[0, 0] + 9):
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
    series and that of P resolve: in a layer, where the cable turns, the shot's own step need not."""
    for k in range(ORDER - 2, ORDER):
        left = _turn_left(c, k, lane)
        if left * h**k > LEFT:
            h = (LEFT / left) ** (1.0 / k)
    tension = c[T * KEPT * LANES + lane]
    fast = reach + 1.0
    wave = np.sqrt(fast * (tension * fast + _norm(c, TA[0, 0], lane)))
    rate, pace = max(wave, _norm(c, EP[0, 0], lane)), p[PACE * LANES + lane]
    h = min(h, bound / (rate * pace))
    for _ in range(2):
        left = _wave_left(c, h, h * pace * wave, lane, room)
        if left > LEFT * LARGER:
            h *= (LEFT / left) ** (1.0 / ORDER)
    return h


@kernel
def expand_shapes(shots, algebra, reach, bound, series, sizes, starts, steps, statuses, begin, stop):
    """Series of the coefficients along the shapes begin..stop-1, for |sigma| <= reach of each, eight side by side.

    series : shape (rows, most steps, MOTION_ROWS, TERMS), in the part of a step; sizes : shape (rows, most steps),
    of the steps in tau; starts : shape (rows, 3), the length of a bare tip that is left out, whether it is bare, and
    the largest flow along the cable over the speed of its waves.
    """
    count = np.int64(1)
    c, scratch = aligned(ALL_QUANTITIES * KEPT), aligned(QUANTITIES * KEPT)
    p, new, h, target, ends, room = aligned(PARAMETERS), aligned(STATE), aligned(1), aligned(1), aligned(1), aligned(3)
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
                for lane in range(LANES):
                    past = room[lane] > 1.0 or (groups[ON_SIDE] and room[LANES + lane] > 1.0)
                    if past and jobs[lane] != IDLE:
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
                        series[i, steps[i], row, k] = c[(KEPT_ROWS[row] * KEPT + k) * LANES + lane] * power
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


@helper
def _turn(eta, zeta, place, real, imaginary):
    """(sigma + S) eta into zeta, at a place of both."""
    for part in range(2):
        # Real parts, then imaginary ones.
        x, y, z = load(eta, place + part), load(eta, place + TWO + part), load(eta, place + 4 + part)
        other = 1 - part
        sign = -1.0 if part == 0 else 1.0
        xo, yo, zo = load(eta, place + other), load(eta, place + TWO + other), load(eta, place + 4 + other)
        store(zeta, place + part, real * x + sign * (imaginary * xo) - y)
        store(zeta, place + TWO + part, real * y + sign * (imaginary * yo) + x)
        store(zeta, place + 4 + part, real * z + sign * (imaginary * zo))


@helper
def _march_step(series, size, drag, terms, eta, phi, zeta, alpha, real, imaginary, out):
    """One step of the solutions in the lanes, with so many terms; eta, phi at order 0 to `out`, shape of 12 places."""
    for k in range(terms):
        at, ahead = k * SIX, (k + 1) * SIX
        _turn(eta, zeta, at, real, imaginary)
        _turn(zeta, alpha, at, real, imaginary)
        # Real and imaginary parts side by side: sums that wait for each other would take twice as long.
        e0 = e1 = e2 = f0 = f1 = f2 = broadcast(0.0)
        g0 = g1 = g2 = h0 = h1 = h2 = broadcast(0.0)
        for o in range(k + 1):
            back = (k - o) * SIX
            t = series[0, o]
            f0, h0 = f0 - t * load(alpha, back), h0 - t * load(alpha, back + 1)
            f1, h1 = f1 - t * load(alpha, back + 2), h1 - t * load(alpha, back + 3)
            f2, h2 = f2 - t * load(alpha, back + 4), h2 - t * load(alpha, back + 5)
            for j in range(3):
                q, r = load(phi, back + 2 * j), load(phi, back + 2 * j + 1)
                e0, g0 = e0 - series[1 + j, o] * q, g0 - series[1 + j, o] * r
                e1, g1 = e1 - series[4 + j, o] * q, g1 - series[4 + j, o] * r
                e2, g2 = e2 - series[7 + j, o] * q, g2 - series[7 + j, o] * r
                if drag:
                    y, z = load(zeta, back + 2 * j), load(zeta, back + 2 * j + 1)
                    f0 = f0 + series[19 + j, o] * q - series[10 + j, o] * y
                    h0 = h0 + series[19 + j, o] * r - series[10 + j, o] * z
                    f1 = f1 + series[22 + j, o] * q - series[13 + j, o] * y
                    h1 = h1 + series[22 + j, o] * r - series[13 + j, o] * z
                    f2 = f2 + series[25 + j, o] * q - series[16 + j, o] * y
                    h2 = h2 + series[25 + j, o] * r - series[16 + j, o] * z
        share = size / (k + 1)
        store(eta, ahead, e0 * share)
        store(eta, ahead + 1, g0 * share)
        store(eta, ahead + 2, e1 * share)
        store(eta, ahead + 3, g1 * share)
        store(eta, ahead + 4, e2 * share)
        store(eta, ahead + 5, g2 * share)
        store(phi, ahead, f0 * share)
        store(phi, ahead + 1, h0 * share)
        store(phi, ahead + 2, f1 * share)
        store(phi, ahead + 3, h1 * share)
        store(phi, ahead + 4, f2 * share)
        store(phi, ahead + 5, h2 * share)
    for i in range(SIX):
        u = v = broadcast(0.0)
        for k in range(terms, -1, -1):
            u = u + load(eta, k * SIX + i)
            v = v + load(phi, k * SIX + i)
        store(out, i, u)
        store(out, SIX + i, v)


@helper
def _orthonormalise(out, first, weight, z):
    """Make the three solutions from lane `first` on orthonormal, phi weighted; the logarithm of their volume, and its
    share that is in eta."""
    for column in range(3):
        for i in range(3):
            for half in range(2):
                place = (half * 6 + 2 * i) * LANES + first + column
                factor = 1.0 if half == 0 else weight
                z[3 * half + i, column] = factor * (out[place] + 1j * out[place + LANES])
    volume = 0.0
    for column in range(3):
        # Twice: once is not enough where columns are nearly the same.
        for _ in range(2):
            for other in range(column):
                dot = 0.0 + 0.0j
                for i in range(6):
                    dot += np.conj(z[i, other]) * z[i, column]
                for i in range(6):
                    z[i, column] -= dot * z[i, other]
        total = 0.0
        for i in range(6):
            total += z[i, column].real ** 2 + z[i, column].imag ** 2
        size = np.sqrt(total)
        for i in range(6):
            z[i, column] /= size
        volume += np.log(size)
    return volume


@helper
def _determinant(z):
    return (
        z[0, 0] * (z[1, 1] * z[2, 2] - z[1, 2] * z[2, 1])
        - z[0, 1] * (z[1, 0] * z[2, 2] - z[1, 2] * z[2, 0])
        + z[0, 2] * (z[1, 0] * z[2, 1] - z[1, 1] * z[2, 0])
    )


@helper
def _inverse(a, out):
    """Inverse of a real matrix of three rows."""
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            out[m, i] = a[j, n] * a[k, o] - a[j, o] * a[k, n]
    det = a[0, 0] * out[0, 0] + a[0, 1] * out[1, 0] + a[0, 2] * out[2, 0]
    for i in range(3):
        for j in range(3):
            out[i, j] /= det


@helper
def _turned(sigma, v):
    """(sigma + S) v."""
    return np.array([sigma * v[0] - v[1], sigma * v[1] + v[0], sigma * v[2]])


@helper
def _begin_solutions(series, start, fish, sigma, first, eta, phi, room):
    """The three solutions with eta = 1 at the fish, in the lanes from `first` on.

    fish : its mass over that of g / Omega^2 of cable, and C_f r.
    """
    rise, inverse = room[0], room[1]
    bare = start[1] != 0.0
    if bare:
        # phi is all but proportional to the length below: T phi / u is what the equation makes of eta and phi.
        for i in range(3):
            for j in range(3):
                rise[i, j] = -series[19 + 3 * i + j, 0]
            rise[i, i] += series[0, 0] / start[0]
        _inverse(rise, inverse)
    for column in range(3):
        e = np.zeros(3, np.complex128)
        e[column] = 1.0
        once = _turned(sigma, e)
        twice = _turned(sigma, once)
        f = np.zeros(3, np.complex128)
        if bare:
            for i in range(3):
                for j in range(3):
                    load_of = -series[0, 0] * twice[j]
                    for n in range(3):
                        load_of -= series[10 + 3 * j + n, 0] * once[n]
                    f[i] += inverse[i, j] * load_of
        else:
            for i in range(3):
                f[i] = -fish[0] * twice[i] - fish[1] * once[i] * (2.0 if i == 1 else 1.0)
        for i in range(3):
            at = 2 * i * LANES + first + column
            eta[at], eta[at + LANES] = e[i].real, e[i].imag
            phi[at], phi[at + LANES] = f[i].real, f[i].imag


@kernel
def evans(series, sizes, first, steps, starts, fish, drag, terms, every, shape, sigma, values_of, logs, begin, stop):
    """D at each of the `sigma` begin..stop-1, shape (points,), as values_of exp(logs), two of one shape at a time.

    series, sizes : of all steps of all shapes; first, steps : where those of each begin, and how many there are.
    starts, fish, drag : by shapes; shape : of each point, those of one shape next to each other.
    terms : of the series, up to TERMS; solutions are made orthonormal after `every` so many steps.
    """
    eta, phi = aligned((TERMS + 1) * SIX), aligned((TERMS + 1) * SIX)
    zeta, alpha, out = aligned((TERMS + 1) * SIX), aligned((TERMS + 1) * SIX), aligned(2 * SIX)
    parts, z, room = aligned(2), np.zeros((6, 3), np.complex128), np.zeros((2, 3, 3))
    at = begin
    while at < stop:
        i = shape[at]
        count = 2 if at + 1 < stop and shape[at + 1] == i else 1
        for which in range(2):
            point = at + min(which, count - 1)
            _begin_solutions(series[first[i]], starts[i], fish[i], sigma[point], 3 * which, eta, phi, room)
            logs[point] = 0.0
            for column in range(3):
                parts[3 * which + column] = sigma[point].real
                parts[LANES + 3 * which + column] = sigma[point].imag
        real, imaginary = load(parts, ZERO), load(parts, FIRST)
        for step in range(steps[i]):
            here = first[i] + step
            _march_step(series[here], sizes[here], drag[i], terms, eta, phi, zeta, alpha, real, imaginary, out)
            last = step == steps[i] - 1
            if not last and (step + 1) % every != 0:
                for place in range(SIX):
                    store(eta, place, load(out, place))
                    store(phi, place, load(out, SIX + place))
                continue
            for which in range(count):
                # That of a wave of this frequency.
                weight = 1.0 / (np.sqrt(series[here, 0, 0]) * (1.0 + abs(sigma[at + which])))
                logs[at + which] += _orthonormalise(out, 3 * which, weight, z)
                if last:
                    values_of[at + which] = _determinant(z)
                for column in range(3):
                    for j in range(3):
                        for half in range(2):
                            place = 2 * j * LANES + 3 * which + column
                            factor = 1.0 if half == 0 else 1.0 / weight
                            value = factor * z[3 * half + j, column]
                            if half == 0:
                                eta[place], eta[place + LANES] = value.real, value.imag
                            else:
                                phi[place], phi[place + LANES] = value.real, value.imag
        at += count
