"""`towatlas diagram`: all branches of shapes of one cable over its speed, with what lasts."""

import argparse
import csv
import sys
from pathlib import Path
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
from towatlas.results_motion import Diagram

FORMATS = (".csv", ".nc", *FIGURE_FORMATS)
SHOWN = ("x_f", "r_f", "depth", "tension")
COLUMNS = ("x_f", "r_f", "z_f", "tension", "growth", "frequency")


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "diagram",
        help="bifurcation diagram: every branch of shapes over the speed, and what of it lasts",
        description="All branches of shapes of one cable between two speeds: solid where a shape lasts, dotted where "
        "it flutters, dashed where it is left at once, with folds and the edges of flutter at their speeds and arrows "
        "where a jump may go. A line for each branch on standard error, samples as a table, or a file or a figure.",
    )
    add_cable(parser, gamma=False, any_medium=True)
    parser.add_argument(
        "--gamma",
        type=span,
        required=True,
        metavar="LOW:HIGH",
        help="from which speed to which, Omega sqrt(R/g), both positive",
    )
    add_fluid(parser)
    parser.add_argument("--show", choices=SHOWN, default="r_f", help="in a figure, over the speed; default %(default)s")
    parser.add_argument("--out", type=Path, metavar="FILE", help="FILE.csv, .nc, .svg, .png or .pdf")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from towatlas.solve.diagram import diagram

    if options.out and options.out.suffix.lower() not in FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FORMATS)}")
    found = diagram(options.lam, options.wf, options.gamma, **fluid(options))
    kind = options.out.suffix.lower() if options.out else ".csv"
    if kind == ".csv":
        _write_csv(found, options.out)
    elif kind == ".nc":
        from towatlas.builders.file import write_atlas

        write_atlas(options.out, found.to_dataset(), {})
        say(f"wrote {options.out}")
    else:
        from towatlas.plot.diagram import plot_diagram

        figure, axes = new_figure(7.2, 5.4)
        plot_diagram(found, axes, options.show)
        save_figure(figure, options.out)
    for branch in found.branches:
        say(repr(branch))
    say(f"looked at: {found.looked_at}")
    return OK if found.complete else FAILED


def _write_csv(found: Diagram, path: Path | None) -> None:
    """A row for each sample."""
    rows = [
        {
            "branch": k,
            "name": branch.name,
            "gamma": float(branch.gamma[i]),
            "nodes": int(branch.nodes[i]),
            **{name: real(getattr(branch, name)[i]) for name in COLUMNS},
            "unstable": int(branch.unstable[i]),
            "kind": str(branch.kind[i]),
        }
        for k, branch in enumerate(found.branches)
        for i in range(len(branch.gamma))
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
