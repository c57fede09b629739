"""Guesses of a table of folds from a few of them."""

import numpy as np
import pytest
from helpers import random_cables, shoot

import towatlas
import towatlas.solve.fold_seeds
from benchmarks.samples import fold_reference
from towatlas.builders.fold_series import GRAIN, TERMS, shortened
from towatlas.builders.grids import Grid
from towatlas.kernels import status
from towatlas.kernels.compiling import opened
from towatlas.kernels.folds import CAUTION, ROUNDINGS, _gamma_slopes
from towatlas.kernels.sweeps import limited_threads
from towatlas.limits import excess_length, unchecked_threshold_length
from towatlas.numerics import chebyshev
from towatlas.solve.critical import solve_rows
from towatlas.tables.critical import FIELDS, CriticalAxes, to_field

EPS = np.finfo(float).eps
QUANTITIES = ("gamma", "R_x0", "x_f", "z_f")


def _curve(rows=400, fish=20.0):
    n, w_f, lam = np.full(rows, 2), np.full(rows, fish), np.geomspace(8.0, 80.0, rows)
    return n, w_f, lam, excess_length(lam, w_f, n)


def _from_cold(**cables):
    nothing = np.zeros(len(cables["n"]))
    return solve_rows(**cables, guess=(nothing, nothing))


def test_series_of_the_package_are_those_of_the_atlas():
    """Nodes of the default atlas solved from cold, without these series; to the grain and to the rounding of folds."""
    grid = Grid()
    axes = CriticalAxes.over(grid.excess_min, grid.excess_max, grid.w_f_max)
    x, y = chebyshev.nodes(grid.series_excess), chebyshev.nodes(grid.series_w_f)
    w_f, excess = (g.ravel() for g in np.meshgrid(axes.w_f.value(y), axes.excess.value(x), indexing="ij"))
    with np.load(towatlas.solve.fold_seeds.SERIES) as file:
        assert list(file["n"]) == list(range(1, grid.n_max + 1))
        assert list(file["excess"]) == [grid.excess_min, grid.excess_max]
        assert list(file["w_f"]) == [0.0, grid.w_f_max]
        for n in (1, grid.n_max):
            lam = unchecked_threshold_length(w_f, n) + excess
            nodes = _from_cold(lam=lam, w_f=w_f, n=np.full(len(w_f), n), excess=excess)
            fields = {name: to_field(name, nodes[name], excess).reshape(1, len(y), len(x)) for name in FIELDS}
            made = shortened({name: chebyshev.coefficients(field) for name, field in fields.items()})[0]
            assert made.shape == (4, *TERMS)
            assert np.abs(made - file[f"series_{n}"]).max() <= GRAIN


def test_one_shot_is_enough_in_all_the_domain():
    """What guesses and slopes of the package miss, by random cables, is what one correction leaves rounding of."""
    n, w_f, lam = random_cables(12000, 5)
    n[:20] = 7  # not held
    excess = excess_length(lam, w_f, n)
    a, gamma, slopes = towatlas.solve.fold_seeds.seed(n=n, w_f=w_f, lam=lam, excess=excess, solve=solve_rows)
    seeded = n < 7
    assert (gamma > 0).tolist() == seeded.tolist()
    cold = _from_cold(n=n, w_f=w_f, lam=lam, excess=excess)
    offset = np.abs(cold["x_f"]) * cold["gamma"] ** 2
    miss = np.abs([gamma / cold["gamma"] - 1, a / offset - 1]).max(axis=0)
    assert miss[seeded].max() < 2e-8
    gamma_slopes = opened(_gamma_slopes)
    # Slopes of gamma from the Wronskian of a shot, exact, against derivatives of the series.
    for order in (1, 3, 6):
        rows = np.flatnonzero(n == order)[:500]
        found = shoot(a[rows], w_f[rows] * gamma[rows] ** 2, np.inf, order, order)
        exact = [
            gamma_slopes(fold, v, *shot, order)
            for fold, v, *shot in zip(found.folds[:, 0], found.v, a[rows], w_f[rows] * gamma[rows] ** 2, strict=True)
        ]
        left = np.abs(exact - slopes[rows, 2:4]).max(axis=1)
        assert np.median(left) < 5e-9
        # Rounding of the exact ones, with a heavy fish next to the threshold.
        assert left.max() < 1e-5
        assert (CAUTION * left * miss[rows] < ROUNDINGS * EPS * (1 + lam / excess)[rows]).all()


