"""Reading a scene: its TOML file, every key checked, units in SI."""

import difflib
import os
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from importlib import resources
from importlib.resources.abc import Traversable
from math import pi, sqrt
from pathlib import Path
from typing import Any

from towatlas.checks import short
from towatlas.scene.scene import SPEED_KEYS, Scene
from towatlas.scene.units import parse_quantity

STANDARD_GRAVITY = 9.80665
TEXT = "text"
# A scene is a page: what is longer is something else.
LARGEST = 10**6  # bytes
# Density of the fluids that have a name, kg/m^3: air at 15 degrees C and water, both at one atmosphere.
FLUIDS = {"vacuum": 0.0, "air": 1.225, "water": 1000.0, "seawater": 1025.0}

# Every key, its SI unit.
_KEYS: dict[str, dict[str, str]] = {
    "": {"title": TEXT, "gravity": "m/s^2", "tolerance": ""},
    "cable": {
        "length": "m",
        "mass_per_length": "kg/m",
        "submerged_weight_per_length": "N/m",
        "diameter": "m",
        "drag_coefficient": "",
    },
    "fish": {
        "mass": "kg",
        "submerged_weight": "N",
        "volume": "m^3",
        "added_mass": "kg",
        "drag_coefficient": "",
        "frontal_area": "m^2",
    },
    "tow": {"radius": "m", "speed": "m/s", "rpm": "rad/s", "rotation_rate": "rad/s", "gamma": ""},
    "fluid": {"name": TEXT, "density": "kg/m^3"},
}
_SIGNED = {"cable.submerged_weight_per_length", "fish.submerged_weight"}
_MAY_BE_ZERO = {
    "cable.drag_coefficient",
    "fish.mass",
    "fish.volume",
    "fish.added_mass",
    "fish.drag_coefficient",
    "fish.frontal_area",
    "fluid.density",
}


class SceneFileError(OSError):
    """A file that cannot be read as a scene: absent, unreadable, or no TOML."""


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
        If it cannot be read, or is no TOML.
    ValueError
        If a key is unknown, missing, contradictory, out of range or has a wrong unit; the message names file and key.

    Examples
    --------
    >>> system = read_scene("skop-fig3").system("air")
    >>> round(system.lam, 1), round(system.w_f), round(system.C, 3)
    (37.8, 1352, 0.018)
    """
    file: Path | Traversable = Path(path)
    if not file.is_file() and os.fspath(path) in shipped_scenes():
        file = resources.files("towatlas.scene") / "scenes" / f"{os.fspath(path)}.toml"
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST + 1)
        if len(content) > LARGEST:
            raise SceneFileError(f"{path} is no scene: it has more than {LARGEST:,} bytes")
        # Lines as a file in text mode has them.
        table = tomllib.loads(content.decode("utf-8-sig").replace("\r\n", "\n"))
    except FileNotFoundError:
        raise SceneFileError(
            f"no scene at {path}; scenes that come with the package: {', '.join(shipped_scenes())}"
        ) from None
    except SceneFileError:
        raise
    except OSError as error:
        raise SceneFileError(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise SceneFileError(f"{path} is not a text file in UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneFileError(f"{path} is not valid TOML: {error}") from None
    except (ValueError, RecursionError):
        # What Python's reader of TOML does not refuse itself: whole numbers of thousands of digits, deep nesting.
        raise SceneFileError(f"{path} is no scene: a number is too long, or tables are nested too deep") from None
    try:
        for key, value in (changes or {}).items():
            _change(table, key, value)
        return make_scene(table, os.fspath(path))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _change(table: dict[str, Any], key: str, value: Any) -> None:
    """Put another value of a key into the tables of a scene; a speed takes the place of that of any other kind."""
    section, _, name = key.rpartition(".")
    if isinstance(value, str):
        with suppress(ValueError):
            value = float(value)
    holder = table.setdefault(section, {}) if section else table
    if not isinstance(holder, dict):
        raise ValueError(f"{section} must be a table")
    if key in SPEED_KEYS or f"{section}.{name}" in SPEED_KEYS or (section == "tow" and name in SPEED_KEYS):
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
        Where it was read from.

    Returns
    -------
    Scene

    Raises
    ------
    ValueError
        As `read_scene`, without the name of the file.
    """
    values = _parse(table)
    fish = any(key.startswith("fish.") for key in values) or "fish" in table
    density = _density(values)
    gravity = values.get("gravity", STANDARD_GRAVITY)
    if "tow.radius" not in values:
        raise ValueError("tow.radius is missing: the radius of the circle that the tow point moves on")
    radius = values["tow.radius"]
    if density:
        for key, why in (("diameter", "its buoyancy and drag"), ("drag_coefficient", "its drag")):
            if f"cable.{key}" not in values:
                raise ValueError(f"cable.{key} is missing: in a fluid the cable needs it for {why}")
    scene = Scene(
        title=values.get("title", ""),
        source=source,
        length=values.get("cable.length", float("nan")),
        mass_per_length=_mass_per_length(values, density, gravity),
        diameter=values.get("cable.diameter", float("nan")),
        drag_coefficient=values.get("cable.drag_coefficient", float("nan")),
        fish_mass=_fish_mass(values, density, gravity) if fish else 0.0,
        fish_displaced=_fish_displaced(values, density, gravity) if fish else 0.0,
        fish_added_mass=values.get("fish.added_mass", 0.0),
        fish_drag_area=_fish_drag_area(values),
        radius=radius,
        speed=_speed(values, radius, gravity),
        density=density,
        gravity=gravity,
        tolerance=values.get("tolerance", 0.01),
        given=_given(table),
    )
    if scene.medium == "water" and scene.fish_displaced != scene.fish_displaced:
        raise ValueError(
            "fish.volume or fish.submerged_weight is missing: in a fluid as dense as this the fish needs its buoyancy"
        )
    return scene


