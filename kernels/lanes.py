"""Many shots at once from the fish up: sixteen lanes marched together, each lane refilled when its shot ends.

A lane is always in one of three modes. MARCH: free Taylor steps, zeros of q counted by its sign at the ends of each
step. TO_FOLD, TO_END: a step overshot a zero of q or the end of the cable; from its start, forced steps home in on
the target (quintic Hermite first, then Halley or a quadratic, inside a bracket), so that it is reached with full
accuracy.
"""

from math import sqrt

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.calls import END_COLUMNS
from towatlas.kernels.compiling import helper, inlined, kernel
from towatlas.kernels.steppers import taylor_step
from towatlas.kernels.vacuum import start, tension

LANES = 16  # 8 do not vectorise (the loop is unrolled instead); 16 and 32 do, at the same speed
IDLE, MARCH, TO_FOLD, TO_END = 0, 1, 2, 3

# A state is eight rows of `lanes`. TAU = t - mu is the cable paid out, kept in two parts: t - mu would cancel for a
# heavy fish, and one part would lose the phase of the wave after many nodes. H is the last step's length in sigma.
TAU, TAU_LOW, F, P, Z, V, Q, H = range(8)
ROWS = 8
# The states a lane keeps: now, before the step just made, and the two ends of an overshooting step.
NOW, PREVIOUS, BASE, RESUME = 0, ROWS, 2 * ROWS, 3 * ROWS
# Further rows: where the shot begins and ends, the step forced next (0: free), steps made and allowed, zeros of q
# passed and those to be recorded, whether the step just made wants attention, and of a landing its bracket and
# position, in sigma from BASE.
MU, END, FORCED, STEPS, STEP_LIMIT, COUNT, FIRST, LAST, EVENT, LOW, HIGH, OFFSET = range(4 * ROWS, 4 * ROWS + 12)
LANE_ROWS = 4 * ROWS + 12
# Rows of `book`, whole numbers.
JOB, MODE, BASE_COUNT, LANDINGS = range(4)
BOOK_ROWS = 4

# A step below this fraction of the way from BASE is taken as a second-order correction: its third order is below
# rounding. Of that way, not of the overshooting step, which may be longer by far than all the cable.
LANDED = 1e-5
LANDING_LIMIT = 40

# Columns of the results.


@inlined
def _step_lanes(flat):
    """One step in every lane, NOW -> PREVIOUS, NOW; EVENT is set where it takes more than going on."""
    # One flat array at constant offsets: the compiler sees that nothing overlaps, and vectorises.
    for lane in range(LANES):
        tau, tau_low = flat[TAU * LANES + lane], flat[TAU_LOW * LANES + lane]
        f, p, z = flat[F * LANES + lane], flat[P * LANES + lane], flat[Z * LANES + lane]
        v, q = flat[V * LANES + lane], flat[Q * LANES + lane]
        forced = flat[FORCED * LANES + lane]
        flat[(PREVIOUS + TAU) * LANES + lane] = tau
        flat[(PREVIOUS + TAU_LOW) * LANES + lane] = tau_low
        flat[(PREVIOUS + F) * LANES + lane] = f
        flat[(PREVIOUS + P) * LANES + lane] = p
        flat[(PREVIOUS + Z) * LANES + lane] = z
        flat[(PREVIOUS + V) * LANES + lane] = v
        flat[(PREVIOUS + Q) * LANES + lane] = q
        dt, dz, f, p, v_new, q_new, h = taylor_step(flat[MU * LANES + lane] + (tau + tau_low), f, p, v, q, forced)
        # Two-sum: tau + dt with its rounding error kept.
        add = dt + tau_low
        total = tau + add
        part = total - tau
        low = (tau - (total - part)) + (add - part)
        steps = flat[STEPS * LANES + lane] + 1.0
        flat[TAU * LANES + lane] = total
        flat[TAU_LOW * LANES + lane] = low
        flat[F * LANES + lane] = f
        flat[P * LANES + lane] = p
        flat[Z * LANES + lane] = z + dz
        flat[V * LANES + lane] = v_new
        flat[Q * LANES + lane] = q_new
        flat[H * LANES + lane] = h
        flat[STEPS * LANES + lane] = steps
        crossing = (q < 0.0) != (q_new < 0.0)
        count = flat[COUNT * LANES + lane]
        # Comparisons that are false for nan, so that a nan is an event.
        quiet = (
            (abs(q_new) < np.inf)
            & ~_hides_zeros(q, q_new, v, v_new)
            & ~(crossing & (flat[FIRST * LANES + lane] <= count + 1.0) & (count + 1.0 <= flat[LAST * LANES + lane]))
            & ((flat[END * LANES + lane] - total) - low > 0.0)
            & (forced == 0.0)
            & (steps <= flat[STEP_LIMIT * LANES + lane])
            & (abs(p) < np.inf)
        )
        flat[COUNT * LANES + lane] = count + (1.0 if quiet & crossing else 0.0)
        flat[EVENT * LANES + lane] = 0.0 if quiet else 1.0


