"""The laws of each cable, from the rows of Table 2: least squares, with the standard errors that they give."""

from dataclasses import dataclass
from functools import cache
from math import inf, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from towatlas.report.dtmb713.data import points

Array = NDArray[np.float64]
# Starts of the fit of the side force, in q s_max^2: from a curve bent upwards to one whose maximum is at s_max / 8.
STARTS = np.concatenate([np.linspace(-0.9, 0.0, 10), np.geomspace(0.05, 64.0, 30)])
ROUNDS, SETTLED = 60, 1e-12


@dataclass(frozen=True)
class Mean:
    """A mean.

    Attributes
    ----------
    value : float
    error : float
        Its standard error.
    sd : float
        Standard deviation of one point.
    """

    value: float
    error: float
    sd: float


@dataclass(frozen=True)
class Linear:
    """Coefficients of a linear least squares fit, one for each function fitted.

    Attributes
    ----------
    values, errors : ndarray, shape (functions,)
        And their standard errors.
    sd : float
        Standard deviation of one point about it.
    """

    values: Array
    errors: Array
    sd: float

    @property
    def t(self) -> Array:
        """Coefficients over their standard errors."""
        return self.values / self.errors


@dataclass(frozen=True)
class SideForce:
    """C_s = a s / (1 + (s / b)^2), s = sin(phi); without a maximum C_s = a s.

    Attributes
    ----------
    a, a_error : float
        Slope at small angles [-], and its standard error.
    b, b_error : float
        Sine at which the force is largest [-]; inf and nan where there is no maximum.
    sd : float
        Standard deviation of one point of C_s about the law.
    bend, bend_error : float
        q = 1 / b^2 of the fit that is free to bend upwards, too: below 0 there is no maximum.
    """

    a: float
    a_error: float
    b: float
    b_error: float
    sd: float
    bend: float
    bend_error: float

    def at(self, sine: Array) -> Array:
        """C_s.

        Parameters
        ----------
        sine : ndarray

        Returns
        -------
        ndarray
        """
        return self.a * sine / (1.0 + np.square(sine / self.b))


def mean(values: Array) -> Mean:
    """Mean of points, with errors.

    Parameters
    ----------
    values : ndarray, shape (points,)

    Returns
    -------
    Mean
    """
    sd = float(values.std(ddof=1))
    return Mean(float(values.mean()), sd / sqrt(len(values)), sd)


def linear(y: Array, *functions: Array) -> Linear:
    """Least squares fit of a sum of functions.

    Parameters
    ----------
    y : ndarray, shape (points,)
    *functions : ndarray, shape (points,)
        Values of each.

    Returns
    -------
    Linear

    Examples
    --------
    >>> linear(np.array([1.0, 3.0, 5.0, 7.5]), np.ones(4), np.arange(4.0)).values.round(3).tolist()
    [0.9, 2.15]
    """
    design = np.stack(functions, axis=1)
    values = np.asarray(np.linalg.lstsq(design, y, rcond=None)[0], np.float64)
    residual = y - design @ values
    variance = float(residual @ residual) / (len(y) - len(values))
    errors = np.sqrt(variance * np.diag(np.linalg.inv(design.T @ design)))
    return Linear(values, errors, sqrt(variance))


@cache
def normal_force(letter: str) -> Mean:
    """C_r: the mean of C_n / sin^2(phi), as Table 3 has it.

    Parameters
    ----------
    letter : str
        Of the cable.

    Returns
    -------
    Mean
    """
    return mean(points(letter).ratio)


@cache
def side_force(letter: str) -> SideForce:
    """The law of the side force.

    Parameters
    ----------
    letter : str
        Of the cable.

    Returns
    -------
    SideForce

    Notes
    -----
    Gauss and Newton's method for a and q = 1 / b^2, from the best of STARTS. Where q < 0, a line through the origin.

    Examples
    --------
    >>> fit = side_force("G")
    >>> round(fit.a, 4), round(fit.b, 4)
    (0.1835, 0.1802)
    """
    data = points(letter)
    s, force = data.sin_phi, data.C_s
    a, q = _start(s, force)
    for _ in range(ROUNDS):
        step = linear(force - _law(s, a, q), *_slopes(s, a, q)).values
        a, q = a + float(step[0]), q + float(step[1])
        if abs(step[0]) <= SETTLED * abs(a) and abs(step[1]) <= SETTLED * abs(q):
            break
    errors = linear(force - _law(s, a, q), *_slopes(s, a, q))
    a_error, q_error = (float(error) for error in errors.errors)
    if q > 0.0:
        return SideForce(a, a_error, q**-0.5, 0.5 * q_error * q**-1.5, errors.sd, q, q_error)
    line = linear(force, s)
    return SideForce(float(line.values[0]), float(line.errors[0]), inf, nan, line.sd, q, q_error)


def _law(s: Array, a: float, q: float) -> Array:
    return a * s / (1.0 + q * s * s)


def _slopes(s: Array, a: float, q: float) -> tuple[Array, Array]:
    """Of the law in a and in q."""
    below = 1.0 + q * s * s
    return s / below, -a * s**3 / np.square(below)


def _start(s: Array, force: Array) -> tuple[float, float]:
    """a and q: for each q of STARTS the best a is a quotient."""
    tried = []
    for q in STARTS / s.max() ** 2:
        shape = s / (1.0 + q * s * s)
        a = float(shape @ force / (shape @ shape))
        tried.append((float(np.sum(np.square(force - a * shape))), a, float(q)))
    return min(tried)[1:]


@cache
def sine_term(letter: str) -> Linear:
    """A and B of C_n / sin(phi) = A + B sin(phi): A is the term that the report finds no sign of.

    Parameters
    ----------
    letter : str
        Of the cable.

    Returns
    -------
    Linear
    """
    data = points(letter)
    return linear(data.C_n / data.sin_phi, np.ones(len(data)), data.sin_phi)


@cache
def apparent_sine_term(letter: str) -> Linear:
    """The same as who does not see the yaw has it: from the angle of the cable in the vertical plane.

    Parameters
    ----------
    letter : str
        Of the cable.

    Returns
    -------
    Linear
    """
    data = points(letter)
    angle = np.arctan2(data.m, data.l)
    force = data.weight * np.cos(angle) / data.pressure
    return linear(force / np.sin(angle), np.ones(len(data)), np.sin(angle))


@cache
def bend(letter: str) -> Linear:
    """B and D of C_n / sin(phi) = B sin(phi) + D sin^2(phi): a curve through the origin.

    Parameters
    ----------
    letter : str
        Of the cable.

    Returns
    -------
    Linear
    """
    data = points(letter)
    return linear(data.C_n / data.sin_phi, data.sin_phi, np.square(data.sin_phi))
