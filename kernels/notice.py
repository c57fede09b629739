"""Who is told that a kernel is being compiled: one listener. And what is raised where that fails.

Cheap to import.
"""

from collections.abc import Callable


class CompilerError(RuntimeError):
    """Kernels could not be compiled."""


_listener: Callable[[str], object] = str


def listen(listener: Callable[[str], object]) -> None:
    """Have `listener` called with the name of each kernel whose compilation begins, not of one found on disk."""
    global _listener
    _listener = listener


def compiling(kernel: str) -> None:
    """Pass on the name of a kernel whose compilation begins."""
    _listener(kernel)
