"""`python -m benchmarks`: print the tables; put the one of methods into the README."""

import importlib.metadata
import platform
import re
from pathlib import Path

from atlas.lookup import default_path
from benchmarks.measure import Row, lookup_errors, methods, open_or_build

README = Path(__file__).parent.parent / "README.md"
BEGIN, END = "<!-- methods: written by make bench -->\n", "<!-- end of methods -->"


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.exists() and (match := re.search(r"model name\s*: (.*)", info.read_text())):
        return match[1]
    return platform.processor() or platform.machine()


def methods_table(rows: list[Row], whole_domain: float) -> str:
    """Markdown, times as such and over the first method's; `whole_domain` is the worst error of lookup anywhere."""
    lines = ["| method | worst relative error | time per critical speed | ratio |", "|---|---|---|---|"]
    for row in rows:
        note = f" ({row.note})" if row.note else ""
        ratio = row.seconds / rows[0].seconds
        lines.append(
            f"| {row.method}{note} | {row.error:.0e} | {_time(row.seconds)} | {ratio:,.{0 if ratio > 9.5 else 1}f} |"
        )
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "numba", "scipy"))
    lines.append("")
    lines.append(
        f"Cables of lambda 6 to 50, w_f 0.1 to 100, n = 1 to 3; many at a time for the first two, one thread. "
        f"{_processor()}, Python {platform.python_version()}, {versions}. Unfair to SciPy: its right-hand side is "
        f"Python; unfair to the others: it is handed a guess. Over the whole domain of the atlas, to its thresholds, "
        f"lookup is within {whole_domain:.0e} of the direct solution (100,000 random cables)."
    )
    return "\n".join(lines) + "\n"


def _time(value: float) -> str:
    unit, size = next((u for u in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)) if value >= u[1]), ("ns", 1e-9))
    return f"{value / size:.0f} {unit}" if value >= 10 * size else f"{value / size:.1f} {unit}"


def main() -> None:
    table = open_or_build(default_path())
    print("Lookup against the direct solver, 100000 random points of the domain\n")
    worst = lookup_errors(table, 100_000)
    for name, (value, where) in worst.items():
        print(f"  {name:<26} {value:.2g}  {where}")
    text = methods_table(methods(table, rows=4000, peer_rows=30), worst["gamma"][0])
    print("\nCritical speeds, by method\n\n" + text)
    readme = README.read_text()
    before, rest = readme.split(BEGIN)
    README.write_text(before + BEGIN + text + END + rest.split(END)[1])


main()
