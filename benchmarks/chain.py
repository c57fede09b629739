"""A chain of rigid links with point masses at their joints, towed in a circle: an independent model of the cable.

Nonlinear, and linearised by hand; second order in 1/N. Shares nothing with the package but the form of a problem, and
starts from its shapes. Positions of the joints are rows, the tow point not among them; lengths, forces and times as in
`towatlas.stability`.
"""

import numpy as np
from scipy import sparse
from scipy.linalg import solveh_banded
from scipy.sparse.linalg import spsolve

from towatlas.system import System

TOW = np.array([1.0, 0.0, 0.0])
# Cross product with the axis of rotation.
SPIN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
# Imaginary step for derivatives of the drag, which is analytic: no rounding.
STEP = 1e-30


def dot(a, b):
    return (a * b).sum(axis=-1, keepdims=True)


class Chain:
    """N links of one system at one speed: forces on the joints 1..N and their derivatives."""

    def __init__(self, system: System, gamma: float, links: int):
        self.system, self.gamma, self.links = system, gamma, links
        self.h = system.lam / links
        ones = np.ones(links)
        # Differences along the links and means over them, of the joints 1..N; the tow point adds `first`.
        self.difference = sparse.diags_array([ones, -ones[1:]], offsets=[0, -1]).tocsr() / self.h
        self.mean = sparse.diags_array([ones / 2, ones[1:] / 2], offsets=[0, -1]).tocsr()
        self.first = np.zeros((links, 1))
        self.first[0] = 1.0
        self.mass = np.full(links, self.h)
        self.mass[-1] = self.h / 2 + system.m_f
        self.weight = np.full(links, self.h * system.w)
        self.weight[-1] = self.h * system.w / 2 + system.w_f

    def tangents(self, r):
        return self.difference @ r - self.first * TOW / self.h

    def drag(self, t, velocity):
        """Drag per length of links."""
        along = dot(velocity, t)
        across = velocity - along * t
        c, c_t = self.system.C, self.system.C_t
        # As square roots, to be analytic.
        return -c * np.sqrt(dot(across, across)) * across - c_t * np.sqrt(along * along) * along * t

    def fish_drag(self, velocity):
        return -self.system.C_f * np.sqrt(dot(velocity, velocity)) * velocity

    def load(self, r, v):
        """All that acts on the joints but tension, forces of the rotating frame among it."""
        gamma = self.gamma
        fluid = self.mean @ v + gamma * (self.mean @ r + self.first * TOW / 2) @ SPIN.T
        force = self.h * (self.mean.T @ self.drag(self.tangents(r), fluid))
        force[-1] += self.fish_drag(v[-1] + gamma * SPIN @ r[-1])
        force[:, 2] += self.weight
        return force - self.mass[:, None] * (2 * gamma * v @ SPIN.T + gamma**2 * r @ (SPIN @ SPIN).T)

    def pull(self, r, tension):
        """Of the links on the joints."""
        return -self.h * (self.difference.T @ (tension[:, None] * self.tangents(r)))

    def load_slopes(self, r):
        """Derivatives of the load by positions and by velocities, at rest in the rotating frame; sparse, 3N x 3N."""
        gamma, links = self.gamma, self.links
        t = self.tangents(r).astype(complex)
        fluid = (gamma * (self.mean @ r + self.first * TOW / 2) @ SPIN.T).astype(complex)
        by_t, by_u = np.empty((links, 3, 3)), np.empty((links, 3, 3))
        fish = np.empty((3, 3))
        for k in range(3):
            step = 1j * STEP * np.eye(3)[k]
            by_t[:, :, k] = self.drag(t + step, fluid).imag / STEP
            by_u[:, :, k] = self.drag(t, fluid + step).imag / STEP
            fish[:, k] = self.fish_drag(gamma * SPIN @ r[-1] + step).imag / STEP
        mean, difference = (sparse.kron(a, np.eye(3)).tocsr() for a in (self.mean, self.difference))
        last = sparse.diags_array(np.eye(links)[-1])
        mass, spin = sparse.diags_array(self.mass), sparse.kron(sparse.eye_array(links), SPIN).tocsr()
        by_velocity = self.h * mean.T @ _blocks(by_u) @ mean + sparse.kron(last, fish)
        by_position = by_velocity @ spin * gamma + self.h * mean.T @ _blocks(by_t) @ difference
        by_position = by_position - gamma**2 * sparse.kron(mass, SPIN @ SPIN)
        return by_position.tocsr(), (by_velocity - 2 * gamma * sparse.kron(mass, SPIN)).tocsr()

    def pull_slopes(self, r, tension):
        """Derivatives of the pull by positions and tensions, and of |t|^2 / 2 by positions."""
        difference = sparse.kron(self.difference, np.eye(3)).tocsr()
        along = _blocks(self.tangents(r)[:, None, :])
        constraint = (along @ difference).tocsr()
        stiffness = -self.h * difference.T @ sparse.kron(sparse.diags_array(tension), np.eye(3)) @ difference
        return stiffness.tocsr(), -self.h * constraint.T, constraint

    def imbalance(self, r, tension):
        """What is zero at rest, forces and |t|^2 / 2 less a half, and its slopes by positions and tensions; sparse."""
        stretch = (dot(self.tangents(r), self.tangents(r)).ravel() - 1) / 2
        residual = np.concatenate([(self.load(r, 0 * r) + self.pull(r, tension)).ravel(), stretch])
        stiffness, by_tension, constraint = self.pull_slopes(r, tension)
        return residual, sparse.block_array([[stiffness + self.load_slopes(r)[0], by_tension], [constraint, None]])

    def rest(self, shape):
        """Positions and tensions at rest, by Newton's method from a shape of the cable."""
        s = self.h * np.arange(1, self.links + 1)
        r = np.stack([np.interp(s, shape.s, shape[name]) for name in "xyz"], axis=-1)
        tension = np.interp(s - self.h / 2, shape.s, shape["T"])
        for _ in range(30):
            residual, matrix = self.imbalance(r, tension)
            step = _solve(matrix, -residual)
            r = r + step[: 3 * self.links].reshape(-1, 3)
            tension = tension + step[3 * self.links :]
            size = max(np.abs(step[: 3 * self.links]).max(), np.abs(step[3 * self.links :] / tension).max())
            if size < 1e-10:
                return r, tension
        raise ArithmeticError(f"the chain found no rest: last step {size:.1e}")

    def fold(self, shape, gamma):
        """Speed at which two shapes at rest meet, near a shape of the cable, from a guess of it.

        Along the curve of shapes that coordinate which moves most is given and the speed is found, and the slope of the
        speed in it is brought to zero by secants.
        """
        r, tension = self.rest(shape)
        known = np.concatenate([r.ravel(), tension])
        moves = _solve(self.imbalance(r, tension)[1], -self._by_speed(r))[: 3 * self.links]
        given = int(np.argmax(np.abs(moves)))
        slope, place = 1.0 / moves[given], known[given]
        # As if the speed were a parabola in it.
        following = place + 2.0 * (gamma - self.gamma) / slope
        for _ in range(30):
            known, rate = self._with_given(known, given, following)
            curvature = (rate - slope) / (following - place)
            slope, place, following = rate, following, following - rate / curvature
            # What is left to the top of the parabola.
            if abs(rate**2 / curvature) < 1e-12 * self.gamma:
                return self.gamma
        raise ArithmeticError(f"the chain found no fold: slope {slope:.1e}")

    def _with_given(self, known, given, value):
        """Positions and tensions of the shape with a coordinate of that value, and the slope of its speed in it."""
        row = sparse.coo_array(([1.0], ([0], [given])), (1, len(known)))
        for _ in range(30):
            r, tension = known[: 3 * self.links].reshape(-1, 3), known[3 * self.links :]
            residual, matrix = self.imbalance(r, tension)
            bordered = sparse.block_array([[matrix, self._by_speed(r)[:, None]], [row, None]])
            right = np.zeros((len(known) + 1, 2))
            right[:-1, 0], right[-1] = -residual, (value - known[given], 1.0)
            step, along = _solve(bordered, right).T
            known, self.gamma = known + step[:-1], self.gamma + step[-1]
            if max(np.abs(step[:-1]).max() / np.abs(known).max(), abs(step[-1]) / self.gamma) < 1e-12:
                return known, along[-1]
        raise ArithmeticError(f"the chain found no rest: last step {np.abs(step).max():.1e}")

    def _by_speed(self, r):
        """Derivative of the imbalance by the speed."""
        speed, self.gamma = self.gamma, self.gamma + 1j * STEP
        forces = self.load(r.astype(complex), 0 * r).imag / STEP
        self.gamma = speed
        return np.concatenate([forces.ravel(), np.zeros(self.links)])

    def eigenvalues(self, r, tension):
        """All of small motions about a shape at rest, the leading one first, and their modes, rows of 3N; dense.

        The motions that keep all lengths are turns of each link about its upper end, across it.
        """
        across = np.linalg.svd(self.tangents(r)[:, None, :])[2][:, 1:, :]
        turns = np.kron(np.tri(self.links), np.ones((3, 2))) * self.h
        turns *= np.tile(np.swapaxes(across, 1, 2).transpose(1, 0, 2).reshape(3, -1), (self.links, 1))
        by_position, by_velocity = self.load_slopes(r)
        stiffness = by_position + self.pull_slopes(r, tension)[0]
        inverse = np.linalg.inv(turns.T @ (np.repeat(self.mass, 3)[:, None] * turns))
        n = 2 * self.links
        first_order = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [inverse @ (turns.T @ (stiffness @ turns)), inverse @ (turns.T @ (by_velocity @ turns))],
            ]
        )
        sigma, modes = np.linalg.eig(first_order)
        order = np.argsort(-sigma.real)
        return sigma[order], (turns @ modes[:n, order]).T

    def eigenvalue_near(self, r, tension, sigma):
        """The one nearest to a guess, by inverse iteration; sparse."""
        by_position, by_velocity = self.load_slopes(r)
        stiffness, by_tension, constraint = self.pull_slopes(r, tension)
        stiffness = stiffness + by_position
        mass = sparse.diags_array(np.repeat(self.mass, 3))
        vector = np.random.default_rng(1).standard_normal(3 * self.links).astype(complex)
        for count in range(40):
            top = stiffness + sigma * by_velocity - sigma**2 * mass
            solved = _solve(
                sparse.block_array([[top, by_tension], [constraint, None]]),
                np.concatenate([(2 * sigma * mass - by_velocity) @ vector, np.zeros(self.links)]),
            )[: 3 * self.links]
            change = (vector.conj() @ vector) / (vector.conj() @ solved)
            vector = solved / np.linalg.norm(solved)
            # First the vector alone, for the nearest of all.

            if count >= 6:
                sigma += change
                if abs(change) < 1e-9 * self.gamma:
                    return sigma
        raise ArithmeticError(f"no eigenvalue near {sigma}")

    def acceleration(self, r, v):
        """Of the joints, with the tensions that keep the lengths of the links."""
        load, t = self.load(r, v), self.tangents(r)
        rates, falls = self.difference @ v, self.difference @ (load / self.mass[:, None])
        upper = np.concatenate([[0.0], 1 / self.mass[:-1]])
        band = np.zeros((2, self.links))
        band[1] = (1 / self.mass + upper) * dot(t, t)[:, 0]
        band[0, 1:] = -upper[1:] * (t[1:] * t[:-1]).sum(axis=1)
        tension = solveh_banded(band, self.h * (dot(t, falls) + dot(rates, rates))[:, 0])
        return (load + self.pull(r, tension)) / self.mass[:, None]


def _blocks(blocks):
    """Block diagonal of (N, k, 3)."""
    n = len(blocks)
    return sparse.bsr_array((blocks, np.arange(n), np.arange(n + 1)), shape=(n * blocks.shape[1], 3 * n)).tocsr()


def _solve(matrix, right):
    return spsolve(matrix.tocsc(), right)
