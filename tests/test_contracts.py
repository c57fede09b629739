"""The contracts of pyproject.toml hold, and each is broken by what it is there to refuse."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.fixture
def copy(tmp_path):
    """The package as it is installed, and its contracts, to be broken."""
    package = tmp_path / "towatlas"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "atlas", package, ignore=ignored)
    shutil.copytree(ROOT / "kernels", package / "kernels", ignore=ignored)
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return package


def verdict(package):
    """Exit code and what import-linter says, blanks folded."""
    linter = Path(sys.executable).with_name("lint-imports")
    if not linter.exists():
        pytest.skip("import-linter is not installed: pip install towatlas[check]")
    done = subprocess.run(
        [linter, "--no-cache"],
        cwd=package.parent,
        env=os.environ | {"PYTHONPATH": str(package.parent)},
        capture_output=True,
        text=True,
    )
    return done.returncode, " ".join((done.stdout + done.stderr).split())


def test_the_package_keeps_them(copy):
    code, said = verdict(copy)
    assert code == 0, said
    assert "7 kept, 0 broken" in said


@pytest.mark.parametrize(
    ("module", "line", "broken"),
    [
        ("solve/stability.py", "import towatlas.commands.info", "towatlas.solve is not allowed to import"),
        ("numerics/rows.py", "import towatlas.solve.jets", "towatlas.numerics is not allowed to import"),
        ("kernels/vacuum.py", "import xarray", "towatlas.kernels is not allowed to import xarray"),
        ("kernels/vacuum.py", "import towatlas.checks", "towatlas.kernels is not allowed to import"),
        ("tables/critical.py", "import numba", "towatlas.tables is not allowed to import numba"),
        ("tables/fish.py", "import towatlas.kernels.lanes", "towatlas.tables is not allowed to import numba"),
        (
            "tables/fish.py",
            "import towatlas.solve.critical",
            "not allowed to import towatlas.kernels.native",
        ),
        ("solve/jets.py", "import numba", "towatlas is not allowed to import numba"),
        ("kernels/lanes.py", "import numba", "towatlas is not allowed to import numba"),
        ("maps/lookup.py", "import dask", "is not allowed to import dask"),
        ("solve/jets.py", "import towatlas.maps.spec", "towatlas.solve is not allowed to import towatlas.maps"),
        ("attic.py", "import math", "towatlas.attic"),
        ("attic/__init__.py", "import math", "towatlas.attic"),
    ],
)
def test_what_they_refuse(copy, module, line, broken):
    file = copy / module
    file.parent.mkdir(exist_ok=True)
    text = file.read_text() if file.exists() else ""
    file.write_text(f"{text}\n{line}\n")
    code, said = verdict(copy)
    assert code != 0
    assert broken in said


def test_tables_solve_within_functions_only():
    """The exception to the contract: what is imported when the module is would bring the compiler along."""
    tree = ast.parse((ROOT / "atlas" / "tables" / "direct.py").read_text())
    at_once = [node.module for node in tree.body if isinstance(node, ast.ImportFrom)]
    later = [node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert not [name for name in at_once if name.startswith("towatlas.solve")]
    assert [name for name in later if name.startswith("towatlas.solve")]
