"""The figures of NRL Report 7048, drawn from the program. Each function draws on the axes given, or on new ones."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from towatlas.kernels.calls import forward_shots
from towatlas.limits import threshold_length
from towatlas.nomenclature import EQUILIBRIUM, SYMBOLS
from towatlas.plot.critical import LIMIT, STYLES
from towatlas.report.nrl7048.published import SEGMENTS
from towatlas.results import Equilibria
from towatlas.solve.equilibria import equilibria
from towatlas.solve.shapes import shape

Array = NDArray[np.float64]

# Segments of the curves drawn: twice as many move none of them by 1e-4 of its height (tests/test_report.py).
DRAWN_SEGMENTS = 8000
SAMPLES = 1201
# The report's letters for shapes with no, one and two nodes.
LETTERS = "abd"
ROOT: dict[str, Any] = {"marker": "o", "mfc": "white", "mew": 1.2, "markersize": 5.5, "linestyle": "none", "zorder": 5}


@dataclass(frozen=True)
class Cable:
    """A cable at one speed.

    Attributes
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-].
    name : str
        What the report calls its curve; empty for none.
    """

    lam: float
    w_f: float
    gamma: float
    name: str = ""

    @cached_property
    def equilibria(self) -> Equilibria:
        """All equilibria."""
        return equilibria(self.lam, self.w_f, self.gamma)

    @property
    def bounds(self) -> tuple[float, float]:
        """Lower and upper bound of R_x0, Eq. (35)."""
        square, lam, w_f = 0.5 * self.lam**2, self.lam, self.w_f
        return -(square + lam * (w_f - 1.0) - w_f) * self.gamma**2, (square + lam * (w_f + 1.0) + w_f) * self.gamma**2

    def boundary_errors(self, r_x0: Array, segments: int) -> Array:
        """E of Eq. (33) for each R_x0, by fourth-order Runge-Kutta.

        Parameters
        ----------
        r_x0 : ndarray, shape (guesses,)
            Over (mu + rho A) g R [-].
        segments : int
            Of a forward shot.

        Returns
        -------
        ndarray, shape (guesses,)
        """
        rows = len(r_x0)
        cable = (np.full(rows, value) for value in (self.lam, self.w_f, self.gamma))
        errors, x_end, r_x_end = np.empty(rows), np.empty(rows), np.empty(rows)
        forward_shots(*cable, np.ascontiguousarray(r_x0), segments, errors, x_end, r_x_end, 0, rows)
        return errors

    def samples(self) -> Array:
        """R_x0 from bound to bound: evenly spaced, and closer about the roots that share a sliver of the range.

        Returns
        -------
        ndarray, shape (samples,)
        """
        low, high = self.bounds
        inner = self.equilibria.R_x0[1:-1]
        even = np.linspace(low, high, SAMPLES)
        if not len(inner):
            return even
        reach = 1.5 * max(np.ptp(inner), (high - low) / SAMPLES)
        # An even number of them, so that none is a root itself, where the sign of E is rounding.
        close = np.linspace(max(low, inner.min() - reach), min(high, inner.max() + reach), SAMPLES + 1)
        return np.unique(np.concatenate([even, close]))


def root_names(found: Equilibria) -> list[str]:
    """Superscript that the report gives each root: a without nodes, b with one, d with two; left or right of its pair.

    Parameters
    ----------
    found : Equilibria
        Of up to two nodes.

    Returns
    -------
    list of str

    Examples
    --------
    >>> root_names(equilibria(10.0, 0.0, 1.0))
    ['bl', 'br', 'a']
    """
    names = []
    for k, n in enumerate(found.nodes):
        side = "" if n == 0 else "l" if (found.nodes[:k] != n).all() else "r"
        names.append(LETTERS[n] + side)
    return names


FIG_10 = (
    Cable(2.0, 0.0, 39.0, "(a)"),
    # The threshold, rounded as the report prints it.
    Cable(1.05, 10.0, 19.0, "(b)"),
    Cable(1.8, 0.0, 39.0, "(c)"),
)
FIG_11 = Cable(2.0, 0.0, 1.0)
FIG_12 = tuple(Cable(2.1, 0.0, gamma) for gamma in (3.8, 5.0, 6.2))
FIG_14 = tuple(Cable(10.0, 0.0, gamma) for gamma in (0.5, 1.0, 1.5))
FIG_16 = tuple(Cable(37.8, 1352.0, gamma) for gamma in (1.64, 2.97, 5.94))


@dataclass(frozen=True)
class Window:
    """A part of a solution curve drawn larger.

    Attributes
    ----------
    place : tuple of four float
        Where in the axes: left, bottom, width, height, as shares of them.
    r_x0, errors : tuple of two float
        What it shows: R_x0 and E [-], from and to.
    """

    place: tuple[float, float, float, float]
    r_x0: tuple[float, float]
    errors: tuple[float, float]

    def holds(self, r_x0: float) -> bool:
        """Whether it shows a root.

        Parameters
        ----------
        r_x0 : float

        Returns
        -------
        bool
        """
        return self.r_x0[0] < r_x0 < self.r_x0[1]


# In each, the last names the roots that the others leave out.
WINDOWS: dict[int, tuple[Window, ...]] = {
    10: (),
    12: (Window((0.10, 0.12, 0.28, 0.42), (-4.4, 1.2), (-0.85, 0.85)),),
    14: (Window((0.53, 0.56, 0.455, 0.41), (-8.0, 17.0), (-3.2, 3.2)),),
    16: (
        Window((0.60, 0.60, 0.37, 0.36), (-9000.0, 9000.0), (-60000.0, 60000.0)),
        Window((0.08, 0.08, 0.37, 0.36), (-800.0, 1600.0), (-25000.0, 25000.0)),
    ),
}

# Width and height of each figure [in].
SIZES = {
    9: (6.4, 3.4),
    10: (6.8, 4.2),
    11: (6.4, 2.9),
    12: (6.8, 4.6),
    13: (6.8, 2.5),
    14: (6.8, 5.0),
    15: (5.2, 6.2),
    16: (6.8, 5.0),
    17: (5.8, 6.2),
}


def coarse_gap(
    cables: tuple[Cable, ...], windows: tuple[Window, ...], segments: int = SEGMENTS
) -> tuple[float, Cable, float]:
    """How far curves of other segments lie from those drawn, in the axes and in the windows.

    Parameters
    ----------
    cables : tuple of Cable
    windows : tuple of Window
    segments : int
        Of the other curves; the report's 100 by default.

    Returns
    -------
    gap : float
        Greatest distance across the curve, as a share of the height of what it is drawn in.
    cable : Cable
        Where: whose curve.
    r_x0 : float
        And at which R_x0.
    """
    worst = 0.0, cables[0], float("nan")
    curves = [(r_x0, cable.boundary_errors(r_x0, DRAWN_SEGMENTS)) for cable in cables for r_x0 in (cable.samples(),)]
    whole = Window((0.0, 0.0, 1.0, 1.0), _range([r_x0 for r_x0, _ in curves]), _range([errors for _, errors in curves]))
    for cable, (r_x0, errors) in zip(cables, curves, strict=True):
        off = np.abs(cable.boundary_errors(r_x0, segments) - errors)
        slope = np.gradient(errors, r_x0)
        for window in (whole, *windows):
            wide, tall = np.ptp(window.r_x0), np.ptp(window.errors)
            shown = (r_x0 >= window.r_x0[0]) & (r_x0 <= window.r_x0[1])
            shown &= (errors >= window.errors[0]) & (errors <= window.errors[1])
            gap = np.where(shown, off / tall / np.hypot(1.0, slope * wide / tall), 0.0)
            k = int(np.argmax(gap))
            if gap[k] > worst[0]:
                worst = float(gap[k]), cable, float(r_x0[k])
    return worst


def _range(columns: list[Array]) -> tuple[float, float]:
    return float(min(c.min() for c in columns)), float(max(c.max() for c in columns))


def plot_threshold(ax: Axes | None = None) -> list[Artist]:
    """Fig. 9: the threshold length over the weight of the fish.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 9)
    w_f = np.linspace(0.0, 12.0, 481)
    curve = ax.plot(w_f, threshold_length(w_f), **STYLES[0], linewidth=1.7)
    limit = ax.axhline(1.0, **LIMIT, linestyle=(0, (6, 3)))
    weights = np.array([0.0, 10.0])
    marks = ax.plot(weights, threshold_length(weights), **ROOT, mec="k", clip_on=False)
    for weight, offset in zip(weights, ((10, 2), (-12, 12)), strict=True):
        text = rf"$\lambda_c({weight:g})$ = {float(threshold_length(weight)):.4g}"
        ax.annotate(text, (weight, float(threshold_length(weight))), offset, textcoords="offset points")
    ax.text(5.0, 1.55, "shapes with a node are possible", ha="center", color="0.3")
    ax.text(0.25, 1.035, "no node", color="0.3")
    ax.text(11.9, 0.965, r"$\lambda_c \to 1$ for a heavy fish", ha="right", va="center", color="0.3")
    ax.set(xlim=(0.0, 12.0), ylim=(0.93, 2.1))
    ax.set_xlabel(SYMBOLS["w_f"].axis)
    ax.set_ylabel(f"{SYMBOLS['lambda_c'].axis},  $n$ = 1".replace(" of ", "\nof "))
    return [*curve, limit, *marks]


