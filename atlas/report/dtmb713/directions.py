"""How the cables trail by their laws: each alone on a circle so great that it is straight, at every speed measured."""

from dataclasses import dataclass, replace
from functools import cache
from math import inf

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels.system import COLUMNS
from towatlas.report.dtmb713.data import DENSITY, LETTERS, points, table_1
from towatlas.scene.file import make_scene
from towatlas.solve.many import equilibria_many
from towatlas.system import System

Array = NDArray[np.float64]
# Of the circle: its curvature moves no direction by 0.001 degrees.
RADIUS = "1000 km"


@dataclass(frozen=True)
class Directions:
    """Unit vectors along the stream, downwards and to starboard, of the points of a cable.

    Attributes
    ----------
    measured, by_laws, without_side : ndarray, shape (points, 3)
        Of the report, by the program with the laws of the cable, and with its normal and tangential force alone.
    """

    measured: Array
    by_laws: Array
    without_side: Array

    def off_deg(self, directions: Array) -> Array:
        """Angles from the measured ones.

        Parameters
        ----------
        directions : ndarray, shape (points, 3)

        Returns
        -------
        ndarray, shape (points,)
            [deg].
        """
        return np.degrees(np.linalg.norm(directions - self.measured, axis=1))

    @property
    def rms_deg(self) -> float:
        """Root mean square angle between the directions measured and those by the laws [deg]."""
        return float(np.sqrt(np.mean(np.square(self.off_deg(self.by_laws)))))

    @property
    def too_deep_deg(self) -> Array:
        """How much deeper the cable would tow without side force [deg]."""
        deep, measured = (np.degrees(np.arcsin(v[:, 1])) for v in (self.without_side, self.measured))
        return deep - measured


@cache
def all_directions() -> dict[str, Directions]:
    """Of every cable, by its letter.

    Returns
    -------
    dict
    """
    systems: list[System] = []
    speeds: list[float] = []
    lengths: list[float] = []
    for letter in LETTERS:
        scene = make_scene(
            {
                "cable": {"type": f"pode-{letter}", "length": f"{table_1()[letter]['length_ft']} ft"},
                "tow": {"radius": RADIUS, "speed": "1 kn", "turn": "starboard"},
                "fluid": {"density": f"{DENSITY} slug/ft^3"},
            }
        )
        system = scene.system("water")
        for speed in points(letter).speed:
            systems += [system, replace(system, C_s=0.0, b_s=inf)]
            speeds += [scene.gamma * speed] * 2
            lengths += [system.lam] * 2
    rows = np.array([system.row() for system in systems])
    keys = dict(zip(COLUMNS, rows.T, strict=True))
    found = equilibria_many(gamma=np.array(speeds), **keys)
    # The tow point moves along y, and starboard is inwards.
    place = [-found.y_f, found.z_f, 1.0 - found.x_f]
    towed = np.stack([column.values[:, 0] for column in place], axis=1) / np.array(lengths)[:, None]
    answer, first = {}, 0
    for letter in LETTERS:
        data = points(letter)
        mine = towed[first : first + 2 * len(data)]
        along = np.sqrt(1.0 - np.square(data.m) - np.square(data.n))
        measured = np.stack([along, data.m, data.n], axis=1)
        answer[letter] = Directions(measured, mine[::2], mine[1::2])
        first += 2 * len(data)
    return answer
