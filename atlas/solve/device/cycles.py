"""Limit cycles: the device swings steadily.

phi moves on where z > 0 and back where z < 0, and simple closed curves do not cross themselves: a cycle is at rest
twice, at its least and its greatest phi. Between a saddle and the fixed point that follows it all motions from rest are
followed to their next rest on the same side; cycles are where they come back to.
"""

import itertools
from dataclasses import dataclass
from math import exp, pi
from typing import Any

import numpy as np

from towatlas.effort import patience
from towatlas.numerics.rows import Integers, bracket
from towatlas.solve.device.flow import ORDER, Array, Each, Lanes, evaluate, follow_arcs, lanes_of
from towatlas.solve.device.model import Device, check_device, check_radius, expand
from towatlas.solve.device.points import velocities

# Starts of motions, as shares of the way from a fixed point to its saddle: closer at both ends, where small cycles and
# those of long period are.
_NEAR = np.geomspace(1e-5, 0.02, 24)
SHARES = np.concatenate([_NEAR, np.linspace(0.02, 0.98, 50)[1:-1], 1.0 - _NEAR[::-1]])
# Between starts where something may be hidden so many more are tried, so many times.
FINER, ROUNDS = 12, 3
# A step of tension is looked at in so many places, and a polynomial laid through them.
LOOKS = 9
# Series of one lane, and how long each step is.
Steps = list[tuple[Array, float]]


@dataclass(frozen=True)
class Cycle:
    """A limit cycle.

    Attributes
    ----------
    amplitude : float
        Half of what phi sweeps over [rad], > 0.
    period : float
        Times omega [-]; 2 pi is a turn of the ship.
    tension_min : float
        Least tension of the line over m L omega^2 [-]. Not positive: the line goes slack, and the model ends.
    stable : bool
        Whether motions nearby come to it.
    phi_min, phi_max : float
        Ends of what phi sweeps over [rad].
    multiplier : float
        By which a small distance from it grows in a period [-].
    slack : float
        Share of the period in which the line would have to push [-], 0 to 1.
    """

    amplitude: float
    period: float
    tension_min: float
    stable: bool
    phi_min: float
    phi_max: float
    multiplier: float
    slack: float


def cycles(k: float, alpha: float, R: float) -> tuple[Cycle, ...]:
    """All limit cycles about fixed points found for a device behind a ship in a circle.

    Parameters
    ----------
    k : float
        Force constant of the fluid k L/m [-], 1e-4 to 1e5.
    alpha : float
        Angle of the fluid's force against the velocity [rad], -pi/2 to pi/2.
    R : float
        Turning radius over the length of the line [-], 1e-4 to 1e6.

    Returns
    -------
    tuple of Cycle
        In rising order of phi_min. None where cos alpha >= 1/3, by Bendixson's criterion; none at right angles, where
        closed motions come in families.

    Raises
    ------
    ValueError
        For numbers out of range.
    towatlas.TooMuchWork

    Notes
    -----
    Cycles that lead round the ship are not among them: no line stays taut on one. Two cycles about to merge that are
    closer than about 1e-4 of the way between fixed point and saddle may be missed.

    Examples
    --------
    >>> [(round(c.amplitude, 5), c.stable, c.tension_min > 0.0) for c in cycles(1.0, -1.4, 2.0)]
    [(0.58286, True, False)]
    """
    device, R = check_device(k, alpha), check_radius(R)
    if not may_close(device):
        return ()
    with patience():
        found = [cycle_from(device, R, phi) for low, high in spans(device, R) for phi in _starts(device, R, low, high)]
    return tuple(sorted(found, key=lambda cycle: cycle.phi_min))


def may_close(device: Device) -> bool:
    """Whether a motion that does not lead round the ship can be closed.

    Parameters
    ----------
    device : Device

    Returns
    -------
    bool

    Notes
    -----
    With the direction psi of the velocity the divergence of the flow is -k S (3 cos alpha + cos(2 psi + alpha))/2:
    where cos alpha >= 1/3 it has one sign, and Bendixson's criterion excludes cycles and homoclinic orbits for every k
    and R. At right angles there are families of closed motions, no single ones.
    """
    return 0.0 < device.a < 1.0 / 3.0


