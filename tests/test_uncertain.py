"""Uncertain keys of a scene: how they are written, the scatter of types of cable, and intervals to first order."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import changed, run
from test_sensitivities import DEEP, STRANDED

import towatlas
from towatlas.scene.file import make_scene, read_scene, scene_numbers
from towatlas.scene.jumps import answer_scene
from towatlas.scene.margins import margins_of
from towatlas.scene.models import system_of
from towatlas.scene.sensitivities import sensitivities_of
from towatlas.scene.units import parse_quantity, parse_uncertain

KNOT = 1852 / 3600
ALONG = {"tangential_drag_coefficient": 0.02, "tangential_drag_on": "d"}


@pytest.mark.parametrize(
    ("text", "unit", "value", "deviation"),
    [
        ("1.2 +- 0.2", "", 1.2, 0.2),
        ("1.2 ± 0.2", "", 1.2, 0.2),
        ("1.2 +/- 10 %", "", 1.2, 0.12),
        ("50 % +- 5 %", "", 0.5, 0.05),
        ("12 mm +- 0.5 mm", "m", 0.012, 0.0005),
        ("12 +- 0.5 mm", "m", 0.012, 0.0005),
        ("(12 +- 0.5) mm", "m", 0.012, 0.0005),
        ("12 mm +- 0.05 cm", "m", 0.012, 0.0005),
        ("12 mm+-5%", "m", 0.012, 0.0006),
        ("11/16 in +- 1/64 in", "m", 0.0254 * 11 / 16, 0.0254 / 64),
        ("-3 N +- 10 %", "N", -3.0, 0.3),
        ("4 kn +- 0", "m/s", 4 * KNOT, None),
        ("4 kn +- 0 kn", "m/s", 4 * KNOT, 0.0),
        ("30 deg +- 2 deg", "rad", math.pi / 6, math.pi / 90),
        (3, "m", 3.0, 0.0),
        ("3 m", "m", 3.0, 0.0),
    ],
)
def test_values_with_deviations(text, unit, value, deviation):
    if deviation is None:
        with pytest.raises(ValueError, match="0 has no unit"):
            parse_uncertain("key", text, unit)
        return
    assert parse_uncertain("key", text, unit) == pytest.approx((value, deviation), rel=4e-16)


@pytest.mark.parametrize(
    ("text", "unit", "match"),
    [
        ("1.2 +- -0.2", "", "the deviation of key = '-0.2' is negative: what stands behind +- is a standard deviation"),
        ("12 mm +- -10 %", "m", "the deviation of key = '-10 %' is negative"),
        ("+- 0.2", "", "is no value with its standard deviation; write them as"),
        ("1.2 +-", "", "is no value with its standard deviation"),
        ("1 +- 2 +- 3", "", "is no value with its standard deviation"),
        ("12 mm +- 0.5", "m", "0.5 has no unit; write them as"),
        ("12 +- 0.5", "m", "0.5 has no unit"),
        ("12 mm +- 1 kg", "m", "the deviation of key = '1 kg' is not a length"),
        ("1.2 + -0.2", "", "is unknown"),
        ("1.2 +- nan", "", "the deviation of key = 'nan' is not a pure number"),
        ("1.2 +- 1e999", "", "is not finite"),
        ("1" * 99 + " +- 1", "", "is not a pure number"),
    ],
)
def test_bad_deviations(text, unit, match):
    with pytest.raises(ValueError, match=re.escape(match)):
        parse_uncertain("key", text, unit)


def test_where_no_deviation_is_taken():
    with pytest.raises(ValueError, match="takes no standard deviation"):
        parse_quantity("speed", "3 kn +- 1 kn", "m/s")
    with pytest.raises(ValueError, match=r"tolerance = '0.01 \+- 0.1' takes no standard deviation"):
        make_scene(changed(tolerance="0.01 +- 0.1"))
    with pytest.raises(ValueError, match="zero"):
        make_scene(changed(cable__breaking_strength="0 N"))


def test_a_value_that_is_hardly_known_is_asked_about():
    (note,) = make_scene(changed(cable__drag_coefficient="1.4 +- 60 %")).notes
    assert note.startswith("cable.drag_coefficient = '1.4 +- 60 %' is hardly known")
    assert make_scene(changed(cable__drag_coefficient="1.4 +- 40 %")).notes == ()


def test_deviations_of_a_scene():
    """Those of keys go with them: another speed or length is exact, a key of the scene goes before that of its type."""
    scene = make_scene(changed(cable__length="150 m +- 2 m", tow__speed="4 kn +- 0.1 kn", fish__mass="60 kg +- 5 %"))
    assert scene.deviations == pytest.approx({"cable.length": 2.0, "tow.speed": 0.1 * KNOT, "fish.mass": 3.0})
    assert scene == make_scene(changed(tow__speed="4 kn"))
    assert set(scene.at(speed=3.0).deviations) == {"cable.length", "fish.mass"}
    assert set(towatlas.scene.designs.with_length(scene, 3.0).deviations) == {"tow.speed", "fish.mass"}
    stranded = make_scene(STRANDED)
    side = stranded.deviations["cable.side_force_coefficient"]
    assert stranded.deviations["cable.drag_coefficient"] == 0.33
    assert stranded.deviations["cable.tangential_drag_coefficient"] == 0.004
    # In the middle of the angles measured, 5.25 degrees, a of that size makes about 0.0007 of C_s.
    s = math.sin(math.radians(5.25))
    assert side * s / (1 + (s / 0.1802) ** 2) == pytest.approx(0.0007, rel=0.1)
    own = STRANDED | {"cable": STRANDED["cable"] | {"drag_coefficient": 1.3}}
    assert set(make_scene(own).deviations) == {
        "cable.tangential_drag_coefficient",
        "cable.side_force_coefficient",
    }


def test_intervals_against_a_sample():
    """300 scenes with normal keys, a fifth as uncertain as the type of cable says: within 4 standard errors."""
    scene = make_scene(STRANDED)
    scene = replace(scene, deviations={key: value / 5 for key, value in scene.deviations.items()})
    spread = margins_of(answer_scene(scene, model="water")).deviations
    rng, count = np.random.default_rng(1), 300
    scenes = [
        replace(scene, **scene_numbers(scene.values | {key: scene.values[key] + d * z for (key, d), z in drawn}))
        for drawn in (list(zip(scene.deviations.items(), rng.standard_normal(3), strict=True)) for _ in range(count))
    ]
    systems = [system_of(one, "water") for one in scenes]
    numbers = {name: np.array([getattr(one, name) for one in systems]) for name in vars(systems[0])}
    found = towatlas.equilibria_many(**numbers, gamma=scene.gamma)
    assert (found["count"].values == 1).all()
    depth = found.z_f.values[:, 0] * scene.radius
    tension = found.tension.values[:, 0] * scene.force_unit("water")
    assert np.std(depth, ddof=1) == pytest.approx(spread["depth"], rel=4 / math.sqrt(2 * count))
    assert np.std(tension, ddof=1) == pytest.approx(spread["tension"], rel=4 / math.sqrt(2 * count))
    assert np.mean(depth) == pytest.approx(depth[0], abs=4 * spread["depth"])


def test_intervals_of_a_jump_by_both_ends():
    """Half the distance between the jumps of scenes one deviation to either side: odd terms are left, a thousandth."""
    scene = make_scene(changed(cable__drag_coefficient="1.4 +- 0.05", cable__length="800 m +- 20 m", tow__speed="5 kn"))
    scene = replace(scene, deviations=scene.deviations)
    answer = answer_scene(scene, model="vacuum")
    (below, above) = margins_of(answer).jumps
    assert not below.exists
    ends = []
    for way in (-1, 1):
        one = answer_scene(make_scene(changed(cable__length=800 + 20 * way, tow__speed="5 kn")), model="vacuum")
        ends.append(margins_of(one).jumps[1].speed)
    assert above.deviation == pytest.approx(0.5 * abs(ends[1] - ends[0]), rel=2e-3)
    assert above.distance_deviation == above.deviation


def test_an_uncertain_speed_is_part_of_the_distance():
    """A jump does not move with the speed of the scene; how far it is does. In tow radii both may move together."""
    scene = read_scene("skop-fig3", {"tow.speed": "2 m/s +- 0.1 m/s"})
    above = margins_of(answer_scene(scene, model="vacuum")).jumps[1]
    assert above.deviation == pytest.approx(0.0, abs=1e-12)
    assert above.distance_deviation == pytest.approx(0.1, rel=1e-12)
    near = read_scene("skop-fig3", {"tow.speed": f"{0.97 * above.speed!r} m/s +- 5 %"})
    assert margins_of(answer_scene(near, model="vacuum")).jumps[1].may_be_passed
    assert not above.may_be_passed


def test_sums_that_units_ask_for():
    """Masses and densities scaled together move forces alone; lengths, masses as their cubes and speeds as their roots
    scale depth as a length, forces as masses, and jumps as speeds."""
    kites = {"side_force_coefficient": 0.1, "side_force_sine": 0.2, "kites": "starboard", **ALONG}
    stranded = changed(tow__speed="4 kn", tow__turn="port", **{f"cable__{key}": value for key, value in kites.items()})
    for table, model in ((stranded, "water"), (changed(tow__speed="4 kn"), "air"), (DEEP, "vacuum")):
        found = sensitivities_of(answer_scene(make_scene(table), model=model))
        mass = {"cable.mass_per_length": 1, "fish.mass": 1, "fluid.density": 1, "fish.added_mass": 1}
        length = {
            "cable.length": 1,
            "cable.mass_per_length": 2,
            "cable.diameter": 1,
            "fish.mass": 3,
            "fish.added_mass": 3,
            "fish.volume": 3,
            "fish.frontal_area": 2,
            "tow.radius": 1,
            "tow.speed": 0.5,
        }
        expected = {"depth": (0, 1), "tension": (1, 3), "largest_tension": (1, 3)}
        expected |= dict.fromkeys(("speed", "jump_below", "jump_above"), (0, 0.5))
        assert len(found.quantities) >= 4
        for quantity in found.quantities:
            shares = dict(zip(found.keys, found.elasticities(quantity), strict=True))
            for exponents, sum_ in zip((mass, length), expected[quantity.name], strict=True):
                total = sum(power * shares.get(key, 0.0) for key, power in exponents.items())
                assert total == pytest.approx(sum_, abs=1e-10), (quantity.name, exponents)


def test_shell(capsys, tmp_path):
    scene = tmp_path / "scene.toml"
    text = '[cable]\nlength = "{}"\nmass_per_length = 1\n[tow]\nradius = 1\nspeed = "2 m/s"\n[fluid]\nname = "vacuum"\n'
    for length, message in (
        ("8 m +- -1 m", "the deviation of cable.length = '-1 m' is negative"),
        ("+- 1 m", "no value"),
    ):
        scene.write_text(text.format(length))
        code, out, err = run(capsys, "scene", scene)
        assert (code, out) == (2, "")
        assert message in err
    scene.write_text(text.format("8 m +- 10 cm"))
    code, out, _ = run(capsys, "scene", scene)
    assert code == 0
    assert "expected shape, +- 1 sd of cable.length to first order: depth" in out


def test_what_is_uncertain_for_nothing_is_said(capsys, tmp_path):
    """A key that the model used leaves out: drag in a vacuum."""
    file = tmp_path / "scene.toml"
    text = "[cable]\nlength = {}\nmass_per_length = 1\ndiameter = 0.01\ndrag_coefficient = '1.2 +- 0.2'\n"
    text += "[tow]\nradius = 1\nspeed = 2\n[fluid]\nname = 'air'\n"
    for length, shown in ((8, False), ("'8 m +- 10 cm'", True)):
        file.write_text(text.format(length))
        code, out, err = run(capsys, "scene", file, "--model", "vacuum")
        assert code == 0
        assert "cable.drag_coefficient: no part of the vacuum model, in which being uncertain does nothing" in err
        assert ("+- 1 sd of cable.length to first order" in out) == shown
    assert "no part of" not in run(capsys, "scene", file, "--model", "air")[2]
