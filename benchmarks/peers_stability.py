"""Other ways to a growth rate, from the linearised equations in arc length as they stand in docs/stability.md: shots by
SciPy and Runge-Kutta, a finite-difference modal analysis.

Lengths over g / Omega^2, growth rates in units of Omega.
"""

from collections.abc import Callable

import numpy as np
from scipy import sparse
from scipy.integrate import solve_ivp
from scipy.sparse.linalg import LinearOperator, eigs, splu

import towatlas
from towatlas.results import Equilibria

Array = np.ndarray
SPIN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
ONE = np.eye(3)
SECANTS = 12
CLOSE = 1e-14
# Condition of motions of unit length that are all but parallel.
PARALLEL = 1e3
# Of complex steps, in which nothing cancels.
STEP = 1e-30
# Of extrapolation.
COLUMNS = 8


def _drag(system: towatlas.System, g2: float, t: Array, V: Array) -> tuple[Array, Array, Array]:
    """Force of the fluid on a length, and its derivatives A by the speed and E by the turn."""
    kappa, kappa_t = system.C / g2, system.C_t / g2
    along = V @ t
    N = V - along * t
    q = np.sqrt(N @ N)
    P, tt, NN = ONE - np.outer(t, t), np.outer(t, t), np.outer(N, N) / q
    A = kappa * (q * P + NN) + 2.0 * kappa_t * abs(along) * tt
    E = kappa * (along * (q * ONE + NN) + q * np.outer(t, N))
    E -= kappa_t * (2.0 * abs(along) * np.outer(t, N) + abs(along) * along * ONE)
    return -kappa * q * N - kappa_t * abs(along) * along * t, A, E


def _side(system: towatlas.System, g2: float, t: Array, V: Array) -> Array:
    """Side force on a length; rows of t and V for several."""
    along, v2 = (V * t).sum(axis=-1, keepdims=True), (V * V).sum(axis=-1, keepdims=True)
    across = ((V - along * t) ** 2).sum(axis=-1, keepdims=True) / v2
    over = np.stack([t[..., i - 2] * V[..., i - 1] - t[..., i - 1] * V[..., i - 2] for i in range(3)], axis=-1)
    return system.C_s / g2 * np.sqrt(v2) * over / (1.0 + across / system.b_s**2)


def _with_side_force(system: towatlas.System, g2: float, t: Array, V: Array) -> tuple[Array, Array, Array]:
    """As `_drag`; what the side force adds to the derivatives by complex steps."""
    force, A, E = _drag(system, g2, t, V)
    if not system.C_s or not V.any():
        return force, A, E
    by_turn, by_speed = t + STEP * 1j * np.eye(6, 3), V + STEP * 1j * np.eye(6, 3, -3)
    side = _side(system, g2, by_turn, by_speed)
    return force + side[0].real, A - side.imag[3:].T / STEP, E + side.imag[:3].T / STEP


def _slopes(system: towatlas.System, g2: float, sigma: complex) -> Callable[[float, Array], Array]:
    turn = sigma * ONE + SPIN
    twice = turn @ turn

    def slopes(_: float, state: Array) -> Array:
        x, F, eta, phi = state[:3].real, state[3:6].real, state[6:15].reshape(3, 3), state[15:24].reshape(3, 3)
        T = np.sqrt(F @ F)
        t = F / T
        force, A, E = _with_side_force(system, g2, t, SPIN @ x)
        slope = (phi - np.outer(t, t @ phi)) / T
        moved = E @ slope - (twice + A @ turn) @ eta
        pull = np.array([x[0], x[1], system.w]) + force
        return np.concatenate([-t, pull, -slope.ravel(), moved.ravel()])

    return slopes


def _start(system: towatlas.System, g2: float, r: float, sigma: complex) -> Array:
    """At the fish: its place, force, and three motions."""
    turn, pull = sigma * ONE + SPIN, system.C_f * r * np.diag([1.0, 2.0, 1.0])
    phi = -(g2 * system.m_f * turn @ turn + pull @ turn)
    force = np.array([g2 * system.m_f * r, -system.C_f * r**2, g2 * system.w_f])
    return np.concatenate([[r, 0.0, 0.0], force, ONE.ravel(), phi.ravel()]) + 0j


