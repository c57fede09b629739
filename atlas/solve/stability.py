"""Which shapes last: growth rates of small motions about the equilibria of one cable at one speed."""

from math import inf

import numpy as np

from towatlas.checks import check_speed
from towatlas.effort import check_patience, patience
from towatlas.kernels import status
from towatlas.results import Equilibria, Stability
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.galerkin import Modes, modes
from towatlas.solve.motion import Motion, motions
from towatlas.solve.spectrum import EPS, Roots, count_growing, zeros_near
from towatlas.system import System

# |sigma| looked at, in units of Omega, without drag, where nothing beyond 1 grows, and with it; the latter rises by so
# many times the frequency of a hanging cable of this length, without which slow circles would see none of its modes.
REACH_CONSERVED, REACH, HANGING = 1.0, 3.0, 2.0
# Modes that damp faster than this, and than the leading one by this, are left as Galerkin's method has them, in units
# of Omega.
DAMPED = 0.3
# Below this, in units of Omega, growth is weak.
WEAK = 0.01
# Growth of a mode of Galerkin's that may be its error, and one that cannot; modes nearer to each other than this may
# meet within its error.
NOTHING, PLAINLY, MEETING = 1e-7, 1e-3, 0.02
REFINEMENTS = 4
REMEDY = "a shorter cable or a lower speed has fewer shapes and nodes"


