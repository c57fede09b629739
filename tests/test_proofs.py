"""docs/proofs.md attacked: every statement is minimised over all shots, and so is a stronger one, which has to fall.

A margin is positive where the statement holds, and scaled so that it does not vanish where the statement becomes an
equality in the limit of fast or of slow cables. The stronger statement shows that the search would find what is false.
"""

import mpmath as mp
import numpy as np
import pytest
import reference
from events import march
from helpers import shoot
from scipy.optimize import differential_evolution

import towatlas
from towatlas.limits import threshold_length, threshold_offset
from towatlas.solve.stability import index_of

ZEROS = 3
N = np.arange(1, ZEROS + 1)
SIGN = (-1.0) ** N
# log10 of a, and of mu; below the least mu there is no fish.
BOUNDS = ((-2.0, 5.0), (-5.0, 4.0))
NO_FISH = -4.5
# Whole generations at once.
BATCHES = {"vectorized": True, "updating": "deferred", "polish": False}


def excess(e, a, mu, kind="t", more=0.0):
    """Theorem 1: lambda - lambda_cn, which falls like 1/a."""
    g = np.abs(e[kind, "p"])
    paid = e[kind, "t"] - mu
    return (paid / g - (2 * N - 1 + more) - threshold_offset(mu / g)) * (1.0 + a)


def phase(e, a, mu, kind, zero, behind):
    """Theorem 3 at one kind of zero: the sign of another quantity, over its amplitude; like a^2 where a is small."""
    sign = -SIGN if zero in ("f", "v") else SIGN
    f, p, v, q, r = (e[kind, name] for name in "fpvqr")
    wave = {"p": np.hypot(p, f / np.sqrt(r)), "f": np.hypot(p * np.sqrt(r), f), "v": np.hypot(q * np.sqrt(r), v)}[zero]
    scale = (1.0 + a * a) / (a * a) if behind else 1.0
    return sign * e[kind, zero] / wave * scale


def cone(e, a, mu, ratio=1.0):
    """Lemma 4: tau dg > g dtau, an equality for fast cables without a fish; times mirrored, that dtau > 0."""
    t, p, v, q = (e["tau", name] for name in "tpvq")
    return np.minimum((t * p * q / (p * (-v / p)) / p - ratio) * (1.0 + a), -v / p / t * (1.0 + a * a) / a)


STATEMENTS = {
    "threshold": (lambda e, a, mu: excess(e, a, mu), lambda e, a, mu: excess(e, a, mu, more=0.01)),
    "threshold at f = 0": (
        lambda e, a, mu: excess(e, a, mu, "tau"),
        lambda e, a, mu: excess(e, a, mu, "tau", 0.01),
    ),
    "kappa < t": (
        lambda e, a, mu: phase(e, a, mu, "t", "p", True),
        lambda e, a, mu: phase(e, a, mu, "t", "p", False) - 0.01,
    ),
    "t < tau": (
        lambda e, a, mu: phase(e, a, mu, "t", "f", False),
        lambda e, a, mu: e["tau", "t"] / e["t", "t"] - 1.001,
    ),
    "tau < sigma": (
        lambda e, a, mu: phase(e, a, mu, "tau", "v", True),
        lambda e, a, mu: phase(e, a, mu, "tau", "v", False) - 0.01,
    ),
    "sigma < e": (
        lambda e, a, mu: -phase(e, a, mu, "e", "v", False),
        lambda e, a, mu: -phase(e, a, mu, "e", "v", False) - 0.7,
    ),
    "e < kappa": (
        lambda e, a, mu: (e["kappa", "t"][:, 1:] - e["e", "t"][:, :-1]) / (e["kappa", "t"][:, 1:] - mu),
        lambda e, a, mu: e["kappa", "t"][:, 1:] - 2.0 * e["e", "t"][:, :-1],
    ),
    "cone": (cone, lambda e, a, mu: cone(e, a, mu, 1.01)),
    "energy in a": (lambda e, a, mu: e.least["X"], lambda e, a, mu: e.least["X"] - 0.1),
    "N": (lambda e, a, mu: e.least["N"], lambda e, a, mu: e.least["N"] - 0.1),
    "I1": (
        lambda e, a, mu: e["sigma", "I1"] / e["tau", "I1"],
        lambda e, a, mu: e["sigma", "I1"] / e["tau", "I1"] - 0.5,
    ),
    "I1 grows": (
        lambda e, a, mu: np.diff(e["sigma", "I1"]) / e["sigma", "I1"][:, 1:],
        lambda e, a, mu: np.diff(e["tau", "I1"] - 2.0 * e["sigma", "I1"]),
    ),
    "I2 at folds": (lambda e, a, mu: e["t", "I2"], lambda e, a, mu: e["sigma", "I2"]),
    "I2 grows": (
        lambda e, a, mu: np.diff(e["t", "I2"]) / e["t", "I2"][:, 1:],
        lambda e, a, mu: np.diff(e["kappa", "I2"] - 2.0 * e["t", "I2"]) / e["t", "I2"][:, 1:],
    ),
    "amplitudes fall": (
        lambda e, a, mu: 1.0 - np.abs(e["tau", "p"][:, 1:] / e["tau", "p"][:, :-1]),
        lambda e, a, mu: np.abs(e["tau", "p"][:, 1:] / e["tau", "p"][:, :-1]) - 0.9,
    ),
    "waits": (
        lambda e, a, mu: np.diff(e["tau", "t"]) / (np.abs(e["tau", "p"])[:, 1:] + np.abs(e["tau", "p"])[:, :-1]) - 1.0,
        lambda e, a, mu: np.diff(e["tau", "t"]) / np.abs(e["tau", "p"])[:, 1:] - 2.001,
    ),
}  # fmt: skip


