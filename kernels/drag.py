"""The equations with drag as jets, from the fish up: one unknown, the radius of the fish. Eight shots side by side.

NRL Report 7048, Eqs. (12), (15b), (20), (21); the side force of stranded cables: Pode, DTMB Report 713, 1950. Lengths
over g / Omega^2, axes turned so that the fish is at (r, 0, 0), u the arc length from the fish, h the height above it,
V = (-Y, X, 0), F the force of the cable, pointing down it:

    dX/du = -F_x / T,  dY/du = -F_y / T,  dh/du = F_z / T,
    dF/du = (X, Y, w) - kappa |V_n| V_n - kappa_t |V_t| V_t + kappa_s A |V| (F x V) / T,
    A = 1 / (1 + beta |V_n|^2 / |V|^2),   kappa = C / gamma^2, and so kappa_t, kappa_s;   beta = b_s^-2
    at u = 0:  F = (gamma^2 m_f r, -C_f r^2, gamma^2 w_f)

The tow point is where X^2 + Y^2 = gamma^4 at u = gamma^2 lambda. In d(sigma) = du / T, with m = X F_y - Y F_x the
moment about the axis, b = m / T^2, D = X F_x + Y F_y and g = T |V_n| = sqrt(F_z^2 (X^2 + Y^2) + D^2),

    X' = -F_x,  Y' = -F_y,  h' = F_z,  u' = T,  D = -(X^2 + Y^2)' / 2,
    e = kappa g b + kappa_t m b,  a = kappa_s rho A,  A = T^2 rho^2 / (T^2 rho^2 + beta g^2)
    F_x' = T X + kappa g Y + e F_x - a F_z X,  F_y' = T Y - kappa g X + e F_y - a F_z Y,  F_z' = w T + e F_z + a D
    T' = D + w F_z + kappa_t m b T

The normal drag and the side force do no work along the cable, so T + (X^2 + Y^2) / 2 - w h stays, but for the
tangential drag. The side force has no moment about the axis: from m <= 0 at the fish m only falls, the flow along the
cable never turns, |V_t| V_t is smooth, and the angle about the axis only grows. |V_n| V_n and rho are not smooth where
the cable meets the axis, where the steps shrink to the distance from it.

Every Taylor coefficient in sigma is itself a short polynomial, a *jet*, in the unknowns of the problem: first and
higher derivatives come out of the same recurrences as the solution, with no differences taken. Which monomials there
are, and which products give which, is data (`towatlas.solve.jets`): `jets` has all products, `pairs` each two factors
once. `kernels.drag_slopes` is the same for the jets that the search needs, written out.
"""

from math import sqrt

import numpy as np

from towatlas.kernels.calls import ORDER
from towatlas.kernels.compiling import helper
from towatlas.kernels.system import B_S, C_F, C_S, C_T, LAM, M_F, W_F, C, W
from towatlas.kernels.vector import LANES, absolute, broadcast, load, square_root, store, where_less

# Marched quantities, u and T first; rho^2 is known one order ahead of the others. Whole numbers of numpy's: a plain one
# is a type of its own to numba, and helpers would be compiled again for each.
U, T, X, Y, H, FX, FY, FZ = np.arange(8)
STATE = np.int64(8)
RHO2, FZ2, D, G2, G, KG, M, T2, B, GB, MB, E, RHO, P2, DEN, A, RA, KA, KAZ = np.arange(STATE, STATE + 19)
# Room for the start: the load across and along a bare tip.
SLANT, SINE, COSINE, TX, TY, TZ, UPRIGHT, RADIUS = np.arange(STATE + 19, STATE + 27)
QUANTITIES = STATE + 27
KEPT = np.int64(ORDER + 2)  # coefficients kept of each quantity
# Parameters, jets without a series. NORMAL and SIDE are 1 where there is such a force, else 0.
R, SPEED2, KAPPA, KAPPA_T, KAPPA_S, BETA, WEIGHT, FISH_WEIGHT, FISH_MASS, FISH_DRAG, LENGTH, ONE = np.arange(12)
# PACE, of the value alone, is the unit of sigma in a lane: the step before, so that no coefficient overflows.
NORMAL, TANGENTIAL, SIDE, PACE = np.arange(12, 16)
PARAMETERS = 16
# Rows of the result: the state without u and T, the tension, and log(rho / gamma^2), zero at an equilibrium.
# Where the shot of a bare tip begins, in units of its load: an error of this size squared is forgotten on the way.
TIP_REACH, TIP_REACH_SIDE = 1e-9, 1e-16
# The same for a fish with drag alone, whose cable begins along the flow, where g is no series: squared it is rounding.
FLOW_REACH = 1e-8
# Error of the force, in units of that of the wave and of the truncation, at which a step has gone past the axis.
PAST_AXIS = 10.0

