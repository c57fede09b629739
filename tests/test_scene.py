"""Scenes: units, keys, groups, and the command that answers for one."""

import json
import math
import os
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from helpers import WET, changed, run

import towatlas
from towatlas.scene import choice as scene_choice
from towatlas.scene import jumps as scene_jumps
from towatlas.scene import keys as scene_keys
from towatlas.scene.file import SceneFileError, make_scene, read_scene, shipped_scenes
from towatlas.scene.jumps import critical_speeds
from towatlas.scene.models import solve_model
from towatlas.scene.scene import MODELS
from towatlas.scene.units import parse_quantity

DOCS = Path(__file__).parent.parent / "docs" / "scenes.md"


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (3, "m", 3.0),
        ("11/16 in", "m", 11 * 0.0254 / 16),
        ("1 1/2 in", "m", 0.0381),
        ("1.5/2 ft", "m", 0.2286),
        (" 120m ", "m", 120.0),
        ("1e2 cm", "m", 1.0),
        ("-3 N", "N", -3.0),
        ("0.1824 g/ft", "kg/m", 0.0001824 / 0.3048),
        ("3 kn", "m/s", 3 * 1852 / 3600),
        ("40 rpm", "rad/s", 40 * 2 * math.pi / 60),
        ("2 rev/s", "rad/s", 4 * math.pi),
        ("90 deg/s", "rad/s", math.pi / 2),
        ("2 kgf/m", "N/m", 2 * 9.80665),
        ("10 lbf", "N", 10 * 0.45359237 * 9.80665),
        ("62.4 lb/ft^3", "kg/m^3", 62.4 * 0.45359237 / 0.3048**3),
        ("12 l", "m^3", 0.012),
        ("1 %", "", 0.01),
        ("1.2", "", 1.2),
    ],
)
def test_units(value, unit, expected):
    assert parse_quantity("key", value, unit) == pytest.approx(expected, rel=4e-16)


@pytest.mark.parametrize(
    ("value", "unit", "match"),
    [
        ("3 kg", "m", "key = '3 kg' is not a length; write it as"),
        ("3", "m", "it has no unit"),
        ("3 furlungs", "m", "unit 'furlungs' is unknown"),
        ("3 m m(", "m", "is unknown"),
        ("three m", "m", "is not a length; write a number and its unit"),
        ("3 kg", "N", "not a force but a mass; write kgf or lbf"),
        ("3 g/ft", "N/m", "not a force per length but a mass; write kgf/m"),
        ("2 Hz", "rad/s", "turns or radians; write rpm, rev/s or rad/s"),
        ("2 kn", "rad/s", "is not a rate of rotation"),
        ("2 rad", "", "is not a pure number"),
        ("20 degC", "", "is not a pure number"),
        ("1/0 in", "m", "is not finite"),
        ("1e999 m", "m", "is not finite"),
        (math.nan, "m", "is not finite"),
        (True, "m", "True is not a length"),
        ([3], "m", "is not a length"),
    ],
)
def test_bad_units(value, unit, match):
    with pytest.raises(ValueError, match=re.escape(match)):
        parse_quantity("key", value, unit)


@pytest.mark.parametrize(
    ("name", "lam", "w_f", "gamma"),
    [("skop-fig3", 37.8, 1352, 2.97), ("skop-fig4", 52.4, 1352, 2.46), ("skop-fig5", 52.4, 1571, 2.60)],
)
def test_systems_of_the_report(name, lam, w_f, gamma):
    """As printed under Figs. 3 to 5 of NRL Report 7048, whose fluid has no buoyancy."""
    test = read_scene(name)
    assert test.medium == "air"
    groups = test.system("air")
    assert (round(groups.lam, 1), round(groups.w_f), round(groups.C, 3)) == (lam, w_f, 0.018)
    assert (groups.w, groups.m_f, groups.C_f) == (1.0, groups.w_f, 0.0)
    assert test.gamma == pytest.approx(gamma, rel=1e-15)
    assert name in shipped_scenes()


