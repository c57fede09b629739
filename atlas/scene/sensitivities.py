"""How jumps, depth and tension of a scene move with each of its keys, to first order."""

from dataclasses import astuple, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.results import Equilibria, Folds
from towatlas.scene.file import scene_numbers
from towatlas.scene.jumps import SceneAnswer
from towatlas.scene.scene import Scene, patient_with
from towatlas.solve.jets import jets_of
from towatlas.solve.shots import shoot
from towatlas.solve.tensions import largest_tension
from towatlas.system import System

# Keys that move nothing that hangs.
STILL = ("tolerance", "cable.breaking_strength", "cable.displaced_area")
# Central differences of sixth order of what follows from the keys in closed form: rounding over the step, 1e-13, is
# more than what they leave out. Smaller steps where a scene as far off as this is none.
STEPS = (2e-3, 2e-6)
OFFSETS, WEIGHTS = (1, 2, 3), np.array([0.75, -0.15, 1.0 / 60.0])
JETS = jets_of(1, gamma=True, parameter=True)
BY_X, BY_GAMMA, BY_NUMBER = JETS.at(1, 0, 0), JETS.at(0, 1, 0), JETS.at(0, 0, 1)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Quantity:
    """One quantity of a scene, and how it moves with the keys.

    Attributes
    ----------
    name : str
        As "depth".
    unit : str
        "m", "N" or "m/s".
    value : float
        In that unit.
    slopes : ndarray, shape (keys,)
        Derivatives by the keys, in SI; nan where a key has none.
    """

    name: str
    unit: str
    value: float
    slopes: Array


