"""What follows from the keys of a scene: radius and speed, masses, what is displaced, drag and side force."""

from math import inf, nan, pi, sqrt, tan
from typing import Any

# Density of the fluids that have a name, kg/m^3: air at 15 degrees C and water, both at one atmosphere.
FLUIDS = {"vacuum": 0.0, "air": 1.225, "water": 1000.0, "seawater": 1025.0}
# Keys that give the speed of the tow point.
SPEEDS = ("speed", "rpm", "rotation_rate", "period", "bank_angle", "gamma")
_DRAG = ("cable.drag_coefficient", "fish.drag_coefficient", "fish.frontal_area")
_DENSE = ("cable.tangential_drag_coefficient", "cable.side_force_coefficient", "fish.added_mass")
# Left out beside the mass only: without it they give it.
_BESIDE_MASS = {
    "cable.submerged_weight_per_length": "cable.mass_per_length",
    "fish.submerged_weight": "fish.mass",
    "fish.volume": "fish.mass",
    "fish.diameter": "fish.mass",
}

Values = dict[str, Any]


def fluid_density(values: Values) -> float:
    """Density of the fluid.

    Parameters
    ----------
    values : dict
        Of the scene in SI, by "section.key".

    Returns
    -------
    float
        [kg/m^3], >= 0.

    Raises
    ------
    ValueError
        For none, two, and a name that is not known.
    """
    if _one_of(values, "fluid", ("name", "density"), "the fluid") == "density":
        return values["fluid.density"]
    name = values["fluid.name"]
    if name.strip().lower() not in FLUIDS:
        raise ValueError(f"fluid.name = {name!r} is unknown; known are {', '.join(FLUIDS)}; any other by fluid.density")
    return FLUIDS[name.strip().lower()]


def circle(values: Values, gravity: float) -> tuple[float, float]:
    """Radius of the circle of the tow point and its speed.

    Parameters
    ----------
    values : dict
    gravity : float
        [m/s^2], > 0.

    Returns
    -------
    radius, speed : float
        [m], [m/s], > 0.

    Raises
    ------
    ValueError
        For keys that do not give both, or give one twice.
    """
    radius, speed = _circle(values, gravity)
    # What the one is computed from may be too large or too small for the other.
    if not (0.0 < radius < inf and 0.0 < speed < inf):
        raise ValueError(f"the keys of [tow] make a circle of {radius:g} m and a speed of {speed:g} m/s")
    return radius, speed


def _circle(values: Values, gravity: float) -> tuple[float, float]:
    if "tow.radius" in values:
        radius = values["tow.radius"]
        key = _one_of(values, "tow", SPEEDS, "the speed of the tow point")
        if key == "speed":
            return radius, values["tow.speed"]
        by_gravity = key in ("bank_angle", "gamma")
        return radius, _gamma(values) * sqrt(radius * gravity) if by_gravity else _rate(values, key) * radius
    others = [key for key in SPEEDS if key != "speed" and f"tow.{key}" in values]
    if "tow.speed" not in values or len(others) != 1:
        listed = ", ".join(f"tow.{key}" for key in SPEEDS[1:])
        raise ValueError(
            "tow.radius is missing: the radius of the circle that the tow point moves on; tow.speed and one of "
            f"{listed} give it, too"
        )
    speed = values["tow.speed"]
    if others[0] in ("bank_angle", "gamma"):
        slowness = speed / _gamma(values)
        return slowness * slowness / gravity, speed
    return speed / _rate(values, others[0]), speed


def _rate(values: Values, key: str) -> float:
    return 2.0 * pi / values["tow.period"] if key == "period" else values[f"tow.{key}"]


def _gamma(values: Values) -> float:
    """Dimensionless speed: of an aircraft the tangent of its bank angle is v^2 / (g R)."""
    if "tow.gamma" in values:
        return values["tow.gamma"]
    bank = values["tow.bank_angle"]
    if bank >= 0.5 * pi:
        raise ValueError("tow.bank_angle must be less than 90 degrees")
    return sqrt(tan(bank))


