"""What lies outside a table: which points, and what is said of them. Nothing is ever extrapolated."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

REMEDY = '; outside="solve" computes such points directly, outside="nan" leaves them out'
# Of what is no number that any table could hold.
NO_REMEDY = '; outside="nan" leaves such points out'
# Quantities that may be zero; others are above it.
MAY_BE_ZERO = ("w_f", "C")


def sound(point: Mapping[str, NDArray[Any]]) -> NDArray[np.bool_]:
    """Which points are numbers that a cable may have.

    Parameters
    ----------
    point : mapping of ndarray, shape (points,)
        The quantities, by name.

    Returns
    -------
    ndarray of bool, shape (points,)
    """
    good = np.ones(len(next(iter(point.values()))), bool)
    for name, column in point.items():
        good &= np.isfinite(column) & ((column >= 0.0) if name in MAY_BE_ZERO else (column > 0.0))
    return good


def complaint(
    point: Mapping[str, NDArray[Any]],
    limits: Mapping[str, tuple[float, float]],
    bad: NDArray[np.bool_],
    otherwise: Callable[[int], str] | None = None,
) -> str:
    """What is wrong with the first of the bad points, and how many there are.

    Parameters
    ----------
    point : mapping of ndarray, shape (points,)
        The quantities asked for, by name.
    limits : mapping of pair of float
        Lowest and highest of those that have their own.
    bad : ndarray of bool, shape (points,)
        At least one.
    otherwise : callable, optional
        What is wrong with a point, by its index, that is within all of them.

    Returns
    -------
    str
    """
    i = int(np.flatnonzero(bad)[0])
    reason, remedy = "", REMEDY
    for name, column in point.items():
        value = column[i]
        low, high = limits.get(name, (-np.inf, np.inf))
        if not np.isfinite(value) or value < 0 or (value == 0 and name not in MAY_BE_ZERO):
            rule = "finite, or negative" if name in MAY_BE_ZERO else "finite and positive"
            reason, remedy = f"{name} = {value:.15g} is not {rule}", NO_REMEDY
            break
        if not low <= value <= high and not reason:
            reason = f"{name} = {value:.15g} is outside the atlas, {low:.10g} to {high:.10g}"
    if not reason and otherwise is not None:
        reason = otherwise(i)
    others = f" ({bad.sum()} of {len(bad)} points are outside)" if len(bad) > 1 else ""
    return reason + others + remedy
