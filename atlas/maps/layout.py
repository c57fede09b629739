"""How a map lies in files: its variables, and the tiles that its systems are cut into."""

from dataclasses import dataclass, replace
from math import ceil, prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.maps.systems import NAMES, Axis, Spec
from towatlas.nomenclature import EQUILIBRIUM
from towatlas.solve.many import FIELDS as SHAPES
from towatlas.solve.spectra import FIELDS as GROWTH

# Codes of kinds, in files; 0 where there is no shape.
KINDS = ("none", "stable", "divergence", "flutter", "weak", "unknown")
POSITION = ("x_f", "y_f", "z_f", "r_f", "phase_deg", "error")
TENSION = ("tension", "R_x0", "R_y0", "R_z0")
RATES = ("growth", "frequency", "growth_error", "unstable", "growth_status")
CURVES = ("x", "y", "z", "T")
# Dimensions beyond those of the axes.
SYSTEM, SHAPE, STATION, CABLE, FOLD = (), ("shape",), ("shape", "station"), (), ("fold",)


@dataclass(frozen=True)
class Variable:
    """One variable of a map.

    Attributes
    ----------
    beyond : tuple of str
        Its dimensions after those of the axes.
    fill : float
        Where there is nothing; of the type of its values.
    attributes : dict
        By the CF conventions.
    stage : str
        Whose tiles hold it, of `stages`.
    """

    beyond: tuple[str, ...]
    fill: Any
    attributes: dict[str, Any]
    stage: str = "shapes"


def variables(spec: Spec) -> dict[str, Variable]:
    """All variables of a map but its axes.

    Parameters
    ----------
    spec : Spec

    Returns
    -------
    dict of Variable
    """
    found: dict[str, Variable] = {}
    if spec.states:
        codes = {"long_name": "outcome of the search for shapes"} | _flags(status.FLAG_MEANINGS)
        found["count"] = Variable(SYSTEM, np.int32(0), {"long_name": "number of shapes", "units": "1"})
        found["status"] = Variable(SYSTEM, np.int8(status.OK), codes)
        names = ["nodes", "near_axis"]
        names += POSITION * ("position" in spec.fields) + TENSION * ("tension" in spec.fields)
        for name in names:
            found[name] = Variable(SHAPE, _fill(name), _about(name, SHAPES[name]))
        if "shapes" in spec.fields:
            found |= {name: Variable(STATION, np.nan, _about(name, EQUILIBRIUM[name].long_name)) for name in CURVES}
        for name in RATES * ("growth" in spec.fields) + ("kind",) * spec.growing:
            found[name] = Variable(SHAPE, _fill(name), _about(name, GROWTH[name]))
    if "folds" in spec.fields:
        texts = {
            "fold_gamma": "speed of a fold, at which the number of shapes changes by two",
            "fold_r_f": "distance of the fish from the axis over tow radius at a fold",
            "fold_change": "shapes above less shapes below the speed of a fold",
            "fold_below": "shapes just below the speed of a fold",
            "fold_error": "estimated relative error of the speed of a fold",
        }
        if "origin" in spec.fields:
            texts["fold_n"] = (
                "number of the fold of the vacuum that a fold is continued from, 0 for one that drag makes"
            )
        fills = {"fold_change": np.int8(0), "fold_below": np.int32(-1), "fold_n": np.int32(-1)}
        for name, text in texts.items():
            found[name] = Variable(FOLD, fills.get(name, np.nan), {"long_name": text, "units": "1"}, stage="folds")
        codes = {"long_name": "outcome of the search for folds"} | _flags(status.FLAG_MEANINGS)
        found["folds"] = Variable(CABLE, np.int32(0), {"long_name": "number of folds", "units": "1"}, stage="folds")
        found["folds_status"] = Variable(CABLE, np.int8(status.OK), codes, stage="folds")
    if spec.checks:
        of_folds = {name: variable for name, variable in found.items() if variable.stage == "folds"}
        found |= {f"check_{name}": replace(variable, stage="checks") for name, variable in of_folds.items()}
        for axis in spec.cable_axes:
            about = {"long_name": f"{NAMES[axis.name]}, at random", "units": "1"}
            found[f"check_{axis.name}"] = Variable(CABLE, np.nan, about, stage="checks")
        text = "error of the logarithm of speeds looked up; inf where folds are others, missing where none are told"
        found["check_error"] = Variable(CABLE, np.nan, {"long_name": text, "units": "1"}, stage="checks")
    return found


