"""What equilibria and folds with drag may cost, CPU time of one thread: what is allowed over what was measured."""

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import towatlas
from benchmarks.samples import ROOT, SEED
from benchmarks.samples_drag import FAMILIES, SAMPLES, arrays, shape_reference
from benchmarks.targets import Target
from benchmarks.timing import readable
from towatlas.kernels import status
from towatlas.solve.jets import Jets, jets_of
from towatlas.solve.shots import Array, direction_of, shoot
from towatlas.solve.stability import spectrum_of

MANY = 100_000
# What the jets of a shot carry: the slope, and all that a fold is solved with.
SLOPE, FOLD = jets_of(1), jets_of(2, gamma=True, parameter=True)
# Shots of more steps, a few in a hundred, leave the lanes beside them idle at the end.
STEPS = 1000


def measure(
    many: int = 2000,
    grid: tuple[int, int] = (50, 40),
    shots: int = 2000,
    full: bool = True,
    growth: tuple[int, int] = (6, 40),
) -> list[Target]:
    """All of them; processes only where `full`."""
    found = [*_random_systems(many), _grid(*grid), *_shots(shots)]
    found += _growth(*growth)
    return found + (_processes() if full else [])


def _cpu(function: Callable[[], object]) -> float:
    start = time.process_time()
    function()
    return time.process_time() - start


def _allowed(name: str, allowed: float, used: float, note: str) -> Target:
    return Target(f"{name} ({readable(allowed)} allowed)", float(allowed / used), 1.0, note)


