"""The Evans function of small motions about an equilibrium, by their coefficients (`kernels.variation`).

D(sigma) = det eta at the tow point, of the three solutions with eta = 1 at the fish, is zero at the growth rates and
nowhere else. It is an entire function, real on the real axis.
"""

import numpy as np

from towatlas.kernels.calls import MOTION_ROWS, MOTION_TERMS
from towatlas.kernels.compiling import helper, kernel
from towatlas.kernels.vector import LANES, absolute, aligned, broadcast, load, load_from, store, store_from, where_less

TERMS, ROWS = np.int64(MOTION_TERMS), np.int64(MOTION_ROWS)
TWO = np.int64(2)
# Points side by side, places for a number of each of their solutions, and where the terms of a vector of these end.
POINTS, ROOM = 4, np.int64(4)
SOLUTION = 3 * (TERMS + 1)
# The first order at which solutions may end.
FEWEST = 5
# Of the square of a column.
LITTLE = 0.01


@helper
def _turn(x, y, z, ring, across, real, imaginary):
    """(sigma + S) of a vector of three, whose other parts, imaginary and real, are in the ring."""
    xo, yo = load_from(ring, across), load_from(ring, ROOM * LANES + across)
    zo = load_from(ring, 2 * ROOM * LANES + across)
    return (real * x + imaginary * xo) - y, (real * y + imaginary * yo) + x, real * z + imaginary * zo


@helper
def _close(ring, rows, period):
    """The first slots again after the last ones."""
    for i in range(rows):
        store_from(ring, i * ROOM * LANES + period, load(ring, i * ROOM))


@helper
def _march_step(series, size, drag, terms, small, points, state, turned, work, given, tails, room):
    """One step of the solutions of the points, with at most so many terms.

    state : eta and phi, ROOM places for each of their six components. Real parts of the three solutions of each point
    are next to each other, then come the imaginary parts, then the first ones again: the other part of a number is
    half a period further on. So all lanes have work, whatever the points are.
    given : sigma, the factor of the other part, and the weight of phi. A point takes terms until two in a row are
    below `small` in its solutions: what it is given does not depend on the others.
    tails, room : ROOM places and twice as many.
    """
    eta, phi, zeta, alpha = work
    period, half = 6 * points, 3 * points
    vectors = (period + LANES - 1) // LANES
    for slot in range(ROOM * LANES):
        room[ROOM * LANES + slot] = terms
    for v in range(vectors):
        for i in range(3):
            store(eta, v * SOLUTION + i, load(state, i * ROOM + v))
            store(phi, v * SOLUTION + i, load(state, (3 + i) * ROOM + v))
    most = terms
    for k in range(terms):
        now, ahead = 3 * k, 3 * k + 3
        for v in range(vectors):
            across = (v * LANES + half) % period
            at = v * SOLUTION + now
            x, y, z = load(eta, at), load(eta, at + 1), load(eta, at + TWO)
            x, y, z = _turn(x, y, z, state, across, load(given, v), load(given, ROOM + v))
            store(zeta, at, x)
            store(zeta, at + 1, y)
            store(zeta, at + TWO, z)
            store(turned, v, x)
            store(turned, ROOM + v, y)
            store(turned, 2 * ROOM + v, z)
        _close(turned, 3, period)
        for v in range(vectors):
            across = (v * LANES + half) % period
            begin = v * SOLUTION
            at = begin + now
            x, y, z = load(zeta, at), load(zeta, at + 1), load(zeta, at + TWO)
            x, y, z = _turn(x, y, z, turned, across, load(given, v), load(given, ROOM + v))
            store(alpha, at, x)
            store(alpha, at + 1, y)
            store(alpha, at + TWO, z)
            # Sums that wait for each other would take twice as long.
            e0 = e1 = e2 = f0 = f1 = f2 = g0 = g1 = g2 = broadcast(0.0)
            # The newest terms last: others need not wait for them.
            for o in range(k + 1):
                back, of = begin + 3 * o, (k - o) * ROWS
                t = series[of]
                f0 = f0 - t * load(alpha, back)
                f1 = f1 - t * load(alpha, back + 1)
                f2 = f2 - t * load(alpha, back + 2)
                for j in range(3):
                    q = load(phi, back + j)
                    e0 = e0 - series[of + 1 + j] * q
                    e1 = e1 - series[of + 4 + j] * q
                    e2 = e2 - series[of + 7 + j] * q
                    if drag:
                        r = load(zeta, back + j)
                        f0, g0 = f0 + series[of + 19 + j] * q, g0 - series[of + 10 + j] * r
                        f1, g1 = f1 + series[of + 22 + j] * q, g1 - series[of + 13 + j] * r
                        f2, g2 = f2 + series[of + 25 + j] * q, g2 - series[of + 16 + j] * r
            share = size / (k + 1)
            e0, e1, e2 = e0 * share, e1 * share, e2 * share
            f0, f1, f2 = (f0 + g0) * share, (f1 + g1) * share, (f2 + g2) * share
            store(eta, begin + ahead, e0)
            store(eta, begin + ahead + 1, e1)
            store(eta, begin + ahead + 2, e2)
            store(phi, begin + ahead, f0)
            store(phi, begin + ahead + 1, f1)
            store(phi, begin + ahead + 2, f2)
            store(state, v, e0)
            store(state, ROOM + v, e1)
            store(state, 2 * ROOM + v, e2)
            if k >= FEWEST - 1:
                term = absolute(e0) + absolute(e1) + absolute(e2)
                term = term + load(given, 2 * ROOM + v) * (absolute(f0) + absolute(f1) + absolute(f2))
                store(room, v, load(tails, v) + term)
                store(tails, v, term)
        _close(state, 3, period)
        if k >= FEWEST and _settled(room, points, terms, small, k + 1):
            most = k + 1
            break
    least = terms
    for point in range(points):
        least = min(least, room[ROOM * LANES + 3 * point])
    for v in range(vectors):
        own = load(room, ROOM + v)
        for i in range(3):
            at = v * SOLUTION + i
            u = w = broadcast(0.0)
            for k in range(most, -1, -1):
                if k > least:
                    u = u + where_less(k - 0.5, own, load(eta, at + 3 * k), 0.0)
                    w = w + where_less(k - 0.5, own, load(phi, at + 3 * k), 0.0)
                else:
                    u = u + load(eta, at + 3 * k)
                    w = w + load(phi, at + 3 * k)
            store(state, i * ROOM + v, u)
            store(state, (3 + i) * ROOM + v, w)


