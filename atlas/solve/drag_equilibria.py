"""Equilibria of a cable towed through a fluid, found from the fish up with one unknown, the radius of the fish."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.kernels import status
from towatlas.kernels.system import LAM
from towatlas.numerics.rows import EPS
from towatlas.results import Equilibria
from towatlas.solve.looks import SLOPE
from towatlas.solve.search import FIRST_LOW, PREDICTED, Found, least_radius, search
from towatlas.solve.shots import Array, Ends, Integers, shoot
from towatlas.system import System

ROUNDINGS = 16.0
# Nearer to the axis than this, in tow radii, a fish is near it.
NEAR_AXIS = 0.5


def solve_drag_equilibria(system: System, gamma: float) -> Equilibria:
    """Equilibria with drag, found from the fish up; no checks.

    Parameters
    ----------
    system : System
    gamma : float
        Speed Omega sqrt(R/g) [-]; a turn to port where negative.

    Returns
    -------
    Equilibria

    Raises
    ------
    ArithmeticError
        If no shape is found.
    """
    row = system.row()[None]
    found = search(row, np.array([gamma]))
    if not len(found.x):
        code = int(found.status[0]) or status.NOT_CONVERGED
        raise ArithmeticError(f"{system}, gamma = {gamma:g}: {status.SENTENCES[code]}")
    columns = quantities(found.row, found.x, row, np.array([gamma]))
    order = np.argsort(columns["R_x0"])
    return Equilibria(
        **{name: column[order] for name, column in columns.items()},
        branch=np.array([f"shape {k + 1}" for k in range(len(order))], np.str_)[order],
        boundary_error=np.full(len(order), np.nan),
        system=system,
        gamma=gamma,
        # From the axis outwards is the order that they come in.
        expected=int(np.argmin(order)),
        searched=_searched(found, row, gamma),
    )


def _searched(found: Found, row: Array, gamma: float) -> str:
    """What was searched, in words."""
    unit = gamma**2
    text = (
        f"fish radius {np.exp(found.low[0]) / unit:.1e} to {1.0 + row[0, LAM]:.6g} tow radii, {found.shots[0]} shots "
        f"with derivative, refined until each predicts its neighbours within {PREDICTED:g} tow radii"
    )
    if least_radius(row, np.array([gamma]))[0] > FIRST_LOW:
        text += "; energy allows none nearer to the axis"
    low, high = found.unsearched[0]
    if np.isfinite(low):
        sentence = status.SENTENCES[int(found.status[0])]
        text += f"; not from {np.exp(low) / unit:.6g} to {np.exp(high) / unit:.6g}, where shots failed ({sentence})"
    return text + "; that there are no others is not proved"


def quantities(row: Integers, x: Array, systems: Array, gamma: Array) -> dict[str, NDArray[Any]]:
    """Quantities of shapes that were found, turned so that the tow point is at (1, 0, 0).

    Parameters
    ----------
    row : ndarray of int, shape (shapes,)
        Of the system.
    x : ndarray, shape (shapes,)
        log of the radius of the fish over g / Omega^2.
    systems : ndarray, shape (systems, columns)
    gamma : ndarray, shape (systems,)

    Returns
    -------
    dict of ndarray, shape (shapes,)
        R_x0, R_y0, R_z0, x_f, y_f, z_f, r_f, phase_deg, tension, nodes, near_axis, error, as of `Equilibria`.
    """
    r = np.exp(x)
    ends = shoot(r, gamma[row], systems[row], SLOPE)
    unit = np.square(gamma[row])
    turned = np.arctan2(ends.Y[:, 0], ends.X[:, 0])
    cos, sin = np.cos(turned), np.sin(turned)
    fx, fy, tension = ends.FX[:, 0] / unit, ends.FY[:, 0] / unit, ends.T[:, 0] / unit
    return {
        "R_x0": fx * cos + fy * sin,
        "R_y0": fy * cos - fx * sin,
        "R_z0": ends.FZ[:, 0] / unit,
        "x_f": r / unit * cos,
        "y_f": -r / unit * sin,
        "z_f": ends.H[:, 0] / unit,
        "r_f": r / unit,
        "phase_deg": np.degrees(ends.angle),
        "tension": tension,
        # x, the position towards the tow point, changes sign where the angle left is 90 degrees and every 180 more.
        "nodes": np.floor(ends.angle / np.pi + 0.5).astype(np.int64),
        "near_axis": (r / unit < NEAR_AXIS) & (np.diff(row, prepend=-1) != 0),
        "error": errors_of(x, ends, gamma[row]),
    }


def errors_of(x: Array, ends: Ends, gamma: Array) -> Array:
    """What rounding leaves of the radius of the fish.

    Parameters
    ----------
    x : ndarray, shape (shapes,)
        log of it over g / Omega^2.
    ends : Ends
        Of shots with slopes.
    gamma : ndarray, shape (shapes,)

    Returns
    -------
    ndarray, shape (shapes,)
        Over that radius [-].
    """
    fx, fy, tension = (part[:, 0] / np.square(gamma) for part in (ends.FX, ends.FY, ends.T))
    amplitude = np.hypot(1.0, np.hypot(fx, fy) / np.abs(gamma) / np.sqrt(tension))
    rounding = ROUNDINGS * EPS * amplitude * np.sqrt(1.0 + ends.steps)
    # Where the end of a shot moves far with the fish, the rounding of log r itself is what is left.
    return np.asarray(np.maximum(rounding / np.abs(ends.log_rho[:, 1]), EPS * (1.0 + np.abs(x))))


def fill(columns: dict[str, NDArray[Any]], row: Integers, rows: int) -> dict[str, NDArray[Any]]:
    """Columns over (system, shape), shapes in rising order of R_x0, from columns over shapes of all systems.

    Parameters
    ----------
    columns : dict of ndarray, shape (shapes,)
    row : ndarray of int, shape (shapes,)
        Of the system, rising.
    rows : int
        Number of systems.

    Returns
    -------
    dict of ndarray, shape (rows, most shapes)
        nan, -1 or False where a system has fewer.
    """
    order = np.lexsort((columns["R_x0"], row))
    counts = np.bincount(row, minlength=rows)
    place = np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)
    filled = {}
    for name, column in columns.items():
        missing = {"f": np.nan, "i": -1, "b": False}[column.dtype.kind]
        filled[name] = np.full((rows, max(1, counts.max(initial=0))), missing, column.dtype)
        filled[name][row[order], place] = column[order]
    return filled