def spans(device: Device, R: float) -> list[tuple[float, float]]:
    """From each saddle to the fixed point that follows it, as phi rises.

    Parameters
    ----------
    device : Device
    R : float
        Turning radius [-].

    Returns
    -------
    list of (float, float)
        [rad]
    """
    found = sorted((np.arctan2(u - 1.0, w), expand(device, u, w).b10 > 0.0) for u, w in velocities(device, R))
    around = [*found, *((phi + 2.0 * pi, saddle) for phi, saddle in found[:1])]
    return [(low, high) for (low, saddle), (high, _) in itertools.pairwise(around) if saddle]


def returns(lanes: Lanes, phi: Array, order: int = ORDER) -> tuple[Array, Array]:
    """Where motions from rest come to rest again on the same side, and the slope of that.

    Parameters
    ----------
    lanes : Lanes
    phi : ndarray, shape (lanes,)
        Where they begin, with dz/dt > 0 [rad].
    order : int
        Of the series.

    Returns
    -------
    phi, slope : ndarray, shape (lanes,)
        nan where a motion goes round the ship.
    """
    up = follow_arcs(lanes, phi, np.zeros_like(phi), 1.0, order=order)
    there, slope = np.full(len(phi), np.nan), np.full(len(phi), np.nan)
    good = np.flatnonzero(np.isfinite(up.phi))
    part = lanes.part(good)
    down = follow_arcs(part, up.phi[good], np.zeros(len(good)), -1.0, order=order)
    there[good] = down.phi
    # What flows through a piece of the line z = 0 is dz/dt times its length, and grows with the divergence.
    with np.errstate(all="ignore"):
        slope[good] = np.exp(up.growth[good] + down.growth) * push(part, phi[good]) / push(part, down.phi)
    return there, slope


def push(lanes: Lanes, phi: Array) -> Array:
    """dz/dt at rest.

    Parameters
    ----------
    lanes : Lanes
    phi : ndarray, shape (lanes,)

    Returns
    -------
    ndarray, shape (lanes,)
    """
    u, w = 1.0 + lanes.R * np.sin(phi), lanes.R * np.cos(phi)
    return w - lanes.k * np.hypot(u, w) * (lanes.a * u - lanes.b * w)


def _many(device: Device, R: float, count: int) -> Lanes:
    return lanes_of([device] * count, [R] * count)


def _starts(device: Device, R: float, low: float, high: float) -> list[float]:
    """Least phi of every cycle between a saddle and the fixed point after it."""

    def gains(shares: Array) -> Array:
        phi = high - (high - low) * shares
        return (returns(_many(device, R, len(shares)), phi)[0] - phi) / ((high - low) * shares)

    shares: Array = SHARES
    gain = gains(shares)
    for _ in range(ROUNDS):
        cells = _suspect(gain)
        if not len(cells):
            break
        inner = np.linspace(0.0, 1.0, FINER + 2)[1:-1]
        more = (shares[cells, None] + (shares[cells + 1] - shares[cells])[:, None] * inner).ravel()
        merged = np.concatenate([shares, more])
        order = np.argsort(merged)
        shares, gain = merged[order], np.concatenate([gain, gains(more)])[order]
    with np.errstate(invalid="ignore"):
        cells = np.flatnonzero(gain[:-1] * gain[1:] < 0.0)
    if not len(cells):
        return []
    sign = np.sign(gain[cells])

    def distance(phi: Array, i: Integers) -> tuple[Array, Array]:
        there, slope = returns(_many(device, R, len(i)), phi)
        return sign[i] * (there - phi), sign[i] * (slope - 1.0)

    place = [high - (high - low) * shares[cells + k] for k in (1, 0)]
    phi, solved = bracket(distance, *place, last_step=1e-9)
    if not solved.all():
        raise ArithmeticError(f"a limit cycle near phi = {place[0][~solved][0]:g} could not be made out")
    return [float(one) for one in phi]


