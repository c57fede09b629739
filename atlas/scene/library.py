"""Types of cable: what is known of a cable by its name, from files that come with the package and the user's own."""

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from importlib.resources.abc import Traversable
from math import degrees, pi
from pathlib import Path
from typing import Any

import numpy as np

from towatlas.scene.keys import CABLE, TEXT, Keys, parse_value

STANDARD_GRAVITY = 9.80665
# At which the law of a side force is averaged.
ANGLES = 101
# A file is a page: what is longer is something else.
LARGEST = 10**6  # bytes
# Keys of a type: those of a cable, and how well and where they are known.
TYPE: Keys = {
    **CABLE,
    "source": TEXT,
    "weighed_in": "kg/m^3",
    "drag_coefficient_sd": "",
    "tangential_drag_coefficient_sd": "",
    "side_force_sd": "",
    "angle_min": "rad",
    "angle_max": "rad",
}
# Keys that say one thing together: a scene that has one of them takes none of the others from the type.
_TOGETHER = (
    ("mass_per_length", "submerged_weight_per_length", "displaced_area"),
    ("tangential_drag_coefficient", "tangential_drag_on"),
    ("side_force_coefficient", "side_force_sine"),
)


class SceneFileError(OSError):
    """A file that cannot be read as a scene: absent, unreadable, or no TOML."""


@dataclass(frozen=True)
class CableType:
    """A cable of a library.

    Attributes
    ----------
    name : str
        As in `cable.type`.
    source : str
        Where its numbers are from.
    values : dict of float or str
        Its keys in SI, those of `towatlas.scene.keys.CABLE`, and displaced_area, what it displaces over its length
        [m^2].
    deviations : dict of float
        Standard deviations of one measurement about the law, by name.
    angles_deg : (float, float) or None
        Between cable and stream over which it was measured [deg]; None where that is not said.
    """

    name: str
    source: str
    values: dict[str, Any]
    deviations: dict[str, float]
    angles_deg: tuple[float, float] | None

    def beside(self, given: dict[str, Any]) -> dict[str, Any]:
        """What it adds to the keys of a scene, which go first.

        Parameters
        ----------
        given : dict
            Values of the scene, by "section.key".

        Returns
        -------
        dict
            Those of the type that the scene leaves to it, by "cable.key".

        Raises
        ------
        ValueError
            For another diameter without a weight of its own.
        """
        own = {name.removeprefix("cable.") for name in given if name.startswith("cable.")}
        taken = own | {key for keys in _TOGETHER if own & {*keys} for key in keys}
        added = {f"cable.{key}": value for key, value in self.values.items() if key not in taken}
        if "diameter" in own and "cable.mass_per_length" in added:
            raise ValueError(
                f"cable.diameter is given, and the mass of {self.name} is that of its own: give cable.mass_per_length "
                "or cable.submerged_weight_per_length, too"
            )
        return added

    def scatter(self, added: dict[str, Any]) -> dict[str, float]:
        """Standard deviations of what it adds to the keys of a scene.

        Parameters
        ----------
        added : dict
            From `beside`.

        Returns
        -------
        dict of float
            By "cable.key". That of the side force, which is one of C_s, is turned into one of the coefficient a by the
            root mean square of C_s / a over the angles at which it was measured.
        """
        known = {f"cable.{name}": value for name, value in self.deviations.items() if value}
        side = known.pop("cable.side_force", 0.0)
        if side and self.angles_deg is not None:
            sine = np.sin(np.radians(np.linspace(*self.angles_deg, ANGLES)))
            shape = sine / (1.0 + np.square(sine / added.get("cable.side_force_sine", np.inf)))
            known["cable.side_force_coefficient"] = float(side / np.sqrt(np.mean(np.square(shape))))
        return {key: value for key, value in known.items() if key in added}


def read_toml(file: Path | Traversable, name: str, what: str, absent: Callable[[], str]) -> dict[str, Any]:
    """The tables of a small TOML file.

    Parameters
    ----------
    file : path
    name : str
        What it is called in messages.
    what : str
        What it should be, in messages.
    absent : callable
        Makes the message if there is no such file.

    Returns
    -------
    dict

    Raises
    ------
    SceneFileError
        If it cannot be read, or is no TOML.
    """
    try:
        with file.open("rb") as stream:
            content = stream.read(LARGEST + 1)
    except FileNotFoundError:
        raise SceneFileError(absent()) from None
    except OSError as error:
        raise SceneFileError(f"{name} cannot be read: {error.strerror}") from None
    return parse_toml(content, name, what)


