"""Guesses of a table of folds from a few of them."""

import numpy as np
import pytest
from helpers import random_cables

import towatlas.solve.fold_seeds
from towatlas.kernels import status
from towatlas.kernels.sweeps import limited_threads
from towatlas.limits import excess_length
from towatlas.solve.critical import solve_rows


def _curve(rows=400):
    n, w_f, lam = np.full(rows, 2), np.full(rows, 20.0), np.geomspace(8.0, 80.0, rows)
    return n, w_f, lam, excess_length(lam, w_f, n)


def test_seeds_are_near_and_their_slopes_true():
    """On a curve the guess is within 1e-5 of the solution, and the slopes are those of solutions nearby."""
    n, w_f, lam, excess = _curve()
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
        assert slopes[:, column] == pytest.approx(d_a, abs=2e-3)
        assert slopes[:, 2 + column] == pytest.approx(d_gamma, abs=2e-3)


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
        return 10.0 ** rng.uniform(-2, 4, len(n)), 10.0 ** rng.uniform(-2, 3, len(n)), rng.normal(size=(len(n), 4))

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