# What a row of a program does at order k, jets all: columns are the operation, a, b, q, a number and the group of rows
# that it is switched with. p is a parameter; PRODUCT q += n a b, AHEAD the same one order ahead, RATE q' += n a b,
# SCALED q += n p b, SCALED_RATE q' += n p b, HALF_RATE q = n a' / 2, RATIO q = a / b, ROOT q = sqrt(a) where the
# parameter b is not zero, else 1.
PRODUCT, AHEAD, RATE, SCALED, SCALED_RATE, HALF_RATE, RATIO, ROOT = range(8)
ALWAYS, ROUND, ACROSS, ON_NORMAL, ON_TANGENT, ON_SIDE = range(6)
GROUPS = 6
ZERO, FIRST = np.int64(0), np.int64(1)

EQUATIONS = np.array(
    [
        (SCALED_RATE, ONE, T, U, 1, ALWAYS),
        (SCALED_RATE, ONE, FX, X, -1, ALWAYS),
        (SCALED_RATE, ONE, FY, Y, -1, ALWAYS),
        (SCALED_RATE, ONE, FZ, H, 1, ALWAYS),
        (AHEAD, X, X, RHO2, 1, ALWAYS),
        (AHEAD, Y, Y, RHO2, 1, ALWAYS),
        (HALF_RATE, RHO2, RHO2, D, -1, ALWAYS),
        (SCALED_RATE, ONE, D, T, 1, ALWAYS),
        (SCALED_RATE, WEIGHT, FZ, T, 1, ALWAYS),
        (SCALED_RATE, WEIGHT, T, FZ, 1, ALWAYS),
        (RATE, T, X, FX, 1, ALWAYS),
        (RATE, T, Y, FY, 1, ALWAYS),
        (PRODUCT, T, T, T2, 1, ROUND),
        (PRODUCT, X, FY, M, 1, ROUND),
        (PRODUCT, Y, FX, M, -1, ROUND),
        (RATIO, M, T2, B, 1, ROUND),
        (PRODUCT, FZ, FZ, FZ2, 1, ACROSS),
        (PRODUCT, FZ2, RHO2, G2, 1, ACROSS),
        (PRODUCT, D, D, G2, 1, ACROSS),
        (ROOT, G2, NORMAL, G, 1, ON_NORMAL),
        (SCALED, KAPPA, G, KG, 1, ON_NORMAL),
        (RATE, KG, Y, FX, 1, ON_NORMAL),
        (RATE, KG, X, FY, -1, ON_NORMAL),
        (PRODUCT, KG, B, E, 1, ON_NORMAL),
        (PRODUCT, M, B, MB, 1, ON_TANGENT),
        (SCALED, KAPPA_T, MB, GB, 1, ON_TANGENT),
        (SCALED, ONE, GB, E, 1, ON_TANGENT),
        (RATE, GB, T, T, 1, ON_TANGENT),
        (ROOT, RHO2, SIDE, RHO, 1, ON_SIDE),
        (PRODUCT, T2, RHO2, P2, 1, ON_SIDE),
        (SCALED, ONE, P2, DEN, 1, ON_SIDE),
        (SCALED, BETA, G2, DEN, 1, ON_SIDE),
        (RATIO, P2, DEN, A, 1, ON_SIDE),
        (PRODUCT, RHO, A, RA, 1, ON_SIDE),
        (SCALED, KAPPA_S, RA, KA, 1, ON_SIDE),
        (PRODUCT, KA, FZ, KAZ, 1, ON_SIDE),
        (RATE, KAZ, X, FX, -1, ON_SIDE),
        (RATE, KAZ, Y, FY, -1, ON_SIDE),
        (RATE, KA, D, FZ, 1, ON_SIDE),
        (RATE, E, FX, FX, 1, ROUND),
        (RATE, E, FY, FY, 1, ROUND),
        (RATE, E, FZ, FZ, 1, ROUND),
    ]
)
TENSION = np.array(
    [
        (PRODUCT, FX, FX, T2, 1, ALWAYS),
        (PRODUCT, FY, FY, T2, 1, ALWAYS),
        (PRODUCT, FZ, FZ, T2, 1, ALWAYS),
        (ROOT, T2, ONE, T, 1, ALWAYS),
    ]
)
# Products of parameters: those first copied into quantities.
FISH = np.array(
    [
        (SCALED, R, UPRIGHT, RADIUS, 1, ALWAYS),
        (SCALED, SPEED2, RADIUS, TX, 1, ALWAYS),
        (SCALED, FISH_MASS, TX, FX, 1, ALWAYS),
        (SCALED, R, RADIUS, TY, 1, ALWAYS),
        (SCALED, FISH_DRAG, TY, FY, -1, ALWAYS),
        (SCALED, SPEED2, UPRIGHT, TZ, 1, ALWAYS),
        (SCALED, FISH_WEIGHT, TZ, FZ, 1, ALWAYS),
        (SCALED, ONE, RADIUS, X, 1, ALWAYS),
    ]
)
# A bare tip hangs where the load across it is none: with e the drag over the load in the vertical plane, behind that
# load by the angle of sine 2 e / (1 + sqrt(1 + 4 e^2)). The tension rises as T2 = load cosine + kappa_t r^2 sine^2.
# A side force would turn it further: where there is one the shot begins so deep in the tip that this does not matter.
TIP = np.array(
    [
        (SCALED, R, UPRIGHT, RADIUS, 1, ALWAYS),
        (PRODUCT, RADIUS, RADIUS, RHO2, 1, ALWAYS),
        (PRODUCT, RADIUS, RADIUS, G2, 1, ALWAYS),
        (SCALED, WEIGHT, UPRIGHT, TZ, 1, ALWAYS),
        (PRODUCT, TZ, TZ, G2, 1, ALWAYS),
        (ROOT, G2, ONE, G, 1, ALWAYS),
        (SCALED, KAPPA, RHO2, KG, 1, ALWAYS),
        (RATIO, KG, G, E, 1, ALWAYS),
        (SCALED, ONE, UPRIGHT, D, 1, ALWAYS),
        (PRODUCT, E, E, D, 4, ALWAYS),
        (ROOT, D, ONE, SLANT, 1, ALWAYS),
        (SCALED, ONE, UPRIGHT, SLANT, 1, ALWAYS),
        (SCALED, ONE, E, M, 2, ALWAYS),
        (RATIO, M, SLANT, SINE, 1, ALWAYS),
        (SCALED, ONE, UPRIGHT, FZ2, 1, ALWAYS),
        (PRODUCT, SINE, SINE, FZ2, -1, ALWAYS),
        (ROOT, FZ2, ONE, COSINE, 1, ALWAYS),
        (PRODUCT, SINE, SINE, MB, 1, ALWAYS),
        (PRODUCT, MB, RHO2, B, 1, ALWAYS),
        (SCALED, KAPPA_T, B, T2, 1, ALWAYS),
        (PRODUCT, G, COSINE, T2, 1, ALWAYS),
        (RATIO, COSINE, G, A, 1, ALWAYS),
        (PRODUCT, A, RADIUS, TX, 1, ALWAYS),
        (SCALED, ONE, SINE, TY, -1, ALWAYS),
        (PRODUCT, A, TZ, P2, 1, ALWAYS),
        (PRODUCT, TX, T2, FX, 1, ALWAYS),
        (PRODUCT, TY, T2, FY, 1, ALWAYS),
        (PRODUCT, P2, T2, FZ, 1, ALWAYS),
    ]
)
# The cable to pay out, gamma^2 lambda.
CABLE = np.array([(SCALED, LENGTH, UPRIGHT, KAZ, 1, ALWAYS), (SCALED, SPEED2, KAZ, RA, 1, ALWAYS)])
SQUARED_RADIUS = np.array([(PRODUCT, X, X, RHO2, 1, ALWAYS), (PRODUCT, Y, Y, RHO2, 1, ALWAYS)])
POWERS = np.array([(PRODUCT, D, D, MB, 1, ALWAYS), (PRODUCT, MB, D, B, 1, ALWAYS)])
EVERY_GROUP = np.full(GROUPS, True)


