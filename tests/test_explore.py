"""The page that explores scenes: its numbers beside the package's, and what it does in a browser."""

import base64
import json
import re
import shutil
import subprocess
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from helpers import random_cables

import towatlas
from towatlas.cli import main
from towatlas.effort import patience
from towatlas.explorer.page import SCRIPTS, explorer_page, json_in_html
from towatlas.explorer.tables import POINTS, STEPS, TOLD, table_of, told
from towatlas.kernels import status
from towatlas.scene.derived import FLUIDS
from towatlas.scene.file import read_scene, scene_of_text, shipped_scenes
from towatlas.scene.keys import KEYS
from towatlas.scene.library import find_type, shipped_types
from towatlas.scene.units import parse_quantity
from towatlas.solve.critical import solve_critical

ROOT = Path(__file__).parents[1]
# The page that comes with the documentation, by `make figures`.
SHIPPED = ROOT / "docs" / "explore.html"
NODE = shutil.which("node")
in_node = pytest.mark.skipif(
    NODE is None, reason="node is not installed: numbers of the page are not checked outside it"
)
# Of a page that computes what the package computes by the same method: rounding, amplified next to thresholds.
SAME = 1e-9
SURVEY = """title = "</script><b>survey & co"
[cable]
length = "150 m"
mass_per_length = "0.5 kg/m"
diameter = "12 mm"
drag_coefficient = 1.4
[fish]
mass = "60 kg"
volume = "20 l"
added_mass = "10 kg"
drag_coefficient = 0.5
frontal_area = "0.03 m^2"
[tow]
radius = "40 m"
speed = "4 kn"
[fluid]
name = "seawater"
"""
KNOWN = {
    "keys": KEYS,
    "fluids": FLUIDS,
    "cables": {name: find_type(name).values for name in shipped_types()},
}


def computed(expression, given=None):
    """Value of an expression in the scripts of the page that need no page, of `given` and `known`; nan for null."""
    parts = [(resources.files("towatlas.explorer") / name).read_text() for name in SCRIPTS[:4]]
    about = json.dumps({"given": given, "known": KNOWN})
    ask = f"const {{ given, known }} = {about};\nconsole.log(JSON.stringify({expression}));"
    ran = subprocess.run([NODE, "-"], input="\n".join([*parts, ask]), capture_output=True, text=True, timeout=120)
    assert ran.returncode == 0, ran.stderr
    return json.loads(ran.stdout)


@in_node
def test_critical_speeds_are_those_of_the_package():
    n, w_f, lam = random_cables(400, seed=19)
    ours = solve_critical(lam, w_f, n)
    given = np.column_stack([lam, w_f, n]).tolist()
    theirs = computed("given.map(([lam, wf, n]) => criticalState(lam, wf, n))", given)
    assert (ours.status == status.OK).all()
    for name in ("gamma", "R_x0", "x_f", "z_f", "tension"):
        found = np.array([state[name] for state in theirs])
        np.testing.assert_allclose(found, getattr(ours, name), rtol=SAME, err_msg=name)


@in_node
def test_a_critical_state_guessed_from_a_neighbour_is_the_same():
    guessed = computed("criticalState(20.5, 3, 2, criticalState(20, 3, 2)).gamma")
    assert guessed == pytest.approx(float(solve_critical(20.5, 3, 2).gamma), rel=SAME)


@in_node
def test_there_is_none_at_the_threshold():
    threshold = float(towatlas.threshold_length(0.7, 2))
    assert computed("[criticalState(given, 0.7, 2), criticalState(given * 0.9, 0.7, 2)]", threshold) == [None, None]


def random_systems(rows, seed):
    """Cables with a few shapes, none of them within a thousandth of a fold, where any two methods differ by more."""
    rng = np.random.default_rng(seed)
    while rows:
        w_f = 0.0 if rng.random() < 0.15 else float(10.0 ** rng.uniform(-3, 4))
        lam, gamma = float(10.0 ** rng.uniform(-1, 2)), float(10.0 ** rng.uniform(-1.5, 1))
        folds = solve_critical(lam, w_f, np.arange(1, 30)).gamma
        if np.nansum(folds < gamma) <= 8 and not (np.abs(folds / gamma - 1.0) < 1e-3).any():
            rows -= 1
            yield lam, w_f, gamma