def _given(table: dict[str, Any]) -> dict[str, str]:
    """Length, radius and speed as they are written, a number without a unit with the one it is taken for."""
    texts = {}
    for name in ("cable.length", "tow.radius", *SPEED_KEYS):
        section, key = name.split(".")
        if key in table.get(section, {}):
            value = table[section][key]
            unit = "rpm" if key == "rpm" else _KEYS[section][key]
            texts[name] = value if isinstance(value, str) else f"{float(value):g} {unit}".strip()
    return texts


def _parse(table: dict[str, Any]) -> dict[str, Any]:
    """Values in SI by "section.key"; every key is known, has the right unit and is in range."""
    flat: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict):
            if name not in _KEYS or not name:
                raise ValueError(f"section [{name}] is unknown{_close(name, [k for k in _KEYS if k])}")
            for key, inner in value.items():
                flat[f"{name}.{key}"] = inner
        elif name in _KEYS:
            raise ValueError(f"{name} = {short(value)} is a section; write [{name}] and its keys below")
        else:
            flat[name] = value
    return {name: _value(name, value) for name, value in flat.items()}


def _value(name: str, value: Any) -> Any:
    section, _, key = name.rpartition(".")
    keys = _KEYS[section]
    if key not in keys:
        raise ValueError(f"key {name} is unknown{_close(key, keys, section)}")
    unit = keys[key]
    if unit == TEXT:
        if not isinstance(value, str):
            raise ValueError(f"{name} = {short(value)} is not a text")
        return value
    number = parse_quantity(name, value, unit, bare="rpm" if key == "rpm" else None)
    if name not in _SIGNED and (number < 0.0 or (number == 0.0 and name not in _MAY_BE_ZERO)):
        raise ValueError(f"{name} = {short(value)} is {'negative' if number < 0.0 else 'zero'}")
    return number


def _close(key: str, keys: Any, section: str = "") -> str:
    near = difflib.get_close_matches(key, keys, 1, 0.6)
    if not near:
        # The right key under the wrong section.
        near = [f"{other}.{key}".lstrip(".") for other, known in _KEYS.items() if key in known and other != section]
    elif section:
        near = [f"{section}.{near[0]}"]
    return f"; do you mean {near[0]}?" if near else f"; known are {', '.join(keys)}"


