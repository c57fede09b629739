"""How many digits the reference files truly have: `python -m benchmarks.digits [rows]`.

Computes the answers of docs/data/reference_folds.csv and reference_shots.csv anew in 66 digits of mpmath, with Taylor
series of another order and other steps, and prints in how many digits the files agree. All rows take half an hour.
"""

import sys

import numpy as np

from benchmarks.samples import DATA, FOLDS, SHOTS, cables, columns, exact_folds, exact_shots, shots_of_file

CHECK = 66


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


def main() -> None:
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else max(FOLDS, SHOTS)
    for file, check in (("reference_folds", folds), ("reference_shots", shots)):
        for name, digits in check(rows).items():
            print(f"{file} {name}: {len(digits)} rows, fewest digits {digits.min():.1f}", flush=True)


if __name__ == "__main__":
    main()