@in_node
def test_equilibria_of_random_cables_are_those_of_the_package():
    systems = list(random_systems(80, seed=4))
    theirs = computed("given.map((one) => equilibria(...one))", systems)
    shapes = 0
    for system, found in zip(systems, theirs, strict=True):
        ours = towatlas.equilibria(*system)
        assert [shape["name"] for shape in found] == list(ours.branch), system
        for name in ("R_x0", "x_f", "tension"):
            values = np.array([shape[name] for shape in found])
            # What rounding makes of either: the package says how much.
            np.testing.assert_allclose(values, getattr(ours, name), rtol=max(SAME, 20 * ours.error.max()), err_msg=name)
        depths = [shape["z_f"] for shape in found]
        np.testing.assert_allclose(depths, ours.z_f, rtol=SAME, atol=SAME * system[0], err_msg=f"z_f of {system}")
        shapes += len(found)
    assert shapes > 200


@in_node
@pytest.mark.parametrize(("system", "branch"), [((37.8, 1352, 5.94), "2 inner"), ((10, 0, 2.0), "1 outer")])
def test_the_shape_drawn_is_that_of_the_package(system, branch):
    drawn = np.array(
        computed(
            f"(() => {{ const s = equilibria(...given).find((one) => one.name === '{branch}');"
            " return curveOf(...given, s); })()",
            system,
        )
    )[::-1]
    # The weight below a point is where it is: T^2 = R_x^2 + (w_f + lam - s)^2, and R_x there is smooth in s.
    curve = towatlas.shape(*system, root=branch, s=np.linspace(0, system[0], 4001))
    assert drawn[0, 0] == pytest.approx(1.0, abs=1e-10)
    assert drawn[-1, 0] == pytest.approx(float(curve.x[-1]), abs=1e-9)
    at = np.interp(drawn[:, 1], curve.z, curve.s)
    # Interpolated between 4001 points.
    assert np.abs(np.interp(at, curve.s, curve.x) - drawn[:, 0]).max() < 1e-4 * system[0]
    assert drawn[0, 2] == pytest.approx(float(curve["T"][0]), rel=1e-9)


# Of jobs, which pause.
VALUE = "((job) => { for (;;) { const part = job.next(); if (part.done) return part.value; } })"
# Two real growth rates, a bare end, many nodes, two windows of one shape.
KNOWN_SYSTEMS = [(10, 1352, 15.7598), (2.5, 0, 2.534), (20, 10, 2.0), (37.8, 1352, 5.94), (37.8, 1352, 12.0)]


@in_node
def test_what_lasts_is_what_the_package_says_or_not_told():
    systems = [*KNOWN_SYSTEMS, *random_systems(60, seed=6)]
    theirs = computed(
        "given.map(([lam, wf, gamma]) => equilibria(lam, wf, gamma).filter((one) => one.n > 0 && !one.outer)"
        f".map((one) => [one.name, one.n, {VALUE}(verdictOf(lam, wf, gamma, one))]))",
        systems,
    )
    kinds = []
    for (lam, w_f, gamma), found in zip(systems, theirs, strict=True):
        if not found:
            continue
        ours = towatlas.stability(lam, w_f, gamma)
        for name, nodes, verdict in found:
            k = list(ours.equilibria.branch).index(name)
            # With more D spans more than 16 digits on the circle: nothing is said rather than something wrong.
            assert (verdict is None) == (nodes > 3), (lam, w_f, gamma, name)
            if verdict is None:
                continue
            assert verdict["kind"] == ours.kind[k], (lam, w_f, gamma, name)
            kinds.append(verdict["kind"])
            if ours.growth[k] > 0.0:
                # Zeros are polished to 1e-10 of s, which is -sigma^2.
                apart = complex(verdict["growth"] - ours.growth[k], verdict["frequency"] - ours.frequency[k])
                assert abs(apart) < 1e-8 * gamma
    assert {"stable", "flutter", "divergence"} <= set(kinds)
    assert len(kinds) > 30


@in_node
def test_a_shape_with_too_many_nodes_is_not_told():
    cable = (69.41, 161.2, 4.0298)
    assert computed(f"{VALUE}(verdictOf(...given, member(...given, 6)))", cable) is None


