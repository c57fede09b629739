"""A map from its spec: what is missing is computed, and all of it put together."""

import fcntl
import hashlib
import json
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from math import prod
from pathlib import Path

import numpy as np

from towatlas.builders.file import limited_threads, progress_bar
from towatlas.kernels import status
from towatlas.kernels.native import source_hash
from towatlas.maps.layout import count_tiles, place_of, stages
from towatlas.maps.runner import run_tiles, warm
from towatlas.maps.spec import MOST_SYSTEMS
from towatlas.maps.store import merge, whole_tile, write_store
from towatlas.maps.systems import Spec
from towatlas.maps.tiles import compute_tile
from towatlas.tables.seal import AtlasFileError

# Of an estimate: tiles that are looked into, neighbouring systems of each, and CPU time after which no more are, s.
SAMPLED, NEIGHBOURS, ENOUGH = 40, 8, 5.0
# Rooms of the package that compute tiles; figures, commands and the like may change between a start and --resume.
ROOMS = ("", "maps", "numerics", "solve")
# By stage: what has a status, and what there is of each shape or fold.
CODES = {
    "shapes": ("status", "nodes"),
    "folds": ("folds_status", "fold_gamma"),
    "checks": ("check_folds_status", "check_fold_gamma"),
}
# The store holds the numbers of the tiles once more.
COPIES = 2


@dataclass(frozen=True)
class Estimate:
    """What a map will take.

    Attributes
    ----------
    systems, tiles : int
    seconds : float
        Of CPU, on processors as this one [s].
    size : float
        Of its files, before they are compressed [bytes].
    """

    systems: int
    tiles: int
    seconds: float
    size: float

    def __str__(self) -> str:
        each = 1e3 * self.seconds / self.systems
        return (
            f"{self.systems:,} systems in {self.tiles:,} tiles: about {_time(self.seconds)} of CPU ({each:.3g} ms a "
            f"system) and {_size(self.size)} on the disk"
        )


