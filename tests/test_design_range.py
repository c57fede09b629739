"""Cables for a range of speeds."""

import json

import numpy as np
import pytest
from helpers import run
from test_folds import DEEP

from towatlas.scene.designs import design, with_length
from towatlas.scene.file import make_scene
from towatlas.scene.models import solve_model, system_of
from towatlas.scene.ranges import design_over
from towatlas.solve.folds import folds_in_speed

KNOT = 1852 / 3600
SURVEY = {
    "cable": {"mass_per_length": 0.5, "diameter": 0.012, "drag_coefficient": 1.4},
    "fish": {"mass": 60, "volume": 0.02, "added_mass": 10, "drag_coefficient": 0.5, "frontal_area": 0.03},
    "tow": {"radius": 40, "speed": 1.0},
    "fluid": {"density": 1025},
}


def spans(scene, model, length, speeds):
    """Depth, radius and tension of the shape expected at speeds, one by one."""
    rows = []
    for speed in speeds:
        answer = solve_model(with_length(scene.at(speed=float(speed)), length), model)
        rows.append((answer.position[2], np.hypot(*answer.position[:2]), answer.tension))
    return np.array(rows)


@pytest.fixture(scope="module")
def survey():
    return design_over(make_scene(SURVEY), 3 * KNOT, 5 * KNOT, depth=120.0)


def test_lengths_at_each_speed_are_those_of_a_design(survey):
    scene = make_scene(SURVEY)
    assert survey.model == "water"
    assert survey.speeds == pytest.approx(np.array([3, 3.5, 4, 4.5, 5]) * KNOT, rel=1e-14)
    for speed, found in zip(survey.speeds, survey.designs, strict=True):
        alone = design(scene.at(speed=float(speed)), 120.0, model="water")
        assert [cable.length for cable in found.cables] == pytest.approx([cable.length for cable in alone.cables])
    # As docs/scenes.md has it for 4 kn.
    (middle,) = survey.designs[2].cables
    assert middle.length == pytest.approx(136.71, abs=0.005)


def test_what_a_kept_length_does(survey):
    """Against shapes at 40 speeds, one by one; and one length in between is off by as much both ways."""
    scene, speeds = make_scene(SURVEY), np.linspace(3 * KNOT, 5 * KNOT, 40)
    assert [cable.length for cable in survey.cables] == sorted(cable.length for cable in survey.cables)
    (between,) = (cable for cable in survey.cables if not cable.speeds)
    for cable in (survey.cables[0], between):
        rows = spans(scene, "water", cable.length, speeds)
        for k, name in enumerate(("depth", "radius", "tension")):
            assert cable.spans[name] == pytest.approx((rows[:, k].min(), rows[:, k].max()), rel=1e-9)
        assert cable.off == pytest.approx(np.abs(rows[:, 0] - 120.0).max(), rel=1e-6)
        assert (len(cable.jumps), cable.complete) == (0, True)
    least, most = between.spans["depth"]
    # Even to a hundredth of what it is off by.
    assert 120.0 - least == pytest.approx(most - 120.0, abs=0.02 * between.off)
    assert between.off < min(cable.off for cable in survey.cables if cable.speeds)


@pytest.fixture(scope="module")
def deep():
    """Over 2.529 and 2.627 m/s, between which the cable of 26,900 ft has three shapes."""
    return design_over(make_scene(DEEP), 2.45, 2.7, points=2, depth=4000.0, model="water", max_length=9000.0)


