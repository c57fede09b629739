"""Every module of kernels at small sizes, by tests that run compiled and, with NUMBA_DISABLE_JIT=1, as plain Python.

Interpreted, an index out of range raises, a name without a value raises, and what numba itself gets wrong is gone.
"""

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import reference_drag
from helpers import boundary_error, root_near, shoot
from numpy.polynomial import chebyshev

import towatlas
from towatlas.kernels import status
from towatlas.kernels.calls import FIELDS, SLOPES, Cables, Folds, forward_shots, scan_system, seed_folds, solve_folds
from towatlas.kernels.native import INTERPRETED
from towatlas.kernels.sweeps import forward_shots_parallel, scan_systems_parallel, solve_folds_parallel
from towatlas.limits import excess_length, long_cable, massless_cable
from towatlas.solve.fold_seeds import patches_of, seed_held
from towatlas.solve.jets import jets_of
from towatlas.solve.looks import TOLERANCE, look_stiffly
from towatlas.solve.members import shoot_singly
from towatlas.solve.motion import motions
from towatlas.solve.shots import direction_of
from towatlas.solve.shots import shoot as shoot_drag
from towatlas.system import System

EPS = 2.0**-52

# a, mu, tau of shots: a bare tip, a shot that ends within its series, a light and a heavy fish.
SHOTS = np.array(
    [[0.7, 0.0, 12.0], [2.0, 0.0, 1e-6], [0.8, 1e-11, 6.0], [3.0, 5.0, 40.0], [20.0, 900.0, 60.0]]
).T.copy()
# lam, w_f, n of cables: the report's, two without a fish, one near its threshold.
CABLES = np.array([[37.8, 10.0, 4.4, 3.5], [1352.0, 0.0, 0.0, 0.01], [2, 1, 2, 1]])
# gamma, r_f and system of shots with drag: nothing but the vacuum; normal drag; tangential drag too; a bare tip with
# drag; side force.
DRAG = [
    (1.5, 0.4, System(4.0, 0.5, 0.5)),
    (0.9, 0.6, System(1.5, 2.0, 2.5, C=0.05, C_f=0.2, w=0.8)),
    (1.2, 0.3, System(2.0, 1.0, 1.5, C=0.3, C_f=0.1, w=0.7, C_t=0.03)),
    (0.8, 0.5, System(1.0, 0.0, 0.0, C=0.2, C_t=0.02)),
    (1.1, 0.4, System(1.5, 1.0, 1.5, C=0.2, C_f=0.1, w=0.8, C_t=0.02, C_s=0.05, b_s=0.4)),
]
JETS = jets_of(1, gamma=True, parameter=True)


@pytest.fixture(autouse=True)
def quiet_divisions():
    """numpy's numbers warn of a division by zero; compiled, the kernels' error model makes inf or nan of it."""
    with np.errstate(all="ignore"):
        yield


def folds_of(lam, w_f, n, parallel=False, guess=None):
    """Columns gamma, R_x0, x_f, z_f, then error, of critical states solved from cold, or from a guess and slopes."""
    n = np.array(n, np.int64)
    rows = len(n)
    a, gamma, slopes = guess or (np.zeros(rows), np.zeros(rows), np.full((rows, SLOPES), np.nan))
    cables = Cables(lam, w_f, n, excess_length(lam, w_f, n))
    folds = Folds(a, gamma, slopes, np.empty((rows, 4)), np.empty(rows), np.empty(rows, np.int64))
    if parallel:
        solve_folds_parallel(cables, folds, 10**7)
    else:
        solve_folds(cables, folds, 10**7, 0, rows)
    assert set(folds.statuses) == {status.OK}
    return np.column_stack([folds.states, folds.error])


def scan_of(lam, w_f, parallel=False):
    """The first critical state by the report's method, with as few shots as find it: gamma, R_x0 and resolutions."""
    results, codes = np.empty((1, 1, 4)), np.empty((1, 1), np.int64)
    low, high = 0.95 / np.sqrt(lam), 3.0
    if parallel:
        cable = np.array([lam]), np.array([w_f]), np.array([low]), np.array([high])
        scan_systems_parallel(*cable, 12, 32, 12, 1, 1e-5, results, codes)
    else:
        scan_system(lam, w_f, low, high, 12, 32, 12, 1, 1e-5, results[0], codes[0])
    assert codes[0, 0] == status.OK
    return results[0, 0]


