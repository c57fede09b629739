"""Answers from a table of equilibria: where the fish is. Interpolation needs numpy and netCDF4 only."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_choice, check_outside, check_real
from towatlas.kernels import status
from towatlas.nomenclature import EQUILIBRIA
from towatlas.numerics.chebyshev import W_SCALE
from towatlas.numerics.lagrange import interpolate
from towatlas.tables.critical import open_group, read_root
from towatlas.tables.seal import AtlasFileError

Array = NDArray[np.float64]

CRITICAL = "support/critical"  # the speeds at which the branches of each cable of the table begin
CELLS = "support/cells"  # how each cell between eight nodes is interpolated, and how well
BRANCHES = ("outward", "median")  # in the order of the axis `branch`
# Widths of interpolation, best first; a cell that none of them serves has width 0: a branch ends in it, or nearly.
WIDTHS = (6, 4, 2)
DEFAULT_PATH = Path("build/equilibria.nc")
# Of the coordinates, in which a node must not fall outside its own table by rounding.
SLACK = 1e-12
NEAR_CHOICES = ("solve", "nan")


@dataclass(frozen=True)
class FishPositions:
    """Where the fish is; all arrays of one shape, all dimensionless.

    lam, w_f, gamma : what was asked. nodes : number of nodes of the shape. x_f, z_f : position of the fish over the
    tow radius. error : estimated relative error of x_f and z_f. status : codes of
    `towatlas.kernels.status`; interpolated : whether the answer comes from the table (else it was solved directly).
    """

    lam: Array
    w_f: Array
    gamma: Array
    nodes: NDArray[np.int64]
    x_f: Array
    z_f: Array
    error: Array
    status: NDArray[np.int8]
    interpolated: NDArray[np.bool_]


def open_equilibria(path: str | Path | None = None) -> "EquilibriaTable":
    """Open a table of equilibria, made by `towatlas build --equilibria`.

    Parameters
    ----------
    path : path-like, optional
        The file; build/equilibria.nc by default.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    AtlasFileError
        If the file is damaged, is no table of equilibria, or was written by a newer version.

    Examples
    --------
    >>> table = open_equilibria()                               # doctest: +SKIP
    >>> float(table.fish(10.0, 1.0, 0.6).x_f)                   # doctest: +SKIP
    """
    return EquilibriaTable(DEFAULT_PATH if path is None else Path(path))


class EquilibriaTable:
    """The fish on the median and on the outward branch, interpolated from a file. Made by `open_equilibria`.

    No interpolation crosses a fold: between grid points of which some lie before a critical speed and some beyond it,
    and where the error measured in the middle of the cell is above `worst_error`, the fish is solved directly.
    """

    def __init__(self, path: Path):
        self.path = path
        self.attributes, data, self.sha256 = read_root(path)
        if self.attributes.get("method") != EQUILIBRIA:
            raise AtlasFileError(
                f"{path} was built with --method {self.attributes.get('method')}; "
                "a table of equilibria is built with `towatlas build --equilibria`"
            )
        with open_group(path, data) as file:
            self.grid: dict[str, Array] = {name: np.asarray(file[name][:], float) for name in ("w_f", "lam", "gamma")}
            self._nodes = np.asarray(file["nodes"][:], np.int64)
            # What is interpolated: smooth, and of one sign on a branch.
            self._x_f = np.log(np.abs(np.asarray(file["x_f"][:], float)))
            self._z_f = np.log(np.asarray(file["z_f"][:], float))
            self._width = np.asarray(file[CELLS]["width"][:], np.int64)
            self._error = np.asarray(file[CELLS]["position_error"][:], float)
            self.worst_error = float(file[CELLS].worst_error)
        self._axes = coordinates(self.grid["w_f"], self.grid["lam"], self.grid["gamma"])

    def fish(
        self,
        lam: ArrayLike,
        w_f: ArrayLike,
        gamma: ArrayLike,
        branch: str = "median",
        *,
        outside: str = "raise",
        near: str = "solve",
    ) -> FishPositions:
        """Position of the fish.

        Parameters
        ----------
        lam : array_like
            Cable length over tow radius [-].
        w_f : array_like
            Fish weight over (mu + rho A) g R [-].
        gamma : array_like
            Speed Omega sqrt(R/g) [-].
        branch : {"median", "outward"}
            The shape that Skop expects to be seen, with a node more beyond every critical speed; or the one without
            nodes that swings outward. Up to the first critical speed they are one.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the grid does not hold: a ValueError that says which axis, nan with the reason
            in the status, or the direct solution.
        near : {"solve", "nan"}
            What becomes of points next to a fold: the direct solution, which needs numba, or nan.

        Returns
        -------
        FishPositions
            Arrays of the broadcast shape; nan where status is not OK.

        Raises
        ------
        ValueError
            For what is not a number, a choice that does not exist, and points outside with outside="raise".
        """
        k = BRANCHES.index(check_choice("branch", branch, BRANCHES))
        check_outside(outside)
        check_choice("near", near, NEAR_CHOICES)
        lam, w_f, gamma = check_broadcast(
            lam=check_real("lam", lam), w_f=check_real("w_f", w_f), gamma=check_real("gamma", gamma)
        )
        flat = w_f.ravel(), lam.ravel(), gamma.ravel()
        sound = np.isfinite(flat[0]) & (flat[0] >= 0.0)
        for value in flat[1:]:
            sound &= np.isfinite(value) & (value > 0.0)
        held = sound & self._holds(*flat)
        if outside == "raise" and not held.all():
            raise ValueError(self._complaint(*flat, ~held))
        columns = self._interpolate(k, *flat, held)
        again = (held & ~columns["interpolated"] & (near == "solve")) | (sound & ~held & (outside == "solve"))
        if again.any():
            from towatlas.solve.equilibria import solve_branch

            nodes, members = solve_branch(branch, *(value[again] for value in flat))
            for name, column in (("nodes", nodes), *((name, getattr(members, name)) for name in _SOLVED)):
                columns[name][again] = column
        columns["status"][~sound] = status.BAD_INPUT
        shaped = {name: column.reshape(lam.shape) for name, column in columns.items()}
        return FishPositions(lam=lam, w_f=w_f, gamma=gamma, **shaped)

    def _holds(self, *point: Array) -> NDArray[np.bool_]:
        inside = np.ones(len(point[0]), bool)
        for value, nodes in zip(point, self.grid.values(), strict=True):
            inside &= (value >= nodes[0] * (1.0 - SLACK)) & (value <= nodes[-1] * (1.0 + SLACK))
        return inside

    def _interpolate(self, branch: int, w_f: Array, lam: Array, gamma: Array, held: Any) -> dict[str, NDArray[Any]]:
        rows = len(lam)
        columns: dict[str, NDArray[Any]] = {name: np.full(rows, np.nan) for name in ("x_f", "z_f", "error")}
        columns["nodes"] = np.full(rows, -1)
        columns["status"] = np.where(held, status.NEAR_FOLD, status.OUTSIDE).astype(np.int8)
        columns["interpolated"] = np.zeros(rows, bool)
        point = tuple(
            np.clip(x, axis[0], axis[-1])
            for x, axis in zip(coordinates(w_f[held], lam[held], gamma[held]), self._axes, strict=True)
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

    def _complaint(self, w_f: Array, lam: Array, gamma: Array, bad: NDArray[np.bool_]) -> str:
        """What is wrong with the first point outside, and how many there are."""
        i = int(np.flatnonzero(bad)[0])
        reason = ""
        for name, value in (("lam", lam[i]), ("w_f", w_f[i]), ("gamma", gamma[i])):
            nodes = self.grid[name]
            if not nodes[0] * (1.0 - SLACK) <= value <= nodes[-1] * (1.0 + SLACK):
                reason = f"{name} = {value:.15g} is outside the table, {nodes[0]:.10g} to {nodes[-1]:.10g}"
                break
        others = f" ({bad.sum()} of {len(bad)} points are outside)" if len(bad) > 1 else ""
        return f'{reason}{others}; outside="solve" computes such points directly, outside="nan" leaves them out'


_SOLVED = ("x_f", "z_f", "error", "status")


def coordinates(w_f: Array, lam: Array, gamma: Array) -> tuple[Array, Array, Array]:
    """Coordinates in which the branches are smooth and the table is interpolated."""
    return np.log1p(w_f / W_SCALE), np.log(lam), np.log(gamma)
