"""From shots to critical states: the direct solution of one fold, and its closed-form first guess."""

from math import exp, log, pi, sqrt

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.calls import END_COLUMNS, FOLD_COLUMNS
from towatlas.kernels.compiling import helper, inlined, kernel
from towatlas.kernels.lanes import march
from towatlas.kernels.vacuum import tension

EPS = 2.0**-52
# Step of the finite-difference Jacobian in log a and log gamma, where rounding is all that disturbs it; where lambda
# leaves little of the excess length, the root of what it leaves.
DIFFERENCE = 1e-6
ROUNDS = 60
RETREATS = 20
# Broyden's updates take over from Newton below this step; above, the Jacobian changes too fast.
NEAR = 0.05
# The error estimate in units of rounding, of 1 and of lambda over the excess length. Measured: below 6 against 34
# digits, 40 against an independent solver in long double, on cables above 590 tow radii.
ROUNDINGS = 48.0
# Rounding of the shot is relative to the amplitude of its wave, which on long cables with a light fish outgrows p as
# lambda^(2/3). Measured: below 0.4 of it against 34 digits.
WAVES = 4.0
# An answer whose estimated error is above this is not given.
WORTHLESS = 1e-4
# A step this small that no longer shrinks is rounding noise.
NOISE = 1e-9
# What a first-order correction leaves of a, R_x0 and z_f, in units of what it leaves of gamma. Measured: below 2.
CAUTION = 4.0


@inlined
def threshold_offset(w_f):
    """Offset of the fish at the threshold, sqrt(1 + w_f^2) - w_f, without cancellation."""
    return 1.0 / (w_f + sqrt(1.0 + w_f * w_f))


@inlined
def excess_length(lam, w_f, n):
    """lambda - lambda_cn(w_f), with lambda_cn = 2 n - 1 + sqrt(1 + w_f^2) - w_f (Eq. 36 for n = 1)."""
    return (lam - (2.0 * n - 1.0)) - threshold_offset(w_f)


@helper
def _first_guess(lam, w_f, excess, n):
    """Rough (log a, log gamma) of the n-th fold: a wave of n - 1 half-lengths above a pendulum, right within a few.

    WKB of the straight cable for gamma, with the excess length for lambda; for the slope a at the fish, its offset at
    the threshold and the lambda^(-1/3) of weakly nonlinear long cables.
    """
    m = sqrt(w_f / lam)
    phase = pi * (n - 1) + 1.0 / (m + 4.0 / (3.0 * pi))
    gamma2 = (0.5 * phase * (sqrt(1.0 + m * m) + m)) ** 2 / excess
    slope = 1.5 * (1.0 + (n - 1) / (1.0 + m)) / excess ** (1.0 / 3.0)
    return log(gamma2 * threshold_offset(w_f) + slope), 0.5 * log(gamma2)


@helper
def _residual(fold, mu, log_gamma, excess, n):
    """By how much a shot's n-th fold misses gamma^2 = |p| and, in the logarithm, the excess length asked for."""
    p = abs(fold[2])
    # No fold lies at or below its threshold; only rounding can say so.
    d = max(excess_length(fold[0] / p, mu / p, n), EPS * fold[0] / p)
    return log(p) - 2.0 * log_gamma, log(d / excess)


@helper
def _amplitude(fold, mu):
    """Local amplitude of the wave of p, at a fold."""
    return sqrt(fold[2] * fold[2] + fold[1] * fold[1] / tension(mu + fold[0], fold[1]))


@helper
def _broyden(jac, step, residual0, residual1, before):
    """Rank-one update of the Jacobian after a step from the residual `before`."""
    norm = step[0] ** 2 + step[1] ** 2
    miss0 = residual0 - before[0] - jac[0, 0] * step[0] - jac[0, 1] * step[1]
    miss1 = residual1 - before[1] - jac[1, 0] * step[0] - jac[1, 1] * step[1]
    for column in range(2):
        jac[0, column] += miss0 * step[column] / norm
        jac[1, column] += miss1 * step[column] / norm


@inlined
def _slopes_determinant(slopes):
    return slopes[0] * (0.5 + slopes[3]) - slopes[1] * slopes[2]


