"""The parallel builds: each is the serial kernel of its name over blocks of rows, on all of numba's threads.

Every row is written by index and computed the same way wherever it falls, so the results are identical to the last
bit for any number of threads. One parallel call costs about a millisecond: for a few rows call the serial kernel.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba

from towatlas.kernels.compiling import parallel_kernel
from towatlas.kernels.drag_shots import Algebra, Reached, Shots, shoot_drag
from towatlas.kernels.drag_stiff import Marched, shoot_stiff
from towatlas.kernels.folds import Cables, Folds, solve_folds
from towatlas.kernels.lanes import march
from towatlas.kernels.scan import forward_shots, scan_system

# Rows a block: enough to keep the lanes full, few enough to share the work out evenly.
SHOTS_BLOCK = 256
FOLDS_BLOCK = 128
FORWARD_BLOCK = 1024
# Shots with drag that a thread takes at a time, at least; so many times it takes some.
DRAG_BLOCK, BLOCKS_A_THREAD = 64, 4


def _march(a, mu, tau_end, first_fold, last_fold, max_steps, ends, folds, counts, statuses):
    rows = len(a)
    for block in numba.prange((rows + SHOTS_BLOCK - 1) // SHOTS_BLOCK):
        begin = block * SHOTS_BLOCK
        stop = min(rows, begin + SHOTS_BLOCK)
        march(a, mu, tau_end, first_fold, last_fold, max_steps, ends, folds, counts, statuses, begin, stop)


def _solve_folds(lam, w_f, n, excess, a, gamma, slopes, states, error, statuses, max_steps):
    rows = len(n)
    for block in numba.prange((rows + FOLDS_BLOCK - 1) // FOLDS_BLOCK):
        begin = block * FOLDS_BLOCK
        stop = min(rows, begin + FOLDS_BLOCK)
        # numba takes no tuples into a parallel loop: they are made inside.
        cables, folds = Cables(lam, w_f, n, excess), Folds(a, gamma, slopes, states, error, statuses)
        solve_folds(cables, folds, max_steps, begin, stop)


def _forward_shots(lam, w_f, gamma, r_x0, segments, errors, x_end, r_x_end):
    rows = len(lam)
    for block in numba.prange((rows + FORWARD_BLOCK - 1) // FORWARD_BLOCK):
        begin = block * FORWARD_BLOCK
        stop = min(rows, begin + FORWARD_BLOCK)
        forward_shots(lam, w_f, gamma, r_x0, segments, errors, x_end, r_x_end, begin, stop)


def _scan_systems(lam, w_f, gamma_low, gamma_high, speeds, guesses, segments, n_max, tolerance, results, statuses):
    for row in numba.prange(len(lam)):
        scan_system(
            lam[row],
            w_f[row],
            gamma_low[row],
            gamma_high[row],
            speeds,
            guesses,
            segments,
            n_max,
            tolerance,
            results[row],
            statuses[row],
        )


def shoot_drag_threads(
    shots: Shots, algebra: Algebra, truncation: float, max_steps: int, reached: Reached, begin: int, stop: int
) -> None:
    """`shoot_drag` over blocks of rows, on as many threads as numba is allowed."""
    _in_threads(
        lambda first, last: shoot_drag(shots, algebra, truncation, max_steps, reached, first, last), begin, stop
    )


def shoot_stiff_threads(marched: Marched, system: Any, tolerance: float, max_steps: int, begin: int, stop: int) -> None:
    """`shoot_stiff` over blocks of rows, on as many threads as numba is allowed."""
    _in_threads(lambda first, last: shoot_stiff(marched, system, tolerance, max_steps, first, last), begin, stop)


def _in_threads(shoot: Callable[[int, int], None], begin: int, stop: int) -> None:
    # Few blocks, for at the end of each the longest shot leaves the other lanes idle; a few for each thread, to share.
    threads = numba.get_num_threads()
    block = stop - begin if threads < 2 else max(DRAG_BLOCK, -(-(stop - begin) // (BLOCKS_A_THREAD * threads)))
    begins = range(begin, stop, block)
    threads = min(len(begins), threads)
    if threads < 2:
        for first in begins:
            shoot(first, min(stop, first + block))
        return
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(lambda first: shoot(first, min(stop, first + block)), begins))


march_parallel = parallel_kernel(_march)
solve_folds_parallel = parallel_kernel(_solve_folds)
forward_shots_parallel = parallel_kernel(_forward_shots)
scan_systems_parallel = parallel_kernel(_scan_systems)
