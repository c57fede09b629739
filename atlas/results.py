"""What the program answers with. Arrays of one answer have one shape; all numbers are dimensionless unless said."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status as codes
from towatlas.labelled import Answer
from towatlas.nomenclature import EQUILIBRIUM, Symbol
from towatlas.system import System

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# What there is of each fold.
OF_EACH_FOLD = ("value", "gamma", "r_f", "shapes_below", "shapes_above", "n", "origin", "error", "status")


@dataclass(frozen=True, repr=False)
class CriticalStates(Answer):
    """Critical states of towed cables in a vacuum; arrays of one shape, that of what was asked.

    Attributes
    ----------
    n : ndarray of int, shape (...)
        Number of the transition [-], >= 1.
    lam : ndarray, shape (...)
        Length of the cable over tow radius [-], > 0.
    w_f : ndarray, shape (...)
        Weight of the fish over (mu + rho A) g R [-], >= 0.
    gamma : ndarray, shape (...)
        Critical speed Omega sqrt(R/g) [-], > 0; nan, as all that follow, where status is not OK.
    R_x0 : ndarray, shape (...)
        Radial force of the cable at the tow point over (mu + rho A) g R [-], < 0.
    x_f : ndarray, shape (...)
        Radial position of the fish over tow radius [-], with the sign of (-1)^n.
    z_f : ndarray, shape (...)
        Depth of the fish below the tow point over tow radius [-], 0 to lam.
    tension : ndarray, shape (...)
        At the tow point, over (mu + rho A) g R [-], > 0.
    error : ndarray, shape (...)
        Estimated relative error of gamma [-], > 0.
    status : ndarray of int8, shape (...)
        Codes of `towatlas.kernels.status`; `sentence` puts them in words.
    """

    n: Integers
    lam: Array
    w_f: Array
    gamma: Array
    R_x0: Array
    x_f: Array
    z_f: Array
    tension: Array
    error: Array
    status: NDArray[np.int8]

    @classmethod
    def of_one(cls, quantities: dict[str, Any], *, lam: Any, w_f: Any, n: Any) -> "CriticalStates":
        """That of one cable, of numbers: arrays of shape (). In two thirds of the time that the constructor takes.

        Parameters
        ----------
        quantities : dict
            The other attributes; status of its own kind.
        lam, w_f : float
        n : int

        Returns
        -------
        CriticalStates
        """
        made = object.__new__(cls)
        # What a frozen dataclass goes a long way round for.
        values, array = made.__dict__, np.array
        values["n"], values["lam"], values["w_f"] = array(int(n)), array(float(lam)), array(float(w_f))
        for name, value in quantities.items():
            values[name] = array(value)
        return made

    def sentence(self, index: Any = ()) -> str:
        """The status of one state in words.

        Parameters
        ----------
        index : int or tuple of int
            Which state; none for answers of shape ().

        Returns
        -------
        str
        """
        return codes.SENTENCES[int(self.status[index])]


@dataclass(frozen=True, repr=False)
class Equilibria(Answer):
    """Equilibria of one cable at one speed in any medium, in rising order of R_x0.

    The tow point is at (1, 0, 0) and moves along y in a turn to starboard, against it in one to port; z points down.
    In a vacuum everything lies in the plane y = 0.

    Attributes
    ----------
    system : System
        The cable, its fish and the medium.
    gamma : float
        Speed Omega sqrt(R/g) [-], negative in a turn to port.
    R_x0, R_y0, R_z0 : ndarray, shape (equilibria,)
        Force of the cable at the tow point, pointing down it, over (mu + rho A) g R [-].
    x_f, y_f, z_f : ndarray, shape (equilibria,)
        Position of the fish over tow radius [-].
    r_f : ndarray, shape (equilibria,)
        Distance of the fish from the axis over tow radius [-], 0 to 1 + lam.
    phase_deg : ndarray, shape (equilibria,)
        Angle of the fish behind the tow point [deg], >= 0, carried along the cable and not wrapped: 180 for each node.
    tension : ndarray, shape (equilibria,)
        At the tow point, over (mu + rho A) g R [-], > 0.
    nodes : ndarray of int, shape (equilibria,)
        Sign changes of x along the cable [-], >= 0.
    branch : ndarray of str, shape (equilibria,)
        In a vacuum "outward" for the shape without nodes, "n inner" and "n outer" for the members of the n-th pair; in
        a fluid "shape k", counted from the axis outwards.
    expected : int
        Row of the shape that is expected to be seen: in a vacuum the median root, after NRL Report 7048; with drag the
        one whose fish is nearest to the axis, which the median root becomes. -1 if none can be named.
    near_axis : ndarray of bool, shape (equilibria,)
        Whether the fish is nearer to the axis than half the tow radius, and than in every other shape.
    error : ndarray, shape (equilibria,)
        Estimated relative error of r_f [-], > 0.
    boundary_error : ndarray, shape (equilibria,)
        E of Eq. (33) of a forward Runge-Kutta shot with this R_x0 over (mu + rho A) g R [-], an independent witness in
        which its own truncation error dominates; nan with drag, where there is no such shot.
    searched : str
        What was searched, and whether the list is complete.
    """

    DIMENSION: ClassVar[str] = "shape"
    SYMBOLS: ClassVar[dict[str, Symbol]] = EQUILIBRIUM

    system: System
    gamma: float
    R_x0: Array
    R_y0: Array
    R_z0: Array
    x_f: Array
    y_f: Array
    z_f: Array
    r_f: Array
    phase_deg: Array
    tension: Array
    nodes: Integers
    branch: NDArray[np.str_]
    expected: int
    near_axis: NDArray[np.bool_]
    error: Array
    boundary_error: Array
    searched: str

    def __len__(self) -> int:
        return len(self.R_x0)


@dataclass(frozen=True, repr=False)
class Folds(Answer):
    """Folds of one cable as one of its numbers moves, in rising order of it: at each two shapes meet.

    Attributes
    ----------
    system : System
        The cable, its fish and the medium, where what moves is lowest.
    moved : str
        Name of what moves: "gamma", or a number of the system.
    value : ndarray, shape (folds,)
        Of what moves [-].
    gamma : ndarray, shape (folds,)
        Speed Omega sqrt(R/g) [-], negative in a turn to port.
    r_f : ndarray, shape (folds,)
        Distance of the fish from the axis over tow radius [-], > 0.
    shapes_below, shapes_above : ndarray of int, shape (folds,)
        Number of shapes just below and just above it [-], >= 1, two apart.
    n : ndarray of int, shape (folds,)
        Number of the fold of the vacuum from which it is continued [-], >= 1; 0 for one that drag makes.
    origin : ndarray of str, shape (folds,)
        "vacuum" or "drag"; empty, and n 0, where it was not asked for.
    error : ndarray, shape (folds,)
        Estimated relative error of `value` [-], > 0.
    status : ndarray of int8, shape (folds,)
        Codes of `towatlas.kernels.status`.
    complete : bool
        Whether everything that was looked at was made out.
    searched : str
        What was looked at, in words.
    """

    DIMENSION: ClassVar[str] = "fold"
    SYMBOLS: ClassVar[dict[str, Symbol]] = EQUILIBRIUM

    system: System
    moved: str
    value: Array
    gamma: Array
    r_f: Array
    shapes_below: Integers
    shapes_above: Integers
    n: Integers
    origin: NDArray[np.str_]
    error: Array
    status: NDArray[np.int8]
    complete: bool
    searched: str

    def __len__(self) -> int:
        return len(self.value)

    def beside(self, gamma: float) -> tuple[int, int]:
        """Which folds in speed are next to a speed.

        Parameters
        ----------
        gamma : float
            [-].

        Returns
        -------
        below, above : int
            -1 where there is none. One at that very speed is below.
        """
        speeds, here = np.abs(self.gamma), abs(gamma)
        below, above = np.flatnonzero(speeds <= here), np.flatnonzero(speeds > here)
        return (
            int(below[np.argmax(speeds[below])]) if len(below) else -1,
            int(above[np.argmin(speeds[above])]) if len(above) else -1,
        )

    def part(self, which: Any) -> "Folds":
        """Some of them.

        Parameters
        ----------
        which : ndarray of int or bool
            Rows.

        Returns
        -------
        Folds
        """
        return replace(self, **{name: getattr(self, name)[which] for name in OF_EACH_FOLD})


def joined(parts: Sequence[Folds]) -> Folds:
    """Folds of one system over ranges that follow each other.

    Parameters
    ----------
    parts : sequence of Folds
        At least one.

    Returns
    -------
    Folds
    """
    columns: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in OF_EACH_FOLD}
    searched = "; ".join(part.searched for part in parts)
    return replace(parts[0], **columns, complete=all(part.complete for part in parts), searched=searched)


@dataclass(frozen=True, repr=False)
class Cusps(Answer):
    """Cusps of one cable as its speed and one other of its numbers move, in rising order of that number.

    Attributes
    ----------
    system : System
        The cable, its fish and the medium, where what moves is lowest.
    moved : str
        Name of the number that moves beside the speed.
    value : ndarray, shape (cusps,)
        Of it [-].
    gamma : ndarray, shape (cusps,)
        Speed Omega sqrt(R/g) [-], negative in a turn to port.
    r_f : ndarray, shape (cusps,)
        Distance of the fish from the axis over tow radius [-], > 0.
    error : ndarray, shape (cusps,)
        Estimated relative error of `value` [-], > 0.
    complete : bool
        Whether everything that was looked at was made out.
    searched : str
        What was looked at, in words.
    """

    DIMENSION: ClassVar[str] = "cusp"
    SYMBOLS: ClassVar[dict[str, Symbol]] = EQUILIBRIUM

    system: System
    moved: str
    value: Array
    gamma: Array
    r_f: Array
    error: Array
    complete: bool
    searched: str

    def __len__(self) -> int:
        return len(self.value)


@dataclass(frozen=True, repr=False)
class FishPositions(Answer):
    """Where the fish is on one branch of the equilibria in a vacuum; arrays of one shape, that of what was asked.

    Attributes
    ----------
    lam : ndarray, shape (...)
        Length of the cable over tow radius [-], > 0.
    w_f : ndarray, shape (...)
        Weight of the fish over (mu + rho A) g R [-], >= 0.
    gamma : ndarray, shape (...)
        Speed Omega sqrt(R/g) [-], > 0.
    nodes : ndarray of int, shape (...)
        Number of nodes of the shape [-], >= 0; -1 where status is not OK.
    x_f, z_f : ndarray, shape (...)
        Position of the fish over tow radius [-]; nan where status is not OK.
    error : ndarray, shape (...)
        Estimated relative error of x_f and z_f [-], > 0; nan where status is not OK.
    status : ndarray of int8, shape (...)
        Codes of `towatlas.kernels.status`.
    interpolated : ndarray of bool, shape (...)
        Whether the answer comes from the table; else it was solved directly.
    """

    SYMBOLS: ClassVar[dict[str, Symbol]] = EQUILIBRIUM

    lam: Array
    w_f: Array
    gamma: Array
    nodes: Integers
    x_f: Array
    z_f: Array
    error: Array
    status: NDArray[np.int8]
    interpolated: NDArray[np.bool_]


# What becomes of a pair of shapes as the speed rises, in the names of DragFolds.
SIDES = ("appears", "ends", "again")


@dataclass(frozen=True, repr=False)
class DragFolds(Answer):
    """Folds of towed cables in a nondense fluid; arrays of one shape, that of what was asked.

    nan where a status says why.

    Attributes
    ----------
    n : ndarray of int, shape (...)
        Number of the transition in a vacuum [-], >= 1.
    lam : ndarray, shape (...)
        Length of the cable over tow radius [-], > 0.
    w_f : ndarray, shape (...)
        Weight of the fish over (mu + rho A) g R [-], >= 0.
    C : ndarray, shape (...)
        Drag constant of the cable [-], >= 0.
    appears : ndarray, shape (...)
        Speed at which the n-th pair of equilibria appears [-], > 0.
    r_f_appears : ndarray, shape (...)
        Distance of the fish from the axis there, over tow radius [-], > 0.
    ends : ndarray, shape (...)
        Speed at which the outer member of the pair meets another equilibrium and is gone [-], > `appears`.
    r_f_ends : ndarray, shape (...)
        Distance of the fish from the axis there, over tow radius [-], > 0.
    again : ndarray, shape (...)
        Speed at which the pair that had ended appears again [-], > `ends`.
    r_f_again : ndarray, shape (...)
        Distance of the fish from the axis there, over tow radius [-], > 0.
    C_cusp : ndarray, shape (...)
        C*_n, the drag constant above which there is no n-th pair [-], > 0.
    gamma_cusp : ndarray, shape (...)
        Speed at the cusp [-], > 0.
    C_lasting : ndarray, shape (...)
        Drag constant below which the pair does not end, up to the highest speed looked at [-], > 0.
    error, error_ends, error_again : ndarray, shape (...)
        Estimated relative errors of `appears`, `ends` and `again` [-], > 0.
    error_cusp, error_lasting : ndarray, shape (...)
        Estimated relative errors of C_cusp and C_lasting [-], > 0.
    status, status_ends, status_again, status_cusp : ndarray of int8, shape (...)
        Codes of `towatlas.kernels.status` of `appears`, `ends`, `again` and `C_cusp`.
    """

    n: Integers
    lam: Array
    w_f: Array
    C: Array
    appears: Array
    r_f_appears: Array
    ends: Array
    r_f_ends: Array
    again: Array
    r_f_again: Array
    C_cusp: Array
    gamma_cusp: Array
    C_lasting: Array
    error: Array
    error_ends: Array
    error_again: Array
    error_cusp: Array
    error_lasting: Array
    status: NDArray[np.int8]
    status_ends: NDArray[np.int8]
    status_again: NDArray[np.int8]
    status_cusp: NDArray[np.int8]

    def sentence(self, index: Any = (), of: str = "appears") -> str:
        """The status of one fold in words: of `appears`, `ends`, `again` or of the `cusp`."""
        column = self.status if of == "appears" else getattr(self, f"status_{of}")
        return codes.SENTENCES[int(column[index])]


@dataclass(frozen=True, repr=False)
class GrowthRates(Answer):
    """Growth rates of inner shapes in a vacuum, from an atlas; arrays of one shape, that of what was asked.

    Attributes
    ----------
    lam, w_f, gamma : ndarray, shape (...)
        Length over tow radius, fish weight over (mu + rho A) g R, speed Omega sqrt(R/g) [-].
    n : ndarray of int, shape (...)
        Nodes of the shape, 0 for that of a cable slower than its first critical speed.
    growth, frequency : ndarray, shape (...)
        Of the leading eigenvalue over sqrt(g/R) [-]; of a shape that lasts 0 and that of its slowest mode. nan where
        status is not OK, the frequency where n is 0.
    unstable : ndarray of int, shape (...)
        How many eigenvalues grow, conjugate ones counted each; -1 where status is not OK.
    kind : ndarray of str, shape (...)
        As of `Stability`.
    error : ndarray, shape (...)
        Estimated absolute error of growth and frequency over sqrt(g/R) [-].
    status : ndarray of int8, shape (...)
        Codes of `towatlas.kernels.status`.
    """

    lam: Array
    w_f: Array
    gamma: Array
    n: Integers
    growth: Array
    frequency: Array
    unstable: Integers
    kind: NDArray[np.str_]
    error: Array
    status: NDArray[np.int8]


@dataclass(frozen=True, repr=False)
class FlutterSpeeds(Answer):
    """Speeds at which the inner shape of n nodes of one cable begins and ceases to flutter, from an atlas.

    Attributes
    ----------
    lam, w_f : float
        Length over tow radius, fish weight over (mu + rho A) g R [-].
    n : int
        Nodes of the shape, >= 1.
    gamma : ndarray, shape (boundaries,)
        Speeds Omega sqrt(R/g) [-], rising.
    begins : ndarray of bool, shape (boundaries,)
        Whether a mode begins to grow there as the speed rises, or ceases. Of n > 1 several may grow.
    frequency : ndarray, shape (boundaries,)
        Over sqrt(g/R) [-].
    error : ndarray, shape (boundaries,)
        Estimated relative error of gamma [-].
    status : int
        A code of `towatlas.kernels.status`; NOT_COUNTED where there may be others or, of two nearer
        to each other than their errors, none, as next to where a window opens.
    """

    DIMENSION: ClassVar[str] = "edge"

    lam: float
    w_f: float
    n: int
    gamma: Array
    begins: NDArray[np.bool_]
    frequency: Array
    error: Array
    status: int
