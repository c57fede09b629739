"""Axes of tables: maps from a quantity to the coordinate in [-1, 1] in which it is interpolated, and back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearAxis:
    """Evenly spaced from `low` to `high`.

    Attributes
    ----------
    low, high : float
        Ends, at the coordinates -1 and 1; low < high.
    """

    low: float
    high: float

    def coordinate(self, value: Array) -> Array:
        """Coordinate of a value, held at the ends.

        Parameters
        ----------
        value : ndarray, shape (points,)

        Returns
        -------
        ndarray, shape (points,)
            -1 to 1.
        """
        return np.clip((2.0 * value - self.low - self.high) / (self.high - self.low), -1.0, 1.0)

    def value(self, coordinate: Array) -> Array:
        """Value at a coordinate.

        Parameters
        ----------
        coordinate : ndarray, shape (points,)
            -1 to 1.

        Returns
        -------
        ndarray, shape (points,)
        """
        return 0.5 * (self.low + self.high + coordinate * (self.high - self.low))


@dataclass(frozen=True)
class LogAxis:
    """Evenly spaced in the logarithm from `low` to `high`.

    Attributes
    ----------
    low, high : float
        Ends, at the coordinates -1 and 1; 0 < low < high.
    """

    low: float
    high: float

    def coordinate(self, value: Array) -> Array:
        """Coordinate of a value, held at the ends.

        Parameters
        ----------
        value : ndarray, shape (points,)

        Returns
        -------
        ndarray, shape (points,)
            -1 to 1.
        """
        return LinearAxis(np.log(self.low), np.log(self.high)).coordinate(np.log(value))

    def value(self, coordinate: Array) -> Array:
        """Value at a coordinate.

        Parameters
        ----------
        coordinate : ndarray, shape (points,)
            -1 to 1.

        Returns
        -------
        ndarray, shape (points,)
        """
        return np.exp(LinearAxis(np.log(self.low), np.log(self.high)).value(coordinate))


@dataclass(frozen=True)
class ShiftedLogAxis:
    """Evenly spaced in log(1 + value / scale) from zero to `high`.

    Attributes
    ----------
    high : float
        End, at the coordinate 1; > 0.
    scale : float or ndarray, shape (points,)
        Value at which the axis turns from linear to logarithmic, > 0.
    """

    high: float
    scale: float | Array

    def coordinate(self, value: Array) -> Array:
        """Coordinate of a value, held at the ends.

        Parameters
        ----------
        value : ndarray, shape (points,)

        Returns
        -------
        ndarray, shape (points,)
            -1 to 1.
        """
        return np.clip(2.0 * np.log1p(value / self.scale) / np.log1p(self.high / self.scale) - 1.0, -1.0, 1.0)

    def value(self, coordinate: Array) -> Array:
        """Value at a coordinate; exactly zero at -1.

        Parameters
        ----------
        coordinate : ndarray, shape (points,)
            -1 to 1.

        Returns
        -------
        ndarray, shape (points,)
        """
        return self.scale * np.expm1(0.5 * (coordinate + 1.0) * np.log1p(self.high / self.scale))
