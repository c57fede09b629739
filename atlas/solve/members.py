"""The equilibria of cables, each found by its place in the count of zeros of q: nothing is scanned, nothing missed.

On the shots of a cable (mu, tau) the number of zeros of q = dp/da falls, as the offset a grows, from its linear limit
to zero. Each fall is an extremum of p(t_e; a), the n-th of them (from outside) with the sign (-1)^n; where it exceeds
gamma^2 the n-th fold has been passed, and a pair of equilibria with n nodes lies about it: the inner member on the
piece where the count is n, the outer one where it is n - 1. On each piece p is monotone, so whether a trial offset
is above or below the wanted one is known from its count and its p alone. Proved: docs/proofs.md, Theorem 6.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience, scaled
from towatlas.kernels import status
from towatlas.numerics.rows import EPS
from towatlas.solve.batches import batches

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# Offsets, starts and lengths of shots to their ends (tau, f, p, z, v, q), zeros of q passed, statuses.
Shoot = Callable[[Array, Array, Array], tuple[Array, Integers, Integers]]

# An offset in the linear limit, and one below every equilibrium: |p| outgrows a by no more than sqrt(1 + mu)
# (docs/proofs.md, Lemma 3), which is enough up to mu = 1e24.
LINEAR = 1e-12
# The fish is never farther out than a straight cable reaches, |x_f| <= 1 + lambda (Lemma 3); fast cables come so
# close to it that the bracket needs slack.
BEYOND = 1.01
ROUNDS = 200
# Steps of one shot: with the default patience, two seconds or three; at most.
STEPS, MOST_STEPS = 2 * 10**6, 10**7
# Steps of all shots of one call, singly and sixteen at a time: about two seconds.
STEPS_SINGLY, STEPS_IN_LANES = 10**6, 8 * 10**6
# Steps to a half wave: never fewer; of waves that do not bend the cable; more for each e-fold by which they do.
FEWEST, STRAIGHT, BENT = 2.0, 3.0, 4.0
REMEDY = "a shorter cable (lam) or a lower speed (gamma) has fewer nodes"
TINY = 1e-140
# Steps in log a: one below this is made on the results instead of by another shot, the square of it being rounding.
LAST_STEP = 1e-8
# A step this much shorter than the way to the extremum is known to the square of it, and its root is no mirage.
CLEAR = 1e-4
# Curvature is taken from two shots no farther apart than this.
CLOSE = 0.1
# From here on a parallel call pays.
PARALLEL_FROM = 512


@dataclass(frozen=True)
class Members:
    """Equilibria of cables in a vacuum, one a row; nan where status is not OK.

    Attributes
    ----------
    a : ndarray, shape (rows,)
        Offset of the fish gamma^2 |x_f| [-], > 0.
    R_x0 : ndarray, shape (rows,)
        Radial force of the cable at the tow point over (mu + rho A) g R [-].
    x_f : ndarray, shape (rows,)
        Radial position of the fish over tow radius [-].
    z_f : ndarray, shape (rows,)
        Depth of the fish over tow radius [-], 0 to lam.
    error : ndarray, shape (rows,)
        Estimated relative error of x_f [-], > 0.
    reach : ndarray, shape (rows,)
        Way in log a to the extremum of p next to the equilibrium, about [-]; nan where it is not known.
    status : ndarray of int, shape (rows,)
        Codes of `towatlas.kernels.status`.
    """

    a: Array
    R_x0: Array
    x_f: Array
    z_f: Array
    error: Array
    reach: Array
    status: Integers


def shoot_lanes(a: Array, mu: Array, tau: Array) -> tuple[Array, Integers, Integers]:
    """Many shots at once, on all threads if there are very many.

    Parameters
    ----------
    a, mu, tau : ndarray, shape (rows,)
        Offset of the fish, start of the shot and cable to pay out, lengths over g / Omega^2.

    Returns
    -------
    ndarray, shape (rows, 6)
        tau, f, p, z, v, q at the ends.
    ndarray of int, shape (rows,)
        Zeros of q passed.
    ndarray of int, shape (rows,)
        Statuses.
    """
    from towatlas.kernels.calls import FOLD_COLUMNS, march
    from towatlas.kernels.sweeps import march_parallel

    def shoot(max_steps: int, a: Array, mu: Array, tau: Array, *results: NDArray) -> None:
        rows = len(a)
        ends, counts, statuses = results
        folds, none = np.empty((rows, 1, FOLD_COLUMNS)), np.zeros(rows, np.int64)
        if rows >= PARALLEL_FROM:
            march_parallel(a, mu, tau, none, none, max_steps, ends, folds, counts, statuses)
        else:
            march(a, mu, tau, none, none, max_steps, ends, folds, counts, statuses, 0, rows)

    return _in_batches(shoot, STEPS_IN_LANES, a, mu, tau)


def shoot_singly(a: Array, mu: Array, tau: Array) -> tuple[Array, Integers, Integers]:
    """A few shots, with the kernel that is compiled soonest.

    Parameters
    ----------
    a, mu, tau : ndarray, shape (rows,)
        As of `shoot_lanes`.

    Returns
    -------
    tuple of ndarray
        As of `shoot_lanes`.
    """
    from towatlas.kernels.calls import shoot_each

    def shoot(max_steps: int, a: Array, mu: Array, tau: Array, *results: NDArray) -> None:
        shoot_each(a, mu, tau, max_steps, *results)

    return _in_batches(shoot, STEPS_SINGLY, a, mu, tau)


def _in_batches(
    shoot: Callable[..., None], steps_a_call: int, a: Array, mu: Array, tau: Array
) -> tuple[Array, Integers, Integers]:
    """Shots in calls of a few seconds each; those too long for one are not begun, and their status is STEP_LIMIT."""
    a, mu, tau = (np.ascontiguousarray(column, float) for column in (a, mu, tau))
    rows = len(a)
    ends, counts, statuses = np.full((rows, 6), np.nan), np.zeros(rows, np.int64), np.full(rows, status.STEP_LIMIT)
    max_steps = scaled(STEPS, MOST_STEPS)
    half_waves, steps = expected_work(a, mu, tau)
    short = ~(FEWEST * half_waves > max_steps)
    if not short.all():
        if short.any():
            some = _in_batches(shoot, steps_a_call, a[short], mu[short], tau[short])
            ends[short], counts[short], statuses[short] = some
        return ends, counts, statuses
    for part in batches(1.0 + np.minimum(steps, max_steps), steps_a_call):
        check_patience("shooting along the cable", REMEDY)
        shoot(max_steps, *(column[part] for column in (a, mu, tau, ends, counts, statuses)))
    return ends, counts, statuses


def expected_work(a: Array, mu: Array, tau: Array) -> tuple[Array, Array]:
    """Half waves on shots, and steps of the kernels: estimates, in closed form.

    Parameters
    ----------
    a, mu, tau : ndarray, shape (rows,)
        As of `shoot_lanes`.

    Returns
    -------
    half_waves : ndarray, shape (rows,)
        A little fewer than there are [-], >= 0; nan for bad numbers.
    steps : ndarray, shape (rows,)
        Within a factor of about two, of shots with many half waves [-], >= 0.

    Notes
    -----
    The phase of the wave is the integral of dt / sqrt(r), and the tension r <= H + tau with H = r + p^2 / 2 at the
    fish. The more H exceeds the weight, the narrower the layers in which the tension falls to it.
    """
    with np.errstate(all="ignore"):
        bent = mu * a * (a / (1.0 + np.hypot(1.0, a))) + 0.5 * a * a
        half_waves = 2.0 / np.pi * tau / (np.sqrt(mu + bent + tau) + np.sqrt(mu + bent))
        return half_waves, half_waves * (STRAIGHT + BENT * np.log1p(8.0 * bent / tau))


def extrema(*, lam: Array, w_f: Array, gamma: Array, shoot: Shoot) -> tuple[Integers, Integers]:
    """Number of extrema of p(t_e; a), which bounds that of the folds passed.

    Parameters
    ----------
    lam, w_f, gamma : ndarray, shape (rows,)
        Cable length, fish weight and speed [-].
    shoot : callable
        `shoot_lanes` or `shoot_singly`.

    Returns
    -------
    ndarray of int, shape (rows,)
        The numbers.
    ndarray of int, shape (rows,)
        Statuses.
    """
    gamma2 = gamma * gamma
    _, counts, statuses = shoot(LINEAR * np.minimum(1.0, gamma2), gamma2 * w_f, gamma2 * lam)
    return counts, statuses


def solve_members(
    *,
    lam: Array,
    w_f: Array,
    gamma: Array,
    n: Integers,
    outer: NDArray[np.bool_],
    shoot: Shoot,
    guess: Array | None = None,
    reach: Array | None = None,
) -> Members:
    """The inner or outer member of the n-th pair of equilibria of each row's cable; n = 0 is the one without nodes.

    Parameters
    ----------
    lam, w_f, gamma : ndarray, shape (rows,)
    n : ndarray of int, shape (rows,)
    outer : ndarray of bool, shape (rows,)
        Which member; False for n = 0.
    shoot : callable
    guess : ndarray, shape (rows,), optional
        Offsets a to start from, nan where there is none. A bad one costs time only.
    reach : ndarray, shape (rows,), optional
        That of a slightly slower cable, nan where it is not known. Twice the true one is enough to be safe; with it a
        good guess takes one shot.

    Returns
    -------
    Members
        status NOT_FOUND, and nan, where the n-th fold has not been passed.
    """
    rows = len(n)
    gamma2 = gamma * gamma
    mu, tau = gamma2 * w_f, gamma2 * lam
    sign = np.where(n % 2 == 0, 1.0, -1.0)
    side = np.where(outer, -1.0, 1.0)  # slope of sign p at the root
    piece = n - outer
    low, high = np.log(LINEAR * np.minimum(1.0, gamma2)), np.log(BEYOND * gamma2 * (1.0 + lam))
    x = 0.5 * (low + high)
    if guess is not None:
        with np.errstate(invalid="ignore", divide="ignore"):
            start = np.log(guess)
        x = np.where((start > low) & (start < high), start, x)
    # Of the shots at the two ends of each bracket: zeros of q, slope, miss.
    low_end, high_end = np.full((3, rows), np.nan), np.full((3, rows), np.nan)
    x_old, slope_old, step_old = (np.full(rows, np.nan) for _ in range(3))
    reached = np.full(rows, np.nan)
    results = np.full((rows, 5), np.nan)
    # Products this small have lost digits to underflow, or will have.
    tiny = np.minimum(gamma2, tau) < TINY
    codes = np.where(tiny, status.BAD_INPUT, status.NOT_CONVERGED)
    i = np.flatnonzero(~tiny)
    for round_ in range(ROUNDS):
        if not len(i):
            break
        check_patience("searching for equilibria", REMEDY, done=rows - len(i), of=rows)
        a = np.exp(x[i])
        ends, counts, statuses = shoot(a, mu[i], tau[i])
        p, q = ends[:, 2], ends[:, 5]
        miss, slope = sign[i] * p / gamma2[i] - 1.0, sign[i] * a * q / gamma2[i]
        here = counts == piece[i]
        above = (counts < piece[i]) | (here & ((miss >= 0.0) != outer[i]))
        for bound, end, moved in ((high, high_end, above), (low, low_end, ~above)):
            bound[i[moved]] = x[i[moved]]
            end[:, i[moved]] = np.stack([counts, slope, miss])[:, moved]
        width = high[i] - low[i]
        with np.errstate(all="ignore"):
            peak, top = _tangents(n[i], low[i], low_end[:, i], high[i], high_end[:, i])
            beside = (counts == n[i]) | (counts == n[i] - 1)
            step, way = _step(x[i], slope, miss, side[i], here, beside, x_old[i], slope_old[i])
            if round_ == 0 and reach is not None:
                way = 0.5 * reach[i]
            reached[i] = way
            narrow = width <= 4.0 * EPS * np.maximum(1.0, np.abs(x[i]))
            failed = statuses != status.OK
            small = here & (np.abs(step) <= LAST_STEP)
            # Two ends on one piece hold the root. Then a step that no longer shrinks is rounding.
            held = high_end[0, i] == low_end[0, i]
            noise = held & (np.abs(step) >= 0.5 * np.abs(step_old[i]))
            landed = small & ((np.abs(step) <= CLEAR * way) | noise) & ~failed
            held &= narrow & ~landed & ~failed
            absent = ((top < 0.0) & (width * (1 + n[i]) < CLOSE) | narrow) & ~landed & ~held & ~failed
            trial = np.where(np.isfinite(step), x[i] + step, peak)
            astray = ~((trial > low[i]) & (trial < high[i])) | (round_ % 8 == 7)
        x_old[i], slope_old[i], step_old[i] = x[i], slope, step
        codes[i[failed]] = statuses[failed]
        codes[i[absent]] = status.NOT_FOUND
        found = landed | held
        if found.any():
            k = i[found]
            shift = np.where(landed, step, 0.0)[found]
            codes[k] = status.OK
            results[k] = _finish(a[found], shift, ends[found], counts[found], mu[k], gamma2[k], sign[k], slope[found])
        x[i] = np.where(astray, 0.5 * (low[i] + high[i]), trial)
        i = i[~(found | absent | failed)]
    # A fish deeper than the cable is long is arithmetic that gave out, too.
    with np.errstate(invalid="ignore"):
        sound = np.isfinite(results).all(axis=1) & (results[:, 3] <= 1.001 * lam)
    overflowed = (codes == status.OK) & ~sound
    codes[overflowed] = status.BAD_INPUT
    results[overflowed] = np.nan
    a, r_x0, x_f, z_f, error = results.T
    return Members(a, r_x0, x_f, z_f, error, reached, codes)


def _tangents(n: Integers, low: Array, low_end: Array, high: Array, high_end: Array) -> tuple[Array, Array]:
    """Where the tangents at two shots astride the n-th extremum meet, and a bound of its height.

    The bound is the height of that point and a tenth of the way up to it, for the flanks of the peaks of fast cables
    are a little convex.
    """
    astride = (low_end[0] == n) & (high_end[0] == n - 1)
    fall = low_end[1] - high_end[1]
    share = (high_end[2] - low_end[2] - high_end[1] * (high - low)) / fall
    share = np.where(astride & (fall > 0.0), share, np.nan)
    top = low_end[2] + low_end[1] * share
    return low + share, top + 0.1 * (top - np.minimum(low_end[2], high_end[2]))


def _step(
    x: Array,
    slope: Array,
    miss: Array,
    side: Array,
    here: NDArray[np.bool_],
    beside: NDArray[np.bool_],
    x_old: Array,
    slope_old: Array,
) -> tuple[Array, Array]:
    """Step in log a to the root with the wanted sign of the slope, and the way to the extremum; nan where not known.

    From slope and curvature, which near a fold tell on which side of the extremum a shot lies and how far, where
    Newton's method knows nothing. `here`: on the piece that holds the root; `beside`: on either side of the n-th
    extremum.
    """
    apart = x - x_old
    curvature = (slope - slope_old) / apart
    discriminant = slope * slope - 2.0 * curvature * miss
    root = side * np.sqrt(discriminant)
    # Of the two forms of the quadratic's root the one without cancellation.
    quadratic = np.where(slope * side >= 0.0, -2.0 * miss / (slope + root), (root - slope) / curvature)
    trusted = beside & (np.abs(apart) < CLOSE) & np.isfinite(quadratic)
    newton = np.where(here & (slope * side > 0.0), -miss / slope, np.nan)
    return np.where(trusted, quadratic, newton), np.where(trusted, np.abs(slope / curvature), np.nan)


def _finish(
    a: Array,
    shift: Array,
    ends: Array,
    counts: Integers,
    mu: Array,
    gamma2: Array,
    sign: Array,
    slope: Array,
) -> Array:
    """R_x0, x_f, z_f at a(1 + shift), to first order in the shift."""
    tau, f, p, z, v, q = ends.T
    t = mu + tau
    # z = H(end) - H(start) with H = r + p^2 / 2.
    terms = np.stack([f * v / np.hypot(t, f), p * q, -mu * a / np.hypot(1.0, a), -a])
    # Under a heavy fish, and on a short fast cable, their sum is rounding. Little changes then along the cable, and
    # the integral of dz/dt has hardly more than its ends.
    noisy = EPS * a * np.abs(terms).sum(axis=0) > 0.1 * tau
    ends_only = -0.5 * tau * (a / (1.0 + a * a) ** 1.5 + (f / t) * (v / t) / (1.0 + (f / t) ** 2) ** 1.5)
    z_slope = np.where(noisy, ends_only, terms.sum(axis=0))
    da = a * shift
    scale = sign / gamma2
    # What rounding of p, of the local amplitude of the wave, moves the root.
    amplitude = np.hypot(p, f / np.sqrt(np.hypot(t, f)))
    rounding = 4.0 * EPS * (1.0 + counts) * amplitude / gamma2 / np.abs(slope)
    error = np.maximum(rounding, EPS) + shift * shift
    return np.stack([a + da, scale * (f + v * da), scale * (a + da), (z + z_slope * da) / gamma2, error], axis=1)
