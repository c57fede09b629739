"""Where files are put and looked for when none is named."""

import subprocess
import sys
from pathlib import Path

import pytest
from helpers import run

import towatlas
from towatlas.tables import file

ROOT = Path(__file__).parent.parent


@pytest.fixture
def outside(tmp_path, monkeypatch):
    """A working folder that is no clone, a home and a data folder; the latter, which does not exist yet."""
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.delenv(file.VARIABLE, raising=False)
    monkeypatch.setattr(file, "SHIPPED", tmp_path / "none.nc")
    return file.data_folder()


def test_a_clone_keeps_its_files_in_build(monkeypatch):
    monkeypatch.delenv(file.VARIABLE, raising=False)
    monkeypatch.chdir(ROOT)
    assert file.data_folder() == Path("build")
    assert file.built_path() == Path("build/atlas.nc")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="other systems have other folders")
def test_outside_the_folder_is_the_users(outside, tmp_path):
    assert outside == tmp_path / "data" / "towatlas"
    assert not outside.exists()


def test_the_first_atlas_there_is_answers(outside, tmp_path, atlas_path, capsys, monkeypatch):
    """That of the variable, then the one built, then the one of the wheel; without any, a sentence."""
    critical = "critical", "--lam", 37.8, "--wf", 1352, "--n", 2
    code, out, err = run(capsys, *critical)
    assert (code, out) == (5, "")
    assert f"no file at {outside / 'atlas.nc'}; `towatlas build` makes an atlas" in err
    shipped, built, named = tmp_path / "shipped.nc", outside / "atlas.nc", tmp_path / "named.nc"
    monkeypatch.setattr(file, "SHIPPED", shipped)
    outside.mkdir(parents=True)
    for path in (shipped, built, named):
        path.symlink_to(atlas_path)
        if path is named:
            monkeypatch.setenv(file.VARIABLE, "~/named.nc")
        assert towatlas.open_atlas().path == path
        code, out, err = run(capsys, *critical)
        assert (code, err) == (0, "")
        assert "3.41756" in out
        assert str(path) in run(capsys, "info")[1]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "TOWATLAS_FILE is empty: unset it, or let it name a file"),
        (" ", "TOWATLAS_FILE is empty"),
        ("~/absent.nc", "absent.nc, where there is no file: unset it, or `towatlas build` puts an atlas there"),
        ("~nobody-of-this-name/a.nc", "TOWATLAS_FILE names ~nobody-of-this-name/a.nc, where there is no file"),
        (".", ". cannot be read: Is a directory"),
    ],
)
@pytest.mark.parametrize("command", ["critical --lam 3 --wf 0", "info", "plot critical --out f.svg"])
def test_a_variable_that_names_no_atlas(outside, capsys, monkeypatch, text, sentence, command):
    monkeypatch.setenv(file.VARIABLE, text)
    code, out, err = run(capsys, *command.split())
    assert (code, out) == (5, "")
    assert sentence in err
    assert run(capsys, "critical", "--help")[0] == 0


@pytest.mark.parametrize(
    ("words", "builder", "name"),
    [
        ("", "critical.build_atlas", "atlas.nc"),
        ("--method scan", "critical.build_atlas", "scan.nc"),
        ("--equilibria", "fish.build_equilibria", "equilibria.nc"),
        ("--drag", "drag_folds.build_drag", "atlas.nc"),
        ("--stability", "stability.build_stability", "atlas.nc"),
    ],
)
def test_build_writes_where_it_is_looked_for(outside, capsys, monkeypatch, words, builder, name):
    monkeypatch.setattr(f"towatlas.builders.{builder}", lambda path, *_, **__: path)
    assert run(capsys, "build", *words.split())[:2] == (0, f"{outside / name}\n")
    monkeypatch.setenv(file.VARIABLE, "~/mine.nc")
    expected = Path.home() / "mine.nc" if name == "atlas.nc" else outside / name
    assert run(capsys, "build", *words.split())[:2] == (0, f"{expected}\n")


def test_fish_looks_where_build_writes(outside, capsys):
    code, _, err = run(capsys, "fish", "--lam", 8, "--wf", 1, "--gamma", 0.9)
    assert code == 5
    assert f"no file at {outside / 'equilibria.nc'}" in err


def test_who_names_a_file_waits_for_no_library(atlas_path):
    code = f"import sys, towatlas; towatlas.open_atlas({str(atlas_path)!r}); assert 'platformdirs' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).stderr == b""
