"""Where an atlas is tabulated, and how finely the scan looks."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _decades(low: int, high: int, per_decade: int) -> Array:
    return 10.0 ** np.linspace(low, high, (high - low) * per_decade + 1)


@dataclass(frozen=True)
class Grid:
    """Where an atlas is tabulated. The defaults are those of `make atlas`."""

    n_max: int = 6
    w_f_max: float = 1e4
    excess_min: float = 1e-3
    excess_max: float = 1e3
    series_w_f: int = 96
    series_excess: int = 112
    error_blocks: int = 12
    w_f: Array = field(default_factory=lambda: np.concatenate([[0.0], _decades(-3, 4, 8)]))
    lam: Array = field(default_factory=lambda: _decades(0, 3, 40))

    @property
    def size(self) -> int:
        """Number of folds to solve: nodes, points between them, table."""
        nodes = self.series_w_f * self.series_excess + (self.series_w_f - 1) * (self.series_excess - 1)
        return self.n_max * (nodes + len(self.w_f) * len(self.lam))


@dataclass(frozen=True)
class EquilibriaGrid:
    """Where the equilibria are tabulated: more than half a million cables and speeds, two equilibria each."""

    w_f: Array = field(default_factory=lambda: np.concatenate([[0.0], _decades(-2, 4, 6)]))
    lam: Array = field(default_factory=lambda: _decades(-1, 2, 32))
    gamma: Array = field(default_factory=lambda: 10.0 ** np.linspace(np.log10(0.05), np.log10(20.0), 141))

    @property
    def size(self) -> int:
        """Number of cables and speeds."""
        return len(self.w_f) * len(self.lam) * len(self.gamma)


@dataclass(frozen=True)
class ScanSettings:
    """How finely `scan` looks. Speeds are spaced evenly in their logarithm, from just below 1/sqrt(lambda)."""

    speeds: int = 240
    guesses: int = 1024
    segments: int = 100
    gamma_max: float = 20.0
    n_max: int = 4
    tolerance: float = 1e-9
    w_f: Array = field(default_factory=lambda: np.array([0.0, 1.0, 10.0, 100.0, 1352.0]))
    lam: Array = field(default_factory=lambda: np.array([2.5, 5.0, 10.0, 20.0, 37.8]))

    @property
    def size(self) -> int:
        """Number of folds looked for."""
        return self.n_max * len(self.w_f) * len(self.lam)

    def attributes(self) -> dict[str, Any]:
        """What a reader must know to judge the scan."""
        return {
            "speeds": self.speeds,
            "guesses": self.guesses,
            "segments": self.segments,
            "gamma_max": self.gamma_max,
            "gamma_tolerance": self.tolerance,
            "comment": "Forward Runge-Kutta shots over the bounds of Eq. (35). The resolution holds the final bracket "
            "and what two doublings of the segments tell of the truncation. A pair of roots closer than 1/guesses of "
            "those bounds can be missed: such a transition, and any beyond gamma_max, has status not_found_by_scan.",
        }


# Twenty values a scan of a whole table can afford on each axis.
WHOLE_SCAN = ScanSettings(w_f=np.concatenate([[0.0], _decades(-2, 4, 2)]), lam=_decades(0, 2, 16)[4:], guesses=512)
