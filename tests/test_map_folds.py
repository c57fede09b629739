"""Folds looked up in a map, beside those solved directly; where it does not tell them; and what a shell says."""

import io
import json
from dataclasses import asdict
from pathlib import Path
from shutil import copytree
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import run

import towatlas
from benchmarks.maps_folds import systems
from towatlas.kernels import status
from towatlas.maps.build import build_map
from towatlas.maps.folds import NotInMap
from towatlas.maps.lookup import OutsideMap
from towatlas.maps.spec import make_spec
from towatlas.maps.tiles import compute_tile, tile_path
from towatlas.scene.file import scene_of_text
from towatlas.solve.folds import folds_in_speed
from towatlas.system import System

SCENE = """
[cable]
length = {}
mass_per_length = 0.5
diameter = 0.012
drag_coefficient = 1.4
[fish]
mass = 14
volume = 0.004
added_mass = 6
drag_coefficient = 0.8
frontal_area = 0.002
[tow]
radius = 1
speed = "3.1 m/s"
[fluid]
density = 1025
"""
WET_FOLDS = Path(__file__).parents[1] / "docs" / "data" / "wet-folds.nc"
SPAN = (0.03, 5.0)
GROUPS = scene_of_text(SCENE.format(2.0).encode(), "-").system("water")
SPEC = {
    "fields": ["folds", "origin"],
    "tile": 150,
    "system": {name: getattr(GROUPS, name) for name in ("w_f", "m_f", "w", "C_f")},
    "axes": {
        "C": {"from": 10, "to": 20, "points": 3, "spacing": "log"},
        "lam": {"from": 1.8, "to": 2.4, "points": 3},
    },
    "folds": {"from": SPAN[0], "to": SPAN[1], "checks": 6},
}


def system(C, lam, **changes):
    fixed = {name: getattr(GROUPS, name) for name in ("m_f", "w", "C_f")}
    return System.of(lam, GROUPS.w_f, **({"C": C} | fixed | changes))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("folds") / "map"
    assert build_map(make_spec(SPEC), folder, netcdf=folder.with_suffix(".nc")) == 0
    return folder


@pytest.fixture(scope="module")
def known(folder):
    return towatlas.open_map(folder)


def test_folds_are_those_solved_directly(known):
    """At random points."""
    rng = np.random.default_rng(11)
    named = 0
    for C, lam in zip(10.0 * 2.0 ** rng.random(8), rng.uniform(1.8, 2.4, 8), strict=True):
        found = known.folds(system(C, lam), *SPAN)
        direct = folds_in_speed(system(C, lam), *SPAN, named=named < 2)
        assert found.complete
        assert found.shapes_below.tolist() == direct.shapes_below.tolist()
        assert found.shapes_above.tolist() == direct.shapes_above.tolist()
        assert (np.abs(found.gamma / direct.gamma - 1.0) <= found.error + direct.error).all()
        np.testing.assert_allclose(found.r_f, direct.r_f, rtol=1e-6)
        if named < 2:
            assert (found.n.tolist(), found.origin.tolist()) == (direct.n.tolist(), direct.origin.tolist())
        named += len(found) > 0
    errors = known.dataset.check_error.values
    assert (errors < 1e-11).all()


def test_checks_are_points_between(known):
    """What is stored of them are folds of the systems that they name."""
    data = known.dataset.isel(check=2)
    direct = folds_in_speed(system(float(data.check_C), float(data.check_lam)), *SPAN, named=False)
    assert int(data.check_folds) == len(direct)
    np.testing.assert_allclose(data.check_fold_gamma.values[: len(direct)], direct.gamma, rtol=1e-12)


def test_names_are_those_on_which_all_around_agree(known):
    """Else they are found out."""
    data = known.dataset
    point = system(12.0, 1.9)
    here = known.folds(point, *SPAN)
    none = type(known)(data.assign(fold_n=data.fold_n * 0 + 3))
    assert none.folds(point, *SPAN).n.tolist() == [3] * len(here)
    apart = np.where(np.arange(len(data.C))[:, None, None] > 0, 3, data.fold_n)
    unsure = type(known)(data.assign(fold_n=(data.fold_n.dims, apart)))
    assert unsure.folds(point, *SPAN).n.tolist() == here.n.tolist()


def test_the_vacuum_in_a_map(tmp_path):
    """Its folds are counted, and have their names, where no point around has as many."""
    axes = {"C": [0, 1e-3], "lam": [4, 14]}
    spec = {
        "fields": ["folds", "origin"],
        "system": {"w_f": 1},
        "axes": axes,
        "folds": {"from": 0.1, "to": 5, "checks": 2},
    }
    build_map(make_spec(spec), tmp_path / "map")
    found = towatlas.open_map(tmp_path / "map").folds(System.of(7.0, 1.0), 0.1, 5.0)
    assert (found.n.tolist(), set(found.origin)) == ([1, 2, 3], {"vacuum"})


