"""Guesses of the growth rates of small motions: Galerkin's method with polynomials on panels of the cable.

The slope of the perturbation is written in two unit vectors across the cable, times Legendre polynomials of the arc
length that are independent of one panel to the next, so that the cable keeps its length; the perturbation is its
integral from the tow point down. Conditions at the fish are natural ones. With M, G, K the matrices of
sigma^2 M + sigma G + K, M is symmetric and positive definite, and so is K in a vacuum but for as many directions as the
index says.
"""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from towatlas.effort import TooMuchWork, check_foreseen, each_allowed
from towatlas.solve.motion import Array, Complex, Integers, Motion

# Gauss nodes a panel beyond the degree.
NODES = 6
# CPU time over the cube of the number of unknowns, measured with 800 to 5500 of them, s.
SECONDS_A_CUBE = 7e-10
REMEDY = "a shorter cable or a lower speed has fewer nodes"
# Rounds of Newton to their places, parts of a step, and the last one's length.
NEWTON, PLACED = 12, 1e-12
# By how much the angle of the cable, the phase of its waves and the logarithm of its tension may change in a panel.
PANEL = 5.0
DEGREE = 8
# Modes of K that are kept: those up to so many times (reach + 1)^2, and at least so many.
BEYOND, LEAST = 3.0, 16
S = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
PULL = np.diag([1.0, 2.0, 1.0])  # 1 + e_y e_y^T: drag of the fish


@dataclass(frozen=True)
class Modes:
    """Approximate modes of a motion, in the upper half of the plane.

    Attributes
    ----------
    sigma : ndarray of complex, shape (modes,)
        Growth rates in units of Omega.
    energy : ndarray, shape (modes,)
        Energy of the mode in the rotating frame over that of its motion [-]: negative where friction would make an
        oscillation grow; nan with drag.
    index : int
        Number of directions in which the energy falls; -1 with drag.
    """

    sigma: Complex
    energy: Array
    index: int


@dataclass(frozen=True)
class _Panels:
    """Functions on panels, at their Gauss nodes, and what they weigh.

    Attributes
    ----------
    slope, eta : ndarray, shape (panels, nodes, 3, functions)
        Slopes, and what they move the cable by, from the upper end of the panel down.
    end : ndarray, shape (panels, 3, functions)
        What they move all that is below by.
    length, tension : ndarray, shape (panels, nodes)
        Weights in arc length, and the tension.
    mass, friction, force, bend : ndarray, shape (panels, nodes, 3, 3)
        Weighted with the length: 1, 2 S + A, S S + A S, and E P.
    """

    slope: Array
    eta: Array
    end: Array
    length: Array
    tension: Array
    mass: Array
    friction: Array
    force: Array
    bend: Array


def modes(motion: Motion, refined: int = 0) -> Modes:
    """Modes of a small motion with |sigma| up to its reach, and others.

    Parameters
    ----------
    motion : Motion
    refined : int
        How often the panels are made shorter and the degree higher, >= 0.

    Returns
    -------
    Modes
    """
    degree, panel = DEGREE + 3 * refined, PANEL / 1.5**refined
    unknowns = 2 * (degree + 1) * int(_panel_of_step(motion, panel)[-1] + 1)
    seconds = SECONDS_A_CUBE * unknowns**3
    check_foreseen(seconds, f"modes of {unknowns} unknowns", REMEDY)
    if seconds > each_allowed():
        raise TooMuchWork(f"modes of {unknowns} unknowns are too many for one of many shapes")
    with _one_blas_thread():
        return _modes(motion, refined, degree, panel)


@contextmanager
def _one_blas_thread() -> Iterator[None]:
    """BLAS on one thread within, where one thread of Python is at a time.

    Matrices this small are no work for two: on busy cores threads of BLAS would wait for each other, thirty times as
    long as one takes alone, and with their number the last bits change. The limit is of the process, not to be moved
    while another thread relies on it; threadpoolctl from 3.8 on ignores whoever asks for one meanwhile.
    """
    with _within, _blas().limit(limits=1, user_api="blas"):
        yield


_within = threading.RLock()


