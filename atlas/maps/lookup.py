"""Looking a map up: never across a fold or an edge of stability, with an error beside each number."""

import math
import os
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_choice, check_real
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.numerics.errormap import SAFETY
from towatlas.system import System
from towatlas.tables.seal import AtlasFileError

if TYPE_CHECKING:
    import xarray

    from towatlas.results import Folds

Array = NDArray[np.float64]
COMPUTED, OUTSIDE, FOLD, EDGE, FAILED, UNKNOWN = range(6)
OUTCOMES = {
    COMPUTED: "computed",
    OUTSIDE: "outside the axes of the map",
    FOLD: "next to a fold: points around have other numbers of shapes, or of nodes; compute it directly",
    EDGE: "next to an edge of stability: a small push does not end alike at all points around",
    FAILED: "a point around could not be computed",
    UNKNOWN: "the error cannot be told: too few points in a row with the same shapes",
}
WORDS = ("computed", "outside", "fold", "edge_of_stability", "failed", "unknown_error")
# What has to be the same all around, and what is not interpolated: codes, and errors of the points themselves.
FIXED = ("nodes", "near_axis")
NEVER = ("kind", "unstable", "growth_status", "error", "growth_error")


@dataclass(frozen=True, repr=False)
class Map:
    """A map that has been opened.

    Attributes
    ----------
    dataset : xarray.Dataset
        All of it, read when it is needed.
    """

    dataset: "xarray.Dataset"

    def __repr__(self) -> str:
        lines = [f"  {name}: {len(values)}, {values[0]:g} to {values[-1]:g}" for name, values in self.axes.items()]
        systems = int(np.prod([len(values) for values in self.axes.values()]))
        return "\n".join([f"Map of {systems} systems: {', '.join(map(str, self.dataset.data_vars))}", *lines])

    @property
    def axes(self) -> dict[str, Array]:
        """Values of each axis, by name, in the order of the dimensions [-].

        Returns
        -------
        dict of ndarray
        """
        known = self.dataset["count" if "count" in self.dataset else "folds"]
        return {str(name): self.dataset[name].values for name in known.dims}

    def at(self, *, outside: str = "raise", **numbers: ArrayLike) -> "xarray.Dataset":
        """Shapes between the points of a map.

        Parameters
        ----------
        outside : str
            "raise" for an error where a point lies outside the map, "nan" to leave it out.
        **numbers : array_like
            One for each axis, by name [-]; arrays that broadcast.

        Returns
        -------
        xarray.Dataset
            Over (point, shape): the numbers of the map, and beside each the estimate of its error, as x_f_error; nodes,
            near_axis and kind, if the map has them; status, a code of OUTCOMES. Over point: count, and the numbers
            asked for. nan, or -1 and 0 of counts and codes, where the status is not 0.

        Raises
        ------
        ValueError
            For an axis that is missing or unknown, points outside, and a map without shapes.

        Notes
        -----
        Linear between the corners of a cell, in the logarithm along axes that are spaced so. Corners that differ in the
        number of shapes or their nodes have a fold between them, those that differ in kind an edge of stability. The
        error is that of leaving out points next to the cell, halved twice for half the spacing, times SAFETY, summed
        over the axes; two folds, or an island of flutter, between two points are not seen.
        """
        check_choice("outside", outside, ("raise", "nan"))
        if "count" not in self.dataset:
            raise ValueError("this map holds folds alone: towatlas folds --atlas, .folds(...) or .dataset")
        axes = self.axes
        if wrong := sorted(set(numbers) ^ set(axes)):
            what = "is missing" if wrong[0] in axes else "is no axis of this map"
            raise ValueError(f"{wrong[0]} {what}; its axes are {', '.join(axes)}")
        given = check_broadcast(**{name: check_real(name, numbers[name]) for name in axes})
        points = np.stack([array.ravel() for array in given], axis=1)
        if outside == "raise":
            self._check_inside(points, axes)
        answers = [self._point(point, axes) for point in points]
        return self._dataset(points, axes, answers)

    def folds(self, system: System, slow: float, fast: float) -> "Folds":
        """Folds of a system between two speeds, where all points of the map around it have the same ones.

        Parameters
        ----------
        system : System
        slow, fast : float
            Speeds Omega sqrt(R/g) [-], of one sign, the slower first.

        Returns
        -------
        Folds
            As of `towatlas.folds`, and as accurate.

        Raises
        ------
        ValueError
            OutsideMap for a system or speeds outside the map, NotInMap where the map does not tell its folds; for maps
            without folds and checks of them.
        """
        from towatlas.maps.folds import find_folds

        with patience():
            return find_folds(self, system, slow, fast)

    def speeds_within(self, slow: float, fast: float) -> tuple[float, float]:
        """The part of a range of speeds for which the map has folds; the range itself where it has no part of it.

        Parameters
        ----------
        slow, fast : float
            [-], of one sign, the slower first.

        Returns
        -------
        slow, fast : float
        """
        if "folds_gamma" not in self.dataset.attrs:
            return slow, fast
        low, high = sorted(abs(float(end)) for end in self.dataset.attrs["folds_gamma"])
        first, last = max(abs(slow), low), min(abs(fast), high)
        return (math.copysign(first, slow), math.copysign(last, fast)) if first < last else (slow, fast)

    def _check_inside(self, points: Array, axes: dict[str, Array]) -> None:
        for k, (name, values) in enumerate(axes.items()):
            bad = ~((points[:, k] >= values[0]) & (points[:, k] <= values[-1]))
            if bad.any():
                raise OutsideMap(
                    f"{name} = {points[bad, k][0]:g} is outside the map, which has {values[0]:g} to {values[-1]:g}"
                )

    def _point(self, point: Array, axes: dict[str, Array]) -> dict[str, Any]:
        """The numbers of one point, over its shapes."""
        shapes = self.dataset.sizes["shape"]
        cells = []
        for name, values, at in zip(axes, axes.values(), point, strict=True):
            if not values[0] <= at <= values[-1]:
                return {"status": np.full(shapes, OUTSIDE)}
            cells.append(Cell.of(values, float(at), self.dataset[name].attrs.get("spacing", "linear")))
        box = self.dataset.isel({name: cell.part for name, cell in zip(axes, cells, strict=True)})
        count, codes = box["count"].values, box["status"].values
        corners = list(product(*(cell.corners for cell in cells)))
        if any(codes[corner] != status.OK for corner in corners):
            return {"status": np.full(shapes, FAILED)}
        fixed = [box[name].values for name in FIXED]
        same = (count == count[corners[0]]) & np.all(
            [(part == part[corners[0]]).all(axis=-1) for part in fixed], axis=0
        )
        if not all(same[corner] for corner in corners):
            return {"status": np.full(shapes, FOLD)}
        there = np.arange(shapes) < (1 if self.dataset.attrs["branches"] == "expected" else count[corners[0]])
        found: dict[str, Any] = {"count": count[corners[0]], "status": np.full(shapes, COMPUTED)}
        found |= {name: part[corners[0]] for name, part in zip(FIXED, fixed, strict=True)}
        same = np.broadcast_to(same[..., None], (*same.shape, shapes))
        if "kind" in box:
            kind = box["kind"].values
            same = same & (kind == kind[corners[0]])
            found["kind"] = kind[corners[0]]
            edge = ~np.all([kind[corner] == kind[corners[0]] for corner in corners], axis=0)
            found["status"][edge & there] = EDGE
        for name in self._interpolated():
            value, error = _interpolate(box[name].values, same, cells, corners)
            found[name], found[f"{name}_error"] = value, error
            found["status"][(found["status"] == COMPUTED) & there & ~np.isfinite(error)] = UNKNOWN
        return found

    def _interpolated(self) -> list[str]:
        dims = (*self.axes, "shape")
        arrays = self.dataset.data_vars.items()
        return [str(name) for name, array in arrays if array.dims == dims and name not in (*FIXED, *NEVER)]

    def _dataset(self, points: Array, axes: dict[str, Array], answers: list[dict[str, Any]]) -> "xarray.Dataset":
        import xarray

        shapes = self.dataset.sizes["shape"]
        codes = np.array([answer["status"] for answer in answers], np.int8).reshape(-1, shapes)
        about = {"long_name": "outcome of the lookup", "flag_values": np.arange(6, dtype=np.int8)}
        variables: dict[str, Any] = {"status": (("point", "shape"), codes, about | {"flag_meanings": " ".join(WORDS)})}
        variables["count"] = ("point", np.array([answer.get("count", 0) for answer in answers]))
        for k, name in enumerate(axes):
            variables[name] = ("point", points[:, k], self.dataset[name].attrs)
        known = [name for name in (*FIXED, "kind") if name in self.dataset]
        for name in known + [n for base in self._interpolated() for n in (base, f"{base}_error")]:
            number = name in known
            missing: Any = (-1 if name == "nodes" else 0) if number else np.nan
            nothing = np.full(shapes, missing)
            column = np.array([answer.get(name, nothing) for answer in answers]).reshape(-1, shapes)
            about = dict(self.dataset[name].attrs if name in self.dataset else {"units": "1"})
            variables[name] = (("point", "shape"), np.where(codes == COMPUTED, column, missing), about)
        return xarray.Dataset(variables)


