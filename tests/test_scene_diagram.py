"""Diagrams of scenes over speed and length, and what is seen both ways, against flutter, folds and single shapes."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
import xarray
from helpers import run
from matplotlib.figure import Figure
from test_folds import DEEP

import towatlas
from towatlas.commands.scene_seen import lines_of
from towatlas.plot.diagram import plot_diagram
from towatlas.scene.designs import with_length
from towatlas.scene.diagrams import scene_diagram, to_starboard
from towatlas.scene.edges import flutter_edges
from towatlas.scene.file import make_scene, read_scene
from towatlas.scene.jumps import answer_scene
from towatlas.scene.models import system_of
from towatlas.scene.sweeps import sweep
from towatlas.scene.verdicts import verdicts_of
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.flutter import flutter_of
from towatlas.solve.folds import solve_folds_between
from towatlas.solve.seen import Jump, Stretch, kind_at, radius_at
from towatlas.solve.stability import stability_of


@pytest.fixture(scope="module")
def fig3():
    """The first published window of flutter, gamma 3.3036 to 4.6342 of (37.8, 1352, C 0.018)."""
    return scene_diagram(read_scene("skop-fig3"), speed=(1.34, 1.4), model="air")


@pytest.fixture(scope="module")
def deep():
    """A wet cable with three shapes over a range of speeds: a hysteresis."""
    scene = make_scene(DEEP)
    return scene_diagram(scene, speed=(0.95 * scene.speed, 1.05 * scene.speed), model="water")


def test_rising_and_falling_are_the_windows_of_flutter(fig3):
    groups, unit = fig3.scene.system("air"), fig3.scene.speed_of(1.0)
    found = towatlas.flutter(groups.lam, groups.w_f, (1.34 / unit, 1.4 / unit), C=groups.C)
    (window,) = (one for one in found.windows if not one.weak and one.branch == "shape 1")
    rising = fig3.rising()
    assert [part.kind for part in rising] == ["stable", "flutter"]
    assert rising[1].low == pytest.approx(window.low * unit, rel=1e-10)
    rate = np.sqrt(fig3.scene.gravity / fig3.scene.radius)
    assert rising[1].growth == pytest.approx(window.growth * rate, rel=1e-6)
    assert fig3.falling() == rising[::-1]
    lines = lines_of(fig3)
    assert "flutter about two nodes, e times larger in" in lines[0]
    assert "the other way round" in lines[1]
    held = repr(fig3).splitlines()
    assert held[0] == "SceneDiagram of 'NRL Report 7048, Fig. 3': speed 1.34 to 1.4 m/s, air model"
    assert held[1:] == [f"  {branch!r}" for branch in fig3.branches]


@pytest.mark.slow
def test_a_hysteresis_jumps_up_and_back_at_its_folds(deep):
    scene = deep.scene
    system, gamma = to_starboard(system_of(scene, "water"), scene.gamma)
    folds = solve_folds_between(system, 0.95 * gamma, ("gamma",), 1.05 / 0.95).gamma * scene.speed_of(1.0)
    up, down = ([part.value for part in way if isinstance(part, Jump)] for way in (deep.rising(), deep.falling()))
    assert sorted([*up, *down]) == pytest.approx(sorted(folds), rel=1e-9)
    assert len(up) == len(down) == 1
    assert down[0] < up[0]
    for way in (deep.rising(), deep.falling()):
        assert not any(part.kind == "divergence" for part in way if isinstance(part, Stretch))
    assert "a jump at" in lines_of(deep)[0]


@pytest.mark.parametrize("which", ["fig3", pytest.param("deep", marks=pytest.mark.slow)])
def test_samples_are_the_shapes_and_verdicts_of_the_scene(which, request):
    drawn = request.getfixturevalue(which)
    scene, model = drawn.scene, drawn.model
    for branch in drawn.branches:
        at = len(branch.value) // 2
        answer = answer_scene(scene.at(speed=float(branch.value[at])), model=model, asked=("nodes",))
        found, verdicts = answer.equilibria, verdicts_of(answer)
        k = int(np.argmin(np.abs(found.r_f * scene.radius - branch.r_f[at])))
        assert found.z_f[k] * scene.radius == pytest.approx(branch.z_f[at], rel=1e-8)
        assert found.tension[k] * scene.force_unit(model) == pytest.approx(branch.tension[at], rel=1e-8)
        assert verdicts.shapes[k].kind == branch.kind[at]
        # Where all is damped strongly no leading eigenvalue is had.
        assert verdicts.shapes[k].growth == pytest.approx(branch.growth[at], rel=1e-5, nan_ok=True)
        assert verdicts.shapes[k].frequency == pytest.approx(branch.frequency[at], rel=1e-5, nan_ok=True)


def test_over_the_length_edges_are_edges_over_the_speed():
    """Where it flutters from some length on at one speed, it does from that speed on at that length."""
    scene = read_scene("skop-fig3")
    over = scene_diagram(scene, length=(0.72, 0.74), model="air")
    (edge,) = (part.low for part in over.rising() if part.kind == "flutter")
    across = scene_diagram(with_length(scene, edge), speed=(scene.speed * 0.99, scene.speed * 1.01), model="air")
    (speed,) = (part.low for part in across.rising() if part.kind == "flutter")
    assert speed == pytest.approx(scene.speed, rel=1e-9)


@pytest.mark.slow
def test_over_the_length_folds_are_those_of_the_length():
    scene = make_scene(DEEP)
    system, gamma = to_starboard(system_of(scene, "water"), scene.gamma)
    folds = solve_folds_between(replace(system, lam=0.95 * system.lam), gamma, ("lam",), 1.05 / 0.95).value
    found = scene_diagram(scene, length=(0.95 * scene.length, 1.05 * scene.length), model="water")
    ends = {point.value for branch in found.branches for point in branch.points if point.kind == "fold"}
    assert len(folds)
    assert sorted(ends) == pytest.approx(sorted(folds * scene.radius), rel=1e-9)


def test_a_turn_to_port_is_the_mirror_image():
    """A side force to port in a turn to port is one to starboard in a turn to starboard."""
    system = replace(system_of(read_scene("skop-fig3"), "air"), C_s=0.002, b_s=0.2)
    found = to_starboard(system, -2.97)
    assert found == (replace(system, C_s=-0.002), 2.97)
    port, mirrored = (stability_of(solve_equilibria(*one)) for one in ((system, -2.97), found))
    np.testing.assert_allclose(port.growth, mirrored.growth, rtol=1e-9)
    scenes = [read_scene("skop-fig3", {"tow.turn": turn}) for turn in ("port", "starboard")]
    port, starboard = (scene_diagram(scene, speed=(1.3, 1.31), model="air") for scene in scenes)
    assert port.branches[0].growth.tolist() == starboard.branches[0].growth.tolist()


def test_without_damping_no_scene_in_a_fluid_is_judged():
    assert scene_diagram(read_scene("skop-fig3"), speed=(1.3, 1.31)).model == "air"


@pytest.mark.parametrize(("which", "arrows"), [("fig3", 0), pytest.param("deep", 2, marks=pytest.mark.slow)])
def test_figure(which, arrows, request):
    drawn = request.getfixturevalue(which)
    figure = Figure(figsize=(7.2, 6.0), layout="constrained")
    axes = figure.subplots()
    assert len(plot_diagram(drawn, axes, "depth")) == sum(len(branch.between) for branch in drawn.branches)
    assert axes.get_xlabel() == "speed, m/s"
    assert axes.get_ylabel() == "depth of the fish below the tow point, m"
    assert len(axes.texts) == arrows
    figure.draw_without_rendering()


class TestCommands:
    def test_files(self, capsys, tmp_path):
        code, out, err = run(capsys, "diagram", "skop-fig3", "--speed=2.6kn:2.7kn", "--model=air")
        assert code == 0
        row = next(csv.DictReader(out.splitlines()))
        assert {"speed_m_s", "z_f_m", "tension_N", "growth_1_s", "frequency_Hz", "kind"} <= set(row)
        assert "as the speed rises from 2.6 kn to 2.7 kn (air model)" in err
        file = tmp_path / "d.nc"
        assert run(capsys, "diagram", "skop-fig3", "--length=28in:29in", "--model=air", "--out", file)[0] == 0
        with xarray.open_dataset(file) as data:
            assert data.length.attrs["units"] == "m"
            assert data.growth.attrs["units"] == "1/s"
            assert data.attrs["model"] == "air"

    def test_seen(self, capsys):
        scene = ("scene", "skop-fig3", "--asked=nodes")
        answer = json.loads(run(capsys, *scene, "--json", "--seen=1.36:1.38")[1])
        assert [part["kind"] for part in answer["seen"]["rising"]] == ["stable", "flutter"]
        assert answer["seen"]["rising"][1]["from_m_s"] == pytest.approx(1.36669, rel=1e-5)
        out = run(capsys, *scene)[1]
        assert "--seen 0.61:2.5 (m/s)" in out

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (("skop-fig3",), "exactly one of --speed and --length"),
            (("skop-fig3", "--speed=1:2", "--length=1:2"), "exactly one of --speed and --length"),
            (("skop-fig3", "--speed=2:1"), "the lower one first"),
            (("skop-fig3", "--speed=1:2:3"), "is no range"),
            (("skop-fig3", "--speed=-1:2"), "not positive"),
            (("skop-fig3", "--speed=1kg:2kg"), "is not a speed"),
            (("skop-fig3", "--speed=1:2", "--lam=3"), "leave out lam"),
            (("skop-fig3", "--speed=1:2", "--C=3"), "leave out the fluid"),
            (("--lam=3", "--wf=1"), "--gamma missing"),
            (("--lam=3", "--wf=1", "--gamma=1:2", "--speed=1:2"), "are for a scene"),
        ],
    )
    def test_what_is_refused(self, capsys, arguments, message):
        code, out, err = run(capsys, "diagram", *arguments)
        assert (code, out) == (2, "")
        assert message in err


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_no_answer_contradicts_another(seed):
    """Random scenes in air and water: verdicts of scenes, windows of flutter, edges, the diagram and a sweep."""
    rng = np.random.default_rng(seed)
    radius, water = float(10.0 ** rng.uniform(-1.0, 1.0)), bool(seed % 2)
    table = {
        "cable": {
            "length": radius * float(rng.uniform(2.0, 8.0)),
            "mass_per_length": 1.0,
            "diameter": 0.02 if water else 0.01,
            "drag_coefficient": 1.2,
        },
        "fish": {"mass": radius * float(rng.uniform(0.5, 5.0)), "diameter": 0.05, "drag_coefficient": 0},
        "tow": {"radius": radius, "speed": 1.0},
        "fluid": {"density": 1000.0 if water else 1.2},
    }
    scene = make_scene(table).at(gamma=float(rng.uniform(0.4, 1.5)))
    model, ends = ("water" if water else "air"), (0.9 * scene.speed, 1.1 * scene.speed)
    with towatlas.patience(300.0):
        drawn = scene_diagram(scene, speed=ends, model=model)
        system, gamma = to_starboard(system_of(scene, model), scene.gamma)
        windows = flutter_of(system, 0.9 * gamma, 1.1 * gamma).windows
        edges = flutter_edges(answer_scene(scene, model=model, asked=("nodes",)))
    points = {point.value for branch in drawn.branches for point in branch.points}
    for window in windows:
        for edge in (window.low, window.high):
            assert min(abs(edge * scene.speed / gamma / value - 1.0) for value in points) < 1e-9
    for edge in (edges.below, edges.above):
        if edge is not None and ends[0] < edge.speed < ends[1]:
            assert min(abs(edge.speed / value - 1.0) for value in points) < 1e-8
    speeds = np.sort(rng.uniform(*ends, 6))
    curve = sweep(scene, speed=speeds, model=model, stability=True).isel(member=0)
    for i, speed in enumerate(speeds):
        if min(abs(speed / value - 1.0) for value in points) < 2e-3:
            continue
        answer = answer_scene(scene.at(speed=float(speed)), model=model, asked=("nodes",))
        shapes, found = verdicts_of(answer).shapes, answer.equilibria
        for j, k in enumerate(np.argsort(found.r_f)):
            swept = curve.isel(value=i, shape=j)
            assert swept.kind == shapes[k].kind
            assert abs(swept.growth - shapes[k].growth) <= 2.0 * shapes[k].error
        there = [one for one in drawn.branches if one.points[0].value < speed < one.points[-1].value]
        assert len(there) == len(found)
        for branch in there:
            k = int(np.argmin(np.abs(np.log(found.r_f * scene.radius / radius_at(branch, speed)))))
            drawn_as, said = kind_at(branch, speed), shapes[k].kind
            # The strongest of a stretch names it, or that some of it was not counted.
            allowed = drawn_as in (said, "unknown") or {drawn_as, said} <= {"weak", "flutter", "divergence"}
            assert allowed, (speed, branch, said)
