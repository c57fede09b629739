"""`towatlas stability`: which shapes of one cable at one speed last, and how fast the others are left."""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from towatlas.commands.common import (
    FAILED,
    OK,
    OUTSIDE,
    add_cable,
    add_fluid,
    add_patience,
    fluid,
    print_json,
    real,
    say,
)
from towatlas.kernels import status
from towatlas.results_motion import Stability
from towatlas.tables.atlas import open_atlas

# Of shapes that are said something of so many are named.
NAMED = 8


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "stability",
        help="growth rates of small motions about each shape: stable, divergence or flutter",
        description="For every shape in which a cable can be towed at one speed: the eigenvalue that grows most, or "
        "damps least, as growth and frequency (radians) in sqrt(g/R), how many grow, and what that is called. "
        "divergence: it leaves without turning; flutter: in growing swings; weak: below 0.01 gamma.",
    )
    add_cable(parser, any_medium=True)
    add_fluid(parser)
    parser.add_argument(
        "--atlas",
        type=Path,
        metavar="FILE",
        help="look the median shape in a vacuum up in a file made by `towatlas build --stability` instead",
    )
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.atlas is not None:
        return _look_up(options)
    from towatlas.solve.stability import stability

    found = stability(options.lam, options.wf, options.gamma, **fluid(options))
    rows = [_row(found, k) for k in range(len(found))]
    if options.json:
        print_json(rows)
    else:
        _print_table(rows)
    for code in np.unique(found.status[found.status != status.OK]):
        some = found.equilibria.branch[found.status == code]
        more = f" and {len(some) - NAMED} more" if len(some) > NAMED else ""
        say(f"{', '.join(map(str, some[:NAMED]))}{more}: {status.SENTENCES[int(code)]}")
    say(f"looked at: {found.looked_at}")
    unfinished = (found.status == status.UNFINISHED).any()
    return OK if (found.status == status.OK).any() and not unfinished else FAILED


def _look_up(options: argparse.Namespace) -> int:
    """The median shape, from an atlas."""
    if fluid(options):
        raise ValueError("--atlas holds growth rates in a vacuum: leave the fluid out, or leave --atlas out to compute")
    atlas = open_atlas(options.atlas)
    cable = options.lam, options.wf, abs(options.gamma)
    found = atlas.growth(*cable, outside="nan")
    if found.status != status.OK:
        try:
            atlas.growth(*cable)
        except ValueError as error:
            say(str(error).split("; outside=")[0] + "; without --atlas it is computed")
        return OUTSIDE
    n = int(found.n)
    row = {
        "branch": f"{n} inner" if n else "outward",
        "R_x0": None,
        "r_f": None,
        "nodes": n,
        "growth": real(found.growth),
        "frequency": real(found.frequency),
        "unstable": int(found.unstable),
        "index": 2 * n,
        "kind": str(found.kind),
        "error": real(found.error),
        "status": status.FLAG_MEANINGS.split()[int(found.status)],
    }
    print_json([row]) if options.json else _print_table([row])
    say("looked up: the median shape, in a vacuum")
    return OK


def _row(found: Stability, k: int) -> dict[str, Any]:
    shapes = found.equilibria
    return {
        "branch": str(shapes.branch[k]),
        "R_x0": real(shapes.R_x0[k]),
        "r_f": real(shapes.r_f[k]),
        "nodes": int(shapes.nodes[k]),
        "growth": real(found.growth[k]),
        "frequency": real(found.frequency[k]),
        "unstable": int(found.unstable[k]) if found.unstable[k] >= 0 else None,
        "index": int(found.index[k]) if found.index[k] >= 0 else None,
        "kind": str(found.kind[k]),
        "error": real(found.error[k]),
        "status": status.FLAG_MEANINGS.split()[int(found.status[k])],
    }


def _print_table(rows: list[dict[str, Any]]) -> None:
    print(
        f"{'branch':>8} {'R_x0':>20} {'r_f':>16} {'nodes':>5} {'growth':>18} {'frequency':>16} {'error':>8} "
        f"{'unstable':>8} {'index':>5}  kind"
    )
    for row in rows:
        growth, frequency, error, r_x0, r_f = (
            "-" if row[name] is None else format(row[name], style)
            for name, style in (
                ("growth", ".11g"),
                ("frequency", ".11g"),
                ("error", ".1e"),
                ("R_x0", ".13g"),
                ("r_f", ".10g"),
            )
        )
        unstable, index = ("-" if row[name] is None else row[name] for name in ("unstable", "index"))
        print(
            f"{row['branch']:>8} {r_x0:>20} {r_f:>16} {row['nodes']:>5} {growth:>18} "
            f"{frequency:>16} {error:>8} {unstable:>8} {index:>5}  {row['kind']}"
        )