class OutsideMap(ValueError):
    """A point outside the axes of a map."""


@dataclass(frozen=True)
class Cell:
    """Along one axis: the points around a value, and those next to them.

    Attributes
    ----------
    part : slice
        Where they are on the axis.
    corners : tuple of int
        Which of them are around the value: two, or the one that it is.
    weights : tuple of float
        Of these.
    t : ndarray, shape (points,)
        Their coordinates.
    """

    part: slice
    corners: tuple[int, ...]
    weights: tuple[float, ...]
    t: Array

    @property
    def around(self) -> slice:
        """Where the corners are on the axis."""
        return slice(self.part.start + self.corners[0], self.part.start + self.corners[-1] + 1)

    @classmethod
    def of(cls, values: Array, at: float, spacing: str) -> "Cell":
        """The cell of a value on an axis.

        Parameters
        ----------
        values : ndarray, shape (points,)
            Of the axis, rising.
        at : float
            Between the first and the last of them.
        spacing : str
            Of `Axis`.

        Returns
        -------
        Cell
        """
        k = int(np.searchsorted(values, at, side="right")) - 1
        if values[k] == at:
            return cls(slice(k, k + 1), (0,), (1.0,), np.zeros(1))
        first, last = max(0, k - 1), min(len(values), k + 3)
        log = spacing == "log"
        t = np.log(values[first:last]) if log else values[first:last]
        low = k - first
        share = ((np.log(at) if log else at) - t[low]) / (t[low + 1] - t[low])
        return cls(slice(first, last), (low, low + 1), (1.0 - share, share), t)


