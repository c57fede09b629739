"""The ratios this project holds itself to, each measured in one run, and the guard over them."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numba
import numpy as np

import towatlas
from benchmarks import methods_shots as methods
from benchmarks import peers_folds
from benchmarks.samples import shots
from benchmarks.timing import Row, once, processor, seconds, versions
from towatlas.kernels.calls import END_COLUMNS, FOLD_COLUMNS, Cables, Folds, forward_shots
from towatlas.kernels.sweeps import (
    MOST_THREADS,
    forward_shots_parallel,
    limited_threads,
    march_parallel,
    solve_folds_parallel,
)
from towatlas.limits import excess_length
from towatlas.solve.critical import solve_rows
from towatlas.solve.fold_seeds import seed

RATIOS = Path(__file__).parent / "ratios.json"
WORSE = 0.15  # a ratio that fell by more than this is named


@dataclass(frozen=True)
class Target:
    """A ratio, larger is better; what is asked of it, None where only watched; what must be known with it."""

    name: str
    value: float
    wanted: float | None
    note: str = ""

    @property
    def verdict(self) -> str:
        """In a word."""
        if self.wanted is None:
            return "watched"
        return "reached" if self.value >= self.wanted else "not reached"


def of_shots(rows: list[Row]) -> list[Target]:
    """Ratios of the first chart."""
    ours = rows[0]
    note = f"ours: largest error {ours.quantile('p', 1.0):.1e} (p), {ours.quantile('q', 1.0):.1e} (q)"
    by_name = {(row.method, row.setting): row for row in rows}
    found = []
    for method, setting, wanted in (
        ("heyoka in t, batch of 8", "tol 2.2e-16", 4.3),
        ("heyoka in t, scalar", "tol 2.2e-16", 9.0),
        ("heyoka in sigma, scalar, event", "tol 2.2e-16", 9.0),
        ("heyoka in sigma, scalar", "tol 2.2e-16", None),
        ("heyoka in sigma, batch of 8", "tol 2.2e-16", 2.4),
        ("SciPy DOP853", "rtol 1e-13", 3000.0),
    ):
        if row := by_name.get((method, setting)):
            theirs = f"{note}; theirs {row.quantile('p', 1.0):.1e}, {row.quantile('q', 1.0):.1e}"
            ratio = row.microseconds / ours.microseconds
            found.append(Target(f"fish-up shot with derivative over {method}", ratio, wanted, theirs))
    return found


def of_forward_shots(rows: int = 4096, segments: int = 100) -> list[Target]:
    """The forward kernel against its bound and against a scalar loop, one thread each."""
    rng = np.random.default_rng(0)
    w_f, lam, gamma = (
        10.0 ** rng.uniform(-1, 3, rows),
        10.0 ** rng.uniform(0, 2, rows),
        10.0 ** rng.uniform(-1, 1, rows),
    )
    r_x0, out = -(gamma**2) * lam, [np.empty(rows) for _ in range(3)]
    threads = numba.get_num_threads()
    numba.set_num_threads(1)  # of the peer
    try:
        ours = seconds(lambda: forward_shots(lam, w_f, gamma, r_x0, segments, *out, 0, rows), 15)
        bound = seconds(lambda: methods.roots_and_divisions(lam, 4 * segments, out[1]), 15)
        scalar = seconds(lambda: methods.scalar_forward_shots(lam, w_f, gamma, r_x0, segments, out[0]))
    finally:
        numba.set_num_threads(threads)
    each = f"{ours / rows / segments / 4 * 1e9:.2f} ns a right-hand side"
    return [
        Target("forward RK4 over one vector root and division a right-hand side", bound / ours, 2.0, each),
        Target("forward RK4 over a scalar prange loop, one thread each", scalar / ours, 15.0),
    ]


def of_threads(rows: int = 20_000) -> list[Target]:
    """Two threads over one, in sweeps."""
    if MOST_THREADS < 2:
        return []
    a, mu, tau = shots(rows, 5)
    ends, folds = np.empty((rows, END_COLUMNS)), np.empty((rows, 1, FOLD_COLUMNS))
    orders = np.ones(rows, np.int64), np.zeros(rows, np.int64)
    codes = np.empty(rows, np.int64), np.empty(rows, np.int64)
    ones, out = np.ones(rows), [np.empty(rows) for _ in range(3)]
    n, lam, w_f = np.full(rows, 2), np.geomspace(8.0, 800.0, rows), np.full(rows, 10.0)
    excess = excess_length(lam, w_f, n)
    guess = seed(n=n, w_f=w_f, lam=lam, excess=excess, solve=solve_rows)
    folded = np.empty((rows, 4)), np.empty(rows), codes[0]
    calls = {
        "fish-up shots": lambda: march_parallel(a, mu, tau, *orders, 10**7, ends, folds, *codes),
        "forward shots": lambda: forward_shots_parallel(lam, ones, ones, -lam, 100, *out),
        "folds": lambda: solve_folds_parallel(
            Cables(lam, w_f, n, excess), Folds(*(column.copy() for column in guess), *folded), 10**7
        ),
        "folds with their seeds": lambda: towatlas.solve_critical(lam, w_f, n),
    }
    found = []
    for name, call in calls.items():
        times = []
        for threads in (1, 2):
            with limited_threads(threads):
                times.append(min(seconds(call, 3) for _ in range(3)))
        wanted = None if "seeds" in name else 1.85  # the seeds are one thread's work
        found.append(Target(f"two threads over one, {name}", times[0] / times[1], wanted))
    return found


def of_tables(rows: list[Row]) -> list[Target]:
    """Ratios of the second chart: a table of random cables, seeds included, over solve_bvp from cold."""
    ours = rows[0]
    found = [Target("6 us over a fold of a table", 6.0 / ours.microseconds, 1.0, f"{ours.microseconds:.2f} us")]
    for row in rows:
        if row.method == "SciPy solve_bvp":
            errors = f"ours at most {ours.quantile('gamma', 1.0):.0e}; theirs {row.quantile('gamma', 1.0):.0e}"
            note = f"{errors}, {row.failures}"
            ratio = row.microseconds / ours.microseconds
            found.append(
                Target(f"table of critical speeds over solve_bvp from cold, {row.setting}", ratio, 1300.0, note)
            )
    return found


def of_folds(points: int = 4000, peer_points: int = 12) -> list[Target]:
    """Curves of critical speeds, seeds included, against `solve_bvp` continuing the same curves. One thread."""
    found = []
    curves = [(1, 1.0), (2, 10.0), (3, 100.0)]
    lam = np.geomspace(8.0, 50.0, points)
    exact = {n: towatlas.solve_critical(lam, w_f, n) for n, w_f in curves}
    ours = (
        np.mean([seconds(lambda n=n, w_f=w_f: towatlas.solve_critical(lam, w_f, n), 3) for n, w_f in curves]) / points
    )
    error = max(float(states.error.max()) for states in exact.values())
    found.append(Target("1 us over a fold along a curve", 1e-6 / ours, 1.0, f"{ours * 1e6:.2f} us"))
    for tolerance in (1e-3, 1e-6, 1e-9):
        spent, worst, lost = 0.0, 0.0, 0
        for n, w_f in curves:
            states = exact[n]
            near = np.log([abs(states.x_f[0]) * states.gamma[0] ** 2, states.gamma[0]])
            answer: list[np.ndarray] = []
            part = lam[:peer_points]
            spent += once(
                lambda n=n, w_f=w_f, a=answer, near=near, part=part, t=tolerance: a.append(
                    peers_folds.bvp_curve(n, w_f, part, near, t)
                )
            )
            miss = np.abs(answer[0] / states.gamma[:peer_points] - 1.0)
            lost += int(np.isnan(miss).sum())
            worst = max(worst, float(np.max(miss, initial=0.0, where=np.isfinite(miss))))
        theirs = spent / (len(curves) * peer_points)
        note = f"ours {ours * 1e6:.2g} us, error at most {error:.0e}; theirs {theirs * 1e3:.2g} ms, {worst:.0e}"
        note += f", {lost} not converged" if lost else ""
        name = f"critical speeds of curves over solve_bvp, tol {tolerance:g}"
        found.append(Target(name, theirs / ours, None, note))
    return found


def of_lookup(rows: list[Row]) -> list[Target]:
    """Many points looked up over the peers."""
    many = [row for row in rows if row.setting != "one point"]
    each = many[0].microseconds * 1e3
    found = [Target(f"170 ns over a lookup of {many[0].setting}, each", 170.0 / each, 1.0, f"{each:.0f} ns")]
    for row in many[1:]:
        errors = f"ours {many[0].quantile('gamma', 1.0):.0e}, theirs {row.quantile('gamma', 1.0):.0e}"
        wanted = 1.0 if row.method == "RegularGridInterpolator cubic" else None
        ratio = row.microseconds / many[0].microseconds
        found.append(Target(f"lookup of {many[0].setting} over {row.method}", ratio, wanted, errors))
    return found


def of_one_lookup(spent: dict[str, float]) -> list[Target]:
    """Lookups of one cable from Python, as 10 us over what they take."""
    return [Target(f"10 us over a lookup of {what}", 1e-5 / s, 1.0, f"{s * 1e6:.1f} us") for what, s in spent.items()]


def of_memory(mebibytes: float) -> list[Target]:
    """Memory of the default build, as 1 GiB over what it takes."""
    return [Target("1 GiB over the memory of the default build", 1024.0 / mebibytes, 1.0, f"{mebibytes:.0f} MiB")]


def kept(path: Path = RATIOS) -> dict[str, list[Target]]:
    """The committed ratios, by the processor they were taken on."""
    if not path.exists():
        return {}
    return {
        name: [Target(**ratio) for ratio in entry["ratios"]] for name, entry in json.loads(path.read_text()).items()
    }


def compare(found: list[Target], path: Path = RATIOS) -> list[str]:
    """What got worse by more than WORSE than the committed ratios of this processor; others are not comparable."""
    entries = kept(path)
    if processor() not in entries:
        others = f", only {'; '.join(entries)}" if entries else ""
        return [f"not compared: no committed ratios of {processor()}{others}; these are its first"]
    before = {target.name: target.value for target in entries[processor()]}
    lines = [
        f"WORSE: {target.name}: {target.value:.3g}, was {before[target.name]:.3g}"
        for target in found
        if target.name in before and target.value < (1.0 - WORSE) * before[target.name]
    ]
    measured = {target.name for target in found}
    lines += [f"not measured: {name}" for name in before if name not in measured]
    return lines or [f"no ratio is worse than the committed one by more than {WORSE:.0%}"]


def keep(found: list[Target], path: Path = RATIOS) -> None:
    """Make these the committed ratios of this processor, beside those of others."""
    entries = json.loads(path.read_text()) if path.exists() else {}
    ratios = [asdict(target) | {"value": float(f"{target.value:.4g}")} for target in found]
    entries[processor()] = {"versions": versions(), "ratios": ratios}
    path.write_text(json.dumps(entries, indent=1) + "\n")
