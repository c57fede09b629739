"""Random critical speeds certified: docs/data/certified.csv. Run: python -m benchmarks.certified [ROWS]; goes on."""

import csv
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.samples import cables
from towatlas import patience
from towatlas.kernels import status
from towatlas.solve.critical import solve_critical

SEED = 2027
ROWS = 500
DIGITS = 20
# A multiple that no fold should need: what takes longer is a failure with a name.
SECONDS = 120.0
PATH = Path(__file__).parent.parent / "docs" / "data" / "certified.csv"


def certified(begin: int, rows: int):
    """One row each from `begin` on: the cable, what was proved, what the solver says and states, CPU time."""
    from towatlas.solve.proof.certificates import certify

    columns = (column[begin:rows] for column in cables(ROWS, SEED))
    for n, w_f, lam in zip(*columns, strict=True):
        state = solve_critical(lam, w_f, n)
        assert state.status == status.OK
        start = time.process_time()
        try:
            with patience(SECONDS):
                found = certify(lam, w_f, int(n), digits=DIGITS)
            outcome = found.status, found.gamma, found.gamma_radius, found.R_x0_radius, found.x_f_radius
        except ArithmeticError:
            outcome = "TOO_LONG", None, None, None, None
        seconds = time.process_time() - start
        yield (
            int(n),
            float(w_f),
            float(lam),
            *outcome,
            repr(float(state.gamma)),
            float(state.error),
            round(seconds, 3),
        )


def main() -> None:
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else ROWS
    if not PATH.exists():
        PATH.write_text(
            f"# Random cables of benchmarks.samples.cables, seed {SEED}, to {DIGITS} digits; seconds of CPU.\n"
            "n,w_f,lam,status,gamma,gamma_radius,R_x0_radius,x_f_radius,solved,error,seconds\n"
        )
    begin = len(PATH.read_text().splitlines()) - 2
    for row in certified(begin, rows):
        with PATH.open("a", newline="") as file:
            csv.writer(file, lineterminator="\n").writerow(row)
    with PATH.open() as file:
        done = list(csv.DictReader(line for line in file if not line.startswith("#")))
    seconds = np.array([float(row["seconds"]) for row in done])
    lost = [row for row in done if row["status"] != "CERTIFIED"]
    times = f"CPU time median {np.median(seconds):.2f} s, largest {seconds.max():.1f} s"
    print(f"{len(done) - len(lost)} of {len(done)} certified; {times}")
    for row in lost:
        print(row["n"], row["w_f"], row["lam"], row["status"])


if __name__ == "__main__":
    main()
