"""What a user waits for the first time: compilation of each kernel, the first answer, the same answer later."""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

# In the order a process may call them, each after what it shares with those before. Small inputs: the time is that of
# compiling, or of loading what was compiled.
SCRIPT = """
import json, time
begin = time.perf_counter()
import numpy as np
import towatlas
times = {"import towatlas": time.perf_counter() - begin}

def timed(name, call):
    start = time.perf_counter()
    call()
    times[name] = time.perf_counter() - start

timed("first critical speed (solve_folds)", lambda: towatlas.solve_critical(10.0, 1.0))
timed("the same again", lambda: towatlas.solve_critical(10.0, 1.0))
timed("first curve (seed_folds)", lambda: towatlas.solve_critical(np.geomspace(8, 50, 100), 1.0))
timed("first table (solve_folds, on all threads)", lambda: towatlas.solve_critical(np.geomspace(8, 50, 300), 1.0))
from towatlas.kernels.calls import forward_shots, scan_system
one, out = np.ones(1), [np.empty(1) for _ in range(3)]
timed("forward_shots", lambda: forward_shots(one, one, one, one, 10, *out, 0, 1))
timed("first equilibria of a cable", lambda: towatlas.equilibria(37.8, 1352, gamma=5.94))
found = np.empty((1, 4)), np.empty(1, np.int64)
timed("scan_system", lambda: scan_system(10.0, 1.0, 0.3, 0.9, 8, 64, 10, 1, 1e-3, *found))
print(json.dumps(times))
"""


def measure() -> list[tuple[str, float, float]]:
    """(what, seconds with an empty cache, seconds with a full one), each in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": folder}
        runs = []
        for _ in range(2):
            done = subprocess.run(
                [sys.executable, "-c", SCRIPT], env=environment, capture_output=True, text=True, check=True
            )
            runs.append(json.loads(done.stdout))
    return [(name, runs[0][name], runs[1][name]) for name in runs[0]]


BUILD = """
import resource, sys
from pathlib import Path
from towatlas.builders.critical import build_atlas
summary = build_atlas(Path(sys.argv[1]), progress=False)
print(summary.seconds, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def build() -> tuple[float, float]:
    """Seconds and peak resident memory [MiB] of the default build, in a process of its own that compiles nothing."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", BUILD, str(Path(folder) / "atlas.nc")]
        # The first compiles what is not compiled, which takes more memory than the build.
        _, done = [subprocess.run(command, capture_output=True, text=True, check=True) for _ in range(2)]
    spent, kilobytes = done.stdout.split()
    return float(spent), float(kilobytes) / 1024.0
