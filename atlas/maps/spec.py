"""What a map is of, as its file says; every key of it checked."""

import difflib
from collections.abc import Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from towatlas.checks import short
from towatlas.maps.systems import NAMES, RATIOS, Axis, Spec
from towatlas.scene.library import read_toml

FIELDS = ("count", "nodes", "position", "tension", "growth", "kind", "shapes", "folds", "origin")
BRANCHES = ("all", "expected")
SPACINGS = ("linear", "log")
KEYS = {
    "": ("title", "fields", "branches", "tile"),
    "system": tuple(NAMES),
    "axes": tuple(NAMES),
    "axis": ("from", "to", "points", "spacing"),
    "shapes": ("points",),
    "folds": ("from", "to", "checks"),
}
# Values of an axis, systems of a tile, systems of a map: beyond, a machine would be busy for years.
MOST_POINTS, MOST_IN_A_TILE, MOST_SYSTEMS = 10**6, 10**4, 10**10
MOST_CHECKS = 10**5


def shipped_specs() -> list[str]:
    """Names of the maps whose specs come with the package.

    Returns
    -------
    list of str

    Examples
    --------
    >>> shipped_specs()
    ['air-tests', 'wet-folds', 'wet-survey']
    """
    return sorted(entry.name[:-5] for entry in resources.files(__package__).iterdir() if entry.name.endswith(".toml"))


def spec_file(path: str | Path) -> Path | Traversable:
    """The file of a spec: a file of that name, or one that comes with the package.

    Parameters
    ----------
    path : path

    Returns
    -------
    path
    """
    if not Path(path).is_file() and str(path) in shipped_specs():
        return resources.files(__package__) / f"{path}.toml"
    return Path(path)


def read_spec(path: str | Path) -> Spec:
    """Read a spec.

    Parameters
    ----------
    path : path
        A TOML file, or the name of one that comes with the package.

    Returns
    -------
    Spec

    Raises
    ------
    SceneFileError
        If it cannot be read, or is no TOML.
    ValueError
        As `make_spec`.

    Examples
    --------
    >>> [axis.name for axis in read_spec("air-tests").axes]
    ['w_f', 'lam', 'gamma']
    """
    absent = f"no spec of a map at {path}; those that come with the package: {', '.join(shipped_specs())}"
    table = read_toml(spec_file(path), str(path), "spec of a map", lambda: absent)
    try:
        return make_spec(table)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def make_spec(table: Mapping[str, Any]) -> Spec:
    """A spec from the tables of its file.

    Parameters
    ----------
    table : dict
        As `tomllib` reads them.

    Returns
    -------
    Spec

    Raises
    ------
    ValueError
        If a key is unknown, missing, contradictory, of another kind or out of range; the message names it.
    """
    sections = {name: _section(table, name) for name in ("system", "axes", "shapes", "folds")}
    _check_keys(table, (*KEYS[""], *sections), "")
    title = table.get("title", "")
    if not isinstance(title, str):
        raise ValueError(f"title = {short(title)} is not a text")
    fields = _fields(table.get("fields"))
    branches = table.get("branches", "all")
    if branches not in BRANCHES:
        raise ValueError(f'branches = {short(branches)} must be "all" or "expected"')
    axes = tuple(_axis(name, value) for name, value in sections["axes"].items())
    fixed = {name: _value(f"system.{name}", name, value) for name, value in sections["system"].items()}
    spec = Spec(
        title=title,
        fields=fields,
        branches=branches,
        tile=_whole("tile", table.get("tile", 1000), MOST_IN_A_TILE),
        fixed=fixed,
        axes=axes,
        stations=_whole("shapes.points", sections["shapes"].get("points", 33), 1000, 2) if "shapes" in fields else 0,
        span=_span(fields, sections["folds"], axes, fixed),
        checks=_whole("folds.checks", sections["folds"].get("checks", 0), MOST_CHECKS, 0),
    )
    if "origin" in fields and "folds" not in fields:
        raise ValueError('"origin" is that of folds: give the field "folds", too')
    if "shapes" not in fields and "shapes" in table:
        raise ValueError('[shapes] says how finely, but "shapes" is not among the fields')
    _check_whole(spec)
    return spec


def _section(table: Mapping[str, Any], name: str) -> dict[str, Any]:
    section = table.get(name, {})
    if not isinstance(section, dict):
        raise ValueError(f"{name} = {short(section)} is a section; write [{name}] and its keys below")
    _check_keys(section, KEYS[name], name)
    return section


def _check_keys(table: Mapping[str, Any], known: tuple[str, ...], section: str) -> None:
    for key in table:
        if key not in known:
            near = difflib.get_close_matches(key, known, 1, 0.5)
            other = [
                f"{name}.{key}" for name, keys in KEYS.items() if key in keys and name not in ("", "axis", section)
            ]
            remedy = f"do you mean {(near or other)[0]}?" if near or other else f"known are {', '.join(known)}"
            raise ValueError(f"key {f'{section}.' if section else ''}{key} is unknown; {remedy}")


def _fields(given: Any) -> tuple[str, ...]:
    if not isinstance(given, list) or not given:
        raise ValueError(f"fields must be a list of some of {', '.join(FIELDS)}; got {short(given)}")
    for field in given:
        if field not in FIELDS:
            near = difflib.get_close_matches(str(field), FIELDS, 1, 0.5)
            raise ValueError(
                f"field {short(field)} is unknown; "
                + (f"do you mean {near[0]}?" if near else f"known are {', '.join(FIELDS)}")
            )
    return tuple(field for field in FIELDS if field in given)


