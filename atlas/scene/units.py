"""Quantities with units as people write them, in SI: "0.1824 g/ft", "11/16 in", "3 kn"; a bare number is SI."""

import functools
import json
import math
import re
import zlib
from contextlib import suppress
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path
from typing import Any

from towatlas.checks import short
from towatlas.kernels.native import cache_root, read_sealed, write_sealed

# Number, unit. The number may be a fraction, "11/16", or a mixed one, "1 1/2".
_DECIMAL = r"(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY = re.compile(rf"\s*([+-]?)\s*(?:(\d+)\s+(\d+)/(\d+)|({_DECIMAL})(?:\s*/\s*({_DECIMAL}))?)\s*(.*?)\s*")
# What stands between a value and its standard deviation.
_PLUS_MINUS = re.compile(r"\+/?-|±")
_UNCERTAIN = 'write them as "1.2 +- 0.2", "12 mm +- 0.5 mm" or "12 mm +- 10 %"'
_BRACKETED = re.compile(r"\s*\((.*)\)(.*)")
# A quantity is a few words. Longer ones, and exponents beyond those of a float, would be worked out to the last digit.
_LONGEST = 100  # characters
_EXPONENT = 400
# Of units: names, products, quotients, powers of one digit. What else pint understands, as 9**9**9 m, may never end.
# Possessive, so that no text takes long to refuse.
_NAME = r"[^\W\d]\w*+|[%°'\"]"
_POWER = r"(?:\s*+(?:\^|\*\*)\s*+[+-]?\d(?:\.\d)?(?![\d.]))?"
_UNIT = re.compile(rf"(?:(?:[*/·()\s]|1\s*+/|{_NAME}){_POWER})*+")
# What people write and pint does not read: a power without its sign, "kg/m3", and "lb/1000 ft".
_BARE_POWER = re.compile(r"(?<=[^\W\d_])([23])(?!\w)")
_PER_MANY = re.compile(r"/\s*(10{1,6})\s*(?=[^\W\d])")
_ALIASES = ("kilogram = Kg", "pound = lbm", "revolutions_per_minute = RPM = Rpm")
# Names that mean two things, one of which pint would take without asking.
_AMBIGUOUS = {
    "nm": "a nanometre or a nautical mile: write nanometer or nmi",
    "gr": "a grain or a gram: write grain or g",
}
# Factors kept on the disk.
_MOST_KEPT = 1000
# What a number with units may be for; the message names it. Angles are told from pure numbers, see `_same`.
_KINDS = {
    "m": "a length",
    "m^2": "an area",
    "m^3": "a volume",
    "m/s": "a speed",
    "m/s^2": "an acceleration",
    "rad/s": "a rate of rotation",
    "rad": "an angle",
    "s": "a time",
    "kg": "a mass",
    "kg/m": "a mass per length",
    "kg/m^3": "a density",
    "N": "a force",
    "N/m": "a force per length",
    "": "a pure number",
}


@functools.cache
def _registry() -> Any:
    # pint takes a third of a second to import: only who reads units pays.
    import pint

    try:
        # And another to read its own units, but for the first time.
        registry: Any = pint.UnitRegistry(cache_folder=cache_root() / "pint")
    except Exception:  # whatever a damaged file raises, or a place where nothing can be written
        registry = pint.UnitRegistry()
    registry.define("rev = revolution")
    for names in _ALIASES:
        registry.define(f"@alias {names}")
    return registry


def _kept() -> Path:
    names = zlib.crc32(" ".join(_ALIASES).encode())
    return cache_root() / f"units-{version('pint')}-{names:08x}.json"


@functools.cache
def _factors() -> dict[str, float]:
    """Factors to SI that pint has told before, by unit and SI unit: who knows them needs no pint."""
    try:
        content = read_sealed(_kept())
    except RuntimeError:  # there is no home
        content = None
    return {} if content is None else json.loads(content)


def _keep(known: dict[str, float]) -> None:
    with suppress(OSError, RuntimeError):
        _kept().parent.mkdir(parents=True, exist_ok=True)
        write_sealed(_kept(), json.dumps(known).encode())


def _same(one: Any, other: Any) -> bool:
    """The same kind of quantity; "2 Hz", which pint takes for 2 rad/s, is no rate of rotation."""
    return one.to_root_units().units == other.to_root_units().units


