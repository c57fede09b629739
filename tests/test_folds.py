"""All folds of a cable, whatever makes them: known ones, counts of shapes on both sides, limits, the shell, scenes."""

import json
from math import inf

import numpy as np
import pytest
from helpers import run

import towatlas
from benchmarks import scenes
from towatlas.scene.file import make_scene
from towatlas.scene.jumps import answer_scene
from towatlas.system import System

# A sphere of 250 lbf towed through sea water at 5 kn on 26,900 ft of half-inch cable, circle 10,000 ft: C_D 1.27,
# no tangential drag; C_DB 0.2 on the frontal area, added mass half of what the sphere displaces.
DEEP = {
    "cable": {
        "length": "26900 ft",
        "mass_per_length": "0.3 lb/ft",
        "diameter": "0.5 in",
        "drag_coefficient": 1.27,
    },
    "fish": {
        "mass": "250 lb",
        "volume": f"{np.pi / 6 * 1.2**3!r} ft^3",
        "added_mass": f"{0.5 * np.pi / 6 * (1.2 * 0.3048) ** 3 * 1025!r} kg",
        "drag_coefficient": 0.2,
        "frontal_area": f"{np.pi / 4 * 1.2**2!r} ft^2",
    },
    "tow": {"radius": "10000 ft", "speed": "5 kn"},
    "fluid": {"density": 1025},
}
# An aircraft with 1800 m of wire.
WIRE = {
    "cable": {"length": 1800, "mass_per_length": 0.0555, "diameter": "3 mm", "drag_coefficient": 1.1},
    "fish": {"mass": 1.67},
    "tow": {"radius": 300, "speed": 76},
    "fluid": {"name": "air"},
}


def fluid_of(system):
    """What `folds` and `equilibria` take by keyword."""
    return {name: getattr(system, name) for name in ("C", "m_f", "C_f", "w", "C_t")}


def counts(system, gamma, **fluid):
    """Number of shapes just below and above speeds."""
    speeds = np.ravel([[g * (1 - 1e-7), g * (1 + 1e-7)] for g in gamma])
    found = towatlas.equilibria_many(system.lam, system.w_f, speeds, **fluid_of(system))
    return found["count"].values.reshape(-1, 2)


@pytest.mark.parametrize(
    ("lam", "w_f", "span", "fluid", "gamma", "below", "origin"),
    [
        # Far above C*_n, where the vacuum has left nothing: drag makes them. Between the narrow pairs in the middle of
        # the first and the third, 0.25 % and 0.003 % apart, an independent code has five shapes, too.
        (16, 3, (1, 6), {"C": 5.6}, (2.327475, 3.095433, 3.103322, 3.559442), (1, 3, 5, 3), "drag"),
        (6, 0.1, (0.5, 3), {"C": 10}, (1.221573, 1.691795), (1, 3), "drag"),
        (
            20,
            10,
            (2.5, 6),
            {"C": 3},
            (3.371400, 3.882133, 3.882263, 4.062049, 4.165451, 4.496640),
            (1, 3, 5, 3, 5, 3),
            "drag",
        ),
        # The first pair of the vacuum, which with drag on the fish ends.
        (
            2.217538006711848,
            42.08881108617596,
            (0.5, 3),
            {"C": 27.198687642653237, "C_f": 4.632487325007996},
            (1.271491, 1.310178),
            (1, 3),
            "vacuum",
        ),
        # On the way from the second to the vacuum a wide turn close by another curve.
        (
            43.966451649588045,
            2.141538255486676,
            (2.55, 2.7),
            {"C": 0.06197835119510777, "C_f": 0.0012576135840303994},
            (2.583726, 2.650111),
            (1, 3),
            "vacuum",
        ),
        # A pair begins where Newton's method is sent for the end of another, within a step of both.
        (
            24.765381583946095,
            2.3672203273375922,
            (0.1, 5),
            {"C": 1.568600909617942, "w": 0.3391103755223098, "m_f": 3.3765531037593486},
            (1.974126, 2.463959, 2.474816, 2.563326),
            (1, 3, 5, 3),
            "drag",
        ),
        (
            29.952190988144118,
            0.2080115094447762,
            (0.1, 5),
            {"C": 1.8695171615091335, "w": 0.28392441607924307, "m_f": 0.40042211234466646},
            (1.528291, 2.204919, 2.225607, 2.336964),
            (1, 3, 5, 3),
            "drag",
        ),
        # Another pair within a step of a fold, wide or narrow, far from it or all but at its radius.
        (
            11.7449,
            6.18981,
            (0.02, 20),
            {"C": 4.00019, "m_f": 15.1625, "C_f": 0.0680046, "w": 0.857438, "C_t": 0.0254089},
            (2.808112, 2.975712, 3.010855, 3.302112),
            (1, 3, 5, 3),
            "drag",
        ),
        (
            10.2372,
            7.84964,
            (0.02, 20),
            {"C": 2.45858, "m_f": 9.90573, "C_f": 0.158263, "w": 0.685515, "C_t": 0.0143222},
            (2.876644, 2.888693, 2.933977, 3.106524),
            (1, 3, 5, 3),
            "drag",
        ),
        (
            8.07003732661655,
            3.4443416106065654,
            (0.05, 10),
            {"C": 6.692286432646384, "m_f": 8.95020748467062, "w": 0.42981519039448546},
            (1.842970, 1.844157, 1.844658, 2.124611),
            (1, 3, 5, 3),
            "drag",
        ),
        # A fold beyond the speeds that are easily looked at.
        (8.598213412228047, 632.2661936372043, (40, 60), {"C": 0.043740859791831455}, (54.426808,), (7,), "vacuum"),
    ],
)
def test_known_folds(lam, w_f, span, fluid, gamma, below, origin):
    found = towatlas.folds(lam, w_f, span, **fluid)
    np.testing.assert_allclose(found.gamma, gamma, atol=6e-7)
    assert found.complete
    assert list(found.shapes_below) == list(below)
    assert set(found.origin) == {origin}
    assert (found.n > 0).all() == (origin == "vacuum")
    assert (np.abs(found.shapes_above - found.shapes_below) == 2).all()
    np.testing.assert_array_equal(
        counts(found.system, found.gamma), np.stack([found.shapes_below, found.shapes_above], axis=1)
    )


