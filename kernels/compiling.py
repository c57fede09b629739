"""The decorators every kernel is compiled with, and a cache that serves neither old nor damaged kernels.

numba keys its cache on the source of the *decorated* file alone: a kernel that calls another file's
kernels would keep their old code after a change. Here the cache folder carries a hash of all kernel
sources, so any change anywhere in this package starts an empty cache (test_cache_serves_no_old_kernel).
Nor does numba look at what it reads: a file cut short is a traceback at every start, a flipped bit other machine code.
Here each file begins with the SHA-256 of the rest, and one that does not fit is thrown away.
"""

import hashlib
import os
import pickle
import shutil
import sys
import threading
import time
from collections.abc import Callable
from contextlib import contextmanager, suppress
from functools import wraps
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from numba.core import event
from numba.core.caching import FunctionCache, IndexDataCacheFile

from towatlas.kernels import notice

SOURCE_FOLDER = Path(__file__).parent
STALE_AFTER = 30 * 86400.0  # s; a cache of other sources unused for this long is deleted
DIGEST_BYTES = hashlib.sha256().digest_size

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
        folder = root / f"{source_hash()[:16]}-numba-{numba.__version__}"
        folder.mkdir(parents=True, exist_ok=True)
        if not os.access(folder, os.W_OK):
            return None
        os.utime(folder)
        for other in root.iterdir():
            # One that another process deletes in the meantime, or a dangling link, is not ours to mind.
            with suppress(OSError):
                if other != folder and time.time() - other.stat().st_mtime > STALE_AFTER:
                    shutil.rmtree(other, ignore_errors=True)
    except (OSError, RuntimeError):
        return None
    return folder


CACHE = _usable_cache()


class _SealedFile(IndexDataCacheFile):
    """numba's index and data files of one kernel, each behind a digest."""

    def _load_index(self) -> dict:
        stamp, overloads = self._read(self._index_path) or (None, {})
        return overloads if stamp == self._source_stamp else {}

    def _save_index(self, overloads: dict) -> None:
        self._write(self._index_path, (self._source_stamp, overloads))

    def _load_data(self, name: str) -> Any:
        return self._read(self._data_path(name))

    def _save_data(self, name: str, data: Any) -> None:
        self._write(self._data_path(name), data)

    def _read(self, path: str) -> Any:
        """What a file holds; None where there is none, or none that is whole."""
        if Path(path).is_dir():
            _throw_away(path)
        try:
            content = Path(path).read_bytes()
        except OSError:
            return None
        seal, payload = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
        if hashlib.sha256(payload).digest() != seal:
            _throw_away(path)
            return None
        return pickle.loads(payload)

    def _write(self, path: str, content: Any) -> None:
        payload = self._dump(content)
        with self._open_for_write(path) as file:
            file.write(hashlib.sha256(payload).digest() + payload)


class _SealedCache(FunctionCache):
    """numba's cache of one kernel, on files that are checked."""

    def __init__(self, function: Callable):
        super().__init__(function)
        plain = self._cache_file
        self._cache_file = _SealedFile(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=plain._source_stamp,
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # whatever a file raises that is whole, but not what numba would write
            # The index leads to all others.
            _throw_away(self._cache_file._index_path)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        # Where nothing can be written, as on a full disk, the kernel is compiled again the next time.
        with suppress(OSError):
            super().save_overload(sig, data)


_said_damaged = False


def _throw_away(path: str) -> None:
    """Delete a damaged file; the first of a process is told of."""
    global _said_damaged
    with suppress(OSError):
        shutil.rmtree(path) if os.path.isdir(path) else os.unlink(path)
    if not _said_damaged:
        _said_damaged = True
        print(f"towatlas: {path} is damaged: compiling what was in it again", file=sys.stderr)


class _Listener(event.Listener):
    """Tells `kernels.notice` of every kernel that is compiled; what it calls is compiled within."""

    def __init__(self) -> None:
        self.depth = 0
        self.ours = False

    def on_start(self, event: event.Event) -> None:
        function = event.data["dispatcher"].py_func
        # numba compiles under a lock of its own: one thread at a time counts here.
        if self.depth == 0 and (function.__module__ or "").startswith(__name__.rpartition(".")[0]):
            self.ours = True
            notice.compiling(function.__name__)
        self.depth += 1

    def on_end(self, event: event.Event) -> None:
        self.depth -= 1
        if self.depth == 0 and self.ours:
            self.ours = False
            notice.compiled()


event.register("numba:compile", _Listener())


@contextmanager
def _own_cache_folder():
    # The folder is a process-wide setting of numba, read while the cache is made: put it back at once.
    settings: Any = numba.config
    before = settings.CACHE_DIR
    settings.CACHE_DIR = str(CACHE) if CACHE else before
    try:
        yield
    finally:
        settings.CACHE_DIR = before


def _compiled(function: Callable, **options: Any) -> Any:
    """A kernel that Python calls; kept on disk where there is a place for it."""
    dispatcher: Any = numba.njit(**_OPTIONS, **options)(function)
    if CACHE is not None and not numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        with _own_cache_folder():
            dispatcher._cache = _SealedCache(function)
    return dispatcher


def inlined(function: Callable) -> Callable:
    """Compile a function that is always inlined into its caller, so that the caller's loop vectorises."""
    return numba.njit(forceinline=True, **_OPTIONS)(function)


def helper(function: Callable) -> Callable:
    """Compile a function that only other kernels call; it is kept on disk with them, not by itself."""
    return numba.njit(**_OPTIONS)(function)


def kernel(function: Callable) -> Callable:
    """Compile a serial kernel that Python calls, several threads at a time if they like; kept on disk."""
    return _compiled(function, nogil=True)


# One parallel kernel at a time: each takes all threads anyway, and of numba's threading layers workqueue, the one that
# is always there, ends the process when two threads call at once. Reentrant, for a signal may call one on the way out
# of another; and a child of a fork begins with one that nobody holds.
_one_at_a_time = threading.RLock()


def _renew_lock() -> None:
    global _one_at_a_time
    _one_at_a_time = threading.RLock()


os.register_at_fork(after_in_child=_renew_lock)


def parallel_kernel(function: Any) -> Callable:
    """Compile the parallel build (`numba.prange`) of a loop; kept on disk.

    Calls of several threads wait for each other. numba files compiled code under the name of the
    function and does not tell the two builds apart, so this one gets a name of its own.
    """
    name = function.__name__ + "_parallel"
    twin = FunctionType(function.__code__, function.__globals__, name, function.__defaults__, function.__closure__)
    twin.__qualname__ = name
    twin.__doc__ = function.__doc__
    dispatcher = _compiled(twin, parallel=True)

    @wraps(twin)
    def run(*arguments: Any) -> None:
        with _one_at_a_time:
            dispatcher(*arguments)

    return run
