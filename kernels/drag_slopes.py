"""The equations of kernels.drag with the jets 1 and log r, written out: what every search needs, three times as fast.

At order k the sums over the inner orders of all products run in three loops, and what ends them in straight line. No
side force.
"""

import numpy as np

from towatlas.kernels.calls import ORDER
from towatlas.kernels.compiling import helper
from towatlas.kernels.drag import (
    FIRST,
    FX,
    FY,
    FZ,
    FZ2,
    KAPPA,
    KAPPA_T,
    KEPT,
    MB,
    NORMAL,
    PACE,
    RHO2,
    STATE,
    T2,
    WEIGHT,
    ZERO,
    B,
    D,
    E,
    G,
    H,
    M,
    T,
    U,
    X,
    Y,
    values,
)
from towatlas.kernels.vector import broadcast, load, square_root, store, where_less

COUNT = np.int64(2)  # monomials
# Where the coefficients of a quantity begin; those of its slope follow KEPT places later.
U_, T_, X_, Y_, H_, FX_, FY_, FZ_ = (q * COUNT * KEPT for q in (U, T, X, Y, H, FX, FY, FZ))
RHO2_, FZ2_, D_, G_, M_, T2_, B_, MB_, E_ = (q * COUNT * KEPT for q in (RHO2, FZ2, D, G, M, T2, B, MB, E))


@helper
def _get(c, at, k):
    return load(c, at + k), load(c, at + KEPT + k)


@helper
def _put(c, at, k, a, b):
    store(c, at + k, a)
    store(c, at + KEPT + k, b)


@helper
def _times(a, a1, b, b1):
    return a * b, a * b1 + a1 * b


@helper
def _squares(c, first, second, k):
    """Order k of the squares of two quantities."""
    s = t = v = q = r = w = broadcast(0.0)
    half = (k + 1) // 2
    for o in range(half):
        a, a1 = _get(c, first, o)
        b, b1 = _get(c, first, k - o)
        s = s + a * b
        t = t + a * b1
        v = v + a1 * b
        a, a1 = _get(c, second, o)
        b, b1 = _get(c, second, k - o)
        q = q + a * b
        r = r + a * b1
        w = w + a1 * b
    s, t = s + s, t + v
    q, r = q + q, r + w
    if k % 2 == 0:
        a, a1 = _get(c, first, half)
        s = s + a * a
        t = t + a * a1
        a, a1 = _get(c, second, half)
        q = q + a * a
        r = r + a * a1
    return s, t + t, q, r + r


@helper
def _known_sums(c, k):
    """Order k of m = X F_y - Y F_x, T X and T Y, all of whose terms are known."""
    m = m1 = n1 = p = p1 = q = q1 = broadcast(0.0)
    for o in range(k + 1):
        x, x1 = _get(c, X_, o)
        y, y1 = _get(c, Y_, o)
        t, t1 = _get(c, T_, k - o)
        f, f1 = _get(c, FX_, k - o)
        g, g1 = _get(c, FY_, k - o)
        m = m + x * g - y * f
        m1 = m1 + x * g1 - y * f1
        n1 = n1 + x1 * g - y1 * f
        p = p + t * x
        p1 = p1 + t * x1 + t1 * x
        q = q + t * y
        q1 = q1 + t * y1 + t1 * y
    return m, m1 + n1, p, p1, q, q1


@helper
def _inner_sums(c, k):
    """Terms 1..k-1 of order k of F_z^2 rho^2 + D^2, g g, g b, g X, g Y, b T^2, e F_x, e F_y, e F_z."""
    a = a1 = b1 = d = d1 = e = e1 = f = f1 = g = g1 = h = h1 = broadcast(0.0)
    l0 = l1 = m = m1 = n = n1 = broadcast(0.0)
    for o in range(FIRST, k):
        i = k - o
        z, z1 = _get(c, FZ2_, o)
        r, r1 = _get(c, RHO2_, i)
        a = a + z * r
        a1 = a1 + z * r1 + z1 * r
        z = load(c, D_ + o)
        r, r1 = _get(c, D_, i)
        a = a + z * r
        b1 = b1 + z * r1
        z, z1 = _get(c, G_, o)
        r, r1 = _get(c, G_, i)
        d = d + z * r
        d1 = d1 + z * r1
        r, r1 = _get(c, B_, i)
        e = e + z * r
        e1 = e1 + z * r1 + z1 * r
        r, r1 = _get(c, X_, i)
        f = f + z * r
        f1 = f1 + z * r1 + z1 * r
        r, r1 = _get(c, Y_, i)
        g = g + z * r
        g1 = g1 + z * r1 + z1 * r
        z, z1 = _get(c, B_, o)
        r, r1 = _get(c, T2_, i)
        h = h + z * r
        h1 = h1 + z * r1 + z1 * r
        z, z1 = _get(c, E_, o)
        r, r1 = _get(c, FX_, i)
        l0 = l0 + z * r
        l1 = l1 + z * r1 + z1 * r
        r, r1 = _get(c, FY_, i)
        m = m + z * r
        m1 = m1 + z * r1 + z1 * r
        r, r1 = _get(c, FZ_, i)
        n = n + z * r
        n1 = n1 + z * r1 + z1 * r
    return a, a1 + b1 + b1, d, d1 + d1, e, e1, f, f1, g, g1, h, h1, l0, l1, m, m1, n, n1


