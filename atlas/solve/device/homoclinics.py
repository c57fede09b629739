"""Homoclinic orbits: a motion leaves a saddle and comes back to it.

Both manifolds of a saddle are followed to their first rest on one side of it, the unstable one forward, the stable one
back in time; the orbit is closed where they rest at the same phi. As phi only moves on while z has its sign, neither
spirals before.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from math import hypot

import numpy as np

from towatlas.numerics.rows import bracket
from towatlas.solve.device.cycles import Steps, keep, may_close, tensions
from towatlas.solve.device.flow import ORDER, ROUGH, Array, follow_arcs, lanes_of
from towatlas.solve.device.local import Bifurcation, angle
from towatlas.solve.device.model import RIGHT_ANGLE, Device, expand
from towatlas.solve.device.points import saddle_nodes, tension_at_rest, velocity

# Manifolds begin so far from the saddle, in phi, times k where that is large; they are known to the cube of it.
_START = 1e-4
# Saddles looked at: of a piece of a sheet, closer at its ends, and all round the ship,
# closer at the centre of the turn, where those of large k are.
_ENDS = np.geomspace(1e-4, 0.05, 12)
_PIECE = np.concatenate([_ENDS, np.linspace(0.05, 0.95, 40)[1:-1], 1.0 - _ENDS[::-1]])
_BESIDE = np.geomspace(1e-5, np.pi, 160)
_AROUND = np.concatenate([-_BESIDE[::-1], _BESIDE]) - 0.5 * np.pi
# Cells where a gap changes sign are divided so often, into so many; what stays wider than this, round by round, jumps.
# Near heteroclinic orbits it is steep: only what is left at the end is known to be closed, this well.
_LOOKS, _FINER = 3, 8
_WIDEST = (4.0, 3.0, 1.5, 0.6)
_CLOSED = 1e-6


@dataclass(frozen=True)
class Saddle:
    """A saddle, of which a family is one curve over t.

    Attributes
    ----------
    device : Device
    u, w : float
        Velocity of the device there [-].
    """

    device: Device
    u: float
    w: float

    @property
    def R(self) -> float:
        """Turning radius [-]."""
        return hypot(self.u - 1.0, self.w)


# A parameter along a family -> the saddle there, or None.
Family = Callable[[float], Saddle | None]


def homoclinics_at_alpha(device: Device) -> list[Bifurcation]:
    """Homoclinic orbits as the turning radius moves.

    Parameters
    ----------
    device : Device

    Returns
    -------
    list of Bifurcation
    """
    if not may_close(device):
        return []
    found = []
    for side in (1, -1):
        ends = [0.0, *saddle_nodes(device, side), 5.0 + 5.0 * device.k]
        for low, high in itertools.pairwise(ends):

            def family(x: float, side: int = side) -> Saddle | None:
                return _saddle(device, *velocity(device, side, x))

            if family(0.5 * (low + high)):
                found += _closed(family, low + (high - low) * _PIECE)
    return found


def homoclinics_at_radius(k: float, R: float) -> list[Bifurcation]:
    """Homoclinic orbits as alpha moves.

    Parameters
    ----------
    k, R : float
        [-], > 0

    Returns
    -------
    list of Bifurcation
    """
    found = []
    for sheet in (1, -1):

        def family(phi: float, sheet: int = sheet) -> Saddle | None:
            u, w = 1.0 + R * np.sin(phi), R * np.cos(phi)
            alpha = angle(k, u, w, sheet)
            return _saddle(Device(k, alpha), u, w) if abs(alpha) < RIGHT_ANGLE else None

        found += _closed(family, _AROUND)
    return found


def _saddle(device: Device, u: float, w: float) -> Saddle | None:
    saddle = may_close(device) and expand(device, u, w).b10 > 0.0
    return Saddle(device, float(u), float(w)) if saddle else None


def _closed(family: Family, values: Array) -> list[Bifurcation]:
    """Homoclinic orbits along a family of saddles."""
    found = []
    for way in (1.0, -1.0):

        def gap(t: Array, order: int, way: float = way) -> Array:
            saddles = [family(float(one)) for one in t]
            value = np.full(len(t), np.nan)
            value[[i for i, one in enumerate(saddles) if one]] = gaps([one for one in saddles if one], way, order)
            return value

        found += [_orbit(family(t), way) for t in _roots(gap, values)]
    return [one for one in found if one]


def _roots(gap: Callable[[Array, int], Array], values: Array) -> list[float]:
    """Where a gap is closed: it changes sign, and is the smaller the closer it is looked at. Elsewhere it jumps."""
    low, high = values[:-1], values[1:]
    at = gap(values, ROUGH)
    at_low, at_high = at[:-1], at[1:]
    for round_ in range(_LOOKS + 1):
        with np.errstate(invalid="ignore"):
            cells = (at_low * at_high < 0.0) & (np.maximum(np.abs(at_low), np.abs(at_high)) < _WIDEST[round_])
        low, high, at_low, at_high = low[cells], high[cells], at_low[cells], at_high[cells]
        if not len(low):
            return []
        if round_ < _LOOKS:
            t = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, _FINER + 1)
            at = np.column_stack([at_low, gap(t[:, 1:-1].ravel(), ROUGH).reshape(-1, _FINER - 1), at_high])
            low, high, at_low, at_high = (part.ravel() for part in (t[:, :-1], t[:, 1:], at[:, :-1], at[:, 1:]))
    # Rough signs may be wrong in the last of them by a hair.
    low, high = low - 0.01 * (high - low), high + 0.01 * (high - low)
    sign = np.sign(at_high)
    # A manifold is known to 1e-14 or so.
    t, solved = bracket(
        lambda t, i: (sign[i] * gap(t, ORDER), np.full(len(t), np.nan)), low, high, resolution=1e-14 * np.abs(low)
    )
    t = t[solved]
    return [float(one) for one in t[np.abs(gap(t, ORDER)) < _CLOSED]] if len(t) else []


def gaps(saddles: list[Saddle], way: float, order: int = ORDER) -> Array:
    """How far the unstable manifold of a saddle rests beyond the stable one.

    Parameters
    ----------
    saddles : list of Saddle
    way : {1.0, -1.0}
        On the side of larger or of smaller phi.
    order : int
        Of the series.

    Returns
    -------
    ndarray, shape (saddles,)
        [rad]; nan where one of them goes round the ship.
    """
    if not saddles:
        return np.empty(0)
    return _rest(saddles, way, False, order) - _rest(saddles, way, True, order)


def _rest(saddles: list[Saddle], way: float, stable: bool, order: int, steps: Steps | None = None) -> Array:
    """Where manifolds rest."""
    lanes = lanes_of([one.device for one in saddles], [one.R for one in saddles])
    starts = np.array([_begin(one, way, stable) for one in saddles])
    side = -way if stable else way
    each = None if steps is None else keep(steps)
    return follow_arcs(lanes, starts[:, 0], starts[:, 1], side, backward=stable, order=order, each=each).phi


def _begin(saddle: Saddle, way: float, stable: bool) -> tuple[float, float]:
    """A point on a manifold: z = rate d + bend d^2."""
    e = expand(saddle.device, saddle.u, saddle.w)
    rate = e.eigenvalues[1 if stable else 0].real
    bend = (e.b20 + e.b11 * rate + e.b02 * rate * rate) / (3.0 * rate - e.b01)
    d = way * _START / max(1.0, saddle.device.k)
    return float(np.arctan2(saddle.u - 1.0, saddle.w)) + d, d * (rate + bend * d)


def _orbit(saddle: Saddle | None, way: float) -> Bifurcation | None:
    if saddle is None:
        return None
    phi = float(np.arctan2(saddle.u - 1.0, saddle.w))
    least = tension_at_rest(saddle.device, saddle.u, saddle.w)
    lanes = lanes_of([saddle.device], [saddle.R])
    for stable in (False, True):
        steps: Steps = []
        _rest([saddle], way, stable, ORDER, steps)
        # Steps back in time have turned series: their tension has to be that of the motion forward.
        least = min(least, tensions(lanes, steps)[0])
    return Bifurcation("homoclinic", saddle.R, saddle.device.alpha, phi, None, least, least > 0.0)
