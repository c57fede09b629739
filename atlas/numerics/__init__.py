"""Numerical methods that know nothing of cables."""
