"""`python -m benchmarks.patience`: random commands and scenes, each answered or refused within the time it is given.

Numbers are uniform in their logarithms over twelve decades, in random units. Commands run in a worker that keeps the
kernels loaded; one that takes more than twice its patience is killed, and a new one started. Writes
docs/data/patience.csv.gz, a row a command, and prints how many ended how, and the slowest.
"""

import argparse
import contextlib
import csv
import gzip
import io
import json
import shlex
import signal
import subprocess
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import numpy as np

from towatlas.effort import SECONDS

DATA = Path(__file__).parent.parent / "docs" / "data" / "patience.csv.gz"
ROOT = Path(__file__).parent.parent
MEDIA = ("vacuum", "air", "water")
DECADES = 12.0
# In place of an exit code.
TRACEBACK, KILLED = -1, -2
SLOWEST = 10
Rng = np.random.Generator


@dataclass(frozen=True)
class Run:
    """One command: its number, medium and arguments; exit code, CPU seconds without compiling, why it has no answer."""

    number: int
    medium: str
    command: str
    exit: int
    seconds: float
    message: str
    arguments: str


@dataclass(frozen=True)
class Case:
    """A command to be run, and the text of the scene file it reads, if any."""

    number: int
    medium: str
    arguments: list[str]
    scene: str


def wide(rng: Rng, middle: float = 1.0, decades: float = DECADES) -> float:
    """A number, uniform in its logarithm about `middle`."""
    return float(middle * 10.0 ** rng.uniform(-0.5 * decades, 0.5 * decades))


# The unit of each key, with the middle of its decades in SI, and how people write it.
UNITS = {
    "m": {"m": 1.0, "km": 1e3, "ft": 0.3048, "in": 0.0254, "mm": 1e-3, "nmi": 1852.0},
    "kg/m": {"kg/m": 1.0, "g/ft": 1e-3 / 0.3048, "lb/ft": 1.488, "g/m": 1e-3},
    "kg": {"kg": 1.0, "g": 1e-3, "lb": 0.4536, "t": 1e3},
    "m/s": {"m/s": 1.0, "kn": 0.5144, "km/h": 1 / 3.6, "mph": 0.447},
    "rad/s": {"rad/s": 1.0, "rpm": 0.1047, "rev/s": 6.283},
    "m^2": {"m^2": 1.0, "cm^2": 1e-4, "in^2": 6.45e-4},
    "m^3": {"m^3": 1.0, "l": 1e-3, "cm^3": 1e-6},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1e3},
    "m/s^2": {"m/s^2": 1.0},
    "": {"": 1.0},
}
# Key, its unit and its middle, and how often it is there.
KEYS = {
    "cable": (
        ("length", "m", 100.0, 1.0),
        ("mass_per_length", "kg/m", 0.1, 1.0),
        ("diameter", "m", 0.01, 0.95),
        ("drag_coefficient", "", 1.2, 0.95),
    ),
    "fish": (
        ("mass", "kg", 1.0, 1.0),
        ("volume", "m^3", 1e-3, 0.7),
        ("added_mass", "kg", 1.0, 0.3),
        ("drag_coefficient", "", 1.0, 0.95),
        ("frontal_area", "m^2", 0.1, 0.95),
    ),
}
SPEEDS = (("speed", "m/s", 1.0), ("rotation_rate", "rad/s", 1.0), ("gamma", "", 1.0))
# What a slip of the hand makes of a number.
SLIPS = ("0", "-1", "nan", "inf", "1e999999999", "1/0", '"1e999999999 m"', '"9**9**9 m"', '"3 furlongs"', "1" * 400)
SLIPS_A_KEY = 0.003


def quantity(rng: Rng, unit: str, middle: float) -> str:
    """A quantity as a scene has it: a bare number, or a text with a unit."""
    if rng.random() < SLIPS_A_KEY:
        return str(rng.choice(SLIPS))
    value = wide(rng, middle)
    if unit == "" or rng.random() < 0.3:
        return f"{value:.6g}"
    name = str(rng.choice(list(UNITS[unit])))
    return f'"{value / UNITS[unit][name]:.6g} {name}"'


