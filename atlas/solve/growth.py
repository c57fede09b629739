"""Growth rates of one shape, and how many of them grow."""

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import TooMuchWork, check_patience
from towatlas.kernels import status
from towatlas.solve.galerkin import Modes, modes
from towatlas.solve.motion import Array, Complex, Motion, motions
from towatlas.solve.positions import errors_with_fish, with_fish_moved
from towatlas.solve.spectrum import Roots, growing_real, zeros_near
from towatlas.solve.winding import count_growing
from towatlas.system import System

# |sigma| looked at, in units of Omega, without drag, where nothing beyond 1 grows, and with it; the latter rises by so
# many times the frequency of a hanging cable of this length, without which slow circles would see none of its modes.
REACH_CONSERVED, REACH, HANGING = 1.0, 3.0, 2.0
# Modes that damp faster than this, and than the leading one by this, are left as Galerkin's method has them, in units
# of Omega; the second where Galerkin's method is far off: where there is no zero of D next to what is in the first, or
# the flow outruns waves.
DAMPED = 0.02, 0.1
# |sigma| of modes of Galerkin's method, over the reach, that D is divided by where it is counted.
AROUND = 2.0
# Below this, in units of Omega, growth is weak.
WEAK = 0.01
# Growth that rounding cannot be told from.
STILL = 1e-13
# Growth of a mode of Galerkin's that may be its error, and one that cannot; modes nearer to each other than this may
# meet within its error.
NOTHING, PLAINLY, MEETING = 1e-7, 1e-3, 0.02
REFINEMENTS = 4
REMEDY = "a shorter cable or a lower speed has fewer shapes and nodes"


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
    drag = np.array([has_drag(system)])
    return float(reach_at(lam=np.array([system.lam]), gamma=np.array([gamma]), drag=drag)[0])


def reach_at(*, lam: Array, gamma: Array, drag: NDArray[np.bool_]) -> Array:
    """The same of many shapes.

    Parameters
    ----------
    lam, gamma : ndarray, shape (shapes,)
        Lengths and speeds [-].
    drag : ndarray of bool, shape (shapes,)
        Whether the fluid does work.

    Returns
    -------
    ndarray, shape (shapes,)
    """
    return np.where(drag, REACH + HANGING / (np.abs(gamma) * np.sqrt(lam)), REACH_CONSERVED)


def kind_of(unstable: int, leading: complex, error: float) -> str:
    """What a shape is, as of `towatlas.results_motion.Stability`.

    Parameters
    ----------
    unstable : int
        How many growth rates grow; -1 if not counted.
    leading : complex
        The leading one, in units of Omega; nan where there is none.
    error : float
        Its error, with what it moves by as the fish does.

    Returns
    -------
    str
    """
    if unstable == 0:
        return "stable"
    # What was found to grow does so, whether all that grow were counted or not.
    if not leading.real > max(STILL, error):
        return "unknown"
    if leading.real < WEAK:
        return "weak"
    return "divergence" if leading.imag == 0.0 else "flutter"


def has_drag(system: System) -> bool:
    """Whether the fluid does work on motions.

    Parameters
    ----------
    system : System

    Returns
    -------
    bool
    """
    return bool(system.C or system.C_f or system.C_t or system.C_s)


