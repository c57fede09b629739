"""`python -m benchmarks.maps_chaos`: maps computed while workers and schedulers are killed, beside undisturbed ones.

Each map is computed twice by two processes: once left alone, once with processes killed at random, every fifth time the
program itself with its scheduler, which is started anew with --resume. Then every file of the two is compared. Writes
a line for each to docs/data/maps_chaos.csv. `--share 0.02` makes small ones.
"""

import argparse
import csv
import filecmp
import math
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import numpy as np

DATA = Path(__file__).parent.parent / "docs" / "data" / "maps_chaos.csv"
# A run that goes no further for so long is stuck, s.
STUCK = 600.0
SPECS = {
    "vacuum": """
fields = ["count", "nodes", "position", "tension", "growth", "kind"]
tile = {tile}
[axes]
w_f = {{ from = 0.1, to = 100, points = {some}, spacing = "log" }}
lam = {{ from = 1, to = 8, points = {some} }}
gamma = {{ from = 0.3, to = 2, points = {many}, spacing = "log" }}
""",
    "drag": """
fields = ["count", "nodes", "position", "tension"]
tile = {tile}
[system]
w = 0.6
m_f_over_w_f = 1.3
w_f = 2
[axes]
C = {{ from = 0.1, to = 30, points = {some}, spacing = "log" }}
lam = {{ from = 1, to = 8, points = {some} }}
gamma = {{ from = 0.3, to = 2, points = {many}, spacing = "log" }}
""",
}
SYSTEMS = {"vacuum": 10**6, "drag": 10**5}


@dataclass(frozen=True)
class Row:
    """One map: systems, tiles, processes killed, schedulers among them, seconds alone and disturbed, files, how many
    of them differ."""

    medium: str
    systems: int
    tiles: int
    kills: int
    schedulers: int
    seconds_alone: float
    seconds_disturbed: float
    files: int
    different: int


def spec_of(medium: str, share: float, tile: int) -> tuple[str, int]:
    """The text of a spec of that share of the systems or some more, and how many they are."""
    some = max(2, math.ceil((SYSTEMS[medium] * share / 10.0) ** (1 / 3)))
    many = 10 * some
    return SPECS[medium].format(some=some, many=many, tile=tile), some * some * many


def start(spec: Path, out: Path) -> subprocess.Popen:
    """The command, by two processes."""
    command = ["-m", "towatlas", "map", str(spec), "--out", str(out), "--workers", "2", "--resume", "--quiet"]
    return subprocess.Popen([sys.executable, *command], stdout=subprocess.DEVNULL)


def workers_of(program: int) -> list[int]:
    """Processes that compute for a program."""
    found = []
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == program and b"spawn_main" in (folder / "cmdline").read_bytes():
                found.append(int(folder.name))
        except (OSError, ValueError, IndexError):
            continue
    return sorted(found)


def written(out: Path) -> int:
    """Tiles that are there."""
    return sum(1 for _ in out.glob("tiles/*/*.tile"))


def disturb(spec: Path, out: Path, tiles: int, kills: int, rng: np.random.Generator) -> int:
    """Compute a map, killing on the way; how many of those killed were schedulers."""
    at = np.sort(rng.integers(0, tiles, kills))
    program, schedulers, done, moved = start(spec, out), 0, 0, time.monotonic()
    seen = -1
    while True:
        time.sleep(rng.uniform(0.02, 0.2))
        if (count := written(out)) != seen:
            seen, moved = count, time.monotonic()
        if time.monotonic() - moved > STUCK:
            program.kill()
            raise RuntimeError(f"{out}: no tile in {STUCK:g} s")
        if (code := program.poll()) is not None:
            if code not in (0, -signal.SIGKILL):
                raise RuntimeError(f"{out}: the command ended with {code}")
            if code == 0 and done == kills:
                return schedulers
            program = start(spec, out)
        elif done < kills and count >= at[done]:
            victims = [program.pid] if done % 5 == 4 else workers_of(program.pid)
            if victims:
                victim = int(rng.choice(victims))
                os.kill(victim, signal.SIGKILL)
                done += 1
                if victim == program.pid:
                    program.wait()
                    schedulers += 1


def compare(a: Path, b: Path) -> tuple[int, int]:
    """Files of two maps, and how many are not the same in both."""
    every = {path.relative_to(root) for root in (a, b) for path in root.rglob("*") if path.is_file()}
    differ = [path for path in every if not (a / path).exists() or not (b / path).exists()]
    differ += [path for path in every - set(differ) if not filecmp.cmp(a / path, b / path, shallow=False)]
    return len(every), len(differ)


def run(medium: str, share: float, tile: int, kills: int, folder: Path, seed: int = 2026) -> Row:
    """One map, alone and disturbed."""
    text, systems = spec_of(medium, share, tile)
    spec = folder / f"{medium}.toml"
    spec.write_text(text)
    began = time.monotonic()
    disturb(spec, folder / "alone", 1, 0, np.random.default_rng(seed))
    alone, tiles = time.monotonic() - began, written(folder / "alone")
    began = time.monotonic()
    schedulers = disturb(spec, folder / "disturbed", tiles, kills, np.random.default_rng(seed))
    took = time.monotonic() - began
    files, different = compare(folder / "alone", folder / "disturbed")
    return Row(medium, systems, tiles, kills, schedulers, round(alone, 1), round(took, 1), files, different)


def main() -> int:
    """Both maps; 1 if any file differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="of the systems, default all")
    parser.add_argument("--tile", type=int, default=1000)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--medium", choices=tuple(SPECS), action="append")
    parser.add_argument("--out", type=Path, default=DATA)
    options = parser.parse_args()
    rows = []
    for medium in options.medium or SPECS:
        with tempfile.TemporaryDirectory() as folder:
            rows.append(run(medium, options.share, options.tile, options.kills, Path(folder)))
        print(rows[-1], flush=True)
    with options.out.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([field.name for field in fields(Row)])
        writer.writerows(astuple(row) for row in rows)
    return int(any(row.different for row in rows))


if __name__ == "__main__":
    sys.exit(main())
