"""All folds of a system as one of its numbers moves, wherever they come from."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_real, check_speed
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.results import Folds
from towatlas.solve.critical import solve_critical
from towatlas.solve.origins import numbers_of
from towatlas.solve.passed import folds_passed
from towatlas.solve.paths import SPACING, Path, trace
from towatlas.solve.shots import Integers
from towatlas.system import System


def folds(
    lam: float | Sequence[float],
    w_f: float | Sequence[float],
    gamma: float | Sequence[float],
    *,
    C: float | Sequence[float] = 0.0,
    m_f: float | None = None,
    C_f: float | Sequence[float] = 0.0,
    w: float = 1.0,
    C_t: float | Sequence[float] = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> Folds:
    """All folds of a towed cable in any medium, as its speed moves between two values, or one of its other numbers.

    At each of them the number of shapes changes by two: a cable that sits in one of the two has to jump.

    Parameters
    ----------
    lam : float or (float, float)
        Cable length over tow radius [-], > 0. Of lam, w_f, gamma, C, C_f and C_t exactly one is a pair (low, high):
        that one moves, the others stay.
    w_f : float or (float, float)
        Fish weight over (mu + rho A) g R [-]; its mass moves with it unless m_f is given.
    gamma : float or (float, float)
        Speed Omega sqrt(R/g) [-]; negative in a turn to port.
    C : float or (float, float)
        Drag constant of the cable [-], >= 0.
    m_f : float, optional
        Fish mass over (mu + rho A) R [-], >= 0; equal to w_f by default.
    C_f : float or (float, float)
        Drag constant of the fish [-], >= 0.
    w : float
        Weight of the cable [-], above -1, at most 1.
    C_t : float or (float, float)
        Tangential drag constant of the cable [-], >= 0.
    C_s, b_s : float
        Side force constant of a stranded cable, and the sine at which that force is largest [-], as of `equilibria`.

    Returns
    -------
    Folds
        In rising order of what moves.

    Raises
    ------
    ValueError
        For numbers out of range, and where not exactly one of them is a pair.

    Notes
    -----
    At a fold log rho = 0, rho the radius at the tow point over the tow radius, and its slope in log r_f is 0. All
    shapes are found at values SPACING apart in the logarithm and closer, until between neighbours nothing happens that
    the slopes of shapes and of extrema do not tell, or one fold. That none is missed is not proved: a pair of folds
    nearer to each other than that whose extremum none of the values shows would be.

    In a vacuum the folds in speed are the critical speeds gamma_cn, and proved to be all.

    References
    ----------
    The equations: NRL Report 7048, Eqs. (12)-(23).

    Examples
    --------
    >>> found = folds(16, 3, (2, 3), C=5.6)
    >>> [round(float(g), 6) for g in found.gamma], found.shapes_above.tolist(), str(found.origin[0])
    ([2.327475], [3], 'drag')
    """
    given = {"lam": lam, "w_f": w_f, "gamma": gamma, "C": C, "C_f": C_f, "C_t": C_t}
    arrays = {name: check_real(name, value) for name, value in given.items()}
    pairs = [name for name, array in arrays.items() if array.ndim]
    if len(pairs) != 1:
        raise ValueError(
            f"exactly one of {', '.join(given)} must be a pair (low, high), the one that moves; got {len(pairs)}"
        )
    (name,) = pairs
    ends = arrays[name]
    if ends.shape != (2,) or not np.isfinite(ends).all() or not ends[0] < ends[1] or not ends[0] * ends[1] > 0.0:
        raise ValueError(f"{name} must be two finite numbers of one sign, low < high, got {given[name]!r}")
    numbers = {key: float(array) if key != name else float(ends[0]) for key, array in arrays.items()}
    low, high = sorted(np.abs(ends))
    speed = check_speed(numbers.pop("gamma"))
    if name == "gamma":
        speed = float(np.copysign(low, speed))
    system = System.of(**numbers, m_f=m_f, w=w, C_s=C_s, b_s=b_s)
    moved = ("w_f", "m_f") if name == "w_f" and m_f is None else (name,)
    with patience():
        if name == "gamma":
            return folds_in_speed(system, speed, float(np.copysign(high, speed)))
        return solve_folds_between(system, speed, moved, high / low)


def folds_in_speed(system: System, low: float, high: float, named: bool = True) -> Folds:
    """Folds of a system between two speeds; no checks.

    Parameters
    ----------
    system : System
    low, high : float
        [-], of one sign, the slower first.
    named : bool
        Whether it is found out where each comes from, which takes longer than finding them; else `name_folds` does it.

    Returns
    -------
    Folds
    """
    if system.in_vacuum:
        return _in_vacuum(system, abs(low), abs(high), np.sign(low))
    return solve_folds_between(system, low, ("gamma",), high / low, named)


def name_folds(folds: Folds) -> Folds:
    """Folds in speed with n and origin.

    Parameters
    ----------
    folds : Folds
        From `folds_in_speed`; returned as they are where they are named.

    Returns
    -------
    Folds
    """
    if folds.system.in_vacuum or (folds.origin != "").all():
        return folds
    x = np.log(folds.r_f * np.square(folds.gamma))
    n = numbers_of(x, np.tile(folds.system.row(), (len(x), 1)), folds.gamma, folds.system.w_f >= 0.0)
    return replace(folds, n=n, origin=origin_of(n))


def origin_of(n: Integers) -> NDArray[np.str_]:
    """Where folds come from.

    Parameters
    ----------
    n : ndarray of int, shape (folds,)
        From `numbers_of`.

    Returns
    -------
    ndarray of str, shape (folds,)
        "vacuum" or "drag".
    """
    return np.where(n > 0, "vacuum", "drag").astype(np.str_)


def solve_folds_between(
    system: System, gamma: float, moved: tuple[str, ...], factor: float, named: bool = True
) -> Folds:
    """Folds from a system to what it becomes as some of its numbers grow by a factor; no checks.

    Parameters
    ----------
    system : System
    gamma : float
        Speed [-]; a turn to port where negative.
    moved : tuple of str
        "gamma", or names of numbers of the system.
    factor : float
        > 1.
    named : bool
        Whether it is found out where each comes from.

    Returns
    -------
    Folds
    """
    by_speed = moved == ("gamma",)
    path = Path(system.row(), gamma, moved)
    traced = trace(path, 0.0, float(np.log(factor)))
    found = [(fold, k) for k, fold in enumerate(traced.folds) if fold is not None]
    shapes = [len(column.x) for column in traced.columns]
    t, x = np.array([fold.t for fold, _ in found]), np.array([fold.x for fold, _ in found])
    rows, speeds = path.at(t)
    n = numbers_of(x, rows, speeds, named and system.w_f >= 0.0)
    first = gamma if by_speed else getattr(system, moved[0])
    name = moved[0]
    proof = (
        "that there are no others is not proved" if traced.certain else "not everywhere made out: some may be missing"
    )
    searched = (
        f"{name} {first:.6g} to {first * factor:.6g}, all shapes at {len(shapes)} values of it, at most {SPACING:g} "
        f"apart in its logarithm and closer until the shapes of neighbours were each other's; {proof}"
    )
    return Folds(
        system=system,
        moved=name,
        value=first * np.exp(t),
        gamma=speeds,
        r_f=np.exp(x) / np.square(speeds),
        shapes_below=np.array([shapes[k] for _, k in found], np.int64),
        shapes_above=np.array([shapes[k + 1] for _, k in found], np.int64),
        n=n,
        # Not found out is neither.
        origin=origin_of(n) if named else np.full(len(n), ""),
        error=np.array([fold.error for fold, _ in found]),
        status=np.full(len(t), status.OK, np.int8),
        complete=traced.certain,
        searched=searched,
    )


def _in_vacuum(system: System, low: float, high: float, sign: float) -> Folds:
    """Critical speeds between two: all there are."""
    passed = folds_passed(lam=np.full(2, system.lam), w_f=np.full(2, system.w_f), gamma=np.array([low, high]))
    n = np.arange(passed[0] + 1, passed[1] + 1)
    states = solve_critical(system.lam, system.w_f, n)
    return Folds(
        system=system,
        moved="gamma",
        value=sign * states.gamma,
        gamma=sign * states.gamma,
        r_f=np.abs(states.x_f),
        shapes_below=2 * n - 1,
        shapes_above=2 * n + 1,
        n=n,
        origin=np.full(len(n), "vacuum"),
        error=states.error,
        status=states.status,
        complete=True,
        searched=f"gamma {low:.6g} to {high:.6g}: all critical speeds of the vacuum, which are counted",
    )