def drag_shots(cases, jets=JETS):
    """Shots with drag side by side: X, Y, H, force and tension at the tow point, a row each, of every case."""
    gamma, r = np.array([DRAG[case][:2] for case in cases]).T
    systems = np.array([DRAG[case][2].row() for case in cases])
    ends = shoot_drag(r * gamma**2, gamma, systems, jets, directions=direction_of(("C",), systems))
    assert set(ends.status) == {status.OK}
    return np.stack([ends.X, ends.Y, ends.H, ends.FX, ends.FY, ends.FZ, ends.T], axis=1)


@cache
def all_drag_shots():
    return drag_shots(range(len(DRAG)))


def drag_shot(case):
    """One shot with drag, jets in r, gamma and C."""
    return all_drag_shots()[case]


def predictor(count):
    """Guesses and slopes from series with random coefficients; the series, the abscissas and their spans."""
    rng = np.random.default_rng(1)
    series, span, w_scale = rng.normal(size=(FIELDS, 3, 5)), np.array([-1.0, 2.0, 0.0, 3.0]), 0.7
    excess, w_f = np.exp(rng.uniform(-1, 2, count)), w_scale * np.expm1(rng.uniform(0, 3, count))
    a, gamma, slopes = np.empty(count), np.empty(count), np.empty((count, SLOPES))
    seed_folds(patches_of(series, (2, 3)), w_f, excess, span, w_scale, a, gamma, slopes, 0, count)
    return series, excess, w_f, span, w_scale, a, gamma, slopes


def wave_scale(ends):
    """Local amplitudes of p and of its variation q, by which errors of a shot are measured."""
    r = np.hypot(SHOTS[1] + ends.tau, ends.f)
    return np.sqrt(ends.p**2 + ends.f**2 / r), np.sqrt(ends.q**2 + ends.v**2 / r), np.sqrt(r)


def test_lanes_on_a_linear_shot_find_the_zeros_of_a_bessel_function():
    found = shoot(1e-9, 0.0, np.inf, 1, 3)
    assert found.status[0] == status.OK
    assert found.folds[0, :, 0] == pytest.approx(long_cable([1, 2, 3]), rel=4e-15)


def test_lanes_keep_the_energy():
    a, mu, tau = SHOTS
    ends = shoot(a, mu, tau)
    assert set(ends.status) == {status.OK}
    energy = np.hypot(mu + tau, ends.f) + ends.p**2 / 2
    start = mu * np.sqrt(1 + a * a) + a * a / 2
    np.testing.assert_allclose(ends.z + start, energy, rtol=1e-14)


def test_lanes_count_what_they_record():
    folds = shoot(2.0, 3.0, np.inf, 1, 3).folds[0, :, 0]
    counted = shoot(2.0, 3.0, np.outer(folds, [1 - 1e-10, 1 + 1e-10]).ravel()).count
    assert list(counted) == [0, 1, 1, 2, 2, 3]


def test_lanes_say_what_failed():
    ends = shoot([np.nan, 0.0, 1e-3, 0.5], [1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 1e6, 1.0], max_steps=20)
    assert list(ends.status) == [status.BAD_INPUT, status.BAD_INPUT, status.STEP_LIMIT, status.OK]


def test_shots_one_by_one_are_the_shots_of_the_lanes():
    """Two kernels for the same equations: loops over jets, and straight-line code."""
    lanes = shoot(*SHOTS)
    each, counts, codes = shoot_singly(*SHOTS)
    np.testing.assert_array_equal(counts, lanes.count)
    assert set(codes) == {status.OK}
    p_scale, q_scale, root = wave_scale(lanes)
    _, f, p, z, v, q = each.T
    assert (np.abs(p - lanes.p) <= 1e-14 * p_scale).all()
    assert (np.abs(f - lanes.f) <= 1e-14 * p_scale * root).all()
    assert (np.abs(q - lanes.q) <= 1e-13 * q_scale).all()
    assert (np.abs(v - lanes.v) <= 1e-13 * q_scale * root).all()
    np.testing.assert_allclose(z, lanes.z, rtol=1e-14)


def test_drag_without_drag_is_the_vacuum():
    """X and its derivative in log r are p and a q of the vacuum's kernel."""
    gamma, r, system = DRAG[0]
    a = r * gamma**2
    lanes = shoot(a, system.w_f * gamma**2, system.lam * gamma**2)
    x, y = drag_shot(0)[:2]
    assert x[:2] == pytest.approx([lanes.p[0], a * lanes.q[0]], abs=1e-14 * a)
    assert not y[:2].any()


