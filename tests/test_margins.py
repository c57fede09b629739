"""How far a scene is from trouble: what the nearest jumps cost, the largest tension, and exit codes."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers import WET, changed, run
from test_folds import DEEP, WIRE

import towatlas
from towatlas.scene import margins
from towatlas.scene.designs import design
from towatlas.scene.file import make_scene, read_scene
from towatlas.scene.jumps import answer_scene
from towatlas.scene.margins import margins_of
from towatlas.scene.models import solve_model


def hangs(scene, model, speed, k=None):
    """Nodes, depth, radius and tension of the shape expected at a speed, or of another."""
    answer = solve_model(scene.at(speed=speed), model)
    found = answer.equilibria
    k = found.expected if k is None else k
    force = scene.force_unit(model)
    return found.nodes[k], *(np.array([found.z_f[k], found.r_f[k]]) * scene.radius), found.tension[k] * force


def same(shape, other, rel):
    return (shape.nodes, shape.depth, shape.radius, shape.tension) == pytest.approx(other, rel=rel)


@pytest.mark.parametrize(
    ("scene", "model", "expected"),
    [
        (make_scene(DEEP), "water", ("goes on", "lost")),
        (make_scene(WIRE), "air", ("goes on", "lost")),
        (read_scene("skop-fig3").at(gamma=5.94), "vacuum", ("lost", "overtaken")),
        (read_scene("skop-fig3"), "air", ("lost", "overtaken")),
        (make_scene(DEEP | {"tow": DEEP["tow"] | {"turn": "port"}}), "water", ("goes on", "lost")),
    ],
    ids=["deep", "wire", "vacuum", "air", "port"],
)
def test_what_jumps_cost(scene, model, expected):
    """Against all shapes at speeds just to either side of each jump, where two are near the one that they meet in."""
    found = margins_of(answer_scene(scene, model=model))
    assert tuple(jump.cost.expected for jump in found.jumps) == expected
    for jump in found.jumps:
        way = 1.0 if jump.side == "above" else -1.0
        beyond, short = (jump.speed * (1 + sign * way * 1e-8) for sign in (1, -1))
        before, after = (hangs(scene, model, speed) for speed in (short, beyond))
        # Of the two that meet radii part with the root of the distance, by more the flatter they meet.
        assert same(jump.cost.before, before, 2e-3)
        assert same(jump.cost.after, after, 2e-3)
        counts = [len(solve_model(scene.at(speed=speed), model).equilibria) for speed in (short, beyond)]
        assert counts[0] - counts[1] == (2 if jump.cost.ends else -2)
        pair = short if jump.cost.ends else beyond
        near = [hangs(scene, model, pair, k) for k in range(max(counts))]
        assert sum(same(jump.cost.meeting, shape, 2e-3) for shape in near) == 2
        # The shape expected goes on, or is one that does not.
        moved = not same(jump.cost.before, tuple(vars(jump.cost.after).values()), 1e-6)
        assert moved == (jump.cost.expected != "goes on")


def test_scene_sweep_folds_and_design_agree():
    scene = make_scene(DEEP)
    found = margins_of(answer_scene(scene, model="water"))
    below, above = (jump.speed for jump in found.jumps)
    curve = towatlas.sweep(scene, speed=[0.95 * scene.speed, scene.speed, 1.05 * scene.speed], model="water")
    assert curve.jump.values[0] == pytest.approx([below, above], rel=1e-9)
    unit = scene.speed_of(1.0)
    groups = scene.system("water")
    numbers = {name: value for name, value in vars(groups).items() if name not in ("lam", "w_f")}
    folds = towatlas.folds(groups.lam, groups.w_f, (0.95 * scene.gamma, 1.05 * scene.gamma), **numbers)
    assert folds.gamma * unit == pytest.approx([below, above], rel=1e-9)
    expected = curve.depth.values[0, 1][curve.expected.values[0, 1]]
    designed = design(scene, float(expected[0]), model="water", max_length=1.2 * scene.length)
    (cable,) = (one for one in designed.cables if abs(one.length / scene.length - 1) < 1e-8)
    speeds = np.abs(cable.jumps.gamma) * unit
    for speed in (below, above):
        assert np.abs(speeds / speed - 1).min() < 1e-7
    assert cable.tension == pytest.approx(found.largest_tension, rel=1e-7)


def test_largest_tension_and_strength(capsys, tmp_path):
    """Exit code 6 where the cable is too weak, within a standard deviation of it."""
    scene = make_scene(WET)
    pull = margins_of(answer_scene(scene, model="water")).largest_tension
    for strength, breaks in ((1.01 * pull, False), (0.99 * pull, True), (f"{1.01 * pull!r} N +- 2 %", True)):
        found = margins_of(answer_scene(make_scene(changed(cable__breaking_strength=strength)), model="water"))
        assert found.breaks == breaks
        assert found.breaking_ratio == pytest.approx(1 / 1.01 if strength != 0.99 * pull else 1 / 0.99, rel=1e-12)
    assert not margins_of(answer_scene(scene, model="water")).breaks
    file = tmp_path / "scene.toml"
    text = "[cable]\nlength = 8\nmass_per_length = 1\nbreaking_strength = '{}'\n"
    text += "[tow]\nradius = 1\nspeed = 0.1\n[fluid]\nname = 'vacuum'\n"
    for strength, expected in (("20 lbf", 0), ("70 N", 6)):
        file.write_text(text.format(strength))
        code, out, err = run(capsys, "scene", file, "--json")
        answer = json.loads(out)
        # 8 kg hang all but straight.
        assert answer["largest_tension_N"] == pytest.approx(8 * 9.80665, rel=1e-3)
        assert (code, answer["largest_tension_at_m"]) == (expected, 0.0)
        assert answer["breaking_ratio"] == answer["largest_tension_N"] / answer["breaking_strength_N"]
        assert answer["largest_tension_others_N"] is None
        assert ("the largest tension, 78.4" in err) == (expected == 6)
    file.write_text(text.format("20 lbf"))
    assert "17.64 lbf at the tow point, 88.2 % of cable.breaking_strength" in run(capsys, "scene", file)[1]
    # Faster there are three shapes.
    file.write_text(text.format("20 lbf").replace("speed = 0.1", "gamma = 1.2"))
    answer, out = json.loads(run(capsys, "scene", file, "--json")[1]), run(capsys, "scene", file)[1]
    pulls = [shape["tension_N"] for shape in answer["equilibria"] if not shape["expected"]]
    assert answer["largest_tension_others_N"] >= max(pulls)
    ratio = 100 * answer["largest_tension_others_N"] / answer["breaking_strength_N"]
    assert (
        f"; in other shapes up to {answer['largest_tension_others_N'] / 4.4482216152605:.4g} lbf, {ratio:.3g} %" in out
    )


# gamma_c2 lies 3.5 % above, gamma_c1 at a twentieth.
ASK = ("scene", "skop-fig3", "--model", "vacuum", "--gamma", 3.3)


@pytest.mark.parametrize(
    ("asked", "code"),
    [("3%", 0), ("3.4 %", 0), ("3.6%", 6), ("40 %", 6), ("0.05 m/s", 6), ("0.04m/s", 0), ("0.1kn", 6)],
)
def test_a_margin_is_an_exit_code(capsys, asked, code):
    got, out, err = run(capsys, *ASK, "--margin", asked, "--json")
    answer = json.loads(out)
    assert (got, answer["margin_kept"]) == (code, code == 0)
    assert ("within the margin of" in err) == (code == 6)
    above = answer["nearest_jumps"]["above"]
    assert (abs(above["speed_m_s"] - answer["speed"]["speed_m_s"]) <= answer["margin_m_s"]) == (code == 6)
    groups = read_scene("skop-fig3").system("vacuum")
    second = towatlas.solve_critical(groups.lam, groups.w_f, 2).gamma
    assert above["distance_relative"] == pytest.approx(second / 3.3 - 1, rel=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--margin", "10"), "10 of what? Write 10% of the speed, or 10kn"),
        (("--margin=-5%",), "-5% is not positive"),
        (("--margin", "-5%"), "expected one argument"),
        (("--margin", "0%"), "0% is not positive"),
        (("--margin", "5 kg"), "'5 kg' is not a speed; write it as \"3 kn\"; or a share, as 10%"),
        (("--margin", "1 +- 1 %"), "takes no standard deviation"),
        (("--margin", "200%"), "--margin is 200 % of the speed; jumps are looked for within 96.7 %"),
        (("--margin", "5%", "--asked", "nodes"), "not looked for without --asked speeds"),
    ],
)
def test_bad_margins(capsys, arguments, message):
    code, out, err = run(capsys, *ASK, *arguments)
    assert (code, out) == (2, "")
    assert message in err


def test_the_margin_counts_from_the_near_end(capsys, tmp_path):
    """Of the interval of the distance, in which the speed of the scene is uncertain, too."""
    scene = read_scene("skop-fig3", {"tow.speed": "1.3 m/s +- 0.05 m/s"})
    found = margins_of(answer_scene(scene, model="vacuum"))
    apart = found.jumps[1].speed - 1.3
    assert found.within(0.99 * (apart - 0.05)) == []
    assert [jump.side for jump in found.within(1.01 * (apart - 0.05))] == ["above"]


def test_jumps_not_made_out_are_no_margin(capsys, monkeypatch):
    def incomplete(*arguments):
        return replace(margins_of(*arguments), complete=False)

    monkeypatch.setattr("towatlas.commands.scene.margins_of", incomplete)
    code, out, err = run(capsys, *ASK, "--margin", "1%")
    assert code == 1
    assert "that none lies within the margin is not known" in err
    assert out.endswith("others may lie between\n")
    assert run(capsys, *ASK, "--margin", "10%")[0] == 6
    assert json.loads(run(capsys, *ASK, "--margin", "1%", "--json")[1])["margin_kept"] is None


def test_what_cannot_be_computed_is_said(capsys, monkeypatch, tmp_path):
    """The answer stands; what a jump costs, and what pulls hardest, is said not to be known."""

    def fail(*arguments):
        raise ArithmeticError("too long")

    monkeypatch.setattr(margins, "solve_equilibria", fail)
    monkeypatch.setattr(margins, "largest_tension", fail)
    code, out, _ = run(capsys, *ASK)
    assert code == 0
    assert "; what it costs could not be computed: too long" in out
    assert "largest tension along the cable, expected shape: not computed" in out
    answer = json.loads(run(capsys, *ASK, "--json")[1])
    assert (answer["largest_tension_N"], answer["nearest_jumps"]["above"]["before"]) == (None, None)
    strong = make_scene(changed(cable__breaking_strength=1e9))
    assert margins_of(answer_scene(strong, model="vacuum")).breaks is False
    text = "[cable]\nlength = '8 m +- 1 m'\nmass_per_length = 1\nbreaking_strength = '9 kN'\n"
    (tmp_path / "scene.toml").write_text(f"{text}[tow]\nradius = 1\nspeed = 2\n[fluid]\nname = 'vacuum'\n")
    monkeypatch.setattr(margins, "sensitivities_of", fail)
    code, _, err = run(capsys, "scene", tmp_path / "scene.toml")
    assert code == 1
    assert "that it is below cable.breaking_strength is not known" in err
    # A jump whose interval is not known may be anywhere.
    code, out, err = run(capsys, "scene", tmp_path / "scene.toml", "--margin", "1%")
    assert code == 6
    assert "what the uncertainty of cable.length does could not be computed: too long" in out
    assert "+- unknown" in out
    assert "whose interval is not known" in err


def test_sensitivities_of_the_shell(capsys):
    code, out, _ = run(capsys, *ASK, "--sensitivities", "--json")
    rows = {row["key"]: row for row in json.loads(out)["sensitivities"]}
    assert code == 0
    assert set(rows) >= {"cable.length", "cable.mass_per_length", "fish.mass", "tow.radius", "tow.gamma"}
    length = rows["cable.length"]
    above = json.loads(out)["nearest_jumps"]["above"]["speed_m_s"]
    share, slope = length["jump_above"]["percent_per_percent"], length["jump_above"]["per_unit"]
    assert slope == pytest.approx(share * above / length["value"], rel=1e-12)
    # gamma_c2 at the threshold length has no bound: a longer cable jumps sooner.
    assert share < -0.5
    assert rows["fish.drag_coefficient"]["depth"]["per_unit"] is None
    text = run(capsys, *ASK, "--sensitivities")[1]
    assert f"{share:+.3g}" in text
    assert "sensitivities" not in run(capsys, *ASK)[1]
    assert json.loads(run(capsys, *ASK, "--json")[1])["sensitivities"] is None


@pytest.mark.parametrize(
    ("speed", "unit", "size"), [("3 km/h", "km/h", 1 / 3.6), ("15 rpm", "rpm", 0.9144 * np.pi / 30)]
)
def test_units_of_the_user(capsys, tmp_path, speed, unit, size):
    """Lengths and speeds as the scene has them; the first jump above is gamma_c1 of that cable."""
    key = "rpm" if unit == "rpm" else "speed"
    file = tmp_path / "scene.toml"
    file.write_text(
        f"[cable]\nlength = '30 ft'\nmass_per_length = 1\n[tow]\nradius = '3 ft'\n{key} = '{speed}'\n"
        "[fluid]\nname = 'vacuum'\n"
    )
    last = run(capsys, "scene", file)[1].splitlines()[-1]
    first = float(towatlas.solve_critical(10.0, 0.0, 1).gamma) * np.sqrt(0.9144 * 9.80665)
    assert f" {first:.5g} m/s, {first * 3600 / 1852:.5g} kn, {first / size:.5g} {unit} (+" in last
    assert " ft deep and " in last
