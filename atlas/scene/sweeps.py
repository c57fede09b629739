"""Curves of a scene over its length or its speed, one for each of several scenes: all shapes, branches and jumps."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_real
from towatlas.effort import check_patience, patience
from towatlas.kernels.system import LAM
from towatlas.scene.choice import least_model
from towatlas.scene.designs import DESIGN_QUESTIONS, with_length
from towatlas.scene.models import system_of, with_drag
from towatlas.scene.scene import MODELS, Scene, check_model, patient_with
from towatlas.scene.verdicts import rate_unit
from towatlas.solve.shots import REMEDY
from towatlas.solve.spectra import growth_columns, indices
from towatlas.solve.sweeps import Swept, sweep_shapes

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
# Names, units and what they are; over (member, value, shape).
FIELDS = {
    "depth": ("m", "depth of the fish below the tow point"),
    "y_over_l": ("1", "depth over the length of the cable"),
    "r_f": ("m", "distance of the fish from the axis"),
    "radius_ratio": ("1", "the same over the tow radius"),
    "phase_deg": ("degree", "angle of the fish behind the tow point, carried along the cable"),
    "tension": ("N", "tension at the tow point"),
    "tension_fish": ("N", "tension at the fish"),
    "t_over_mgl": ("1", "tension at the tow point over the weight of the cable in air"),
    "angle_tow_deg": ("degree", "of the cable below the horizontal at the tow point"),
    "angle_fish_deg": ("degree", "of the cable below the horizontal at the fish"),
    "nodes": ("1", "sign changes of x along the cable"),
    "branch": ("1", "the same number along one branch, until a fold ends it"),
    "expected": ("1", "whether the shape is the one to be expected"),
}
# With stability.
MOTION = {
    "kind": ("1", "whether the shape lasts"),
    "growth": ("1/s", "growth of the leading eigenvalue"),
    "frequency": ("Hz", "frequency of the leading eigenvalue"),
}
# Of shapes that are not there.
NONE = {"r_f": np.nan, "nodes": -1, "error": np.nan}
MOST = 10**5


def sweep(
    scene: Scene | Sequence[Scene],
    *,
    length: ArrayLike | None = None,
    speed: ArrayLike | None = None,
    model: str | None = None,
    stability: bool = False,
) -> "xarray.Dataset":
    """All shapes of a scene at many lengths of its cable, or at many speeds.

    Parameters
    ----------
    scene : Scene, or sequence of them
        From `towatlas.read_scene`; several make a family of curves.
    length, speed : array_like
        Lengths [m], or speeds of the tow point [m/s], > 0; exactly one of them, two or more values.
    model : str, optional
        "vacuum", "air" or "water"; by default the least that holds at both ends and in the middle of each curve, with
        stability in a fluid one with drag.
    stability : bool
        Whether each shape has its kind, as of `towatlas.results_motion.Stability`, growth [1/s] and frequency [Hz];
        some milliseconds a shape.

    Returns
    -------
    xarray.Dataset
        Over (member, value, shape), shapes from the axis outwards, nan, -1 or False beyond the last: depth, y_over_l,
        r_f, radius_ratio, phase_deg, tension, tension_fish, t_over_mgl, angle_tow_deg, angle_fish_deg, nodes, branch
        and expected. Over (member, value): shapes, how many there are. Over (member, jump): jump, the lengths or speeds
        at which two shapes meet, and change, 2 or -2. Over member: length or speed, whichever does not move, model, and
        complete.

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If a computation overflows, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    A branch has one number as long as no fold ends it: both branches of a hysteresis are there, with the one between.

    References
    ----------
    The equations: NRL Report 7048, Eqs. (12)-(23).

    Examples
    --------
    >>> from towatlas import read_scene
    >>> curve = sweep(read_scene("skop-fig3"), speed=[0.5, 1.0, 1.5], model="vacuum")
    >>> curve.shapes.values.tolist(), curve.jump.values.round(3).tolist()
    ([[3, 3, 5]], [[1.414]])
    """
    members = [scene] if isinstance(scene, Scene) else list(scene)
    given = {
        name: check_real(name, value, unit)
        for name, value, unit in (("length", length, "m"), ("speed", speed, "m/s"))
        if value is not None
    }
    if len(given) != 1 or not members:
        raise ValueError("exactly one of length and speed is swept, and one scene or more")
    ((name, values),) = given.items()
    values = np.unique(values)
    if not 2 <= len(values) <= MOST or not np.isfinite(values).all() or values[0] <= 0.0:
        raise ValueError(f"{name} must be 2 to {MOST:,} different positive numbers")
    if model is not None:
        check_model(model)
    with patience():
        swept = []
        for k, member in enumerate(members):
            check_patience("curves", REMEDY, done=k, of=len(members))
            swept.append(_curve(member, name, values, model, stability))
        motion = [_motion(member, swept[k][1], name) for k, member in enumerate(members)] if stability else None
    return _dataset(members, name, values, swept, motion)


def _curve(scene: Scene, name: str, values: Array, model: str | None, stability: bool) -> tuple[str, Swept]:
    if name == "speed" and not np.isfinite(scene.length):
        raise ValueError(f"{scene.source}: cable.length is missing")
    scenes = [_at(scene, name, float(value)) for value in (values[0], values[len(values) // 2], values[-1])]
    with patient_with(scenes[-1]):
        if model is None:
            chosen = [least_model(one, None, DESIGN_QUESTIONS).model for one in scenes]
            model = max(chosen, key=MODELS.index)
            model = with_drag(scene, model) if stability else model
        system = system_of(scenes[0], model)
        if name == "length":
            return model, sweep_shapes(system, scene.gamma, "lam", values / scene.radius)
        return model, sweep_shapes(system, scenes[0].gamma, "gamma", values * abs(scenes[0].gamma / scenes[0].speed))


def _at(scene: Scene, name: str, value: float) -> Scene:
    return with_length(scene, value) if name == "length" else scene.at(speed=value)


def _motion(scene: Scene, swept: Swept, name: str) -> dict[str, NDArray[Any]]:
    """Kind, growth and frequency of each shape."""
    place = swept.place
    columns = {key: np.full((len(swept.values), place.max() + 1), none) for key, none in NONE.items()}
    for key, column in columns.items():
        column[swept.row, place] = swept.columns[key]
    systems, gamma = np.tile(swept.system.row(), (len(swept.values), 1)), np.full(len(swept.values), swept.gamma)
    if name == "length":
        systems[:, LAM] = swept.values
    else:
        gamma = np.copysign(swept.values, gamma)
    index = indices(systems, columns["r_f"], columns["nodes"])
    found = growth_columns(systems, gamma, index=index, **columns)
    unit = rate_unit(scene)
    return {
        "kind": found["kind"][swept.row, place],
        "growth": found["growth"][swept.row, place] * unit,
        "frequency": found["frequency"][swept.row, place] * unit / (2.0 * np.pi),
    }


def _dataset(
    members: list[Scene],
    name: str,
    values: Array,
    curves: list[tuple[str, Swept]],
    motion: list[dict[str, NDArray[Any]]] | None,
) -> "xarray.Dataset":
    import xarray

    count = len(values)
    most = max(int(np.bincount(swept.row, minlength=count).max()) for _, swept in curves)
    jumps = max((len(swept.folds) for _, swept in curves), default=0)
    missing: dict[str, Any] = {"nodes": -1, "branch": -1, "expected": False, "kind": np.array("", "U10")}
    fields = FIELDS | MOTION if motion else FIELDS
    data: dict[str, NDArray[Any]] = {
        field: np.full((len(members), count, most), missing.get(field, np.nan)) for field in fields
    }
    shapes, jump = np.zeros((len(members), count), np.int64), np.full((len(members), jumps), np.nan)
    change = np.zeros((len(members), jumps), np.int64)
    for k, (scene, (model, swept)) in enumerate(zip(members, curves, strict=True)):
        place = swept.place
        shapes[k] = np.bincount(swept.row, minlength=count)
        jump[k, : len(swept.folds)] = swept.folds * (values[0] / swept.values[0])
        change[k, : len(swept.folds)] = swept.changes
        columns = _fields(scene, model, name, values, swept) | (motion[k] if motion else {})
        for field, column in columns.items():
            data[field][k, swept.row, place] = column
    other = "speed" if name == "length" else "length"
    fixed = [getattr(scene, other) for scene in members]
    units = {"length": "m", "speed": "m/s"}
    about = {field: {"units": unit, "long_name": text} for field, (unit, text) in fields.items()}
    return xarray.Dataset(
        {field: (("member", "value", "shape"), column, about[field]) for field, column in data.items()}
        | {
            "shapes": (("member", "value"), shapes, {"units": "1", "long_name": "number of shapes"}),
            "jump": (("member", "jump"), jump, {"units": units[name], "long_name": f"{name} at which two shapes meet"}),
            "change": (("member", "jump"), change, {"units": "1", "long_name": "of the number of shapes at a jump"}),
            other: ("member", fixed, {"units": units[other]}),
            "radius": ("member", [scene.radius for scene in members], {"units": "m", "long_name": "tow radius"}),
            "model": ("member", [model for model, _ in curves], {"long_name": "model used"}),
            "complete": ("member", [swept.complete for _, swept in curves], {"long_name": "whether all was made out"}),
        },
        {name: ("value", values, {"units": units[name]})},
        {"title": f"Shapes over {name}", "source": "; ".join(dict.fromkeys(scene.source for scene in members))},
    )


def _fields(scene: Scene, model: str, name: str, values: Array, swept: Swept) -> dict[str, NDArray[Any]]:
    columns, force = swept.columns, scene.force_unit(model)
    length = values[swept.row] if name == "length" else np.full(len(swept.row), scene.length)
    return {
        "depth": columns["z_f"] * scene.radius,
        "y_over_l": columns["z_f"] * scene.radius / length,
        "r_f": columns["r_f"] * scene.radius,
        "radius_ratio": columns["r_f"],
        "phase_deg": columns["phase_deg"],
        "tension": columns["tension"] * force,
        "tension_fish": columns["tension_fish"] * force,
        "t_over_mgl": columns["tension"] * force / (scene.mass_per_length * scene.gravity * length),
        "angle_tow_deg": columns["angle_tow_deg"],
        "angle_fish_deg": columns["angle_fish_deg"],
        "nodes": columns["nodes"],
        "branch": swept.branch,
        "expected": swept.expected,
    }