def plot_short_cables(ax: Axes | None = None) -> list[Artist]:
    """Fig. 10: solution curves of cables no longer than the threshold.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 10)
    ax.set_ylim(-7900.0, 550.0)
    curves = _solution_curves(ax, FIG_10, WINDOWS[10])
    ax.legend(loc="lower right", frameon=False)
    return [*curves]


def plot_outward_shape(ax: Axes | None = None) -> list[Artist]:
    """Fig. 11: the shape of a cable of threshold length, without a node.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 11)
    cables = _shapes(ax, FIG_11, ("a",))
    ax.legend(frameon=False)
    ax.set(xlim=(-0.2, 3.2), ylim=(0.95, -0.15), title=_facts(FIG_11, "lam", "w_f", "gamma"))
    return [*cables]


def plot_one_node_curves(ax: Axes | None = None) -> list[Artist]:
    """Fig. 12: solution curves about the first transition of a cable barely longer than the threshold.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 12)
    ax.set_xlim(-100.0, 175.0)
    curves = _solution_curves(ax, FIG_12, WINDOWS[12])
    ax.legend(loc="lower right", frameon=False, title=_facts(FIG_12[0], "lam", "w_f"))
    return [*curves]


def plot_one_node_shapes(ax: Axes | None = None) -> list[Artist]:
    """Fig. 13: both shapes with one node.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 13)
    cables = _shapes(ax, FIG_12[2], ("bl", "br"))
    ax.legend(frameon=False, loc="lower right")
    ax.set(xlim=(-1.25, 1.25), ylim=(0.55, -0.15), title=_facts(FIG_12[2], "lam", "w_f", "gamma"))
    return [*cables]


