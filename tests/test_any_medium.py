"""All shapes in any medium, sinking or floating: an independent program, invariants, systems known from elsewhere."""

import csv
from collections import defaultdict
from dataclasses import astuple, replace
from math import inf, pi, sqrt
from pathlib import Path

import numpy as np
import pytest

import towatlas
from towatlas.kernels import status
from towatlas.kernels.sweeps import MOST_THREADS, limited_threads
from towatlas.kernels.system import COLUMNS
from towatlas.solve.drag_equilibria import solve_drag_equilibria
from towatlas.solve.jets import jets_of
from towatlas.solve.shapes import shape_of
from towatlas.solve.shots import shoot
from towatlas.system import System

DATA = Path(__file__).parent / "data" / "any_medium.csv"


def reference_shapes():
    """Of each system of the file: its kind, itself, its speed, and r_f, z_f, phase_deg and tension of its shapes."""
    rows = defaultdict(list)
    with DATA.open() as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            rows[row["kind"], row["system"]].append(row)
    for (kind, _), shapes in rows.items():
        system = System(**{name: float(shapes[0][name]) for name in COLUMNS})
        numbers = [[float(row[name]) for name in ("r_f", "z_f", "phase_deg", "tension")] for row in shapes]
        yield kind, system, float(shapes[0]["gamma"]), np.array(numbers).T


REFERENCE = list(reference_shapes())


def shapes_of(system, gamma):
    """Columns r_f, z_f, phase_deg and tension, nearest to the axis first."""
    found = solve_drag_equilibria(system, gamma)
    order = np.argsort(found.r_f)
    return np.array([column[order] for column in (found.r_f, found.z_f, found.phase_deg, found.tension)])


@pytest.mark.parametrize("kind", ["air", "water", "floating", "side"])
def test_all_shapes_of_an_independent_program(kind):
    """Tolerances: of that program, whose own error grows with how much a shot amplifies; measured a tenth of them."""
    chosen = [row for row in REFERENCE if row[0] == kind]
    assert len(chosen) == 15
    for _, system, gamma, theirs in chosen:
        ours = shapes_of(system, gamma)
        assert ours.shape == theirs.shape, (system, gamma)
        np.testing.assert_allclose(ours[0], theirs[0], rtol=1e-10)
        np.testing.assert_allclose(ours[1], theirs[1], rtol=0, atol=1e-10 * system.lam)
        np.testing.assert_allclose(ours[2], theirs[2], rtol=0, atol=1e-7)
        np.testing.assert_allclose(ours[3], theirs[3], rtol=1e-10)


def test_what_the_file_holds():
    kinds = [row[0] for row in REFERENCE]
    assert len(kinds) == 60
    for kind in set(kinds):
        assert max(row[3].shape[1] for row in REFERENCE if row[0] == kind) >= 3
    floating = [system for kind, system, *_ in REFERENCE if kind == "floating"]
    assert {(system.w > 0, system.w_f > 0) for system in floating} >= {(True, False), (False, True), (False, False)}
    assert {np.sign(gamma) for kind, _, gamma, _ in REFERENCE if kind == "side"} == {-1.0, 1.0}


# A system with every force, and one of a bare cable.
FULL = System(12.0, 2.0, 3.0, C=0.3, C_f=0.2, w=0.8, C_t=0.05, C_s=0.08, b_s=0.3)
BARE = System(4.0, 0.0, 0.0, C=2.0, w=0.6, C_s=0.3, b_s=0.2)
GAMMA = 0.8


@pytest.mark.parametrize("system", [FULL, BARE, replace(FULL, w_f=-1.0)])
def test_mirrored_in_a_level_plane(system):
    """Weights upside down are the shapes upside down; the side force, to one hand of the cable, changes its own."""
    upright = solve_drag_equilibria(system, GAMMA)
    mirrored = solve_drag_equilibria(replace(system, w=-system.w, w_f=-system.w_f, C_s=-system.C_s), GAMMA)
    for name in ("r_f", "x_f", "y_f", "phase_deg", "tension", "R_x0", "R_y0", "nodes", "branch"):
        np.testing.assert_array_equal(getattr(mirrored, name), getattr(upright, name))
    for name in ("z_f", "R_z0"):
        np.testing.assert_array_equal(getattr(mirrored, name), -getattr(upright, name))


