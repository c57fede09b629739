"""All equilibria of one cable at one speed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_one
from towatlas.kernels import status
from towatlas.limits import threshold_offset, unchecked_excess_length
from towatlas.solve.critical import solve_rows
from towatlas.solve.drag_equilibria import DragEquilibria, check_system, solve_drag_equilibria
from towatlas.solve.members import Members, extrema, shoot_lanes, shoot_singly, solve_members

# Segments of the forward shot that bears witness to each root.
WITNESS_SEGMENTS = 10_000
# With more extrema than this the kernel of many lanes is worth its compilation.
FEW = 50
# Half waves on all shots of a kind together beyond which a cable is refused: half a minute.
HALF_WAVES = 2e7

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Equilibria:
    """Every equilibrium of one cable, in rising order of R_x0; arrays of shape (equilibria,), all dimensionless.

    lam, w_f, gamma : the cable and its speed. R_x0 : radial reaction at the tow point. x_f, z_f : position of the fish.
    tension : at the tow point. nodes : number of nodes. median : which one is the median root, the shape that Skop
    expects to be seen. boundary_error : E of Eq. (33) of a forward shot with this R_x0, an independent witness, in
    which its own truncation error dominates. error : estimated relative error of x_f.
    """

    lam: float
    w_f: float
    gamma: float
    R_x0: Array
    x_f: Array
    z_f: Array
    tension: Array
    nodes: NDArray[np.int64]
    median: NDArray[np.bool_]
    boundary_error: Array
    error: Array

    def __len__(self) -> int:
        return len(self.R_x0)


def equilibria(
    lam: float,
    w_f: float,
    gamma: float,
    C: float = 0.0,
    m_f: float | None = None,
    C_f: float = 0.0,
    w: float = 1.0,
    C_t: float = 0.0,
) -> Equilibria | DragEquilibria:
    """Equilibria of a towed cable: all of them in a vacuum, those that a search finds in a fluid.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0.
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0.
    gamma : float
        Rotational frequency Omega sqrt(R/g) [-], > 0.
    C : float
        Drag constant of the cable, (1/2) rho C_D d R / (mu + rho A) [-], >= 0.
    m_f : float, optional
        Fish mass over (mu + rho A) R [-], >= 0; equal to w_f by default, the report's nondense fluid.
    C_f : float
        Drag constant of the fish, (1/2) rho C_Df A_f / (mu + rho A) [-], >= 0.
    w : float
        Weight of the cable, (mu - rho A) / (mu + rho A) [-], above -1, at most 1; 1 in a nondense fluid.
    C_t : float
        Tangential drag constant of the cable, as C with the coefficient of the flow along it [-], >= 0.

    Returns
    -------
    Equilibria
        In a vacuum, where the last five have their defaults: all of them, an odd number.
    DragEquilibria
        In a fluid: those that continuation from a vacuum and a search in the radius of the fish find. Completeness is
        not proved; `searched` says what was searched.

    Raises
    ------
    ValueError
        For numbers out of range, and what is not one number.
    ArithmeticError
        If the computation overflows, does not converge, or would take minutes (HALF_WAVES).

    Notes
    -----
    In a vacuum complete by construction: the offsets at which the number of zeros of q = dp/da along the shot changes
    separate monotone pieces of p(t_e; a), each of which holds at most one equilibrium and one mirrored one. Their
    number is 1 + 2 #{n : gamma > gamma_cn}.

    References
    ----------
    NRL Report 7048, Eqs. (29)-(35), with drag (12)-(23); median root, section "The character of the solutions for
    lambda > lambda_c".

    Examples
    --------
    >>> [round(float(r), 3) for r in equilibria(37.8, 1352, 2.97).R_x0]
    [-444837.738, 552.265, 469356.532]
    >>> found = equilibria(37.8, 1352, 2.97, C=0.018)
    >>> [round(float(r), 4) for r in found.r_f], [int(n) for n in found.nodes]
    ([0.0435, 36.8139, 38.7821], [1, 1, 0])
    """
    lam, w_f, gamma = check_one("lam", lam), check_one("w_f", w_f, zero=True), check_one("gamma", gamma)
    system = check_system(lam, w_f, C, m_f, C_f, w, C_t)
    if not system.in_vacuum:
        # The vacuum of the report, m_f = w_f and w = 1, is where the equilibria are continued from.
        return solve_drag_equilibria(system, gamma, np.abs(_all_members(w_f, lam, gamma)[1].x_f))
    return vacuum_equilibria(lam, w_f, gamma)


def vacuum_equilibria(lam: float, w_f: float, gamma: float) -> Equilibria:
    """All equilibria in a vacuum; see `equilibria`."""
    from towatlas.kernels.scan import forward_shots

    lam, w_f, gamma = check_one("lam", lam), check_one("w_f", w_f, zero=True), check_one("gamma", gamma)
    nodes, found = _all_members(w_f, lam, gamma)
    order = np.argsort(found.R_x0)
    nodes, x_f, z_f, error = nodes[order], found.x_f[order], found.z_f[order], found.error[order]
    r_x0 = np.ascontiguousarray(found.R_x0[order])
    rows = len(order)
    witness, x_end, r_x_end = np.empty(rows), np.empty(rows), np.empty(rows)
    cable = (np.full(rows, value) for value in (w_f, lam, gamma))
    forward_shots(*cable, r_x0, WITNESS_SEGMENTS, witness, x_end, r_x_end, 0, rows)
    return Equilibria(
        lam=lam,
        w_f=w_f,
        gamma=gamma,
        R_x0=r_x0,
        x_f=x_f,
        z_f=z_f,
        tension=np.hypot(w_f + lam, r_x0),
        nodes=nodes,
        median=np.arange(rows) == rows // 2,
        boundary_error=witness,
        error=error,
    )


def solve_branch(branch: str, w_f: Array, lam: Array, gamma: Array) -> tuple[NDArray[np.int64], Members]:
    """The outward or the median equilibrium of each row, solved directly; no checks.

    Returns
    -------
    nodes : ndarray of int, shape (rows,)
    members : Members
    """
    n = np.zeros(len(lam), np.int64)
    if branch == "median":
        n = folds_passed(w_f, lam, gamma)
    members = solve_members(w_f, lam, gamma, n, np.zeros(len(lam), bool), shoot_lanes)
    return n, members


def folds_passed(w_f: Array, lam: Array, gamma: Array) -> NDArray[np.int64]:
    """Number of critical speeds below gamma, for each row."""
    passed = np.zeros(len(lam), np.int64)
    rows = np.arange(len(lam))
    while len(rows):
        n = passed[rows] + 1
        excess = unchecked_excess_length(lam[rows], w_f[rows], n)
        states = solve_rows(n, w_f[rows], lam[rows], excess)
        # One that rounding hides lies next to its threshold, beyond any speed.
        rows = rows[(states["status"] == status.OK) & (states["gamma"] < gamma[rows])]
        passed[rows] += 1
    return passed


def _failure(lam: float, w_f: float, gamma: float, code: int) -> ArithmeticError:
    return ArithmeticError(f"lam = {lam:g}, w_f = {w_f:g}, gamma = {gamma:g}: {status.SENTENCES[code]}")


# What overflows becomes a status of the shots.
@np.errstate(over="ignore", invalid="ignore")
def _highest(w_f: float, lam: float, gamma: float) -> tuple[int, int]:
    """Highest pair of equilibria that one cable may have, and a status."""
    # Extrema too low to reach gamma^2 are as many as the half waves of a straight cable, millions at high speeds: of
    # those beyond the last n with a transition only one is looked for, as a check on the closed form.
    half_waves = 2.0 / np.pi * gamma * lam / (np.sqrt(w_f + lam) + np.sqrt(w_f))
    possible = float(np.ceil((lam + 1.0 - threshold_offset(w_f)) / 2.0))
    if half_waves * (1.0 + 2.0 * min(possible, half_waves)) > HALF_WAVES:
        raise _failure(lam, w_f, gamma, status.STEP_LIMIT)
    highest, codes = extrema(np.array([w_f]), np.array([lam]), np.array([gamma]), shoot_singly)
    return min(int(highest[0]), int(possible)), int(codes[0])


@np.errstate(over="ignore", invalid="ignore")
def _all_members(w_f: float, lam: float, gamma: float) -> tuple[NDArray[np.int64], Members]:
    """Nodes and states of all equilibria of one cable."""
    last, code = _highest(w_f, lam, gamma)
    if code != status.OK:
        raise _failure(lam, w_f, gamma, code)
    cable = np.array([w_f]), np.array([lam]), np.array([gamma])
    shoot = shoot_singly if last <= FEW else shoot_lanes

    def solve(n: NDArray[np.int64], outer: bool) -> Members:
        w_f, lam, gamma = (np.full(len(n), column[0]) for column in cable)
        return solve_members(w_f, lam, gamma, n, np.full(len(n), outer), shoot)

    n = np.arange(last + 1)
    inner = solve(n, False)
    codes = inner.status
    there = codes == status.OK
    outer = solve(n[there & (n > 0)], True)
    # A pair that is one member short is within rounding of its fold.
    codes = np.concatenate(
        [
            codes[codes != status.NOT_FOUND],
            np.where(outer.status == status.NOT_FOUND, status.LOST_IN_ROUNDING, outer.status),
        ]
    )
    if (codes != status.OK).any():
        raise _failure(lam, w_f, gamma, int(codes.max()))
    nodes = np.concatenate([n[there], n[there & (n > 0)]])
    columns = {
        name: np.concatenate([getattr(inner, name)[there], getattr(outer, name)]) for name in Members.__annotations__
    }
    return nodes, Members(**columns)