@pytest.mark.parametrize("case", [1, 2, 4])
def test_stiff_shots_are_those_of_the_series(case):
    gamma, r, system = DRAG[case]
    found = look_stiffly(np.array([r * gamma**2]), np.array([gamma]), system.row()[None])
    assert found.status[0] == status.OK
    x, y = drag_shot(case)[:2, :2] / gamma**2
    # Some ten steps, each with this error.
    close = pytest.approx(0.0, abs=30 * TOLERANCE * np.hypot(x[0], y[0]))
    assert found.X[0, 0] - x[0] == close
    assert found.Y[0, 0] - y[0] == close
    close = pytest.approx(0.0, abs=30 * TOLERANCE * np.hypot(x[1], y[1]))
    assert found.X[0, 1] - x[1] == close
    assert found.Y[0, 1] - y[1] == close


@pytest.mark.parametrize("case", range(len(DRAG)))
def test_drag_against_an_independent_integrator(case):
    gamma, r, system = DRAG[case]
    x, y, _, *force = reference_drag.shot(r, gamma, system)
    ours = drag_shot(case)[[0, 1, 3, 4, 5], 0] / gamma**2
    size = float(np.hypot.reduce(force))
    # The amplitude of the wave: the radius and, where the cable crosses the axis, what its slant makes of it.
    amplitude = float(np.hypot(np.hypot(x, y), np.hypot(*force[:2]) / gamma / np.sqrt(size)))
    np.testing.assert_allclose(ours[:2], [float(x), float(y)], rtol=0, atol=1e-14 * amplitude)
    np.testing.assert_allclose(ours[2:], np.array(force, float), rtol=0, atol=1e-14 * size)


@pytest.mark.parametrize("case", [0, 1])
def test_jets_keep_the_energy(case):
    """Normal drag does no work along the cable: T + rho^2 / 2 - w h stays, and so do its derivatives."""
    gamma, r, system = DRAG[case]
    x, y, h, *_, tension = drag_shot(case)
    r *= gamma**2
    force = system.m_f * gamma**2 * r, system.C_f * r * r, system.w_f * gamma**2
    at_fish = np.hypot.reduce(force)
    expected = {
        (0, 0, 0): at_fish + r * r / 2,
        (1, 0, 0): (force[0] ** 2 + 2 * force[1] ** 2) / at_fish + r * r,
        (0, 1, 0): 2 * (force[0] ** 2 + force[2] ** 2) / at_fish,
        (0, 0, 1): 0.0,
    }
    for monomial, value in expected.items():
        n = JETS.at(*monomial)
        square = (x[0] ** 2 + y[0] ** 2) / 2 if n == 0 else x[0] * x[n] + y[0] * y[n]
        assert tension[n] + square - system.w * h[n] == pytest.approx(value, abs=1e-14 * expected[0, 0, 0])


def test_drag_in_any_company_is_the_same():
    """Lanes know nothing of each other, not even that one has a side force."""
    for case in (0, 4):
        np.testing.assert_array_equal(drag_shots([case])[0], drag_shot(case))


def test_slopes_written_out_are_those_of_the_program():
    """Two kernels for the same equations: jets of one slope written out, and any jets by a table."""
    fast = drag_shots([0, 1, 2, 3], jets_of(1))
    table = all_drag_shots()[:4, :, :2]
    # Of the amplitudes of the wave and of the force.
    place, force = np.hypot(table[:, :2], table[:, 2:3]).max(axis=1), table[:, 6]
    scale = np.stack([place, place, place, force, force, force, force], axis=1)
    assert (np.abs(fast - table) <= 1e-12 * np.maximum(np.abs(scale), np.abs(scale[..., :1]))).all()


def force_of_fluid(V, t, system, g2):
    """Per length of cable, for complex numbers too: its derivatives are those by an imaginary step."""
    square = lambda v: v @ v  # noqa: E731
    along = V @ t
    N = V - along * t
    force = -(system.C * np.sqrt(square(N)) * N + system.C_t * np.sqrt(along * along) * along * t) / g2
    if system.C_s:
        speed2 = square(V)
        bent = 1.0 + square(N) / speed2 / system.b_s**2
        force = force + system.C_s / g2 * np.sqrt(speed2) / bent * np.cross(t, V)
    return force