@pytest.mark.parametrize(
    ("lam", "w_f", "span", "fluid", "n"),
    [
        (25.69752444087756, 0.0015959863737249626, (0.1, 6), {"C": 0.002463972304585103, "w": 0.1}, range(2, 13)),
        (31.022, 18.053, (0.1, 6), {"C": 0.067757, "w": 0.18758}, (5, 5, 6, 6, 7, 8, 9, 10)),
        (24.53174, 1.452963, (0.1, 6), {"C": 0.003905345, "w": 0.650294}, (1, *range(1, 10))),
        (27.5166, 67.703, (0.1, 6), {"C": 0.083538, "w": 0.42046}, (6, 6)),
        (3.54898, 0.0651625, (-6, -0.1), {"C": 0.488255, "w": 0.1, "C_t": 0.0185819, "C_s": -0.42497}, (1, 1)),
        (11.65031944620065, 2.8002641122701175, (-6, -0.1), {"C": 155.217717, "C_f": 0.0273513, "w": 0.1}, (0, 0)),
        (16.612144111707586, 35.24278168405032, (5, 6), {"C": 1.7965123515564951}, (0,) * 6),
    ],
)
def test_names_where_long_steps_come_to_other_curves(lam, w_f, span, fluid, n):
    """As steps ten times shorter name them. Folds of one number begin and end shapes in turn."""
    found = towatlas.folds(lam, w_f, span, **fluid)
    assert found.n.tolist() == list(n)
    change = found.shapes_above - found.shapes_below
    for number in set(n) - {0}:
        assert (np.diff(change[found.n == number]) != 0).all()


def test_every_fold_is_of_the_kind_that_the_shapes_beside_it_say():
    rng = np.random.default_rng(8)
    some = 0
    for _ in range(20):
        lam, w_f, w, C = rng.uniform(5, 32), 10 ** rng.uniform(-1, 2), rng.uniform(0.1, 1), 10 ** rng.uniform(-1.5, 1)
        found = towatlas.folds(lam, w_f, (0.1, 5.0), C=C, w=w, m_f=w_f * rng.uniform(1, 2))
        assert (found.shapes_below[1:] == found.shapes_above[:-1]).all()
        np.testing.assert_array_equal(
            counts(found.system, found.gamma), np.stack([found.shapes_below, found.shapes_above], axis=1)
        )
        some += len(found)
    assert some > 6