def _axis(name: str, given: Any) -> Axis:
    where = f"axes.{name}"
    if isinstance(given, list):
        values = np.array([_value(where, name, value) for value in given])
        if len(values) == 0:
            raise ValueError(f"{where} is empty")
        spacing = "listed"
    elif isinstance(given, dict):
        _check_keys(given, KEYS["axis"], where)
        if missing := [key for key in ("from", "to", "points") if key not in given]:
            raise ValueError(f"{where}.{missing[0]} is missing")
        low, high = (_value(f"{where}.{key}", name, given[key]) for key in ("from", "to"))
        points = _whole(f"{where}.points", given["points"], MOST_POINTS, 2)
        spacing = given.get("spacing", "linear")
        if spacing not in SPACINGS:
            raise ValueError(f'{where}.spacing = {short(spacing)} must be "linear" or "log"; or list the values')
        if not (low < high and isfinite(high)):
            raise ValueError(f"{where}: from {low:g} to {high:g} is empty; from must be below to, and both finite")
        if spacing == "log" and low <= 0.0:
            raise ValueError(f"{where}.from = {low:g}: a logarithmic axis needs positive numbers")
        values = np.geomspace(low, high, points) if spacing == "log" else np.linspace(low, high, points)
    else:
        raise ValueError(f"{where} = {short(given)} must be a list, or {{from = , to = , points = , spacing = }}")
    if not (np.diff(values) > 0.0).all():
        raise ValueError(f"{where} must rise from value to value")
    return Axis(name, values, spacing)


def _value(where: str, name: str, given: Any) -> float:
    """A number in the range that `System` takes."""
    if isinstance(given, bool) or not isinstance(given, (int, float)):
        raise ValueError(f"{where} = {short(given)} is not a number")
    try:
        value = float(given)
    except OverflowError:
        value = inf
    if not isfinite(value) and not (name == "b_s" and value == inf):
        raise ValueError(f"{where} = {short(given)} is not finite")
    if name in ("lam", "b_s", "m_f_over_w_f") and value <= 0.0:
        raise ValueError(f"{where} = {value:g} must be positive")
    if name == "gamma" and value == 0.0:
        raise ValueError(f"{where} = 0: positive in a turn to starboard, negative in one to port")
    if name in ("m_f", "C", "C_f", "C_t", "C_f_over_C", "C_t_over_C") and value < 0.0:
        raise ValueError(f"{where} = {value:g} is negative")
    if name == "w" and not -1.0 < value <= 1.0:
        raise ValueError(f"{where} = {value:g} must be above -1 and at most 1")
    return value


def _whole(where: str, given: Any, most: int, least: int = 1) -> int:
    if isinstance(given, bool) or not isinstance(given, int) or not least <= given <= most:
        raise ValueError(f"{where} = {short(given)} must be a whole number from {least} to {most:,}")
    return given


def _span(
    fields: tuple[str, ...], given: dict[str, Any], axes: tuple[Axis, ...], fixed: dict[str, float]
) -> tuple[float, float] | None:
    """Speeds between which folds are looked for: those given, or the ends of the axis."""
    if "folds" not in fields:
        if given:
            raise ValueError('[folds] says between which speeds, but "folds" is not among the fields')
        return None
    axis = next((axis for axis in axes if axis.name == "gamma"), None)
    if {*fields} <= {"folds", "origin"} and (axis is not None or "gamma" in fixed):
        raise ValueError("folds alone are of no one speed: give the range as [folds] from, to, and leave out gamma")
    ends = {"from": axis.values[0], "to": axis.values[-1]} if axis is not None else {}
    ends |= {key: _value(f"folds.{key}", "gamma", given[key]) for key in ("from", "to") if key in given}
    if missing := [key for key in ("from", "to") if key not in ends]:
        raise ValueError(f"folds.{missing[0]} is missing: between which speeds folds are looked for")
    low, high = float(ends["from"]), float(ends["to"])
    if not low < high or low * high < 0.0:
        raise ValueError(f"folds: from {low:g} to {high:g} must be two speeds of one sign, the lower first")
    return low, high


def _check_whole(spec: Spec) -> None:
    """What the keys say together."""
    named = [axis.name for axis in spec.axes]
    if not named:
        raise ValueError("[axes] is missing: a map is of at least one number that varies")
    if twice := sorted(set(named) & set(spec.fixed)):
        raise ValueError(f"{twice[0]} is in [system] and in [axes]; leave out one")
    known = {*named, *spec.fixed}
    for ratio, (name, _) in RATIOS.items():
        if {ratio, name} <= known:
            raise ValueError(f"{ratio} and {name} say the same; leave out one")
    for ratio in ("C_f_over_C", "C_t_over_C"):
        if ratio in known and "C" not in known:
            raise ValueError(f"{ratio} needs C, in [system] or [axes]")
    needed = ("lam", "w_f", "gamma") if spec.states else ("lam", "w_f")
    if missing := [name for name in needed if name not in known]:
        raise ValueError(f"{missing[0]} is missing; give it in [system] or in [axes]")
    weights = [axis.values for axis in spec.axes if axis.name == "w_f"] or [np.array([spec.fixed["w_f"]])]
    if weights[0].min() < 0.0 and "m_f" not in known:
        raise ValueError("w_f is negative, a fish lighter than the fluid, whose mass is its own: give m_f")
