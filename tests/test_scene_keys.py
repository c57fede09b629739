"""Keys of a scene beyond the report's: forces along and aside, types of cable, spheres, circles; what is said."""

import io
import json
import math
import re
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers import changed, run

from towatlas import read_scene
from towatlas.commands.scene import text_of
from towatlas.report.dtmb713.data import points
from towatlas.scene.angles import angles_along
from towatlas.scene.choice import least_model
from towatlas.scene.file import SceneFileError, make_scene
from towatlas.scene.jumps import answer_scene
from towatlas.scene.library import find_type
from towatlas.scene.models import solve_model
from towatlas.scene.units import parse_quantity

FOOT, POUND, GRAVITY = 0.3048, 0.45359237, 9.80665
HANGS = ("nodes", "position", "tension")
SIDE = {"cable__side_force_coefficient": 0.18, "cable__side_force_sine": 0.2, "cable__kites": "starboard"}
ALONG = {"cable__tangential_drag_coefficient": 0.02, "cable__tangential_drag_on": "d"}
TYPES = "ABCDEFGH"


def typed(name="pode-G", **changes):
    """The wet scene with a type of cable, towed to port."""
    own = {f"cable__{key}": None for key in ("mass_per_length", "diameter", "drag_coefficient")}
    return changed(**own, cable__type=name, tow__turn="port", **changes)


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        ("0.1 m2", "m^2", 0.1),
        ("2 ft3", "m^3", 2 * FOOT**3),
        ("1025 kg/m3", "kg/m^3", 1025),
        ("9.81 m/s2", "m/s^2", 9.81),
        ("1 lbm", "kg", POUND),
        ("2 Kg", "kg", 2),
        ("40 RPM", "rad/s", 4 * math.pi / 3),
        ("76 lb/1000 ft", "kg/m", 0.076 * POUND / FOOT),
        ("76 lbf/1000ft", "N/m", 0.076 * POUND * GRAVITY / FOOT),
        ("6 deg/min", "rad/s", math.pi / 1800),
        ("30 deg", "rad", math.pi / 6),
        ("2 min", "s", 120),
    ],
)
def test_units(value, unit, expected):
    assert parse_quantity("key", value, unit) == pytest.approx(expected, rel=4e-16)


@pytest.mark.parametrize(
    ("value", "unit", "match"),
    [
        ("3 nm", "m", "nm may be a nanometre or a nautical mile: write nanometer or nmi"),
        ("3 nm/h", "m/s", "nm may be"),
        ("3 gr/ft", "kg/m", "gr may be a grain or a gram: write grain or g"),
        (30, "rad", 'key = 30: degrees or radians? Write it as "30 deg"'),
        ("30", "rad", 'it has no unit; write "30 deg"'),
        ("76 lb/1000 kg", "kg/m", "is not a mass per length"),
    ],
)
def test_bad_units(value, unit, match):
    with pytest.raises(ValueError, match=re.escape(match)):
        parse_quantity("key", value, unit)