@helper
def _add_product(c, a, b, k, first, last, factor, pairs, count, q, at):
    """Add factor times the terms first..last-1 of coefficient k of the product of a and b to that of q at `at`."""
    if last <= first:
        return
    for m in range(pairs.shape[0]):
        i, j = pairs[m, 0], pairs[m, 1]
        left, right = (a * count + i) * KEPT, (b * count + j) * KEPT + k
        one = broadcast(0.0)
        if a == b and i == j:
            # Its terms come in twos, but for one in the middle.
            half = (first + last) // 2
            for order in range(first, half):
                one = one + load(c, left + order) * load(c, right - order)
            one = one + one
            if (last - first) % 2 == 1:
                one = one + load(c, left + half) * load(c, right - half)
        elif i == j or a == b:
            for order in range(first, last):
                one = one + load(c, left + order) * load(c, right - order)
            if i != j:
                one = one + one
        else:
            other = broadcast(0.0)
            left_too, right_too = (a * count + j) * KEPT, (b * count + i) * KEPT + k
            for order in range(first, last):
                one = one + load(c, left + order) * load(c, right - order)
                other = other + load(c, left_too + order) * load(c, right_too - order)
            one = one + other
        place = (q * count + pairs[m, 2]) * KEPT + at
        store(c, place, load(c, place) + factor * one)