def scene_text(rng: Rng, medium: str) -> str:
    """A scene file."""
    lines = [f"tolerance = {wide(rng, 0.01, 4.0):.3g}"] if rng.random() < 0.3 else []
    lines += [f"gravity = {quantity(rng, 'm/s^2', 9.8)}"] if rng.random() < 0.1 else []
    for section, keys in KEYS.items():
        if section == "fish" and rng.random() < 0.2:
            continue
        lines.append(f"[{section}]")
        lines += [f"{key} = {quantity(rng, unit, middle)}" for key, unit, middle, often in keys if rng.random() < often]
    key, unit, middle = SPEEDS[rng.integers(len(SPEEDS))]
    lines += ["[tow]", f"radius = {quantity(rng, 'm', 10.0)}", f"{key} = {quantity(rng, unit, middle)}", "[fluid]"]
    named = {"vacuum": "vacuum", "air": "air", "water": "seawater"}[medium]
    density = {"vacuum": None, "air": 1.2, "water": 1e3}[medium]
    bare = density is None or rng.random() < 0.5
    lines.append(f'name = "{named}"' if bare else f"density = {quantity(rng, 'kg/m^3', density or 1.0)}")
    return "\n".join(lines) + "\n"


def cable(rng: Rng, gamma: bool = True) -> list[str]:
    """Options of a cable."""
    numbers = {"lam": wide(rng, 10.0), "wf": 0.0 if rng.random() < 0.1 else wide(rng)}
    if gamma:
        numbers["gamma"] = wide(rng)
    return [f"--{name}={value:.6g}" for name, value in numbers.items()]


def fluid(rng: Rng, medium: str) -> list[str]:
    """Options of a fluid."""
    if medium == "vacuum":
        return []
    numbers = {"C": wide(rng, 0.1)}
    if rng.random() < 0.3:
        numbers["C-f"] = wide(rng, 0.1)
    if rng.random() < 0.1:
        numbers["C-t"] = wide(rng, 0.01)
    if medium == "water":
        numbers |= {"w": float(rng.uniform(-1.0, 1.0)), "m-f": wide(rng)}
    if rng.random() < 0.1:
        numbers |= {"C-s": float(rng.choice([-1.0, 1.0])) * wide(rng, 0.1), "b-s": wide(rng, 0.1, 4.0)}
    return [f"--{name}={value:.6g}" for name, value in numbers.items()]


def _critical(rng: Rng, medium: str) -> list[str]:
    arguments = ["critical", *cable(rng, gamma=False), "--atlas", "atlas.nc"]
    arguments += ["--solve"] if rng.random() < 0.7 else []
    arguments += [f"--n={int(max(1.0, wide(rng, 10.0, 9.0)))}"] if rng.random() < 0.5 else []
    return arguments + ([f"--C={wide(rng, 0.1):.6g}"] if medium != "vacuum" else [])


def _equilibria(rng: Rng, medium: str) -> list[str]:
    return ["equilibria", *cable(rng), *fluid(rng, medium)]


def _folds(rng: Rng, medium: str) -> list[str]:
    low = wide(rng)
    return [
        "folds",
        *cable(rng, gamma=False),
        f"--gamma={low:.6g}:{low * 10.0 ** rng.uniform(0, 3):.6g}",
        *fluid(rng, medium),
    ]


def _shape(rng: Rng, medium: str) -> list[str]:
    root = str(rng.choice(["expected", "outward", "median", "1 inner", "0"]))
    return ["shape", *cable(rng), *fluid(rng, medium), f"--root={root}", f"--points={rng.integers(2, 2000)}"]


def _fish(rng: Rng, medium: str) -> list[str]:
    solve = ["--solve"] if rng.random() < 0.8 else []
    return ["fish", *cable(rng), "--table", "equilibria.nc", *solve]


def _scene(rng: Rng, medium: str) -> list[str]:
    model = [f"--model={rng.choice(MEDIA)}"] if rng.random() < 0.2 else []
    return ["scene", "scene.toml", "--atlas", "atlas.nc", *model, *_speed(rng)]


def _design(rng: Rng, medium: str) -> list[str]:
    arguments = ["design", "--scene", "scene.toml", f"--depth={wide(rng, 50.0):.6g}"]
    for option, middle in (("max-length", 200.0), ("max-radius", 50.0)):
        arguments += [f"--{option}={wide(rng, middle):.6g}"] if rng.random() < 0.3 else []
    return [*arguments, *_speed(rng)]


