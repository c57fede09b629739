"""`towatlas warmup`: compile everything now, so that no later answer waits for it."""

import argparse
import sys
import time
from typing import Any

from towatlas.commands.common import OK, say


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "warmup",
        help="compile now what is compiled once",
        description="Compile all that computes, two processes at a time, so that no later answer waits for it. It is "
        "kept for this version of towatlas and numba and this kind of processor, under $NUMBA_CACHE_DIR or ~/.cache.",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bar, and no word at the end")
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    from tqdm import tqdm

    from towatlas.kernels import calls, native

    began = time.monotonic()
    missing = sum(not kernel.path.exists() for kernel in calls.KERNELS)
    if missing and not options.quiet and not sys.stderr.isatty():
        say(f"compiling {missing} kernels, some seconds")
    with tqdm(total=len(calls.KERNELS), desc="compiling", disable=options.quiet or None, leave=False) as bar:
        native.warm(calls.GROUPS, lambda kernel: bar.update())
    if not options.quiet:
        took = time.monotonic() - began
        say(f"{len(calls.KERNELS)} kernels are compiled, in {took:.1f} s, and kept in {native.folder()}")
    return OK