def test_groups_by_hand():
    """C_t and C_s as C, with their own coefficients; in the dense model alone."""
    scene = make_scene(changed(**ALONG, **SIDE, tow__turn="port"))
    water = scene.system("water")
    assert (water.C_t / water.C, water.C_s / water.C) == pytest.approx((0.02 / 1.4, 0.18 / 1.4), rel=1e-14)
    assert (water.b_s, scene.turn) == (0.2, "port")
    assert scene.gamma == pytest.approx(-2.0 / math.sqrt(40 * GRAVITY), rel=1e-14)
    for model in ("vacuum", "air"):
        less = scene.system(model)
        assert (less.C_t, less.C_s, less.b_s) == (0.0, 0.0, math.inf)
    around = make_scene(changed(**ALONG | {"cable__tangential_drag_on": "pi d"}))
    assert around.system("water").C_t == pytest.approx(math.pi * water.C_t, rel=1e-14)
    assert make_scene(changed(**SIDE | {"cable__kites": "port"}, tow__turn="port")).system("water").C_s == -water.C_s
    linear = changed(**SIDE, tow__turn="port")
    del linear["cable"]["side_force_sine"]
    assert make_scene(linear).system("water").b_s == math.inf
    # Without a force neither side nor turn is asked for, nor in a vacuum.
    assert make_scene(changed(cable__side_force_coefficient=0)).system("water").C_s == 0.0
    assert make_scene(changed(**SIDE, fluid={"name": "vacuum"})).system("water").C_s == 0.0


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"cable__tangential_drag_coefficient": 0.02}, 'cable.tangential_drag_on is missing: write "d" if'),
        ({"cable__tangential_drag_on": "d"}, "cable.tangential_drag_coefficient is missing"),
        (ALONG | {"cable__tangential_drag_on": "2 d"}, 'cable.tangential_drag_on = \'2 d\' must be "d" or "pi d"'),
        (SIDE | {"cable__kites": "left", "tow__turn": "port"}, 'cable.kites = \'left\' must be "starboard" or "port"'),
        ({"tow__turn": 3}, 'tow.turn = 3 must be "starboard" or "port"'),
        (SIDE, 'tow.turn is missing: write "starboard" or "port"'),
        ({"cable__side_force_coefficient": 0.18, "tow__turn": "port"}, "cable.kites is missing"),
        ({"cable__side_force_sine": 0.18}, "cable.side_force_coefficient is missing"),
        ({"cable__type": "pode-Z"}, 'cable.type = "pode-Z" is unknown; known are pode-A, pode-B'),
        ({"cable__library": "mine.toml"}, "cable.type is missing: which of the cables"),
        ({"cable__submerged_weight_per_length": 5}, "is more than the weight of cable.mass_per_length"),
        (
            {"cable__submerged_weight_per_length": 3, "fluid": {"name": "vacuum"}},
            "are both given, and in a vacuum both are the mass of the cable",
        ),
        ({"cable__mass_per_length": "5 N/m"}, "or give the weight in the fluid as cable.submerged_weight_per_length"),
        (
            {"cable__mass_per_length": None, "cable__submerged_weight_per_length": "0.5 kg/m"},
            "not a force per length but a mass; write kgf/m or lbf/ft for the weight of a mass, or give the mass in "
            "air as cable.mass_per_length",
        ),
        (
            {"fish__mass": "600 N"},
            "a weight; write kg or lb for the mass, or give the weight in the fluid as fish.sub",
        ),
        ({"fish__mass": None, "fish__submerged_weight": "40 kg"}, "or give the mass in air as fish.mass"),
        ({"fish__weight": 3}, "do you mean fish.mass, in air, or fish.submerged_weight?"),
        ({"cable__weight_per_length": 3}, "do you mean cable.mass_per_length, in air, or"),
        (
            {"tow__radius": None},
            "tow.radius is missing: the radius of the circle that the tow point moves on; tow",
        ),
        ({"tow__radius": None, "tow__rpm": 1, "tow__period": 3}, "tow.radius is missing"),
        ({"tow__period": 60}, "tow.speed and tow.period are both given, and both are the speed"),
        ({"tow__radius": None, "tow__period": 1e-320}, "make a circle of 0 m"),
        ({"tow__speed": None, "tow__period": 1e-320}, "a speed of inf m/s"),
        ({"tow__speed": None, "tow__bank_angle": "90 deg"}, "tow.bank_angle must be less than 90 degrees"),
        ({"tow__speed": None, "tow__bank_angle": 30}, "tow.bank_angle = 30: degrees or radians?"),
    ],
)
def test_bad_keys(changes, match):
    with pytest.raises(ValueError, match=re.escape(match)):
        make_scene(changed(**changes))


