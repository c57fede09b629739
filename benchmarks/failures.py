"""`python -m benchmarks.failures`: map where the report's procedure stops being trustworthy; figure, CSV, table.

The procedure of NRL Report 7048: forward Runge-Kutta shots of 100 segments at 200 guesses of R_x0, spaced evenly over
the bounds of Eq. (35); every sign change of E refined by bisection. The truth it is held against is complete by the
count of zeros of the variation, and within 1e-12.
"""

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import towatlas
from towatlas.kernels import status
from towatlas.kernels.sweeps import forward_shots_parallel
from towatlas.report.nrl7048.published import compare
from towatlas.solve.members import shoot_lanes, solve_members

DOCS = Path(__file__).parent.parent / "docs"
SEGMENTS, GUESSES = 100, 200
WEIGHTS = (0.0, 1.0, 100.0, 1352.0)
LAM = np.geomspace(1.05, 100.0, 44)
GAMMA = np.geomspace(0.1, 20.0, 36)
BISECTIONS = 50
# A root farther than this from every equilibrium, as a share of the tow tension, answers to none of them.
NEAR = 0.01
ORDERS = (1, 2, 3, 5, 10, 20, 40)  # of the critical speeds drawn
COLUMNS = ("w_f", "lam", "gamma", "equilibria", "found", "false_roots", "largest_error", "median_root_error")


@dataclass(frozen=True)
class Cell:
    """One cable at one speed.

    equilibria : number of them. found : how many the procedure found. false_roots : its roots that answer to no
    equilibrium. largest_error : of those found, |R_x0 - exact| over the tow tension; nan where none was found.
    median_root_error : the same for its median root, held against the true one, found or not; nan where it has none.
    """

    w_f: float
    lam: float
    gamma: float
    equilibria: int
    found: int
    false_roots: int
    largest_error: float
    median_root_error: float


def true_roots(w_f: float, lam: np.ndarray, gamma: np.ndarray) -> list[np.ndarray]:
    """R_x0 of all equilibria of each cable, in rising order."""
    order = int(np.ceil(lam.max() / 2)) + 1
    folds = towatlas.solve_critical(lam[:, None], w_f, np.arange(1, order + 1)).gamma
    passed = (gamma[:, None] > folds).sum(axis=1)
    rows = np.repeat(np.arange(len(lam)), 1 + 2 * passed)
    place = np.concatenate([np.arange(1 + 2 * k) for k in passed])
    n, outer = (place + 1) // 2, place % 2 == 1
    found = solve_members(
        lam=lam[rows], w_f=np.full(len(rows), w_f), gamma=gamma[rows], n=n, outer=outer, shoot=shoot_lanes
    )
    if (found.status != status.OK).any():
        raise ArithmeticError(f"w_f = {w_f:g}: {(found.status != status.OK).sum()} equilibria were not computed")
    return [np.sort(part) for part in np.split(found.R_x0, np.cumsum(1 + 2 * passed)[:-1])]


def boundary_errors(w_f: float, lam: np.ndarray, gamma: np.ndarray, r_x0: np.ndarray) -> np.ndarray:
    """E of Eq. (33) of forward shots of 100 segments, one a row."""
    rows = len(lam)
    errors, x_end, r_x_end = np.empty(rows), np.empty(rows), np.empty(rows)
    forward_shots_parallel(lam, np.full(rows, w_f), gamma, r_x0, SEGMENTS, errors, x_end, r_x_end)
    return errors


def scanned_roots(w_f: float, lam: np.ndarray, gamma: np.ndarray) -> list[np.ndarray]:
    """R_x0 of every sign change of E that the procedure sees, for each cable, in rising order."""
    low = -(gamma**2) * (lam**2 / 2 + lam * (w_f - 1) - w_f)
    high = gamma**2 * (lam**2 / 2 + lam * (w_f + 1) + w_f)
    guesses = np.linspace(low, high, GUESSES, axis=1)
    wide = np.repeat(lam, GUESSES), np.repeat(gamma, GUESSES)
    positive = boundary_errors(w_f, *wide, guesses.ravel()).reshape(guesses.shape) > 0
    rows, before = np.nonzero(positive[:, 1:] != positive[:, :-1])
    left, right, sign = guesses[rows, before], guesses[rows, before + 1], positive[rows, before]
    for _ in range(BISECTIONS):
        middle = 0.5 * (left + right)
        same = (boundary_errors(w_f, lam[rows], gamma[rows], middle) > 0) == sign
        left, right = np.where(same, middle, left), np.where(same, right, middle)
    return np.split(0.5 * (left + right), np.searchsorted(rows, np.arange(1, len(lam))))


