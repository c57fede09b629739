"""`python -m benchmarks`: measure all, write the figures, data and tables of the documents, compare the ratios."""

import argparse
import sys
import time

from benchmarks import coldstart, drag, figures, folds, lookup, report, shots, stability, targets
from benchmarks.peers_shots import missing
from benchmarks.samples import ROOT
from benchmarks.timing import Row, processor
from towatlas.kernels.sweeps import limited_threads
from towatlas.tables.file import default_path

# Rows of the second chart that the README shows: method, start of the setting.
SHOWN = (
    ("lookup from the atlas", ""),
    ("direct, table", ""),
    ("direct, one by one", ""),
    ("Skop's scan", "400"),
    ("SciPy solve_ivp + root", "rtol 1e-10"),
    ("SciPy solve_bvp", "tol 1e-06"),
)
README_NOTE = (
    "Random cables over the whole domain of the atlas, from cold, one thread; errors of the answers given. Lost: none, "
    "or off by more than 1 %. Unfair to SciPy: its right-hand side is Python. [How to choose a method and a "
    "tolerance](docs/methods.md). "
)


def _say(text: str) -> None:
    print(text, flush=True)


def _readme(rows: list[Row], worst: float) -> str:
    shown = [row for row in rows if any(row.method == m and row.setting.startswith(s) for m, s in SHOWN)]
    shown.sort(key=lambda row: row.microseconds)
    table = report.chart_table(shown, shown[0].method, ["gamma"])
    domain = f"Lookup is within {worst:.0e} of the direct solution everywhere (100,000 random cables). "
    return f"{table}\n{README_NOTE}{domain}{report.machine()}\n"


def main() -> int:
    """Run; the exit code is 1 where a ratio got worse."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument(
        "--accept", action="store_true", help="make the ratios of this run the committed ones of this processor"
    )
    accept = parser.parse_args().accept
    start = time.perf_counter()
    for name in missing():
        _say(f"{name} is not installed and left out: pip install '.[peers]'")

    table = lookup.open_or_build(default_path())
    _say("cold start ...")
    cold = coldstart.measure()
    build_seconds, mebibytes = coldstart.build()
    found = targets.of_memory(mebibytes) + targets.of_threads()

    with limited_threads(1):
        _say("shots ...")
        shot_rows = shots.measure()
        found += targets.of_shots(shot_rows) + targets.of_forward_shots()
        _say("critical speeds ...")
        fold_rows = folds.measure(table)
        found += targets.of_tables(fold_rows) + targets.of_folds()
        _say("lookup ...")
        lookup_rows, construct = lookup.measure(table)
        found += targets.of_one_lookup(lookup.of_one(table)) + targets.of_lookup(lookup_rows)
    found += drag.run(_say)
    stability.run(_say)
    worst = lookup.whole_domain(table)
    shell = lookup.shell(default_path())

    charts = (
        ("shots", shot_rows, shots.REFERENCE_METHOD, ("p", "q"), figures.shots),
        ("folds", fold_rows, folds.REFERENCE_METHOD, ("gamma",), figures.folds),
        ("lookup", lookup_rows, lookup.REFERENCE_METHOD, ("gamma",), figures.lookup),
    )
    for name, rows, method, quantities, draw in charts:
        draw(rows, ROOT / "docs" / name)
        report.chart_csv(name, rows, method)
        text = report.chart_table(rows, method, quantities)
        report.put(report.METHODS, name, text)
        _say(f"\n{name}\n\n{text}")
    others = {name: ratios for name, ratios in targets.kept().items() if name != processor()}
    cells = [
        ("targets", report.ratios_table({processor(): found} | others)),
        ("cold start", report.cold_table(cold) + f"\nThe default build: {build_seconds:.1f} s, {mebibytes:.0f} MiB.\n"),
        ("constructing", report.plain_table(("on 96 x 112 nodes", "time to construct"), construct)),
        ("shell", report.plain_table(("whole process", "time"), shell)),
        ("lookup everywhere", report.plain_table(("quantity", "largest relative difference"), worst, ".2g")),
        ("machine", report.machine() + "\n"),
    ]
    for name, text in cells:
        report.put(report.METHODS, name, text)
        _say(f"\n{name}\n\n{text}")
    report.put(report.README, "methods", _readme(fold_rows, worst["gamma"]))

    verdict = targets.compare(found)
    _say("\n".join(verdict) + f"\n{time.perf_counter() - start:.0f} s")
    if accept or processor() not in targets.kept():
        targets.keep(found)
    return int(any(line.startswith("WORSE") for line in verdict))


if __name__ == "__main__":
    sys.exit(main())
