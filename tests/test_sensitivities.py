"""Sensitivities of a scene: exact, against re-solved scenes and dimensional analysis; uncertain keys."""

from dataclasses import replace

import numpy as np
import pytest
from helpers import WET
from test_folds import DEEP as OCEAN
from test_folds import WIRE

import towatlas
from towatlas.scene.file import make_scene, scene_numbers
from towatlas.scene.jumps import answer_scene
from towatlas.scene.models import system_of
from towatlas.scene.sensitivities import sensitivities_of
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.folds import folds_in_speed
from towatlas.solve.tensions import largest_tension

# A cable with a jump above in a vacuum; a stranded one in a turn to port whose circle follows from its period; a bare
# one that floats.
DEEP = {
    "cable": {"length": 800, "mass_per_length": 0.5, "diameter": 0.012, "drag_coefficient": 1.4},
    "fish": {"mass": 60, "volume": 0.02, "drag_coefficient": 0.5, "frontal_area": 0.03},
    "tow": {"radius": 40, "speed": "5 kn"},
    "fluid": {"density": 1025},
}
STRANDED = {
    "cable": {"length": 60, "type": "pode-G"},
    "fish": {"mass": 8, "diameter": 0.15, "drag_coefficient": 0.4},
    "tow": {"speed": "4 kn", "period": "5 min", "turn": "port"},
    "fluid": {"density": 1025},
    "gravity": 9.81,
}
FLOATS = {
    "cable": {
        "length": 90,
        "submerged_weight_per_length": -0.4,
        "diameter": 0.02,
        "drag_coefficient": 1.2,
        "tangential_drag_coefficient": 0.01,
        "tangential_drag_on": "pi d",
    },
    "tow": {"radius": 20, "rpm": 0.4},
    "fluid": {"density": 1025},
}


def quantities_at(scene, model, start):
    """Those of a scene solved again: of the shape and the folds nearest to those of the first, not chosen anew."""
    system, force = system_of(scene, model), scene.force_unit(model)
    shapes = solve_equilibria(system, scene.gamma)
    k = int(np.argmin(np.abs(shapes.r_f * scene.radius / start["r_f"] - 1)))
    found = {"depth": shapes.z_f[k] * scene.radius, "tension": shapes.tension[k] * force, "speed": scene.speed}
    found["largest_tension"] = largest_tension(shapes, k)[0] * force
    for name in ("jump_below", "jump_above"):
        if name in start:
            about = start[name] / scene.speed_of(1.0) * np.sign(scene.gamma)
            folds = folds_in_speed(system, about * 0.99, about * 1.01, named=False)
            speeds = scene.speed_of(np.abs(folds.gamma))
            found[name] = speeds[np.argmin(np.abs(speeds - start[name]))]
    return found


@pytest.mark.parametrize(
    ("table", "model"),
    [
        (DEEP, "vacuum"),
        (STRANDED, "water"),
        (FLOATS, "water"),
        (WET, "air"),
        pytest.param(WIRE, "air", marks=pytest.mark.slow),
        pytest.param(OCEAN, "water", marks=pytest.mark.slow),
    ],
    ids=["deep", "stranded", "floats", "air", "wire", "ocean"],
)
def test_slopes_are_those_of_scenes_solved_again(table, model):
    """By every key, of every quantity; the error of the differences is that of a Richardson pair."""
    scene = make_scene(table)
    answer = answer_scene(scene, model=model)
    found = sensitivities_of(answer)
    start = {one.name: one.value for one in found.quantities}
    start["r_f"] = answer.equilibria.r_f[answer.equilibria.expected] * scene.radius
    compared = 0
    for at, key in enumerate(found.keys):
        value, pair = scene.values[key], []
        for step in (2e-4, 1e-4):
            ends = [
                quantities_at(replace(scene, **scene_numbers(scene.values | {key: value * factor})), model, start)
                for factor in (1.0 + step, 1.0 - step)
            ]
            pair.append({name: (ends[0][name] - ends[1][name]) / (2 * step * value) for name in ends[0]})
        for one in found.quantities:
            coarse, fine = (differences[one.name] for differences in pair)
            better = fine + (fine - coarse) / 3
            # What the fold and the shape are known to, over the step, and the last correction of the pair.
            slack = 1e-8 * abs(one.value / value) + 0.1 * abs(better - fine)
            assert one.slopes[at] == pytest.approx(better, rel=1e-7, abs=slack), (one.name, key)
            compared += 1
    assert compared == len(found.keys) * len(found.quantities) >= 30


@pytest.mark.parametrize(
    ("lam", "w_f", "gamma", "fluid", "some_inside"),
    [
        (37.8, 1352.0, 5.94, {}, True),
        (37.8, 1352.0, 5.94, {"C": 0.018}, True),
        (6.0, 0.1, 2.0, {"C": 1.0}, False),
        (30.0, 0.0, 1.5, {}, True),
    ],
)
def test_largest_tension(lam, w_f, gamma, fluid, some_inside):
    """Without drag along the cable T + gamma^2 rho^2 / 2 + w z stays: the largest T from positions alone."""
    shapes = towatlas.equilibria(lam, w_f, gamma, **fluid)
    inside = 0
    for k in range(len(shapes)):
        tension, s = largest_tension(shapes, k)
        line = towatlas.shape_of(shapes, k, np.append(np.linspace(0.0, lam, 4001), s))
        load = 0.5 * gamma**2 * (line.x**2 + line.y**2).values + line.z.values
        whole = shapes.tension[k] + 0.5 * gamma**2
        assert tension == pytest.approx(whole - load[-1], rel=1e-10)
        # Nowhere more, and on 4001 points as much but for the square of their distance.
        assert tension * (1 + 1e-10) >= whole - load[:-1].min() >= tension * (1 - 1e-4)
        if 0.0 < s < lam:
            inside += 1
            beside = towatlas.shape_of(shapes, k, s + 1e-4 * lam * np.array([-1.0, 1.0]))["T"].values
            # At the top the cable is level on both sides, to the third order.
            assert beside[0] - beside[1] == pytest.approx(0.0, abs=1e-3 * (tension - beside.max()) + 1e-13 * tension)
    assert (inside > 0) == some_inside
