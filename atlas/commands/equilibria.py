"""`towatlas equilibria`: every shape of one cable at one speed."""

import argparse
import json
from typing import Any

from atlas.commands.common import OK, announce_compilation, length, speed, weight
from atlas.equilibria import equilibria
from atlas.nomenclature import SYMBOLS


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "equilibria",
        help="all equilibria of one cable at one speed",
        description="Every shape in which a cable can be towed at one speed, in rising order of R_x0. boundary_error "
        "is E of Eq. (33) of a forward Runge-Kutta shot, an independent witness.",
    )
    parser.add_argument("--lam", type=length, required=True, metavar="LAMBDA", help=SYMBOLS["lam"].long_name)
    parser.add_argument("--wf", type=weight, required=True, metavar="W_F", help=SYMBOLS["w_f"].long_name)
    parser.add_argument(
        "--gamma", type=speed, required=True, metavar="GAMMA", help="rotational frequency Omega sqrt(R/g)"
    )
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    announce_compilation("shoot_each", 5)
    found = equilibria(options.lam, options.wf, options.gamma)
    names = ("R_x0", "x_f", "z_f", "tension", "nodes", "median", "boundary_error")
    rows = [{name: getattr(found, name)[k].item() for name in names} for k in range(len(found))]
    if options.json:
        print(json.dumps(rows, indent=1))
        return OK
    print(f"{'R_x0':>20} {'x_f':>20} {'z_f':>20} {'tension':>16} {'nodes':>5} {'E':>9}")
    for row in rows:
        cells = " ".join(f"{row[name]:>20.13g}" for name in ("R_x0", "x_f", "z_f"))
        mark = "  median" if row["median"] else ""
        print(f"{cells} {row['tension']:>16.10g} {row['nodes']:>5} {row['boundary_error']:>9.1e}{mark}")
    return OK