@inlined
def _hides_zeros(q, q_new, v, v_new):
    """Whether two zeros of q lie in a step: dv/dt = q, and v moved against the sign that q has at both ends."""
    return ((q < 0.0) == (q_new < 0.0)) & (v * v_new < 0.0) & ((v_new - v) * q < 0.0)


@inlined
def _time(lanes, state, lane):
    return lanes[MU, lane] + (lanes[state + TAU, lane] + lanes[state + TAU_LOW, lane])


@inlined
def _remaining(lanes, state, lane):
    return (lanes[END, lane] - lanes[state + TAU, lane]) - lanes[state + TAU_LOW, lane]


@helper
def _q_slopes(lanes, state, lane):
    """First and second derivative in sigma of q at fixed t."""
    t, f = _time(lanes, state, lane), lanes[state + F, lane]
    v, q = lanes[state + V, lane], lanes[state + Q, lane]
    r = tension(t, f)
    ratio = t / r
    first = -ratio * ratio * v
    second = -2.0 * ratio * (1.0 - ratio * (t + f * lanes[state + P, lane]) / r) * v - ratio * t * q
    return first, second


@helper
def _t_slopes(lanes, state, lane):
    """First and second derivative in sigma of t."""
    t, f = _time(lanes, state, lane), lanes[state + F, lane]
    return tension(t, f), t + f * lanes[state + P, lane]


@helper
def _hermite_root(g0, d0, dd0, g1, d1, dd1, h):
    """Root in (0, h) of the quintic with these values, slopes and second derivatives at 0 and h; g0 g1 <= 0."""
    c1 = h * d0
    c2 = 0.5 * h * h * dd0
    rise = g1 - g0 - c1 - c2
    slope = h * d1 - c1 - 2.0 * c2
    curve = h * h * dd1 - 2.0 * c2
    c3 = 10.0 * rise - 4.0 * slope + 0.5 * curve
    c4 = -15.0 * rise + 7.0 * slope - curve
    c5 = 6.0 * rise - 3.0 * slope + 0.5 * curve
    low, high = 0.0, 1.0
    s = g0 / (g0 - g1)
    for _ in range(6):
        g = g0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
        d = c1 + s * (2.0 * c2 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))
        if (g < 0.0) == (g0 < 0.0):
            low = s
        else:
            high = s
        s_new = s - g / d
        if not (low < s_new < high):
            s_new = 0.5 * (low + high)
        if abs(s_new - s) < 1e-4:
            return s_new * h
        s = s_new
    return s * h


@inlined
def _copy(lanes, source, target, lane):
    for row in range(ROWS):
        lanes[target + row, lane] = lanes[source + row, lane]


