"""Kernels over many rows, in blocks, on all threads.

Every row is written by index and computed the same way wherever it falls, so the results are identical to the last
bit for any number of threads. Threads cost a tenth of a millisecond: for a few rows call the kernel.
"""

import os
from _thread import LockType, allocate_lock, start_new_thread
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from towatlas.kernels import calls
from towatlas.kernels.calls import Algebra, Cables, Folds, Marched, Reached, Shots

# Rows a block: enough to keep the lanes full, few enough to share the work out evenly.
SHOTS_BLOCK = 256
FOLDS_BLOCK = 128
FORWARD_BLOCK = 1024
# Shots with drag that a thread takes at a time, at least; so many times it takes some.
DRAG_BLOCK, BLOCKS_A_THREAD = 64, 4


def _most_threads() -> int:
    asked = os.environ.get("NUMBA_NUM_THREADS", "")
    if asked.isdigit() and int(asked) > 0:
        return int(asked)
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


MOST_THREADS = _most_threads()
_threads = MOST_THREADS


def threads() -> int:
    """How many threads kernels are called from."""
    return _threads


@contextmanager
def limited_threads(count: int) -> Iterator[None]:
    """Within, everything of this process runs on so many threads."""
    global _threads
    before, _threads = _threads, count
    try:
        yield
    finally:
        _threads = before


def march_parallel(a, mu, tau_end, first_fold, last_fold, max_steps, ends, folds, counts, statuses):
    """`march` of all rows."""
    given = a, mu, tau_end, first_fold, last_fold, max_steps, ends, folds, counts, statuses
    _in_threads(lambda begin, stop: calls.march(*given, begin, stop), 0, len(a), SHOTS_BLOCK)


def solve_folds_parallel(cables: Cables, folds: Folds, max_steps: int) -> None:
    """`solve_folds` of all rows."""
    _in_threads(
        lambda begin, stop: calls.solve_folds(cables, folds, max_steps, begin, stop), 0, len(cables.n), FOLDS_BLOCK
    )


def forward_shots_parallel(lam, w_f, gamma, r_x0, segments, errors, x_end, r_x_end):
    """`forward_shots` of all rows."""
    given = lam, w_f, gamma, r_x0, segments, errors, x_end, r_x_end
    _in_threads(lambda begin, stop: calls.forward_shots(*given, begin, stop), 0, len(lam), FORWARD_BLOCK)


def scan_systems_parallel(
    lam, w_f, gamma_low, gamma_high, speeds, guesses, segments, n_max, tolerance, results, statuses
):
    """`scan_system` of each row; results and statuses a row each."""

    def one(row: int, _: int) -> None:
        cable = lam[row], w_f[row], gamma_low[row], gamma_high[row]
        calls.scan_system(*cable, speeds, guesses, segments, n_max, tolerance, results[row], statuses[row])

    _in_threads(one, 0, len(lam), 1)


def shoot_drag_threads(
    shots: Shots, algebra: Algebra, truncation: float, max_steps: int, reached: Reached, begin: int, stop: int
) -> None:
    """`shoot_drag` over blocks of rows."""
    _in_threads(
        lambda first, last: calls.shoot_drag(shots, algebra, truncation, max_steps, reached, first, last),
        begin,
        stop,
        _drag_block(stop - begin),
    )


def shoot_stiff_threads(marched: Marched, system: Any, tolerance: float, max_steps: int, begin: int, stop: int) -> None:
    """`shoot_stiff` over blocks of rows."""
    _in_threads(
        lambda first, last: calls.shoot_stiff(marched, system, tolerance, max_steps, first, last),
        begin,
        stop,
        _drag_block(stop - begin),
    )


def _drag_block(rows: int) -> int:
    # Few blocks, for at the end of each the longest shot leaves the other lanes idle; a few for each thread, to share.
    return max(1, rows) if _threads < 2 else max(DRAG_BLOCK, -(-rows // (BLOCKS_A_THREAD * _threads)))


def _in_threads(run: Callable[[int, int], None], begin: int, stop: int, block: int) -> None:
    begins = range(begin, stop, block)
    workers = min(len(begins), _threads)
    if workers < 2:
        for first in begins:
            run(first, min(stop, first + block))
        return
    # Not threading, and not concurrent.futures: they hold locks of the process, which a handler of signals that sweeps
    # would wait for in vain.
    left, failed = iter(begins), list[BaseException]()
    others, ended = list[LockType](), list[LockType]()

    def work() -> None:
        try:
            for first in left:
                run(first, min(stop, first + block))
        except BaseException as error:
            give_up(error)

    def give_up(error: BaseException) -> None:
        failed.append(error)
        for _ in left:
            pass

    def work_beside(done: LockType) -> None:
        work()
        ended.append(done)
        done.release()

    for _ in range(workers - 1):
        done = allocate_lock()
        done.acquire()
        try:
            start_new_thread(work_beside, (done,))
        except RuntimeError:  # no more of them to be had
            break
        others.append(done)
    work()
    while len(ended) < len(others):
        # Whatever is raised in the meantime: they write to the arrays of the caller.
        try:
            for done in others:
                if done not in ended:
                    done.acquire()
        except BaseException as error:
            give_up(error)
    if failed:
        raise failed[0]
