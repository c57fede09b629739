"""Types of arguments with units."""

import argparse
import math
from dataclasses import dataclass
from typing import Any


def quantity(unit: str, bare: str | None = None) -> Any:
    """The type of an argument with a unit, positive; a bare number is SI, or in the unit named."""

    def positive(text: str) -> float:
        from towatlas.scene.units import parse_quantity

        try:
            value: float | str = float(text)
        except ValueError:
            value = text
        try:
            number = parse_quantity("value", value, unit, bare)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error).removeprefix("value = ")) from None
        if number <= 0.0:
            raise argparse.ArgumentTypeError(f"{text} is not positive")
        return number

    return positive


@dataclass(frozen=True)
class Range:
    """Two values in SI, and the unit in which they were written, if one was, with its size."""

    low: float
    high: float
    unit: str
    size: float


def ends_of(text: str) -> list[str]:
    """The two values of a range A:B; both with a unit, or neither."""
    parts = [part.strip() for part in text.split(":")]
    if len(parts) == 2:
        plain = [is_plain(part) for part in parts]
        if plain[0] != plain[1]:
            bare, full = parts if plain[0] else parts[::-1]
            raise ValueError(f"{text}: what unit is {bare} in? Write it as that of {full}")
    return parts


def is_plain(text: str) -> bool:
    """Whether a text is a number alone."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def range_of(unit: str) -> Any:
    """The type of an argument that is two values of a unit with a colon between them."""
    one = quantity(unit)

    def parsed(text: str) -> Range:
        from towatlas.scene.units import parse_quantity, written_unit

        try:
            parts = ends_of(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        if len(parts) != 2:
            raise argparse.ArgumentTypeError(f"{text} is no range, as 1{unit}:8{unit}")
        low, high = (float(one(part)) for part in parts)
        if not low < high < math.inf:
            raise argparse.ArgumentTypeError(f"{text}: the lower one first, and a higher one")
        name = next((name for part in parts if (name := written_unit(part.strip()))), unit)
        return Range(low, high, name, parse_quantity(unit, f"1 {name}", unit))

    return parsed
