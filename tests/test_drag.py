"""Drag: equilibria against an independent integration, against limits, balances and the photographs of the report."""

import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from test_cli import run

import atlas
from atlas.drag import drag_shape, solve_drag_equilibria
from atlas.drag_shots import System, shoot
from atlas.jets import jets_of

# lambda, w_f, gamma, nodes photographed, nodes of the median root in a vacuum (NRL Report 7048, Figs. 3 to 5).
PHOTOGRAPHS = [
    (37.8, 1352, 1.64, 1, 1),
    (37.8, 1352, 2.97, 1, 1),
    (37.8, 1352, 5.94, 2, 2),
    (52.4, 1352, 2.46, 2, 2),
    (52.4, 1352, 4.77, 3, 2),
    (52.4, 1571, 2.60, 2, 1),
    (52.4, 1571, 4.77, 2, 2),
    (52.4, 1571, 7.23, 3, 3),
]


@pytest.mark.parametrize(("lam", "w_f", "gamma", "photographed", "vacuum"), PHOTOGRAPHS)
def test_nodes_of_the_photographs(lam, w_f, gamma, photographed, vacuum):
    """The report's own drag constant gets all eight, its vacuum six."""
    found = atlas.equilibria(lam, w_f, gamma, C=0.018)
    assert found.nodes[found.near_axis][0] == photographed
    median = atlas.equilibria(lam, w_f, gamma)
    assert median.nodes[median.median][0] == vacuum


def _slopes(s, state, gamma2, c, w, c_t):
    """Eqs. (19)-(21), as vectors."""
    position, force = state[:3], state[3:]
    tangent = force / np.sqrt(force @ force)
    velocity = np.array([-position[1], position[0], 0.0])
    along = velocity @ tangent
    across = velocity - along * tangent
    load = np.array([gamma2 * position[0], gamma2 * position[1], w])
    load -= gamma2 * (c * np.sqrt(across @ across) * across + c_t * abs(along) * along * tangent)
    return np.concatenate([tangent, -load])


def reference_shot(r, gamma, system):
    """State at the tow point, x, y, z, R, of a shot with the fish at (r, 0, 0), by DOP853."""
    g2 = gamma**2
    start = np.array([r, 0, 0, g2 * system.m_f * r, -system.C_f * g2 * r * r, system.w_f])
    arguments = g2, system.C, system.w, system.C_t
    solved = solve_ivp(_slopes, (system.lam, 0.0), start, method="DOP853", rtol=3e-14, atol=1e-30, args=arguments)
    assert solved.success
    return solved.y[:, -1]


def random_systems(rows, seed):
    """Systems and fish radii over the domain, uniform in the logarithms; a fish on each."""
    rng = np.random.default_rng(seed)
    for _ in range(rows):
        gamma = 10 ** rng.uniform(np.log10(0.05), np.log10(50))
        lam, w_f = 10 ** rng.uniform(-0.3, np.log10(200)), 10 ** rng.uniform(-3, 4)
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


def test_shots_agree_with_dop853():
    """Relative to the local amplitude of the wave and to what moving the fish by rounding does to the tow point."""
    worst = []
    for gamma, system, r in random_systems(40, 4):
        ends = shoot([r * gamma**2], gamma, system.row(), jets_of(1))
        x, y, _, *force = reference_shot(r, gamma, system)
        scale = gamma**-2
        mine = np.array([ends.X[0, 0], ends.Y[0, 0], ends.FX[0, 0], ends.FY[0, 0], ends.FZ[0, 0]]) * scale
        amplitude = np.hypot(np.hypot(x, y), np.hypot(*force[:2]) / gamma / np.linalg.norm(force) ** 0.5)
        slope = np.hypot(ends.X[0, 1], ends.Y[0, 1]) * scale / amplitude
        error = np.hypot(mine[0] - x, mine[1] - y) / amplitude
        worst.append(error / (1.0 + slope))
        assert np.linalg.norm(mine[2:] - force) / np.linalg.norm(force) / (1.0 + slope) < 1e-11
        assert ends.status[0] == 0
    assert max(worst) < 1e-11
    assert np.median(worst) < 1e-13


def test_vacuum_as_drag_vanishes():
    """The kernel with drag, without it, is the vacuum; at C = 0 the answer is the vacuum's own."""
    for lam, w_f, gamma in ((37.8, 1352, 5.94), (10, 0, 1.5), (2.5, 3, 0.7)):
        vacuum = atlas.equilibria(lam, w_f, gamma)
        assert np.array_equal(atlas.equilibria(lam, w_f, gamma, C=0, C_f=0, C_t=0, w=1, m_f=w_f).R_x0, vacuum.R_x0)
        radii = np.sort(np.abs(vacuum.x_f))
        bare = solve_drag_equilibria(System(lam, w_f, w_f), gamma)
        np.testing.assert_allclose(bare.r_f, radii, rtol=1e-12)
        differences = []
        for c in (1e-8, 1e-10):
            found = atlas.equilibria(lam, w_f, gamma, C=c)
            assert sorted(found.nodes) == sorted(vacuum.nodes)
            differences.append(np.abs(found.r_f / radii - 1.0).max())
        assert differences[1] < max(1e-12, 0.02 * differences[0])


def test_shell(capsys):
    code, out, err = run(
        capsys, "equilibria", "--lam", "37.8", "--wf", "1352", "--gamma", "5.94", "--C", "0.018", "--json"
    )
    assert code == 0
    answer = json.loads(out)
    assert [row["nodes"] for row in answer["equilibria"]] == [2, 1, 0]
    assert "not proved" in err or "shots" in answer["searched"]


def test_shape_ends_where_it_should():
    found = atlas.equilibria(37.8, 1352, 2.97, C=0.018)
    shape = drag_shape(found, 0, [0.0, 20.0, 37.8])
    assert shape.x[0] == pytest.approx(1.0, abs=1e-12)
    assert shape.y[0] == pytest.approx(0.0, abs=1e-12)
    assert shape.z[-1] == pytest.approx(found.z_f[0], rel=1e-14)
    assert shape.T[0] == pytest.approx(found.tension[0], rel=1e-14)