@helper
def _add_scaled(c, p, a, b, k, factor, jets, count, q, at):
    """Add factor times a parameter times coefficient k of b to that of q at `at`."""
    for m in range(jets.shape[0]):
        place = (q * count + jets[m, 2]) * KEPT + at
        scaled = load(p, a * count + jets[m, 0]) * load(c, (b * count + jets[m, 1]) * KEPT + k)
        store(c, place, load(c, place) + factor * scaled)


@helper
def _divide(c, d, factor, jets, count, q, k):
    """Divide coefficient k of q by `factor` times the leading coefficient of d, jets both."""
    # Products come sorted by their result, the one that has it as a factor last.
    for m in range(jets.shape[0]):
        i, j, n = jets[m, 0], jets[m, 1], jets[m, 2]
        place = (q * count + n) * KEPT + k
        leading = factor * load(c, (d * count + i) * KEPT)
        if i != 0:
            store(c, place, load(c, place) - leading * load(c, (q * count + j) * KEPT + k))
        else:
            store(c, place, load(c, place) / leading)


@helper
def _root(c, q, jets, count):
    """Replace the leading coefficient of q, a jet, by its square root."""
    leading = square_root(load(c, q * count * KEPT))
    store(c, q * count * KEPT, leading)
    for m in range(1, jets.shape[0]):
        i, j, n = jets[m, 0], jets[m, 1], jets[m, 2]
        place = (q * count + n) * KEPT
        if i == 0:
            store(c, place, load(c, place) / (2.0 * leading))
        elif j != 0:
            other = load(c, (q * count + i) * KEPT) * load(c, (q * count + j) * KEPT)
            store(c, place, load(c, place) - other)


@helper
def run(c, p, program, k, jets, pairs, count, groups):
    """Run the rows of a program at order k; groups[g] says whether group g is on.

    A table, for it compiles in a fraction of the time of calls written out.
    """
    pace = load(p, PACE * count)
    for row in range(program.shape[0]):
        operation, a, b, q = program[row, 0], program[row, 1], program[row, 2], program[row, 3]
        if not groups[program[row, 5]]:
            continue
        factor = np.float64(program[row, 4])
        if operation in (SCALED, SCALED_RATE):
            ahead = FIRST if operation == SCALED_RATE else ZERO
            weight = (factor / (k + 1)) * pace if ahead == FIRST else broadcast(factor)
            _add_scaled(c, p, a, b, k, weight, jets, count, q, k + ahead)
            continue
        if operation == HALF_RATE:
            for n in range(count):
                value = load(c, (a * count + n) * KEPT + k + 1)
                store(c, (q * count + n) * KEPT + k, value * (0.5 * factor * (k + 1)) / pace)
            continue
        first, last, order, at = ZERO, k + 1, k, k
        left, right = a, b
        weight = broadcast(factor)
        if operation == RATE:
            weight = (factor / (k + 1)) * pace
            at = k + 1
        elif operation == AHEAD:
            order, last, at = k + 1, k + 2, k + 1
        elif operation != PRODUCT:
            for n in range(count):
                value = load(c, (a * count + n) * KEPT + k)
                if operation == ROOT:
                    one = broadcast(1.0 if k == 0 and n == 0 else 0.0)
                    value = where_less(load(p, b * count), broadcast(0.5), one, value)
                store(c, (q * count + n) * KEPT + k, value)
            # The terms that hold a coefficient of the result found before.
            weight = broadcast(-1.0)
            last = k
            left = q
            if operation == ROOT:
                first, right = FIRST, q
        _add_product(c, left, right, order, first, last, weight, pairs, count, q, at)
        if operation == ROOT and k == 0:
            _root(c, q, jets, count)
        elif operation in (ROOT, RATIO):
            _divide(c, right, 2.0 if operation == ROOT else 1.0, jets, count, q, k)


