"""Maps: what their specs may say, what they hold, that nothing disturbs them, and what looking one up tells."""

import errno
import fcntl
import io
import os
import subprocess
import sys
from pathlib import Path
from shutil import copytree, which

import numpy as np
import pytest
import xarray as xr
from helpers import run
from tqdm import tqdm

import towatlas
from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS
from towatlas.maps.build import build_map, estimate, refuse
from towatlas.maps.layout import KINDS, fold_tiles, state_tiles
from towatlas.maps.lookup import COMPUTED, EDGE, FOLD, OUTSIDE, UNKNOWN
from towatlas.maps.runner import do_tile
from towatlas.maps.spec import make_spec, read_spec, shipped_specs
from towatlas.maps.systems import NAMES, RATIOS
from towatlas.maps.tiles import compute_tile, read_tile, tile_path, write_tile
from towatlas.plot.map import plot_map

ROOT = Path(__file__).parent.parent
DRAG = {
    "title": "in air",
    "fields": ["position", "tension", "growth", "kind", "folds", "shapes"],
    "tile": 40,
    "system": {"w_f": 1.0},
    "axes": {
        "C": [0.0, 0.05, 0.1],
        "lam": {"from": 3, "to": 5, "points": 3},
        "gamma": {"from": 0.5, "to": 1.3, "points": 12, "spacing": "log"},
    },
    "shapes": {"points": 5},
}
PLAIN = {"fields": ["position"], "tile": 16, "system": {"w_f": 1.0, "gamma": 1.0}, "axes": {"lam": [2.0, 3.0, 4.0]}}
FINE = {
    "fields": ["position", "tension", "growth", "kind"],
    "system": {"w_f": 1.0},
    "axes": {
        "lam": {"from": 3, "to": 5, "points": 17},
        "gamma": {"from": 0.5, "to": 1.3, "points": 33, "spacing": "log"},
    },
}


def built(folder, spec, **options):
    build_map(make_spec(spec), folder, **options)
    return folder


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("maps") / "small"
    return built(folder, DRAG, netcdf=folder.with_suffix(".nc"))


@pytest.fixture(scope="module")
def fine(tmp_path_factory):
    return built(tmp_path_factory.mktemp("maps") / "fine", FINE)


