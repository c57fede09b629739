"""All equilibria of one cable, by the count of zeros of q: nothing is scanned, so nothing is missed.

On the shots of a cable (mu, tau) the number of zeros of q = dp/da falls, as the offset a grows, from its linear limit
to zero. Each fall is an extremum of p(t_e; a), and between two neighbouring extrema p is monotone: it meets each of
+gamma^2 and -gamma^2, an equilibrium and a mirrored one, at most once.
"""

from math import exp, log

import numpy as np

from kernels import status
from kernels.compiling import helper, kernel
from kernels.shots import END_COLUMNS, FOLD_COLUMNS, march

# An offset in the linear limit, and one below every equilibrium: |p| outgrows a by no more than sqrt(mu).
LINEAR = 1e-12
# Separators of the monotone pieces: at one, p differs from the extremum by the square of this.
SEPARATED = 1e-9
ROUNDS = 200
MAX_STEPS = 10**7
EPS = 2.0**-52

# Columns of the results.
R_X0, X_F, Z_F, NODES, ERROR = range(5)
RESULT_COLUMNS = 5


@helper
def _shoot(a, mu, tau, rows, ends, counts):
    """Shots of one cable with the offsets a[:rows]; returns the worst status."""
    mus = np.full(rows, mu)
    taus = np.full(rows, tau)
    none = np.zeros(rows, np.int64)
    folds = np.empty((rows, 1, FOLD_COLUMNS))
    statuses = np.empty(rows, np.int64)
    march(a, mus, taus, none, none, MAX_STEPS, ends, folds, counts, statuses, 0, rows)
    return statuses.max()


@helper
def _separators(mu, tau, pieces, a, p):
    """Offsets a[1] > a[2] > ... of the extrema of p(t_e; a), and p there, between a[0] and a[pieces]; a status."""
    rows = pieces - 1
    low = np.full(rows, log(a[pieces]))
    high = np.full(rows, log(a[0]))
    q_low = np.zeros(rows)
    q_high = np.zeros(rows)
    trial = np.empty(max(rows, 1))
    ends = np.empty((max(rows, 1), END_COLUMNS))
    counts = np.empty(max(rows, 1), np.int64)
    lowest = np.full(rows, rows)
    highest = np.zeros(rows, np.int64)
    for round_ in range(ROUNDS):
        widest = 0.0
        for k in range(rows):
            share = 0.5
            if lowest[k] == k + 1 and highest[k] == k and q_low[k] * q_high[k] < 0.0 and round_ % 3 < 2:
                # One extremum left between: q changes its sign there, and the secant is quicker.
                share = min(max(q_low[k] / (q_low[k] - q_high[k]), 0.01), 0.99)
            trial[k] = exp(low[k] + share * (high[k] - low[k]))
            widest = max(widest, high[k] - low[k])
        if widest < SEPARATED:
            break
        outcome = _shoot(trial[:rows], mu, tau, rows, ends, counts)
        if outcome != status.OK:
            return outcome
        for k in range(rows):
            if counts[k] > k:
                low[k], q_low[k], lowest[k] = log(trial[k]), ends[k, 5], counts[k]
            else:
                high[k], q_high[k], highest[k] = log(trial[k]), ends[k, 5], counts[k]
    for k in range(rows):
        trial[k] = exp(0.5 * (low[k] + high[k]))
    if rows > 0:
        outcome = _shoot(trial[:rows], mu, tau, rows, ends, counts)
        if outcome != status.OK:
            return outcome
    for k in range(rows):
        a[k + 1] = trial[k]
        p[k + 1] = ends[k, 2]
    return status.OK


