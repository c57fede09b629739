"""What the program answers about motions of a cable: which shapes last. All numbers are dimensionless unless said."""

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status as codes
from towatlas.kernels.system import COLUMNS
from towatlas.labelled import Answer
from towatlas.nomenclature import EQUILIBRIUM, Symbol
from towatlas.results import Array, Equilibria, Integers
from towatlas.system import System

if TYPE_CHECKING:
    import pandas
    import xarray


@dataclass(frozen=True, repr=False)
class Stability(Answer):
    """Growth rates of small motions about the equilibria of one cable at one speed, in the order of these.

    Times are in sqrt(R/g). A motion grows as exp(growth t) and turns by frequency t.

    Attributes
    ----------
    equilibria : Equilibria
        The shapes.
    growth, frequency : ndarray, shape (equilibria,)
        Of the leading eigenvalue, that which grows most, or damps least, over sqrt(g/R) [-]; of several with the same
        growth the slowest. Without drag the growth of what does not grow is 0. nan where status says why, and where
        all is damped so strongly that none was found.
    unstable : ndarray of int, shape (equilibria,)
        Number of eigenvalues that grow with the fish at r_f to the last bit, >= 0, conjugate ones counted each; -1 if
        not counted.
    index : ndarray of int, shape (equilibria,)
        Without drag the number of directions in which the energy falls, >= 0; -1 with drag.
    kind : ndarray of str, shape (equilibria,)
        "stable"; "divergence" where the leading eigenvalue is real, "flutter" where it is one of a pair, "weak" where
        it is below 0.01 gamma; "unknown" where it grows by less than its error, or not all that grow were counted.
    error : ndarray, shape (equilibria,)
        Estimated absolute error of growth and frequency over sqrt(g/R) [-], > 0.
    status : ndarray of int8, shape (equilibria,)
        Codes of `towatlas.kernels.status`; `sentence` puts them in words.
    eigenvalues : tuple of ndarray of complex, shape (equilibria,)
        Of each shape those that were solved for, with frequencies >= 0, over sqrt(g/R) [-], the leading one first.
    looked_at : str
        Which were looked for.
    """

    DIMENSION: ClassVar[str] = "shape"
    SYMBOLS: ClassVar[dict[str, Symbol]] = EQUILIBRIUM

    equilibria: Equilibria
    growth: Array
    frequency: Array
    unstable: Integers
    index: Integers
    kind: NDArray[np.str_]
    error: Array
    status: NDArray[np.int8]
    eigenvalues: tuple[NDArray[np.complex128], ...]
    looked_at: str

    def __len__(self) -> int:
        return len(self.growth)

    def sentence(self, index: int) -> str:
        """The status of one shape in words.

        Parameters
        ----------
        index : int
            Which shape.

        Returns
        -------
        str
        """
        return codes.SENTENCES[int(self.status[index])]


@dataclass(frozen=True)
class Window:
    """A range of speeds in which the shape of one branch does not last.

    Attributes
    ----------
    branch : str
        Its name, as of `Branch`.
    nodes : int
        Its nodes [-], >= 0.
    low, high : float
        Speeds Omega sqrt(R/g) [-], > 0.
    low_kind, high_kind : str
        What is there: "fold", where the branch begins or ends, "hopf", "krein", where two oscillations meet without
        drag, "range", the end of what was looked at, or "unknown", where growth could not be counted.
    low_frequency, high_frequency : float
        Of the leading eigenvalue there, over sqrt(g/R) [-], >= 0.
    growth : float
        The largest, over sqrt(g/R) [-], > 0.
    gamma : float
        Where it is [-].
    weak : bool
        Whether it is below 0.01 gamma.
    """

    branch: str
    nodes: int
    low: float
    high: float
    low_kind: str
    high_kind: str
    low_frequency: float
    high_frequency: float
    growth: float
    gamma: float
    weak: bool


@dataclass(frozen=True, repr=False)
class Flutter(Answer):
    """Ranges of speed in which shapes of one cable do not last.

    Attributes
    ----------
    system : System
        The cable, its fish and the medium.
    low, high : float
        Speeds looked at [-], > 0.
    windows : tuple of Window
        Branch by branch.
    complete : bool
        Whether all shapes were made out and counted.
    looked_at : str
        In words.
    """

    DIMENSION: ClassVar[str] = "window"

    system: System
    low: float
    high: float
    windows: tuple[Window, ...]
    complete: bool
    looked_at: str

    def columns(self) -> dict[str, Any]:
        """The windows as arrays, by field.

        Returns
        -------
        dict of ndarray, shape (windows,)
        """
        return {field.name: np.array([getattr(one, field.name) for one in self.windows]) for field in fields(Window)}


