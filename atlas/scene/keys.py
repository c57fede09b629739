"""The keys of a scene: which there are, their units, and what is asked about their values."""

import difflib
import math
from collections.abc import Mapping
from typing import Any

from towatlas.checks import short
from towatlas.scene.units import parse_quantity, parse_uncertain

TEXT = "text"
SIDES = ("starboard", "port")
# Deviations above this share of a value are asked about.
LARGE = 0.5
ON = ("d", "pi d")
# A key's SI unit, or the words that it may be.
Keys = Mapping[str, str | tuple[str, ...]]

# What a type of cable may say, too.
CABLE: Keys = {
    "mass_per_length": "kg/m",
    "submerged_weight_per_length": "N/m",
    "diameter": "m",
    "drag_coefficient": "",
    "tangential_drag_coefficient": "",
    "tangential_drag_on": ON,
    "side_force_coefficient": "",
    "side_force_sine": "",
    "kites": SIDES,
    "breaking_strength": "N",
}
# Every key of a scene.
KEYS: dict[str, Keys] = {
    "": {"title": TEXT, "gravity": "m/s^2", "tolerance": ""},
    "cable": {"length": "m", "type": TEXT, "library": TEXT, **CABLE},
    "fish": {
        "mass": "kg",
        "submerged_weight": "N",
        "volume": "m^3",
        "diameter": "m",
        "added_mass": "kg",
        "drag_coefficient": "",
        "frontal_area": "m^2",
    },
    "tow": {
        "radius": "m",
        "speed": "m/s",
        "rpm": "rad/s",
        "rotation_rate": "rad/s",
        "period": "s",
        "bank_angle": "rad",
        "gamma": "",
        "turn": SIDES,
    },
    "fluid": {"name": TEXT, "density": "kg/m^3"},
}
_SIGNED = {"submerged_weight_per_length", "submerged_weight"}
_MAY_BE_ZERO = {
    "drag_coefficient",
    "tangential_drag_coefficient",
    "side_force_coefficient",
    "mass",
    "volume",
    "added_mass",
    "frontal_area",
    "density",
    "drag_coefficient_sd",
    "tangential_drag_coefficient_sd",
    "side_force_sd",
}
# Of a mass the weight, and of a weight the mass, of the same body.
_TWINS = {
    "mass": "submerged_weight",
    "submerged_weight": "mass",
    "mass_per_length": "submerged_weight_per_length",
    "submerged_weight_per_length": "mass_per_length",
}
# Keys that people write, and that would have to say whether they are meant in air.
_MEANT = {
    "cable.mass": "cable.mass_per_length",
    "cable.weight": "cable.mass_per_length, in air, or cable.submerged_weight_per_length",
    "cable.weight_per_length": "cable.mass_per_length, in air, or cable.submerged_weight_per_length",
    "cable.submerged_weight": "cable.submerged_weight_per_length",
    "fish.weight": "fish.mass, in air, or fish.submerged_weight",
}
# Densities of a cable outside of which its mass and diameter are asked about, from a foam line to tungsten [kg/m^3].
DENSITIES = (50.0, 3e4)
# What lies outside is asked about: by unit, from the finest thread and the smallest bead to a cable across an ocean.
_USUAL = {
    "m": (1e-6, 1e7),
    "m^2": (1e-10, 1e5),
    "m^3": (1e-15, 1e6),
    "m/s": (1e-5, 1e5),
    "rad/s": (1e-7, 1e6),
    "s": (1e-5, 1e8),
    "kg": (1e-9, 1e9),
    "kg/m": (1e-9, 1e5),
    "kg/m^3": (1e-6, 3e4),
    "N": (1e-9, 1e10),
    "N/m": (1e-9, 1e6),
    "m/s^2": (1e-4, 1e4),
}


