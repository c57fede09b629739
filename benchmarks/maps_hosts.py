"""`python -m benchmarks.maps_hosts`: a map computed by two hosts, beside one computed by this process alone.

The hosts are network namespaces with an address and a host name each, joined by a pair of virtual interfaces: needs
root and Linux. The first has the scheduler, the command and a worker, the second a worker. While the map is computed
the line between them is cut for a time. Then every file of the two maps is compared. Writes a line to
docs/data/maps_hosts.csv.
"""

import argparse
import csv
import os
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from benchmarks.maps_chaos import DATA, STUCK, compare, spec_of, written
from towatlas.maps.build import build_map
from towatlas.maps.layout import count_tiles
from towatlas.maps.spec import make_spec

OUT = DATA.with_name("maps_hosts.csv")
# Addresses of the two hosts, which nothing outside of their namespaces reaches, and the port of the scheduler.
ADDRESSES = ("10.213.7.1", "10.213.7.2")
PORT = 8786
# A worker that lost its scheduler ends; on a cluster a service starts it anew.
AGAIN = """
import subprocess, sys
while True:
    subprocess.run([sys.executable, "-m", "dask", "worker", *sys.argv[1:]])
"""
CLOCK = os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Row:
    """One map: systems, tiles, seconds that the line was cut and that it all took, CPU seconds of each host (of the
    first with its scheduler, without the command), files, how many of them differ."""

    systems: int
    tiles: int
    cut: float
    seconds: float
    first_host: float
    second_host: float
    files: int
    different: int


def ip(*arguments: str) -> str:
    """Run `ip`."""
    return subprocess.run(["ip", *arguments], check=True, capture_output=True, text=True).stdout


def possible() -> bool:
    """Whether namespaces can be made here."""
    name = f"towatlas-{os.getpid()}-try"
    try:
        ip("netns", "add", name)
        ip("netns", "del", name)
    except (OSError, subprocess.CalledProcessError):
        return False
    return True


@contextmanager
def two_hosts() -> Iterator[list[str]]:
    """Two namespaces with a line between them; what runs in them is ended with them."""
    hosts = [f"towatlas-{os.getpid()}-{letter}" for letter in "ab"]
    with ExitStack() as stack:
        for host in hosts:
            ip("netns", "add", host)
            stack.callback(ip, "netns", "del", host)
            stack.callback(end_all, host)
            ip("-n", host, "link", "set", "lo", "up")
        ip("link", "add", "line", "netns", hosts[0], "type", "veth", "peer", "name", "line", "netns", hosts[1])
        for host, address in zip(hosts, ADDRESSES, strict=True):
            ip("-n", host, "address", "add", f"{address}/24", "dev", "line")
            ip("-n", host, "link", "set", "line", "up")
        yield hosts


def processes(host: str) -> list[int]:
    """Those of a host."""
    return [int(number) for number in ip("netns", "pids", host).split()]


def end_all(host: str) -> None:
    """End all processes of a host, and wait until they are gone."""
    while numbers := processes(host):
        for number in numbers:
            with suppress(ProcessLookupError):
                os.kill(number, 9)
        time.sleep(0.1)


def start(host: str, *command: str) -> subprocess.Popen:
    """Run a command of Python on a host, under its name."""
    shell = 'hostname "$0" && exec "$@"'
    words = ["ip", "netns", "exec", host, "unshare", "--uts", "sh", "-c", shell, host, sys.executable, *command]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def cpu(numbers: list[int]) -> float:
    """CPU time of processes [s]."""
    total = 0
    for number in numbers:
        with suppress(OSError):
            words = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
            total += sum(map(int, words[11:15]))
    return total / CLOCK


def run(share: float, tile: int, cut: float, folder: Path) -> Row:
    """Compute a map by two hosts and by this process."""
    text, systems = spec_of("drag", share, tile)
    spec = folder / "drag.toml"
    spec.write_text(text)
    made = make_spec(tomllib.loads(text))
    tiles = count_tiles(made)
    build_map(made, folder / "alone", workers=0)
    address = f"tcp://{ADDRESSES[0]}:{PORT}"
    with ExitStack() as ended, two_hosts() as (first, second):
        serve = ["-m", "dask", "scheduler", "--host", ADDRESSES[0], "--port", str(PORT)]
        ended.callback(start(first, *serve, "--no-dashboard").wait)
        for host in (first, second):
            work = ["-c", AGAIN, address, "--nthreads", "1", "--local-directory", str(folder / host)]
            ended.callback(start(host, *work, "--no-dashboard").wait)
        began = time.monotonic()
        program = start(
            first, "-m", "towatlas", "map", str(spec), "--out", str(folder / "apart"), "--scheduler", address, "--quiet"
        )
        was_cut = False
        used = [0.0, 0.0]
        while program.poll() is None:
            if time.monotonic() - began > STUCK:
                raise RuntimeError(f"the map is not done after {STUCK:g} s")
            others = [number for number in processes(first) if number != program.pid]
            used = [max(used[0], cpu(others)), max(used[1], cpu(processes(second)))]
            if not was_cut and written(folder / "apart") >= tiles // 3:
                ip("-n", second, "link", "set", "line", "down")
                time.sleep(cut)
                ip("-n", second, "link", "set", "line", "up")
                was_cut = True
            time.sleep(0.2)
        if program.returncode:
            raise RuntimeError(f"the command ended with {program.returncode}")
        if not was_cut:
            raise RuntimeError("the map was done before the line was cut")
        took = time.monotonic() - began
    files, different = compare(folder / "alone", folder / "apart")
    return Row(systems, tiles, cut, round(took, 1), round(used[0], 1), round(used[1], 1), files, different)


def main() -> int:
    """One map; 1 if any file differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="of the systems of benchmarks.maps_chaos, default all")
    parser.add_argument("--tile", type=int, default=1000)
    parser.add_argument("--cut", type=float, default=40.0, help="seconds without a line between the hosts")
    parser.add_argument("--out", type=Path, default=OUT)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        row = run(options.share, options.tile, options.cut, Path(folder))
    print(row)
    with options.out.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow([field.name for field in fields(Row)])
        writer.writerow(astuple(row))
    return int(row.different > 0)


if __name__ == "__main__":
    sys.exit(main())
