"""Who is told that a kernel is being compiled: one listener. And how long compilations have taken.

Cheap to import, for the shell sets the listener before numba is here.
"""

import time
from collections.abc import Callable

_listener: Callable[[str], object] = str
_began = 0.0
_seconds = 0.0


def listen(listener: Callable[[str], object]) -> None:
    """Have `listener` called with the name of each kernel whose compilation begins, not of one found on disk."""
    global _listener
    _listener = listener


def compiling(kernel: str) -> None:
    """Pass on the name of a kernel whose compilation begins."""
    global _began
    _began = time.process_time()
    _listener(kernel)


def compiled() -> None:
    """Count the CPU time since the last compilation began."""
    global _seconds
    _seconds += time.process_time() - _began


def compilation_seconds() -> float:
    """CPU time that compilations have taken in this process [s]."""
    return _seconds
