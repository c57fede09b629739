"""Drag: equilibria against independent methods, limits, balances and the photographs of the report."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import reference_drag
from helpers import run
from scipy.integrate import solve_bvp, solve_ivp

import towatlas
from towatlas.kernels import drag as kernel
from towatlas.kernels import status
from towatlas.kernels.calls import ORDER
from towatlas.kernels.compiling import opened
from towatlas.kernels.system import COLUMNS
from towatlas.kernels.vector import LANES, aligned
from towatlas.report.nrl7048.page import PHOTOGRAPHS
from towatlas.solve.drag_equilibria import solve_drag_equilibria
from towatlas.solve.jets import jets_of
from towatlas.solve.shapes import shape_of
from towatlas.solve.shots import direction_of, shoot
from towatlas.system import System


@cache
def in_air(lam, w_f, gamma):
    return towatlas.equilibria(lam, w_f, gamma, C=0.018)


@pytest.mark.parametrize("photograph", PHOTOGRAPHS, ids=lambda photograph: photograph.figure)
def test_nodes_of_the_photographs(photograph):
    """The report's own drag constant gets all eight; what a vacuum gets is tested with the report."""
    found = in_air(photograph.lam, photograph.w_f, photograph.gamma)
    assert found.nodes[found.expected] == photograph.nodes
    assert len(found) == 3


def random_systems(rows, seed):
    """Systems and fish radii over the domain, uniform in the logarithms; every fifth without a fish."""
    rng = np.random.default_rng(seed)
    for k in range(rows):
        gamma = 10 ** rng.uniform(np.log10(0.05), np.log10(50))
        lam, w_f = 10 ** rng.uniform(-0.3, np.log10(200)), (k % 5 > 0) * 10 ** rng.uniform(-3, 4)
        c = 10 ** rng.uniform(-3, 1)
        system = System(
            lam,
            w_f,
            w_f * rng.uniform(1, 2),
            C=c,
            C_f=rng.choice([0, 0.1]) * w_f,
            w=rng.choice([1, 0.6]),
            C_t=rng.choice([0, 0.1]) * c,
        )
        yield gamma, system, (1 + lam) * 10 ** rng.uniform(-4, 0)


@pytest.mark.slow
def test_shots_agree_with_long_doubles():
    """Relative to the amplitude of the wave, and to the force, and to what moving the fish does to them."""
    worst = []
    for gamma, system, r in random_systems(16, 4):
        ends = shoot([r * gamma**2], gamma, system.row(), jets_of(1))
        x, y, _, *force = reference_drag.shot(r, gamma, system)
        scale = gamma**-2
        mine = np.array([ends.X[0, 0], ends.Y[0, 0], ends.FX[0, 0], ends.FY[0, 0], ends.FZ[0, 0]]) * scale
        size = np.sqrt(np.dot(force, force))
        amplitude = np.hypot(np.hypot(x, y), np.hypot(*force[:2]) / gamma / np.sqrt(size))
        slope = 1.0 + np.hypot(ends.X[0, 1], ends.Y[0, 1]) * scale / amplitude
        worst.append(float(np.hypot(mine[0] - x, mine[1] - y) / amplitude / slope))
        assert np.abs(mine[2:] - force).max() / size / slope < 1e-12
        assert ends.status[0] == 0
    assert max(worst) < 1e-12
    assert np.median(worst) < 1e-15


def test_vacuum_as_drag_vanishes():
    """The kernel with drag, without it, is the vacuum; at C = 0 the answer is the vacuum's own."""
    for lam, w_f, gamma in ((37.8, 1352, 5.94), (10, 0, 1.5), (2.5, 3, 0.7)):
        vacuum = towatlas.equilibria(lam, w_f, gamma)
        assert np.array_equal(towatlas.equilibria(lam, w_f, gamma, C=0, C_f=0, C_t=0, w=1, m_f=w_f).R_x0, vacuum.R_x0)
        radii = np.sort(np.abs(vacuum.x_f))
        bare = solve_drag_equilibria(System(lam, w_f, w_f), gamma)
        np.testing.assert_allclose(np.sort(bare.r_f), radii, rtol=1e-12)
        differences = []
        for c in (1e-8, 1e-10):
            found = towatlas.equilibria(lam, w_f, gamma, C=c)
            assert list(found.nodes) == list(vacuum.nodes)
            differences.append(np.abs(found.r_f / vacuum.r_f - 1.0).max())
        assert differences[1] < max(1e-12, 0.02 * differences[0])