def stability(
    lam: float,
    w_f: float,
    gamma: float,
    *,
    C: float = 0.0,
    m_f: float | None = None,
    C_f: float = 0.0,
    w: float = 1.0,
    C_t: float = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> Stability:
    """Growth rates of small motions about every equilibrium of a towed cable.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0.
    w_f : float
        Fish weight over (mu + rho A) g R [-].
    gamma : float
        Rotational frequency Omega sqrt(R/g) [-].
    C, m_f, C_f, w, C_t, C_s, b_s : float
        The fluid, as in `equilibria`; a vacuum by default. With a side force there is a status in place of an answer.

    Returns
    -------
    Stability

    Raises
    ------
    ValueError
        For numbers out of range, and what is not one number.
    ArithmeticError
        If the shapes cannot be computed, or the work takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    The motion is that of NRL Report 7048, Eqs. (12), (15b), linearised, seen from the turning tow point. Growth
    rates are zeros of the Evans function D(sigma) = det eta at the tow point of three solutions from the fish up. That
    none is missed: without drag all that grow have |sigma| <= gamma, and the pairs, quadruples and oscillations of
    negative energy add up to the number of directions in which the energy falls, in a vacuum the nodes and the zeros of
    dp/da along the shape; with drag by the argument principle in |sigma| < 3 gamma, which is not proved to hold all.

    Examples
    --------
    >>> found = stability(37.8, 1352, 5.94, C=0.018)
    >>> [str(kind) for kind in found.kind], [int(n) for n in found.unstable]
    (['divergence', 'flutter', 'stable'], [1, 2, 0])
    >>> round(float(found.growth[1]), 6), round(float(found.frequency[1]), 5)
    (0.15222, 2.56185)
    """
    system = System.of(lam, w_f, C=C, m_f=m_f, C_f=C_f, w=w, C_t=C_t, C_s=C_s, b_s=b_s)
    with patience():
        return stability_of(solve_equilibria(system, check_speed(gamma)))


def stability_of(found: Equilibria) -> Stability:
    """Growth rates of small motions about equilibria that are known.

    Parameters
    ----------
    found : Equilibria
        From `towatlas.equilibria`.

    Returns
    -------
    Stability
        In the order of the equilibria.

    Raises
    ------
    TooMuchWork
        If the work takes longer than `towatlas.patience` allows.

    Examples
    --------
    >>> from towatlas import equilibria
    >>> [str(kind) for kind in stability_of(equilibria(2.5, 0.0, 2.534)).kind]
    ['divergence', 'flutter', 'stable']
    """
    count, system = len(found), found.system
    speed = abs(found.gamma)
    growth, frequency, error = (np.full(count, np.nan) for _ in range(3))
    unstable, index = np.full(count, -1), np.full(count, -1)
    codes = np.full(count, status.OK, np.int8)
    kinds, sigmas = ["unknown"] * count, [np.empty(0, np.complex128)] * count
    if system.C_s != 0.0:
        codes[:] = status.NO_THEORY
    with patience():
        for k in np.flatnonzero(codes == status.OK):
            check_patience("growth rates of the shapes", REMEDY, done=int(k), of=count)
            answer = _Spectrum(found, int(k))
            codes[k], index[k] = answer.status, answer.index
            roots = answer.roots
            if codes[k] == status.OK:
                unstable[k] = answer.unstable
                kinds[k] = _kind(roots, answer.unstable)
            if len(roots):
                sigmas[k] = roots.sigma * speed
                growth[k], frequency[k] = sigmas[k][0].real, sigmas[k][0].imag
                error[k] = max(roots.error[0], found.error[k]) * speed
    return Stability(
        found,
        growth,
        frequency,
        unstable,
        index,
        np.array(kinds, np.str_),
        error,
        codes,
        tuple(sigmas),
        _looked_at(found),
    )


def _kind(roots: Roots, unstable: int) -> str:
    if unstable == 0:
        return "stable"
    leading = roots.sigma[0]
    if leading.real < WEAK:
        return "weak"
    return "divergence" if leading.imag == 0.0 else "flutter"


def _looked_at(found: Equilibria) -> str:
    if not _drag(found.system):
        return "all growth rates: none is larger than gamma, and their number is that of the energy"
    reach = reach_of(found.system, found.gamma) * abs(found.gamma)
    return f"eigenvalues of size up to {reach:.4g}; that nothing faster grows is not proved"


def reach_of(system: System, gamma: float) -> float:
    """Size of the growth rates that are looked at.

    Parameters
    ----------
    system : System
    gamma : float
        Speed [-].

    Returns
    -------
    float
        In units of Omega.
    """
    return REACH + HANGING / (abs(gamma) * np.sqrt(system.lam)) if _drag(system) else REACH_CONSERVED


def _drag(system: System) -> bool:
    return bool(system.C or system.C_f or system.C_t)


class _Spectrum:
    """Growth rates of one shape, in units of Omega, and how many grow."""

    def __init__(self, found: Equilibria, k: int):
        system = found.system
        self.drag = _drag(system)
        self.index = _index(str(found.branch[k])) if system.in_vacuum else -1
        self.roots = Roots(np.empty(0, np.complex128), np.empty(0))
        self.unstable = -1
        self.motion = lambda reach: motions(found.r_f[k : k + 1], np.array([found.gamma]), system.row()[None], reach)[0]
        motion = self.motion(reach_of(system, found.gamma))
        self.status = motion.status
        if motion.status != status.OK:
            return
        for refined in range(REFINEMENTS):
            check_patience("growth rates", REMEDY)
            guesses = modes(motion, refined)
            if self._counted(motion, guesses):
                self.status = status.OK
                return
            self.status = status.NOT_COUNTED
            if motion.fastest_flow > 1.0:
                self.status = status.FLOW_OUTRUNS_WAVES
                return
        if self.drag and not len(self.roots) and count_growing(motion, self.roots.sigma) == 0:
            # All is damped so strongly that Galerkin's method is no guess.
            self.status, self.unstable = status.OK, 0

    def _slowest(self, motion: Motion, guesses: Modes) -> Roots:
        """Where nothing grows: the slowest mode."""
        size = np.abs(guesses.sigma)
        slowest = size == size.min()
        if size.min() > motion.reach:
            motion = self.motion(1.1 * size.min())
        return zeros_near(motion, guesses, slowest)

    def _counted(self, motion: Motion, guesses: Modes) -> bool:
        return self._by_contour(motion, guesses) if self.drag else self._by_energy(motion, guesses)

    def _by_energy(self, motion: Motion, guesses: Modes) -> bool:
        """Without drag: real pairs, quadruples and oscillations of negative energy account for the index."""
        sigma, energy = guesses.sigma, guesses.energy
        right = sigma.real > NOTHING
        real = right & (np.abs(sigma.imag) < NOTHING)
        turning = np.abs(sigma.real) <= NOTHING
        negative = turning & (energy < 0.0)
        # Oscillations of either energy next to each other may be a quadruple, and the other way round.
        meeting = negative & (_to_nearest(sigma, turning & (energy > 0.0)) < MEETING)
        index = self.index if self.index >= 0 else guesses.index
        accounted = int(real.sum()) + 2 * int((right & ~real).sum()) + 2 * int(negative.sum())
        if guesses.index != index or accounted != index:
            return False
        if self.index < 0:
            self.index = index
        roots = zeros_near(motion, guesses, right | meeting)
        grows = roots.sigma.real > np.maximum(roots.error, 4.0 * EPS)
        some = Roots(roots.sigma[grows], roots.error[grows])
        if not grows.any():
            some = self._slowest(motion, guesses)
            some = Roots(some.sigma - some.sigma.real, some.error)
        self.roots = some
        self.unstable = int(np.where(some.sigma.imag == 0.0, 1, 2)[: grows.sum()].sum())
        # What plainly grows must be among them, and what does not comes in twos.
        plain = sigma[sigma.real > PLAINLY]
        least = int(np.where(np.abs(plain.imag) < NOTHING, 1, 2).sum())
        return least <= self.unstable <= index and (index - self.unstable) % 2 == 0

    def _by_contour(self, motion: Motion, guesses: Modes) -> bool:
        """With drag: as many zeros in the half disc as are known."""
        sigma = guesses.sigma
        near = np.abs(sigma) < 1.1 * motion.reach
        if near.any():
            damped = min(-DAMPED, sigma.real[near].max() - DAMPED)
            roots = zeros_near(motion, guesses, near & (sigma.real > damped))
        else:
            damped = -np.inf
            roots = self._slowest(motion, guesses)
        if not len(roots):
            return False
        self.roots = roots
        if motion.fastest_flow > 1.0:
            return False
        grows = (roots.sigma.real > roots.error) & (np.abs(roots.sigma) < motion.reach)
        self.unstable = int(np.where(roots.sigma[grows].imag == 0.0, 1, 2).sum())
        known = np.concatenate([roots.sigma, sigma[near & (sigma.real <= damped)]])
        count = count_growing(motion, known)
        inside = roots.sigma[(roots.sigma.real > 0.0) & (np.abs(roots.sigma) < motion.reach)]
        return count == int(np.where(inside.imag == 0.0, 1, 2).sum())


def _to_nearest(sigma: np.ndarray, among: np.ndarray) -> np.ndarray:
    if not among.any():
        return np.full(len(sigma), np.inf)
    return np.abs(sigma[:, None] - sigma[among]).min(axis=1)


def _index(branch: str) -> int:
    """Directions in which the energy of a shape in a vacuum falls: nodes and zeros of dp/da together."""
    if branch == "outward":
        return 0
    n, member = branch.split()
    return 2 * int(n) - (member == "outer")
