"""Every branch of shapes of a scene over its speed or its length, with what of it lasts, in SI."""

from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING

import numpy as np

from towatlas.checks import check_one
from towatlas.results_motion import Branch, Diagram, dataset_of
from towatlas.scene.choice import least_model
from towatlas.scene.designs import DESIGN_QUESTIONS, with_length
from towatlas.scene.models import system_of, with_drag
from towatlas.scene.scene import MODELS, Scene, check_model, patient_with
from towatlas.scene.verdicts import rate_unit
from towatlas.solve.diagram import diagram_of
from towatlas.solve.seen import Jump, Stretch, expected_at, seen
from towatlas.system import System

if TYPE_CHECKING:
    import xarray

UNITS = {"speed": "m/s", "length": "m"}


@dataclass(frozen=True, repr=False)
class SceneDiagram:
    """All branches of shapes of a scene over its speed, or over the length of its cable.

    Attributes
    ----------
    scene : Scene
    model : str
        By which it was computed, of MODELS.
    moved : str
        "speed" [m/s] or "length" [m].
    low, high : float
        Between which of its values, > 0.
    branches : tuple of Branch
        As of `towatlas.results_motion.Diagram`, in SI: positions [m], tension [N], growth [1/s], frequency [Hz].
    complete : bool
        Whether all shapes were made out and counted.
    looked_at : str
        In words.
    unit : str
        In which values are written.
    size : float
        That unit in SI.
    """

    scene: Scene
    model: str
    moved: str
    low: float
    high: float
    branches: tuple[Branch, ...]
    complete: bool
    looked_at: str
    unit: str
    size: float

    def __repr__(self) -> str:
        ends = f"{self.low:.6g} to {self.high:.6g} {'m/s' if self.moved == 'speed' else 'm'}"
        first = f"SceneDiagram of {self.scene.title!r}: {self.moved} {ends}, {self.model} model"
        return "\n".join([first, *(f"  {branch!r}" for branch in self.branches)])

    def rising(self) -> list[Stretch | Jump]:
        """What is seen from the lowest value to the highest, beginning with the shape expected.

        Returns
        -------
        list of Stretch or Jump
            As of `towatlas.solve.seen.seen`.
        """
        return seen(self.branches, True, expected_at(self.branches, self.low))

    def falling(self) -> list[Stretch | Jump]:
        """What is seen back from the highest value to the lowest, beginning with the shape that `rising` ends with.

        Returns
        -------
        list of Stretch or Jump
        """
        last = self.rising()[-1]
        start = last.branch if isinstance(last, Stretch) else expected_at(self.branches, self.high)
        return seen(self.branches, False, start)

    def to_dataset(self) -> "xarray.Dataset":
        """The diagram as a dataset, in SI.

        Returns
        -------
        xarray.Dataset
            As of `towatlas.results_motion.Diagram.to_dataset`, over speed or length.
        """
        units = {"value": UNITS[self.moved], "position": "m", "tension": "N", "rate": "1/s"}
        found = dataset_of(self.branches, self.moved, units)
        found["frequency"].attrs["units"] = "Hz"
        return found.assign_attrs(
            scene=self.scene.title, scene_file=self.scene.source, model=self.model, looked_at=self.looked_at
        )


def scene_diagram(
    scene: Scene,
    *,
    speed: tuple[float, float] | None = None,
    length: tuple[float, float] | None = None,
    model: str | None = None,
    unit: str = "",
    size: float = 1.0,
) -> SceneDiagram:
    """Every branch of shapes of a scene over its speed or its length, with what of it lasts.

    Parameters
    ----------
    scene : Scene
        From `towatlas.read_scene`.
    speed, length : (float, float)
        Of the tow point [m/s], or of the cable [m], > 0, from which to which; exactly one of them.
    model : str, optional
        "vacuum", "air" or "water"; by default the least that holds at both ends and in the middle, in a fluid one with
        drag: without it nothing damps.
    unit : str
        In which values are to be written; that of SI by default.
    size : float
        That unit in SI, > 0.

    Returns
    -------
    SceneDiagram

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If shapes cannot be computed, or the work takes longer than `towatlas.patience` allows (TooMuchWork).

    Examples
    --------
    >>> from towatlas import read_scene
    >>> found = scene_diagram(read_scene("skop-fig3"), speed=(1.3, 1.4), model="air")
    >>> [(part.kind, round(part.low, 3)) for part in found.rising()]
    [('stable', 1.3), ('flutter', 1.367)]
    """
    given = {name: ends for name, ends in (("speed", speed), ("length", length)) if ends is not None}
    if len(given) != 1:
        raise ValueError("a diagram is over a range of speed or over one of length")
    ((moved, ends),) = given.items()
    low, high = (check_one(moved, end) for end in ends)
    if not 0.0 < low < high:
        raise ValueError(f"{moved} must be two positive numbers, the lower first, got {low:g} and {high:g}")
    if moved == "speed" and not np.isfinite(scene.length):
        raise ValueError(f"{scene.source}: cable.length is missing")
    scenes = [_at(scene, moved, value) for value in (low, 0.5 * (low + high), high)]
    with patient_with(scenes[-1]):
        if model is None:
            chosen = [least_model(one, None, DESIGN_QUESTIONS).model for one in scenes]
            model = with_drag(scene, max(chosen, key=MODELS.index))
        found = _solved(scenes[0], check_model(model), moved, low, high)
    return SceneDiagram(
        scene=scene,
        model=model,
        moved=moved,
        low=low,
        high=high,
        branches=tuple(_in_si(branch, scene, model, moved) for branch in found.branches),
        complete=found.complete,
        looked_at=found.looked_at,
        unit=unit or UNITS[moved],
        size=size,
    )


def _at(scene: Scene, moved: str, value: float) -> Scene:
    return scene.at(speed=value) if moved == "speed" else with_length(scene, value)


def _solved(scene: Scene, model: str, moved: str, low: float, high: float) -> Diagram:
    system, gamma = to_starboard(system_of(scene, model), scene.gamma)
    if moved == "speed":
        return diagram_of(system, gamma, gamma * (high / low))
    return diagram_of(system, system.lam, system.lam * (high / low), gamma=gamma)


def to_starboard(system: System, gamma: float) -> tuple[System, float]:
    """A system in a turn to starboard that is the mirror image, where the turn is one to port.

    Parameters
    ----------
    system : System
    gamma : float
        [-].

    Returns
    -------
    System
    float
        > 0.
    """
    return (replace(system, C_s=-system.C_s), -gamma) if gamma < 0.0 else (system, gamma)


def _in_si(branch: Branch, scene: Scene, model: str, moved: str) -> Branch:
    rate, force, far = rate_unit(scene), scene.force_unit(model), scene.radius
    value = float(scene.speed_of(1.0)) if moved == "speed" else far
    factors = {"x_f": far, "r_f": far, "z_f": far, "tension": force}
    points = tuple(
        replace(point, value=point.value * value, **{name: getattr(point, name) * by for name, by in factors.items()})
        for point in branch.points
    )
    return replace(
        branch,
        value=branch.value * value,
        **{name: getattr(branch, name) * by for name, by in factors.items()},
        growth=branch.growth * rate,
        frequency=branch.frequency * (rate / (2.0 * pi)),
        points=points,
    )
