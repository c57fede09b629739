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
# Errors of shots may be so much larger than rounding: only how many nodes there are in the vacuum is asked for.
LOOSENESS = 1e4
# Of logarithms, for differences: with larger ones folds of many nodes come to other folds of the vacuum.
BESIDE = 1e-7
STEPS = Steps(first=0.5, longest=1.0, shortest=1e-4, near=1e-4, bent=0.1, straight=0.9, points=1000)


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
    start = np.stack([x, np.log(np.abs(gamma)), np.zeros(len(x))], axis=1)
    return _follow(start, empty, fluid, np.sign(gamma), faint)


def _follow(start: Array, empty: Array, fluid: Array, sign: Array, faint: Array) -> Integers:
    """Nodes of folds where the curves through them come to the vacuum; 0 where they do not."""
    # Row i goes towards less of the fluid, row i + folds towards more: at once, for few shots leave lanes idle.
    folds = len(start)
    start, empty, fluid, sign, faint = (np.concatenate([one, one]) for one in (start, empty, fluid, sign, faint))
    way = np.repeat([-1.0, 1.0], folds)
    n = np.zeros(folds, np.int64)
    jets = jets_of(1)

    def equations(z: Array, i: Integers) -> tuple[Array, Array, Array, Booleans]:
        # At a point and beside it: four slopes take a fraction of the time of one jet with all derivatives.
        every = np.concatenate([z, *(z + BESIDE * unit for unit in np.eye(3))])
        k = np.tile(i, 4)
        rows = empty[k] + np.exp(every[:, 2])[:, None] * fluid[k]
        ends = shoot(np.exp(every[:, 0]), sign[k] * np.exp(every[:, 1]), rows, jets, looseness=LOOSENESS)
        value, *beside = ends.log_rho[:, :2].reshape(4, len(z), 2)
        jacobian = (np.stack(beside, axis=2) - value[:, :, None]) / BESIDE
        known = (ends.status == status.OK) & np.isfinite(ends.log_rho).all(axis=1) & (rows[:, W] > -1.0)
        nodes = np.floor(ends.angle[: len(z)] / np.pi + 0.5)
        return value, jacobian, nodes[:, None], known.reshape(4, -1).all(axis=0)

    def stop(z: Array, direction: Array, nodes: Array, i: Integers) -> Booleans:
        arrived = z[:, 2] < faint[i]
        n[i[arrived] % folds] = nodes[arrived, 0]
        out = (z[:, 1] > np.log(FASTEST)) | (z[:, 1] < np.log(SLOWEST)) | (z[:, 2] > np.log(DENSEST))
        return out | arrived | (n[i % folds] > 0)

    follow(equations, start, way[:, None] * [0.0, 0.0, 1.0], stop, STEPS)
    return n
