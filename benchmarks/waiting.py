"""`python -m benchmarks.waiting`: CPU seconds that a user waits for whole commands, with nothing compiled, then again.

Each command is a process of its own, cold with an empty cache of its own, then warm. Writes docs/data/waiting.csv, the
figure and the table of docs/methods.md beside what an earlier version took, docs/data/waiting_before.csv.
"""

import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks import figures, lookup, report
from benchmarks.samples import DATA, ROOT, columns, write_table
from benchmarks.timing import readable
from towatlas.tables.file import default_path

CABLE = "--lam 37.8 --wf 1352"
# {folder}: a folder of the run; {water}: the scene of docs/scenes.md.
COMMANDS = {
    "critical": f"critical {CABLE} --n 2",
    "critical --solve": f"critical {CABLE} --n 2 --solve",
    "equilibria": f"equilibria {CABLE} --gamma 5.94",
    "equilibria --C 0.018": f"equilibria {CABLE} --gamma 5.94 --C 0.018",
    "shape": f"shape {CABLE} --gamma 5.94 --out {{folder}}/shape.svg",
    "scene in a vacuum": "scene skop-fig3 --model vacuum",
    "scene in air": "scene skop-fig3 --model air",
    "scene in water": "scene {water}",
    "scene skop-fig3 at 5.94": "scene skop-fig3 --gamma 5.94",
    "design": "design --scene skop-fig3 --depth 25in",
    "design in a vacuum": "design --scene skop-fig3 --depth 25in --model vacuum",
    "stability": f"stability {CABLE} --gamma 5.94 --C 0.018",
}
REPEATS = 3


@dataclass(frozen=True)
class Wait:
    """CPU seconds of a command, cold and warm; nan where not measured."""

    command: str
    cold: float
    warm: float


def before() -> dict[str, Wait]:
    """What an earlier version took, by command."""
    rows = columns(DATA / "waiting_before.csv")
    waits = zip(rows["command"], *([float(s or "nan") for s in rows[name]] for name in ("cold", "warm")), strict=True)
    return {row[0]: Wait(*row) for row in waits}


def measure(commands: dict[str, str] = COMMANDS, repeats: int = REPEATS) -> list[Wait]:
    """Each command once cold, then warm, in the median of some."""
    waits = []
    for name, command in commands.items():
        with tempfile.TemporaryDirectory() as folder:
            water = Path(folder) / "water.toml"
            water.write_text((ROOT / "docs" / "scenes.md").read_text().split("```toml\n", 1)[1].split("```", 1)[0])
            words = command.format(folder=folder, water=water).split()
            spent = [_cpu_seconds(words, Path(folder) / "cache") for _ in range(1 + repeats)]
        waits.append(Wait(name, spent[0], float(np.median(spent[1:]))))
        print(f"{name}: {spent[0]:.2f} s, then {waits[-1].warm:.2f} s", flush=True)
    return waits


def _cpu_seconds(words: list[str], cache: Path) -> float:
    """Of a command and what it starts, user and system, with this folder for all that is kept from run to run."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "XDG_CACHE_HOME": str(cache)}
    start = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, "-m", "towatlas", *words], env=environment, cwd=ROOT, check=True, capture_output=True
    )
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return end.ru_utime + end.ru_stime - start.ru_utime - start.ru_stime


def table(waits: list[Wait], earlier: dict[str, Wait]) -> str:
    """Markdown."""
    lines = ["| command | cold, before | cold | warm, before | warm |", "|---|---|---|---|---|"]
    for wait in waits:
        was = earlier.get(wait.command, Wait(wait.command, np.nan, np.nan))
        cells = [was.cold, wait.cold, was.warm, wait.warm]
        lines.append(f"| {wait.command} | {' | '.join('' if np.isnan(s) else readable(s) for s in cells)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure, draw, write."""
    lookup.open_or_build(default_path())
    waits, earlier = measure(), before()
    rows = [{"command": wait.command, "cold": f"{wait.cold:.3g}", "warm": f"{wait.warm:.3g}"} for wait in waits]
    write_table(DATA / "waiting.csv", f"{report.machine()}\nCPU seconds, cold and warm.", rows)
    figures.waiting([(wait, earlier.get(wait.command)) for wait in waits], ROOT / "docs" / "waiting")
    picture = "![CPU seconds of whole commands, cold and warm, before and now](waiting.svg)"
    report.put(report.METHODS, "waiting", f"{picture}\n\n{table(waits, earlier)}\n{report.machine()}\n")


if __name__ == "__main__":
    main()