def _fill(name: str) -> Any:
    if name in ("nodes", "unstable"):
        return np.int32(-1)
    return np.int8(0) if name in ("near_axis", "growth_status", "kind") else np.nan


def _about(name: str, long_name: str) -> dict[str, Any]:
    if name == "kind":
        return {"long_name": long_name} | _flags(" ".join(KINDS))
    if name == "growth_status":
        return {"long_name": long_name} | _flags(status.FLAG_MEANINGS)
    if name == "near_axis":
        return {"long_name": long_name} | _flags("no yes")
    return {"long_name": long_name, "units": "degree" if name == "phase_deg" else "1"}


def _flags(meanings: str) -> dict[str, Any]:
    return {"flag_values": np.arange(len(meanings.split()), dtype=np.int8), "flag_meanings": meanings}


@dataclass(frozen=True)
class Tiles:
    """The systems of a map, cut into blocks along its axes.

    Attributes
    ----------
    axes : tuple of Axis
    block : tuple of int
        Points of a tile along each of them; fewer at the ends.
    """

    axes: tuple[Axis, ...]
    block: tuple[int, ...]

    @property
    def shape(self) -> tuple[int, ...]:
        """Tiles along each axis."""
        return tuple(ceil(len(axis.values) / size) for axis, size in zip(self.axes, self.block, strict=True))

    def __len__(self) -> int:
        return prod(self.shape)

    def slices(self, number: int) -> tuple[slice, ...]:
        """Where a tile lies.

        Parameters
        ----------
        number : int
            From 0.

        Returns
        -------
        tuple of slice
            Along each axis.
        """
        places = []
        for count in reversed(self.shape):
            number, place = divmod(number, count)
            places.append(place)
        return tuple(
            slice(place * size, min((place + 1) * size, len(axis.values)))
            for place, size, axis in zip(reversed(places), self.block, self.axes, strict=True)
        )

    def indices(self, number: int) -> tuple[NDArray[np.int64], ...]:
        """Indices of the systems of a tile along each axis, the last running fastest.

        Parameters
        ----------
        number : int

        Returns
        -------
        tuple of ndarray of int, shape (systems,)
        """
        grids = np.meshgrid(*(np.arange(part.start, part.stop) for part in self.slices(number)), indexing="ij")
        return tuple(grid.ravel() for grid in grids)


def state_tiles(spec: Spec) -> Tiles:
    """Tiles of shapes, none of a map of folds alone.

    Parameters
    ----------
    spec : Spec

    Returns
    -------
    Tiles
    """
    return _cut(spec.axes, spec.tile)


def fold_tiles(spec: Spec) -> Tiles:
    """Tiles of folds.

    Parameters
    ----------
    spec : Spec

    Returns
    -------
    Tiles
    """
    return _cut(spec.cable_axes, spec.fold_tile)


def _cut(axes: tuple[Axis, ...], most: int) -> Tiles:
    """As long as may be along the last axis, and about even."""
    block: list[int] = []
    for axis in reversed(axes):
        points = len(axis.values)
        block.insert(0, ceil(points / ceil(points / most)))
        most = max(1, most // block[0])
    return Tiles(axes, tuple(block))


def stages(spec: Spec) -> dict[str, Tiles]:
    """The tiles of a map, which are numbered in this order.

    Parameters
    ----------
    spec : Spec

    Returns
    -------
    dict of Tiles
        Those there are of "shapes", "folds" and "checks".
    """
    found = {"shapes": state_tiles(spec)} if spec.states else {}
    if "folds" in spec.fields:
        found["folds"] = fold_tiles(spec)
    if spec.checks:
        found["checks"] = _cut((Axis("check", np.arange(float(spec.checks)), "listed"),), spec.fold_tile)
    return found


def count_tiles(spec: Spec) -> int:
    """How many tiles a map has.

    Parameters
    ----------
    spec : Spec

    Returns
    -------
    int
    """
    return sum(len(tiles) for tiles in stages(spec).values())


def place_of(spec: Spec, number: int) -> tuple[str, Tiles, int]:
    """Where a tile of a map stands.

    Parameters
    ----------
    spec : Spec
    number : int
        From 0.

    Returns
    -------
    stage : str
        Of `stages`.
    tiles : Tiles
        Of that stage.
    number : int
        Among these.
    """
    for stage, tiles in stages(spec).items():
        if number < len(tiles):
            return stage, tiles, number
        number -= len(tiles)
    raise IndexError(number)
