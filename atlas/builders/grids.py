"""Where an atlas is tabulated, and how finely the scan looks."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.tables.drag_series import DragAxes
from towatlas.tables.stability import StabilityAxes

Array = NDArray[np.float64]


def _decades(low: int, high: int, per_decade: int) -> Array:
    return 10.0 ** np.linspace(low, high, (high - low) * per_decade + 1)


@dataclass(frozen=True)
class Grid:
    """Where an atlas is tabulated. The defaults are those of `make atlas`.

    Attributes
    ----------
    n_max : int
        Highest transition, >= 1.
    w_f_max : float
        Heaviest fish of the series [-], > 0.
    excess_min, excess_max : float
        Least and greatest lambda - lambda_cn of the series [-], > 0.
    series_w_f, series_excess : int
        Nodes of the series along each axis, >= 2.
    error_blocks : int
        Blocks of the error along each axis, >= 1.
    w_f, lam : ndarray
        Axes of the plain table [-], rising.
    """

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
    """Where the equilibria are tabulated: more than half a million cables and speeds, two equilibria each.

    Attributes
    ----------
    w_f, lam, gamma : ndarray
        Axes of the table [-], rising.
    """

    w_f: Array = field(default_factory=lambda: np.concatenate([[0.0], _decades(-2, 4, 6)]))
    lam: Array = field(default_factory=lambda: _decades(-1, 2, 32))
    gamma: Array = field(default_factory=lambda: 10.0 ** np.linspace(np.log10(0.05), np.log10(20.0), 141))

    @property
    def size(self) -> int:
        """Number of cables and speeds."""
        return len(self.w_f) * len(self.lam) * len(self.gamma)


@dataclass(frozen=True)
class ScanSettings:
    """How finely `scan` looks.

    Attributes
    ----------
    speeds : int
        Spaced evenly in their logarithm, from just below 1/sqrt(lambda).
    guesses : int
        Of R_x0, over the bounds of Eq. (35).
    segments : int
        Of a forward shot.
    gamma_max : float
        Highest speed [-], > 0.
    n_max : int
        Highest transition, >= 1.
    tolerance : float
        Within which a critical speed is bracketed, relative [-], > 0.
    w_f, lam : ndarray
        The cables [-], rising.
    """

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
        """What a reader must know to judge the scan.

        Returns
        -------
        dict
            Attributes of the group.
        """
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


def _c_grid() -> Array:
    return np.concatenate([[0.0], 10.0 ** np.linspace(-4.0, 1.0, 41)])


@dataclass(frozen=True)
class DragGrid:
    """Where folds with drag are tabulated. The defaults take a few minutes.

    Attributes
    ----------
    n_max : int
        Highest transition, >= 1.
    lam_min, lam_max : float
        Shortest and longest cable [-], > 0.
    w_f_max : float
        Heaviest fish [-], > 0.
    sigma_min : float
        Where the series in the drag end beyond the cusp, and those in the speed begin [-], -1 to 0.
    gamma_max : float
        The highest speed at which the end of a pair is held [-], > 0; no more than curves are followed to.
    stages : tuple of (int, int)
        Nodes in w_f and lambda of the cables traced, and of the series that follow, each predicted by the one before;
        the last is kept.
    series_sigma : int
        Nodes in sigma, none of them next to the cusp at 0.
    series_speed : int
        Nodes in the speed at which a pair ends, up to gamma_max.
    checks : int
        Cables between the nodes for the error.
    traced_checks : int
        How many of those are traced from the vacuum.
    looked : int
        Cables at which all folds are looked for, with a drag each, to see which are not of these pairs.
    error_blocks : int
        Blocks of the error along each axis.
    w_f, lam, C : ndarray
        Axes of the plain tables [-].
    """

    n_max: int = 3
    lam_min: float = 16.0
    lam_max: float = 60.0
    w_f_max: float = 2000.0
    sigma_min: float = -0.5
    gamma_max: float = 50.0
    stages: tuple[tuple[int, int], ...] = ((9, 4), (29, 11))
    series_sigma: int = 15
    series_speed: int = 32
    checks: int = 160
    traced_checks: int = 5
    looked: int = 12
    error_blocks: int = 6
    w_f: Array = field(default_factory=lambda: np.concatenate([[0.0], 10.0 ** np.linspace(-1.0, 3.25, 18)]))
    lam: Array = field(default_factory=lambda: np.geomspace(16.0, 60.0, 14))
    C: Array = field(default_factory=_c_grid)

    @property
    def axes(self) -> DragAxes:
        """The domain of the series."""
        return DragAxes(self.lam_min, self.lam_max, self.w_f_max, self.sigma_min, self.gamma_max)

    @property
    def size(self) -> int:
        """Number of cables to solve."""
        return self.n_max * (sum(w_f * lam for w_f, lam in self.stages) + self.checks)


@dataclass(frozen=True)
class StabilityGrid:
    """Where growth rates and boundaries of flutter are tabulated. The defaults take some minutes.

    Attributes
    ----------
    n_max : int
        Highest pair, >= 1.
    axes : StabilityAxes
        The domain.
    w_f, excess, speed : int
        Nodes on each axis, >= 4.
    curves_every : int
        Whole curves are followed at every so many of the weights, the first among them; >= 1.
    checks : int
        Random points of each n, solved directly, against which the whole is checked.
    """

    n_max: int = 3
    axes: StabilityAxes = field(default_factory=lambda: StabilityAxes(1e-2, 1e2, 1e4, 1.005, 3.0))
    w_f: int = 16
    excess: int = 19
    speed: int = 33
    curves_every: int = 3
    checks: int = 100

    @property
    def size(self) -> int:
        """Number of shapes to solve: nodes, middles of cells, checks."""
        nodes, middles = (np.prod([count - less for count in (self.w_f, self.excess, self.speed)]) for less in (0, 1))
        return self.n_max * int(nodes + middles + self.checks)
