"""The shape of one equilibrium: position, force and tension along the cable."""

from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_real, check_root, check_speed
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.numerics.rows import bracket
from towatlas.results import Equilibria
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.looks import SLOPE
from towatlas.solve.members import shoot_singly
from towatlas.solve.shots import shoot
from towatlas.system import System

if TYPE_CHECKING:
    import xarray

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
# Arc lengths up from the fish -> rows x, y, height above the fish, R_x, R_y, R_z, T, and the slope of x.
Line = Callable[[Array], Array]

POINTS = 401
# Samples a half wave of the cable in which its nodes are looked for, at first, and at most.
SAMPLES, MOST_SAMPLES = 8, 4096


def shape(
    lam: float,
    w_f: float,
    gamma: float,
    *,
    root: str | int = "expected",
    s: ArrayLike | None = None,
    C: float = 0.0,
    m_f: float | None = None,
    C_f: float = 0.0,
    w: float = 1.0,
    C_t: float = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> "xarray.Dataset":
    """Shape, forces and tension of one equilibrium of a towed cable.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0.
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0.
    gamma : float
        Rotational frequency Omega sqrt(R/g) [-], > 0.
    root : str or int
        Which equilibrium: "expected", the one to be expected; the name of a branch, as "outward" or "2 inner"; in a
        vacuum "median", the median root; or the number (from 0) of a row of `equilibria`.
    s : array_like, optional
        Arc lengths from the tow point over tow radius [-], from 0 to lam in any order; 401 of them, evenly spaced, by
        default.
    C, m_f, C_f, w, C_t, C_s, b_s : float
        The fluid, as in `equilibria`; a vacuum by default.

    Returns
    -------
    xarray.Dataset
        x, y, z, R_x, R_y, R_z, T over the coordinate s, and s_node, z_node over the coordinate node, from the tow point
        down. Attributes: the system, gamma, nodes, branch, R_x0, x_f, y_f, z_f, and error, the estimated relative error
        of the distance of the fish from the axis.

    Raises
    ------
    ValueError
        For numbers out of range, a root that does not exist, and arc lengths off the cable.
    ArithmeticError
        If the computation overflows or does not converge.

    Notes
    -----
    Every point is the end of a fish-up shot of its own: nothing is interpolated. Errors of x and z: rounding times the
    number of half waves, and next to a fold the error of the root; in a vacuum below 1e-11 of the largest of 1 and
    ``|x_f|`` unless `error` says otherwise.

    References
    ----------
    NRL Report 7048, Eqs. (28), (29), (31); with drag (20) to (23).

    Examples
    --------
    >>> curve = shape(10.0, 1.0, 0.6, s=[0.0, 5.0, 10.0])
    >>> [round(float(x), 6) for x in curve.x]
    [1.0, 0.335709, -1.703467]
    """
    system = System.of(lam, w_f, C=C, m_f=m_f, C_f=C_f, w=w, C_t=C_t, C_s=C_s, b_s=b_s)
    with patience():
        return shape_of(solve_equilibria(system, check_speed(gamma)), root, s)


def shape_of(found: Equilibria, root: str | int = "expected", s: ArrayLike | None = None) -> "xarray.Dataset":
    """Shape, forces and tension of one of the equilibria that are known.

    Parameters
    ----------
    found : Equilibria
        From `towatlas.equilibria`.
    root : str or int
        Which of them, as in `shape`.
    s : array_like, optional
        Arc lengths from the tow point over tow radius [-], as in `shape`.

    Returns
    -------
    xarray.Dataset
        As of `shape`.

    Raises
    ------
    ValueError
        For a root that does not exist, and arc lengths off the cable.
    ArithmeticError
        If the computation overflows.

    Examples
    --------
    >>> from towatlas import equilibria
    >>> found = equilibria(10.0, 1.0, 0.6)
    >>> curve = shape_of(found, found.expected, s=[0.0, 5.0, 10.0])
    >>> curve.attrs["branch"], [round(float(z), 6) for z in curve.z]
    ('1 inner', [0.0, 4.943103, 9.487566])
    """
    median = len(found) // 2 if found.system.in_vacuum else -1
    k = check_root(root, found.branch, found.expected, median)
    lam = found.system.lam
    arc = np.linspace(0.0, lam, POINTS) if s is None else np.atleast_1d(check_real("s", s))
    if arc.ndim != 1 or not ((arc >= 0.0) & (arc <= lam)).all():
        raise ValueError(f"s must be a list of arc lengths from 0 to lam = {lam:.15g}")
    with patience():
        line = line_of(found, k)
        s_node = np.sort(lam - _node_heights(found, k, line))
        # The tow point before all others: depths are below it.
        columns = line(lam - np.concatenate([[0.0], arc, s_node]))
        columns[2] = columns[2, 0] - columns[2]
        return _dataset(found, k, arc, columns[:, 1 : 1 + len(arc)], s_node, columns[2, 1 + len(arc) :])


def line_of(found: Equilibria, k: int) -> Line:
    """Shots of one of the equilibria that are known.

    Parameters
    ----------
    found : Equilibria
    k : int
        Which of them.

    Returns
    -------
    callable
        From arc lengths above the fish, shape (points,), to x, y, the height above the fish, R_x, R_y, R_z, T and the
        slope of x along the cable, shape (8, points); lengths over the tow radius, forces over (mu + rho A) g R [-].
    """
    return _vacuum_line(found, k) if found.system.in_vacuum else _drag_line(found, k)


def _vacuum_line(found: Equilibria, k: int) -> Line:
    """Shots of an equilibrium in a vacuum."""
    system, gamma2 = found.system, found.gamma**2
    sign, mu = np.sign(found.x_f[k]), gamma2 * system.w_f

    def line(height: Array) -> Array:
        rows = len(height)
        ends, _, codes = shoot_singly(np.full(rows, gamma2 * found.r_f[k]), np.full(rows, mu), gamma2 * height)
        if (codes != status.OK).any():
            raise ArithmeticError(
                f"lam = {system.lam:g}, w_f = {system.w_f:g}, gamma = {found.gamma:g}: "
                f"{status.SENTENCES[int(codes.max())]}"
            )
        f, p, z = ends[:, 1], ends[:, 2], ends[:, 3]
        weight, force = system.w_f + height, sign * f / gamma2
        with np.errstate(invalid="ignore"):
            # At the tip of a cable without a fish both are zero.
            slope = -sign * f / np.hypot(mu + gamma2 * height, f)
        none = np.zeros(rows)
        return np.stack([sign * p / gamma2, none, z / gamma2, force, none, weight, np.hypot(weight, force), slope])

    return line


def _drag_line(found: Equilibria, k: int) -> Line:
    """Shots of an equilibrium with drag, turned so that the tow point is at (1, 0, 0)."""
    system, gamma2 = found.system, found.gamma**2
    turned = (found.x_f[k] + 1j * found.y_f[k]) / found.r_f[k]

    def line(height: Array) -> Array:
        radius = np.full(len(height), found.r_f[k] * gamma2)
        ends = shoot(radius, found.gamma, system.row(), SLOPE, shares=height / system.lam)
        if (ends.status != status.OK).any():
            raise ArithmeticError(f"{system}, gamma = {found.gamma:g}: {status.SENTENCES[int(ends.status.max())]}")
        columns = (ends.X, ends.Y, ends.H, ends.FX, ends.FY, ends.FZ, ends.T)
        x, y, h, fx, fy, fz, tension = (column[:, 0] / gamma2 for column in columns)
        position, force = (x + 1j * y) * turned, (fx + 1j * fy) * turned
        slope = -force.real / tension
        return np.stack([position.real, position.imag, h, force.real, force.imag, fz, tension, slope])

    return line


def _node_heights(found: Equilibria, k: int, line: Line) -> Array:
    """Arc lengths from the fish up to each node, inside brackets from a sampled shot."""
    nodes, system = int(found.nodes[k]), found.system
    if nodes == 0:
        return np.empty(0)
    count = SAMPLES * (nodes + 1)
    while True:
        # The waves of a hanging chain are even in the root of the tension, short next to a bare tip.
        weight = abs(system.w_f)
        root = np.linspace(np.sqrt(weight), np.sqrt(weight + system.lam), count + 1)
        height = np.clip(root**2 - weight, 0.0, system.lam)
        x = line(height)[0]
        before = np.flatnonzero((x[1:] > 0.0) != (x[:-1] > 0.0))
        if len(before) == nodes:
            break
        if count > MOST_SAMPLES * (nodes + 1):
            raise ArithmeticError(
                f"{len(before)} nodes were found where {nodes} were counted; please report the inputs"
            )
        count *= 4
    rising = np.where(x[before] > 0.0, -1.0, 1.0)

    def radius(at: Array, i: Integers) -> tuple[Array, Array]:
        columns = line(at)
        return columns[0] * rising[i], columns[-1] * rising[i]

    crossed, solved = bracket(radius, height[before], height[before + 1], resolution=2e-16 * system.lam)
    if not solved.all():
        raise ArithmeticError(f"a node was not found to rounding: {status.SENTENCES[status.NOT_CONVERGED]}")
    return crossed


def _dataset(found: Equilibria, k: int, s: Array, columns: Array, s_node: Array, z_node: Array) -> "xarray.Dataset":
    import xarray

    from towatlas.cf import equilibrium_variable, shape_attributes
    from towatlas.kernels.system import COLUMNS

    names = ("x", "y", "z", "R_x", "R_y", "R_z", "T")
    variables: dict[str, Any] = {
        name: equilibrium_variable(("s",), name, column) for name, column in zip(names, columns, strict=False)
    }
    variables["s_node"] = equilibrium_variable(("node",), "s", s_node)
    variables["z_node"] = equilibrium_variable(("node",), "z", z_node)
    facts = {name: getattr(found.system, name) for name in COLUMNS}
    facts |= {"gamma": found.gamma, "nodes": np.int32(found.nodes[k]), "branch": str(found.branch[k])}
    facts |= {name: float(getattr(found, name)[k]) for name in ("R_x0", "R_y0", "x_f", "y_f", "z_f", "error")}
    return xarray.Dataset(variables, {"s": equilibrium_variable(("s",), "s", s)}, attrs=shape_attributes(facts))