class Spectrum:
    """Growth rates of one shape, in units of Omega, and how many grow.

    Parameters
    ----------
    system : System
    gamma : float
        Speed [-].
    r_f : float
        Distance of the fish from the axis over tow radius [-], > 0.
    relative : float
        Error of r_f over r_f [-], > 0.
    index : int
        In a vacuum the number of directions in which the energy falls; -1 if not known.
    bodies : (Motion, Motion), optional
        That of the shape, for sigma up to `reach_of`, and by `with_fish_moved`, where they are known.

    Attributes
    ----------
    roots : Roots
        The leading one first.
    unstable : int
        How many grow, conjugate ones counted each; -1 if not counted.
    index : int
        Without drag as above.
    status : int
        A code of `towatlas.kernels.status`.
    error : float
        Of the leading root: its own, and by how much it moves as the fish does by its error; nan where there is none.
    guesses : Modes or None
        The last of Galerkin's method.
    rest : ndarray of complex, shape (modes,)
        In a fluid other modes of Galerkin's method: what damps faster than the roots, or is beyond the reach.
    reach : float
        As of `reach_of`.
    """

    def __init__(
        self,
        system: System,
        gamma: float,
        r_f: float,
        relative: float,
        index: int = -1,
        bodies: tuple[Motion, Motion] | None = None,
    ):
        self.drag = has_drag(system)
        self.index = index
        self.roots = Roots(np.empty(0, np.complex128), np.empty(0))
        self.unstable = -1
        self.guesses: Modes | None = None
        self.rest = np.empty(0, np.complex128)
        self.reach = reach_of(system, gamma)
        self.motion = lambda reach: motions(np.array([r_f]), np.array([gamma]), system.row()[None], reach)[0]
        check_patience("growth rates", REMEDY)
        at = np.array([r_f]), np.array([gamma]), system.row()[None], np.array([relative])
        motion = bodies[0] if bodies else self.motion(self.reach)
        self.status, self.error = motion.status, np.nan
        if motion.status != status.OK:
            return
        self._find(motion)
        if len(self.roots):
            moved = bodies[1] if bodies else with_fish_moved([motion], *at)[0]
            move = errors_with_fish([motion], [moved], self.roots.sigma[:1], at[-1])
            self.error = float(self.roots.error[0] + move[0])

    def _find(self, motion: Motion) -> None:
        for refined in range(REFINEMENTS):
            try:
                check_patience("growth rates", REMEDY)
                guesses = self.guesses = modes(motion, refined)
            except TooMuchWork:
                # What is known already is told, as not counted.
                if not len(self.roots):
                    raise
                return
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

    @property
    def leading(self) -> complex:
        """The leading root, nan where there is none."""
        return complex(self.roots.sigma[0]) if len(self.roots) else complex(np.nan, np.nan)

    @property
    def counted(self) -> int:
        """How many grow, -1 where that is not all of them."""
        return self.unstable if self.status == status.OK else -1

    @property
    def kind(self) -> str:
        """As of `towatlas.results_motion.Stability`."""
        return kind_of(self.counted, self.leading, self.error)

    @property
    def growing(self) -> Complex:
        """Those that grow, with frequencies >= 0, where they were counted and the leading one is known to."""
        sigma = self.roots.sigma
        known = self.unstable > 0 and self.kind != "unknown"
        return sigma[sigma.real > np.maximum(self.roots.error, STILL)] if known else sigma[:0]

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
        grows = roots.sigma.real > np.maximum(roots.error, STILL)
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
            leading = min(0.0, float(sigma.real[near].max()))
            narrow, wide = DAMPED
            slow = near & (sigma.real > leading - (narrow if motion.fastest_flow <= 1.0 else wide))
            roots = zeros_near(motion, guesses, slow)
            if not len(roots):
                slow = near & (sigma.real > leading - wide)
                roots = zeros_near(motion, guesses, slow)
            self.rest = sigma[(np.abs(sigma) < AROUND * motion.reach) & ~slow]
        else:
            roots, self.rest = self._slowest(motion, guesses), sigma[:0]
        if self._all_inside(motion, roots):
            return True
        if motion.fastest_flow > 1.0:
            return False
        # Where drag is strong Galerkin's method is no guess of what grows slowly beside a fold.
        more = growing_real(motion, roots)
        return len(more) > len(roots) and self._all_inside(motion, more)

    def _all_inside(self, motion: Motion, roots: Roots) -> bool:
        """Whether there are no other zeros in the half disc than these."""
        if not len(roots):
            return False
        self.roots = roots
        if motion.fastest_flow > 1.0:
            return False
        grows = (roots.sigma.real > np.maximum(roots.error, STILL)) & (np.abs(roots.sigma) < motion.reach)
        self.unstable = int(np.where(roots.sigma[grows].imag == 0.0, 1, 2).sum())
        count = count_growing(motion, np.concatenate([roots.sigma, self.rest]))
        inside = roots.sigma[(roots.sigma.real > 0.0) & (np.abs(roots.sigma) < motion.reach)]
        return count == int(np.where(inside.imag == 0.0, 1, 2).sum())


def _to_nearest(sigma: Complex, among: NDArray[np.bool_]) -> Array:
    if not among.any():
        return np.full(len(sigma), np.inf)
    return np.abs(sigma[:, None] - sigma[among]).min(axis=1)
