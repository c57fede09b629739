"""A long Chebyshev series as many short polynomials, one a cell: what makes lookup fast."""

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from towatlas.numerics.chebyshev import nodes, polynomials, transform

# Cells along each axis, and the degree in a cell, of both coordinates together: measured to agree with the whole series
# within 1.5e-13 (test_cells_are_the_series_of_the_atlas).
CELLS, DEGREE = 112, 8
# Nodes of a cell along each axis: enough that what the degree leaves out does not come back in what it keeps.
CELL_NODES = 12
# Points summed together, and points whose terms are gathered together: both stay in the cache. No powers of two: their
# rows would fall on the same lines of it.
BLOCK, GATHERED = 6000, 250

# Powers of the two coordinates of a cell, term by term, in the order of Horner's rule.
_POWERS_Y = np.array([DEGREE - size for size in range(DEGREE + 1) for _ in range(size + 1)])
_POWERS_X = np.array([power for size in range(DEGREE + 1) for power in range(size, -1, -1)])
_POWERS_Y_AFTER_X = DEGREE + 1 + _POWERS_Y

_EDGES = nodes(CELLS + 1)
_MIDDLES, _HALVES = 0.5 * (_EDGES[1:] + _EDGES[:-1]), 0.5 * np.diff(_EDGES)
_MIDDLE_LIST, _HALF_LIST = _MIDDLES.tolist(), _HALVES.tolist()

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


class Cells:
    """The polynomials of a few series, made a row of cells at a time when first asked for.

    Safe to share between threads: two at once make the same.

    Parameters
    ----------
    *series : ndarray, shape (y degree, x degree)
        Of Chebyshev polynomials on [-1, 1].
    """

    def __init__(self, *series: Array):
        self._series = series
        self._terms: Array = np.empty((len(series), CELLS, CELLS, len(_POWERS_X)))
        self._made = [[False] * CELLS for _ in series]
        self._all_made = [False] * CELLS

    def __getstate__(self) -> tuple[Array, ...]:
        return self._series

    def __setstate__(self, series: tuple[Array, ...]) -> None:
        self.__init__(*series)  # type: ignore[misc]

    def _make(self, which: int, row: int) -> None:
        # Small products, one a cell: a larger one wakes the threads of BLAS, whose waiting costs more than the work.
        series = self._series[which]
        along_y, along_x = _restrictions(series.shape[0])[row], _restrictions(series.shape[1])
        short = (along_y @ series) @ along_x.swapaxes(1, 2)
        self._terms[which, row] = (short.reshape(CELLS, 1, -1) @ _to_powers())[:, 0]
        self._made[which][row] = True

    def sums(self, which: int, places: "Places", work: "Work") -> Array:
        """Values of one series at points.

        Parameters
        ----------
        which : int
            From 0, in the order given.
        places : Places
            At most BLOCK of them.
        work : Work

        Returns
        -------
        ndarray, shape (points,)
        """
        if not all(self._made[which]):
            for row in np.flatnonzero(np.bincount(places.row)).tolist():
                if not self._made[which][row]:
                    self._make(which, row)
        table, count = self._terms[which].reshape(CELLS**2, -1), len(places.cell)
        terms, products = work.terms[:, :count], work.products[:, :count]
        for begin in range(0, count, GATHERED):
            end = min(begin + GATHERED, count)
            gathered = work.gathered[: end - begin]
            table.take(places.cell[begin:end], axis=0, out=gathered, mode="clip")
            terms[:, begin:end] = gathered.T
        done, begin = terms[:1], 1
        for size in range(1, DEGREE + 1):
            block = terms[begin : begin + size + 1]
            block[1:] += np.multiply(done, places.y, out=products[:size])
            done, begin = block, begin + size + 1
        total = done[0].copy()
        for following in done[1:]:
            total *= places.x
            total += following
        return total

    def values(self, place: "Place") -> list[float]:
        """Values of all series at one point.

        Parameters
        ----------
        place : Place

        Returns
        -------
        list of float
        """
        row = place.row
        if not self._all_made[row]:
            for which, made in enumerate(self._made):
                if not made[row]:
                    self._make(which, row)
            self._all_made[row] = True
        return self._terms[:, row, place.column].dot(place.powers).tolist()