@helper
def _settled(room, points, terms, small, order):
    """Whether the last two terms of all points are small; where they are now, `order` is the last of the point."""
    settled = True
    for point in range(points):
        limit = ROOM * LANES + 3 * point
        if room[limit] < terms:
            continue
        least = True
        for part in range(2):
            for column in range(3):
                least &= room[3 * (part * points + point) + column] < small
        if least:
            for part in range(2):
                for column in range(3):
                    room[limit + 3 * part * points + column] = order
        settled &= least
    return settled


@helper
def _square(z, column):
    total = 0.0
    for i in range(6):
        total += z[i, column].real ** 2 + z[i, column].imag ** 2
    return total


@helper
def _slot(half, i, part, points, point, column):
    """Where a component of eta (half 0) or phi (1) of a solution is in the state."""
    return (3 * half + i) * ROOM * LANES + 3 * (part * points + point) + column


@helper
def _orthonormalise(state, points, point, weight, z):
    """Make the three solutions of a point orthonormal, phi weighted: into z. The logarithm of their volume."""
    for column in range(3):
        for i in range(3):
            for half in range(2):
                factor = 1.0 if half == 0 else weight
                real = state[_slot(half, i, 0, points, point, column)]
                z[3 * half + i, column] = factor * (real + 1j * state[_slot(half, i, 1, points, point, column)])
    volume = 0.0
    for column in range(3):
        total = _square(z, column)
        before = np.inf
        # Again where a column was nearly the same as the others, and little of it is left.
        while total < LITTLE * before:
            before = total
            for other in range(column):
                dot = 0.0 + 0.0j
                for i in range(6):
                    dot += np.conj(z[i, other]) * z[i, column]
                for i in range(6):
                    z[i, column] -= dot * z[i, other]
            total = _square(z, column)
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
def _begin_solutions(series, start, fish, sigma, z, room):
    """The three solutions with eta = 1 at the fish, into z.

    fish : its mass over that of g / Omega^2 of cable, and C_f r.
    """
    rise, inverse = room[0], room[1]
    bare = start[1] != 0.0
    if bare:
        # phi is all but proportional to the length below: T phi / u is what the equation makes of eta and phi.
        for i in range(3):
            for j in range(3):
                rise[i, j] = -series[19 + 3 * i + j]
            rise[i, i] += series[0] / start[0]
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
                    load_of = -series[0] * twice[j]
                    for n in range(3):
                        load_of -= series[10 + 3 * j + n] * once[n]
                    f[i] += inverse[i, j] * load_of
        else:
            for i in range(3):
                f[i] = -fish[0] * twice[i] - fish[1] * once[i] * (2.0 if i == 1 else 1.0)
        for i in range(3):
            z[i, column], z[3 + i, column] = e[i], f[i]