@dataclass(frozen=True)
class Sensitivities:
    """How jumps, depth and tensions of a scene move with its keys.

    Attributes
    ----------
    keys : tuple of str
        Numeric keys of the scene and of its type of cable, "section.key".
    values : ndarray, shape (keys,)
        In SI.
    deviations : ndarray, shape (keys,)
        Standard deviations in SI, 0 where none is given.
    quantities : tuple of Quantity
        "jump_below", "jump_above" where there are such, "depth", "tension" at the tow point and "largest_tension" of
        the shape expected; the "speed" of the scene last.
    place : float
        Where the tension is largest, along the cable from the tow point [m], >= 0.
    """

    keys: tuple[str, ...]
    values: Array
    deviations: Array
    quantities: tuple[Quantity, ...]
    place: float

    def __getitem__(self, name: str) -> Quantity:
        return next(quantity for quantity in self.quantities if quantity.name == name)

    def elasticities(self, quantity: Quantity) -> Array:
        """Percent of a quantity per percent of each key.

        Parameters
        ----------
        quantity : Quantity

        Returns
        -------
        ndarray, shape (keys,)
            nan where not known.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.values * quantity.slopes / quantity.value

    @property
    def idle(self) -> list[str]:
        """Uncertain keys that have no part in the model used."""
        moved = np.any([one.slopes != 0.0 for one in self.quantities], axis=0)
        return [key for key, spread, part in zip(self.keys, self.deviations, moved, strict=True) if spread and not part]

    def deviation(self, slopes: Array) -> float:
        """Standard deviation to first order of what has these slopes; keys are taken to be independent.

        Parameters
        ----------
        slopes : ndarray, shape (keys,)
            Of a quantity, or of the difference of two.

        Returns
        -------
        float
            nan where the slope by an uncertain key is not known.
        """
        return float(np.linalg.norm(np.where(self.deviations > 0.0, slopes * self.deviations, 0.0)))


class KeySlopes:
    """How the dimensionless groups of a scene and its units move with each of its numeric keys.

    Parameters
    ----------
    scene : Scene
        Read from a file, at any speed and of any length.
    model : str
        By which its groups are made.

    Attributes
    ----------
    keys : tuple of str
        "section.key", those of a type of cable among them.
    values, deviations : ndarray, shape (keys,)
        In SI; a deviation is 0 where a key has none.
    row : ndarray, shape (keys, columns)
        Derivatives of the system, as of `System.row`.
    log_gamma, log_radius, log_speed, log_force : ndarray, shape (keys,)
        Those of the logarithms of the speed gamma, and of the units of length, speed and force.

    Raises
    ------
    ValueError
        For a scene that is not what its keys say.
    """

    def __init__(self, scene: Scene, model: str):
        if self._with(scene, scene.values) != scene:
            raise ValueError("the scene was changed behind its keys; use read_scene with changes, at, or with_length")
        self.scene, self.model, self.system = scene, model, np.array(astuple(scene.system(model)))
        self.keys = tuple(key for key, value in scene.values.items() if isinstance(value, float) and key not in STILL)
        self.values = np.array([scene.values[key] for key in self.keys])
        self.deviations = np.array([scene.deviations.get(key, 0.0) for key in self.keys])
        slopes = np.array([self._slope(key) for key in self.keys]).reshape(len(self.keys), -1)
        self.row, (self.log_gamma, self.log_radius, self.log_speed, self.log_force) = slopes[:, :-4], slopes[:, -4:].T

    @staticmethod
    def _with(scene: Scene, values: dict[str, Any]) -> Scene:
        numbers: dict[str, Any] = {**scene_numbers(values)}
        return replace(scene, **numbers)

    def _numbers(self, key: str, value: float) -> Array:
        scene = self._with(self.scene, self.scene.values | {key: value})
        row = np.array(astuple(scene.system(self.model)))
        # The sine of a side force without a maximum is infinite, and stays so.
        if (np.isinf(row) != np.isinf(self.system)).any():
            raise ValueError("a side force begins")
        units = abs(scene.gamma), scene.radius, scene.speed_of(1.0), scene.force_unit(self.model)
        return np.concatenate([np.where(np.isinf(row), 0.0, row), np.log(units)])

    def _slope(self, key: str) -> Array:
        value = self.scene.values[key]
        for step in STEPS:
            # Of what is zero, one side: the groups are linear in all keys that may be.
            try:
                if value == 0.0:
                    return (self._numbers(key, step) - self._numbers(key, 0.0)) / step
                width = step * abs(value)
                ahead, behind = (
                    np.array([self._numbers(key, value + way * k * width) for k in OFFSETS]) for way in (1.0, -1.0)
                )
                return WEIGHTS @ (ahead - behind) / width
            except ValueError:
                continue
        return np.full(len(self._numbers(key, value)), np.nan)

    def _shots(self, system: System, gamma: float, r_f: float, share: float = 1.0) -> tuple[Array, Array, Array]:
        """Jets of log rho, depth and tension, shape (columns, monomials), each shot with one number of the system."""
        # A number that no key moves is left alone: to a plane cable drag is no small change where it meets the axis.
        moved = np.nan_to_num(self.row).any(axis=0) & np.isfinite(system.row())
        radius = np.full(len(moved), r_f * gamma**2)
        ends = shoot(radius, gamma, system.row(), JETS, directions=np.diag(moved.astype(float)), shares=share)
        made = (ends.status == status.OK)[:, None]
        jets = (np.where(made, jet, np.nan) for jet in (ends.log_rho, ends.H / gamma**2, ends.T / gamma**2))
        return tuple(jets)  # type: ignore[return-value]

    def _total(self, by_column: Array, by_log_gamma: float = 0.0) -> Array:
        """Derivatives by the keys from those by the groups."""
        by_group = np.where(self.row == 0.0, 0.0, self.row * np.where(self.row == 0.0, 0.0, by_column))
        return by_group.sum(axis=1) + by_log_gamma * self.log_gamma

    def jump(self, name: str, folds: Folds, at: int) -> Quantity:
        """The speed of a jump.

        Parameters
        ----------
        name : str
        folds : Folds
        at : int
            Which of them.

        Returns
        -------
        Quantity
        """
        gamma = float(folds.gamma[at])
        rho, _, _ = self._shots(folds.system, gamma, float(folds.r_f[at]))
        speed = float(self.scene.speed_of(abs(gamma)))
        slopes = speed * (self._total(-rho[:, BY_NUMBER] / rho[:, BY_GAMMA]) + self.log_speed)
        return Quantity(name, "m/s", speed, slopes)

    def shape(self, found: Equilibria) -> tuple[list[Quantity], float]:
        """Depth and tensions of the shape expected.

        Parameters
        ----------
        found : Equilibria

        Returns
        -------
        list of Quantity
        place : float
            Where the tension is largest, along the cable from the tow point [m].
        """
        k, gamma, system = found.expected, found.gamma, found.system
        r_f = float(found.r_f[k])
        rho, depth, tension = self._shots(system, gamma, r_f)
        largest, s = largest_tension(found, k)
        # At a maximum its place may move and changes nothing.
        _, _, nearer = self._shots(system, gamma, r_f, 1.0 - s / system.lam)
        x_moves = -rho / rho[:, BY_X, None]
        force = self.scene.force_unit(self.model)
        quantities = []
        for name, jet, value, unit, unit_name, log_unit in (
            ("depth", depth, float(found.z_f[k]), self.scene.radius, "m", self.log_radius),
            ("tension", tension, float(found.tension[k]), force, "N", self.log_force),
            ("largest_tension", nearer, largest, force, "N", self.log_force),
        ):
            moves = jet + jet[:, BY_X, None] * x_moves
            by_gamma = moves[np.isfinite(moves[:, BY_GAMMA]), BY_GAMMA]
            # All shots have the same, with lengths over g / Omega^2.
            by_log_gamma = float(by_gamma[0]) - 2.0 * value if len(by_gamma) else np.nan
            slopes = self._total(moves[:, BY_NUMBER], by_log_gamma) + value * log_unit
            quantities.append(Quantity(name, unit_name, unit * value, unit * slopes))
        return quantities, s * self.scene.radius


def sensitivities_of(answer: SceneAnswer) -> Sensitivities:
    """How jumps, depth and tensions of a scene move with each of its numeric keys.

    Parameters
    ----------
    answer : SceneAnswer
        From `towatlas.answer_scene`.

    Returns
    -------
    Sensitivities

    Raises
    ------
    ValueError
        For a scene that is not what its keys say.
    ArithmeticError
        If the computation overflows, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    Derivatives by the dimensionless groups come with the shots, exact but for rounding: with x = log r_f an equilibrium
    has log rho = 0, and as a number of the system moves, x moves by -d(log rho) over the slope of log rho in x; at a
    fold that slope is zero, and log gamma moves by -d(log rho) over the slope in log gamma. Derivatives of the groups
    by the keys, which are algebra, are differences of sixth order.

    Examples
    --------
    >>> from towatlas import answer_scene, read_scene
    >>> found = sensitivities_of(answer_scene(read_scene("skop-fig3"), model="air"))
    >>> by_length = found.keys.index("cable.length")
    >>> [(one.name, round(float(found.elasticities(one)[by_length]), 3)) for one in found.quantities[:3]]
    [('jump_below', -0.546), ('jump_above', -1.075), ('depth', 0.568)]
    """
    scene, model, found = answer.scene, answer.choice.model, answer.equilibria
    with patient_with(scene):
        by_key = KeySlopes(scene, model)
        quantities = []
        if (folds := answer.folds) is not None:
            for name, at in zip(("jump_below", "jump_above"), folds.beside(scene.gamma), strict=True):
                quantities += [by_key.jump(name, folds, at)] if at >= 0 else []
        hanging, place = by_key.shape(found)
        quantities += hanging
        quantities.append(Quantity("speed", "m/s", scene.speed, scene.speed * (by_key.log_gamma + by_key.log_speed)))
    return Sensitivities(by_key.keys, by_key.values, by_key.deviations, tuple(quantities), place)
