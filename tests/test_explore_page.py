"""The page that explores scenes, driven in a browser from file://, with keyboard and pointer."""

import json
from pathlib import Path

import numpy as np
import pytest
from browser import Page, find_browser

import towatlas
from towatlas.scene.file import read_scene
from towatlas.solve.critical import solve_critical

pytestmark = pytest.mark.skipif(find_browser() is None, reason="no Chromium or Chrome is installed")

# By `make figures`.
SHIPPED = Path(__file__).parents[1] / "docs" / "explore.html"
SLIDERS = ("speed", "length", "mass_per_length", "fish_mass", "radius")
ARROW_RIGHT, HOME, SPACE, TAB = ("ArrowRight", 39), ("Home", 36), (" ", 32), ("Tab", 9)
# What a person would wait.
SETTLED = (
    "new Promise((done) => { const look = () => jobs.size ? setTimeout(look, 20) : setTimeout(done, 20); look(); })"
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    page = Page(tmp_path_factory.mktemp("browser"))
    yield page
    page.close()


@pytest.fixture
def page(browser):
    browser.resize(1280, 900)
    browser.open(SHIPPED)
    browser.errors.clear()
    browser.requests.clear()
    browser.open(SHIPPED)
    yield browser
    assert browser.errors == []
    # The page itself, and nothing after it.
    assert [url.partition(":")[0] for url in browser.requests] == ["file"]


def say(page):
    return page.run("document.getElementById('now').textContent")


def seen(page):
    """What is written about the shapes, and how they are drawn."""
    return page.run("$('now').textContent + $('rows').textContent + $('side').innerHTML + $('close').innerHTML")


def put(page, name, value):
    """A number typed into a box."""
    page.run(
        f"(() => {{ const box = document.getElementById('{name}'); box.focus(); box.value = '{value}';"
        " box.dispatchEvent(new Event('change')); box.blur(); })()"
    )


def paste(page, text):
    page.run(f"document.getElementById('toml').value = {json.dumps(text)}; document.getElementById('take').click()")
    return page.run("document.getElementById('wrong').textContent")


def test_every_slider_moves_with_the_keys_and_what_is_said_with_it(page):
    for name in SLIDERS:
        before = seen(page), page.run(f"state.{name}")
        page.run(f"document.getElementById('{name}-slide').focus()")
        for _ in range(12):
            page.key(*ARROW_RIGHT)
        assert page.run(f"state.{name}") > before[1]
        assert seen(page) != before[0], name
        page.key(*HOME)
        assert page.run(f"state.{name}") < before[1]
        assert page.run(f"document.getElementById('{name}-slide').getAttribute('aria-valuetext')")
        page.run(SETTLED)
    assert page.run("state.fish_mass") == 0
    assert not page.run("withDrag()")


def test_numbers_on_show_are_those_of_the_package(page):
    page.run("document.getElementById('no-drag').click()")
    for length, speed in ((0.6604, 1.229), (0.9, 2.0), (0.3, 0.7)):
        put(page, "length", length)
        put(page, "m_s", speed)
        scene = read_scene("skop-fig3", {"cable.length": length, "tow.speed": speed})
        groups = scene.system("vacuum")
        ours = towatlas.equilibria(groups.lam, groups.w_f, scene.gamma)
        shapes = page.run("shapesNow().map(({ name, r_f, z_f, tension }) => ({ name, r_f, z_f, tension }))")
        order = np.argsort(ours.r_f)
        assert [shape["name"] for shape in shapes] == list(ours.branch[order])
        force = scene.force_unit("vacuum")
        for name, values in (("r_f", ours.r_f * scene.radius), ("tension", ours.tension * force)):
            np.testing.assert_allclose([shape[name] for shape in shapes], values[order], rtol=1e-9)
        n = page.run("critical.map((one) => one.n)")
        speeds = scene.speed_of(solve_critical(groups.lam, groups.w_f, n).gamma)
        np.testing.assert_allclose(page.run("critical.map((one) => one.gamma * groups().unit)"), speeds, rtol=1e-9)
        # As it is written.
        rows = page.run("[...document.querySelectorAll('#critical-rows tr')].map((row) => row.cells[3].textContent)")
        np.testing.assert_allclose([float(row) for row in rows], speeds, rtol=1e-4)
        words = page.run("document.querySelectorAll('#rows tr').length")
        assert words == len(ours)


def test_critical_speeds_do_not_depend_on_what_was_asked_before(page):
    asked = "criticalStates(2.5, 0.3, {}, 40).map((one) => one.gamma)"
    before = page.run(asked.format(0.5))
    assert len(page.run(asked.format(9.0))) >= len(before)
    page.run("criticalStates(20, 0.3, 9, 40)")
    beyond = page.run("criticalStates(20, 0.3, 9, 40).map((one) => one.gamma)")
    few = page.run("criticalStates(20, 0.3, 1, 40).map((one) => one.gamma)")
    assert few == beyond[: len(few)]
    assert len(few) < len(beyond)
    assert sum(gamma > 1 for gamma in few) == 1
    assert page.run(asked.format(0.5)) == before


def test_windows_of_flutter_in_a_vacuum_are_those_of_the_package(page):
    page.run("document.getElementById('no-drag').click()")
    page.run(SETTLED)
    scene = read_scene("skop-fig3")
    groups, unit = scene.system("vacuum"), scene.speed / scene.gamma
    low, high = 0.88 * scene.gamma, 1.7 * scene.gamma
    ours = towatlas.flutter(groups.lam, groups.w_f, (low, high))
    parts = "computed.parts.filter((one) => one.n && !one.outer)"
    points = "one.points[0].speed, one.points[one.points.length - 1].speed"
    theirs = page.run(f"{parts}.map((one) => [`${{one.n}} inner`, one.kind, {points}])")
    grows = [part for part in theirs if part[1] != "stable" and part[3] > low * unit and part[2] < high * unit]
    windows = [one for one in ours.windows if one.branch.endswith("inner")]
    assert len(windows) > 3
    assert [one.branch for one in windows] == [name for name, *_ in grows]
    for window, (_, kind, begins, ceases) in zip(windows, grows, strict=True):
        assert kind == ("weak" if window.weak else "flutter")
        # Edges are halved to a thousandth.
        assert (begins, ceases) == pytest.approx((window.low * unit, window.high * unit), rel=2e-3)
    # As it is written, and as the shape at one speed is judged.
    put(page, "m_s", 1.8)
    page.run(SETTLED)
    shape = page.run(
        "(({ name, growth, frequency }) => ({ name, growth, frequency }))(shapesNow().find((one) => one.expected))"
    )
    known = towatlas.stability(groups.lam, groups.w_f, 1.8 / unit)
    k, rate = list(known.equilibria.branch).index(shape["name"]), np.sqrt(scene.gravity / scene.radius)
    assert shape["growth"] == pytest.approx(known.growth[k] * rate, rel=1e-6)
    assert shape["frequency"] == pytest.approx(known.frequency[k] * rate / (2 * np.pi), rel=1e-6)
    assert "flutters: swings grow" in say(page)
    assert "flutters" in page.run("document.querySelector('#rising [aria-current]').textContent")
    assert "lasts" in page.run("document.getElementById('then').textContent")


def test_what_is_not_computed_is_said(page):
    page.run("document.getElementById('no-drag').click()")
    page.run("jobs.clear()")
    put(page, "m_s", 8.0)
    page.run(SETTLED.replace("jobs.size", "jobs.has('verdicts')"))
    page.run("jobs.clear()")
    assert page.run("shapesNow().find((one) => one.expected).nodes") > 4
    assert "whether it flutters is not computed for this cable" in say(page)
    rows = page.run("[...document.querySelectorAll('#rows tr')].map((row) => row.textContent)")
    assert sum("not computed for this cable" in row for row in rows) >= 2


def test_with_drag_it_says_what_the_diagram_says(page):
    table = page.run("(({ rising, low, high }) => ({ rising, low, high }))(known.tables[0])")
    assert page.run("withDrag()")
    for part in table["rising"]:
        put(page, "m_s", 0.5 * (part["low"] + part["high"]))
        now = page.run("(({ kind, nodes }) => ({ kind, nodes }))(shapesNow().find((one) => one.expected))")
        assert part["nodes"][0] <= now["nodes"] <= part["nodes"][1]
        assert ("flutter" in say(page)) == (part["kind"] == "flutter")
        assert page.run("document.querySelectorAll('#rising [aria-current]').length") == 1
    put(page, "m_s", 2 * table["high"])
    assert f"the table covers {page.run('speedText(known.tables[0].low)')} to " in say(page)
    assert page.run("$('then').textContent") == ""
    assert page.run("document.querySelectorAll('#rising [aria-current]').length") == 0
    put(page, "m_s", 1.0)
    # Another cable has no table; back to the scene there is one.
    put(page, "radius", 0.02)
    assert not page.run("withDrag()")
    assert page.run("document.getElementById('with-drag').disabled")
    assert page.run("document.getElementById('radius').value") == "0.02"
    page.run("document.getElementById('back').click()")
    assert page.run("withDrag()")


@pytest.mark.parametrize("speed", [0.4321, 1.2345, 1.4187, 2.4])
def test_drag_at_a_speed_of_no_sample_is_that_of_the_package(page, speed):
    put(page, "m_s", speed)
    scene = read_scene("skop-fig3").at(speed=speed)
    answer = towatlas.answer_scene(scene, model="air", asked=("position",))
    ours = answer.equilibria
    shapes = page.run("shapesNow().map((shape) => ({ ...shape, points: shape.curve() }))")
    order = np.argsort(ours.r_f)
    assert [shape["nodes"] for shape in shapes] == list(ours.nodes[order])
    # Straight lines between samples 1 % apart, worst at a peak of r_f.
    np.testing.assert_allclose([shape["r_f"] for shape in shapes], ours.r_f[order] * scene.radius, rtol=1e-2)
    tensions = ours.tension[order] * scene.force_unit("air")
    np.testing.assert_allclose([shape["tension"] for shape in shapes], tensions, rtol=2e-3)
    for shape, row in zip(shapes, order, strict=True):
        points = np.array(shape["points"])
        curve = answer.shape(int(row), np.linspace(0.0, scene.length, len(points)))
        wide = np.abs([curve.x, curve.y]).max()
        assert np.abs(points[:, 0] - curve.x.values).max() < 0.01 * wide
        assert np.abs(points[:, 1] - curve.y.values).max() < 0.01 * wide
        assert np.abs(points[:, 2] - curve.z.values).max() < 0.01 * scene.length


def test_every_scene_and_every_shape_can_be_shown(page):
    for k in range(page.run("known.tables.length")):
        page.run(f"$('scene').value = {k}; $('scene').dispatchEvent(new Event('change'))")
        assert "shape" in say(page)
        for row in range(page.run("document.querySelectorAll('#rows input').length")):
            before = page.run("document.getElementById('side').getAttribute('aria-label')")
            page.run(f"document.querySelectorAll('#rows input')[{row}].click()")
            after = page.run("document.getElementById('side').getAttribute('aria-label')")
            assert row == 0 or after != before
            assert page.run(f"document.querySelectorAll('#rows input')[{row}].checked")


HUGE = "[cable]\nlength = 1e200\nmass_per_length = 1\n[tow]\nradius = 1\nspeed = 1\n[fluid]\nname = 'vacuum'\n"
BAD = (
    "",
    "no TOML",
    "[cable]\nlength = 3",
    '[cable]\nlength = "3 kg"',
    "<img src=x onerror=alert(1)>",
    "[cable",
    "a = " + "9" * 400,
    HUGE,
)


@pytest.mark.parametrize("text", BAD)
def test_a_bad_scene_is_refused_in_words_and_nothing_changes(page, text):
    before = page.run("JSON.stringify(state)")
    assert paste(page, text)
    assert page.run("JSON.stringify(state)") == before
    assert page.run("document.querySelectorAll('img').length") == 0


def test_the_scene_on_show_can_be_pasted_back_and_another(page):
    before = page.run("JSON.stringify(CABLE_KEYS.map((key) => state[key]))")
    assert paste(page, page.run("document.getElementById('toml').value")) == ""
    assert page.run("JSON.stringify(CABLE_KEYS.map((key) => state[key]))") == before
    text = '[cable]\nlength = "1000 ft"\nmass_per_length = "0.3 lb/ft"\n[fish]\nmass = "200 lb"\n'
    text += '[tow]\nradius = "100 yd"\nspeed = "25 kn"\n[fluid]\nname = "vacuum"\n'
    assert paste(page, text) == ""
    page.run(SETTLED)
    assert page.run("state.length") == pytest.approx(304.8)
    assert page.run("document.getElementById('kn').value") == "25"
    assert "At 25 kn" in say(page)
    assert page.run("document.getElementById('toml').value") == text


BUOY = """[cable]
length = "30 m"
mass_per_length = "0.2 kg/m"
diameter = "10 mm"
drag_coefficient = 1.2
[fish]
mass = "5 kg"
volume = "1 l"
[tow]
radius = "8 m"
speed = "3 kn"
[fluid]
name = "water"
"""


def warning(page):
    return page.run("$('warning').getClientRects().length ? $('warning').textContent : ''")


def test_what_is_left_out_of_a_fluid_is_said_in_the_headline(page):
    assert warning(page) == ""
    assert "without drag" not in say(page)
    assert paste(page, BUOY) == ""
    assert say(page).startswith("At 3 kn (1.84 rpm), without drag and buoyancy, the cable")
    # By hand: mu + rho A is 0.2 + 0.07854 kg/m; C = 1000 * 1.2 * 0.01 * 8 / (2 * 0.27854); the drag at 1.5433 m/s is
    # 14.29 N/m, the weight 1.9613 N/m.
    assert "C = 172 " in warning(page)
    assert "7.3 times its weight" in warning(page)
    assert "39 % off" in warning(page)
    assert "towatlas explore FILE include both" in warning(page)
    assert paste(page, BUOY.replace('"water"', '"air"')) == ""
    assert "without drag, the cable" in say(page)
    assert "C = 0.29 " in warning(page)
    assert paste(page, BUOY.replace('"water"', '"vacuum"')) == ""
    assert "without" not in say(page)
    assert warning(page) == ""


def test_a_cable_moved_off_its_table_is_without_drag(page):
    put(page, "mass_per_length", 0.0007)
    assert "without drag, the cable" in say(page)
    scene = read_scene("skop-fig3", {"cable.mass_per_length": 0.0007})
    assert page.run("dragConstant(state)") == pytest.approx(scene.system("water").C, rel=1e-12)
    page.run("document.getElementById('back').click()")
    assert "without drag" not in say(page)
    page.run("document.getElementById('no-drag').click()")
    assert "without drag" in say(page)
    assert "C = 0.018" in warning(page)


def test_faster_in_a_vacuum_says_what_begins_and_what_goes_on(page):
    page.run("document.getElementById('no-drag').click()")
    put(page, "m_s", 0.05)
    assert "two other shapes begin, with one node; the one before goes on" in page.run("$('then').textContent")


@pytest.mark.parametrize(
    ("name", "value"),
    [("length", "-1"), ("speed", "0"), ("radius", ""), ("fish_mass", "-3"), ("kn", "0"), ("m_s", "1e308")],
)
def test_bad_numbers_are_refused(page, name, value):
    before = page.run("JSON.stringify(state)")
    put(page, "m_s" if name == "speed" else name, value)
    assert page.run("JSON.stringify(state)") == before


@pytest.mark.parametrize(
    ("length", "speed"), [(1e-6, 1.0), (1e6, 1.0), (0.66, 1e-6), (0.66, 1e6), (1e9, 1e9), (0.0175, 3.0)]
)
def test_extreme_cables_are_answered_or_refused_in_seconds(page, length, speed):
    page.run("document.getElementById('no-drag').click()")
    put(page, "length", length)
    put(page, "m_s", speed)
    page.run(SETTLED)
    assert "shape" in say(page)
    assert "NaN" not in page.run("document.querySelector('main').innerHTML")


def test_charts_are_drawn_in_the_unit_chosen(page):
    for unit in ("rpm", "m/s", "kn"):
        page.run(f"$('unit').value = '{unit}'; $('unit').dispatchEvent(new Event('change'))")
        assert f"speed of the tow point, {unit}" in page.run("$('diagram').textContent")
        assert f" {unit}: " in page.run("$('rising').textContent")


def test_a_click_on_a_chart_goes_there(page):
    for chart, name in (("diagram", "speed"), ("critical", "length"), ("tension", "speed")):
        before = page.run(f"state.{name}")
        box = page.run(
            f"(() => {{ const svg = document.getElementById('{chart}'); svg.scrollIntoView({{ block: 'center' }});"
            " const { x, y, width, height } = svg.getBoundingClientRect(); return [x, y, width, height]; })()"
        )
        page.click(box[0] + 0.8 * box[2], box[1] + 0.5 * box[3])
        assert page.run(f"state.{name}") > 1.2 * before
        page.run("document.getElementById('scene').value = 0; show(known.tables[0].scene, 0)")


def test_the_keyboard_reaches_every_control_and_each_has_a_name(page):
    page.run("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
    wanted = page.run(
        "[...document.querySelectorAll('input, select, textarea, button, summary')]"
        ".filter((one) => one.getClientRects().length && one.type !== 'radio').length"
    )
    reached = set()
    page.run("document.activeElement.blur()")
    for _ in range(wanted + 12):
        page.key(*TAB)
        reached.add(page.run("document.activeElement.id || document.activeElement.parentNode.id"))
    assert {"scene", "speed-slide", "kn", "rpm", "m_s", "length", "radius-slide", "toml", "take"} <= reached
    roles = {"slider", "spinbutton", "combobox", "radio", "textbox", "button", "image", "img"}
    named = [
        (node["role"]["value"], node.get("name", {}).get("value", ""))
        for node in page.accessible()
        if not node.get("ignored") and node["role"]["value"] in roles
    ]
    assert {"slider", "spinbutton", "radio", "textbox"} <= {role for role, _ in named}
    assert [role for role, name in named if not name.strip()] == []


def test_a_screen_reader_is_told_once_a_slider_rests(page):
    page.run("change({ speed: 1.5 })")
    page.run("new Promise((done) => setTimeout(done, 900))")
    spoken = page.run("document.getElementById('spoken').textContent")
    assert spoken.startswith(say(page))
    assert page.run("document.getElementById('spoken').getAttribute('aria-live')") == "polite"


@pytest.mark.parametrize("width", [320, 390, 768, 1280])
def test_nothing_overflows_sideways(page, width):
    page.resize(width, 844)
    page.run("draw()")
    assert page.run("document.documentElement.scrollWidth") <= width
    # Drawn to the width there is.
    assert page.run("document.getElementById('diagram').viewBox.baseVal.width") <= width


def luminance(color):
    channels = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("dark", [False, True])
def test_text_and_lines_stand_out_in_light_and_dark(page, dark):
    page.theme(dark)
    names = ["ground", "panel", "ink", "soft", "accent", "lasts", "flutter", "left", "held"]
    style = "getComputedStyle(document.documentElement)"
    colors = {name: page.run(f"{style}.getPropertyValue('--{name}').trim()") for name in names}
    page.theme(False)
    assert (luminance(colors["ground"]) < 0.1) == dark

    def contrast(one, other):
        low, high = sorted(luminance(colors[name]) for name in (one, other))
        return (high + 0.05) / (low + 0.05)

    # WCAG 2.2: 4.5 for text, 3 for lines.
    for ground in ("ground", "panel"):
        assert min(contrast(name, ground) for name in ("ink", "soft", "left")) > 4.5
    assert min(contrast(name, "ground") for name in ("lasts", "flutter", "left", "held", "accent")) > 3.0