def cable_mass(values: Values, density: float, gravity: float) -> tuple[float, float]:
    """Mass of the cable and of the fluid that it displaces.

    Parameters
    ----------
    values : dict
    density, gravity : float
        [kg/m^3], >= 0; [m/s^2], > 0.

    Returns
    -------
    mass, displaced : float
        Over its length [kg/m].

    Raises
    ------
    ValueError
        For keys that do not give both, or contradict each other.
    """
    names = ("mass_per_length", "submerged_weight_per_length")
    mass, weight = (values.get(f"cable.{name}") for name in names)
    if weight is None:
        _one_of(values, "cable", names, "the mass of the cable")
    if mass is not None and weight is not None:
        if not density:
            raise ValueError(
                f"cable.{names[0]} and cable.{names[1]} are both given, and in a vacuum both are the mass of the "
                "cable: keep one"
            )
        displaced = mass - weight / gravity
        if displaced < 0.0:
            raise ValueError(
                f"cable.{names[1]} is more than the weight of cable.{names[0]}: it is the same less buoyancy"
            )
        return mass, displaced
    area = values.get("cable.displaced_area", _circle_area(values.get("cable.diameter", nan)))
    displaced = density * area if density else 0.0
    if weight is None:
        assert mass is not None
        return mass, displaced
    mass = weight / gravity + displaced
    if mass <= 0.0:
        raise ValueError(f"cable.{names[1]} = {weight:g} N/m is more buoyancy than a cable without mass would have")
    return mass, displaced


def tangential_drag(values: Values) -> float:
    """Coefficient of the drag along the cable.

    Parameters
    ----------
    values : dict

    Returns
    -------
    float
        On the diameter [-], >= 0; 0 if not given.

    Raises
    ------
    ValueError
        If it is not said what it refers to.
    """
    keys = ("cable.tangential_drag_coefficient", "cable.tangential_drag_on")
    if keys[0] not in values:
        if keys[1] in values:
            raise ValueError(f"{keys[0]} is missing: {keys[1]} says what it refers to")
        return 0.0
    if keys[1] not in values:
        raise ValueError(
            f'{keys[1]} is missing: write "d" if the coefficient refers to the diameter, as that of the normal drag, '
            'or "pi d" if to the circumference, as in MoorDyn and OrcaFlex'
        )
    return values[keys[0]] * (pi if values[keys[1]] == "pi d" else 1.0)


def side_force(values: Values, density: float) -> tuple[float, float]:
    """Coefficient of the side force of a stranded cable, and the sine at which it is at its largest.

    Parameters
    ----------
    values : dict
    density : float
        [kg/m^3], >= 0; in a vacuum there is none.

    Returns
    -------
    coefficient, sine : float
        a of DTMB Report 713, positive to starboard of the track [-]; b [-], > 0, inf if not given.

    Raises
    ------
    ValueError
        If it is not said to which side the cable kites, or the tow point turns.
    """
    a, b = values.get("cable.side_force_coefficient", 0.0), values.get("cable.side_force_sine", inf)
    if b < inf and "cable.side_force_coefficient" not in values:
        raise ValueError("cable.side_force_coefficient is missing: cable.side_force_sine is where its force is largest")
    if not a or not density:
        return 0.0, inf
    if "cable.kites" not in values:
        raise ValueError(
            'cable.kites is missing: write "starboard" or "port", the side of the track to which the side force '
            "pushes the cable; its lay does not tell"
        )
    if "tow.turn" not in values:
        raise ValueError(
            'tow.turn is missing: write "starboard" or "port"; to a cable with a side force the two are not the same'
        )
    return (a if values["cable.kites"] == "starboard" else -a), b