@helper
def _jacobian_from_slopes(slopes, jac):
    """Jacobian of the residuals, from the slopes of the solution (log a, log gamma) in (log excess, log w_f).

    A shot's fold is exact for a cable of its own: with residuals r, that of excess e^r1 times too large and of
    w_f e^-r0 times, at a gamma e^(r0/2) times. So the step to the cable asked for is minus these slopes times r.
    """
    a_r0, a_r1 = -slopes[1], slopes[0]
    gamma_r0, gamma_r1 = -(0.5 + slopes[3]), slopes[2]
    determinant = _slopes_determinant(slopes)
    jac[0, 0], jac[0, 1] = gamma_r1 / determinant, -a_r1 / determinant
    jac[1, 0], jac[1, 1] = -gamma_r0 / determinant, a_r0 / determinant


@helper
def _newton_step(jac, residual0, residual1):
    determinant = jac[0, 0] * jac[1, 1] - jac[0, 1] * jac[1, 0]
    return (
        (jac[0, 1] * residual1 - jac[1, 1] * residual0) / determinant,
        (jac[1, 0] * residual0 - jac[0, 0] * residual1) / determinant,
    )


@helper
def _gamma_slopes(fold, v, a, mu, n):
    """Slopes of log gamma in log(excess) and log w_f along the folds, at that of a shot: exact.

    At fixed t the variation in mu obeys the linear equation of that in a. Their Wronskian is constant, at the fish
    mu a / sqrt(1 + a^2), and at a fold, where q = dp/da vanishes, v dp/dmu. So p is known to first order in mu and t.
    """
    tau, f, p = fold[0], fold[1], fold[2]
    lam, w_f = tau / abs(p), mu / abs(p)
    along_t = -f / tension(mu + tau, f)
    along_w_f = (mu * a / (v * sqrt(1.0 + a * a)) + along_t) * mu / p
    along_lam = along_t * tau / p
    left = 2.0 * (1.0 - along_w_f - along_lam)
    # Of lambda_cn, in log w_f.
    threshold = -w_f * threshold_offset(w_f) / sqrt(1.0 + w_f * w_f)
    share = along_lam / lam
    return share * excess_length(lam, w_f, n) / left, (along_w_f + share * threshold) / left


@helper
def _correct(slopes, in_excess, in_w_f, miss0, miss1, a, state):
    """From the fold of a shot to that of the cable asked for, to first order; returns the offset a of the fish."""
    a *= exp(slopes[1] * miss0 - slopes[0] * miss1)
    state[0] *= exp(in_w_f * miss0 - in_excess * miss1)
    state[1] *= exp(slopes[5] * miss0 - slopes[4] * miss1)
    state[2] = np.copysign(a / (state[0] * state[0]), state[2])
    state[3] *= exp(slopes[7] * miss0 - slopes[6] * miss1)
    return a


# What is kept of a row from round to round: unknowns log a and log gamma, the last step and its size, the residuals
# before it, the rounding of log gamma, and the step of differences.
X, STEP, BEFORE = (0, 1), (2, 3), (4, 5)
SIZE, ROUNDING, DIFFERENCE_STEP = 6, 7, 8
WORK_COLUMNS = 9
# Whole numbers: whether the row is still open, whether its Jacobian is taken anew or comes from the slopes given, how
# often it went back, and which shot of the round is its first.
OPEN, FRESH, SEEDED, RETREATS_MADE, FIRST = range(5)
BOOK_COLUMNS = 5


@helper
def _begin(lam, w_f, n, excess, a, gamma, slopes, work, book, k):
    """Where a row starts; returns its status, NOT_CONVERGED if it can be solved."""
    book[k, OPEN], book[k, SEEDED], book[k, RETREATS_MADE], book[k, FIRST] = 0, 0, 0, 0
    book[k, FRESH] = 1
    work[k, SIZE] = np.inf
    if not (np.isfinite(lam) and np.isfinite(w_f) and n >= 1 and w_f >= 0.0):
        return status.BAD_INPUT
    if not excess > 0.0:
        return status.NO_TRANSITION
    if ROUNDINGS * EPS * (1.0 + lam / excess) > WORTHLESS:
        return status.LOST_IN_ROUNDING
    book[k, OPEN] = 1
    work[k, ROUNDING] = EPS * (1.0 + lam / excess)
    work[k, DIFFERENCE_STEP] = DIFFERENCE + sqrt(work[k, ROUNDING])
    if gamma > 0.0:
        work[k, X[0]], work[k, X[1]] = log(a), log(gamma)
        determinant = _slopes_determinant(slopes)
        if np.isfinite(determinant) and determinant != 0.0:
            book[k, SEEDED], book[k, FRESH] = 1, 0
    else:
        work[k, X[0]], work[k, X[1]] = _first_guess(lam, w_f, excess, n)
    return status.NOT_CONVERGED