@helper
def clear(c, first, last, count, k):
    """Set coefficient k of the quantities first..last-1 to zero."""
    for place in range(first * count, last * count):
        store(c, place * KEPT + k, broadcast(0.0))


@helper
def set_tension(c, p, jets, pairs, count):
    """The tension from the force."""
    clear(c, T, T + 1, count, ZERO)
    clear(c, T2, T2 + 1, count, ZERO)
    run(c, p, TENSION, ZERO, jets, pairs, count, EVERY_GROUP)


@helper
def expand_jets(c, p, jets, pairs, count, groups):
    """Taylor coefficients of the equations above in sigma over the pace, from the state at order 0."""
    set_tension(c, p, jets, pairs, count)
    clear(c, STATE, SLANT, count, ZERO)
    for q in (X, Y):
        _add_product(c, q, q, ZERO, ZERO, FIRST, broadcast(1.0), pairs, count, RHO2, ZERO)
    for k in range(np.int64(ORDER)):
        clear(c, ZERO, STATE + 1, count, k + 1)
        if k > 0:
            clear(c, STATE + 1, SLANT, count, k)
        run(c, p, EQUATIONS, k, jets, pairs, count, groups)


@helper
def step_lengths(c, p, count, truncation, room, h):
    """Steps at which the last two terms reach the truncation, relative to the local amplitudes.

    The amplitude is that of the wave, sqrt(rho^2 + f^2 / T), f the horizontal force. The first variation is held to
    its own, the others to the larger of their own and that of the solution.
    """
    tension = load(c, T * count * KEPT)
    wave = square_root(tension)
    first = broadcast(0.0)
    last_but_one = broadcast(0.0)
    last = broadcast(0.0)
    for n in range(count):
        x, y = load(c, (X * count + n) * KEPT), load(c, (Y * count + n) * KEPT)
        fx, fy = load(c, (FX * count + n) * KEPT), load(c, (FY * count + n) * KEPT)
        amplitude = square_root(x * x + y * y + (fx * fx + fy * fy) / tension)
        if n == 0:
            first = amplitude
        elif n == 1:
            amplitude = where_less(broadcast(0.0), amplitude, amplitude, first)
        else:
            amplitude = where_less(first, amplitude, amplitude, first)
        ratio = amplitude / first
        upright = tension * where_less(broadcast(1.0), ratio, ratio, broadcast(1.0))
        along, across, up = 1.0 / amplitude, 1.0 / (amplitude * wave), 1.0 / upright
        for back in range(2):
            k = ORDER - 1 + back
            size = broadcast(0.0)
            for q in (X, Y):
                term = absolute(load(c, (q * count + n) * KEPT + k)) * along
                size = where_less(size, term, term, size)
            for q in (FX, FY):
                term = absolute(load(c, (q * count + n) * KEPT + k)) * across
                size = where_less(size, term, term, size)
            for q in (FZ, H):
                term = absolute(load(c, (q * count + n) * KEPT + k)) * up
                size = where_less(size, term, term, size)
            if back == 0:
                last_but_one = where_less(last_but_one, size, size, last_but_one)
            else:
                last = where_less(last, size, size, last)
    store(room, ZERO, last_but_one)
    store(room, FIRST, last)
    limit = np.log(truncation)
    for lane in range(LANES):
        # numpy's functions, for the nothing in an idle lane: interpreted, those of the module math would raise.
        by_one = (limit - np.log(room[lane])) / (ORDER - 1.0)
        by_other = (limit - np.log(room[LANES + lane])) / ORDER
        h[lane] = np.exp(min(by_one, by_other))


@helper
def values(c, place, first, h):
    """The series kept at a place, summed at the steps h from the coefficient `first`, on top of which h^first."""
    total = load(c, place + ORDER)
    for k in range(ORDER - 1, first - 1, -1):
        total = total * h + load(c, place + k)
    return total


