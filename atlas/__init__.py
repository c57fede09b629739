"""towatlas: critical speeds of a cable towed in a circle, computed, stored as a NetCDF atlas, looked up.

Names are imported when they are first used: opening an atlas and looking a value up need numpy and netCDF4 only.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from towatlas.effort import TooMuchWork, patience
    from towatlas.limits import excess_length, massless_cable, threshold_length
    from towatlas.maps.lookup import Map, open_map
    from towatlas.results import (
        CriticalStates,
        Cusps,
        DragFolds,
        Equilibria,
        FishPositions,
        FlutterSpeeds,
        Folds,
        GrowthRates,
    )
    from towatlas.results_motion import Boundary, Branch, Diagram, Flutter, Stability, Window
    from towatlas.scene.designs import design
    from towatlas.scene.file import read_scene
    from towatlas.scene.jumps import answer_scene
    from towatlas.scene.sweeps import sweep
    from towatlas.solve.critical import solve_critical
    from towatlas.solve.cusps import cusps
    from towatlas.solve.diagram import diagram
    from towatlas.solve.drag_folds import solve_drag_folds
    from towatlas.solve.equilibria import equilibria
    from towatlas.solve.flutter import flutter
    from towatlas.solve.flutter_boundaries import krein_boundaries
    from towatlas.solve.folds import folds
    from towatlas.solve.many import equilibria_many
    from towatlas.solve.proof.certificates import Certificate, certify
    from towatlas.solve.proof.states import CertifiedEquilibria, certify_equilibria
    from towatlas.solve.shapes import shape, shape_of
    from towatlas.solve.spectra import stability_many
    from towatlas.solve.stability import stability, stability_of
    from towatlas.system import System
    from towatlas.tables.atlas import Atlas, open_atlas
    from towatlas.tables.seal import AtlasFileError

__version__ = "0.2.0"
__all__ = [
    "Atlas",
    "AtlasFileError",
    "Boundary",
    "Branch",
    "Certificate",
    "CertifiedEquilibria",
    "CriticalStates",
    "Cusps",
    "Diagram",
    "DragFolds",
    "Equilibria",
    "FishPositions",
    "Flutter",
    "FlutterSpeeds",
    "Folds",
    "GrowthRates",
    "Map",
    "Stability",
    "System",
    "TooMuchWork",
    "Window",
    "answer_scene",
    "certify",
    "certify_equilibria",
    "cusps",
    "design",
    "diagram",
    "equilibria",
    "equilibria_many",
    "excess_length",
    "flutter",
    "folds",
    "krein_boundaries",
    "massless_cable",
    "open_atlas",
    "open_map",
    "patience",
    "read_scene",
    "shape",
    "shape_of",
    "solve_critical",
    "solve_drag_folds",
    "stability",
    "stability_many",
    "stability_of",
    "sweep",
    "threshold_length",
]

# Where each public name lives.
_HOMES = {
    "effort": ("TooMuchWork", "patience"),
    "limits": ("excess_length", "massless_cable", "threshold_length"),
    "maps.lookup": ("Map", "open_map"),
    "results": (
        "CriticalStates",
        "Cusps",
        "DragFolds",
        "Equilibria",
        "FishPositions",
        "FlutterSpeeds",
        "Folds",
        "GrowthRates",
    ),
    "results_motion": ("Boundary", "Branch", "Diagram", "Flutter", "Stability", "Window"),
    "scene.designs": ("design",),
    "scene.file": ("read_scene",),
    "scene.jumps": ("answer_scene",),
    "scene.sweeps": ("sweep",),
    "solve.critical": ("solve_critical",),
    "solve.cusps": ("cusps",),
    "solve.diagram": ("diagram",),
    "solve.drag_folds": ("solve_drag_folds",),
    "solve.equilibria": ("equilibria",),
    "solve.flutter": ("flutter",),
    "solve.flutter_boundaries": ("krein_boundaries",),
    "solve.folds": ("folds",),
    "solve.many": ("equilibria_many",),
    "solve.proof.certificates": ("Certificate", "certify"),
    "solve.proof.states": ("CertifiedEquilibria", "certify_equilibria"),
    "solve.shapes": ("shape", "shape_of"),
    "solve.spectra": ("stability_many",),
    "solve.stability": ("stability", "stability_of"),
    "system": ("System",),
    "tables.atlas": ("Atlas", "open_atlas"),
    "tables.seal": ("AtlasFileError",),
}
_HOME = {name: module for module, names in _HOMES.items() for name in names}
# Public modules.
_MODULES = ("device",)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return import_module(f"{__name__}.{name}")
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_MODULES})