def test_mass_and_weight_together():
    """What the cable displaces follows, and is not its circle."""
    scene = make_scene(changed(cable__submerged_weight_per_length=0.42 * GRAVITY))
    assert scene.displaced_per_length == pytest.approx(0.08, rel=1e-13)
    water = scene.system("water")
    drag = 0.5 * 1025 * 1.4 * 0.012 * 40
    assert (water.w, water.C) == pytest.approx((0.42 / 0.58, drag / 0.58), rel=1e-14)


def test_a_sphere():
    volume, area = math.pi * 0.3**3 / 6, math.pi * 0.3**2 / 4
    keys = {"volume": None, "added_mass": None, "frontal_area": None}
    ball = make_scene(changed(fish__diameter=0.3, **{f"fish__{key}": value for key, value in keys.items()}))
    assert ball.fish_displaced == pytest.approx(1025 * volume, rel=1e-14)
    assert ball.fish_added_mass == pytest.approx(0.5 * 1025 * volume, rel=1e-14)
    assert ball.fish_drag_area == pytest.approx(0.8 * area, rel=1e-14)
    # What is given goes first: here all of it.
    assert make_scene(changed(fish__diameter=0.3)) == make_scene(changed())
    weighed = make_scene(changed(fish__diameter=0.3, fish__volume=None, fish__submerged_weight=40 * GRAVITY))
    assert weighed.fish_displaced == pytest.approx(20, rel=1e-13)
    light = make_scene(changed(fish__diameter=0.3, fish__volume=None, fish__mass=None, fish__submerged_weight=-10))
    assert light.fish_mass == pytest.approx(1025 * volume - 10 / GRAVITY, rel=1e-13)


@pytest.mark.parametrize(
    "tow",
    [
        {"radius": 40, "period": 40 * math.pi},
        {"radius": 40, "bank_angle": f"{math.degrees(math.atan(0.1 / GRAVITY)):.16g} deg"},
        {"radius": 40, "rotation_rate": f"{math.degrees(0.05) * 60:.16g} deg/min"},
        {"speed": 2, "period": 40 * math.pi},
        {"speed": 2, "rotation_rate": 0.05},
        {"speed": 2, "rpm": 1.5 / math.pi},
        {"speed": 2, "bank_angle": f"{math.atan(0.1 / GRAVITY):.17g} rad"},
        {"speed": 2, "gamma": 2 / math.sqrt(40 * GRAVITY)},
    ],
)
def test_circles(tow):
    scene = make_scene(changed(tow=tow))
    assert (scene.radius, scene.speed) == pytest.approx((40, 2), rel=1e-13)


def test_fluids_in_any_case():
    assert make_scene(changed(fluid={"name": "Seawater"})) == make_scene(changed(fluid={"name": "seawater"}))


def test_turns():
    """Without a side force port is the mirror image of starboard; a scene at another speed keeps its turn."""
    one, other = (solve_model(make_scene(changed(**ALONG, tow__turn=turn)), "water") for turn in ("starboard", "port"))
    assert other.position == pytest.approx(one.position * [1, -1, 1], rel=1e-12)
    assert other.tension == pytest.approx(one.tension, rel=1e-12)
    port = make_scene(changed(tow__turn="port"))
    assert port.at(gamma=port.gamma) == port.at(gamma=-port.gamma)
    assert port.at(speed=3.0).gamma == pytest.approx(1.5 * port.gamma, rel=1e-14)
    with pytest.raises(ValueError, match="gamma must be finite and positive"):
        replace(port, turn="starboard").at(gamma=-1.0)


def test_jumps_in_a_turn_to_port():
    """Speeds are positive, their order and the models compared the same, gamma negative."""
    scene = replace(read_scene("skop-fig3"), turn="port")
    one, other = (answer_scene(each, model="air", compare=True) for each in (read_scene("skop-fig3"), scene))
    assert len(one.folds) > 0
    assert other.folds.gamma == pytest.approx(-one.folds.gamma, rel=1e-12)
    assert list(other.folds.shapes_below) == list(one.folds.shapes_below)
    assert list(other.jumps.gamma) == list(one.jumps.gamma)
    quiet = ("nodes", "position")
    assert least_model(scene, asked=quiet).model == least_model(read_scene("skop-fig3"), asked=quiet).model


