"""Cables that bring the fish to a depth: all of them, and exactly there."""

import dataclasses
import json

import numpy as np
import pytest
from helpers import run

import towatlas
from towatlas.scene.designs import design, with_length
from towatlas.scene.file import make_scene, read_scene
from towatlas.scene.models import solve_model
from towatlas.solve.depths import cables_to_depth
from towatlas.solve.lengths import cables_for
from towatlas.solve.members import extrema, shoot_lanes, solve_members
from towatlas.system import System

SCAN = 300


ASKED = ("w_f", "gamma", "z_f", "lam_max")


def random_targets(rows, seed):
    """w_f, gamma, depth and longest cable; every other one a light fish, deep at its speed, with several answers."""
    rng = np.random.default_rng(seed)
    for k in range(rows):
        if k % 2:
            gamma = 10 ** rng.uniform(-0.3, 0.7)
            z_f = 10 ** rng.uniform(1, 1.8) / gamma**2
            yield 0.0 if rng.random() < 0.5 else z_f * 10 ** rng.uniform(-3, 0.5), gamma, z_f, 8 * z_f + 3
        else:
            longest = 10 ** rng.uniform(0.3, 1.7)
            yield 10 ** rng.uniform(-2, 3.3), 10 ** rng.uniform(-0.7, 0.8), longest * rng.uniform(0.02, 0.98), longest


def scanned(w_f, gamma, z_f, longest):
    """Where the depth of each branch crosses the one wanted: intervals of a scan of lengths, nodes, member."""
    lam = np.linspace(longest / SCAN, longest, SCAN)
    highest, _ = extrema(w_f=np.array([w_f]), lam=np.array([longest]), gamma=np.array([gamma]), shoot=shoot_lanes)
    for n in range(int(highest[0]) + 1):
        for outer in (False, True)[: 1 + (n > 0)]:
            fixed = (np.full(SCAN, value) for value in (w_f, gamma, n, outer))
            w, g, order, member = fixed
            miss = solve_members(w_f=w, lam=lam, gamma=g, n=order, outer=member, shoot=shoot_lanes).z_f - z_f
            known = np.isfinite(miss[1:]) & np.isfinite(miss[:-1])
            for k in np.flatnonzero(known & ((miss[1:] > 0) != (miss[:-1] > 0))):
                yield lam[k], lam[k + 1], n, outer


@pytest.mark.slow
def test_every_answer_is_an_equilibrium_and_none_is_missing():
    """A solver of another kind, by the count at given length: at each length found, and on a scan of lengths."""
    cables = crossings = several = 0
    for target in random_targets(24, 21):
        w_f, gamma, z_f, longest = target
        found = cables_to_depth(**dict(zip(ASKED, target, strict=True)))
        assert (np.diff(found.lam) > 0).all()
        assert (found.lam <= longest).all()
        several += len(found) > 1
        for k in range(len(found)):
            shapes = towatlas.equilibria(float(found.lam[k]), w_f, gamma)
            same = np.flatnonzero(shapes.nodes == found.nodes[k])
            at = same[np.argmin(np.abs(shapes.x_f[same] - found.x_f[k]))]
            # Near the birth of a pair its members part with the root of the length beyond it.
            slack = max(1e-10, 100 * shapes.error[at])
            assert shapes.z_f[at] == pytest.approx(z_f, rel=slack)
            assert shapes.x_f[at] == pytest.approx(found.x_f[k], rel=slack)
            assert shapes.R_x0[at] == pytest.approx(found.R_x0[k], rel=slack, abs=slack)
            assert shapes.tension[at] == pytest.approx(found.tension[k], rel=slack)
            pair = np.abs(shapes.x_f[same])
            assert found.outer[k] == (len(pair) == 2 and pair.max() == np.abs(shapes.x_f[at]))
            cables += 1
        for low, high, n, outer in scanned(*target):
            within = (found.lam >= low) & (found.lam <= high) & (found.nodes == n) & (found.outer == outer)
            assert within.sum() == 1, (target, low, high, n, outer)
            crossings += 1
    assert several >= 5
    assert cables >= crossings > 25