@pytest.mark.parametrize("system", [FULL, BARE, replace(FULL, w=-0.3)])
def test_a_turn_to_port_is_one_to_starboard_in_a_mirror(system):
    port = solve_drag_equilibria(system, -GAMMA)
    starboard = solve_drag_equilibria(replace(system, C_s=-system.C_s), GAMMA)
    for name in ("r_f", "x_f", "z_f", "phase_deg", "tension", "R_x0", "R_z0", "nodes", "branch"):
        np.testing.assert_array_equal(getattr(port, name), getattr(starboard, name))
    for name in ("y_f", "R_y0"):
        np.testing.assert_array_equal(getattr(port, name), -getattr(starboard, name))
    s = [0.0, 0.3 * system.lam, system.lam]
    one, other = shape_of(port, "shape 1", s), shape_of(starboard, "shape 1", s)
    for name in ("x", "y", "z", "R_x", "R_y", "R_z", "T"):
        sign = -1.0 if name in ("y", "R_y") else 1.0
        np.testing.assert_allclose(one[name], sign * other[name], rtol=1e-14, atol=1e-14)
    assert one.y[0] == pytest.approx(0.0, abs=1e-12)


def test_without_side_force_both_turns_are_one():
    system = replace(FULL, C_s=0.0)
    port, starboard = solve_drag_equilibria(system, -GAMMA), solve_drag_equilibria(system, GAMMA)
    np.testing.assert_array_equal(port.r_f, starboard.r_f)
    vacuum = towatlas.equilibria(10.0, 1.0, -0.6)
    np.testing.assert_array_equal(vacuum.R_x0, towatlas.equilibria(10.0, 1.0, 0.6).R_x0)


@pytest.mark.parametrize("system", [FULL, BARE])
def test_side_force_vanishes(system):
    """In proportion; and one that is largest at no angle is one that is largest far beyond 90 degrees."""
    without = shapes_of(replace(system, C_s=0.0), GAMMA)
    small, smaller = (shapes_of(replace(system, C_s=c), GAMMA) - without for c in (1e-4, 1e-6))
    np.testing.assert_allclose(smaller, 0.01 * small, rtol=1e-2, atol=1e-11)
    assert np.abs(small[0]).min() > 1e-7
    np.testing.assert_allclose(
        shapes_of(replace(system, b_s=1e8), GAMMA), shapes_of(replace(system, b_s=inf), GAMMA), rtol=1e-12, atol=1e-11
    )


@pytest.mark.parametrize("system", [FULL, BARE, replace(FULL, w=-0.4)])
def test_weaker_gravity(system):
    """Weights, squares of speeds and tensions scale together."""
    part = 0.37
    weaker = replace(system, w=part * system.w, w_f=part * system.w_f)
    strong, weak = shapes_of(system, GAMMA), shapes_of(weaker, GAMMA * sqrt(part))
    np.testing.assert_allclose(weak[:3], strong[:3], rtol=1e-12, atol=1e-10)
    np.testing.assert_allclose(weak[3], part * strong[3], rtol=1e-12)