@pytest.mark.parametrize("letter", TYPES)
def test_laws_of_the_library_are_those_of_its_points(letter):
    """Recomputed from Table 2 of DTMB Report 713: means, medians, a least squares fit that nothing nearby betters."""
    cable, data = find_type(f"pode-{letter}"), points(letter)
    values, sd = cable.values, cable.deviations
    assert values["drag_coefficient"] == pytest.approx(data.ratio.mean(), abs=0.0006)
    assert sd["drag_coefficient"] == pytest.approx(data.ratio.std(ddof=1), abs=0.006)
    assert values["tangential_drag_coefficient"] == np.median(data.C_f)
    assert sd["tangential_drag_coefficient"] == pytest.approx(data.C_f.std(ddof=1), rel=0.25)
    assert cable.angles_deg == pytest.approx((data.phi_deg.min(), data.phi_deg.max()), rel=1e-12)
    a, b = values["side_force_coefficient"], values.get("side_force_sine", math.inf)

    def residual(a, b):
        return float(np.sum((a * data.sin_phi / (1 + (data.sin_phi / b) ** 2) - data.C_s) ** 2))

    best = residual(a, b)
    assert best < min(residual(a * x, b * y) for x in (0.98, 1.0, 1.02) for y in (0.98, 1.02)) or b == math.inf
    assert best < min(residual(a * x, b) for x in (0.98, 1.02))
    assert sd["side_force"] == pytest.approx(math.sqrt(best / (len(data.C_s) - (1 if b == math.inf else 2))), rel=0.25)


@pytest.mark.parametrize("letter", TYPES)
def test_cables_trail_as_measured(letter):
    """A cable alone on a great circle is the straight one of the report: its direction, at every speed, in degrees."""
    data = points(letter)
    table = typed(f"pode-{letter}", fish=None, fluid__density="1.934 slug/ft3", cable__length="60 ft")
    off = []
    for speed, down, aside in zip(data.speed, data.m, data.n, strict=True):
        scene = make_scene(table | {"tow": {"radius": "1000 km", "speed": f"{speed} kn", "turn": "starboard"}})
        x, y, z = solve_model(scene, "water").position
        # The tow point moves along y, and starboard is inwards.
        trailed = np.array([-y, z, scene.radius - x]) / scene.length
        assert np.linalg.norm(trailed) == pytest.approx(1.0, rel=1e-5)
        measured = np.array([math.sqrt(1.0 - down**2 - aside**2), down, aside])
        off.append(math.degrees(np.linalg.norm(trailed - measured)))
    assert math.sqrt(np.mean(np.square(off))) < 0.5


def test_a_type_of_cable():
    scene = make_scene(typed())
    area = (0.0314 - 0.0268) * POUND / FOOT / (1.934 * 515.3788184)
    assert scene.mass_per_length == pytest.approx(0.0314 * POUND / FOOT, rel=1e-14)
    assert scene.displaced_per_length == pytest.approx(1025 * area, rel=1e-8)
    assert (scene.diameter, scene.drag_coefficient) == (0.003175, 1.229)
    assert (scene.tangential_drag_coefficient, scene.side_force_coefficient) == (0.024, 0.1835)
    assert scene.cable_type.name == "pode-G"
    # A key of the scene goes first, with those that say one thing with it.
    kites = make_scene(typed(cable__kites="port"))
    assert kites.side_force_coefficient == -0.1835
    assert make_scene(typed(cable__side_force_coefficient=0.1)).side_force_sine == math.inf
    heavy = make_scene(typed() | {"cable": {"length": 9, "type": "pode-G", "diameter": 0.01, "mass_per_length": 0.5}})
    assert heavy.displaced_per_length == pytest.approx(1025 * math.pi * 25e-6, rel=1e-14)
    with pytest.raises(ValueError, match="tangential_drag_on is missing"):
        make_scene(typed(cable__tangential_drag_coefficient=0.02))
    table = typed()
    table["cable"]["diameter"] = 0.01
    with pytest.raises(ValueError, match=r"cable\.diameter is given, and the mass of pode-G is that of its own"):
        make_scene(table)
    del table["tow"]["turn"]
    del table["cable"]["diameter"]
    with pytest.raises(ValueError, match=r"tow\.turn is missing"):
        make_scene(table)


