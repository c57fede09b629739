"""The largest tension along a cable, which need not be at the tow point."""

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import patience
from towatlas.results import Equilibria
from towatlas.solve.shapes import line_of

# Samples along the cable, at least, for each node, and at most, each a shot of its own; about the largest it is sampled
# again, twice, until a parabola through three of them has its top where the tension has.
SAMPLES, SAMPLES_A_NODE, MOST, CLOSER, LOOKS = 201, 16, 4001, 51, 2


def largest_tension(found: Equilibria, row: int) -> tuple[float, float]:
    """The largest tension along one equilibrium, and where it is.

    Parameters
    ----------
    found : Equilibria
        From `towatlas.equilibria`.
    row : int
        Which of them.

    Returns
    -------
    tension : float
        Over (mu + rho A) g R [-], > 0.
    s : float
        Arc length from the tow point over tow radius [-], 0 to lam.

    Raises
    ------
    ArithmeticError
        If the computation overflows.

    Notes
    -----
    Without drag along the cable T + gamma^2 (x^2 + y^2) / 2 + w z is the same everywhere along it: tension has maxima
    where the cable comes near the axis.

    Examples
    --------
    >>> from towatlas import equilibria
    >>> found = equilibria(37.8, 1352, 5.94)
    >>> [round(value, 2) for value in largest_tension(found, found.expected)]
    [1489.67, 17.45]
    """
    lam = found.system.lam
    s = np.linspace(0.0, lam, min(MOST, max(SAMPLES, SAMPLES_A_NODE * int(found.nodes[row]))))
    tension = _tensions(found, row, s)
    for _ in range(LOOKS):
        at = int(np.argmax(tension))
        s = np.linspace(s[max(0, at - 1)], s[min(len(s) - 1, at + 1)], CLOSER)
        tension = _tensions(found, row, s)
    at = int(np.argmax(tension))
    if 0 < at < len(s) - 1:
        before, top, after = tension[at - 1 : at + 2]
        place = s[at] + 0.5 * (s[at + 1] - s[at]) * (before - after) / (before - 2.0 * top + after)
        return float(_tensions(found, row, np.array([place]))[0]), float(place)
    return float(tension[at]), float(s[at])


def _tensions(found: Equilibria, row: int, s: NDArray[np.float64]) -> NDArray[np.float64]:
    with patience():
        return line_of(found, row)(found.system.lam - s)[6]