def _one_of(values: dict[str, Any], section: str, names: tuple[str, ...], what: str) -> str:
    """Which one of several keys that say the same is given."""
    given = [name for name in names if f"{section}.{name}" in values]
    listed = ", ".join(f"{section}.{name}" for name in names)
    if not given:
        raise ValueError(f"{what} is missing: give one of {listed}")
    if len(given) > 1:
        raise ValueError(
            f"{' and '.join(f'{section}.{name}' for name in given)} are both given, and both are {what}: keep one"
        )
    return given[0]


def _density(values: dict[str, Any]) -> float:
    if _one_of(values, "fluid", ("name", "density"), "the fluid") == "density":
        return values["fluid.density"]
    name = values["fluid.name"]
    if name not in FLUIDS:
        raise ValueError(f"fluid.name = {name!r} is unknown; known are {', '.join(FLUIDS)}; any other by fluid.density")
    return FLUIDS[name]


def _speed(values: dict[str, Any], radius: float, gravity: float) -> float:
    key = _one_of(values, "tow", ("speed", "rpm", "rotation_rate", "gamma"), "the speed of the tow point")
    value = values[f"tow.{key}"]
    return {"speed": value, "gamma": value * sqrt(radius * gravity)}.get(key, value * radius)


def _mass_per_length(values: dict[str, Any], density: float, gravity: float) -> float:
    names = ("mass_per_length", "submerged_weight_per_length")
    key = _one_of(values, "cable", names, "the mass of the cable")
    value = values[f"cable.{key}"]
    if key == "mass_per_length":
        return value
    mass = value / gravity + (density * 0.25 * pi * values["cable.diameter"] ** 2 if density else 0.0)
    if mass <= 0.0:
        raise ValueError(f"cable.{key} = {value:g} N/m is more buoyancy than a cable without mass would have")
    return mass


def _fish_mass(values: dict[str, Any], density: float, gravity: float) -> float:
    if "fish.mass" in values:
        if "fish.volume" in values and "fish.submerged_weight" in values:
            raise ValueError(
                "fish.mass, fish.volume and fish.submerged_weight are all given: each follows from the other two"
            )
        if not density and "fish.submerged_weight" in values:
            raise ValueError(
                "fish.mass and fish.submerged_weight are both given, and in a vacuum both are the mass of the fish: "
                "keep one"
            )
        return values["fish.mass"]
    if "fish.submerged_weight" not in values:
        raise ValueError("fish.mass is missing; without a fish leave out the section [fish]")
    if density and "fish.volume" not in values:
        raise ValueError("fish.mass is missing; fish.submerged_weight gives it only together with fish.volume")
    mass = values["fish.submerged_weight"] / gravity + density * values.get("fish.volume", 0.0)
    if mass < 0.0:
        raise ValueError("fish.submerged_weight is more buoyancy than a fish of fish.volume without mass would have")
    return mass


def _fish_displaced(values: dict[str, Any], density: float, gravity: float) -> float:
    if not density:
        return 0.0
    if "fish.volume" in values:
        return density * values["fish.volume"]
    if "fish.submerged_weight" not in values:
        return float("nan") if values["fish.mass"] else 0.0
    displaced = values["fish.mass"] - values["fish.submerged_weight"] / gravity
    if displaced < 0.0:
        raise ValueError("fish.submerged_weight is more than the weight of fish.mass: it is fish.mass less buoyancy")
    return displaced


def _fish_drag_area(values: dict[str, Any]) -> float:
    keys = ("fish.drag_coefficient", "fish.frontal_area")
    given = [key for key in keys if key in values]
    if len(given) == 1:
        raise ValueError(f"{({*keys} - {*given}).pop()} is missing: the drag of the fish needs it beside {given[0]}")
    return values[keys[0]] * values[keys[1]] if given else 0.0