def evans_in_arc_length(case, sigma):
    """D by an integrator of SciPy's, over the arc length, from the equations as they are written on paper."""
    solve_ivp = pytest.importorskip("scipy.integrate").solve_ivp
    gamma, r_f, system = case
    g2, S = gamma**2, np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    r, turn, tiny = r_f * g2, sigma * np.eye(3) + S, 1e-30

    def slopes(_, state):
        x, F, eta, phi = state[:3].real, state[3:6].real, state[6:15].reshape(3, 3), state[15:].reshape(3, 3)
        T = np.linalg.norm(F)
        t, V = F / T, S @ x
        steps = 1j * tiny * np.eye(3)
        A = -np.stack([force_of_fluid(V + step, t, system, g2).imag for step in steps], axis=1) / tiny
        E = np.stack([force_of_fluid(V, t + step, system, g2).imag for step in steps], axis=1) / tiny
        force = np.array([x[0], x[1], system.w]) + force_of_fluid(V, t, system, g2)
        slope = (phi - np.outer(t, t @ phi)) / T
        moved = -(turn @ turn + A @ turn) @ eta + E @ slope
        return np.concatenate([-t, force, -slope.ravel(), moved.ravel()])

    pull = system.C_f * r * np.diag([1.0, 2.0, 1.0])
    phi = -(g2 * system.m_f * turn @ turn + pull @ turn)
    force = np.array([g2 * system.m_f * r, -system.C_f * r**2, g2 * system.w_f])
    start = np.concatenate([[r, 0.0, 0.0], force, np.eye(3).ravel(), phi.ravel()]).astype(complex)
    end = solve_ivp(slopes, (0.0, g2 * system.lam), start, method="DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    return np.linalg.det(end[6:15].reshape(3, 3))


@pytest.mark.parametrize("case", [*DRAG[:3], DRAG[4]])
def test_evans_function_against_an_independent_integrator(case):
    gamma, r_f, system = case
    motion = motions(np.array([r_f]), np.array([gamma]), system.row()[None], 1.0)[0]
    sigma = np.array([0.3 + 0.5j, -0.2 + 0.9j, 0.4])
    values, logs = motion.evans(sigma)
    expected = [evans_in_arc_length(case, one) for one in sigma]
    # Of the integrator.
    np.testing.assert_allclose(values * np.exp(logs), expected, rtol=1e-9)


def test_folds_are_folds():
    """On a shot of another kernel p is gamma^2 and its variation none; a forward shot ends in balance at the fish."""
    lam, w_f, n = CABLES
    gamma, r_x0, x_f, *_ = folds_of(lam, w_f, n).T
    gamma2 = gamma**2
    _, f, p, _, v, q = shoot_singly(gamma2 * np.abs(x_f), gamma2 * w_f, gamma2 * lam)[0].T
    assert np.abs(p) == pytest.approx(gamma2, rel=1e-11)
    root = np.sqrt(np.hypot(gamma2 * (w_f + lam), f))
    assert (np.abs(q) <= 1e-9 * np.abs(v) / root).all()
    error = boundary_error(w_f[1:], lam[1:], gamma[1:], r_x0[1:], segments=400)
    assert (np.abs(error) <= 1e-5 * gamma2[1:] * lam[1:]).all()


def test_folds_at_their_limits():
    """A point mass on a straight rod, and the digits of the README."""
    heavy = folds_of(np.array([8.0]), np.array([1e9]), [1])
    assert heavy[0, 0] == pytest.approx(float(massless_cable(8.0)), rel=1e-8)
    lam, w_f, n = CABLES
    assert folds_of(lam, w_f, n)[0, 0] == pytest.approx(3.41756, abs=1e-5)


def test_predictor_is_the_series_it_was_given():
    series, excess, w_f, span, w_scale, a, gamma, slopes = predictor(3)
    x = (2 * np.log(excess) - span[0] - span[1]) / (span[1] - span[0])
    y = (2 * np.log1p(w_f / w_scale) - span[2] - span[3]) / (span[3] - span[2])
    dx, dy = 2 / (span[1] - span[0]), 2 / (span[3] - span[2]) * w_f / (w_f + w_scale)
    for guess, power, c in ((a, 1.0, series[0]), (gamma, 0.5, series[1])):
        np.testing.assert_allclose(np.log(guess * excess**power), chebyshev.chebval2d(y, x, c), atol=1e-13)
    for field, power in enumerate((1.0, 0.5, 0.0, 0.0)):
        c = series[field]
        along_x = dx * chebyshev.chebval2d(y, x, chebyshev.chebder(c, axis=1)) - power
        along_y = dy * chebyshev.chebval2d(y, x, chebyshev.chebder(c, axis=0))
        np.testing.assert_allclose(slopes[:, 2 * field : 2 * field + 2].T, [along_x, along_y], atol=1e-12)


def test_a_fold_from_a_seed_is_the_fold_from_cold():
    """One shot and a correction, against Newton's method: gamma, R_x0, x_f and z_f."""
    for lam, w_f, n in CABLES.T:
        cold = folds_of(*np.atleast_1d(lam, w_f, n))[0]
        excess = excess_length(lam, w_f, int(n))
        seeded = folds_of(*np.atleast_1d(lam, w_f, n), guess=seed_held(int(n), *np.atleast_1d(w_f, excess)))[0]
        assert (np.abs(seeded / cold - 1)[:4] <= cold[4] + seeded[4]).all()


def test_forward_shots_give_the_digits_of_1970():
    """NRL Report 7048, after Eq. (36): 100 segments give the printed root, truncation error and all."""
    assert root_near(1352, 37.8, 1.64, 5.543629, segments=100) == pytest.approx(5.543629, abs=1e-6)


def test_scan_agrees_with_the_direct_solution():
    gamma, r_x0, gamma_resolution, r_x0_resolution = scan_of(2.5, 0.0)
    exact = towatlas.solve_critical(2.5, 0.0)
    assert abs(gamma - exact.gamma) <= gamma_resolution <= 0.01 * gamma
    assert abs(r_x0 - exact.R_x0) <= r_x0_resolution


def forward_pair(build, *rows):
    """Two forward shots by either build."""
    columns = np.array([[0.5, 3.0, 1.2, 4.0], [20.0, 2.0, 1.0, 9.0]]).T
    outputs = np.empty((3, 2))
    build(*columns.copy(), 20, *outputs, *rows)
    return outputs


# Of each parallel build: the serial results, and its own.
BUILDS = {
    "march": lambda: (shoot(*SHOTS, 1, 2).folds, shoot(*SHOTS, 1, 2, parallel=True).folds),
    "solve_folds": lambda: (folds_of(*CABLES[:, 1:]), folds_of(*CABLES[:, 1:], parallel=True)),
    "forward_shots": lambda: (forward_pair(forward_shots, 0, 2), forward_pair(forward_shots_parallel)),
    "scan_systems": lambda: (scan_of(2.5, 0.0), scan_of(2.5, 0.0, parallel=True)),
}


@pytest.mark.parametrize("kernel", BUILDS)
def test_parallel_builds_give_the_same_bits(kernel):
    np.testing.assert_array_equal(*BUILDS[kernel]())


def small_results():
    """One small computation of every kernel: the numbers, and the amplitudes that rounding is relative to."""
    ends = shoot(*SHOTS)
    p_scale, q_scale, root = wave_scale(ends)
    yield ends.p, p_scale
    yield ends.f, p_scale * root
    yield ends.q, q_scale
    yield ends.v, q_scale * root
    yield ends.z, ends.z
    each, _, _ = shoot_singly(*SHOTS)
    yield each.T[1:], np.array([p_scale * root, p_scale, ends.z, q_scale * root, q_scale])
    for case in range(len(DRAG)):
        table = drag_shot(case)
        # The amplitude of the wave: where the cable crosses the axis its slant makes it.
        place = np.hypot(np.hypot(*table[:2]), np.hypot(*table[3:5]) / np.sqrt(table[6, 0]))
        height, force = np.abs(table[2]), np.sqrt((table[3:6] ** 2).sum(axis=0))
        # Derivatives to the larger of their own amplitude and that of what they are derivatives of.
        rows = [np.maximum(size, size[0]) for size in (place, place, height, force, force, force, force)]
        yield table, np.array(rows)
    lam, w_f, n = CABLES
    gamma = folds_of(lam, w_f, n)[:, 0]
    # A rounding of lambda is one of the excess length, which is what gamma follows.
    yield gamma, gamma * (1 + lam / excess_length(lam, w_f, n))
    series, *_, a, gamma, slopes = predictor(3)
    terms = np.abs(series).sum()
    yield np.log([a, gamma]), np.full((2, 3), terms)
    yield slopes, np.full((3, SLOPES), terms)
    yield boundary_error(0.5, 3.0, 1.2, 4.0, 40), np.array([1.2**2 * 3.5])


def save_small_results(path):
    """Write the numbers of `small_results`, for the other way of running them to compare."""
    with np.errstate(all="ignore"):
        np.savez(path, *(values for values, _ in small_results()))


def test_compiled_and_interpreted_agree(tmp_path):
    """To roundings of the amplitude, not to the bit: compiled, a product and a sum may be rounded once, not twice.

    Measured: below 7, of a shot of some ten steps.
    """
    path = tmp_path / "other.npz"
    environment = os.environ | {"NUMBA_DISABLE_JIT": "0" if INTERPRETED else "1"}
    code = f"import test_interpreted; test_interpreted.save_small_results({str(path)!r})"
    subprocess.run([sys.executable, "-c", code], env=environment, cwd=Path(__file__).parent, check=True)
    with np.load(path) as other:
        for k, (values, amplitude) in enumerate(small_results()):
            assert (np.abs(values - other[f"arr_{k}"]) <= 16 * EPS * np.abs(amplitude)).all(), k
