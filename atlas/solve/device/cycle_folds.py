"""Saddle-nodes of cycles: a stable and an unstable one meet, and are gone."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from towatlas.solve.device.cycles import cycle_from, returns, spans
from towatlas.solve.device.flow import ROUGH, Array, lanes_of
from towatlas.solve.device.local import Bifurcation
from towatlas.solve.device.model import Device

# What moves -> the device and the turning radius.
Moving = Callable[[float], tuple[Device, float]]

# Where cycles are counted between two other bifurcations, as shares: near degenerate Hopf points the last pair is born
# in a wedge that is the thinner the closer they are, beside others at some distance.
_THIN = 10.0 ** np.arange(-10.0, -2.0)
_COLUMNS = np.concatenate([_THIN, [0.03, 0.12, 0.3, 0.5, 0.7, 0.88, 0.97], 1.0 - _THIN[::-1]])
# And where they are looked for, as shares of the way from a fixed point to its saddle.
_NEAR = np.geomspace(1e-3, 0.04, 8)
_SHARES = np.concatenate([_NEAR, np.linspace(0.04, 0.96, 32)[1:-1], 1.0 - _NEAR[::-1]])
# A pair is followed towards its end by so many halvings, or until it is so close, before Newton's method.
_HALVINGS, _CLOSE = 10, 0.1
_ROUNDS, _STEP = 20, 1e-5
# Newton's steps end in rounding, which is large where the pair is small: when they grow again, below this.
_SETTLED = 1e-6


@dataclass(frozen=True)
class _Column:
    """Cycles between saddles and fixed points of one device and turn: shares of the way, by the side of the point."""

    value: float
    shares: dict[int, Array]


def cycle_folds(at: Moving, breaks: list[float]) -> list[Bifurcation]:
    """Saddle-nodes of cycles as something moves.

    Parameters
    ----------
    at : callable
        From what moves to the device and the turning radius.
    breaks : list of float
        Of what moves, rising: ends of the range, and where cycles are born or end otherwise.

    Returns
    -------
    list of Bifurcation
    """
    found = []
    for low, high in itertools.pairwise(breaks):
        columns = _columns(at, low + (high - low) * _COLUMNS)
        for one, other in itertools.pairwise(columns):
            for side in (1, -1):
                if abs(_count(one, side) - _count(other, side)) == 2:
                    found += _fold(at, one, other, side)
    return found


def _count(column: _Column, side: int) -> int:
    return len(column.shares.get(side, ()))


def _spans(device: Device, R: float) -> Iterator[tuple[int, float, float]]:
    """Side of the sheet of a fixed point, its phi, and how far its saddle is."""
    for low, high in spans(device, R):
        yield (1 if np.cos(high) > 0.0 else -1), high, high - low


def _columns(at: Moving, values: Array) -> list[_Column]:
    settings = [at(float(value)) for value in values]
    rows = [(k, *span) for k, setting in enumerate(settings) for span in _spans(*setting)]
    if not rows:
        return [_Column(float(value), {}) for value in values]
    many = len(_SHARES)
    lanes = lanes_of(
        [settings[k][0] for k, *_ in rows for _ in _SHARES], [settings[k][1] for k, *_ in rows for _ in _SHARES]
    )
    d = np.concatenate([reach * _SHARES for *_, reach in rows])
    phi = np.repeat([high for _, _, high, _ in rows], many) - d
    gain = ((returns(lanes, phi, ROUGH)[0] - phi) / d).reshape(-1, many)
    columns = [_Column(float(value), {}) for value in values]
    for (k, side, _, _), row in zip(rows, gain, strict=True):
        with np.errstate(invalid="ignore"):
            cells = np.flatnonzero(row[:-1] * row[1:] < 0.0)
        share = row[cells] / (row[cells] - row[cells + 1])
        columns[k].shares[side] = _SHARES[cells] + share * (_SHARES[cells + 1] - _SHARES[cells])
    return columns


def _fold(at: Moving, one: _Column, other: _Column, side: int) -> list[Bifurcation]:
    with_pair, without = (one, other) if _count(one, side) > _count(other, side) else (other, one)
    fewer = _count(without, side)
    for _ in range(_HALVINGS):
        if np.diff(with_pair.shares[side]).min() < _CLOSE:
            break
        (middle,) = _columns(at, np.array([0.5 * (with_pair.value + without.value)]))
        if _count(middle, side) == fewer + 2:
            with_pair = middle
        else:
            without = middle
    shares = with_pair.shares[side]
    k = int(np.argmin(np.diff(shares)))
    solved = _newton(at, side, np.array([0.5 * (shares[k] + shares[k + 1]), with_pair.value]))
    if solved is None:
        return []
    share, value = solved
    device, R = at(value)
    high, reach = next((high, reach) for s, high, reach in _spans(device, R) if s == side)
    cycle = cycle_from(device, R, high - share * reach)
    side_of_pair = "above" if with_pair.value > value else "below"
    return [
        Bifurcation(
            "cycle-saddle-node",
            R,
            device.alpha,
            cycle.phi_min,
            side_of_pair,
            cycle.tension_min,
            cycle.tension_min > 0.0,
        )
    ]


def _newton(at: Moving, side: int, unknowns: Array) -> tuple[float, float] | None:
    """Share and value at which motions come back to where they began, and those beside them too."""
    # A difference of one unit of either is large.
    scale = np.array([_STEP, _STEP * min(1.0, abs(unknowns[1]))])
    size = np.inf
    for _ in range(_ROUNDS):
        points = unknowns + np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]]) * scale
        residuals = _residuals(at, side, points)
        if not np.isfinite(residuals).all():
            return None
        jacobian = np.stack([residuals[1] - residuals[2], residuals[3] - residuals[4]], axis=1) / (2.0 * scale)
        step = np.linalg.solve(jacobian, -residuals[0])
        unknowns, before, size = unknowns + step, size, float(np.abs(step).max())
        if before < _SETTLED and size >= 0.5 * before:
            return float(unknowns[0]), float(unknowns[1])
    return None


def _residuals(at: Moving, side: int, points: Array) -> Array:
    phi, reaches, settings = [], [], []
    for share, value in points:
        setting = at(float(value))
        span = next(((high, reach) for s, high, reach in _spans(*setting) if s == side), None)
        if span is None or not 0.0 < share < 1.0:
            return np.full((len(points), 2), np.nan)
        settings.append(setting)
        reaches.append(share * span[1])
        phi.append(span[0] - share * span[1])
    lanes = lanes_of([device for device, _ in settings], [R for _, R in settings])
    there, slope = returns(lanes, np.array(phi))
    return np.stack([(there - np.array(phi)) / np.array(reaches), slope - 1.0], axis=1)
