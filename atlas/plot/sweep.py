"""The figure of a sweep: depth, radius, tension and phase over length or speed, with every branch and the jumps."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

if TYPE_CHECKING:
    import xarray

PANELS = (
    ("depth", "depth (m)"),
    ("r_f", "radius of the fish (m)"),
    ("tension", "tow tension (N)"),
    ("phase_deg", "phase (degrees)"),
)
COLOURS = ("#1f4e9c", "#c2571a", "#2a7f4f", "#7a3e9d", "#a61e3c", "#4d4d4d")
# Ranges of what is swept, and of what is drawn, beyond which the scale is logarithmic.
WIDE, FAR = 10.0, 100.0


def plot_sweep(found: "xarray.Dataset", name: str, axes: Any) -> list[Line2D]:
    """Curves over what is swept; expected shapes solid, others dashed, jumps dotted.

    Parameters
    ----------
    found : xarray.Dataset
        From `towatlas.sweep`.
    name : {"length", "speed"}
        What is swept.
    axes : ndarray of Axes, shape (4,)
        To draw on, one above the other.

    Returns
    -------
    list of Line2D
        Those of the first panel.
    """
    values, lines = found[name].values, []
    labels = [str(label) for label in found.member.values] if "member" in found.coords else [""] * found.sizes["member"]
    panels: list[Axes] = list(np.ravel(axes))
    for k in range(len(labels)):
        colour = COLOURS[k % len(COLOURS)]
        branch, expected = found.branch.values[k], found.expected.values[k].astype(bool)
        for panel, (field, _) in zip(panels, PANELS, strict=True):
            data = found[field].values[k]
            for number in np.unique(branch[branch >= 0]):
                row, place = np.nonzero(branch == number)
                column = data[row, place]
                # Dashed all along, and solid on top where it is the one expected.
                lines += panel.plot(values[row], column, color=colour, linestyle=(0, (4, 2)), linewidth=1.0)
                solid = np.where(expected[row, place], column, np.nan)
                lines += panel.plot(values[row], solid, color=colour, linewidth=1.8)
            for jump in found.jump.values[k][np.isfinite(found.jump.values[k])]:
                panel.axvline(jump, color=colour, linestyle=":", linewidth=0.9, zorder=0)
    unit = {"length": "m", "speed": "m/s"}[name]
    for panel, (field, text) in zip(panels, PANELS, strict=True):
        panel.set_ylabel(text)
        panel.grid(color="0.9", linewidth=0.6)
        if values[-1] > WIDE * values[0]:
            panel.set_xscale("log")
        known = found[field].values[np.isfinite(found[field].values)]
        if field == "depth":
            panel.invert_yaxis()
        elif field != "phase_deg" and known.min() > 0.0 and known.max() > FAR * known.min():
            panel.set_yscale("log")
        if panel is not panels[-1]:
            panel.tick_params(labelbottom=False)
    panels[-1].set_xlabel(f"{name} ({unit})")
    handles = [Line2D([], [], color=COLOURS[k % len(COLOURS)], label=label) for k, label in enumerate(labels) if label]
    handles += [
        Line2D([], [], color="0.3", label="expected"),
        Line2D([], [], color="0.3", linestyle=(0, (4, 2)), label="other shapes"),
        Line2D([], [], color="0.3", linestyle=":", label="jump"),
    ]
    panels[0].legend(
        handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.02), ncols=3, frameon=False, fontsize=8
    )
    return lines
