"""Shots in mpmath at 45 digits, in t itself: Taylor series of roots and powers. Shares nothing with the proofs.

f'' = -f (t^2 + f^2)^(-1/2), v'' = -t^2 v (t^2 + f^2)^(-3/2); at a bare tip u = f / t and v / t.
"""

import mpmath as mp

DIGITS, ORDER = 45, 50


def _power(w, alpha, y, k):
    """Coefficient k of w^alpha, from those before."""
    if k == 0:
        return mp.power(w[0], alpha)
    return mp.fsum((alpha * j - (k - j)) * w[j] * y[k - j] for j in range(1, k + 1)) / (k * w[0])


def _product(x, y, k):
    return mp.fsum(x[j] * y[k - j] for j in range(k + 1))


def _horner(x, h):
    total = mp.mpf(0)
    for c in reversed(x):
        total = total * h + c
    return total


def _step(t, f, p, v, q, room):
    """One step in t, no longer than `room`."""
    f, v = [f, p], [v, q]
    w, root, cube, square = [], [], [], [t * t, 2 * t, mp.mpf(1)]
    bent = []
    for k in range(ORDER):
        w.append(_product(f, f, k) + (square[k] if k < 3 else 0))
        root.append(_power(w, mp.mpf(-1) / 2, root, k))
        cube.append(_power(w, mp.mpf(-3) / 2, cube, k))
        bent.append(mp.fsum(square[j] * v[k - j] for j in range(min(k, 2) + 1)))
        f.append(-_product(f, root, k) / ((k + 1) * (k + 2)))
        v.append(-_product(bent, cube, k) / ((k + 1) * (k + 2)))
    tail = max(abs(x[-1]) / max(abs(x[0]), abs(x[1]) * t) for x in (f, v))
    h = min(room, (mp.mpf(10) ** -DIGITS / tail) ** (mp.mpf(1) / len(f)))
    at = [_horner(x, h) for x in (f, v)]
    slopes = [_horner([k * c for k, c in enumerate(x)][1:], h) for x in (f, v)]
    return t + h, at[0], slopes[0], at[1], slopes[1]


def _tip(a, h):
    """The state at t = h from a bare tip."""
    u, bend, w, root, cube = [a], [mp.mpf(1)], [], [], []
    for k in range(ORDER):
        w.append(_product(u, u, k) + (k == 0))
        root.append(_power(w, mp.mpf(-1) / 2, root, k))
        cube.append(_power(w, mp.mpf(-3) / 2, cube, k))
        u.append(-_product(u, root, k) / ((k + 1) * (k + 2)))
        bend.append(-_product(bend, cube, k) / ((k + 1) * (k + 2)))
    f, v = (mp.fsum(c * h ** (k + 1) for k, c in enumerate(x)) for x in (u, bend))
    p, q = (mp.fsum((k + 1) * c * h**k for k, c in enumerate(x)) for x in (u, bend))
    return h, f, p, v, q


def shoot(a, G, lam, w_f):
    """f, p, q at the tow point."""
    mu, t_end = w_f * G, (w_f + lam) * G
    t, f, p, v, q = _tip(a, min(t_end, mp.mpf(1)) / 64) if mu == 0 else (mu, mu * a, a, mu, mp.mpf(1))
    while t < t_end:
        t, f, p, v, q = _step(t, f, p, v, q, t_end - t)
    return f, p, q


def polished(n, lam, w_f, gamma, x_f):
    """gamma, R_x0, x_f of a fold after one step of Newton's method from values good to 25 digits and more."""
    with mp.workdps(DIGITS):
        lam, w_f, gamma, x_f = (mp.mpf(value) for value in (lam, w_f, gamma, x_f))
        sign = 1 if n % 2 == 0 else -1
        G = gamma**2
        a = sign * x_f * G
        small = mp.mpf(10) ** -18
        f, p, q = shoot(a, G, lam, w_f)
        rows = []
        for da, dg in ((small, 0), (0, small)):
            G_near = G * (1 + dg)
            f_near, p_near, q_near = shoot(a * (1 + da), G_near, lam, w_f)
            rows.append(((p_near - sign * G_near) - (p - sign * G), q_near - q, f_near - f))
        slopes = mp.matrix([[rows[0][0], rows[1][0]], [rows[0][1], rows[1][1]]]) / small
        move = mp.lu_solve(slopes, mp.matrix([sign * G - p, -q]))
        f += (rows[0][2] * move[0] + rows[1][2] * move[1]) / small
        a, G = a * (1 + move[0]), G * (1 + move[1])
        return mp.sqrt(G), sign * f / G, sign * a / G