def test_groups_by_hand():
    """Eqs. (13), (16), (17) of a wet scene."""
    area = math.pi * 0.012**2 / 4
    unit = 0.5 + 1025 * area
    wet = make_scene(WET)
    assert wet.medium == "water"
    expected = {
        "w": (0.5 - 1025 * area) / unit,
        "C": 0.5 * 1025 * 1.4 * 0.012 * 40 / unit,
        "lam": 3.75,
        "w_f": (60 - 20.5) / (unit * 40),
        "m_f": 70 / (unit * 40),
        "C_f": 0.5 * 1025 * 0.8 * 0.05 / unit,
        "C_t": 0.0,
        "C_s": 0.0,
        "b_s": math.inf,
    }
    assert wet.gamma == pytest.approx(2.0 / math.sqrt(40 * 9.80665), rel=1e-14)
    assert vars(wet.system("water")) == pytest.approx(expected, rel=1e-14)
    thin = {"w": 1.0, "w_f": 60 / 20, "m_f": 60 / 20}
    air = expected | thin | {"C": expected["C"] * unit / 0.5, "C_f": expected["C_f"] * unit / 0.5}
    assert vars(wet.system("air")) == pytest.approx(air, rel=1e-14)
    assert vars(wet.system("vacuum")) == pytest.approx(expected | thin | {"C": 0.0, "C_f": 0.0}, rel=1e-14)
    assert wet.force_unit("water") == pytest.approx(unit * 9.80665 * 40, rel=1e-14)
    with pytest.raises(ValueError, match="model must be one of vacuum, air, water; got 'mud'"):
        wet.system("mud")


@pytest.mark.parametrize(
    "changes",
    [
        {
            "cable__mass_per_length": None,
            "cable__submerged_weight_per_length": (0.5 - 1025 * math.pi * 36e-6) * 9.80665,
        },
        {"fish__volume": None, "fish__submerged_weight": (60 - 20.5) * 9.80665},
        {"fish__mass": None, "fish__submerged_weight": (60 - 20.5) * 9.80665},
        {"tow__speed": None, "tow__rpm": 0.05 * 30 / math.pi},
        {"tow__speed": None, "tow__rpm": "3/200 rev/s", "tow__radius": 40 * 0.05 / (0.03 * math.pi)},
        {"tow__speed": None, "tow__rotation_rate": 0.05},
        {"tow__speed": None, "tow__gamma": 2.0 / math.sqrt(40 * 9.80665)},
        {"tow__speed": "7.2 km/h", "gravity": "1 g_0", "fish__mass": "60000 g", "fluid": {"name": "seawater"}},
    ],
)
def test_other_keys_say_the_same(changes):
    expected = make_scene(changed(tow__radius=changes.get("tow__radius", 40)))
    got = make_scene(changed(**changes))
    for model in MODELS:
        assert vars(got.system(model)) == pytest.approx(vars(expected.system(model)), rel=1e-13)


def test_round_trip_of_speeds():
    wet = make_scene(WET)
    assert wet.at(gamma=wet.gamma).speed == pytest.approx(2.0, rel=1e-15)
    assert wet.at(rotation_rate=wet.rpm_of(wet.gamma) * math.pi / 30).speed == pytest.approx(2.0, rel=1e-15)
    assert wet.at(speed=3.0).gamma == pytest.approx(1.5 * wet.gamma, rel=1e-15)
    with pytest.raises(ValueError, match="exactly one of speed, rotation_rate and gamma, not 2"):
        wet.at(speed=3.0, gamma=1.0)
    with pytest.raises(ValueError, match="not 0"):
        wet.at()
    for bad in ("3 kn", -1.0, 0.0, float("nan")):
        with pytest.raises(ValueError, match="speed must be"):
            wet.at(speed=bad)


