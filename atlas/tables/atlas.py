"""Answers from a file, whichever it holds. Needs numpy and netCDF4 only."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import (
    check_broadcast,
    check_choice,
    check_one,
    check_order,
    check_outside,
    check_real,
    one_number,
)
from towatlas.labelled import quantity_of, takes_frames
from towatlas.nomenclature import SYMBOLS
from towatlas.results import CriticalStates, DragFolds, FishPositions, FlutterSpeeds, GrowthRates
from towatlas.tables.critical import QUANTITIES, CriticalTable
from towatlas.tables.drag_folds import DragFoldTable
from towatlas.tables.file import default_path, open_group, read_root
from towatlas.tables.fish import BRANCHES, FishTable
from towatlas.tables.seal import AtlasFileError
from towatlas.tables.stability import StabilityTable

NEAR_CHOICES = ("solve", "nan")
PARTS = (CriticalTable, FishTable, DragFoldTable, StabilityTable)


def open_atlas(path: str | os.PathLike | None = None) -> "Atlas":
    """Open a file made by `towatlas build` and check that it is whole.

    Parameters
    ----------
    path : path, optional
        The file; without it $TOWATLAS_FILE, else what `towatlas build` made, else the one that came with the package.

    Returns
    -------
    Atlas
        With critical speeds, positions of the fish, folds with drag, growth rates: whichever the file holds.

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    AtlasFileError
        If the file is damaged (a single changed bit is noticed), holds none of these, or is of a newer version; if
        $TOWATLAS_FILE is empty.

    Examples
    --------
    >>> atlas = open_atlas("build/atlas.nc")
    >>> atlas.holds
    ('critical speeds',)
    >>> round(float(atlas.critical_speed(37.8, 1352, n=2)), 8)
    3.41756706
    """
    return Atlas(default_path() if path is None else Path(path))


class Atlas:
    """What a file holds, interpolated. Made by `open_atlas`; safe to share between threads.

    `fish` says where the fish is at any speed, `folds` where pairs of equilibria appear and end with drag, `growth` how
    fast shapes are left in a vacuum, `flutter` at which speeds that begins, `states` all quantities of the critical
    states. Each of `critical_speed`, `reaction`, `fish_offset`, `fish_depth`, `tow_tension`, `error` and `status`
    returns one of them, and takes xarray DataArrays (chunked ones lazily) and pandas Series (by their labels), too;
    `states`, `fish` and `folds` take a DataFrame with their arguments as columns, and return one. pint quantities are
    made dimensionless, or refused.

    Attributes
    ----------
    path : Path
        The file.
    attributes : dict
        Its global attributes.
    sha256 : str
        Its seal, 64 hexadecimal digits.

    Notes
    -----
    outside : what becomes of points the table does not hold (too close to the threshold, too long a cable, too heavy
    a fish, n beyond the table, nan): "raise" a ValueError that names the axis, the value and the limits; "nan", with
    the reason in the status; or "solve" them directly. Nothing is ever extrapolated. A cable no longer than lambda_cn
    has no n-th transition: the answer is nan, its status NO_TRANSITION.
    """

    def __init__(self, path: Path):
        self.path = path
        self.attributes, data, self.sha256 = read_root(path)
        method = self.attributes.get("method", "")
        with open_group(path, data) as file:
            try:
                self._parts = {part: part(file) for part in PARTS if part.in_file(file, method)}
            except (AttributeError, IndexError, KeyError) as error:
                raise AtlasFileError(
                    f"{path} was built by another version of towatlas and lacks what is read ({error}); build it again"
                ) from None
        if not self._parts:
            raise AtlasFileError(
                f"{path} was built with --method {method} and holds a plain table only; lookup needs an atlas built "
                "with --method fold"
            )

    def __repr__(self) -> str:
        return f"Atlas({str(self.path)!r}: {', '.join(self.holds)})"

    @property
    def holds(self) -> tuple[str, ...]:
        """In words: "critical speeds", "fish positions", "folds with drag", "growth rates"."""
        return tuple(part.holds for part in self.parts)

    @property
    def parts(self) -> list[CriticalTable | FishTable | DragFoldTable | StabilityTable]:
        """What the file holds."""
        return list(self._parts.values())

    @property
    def critical(self) -> CriticalTable:
        """The part with critical states; AtlasFileError if the file does not hold it."""
        return self.part(CriticalTable)

    @property
    def positions(self) -> FishTable:
        """The part with positions of the fish; AtlasFileError if the file does not hold it."""
        return self.part(FishTable)

    @property
    def drag(self) -> DragFoldTable:
        """The part with folds with drag; AtlasFileError if the file does not hold it."""
        return self.part(DragFoldTable)

    @property
    def stability(self) -> StabilityTable:
        """The part with growth rates; AtlasFileError if the file does not hold it."""
        return self.part(StabilityTable)

    def part(self, part: Any) -> Any:
        """The part of a class of PARTS.

        Parameters
        ----------
        part : type
            One of PARTS.

        Returns
        -------
        CriticalTable, FishTable, DragFoldTable or StabilityTable

        Raises
        ------
        AtlasFileError
            If the file does not hold it.
        """
        if part not in self._parts:
            raise AtlasFileError(
                f"{self.path} holds no {part.holds}, only {' and '.join(self.holds)}; `{part.made_by}` makes a file "
                "that does"
            )
        return self._parts[part]

    @takes_frames
    def states(self, lam: ArrayLike, w_f: ArrayLike, n: ArrayLike = 1, outside: str = "raise") -> CriticalStates:
        """All quantities of the critical states, with error estimate and status.

        Parameters
        ----------
        lam : array_like
            Cable length over tow radius [-].
        w_f : array_like
            Fish weight over (mu + rho A) g R [-].
        n : array_like of int
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        CriticalStates
            Arrays of the broadcast shape; nan where status is not OK.

        Raises
        ------
        ValueError
            For what is not a number, and points outside with outside="raise".
        AtlasFileError
            If the file holds no critical speeds.

        Examples
        --------
        >>> states = open_atlas("build/atlas.nc").states([1.5, 10.0], 0.0)
        >>> [states.sentence(k) for k in range(2)]
        ['no such transition: the cable is not longer than lambda_cn', 'computed']
        """
        check_outside(outside)
        if one := self._one(lam, w_f, n):
            return CriticalStates.of_one(one, lam=lam, w_f=w_f, n=n)
        lam, w_f, n = check_broadcast(lam=check_real("lam", lam), w_f=check_real("w_f", w_f), n=check_order(n))
        table = self.critical.answer(QUANTITIES, outside, lam=lam.ravel(), w_f=w_f.ravel(), n=n.ravel())
        return CriticalStates(n=n, lam=lam, w_f=w_f, **_shaped(table, n))

    def critical_speed(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Critical speed gamma_cn = Omega sqrt(R/g).

        Parameters
        ----------
        lam, w_f : array_like, DataArray or Series
            Cable length over tow radius, fish weight over (mu + rho A) g R [-].
        n : array_like of int, DataArray or Series
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        float, ndarray, DataArray or Series
            [-], > 0; relative error estimate: `error`.
        """
        return self._quantity("gamma", lam, w_f, n, outside)

    def reaction(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Radial reaction at the tow point R_x0^cn.

        Parameters
        ----------
        lam, w_f : array_like, DataArray or Series
            Cable length over tow radius, fish weight over (mu + rho A) g R [-].
        n : array_like of int, DataArray or Series
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        float, ndarray, DataArray or Series
            Over (mu + rho A) g R [-]; negative.
        """
        return self._quantity("R_x0", lam, w_f, n, outside)

    def fish_offset(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Radial position of the fish x_f.

        Parameters
        ----------
        lam, w_f : array_like, DataArray or Series
            Cable length over tow radius, fish weight over (mu + rho A) g R [-].
        n : array_like of int, DataArray or Series
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        float, ndarray, DataArray or Series
            Over tow radius [-], with the sign of (-1)^n.
        """
        return self._quantity("x_f", lam, w_f, n, outside)

    def fish_depth(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Depth of the fish z_f.

        Parameters
        ----------
        lam, w_f : array_like, DataArray or Series
            Cable length over tow radius, fish weight over (mu + rho A) g R [-].
        n : array_like of int, DataArray or Series
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        float, ndarray, DataArray or Series
            Below the tow point over tow radius [-], > 0.
        """
        return self._quantity("z_f", lam, w_f, n, outside)

    def tow_tension(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Cable tension at the tow point.

        Parameters
        ----------
        lam, w_f : array_like, DataArray or Series
            Cable length over tow radius, fish weight over (mu + rho A) g R [-].
        n : array_like of int, DataArray or Series
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        float, ndarray, DataArray or Series
            Over (mu + rho A) g R [-], > 0.
        """
        return self._quantity("tension", lam, w_f, n, outside)

    def error(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Estimated relative error of the critical speed.

        Parameters
        ----------
        lam, w_f : array_like, DataArray or Series
            Cable length over tow radius, fish weight over (mu + rho A) g R [-].
        n : array_like of int, DataArray or Series
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        float, ndarray, DataArray or Series
            [-], > 0.
        """
        return self._quantity("error", lam, w_f, n, outside)

    def status(self, lam: Any, w_f: Any, n: Any = 1, outside: str = "raise") -> Any:
        """Status codes.

        Parameters
        ----------
        lam, w_f : array_like, DataArray or Series
            Cable length over tow radius, fish weight over (mu + rho A) g R [-].
        n : array_like of int, DataArray or Series
            Number of the transition, >= 1.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the table does not hold; see the class.

        Returns
        -------
        int8, ndarray, DataArray or Series
            Of `towatlas.kernels.status`.
        """
        return self._quantity("status", lam, w_f, n, outside)

    @takes_frames
    def fish(
        self,
        lam: ArrayLike,
        w_f: ArrayLike,
        gamma: ArrayLike,
        branch: str = "median",
        *,
        outside: str = "raise",
        near: str = "solve",
    ) -> FishPositions:
        """Position of the fish.

        Parameters
        ----------
        lam : array_like
            Cable length over tow radius [-].
        w_f : array_like
            Fish weight over (mu + rho A) g R [-].
        gamma : array_like
            Speed Omega sqrt(R/g) [-].
        branch : {"median", "outward"}
            The shape that Skop expects to be seen, with a node more beyond every critical speed; or the one without
            nodes that swings outward. Up to the first critical speed they are one.
        outside : {"raise", "nan", "solve"}
            What becomes of points that the grid does not hold: a ValueError that says which axis, nan with the reason
            in the status, or the direct solution.
        near : {"solve", "nan"}
            What becomes of points next to a fold: the direct solution, which needs numba, or nan.

        Returns
        -------
        FishPositions
            Arrays of the broadcast shape; nan where status is not OK.

        Raises
        ------
        ValueError
            For what is not a number, a choice that does not exist, and points outside with outside="raise".
        AtlasFileError
            If the file holds no positions of the fish.

        Examples
        --------
        >>> at = open_atlas("build/equilibria.nc").fish([5.0, 8.0], 1.0, 0.9)
        >>> at.nodes.tolist(), [round(float(x), 2) for x in at.x_f]
        ([1, 1], [-1.3, -1.56])
        """
        check_choice("branch", branch, BRANCHES)
        check_outside(outside)
        check_choice("near", near, NEAR_CHOICES)
        lam, w_f, gamma = check_broadcast(
            lam=check_real("lam", lam), w_f=check_real("w_f", w_f), gamma=check_real("gamma", gamma)
        )
        table = self.positions.answer(branch, outside, near, lam=lam.ravel(), w_f=w_f.ravel(), gamma=gamma.ravel())
        return FishPositions(lam=lam, w_f=w_f, gamma=gamma, **_shaped(table, lam))

    @takes_frames
    def folds(
        self, lam: ArrayLike, w_f: ArrayLike, C: ArrayLike, n: ArrayLike = 1, outside: str = "raise"
    ) -> DragFolds:
        """Where the n-th pair of equilibria appears and ends with drag, and C*_n.

        Parameters
        ----------
        lam, w_f, C : array_like
            Cable length, fish weight and drag constant of the cable [-].
        n : array_like of int
            Number of the transition.
        outside : {"raise", "nan", "solve"}
            What becomes of points outside the table: a ValueError that says how, nan, or the direct solver.

        Returns
        -------
        DragFolds
            Arrays of the broadcast shape; nan where a status says why.

        Raises
        ------
        ValueError
            For what is not a number, a choice that does not exist, and points outside with outside="raise".
        AtlasFileError
            If the file holds no folds with drag.

        Notes
        -----
        Nothing is extrapolated, and nothing is interpolated across the cusp: C within the error of C*_n, and `ends` at
        drags below those of the series, are outside.
        """
        check_outside(outside)
        arrays = {"lam": check_real("lam", lam), "w_f": check_real("w_f", w_f), "C": check_real("C", C)}
        lam, w_f, C, n = check_broadcast(**arrays, n=check_order(n))
        table = self.drag.answer(outside, lam=lam.ravel(), w_f=w_f.ravel(), C=C.ravel(), n=n.ravel())
        return DragFolds(n=n, lam=lam, w_f=w_f, C=C, **_shaped(table, n))

    @takes_frames
    def growth(
        self, lam: ArrayLike, w_f: ArrayLike, gamma: ArrayLike, n: ArrayLike | None = None, outside: str = "raise"
    ) -> GrowthRates:
        """Growth rate of the median shape in a vacuum, or of the inner shape of n nodes.

        Parameters
        ----------
        lam, w_f, gamma : array_like
            Cable length, fish weight and speed [-].
        n : array_like of int, optional
            Nodes, >= 1; those of the median shape by default, one more beyond each critical speed.
        outside : {"raise", "nan", "solve"}
            What becomes of points outside the table: a ValueError that says how, nan, or the direct solution.

        Returns
        -------
        GrowthRates
            Arrays of the broadcast shape; nan where status is not OK.

        Raises
        ------
        ValueError
            For what is not a number, a choice that does not exist, and points outside with outside="raise".
        AtlasFileError
            If the file holds no growth rates.

        Notes
        -----
        Nothing is interpolated across a fold, nor across where the number of what grows changes: points next to these
        are outside.
        """
        check_outside(outside)
        arrays = {"lam": check_real("lam", lam), "w_f": check_real("w_f", w_f), "gamma": check_real("gamma", gamma)}
        order = np.zeros((), np.int64) if n is None else check_order(n)
        lam, w_f, gamma, order = check_broadcast(**arrays, n=order)
        columns = {"lam": lam.ravel(), "w_f": w_f.ravel(), "gamma": gamma.ravel(), "n": order.ravel()}
        table = self.stability.answer(outside, **columns)
        return GrowthRates(lam=lam, w_f=w_f, gamma=gamma, **_shaped(table, lam))

    def flutter(self, lam: float, w_f: float, n: int = 1, outside: str = "raise") -> FlutterSpeeds:
        """Speeds at which the inner shape of n nodes of a cable in a vacuum begins and ceases to flutter.

        Parameters
        ----------
        lam, w_f : float
            Cable length and fish weight [-].
        n : int
            Nodes, >= 1.
        outside : {"raise", "nan"}
            What becomes of a cable outside the table: a ValueError that says how, or no speeds, with the reason in the
            status. `towatlas.flutter` computes.

        Returns
        -------
        FlutterSpeeds

        Raises
        ------
        ValueError
            For what is not one number, and a cable outside with outside="raise".
        AtlasFileError
            If the file holds no growth rates.
        """
        check_choice("outside", outside, ("raise", "nan"))
        lam, w_f, n = check_one("lam", lam), check_one("w_f", w_f, zero=True), int(check_order(n))
        return FlutterSpeeds(lam, w_f, n, **self.stability.boundaries(outside, lam=lam, w_f=w_f, n=n))

    def _quantity(self, name: str, lam: Any, w_f: Any, n: Any, outside: str) -> Any:
        check_outside(outside)
        if one := self._one(lam, w_f, n):
            return one[name] if name == "status" else np.float64(one[name])

        def plain(*, lam: Any, w_f: Any, n: Any) -> Any:
            lam, w_f, n = check_broadcast(lam=check_real("lam", lam), w_f=check_real("w_f", w_f), n=check_order(n))
            table = self.critical.answer((name,), outside, lam=lam.ravel(), w_f=w_f.ravel(), n=n.ravel())
            return table[name].reshape(n.shape)[()]

        kind = np.int8 if name == "status" else np.float64
        return quantity_of(plain, name, SYMBOLS[name].long_name, kind, lam=lam, w_f=w_f, n=n)

    def _one(self, lam: Any, w_f: Any, n: Any) -> dict[str, Any] | None:
        """All QUANTITIES of one point that needs no check beyond its being in the table; None for all others."""
        lam, w_f, n = one_number(lam), one_number(w_f), one_number(n)
        if lam is None or w_f is None or n is None:
            return None
        return self.critical.one(lam=lam, w_f=w_f, n=n)


def _shaped(table: dict[str, NDArray[Any]], like: NDArray[Any]) -> dict[str, NDArray[Any]]:
    return {name: column.reshape(like.shape) for name, column in table.items()}
