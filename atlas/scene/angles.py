"""Angles between cable and stream along a shape, and whether the laws of a cable were measured there."""

from dataclasses import dataclass

import numpy as np

from towatlas.results import Equilibria
from towatlas.scene.scene import Scene
from towatlas.solve.shapes import shape_of

# Angles are printed, and known, to a tenth of a degree.
ROUNDING = 0.05


@dataclass(frozen=True)
class Angles:
    """Angles between the cable and the stream in one shape.

    Attributes
    ----------
    lowest, highest : float
        Along the cable [deg], 0 to 90.
    inside : float
        Share of the cable at angles over which its laws were measured [-].
    extrapolated : bool
        Whether some of it is at others.
    """

    lowest: float
    highest: float
    inside: float
    extrapolated: bool


def angles_along(scene: Scene, found: Equilibria, row: int) -> Angles | None:
    """Angles along one equilibrium of a scene.

    Parameters
    ----------
    scene : Scene
    found : Equilibria
        By one of its models.
    row : int
        Which of them.

    Returns
    -------
    Angles or None
        None where it is not said over which angles the laws were measured, and in a vacuum, which has none.
    """
    if scene.cable_type is None or scene.cable_type.angles_deg is None or found.system.in_vacuum:
        return None
    curve = shape_of(found, row)
    x, y, *force, tension = (curve[name].values for name in ("x", "y", "R_x", "R_y", "R_z", "T"))
    # A bare tip has no direction, and on the axis there is no stream.
    with np.errstate(invalid="ignore", divide="ignore"):
        tangent = np.stack(force) / tension
        stream = np.stack([-y, x, np.zeros_like(x)]) / np.hypot(x, y)
    across = np.linalg.norm(np.cross(stream, tangent, axis=0), axis=0)
    phi = np.degrees(np.arctan2(across, np.abs((stream * tangent).sum(axis=0))))
    phi = phi[np.isfinite(phi)]
    low, high = scene.cable_type.angles_deg
    measured = (phi >= low - ROUNDING) & (phi <= high + ROUNDING)
    return Angles(float(phi.min()), float(phi.max()), float(measured.mean()), not measured.all())


def extrapolation(scene: Scene, angles: Angles | None) -> str:
    """What is said of a shape at angles where the laws of its cable were not measured.

    Parameters
    ----------
    scene : Scene
    angles : Angles or None

    Returns
    -------
    str
        Empty for one that is not extrapolated.
    """
    if angles is None or not angles.extrapolated:
        return ""
    assert scene.cable_type is not None
    assert scene.cable_type.angles_deg is not None
    low, high = scene.cable_type.angles_deg
    return (
        f"extrapolated: {scene.cable_type.name} was measured at {low:.1f} to {high:.1f} degrees between cable and "
        f"stream, the expected shape is at {angles.lowest:.1f} to {angles.highest:.1f}, "
        f"{100.0 * (1.0 - angles.inside):.0f} % of it outside"
    )