def _drawn(rows: int) -> tuple[dict[str, Array], Array]:
    """Systems, half of them in air, half in water, and speeds; others than those of the reference."""
    drawn = [SAMPLES[family](rows // 2, SEED) for family in FAMILIES]
    return arrays([s for part, _ in drawn for s in part]), np.concatenate([gamma for _, gamma in drawn])


def _random_systems(rows: int) -> list[Target]:
    systems, gamma = _drawn(rows)
    found = []
    used = _cpu(lambda: found.append(towatlas.equilibria_many(gamma=gamma, **systems))) / rows
    whole = (found[0].status == status.OK).values
    easy = {name: column[whole] for name, column in systems.items()}
    easy_used = _cpu(lambda: towatlas.equilibria_many(gamma=gamma[whole], **easy)) / whole.sum()
    exact = shape_reference()
    ours = towatlas.equilibria_many(gamma=[given["gamma"] for given in exact.given], **arrays(exact.systems))
    worst = np.nanmax(exact.errors([r[np.isfinite(r)] for r in ours.r_f.values]))
    error = float(found[0].error.where(found[0].status == status.OK).max())
    note = (
        f"{used * MANY / 3600:.2f} CPU hours from {rows} of them, half in air, half in water, seed {SEED}; r_f within "
        f"{error:.0e} by its estimate where searched in full, within {worst:.0e} of the reference"
    )
    easy_note = (
        f"{easy_used * MANY / 3600:.2f} CPU hours; {rows - whole.sum()} left out, some of whose shots are too long"
    )
    allowed = 0.5 * 3600 / MANY
    return [
        _allowed("random systems with drag, 0.5 CPU hours for 100,000", allowed, used, note),
        _allowed("the same, those searched in full", allowed, easy_used, easy_note),
    ]


def _grid(speeds: int, drags: int) -> Target:
    """Neighbours: one cable, its speed over an octave and a half, its drag over a decade."""
    gamma, c = np.geomspace(1.0, 3.0, speeds)[:, None], np.geomspace(0.01, 0.1, drags)
    towatlas.equilibria_many(20.0, 10.0, gamma[:2], C=c[:2])
    found = []
    used = _cpu(lambda: found.append(towatlas.equilibria_many(20.0, 10.0, gamma, C=c))) / (speeds * drags)
    note = (
        f"{used * MANY / 60:.1f} CPU minutes from {speeds} speeds, gamma 1 to 3, by {drags} drags, C 0.01 to 0.1, at "
        f"lam 20, w_f 10; {int(found[0]['count'].min())} to {int(found[0]['count'].max())} shapes"
    )
    return _allowed("systems of a grid, 10 CPU minutes for 100,000", 600.0 / MANY, used, note)


def _growth(rows: int, speeds: int) -> list[Target]:
    """Growth rates of the shapes of neighbours: a few cables, each at speeds half a percent apart."""
    lam, gamma = np.linspace(35.0, 40.0, rows)[:, None], 4.0 * 1.005 ** np.arange(speeds)
    found = []
    for name, c in (("in a vacuum", 0.0), ("in air, C 0.018", 0.018)):
        towatlas.stability_many(lam[:1], 1352.0, gamma[:2], C=c)
        many = []
        used = _cpu(lambda c=c, many=many: many.append(towatlas.stability_many(lam, 1352.0, gamma, C=c)))
        shapes = int(many[0]["count"].sum())
        worst = 0.0
        for k in range(0, speeds, max(1, speeds // 4)):
            row = many[0].isel(system_0=0, system_1=k)
            one = towatlas.stability(float(lam[0, 0]), 1352.0, float(gamma[k]), C=c)
            leading = one.growth + 1j * one.frequency
            near = [int(np.nanargmin(np.abs(row.r_f.values / r_f - 1.0))) for r_f in one.equilibria.r_f]
            ours = row.growth.values[near] + 1j * row.frequency.values[near]
            worst = max(worst, float(np.nanmax(np.abs(ours - leading)) / gamma[k]))
        note = (
            f"{used / shapes * MANY / 60:.1f} CPU minutes from {shapes} shapes, lam 35 to 40, w_f 1352, gamma 4 on; "
            f"within {worst:.0e} gamma of one by one"
        )
        allowed = 600.0 / MANY
        found.append(_allowed(f"growth rates of neighbours {name}, shapes included", allowed, used / shapes, note))
        cables = zip(lam[:, 0], np.linspace(4.0, 7.0, len(lam)), strict=True)
        shapes_of = [towatlas.equilibria(length, 1352.0, speed, C=c) for length, speed in cables]
        found += [_alone(name, shapes_of), _evans(name, shapes_of)]
    return found


def _alone(name: str, found: list[towatlas.Equilibria]) -> Target:
    """Growth rates of the shapes of cables, one cable after the other."""
    times = [min(_cpu(lambda one=one: towatlas.stability_of(one)) for _ in range(3)) for one in found]
    shapes = sum(len(one) for one in found)
    used = sum(times) / shapes
    note = f"{1e3 * used:.1f} ms, {shapes} shapes of {len(found)} cables, lam 35 to 40, w_f 1352, gamma 4 to 7"
    return _allowed(f"leading eigenvalue and count of a shape {name}, 5 ms", 5e-3, used, note)


def _evans(name: str, found: list[towatlas.Equilibria], calls: int = 20) -> Target:
    """The Evans function of each shape, one point alone."""
    times = []
    for one in found:
        for k in range(len(one)):
            spectrum = spectrum_of(one, k)
            motion, sigma = spectrum.motion(spectrum.reach), spectrum.roots.sigma[:1]
            motion.evans(sigma)
            used = min(_cpu(lambda m=motion, at=sigma: [m.evans(at) for _ in range(calls)]) for _ in range(5)) / calls
            times.append((used, len(motion.sizes)))
    used = float(np.mean([time for time, _ in times]))
    note = (
        f"{1e6 * used:.0f} us, {len(times)} shapes; the slowest {1e6 * max(times)[0]:.0f} us, in {max(times)[1]} steps"
    )
    return _allowed(f"one value of the Evans function {name}, 100 us", 1e-4, used, note)


def _shots(rows: int) -> list[Target]:
    systems, gamma = _drawn(rows)
    lam = systems["lam"]
    r = gamma**2 * 10 ** np.random.default_rng(SEED).uniform(-3, np.log10(1.0 + lam))
    table = np.zeros((rows, 9))
    table[:, :7], table[:, 8] = np.stack(list(systems.values()), axis=1), np.inf

    short = shoot(r, gamma, table, SLOPE).steps <= STEPS
    r, gamma, table = r[short], gamma[short], table[short]

    def one(name: str, jets: Jets, allowed: float) -> Target:
        moved = direction_of(("C",), table)
        shoot(r[:8], gamma[:8], table[:8], jets, directions=moved[:8])
        found = []
        used = min(_cpu(lambda: found.append(shoot(r, gamma, table, jets, directions=moved))) for _ in range(5))
        steps = int(found[0].steps.sum())
        which = f"the {len(r)} of {rows} shots of at most {STEPS} steps, {steps / len(r):.0f} a shot"
        note = f"{used / steps * 1e6:.2f} us; {which}"
        return _allowed(f"a step of a lane of shots with drag, {name}", allowed, used / steps, note)

    return [one("slope", SLOPE, 0.7e-6), one(f"{len(FOLD)} derivatives for folds", FOLD, 10e-6)]


def _processes(repeats: int = 3) -> list[Target]:
    """Whole commands, their kernels compiled before."""
    page = (ROOT / "docs" / "scenes.md").read_text()
    with tempfile.TemporaryDirectory() as folder:
        water = Path(folder) / "water.toml"
        water.write_text(page.split("```toml\n", 1)[1].split("```", 1)[0])
        commands = {
            "towatlas equilibria --lam 37.8 --wf 1352 --gamma 5.94 --C 0.018": 0.6,
            "towatlas scene skop-fig3": 1.0,
            f"towatlas scene {water}": 1.0,
        }
        found = []
        for command, allowed in commands.items():
            name = command.replace(str(water), "(in seawater, docs/scenes.md)")
            run = [sys.executable, "-m", *command.split()]
            # As where it is installed: modules are compiled once.
            kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
            kept["PYTHONPYCACHEPREFIX"] = str(Path(folder) / "bytecode")
            times = []
            for _ in range(repeats + 1):
                before = resource.getrusage(resource.RUSAGE_CHILDREN)
                subprocess.run(run, check=True, capture_output=True, env=kept)
                after = resource.getrusage(resource.RUSAGE_CHILDREN)
                times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
            used = float(np.median(times[1:]))
            found.append(_allowed(name, allowed, used, f"{used:.2f} s of CPU"))
    return found
