"""How many zeros the Evans function has in a region, by the argument principle, of many shapes side by side.

D is divided by the zeros that are known, and by the exponential of a polynomial, which has none: what is left turns
slowly along the contour, so that few points tell how often it goes around.
"""

from collections.abc import Sequence

import numpy as np

from towatlas.solve.motion import Array, Complex, Integers, Motion, Motions

# Points on each part of the contour at first, and at most in all; from one to the next the logarithm of what is left
# of D may change by no more than this.
POINTS, MOST_POINTS, LARGEST_CHANGE = 7, 4000, 0.8
# Of the polynomial.
DEGREE = 4


def count_growing(motion: Motion, known: Complex) -> int | None:
    """Zeros in the half disc |sigma| < reach, Re sigma > 0.

    Parameters
    ----------
    motion : Motion
    known : ndarray of complex, shape (roots,)
        Zeros in the upper half of the plane, those next to the contour accurate.

    Returns
    -------
    int or None
        None where too many points would be needed, as where a zero lies on the contour that is not known.
    """
    count = int(count_zeros(Motions([motion]), [known], np.zeros(1))[0])
    return None if count < 0 else count


# Where D is 0 to the last bit on the contour, there is no count.
@np.errstate(divide="ignore", invalid="ignore")
def count_zeros(motions: Motions, known: Sequence[Complex], left: Array | None) -> Integers:
    """Zeros in the part of the disc |sigma| < reach with Re sigma > left, or without drag in all of it.

    Parameters
    ----------
    motions : Motions
    known : sequence of ndarray of complex, shape (shapes,)
        Zeros in the upper half of the plane, those next to the contour accurate.
    left : ndarray, shape (shapes,), optional
        None without drag, where zeros come with their mirror images in both axes.

    Returns
    -------
    ndarray of int, shape (shapes,)
        -1 where too many points would be needed.
    """
    contour = _Contours(motions, known, left)
    end = contour.end
    each = end * POINTS + max(len(zeros) for zeros in known) // 4
    t = np.tile(np.linspace(0.0, end, each), len(known))
    owner = np.repeat(np.arange(len(known)), each)
    phase, size = contour.flatten(owner, t)
    goes_on = owner[1:] == owner[:-1]
    owner = owner[:-1][goes_on]
    ends, phases, sizes = (np.stack([column[:-1], column[1:]])[:, goes_on] for column in (t, phase, size))
    total, points = np.zeros(len(known)), np.full(len(known), each)
    while owner.size:
        points += np.bincount(owner, minlength=len(known))
        within = points[owner] <= MOST_POINTS
        if not within.all():
            total[owner[~within]] = np.nan
            owner = owner[within]
            ends, phases, sizes = (column[:, within] for column in (ends, phases, sizes))
            continue
        middle = ends.mean(axis=0)
        phase, size = contour.rest(owner, middle)
        turns = np.angle(np.stack([phase / phases[0], phases[1] / phase]))
        # Two zeros close beside the contour turn the phase by all but nothing between two points; the size, of one of
        # the two halves at least, tells.
        changes = np.hypot(turns, sizes - size)
        good = changes.max(axis=0) < LARGEST_CHANGE
        np.add.at(total, owner[good], turns[:, good].sum(axis=0))
        split = np.tile(~good, 2)
        parts = (
            np.concatenate([np.stack([ends[0], middle]), np.stack([middle, ends[1]])], axis=1),
            np.concatenate([np.stack([phases[0], phase]), np.stack([phase, phases[1]])], axis=1),
            np.concatenate([np.stack([sizes[0], size]), np.stack([size, sizes[1]])], axis=1),
        )
        owner = np.tile(owner, 2)[split]
        order = np.argsort(owner, kind="stable")
        owner = owner[order]
        ends, phases, sizes = (part[:, split][:, order] for part in parts)
    winding = total / (np.pi if left is not None else 0.5 * np.pi)
    sound = np.abs(winding - np.round(winding)) < 0.1
    return np.where(sound, np.round(np.where(sound, winding, 0.0)).astype(np.int64) + contour.inside(), -1)