@helper
def _put(z, state, points, point, weight):
    """Solutions of a point into the state, phi over its weight."""
    for column in range(3):
        for i in range(3):
            for half in range(2):
                value = z[3 * half + i, column] * (1.0 if half == 0 else 1.0 / weight)
                state[_slot(half, i, 0, points, point, column)] = value.real
                state[_slot(half, i, 1, points, point, column)] = value.imag


@helper
def _give(given, row, points, point, real, imaginary):
    """What belongs to the real and to the imaginary parts of a point's solutions."""
    for column in range(3):
        given[row * ROOM * LANES + 3 * point + column] = real
        given[row * ROOM * LANES + 3 * (points + point) + column] = imaginary


@kernel
def evans(
    series, sizes, first, steps, starts, fish, drag, terms, every, small, shape, sigma, values_of, logs, begin, stop
):
    """D at each of the `sigma` begin..stop-1, shape (points,), as values_of exp(logs), four of one shape at a time.

    series, sizes : of all steps of all shapes; first, steps : where those of each begin, and how many there are.
    starts, fish, drag : by shapes; shape : of each point, those of one shape next to each other.
    terms : of the series, up to TERMS, fewer where the last two are below `small` of solutions of size 1; these are
    made orthonormal after `every` so many steps.
    """
    work = aligned(3 * SOLUTION), aligned(3 * SOLUTION), aligned(3 * SOLUTION), aligned(3 * SOLUTION)
    state, turned, given = aligned(6 * ROOM), aligned(3 * ROOM), aligned(3 * ROOM)
    tails, sums = aligned(ROOM), aligned(2 * ROOM)
    z, room = np.zeros((6, 3), np.complex128), np.zeros((2, 3, 3))
    at = begin
    while at < stop:
        i, points = shape[at], 1
        while points < POINTS and at + points < stop and shape[at + points] == i:
            points += 1
        for point in range(points):
            _begin_solutions(series[first[i], 0], starts[i], fish[i], sigma[at + point], z, room)
            _put(z, state, points, point, 1.0)
            logs[at + point] = 0.0
            real, imaginary = sigma[at + point].real, sigma[at + point].imag
            _give(given, 0, points, point, real, real)
            _give(given, 1, points, point, -imaginary, imaginary)
        for step in range(steps[i]):
            here = first[i] + step
            for point in range(points):
                # That of a wave of this frequency.
                weight = 1.0 / (np.sqrt(series[here, 0, 0]) * (1.0 + abs(sigma[at + point])))
                _give(given, 2, points, point, weight, weight)
            _close(state, 6, 6 * points)
            _march_step(
                series[here].reshape(TERMS * ROWS),
                sizes[here],
                drag[i],
                terms,
                small,
                points,
                state,
                turned,
                work,
                given,
                tails,
                sums,
            )
            last = step == steps[i] - 1
            if not last and (step + 1) % every != 0:
                continue
            for point in range(points):
                weight = given[2 * ROOM * LANES + 3 * point]
                logs[at + point] += _orthonormalise(state, points, point, weight, z)
                if last:
                    values_of[at + point] = _determinant(z)
                _put(z, state, points, point, weight)
        at += points
