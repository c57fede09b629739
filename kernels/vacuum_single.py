"""The vacuum equations as jets: shots from the fish up, one at a time, with zeros of q = dp/da counted.

The equations of towatlas.kernels.steppers in loops, on the march of towatlas.kernels.series.
"""

from math import sqrt

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.calls import ORDER
from towatlas.kernels.compiling import helper, kernel
from towatlas.kernels.series import FIRST, T, U, march_of, reach
from towatlas.kernels.vacuum import start, tension

F, P, Z = range(FIRST, FIRST + 3)
STATE = 5
# Monomials 1 and da; products (factor, factor, result).
SLOPE = np.array([[0, 0, 0], [1, 0, 1], [0, 1, 1]])


@helper
def _expand(c, paid, mu, jets):
    """Taylor coefficients in sigma of t' = r, p' = -f, z' = t, f' = p r, r = z + const - p^2 / 2."""
    t = mu + paid
    c[T, 0, 0] = tension(t, c[F, 0, 0])
    c[T, 1, 0] = c[F, 0, 0] * c[F, 1, 0] / c[T, 0, 0]
    for k in range(ORDER):
        share = 1.0 / (k + 1)
        for n in range(2):
            c[U, n, k + 1] = share * c[T, n, k]
            c[P, n, k + 1] = -share * c[F, n, k]
            c[Z, n, k + 1] = share * c[U, n, k]
        if k == 0:
            c[Z, 0, 1] = t
        # All sums side by side: each is a chain of dependent additions.
        pr = qr = pg = pp = pq = 0.0
        for j in range(k + 1):
            p, q = c[P, 0, j], c[P, 1, j]
            pr += p * c[T, 0, k - j]
            qr += q * c[T, 0, k - j]
            pg += p * c[T, 1, k - j]
            pp += p * c[P, 0, k + 1 - j]
            pq += p * c[P, 1, k + 1 - j]
        pp += c[P, 0, k + 1] * c[P, 0, 0]
        pq += c[P, 0, k + 1] * c[P, 1, 0]
        c[F, 0, k + 1] = share * pr
        c[F, 1, k + 1] = share * (qr + pg)
        c[T, 0, k + 1] = c[Z, 0, k + 1] - 0.5 * pp
        c[T, 1, k + 1] = c[Z, 1, k + 1] - pq


@helper
def _length(c):
    """Step at which the last two terms reach the truncation bound, relative to the local amplitudes."""
    f, p, v, q, r = c[F, 0, 0], c[P, 0, 0], c[F, 1, 0], c[P, 1, 0], c[T, 0, 0]
    amplitude = sqrt(p * p + f * f / r)
    amplitude_q = sqrt(q * q + v * v / r)
    h = np.inf
    for k in (ORDER - 1, ORDER):
        size = max(
            max(abs(c[P, 0, k]) / amplitude, abs(c[Z, 0, k]) / r),
            max(abs(c[P, 1, k]) / amplitude_q, abs(c[Z, 1, k]) * amplitude / (amplitude_q * r)),
        )
        h = min(h, reach(size, k))
    return h


@helper
def _crossings(c, new, h):
    q, q_new, v, v_new = c[P, 1, 0], new[P, 1], c[F, 1, 0], new[F, 1]
    if (q < 0.0) != (q_new < 0.0):
        return 1
    # dv/dt = q: v moved against the sign of q, so two zeros of q hide in this step.
    return -1 if v * v_new < 0.0 and (v_new - v) * q < 0.0 else 0


_march = march_of(_expand, _length, _crossings)


@kernel
def shoot_each(a, mu, tau_end, max_steps, ends, counts, statuses):
    """Shots of offsets a[i] at t = mu[i] over tau_end[i] of cable, one after the other; results as of `march`."""
    c = np.zeros((STATE, 2, ORDER + 1))
    new = np.zeros((STATE, 2))
    jets = SLOPE
    for i in range(len(a)):
        if not (
            a[i] != 0.0 and np.isfinite(a[i]) and np.isfinite(mu[i]) and mu[i] >= 0.0 and 0.0 <= tau_end[i] < np.inf
        ):
            ends[i, :] = np.nan
            counts[i], statuses[i] = 0, status.BAD_INPUT
            continue
        tau, c[F, 0, 0], c[P, 0, 0], c[Z, 0, 0], c[F, 1, 0], c[P, 1, 0], ended = start(a[i], mu[i], tau_end[i])
        c[Z, 1, 0] = 0.0
        counts[i], statuses[i] = 0, status.OK
        if not ended:
            end = np.array([tau_end[i], 0.0])
            counts[i], _, statuses[i] = _march(c, new, mu[i], jets, 1, tau, 0.0, end, max_steps)
        elif not (np.isfinite(c[P, 0, 0]) and np.isfinite(c[P, 1, 0])):
            statuses[i] = status.BAD_INPUT
        ends[i, 0] = tau_end[i]
        ends[i, 1], ends[i, 2], ends[i, 3] = c[F, 0, 0], c[P, 0, 0], c[Z, 0, 0]
        ends[i, 4], ends[i, 5] = c[F, 1, 0], c[P, 1, 0]