def _time(seconds: float) -> str:
    for unit, length in (("years", 365.25 * 86400.0), ("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{seconds / length:,.2g} {unit}" if seconds < 100 * length else f"{seconds / length:,.0f} {unit}"
    return f"{seconds:.2g} s"


def _size(size: float) -> str:
    for unit, length in (("PB", 1e15), ("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= length:
            return f"{size / length:,.3g} {unit}"
    return f"{size / 1e3:.3g} kB"


def estimate(spec: Spec) -> Estimate:
    """What a map will take, from some of its systems.

    Parameters
    ----------
    spec : Spec

    Returns
    -------
    Estimate
    """
    seconds = size = 0.0
    first = 0
    rng = np.random.default_rng(0)
    with limited_threads(1):
        warm(spec)
        for stage, tiles in stages(spec).items():
            began, looked, held = time.process_time(), 0, 0
            some = NEIGHBOURS if stage == "shapes" else 1
            for k in rng.integers(len(tiles), size=SAMPLED):
                most = len(tiles.indices(int(k))[0]) - some
                begin = int(rng.integers(max(0, most) + 1))
                columns = compute_tile(spec, first + int(k), slice(begin, begin + some))
                looked += len(next(iter(columns.values())))
                held += sum(column.nbytes for column in columns.values())
                if time.process_time() - began > ENOUGH:
                    break
            share = float(np.prod([float(len(axis.values)) for axis in tiles.axes])) / looked
            seconds += share * (time.process_time() - began)
            size += share * held * COPIES
            first += len(tiles)
    return Estimate(spec.systems, first, seconds, size)


def refuse(spec: Spec, expected: Estimate, folder: Path | None) -> None:
    """Refuse what no machine finishes, or no disk holds.

    Parameters
    ----------
    spec : Spec
    expected : Estimate
    folder : Path, optional
        Where the map goes.

    Raises
    ------
    ValueError
    """
    if spec.systems > MOST_SYSTEMS:
        raise ValueError(f"{expected}; a map has at most {MOST_SYSTEMS:,} systems: fewer points, or several maps")
    if folder is not None:
        there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
        if (free := shutil.disk_usage(there).free) < expected.size:
            raise ValueError(f"{expected}, but {_size(free)} are free at {there}: fewer points or fields, another disk")


def build_map(
    spec: Spec,
    folder: Path,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    resume: bool = False,
    netcdf: Path | None = None,
    progress: bool = False,
    report: Callable[[str], object] = repr,
) -> int:
    """Compute what is missing of a map, and put all of it together.

    Parameters
    ----------
    spec : Spec
    folder : Path
        Of the map; made if there is none.
    workers : int
        Processes of this machine; 0 for this one alone.
    scheduler : str, optional
        Address of that of a cluster, whose workers see the same folder.
    resume : bool
        Whether to go on with a map that was begun.
    netcdf : Path, optional
        A file that the map is written to as well.
    progress : bool
        Whether a bar is drawn on a terminal.
    report : callable
        Told what is going on.

    Returns
    -------
    int
        How many systems, or cables of which folds are asked, have another status than computed.

    Raises
    ------
    ValueError
        If the folder holds a map, or another one.
    ArithmeticError
        If tiles are missing in the end.
    OSError
        If something cannot be written.
    """
    for package in ("dask", "distributed", "zarr"):
        if find_spec(package) is None:
            raise ValueError(f"maps need {package}, which is not installed: pip install 'towatlas[cluster]'")
    with _locked(folder):
        _check_plan(spec, folder, resume)
        _remove_orphans(folder)
        count = count_tiles(spec)
        known: dict[int, _Known] = {}
        # A tile that has been damaged since it was computed is computed again, once.
        for _ in range(2):
            missing = _survey(folder, spec, known, progress)
            if not missing:
                break
            report(f"{len(missing):,} of {count:,} tiles to do")
            left = _systems(spec, missing)
            with progress_bar(_systems(spec, range(count)), "system", progress) as bar:
                bar.update(bar.total - left)
                run_tiles(folder, spec, missing, workers=workers, scheduler=scheduler, bar=bar)
        else:
            if _survey(folder, spec, known, progress):
                raise AtlasFileError(
                    f"tiles that were written cannot be read in {folder}: do the workers write into the same folder?"
                )
        widths = {
            dim: max([1, *(one.width for one in known.values() if one.shapes == (dim == "shape"))])
            for dim in ("shape", "fold")
        }
        digests = [known[number].digest for number in range(count)]
        # Of workers killed on the way.
        _remove_orphans(folder)
        write_store(folder, spec, widths, digests, progress)
    if netcdf is not None:
        merge(folder, spec, netcdf)
    return sum(one.failed for one in known.values())


@dataclass(frozen=True)
class _Known:
    """Of a tile that is there: its SHA-256, whether of shapes, most of these or of folds, systems with a status."""

    digest: str
    shapes: bool
    width: int
    failed: int


def _survey(folder: Path, spec: Spec, known: dict[int, _Known], progress: bool) -> list[int]:
    """The tiles that are missing; what is known of the others is added."""
    missing = []
    unread = [number for number in range(count_tiles(spec)) if number not in known]
    with progress_bar(len(unread), "tile", progress) as bar:
        for number in unread:
            bar.update()
            if (found := whole_tile(folder, number)) is None:
                missing.append(number)
                continue
            columns, digest = found
            stage = place_of(spec, number)[0]
            code, each = CODES[stage]
            failed = int((columns[code] != status.OK).sum())
            known[number] = _Known(digest, stage == "shapes", columns[each].shape[1], failed)
    return missing


def _systems(spec: Spec, numbers: Iterable[int]) -> int:
    """How many systems there are in some tiles."""
    places = (place_of(spec, number) for number in numbers)
    return sum(prod(part.stop - part.start for part in tiles.slices(k)) for _, tiles, k in places)


def begun(folder: Path) -> bool:
    """Whether there is a map in a folder, or a part of one.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    bool
    """
    return (folder / "plan.json").exists()


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """One program at a time in a folder; the lock of one that is killed goes with it."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / "lock").open("w")
    except OSError as error:
        raise AtlasFileError(f"{folder} cannot be written: {error.strerror}") from None
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise AtlasFileError(f"another program is at work in {folder}; wait for it") from None
        yield


def _check_plan(spec: Spec, folder: Path, resume: bool) -> None:
    """The folder is new, or holds a part of the same map, computed by the same code."""
    plan = {
        "spec_sha256": spec.sha256,
        "kernel_sources_sha256": source_hash(),
        "package_sources_sha256": _package_hash(),
        "towatlas_version": version("towatlas"),
    }
    file = folder / "plan.json"
    if not begun(folder):
        if any(child.name not in ("lock", "plan.json.part") for child in folder.iterdir()):
            raise ValueError(f"{folder} is not empty, and holds no map: name a new folder")
        written = folder / "plan.json.part"
        written.write_text(json.dumps(plan, indent=1))
        written.replace(file)
        return
    if not resume:
        raise ValueError(f"{folder} holds a map already: --resume goes on with it, or name a new folder")
    known = json.loads(file.read_text())
    if known.get("spec_sha256") != spec.sha256:
        raise ValueError(f"{folder} holds a map of another spec: name a new folder")
    if known != plan:
        raise ValueError(f"{folder} was begun with another version of towatlas, whose numbers may differ: begin anew")


def _package_hash() -> str:
    """SHA-256 of the files of the package, besides its kernels, that the numbers of a tile follow from."""
    root = Path(__file__).parent.parent
    files = [path for room in ROOMS for path in (root / room).iterdir() if path.suffix in (".py", ".npz")]
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _remove_orphans(folder: Path) -> None:
    """What those who were killed left."""
    for orphan in folder.glob("tiles/*/*.part"):
        orphan.unlink(missing_ok=True)
    for orphan in folder.glob("map.*.part"):
        shutil.rmtree(orphan, ignore_errors=True)
