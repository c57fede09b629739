"""Where fixed points change: saddle-nodes, Hopf points, neutral saddles, and the points at which their curves change.

With p = w/u Hopf points and neutral saddles, F_z = 0, are explicit: tan alpha = (p^2 + 2)/p, p < 0, and

    u = +-sqrt(p^2 + 4)/(k (1 + p^2)).

The line is taut where u < 0. Saddle-nodes at a given R are roots of a quartic in y = 1 + sin phi,

    (R - 1 + y)^2 (k^2 G^2 - w^2) = (y (1 + R^2) - (R - 1)^2)^2,  G = (R - 1)^2 + 2 R y,  w^2 = R^2 y (2 - y),

some of which belong to no fixed point: squaring brought them in.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import acos, atan, atan2, cos, hypot, log, pi, sin, sqrt, tan

import numpy as np

from towatlas.numerics.rows import root
from towatlas.solve.device.model import RIGHT_ANGLE, Device, check_strength, expand
from towatlas.solve.device.points import corner, saddle_nodes, tension_at_rest, velocity

# Differences that tell on which side of a bifurcation the stable point is, as shares of what moves along the branch.
_ASIDE = 1e-4
# Of the residual of a root of the quartic over the terms of its equations; those that squaring brought in have O(1).
_SPURIOUS = 1e-5
# Where p is looked for, and so often.
_SLOPES = [-(10.0 ** (0.02 * n)) for n in range(-300, 301)]


@dataclass(frozen=True)
class Bifurcation:
    """A point at which the motions of a device change.

    Attributes
    ----------
    kind : str
        "saddle-node", "hopf", "neutral-saddle", "homoclinic", "cycle-saddle-node"; of a whole k "degenerate-hopf",
        "takens-bogdanov", "cusp" and "hopf-limit", the alpha beyond which there is no Hopf point.
    R : float
        Turning radius [-], > 0.
    alpha : float
        Angle of the fluid's force [rad].
    phi : float
        Angle of the line there [rad]: of the fixed point, of the saddle of a homoclinic orbit, the least of a cycle.
    stable_side : str or None
        "above" or "below": on which side, in what moves, the fixed point or the cycle is stable; None for neither.
    tension : float
        Of the line there over m L omega^2 [-]; of a cycle the least.
    physical : bool
        Whether the line is taut there, all along a cycle.
    """

    kind: str
    R: float
    alpha: float
    phi: float
    stable_side: str | None
    tension: float
    physical: bool


def describe(kind: str, device: Device, u: float, w: float, stable_side: str | None = None) -> Bifurcation:
    """A bifurcation of a fixed point.

    Parameters
    ----------
    kind : str
    device : Device
    u, w : float
        Velocity there [-].
    stable_side : str, optional

    Returns
    -------
    Bifurcation
    """
    R, phi = hypot(u - 1.0, w), atan2(u - 1.0, w)
    force = tension_at_rest(device, u, w)
    return Bifurcation(kind, R, device.alpha, phi, stable_side, force, force > 0.0)


def at_alpha(device: Device) -> list[Bifurcation]:
    """Local bifurcations as the turning radius moves.

    Parameters
    ----------
    device : Device

    Returns
    -------
    list of Bifurcation
        Unsorted; none at right angles.
    """
    if device.a == 0.0:
        return []
    found = []
    for side in (1, -1):
        for x in saddle_nodes(device, side):
            near = [velocity(device, side, x * (1.0 + step)) for step in (-_ASIDE, 0.0, _ASIDE)]
            radii = [hypot(u - 1.0, w) for u, w in near]
            above = radii[0] + radii[2] > 2.0 * radii[1]
            settles = expand(device, *near[1]).b01 < 0.0
            found.append(describe("saddle-node", device, *near[1], _side(above) if settles else None))
    for u, w in hopf_velocities(device):
        side, x = (1 if w > 0.0 else -1), device.k * hypot(u, w)
        near = [velocity(device, side, x * (1.0 + step)) for step in (-_ASIDE, _ASIDE)]
        radii = [hypot(a - 1.0, b) for a, b in near]
        traces = [expand(device, *one).b01 for one in near]
        found.append(_trace_zero(device, u, w, (traces[1] - traces[0]) * (radii[1] - radii[0])))
    return found


def _side(above: bool) -> str:
    return "above" if above else "below"


def _trace_zero(device: Device, u: float, w: float, rises: float) -> Bifurcation:
    """A Hopf point, or a neutral saddle, by the sign of the determinant."""
    if expand(device, u, w).b10 >= 0.0:
        return describe("neutral-saddle", device, u, w)
    return describe("hopf", device, u, w, _side(rises < 0.0))


def hopf_velocities(device: Device) -> list[tuple[float, float]]:
    """Where F_z = 0 at a fixed point, for one alpha.

    Parameters
    ----------
    device : Device

    Returns
    -------
    list of (float, float)
        u, w: four, two where cos alpha = 1/3, or none.
    """
    slope = tan(device.alpha)
    if slope > 0.0 or slope * slope < 8.0:
        return []
    large = 0.5 * (slope - sqrt(slope * slope - 8.0))
    return [hopf_velocity(device.k, p, sign) for p in {large, 2.0 / large} for sign in (-1, 1)]


def hopf_velocity(k: float, p: float, sign: int) -> tuple[float, float]:
    """Velocity u, w at p = w/u on the curve of Hopf points and neutral saddles.

    Parameters
    ----------
    k : float
    p : float
        [-], < 0
    sign : {-1, 1}
        Of u; -1 where the line is taut.

    Returns
    -------
    u, w : float
    """
    u = sign * hypot(p, 2.0) / (k * (1.0 + p * p))
    return u, p * u


def hopf_device(k: float, p: float) -> Device:
    """The device at p = w/u on that curve.

    Parameters
    ----------
    k : float
    p : float
        [-], < 0

    Returns
    -------
    Device
    """
    return Device(k, atan2(-(p * p + 2.0), -p))


def at_radius(k: float, R: float) -> list[Bifurcation]:
    """Local bifurcations as alpha moves from -pi/2 to pi/2.

    Parameters
    ----------
    k, R : float
        [-], > 0

    Returns
    -------
    list of Bifurcation
        Unsorted.
    """
    found = []
    for device, sheet, u, w in saddle_nodes_at(k, R):
        near = [angle(k, *_aside(u, w, step), sheet) - device.alpha for step in (-_ASIDE, _ASIDE)]
        settles = expand(device, u, w).b01 < 0.0
        found.append(describe("saddle-node", device, u, w, _side(sum(near) > 0.0) if settles else None))
    for p, sign in _hopf_slopes(k, R):
        device, (u, w) = hopf_device(k, p), hopf_velocity(k, p, sign)
        sheet = min((1, -1), key=lambda s: abs(angle(k, u, w, s) - device.alpha))
        beside = [_aside(u, w, step) for step in (-_ASIDE, _ASIDE)]
        ends = [Device(k, angle(k, *one, sheet)) for one in beside]
        traces = [expand(one, *there).b01 for one, there in zip(ends, beside, strict=True)]
        found.append(_trace_zero(device, u, w, (traces[1] - traces[0]) * (ends[1].alpha - ends[0].alpha)))
    return found


def angle(k: float, u: float, w: float, sheet: int) -> float:
    """The alpha of which the device with this velocity is at rest, one on each of two sheets.

    Parameters
    ----------
    k : float
    u, w : float
        Velocity [-].
    sheet : {1, -1}

    Returns
    -------
    float
        -pi to pi [rad]; nan where there is none.
    """
    G = u * u + w * w
    if not k * G > abs(w):
        return float("nan")
    alpha = sheet * acos(w / (k * G)) - atan2(w, u)
    return (alpha + pi) % (2.0 * pi) - pi


def _aside(u: float, w: float, step: float) -> tuple[float, float]:
    """Velocity where phi is larger by a step."""
    return 1.0 + (u - 1.0) * cos(step) + w * sin(step), w * cos(step) - (u - 1.0) * sin(step)


def saddle_nodes_at(k: float, R: float) -> list[tuple[Device, int, float, float]]:
    """Saddle-nodes at one turning radius, with the sheet of alpha and the velocity.

    Parameters
    ----------
    k, R : float
        [-], > 0

    Returns
    -------
    list of (Device, int, float, float)
        Device, sheet, u, w.
    """
    found = []
    for y in quartic_roots(k, R):
        u, across = 1.0 - R + R * y, R * sqrt(y * (2.0 - y))
        for w, sheet in ((across, 1), (across, -1), (-across, 1), (-across, -1)):
            alpha = angle(k, u, w, sheet)
            if abs(alpha) < RIGHT_ANGLE:
                device = Device(k, alpha)
                if abs(expand(device, u, w).b10) < _SPURIOUS * (R + abs(u - 1.0)):
                    found.append((device, sheet, u, w))
    return found


def quartic_roots(k: float, R: float) -> list[float]:
    """Roots y = 1 + sin phi of the quartic of the saddle-nodes, spurious ones among them.

    Parameters
    ----------
    k, R : float
        [-], > 0

    Returns
    -------
    list of float
        0 to 2, ends excluded.
    """
    # Terms of the centre, R = 1 and y = 0, near which devices of large k are.
    away = R - 1.0
    P = np.polynomial.Polynomial
    square = k * k * P([away * away, 2.0 * R]) ** 2 - R * R * P([0.0, 2.0, -1.0])
    quartic = P([away, 1.0]) ** 2 * square - P([-away * away, 1.0 + R * R]) ** 2
    slope = quartic.deriv()
    found = []
    for root_ in np.asarray(quartic.roots(), complex):
        y = float(root_.real)
        if abs(root_.imag) < 1e-6 * abs(y) and 0.0 < y < 2.0:
            for _ in range(3):
                y -= float(quartic(y) / slope(y)) if slope(y) else 0.0
            if 0.0 < y < 2.0:
                found.append(y)
    return found


def _hopf_slopes(k: float, R: float) -> Iterator[tuple[float, int]]:
    """p and the sign of u of F_z = 0 at one turning radius: h = sqrt(p^2 + 4) solves a quadratic."""
    excess = k * k * (R - 1.0) * (R + 1.0)
    for sign in (-1, 1):
        for h in np.roots([excess - 1.0, 2.0 * sign * k, -3.0 * excess]):
            if h.imag == 0.0 and h.real > 2.0:
                yield -sqrt((h.real - 2.0) * (h.real + 2.0)), sign


def of_family(k: float) -> list[Bifurcation]:
    """Points of the whole family of one k, over alpha and R.

    Parameters
    ----------
    k : float
        [-], > 0

    Returns
    -------
    list of Bifurcation
    """
    k = check_strength(k)
    found = [
        describe("degenerate-hopf", hopf_device(k, p), *hopf_velocity(k, p, sign)) for p, sign in degenerate_hopf(k)
    ]
    # k^2 (1 + R^2)^2 = R^2 + 4.
    half = k * k - 0.5
    square = (4.0 - k * k) / (half + sqrt(half * half + k * k * (4.0 - k * k))) if k < 2.0 else 0.0
    if square > 0.0:
        R = sqrt(square)
        found.append(describe("takens-bogdanov", Device(k, -atan((square + 2.0) / R)), 1.0, -R))
    found.append(describe("hopf-limit", Device(k, -acos(1.0 / 3.0)), *hopf_velocity(k, -sqrt(2.0), -1)))
    return found + _cusps(k)


def degenerate_hopf(k: float) -> list[tuple[float, int]]:
    """Where Hopf points change from cycles that are born stable to unstable, as p = w/u and the sign of u.

    Parameters
    ----------
    k : float
        [-], > 0

    Returns
    -------
    list of (float, int)
    """
    found = []
    for sign in (-1, 1):

        def sigma(p: float, sign: int = sign) -> float:
            expansion = expand(hopf_device(k, p), *hopf_velocity(k, p, sign))
            # Beside neutral saddles there are no cycles.
            return expansion.sigma if expansion.b10 < 0.0 else float("nan")

        values = [sigma(p) for p in _SLOPES]
        found += [
            (root(sigma, low, high), sign)
            for low, high, before, after in zip(_SLOPES[:-1], _SLOPES[1:], values[:-1], values[1:], strict=True)
            if before * after < 0.0
        ]
    return found


def _cusps(k: float) -> list[Bifurcation]:
    """Two on the line of symmetry alpha = -pi/2, and the corner where both saddle-nodes of the slack sheet meet."""
    inward = Device(k, -RIGHT_ANGLE)
    # k |u| = 1: the force of the fluid is that of the turn, and the line carries none.
    on_line = [describe("cusp", inward, u, 0.0) for u in ([-1.0 / k] if k == 1.0 else [-1.0 / k, 1.0 / k])]
    found = [replace(one, tension=0.0, physical=False) for one in on_line]
    alpha = root(lambda alpha: log(corner(Device(k, alpha))[1] / k), -RIGHT_ANGLE + 1e-14, -1e-14)
    device = Device(k, alpha)
    return [*found, describe("cusp", device, *velocity(device, -1, corner(device)[0]))]
