"""`towatlas folds`: every jump of one cable as its speed rises."""

import argparse
import math
from pathlib import Path
from typing import Any

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
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.results import Folds
from towatlas.solve.folds import folds, name_folds
from towatlas.system import System


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "folds",
        help="every jump of one cable between two speeds, in any medium",
        description="Speeds between two at which the number of shapes changes by two, in rising order, wherever they "
        "come from: n is the number of the transition of the vacuum from which one is continued, none for those that "
        "drag makes. `towatlas critical` lists those of the vacuum.",
    )
    add_cable(parser, gamma=False, any_medium=True)
    parser.add_argument(
        "--gamma",
        type=span,
        required=True,
        metavar="LOW:HIGH",
        help="from which speed to which, Omega sqrt(R/g); both negative for a turn to port, as --gamma=-5:-1",
    )
    add_fluid(parser)
    parser.add_argument(
        "--atlas",
        type=Path,
        metavar="MAP",
        help="look them up in a map of folds, DIR or FILE by `towatlas map`",
    )
    add_patience(parser)
    parser.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    parser.set_defaults(run=_run)


def span(text: str) -> tuple[float, float]:
    """Two speeds of one sign, the lower first, as LOW:HIGH.

    Parameters
    ----------
    text : str

    Returns
    -------
    (float, float)

    Raises
    ------
    argparse.ArgumentTypeError
    """
    try:
        low, high = (float(part) for part in text.split(":"))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not two numbers, as 0.5:6") from None
    if not (math.isfinite(low) and math.isfinite(high) and low < high and low * high > 0.0):
        raise argparse.ArgumentTypeError(f"{text!r}: two finite speeds of one sign, the lower first")
    return low, high


def _run(options: argparse.Namespace) -> int:
    if options.atlas is None:
        found = folds(options.lam, options.wf, options.gamma, **fluid(options))
    else:
        from towatlas.maps.folds import NotInMap
        from towatlas.maps.lookup import OutsideMap, open_map

        system = System.of(options.lam, options.wf, **fluid(options))
        try:
            with patience():
                found = name_folds(open_map(options.atlas).folds(system, *sorted(options.gamma, key=abs)))
        except (OutsideMap, NotInMap) as error:
            say(f"{error}; without --atlas they are computed")
            return OUTSIDE
    rows = [row_of(found, k) for k in range(len(found))]
    print_json(rows) if options.json else print_folds(rows)
    say(f"looked at: {found.searched}")
    return OK if found.complete else FAILED


def row_of(found: Folds, k: int) -> dict[str, Any]:
    """One fold as an object of JSON.

    Parameters
    ----------
    found : Folds
        In speed.
    k : int

    Returns
    -------
    dict
    """
    return {
        "gamma": float(found.gamma[k]),
        "r_f": float(found.r_f[k]),
        "shapes_below": int(found.shapes_below[k]),
        "shapes_above": int(found.shapes_above[k]),
        "n": int(found.n[k]) or None,
        "origin": str(found.origin[k]),
        "error": real(found.error[k]),
        "status": status.FLAG_MEANINGS.split()[int(found.status[k])],
    }


def print_folds(rows: list[dict[str, Any]]) -> None:
    """Print folds as a table.

    Parameters
    ----------
    rows : list of dict
        As from `row_of`; where shapes_below and shapes_above are None, with their `change`.
    """
    print(f"{'gamma':>20} {'r_f':>20} {'shapes':>9} {'n':>5} {'origin':>7} {'error':>8}")
    for row in rows:
        known = row["shapes_below"] is not None
        shapes = f"{row['shapes_below']} to {row['shapes_above']}" if known else f"{row['change']:+d}"
        print(
            f"{row['gamma']:>20.13g} {row['r_f']:>20.13g} {shapes:>9} {row['n'] or '-':>5} {row['origin']:>7} "
            f"{row['error']:>8.1e}"
        )
