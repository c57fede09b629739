"""From shots to critical states: the direct solution of one fold, and its closed-form first guess."""

from math import exp, log, pi, sqrt

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.compiling import helper, inlined, kernel
from towatlas.kernels.lanes import END_COLUMNS, FOLD_COLUMNS, march
from towatlas.kernels.vacuum import tension

EPS = 2.0**-52
# Step of the finite-difference Jacobian in log a and log gamma, where rounding is all that disturbs it; where lambda
# leaves little of the excess length, the root of what it leaves.
DIFFERENCE = 1e-6
ROUNDS = 60
RETREATS = 20
MAX_STEPS = 10**7
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


@kernel
def solve_folds(n, w_f, lam, excess, a, gamma, slopes, results, error, statuses, begin, stop):
    """Critical state n[i] of the cable (lam[i], w_f[i]), for rows begin..stop-1.

    a, gamma : guess in, solution out; a row with gamma[i] <= 0 gets a guess. excess : lambda - lambda_cn.
    slopes[i] : of log a in log(excess) and in log w_f, then of log gamma, near the solution; nan where not known.
    results[i] : gamma, R_x0, x_f, z_f, lengths over the tow radius. error[i] : relative error estimate of gamma.

    Unknowns log a and log gamma, so that both limits of every power law are straight lines; Newton with differences
    while far, Broyden when near. All rows not yet done make their shots together, round after round.
    """
    rows = stop - begin
    job_a = np.empty(3 * rows)
    job_mu = np.empty(3 * rows)
    job_end = np.full(3 * rows, np.inf)
    job_n = np.empty(3 * rows, np.int64)
    ends = np.empty((3 * rows, END_COLUMNS))
    folds = np.empty((3 * rows, 1, FOLD_COLUMNS))
    counts = np.empty(3 * rows, np.int64)
    outcomes = np.empty(3 * rows, np.int64)
    first = np.zeros(rows, np.int64)
    x = np.empty((rows, 2))
    before = np.empty((rows, 2))
    step = np.zeros((rows, 2))
    size = np.full(rows, np.inf)
    jac = np.empty((rows, 2, 2))
    fresh = np.ones(rows, np.bool_)
    seeded = np.zeros(rows, np.bool_)
    active = np.zeros(rows, np.bool_)
    retreats = np.zeros(rows, np.int64)
    rounding = np.zeros(rows)
    difference = np.zeros(rows)

    for k in range(rows):
        i = begin + k
        results[i, :] = np.nan
        error[i] = np.nan
        if not (np.isfinite(lam[i]) and np.isfinite(w_f[i]) and n[i] >= 1 and w_f[i] >= 0.0):
            statuses[i] = status.BAD_INPUT
        elif not excess[i] > 0.0:
            statuses[i] = status.NO_TRANSITION
        elif ROUNDINGS * EPS * (1.0 + lam[i] / excess[i]) > WORTHLESS:
            statuses[i] = status.LOST_IN_ROUNDING
        else:
            statuses[i] = status.NOT_CONVERGED
            active[k] = True
            rounding[k] = EPS * (1.0 + lam[i] / excess[i])
            difference[k] = DIFFERENCE + sqrt(rounding[k])
            if gamma[i] > 0.0:
                x[k, 0], x[k, 1] = log(a[i]), log(gamma[i])
                determinant = _slopes_determinant(slopes[i])
                seeded[k] = np.isfinite(determinant) and determinant != 0.0
                fresh[k] = not seeded[k]
            else:
                x[k, 0], x[k, 1] = _first_guess(lam[i], w_f[i], excess[i], n[i])

    for _ in range(ROUNDS):
        jobs = 0
        for k in range(rows):
            if active[k]:
                first[k] = jobs
                for variant in range(3 if fresh[k] else 1):
                    job_a[jobs] = exp(x[k, 0] + (difference[k] if variant == 1 else 0.0))
                    job_mu[jobs] = w_f[begin + k] * exp(2.0 * (x[k, 1] + (difference[k] if variant == 2 else 0.0)))
                    job_n[jobs] = n[begin + k]
                    jobs += 1
        if jobs == 0:
            break
        march(job_a, job_mu, job_end, job_n, job_n, MAX_STEPS, ends, folds, counts, outcomes, 0, jobs)
        for k in range(rows):
            if not active[k]:
                continue
            i = begin + k
            j = first[k]
            if outcomes[j] != status.OK and seeded[k]:
                # A seed too far off: begin again without it.
                seeded[k], fresh[k] = False, True
                x[k, 0], x[k, 1] = _first_guess(lam[i], w_f[i], excess[i], n[i])
                continue
            if outcomes[j] != status.OK:
                # A step too far: go back half of it. Nothing to go back on a first guess, or after many halvings.
                if retreats[k] == RETREATS or not size[k] < np.inf:
                    # The input was sound: a shot that overflowed says that the solver lost its way.
                    statuses[i] = status.STEP_LIMIT if outcomes[j] == status.STEP_LIMIT else status.NOT_CONVERGED
                    active[k] = False
                    continue
                retreats[k] += 1
                fresh[k] = True
                for column in range(2):
                    step[k, column] *= 0.5
                    x[k, column] -= step[k, column]
                continue
            retreats[k] = 0
            fold = folds[j, 0]
            miss0, miss1 = _residual(fold, job_mu[j], x[k, 1], excess[i], n[i])
            if fresh[k]:
                for column in range(2):
                    log_gamma = x[k, 1] + (difference[k] if column == 1 else 0.0)
                    near0, near1 = _residual(
                        folds[j + 1 + column, 0], job_mu[j + 1 + column], log_gamma, excess[i], n[i]
                    )
                    jac[k, 0, column] = (near0 - miss0) / difference[k]
                    jac[k, 1, column] = (near1 - miss1) / difference[k]
            elif seeded[k]:
                _jacobian_from_slopes(slopes[i], jac[k])
                seeded[k] = False
            else:
                _broyden(jac[k], step[k], miss0, miss1, before[k])
            step[k, 0], step[k, 1] = _newton_step(jac[k], miss0, miss1)
            new_size = max(abs(step[k, 0]), abs(step[k, 1]))
            if new_size <= 8.0 * rounding[k] or (
                new_size < NOISE + 100.0 * rounding[k] and not fresh[k] and new_size > 0.5 * size[k]
            ):
                p = abs(fold[2])
                sign = 1.0 if n[i] % 2 == 0 else -1.0
                a[i] = job_a[j]
                gamma[i] = sqrt(p)
                results[i, 0] = gamma[i]
                results[i, 1] = sign * fold[1] / p
                results[i, 2] = sign * job_a[j] / p
                results[i, 3] = fold[3] / p
                error[i] = abs(step[k, 1]) + max(ROUNDINGS * rounding[k], WAVES * EPS * _amplitude(fold, job_mu[j]) / p)
                statuses[i] = status.OK
                active[k] = False
                continue
            fresh[k] = not (new_size < NEAR and (fresh[k] or new_size < 0.5 * size[k]))
            size[k] = new_size
            limit = min(1.0, 1.0 / new_size)
            before[k, 0], before[k, 1] = miss0, miss1
            for column in range(2):
                step[k, column] *= limit
                x[k, column] += step[k, column]