MINE = """
[fine]
diameter = "2 mm"
submerged_weight_per_length = 0.1
weighed_in = "1000 kg/m3"
drag_coefficient = 1.2
"""


def test_own_library(tmp_path):
    (tmp_path / "mine.toml").write_text(MINE + "[pode-G]\ndiameter = 1\n")
    found = find_type("fine", "mine.toml", tmp_path)
    assert found.values["mass_per_length"] == pytest.approx(0.1 / GRAVITY + math.pi * 1e-3, rel=1e-14)
    assert (found.angles_deg, found.deviations, found.source) == (None, {}, "")
    assert find_type("pode-G", "mine.toml", tmp_path).values == {"diameter": 1.0}
    assert find_type("pode-A", "mine.toml", tmp_path).name == "pode-A"
    scene = tmp_path / "scene.toml"
    scene.write_text(
        "[cable]\ntype = 'fine'\nlibrary = 'mine.toml'\n[tow]\nradius = 1\nrpm = 9\n[fluid]\nname = 'water'\n"
    )
    assert read_scene(scene).displaced_per_length == pytest.approx(math.pi * 1e-3, rel=1e-14)
    (tmp_path / "mine.toml").unlink()
    with pytest.raises(SceneFileError, match=r"no library of cables at mine\.toml"):
        read_scene(scene)


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("fine = 3", "mine.toml, fine: it is not a table; write [fine]"),
        ("[fine]\ncolour = 3", "mine.toml, fine: key colour is unknown; known are mass_per_length"),
        ("[fine]\ndiameter = '3 kg'", "mine.toml, fine: diameter = '3 kg' is not a length"),
        ("[fine]\nangle_min = '3 deg'", "angle_min and angle_max go together, the smaller one first"),
        ("[fine]\nangle_min = '3 deg'\nangle_max = '2 deg'", "the smaller one first"),
        ("[fine]\nsubmerged_weight_per_length = 3", "and weighed_in, the density of that water, go together"),
        ("[fine]\nsubmerged_weight_per_length = 3\nweighed_in = 1000", "diameter is missing"),
        (
            "[fine]\nsubmerged_weight_per_length = 3\nweighed_in = 1000\nmass_per_length = 0.1",
            "more than the weight of mass_per_length",
        ),
    ],
)
def test_bad_libraries(tmp_path, text, match):
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(ValueError, match=re.escape(match)):
        find_type("fine", "mine.toml", tmp_path)


@pytest.fixture(scope="module")
def stranded():
    """The cable-body system of 2000 yards with the laws of pode-G, towed to either side."""
    cable = {"length": "6000 ft", "type": "pode-G", "mass_per_length": "0.3 lb/ft", "diameter": "0.5 in"}
    cable |= {"drag_coefficient": 1.23, "tangential_drag_coefficient": 0.025, "tangential_drag_on": "d"}
    fish = {"mass": "250 lb", "diameter": "1.2 ft", "drag_coefficient": 0.2}
    table = {"cable": cable, "fish": fish, "fluid": {"name": "Seawater"}}
    tow = {"radius": "3000 ft", "speed": "5 kn"}
    return {side: make_scene(table | {"tow": tow | {"turn": side}}) for side in ("port", "starboard")}


@pytest.mark.parametrize(("turn", "radius"), [("port", 0.646), ("starboard", 0.525)])
def test_turns_of_a_stranded_cable(stranded, turn, radius):
    """Radii of the fish by an independent program (DOP853, SI units); 0.579 without side force."""
    found = solve_model(stranded[turn], "water")
    assert found.equilibria.r_f[found.equilibria.expected] == pytest.approx(radius, abs=6e-4)
    without = solve_model(replace(stranded[turn], side_force_coefficient=0.0), "water")
    assert without.equilibria.r_f[without.equilibria.expected] == pytest.approx(0.579, abs=6e-4)


