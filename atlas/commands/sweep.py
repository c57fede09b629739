"""`towatlas sweep`: curves of a scene over its length or its speed."""

import argparse
import csv
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from towatlas.commands.common import FIGURE_FORMATS, OK, add_patience, new_figure, print_json, real, save_figure, say
from towatlas.commands.quantities import ends_of
from towatlas.scene.file import read_scene
from towatlas.scene.scene import MODELS, Scene
from towatlas.scene.sweeps import FIELDS, MOST, sweep
from towatlas.scene.units import parse_quantity

if TYPE_CHECKING:
    import xarray

FORMATS = (".csv", ".nc", *FIGURE_FORMATS)
POINTS = 200
# Ranges wider than this are spaced evenly in their logarithm.
WIDE = 10.0
UNITS = {"length": "m", "speed": "m/s"}
RATES = {"growth_1_s": "growth", "frequency_Hz": "frequency"}


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "sweep",
        help="curves of a scene over its length or its speed",
        description="All shapes of a scene at many lengths of its cable or many speeds, with the branch that each is "
        "on and the jumps between. One of --length and --speed is a range A:B; a list A,B,C of the other, or of a key "
        "with --set, makes a family of curves. A table on standard output, or a file or a figure.",
    )
    parser.add_argument("scene", metavar="SCENE", help="a scene, or the name of one that is shipped")
    parser.add_argument("--length", metavar="A:B", help="of the cable, as 0.1R:10R (tow radii), 50m:2km; bare: m")
    parser.add_argument("--speed", metavar="A:B", help="of the tow point, as 1kn:6kn; bare: m/s")
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=V",
        help="another value of a key of the scene, as fish.mass=9kg; again for another key",
    )
    parser.add_argument("--points", type=int, default=POINTS, metavar="N", help="values swept, default %(default)s")
    parser.add_argument("--model", choices=MODELS, help="this one; default: the least that holds along each curve")
    parser.add_argument("--stability", action="store_true", help="also which shapes last; takes longer")
    parser.add_argument("--stable-only", action="store_true", help="only the rows of shapes that are known to last")
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    parser.add_argument("--out", type=Path, metavar="FILE", help="FILE.csv, .nc, .svg, .png or .pdf")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.out and options.out.suffix.lower() not in FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FORMATS)}")
    if not 2 <= options.points <= MOST:
        raise ValueError(f"--points {options.points}: 2 or more, up to {MOST:,}")
    if options.stable_only and options.out and options.out.suffix.lower() != ".csv":
        raise ValueError("--stable-only leaves rows out of a table: --out FILE.csv, or none; a figure has all shapes")
    swept = [name for name in UNITS if ":" in (getattr(options, name) or "")]
    if len(swept) != 1:
        raise ValueError("exactly one of --length and --speed is swept, a range as --length 0.1R:10R")
    (name,) = swept
    changes, labels = _members(options, name)
    scenes = [read_scene(options.scene, one) for one in changes]
    values = _range(f"--{name}", getattr(options, name), UNITS[name], scenes[0].radius, options.points)
    motion = options.stability or options.stable_only
    found = sweep(scenes, **{name: values}, model=options.model, stability=motion)
    found = found.assign_coords(member=("member", labels)) if any(labels) else found
    _write(found, name, scenes, options)
    for k, label in enumerate(labels):
        at = found.jump.values[k][np.isfinite(found.jump.values[k])]
        said = ", ".join(f"{value:.6g} {UNITS[name]}" for value in at) or "none"
        say(f"{label + ': ' if label else ''}{found.model.values[k]} model; jumps at {name} {said}")
        if not found.complete.values[k]:
            say("not everywhere made out: some may be missing")
    return OK


def _members(options: argparse.Namespace, swept: str) -> tuple[list[dict[str, Any]], list[str]]:
    """Changes of the scene for each curve, and their names."""
    given = [pair.partition("=") for pair in options.set]
    if bad := [key for key, equals, value in given if not equals or not key or not value]:
        raise ValueError(f"--set {bad[0]}: as KEY=VALUE, fish.mass=9kg")
    lists = {key: value.split(",") for key, _, value in given}
    other = "length" if swept == "speed" else "speed"
    if getattr(options, other):
        lists[{"length": "cable.length", "speed": "tow.speed"}[other]] = getattr(options, other).split(",")
    families = [key for key, values in lists.items() if len(values) > 1]
    if len(families) > 1:
        raise ValueError(f"one list makes a family of curves, got {' and '.join(families)}")
    count = len(lists[families[0]]) if families else 1
    changes = [
        {key: values[k if len(values) > 1 else 0].strip() for key, values in lists.items()} for k in range(count)
    ]
    labels = [f"{families[0]} = {one[families[0]]}" for one in changes] if families else [""]
    return changes, labels


