"""The charts with drag, equilibria and folds: errors against time.

`python -m benchmarks.drag` measures them alone, and writes their figures, data and tables.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import towatlas
from benchmarks import figures, report, targets_drag
from benchmarks import peers_drag as peers
from benchmarks import peers_moordyn as moordyn
from benchmarks.samples import ROOT
from benchmarks.samples_drag import DragReference, arrays, fold_reference, named, shape_reference
from benchmarks.targets import Target
from benchmarks.timing import LOST, Row, once, seconds
from towatlas.kernels import status
from towatlas.solve.drag_folds import fold_at
from towatlas.system import System

MANY = "equilibria_many"
PAIRS = "solve_drag_folds, many"
NEWTON = "Newton, the guesses of the peers"
OCTAVES = "folds"
# A guess this far off, relatively, is a good one.
GOOD = 0.05
# A pair may end within a percent of where it appears: what is further off than this is another fold.
WRONG = 1e-3
# Which of the systems the slow methods take.
FEW = np.r_[0:12, 40:46]

Array = np.ndarray


def equilibria(few: Array = FEW, full: bool = True) -> list[Row]:
    """All shapes of random systems in air and in water; slow methods take a few of them. One thread."""
    every = shape_reference()
    exact = every.take(few)
    found = ours([exact, every] if full else [exact])
    for rtol, points in ((1e-4, 60), (1e-7, 60), (1e-10, 60), (1e-7, 240), (1e-7, 960)) if full else ((1e-7, 40),):
        solve = partial(peers.from_fish, rtol=rtol, points=points)
        found.append(_searched("SciPy up from the fish", f"rtol {rtol:g}, {points} radii", exact, solve))
    for rtol, guesses in ((1e-4, 12), (1e-7, 12), (1e-10, 12), (1e-7, 48)) if full else ((1e-7, 4),):
        solve = partial(peers.from_tow_point, rtol=rtol, guesses=guesses)
        found.append(_searched("SciPy down from the tow", f"rtol {rtol:g}, {guesses} guesses", exact, solve))
    shapes = [_shapes(exact, row) for row in range(len(exact.systems))]
    for tolerance in (1e-3, 1e-6, 1e-9) if full else (1e-3,):
        found.append(_collocated(exact, shapes, tolerance))
    return found + (moordyn.rows() if full and not moordyn.missing() else [])


def ours(samples: list[DragReference]) -> list[Row]:
    """This project, many systems at once and one a call; the last of the samples for that."""
    found = []
    for exact in samples:
        gamma, systems = [given["gamma"] for given in exact.given], arrays(exact.systems)
        towatlas.equilibria_many(gamma=gamma[:1], **arrays(exact.systems[:1]))
        answers: list[Array] = []
        spent = once(lambda s=systems, g=gamma, a=answers: a.extend(towatlas.equilibria_many(gamma=g, **s).r_f.values))
        rows, errors = len(gamma), {"r_f": exact.errors(answers, LOST)}
        failures = _whole(exact, [r[np.isfinite(r)] for r in answers])
        found.append(Row(MANY, f"{rows} systems", rows, errors, spent / rows * 1e6, failures))
    one = partial(_searched, "equilibria, one a call", f"{rows} systems", exact)
    return [*found, one(lambda s, g: towatlas.equilibria(gamma=g, **named(s)).r_f, warm=True)]


def _whole(exact: DragReference, answers: list[Array]) -> str:
    """How many systems have all their shapes, and how many answers are none."""
    good = np.isfinite(exact.errors(answers, LOST))
    whole = sum(bool(good[exact.row == row].all()) for row in range(len(answers)))
    extra = exact.extra(answers, LOST)
    return f"{whole} of {len(answers)} systems whole" + (f", {extra} answers are no shapes" if extra else "")


def _searched(method: str, setting: str, exact: DragReference, solve: Callable, warm: bool = False) -> Row:
    """A row for a method that looks for all shapes of one system a call."""
    answers: list[Array] = []
    jobs = [(s, given["gamma"]) for s, given in zip(exact.systems, exact.given, strict=True)]
    if warm:
        solve(*jobs[0])
    with peers.quiet():
        spent = once(lambda: answers.extend(solve(*job) for job in jobs))
    failures = _whole(exact, answers)
    return Row(method, setting, len(jobs), {"r_f": exact.errors(answers, LOST)}, spent / len(jobs) * 1e6, failures)


def _shapes(exact: DragReference, row: int, nodes: int = 100) -> list[Array]:
    """The shapes of a system, bent by GOOD: what collocation is given to begin with."""
    system = exact.systems[row]
    found = towatlas.equilibria(gamma=exact.given[row]["gamma"], **named(system))
    s = np.linspace(0.0, peers.paid_out(system), nodes)
    bent = 1.0 + GOOD * np.sin(np.linspace(0.0, np.pi, nodes))
    shapes = [towatlas.shape_of(found, k, s) for k in range(len(found))]
    return [np.stack([shape[name].values for name in ("x", "y", "z", "R_x", "R_y", "R_z")]) * bent for shape in shapes]


def _collocated(exact: DragReference, guesses: list[list[Array]], tolerance: float) -> Row:
    answers: list[Array] = []

    def run() -> None:
        for system, given, shapes in zip(exact.systems, exact.given, guesses, strict=True):
            radii = [peers.by_collocation(system, given["gamma"], shape, tolerance) for shape in shapes]
            answers.append(np.array([r for r in radii if np.isfinite(r)]))

    with peers.quiet():
        spent = once(run)
    rows = len(exact.systems)
    errors = {"r_f": exact.errors(answers, LOST)}
    return Row("SciPy solve_bvp", f"tol {tolerance:g}", rows, errors, spent / rows * 1e6, _whole(exact, answers))


def pairs(rows: int = 24, full: bool = True) -> list[Row]:
    """Speeds at which pairs appear with drag; peers are given speed and radius to 5 %. One thread."""
    exact = fold_reference("pairs").take(np.arange(rows))
    lam, w_f, c = (np.array([getattr(s, name) for s in exact.systems]) for name in ("lam", "w_f", "C"))
    n = np.array([int(given["n"]) for given in exact.given])
    found = towatlas.solve_drag_folds(lam, w_f, c, n)
    spent = once(lambda: towatlas.solve_drag_folds(lam, w_f, c, n))
    table = [_fold_row(PAIRS, f"{rows} cables", exact, found.appears, spent)]
    guesses = [((1.0 + GOOD) * r, (1.0 - GOOD) * g) for r, g in zip(found.r_f_appears, found.appears, strict=True)]

    def each(method: str, setting: str, solve: Callable[[int], float]) -> None:
        answers: list[float] = []
        with peers.quiet():
            spent = once(lambda: answers.extend(solve(k) for k in range(rows)))
        table.append(_fold_row(method, setting, exact, answers, spent))

    each(
        "solve_drag_folds, one a call",
        "",
        lambda k: float(towatlas.solve_drag_folds(lam[k], w_f[k], c[k], n[k]).appears),
    )
    table.append(_newton(exact, guesses))
    for rtol in (1e-4, 1e-7, 1e-10) if full else (1e-7,):
        each(
            "SciPy solve_ivp + root",
            f"rtol {rtol:g}",
            lambda k, rtol=rtol: peers.fold_by_root(exact.systems[k], guesses[k], rtol),
        )
    for tolerance in (1e-3, 1e-6, 1e-9) if full else (1e-3,):
        each(
            "SciPy solve_bvp",
            f"tol {tolerance:g}",
            lambda k, tolerance=tolerance: peers.fold_by_collocation(exact.systems[k], guesses[k], tolerance),
        )
    return table


def _newton(exact: DragReference, guesses: list[tuple[float, float]]) -> Row:
    """What the solver does last, from the guesses that the peers have."""
    r_f, gamma = np.array(guesses).T
    systems = np.array([system.row() for system in exact.systems])
    found: list[Array] = []

    def solve() -> None:
        z, _, codes = fold_at(np.log(np.stack([r_f * gamma**2, gamma], axis=1)), systems)
        found.append(np.where(codes == status.OK, np.exp(z[:, 1]), np.nan))

    spent = seconds(solve, 3)
    return _fold_row(NEWTON, "many", exact, found[-1], spent)


def _fold_row(method: str, setting: str, exact: DragReference, answers: Any, spent: float) -> Row:
    """A row for a method that solves for one fold of each system."""
    gamma, rows = np.asarray(answers, float), len(exact.systems)
    errors = exact.errors(list(gamma[:, None]), WRONG)
    none = int(np.isnan(gamma).sum())
    wrong = int(np.isnan(errors).sum()) - none
    failures = f"{none} diverged, {wrong} wrong folds, of {rows}" if none or wrong else ""
    return Row(method, setting, rows, {"gamma": errors}, spent / rows * 1e6, failures)


def octaves(rows: int = 17, full: bool = True) -> list[Row]:
    """All folds within an octave of speed: ours, and what equilibria at a grid of speeds and bisection tell."""
    exact = fold_reference("octaves").take(np.arange(rows))
    jobs = [(system, given["low"]) for system, given in zip(exact.systems, exact.given, strict=True)]

    def row(method: str, setting: str, solve: Callable[[System, float], Array]) -> Row:
        answers: list[Array] = []
        spent = once(lambda: answers.extend(solve(*job) for job in jobs))
        errors = {"gamma": exact.errors(answers, LOST)}
        return Row(method, setting, rows, errors, spent / rows * 1e6, _whole(exact, answers).replace("shapes", "folds"))

    def all_folds(system: System, low: float) -> Array:
        return towatlas.folds(gamma=(low, 2.0 * low), **named(system)).gamma

    all_folds(*jobs[0])
    found = [row(OCTAVES, "", all_folds)]
    for speeds, tolerance in ((8, 1e-4), (32, 1e-4), (32, 1e-8), (128, 1e-8)) if full else ((8, 1e-2),):
        setting = f"{speeds} speeds, halved to {tolerance:g}"
        found.append(row("counts of shapes", setting, lambda s, low, n=speeds, t=tolerance: sweep(s, low, n, t)))
    return found


def sweep(system: System, low: float, speeds: int, tolerance: float) -> Array:
    """Speeds within an octave where the number of shapes changes, each by bisection."""

    def counts(gamma: Array) -> Any:
        return towatlas.equilibria_many(gamma=gamma, **named(system))["count"].values

    gamma = np.geomspace(low, 2.0 * low, speeds)
    count = counts(gamma)
    at = np.flatnonzero(np.diff(count))
    below, above, shapes = gamma[at], gamma[at + 1], count[at]
    while len(at) and np.max(above / below) > 1.0 + tolerance:
        middle = np.sqrt(below * above)
        same = counts(middle) == shapes
        below, above = np.where(same, middle, below), np.where(same, above, middle)
    return np.sqrt(below * above)


def run(say: Callable[[str], None]) -> list[Target]:
    """Measure, draw and write all of it, each part when it is there; one thread."""
    if moordyn.missing():
        say("moordyn is not installed and left out: pip install '.[peers]'")

    def write(name: str, text: str) -> None:
        report.put(report.METHODS, name, text)
        say(f"\n{name}\n\n{text}")

    def chart(name: str, rows: list[Row], method: str, quantity: str) -> list[Row]:
        report.chart_csv(name.replace(" ", "_"), rows, method)
        write(name, report.chart_table(rows, method, (quantity,)))
        return rows

    say("equilibria with drag ...")
    figures.drag_equilibria(chart("drag equilibria", equilibria(), MANY, "r_f"), ROOT / "docs" / "drag_equilibria")
    say("folds with drag ...")
    figures.drag_folds(
        chart("drag pairs", pairs(), PAIRS, "gamma"),
        chart("drag octaves", octaves(), OCTAVES, "gamma"),
        ROOT / "docs" / "drag_folds_cost",
    )
    found = targets_drag.measure()
    write("drag targets", report.targets_table(found))
    write("drag machine", report.machine() + "\n")
    return found


if __name__ == "__main__":
    run(lambda text: print(text, flush=True))
