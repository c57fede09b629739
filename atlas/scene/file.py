"""Reading a scene: its TOML file, every key checked, units in SI."""

import os
from collections.abc import Mapping
from contextlib import suppress
from importlib import resources
from importlib.resources.abc import Traversable
from math import nan
from pathlib import Path
from typing import Any

from towatlas.scene import derived
from towatlas.scene.keys import KEYS, parse_scene
from towatlas.scene.library import STANDARD_GRAVITY, SceneFileError, find_type, parse_toml, read_toml
from towatlas.scene.scene import SPEED_KEYS, Scene

__all__ = ["SceneFileError", "make_scene", "read_scene", "scene_of_text", "shipped_scenes"]


def shipped_scenes() -> list[str]:
    """Names of the scenes that come with the package.

    Returns
    -------
    list of str

    Examples
    --------
    >>> shipped_scenes()
    ['skop-fig3', 'skop-fig4', 'skop-fig5']
    """
    folder = resources.files("towatlas.scene") / "scenes"
    return sorted(entry.name[:-5] for entry in folder.iterdir() if entry.name.endswith(".toml"))


def read_scene(path: str | os.PathLike, changes: Mapping[str, Any] | None = None) -> Scene:
    """Read a scene.

    Parameters
    ----------
    path : path
        A TOML file, or the name of a scene that comes with the package, `shipped_scenes()`. A file goes first.
    changes : mapping, optional
        Other values of some keys, as {"fish.mass": "9 kg"}; a text that is a number is one.

    Returns
    -------
    Scene

    Raises
    ------
    SceneFileError
        If it or its library of cables cannot be read, or is no TOML.
    ValueError
        If a key is unknown, missing, contradictory, out of range or has a wrong unit; the message names file and key.

    Examples
    --------
    >>> system = read_scene("skop-fig3").system("air")
    >>> round(system.lam, 1), round(system.w_f), round(system.C, 3)
    (37.8, 1352, 0.018)
    """
    name = os.fspath(path)
    file: Path | Traversable = Path(path)
    if not file.is_file() and name in shipped_scenes():
        file = resources.files("towatlas.scene") / "scenes" / f"{name}.toml"
    table = read_toml(
        file,
        name,
        "scene",
        lambda: f"no scene at {path}; scenes that come with the package: {', '.join(shipped_scenes())}",
    )
    return _named(table, name, changes)


def scene_of_text(content: bytes, source: str) -> Scene:
    """A scene from the bytes of its file.

    Parameters
    ----------
    content : bytes
    source : str
        Where they are from. A library of cables is looked for in its folder.

    Returns
    -------
    Scene

    Raises
    ------
    SceneFileError, ValueError
        As `read_scene`.
    """
    return _named(parse_toml(content, source, "scene"), source)


def _named(table: dict[str, Any], source: str, changes: Mapping[str, Any] | None = None) -> Scene:
    try:
        for key, value in (changes or {}).items():
            _change(table, key, value)
        return make_scene(table, source)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None


def _change(table: dict[str, Any], key: str, value: Any) -> None:
    """Put another value of a key into the tables of a scene; a speed takes the place of that of any other kind."""
    section, _, name = key.rpartition(".")
    if isinstance(value, str):
        with suppress(ValueError):
            value = float(value)
    holder = table.setdefault(section, {}) if section else table
    if not isinstance(holder, dict):
        raise ValueError(f"{section} must be a table")
    # Without a radius two of these give it: each is changed by itself.
    if key in SPEED_KEYS and "radius" in holder:
        for other in SPEED_KEYS:
            holder.pop(other.rpartition(".")[2], None)
    holder[name] = value


