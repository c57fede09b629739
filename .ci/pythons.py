"""The interpreters of this machine that pyproject promises: a line each, `3.N path`; one that is missing is an error.

Found on PATH as python3.N, or among the versions that pyenv keeps. What is found must run: a name on PATH may be a
stand-in that refuses to. TOWATLAS_PYTHONS="3.11 3.12" asks for those only, on a machine that has no others.
"""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
PROBE = "import sys, ensurepip, venv; print(sys.implementation.name, '%d.%d' % sys.version_info[:2])"


def promised() -> list[str]:
    """Minor versions that the classifiers name, oldest first."""
    return re.findall(r"Python :: (3\.\d+)\"", (ROOT / "pyproject.toml").read_text())


def candidates(version: str) -> Iterator[Path]:
    """Files that may be a Python of this version."""
    for folder in os.get_exec_path():
        yield Path(folder) / f"python{version}"
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    yield from sorted(pyenv.glob(f"versions/{version}.*/bin/python"))


def find(version: str) -> Path | None:
    """The first candidate that runs, is CPython of this version and can make environments."""
    for path in candidates(version):
        if path.is_file():
            done = subprocess.run([path, "-c", PROBE], capture_output=True, text=True)
            if done.stdout.split() == ["cpython", version]:
                return path
    return None


def main() -> int:
    """Print what is found; 1 if something is missing."""
    promise = promised()
    asked = os.environ.get("TOWATLAS_PYTHONS", "").split() or promise
    if strange := set(asked) - set(promise):
        print(
            f"TOWATLAS_PYTHONS names {' '.join(sorted(strange))}; pyproject promises {' '.join(promise)}",
            file=sys.stderr,
        )
        return 1
    found = {version: find(version) for version in promise if version in asked}
    if missing := [version for version, path in found.items() if path is None]:
        print(
            f"pyproject promises Python {' and '.join(missing)}, not found on this machine: install it, or say with "
            "TOWATLAS_PYTHONS which of the promised are to be run.",
            file=sys.stderr,
        )
        return 1
    for version, path in found.items():
        print(version, path)
    return 0


sys.exit(main())
