"""The charts: error against time, both logarithmic, failures marked."""

from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.timing import LOST, Row

if TYPE_CHECKING:
    from benchmarks.waiting import Wait

FLOOR = 1e-17
OURS = "#c1121f"
# One colour and marker a method, the same in every panel; relatives share a hue.
STYLES = {
    "Taylor, this project": (OURS, "*"),
    "Taylor, other orders": ("#f08080", "o"),
    "RK4 forward (Skop)": ("black", "v"),
    "RK4 fish-up in t": ("#0b3c8c", "s"),
    "RK4 fish-up in sqrt(t)": ("#2f7ed8", "D"),
    "RK4 fish-up in sigma": ("#74b3f0", "^"),
    "order 8, fixed": ("#b08968", "P"),
    "order 8, adaptive": ("#6f4518", "X"),
    "SciPy DOP853": ("#e07a00", ">"),
    "SciPy LSODA": ("#f4b942", "<"),
    "CyRK DOP853": ("#d81b60", "p"),
    "heyoka in t, scalar": ("#8fd19e", "h"),
    "heyoka in t, batch of 8": ("#1b7f3b", "H"),
    "heyoka in sigma, scalar": ("#b9a0dc", "h"),
    "heyoka in sigma, scalar, event": ("#c77dff", "d"),
    "heyoka in sigma, batch of 8": ("#5e3c99", "H"),
    "direct, table": (OURS, "*"),
    "direct, one by one": (OURS, "*"),
    "lookup from the atlas": (OURS, "*"),
    "Skop's scan": ("black", "v"),
    "SciPy solve_ivp + root": ("#1b7f3b", "s"),
    "SciPy solve_bvp": ("#e07a00", "D"),
    "this project": (OURS, "*"),
    "equilibria_many": (OURS, "*"),
    "equilibria, one a call": (OURS, "*"),
    "SciPy up from the fish": ("#1b7f3b", "s"),
    "SciPy down from the tow": ("black", "v"),
    "MoorDyn": ("#2f7ed8", "^"),
    "solve_drag_folds, many": (OURS, "*"),
    "solve_drag_folds, one a call": (OURS, "*"),
    "Newton, the guesses of the peers": (OURS, "*"),
    "folds": (OURS, "*"),
    "stability": (OURS, "*"),
    "order 20, shorter steps": ("#f08080", "o"),
    "Galerkin, panels of 5": ("#1b7f3b", "s"),
    "Galerkin, panels of 2.5": ("#8fd19e", "D"),
    "Galerkin, one panel": ("#5e3c99", "H"),
    "Evans, SciPy DOP853": ("#e07a00", ">"),
    "Evans, SciPy LSODA": ("#f4b942", "<"),
    "Evans, RK4": ("black", "v"),
    "finite differences, eigs": ("#2f7ed8", "^"),
    "chain of links": ("#6f4518", "X"),
    "counts of shapes": ("#6f4518", "X"),
    "RegularGridInterpolator linear": ("#2f7ed8", "s"),
    "RegularGridInterpolator cubic": ("#0b3c8c", "D"),
    "RectBivariateSpline": ("#1b7f3b", "^"),
    "xarray.interp linear": ("#e07a00", "v"),
}
plt.rcParams |= {"svg.hashsalt": "towatlas", "font.size": 9, "axes.spines.top": False, "axes.spines.right": False}


def _lines(rows: list[Row]) -> dict[str, list[Row]]:
    lines: dict[str, list[Row]] = {}
    for row in rows:
        lines.setdefault(row.method, []).append(row)
    return lines


def panel(axes: Axes, rows: list[Row], name: str) -> None:
    """Errors against time, one line a method through its 99th percentiles in the order of its settings."""
    for method, line in _lines([row for row in rows if name in row.errors]).items():
        colour, marker = STYLES[method]
        mine = marker == "*"
        time = np.array([row.microseconds for row in line])
        median, high, worst = (
            np.maximum([row.quantile(name, share) for row in line], FLOOR) for share in (0.5, 0.99, 1.0)
        )
        size = 12 if mine else 5.5
        style = {"color": colour, "zorder": 5 if mine else 2}
        axes.plot(time, high, "-", lw=1.2, marker=marker, ms=size, label=method, mec="white", mew=0.5, **style)
        axes.vlines(time, median, worst, lw=0.8, alpha=0.6, **style)
        axes.plot(time, median, "_", ms=7, **style)
        lost = np.array([row.failure_rate > 0.0 for row in line])
        axes.plot(time[lost], high[lost], "o", ms=size + 6, mfc="none", mec="black", mew=0.9, zorder=6)
    axes.set(xscale="log", yscale="log")
    axes.axhspan(LOST, 1e30, color="0.93", zorder=0, lw=0)
    axes.grid(True, which="major", lw=0.4, color="0.85")
    axes.set_axisbelow(True)


def _finish(figure: Figure, path: Path) -> None:
    for suffix, extra in ((".svg", {"metadata": {"Date": None}}), (".png", {"dpi": 130})):
        figure.savefig(path.with_suffix(suffix), bbox_inches="tight", **extra)  # type: ignore[arg-type]
    plt.close(figure)