def test_states_from_seeds_are_those_from_cold():
    """Every quantity within the errors stated; gamma of the reference, 34 digits, too."""
    exact = fold_reference()
    n, w_f, lam = (
        np.concatenate(pair) for pair in zip((exact.n, exact.w_f, exact.lam), random_cables(12000, 6), strict=True)
    )
    excess = excess_length(lam, w_f, n)
    table = towatlas.solve_critical(lam, w_f, n)
    cold = _from_cold(n=n, w_f=w_f, lam=lam, excess=excess)
    for name in QUANTITIES:
        assert (np.abs(getattr(table, name) / cold[name] - 1) <= table.error + cold["error"]).all(), name
    errors = exact.errors(table.gamma[: len(exact.n)])
    assert (errors <= table.error[: len(exact.n)]).all()
    assert np.median(errors) < 2 * EPS
    assert errors.max() < 4e-12
    # As small as they were.
    assert (table.error <= 1.25 * cold["error"]).all()


@pytest.mark.parametrize("fish", [20.0, 2e4])
def test_seeds_are_near_and_their_slopes_true(fish):
    """On a curve, in the domain of the package's series and beyond it."""
    n, w_f, lam, excess = _curve(fish=fish)
    a, gamma, slopes = towatlas.solve.fold_seeds.seed(n=n, w_f=w_f, lam=lam, excess=excess, solve=solve_rows)
    solved = solve_rows(n=n, w_f=w_f, lam=lam, excess=excess)
    offset = np.abs(solved["x_f"]) * solved["gamma"] ** 2
    assert np.abs(np.log(gamma / solved["gamma"])).max() < 1e-5
    assert np.abs(np.log(a / offset)).max() < 1e-5
    h = 1e-4
    for column, (scale_excess, scale_w_f) in enumerate([(np.exp(h), 1.0), (1.0, np.exp(h))]):
        near = excess * scale_excess, w_f * scale_w_f
        there = solve_rows(n=n, w_f=near[1], lam=lam - excess + near[0], excess=near[0])
        d_gamma = np.log(there["gamma"] / solved["gamma"]) / h
        d_a = np.log(np.abs(there["x_f"]) * there["gamma"] ** 2 / offset) / h
        others = (np.log(there[name] / solved[name]) / h for name in ("R_x0", "z_f"))
        for field, slope in enumerate((d_a, d_gamma, *others)):
            assert slopes[:, 2 * field + column] == pytest.approx(slope, abs=2e-3)


def test_a_row_with_a_seed_is_a_row_without():
    """Tables, solved with seeds, against every row by itself, solved from cold."""
    n, w_f, lam = random_cables(3000, 11)
    w_f[:700], n[:700] = 3.0, 1
    excess = excess_length(lam, w_f, n)
    table = solve_rows(n=n, w_f=w_f, lam=lam, excess=excess)
    few = slice(0, 3000, 75)
    alone = solve_rows(n=n[few], w_f=w_f[few], lam=lam[few], excess=excess[few])
    assert len(alone["gamma"]) < towatlas.solve.fold_seeds.FEWEST_ROWS
    both = table["status"][few] == alone["status"]
    assert both.all()
    close = np.abs(table["gamma"][few] / alone["gamma"] - 1) <= table["error"][few] + alone["error"]
    assert (close | (alone["status"] != status.OK)).all()


def test_a_misleading_seed_does_no_harm(monkeypatch):
    """Guesses hundreds of times off and slopes of nothing: the same folds."""
    n, w_f, lam, excess = _curve()
    right = solve_rows(n=n, w_f=w_f, lam=lam, excess=excess)

    def misled(*, n, **_):
        rng = np.random.default_rng(3)
        return 10.0 ** rng.uniform(-2, 4, len(n)), 10.0 ** rng.uniform(-2, 3, len(n)), rng.normal(size=(len(n), 8))

    monkeypatch.setattr("towatlas.solve.critical.seed", misled)
    wrong = solve_rows(n=n, w_f=w_f, lam=lam, excess=excess)
    found = wrong["status"] == status.OK
    assert found.mean() > 0.9
    assert set(wrong["status"]) <= {status.OK, status.NOT_CONVERGED}
    assert (np.abs(wrong["gamma"] / right["gamma"] - 1)[found] <= (wrong["error"] + right["error"])[found]).all()


def test_threads_do_not_matter():
    columns = dict(zip(("n", "w_f", "lam", "excess"), _curve(3000), strict=True))
    results = []
    for threads in (1, 2):
        with limited_threads(threads):
            results.append(solve_rows(**columns))
    for name, column in results[0].items():
        np.testing.assert_array_equal(column, results[1][name])
