"""`towatlas certify`: a critical speed proved, or those of an atlas."""

import argparse
import dataclasses
from contextvars import Context
from pathlib import Path
from typing import Any

from towatlas.commands.common import (
    FAILED,
    NO_STATE,
    OK,
    add_cable,
    add_patience,
    order,
    print_json,
    say,
    speed,
)

EIGHTHS = tuple(f"{k}/8" for k in range(1, 9))


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "certify",
        help="critical speeds proved",
        description="Prove a critical speed of the vacuum: decimals, what they are off by at most, the number of the "
        "transition, or that a short cable has none. Or prove those of the plain table of an atlas, into a file beside "
        "it. Needs python-flint, of the extra certify.",
    )
    parser.add_argument("atlas", nargs="?", type=Path, metavar="ATLAS", help="prove its nodes, instead of one cable")
    add_cable(parser, gamma=False, required=False)
    parser.add_argument(
        "--gamma", type=speed, metavar="GAMMA", help="prove all equilibria at one speed, instead of a fold"
    )
    parser.add_argument(
        "--cover", action="store_true", help="with --gamma: prove their number by covering all offsets of the fish too"
    )
    parser.add_argument("--n", type=order, default=1, metavar="N", help="number of the transition, default %(default)s")
    parser.add_argument("--digits", type=int, default=30, metavar="D", help="wanted, default %(default)s")
    parser.add_argument("--json", action="store_true", help="JSON instead of lines")
    parser.add_argument(
        "--rows", choices=EIGHTHS, metavar="K/8", help="with ATLAS: an eighth of its nodes; default all"
    )
    parser.add_argument("--count", type=int, metavar="N", help="with ATLAS: stop after so many nodes")
    parser.add_argument("--out", type=Path, metavar="FILE", help="with ATLAS: default certified.nc beside it")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if (options.atlas is None) == (options.lam is None or options.wf is None):
        raise ValueError("name either an ATLAS, or a cable with --lam and --wf")
    if options.cover and options.gamma is None:
        raise ValueError("--cover is about all equilibria at one speed; name it with --gamma")
    try:
        if options.atlas is not None:
            return _table(options)
        return _one(options) if options.gamma is None else _states(options)
    except ImportError as error:
        say(str(error))
        return FAILED


def _one(options: argparse.Namespace) -> int:
    from towatlas.solve.proof.certificates import CERTIFIED, NO_TRANSITION, certify

    found = certify(options.lam, options.wf, options.n, digits=options.digits)
    if options.json:
        print_json(dataclasses.asdict(found))
    elif found.status == CERTIFIED:
        for name in ("gamma", "R_x0", "x_f"):
            print(f"{name:<6} {getattr(found, name)} +- {getattr(found, name + '_radius')}")
        print(f"n      {found.n}, proved")
        print(f"unique {found.unique}")
    say(f"{found.status}: {found.reason}")
    return {CERTIFIED: OK, NO_TRANSITION: NO_STATE}.get(found.status, FAILED)


def _states(options: argparse.Namespace) -> int:
    from towatlas.solve.proof.certificates import CERTIFIED
    from towatlas.solve.proof.states import certify_equilibria

    found = certify_equilibria(options.lam, options.wf, options.gamma, cover=options.cover)
    if options.json:
        print_json(dataclasses.asdict(found))
    else:
        for state in found.states:
            print(f"{state.branch:<9} R_x0 {state.R_x0} +- {state.R_x0_radius}  x_f {state.x_f} +- {state.x_f_radius}")
    say(f"{found.status}: {found.reason}")
    return OK if found.status == CERTIFIED else FAILED


def _table(options: argparse.Namespace) -> int:
    from towatlas.builders.certified import certify_atlas

    out = options.out or options.atlas.with_name("certified.nc")
    # Without the patience of one command: each node has its own.
    print(Context().run(certify_atlas, options.atlas, out, rows=options.rows, count=options.count))
    return OK