@inlined
def _load(lanes, book, lane, job, a, mu, tau_end, first_fold, last_fold, max_steps):
    """Put a shot into a lane; returns whether it ended already, within the tip series."""
    tau, f, p, z, v, q, ended = start(a, mu, tau_end)
    lanes[TAU, lane] = tau
    lanes[TAU_LOW, lane] = 0.0
    lanes[F, lane] = f
    lanes[P, lane] = p
    lanes[Z, lane] = z
    lanes[V, lane] = v
    lanes[Q, lane] = q
    lanes[MU, lane] = mu
    lanes[END, lane] = tau_end
    book[JOB, lane] = job
    book[MODE, lane] = MARCH
    lanes[FORCED, lane] = 0.0
    lanes[STEPS, lane] = 0.0
    lanes[STEP_LIMIT, lane] = max_steps
    lanes[COUNT, lane] = 0.0
    lanes[FIRST, lane] = first_fold
    lanes[LAST, lane] = last_fold
    return ended


@inlined
def _after_march(lanes, book, lane):
    """Take the free step just made, or begin to land on what it overshot."""
    q_old, q_new = lanes[PREVIOUS + Q, lane], lanes[Q, lane]
    v_old, v_new = lanes[PREVIOUS + V, lane], lanes[V, lane]
    crossing = (q_old < 0.0) != (q_new < 0.0)
    lanes[FORCED, lane] = 0.0
    if _hides_zeros(q_old, q_new, v_old, v_new):
        # Make a shorter one.
        lanes[FORCED, lane] = 0.5 * lanes[H, lane]
        _copy(lanes, PREVIOUS, NOW, lane)
    elif crossing and lanes[FIRST, lane] <= lanes[COUNT, lane] + 1.0 <= lanes[LAST, lane]:
        _begin_landing(lanes, book, lane, TO_FOLD)
    elif _remaining(lanes, NOW, lane) <= 0.0:
        _begin_landing(lanes, book, lane, TO_END)
    elif crossing:
        lanes[COUNT, lane] += 1.0


@helper
def _begin_landing(lanes, book, lane, mode):
    """Go back to the start of the overshooting step and force the first guess of the step that hits the target."""
    if book[MODE, lane] == MARCH:
        _copy(lanes, PREVIOUS, BASE, lane)
        _copy(lanes, NOW, RESUME, lane)
        book[BASE_COUNT, lane] = int(lanes[COUNT, lane])
    book[MODE, lane] = mode
    _copy(lanes, BASE, NOW, lane)
    if mode == TO_FOLD:
        d0, dd0 = _q_slopes(lanes, BASE, lane)
        d1, dd1 = _q_slopes(lanes, RESUME, lane)
        g0, g1 = lanes[BASE + Q, lane], lanes[RESUME + Q, lane]
    else:
        d0, dd0 = _t_slopes(lanes, BASE, lane)
        d1, dd1 = _t_slopes(lanes, RESUME, lane)
        g0, g1 = -_remaining(lanes, BASE, lane), -_remaining(lanes, RESUME, lane)
    lanes[FORCED, lane] = _hermite_root(g0, d0, dd0, g1, d1, dd1, lanes[RESUME + H, lane])
    lanes[OFFSET, lane] = 0.0
    lanes[LOW, lane] = 0.0
    lanes[HIGH, lane] = lanes[RESUME + H, lane]
    book[LANDINGS, lane] = 0


@inlined
def _after_landing_step(lanes, book, lane):
    """Take the forced step just made; returns whether the target is within a last correction, and that."""
    lanes[OFFSET, lane] += lanes[H, lane]
    book[LANDINGS, lane] += 1
    if book[MODE, lane] == TO_FOLD:
        q = lanes[Q, lane]
        first, second = _q_slopes(lanes, NOW, lane)
        d = -2.0 * q * first / (2.0 * first * first - q * second)
        before = (q < 0.0) == (lanes[BASE + Q, lane] < 0.0)
    else:
        remaining = _remaining(lanes, NOW, lane)
        first, second = _t_slopes(lanes, NOW, lane)
        d = 2.0 * remaining / (first + sqrt(max(first * first + 2.0 * second * remaining, 0.0)))
        before = remaining > 0.0
    if before:
        lanes[LOW, lane] = lanes[OFFSET, lane]
    else:
        lanes[HIGH, lane] = lanes[OFFSET, lane]
    if abs(d) <= LANDED * abs(lanes[OFFSET, lane]):
        return True, d
    if not (lanes[LOW, lane] < lanes[OFFSET, lane] + d < lanes[HIGH, lane]):
        d = 0.5 * (lanes[LOW, lane] + lanes[HIGH, lane]) - lanes[OFFSET, lane]
    lanes[FORCED, lane] = d
    return False, d


