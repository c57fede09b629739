"""towatlas: critical speeds of a cable towed in a circle, computed, stored as a NetCDF atlas, looked up.

Importing this package, opening an atlas and looking a value up need numpy and netCDF4 only; what computes
(`solve_critical`) imports numba when it is first called.
"""

from atlas.answers import answer_scene, design
from atlas.critical import CriticalStates, solve_critical
from atlas.drag import DragEquilibria
from atlas.drag_folds import DragFolds, solve_drag_folds
from atlas.drag_shapes import DragShape, drag_shape
from atlas.drag_table import DragLookup, DragTable, open_drag
from atlas.equilibria import Equilibria, equilibria
from atlas.limits import excess_length, massless_cable, threshold_length
from atlas.lookup import Atlas, open_atlas
from atlas.scene_file import read_scene
from atlas.seal import AtlasFileError
from atlas.shape import shape
from atlas.table import EquilibriaTable, FishPositions, open_equilibria

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
