"""Folds of systems at random, looked up in a map, and solved directly: how many differ, and what both take.

python -m benchmarks.maps_folds MAP [--systems N] [--seed N]
"""

import argparse
import time
from pathlib import Path

import numpy as np

from towatlas.effort import patience
from towatlas.maps.folds import NotInMap
from towatlas.maps.lookup import Map, open_map
from towatlas.maps.systems import RATIOS
from towatlas.solve.folds import folds_in_speed
from towatlas.system import System


def systems(known: Map, count: int, seed: int) -> list[System]:
    """Systems at random, spread evenly over the axes of a map."""
    data, rng = known.dataset, np.random.default_rng(seed)
    found = []
    for _ in range(count):
        numbers = {
            name.removeprefix("system_"): float(value)
            for name, value in data.attrs.items()
            if name.startswith("system_")
        }
        for name in map(str, data["folds"].dims):
            low, high = data[name].values[[0, -1]]
            log = data[name].attrs["spacing"] == "log"
            numbers[name] = low * (high / low) ** rng.random() if log else rng.uniform(low, high)
        for ratio, (name, of) in RATIOS.items():
            if ratio in numbers:
                numbers[name] = numbers.pop(ratio) * numbers[of]
        found.append(System.of(numbers.pop("lam"), numbers.pop("w_f"), **numbers))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("map", type=Path)
    parser.add_argument("--systems", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    known = open_map(options.map)
    low, high = sorted((float(end) for end in known.dataset.attrs["folds_gamma"]), key=abs)
    rows = []
    with patience(np.inf):
        for system in systems(known, options.systems, options.seed):
            began = time.process_time()
            try:
                looked_up = known.folds(system, low, high)
            except NotInMap as error:
                print(f"{system}: {error}")
                looked_up = None
            between = time.process_time()
            direct = folds_in_speed(system, low, high)
            ended = time.process_time()
            others, off = 0, 0.0
            if looked_up is not None:
                names = ["shapes_below", "shapes_above", *(["n"] if "fold_n" in known.dataset else [])]
                others = int(any(getattr(looked_up, name).tolist() != getattr(direct, name).tolist() for name in names))
            if others:
                print(f"{system}: {looked_up.gamma} ({looked_up.n}), and directly {direct.gamma} ({direct.n})")
            elif looked_up is not None and len(direct):
                off = float(np.abs(looked_up.gamma / direct.gamma - 1.0).max())
            rows.append((len(direct) > 0, looked_up is not None, others, off, between - began, ended - between))
    for name, some in (("without folds", 0), ("with folds", 1)):
        part = np.array([row for row in rows if row[0] == some], float).reshape(-1, 6)
        print(
            f"{len(part)} {name}: {part[:, 1].sum():.0f} told, {part[:, 2].sum():.0f} others, speeds within "
            f"{part[:, 3].max(initial=0.0):.0e}; {part[:, 4].mean():.3f} s a lookup, {part[:, 5].mean():.3f} s directly"
        )


if __name__ == "__main__":
    main()
