"""The command line: `towatlas`, or `python -m atlas`.

Exit codes: 0 ok, 1 the computation failed, 2 usage, 3 outside the atlas, 4 no such state, 5 a file that cannot be read
or written.
"""

import argparse
import json
import math
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from atlas import __version__
from atlas.critical import CriticalStates, solve_critical
from atlas.equilibria import equilibria
from atlas.limits import threshold_offset, unchecked_threshold_length
from atlas.lookup import Atlas, default_path, open_atlas, read_root
from atlas.nomenclature import REPORT, SYMBOLS
from atlas.seal import AtlasFileError
from kernels import status

OK, FAILED, USAGE, OUTSIDE, NO_STATE, FILE = 0, 1, 2, 3, 4, 5

# Transitions solved at once when none is named; a cable of 1e4 tow radii has 5000.
MOST_SOLVED = 1000
FIGURE_FORMATS = (".svg", ".png", ".pdf")


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not finite")
    return value


def _length(text: str) -> float:
    value = _number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"lambda = {text} is not positive")
    return value


def _speed(text: str) -> float:
    value = _number(text)
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"gamma = {text} is not positive")
    return value


def _weight(text: str) -> float:
    value = _number(text)
    if value < 0.0:
        raise argparse.ArgumentTypeError(f"w_f = {text} is negative")
    return value


def _order(text: str) -> int:
    try:
        value = int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
    if not 1 <= value < 2**31:
        raise argparse.ArgumentTypeError(f"n = {text}: transitions are counted from 1")
    return value


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="towatlas",
        description="Critical speeds of a cable towed in a circle: at what speed does it jump, and to what shape?",
        epilog="Exit codes: 0 ok, 1 computation failed, 2 usage, 3 outside the atlas, 4 no such state, 5 unreadable or "
        "damaged file.",
    )
    parser.add_argument("--version", action="version", version=f"towatlas {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    critical = commands.add_parser(
        "critical",
        help="critical speeds of one cable",
        description=f"Critical speeds and reactions of one cable. Dimensionless groups as in {REPORT}: "
        "gamma = Omega sqrt(R/g), lengths over the tow radius R, forces over (mu + rho A) g R.",
    )
    critical.add_argument("--lam", type=_length, required=True, metavar="LAMBDA", help=SYMBOLS["lam"].long_name)
    critical.add_argument("--wf", type=_weight, required=True, metavar="W_F", help=SYMBOLS["w_f"].long_name)
    critical.add_argument("--n", type=_order, metavar="N", help="one transition; without it every one that exists")
    _add_atlas(critical)
    critical.add_argument(
        "--solve", action="store_true", help="solve directly instead of looking up: any n, any length, no atlas needed"
    )
    critical.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    critical.set_defaults(run=_critical)

    equilibria = commands.add_parser(
        "equilibria",
        help="all equilibria of one cable at one speed",
        description="Every shape in which a cable can be towed at one speed, in rising order of R_x0. boundary_error "
        "is E of Eq. (33) of a forward Runge-Kutta shot, an independent witness.",
    )
    equilibria.add_argument("--lam", type=_length, required=True, metavar="LAMBDA", help=SYMBOLS["lam"].long_name)
    equilibria.add_argument("--wf", type=_weight, required=True, metavar="W_F", help=SYMBOLS["w_f"].long_name)
    equilibria.add_argument(
        "--gamma", type=_speed, required=True, metavar="GAMMA", help="rotational frequency Omega sqrt(R/g)"
    )
    equilibria.add_argument("--json", action="store_true", help="a list of objects instead of a table")
    equilibria.set_defaults(run=_equilibria)

    build = commands.add_parser("build", help="build an atlas file", description="Build an atlas file.")
    build.add_argument(
        "--out", type=Path, metavar="FILE", help=f"default {default_path()}, or build/scan.nc for --method scan"
    )
    build.add_argument(
        "--method",
        choices=("fold", "scan"),
        default="fold",
        help="fold: direct solution, with a scan beside it as a witness; scan: the report's own method, a plain table",
    )
    build.add_argument("--threads", type=_threads, metavar="N", help="default: all; the file does not depend on it")
    build.add_argument("--quiet", action="store_true", help="no progress bar")
    build.set_defaults(run=_build)

    plot = commands.add_parser("plot", help="draw a figure", description="Draw a figure from an atlas.")
    plot.add_argument("figure", choices=("critical",), help="critical speeds against cable length")
    plot.add_argument("--out", type=Path, required=True, metavar="FILE", help="FILE.svg, .png or .pdf")
    _add_atlas(plot)
    plot.set_defaults(run=_plot)

    info = commands.add_parser(
        "info", help="what a file holds", description="Domain, versions, errors and seal of a file."
    )
    info.add_argument("file", type=Path, nargs="?", default=default_path(), metavar="FILE", help="default %(default)s")
    info.set_defaults(run=_info)
    return parser