def test_medium_by_tolerance():
    assert make_scene(changed(fluid__density=0)).medium == "vacuum"
    assert make_scene(changed(fluid__density=1.2)).medium == "air"
    assert make_scene(changed(fluid__density=1.2, tolerance=1e-5)).medium == "water"
    # A balloon of a fish makes thin air dense.
    assert make_scene(changed(fluid__density=1.2, fish__volume=5)).medium == "water"
    bare = make_scene(changed(fish=None, fluid={"name": "water"})).system("water")
    assert (bare.w_f, bare.m_f, bare.C_f) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"cable__lenght": 3}, "key cable.lenght is unknown; do you mean cable.length?"),
        ({"cable__radius": 3}, "key cable.radius is unknown; do you mean tow.radius?"),
        ({"tow__zzz": 3}, "key tow.zzz is unknown; known are radius, speed"),
        ({"colour": "red"}, "key colour is unknown"),
        ({"fisch": {"mass": 1}}, "section [fisch] is unknown; do you mean fish?"),
        ({"tow": 3}, "tow = 3 is a section; write [tow]"),
        ({"title": 3}, "title = 3 is not a text"),
        ({"cable__length": "3 kg"}, "cable.length = '3 kg' is not a length"),
        ({"cable__length": 0}, "cable.length = 0 is zero"),
        ({"fish__mass": -1}, "fish.mass = -1 is negative"),
        ({"tow__radius": None}, "tow.radius is missing"),
        ({"tow__speed": None}, "the speed of the tow point is missing: give one of tow.speed, tow.rpm"),
        ({"tow__rpm": 3}, "tow.speed and tow.rpm are both given, and both are the speed of the tow point"),
        ({"cable__mass_per_length": None}, "the mass of the cable is missing"),
        ({"cable__submerged_weight_per_length": 5}, "more than the weight of cable.mass_per_length"),
        ({"cable__diameter": None}, "cable.diameter is missing: in a fluid"),
        ({"cable__drag_coefficient": None}, "cable.drag_coefficient is missing: in a fluid"),
        ({"fluid__name": "air"}, "fluid.name and fluid.density are both given"),
        ({"fluid": {"name": "lava"}}, "fluid.name = 'lava' is unknown; known are vacuum, air, water, seawater"),
        ({"fluid": None}, "the fluid is missing"),
        ({"fish__volume": None}, "fish.volume or fish.submerged_weight is missing"),
        ({"fish__mass": None, "fish__volume": None}, "fish.mass is missing; without a fish"),
        ({"fish__mass": None, "fish__volume": None, "fish__submerged_weight": 3}, "only together with fish.volume"),
        ({"fish__submerged_weight": 3}, "each follows from the other two"),
        (
            {"fish__submerged_weight": 3, "fish__volume": None, "fluid": {"name": "vacuum"}},
            "fish.mass and fish.submerged_weight are both given, and in a vacuum both are the mass",
        ),
        ({"fish__volume": None, "fish__submerged_weight": 1e4}, "more than the weight of fish.mass"),
        ({"fish__mass": None, "fish__submerged_weight": -1e4}, "more buoyancy than a fish of fish.volume"),
        ({"cable__mass_per_length": None, "cable__submerged_weight_per_length": -9}, "more buoyancy than a cable"),
        ({"fish__frontal_area": None}, "fish.frontal_area is missing: the drag of the fish needs it"),
    ],
)
def test_bad_keys(changes, match):
    with pytest.raises(ValueError, match=re.escape(match)):
        make_scene(changed(**changes))


def test_files(tmp_path, capsys):
    bad = tmp_path / "bad.toml"
    bad.write_text("[tow\n")
    with pytest.raises(SceneFileError, match=r"bad\.toml is not valid TOML: "):
        read_scene(bad)
    assert run(capsys, "scene", bad)[0] == 5
    bad.write_bytes(b"title = '\xff'")
    with pytest.raises(SceneFileError, match="not a text file in UTF-8"):
        read_scene(bad)
    with pytest.raises(SceneFileError, match="cannot be read"):
        read_scene(tmp_path)
    code, out, err = run(capsys, "scene", tmp_path / "none.toml")
    assert (code, out) == (5, "")
    assert "scenes that come with the package: skop-fig3" in err
    bad.write_text("[tow]\nspeed = '3 kg'\n")
    code, out, err = run(capsys, "scene", bad)
    assert (code, out) == (2, "")
    assert "bad.toml: tow.speed = '3 kg' is not a speed" in err


