"""Skop's method against the direct one, within what it says of its own resolution; and where it misses."""

import numpy as np
import pytest

import towatlas
from towatlas.kernels import status
from towatlas.kernels.calls import scan_system
from towatlas.limits import excess_length

N_MAX = 4


def scan(w_f, lam, gamma_max=20.0, speeds=240, guesses=1024, segments=100, n_max=N_MAX):
    results, statuses = np.empty((n_max, 4)), np.empty(n_max, np.int64)
    scan_system(lam, w_f, 0.95 / np.sqrt(lam), gamma_max, speeds, guesses, segments, n_max, 1e-9, results, statuses)
    return results, statuses


def direct(w_f, lam, n_max=N_MAX):
    return towatlas.solve_critical(lam, w_f, np.arange(1, n_max + 1))


CABLES = [
    (0.0, 2.1), (0.0, 4.4), (0.0, 10.0), (0.0, 60.0), (0.01, 7.0), (0.3, 3.0), (1.0, 25.0), (5.0, 9.0), (20.0, 50.0),
    (80.0, 4.0), (100.0, 30.0), (600.0, 2.5), (1352.0, 37.8), (1571.0, 52.4),
]  # fmt: skip


@pytest.mark.parametrize(("w_f", "lam"), CABLES)
def test_scan_and_direct_solution_agree(w_f, lam):
    """Each within the resolution the scan states; what is not found is beyond its highest speed, or crowded."""
    guesses = 4096 if w_f > 500 else 1024
    results, statuses = scan(w_f, lam, guesses=guesses)
    states = direct(w_f, lam)
    exists = states.gamma < 20.0
    np.testing.assert_array_equal(statuses == status.OK, exists)
    gamma, r_x0, gamma_resolution, r_x0_resolution = results[exists].T
    assert (np.abs(gamma - states.gamma[exists]) <= gamma_resolution).all()
    assert (np.abs(r_x0 - states.R_x0[exists]) <= r_x0_resolution).all()
    # And the resolution is one worth having.
    assert (gamma_resolution <= 1e-3 * gamma).all()
    assert set(statuses[~exists]) <= {status.NOT_FOUND}


def test_finer_segments_bring_the_scan_closer():
    exact = direct(0.0, 10.0, 2).gamma
    errors = [np.abs(scan(0.0, 10.0, segments=k, n_max=2)[0][:, 0] - exact).max() for k in (50, 100, 200)]
    assert errors[0] > 4 * errors[1] > 16 * errors[2]


def test_uniform_scan_misses_crowded_pairs():
    """Three inner roots in 0.3 % of the bounds of Eq. (35): 200 guesses do not see n = 3, and the status says so."""
    results, statuses = scan(1352.0, 37.8, guesses=200)
    states = direct(1352.0, 37.8)
    assert (states.gamma < 20.0).all()
    assert status.NOT_FOUND in statuses
    assert np.isnan(results[statuses == status.NOT_FOUND]).all()
    found = statuses == status.OK
    assert (np.abs(results[found, 0] / states.gamma[found] - 1) < 1e-6).all()


def test_beyond_the_highest_speed_is_not_found():
    _, statuses = scan(0.0, 4.1, gamma_max=2.0)
    assert list(statuses) == [status.OK] + 3 * [status.NOT_FOUND]
    assert excess_length(4.1, 0.0, 2) > 0


def test_speeds_rise_with_n_or_are_not_given():
    """On this cable the window of the fourth pair catches the second: the scan must not give its speed for it."""
    results, statuses = scan(316.22776601683796, 100.0, guesses=512)
    found = statuses == status.OK
    assert (np.diff(results[found, 0]) > 0).all()
    exact = direct(316.22776601683796, 100.0).gamma
    assert (np.abs(results[found, 0] - exact[found]) <= results[found, 2]).all()
