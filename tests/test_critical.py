"""Direct critical speeds: known values, closed forms and limits, the count identity, mpmath."""

import math

import mpmath as mp
import numpy as np
import pytest
import reference
from helpers import random_cables, shoot
from hypothesis import example, given
from hypothesis import strategies as st

import towatlas
from towatlas.kernels import status
from towatlas.limits import excess_length, long_cable, massless_cable, threshold_length, threshold_offset

KNOWN = [
    (10, 0, 1, 0.4928896763325),
    (10, 1, 1, 0.466173258416),
    (3, 1, 1, 1.224029407727),
    (40, 1, 1, 0.205622754806),
    (2.1, 0, 1, 5.719746),
    (37.8, 1352, 2, 3.417567),
    (10, 0, 2, 1.401272),
]


@pytest.mark.parametrize(("lam", "w_f", "n", "gamma"), KNOWN)
def test_known_values(lam, w_f, n, gamma):
    digits = len(str(gamma).split(".")[1])
    assert float(towatlas.solve_critical(lam, w_f, n).gamma) == pytest.approx(gamma, abs=0.6 * 10.0**-digits)


@pytest.mark.slow
def test_error_against_mpmath():
    """The error estimate holds against one Newton step in 34 digits, over the domain and at its edges."""
    cables = [
        (1, 0.0, 2.001), (6, 0.0, 12.001), (3, 1e4, 5.2), (1, 1e4, 1000.0), (6, 1e-4, 30.0), (2, 1352.0, 37.8),
        (4, 5.0, 9.0), (6, 3000.0, 25.0), (9, 0.3, 40.0), (3, 0.0, 1e5), (1, 10.0, 1e5),
    ]  # fmt: skip
    for n, w_f, lam in cables:
        state = towatlas.solve_critical(lam, w_f, n)
        a = abs(float(state.x_f)) * float(state.gamma) ** 2
        _, error = reference.fold_error(n, w_f, lam, a, float(state.gamma))
        assert error <= float(state.error), (n, w_f, lam)
        # 1e-12, or what rounding of lambda leaves of lambda - lambda_cn.
        assert error <= 1e-12 + 4 * np.spacing(lam) / float(excess_length(lam, w_f, n)), (n, w_f, lam)


def test_guess_converges_everywhere():
    """The built-in guess leads to a solution for every cable of the domain and for n far beyond it."""
    for n_max, rows, seed in ((6, 20000, 1), (200, 2000, 2)):
        n, w_f, lam = random_cables(rows, seed, n_max)
        states = towatlas.solve_critical(lam, w_f, n)
        assert set(states.status) == {status.OK}
        # That of lambda, and of the wave, whose amplitude may outgrow p.
        gamma2 = states.gamma**2
        amplitude = np.hypot(1.0, states.R_x0 / np.sqrt(np.hypot(w_f + lam, states.R_x0) * gamma2))
        rounding = (64 if n_max <= 6 else 400) * (1 + lam / excess_length(lam, w_f, n)) + 8 * amplitude
        assert (states.error <= np.finfo(float).eps * rounding).all()


def test_guess_does_not_matter():
    """From wrong guesses (factors up to 3) the solver finds the same fold, because the shot counts its zeros."""
    from towatlas.solve.critical import solve_rows

    n, w_f, lam = random_cables(2000, 7)
    excess = excess_length(lam, w_f, n)
    right = solve_rows(n=n, w_f=w_f, lam=lam, excess=excess)
    rng = np.random.default_rng(0)
    a, gamma = np.abs(right["x_f"]) * right["gamma"] ** 2, right["gamma"]
    wrong = solve_rows(
        n=n,
        w_f=w_f,
        lam=lam,
        excess=excess,
        guess=(a * 3 ** rng.uniform(-1, 1, 2000), gamma * 3 ** rng.uniform(-1, 1, 2000)),
    )
    assert set(wrong["status"]) == {status.OK}
    assert (np.abs(wrong["gamma"] / gamma - 1) <= wrong["error"] + right["error"]).all()