def test_a_file_goes_before_a_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("skop-fig3").write_text(
        "title = 'mine'\n[cable]\nmass_per_length = 1\n[tow]\nradius = 1\nrpm = 9\n[fluid]\nname = 'vacuum'\n"
    )
    assert read_scene("skop-fig3").title == "mine"


@pytest.fixture
def ask(capsys, atlas_path):
    return lambda *arguments: run(capsys, *arguments, "--atlas", atlas_path)


def test_answers_for_a_scene(ask):
    code, out, _ = ask("scene", "skop-fig3", "--gamma", 3.3, "--json", "--model", "vacuum")
    assert code == 0
    answer = json.loads(out)
    test = read_scene("skop-fig3").at(gamma=3.3)
    groups = test.system("vacuum")
    assert list(answer["groups"]) == ["lam", "w_f", "m_f", "C", "C_f", "w", "C_t", "C_s", "b_s", "gamma"]
    # JSON has no infinity.
    more = {"b_s": None, "gamma": test.gamma}
    assert answer["groups"] == vars(test.system("air")) | more
    assert answer["groups_by_model"]["water"] == vars(test.system("water")) | more
    assert answer["speed"]["speed_m_s"] == pytest.approx(3.3 * math.sqrt(0.0174625 * 9.80665), rel=1e-14)
    assert answer["speed"]["speed_kn"] == pytest.approx(answer["speed"]["speed_m_s"] * 3600 / 1852, rel=1e-14)
    assert answer["speed"]["rpm"] == pytest.approx(answer["speed"]["speed_m_s"] / 0.0174625 * 30 / math.pi, rel=1e-14)
    assert answer["transitions"] == 19
    jumps = answer["critical_speeds"]
    exact = towatlas.solve_critical(groups.lam, groups.w_f, range(1, 7))
    assert [row["n"] for row in jumps] == [1, 2, 3, 4, 5, 6]
    assert [row["gamma"] for row in jumps] == pytest.approx(exact.gamma, rel=1e-9)
    assert {row["source"] for row in jumps} == {"atlas"}
    assert [row["n"] for row in jumps if row["near"]] == [2]
    shapes = towatlas.equilibria(groups.lam, groups.w_f, 3.3)
    force = 0.0001824 / 0.3048 * 9.80665 * 0.0174625
    assert [row["nodes"] for row in answer["equilibria"]] == list(shapes.nodes)
    for name, values in (
        ("x_f_m", shapes.x_f * 0.0174625),
        ("z_f_m", shapes.z_f * 0.0174625),
        ("tension_N", shapes.tension * force),
        ("R_x0_N", shapes.R_x0 * force),
    ):
        assert [row[name] for row in answer["equilibria"]] == pytest.approx(values, rel=1e-13)
    assert [row["expected"] for row in answer["equilibria"]] == [False, True, False]


def test_tables_for_people(ask):
    code, out, err = ask("scene", "skop-fig3", "--rpm", 672.1, "--model", "vacuum")
    assert code == 0
    assert err == "towatlas: the vacuum model leaves out cable.drag_coefficient, fish.volume\n"
    assert "672.1 rpm, gamma = 2.96999" in out
    assert "towed in a nondense fluid" in out
    assert "critical speeds (vacuum model), 6 of 19" in out
    assert "no jump lies within 10 % of the speed" in out
    assert out.count("  expected") == 1
    assert (
        ask("scene", "skop-fig3", "--speed", "2.75 kn", "--model", "vacuum")[1].count("within 10 % of the speed") == 1
    )


