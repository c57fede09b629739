"""The command line: output, exit codes, messages."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from helpers import run

import towatlas


@pytest.fixture
def critical(capsys, atlas_path):
    return lambda *arguments: run(capsys, "critical", "--atlas", atlas_path, *arguments)


def test_json(critical):
    code, out, err = critical("--lam", 37.8, "--wf", 1352, "--n", 2, "--json")
    (row,) = json.loads(out)
    assert list(row) == ["schema_version", "n", "lam", "w_f", "gamma", "R_x0", "x_f", "error", "status"]
    assert (row["n"], row["lam"], row["w_f"], row["status"]) == (2, 37.8, 1352, "computed")
    exact = towatlas.solve_critical(37.8, 1352, 2)
    for name in ("gamma", "R_x0", "x_f"):
        assert row[name] == pytest.approx(float(getattr(exact, name)), rel=1e-9)
    assert (code, err) == (0, "")


def test_every_transition_that_exists(critical):
    code, out, err = critical("--lam", 7.5, "--wf", 0, "--json")
    assert [row["n"] for row in json.loads(out)] == [1, 2, 3]
    assert (code, err) == (0, "")
    code, out, err = critical("--lam", 37.8, "--wf", 1352, "--json")
    assert [row["n"] for row in json.loads(out)] == [1, 2, 3, 4, 5, 6]
    assert "has 19 transitions; the first 6 follow" in err
    code, out, err = critical("--lam", 37.8, "--wf", 1352, "--json", "--solve")
    assert [row["n"] for row in json.loads(out)] == list(range(1, 20))
    assert code == 0
    assert "--atlas is left alone" in err


def test_table_for_people(critical):
    _, out, _ = critical("--lam", 10, "--wf", 0)
    assert out.splitlines()[0].split() == ["n", "gamma", "R_x0", "x_f", "error", "status"]
    assert out.splitlines()[1].split()[:2] == ["1", "0.4928896763325"]


def test_solve_needs_no_atlas_and_has_no_last_n(capsys):
    code, out, err = run(
        capsys, "critical", "--lam", 100, "--wf", 1, "--n", 40, "--solve", "--json", "--atlas", "absent.nc"
    )
    assert code == 0
    assert "--atlas is left alone" in err
    assert json.loads(out)[0]["gamma"] == pytest.approx(float(towatlas.solve_critical(100, 1, 40).gamma), rel=1e-14)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("--lam", "nan", "--wf", "0"), 2, "'nan' is not finite"),
        (("--lam", "inf", "--wf", "0"), 2, "'inf' is not finite"),
        (("--lam", "0", "--wf", "0"), 2, "not positive"),
        (("--lam=-1", "--wf", "0"), 2, "not positive"),
        (("--lam", "3", "--wf=-1"), 2, "negative"),
        (("--lam", "three", "--wf", "0"), 2, "not a number"),
        (("--lam", "1+2j", "--wf", "0"), 2, "not a number"),
        (("--lam", "3", "--wf", "0", "--n", "0"), 2, "counted from 1"),
        (("--lam", "3", "--wf", "0", "--n", "1.5"), 2, "not a whole number"),
        (("--lam", "3"), 2, "required: --wf"),
        (("--lam", "2.0001", "--wf", "0"), 3, "it holds lam from 2.001 to 1002"),
        (("--lam", "5000", "--wf", "0"), 3, "outside the atlas"),
        (("--lam", "50", "--wf", "0", "--n", "7"), 3, "n = 7 is outside the atlas, 1 to 6"),
        (("--lam", "50", "--wf", "1e5", "--n", "1"), 3, "w_f = 100000 is outside"),
        (("--lam", "1.5", "--wf", "0"), 4, "lambda = 1.5 is not longer than lambda_c1 = 2"),
        (("--lam", "3", "--wf", "0", "--n", "2"), 4, "no transition n = 2"),
        (("--lam", "3", "--wf", "0", "--n", "2", "--solve"), 4, "no transition n = 2"),
    ],
)
def test_exit_codes(critical, arguments, code, message):
    got, _, err = critical(*arguments)
    assert got == code
    assert message in err


def test_part_of_the_answer_is_outside(critical):
    code, out, err = critical("--lam", 4.0000001, "--wf", 0, "--json")
    rows = json.loads(out)
    assert [row["status"] for row in rows] == ["computed", "outside_atlas"]
    assert rows[1]["gamma"] is None
    assert code == 0
    assert "--solve" in err


def test_files_that_cannot_be_read(capsys, tmp_path, atlas_path):
    for arguments in (
        ("critical", "--lam", 3, "--wf", 0, "--atlas"),
        ("info",),
        ("plot", "critical", "--out", tmp_path / "f.png", "--atlas"),
        ("scene", "skop-fig3", "--model", "vacuum", "--atlas"),
    ):
        code, out, err = run(capsys, *arguments, tmp_path / "absent.nc")
        assert (code, out) == (5, "")
        assert "no file at" in err
        damaged = tmp_path / "damaged.nc"
        damaged.write_bytes(atlas_path.read_bytes()[:-1000])
        code, out, err = run(capsys, *arguments, damaged)
        assert (code, out) == (5, "")
        assert "damaged" in err


def test_environment_names_the_atlas(atlas_path, tmp_path):
    command = [sys.executable, "-m", "towatlas", "critical", "--lam", "10", "--wf", "0"]
    environment = os.environ | {"TOWATLAS_FILE": str(atlas_path)}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "0.4928896763325" in done.stdout


def test_info(capsys, atlas_path):
    code, out, _ = run(capsys, "info", atlas_path)
    assert code == 0
    for words in (
        "1 .. 6",
        "0 .. 10000",
        "worst_lookup_error",
        "towatlas_version",
        "sha256",
    ):
        assert words in out
    assert towatlas.open_atlas(atlas_path).sha256 in out


@pytest.mark.parametrize("ending", ["svg", "png"])
def test_plot(capsys, atlas_path, tmp_path, ending):
    out = tmp_path / "deep" / f"critical.{ending}"
    code, stdout, err = run(capsys, "plot", "critical", "--atlas", atlas_path, "--out", out)
    assert (code, stdout) == (0, "")
    assert str(out) in err
    content = out.read_bytes()
    assert content.startswith(b"\x89PNG" if ending == "png" else b"<?xml")
    run(capsys, "plot", "critical", "--atlas", atlas_path, "--out", out)
    assert out.read_bytes() == content


def test_plot_of_an_unknown_kind(capsys, atlas_path, tmp_path):
    code, _, err = run(capsys, "plot", "critical", "--atlas", atlas_path, "--out", tmp_path / "f.xyz")
    assert code == 2
    assert "ending must be one of" in err
    code, _, err = run(capsys, "plot", "teapot", "--out", tmp_path / "f.png")
    assert code == 2


def test_plotted_curves_are_the_atlas(atlas_file):
    import matplotlib.pyplot as plt

    from towatlas.plot.critical import plot_critical

    curves = plot_critical(atlas_file, w_f=(0.0, 10.0), orders=(1, 2))
    assert len(curves) == 4
    lam, gamma = curves[3].get_data()
    np.testing.assert_allclose(gamma, towatlas.solve_critical(lam, 10.0, 2).gamma, rtol=1e-9)
    assert len({str(curve.get_linestyle()) + str(curve._dash_pattern) for curve in curves[:2]}) == 2
    plt.close("all")
    with pytest.raises(ValueError, match="at most 4 fish weights"):
        plot_critical(atlas_file, w_f=(0, 1, 2, 3, 4))


def test_help_and_version(capsys):
    assert run(capsys, "--version")[1].startswith("towatlas 0.")
    code, out, _ = run(capsys, "--help")
    assert code == 0
    for word in ("critical", "build", "plot", "info", "Exit codes"):
        assert word in out
    assert run(capsys)[0] == 2


def test_installed_command(tmp_path):
    script = os.path.join(os.path.dirname(sys.executable), "towatlas")
    done = subprocess.run([script, "--version"], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout.startswith("towatlas ")


@pytest.mark.slow
def test_compilation_is_announced_once(tmp_path):
    """Who waits for a kernel the first time is told why, on stderr; the second time there is nothing to tell."""
    command = [sys.executable, "-m", "towatlas", "critical", "--solve", "--lam", "10", "--wf", "0", "--n", "1"]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    first, second = (subprocess.run(command, env=environment, capture_output=True, text=True) for _ in range(2))
    assert first.stdout == second.stdout
    assert "compiling, once" in first.stderr
    assert second.stderr == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ("critical", "--lam", 10, "--wf", 0),
        ("critical", "--lam", 10, "--wf", 0, "--n", 1, "--C", 0.01, "--solve"),
        ("equilibria", "--lam", 10, "--wf", 0, "--gamma", 1),
        ("equilibria", "--lam", 10, "--wf", 0, "--gamma", 1, "--C", 0.01),
        ("fish", "--lam", 5, "--wf", 1, "--gamma", 0.5),
        ("scene", "skop-fig3", "--model", "vacuum"),
        ("design", "--scene", "skop-fig3", "--depth", "25in", "--model", "vacuum"),
    ],
    ids=lambda arguments: arguments[0] + (" with drag" if "--C" in arguments else ""),
)
def test_every_object_of_json_says_its_schema(capsys, atlas_path, equilibria_path, arguments):
    from towatlas.commands.common import JSON_SCHEMA

    files = {"fish": ("--table", equilibria_path), "equilibria": (), "design": ()}.get(
        arguments[0], ("--atlas", atlas_path)
    )
    code, out, _ = run(capsys, *arguments, *files, "--json")
    answer = json.loads(out)
    assert code == 0
    for row in answer if isinstance(answer, list) else [answer]:
        assert next(iter(row.items())) == ("schema_version", JSON_SCHEMA)


@pytest.mark.parametrize("given", [None, "2"])
def test_blas_takes_one_thread_where_nothing_else_is_asked_for(given):
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    code = (
        "from towatlas.cli import main; main(['critical', '--lam', '10', '--wf', '1', '--solve'])\n"
        "from threadpoolctl import threadpool_info; print(*(pool['num_threads'] for pool in threadpool_info()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment | ({"OPENBLAS_NUM_THREADS": given} if given else {}),
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.split("\n")[-2] == (given or "1")
