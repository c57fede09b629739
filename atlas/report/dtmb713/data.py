"""Tables 1 and 2 of DTMB Report 713: as printed, and as numbers with two misprints mended."""

import csv
from collections import Counter
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Row = dict[str, str]

# Density of the water [slug/ft^3], which the report does not print: that of its coefficients.
DENSITY = 1.934
KNOT = 1852.0 / 3600.0 / 0.3048  # [ft/s]
LETTERS = "ABCDEFGH"
# Table 3 as printed.
TABLE_3 = dict(zip(LETTERS, ("1.82", "1.57", "1.47", "1.71", "1.34", "1.21", "1.23", "1.33"), strict=True))


@dataclass(frozen=True)
class Misprint:
    """A number of Table 2 that the others of its row contradict.

    Attributes
    ----------
    cable, speed : str
        Its row, the speed as printed [kn].
    column : str
    printed, mended : str
    """

    cable: str
    speed: str
    column: str
    printed: str
    mended: str


MISPRINTS = (
    Misprint("H", "11.96", "m", "0.0418", "0.0448"),
    Misprint("H", "15.91", "sin_phi", "0.0479", "0.0419"),
)


@dataclass(frozen=True)
class Points:
    """The rows of a cable as numbers, misprints mended.

    Attributes
    ----------
    cable : str
        Its letter.
    diameter : float
        [ft].
    weight : float
        In water, over its length [lbf/ft].
    speed : ndarray, shape (points,)
        [kn].
    l, m, n : ndarray, shape (points,)
        Direction cosines along the stream, downwards and to starboard [-].
    C_n, C_s, C_f : ndarray, shape (points,)
        Coefficients of the normal, side and tangential force, on the diameter [-].
    sin_phi : ndarray, shape (points,)
        Sine of the angle between cable and stream [-].
    phi_deg : ndarray, shape (points,)
        That angle [deg].
    ratio : ndarray, shape (points,)
        C_n over sin^2(phi), as printed [-].
    delta : ndarray, shape (points,)
        Drag over the length of the cable [lbf/ft].
    """

    cable: str
    diameter: float
    weight: float
    speed: Array
    l: Array  # noqa: E741, the report's letter
    m: Array
    n: Array
    C_n: Array
    C_s: Array
    C_f: Array
    sin_phi: Array
    phi_deg: Array
    ratio: Array
    delta: Array

    def __len__(self) -> int:
        """Number of points."""
        return len(self.speed)

    @property
    def pressure(self) -> Array:
        """(1/2) rho U^2 d, what forces over the length are divided by [lbf/ft]."""
        return 0.5 * DENSITY * np.square(self.speed * KNOT) * self.diameter


@cache
def _read(name: str) -> tuple[Row, ...]:
    text = (resources.files("towatlas.report.dtmb713") / name).read_text(encoding="utf-8")
    return tuple(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def table_1() -> dict[str, Row]:
    """Table 1 as printed, by the letter of the cable.

    Returns
    -------
    dict
        Rows of texts.
    """
    return {row["cable"]: row for row in _read("table1.csv")}


def table_2(mended: bool = False) -> list[Row]:
    """Table 2 as printed, or with its misprints mended.

    Parameters
    ----------
    mended : bool

    Returns
    -------
    list of dict
        Rows of texts, in the order of the report.

    Examples
    --------
    >>> len(table_2()), table_2()[0]["C_n"]
    (152, '0.0293')
    """
    rows = [dict(row) for row in _read("table2.csv")]
    if mended:
        for row in rows:
            for wrong in MISPRINTS:
                if (row["cable"], row["speed_kn"]) == (wrong.cable, wrong.speed):
                    row[wrong.column] = wrong.mended
    return rows


def counts() -> dict[str, int]:
    """Number of rows of each cable.

    Returns
    -------
    dict
    """
    return dict(Counter(row["cable"] for row in table_2()))


@cache
def points(letter: str) -> Points:
    """The rows of a cable as numbers, misprints mended.

    Parameters
    ----------
    letter : str
        One of LETTERS.

    Returns
    -------
    Points

    Examples
    --------
    >>> points("C").ratio.mean().round(3)
    np.float64(1.467)
    """
    cable = table_1()[letter]
    rows = [row for row in table_2(mended=True) if row["cable"] == letter]
    columns = {name: np.array([float(row[name]) for row in rows]) for name in rows[0] if name != "cable"}
    return Points(
        cable=letter,
        diameter=float(Fraction(cable["diameter_in"])) / 12.0,
        weight=float(cable["weight_in_water"]),
        speed=columns.pop("speed_kn"),
        ratio=columns.pop("C_n_over_sin2"),
        **{name: column for name, column in columns.items() if name != "sin2_phi"},
    )