@in_node
def test_scenes_are_read_as_the_package_reads_them(tmp_path):
    folder = resources.files("towatlas.scene") / "scenes"
    texts = [(folder / f"{name}.toml").read_text() for name in shipped_scenes()] + [SURVEY]
    texts += [
        SURVEY.replace('mass = "60 kg"\n', 'submerged_weight = "40 kgf"\n').replace('"4 kn"', "2.5 # m/s"),
        SURVEY.replace('mass_per_length = "0.5 kg/m"', "submerged_weight_per_length = '0.3 lbf/ft'"),
        SURVEY.replace('radius = "40 m"', 'period = "2 min"'),
        SURVEY.replace('speed = "4 kn"', "rpm = 0.7"),
        SURVEY.replace('speed = "4 kn"', 'bank_angle = "5 deg"').replace('"60 kg"', '"(60 +- 3) kg"'),
        '[cable]\ntype = "pode-G"\nlength = 60\n[fish]\nmass = 8\ndiameter = "15 cm"\n[tow]\nspeed = "4 kn"\n'
        'period = "5 min"\nturn = "port"\n[fluid]\nname = "seawater"\n',
        "gravity = 9.8\ncable.length = 2\ncable.mass_per_length = 1e-3\n[tow]\nradius = 1\ngamma = 2\n"
        '[fluid]\nname = "vacuum"',
    ]
    theirs = computed("given.map((text) => sceneOf(text, known))", texts)
    for text, found in zip(texts, theirs, strict=True):
        ours = scene_of_text(text.encode(), "here")
        for name in ("length", "mass_per_length", "fish_mass", "radius", "speed", "gravity", "density"):
            assert found[name] == pytest.approx(getattr(ours, name), rel=1e-14), (name, text)
        assert found["title"] == ours.title
        assert found["displaced_per_length"] == pytest.approx(ours.displaced_per_length, rel=1e-12)


@in_node
def test_the_drag_left_out_is_that_of_the_package():
    texts = [SURVEY, SURVEY.replace("seawater", "air")]
    cable = 'mass_per_length = "0.5 kg/m"\ndiameter = "12 mm"\ndrag_coefficient = 1.4\n'
    texts.append(SURVEY.replace(cable, 'type = "pode-G"\n').replace("[tow]", '[tow]\nturn = "port"'))
    texts.append(SURVEY.replace("[fish]", 'submerged_weight_per_length = "4 N/m"\n[fish]'))
    texts.append(SURVEY.replace('mass_per_length = "0.5 kg/m"', 'submerged_weight_per_length = "4 N/m"'))
    theirs = computed("given.map((text) => dragConstant(sceneOf(text, known)))", texts)
    ours = [scene_of_text(text.encode(), "here").system("water").C for text in texts]
    assert theirs == pytest.approx(ours, rel=1e-12)
    assert computed("dragConstant(sceneOf(given, known))", SURVEY.replace("seawater", "vacuum")) == 0


QUANTITIES = {
    "m": ["11/16 in", "1 1/2 in", "3 ft", "2 nmi", "12 fathom", "5e-3 km", "120", "7 mm", "3 yd"],
    "kg": ["14.132 g", "2 lb", "3 oz", "1 t", "0.5 slug", "2 grain"],
    "kg/m": ["0.1824 g/ft", "76 lb/1000 ft", "2 kg/km", "1 lb / ft"],
    "m/s": ["3 kn", "2 knots", "5 mph", "4 km/h", "30 ft/min", "10 m/s"],
    "rad/s": ["40 rpm", "6 deg/min", "0.1 rad/s", "2 rev/min", "1 turn/s"],
    "m^3": ["20 l", "1.246 cm^3", "2 ft3", "3 in**3"],
    "m^2": ["0.03 m2", "5 cm^2"],
    "N": ["2 kgf", "3 lbf", "5 kN"],
    "N/m": ["2 kgf/m", "1 lbf/ft"],
    "kg/m^3": ["1.934 slug/ft^3", "1 g/cm^3", "1.025 t/m^3"],
    "s": ["2 min", "5 ms", "1 h"],
    "m/s^2": ["9.81 m/s^2", "32.2 ft/s^2"],
}


@in_node
def test_units_are_those_of_the_package():
    given = [(text, unit) for unit, texts in QUANTITIES.items() for text in texts if not text.isdigit()]
    theirs = computed("given.map(([text, unit]) => quantityOf('it', text, unit))", given)
    ours = [parse_quantity("it", text, unit) for text, unit in given]
    np.testing.assert_allclose(theirs, ours, rtol=1e-14)


