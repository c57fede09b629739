"""Growth rates of inner shapes in a vacuum, and where they begin and cease to flutter, looked up in an atlas.

Growth rates stand on a grid over n, the fish weight, the length beyond the threshold and the speed over gamma_cn. Their
squares are interpolated, which are smooth up to where two oscillations meet, between nodes of one kind only: through
four nodes on each axis where these are of one kind, else through two. Boundaries stand on the first axes, a sheet for
each stretch of them that hangs together. Needs numpy only.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.limits import unchecked_excess_length
from towatlas.numerics.axes import LinearAxis, LogAxis, ShiftedLogAxis
from towatlas.numerics.lagrange import interpolate, weights, windows
from towatlas.tables import direct
from towatlas.tables.critical import CriticalTable
from towatlas.tables.domain import complaint, sound

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]
STABILITY_GROUP = "support/stability"
# Fish weight at which its coordinate turns from linear to logarithmic.
W_SCALE = 0.3
# Growth below this share of gamma is weak.
WEAK = 0.01
AXES = ("excess_min", "excess_max", "w_f_max", "speed_min", "speed_max")
GROWTH = ("growth", "frequency", "unstable", "growth_error", "frequency_error")
SHEETS = ("sheet_n", "sheet_begins", "sheet_speed", "sheet_frequency", "sheet_error")


@dataclass(frozen=True)
class StabilityAxes:
    """The domain and its axes.

    Attributes
    ----------
    excess_min, excess_max : float
        Of lambda - lambda_cn [-], > 0.
    w_f_max : float
        Heaviest fish [-], > 0.
    speed_min, speed_max : float
        Lowest and highest speed over gamma_cn [-], > 1.
    """

    excess_min: float
    excess_max: float
    w_f_max: float
    speed_min: float
    speed_max: float

    @property
    def w_f(self) -> ShiftedLogAxis:
        """Of the fish weight."""
        return ShiftedLogAxis(self.w_f_max, W_SCALE)

    @property
    def excess(self) -> LogAxis:
        """Of the length beyond the threshold."""
        return LogAxis(self.excess_min, self.excess_max)

    @property
    def root(self) -> LinearAxis:
        """Of the root of log(gamma / gamma_cn), in which shapes are smooth at their fold."""
        low, high = np.sqrt(np.log([self.speed_min, self.speed_max]))
        return LinearAxis(float(low), float(high))


@dataclass(frozen=True)
class HeldCurve:
    """A boundary of flutter at one weight of the fish, solved for from where it begins to where it ends.

    Attributes
    ----------
    n : int
        Of the pair, >= 1.
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0.
    lam, gamma, omega : ndarray, shape (points,)
        Length over tow radius, speed Omega sqrt(R/g), and the frequency there over Omega [-].
    """

    n: int
    w_f: float
    lam: Array
    gamma: Array
    omega: Array


def _curves(group: Any) -> tuple[HeldCurve, ...]:
    sizes = np.asarray(group["stability_row_size"][:], np.int64)
    orders, weights = (np.asarray(group[f"stability_curve_{name}"][:]) for name in ("n", "w_f"))
    columns = [np.asarray(group[f"stability_curve_{name}"][:]) for name in ("lam", "gamma", "omega")]
    ends = np.cumsum(sizes)
    return tuple(
        HeldCurve(int(n), float(w_f), *(column[end - size : end] for column in columns))
        for n, w_f, size, end in zip(orders, weights, sizes, ends, strict=True)
    )


def code_of(growth: Array, frequency: Array, unstable: NDArray[Any]) -> Integers:
    """What only is interpolated within: how many grow, and whether the leading one is real; -1 if not known.

    Parameters
    ----------
    growth, frequency : ndarray
        Of the leading eigenvalue.
    unstable : ndarray of int
        -1 if not counted.

    Returns
    -------
    ndarray of int
    """
    known = np.isfinite(growth) & (unstable >= 0)
    return np.where(known, 2 * unstable.astype(np.int64) + ((unstable > 0) & (frequency > 0.0)), -1)


def of_one_kind(codes: Integers, width: int) -> Booleans:
    """Cells of which the nodes about them, so many on each axis, are known and alike.

    Parameters
    ----------
    codes : ndarray of int, shape (w_f, excess, speed)
    width : int
        Even.

    Returns
    -------
    ndarray of bool, shape (w_f - 1, excess - 1, speed - 1)
    """
    least, most = codes, codes
    for axis, nodes in enumerate(codes.shape):
        if nodes < width:
            return np.zeros(tuple(count - 1 for count in codes.shape), bool)
        first = windows(np.arange(nodes - 1), nodes, width)
        least, most = (
            reduce.reduce([np.take(part, first + k, axis=axis) for k in range(width)])
            for reduce, part in ((np.minimum, least), (np.maximum, most))
        )
    return np.asarray((least == most) & (least >= 0))


def cell_of(coordinate: Array, nodes: int) -> Integers:
    """Which of the cells between evenly spaced nodes of [-1, 1].

    Parameters
    ----------
    coordinate : ndarray, shape (points,)
        What is nan is taken for the first cell.
    nodes : int
        >= 2.

    Returns
    -------
    ndarray of int, shape (points,)
    """
    at = np.nan_to_num(0.5 * (coordinate + 1.0) * (nodes - 1))
    return np.clip(at, 0, nodes - 2).astype(np.int64)


class GrowthGrid:
    """Growth rates of one n on their grid, in units of Omega.

    Parameters
    ----------
    growth, frequency : ndarray, shape (w_f, excess, speed)
    unstable : ndarray of int, of that shape
    """

    def __init__(self, growth: Array, frequency: Array, unstable: NDArray[Any]):
        self.nodes = tuple(np.linspace(-1.0, 1.0, count) for count in growth.shape)
        codes = code_of(growth, frequency, unstable)
        self.alike, self.smooth = of_one_kind(codes, 2), of_one_kind(codes, 4)
        self.squares = tuple(np.where(codes >= 0, np.square(part), 0.0) for part in (growth, frequency))
        self.unstable = unstable

    def cells(self, coordinates: tuple[Array, Array, Array]) -> tuple[Integers, ...]:
        """In which cells points lie.

        Parameters
        ----------
        coordinates : tuple of three ndarray, shape (points,)
            Of w_f, excess and speed, -1 to 1.

        Returns
        -------
        tuple of three ndarray of int, shape (points,)
        """
        return tuple(cell_of(x, len(nodes)) for x, nodes in zip(coordinates, self.nodes, strict=True))

    def at(self, coordinates: tuple[Array, Array, Array]) -> tuple[Array, Array, Integers]:
        """Growth, frequency and how many grow; nan and -1 in cells whose nodes are not alike.

        Parameters
        ----------
        coordinates : tuple of three ndarray, shape (points,)
            Of w_f, excess and speed, -1 to 1.

        Returns
        -------
        tuple of three ndarray, shape (points,)
        """
        cells = self.cells(coordinates)
        alike, smooth = self.alike[cells], self.smooth[cells]
        found = np.full((2, len(alike)), np.nan)
        for width, which in ((2, alike & ~smooth), (4, smooth)):
            if which.any():
                some = (tuple(part[which] for part in cells), tuple(part[which] for part in coordinates))
                found[:, which] = interpolate(self.squares, self.nodes, *some, width)
        growth, frequency = np.sqrt(np.maximum(found, 0.0))
        return growth, frequency, np.where(alike, self.unstable[cells], -1)


def sheet_at(values: Array, y: float, x: float) -> Array:
    """Functions on sheets at a point: through four nodes on each axis where there are as many, else through two.

    Parameters
    ----------
    values : ndarray, shape (sheets, w_f, excess)
        nan where a sheet is not.
    y, x : float
        Coordinates of w_f and excess, -1 to 1.

    Returns
    -------
    ndarray, shape (sheets,)
        nan where not all of the four nodes about the point are on the sheet.
    """
    found = np.full(len(values), np.nan)
    for width in (2, 4):
        if min(values.shape[1:]) < width:
            continue
        part, shares = values, []
        for axis, at in ((1, y), (2, x)):
            nodes = np.linspace(-1.0, 1.0, values.shape[axis])
            first = windows(cell_of(np.array([at]), len(nodes)), len(nodes), width)
            part = np.take(part, np.arange(first[0], first[0] + width), axis=axis)
            shares.append(weights(np.array([at]), nodes, first, width)[0])
        finer = np.einsum("sjk,j,k->s", part, *shares, optimize=False)
        found = np.where(np.isfinite(finer), finer, found)
    return found


class StabilityTable:
    """The part of an atlas that holds growth rates and boundaries of flutter.

    Attributes
    ----------
    axes : StabilityAxes
        The domain.
    n_max : int
        Highest pair held, >= 1.
    curves : tuple of HeldCurve
        Boundaries at some of the weights.
    checked : str
        In words, what random points said that were not used to build it.
    """

    holds = "growth rates"
    made_by = "towatlas build --stability"

    def __init__(self, file: Any):
        group = file[STABILITY_GROUP]
        self.axes = StabilityAxes(**{name: float(group.getncattr(name)) for name in AXES})
        arrays = {name: np.asarray(group[f"stability_{name}"][:]) for name in GROWTH + SHEETS}
        self.arrays = arrays
        self.complete = np.asarray(group["stability_complete"][:], bool)
        self.grids = [GrowthGrid(*(arrays[name][k] for name in GROWTH[:3])) for k in range(len(arrays["growth"]))]
        self.n_max = len(self.grids)
        self.curves = _curves(group)
        self.checked = str(group.getncattr("checked"))
        self.critical = CriticalTable(file)

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
        return "support" in file.groups and "stability" in file["support"].groups

    def domain(self) -> dict[str, str]:
        """Ranges of what is held, in words.

        Returns
        -------
        dict of str
            By quantity.
        """
        axes = self.axes
        return {
            "n of growth rates": f"1 .. {self.n_max}",
            "w_f of growth rates": f"0 .. {axes.w_f_max:g}",
            "lam - lambda_c of growth rates": f"{axes.excess_min:g} .. {axes.excess_max:g}",
            "gamma / gamma_c of growth rates": f"{axes.speed_min:.6g} .. {axes.speed_max:g}",
            "growth rates checked": self.checked,
        }

    def answer(self, outside: str, *, lam: Array, w_f: Array, gamma: Array, n: Integers) -> dict[str, NDArray[Any]]:
        """Growth rates of checked rows.

        Parameters
        ----------
        outside : {"raise", "nan", "solve"}
            What becomes of points outside.
        lam, w_f, gamma : ndarray, shape (points,)
            Cable length, fish weight and speed [-].
        n : ndarray of int, shape (points,)
            Of the pair whose inner shape is meant; 0 for the median shape.

        Returns
        -------
        dict of ndarray, shape (points,)
            n, growth, frequency, unstable, kind, error, status.

        Raises
        ------
        ValueError
            For points outside with outside="raise".
        """
        n = n.copy()
        point: dict[str, NDArray[Any]] = {"lam": lam, "w_f": w_f, "gamma": gamma}
        good = sound(point)
        (speeds, _), median = self._critical_speeds(lam=lam, w_f=w_f), n == 0
        n[median] = self._median(lam=lam, w_f=w_f, gamma=gamma, speeds=speeds)[median]
        table: dict[str, NDArray[Any]] = {
            **{name: np.full(len(n), np.nan) for name in ("growth", "frequency", "error")},
            "unstable": np.full(len(n), -1),
            "kind": np.full(len(n), "unknown", "<U10"),
            "status": np.full(len(n), status.OUTSIDE, np.int8),
        }
        table["status"][~good] = status.BAD_INPUT
        # Up to the first critical speed there is one shape, which is stable always.
        first = good & median & (n == 0)
        table["growth"][first], table["unstable"][first], table["error"][first] = 0.0, 0, 0.0
        table["status"][first] = status.OK
        for order in range(1, self.n_max + 1):
            self._interpolate(table, np.flatnonzero(good & (n == order)), order, speeds, **point)
        done = table["status"] == status.OK
        table["kind"][done] = kinds(table["growth"][done], table["frequency"][done], gamma[done])
        missing = good & (table["status"] == status.OUTSIDE)
        if outside == "raise" and (missing | ~good).any():
            raise ValueError(self._complaint(point, n, speeds, missing | ~good))
        if outside == "solve" and missing.any():
            unknown = missing & (n < 0)
            if unknown.any():
                some = {name: column[unknown] for name, column in point.items()}
                n[unknown] = direct.fish_positions("median", **some)["nodes"]
            solved = direct.growth_rates(lam=lam[missing], w_f=w_f[missing], gamma=gamma[missing], n=n[missing])
            for name, column in solved.items():
                table[name][missing] = column
        return table | {"n": n}

    def _critical_speeds(self, *, lam: Array, w_f: Array) -> tuple[Array, Array]:
        """gamma_cn of n to one more than held, and their errors, shape (n, points); nan where there is none, or none is
        held."""
        orders = np.arange(1, self.n_max + 2)
        shape = (len(orders), len(lam))
        columns = {"lam": np.broadcast_to(lam, shape).ravel(), "w_f": np.broadcast_to(w_f, shape).ravel()}
        table = self.critical.answer(("gamma", "error"), "nan", **columns, n=np.repeat(orders, len(lam)))
        return table["gamma"].reshape(shape), table["error"].reshape(shape)

    def _median(self, *, lam: Array, w_f: Array, gamma: Array, speeds: Array) -> Integers:
        """Nodes of the median shape; -1 where a critical speed that there is is not held."""
        orders = np.arange(1, self.n_max + 2)[:, None]
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            absent = unchecked_excess_length(lam=lam, w_f=w_f, n=orders) <= 0.0
            passed = (speeds <= gamma).sum(axis=0)
        return np.where((absent | np.isfinite(speeds)).all(axis=0), passed, -1)

    def coordinates(self, n: int, *, lam: Array, w_f: Array, gamma: Array, fold: Array) -> tuple[Array, Array, Array]:
        """Coordinates on the grid of one n, -1 to 1 inside, nan outside.

        Parameters
        ----------
        n : int
        lam, w_f, gamma, fold : ndarray, shape (points,)
            fold is gamma_cn.

        Returns
        -------
        tuple of three ndarray, shape (points,)
        """
        axes = self.axes
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            excess, ratio = unchecked_excess_length(lam=lam, w_f=w_f, n=np.full(len(lam), n)), gamma / fold
            inside = (excess >= axes.excess_min) & (excess <= axes.excess_max) & (w_f <= axes.w_f_max)
            inside &= (ratio >= axes.speed_min) & (ratio <= axes.speed_max)
            root = axes.root.coordinate(np.sqrt(np.log(ratio)))
            found = axes.w_f.coordinate(w_f), axes.excess.coordinate(excess), root
        y, x, v = (np.where(inside, part, np.nan) for part in found)
        return y, x, v

    def _interpolate(
        self,
        table: dict[str, NDArray[Any]],
        i: Integers,
        n: int,
        speeds: Array,
        *,
        lam: Array,
        w_f: Array,
        gamma: Array,
    ) -> None:
        places = self.coordinates(n, lam=lam[i], w_f=w_f[i], gamma=gamma[i], fold=speeds[n - 1, i])
        inside = np.isfinite(places[0])
        i, grid = i[inside], self.grids[n - 1]
        y, x, v = (part[inside] for part in places)
        growth, frequency, unstable = grid.at((y, x, v))
        cells = grid.cells((y, x, v))
        errors = [self.arrays[name][n - 1][cells] for name in ("growth_error", "frequency_error")]
        held = np.isfinite(errors[0]) & (unstable >= 0)
        k = i[held]
        table["growth"][k], table["frequency"][k] = growth[held] * gamma[k], frequency[held] * gamma[k]
        table["unstable"][k], table["status"][k] = unstable[held], status.OK
        table["error"][k] = np.max(errors, axis=0)[held] * gamma[k]

    def _complaint(self, point: dict[str, NDArray[Any]], n: Integers, speeds: Array, bad: Booleans) -> str:
        axes = self.axes

        def otherwise(i: int) -> str:
            if n[i] < 0:
                return f"lam = {point['lam'][i]:.15g}: a critical speed of the cable is not in the atlas"
            if not 1 <= n[i] <= self.n_max:
                return f"the shape has {n[i]} nodes or more; held are 1 to {self.n_max}"
            lam, w_f, gamma = (point[name][i : i + 1] for name in ("lam", "w_f", "gamma"))
            place = self.coordinates(int(n[i]), lam=lam, w_f=w_f, gamma=gamma, fold=speeds[n[i] - 1, i : i + 1])
            if np.isfinite(place[0][0]):
                return f"gamma = {point['gamma'][i]:.15g} is next to where the shape of {n[i]} nodes changes its kind"
            return (
                f"the shape of {n[i]} nodes is held for lam - lambda_c{n[i]} of {axes.excess_min:g} to "
                f"{axes.excess_max:g} and gamma / gamma_c{n[i]} of {axes.speed_min:.6g} to {axes.speed_max:g}"
            )

        return complaint(point, {"w_f": (0.0, axes.w_f_max)}, bad, otherwise)

    def boundaries(self, outside: str, *, lam: float, w_f: float, n: int) -> dict[str, Any]:
        """Where the inner shape of one cable begins and ceases to flutter.

        Parameters
        ----------
        outside : {"raise", "nan"}
        lam, w_f : float
            Cable length and fish weight [-].
        n : int

        Returns
        -------
        dict
            gamma, begins, frequency and error, ndarray of shape (boundaries,) in rising speed, and status.

        Raises
        ------
        ValueError
            For a cable outside with outside="raise".
        """
        point = {"lam": np.array([lam]), "w_f": np.array([w_f])}
        nothing: dict[str, Any] = {name: np.empty(0) for name in ("gamma", "frequency", "error")}
        nothing["begins"] = np.empty(0, bool)
        if not sound(point)[0]:
            if outside == "raise":
                raise ValueError(complaint(point, {}, np.ones(1, bool)))
            return nothing | {"status": status.BAD_INPUT}
        if n <= self.n_max and unchecked_excess_length(lam=lam, w_f=w_f, n=n) <= 0.0:
            return nothing | {"status": status.NO_TRANSITION}
        speeds, errors = self._critical_speeds(**point)
        fold = float(speeds[n - 1, 0]) if n <= self.n_max else np.nan
        one = np.array([fold])
        y, x, _ = (
            float(part[0]) for part in self.coordinates(n, **point, gamma=one * np.sqrt(self.axes.speed_max), fold=one)
        )
        if not np.isfinite(x):
            if outside == "raise":
                raise ValueError(self._boundary_complaint(point, n))
            return nothing | {"status": status.OUTSIDE}
        mine = self.arrays["sheet_n"] == n
        speed, frequency = (self.arrays[f"sheet_{name}"][mine] for name in ("speed", "frequency"))
        j, i = (int(cell_of(np.array([at]), count)[0]) for at, count in zip((y, x), speed.shape[1:], strict=True))
        error = self.arrays["sheet_error"][mine][:, j, i]
        held, fastest = np.isfinite(error), np.log(self.axes.speed_max)
        # Sheets go on beyond the highest speed.
        near = (speed[:, j : j + 2, i : i + 2] <= fastest).any(axis=(1, 2))
        whole = held[near].all() and self.complete[n - 1, j : j + 2, i : i + 2].all()
        ratio = sheet_at(speed[held], y, x)
        order = np.argsort(ratio)
        order = order[ratio[order] <= fastest]
        gamma = fold * np.exp(ratio[order])
        error = error[held][order] + errors[n - 1, 0]
        # Two that are nearer to each other than that may be none.
        whole &= bool((np.diff(gamma) > error[1:] * gamma[1:] + error[:-1] * gamma[:-1]).all())
        return {
            "gamma": gamma,
            "begins": self.arrays["sheet_begins"][mine][held][order] == 1,
            "frequency": sheet_at(frequency[held], y, x)[order] * gamma,
            "error": error,
            "status": status.OK if whole else status.NOT_COUNTED,
        }

    def _boundary_complaint(self, point: dict[str, NDArray[Any]], n: int) -> str:
        axes = self.axes
        limits = {"w_f": (0.0, axes.w_f_max), "n": (1.0, float(self.n_max))}

        def otherwise(i: int) -> str:
            return f"boundaries are held for lam - lambda_c{n} of {axes.excess_min:g} to {axes.excess_max:g}"

        text = complaint(point | {"n": np.array([n])}, limits, np.ones(1, bool), otherwise)
        return text.replace('outside="solve" computes such points directly', "krein_boundaries computes them")


def kinds(growth: Array, frequency: Array, gamma: Array) -> NDArray[np.str_]:
    """What becomes of a small push, as of `towatlas.Stability`.

    Parameters
    ----------
    growth, frequency, gamma : ndarray, shape (points,)

    Returns
    -------
    ndarray of str, shape (points,)
    """
    growing = np.where(frequency > 0.0, "flutter", "divergence")
    return np.where(growth == 0.0, "stable", np.where(growth < WEAK * gamma, "weak", growing))
