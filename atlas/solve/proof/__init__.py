"""Folds of the vacuum, proved: found in floats and integers, verified in balls of Arb (docs/certify.md)."""
