"""Growth rates of small motions as zeros of the Evans function, and a count of those that grow."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.solve.galerkin import Modes
from towatlas.solve.motion import Array, Complex, Motion

EPS = 2.0**-52
ROUNDS = 12
# A guess is followed no further than this part of 1 + |sigma|, in units of Omega, nor than a part of the way to its
# neighbour.
FAR, OF_THE_WAY = 0.1, 0.4
# Guesses nearer to each other than this are solved for together, on a circle of so many points.
CLOSE, CIRCLE = 0.02, 32
# Of the zeros of a series on that circle, those within this part of it are right.
INSIDE = 0.6
# First difference of secants.
FIRST_STEP = 1e-5
# Points of the contour at first, on the arc and on the axis, and at most in all; from one to the next the logarithm of
# what is left of D may change by no more than this.
POINTS, MOST_POINTS, LARGEST_CHANGE = 8, 4000, 0.8
# A determinant of solutions of unit length is known to rounding, times this a step.
NOISE = 4.0


@dataclass(frozen=True)
class Roots:
    """Growth rates found.

    Attributes
    ----------
    sigma : ndarray of complex, shape (roots,)
        In units of Omega.
    error : ndarray, shape (roots,)
        Estimated absolute error, > 0.
    """

    sigma: Complex
    error: Array

    def __len__(self) -> int:
        return len(self.sigma)


def polish(motion: Motion, guesses: Complex, others: Complex) -> tuple[Roots, NDArray[np.bool_]]:
    """Zeros of the Evans function next to guesses, by secants, all of them side by side.

    Parameters
    ----------
    motion : Motion
    guesses : ndarray of complex, shape (roots,)
        Real ones stay real.
    others : ndarray of complex, shape (modes,)
        All guesses: nobody goes over to a neighbour.

    Returns
    -------
    roots : Roots
    found : ndarray of bool, shape (roots,)
        Whether secants converged to a zero nearer to their guess than to others.
    """
    if not len(guesses):
        return Roots(guesses, np.empty(0)), np.empty(0, np.bool_)
    apart = np.abs(guesses[:, None] - others)
    room = np.minimum(
        FAR * (1.0 + np.abs(guesses)), OF_THE_WAY * np.where(apart > 0.0, apart, np.inf).min(axis=1, initial=np.inf)
    )
    old, new = guesses * (1.0 + FIRST_STEP), guesses.copy()
    values, logs = motion.evans(np.concatenate([old, new]))
    value_old, log_old = values[: len(old)], logs[: len(old)]
    value, log = values[len(old) :], logs[len(old) :]
    slope = np.ones(len(new), np.complex128)
    step = np.full(len(new), np.inf)
    for _ in range(ROUNDS):
        moving = (step > 4.0 * EPS * np.abs(new)) & (np.abs(new - guesses) <= room) & (value != 0.0)
        if not moving.any():
            break
        difference = new - old
        with np.errstate(all="ignore"):
            rate = (value - value_old * np.exp(log_old - log)) / difference
            change = -value / rate
        # The last difference that tells a slope from rounding.
        slope = np.where(moving & (np.abs(difference) > 0.01 * FIRST_STEP), rate, slope)
        change = np.where(moving & np.isfinite(change), change, 0.0)
        old, value_old, log_old = np.where(moving, new, old), value, log
        new = new + change
        step = np.where(moving, np.abs(change), step)
        at, scales = motion.evans(new[moving])
        value, log = value.copy(), log.copy()
        value[moving], log[moving] = at, scales
    settled = (step <= 64.0 * EPS * np.maximum(1.0, np.abs(new))) | (value == 0.0)
    noise = NOISE * EPS * np.sqrt(len(motion.sizes)) / np.abs(slope)
    return Roots(new, np.maximum(step, noise)), settled & (np.abs(new - guesses) <= room)


def together(motion: Motion, centre: complex, radius: float) -> Roots:
    """All zeros in the inner part of a circle, from the Taylor series that values on it give: for those so close to
    each other that secants cannot tell them apart.

    Parameters
    ----------
    motion : Motion
    centre : complex
    radius : float
        In units of Omega, > 0.

    Returns
    -------
    Roots
    """
    turn = np.exp(2j * np.pi * np.arange(CIRCLE) / CIRCLE)
    values, logs = motion.evans(centre + radius * turn)
    series = np.fft.fft(values * np.exp(logs - logs.max())) / CIRCLE
    # The highest first; the upper half of the coefficients is rounding.
    series = series[CIRCLE // 2 :: -1]
    if complex(centre).imag == 0.0:
        # Real coefficients, so that what is real is so to the last bit.
        series.imag = 0.0
    sigma = np.roots(series.real if complex(centre).imag == 0.0 else series)
    sigma = sigma[np.abs(sigma) < INSIDE]
    slopes, curves = (np.abs(np.polyval(np.polyder(series, order), sigma)) for order in (1, 2))
    noise = NOISE * EPS * np.sqrt(len(motion.sizes)) * np.abs(series).max()
    # Of a double zero the square of the distance is known.
    error = radius * np.minimum(noise / np.maximum(slopes, 1e-300), np.sqrt(2.0 * noise / np.maximum(curves, 1e-300)))
    return Roots(centre + radius * sigma, error)


def zeros_near(motion: Motion, found: Modes, wanted: NDArray[np.bool_]) -> Roots:
    """Zeros next to the modes that are wanted.

    Parameters
    ----------
    motion : Motion
    found : Modes
    wanted : ndarray of bool, shape (modes,)

    Returns
    -------
    Roots
        In the upper half of the plane.
    """
    guesses = np.where(np.abs(found.sigma.imag) < 1e-9, found.sigma.real + 0j, found.sigma)
    mirrored = np.concatenate([guesses, guesses.conj()])
    groups = _groups(guesses, np.flatnonzero(wanted))
    alone = np.array([group[0] for group in groups if len(group) == 1], np.int64)
    roots, good = polish(motion, guesses[alone], mirrored)
    parts = [Roots(roots.sigma[good], roots.error[good])]
    again = [np.array([k]) for k in alone[~good]] + [group for group in groups if len(group) > 1]
    for group in again:
        centre = guesses[group].mean()
        spread = np.abs(guesses[group] - centre).max()
        if np.abs(centre.imag) < 2.0 * CLOSE:
            centre = centre.real + 0j
        some = together(motion, centre, 3.0 * spread + 2.0 * CLOSE)
        upper = some.sigma.imag >= -some.error
        parts.append(Roots(some.sigma[upper], some.error[upper]))
    return _distinct(np.concatenate([p.sigma for p in parts]), np.concatenate([p.error for p in parts]))


def _groups(guesses: Complex, wanted: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """The wanted guesses, those close to each other together with what else is close."""
    groups: list[NDArray[np.int64]] = []
    seen: set[int] = set()
    for k in wanted:
        if int(k) in seen:
            continue
        group = {int(k)}
        while True:
            near = np.abs(guesses[:, None] - guesses[sorted(group)]).min(axis=1) < CLOSE
            larger = set(np.flatnonzero(near).tolist())
            if larger == group:
                break
            group |= larger
        seen |= group
        groups.append(np.array(sorted(group)))
    return groups


def _distinct(sigma: Complex, error: Array) -> Roots:
    """Each root once: circles that overlap find some twice."""
    kept: list[int] = []
    for k in np.argsort(error):
        same = 8.0 * (error[k] + error[kept]) + 1e-12
        if not (np.abs(sigma[k] - sigma[kept]) < same).any():
            kept.append(int(k))
    order = sorted(kept, key=lambda k: (-sigma[k].real, abs(sigma[k].imag)))
    return Roots(sigma[order], error[order])


def count_growing(motion: Motion, known: Complex) -> int | None:
    """Zeros in the half disc |sigma| < reach, Re sigma > 0, by the argument principle.

    Parameters
    ----------
    motion : Motion
    known : ndarray of complex, shape (roots,)
        Zeros in the upper half of the plane, those next to the contour accurate: D is divided by them, so that its
        phase turns slowly.

    Returns
    -------
    int or None
        None where too many points would be needed, as where a zero lies on the contour that is not known.
    """
    R = motion.reach
    zeros = np.concatenate([known, known[known.imag != 0.0].conj()])

    def at(t: Array) -> Complex:
        # From R along the arc to iR, then down to 0: the other half is its mirror image.
        arc = R * np.exp(0.5j * np.pi * np.minimum(t, 1.0))
        return np.where(t <= 1.0, arc, 1j * R * np.maximum(2.0 - t, 0.0))

    def others(sigma: Complex) -> tuple[Complex, Array]:
        """D over the factors of the zeros that are known: its phase, and the logarithm of its size."""
        values, logs = motion.evans(sigma)
        for zero in zeros:
            away = sigma - zero
            values = values / np.where(away == 0.0, 1.0, away)
        size = np.abs(values)
        return values / size, logs + np.log(size)

    # What grows by a factor of e from one side of the disc to the other turns by a radian on its way around.
    growth = float(np.ptp(others(np.array([-R, 0.0, R]))[1]))
    each = POINTS + len(zeros) // 2 + int(min(growth / LARGEST_CHANGE, MOST_POINTS))
    t = np.concatenate([np.linspace(0.0, 1.0, each, endpoint=False), np.linspace(1.0, 2.0, each)])
    ends = np.stack([t[:-1], t[1:]])
    phase, size = others(at(t))
    phases, sizes = np.stack([phase[:-1], phase[1:]]), np.stack([size[:-1], size[1:]])
    total, points = 0.0, len(t)
    while ends.size:
        points += ends.shape[1]
        if points > MOST_POINTS:
            return None
        middle = ends.mean(axis=0)
        phase, size = others(at(middle))
        turns = np.angle(np.stack([phase / phases[0], phases[1] / phase]))
        # Two zeros close beside the contour turn the phase by all but nothing between two points; the size, of one of
        # the two halves at least, tells.
        changes = np.hypot(turns, sizes - size)
        good = changes.max(axis=0) < LARGEST_CHANGE
        total += turns[:, good].sum()
        halves = [np.stack([ends[0], middle]), np.stack([middle, ends[1]])]
        phases = np.concatenate([np.stack([phases[0], phase]), np.stack([phase, phases[1]])], axis=1)
        sizes = np.concatenate([np.stack([sizes[0], size]), np.stack([size, sizes[1]])], axis=1)
        split = np.tile(~good, 2)
        ends, phases, sizes = np.concatenate(halves, axis=1)[:, split], phases[:, split], sizes[:, split]
    inside = (zeros.real > 0.0) & (np.abs(zeros) < R)
    winding = total / np.pi
    if abs(winding - np.round(winding)) > 0.1:
        return None
    return int(np.round(winding)) + int(inside.sum())