def _range(option: str, text: str, unit: str, radius: float, points: int) -> np.ndarray:
    """Values from A to B."""
    try:
        parts = ends_of(text)
    except ValueError as error:
        raise ValueError(f"{option} {error}") from None
    if len(parts) != 2:
        raise ValueError(f"{option} {text}: two values, as A:B")
    ends = []
    for part in parts:
        value = part.strip()
        if unit == "m" and value.endswith("R"):
            ends.append(float(parse_quantity(option, float(value[:-1] or 1.0), "")) * radius)
        else:
            try:
                ends.append(parse_quantity(option, float(value), unit))
            except ValueError:
                ends.append(parse_quantity(option, value, unit))
    low, high = ends
    if not 0.0 < low < high < np.inf:
        raise ValueError(f"{option} {text}: from a positive value to a larger one")
    return np.geomspace(low, high, points) if high > WIDE * low else np.linspace(low, high, points)


def _write(found: "xarray.Dataset", name: str, scenes: list[Scene], options: argparse.Namespace) -> None:
    kind = options.out.suffix.lower() if options.out else ".csv"
    if options.out is None or kind == ".csv":
        rows = _rows(found, name, scenes)
        if options.stable_only:
            rows = [row for row in rows if row["kind"] == "stable"]
            if not rows:
                raise ArithmeticError("no shape along the curve is known to last")
        if options.out is None and options.json:
            print_json(rows)
            return
        if options.out is None:
            _write_csv(rows, sys.stdout)
            return
        options.out.parent.mkdir(parents=True, exist_ok=True)
        with options.out.open("w", newline="") as file:
            _write_csv(rows, file)
        say(f"wrote {options.out}")
    elif kind == ".nc":
        from towatlas.builders.file import write_atlas

        write_atlas(options.out, found.assign(expected=found.expected.astype(np.int8)), {})
        say(f"wrote {options.out}")
    else:
        from towatlas.plot.sweep import plot_sweep

        figure, axes = new_figure(7.2, 8.4, rows=4)
        plot_sweep(found, name, axes)
        save_figure(figure, options.out)


def _write_csv(rows: list[dict[str, Any]], file: Any) -> None:
    table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)


def _rows(found: "xarray.Dataset", name: str, scenes: list[Scene]) -> list[dict[str, Any]]:
    """A row for each shape."""
    numbers = [field for field in FIELDS if field not in ("nodes", "branch", "expected")]
    columns = {field: found[field].values for field in (*numbers, "nodes", "branch", "expected")}
    values, shapes = found[name].values, found.shapes.values
    rows = []
    for k, scene in enumerate(scenes):
        label = {"member": str(found.member.values[k])} if "member" in found.coords else {}
        jumps = found.jump.values[k][np.isfinite(found.jump.values[k])]
        for i, value in enumerate(values):
            length = float(value) if name == "length" else scene.length
            speed = float(value) if name == "speed" else scene.speed
            below, above = jumps[jumps <= value], jumps[jumps > value]
            for j in range(shapes[k, i]):
                row: dict[str, Any] = {**label, "length": length, "lam": length / scene.radius, "speed": speed}
                row |= {field: real(columns[field][k, i, j]) for field in numbers}
                row |= {"shapes": int(shapes[k, i]), "nodes": int(columns["nodes"][k, i, j])}
                row |= {"branch": int(columns["branch"][k, i, j]), "expected": bool(columns["expected"][k, i, j])}
                if "kind" in found:
                    row |= {"kind": str(found.kind.values[k, i, j])}
                    row |= {name_: real(found[of].values[k, i, j]) for name_, of in RATES.items()}
                row["jump_below"] = float(below.max()) if len(below) else None
                row["jump_above"] = float(above.min()) if len(above) else None
                rows.append(row)
    return rows
