"""`towatlas equilibria`: every shape of one cable at one speed."""

import argparse
from typing import Any

from towatlas.commands.common import OK, add_cable, add_fluid, add_patience, fluid, print_json, real, say
from towatlas.results import Equilibria
from towatlas.solve.equilibria import equilibria

NUMBERS = ("R_x0", "R_y0", "R_z0", "x_f", "y_f", "z_f", "r_f", "phase_deg", "tension", "error", "boundary_error")


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "equilibria",
        help="all equilibria of one cable at one speed",
        description="Every shape in which a cable can be towed at one speed, in rising order of R_x0. E is that of "
        "Eq. (33) of a forward Runge-Kutta shot, an independent witness. With any of the options of a fluid: what a "
        "search finds, and what was searched.",
    )
    add_cable(parser, any_medium=True)
    add_fluid(parser)
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    found = equilibria(options.lam, options.wf, options.gamma, **fluid(options))
    rows = [_row(found, k) for k in range(len(found))]
    if options.json:
        print_json(rows)
    else:
        _print_table(rows)
    if not found.system.in_vacuum:
        say(f"searched: {found.searched}")
    return OK


def _row(found: Equilibria, k: int) -> dict[str, Any]:
    row: dict[str, Any] = {
        "branch": str(found.branch[k]),
        "nodes": int(found.nodes[k]),
        "expected": k == found.expected,
        "near_axis": bool(found.near_axis[k]),
    }
    return row | {name: real(getattr(found, name)[k]) for name in NUMBERS}


def _print_table(rows: list[dict[str, Any]]) -> None:
    print(
        f"{'branch':>8} {'R_x0':>20} {'x_f':>20} {'y_f':>14} {'z_f':>20} {'tension':>16} {'nodes':>5} "
        f"{'error':>8} {'E':>9}"
    )
    for row in rows:
        witness = "-" if row["boundary_error"] is None else f"{row['boundary_error']:.1e}"
        print(
            f"{row['branch']:>8} {row['R_x0']:>20.13g} {row['x_f']:>20.13g} {row['y_f']:>14.8g} "
            f"{row['z_f']:>20.13g} "
            f"{row['tension']:>16.10g} {row['nodes']:>5} {row['error']:>8.1e} {witness:>9}"
            f"{'  expected' if row['expected'] else ''}"
        )