@cache
def _blas() -> Any:
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _modes(motion: Motion, refined: int, degree: int, panel: float) -> Modes:
    mass, friction, stiffness = matrices(motion, degree, panel)
    # With the mass as unit.
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    curvature, basis = np.linalg.eigh(inverse @ (0.5 * (stiffness + stiffness.T)) @ inverse.T)
    kept = max(LEAST, int(np.searchsorted(curvature, BEYOND * 2.0**refined * (motion.reach + 1.0) ** 2)))
    basis = inverse.T @ basis[:, :kept]
    friction, stiffness = basis.T @ friction @ basis, basis.T @ stiffness @ basis
    size = len(friction)
    first_order = np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -friction]])
    if motion.drag or motion.fish[1]:
        sigma = np.linalg.eigvals(first_order)
        sigma = sigma[sigma.imag >= 0.0]
        return Modes(sigma, np.full(len(sigma), np.nan), -1)
    sigma, vectors = np.linalg.eig(first_order)
    upper = sigma.imag >= 0.0
    sigma, vectors = sigma[upper], vectors[:size, upper]
    moving = np.square(np.abs(vectors)).sum(0)
    held = np.einsum("im,ij,jm->m", vectors.conj(), stiffness, vectors).real / moving
    motion_energy = np.square(np.abs(sigma))
    return Modes(sigma, (motion_energy + held) / (motion_energy + np.abs(held)), int((curvature < 0.0).sum()))


def matrices(motion: Motion, degree: int, panel: float) -> tuple[Array, Array, Array]:
    """Matrices of sigma^2 M + sigma G + K.

    Parameters
    ----------
    motion : Motion
    degree : int
        Of the polynomials, >= 1.
    panel : float
        As `PANEL`.

    Returns
    -------
    M, G, K : ndarray, shape (unknowns, unknowns)
    """
    part = _panels(motion, degree, panel)
    panels, _, size = part.end.shape
    unknowns = panels * size
    # A bare tip is left out of the steps: so much cable.
    mass, pull = motion.fish[0] + motion.start[0] * motion.start[1], motion.fish[1] * PULL
    fish = (mass * np.eye(3), 2.0 * mass * S + pull, (mass * S + pull) @ S)
    ends = part.end.transpose(1, 0, 2).reshape(3, unknowns)
    number = np.repeat(np.arange(panels), size)
    higher = number[:, None] > number
    found = []
    for weight, tip in zip((part.mass, part.friction, part.force), fish, strict=True):
        # What is below a panel moves as one; the fish is the last of it. From the fish up.
        below = np.cumsum(np.concatenate([tip[None], weight.sum(1)]), axis=0)[:-1]
        moved, back = weight @ part.eta, np.swapaxes(weight, 2, 3) @ part.eta
        own = _product(part.eta, moved) + np.swapaxes(part.end, 1, 2) @ below @ part.end
        # With those above, which here move by their ends.
        right, left = moved.sum(1) + below @ part.end, back.sum(1) + np.swapaxes(below, 1, 2) @ part.end
        found.append((own, right, left))
    bent = part.bend @ part.slope
    stretched = (part.length * part.tension)[..., None, None] * part.slope
    own, right, left = found[2]
    found[2] = own + _product(part.slope, stretched) - _product(part.eta, bent), right - bent.sum(1), left
    all_of = []
    for own, right, left in found:
        flat = (side.transpose(1, 0, 2).reshape(3, unknowns) for side in (right, left))
        upper, lower = (np.where(higher, ends.T @ side, 0.0) for side in flat)
        full = upper + lower.T
        for j in range(panels):
            at = slice(j * size, (j + 1) * size)
            full[at, at] = own[j]
        all_of.append(full)
    return all_of[0], all_of[1], all_of[2]


def _product(one: Array, other: Array) -> Array:
    """Sums over the nodes and axes of each panel."""
    panels, size = len(one), one.shape[-1]
    return np.swapaxes(one.reshape(panels, -1, size), 1, 2) @ other.reshape(panels, -1, size)


def _panels(motion: Motion, degree: int, panel: float) -> _Panels:
    """From the fish up."""
    share, weights, integrals = _rule(degree + NODES)
    # From the upper end of the panel down.
    polynomials: Array = legendre.legvander(1.0 - 2.0 * share, degree)[:, None, :].astype(float)
    k, part, whole = _places(motion, _panel_of_step(motion, panel), share)
    values = (part[..., None, None] ** np.arange(motion.series.shape[1]) @ motion.series[k])[..., 0, :]
    P, TA, EP = (values[..., 1 + 9 * i : 10 + 9 * i].reshape(*k.shape, 3, 3) for i in range(3))
    length, tension = whole[:, None] * weights, values[..., 0]
    slope = _slopes(P, polynomials)
    drag, own = (length / tension)[..., None, None] * TA, length[..., None, None]
    return _Panels(
        slope,
        np.einsum("pqj,pjid->pqid", whole[:, None, None] * integrals, slope, optimize=True),
        np.einsum("pq,pqid->pid", length, slope),
        length,
        tension,
        own * np.eye(3),
        own * 2.0 * S + drag,
        (own * S + drag) @ S,
        own * EP,
    )