class Places:
    """Where points lie: their cells, and their coordinates in these.

    Parameters
    ----------
    x, y : ndarray, shape (points,)
        -1 to 1.

    Attributes
    ----------
    row, cell : ndarray of int, shape (points,)
        The row of cells, along y, and the cell.
    x, y : ndarray, shape (points,)
        Coordinates in the cell, -1 to 1.
    """

    def __init__(self, x: Array, y: Array):
        column, self.row = _cell_of(x), _cell_of(y)
        self.cell = self.row * CELLS + column
        self.x: Array = (x - _MIDDLES[column]) / _HALVES[column]
        self.y: Array = (y - _MIDDLES[self.row]) / _HALVES[self.row]


class Work:
    """Arrays that are used again and again: new ones would come from the system, page by page, each time.

    Parameters
    ----------
    points : int
        How many points there are at most.
    """

    def __init__(self, points: int):
        count = len(_POWERS_X)
        self.gathered: Array = np.empty((min(points, GATHERED), count))
        self.terms: Array = np.empty((count, min(points, BLOCK)))
        self.products: Array = np.empty((DEGREE, min(points, BLOCK)))


class Place:
    """Where one point lies, with all products of powers of its coordinates; in plain floats, which is faster for one.

    Parameters
    ----------
    x, y : float
        -1 to 1.
    """

    __slots__ = ("column", "powers", "row")

    def __init__(self, x: float, y: float):
        # As _cell_of, but on an edge, where either will do.
        self.column = column = min(int((0.5 + math.asin(x) / math.pi) * CELLS), CELLS - 1)
        self.row = row = min(int((0.5 + math.asin(y) / math.pi) * CELLS), CELLS - 1)
        x = (x - _MIDDLE_LIST[column]) / _HALF_LIST[column]
        y = (y - _MIDDLE_LIST[row]) / _HALF_LIST[row]
        x2, y2 = x * x, y * y
        x3, y3, x4, y4 = x2 * x, y2 * y, x2 * x2, y2 * y2
        powers = np.array(
            (
                1.0,
                x,
                x2,
                x3,
                x4,
                x4 * x,
                x4 * x2,
                x4 * x3,
                x4 * x4,
                1.0,
                y,
                y2,
                y3,
                y4,
                y4 * y,
                y4 * y2,
                y4 * y3,
                y4 * y4,
            )
        )
        self.powers: Array = powers[_POWERS_X]
        self.powers *= powers[_POWERS_Y_AFTER_X]


def _cell_of(x: Array) -> Integers:
    """Which of the CELLS a coordinate lies in; on an edge either will do."""
    return np.minimum(((0.5 + np.arcsin(x) / np.pi) * CELLS).astype(np.int64), CELLS - 1)


@cache
def _restrictions(degree: int) -> Array:
    """By cell, the matrix from a series of that many terms to its short series in the cell, without its last terms."""
    at = _MIDDLES[:, None] + _HALVES[:, None] * nodes(CELL_NODES)
    values = polynomials(at.ravel(), degree).T.reshape(CELLS, CELL_NODES, degree)
    return transform(CELL_NODES)[: DEGREE + 1] @ values


@cache
def _to_powers() -> Array:
    """Matrix from products of Chebyshev polynomials, y first, to the terms: those of too high a degree are left out."""
    of_one = np.eye(DEGREE + 1)
    for k in range(2, DEGREE + 1):
        of_one[k] = 2.0 * np.roll(of_one[k - 1], 1) - of_one[k - 2]
    y, x = np.divmod(np.arange((DEGREE + 1) ** 2), DEGREE + 1)
    return of_one[y][:, _POWERS_Y] * of_one[x][:, _POWERS_X] * (y + x <= DEGREE)[:, None]