def test_in_a_vacuum_and_near_it():
    """Folds of the vacuum are its critical speeds; with a trace of drag they are, but for that trace, the same."""
    found = towatlas.folds(37.8, 1352, (0.1, 8))
    states = towatlas.solve_critical(37.8, 1352, [1, 2, 3])
    np.testing.assert_array_equal(found.gamma, states.gamma)
    assert list(found.n) == [1, 2, 3]
    assert list(found.shapes_above) == [3, 5, 7]
    faint = towatlas.folds(37.8, 1352, (0.1, 8), C=1e-9)
    np.testing.assert_allclose(faint.gamma, found.gamma, rtol=1e-7)
    assert list(faint.n) == [1, 2, 3]
    assert list(faint.origin) == ["vacuum"] * 3


def test_the_same_as_from_the_curves_of_the_vacuum():
    """Pairs continued from the vacuum, both ends, by the other way."""
    found = towatlas.folds(37.8, 1352, (0.1, 8), C=0.005)
    pairs = towatlas.solve_drag_folds(37.8, 1352, 0.005, n=[1, 2, 3])
    assert list(found.n) == [1, 2, 2, 3]
    other = [pairs.appears[0], pairs.appears[1], pairs.ends[1], pairs.appears[2]]
    np.testing.assert_allclose(found.gamma, other, rtol=1e-12)


@pytest.mark.slow
def test_next_to_a_cusp():
    """A pair 1.5e-8 apart in speed, 3.4e-5 below its cusp; above the cusp there is none."""
    cusp = float(towatlas.solve_drag_folds(60, 2000, 0.014, n=3).C_cusp)
    for share in (3e-5, 5e-6):
        pair = towatlas.solve_drag_folds(60, 2000, cusp * (1 - share), n=3)
        found = towatlas.folds(60, 2000, (5, 5.1), C=cusp * (1 - share))
        assert list(found.n) == [3, 3]
        np.testing.assert_allclose(found.gamma, [pair.appears, pair.ends], rtol=1e-9)
        assert found.gamma[0] < found.gamma[1] < found.gamma[0] * (1 + 1e-6)
    assert len(towatlas.folds(60, 2000, (5, 5.1), C=cusp * (1 + 1e-5))) == 0


def test_made_by_drag_in_water():
    """Folds in length and in speed of a cable without tangential drag, which has three shapes between."""
    system, gamma = make_scene(DEEP).system("water"), make_scene(DEEP).gamma
    in_length = towatlas.folds((2.4, 3.0), system.w_f, gamma, **fluid_of(system))
    np.testing.assert_allclose(in_length.value, [2.65870317, 2.72720846], atol=6e-9)
    in_speed = towatlas.folds(system.lam, system.w_f, (gamma / 2, gamma * 2), **fluid_of(system))
    np.testing.assert_allclose(in_speed.gamma / gamma * 5.0, [4.916, 5.107], atol=6e-4)
    assert set(in_speed.origin) == {"drag"}
    # Tangential drag takes them away at a cusp, C_DT 0.0183.
    for coefficient, number in ((0.0182, 2), (0.0184, 0)):
        fluid = fluid_of(system) | {"C_t": system.C * coefficient / 1.27}
        assert len(towatlas.folds((2.4, 3.0), system.w_f, gamma, **fluid)) == number
    # The same folds met in C_t: between them there are three shapes.
    lam = float(in_length.value.mean())
    fluid = fluid_of(system) | {"C_t": (1e-6 * system.C, 0.02 * system.C)}
    (fold,) = towatlas.folds(lam, system.w_f, gamma, **fluid).value
    again = towatlas.folds((2.4, 3.0), system.w_f, gamma, **(fluid | {"C_t": fold}))
    assert np.abs(again.value / lam - 1.0).min() < 1e-9


def test_folds_of_a_bare_cable_scale():
    """Loads over w: the cable of weight w at gamma is the one of weight 1 at gamma / sqrt(w), with the same C."""
    w = 0.6
    heavy = towatlas.folds(10.0, 0.0, (0.3, 3.0), C=0.02)
    light = towatlas.folds(10.0, 0.0, (0.3 * np.sqrt(w), 3.0 * np.sqrt(w)), C=0.02, w=w)
    assert len(heavy) > 1
    np.testing.assert_allclose(light.gamma, heavy.gamma * np.sqrt(w), rtol=1e-9)
    np.testing.assert_array_equal(light.n, heavy.n)


