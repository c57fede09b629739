"""Motions of the device, many side by side, by Taylor series in time.

A lane is one motion: columns of arrays are lanes, the first axis of a series its order. z = d phi/dt keeps its sign
along an arc, from one rest z = 0 to the next: motions are followed arc by arc.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience
from towatlas.solve.device.model import Device

Array = NDArray[np.float64]
# Told every step: which lanes, their series, how long each step is.
Each = Callable[[Any, Array, Array], None]

# Of series that hold to rounding, and of those that tell signs only, to 1e-11 or so, at half the cost.
ORDER, ROUGH = 24, 16
# The last two terms of a series of ORDER are this share of what is reached: rounding, and no more.
TOLERANCE = 1e-17
# An arc that leads once round the ship without a rest has none.
ROUND = 2.0 * np.pi
# Lift drives the device to no more than R tan alpha. Back in time what is faster runs away to infinity, at once.
FASTEST = 10.0
AT_REST = 1e-10
# Motions of cycles rest within a hundred or two, whatever k; slower ones end in a node.
STEPS = 600
NEWTON = 60
REMEDY = "a smaller k or fewer of them"


@dataclass(frozen=True)
class Lanes:
    """Devices and turns, one a lane.

    Attributes
    ----------
    k, a, b, R : ndarray, shape (lanes,)
        Force constant, cosine and sine of alpha, turning radius [-].
    """

    k: Array
    a: Array
    b: Array
    R: Array

    def part(self, which: Any) -> "Lanes":
        """Some of them.

        Parameters
        ----------
        which : ndarray of int or bool

        Returns
        -------
        Lanes
        """
        return Lanes(self.k[which], self.a[which], self.b[which], self.R[which])


def lanes_of(devices: list[Device], R: list[float] | Array) -> Lanes:
    """Lanes of devices.

    Parameters
    ----------
    devices : list of Device
    R : sequence of float
        A turning radius for each.

    Returns
    -------
    Lanes
    """
    return Lanes(
        np.array([one.k for one in devices]),
        np.array([one.a for one in devices]),
        np.array([one.b for one in devices]),
        np.array(R, float),
    )


@dataclass(frozen=True)
class Arcs:
    """Where arcs end.

    Attributes
    ----------
    phi : ndarray, shape (lanes,)
        Where each comes to rest [rad]; nan for one that goes once round the ship without, or into a node.
    time : ndarray, shape (lanes,)
        It takes [-].
    growth : ndarray, shape (lanes,)
        Integral of the divergence of the flow over it [-].
    """

    phi: Array
    time: Array
    growth: Array


def expand_motion(lanes: Lanes, phi: Array, z: Array, order: int = ORDER) -> Array:
    """Taylor series of motions.

    Parameters
    ----------
    lanes : Lanes
    phi, z : ndarray, shape (lanes,)
        Where they are.
    order : int
        Of the last term.

    Returns
    -------
    ndarray, shape (3, order + 1, lanes)
        Of phi, z and the integral of the divergence.
    """
    with np.errstate(all="ignore"):
        return _expand(lanes, phi, z, order)


def _expand(lanes: Lanes, phi: Array, z: Array, order: int) -> Array:
    k, a, b, R = lanes.k, lanes.a, lanes.b, lanes.R
    series = np.zeros((3, order + 1, len(phi)))
    p, v, grown = series
    s, c, U, w, S, h, slope = (np.zeros((order + 1, len(phi))) for _ in range(7))
    p[0], v[0] = phi, z
    for n in range(order):
        if n == 0:
            s[0], c[0] = np.sin(phi), np.cos(phi)
        else:
            j = np.arange(1, n + 1)[:, None] * p[1 : n + 1] / n
            s[n], c[n] = (j * c[n - 1 :: -1]).sum(axis=0), -(j * s[n - 1 :: -1]).sum(axis=0)
        U[n], w[n] = R * s[n] + v[n] + (n == 0), R * c[n]
        h[n] = a * U[n] - b * w[n]
        square = (U[: n + 1] * U[n::-1] + w[: n + 1] * w[n::-1]).sum(axis=0)
        if n == 0:
            S[0] = np.sqrt(square)
            slope[0] = U[0] * h[0] / S[0]
        else:
            S[n] = (square - (S[1:n] * S[n - 1 : 0 : -1]).sum(axis=0)) / (2.0 * S[0])
            product = (U[: n + 1] * h[n::-1]).sum(axis=0)
            slope[n] = (product - (S[1 : n + 1] * slope[n - 1 :: -1]).sum(axis=0)) / S[0]
        p[n + 1] = v[n] / (n + 1)
        v[n + 1] = (w[n] - k * (S[: n + 1] * h[n::-1]).sum(axis=0)) / (n + 1)
        grown[n + 1] = -k * (slope[n] + a * S[n]) / (n + 1)
    return series


def evaluate(series: Array, time: Array) -> Array:
    """Values of series.

    Parameters
    ----------
    series : ndarray, shape (..., order + 1, lanes)
    time : ndarray, shape (lanes,)

    Returns
    -------
    ndarray, shape (..., lanes)
    """
    value = series[..., -1, :]
    for n in range(series.shape[-2] - 2, -1, -1):
        value = value * time + series[..., n, :]
    return value


def step_of(series: Array) -> Array:
    """How far series of phi and z hold, those of ORDER to rounding, by their last two terms.

    Parameters
    ----------
    series : ndarray, shape (3, order + 1, lanes)

    Returns
    -------
    ndarray, shape (lanes,)
    """
    scale = np.maximum(1e-3, np.abs(series[1, 0]))
    order, steps = series.shape[1] - 1, []
    tolerance = TOLERANCE ** (order / ORDER)
    for n in (order - 1, order):
        last = np.abs(series[:2, n]).max(axis=0) / scale
        steps.append((tolerance / np.maximum(last, 1e-300)) ** (1.0 / n))
    return np.minimum(*steps)


def follow_arcs(
    lanes: Lanes,
    phi: Array,
    z: Array,
    side: float,
    *,
    backward: bool = False,
    order: int = ORDER,
    each: Each | None = None,
) -> Arcs:
    """Follow motions to their next rest.

    Parameters
    ----------
    lanes : Lanes
    phi, z : ndarray, shape (lanes,)
        Where they begin; z is zero or has the sign of `side`.
    side : {1.0, -1.0}
        Sign of z along the arcs.
    backward : bool
        Whether time runs back.
    order : int
        Of the series.
    each : callable, optional
        Told every step: which lanes, their series, how long each step is.

    Returns
    -------
    Arcs
    """
    count = len(phi)
    start, phi, z = phi.copy(), phi.copy(), z.copy()
    end, time, growth = np.full(count, np.nan), np.zeros(count), np.zeros(count)
    fastest = FASTEST * (1.0 + lanes.R) / np.maximum(lanes.a, 1e-6)
    active = np.arange(count)
    for _ in range(STEPS):
        if not len(active):
            break
        check_patience("following motions of the device", REMEDY)
        series = expand_motion(lanes.part(active), phi[active], z[active], order)
        if backward:
            series[:, 1::2] *= -1.0
        # A motion through S = 0 has no series there; its terms overflow, and the lane ends without a rest.
        sound = np.isfinite(series).all(axis=(0, 1))
        step = np.where(sound, step_of(np.where(sound, series, 0.0)), 0.0)
        after = evaluate(series, step)
        resting = sound & (after[1] * side <= 0.0)
        step[resting] = _rest(series[1][:, resting], step[resting])
        after = evaluate(series, step)
        if each is not None:
            each(active, series, step)
        phi[active], z[active] = after[0], after[1]
        time[active] += step
        growth[active] += after[2]
        end[active[resting]] = after[0][resting]
        # Into a node: the rest is never reached.
        gone = ~sound | (np.abs(after[1]) < AT_REST * (1.0 + lanes.R[active]))
        gone |= (np.abs(after[0] - start[active]) > ROUND) | (np.abs(after[1]) > fastest[active])
        active = active[~resting & ~gone]
    return Arcs(end, time, growth)


def _rest(z: Array, step: Array) -> Array:
    """When z is zero: one root between the beginning, where z may be zero too, and the end of a step."""
    # Without the root at the beginning.
    begun = z[0] == 0.0
    z = np.where(begun, np.concatenate([z[1:], np.zeros_like(z[:1])]), z)
    slope = np.arange(1, len(z))[:, None] * z[1:]
    sign = np.sign(evaluate(z, np.zeros_like(step)))
    low, high, time = np.zeros_like(step), step.copy(), 0.5 * step
    for _ in range(NEWTON):
        value = evaluate(z, time)
        before = value * sign > 0.0
        low, high = np.where(before, time, low), np.where(before, high, time)
        with np.errstate(all="ignore"):
            trial = time - value / evaluate(slope, time)
        new = np.where((trial > low) & (trial < high), trial, 0.5 * (low + high))
        if (np.abs(new - time) <= 4e-16 * step).all():
            return new
        time = new
    return time