def test_the_comparison_judges_models_without_side_force(stranded):
    choice = least_model(stranded["port"], asked=HANGS)
    assert choice.model == "water"
    assert "air differs from water in position of the fish" in choice.reason
    assert {answer.system.C_s for answer in choice.answers if answer.model != "water"} == {0.0}


def test_extrapolated(stranded):
    answer = answer_scene(stranded["port"], model="water", asked=HANGS)
    (angles,) = answer.angles
    assert angles.extrapolated
    assert 9.2 < angles.lowest < angles.highest < 90.0
    assert "extrapolated: pode-G was measured at 1.3 to 9.2 degrees" in answer.notes[0]
    text = text_of(answer, compare=True)
    assert "expected  extrapolated" in text
    assert "cable pode-G: DTMB Report 713" in text
    assert re.search(r"^C_s +0 +0 +\d", text, re.M)
    assert re.search(r"^b_s +- +- +0.1802", text, re.M)
    # Towed alone along a great circle the cable trails where it was measured.
    bare = replace(stranded["port"], fish_mass=0.0, fish_displaced=0.0, fish_added_mass=0.0, fish_drag_area=0.0)
    known = replace(bare.cable_type, angles_deg=(0.5, 90.0))
    found = solve_model(bare, "water").equilibria
    assert not angles_along(replace(bare, cable_type=known), found, found.expected).extrapolated
    assert angles_along(replace(bare, cable_type=None), found, found.expected) is None


def test_angles_of_a_straight_cable():
    """A light cable alone at a great radius is straight, at the angle where weight and normal drag are in balance."""
    known = replace(find_type("pode-G"), angles_deg=(1.0, 2.0))
    scene = make_scene(changed(fish=None, tow={"radius": 4e5, "speed": 2.0}, cable__length=100))
    found = solve_model(scene, "water").equilibria
    angles = angles_along(replace(scene, cable_type=known), found, found.expected)
    weight, drag = scene.system("water").w, scene.system("water").C * scene.gamma**2
    # w cos(phi) = C gamma^2 sin(phi)^2
    cosine = (-weight + math.hypot(weight, 2 * drag)) / (2 * drag)
    assert (angles.lowest, angles.highest) == pytest.approx([math.degrees(math.acos(cosine))] * 2, rel=2e-3)
    assert (angles.inside, angles.extrapolated) == (0.0, True)


SHELL = """
[cable]
length = 1.5
mass_per_length = 0.5
diameter = "2e-10 m"
drag_coefficient = 1.4
tangential_drag_coefficient = 0.02
tangential_drag_on = "d"
[fish]
mass = 1
volume = 1e-4
[tow]
radius = 1
speed = 1
[fluid]
name = "{}"
"""


@pytest.mark.parametrize(
    ("fluid", "model", "left_out"),
    [
        ("water", "air", "the air model leaves out cable.tangential_drag_coefficient, fish.volume"),
        (
            "water",
            "vacuum",
            "the vacuum model leaves out cable.drag_coefficient, cable.tangential_drag",
        ),
        (
            "vacuum",
            "vacuum",
            "in a vacuum nothing depends on cable.drag_coefficient, cable.tangential_drag",
        ),
    ],
)
def test_what_is_not_used_is_said(capsys, monkeypatch, fluid, model, left_out):
    """And a scene comes through a pipe."""
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(SHELL.format(fluid).encode())))
    arguments = ("scene", "-", "--model", model, "--asked", "position", "--json")
    code, out, err = run(capsys, *arguments)
    answer = json.loads(out)
    assert (code, answer["file"], answer["turn"], answer["cable"]) == (0, "-", "starboard", None)
    for note in answer["notes"]:
        assert f"towatlas: {note}\n" in err
    assert any(note.startswith(left_out) for note in answer["notes"])
    assert "cable.diameter = '2e-10 m' is 2e-10 m: is its unit the right one?" in err
    assert ("fish.drag_coefficient is not given: the fish has no drag" in err) == (fluid == "water")
    assert answer["equilibria"][0]["extrapolated"] is None