@pytest.mark.parametrize(("lam", "w_f", "gamma"), [(37.8, 1352, 5.94), (30.0, 0.0, 1.5), (20.0, 3.0, 0.8)])
def test_depths_of_all_shapes_lead_back(lam, w_f, gamma):
    shapes = towatlas.equilibria(lam, w_f, gamma)
    for k in range(len(shapes)):
        found = cables_to_depth(w_f=w_f, gamma=gamma, z_f=float(shapes.z_f[k]), lam_max=1.5 * lam)
        back = found.x_f * shapes.x_f[k] > 0
        back &= (found.nodes == shapes.nodes[k]) & (np.abs(found.lam / lam - 1) < 1e-9)
        assert back.sum() == 1


def test_two_lengths_of_one_branch():
    """A branch that turns: as the cable grows, its fish sinks and rises again, and both lengths are found."""
    lam = np.linspace(0.5, 60, 4000)
    rows = len(lam)
    turning = 0
    for w_f, gamma, n, outer in ((1352.0, 2.97, 1, False), (0.0, 1.0, 1, False), (5.0, 1.0, 0, False)):
        fixed = (np.full(rows, value) for value in (w_f, gamma, n, outer))
        w, g, order, member = fixed
        z = solve_members(w_f=w, lam=lam, gamma=g, n=order, outer=member, shoot=shoot_lanes).z_f
        known = z[np.isfinite(z)]
        top = int(np.argmax(known))
        if not 0 < top < len(known) - 1:
            continue
        turning += 1
        wanted = known[top] * (1 - 1e-6)
        found = cables_to_depth(w_f=w_f, gamma=gamma, z_f=float(wanted), lam_max=60.0)
        assert ((found.nodes == n) & (found.outer == outer)).sum() == 2
        over = cables_to_depth(w_f=w_f, gamma=gamma, z_f=float(known[top] * (1 + 1e-4)), lam_max=60.0)
        assert ((over.nodes == n) & (over.outer == outer)).sum() == 0
    assert turning > 0


def test_straight_down_when_slow():
    """At gamma -> 0 the cable hangs and its length is its depth."""
    found = cables_to_depth(w_f=1.0, gamma=1e-4, z_f=3.0, lam_max=30.0)
    assert found.lam == pytest.approx([3.0], rel=1e-7)
    assert found.x_f == pytest.approx([1.0], rel=1e-6)
    assert list(found.nodes) == [0]


@pytest.mark.parametrize("short", [1e-3, 1e-4])
def test_deepest_shape_without_nodes(short):
    """Long and flung out, a cable without a fish hangs 2 ln 2 g/Omega^2 deep, and is 1 / (2^short - 1) R long."""
    gamma = 1.3
    found = cables_to_depth(w_f=0.0, gamma=gamma, z_f=2 * np.log(2) / gamma**2 * (1 - short), lam_max=1e5)
    assert list(found.nodes) == [0]
    # What is neglected is of the order of 1 / a^2 but for a logarithm, and the tow radius.
    assert found.lam[0] == pytest.approx(1 / (2**short - 1), rel=2 * short)
    assert len(cables_to_depth(w_f=0.0, gamma=gamma, z_f=2 * np.log(2) / gamma**2, lam_max=1e5)) == 0


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ((-1, 1, 1, 1), "w_f must be finite and not negative"),
        ((0, 0, 1, 1), "gamma must be finite and positive"),
        ((0, 1, 0, 1), "z_f must be finite and positive"),
        ((0, 1, 1, np.nan), "lam_max must be finite and positive"),
        ((0, 1, [1], 1), "z_f must be one number"),
    ],
)
def test_bad_input(arguments, match):
    with pytest.raises(ValueError, match=match):
        cables_to_depth(**dict(zip(ASKED, arguments, strict=True)))


def test_bad_targets():
    scene = read_scene("skop-fig3")
    for name in ("max_radius", "max_tension"):
        with pytest.raises(ValueError, match=f"{name} must be positive"):
            design(scene, 0.5, **{name: 0.0})
    with pytest.raises(ValueError, match="exactly one of depth, radius, tension is wanted, got depth, radius"):
        design(scene, 0.5, radius=1.0)
    with pytest.raises(ValueError, match="got none"):
        design(scene)


