"""Positions of the fish interpolated from a table of equilibria. Needs numpy and netCDF4 only."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import W_SCALE
from towatlas.nomenclature import EQUILIBRIA
from towatlas.numerics.lagrange import interpolate
from towatlas.tables import direct
from towatlas.tables.domain import complaint, sound

CRITICAL = "support/critical"  # the speeds at which the branches of each cable of the table begin
CELLS = "support/cells"  # how each cell between eight nodes is interpolated, and how well
BRANCHES = ("outward", "median")  # in the order of the axis `branch`
# Widths of interpolation, best first; a cell that none of them serves has width 0: a branch ends in it, or nearly.
WIDTHS = (6, 4, 2)
# Of the coordinates, in which a node must not fall outside its own table by rounding.
SLACK = 1e-12

Array = NDArray[np.float64]


class FishTable:
    """The part of a file that holds the fish on the median and on the outward branch.

    No interpolation crosses a fold: between grid points of which some lie before a critical speed and some beyond it,
    and where the error measured in the middle of the cell is above `worst_error`, the fish is solved directly.

    Attributes
    ----------
    grid : dict of ndarray
        Nodes of w_f, lam and gamma [-], rising.
    worst_error : float
        Cells with a larger error [-] are not interpolated; > 0.
    """

    holds = "fish positions"
    made_by = "towatlas build --equilibria"

    def __init__(self, file: Any):
        self.grid: dict[str, Array] = {name: np.asarray(file[name][:], float) for name in ("w_f", "lam", "gamma")}
        self._nodes = np.asarray(file["nodes"][:], np.int64)
        # What is interpolated: smooth, and of one sign on a branch.
        self._x_f = np.log(np.abs(np.asarray(file["x_f"][:], float)))
        self._z_f = np.log(np.asarray(file["z_f"][:], float))
        self._width = np.asarray(file[CELLS]["width"][:], np.int64)
        self._error = np.asarray(file[CELLS]["position_error"][:], float)
        self.worst_error = float(file[CELLS].worst_error)
        self._axes = coordinates(**self.grid)

    @staticmethod
    def in_file(file: Any, method: str) -> bool:
        """Whether a file holds this part.

        Parameters
        ----------
        file : netCDF4.Dataset
        method : str
            How it was built, its attribute.

        Returns
        -------
        bool
        """
        return method == EQUILIBRIA

    def __repr__(self) -> str:
        return f"{self.holds}: {', '.join(f'{name} {held}' for name, held in self.domain().items())}"

    def domain(self) -> dict[str, str]:
        """Ranges of what is held, in words.

        Returns
        -------
        dict of str
            By quantity.
        """
        return {name: f"{nodes[0]:g} .. {nodes[-1]:g}" for name, nodes in self.grid.items()}

    def answer(
        self, branch: str, outside: str, near: str, *, lam: Array, w_f: Array, gamma: Array
    ) -> dict[str, NDArray[Any]]:
        """Position of the fish of checked rows.

        Parameters
        ----------
        branch : {"outward", "median"}
        outside : {"raise", "nan", "solve"}
            What becomes of points outside.
        near : {"solve", "nan"}
            What becomes of points next to a fold.
        lam, w_f, gamma : ndarray, shape (points,)
            Cable length, fish weight and speed [-].

        Returns
        -------
        dict of ndarray, shape (points,)
            nodes, x_f, z_f, error, status, interpolated.

        Raises
        ------
        ValueError
            For points outside with outside="raise".
        """
        point = {"lam": lam, "w_f": w_f, "gamma": gamma}
        good = sound(point)
        held = good & self._holds(point)
        if outside == "raise" and not held.all():
            limits = {name: (nodes[0] * (1.0 - SLACK), nodes[-1] * (1.0 + SLACK)) for name, nodes in self.grid.items()}
            raise ValueError(complaint(point, limits, ~held))
        columns = self._interpolate(BRANCHES.index(branch), held, **point)
        again = (held & ~columns["interpolated"] & (near == "solve")) | (good & ~held & (outside == "solve"))
        if again.any():
            solved = direct.fish_positions(branch, **{name: column[again] for name, column in point.items()})
            for name, column in solved.items():
                columns[name][again] = column
        columns["status"][~good] = status.BAD_INPUT
        return columns

    def _holds(self, point: dict[str, Array]) -> NDArray[np.bool_]:
        inside = np.ones(len(point["lam"]), bool)
        for name, nodes in self.grid.items():
            inside &= (point[name] >= nodes[0] * (1.0 - SLACK)) & (point[name] <= nodes[-1] * (1.0 + SLACK))
        return inside

    def _interpolate(
        self, branch: int, held: NDArray[np.bool_], *, lam: Array, w_f: Array, gamma: Array
    ) -> dict[str, NDArray[Any]]:
        rows = len(lam)
        columns: dict[str, NDArray[Any]] = {name: np.full(rows, np.nan) for name in ("x_f", "z_f", "error")}
        columns["nodes"] = np.full(rows, -1)
        columns["status"] = np.where(held, status.NEAR_FOLD, status.OUTSIDE).astype(np.int8)
        columns["interpolated"] = np.zeros(rows, bool)
        point = tuple(
            np.clip(x, axis[0], axis[-1])
            for x, axis in zip(coordinates(lam=lam[held], w_f=w_f[held], gamma=gamma[held]), self._axes, strict=True)
        )
        cell = tuple(
            np.clip(np.searchsorted(axis, x, side="right") - 1, 0, len(axis) - 2)
            for x, axis in zip(point, self._axes, strict=True)
        )
        held_rows = np.flatnonzero(held)
        widths = self._width[branch][cell]
        for width in WIDTHS:
            part = widths == width
            if not part.any():
                continue
            rows = held_rows[part]
            at = tuple(c[part] for c in cell)
            x_f, z_f = interpolate(
                (self._x_f[branch], self._z_f[branch]), self._axes, at, tuple(x[part] for x in point), width
            )
            nodes = self._nodes[branch][at]
            columns["nodes"][rows] = nodes
            columns["x_f"][rows] = np.where(nodes % 2 == 0, 1.0, -1.0) * np.exp(x_f)
            columns["z_f"][rows] = np.exp(z_f)
            columns["error"][rows] = self._error[branch][at]
            columns["status"][rows] = status.OK
            columns["interpolated"][rows] = True
        return columns


def coordinates(*, lam: Array, w_f: Array, gamma: Array) -> tuple[Array, Array, Array]:
    """Coordinates in which the branches are smooth and interpolated.

    Parameters
    ----------
    lam, w_f, gamma : ndarray
        Cable length, fish weight and speed [-].

    Returns
    -------
    tuple of three ndarray
        Of w_f, lam and gamma: in the order of the axes of the file.
    """
    return np.log1p(w_f / W_SCALE), np.log(lam), np.log(gamma)
