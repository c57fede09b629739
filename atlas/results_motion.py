"""What the program answers about motions of a cable: which shapes last. All numbers are dimensionless unless said."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status as codes
from towatlas.results import Array, Equilibria, Integers
from towatlas.system import System


@dataclass(frozen=True)
class Stability:
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
        Number of eigenvalues that grow by more than their error, >= 0, conjugate ones counted each; -1 if not counted.
    index : ndarray of int, shape (equilibria,)
        Without drag the number of directions in which the energy falls, >= 0; -1 with drag.
    kind : ndarray of str, shape (equilibria,)
        "stable"; "divergence" where the leading eigenvalue is real, "flutter" where it is one of a pair, "weak" where
        it is below 0.01 gamma; "unknown" where not counted.
    error : ndarray, shape (equilibria,)
        Estimated absolute error of growth and frequency over sqrt(g/R) [-], > 0.
    status : ndarray of int8, shape (equilibria,)
        Codes of `towatlas.kernels.status`; `sentence` puts them in words.
    eigenvalues : tuple of ndarray of complex, shape (equilibria,)
        Of each shape those that were solved for, with frequencies >= 0, over sqrt(g/R) [-], the leading one first.
    looked_at : str
        Which were looked for.
    """

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
        Name of the shape where it grows most, as of `Equilibria`.
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


@dataclass(frozen=True)
class Flutter:
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

    system: System
    low: float
    high: float
    windows: tuple[Window, ...]
    complete: bool
    looked_at: str