@helper
def _tangential_sums(c, k):
    """Terms 1..k-1 of order k of m b and (m b) T."""
    s = s1 = t = t1 = broadcast(0.0)
    for o in range(FIRST, k):
        m, m1 = _get(c, M_, o)
        b, b1 = _get(c, B_, k - o)
        s = s + m * b
        s1 = s1 + m * b1 + m1 * b
        m, m1 = _get(c, MB_, o)
        b, b1 = _get(c, T_, k - o)
        t = t + m * b
        t1 = t1 + m * b1 + m1 * b
    return s, s1, t, t1


@helper
def set_tension_slopes(c):
    """The tension from the force."""
    fx, fx1 = _get(c, FX_, ZERO)
    fy, fy1 = _get(c, FY_, ZERO)
    fz, fz1 = _get(c, FZ_, ZERO)
    tension = square_root(fx * fx + fy * fy + fz * fz)
    _put(c, T_, ZERO, tension, (fx * fx1 + fy * fy1 + fz * fz1) / tension)


@helper
def expand_slopes(c, p, tangential):
    """Taylor coefficients in sigma over the pace, from the state at order 0."""
    set_tension_slopes(c)
    kappa, kappa_t, w = load(p, KAPPA * COUNT), load(p, KAPPA_T * COUNT), load(p, WEIGHT * COUNT)
    normal, pace = load(p, NORMAL * COUNT), load(p, PACE * COUNT)
    inverse_pace = 1.0 / pace
    x0, x01 = _get(c, X_, ZERO)
    y0, y01 = _get(c, Y_, ZERO)
    fx0, fx01 = _get(c, FX_, ZERO)
    fy0, fy01 = _get(c, FY_, ZERO)
    fz0, fz01 = _get(c, FZ_, ZERO)
    t0, t01 = _get(c, T_, ZERO)
    r0, r01 = x0 * x0 + y0 * y0, 2.0 * (x0 * x01 + y0 * y01)
    _put(c, RHO2_, ZERO, r0, r01)
    half_g = inverse_t2 = g0 = g01 = t21 = b0 = b01 = e0 = e01 = broadcast(0.0)
    z0 = z01 = d0 = d01 = m0 = m01 = mb0 = mb01 = broadcast(0.0)
    for k in range(np.int64(ORDER)):
        j = k + 1
        share = (1.0 / j) * pace
        t, t1 = _get(c, T_, k)
        fx, fx1 = _get(c, FX_, k)
        fy, fy1 = _get(c, FY_, k)
        fz, fz1 = _get(c, FZ_, k)
        x, x1 = _get(c, X_, k)
        y, y1 = _get(c, Y_, k)
        r, r1 = _get(c, RHO2_, k)
        _put(c, U_, j, t * share, t1 * share)
        _put(c, X_, j, -(share * fx), -(share * fx1))
        _put(c, Y_, j, -(share * fy), -(share * fy1))
        _put(c, H_, j, share * fz, share * fz1)
        a, a1, q, q1 = _squares(c, X_, Y_, j)
        a, a1 = a + q, a1 + q1
        _put(c, RHO2_, j, a, a1)
        half = inverse_pace * (-0.5 * j)
        d, d1 = a * half, a1 * half
        _put(c, D_, k, d, d1)
        z, z1, t2, t21k = _squares(c, FZ_, T_, k)
        _put(c, FZ2_, k, z, z1)
        _put(c, T2_, k, t2, t21k)
        m, m1, tx, tx1, ty, ty1 = _known_sums(c, k)
        s, s1, gg, gg1, gb, gb1, gx, gx1, gy, gy1, bt, bt1, ex, ex1, ey, ey1, ez, ez1 = _inner_sums(c, k)
        mb = mb1 = mbt = mbt1 = broadcast(0.0)
        if tangential:
            mb, mb1, mbt, mbt1 = _tangential_sums(c, k)
        if k == 0:
            z0, z01, d0, d01, m0, m01, t21 = z, z1, d, d1, m, m1, t21k
            s, s1 = _times(z, z1, r, r1)
            q, q1 = _times(d, d1, d, d1)
            # Without normal drag g may be zero, and is not needed.
            g = square_root(where_less(normal, broadcast(0.5), broadcast(1.0), s + q))
            half_g = 0.5 / g
            g1 = (s1 + q1) * half_g
            inverse_t2 = 1.0 / t2
            b = m * inverse_t2
            b1 = (m1 - b * t21k) * inverse_t2
            e, e1 = _times(g, g1, b, b1)
            e, e1 = kappa * e, kappa * e1
            if tangential:
                mb0, mb01 = _times(m, m1, b, b1)
                mb, mb1 = mb0, mb01
                mbt, mbt1 = _times(mb, mb1, t, t1)
                e, e1 = e + kappa_t * mb, e1 + kappa_t * mb1
            g0, g01, b0, b01, e0, e01 = g, g1, b, b1, e, e1
        else:
            q, q1 = _times(z0, z01, r, r1)
            s, s1 = s + q, s1 + q1
            q, q1 = _times(z, z1, r0, r01)
            s, s1 = s + q, s1 + q1
            q, q1 = _times(d0, d01, d, d1)
            s, s1 = s + q + q, s1 + q1 + q1
            g = where_less(normal, broadcast(0.5), broadcast(0.0), (s - gg) * half_g)
            g1 = (s1 - gg1 - 2.0 * g * g01) * half_g
            b = (m - bt - b0 * t2) * inverse_t2
            b1 = (m1 - bt1 - b0 * t21k - b01 * t2 - b * t21) * inverse_t2
            q, q1 = _times(g0, g01, b, b1)
            gb, gb1 = gb + q, gb1 + q1
            q, q1 = _times(g, g1, b0, b01)
            e, e1 = kappa * (gb + q), kappa * (gb1 + q1)
            if tangential:
                q, q1 = _times(m0, m01, b, b1)
                mb, mb1 = mb + q, mb1 + q1
                q, q1 = _times(m, m1, b0, b01)
                mb, mb1 = mb + q, mb1 + q1
                q, q1 = _times(mb0, mb01, t, t1)
                mbt, mbt1 = mbt + q, mbt1 + q1
                q, q1 = _times(mb, mb1, t0, t01)
                mbt, mbt1 = mbt + q, mbt1 + q1
                e, e1 = e + kappa_t * mb, e1 + kappa_t * mb1
            q, q1 = _times(g0, g01, x, x1)
            gx, gx1 = gx + q, gx1 + q1
            q, q1 = _times(g0, g01, y, y1)
            gy, gy1 = gy + q, gy1 + q1
            q, q1 = _times(e0, e01, fx, fx1)
            ex, ex1 = ex + q, ex1 + q1
            q, q1 = _times(e0, e01, fy, fy1)
            ey, ey1 = ey + q, ey1 + q1
            q, q1 = _times(e0, e01, fz, fz1)
            ez, ez1 = ez + q, ez1 + q1
        _put(c, G_, k, g, g1)
        _put(c, B_, k, b, b1)
        _put(c, E_, k, e, e1)
        if tangential:
            _put(c, M_, k, m, m1)
            _put(c, MB_, k, mb, mb1)
        q, q1 = _times(g, g1, x0, x01)
        gx, gx1 = gx + q, gx1 + q1
        q, q1 = _times(g, g1, y0, y01)
        gy, gy1 = gy + q, gy1 + q1
        q, q1 = _times(e, e1, fx0, fx01)
        ex, ex1 = ex + q, ex1 + q1
        q, q1 = _times(e, e1, fy0, fy01)
        ey, ey1 = ey + q, ey1 + q1
        q, q1 = _times(e, e1, fz0, fz01)
        ez, ez1 = ez + q, ez1 + q1
        _put(c, FX_, j, share * (tx + kappa * gy + ex), share * (tx1 + kappa * gy1 + ex1))
        _put(c, FY_, j, share * (ty - kappa * gx + ey), share * (ty1 - kappa * gx1 + ey1))
        _put(c, FZ_, j, share * (w * t + ez), share * (w * t1 + ez1))
        _put(c, T_, j, share * (d + w * fz + kappa_t * mbt), share * (d1 + w * fz1 + kappa_t * mbt1))


@helper
def advance_slopes(c, p, new, h, target):
    """State after the steps h, whose slopes keep the paid-out length at that of `target`; completes h, fills new."""
    step = load(h, ZERO)
    rate = values(c, T_, ZERO, step) * load(p, PACE * COUNT)
    moved = (load(target, FIRST) - values(c, U_ + KEPT, ZERO, step)) / rate
    store(h, FIRST, moved)
    for quantity in range(STATE):
        if quantity == T:
            continue
        at = quantity * COUNT * KEPT
        value, slope, along = load(c, at + ORDER), load(c, at + KEPT + ORDER), broadcast(0.0)
        for k in range(ORDER - 1, -1, -1):
            along = along * step + value
            value = value * step + load(c, at + k)
            slope = slope * step + load(c, at + KEPT + k)
        store(new, quantity * COUNT, value)
        store(new, quantity * COUNT + 1, slope + along * moved)
