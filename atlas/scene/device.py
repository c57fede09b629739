"""Reading a lateral force device in real units: DEVICE.toml, with `[tow]` and one or two `[[line]]`."""

import difflib
import os
from dataclasses import dataclass
from math import atan2, hypot, isclose, nan, pi
from pathlib import Path
from typing import Any

from towatlas.checks import short
from towatlas.scene.keys import KEYS, Keys
from towatlas.scene.library import read_toml
from towatlas.scene.units import parse_quantity
from towatlas.solve.device.tangling import Line, check_line

TOW: Keys = {key: KEYS["tow"][key] for key in ("radius", "speed", "rpm", "rotation_rate", "period")}
LINE: Keys = {
    "length": "m",
    "mass": "kg",
    "k": "kg/m",
    "lift_area": "m^2",
    "drag_area": "m^2",
    "density": "kg/m^3",
    "alpha": "rad",
}
_RATES = ("rpm", "rotation_rate", "period")
# Pulls into the turn where negative.
_SIGNED = ("lift_area", "alpha")
# Angle and areas say the same thing twice, if they agree so well.
_SAME = 1e-3


@dataclass(frozen=True)
class Tow:
    """Lines behind a ship.

    Attributes
    ----------
    lines : tuple of Line
        One or two.
    radius : float
        Of the circle of the ship [m], > 0; nan if it is not given.
    speed : float
        Of the ship [m/s], > 0; 1 if it is not given.
    speed_given : bool
        Whether it is.
    """

    lines: tuple[Line, ...]
    radius: float
    speed: float
    speed_given: bool


def read_device(path: str | os.PathLike) -> Tow:
    """Read lines with lateral force devices.

    Parameters
    ----------
    path : path
        A TOML file. `[line]`, or `[[line]]` once or twice: length, mass, and k with alpha or lift_area, drag_area and
        density. `[tow]`, which may be absent: radius, speed, and one of rpm, rotation_rate and period; two of the three
        give the other.

    Returns
    -------
    Tow

    Raises
    ------
    SceneFileError
        If it cannot be read, or is no TOML.
    ValueError
        If a key is unknown, missing, contradictory, out of range or has a wrong unit; the message names file and key.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("device.toml").write_text('[line]\\nlength = "300 m"\\nk = 60\\nmass = 300\\nalpha = "0.9 rad"\\n')
    >>> read_device("device.toml").lines[0].device
    Device(k=60.0, alpha=0.9)
    """
    name = os.fspath(path)
    table = read_toml(Path(path), name, "device", lambda: f"no device at {name}: a file with [tow] and [line]")
    try:
        return make_tow(table)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None


def make_tow(table: dict[str, Any]) -> Tow:
    """Lines behind a ship from the tables of a file.

    Parameters
    ----------
    table : dict
        As `tomllib` reads them.

    Returns
    -------
    Tow

    Raises
    ------
    ValueError
        As `read_device`, without the name of the file.
    """
    if unknown := [key for key in table if key not in ("tow", "line")]:
        raise ValueError(f"{unknown[0]} is unknown; a device has the sections [tow] and [line]")
    sections = table.get("line", [])
    if isinstance(sections, dict):
        sections = [sections]
    if not (isinstance(sections, list) and len(sections) in (1, 2) and all(isinstance(s, dict) for s in sections)):
        raise ValueError("one section [line], or two [[line]] for lines that may tangle")
    names = ["line"] if len(sections) == 1 else ["line 1", "line 2"]
    lines = tuple(_line(_values(name, section, LINE), name) for name, section in zip(names, sections, strict=True))
    tow = table.get("tow", {})
    if not isinstance(tow, dict):
        raise ValueError(f"tow = {short(tow)} is a section; write [tow] and its keys below")
    radius, speed = _circle(_values("tow", tow, TOW))
    return Tow(lines, radius, 1.0 if speed != speed else speed, speed == speed)


def _values(section: str, table: dict[str, Any], keys: Keys) -> dict[str, float]:
    """Keys of a section in SI."""
    values = {}
    for key, value in table.items():
        name = f"{section}.{key}"
        if key not in keys:
            near = difflib.get_close_matches(key, keys, 1, 0.6)
            raise ValueError(
                f"key {name} is unknown; " + (f"do you mean {near[0]}?" if near else f"known are {', '.join(keys)}")
            )
        unit = keys[key]
        assert isinstance(unit, str)
        number = parse_quantity(name, value, unit, bare="rpm" if key == "rpm" else None)
        if key not in _SIGNED and not number > 0.0:
            raise ValueError(f"{name} = {short(value)} is {'negative' if number < 0.0 else 'zero'}")
        values[key] = number
    return values


def _line(values: dict[str, float], name: str) -> Line:
    for key in ("length", "mass"):
        if key not in values:
            raise ValueError(f"{name}.{key} is missing")
    areas = [key for key in ("lift_area", "drag_area", "density") if key in values]
    if "k" in values and areas:
        raise ValueError(f"{name}.k and {name}.{areas[0]} both say how large the force is: keep one")
    if "k" not in values:
        return check_line(_line_of_areas(values, name))
    if "alpha" not in values:
        raise ValueError(f'{name}.alpha is missing: the angle of the force against the velocity, as "60 deg"')
    return check_line(Line(values["length"], values["k"], values["mass"], values["alpha"]))


def _line_of_areas(values: dict[str, float], name: str) -> Line:
    for key in ("lift_area", "drag_area", "density"):
        if key not in values:
            raise ValueError(f"{name}.{key} is missing: {name}.k, or lift_area, drag_area and density, give the force")
    k = 0.5 * values["density"] * hypot(values["lift_area"], values["drag_area"])
    alpha = atan2(values["lift_area"], values["drag_area"])
    given = values.get("alpha", alpha)
    if not isclose(given, alpha, abs_tol=_SAME):
        raise ValueError(
            f"{name}.alpha is {given * 180.0 / pi:.6g} degrees, and the areas give {alpha * 180.0 / pi:.6g}: leave it "
            "out; a negative lift_area pulls into the turn"
        )
    return Line(values["length"], k, values["mass"], alpha)


def _circle(values: dict[str, float]) -> tuple[float, float]:
    """Radius and speed of the ship; nan for what is not given."""
    rates = [key for key in _RATES if key in values]
    if len(rates) > 1 or (rates and "radius" in values and "speed" in values):
        given = ", ".join(f"tow.{key}" for key in values)
        raise ValueError(f"of tow.radius, tow.speed and one of {', '.join(_RATES)} two give the third; got {given}")
    radius, speed = values.get("radius", nan), values.get("speed", nan)
    if rates:
        rate = 2.0 * pi / values["period"] if rates[0] == "period" else values[rates[0]]
        if "radius" in values:
            speed = rate * radius
        elif "speed" in values:
            radius = speed / rate
        else:
            raise ValueError(f"tow.{rates[0]} alone gives neither: give tow.radius or tow.speed, too")
    return radius, speed