def test_map_from_shots_to_cables_is_one_to_one():
    """The Jacobian of (log a, log mu) -> (log(lambda - lambda_cn), log w_f) never changes sign, for each n.

    That is what makes gamma_cn(lambda, w_f) single-valued.
    """
    log_a, log_mu = np.meshgrid(np.linspace(-2, 5, 141), np.linspace(-6, 5, 151), indexing="ij")
    h = 1e-4

    def image(da, dmu):
        mu = np.exp(log_mu * math.log(10) + dmu)
        folds = shoot(np.exp(log_a * math.log(10) + da).ravel(), mu.ravel(), math.inf, 1, 6, parallel=True).folds
        p = np.abs(folds[..., 2])
        n = np.arange(1, 7)
        w_f = mu.ravel()[:, None] / p
        return np.log(excess_length(folds[..., 0] / p, w_f, n)), np.log(w_f)

    along_a = [(x - y) / (2 * h) for x, y in zip(image(h, 0), image(-h, 0), strict=True)]
    along_mu = [(x - y) / (2 * h) for x, y in zip(image(0, h), image(0, -h), strict=True)]
    jacobian = along_a[0] * along_mu[1] - along_a[1] * along_mu[0]
    size = np.abs(along_a[0] * along_mu[1]) + np.abs(along_a[1] * along_mu[0])
    # Where the excess length is below 1e-8 of the length, its differences are rounding noise.
    p_excess = np.exp(image(0, 0)[0])
    clear = p_excess > 1e-7
    assert clear.mean() > 0.8
    assert (jacobian[clear] < -1e-4 * size[clear]).all()


@pytest.mark.parametrize("n", [1, 2, 4, 6])
@pytest.mark.parametrize("w_f", [0.0, 0.5, 30.0, 1e4])
def test_threshold_is_approached_as_an_inverse_square_root(n, w_f):
    """gamma_cn sqrt(lambda - lambda_cn) -> K_n(w_f), at the lambda_cn of the closed form and no other."""
    # The shorter the radius of the last turn, the fish's offset at the threshold, the nearer is near.
    excess = np.array([1e-4, 1e-3, 1e-2]) * float(threshold_offset(w_f))
    from towatlas.solve.critical import solve_rows

    ones = np.ones(3)
    states = solve_rows(n=np.full(3, n), w_f=w_f * ones, lam=threshold_length(w_f, n) + excess, excess=excess)
    k = states["gamma"] * np.sqrt(excess)
    assert k == pytest.approx(k[0], rel=0.05)
    # The nearer, the straighter; an error d of lambda_cn would change k by d / (2 excess), most of all at the nearest.
    assert abs(k[0] / k[1] - 1) < abs(k[1] / k[2] - 1) + states["error"].sum()


def test_ever_closer_to_the_threshold():
    """Down to where rounding of lambda leaves four digits there is an answer as good as estimated; then a reason."""
    rng = np.random.default_rng(0)
    rows = 4000
    n, excess = rng.integers(1, 9, rows), 10 ** rng.uniform(-16, -3, rows)
    w_f = np.where(rng.random(rows) < 0.2, 0.0, 10 ** rng.uniform(-6, 4, rows))
    lam = threshold_length(w_f, n) + excess
    states = towatlas.solve_critical(lam, w_f, n)
    assert set(states.status) == {status.OK, status.NO_TRANSITION, status.LOST_IN_ROUNDING}
    solved = states.status == status.OK
    assert (solved | (excess < 2e-10 * lam)).all()
    assert states.error[solved].max() < 2e-4
    # gamma sqrt(excess) is nearly constant there: its scatter between neighbours is the error.
    nearby = towatlas.solve_critical(lam[solved] * (1 + 4e-16), w_f[solved], n[solved])
    change = nearby.gamma * np.sqrt(excess_length(nearby.lam, nearby.w_f, nearby.n))
    change /= states.gamma[solved] * np.sqrt(excess_length(lam, w_f, n)[solved])
    assert (np.abs(change - 1) <= states.error[solved] + nearby.error).all()