def test_shell(capsys):
    code, out, err = run(
        capsys, "equilibria", "--lam", "37.8", "--wf", "1352", "--gamma", "5.94", "--C", "0.018", "--json"
    )
    assert code == 0
    rows = json.loads(out)
    assert [row["nodes"] for row in rows] == [1, 2, 0]
    assert [row["branch"] for row in rows] == ["shape 2", "shape 1", "shape 3"]
    assert [row["near_axis"] for row in rows] == [False, True, False]
    assert [row["expected"] for row in rows] == [False, True, False]
    assert all(row["boundary_error"] is None for row in rows)
    assert "shots with derivative" in err
    assert "not proved" in err


def test_shape_ends_where_it_should():
    found = towatlas.equilibria(37.8, 1352, 2.97, C=0.018)
    k = found.expected
    shape = shape_of(found, k, [0.0, 20.0, 37.8])
    assert shape.x.values[0] == pytest.approx(1.0, abs=1e-12)
    assert shape.y.values[0] == pytest.approx(0.0, abs=1e-12)
    assert shape.z.values[-1] == pytest.approx(found.z_f[k], rel=1e-14)
    assert shape["T"][0] == pytest.approx(found.tension[k], rel=1e-14)


def test_largest_deflection_as_photographed():
    """Of the shapes shown in the y-z plane only that of Fig. 8b has a deflection to speak of."""
    largest = {}
    for lam, w_f, gamma in ((p.lam, p.w_f, p.gamma) for p in PHOTOGRAPHS[:5]):
        found = in_air(lam, w_f, gamma)
        largest[lam, gamma] = float(np.abs(shape_of(found, found.expected, np.linspace(0, lam, 100)).y).max())
    assert max(largest, key=largest.get) == (52.4, 4.77)


def test_single_equilibrium_near_the_axis():
    """With the report's drag the second fold is gone: one shape near the axis, two with the cable stretched out."""
    for gamma in (1.6, 6.5):
        found = towatlas.equilibria(37.8, 1352, gamma, C=0.018)
        assert (found.r_f < 1).sum() == 1
        assert (found.r_f > 36).sum() == 2
        assert len(found) == 3


FULL = System(12.0, 2.0, 3.0, C=0.3, C_f=0.2, w=0.8, C_t=0.05)


SIDE = replace(FULL, C_s=0.08, b_s=0.3)
# Systems and speeds with every force, to either hand, whose cable and fish sink or float.
BALANCED = {
    "sinking": (FULL, 0.8),
    "bare": (System(8.0, 0.0, 0.0, C=0.05), 1.1),
    "starboard": (SIDE, 0.8),
    "port": (SIDE, -0.8),
    "floating cable": (replace(SIDE, w=-0.4), 0.8),
    "floating fish": (replace(SIDE, w_f=-1.5), -0.6),
    "floating": (replace(SIDE, w=-0.4, w_f=-1.5, C_s=-0.08), 0.8),
}


