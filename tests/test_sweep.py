"""Curves over length and speed: the same shapes as one by one, branches that go on until a fold, the shell."""

import csv
import json

import numpy as np
import pytest
from helpers import run

import towatlas
from towatlas.scene.file import SceneFileError, make_scene, read_scene
from towatlas.scene.models import solve_model
from towatlas.scene.sweeps import sweep

# Three shapes between 8104 and 8313 m, drag alone makes them.
DEEP = """
[cable]
length = "26900 ft"
mass_per_length = "0.3 lb/ft"
diameter = "0.5 in"
drag_coefficient = 1.27
[fish]
mass = "250 lb"
volume = "0.9048 ft^3"
added_mass = 13.13
drag_coefficient = 0.2
frontal_area = "1.131 ft^2"
[tow]
radius = "10000 ft"
speed = "5 kn"
[fluid]
name = "seawater"
"""
ROW = [
    *("length", "lam", "speed", "depth", "y_over_l", "r_f", "radius_ratio", "phase_deg", "tension", "tension_fish"),
    *("t_over_mgl", "angle_tow_deg", "angle_fish_deg", "shapes", "nodes", "branch", "expected"),
    *("jump_below", "jump_above"),
]


@pytest.fixture
def deep(tmp_path):
    path = tmp_path / "deep.toml"
    path.write_text(DEEP)
    return path


@pytest.mark.parametrize("name", ["length", "speed"])
def test_the_same_shapes_as_one_by_one(deep, name):
    scene = read_scene(deep)
    middle = {"length": scene.length, "speed": scene.speed}[name]
    curve = sweep(scene, **{name: middle * np.linspace(0.9, 1.1, 9)}).isel(member=0)
    assert str(curve.model.values) == "water"
    assert bool(curve.complete)
    assert set(curve.shapes.values) == {1, 3}
    for i, value in enumerate(curve[name].values):
        at = scene.at(speed=value) if name == "speed" else read_scene(deep, {"cable.length": float(value)})
        alone = solve_model(at, "water")
        shapes = alone.equilibria
        order = np.argsort(shapes.r_f)
        here = curve.isel(value=i, shape=slice(0, len(order)))
        assert int(here.shapes) == len(order)
        force = at.force_unit("water")
        for field, column in (
            ("depth", shapes.z_f * at.radius),
            ("r_f", shapes.r_f * at.radius),
            ("radius_ratio", shapes.r_f),
            ("phase_deg", shapes.phase_deg),
            ("tension", shapes.tension * force),
            ("y_over_l", shapes.z_f * at.radius / at.length),
            ("t_over_mgl", shapes.tension * force / (at.mass_per_length * at.gravity * at.length)),
        ):
            np.testing.assert_allclose(here[field].values, column[order], rtol=1e-9)
        assert list(here.expected.values) == [k == shapes.expected for k in order]
        for j, k in enumerate(order):
            along = towatlas.shape_of(shapes, int(k), [0.0, shapes.system.lam])
            assert float(here.tension_fish[j]) == pytest.approx(float(along["T"][-1]) * force, rel=1e-7)
            for field, place in (("angle_tow_deg", 0), ("angle_fish_deg", -1)):
                across = np.hypot(float(along.R_x[place]), float(along.R_y[place]))
                angle = np.degrees(np.arctan2(float(along.R_z[place]), across))
                assert float(here[field][j]) == pytest.approx(angle, rel=1e-6)


def test_branches_go_on_until_a_fold(deep):
    scene = read_scene(deep)
    curve = sweep(scene, length=scene.radius * np.linspace(2.5, 2.9, 81), model="water").isel(member=0)
    np.testing.assert_allclose(curve.jump.values / scene.radius, [2.65870317, 2.72720846], rtol=3e-6)
    assert list(curve.change.values) == [2, -2]
    branch, radius = curve.branch.values, curve.r_f.values
    assert sorted(set(branch[branch >= 0])) == [0, 1, 2]
    # The middle one lives between the jumps alone, the others on one side of one of them.
    alive = [curve.length.values[(branch == number).any(axis=1)] for number in range(3)]
    low, high = curve.jump.values
    assert alive[0].max() < high < alive[1].max()
    assert low < alive[2].min() < alive[2].max() < high or low < alive[1].min() < alive[1].max() < high
    for number in range(3):
        line = radius[branch == number]
        assert np.abs(np.diff(line)).max() < 200.0