def margins(x):
    """Least margins of all statements, true and stronger, at points (log10 a, log10 mu): (statements, 2, points)."""
    a, mu = 10.0 ** x[0], np.where(x[1] < NO_FISH, 0.0, 10.0 ** x[1])
    e = march(a, mu, ZEROS)
    column = a[:, None], mu[:, None]
    return np.array(
        [[claim(e, *column).reshape(len(a), -1).min(axis=1) for claim in pair] for pair in STATEMENTS.values()]
    )


def within(x):
    low, high = np.array(BOUNDS).T[:, :, None]
    return np.clip(x, low, high)


@pytest.fixture(scope="module")
def searched():
    """Least margins after some generations of a search that goes on from the worst points of every statement."""
    rng = np.random.default_rng(0)
    low, high = np.array(BOUNDS).T[:, :, None]
    x = low + (high - low) * rng.random((2, 96))
    y = margins(x)
    for generation in range(4):
        worst = np.argsort(y.reshape(-1, y.shape[-1]), axis=1)[:, :1].ravel()
        parents = np.repeat(worst, 3)
        new = within(x[:, parents] + 0.5**generation * rng.normal(size=(2, len(parents))))
        x, y = np.concatenate([x, new], axis=1), np.concatenate([y, margins(new)], axis=2)
    return dict(zip(STATEMENTS, y.min(axis=2), strict=True))


@pytest.mark.parametrize("statement", STATEMENTS)
def test_no_shot_violates_it_and_one_violates_more(statement, searched):
    true, stronger = searched[statement]
    assert true > 0.0
    assert stronger < 0.0


@pytest.mark.slow
@pytest.mark.parametrize("statement", STATEMENTS)
def test_longer_attack(statement):
    k = list(STATEMENTS).index(statement)
    found = differential_evolution(lambda x: margins(x)[k, 0], BOUNDS, maxiter=12, popsize=12, seed=1, **BATCHES)
    assert found.fun > 0.0


@pytest.mark.slow
@pytest.mark.parametrize("share", [0, 0.3, 40])
def test_fast_cables_in_34_digits(share):
    """At a = 1e12 what vanishes like 1/a is far below rounding of doubles: Theorems 1 and 2, and t_n < tau_n."""
    with mp.workdps(34):
        a = mp.mpf(10) ** 12
        mu = share * a
        y = mp.sqrt(1 + 2 * mp.mpf(share))
        for n in (1, 2):
            paid = (1 + y + 2 * (n - 1) * y) * a
            for _ in range(8):
                end = reference.shot(a, mu, paid)
                step = end.q * end.r**3 / (end.t**2 * end.v)
                paid += step
                if abs(step) < mp.mpf(10) ** -12 * paid:
                    break
            end = reference.shot(a, mu, paid)
            g = abs(end.p)
            w = mu / g
            over = paid / g - (2 * n - 1) - (mp.sqrt(1 + w * w) - w)
            assert 0 < over * a < 1000
            assert (-1) ** n * end.f / end.t < 0
            assert abs(g / a / y - 1) < mp.mpf(10) ** -10


def test_folds_move_as_their_jacobian_says():
    """Theorem 4 against central differences, whose steps of 1e-4 leave 1e-7; and its sign, everywhere tried."""
    rng = np.random.default_rng(3)
    a, mu = 10 ** rng.uniform(-1, 2, 40), 10 ** rng.uniform(-2, 2, 40)
    e = march(a, mu, ZEROS)
    t, p, v, r = (e["t", name] for name in "tpvr")
    g = np.abs(p)
    formula = -3.0 * r**3 * e["t", "I1"] * e["t", "I2"] / (t**2 * np.abs(v) ** 3 * g**3)
    h = 1e-4

    def image(da, dmu):
        folds = shoot(a * (1 + da), mu * (1 + dmu), np.inf, 1, ZEROS).folds
        size = np.abs(folds[..., 2])
        return np.array([folds[..., 0] / size, (mu * (1 + dmu))[:, None] / size])

    along_a = (image(h, 0) - image(-h, 0)) / (2 * h * a[:, None])
    along_mu = (image(0, h) - image(0, -h)) / (2 * h * mu[:, None])
    terms = along_a[0] * along_mu[1], along_a[1] * along_mu[0]
    size = np.abs(terms[0]) + np.abs(terms[1])
    assert (np.abs(terms[0] - terms[1] - formula) <= 1e-6 * size).all()
    assert (formula < 0.0).all()
    assert not (np.abs(terms[0] - terms[1] - 1.01 * formula) <= 1e-6 * size).all()


