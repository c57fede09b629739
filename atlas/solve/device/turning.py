"""The tightest turn in which a device circles steadily on a taut line."""

from dataclasses import dataclass
from math import hypot, inf, nan

from towatlas.solve.device.local import hopf_velocities
from towatlas.solve.device.model import check_device, expand
from towatlas.solve.device.points import saddle_nodes, velocity


@dataclass(frozen=True)
class Turn:
    """How tightly a ship may turn.

    Attributes
    ----------
    alpha : float
        Angle of the fluid's force [rad].
    R_min : float
        Least turning radius above which the device always circles steadily [-]; nan at right angles.
    kind : str
        What happens there: "hopf", it begins to swing; "saddle-node", its line goes slack; "reversible" at right
        angles, where nothing settles.
    ranges : tuple of (float, float)
        All turning radii at which it circles steadily [-], falling; the first has no upper end, inf.
    """

    alpha: float
    R_min: float
    kind: str
    ranges: tuple[tuple[float, float], ...]


def turn(k: float, alpha: float) -> Turn:
    """Turning radii at which a device circles steadily on a taut line.

    Parameters
    ----------
    k : float
        Force constant of the fluid k L/m [-], 1e-4 to 1e5.
    alpha : float
        Angle of the fluid's force [rad], -pi/2 to pi/2; positive pulls out of the turn.

    Returns
    -------
    Turn

    Raises
    ------
    ValueError
        For numbers out of range.

    Notes
    -----
    Fixed points on a taut line begin at one saddle-node and reach to any radius; on the way they may be unstable
    between two Hopf points. For cos alpha > 1/3 there are none of these, whatever k.

    Examples
    --------
    >>> round(turn(1.0, 0.0).R_min, 12)
    0.574891617424
    >>> tight = turn(1.0, -1.4)
    >>> tight.kind, [round(float(end), 4) for end in tight.ranges[1]]
    ('hopf', [0.4223, 1.5742])
    """
    device = check_device(k, alpha)
    if device.a == 0.0:
        return Turn(device.alpha, nan, "reversible", ())
    marks = [(x, "saddle-node") for x in saddle_nodes(device, 1)]
    marks += sorted((device.k * hypot(u, w), "hopf") for u, w in hopf_velocities(device) if w > 0.0)
    ranges, last = [], ""
    for (x, kind), (above, _) in zip(marks, [*marks[1:], (inf, "")], strict=True):
        between = 2.0 * x if above == inf else 0.5 * (x + above)
        if expand(device, *velocity(device, 1, between)).b01 < 0.0:
            ends = [inf if one == inf else _radius(*velocity(device, 1, one)) for one in (x, above)]
            ranges.append((ends[0], ends[1]))
            last = kind
    return Turn(device.alpha, ranges[-1][0], last, tuple(reversed(ranges)))


def _radius(u: float, w: float) -> float:
    return hypot(u - 1.0, w)