def _suspect(gain: Array) -> Any:
    """Cells in which cycles may hide: beside where motions begin to go round, and beside extrema near zero."""
    known = np.isfinite(gain)
    edge = known[:-1] != known[1:]
    with np.errstate(invalid="ignore"):
        turning = (gain[1:-1] - gain[:-2]) * (gain[2:] - gain[1:-1]) < 0.0
        turning &= (gain[1:-1] * (gain[1:-1] - gain[:-2]) < 0.0) & (gain[1:-1] * gain[2:] > 0.0)
    near = np.zeros(len(gain), bool)
    near[1:-1] = turning
    return np.flatnonzero(edge | near[:-1] | near[1:])


def cycle_from(device: Device, R: float, phi: float) -> Cycle:
    """The cycle through a rest.

    Parameters
    ----------
    device : Device
    R, phi : float
        Turning radius [-]; the least angle of the line [rad].

    Returns
    -------
    Cycle
    """
    lanes = _many(device, R, 1)
    steps: Steps = []
    up = follow_arcs(lanes, np.array([phi]), np.zeros(1), 1.0, each=keep(steps))
    down = follow_arcs(lanes, up.phi, np.zeros(1), -1.0, each=keep(steps))
    period, growth = float(up.time[0] + down.time[0]), float(up.growth[0] + down.growth[0])
    least, slack = tensions(lanes, steps)
    turn = 2.0 * pi * np.floor((phi + pi) / (2.0 * pi))
    low, high = float(phi - turn), float(up.phi[0] - turn)
    return Cycle(0.5 * (high - low), period, least, growth < 0.0, low, high, exp(growth), slack / period)


def keep(steps: Steps) -> Each:
    """Gather the steps of the first lane.

    Parameters
    ----------
    steps : list
        To which they are added: series, and how long each is.

    Returns
    -------
    callable
        For `follow_arcs`.
    """
    return lambda _, series, step: steps.append((series, float(step[0])))


def tensions(lanes: Lanes, steps: Steps) -> tuple[float, float]:
    """Least tension along a motion, and how long the line is slack.

    Parameters
    ----------
    lanes : Lanes
        One.
    steps : list
        From `keep`.

    Returns
    -------
    least, slack : float
        Over m L omega^2 [-]; [-].
    """
    least, slack = np.inf, 0.0
    shares = 0.5 - 0.5 * np.cos(np.linspace(0.0, pi, LOOKS))
    for series, step in steps:
        # Through the tensions of a step one polynomial.
        values = _tension_of(lanes, series, shares * step)
        polynomial = np.polynomial.Chebyshev.fit(shares, values, LOOKS - 1, domain=[0.0, 1.0])
        turns = _inside(polynomial.deriv().roots())
        least = min(least, float(_tension_of(lanes, series, np.concatenate([shares, turns]) * step).min()))
        marks = np.concatenate([[0.0], _inside(polynomial.roots()), [1.0]])
        low = polynomial(0.5 * (marks[:-1] + marks[1:])) <= 0.0
        slack += step * float(np.diff(marks)[low].sum())
    return least, slack


def _inside(roots: Any) -> Array:
    roots = np.asarray(roots, complex)
    return np.sort(roots.real[(np.abs(roots.imag) < 1e-12) & (roots.real > 0.0) & (roots.real < 1.0)])


def _tension_of(lanes: Lanes, series: Array, time: Array) -> Array:
    return tension_along(lanes, *evaluate(np.repeat(series[:2], len(time), axis=2), time))


def tension_along(lanes: Lanes, phi: Array, z: Array) -> Array:
    """Tension of the line over m L omega^2, Eq. (16).

    Parameters
    ----------
    lanes : Lanes
        One, or as many as there are columns.
    phi, z : ndarray
        Angles of the line [rad] and their rates [-].

    Returns
    -------
    ndarray
    """
    u, w = 1.0 + lanes.R * np.sin(phi), lanes.R * np.cos(phi)
    U = u + z
    return lanes.k * np.hypot(U, w) * (lanes.b * U + lanes.a * w) + u + 2.0 * z + z * z
