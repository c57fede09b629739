"""Skop's own method: forward shots over the bounds of Eq. (35), roots by sign change, tangencies by a new pair.

Lengths over the tow radius; reactions are handled as u = R_x0 / gamma^2, which stays of order lambda^2.
"""

from math import sqrt

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.compiling import helper, inlined, kernel
from towatlas.kernels.steppers import DS, FISH, FORCE, FORWARD_WORK, GAMMA2, X, rk4_forward
from towatlas.kernels.steppers import FORWARD_LANES as LANES
from towatlas.kernels.vacuum import boundary_error

ZOOM_GUESSES = 32  # shots across the window in which an extremum of E is looked for
ZOOMS = 5  # each narrows the window by about 15
SECANTS = 60
# Relative change of a speed when the segments are doubled, beyond which it is no longer their truncation error.
TRUSTED = 1e-3


@kernel
def forward_shots(lam, w_f, gamma, r_x0, segments, errors, x_end, r_x_end, begin, stop):
    """Forward Runge-Kutta shots begin..stop-1 from the tow point; arrays of one entry a shot.

    errors[i] : E(lambda) of Eq. (33). x_end[i], r_x_end[i] : x and R_x at the fish.
    """
    work = np.empty(FORWARD_WORK)
    for block in range(begin, stop, LANES):
        for lane in range(LANES):
            i = min(block + lane, stop - 1)
            work[X + lane] = 1.0
            work[FORCE + lane] = r_x0[i]
            work[GAMMA2 + lane] = gamma[i] * gamma[i]
            work[DS + lane] = lam[i] / segments
            work[FISH + lane] = w_f[i]
        for segment in range(segments):
            rk4_forward(work, float(segments - segment))
        for lane in range(min(LANES, stop - block)):
            i = block + lane
            x, force = work[X + lane], work[FORCE + lane]
            errors[i] = boundary_error(x, force, work[FISH + lane], work[GAMMA2 + lane])
            x_end[i] = x
            r_x_end[i] = force


@inlined
def reaction_bounds(lam, w_f):
    """Lower and upper bound of R_x0 / gamma^2, Eq. (35)."""
    return -(0.5 * lam * lam + lam * (w_f - 1.0) - w_f), 0.5 * lam * lam + lam * (w_f + 1.0) + w_f


@helper
def solution_curve(lam, w_f, gamma, low, high, segments, errors):
    """E / gamma^2 at len(errors) values of u = R_x0 / gamma^2 spaced evenly from low to high, both included."""
    guesses = len(errors)
    gamma2 = gamma * gamma
    work = np.empty(FORWARD_WORK)
    work[FISH : FISH + LANES] = w_f
    work[GAMMA2 : GAMMA2 + LANES] = gamma2
    work[DS : DS + LANES] = lam / segments
    for block in range(0, guesses, LANES):
        for lane in range(LANES):
            work[X + lane] = 1.0
            work[FORCE + lane] = gamma2 * (low + (high - low) * min(block + lane, guesses - 1) / (guesses - 1))
        for segment in range(segments):
            rk4_forward(work, float(segments - segment))
        for lane in range(min(LANES, guesses - block)):
            errors[block + lane] = boundary_error(work[X + lane], work[FORCE + lane], w_f, gamma2) / gamma2


@inlined
def _sign_changes(errors, places):
    """Number of sign changes along the curve; the index before each is written to places as far as it reaches."""
    found = 0
    for k in range(len(errors) - 1):
        if (errors[k] > 0.0) != (errors[k + 1] > 0.0):
            if found < len(places):
                places[found] = k
            found += 1
    return found


@helper
def _extremum(lam, w_f, gamma, n, middle, half_width, segments, errors):
    """Largest (-1)^(n-1) E / gamma^2 near u = middle, the u where it is reached, and the final spacing in u."""
    sign = 1.0 if n % 2 == 1 else -1.0
    half = half_width
    spacing = half
    best = -np.inf
    for zoom in range(ZOOMS):
        for _ in range(30):
            solution_curve(lam, w_f, gamma, middle - half, middle + half, segments, errors)
            top = 0
            for k in range(1, len(errors)):
                if sign * errors[k] > sign * errors[top]:
                    top = k
            best = sign * errors[top]
            spacing = 2.0 * half / (len(errors) - 1)
            middle = middle - half + top * spacing
            if zoom > 0 or 0 < top < len(errors) - 1:
                break
        half = spacing
    return best, middle, spacing


@helper
def _tangency(lam, w_f, n, gamma_low, gamma_high, middle, half_width, segments, tolerance, errors):
    """Speed at which the n-th pair of roots of E appears, between gamma_low (no pair) and gamma_high (pair).

    Returns gamma, u, width of the final bracket in gamma, spacing in u; nan where there is no such pair. gamma_low is
    lowered where the pair is there already, closer than the scan could see.
    """
    high, u_high, spacing = _extremum(lam, w_f, gamma_high, n, middle, half_width, segments, errors)
    low, u_low, spacing = _extremum(lam, w_f, gamma_low, n, middle, half_width, segments, errors)
    for _ in range(60):
        if low <= 0.0:
            break
        gamma_high, high, u_high = gamma_low, low, u_low
        gamma_low *= 0.98
        low, u_low, spacing = _extremum(lam, w_f, gamma_low, n, u_high, half_width, segments, errors)
    if not (low <= 0.0 < high):
        return np.nan, np.nan, np.nan, np.nan
    for k in range(SECANTS):
        if gamma_high - gamma_low <= tolerance * gamma_high:
            break
        share = 0.5 if k % 3 == 2 else high / (high - low)
        trial = gamma_high - share * (gamma_high - gamma_low)
        margin = 0.3 * tolerance * gamma_high
        trial = min(max(trial, gamma_low + margin), gamma_high - margin)
        best, u, spacing = _extremum(lam, w_f, trial, n, u_high, half_width, segments, errors)
        if best > 0.0:
            gamma_high, high, u_high = trial, best, u
        else:
            gamma_low, low = trial, best
    return 0.5 * (gamma_low + gamma_high), u_high, gamma_high - gamma_low, spacing