@pytest.mark.parametrize("case", BALANCED)
def test_balance_of_forces_and_moments(case):
    """The reaction at the tow point carries the loads of the whole cable and of the fish, and their moments."""
    system, gamma = BALANCED[case]
    found, g2 = solve_drag_equilibria(system, gamma), gamma**2
    edges = np.linspace(0, system.lam, 61)
    x, weights = np.polynomial.legendre.leggauss(12)
    # Towards the fish the shape of a bare tip bends on ever smaller lengths.
    s = (0.5 * (edges[1:] + edges[:-1])[:, None] + 0.5 * np.diff(edges)[:, None] * x).ravel()
    weight = np.outer(0.5 * np.diff(edges), weights).ravel()
    for which in range(len(found)):
        shape = shape_of(found, which, s)
        position = np.stack([shape.x.values, shape.y.values, shape.z.values])
        force = np.stack([shape.R_x.values, shape.R_y.values, shape.R_z.values])
        tangent = force / shape["T"].values
        velocity = np.sign(gamma) * np.stack([-shape.y.values, shape.x.values, 0 * shape.x.values])
        along = np.sum(velocity * tangent, axis=0)
        across = velocity - along * tangent
        load = np.stack([g2 * shape.x.values, g2 * shape.y.values, np.full(len(s), system.w)])
        load -= g2 * system.C * np.linalg.norm(across, axis=0) * across
        load -= g2 * system.C_t * np.abs(along) * along * tangent
        speed = np.linalg.norm(velocity, axis=0)
        sine = np.linalg.norm(across, axis=0) / speed
        side = g2 * system.C_s * speed / (1 + (sine / system.b_s) ** 2)
        load += side * np.cross(tangent, velocity, axis=0)
        fish = np.array([found.x_f[which], found.y_f[which], found.z_f[which]])
        r_f = np.hypot(*fish[:2])
        on_fish = np.array([g2 * system.m_f * fish[0], g2 * system.m_f * fish[1], system.w_f])
        on_fish -= system.C_f * g2 * r_f * np.sign(gamma) * np.array([-fish[1], fish[0], 0])
        reaction = np.array([found.R_x0[which], found.R_y0[which], found.R_z0[which]])
        total = load @ weight + on_fish
        scale = np.linalg.norm(reaction) + np.abs(load).sum(axis=0) @ weight
        np.testing.assert_allclose(total, reaction, atol=1e-9 * scale)
        moments = np.cross(position.T, load.T).T @ weight + np.cross(fish, on_fish)
        np.testing.assert_allclose(moments, np.cross([1, 0, 0], reaction), atol=1e-9 * scale * (1 + system.lam))
        assert np.linalg.norm(reaction) == pytest.approx(found.tension[which], rel=1e-13)


def test_collocation_finds_the_same_equilibria():
    """scipy's solve_bvp on the six equations and boundary conditions (20)-(23), from a guess a percent off."""
    system, g2 = FULL, 0.8**2
    found = solve_drag_equilibria(system, 0.8)

    def slopes(s, states):
        columns = [reference_drag.slopes(state, g2, system.C, system.w, system.C_t) for state in states.T]
        return np.stack(columns, axis=1).astype(float)

    def ends(a, b):
        load = g2 * np.array([system.m_f * b[0], system.m_f * b[1]])
        load -= system.C_f * g2 * np.hypot(b[0], b[1]) * np.array([-b[1], b[0]])
        return np.array([a[0] - 1, a[1], a[2], b[3] - load[0], b[4] - load[1], b[5] - system.w_f])

    s = np.linspace(0, system.lam, 200)
    for which in range(len(found)):
        shape = shape_of(found, which, s)
        guess = np.stack(
            [shape.x.values, shape.y.values, shape.z.values, shape.R_x.values, shape.R_y.values, shape.R_z.values]
        )
        solved = solve_bvp(slopes, ends, s, guess * (1 + 0.01 * np.cos(s)), tol=1e-8, max_nodes=20000)
        assert solved.status == 0
        assert np.hypot(*solved.y[:2, -1]) == pytest.approx(found.r_f[which], rel=1e-6)
        assert solved.y[3, 0] == pytest.approx(found.R_x0[which], rel=1e-6, abs=1e-6 * found.tension[which])


@pytest.mark.parametrize("w", [1.0, 0.5])
def test_straight_trailing_cable(w):
    """A tow circle far larger than the cable: a straight line at Pode's critical angle, w cos(phi) = D sin^2(phi)."""
    ratio = 2.0  # drag of a cable across the stream, over (mu + rho A) g
    cosine = (np.sqrt(w * w + 4 * ratio**2) - w) / (2 * ratio)
    sine = np.sqrt(1 - cosine**2)
    wrong = []
    for small in (1e-3, 1e-4):
        found = towatlas.equilibria(small, 0.0, np.sqrt(small), C=ratio / small, w=w)
        assert len(found) == 1
        assert found.nodes[0] == 0
        offset = np.array([-found.y_f[0], found.z_f[0]]) / small
        wrong.append(np.abs(offset - [cosine, sine]).max())
    # The circle bends the flow, and the cable, towards x: y and z see the square of it.
    assert wrong[0] < 1e-6
    assert wrong[1] == pytest.approx(0.01 * wrong[0], rel=0.05)


