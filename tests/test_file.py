"""The file: what a stranger reads in it, the seal, the same bytes again, and builds that die half way."""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from helpers import SMALL_GRID, SMALL_SCAN

import towatlas
from towatlas.builders.critical import build_atlas
from towatlas.builders.grids import ScanSettings
from towatlas.kernels import status
from towatlas.tables.seal import AtlasFileError, read_sealed, write_seal


# Seconds rather than minutes: the same pipeline on few nodes.
def small(path, **more):
    return build_atlas(path, grid=SMALL_GRID, scan=SMALL_SCAN, progress=False, **more)


@pytest.fixture(scope="module")
def small_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("small") / "small.nc"
    small(path)
    return path


def test_a_stranger_finds_the_table(atlas_path):
    """With xarray alone: gamma_c on a labelled grid, lambda and w_f as coordinates, missing below the threshold."""
    with xr.open_dataset(atlas_path) as table:
        assert table.gamma_c.dims == ("n", "w_f", "lam")
        assert float(table.gamma_c.sel(n=1, w_f=0, lam=10)) == pytest.approx(0.4928896763325, abs=1e-12)
        assert float(table.gamma_c.sel(n=1, w_f=1, lam=10)) == pytest.approx(0.466173258416, abs=1e-12)
        for name in ("gamma_c", "R_x0_c", "x_f", "z_f", "tension", "error", "lambda_c", "lam", "w_f"):
            assert table[name].attrs["units"] == "1"
            assert table[name].attrs["long_name"]
        below = table.lam <= table.lambda_c
        assert bool((np.isnan(table.gamma_c) == below).all())
        assert set(np.unique(table.status)) == {status.OK, status.NO_TRANSITION}
        assert table.status.attrs["flag_meanings"].split()[status.NO_TRANSITION] == "no_transition"
        np.testing.assert_allclose(
            table.tension, np.hypot(table.w_f + table.lam, table.R_x0_c).transpose(*table.tension.dims), rtol=1e-14
        )
        assert float(table.error.where(table.lam - table.lambda_c >= 1e-3).max()) < 1e-10


def test_witness_agrees_within_its_resolution(atlas_path):
    with xr.open_dataset(atlas_path, group="support/witness") as witness:
        found = witness.status.values == status.OK
        assert found.sum() > 50
        gap = np.abs(witness.difference * witness.gamma_scan / (1 + witness.difference)).values
        assert (gap[found] <= witness.gamma_resolution.values[found]).all()
        assert int(witness.missed.sum()) < 10
        assert np.isnan(witness.gamma_scan.values[~found]).all()


def test_size(atlas_path):
    assert atlas_path.stat().st_size <= 10e6


