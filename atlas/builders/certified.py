"""Proving the nodes of an atlas, into a file beside it that grows from run to run."""

import math
import time
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from towatlas.builders.file import Summary, progress_bar, provenance, write_atlas
from towatlas.cf import root_attributes
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.tables.certified import METHOD, NOT_PROVED, PROOF_VERSION, PROVED, Certified, read_certified
from towatlas.tables.file import open_group, read_root
from towatlas.tables.seal import AtlasFileError, check_writable

# The file is written so often, s of CPU, and at the end.
EVERY = 60.0
# One node may take so long, s of CPU.
SECONDS = 120.0
# Eighths, and the nodes first proved, are random, the same every time.
SEED = 8


def certify_atlas(
    atlas: Path, out: Path, *, rows: str | None = None, count: int | None = None, progress: bool = True
) -> Summary:
    """Prove nodes of the plain table of an atlas; go on where the file stopped, if it is of the same atlas and method.

    Parameters
    ----------
    atlas, out : Path
    rows : str, optional
        "1/8" to "8/8", an eighth of the nodes drawn at random; all of them if not given.
    count : int, optional
        Stop after so many nodes, those tried before not counted.
    progress : bool
        Whether to show a bar on standard error, if that is a terminal.

    Returns
    -------
    Summary

    Raises
    ------
    AtlasFileError
        For a file that is no atlas, or a file of proofs of another one.
    ImportError
        Without python-flint.
    """
    from towatlas.solve.proof.certificates import Certificate, certify

    start = time.perf_counter()
    check_writable(out)
    table, seal = _read_table(atlas)
    done = _resumed(out, seal, table["gamma_c"].shape)
    nodes = np.flatnonzero(table["status"].ravel() == status.OK)
    nodes = np.random.default_rng(SEED).permutation(nodes)
    if rows is not None:
        nodes = nodes[int(rows[0]) - 1 :: 8]
    nodes = nodes[done.outcome.ravel()[nodes] == 0][:count]
    seconds, written = done.seconds, time.process_time()
    with progress_bar(len(nodes), "node", progress) as bar:
        for node in nodes:
            i, j, k = np.unravel_index(node, done.outcome.shape)
            began = time.process_time()
            found: Certificate | None = None
            with suppress(ArithmeticError), patience(SECONDS):
                found = certify(float(table["lam"][k]), float(table["w_f"][j]), int(table["n"][i]), digits=20)
            done.outcome[i, j, k] = NOT_PROVED
            if found is not None and found.gamma is not None and found.gamma_radius is not None:
                gamma = float(table["gamma_c"][i, j, k])
                off = abs(Fraction(gamma) - Fraction(Decimal(found.gamma))) + Fraction(Decimal(found.gamma_radius))
                done.outcome[i, j, k] = PROVED
                done.gamma_radius[i, j, k] = math.nextafter(float(off), math.inf)
                done.holds[i, j, k] = off <= Fraction(float(table["error"][i, j, k])) * Fraction(gamma)
            seconds += time.process_time() - began
            bar.update()
            if time.process_time() - written > EVERY:
                _write(out, done, table, seconds, seal)
                written = time.process_time()
    _write(out, done, table, seconds, seal)
    facts = tuple(read_certified(out).facts().items())
    return Summary(out, "proofs", (*facts, ("CPU time", f"{seconds:.0f} s in all")), time.perf_counter() - start)


def _read_table(atlas: Path) -> tuple[dict[str, NDArray[Any]], str]:
    attributes, data, seal = read_root(atlas)
    if attributes.get("method") != "fold":
        raise AtlasFileError(f"{atlas} holds no critical speeds solved directly; `towatlas build` makes an atlas")
    with open_group(atlas, data) as file:
        names = ("n", "w_f", "lam", "gamma_c", "error", "status")
        return {name: np.asarray(file[name][:]) for name in names}, seal


def _resumed(out: Path, seal: str, shape: tuple[int, ...]) -> Certified:
    if out.exists():
        done = read_certified(out)
        if done.atlas_seal != seal:
            raise AtlasFileError(f"{out} is about another atlas; remove it, or name another file with --out")
        if done.version == PROOF_VERSION:
            return done
    outcome, holds = (np.zeros(shape, np.int8) for _ in range(2))
    return Certified(seal, PROOF_VERSION, outcome, np.full(shape, np.nan), holds, 0.0)


def _write(out: Path, done: Certified, table: dict[str, NDArray[Any]], seconds: float, seal: str) -> None:
    dims = ("n", "w_f", "lam")
    words = {"flag_values": np.array([0, 1, 2], np.int8), "flag_meanings": "untried proved not_proved"}
    data = {
        "outcome": (dims, done.outcome, {"long_name": "whether the critical speed of the node is proved", **words}),
        "gamma_radius": (
            dims,
            done.gamma_radius,
            {"long_name": "what the critical speed of the atlas is off by at most, proved", "units": "1"},
        ),
        "holds": (
            dims,
            done.holds,
            {
                "long_name": "whether the stored relative error of the atlas is as large as that",
                "flag_values": np.array([0, 1], np.int8),
                "flag_meanings": "no_or_not_proved yes",
            },
        ),
    }
    names = {
        "n": "number of the transition",
        "w_f": "fish weight over (mu + rho A) g R",
        "lam": "cable length over tow radius",
    }
    coordinates = {name: (name, table[name], {"long_name": text, "units": "1"}) for name, text in names.items()}
    more = {"atlas_seal": seal, "proof_version": np.int32(PROOF_VERSION), "cpu_seconds": seconds}
    root = xr.Dataset(data, coordinates)
    root.attrs = root_attributes(METHOD, provenance("certify") | more)
    write_atlas(out, root, {})