class _Contours:
    """Upper halves of contours from the reach of each shape along the arc and down to the real axis; without drag the
    arc to the imaginary axis alone, of which the rest is mirror images."""

    def __init__(self, motions: Motions, known: Sequence[Complex], left: Array | None):
        self.motions, self.left = motions, left
        self.reach = np.array([motion.reach for motion in motions.each])
        self.end = 1 if left is None else 2
        images = [_images(zeros, conserved=left is None) for zeros in known]
        self.zeros = np.full((len(known), max(len(zeros) for zeros in images)), np.nan + 0j)
        for row, zeros in zip(self.zeros, images, strict=True):
            row[: len(zeros)] = zeros
        self.coefficients = np.zeros((len(known), DEGREE))

    def inside(self) -> Integers:
        """How many of the zeros that are known are inside."""
        within = np.abs(self.zeros) < self.reach[:, None]
        if self.left is not None:
            within &= self.zeros.real > self.left[:, None]
        return np.asarray(within.sum(axis=1))

    def sigma(self, owner: Integers, t: Array) -> Complex:
        """Points at 0 to 1 along the arc, at 1 to 2 down to the real axis."""
        R = self.reach[owner]
        if self.left is None:
            return np.asarray(R * np.exp(0.5j * np.pi * t))
        left = self.left[owner]
        arc = R * np.exp(1j * np.arccos(left / R) * np.minimum(t, 1.0))
        return np.where(t <= 1.0, arc, left + 1j * np.sqrt(R * R - left * left) * np.maximum(2.0 - t, 0.0))

    def powers(self, owner: Integers, sigma: Complex) -> Complex:
        """What the polynomials are made of; without drag even ones."""
        step = sigma / self.reach[owner]
        return np.asarray((step if self.left is not None else step * step)[:, None] ** np.arange(1, DEGREE + 1))

    def rest(self, owner: Integers, t: Array) -> tuple[Complex, Array]:
        """What is left of D: its phase, and the logarithm of its size."""
        sigma = self.sigma(owner, t)
        values, logs = self.motions.evans(owner, sigma, rough=True)
        away = sigma[:, None] - self.zeros[owner]
        away[np.isnan(away) | (away == 0.0)] = 1.0
        far, taken = np.abs(away), (self.powers(owner, sigma) * self.coefficients[owner]).sum(axis=1)
        size = np.abs(values)
        phase = values / size / (away / far).prod(axis=1) * np.exp(-1j * taken.imag)
        return phase, logs + np.log(size) - np.log(far).sum(axis=1) - taken.real

    def flatten(self, owner: Integers, t: Array) -> tuple[Complex, Array]:
        """The same, by the polynomials through what is left there."""
        phase, size = self.rest(owner, t)
        sigma = self.sigma(owner, t)
        shape = (len(self.zeros), -1)
        powers = self.powers(owner, sigma).reshape(*shape, DEGREE)
        # The larger part of it, from the sizes at both ends, so that phases are known beyond a turn.
        sizes = size.reshape(shape)
        slope = (sizes[:, 0] - sizes[:, -1]) / (powers[:, 0, 0] - powers[:, -1, 0]).real
        turned = np.angle(phase).reshape(shape) - slope[:, None] * powers[:, :, 0].imag
        turned = np.unwrap(turned, axis=1) + slope[:, None] * powers[:, :, 0].imag
        right = np.concatenate([sizes - sizes[:, :1], turned - turned[:, :1]], axis=1)
        both = np.concatenate([powers.real - powers[:, :1].real, powers.imag], axis=1)
        self.coefficients = (np.linalg.pinv(both) @ right[:, :, None])[:, :, 0]
        taken = (powers @ self.coefficients[:, :, None]).ravel()
        return phase * np.exp(-1j * taken.imag), size - taken.real


def _images(zeros: Complex, conserved: bool) -> Complex:
    """With their mirror images."""
    every = np.concatenate([zeros, zeros[zeros.imag != 0.0].conj()])
    return np.concatenate([every, -every[every.real != 0.0]]) if conserved else every