def test_all_jumps_about_the_speed_are_listed(ask):
    """Beyond the last transition of the atlas they are solved, and said to be."""
    code, out, _ = ask("scene", "skop-fig3", "--gamma", 30, "--json", "--model", "vacuum")
    rows = json.loads(out)["critical_speeds"]
    assert code == 0
    assert {row["source"] for row in rows[:6]} == {"atlas"}
    assert {row["source"] for row in rows[6:]} == {"solved"}
    assert rows[-1]["gamma"] > 33
    assert sum(row["gamma"] < 30 for row in rows) == len(json.loads(out)["equilibria"]) // 2


def test_without_an_atlas(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr("towatlas.commands.scene.default_path", lambda: tmp_path / "none.nc")
    code, out, _ = run(capsys, "scene", "skop-fig4", "--json", "--model", "vacuum")
    assert code == 0
    assert {row["source"] for row in json.loads(out)["critical_speeds"]} == {"solved"}


def test_an_atlas_of_something_else(capsys, equilibria_path):
    """A file without critical speeds is no reason to answer nothing: they are solved."""
    code, out, _ = run(capsys, "scene", "skop-fig4", "--json", "--model", "vacuum", "--atlas", equilibria_path)
    assert code == 0
    assert {row["source"] for row in json.loads(out)["critical_speeds"]} == {"solved"}


def test_critical_speeds_of_the_vacuum_only_where_it_counts(ask):
    """Null where another model is used and the vacuum is not compared; the same numbers where it is."""
    names = ("transitions", "critical_speeds")
    used, left, compared = (
        json.loads(ask("scene", "skop-fig3", "--json", "--asked", "nodes", *more)[1])
        for more in (("--model", "vacuum"), ("--model", "air"), ("--model", "air", "--compare"))
    )
    assert [left[name] for name in names] == [None, None]
    assert [compared[name] for name in names] == [used[name] for name in names]
    assert used["transitions"] == 19


def test_what_a_vacuum_refuses_is_answered_in_water(monkeypatch):
    """Its critical speeds are not asked for, and a smaller model whose shots take too long is left out, and said."""

    def refuse(**cable):
        raise towatlas.TooMuchWork("too many critical speeds")

    monkeypatch.setattr(scene_jumps, "critical_speeds", refuse)
    wet = make_scene(WET)
    plain = towatlas.answer_scene(wet, asked=("position",))
    assert (plain.choice.model, plain.jumps) == ("water", None)
    with pytest.raises(towatlas.TooMuchWork, match="too many critical speeds"):
        towatlas.answer_scene(wet, asked=("position",), compare=True)

    def impatient(scene, model, *rest):
        if model in refused:
            raise towatlas.TooMuchWork(f"long shots in {model}")
        return solve_model(scene, model, *rest)

    monkeypatch.setattr(scene_choice, "solve_model", impatient)
    refused = {"vacuum", "air"}
    answer = towatlas.answer_scene(wet, asked=("position",))
    assert list(answer.equilibria.r_f) == list(plain.equilibria.r_f)
    assert "vacuum was not tried: it takes too long: long shots in vacuum; air was not tried" in answer.choice.reason
    refused = {"water"}
    with pytest.raises(towatlas.TooMuchWork, match="long shots in water"):
        towatlas.answer_scene(wet, asked=("position",))


def test_a_cable_without_transitions(ask, tmp_path):
    file = tmp_path / "short.toml"
    text = "[cable]\n{}mass_per_length = 1\n[tow]\nradius = 1\nspeed = '2 kn'\n[fluid]\nname = 'vacuum'\n"
    file.write_text(text.format("length = 1.9\n"))
    code, out, err = ask("scene", file)
    assert (code, err) == (0, "")
    assert "too short for a jump" in out
    code, out, _ = ask("scene", file, "--json")
    assert json.loads(out)["critical_speeds"] == []
    file.write_text(text.format(""))
    code, out, err = ask("scene", file)
    assert (code, out) == (2, "")
    assert "cable.length is missing" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--speed", "3 kg"), "'3 kg' is not a speed"),
        (("--speed", "-3"), "-3 is not positive"),
        (("--rpm", "2 Hz"), "turns or radians"),
        (("--gamma", "0"), "not positive"),
        (("--gamma", "1", "--rpm", "3"), "not allowed with"),
    ],
)
def test_usage(ask, arguments, message):
    code, out, err = ask("scene", "skop-fig3", *arguments)
    assert (code, out) == (2, "")
    assert message in err


