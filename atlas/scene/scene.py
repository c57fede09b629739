"""A towing scene in real units, and its dimensionless groups."""

from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import Any

KNOT = 1852.0 / 3600.0  # m/s
# The models of the report's Table 1, in rising order of what they take into account.
MODELS = ("vacuum", "air", "water")


@dataclass(frozen=True)
class Groups:
    """The dimensionless groups of a scene; nan where the scene does not say enough.

    w : weight of the cable, Eq. (13a). gamma : speed, (13b). C : drag constant of the cable, (13c). lam : length, (17).
    w_f, m_f, C_f : weight, mass and drag constant of the fish, (16a) to (16c).

    References
    ----------
    NRL Report 7048, Table 1.
    """

    w: float
    gamma: float
    C: float
    lam: float
    w_f: float
    m_f: float
    C_f: float


@dataclass(frozen=True)
class Scene:
    """A cable towed in a circle, in SI.

    title : text. source : where it was read from. length : of the cable [m], nan if not given. mass_per_length : in
    air [kg/m]. diameter [m] and drag_coefficient [-] : of the cable, nan if not given, as a vacuum allows. fish_mass
    [kg], fish_displaced : mass of the fluid that the fish displaces [kg], nan if not given, fish_added_mass [kg],
    fish_drag_area : drag coefficient by frontal area [m^2]. radius : of the tow point's circle [m]. speed : of the tow
    point [m/s]. density : of the fluid [kg/m^3]. gravity [m/s^2]. tolerance : relative [-].
    """

    title: str
    source: str
    length: float
    mass_per_length: float
    diameter: float
    drag_coefficient: float
    fish_mass: float
    fish_displaced: float
    fish_added_mass: float
    fish_drag_area: float
    radius: float
    speed: float
    density: float
    gravity: float
    tolerance: float

    @property
    def gamma(self) -> float:
        """Dimensionless speed, Eq. (13b)."""
        return self.speed / sqrt(self.radius * self.gravity)

    @property
    def displaced_per_length(self) -> float:
        """Mass of the fluid that the cable displaces, rho A [kg/m]."""
        return self.density * 0.25 * pi * self.diameter**2 if self.density else 0.0

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
        """What forces are divided by, (mu + rho A) g R [N]."""
        return self.mass_unit(model) * self.gravity * self.radius

    def mass_unit(self, model: str) -> float:
        """Mass per length that masses are divided by, mu + rho A, or mu alone where buoyancy is neglected [kg/m]."""
        check_model(model)
        return self.mass_per_length + (self.displaced_per_length if model == "water" else 0.0)

    def groups(self, model: str) -> Groups:
        """The dimensionless groups of one of the models of Table 1.

        Parameters
        ----------
        model : str
            "vacuum": as if there were no fluid. "air": drag, but neither buoyancy nor apparent mass. "water": all.

        Returns
        -------
        Groups
            nan where a key that the group needs is not given.

        Raises
        ------
        ValueError
            For a name that is not one of these.

        References
        ----------
        NRL Report 7048, Eqs. (13), (16), (17), Table 1.
        """
        unit = self.mass_unit(model)
        heavy = model == "water"
        drag = 0.0 if model == "vacuum" else 0.5 * self.density
        displaced = self.displaced_per_length if heavy else 0.0
        fish_displaced = self.fish_displaced if heavy and self.density else 0.0
        added = self.fish_added_mass if heavy and self.density else 0.0
        return Groups(
            w=(self.mass_per_length - displaced) / unit,
            gamma=self.gamma,
            C=drag * self.drag_coefficient * self.diameter * self.radius / unit if drag else 0.0,
            lam=self.length / self.radius,
            w_f=(self.fish_mass - fish_displaced) / (unit * self.radius),
            m_f=(self.fish_mass + added) / (unit * self.radius),
            C_f=drag * self.fish_drag_area / unit,
        )

    def speed_of(self, gamma: Any) -> Any:
        """Speed of the tow point [m/s] at a dimensionless one, Eq. (13b)."""
        return gamma * sqrt(self.radius * self.gravity)

    def rpm_of(self, gamma: Any) -> Any:
        """Turns a minute at a dimensionless speed."""
        return gamma * (sqrt(self.gravity / self.radius) * 30.0 / pi)

    def at(
        self, *, speed: float | None = None, rotation_rate: float | None = None, gamma: float | None = None
    ) -> "Scene":
        """The same scene at another speed: one of m/s, rad/s, or dimensionless."""
        given = [
            value
            for value in (
                speed,
                None if rotation_rate is None else rotation_rate * self.radius,
                None if gamma is None else self.speed_of(gamma),
            )
            if value is not None
        ]
        if len(given) != 1:
            raise ValueError(f"give exactly one of speed, rotation_rate and gamma, not {len(given)}")
        return replace(self, speed=given[0])


def check_model(model: str) -> str:
    """The name of one of the models of Table 1."""
    if model not in MODELS:
        raise ValueError(f"model must be one of {', '.join(MODELS)}; got {model!r}")
    return model