def heights(mu, paid):
    """|M_n|, n to ZEROS, of each row's (mu, t_e - mu), nan where there is no such extremum: bisection."""
    low, high = np.full((len(mu), ZEROS), -8.0), np.full((len(mu), ZEROS), 8.0)
    rows, n = np.repeat(np.arange(len(mu)), ZEROS), np.tile(N, len(mu))
    for _ in range(56):
        middle = 0.5 * (low + high)
        before = shoot(10.0 ** middle.ravel(), mu[rows], paid[rows]).count >= n
        low = np.where(before.reshape(low.shape), middle, low)
        high = np.where(before.reshape(low.shape), high, middle)
    p = np.abs(shoot(10.0 ** low.ravel(), mu[rows], paid[rows]).p).reshape(low.shape)
    return np.where((low > -7.9) & (high < 7.9), p, np.nan)


def test_extrema_fall_with_their_number():
    """Theorem 6 (c): |M_n| > |M_n+1|, minimised over (mu, t_e); that the ratio is above 1.6 is false."""

    def margin(x):
        m = heights(10.0 ** x[0], 10.0 ** x[1])
        ratio = m[:, :-1] / m[:, 1:]
        return np.where(np.isnan(ratio), np.inf, ratio).min(axis=1)

    found = differential_evolution(margin, ((-3, 4), (1, 5)), maxiter=8, popsize=8, seed=2, **BATCHES)
    assert 1.0 < found.fun < 1.6


def test_number_of_equilibria_is_what_a_scan_finds():
    """Theorem 6 next to folds and away from them: as many crossings of |p| = G as it says, no other count is right."""
    a = 10.0 ** np.linspace(-3, 1.5, 40000)
    for n, w_f, over in ((1, 0.0, 0.3), (2, 0.7, 1.0), (3, 20.0, 4.0), (2, 0.01, 0.05)):
        lam = float(threshold_length(w_f, n)) + over
        critical = towatlas.solve_critical(lam, w_f, np.arange(1, n + 2)).gamma
        for near in (0.999, 1.001):
            gamma2 = (near * critical[n - 1]) ** 2
            p = np.abs(shoot(a * gamma2, gamma2 * w_f, gamma2 * lam).p) - gamma2
            crossings = np.count_nonzero(np.diff(np.sign(p)))
            assert crossings == 1 + 2 * np.count_nonzero(near * critical[n - 1] > critical)
            assert crossings == 2 * n + (1 if near > 1.0 else -1)


def negative(weight, mu, t):
    """Negative directions of int weight x'^2 - x^2 dt - mu x(mu)^2, zero at the end: pivots of linear elements."""
    h = np.diff(t)
    stiff = weight / h
    diagonal = np.concatenate([[0.0], stiff[:-1]]) + stiff - (np.concatenate([[0.0], h[:-1]]) + h) / 3.0
    diagonal[0] -= mu
    beside = -stiff[:-1] - h[:-1] / 6.0
    count, pivot = 0, diagonal[0]
    for k in range(len(diagonal)):
        count += pivot < 0.0
        if k + 1 < len(diagonal):
            pivot = diagonal[k + 1] - beside[k] ** 2 / pivot
    return count


@pytest.mark.parametrize("cable", [(5.0, 0.5, 2.0), (9.0, 0.0, 1.6), (12.0, 30.0, 3.0), (2.1, 0.0, 5.73)])
def test_index_of_the_energy(cable):
    """Theorem 7 against finite elements on the second variation, which know nothing of q."""
    lam, w_f, gamma = cable
    found = towatlas.equilibria(*cable)
    assert len(found) > 1
    mu = w_f * gamma**2
    for branch, x_f in zip(found.branch, found.x_f, strict=True):
        a = abs(x_f) * gamma**2
        paid = np.linspace(0.0, np.sqrt(lam * gamma**2), 20001) ** 2
        middle = 0.5 * (paid[1:] + paid[:-1])
        t = mu + middle
        f = shoot(a, mu, middle).f
        r = np.hypot(t, f)
        counts = negative(r**3 / t**2, mu, paid), negative(r, mu, paid)
        assert sum(counts) == index_of(str(branch)), branch