def _speed(rng: Rng) -> list[str]:
    return [f"--{rng.choice(['speed', 'rpm', 'gamma'])}={wide(rng):.6g}"] if rng.random() < 0.2 else []


# Every command that computes; those that read scene.toml are given one.
COMMANDS: dict[str, Callable[[Rng, str], list[str]]] = {
    "critical": _critical,
    "equilibria": _equilibria,
    "folds": _folds,
    "shape": _shape,
    "fish": _fish,
    "scene": _scene,
    "design": _design,
}


def cases(count: int, seed: int, media: Iterable[str] = MEDIA, patience: float = SECONDS) -> list[Case]:
    """Random commands; each depends on the seed and its number alone."""
    made, media = [], tuple(media)
    for number in range(count):
        rng = np.random.default_rng((seed, number))
        medium = str(rng.choice(media))
        arguments = [*COMMANDS[str(rng.choice(list(COMMANDS)))](rng, medium), "--patience", f"{patience:g}"]
        arguments += ["--json"] if arguments[0] != "shape" and rng.random() < 0.5 else []
        made.append(Case(number, medium, arguments, scene_text(rng, medium) if "scene.toml" in arguments else ""))
    return made


def make_tables(folder: Path) -> None:
    """A small atlas and a small table of equilibria for the commands to look into."""
    from towatlas.builders.critical import build_atlas
    from towatlas.builders.fish import build_equilibria
    from towatlas.builders.grids import EquilibriaGrid, Grid, ScanSettings

    grid = Grid(
        n_max=2, series_w_f=6, series_excess=8, error_blocks=2, w_f=np.array([0.0, 1.0]), lam=np.array([3.0, 9.0])
    )
    scan = ScanSettings(speeds=40, guesses=64, w_f=np.array([1.0]), lam=np.array([5.0]), n_max=2)
    build_atlas(folder / "atlas.nc", grid=grid, scan=scan, progress=False)
    equilibria = EquilibriaGrid(
        w_f=np.concatenate([[0.0], 10.0 ** np.linspace(-2, 2, 9)]),
        lam=10.0 ** np.linspace(0, 1, 13),
        gamma=10.0 ** np.linspace(-1, 0.5, 25),
    )
    build_equilibria(folder / "equilibria.nc", grid=equilibria, progress=False)


def run_case(case: Case, folder: Path) -> Run:
    """Run one command in this process."""
    from towatlas.cli import main

    (folder / "scene.toml").write_text(case.scene)
    arguments = [str(folder / word) if (folder / word).is_file() else word for word in case.arguments]
    out, err = io.StringIO(), io.StringIO()
    began = time.process_time()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(arguments)
        except SystemExit as exit_:
            code = exit_.code if isinstance(exit_.code, int) else TRACEBACK
        except Exception as error:
            code = TRACEBACK
            print(f"{type(error).__name__}: {error}", file=err)
    seconds = time.process_time() - began
    said = [line for line in err.getvalue().splitlines() if "compiling, once" not in line and "usage:" not in line]
    # Which numbers it was is in the arguments, or follows from the seed.
    message = next((line for line in said if "rror" in line), said[0] if said else "")[:200] if code else ""
    return _run(case, code, seconds, message.replace(str(folder), "."))


def _run(case: Case, code: int, seconds: float, message: str) -> Run:
    return Run(
        case.number, case.medium, case.arguments[0], code, round(seconds, 3), message, shlex.join(case.arguments[1:])
    )


def work(folder: Path, limit: float) -> None:
    """Answer commands that come as lines of JSON, each within `limit` CPU seconds, or be killed."""
    # What is compiled first would be counted.
    for arguments in (
        ["equilibria", "--lam=500", "--wf=1", "--gamma=9"],
        ["critical", "--lam=500", "--wf=1", "--solve"],
        ["equilibria", "--lam=5", "--wf=1", "--gamma=1", "--C=0.1"],
        ["critical", "--lam=5", "--wf=1", "--solve", "--C=0.1"],
        ["folds", "--lam=5", "--wf=1", "--gamma=1:2", "--C=0.1"],
    ):
        run_case(Case(0, "", arguments, ""), folder)
    for line in sys.stdin:
        # Its default is to end the process, inside a kernel, too.
        signal.setitimer(signal.ITIMER_PROF, limit)
        answer = run_case(Case(**json.loads(line)), folder)
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        print(json.dumps(astuple(answer)), flush=True)


