"""Scenes in files: shapes in SI against the keys of the scene, figures in which nothing covers a label, pages."""

import csv
import functools
import html.parser
import io
import json
import os
import re
import shutil
import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from helpers import changed, run
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Annotation, Text

import towatlas
from towatlas.commands.scene_files import UNITS
from towatlas.plot.labels import Label, place_labels
from towatlas.plot.scene import plot_scene
from towatlas.scene.file import make_scene, read_scene
from towatlas.scene.jumps import answer_scene
from towatlas.tables.seal import read_sealed

WET = """
title = "Survey $below$ a <ship>"
[cable]
length = 150
mass_per_length = 0.5
diameter = 0.012
drag_coefficient = 1.4
[fish]
mass = 60
volume = 0.02
added_mass = 10
drag_coefficient = 0.8
frontal_area = 0.05
[tow]
radius = 40
speed = 2.0
[fluid]
density = 1025
"""
COLUMNS = ["s_m", "x_m", "y_m", "z_m", "R_x_N", "R_y_N", "R_z_N", "T_N"]
FLOATING = {
    "title": "Floating line",
    "cable": {"length": 120, "mass_per_length": 0.08, "diameter": 0.014, "drag_coefficient": 1.2},
    "tow": {"radius": 60, "speed": 1.5, "turn": "port"},
    "fluid": {"density": 1025},
}
SHAPED = ("nodes", "position", "tension")


@pytest.fixture
def wet(tmp_path):
    path = tmp_path / "wet.toml"
    path.write_text(WET)
    return path


def table_of(text):
    """Rows of a CSV file behind a line of comment."""
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def column(rows, name):
    return np.array([float(row[name]) for row in rows])


@pytest.mark.parametrize("model", ["vacuum", "air", "water"])
def test_shapes_in_si(capsys, wet, tmp_path, model):
    """Ends as `scene --json` states them, the length of the cable, and the pull of the fish by its keys."""
    scene = read_scene(wet)
    code, out, _ = run(capsys, "scene", wet, "--model", model, "--json")
    known = json.loads(out)
    path = tmp_path / "made" / "shapes.csv"
    assert (code, run(capsys, "scene", wet, "--model", model, "--out", path)[:2]) == (0, (0, ""))
    rows = table_of(path.read_text())
    assert list(rows[0]) == ["shape", "expected", *COLUMNS]
    assert [row["branch"] for row in known["equilibria"]] == list(dict.fromkeys(row["shape"] for row in rows))
    omega, gravity = scene.speed / scene.radius, scene.gravity
    for shape in known["equilibria"]:
        points = [row for row in rows if row["shape"] == shape["branch"]]
        assert {row["expected"] for row in points} == {str(shape["expected"])}
        first, last = points[0], points[-1]
        for name, row, at in (
            *((f"{name}_f_m", last, f"{name}_m") for name in "xyz"),
            *((f"R_{name}0_N", first, f"R_{name}_N") for name in "xyz"),
            ("tension_N", first, "T_N"),
        ):
            assert float(row[at]) == pytest.approx(shape[name], rel=1e-10, abs=1e-9), name
        # The tow point, within the error of the shape.
        assert [float(first[name]) for name in COLUMNS[:4]] == pytest.approx([0, scene.radius, 0, 0], abs=1e-7)
        chords = np.linalg.norm(np.diff([column(points, f"{name}_m") for name in "xyz"], axis=1), axis=0)
        # Chords are shorter than arcs by their curvature: at 401 points by less than 1e-4.
        assert float(last["s_m"]) == 150.0
        assert 0.0 <= 1.0 - chords.sum() / 150.0 < 1e-4
        wetted = model == "water"
        weight = (60.0 - wetted * 1025 * 0.02) * gravity
        outwards = (60.0 + wetted * 10.0) * omega**2 * shape["r_f_m"]
        drag = 0.5 * 1025 * 0.8 * 0.05 * (omega * shape["r_f_m"]) ** 2 * (model != "vacuum")
        assert float(last["T_N"]) == pytest.approx(np.linalg.norm([weight, outwards, drag]), rel=1e-10)