def test_one_that_takes_too_many_steps_is_given_up(monkeypatch):
    """By its steps, the same anywhere, and it alone: no shot with drag is made for a vacuum."""
    spec = make_spec(
        {
            "fields": ["folds", "origin"],
            "system": {"w_f": 1, "lam": 4},
            "axes": {"C": [0, 0.05]},
            "folds": {"from": 0.1, "to": 2, "checks": 0},
        }
    )
    whole = compute_tile(spec, 0)
    assert whole["folds_status"].tolist() == [status.OK, status.OK]
    assert whole["folds"].tolist() == [1, 1]
    monkeypatch.setattr("towatlas.maps.tiles.SECONDS_A_STEP", 1.0)
    some = compute_tile(spec, 0)
    assert some["folds_status"].tolist() == [status.OK, status.UNFINISHED]
    assert some["folds"].tolist() == [1, 0]
    assert np.isnan(some["fold_gamma"][1]).all()
    np.testing.assert_array_equal(some["fold_gamma"][0, 0], whole["fold_gamma"][0, 0])


def test_never_where_folds_are_others(known):
    here = system(12.0, 1.9)
    data = known.dataset
    moved = type(known)(data.assign(fold_gamma=data.fold_gamma * 10.0))
    with pytest.raises(NotInMap, match="beyond the speeds of the folds of the points around"):
        moved.folds(here, *SPAN)
    none = type(known)(data.assign(folds=data.folds * 0, fold_gamma=data.fold_gamma * np.nan))
    with pytest.raises(NotInMap, match="beyond the speeds of the folds of the points around"):
        none.folds(here, *SPAN)
    unknown = type(known)(data.assign(check_error=data.check_error * np.nan))
    with pytest.raises(NotInMap, match="how well it tells folds is not known"):
        unknown.folds(here, *SPAN)
    failed = type(known)(data.assign(folds_status=data.folds_status + np.int8(status.NOT_COUNTED)))
    with pytest.raises(NotInMap, match="were not made out"):
        failed.folds(here, *SPAN)


@pytest.mark.parametrize(
    ("there", "speeds", "match"),
    [
        (system(12.0, 3.0), SPAN, "lam = 3 is outside the map, which has 1.8 to 2.4"),
        (system(12.0, 2.0, w=0.5), SPAN, "w = 0.5 is outside the map, which has 0.623575"),
        (system(12.0, 2.0, C_t=0.1), SPAN, "C_t = 0.1 is outside the map, which has 0"),
        (system(12.0, 2.0), (0.03, 6.0), "speeds 0.03 to 6 are not all in the map, which has 0.03 to 5"),
        (system(12.0, 2.0), (-0.03, -2.0), "speeds -0.03 to -2 are of a turn to the other side"),
    ],
)
def test_outside_is_named(known, there, speeds, match):
    with pytest.raises(OutsideMap, match=match):
        known.folds(there, *speeds)


def test_a_part_of_the_speeds(known):
    point = system(10.0, 1.8)
    (gamma,) = known.folds(point, *SPAN).gamma
    assert len(known.folds(point, gamma * 1.001, 5.0)) == 0
    assert len(known.folds(point, gamma * 0.999, 5.0)) == 1


def test_points_of_the_map_are_told(known):
    """Their own folds were half way between the speeds looked at, where the first column then was."""
    for C in known.dataset.C.values:
        for lam in known.dataset.lam.values:
            for off in (0.0, 1e-15, -1e-15):
                assert len(known.folds(system(float(C) * (1.0 + off), float(lam)), *SPAN)) > 0


def test_the_same_bytes_when_it_goes_on(folder, tmp_path):
    again = tmp_path / "again"
    copytree(folder, again)
    for number in (1, 4):
        tile_path(again, number).unlink()
    build_map(make_spec(SPEC), again, resume=True)
    files = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    assert len(files) > 20
    assert all((again / file).read_bytes() == (folder / file).read_bytes() for file in files)


def test_the_slower_speed_goes_first(known):
    with pytest.raises(ValueError, match="the slower speed goes first, not 5"):
        known.folds(system(12.0, 1.9), *SPAN[::-1])


def test_maps_that_hold_no_folds(known):
    with pytest.raises(ValueError, match="this map holds no folds, or none that were checked"):
        type(known)(known.dataset.drop_vars("check_error")).folds(system(12.0, 2.0), *SPAN)
    with pytest.raises(ValueError, match='give the field "folds", too'):
        make_spec({name: SPEC[name] for name in ("system", "axes")} | {"fields": ["origin", "position"]})
    with pytest.raises(ValueError, match="folds alone: towatlas folds --atlas"):
        known.at(C=12.0, lam=2.0)