def _worker(folder: Path, limit: float) -> subprocess.Popen:
    command = [sys.executable, "-m", "benchmarks.patience", "--work", str(folder), "--limit", str(limit)]
    return subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def run_all(some: list[Case], limit: float) -> Iterator[Run]:
    """Run commands in a worker, started anew when it is killed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        make_tables(folder)
        worker = None
        for case in some:
            worker = worker or _worker(folder, limit)
            assert worker.stdin is not None
            assert worker.stdout is not None
            worker.stdin.write(json.dumps(case.__dict__) + "\n")
            worker.stdin.flush()
            line = worker.stdout.readline()
            if line:
                yield Run(*json.loads(line))
            else:
                signal_ = -worker.wait()
                yield _run(case, KILLED, limit, f"killed by signal {signal_}")
                with contextlib.suppress(BrokenPipeError):
                    worker.stdin.close()
                worker.stdout.close()
                worker = None
        if worker is not None:
            worker.communicate()


def write(runs: list[Run], path: Path) -> None:
    """A row a command, in the order of their numbers; the same bytes for the same rows."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([field.name for field in fields(Run)])
    table.writerows(astuple(run) for run in sorted(runs, key=lambda run: run.number))
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(text.getvalue().encode(), mtime=0))


def read(path: Path) -> list[Run]:
    """What `write` wrote; nothing where there is no file."""
    if not path.exists():
        return []
    rows = csv.DictReader(io.StringIO(gzip.decompress(path.read_bytes()).decode()))
    kinds = {"number": int, "exit": int, "seconds": float}
    return [Run(**{name: kinds.get(name, str)(text) for name, text in row.items()}) for row in rows]


def summary(runs: list[Run]) -> str:
    """How many ended how, with the longest time, and the slowest."""
    groups: dict[tuple[str, str, int], list[float]] = defaultdict(list)
    for run in runs:
        groups[run.command, run.medium, run.exit].append(run.seconds)
    lines = [f"{'command':<11} {'medium':<7} {'exit':>4} {'count':>6} {'median s':>9} {'max s':>8}"]
    for (command, medium, code), seconds in sorted(groups.items()):
        lines.append(
            f"{command:<11} {medium:<7} {code:>4} {len(seconds):>6} {np.median(seconds):>9.3f} {max(seconds):>8.2f}"
        )
    lines += ["", "the slowest"]
    for run in sorted(runs, key=lambda run: -run.seconds)[:SLOWEST]:
        lines.append(f"{run.seconds:>8.2f} s exit {run.exit} #{run.number} {run.command} {run.arguments}")
        lines.append(f"{'':>11}{run.message}")
    lines += [f"#{run.number} {run.command} {run.arguments}: {run.message}" for run in runs if not 0 <= run.exit <= 5]
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--resume", action="store_true", help="keep the rows that --out has, and run the others")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--media", nargs="+", choices=MEDIA, default=MEDIA)
    parser.add_argument("--patience", type=float, default=SECONDS, help="of each command, s")
    parser.add_argument("--out", type=Path, default=DATA)
    parser.add_argument("--work", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--limit", type=float, help="CPU seconds after which a command is killed; default twice that")
    options = parser.parse_args(arguments)
    limit = options.limit or 2.0 * options.patience
    if options.work:
        work(options.work, limit)
        return 0
    runs = read(options.out) if options.resume else []
    done = {run.number for run in runs}
    every = cases(options.count, options.seed, options.media, options.patience)
    for run in run_all([case for case in every if case.number not in done], limit):
        runs.append(run)
        if len(runs) % 100 == 0:
            write(runs, options.out)
    write(runs, options.out)
    print(summary(runs))
    return 0 if all(0 <= run.exit <= 5 for run in runs) else 1


if __name__ == "__main__":
    sys.exit(main())
