"""Compiled mathematics of a cable towed in a circle: numpy and numba, floats and status codes, nothing else.

Importing this package is cheap; the modules below it import numba.
"""