def test_mirrors():
    """A turn to port, and a cable that floats, have the folds of their mirror images; a side force changes sign."""
    sink = towatlas.folds(6, 0.1, (0.5, 3), C=10, m_f=0.2, C_s=0.5)
    port = towatlas.folds(6, 0.1, (-3, -0.5), C=10, m_f=0.2, C_s=-0.5)
    float_ = towatlas.folds(6, -0.1, (0.5, 3), C=10, m_f=0.2, w=-1 + 1e-15, C_s=-0.5)
    other = towatlas.folds(6, 0.1, (0.5, 3), C=10, m_f=0.2, C_s=-0.5)
    assert len(sink) == 2
    np.testing.assert_allclose(port.gamma, -sink.gamma, rtol=1e-12)
    np.testing.assert_allclose(float_.gamma, sink.gamma, rtol=1e-9)
    assert np.abs(other.gamma / sink.gamma - 1).max() > 1e-3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((5, 1, 1), "exactly one of .* must be a pair"),
        (((5, 6), 1, (1, 2)), "exactly one of .* must be a pair"),
        ((5, 1, (2, 1)), "gamma must be two finite numbers of one sign, low < high"),
        ((5, 1, (-1, 1)), "of one sign"),
        ((5, 1, (1, 2, 3)), "two finite numbers"),
        ((5, 1, (1, np.inf)), "two finite numbers"),
        ((-5, 1, (1, 2)), "lam must be"),
    ],
)
def test_bad_input(arguments, message):
    with pytest.raises(ValueError, match=message):
        towatlas.folds(*arguments, C=0.1)


def test_shell(capsys):
    code, out, err = run(capsys, "folds", "--lam", 6, "--wf", 0.1, "--C", 10, "--gamma", "0.5:3", "--json")
    rows = json.loads(out)
    assert code == 0
    assert [set(row) for row in rows] == [
        {"schema_version", "gamma", "r_f", "shapes_below", "shapes_above", "n", "origin", "error", "status"}
    ] * 2
    assert [(row["shapes_below"], row["shapes_above"], row["n"], row["origin"]) for row in rows] == [
        (1, 3, None, "drag"),
        (3, 1, None, "drag"),
    ]
    assert "not proved" in err
    assert run(capsys, "folds", "--lam", 6, "--wf", 0.1, "--C", 10, "--gamma", "0.5:3")[1].count("drag") == 2
    for bad in ("3:1", "1", "a:b", "1:inf"):
        assert run(capsys, "folds", "--lam", 6, "--wf", 0.1, "--gamma", bad)[0] == 2


def test_a_scene_ends_with_its_margin(capsys, tmp_path):
    """What applies first, the nearest jumps last; the other models only where they are asked for."""
    lines = []
    for section, keys in DEEP.items():
        lines += [f"[{section}]", *(f"{key} = {json.dumps(value)}" for key, value in keys.items())]
    text = "\n".join(lines)
    (tmp_path / "deep.toml").write_text(text)
    code, out, _ = run(capsys, "scene", tmp_path / "deep.toml")
    assert code == 0
    below, above = out.splitlines()[-2:]
    assert below.startswith(
        "nearest jump below (water model): 2.5292 m/s, 4.9165 kn (-1.7 %); there two other shapes (1 "
    )
    assert above.startswith(
        "nearest jump above (water model): 2.6272 m/s, 5.1069 kn (+2.1 %); there the expected shape ("
    )
    assert out.index("equilibria (water model)") < out.index("jumps (water model)") < out.index("group ")
    assert "vacuum model)" not in out
    compared = run(capsys, "scene", tmp_path / "deep.toml", "--compare")[1]
    assert "(vacuum model)" in compared
    assert "disagrees" in compared
    assert "below (vacuum model): none down to 0.0" in run(capsys, "scene", "skop-fig3", "--gamma", 0.1)[1]


def test_jumps_are_null_where_none_were_looked_for(capsys):
    arguments = ("scene", "skop-fig3", "--model", "air", "--json", "--asked")
    answer = json.loads(run(capsys, *arguments, "nodes")[1])
    assert [answer[key] for key in ("jumps", "jumps_looked_at", "jumps_complete")] == [None] * 3
    answer = json.loads(run(capsys, *arguments, "speeds")[1])
    assert answer["jumps_complete"] is True
    assert {row["origin"] for row in answer["jumps"]} == {"vacuum"}


@pytest.mark.parametrize(("scene", "speeds"), [(DEEP, (2.5292, 2.6272)), (WIRE, (65.122, 91.182))])
def test_jumps_of_scenes(scene, speeds, capsys, tmp_path):
    answer = answer_scene(make_scene(scene))
    folds = answer.folds
    np.testing.assert_allclose(answer.scene.speed_of(folds.gamma), speeds, rtol=1e-4)
    assert len(answer.equilibria) == 3


