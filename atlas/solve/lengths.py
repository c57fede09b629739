"""Cables that give a system a depth, a radius of the fish or a tension, in any medium: by all shapes of all lengths."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.numerics.hermite import cubic, cubic_coefficients
from towatlas.numerics.rows import EPS, newton, solve_systems
from towatlas.solve.jets import jets_of
from towatlas.solve.paths import Path, Trace, trace
from towatlas.solve.shots import Array, Ends, Integers
from towatlas.system import System

JETS = jets_of(1, parameter=True)
ROUNDS, SETTLED, ROUNDINGS, SAME = 24, 1e-11, 64.0, 1e-8
# A root may lie so far beyond the piece of a branch on which a cubic has it, in the logarithms of length and radius.
BEYOND = 0.05
QUANTITIES = ("depth", "radius", "tension")
Booleans = NDArray[np.bool_]


@dataclass(frozen=True)
class Lengths:
    """Cables that give a system a value of one quantity, in rising order of length.

    Attributes
    ----------
    system : System
        As the shortest cable looked at.
    gamma : float
        Speed [-].
    quantity : str
        "depth", "radius" or "tension".
    value : float
        Of it, in tow radii, or over (mu + rho A) g R.
    lam : ndarray, shape (cables,)
        Length over tow radius [-], > 0.
    error : ndarray, shape (cables,)
        Estimated relative error of lam [-], > 0.
    r_f : ndarray, shape (cables,)
        Distance of the fish from the axis over tow radius [-], > 0.
    least, most : float
        Of the quantity, over all shapes looked at.
    complete : bool
        Whether everything that was looked at was made out.
    """

    system: System
    gamma: float
    quantity: str
    value: float
    lam: Array
    error: Array
    r_f: Array
    least: float
    most: float
    complete: bool

    def __len__(self) -> int:
        return len(self.lam)


def cables_for(system: System, gamma: float, quantity: str, value: float, longest: float) -> Lengths:
    """All lengths, from that of a system to `longest`, at which one of its shapes has a value of a quantity; no checks.

    Parameters
    ----------
    system : System
        With the shortest cable that is looked at.
    gamma : float
        Speed [-].
    quantity : {"depth", "radius", "tension"}
        Of the fish below the tow point, from the axis, in tow radii; at the tow point, over (mu + rho A) g R.
    value : float
    longest : float
        Longest cable over tow radius, > that of the system.

    Returns
    -------
    Lengths

    Notes
    -----
    All shapes are found at lengths close enough for each to be plainly one of the next (`trace`); along the pieces
    between, cubics through the quantity and its slope say where it has the value, and Newton's method finds the length
    and the shape there together.
    """
    path = Path(system.row(), gamma, ("lam",))
    traced = trace(path, 0.0, float(np.log(longest / system.lam)))
    target = _Target(path, quantity, value)
    guesses, least, most = _guesses(traced, target)
    z, error, solved = target.solved(guesses[:, :2])
    inside = (z[:, 1] >= 0.0) & (z[:, 1] <= np.log(longest / system.lam))
    good = solved & (np.abs(z - guesses[:, :2]) <= guesses[:, 2:] + BEYOND).all(axis=1) & inside
    z, error = z[good], error[good]
    order = np.argsort(z[:, 1])
    z, error = z[order], error[order]
    new = np.array([not (np.abs(z[:k] - z[k]).max(axis=1) < SAME).any() for k in range(len(z))], bool)
    z, error = z[new], error[new]
    return Lengths(
        system=system,
        gamma=gamma,
        quantity=quantity,
        value=value,
        lam=system.lam * np.exp(z[:, 1]),
        error=error,
        r_f=np.exp(z[:, 0]) / gamma**2,
        least=least,
        most=most,
        complete=traced.certain,
    )


class _Target:
    """A quantity of shapes less a value, with its slopes."""

    def __init__(self, path: Path, quantity: str, value: float):
        self.path, self.quantity, self.value = path, quantity, value
        self.unit = path.gamma**2

    def of(self, x: Array, ends: Ends) -> tuple[Array, Array, Array]:
        """The miss, and its slopes in x and t."""
        if self.quantity == "radius":
            r = np.exp(x) / self.unit
            return r - self.value, r, np.zeros(len(x))
        jet = (ends.H if self.quantity == "depth" else ends.T) / self.unit
        return jet[:, 0] - self.value, jet[:, JETS.at(1, 0, 0)], jet[:, JETS.at(0, 0, 1)]

    def at(self, x: Array, t: Array) -> tuple[Array, Array, Array]:
        """The same at points."""
        return self.of(x, self.path.shots(x, t, JETS))

    def solved(self, guess: Array) -> tuple[Array, Array, Booleans]:
        """Points (x, t) where a shape has the value, errors of t, and whether they were found."""
        error = np.full(len(guess), np.nan)

        def residuals(z: Array, i: Integers) -> tuple[Array, Array, Booleans]:
            ends = self.path.shots(z[:, 0], z[:, 1], JETS)
            miss, along, across = self.of(z[:, 0], ends)
            rho = ends.log_rho
            matrix = np.stack([rho[:, JETS.at(1, 0, 0)], rho[:, JETS.at(0, 0, 1)], along, across], axis=1)
            matrix = matrix.reshape(-1, 2, 2)
            rounding = ROUNDINGS * EPS * np.stack([np.ones(len(z)), np.abs(miss + self.value)], axis=1)
            with np.errstate(all="ignore"):
                inverse = np.stack([solve_systems(matrix, np.tile(e, (len(z), 1))) for e in np.eye(2)], axis=2)
                error[i] = (np.abs(inverse[:, 1]) * rounding).sum(axis=1)
            sound = (ends.status == status.OK) & np.isfinite(rho).all(axis=1) & np.isfinite(miss)
            return np.stack([rho[:, 0], miss], axis=1), matrix, sound

        z, step, solved = newton(
            residuals, guess, rounds=ROUNDS, longest=1.0, settled=lambda step, size, last: size < SETTLED
        )
        return z, error + np.abs(step[:, 1]), solved


def _guesses(traced: Trace, target: _Target) -> tuple[Array, float, float]:
    """Points (x, t) near those with the value, with the sizes of the pieces they are on; least and most of it."""
    sizes = [len(column.x) for column in traced.columns]
    x = np.concatenate([column.x for column in traced.columns])
    t = np.repeat([column.t for column in traced.columns], sizes)
    moves = np.concatenate([column.moves for column in traced.columns])
    folds = [fold for fold in traced.folds if fold is not None]
    fold_x, fold_t = np.array([fold.x for fold in folds]), np.array([fold.t for fold in folds])
    every_x, every_t = np.concatenate([x, fold_x]), np.concatenate([t, fold_t])
    value, along, across = target.at(every_x, every_t)
    begins = np.cumsum([0, *sizes])
    found = [np.empty((0, 4))]
    for first, second, at_fold in _pieces(traced, begins, len(x)):
        a, b = np.array(first), np.array(second)
        if at_fold:
            # At a fold the length stands still: along x.
            width = every_x[b] - every_x[a]
            with np.errstate(divide="ignore", invalid="ignore"):
                turns = np.where(b < len(x), 1.0 / moves[np.minimum(b, len(x) - 1)], 0.0)
                turns_a = np.where(a < len(x), 1.0 / moves[np.minimum(a, len(x) - 1)], 0.0)
            slope_a, slope_b = along[a] + across[a] * turns_a, along[b] + across[b] * turns
            other = (every_t[a], every_t[b], turns_a, turns)
            start = every_x[a]
        else:
            width = every_t[b] - every_t[a]
            slope_a, slope_b = across[a] + along[a] * moves[a], across[b] + along[b] * moves[b]
            other = (every_x[a], every_x[b], moves[a], moves[b])
            start = every_t[a]
        for k, share in _roots(value[a], value[b], slope_a, slope_b, width):
            here = cubic(other[0][k], other[1][k], other[2][k], other[3][k], width[k], share)
            place = start[k] + share * width[k]
            size = np.abs([every_x[b[k]] - every_x[a[k]], every_t[b[k]] - every_t[a[k]]])
            found.append(np.array([[place, here, *size] if at_fold else [here, place, *size]]))
    known = value + target.value
    return np.concatenate(found), float(np.nanmin(known)), float(np.nanmax(known))


def _pieces(traced: Trace, begins: Integers, shapes: int) -> Iterator[tuple[list[int], list[int], bool]]:
    """Ends of pieces of branches, as indices of all shapes and, after these, folds; those that end in a fold apart."""
    labels = traced.branches()
    plain: tuple[list[int], list[int]] = ([], [])
    folded: tuple[list[int], list[int]] = ([], [])
    number = shapes
    for k, (fold, (a, b)) in enumerate(zip(traced.folds, pairwise(labels), strict=True)):
        both = np.intersect1d(a, b, return_indices=True)
        plain[0].extend(begins[k] + both[1])
        plain[1].extend(begins[k + 1] + both[2])
        if fold is not None:
            more = k if len(a) > len(b) else k + 1
            for member in (fold.pair, fold.pair + 1):
                folded[0].append(begins[more] + member)
                folded[1].append(number)
            number += 1
    for pieces, at_fold in ((plain, False), (folded, True)):
        if pieces[0]:
            yield *pieces, at_fold


def _roots(a: Array, b: Array, slope_a: Array, slope_b: Array, width: Array) -> Iterator[tuple[int, float]]:
    """Which cubics through values and slopes vanish, and at which shares of their widths."""
    for k, terms in enumerate(np.transpose(cubic_coefficients(a, b, slope_a, slope_b, width))):
        if np.isfinite(terms).all():
            roots = np.roots(terms)
            real = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real >= -1e-9) & (roots.real <= 1.0 + 1e-9)]
            yield from ((k, float(share)) for share in real)
