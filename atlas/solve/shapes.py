"""The shape of one equilibrium: position, force and tension along the cable."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_real, check_root
from towatlas.kernels import status
from towatlas.solve.equilibria import Equilibria, vacuum_equilibria
from towatlas.solve.members import shoot_singly

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]

POINTS = 401
# Samples a half wave of the cable in which its nodes are looked for, at first.
SAMPLES = 8
NEWTON_ROUNDS = 60


def shape(
    lam: float, w_f: float, gamma: float, *, root: str | int = "median", s: ArrayLike | None = None
) -> "xarray.Dataset":
    """Shape, forces and tension of one equilibrium of a cable towed in a vacuum.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0.
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0.
    gamma : float
        Rotational frequency Omega sqrt(R/g) [-], > 0.
    root : {"median", "outward"} or int
        Which equilibrium: the median root, the one without nodes, or the number (from 0) of a row of `equilibria`,
        which lists them in rising order of R_x0.
    s : array_like, optional
        Arc lengths from the tow point over tow radius [-], from 0 to lam in any order; 401 of them, evenly spaced, by
        default.

    Returns
    -------
    xarray.Dataset
        x, z, R_x, R_z, T over the coordinate s, and s_node, z_node over the coordinate node, from the tow point down.
        Attributes lam, w_f, gamma, nodes, R_x0, x_f, z_f, and error, the estimated relative error of x_f.

    Raises
    ------
    ValueError
        For numbers out of range, a root that does not exist, and arc lengths off the cable.
    ArithmeticError
        If the computation overflows or does not converge.

    Notes
    -----
    Every point is the end of a fish-up shot of its own: nothing is interpolated. Errors of x and z: rounding times the
    number of half waves, and next to a fold the error of the root; below 1e-11 of the largest of 1 and |x_f| unless
    `error` says otherwise.

    References
    ----------
    NRL Report 7048, Eqs. (28), (29), (31).

    Examples
    --------
    >>> curve = shape(10.0, 1.0, 0.6, s=[0.0, 5.0, 10.0])
    >>> [round(float(x), 6) for x in curve.x]
    [1.0, 0.335709, -1.703467]
    """
    found = vacuum_equilibria(lam, w_f, gamma)
    k = check_root(root, found.nodes, found.median)
    lam, w_f, gamma = found.lam, found.w_f, found.gamma
    if s is None:
        arc = np.linspace(0.0, lam, POINTS)
    else:
        arc = np.atleast_1d(check_real("s", s))
        if arc.ndim != 1 or not ((arc >= 0.0) & (arc <= lam)).all():
            raise ValueError(f"s must be a list of arc lengths from 0 to lam = {lam:.15g}")
    s_node = np.sort(lam - _node_heights(found, k))
    # The tow point before all others: depths are below it.
    x, _, z, force = _along(found, k, lam - np.concatenate([[0.0], arc, s_node]))
    z = z[0] - z
    rows = slice(1, 1 + len(arc))
    return _dataset(found, k, arc, x[rows], z[rows], force[rows], s_node, z[1 + len(arc) :])


def _along(found: Equilibria, k: int, height: Array) -> tuple[Array, Array, Array, Array]:
    """x, dx/dh, depth of the fish below, R_x at arc lengths `height` up from the fish."""
    gamma2 = found.gamma**2
    sign = np.sign(found.x_f[k])
    rows = len(height)
    mu = gamma2 * found.w_f
    ends, _, codes = shoot_singly(np.full(rows, gamma2 * abs(found.x_f[k])), np.full(rows, mu), gamma2 * height)
    if (codes != status.OK).any():
        raise ArithmeticError(
            f"lam = {found.lam:g}, w_f = {found.w_f:g}, gamma = {found.gamma:g}: {status.SENTENCES[int(codes.max())]}"
        )
    f, p, z = ends[:, 1], ends[:, 2], ends[:, 3]
    with np.errstate(invalid="ignore"):
        # At the tip of a cable without a fish both are zero.
        slope = -f / np.hypot(mu + gamma2 * height, f)
    return sign * p / gamma2, sign * slope, z / gamma2, sign * f / gamma2


def _node_heights(found: Equilibria, k: int) -> Array:
    """Arc lengths from the fish up to each node, by Newton inside brackets from a sampled shot."""
    nodes = int(found.nodes[k])
    if nodes == 0:
        return np.empty(0)
    count = SAMPLES * (nodes + 1)
    while True:
        # The waves of a hanging chain are even in the root of the tension, short next to a bare tip.
        root = np.linspace(np.sqrt(found.w_f), np.sqrt(found.w_f + found.lam), count + 1)
        height = np.clip(root**2 - found.w_f, 0.0, found.lam)
        x = _along(found, k, height)[0]
        before = np.flatnonzero((x[1:] > 0.0) != (x[:-1] > 0.0))
        if len(before) == nodes:
            break
        if count > 4096 * (nodes + 1):
            raise ArithmeticError(f"only {len(before)} of {nodes} nodes were found; please report the inputs")
        count *= 4
    low, high = height[before], height[before + 1]
    low_side = x[before] > 0.0
    at = 0.5 * (low + high)
    for _ in range(NEWTON_ROUNDS):
        x, slope, _, _ = _along(found, k, at)
        same = (x > 0.0) == low_side
        low, high = np.where(same, at, low), np.where(same, high, at)
        trial = at - x / slope
        trial = np.where((trial > low) & (trial < high), trial, 0.5 * (low + high))
        done = np.abs(trial - at) <= 2e-16 * (found.lam + at)
        at = trial
        if done.all():
            break
    return at


def _dataset(
    found: Equilibria, k: int, s: Array, x: Array, z: Array, force: Array, s_node: Array, z_node: Array
) -> "xarray.Dataset":
    import xarray

    from towatlas.cf import equilibrium_variable, shape_attributes

    weight = found.w_f + (found.lam - s)
    columns = {"x": x, "z": z, "R_x": force, "R_z": weight, "T": np.hypot(weight, force)}
    variables: dict[str, Any] = {name: equilibrium_variable(("s",), name, column) for name, column in columns.items()}
    variables["s_node"] = equilibrium_variable(("node",), "s", s_node)
    variables["z_node"] = equilibrium_variable(("node",), "z", z_node)
    facts = {
        "lam": found.lam,
        "w_f": found.w_f,
        "gamma": found.gamma,
        "nodes": np.int32(found.nodes[k]),
        "R_x0": float(found.R_x0[k]),
        "x_f": float(found.x_f[k]),
        "z_f": float(found.z_f[k]),
        "error": float(found.error[k]),
    }
    return xarray.Dataset(variables, {"s": equilibrium_variable(("s",), "s", s)}, attrs=shape_attributes(facts))
