"""Shots with drag, eight side by side, each lane refilled when its shot ends: the march, and what Python calls.

A shot is computed the same way in whatever lane and company: the results are the same bits in any order.
"""

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.calls import ORDER, RESULT_ROWS
from towatlas.kernels.compiling import helper, kernel
from towatlas.kernels.drag import (
    ACROSS,
    FIRST,
    FX,
    FY,
    FZ,
    GROUPS,
    KAPPA,
    KAPPA_S,
    KEPT,
    NORMAL,
    ON_NORMAL,
    ON_SIDE,
    ON_TANGENT,
    PACE,
    PARAMETERS,
    PAST_AXIS,
    QUANTITIES,
    RA,
    RHO,
    ROUND,
    SIDE,
    STATE,
    TANGENTIAL,
    ZERO,
    E,
    G,
    T,
    U,
    X,
    Y,
    advance_jets,
    expand_jets,
    finish,
    set_pace,
    set_parameters,
    start,
    step_lengths,
    values,
)
from towatlas.kernels.drag_slopes import COUNT, advance_slopes, expand_slopes
from towatlas.kernels.system import C_F, C_S, M_F, W_F
from towatlas.kernels.vector import LANES, absolute, aligned, load, square_root, store

EPS = 2.0**-52
IDLE = np.int64(-1)
SECOND = np.int64(2)


@helper
def landing(c, pace, count, lane, remaining, h):
    """Step within h that pays out the remaining cable in a lane, by Newton inside a bracket."""
    low, high = 0.0, h
    s = 0.5 * h
    for _ in range(100):
        paid = tension = 0.0
        for k in range(ORDER, 0, -1):
            paid = paid * s + c[(U * count * KEPT + k) * LANES + lane]
            tension = tension * s + c[(T * count * KEPT + k) * LANES + lane]
        tension = tension * s + c[T * count * KEPT * LANES + lane]
        miss = s * paid - remaining
        if miss > 0.0:
            high = s
        else:
            low = s
        trial = s - miss / (tension * pace)
        if not (low < trial < high):
            trial = 0.5 * (low + high)
        if abs(trial - s) <= 2.0 * EPS * s:
            return trial
        s = trial
    return s


@helper
def past_axis(c, p, new, h, count, truncation, room):
    """Into room: how far steps have gone past the axis, above 1 where too far.

    Close by, g = T |V_n| and rho are all but absolute values of smooth functions, of which the series know one branch
    only and their last terms nothing: what they are at the end of the step tells.
    """
    x, y, fz = load(new, X * count), load(new, Y * count), load(new, FZ * count)
    along = x * load(new, FX * count) + y * load(new, FY * count)
    rho2 = x * x + y * y
    step = load(h, ZERO)
    limit = PAST_AXIS * truncation * square_root(load(c, T * count * KEPT)) / load(p, PACE * count)
    normal = absolute(values(c, G * count * KEPT, ZERO, step) - square_root(fz * fz * rho2 + along * along))
    store(room, ZERO, load(p, KAPPA * count) * normal * step / limit)
    rho = square_root(rho2)
    side = absolute(values(c, RHO * count * KEPT, ZERO, step) - rho) * rho * absolute(fz)
    store(room, FIRST, absolute(load(p, KAPPA_S * count)) * side * step / limit)


@helper
def _began(x, y, new_x, new_y):
    """1 where the angle about the axis passes 180 degrees in a step, -1 where it falls back by rounding; half a turn
    at most, and upwards but for rounding."""
    if y >= 0.0 and new_y < 0.0:
        return 0 if x > 0.0 and new_x > 0.0 else 1
    if y < 0.0 and new_y >= 0.0:
        return -1 if x < 0.0 and new_x < 0.0 else 0
    return 0