@helper
def _place_shots(w_f, n, work, book, k, count, job_a, job_mu, job_n):
    """The shots of a row in this round: one, or three where the Jacobian is taken anew; returns how many there are."""
    book[k, FIRST] = count
    for variant in range(3 if book[k, FRESH] else 1):
        job_a[count] = exp(work[k, X[0]] + (work[k, DIFFERENCE_STEP] if variant == 1 else 0.0))
        job_mu[count] = w_f * exp(2.0 * (work[k, X[1]] + (work[k, DIFFERENCE_STEP] if variant == 2 else 0.0)))
        job_n[count] = n
        count += 1
    return count


@helper
def _step_back(lam, w_f, n, excess, outcome, work, book, k):
    """After a shot that failed: begin again without the seed, or go half of the step back, or give up; the status."""
    if book[k, SEEDED]:
        book[k, SEEDED], book[k, FRESH] = 0, 1
        work[k, X[0]], work[k, X[1]] = _first_guess(lam, w_f, excess, n)
    elif book[k, RETREATS_MADE] == RETREATS or not work[k, SIZE] < np.inf:
        # Nothing to go back on a first guess, or after many halvings. The input was sound: a shot that overflowed says
        # that the solver lost its way.
        book[k, OPEN] = 0
        return status.STEP_LIMIT if outcome == status.STEP_LIMIT else status.NOT_CONVERGED
    else:
        book[k, RETREATS_MADE] += 1
        book[k, FRESH] = 1
        for column in range(2):
            work[k, STEP[column]] *= 0.5
            work[k, X[column]] -= work[k, STEP[column]]
    return status.NOT_CONVERGED


@helper
def _update_jacobian(n, excess, slopes, job_mu, shot_folds, miss0, miss1, jac, work, book, k):
    """The Jacobian by differences, from the slopes given, or by Broyden's update."""
    if book[k, FRESH]:
        for column in range(2):
            j = book[k, FIRST] + 1 + column
            log_gamma = work[k, X[1]] + (work[k, DIFFERENCE_STEP] if column == 1 else 0.0)
            near0, near1 = _residual(shot_folds[j, 0], job_mu[j], log_gamma, excess, n)
            jac[0, column] = (near0 - miss0) / work[k, DIFFERENCE_STEP]
            jac[1, column] = (near1 - miss1) / work[k, DIFFERENCE_STEP]
    elif book[k, SEEDED]:
        _jacobian_from_slopes(slopes, jac)
    else:
        _broyden(jac, work[k, STEP[0] : STEP[1] + 1], miss0, miss1, work[k, BEFORE[0] : BEFORE[1] + 1])


@helper
def _next_step(jac, miss0, miss1, work, book, k):
    """Newton's step from here, made unless it is the last; returns whether it is."""
    step0, step1 = _newton_step(jac, miss0, miss1)
    size = max(abs(step0), abs(step1))
    noise = NOISE + 100.0 * work[k, ROUNDING]
    last = size <= 8.0 * work[k, ROUNDING] or (size < noise and not book[k, FRESH] and size > 0.5 * work[k, SIZE])
    work[k, STEP[0]], work[k, STEP[1]] = step0, step1
    if not last:
        near = size < NEAR and (book[k, FRESH] or size < 0.5 * work[k, SIZE])
        book[k, FRESH] = 0 if near else 1
        book[k, SEEDED] = 1 if near and book[k, SEEDED] else 0
        work[k, SIZE] = size
        limit = min(1.0, 1.0 / size)
        work[k, BEFORE[0]], work[k, BEFORE[1]] = miss0, miss1
        for column in range(2):
            work[k, STEP[column]] *= limit
            work[k, X[column]] += work[k, STEP[column]]
    return last


@helper
def _settle(n, job_a, job_mu, fold, state):
    """The critical state read off a shot; returns what the rounding of the shot makes of gamma."""
    p = abs(fold[2])
    sign = 1.0 if n % 2 == 0 else -1.0
    state[0] = sqrt(p)
    state[1] = sign * fold[1] / p
    state[2] = sign * job_a / p
    state[3] = fold[3] / p
    return WAVES * EPS * _amplitude(fold, job_mu) / p


