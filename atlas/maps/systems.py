"""The systems of a map: its axes, what they share, and what is asked of each."""

import hashlib
import json
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from towatlas.system import System

Array = NDArray[np.float64]

# Names in full of what a system and its speed are made of; the last three take the place of m_f, C_f and C_t.
NAMES = {
    "lam": "cable length over tow radius",
    "w_f": "fish weight over (mu + rho A) g R",
    "gamma": "speed, Omega sqrt(R/g)",
    "C": "drag constant of the cable",
    "m_f": "fish mass over (mu + rho A) R",
    "C_f": "drag constant of the fish",
    "w": "weight of the cable, (mu - rho A) / (mu + rho A)",
    "C_t": "tangential drag constant of the cable",
    "C_s": "side force constant of the cable",
    "b_s": "sine at which the side force is largest",
    "m_f_over_w_f": "mass over weight of the fish",
    "C_f_over_C": "drag constant of the fish over that of the cable",
    "C_t_over_C": "tangential over normal drag constant of the cable",
}
RATIOS = {"m_f_over_w_f": ("m_f", "w_f"), "C_f_over_C": ("C_f", "C"), "C_t_over_C": ("C_t", "C")}
# A cable's folds take as long as so many systems.
FOLDS_AS_SYSTEMS = 50


@dataclass(frozen=True)
class Axis:
    """Values of one number.

    Attributes
    ----------
    name : str
        Of NAMES.
    values : ndarray, shape (points,)
        Rising [-].
    spacing : str
        "linear", "log" or "listed".
    """

    name: str
    values: Array
    spacing: str


@dataclass(frozen=True)
class Spec:
    """What a map is of.

    Attributes
    ----------
    title : str
    fields : tuple of str
        Of FIELDS.
    branches : str
        "all" or "expected".
    tile : int
        Systems of a tile, at most.
    fixed : dict of float
        Numbers that all systems share, by name [-].
    axes : tuple of Axis
        Neighbours follow each other along the last one.
    stations : int
        Points of a shape, of field shapes.
    span : (float, float) or None
        Speeds between which folds are looked for.
    checks : int
        Points between the nodes at which folds are solved for, to see how well they are interpolated.
    """

    title: str
    fields: tuple[str, ...]
    branches: str
    tile: int
    fixed: dict[str, float]
    axes: tuple[Axis, ...]
    stations: int
    span: tuple[float, float] | None
    checks: int

    @property
    def states(self) -> bool:
        """Whether shapes are asked for, and not folds alone."""
        return not {*self.fields} <= {"folds", "origin"}

    @property
    def shape(self) -> tuple[int, ...]:
        """Points of each axis."""
        return tuple(len(axis.values) for axis in self.axes)

    @property
    def cable_axes(self) -> tuple[Axis, ...]:
        """All axes but the speed."""
        return tuple(axis for axis in self.axes if axis.name != "gamma")

    @property
    def fold_tile(self) -> int:
        """Systems of a tile of folds, at most."""
        return max(1, self.tile // FOLDS_AS_SYSTEMS)

    @property
    def systems(self) -> int:
        """How many systems there are."""
        return prod(self.shape)

    @property
    def growing(self) -> bool:
        """Whether growth rates are asked for."""
        return bool({"growth", "kind"} & set(self.fields))

    def numbers(self, axes: tuple[Axis, ...], at: tuple[NDArray[np.int64], ...]) -> dict[str, Array]:
        """Numbers of systems.

        Parameters
        ----------
        axes : tuple of Axis
        at : tuple of ndarray of int, shape (systems,)
            Indices along each of them.

        Returns
        -------
        dict of ndarray, shape (systems,)
            By the names of `System`, and gamma if it is among them.
        """
        return self.whole({axis.name: axis.values[k] for axis, k in zip(axes, at, strict=True)})

    def whole(self, varied: dict[str, Array]) -> dict[str, Array]:
        """Numbers of systems from those that vary, as `numbers`.

        Parameters
        ----------
        varied : dict of ndarray, shape (systems,)
            By the names of the axes.

        Returns
        -------
        dict of ndarray, shape (systems,)
        """
        size = len(next(iter(varied.values()))) if varied else 1
        found = {name: np.full(size, value) for name, value in self.fixed.items()} | varied
        for ratio, (name, of) in RATIOS.items():
            if ratio in found:
                found[name] = found.pop(ratio) * found[of]
        return found

    def check_points(self) -> dict[str, Array]:
        """Points at random, the same each time, spread evenly over the axes but the speed.

        Returns
        -------
        dict of ndarray, shape (checks,)
            By the names of the axes.
        """
        shares = np.random.default_rng(0).random((len(self.cable_axes), self.checks))
        found = {}
        for axis, share in zip(self.cable_axes, shares, strict=True):
            low, high = axis.values[0], axis.values[-1]
            log = axis.spacing == "log"
            found[axis.name] = low * (high / low) ** share if log else low + (high - low) * share
        return found

    @property
    def sha256(self) -> str:
        """Of all that the numbers of the map follow from."""
        axes = [[axis.name, axis.spacing, axis.values.tolist()] for axis in self.axes]
        rest = [
            self.fields,
            self.branches,
            self.tile,
            sorted(self.fixed.items()),
            self.stations,
            self.span,
            self.checks,
        ]
        return hashlib.sha256(json.dumps([axes, rest]).encode()).hexdigest()


def system_of(numbers: dict[str, Array], i: int) -> tuple[System, float]:
    """One system, and its speed, nan where there is none.

    Parameters
    ----------
    numbers : dict of ndarray, shape (systems,)
        Of `Spec.numbers`.
    i : int

    Returns
    -------
    System
    float
        [-].
    """
    given = {name: float(column[i]) for name, column in numbers.items()}
    gamma = given.pop("gamma", np.nan)
    return System.of(given.pop("lam"), given.pop("w_f"), **given), gamma
