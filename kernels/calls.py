"""What Python calls: the kernels, the tuples of arrays that they take, and what the columns of those are.

Cheap to import: numba is not.
"""

from typing import Any, NamedTuple

from towatlas.kernels.native import Kernel

END_COLUMNS = 6  # tau, f, p, z, v, q
FOLD_COLUMNS = 4  # tau, f, p, z
# Of a table of folds: log(a excess), log(gamma sqrt(excess)), log|R_x0|, log z_f, and their slopes in log(excess) and
# log w_f; terms of a patch of it along each axis, one vector.
FIELDS = 4
SLOPES = 2 * FIELDS
NODES = 8
RESULT_ROWS = 8  # of Reached.state
# Order of the Taylor steps, and the bound on their last two terms over the local amplitude: their sum with all later
# ones stays below rounding.
ORDER = 20
TRUNCATION = 1e-16
# Size of the derivatives that Marched.states has in its imaginary parts.
TINY = 1e-40
# Coefficients of a small motion along a step, and how many terms each has.
MOTION_ROWS, MOTION_TERMS = 28, ORDER


class Cables(NamedTuple):
    """Cables whose n-th fold is asked for, arrays of shape (rows,); excess : lambda - lambda_cn."""

    lam: Any
    w_f: Any
    n: Any
    excess: Any


class Folds(NamedTuple):
    """Guesses in, solutions out, arrays of shape (rows,) but for slopes and states.

    a, gamma : a row with gamma <= 0 is given a guess. slopes : shape (rows, 8), of log a in log(excess) and in log w_f,
    then of log gamma, log|R_x0| and log z_f, near the solution; nan where not known. states : shape (rows, 4), gamma,
    R_x0, x_f, z_f, lengths over the tow radius. error : relative error estimate of gamma. statuses : codes.
    """

    a: Any
    gamma: Any
    slopes: Any
    states: Any
    error: Any
    statuses: Any


class Shots(NamedTuple):
    """Shots to make, a row each: radius r of the fish and speed gamma^2, lengths over g / Omega^2.

    systems : shape (rows, len(COLUMNS)), as kernels.system names them. directions : the same, how the system moves with
    the parameter among the unknowns. shares : the part of the cable to shoot over.
    """

    r: Any
    gamma2: Any
    systems: Any
    directions: Any
    shares: Any


class Algebra(NamedTuple):
    """A kind of jet: products, pairs and places as in `towatlas.solve.jets`, and the degree."""

    products: Any
    pairs: Any
    places: Any
    degree: Any


class Reached(NamedTuple):
    """What the shots came to: state : shape (rows, RESULT_ROWS, monomials), X, Y, h, F_x, F_y, F_z, T and
    log(rho / gamma^2) at the end; steps made; turns : shape (rows, 2), how often the angle about the axis passed 180
    degrees, and how often X changed its sign; statuses.
    """

    state: Any
    steps: Any
    turns: Any
    statuses: Any


class Marched(NamedTuple):
    """Shots on their way, a row each, in units of g / Omega^2.

    states : complex, shape (rows, SIZE), marched in place. paid : cable paid out. gamma2 : speed squared. angle : of
    the state about the axis, added to [rad]. steps, statuses : counted, set.
    """

    states: Any
    paid: Any
    gamma2: Any
    angle: Any
    steps: Any
    statuses: Any


march = Kernel("lanes", "march", "f1 f1 f1 i1 i1 i f2 f3 i1 i1 i i")
shoot_each = Kernel("vacuum_single", "shoot_each", "f1 f1 f1 i f2 i1 i1")
seed_folds = Kernel("fold_predictor", "seed_folds", "f5 f1 f1 f1 f f1 f1 f2 i i")
solve_folds = Kernel("folds", "solve_folds", (Cables, "f1 f1 i1 f1"), (Folds, "f1 f1 f2 f2 f1 i1"), "i i i")
forward_shots = Kernel("scan", "forward_shots", "f1 f1 f1 f1 i f1 f1 f1 i i")
scan_system = Kernel("scan", "scan_system", "f f f f i i i i f f2 i1")
_SHOTS, _ALGEBRA = (Shots, "f1 f1 f2 f2 f1"), (Algebra, "i2 i2 i1 i")
shoot_drag = Kernel("drag_shots", "shoot_drag", _SHOTS, _ALGEBRA, "f i", (Reached, "f3 i1 i2 i1"), "i i")
shoot_stiff = Kernel("drag_stiff", "shoot_stiff", (Marched, "c2 f1 f1 f1 i1 i1"), "f2 f i i i")
expand_shapes = Kernel("variation", "expand_shapes", _SHOTS, _ALGEBRA, "f1 f f4 f2 f2 i1 i1 i i")
evans = Kernel("evans", "evans", "f3 f1 i1 i1 f2 f2 b1 i i f i1 c1 c1 f1 i i")

# What is compiled at once: the longest first, and next to each other what shares code.
GROUPS = (
    (shoot_drag, expand_shapes),
    (march, solve_folds, seed_folds),
    (shoot_each, forward_shots, scan_system),
    (evans, shoot_stiff),
)
KERNELS = tuple(kernel for group in GROUPS for kernel in group)
