"""`python -m benchmarks.maps_engine`: what the engine of maps costs beside the work, in CPU time; rows of docs/maps.md.

Empty tasks through scheduler and client, and a small map by this process alone, by one worker and by two, with the
CPU time of all processes.
"""

import argparse
import resource
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

from benchmarks.maps_chaos import spec_of
from towatlas.maps.build import build_map
from towatlas.maps.layout import count_tiles
from towatlas.maps.runner import warm
from towatlas.maps.spec import make_spec

AHEAD = 8


def nothing(number: int) -> int:
    """A task without work."""
    return number


def empty_tasks(count: int) -> tuple[float, float]:
    """Tasks a second, and CPU time of scheduler and client for each [s]."""
    from distributed import Client, LocalCluster, wait

    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as cluster, Client(cluster) as client:
        wait([client.submit(nothing, -k, pure=False) for k in range(1, 20)])
        cpu, began = time.process_time(), time.perf_counter()
        running: set[Any] = set()
        for k in range(count):
            running.add(client.submit(nothing, k, pure=False))
            if len(running) >= AHEAD:
                running = set(wait(list(running), return_when="FIRST_COMPLETED").not_done)
        wait(list(running))
        return count / (time.perf_counter() - began), (time.process_time() - cpu) / count


def used() -> float:
    """CPU time of this process and those that it waited for [s]."""
    return sum(
        usage.ru_utime + usage.ru_stime
        for usage in (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    )


def main() -> int:
    """Print what is measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=0.01, help="of the systems of benchmarks.maps_chaos")
    parser.add_argument("--tasks", type=int, default=2000)
    options = parser.parse_args()
    rate, each = empty_tasks(options.tasks)
    print(f"empty tasks: {rate:.0f} a second, {1e3 * each:.2f} ms of CPU each for scheduler and client", flush=True)
    text, systems = spec_of("vacuum", options.share, 1000)
    spec = make_spec(tomllib.loads(text))
    warm(spec)
    print(f"{systems} systems in {count_tiles(spec)} tiles", flush=True)
    for workers in (0, 1, 2):
        with tempfile.TemporaryDirectory() as folder:
            cpu, began = used(), time.perf_counter()
            build_map(spec, Path(folder) / "map", workers=workers)
            print(f"{workers} workers: {used() - cpu:.1f} s of CPU, {time.perf_counter() - began:.1f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