def of_shell(point, *more):
    numbers = {"lam": point.lam, "wf": point.w_f, "C": point.C, "m-f": point.m_f, "C-f": point.C_f, "w": point.w}
    return ("folds", *(f"--{name}={value!r}" for name, value in numbers.items()), *more)


def test_shell(capsys, folder, known, tmp_path):
    point = system(12.0, 2.0)
    code, out, said = run(capsys, *of_shell(point, "--gamma=0.5:4", "--json", "--atlas", folder))
    (row,) = json.loads(out)
    (gamma,) = known.folds(point, *SPAN).gamma
    assert (code, row["gamma"], row["n"], row["origin"]) == (0, gamma, 1, "vacuum")
    assert "looked at: gamma 0.03 to 5 by a map" in said
    code, out, said = run(capsys, *of_shell(system(30.0, 2.0), "--gamma=0.5:4", "--atlas", folder))
    assert (code, out) == (3, "")
    assert "C = 30 is outside the map, which has 10 to 20; without --atlas they are computed" in said
    code, out, said = run(capsys, *of_shell(point, "--gamma=0.5:40", "--atlas", folder))
    assert (code, "speeds 0.5 to 40 are not all in the map" in said) == (3, True)
    code, out, said = run(capsys, *of_shell(point, "--gamma=0.5:4", "--atlas", folder / "none"))
    assert (code, out, "no map at" in said) == (5, "", True)
    code, out, said = run(capsys, "scene", "skop-fig3", "--atlas", tmp_path)
    assert (code, out, "holds no finished map" in said) == (5, "", True)


def test_scene(capsys, monkeypatch, folder):
    """The same jumps with and without; where the map does not tell them they are solved, and that is said."""

    def ask(length, *more):
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(SCENE.format(length).encode())))
        code, out, said = run(capsys, "scene", "-", "--json", "--model", "water", *more)
        assert code == 0
        return json.loads(out), said

    with_map, said = ask(2.0, "--atlas", folder)
    gamma = with_map["speed"]["gamma"]
    direct = folds_in_speed(System.of(**asdict(GROUPS)), gamma / 30.0, gamma * 3.0)
    assert "jumps: gamma 0.03 to 5 by a map" in said
    assert with_map["jumps_searched"].startswith("gamma 0.03 to 5 by a map")
    assert [(row["n"], row["origin"]) for row in with_map["jumps"]] == [(1, "vacuum")]
    assert [row["gamma"] for row in with_map["jumps"]] == pytest.approx(direct.gamma, rel=2.0 * direct.error[0])
    assert ask(2.0, "--atlas", folder.with_suffix(".nc"))[0] == with_map
    # Speeds that the map has not are looked at by the solver, and the rest looked up.
    for speed in (0.6, 2.4):
        partly, _ = ask(2.0, "--atlas", folder, "--gamma", speed)
        without, _ = ask(2.0, "--gamma", speed)
        assert "by a map" in partly["jumps_searched"]
        assert f"gamma {speed / 30 if speed < 1 else 5:g} to" in partly["jumps_searched"]
        columns = [[(row["gamma"], row["n"]) for row in one["jumps"]] for one in (partly, without)]
        assert len(columns[0]) == len(columns[1]) > 0
        np.testing.assert_allclose(*columns, rtol=1e-12)
    outside, said = ask(2.6, "--atlas", folder)
    assert "jumps are not looked up, but solved for: lam = 2.6 is outside the map" in said
    assert outside["jumps_complete"]


def test_names_are_found_out_where_points_around_have_other_numbers_of_folds():
    """Of eight points around with one fold all say 1, of 38 others with two some say 0: it is 2."""
    cable = {"C": 1.9326231096584965, "w": 0.6390512065761571, "m_f": 6.049357, "C_f": 0.0335868, "C_t": 0.0718259}
    point = System.of(4.618539655378132, 3.3848076330005457, **cable)
    assert towatlas.open_map(WET_FOLDS).folds(point, 0.02, 20.0).n.tolist() == [2]
    assert folds_in_speed(point, 0.02, 20.0).n.tolist() == [2]


def test_the_atlas_of_wet_folds():
    """In the repository: systems at random are told as solved directly, and its checks say how well it tells them."""
    known = towatlas.open_map(WET_FOLDS)
    errors = known.dataset.check_error.values
    assert (errors.size, np.isnan(errors).sum(), np.isinf(errors).sum()) == (1000, 0, 0)
    low, high = known.dataset.attrs["folds_gamma"]
    some = 0
    for point in systems(known, 12, seed=3):
        found, direct = known.folds(point, low, high), folds_in_speed(point, low, high)
        assert (found.n.tolist(), found.shapes_above.tolist()) == (direct.n.tolist(), direct.shapes_above.tolist())
        np.testing.assert_allclose(found.gamma, direct.gamma, rtol=1e-12)
        some += len(found)
    assert some > 0