@helper
def _evaluate(c, quantity, h, jets, count, out):
    """Value of a quantity, a jet, after the steps h, jets too, into out[quantity]."""
    here = quantity * count
    for n in range(count):
        store(out, here + n, load(c, (here + n) * KEPT + ORDER))
    for k in range(ORDER - 1, -1, -1):
        total = broadcast(0.0)
        for m in range(jets.shape[0] - 1, -1, -1):
            total = total + load(h, jets[m, 0]) * load(out, here + jets[m, 1])
            n = jets[m, 2]
            # From the highest monomial down, so that what is still to be used is still old.
            if m == 0 or jets[m - 1, 2] != n:
                store(out, here + n, total + load(c, (here + n) * KEPT + k))
                total = broadcast(0.0)


@helper
def advance_jets(c, p, new, h, target, jets, count, degree):
    """State after the steps h, at paid-out lengths whose jets above the value are `target`; completes h, fills new."""
    for n in range(1, count):
        store(h, n, broadcast(0.0))
    slope = values(c, T * count * KEPT, ZERO, load(h, ZERO)) * load(p, PACE * count)
    # Each round makes one more degree of the jet right.
    for _ in range(degree):
        _evaluate(c, U, h, jets, count, new)
        for n in range(1, count):
            store(h, n, load(h, n) + (load(target, n) - load(new, U * count + n)) / slope)
    for quantity in range(STATE):
        if quantity != T:
            _evaluate(c, quantity, h, jets, count, new)


@helper
def set_parameters(p, lane, r, gamma2, system, direction, places, count):
    """Jets of the parameters of one lane: r and gamma times the exponentials of their monomials, the system as it is
    with `direction` for the monomial of the parameter.

    places : the monomials of the first three powers in log r, and of the first in log gamma and the parameter; 0 if
    absent.
    """
    for row in range(PARAMETERS * count):
        p[row * LANES + lane] = 0.0
    step = count * LANES
    p[ONE * step + lane] = p[PACE * step + lane] = 1.0
    p[R * step + lane] = r
    p[SPEED2 * step + lane] = gamma2
    p[KAPPA * step + lane] = system[C] / gamma2
    p[KAPPA_T * step + lane] = system[C_T] / gamma2
    p[KAPPA_S * step + lane] = system[C_S] / gamma2
    p[BETA * step + lane] = system[B_S] ** -2.0
    p[WEIGHT * step + lane] = system[W]
    p[FISH_WEIGHT * step + lane] = system[W_F]
    p[FISH_MASS * step + lane] = system[M_F]
    p[FISH_DRAG * step + lane] = system[C_F]
    p[LENGTH * step + lane] = system[LAM]
    factor = r
    for power in range(1, 4):
        factor /= power
        if places[power - 1] > 0:
            p[R * step + places[power - 1] * LANES + lane] = factor
    if places[3] > 0:
        at = places[3] * LANES + lane
        p[SPEED2 * step + at] = 2.0 * gamma2
        for drag in (KAPPA, KAPPA_T, KAPPA_S):
            p[drag * step + at] = -2.0 * p[drag * step + lane]
    if places[4] > 0:
        at = places[4] * LANES + lane
        p[KAPPA * step + at] = direction[C] / gamma2
        p[KAPPA_T * step + at] = direction[C_T] / gamma2
        p[KAPPA_S * step + at] = direction[C_S] / gamma2
        if direction[B_S] != 0.0:
            p[BETA * step + at] = -2.0 * direction[B_S] * system[B_S] ** -3.0
        p[WEIGHT * step + at] = direction[W]
        p[FISH_WEIGHT * step + at] = direction[W_F]
        p[FISH_MASS * step + at] = direction[M_F]
        p[FISH_DRAG * step + at] = direction[C_F]
        p[LENGTH * step + at] = direction[LAM]
    for mask, drag in ((NORMAL, KAPPA), (TANGENTIAL, KAPPA_T), (SIDE, KAPPA_S)):
        moving = p[drag * step + lane] != 0.0
        if places[4] > 0:
            moving = moving or p[drag * step + places[4] * LANES + lane] != 0.0
        p[mask * step + lane] = 1.0 if moving else 0.0