def random_designs(count, seed):
    """w_f, gamma, depth and longest cable."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        w_f = 0.0 if rng.random() < 0.2 else 10 ** rng.uniform(-2, 2)
        depth = 10 ** rng.uniform(-1, 1)
        yield w_f, 10 ** rng.uniform(-0.5, 0.7), depth, max(1.01 * depth, 10 ** rng.uniform(0, 1.5))


def test_lengths_in_any_medium_are_those_of_the_vacuum():
    """Two solvers of different kind; shapes of all lengths, and shots ended at the depth."""
    cables = 0
    for w_f, gamma, depth, longest in random_designs(16, 3):
        exact = cables_to_depth(w_f=w_f, gamma=gamma, z_f=depth, lam_max=longest)
        found = cables_for(System.of(lam=depth * (1 - 1e-6), w_f=w_f), gamma, "depth", depth, longest)
        assert found.complete
        np.testing.assert_allclose(found.lam, exact.lam, rtol=1e-9)
        assert (np.abs(found.lam / exact.lam - 1) <= found.error + 1e-11).all()
        np.testing.assert_allclose(found.r_f, np.abs(exact.x_f), rtol=1e-7)
        cables += len(found)
    assert cables > 8


@pytest.mark.parametrize("quantity", ["depth", "radius", "tension"])
def test_lengths_with_drag_lead_back(quantity):
    """Each quantity of each shape of a cable with several leads back to its length, once for each shape."""
    system, gamma = System.of(16.0, 3.0, C=5.6), 3.1
    shapes = towatlas.equilibria(16.0, 3.0, gamma, C=5.6)
    assert len(shapes) == 5
    column = {"depth": shapes.z_f, "radius": shapes.r_f, "tension": shapes.tension}[quantity]
    for k, value in enumerate(column):
        found = cables_for(dataclasses.replace(system, lam=12.0), gamma, quantity, float(value), 20.0)
        assert found.complete
        at = np.argmin(np.abs(found.lam / 16.0 - 1) + np.abs(np.log(found.r_f / shapes.r_f[k])))
        assert found.lam[at] == pytest.approx(16.0, rel=1e-9)
        assert found.r_f[at] == pytest.approx(shapes.r_f[k], rel=1e-9)
        assert found.least < value < found.most
        for lam, r_f in zip(found.lam, found.r_f, strict=True):
            again = towatlas.equilibria(float(lam), 3.0, gamma, C=5.6)
            its = int(np.argmin(np.abs(np.log(again.r_f / r_f))))
            value_there = {"depth": again.z_f, "radius": again.r_f, "tension": again.tension}[quantity][its]
            assert value_there == pytest.approx(value, rel=1e-8)


WET = {
    "cable": {"mass_per_length": 0.5, "diameter": "12 mm", "drag_coefficient": 1.4},
    "fish": {"mass": 60, "volume": "20 l", "added_mass": 10},
    "tow": {"radius": 40, "speed": "4 kn"},
    "fluid": {"name": "seawater"},
}


def test_a_design_in_water():
    """By the model that holds: the vacuum's length for this depth leaves the fish at 102 m."""
    scene = make_scene(WET)
    found = design(scene, 120.0)
    (cable,) = found.chosen
    assert (found.model, found.complete, cable.expected, cable.nodes) == ("water", True, True, 1)
    assert cable.length == pytest.approx(136.7, abs=0.05)
    exact = solve_model(with_length(scene, cable.length), "water")
    np.testing.assert_allclose(exact.position, cable.position, rtol=1e-9)
    assert cable.position[2] == pytest.approx(120.0, rel=1e-10)
    assert exact.tension == pytest.approx(cable.tension, rel=1e-10)
    vacuum = design(scene, 120.0, model="vacuum")
    assert solve_model(with_length(scene, vacuum.chosen[0].length), "water").position[2] < 110
    by_radius = design(scene, radius=cable.radius)
    assert [other.length for other in by_radius.cables] == pytest.approx([cable.length], rel=1e-9)
    by_tension = design(scene, tension=cable.tension)
    assert [other.length for other in by_tension.cables] == pytest.approx([cable.length], rel=1e-9)
    assert not design(scene, 120.0, max_tension=0.9 * cable.tension).chosen