def test_cusps():
    """That of a pair of the vacuum, and one that drag alone makes: two folds on one side of it, none on the other."""
    known = towatlas.solve_drag_folds(37.8, 1352, 0.02, 3)
    found = towatlas.cusps(37.8, 1352, (6, 8), C=(0.02, 0.03))
    assert found.complete
    assert abs(found.value[0] / known.C_cusp - 1) <= known.error_cusp + found.error[0] < 1e-9
    assert found.gamma == pytest.approx([float(known.gamma_cusp)], rel=1e-6)
    scene = make_scene(DEEP)
    system, gamma = scene.system("water"), scene.gamma
    span, fluid = (gamma / 2, 2 * gamma), fluid_of(system)
    found = towatlas.cusps(system.lam, system.w_f, span, **fluid | {"C_t": (0.01 * system.C, 0.05 * system.C)})
    assert (len(found), found.moved, found.complete) == (1, "C_t", True)
    C_t, near = float(found.value[0]), (0.99 * found.gamma[0], 1.01 * found.gamma[0])
    assert 0.02 < C_t / system.C < 0.025
    for factor, count in ((1 - 1e-4, 2), (1 + 1e-4, 0)):
        assert len(towatlas.folds(system.lam, system.w_f, near, **fluid | {"C_t": C_t * factor})) == count
    port = towatlas.cusps(37.8, 1352, (-8, -6), C=(0.02, 0.03))
    assert port.gamma == pytest.approx([-float(known.gamma_cusp)], rel=1e-6)
    for wrong, match in (
        (((5, 1, 1.0), {"C": (1, 2)}), "must be pairs"),
        (((5, 1, (1, 2)), {}), "must be pairs"),
        (((5, 1, (2, 1)), {"C": (1, 2)}), "gamma must be two finite numbers"),
        (((5, 1, (1, 2)), {"C": (0, 2)}), "C must be two finite numbers"),
    ):
        with pytest.raises(ValueError, match=match):
            towatlas.cusps(*wrong[0], **wrong[1])


@pytest.mark.slow
def test_scenes_do_not_contradict_themselves():
    """As 300 others do not: docs/data/scenes.csv."""
    rows = list(scenes.check_all(24, 2026))
    assert not [row for row in rows if row.contradicts or row.refused]
    assert sum(row.jumps for row in rows) > 5


def test_systems_at_once():
    """Each as by itself; what is out of range has a status and does not spoil the others."""
    cases = [
        (37.8, 1352, 2.97, {"C": 0.018}),
        (16, 3, 2.5, {"C": 5.6}),
        (5, 0, 0.1, {"C": 70, "C_f": 0.02, "w": 0.3}),
        (6, -0.1, -0.5, {"C": 3, "m_f": 0.2, "w": 0.5, "C_s": 0.1, "b_s": 0.2}),
    ]
    names = ("C", "m_f", "C_f", "w", "C_t", "C_s", "b_s")
    systems = [System.of(lam, w_f, **fluid) for lam, w_f, _, fluid in cases]
    columns = {name: [getattr(system, name) for system in systems] + [inf if name == "b_s" else 1.0] for name in names}
    columns["C"][-1] = -1.0
    lam, w_f, gamma = (np.array([case[k] for case in cases] + [1.0]) for k in range(3))
    found = towatlas.equilibria_many(lam, w_f, gamma, **columns)
    assert list(found.status.values) == [0, 0, 0, 0, 6]
    assert found["count"].values[-1] == 0
    for k, (system, case) in enumerate(zip(systems, cases, strict=True)):
        alone = towatlas.equilibria(*case[:3], **case[3])
        assert found["count"].values[k] == len(alone)
        for name in ("R_x0", "R_y0", "R_z0", "x_f", "y_f", "z_f", "r_f", "phase_deg", "tension", "nodes", "near_axis"):
            np.testing.assert_allclose(found[name].values[k, : len(alone)], getattr(alone, name), rtol=1e-12)
        assert found.C.values[k] == system.C
    assert np.isnan(found.r_f.values[-1]).all()
    square = towatlas.equilibria_many([[5.0, 6.0]], [[0.0], [1.0]], 1.0, C=0.1)
    assert square.r_f.dims == ("system_0", "system_1", "shape")
    with pytest.raises(ValueError, match="do not broadcast"):
        towatlas.equilibria_many([1.0, 2.0], [1.0, 2.0, 3.0], 1.0)


def test_none_at_once():
    assert towatlas.equilibria_many(2.0, 1.0, np.empty(0)).sizes["system"] == 0
