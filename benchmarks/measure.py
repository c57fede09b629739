"""The measurements. Each returns rows of (method, error, seconds per critical speed), or numbers for the README."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import atlas
from atlas.lookup import Atlas
from benchmarks import peers
from kernels.scan import scan_system


@dataclass(frozen=True)
class Row:
    """One method: worst relative error, seconds for one critical speed, and what must be said of it."""

    method: str
    error: float
    seconds: float
    note: str = ""


def sample(rows: int, seed: int = 2026) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Random (n, w_f, lam) over the domain of the atlas, uniform in the logarithms; a tenth without a fish."""
    rng = np.random.default_rng(seed)
    n = rng.integers(1, 7, rows)
    w_f = np.where(rng.random(rows) < 0.1, 0.0, 10.0 ** rng.uniform(-5, 4, rows))
    return n, w_f, atlas.threshold_length(w_f, n) + 10.0 ** rng.uniform(-3, 3, rows)


def seconds(function: Callable[[], object], repeats: int = 5) -> float:
    """Median time of a call, after one that is not counted."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def lookup_errors(table: Atlas, rows: int) -> dict[str, tuple[float, str]]:
    """Worst relative difference of every quantity from the direct solution, and where."""
    n, w_f, lam = sample(rows)
    found, exact = table.states(lam, w_f, n), atlas.solve_critical(lam, w_f, n)
    worst = {}
    for name in ("gamma", "R_x0", "x_f", "z_f", "tension"):
        miss = np.abs(getattr(found, name) / getattr(exact, name) - 1)
        i = int(miss.argmax())
        worst[name] = (float(miss[i]), f"n = {n[i]}, w_f = {w_f[i]:.4g}, lambda = {lam[i]:.6g}")
    covered = np.mean(np.abs(found.gamma / exact.gamma - 1) <= found.error + exact.error)
    worst["error estimates that hold"] = (float(covered), "")
    return worst


def methods(table: Atlas, rows: int, peer_rows: int) -> list[Row]:
    """Critical speeds by each method, on cables every method can do: lambda 5 to 50, w_f 0.1 to 100, n to 3.

    One thread. The reference is the direct solution, whose own error is measured in the tests against 34 digits.
    """
    rng = np.random.default_rng(7)
    n = rng.integers(1, 4, rows)
    w_f, lam = 10.0 ** rng.uniform(-1, 2, rows), 10.0 ** rng.uniform(np.log10(6), np.log10(50), rows)
    exact = atlas.solve_critical(lam, w_f, n)
    a = np.abs(exact.x_f) * exact.gamma**2

    def error(gamma: np.ndarray, count: int) -> float:
        return float(np.nanmax(np.abs(gamma[:count] / exact.gamma[:count] - 1)))

    result = [
        Row(
            "lookup from the atlas",
            error(table.critical_speed(lam, w_f, n), rows),
            seconds(lambda: table.critical_speed(lam, w_f, n)) / rows,
        ),
        _direct(n, w_f, lam, exact),
    ]
    for segments in (100, 400):
        start = time.perf_counter()
        found = np.array([_scanned(lam[i], w_f[i], n[i], segments) for i in range(peer_rows)])
        spent = (time.perf_counter() - start) / peer_rows
        missed = int(np.isnan(found).sum())
        note = f"{missed} of {peer_rows} not seen" if missed else ""
        result.append(Row(f"Skop's scan, {segments} segments, 1000 guesses", error(found, peer_rows), spent, note))
    start = time.perf_counter()
    guess = 1.0 + 0.02 * rng.uniform(-1, 1, (2, peer_rows))
    found = np.array(
        [
            peers.critical_speed(lam[i], w_f[i], n[i], a[i] * guess[0, i], exact.gamma[i] * guess[1, i])
            for i in range(peer_rows)
        ]
    )
    spent = (time.perf_counter() - start) / peer_rows
    result.append(Row("SciPy `solve_ivp` + `root`", error(found, peer_rows), spent, "from a guess within 2 %"))
    return result


def _direct(n: np.ndarray, w_f: np.ndarray, lam: np.ndarray, exact: atlas.CriticalStates) -> Row:
    """The direct solver on one thread; its error is its own estimate."""
    from atlas.limits import excess_length
    from kernels.extract import solve_folds

    rows = len(n)
    excess = excess_length(lam, w_f, n)

    def solve() -> None:
        out = np.empty((rows, 4)), np.empty(rows), np.empty(rows, np.int64)
        solve_folds(n, w_f, lam, excess, np.zeros(rows), np.zeros(rows), *out, 0, rows)

    return Row(
        "direct solution", float(exact.error.max()), seconds(solve, 3) / rows, "error as estimated; no guess needed"
    )


def _scanned(lam: float, w_f: float, n: int, segments: int) -> float:
    results, statuses = np.empty((n, 4)), np.empty(n, np.int64)
    scan_system(w_f, lam, 0.95 / np.sqrt(lam), 60.0, 240, 1000, segments, n, 1e-9, results, statuses)
    return float(results[n - 1, 0])


def open_or_build(path: Path) -> Atlas:
    """The atlas at a path, built there if there is none."""
    if not path.exists():
        from atlas.build import build_atlas

        build_atlas(path)
    return atlas.open_atlas(path)
