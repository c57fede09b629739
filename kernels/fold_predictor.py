"""Guesses for many folds from a table of them: short Chebyshev series on patches, and their slopes.

The slopes are Newton's Jacobian, and the first-order correction of what one shot from the guess finds.
"""

from math import exp, log, log1p

import numpy as np

from towatlas.kernels.calls import FIELDS, NODES
from towatlas.kernels.compiling import inlined, kernel
from towatlas.kernels.vector import aligned, load, store


@inlined
def _patch_of(u, count):
    """Which of `count` equal patches of [-1, 1] holds u, and where in it, from -1 to 1."""
    place = 0.5 * (u + 1.0) * count
    patch = min(max(int(place), 0), count - 1)
    return patch, 2.0 * (place - patch) - 1.0


@kernel
def seed_folds(patches, w_f, excess, span, w_scale, a, gamma, slopes, begin, stop):
    """Guess a, gamma and their slopes for rows begin..stop-1, all of one n.

    patches : shape (y patches, x patches, FIELDS, NODES, NODES), at an address divisible by 64: Chebyshev coefficients
    (x degree, y degree) on equal parts of x, linear in log(excess) from span[0] to span[1], and of y, linear in
    log(1 + w_f / w_scale) from span[2] to span[3]. slopes : shape (rows, SLOPES).
    """
    y_count, x_count = patches.shape[0], patches.shape[1]
    flat = patches.reshape(patches.size)
    middle_x, half_x = 0.5 * (span[0] + span[1]), 0.5 * (span[1] - span[0])
    middle_y, half_y = 0.5 * (span[2] + span[3]), 0.5 * (span[3] - span[2])
    t, d = np.ones(NODES), np.zeros(NODES)
    along = aligned(2)
    values = np.empty(FIELDS)
    for i in range(begin, stop):
        log_excess = log(excess[i])
        column, x = _patch_of((log_excess - middle_x) / half_x, x_count)
        row, y = _patch_of((log1p(w_f[i] / w_scale) - middle_y) / half_y, y_count)
        # log(1 + w_f / w_scale) in log w_f: no slope at w_f = 0.
        scale_x, scale_y = x_count / half_x, y_count / half_y * w_f[i] / (w_f[i] + w_scale)
        t[1], d[1] = y, 1.0
        for k in range(2, NODES):
            t[k] = 2.0 * y * t[k - 1] - t[k - 2]
            d[k] = 2.0 * t[k - 1] + 2.0 * y * d[k - 1] - d[k - 2]
        for field in range(FIELDS):
            place = ((row * x_count + column) * FIELDS + field) * NODES
            slope = load(flat, place + 1)
            value = load(flat, place) + slope * x
            before, here, d_before, d_here = 1.0, x, 0.0, 1.0
            for k in range(2, NODES):
                before, here = here, 2.0 * x * here - before
                d_before, d_here = d_here, 2.0 * before + 2.0 * x * d_here - d_before
                coefficients = load(flat, place + k)
                value = value + coefficients * here
                slope = slope + coefficients * d_here
            store(along, 0, value)
            store(along, 1, slope)
            total, total_x, total_y = 0.0, 0.0, 0.0
            for k in range(NODES):
                total += t[k] * along[k]
                total_x += t[k] * along[NODES + k]
                total_y += d[k] * along[k]
            values[field] = total
            slopes[i, 2 * field], slopes[i, 2 * field + 1] = scale_x * total_x, scale_y * total_y
        slopes[i, 0] -= 1.0
        slopes[i, 2] -= 0.5
        a[i], gamma[i] = exp(values[0] - log_excess), exp(values[1] - 0.5 * log_excess)
