"""Cusps of a system as its speed and one other of its numbers move: where two folds meet and are gone."""

from collections.abc import Sequence
from math import inf

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_real, check_speed
from towatlas.effort import check_patience, patience
from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS
from towatlas.numerics.curves import Steps, follow
from towatlas.numerics.rows import EPS, newton, solve_systems
from towatlas.results import Cusps
from towatlas.solve.folds import folds_in_speed
from towatlas.solve.jets import jets_of
from towatlas.solve.shots import REMEDY, Array, Integers, direction_of, shoot
from towatlas.system import System

FOLD = jets_of(2, gamma=True, parameter=True)
CUSP = jets_of(3, gamma=True, parameter=True)
# Values of the other number at which all folds are found, as starts of their curves: this far apart in its logarithm.
SPACING, FEWEST = 0.25, 5
STEPS = Steps(first=0.2, longest=1.0, shortest=1e-4)
# How far, in logarithms, curves go on beyond the range; cusps nearer than this are one.
MARGIN, SAME = 0.05, 1e-6
ROUNDS, ROUNDINGS = 16, 64.0

Booleans = NDArray[np.bool_]


def cusp_equations(x: Array, gamma: Array, rows: Array, directions: Array) -> tuple[Array, Array, Booleans]:
    """log rho and its first two slopes in log r, and their Jacobian in log r, log gamma and a number of the system.

    Parameters
    ----------
    x, gamma : ndarray, shape (points,)
        log r of the fish, over g / Omega^2, and speed.
    rows, directions : ndarray, shape (points, columns)
        Systems, and how they move with the logarithm of the number.

    Returns
    -------
    ndarray, shape (points, 3)
    ndarray, shape (points, 3, 3)
    ndarray of bool, shape (points,)
        Which shots were made.
    """
    at = CUSP.at
    ends = shoot(np.exp(x), gamma, rows, CUSP, directions=directions)
    jet = ends.log_rho
    along = [((k + 1) * jet[:, at(k + 1, 0, 0)], jet[:, at(k, 1, 0)], jet[:, at(k, 0, 1)]) for k in range(3)]
    sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1)
    value = jet[:, [at(k, 0, 0) for k in range(3)]]
    return value, np.stack([np.stack(row, axis=1) for row in along], axis=1), sound


def cusp_errors(value: Array, jacobian: Array) -> Array:
    """Estimated errors of the logarithms of speed and number at cusps, from what `cusp_equations` says there.

    Parameters
    ----------
    value : ndarray, shape (points, 3)
    jacobian : ndarray, shape (points, 3, 3)

    Returns
    -------
    ndarray, shape (points, 2)
        Twice what one more step of Newton would move them by, and rounding.
    """
    step = solve_systems(jacobian, -value)
    # log rho and its slope alone fix speed and number at the cusp: what their rounding moves these by.
    along, bent = jacobian[:, 0], jacobian[:, 1]
    with np.errstate(all="ignore"):
        determinant = np.abs(along[:, 1] * bent[:, 2] - along[:, 2] * bent[:, 1])
        rounding = ROUNDINGS * EPS * (np.abs(along[:, [2, 1]]) + np.abs(bent[:, [2, 1]])) / determinant[:, None]
    return 2.0 * np.abs(step[:, 1:]) + rounding