@dataclass(frozen=True, repr=False)
class Boundary(Answer):
    """Where the inner member of the n-th pair in a vacuum begins or ceases to flutter, as a curve over the length.

    Attributes
    ----------
    n : int
        Of the pair, >= 1.
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0.
    lam, gamma : ndarray, shape (points,)
        Length over tow radius and speed Omega sqrt(R/g) along the curve [-]; its ends and its turning points in lam,
        all solved for, are among them.
    omega : ndarray, shape (points,)
        Frequency of the two oscillations that meet, over Omega [-], >= 0.
    r_f : ndarray, shape (points,)
        Distance of the fish from the axis over tow radius [-], > 0.
    turns : ndarray of int
        Which of the points are turning points: where two edges meet, in a cusp where three oscillations are one.
    error : ndarray, shape (points,)
        Estimated relative error of gamma, across the curve [-].
    begins : ndarray of bool, shape (points,)
        Whether a mode begins to grow there as the speed rises, or ceases; at a turning point neither. Where two edges
        cross, a window closes and opens again: there two modes do not feel each other.
    kinds : (str, str)
        What is at its ends: "length" or "speed", the limits of what was looked at, "fold" of the statics, "real",
        where growth rates meet on the real axis instead, or "unknown".
    """

    n: int
    w_f: float
    lam: Array
    gamma: Array
    omega: Array
    r_f: Array
    turns: Integers
    error: Array
    begins: NDArray[np.bool_]
    kinds: tuple[str, str]

    def columns(self) -> dict[str, Any]:
        """The curve as arrays, by field; `turns` as whether a point is one.

        Returns
        -------
        dict of ndarray, shape (points,)
        """
        return super().columns() | {"turns": np.isin(np.arange(len(self.lam)), self.turns)}


@dataclass(frozen=True)
class Point:
    """Where a branch begins, ends or changes.

    Attributes
    ----------
    kind : str
        "fold", "hopf", "krein", "range" or "unknown", as of `Window`.
    value : float
        Of what moves, as of `Diagram`.
    x_f, r_f, z_f, tension : float
        As of `Branch`; at a fold computed, elsewhere between samples 1 % apart.
    """

    kind: str
    value: float
    x_f: float
    r_f: float
    z_f: float
    tension: float


@dataclass(frozen=True, repr=False)
class Branch:
    """One branch of shapes over the speed, or over the length of the cable.

    Attributes
    ----------
    name : str
        In a vacuum as of `Equilibria`; with drag that where the branch begins, and, where a fold does that, the value
        there: "shape 1 from 6.8106". No two branches of one answer have the same.
    value : ndarray, shape (samples,)
        Of what moves, rising, as of `Diagram`.
    gamma : ndarray, shape (samples,)
        Speeds Omega sqrt(R/g) [-].
    nodes : ndarray of int, shape (samples,)
        Sign changes of x along the cable [-], >= 0.
    x_f, r_f, z_f : ndarray, shape (samples,)
        Position of the fish, its distance from the axis, its depth below the tow point, over tow radius [-].
    tension : ndarray, shape (samples,)
        At the tow point, over (mu + rho A) g R [-], > 0.
    growth, frequency : ndarray, shape (samples,)
        Of the leading eigenvalue over sqrt(g/R) [-].
    unstable : ndarray of int, shape (samples,)
        How many eigenvalues grow; -1 if not counted.
    kind : ndarray of str, shape (samples,)
        As of `Stability`.
    points : tuple of Point
        Where the branch begins, changes and ends, in rising order.
    between : tuple of str
        The kind that it is of between each of them and the next.
    """

    name: str
    value: Array
    gamma: Array
    nodes: Integers
    x_f: Array
    r_f: Array
    z_f: Array
    tension: Array
    growth: Array
    frequency: Array
    unstable: Integers
    kind: NDArray[np.str_]
    points: tuple[Point, ...]
    between: tuple[str, ...]

    def __repr__(self) -> str:
        text = f"Branch {self.name!r}: {self.points[0].value:.6g} ({self.points[0].kind})"
        for k, (kind, point) in enumerate(zip(self.between, self.points[1:], strict=True)):
            # What goes on as it was is no change.
            if k + 1 == len(self.between) or self.between[k + 1] != kind:
                text += f" {kind} {point.value:.6g} ({point.kind})"
        return text


