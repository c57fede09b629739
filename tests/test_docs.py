"""What the documentation shows runs, and shows the truth."""

import doctest
import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent


@pytest.mark.parametrize(
    "module", ["towatlas.solve.critical", "towatlas.solve.equilibria", "towatlas.limits", "towatlas.solve.shapes"]
)
def test_examples_in_docstrings(module):
    result = doctest.testmod(importlib.import_module(module), raise_on_error=False)
    assert result.attempted > 0
    assert result.failed == 0


@pytest.mark.parametrize("page", ["README.md", "docs/equilibria.md"])
def test_python_of_a_page_runs(page, atlas_path, equilibria_path, tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)
    assert len(blocks) >= 2
    (tmp_path / "build").mkdir()
    (tmp_path / "build" / "atlas.nc").symlink_to(atlas_path)
    (tmp_path / "build" / "equilibria.nc").symlink_to(equilibria_path)
    for block in blocks:
        done = subprocess.run([sys.executable, "-c", block], cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


def test_every_target_of_make_is_listed():
    text = (ROOT / "Makefile").read_text()
    listed = subprocess.run(["make", "-C", str(ROOT), "help"], capture_output=True, text=True, check=True).stdout
    for target in re.search(r"\.PHONY: (.*)", text)[1].split():
        assert re.search(rf"^{target}\s", listed, re.M), target
