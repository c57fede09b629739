"""`towatlas report`: NRL Report 7048, reproduced in one page."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import OK, say


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "report",
        help="reproduce NRL Report 7048",
        description="Draw Figs. 9 to 17 of NRL Report 7048 and recompute every number that it prints: one HTML page "
        "that needs nothing else.",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("build/report.html"), metavar="FILE", help="FILE.html, default %(default)s"
    )
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.out.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"--out {options.out}: the ending must be .html or .htm")
    from towatlas.report.page import write_report

    say(f"wrote {write_report(options.out)}")
    return OK
