"""Folds with drag looked up in an atlas. Needs numpy and netCDF4 only."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.tables import direct
from towatlas.tables.domain import complaint, sound
from towatlas.tables.drag_series import AXES, ERRORS, SERIES, STATUSES, DragAxes, DragSeries

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
DRAG_GROUP = "support/drag"


class DragFoldTable:
    """The part of an atlas that holds folds with drag in a nondense fluid.

    Attributes
    ----------
    axes : DragAxes
        The domain.
    n_max : int
        Highest transition held, >= 1.
    looked_for : str
        In words, where all folds were looked for and how many of others there are.
    """

    holds = "folds with drag"
    made_by = "towatlas build --drag"

    def __init__(self, file: Any):
        group = file[DRAG_GROUP]
        axes = DragAxes(**{name: float(group.getncattr(name)) for name in AXES})
        self.series = DragSeries(
            axes, {name: np.asarray(group[f"drag_{name}"][:], np.float64) for name in SERIES + ERRORS}
        )
        self.axes, self.n_max = axes, self.series.n_max
        self.looked_for = str(group.getncattr("folds_looked_for"))

    @staticmethod
    def in_file(file: Any, method: str) -> bool:
        """Whether a file holds this part.

        Parameters
        ----------
        file : netCDF4.Dataset
        method : str
            How it was built, its attribute.

        Returns
        -------
        bool
        """
        return "support" in file.groups and "drag" in file["support"].groups

    def __repr__(self) -> str:
        return f"{self.holds}: {', '.join(f'{name} {held}' for name, held in self.domain().items())}"

    def domain(self) -> dict[str, str]:
        """Ranges of what is held, in words.

        Returns
        -------
        dict of str
            By quantity.
        """
        axes = self.axes
        return {
            "n with drag": f"1 .. {self.n_max}",
            "w_f with drag": f"0 .. {axes.w_f_max:g}",
            "lam with drag": f"{axes.lam_min:g} .. {axes.lam_max:g}",
            "gamma with drag": f"up to {axes.gamma_max:g}",
        }

    def answer(self, outside: str, *, lam: Array, w_f: Array, C: Array, n: Integers) -> dict[str, NDArray[Any]]:
        """Where the n-th pair appears and ends, and C*_n, of checked rows.

        Parameters
        ----------
        outside : {"raise", "nan", "solve"}
            What becomes of points outside.
        lam, w_f, C : ndarray, shape (points,)
            Cable length, fish weight and drag constant [-].
        n : ndarray of int, shape (points,)

        Returns
        -------
        dict of ndarray, shape (points,)
            NUMBERS and STATUSES.

        Raises
        ------
        ValueError
            For points outside with outside="raise".
        """
        point: dict[str, NDArray[Any]] = {"n": n, "lam": lam, "w_f": w_f, "C": C}
        good = sound(point)
        table = self.series.interpolate(good, **point)
        bad = ~good | (table["status"] == status.OUTSIDE)
        if outside == "raise" and bad.any():
            axes = self.axes
            limits = {"n": (1, self.n_max), "lam": (axes.lam_min, axes.lam_max), "w_f": (0.0, axes.w_f_max)}
            near = "closer to C*_{} than the series tells them apart"
            raise ValueError(complaint(point, limits, bad, lambda i: f"C = {C[i]:.15g} is {near.format(n[i])}"))
        missing = good & np.any([table[name] == status.OUTSIDE for name in STATUSES[:3]], axis=0)
        if outside == "solve" and missing.any():
            solved = direct.drag_folds(**{name: column[missing] for name, column in point.items()})
            for name in table:
                table[name][missing] = getattr(solved, name)
        return table
