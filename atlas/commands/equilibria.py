"""`towatlas equilibria`: every shape of one cable at one speed."""

import argparse
import json
from typing import Any

from towatlas.commands.common import OK, drag, length, number, say, speed, weight
from towatlas.nomenclature import SYMBOLS
from towatlas.solve.drag_equilibria import DragEquilibria
from towatlas.solve.equilibria import equilibria


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "equilibria",
        help="all equilibria of one cable at one speed",
        description="Every shape in which a cable can be towed at one speed, in rising order of R_x0. boundary_error "
        "is E of Eq. (33) of a forward Runge-Kutta shot, an independent witness. With any of the options of a fluid: "
        "what a search finds, in rising order of the radius r_f of the fish, and what was searched.",
    )
    parser.add_argument("--lam", type=length, required=True, metavar="LAMBDA", help=SYMBOLS["lam"].long_name)
    parser.add_argument("--wf", type=weight, required=True, metavar="W_F", help=SYMBOLS["w_f"].long_name)
    parser.add_argument(
        "--gamma", type=speed, required=True, metavar="GAMMA", help="rotational frequency Omega sqrt(R/g)"
    )
    for option, kind, text in (
        ("C", drag, "drag constant of the cable, (1/2) rho C_D d R / (mu + rho A)"),
        ("m-f", weight, "mass of the fish over (mu + rho A) R; default that of its weight"),
        ("C-f", drag, "drag constant of the fish, (1/2) rho C_Df A_f / (mu + rho A)"),
        ("w", number, "weight of the cable, (mu - rho A) / (mu + rho A); default 1"),
        ("C-t", drag, "tangential drag constant of the cable"),
    ):
        parser.add_argument(f"--{option}", type=kind, metavar=option.replace("-", "_").upper(), help=text)
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    given = {name: getattr(options, name) for name in ("C", "m_f", "C_f", "w", "C_t")}
    given = {name: value for name, value in given.items() if value is not None}
    found = equilibria(options.lam, options.wf, options.gamma, **given)
    if isinstance(found, DragEquilibria):
        return _print_drag(found, options.json)
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


def _print_drag(found: DragEquilibria, as_json: bool) -> int:
    names = ("r_f", "lag", "R_x0", "R_y0", "R_z0", "x_f", "y_f", "z_f", "tension", "nodes", "near_axis", "error")
    rows = [{name: getattr(found, name)[k].item() for name in names} for k in range(len(found))]
    if as_json:
        print(json.dumps({"equilibria": rows, "searched": found.searched}, indent=1))
        return OK
    print(f"{'r_f':>20} {'lag':>12} {'R_x0':>14} {'R_y0':>14} {'z_f':>16} {'tension':>16} {'nodes':>5} {'error':>8}")
    for row in rows:
        mark = "  near axis" if row["near_axis"] else ""
        print(
            f"{row['r_f']:>20.13g} {row['lag']:>12.8f} {row['R_x0']:>14.8g} {row['R_y0']:>14.8g} {row['z_f']:>16.10g} "
            f"{row['tension']:>16.10g} {row['nodes']:>5} {row['error']:>8.1e}{mark}"
        )
    say(f"searched: {found.searched}; that there are no others is not proved")
    return OK