def test_cf_compliance(atlas_path):
    from shutil import which

    checker = which("compliance-checker", path=os.path.dirname(sys.executable))
    assert checker, "compliance-checker is not installed: pip install towatlas[test]"
    done = subprocess.run([checker, "-t", "cf:1.11", "-c", "strict", str(atlas_path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
    assert "All tests passed" in done.stdout


def test_attributes_are_ascii_and_complete(atlas_path):
    with netCDF4.Dataset(atlas_path) as file:
        texts = {name: str(file.getncattr(name)) for name in file.ncattrs()}
        for name, variable in file.variables.items():
            assert all(str(variable.getncattr(a)).isascii() for a in variable.ncattrs()), name
    assert all(text.isascii() for text in texts.values())
    for name in ("Conventions", "towatlas_version", "kernel_sources_sha256", "command", "history", "solver_tolerance"):
        assert texts[name]


@pytest.mark.slow
def test_same_bytes_again(atlas_path, tmp_path):
    """A second build, in another process with one thread everywhere, is the same file."""
    again = tmp_path / "again.nc"
    command = [sys.executable, "-m", "towatlas", "build", "--out", str(again), "--threads", "1", "--quiet"]
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)
    assert again.read_bytes() == atlas_path.read_bytes()


def test_date_comes_from_the_environment_only(tmp_path, monkeypatch, small_path):
    assert "date_created" not in towatlas.open_atlas(small_path).attributes
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    small(tmp_path / "dated.nc")
    assert towatlas.open_atlas(tmp_path / "dated.nc").attributes["date_created"] == "1970-01-02T00:00:00Z"
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(ValueError, match="SOURCE_DATE_EPOCH must be seconds"):
        small(tmp_path / "dated.nc")


def test_any_flipped_bit_is_noticed(small_path, tmp_path):
    """Every byte of the file once, one bit of it, and all bits of the seal."""
    data = small_path.read_bytes()
    copy = tmp_path / "copy.nc"
    rng = np.random.default_rng(0)
    seal = data.index(b"towatlas-sha256:")
    places = {*range(0, len(data), 97), *range(seal, seal + 80), 0, len(data) - 1}
    for place in places:
        flipped = bytearray(data)
        flipped[place] ^= 1 << int(rng.integers(8))
        copy.write_bytes(flipped)
        with pytest.raises(AtlasFileError):
            read_sealed(copy)


def test_files_that_are_no_atlas(small_path, tmp_path):
    data = small_path.read_bytes()
    plain = tmp_path / "plain.nc"
    xr.Dataset({"a": ("x", [1.0, 2.0])}).to_netcdf(plain, engine="netcdf4")
    cases = {
        b"": "is empty",
        data[: len(data) // 2]: "damaged|no seal",
        data[:100]: "no seal",
        data + b"more": "damaged",
        b"<!DOCTYPE html><html>": "looks like a web page",
        b"CDF\x01": "not a NetCDF-4 file",
        plain.read_bytes(): "no seal",
    }
    path = tmp_path / "file.nc"
    for content, match in cases.items():
        path.write_bytes(content)
        with pytest.raises(AtlasFileError, match=match):
            towatlas.open_atlas(path)
    with pytest.raises(AtlasFileError, match="cannot be read"):
        towatlas.open_atlas(tmp_path)
    with pytest.raises(FileNotFoundError, match="towatlas build"):
        towatlas.open_atlas(tmp_path / "absent.nc")


def _changed(source, path, change):
    """A sealed copy of a file that `change` was let at."""
    shutil.copy(source, path)
    with netCDF4.Dataset(path, "a") as file:
        change(file)
    data = path.read_bytes()
    at = data.index(b"towatlas-sha256:") + 16
    path.write_bytes(data[:at] + b"0" * 64 + data[at + 64 :])
    write_seal(path)
    return path


def test_newer_schema_is_refused(small_path, tmp_path):
    path = _changed(small_path, tmp_path / "newer.nc", lambda file: file.setncattr("schema_version", np.int32(99)))
    with pytest.raises(AtlasFileError, match="schema version 99, this towatlas reads up to 1; upgrade"):
        towatlas.open_atlas(path)


def test_a_file_that_lacks_what_is_read_is_to_be_built_again(small_path, tmp_path):
    path = _changed(small_path, tmp_path / "other.nc", lambda file: file.createGroup("support/drag"))
    with pytest.raises(AtlasFileError, match=r"another version of towatlas.*build it again"):
        towatlas.open_atlas(path)


def test_scan_build_holds_a_plain_table(tmp_path):
    path = tmp_path / "scan.nc"
    scan = ScanSettings(speeds=120, guesses=256, w_f=np.array([0.0, 5.0]), lam=np.array([1.5, 5.0, 12.0]), n_max=3)
    summary = build_atlas(path, "scan", scan=scan, progress=False)
    assert int(dict(summary.facts)["folds"]) > 5
    with xr.open_dataset(path) as table:
        exact = towatlas.solve_critical(table.lam.values, table.w_f.values[:, None], table.n.values[:, None, None])
        found = table.status.values == status.OK
        miss = np.abs(table.gamma_c.values / exact.gamma - 1)[found]
        assert (miss <= table.error.values[found]).all()
        assert table.attrs["scan_guesses"] == 256
        assert (table.status.values[exact.status == status.NO_TRANSITION] == status.NO_TRANSITION).all()
    with pytest.raises(AtlasFileError, match="lookup needs an atlas built with --method fold"):
        towatlas.open_atlas(path)


def test_places_that_cannot_be_written(tmp_path):
    for path, match in ((tmp_path, "is a folder"), (Path("/proc/none/atlas.nc"), "cannot be written")):
        with pytest.raises(AtlasFileError, match=match):
            small(path)


def test_bad_build_arguments(tmp_path):
    with pytest.raises(ValueError, match="method must be one of fold, scan"):
        build_atlas(tmp_path / "a.nc", "guess")
    with pytest.raises(ValueError, match="threads must be 1 to"):
        small(tmp_path / "a.nc", threads=1000)
    assert not list(tmp_path.iterdir())


# A build whose writing never ends, so that it can be killed in the middle of it.
SLOW_WRITE = """
import sys, time
from pathlib import Path
from towatlas.tables.seal import written_in_place
with written_in_place(Path(sys.argv[1])) as temporary:
    temporary.write_bytes(b"half a file")
    print("writing", flush=True)
    time.sleep(60)
"""


def test_kill_leaves_the_old_file_whole(small_path, tmp_path):
    path = tmp_path / "atlas.nc"
    shutil.copy(small_path, path)
    before = path.read_bytes()
    process = subprocess.Popen([sys.executable, "-c", SLOW_WRITE, str(path)], stdout=subprocess.PIPE)
    process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    assert path.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 2
    # The next build sweeps up what the killed one left.
    small(path)
    assert list(tmp_path.iterdir()) == [path]
    towatlas.open_atlas(path)


def test_kill_of_a_real_build(small_path, atlas_path, tmp_path):
    """kill -9 at several moments of the real command: the old file is there or the new one, whole."""
    path = tmp_path / "atlas.nc"
    shutil.copy(small_path, path)
    before = path.read_bytes()
    whole = atlas_path.read_bytes()
    for delay in (0.5, 1.2, 2.0, 3.5):
        command = [sys.executable, "-m", "towatlas", "build", "--out", str(path), "--quiet"]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        time.sleep(delay)
        process.kill()
        process.wait()
        # Not compared inside the assertion, whose report of a difference would take a minute.
        is_whole = path.read_bytes() in (before, whole)
        assert is_whole
        towatlas.open_atlas(path)


def test_full_disk_leaves_the_old_file_whole(small_path, tmp_path):
    path = tmp_path / "atlas.nc"
    shutil.copy(small_path, path)
    before = path.read_bytes()

    def small_disk():
        resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)

    command = [sys.executable, "-m", "towatlas", "build", "--out", str(path), "--quiet"]
    # With a cache already full of compiled kernels: numba may not write them either.
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=small_disk)
    assert done.returncode == 5, done.stderr
    assert "Traceback" not in done.stderr
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.slow
def test_two_builds_at_once(tmp_path, atlas_path):
    path = tmp_path / "atlas.nc"
    command = [sys.executable, "-m", "towatlas", "build", "--out", str(path), "--quiet", "--threads", "1"]
    builds = [subprocess.Popen(command, stdout=subprocess.DEVNULL) for _ in range(2)]
    assert [build.wait() for build in builds] == [0, 0]
    assert path.read_bytes() == atlas_path.read_bytes()
    assert list(tmp_path.iterdir()) == [path]