def parse_quantity(name: str, value: Any, unit: str, bare: str | None = None, twin: str | None = None) -> float:
    """A quantity in SI.

    Parameters
    ----------
    name : str
        What it is called in messages.
    value : float or str
        A number in SI, or text with a unit: decimal, fraction ("11/16 in") or mixed ("1 1/2 in").
    unit : str
        The SI unit wanted, one of m, m^2, m^3, m/s, m/s^2, rad/s, rad, s, kg, kg/m, kg/m^3, N, N/m, and "" for a pure
        number. An angle needs its unit written.
    bare : str, optional
        The unit of a number without one, if not SI.
    twin : str, optional
        Of a mass the name of the weight that goes with it, of a weight that of the mass.

    Returns
    -------
    float
        In `unit`, to rounding.

    Raises
    ------
    ValueError
        If it is no number, not finite, or its unit is unknown, ambiguous or of another kind; the message names the key.

    Examples
    --------
    >>> parse_quantity("radius", "11/16 in", "m")
    0.0174625
    """
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise ValueError(
            f"{name} = {short(value)} is not {_KINDS[unit]}; write a number in SI or a text as {_sample(unit)}"
        )
    if isinstance(value, str):
        number, symbol = _split(name, value, unit)
    else:
        try:
            number, symbol = float(value), ""
        except OverflowError:
            raise ValueError(f"{name} = {short(value)} is not finite") from None
    if not math.isfinite(number):
        raise ValueError(f"{name} = {short(value)} is not finite")
    if not isinstance(value, str):
        if unit == "rad":
            raise ValueError(f"{name} = {short(value)}: degrees or radians? Write it as {_sample(unit)}")
        symbol = bare or unit
    if symbol == unit:
        return number
    return _convert(name, value, number, symbol, unit, twin)


def parse_uncertain(
    name: str, value: Any, unit: str, bare: str | None = None, twin: str | None = None
) -> tuple[float, float]:
    """A quantity in SI and its standard deviation.

    Parameters
    ----------
    name, value, unit, bare, twin
        As of `parse_quantity`; the value may be a text like "12 mm +- 0.5 mm", "(12 +- 0.5) mm" or "1.2 +- 10 %", a
        share of the value. Between them stands +-, +/- or the sign of it.

    Returns
    -------
    value, deviation : float
        In `unit`; the deviation is >= 0, and 0 if not given.

    Raises
    ------
    ValueError
        As `parse_quantity`, and for what is no value and its deviation.

    Examples
    --------
    >>> parse_uncertain("drag_coefficient", "1.2 +- 0.2", "")
    (1.2, 0.2)
    """
    if not isinstance(value, str) or len(value) > _LONGEST or _PLUS_MINUS.search(value) is None:
        return parse_quantity(name, value, unit, bare, twin), 0.0
    bracketed = _BRACKETED.fullmatch(value)
    inside, common = bracketed.groups() if bracketed else (value, "")
    parts = [part.strip() for part in _PLUS_MINUS.split(inside)]
    if len(parts) != 2 or not all(parts):
        raise ValueError(f"{name} = {short(value)} is no value with its standard deviation; {_UNCERTAIN}")
    mean, spread = (f"{part} {common}".strip() for part in parts)
    about = f"the deviation of {name}"
    if spread.endswith("%") and "%" not in mean:
        number = parse_quantity(name, mean, unit, bare, twin)
        deviation = parse_quantity(about, spread, "") * abs(number)
    else:
        bare_mean, united = _QUANTITY.fullmatch(mean), _QUANTITY.fullmatch(spread)
        if bare_mean and united and not bare_mean[7]:
            mean = f"{mean} {united[7]}".strip()
        if unit and united and not united[7]:
            raise ValueError(f"{name} = {short(value)}: {spread} has no unit; {_UNCERTAIN}")
        number = parse_quantity(name, mean, unit, bare, twin)
        deviation = parse_quantity(about, spread, unit, bare, twin)
    if deviation < 0.0:
        raise ValueError(f"{about} = {short(spread)} is negative: what stands behind +- is a standard deviation")
    return number, deviation


def written_unit(text: str) -> str:
    """The unit in which a quantity is written.

    Parameters
    ----------
    text : str
        As of `parse_uncertain`.

    Returns
    -------
    str
        Empty for a pure number.

    Examples
    --------
    >>> written_unit("4 kn +- 0.2 kn"), written_unit("(12 +- 0.5) mm")
    ('kn', 'mm')
    """
    bracketed = _BRACKETED.fullmatch(text)
    parts = [bracketed[2]] if bracketed else _PLUS_MINUS.split(text)
    units = (match[7] if (match := _QUANTITY.fullmatch(part)) else part.strip() for part in parts)
    return next((unit for unit in units if unit), "")