def files_of(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


# Specs.


@pytest.mark.parametrize(
    ("change", "match"),
    [
        ({"feilds": ["count"]}, "key feilds is unknown; do you mean fields"),
        ({"fields": ["positions"]}, "field 'positions' is unknown; do you mean position"),
        ({"fields": []}, "fields must be a list of some of count, nodes"),
        ({"axes": {"lamb": [1.0]}}, "key axes.lamb is unknown; do you mean lam"),
        ({"axes": {"lam": {"from": 2, "to": 2, "points": 5}}}, "axes.lam: from 2 to 2 is empty"),
        ({"axes": {"lam": {"from": 2, "to": 3}}}, "axes.lam.points is missing"),
        ({"axes": {"lam": {"from": 2, "to": 3, "pionts": 5}}}, "key axes.lam.pionts is unknown; do you mean points"),
        ({"axes": {"lam": {"from": 2, "to": 3, "points": 1}}}, "axes.lam.points = 1 must be a whole number from 2"),
        ({"axes": {"lam": {"from": 2, "to": 3, "points": 5, "spacing": "cubic"}}}, "spacing = 'cubic' must be"),
        ({"axes": {"lam": []}}, "axes.lam is empty"),
        ({"axes": {"lam": [3.0, 2.0]}}, "axes.lam must rise"),
        ({"axes": {"lam": [-1.0]}}, "axes.lam = -1 must be positive"),
        ({"axes": {"lam": [True]}}, "axes.lam = True is not a number"),
        ({"axes": {"lam": [float("nan")]}}, "axes.lam = nan is not finite"),
        ({"axes": {"lam": [1.0], "C_s": {"from": -1, "to": 1, "points": 3, "spacing": "log"}}}, "needs positive"),
        ({"axes": {}}, r"\[axes\] is missing"),
        ({"system": {"w_f": 1.0}}, "gamma is missing"),
        ({"system": {"w_f": 1.0, "gamma": 0.0}}, "system.gamma = 0: positive in a turn"),
        ({"system": {"w_f": 1.0, "gamma": 1.0, "lam": 2.0}}, r"lam is in \[system\] and in \[axes\]"),
        ({"system": {"w_f": 1.0, "gamma": 1.0, "C": -1.0}}, "system.C = -1 is negative"),
        ({"system": {"w_f": -1.0, "gamma": 1.0}}, "give m_f"),
        ({"system": {"w_f": 1.0, "gamma": 1.0, "m_f": 1.0, "m_f_over_w_f": 2.0}}, "say the same"),
        ({"system": {"w_f": 1.0, "gamma": 1.0, "C_t_over_C": 0.1}}, "C_t_over_C needs C"),
        ({"branches": "every"}, 'branches = \'every\' must be "all" or "expected"'),
        ({"tile": 10**6}, "tile = 1000000 must be a whole number from 1 to 10,000"),
        ({"fields": ["folds"]}, "folds alone are of no one speed"),
        ({"fields": ["count", "folds"]}, "folds.from is missing"),
        ({"folds": {"from": 1, "to": 2}}, '"folds" is not among the fields'),
        ({"shapes": {"points": 5}}, '"shapes" is not among the fields'),
        ({"fields": ["count", "folds"], "folds": {"from": 2, "to": 1}}, "the lower first"),
        ({"system": 3}, r"system = 3 is a section; write \[system\]"),
    ],
)
def test_bad_specs(change, match):
    with pytest.raises(ValueError, match=match):
        make_spec(PLAIN | change)


def test_names_are_those_of_a_system():
    assert {*COLUMNS, "gamma", *RATIOS} == {*NAMES}


def test_ratios_are_taken_of_the_axes():
    spec = make_spec(
        PLAIN
        | {"system": {"gamma": 1.0, "lam": 2.0, "C_t_over_C": 0.1, "m_f_over_w_f": 2.0}}
        | {"axes": {"C": [1.0, 2.0], "w_f": [3.0, 5.0]}}
    )
    numbers = spec.numbers(spec.axes, state_tiles(spec).indices(0))
    assert numbers["C_t"].tolist() == [0.1, 0.1, 0.2, 0.2]
    assert numbers["m_f"].tolist() == [6.0, 10.0, 6.0, 10.0]


@pytest.mark.parametrize("name", shipped_specs())
def test_shipped_specs(name):
    spec = read_spec(name)
    assert spec.title
    assert 1000 < spec.systems < 10**5


def test_every_system_lies_in_one_tile():
    spec = make_spec(DRAG | {"tile": 7})
    tiles = state_tiles(spec)
    seen = np.zeros(spec.shape, int)
    for number in range(len(tiles)):
        at = tiles.indices(number)
        assert len(at[0]) <= 7
        seen[at] += 1
        assert np.zeros(spec.shape)[tiles.slices(number)].size == len(at[0])
    assert (seen == 1).all()
    assert len(fold_tiles(spec)) == 9


# What it holds.


def test_systems_are_those_of_one_by_one(small):
    found = towatlas.open_map(small).dataset
    assert found.C.values.tolist() == [0.0, 0.05, 0.1]
    for i, j, k in [(0, 2, 11), (1, 1, 0), (2, 2, 6), (2, 0, 11), (0, 1, 5)]:
        one = found.isel(C=i, lam=j, gamma=k)
        alone = towatlas.stability(float(one.lam), 1.0, float(one.gamma), C=float(one.C))
        count = int(one["count"])
        assert count == len(alone)
        np.testing.assert_allclose(one.r_f.values[:count], alone.equilibria.r_f, rtol=1e-9)
        np.testing.assert_array_equal(
            one.nodes.values, np.pad(alone.equilibria.nodes, (0, 3 - count), constant_values=-1)
        )
        assert [KINDS[code] for code in one.kind.values[:count]] == alone.kind.tolist()
        np.testing.assert_allclose(one.growth.values[:count], alone.growth, atol=1e-9)
        for n in range(count):
            curve = towatlas.shape_of(alone.equilibria, n, np.linspace(0.0, float(one.lam), 5))
            np.testing.assert_allclose(one.x.values[n], curve.x, atol=1e-9)
        cable = found.isel(C=i, lam=j)
        folds = towatlas.folds(float(one.lam), 1.0, (0.5, 1.3), C=float(one.C))
        assert int(cable["folds"]) == len(folds)
        np.testing.assert_allclose(cable.fold_gamma.values[: len(folds)], folds.gamma, rtol=1e-10)
        assert cable.fold_change.values[: len(folds)].tolist() == (folds.shapes_above - folds.shapes_below).tolist()


def test_the_expected_shape_alone(small, tmp_path):
    folder = built(tmp_path / "one", DRAG | {"branches": "expected"})
    one, every = towatlas.open_map(folder).dataset, towatlas.open_map(small).dataset
    assert one.sizes["shape"] == 1
    for i, k in [(0, 11), (2, 11), (2, 0)]:
        alone = towatlas.equilibria(5.0, 1.0, float(one.gamma[k]), C=float(one.C[i]))
        row = every.isel(C=i, lam=2, gamma=k)
        assert float(one.r_f.isel(C=i, lam=2, gamma=k)[0]) == float(row.r_f[alone.expected])
        assert int(row["count"]) == len(alone)
    figure = plot_map(towatlas.open_map(folder))
    assert [ax.get_title() for ax in figure.axes] == ["$C$ = 0", "$C$ = 0.05", "$C$ = 0.1"]
    with pytest.raises(ValueError, match="whether the shape expected lasts: it needs"):
        plot_map(towatlas.open_map(small))


def test_what_a_killed_worker_leaves_is_taken_away(tmp_path, monkeypatch):
    """Though the program itself goes on to the end."""
    from towatlas.maps import build

    def killed_at_the_end(folder, *rest, **more):
        run_tiles(folder, *rest, **more)
        tile_path(folder, 0).with_name("00000000.tile.host.0.part").write_bytes(b"half")

    run_tiles = build.run_tiles
    monkeypatch.setattr(build, "run_tiles", killed_at_the_end)
    build.build_map(make_spec(PLAIN | {"axes": {"lam": [2.0, 3.0]}}), tmp_path / "map")
    assert tile_path(tmp_path / "map", 0).exists()
    assert not list(tmp_path.rglob("*.part"))


def test_a_system_that_fails_spoils_no_other(monkeypatch):
    """One that raises is told from the rest of its tile."""
    spec = make_spec(PLAIN | {"axes": {"lam": [2.0, 3.0, 4.0, 5.0, 6.0]}})
    whole = compute_tile(spec, 0)

    def solve(lam, w_f, gamma):
        if (lam == 4.0).any():
            raise FloatingPointError("as a test")
        return towatlas.equilibria_many(lam, w_f, gamma)

    monkeypatch.setattr("towatlas.maps.tiles.equilibria_many", solve)
    broken = compute_tile(spec, 0)
    assert broken["status"].tolist() == [0, 0, status.NOT_CONVERGED, 0, 0]
    good = [0, 1, 3, 4]
    np.testing.assert_allclose(broken["x_f"][good], whole["x_f"][good], rtol=1e-9)
    assert np.isnan(broken["x_f"][2]).all()
    assert broken["nodes"][2].tolist() == [-1] * broken["nodes"].shape[1]


def test_netcdf_is_the_same(small):
    with xr.open_dataset(small.with_suffix(".nc")) as file:
        store = towatlas.open_map(small).dataset
        xr.testing.assert_identical(file.load(), store.load())


def test_cf_compliance(small):
    checker = which("compliance-checker", path=os.path.dirname(sys.executable))
    assert checker, "compliance-checker is not installed: pip install towatlas[test]"
    done = subprocess.run([checker, "--test", "cf:1.11", small.with_suffix(".nc")], capture_output=True, text=True)
    assert "All tests passed!" in done.stdout, done.stdout


# Nothing disturbs it.


def test_a_map_is_the_same_bytes_in_any_order(small, tmp_path):
    """Tiles that are there, damaged, half written or missing, done from the last to the first."""
    again, spec = tmp_path / "again", make_spec(DRAG)
    copytree(small, again)
    there = sorted(again.rglob("*.tile"))
    assert len(there) == 3 + 9
    data = bytearray(there[1].read_bytes())
    data[len(data) // 2] ^= 1
    there[1].write_bytes(data)
    there[2].write_bytes(there[2].read_bytes()[:-1])
    there[3].rename(there[3].with_name(f"{there[3].name}.host.1234.part"))
    for path in there[6:]:
        path.unlink()
    for number in range(11, 7, -1):
        assert do_tile(str(again), spec, number).message == ""
    said = []
    build_map(spec, again, resume=True, report=said.append)
    assert said == ["5 of 12 tiles to do"]
    assert files_of(again) == files_of(small)


def test_a_tile_that_cannot_be_written_leaves_nothing(tmp_path, monkeypatch):
    spec = make_spec(PLAIN)

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        done = do_tile(str(tmp_path), spec, 0)
        assert "tile 0 was not written" in done.message
        assert "No space left" in done.message
        with pytest.raises(OSError, match="make room, and --resume goes on"):
            build_map(spec, tmp_path / "map")
    assert not [path for path in tmp_path.rglob("*") if path.suffix in (".tile", ".part", ".zarr")]
    build_map(spec, tmp_path / "map", resume=True)
    assert towatlas.open_map(tmp_path / "map").dataset["count"].values.tolist() == [1, 1, 3]


def test_a_tile_is_whole_or_none(tmp_path):
    path = tile_path(tmp_path, 7)
    columns = {"x": np.arange(3.0), "status": np.zeros(3, np.int8)}
    digest = write_tile(path, columns)
    first = path.read_bytes()
    assert write_tile(path, columns) == digest
    assert path.read_bytes() == first
    assert read_tile(path)[1] == digest
    for cut in (0, 10, len(first) - 1):
        path.write_bytes(first[:cut])
        assert read_tile(path) is None
    assert read_tile(tile_path(tmp_path, 8)) is None


def test_who_may_go_on(small, tmp_path):
    spec = make_spec(PLAIN)
    with pytest.raises(ValueError, match="holds a map already: --resume goes on"):
        build_map(make_spec(DRAG), small)
    with pytest.raises(ValueError, match="holds a map of another spec"):
        build_map(spec, small, resume=True)
    (tmp_path / "letters").write_text("dear")
    with pytest.raises(ValueError, match="is not empty, and holds no map"):
        build_map(spec, tmp_path)
    (tmp_path / "map").mkdir()
    with (tmp_path / "map" / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(OSError, match="another program is at work"):
            build_map(spec, tmp_path / "map")
    plan = tmp_path / "map" / "plan.json"
    build_map(spec, tmp_path / "map")
    plan.write_text(plan.read_text().replace('"kernel_sources_sha256": "', '"kernel_sources_sha256": "0'))
    with pytest.raises(ValueError, match="another version of towatlas"):
        build_map(spec, tmp_path / "map", resume=True)


def test_other_sources_do_not_go_on(tmp_path, monkeypatch):
    """What tiles follow from is hashed, what draws them is not."""
    package = tmp_path / "package"
    copytree(ROOT / "atlas", package)
    monkeypatch.setattr("towatlas.maps.build.__file__", str(package / "maps" / "build.py"))
    spec = make_spec(PLAIN)
    build_map(spec, tmp_path / "map")
    for name, goes_on in (("plot/map.py", True), ("solve/search.py", False), ("system.py", False)):
        file = package / name
        before = file.read_text()
        file.write_text(before + "# other\n")
        if goes_on:
            build_map(spec, tmp_path / "map", resume=True)
        else:
            with pytest.raises(ValueError, match="another version of towatlas"):
                build_map(spec, tmp_path / "map", resume=True)
        file.write_text(before)


def test_the_bar_of_a_map_that_goes_on(tmp_path, monkeypatch):
    """It begins at what is there already."""
    bars = []

    def bar(total, unit, wanted):
        bars.append((unit, tqdm(total=total, file=io.StringIO())))
        return bars[-1][1]

    monkeypatch.setattr("towatlas.maps.build.progress_bar", bar)
    spec = make_spec(PLAIN | {"tile": 1})
    build_map(spec, tmp_path / "map")
    tile_path(tmp_path / "map", 1).unlink()
    bars.clear()
    build_map(spec, tmp_path / "map", resume=True)
    assert [(unit, one.n, one.total) for unit, one in bars] == [("tile", 3, 3), ("system", 3, 3), ("tile", 1, 1)]


@pytest.mark.slow
def test_killed_workers_and_programs_change_nothing(tmp_path):
    from benchmarks.maps_chaos import run as disturbed_and_alone

    row = disturbed_and_alone("drag", share=0.005, tile=20, kills=6, folder=tmp_path)
    assert (row.schedulers, row.different) == (1, 0)
    assert row.files > row.tiles > 20


@pytest.mark.slow
def test_two_hosts_and_a_cut_line_change_nothing(tmp_path):
    from benchmarks import maps_hosts

    if not maps_hosts.possible():
        pytest.skip("no network namespaces here")
    row = maps_hosts.run(share=0.02, tile=20, cut=3.0, folder=tmp_path)
    assert row.different == 0
    assert row.files > row.tiles > 20


# Looking up.


def test_stated_errors_hold(fine):
    """At random points, against each solved directly; none is answered where the shapes are others."""
    known = towatlas.open_map(fine)
    rng = np.random.default_rng(5)
    lam, gamma = rng.uniform(3, 5, 150), np.exp(rng.uniform(*np.log([0.5, 1.3]), 150))
    found = known.at(lam=lam, gamma=gamma)
    true = towatlas.stability_many(lam, 1.0, gamma)
    answered = found.status.values == COMPUTED
    assert 0.5 < answered[:, 0].mean() < 1.0
    seen = 0
    for i in range(150):
        count = int(true["count"][i])
        for k in np.flatnonzero(answered[i]):
            if k >= int(found["count"][i]):
                continue
            assert int(found["count"][i]) == count
            assert int(found.nodes[i, k]) == int(true.nodes[i, k])
            assert KINDS[int(found.kind[i, k])] == str(true.kind[i, k].item())
            for name in ("x_f", "z_f", "tension", "growth"):
                off = abs(float(found[name][i, k]) - float(true[name][i, k]))
                assert off <= float(found[f"{name}_error"][i, k]) + 1e-9, (name, i, k)
                seen += 1
    assert seen > 300


def test_never_across_a_fold_or_an_edge(fine):
    known = towatlas.open_map(fine)
    fold = towatlas.folds(4.03, 1.0, (0.5, 1.3)).gamma[0]
    found = known.at(lam=4.03, gamma=[fold * 0.999, fold * 1.001])
    assert (found.status.values == FOLD).all()
    assert np.isnan(found.x_f.values).all()
    kind = known.dataset.kind.values
    same = (known.dataset["count"].values[:, 1:] == 3) & (known.dataset["count"].values[:, :-1] == 3)
    i, j = np.argwhere(same & (kind[:, 1:] != kind[:, :-1]).any(axis=-1))[0]
    gamma = known.dataset.gamma.values
    at = known.at(lam=float(known.dataset.lam[i]), gamma=float(np.sqrt(gamma[j] * gamma[j + 1])))
    changed = kind[i, j] != kind[i, j + 1]
    assert (at.status.values[0][changed] == EDGE).all()
    assert not (at.status.values[0][~changed] == EDGE).any()


def test_points_of_a_map_are_themselves(fine, small):
    known = towatlas.open_map(fine)
    lines = repr(known).splitlines()
    assert lines[0].startswith(f"Map of {known.dataset['count'].size} systems: ")
    assert lines[1].startswith("  lam: ")
    assert lines[1].endswith(", 3 to 5")
    row = known.dataset.isel(lam=4, gamma=30)
    found = known.at(lam=float(row.lam), gamma=float(row.gamma))
    np.testing.assert_array_equal(found.x_f.values[0], row.x_f.values)
    assert np.nanmax(found.x_f_error.values) == 0.0
    with pytest.raises(ValueError, match="lam = 9 is outside the map, which has 3 to 5"):
        known.at(lam=[4.0, 9.0], gamma=1.0)
    assert known.at(lam=[4.0, 9.0], gamma=1.2, outside="nan").status.values[1].tolist() == [OUTSIDE] * 3
    with pytest.raises(ValueError, match="lam is missing; its axes are lam, gamma"):
        known.at(gamma=1.0)
    with pytest.raises(ValueError, match="C is no axis of this map"):
        known.at(lam=4.0, gamma=1.0, C=0.1)
    # Of two points in a row the bend is not known.
    few = built(
        small.parent / "few",
        {"fields": ["position"], "system": {"w_f": 1.0, "gamma": 0.3}, "axes": {"lam": [1.0, 1.1]}},
    )
    assert towatlas.open_map(few).at(lam=1.05).status.values.tolist() == [[UNKNOWN]]


def test_files_that_are_no_maps(tmp_path):
    for path, match in ((tmp_path, "no finished map"), (tmp_path / "none", "no map at")):
        with pytest.raises(towatlas.AtlasFileError, match=match):
            towatlas.open_map(path)
    (tmp_path / "text.nc").write_text("no")
    with pytest.raises(towatlas.AtlasFileError, match="cannot be read as a map"):
        towatlas.open_map(tmp_path / "text.nc")


# The shell.


def test_the_estimate_is_that_of_the_work():
    spec = make_spec(DRAG)
    expected = estimate(spec)
    assert (expected.systems, expected.tiles) == (108, 12)
    assert "108 systems in 12 tiles" in str(expected)
    held = sum(column.nbytes for k in range(12) for column in compute_tile(spec, k).values())
    assert 0.5 < expected.size / (2 * held) < 2.0


def test_too_much_is_refused_with_the_estimate(tmp_path, capsys):
    axis = {"from": 1, "to": 2, "points": 10**5}
    spec = make_spec(PLAIN | {"system": {}, "axes": {"w_f": axis, "lam": axis, "gamma": axis}})
    expected = estimate(spec)
    with pytest.raises(
        ValueError, match=r"1,000,000,000,000,000 systems in .* years of CPU .* PB on the disk; .* at most"
    ):
        refuse(spec, expected, None)
    spec = make_spec(PLAIN | {"system": {}, "axes": {"w_f": axis, "lam": axis, "gamma": [1.0]}})
    with pytest.raises(ValueError, match="are free at"):
        refuse(spec, estimate(spec), tmp_path / "map")


def test_shell(capsys, tmp_path, fine):
    file = tmp_path / "plain.toml"
    file.write_text('fields = ["position"]\n[system]\nw_f = 1\ngamma = 1\n[axes]\nlam = [2, 3, 4]\n')
    code, out, _ = run(capsys, "map", file, "--dry-run")
    assert (code, out.startswith("3 systems in 1 tiles: about")) == (0, True)
    assert run(capsys, "map", file)[0] == 2
    file.write_text(file.read_text().replace("lam", "lma"))
    code, _, said = run(capsys, "map", file, "--dry-run")
    assert (code, "plain.toml: key axes.lma is unknown; do you mean lam?" in said) == (2, True)
    code, _, said = run(capsys, "map", tmp_path / "none", "--dry-run")
    assert (code, "those that come with the package: air-tests, wet-folds, wet-survey" in said) == (5, True)
    code, out, _ = run(capsys, "map", fine, "--at", "lam=4.1,gamma=1.2")
    assert (code, out.count("computed"), "+-" in out) == (0, 3, True)
    code, out, said = run(capsys, "map", fine, "--at", "lam=40,gamma=1.25")
    assert (code, out, "lam = 40 is outside the map, which has 3 to 5" in said) == (3, "", True)
    fold = towatlas.folds(4.03, 1.0, (0.5, 1.3)).gamma[0]
    code, out, said = run(capsys, "map", fine, "--at", f"lam=4.03,gamma={fold}", "--json")
    assert (code, '"outcome": "fold"' in out, "next to a fold" in said) == (4, True, True)
    assert run(capsys, "map", fine, "--at", "lam")[0] == 2
    assert run(capsys, "map", fine, "--workers", "0")[0] == 2
