"""Fixed points of the device: it stands still behind the ship, the ship turns.

In polar coordinates of the velocity Eq. (17) is solved by x = k sqrt(G) > 0 on two sheets, side = +1 or -1,

    u = side x (1 + b x)/(k D),  w = side a x^2/(k D),  D^2 = 1 + 2 b x + x^2,

and the turning radius is that of R^2 = (u - 1)^2 + w^2. Its slope in x has the sign of x D^3 - side k N(x),
N = 1 + 3 b x + 3 b^2 x^2 + b x^3: zeros of it are the saddle-nodes, and between two of them a radius is met once.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from math import asin, atan2, cos, hypot

from towatlas.numerics.rows import root
from towatlas.solve.device.model import Device, check_device, check_radius, expand, tension


@dataclass(frozen=True)
class Point:
    """A fixed point.

    Attributes
    ----------
    phi : float
        Angle of the line [rad], -pi to pi: 0 straight behind the ship, positive outwards.
    stable : bool
        Whether what is near comes back to it: both eigenvalues have a negative real part.
    tension : float
        Of the line over m L omega^2 [-]; negative where it would have to push.
    physical : bool
        Whether the line is taut, tension > 0.
    eigenvalues : tuple of complex, length 2
        Growth rates over omega [-].
    """

    phi: float
    stable: bool
    tension: float
    physical: bool
    eigenvalues: tuple[complex, complex]


def points(k: float, alpha: float, R: float) -> tuple[Point, ...]:
    """All fixed points of a device behind a ship in a circle: none, two or four.

    Parameters
    ----------
    k : float
        Force constant of the fluid, k L/m with the printed k in kg/m [-], 1e-4 to 1e5.
    alpha : float
        Angle of the fluid's force against the velocity [rad], -pi/2 to pi/2; positive pulls out of the turn.
    R : float
        Turning radius of the ship over the length of the line [-], 1e-4 to 1e6.

    Returns
    -------
    tuple of Point
        In rising order of phi.

    Raises
    ------
    ValueError
        For numbers out of range.

    Notes
    -----
    Eq. (17), whose solutions are explicit in k sqrt(G); the radius along them is solved between its extrema, so that
    none is missed. The line is taut where cos phi > 0: T = k G^(3/2) cos alpha/(R cos phi). At R = 1 the device can
    rest at the centre, phi = -pi/2, on a slack line: Eqs. (19) and (20) are 0/0 there, their limit is a saddle of
    growth rates +-1.

    References
    ----------
    Ng, Rand and Keith, Dynamics of towed cables during transient motions, DETC2001/VIB-21438, Eqs. (15) to (20), with
    k L/m for the k/(m L) printed.

    Examples
    --------
    >>> [(round(p.phi, 4), p.stable, p.physical) for p in points(1.0, 0.5, 1.5)]
    [(-1.6904, False, False), (0.3642, True, True)]
    """
    device, R = check_device(k, alpha), check_radius(R)
    return tuple(sorted((make_point(device, u, w) for u, w in velocities(device, R)), key=lambda point: point.phi))


def make_point(device: Device, u: float, w: float) -> Point:
    """A fixed point from the velocity of the device.

    Parameters
    ----------
    device : Device
    u, w : float
        [-]

    Returns
    -------
    Point
    """
    phi = atan2(u - 1.0, w)
    eigenvalues = expand(device, u, w).eigenvalues
    # Right angles are reversible: what has no growth by symmetry shall not have one by rounding.
    if device.a == 0.0 and eigenvalues[0].imag:
        eigenvalues = (1j * eigenvalues[0].imag, 1j * eigenvalues[1].imag)
    force = tension_at_rest(device, u, w)
    return Point(phi, eigenvalues[0].real < 0.0, force, force > 0.0, eigenvalues)


def tension_at_rest(device: Device, u: float, w: float) -> float:
    """Tension of the line at a fixed point, without the cancellation of Eq. (16).

    Parameters
    ----------
    device : Device
    u, w : float
        Velocity of the device [-].

    Returns
    -------
    float
        Over m L omega^2 [-].
    """
    # On the line of symmetry w vanishes, or is rounding alone.
    if not device.a or abs(w) < 1e-12:
        return tension(device, u, w)
    return device.k * hypot(u, w) ** 3 * device.a / w


def velocities(device: Device, R: float) -> list[tuple[float, float]]:
    """Velocities u, w of the device in its fixed points.

    Parameters
    ----------
    device : Device
    R : float
        Turning radius [-].

    Returns
    -------
    list of (float, float)
        [-]
    """
    if device.a == 0.0:
        return _reversible(device, R)
    found = [(0.0, 0.0)] if R == 1.0 else []
    for side in (1, -1):
        ends = [0.0, *saddle_nodes(device, side), 1.01 * device.k * (R + 1.0)]
        found += [velocity(device, side, x) for x in _met(device, side, R, ends)]
    return found


def _met(device: Device, side: int, R: float, ends: list[float]) -> list[float]:
    """Where the radius is met, once at most between two ends."""
    excess = _excess(device, side, R)
    found = []
    for low, high in itertools.pairwise(ends):
        at_low, at_high = excess(low), excess(high)
        if at_low == 0.0 and low > 0.0:
            found.append(low)
        elif at_low * at_high < 0.0:
            found.append(root(excess, low, high))
    return found


def _excess(device: Device, side: int, R: float) -> Callable[[float], float]:
    def excess(x: float) -> float:
        rho = x / device.k
        return rho * (rho - 2.0 * side * _ahead(device, x) / _distance(device, x)) + (1.0 - R) * (1.0 + R)

    return excess


def velocity(device: Device, side: int, x: float) -> tuple[float, float]:
    """Velocity u, w of the device at x = k sqrt(G) on one of the two sheets.

    Parameters
    ----------
    device : Device
        Not at a right angle.
    side : {1, -1}
        1 where the line is taut.
    x : float
        [-], > 0

    Returns
    -------
    u, w : float
    """
    rho = side * x / (device.k * _distance(device, x))
    return rho * _ahead(device, x), rho * device.a * x


def _ahead(device: Device, x: float) -> float:
    """1 + b x, without cancellation near b = -1, x = 1."""
    b = device.b
    return 1.0 + b * x if b > -0.5 else 1.0 - x + device.a**2 / (1.0 - b) * x


def _distance(device: Device, x: float) -> float:
    return hypot(_ahead(device, x), device.a * x)


def _rise(device: Device, x: float) -> float:
    return _ahead(device, x) ** 3 + device.a**2 * device.b * x**3


def saddle_nodes(device: Device, side: int) -> list[float]:
    """Where the turning radius of the fixed points has an extremum, as x = k sqrt(G).

    Parameters
    ----------
    device : Device
        Not at a right angle.
    side : {1, -1}
        1 where the line is taut: one there; none or two on the other.

    Returns
    -------
    list of float
        Rising.
    """
    k = device.k

    def slope(x: float) -> float:
        return x * _distance(device, x) ** 3 - side * k * _rise(device, x)

    zero = _zero_of_rise(device)
    if side == 1:
        return [root(slope, 0.0, min(zero, 3.0 * k))]
    # Where N is small beyond any k in use there are none: x D^3/N is larger than x there.
    if zero > 10.0 * (1.0 + k):
        return []
    least, least_k = corner(device)
    if k <= least_k:
        return []
    return [root(slope, zero, least), root(slope, least, 5.0 + 5.0 * k)]


def _zero_of_rise(device: Device) -> float:
    """The x beyond which N is negative."""
    b = device.b
    return 1.0 / (-b + (device.a**2 * -b) ** (1.0 / 3.0)) if b < 0.0 else float("inf")


def corner(device: Device) -> tuple[float, float]:
    """Where on the slack sheet both saddle-nodes meet, and for which k.

    Parameters
    ----------
    device : Device
        Of b < 0; its k does not matter.

    Returns
    -------
    x, k : float
        The least k of a device with this alpha that has them.

    Notes
    -----
    There k = -x D^3/N has its minimum: N (1 + 5 b x + 4 x^2) = 3 b x D^4.
    """
    b, low = device.b, _zero_of_rise(device)

    def cusp(x: float) -> float:
        first = (1.0 - x) * (1.0 - 4.0 * x) + 5.0 * device.a**2 / (1.0 - b) * x
        return first * _rise(device, x) - 3.0 * b * x * _distance(device, x) ** 4

    high = 2.0 * low
    while cusp(high) > 0.0:
        high *= 2.0
    x = root(cusp, low, high)
    return x, -x * _distance(device, x) ** 3 / _rise(device, x)


def _reversible(device: Device, R: float) -> list[tuple[float, float]]:
    """Fixed points at right angles: on the line of symmetry, and for an inward force where k^2 G = 1."""
    found = [(1.0 + R, 0.0), (1.0 - R, 0.0)]
    sine = (1.0 / device.k**2 - 1.0 - R * R) / (2.0 * R)
    if device.b < 0.0 and abs(sine) < 1.0:
        phi = asin(sine)
        found += [(1.0 + R * sine, R * cos(phi)), (1.0 + R * sine, -R * cos(phi))]
    return found
