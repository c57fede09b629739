"""Rows in batches short enough that no call of a kernel takes more than a few seconds: nothing stops one half way."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray


def batches(work: NDArray[np.float64], most: float) -> Iterator[slice]:
    """Rows one after the other, so many at a time that their work is at most `most`; one row at least.

    Parameters
    ----------
    work : ndarray, shape (rows,)
        Of each row, in any unit, >= 0; nan is none.
    most : float
        > 0.

    Yields
    ------
    slice

    Examples
    --------
    >>> [(s.start, s.stop) for s in batches(np.array([3.0, 3.0, 9.0, 1.0]), 7.0)]
    [(0, 2), (2, 3), (3, 4)]
    """
    if work.size and work.sum() <= most:
        yield slice(0, work.size)
        return
    total = np.cumsum(np.minimum(np.nan_to_num(work), most))
    begin, before = 0, 0.0
    while begin < len(work):
        stop = max(begin + 1, int(np.searchsorted(total, before + most, side="right")))
        yield slice(begin, stop)
        begin, before = stop, float(total[stop - 1])
