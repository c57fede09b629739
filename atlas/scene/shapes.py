"""The shape of one equilibrium of a scene, in SI."""

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from towatlas.checks import check_real, check_root
from towatlas.results import Equilibria
from towatlas.scene.scene import Scene, patient_with
from towatlas.solve.shapes import POINTS, shape_of

if TYPE_CHECKING:
    import xarray


def shape_in_si(
    scene: Scene, model: str, found: Equilibria, root: str | int = "expected", s: ArrayLike | None = None
) -> "xarray.Dataset":
    """Shape, forces and tension of one equilibrium of a scene.

    Parameters
    ----------
    scene : Scene
    model : str
        By which it was solved, one of MODELS.
    found : Equilibria
        By that model.
    root, s : optional
        As of `SceneAnswer.shape`.

    Returns
    -------
    xarray.Dataset
        As of `SceneAnswer.shape`.

    Raises
    ------
    ValueError
        For a root that does not exist, and arc lengths off the cable.
    ArithmeticError
        If the computation overflows.
    """
    from towatlas.cf import scene_shape_attributes, with_units

    k = check_root(root, found.branch, found.expected, len(found) // 2 if found.system.in_vacuum else -1)
    arc = np.linspace(0.0, scene.length, POINTS) if s is None else np.atleast_1d(check_real("s", s, "m"))
    if arc.ndim != 1 or not ((arc >= 0.0) & (arc <= scene.length)).all():
        raise ValueError(f"s must be a list of arc lengths from 0 to {scene.length:.15g} m, the length of the cable")
    with patient_with(scene):
        curve = shape_of(found, k, arc / scene.radius)
    force, known = scene.force_unit(model), curve.attrs
    named = {name: with_units(curve[name].variable, scene.radius, force) for name in curve.variables}
    # As they were given, without the rounding of a division and a product.
    named["s"].values = arc
    facts: dict[str, Any] = {"scene": scene.title, "scene_file": scene.source, "model": model, "turn": scene.turn}
    facts |= {"length_m": scene.length, "radius_m": scene.radius, "speed_m_s": scene.speed, "gamma": found.gamma}
    facts |= asdict(found.system) | {"branch": known["branch"], "nodes": known["nodes"]}
    facts["expected"] = np.int8(k == found.expected)
    facts |= {f"{name}_m": known[name] * scene.radius for name in ("x_f", "y_f", "z_f")}
    facts["tension_N"] = float(found.tension[k]) * force
    facts |= {f"{name}_N": float(getattr(found, name)[k]) * force for name in ("R_x0", "R_y0", "R_z0")}
    facts["error"] = known["error"]
    answer = curve.assign(named)
    answer.attrs = scene_shape_attributes(facts)
    return answer
