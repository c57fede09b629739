"""towatlas: critical speeds of a cable towed in a circle, computed, stored as a NetCDF atlas, looked up.

Importing this package, opening an atlas and looking a value up need numpy and netCDF4 only; what computes
(`solve_critical`) imports numba when it is first called.
"""

from atlas.critical import CriticalStates, solve_critical
from atlas.drag import DragEquilibria, DragShape, drag_shape
from atlas.equilibria import Equilibria, equilibria
from atlas.limits import excess_length, massless_cable, threshold_length
from atlas.lookup import Atlas, open_atlas
from atlas.seal import AtlasFileError

__version__ = "0.1.0"
__all__ = [
    "Atlas",
    "AtlasFileError",
    "CriticalStates",
    "DragEquilibria",
    "DragShape",
    "Equilibria",
    "drag_shape",
    "equilibria",
    "excess_length",
    "massless_cable",
    "open_atlas",
    "solve_critical",
    "threshold_length",
]