@pytest.mark.parametrize(("model", "root"), [("air", "shape 2"), ("vacuum", 1), ("water", "expected")])
def test_shape_of_a_scene(capsys, tmp_path, model, root):
    """The same numbers as without units, times the units, on standard output, as CSV and as NetCDF."""
    scene = read_scene("skop-fig3")
    system = scene.system(model)
    groups = {name: value for name, value in vars(system).items() if name not in ("lam", "w_f")}
    s = [0.0, 0.2, 0.66]
    plain = towatlas.shape(system.lam, system.w_f, scene.gamma, root=root, s=np.array(s) / scene.radius, **groups)
    arguments = ("shape", "skop-fig3", "--model", model, "--root", root)
    code, out, _ = run(capsys, *arguments, "--s", *s)
    rows = table_of(out)
    assert (code, list(rows[0])) == (0, COLUMNS)
    assert column(rows, "s_m").tolist() == s
    assert f"branch = '{plain.attrs['branch']}'" in out.splitlines()[0]
    for name, unit in UNITS.items():
        # Positions next to zero are known to rounding of the tow radius.
        scale = {"m": scene.radius, "N": scene.force_unit(model)}[unit]
        np.testing.assert_allclose(column(rows, f"{name}_{unit}"), plain[name] * scale, rtol=1e-11, atol=1e-13 * scale)
    for ending in ("csv", "nc"):
        assert run(capsys, *arguments, "--s", *s, "--out", tmp_path / f"a.{ending}")[:2] == (0, "")
    assert (tmp_path / "a.csv").read_text() == out
    read_sealed(tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc") as file:
        for name, unit in UNITS.items():
            assert file[name].attrs["units"] == unit
            assert "over" not in file[name].attrs["long_name"]
            np.testing.assert_array_equal(file[name], column(rows, f"{name}_{unit}"))
        assert (file.s_node.attrs["units"], file.z_node.attrs["units"]) == ("m", "m")
        np.testing.assert_allclose(file.s_node, plain.s_node * scene.radius, rtol=1e-11)
        assert (file.attrs["model"], file.attrs["scene_file"], file.attrs["turn"]) == (model, "skop-fig3", "starboard")
        assert (file.attrs["length_m"], file.attrs["speed_m_s"]) == (scene.length, scene.speed)
        assert file.attrs["tension_N"] == pytest.approx(float(file["T"][0]), rel=1e-11)


def test_cf_compliance(capsys, wet, tmp_path):
    path = tmp_path / "shape.nc"
    assert run(capsys, "shape", wet, "--model", "water", "--points", 11, "--out", path)[0] == 0
    checker = shutil.which("compliance-checker", path=os.path.dirname(sys.executable))
    assert checker, "compliance-checker is not installed: pip install towatlas[test]"
    done = subprocess.run([checker, "-t", "cf:1.11", "-c", "strict", str(path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
    assert "All tests passed" in done.stdout


def test_the_model_is_that_of_the_scene(capsys, monkeypatch):
    """Without --model shape and scene choose alike, at another speed too, and from standard input."""
    code, out, _ = run(capsys, "scene", "skop-fig3", "--gamma", 1.64, "--json")
    known = json.loads(out)
    _, out, _ = run(capsys, "shape", "skop-fig3", "--gamma", 1.64, "--points", 2)
    assert code == 0
    assert f"model = '{known['model']}'" in out.splitlines()[0]
    (expected,) = (row for row in known["equilibria"] if row["expected"])
    assert float(table_of(out)[1]["z_m"]) == pytest.approx(expected["z_f_m"], rel=1e-10)
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(WET.encode())))
    code, out, _ = run(capsys, "shape", "-", "--speed", "3kn", "--model", "water", "--points", 2)
    assert (code, "speed_m_s = 1.5433" in out) == (0, True)


@pytest.mark.parametrize(
    ("arguments", "code", "match"),
    [
        (("shape",), 2, "give a scene, or --lam, --wf and --gamma; missing: --lam, --wf, --gamma"),
        (("shape", "--lam", 3, "--wf", 1), 2, "missing: --gamma"),
        (("shape", "--lam", 3, "--wf", 1, "--gamma", 1, "--model", "air"), 2, "--model goes with a scene"),
        (("shape", "--lam", 3, "--wf", 1, "--speed", 1), 2, "missing: --gamma"),
        (("shape", "skop-fig3", "--lam", 3), 2, "--lam goes with a cable"),
        (("shape", "skop-fig3", "--C-t", 3), 2, "--C-t goes with a cable"),
        (("shape", "skop-fig3", "--gamma", 1, "--rpm", 1), 2, "not allowed with"),
        (("shape", "skop-fig3", "--gamma", -1), 2, "gamma must be finite and positive, got -1"),
        (("shape", "skop-fig9"), 5, "no scene at skop-fig9"),
        (("shape", "skop-fig3", "--model", "vacuum", "--s", 0.7), 2, "from 0 to 0.6604 m, the length of the cable"),
        (("shape", "skop-fig3", "--model", "vacuum", "--root", "shape 1"), 2, "one of the branches"),
        (("shape", "skop-fig3", "--out", "shape.html"), 2, "one of .nc, .csv, .svg, .png, .pdf"),
        (("scene", "skop-fig3", "--out", "scene.xls"), 2, "one of .svg, .png, .pdf, .html, .csv"),
        (("scene", "skop-fig3", "--out", "scene"), 2, "the ending must be one of"),
        (("scene", "skop-fig3", "--out", "scene.svg", "--json"), 2, "not allowed with"),
        (("scene", "skop-fig3", "--out", "/dev/null/scene.svg"), 5, "/dev/null/scene.svg cannot be written"),
    ],
)
def test_what_is_refused(capsys, monkeypatch, tmp_path, arguments, code, match):
    monkeypatch.chdir(tmp_path)
    got, out, err = run(capsys, *arguments)
    assert (got, out) == (code, "")
    assert match in err
    assert not list(tmp_path.iterdir())


SCENES = {
    "three shapes in air": lambda: answer_scene(read_scene("skop-fig3")),
    "one in water": lambda: answer_scene(make_scene(changed())),
    "nineteen in a vacuum": lambda: answer_scene(
        read_scene("skop-fig3", {"cable.length": "3 m"}).at(gamma=6.0), model="vacuum"
    ),
    "floating": lambda: answer_scene(make_scene(FLOATING)),
    "long and thin": lambda: answer_scene(make_scene(changed(cable__length=2000, tow__speed=0.15))),
    "short beside its circle": lambda: answer_scene(make_scene(changed(tow__radius=3000))),
    "named at length": lambda: answer_scene(make_scene(changed(title="$\\frac{1}{2$ <b>and</b> " * 12)), asked=SHAPED),
    "outward": lambda: answer_scene(read_scene("skop-fig3", {"cable.length": "16 mm"}).at(gamma=5.0), model="vacuum"),
    "without jumps": lambda: answer_scene(make_scene(changed()), asked=SHAPED),
}


@pytest.fixture(scope="module")
def answers():
    return functools.cache(lambda name: SCENES[name]())


@pytest.fixture(scope="module")
def figures(answers):
    """Drawn once, at another resolution than that at which labels were placed."""

    @functools.cache
    def figure_of(name):
        figure = plot_scene(answers(name))
        figure.set_dpi(150)
        figure.canvas.draw()
        return figure

    return figure_of


def drawn_texts(figure, monkeypatch):
    """Everything that is written, with its box: of ticks those that are drawn."""
    drawn, draw = [], Text.draw
    monkeypatch.setattr(Text, "draw", lambda text, *arguments: (drawn.append(text), draw(text, *arguments))[1])
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    shown = [text for text in dict.fromkeys(drawn) if text.get_visible() and text.get_text().strip()]
    return [(text, Text.get_window_extent(text, canvas.get_renderer())) for text in shown]


@pytest.mark.parametrize("name", list(SCENES))
def test_nothing_covers_a_label(monkeypatch, figures, name):
    figure = figures(name)
    shown = drawn_texts(figure, monkeypatch)
    for k, (text, box) in enumerate(shown):
        assert figure.bbox.contains(box.x0, box.y0), text.get_text()
        assert figure.bbox.contains(box.x1, box.y1), text.get_text()
        for other, second in shown[:k]:
            assert not box.overlaps(second), (text.get_text(), other.get_text())
    labels = [(text, box) for text, box in shown if isinstance(text, Annotation)]
    assert len(labels) >= 2
    for text, box in labels:
        axes = text.axes
        for line in axes.lines:
            path = line.get_path().transformed(line.get_transform())
            if line.get_linestyle() != "None":
                assert not path.intersects_bbox(box, filled=False), (text.get_text(), line)
            if line.get_marker() not in ("None", ""):
                reach = 0.5 * line.get_markersize() * figure.dpi / 72.0
                near = [box.padded(reach).contains(*point) for point in path.vertices]
                assert not any(near), (text.get_text(), line.get_marker())
        for lines in axes.collections:
            for path in lines.get_paths():
                assert not path.transformed(lines.get_transform()).intersects_bbox(box, filled=False), text.get_text()


def panels_of(figure):
    return [axes for axes in figure.axes if "side view" in axes.get_title() or "from above" in axes.get_title()]


@pytest.mark.parametrize("name", list(SCENES))
def test_true_proportions(answers, figures, name):
    """A metre is as long across as down, but for what the title says; all of the cable is in sight."""
    answer, panels = answers(name), panels_of(figures(name))
    assert len(panels) >= 2
    for axes in panels:
        metre = np.abs(np.diff(axes.transData.transform([(0.0, 0.0), (1.0, 1.0)]), axis=0))[0]
        title = axes.get_title()
        stretched = float(title.rpartition("stretched ")[2].split()[0]) if "stretched" in title else 1.0
        # Matplotlib leaves what is within 0.5 % as it is.
        assert metre[0] / metre[1] == pytest.approx(1.0 / stretched if "depth str" in title else stretched, rel=5e-3)
        cable = np.concatenate(axes.collections[0].get_segments())
        assert Axes.get_window_extent(axes).contains(*axes.transData.transform(cable.min(axis=0)))
        assert Axes.get_window_extent(axes).contains(*axes.transData.transform(cable.max(axis=0)))
        # The end of the cable is where the answer has the fish.
        shape = answer.shape()
        across, down = cable[-1]
        if "side view" in title:
            assert down == pytest.approx(shape.attrs["z_f_m"], rel=1e-9)
        else:
            across += answer.scene.radius if "from the tow point" in axes.get_xlabel() else 0.0
            known = shape.attrs["x_f_m"], shape.attrs["y_f_m"]
            assert (across, down) == pytest.approx(known, rel=1e-9, abs=1e-12 * answer.scene.radius)


def test_side_view_shows_the_distance_to_the_fish(answers, figures):
    answer = answers("one in water")
    side, _ = panels_of(figures("one in water"))
    shape = answer.shape()
    distance = np.hypot(shape.attrs["x_f_m"] - answer.scene.radius, shape.attrs["y_f_m"])
    across = np.concatenate(side.collections[0].get_segments())[:, 0]
    assert (across[0], across[-1]) == pytest.approx((0.0, distance), rel=1e-9, abs=1e-9)
    assert "from the tow point towards the fish" in side.get_xlabel()


@pytest.mark.parametrize("turn", ["starboard", "port"])
def test_seen_from_above(turn):
    """The centre of the circle is to starboard of the arrow in a turn to starboard, and the cable trails behind it."""
    answer = answer_scene(make_scene(changed(tow__turn=turn, tow__radius=400)), asked=SHAPED)
    figure = plot_scene(answer)
    figure.canvas.draw()
    plan = next(axes for axes in panels_of(figure) if f"from above, turning to {turn}" in axes.get_title())
    (arrow,) = (text for text in plan.texts if not text.get_text())
    tow, ahead, centre = plan.transData.transform([arrow.xyann, arrow.xy, (0.0, 0.0)])
    fish = plan.transData.transform(plan.collections[0].get_segments()[-1][-1])
    right = (ahead - tow)[1] * (centre - tow)[0] - (ahead - tow)[0] * (centre - tow)[1]
    assert (right > 0.0) == (turn == "starboard")
    assert (fish - tow) @ (ahead - tow) < 0.0


def test_speeds(answers, figures):
    """Between the jumps as many shapes as are drawn, counted anew; the scene's speed where the scene has it."""
    answer = answers("nineteen in a vacuum")
    scene, system = answer.scene, answer.equilibria.system
    axes = figures("nineteen in a vacuum").axes[-1]
    speeds, counts = axes.lines[0].get_data()
    ends = np.unique(speeds)
    assert len(ends) == len(answer.folds) + 2
    rng = np.random.default_rng(7)
    for speed in rng.uniform(ends[:-1], ends[1:])[::4]:
        drawn = counts[np.searchsorted(speeds, speed)]
        assert len(towatlas.equilibria(system.lam, system.w_f, speed / scene.speed_of(1.0))) == drawn
    assert axes.lines[2].get_xdata()[0] == scene.speed
    written = [text.get_text() for text in axes.texts]
    assert f"you are here: {scene.speed:.4g} m/s, {scene.speed / 0.514444:.4g} kn" in written
    assert len(written) > 4


def test_one_shape_alone(answers):
    answer = answers("three shapes in air")
    figure = plot_scene(answer, "shape 3")
    panels = panels_of(figure)
    assert {text.get_text() for axes in panels for text in axes.texts} == {"", "shape 3"}
    tension = panels[0].collections[0].get_array()
    curve = answer.shape("shape 3")
    assert (tension[0], tension[-1]) == pytest.approx((float(curve["T"][0]), float(curve["T"][-1])), rel=1e-2)
    assert "tension of shape 3 (N)" in [axes.get_ylabel() for axes in figure.axes]


def test_labels_without_a_place_are_left_out():
    _, axes = plt.subplots(figsize=(2.0, 2.0))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    many = [Label(f"label {k}", 0.5 + 0.01 * k, 0.5) for k in range(60)]
    written = place_labels(axes, many)
    assert 1 < len(written) < 60
    # The same point twice is named once; a text that is wider than the axes has no place.
    assert len(place_labels(axes, [Label("a", 0.1, 0.1), Label("b", 0.1, 0.1), Label("w" * 99, 0.9, 0.9)])) == 1
    plt.close("all")


def test_figures_of_the_shell(capsys, wet, tmp_path):
    arguments = (wet, "--model", "water", "--out")
    for command, file, start in (
        ("scene", "scene.svg", b"<?xml"),
        ("scene", "again.svg", b"<?xml"),
        ("scene", "scene.PNG", b"\x89PNG"),
        ("shape", "shape.pdf", b"%PDF"),
    ):
        code, out, err = run(capsys, command, *arguments, tmp_path / "made" / file)
        assert (code, out) == (0, "")
        assert f"wrote {tmp_path / 'made' / file}" in err
        assert (tmp_path / "made" / file).read_bytes().startswith(start)
    assert (tmp_path / "made" / "again.svg").read_bytes() == (tmp_path / "made" / "scene.svg").read_bytes()


class Page(html.parser.HTMLParser):
    """What a page is made of: elements, what they ask for from elsewhere, and its text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.asked, self.words, self.open = set(), [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.open.append(tag)
        self.asked += [value for name, value in attributes if name in ("src", "href", "xlink:href", "data", "action")]

    def handle_endtag(self, tag):
        if tag in self.open:
            while self.open.pop() != tag:
                pass

    def handle_data(self, data):
        if "style" not in self.open:
            self.words.append(data)


@pytest.mark.parametrize("compare", [False, True])
def test_page(capsys, wet, tmp_path, compare):
    """All that `towatlas scene` prints, escaped, beside the figure, and nothing that is fetched."""
    more = ("--compare",) if compare else ()
    _, printed, _ = run(capsys, "scene", wet, *more)
    path = tmp_path / "scene.html"
    code, out, err = run(capsys, "scene", wet, *more, "--out", path)
    assert (code, out) == (0, "")
    assert f"wrote {path}" in err
    text = path.read_text(encoding="utf-8")
    page = Page(text)
    assert not page.tags & {"script", "link", "iframe", "object", "embed", "ship"}
    # The colours of the bar are an image within.
    assert all(asked.startswith(("#", "data:image/png;base64,")) for asked in page.asked)
    assert not re.findall(r"url\((?!#)|@import|http(?!://www\.w3\.org/)", text)
    words = " ".join("".join(page.words).replace("\u2212", "-").replace("\xa0", " ").split())
    assert words.startswith("Survey $below$ a <ship>")
    numbers = re.findall(r"-?\d+\.\d+", printed)
    assert len(numbers) > 15
    assert [number for number in numbers if number not in words] == []
    for sentence in (*printed.split("\n\n")[0].splitlines(), *printed.split("\n\n")[-1].strip().splitlines()):
        assert sentence in words
    assert ("Comparison of the models" in words) == ("Critical speeds, vacuum model" in words) == compare
    assert "<svg" in text


def test_page_in_a_vacuum(capsys, tmp_path):
    path = tmp_path / "page.html"
    assert run(capsys, "scene", "skop-fig3", "--model", "vacuum", "--asked", "nodes", "--out", path)[0] == 0
    words = "".join(Page(path.read_text(encoding="utf-8")).words)
    assert "Critical speeds, vacuum model, 6 of 19" in words
    assert "the vacuum model leaves out cable.drag_coefficient" in words
    assert "jumps from" not in words


def test_what_can_be_drawn_is_listed(capsys):
    code, out, _ = run(capsys, "plot", "--help")
    assert code == 0
    for line in ("critical  ", "drag  ", "scene SCENE --out FILE", "shape SCENE --out FILE", "sweep SCENE"):
        assert re.search(rf"^  {re.escape(line)}.* \w+", out, re.M), line