def parse_scene(table: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float], list[str]]:
    """The values of a scene; every key is known, has the right unit and is in range.

    Parameters
    ----------
    table : dict
        As `tomllib` reads it.

    Returns
    -------
    values : dict
        In SI, by "section.key".
    deviations : dict of float
        Standard deviations of those that have one, > 0.
    questions : list of str
        About values of unusual size, and deviations as large as their values.

    Raises
    ------
    ValueError
        For others; the message names the key.
    """
    flat: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict):
            if name not in KEYS or not name:
                raise ValueError(f"section [{name}] is unknown{_close(name, [k for k in KEYS if k])}")
            flat |= {f"{name}.{key}": inner for key, inner in value.items()}
        elif name in KEYS:
            raise ValueError(f"{name} = {short(value)} is a section; write [{name}] and its keys below")
        else:
            flat[name] = value
    values, deviations = {}, {}
    for name, value in flat.items():
        section, _, key = name.rpartition(".")
        if key not in KEYS[section]:
            raise ValueError(f"key {name} is unknown{_close(key, KEYS[section], section)}")
        unit = KEYS[section][key]
        if isinstance(unit, str) and unit != TEXT and name != "tolerance":
            values[name], deviation = parse_uncertain(name, value, unit, **_context(section, key))
            _check_range(name, value, values[name])
            if deviation:
                deviations[name] = deviation
        else:
            values[name] = parse_value(name, value, unit)
    questions = [text for name, value in flat.items() if (text := _question(name, value, values[name]))]
    questions += [
        f"{name} = {short(flat[name])} is hardly known: what follows to first order from its deviation says little"
        for name, deviation in deviations.items()
        if deviation > LARGE * abs(values[name])
    ]
    return values, deviations, [*questions, *_density_question(flat, values)]


def _density_question(flat: Mapping[str, Any], values: Mapping[str, Any]) -> list[str]:
    """What is asked about a cable of another density than any material's."""
    names = ("cable.mass_per_length", "cable.diameter")
    if not all(0.0 < values.get(name, 0.0) < math.inf for name in names):
        return []
    mass, diameter = (values[name] for name in names)
    density = 4.0 * mass / (math.pi * diameter**2)
    if DENSITIES[0] <= density <= DENSITIES[1]:
        return []
    written = " and ".join(f"{name} = {short(flat[name])}" for name in names)
    return [f"{written} make a cable of {density:.3g} kg/m^3: are their units the right ones?"]


def parse_value(name: str, value: Any, unit: str | tuple[str, ...]) -> Any:
    """The value of one key.

    Parameters
    ----------
    name : str
        Of the key, with its section.
    value : object
        As `tomllib` reads it.
    unit : str or tuple of str
        As in `KEYS`.

    Returns
    -------
    float or str
        In SI.

    Raises
    ------
    ValueError
        For what is of another kind, out of range, or none of the words.
    """
    section, _, key = name.rpartition(".")
    if isinstance(unit, tuple):
        if value not in unit:
            words = " or ".join(f'"{word}"' for word in unit)
            raise ValueError(f"{name} = {short(value)} must be {words}")
        return value
    if unit == TEXT:
        if not isinstance(value, str):
            raise ValueError(f"{name} = {short(value)} is not a text")
        return value
    number = parse_quantity(name, value, unit, **_context(section, key))
    _check_range(name, value, number)
    return number


def _context(section: str, key: str) -> dict[str, str | None]:
    """What `parse_quantity` should know of a key."""
    return {
        "bare": "rpm" if key == "rpm" else None,
        "twin": f"{section}.{_TWINS[key]}" if key in _TWINS else None,
    }


def _check_range(name: str, written: Any, number: float) -> None:
    key = name.rpartition(".")[2]
    if key not in _SIGNED and (number < 0.0 or (number == 0.0 and key not in _MAY_BE_ZERO)):
        raise ValueError(f"{name} = {short(written)} is {'negative' if number < 0.0 else 'zero'}")


def _question(name: str, written: Any, value: Any) -> str:
    """What is asked about a value, if anything."""
    section, _, key = name.rpartition(".")
    unit = KEYS[section][key]
    if not isinstance(unit, str) or unit not in _USUAL or value == 0.0:
        return ""
    low, high = _USUAL[unit]
    if low <= abs(value) <= high:
        return ""
    return f"{name} = {short(written)} is {value:g} {unit}: is its unit the right one?"


def _close(key: str, keys: Any, section: str = "") -> str:
    if (meant := _MEANT.get(f"{section}.{key}")) is not None:
        return f"; do you mean {meant}?"
    near = difflib.get_close_matches(key, keys, 1, 0.6)
    if not near:
        # The right key under the wrong section.
        near = [f"{other}.{key}".lstrip(".") for other, known in KEYS.items() if key in known and other != section]
    elif section:
        near = [f"{section}.{near[0]}"]
    return f"; do you mean {near[0]}?" if near else f"; known are {', '.join(keys)}"
