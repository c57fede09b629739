"""What the documentation shows runs, and shows the truth."""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

import towatlas
from towatlas.cli import COMMANDS

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [
        "README.md",
        "docs/equilibria.md",
        "docs/drag.md",
        "docs/scenes.md",
        "docs/device.md",
        "docs/certify.md",
        "docs/maps.md",
    ],
)
def test_python_of_a_page_runs(page, atlas_path, equilibria_path, tmp_path):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.S)
    assert blocks
    (tmp_path / "build").mkdir()
    (tmp_path / "build" / "atlas.nc").symlink_to(atlas_path)
    (tmp_path / "build" / "equilibria.nc").symlink_to(equilibria_path)
    for block in blocks:
        done = subprocess.run([sys.executable, "-c", block], cwd=tmp_path, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("page", [str(path.relative_to(ROOT)) for path in PAGES])
def test_names_in_a_page_exist(page):
    """What a page calls towatlas.this or towatlas.that is there."""
    names = set(re.findall(r"\btowatlas((?:\.[A-Za-z_]\w*)+)", (ROOT / page).read_text()))
    for name in sorted(names):
        value = towatlas
        for part in name.split(".")[1:]:
            if not hasattr(value, part):
                importlib.import_module(f"{value.__name__}.{part}")
            value = getattr(value, part)


def test_the_page_of_checks_is_whole():
    """Every command that prints numbers of its own, and no test that is not there."""
    text = (ROOT / "docs" / "validation.md").read_text()
    column = " ".join(line.split("|")[2] for line in text.splitlines() if line.count("|") == 5)
    named = {words.split()[0] for words in re.findall(r"`([^`]+)`", column)}
    # Files as they are, figures of what the others say, the compiler.
    assert set(COMMANDS) - named == {"info", "plot", "warmup"}
    for file in re.findall(r"`(?:tests/)?(test_\w+\.py)`", text):
        assert (ROOT / "tests" / file).exists(), file


def test_every_target_of_make_is_listed():
    text = (ROOT / "Makefile").read_text()
    listed = subprocess.run(["make", "-C", str(ROOT), "help"], capture_output=True, text=True, check=True).stdout
    for target in re.search(r"\.PHONY: (.*)", text)[1].split():
        assert re.search(rf"^{target}\s", listed, re.M), target