def _threads(text: str) -> int:
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of threads")
    return int(text)


def _add_atlas(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--atlas",
        type=Path,
        default=default_path(),
        metavar="FILE",
        help="default %(default)s; $TOWATLAS_FILE sets another",
    )


def _say(message: str) -> None:
    print(f"towatlas: {message}", file=sys.stderr)


def _announce_compilation(kernel: str) -> None:
    """Say so before a kernel is compiled, which happens once after installation."""
    from kernels.compiling import CACHE

    if CACHE is None or not any(CACHE.rglob(f"*.{kernel}-*.nbi")):
        _say("compiling, once after installation: this takes some 20 s")


def _existing(lam: float, w_f: float) -> int:
    """Number of transitions a cable has."""
    return max(0, math.ceil(0.5 * (lam + 1.0 - float(threshold_offset(w_f)))) - 1)


def _critical(options: argparse.Namespace) -> int:
    lam, w_f = options.lam, options.wf
    existing = _existing(lam, w_f)
    atlas = None if options.solve else open_atlas(options.atlas)
    limit = MOST_SOLVED if atlas is None else atlas.n_max
    orders = np.arange(1, min(existing, limit) + 1) if options.n is None else np.array([options.n])
    if options.n is None and existing > limit:
        remedy = "name one with --n" if options.solve else "the atlas ends there, --solve --n N solves any"
        _say(f"lambda = {lam:g} has {existing} transitions; the first {limit} follow ({remedy})")
    if atlas is None:
        _announce_compilation("solve_folds")
    states = solve_critical(lam, w_f, orders) if atlas is None else atlas.states(lam, w_f, orders, outside="nan")
    print(_as_json(states) if options.json else _as_table(states), end="")
    return _verdict(states, lam, w_f, atlas)


def _verdict(states: CriticalStates, lam: float, w_f: float, atlas: Atlas | None) -> int:
    """Say what could not be answered; the exit code."""
    codes = states.status
    if not len(codes) or (codes == status.NO_TRANSITION).all():
        n = int(states.n[0]) if len(codes) else 1
        _say(
            f"no transition n = {n}: lambda = {lam:.15g} is not longer than lambda_c{n} = "
            f"{float(unchecked_threshold_length(w_f, n)):.15g} for w_f = {w_f:.15g}"
        )
        return NO_STATE
    bad = codes != status.OK
    if atlas is not None and (codes == status.OUTSIDE).any():
        try:
            atlas.states(lam, w_f, states.n[codes == status.OUTSIDE])
        except ValueError as error:
            _say(str(error).split("; outside=")[0] + "; --solve computes such points directly")
    for code in np.unique(codes[bad & (codes != status.OUTSIDE)]):
        orders = states.n[codes == code]
        _say(
            f"n = {orders[0]}{f' and {len(orders) - 1} more' if len(orders) > 1 else ''}: {status.SENTENCES[int(code)]}"
        )
    if not bad.all():
        return OK
    if (codes == status.OUTSIDE).any():
        return OUTSIDE
    return NO_STATE if (codes[bad] == status.NO_TRANSITION).any() else FAILED


