"""`towatlas diagram`: all branches of shapes of a cable or a scene over speed or length, with what lasts."""

import argparse
import csv
import sys
from pathlib import Path
from textwrap import fill
from typing import Any

from towatlas.commands.common import (
    FAILED,
    FIGURE_FORMATS,
    OK,
    add_cable,
    add_fluid,
    add_patience,
    fluid,
    new_figure,
    real,
    save_figure,
    say,
)
from towatlas.commands.folds import span
from towatlas.commands.quantities import range_of
from towatlas.commands.scene_seen import lines_of
from towatlas.results_motion import Diagram
from towatlas.scene.diagrams import SceneDiagram, scene_diagram
from towatlas.scene.file import read_scene
from towatlas.scene.scene import MODELS

FORMATS = (".csv", ".nc", *FIGURE_FORMATS)
SHOWN = ("x_f", "r_f", "depth", "tension")
COLUMNS = ("x_f", "r_f", "z_f", "tension", "growth", "frequency")
# Of a scene.
IN_SI = {"x_f": "x_f_m", "r_f": "r_f_m", "z_f": "z_f_m", "tension": "tension_N"}
IN_SI |= {"growth": "growth_1_s", "frequency": "frequency_Hz"}
UNITS = {"speed": "m_s", "length": "m"}


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "diagram",
        help="bifurcation diagram: every branch of shapes over the speed or the length, and what of it lasts",
        description="All branches of shapes of one cable between two speeds, or of a scene between two speeds or two "
        "lengths: solid where a shape lasts, dotted where it flutters, dashed where it is left at once, with folds and "
        "the edges of flutter at their values and arrows where a jump may go. What is seen, or a line for each branch, "
        "on standard error, samples as a table, or a file or a figure.",
    )
    parser.add_argument("scene", nargs="?", metavar="SCENE", help="a scene, or the name of one that is shipped")
    parser.add_argument("--speed", type=range_of("m/s"), metavar="LOW:HIGH", help="of a scene, as 1kn:8kn; bare: m/s")
    parser.add_argument("--length", type=range_of("m"), metavar="LOW:HIGH", help="of its cable, as 10m:40m; bare: m")
    parser.add_argument("--model", choices=MODELS, help="of a scene; default: the least that holds, with drag")
    add_cable(parser, gamma=False, any_medium=True, required=False)
    parser.add_argument(
        "--gamma", type=span, metavar="LOW:HIGH", help="from which speed to which, Omega sqrt(R/g), both positive"
    )
    add_fluid(parser)
    parser.add_argument("--show", choices=SHOWN, help="in a figure; default depth of a scene, else r_f")
    parser.add_argument("--out", type=Path, metavar="FILE", help="FILE.csv, .nc, .svg, .png or .pdf")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.out and options.out.suffix.lower() not in FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FORMATS)}")
    found = _of_scene(options) if options.scene else _of_cable(options)
    kind = options.out.suffix.lower() if options.out else ".csv"
    words = lines_of(found) if isinstance(found, SceneDiagram) else [repr(branch) for branch in found.branches]
    if kind == ".csv":
        _write_csv(found, options.out)
    elif kind == ".nc":
        from towatlas.builders.file import write_atlas

        write_atlas(options.out, found.to_dataset(), {})
        say(f"wrote {options.out}")
    else:
        _draw(found, words, options)
    for line in words:
        say(line)
    say(f"looked at: {found.looked_at}")
    return OK if found.complete else FAILED


def _of_cable(options: argparse.Namespace) -> Diagram:
    from towatlas.solve.diagram import diagram

    missing = [f"--{name}" for name in ("lam", "wf", "gamma") if getattr(options, name) is None]
    if missing:
        raise ValueError(f"{', '.join(missing)} missing; or name a scene, as towatlas diagram skop-fig3 --speed 1:2")
    if options.speed or options.length or options.model:
        raise ValueError("--speed, --length and --model are for a scene; of a cable --gamma is the range")
    return diagram(options.lam, options.wf, options.gamma, **fluid(options))


def _of_scene(options: argparse.Namespace) -> SceneDiagram:
    given = [name for name in ("lam", "wf", "gamma") if getattr(options, name) is not None]
    if given or fluid(options):
        raise ValueError(f"a scene has a cable and a fluid of its own: leave out {', '.join(given) or 'the fluid'}")
    if (options.speed is None) == (options.length is None):
        raise ValueError("exactly one of --speed and --length is a range, as --speed 1kn:8kn")
    name = "speed" if options.speed else "length"
    over = getattr(options, name)
    ends = {name: (over.low, over.high)}
    return scene_diagram(read_scene(options.scene), **ends, model=options.model, unit=over.unit, size=over.size)


def _draw(found: Diagram | SceneDiagram, words: list[str], options: argparse.Namespace) -> None:
    from towatlas.plot.diagram import plot_diagram

    figure, axes = new_figure(7.2, 6.0 if options.scene else 5.4)
    plot_diagram(found, axes, options.show or ("depth" if options.scene else "r_f"))
    if isinstance(found, SceneDiagram):
        title = f"{found.scene.title or found.scene.source}, {found.model} model"
        text = "\n".join(fill(line, 118) for line in words)
        axes.set_title(title, fontsize=9)
        figure.supxlabel(text, x=0.02, ha="left", fontsize=7)
    save_figure(figure, options.out)


def _write_csv(found: Diagram | SceneDiagram, path: Path | None) -> None:
    """A row for each sample; of a scene in SI."""
    names = IN_SI | {"value": f"{found.moved}_{UNITS[found.moved]}"} if isinstance(found, SceneDiagram) else {}
    rows = [
        {
            "branch": k,
            "name": branch.name,
            names.get("value", found.moved): float(branch.value[i]),
            "nodes": int(branch.nodes[i]),
            **{names.get(name, name): real(getattr(branch, name)[i]) for name in COLUMNS},
            "unstable": int(branch.unstable[i]),
            "kind": str(branch.kind[i]),
        }
        for k, branch in enumerate(found.branches)
        for i in range(len(branch.value))
    ]
    if path is None:
        _write(rows, sys.stdout)
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        _write(rows, file)
    say(f"wrote {path}")


def _write(rows: list[dict[str, Any]], file: Any) -> None:
    table = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
