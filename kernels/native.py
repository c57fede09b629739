"""Kernels called as machine code: no numba in the process that asks, a compiler beside it where there is no code yet.

numba takes 0.7 s of every process before the first kernel has run, most of it for its own tables. What it makes of a
kernel is an object file, though, which llvmlite loads in a millisecond. So kernels are compiled in a process of their
own (`kernels.building`), mostly without numba, once, and kept. The folder they are kept in carries a hash of all
kernel sources, the version of numba and the processor, so that any change of these starts an empty one; each file
begins with the SHA-256 of the rest, and one that does not fit is thrown away.
"""

import ctypes
import hashlib
import importlib
import importlib.metadata
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from towatlas.kernels import notice

SOURCE_FOLDER = Path(__file__).parent
STALE_AFTER = 30 * 86400.0  # s; code of other sources or versions unused for this long is deleted
DIGEST_BYTES = hashlib.sha256().digest_size
# One letter a kind of number, of scalars and of the entries of arrays.
DTYPES = {"f": np.dtype(float), "i": np.dtype(np.int64), "b": np.dtype(bool), "c": np.dtype(complex)}
# As numba passes an array: owner, owner, entries, bytes of one, data, then shape and strides.
ARRAY = "qqqqq"
INTERPRETED = os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def _llvm() -> Any:
    # When a kernel is called, not before: who only looks up has no use for it.
    return importlib.import_module("llvmlite.binding")


@cache
def source_hash() -> str:
    """SHA-256 of every source file of this package, names included."""
    digest = hashlib.sha256()
    for path in sorted(SOURCE_FOLDER.glob("*.py")):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


def features() -> str:
    """What this processor can do, as LLVM writes it; with registers of 512 bits used where it has them.

    LLVM leaves half of them empty on processors that slow down for it, or once did; here they are 1.2 times faster.
    """
    found = _llvm().get_host_cpu_features()
    return found.flatten() + (",-prefer-256-bit" if found.get("avx512f") else "")


@cache
def folder() -> Path | None:
    """Where the code of these sources is kept; None where there is no such place. It may be one to read from only."""
    machine = f"{_llvm().get_host_cpu_name()} {features()}"
    key = f"{importlib.metadata.version('numba')}-{hashlib.sha256(machine.encode()).hexdigest()[:8]}"
    try:
        root = cache_root()
        chosen = root / f"{source_hash()[:16]}-numba-{key}"
        chosen.mkdir(parents=True, exist_ok=True)
        if os.access(chosen, os.W_OK):
            os.utime(chosen)
            _delete_stale(root, chosen)
    except (OSError, RuntimeError):
        return None
    return chosen