def fish_mass(values: Values, density: float, gravity: float) -> tuple[float, float]:
    """Mass of the fish and of the fluid that it displaces.

    Parameters
    ----------
    values : dict
    density, gravity : float
        [kg/m^3], >= 0; [m/s^2], > 0.

    Returns
    -------
    mass, displaced : float
        [kg], >= 0; what is displaced is nan if it is not known.

    Raises
    ------
    ValueError
        For keys that do not give the mass, or contradict each other.
    """
    mass, weight, volume = (values.get(f"fish.{key}") for key in ("mass", "submerged_weight", "volume"))
    if volume is None and "fish.diameter" in values and (mass is None or weight is None):
        volume = _circle_area(values["fish.diameter"]) * values["fish.diameter"] * 2.0 / 3.0
    if mass is None:
        if weight is None:
            raise ValueError("fish.mass is missing; without a fish leave out the section [fish]")
        if density and volume is None:
            raise ValueError("fish.mass is missing; fish.submerged_weight gives it only together with fish.volume")
        displaced = density * (volume or 0.0)
        mass = weight / gravity + displaced
        if mass < 0.0:
            raise ValueError(
                "fish.submerged_weight is more buoyancy than a fish of fish.volume without mass would have"
            )
        return mass, displaced
    if weight is not None and volume is not None:
        raise ValueError(
            "fish.mass, fish.volume and fish.submerged_weight are all given: each follows from the other two"
        )
    if not density:
        if weight is not None:
            raise ValueError(
                "fish.mass and fish.submerged_weight are both given, and in a vacuum both are the mass of the fish: "
                "keep one"
            )
        return mass, 0.0
    if weight is None:
        return mass, density * volume if volume is not None else nan if mass else 0.0
    displaced = mass - weight / gravity
    if displaced < 0.0:
        raise ValueError("fish.submerged_weight is more than the weight of fish.mass: it is fish.mass less buoyancy")
    return mass, displaced


def fish_added_mass(values: Values, displaced: float) -> float:
    """Mass of the fluid that moves with the fish.

    Parameters
    ----------
    values : dict
    displaced : float
        [kg].

    Returns
    -------
    float
        [kg], >= 0: half of what a sphere displaces, 0 of another fish, if not given.
    """
    return values.get("fish.added_mass", 0.5 * displaced if "fish.diameter" in values else 0.0)


def fish_drag_area(values: Values) -> float:
    """Drag coefficient of the fish by its frontal area.

    Parameters
    ----------
    values : dict

    Returns
    -------
    float
        [m^2], >= 0; 0 if not given.

    Raises
    ------
    ValueError
        For one without the other.
    """
    coefficient, area = values.get("fish.drag_coefficient"), values.get("fish.frontal_area")
    if area is None and "fish.diameter" in values:
        area = _circle_area(values["fish.diameter"])
    elif area is not None and coefficient is None:
        raise ValueError("fish.drag_coefficient is missing: the drag of the fish needs it beside fish.frontal_area")
    if not coefficient:
        return 0.0
    if area is None:
        raise ValueError("fish.frontal_area is missing: the drag of the fish needs it beside fish.drag_coefficient")
    return coefficient * area


def left_out(values: Values, cable_type: str) -> dict[str, tuple[str, ...]]:
    """What is given and not used, by model.

    Parameters
    ----------
    values : dict
        Of the scene, without those of a type of cable.
    cable_type : str
        Name of that type, empty for none.

    Returns
    -------
    dict of tuple of str
        Keys, those of a type in words.
    """
    given = {key for key, value in values.items() if value != 0.0}
    dense = [key for key in (*_DENSE, *_BESIDE_MASS) if key in given and _BESIDE_MASS.get(key, key) in given]
    drag = [key for key in _DRAG if key in given]
    forces = [f"tangential drag and side force of {cable_type}"] if cable_type else []
    return {
        "vacuum": (*drag, *dense, *(f"drag, {text}" for text in forces)),
        # The diameter of a fish gives the area of its drag, too.
        "air": (*(key for key in dense if key != "fish.diameter"), *forces),
    }


def _circle_area(diameter: float) -> float:
    # Not a power, which raises where it overflows.
    return 0.25 * pi * diameter * diameter


def _one_of(values: Values, section: str, names: tuple[str, ...], what: str) -> str:
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