@helper
def _settle_corrected(n, job_a, job_mu, fold, v, slopes, miss0, miss1, most, state):
    """The critical state by a first-order correction, if what that leaves is below `most`.

    Returns whether it is, the offset a, and the error of gamma: what its slopes, given and exact, differ by, which is
    the second-order term.
    """
    in_excess, in_w_f = _gamma_slopes(fold, v, job_a, job_mu, n)
    left = abs((slopes[2] - in_excess) * miss1) + abs((slopes[3] - in_w_f) * miss0)
    if not CAUTION * left + miss0 * miss0 + miss1 * miss1 <= most:
        return False, job_a, 0.0
    rounding = _settle(n, job_a, job_mu, fold, state)
    return True, _correct(slopes, in_excess, in_w_f, miss0, miss1, job_a, state), left + max(most, rounding)


@kernel
def solve_folds(cables, folds, max_steps, begin, stop):
    """Critical states of the cables given, for rows begin..stop-1.

    Unknowns log a and log gamma, so that both limits of every power law are straight lines; Newton with differences
    while far, Broyden when near. A row with good slopes takes one shot and a first-order correction. All rows not yet
    done make their shots together, round after round, each of at most max_steps steps.
    """
    # Arrays one by one from here on: a tuple of them costs a microsecond a row to hand around.
    lam, w_f, n, excess = cables.lam, cables.w_f, cables.n, cables.excess
    a, gamma, slopes, states, error, statuses = (
        folds.a,
        folds.gamma,
        folds.slopes,
        folds.states,
        folds.error,
        folds.statuses,
    )
    rows = stop - begin
    work, book, jac = np.zeros((rows, WORK_COLUMNS)), np.empty((rows, BOOK_COLUMNS), np.int64), np.empty((rows, 2, 2))
    job_a, job_mu, job_end = np.empty(3 * rows), np.empty(3 * rows), np.full(3 * rows, np.inf)
    job_n = np.empty(3 * rows, np.int64)
    ends, shot_folds = np.empty((3 * rows, END_COLUMNS)), np.empty((3 * rows, 1, FOLD_COLUMNS))
    counts, outcomes = np.empty(3 * rows, np.int64), np.empty(3 * rows, np.int64)
    for k in range(rows):
        i = begin + k
        states[i, :] = np.nan
        error[i] = np.nan
        statuses[i] = _begin(lam[i], w_f[i], n[i], excess[i], a[i], gamma[i], slopes[i], work, book, k)
    for _ in range(ROUNDS):
        jobs = 0
        for k in range(rows):
            if book[k, OPEN]:
                jobs = _place_shots(w_f[begin + k], n[begin + k], work, book, k, jobs, job_a, job_mu, job_n)
        if jobs == 0:
            break
        march(job_a, job_mu, job_end, job_n, job_n, max_steps, ends, shot_folds, counts, outcomes, 0, jobs)
        for k in range(rows):
            if not book[k, OPEN]:
                continue
            i, j = begin + k, book[k, FIRST]
            if outcomes[j] != status.OK:
                statuses[i] = _step_back(lam[i], w_f[i], n[i], excess[i], outcomes[j], work, book, k)
                continue
            book[k, RETREATS_MADE] = 0
            miss0, miss1 = _residual(shot_folds[j, 0], job_mu[j], work[k, X[1]], excess[i], n[i])
            most = ROUNDINGS * work[k, ROUNDING]
            if book[k, SEEDED]:
                settled, a[i], left = _settle_corrected(
                    n[i], job_a[j], job_mu[j], shot_folds[j, 0], ends[j, 4], slopes[i], miss0, miss1, most, states[i]
                )
                if settled:
                    gamma[i], error[i], statuses[i] = states[i, 0], left, status.OK
                    book[k, OPEN] = 0
                    continue
            _update_jacobian(n[i], excess[i], slopes[i], job_mu, shot_folds, miss0, miss1, jac[k], work, book, k)
            if _next_step(jac[k], miss0, miss1, work, book, k):
                a[i] = job_a[j]
                rounding = _settle(n[i], job_a[j], job_mu[j], shot_folds[j, 0], states[i])
                gamma[i], error[i] = states[i, 0], abs(work[k, STEP[1]]) + max(most, rounding)
                statuses[i] = status.OK
                book[k, OPEN] = 0