KEY = (
    "Symbol: 99th percentile; bar: median to largest. Ringed: some answers lost, "
    f"none or off by more than {LOST:g} (grey). Below and left is better."
)


def shots(rows: list[Row], path: Path) -> None:
    """First chart."""
    figure, both = plt.subplots(1, 2, figsize=(12.5, 6.2), sharey=True, sharex=True)
    for axes, name, title in zip(
        both, ("p", "q"), ("Error of the offset p", "Error of its derivative q = dp/da"), strict=True
    ):
        panel(axes, rows, name)
        axes.set_title(title, loc="left")
        axes.set_xlabel("time per shot, with derivative [us], one thread")
    both[0].set_ylim(FLOOR * 3, 1e4)
    both[0].set_ylabel("error over the local amplitude [-]")
    handles, labels = both[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="center left", bbox_to_anchor=(0.91, 0.5), frameon=False)
    figure.text(0.125, 0.0, KEY + " RK4 forward has no derivative.", fontsize=8.5)
    _finish(figure, path)


def folds(rows: list[Row], path: Path) -> None:
    """Second chart."""
    figure, axes = plt.subplots(figsize=(8.5, 5.6))
    panel(axes, rows, "gamma")
    axes.set(xlabel="time per critical speed [us], one thread", ylabel="relative error of gamma_cn [-]")
    axes.set_ylim(FLOOR * 3, 1e2)
    marks = {
        "direct, table": ("direct,\ntable of 4000", (-6, 9), "center"),
        "direct, one by one": ("direct,\none a call", (6, 9), "center"),
        "lookup from the atlas": ("lookup\nfrom the atlas", (0, 9), "center"),
    }
    # Where the share of lost answers stands: beside the symbols of its method that the others leave free.
    sides = {"Skop's scan": ((0, -19), "center"), "SciPy solve_ivp + root": ((-10, -3), "right")}
    _labelled(axes, rows, "gamma", marks, sides)
    axes.set_title("Critical speeds from cold, over the whole domain of the atlas", loc="left")
    figure.text(0.1, -0.02, KEY, fontsize=8)
    _finish(figure, path)


def _labelled(
    axes: Axes, rows: list[Row], name: str, marks: dict[str, tuple], sides: dict, legend: str = "lower right"
) -> None:
    """Our symbols named beside them, the others in a legend, with the share of answers lost beside theirs."""
    colours = {line.get_label(): line.get_color() for line in axes.get_lines()}
    named: set[str] = set()
    for row in rows:
        place = (row.microseconds, max(row.quantile(name, 0.99), FLOOR))
        if row.method in named:
            continue
        if row.method in marks:
            named.add(row.method)
            text, offset, side = marks[row.method]
            text += f", {row.failure_rate:.0%} lost" if row.failure_rate > 0.0 else ""
            axes.annotate(text, place, offset, textcoords="offset points", color=OURS, ha=side, fontsize=8.5)
        elif row.failure_rate > 0.0:
            offset, side = sides.get((row.method, row.setting), sides.get(row.method, ((10, -3), "left")))
            text = f"{row.failure_rate:.0%} lost"
            axes.annotate(
                text, place, offset, textcoords="offset points", fontsize=8, ha=side, color=colours[row.method]
            )
    low, high = axes.get_xlim()
    axes.set_xlim(low / 3.0, high * 3.0)
    handles, labels = axes.get_legend_handles_labels()
    kept = [(h, text) for h, text in zip(handles, labels, strict=True) if text not in marks]
    axes.legend(*zip(*kept, strict=True), loc=legend, frameon=False)


def drag_equilibria(rows: list[Row], path: Path) -> None:
    """Equilibria with drag."""
    figure, axes = plt.subplots(figsize=(8.5, 5.6))
    panel(axes, rows, "r_f")
    axes.set(xlabel="time per system [us], one thread", ylabel="relative error of r_f [-]")
    axes.set_ylim(FLOOR, 1e1)
    marks = {
        "equilibria_many": ("many at once", (2, 9), "right"),
        "equilibria, one a call": ("one a call", (-2, 9), "left"),
    }
    fish, tow = "SciPy up from the fish", "SciPy down from the tow"
    sides = {
        "SciPy solve_bvp": ((-10, -8), "right"),
        (fish, "rtol 1e-10, 60 radii"): ((8, -12), "left"),
        (fish, "rtol 1e-07, 240 radii"): ((-9, 3), "right"),
        (fish, "rtol 1e-07, 960 radii"): ((10, -8), "left"),
        (tow, "rtol 0.0001, 12 guesses"): ((0, 11), "center"),
        (tow, "rtol 1e-07, 12 guesses"): ((3, 10), "left"),
        (tow, "rtol 1e-10, 12 guesses"): ((8, -12), "left"),
        (tow, "rtol 1e-07, 48 guesses"): ((0, 11), "center"),
    }
    _labelled(axes, rows, "r_f", marks, sides)
    axes.set_title("All equilibria of random systems in air and in water", loc="left")
    figure.text(0.1, -0.02, KEY, fontsize=8)
    _finish(figure, path)


