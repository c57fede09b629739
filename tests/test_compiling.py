"""The cache of compiled kernels: used, and never stale."""

import hashlib
import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from towatlas.kernels import compiling

PROBE = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
from towatlas.kernels.calls import forward_shots
assert forward_shots.py_func.__code__.co_filename.startswith({folder!r})
out = [np.empty(1) for _ in range(3)]
one = np.ones(1)
forward_shots(one, one, one, one, 10, *out, 0, 1)
stats = forward_shots.stats
print(repr(float(out[0][0])), sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


KERNELS = Path(compiling.__file__).parent


def copied(folder):
    """The kernels under `folder`, as a package of the name they are installed under."""
    package = folder / "towatlas"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    shutil.copytree(KERNELS, package / "kernels", ignore=shutil.ignore_patterns("__pycache__"))
    return package / "kernels"


def probe(folder, cache):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    code = PROBE.format(folder=str(folder))
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True, cwd=folder
    )
    value, hits, misses = done.stdout.split()
    return float(value), int(hits), int(misses)


@pytest.mark.slow
def test_cache_serves_no_old_kernel(tmp_path):
    """Change the equation in one file: the kernel in another, which is cached, must follow.

    The file keeps its size and its time stamp, which is all that numba itself looks at.
    """
    folder, cache = tmp_path / "sources", tmp_path / "cache"
    kernels = copied(folder)
    first = probe(folder, cache)
    second = probe(folder, cache)
    assert first[1:] == (0, 1)
    assert second == (first[0], 1, 0)

    source = kernels / "vacuum.py"
    stamp = source.stat()
    text = source.read_text()
    changed = text.replace("return force - w_f * gamma2 * x", "return force + w_f * gamma2 * x")
    assert changed != text
    source.write_text(changed)
    os.utime(source, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    third = probe(folder, cache)
    assert third[1:] == (0, 1)
    assert third[0] != first[0]


def test_without_a_writable_cache(tmp_path):
    """Kernels compile and run, only slower, where nothing can be written."""
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    copied(tmp_path / "sources")
    value, hits, _ = probe(tmp_path / "sources", blocked)
    assert hits == 0
    assert value == value


def run(code, cache, **environment):
    """Run Python in a process of its own; its output, and what it said on stderr."""
    everything = os.environ | {"NUMBA_CACHE_DIR": str(cache)} | environment
    done = subprocess.run([sys.executable, "-c", code], env=everything, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


SHOT = """
import numpy as np
from towatlas.kernels.calls import forward_shots
one, out = np.ones(1), [np.empty(1) for _ in range(3)]
forward_shots(one, one, one, one, 10, *out, 0, 1)
print(repr(out[0][0]), sum(forward_shots.stats.cache_hits.values()))
"""


def cut(content):
    return content[: len(content) // 2]


def flip(content):
    return content[:-200] + bytes([content[-200] ^ 1]) + content[-199:]


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize(
    "damage",
    [
        cut,
        pytest.param(flip, marks=pytest.mark.slow),
        pytest.param(lambda content: b"", marks=pytest.mark.slow),
        pytest.param(lambda content: b"x" * 100, marks=pytest.mark.slow),
    ],
    ids=["cut", "flipped", "empty", "junk"],
)
def test_damaged_cache_is_made_again(tmp_path, ending, damage):
    """One line says so, once; the answer is that of the whole kernel, and the next process finds one."""
    value, hits = run(SHOT, tmp_path)[0].split()
    assert hits == "0"
    (file,) = tmp_path.rglob(f"scan.forward_shots-*.{ending}")
    file.write_bytes(damage(file.read_bytes()))
    out, err = run(SHOT, tmp_path)
    assert out.split() == [value, "0"]
    assert err.startswith("towatlas: ")
    assert "is damaged" in err
    assert err.count("\n") == 1
    assert run(SHOT, tmp_path) == (f"{value} 1\n", "")


def sealed(payload):
    return hashlib.sha256(payload).digest() + payload


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("payload", [b"garbage!", pickle.dumps(5)], ids=["garbage", "a number"])
def test_whole_files_of_something_else_are_thrown_away(tmp_path, ending, payload):
    value, _ = run(SHOT, tmp_path)[0].split()
    (file,) = tmp_path.rglob(f"scan.forward_shots-*.{ending}")
    file.write_bytes(sealed(payload))
    out, err = run(SHOT, tmp_path)
    assert out.split() == [value, "0"]
    assert "is damaged" in err
    assert run(SHOT, tmp_path) == (f"{value} 1\n", "")


def test_an_answer_is_not_lost_for_want_of_a_place_to_keep_its_kernel(tmp_path):
    limited = "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))\n" + SHOT
    out, err = run(limited, tmp_path)
    assert out.split()[1] == "0"
    assert err == ""


def test_a_folder_in_the_place_of_a_file_and_a_dangling_link(tmp_path):
    value, _ = run(SHOT, tmp_path)[0].split()
    (tmp_path / "towatlas" / "link").symlink_to(tmp_path / "nowhere")
    (file,) = tmp_path.rglob("scan.forward_shots-*.nbi")
    file.unlink()
    file.mkdir()
    assert run(SHOT, tmp_path)[0].split() == [value, "0"]
    assert run(SHOT, tmp_path) == (f"{value} 1\n", "")


def test_a_signal_and_a_fork_within_a_parallel_kernel():
    """A handler that calls one itself, on the way out of another, and a child of a process that was in one, go on."""
    code = """
import os, signal, threading
import numpy as np, towatlas
from towatlas.kernels import compiling
speeds = lambda: towatlas.solve_critical(np.geomspace(5.0, 50.0, 600), 1.0).gamma
alone, answers = speeds(), []
signal.signal(signal.SIGUSR1, lambda *_: answers.append(speeds()))
with compiling._one_at_a_time:
    os.kill(os.getpid(), signal.SIGUSR1)
    held = compiling._one_at_a_time
    child = os.fork()
    if child == 0:
        os._exit(0 if compiling._one_at_a_time is not held else 1)
print(os.waitpid(child, 0)[1], np.array_equal(answers[0], alone))
"""
    cache = os.environ.get("NUMBA_CACHE_DIR", Path.home() / ".cache")
    assert run(code, cache)[0].split() == ["0", "True"]


def test_threads_share_the_layer_that_allows_no_two_at_once():
    """numba's workqueue aborts the process when two threads call parallel kernels at the same time."""
    code = """
from concurrent.futures import ThreadPoolExecutor
import numpy as np, towatlas
lam = np.geomspace(5.0, 50.0, 2000)
alone = towatlas.solve_critical(lam, 1.0).gamma
with ThreadPoolExecutor(4) as pool:
    together = list(pool.map(lambda _: towatlas.solve_critical(lam, 1.0).gamma, range(12)))
print(all(np.array_equal(one, alone) for one in together))
import numba
print(numba.threading_layer())
"""
    cache = os.environ.get("NUMBA_CACHE_DIR", Path.home() / ".cache")
    assert run(code, cache, NUMBA_THREADING_LAYER="workqueue")[0].split() == ["True", "workqueue"]


def test_listener_hears_of_what_is_compiled_and_not_of_what_is_found(tmp_path):
    code = "from towatlas.kernels import notice; heard = []; notice.listen(heard.append)" + SHOT + "print(heard)"
    first, second = (run(code, tmp_path)[0].splitlines()[1] for _ in range(2))
    assert first == "['forward_shots']"
    assert second == "[]"


def test_stale_caches_are_deleted(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    old, young = tmp_path / "towatlas" / "old", tmp_path / "towatlas" / "young"
    old.mkdir(parents=True)
    young.mkdir()
    os.utime(old, (0, 0))
    assert compiling._usable_cache() is not None
    assert young.exists()
    assert not old.exists()