def evans(found: Equilibria, k: int, sigma: complex, march: Callable) -> complex:
    """D(sigma) of a shape, by an integrator `march(slopes, length, start)`."""
    g2 = found.gamma**2
    start = _start(found.system, g2, float(found.r_f[k]) * g2, sigma)
    end = march(_slopes(found.system, g2, sigma), g2 * found.system.lam, start)
    return complex(_det(end))


def _det(end: Array) -> complex:
    one, two, three = end[6:15].reshape(3, 3)
    return one @ np.array([two[i - 2] * three[i - 1] - two[i - 1] * three[i - 2] for i in range(3)])


def exact(found: Equilibria, k: int, guess: complex, mesh: Array) -> complex:
    """The eigenvalue next to a guess with 19 digits throughout, the shape among it: extrapolation of order 16.

    `mesh` are steps of the arc length from the fish up; their scale does not matter.
    """
    system, g2 = found.system, np.longdouble(found.gamma) ** 2
    steps = mesh.astype(np.longdouble) * (g2 * system.lam / mesh.astype(np.longdouble).sum())

    def end(r: Array, sigma: complex) -> Array:
        y = _start(system, g2, r, sigma)
        slopes = _slopes(system, g2, sigma)
        for h in steps:
            y = _extrapolated(slopes, y, h)
        return y

    def miss(r: Array) -> Array:
        x = end(r, np.clongdouble(guess))[:2].real
        return np.sqrt(x @ x) / g2 - 1.0

    r = np.longdouble(found.r_f[k]) * g2
    r = _zero(miss, r * (1.0 + 1e-9), r, 1e-19)
    sigma = np.clongdouble(guess)
    return complex(_zero(lambda sigma: _det(end(r, sigma)), sigma * (1.0 + 1e-6), sigma, 1e-17))


def _zero(function: Callable, old: Array, new: Array, close: float) -> Array:
    before, here = function(old), function(new)
    for _ in range(SECANTS):
        if here == before:
            break
        old, before, new = new, here, new - here * (new - old) / (here - before)
        if abs(new - old) < close * abs(new):
            break
        here = function(new)
    return new


def _extrapolated(slopes: Callable, y: Array, h: Array) -> Array:
    """A step of Gragg, Bulirsch and Stoer."""
    first, table = slopes(0.0, y), []
    for n in range(1, COLUMNS + 1):
        part = h / (2 * n)
        old, new = y, y + part * first
        for _ in range(2 * n - 1):
            old, new = new, old + 2.0 * part * slopes(0.0, new)
        row = [0.5 * (old + new + part * slopes(0.0, new))]
        for j in range(1, n):
            ratio = np.longdouble(n) / (n - j)
            row.append(row[-1] + (row[-1] - table[j - 1]) / (ratio**2 - 1.0))
        table = row
    return table[-1]


def by_scipy(method: str, rtol: float) -> Callable:
    """A march by `solve_ivp`, in real numbers, which all its methods take."""

    def march(slopes: Callable, length: float, start: Array) -> Array:
        def real(s: float, state: Array) -> Array:
            return slopes(s, state.view(complex)).view(float)

        done = solve_ivp(real, (0.0, length), start.view(float), method, rtol=rtol, atol=1e-2 * rtol)
        return np.ascontiguousarray(done.y[:, -1]).view(complex)

    return march


def orthogonal(march: Callable, pieces: int) -> Callable:
    """A march in so many pieces, after which motions that are all but parallel are made orthogonal, of one size, with
    the same D: on a long cable those that grow fastest hide the others, and with them the zeros of D."""

    def marched(slopes: Callable, length: float, start: Array) -> Array:
        state = start
        for _ in range(pieces):
            state = march(slopes, length / pieces, state)
            motions = state[6:].reshape(6, 3)
            if np.linalg.cond(motions / np.linalg.norm(motions, axis=0)) < PARALLEL:
                continue
            basis, factors = np.linalg.qr(motions)
            sizes = np.abs(np.diag(factors))
            turns = np.diag(factors) / sizes
            state = np.concatenate([state[:6], (basis * turns * np.cbrt(sizes).prod()).ravel()])
        return state

    return marched


