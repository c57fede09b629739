"""One tile: its numbers computed, and its file, which says whether it is whole."""

import hashlib
import io
import os
import socket
import uuid
from collections.abc import Callable
from contextlib import suppress
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import SECONDS, TooMuchWork, counted, each_allowed, patience
from towatlas.kernels import status
from towatlas.maps.layout import CURVES, KINDS, place_of, variables
from towatlas.maps.systems import Spec, system_of
from towatlas.results import Equilibria
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.folds import folds_in_speed
from towatlas.solve.many import equilibria_many
from towatlas.solve.search import SECONDS_A_STEP
from towatlas.solve.shapes import shape_of
from towatlas.solve.spectra import stability_many
from towatlas.system import System

Columns = dict[str, NDArray[Any]]
Numbers = dict[str, NDArray[np.float64]]

MARK = b"towatlas-tile sha256:"
HEADER = len(MARK) + 64 + 1
# Tiles of a folder.
SHELF = 1000


def compute_tile(spec: Spec, number: int, part: slice = slice(None)) -> Columns:
    """The numbers of a tile; the same bits in any process on processors of one kind.

    Parameters
    ----------
    spec : Spec
    number : int
        From 0; shapes first, then folds, then checks of these.
    part : slice
        Which of its systems; all by default.

    Returns
    -------
    dict of ndarray, shape (systems, ...)
        By the names of `layout.variables`. What fails has a status, and spoils no other.
    """
    stage, tiles, k = place_of(spec, number)
    at = tuple(indices[part] for indices in tiles.indices(k))
    with patience(inf, each=SECONDS):
        if stage != "checks":
            return _guarded(stage, spec, spec.numbers(tiles.axes, at))
        points = {name: column[at[0]] for name, column in spec.check_points().items()}
        return {f"check_{name}": column for name, column in _guarded("folds", spec, spec.whole(points)).items()}


def _guarded(stage: str, spec: Spec, numbers: Numbers) -> Columns:
    """Where something raises, halves of it, down to the one system that does."""
    size = len(numbers["lam"])
    try:
        return SOLVERS[stage](spec, numbers)
    except (ArithmeticError, ValueError):
        if size == 1:
            return _nothing(spec, stage)
    halves = [_guarded(stage, spec, {name: part[s] for name, part in numbers.items()}) for s in _halves(size)]
    return {name: np.concatenate(padded([half[name] for half in halves])) for name in halves[0]}


