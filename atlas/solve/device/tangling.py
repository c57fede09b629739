"""Where two lines tangle: at which turning radius of the ship their devices lie on one bearing."""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, hypot

import numpy as np

from towatlas.checks import check_one
from towatlas.numerics.rows import root
from towatlas.solve.device.model import Device, check_device
from towatlas.solve.device.points import make_point, saddle_nodes, velocity

# Of one line the fixed points are explicit over k sqrt(G): so many are looked at, over so many decades beyond the
# lengths.
_LOOKS, _DECADES = 4000, 6.0
# Minima of what should vanish are looked at closer in so many rounds, for pairs of roots between two looks.
_ROUNDS = 40


@dataclass(frozen=True)
class Line:
    """A line and its device.

    Attributes
    ----------
    length : float
        Of the line [m], > 0.
    k : float
        Force of the fluid over the square of the speed [kg/m], > 0.
    mass : float
        Of the device, with the water that it carries along [kg], > 0.
    alpha : float
        Angle of the fluid's force against the velocity [rad], -pi/2 to pi/2; positive pulls out of the turn.
    """

    length: float
    k: float
    mass: float
    alpha: float

    @property
    def device(self) -> Device:
        """Without dimensions: k L/m and alpha."""
        return Device(self.k * self.length / self.mass, self.alpha)


@dataclass(frozen=True)
class Tangle:
    """A turn in which two lines lie on one bearing.

    Attributes
    ----------
    R : float
        Turning radius of the ship [m], > 0.
    phi : float
        Angle of both lines [rad].
    stable : tuple of bool, length 2
        Whether each device comes back to it.
    tension : tuple of float, length 2
        Of each line [N].
    physical : bool
        Whether both lines are taut: they are, or none is.
    """

    R: float
    phi: float
    stable: tuple[bool, bool]
    tension: tuple[float, float]
    physical: bool


def check_line(line: Line) -> Line:
    """A line whose numbers are in range.

    Parameters
    ----------
    line : Line

    Returns
    -------
    Line
        The same.

    Raises
    ------
    ValueError
    """
    for name in ("length", "k", "mass"):
        check_one(name, getattr(line, name))
    check_device(line.device.k, line.alpha)
    return line


def tangle(one: Line, other: Line, speed: float = 1.0) -> tuple[Tangle, ...]:
    """All turning radii at which two lines tangle.

    Parameters
    ----------
    one, other : Line
    speed : float
        Of the ship [m/s], > 0; tensions grow with its square, nothing else depends on it.

    Returns
    -------
    tuple of Tangle
        In falling order of R; those on slack lines too.

    Raises
    ------
    ValueError
        For numbers out of range, right angles, and two lines that are the same.

    Notes
    -----
    Eqs. (27) and (28): along the fixed points of the one line, which are explicit, the second equation has a root.
    Of many strong devices, k L/m to infinity, alpha - asin(L cos alpha/R) is the same for both.

    Examples
    --------
    >>> [(round(t.R, 6), t.stable) for t in tangle(Line(300.0, 60.0, 300.0, 0.9), Line(150.0, 60.0, 300.0, 0.5))]
    [(212.302651, (True, True))]
    """
    check_line(one)
    check_line(other)
    check_one("speed", speed)
    if not (one.device.a and other.device.a):
        raise ValueError("at alpha = +-90 degrees a device has no drag and settles nowhere: lines tangle at others")
    if one.length == other.length and one.device == other.device:
        raise ValueError("the two lines are the same, on one bearing in every turn: give two that differ")
    found = [_tangle(one, other, side, x, speed) for side in (1, -1) for x in _roots(one, other, side)]
    return tuple(sorted(found, key=lambda tangled: -tangled.R))


def _bearing(one: Line, side: int, x: float) -> tuple[float, float]:
    """Turning radius [m] and angle of a fixed point of the one line."""
    u, w = velocity(one.device, side, x)
    return one.length * hypot(u - 1.0, w), atan2(u - 1.0, w)


def _imbalance(one: Line, other: Line, side: int, x: float) -> float:
    """Eq. (17) of the other line on the bearing of the one, over the largest of its terms."""
    device, (R, phi) = other.device, _bearing(one, side, x)
    r = R / other.length
    u, w = 1.0 + r * np.sin(phi), r * np.cos(phi)
    force = device.k * np.hypot(u, w) * (device.a * u - device.b * w)
    return float((w - force) / (1.0 + r) ** 2 / (1.0 + device.k))


def _roots(one: Line, other: Line, side: int) -> list[float]:
    device = one.device

    def imbalance(x: float) -> float:
        return _imbalance(one, other, side, x)

    longest = device.k * (1.0 + other.length / one.length) * 10.0**_DECADES
    shortest = min(1.0, device.k) * 10.0**-_DECADES
    marks = sorted({*np.geomspace(shortest, longest, _LOOKS).tolist(), *saddle_nodes(device, side)})
    values = [imbalance(x) for x in marks]
    found = []
    for k in range(len(marks) - 1):
        if values[k] * values[k + 1] < 0.0:
            found.append(root(imbalance, marks[k], marks[k + 1]))
        elif k and values[k - 1] * values[k] > 0.0 and abs(values[k]) < min(abs(values[k - 1]), abs(values[k + 1])):
            found += _pair(imbalance, marks[k - 1], marks[k], marks[k + 1])
    return found


def _pair(imbalance: Callable[[float], float], low: float, middle: float, high: float) -> list[float]:
    """Two roots about a minimum, if it lies on the other side of zero."""
    sign = 1.0 if imbalance(middle) > 0.0 else -1.0
    for _ in range(_ROUNDS):
        tries = [0.5 * (low + middle), middle, 0.5 * (middle + high)]
        values = [sign * imbalance(x) for x in tries]
        if min(values) < 0.0:
            least = tries[int(np.argmin(values))]
            return [root(imbalance, low, least), root(imbalance, least, high)]
        k = int(np.argmin(values))
        low, middle, high = [low, *tries, high][k : k + 3]
    return []


def _tangle(one: Line, other: Line, side: int, x: float, speed: float) -> Tangle:
    R, phi = _bearing(one, side, x)
    points = []
    for line in (one, other):
        r = R / line.length
        points.append(make_point(line.device, 1.0 + r * np.sin(phi), r * np.cos(phi)))
    rate = speed / R
    first, second = (
        float(point.tension) * line.mass * line.length * rate * rate
        for point, line in zip(points, (one, other), strict=True)
    )
    return Tangle(R, phi, (points[0].stable, points[1].stable), (first, second), first > 0.0 and second > 0.0)
