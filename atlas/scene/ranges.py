"""Cables for a range of speeds: the lengths that do at each, and what one length kept does over all of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import check_patience
from towatlas.scene.designs import Design, design, with_length
from towatlas.scene.models import system_of, with_drag
from towatlas.scene.scene import MODELS, Scene, check_model, patient_with
from towatlas.scene.verdicts import verdict_of
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.shots import REMEDY
from towatlas.solve.sweeps import Swept, sweep_shapes

# Speeds at which lengths are found unless told otherwise, at most, and those at which one that is kept is looked at.
POINTS, MOST, SAMPLES = 5, 50, 33
# A kept cable is looked at this near to each of its jumps, too, on both sides.
BESIDE = 1e-6
# For the one between two that is off by as much both ways, to a share of that: lengths tried at most, no nearer to an
# end than a share of what is left.
TRIES, EVEN, INSIDE = 6, 0.01, 0.1

Array = NDArray[np.float64]


@dataclass(frozen=True)
class KeptCable:
    """One length over a range of speeds, in the shape expected at each.

    Attributes
    ----------
    length : float
        [m], > 0.
    speeds : tuple of float
        Those for which it was found [m/s]; none for one between two such.
    spans : dict of (float, float)
        Least and most over the range of "depth" and "radius" of the fish [m] and "tension" at the tow point [N].
    off : float
        How far what was asked for is from the value wanted, at most [m or N].
    jumps : ndarray, shape (jumps,)
        Speeds inside the range at which two of its shapes meet [m/s].
    other_beyond : ndarray of bool, shape (jumps,)
        Whether another shape is expected beyond each.
    complete : bool
        Whether all jumps were made out.
    kinds : tuple of str
        What becomes of the shape expected at the speeds looked at, as of `towatlas.results_motion.Stability`; empty
        where it was not asked for.
    """

    length: float
    speeds: tuple[float, ...]
    spans: dict[str, tuple[float, float]]
    off: float
    jumps: Array
    other_beyond: NDArray[np.bool_]
    complete: bool
    kinds: tuple[str, ...] = ()


@dataclass(frozen=True)
class RangeDesign:
    """Cables for a range of speeds.

    Attributes
    ----------
    scene : Scene
        Its length and its speed are not used.
    quantity : str
        "depth", "radius" or "tension".
    value : float
        Of it [m or N], > 0.
    speeds : ndarray, shape (speeds,)
        At which lengths were found [m/s], rising.
    model : str
        Of MODELS, for all of it.
    designs : tuple of Design
        All lengths that do, at each speed.
    cables : tuple of KeptCable
        In rising order of length: those of the shapes expected at one of the speeds, and one between two of them that
        is off by less than any of these, if there is one.
    """

    scene: Scene
    quantity: str
    value: float
    speeds: Array
    model: str
    designs: tuple[Design, ...]
    cables: tuple[KeptCable, ...]

    @property
    def complete(self) -> bool:
        """Whether everything that was looked at was made out."""
        return all(found.complete for found in self.designs) and all(cable.complete for cable in self.cables)

    @property
    def notes(self) -> list[str]:
        """What whoever asks should know, of any of the speeds."""
        return list(dict.fromkeys(note for found in self.designs for note in found.notes))


def design_over(
    scene: Scene,
    low: float,
    high: float,
    *,
    points: int = POINTS,
    model: str | None = None,
    stable_only: bool = False,
    **wanted: Any,
) -> RangeDesign:
    """Cable lengths that bring the fish to a depth, a radius or a tension at speeds of a range, and how each keeps it.

    Parameters
    ----------
    scene : Scene
        From `towatlas.read_scene`.
    low, high : float
        Speeds of the tow point [m/s], 0 < low < high.
    points : int
        At how many speeds, evenly spaced, lengths are found, 2 to 50.
    model : str, optional
        "vacuum", "air" or "water"; by default the least that holds at both ends and in the middle.
    stable_only : bool
        Whether only lengths are kept whose shape expected lasts at all 33 speeds.
    **wanted
        What `towatlas.design` takes: one of depth, radius and tension, limits, and max_length.

    Returns
    -------
    RangeDesign

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If the computation overflows, does not converge, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    A length that is kept is looked at in the shape expected, at 33 speeds and on both sides of its jumps.

    Examples
    --------
    >>> from towatlas import read_scene
    >>> found = design_over(read_scene("skop-fig3"), 1.0, 1.2, points=2, depth=0.6, model="vacuum")
    >>> [round(cable.length, 4) for cable in found.cables], [len(cable.jumps) for cable in found.cables]
    ([0.6008, 0.6024, 0.6041], [0, 0, 0])
    """
    if not 0.0 < low < high < np.inf:
        raise ValueError(f"speeds from {low:g} to {high:g} m/s are no range: a positive one, and a higher one")
    if not 2 <= points <= MOST:
        raise ValueError(f"points must be 2 to {MOST}, got {points}")
    if model is not None:
        check_model(model)
    speeds, free = np.linspace(low, high, points), model is None
    scenes = [scene.at(speed=float(speed)) for speed in speeds]
    with patient_with(scenes[-1]):
        found: dict[int, Design] = {}
        if model is None:
            found = {k: design(scenes[k], **wanted) for k in {0, points // 2, points - 1}}
            model = max((one.model for one in found.values()), key=MODELS.index)
        designs = []
        for k, one in enumerate(scenes):
            check_patience("lengths for speeds", REMEDY, done=k, of=points)
            same = k in found and found[k].model == model
            designs.append(found[k] if same else design(one, model=model, **wanted))
        quantity, value = designs[0].quantity, designs[0].value
        keep = _Keeper(scene, model, quantity, value, (low, high))
        cables = keep.all(designs, speeds)
        if stable_only:
            judged = [keep.judged(cable, with_drag(scene, model) if free else model) for cable in cables]
            cables = [cable for cable in judged if set(cable.kinds) == {"stable"}]
    return RangeDesign(scene, quantity, value, speeds, model, tuple(designs), tuple(cables))


class _Keeper:
    """Looks at single lengths over a range of speeds."""

    def __init__(self, scene: Scene, model: str, quantity: str, value: float, speeds: tuple[float, float]):
        self.scene, self.model, self.quantity, self.value, self.ends = scene, model, quantity, value, speeds

    def all(self, designs: list[Design], speeds: Array) -> list[KeptCable]:
        """The lengths of the shapes expected, and one between two of them."""
        found = sorted(
            (cable.length, float(speed))
            for one, speed in zip(designs, speeds, strict=True)
            for cable in one.chosen
            if cable.expected
        )
        cables = []
        for k, (length, speed) in enumerate(found):
            check_patience("lengths over the range of speeds", REMEDY, done=k, of=len(found))
            cables.append(self.kept(length, (speed,)))
        between = [self._between(a, b) for a, b in pairwise(cables)]
        better = [one for one in between if one is not None and one.off < min(cable.off for cable in cables)]
        cables += sorted(better, key=lambda cable: cable.off)[:1]
        return sorted(cables, key=lambda cable: cable.length)

    def _between(self, a: KeptCable, b: KeptCable) -> KeptCable | None:
        """A length that is off by as much both ways, if it lies between two."""
        if self._uneven(a) * self._uneven(b) >= 0.0:
            return None
        tried = []
        for _ in range(TRIES):
            check_patience("lengths over the range of speeds", REMEDY)
            share = self._uneven(a) / (self._uneven(a) - self._uneven(b))
            one = self.kept(a.length + float(np.clip(share, INSIDE, 1.0 - INSIDE)) * (b.length - a.length), ())
            tried.append(one)
            if abs(self._uneven(one)) < EVEN * one.off:
                break
            a, b = (one, b) if self._uneven(one) * self._uneven(a) > 0.0 else (a, one)
        return min(tried, key=lambda cable: cable.off)

    def _uneven(self, cable: KeptCable) -> float:
        """How far the middle of a span is from the value wanted."""
        return 0.5 * sum(cable.spans[self.quantity]) - self.value

    def judged(self, cable: KeptCable, model: str) -> KeptCable:
        """The same with what becomes of the shape expected at the speeds looked at."""
        kinds = []
        for speed in np.linspace(*self.ends, SAMPLES):
            check_patience("growth rates over the range of speeds", REMEDY)
            scene = with_length(self.scene.at(speed=float(speed)), cable.length)
            shapes = solve_equilibria(system_of(scene, model), scene.gamma)
            kinds.append(verdict_of(scene, shapes, shapes.expected).kind)
        return replace(cable, kinds=tuple(kinds))

    def kept(self, length: float, speeds: tuple[float, ...]) -> KeptCable:
        """One length over the range."""
        scene = with_length(self.scene.at(speed=self.ends[0]), length)
        system, unit = system_of(scene, self.model), abs(scene.gamma) / scene.speed
        values = np.linspace(*self.ends, SAMPLES) * unit
        folds = sweep_shapes(system, scene.gamma, "gamma", values[[0, -1]]).folds
        beside = np.concatenate([folds * (1.0 - BESIDE), folds * (1.0 + BESIDE)])
        inside = beside[(beside > values[0]) & (beside < values[-1])]
        swept = sweep_shapes(system, scene.gamma, "gamma", np.union1d(values, inside))
        expected = {name: column[swept.expected] for name, column in swept.columns.items()}
        sizes: Mapping[str, tuple[str, float]] = {
            "depth": ("z_f", scene.radius),
            "radius": ("r_f", scene.radius),
            "tension": ("tension", scene.force_unit(self.model)),
        }
        spans = {
            name: (float(expected[column].min()) * size, float(expected[column].max()) * size)
            for name, (column, size) in sizes.items()
        }
        return KeptCable(
            length=length,
            speeds=speeds,
            spans=spans,
            off=max(abs(end - self.value) for end in spans[self.quantity]),
            jumps=swept.folds / unit,
            other_beyond=_other_beyond(swept),
            complete=swept.complete,
        )


def _other_beyond(swept: Swept) -> NDArray[np.bool_]:
    """Whether the shape expected just above each fold is on another branch than that just below."""
    branch = swept.branch[swept.expected]
    at = np.searchsorted(swept.values, swept.folds)
    return np.asarray(branch[at - 1] != branch[np.minimum(at, len(branch) - 1)])