BAD = {
    "no TOML": "line 1",
    SURVEY.replace('"150 m"', '"150 kg"'): "cable.length",
    SURVEY.replace('"150 m"', '"150"'): "cable.length",
    SURVEY.replace('"150 m"', '"-150 m"'): "cable.length",
    SURVEY.replace('"150 m"', "0"): "cable.length",
    SURVEY.replace('"150 m"', "true"): "cable.length",
    SURVEY.replace('"150 m"', "nan"): "cable.length",
    SURVEY.replace('"150 m"', '"1e999 m"'): "cable.length",
    SURVEY.replace('"150 m"', '"150 nm"'): "cable.length",
    SURVEY.replace('"150 m"', '"9**9**9 m"'): "cable.length",
    SURVEY.replace('"60 kg"', '"60 N"'): "fish.mass",
    SURVEY.replace("mass_per_length", "mass_per_lenght"): "cable.mass_per_lenght",
    SURVEY.replace("[fish]", "[fsh]"): "fsh",
    SURVEY.replace('radius = "40 m"\n', ""): "tow.radius",
    SURVEY.replace('speed = "4 kn"\n', ""): "tow.speed",
    SURVEY.replace('speed = "4 kn"', 'speed = "4 kn"\nrpm = 2'): "tow.rpm",
    SURVEY.replace('speed = "4 kn"', 'rotation_rate = "2 Hz"'): "tow.rotation_rate",
    SURVEY.replace('speed = "4 kn"', "bank_angle = 3"): "tow.bank_angle",
    SURVEY.replace("seawater", "syrup"): "fluid.name",
    SURVEY.replace('name = "seawater"', ""): "fluid",
    SURVEY.replace('diameter = "12 mm"\n', ""): "cable.diameter",
    SURVEY.replace('mass = "60 kg"\n', ""): "fish.mass",
    SURVEY.replace("[fish]", '[fish]\nsubmerged_weight = "3 N"'): "fish.volume",
    SURVEY.replace("[tow]", "[cable]"): "line",
    SURVEY.replace('length = "150 m"', 'type = "rope"\nlength = 3'): "cable.type",
    "__proto__ = 1\n" + SURVEY: "__proto__",
    SURVEY.replace("[fish]", "[__proto__]"): "__proto__",
    SURVEY.replace('"150 m"', '"150 constructor"'): "cable.length",
    SURVEY.replace("seawater", "constructor"): "fluid.name",
}


@in_node
def test_bad_scenes_are_refused_as_the_package_refuses_them():
    said = computed(
        "given.map((text) => { try { return [sceneOf(text, known), '']; }"
        " catch (error) { return [null, error.constructor.name, error.message]; } })",
        list(BAD),
    )
    for (text, key), (scene, *words) in zip(BAD.items(), said, strict=True):
        with pytest.raises((ValueError, OSError)):
            scene_of_text(text.encode(), "here")
        assert scene is None, text
        assert words[0] == "Error", words
        assert key in words[1], text


@pytest.fixture(scope="module")
def survey():
    scene = scene_of_text(SURVEY.encode(), "survey.toml")
    with patience(120):
        return scene, table_of(scene)


def test_table_of_a_scene_is_its_diagram(survey):
    scene, table = survey
    with patience(120):
        found = towatlas.scene.diagrams.scene_diagram(scene, speed=(table["low"], table["high"]))
    assert table["model"] == found.model == "water"
    assert [branch["name"] for branch in table["branches"]] == [branch.name for branch in found.branches]
    for ours, theirs in zip(found.branches, table["branches"], strict=True):
        # Six digits are kept.
        np.testing.assert_allclose(theirs["r_f"], ours.r_f, rtol=1e-5)
        np.testing.assert_allclose(theirs["tension"], ours.tension, rtol=1e-5)
        assert theirs["between"] == list(ours.between)
    assert scene.gamma == pytest.approx(table["scene"]["speed"] / np.sqrt(40.0 * table["scene"]["gravity"]))


def test_shapes_between_those_of_a_table_are_within_the_width_of_a_line(survey):
    scene, table = survey
    shapes = table["branches"][0]["shapes"]
    whole = np.frombuffer(base64.b64decode(shapes["packed"]), "<i2").reshape(-1, 4, POINTS) / STEPS
    assert len(whole) == len(shapes["value"])
    for k in range(len(whole) - 1):
        speed = 0.5 * (shapes["value"][k] + shapes["value"][k + 1])
        answer = towatlas.answer_scene(scene.at(speed=speed), model="water", asked=("position",))
        curve = answer.shape(s=np.linspace(0.0, scene.length, POINTS))
        x, y, z, tension = 0.5 * (whole[k] + whole[k + 1])
        # What samples between were held to; half as much again for what lies between those.
        within = 1.5 * TOLD
        wide = max(np.abs(curve.x.values).max(), np.abs(curve.y.values).max())
        assert np.abs(x * shapes["width"] - curve.x.values).max() < within * wide
        assert np.abs(y * shapes["width"] - curve.y.values).max() < within * wide
        assert np.abs(z * scene.length - curve.z.values).max() < within * scene.length
        largest = 0.5 * (shapes["largest"][k] + shapes["largest"][k + 1])
        assert np.abs(tension * largest - curve["T"].values).max() < within * largest


