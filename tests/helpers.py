"""Shots for tests: the kernels' arrays allocated, one call, named results."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from towatlas.kernels.lanes import END_COLUMNS, FOLD_COLUMNS, march
from towatlas.kernels.scan import forward_shots
from towatlas.kernels.sweeps import march_parallel
from towatlas.limits import threshold_length


@dataclass
class Ends:
    tau: np.ndarray
    f: np.ndarray
    p: np.ndarray
    z: np.ndarray
    v: np.ndarray
    q: np.ndarray
    folds: np.ndarray
    count: np.ndarray
    status: np.ndarray


def shoot(a, mu, tau_end, first_fold=1, last_fold=0, *, max_steps=10**7, parallel=False) -> Ends:
    """March fish-up shots; folds has shape (shots, last_fold - first_fold + 1, 4)."""
    a, mu, tau_end = (np.array(x, float).ravel() for x in np.broadcast_arrays(a, mu, tau_end))
    rows = len(a)
    ends = np.full((rows, END_COLUMNS), np.nan)
    folds = np.full((rows, max(1, last_fold - first_fold + 1), FOLD_COLUMNS), np.nan)
    count = np.zeros(rows, np.int64)
    status = np.full(rows, -1, np.int64)
    orders = np.full(rows, first_fold), np.full(rows, last_fold)
    arguments: tuple[Any, ...] = (a, mu, tau_end, *orders, max_steps, ends, folds, count, status)
    if parallel:
        march_parallel(*arguments)
    else:
        march(*arguments, 0, rows)
    return Ends(*ends.T, folds=folds, count=count, status=status)


def boundary_error(w_f, lam, gamma, r_x0, segments=100) -> np.ndarray:
    """E of forward shots."""
    w_f, lam, gamma, r_x0 = (np.array(x, float).ravel() for x in np.broadcast_arrays(w_f, lam, gamma, r_x0))
    errors, x, force = (np.empty(len(w_f)) for _ in range(3))
    forward_shots(w_f, lam, gamma, r_x0, segments, errors, x, force, 0, len(w_f))
    return errors


def random_cables(rows, seed, n_max=6, excess=(1e-3, 1e3), w_f_max=1e4):
    """Random n, w_f (a tenth of them zero), lam over the domain of the atlas, uniform in the logarithms."""
    rng = np.random.default_rng(seed)
    n = rng.integers(1, n_max + 1, rows)
    w_f = np.where(rng.random(rows) < 0.1, 0.0, 10.0 ** rng.uniform(-5, np.log10(w_f_max), rows))
    excess = 10.0 ** rng.uniform(*np.log10(excess), rows)
    return n, w_f, threshold_length(w_f, n) + excess
