"""`towatlas build`: build an atlas file."""

import argparse
from pathlib import Path
from typing import Any

from atlas.commands.common import OK, threads
from atlas.lookup import default_path


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser("build", help="build an atlas file", description="Build an atlas file.")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help=f"default {default_path()}, or build/scan.nc for --method scan"
    )
    parser.add_argument(
        "--method",
        choices=("fold", "scan"),
        default="fold",
        help="fold: direct solution, with a scan beside it as a witness; scan: the report's own method, a plain table",
    )
    parser.add_argument("--threads", type=threads, metavar="N", help="default: all; the file does not depend on it")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from atlas.build import build_atlas

    out = options.out or (default_path() if options.method == "fold" else Path("build/scan.nc"))
    print(build_atlas(out, options.method, threads=options.threads, progress=not options.quiet))
    return OK
