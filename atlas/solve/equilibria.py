"""All equilibria of one cable at one speed."""

from math import inf

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_speed
from towatlas.effort import TooMuchWork, check_foreseen, check_patience, patience
from towatlas.kernels import status
from towatlas.limits import threshold_offset
from towatlas.results import Equilibria
from towatlas.solve.batches import batches
from towatlas.solve.drag_equilibria import NEAR_AXIS, solve_drag_equilibria
from towatlas.solve.members import REMEDY, Members, extrema, shoot_lanes, shoot_singly, solve_members
from towatlas.solve.passed import folds_passed
from towatlas.system import System

# Segments of the forward shot that bears witness to each root.
WITNESS_SEGMENTS = 10_000
# With more extrema than this the kernel of many lanes is worth its compilation.
FEW = 50
# CPU time of a search, by the half waves of one shot to each equilibrium: measured, 1.2 to 20 microseconds [s].
SECONDS_A_HALF_WAVE = 1.2e-6
# Rows of those forward shots in one call: a second.
WITNESSES_A_CALL = 2000.0

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
CABLE = ("lam", "w_f", "gamma")


def equilibria(
    lam: float,
    w_f: float,
    gamma: float,
    C: float = 0.0,
    m_f: float | None = None,
    C_f: float = 0.0,
    w: float = 1.0,
    C_t: float = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> Equilibria:
    """Equilibria of a towed cable: all of them in a vacuum, those that a search finds in a fluid.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0.
    w_f : float
        Fish weight over (mu + rho A) g R [-]; negative for a fish that floats, whose m_f then has to be given.
    gamma : float
        Rotational frequency Omega sqrt(R/g) [-]: positive in a turn to starboard, negative in one to port, which is its
        mirror image but for a side force.
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
    C_s : float
        Side force constant of a stranded cable, rho d R a / (2 (mu + rho A)) [-], positive to starboard of the track.
    b_s : float
        Sine of the angle between cable and stream at which the side force is at its largest [-], > 0; inf for a force
        that grows with the sine.

    Returns
    -------
    Equilibria
        In a vacuum, where all from C have their defaults: all of them, an odd number. In a fluid: those that a search
        in the radius of the fish finds; `searched` says what was searched.

    Raises
    ------
    ValueError
        For numbers out of range, and what is not one number.
    ArithmeticError
        If the computation overflows, does not converge, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    In a vacuum complete by construction: the offsets at which the number of zeros of q = dp/da along the shot changes
    separate monotone pieces of p(t_e; a), each of which holds at most one equilibrium and one mirrored one. Their
    number is 1 + 2 #{n : gamma > gamma_cn}: docs/proofs.md, Theorem 6.

    References
    ----------
    NRL Report 7048, Eqs. (29)-(35), with drag (12)-(23); median root, section "The character of the solutions for
    lambda > lambda_c". The side force: DTMB Report 713, 1950.

    Examples
    --------
    >>> found = equilibria(37.8, 1352, 2.97)
    >>> [round(float(r), 3) for r in found.R_x0], [str(name) for name in found.branch], found.expected
    ([-444837.738, 552.265, 469356.532], ['1 outer', '1 inner', 'outward'], 1)
    >>> found = equilibria(37.8, 1352, 2.97, C=0.018)
    >>> [round(float(r), 4) for r in found.r_f], [int(n) for n in found.nodes], found.expected
    ([36.8139, 0.0435, 38.7821], [1, 1, 0], 1)
    """
    system = System.of(lam, w_f, C=C, m_f=m_f, C_f=C_f, w=w, C_t=C_t, C_s=C_s, b_s=b_s)
    with patience():
        return solve_equilibria(system, check_speed(gamma))


def solve_equilibria(system: System, gamma: float) -> Equilibria:
    """Equilibria of a system already checked; see `equilibria`.

    Parameters
    ----------
    system : System
    gamma : float
        Speed Omega sqrt(R/g) [-], negative in a turn to port.

    Returns
    -------
    Equilibria

    Raises
    ------
    ArithmeticError
        If the computation overflows, does not converge, or takes longer than `towatlas.patience` allows (TooMuchWork).
    """
    if not system.in_vacuum:
        return solve_drag_equilibria(system, gamma)
    nodes, outer, found = _all_members(system, abs(gamma))
    branch = branch_names(nodes, outer)
    order = np.argsort(found.R_x0)
    r_x0, x_f = np.ascontiguousarray(found.R_x0[order]), found.x_f[order]
    rows = len(order)
    return Equilibria(
        system=system,
        gamma=gamma,
        R_x0=r_x0,
        R_y0=np.zeros(rows),
        R_z0=np.full(rows, system.w_f + system.lam),
        x_f=x_f,
        y_f=np.zeros(rows),
        z_f=found.z_f[order],
        r_f=np.abs(x_f),
        phase_deg=180.0 * nodes[order].astype(float),
        tension=np.hypot(system.w_f + system.lam, r_x0),
        nodes=nodes[order],
        branch=branch[order],
        expected=rows // 2,
        near_axis=(np.abs(x_f) < NEAR_AXIS) & (np.abs(x_f) == np.abs(x_f).min()),
        error=found.error[order],
        boundary_error=_boundary_errors(system, abs(gamma), r_x0),
        searched="all: as many as the zeros of the first variation say",
    )


def branch_names(nodes: Integers, outer: NDArray[np.bool_]) -> NDArray[np.str_]:
    """What the equilibria of a cable in a vacuum are called.

    Parameters
    ----------
    nodes : ndarray of int, shape (equilibria,)
    outer : ndarray of bool, shape (equilibria,)
        Whether each is the member of its pair farther from the axis.

    Returns
    -------
    ndarray of str, shape (equilibria,)
        "outward", "n inner", "n outer".
    """
    names = [f"{n} {'outer' if o else 'inner'}" if n else "outward" for n, o in zip(nodes, outer, strict=True)]
    return np.array(names, np.str_)


def _boundary_errors(system: System, gamma: float, r_x0: Array) -> Array:
    """E of Eq. (33) of forward shots: an independent witness."""
    from towatlas.kernels.calls import forward_shots

    rows, r_x0 = len(r_x0), np.ascontiguousarray(r_x0)
    errors, x_end, r_x_end = np.empty(rows), np.empty(rows), np.empty(rows)
    cable = [np.full(rows, value) for value in (system.lam, system.w_f, gamma)]
    for part in batches(np.ones(rows), WITNESSES_A_CALL):
        check_patience("forward shots", REMEDY, done=part.start, of=rows)
        forward_shots(*cable, r_x0, WITNESS_SEGMENTS, errors, x_end, r_x_end, part.start, part.stop)
    return errors


def solve_branch(branch: str, *, lam: Array, w_f: Array, gamma: Array) -> tuple[NDArray[np.int64], Members]:
    """The outward or the median equilibrium of each row, solved directly; no checks.

    Parameters
    ----------
    branch : {"outward", "median"}
    lam, w_f, gamma : ndarray, shape (rows,)
        Cable length, fish weight and speed [-].

    Returns
    -------
    nodes : ndarray of int, shape (rows,)
        -1 where their number is not known, with status STEP_LIMIT.
    members : Members
    """
    n = np.zeros(len(lam), np.int64)
    if branch == "median":
        n = folds_passed(w_f=w_f, lam=lam, gamma=gamma)
    known = n >= 0
    members = solve_members(
        lam=lam, w_f=w_f, gamma=gamma, n=np.maximum(n, 0), outer=np.zeros(len(lam), bool), shoot=shoot_lanes
    )
    if not known.all():
        for name in ("a", "R_x0", "x_f", "z_f", "error"):
            getattr(members, name)[~known] = np.nan
        members.status[~known] = status.STEP_LIMIT
    return n, members


def _failure(system: System, gamma: float, code: int) -> ArithmeticError:
    kind = TooMuchWork if code == status.STEP_LIMIT else ArithmeticError
    return kind(f"lam = {system.lam:g}, w_f = {system.w_f:g}, gamma = {gamma:g}: {status.SENTENCES[code]}")


def _highest(system: System, gamma: float) -> int:
    """Highest pair of equilibria that one cable may have in a vacuum."""
    # Extrema too low to reach gamma^2 are as many as the half waves of a straight cable, millions at high speeds: of
    # those beyond the last n with a transition (docs/proofs.md, Theorem 1) only one is looked for, as a check.
    lam, w_f = system.lam, system.w_f
    half_waves = 2.0 / np.pi * gamma * lam / (np.sqrt(w_f + lam) + np.sqrt(w_f))
    possible = float(np.ceil((lam + 1.0 - threshold_offset(w_f)) / 2.0))
    nodes = min(possible, half_waves)
    if half_waves < np.inf:
        seconds = SECONDS_A_HALF_WAVE * half_waves * (1.0 + 2.0 * nodes)
        shapes = f"shots of {np.rint(half_waves):,.12g} half waves to shapes of up to {np.rint(nodes):,.12g} nodes"
        check_foreseen(seconds, shapes, REMEDY)
    cable = (np.array([value]) for value in (lam, w_f, gamma))
    highest, codes = extrema(**dict(zip(CABLE, cable, strict=True)), shoot=shoot_singly)
    if codes[0] != status.OK:
        raise _failure(system, gamma, int(codes[0]))
    return min(int(highest[0]), int(possible))


# What overflows becomes a status of the shots.
@np.errstate(over="ignore", invalid="ignore")
def _all_members(system: System, gamma: float) -> tuple[Integers, NDArray[np.bool_], Members]:
    """Number of the pair, whether it is its outer member, and state of every equilibrium of one cable in a vacuum."""
    last = _highest(system, gamma)
    shoot = shoot_singly if last <= FEW else shoot_lanes

    def solve(n: Integers, outer: bool) -> Members:
        cables = (np.full(len(n), value) for value in (system.lam, system.w_f, gamma))
        return solve_members(**dict(zip(CABLE, cables, strict=True)), n=n, outer=np.full(len(n), outer), shoot=shoot)

    n = np.arange(last + 1)
    inner = solve(n, False)
    there = inner.status == status.OK
    pairs = n[there & (n > 0)]
    outer = solve(pairs, True)
    # A pair that is one member short is within rounding of its fold.
    codes = np.concatenate(
        [
            inner.status[inner.status != status.NOT_FOUND],
            np.where(outer.status == status.NOT_FOUND, status.LOST_IN_ROUNDING, outer.status),
        ]
    )
    if (codes != status.OK).any():
        raise _failure(system, gamma, int(codes.max()))
    columns = {
        name: np.concatenate([getattr(inner, name)[there], getattr(outer, name)]) for name in Members.__annotations__
    }
    is_outer = np.repeat([False, True], [int(there.sum()), len(pairs)])
    return np.concatenate([n[there], pairs]), is_outer, Members(**columns)