@pytest.mark.parametrize("n", [1, 2, 3])
@pytest.mark.parametrize("w_f", [0.0, 0.1, 10.0])
def test_no_transition_at_or_below_the_threshold(n, w_f):
    threshold = float(threshold_length(w_f, n))
    states = towatlas.solve_critical([threshold * 0.999, np.nextafter(threshold, 0), threshold * 1.001], w_f, n)
    assert list(states.status[[0, 2]]) == [status.NO_TRANSITION, status.OK]
    assert states.status[1] in (status.NO_TRANSITION, status.LOST_IN_ROUNDING)
    assert np.isnan(states.gamma[:2]).all()


def test_threshold_has_no_cancellation():
    with mp.workdps(40):
        for w_f in (0.0, 1e-9, 0.3, 1e4, 1e9, 1e16):
            exact = 1 - mp.mpf(w_f) + mp.sqrt(1 + mp.mpf(w_f) ** 2) + 4
            assert float(threshold_length(w_f, 3)) == pytest.approx(float(exact), rel=2e-16)
            left = excess_length(6.5, w_f, 3)
            assert float(left) == pytest.approx(float(mp.mpf(6.5) - exact), rel=1e-15)


@pytest.mark.parametrize("n", [1, 2, 6])
def test_long_cable_without_a_fish(n):
    """gamma^2 lambda -> j_{0,n}^2 / 4, with a correction of order lambda^(-2/3)."""
    exact = float(mp.besseljzero(0, n) ** 2 / 4)
    assert float(long_cable(n)) == pytest.approx(exact, rel=1e-14)
    lam = np.array([1e6, 8e6])
    correction = towatlas.solve_critical(lam, 0.0, n).gamma ** 2 * lam / exact - 1
    assert 0 < correction[1] < 0.05
    assert correction[0] / correction[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(("n", "m"), [(1, 0.2), (2, 0.2), (1, 5.0), (3, 5.0)])
def test_long_cable_with_a_heavy_fish(n, m):
    """For w_f = m lambda, gamma^2 lambda -> z_n, root n of a cross product of Bessel functions."""

    def cross(z):
        outer, inner = 2 * mp.sqrt(z * (1 + m)), 2 * mp.sqrt(z * m)
        return mp.besselj(0, outer) * mp.bessely(2, inner) - mp.bessely(0, outer) * mp.besselj(2, inner)

    lam = np.array([1e6, 8e6])
    value = towatlas.solve_critical(lam, m * lam, n).gamma ** 2 * lam
    exact = float(mp.findroot(cross, value[1] * (1 - 1e-4)))
    correction = value / exact - 1
    assert abs(correction[1]) < 0.01
    assert correction[0] / correction[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("lam", [1.3, 5.0, 200.0])
def test_massless_cable(lam):
    """w_f -> infinity: gamma_c1 -> (lambda^(2/3) - 1)^(-3/4), the error falling as lambda / w_f."""
    gamma = towatlas.solve_critical(lam, np.array([1e5, 1e6, 1e8]), 1).gamma
    miss = np.abs(gamma / massless_cable(lam) - 1)
    assert miss[2] < 1e-7 * lam
    assert miss[0] / miss[1] == pytest.approx(10, rel=0.1)


def test_weightless_fish_is_the_limit():
    gamma = towatlas.solve_critical(10.0, [0.0, 1e-300, 1e-14, 1e-10, 1e-6], 2).gamma
    assert gamma[1:4] == pytest.approx(gamma[0], rel=1e-9)
    assert gamma[4] == pytest.approx(gamma[0], rel=1e-5)
    assert gamma[0] == gamma[1]


def test_state_solves_the_forward_problem():
    """R_x0, x_f and z_f of the table, put into Skop's forward problem: E = 0 and the fish where it should be."""
    from helpers import boundary_error

    n, w_f, lam = 2, 20.0, 12.0
    state = towatlas.solve_critical(lam, w_f, n)
    e = [boundary_error(w_f, lam, float(state.gamma), float(state.R_x0), k)[0] for k in (500, 1000, 2000)]
    scale = float(state.gamma) ** 2 * lam**2
    assert abs(e[2]) < 1e-9 * scale
    assert abs(e[0]) > abs(e[1]) > abs(e[2])
    assert float(state.tension) == pytest.approx(math.hypot(w_f + lam, float(state.R_x0)), rel=1e-15)
    assert 0 < float(state.z_f) < lam


@example(lam=60023.0, w_f=164572.0, n=40)
@given(lam=st.floats(1e-3, 1e6), w_f=st.floats(0, 1e8), n=st.integers(1, 40))
def test_any_cable_gets_a_state_or_a_reason(lam, w_f, n):
    state = towatlas.solve_critical(lam, w_f, n)
    if state.status == status.OK:
        assert state.gamma > 0
        assert state.R_x0 < 0
        assert (state.x_f > 0) == (n % 2 == 0)
    else:
        assert state.status in (status.NO_TRANSITION, status.LOST_IN_ROUNDING)
        assert np.isnan(state.gamma)
        assert lam <= threshold_length(w_f, n) * (1 + 1e-14)


@pytest.mark.parametrize(
    ("lam", "w_f", "n", "match"),
    [
        (np.nan, 0, 1, "lam must be finite"),
        (np.inf, 0, 1, "lam must be finite"),
        (0.0, 0, 1, "lam must be finite and positive"),
        (-2.0, 0, 1, "lam must be finite and positive"),
        (3.0, -1e-9, 1, "w_f must be finite and not negative"),
        (3.0, np.nan, 1, "w_f must be"),
        (None, 0, 1, "lam must be a real number"),
        ("3", 0, 1, "lam must be a real number"),
        (3 + 1j, 0, 1, "lam must be a real number"),
        (3.0, True, 1, "w_f must be a real number"),
        (3.0, 0, 0, "n counts the transitions"),
        (3.0, 0, 1.5, "n counts the transitions"),
        (3.0, 0, np.nan, "n counts the transitions"),
        ([[3.0], [4.0, 5.0]], 0, 1, "lam must be"),
        ([3.0, 4.0], [0.0, 1.0, 2.0], 1, "do not broadcast"),
    ],
)
def test_bad_input(lam, w_f, n, match):
    with pytest.raises(ValueError, match=match):
        towatlas.solve_critical(lam, w_f, n)


def test_types_and_shapes():
    expected = towatlas.solve_critical(10.0, 1.0, 1).gamma
    assert towatlas.solve_critical(np.int32(10), 1, np.int8(1)).gamma == expected
    assert towatlas.solve_critical(np.float32(10), np.float32(1), 1.0).gamma == expected
    assert towatlas.solve_critical([[10.0], [10.0]], [1.0, 1.0, 1.0], 1).gamma.shape == (2, 3)
    assert towatlas.solve_critical([], 1.0, 1).gamma.shape == (0,)


@pytest.mark.parametrize(
    ("function", "arguments", "match"),
    [
        (towatlas.threshold_length, (-3,), "w_f must be finite and not negative"),
        (towatlas.threshold_length, ("10",), "w_f must be a real number"),
        (towatlas.threshold_length, (1, 0), "n counts the transitions"),
        (towatlas.excess_length, (0, 1), "lam must be finite and positive"),
        (towatlas.excess_length, ([1, 2], [1, 2, 3]), "do not broadcast"),
    ],
)
def test_bad_input_of_closed_forms(function, arguments, match):
    with pytest.raises(ValueError, match=match):
        function(*arguments)


def test_a_solver_that_loses_its_way_does_not_blame_the_input():
    """Fish ten times heavier than the atlas holds, within 1e-9 of the threshold: solved, or not converged."""
    n, w_f = np.array([6, 2, 4]), np.array([86583.0, 93251.2, 78199.1])
    states = towatlas.solve_critical(threshold_length(w_f, n) + np.array([1.8e-9, 2.2e-10, 5.5e-10]), w_f, n)
    assert set(states.status) <= {status.OK, status.NOT_CONVERGED, status.LOST_IN_ROUNDING}
    assert (np.isnan(states.gamma) == (states.status != status.OK)).all()
