"""Growth rates of small motions as zeros of the Evans function."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from towatlas.solve.galerkin import Modes
from towatlas.solve.motion import Array, Complex, Integers, Motion

# Values at points, of so many guesses.
Function = Callable[[Integers, Complex], Complex]

EPS = 2.0**-52
ROUNDS = 12
# A guess is followed no further than this part of 1 + |sigma|, in units of Omega, nor than a part of the way to its
# neighbour.
FAR, OF_THE_WAY = 0.1, 0.4
# Guesses nearer to each other than this are solved for together, on a circle of so many points.
CLOSE, CIRCLE = 0.02, 32
# Of the zeros of a series on that circle, those within this part of it are right.
INSIDE = 0.6
# Zeros on a circle with errors beyond the first, over 1 + |sigma|, are looked for by secants from there; what these do
# not find, as double zeros, is kept where its error is less than the second.
SURE, VAGUE = 1e-12, 1e-6
# What is past the end of a series, which values on the circle show at lower orders, is less than the largest of so many
# of its last coefficients.
LAST = 3
# First difference of secants, over sigma; errors over 1 + |sigma| that are left, with the rough Evans function and the
# full one.
FIRST_STEP, ROUGH, FINE = 1e-4, 1e-5, 32.0 * EPS
# A determinant of solutions of unit length is known to rounding, times this a step: `benchmarks.growth_errors`.
NOISE = 8.0
# On the real axis: points between a share of the reach and all of it, and how often a change of sign is halved.
LEAST, ALONG, HALVINGS = 1e-5, 48, 6


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


@dataclass(frozen=True)
class Secants:
    """Where secants came to.

    Attributes
    ----------
    sigma : ndarray of complex, shape (guesses,)
        The last points.
    error : ndarray, shape (guesses,)
        Their distance from a zero, as the last two steps foretell it.
    slope : ndarray of complex, shape (guesses,)
        Of the function there.
    settled : ndarray of bool, shape (guesses,)
        Whether they stopped because that is small, and no farther from the guess than there was room.
    """

    sigma: Complex
    error: Array
    slope: Complex
    settled: NDArray[np.bool_]


def secants(
    function: Function,
    guesses: Complex,
    room: Array,
    small: float,
    slope: Complex | None = None,
    line: Complex | None = None,
) -> Secants:
    """Zeros of a function next to guesses, all of them side by side.

    Parameters
    ----------
    function : callable
        Of numbers of guesses and of points, which gives values there.
    guesses : ndarray of complex, shape (guesses,)
    room : ndarray, shape (guesses,)
        How far each may go, > 0: a part of the way to its neighbours.
    small : float
        An error over 1 + |sigma| that is small enough, > 0.
    slope : ndarray of complex, shape (guesses,), optional
        About that of the function, nan where not known.
    line : ndarray of complex, shape (guesses,), optional
        Directions of the lines that zeros lie on, 0 where on none.

    Returns
    -------
    Secants
    """
    new, error = guesses.copy(), np.full(len(guesses), np.inf)
    value = function(np.arange(len(new)), new)
    slope = np.full(len(new), np.nan + 0j) if slope is None else slope.copy()
    # What the slope is taken from is so far away.
    apart = room.copy()
    unknown = np.flatnonzero(np.isnan(slope))
    if len(unknown):
        step = FIRST_STEP * np.where(guesses[unknown] == 0.0, 1.0, guesses[unknown])
        slope[unknown] = (function(unknown, new[unknown] + step) - value[unknown]) / step
        apart[unknown] = np.abs(step)
    moving = np.arange(len(new))
    for _ in range(ROUNDS):
        with np.errstate(all="ignore"):
            change = np.where(value[moving] == 0.0, 0.0, -value[moving] / slope[moving])
        if line is not None:
            on = line[moving]
            change = np.where(on == 0.0, change, on * (change * on.conj()).real)
        sound = np.isfinite(change)
        moving, change = moving[sound], change[sound]
        new[moving] += change
        # Errors of secants multiply; those of their first slope are those of the point it is from.
        error[moving] = 4.0 * np.abs(change) * np.minimum(1.0, np.maximum(apart[moving], np.abs(change)) / room[moving])
        goes_on = (error[moving] > small * (1.0 + np.abs(new[moving]))) & (
            np.abs(new[moving] - guesses[moving]) <= room[moving]
        )
        moving, change = moving[goes_on], change[goes_on]
        if not len(moving):
            break
        before = value[moving]
        value[moving] = function(moving, new[moving])
        slope[moving] = (value[moving] - before) / change
        apart[moving] = np.abs(change)
    settled = (error <= small * (1.0 + np.abs(new))) & (np.abs(new - guesses) <= room)
    return Secants(new, error, slope, settled)


def room_of(guesses: Complex, others: Complex) -> Array:
    """How far guesses may be from their zeros.

    Parameters
    ----------
    guesses : ndarray of complex, shape (guesses,)
    others : ndarray of complex, shape (modes,)
        All guesses.

    Returns
    -------
    ndarray, shape (guesses,)
        In units of Omega.
    """
    apart = np.abs(guesses[:, None] - others)
    nearest = np.where(apart > 0.0, apart, np.inf).min(axis=1, initial=np.inf)
    return np.minimum(FAR * (1.0 + np.abs(guesses)), OF_THE_WAY * nearest)


def noise_of(steps: int | Integers, slope: Array, sigma: Complex) -> Array:
    """What rounding leaves of zeros.

    Parameters
    ----------
    steps : int or ndarray of int, shape (roots,)
        Of the shapes.
    slope : ndarray, shape (roots,)
        Size of the slope of D there.
    sigma : ndarray of complex, shape (roots,)

    Returns
    -------
    ndarray, shape (roots,)
        In units of Omega.
    """
    return np.asarray(NOISE * EPS * np.sqrt(steps) / slope + EPS * (1.0 + np.abs(sigma)))


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
    room, log = room_of(guesses, others), np.zeros(len(guesses))

    def function(which: Integers, sigma: Complex, rough: bool) -> Complex:
        values, logs = motion.evans(sigma, rough)
        if not log.any():
            log[:] = logs
        return values * np.exp(logs - log[which])

    near = secants(partial(function, rough=True), guesses, room, ROUGH)
    near_guesses = np.where(near.settled, near.sigma, guesses)
    slope = np.where(near.settled, near.slope, np.nan)
    found = secants(partial(function, rough=False), near_guesses, room, FINE, slope)
    noise = noise_of(len(motion.sizes), np.abs(found.slope), found.sigma)
    return Roots(found.sigma, np.maximum(found.error, noise)), found.settled & (np.abs(found.sigma - guesses) <= room)


def together(motion: Motion, centre: complex, radius: float, rough: bool = False) -> Roots:
    """All zeros in the inner part of a circle, from the Taylor series that values on it give: for those so close to
    each other that secants cannot tell them apart.

    Parameters
    ----------
    motion : Motion
    centre : complex
    radius : float
        In units of Omega, > 0.
    rough : bool
        As of `Motion.evans`.

    Returns
    -------
    Roots
    """
    turn = np.exp(2j * np.pi * np.arange(CIRCLE) / CIRCLE)
    values, logs = motion.evans(centre + radius * turn, rough)
    series = np.fft.fft(values * np.exp(logs - logs.max())) / CIRCLE
    # The highest first; the upper half of the coefficients is left out: rounding, or on a large circle not.
    out, series = np.abs(series[CIRCLE // 2 + 1 :]), series[CIRCLE // 2 :: -1]
    if complex(centre).imag == 0.0:
        # Real coefficients, so that what is real is so to the last bit.
        series.imag = 0.0
    sigma = np.roots(series.real if complex(centre).imag == 0.0 else series)
    sigma = sigma[np.abs(sigma) < INSIDE]
    slopes, curves = (np.abs(np.polyval(np.polyder(series, order), sigma)) for order in (1, 2))
    noise = (ROUGH if rough else NOISE * EPS * np.sqrt(len(motion.sizes))) * np.abs(series).max() + out[-LAST:].max()
    noise = noise + np.abs(sigma)[:, None] ** np.arange(CIRCLE // 2 + 1, CIRCLE) @ out
    # Of a double zero the square of the distance is known.
    error = radius * np.minimum(noise / np.maximum(slopes, 1e-300), np.sqrt(2.0 * noise / np.maximum(curves, 1e-300)))
    return Roots(centre + radius * sigma, error + EPS * (1.0 + np.abs(centre)))


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
    parts += [_sharpened(motion, _around(motion, guesses[group])) for group in again]
    return _distinct(np.concatenate([p.sigma for p in parts]), np.concatenate([p.error for p in parts]))


def _sharpened(motion: Motion, some: Roots) -> Roots:
    """Zeros from a circle; those that its series does not tell to rounding by secants, or left out if it does not tell
    them at all."""
    unsure = np.flatnonzero(some.error > SURE * (1.0 + np.abs(some.sigma)))
    roots, found = polish(motion, some.sigma[unsure], np.concatenate([some.sigma, some.sigma.conj()]))
    found &= roots.error < some.error[unsure]
    sigma, error = some.sigma.copy(), some.error.copy()
    sigma[unsure[found]], error[unsure[found]] = roots.sigma[found], roots.error[found]
    kept = error <= VAGUE
    return Roots(sigma[kept], error[kept])


def growing_real(motion: Motion, known: Roots) -> Roots:
    """Roots with those on the real axis up to the reach where D changes its sign.

    Parameters
    ----------
    motion : Motion
    known : Roots

    Returns
    -------
    Roots
        The leading one first.
    """
    ends = motion.reach * np.geomspace(LEAST, 1.0, ALONG)
    values, _ = motion.evans(ends.astype(complex))
    at = np.flatnonzero(np.signbit(values.real[1:]) != np.signbit(values.real[:-1]))
    low, high, falls = ends[at], ends[at + 1], np.signbit(values.real[at + 1])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        beyond = np.signbit(motion.evans(middle.astype(complex))[0].real) == falls
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    guesses = (0.5 * (low + high)).astype(complex)
    roots, found = polish(motion, guesses, np.concatenate([guesses, known.sigma]))
    return _distinct(
        np.concatenate([known.sigma, roots.sigma[found]]), np.concatenate([known.error, roots.error[found]])
    )


def _around(motion: Motion, guesses: Complex, rough: bool = False) -> Roots:
    """Zeros around some guesses that are close to each other, in the upper half of the plane."""
    centre = guesses.mean()
    spread = np.abs(guesses - centre).max()
    if np.abs(centre.imag) < 2.0 * CLOSE:
        centre = centre.real + 0j
    some = together(motion, centre, 3.0 * spread + 2.0 * CLOSE, rough)
    upper = some.sigma.imag >= -some.error
    return Roots(some.sigma[upper], some.error[upper])


def rough_zeros(motion: Motion, guesses: Complex, settled: NDArray[np.bool_]) -> Complex:
    """All zeros near guesses, those of the latter that did not settle from circles around them and what is close.

    Parameters
    ----------
    motion : Motion
    guesses : ndarray of complex, shape (guesses,)
    settled : ndarray of bool, shape (guesses,)
        Which of them are zeros.

    Returns
    -------
    ndarray of complex, shape (zeros,)
        In the upper half of the plane, those that had settled first.
    """
    found = [guesses[settled]]
    for group in _groups(guesses, np.flatnonzero(~settled)):
        new = _around(motion, guesses[group], rough=True)
        sigma = np.where(np.abs(new.sigma.imag) <= new.error, new.sigma.real + 0j, new.sigma)
        apart = np.abs(sigma[:, None] - np.concatenate(found)).min(axis=1, initial=np.inf)
        found.append(sigma[apart > CLOSE / 20.0])
    return np.concatenate(found)


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