@pytest.mark.slow
def test_jumps_inside_the_range(deep):
    """All folds of the length between the two speeds; and whether another shape is expected beyond."""
    assert deep.cables
    found = 0
    for cable in deep.cables:
        scene = with_length(make_scene(DEEP).at(speed=2.45), cable.length)
        system, unit = system_of(scene, "water"), scene.speed_of(1.0)
        folds = folds_in_speed(system, 2.45 / unit, 2.7 / unit, named=False)
        assert cable.jumps == pytest.approx(folds.gamma * unit, rel=1e-9)
        for speed, other in zip(cable.jumps, cable.other_beyond, strict=True):
            found += 1
            short, beyond = spans(scene, "water", cable.length, speed * np.array([1 - 1e-7, 1 + 1e-7]))
            assert (np.abs(beyond / short - 1).max() > 0.05) == other
            # The largest leap is part of the span.
            for row in (short, beyond):
                for k, name in enumerate(("depth", "radius", "tension")):
                    low, high = cable.spans[name]
                    assert low * (1 - 1e-2) <= row[k] <= high * (1 + 1e-2)
    assert found > 0
    assert any(cable.other_beyond.any() for cable in deep.cables)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"low": 2.0, "high": 1.0, "depth": 1.0}, "are no range"),
        ({"low": 0.0, "high": 1.0, "depth": 1.0}, "are no range"),
        ({"low": 1.0, "high": 2.0, "depth": 1.0, "points": 1}, "points must be 2 to 50, got 1"),
        ({"low": 1.0, "high": 2.0}, "exactly one of depth, radius, tension is wanted, got none"),
        ({"low": 1.0, "high": 2.0, "depth": 1.0, "model": "mud"}, "model must be one of"),
    ],
)
def test_bad_ranges(arguments, match):
    with pytest.raises(ValueError, match=match):
        design_over(make_scene(SURVEY), **arguments)


@pytest.fixture
def file(tmp_path):
    lines = []
    for section, keys in SURVEY.items():
        lines += [f"[{section}]", *(f"{key} = {json.dumps(value)}" for key, value in keys.items())]
    (tmp_path / "survey.toml").write_text("\n".join(lines))
    return tmp_path / "survey.toml"


def test_shell(capsys, file, survey):
    ask = ("design", "--scene", file, "--depth", "120m", "--speed", "3kn:5kn", "--model", "water")
    code, out, _ = run(capsys, *ask, "--json")
    answer = json.loads(out)
    assert code == 0
    assert [row["length_m"] for row in answer["kept"]] == pytest.approx([cable.length for cable in survey.cables])
    assert [row["speed_kn"] for row in answer["speeds"]] == pytest.approx([3, 3.5, 4, 4.5, 5])
    assert answer["kept"][0]["most_depth_m"] == pytest.approx(120.0, rel=1e-9)
    assert answer["kept"][0]["found_at_m_s"] == pytest.approx([3 * KNOT])
    code, out, _ = run(capsys, *ask, "--points", 3)
    assert code == 0
    assert out.splitlines()[-1].startswith("nearest: 136.8")
    assert out.endswith("m keeps the depth within 4.124 m of 120 m, without a jump in the range\n")
    code, out, _ = run(capsys, *ask, "--points", 3, "--within", "4.2m", "--json")
    assert (code, len(json.loads(out)["kept"])) == (0, 1)
    for limit, words in (
        (("--within", "1%"), "no length keeps the depth within 1.2 m of 120 m over the range: nearest comes 136.8"),
        (("--max-tension", "839N"), "no length keeps within the limits over the range"),
    ):
        code, out, err = run(capsys, *ask, "--points", 3, *limit, "--json")
        answer = json.loads(out)
        assert (code, answer["kept"] == []) == ((4, True) if "--within" in limit else (0, False))
        if code:
            assert words in err
            assert answer["reason"] in err
        else:
            assert all(row["most_tension_N"] <= 839 for row in answer["kept"])
    code, _, err = run(capsys, *ask, "--points", 3, "--max-length", "121m")
    assert code == 4
    assert "no cable up to 121 m has a depth of 120 m in the shape expected at any of the 3 speeds" in err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--speed", "5kn:3kn"), "the lower speed first"),
        (("--speed", "3kn:4kn:5kn"), "is no range of speeds, as 3kn:5kn"),
        (("--speed", "3kn:x"), "'x' is not a speed"),
        (("--speed", "3kn:5kn", "--points", 1), "points must be 2 to 50"),
        (("--speed", "3kn:5kn", "--within", "5kg"), "--within = '5kg' is not a length"),
        (("--speed", "3kn:5kn", "--within", "0"), "--within 0 is not positive"),
        (("--speed", "3kn:5kn", "--rpm", "3"), "not allowed with"),
        (("--speed", "3kn", "--within", "5m"), "--within is for a range of speeds"),
        (("--points", "5"), "--points is for a range of speeds"),
    ],
)
def test_bad_arguments(capsys, file, arguments, message):
    code, out, err = run(capsys, "design", "--scene", file, "--depth", "120m", *arguments)
    assert (code, out) == (2, "")
    assert message in err
