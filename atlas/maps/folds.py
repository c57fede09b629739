"""Folds looked up in a map: interpolated where all points around have the same ones, and solved for from there."""

from dataclasses import dataclass
from functools import reduce

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS
from towatlas.maps.lookup import Cell, Map, OutsideMap
from towatlas.maps.systems import RATIOS, Spec
from towatlas.numerics.errormap import SAFETY
from towatlas.results import Folds
from towatlas.solve.folds import origin_of
from towatlas.solve.paths import Path, solve_folds
from towatlas.solve.search import search
from towatlas.system import System

Array = NDArray[np.float64]
# What has to be the same at all points around.
SAME = ("folds", "fold_change", "fold_below", "fold_n")
VALUES = ("folds_status", "fold_gamma", "fold_r_f")
# A number of a system is that of the map, or an end of its axis, within the rounding of a ratio.
ROUNDED = 1e-12


class NotInMap(ValueError):
    """A point within the axes of a map which does not tell its folds."""


@dataclass(frozen=True)
class Seeds:
    """Folds interpolated.

    Attributes
    ----------
    log_gamma, x : ndarray, shape (folds,)
        log of the speed, and of the radius of the fish over g / Omega^2.
    change, below : ndarray of int, shape (folds,)
        Shapes above less shapes below, and shapes below.
    n : ndarray of int, shape (folds,), or None
        Of the transition of the vacuum; None where the map does not hold it.
    """

    log_gamma: Array
    x: Array
    change: NDArray[np.int64]
    below: NDArray[np.int64]
    n: NDArray[np.int64] | None


def seeds_of(data: xr.Dataset, cells: dict[str, Cell]) -> Seeds:
    """Folds between the points of a map.

    Parameters
    ----------
    data : xarray.Dataset
        A map, over its axes.
    cells : dict of Cell
        Around a point, by axis.

    Returns
    -------
    Seeds

    Raises
    ------
    NotInMap
        If the points around have other folds, or one of them could not be made out.
    """
    names = [name for name in SAME if name in data]
    box = data[[*names, *VALUES]].isel({name: cell.around for name, cell in cells.items()})
    around = {str(name): array.values.reshape(-1, *array.shape[len(cells) :]) for name, array in box.items()}
    if (around["folds_status"] != status.OK).any():
        raise NotInMap("the folds of a point around were not made out")
    if any((around[name] != around[name][0]).any() for name in names):
        raise NotInMap("points around have other folds")
    weights = reduce(np.multiply.outer, [np.array(cell.weights) for cell in cells.values()]).ravel()
    count = int(around["folds"][0])
    log_gamma = np.log(np.abs(around["fold_gamma"][:, :count]))
    log_r = np.log(around["fold_r_f"][:, :count])
    change, below, n = (
        around[name][0, :count].astype(np.int64) if name in names else None
        for name in ("fold_change", "fold_below", "fold_n")
    )
    assert change is not None
    assert below is not None
    return Seeds(weights @ log_gamma, weights @ (log_r + 2.0 * log_gamma), change, below, n)


def check_errors(spec: Spec, data: xr.Dataset) -> Array:
    """What interpolation is off by at the checks of a map.

    Parameters
    ----------
    spec : Spec
    data : xarray.Dataset
        The map, with its checks.

    Returns
    -------
    ndarray, shape (checks,)
        Largest difference of log speed from the folds solved directly; 0 where there are none, nan where the map or the
        solver does not tell, inf where the folds are others.
    """
    points = spec.check_points()
    data = data[[name for name in (*SAME, *VALUES) if name in data]].load().merge(_checks(data))
    errors = np.full(spec.checks, np.nan)
    for k in range(spec.checks):
        known = data.isel(check=k)
        cells = {axis.name: Cell.of(axis.values, points[axis.name][k], axis.spacing) for axis in spec.cable_axes}
        try:
            seeds = seeds_of(data, cells)
        except NotInMap:
            continue
        if int(known["check_folds_status"]) == status.OK:
            errors[k] = _distance(seeds, known)
    return errors


def _checks(data: xr.Dataset) -> xr.Dataset:
    return data[[name for name in data if str(name).startswith("check_fold")]].load()


def _distance(seeds: Seeds, known: xr.Dataset) -> float:
    """How far folds that were solved for are from seeds, inf where they are others."""
    count = int(known["check_folds"])
    pairs = [("fold_change", seeds.change), ("fold_below", seeds.below), ("fold_n", seeds.n)]
    for name, column in pairs:
        if column is not None and not np.array_equal(known[f"check_{name}"].values[:count], column):
            return np.inf
    away = np.abs(np.log(np.abs(known["check_fold_gamma"].values[:count])) - seeds.log_gamma)
    return float(away.max(initial=0.0))