@inlined
def _correct(lanes, lane, d):
    """Second-order step of length d in sigma, on the state a landing has reached."""
    t = _time(lanes, NOW, lane)
    f, p, v, q = lanes[F, lane], lanes[P, lane], lanes[V, lane], lanes[Q, lane]
    r, dr = _t_slopes(lanes, NOW, lane)
    dq, ddq = _q_slopes(lanes, NOW, lane)
    half = 0.5 * d
    lanes[TAU, lane] += lanes[TAU_LOW, lane] + d * (r + half * dr)
    lanes[TAU_LOW, lane] = 0.0
    lanes[F, lane] = f + d * (p * r + half * (p * dr - f * r))
    lanes[P, lane] = p - d * (f + half * p * r)
    lanes[Z, lane] += d * (t + half * r)
    lanes[V, lane] = v + d * (q * r + half * (q * dr + dq * r))
    lanes[Q, lane] = q + d * (dq + half * ddq)


@inlined
def _settle_fold(lanes, book, lane, folds, i):
    """Record the fold a lane stands on and march on from the far end of the step; returns whether the shot ended."""
    past_end = lanes[TAU, lane] > lanes[END, lane]
    if not past_end:
        n = int(lanes[COUNT, lane] - lanes[FIRST, lane]) + 1
        folds[i, n, 0] = lanes[TAU, lane]
        folds[i, n, 1] = lanes[F, lane]
        folds[i, n, 2] = lanes[P, lane]
        folds[i, n, 3] = lanes[Z, lane]
        lanes[COUNT, lane] += 1.0
        if lanes[COUNT, lane] == lanes[LAST, lane] and np.isinf(lanes[END, lane]):
            return True
    if past_end or _remaining(lanes, RESUME, lane) <= 0.0:
        _begin_landing(lanes, book, lane, TO_END)
    else:
        _copy(lanes, RESUME, NOW, lane)
        book[MODE, lane] = MARCH
        lanes[FORCED, lane] = 0.0
    return False


@helper
def _settle_end(lanes, book, lane):
    """Close the count of a shot that stands on its end."""
    lanes[TAU, lane] = lanes[END, lane]
    lanes[COUNT, lane] = book[BASE_COUNT, lane]
    if (lanes[Q, lane] < 0.0) != (lanes[BASE + Q, lane] < 0.0):
        lanes[COUNT, lane] += 1.0


@inlined
def _advance(lanes, book, lane, folds, i):
    """What follows the step a lane just made; returns whether its shot ended, and with what status."""
    if not (np.isfinite(lanes[P, lane]) and np.isfinite(lanes[Q, lane]) and np.isfinite(lanes[TAU, lane])):
        return True, status.BAD_INPUT
    if lanes[STEPS, lane] > lanes[STEP_LIMIT, lane]:
        return True, status.STEP_LIMIT
    if book[MODE, lane] == MARCH:
        _after_march(lanes, book, lane)
        return False, status.OK
    landed, d = _after_landing_step(lanes, book, lane)
    if not landed:
        return book[LANDINGS, lane] >= LANDING_LIMIT, status.NOT_CONVERGED
    _correct(lanes, lane, d)
    if book[MODE, lane] == TO_FOLD:
        return _settle_fold(lanes, book, lane, folds, i), status.OK
    _settle_end(lanes, book, lane)
    return True, status.OK


