"""The cache of compiled kernels: used, and never stale."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

from towatlas.kernels import compiling

PROBE = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
from towatlas.kernels.scan import forward_shots
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


def test_both_builds_of_a_loop_are_kept_apart():
    from towatlas.kernels.sweeps import march_parallel, solve_folds_parallel

    names = {march_parallel.py_func.__qualname__, solve_folds_parallel.py_func.__qualname__}
    assert names == {"_march_parallel", "_solve_folds_parallel"}


def test_stale_caches_are_deleted(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    old, young = tmp_path / "towatlas" / "old", tmp_path / "towatlas" / "young"
    old.mkdir(parents=True)
    young.mkdir()
    os.utime(old, (0, 0))
    assert compiling._usable_cache() is not None
    assert young.exists()
    assert not old.exists()