@helper
def _truncation(coarser, coarse, fine):
    """Bound on the truncation error of `fine` from two doublings of the segments.

    Where the error falls as their fourth power both terms are thirty times it; two, because where it does not yet the
    last change alone can be small by accident. nan, of a doubling that found nothing, leaves the other.
    """
    first = abs(coarse - coarser)
    return 2.0 * abs(fine - coarse) + (0.125 * first if first >= 0.0 else 0.0)


@helper
def _count_pairs(lam, w_f, gamma, low, high, segments, errors, places):
    solution_curve(lam, w_f, gamma, low, high, segments, errors)
    return (_sign_changes(errors, places) - 1) // 2


@helper
def _narrow(lam, w_f, n, below, above, low, high, segments, errors, places):
    """Bisect the speeds until the n-th pair alone has appeared at the upper one and both are close together."""
    for _ in range(30):
        if _count_pairs(lam, w_f, above, low, high, segments, errors, places) == n and above < 1.001 * below:
            break
        trial = sqrt(below * above)
        if _count_pairs(lam, w_f, trial, low, high, segments, errors, places) >= n:
            above = trial
        else:
            below = trial
    return below, above


@helper
def _window(lam, w_f, gamma, n, low, high, segments, errors, places):
    """Middle and half width in u of a window that holds the n-th pair of roots and no other root."""
    _count_pairs(lam, w_f, gamma, low, high, segments, errors, places)
    spacing = (high - low) / (len(errors) - 1)
    left = places[n - 1] - 2 if n == 1 else max(places[n - 2], places[n - 1] - 2)
    right = min(places[n + 1], places[n] + 2) + 1
    sign = n % 2 == 1
    low, high = low + left * spacing, low + right * spacing
    # Of a pair too close to be seen with this many guesses, the window that must hold it.
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    for _ in range(ZOOMS):
        # Between the pair (-1)^(n-1) E is positive; a run of that sign that touches an end belongs to a neighbour.
        solution_curve(lam, w_f, gamma, low, high, segments, errors)
        spacing = (high - low) / (len(errors) - 1)
        changes = _sign_changes(errors, places)
        first = 0 if (errors[0] > 0.0) != sign else 1
        if changes < first + 2:
            break
        start, end = places[first], places[first + 1]
        before = places[first - 1] if first > 0 else -1
        after = places[first + 2] if changes > first + 2 else len(errors)
        room = min(start - before, after - end)
        middle = low + spacing * (0.5 * (start + end) + 0.5)
        half = spacing * (0.5 * (end - start) + min(0.5 * room, 1.0 + end - start))
        if room >= 8 and end - start >= 4:
            return middle, half
        low, high = low + spacing * (start - min(room, 2)), low + spacing * (end + 1 + min(room, 2))
    return middle, half


@kernel
def scan_system(lam, w_f, gamma_low, gamma_high, speeds, guesses, segments, n_max, tolerance, results, statuses):
    """Critical states 1..n_max of one cable by scanning speeds from gamma_low to gamma_high.

    results[n-1] : gamma, R_x0, resolution of gamma, resolution of R_x0. Both resolutions are absolute and hold the
    final bracket, the spacing of the guesses, and what two doublings of the segments say of the truncation error.
    statuses[n-1] : OK, NOT_FOUND (none up to gamma_high) or NOT_CONVERGED.
    """
    for n in range(n_max):
        statuses[n] = status.NOT_FOUND
        for column in range(4):
            results[n, column] = np.nan
    low, high = reaction_bounds(lam, w_f)
    errors = np.empty(guesses)
    zoom = np.empty(ZOOM_GUESSES)
    places = np.zeros(2 * n_max + 2, np.int64)
    gamma_before = gamma_low
    previous = 0.0
    found = 0
    ratio = (gamma_high / gamma_low) ** (1.0 / (speeds - 1))
    for k in range(speeds):
        gamma = gamma_low * ratio**k
        pairs = _count_pairs(lam, w_f, gamma, low, high, segments, errors, places)
        while found < min(pairs, n_max):
            n = found + 1
            below, above = _narrow(lam, w_f, n, gamma_before, gamma, low, high, segments, errors, places)
            middle, half = _window(lam, w_f, above, n, low, high, segments, errors, places)
            coarser, u_coarser, _, _ = _tangency(
                lam, w_f, n, below, above, middle, half, segments // 2, tolerance, zoom
            )
            coarse, u_coarse, _, _ = _tangency(lam, w_f, n, below, above, middle, half, segments, tolerance, zoom)
            fine, u_fine, width, step = _tangency(
                lam, w_f, n, below, above, middle, half, 2 * segments, tolerance, zoom
            )
            # Another pair caught in the window gives an earlier speed again; a truncation error this large, anything.
            sound = fine > previous and abs(fine - coarse) <= TRUSTED * fine
            statuses[n - 1] = status.OK if sound else status.NOT_CONVERGED
            if sound:
                results[n - 1, 0] = fine
                results[n - 1, 1] = u_fine * fine * fine
                results[n - 1, 2] = width + _truncation(coarser, coarse, fine)
                r_x0 = u_coarser * coarser * coarser, u_coarse * coarse * coarse, u_fine * fine * fine
                results[n - 1, 3] = step * fine * fine + _truncation(*r_x0)
                gamma_before = fine
                previous = fine
            found = n
        if found == n_max:
            break
        gamma_before = gamma
