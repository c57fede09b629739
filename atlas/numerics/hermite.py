"""Cubics through values and slopes at both ends of an interval."""

from typing import Any

import numpy as np


def cubic(a: Any, b: Any, slope_a: Any, slope_b: Any, width: Any, t: Any) -> Any:
    """Cubic through values and slopes at both ends of an interval; numbers, or arrays that broadcast.

    Parameters
    ----------
    a, b : float or ndarray
        Values at the ends.
    slope_a, slope_b : float or ndarray
        Slopes there.
    width : float or ndarray
        Of the interval.
    t : float or ndarray
        Share of it, 0 to 1.

    Returns
    -------
    float or ndarray

    Examples
    --------
    >>> cubic(0.0, 1.0, 1.0, 1.0, 1.0, 0.25)
    0.25
    """
    s = 1.0 - t
    return s * s * (1.0 + 2.0 * t) * a + t * t * (1.0 + 2.0 * s) * b + s * t * width * (s * slope_a - t * slope_b)


def cubic_coefficients(a: Any, b: Any, slope_a: Any, slope_b: Any, width: Any) -> np.ndarray:
    """Coefficients of the same cubic in the share t.

    Parameters
    ----------
    a, b, slope_a, slope_b, width : float or ndarray, shape (...)
        As of `cubic`.

    Returns
    -------
    ndarray, shape (4, ...)
        Highest power first, as `numpy.polyval` takes them.
    """
    rise_a, rise_b, rise = width * slope_a, width * slope_b, b - a
    return np.array([rise_a + rise_b - 2.0 * rise, 3.0 * rise - 2.0 * rise_a - rise_b, rise_a, a])