@helper
def begin_lanes(shots, algebra, jobs, fresh, work, count):
    """Start the shots of the lanes that are fresh."""
    c, scratch, p, ends, paid, low = work
    any_bare = any_fish = False
    bare = np.zeros(LANES, np.bool_)
    for lane in range(LANES):
        if fresh[lane]:
            i = jobs[lane]
            system = shots.systems[i]
            set_parameters(p, lane, shots.r[i], shots.gamma2[i], system, shots.directions[i], algebra.places, count)
            bare[lane] = system[W_F] == 0.0 and system[M_F] == 0.0 and system[C_F] == 0.0
            any_bare, any_fish = any_bare or bare[lane], any_fish or not bare[lane]
    for which in range(2):
        if not (any_bare if which else any_fish):
            continue
        start(scratch, p, algebra.products, algebra.pairs, count, which == 1)
        for lane in range(LANES):
            if not fresh[lane] or bare[lane] != (which == 1):
                continue
            for n in range(count):
                for q in range(STATE):
                    at = (q * count + n) * KEPT * LANES + lane
                    c[at] = scratch[at] if q > T else 0.0
                ends[n * LANES + lane] = scratch[(RA * count + n) * KEPT * LANES + lane] * shots.shares[jobs[lane]]
            set_pace(c, p, lane, count)
            paid[lane], low[lane] = scratch[U * count * KEPT * LANES + lane], 0.0


@helper
def _end(reached, algebra, jobs, over, work, count):
    """Write the results of the lanes whose shots are over."""
    c, scratch, p = work[0], work[1], work[2]
    for row in range(X * count, STATE * count):
        store(scratch, row * KEPT, load(c, row * KEPT))
    finish(scratch, p, algebra.products, algebra.pairs, count)
    for lane in range(LANES):
        if over[lane]:
            i = jobs[lane]
            for n in range(count):
                for q in range(X, STATE):
                    reached.state[i, q - X, n] = scratch[(q * count + n) * KEPT * LANES + lane]
                reached.state[i, RESULT_ROWS - 2, n] = scratch[(T * count + n) * KEPT * LANES + lane]
                reached.state[i, RESULT_ROWS - 1, n] = scratch[(E * count + n) * KEPT * LANES + lane]
            if reached.statuses[i] == status.OK and not np.isfinite(reached.state[i, RESULT_ROWS - 1, 0]):
                reached.statuses[i] = status.BAD_INPUT
            jobs[lane] = IDLE


@helper
def _commit(c, new, h, ended, jobs, work, count, max_steps, reached, over, room):
    """Make the steps; says which shots are over."""
    p, paid, low = work[2], work[4], work[5]
    # Zero, or nan where anything is not finite.
    sound = load(new, U * count) * 0.0
    for row in range(X * count, STATE * count):
        sound = sound + load(new, row) * 0.0
    store(room, ZERO, sound)
    for lane in range(LANES):
        i = jobs[lane]
        over[lane] = False
        if i == IDLE:
            continue
        add = new[U * count * LANES + lane] + low[lane]
        total = paid[lane] + add
        part = total - paid[lane]
        low[lane] = (paid[lane] - (total - part)) + (add - part)
        paid[lane] = total
        x, y = c[X * count * KEPT * LANES + lane], c[Y * count * KEPT * LANES + lane]
        new_x, new_y = new[X * count * LANES + lane], new[Y * count * LANES + lane]
        reached.turns[i, 0] += _began(x, y, new_x, new_y)
        reached.turns[i, 1] += (x < 0.0) != (new_x < 0.0)
        reached.steps[i] += 1
        p[PACE * count * LANES + lane] *= h[lane]
        if not (room[lane] == 0.0 and np.isfinite(total)):
            reached.statuses[i] = status.BAD_INPUT
            over[lane] = True
        elif ended[lane]:
            over[lane] = True
        elif reached.steps[i] >= max_steps:
            reached.statuses[i] = status.STEP_LIMIT
            over[lane] = True
    for row in range(X * count, STATE * count):
        store(c, row * KEPT, load(new, row))


