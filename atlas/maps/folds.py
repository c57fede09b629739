"""Folds looked up in a map: the points around say over which speeds all shapes have to be followed."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS
from towatlas.maps.lookup import Cell, Map, OutsideMap
from towatlas.maps.systems import RATIOS, Spec, system_of
from towatlas.results import Folds
from towatlas.solve.folds import folds_in_speed, name_folds, origin_of, solve_folds_between
from towatlas.solve.paths import Path
from towatlas.solve.search import search
from towatlas.system import System

Array = NDArray[np.float64]
# What is read of a map.
HELD = ("folds", "folds_status", "fold_gamma", "fold_n")
# How far beyond the speeds of the folds of the points around, in the logarithm.
MARGIN = 0.6
# Above not the same: half way between, where a trace looks first, would be the fold itself, two shapes in one.
MARGIN_ABOVE = 0.67
# A number of a system is that of the map, or an end of its axis, within the rounding of a ratio.
ROUNDED = 1e-12


class NotInMap(ValueError):
    """A point within the axes of a map which does not tell its folds."""


def folds_around(data: xr.Dataset, cells: dict[str, Cell], system: System, low: float, high: float) -> Folds:
    """Folds of a system by those of the points of a map around it.

    All its shapes are followed over the speeds of these folds, and counted at the ends of the map.

    Parameters
    ----------
    data : xarray.Dataset
        A map, over its axes.
    cells : dict of Cell
        Around the system, by axis.
    system : System
    low, high : float
        Speeds of the map [-], of one sign, the slower first.

    Returns
    -------
    Folds
        With n and origin where the map has them.

    Raises
    ------
    NotInMap
        If the folds of a point around could not be made out, or not all shapes of the system.
    """
    box = data[[name for name in HELD if name in data]].isel({name: cell.around for name, cell in cells.items()})
    around = {str(name): array.values.reshape(-1, *array.shape[len(cells) :]) for name, array in box.items()}
    if (around["folds_status"] != status.OK).any():
        raise NotInMap("the folds of a point around were not made out")
    if system.in_vacuum:
        return folds_in_speed(system, low, high)
    top = np.log(high / low)
    # Where there are none, in the middle, so that something is looked at.
    t = np.log(around["fold_gamma"][np.isfinite(around["fold_gamma"])] / low) if around["folds"].any() else 0.5 * top
    first, last = max(0.0, float(np.min(t)) - MARGIN), min(top, float(np.max(t)) + MARGIN_ABOVE)
    found = solve_folds_between(system, low * np.exp(first), ("gamma",), np.exp(last - first), named=False)
    ends = search(*Path(system.row(), low, ("gamma",)).at(np.array([0.0, top])))
    if not found.complete or (ends.status != status.OK).any():
        raise NotInMap("its shapes were not made out")
    below, above = (int((ends.row == k).sum()) for k in range(2))
    if above != below + (found.shapes_above - found.shapes_below).sum() or (found.shapes_below[:1] != below).any():
        raise NotInMap("beyond the speeds of the folds of the points around there are other folds")
    return _named(found, around) if "fold_n" in around else found


def _named(found: Folds, around: dict[str, NDArray[Any]]) -> Folds:
    """Folds with the numbers on which all points around that have folds agree, or else their own.

    Where some have more folds than others, the one that is left is here that of one pair, there that of another.
    """
    count, some = len(found), around["folds"] > 0
    numbers = around["fold_n"][some, :count].astype(np.int64)
    if len(numbers) and (around["folds"][some] == count).all() and (numbers == numbers[0]).all():
        return replace(found, n=numbers[0], origin=origin_of(numbers[0]))
    return name_folds(found)


def check_errors(spec: Spec, data: xr.Dataset, tick: Callable[[], object]) -> Array:
    """How well a map tells folds: at its checks.

    Parameters
    ----------
    spec : Spec
    data : xarray.Dataset
        The map, with its checks.
    tick : callable
        Called for each check.

    Returns
    -------
    ndarray, shape (checks,)
        Largest difference of log speed from the folds solved directly; 0 where there are none, nan where the map or the
        solver does not tell, inf where the folds are others.
    """
    assert spec.span is not None
    low, high = sorted(spec.span, key=abs)
    data = data[[name for name in data if name in HELD or str(name).startswith("check_fold")]].load()
    points = spec.check_points()
    numbers = spec.whole(points)
    errors = np.full(spec.checks, np.nan)
    for k in range(spec.checks):
        tick()
        known = data.isel(check=k)
        if int(known["check_folds_status"]) != status.OK:
            continue
        cells = {axis.name: Cell.of(axis.values, points[axis.name][k], axis.spacing) for axis in spec.cable_axes}
        with suppress(NotInMap, ArithmeticError):
            errors[k] = _distance(folds_around(data, cells, system_of(numbers, k)[0], low, high), known)
    return errors


def _distance(found: Folds, known: xr.Dataset) -> float:
    """How far folds are from those solved for directly, inf where they are others."""
    count = int(known["check_folds"])
    columns = {"change": found.shapes_above - found.shapes_below, "below": found.shapes_below, "n": found.n}
    for name, column in columns.items():
        if f"check_fold_{name}" in known and not np.array_equal(known[f"check_fold_{name}"].values[:count], column):
            return np.inf
    return float(np.abs(np.log(known["check_fold_gamma"].values[:count] / found.gamma)).max(initial=0.0))


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
        As of `folds_in_speed`; named where the map holds origins.

    Raises
    ------
    OutsideMap
        If the system or a speed is not within the map.
    NotInMap
        If the map does not tell them.
    ValueError
        For a map without folds, or without checks of them.
    """
    data = known.dataset
    if "check_error" not in data:
        raise ValueError("this map holds no folds, or none that were checked: field folds, and [folds] checks")
    if abs(slow) > abs(fast):
        raise ValueError(f"the slower speed goes first, not {slow:g}, {fast:g}")
    low, high = sorted((float(end) for end in data.attrs["folds_gamma"]), key=abs)
    if not slow * low > 0.0:
        raise OutsideMap(f"speeds {slow:g} to {fast:g} are of a turn to the other side than those of the map")
    if not (abs(low) <= abs(slow) and abs(fast) <= abs(high)):
        raise OutsideMap(f"speeds {slow:g} to {fast:g} are not all in the map, which has {low:g} to {high:g}")
    cells = _cells(data, system)
    errors = data["check_error"].values
    answered = errors[~np.isnan(errors)]
    if not np.isfinite(answered).any():
        raise NotInMap("no check of the map was told its folds: how well it tells folds is not known")
    found = folds_around(data, cells, system, low, high)
    wrong, some = int(np.isinf(answered).sum()), int((data["check_folds"].values[~np.isnan(errors)] > 0).sum())
    searched = (
        f"gamma {low:g} to {high:g} by a map: shapes counted at both, and followed over the speeds of the folds of all "
        f"points around it; of {len(answered)} random systems, {some} with folds, {wrong} have others than told"
    )
    speeds = np.abs(found.gamma)
    return replace(found, searched=searched).part((abs(slow) <= speeds) & (speeds <= abs(fast)))


def _cells(data: xr.Dataset, system: System) -> dict[str, Cell]:
    """Around a system, whose other numbers have to be those of the map."""
    numbers = {name: getattr(system, name) for name in COLUMNS}
    with np.errstate(divide="ignore", invalid="ignore"):
        numbers |= {ratio: float(np.divide(numbers[a], numbers[b])) for ratio, (a, b) in RATIOS.items()}
    cells = {}
    # A ratio of nothing to nothing is outside because of another number.
    for name in sorted(map(str, data["folds"].dims), key=lambda name: name in RATIOS):
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
