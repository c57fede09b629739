"""`towatlas map`: shapes, folds and growth rates of very many systems, on many processes; and a look at them."""

import argparse
import os
from pathlib import Path
from typing import Any

from towatlas.commands.common import (
    FAILED,
    FIGURE_FORMATS,
    NO_STATE,
    OK,
    OUTSIDE,
    new_figure,
    number,
    print_json,
    real,
    save_figure,
    say,
)


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "map",
        help="shapes, folds and growth rates of very many systems, on many processes",
        description="Compute a map from its spec, on all cores of this machine or on a dask cluster, and put it "
        "together in DIR/map.zarr; or, with --at and --plot, look one up.",
    )
    parser.add_argument(
        "what", metavar="SPEC", help="a TOML file or the name of a shipped spec; with --at or --plot a map"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="the folder of the map")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=_processes, metavar="N", help="processes of this machine; default all cores")
    where.add_argument("--scheduler", metavar="ADDRESS", help="a dask cluster's, as tcp://host:8786")
    parser.add_argument("--resume", action="store_true", help="go on with a map that was begun")
    parser.add_argument("--dry-run", action="store_true", help="say what it would take, and stop")
    parser.add_argument("--merge", type=Path, metavar="FILE.nc", help="write it as one NetCDF file as well")
    parser.add_argument("--quiet", action="store_true", help="no progress, no estimate")
    look = parser.add_mutually_exclusive_group()
    look.add_argument("--at", type=_point, metavar="NAME=VALUE,...", help="look up one point: each axis of the map")
    look.add_argument("--plot", type=Path, metavar="FILE", help="draw it: FILE.svg, .png or .pdf")
    parser.add_argument("--json", action="store_true", help="with --at: an object instead of a table")
    parser.set_defaults(run=_run)


def _processes(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of processes, 1 to 1024")
    return int(text)


def _point(text: str) -> dict[str, float]:
    pairs = [part.partition("=") for part in text.split(",")]
    if not all(equals for _, equals, _ in pairs):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of numbers with names, as lam=5,gamma=1.2")
    return {name.strip(): number(value) for name, _, value in pairs}


def _run(options: argparse.Namespace) -> int:
    if options.at is not None:
        return _look(options)
    if options.plot is not None:
        return _draw(options)
    from towatlas.maps.build import begun, build_map, estimate, refuse
    from towatlas.maps.runner import MEMORY
    from towatlas.maps.spec import read_spec

    spec = read_spec(options.what)
    if options.out is None and not options.dry_run:
        raise ValueError("where to: --out DIR; or --dry-run for what it would take")
    if options.dry_run or not (options.resume and begun(options.out)):
        expected = estimate(spec)
        refuse(spec, expected, options.out)
        if options.dry_run:
            print(expected)
            return OK
        if not options.quiet:
            say(str(expected))
    workers = options.workers or os.cpu_count() or 1
    if not options.quiet:
        where = f"the cluster at {options.scheduler}" if options.scheduler else f"{workers} processes of one thread"
        say(f"on {where}{'' if options.scheduler else f' and at most {MEMORY} each'}")
    failed = build_map(
        spec,
        options.out,
        workers=workers,
        scheduler=options.scheduler,
        resume=options.resume,
        netcdf=options.merge,
        progress=not options.quiet,
        report=(lambda text: None) if options.quiet else say,
    )
    print(f"{options.out}  {spec.systems:,} systems, {failed:,} with a status")
    return OK


def _look(options: argparse.Namespace) -> int:
    from towatlas.maps.lookup import FOLD, OUTCOMES, OutsideMap, open_map

    try:
        found = open_map(options.what).at(**options.at)
    except OutsideMap as error:
        say(str(error))
        return OUTSIDE
    codes = found["status"].values[0]
    rows = [_row(found, k) for k in range(max(1, int(found["count"][0]))) if k < len(codes)]
    if options.json:
        print_json({"count": int(found["count"][0]), "shapes": rows})
    else:
        for k, row in enumerate(rows):
            print(f"shape {k}: {row['outcome']}")
            for name, value in row.items():
                if name != "outcome" and not name.endswith("_error") and value is not None:
                    off = row.get(f"{name}_error")
                    print(f"  {name:<12} {value if off is None else f'{value:.10g} +- {off:.1g}'}")
    if (worst := max(int(code) for code in codes[: len(rows)])) == 0:
        return OK
    say(OUTCOMES[worst])
    return NO_STATE if worst == FOLD else FAILED


def _draw(options: argparse.Namespace) -> int:
    if options.plot.suffix.lower() not in FIGURE_FORMATS:
        raise ValueError(f"--plot {options.plot}: the ending must be one of {', '.join(FIGURE_FORMATS)}")
    from towatlas.maps.lookup import open_map

    known = open_map(options.what)
    # A figure without a screen.
    new_figure(1.0, 1.0)
    from towatlas.plot.map import plot_map

    save_figure(plot_map(known), options.plot)
    return OK


def _row(found: Any, k: int) -> dict[str, Any]:
    from towatlas.maps.layout import KINDS
    from towatlas.maps.lookup import WORDS

    row: dict[str, Any] = {"outcome": WORDS[int(found["status"][0, k])]}
    if row["outcome"] != WORDS[0]:
        return row
    for name, array in found.data_vars.items():
        if array.dims == ("point", "shape") and name != "status":
            value = array.values[0, k]
            row[str(name)] = (
                KINDS[int(value)] if name == "kind" else int(value) if value.dtype.kind == "i" else real(value)
            )
    return row
