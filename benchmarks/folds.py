"""Second chart: the error of a critical speed against the time it takes, from cold."""

from collections.abc import Callable

import numpy as np

import towatlas
from benchmarks import peers_folds as peers
from benchmarks.samples import FoldReference, cables, fold_reference
from benchmarks.timing import LOST, Row, once, seconds
from towatlas.kernels.calls import SLOPES, Cables, Folds, scan_system, solve_folds
from towatlas.limits import excess_length
from towatlas.tables.atlas import Atlas

TABLE = 4000
REFERENCE_METHOD = "direct, table"


def measure(table: Atlas, rows: int = 200, slow_rows: int = 16, full: bool = True) -> list[Row]:
    """Every method on the cables of the reference, slow ones on the first of them. One thread."""
    exact = fold_reference()
    exact = _head(exact, rows)
    few = _head(exact, slow_rows)
    n, w_f, lam = cables(TABLE if full else 200)
    found = [
        Row(
            REFERENCE_METHOD,
            f"{len(n)} cables, seeds included",
            rows,
            {"gamma": exact.errors(towatlas.solve_critical(exact.lam, exact.w_f, exact.n).gamma)},
            seconds(lambda: towatlas.solve_critical(lam, w_f, n), 3) / len(n) * 1e6,
        ),
        _one_by_one(exact),
        Row(
            "lookup from the atlas",
            f"{len(n)} cables",
            rows,
            {"gamma": exact.errors(table.critical_speed(exact.lam, exact.w_f, exact.n))},
            seconds(lambda: table.critical_speed(lam, w_f, n)) / len(n) * 1e6,
        ),
    ]
    scans = ((100, 200, 60), (100, 1000, 240), (400, 1000, 240), (1600, 1000, 240)) if full else ((100, 200, 60),)
    for segments, guesses, speeds in scans:
        setting = f"{segments} segments, {guesses} guesses, {speeds} speeds"
        scan = _scanner(segments, guesses, speeds)
        found.append(_counted("Skop's scan", setting, few, scan))
    for rtol in (1e-4, 1e-7, 1e-10) if full else (1e-4,):
        found.append(
            _counted("SciPy solve_ivp + root", f"rtol {rtol:g}", few, lambda *c, r=rtol: peers.by_root(*c, rtol=r))
        )
    for tolerance in (1e-3, 1e-6, 1e-9) if full else (1e-3,):
        found.append(
            _counted(
                "SciPy solve_bvp", f"tol {tolerance:g}", few, lambda *c, t=tolerance: peers.by_bvp(*c, tolerance=t)
            )
        )
    return found


def _head(exact: FoldReference, rows: int) -> FoldReference:
    high, low = exact.gamma
    return FoldReference(exact.n[:rows], exact.w_f[:rows], exact.lam[:rows], (high[:rows], low[:rows]))


def _one_by_one(exact: FoldReference) -> Row:
    rows = len(exact.n)
    excess = excess_length(exact.lam, exact.w_f, exact.n)
    gamma = np.empty(rows)

    def solve() -> None:
        cables = Cables(exact.lam, exact.w_f, exact.n, excess)
        guess = np.zeros(rows), np.zeros(rows), np.full((rows, SLOPES), np.nan)
        folds = Folds(*guess, np.empty((rows, 4)), np.empty(rows), np.empty(rows, np.int64))
        for i in range(rows):
            solve_folds(cables, folds, 10**7, i, i + 1)
        gamma[:] = folds.states[:, 0]

    spent = seconds(solve, 3)
    return Row("direct, one by one", "one cable a call", rows, {"gamma": exact.errors(gamma)}, spent / rows * 1e6)


def _scanner(segments: int, guesses: int, speeds: int) -> Callable:
    def scan(n: int, w_f: float, lam: float) -> float:
        results, statuses = np.empty((n, 4)), np.empty(n, np.int64)
        scan_system(lam, w_f, 0.95 / np.sqrt(lam), 60.0, speeds, guesses, segments, n, 1e-9, results, statuses)
        return float(results[n - 1, 0])

    return scan


def _counted(method: str, setting: str, exact: FoldReference, solve: Callable) -> Row:
    """A row for a method that solves one cable a call, its failures told apart."""
    gamma = np.empty(len(exact.n))
    solve(int(exact.n[0]), float(exact.w_f[0]), float(exact.lam[0]))

    def run() -> None:
        for i in range(len(gamma)):
            gamma[i] = solve(int(exact.n[i]), float(exact.w_f[i]), float(exact.lam[i]))

    spent = once(run)
    errors = exact.errors(gamma)
    none, wrong = int(np.isnan(gamma).sum()), int((errors > LOST).sum())
    kind = "pairs missed" if method == "Skop's scan" else "diverged"
    failures = f"{none} {kind}, {wrong} wrong folds, of {len(gamma)}"
    return Row(method, setting, len(gamma), {"gamma": errors}, spent / len(gamma) * 1e6, failures)
