"""A towing scene in real units, and its dimensionless groups."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from math import inf, nan, pi, sqrt
from typing import Any

from towatlas.checks import check_finite, check_one
from towatlas.effort import TooMuchWork, patience
from towatlas.scene.derived import SPEEDS
from towatlas.scene.library import CableType
from towatlas.system import System

KNOT = 1852.0 / 3600.0  # m/s
# The models of the report's Table 1, in rising order of what they take into account.
MODELS = ("vacuum", "air", "water")
# Keys of a file that give the speed.
SPEED_KEYS = tuple(f"tow.{key}" for key in SPEEDS)


@dataclass(frozen=True)
class Scene:
    """A cable towed in a circle, in SI.

    Attributes
    ----------
    title : str
        What it is called.
    source : str
        Where it was read from.
    length : float
        Of the cable [m], > 0; nan if not given.
    mass_per_length : float
        Of the cable, in air [kg/m], > 0.
    displaced_per_length : float
        Mass of the fluid that the cable displaces, rho A [kg/m], >= 0.
    diameter : float
        Of the cable [m], > 0; nan if not given, as a vacuum allows.
    drag_coefficient : float
        Of the cable [-], >= 0; nan if not given, as a vacuum allows.
    tangential_drag_coefficient : float
        Of the cable, on its diameter [-], >= 0.
    side_force_coefficient : float
        Of a stranded cable, a of DTMB Report 713 [-], positive to starboard of the track.
    side_force_sine : float
        Of the angle between cable and stream at which that force is at its largest, b [-], > 0; inf for none.
    fish_mass : float
        In air [kg], >= 0.
    fish_displaced : float
        Mass of the fluid that the fish displaces [kg], >= 0; nan if not given.
    fish_added_mass : float
        Of the fluid that moves with the fish [kg], >= 0.
    fish_drag_area : float
        Drag coefficient by frontal area [m^2], >= 0.
    radius : float
        Of the circle of the tow point [m], > 0.
    speed : float
        Of the tow point [m/s], > 0.
    turn : str
        "starboard" or "port".
    density : float
        Of the fluid [kg/m^3], >= 0; 0 in a vacuum.
    gravity : float
        [m/s^2], > 0.
    tolerance : float
        Within which models agree, relative [-], > 0.
    breaking_strength : float
        Of the cable [N], > 0; nan if not given.
    cable_type : CableType or None
        Where keys of the cable are from.
    notes : tuple of str
        What whoever asks should know: keys that are missing or do nothing, values of unusual size.
    left_out : dict of tuple of str
        What is given and not used, by model.
    given : dict of str
        Length, radius, speed and forces as the user wrote them, by "section.key"; empty by default.
    values : dict
        All keys with a type of cable's in SI, by "section.key".
    deviations : dict of float
        Standard deviations of those that are uncertain, in SI.
    """

    title: str
    source: str
    length: float
    mass_per_length: float
    displaced_per_length: float
    diameter: float
    drag_coefficient: float
    tangential_drag_coefficient: float
    side_force_coefficient: float
    side_force_sine: float
    fish_mass: float
    fish_displaced: float
    fish_added_mass: float
    fish_drag_area: float
    radius: float
    speed: float
    turn: str
    density: float
    gravity: float
    tolerance: float
    breaking_strength: float = nan
    cable_type: CableType | None = None
    notes: tuple[str, ...] = field(default=(), compare=False, repr=False)
    left_out: dict[str, tuple[str, ...]] = field(default_factory=dict, compare=False, repr=False)
    given: dict[str, str] = field(default_factory=dict, compare=False, repr=False)
    values: dict[str, Any] = field(default_factory=dict, compare=False, repr=False)
    deviations: dict[str, float] = field(default_factory=dict, compare=False, repr=False)

    @property
    def gamma(self) -> float:
        """Dimensionless speed Omega sqrt(R/g), Eq. (13b) [-], negative in a turn to port."""
        return self.speed / sqrt(self.radius * self.gravity) * (-1.0 if self.turn == "port" else 1.0)

    @property
    def medium(self) -> str:
        """Where it is towed, after Table 1: "vacuum", "air" (a nondense fluid) or "water" (a dense one).

        Nondense is a fluid whose displaced mass is within the scene's tolerance of the mass of the cable, and of that
        of the fish where its volume is known.
        """
        if self.density == 0.0:
            return "vacuum"
        dense = self.displaced_per_length > self.tolerance * self.mass_per_length
        dense |= self.fish_displaced > self.tolerance * self.fish_mass
        return "water" if dense else "air"

    def force_unit(self, model: str = "vacuum") -> float:
        """What forces are divided by.

        Parameters
        ----------
        model : str
            One of MODELS.

        Returns
        -------
        float
            (mu + rho A) g R [N].
        """
        return self.mass_unit(model) * self.gravity * self.radius

    def mass_unit(self, model: str) -> float:
        """Mass per length that masses are divided by.

        Parameters
        ----------
        model : str
            One of MODELS.

        Returns
        -------
        float
            mu + rho A, or mu alone where buoyancy is neglected [kg/m].
        """
        check_model(model)
        return self.mass_per_length + (self.displaced_per_length if model == "water" else 0.0)

    def system(self, model: str) -> System:
        """The dimensionless groups of one of the models of Table 1; the speed beside them is `gamma`.

        Parameters
        ----------
        model : str
            "vacuum": as if there were no fluid. "air": normal drag and that of the fish. "water": all, with buoyancy,
            apparent mass, tangential drag and side force.

        Returns
        -------
        System
            nan where a key that the group needs is not given; `System.missing` names those.

        Raises
        ------
        ValueError
            For a name that is not one of these.

        References
        ----------
        NRL Report 7048, Eqs. (13), (16), (17), Table 1; the side force: DTMB Report 713.
        """
        unit = self.mass_unit(model)
        heavy = model == "water"
        drag = 0.0 if model == "vacuum" else 0.5 * self.density
        displaced = self.displaced_per_length if heavy else 0.0
        fish_displaced = self.fish_displaced if heavy and self.density else 0.0
        added = self.fish_added_mass if heavy and self.density else 0.0
        cable_drag = drag * self.diameter * self.radius / unit if drag else 0.0
        along, side = (self.tangential_drag_coefficient, self.side_force_coefficient) if heavy else (0.0, 0.0)
        return System(
            lam=self.length / self.radius,
            w_f=(self.fish_mass - fish_displaced) / (unit * self.radius),
            m_f=(self.fish_mass + added) / (unit * self.radius),
            C=cable_drag * self.drag_coefficient if drag else 0.0,
            C_f=drag * self.fish_drag_area / unit,
            w=(self.mass_per_length - displaced) / unit,
            C_t=cable_drag * along,
            C_s=cable_drag * side,
            b_s=self.side_force_sine if side else inf,
        )

    def not_given(self, model: str) -> list[str]:
        """What a model would use and the scene does not give, in sentences.

        Parameters
        ----------
        model : str
            One of MODELS.

        Returns
        -------
        list of str
        """
        key = "cable.tangential_drag_coefficient"
        if model != "water" or not self.density or key in self.values:
            return []
        return [f"{key} is not given: the flow along the cable has no drag; 0 says so without this line"]

    def speed_of(self, gamma: Any) -> Any:
        """Speed of the tow point at a dimensionless one, Eq. (13b).

        Parameters
        ----------
        gamma : float or ndarray
            [-].

        Returns
        -------
        float or ndarray
            [m/s].
        """
        return gamma * sqrt(self.radius * self.gravity)

    def rpm_of(self, gamma: Any) -> Any:
        """Turns a minute at a dimensionless speed.

        Parameters
        ----------
        gamma : float or ndarray
            [-].

        Returns
        -------
        float or ndarray
            [rpm].
        """
        return gamma * (sqrt(self.gravity / self.radius) * 30.0 / pi)

    def at(
        self, *, speed: float | None = None, rotation_rate: float | None = None, gamma: float | None = None
    ) -> "Scene":
        """The same circle and turn at another speed; exactly one of these.

        Parameters
        ----------
        speed : float, optional
            Of the tow point [m/s].
        rotation_rate : float, optional
            [rad/s].
        gamma : float, optional
            Omega sqrt(R/g) [-], positive; in a turn to port negative, too.

        Returns
        -------
        Scene

        Raises
        ------
        ValueError
            For none of them, or several.
        """
        if gamma is not None and self.turn == "port":
            gamma = abs(check_finite("gamma", gamma))
        given = {"speed": speed, "rotation_rate": rotation_rate, "gamma": gamma}
        checked = {name: check_one(name, value) for name, value in given.items() if value is not None}
        if len(checked) != 1:
            raise ValueError(f"give exactly one of speed, rotation_rate and gamma, not {len(checked)}")
        ((name, value),) = checked.items()
        speeds = {"speed": value, "rotation_rate": value * self.radius, "gamma": self.speed_of(value)}
        followed = (
            ()
            if "tow.radius" in self.values
            else (
                f"the circle stays at another speed: tow.radius is {self.radius:.6g} m, as "
                f"{' and '.join(key for key in SPEED_KEYS if key in self.values)} made it",
            )
        )
        return replace(
            self,
            notes=self.notes + followed,
            speed=speeds[name],
            given=_no_speed(self.given),
            # A circle that followed from its speed stays.
            values=_no_speed(self.values) | {"tow.radius": self.radius, f"tow.{name}": value},
            deviations=_no_speed(self.deviations),
        )

    def described(self, length: str | None = None, lam: float | None = None) -> str:
        """What makes the work that a scene is, in the units of the user.

        Parameters
        ----------
        length : str, optional
            What stands for the length, as "--max-length = 200 m"; that of the cable by default.
        lam : float, optional
            That length over tow radius [-].

        Returns
        -------
        str
        """
        given = self.given
        radius = given.get("tow.radius", f"{self.radius:g} m")
        speed = next((f"{key} = {given[key]}" for key in SPEED_KEYS if key in given), f"a speed of {self.speed:g} m/s")
        length = length or f"cable.length = {given.get('cable.length', f'{self.length:g} m')}"
        lam = self.length / self.radius if lam is None else lam
        return f"{length} with tow.radius = {radius} makes lam = {lam:,.6g}, {speed} makes gamma = {self.gamma:.6g}"


def _no_speed(kept: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in kept.items() if key not in SPEED_KEYS}


@contextmanager
def patient_with(scene: Scene, length: str | None = None, lam: float | None = None) -> Iterator[None]:
    """Patience with what is computed for a scene; a refusal names its keys in the units of the user.

    Parameters
    ----------
    scene : Scene
    length, lam : optional
        As of `Scene.described`.

    Raises
    ------
    TooMuchWork
    """
    try:
        with patience():
            yield
    except TooMuchWork as error:
        raise TooMuchWork(f"{scene.described(length, lam)}: {error}") from None


def check_model(model: str) -> str:
    """The name of one of the models of Table 1.

    Parameters
    ----------
    model : str

    Returns
    -------
    str
        The same.

    Raises
    ------
    ValueError
        For another.
    """
    if model not in MODELS:
        raise ValueError(f"model must be one of {', '.join(MODELS)}; got {model!r}")
    return model
