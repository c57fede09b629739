"""What is proved about the nodes of an atlas: the file beside it. Needs numpy and netCDF4 only."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from towatlas.tables.file import open_group, read_root
from towatlas.tables.seal import AtlasFileError

METHOD = "certified"
# Raised when the proof changes.
PROOF_VERSION = 1
UNTRIED, PROVED, NOT_PROVED = 0, 1, 2


@dataclass(frozen=True)
class Certified:
    """A file of proofs.

    Attributes
    ----------
    atlas_seal : str
        Seal of the atlas whose nodes they are about.
    version : int
        Of the method.
    outcome : ndarray of int8, shape (n, w_f, lam)
        UNTRIED, PROVED or NOT_PROVED.
    gamma_radius : ndarray, shape (n, w_f, lam)
        What the stored gamma is off by at most [-], > 0; nan where not proved.
    holds : ndarray of int8, shape (n, w_f, lam)
        Whether the stored relative error is as large as that: 1, else 0.
    seconds : float
        CPU time that the proofs took [s].
    """

    atlas_seal: str
    version: int
    outcome: NDArray[np.int8]
    gamma_radius: NDArray[np.float64]
    holds: NDArray[np.int8]
    seconds: float

    def facts(self) -> dict[str, str]:
        """What there is to say of it.

        Returns
        -------
        dict of str
        """
        proved = self.outcome == PROVED
        failed = int((proved & (self.holds == 0)).sum())
        largest = float(np.nanmax(self.gamma_radius)) if proved.any() else float("nan")
        return {
            "nodes proved": f"{int(proved.sum())} of {self.outcome.size}; tried and not proved "
            f"{int((self.outcome == NOT_PROVED).sum())}",
            "stored errors": f"hold at every node proved, {int(proved.sum())}"
            if not failed
            else f"do not hold at {failed} of the {int(proved.sum())} nodes proved",
            "largest proved radius of gamma": f"{largest:.2g}",
            "between nodes": "nothing is proved; what is known is the error map of the atlas",
        }


def read_certified(path: Path) -> Certified:
    """Read a file of proofs.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Certified

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    AtlasFileError
        If it cannot be read, or holds something else.
    """
    attributes, data, _ = read_root(path)
    if attributes.get("method") != METHOD:
        raise AtlasFileError(f"{path} holds no proofs; `towatlas certify ATLAS` makes such a file")
    with open_group(path, data) as file:
        outcome, radius, holds = (np.asarray(file[name][:]) for name in ("outcome", "gamma_radius", "holds"))
    seconds = float(attributes["cpu_seconds"])
    return Certified(attributes["atlas_seal"], int(attributes["proof_version"]), outcome, radius, holds, seconds)
