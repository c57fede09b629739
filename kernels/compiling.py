"""The decorators every kernel is compiled with, and the cache that can never serve older kernels.

numba keys its cache on the source of the *decorated* file alone: a kernel that calls another file's
kernels would keep their old code after a change. Here the cache folder carries a hash of all kernel
sources, so any change anywhere in this package starts an empty cache (test_cache_serves_no_old_kernel).
"""

import hashlib
import os
import shutil
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from types import FunctionType
from typing import Any

import numba

SOURCE_FOLDER = Path(__file__).parent
STALE_AFTER = 30 * 86400.0  # s; a cache of other sources unused for this long is deleted

# numpy's error model: a division by zero is inf or nan, not an exception. An exception is a branch, and a loop
# with branches does not vectorise. Only `contract` of fastmath: fused multiply-adds, and isnan still works.
_OPTIONS: dict = {"error_model": "numpy", "fastmath": {"contract"}}


def source_hash() -> str:
    """SHA-256 of every source file of this package, names included."""
    digest = hashlib.sha256()
    for path in sorted(SOURCE_FOLDER.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def _cache_root() -> Path:
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen) / "towatlas"
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "towatlas"


def _usable_cache() -> Path | None:
    """The cache folder for these sources, or None where nothing can be written."""
    try:
        root = _cache_root()
        folder = root / source_hash()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            return None
        os.utime(folder)
        for other in root.iterdir():
            if other != folder and time.time() - other.stat().st_mtime > STALE_AFTER:
                shutil.rmtree(other, ignore_errors=True)
    except (OSError, RuntimeError):
        return None
    return folder


CACHE = _usable_cache()


@contextmanager
def _own_cache_folder():
    # The folder is a process-wide setting of numba, read while the decorator runs: put it back at once.
    settings: Any = numba.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(CACHE) if CACHE else before
    try:
        yield
    finally:
        settings.CACHE_DIR = before


def inlined(function: Callable) -> Callable:
    """Compile a function that is always inlined into its caller, so that the caller's loop vectorises."""
    return numba.njit(forceinline=True, **_OPTIONS)(function)


def helper(function: Callable) -> Callable:
    """Compile a function that only other kernels call; it is kept on disk with them, not by itself."""
    return numba.njit(**_OPTIONS)(function)


def kernel(function: Callable) -> Callable:
    """Compile a serial kernel that Python calls; kept on disk."""
    with _own_cache_folder():
        return numba.njit(cache=CACHE is not None, **_OPTIONS)(function)


def parallel_kernel(function: Any) -> Callable:
    """Compile the parallel build (`numba.prange`) of a loop; kept on disk.

    numba files compiled code under the name of the function and does not tell the two builds apart, so this one
    gets a name of its own.
    """
    name = function.__name__ + "_parallel"
    twin = FunctionType(function.__code__, function.__globals__, name, function.__defaults__, function.__closure__)
    twin.__qualname__ = name
    twin.__doc__ = function.__doc__
    with _own_cache_folder():
        return numba.njit(cache=CACHE is not None, parallel=True, **_OPTIONS)(twin)
