"""`towatlas fish`: where the fish is, from a table of equilibria."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import FAILED, NO_STATE, OK, OUTSIDE, add_cable, add_patience, print_json, say
from towatlas.kernels import status
from towatlas.tables.atlas import open_atlas
from towatlas.tables.file import data_folder
from towatlas.tables.fish import BRANCHES


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "fish",
        help="position of the fish, from a table of equilibria",
        description="Position of the fish on the median and on the outward branch, from a table built with `towatlas "
        "build --equilibria`. Next to a critical speed, where the table is not interpolated, it is solved directly.",
    )
    add_cable(parser)
    parser.add_argument("--branch", choices=BRANCHES, help="one branch; without it both")
    parser.add_argument(
        "--table", type=Path, metavar="FILE", help="default: where `towatlas build --equilibria` puts it"
    )
    parser.add_argument("--solve", action="store_true", help="solve directly what lies outside the table")
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    table = open_atlas(options.table or data_folder() / "equilibria.nc")
    rows = []
    worst = OK
    for branch in (options.branch,) if options.branch else BRANCHES[::-1]:
        try:
            at = table.fish(
                options.lam, options.wf, options.gamma, branch, outside="solve" if options.solve else "raise"
            )
        except ValueError as error:
            say(str(error).split("; outside=")[0] + "; --solve computes it directly")
            return OUTSIDE
        if at.status != status.OK:
            say(f"{branch}: {status.SENTENCES[int(at.status)]}")
            worst = NO_STATE if at.status == status.NOT_FOUND else FAILED
            continue
        row = {"branch": branch, "nodes": int(at.nodes)}
        row |= {name: float(getattr(at, name)) for name in ("x_f", "z_f", "error")}
        rows.append(row | {"interpolated": bool(at.interpolated)})
    if options.json:
        print_json(rows)
        return worst
    print(f"{'branch':>8} {'nodes':>5} {'x_f':>20} {'z_f':>20} {'error':>8}  source")
    for row in rows:
        source = "table" if row["interpolated"] else "solved directly"
        print(
            f"{row['branch']:>8} {row['nodes']:>5} {row['x_f']:>20.13g} {row['z_f']:>20.13g} {row['error']:>8.1e}  "
            f"{source}"
        )
    return worst
