"""`towatlas critical`: critical speeds of one cable."""

import argparse
from typing import Any

import numpy as np

from towatlas.commands import critical_drag
from towatlas.commands.common import (
    FAILED,
    NO_STATE,
    OK,
    OUTSIDE,
    add_atlas,
    add_cable,
    add_patience,
    drag,
    order,
    print_json,
    real,
    say,
)
from towatlas.kernels import status
from towatlas.limits import transitions, unchecked_threshold_length
from towatlas.nomenclature import REPORT
from towatlas.results import CriticalStates
from towatlas.solve.critical import solve_critical
from towatlas.tables.atlas import Atlas, open_atlas

# Transitions solved at once when none is named; a cable of 1e4 tow radii has 5000.
MOST_SOLVED = 1000


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "critical",
        help="critical speeds of one cable",
        description=f"Critical speeds and reactions of one cable. Dimensionless groups as in {REPORT}: "
        "gamma = Omega sqrt(R/g), lengths over the tow radius R, forces over (mu + rho A) g R.",
    )
    add_cable(parser, gamma=False)
    parser.add_argument("--n", type=order, metavar="N", help="one transition; without it every one that exists")
    parser.add_argument(
        "--C",
        type=drag,
        metavar="C",
        help="with drag: its constant (1/2) rho C_D d R / (mu + rho A); where the pairs of the vacuum appear and end, "
        "from an atlas made by `towatlas build --drag`, or with --solve these and all other jumps between them",
    )
    add_atlas(parser)
    parser.add_argument(
        "--solve", action="store_true", help="solve directly instead of looking up: any n, any length, no atlas needed"
    )
    parser.add_argument("--json", action="store_true", help="JSON instead of a table")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    lam, w_f = options.lam, options.wf
    if options.solve and options.atlas is not None:
        say("--solve looks nothing up: --atlas is left alone")
    if options.C is not None:
        return critical_drag.run(options)
    existing = transitions(lam=lam, w_f=w_f)
    try:
        atlas = None if options.solve else open_atlas(options.atlas)
    except FileNotFoundError as error:
        raise FileNotFoundError(f"{error}; --solve needs none") from None
    limit = MOST_SOLVED if atlas is None else atlas.critical.n_max
    orders = np.arange(1, min(existing, limit) + 1) if options.n is None else np.array([options.n])
    if options.n is None and existing > limit:
        remedy = "name one with --n" if options.solve else "the atlas ends there, --solve --n N solves any"
        number = existing if existing < 1e15 else float(existing)
        say(f"lambda = {lam:g} has {number} transitions; the first {limit} follow ({remedy})")
    states = solve_critical(lam, w_f, orders) if atlas is None else atlas.states(lam, w_f, orders, outside="nan")
    rows = _rows(states)
    print_json(rows) if options.json else print(_as_table(rows), end="")
    return _verdict(states, lam=lam, w_f=w_f, atlas=atlas)


def _verdict(states: CriticalStates, *, lam: float, w_f: float, atlas: Atlas | None) -> int:
    """Say what could not be answered; the exit code."""
    codes = states.status
    if not len(codes) or (codes == status.NO_TRANSITION).all():
        n = int(states.n[0]) if len(codes) else 1
        say(
            f"no transition n = {n}: lambda = {lam:.15g} is not longer than lambda_c{n} = "
            f"{float(unchecked_threshold_length(w_f, n)):.15g} for w_f = {w_f:.15g}"
        )
        return NO_STATE
    bad = codes != status.OK
    if atlas is not None and (codes == status.OUTSIDE).any():
        try:
            atlas.states(lam, w_f, states.n[codes == status.OUTSIDE])
        except ValueError as error:
            say(str(error).split("; outside=")[0] + "; --solve computes such points directly")
    for code in np.unique(codes[bad & (codes != status.OUTSIDE)]):
        orders = states.n[codes == code]
        say(
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
            row[name] = real(columns[name][k])
        row["status"] = words[int(columns["status"][k])]
        rows.append(row)
    return rows


def _as_table(rows: list[dict[str, Any]]) -> str:
    lines = [f"{'n':>4} {'gamma':>20} {'R_x0':>20} {'x_f':>20} {'error':>8}  status"]
    for row in rows:
        cells = " ".join(f"{'-' if row[k] is None else format(row[k], '.13g'):>20}" for k in ("gamma", "R_x0", "x_f"))
        error = "-" if row["error"] is None else format(row["error"], ".1e")
        lines.append(f"{row['n']:>4} {cells} {error:>8}  {row['status']}")
    return "\n".join(lines) + "\n" if len(lines) > 1 else ""
