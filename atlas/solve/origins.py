"""Which fold of the vacuum a fold comes from: it is followed to where there is no fluid."""

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS, M_F, W_F, W
from towatlas.numerics.curves import Steps, follow
from towatlas.solve.jets import jets_of
from towatlas.solve.shots import Array, Integers, shoot

Booleans = NDArray[np.bool_]
# The way to the vacuum: so little of the fluid is none; speeds and fluids at which it is given up.
FAINT = 1e-6
SLOWEST, FASTEST, DENSEST = 1e-5, 1e3, 30.0
STEPS = Steps(first=2.0, longest=2.0, shortest=1e-2)


def numbers_of(x: Array, rows: Array, gamma: Array, heavy: bool) -> Integers:
    """Numbers of the folds of the vacuum that folds are continued from.

    Each is followed, one way and the other, along the curve of folds of systems between the vacuum and its own and
    beyond.

    Parameters
    ----------
    x, gamma : ndarray, shape (folds,)
        log of the radius of the fish over g / Omega^2, and speed [-].
    rows : ndarray, shape (folds, columns)
        Systems, as of `System.row`.
    heavy : bool
        Whether to look at all: what floats comes from no vacuum.

    Returns
    -------
    ndarray of int, shape (folds,)
        0 for those that drag makes.
    """
    n = np.zeros(len(x), np.int64)
    if not heavy or not len(x):
        return n
    empty = rows.copy()
    empty[:, M_F], empty[:, W] = rows[:, W_F], 1.0
    empty[:, [COLUMNS.index(name) for name in ("C", "C_f", "C_t", "C_s")]] = 0.0
    fluid = np.where(np.isfinite(rows), rows - np.where(np.isfinite(rows), empty, 0.0), 0.0)
    faint = np.log(FAINT / np.maximum(1.0, np.abs(fluid).max(axis=1)))
    for way in (-1.0, 1.0):
        left = np.flatnonzero(n == 0)
        start = np.stack([x[left], np.log(np.abs(gamma[left])), np.zeros(len(left))], axis=1)
        n[left] = _follow(start, way, empty[left], fluid[left], np.sign(gamma[left]), faint[left])
    return n


def _follow(start: Array, way: float, empty: Array, fluid: Array, sign: Array, faint: Array) -> Integers:
    """Nodes of folds where the curves through them come to the vacuum; 0 where they do not."""
    jets = jets_of(2, gamma=True, parameter=True)
    at = jets.at

    def equations(z: Array, i: Integers) -> tuple[Array, Array, Array, Booleans]:
        share = np.exp(z[:, 2])[:, None]
        rows, moved = empty[i] + share * fluid[i], share * fluid[i]
        ends = shoot(np.exp(z[:, 0]), sign[i] * np.exp(z[:, 1]), rows, jets, directions=moved)
        jet = ends.log_rho
        value = np.stack([jet[:, 0], jet[:, at(1, 0, 0)]], axis=1)
        along_value = np.stack([value[:, 1], jet[:, at(0, 1, 0)], jet[:, at(0, 0, 1)]], axis=1)
        along_slope = np.stack([2.0 * jet[:, at(2, 0, 0)], jet[:, at(1, 1, 0)], jet[:, at(1, 0, 1)]], axis=1)
        sound = (ends.status == status.OK) & np.isfinite(jet).all(axis=1) & (rows[:, W] > -1.0)
        nodes = np.floor(ends.angle / np.pi + 0.5)
        return value, np.stack([along_value, along_slope], axis=1), nodes[:, None], sound

    def stop(z: Array, direction: Array, nodes: Array, i: Integers) -> Booleans:
        out = (z[:, 1] > np.log(FASTEST)) | (z[:, 1] < np.log(SLOWEST)) | (z[:, 2] > np.log(DENSEST))
        return out | (z[:, 2] < faint[i])

    curves = follow(equations, start, np.tile([0.0, 0.0, way], (len(start), 1)), stop, STEPS)
    n = np.zeros(len(start), np.int64)
    for k, curve in enumerate(curves):
        if len(curve) and curve.points[-1, 2] < faint[k]:
            n[k] = int(curve.monitors[-1, 0])
    return n