@pytest.mark.parametrize("name", COLUMNS)
def test_jets_are_derivatives(name):
    """To fourth order in the difference, on a shot with every term switched on, whatever number of the system moves."""
    jets, r, gamma, h = jets_of(3, gamma=True, parameter=True), 3.0, 0.9, 1e-3
    full = replace(FULL, C_s=0.07, b_s=0.6)
    jet = shoot([r], gamma, full.row(), jets, directions=direction_of((name,), full.row())).log_rho[0]

    def shifted(log_r=0.0, log_gamma=0.0, log_parameter=0.0):
        system = replace(full, **{name: getattr(full, name) * np.exp(log_parameter)})
        return shoot([r * np.exp(log_r)], gamma * np.exp(log_gamma), system.row(), jets).log_rho[0]

    for axis, unit in enumerate(np.eye(3)):
        plus, minus, far, further = (shifted(*(k * h * unit)) for k in (1, -1, 2, -2))
        # Of log rho and of its slope in log r.
        for k in range(2):
            monomial = [k, 0, 0]
            monomial[axis] += 1
            many = k + 1 if axis == 0 else 1
            at = jets.at(k, 0, 0)
            difference = (8 * (plus[at] - minus[at]) - (far[at] - further[at])) / (12 * h)
            assert many * jet[jets.at(*monomial)] == pytest.approx(difference, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("m", [2, 4, 7, 10])
def test_order_of_convergence_of_the_series(m):
    """One step with the terms to order m is wrong by h^(m+1), against an integrator in the report's own variables."""
    c, c_t, w = 0.4, 0.1, 0.8
    # Units in which gamma is 1: those of the kernel are then the report's. X, Y, h, F_x, F_y, F_z.
    state = np.array([1.2, 0.5, 0.0, 0.7, -0.9, 1.5])
    room, set_parameters, expand = map(opened, (aligned, kernel.set_parameters, kernel.expand_jets))
    coefficients, parameters, jets = room(kernel.QUANTITIES * kernel.KEPT), room(kernel.PARAMETERS), jets_of(0)
    table = coefficients.reshape(kernel.QUANTITIES, kernel.KEPT, LANES)
    system = System(5.0, 1.0, 1.0, C=c, w=w, C_t=c_t).row()
    for lane in range(LANES):
        set_parameters(parameters, lane, 1.0, 1.0, system, np.zeros_like(system), jets.places, 1)
    table[kernel.X : kernel.STATE, 0] = state[:, None]
    groups = np.full(kernel.GROUPS, True)
    groups[kernel.ON_SIDE] = False
    expand(coefficients, parameters, jets.products, jets.pairs, 1, groups)

    def slopes(sigma, y):
        down = np.concatenate([y[:2], [-y[2]], y[3:]])
        tension = np.linalg.norm(y[3:])
        # From the fish up: against the report's arc length, and the height against its z.
        return -tension * reference_drag.slopes(down, 1.0, c, w, c_t).astype(float) * [1, 1, -1, 1, 1, 1]

    h = np.array([1.0, 0.5]) * 10.0 ** (-7.0 / (m + 1))
    exact = solve_ivp(slopes, (0, h[0]), state, "DOP853", t_eval=h[::-1], rtol=1e-13, atol=1e-15).y[:, ::-1]
    terms = table[kernel.X : kernel.STATE, : ORDER + 1, LANES - 1]
    series = np.stack([np.polyval(row[m::-1], h) for row in terms])
    coarse, fine = np.linalg.norm(series - exact, axis=0)
    assert np.log2(coarse / fine) == pytest.approx(m + 1, abs=0.25)
    # The terms beyond are what is missing.
    whole = np.array([np.polyval(row[::-1], h[1]) for row in terms])
    assert np.linalg.norm(whole - exact[:, 1]) < 1e-12


def test_what_a_shot_refuses():
    """A cable with more steps in it than are taken, and numbers that overflow, have a status and no answer."""
    system = System(1e6, 0.0, 0.0, C=0.1)
    with towatlas.patience():
        long = shoot([400.0], 20.0, replace(system, lam=1e7).row(), jets_of(0))
    assert (long.status[0], long.steps[0]) == (status.STEP_LIMIT, 500_000)
    overflowing = shoot([1e200], 1.0, replace(system, lam=10.0, w_f=1.0, m_f=1e200).row(), jets_of(0))
    assert overflowing.status[0] == status.BAD_INPUT
    with towatlas.patience(1.0), pytest.raises(towatlas.TooMuchWork, match="too many for 1 s of CPU: "):
        towatlas.equilibria(system.lam, 0.0, 20.0, C=system.C)
    rows = np.tile(system.row(), (5000, 1))
    with towatlas.patience(1.0), pytest.raises(towatlas.TooMuchWork, match="shots with drag: not finished"):
        shoot(np.full(len(rows), 400.0), 20.0, rows, jets_of(1))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"C": -0.1}, "C must be finite and not negative"),
        ({"C": np.nan}, "C must be finite"),
        ({"C": [0.1, 0.2]}, "C must be one number"),
        ({"C_f": "much"}, "C_f must be a real number"),
        ({"m_f": -1}, "m_f must be finite and not negative"),
        ({"lam": 0}, "lam must be"),
        ({"w_f": np.inf}, "w_f must be finite"),
        ({"w_f": [1, 2]}, "w_f must be one number"),
        ({"w_f": -1}, "lighter than the fluid, whose mass is its own: give m_f"),
        ({"w_f": 0, "w": 0}, "nothing holds the cable down or up"),
        ({"gamma": np.inf}, "gamma must be finite"),
        ({"gamma": 0}, "gamma must not be zero"),
        ({"C_s": np.nan}, "C_s must be finite"),
        ({"b_s": 0}, "b_s, .* must be one positive number"),
        ({"b_s": np.nan}, "b_s, .* must be one positive number"),
        ({"w": -1}, "w = .* must be one number above -1"),
        ({"w": 1.5}, "at most 1"),
    ],
)
def test_bad_systems(options, message):
    with pytest.raises(ValueError, match=message):
        towatlas.equilibria(**({"lam": 5, "w_f": 1, "gamma": 1, "C": 0.1} | options))


