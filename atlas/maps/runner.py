"""Who computes the tiles: this process, processes of this machine, or a cluster.

A task is a tile: it computes, writes its file, and returns what became of it. All that a killed worker, scheduler or
program had not finished is missing from the folder, and is done again.
"""

import logging
import os
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from towatlas.builders.file import limited_threads
from towatlas.maps.layout import stages
from towatlas.maps.systems import Spec
from towatlas.maps.tiles import compute_tile, tile_path, write_tile

# Memory of a worker, beyond which it is ended and started anew; a tile of 1000 systems takes a tenth of it.
MEMORY = "2 GiB"
# Tasks that a worker has before it, so that it never waits; a scheduler never knows of more than these.
AHEAD = 4
# How often a tile is given out again whose workers are killed, beyond the three times that the scheduler does.
TRIES = 4
# How long a scheduler that is gone, or a cluster without workers, is waited for, s; how long workers of this machine
# may take to come back before they are all started anew; and how often it is looked how many there are.
GONE, BACK, LOOK = 120.0, 60.0, 2.0
# What a worker of dask does by itself, and tiles do not need, takes over a quarter of the time: memory is given back at
# each small array and asked for again, and what runs is looked at a hundred times a second.
TRIM = "MALLOC_TRIM_THRESHOLD_"
LEAN = {f"distributed.nanny.pre-spawn-environ.{TRIM}": None, "distributed.worker.profile.enabled": False}
# What compiling may take, s.
COMPILED = 900.0
# Room that is left on a disk, bytes: for the file systems' own needs, and the next tile of each worker.
SPARE = 50e6


class Interrupted(ArithmeticError):
    """A run that ended with tiles missing."""


@dataclass(frozen=True)
class Done:
    """What became of a tile.

    Attributes
    ----------
    number : int
        Of the tile.
    systems : int
        In it.
    message : str
        Why there is none; empty where it is written.
    """

    number: int
    systems: int
    message: str = ""


def do_tile(folder: str, spec: Spec, number: int) -> Done:
    """Compute and write a tile: the task that workers run.

    Parameters
    ----------
    folder : str
        Of the map.
    spec : Spec
    number : int
        Of the tile.

    Returns
    -------
    Done
    """
    try:
        if shutil.disk_usage(folder).free < SPARE:
            raise OSError("no room is left on the disk")
        with limited_threads(1):
            columns = compute_tile(spec, number)
        write_tile(tile_path(Path(folder), number), columns)
    except OSError as error:
        return Done(number, 0, f"tile {number} was not written: {error}")
    return Done(number, len(next(iter(columns.values()))))


def warm(spec: Spec) -> None:
    """Compile what a map needs, or read it from the cache: a task that each kind of processor does once.

    Parameters
    ----------
    spec : Spec
    """
    first = 0
    with limited_threads(1):
        for tiles in stages(spec).values():
            compute_tile(spec, first, slice(2))
            first += len(tiles)


def run_tiles(
    folder: Path,
    spec: Spec,
    numbers: Sequence[int],
    *,
    workers: int,
    scheduler: str | None,
    bar: tqdm,
) -> None:
    """Compute tiles and write them.

    Parameters
    ----------
    folder : Path
        Of the map.
    spec : Spec
    numbers : sequence of int
        Of the tiles.
    workers : int
        Processes of this machine; 0 for this one.
    scheduler : str, optional
        Address of that of a cluster, in place of processes of this machine.
    bar : tqdm
        Moved on by each tile.

    Raises
    ------
    Interrupted
        If the scheduler is gone for longer than GONE, or tiles kill their workers.
    OSError
        If a file cannot be written, as on a full disk.
    ImportError
        Without dask.
    """
    if workers == 0 and scheduler is None:
        for number in numbers:
            _note(do_tile(str(folder), spec, number), bar)
        return
    left = dict.fromkeys(numbers, 0)
    gone = time.monotonic()
    while left:
        before = len(left)
        try:
            with _client(workers, scheduler) as client:
                _warm_all(client, spec)
                _feed(client, str(folder), spec, left, bar, 1 if scheduler else workers)
        except _lost() as error:
            if len(left) < before:
                gone = time.monotonic()
            if time.monotonic() - gone > GONE:
                reason = str(error) or "the scheduler is gone"
                raise Interrupted(f"{reason}; {len(left)} tiles are missing, --resume goes on") from None
            time.sleep(1.0)


