"""Shots from the fish up one at a time: compiled in a tenth of the time of the lanes, for who asks about one cable.

The Taylor step of kernels.steppers in loops. All coefficients of a step are at hand, so the end of the cable is a
root of a polynomial inside the last step.
"""

from math import exp, log, sqrt

import numpy as np

from kernels import status
from kernels.compiling import helper, kernel
from kernels.steppers import ORDER, TRUNCATION
from kernels.vacuum import start, tension

P, H, R, Q, HQ, G = range(6)
EPS = 2.0**-52


@helper
def _expand(c, t, f, p, v, q):
    """Taylor coefficients in sigma of p, H, r and their variations q, h, g, into c[quantity, order]."""
    r = tension(t, f)
    c[P, 0], c[P, 1] = p, -f
    c[Q, 0], c[Q, 1] = q, -v
    c[H, 1] = t
    c[HQ, 1] = 0.0
    c[R, 0], c[R, 1] = r, t + f * p
    c[G, 0], c[G, 1] = f * v / r, v * p + f * q
    for k in range(2, ORDER + 1):
        pr = qr = pg = pp = pq = 0.0
        for j in range(k - 1):
            pr += c[P, j] * c[R, k - 2 - j]
            qr += c[Q, j] * c[R, k - 2 - j]
            pg += c[P, j] * c[G, k - 2 - j]
        share = 1.0 / (k * (k - 1))
        c[P, k] = -share * pr
        c[Q, k] = -share * (qr + pg)
        c[H, k] = share * c[R, k - 2]
        c[HQ, k] = share * c[G, k - 2]
        for j in range(k + 1):
            pp += c[P, j] * c[P, k - j]
            pq += c[P, j] * c[Q, k - j]
        c[R, k] = c[H, k] - 0.5 * pp
        c[G, k] = c[HQ, k] - pq


@helper
def _length(c, t, f, p, v, q):
    """Step at which the last two terms reach the truncation bound, relative to the local amplitudes."""
    r = c[R, 0]
    amplitude = sqrt(p * p + f * f / r)
    amplitude_q = sqrt(q * q + v * v / r)
    h = np.inf
    for k in (ORDER - 1, ORDER):
        size = max(
            max(abs(c[P, k]) / amplitude, abs(c[H, k]) / r),
            max(abs(c[Q, k]) / amplitude_q, abs(c[HQ, k]) * amplitude / (amplitude_q * r)),
        )
        h = min(h, exp(log(TRUNCATION / size) / k))
    return h


@helper
def _value(c, quantity, first, h):
    total = c[quantity, ORDER]
    for k in range(ORDER - 1, first - 1, -1):
        total = total * h + c[quantity, k]
    return total


@helper
def _slope(c, quantity, first, h):
    total = ORDER * c[quantity, ORDER]
    for k in range(ORDER - 1, first - 1, -1):
        total = total * h + k * c[quantity, k]
    return total


@helper
def _landing(c, remaining, h):
    """Step within h that pays out the remaining cable, by Newton inside a bracket."""
    low, high = 0.0, h
    s = 0.5 * h
    for _ in range(100):
        miss = s * _slope(c, H, 2, s) - remaining
        if miss > 0.0:
            high = s
        else:
            low = s
        # dt/d(sigma) = r = H - p^2 / 2 by its own series.
        trial = s - miss / _value(c, R, 0, s)
        if not (low < trial < high):
            trial = 0.5 * (low + high)
        if abs(trial - s) <= 2.0 * EPS * s:
            return trial
        s = trial
    return s


@helper
def _shoot(a, mu, tau_end, max_steps, c, end):
    """One shot; `end` gets tau, f, p, z, v, q. Returns the zeros of q passed and a status."""
    tau, f, p, z, v, q, ended = start(a, mu, tau_end)
    low = 0.0
    count = steps = 0
    outcome = status.OK
    while not ended:
        if steps == max_steps:
            outcome = status.STEP_LIMIT
            break
        steps += 1
        t = mu + (tau + low)
        _expand(c, t, f, p, v, q)
        h = _length(c, t, f, p, v, q)
        remaining = (tau_end - tau) - low
        # As h * slope may overflow where the cable ends long before the step does, ask in this order.
        if not h * _slope(c, H, 2, h) < remaining:
            h = _landing(c, remaining, h)
            ended = True
        while True:
            dt = h * _slope(c, H, 2, h)
            p_new = _value(c, P, 0, h)
            f_new = -_slope(c, P, 1, h)
            # The variation at fixed sigma, less the shift in t that it carries: at fixed t.
            shift = h * _slope(c, HQ, 2, h)
            v_new = -_slope(c, Q, 1, h) - p_new * shift
            q_new = _value(c, Q, 0, h) + f_new / tension(t + dt, f_new) * shift
            crossing = (q < 0.0) != (q_new < 0.0)
            # dv/dt = q: v moved against the sign of q, so two zeros of q hide in this step.
            if crossing or not (v * v_new < 0.0 and (v_new - v) * q < 0.0):
                break
            h *= 0.5
            ended = False
        z += h * _value(c, H, 1, h)
        add = dt + low
        total = tau + add
        part = total - tau
        low = (tau - (total - part)) + (add - part)
        tau, f, p, v, q = total, f_new, p_new, v_new, q_new
        count += crossing
        if not (np.isfinite(p) and np.isfinite(q) and np.isfinite(tau)):
            outcome = status.BAD_INPUT
            break
    if ended:
        tau, low = tau_end, 0.0
        if not (np.isfinite(p) and np.isfinite(q)):
            outcome = status.BAD_INPUT
    end[0], end[1], end[2], end[3], end[4], end[5] = tau + low, f, p, z, v, q
    return count, outcome


@kernel
def shoot_each(a, mu, tau_end, max_steps, ends, counts, statuses):
    """Shots of offsets a[i] at t = mu[i] over tau_end[i] of cable, one after the other; results as of `march`."""
    c = np.zeros((6, ORDER + 1))
    for i in range(len(a)):
        if a[i] != 0.0 and np.isfinite(a[i]) and np.isfinite(mu[i]) and mu[i] >= 0.0 and 0.0 <= tau_end[i] < np.inf:
            counts[i], statuses[i] = _shoot(a[i], mu[i], tau_end[i], max_steps, c, ends[i])
        else:
            ends[i, :] = np.nan
            counts[i], statuses[i] = 0, status.BAD_INPUT