def test_what_neighbours_tell_is_left_out():
    value = np.linspace(0.0, 1.0, 11)
    within = np.array(1e-9)
    assert told(value, 3.0 * value, within) == [0, 10]
    kink = np.abs(value - 0.5)
    assert told(value, kink, within) == [0, 5, 10]
    assert told(value[:1], value[:1], within) == [0]


def test_a_turn_to_port_is_the_mirror_image(survey):
    text = SURVEY.replace('speed = "4 kn"', 'speed = "4 kn"\nturn = "port"')
    with patience(120):
        tables = table_of(scene_of_text(text.encode(), "here")), survey[1]
    packed = [base64.b64decode(table["branches"][0]["shapes"]["packed"]) for table in tables]
    port, starboard = (np.frombuffer(one, "<i2").reshape(-1, 4, POINTS) for one in packed)
    assert np.abs(starboard[:, 1]).max() > 1000
    assert np.abs(port[:, 1] + starboard[:, 1]).max() <= 1
    assert np.abs(port[:, 0] - starboard[:, 0]).max() <= 1


def test_a_scene_without_a_length_is_refused():
    scene = scene_of_text(SURVEY.replace('length = "150 m"\n', "").encode(), "here")
    with pytest.raises(ValueError, match=r"cable\.length is missing"):
        table_of(scene)


def test_nothing_embedded_ends_its_element(survey):
    page = explorer_page([survey[1]])
    assert page.count("</script>") == page.count("<script") == 2
    assert "survey & co" not in page
    data = re.search(r'id="known">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    assert json.loads(data[1])["tables"][0]["scene"]["title"] == "</script><b>survey & co"
    assert json.loads(json_in_html("\u2028</SCRIPT>&")) == "\u2028</SCRIPT>&"


def test_the_shipped_page_is_small_and_made_of_the_parts_of_today():
    """All of it but the numbers of its tables, which take a minute: scripts, frame, keys, units, scenes."""
    page = SHIPPED.read_text(encoding="utf-8")
    assert len(page.encode()) < 2e6
    for name in (*SCRIPTS, "page.css"):
        assert (resources.files("towatlas.explorer") / name).read_text(encoding="utf-8") in page, (
            f"make figures: {name}"
        )
    embedded = re.search(r'id="known">(.*?)</script>', page, re.DOTALL)
    assert embedded is not None
    tables = json.loads(embedded[1])["tables"]
    assert explorer_page(tables) == page, "make figures"
    assert [table["name"] for table in tables] == list(shipped_scenes())
    for table in tables:
        scene = read_scene(table["name"])
        assert table["scene"] == {name: getattr(scene, name) for name in table["scene"]}


def test_bad_use_of_the_command_is_said(tmp_path, capsys):
    assert main(["explore", "--out", str(tmp_path / "page.pdf")]) == 2
    assert "must be .html" in capsys.readouterr().err
    assert main(["explore", "--out", str(tmp_path / "page.html"), "--model", "air"]) == 2
    assert "--model is of SCENE" in capsys.readouterr().err
    assert main(["explore", "--out", str(tmp_path / "page.html"), "no-such-scene"]) == 5
    assert not (tmp_path / "page.html").exists()


def test_the_command_writes_the_scene_first(tmp_path, monkeypatch, survey):
    # Tables of all scenes take a minute: one stands for each.
    monkeypatch.setattr("towatlas.explorer.tables.table_of", lambda scene, model: survey[1] | {"source": scene.source})
    assert main(["explore", "--out", str(tmp_path / "new" / "page.html"), "skop-fig5"]) == 0
    data = re.search(r'id="known">(.*?)</script>', (tmp_path / "new" / "page.html").read_text(), re.DOTALL)
    assert data is not None
    names = [table["source"] for table in json.loads(data[1])["tables"]]
    assert names == ["skop-fig5", "skop-fig3", "skop-fig4"]
