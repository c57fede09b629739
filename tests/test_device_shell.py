"""`towatlas device`, DEVICE.toml, and the public module of the device."""

import inspect
import json
import math
import subprocess
import sys

import pytest
from helpers import run
from numpydoc.docscrape import ClassDoc, FunctionDoc

import towatlas
from towatlas import device
from towatlas.scene.device import make_tow

ONE = """
[tow]
radius = "200 m"
speed = "4 kn"
[line]
length = "150 m"
mass = "300 kg"
k = "467.6 kg/m"
alpha = "-80 deg"
"""
TWO = """
[[line]]
length = "300 m"
k = "60 kg/m"
mass = "300 kg"
alpha = "0.9 rad"
[[line]]
length = "150 m"
k = 60
mass = 300
alpha = "0.5 rad"
"""


@pytest.fixture
def file(tmp_path):
    def write(text):
        path = tmp_path / "device.toml"
        path.write_text(text)
        return path

    return write


def shell(capsys, *arguments):
    code, out, err = run(capsys, "device", *arguments, "--json")
    return code, json.loads(out) if out else None, err


def test_module():
    """`import towatlas.device` and `towatlas.device` are one; nothing of it is loaded before."""
    assert towatlas.device is device
    assert "device" in dir(towatlas)
    code = (
        "import sys, towatlas; a = 'towatlas.device' in sys.modules; towatlas.device; print(a, 'scipy' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.stdout.strip(), done.stderr) == ("False False", "")


@pytest.mark.parametrize("name", device.__all__)
def test_docstrings(name):
    value = getattr(device, name)
    if inspect.isclass(value):
        entries = ClassDoc(value, config={"show_class_members": False})["Attributes"]
        names = [one for entry in entries for one in entry.name.split(", ")]
        assert names == list(inspect.signature(value).parameters)
        return
    doc = FunctionDoc(value)
    assert [n for entry in doc["Parameters"] for n in entry.name.split(", ")] == list(
        inspect.signature(value).parameters
    )
    assert doc["Summary"]
    assert doc["Returns"]
    assert doc["Examples"]


def test_points(capsys):
    code, rows, err = shell(capsys, "points", "--k", 1, "--alpha=-80deg", "--R", 1.5)
    assert (code, err) == (0, "")
    assert [list(row) for row in rows] == [
        ["schema_version", "phi", "stable", "tension", "physical", "eigenvalues"]
    ] * 4
    exact = device.points(1.0, math.radians(-80), 1.5)
    assert [row["phi"] for row in rows] == [p.phi for p in exact]
    assert rows[2]["eigenvalues"][0] == [exact[2].eigenvalues[0].real, exact[2].eigenvalues[0].imag]
    code, out, _ = run(capsys, "device", "points", "--k", 1, "--alpha=-80deg", "--R", 1.5)
    assert code == 0
    assert len(out.splitlines()) == 5
    assert "-46.755868" in out


def test_points_in_real_units(capsys, file):
    """Tensions in N against m L omega^2, rates in 1/s; options go before the file."""
    path = file(ONE)
    code, rows, err = shell(capsys, "points", path)
    assert (code, err) == (0, "")
    rate = 4 * 1852 / 3600 / 200.0
    exact = device.points(467.6 * 150 / 300, math.radians(-80), 200 / 150)
    assert [r["tension"] for r in rows] == pytest.approx([p.tension * 300 * 150 * rate**2 for p in exact], rel=1e-12)
    assert rows[0]["eigenvalues"][0][0] == pytest.approx(exact[0].eigenvalues[0].real * rate, rel=1e-12)
    _, other, _ = shell(capsys, "points", path, "--R", 3, "--alpha", "10deg", "--k", 2)
    assert [r["phi"] for r in other] == [p.phi for p in device.points(2.0, math.radians(10), 3.0)]


def test_turn_and_bifurcations(capsys, file):
    code, found, err = shell(capsys, "turn", "--k", 1, "--alpha=-80deg")
    assert (code, err) == (0, "")
    assert list(found) == ["schema_version", "alpha", "R_min", "kind", "ranges"]
    assert found["ranges"][0] == [found["R_min"], None]
    assert found["R_min"] == pytest.approx(2.86137682766, abs=1e-11)
    _, metres, _ = shell(capsys, "turn", file(ONE))
    assert metres["R_min"] == pytest.approx(150 * device.turn(467.6 / 2, math.radians(-80)).R_min, rel=1e-12)
    code, rows, _ = shell(capsys, "bifurcations", "--k", 0.5)
    (row,) = [r for r in rows if r["kind"] == "degenerate-hopf" and r["physical"]]
    assert list(row) == ["schema_version", "kind", "R", "alpha", "phi", "stable_side", "tension", "physical"]
    assert row["R"] == pytest.approx(2.45458107808, abs=6e-12)
    code, rows, _ = shell(capsys, "bifurcations", "--k", 1, "--alpha", "30deg")
    assert [(r["kind"], r["stable_side"]) for r in rows] == [("saddle-node", "above")]
    code, out, _ = run(capsys, "device", "turn", "--k", 1, "--alpha=-80deg")
    assert "0.4253835093688 to 1.579034617019" in out


def test_cycle(capsys, file):
    code, (row,), err = shell(capsys, "cycle", "--k", 50, "--alpha=-1.4rad", "--R", 1.02)
    assert (code, err) == (0, "")
    assert list(row)[1:5] == ["amplitude", "period", "tension_min", "stable"]
    assert row["tension_min"] > 0
    code, rows, err = shell(capsys, "cycle", "--k", 1, "--alpha=-1.46rad", "--R", 1.5)
    assert [r["stable"] for r in rows] == [True, False]
    assert "the line goes slack" in err
    code, rows, err = shell(capsys, "cycle", "--k", 1, "--alpha", "60deg", "--R", 1.5)
    assert (code, rows) == (4, [])
    assert "cos alpha >= 1/3" in err


def test_tangle(capsys, file):
    code, (row,), err = shell(capsys, "tangle", file(TWO))
    assert code == 0
    assert "at 1 m/s" in err
    assert list(row) == ["schema_version", "R", "phi", "stable", "tension", "physical"]
    assert row["R"] == pytest.approx(212.302650518, abs=6e-10)
    assert row["stable"] == [True, True]
    assert min(row["tension"]) > 0


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("points", "--k", 1, "--alpha=-80", "--R", 1), 2, "it has no unit"),
        (("points", "--k", 1, "--alpha=-95deg", "--R", 1), 2, "95 degrees: beyond 90"),
        (("points", "--k", 0, "--alpha=-80deg", "--R", 1), 2, "k must be finite and positive"),
        (("points", "--k", 1, "--alpha=-80deg", "--R", 0), 2, "R must be positive"),
        (("points", "--k", 1, "--alpha=-80deg"), 2, "needs a turning radius"),
        (("points", "--k", 1, "--R", 1), 2, "needs --alpha"),
        (("points", "--R", 1), 2, "which device"),
        (("points", "--k", 1, "--alpha", "0deg", "--R", 0.5), 4, "loses its line"),
        (("points", "--k", 1, "--alpha=-80deg", "--R", 2), 0, "no stable point on a taut line"),
        (("turn", "--k", 1, "--alpha", "90deg"), 4, "nothing damps"),
        (("cycle", "--k", 1, "--alpha=-90deg", "--R", 2), 4, "reversible"),
        (("bifurcations", "--k", 1, "--alpha=-80deg", "--R", 2), 2, "got both"),
        (("tangle", "--k", 1), 2, "a file DEVICE.toml"),
        (("points", "nowhere.toml"), 5, "no device at nowhere.toml"),
    ],
)
def test_messages(capsys, arguments, code, said):
    found, _, err = run(capsys, "device", *arguments)
    assert found == code
    assert said in err
    assert "Traceback" not in err


