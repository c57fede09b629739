"""Tables in Markdown and CSV, and where in the documents they go."""

from collections.abc import Iterable
from pathlib import Path

from benchmarks.samples import DATA, ROOT, SEED, write_table
from benchmarks.targets import Target
from benchmarks.timing import Row, processor, readable, versions


def machine() -> str:
    """One line on what the numbers were taken with."""
    return f"{processor()}; {versions()}; random samples from seed {SEED}."


def unit(rows: list[Row], method: str) -> float:
    """Time that ratios are over: that of the first row of a method."""
    return next(row.microseconds for row in rows if row.method == method)


def chart_csv(name: str, rows: list[Row], method: str) -> None:
    """docs/data/<name>.csv."""
    cells = [row.columns(unit(rows, method)) for row in rows]
    keys = list(dict.fromkeys(key for row in cells for key in row))
    write_table(
        DATA / f"{name}.csv",
        f"{machine()}\nTimes in microseconds, ratios over {method}; errors of the answers given.",
        [{key: row.get(key, "") for key in keys} for row in cells],
    )


def chart_table(rows: list[Row], method: str, quantities: Iterable[str]) -> str:
    """Markdown: errors as median / 99th percentile / largest."""
    names = list(quantities)
    head = ["method", "setting", *(f"error of {name}: median / 99 % / largest" for name in names)]
    head += ["lost", "time", "ratio"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        cells = [row.method, row.setting]
        for name in names:
            shares = [row.quantile(name, share) for share in (0.5, 0.99, 1.0)] if name in row.errors else []
            cells.append(" / ".join(f"{share:.0e}" for share in shares))
        lost = f"{row.failure_rate:.1%}" if row.failure_rate else "0"
        cells.append(f"{lost} ({row.failures})" if row.failures else lost)
        ratio = row.microseconds / unit(rows, method)
        cells += [readable(row.microseconds * 1e-6), f"{ratio:,.0f}" if ratio >= 9.95 else f"{ratio:.2g}"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def targets_table(found: list[Target]) -> str:
    """Markdown."""
    lines = ["| ratio | measured | at least | | |", "|---|---|---|---|---|"]
    for t in found:
        wanted = "" if t.wanted is None else f"{t.wanted:g}"
        lines.append(f"| {t.name} | {_ratio(t.value)} | {wanted} | {t.verdict} | {t.note} |")
    return "\n".join(lines) + "\n"


def ratios_table(entries: dict[str, list[Target]]) -> str:
    """Markdown: a column for each processor; what one of them does not reach is said."""
    by_name = {name: {target.name: target for target in found} for name, found in entries.items()}
    lines = ["| ratio | at least | " + " | ".join(entries) + " | | |", "|---|---|" + "---|" * len(entries) + "---|---|"]
    for name in dict.fromkeys(target.name for found in entries.values() for target in found):
        there = {processor: targets[name] for processor, targets in by_name.items() if name in targets}
        first = next(iter(there.values()))
        cells = [_ratio(there[processor].value) if processor in there else "" for processor in entries]
        short = [processor for processor, target in there.items() if target.verdict == "not reached"]
        everywhere = len(short) == len(entries)
        verdict = f"not reached{'' if everywhere else ': ' + ', '.join(short)}" if short else first.verdict
        wanted = "" if first.wanted is None else f"{first.wanted:g}"
        lines.append(f"| {' | '.join([name, wanted, *cells, verdict, first.note])} |")
    return "\n".join(lines) + "\n"


def _ratio(value: float) -> str:
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def cold_table(rows: list[tuple[str, float, float]]) -> str:
    """Markdown."""
    lines = ["| in a new process | nothing compiled before | compiled before |", "|---|---|---|"]
    lines += [f"| {name} | {readable(cold)} | {readable(warm)} |" for name, cold, warm in rows]
    return "\n".join(lines) + "\n"


def plain_table(head: tuple[str, str], cells: dict[str, float], show: str | None = None) -> str:
    """Markdown of names and times, or of names and numbers in a format."""
    lines = [f"| {head[0]} | {head[1]} |", "|---|---|"]
    lines += [f"| {name} | {format(value, show) if show else readable(value)} |" for name, value in cells.items()]
    return "\n".join(lines) + "\n"


def put(path: Path, name: str, text: str) -> None:
    """Replace what stands between the markers of `name` in a document."""
    begin, end = f"<!-- {name}: written by make bench -->\n", f"<!-- end of {name} -->"
    document = path.read_text()
    before, rest = document.split(begin)
    path.write_text(before + begin + text + end + rest.split(end, 1)[1])


README, METHODS = ROOT / "README.md", ROOT / "docs" / "methods.md"