def test_examples_of_the_page(atlas_path, tmp_path):
    """Its scene is read, its Python and its shell lines run."""
    text = DOCS.read_text()
    scenes = re.findall(r"```toml\n(.*?)```", text, re.S)
    for name, scene_text in zip(("search.toml", "survey.toml"), scenes, strict=True):
        (tmp_path / name).write_text(scene_text)
        assert make_scene(tomllib.loads(scene_text)).medium == "water"
    environment = os.environ | {"TOWATLAS_FILE": str(atlas_path)}
    commands = [[sys.executable, "-c", python] for python in re.findall(r"```python\n(.*?)```", text, re.S)]
    assert len(commands) >= 2
    lines = re.findall(r"^    towatlas (.*)$", text, re.M)
    assert len(lines) >= 4
    commands += [[sys.executable, "-m", "towatlas", *shlex.split(line, comments=True)] for line in lines]
    for command in commands:
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, (command, done.stderr)
        said = (
            "compiling, once after|the vacuum model leaves out|model; jumps at |wrote s|"
            "cable.tangential_drag_coefficient is not given|extrapolated: pode-G was measured at 1.3 to 9.2 degrees"
        )
        assert all(re.search(said, line) for line in done.stderr.splitlines())
    for section, keys in scene_keys.KEYS.items():
        for key in keys:
            assert re.search(rf"^\| `{section}{'.' if section else ''}{key}` \|", text, re.M), (section, key)


def test_lists_are_arrays_of_one_length():
    jumps = critical_speeds(lam=1.5, w_f=0.0, gamma=1.0)
    assert (len(jumps.n), jumps.existing) == (0, 0)
    assert jumps.near(1.0).shape == (0,)
    jumps = critical_speeds(lam=30.0, w_f=1.0, gamma=1.0)
    columns = jumps.n, jumps.gamma, jumps.error, jumps.looked_up, jumps.status, jumps.near(1.0)
    assert {len(column) for column in columns} == {len(jumps.n)} != {0}


def test_units_that_were_read_before_are_read_without_pint(tmp_path, capfd):
    """The same bits, from a file that is made anew where it is damaged, and done without where it cannot be written."""
    code = (
        "import sys; from towatlas.scene.units import parse_quantity as parse;"
        "print(parse('key', '0.1824 g/ft', 'kg/m').hex(), 'pint' in sys.modules)"
    )

    def ask(**more):
        done = subprocess.run(
            [sys.executable, "-c", code], env=os.environ | more, capture_output=True, text=True, check=True
        )
        return done.stdout.split(), done.stderr

    place = {"NUMBA_CACHE_DIR": str(tmp_path)}
    factor = (0.1824 * 0.001 / 0.3048).hex()
    first, said = ask(**place)
    assert (first[1], said) == ("True", "")
    assert float.fromhex(first[0]) == pytest.approx(float.fromhex(factor), rel=4e-16)
    assert ask(**place) == ([first[0], "False"], "")
    (kept,) = (tmp_path / "towatlas").glob("units-*.json")
    kept.write_bytes(kept.read_bytes().replace(b"0.00", b"0.01"))
    again, said = ask(**place)
    assert (again, "is damaged: making it again" in said) == (first, True)
    assert ask(**place) == ([first[0], "False"], "")
    assert ask(NUMBA_CACHE_DIR="/dev/null") == (first, "")