@pytest.mark.parametrize("system", [FULL, BARE, replace(FULL, w=-0.4)])
def test_the_lower_part_of_a_cable_is_a_cable(system):
    """Cut anywhere and towed there on the circle that it is on, it keeps its shape."""
    found = solve_drag_equilibria(system, GAMMA)
    for which in range(len(found)):
        cut = 0.3 * system.lam
        at = shape_of(found, which, [cut])
        radius = float(np.hypot(at.x, at.y)[0])
        lower = replace(
            system,
            lam=(system.lam - cut) / radius,
            w_f=system.w_f / radius,
            m_f=system.m_f / radius,
            C=system.C * radius,
            C_t=system.C_t * radius,
            C_s=system.C_s * radius,
        )
        again = solve_drag_equilibria(lower, GAMMA * sqrt(radius))
        k = int(np.argmin(np.abs(again.r_f * radius - found.r_f[which])))
        assert again.r_f[k] * radius == pytest.approx(found.r_f[which], rel=1e-11)
        assert again.tension[k] * radius == pytest.approx(float(at["T"][0]), rel=1e-11)
        assert again.z_f[k] * radius == pytest.approx(found.z_f[which] - float(at.z[0]), rel=1e-11)


def test_the_phase_is_carried_along_the_cable():
    """It is the angle of the fish but for whole turns, grows down the cable, and counts the nodes."""
    for _, system, gamma, _ in REFERENCE:
        found = solve_drag_equilibria(system, gamma)
        behind = np.degrees(np.arctan2(-np.sign(gamma) * found.y_f, found.x_f))
        np.testing.assert_allclose((found.phase_deg - behind + 180.0) % 360.0, 180.0, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(found.nodes, np.round(found.phase_deg / 180.0))
    found = towatlas.equilibria(27.8, 0.0064, 14.9, C=0.0142)
    assert found.phase_deg.max() > 2000.0
    k = int(np.argmax(found.phase_deg))
    curve = shape_of(found, k, np.linspace(0.0, 27.8, 4001))
    angle = np.unwrap(np.arctan2(-curve.y.values, curve.x.values))
    assert np.diff(angle).min() > -1e-12
    assert np.degrees(angle[-1]) == pytest.approx(found.phase_deg[k], rel=1e-12)


def test_near_axis_names_one_shape_at_most():
    for _, system, gamma, theirs in REFERENCE:
        found = solve_drag_equilibria(system, gamma)
        assert list(np.flatnonzero(found.near_axis)) == ([found.expected] if theirs[0, 0] < 0.5 else [])


@pytest.mark.parametrize(
    ("system", "gamma", "r_f"),
    [
        # A heavy fish, fast: one shape near the axis, two with the cable stretched out.
        (System(5.0, 1e4, 1e4, C=0.01), 50.0, [2.9423753728e-4, 3.99999997517, 5.9999999878]),
        # A fish with drag and neither weight nor mass, whose cable begins along the flow.
        (System(5.0, 0.0, 0.0, C=70.0, C_f=0.02, w=0.3), 0.1, [0.30657078]),
        # Drag so strong that a light fish is all but a bare tip.
        (
            System(
                12.010666834602883,
                0.001710398880444513,
                0.002408597668317028,
                C=11826.15942654947,
                w=0.35427165240449693,
            ),
            0.3499361568546442,
            [1.04513996],
        ),
    ],
)
def test_systems_that_were_lost_once(system, gamma, r_f):
    found = shapes_of(system, gamma)[0]
    np.testing.assert_allclose(found, r_f, rtol=1e-8)


@pytest.mark.parametrize("C_t", [0.0, 3.0])
@pytest.mark.parametrize("C_s", [0.0, 9.0])
def test_a_fish_with_drag_alone(C_t, C_s):
    """As its weight and its mass vanish together nothing happens to the shape."""
    system = System(0.9, 0.0, 0.0, C=70.0, C_f=2.0, w=0.6, C_t=C_t, C_s=C_s, b_s=0.2)
    limit = shapes_of(system, 0.3)
    assert limit.shape == (4, 1)
    weighed = [shapes_of(replace(system, w_f=small, m_f=small), 0.3) for small in (1e-5, 1e-6)]
    # Linear in the weight: extrapolated, its square is left.
    np.testing.assert_allclose((10 * weighed[1] - weighed[0]) / 9, limit, rtol=1e-9)


def test_a_bare_cable_with_many_nodes_comes_back():
    found = shapes_of(System(59.71245386110945, 0.0, 0.0, C=0.1122176465650289), 23.971409767469368)
    assert found.shape == (4, 11)


def ship(radius_ft, knots, length, C_DT=0.062, C_DN=1.27, a=0.0, b=inf):
    """Towing a sphere of 250 lbf behind a ship in a circle: the system, its speed, and (mu + rho A) / mu.

    Half an inch of steel cable of 0.3 lb/ft, a sphere 1.2 ft across of drag coefficient 0.2, sea water.
    """
    foot, pound, gravity, rho = 0.3048, 0.45359237, 9.80665, 1025.0
    radius, d, sphere = radius_ft * foot, foot / 24, 1.2 * foot
    mu, area, volume = 0.3 * pound / foot, pi * d * d / 4, pi * sphere**3 / 6
    unit, mass = mu + rho * area, 250 * pound
    system = System.of(
        length,
        (mass - rho * volume) / (unit * radius),
        C=rho * C_DN * d * radius / (2 * unit),
        m_f=(mass + rho * volume / 2) / (unit * radius),
        C_f=rho * 0.2 * pi * sphere**2 / (8 * unit),
        w=(mu - rho * area) / unit,
        C_t=rho * C_DT * d * radius / (2 * unit),
        C_s=rho * a * d * radius / (2 * unit),
        b_s=b,
    )
    return system, knots * 1852 / 3600 / sqrt(radius * gravity), unit / mu


@pytest.mark.parametrize(
    ("knots", "length", "verticality", "r_f", "phase", "tension"),
    [
        (1, 1, 0.93515, 0.96647, 19.576, 0.87949),
        (3, 1, 0.48235, 0.85111, 53.060, 0.68701),
        (3, 4, 0.89341, 0.21223, 166.474, 0.70164),
        (5, 2, 0.35192, 0.50041, 144.587, 0.62764),
        (5, 10, 0.95940, 0.03952, 290.765, 0.71691),
    ],
)
def test_a_ship_in_a_circle(knots, length, verticality, r_f, phase, tension):
    """By a shooting code in SI units (DOP853, 1e-11), to its digits; tension over the weight of the cable in air."""
    system, gamma, heavier = ship(3000, knots, length)
    found = shapes_of(system, gamma)[:, 0]
    assert [round(float(x), 5) for x in (found[1] / length, found[0])] == [verticality, r_f]
    assert round(float(found[2]), 3) == phase
    assert round(float(found[3]) * heavier / length, 5) == tension


@pytest.mark.parametrize(
    ("radius_ft", "folds"), [(10_000, (2.65870317, 2.72720846)), (6_000, (2.58141888, 2.59779206))]
)
def test_three_shapes_in_water_without_tangential_drag(radius_ft, folds):
    """Between two folds that drag makes; none leads to them from the vacuum."""

    def count(length):
        system, gamma, _ = ship(radius_ft, 5, length, C_DT=0.0)
        return shapes_of(system, gamma).shape[1]

    first, second = folds
    assert [count(first - 1e-8), count(first + 1e-8), count(second - 1e-8), count(second + 1e-8)] == [1, 3, 3, 1]
    assert count((first + second) / 2) == 3
    system, gamma, _ = ship(radius_ft, 5, (first + second) / 2)
    assert shapes_of(system, gamma).shape[1] == 1


def test_side_force_of_a_stranded_cable():
    """Cable G of DTMB Report 713 behind a ship: the turns to port and to starboard differ."""
    law = {"C_DN": 1.23, "C_DT": 0.025, "a": 0.1835, "b": 0.1803}
    system, gamma, _ = ship(3000, 5, 2, **law)
    to_port, to_starboard = shapes_of(system, -gamma)[0], shapes_of(system, gamma)[0]
    without = shapes_of(replace(system, C_s=0.0), gamma)[0]
    # The constants of the law to four digits, the radii to three.
    assert [*to_port, *to_starboard, *without] == pytest.approx([0.646, 0.525, 0.579], abs=1e-3)


def test_what_nothing_holds():
    with pytest.raises(ValueError, match="w = 0 and w_f = 0: nothing holds the cable down or up"):
        towatlas.equilibria(5, 0, 1, C=0.1, w=0)
    with pytest.raises(ValueError, match="w_f = -2 is a fish lighter than the fluid, whose mass is its own: give m_f"):
        towatlas.equilibria(5, -2, 1, C=0.1)
    assert len(towatlas.equilibria(5, 0.1, 1, C=0.1, w=0)) >= 1
    floating = towatlas.equilibria(5, -2, 1, C=0.1, m_f=3, w=0.2)
    assert floating.z_f[floating.expected] < 0


def reference_shots():
    """The shapes of the file, and cables without drag, as shots: r, gamma and systems."""
    r, gamma = [0.4, 0.7], [1.5, 0.8]
    systems = [astuple(System(4.0, 0.5, 0.5)), astuple(System(6.0, -1.0, 2.0, C_f=0.3, w=0.7))]
    for _, system, speed, theirs in REFERENCE:
        for r_f in theirs[0]:
            r.append(r_f * speed**2)
            gamma.append(speed)
            systems.append(astuple(system))
    return np.array(r), np.array(gamma), np.array(systems)


def test_shots_are_the_same_bits_in_any_order_and_company():
    r, gamma, systems = reference_shots()
    # More than a thread takes at a time.
    rows = np.tile(np.arange(len(r)), 4)
    orders = [rows, rows[::-1], np.random.default_rng(5).permutation(rows)]
    for jets in (jets_of(1), jets_of(2, gamma=True)):
        plain = shoot(r, gamma, systems, jets)
        assert set(plain.status) == {status.OK}
        for order, many in zip(orders, (1, MOST_THREADS, MOST_THREADS), strict=True):
            with limited_threads(many):
                ends = shoot(r[order], gamma[order], systems[order], jets)
            for name in vars(plain):
                # numpy's arctan2 rounds by where in an array a number is; the rest comes from the kernel.
                close = 1e-15 if name == "angle" else 0.0
                np.testing.assert_allclose(getattr(ends, name), getattr(plain, name)[order], rtol=close, atol=0.0)
        for k in (0, 40, 91):
            alone = shoot(r[k], gamma[k], systems[k], jets)
            np.testing.assert_array_equal(alone.log_rho[0], plain.log_rho[k])


def test_slopes_written_out_agree_with_the_program():
    """Position within rounding of the amplitude of the wave, times how much the shot amplifies that."""
    r, gamma, systems = reference_shots()
    fast, table = shoot(r, gamma, systems, jets_of(1)), shoot(r, gamma, systems, jets_of(1, gamma=True))
    amplification = 1.0 + np.abs(table.log_rho[:, 1])
    wave = np.hypot(1.0, np.hypot(table.FX, table.FY)[:, 0] / np.sqrt(table.T[:, 0]) / gamma**2)
    assert (np.abs(fast.log_rho[:, 0] - table.log_rho[:, 0]) <= 1e-12 * wave * amplification).all()
    assert (np.abs(fast.log_rho[:, 1] - table.log_rho[:, 1]) <= 1e-11 * wave * amplification**2).all()
    np.testing.assert_allclose(fast.T[:, 0], table.T[:, 0], rtol=1e-12 * amplification.max())
    np.testing.assert_allclose(fast.angle, table.angle, rtol=1e-12, atol=1e-12 * amplification.max())


def test_no_error_of_a_shape_is_below_its_rounding():
    """9e-22 was stated, of a double: the end of this cable moves by millions of times what its fish does."""
    found = towatlas.equilibria(
        19.585471744893475, 0.020061130139090257, 3.670775267165097, C_s=0.5076961044275881, w=0.9112838487376911
    )
    assert found.error.min() >= np.finfo(float).eps
