"""All shapes of a system at many lengths or speeds, with the branch that each is on, and the folds between."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels.system import COLUMNS, LAM
from towatlas.solve.drag_equilibria import quantities
from towatlas.solve.paths import Path, trace
from towatlas.solve.search import SLOPE
from towatlas.solve.shots import Array, Integers, shoot
from towatlas.system import System


@dataclass(frozen=True)
class Swept:
    """Shapes of one system as its length or its speed moves.

    Attributes
    ----------
    system : System
    gamma : float
        Speed [-]; where that moves, the lowest.
    values : ndarray, shape (values,)
        Of lam or gamma [-], rising.
    row : ndarray of int, shape (shapes,)
        Which of the values each shape belongs to; of one value from the axis outwards.
    branch : ndarray of int, shape (shapes,)
        The same number along one branch, until a fold ends it.
    expected : ndarray of bool, shape (shapes,)
        Whether it is the shape that is to be expected, as of `Equilibria`.
    columns : dict of ndarray, shape (shapes,)
        As of `towatlas.solve.drag_equilibria.quantities`, tension_fish, over (mu + rho A) g R, and angle_tow_deg and
        angle_fish_deg, of the cable below the horizontal.
    folds : ndarray, shape (folds,)
        Values at which two shapes meet [-].
    changes : ndarray of int, shape (folds,)
        How many shapes there are more above it than below: 2 or -2.
    complete : bool
        Whether everything that was looked at was made out.
    """

    system: System
    gamma: float
    values: Array
    row: Integers
    branch: Integers
    expected: NDArray[np.bool_]
    columns: dict[str, NDArray[Any]]
    folds: Array
    changes: Integers
    complete: bool

    @property
    def place(self) -> Integers:
        """Number of each shape among those of its value."""
        counts = np.bincount(self.row, minlength=len(self.values))
        return np.arange(len(self.row)) - np.repeat(np.cumsum(counts) - counts, counts)


def sweep_shapes(system: System, gamma: float, name: str, values: Array) -> Swept:
    """All shapes at values of the length or the speed; no checks.

    Parameters
    ----------
    system : System
    gamma : float
        Speed [-].
    name : {"lam", "gamma"}
        What moves.
    values : ndarray, shape (values,)
        Of it, rising, > 0; 2 or more.

    Returns
    -------
    Swept
    """
    first = float(values[0])
    row = system.row()
    if name == "lam":
        row[LAM] = first
    else:
        gamma = float(np.copysign(first, gamma))
    path = Path(row, gamma, (name,))
    wanted = np.log(values / first)
    traced = trace(path, 0.0, float(wanted[-1]), at=wanted)
    at = np.searchsorted([column.t for column in traced.columns], wanted)
    labels = traced.branches()
    chosen = [traced.columns[k] for k in at]
    rows = np.repeat(np.arange(len(values)), [len(column.x) for column in chosen])
    x = np.concatenate([column.x for column in chosen])
    systems, speeds = path.at(wanted)
    columns = quantities(rows, x, systems, speeds) | _ends(rows, x, systems, speeds)
    t = np.array([fold.t for fold in traced.folds if fold is not None])
    shapes = np.array([len(column.x) for column in traced.columns])
    changes = np.array(
        [int(b - a) for a, b, fold in zip(shapes, shapes[1:], traced.folds, strict=False) if fold], np.int64
    )
    return Swept(
        system=system,
        gamma=gamma,
        values=values,
        row=rows,
        branch=np.concatenate([labels[k] for k in at]),
        expected=_expected(system, rows, columns["R_x0"]),
        columns=columns,
        folds=first * np.exp(t),
        changes=changes,
        complete=traced.certain,
    )


def _expected(system: System, rows: Integers, r_x0: Array) -> NDArray[np.bool_]:
    """In a vacuum the median root, with drag the shape nearest to the axis."""
    first = np.diff(rows, prepend=-1) != 0
    if not system.in_vacuum:
        return first
    expected = np.zeros(len(rows), bool)
    for row in np.unique(rows):
        its = np.flatnonzero(rows == row)
        expected[its[np.argsort(r_x0[its])[len(its) // 2]]] = True
    return expected


def _ends(rows: Integers, x: Array, systems: Array, gamma: Array) -> dict[str, Array]:
    """Tension at the fish, and angles of the cable below the horizontal at both ends."""
    r, unit = np.exp(x), np.square(gamma[rows])
    at_fish, at_tow = (shoot(r, gamma[rows], systems[rows], SLOPE, shares=share) for share in (0.0, 1.0))
    of = [COLUMNS.index(name) for name in ("w_f", "m_f", "C_f")]
    bare = (systems[rows][:, of] == 0.0).all(axis=1)
    angles = [
        np.degrees(np.arctan2(ends.FZ[:, 0], np.hypot(ends.FX[:, 0], ends.FY[:, 0]))) for ends in (at_tow, at_fish)
    ]
    return {
        "tension_fish": np.where(bare, 0.0, at_fish.T[:, 0] / unit),
        "angle_tow_deg": angles[0],
        "angle_fish_deg": angles[1],
    }