def _rows(states: CriticalStates) -> list[dict[str, Any]]:
    names = ("n", "lam", "w_f", "gamma", "R_x0", "x_f", "error", "status")
    columns = {name: np.atleast_1d(getattr(states, name)) for name in names}
    words = status.FLAG_MEANINGS.split()
    rows = []
    for k in range(len(columns["n"])):
        row: dict[str, Any] = {"n": int(columns["n"][k])}
        for name in names[1:-1]:
            value = float(columns[name][k])
            row[name] = value if math.isfinite(value) else None
        row["status"] = words[int(columns["status"][k])]
        rows.append(row)
    return rows


def _as_json(states: CriticalStates) -> str:
    return json.dumps(_rows(states), indent=1) + "\n"


def _as_table(states: CriticalStates) -> str:
    lines = [f"{'n':>4} {'gamma':>20} {'R_x0':>20} {'x_f':>20} {'error':>8}  status"]
    for row in _rows(states):
        cells = " ".join(f"{'-' if row[k] is None else format(row[k], '.13g'):>20}" for k in ("gamma", "R_x0", "x_f"))
        error = "-" if row["error"] is None else format(row["error"], ".1e")
        lines.append(f"{row['n']:>4} {cells} {error:>8}  {row['status']}")
    return "\n".join(lines) + "\n" if len(lines) > 1 else ""


def _equilibria(options: argparse.Namespace) -> int:
    _announce_compilation("solve_equilibria")
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


def _build(options: argparse.Namespace) -> int:
    from atlas.build import build_atlas

    out = options.out or (default_path() if options.method == "fold" else Path("build/scan.nc"))
    print(build_atlas(out, options.method, threads=options.threads, progress=not options.quiet))
    return OK


def _plot(options: argparse.Namespace) -> int:
    if options.out.suffix.lower() not in FIGURE_FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FIGURE_FORMATS)}")
    atlas = open_atlas(options.atlas)
    os.environ["MPLBACKEND"] = "Agg"
    import matplotlib.pyplot as plt

    from atlas.plot import plot_critical

    plt.rcParams["svg.hashsalt"] = "towatlas"
    figure, axes = plt.subplots(figsize=(7.2, 4.8), layout="constrained")
    plot_critical(atlas, ax=axes)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    metadata = {"Date": None} if options.out.suffix.lower() == ".svg" else {}
    figure.savefig(options.out, dpi=200, metadata=metadata)
    _say(f"wrote {options.out}")
    return OK


def _info(options: argparse.Namespace) -> int:
    attributes, _, seal = read_root(options.file)
    print(f"{'file':<40}  {options.file}")
    if attributes.get("method") == "fold":
        atlas = open_atlas(options.file)
        axes = atlas.axes
        print(f"{'n':<40}  1 .. {atlas.n_max}")
        print(f"{'w_f':<40}  0 .. {axes.w_f_max:g}")
        print(f"{'lam - lambda_c':<40}  {axes.excess_min:g} .. {axes.excess_max:g}")
    for name in sorted(attributes):
        value = attributes[name]
        print(f"{name:<40}  {format(value, '.2g') if isinstance(value, float) else value}")
    print(f"{'seal (SHA-256 of the file but the seal)':<40}  {seal}")
    return OK


def main(arguments: list[str] | None = None) -> int:
    """Run one command; returns the exit code."""
    options = _parser().parse_args(arguments)
    try:
        return options.run(options)
    except AtlasFileError as error:
        _say(str(error))
        return FILE
    except ValueError as error:
        _say(str(error))
        return USAGE
    except ArithmeticError as error:
        _say(str(error))
        return FAILED
    except BrokenPipeError:
        sys.stderr.close()
        return OK
    except OSError as error:
        _say(str(error))
        return FILE
    except KeyboardInterrupt:
        _say("interrupted")
        return 130
