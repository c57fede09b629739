"""Growth rates and boundaries of flutter of random cables, looked up in a table and solved directly.

python -m benchmarks.stability_table ATLAS [--points N] [--boundaries N] [--seed N]
"""

import argparse
from pathlib import Path

import numpy as np
import xarray as xr

import towatlas
from towatlas.builders.grids import StabilityGrid
from towatlas.kernels import status
from towatlas.limits import unchecked_threshold_length
from towatlas.solve.stability import spectrum_of

Array = np.ndarray
# Of the curves in the file; and a distance in speed, relative, at which what grows slowly is told from what does not.
POINT = ("n", "w_f", "lam", "gamma", "error", "turn")
LEAST = 1e-9


def cables(n: int, count: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Lengths, weights and speeds, spread evenly over the axes of the table as `build --stability` makes it."""
    axes = StabilityGrid().axes
    y, x, v = rng.uniform(-1.0, 1.0, (3, count))
    w_f = axes.w_f.value(y)
    lam = unchecked_threshold_length(w_f, n) + axes.excess.value(x)
    return lam, w_f, np.exp(axes.root.value(v) ** 2) * towatlas.solve_critical(lam, w_f, n).gamma


def growth(atlas: towatlas.Atlas, n: int, count: int, rng: np.random.Generator) -> str:
    """What is held of growth and frequency, and how far off, over Omega."""
    lam, w_f, gamma = cables(n, count, rng)
    found = atlas.growth(lam, w_f, gamma, n=n, outside="nan")
    held = np.flatnonzero(found.status == status.OK)
    off, others = np.zeros(len(held)), 0
    for row, k in enumerate(held):
        direct = towatlas.stability(float(lam[k]), float(w_f[k]), float(gamma[k]))
        at = list(direct.equilibria.branch).index(f"{n} inner")
        others += int(found.unstable[k] != direct.unstable[at])
        off[row] = max(abs(found.growth[k] - direct.growth[at]), abs(found.frequency[k] - direct.frequency[at]))
    stated = found.error[held]
    beyond = int((off > stated).sum())
    over = gamma[held]
    return (
        f"n = {n}: of {count} points {len(held)} held, {others} with another number that grows, {beyond} beyond "
        f"what is stated; over Omega off by {_sizes(off / over)}, stated {_sizes(stated / over)}"
    )


def boundaries(atlas: towatlas.Atlas, count: int, rng: np.random.Generator) -> str:
    """How far boundaries of the inner shape of one node are from edges of flutter, relative."""
    off, stated, whole, unlike, alone = [], [], 0, 0, 0
    lam, w_f, _ = cables(1, count, rng)
    for length, weight in zip(lam.tolist(), w_f.tolist(), strict=True):
        found = atlas.flutter(length, weight)
        whole += int(found.status == status.OK)
        for gamma, begins, error in zip(found.gamma, found.begins, found.error, strict=True):
            ends = gamma * (1.0 - 1.2 * error), gamma * (1.0 + 1.2 * error)
            windows = [w for w in towatlas.flutter(length, weight, ends).windows if w.branch == "1 inner"]
            edges = [w.low if begins else w.high for w in windows if (w.low_kind if begins else w.high_kind) == "krein"]
            unlike += not edges
            alone += not edges and found.status == status.OK
            if edges:
                off.append(min(abs(edge / gamma - 1.0) for edge in edges))
                stated.append(error)
    beyond = int((np.array(off) > np.array(stated)).sum())
    return (
        f"n = 1: of {count} cables {whole} have all boundaries held; of {len(off) + unlike} boundaries {unlike} have "
        f"no edge within 1.2 of what is stated, {alone} of them where all are held, {beyond} are beyond that; "
        f"off by {_sizes(off)}, stated {_sizes(stated)}"
    )


def curves(path: Path, count: int, rng: np.random.Generator) -> str:
    """At how many points of curves, off ends and turning points, what grows changes its number within their error."""
    with xr.open_dataset(path, group="support/stability") as group:
        held = {name: group[f"stability_{name}"].values for name in ("row_size", *(f"curve_{part}" for part in POINT))}
    sizes = held["row_size"]
    row, first = np.repeat(np.arange(len(sizes)), sizes), np.cumsum(sizes) - sizes
    places = np.arange(len(row)) - first[row]
    inner = np.flatnonzero((places > 0) & (places < sizes[row] - 1) & (held["curve_turn"] == 0))
    changed, uncounted, chosen = 0, 0, rng.choice(inner, count, replace=False)
    for i in chosen:
        n, w_f = int(held["curve_n"][row[i]]), float(held["curve_w_f"][row[i]])
        lam, gamma = float(held["curve_lam"][i]), float(held["curve_gamma"][i])
        apart, numbers = max(LEAST, float(held["curve_error"][i])), []
        for speed in (gamma * (1.0 - apart), gamma * (1.0 + apart)):
            found = towatlas.equilibria(lam, w_f, speed)
            numbers.append(spectrum_of(found, list(found.branch).index(f"{n} inner")).counted)
        uncounted += -1 in numbers
        changed += -1 not in numbers and numbers[0] != numbers[1]
    return (
        f"of {count} points of {len(sizes)} curves what grows changes its number at {changed} within the error stated, "
        f"or {LEAST:g}; at {uncounted} it was not counted; stated {_sizes(held['curve_error'][chosen])}"
    )


def _sizes(values: list[float] | Array) -> str:
    return f"{np.median(values):.1e} in the median, {np.max(values):.1e} at most"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("atlas", type=Path)
    parser.add_argument("--points", type=int, default=1000)
    parser.add_argument("--boundaries", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    atlas, rng = towatlas.open_atlas(options.atlas), np.random.default_rng(options.seed)
    for n in range(1, 4):
        print(growth(atlas, n, options.points, rng), flush=True)
    print(boundaries(atlas, options.boundaries, rng), flush=True)
    print(curves(options.atlas, options.boundaries, rng), flush=True)


if __name__ == "__main__":
    main()
