"""`towatlas shape`: the shape of one equilibrium, as a file or a figure."""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from towatlas.commands.common import (
    FIGURE_FORMATS,
    OK,
    add_cable,
    add_fluid,
    add_patience,
    fluid,
    new_figure,
    number,
    save_figure,
    say,
)
from towatlas.kernels.system import COLUMNS as SYSTEM
from towatlas.solve.shapes import POINTS, shape

FORMATS = (".nc", ".csv", *FIGURE_FORMATS)
MOST_POINTS = 10**6
COLUMNS = ("s", "x", "y", "z", "R_x", "R_y", "R_z", "T")


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "shape",
        help="the shape of one equilibrium",
        description="Position, force and tension along the cable in one of its equilibria: as a table on standard "
        "output, or as a file or a figure.",
    )
    add_cable(parser, any_medium=True)
    add_fluid(parser)
    parser.add_argument(
        "--root",
        default="expected",
        metavar="ROOT",
        help="expected (the default), in a vacuum median, the name of a branch of `towatlas equilibria` as outward or "
        "'2 inner', or a row of that list, counted from 0",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--points", type=int, default=POINTS, metavar="N", help="evenly spaced, default %(default)s")
    where.add_argument("--s", type=number, nargs="+", metavar="S", help="arc lengths from the tow point [tow radii]")
    parser.add_argument("--out", type=Path, metavar="FILE", help="FILE.nc, .csv, .svg, .png or .pdf")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.out and options.out.suffix.lower() not in FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FORMATS)}")
    if not 2 <= options.points <= MOST_POINTS:
        raise ValueError(f"--points {options.points}: a shape has 2 points or more, up to {MOST_POINTS:,}")
    root = int(options.root) if options.root.isdecimal() else options.root
    arc = options.s if options.s else np.linspace(0.0, options.lam, options.points)
    curve = shape(options.lam, options.wf, options.gamma, root=root, s=arc, **fluid(options))
    kind = options.out.suffix.lower() if options.out else ".csv"
    if kind == ".nc":
        from towatlas.builders.file import write_atlas

        write_atlas(options.out, curve, {})
    elif kind == ".csv":
        _write_csv(curve, options.out)
    else:
        from towatlas.plot.shape import plot_shape

        figure, axes = new_figure(5.2, 6.4, "compressed")
        plot_shape(curve, axes)
        save_figure(figure, options.out)
        return OK
    if options.out:
        say(f"wrote {options.out}")
    return OK


def _write_csv(curve: Any, path: Path | None) -> None:
    named = ("lam", "w_f", "gamma", "R_x0", *(name for name in SYSTEM if name not in ("lam", "w_f")))
    facts = ", ".join(f"{name} = {curve.attrs[name]!r}" for name in named)
    rows = np.stack([curve[name].values for name in COLUMNS], axis=1)
    header = f"# {facts}, branch = {curve.attrs['branch']}, nodes = {curve.attrs['nodes']}\n{','.join(COLUMNS)}"
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(path or sys.stdout, rows, fmt="%.17g", delimiter=",", header=header, comments="")
