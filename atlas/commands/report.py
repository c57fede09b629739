"""`towatlas report`: a source document, reproduced in one page."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import OK, add_patience, say
from towatlas.report.sources import SOURCES, write_report

# Of a page, s of CPU; they take a third of it at most.
SECONDS = 120.0


def add(commands: Any) -> None:
    """Declare the command."""
    listed = "; ".join(f"{name}: {source.title}" for name, source in SOURCES.items())
    parser = commands.add_parser(
        "report",
        help="reproduce a source document",
        description="Draw the figures of a source document and recompute what it says: one HTML page that needs "
        f"nothing else. {listed}.",
    )
    parser.add_argument("source", nargs="?", choices=tuple(SOURCES), default="nrl7048", help="default %(default)s")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help=f"FILE.html, default {', '.join(source.file for source in SOURCES.values())}",
    )
    add_patience(parser)
    parser.set_defaults(run=_run, patience=SECONDS)


def _run(options: argparse.Namespace) -> int:
    out = options.out or Path(SOURCES[options.source].file)
    if out.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"--out {out}: the ending must be .html or .htm")
    say(f"wrote {write_report(out, options.source)}")
    return OK