@kernel
def shoot_drag(shots, algebra, truncation, max_steps, reached, begin, stop):
    """Shots begin..stop-1 of those given; results go to the same rows of `reached`.

    truncation : error of a step, relative to the local amplitudes.
    """
    count = reached.state.shape[2]
    # The jets 1 and log r.
    fast = count == COUNT and algebra.places[0] == 1
    c, scratch, p = aligned(QUANTITIES * count * KEPT), aligned(QUANTITIES * count * KEPT), aligned(PARAMETERS * count)
    new, h, target, ends, room = aligned(STATE * count), aligned(count), aligned(count), aligned(count), aligned(3)
    paid, low = np.zeros(LANES), np.zeros(LANES)
    work = (c, scratch, p, ends, paid, low)
    jobs, ended, over = np.full(LANES, IDLE), np.zeros(LANES, np.bool_), np.zeros(LANES, np.bool_)
    fresh, groups = np.zeros(LANES, np.bool_), np.full(GROUPS, True)
    at, busy = begin, 0
    sided = False
    while True:
        filled = False
        busy = 0
        for lane in range(LANES):
            busy += jobs[lane] != IDLE
        for lane in range(LANES):
            fresh[lane] = False
            if jobs[lane] == IDLE and at < stop:
                another = shots.systems[at, C_S] != 0.0
                sided = another if busy == 0 else sided
                # The two programs round differently: lanes hold shots of one of them at a time.
                fresh[lane] = not fast or another == sided
            if fresh[lane]:
                busy += 1
                jobs[lane] = at
                reached.steps[at], reached.statuses[at] = 0, status.OK
                reached.turns[at, :] = 0
                at += 1
                filled = True
        if filled:
            begin_lanes(shots, algebra, jobs, fresh, work, count)
        idle = False
        groups[ON_NORMAL] = groups[ON_TANGENT] = groups[ON_SIDE] = False
        for lane in range(LANES):
            over[lane] = fresh[lane] and not paid[lane] < ends[lane]
            idle = idle or over[lane]
            if jobs[lane] != IDLE:
                groups[ON_NORMAL] |= p[NORMAL * count * LANES + lane] != 0.0
                groups[ON_TANGENT] |= p[TANGENTIAL * count * LANES + lane] != 0.0
                groups[ON_SIDE] |= p[SIDE * count * LANES + lane] != 0.0
        if busy == 0:
            return
        if idle:
            # No longer than the bit of a bare tip that a shot begins with.
            _end(reached, algebra, jobs, over, work, count)
            continue
        groups[ACROSS] = groups[ON_NORMAL] or groups[ON_SIDE]
        groups[ROUND] = groups[ON_NORMAL] or groups[ON_TANGENT] or groups[ON_SIDE]
        if fast and not groups[ON_SIDE]:
            expand_slopes(c, p, groups[ON_TANGENT])
        else:
            expand_jets(c, p, algebra.products, algebra.pairs, count, groups)
        step_lengths(c, p, count, truncation, room, h)
        store(room, SECOND, values(c, U * count * KEPT, FIRST, load(h, ZERO)))
        for lane in range(LANES):
            ended[lane] = False
            if jobs[lane] == IDLE:
                h[lane] = 0.0
                continue
            remaining = (ends[lane] - paid[lane]) - low[lane]
            # As the length paid out may overflow where the cable ends long before the step does, in this order.
            if not h[lane] * room[2 * LANES + lane] < remaining:
                h[lane] = landing(c, p[PACE * count * LANES + lane], count, lane, remaining, h[lane])
                ended[lane] = True
        again = True
        while again:
            for n in range(1, count):
                for lane in range(LANES):
                    target[n * LANES + lane] = ends[n * LANES + lane] if ended[lane] else 0.0
            if fast:
                advance_slopes(c, p, new, h, target)
            else:
                advance_jets(c, p, new, h, target, algebra.products, count, algebra.degree)
            again = False
            if not groups[ACROSS]:
                break
            past_axis(c, p, new, h, count, truncation, room)
            for lane in range(LANES):
                past = room[lane] > 1.0 or (groups[ON_SIDE] and room[LANES + lane] > 1.0)
                if past and jobs[lane] != IDLE:
                    h[lane] *= 0.5
                    ended[lane] = False
                    again = True
        _commit(c, new, h, ended, jobs, work, count, max_steps, reached, over, room)
        if over.any():
            _end(reached, algebra, jobs, over, work, count)