def _interpolate(
    values: Array, same: NDArray[np.bool_], cells: list[Cell], corners: list[tuple[int, ...]]
) -> tuple[Array, Array]:
    """Values over the shapes, and errors, nan where they cannot be told."""
    weights = [float(np.prod(part)) for part in product(*(cell.weights for cell in cells))]
    value = np.sum([weight * values[corner] for weight, corner in zip(weights, corners, strict=True)], axis=0)
    error = np.zeros(values.shape[-1])
    for axis, cell in enumerate(cells):
        if len(cell.corners) == 2:
            error = error + _left_out(values, same, cell, axis, corners)
    return value, SAFETY * error


def _left_out(values: Array, same: NDArray[np.bool_], cell: Cell, axis: int, corners: list[tuple[int, ...]]) -> Array:
    """How far a line between two points may be off, from the bend of three in a row that hold the cell."""
    low = cell.corners[0]
    worst = np.full(values.shape[-1], np.nan)
    for corner in corners:
        if corner[axis] != low:
            continue
        for first in (low - 1, low):
            if first < 0 or first + 2 >= len(cell.t):
                continue
            row = [(*corner[:axis], first + k, *corner[axis + 1 :]) for k in range(3)]
            t0, t1, t2 = cell.t[first : first + 3]
            y0, y1, y2 = (values[place] for place in row)
            bend = ((y2 - y1) / (t2 - t1) - (y1 - y0) / (t1 - t0)) / (t2 - t0)
            off = np.abs(bend) * (cell.t[low + 1] - cell.t[low]) ** 2 / 4.0
            alike = np.all([same[place] for place in row], axis=0)
            worst = np.fmax(worst, np.where(alike, off, np.nan))
    return worst


def open_map(path: str | os.PathLike) -> Map:
    """Open a map.

    Parameters
    ----------
    path : path
        Its folder, as `towatlas map --out` made it, or the file of `--merge`.

    Returns
    -------
    Map

    Raises
    ------
    AtlasFileError
        If there is none, or a part of one.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> from towatlas.maps.build import build_map
    >>> from towatlas.maps.spec import make_spec
    >>> axes = {"lam": {"from": 4, "to": 6, "points": 9}, "gamma": [1.0, 1.1, 1.2]}
    >>> spec = make_spec({"fields": ["position"], "system": {"w_f": 1}, "axes": axes})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     failed = build_map(spec, pathlib.Path(folder) / "map")
    ...     found = open_map(pathlib.Path(folder) / "map").at(lam=5.1, gamma=1.1)
    >>> failed, int(found["count"][0]), found.nodes.values.tolist()
    (0, 3, [[1, 1, 0]])
    """
    import xarray

    from towatlas.maps.store import store_path

    place = Path(path)
    try:
        if place.is_dir():
            if place.suffix != ".zarr":
                place = store_path(place)
            if not place.is_dir():
                raise AtlasFileError(f"{path} holds no finished map; `towatlas map SPEC --out {path} --resume` goes on")
            dataset = xarray.open_dataset(str(place), engine="zarr", chunks=None, mask_and_scale=True)
        elif place.exists():
            dataset = xarray.open_dataset(place, engine="netcdf4")
        else:
            raise AtlasFileError(f"no map at {path}")
    except (ValueError, KeyError, OSError) as error:
        if isinstance(error, AtlasFileError):
            raise
        raise AtlasFileError(f"{path} cannot be read as a map: {error}") from None
    if "tiles_sha256" not in dataset.attrs:
        raise AtlasFileError(f"{path} is no map: it has no hash of its tiles")
    return Map(dataset)
