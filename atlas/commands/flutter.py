"""`towatlas flutter`: the ranges of speed in which shapes of one cable do not last."""

import argparse
from typing import Any

from towatlas.commands.common import FAILED, OK, add_cable, add_fluid, add_patience, fluid, print_json, say
from towatlas.commands.folds import span
from towatlas.results_motion import Window


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "flutter",
        help="ranges of speed in which the shapes of one cable do not last",
        description="Along every branch of shapes between two speeds: where it begins and ceases to be left by growing "
        "motions. Edges are a fold, a hopf point (a mode that grows or not), without drag a krein collision (of two "
        "oscillations), or the end of the range. Windows of different modes may overlap; weak ones grow by less than "
        "0.01 gamma.",
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
    add_patience(parser)
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from towatlas.solve.flutter import flutter

    found = flutter(options.lam, options.wf, options.gamma, **fluid(options))
    rows = [_row(window) for window in found.windows]
    print_json(rows) if options.json else _print_table(rows)
    say(f"looked at: {found.looked_at}")
    return OK if found.complete else FAILED


def _row(window: Window) -> dict[str, Any]:
    return {
        "branch": window.branch,
        "nodes": window.nodes,
        "from": window.low,
        "to": window.high,
        "from_kind": window.low_kind,
        "to_kind": window.high_kind,
        "frequency_from": window.low_frequency,
        "frequency_to": window.high_frequency,
        "growth_max": window.growth,
        "gamma_max": window.gamma,
        "weak": window.weak,
    }


def _print_table(rows: list[dict[str, Any]]) -> None:
    wide = max([8, *(len(row["branch"]) for row in rows)])
    print(
        f"{'branch':>{wide}} {'nodes':>5} {'from':>16} {'':>7} {'to':>16} {'':>7} {'frequency':>21} {'growth':>11} "
        f"{'at gamma':>9}"
    )
    for row in rows:
        frequency = f"{row['frequency_from']:.6g} to {row['frequency_to']:.6g}"
        print(
            f"{row['branch']:>{wide}} {row['nodes']:>5} {row['from']:>16.11g} {row['from_kind']:>7} "
            f"{row['to']:>16.11g} {row['to_kind']:>7} {frequency:>21} {row['growth_max']:>11.6g} "
            f"{row['gamma_max']:>9.5g}{'  weak' if row['weak'] else ''}"
        )