def find_folds(known: Map, system: System, slow: float, fast: float) -> Folds:
    """Folds of a system between two speeds, from a map.

    Parameters
    ----------
    known : Map
        With folds, and checks of them.
    system : System
    slow, fast : float
        [-], of one sign, the slower first.

    Returns
    -------
    Folds
        As of `folds_in_speed`; n and origin are those of the points around, where the map holds them.

    Raises
    ------
    OutsideMap
        If the system or a speed is not within the map.
    NotInMap
        If the points around have other folds, or Newton's method comes to others from there.
    ValueError
        For a map without folds, or without checks of them.
    """
    data = known.dataset
    if "check_error" not in data:
        raise ValueError("this map holds no folds, or none that were checked: field folds, and [folds] checks")
    ends = sorted((float(end) for end in data.attrs["folds_gamma"]), key=abs)
    if not (slow * ends[0] > 0.0 and abs(ends[0]) <= abs(slow) and abs(fast) <= abs(ends[1])):
        raise OutsideMap(f"speeds {slow:g} to {fast:g} are not all in the map, which has {ends[0]:g} to {ends[1]:g}")
    seeds = seeds_of(data, _cells(data, system))
    errors = data["check_error"].values
    answered = errors[~np.isnan(errors)]
    if not np.isfinite(answered).any():
        raise NotInMap("no check of the map lies where it tells folds: how well it tells folds is not known")
    off = SAFETY * float(answered[np.isfinite(answered)].max())
    path = Path(system.row(), ends[0], ("gamma",))
    guess = seeds.log_gamma - np.log(abs(ends[0]))
    x, t, error, solved = solve_folds(path, seeds.x, guess)
    marks = np.concatenate([[0.0], t, [np.log(ends[1] / ends[0])]])
    if not (solved & (np.abs(t - guess) <= off)).all() or not (np.diff(marks) > 0.0).all():
        raise NotInMap("Newton's method does not come to the folds of the points around")
    looked = _count(path, marks, seeds)
    _, speeds = path.at(t)
    wrong = int(np.isinf(answered).sum())
    n = np.zeros(len(t), np.int64) if seeds.n is None else seeds.n
    found = Folds(
        system=system,
        moved="gamma",
        value=speeds,
        gamma=speeds,
        r_f=np.exp(x) / np.square(speeds),
        shapes_below=seeds.below,
        shapes_above=seeds.below + seeds.change,
        n=n,
        origin=np.full(len(n), "") if seeds.n is None else origin_of(n),
        error=error,
        status=np.full(len(t), status.OK, np.int8),
        complete=True,
        searched=f"gamma {ends[0]:g} to {ends[1]:g} in a map, all points of which around this system have such folds; "
        f"solved from there, shapes counted at {looked} speeds; of {len(answered)} systems at random of which the map "
        f"tells folds, {wrong} have others",
    )
    return found.part((np.abs(speeds) >= abs(slow)) & (np.abs(speeds) <= abs(fast)))


def _count(path: Path, marks: Array, seeds: Seeds) -> int:
    """At how many speeds shapes were counted: both ends, and between folds; as many as should be there."""
    t = np.concatenate([marks[:1], 0.5 * (marks[1:] + marks[:-1]), marks[-1:]])
    found = search(*path.at(t))
    counts = np.bincount(found.row, minlength=len(t))
    first = seeds.below[0] if len(seeds.below) else counts[0]
    if (found.status != status.OK).any() or (counts != first + np.cumsum([0, 0, *seeds.change, 0])).any():
        raise NotInMap("between the folds of the points around there are other numbers of shapes")
    return len(t)


def _cells(data: xr.Dataset, system: System) -> dict[str, Cell]:
    """Around a system, whose other numbers have to be those of the map."""
    numbers = {name: getattr(system, name) for name in COLUMNS}
    with np.errstate(divide="ignore", invalid="ignore"):
        numbers |= {ratio: float(np.divide(numbers[a], numbers[b])) for ratio, (a, b) in RATIOS.items()}
    cells = {}
    for name in map(str, data["folds"].dims):
        values, at = data[name].values, numbers[name]
        for end in (values[0], values[-1]):
            at = float(end) if np.isclose(at, end, rtol=ROUNDED, atol=0.0) else at
        if not values[0] <= at <= values[-1]:
            raise OutsideMap(f"{name} = {at:g} is outside the map, which has {values[0]:g} to {values[-1]:g}")
        cells[name] = Cell.of(values, at, data[name].attrs["spacing"])
    held = {name.removeprefix("system_"): float(data.attrs[name]) for name in data.attrs if name.startswith("system_")}
    held |= {name: numbers[name] for name in cells}
    for ratio, (name, of) in RATIOS.items():
        if ratio in held:
            held[name] = held.pop(ratio) * held[of]
    of_map = System.of(**held)
    for name in COLUMNS:
        if not np.isclose(numbers[name], getattr(of_map, name), rtol=ROUNDED, atol=0.0):
            raise OutsideMap(f"{name} = {numbers[name]:g} is outside the map, which has {getattr(of_map, name):g}")
    return cells
