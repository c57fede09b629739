"""The lateral force device: points, bifurcations, turns, cycles and tangling of devices towed by a ship in a circle.

After Ng, Rand and Keith, Dynamics of towed cables during transient motions, DETC2001/VIB-21438. Lengths over that of
the line, times over 1/omega, k is k L/m; `Line`, `tangle` and `read_device` are in SI. docs/device.md says what can be
asked.
"""

from towatlas.scene.device import Tow, read_device
from towatlas.solve.device.bifurcations import bifurcations
from towatlas.solve.device.cycles import Cycle, cycles
from towatlas.solve.device.local import Bifurcation
from towatlas.solve.device.model import Device
from towatlas.solve.device.points import Point, points
from towatlas.solve.device.tangling import Line, Tangle, tangle
from towatlas.solve.device.turning import Turn, turn

__all__ = [
    "Bifurcation",
    "Cycle",
    "Device",
    "Line",
    "Point",
    "Tangle",
    "Tow",
    "Turn",
    "bifurcations",
    "cycles",
    "points",
    "read_device",
    "tangle",
    "turn",
]