def test_overflow_is_said():
    with pytest.raises(ArithmeticError):
        cables_to_depth(w_f=1.0, gamma=1e80, z_f=1.0, lam_max=1e60)


@pytest.fixture
def ask(capsys):
    return lambda *arguments: run(capsys, "design", "--scene", "skop-fig3", "--model", "vacuum", *arguments)


def test_shell(ask):
    code, out, _ = ask("--depth", "25 in", "--json")
    assert code == 0
    answer = json.loads(out)
    assert answer["depth_m"] == pytest.approx(0.635, rel=1e-15)
    assert answer["reason"] is None
    scene = read_scene("skop-fig3")
    groups = scene.system("vacuum")
    for row in answer["cables"]:
        lam = row["length_m"] / scene.radius
        speeds = towatlas.solve_critical(lam, groups.w_f, range(1, 7)).gamma
        nearest = int(np.argmin(np.abs(speeds - 2.97)))
        assert row["nearest_shapes_above"] == 2 * nearest + 3
        assert row["distance_gamma"] == pytest.approx(speeds[nearest] - 2.97, abs=1e-8)
        assert row["distance_relative"] == pytest.approx(speeds[nearest] / 2.97 - 1, abs=1e-8)
        assert row["distance_m_s"] == pytest.approx(
            (speeds[nearest] - 2.97) * np.sqrt(scene.radius * 9.80665), abs=1e-8
        )
        shapes = towatlas.equilibria(lam, groups.w_f, 2.97)
        at = np.argmin(np.abs(shapes.x_f * scene.radius - row["x_f_m"]))
        assert shapes.z_f[at] * scene.radius == pytest.approx(0.635, rel=1e-10)
        assert row["expected"] == (at == shapes.expected)
        assert row["nodes"] == shapes.nodes[at]
    assert [row["expected"] for row in answer["cables"]].count(True) >= 1
    code, out, _ = ask("--depth", "25 in")
    assert code == 0
    assert len(out.splitlines()) == 7 + len(answer["cables"])
    nearer = json.loads(ask("--depth", "25 in", "--max-radius", "1 mm", "--json")[1])["cables"]
    assert nearer == [row for row in answer["cables"] if abs(row["x_f_m"]) <= 1e-3]
    assert 0 < len(nearer) < len(answer["cables"])


def test_none_is_an_answer(ask):
    code, out, err = ask("--depth", "25 in", "--max-radius", "1 um")
    assert (code, out) == (4, "")
    assert "none of the 3 cables" in err
    assert "nearest comes one of 0.65725" in err
    code, out, err = ask("--depth", "1 m", "--max-length", "0.9 m", "--json")
    assert code == 4
    assert json.loads(out)["cables"] == []
    assert "no cable up to 0.9 m" in json.loads(out)["reason"]
    scene = read_scene("skop-fig3")
    groups = scene.system("vacuum")
    deepest = towatlas.equilibria(0.9 / scene.radius, groups.w_f, 2.97).z_f.max() * scene.radius
    assert f"to {deepest:.6g} m; a longer one may" in err


def test_cables_without_transitions(ask):
    code, out, _ = ask("--depth", "1 cm", "--max-length", "1.2 cm", "--json", "--gamma", 0.1)
    (row,) = json.loads(out)["cables"]
    assert code == 0
    assert row["nearest_gamma"] is None
    code, out, _ = ask("--depth", "1 cm", "--max-length", "1.2 cm", "--gamma", 0.1)
    assert out.splitlines()[-1].split()[-5:] == ["none", "-", "-", "stable", "expected"]


def test_a_search_of_minutes_is_refused():
    with pytest.raises(ArithmeticError, match=r"too many to search.*--max-length"):
        cables_to_depth(w_f=1352, gamma=2.97, z_f=28_600, lam_max=286_000)


def test_what_larger_models_were_not_asked_is_said(capsys):
    """Position and tension are those of air; jumps are not."""
    said = "are those of the vacuum model, which was compared in the position and tension"
    ask = ("design", "--scene", "skop-fig3", "--depth=25in", "--max-length=0.7m")
    assert said in run(capsys, *ask)[1]
    assert said not in run(capsys, *ask, "--model=vacuum")[1]
