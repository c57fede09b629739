"""The export to MoorDyn v2: its deck is the scene, its state the chain's own, and MoorDyn keeps the shape."""

import struct
import subprocess
import sys
from importlib.util import find_spec
from math import pi, sqrt

import numpy as np
import pytest

from benchmarks.chain import Chain
from towatlas import answer_scene
from towatlas.cli import main
from towatlas.exports.moordyn import STIFF
from towatlas.exports.moordyn_folder import check_folder, write_moordyn
from towatlas.scene.file import read_scene, scene_of_text
from towatlas.system import System

SURVEY = """
title = "Survey"
[cable]
length = 150
mass_per_length = 0.5
diameter = 0.012
drag_coefficient = 1.4
tangential_drag_coefficient = 0.03
tangential_drag_on = "d"
[fish]
mass = 60
volume = 0.02
added_mass = 10
drag_coefficient = 0.5
frontal_area = 0.03
[tow]
radius = 40
speed = "4 kn"
turn = "starboard"
[fluid]
density = 1025
"""
EXACT = 1e-14  # of a product of a few rounded numbers, written with 16 digits


def survey(**changes):
    text = SURVEY
    for old, new in changes.items():
        text = text.replace(*{"port": ('"starboard"', '"port"'), "extra": ("[fish]", f"{new}\n[fish]")}[old])
    return scene_of_text(text.encode(), "survey.toml")


@pytest.fixture(scope="module")
def wet():
    return answer_scene(survey(), model="water", asked=("position",))


@pytest.fixture(scope="module")
def dry():
    return answer_scene(read_scene("skop-fig3"), model="air", asked=("position",))


def tables(folder):
    """Numbers of the deck by the names above them, and its options by name."""
    lines = (folder / "deck.txt").read_text().splitlines()
    heads = {line.strip("- "): k for k, line in enumerate(lines) if line.startswith("--")}

    def row(section, k=0):
        at = heads[section]
        return dict(zip(lines[at + 1].split(), lines[at + 3 + k].split(), strict=True))

    options = {line.split()[1]: line.split()[0] for line in lines[heads["OPTIONS"] + 1 : heads["END"]]}
    return row("LINE TYPES"), row("POINTS", 1), row("LINES"), options


def state(folder):
    """Positions and velocities from the tow point to the fish."""
    data = (folder / "state.bin").read_bytes()
    assert data[:9] == b"MoorDyn\x02\x07"
    words, count = struct.unpack_from("<QQ", data, 9)
    assert len(data) == 9 + 8 * (words + 1)
    at, blocks = 25, []
    for _ in range(count):
        rows, columns = struct.unpack_from("<QQ", data, at)
        blocks.append(np.frombuffer(data, "<f8", rows * columns, at + 16).reshape(rows, columns))
        at += 16 + 8 * rows * columns
    assert at == len(data)
    tow_point, fish, inner = blocks
    rows = np.concatenate([tow_point, inner, fish])
    return rows[:, :3], rows[:, 3:]


def test_deck_of_a_wet_scene_is_its_keys(wet, tmp_path):
    """Drag along the cable on pi d, added mass of the fish over its displaced mass; the rest as it was given."""
    write_moordyn(wet, tmp_path / "out", segments=10)
    cable, fish, line, options = tables(tmp_path / "out")
    expected = {"Diam": 0.012, "Mass/m": 0.5, "Cd": 1.4, "CdAx": 0.03 / pi, "Ca": 1.0, "CaAx": 1.0, "EI": 0.0}
    assert {name: float(cable[name]) for name in expected} == pytest.approx(expected, rel=EXACT)
    expected = {"Mass": 60.0, "Volume": 0.02, "CdA": 0.015, "Ca": 10 / 20.5}
    # Of the difference of mass and weight.
    assert {name: float(fish[name]) for name in expected} == pytest.approx(expected, rel=10 * EXACT)
    assert (float(line["UnstrLen"]), int(line["NumSegs"])) == (150.0, 10)
    assert (float(options["rho"]), float(options["g"]), options["tScheme"]) == (1025.0, 9.80665, "rk4")


