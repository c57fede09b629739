"""Shots in a vacuum with all that docs/proofs.md speaks of: many at once, in numpy, Taylor series in dsigma = dt/r.

Shares no code with the kernels. Zeros are bracketed on a grid within each step, on which the signs are looked at too.
"""

from dataclasses import dataclass

import numpy as np

ORDER = 24
GRID = np.linspace(0.0, 1.0, 9)[1:]
# t, f, p, v, q, r; wb = t p - f; I1, I2 of Theorem 4; the length in sigma.
NAMES = ("t", "f", "p", "v", "q", "r", "wb", "I1", "I2", "sigma")
T, F, P, V, Q, R, WB, I1, I2, SIGMA = range(10)
# Zeros of p, q, f, v and wb by the names of the page.
KINDS = {"kappa": P, "t": Q, "tau": F, "sigma": V, "e": WB}


@dataclass
class Events:
    """States at zeros, shape (kinds of zero: shots, zeros, NAMES), and least values on the way, shape (shots,)."""

    at: dict[str, np.ndarray]
    least: dict[str, np.ndarray]

    def __getitem__(self, key):
        """events["tau", "f"]: f at the zeros of f, shape (shots, zeros)."""
        kind, name = key
        return self.at[kind][..., NAMES.index(name)]


def start(a, mu):
    """State at the fish; without one a little above it, by the series in t, whose next term is below rounding."""
    s2 = 1.0 + a * a
    t = np.where(mu > 0.0, mu, 3e-6 * np.sqrt(s2))
    bare = np.where(mu > 0.0, 0.0, t)
    one, two = -a / (2.0 * np.sqrt(s2)), a / (12.0 * s2 * s2)
    u = a + bare * (one + bare * two)
    slope = 1.0 + bare * (-0.5 / s2**1.5 + bare * (1.0 - 3.0 * a * a) / (12.0 * s2**3))
    q = 1.0 + bare * (-1.0 / s2**1.5 + bare * (1.0 - 3.0 * a * a) / (4.0 * s2**3))
    wb = bare * bare * (one + 2.0 * bare * two)
    i2 = a / s2**1.5 * bare * bare / 2.0
    return np.stack([t, t * u, u + wb / t, t * slope, q, t * np.hypot(1.0, u), wb, i2 / s2, i2, np.zeros(len(a))])


def series(state):
    """Taylor coefficients of the state in sigma, shape (ORDER + 1, NAMES, shots)."""
    c = np.zeros((ORDER + 1, *state.shape))
    c[0], c[1, SIGMA] = state, 1.0
    t, f, p, v, q, r = (c[:, row] for row in range(6))
    c2, y, s, ss, ys = (np.zeros((ORDER + 1, state.shape[1])) for _ in range(5))  # (t/r)^2, h v r, v/r, its square, y f
    x = np.zeros_like(c2)  # t/r

    def product(one, other, k):
        return np.einsum("js,js->s", one[: k + 1], other[k::-1])

    for k in range(ORDER):
        for quotient, top in ((x, t), (s, v)):
            quotient[k] = (top[k] - np.einsum("js,js->s", quotient[:k], r[k:0:-1])) / r[0]
        c2[k], ss[k] = product(x, x, k), product(s, s, k)
        y[k] = product(c2, v, k) if k == 0 else np.einsum("js,js->s", c2[: k + 1], v[k::-1])
        ys[k] = product(y, f, k)
        rates = {
            T: r[k],
            F: product(p, r, k),
            P: -f[k],
            V: product(q, r, k),
            Q: -y[k],
            R: t[k] + product(f, p, k),
            WB: -product(t, f, k),
            I1: product(ys, ss, k),
            I2: ys[k],
        }
        for row, rate in rates.items():
            c[k + 1, row] = rate / (k + 1)
    return c


def value(c, x):
    total = np.zeros_like(c[0])
    for term in c[::-1]:
        total *= x
        total += term
    return total


def _length(c, state):
    """Steps whose last terms are below rounding, over the local amplitude of each quantity."""
    f, p, v, q, r = state[1:6]
    root = np.sqrt(r)
    wave, varied = np.hypot(p * root, f), np.hypot(q * root, v)
    scale = np.stack([r, wave * root, wave / root, varied * root, varied / root, r])
    size = np.abs(c[-2:, :6]) / np.maximum(scale, 1e-300)
    last = size.max(axis=1)
    return np.minimum((1e-17 / last[0]) ** (1.0 / (ORDER - 1)), (1e-17 / last[1]) ** (1.0 / ORDER))


def signs(state):
    """Quantities that the page says are positive, over the sum of the sizes of their terms: X, N and psi - phi."""
    t, f, p, v, q, r, wb = state[:7]
    turned = [(p * q, f * v / r), (wb * q, t * f * v / r), (f * q, -p * v)]
    return [(one + other) / (np.abs(one) + np.abs(other) + 1e-300) for one, other in turned]


def march(a, mu, zeros):
    """Shots from (a, mu) until `zeros` zeros of each kind have been passed."""
    a, mu = (np.array(x, float).ravel() for x in np.broadcast_arrays(a, mu))
    shots = len(a)
    state = start(a, mu)
    at = {kind: np.full((shots, zeros, len(NAMES)), np.nan) for kind in KINDS}
    passed = {kind: np.zeros(shots, int) for kind in KINDS}
    least = {name: np.full(shots, np.inf) for name in ("X", "N", "lag", "I1")}
    alive = np.arange(shots)
    while len(alive):
        now = state[:, alive]
        c = series(now)
        h = _length(c, now)
        grid = np.stack([value(c, h * x) for x in GRID])
        for name, row in zip(("X", "N", "lag"), zip(*(signs(g) for g in grid), strict=True), strict=True):
            least[name][alive] = np.fmin(least[name][alive], np.min(row, axis=0))
        least["I1"][alive] = np.fmin(least["I1"][alive], (grid[:, I1] / grid[:, I2].clip(1e-300)).min(axis=0))
        for kind, row in KINDS.items():
            before = np.concatenate([now[None, row], grid[:-1, row]])
            # The first zeros of v and wb are those after the start.
            k, shot = np.nonzero(before * grid[:, row] < 0.0)
            low, high = (GRID[k] - GRID[0]) * h[shot], GRID[k] * h[shot]
            zero = _zeros(c[:, :, shot], row, low, high)
            for j in np.argsort(k, kind="stable"):
                count = passed[kind][alive[shot[j]]]
                if count < zeros:
                    at[kind][alive[shot[j]], count] = zero[:, j]
                passed[kind][alive[shot[j]]] += 1
        state[:, alive] = grid[-1]
        alive = alive[np.min([passed[kind][alive] for kind in KINDS], axis=0) < zeros]
    return Events(at, least)


def _zeros(c, row, low, high):
    """States where a quantity is zero between two points of a step: Newton's method, by bisection where it strays."""
    terms = c[:, row]
    slopes = terms[1:] * np.arange(1.0, ORDER + 1)[:, None]
    rises = value(terms, high) > 0.0
    x = 0.5 * (low + high)
    for _ in range(60 if len(x) else 0):
        y = value(terms, x)
        low, high = np.where((y > 0.0) == rises, low, x), np.where((y > 0.0) == rises, x, high)
        new = x - y / value(slopes, x)
        new = np.where((new >= low) & (new <= high), new, 0.5 * (low + high))
        done = np.abs(new - x) <= 2e-16 * np.abs(x)
        x = new
        if done.all():
            break
    return value(c, x)