def _lost() -> tuple[type[BaseException], ...]:
    """What is raised where a scheduler is gone."""
    from asyncio import CancelledError as Stopped
    from concurrent.futures import CancelledError

    from distributed.comm import CommClosedError

    return CommClosedError, CancelledError, Stopped, TimeoutError, ConnectionError


@contextmanager
def _client(workers: int, scheduler: str | None) -> Iterator[Any]:
    """A client of a cluster, or of processes of this machine, one thread each."""
    from dask import config
    from distributed import Client, LocalCluster

    # That a scheduler or a worker is gone is dealt with here.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    with ExitStack() as stack:
        address: Any = scheduler
        try:
            if scheduler is None:
                stack.enter_context(config.set(LEAN))
                # A cluster that this process had before leaves its setting here, and what is here goes first.
                if (trim := os.environ.pop(TRIM, None)) is not None:
                    stack.callback(os.environ.__setitem__, TRIM, trim)
                address = stack.enter_context(
                    LocalCluster(
                        n_workers=workers,
                        threads_per_worker=1,
                        memory_limit=MEMORY,
                        dashboard_address=":0",
                        silence_logs=50,
                        env={"NUMBA_NUM_THREADS": "1"},
                    )
                )
            client = stack.enter_context(Client(address, timeout=10))
        # A worker that is killed while it starts is a RuntimeError.
        except (OSError, RuntimeError) as error:
            raise ConnectionError(f"no scheduler at {scheduler}" if scheduler else str(error)) from error
        yield client


def _warm_all(client: Any, spec: Spec) -> None:
    """One worker of each kind of processor compiles before all others begin."""
    from distributed import wait

    client.wait_for_workers(1, timeout=GONE)
    # Not by Client.run, which waits for ever for a worker that is killed in the meantime.
    asked = {
        client.submit(_processor, workers=[worker], allow_other_workers=True, pure=False): worker
        for worker in client.nthreads()
    }
    firsts: dict[str, str] = {}
    for future in wait(list(asked), timeout=BACK).done:
        if future.status == "finished":
            firsts.setdefault(future.result(), asked[future])
    wait(
        [
            client.submit(warm, spec, workers=[worker], allow_other_workers=True, pure=False)
            for worker in firsts.values()
        ],
        timeout=COMPILED,
    )


def _processor() -> str:
    """The machine and its kind of processor: whose compiled code it can read."""
    import platform

    from llvmlite.binding import get_host_cpu_name

    return f"{platform.node()} {get_host_cpu_name()}"


def _feed(client: Any, folder: str, spec: Spec, left: dict[int, int], bar: tqdm, least: int) -> None:
    """Hand out tiles, a few ahead of the workers there are; takes out of `left` those that are written.

    Fewer workers than `least` for long are a lost cluster: who starts one anew for a killed one may have given up.
    """
    from distributed import wait

    waiting = iter(list(left))
    running: dict[Any, int] = {}
    looked, enough, room = 0.0, time.monotonic(), AHEAD
    while left:
        if (now := time.monotonic()) > looked + LOOK:
            if client.status != "running":
                raise ConnectionError("the scheduler is gone")
            there = len(client.nthreads())
            looked, enough, room = now, now if there >= least else enough, AHEAD * max(1, there)
            if now - enough > BACK:
                raise ConnectionError("the workers are gone")
        while len(running) < room and (number := next(waiting, None)) is not None:
            running[client.submit(do_tile, folder, spec, number, pure=False)] = number
        try:
            finished = wait(list(running), timeout=LOOK, return_when="FIRST_COMPLETED").done
        except TimeoutError:
            continue
        for future in finished:
            number = running.pop(future)
            if future.status == "finished":
                done = future.result()
                left.pop(number)
                _note(done, bar)
            else:
                again = _again(future, number, left)
                running[client.submit(do_tile, folder, spec, again, pure=False)] = again


def _again(future: Any, number: int, left: dict[int, int]) -> int:
    """The number of a tile whose workers were killed, if it may be tried once more."""
    from distributed import KilledWorker

    error = future.exception()
    if not isinstance(error, KilledWorker):
        raise error
    left[number] += 1
    if left[number] > TRIES:
        raise Interrupted(f"tile {number} ended {4 * TRIES} workers, for want of memory perhaps; make tiles smaller")
    return number


def _note(done: Done, bar: tqdm) -> None:
    if done.message:
        raise OSError(f"{done.message}; make room, and --resume goes on")
    bar.update(done.systems)