def _halves(size: int) -> tuple[slice, slice]:
    return slice(0, size // 2), slice(size // 2, size)


def padded(arrays: list[NDArray[Any]], width: int = 0) -> list[NDArray[Any]]:
    """Arrays of as many shapes or folds as the widest of them has, or more.

    Parameters
    ----------
    arrays : list of ndarray, shape (systems, ...)
        Filled up with the last value of `missing`.
    width : int

    Returns
    -------
    list of ndarray
    """
    if arrays[0].ndim == 1:
        return arrays
    width = max(width, *(array.shape[1] for array in arrays))
    return [
        np.concatenate(
            [array, np.full((len(array), width - array.shape[1], *array.shape[2:]), _missing(array), array.dtype)],
            axis=1,
        )
        for array in arrays
    ]


def _missing(array: NDArray[Any]) -> Any:
    """What stands where there is no shape: nan, -1 of counts, 0 of codes."""
    return {"f": np.nan, "i": -1 if array.dtype == np.int32 else 0}[array.dtype.kind]


def _nothing(spec: Spec, stage: str, code: int = status.NOT_CONVERGED) -> Columns:
    """Of one system that cannot be computed."""
    width = {"shape": 0, "fold": 0, "station": spec.stations}
    found = {
        name: np.full((1, *(width[dim] for dim in variable.beyond)), variable.fill)
        for name, variable in variables(spec).items()
        if variable.stage == stage
    }
    found["status" if stage == "shapes" else "folds_status"][:] = code
    return found


def _states(spec: Spec, numbers: Numbers) -> Columns:
    found = (stability_many if spec.growing else equilibria_many)(**numbers)
    wanted = [name for name, variable in variables(spec).items() if variable.stage == "shapes" and name not in CURVES]
    columns = {name: found[name].values for name in wanted if name != "kind"}
    if spec.growing:
        codes = {kind: code for code, kind in enumerate(KINDS)} | {"": 0}
        columns["kind"] = np.vectorize(codes.__getitem__, otypes=[np.int8])(found["kind"].values)
    if "shapes" in spec.fields:
        columns |= _curves(spec, numbers, columns["count"], columns["nodes"].shape[1])
    if spec.branches == "expected":
        first = _expected(numbers, columns["count"], found["r_f"].values)[:, None]
        columns = {
            name: column if column.ndim == 1 else np.take_along_axis(column, _at(first, column.ndim), axis=1)
            for name, column in columns.items()
        }
    known = variables(spec)
    return {
        name: np.ascontiguousarray(columns[name], np.asarray(known[name].fill).dtype) for name in (*wanted, *columns)
    }


def _expected(numbers: Numbers, count: NDArray[Any], r_f: NDArray[np.float64]) -> NDArray[np.int64]:
    """Which shape is expected to be seen: in a vacuum the median root, with drag the one nearest to the axis."""
    vacuum = [system_of(numbers, int(i))[0].in_vacuum if count[i] else False for i in range(len(count))]
    nearest = np.where(np.isfinite(r_f), r_f, inf).argmin(axis=1)
    return np.where(vacuum, count // 2, nearest).astype(np.int64)


def _at(first: NDArray[np.int64], ndim: int) -> NDArray[np.int64]:
    return first.reshape(*first.shape, *(1,) * (ndim - 2))


def _curves(spec: Spec, numbers: Numbers, count: NDArray[Any], width: int) -> Columns:
    """Positions and tensions along the cables."""
    out = {name: np.full((len(count), width, spec.stations), np.nan) for name in CURVES}
    for i in np.flatnonzero(count > 0):
        system, gamma = system_of(numbers, int(i))
        found = solve_equilibria(system, gamma)
        if len(found) != count[i]:
            continue
        for k in range(len(found)):
            line = _curve(found, k, np.linspace(0.0, system.lam, spec.stations))
            for name in CURVES:
                out[name][i, k] = line[name]
    return out


def _curve(found: Equilibria, k: int, s: NDArray[np.float64]) -> dict[str, Any]:
    try:
        curve = shape_of(found, k, s)
    except ArithmeticError:
        return dict.fromkeys(CURVES, np.nan)
    return {name: curve[name].values for name in CURVES}


def _folds(spec: Spec, numbers: Numbers) -> Columns:
    rows = [_folds_of(spec, system_of(numbers, i)[0]) for i in range(len(numbers["lam"]))]
    return {name: np.concatenate(padded([row[name] for row in rows], 1)) for name in rows[0]}


def _folds_of(spec: Spec, system: System) -> Columns:
    """Of one system; it is given up after as many steps as one of many may take."""
    assert spec.span is not None
    low, high = sorted(spec.span, key=abs)
    named = "origin" in spec.fields
    try:
        with counted(each_allowed() / SECONDS_A_STEP):
            found = folds_in_speed(system, low, high, named)
    except TooMuchWork:
        return _nothing(spec, "folds", status.UNFINISHED)
    columns: Columns = {
        "fold_gamma": found.gamma,
        "fold_r_f": found.r_f,
        "fold_change": (found.shapes_above - found.shapes_below).astype(np.int8),
        "fold_below": found.shapes_below.astype(np.int32),
        "fold_error": found.error,
    }
    if named:
        columns["fold_n"] = found.n.astype(np.int32)
    return {name: column[None] for name, column in columns.items()} | {
        "folds": np.array([len(found)], np.int32),
        "folds_status": np.array([status.OK if found.complete else status.NOT_COUNTED], np.int8),
    }


SOLVERS: dict[str, Callable[[Spec, Numbers], Columns]] = {"shapes": _states, "folds": _folds}


def tile_path(folder: Path, number: int) -> Path:
    """The file of a tile.

    Parameters
    ----------
    folder : Path
        Of the map.
    number : int

    Returns
    -------
    Path
    """
    return folder / "tiles" / f"{number // SHELF:04d}" / f"{number:08d}.tile"


def write_tile(path: Path, columns: Columns) -> str:
    """Write the file of a tile and move it into place: at any moment there is none, or a whole one.

    Parameters
    ----------
    path : Path
    columns : dict of ndarray

    Returns
    -------
    str
        Its SHA-256.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **columns)  # type: ignore[arg-type]
    content = buffer.getbuffer()
    digest = hashlib.sha256(content).hexdigest()
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{socket.gethostname()}.{uuid.uuid4().hex}.part")
    try:
        with temporary.open("wb") as file:
            file.write(MARK + digest.encode() + b"\n")
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        with suppress(FileNotFoundError):
            temporary.unlink()
    return digest


def read_tile(path: Path) -> tuple[Columns, str] | None:
    """What a tile holds, and its SHA-256.

    Parameters
    ----------
    path : Path

    Returns
    -------
    (dict of ndarray, str) or None
        None where there is none, or one that has been damaged.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return None
    digest = hashlib.sha256(data[HEADER:]).hexdigest()
    if data[:HEADER] != MARK + digest.encode() + b"\n":
        return None
    with np.load(io.BytesIO(data[HEADER:]), allow_pickle=False) as columns:
        return dict(columns), digest