@dataclass(frozen=True, repr=False)
class Diagram:
    """All branches of shapes of one cable over its speed, or over its length.

    Attributes
    ----------
    system : System
        The cable, its fish and the medium.
    moved : str
        "gamma", the speed Omega sqrt(R/g), or "lam", the length over tow radius.
    low, high : float
        Between which of its values [-], > 0.
    branches : tuple of Branch
        In the order of their lowest values, from the outermost inwards.
    complete : bool
        Whether all shapes were made out and counted.
    looked_at : str
        In words.
    """

    system: System
    moved: str
    low: float
    high: float
    branches: tuple[Branch, ...]
    complete: bool
    looked_at: str

    def __repr__(self) -> str:
        head = (
            f"Diagram over {self.moved} {self.low:.6g} to {self.high:.6g}, {len(self.branches)} branches, {self.system}"
        )
        return "\n".join([head, *(f"  {branch}" for branch in self.branches)])

    def to_dataset(self) -> "xarray.Dataset":
        """The diagram as a dataset.

        Returns
        -------
        xarray.Dataset
            What moves, gamma or lam, nodes, x_f, r_f, z_f, tension, growth, frequency, unstable and lasts over (branch,
            sample), nan or -1 beyond the last of a branch; lasts is 1 where the kind is "stable", 0 where it is
            another, -1 if unknown. point_gamma, or point_lam, and point_kind over (branch, point), name over branch.
        """
        facts = {name: getattr(self.system, name) for name in COLUMNS if name != self.moved}
        if self.moved == "lam":
            facts["gamma"] = float(self.branches[0].gamma[0])
        found = dataset_of(self.branches, self.moved, dict.fromkeys(DIAGRAM_UNITS, "1"))
        return found.assign_attrs(looked_at=self.looked_at, **facts)

    def to_dataframe(self) -> "pandas.DataFrame":
        """The samples of all branches as a table.

        Returns
        -------
        pandas.DataFrame
            A row a sample, with the name of its branch.
        """
        import pandas

        columns = ("value", *(name for name in _DIAGRAM if name != "value"), "kind")
        frames = [
            pandas.DataFrame({"name": one.name, **{name: getattr(one, name) for name in columns}})
            for one in self.branches
        ]
        return pandas.concat(frames, keys=range(len(frames)), names=["branch", "sample"]).rename(
            columns={"value": self.moved}
        )


def dataset_of(branches: tuple[Branch, ...], moved: str, units: dict[str, str]) -> "xarray.Dataset":
    """Branches as a dataset.

    Parameters
    ----------
    branches : tuple of Branch
    moved : str
        Name of what moves.
    units : dict of str
        Of "value", "position", "tension" and "rate", that of growth and frequency.

    Returns
    -------
    xarray.Dataset
        As of `Diagram.to_dataset`.
    """
    import xarray

    size, points = (max(len(of(branch)) for branch in branches) for of in (lambda b: b.value, lambda b: b.points))

    def filled(columns: list[Array], width: int, missing: float, kind: type) -> Array:
        out: Array = np.full((len(columns), width), missing, kind)
        for row, column in zip(out, columns, strict=True):
            row[: len(column)] = column
        return out

    variables: dict[str, Any] = {}
    for name, (text, unit) in _DIAGRAM.items():
        whole = name in ("nodes", "unstable")
        columns = [getattr(branch, name) for branch in branches]
        data = filled(columns, size, -1 if whole else np.nan, np.int32 if whole else np.float64)
        about = {"long_name": text, "units": units.get(unit, "1")}
        variables[moved if name == "value" else name] = (("branch", "sample"), data, about)
    lasts = [np.where(b.kind == "unknown", -1, (b.kind == "stable").astype(int)) for b in branches]
    about = {"long_name": "whether the shape lasts, -1 if not known", "units": "1"}
    variables["lasts"] = (("branch", "sample"), filled(lasts, size, -1, np.int8), about)
    values = [np.array([point.value for point in branch.points]) for branch in branches]
    about = {"long_name": "where the branch begins, changes or ends", "units": units["value"]}
    variables[f"point_{moved}"] = (("branch", "point"), filled(values, points, np.nan, np.float64), about)
    kinds = [[point.kind for point in b.points] + [""] * (points - len(b.points)) for b in branches]
    variables["point_kind"] = (("branch", "point"), np.array(kinds, np.str_), {"long_name": "what is there"})
    names = np.array([branch.name for branch in branches], np.str_)
    variables["name"] = (("branch",), names, {"long_name": "name of the branch"})
    return xarray.Dataset(variables, attrs={"title": "Branches of shapes of a towed cable", "Conventions": "CF-1.11"})


DIAGRAM_UNITS = ("value", "position", "tension", "rate")
_DIAGRAM = {
    "value": ("what moves", "value"),
    "nodes": ("sign changes of x along the cable", ""),
    "x_f": ("radial position of the fish", "position"),
    "r_f": ("distance of the fish from the axis", "position"),
    "z_f": ("depth of the fish below the tow point", "position"),
    "tension": ("tension at the tow point", "tension"),
    "growth": ("growth of the leading eigenvalue", "rate"),
    "frequency": ("frequency of the leading eigenvalue", "rate"),
    "unstable": ("number of eigenvalues that grow, -1 if not counted", ""),
}
