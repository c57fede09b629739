"""The equations of the cable in a vacuum: forward (Skop), from the fish up, and their start at the tip.

Forward, from the tow point, NRL Report 7048 Eqs. (29a, b), lengths over the tow radius:

    dx/ds = R_x / sqrt((w_f + lambda - s)^2 + R_x^2),   dR_x/ds = -gamma^2 x

From the fish up, lengths over g / Omega^2, with t = gamma^2 (w_f + lambda - s), f = gamma^2 R_x, p = gamma^2 x and
the start t = mu = gamma^2 w_f, f = mu a, p = a:

    df/dt = p,   dp/dt = -f / r,   r = sqrt(t^2 + f^2)   (the tension)

and in d(sigma) = dt / r, free of square roots and divisions (kernels/steppers.py). The first variation in `a` at fixed
t is v = df/da, q = dp/da with dv/dt = q, dq/dt = -t^2 v / r^3. Depth above the fish: dz/dt = t / r.
"""

from math import sqrt

import numpy as np

from towatlas.kernels.compiling import inlined

# Below this ratio of mu to sqrt(1 + a^2) the fish is a first-order change of the bare tip: the error is its square.
TINY_FISH = 1e-9
# Where the tip series hands over, in units of sqrt(1 + a^2): its first missing term is the fourth power of this.
TIP_REACH = 1e-5


@inlined
def inverse_root_guess(x):
    """1 / sqrt(x) within 3.5 %, from the bits of x: half the exponent, and it vectorises."""
    half = np.int64(np.float64(x).view(np.uint64) >> np.uint64(1))
    return np.int64(np.int64(0x5FE6EB50C7B537A9) - half).view(np.float64)


@inlined
def inverse_root(x):
    """1 / sqrt(x) within 1.3 units of rounding, for x from 1e-300 to 1e300, without the division unit."""
    y = inverse_root_guess(x)
    # What is left of x y^2 below 1, and the best cubic for its inverse root: y is then within 8.5e-7.
    h = 1.0 - (x * y) * y
    y = y * (0.99999918072366861 + h * (0.49999926255677759 + h * (0.37634074785891236 + h * 0.31370680847626686)))
    # Of that the series to second order: what it leaves out is below 1e-17.
    h = 1.0 - (x * y) * y
    return y + y * (h * (0.5 + h * 0.375))


@inlined
def forward_slopes(x, force, below, gamma2):
    """Slopes of x and R_x in s, Eqs. (29a, b); `below` = w_f + lambda - s is the weight below the point."""
    return force * inverse_root(below * below + force * force), -gamma2 * x


@inlined
def boundary_error(x, force, w_f, gamma2):
    """E of Eq. (33): what R_x at the fish lacks of the centrifugal force on it."""
    return force - w_f * gamma2 * x


@inlined
def tip_series(a, mu, t):
    """State (f, p, z, v, q) at t of the shot that starts at t = mu << t << sqrt(1 + a^2).

    For mu = 0 the equation has a removable 0/0 at the tip: u = f/t -> a, and p' = -G(u), G = u / sqrt(1 + u^2),
    gives p = a + p1 t + p2 t^2 + p3 t^3. A light fish shifts a by mu G(a).
    """
    w = 1.0 / (1.0 + a * a)
    slope = sqrt(w) * w
    shift = mu * a * sqrt(w)
    dshift = mu * slope
    b = a + shift
    w = 1.0 / (1.0 + b * b)
    s = sqrt(w)
    g = b * s
    g1 = s * w
    g2 = -3.0 * b * g1 * w
    g3 = -3.0 * g1 * w + 15.0 * b * b * g1 * w * w
    p1 = -g
    p2 = g * g1 / 4.0
    p3 = -(g * g1 * g1 / 36.0 + g2 * g * g / 24.0)
    q1 = -g1
    q2 = (g1 * g1 + g * g2) / 4.0
    q3 = -((g1 * g1 * g1 + 2.0 * g * g1 * g2) / 36.0 + (g3 * g * g + 2.0 * g2 * g * g1) / 24.0)
    chain = 1.0 + dshift
    p = b + t * (p1 + t * (p2 + t * p3))
    f = t * (b + t * (p1 / 2.0 + t * (p2 / 3.0 + t * p3 / 4.0)))
    q = chain * (1.0 + t * (q1 + t * (q2 + t * q3)))
    v = chain * t * (1.0 + t * (q1 / 2.0 + t * (q2 / 3.0 + t * q3 / 4.0)))
    s1 = -b * g1
    s2 = (2.0 * b * b - 1.0) * g1 * w
    z = s * (t - mu) + t * t * (s1 * p1 / 4.0 + t * (s1 * p2 / 9.0 + s2 * p1 * p1 / 24.0))
    return f, p, z, v, q


@inlined
def start(a, mu, tau_end):
    """State (tau, f, p, z, v, q) a shot starts from, and whether it ended already, within the tip series."""
    slant = sqrt(1.0 + a * a)
    reach = TIP_REACH * slant
    end = mu + tau_end
    if mu < TINY_FISH * slant and (mu == 0.0 or (mu < 1e-6 * reach and mu < 1e-6 * end)):
        t = min(reach, end)
        f, p, z, v, q = tip_series(a, mu, t)
        return t - mu, f, p, z, v, q, end <= reach
    return 0.0, mu * a, a, 0.0, mu, 1.0, tau_end <= 0.0


@inlined
def tension(t, f):
    """Scaled tension r, the square root of t^2 + f^2."""
    return sqrt(t * t + f * f)
