"""The figures of DTMB Report 713 drawn from its Table 2, and the directions in which the cables trail."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from towatlas.report.dtmb713.data import LETTERS, Points, points, table_1
from towatlas.report.dtmb713.directions import all_directions
from towatlas.report.dtmb713.fits import linear, normal_force, side_force, sine_term

Array = NDArray[np.float64]
# Width and height of a figure of eight panels [in].
SIZE = (8.2, 9.6)
POINT: dict[str, Any] = {"marker": "o", "mfc": "white", "mec": "0.15", "markersize": 4.0, "linestyle": "none"}
BLUE, RED = "#1f4e9c", "#c2571a"


def draw_normal(drawing: Figure) -> None:
    """Fig. 3: C_n / sin^2(phi) over phi, with the mean and the standard deviation of a point.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """

    def draw(ax: Axes, data: Points) -> None:
        fit = normal_force(data.cable)
        ax.axhspan(fit.value - fit.sd, fit.value + fit.sd, color=BLUE, alpha=0.13, linewidth=0)
        ax.axhline(fit.value, color=BLUE, linewidth=1.5)
        ax.plot(data.phi_deg, data.ratio, **POINT)
        ax.set(xlim=(0.0, 10.0), ylim=(0.0, 2.7))
        _note(ax, f"$C_r$ = {fit.value:.3f} $\\pm$ {fit.error:.3f}", "lower right")

    _eight(drawing, draw, r"$\phi$ (degrees)", r"$C_n/\sin^2\phi$")


def draw_side(drawing: Figure) -> None:
    """Fig. 4: C_s over sin(phi), with the fit, broken beyond the points, and where it is largest.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """

    def draw(ax: Axes, data: Points) -> None:
        fit, ends = side_force(data.cable), (data.sin_phi.min(), data.sin_phi.max())
        s = np.linspace(0.0, 0.2, 401)
        inside = (s >= ends[0]) & (s <= ends[1])
        ax.plot(s, fit.at(s), color=BLUE, linewidth=1.0, linestyle=(0, (4, 3)))
        ax.plot(s[inside], fit.at(s[inside]), color=BLUE, linewidth=1.8)
        ax.plot(data.sin_phi, data.C_s, **POINT)
        text = f"$a$ = {fit.a:.4f} $\\pm$ {fit.a_error:.4f}\n"
        if np.isfinite(fit.b):
            ax.plot([fit.b], fit.at(np.array([fit.b])), marker="v", color=RED, markersize=6, zorder=4)
            text += f"$b$ = {fit.b:.4f} $\\pm$ {fit.b_error:.4f}"
        else:
            text += "no maximum"
        ax.set(xlim=(0.0, 0.2), ylim=(0.0, 1.35 * max(data.C_s.max(), fit.at(s).max())))
        ax.set_xticks(np.linspace(0.0, 0.2, 5))
        ax.ticklabel_format(axis="y", style="sci", scilimits=(-3, -3), useMathText=True)
        _note(ax, text, "lower right")

    _eight(drawing, draw, r"$\sin\phi$", "$C_s$")


def draw_sine(drawing: Figure) -> None:
    """Fig. 5, for every cable: C_n / sin(phi) over sin(phi), with lines through the origin and not.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """

    def draw(ax: Axes, data: Points) -> None:
        s = np.array([0.0, 0.18])
        y = data.C_n / data.sin_phi
        through, free = float(linear(y, data.sin_phi).values[0]), sine_term(data.cable)
        ax.plot(s, through * s, color=BLUE, linewidth=1.5)
        ax.plot(s, free.values[0] + free.values[1] * s, color=RED, linewidth=1.2, linestyle=(0, (5, 2)))
        ax.plot(data.sin_phi, y, **POINT)
        ax.set(xlim=(0.0, 0.18), ylim=(-0.02, 0.32))
        _note(ax, f"$A$ = {free.values[0]:.4f} $\\pm$ {free.errors[0]:.4f}", "lower right")

    _eight(drawing, draw, r"$\sin\phi$", r"$C_n/\sin\phi$")


def draw_directions(drawing: Figure) -> None:
    """Angles below the stream and to starboard over the speed: measured, by the program, and without side force.

    Parameters
    ----------
    drawing : Figure
        To draw on.
    """
    found = all_directions()

    def draw(ax: Axes, data: Points) -> None:
        mine = found[data.cable]
        order = np.argsort(data.speed)
        speed = data.speed[order]
        for column, colour, marker in ((1, BLUE, "o"), (2, RED, "s")):
            ax.plot(speed, _degrees(mine.by_laws[order, column]), color=colour, linewidth=1.5)
            ax.plot(speed, _degrees(mine.measured[order, column]), **POINT | {"mec": colour, "marker": marker})
        ax.plot(speed, _degrees(mine.without_side[order, 1]), color=BLUE, linewidth=1.0, linestyle=(0, (4, 3)))
        ax.set(xlim=(2.5, 16.5), ylim=(0.0, 11.0))
        _note(ax, f"{mine.rms_deg:.2f} degrees rms", "upper right")

    _eight(drawing, draw, "speed (kn)", "angle (degrees)")


def _degrees(cosine: Array) -> Array:
    return np.degrees(np.arcsin(cosine))


def _note(ax: Axes, text: str, place: str) -> None:
    y, x = place.split()
    across, up = (0.97 if x == "right" else 0.03), (0.96 if y == "upper" else 0.05)
    ax.text(across, up, text, transform=ax.transAxes, ha=x, va="top" if y == "upper" else "bottom", fontsize=9)


def _eight(drawing: Figure, draw: Callable[[Axes, Points], None], x: str, y: str) -> None:
    """A panel for each cable, four rows of two."""
    axes = drawing.subplots(4, 2)
    for letter, ax in zip(LETTERS, np.ravel(axes), strict=True):
        draw(ax, points(letter))
        facts = table_1()[letter]
        ax.set_title(f"{letter}: {facts['diameter_in']} in, {facts['lay']}", fontsize=10)
        ax.tick_params(labelsize=9)
        if letter in LETTERS[-2:]:
            ax.set_xlabel(x)
        if letter in LETTERS[::2]:
            ax.set_ylabel(y)
