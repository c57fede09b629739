"""Roots of forward shots, for tests."""

from helpers import boundary_error


def root_near(w_f, lam, gamma, guess, segments=100):
    """Root of E(R_x0) near a guess, by secants."""
    low, high = guess * (1 - 1e-7), guess * (1 + 1e-7)
    e_low, e_high = boundary_error(w_f, lam, gamma, [low, high], segments)
    for _ in range(20):
        if e_high == e_low or abs(high - low) < 1e-15 * abs(high):
            break
        low, high = high, high - e_high * (high - low) / (e_high - e_low)
        e_low, e_high = e_high, boundary_error(w_f, lam, gamma, high, segments)[0]
    return high