def cusps(
    lam: float | Sequence[float],
    w_f: float | Sequence[float],
    gamma: Sequence[float],
    *,
    C: float | Sequence[float] = 0.0,
    m_f: float | None = None,
    C_f: float | Sequence[float] = 0.0,
    w: float = 1.0,
    C_t: float | Sequence[float] = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> Cusps:
    """Cusps of a towed cable in any medium, as its speed and one other of its numbers move between two values each.

    On one side of a cusp there are two folds, and two shapes more between; on the other the shape changes smoothly.

    Parameters
    ----------
    lam : float or (float, float)
        Cable length over tow radius [-], > 0. Of lam, w_f, C, C_f and C_t exactly one is a pair (low, high), both > 0.
    w_f : float or (float, float)
        Fish weight over (mu + rho A) g R [-]; its mass moves with it unless m_f is given.
    gamma : (float, float)
        Speeds Omega sqrt(R/g) between which cusps are looked for [-]; negative in a turn to port.
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
    Cusps
        In rising order of the number that moves.

    Raises
    ------
    ValueError
        For numbers out of range, and where not gamma and one other are pairs.

    Notes
    -----
    At a cusp log rho = 0, rho the radius at the tow point over the tow radius, and its first two slopes in log r_f are
    0. All folds in speed are found at values of the number SPACING apart in its logarithm, or closer, and followed
    through the range; where the second slope changes its sign, Newton's method finds the cusp. Curves of folds that
    close between two such values are not found.

    References
    ----------
    The equations: NRL Report 7048, Eqs. (12)-(23).

    Examples
    --------
    >>> found = cusps(37.8, 1352, (6, 8), C=(0.02, 0.03))
    >>> found.value.round(9).tolist(), found.gamma.round(6).tolist()
    ([0.027516517], [6.768617])
    """
    given = {"lam": lam, "w_f": w_f, "C": C, "C_f": C_f, "C_t": C_t}
    arrays = {name: check_real(name, value) for name, value in given.items()}
    pairs = [name for name, array in arrays.items() if array.ndim]
    speeds = check_real("gamma", gamma)
    if len(pairs) != 1 or speeds.ndim != 1:
        raise ValueError(
            f"gamma and exactly one of {', '.join(given)} must be pairs (low, high), got {len(pairs)} more"
        )
    (name,) = pairs
    for label, ends in (("gamma", speeds), (name, arrays[name])):
        if ends.shape != (2,) or not np.isfinite(ends).all() or not ends[0] < ends[1] or not ends[0] * ends[1] > 0.0:
            raise ValueError(f"{label} must be two finite numbers of one sign, low < high, got {ends.tolist()}")
    slow, fast = sorted(np.abs(speeds))
    check_speed(slow)
    low, high = (float(end) for end in arrays[name])
    numbers = {key: float(array) if key != name else low for key, array in arrays.items()}
    system = System.of(**numbers, m_f=m_f, w=w, C_s=C_s, b_s=b_s)
    moved = ("w_f", "m_f") if name == "w_f" and m_f is None else (name,)
    with patience():
        return _Finder(system, float(np.sign(speeds[0])), (slow, fast), moved, high / low).found()


class _Finder:
    """Unknowns are x = log r of the fish, log |gamma|, and the logarithm t of the factor of the number that moves."""

    def __init__(self, system: System, sign: float, speeds: tuple[float, float], moved: tuple[str, ...], factor: float):
        self.system, self.sign, self.moved = system, sign, moved
        self.low = np.array([*np.log(speeds)[:1], 0.0])
        self.high = np.array([*np.log(speeds)[1:], np.log(factor)])
        self.row = system.row()
        self.columns = [COLUMNS.index(name) for name in moved]

    def found(self) -> Cusps:
        start, complete = self._starts()
        z = self._near(start)
        z, solved = self._solved(z)
        complete &= bool(solved.all())
        inside = solved & ((z[:, 1:] >= self.low) & (z[:, 1:] <= self.high)).all(axis=1)
        z = z[inside]
        z = z[np.argsort(z[:, 2])]
        again = np.array([bool((np.abs(z[:k] - z[k]).max(axis=1) < SAME).any()) for k in range(len(z))], bool)
        z = z[~again]
        rows = self._rows(z[:, 2])
        value, jacobian, _ = cusp_equations(z[:, 0], self._gamma(z), rows, direction_of(self.moved, rows))
        first = getattr(self.system, self.moved[0])
        return Cusps(
            system=self.system,
            moved=self.moved[0],
            value=first * np.exp(z[:, 2]),
            gamma=self._gamma(z),
            r_f=np.exp(z[:, 0] - 2.0 * z[:, 1]),
            error=cusp_errors(value, jacobian)[:, 1],
            complete=complete,
            searched=f"gamma {self.sign * np.exp(self.low[0]):.6g} to {self.sign * np.exp(self.high[0]):.6g}, "
            f"{self.moved[0]} {first:.6g} to {first * np.exp(self.high[1]):.6g}: curves of folds through those at "
            f"{self.values} values of it"
            + ("; that there are no others is not proved" if complete else "; not everywhere made out"),
        )

    def _rows(self, t: Array) -> Array:
        rows = np.tile(self.row, (len(t), 1))
        rows[:, self.columns] *= np.exp(t)[:, None]
        return rows

    def _gamma(self, z: Array) -> Array:
        return self.sign * np.exp(z[:, 1])

    def _starts(self) -> tuple[Array, bool]:
        """All folds at some values of the number."""
        self.values = max(FEWEST, int(np.ceil(self.high[1] / SPACING)) + 1)
        starts, complete = [np.empty((0, 3))], True
        for k, t in enumerate(np.linspace(0.0, self.high[1], self.values)):
            check_patience("folds at values of the number that moves", REMEDY, done=k, of=self.values)
            system = System(*self._rows(np.array([t]))[0].tolist())
            slow, fast = (float(self.sign * np.exp(end[0])) for end in (self.low, self.high))
            found = folds_in_speed(system, slow, fast, named=False)
            complete &= found.complete
            log_gamma = np.log(np.abs(found.gamma))
            starts.append(np.stack([np.log(found.r_f) + 2.0 * log_gamma, log_gamma, np.full(len(found), t)], axis=1))
        return np.concatenate(starts), complete

    def _near(self, start: Array) -> Array:
        """Points near cusps: where the second slope changes its sign along curves of folds, both ways."""
        at = FOLD.at

        def equations(z: Array, i: Integers) -> tuple[Array, Array, Array, Booleans]:
            rows = self._rows(z[:, 2])
            ends = shoot(np.exp(z[:, 0]), self._gamma(z), rows, FOLD, directions=direction_of(self.moved, rows))
            jet = ends.log_rho
            second = 2.0 * jet[:, at(2, 0, 0)]
            value = np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1)
            along = np.stack([value[:, 1], jet[:, at(0, 1, 0)], jet[:, at(0, 0, 1)]], axis=1)
            bent = np.stack([second, jet[:, at(1, 1, 0)], jet[:, at(1, 0, 1)]], axis=1)
            sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1)
            return value, np.stack([along, bent], axis=1), second[:, None], sound

        def stop(z: Array, direction: Array, second: Array, i: Integers) -> Booleans:
            return np.asarray(((z[:, 1:] < self.low - MARGIN) | (z[:, 1:] > self.high + MARGIN)).any(axis=1))

        near = [np.empty((0, 3))]
        for way in (-1.0, 1.0):
            for curve in follow(equations, start, np.tile([way, 0.0, 0.0], (len(start), 1)), stop, STEPS):
                second = curve.monitors[:, 0] if len(curve) else np.empty(0)
                changes = np.flatnonzero((second[:-1] < 0.0) != (second[1:] < 0.0))
                near += [curve.at_event(int(k))[None] for k in changes]
        return np.concatenate(near)

    def _solved(self, z: Array) -> tuple[Array, Booleans]:
        def residuals(z: Array, i: Integers) -> tuple[Array, Array, Booleans]:
            rows = self._rows(z[:, 2])
            return cusp_equations(z[:, 0], self._gamma(z), rows, direction_of(self.moved, rows))

        z, _, solved = newton(
            residuals, z, rounds=ROUNDS, longest=1.0, settled=lambda step, size, last: size < np.sqrt(EPS)
        )
        return z, solved