def by_rk4(segments: int) -> Callable:
    """A march by Runge-Kutta in equal steps of the arc length."""

    def march(slopes: Callable, length: float, start: Array) -> Array:
        y, h = start, length / segments
        for _ in range(segments):
            k1 = slopes(0.0, y)
            k2 = slopes(0.0, y + 0.5 * h * k1)
            k3 = slopes(0.0, y + 0.5 * h * k2)
            y = y + h / 6.0 * (k1 + 2.0 * (k2 + k3) + slopes(0.0, y + h * k3))
        return y

    return march


def by_secants(found: Equilibria, k: int, guess: complex, march: Callable) -> complex:
    """The zero of D next to a guess; nan where secants wander off by more than a tenth."""
    zero = _zero(lambda sigma: evans(found, k, sigma, march), guess * (1.0 + 1e-5), guess, CLOSE)
    return complex(zero if abs(zero - guess) < 0.1 else np.nan)


def by_finite_differences(found: Equilibria, k: int, guess: complex, cells: int) -> complex:
    """The eigenvalue next to a guess of the box scheme, second order, on equal cells, by shift and invert."""
    system, g2 = found.system, found.gamma**2
    edges = np.linspace(0.0, system.lam, cells + 1)
    shape = towatlas.shape_of(found, k, 0.5 * (edges[1:] + edges[:-1]))
    x, F = (
        g2 * np.stack([shape[name].values for name in names], axis=1)
        for names in (("x", "y", "z"), ("R_x", "R_y", "R_z"))
    )
    h = g2 * system.lam / cells
    # Row and column of blocks of three, what is constant, what goes with sigma.
    blocks: list[tuple[int, int, Array, Array]] = []

    def put(row: int, column: int, constant: Array, growing: Array | None = None) -> None:
        blocks.append((row, column, constant, np.zeros((3, 3)) if growing is None else growing))

    # A node has eta, v = sigma eta, phi; rows are those of the cell above it, and of the ends.
    put(0, 0, ONE)
    for j in range(cells + 1):
        put(3 * j + 1, 3 * j, np.zeros((3, 3)), ONE)
        put(3 * j + 1, 3 * j + 1, -ONE)
    for j in range(cells):
        T = np.sqrt(F[j] @ F[j])
        t = F[j] / T
        _, A, E = _drag(system, g2, t, SPIN @ x[j])
        P = (ONE - np.outer(t, t)) / T
        first, second = 3 * j + 2, 3 * (j + 1)
        for node, sign in ((3 * j, -1.0), (3 * j + 3, 1.0)):
            put(first, node, sign / h * ONE)
            put(first, node + 2, -0.5 * P)
            put(second, node + 2, sign / h * ONE + 0.5 * E @ P)
            put(second, node, -0.5 * (SPIN @ SPIN + A @ SPIN))
            put(second, node + 1, -0.5 * (2.0 * SPIN + A), -0.5 * ONE)
    last, r = 3 * cells, float(found.r_f[k]) * g2
    # The pull of the fish turns with it: shapes have the tow point at (1, 0).
    fish = towatlas.shape_of(found, k, [system.lam])
    u = SPIN @ np.array([float(fish.x[0]), float(fish.y[0]), 0.0])
    pull = system.C_f * r * (ONE + np.outer(u, u) / (u @ u))
    mass = g2 * system.m_f
    put(last + 2, last + 2, ONE)
    put(last + 2, last, mass * SPIN @ SPIN + pull @ SPIN)
    put(last + 2, last + 1, 2.0 * mass * SPIN + pull, mass * ONE)
    size = 9 * (cells + 1)
    rows = np.concatenate([np.repeat(3 * row + np.arange(3), 3) for row, _, _, _ in blocks])
    columns = np.concatenate([np.tile(3 * column + np.arange(3), 3) for _, column, _, _ in blocks])
    constant, growing = (
        sparse.csc_array((np.concatenate([block[i].ravel() for block in blocks]), (rows, columns)), (size, size))
        for i in (2, 3)
    )
    solve = splu((constant + guess * growing).tocsc())
    inverse = LinearOperator((size, size), lambda y: solve.solve(growing @ y.astype(complex)), dtype=complex)
    # (constant + sigma growing) y = 0.
    largest = eigs(inverse, k=1, which="LM", v0=np.ones(size, complex), return_eigenvectors=False)[0]
    return complex(guess - 1.0 / largest)