def _split(name: str, text: str, unit: str) -> tuple[float, str]:
    parts = _QUANTITY.fullmatch(text) if len(text) <= _LONGEST else None
    if _PLUS_MINUS.search(text[:_LONGEST]):
        raise ValueError(f"{name} = {short(text)} takes no standard deviation; what is measured of a scene does")
    if parts is None:
        raise ValueError(
            f"{name} = {short(text)} is not {_KINDS[unit]}; write a number and its unit, as {_sample(unit)}"
        )
    sign, whole, above, below, number, divisor, symbol = parts.groups()
    try:
        if whole is not None:
            value = Fraction(whole) + Fraction(int(above), int(below))
        else:
            value = _decimal(number) / _decimal(divisor or "1")
        return float(-value if sign == "-" else value), symbol
    except (ZeroDivisionError, OverflowError):
        raise ValueError(f"{name} = {text!r} is not finite") from None


def _decimal(text: str) -> Fraction:
    """A decimal number as it is written; zero or OverflowError for an exponent that no float has."""
    exponent = int(text.lower().partition("e")[2] or "0")
    if exponent > _EXPONENT:
        raise OverflowError
    return Fraction(text) if exponent >= -_EXPONENT else Fraction(0)


def _convert(name: str, value: Any, number: float, symbol: str, unit: str, twin: str | None) -> float:
    for word in re.findall(r"[^\W\d_]+", symbol):
        if word in _AMBIGUOUS:
            raise ValueError(f"{name} = {short(value)}: {word} may be {_AMBIGUOUS[word]}")
    many = _PER_MANY.search(symbol)
    if many is not None:
        number, symbol = number / int(many[1]), f"{symbol[: many.start()]}/{symbol[many.end() :]}"
    symbol = _BARE_POWER.sub(r"^\1", symbol)
    known, key = _factors(), f"{symbol} in {unit}"
    factor = known.get(key)
    if factor is None:
        factor = _factor(name, value, symbol, unit, twin)
        if len(known) < _MOST_KEPT:
            known[key] = factor
            _keep(dict(known))
    converted = number * factor
    if not math.isfinite(converted):
        raise ValueError(f"{name} = {short(value)} is not finite")
    return converted


def _factor(name: str, value: Any, symbol: str, unit: str, twin: str | None) -> float:
    """How many of an SI unit another is."""
    registry = _registry()
    wanted = registry.Quantity(1.0, unit)
    try:
        if _UNIT.fullmatch(symbol) is None:
            raise ValueError
        given = registry.Quantity(1.0, registry.Unit(symbol))
        same = _same(given, wanted)
    except Exception:  # pint raises whatever its parser meets, and what powers of prefixes overflow
        raise ValueError(f"{name} = {short(value)}: unit {symbol!r} is unknown; write it as {_sample(unit)}") from None
    if not given._is_multiplicative or not same:
        raise ValueError(f"{name} = {short(value)} is not {_KINDS[unit]}{_hint(symbol, given, unit, twin)}")
    return float(given.to(wanted.units).magnitude)


def _hint(symbol: str, given: Any, unit: str, twin: str | None) -> str:
    if symbol == "":
        bare = "" if unit == "rad" else ", or the number alone, without quotes, for SI"
        return f": it has no unit; write {_sample(unit)}{bare}"
    if unit == "rad/s" and given.check("1/[time]"):
        return f": it is not clear whether {symbol!r} counts turns or radians; write rpm, rev/s or rad/s"
    if unit in ("N", "N/m") and given.check("[mass]" if unit == "N" else "[mass]/[length]"):
        kinds = f" but a mass; write {'kgf or lbf' if unit == 'N' else 'kgf/m or lbf/ft'} for the weight of a mass"
        return kinds + (f", or give the mass in air as {twin}" if twin else "")
    if unit in ("kg", "kg/m") and given.check("[force]" if unit == "kg" else "[force]/[length]"):
        kinds = f" but a weight; write {'kg or lb' if unit == 'kg' else 'kg/m or lb/ft'} for the mass"
        return kinds + (f", or give the weight in the fluid as {twin}" if twin else "")
    return f"; write it as {_sample(unit)}"


def _sample(unit: str) -> str:
    return {
        "m": '"120 m"',
        "m^2": '"0.1 m^2"',
        "m^3": '"12 l"',
        "m/s": '"3 kn"',
        "m/s^2": '"9.81 m/s^2"',
        "rad/s": '"40 rpm"',
        "rad": '"30 deg"',
        "s": '"2 min"',
        "kg": '"14.1 g"',
        "kg/m": '"0.18 g/ft"',
        "kg/m^3": '"1025 kg/m^3"',
        "N": '"50 N"',
        "N/m": '"2 N/m"',
        "": "1.2",
    }[unit]