@helper
def _polish(mu, tau, level, low, high, rising, rows, a, ends, error):
    """Roots of p(t_e; a) = level[k] between low[k] and high[k], by Newton inside the bracket. Returns a status."""
    counts = np.empty(rows, np.int64)
    done = np.zeros(rows, np.bool_)
    for k in range(rows):
        a[k] = 0.5 * (low[k] + high[k]) if high[k] < 4.0 * low[k] else (low[k] * high[k]) ** 0.5
        error[k] = np.inf
    for round_ in range(ROUNDS):
        outcome = _shoot(a, mu, tau, rows, ends, counts)
        if outcome != status.OK:
            return outcome
        left = 0
        for k in range(rows):
            if done[k]:
                continue
            miss = ends[k, 2] - level[k]
            if (miss > 0.0) == rising[k]:
                high[k] = a[k]
            else:
                low[k] = a[k]
            step = -miss / ends[k, 5]
            # The last word of rounding: a step that no longer shrinks, or that a cannot take.
            if abs(step) <= 2.0 * EPS * a[k] or (abs(step) < 1e-9 * a[k] and abs(step) > 0.5 * error[k]):
                error[k] = abs(step) / a[k]
                done[k] = True
                continue
            error[k] = abs(step)
            left += 1
            trial = a[k] + step
            if not (low[k] < trial < high[k]) or round_ % 8 == 7:
                trial = 0.5 * (low[k] + high[k]) if high[k] < 4.0 * low[k] else (low[k] * high[k]) ** 0.5
            if trial == a[k] or high[k] - low[k] <= 2.0 * EPS * high[k]:
                error[k] = (high[k] - low[k]) / a[k]
                done[k] = True
                continue
            a[k] = trial
        if left == 0:
            return status.OK
    return status.NOT_CONVERGED


@kernel
def solve_equilibria(w_f, lam, gamma):
    """All equilibria of the cable (w_f, lam) at speed gamma.

    Returns an array and a status. A row for each equilibrium, from the farthest fish inwards: R_x0, x_f, z_f, number
    of nodes, relative error estimate of x_f; lengths over the tow radius.
    """
    gamma2 = gamma * gamma
    mu, tau = gamma2 * w_f, gamma2 * lam
    # The fish is never farther out than a straight cable reaches, |x_f| <= 1 + lambda; fast cables come so close to it
    # that the bracket needs slack.
    a_max = 1.01 * gamma2 * (1.0 + lam)
    ends = np.empty((2, END_COLUMNS))
    counts = np.empty(2, np.int64)
    a_min = LINEAR * min(1.0, gamma2)
    outcome = _shoot(np.array([a_min, a_max]), mu, tau, 2, ends, counts)
    if outcome != status.OK:
        return np.empty((0, RESULT_COLUMNS)), outcome
    pieces = counts[0] + 1
    a = np.empty(pieces + 1)
    p = np.empty(pieces + 1)
    a[0], p[0] = a_max, max(ends[1, 2], gamma2)
    a[pieces], p[pieces] = a_min, ends[0, 2]
    outcome = _separators(mu, tau, pieces, a, p)
    if outcome != status.OK:
        return np.empty((0, RESULT_COLUMNS)), outcome

    level = np.empty(2 * pieces)
    low = np.empty(2 * pieces)
    high = np.empty(2 * pieces)
    rising = np.empty(2 * pieces, np.bool_)
    nodes = np.empty(2 * pieces, np.int64)
    rows = 0
    crossed = 0
    for piece in range(pieces):
        far, near = p[piece], p[piece + 1]
        # Going inwards p passes gamma^2 > 0 > -gamma^2 in the order of its slope; a node enters where it passes 0.
        for sign in (1.0, -1.0) if far > near else (-1.0, 1.0):
            target = sign * gamma2
            if (far >= target) != (near >= target):
                level[rows] = target
                low[rows], high[rows] = a[piece + 1], a[piece]
                rising[rows] = far > near
                nodes[rows] = crossed + (1 if (far > 0.0) != (sign > 0.0) else 0)
                rows += 1
        if (far > 0.0) != (near > 0.0) and piece + 1 < pieces:
            crossed += 1
    roots = np.empty(rows)
    error = np.empty(rows)
    ends = np.empty((rows, END_COLUMNS))
    results = np.empty((rows, RESULT_COLUMNS))
    outcome = _polish(mu, tau, level, low, high, rising, rows, roots, ends, error)
    for k in range(rows):
        sign = 1.0 if level[k] > 0.0 else -1.0
        results[k, R_X0] = sign * ends[k, 1] / gamma2
        results[k, X_F] = sign * roots[k] / gamma2
        results[k, Z_F] = ends[k, 3] / gamma2
        results[k, NODES] = nodes[k]
        results[k, ERROR] = error[k]
    return results, outcome
