"""`towatlas critical --C`: where the pairs of a vacuum appear and end with drag, and all other jumps between them."""

import argparse
from typing import Any

import numpy as np

from towatlas.commands.common import FAILED, NO_STATE, OK, OUTSIDE, print_json, real, say
from towatlas.commands.folds import print_folds, row_of
from towatlas.effort import TooMuchWork
from towatlas.kernels import status
from towatlas.limits import transitions
from towatlas.results import SIDES, DragFolds
from towatlas.solve.drag_folds import solve_drag_folds
from towatlas.solve.folds import folds
from towatlas.tables.atlas import open_atlas

# Transitions that are answered when none is named.
MOST = 3
# All other folds are looked for from the slowest of the pairs' to the fastest, and by this factor beyond.
BEYOND = 1.2
PAIRS_ALONE = "the pairs of the vacuum alone"


def run(options: argparse.Namespace) -> int:
    """Run the command.

    Parameters
    ----------
    options : argparse.Namespace
        lam, wf, C, n, atlas, solve, json.

    Returns
    -------
    int
        The exit code.
    """
    existing = transitions(lam=options.lam, w_f=options.wf)
    orders = np.arange(1, min(existing, MOST) + 1) if options.n is None else np.array([options.n])
    cable = options.lam, options.wf, options.C, orders
    atlas = None if options.solve else open_atlas(options.atlas)
    pairs = solve_drag_folds(*cable) if atlas is None else atlas.folds(*cable, outside="nan")
    rows, looked_at = _of_pairs(pairs), f"{PAIRS_ALONE}; drag may make others, see towatlas folds"
    if atlas is not None:
        looked_at += f"; when the atlas was built, {atlas.drag.looked_for}"
    if options.n is None and options.solve and rows:
        rows, looked_at = _all(options, rows)
    cusps = [_cusp(pairs, k) for k in range(len(orders))]
    if options.json:
        print_json({"folds": rows, "cusps": cusps, "looked_at": looked_at})
    else:
        if rows:
            print_folds(rows)
        for cusp in cusps:
            if cusp["C_cusp"] is not None:
                lasts = "" if cusp["C_lasting"] is None else f"; it does not end below {cusp['C_lasting']:.6g}"
                print(f"C*_{cusp['n']} = {cusp['C_cusp']:.8g}: no such pair above it{lasts}")
    for k, n in enumerate(orders):
        if pairs.status[k] != status.OK:
            say(f"n = {n}: {pairs.sentence(k)}")
        elif pairs.status_ends[k] not in (status.OK, status.NEVER_ENDS):
            say(f"n = {n}, its end: {pairs.sentence(k, 'ends')}")
    say(f"looked at: {looked_at}")
    return _verdict(pairs)


def _all(options: argparse.Namespace, rows: list[dict[str, Any]]) -> tuple[list[dict[str, Any]], str]:
    """All folds about those of the pairs, or these alone where that takes too long; and what was looked at."""
    speeds = [row["gamma"] for row in rows]
    try:
        found = folds(options.lam, options.wf, (min(speeds) / BEYOND, max(speeds) * BEYOND), C=options.C)
    except TooMuchWork as error:
        return rows, f"{PAIRS_ALONE}, as others take too long: {error}"
    changes = (found.shapes_above - found.shapes_below).tolist()
    return [row_of(found, k) | {"change": change} for k, change in enumerate(changes)], found.searched


def _of_pairs(pairs: DragFolds) -> list[dict[str, Any]]:
    """Folds of pairs as rows in rising speed; how many shapes there are is not known."""
    rows = []
    for side in SIDES:
        suffix = "" if side == "appears" else f"_{side}"
        for k in np.flatnonzero(getattr(pairs, f"status{suffix}") == status.OK):
            rows.append(
                {
                    "gamma": float(getattr(pairs, side)[k]),
                    "r_f": float(getattr(pairs, f"r_f_{side}")[k]),
                    "shapes_below": None,
                    "shapes_above": None,
                    "change": -2 if side == "ends" else 2,
                    "n": int(pairs.n[k]),
                    "origin": "vacuum",
                    "error": real(getattr(pairs, f"error{suffix}")[k]),
                    "status": status.FLAG_MEANINGS.split()[status.OK],
                }
            )
    return sorted(rows, key=lambda row: row["gamma"])


def _cusp(pairs: DragFolds, k: int) -> dict[str, Any]:
    words = status.FLAG_MEANINGS.split()
    codes = {"status_appears": pairs.status, "status_ends": pairs.status_ends, "status_again": pairs.status_again}
    return (
        {"n": int(pairs.n[k])}
        | {name: real(getattr(pairs, name)[k]) for name in ("C_cusp", "gamma_cusp", "error_cusp", "C_lasting")}
        | {"status": words[int(pairs.status_cusp[k])]}
        | {name: words[int(column[k])] for name, column in codes.items()}
    )


def _verdict(pairs: DragFolds) -> int:
    codes = pairs.status
    if (codes == status.OK).any():
        return OK
    if (codes == status.OUTSIDE).any():
        say("outside the folds with drag of the atlas; --solve computes such points directly")
        return OUTSIDE
    if not len(codes):
        say(f"no pair: {status.SENTENCES[status.NO_TRANSITION]}")
    return NO_STATE if not len(codes) or (codes != status.NOT_CONVERGED).any() else FAILED
