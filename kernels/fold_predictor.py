"""Guesses for many folds from a few: a Chebyshev series through solved ones, and its slopes as Newton's Jacobian."""

import numpy as np

from towatlas.kernels.compiling import helper, kernel

LANES = 32


@kernel
def seed_folds(series, w_f, excess, span, w_scale, a, gamma, slopes, begin, stop):
    """Guess a, gamma and their slopes for rows begin..stop-1, all of one n.

    series[0], series[1] : Chebyshev coefficients (y degree, x degree) of log(a excess) and log(gamma sqrt(excess)) in
    x, linear in log(excess) from span[0] to span[1], and y, linear in log(1 + w_f / w_scale) from span[2] to span[3].
    """
    y_count, x_count = series.shape[1:]
    middle_x, half_x = 0.5 * (span[0] + span[1]), max(0.5 * (span[1] - span[0]), 1e-300)
    middle_y, half_y = 0.5 * (span[2] + span[3]), max(0.5 * (span[3] - span[2]), 1e-300)
    t_x, d_x = np.ones((x_count, LANES)), np.zeros((x_count, LANES))
    t_y, d_y = np.ones((y_count, LANES)), np.zeros((y_count, LANES))
    inner, inner_d = np.empty(LANES), np.empty(LANES)
    value, along_x, along_y = np.empty(LANES), np.empty(LANES), np.empty(LANES)
    log_excess = np.empty(LANES)
    for block in range(begin, stop, LANES):
        for lane in range(LANES):
            i = min(block + lane, stop - 1)
            log_excess[lane] = np.log(excess[i])
            if x_count > 1:
                t_x[1, lane], d_x[1, lane] = (log_excess[lane] - middle_x) / half_x, 1.0
            if y_count > 1:
                t_y[1, lane], d_y[1, lane] = (np.log1p(w_f[i] / w_scale) - middle_y) / half_y, 1.0
        _chebyshev(t_x, d_x)
        _chebyshev(t_y, d_y)
        for field in range(2):
            value[:], along_x[:], along_y[:] = 0.0, 0.0, 0.0
            for row in range(y_count):
                inner[:], inner_d[:] = 0.0, 0.0
                for column in range(x_count):
                    c = series[field, row, column]
                    for lane in range(LANES):
                        inner[lane] += c * t_x[column, lane]
                        inner_d[lane] += c * d_x[column, lane]
                for lane in range(LANES):
                    value[lane] += t_y[row, lane] * inner[lane]
                    along_x[lane] += t_y[row, lane] * inner_d[lane]
                    along_y[lane] += d_y[row, lane] * inner[lane]
            power = 1.0 if field == 0 else 0.5
            for lane in range(min(LANES, stop - block)):
                i = block + lane
                guess = np.exp(value[lane] - power * log_excess[lane])
                if field == 0:
                    a[i] = guess
                else:
                    gamma[i] = guess
                slopes[i, 2 * field] = along_x[lane] / half_x - power
                # log(1 + w_f / w_scale) in log w_f: no slope at w_f = 0.
                slopes[i, 2 * field + 1] = along_y[lane] / half_y * w_f[i] / (w_f[i] + w_scale)


@helper
def _chebyshev(t, d):
    """Polynomials t[k] of t[1] and their derivatives d[k], for k from 2."""
    for k in range(2, len(t)):
        for lane in range(LANES):
            t[k, lane] = 2.0 * t[1, lane] * t[k - 1, lane] - t[k - 2, lane]
            d[k, lane] = 2.0 * t[k - 1, lane] + 2.0 * t[1, lane] * d[k - 1, lane] - d[k - 2, lane]
