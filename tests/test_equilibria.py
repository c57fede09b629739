"""All equilibria of one cable: complete, accurate, the roots of the report among them."""

import json

import numpy as np
import pytest
from helpers import boundary_error, random_cables, run
from hypothesis import given
from hypothesis import strategies as st

import towatlas
from towatlas.kernels import status
from towatlas.limits import excess_length
from towatlas.solve.members import shoot_lanes, shoot_singly, solve_members


def random_systems(rows, seed):
    rng = np.random.default_rng(seed)
    w_f = np.where(rng.random(rows) < 0.15, 0.0, 10 ** rng.uniform(-3, 3.5, rows))
    return w_f, 10 ** rng.uniform(0.05, 1.8, rows), 10 ** rng.uniform(-1.2, 1.0, rows)


def expected_number(w_f, lam, gamma):
    """1 + 2 #{n : gamma > gamma_cn}, by the direct solver of folds."""
    number = np.ones(len(lam), int)
    n = 1
    while (exists := excess_length(lam, w_f, n) > 0).any():
        states = towatlas.solve_critical(lam[exists], w_f[exists], n)
        number[exists] += 2 * (gamma[exists] > states.gamma)
        n += 1
    return number


def test_count_identity():
    """Found by counting zeros of q, their number is the one that the critical speeds say: 600 random cables."""
    w_f, lam, gamma = random_systems(600, 11)
    found = [towatlas.equilibria(*system) for system in zip(lam, w_f, gamma, strict=True)]
    expected = expected_number(w_f, lam, gamma)
    np.testing.assert_array_equal([len(e) for e in found], expected)
    assert expected.max() > 15
    assert (expected == 1).sum() > 20
    for e in found:
        assert (np.diff(e.R_x0) > 0).all()
        # The median root, expected, is the inner member of the last pair, the fish nearest to the axis.
        assert e.expected == len(e) // 2
        assert e.nodes[e.expected] == e.nodes.max()
        assert e.r_f[e.expected] == e.r_f.min()
        last = e.nodes.max()
        assert e.branch[e.expected] == (f"{last} inner" if last else "outward")
        assert sorted(e.branch) == sorted(
            ["outward"] + [f"{n} {member}" for n in range(1, last + 1) for member in ("inner", "outer")]
        )
        # Nodes come in pairs: 0, then two shapes for each number up to the highest.
        assert sorted(e.nodes) == sorted([0, *np.repeat(np.arange(1, len(e) // 2 + 1), 2)])
        assert e.nodes[-1] == 0
        assert (np.abs(e.x_f) <= 1 + e.system.lam).all()
        # Near a fold x_f is a root of a function with hardly a slope: a few of these 2452 lie there.
        assert (e.error < 1e-10).all()
    assert np.median(np.concatenate([e.error for e in found])) < 1e-14


@pytest.mark.parametrize(
    ("lam", "w_f", "gamma", "root", "nodes"),
    [
        (37.8, 1352, 1.64, 5.5436291, 1),
        (37.8, 1352, 2.97, 552.2654082, 1),
        (37.8, 1352, 5.94, 534.2432718, 2),
        (2.0, 0, 1.0, 3.8194580, 0),
    ],
)
def test_roots_of_the_report(lam, w_f, gamma, root, nodes):
    e = towatlas.equilibria(lam, w_f, gamma)
    assert float(e.R_x0[e.expected]) == pytest.approx(root, abs=6e-8)
    assert e.nodes[e.expected] == nodes


def test_crowded_roots():
    """Three of five roots in 0.3 % of the bounds of Eq. (35)."""
    e = towatlas.equilibria(37.8, 1352, 5.94)
    assert len(e) == 5
    assert list(e.nodes) == [1, 2, 2, 1, 0]
    bounds = 2 * 5.94**2 * (37.8**2 / 2 + 1352 * 37.8)
    assert np.ptp(e.R_x0[1:4]) < 0.0035 * bounds


@pytest.mark.parametrize(("lam", "w_f", "n"), [(10.0, 0.0, 1), (10.0, 1.0, 2), (37.8, 1352.0, 2), (6.0, 50.0, 1)])
def test_within_1e9_of_a_fold(lam, w_f, n):
    fold = towatlas.solve_critical(lam, w_f, n)
    below = towatlas.equilibria(lam, w_f, float(fold.gamma) * (1 - 1e-9))
    above = towatlas.equilibria(lam, w_f, float(fold.gamma) * (1 + 1e-9))
    assert (len(below), len(above)) == (2 * n - 1, 2 * n + 1)
    pair = above.R_x0[n - 1 : n + 1]
    assert pair == pytest.approx(float(fold.R_x0), rel=0.01)
    assert above.R_x0[n - 1] < float(fold.R_x0) < above.R_x0[n]


@pytest.mark.parametrize("distance", [0.5, 1e-2, 1e-4, 1e-7, 1e-9, 1e-11])
def test_both_members_appear_at_the_fold(distance):
    """On both sides of 600 folds, of slow cables and of those whose p(t_e; a) has peaks as sharp as a saw's teeth."""
    n, w_f, lam = random_cables(600, 5, n_max=12)
    fold = towatlas.solve_critical(lam, w_f, n)
    # Only folds known well enough to be told from the speed asked for.
    sure = (fold.status == status.OK) & (fold.gamma < 1e3) & (fold.error < distance / 10)
    n, w_f, lam, gamma = n[sure], w_f[sure], lam[sure], fold.gamma[sure]
    x_fold = np.abs(fold.x_f[sure])
    inner = np.zeros(len(n), bool)
    passed = {
        outer: solve_members(
            w_f=w_f, lam=lam, gamma=gamma * (1 + distance), n=n, outer=inner | outer, shoot=shoot_lanes
        )
        for outer in (0, 1)
    }
    for outer in (0, 1):
        short = solve_members(
            w_f=w_f, lam=lam, gamma=gamma * (1 - distance), n=n, outer=inner | outer, shoot=shoot_lanes
        )
        assert (short.status == status.NOT_FOUND).all()
        assert (passed[outer].status == status.OK).all()
    assert (np.abs(passed[0].x_f) < np.abs(passed[1].x_f)).all()
    if distance < 1e-3:
        between = np.sqrt(np.abs(passed[0].x_f * passed[1].x_f))
        # The pair parts with the root of the distance, the mean of its logarithms moves with the distance itself.
        np.testing.assert_allclose(between, x_fold, rtol=max(100 * distance, 1e-6))


def test_one_shot_or_lanes():
    """The kernel for one cable against that for many: two programs of the same series."""
    w_f, lam, gamma = random_systems(400, 3)
    rng = np.random.default_rng(4)
    a, mu, tau = gamma**2 * 10 ** rng.uniform(-4, 1, 400), gamma**2 * w_f, gamma**2 * lam
    one, count, codes = shoot_singly(a, mu, tau)
    many, counts, _ = shoot_lanes(a, mu, tau)
    assert (codes == status.OK).all()
    np.testing.assert_array_equal(count, counts)
    t, f, p = mu + tau, many[:, 1], many[:, 2]
    amplitude = np.hypot(p, f / np.sqrt(np.hypot(t, f)))
    # Rounding of the phase, for each half wave.
    assert (np.abs(one[:, 2] - p) < 1e-13 * (1 + counts) * amplitude).all()
    np.testing.assert_allclose(one[:, 3], many[:, 3], rtol=1e-12)


@pytest.mark.parametrize("shoot", [shoot_singly, shoot_lanes])
def test_a_bad_guess_costs_time_only(shoot):
    w_f, lam, gamma = (np.full(5, value) for value in (1352.0, 37.8, 5.94))
    n, outer = np.array([0, 1, 1, 2, 2]), np.array([False, False, True, False, True])
    plain = solve_members(w_f=w_f, lam=lam, gamma=gamma, n=n, outer=outer, shoot=shoot)
    for guess in (np.full(5, 1e-11), np.full(5, np.nan), np.full(5, -1.0), np.full(5, 1e30), plain.a[::-1], plain.a):
        again = solve_members(w_f=w_f, lam=lam, gamma=gamma, n=n, outer=outer, shoot=shoot, guess=guess)
        np.testing.assert_allclose(again.R_x0, plain.R_x0, rtol=1e-12)


def test_a_good_guess_takes_one_shot():
    """Where the way to the extremum is known, within a factor of two: the same equilibria, to their errors."""
    rng = np.random.default_rng(8)
    w_f, lam, gamma = 10 ** rng.uniform(-2, 3, 300), 10 ** rng.uniform(0, 1.5, 300), 10 ** rng.uniform(-1, 0.5, 300)
    cables = {"w_f": w_f, "lam": lam, "gamma": gamma, "n": np.zeros(300, int), "outer": np.zeros(300, bool)}
    calls = []

    def shoot(*shots):
        calls.append(len(shots[0]))
        return shoot_lanes(*shots)

    plain = solve_members(**cables, shoot=shoot_lanes)
    known = np.isfinite(plain.reach) & (plain.reach > 1e-2)
    assert known.mean() > 0.9
    guess = plain.a * (1 + 1e-9 * rng.uniform(-1, 1, 300))
    again = solve_members(**cables, shoot=shoot, guess=guess, reach=2.0 * plain.reach)
    assert calls[0] == 300
    assert sum(calls[1:]) <= (~known).sum() * (len(calls) - 1)
    assert (np.abs(again.x_f / plain.x_f - 1) <= again.error + plain.error).all()


def test_forward_shots_agree():
    """E of Skop's forward shot falls with the fourth power of the step at every root, to rounding."""
    e = towatlas.equilibria(12.0, 5.0, 1.8)
    coarse, fine = (np.abs(boundary_error(5.0, 12.0, 1.8, e.R_x0, k)) for k in (400, 1600))
    assert (fine < coarse / 100 + 1e-11).all()
    assert coarse.max() > 1e-9
    assert (np.abs(e.boundary_error) < 1e-9).all()


@pytest.mark.parametrize("system", [(3.0, 0.0, 2.0), (37.8, 1352.0, 5.94), (20.0, 0.5, 1.0), (5.0, 1e4, 30.0)])
def test_root_against_34_digits(system):
    """R_x0 to 1e-12: the shot from x_f in 34 digits, corrected to the exact root by one Newton step."""
    import mpmath as mp
    import reference

    lam, w_f, gamma = system
    e = towatlas.equilibria(*system)
    with mp.workdps(34):
        gamma2 = mp.mpf(gamma) ** 2
        for x_f, r_x0, error in zip(e.x_f, e.R_x0, e.error, strict=True):
            sign = 1 if x_f > 0 else -1
            a = abs(mp.mpf(x_f)) * gamma2
            for _ in range(3):
                end = reference.shot(a, gamma2 * mp.mpf(w_f), gamma2 * mp.mpf(lam))
                level = gamma2 if end.p > 0 else -gamma2
                a -= (end.p - level) / end.q
            exact_sign = 1 if level > 0 else -1
            exact = exact_sign * end.f / gamma2
            assert exact_sign == sign
            assert abs(r_x0 - exact) <= 1e-12 * max(abs(exact), abs(end.v * a) / gamma2 * mp.mpf(2) ** -50 * 1e12)
            assert abs(x_f - exact_sign * a / gamma2) <= min(1e-12, error) * abs(x_f)


@given(lam=st.floats(1e-3, 60), w_f=st.one_of(st.just(0.0), st.floats(1e-6, 1e4)), gamma=st.floats(0.01, 8))
def test_any_system(lam, w_f, gamma):
    e = towatlas.equilibria(lam, w_f, gamma)
    assert len(e) % 2 == 1
    assert len(e) == expected_number(np.array([w_f]), np.array([lam]), np.array([gamma]))[0]


@pytest.mark.parametrize(
    ("system", "match"),
    [
        ((np.nan, 0, 1), "lam must be finite"),
        ((0, 0, 1), "lam must be finite and positive"),
        ((3, -1, 1), "w_f = -1 is a fish lighter than the fluid, whose mass is its own: give m_f"),
        ((3, 0, 0), "gamma must not be zero: positive in a turn to starboard"),
        ((3, 0, np.inf), "gamma must be finite"),
        (([3, 4], 0, 1), "lam must be one number"),
        (("3", 0, 1), "lam must be a real number"),
    ],
)
def test_bad_input(system, match):
    with pytest.raises(ValueError, match=match):
        towatlas.equilibria(*system)


def test_overflow_is_said():
    with pytest.raises(ArithmeticError, match="overflows"):
        towatlas.equilibria(1.0, 1e300, 1e10)


@pytest.mark.parametrize("system", [(1e80, 1.0, 1e60), (3.0, 0.0, 1e8), (1e5, 0.0, 1e3)])
def test_what_would_take_minutes_is_refused(system):
    with pytest.raises(ArithmeticError, match=r"nodes, too many for 30 s of CPU: .* s or more; .* --patience SECONDS"):
        towatlas.equilibria(*system)


def test_fast_cable_with_few_equilibria():
    """11 000 extrema of p, two of them with equilibria: only what can exist is looked for."""
    e = towatlas.equilibria(3.0, 0.0, 1e4)
    assert list(e.nodes) == [1, 1, 0]


def test_shell(capsys):
    code, out, err = run(capsys, "equilibria", "--lam", 37.8, "--wf", 1352, "--gamma", 5.94, "--json")
    rows = json.loads(out)
    assert code == 0
    assert err == "" or "compiling, once" in err
    names = "R_x0 R_y0 R_z0 x_f y_f z_f r_f phase_deg tension error boundary_error"
    assert list(rows[0]) == ["schema_version", "branch", "nodes", "expected", "near_axis", *names.split()]
    assert [row["expected"] for row in rows] == [False, False, True, False, False]
    assert rows[2]["R_x0"] == pytest.approx(534.2432718, abs=6e-8)
    code, out, _ = run(capsys, "equilibria", "--lam", 37.8, "--wf", 1352, "--gamma", 5.94)
    assert code == 0
    assert len(out.splitlines()) == 6
    assert "expected" in out.splitlines()[3]
    assert run(capsys, "equilibria", "--lam", 3, "--wf", 0, "--gamma", 0)[0] == 2