def judge(w_f: float, lam: float, gamma: float, true: np.ndarray, scanned: np.ndarray) -> Cell:
    """Pair each root with the nearest equilibrium at which E changes sign the same way.

    Of several roots at one equilibrium the nearest counts, the others are false.
    """
    distance = np.abs(scanned[:, None] - true) / np.hypot(w_f + lam, true)
    # E rises from below the bounds to above them: along either row its slope alternates, rising first.
    distance[(np.arange(len(scanned))[:, None] - np.arange(len(true))) % 2 == 1] = np.inf
    nearest = distance.argmin(axis=1)
    error = distance.min(axis=1)
    best = np.full(len(true), np.inf)
    np.minimum.at(best, nearest[error <= NEAR], error[error <= NEAR])
    found = int(np.isfinite(best).sum())
    middle = len(true) // 2
    off = abs(scanned[len(scanned) // 2] - true[middle]) / np.hypot(w_f + lam, true[middle]) if len(scanned) else np.nan
    return Cell(
        w_f=w_f,
        lam=float(lam),
        gamma=float(gamma),
        equilibria=len(true),
        found=found,
        false_roots=len(scanned) - found,
        largest_error=float(best[np.isfinite(best)].max()) if found else float("nan"),
        median_root_error=float(off),
    )


def failure_map(w_f: float, lam: np.ndarray, gamma: np.ndarray) -> list[Cell]:
    """The procedure against the truth on the grid of lam (slowest) and gamma."""
    flat_lam, flat_gamma = (axis.ravel() for axis in np.meshgrid(lam, gamma, indexing="ij"))
    true, scanned = true_roots(w_f, flat_lam, flat_gamma), scanned_roots(w_f, flat_lam, flat_gamma)
    return [judge(w_f, *row) for row in zip(flat_lam, flat_gamma, true, scanned, strict=True)]


def summary(maps: dict[float, list[Cell]]) -> str:
    """Markdown table, one row a fish weight."""
    lines = [
        "| w_f | equilibria | found | grid points with all of them | false roots | median root off by more than 1 % "
        "| largest error of those found: median, 90 % |",
        "|---|---|---|---|---|---|---|",
    ]
    for w_f, cells in maps.items():
        total, found = sum(c.equilibria for c in cells), sum(c.found for c in cells)
        whole = np.mean([c.found == c.equilibria for c in cells])
        wrong = np.mean([not c.median_root_error <= 0.01 for c in cells])
        middle, most = np.nanquantile([c.largest_error for c in cells], [0.5, 0.9])
        lines.append(
            f"| {w_f:g} | {total} | {found} ({found / total:.0%}) | {whole:.0%} | "
            f"{sum(c.false_roots for c in cells)} | {wrong:.0%} | {middle:.0e}, {most:.0e} |"
        )
    return "\n".join(lines) + "\n"


def write_csv(maps: dict[float, list[Cell]], path: Path) -> None:
    """All cells, with the settings in lines that begin with #."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        file.write(
            f"# NRL Report 7048: forward Runge-Kutta, {SEGMENTS} segments; {GUESSES} guesses of R_x0 over Eq. (35); "
            f"bisection.\n# A root counts as found within {NEAR:g} of the tow tension of an equilibrium. Errors: "
            "|R_x0 - exact| over the tow tension.\n# Written by python -m benchmarks.failures\n"
        )
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for cells in maps.values():
            writer.writerows([_short(getattr(cell, name)) for name in COLUMNS] for cell in cells)


def _short(value: float) -> str:
    return f"{value:.6g}"


def draw(maps: dict[float, list[Cell]], lam: np.ndarray, gamma: np.ndarray, paths: list[Path]) -> None:
    """One column a fish weight: fraction found, error of those found, false roots; critical speeds drawn over them."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.colors import BoundaryNorm, LogNorm, Normalize

    # Dark is bad in every row. Errors of less than the scale's are drawn as its end, 0 among them.
    rows: list[tuple[str, Callable[[Cell], float], str, Normalize, str]] = [
        ("fraction of the\nequilibria found", lambda c: c.found / c.equilibria, "viridis", Normalize(0, 1), "neither"),
        (
            "largest error of those found\n|R$_{x0}$ - exact| / tow tension",
            lambda c: max(c.largest_error, 1e-12),
            "cividis_r",
            LogNorm(1e-10, NEAR),
            "min",
        ),
        (
            f"roots more than {NEAR:.0%}\nfrom every equilibrium",
            lambda c: c.false_roots,
            "magma_r",
            BoundaryNorm([0, 1, 2, 4, 8, 16], 256, extend="max"),
            "max",
        ),
    ]
    with plt.rc_context({"svg.hashsalt": "towatlas"}):
        size = (2.6 * len(maps) + 1.4, 7.6)
        figure, axes = plt.subplots(len(rows), len(maps), figsize=size, sharex=True, sharey=True, layout="constrained")
        for column, (w_f, cells) in enumerate(maps.items()):
            for ax, (_, value, colours, norm, _) in zip(axes[:, column], rows, strict=True):
                values = np.array([value(cell) for cell in cells], float).reshape(len(lam), len(gamma))
                ax.set_facecolor("0.75")
                ax.pcolormesh(lam, gamma, values.T, cmap=colours, norm=norm, shading="nearest", rasterized=True)
                _draw_critical_speeds(ax, w_f, lam, gamma, numbered=ax is axes[0, column])
            axes[0, column].set_title(f"$w_f$ = {w_f:g}")
            axes[-1, column].set_xlabel(r"cable length $\lambda$ = L / R")
        for line, (label, _, colours, norm, extend) in enumerate(rows):
            axes[line, 0].set_ylabel(r"speed $\gamma = \Omega\sqrt{R/g}$")
            scale = plt.cm.ScalarMappable(norm=norm, cmap=colours)
            figure.colorbar(scale, ax=axes[line, :], extend=extend, pad=0.01, aspect=14, label=label)
        figure.suptitle(
            f"Skop's procedure ({GUESSES} guesses, {SEGMENTS} Runge-Kutta segments): bright is right, dark is wrong\n"
            "curves: critical speeds $\\gamma_{cn}$, numbered by n; beyond each there are two more equilibria to find"
        )
        for path in paths:
            figure.savefig(path, dpi=110, metadata={"Date": None} if path.suffix == ".svg" else None)
        plt.close(figure)


def _draw_critical_speeds(ax: Any, w_f: float, lam: np.ndarray, gamma: np.ndarray, numbered: bool) -> None:
    from matplotlib.patheffects import withStroke

    for n in ORDERS:
        curve_lam = towatlas.threshold_length(w_f, n) + np.geomspace(1e-3, lam[-1], 70)
        curve = towatlas.solve_critical(curve_lam, w_f, n).gamma
        drawn = (curve < 2 * gamma[-1]) & (curve > gamma[0] / 2) & (curve_lam < 1.3 * lam[-1])
        curve_lam, curve = curve_lam[drawn], curve[drawn]
        outline = [withStroke(linewidth=2.2, foreground="white", alpha=0.6)]
        ax.plot(curve_lam, curve, color="black", linewidth=0.7, path_effects=outline)
        inside = np.flatnonzero((curve < 12.0) & (curve_lam > 1.2 * lam[0]) & (curve_lam < 0.9 * lam[-1]))
        if numbered and len(inside):
            place = curve_lam[inside[0]], curve[inside[0]]
            box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
            ax.text(*place, str(n), fontsize=7, ha="center", va="center", bbox=box, clip_on=True)
    ax.set(xscale="log", yscale="log", xlim=(lam[0], lam[-1]), ylim=(gamma[0], gamma[-1]))
    ax.minorticks_off()


def published_table() -> str:
    """Markdown: every number of the report beside the recomputed one."""
    lines = ["| quantity | where | printed | recomputed | explained by | explanation |", "|---|---|---|---|---|---|"]
    for row in compare():
        p = row.published
        printed, recomputed, then = row.text()
        by = f"{then} ({p.method})" if p.method else ""
        lines.append(f"| {p.quantity} | {p.place} | {printed} | {recomputed} | {by} | {p.explanation} |")
    return "\n".join(lines) + "\n"


def put(page: str, name: str, text: str) -> str:
    """A page with the text between its two marks replaced."""
    begin, end = f"<!-- {name}: written by python -m benchmarks.failures -->\n", f"<!-- end of {name} -->"
    before, rest = page.split(begin)
    return before + begin + text + end + rest.split(end)[1]


def main() -> None:
    """Compute the maps; write docs/failures.svg and .png, docs/data/failures.csv and the tables of docs/failures.md."""
    maps = {w_f: failure_map(w_f, LAM, GAMMA) for w_f in WEIGHTS}
    write_csv(maps, DOCS / "data" / "failures.csv")
    draw(maps, LAM, GAMMA, [DOCS / "failures.svg", DOCS / "failures.png"])
    page = DOCS / "failures.md"
    page.write_text(put(put(page.read_text(), "summary", summary(maps)), "published", published_table()))
    print(summary(maps))


if __name__ == "__main__":
    main()
