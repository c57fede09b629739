"""What the documentation shows runs, and shows the truth."""

import importlib
import json
import math
import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import towatlas
from benchmarks.links import complaints
from benchmarks.notebooks import NOTEBOOKS, run
from towatlas.cli import COMMANDS, _parser

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
NAMES = [str(path.relative_to(ROOT)) for path in PAGES]

RUNNERS = {
    "python": [sys.executable],
    "sh": ["bash", "-euo", "pipefail"],
    "octave": ["octave-cli", "--norc", "--quiet"],
    "r": ["Rscript", "--vanilla"],
}
# How to see that a program has what the pages use of it.
NEEDS = {"octave": ["octave-cli", "--eval", "pkg load netcdf"], "r": ["Rscript", "-e", "library(ncdf4)"]}
# Shown only: files, answers, what Sphinx reads, and code of programs or tables that are not here.
SHOWN = {"", "toml", "text", "{toctree}", "py", "julia"}
FENCE = re.compile(r"^```(\S*)\n(.*?)^```$", re.S | re.M)


def blocks_of(page):
    """The fenced blocks of a page: language, text, and the answer shown below, empty where there is none."""
    blocks = []
    for language, text in FENCE.findall((ROOT / page).read_text()):
        if language == "text" and blocks:
            blocks[-1] = (*blocks[-1][:2], text)
        else:
            blocks.append((language, text, ""))
    return blocks


TO_RUN = [
    (page, languages)
    for page in NAMES
    for languages in (("python", "sh"), ("octave",), ("r",))
    if any(language in languages for language, _, _ in blocks_of(page))
]


def alike(shown, said):
    """Whether lines are the same but for rounding: digits beyond the sixth, and errors, whose sizes are rounding."""
    if len(shown.split()) != len(said.split()):
        return False
    for one, other in zip(shown.split(), said.split(), strict=True):
        try:
            if not math.isclose(float(one), float(other), rel_tol=1e-6, abs_tol=1e-8):
                return False
        except ValueError:
            if one != other:
                return False
    return True


def check_says(shown, said):
    """Every line that a page shows was said, in that order."""
    lines = iter(said.splitlines())
    for line in filter(str.strip, shown.splitlines()):
        assert any(alike(line, one) for one in lines), f"{line!r} is not in\n{said}"


@pytest.fixture
def folder(tmp_path, monkeypatch, atlas_path, equilibria_path):
    """A working folder with the files that pages speak of, and `towatlas` as a command."""
    (tmp_path / "build").mkdir()
    (tmp_path / "build" / "atlas.nc").symlink_to(atlas_path)
    (tmp_path / "build" / "equilibria.nc").symlink_to(equilibria_path)
    for page in NAMES:
        for language, text, _ in blocks_of(page):
            if language == "toml" and (name := re.match(r"# (\S+\.toml)\n", text)):
                (tmp_path / name[1]).write_text(text)
    command = tmp_path / "bin" / "towatlas"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m towatlas "$@"\n')
    command.chmod(0o755)
    monkeypatch.setenv("PATH", f"{command.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("TOWATLAS_FILE", str(atlas_path))
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(("page", "languages"), TO_RUN)
def test_blocks_of_a_page_run(page, languages, folder):
    for language, text, shown in blocks_of(page):
        if language not in languages:
            continue
        if need := NEEDS.get(language):
            if not shutil.which(need[0]):
                pytest.skip(f"no {need[0]}")
            if subprocess.run(need, capture_output=True, timeout=60).returncode:
                pytest.skip(f"{need[0]} has no NetCDF")
        (folder / "block").write_text(text)
        command = [*RUNNERS[language], "block"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stdout + done.stderr
        if language == "python":
            assert done.stderr == ""
        check_says(shown, done.stdout)


def test_a_page_that_shows_other_numbers_is_found_out():
    check_says("a 1.25\nb 1.9e-11\n", "x\na 1.2500001\nb 2.3e-12\n")
    for said in ("a 1.26\nb 0\n", "b 0\na 1.25\n", "a 1.25 2\nb 0\n", "a 1.25\n"):
        with pytest.raises(AssertionError, match="is not in"):
            check_says("a 1.25\nb 1.9e-11\n", said)


@pytest.mark.parametrize("page", NAMES)
def test_every_block_is_run_or_known_not_to_be(page):
    assert {language for language, _, _ in blocks_of(page)} <= set(RUNNERS) | SHOWN


@pytest.mark.parametrize("page", NAMES)
def test_commands_of_a_page_parse(page):
    """Those that are shown and not run: names and options are there."""
    for line in re.findall(r"^    towatlas (.*)$", FENCE.sub("", (ROOT / page).read_text()), re.M):
        words = shlex.split(line, comments=True)
        _parser(words[:1]).parse_args(words)


@pytest.mark.parametrize("page", NAMES)
def test_links_of_a_page_lead_to_files(page):
    """As they are read in the repository; places in them are looked for when the site is built."""
    for target in re.findall(r"\]\((?!https?:|#)([^)#]+)", (ROOT / page).read_text()):
        assert (ROOT / page).parent.joinpath(target).is_file(), target


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_and_says_what_it_shows(path, atlas_path, monkeypatch):
    monkeypatch.setenv("TOWATLAS_FILE", str(atlas_path))
    notebook = json.loads(path.read_text())
    shown = [cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"]
    said = run(notebook)
    assert [[one["output_type"] for one in cell] for cell in shown] == [
        [one["output_type"] for one in cell] for cell in said
    ]
    for cell, other in zip(shown, said, strict=True):
        for one, same in zip(cell, other, strict=True):
            check_says("".join(one.get("text", "")), "".join(same.get("text", "")))


def test_every_public_name_is_in_the_api():
    text = "".join(path.read_text() for path in (ROOT / "docs" / "api").glob("*.rst"))
    listed = re.findall(r"^\.\. auto(?:function|class):: (\w+)$", text, re.M)
    assert sorted(listed) == sorted([*towatlas.__all__, *towatlas.device.__all__])


def test_a_site_with_a_link_that_leads_nowhere_is_found_out(tmp_path):
    (tmp_path / "other.html").write_text('<h1 id="here"><a href="index.html">back</a></h1>')
    (tmp_path / "index.html").write_text('<a href="other.html#here"></a><a href="https://x.org"></a><img src="data:,">')
    assert complaints(tmp_path) == []
    (tmp_path / "index.html").write_text(
        '<a href="none.html"></a><a href="other.html#there"></a><script src="https://x.org/a.js"></script>'
        '<link href="//x.org/a.css">'
    )
    (tmp_path / "a.css").write_text("@font-face { src: url('https://x.org/font') }")
    assert complaints(tmp_path) == [
        "index.html: loads https://x.org/a.js",
        "index.html: loads //x.org/a.css",
        "index.html: no file none.html",
        "index.html: no place other.html#there",
        "a.css: loads something",
    ]


@pytest.mark.parametrize("page", NAMES)
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
