"""`towatlas build`: build an atlas file."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import OK, threads
from towatlas.tables.file import built_path, data_folder


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser("build", help="build an atlas file", description="Build an atlas file.")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="default: $TOWATLAS_FILE, else atlas.nc in your data folder (in a clone of the repository its folder "
        "build); equilibria.nc there for --equilibria, scan.nc for --method scan",
    )
    parser.add_argument(
        "--equilibria",
        action="store_true",
        help="a table of equilibria over (w_f, lambda, gamma) instead: where the fish is, beside the jumps",
    )
    parser.add_argument(
        "--drag",
        action="store_true",
        help="put folds with drag into the atlas too: where pairs of equilibria appear and end; takes some minutes",
    )
    parser.add_argument(
        "--stability",
        action="store_true",
        help="put growth rates of the inner shapes and boundaries of flutter in a vacuum into the atlas too; takes "
        "some minutes",
    )
    parser.add_argument(
        "--method",
        choices=("fold", "scan"),
        help="fold (the default): direct solution, with a scan beside it as a witness; scan: the report's own method, "
        "a plain table",
    )
    parser.add_argument("--threads", type=threads, metavar="N", help="default: all; the file does not depend on it")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    how = {"threads": options.threads, "progress": not options.quiet}
    if options.equilibria:
        if options.drag or options.stability:
            raise ValueError("--drag, --stability and --equilibria make a file each: build one after the other")
        if options.method:
            raise ValueError("--method says how critical speeds are found; a table of --equilibria has one method")
        from towatlas.builders.fish import build_equilibria

        print(build_equilibria(options.out or data_folder() / "equilibria.nc", **how))
        return OK
    if options.drag or options.stability:
        if options.drag and options.stability:
            raise ValueError("--drag and --stability make a file each: build one after the other, with --out")
        if options.method == "scan":
            raise ValueError("--drag and --stability belong in an atlas of method fold")
        if options.stability:
            from towatlas.builders.stability import build_stability

            print(build_stability(options.out or built_path(), **how))
            return OK
        from towatlas.builders.drag_folds import build_drag

        print(build_drag(options.out or built_path(), **how))
        return OK
    from towatlas.builders.critical import build_atlas

    method = options.method or "fold"
    out = options.out or (built_path() if method == "fold" else data_folder() / "scan.nc")
    print(build_atlas(out, method, **how))
    return OK