def cache_root() -> Path:
    """Where this package keeps what is the same the next time."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen) / "towatlas"
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "towatlas"


def _delete_stale(root: Path, but: Path) -> None:
    for other in root.iterdir():
        # One that another process deletes in the meantime, or a dangling link, is not ours to mind.
        with suppress(OSError):
            if other != but and time.time() - other.stat().st_mtime > STALE_AFTER:
                shutil.rmtree(other, ignore_errors=True)


def digest(code: bytes) -> bytes:
    """What a file begins with: not of the code alone, for what others seal the same way is none of ours."""
    return hashlib.sha256(b"towatlas kernel" + code).digest()


def write_sealed(path: Path, content: bytes) -> None:
    """Write what is kept behind its digest; at once, so that nobody reads half of it."""
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(digest(content) + content)
        os.replace(name, path)
    except BaseException:
        with suppress(OSError):
            os.unlink(name)
        raise


def read_sealed(path: Path) -> bytes | None:
    """What a file holds; None where there is none, or none that is whole."""
    try:
        content = path.read_bytes()
    except IsADirectoryError:
        content = b""
    except OSError:
        return None
    if digest(content[DIGEST_BYTES:]) == content[:DIGEST_BYTES]:
        return content[DIGEST_BYTES:]
    _throw_away(path)
    return None


def _throw_away(path: Path) -> None:
    print(f"towatlas: {path} is damaged: making it again", file=sys.stderr)
    with suppress(OSError):
        shutil.rmtree(path) if path.is_dir() else path.unlink()


class Kernel:
    """A kernel, by the module it is written in and its name.

    arguments : a text of one or more codes, a letter of DTYPES and, for an array, its number of dimensions; or a pair
    of a NamedTuple and the codes of its fields. Arrays are C-contiguous. Threads may call one at the same time.
    """

    def __init__(self, module: str, name: str, *arguments: str | tuple[type, str]):
        self.module, self.name, self.arguments = module, name, arguments
        self.codes: list[_Code] = []
        self._grouped: list[bool] = []
        for argument in arguments:
            text = argument if isinstance(argument, str) else argument[1]
            codes = [_Code(code) for code in text.split()]
            self.codes += codes
            self._grouped += [False] * len(codes) if argument is text else [True]
        self._layout = "".join(code.layout for code in self.codes)
        self._run: Callable[[bytes], int] | None = None
        self._loading = threading.Lock()

    def __call__(self, *arguments: Any) -> None:
        """Run it. What it finds is in the arrays given."""
        if INTERPRETED:
            self.python(*arguments)
            return
        run = self._run or self._load()
        flat: list[Any] = []
        for group, argument in zip(self._grouped, arguments, strict=True):
            flat.extend(argument) if group else flat.append(argument)
        slots: list[Any] = []
        for code, value in zip(self.codes, flat, strict=True):
            code.place(value, slots)
        if run(struct.pack(self._layout, *slots)) != 0:
            raise MemoryError(f"no memory for {self.name}")

    @property
    def python(self) -> Callable[..., None]:
        """The function that is compiled."""
        return getattr(importlib.import_module(f"towatlas.kernels.{self.module}"), self.name)

    @property
    def symbol(self) -> str:
        """Name of what is called, in the object file."""
        return f"towatlas_{self.name}"

    @property
    def path(self) -> Path:
        """The object file, where there is a place for it."""
        return (folder() or Path(os.devnull)) / f"{self.module}.{self.name}.o"

    def _load(self) -> Callable[[bytes], int]:
        with self._loading:
            if self._run is None:
                code = read_sealed(self.path)
                run = None if code is None else self._link(code)
                if code is not None and run is None:
                    _throw_away(self.path)
                if run is None:
                    notice.compiling(self.name)
                    run = self._link(build([self])[0])
                if run is None:
                    raise notice.CompilerError(f"the compiler made no code of {self.name} that can be loaded")
                self._run = run
            return self._run

    def _link(self, code: bytes) -> Callable[[bytes], int] | None:
        """What runs an object file; None for one that is something else."""
        engine = _engine()
        try:
            engine.add_object_file(_llvm().ObjectFileRef.from_data(code))
        except Exception:  # whatever llvmlite raises
            return None
        engine.finalize_object()
        address = engine.get_function_address(self.symbol)
        if not address:
            return None
        function = ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_char_p)(address)
        # The code goes with its engine.
        function.engine = engine  # type: ignore[attr-defined]
        return function


class _Code:
    """One argument: how it is checked and passed."""

    def __init__(self, text: str):
        self.dtype, self.dimensions = DTYPES[text[0]], int(text[1:] or 0)
        self.layout = ARRAY + "qq" * self.dimensions if self.dimensions else {"f": "d", "i": "q"}[text[0]]

    def place(self, value: Any, slots: list[Any]) -> None:
        if not self.dimensions:
            slots.append(value)
            return
        if value.dtype != self.dtype or value.ndim != self.dimensions or not value.flags.c_contiguous:
            raise TypeError(
                f"a C-contiguous array of {self.dimensions} dimensions of {self.dtype} is needed, "
                f"got {value.dtype} of shape {value.shape}, strides {value.strides}"
            )
        slots.extend((0, 0, value.size, value.itemsize, value.__array_interface__["data"][0]))
        slots.extend(value.shape)
        slots.extend(value.strides)


def ready_llvm() -> Any:
    """llvmlite's LLVM, ready to make code for this processor."""
    llvm = _llvm()
    if llvm.llvm_version_info < (20,):
        llvm.initialize()
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm


def _engine() -> Any:
    llvm = ready_llvm()
    machine = llvm.Target.from_default_triple().create_target_machine(jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


def warm(groups: Sequence[Sequence[Kernel]], done: Callable[[Kernel], object]) -> None:
    """Compile what is not yet, two groups at a time; `done` hears of each kernel that is there.

    Raises
    ------
    notice.CompilerError
        Where the compiler fails.
    OSError
        Where there is no place to keep the code.
    """
    if folder() is None:
        raise OSError(
            f"nothing can be written under {cache_root()}: set NUMBA_CACHE_DIR to where compiled kernels may be kept"
        )

    def some(group: Sequence[Kernel]) -> None:
        missing = [kernel for kernel in group if read_sealed(kernel.path) is None]
        if missing:
            build(missing)
        for kernel in group:
            done(kernel)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(some, groups))


def build(kernels: Sequence[Kernel]) -> list[bytes]:
    """Compile kernels in a process of its own; their code, which is kept where there is a place for it.

    Raises
    ------
    notice.CompilerError
        With what the compiler said, where it fails.
    """
    told = json.dumps([features(), [(kernel.module, kernel.name) for kernel in kernels]])
    # It finds the package where this process did, and no module of the folder it happens to be in before that.
    code = "import json, sys; sys.path[:] = json.loads(sys.argv[2]); from towatlas.kernels.building import main; main()"
    command = [sys.executable, "-P", "-c", code, told, json.dumps([str(path) for path in sys.path])]
    done = subprocess.run(command, capture_output=True, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise notice.CompilerError(f"kernels could not be compiled:\n{done.stderr.decode(errors='replace').strip()}")
    size, made = int.from_bytes(done.stdout[-8:], "little"), done.stdout[:-8]
    if not 0 < size <= len(made):
        raise notice.CompilerError("kernels could not be compiled: something else wrote to where their code should be")
    made, parts = made[-size:], []
    for kernel in kernels:
        size = int.from_bytes(made[:8], "little")
        parts.append(made[8 : 8 + size])
        made = made[8 + size :]
        if folder() is not None:
            # On a full disk, say, it is compiled again the next time.
            with suppress(OSError):
                write_sealed(kernel.path, parts[-1])
    return parts