def test_a_family_in_a_vacuum():
    """Both ends of a pair, the median expected, and one curve for each scene."""
    scenes = [read_scene("skop-fig3"), read_scene("skop-fig3", {"fish.mass": "3 g"})]
    curves = sweep(scenes, speed=np.linspace(0.6, 1.6, 6), model="vacuum")
    assert curves.sizes["member"] == 2
    for k, scene in enumerate(scenes):
        groups = scene.system("vacuum")
        known = towatlas.solve_critical(groups.lam, groups.w_f, [1, 2, 3]).gamma * scene.speed / scene.gamma
        jumps = curves.jump.values[k][np.isfinite(curves.jump.values[k])]
        np.testing.assert_allclose(jumps, known[(known > 0.6) & (known < 1.6)], rtol=1e-9)
        for i, speed in enumerate(curves.speed.values):
            shapes = towatlas.equilibria(groups.lam, groups.w_f, scene.at(speed=float(speed)).gamma)
            expected = curves.r_f.values[k, i][curves.expected.values[k, i].astype(bool)]
            assert expected == pytest.approx([shapes.r_f[shapes.expected] * scene.radius], rel=1e-8)


def test_bad_input(deep):
    scene = read_scene(deep)
    for more, match in (
        ({}, "exactly one of length and speed"),
        ({"length": [1, 2], "speed": [1, 2]}, "exactly one of length and speed"),
        ({"length": [5.0]}, "2 to 100,000 different positive numbers"),
        ({"length": [5.0, -1.0]}, "different positive numbers"),
        ({"speed": [1.0, 2.0], "model": "mud"}, "model must be one of"),
    ):
        with pytest.raises(ValueError, match=match):
            sweep(scene, **more)
    with pytest.raises(ValueError, match="one scene or more"):
        sweep([], length=[1, 2])


def test_changes_of_a_scene(deep):
    changed = read_scene(deep, {"tow.gamma": "0.02", "fish.mass": "100 lb", "title": "another"})
    assert (changed.gamma, changed.title) == (pytest.approx(0.02), "another")
    assert changed.fish_mass == pytest.approx(45.359237)
    with pytest.raises(ValueError, match=r"cable\.colour"):
        read_scene(deep, {"cable.colour": "red"})
    assert make_scene({**read_table(deep)}).source == ""
    with pytest.raises(SceneFileError):
        read_scene(deep.parent / "none.toml", {})


def read_table(path):
    import tomllib

    return tomllib.loads(path.read_text())


def test_shell(capsys, deep, tmp_path):
    code, out, err = run(capsys, "sweep", deep, "--length", "2.6R:2.75R", "--points", 7, "--json")
    rows = json.loads(out)
    assert code == 0
    assert [key for key in rows[0] if key != "schema_version"] == ROW
    assert "jumps at length 8103.7" in err
    lengths = {row["length"] for row in rows}
    assert len(lengths) == 7
    assert all(row["lam"] == pytest.approx(row["length"] / 3048.0) for row in rows)
    assert len(rows) == sum({row["length"]: row["shapes"] for row in rows}.values())
    code, out, err = run(capsys, "sweep", deep, "--speed", "4kn:6kn", "--set", "fish.mass=100lb,250lb", "--points", 3)
    table = list(csv.DictReader(out.splitlines()))
    assert (code, {row["member"] for row in table}) == (0, {"fish.mass = 100lb", "fish.mass = 250lb"})
    assert [round(float(row["speed"]), 4) for row in table[:1]] == [2.0578]
    for name, least in (("a.csv", 500), ("a.nc", 10_000), ("a.svg", 10_000)):
        path = tmp_path / name
        assert run(capsys, "sweep", deep, "--length", "2.6R:2.75R", "--points", 5, "--out", path)[0] == 0
        assert path.stat().st_size > least
    import xarray

    with xarray.open_dataset(tmp_path / "a.nc") as curve:
        assert curve.sizes["value"] == 5
    for bad, match in (
        (("--length", "1R:5R", "--speed", "1:2"), "exactly one of --length and --speed"),
        (("--length", "5R:1R"), "from a positive value to a larger one"),
        (("--length", "1R:2R:3R"), "two values, as A:B"),
        (("--length", "1kg:5kg"), "--length"),
        (("--length", "1R:5R", "--set", "fish.mass"), "as KEY=VALUE"),
        (("--length", "1R:5R", "--set", "cable.colour=red"), "cable.colour"),
        (("--length", "1R:5R", "--speed", "1,2", "--set", "fish.mass=1,2"), "one list makes a family"),
        (("--length", "1R:5R", "--points", "1"), "2 or more"),
        (("--length", "1R:5R", "--out", "a.xls"), "the ending must be one of"),
    ):
        code, _, err = run(capsys, "sweep", deep, *bad)
        assert (code, match in err) == (2, True), (bad, err)
