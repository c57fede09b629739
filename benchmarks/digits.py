"""How many digits the reference files truly have: `python -m benchmarks.digits [rows] [file ...]`.

Computes the answers of docs/data/reference_folds.csv and reference_shots.csv anew in 66 digits of mpmath, with Taylor
series of another order and other steps, and prints in how many digits the files agree. All rows take half an hour.
Those of reference_drag_pairs.csv, reference_drag_octaves.csv and tests/data/any_medium.csv at random, in long double:
the folds with other steps and extrema from other shots than those that the files were made with, the shapes by the long
double shots of tests/reference_drag.py, which the program of the file shares nothing with. A fold takes a minute.
"""

import sys
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks import samples_drag
from benchmarks.samples import DATA, FOLDS, ROOT, SHOTS, cables, columns, exact_folds, exact_shots, shots_of_file

CHECK = 66
SEED = 5
# Extrapolations of the midpoint rule have fewer columns, the straight tip is shorter, shots for an extremum are farther
# apart, than in the files.
COLUMNS, TIP, APART = 8, 3e-12, 3e-4


def agreement(one: list[str], other: list[str]) -> np.ndarray:
    """Digits in which numbers agree: -log10 of their relative difference, 34 where it is none."""
    from mpmath import mp

    with mp.workdps(CHECK):
        apart = [abs(mp.mpf(x) / mp.mpf(y) - 1) for x, y in zip(one, other, strict=True)]
        return np.array([34.0 if d == 0 else min(34.0, float(-mp.log10(d))) for d in apart])


def spread(rows: int, of: int) -> np.ndarray:
    """So many rows, evenly over all."""
    return np.unique(np.linspace(0, of - 1, min(rows, of)).astype(int))


def folds(rows: int) -> dict[str, np.ndarray]:
    """Digits of gamma, a row each."""
    at = spread(rows, FOLDS)
    known = columns(DATA / "reference_folds.csv")["gamma"]
    again = exact_folds(*(column[at] for column in cables(FOLDS)), digits=CHECK)
    return {"gamma": agreement([known[i] for i in at], [row["gamma"] for row in again])}


def shots(rows: int) -> dict[str, np.ndarray]:
    """Digits of p, q and f, a row each."""
    at = spread(rows, SHOTS)
    known = columns(DATA / "reference_shots.csv")
    again = exact_shots(*(column[at] for column in shots_of_file()), digits=CHECK)
    return {name: agreement([known[name][i] for i in at], [row[name] for row in again]) for name in ("p", "q", "f")}


def at_random(rows: int, of: int) -> np.ndarray:
    """So many rows, the same every time."""
    return np.sort(np.random.default_rng(SEED).choice(of, min(rows, of), replace=False))


def drag_folds(kind: str, rows: int) -> dict[str, np.ndarray]:
    """Digits of gamma, a row each."""
    reference_drag = samples_drag.long_shots()
    reference_drag.COLUMNS, reference_drag.TIP = COLUMNS, np.longdouble(TIP)
    samples_drag.APART = np.longdouble(APART)
    known, file = samples_drag.fold_reference(kind), columns(DATA / f"reference_drag_{kind}.csv")["gamma"]
    at = at_random(rows, len(file))
    again = []
    for k in at:
        system, gamma = known.systems[known.row[k]], known.exact[0][k]
        again.append(samples_drag.exact_fold(samples_drag.fish_at_fold(gamma, system), gamma, system))
    return {"gamma": agreement([file[k] for k in at], again)}


def shapes(rows: int) -> dict[str, np.ndarray]:
    """Digits of r_f and of the tension; of z_f over lambda and of the phase in radians, which may be zero."""
    from towatlas.kernels.system import COLUMNS as NUMBERS
    from towatlas.system import System

    file = columns(ROOT / "tests" / "data" / "any_medium.csv")
    at = at_random(rows, len(file["r_f"]))
    off: dict[str, list[float]] = {name: [] for name in ("r_f", "z_f", "phase_deg", "tension")}
    for k in at:
        row = {name: float(values[k]) for name, values in file.items() if name != "kind"}
        system = System(**{name: row[name] for name in NUMBERS})
        # Shots in long double turn one way: the other is its mirror image.
        system = replace(system, C_s=np.copysign(1.0, row["gamma"]) * system.C_s)
        for name, value in samples_drag.exact_place(row["r_f"], row["gamma"], system).items():
            over = {"z_f": system.lam, "phase_deg": np.degrees(1.0)}.get(name, abs(value))
            apart = value - row[name]
            apart -= 360 * np.round(apart / 360) if name == "phase_deg" else 0
            off[name].append(float(abs(apart) / over))
    return {name: -np.log10(np.maximum(values, 1e-18)) for name, values in off.items()}


CHECKS: dict[str, Callable[[int], dict[str, np.ndarray]]] = {
    "reference_folds": folds,
    "reference_shots": shots,
    "reference_drag_pairs": lambda rows: drag_folds("pairs", rows),
    "reference_drag_octaves": lambda rows: drag_folds("octaves", rows),
    "any_medium": shapes,
}


def main() -> None:
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else max(FOLDS, SHOTS)
    for file in sys.argv[2:] or CHECKS:
        for name, digits in CHECKS[file](rows).items():
            print(f"{file} {name}: {len(digits)} rows, fewest digits {digits.min():.1f}", flush=True)


if __name__ == "__main__":
    main()
