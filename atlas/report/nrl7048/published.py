"""The numbers printed in NRL Report 7048, recomputed, each with what explains the difference."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from towatlas.kernels import status
from towatlas.limits import threshold_length
from towatlas.solve.critical import solve_critical
from towatlas.solve.equilibria import equilibria

SEGMENTS = 100  # of the report
AIR_15, AIR_0 = 1.225e-3, 1.293e-3  # density of dry air at 15 and at 0 degrees C [g/cm^3]
INCH, FOOT = 2.54, 30.48  # [cm]


@dataclass(frozen=True)
class Published:
    """One number of the report.

    Attributes
    ----------
    quantity, place : str
        What it is, and where it is printed.
    printed : float
        Its value.
    decimals : int
        How many of its decimals are printed, >= 0.
    relation : str
        How the report relates the quantity to it: "=" printed as its value, "~" read off a figure, "<" or ">" a bound.
    recompute : callable
        The value by this program, a float.
    explanation : str
        Of the difference, one sentence or two.
    recompute_as_then : callable, optional
        The value by the method that explains the printed one; None where the printed value needs no explanation.
    method : str
        The name of that method.
    """

    quantity: str
    place: str
    printed: float
    decimals: int
    relation: str
    recompute: Callable[[], float]
    explanation: str
    recompute_as_then: Callable[[], float] | None = None
    method: str = ""


@dataclass(frozen=True)
class Comparison:
    """A published number beside the recomputed one.

    Attributes
    ----------
    published : Published
        What the report prints.
    recomputed : float
        The value by this program.
    as_then : float
        That by the method that explains the printed one; nan where none was called for.
    """

    published: Published
    recomputed: float
    as_then: float

    @property
    def agrees(self) -> bool:
        """Whether every printed digit is right, or the bound holds; never so for what is read off a figure."""
        printed, relation = self.published.printed, self.published.relation
        if relation == "<":
            return self.recomputed < printed
        if relation == ">":
            return self.recomputed > printed
        return relation == "=" and abs(self.recomputed - printed) <= 0.5 * 10.0**-self.published.decimals

    def text(self) -> tuple[str, str, str]:
        """The numbers as they are shown.

        Returns
        -------
        printed, recomputed, then : str
            Printed value, recomputed value, value by the method that explains; with two digits more than printed.
        """
        p = self.published
        digits = 0 if p.decimals == 0 and float(self.recomputed).is_integer() else p.decimals + 2
        sign = "" if p.relation == "=" else p.relation + " "
        then = "" if np.isnan(self.as_then) else f"{self.as_then:.{digits}f}"
        return f"{sign}{p.printed:.{p.decimals}f}", f"{self.recomputed:.{digits}f}", then


def rk4_root(*, lam: float, w_f: float, gamma: float, guess: float, segments: int = SEGMENTS) -> float:
    """Root in R_x0 of E, Eq. (33), near a guess, by the report's method: fourth-order Runge-Kutta.

    Parameters
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-].
    guess : float
    segments : int
        Of the forward shot; the report's 100 by default.

    Returns
    -------
    float
    """
    from towatlas.kernels.calls import forward_shots

    def boundary_error(r_x0: float) -> float:
        cable = (np.array([value]) for value in (lam, w_f, gamma, r_x0))
        error, x_end, r_x_end = np.empty(1), np.empty(1), np.empty(1)
        forward_shots(*cable, segments, error, x_end, r_x_end, 0, 1)
        return float(error[0])

    return _secant(boundary_error, guess)


def euler_root(*, lam: float, w_f: float, gamma: float, guess: float, steps: int = SEGMENTS) -> float:
    """Root in R_x0 of E, Eq. (33), near a guess, by explicit Euler steps: first order, as the report does not do it.

    Parameters
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-].
    guess : float
    steps : int

    Returns
    -------
    float
    """

    def boundary_error(r_x0: float) -> float:
        x, force, ds = 1.0, r_x0, lam / steps
        for k in range(steps):
            slope = force / np.hypot(w_f + lam - k * ds, force)
            x, force = x + ds * slope, force - ds * gamma * gamma * x
        return force - w_f * gamma * gamma * x

    return _secant(boundary_error, guess)


def _secant(function: Callable[[float], float], guess: float) -> float:
    old, new = guess * (1.0 - 1e-7), guess * (1.0 + 1e-7)
    value_old, value_new = function(old), function(new)
    for _ in range(30):
        if value_new == value_old or abs(new - old) <= 1e-15 * abs(new):
            break
        old, new = new, new - value_new * (new - old) / (value_new - value_old)
        value_old, value_new = value_new, function(new)
    return float(new)


def _median(*, lam: float, w_f: float, gamma: float) -> float:
    found = equilibria(lam, w_f, gamma)
    return float(found.R_x0[found.expected])


def _speed(*, lam: float, w_f: float, n: int) -> float:
    return float(solve_critical(lam, w_f, n).gamma)


def _highest_first_speed() -> float:
    w_f = np.arange(0.0, 101.0, 10.0)
    return float(solve_critical(threshold_length(w_f) + 0.1, w_f, 1).gamma.max())


def _most_equilibria_past_threshold() -> float:
    cables = [(float(threshold_length(w_f)) + 0.1, w_f) for w_f in np.arange(0.0, 101.0, 10.0)]
    return float(max(len(equilibria(lam, w_f, 100.0)) for lam, w_f in cables))


def _speed_or_never(*, lam: float, w_f: float, n: int) -> float:
    """Critical speed; infinite where there is no such transition."""
    state = solve_critical(lam, w_f, n)
    return np.inf if state.status == status.NO_TRANSITION else float(state.gamma)


def _drag_constant(density: float) -> float:
    diameter, radius, mass = INCH / 32.0, 11.0 / 16.0 * INCH, 0.1824 / FOOT
    return 0.5 * density * 1.2 * diameter * radius / mass


def _weight(grams: float) -> float:
    return grams / (0.1824 / FOOT * 11.0 / 16.0 * INCH)


def _root(gamma: float, printed: float, explanation: str) -> Published:
    return Published(
        f"median R_x0 at lambda = 37.8, w_f = 1352, gamma = {gamma:g}",
        "above Fig. 16",
        printed,
        6,
        "=",
        lambda: _median(lam=37.8, w_f=1352.0, gamma=gamma),
        explanation,
        lambda: rk4_root(lam=37.8, w_f=1352.0, gamma=gamma, guess=printed),
        "RK4, 100 segments",
    )


def _number(printed: int, figure: str, *, lam: float, w_f: float = 0.0, gamma: float) -> Published:
    return Published(
        f"number of equilibria at lambda = {lam:g}, w_f = {w_f:g}, gamma = {gamma:g}",
        figure,
        printed,
        0,
        "=",
        lambda: float(len(equilibria(lam, w_f, gamma))),
        "The same.",
    )


_CURVE = "The lowest speed whose curve in the figure shows the new pair; the figure's curve before it, at {}, does not."

PUBLISHED: tuple[Published, ...] = (
    _root(1.64, 5.543629, "Every digit is right."),
    _root(2.97, 552.265381, "Truncation error of Runge-Kutta with 100 segments, which gives the printed digits."),
    _root(
        5.94,
        534.242818,
        "Truncation error of Runge-Kutta with 100 segments, which gives the printed digits to one unit of the last.",
    ),
    Published(
        "R_x0 at lambda = 2, w_f = 0, gamma = 1",
        "Fig. 11",
        3.79886,
        5,
        "=",
        lambda: _median(lam=2.0, w_f=0.0, gamma=1.0),
        "No root: E there is -0.018, and Runge-Kutta with 100 segments gives every digit of the recomputed value. "
        "Explicit Euler steps, 100 of them, come within 0.00003 of the printed value: an error of first order in the "
        "step, though not to the last digit.",
        lambda: euler_root(lam=2.0, w_f=0.0, gamma=1.0, guess=3.8),
        "explicit Euler, 100 steps",
    ),
    Published(
        "gamma_c1(2.1, 0)",
        "Fig. 12",
        6.2,
        1,
        "~",
        lambda: _speed(lam=2.1, w_f=0.0, n=1),
        _CURVE.format("5.0"),
    ),
    Published(
        "gamma_c1(10, 0)",
        "Fig. 14",
        0.5,
        1,
        "~",
        lambda: _speed(lam=10.0, w_f=0.0, n=1),
        "The lowest speed of the figure, whose curve the report calls just past tangency.",
    ),
    Published(
        "gamma_c2(10, 0)",
        "Fig. 14",
        1.5,
        1,
        "~",
        lambda: _speed(lam=10.0, w_f=0.0, n=2),
        _CURVE.format("1.0"),
    ),
    Published(
        "gamma_c2(37.8, 1352)",
        "after Fig. 16",
        2.97,
        2,
        ">",
        lambda: _speed(lam=37.8, w_f=1352.0, n=2),
        "The bound holds.",
    ),
    Published(
        "gamma_c2(37.8, 0)", "after Fig. 16", 1.5, 1, "<", lambda: _speed(lam=37.8, w_f=0.0, n=2), "The bound holds."
    ),
    Published(
        "highest gamma_c1(lambda_c + 0.1, w_f), w_f = 0, 10, ... 100",
        "above Fig. 12",
        20.0,
        0,
        "<",
        _highest_first_speed,
        "The bound holds.",
    ),
    Published(
        "most equilibria at lambda = lambda_c + 0.1, gamma = 100, w_f = 0, 10, ... 100",
        "above Fig. 12",
        3,
        0,
        "=",
        _most_equilibria_past_threshold,
        "The same.",
    ),
    Published(
        "gamma_c2(2.1, 0)",
        "after Fig. 16",
        100.0,
        0,
        ">",
        lambda: _speed_or_never(lam=2.1, w_f=0.0, n=2),
        "The bound holds: the report doubts that there is such a speed, and without a fish a cable no longer than 4 "
        "has none.",
    ),
    Published(
        "gamma of the jump from one to two nodes at lambda = 37.8, w_f = 1352",
        "Fig. 6",
        3.9,
        1,
        "~",
        lambda: _speed(lam=37.8, w_f=1352.0, n=2),
        "Photographed in air, recomputed for a vacuum: there the shapes with two nodes begin to exist at a lower "
        "speed.",
    ),
    Published(
        "lambda_c(10)",
        "below Fig. 9",
        1.05,
        2,
        "=",
        lambda: float(threshold_length(10.0)),
        "Every digit is right.",
    ),
    Published("lambda_c(0)", "Fig. 11", 2.0, 0, "=", lambda: float(threshold_length(0.0)), "The same."),
    _number(1, "Fig. 10", lam=2.0, gamma=39.0),
    _number(1, "Fig. 10", lam=1.05, gamma=19.0, w_f=10.0),
    _number(1, "Fig. 10", lam=1.8, gamma=39.0),
    _number(1, "Fig. 12", lam=2.1, gamma=3.8),
    _number(1, "Fig. 12", lam=2.1, gamma=5.0),
    _number(3, "Fig. 12", lam=2.1, gamma=6.2),
    _number(3, "Fig. 14", lam=10.0, gamma=0.5),
    _number(3, "Fig. 14", lam=10.0, gamma=1.0),
    _number(5, "Fig. 14", lam=10.0, gamma=1.5),
    Published(
        "w_f of the fish of 14.132 g", "Fig. 3", 1352.0, 0, "=", lambda: _weight(14.132), "Every digit is right."
    ),
    Published(
        "w_f of the fish of 16.416 g", "Fig. 5", 1571.0, 0, "=", lambda: _weight(16.416), "Every digit is right."
    ),
    Published(
        "drag constant C of the experiment",
        "Fig. 3",
        0.018,
        3,
        "=",
        lambda: _drag_constant(AIR_15),
        "Recomputed for air of 15 degrees C; the report does not state a density. That of 0 degrees C gives its value.",
        lambda: _drag_constant(AIR_0),
        "air of 0 degrees C",
    ),
)


def compare() -> list[Comparison]:
    """Every number of `PUBLISHED` recomputed; takes about a second, and compiles kernels the first time.

    Returns
    -------
    list of Comparison
        In the order of PUBLISHED.

    Examples
    --------
    >>> [round(row.recomputed, 4) for row in compare() if row.published.relation == "~"]
    [5.7197, 0.4929, 1.4013, 3.4176]
    """
    return [
        Comparison(p, p.recompute(), p.recompute_as_then() if p.recompute_as_then else float("nan")) for p in PUBLISHED
    ]
