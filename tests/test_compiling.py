"""The compiler beside the process that asks: what it makes is kept, and never stale."""

import hashlib
import json
import os
import platform
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from towatlas.kernels import building, calls, native, notice

# An answer of a small kernel, how often it was compiled, and which of what should stay out is there.
SHOT = """
import sys
import numpy as np
from towatlas.kernels import notice
heard = []
notice.listen(heard.append)
from towatlas.kernels.calls import forward_shots
one, out = np.ones(1), [np.empty(1) for _ in range(3)]
forward_shots(one, one, one, one, 10, *out, 0, 1)
print(repr(float(out[0][0])), len(heard), "numba" in sys.modules)
"""
KERNELS = Path(native.__file__).parent


def run(code, cache, **environment):
    """Run Python in a process of its own; its output, and what it said on stderr."""
    everything = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"} | environment
    done = subprocess.run([sys.executable, "-c", code], env=everything, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


def copied(folder):
    """The kernels under `folder`, as a package of the name they are installed under."""
    package = folder / "towatlas"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    shutil.copytree(KERNELS, package / "kernels", ignore=shutil.ignore_patterns("__pycache__"))
    return package / "kernels"


def probe(folder, cache):
    """The answer of the kernels under `folder`, and how many were compiled for it."""
    out, _ = run(f"import sys; sys.path.insert(0, {str(folder)!r})" + SHOT, cache)
    value, compiled, _ = out.split()
    return value, int(compiled)


def test_cache_serves_no_old_kernel(tmp_path):
    """Change the equation in one file, its size and time stamp kept: the kernel in another must follow."""
    folder, cache = tmp_path / "sources", tmp_path / "cache"
    kernels = copied(folder)
    first = probe(folder, cache)
    assert first[1] == 1
    assert probe(folder, cache) == (first[0], 0)

    source = kernels / "vacuum.py"
    stamp = source.stat()
    text = source.read_text()
    changed = text.replace("return force - w_f * gamma2 * x", "return force + w_f * gamma2 * x")
    assert changed != text
    source.write_text(changed)
    os.utime(source, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    third = probe(folder, cache)
    assert third[1] == 1
    assert third[0] != first[0]


def test_the_package_brings_what_numba_makes_of_these_sources():
    with zipfile.ZipFile(building.PACKED) as file:
        about = json.loads(file.read(building.ABOUT))
    assert about["sources"] == native.source_hash(), "the kernels have changed: run make bitcode"
    assert set(about["symbols"]) == {f"{kernel.module}.{kernel.name}" for kernel in calls.KERNELS}


@pytest.mark.skipif(not building.OWN_PASSES, reason="an older LLVM")
@pytest.mark.skipif(platform.machine() != "x86_64" or sys.platform != "linux", reason="for another processor")
def test_the_compiler_does_without_numba(tmp_path):
    """Its front end is four fifths of the work, and the same on every processor of a kind."""
    code = (
        "import sys; sys.modules['numba'] = None; from towatlas.kernels import building, calls, native"
        "; print([len(building.object_code(kernel, native.features())) > 5000 for kernel in calls.KERNELS])"
    )
    assert run(code, tmp_path)[0].split("[")[1].count("True") == len(calls.KERNELS)


@pytest.mark.parametrize("spoil", [Path.unlink, lambda path: path.write_bytes(path.read_bytes()[:100_000])])
def test_without_what_the_package_brings_numba_does_it(tmp_path, spoil):
    """To the same bits."""
    code = SHOT.rstrip() + "; x = np.linspace(0.5, 2.0, 9); out = [np.empty(9) for _ in range(3)]"
    code += "; forward_shots(x, x, x, -x, 20, *out, 0, 9); print([[v.hex() for v in row.tolist()] for row in out])"
    whole, bare = tmp_path / "whole", tmp_path / "bare"
    copied(whole)
    spoil(copied(bare) / "bitcode.zip")
    found = [
        run(f"import sys; sys.path.insert(0, {str(folder)!r})" + code, tmp_path / f"cache{k}")[0]
        for k, folder in enumerate((whole, bare))
    ]
    assert found[0] == found[1]
    assert found[0].split()[1:3] == ["1", "False"]


def test_the_process_that_asks_does_without_numba(tmp_path):
    first, second = (run(SHOT, tmp_path)[0].split() for _ in range(2))
    assert first[1:] == ["1", "False"]
    assert second == [first[0], "0", "False"]


def test_machine_code_is_what_python_says():
    """Bit for bit, but for multiplications and additions that the compiler fuses."""
    code = "import numpy as np; from towatlas.kernels.calls import forward_shots as f" + (
        "; x = np.linspace(0.5, 2.0, 9); out = [np.empty(9) for _ in range(3)]; f(x, x, x, -x, 20, *out, 0, 9)"
        "; print(np.stack(out).tolist())"
    )
    cache = os.environ.get("NUMBA_CACHE_DIR", Path.home() / ".cache")
    ours, plain = (np.array(eval(run(code, cache, NUMBA_DISABLE_JIT=off)[0])) for off in ("0", "1"))
    np.testing.assert_allclose(ours, plain, rtol=1e-12, atol=1e-12)


def test_without_a_writable_cache(tmp_path):
    """Kernels compile and run, only each time anew, where nothing can be written."""
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    assert [run(SHOT, blocked)[0].split()[1] for _ in range(2)] == ["1", "1"]


def cut(content):
    return content[: len(content) // 2]


def flip(content):
    return content[:-200] + bytes([content[-200] ^ 1]) + content[-199:]


def sealed(payload):
    return hashlib.sha256(payload).digest() + payload


@pytest.mark.parametrize(
    "damage",
    [cut, flip, lambda _: b"", lambda _: b"x" * 100, lambda _: sealed(b"garbage!"), lambda _: sealed(b"")],
    ids=["cut", "flipped", "empty", "junk", "sealed junk", "sealed nothing"],
)
def test_damaged_code_is_made_again(tmp_path, damage):
    """One line says so, once; the answer is that of the whole kernel, and the next process finds one."""
    value, _, _ = run(SHOT, tmp_path)[0].split()
    (file,) = tmp_path.rglob("scan.forward_shots.o")
    file.write_bytes(damage(file.read_bytes()))
    out, err = run(SHOT, tmp_path)
    assert out.split() == [value, "1", "False"]
    assert err.startswith("towatlas: ")
    assert "is damaged" in err
    assert err.count("\n") == 1
    assert run(SHOT, tmp_path) == (f"{value} 0 False\n", "")


def test_code_of_another_kernel_is_not_run(tmp_path):
    value, _, _ = run(SHOT, tmp_path)[0].split()
    (file,) = tmp_path.rglob("scan.forward_shots.o")
    whole = file.read_bytes()[native.DIGEST_BYTES :]
    other = whole.replace(b"towatlas_forward_shots", b"towatlas_something_els")
    file.write_bytes(native.digest(other) + other)
    assert run(SHOT, tmp_path)[0].split() == [value, "1", "False"]


def test_an_answer_is_not_lost_for_want_of_a_place_to_keep_its_kernel(tmp_path):
    limited = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n" + SHOT
    out, err = run(limited, tmp_path)
    assert out.split()[1] == "1"
    assert err == ""
    assert not list(tmp_path.rglob("*forward_shots*"))


def test_a_folder_in_the_place_of_a_file_and_a_dangling_link(tmp_path):
    value, _, _ = run(SHOT, tmp_path)[0].split()
    (tmp_path / "towatlas" / "link").symlink_to(tmp_path / "nowhere")
    (file,) = tmp_path.rglob("scan.forward_shots.o")
    file.unlink()
    file.mkdir()
    assert run(SHOT, tmp_path)[0].split() == [value, "1", "False"]
    assert run(SHOT, tmp_path) == (f"{value} 0 False\n", "")


@pytest.mark.parametrize(
    "wrong",
    [np.ones(2, np.float32), np.ones((2, 1)), np.ones(4)[::2], np.ones(2, np.int64)],
    ids=["half as wide", "a dimension more", "every second", "whole numbers"],
)
def test_arrays_of_another_layout_are_refused(wrong):
    one, out = np.ones(2), [np.empty(2) for _ in range(3)]
    with pytest.raises(TypeError, match="a C-contiguous array of 1 dimensions of float64 is needed"):
        calls.forward_shots(one, one, wrong, one, 10, *out, 0, 1)
    with pytest.raises(ValueError, match="zip"):
        calls.forward_shots(one, one, one, one, 10, *out, 0)


def test_memory_that_is_not_there_is_said(tmp_path):
    """A kernel that cannot have its arrays says so; nothing else is an error of one."""
    code = """
import resource
import numpy as np
import towatlas
from towatlas.kernels.calls import Cables, Folds, solve_folds
towatlas.solve_critical(10.0, 1.0)
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
rows = 2**21
lam, n = np.full(rows, 10.0), np.ones(rows, np.int64)
folds = Folds(np.zeros(rows), np.zeros(rows), np.full((rows, 4), np.nan), np.empty((rows, 4)), np.empty(rows), n.copy())
limit = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize() + 2**24
resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
try:
    solve_folds(Cables(lam, lam, n, lam), folds, 10**6, 0, rows)
except MemoryError as error:
    print(error)
"""
    cache = os.environ.get("NUMBA_CACHE_DIR", Path.home() / ".cache")
    assert run(code, cache)[0] == "no memory for solve_folds\n"


def test_a_compiler_that_fails_is_quoted(tmp_path):
    """What it said is in the error, and the shell has no traceback for it."""
    folder = tmp_path / "sources"
    kernels = copied(folder)
    with (kernels / "scan.py").open("a") as file:
        file.write("\nraise ImportError('no such luck')\n")
    code = f"import sys; sys.path.insert(0, {str(folder)!r})" + SHOT
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert "CompilerError: kernels could not be compiled" in done.stderr
    assert "no such luck" in done.stderr


def test_a_signal_and_a_fork_within_a_sweep():
    """A handler that sweeps itself, wherever it finds another sweep, and a child of the process, go on."""
    code = """
import os, signal, threading, time
import numpy as np, towatlas
speeds = lambda: towatlas.solve_critical(np.geomspace(5.0, 50.0, 600), 1.0).gamma
alone, answers = speeds(), []
signal.signal(signal.SIGUSR1, lambda *_: answers.append(speeds()))
def kill():
    for k in range(200):
        time.sleep(0.0101 + 0.0007 * (k % 7))
        os.kill(os.getpid(), signal.SIGUSR1)
# Often, for the locks that a handler must not wait for are held for a moment.
thread = threading.Thread(target=kill)
thread.start()
while thread.is_alive():
    speeds()
child = os.fork()
if child == 0:
    os._exit(0 if np.array_equal(speeds(), alone) else 1)
print(os.waitpid(child, 0)[1], len(answers) > 50, all(np.array_equal(one, alone) for one in answers))
"""
    cache = os.environ.get("NUMBA_CACHE_DIR", Path.home() / ".cache")
    assert run(code, cache, PYTHONWARNINGS="ignore")[0].split() == ["0", "True", "True"]


def test_threads_at_the_same_time():
    code = """
from concurrent.futures import ThreadPoolExecutor
import numpy as np, towatlas
lam = np.geomspace(5.0, 50.0, 2000)
alone = towatlas.solve_critical(lam, 1.0).gamma
with ThreadPoolExecutor(4) as pool:
    together = list(pool.map(lambda _: towatlas.solve_critical(lam, 1.0).gamma, range(12)))
print(all(np.array_equal(one, alone) for one in together))
"""
    cache = os.environ.get("NUMBA_CACHE_DIR", Path.home() / ".cache")
    assert run(code, cache)[0].split() == ["True"]


def test_stale_caches_are_deleted(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    old, young = tmp_path / "towatlas" / "old", tmp_path / "towatlas" / "young"
    old.mkdir(parents=True)
    young.mkdir()
    os.utime(old, (0, 0))
    native.folder.cache_clear()
    try:
        assert native.folder() is not None
    finally:
        native.folder.cache_clear()
    assert young.exists()
    assert not old.exists()


def test_warming_up_compiles_what_is_missing_and_says_so(tmp_path):
    """All kernels are in the groups; what is there is left alone."""
    assert {kernel.name for kernel in calls.KERNELS} == {
        name for name, value in vars(calls).items() if isinstance(value, native.Kernel)
    }
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    home = native.folder()
    assert home is not None
    for kernel in calls.KERNELS:
        if kernel.path.exists() and kernel.name not in ("seed_folds", "forward_shots"):
            target = tmp_path / "towatlas" / home.name / kernel.path.name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(kernel.path, target)
    before = set(tmp_path.rglob("*.o"))
    done = subprocess.run(
        [sys.executable, "-m", "towatlas", "warmup"], env=environment, capture_output=True, text=True, check=True
    )
    assert f"{len(calls.KERNELS)} kernels are compiled" in done.stderr
    assert {path.name for path in tmp_path.rglob("*.o")} == {kernel.path.name for kernel in calls.KERNELS}
    assert before < set(tmp_path.rglob("*.o"))


def test_what_the_folder_and_the_site_hold_is_none_of_the_compilers_business(tmp_path):
    """A module of a standard name where the user happens to be, and a line printed before anything else."""
    here, site = tmp_path / "here", tmp_path / "site"
    here.mkdir()
    site.mkdir()
    (here / "json.py").write_text("raise SystemExit('not this one')\n")
    (site / "sitecustomize.py").write_text("print('hello')\n")
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "PYTHONPATH": str(site)}
    code = f"import sys; sys.path[0] = {str(Path(native.__file__).parents[1])!r}\n" + SHOT
    command = [sys.executable, "-c", code]
    found = subprocess.run(command, env=environment, cwd=here, capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert found.stdout.split()[:1] == ["hello"]


def test_compiled_code_followed_by_nothing_else_is_refused(monkeypatch):
    done = subprocess.CompletedProcess([], 0, b"something else", b"")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: done)
    with pytest.raises(notice.CompilerError, match="something else wrote"):
        native.build([calls.march])


@pytest.mark.parametrize(
    "about", [None, [], {"llvm": "20"}, {"symbols": None}, {"symbols": {"scan.forward_shots": "x"}}]
)
def test_an_unfit_table_of_what_is_packed_is_not_used(tmp_path, monkeypatch, about):
    with zipfile.ZipFile(building.PACKED) as file:
        told, code = json.loads(file.read(building.ABOUT)), file.read("scan.forward_shots")
    with zipfile.ZipFile(tmp_path / "bitcode.zip", "w") as file:
        file.writestr(building.ABOUT, json.dumps(told | about if isinstance(about, dict) else about))
        file.writestr("scan.forward_shots", code)
    monkeypatch.setattr(building, "PACKED", tmp_path / "bitcode.zip")
    assert building.packed(calls.forward_shots) is None
