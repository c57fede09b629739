"""Which shapes last: growth rates of small motions about the equilibria of one cable at one speed."""

from math import inf

import numpy as np

from towatlas.checks import check_speed
from towatlas.effort import TooMuchWork, check_patience, patience
from towatlas.kernels import status
from towatlas.results import Equilibria
from towatlas.results_motion import Stability
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.growth import REMEDY, Spectrum, has_drag, reach_of
from towatlas.solve.motion import TOGETHER, Motion, motions
from towatlas.solve.positions import with_fish_moved
from towatlas.system import System


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
        The fluid, as in `equilibria`; a vacuum by default.

    Returns
    -------
    Stability

    Raises
    ------
    ValueError
        For numbers out of range, and what is not one number.
    ArithmeticError
        If the shapes cannot be computed, or `towatlas.patience` allows for the growth rates of none (TooMuchWork); of
        the others those left over have the status UNFINISHED.

    Notes
    -----
    The motion is that of NRL Report 7048, Eqs. (12), (15b), linearised, seen from the turning tow point. Growth
    rates are zeros of the Evans function D(sigma) = det eta at the tow point of three solutions from the fish up. That
    none is missed: without drag all that grow have ``|sigma| <= gamma`` (docs/proofs.md, Theorem 9), and the pairs,
    quadruples and oscillations of negative energy add up to the number of directions in which the energy falls, in a
    vacuum the nodes and the zeros of dp/da along the shape (Theorem 7); with drag by the argument principle in
    ``|sigma| < 3 gamma``, which is not proved to hold all.

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
        If `towatlas.patience` allows for none of them; else those left over have the status UNFINISHED.

    Examples
    --------
    >>> from towatlas import equilibria
    >>> [str(kind) for kind in stability_of(equilibria(2.5, 0.0, 2.534)).kind]
    ['divergence', 'flutter', 'stable']
    """
    count, speed = len(found), abs(found.gamma)
    growth, frequency, error = (np.full(count, np.nan) for _ in range(3))
    unstable, index = np.full(count, -1), np.full(count, -1)
    codes = np.full(count, status.OK, np.int8)
    kinds, sigmas = ["unknown"] * count, [np.empty(0, np.complex128)] * count
    late: TooMuchWork | None = None
    with patience():
        # In case the patience ends: the one that is expected to be seen, then those of few nodes, which are quick.
        order = sorted(range(count), key=lambda k: (k != found.expected, found.nodes[k]))
        bodies: dict[int, tuple[Motion, Motion]] = {}
        for done, k in enumerate(order):
            try:
                check_patience("growth rates of the shapes", REMEDY, done=done, of=count)
                if k not in bodies:
                    bodies = bodies_of(found, order[done : done + TOGETHER])
                answer = spectrum_of(found, k, bodies[k])
            except TooMuchWork as reason:
                codes[k], late = status.UNFINISHED, late or reason
                continue
            codes[k], index[k], kinds[k], unstable[k] = answer.status, answer.index, answer.kind, answer.counted
            sigmas[k], error[k] = answer.roots.sigma * speed, answer.error * speed
            growth[k], frequency[k] = answer.leading.real * speed, answer.leading.imag * speed
    left = int((codes == status.UNFINISHED).sum())
    if late is not None and left == count:
        raise late
    scope = looked_at(found) + (
        f"; of {left} of {count} shapes none was looked for, as the patience ended" * (left > 0)
    )
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
        scope,
    )


def bodies_of(found: Equilibria, which: list[int]) -> dict[int, tuple[Motion, Motion]]:
    """Small motions about some of the equilibria, and had their fish been a little farther out.

    Parameters
    ----------
    found : Equilibria
    which : list of int

    Returns
    -------
    dict
        By their numbers, two of each.
    """
    r_f, gamma = found.r_f[which], np.full(len(which), found.gamma)
    systems = np.tile(found.system.row(), (len(which), 1))
    bodies = motions(r_f, gamma, systems, reach_of(found.system, found.gamma))
    moved = with_fish_moved(bodies, r_f, gamma, systems, found.error[which])
    return dict(zip(which, zip(bodies, moved, strict=True), strict=True))


def spectrum_of(found: Equilibria, k: int, bodies: tuple[Motion, Motion] | None = None) -> Spectrum:
    """Growth rates of one of some equilibria.

    Parameters
    ----------
    found : Equilibria
    k : int
        Which.
    bodies : (Motion, Motion), optional
        Those of `bodies_of`, where they are known.

    Returns
    -------
    Spectrum

    Raises
    ------
    TooMuchWork
        As `stability_of`.
    """
    energy = index_of(str(found.branch[k])) if found.system.in_vacuum else -1
    return Spectrum(found.system, found.gamma, float(found.r_f[k]), float(found.error[k]), energy, bodies)


def looked_at(found: Equilibria) -> str:
    """Which growth rates are looked for, in words.

    Parameters
    ----------
    found : Equilibria

    Returns
    -------
    str
    """
    if not has_drag(found.system):
        return "all growth rates: none is larger than gamma, and their number is that of the energy"
    reach = reach_of(found.system, found.gamma) * abs(found.gamma)
    return f"eigenvalues of size up to {reach:.4g}; that nothing faster grows is not proved"


def index_of(branch: str) -> int:
    """Directions in which the energy of a shape in a vacuum falls: nodes and zeros of dp/da together.

    Parameters
    ----------
    branch : str
        As of `Equilibria`.

    Returns
    -------
    int

    Notes
    -----
    docs/proofs.md, Theorem 7.
    """
    if branch == "outward":
        return 0
    n, member = branch.split()
    return 2 * int(n) - (member == "outer")