def test_state_is_that_of_a_turn_under_water(wet, tmp_path):
    write_moordyn(wet, tmp_path / "out", segments=10)
    places, velocities = state(tmp_path / "out")
    rate = 4 * 1852 / 3600 / 40
    # Clockwise from above.
    assert velocities == pytest.approx(np.cross([0, 0, -rate], places), abs=1e-13)
    depth = -places[0, 2]
    assert places[0] == pytest.approx([40, 0, -depth], abs=1e-12)
    assert (places[:, 2] < 0).all()
    assert float(tables(tmp_path / "out")[3]["WtrDpth"]) > (depth - places[:, 2]).max() - depth
    # It trails: to starboard, seen from above, y is behind.
    assert places[-1, 1] > 0


def test_a_turn_to_port_is_the_mirror_image(wet, tmp_path):
    write_moordyn(wet, tmp_path / "starboard", segments=10)
    port = answer_scene(survey(port=True), model="water", asked=("position",))
    write_moordyn(port, tmp_path / "port", segments=10)
    mirror = np.array([1, -1, 1])
    for a, b in zip(state(tmp_path / "port"), state(tmp_path / "starboard"), strict=True):
        assert a == pytest.approx(b * mirror, abs=1e-9)
    pages = [(tmp_path / turn / "README.md").read_text().splitlines() for turn in ("port", "starboard")]
    behind = [next(line for line in page if "behind" in line) for page in pages]
    assert behind[0] == behind[1]


def read_back(folder):
    """The dimensionless problem of a deck, by MoorDyn's conventions, its stiffness and unit of force, and its nodes."""
    cable, fish, line, options = tables(folder)
    places, velocities = state(folder)
    cable = {name: float(value) for name, value in cable.items() if name != "Name"}
    fish = {name: float(value) for name, value in fish.items() if name not in ("ID", "Attachment")}
    rho, g, length = float(options["rho"]), float(options["g"]), float(line["UnstrLen"])
    radius = places[0, 0]
    displaced = rho * pi / 4 * cable["Diam"] ** 2
    unit = cable["Mass/m"] + displaced
    across, along = 0.5 * rho * cable["Diam"] * cable["Cd"], 0.5 * rho * pi * cable["Diam"] * cable["CdAx"]
    system = System(
        lam=length / radius,
        w_f=(fish["Mass"] - rho * fish["Volume"]) / (unit * radius),
        m_f=(fish["Mass"] + rho * fish["Volume"] * fish["Ca"]) / (unit * radius),
        C=across * radius / unit,
        C_f=0.5 * rho * fish["CdA"] / unit,
        w=(cable["Mass/m"] - displaced) / unit,
        C_t=along * radius / unit,
    )
    gamma = np.hypot(*velocities[0, :2]) / sqrt(g * radius)
    nodes = (places - [0, 0, places[0, 2]]) * [1, -1, -1] / radius
    segments = np.linalg.norm(np.diff(places, axis=0), axis=1)
    tension = cable["EA"] * (segments / (length / len(segments)) - 1) / (unit * g * radius)
    return system, gamma, nodes, tension, cable["EA"] / (unit * g * radius)


class Start(dict):
    """Where Newton's method begins: nodes, and tensions that are given at their middles."""

    def __init__(self, system, nodes, tension):
        self.s = system.lam * np.linspace(0, 1, len(nodes))
        middles = (self.s[1:] + self.s[:-1]) / 2
        super().__init__(zip("xyz", nodes.T, strict=True), T=np.interp(self.s, middles, tension))


@pytest.mark.parametrize("name", ["wet", "dry"])
def test_state_is_the_steady_turn_of_the_chain(name, request, tmp_path):
    """By Newton's method from the deck alone. They differ by h^2; extrapolated, h^4 and the stretch are left."""
    answer = request.getfixturevalue(name)
    apart, pulls = [], []
    for segments in (40, 80):
        folder = tmp_path / str(segments)
        write_moordyn(answer, folder, segments=segments)
        system, gamma, nodes, tension, stiffness = read_back(folder)
        places, pull = Chain(system, gamma, segments).rest(Start(system, nodes, tension))
        every = segments // 40
        apart.append((places - nodes[1:])[every - 1 :: every])
        # In the middle of the coarser chain's segments there is a joint of the finer one.
        middle = pull / tension - 1
        pulls.append(middle if every == 1 else (middle[::2] + middle[1::2]) / 2)
    strain = tension.max() / stiffness
    for coarse, fine, unit in ((*apart, system.lam), (*pulls, 1.0)):
        left = np.abs(4 * fine - coarse).max() / 3
        assert 3.5 < np.abs(coarse).max() / np.abs(fine).max() < 4.5
        assert left < np.abs(fine).max() / 10 + strain * unit