def plot_two_node_curves(ax: Axes | None = None) -> list[Artist]:
    """Fig. 14: solution curves about the first and the second transition of a long cable.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 14)
    ax.set_ylim(-50.0, 72.0)
    curves = _solution_curves(ax, FIG_14, WINDOWS[14])
    ax.legend(loc="lower left", frameon=False, title=_facts(FIG_14[0], "lam", "w_f"))
    return [*curves]


def plot_two_node_shapes(ax: Axes | None = None) -> list[Artist]:
    """Fig. 15: both shapes with two nodes.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 15)
    cables = _shapes(ax, FIG_14[2], ("dl", "dr"))
    ax.legend(frameon=False, loc="upper right")
    ax.set(xlim=(-2.2, 4.6), ylim=(8.4, -0.6), title=_facts(FIG_14[2], "lam", "w_f", "gamma"))
    return [*cables]


def plot_experiment_curves(ax: Axes | None = None) -> list[Artist]:
    """Fig. 16: solution curves of the cable of the photographs of Fig. 3.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 16)
    curves = _solution_curves(ax, FIG_16, WINDOWS[16])
    ax.legend(loc="upper left", frameon=False, title=_facts(FIG_16[0], "lam", "w_f"))
    return [*curves]


def plot_experiment_shapes(ax: Axes | None = None) -> list[Artist]:
    """Fig. 17: the shapes of the median roots of Fig. 16, side by side.

    Parameters
    ----------
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Artist
        Those that carry data.
    """
    ax = _axes(ax, 17)
    ax.set_axis_off()
    ax.set_title(_facts(FIG_16[0], "lam", "w_f") + "\n\n")
    cables: list[Artist] = []
    for k, cable in enumerate(FIG_16):
        panel = ax.inset_axes((k / 3.0, 0.0, 0.3, 1.0))
        found = cable.equilibria
        line = _shapes(panel, cable, (root_names(found)[found.expected],))
        panel.set(xlim=(-3.4, 5.8), ylim=(39.5, -1.5))
        panel.set_title(f"{_facts(cable, 'gamma')}\n{line[0].get_label()}", fontsize=9)
        if k != 1:
            panel.set_xlabel("")
        if k != 0:
            panel.set(ylabel="", yticklabels=[])
        cables += line
    return cables


def _axes(ax: Axes | None, figure: int) -> Axes:
    return plt.subplots(figsize=SIZES[figure], layout="constrained")[1] if ax is None else ax


def _facts(cable: Cable, *names: str) -> str:
    symbols = {"lam": r"$\lambda$", "w_f": SYMBOLS["w_f"].tex, "gamma": r"$\gamma$"}
    return ",  ".join(f"{symbols[name]} = {getattr(cable, name):g}" for name in names)


def _solution_curves(ax: Axes, cables: tuple[Cable, ...], windows: tuple[Window, ...]) -> list[Line2D]:
    """Curves from bound to bound with their roots, and parts of them enlarged; those in the axes come first."""
    curves: list[Line2D] = []
    ax.axhline(0.0, **LIMIT)
    for cable, style in zip(cables, STYLES, strict=False):
        r_x0 = cable.samples()
        errors = cable.boundary_errors(r_x0, DRAWN_SEGMENTS)
        label = f"{cable.name} {_facts(cable, 'w_f', 'lam', 'gamma')}" if cable.name else _facts(cable, "gamma")
        curves += ax.plot(r_x0, errors, **style, linewidth=1.6, label=label)
        ax.plot(r_x0[[0, -1]], errors[[0, -1]], color=style["color"], marker="|", markersize=9, linestyle="none")
    _mark_roots(ax, cables, windows)
    ax.set_xlabel(EQUILIBRIUM["R_x0"].axis)
    ax.set_ylabel(EQUILIBRIUM["boundary_error"].axis)
    ax.ticklabel_format(style="sci", scilimits=(-3, 5), useMathText=True)
    zoomed: list[Line2D] = []
    for k, window in enumerate(windows):
        inset = ax.inset_axes(window.place)
        inset.axhline(0.0, **LIMIT)
        for curve, style in zip(curves, STYLES, strict=False):
            zoomed += inset.plot(*curve.get_data(), **style, linewidth=1.4)
        _mark_roots(inset, cables, windows[k + 1 :])
        inset.set(xlim=window.r_x0, ylim=window.errors)
        inset.tick_params(labelsize=8)
        inset.ticklabel_format(style="sci", scilimits=(-3, 4), useMathText=True)
        ax.indicate_inset_zoom(inset, edgecolor="0.4")
    return curves + zoomed


def _mark_roots(ax: Axes, cables: tuple[Cable, ...], closer: tuple[Window, ...]) -> None:
    """Roots of every curve, with the names of those that no closer window shows."""
    for cable, style in zip(cables, STYLES, strict=False):
        found = cable.equilibria
        ax.plot(found.R_x0, np.zeros(len(found)), **ROOT, mec=style["color"])
        for k, (r_x0, name) in enumerate(zip(found.R_x0, root_names(found), strict=True)):
            if any(window.holds(r_x0) for window in closer):
                continue
            # Below the axis for the first curve. E rises through every other root from the first on, and the name of
            # another curve goes where that curve does not.
            below, rises = cable is cables[0] and len(found) > 1, k % 2 == 0
            ax.annotate(
                f"$R^{{{name}}}$",
                (r_x0, 0.0),
                (0, -13) if below else (-3 if rises else 3, 4),
                textcoords="offset points",
                ha="center" if below else "right" if rises else "left",
                color=style["color"],
                fontsize=9,
                annotation_clip=True,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.2},
            )


def _shapes(ax: Axes, cable: Cable, names: tuple[str, ...]) -> list[Line2D]:
    """Equilibria of one cable by their names in true proportions, with tow point, fish and nodes."""
    ax.axvline(0.0, **LIMIT, linestyle=(0, (8, 3, 2, 3)))
    found = cable.equilibria
    every = root_names(found)
    lines: list[Line2D] = []
    for name, style in zip(names, STYLES, strict=False):
        k = every.index(name)
        curve = shape(cable.lam, cable.w_f, cable.gamma, root=k)
        label = f"$R_{{x0}}^{{{name}}}$ = ${found.R_x0[k]:.6g}$"
        lines += ax.plot(curve.x, curve.z, **style, linewidth=1.8, label=label)
        ax.plot(curve.x[-1:], curve.z[-1:], marker="o", color=style["color"], markersize=7, zorder=4)
        ax.plot(0.0 * curve.z_node, curve.z_node, **ROOT | {"markersize": 4.5}, mec=style["color"])
    ax.plot([1.0], [0.0], marker="v", color="k", markersize=8, zorder=4)
    ax.set_aspect("equal")
    ax.set_xlabel(EQUILIBRIUM["x"].axis)
    ax.set_ylabel(EQUILIBRIUM["z"].axis.replace(" over ", "\nover "))
    return lines