def drag_folds(pairs: list[Row], octaves: list[Row], path: Path) -> None:
    """Folds with drag: one, and all within an octave of speed."""
    figure, both = plt.subplots(1, 2, figsize=(12.5, 5.4), sharey=True)
    marks = {
        "solve_drag_folds, many": ("whole curve,\nmany", (0, 9), "center"),
        "solve_drag_folds, one a call": ("whole curve,\none a call", (0, 9), "center"),
        "Newton, the guesses of the peers": ("Newton", (0, 12), "center"),
        "folds": ("folds", (0, 9), "center"),
    }
    sides = {
        "SciPy solve_bvp": ((-10, -8), "right"),
        ("SciPy solve_bvp", "tol 1e-09"): ((10, -3), "left"),
        ("SciPy solve_ivp + root", "rtol 1e-10"): ((-10, -10), "right"),
        "counts of shapes": ((0, 11), "center"),
    }
    titles = "A pair appears, with drag", "All folds within an octave of speed, with drag"
    units = "time per fold [us], one thread", "time per octave [us], one thread"
    for axes, rows, title, unit in zip(both, (pairs, octaves), titles, units, strict=True):
        panel(axes, rows, "gamma")
        axes.set_xlabel(unit)
        axes.set_title(title, loc="left")
        _labelled(axes, rows, "gamma", marks, sides, "upper right")
    both[0].set_ylim(FLOOR, 1e1)
    both[0].set_ylabel("relative error of gamma [-]")
    figure.text(0.1, -0.03, KEY, fontsize=8.5)
    _finish(figure, path)


def stability(rows: list[Row], path: Path) -> None:
    """Growth rates."""
    figure, axes = plt.subplots(figsize=(9.0, 5.8))
    panel(axes, rows, "sigma")
    axes.set(xlabel="time per eigenvalue [us], one thread", ylabel="error of the leading eigenvalue over gamma [-]")
    axes.set_ylim(FLOOR, 1e1)
    marks = {"stability": ("stability", (-2, 9), "right")}
    sides = {"Galerkin, one panel": ((0, 11), "center"), "finite differences, eigs": ((-6, -16), "center")}
    _labelled(axes, rows, "sigma", marks, sides, "lower center")
    axes.set_title("The leading growth rate of five shapes, from a guess that is off by 0.1 %", loc="left")
    figure.text(0.1, -0.02, KEY, fontsize=8)
    _finish(figure, path)


def lookup(rows: list[Row], path: Path) -> None:
    """Third chart."""
    figure, both = plt.subplots(1, 2, figsize=(12, 5), sharey=True)
    for axes, one in zip(both, (False, True), strict=True):
        part = [row for row in rows if (row.setting == "one point") == one]
        panel(axes, part, "gamma")
        axes.set_xlabel("time per point [us]")
        axes.set_title("one point a call" if one else f"{part[0].setting} a call", loc="left")
        low, high = (np.log10(f([row.microseconds for row in part])) for f in (min, max))
        # Whole decades: within one, labels of parts of it lie on each other.
        axes.set_xlim(10.0 ** np.floor(low - 0.2), 10.0 ** np.ceil(high + 0.2))
    both[0].set_ylim(FLOOR * 3, 1.0)
    both[0].set_ylabel("relative error of gamma_c1 [-]")
    handles, labels = both[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="center left", bbox_to_anchor=(0.91, 0.5), frameon=False)
    figure.text(0.125, -0.03, KEY + " The same 96 x 112 nodes for all.", fontsize=8.5)
    _finish(figure, path)


def waiting(rows: list[tuple["Wait", "Wait | None"]], path: Path) -> None:
    """What a user waits for whole commands: from what it was, where known, to what it is."""
    figure, axes = plt.subplots(figsize=(8.5, 0.42 * len(rows) + 1.3))
    looks = {"cold": ("nothing compiled", OURS, 0.16), "warm": ("afterwards", "#2f7ed8", -0.16)}
    for kind, (label, colour, up) in looks.items():
        for k, (now, before) in enumerate(rows):
            there, value = len(rows) - 1 - k + up, getattr(now, kind)
            was = getattr(before, kind) if before else np.nan
            if np.isfinite(was):
                axes.plot([was, value], [there, there], "-", color=colour, lw=1.4, alpha=0.45, zorder=2)
                axes.plot(was, there, "o", mfc="white", mec=colour, ms=6, label=f"{label}, before" if not k else None)
            axes.plot(value, there, "o", color=colour, ms=6, label=f"{label}, now" if not k else None)
    axes.set_yticks(range(len(rows)), [now.command for now, _ in reversed(rows)])
    axes.set(xscale="log", xlabel="CPU time of the whole command [s]", ylim=(-0.7, len(rows) - 0.3))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.grid(True, axis="x", which="major", lw=0.4, color="0.85")
    axes.set_axisbelow(True)
    axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=4, frameon=False, handletextpad=0.1)
    _finish(figure, path)