@inlined
def _unload(lanes, book, lane, outcome, ends, counts, statuses):
    job = book[JOB, lane]
    ends[job, 0] = lanes[TAU, lane] + lanes[TAU_LOW, lane]
    for column in range(1, END_COLUMNS):
        ends[job, column] = lanes[column + 1, lane]
    counts[job] = int(lanes[COUNT, lane])
    statuses[job] = outcome
    book[MODE, lane] = IDLE


@helper
def _sane(a, mu, tau_end):
    return a != 0.0 and np.isfinite(a) and np.isfinite(mu) and mu >= 0.0 and tau_end >= 0.0


@helper
def _long_first(mu, tau_end, last_fold, begin, stop):
    """Numbers of the shots, those of more than twice the mean number of half waves before the others.

    A long one that begins late marches on alone, in one lane of all.
    """
    waves, total = np.empty(stop - begin), 0.0
    for k in range(stop - begin):
        i = begin + k
        waves[k] = 0.0
        if mu[i] >= 0.0 and 0.0 <= tau_end[i] < np.inf:
            waves[k] = sqrt(mu[i] + tau_end[i]) - sqrt(mu[i]) if mu[i] < np.inf else 0.0
        elif tau_end[i] == np.inf:
            waves[k] = float(last_fold[i])
        total += waves[k]
    order, place = np.empty(stop - begin, np.int64), 0
    for long in (True, False):
        for k in range(stop - begin):
            if (waves[k] * (stop - begin) > 2.0 * total) == long:
                order[place] = begin + k
                place += 1
    return order


@kernel
def march(a, mu, tau_end, first_fold, last_fold, max_steps, ends, folds, counts, statuses, begin, stop):
    """March shots begin..stop-1 of the arrays given; results go to the same rows.

    A shot starts at the fish with offset a[i] at t = mu[i] and ends after tau_end[i] of cable; where that is inf it
    ends at its last_fold[i]-th fold instead. All lengths in g/Omega^2.

    ends[i] : tau, f, p, z, v, q where the shot ended. folds[i, n - first_fold[i]] : tau, f, p, z at the n-th zero of
    q, for first_fold[i] <= n <= last_fold[i], untouched for those beyond the end. counts[i] : zeros of q passed.
    statuses[i] : OK, STEP_LIMIT, NOT_CONVERGED or BAD_INPUT; the values are those reached.
    """
    lanes = np.ones((LANE_ROWS, LANES))
    lanes[FORCED, :] = 0.0
    lanes[STEPS, :] = 0.0
    flat = lanes.reshape(LANE_ROWS * LANES)
    book = np.zeros((BOOK_ROWS, LANES), np.int64)
    order = _long_first(mu, tau_end, last_fold, begin, stop)
    next_job = 0
    busy = 0
    while True:
        for lane in range(LANES):
            while book[MODE, lane] == IDLE and next_job < len(order):
                i = order[next_job]
                next_job += 1
                if not _sane(a[i], mu[i], tau_end[i]):
                    ends[i, :] = np.nan
                    counts[i] = 0
                    statuses[i] = status.BAD_INPUT
                elif _load(lanes, book, lane, i, a[i], mu[i], tau_end[i], first_fold[i], last_fold[i], max_steps):
                    sound = np.isfinite(lanes[P, lane]) and np.isfinite(lanes[Q, lane])
                    _unload(lanes, book, lane, status.OK if sound else status.BAD_INPUT, ends, counts, statuses)
                else:
                    busy += 1
        if busy == 0:
            break
        _step_lanes(flat)
        for lane in range(LANES):
            if lanes[EVENT, lane] != 0.0 and book[MODE, lane] != IDLE:
                i = book[JOB, lane]
                ended, outcome = _advance(lanes, book, lane, folds, i)
                if ended:
                    _unload(lanes, book, lane, outcome, ends, counts, statuses)
                    busy -= 1