def make_scene(table: dict[str, Any], source: str = "") -> Scene:
    """A scene from the tables of its file.

    Parameters
    ----------
    table : dict
        As `tomllib` reads them.
    source : str
        Where it was read from. A library of cables is looked for in its folder.

    Returns
    -------
    Scene

    Raises
    ------
    SceneFileError
        If its library of cables cannot be read.
    ValueError
        As `read_scene`, without the name of the file.
    """
    given, deviations, notes = parse_scene(table)
    if table.get("fish") == {}:
        raise ValueError("fish.mass is missing; without a fish leave out the section [fish]")
    cable_type = None
    if "cable.type" in given:
        cable_type = find_type(given["cable.type"], given.get("cable.library"), Path(source).parent)
    elif "cable.library" in given:
        raise ValueError("cable.type is missing: which of the cables of cable.library")
    added = cable_type.beside(given) if cable_type else {}
    values = given | added
    if cable_type:
        deviations = cable_type.scatter(added) | deviations
    numbers = scene_numbers(values)
    density = numbers["density"]
    if density and numbers["fish_mass"] and "fish.drag_coefficient" not in values:
        notes.append("fish.drag_coefficient is not given: the fish has no drag; 0 says so without this line")
    left_out = derived.left_out(given, given.get("cable.type", ""))
    if not density and left_out["vacuum"]:
        notes.append(f"in a vacuum nothing depends on {', '.join(left_out['vacuum'])}")
    scene = Scene(
        title=values.get("title", ""),
        source=source,
        **numbers,
        turn=values.get("tow.turn", "starboard"),
        tolerance=values.get("tolerance", 0.01),
        cable_type=cable_type,
        notes=tuple(notes),
        left_out=left_out,
        given=_written(table),
        values=values,
        deviations=deviations,
    )
    if scene.medium == "water" and scene.fish_displaced != scene.fish_displaced:
        raise ValueError(
            "fish.volume or fish.submerged_weight is missing: in a fluid as dense as this the fish needs its buoyancy"
        )
    return scene


def scene_numbers(values: dict[str, Any]) -> dict[str, float]:
    """The numbers of a scene, as fields of `Scene`.

    Parameters
    ----------
    values : dict
        In SI, by "section.key", those of a type of cable among them.

    Returns
    -------
    dict of float

    Raises
    ------
    ValueError
        For keys that are missing, or contradict each other.
    """
    density = derived.fluid_density(values)
    gravity = values.get("gravity", STANDARD_GRAVITY)
    radius, speed = derived.circle(values, gravity)
    if density:
        for key in ("cable.diameter", "cable.drag_coefficient"):
            if key not in values:
                raise ValueError(f"{key} is missing: in a fluid the cable needs it for its drag")
    mass, displaced = derived.cable_mass(values, density, gravity)
    fish = any(key.startswith("fish.") for key in values)
    fish_mass, fish_displaced = derived.fish_mass(values, density, gravity) if fish else (0.0, 0.0)
    side, sine = derived.side_force(values, density)
    return {
        "length": values.get("cable.length", nan),
        "mass_per_length": mass,
        "displaced_per_length": displaced,
        "diameter": values.get("cable.diameter", nan),
        "drag_coefficient": values.get("cable.drag_coefficient", nan),
        "tangential_drag_coefficient": derived.tangential_drag(values),
        "side_force_coefficient": side,
        "side_force_sine": sine,
        "fish_mass": fish_mass,
        "fish_displaced": fish_displaced,
        "fish_added_mass": derived.fish_added_mass(values, fish_displaced),
        "fish_drag_area": derived.fish_drag_area(values),
        "radius": radius,
        "speed": speed,
        "density": density,
        "gravity": gravity,
        "breaking_strength": values.get("cable.breaking_strength", nan),
    }


def _written(table: dict[str, Any]) -> dict[str, str]:
    """Length, radius, speed and forces as they are written, a number without a unit with the one it is taken for."""
    texts = {}
    for name in ("cable.length", "cable.breaking_strength", "fish.submerged_weight", "tow.radius", *SPEED_KEYS):
        section, key = name.split(".")
        if key in table.get(section, {}):
            value = table[section][key]
            unit = "rpm" if key == "rpm" else KEYS[section][key]
            texts[name] = value if isinstance(value, str) else f"{float(value):g} {unit}".strip()
    return texts
