"""Table 2 recomputed, row by row: which column follows from which, and where the printed numbers do not."""

from dataclasses import dataclass
from math import asin, degrees, sqrt

import numpy as np

from towatlas.report.dtmb713.data import DENSITY, KNOT, LETTERS, Row, points, table_1, table_2

# What each column follows from, in the order of the table.
FOLLOWS = {
    "m": "l, n",
    "sin2_phi": "l",
    "sin_phi": "sin^2 phi",
    "phi_deg": "sin phi",
    "C_n": "speed, l, m, sin phi, Eq. (8a)",
    "C_s": "speed, n, sin phi, Eq. (7a)",
    "C_n_over_sin2": "C_n, sin^2 phi",
    "C_f": "speed, l, m, delta, Eq. (10a)",
}
# A drag that is further than this from a smooth curve over the speed, and than rounding, is called a slip; the curve is
# through the other rows of the cable, if there are so many that it does not bend to one of them.
SMOOTH, ENOUGH = 0.03, 20


@dataclass(frozen=True)
class Cell:
    """A number of Table 2 beside the same recomputed from others of its row.

    Attributes
    ----------
    row : int
        Of the table, from 0.
    column : str
    printed : str
    recomputed : float
    slack : float
        By how much rounding of the numbers it follows from may move it, and its own.
    """

    row: int
    column: str
    printed: str
    recomputed: float
    slack: float

    @property
    def agrees(self) -> bool:
        """Whether rounding explains the difference."""
        # What is on the edge of rounding is within it.
        return abs(self.recomputed - float(self.printed)) <= self.slack * (1.0 + 1e-9)

    @property
    def excess(self) -> float:
        """The difference over what rounding explains."""
        return abs(self.recomputed - float(self.printed)) / self.slack


def half_unit(text: str) -> float:
    """Half a unit of the last printed digit.

    Parameters
    ----------
    text : str

    Returns
    -------
    float

    Examples
    --------
    >>> half_unit("0.0130")
    5e-05
    """
    return 0.5 * 10.0 ** -len(text.partition(".")[2])


def recompute(number: int, printed: Row, row: Row) -> list[Cell]:
    """Every column of a row that follows from others.

    Parameters
    ----------
    number : int
        Of the row.
    printed, row : dict
        As printed, and with misprints mended, from which the others are recomputed.

    Returns
    -------
    list of Cell
    """
    value = {name: float(text) for name, text in row.items() if name != "cable"}
    half = {name: half_unit(text) for name, text in row.items() if name != "cable"}
    cable = table_1()[row["cable"]]
    weight, diameter = float(cable["weight_in_water"]), points(row["cable"]).diameter
    along, down, aside, sine = (value[name] for name in ("l", "m", "n", "sin_phi"))
    pressure = 0.5 * DENSITY * (value["speed_kn"] * KNOT) ** 2 * diameter
    twice = 2.0 * half["speed_kn"] / value["speed_kn"]
    square = 1.0 - along * along
    drag = (value["delta"] / along - weight * down) / pressure
    normal, side = (weight * cosine / sine / pressure for cosine in (down * along, aside))
    relative = {name: half[name] / value[name] for name in ("m", "n", "sin_phi", "C_n", "sin2_phi")}
    rest = sqrt(max(square - aside * aside, 0.0))
    ratio = value["C_n"] / value["sin2_phi"]
    angle = degrees(asin(sine))
    found = {
        # Of squares, so that a root near 0 has the slack it has.
        "m": (rest, half["l"] * along / down + half["n"] * aside / down),
        "sin2_phi": (square, 2.0 * half["l"]),
        "sin_phi": (sqrt(value["sin2_phi"]), 0.5 * half["sin2_phi"] / sine),
        "phi_deg": (angle, degrees(half["sin_phi"])),
        "C_n": (normal, normal * (relative["m"] + relative["sin_phi"] + twice)),
        "C_s": (side, side * (relative["n"] + relative["sin_phi"] + twice)),
        "C_n_over_sin2": (ratio, ratio * (relative["C_n"] + relative["sin2_phi"])),
        "C_f": (drag, (half["delta"] + weight * half["m"]) / pressure + twice * drag),
    }
    return [
        Cell(number, name, printed[name], again, half_unit(printed[name]) + slack)
        for name, (again, slack) in found.items()
    ]


def recompute_all() -> list[Cell]:
    """Every number of Table 2 that follows from others of its row.

    Returns
    -------
    list of Cell

    Examples
    --------
    >>> [(cell.row, cell.printed) for cell in recompute_all() if cell.column == "sin_phi" and not cell.agrees]
    [(149, '0.0479')]
    """
    rows = enumerate(zip(table_2(), table_2(mended=True), strict=True))
    return [cell for number, (printed, row) in rows for cell in recompute(number, printed, row)]


def drag_slips() -> list[Cell]:
    """Drags delta that are off a smooth curve over the speed, a parabola in logarithms.

    Returns
    -------
    list of Cell
        Those off by more than SMOOTH and rounding; recomputed is the value on the curve.
    """
    slips, first = [], 0
    printed = table_2()
    for letter in LETTERS:
        data = points(letter)
        x, y = np.log(data.speed), np.log(data.delta)
        for k in range(len(data) if len(data) >= ENOUGH else 0):
            others = np.arange(len(data)) != k
            smooth = float(np.exp(np.polyval(np.polyfit(x[others], y[others], 2), x[k])))
            text = printed[first + k]["delta"]
            cell = Cell(first + k, "delta", text, smooth, half_unit(text) + SMOOTH * smooth)
            if not cell.agrees:
                slips.append(cell)
        first += len(data)
    return slips