LINE = {"length": "300 m", "mass": "300 kg", "k": 60, "alpha": "10 deg"}
AREAS = {"length": 300, "mass": 300, "lift_area": "-0.9 m^2", "drag_area": "0.3 m^2", "density": "1025 kg/m^3"}


def test_areas():
    (line,) = make_tow({"line": AREAS}).lines
    assert line.k == pytest.approx(0.5 * 1025 * math.hypot(0.9, 0.3), rel=1e-15)
    assert math.tan(line.alpha) == pytest.approx(-3.0)
    assert make_tow({"line": AREAS | {"alpha": "-71.565 deg"}}).lines == (line,)


def test_two_of_radius_speed_and_rate():
    tows = [
        {"radius": 200, "speed": 2},
        {"radius": 200, "rotation_rate": "0.01 rad/s"},
        {"speed": 2, "period": f"{200 * math.pi} s"},
    ]
    for tow in tows:
        made = make_tow({"tow": tow, "line": LINE})
        assert (made.radius, made.speed) == pytest.approx((200.0, 2.0), rel=1e-14)
    assert not make_tow({"tow": {"radius": 200}, "line": LINE}).speed_given


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ({}, r"one section \[line\]"),
        ({"line": LINE, "fish": {}}, "fish is unknown"),
        ({"line": LINE | {"lenth": 3}}, "do you mean length"),
        ({"line": LINE | {"alpha": 10}}, "degrees or radians"),
        ({"line": LINE | {"alpha": "95 deg"}}, "95 degrees: beyond 90"),
        ({"line": LINE | {"k": 0}}, "line.k = 0 is zero"),
        ({"line": LINE | {"mass": "-3 kg"}}, "is negative"),
        ({"line": LINE | {"density": 1000}}, "keep one"),
        ({"line": {"length": 1, "k": 1, "alpha": "1 deg"}}, "line.mass is missing"),
        ({"line": {"length": 1, "mass": 1, "k": 1}}, "line.alpha is missing"),
        ({"line": {"length": 1, "mass": 1, "lift_area": 1}}, "line.drag_area is missing"),
        ({"line": AREAS | {"alpha": "10 deg"}}, "the areas give -71.56"),
        ({"line": [LINE, LINE | {"k": "3 N"}]}, "line 2.k"),
        ({"line": LINE, "tow": {"radius": 1, "speed": 1, "rpm": 1}}, "two give the third"),
        ({"line": LINE, "tow": {"rpm": 1}}, "alone gives neither"),
        ({"line": LINE, "tow": {"radius": 0}}, "tow.radius = 0 is zero"),
    ],
)
def test_bad_files(table, said):
    with pytest.raises(ValueError, match=said):
        make_tow(table)
