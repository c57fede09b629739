"""towatlas: critical speeds of a cable towed in a circle, computed, stored as a NetCDF atlas, looked up.

Importing this package, opening an atlas and looking a value up need numpy and netCDF4 only; what computes
(`solve_critical`) imports numba when it is first called.
"""

from towatlas.limits import excess_length, massless_cable, threshold_length
from towatlas.scene.answers import answer_scene, design
from towatlas.scene.file import read_scene
from towatlas.solve.critical import CriticalStates, solve_critical
from towatlas.solve.drag_equilibria import DragEquilibria
from towatlas.solve.drag_folds import DragFolds, solve_drag_folds
from towatlas.solve.drag_shapes import DragShape, drag_shape
from towatlas.solve.equilibria import Equilibria, equilibria
from towatlas.solve.shapes import shape
from towatlas.tables.critical import Atlas, open_atlas
from towatlas.tables.drag_folds import DragLookup, DragTable, open_drag
from towatlas.tables.fish import EquilibriaTable, FishPositions, open_equilibria
from towatlas.tables.seal import AtlasFileError

__version__ = "0.1.0"
__all__ = [
    "Atlas",
    "AtlasFileError",
    "CriticalStates",
    "DragEquilibria",
    "DragFolds",
    "DragLookup",
    "DragShape",
    "DragTable",
    "Equilibria",
    "EquilibriaTable",
    "FishPositions",
    "answer_scene",
    "design",
    "drag_shape",
    "equilibria",
    "excess_length",
    "massless_cable",
    "open_atlas",
    "open_drag",
    "open_equilibria",
    "read_scene",
    "shape",
    "solve_critical",
    "solve_drag_folds",
    "threshold_length",
]