def test_bad_points_of_a_shape():
    found = towatlas.equilibria(5, 1, 1, C=0.1)
    with pytest.raises(ValueError, match="arc lengths from 0 to lam = 5"):
        shape_of(found, 0, [5.1])
    with pytest.raises(ValueError, match=r"a whole number from 0 to \d+, .*; got 17"):
        shape_of(found, 17, [1.0])
    for bad in (True, 1.0, "sideways", -1):
        with pytest.raises(ValueError, match="root must be expected"):
            shape_of(found, bad)
    assert shape_of(found, "shape 1").attrs["branch"] == "shape 1"


def test_python_of_the_page_runs():
    text = (Path(__file__).parent.parent / "docs" / "drag.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) == 3
    names: dict = {}
    for block in blocks:
        exec(block, names)


@pytest.mark.parametrize(
    ("lam", "gamma", "C", "r_f"),
    [
        # The radius by DOP853 and Radau at 1e-13; between it and the next root the radius dips and rises again.
        (61.722590714686845, 16.619446962449224, 0.0011481241983754727, 20.316465836838994),
        (61.95040255693825, 16.607426928719146, 0.0011417557965471877, None),
        (62.16704896387401, 16.565454347945636, 0.0011548870758175075, None),
    ],
)
def test_every_shape_listed_reaches_the_tow_radius(lam, gamma, C, r_f):
    found = towatlas.equilibria(lam, 0.0, gamma, C=C)
    ends = shoot(found.r_f * gamma**2, gamma, System.of(lam, 0.0, C=C).row(), jets_of(1))
    assert (np.abs(ends.log_rho[:, 0]) < 1e-13 * (1.0 + np.abs(ends.log_rho[:, 1]))).all()
    if r_f is not None:
        assert np.abs(found.r_f / r_f - 1.0).min() < 1e-12