def parse_toml(content: bytes, name: str, what: str) -> dict[str, Any]:
    """The tables of a small TOML file that has been read.

    Parameters
    ----------
    content : bytes
    name, what : str
        As of `read_toml`.

    Returns
    -------
    dict

    Raises
    ------
    SceneFileError
        If it is no TOML.
    """
    if len(content) > LARGEST:
        raise SceneFileError(f"{name} is no {what}: it has more than {LARGEST:,} bytes")
    try:
        # Lines as a file in text mode has them.
        return tomllib.loads(content.decode("utf-8-sig").replace("\r\n", "\n"))
    except UnicodeDecodeError:
        raise SceneFileError(f"{name} is not a text file in UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        raise SceneFileError(f"{name} is not valid TOML: {error}") from None
    except (ValueError, RecursionError):
        # What Python's reader of TOML does not refuse itself: whole numbers of thousands of digits, deep nesting.
        raise SceneFileError(f"{name} is no {what}: a number is too long, or tables are nested too deep") from None


def find_type(name: str, library: str | None = None, folder: Path = Path()) -> CableType:
    """A type of cable by its name: of the user's library, else of that of the package.

    Parameters
    ----------
    name : str
    library : str, optional
        A TOML file with a table for each type.
    folder : path
        Where that file is looked for.

    Returns
    -------
    CableType

    Raises
    ------
    SceneFileError
        If the library cannot be read.
    ValueError
        If there is no such type, or one of its keys is unknown, out of range or has a wrong unit.

    Examples
    --------
    >>> cable = find_type("pode-G")
    >>> cable.values["drag_coefficient"], cable.deviations["drag_coefficient"]
    (1.229, 0.33)
    """
    own = {}
    if library is not None:
        own = read_toml(folder / library, library, "library of cables", lambda: f"no library of cables at {library}")
    tables = _shipped() | own
    if name not in tables:
        raise ValueError(f'cable.type = "{name}" is unknown; known are {", ".join(tables)}')
    where = f"{library}, {name}" if name in own else name
    try:
        return _make_type(name, tables[name])
    except ValueError as error:
        raise ValueError(f"{where}: {error}") from None


def shipped_types() -> list[str]:
    """Names of the types of cable that come with the package.

    Returns
    -------
    list of str

    Examples
    --------
    >>> shipped_types()[:2]
    ['pode-A', 'pode-B']
    """
    return list(_shipped())


@cache
def _shipped() -> dict[str, Any]:
    file = resources.files("towatlas.scene") / "cables.toml"
    return read_toml(file, "cables.toml", "library of cables", lambda: "cables.toml is missing from the package")


def _make_type(name: str, table: Any) -> CableType:
    if not isinstance(table, dict):
        raise ValueError(f"it is not a table; write [{name}] and its keys below")
    unknown = [key for key in table if key not in TYPE]
    if unknown:
        raise ValueError(f"key {unknown[0]} is unknown; known are {', '.join(TYPE)}")
    values = {key: parse_value(key, value, TYPE[key]) for key, value in table.items()}
    source = values.pop("source", "")
    deviations = {key.removesuffix("_sd"): values.pop(key) for key in list(values) if key.endswith("_sd")}
    low, high = values.pop("angle_min", None), values.pop("angle_max", None)
    if (low is None) != (high is None) or (low is not None and low >= high):
        raise ValueError("angle_min and angle_max go together, the smaller one first")
    return CableType(
        name=name,
        source=source,
        values=values | _weights(values),
        deviations=deviations,
        angles_deg=None if low is None or high is None else (degrees(low), degrees(high)),
    )


def _weights(values: dict[str, Any]) -> dict[str, float]:
    """Mass and displaced area of a cable that was weighed in air, in water, or both; takes its weights away."""
    mass, weight, density = (
        values.pop(key, None) for key in ("mass_per_length", "submerged_weight_per_length", "weighed_in")
    )
    if (weight is None) != (density is None):
        raise ValueError("submerged_weight_per_length and weighed_in, the density of that water, go together")
    if weight is None:
        return {} if mass is None else {"mass_per_length": mass}
    if mass is None:
        if "diameter" not in values:
            raise ValueError("diameter is missing: without mass_per_length it gives the buoyancy")
        area = 0.25 * pi * values["diameter"] ** 2
        return {"mass_per_length": weight / STANDARD_GRAVITY + density * area, "displaced_area": area}
    area = (mass - weight / STANDARD_GRAVITY) / density
    if area < 0.0:
        raise ValueError("submerged_weight_per_length is more than the weight of mass_per_length")
    return {"mass_per_length": mass, "displaced_area": area}