@helper
def start(c, p, jets, pairs, count, bare):
    """In all lanes: states at the fish, or just above bare tips; the cable paid out at U, that to be paid out at RA.

    bare : whether the force at the end of the cable is none, else it is that on the fish.
    """
    clear(c, ZERO, QUANTITIES, count, ZERO)
    store(c, UPRIGHT * count * KEPT, broadcast(1.0))
    run(c, p, CABLE, ZERO, jets, pairs, count, EVERY_GROUP)
    run(c, p, TIP if bare else FISH, ZERO, jets, pairs, count, EVERY_GROUP)
    if bare:
        _raise_tip(c, p, count)
    else:
        _leave_flow(c, p, jets, count)


@helper
def _leave_flow(c, p, jets, count):
    """Go a bit up from a fish that has drag and neither weight nor mass."""
    r, w = load(p, R * count), load(p, WEIGHT * count)
    u = FLOW_REACH * load(p, FISH_DRAG * count) * r * r / square_root(r * r + w * w)
    loaded = absolute(load(p, FISH_WEIGHT * count)) + load(p, FISH_MASS * count)
    u = where_less(broadcast(0.0), loaded, broadcast(0.0), u)
    store(c, U * count * KEPT, u)
    store(c, Y * count * KEPT, u)
    for n in range(count):
        for q, load_of in ((FX, R), (FZ, WEIGHT)):
            place = (q * count + n) * KEPT
            store(c, place, load(c, place) + u * load(p, load_of * count + n))
    # All of the flow is along the cable here.
    _add_scaled(c, p, KAPPA_T, TY, ZERO, -1.0 * u, jets, count, FY, ZERO)


@helper
def set_pace(c, p, lane, count):
    """The first unit of sigma of a lane: about what the wave, the load or the drag need to change the force."""
    step = count * KEPT * LANES
    x, y, tension = (
        c[X * step + lane],
        c[Y * step + lane],
        sqrt(c[FX * step + lane] ** 2 + c[FY * step + lane] ** 2 + c[FZ * step + lane] ** 2),
    )
    rho2, step = x * x + y * y, count * LANES
    rate = sqrt(tension) + sqrt(rho2) + abs(p[WEIGHT * step + lane])
    p[PACE * step + lane] = 1.0 / (rate + p[KAPPA * step + lane] * rho2)


@helper
def _raise_tip(c, p, count):
    # The length paid out is held fixed as the unknowns move.
    rise = load(c, T2 * count * KEPT)
    deep = where_less(load(p, SIDE * count), broadcast(0.5), broadcast(TIP_REACH), broadcast(TIP_REACH_SIDE))
    u = deep * rise / (1.0 + load(p, KAPPA * count) * load(p, R * count))
    store(c, U * count * KEPT, u)
    for n in range(count):
        at = n * KEPT
        store(c, X * count * KEPT + at, load(p, R * count + n) - u * load(c, TX * count * KEPT + at))
        store(c, Y * count * KEPT + at, -u * load(c, TY * count * KEPT + at))
        store(c, H * count * KEPT + at, u * load(c, P2 * count * KEPT + at))
        for q in (FX, FY, FZ):
            store(c, q * count * KEPT + at, u * load(c, q * count * KEPT + at))


@helper
def finish(c, p, jets, pairs, count):
    """In all lanes: the tension of the state, and at E log(rho / gamma^2), jets."""
    set_tension(c, p, jets, pairs, count)
    clear(c, STATE, SLANT, count, ZERO)
    run(c, p, SQUARED_RADIUS, ZERO, jets, pairs, count, EVERY_GROUP)
    # log(a (1 + x)) = log a + x - x^2 / 2 + x^3 / 3, x without a constant: nothing follows in a jet of third degree.
    leading, speed2 = load(c, RHO2 * count * KEPT), load(p, SPEED2 * count)
    for n in range(1, count):
        store(c, (D * count + n) * KEPT, load(c, (RHO2 * count + n) * KEPT) / leading)
    run(c, p, POWERS, ZERO, jets, pairs, count, EVERY_GROUP)
    for n in range(1, count):
        x = load(c, (D * count + n) * KEPT)
        x2, x3 = load(c, (MB * count + n) * KEPT), load(c, (B * count + n) * KEPT)
        # gamma^2 moves with log gamma.
        moved = load(p, SPEED2 * count + n) / speed2
        store(c, (E * count + n) * KEPT, 0.5 * (x - x2 / 2.0 + x3 / 3.0) - moved)
    for lane in range(LANES):
        c[E * count * KEPT * LANES + lane] = 0.5 * np.log(c[RHO2 * count * KEPT * LANES + lane]) - np.log(
            p[SPEED2 * count * LANES + lane]
        )