@pytest.mark.skipif(find_spec("moordyn") is None, reason="moordyn is not installed: pip install '.[peers]'")
@pytest.mark.parametrize(("name", "turns", "few"), [("wet", 0.1, 10), ("dry", 0.5, 20)])
def test_moordyn_keeps_the_shape(name, turns, few, request, tmp_path):
    """By the driver, as a user runs it, with two N and extrapolated; with a tenth more drag it leaves.

    Extrapolation leaves h^4, a fifteenth of what it changes by, and the chain's stretch. The tension: the tow point
    changes its velocity once a step, which sends waves of first order along the cable.
    """
    answer = request.getfixturevalue(name)
    scene = answer.scene
    middles = [scene.length / few / k for k in (2, 4)]
    exact = answer.shape(s=[0.0, *middles, scene.length])
    fish, pull = np.array([exact[axis].values[-1] for axis in "xyz"]), exact["T"].values
    off, errors = [], []
    for k, segments in enumerate((few, 2 * few)):
        folder = tmp_path / str(segments)
        write_moordyn(answer, folder, segments=segments)
        place, tension = driven(folder, turns)
        off.append(place - fish)
        errors.append(tension - pull[1 + k])
    change = np.linalg.norm(off[1] - off[0]) / 3
    stretch = scene.length / STIFF
    assert np.linalg.norm(4 * off[1] - off[0]) / 3 < change / 15 + stretch
    cable, _, _, options = tables(folder)
    jump = scene.speed**2 / scene.radius * float(options["dtM"]) * abs(float(exact["R_x"][0])) / pull[0]
    wave = sqrt(float(cable["EA"]) * scene.mass_unit(answer.choice.model)) * jump
    assert abs(4 * errors[1] - errors[0]) / 3 < abs(errors[1] - errors[0]) / 45 + wave
    deck = folder / "deck.txt"
    deck.write_text(deck.read_text().replace(f" {cable['Cd']} 1 ", f" {1.1 * float(cable['Cd'])} 1 "))
    assert np.linalg.norm(driven(folder, turns)[0] - fish) > 4 * np.linalg.norm(off[1]) + stretch


def driven(folder, turns):
    """Where the fish is in the end, turned back, z down; the tension."""
    subprocess.run([sys.executable, folder / "drive.py", str(turns)], check=True, capture_output=True, timeout=60)
    track = np.genfromtxt(folder / "track.csv", delimiter=",", names=True)
    assert track["turns"] == pytest.approx(np.arange(1, 1000 * turns + 1) / 1000, rel=1e-12)
    angle, radius = np.radians(track["behind_deg"][-1]), track["radius_m"][-1]
    return np.array([radius * np.cos(angle), -radius * np.sin(angle), track["depth_m"][-1]]), track["tension_N"][-1]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--branch", "shape 9"], 2, "one of the branches"),
        (["--segments", "1"], 2, "segments must be 2 to"),
    ],
)
def test_bad_requests_are_refused(arguments, code, words, tmp_path, capsys):
    assert main(["export", "skop-fig3", "--model", "air", "--moordyn", str(tmp_path / "out"), *arguments]) == code
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_folders_are_not_written_over(tmp_path, capsys):
    (tmp_path / "kept").write_text("")
    assert main(["export", "skop-fig3", "--moordyn", str(tmp_path)]) == 5
    assert "not empty" in capsys.readouterr().err
    assert main(["export", "skop-fig3", "--moordyn", str(tmp_path / "kept")]) == 5
    assert "is a file" in capsys.readouterr().err
    with pytest.raises(OSError, match="cannot be made"):
        check_folder(tmp_path / "kept" / "below")
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


def test_side_force_is_refused(tmp_path):
    scene = survey(extra='side_force_coefficient = 0.1\nkites = "port"')
    answer = answer_scene(scene, model="water", asked=("position",))
    with pytest.raises(ValueError, match=r"MoorDyn has no side force.*cable\.side_force_coefficient"):
        write_moordyn(answer, tmp_path / "out")
    # The smaller models have none.
    write_moordyn(answer_scene(scene, model="air", asked=("position",)), tmp_path / "out")
