"""The figure of how drag closes the jumps."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from towatlas.kernels import status
from towatlas.limits import unchecked_excess_length
from towatlas.nomenclature import DRAG
from towatlas.numerics.curves import Curve
from towatlas.solve.drag_folds import solve_cusps, trace_folds

COLOURS = ("#000000", "#0072B2", "#D55E00", "#E69F00", "#009E73", "#CC79A7")
GAMMA_SHOWN = 12.0
# Drag constant of the report's experiments.
REPORTED = 0.018
# Points of a curve drawn between two of its own.
FINE = 12


def plot_drag_folds(
    lam: float = 37.8, w_f: float = 1352.0, orders: tuple[int, ...] = (1, 2, 3), ax: Axes | None = None
) -> list[Line2D]:
    """Speeds at which pairs of equilibria appear and end against the drag of the cable, up to the cusps.

    Parameters
    ----------
    lam, w_f : float
        The cable [-]; by default that of the report's Fig. 3.
    orders : tuple of int
        Transitions to draw, six at most; those that the cable has.
    ax : Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    list of Line2D
        Two curves for each order drawn, where the pair appears and where it ends.

    Raises
    ------
    ValueError
        If the cable has none of the transitions, or there are too many.
    ArithmeticError
        If a curve of folds cannot be followed.
    """
    n = np.array([k for k in orders if unchecked_excess_length(lam=lam, w_f=w_f, n=k) > 0.0], dtype=np.int64)
    if not 0 < len(n) <= len(COLOURS):
        raise ValueError(f"lam = {lam:g}, w_f = {w_f:g} has none of the transitions {orders}, or there are too many")
    columns: dict[str, Any] = {"lam": np.full(len(n), lam), "w_f": np.full(len(n), w_f)}
    curves, traced = trace_folds(**columns, n=n)
    cusps, codes = solve_cusps(curves, traced, **columns)
    if ax is None:
        _, ax = plt.subplots(figsize=(7.2, 4.8), layout="constrained")
    lines = []
    for order, curve, cusp, code, colour in zip(n, curves, cusps, codes, COLOURS, strict=False):
        if code not in (status.OK, status.NO_CUSP):
            raise ArithmeticError(f"n = {order}: {status.SENTENCES[int(code)]}")
        points, turn = _smooth(curve)
        log_c, log_gamma = points[:, 2], points[:, 1]
        for part, dashes, text in ((slice(None, turn + 1), "-", "appears"), (slice(turn, None), (0, (5, 2)), "ends")):
            label = f"$n = {order}$ {text}"
            lines += ax.plot(
                np.exp(log_c[part]), np.exp(log_gamma[part]), color=colour, linestyle=dashes, linewidth=1.7, label=label
            )
        if code == status.OK:
            ax.plot(np.exp(cusp[2]), np.exp(cusp[1]), "o", color=colour, markersize=5)
            ax.annotate(f"$C^*_{order}$", np.exp(cusp[[2, 1]]), (5, -12), textcoords="offset points", color=colour)
    ax.axvline(REPORTED, color="0.55", linewidth=0.9, linestyle=(0, (1, 2)), zorder=1)
    ax.annotate("air, as in the report", (REPORTED, 0.7), (4, 0), textcoords="offset points", color="0.4", fontsize=8)
    ax.set(xscale="log", yscale="log", xlim=(1e-4, 1.0), ylim=(0.1, GAMMA_SHOWN))
    ax.set_xlabel(DRAG["C"].axis)
    ax.set_ylabel(r"speed of the fold, $\gamma$")
    ax.set_title(rf"$\lambda$ = {lam:g}, $w_f$ = {w_f:g}", fontsize=10)
    ax.grid(which="major", color="0.9", linewidth=0.6)
    ax.legend(frameon=False, loc="center left", fontsize=8)
    return lines


def _smooth(curve: Curve) -> tuple[np.ndarray, int]:
    """A curve on more points, and which of them is the last before its cusp."""
    shares = np.arange(FINE) / FINE
    points = [curve.between(k, share) for k in range(len(curve) - 1) for share in shares]
    last = curve.event()
    return np.array(points), len(points) - 1 if last < 0 else FINE * last + round(FINE * curve.share(last))