def _places(motion: Motion, panel_of: Integers, share: Array) -> tuple[Integers, Array, Array]:
    """Where shares of the length of each panel are, by the panels of the steps: number and part of the step, shape
    (panels, shares); and those lengths."""
    powers = np.arange(motion.series.shape[1])
    lengths = motion.series[:, :, 0] / (powers + 1) * motion.sizes[:, None]
    borders = np.concatenate([[0.0], np.cumsum(lengths.sum(1))])
    # Where panels begin, and the last one ends.
    starts = np.concatenate([np.flatnonzero(np.diff(panel_of, prepend=-1)), [len(panel_of)]])
    whole = np.diff(borders[starts])
    target = (borders[starts[:-1], None] + whole[:, None] * share).ravel()
    k = np.clip(np.searchsorted(borders, target, side="right") - 1, 0, len(panel_of) - 1)
    target -= borders[k]
    along, tension = lengths[k], motion.series[k, :, 0] * motion.sizes[k, None]
    low, high = np.zeros(len(k)), np.ones(len(k))
    part = np.full(len(k), 0.5)
    for _ in range(NEWTON):
        all_of = part[:, None] ** powers
        miss = (along * all_of).sum(1) * part - target
        low, high = np.where(miss < 0.0, part, low), np.where(miss < 0.0, high, part)
        trial = part - miss / (tension * all_of).sum(1)
        last, part = part, np.where((trial >= low) & (trial <= high), trial, 0.5 * (low + high))
        if np.abs(part - last).max() < PLACED:
            break
    shape = len(whole), len(share)
    return k.reshape(shape), part.reshape(shape), whole


def _panel_of_step(motion: Motion, panel: float) -> Integers:
    """Numbers of the panels that the steps belong to, from 0."""
    series = motion.series
    start, end = series[:, 0, :10], series[:, :, :10].sum(1)
    length = motion.sizes * 0.5 * (start[:, 0] + end[:, 0])
    turn = np.sqrt(0.5 * np.square(end[:, 1:] - start[:, 1:]).sum(1))
    phase = (1.0 + motion.reach) * motion.sizes * np.sqrt(0.5 * (start[:, 0] + end[:, 0]))
    change = 2.0 * turn + np.abs(np.log(end[:, 0] / start[:, 0])) + phase + length / length.sum()
    reached = np.cumsum(change)
    count = int(np.ceil(reached[-1] / panel))
    number = np.minimum(((reached - 0.5 * change) / reached[-1] * count).astype(int), count - 1)
    return np.unique(number, return_inverse=True)[1]


@cache
def _rule(nodes: int) -> tuple[Array, Array, Array]:
    """Gauss nodes and weights on [0, 1], and integrals from each node to 1 of the polynomials that are 1 at one."""
    x, w = legendre.leggauss(nodes)
    out = np.empty((len(x), len(x)))
    for j in range(len(x)):
        series = legendre.legint(legendre.legfit(x, np.eye(len(x))[j], len(x) - 1))
        out[:, j] = 0.5 * (legendre.legval(1.0, series) - legendre.legval(x, series))
    return 0.5 * (x + 1.0), 0.5 * w, out


def _slopes(P: Array, polynomials: Array) -> Array:
    """Two unit vectors across the cable, times polynomials: shape (panels, nodes, 3, functions)."""
    middle = np.linalg.eigh(P[:, P.shape[1] // 2])[1]
    n = (P @ middle[:, None, :, 2:])[..., 0]
    n /= np.linalg.norm(n, axis=-1, keepdims=True)
    b = (P @ middle[:, None, :, 1:2])[..., 0]
    b -= n * (n * b).sum(-1, keepdims=True)
    b /= np.linalg.norm(b, axis=-1, keepdims=True)
    return np.concatenate([n[..., None] * polynomials, b[..., None] * polynomials], axis=-1)