def test_bad_scenes_through_a_pipe(capsys, monkeypatch):
    for content, expected in ((b"[tow", (5, "- is not valid TOML")), (b"[tow]\nzzz = 3", (2, "-: key tow.zzz"))):
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(content)))
        code, _, err = run(capsys, "scene", "-")
        assert code == expected[0]
        assert expected[1] in err


def test_nothing_is_said_of_what_a_larger_model_confirmed():
    scene = make_scene(changed(tow__speed=0.005, **ALONG))
    answer = answer_scene(scene, asked=("nodes",))
    assert (answer.choice.model, answer.notes) == ("vacuum", [])
    untried = make_scene(changed(fluid={"name": "air"}, fish__volume=None, tow__speed=0.5, **ALONG))
    assert answer_scene(untried, asked=("nodes",)).notes == [
        "the air model leaves out cable.tangential_drag_coefficient, fish.added_mass"
    ]


def test_design_says_so_too(capsys, tmp_path):
    page = (Path(__file__).parent.parent / "docs" / "scenes.md").read_text()
    scene = tmp_path / "survey.toml"
    scene.write_text(page.split("```toml\n")[2].split("```")[0].replace("drag_coefficient = 0.4\n", ""))
    assert make_scene(tomllib.loads(scene.read_text())).turn == "port"
    arguments = ("design", "--scene", scene, "--depth", "20 m", "--max-length", "100 m")
    code, out, err = run(capsys, *arguments, "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["notes"][0].startswith("fish.drag_coefficient is not given")
    assert answer["notes"][1].startswith("extrapolated: pode-G")
    assert all(note in err for note in answer["notes"])


def test_a_cable_of_no_material_is_asked_about():
    """Grams and millimetres without their units."""
    table = {
        "cable": {"length": 100.0, "mass_per_length": 0.02, "diameter": "2 mm"},
        "fish": {"mass": 1.0},
        "tow": {"radius": 10.0, "speed": 10.0},
        "fluid": {"name": "vacuum"},
    }
    assert not make_scene(table).notes
    for change in ({"mass_per_length": 20.0}, {"diameter": 2.0}):
        (note,) = make_scene(table | {"cable": table["cable"] | change}).notes
        assert note.startswith("cable.mass_per_length = ")
        assert note.endswith("kg/m^3: are their units the right ones?")


def test_a_circle_that_followed_from_a_speed_stays_and_is_told():
    table = {
        "cable": {"length": 100.0, "mass_per_length": 0.02, "diameter": "2 mm"},
        "fish": {"mass": 1.0},
        "tow": {"bank_angle": "25 deg", "speed": 46.3},
        "fluid": {"name": "vacuum"},
    }
    scene = make_scene(table)
    faster = scene.at(speed=50.0)
    assert faster.radius == scene.radius
    (note,) = faster.notes
    radius = f"tow.radius is {scene.radius:.6g} m"
    assert note == f"the circle stays at another speed: {radius}, as tow.speed and tow.bank_angle made it"
    assert faster.at(speed=51.0).notes == faster.notes


@pytest.mark.parametrize("command", [("sweep", "skop-fig3"), ("diagram", "skop-fig3"), ("scene", "skop-fig3")])
def test_ends_of_a_range_have_units_both_or_neither(capsys, tmp_path, command):
    ask = "--seen" if command[0] == "scene" else "--speed"
    code, _, err = run(capsys, *command, ask, "1.2:1.3kn", *(("--out", tmp_path / "a.svg") if ask == "--speed" else ()))
    assert code == 2
    assert "what unit is 1.2 in?" in err
