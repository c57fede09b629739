"""The figure of critical speeds against cable length."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from towatlas.limits import long_cable, massless_cable, unchecked_excess_length, unchecked_threshold_length
from towatlas.nomenclature import SYMBOLS
from towatlas.tables.atlas import Atlas

# Dark to light, so that they differ in grey too, and told apart by dashes besides (Okabe and Ito's safe colours).
STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#000000", "linestyle": "-"},
    {"color": "#0072B2", "linestyle": (0, (7, 2))},
    {"color": "#D55E00", "linestyle": (0, (4, 1.5, 1, 1.5))},
    {"color": "#E69F00", "linestyle": (0, (1.5, 1.5))},
)
LIMIT: dict[str, Any] = {"color": "0.55", "linewidth": 0.9, "zorder": 1}


def plot_critical(
    atlas: Atlas,
    w_f: tuple[float, ...] = (0.0, 1.0, 100.0, 10000.0),
    orders: tuple[int, ...] = (1, 2, 3),
    ax: Axes | None = None,
) -> list[Line2D]:
    """Critical speeds against cable length for several fish weights, with thresholds and limits.

    Parameters
    ----------
    atlas : Atlas
        Where the speeds come from.
    w_f : tuple of float
        Fish weights [-], four at most.
    orders : tuple of int
        Transitions to draw.
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Line2D
        One curve for each order and weight, orders outermost.

    Raises
    ------
    ValueError
        For more weights than can be told apart.
    """
    if len(w_f) > len(STYLES):
        raise ValueError(f"at most {len(STYLES)} fish weights can be told apart, got {len(w_f)}")
    if ax is None:
        _, ax = plt.subplots(figsize=(7.2, 4.8), layout="constrained")
    ax.set(xscale="log", yscale="log", xlim=(0.9, 1000.0), ylim=(0.02, 40.0))
    curves = []
    for n in orders:
        for weight, style in zip(w_f, STYLES, strict=False):
            excess = np.geomspace(atlas.critical.axes.excess.low, atlas.critical.axes.excess.high, 600)
            lam = unchecked_threshold_length(weight, n) + excess
            inside = lam <= 1000.0
            gamma = atlas.critical_speed(lam[inside], weight, n)
            label = f"{SYMBOLS['w_f'].tex} = {weight:g}" if n == orders[0] else None
            curves += ax.plot(lam[inside], gamma, linewidth=1.7, label=label, **style)
    _draw_limits(ax, orders)
    _label_orders(ax, atlas, orders, w_f)
    ax.set_xlabel(SYMBOLS["lam"].axis)
    ax.set_ylabel(SYMBOLS["gamma"].axis)
    ax.grid(which="major", color="0.9", linewidth=0.6)
    ax.legend(handles=curves[: len(w_f)], title="fish weight", frameon=False, loc="upper right")
    return curves


def _draw_limits(ax: Axes, orders: tuple[int, ...]) -> None:
    """Thresholds without a fish, long cables without a fish, and the massless cable, with a legend of their own."""
    lam = np.geomspace(1.0001, 1000.0, 800)
    handles = []
    for n in orders:
        handles = [
            ax.axvline(
                float(unchecked_threshold_length(0.0, n)),
                **LIMIT,
                linestyle=(0, (1, 2)),
                label="threshold $2n$, no fish",
            )
        ]
        far = lam[unchecked_excess_length(lam=lam, w_f=0.0, n=n) > 6.0 * n]
        chain = np.sqrt(float(long_cable(n)) / far)
        handles += ax.plot(far, chain, **LIMIT, label=r"hanging chain, no fish: $j_{0,n}/(2\sqrt{\lambda})$")
    massless = r"massless cable, $n = 1$: $(\lambda^{2/3} - 1)^{-3/4}$"
    # Above the curve of the heaviest fish, which it all but covers.
    handles += ax.plot(lam, massless_cable(lam), **LIMIT | {"color": "0.1", "zorder": 4}, label=massless)
    ax.add_artist(
        ax.legend(handles=handles, title="limits", loc="lower left", fontsize=8, framealpha=1, edgecolor="none")
    )


def _label_orders(ax: Axes, atlas: Atlas, orders: tuple[int, ...], w_f: tuple[float, ...]) -> None:
    """Name the transitions at the right edge, on the lightest and the heaviest fish."""
    named: list[float] = []
    for weight, style in ((w_f[0], STYLES[0]), (w_f[-1], STYLES[len(w_f) - 1])):
        for n in orders:
            gamma = float(atlas.critical_speed(1000.0, weight, n))
            if all(abs(np.log(gamma / other)) > 0.2 for other in named):
                ax.annotate(
                    f"$n = {n}$", (1000.0, gamma), (4, 0), textcoords="offset points", va="center", color=style["color"]
                )
                named.append(gamma)
