"""`python -m benchmarks.scenes`: random scenes in air and in water, each asked whether it contradicts itself.

The number of shapes has to change by two across every jump that a scene states, and nowhere else between the speeds it
looked at: shapes are counted just beside each jump and at random speeds between. Writes docs/data/scenes.csv, a row a
scene, and prints how many agree.
"""

import argparse
import csv
import sys
import time
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields
from pathlib import Path

import numpy as np

import towatlas
from towatlas.scene.file import make_scene
from towatlas.scene.jumps import LOOKED, answer_scene
from towatlas.scene.scene import Scene

DATA = Path(__file__).parent.parent / "docs" / "data" / "scenes.csv"
# Counted so near to a jump, as a share of the way to the next, and at so many random places between.
BESIDE, BETWEEN = 1e-4, 3
GROUPS = ("lam", "w_f", "m_f", "C", "C_f", "w")


@dataclass(frozen=True)
class Checked:
    """One scene: its groups by the model used, jumps stated, shapes at its speed, and what contradicts them.

    contradicts : speeds at which the count differs, "" where none does; refused : why there is no answer, or "".
    """

    number: int
    medium: str
    model: str
    lam: float
    w_f: float
    m_f: float
    C: float
    C_f: float
    w: float
    gamma: float
    jumps: int
    shapes: int
    contradicts: str
    refused: str
    seconds: float


def random_scene(number: int, seed: int) -> tuple[str, Scene]:
    """The medium and a scene of sizes that people tow; depends on the seed and its number alone."""
    rng = np.random.default_rng((seed, number))
    water = number % 2 == 1
    radius = 10 ** rng.uniform(0.5, 3.5)
    speed = 10 ** (rng.uniform(-0.5, 1.0) if water else rng.uniform(0.5, 2.0))
    table = {
        "cable": {
            "length": radius * 10 ** rng.uniform(-0.3, 1.2),
            "mass_per_length": 10 ** (rng.uniform(-0.7, 0.5) if water else rng.uniform(-2.0, 0.0)),
            "diameter": 10 ** rng.uniform(-2.7, -1.9),
            "drag_coefficient": rng.uniform(0.8, 1.8),
        },
        "fish": {
            "mass": 10 ** rng.uniform(0.0, 2.5),
            "volume": 10 ** rng.uniform(-4.0, -2.5),
            "drag_coefficient": rng.uniform(0.1, 1.2),
            "frontal_area": 10 ** rng.uniform(-3.0, -1.0),
        },
        "tow": {"radius": radius, "speed": speed},
        "fluid": {"name": "seawater" if water else "air"},
    }
    return "water" if water else "air", make_scene(table)


def check(number: int, seed: int) -> Checked:
    """Answer a scene, and count shapes beside and between its jumps."""
    medium, scene = random_scene(number, seed)
    began = time.process_time()
    try:
        answer = answer_scene(scene)
    except ArithmeticError as error:
        groups = scene.system(medium)
        numbers = [getattr(groups, name) for name in GROUPS]
        seconds = time.process_time() - began
        return Checked(number, medium, "", *numbers, scene.gamma, 0, 0, "", str(error)[:200], round(seconds, 2))
    used = answer.choice.answer
    folds, system = answer.folds, used.system
    assert folds is not None
    edges = np.concatenate([[scene.gamma * LOOKED[0]], folds.gamma, [scene.gamma * LOOKED[1]]])
    places = np.concatenate([[BESIDE], np.random.default_rng(number).random(BETWEEN), [1.0 - BESIDE]])
    speeds = edges[:-1] + np.diff(edges) * places[:, None]
    fluid = {name: getattr(system, name) for name in ("m_f", "C", "C_f", "w", "C_t")}
    counts = towatlas.equilibria_many(system.lam, system.w_f, speeds, **fluid)["count"].values
    here = len(answer.equilibria)
    between = np.append(folds.shapes_below, folds.shapes_above[-1:] if len(folds) else here)
    bad = [f"{gamma:.9g}" for gamma in speeds[counts != between]]
    if (np.abs(np.diff(between)) != 2).any() or here != between[np.searchsorted(folds.gamma, scene.gamma)]:
        bad.append(f"{scene.gamma:.9g}")
    refused = "" if folds.complete else f"not all made out: {folds.searched}"
    return Checked(
        number,
        medium,
        used.model,
        *(getattr(system, name) for name in GROUPS),
        scene.gamma,
        len(folds),
        here,
        " ".join(bad),
        refused,
        round(time.process_time() - began, 2),
    )


def check_all(count: int, seed: int) -> Iterator[Checked]:
    """Scenes 0..count - 1."""
    for number in range(count):
        yield check(number, seed)


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--out", type=Path, default=DATA)
    options = parser.parse_args(arguments)
    rows = []
    options.out.parent.mkdir(parents=True, exist_ok=True)
    with options.out.open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([field.name for field in fields(Checked)])
        for row in check_all(options.count, options.seed):
            rows.append(row)
            table.writerow(astuple(row))
            file.flush()
    bad, refused = [row for row in rows if row.contradicts], [row for row in rows if row.refused]
    print(
        f"{len(rows)} scenes, {sum(row.jumps for row in rows)} jumps, {sum(row.jumps > 0 for row in rows)} with any: "
        f"{len(bad)} contradict themselves, {len(refused)} were refused or not made out"
    )
    for row in [*bad, *refused]:
        print(f"#{row.number} {row.medium}: {row.contradicts or row.refused}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
