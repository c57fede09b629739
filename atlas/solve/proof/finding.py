"""Finding the centre of a proof: a shot cut into steps, improved by Newton on all of its nodes at once. Not trusted.

Residuals are exact, corrections are floats: each round gains some fourteen digits.
"""

from dataclasses import dataclass
from math import ldexp
from operator import mul

import numpy as np

from towatlas.solve.proof.arithmetic import Refused, arb, binary, exponent, fmpz
from towatlas.solve.proof.chain import Chain, end_misses, end_slopes, field_of, start_slopes, start_state
from towatlas.solve.proof.taylor import (
    FINE_COLUMNS,
    FLOAT_COLUMNS,
    MORE_BITS,
    Array,
    P,
    R,
    Step,
    T,
    U,
    column_defects,
    crossed,
    defects,
    floats,
    integers,
    linear_series,
    own_defects,
    rounded_length,
)
from towatlas.solve.proof.tip import bound_tip, expand_tip, nearest

# Steps are chosen from so many coefficients in floats.
FLOAT_ORDER = 24
MOST_STEPS = 3000
MOST_ROUNDS = 12
# What a round leaves of what it moves, at most: columns of floats.
LEFT = 1e-10


@dataclass(frozen=True)
class Floats:
    """All steps in floats.

    Attributes
    ----------
    constants : ndarray, shape (steps, 4)
    x, y : ndarray, shape (steps, 4, order + 1)
    v, w : ndarray, shape (steps, 4, 4, order + 1)
        Columns, of fewer coefficients.
    """

    constants: Array
    x: Array
    y: Array
    v: Array
    w: Array


def find_chain(
    lam: float, w_f: float, n: int, a: float, gamma: float, bits: int, order: int, fixed: bool = False
) -> tuple[Chain, Floats]:
    """A chain about a fold known in floats.

    Parameters
    ----------
    lam, w_f : float
    n : int
    a, gamma : float
        Offset of the fish gamma^2 |x_f|, and speed.
    bits, order : int
        Of the coefficients of the steps, bits >= 120.
    fixed : bool
        For an equilibrium at just this speed, instead of a fold.

    Returns
    -------
    Chain
    Floats
        For `refine_columns`.

    Raises
    ------
    Refused
        If that is no fold.
    """
    chain = Chain(lam, w_f, n, _dyadic(a, bits), _square(gamma, bits), bits, order)
    chain.speed = gamma if fixed else None
    nodes, lengths = _march(chain)
    _expand(chain, nodes, lengths)
    linear = _columns(chain)
    moved = before = np.inf
    for k in range(MOST_ROUNDS):
        # A march in floats may end far from where it should: after one round all nodes are right.
        linear = _columns(chain) if k == 1 else linear
        moved = _improve(chain, linear)
        if moved * LEFT < ldexp(1.0, -bits):
            return chain, linear
        if not moved < 0.1 * before:
            break
        before = moved
    raise Refused("NOT_ISOLATED", f"Newton's method does not converge (last step {moved:.1g})")


def _dyadic(value: float, bits: int) -> tuple[int, int]:
    power = exponent(value) - bits
    return int(ldexp(value, -power)), power


def _square(value: float, bits: int) -> tuple[int, int]:
    """The square of a float, exactly if the bits suffice."""
    mantissa, power = _dyadic(value, bits)
    shift = max(0, (mantissa * mantissa).bit_length() - bits)
    return mantissa * mantissa >> shift, 2 * power + shift


def _start(chain: Chain) -> list[arb]:
    a, G = binary(*chain.a), binary(*chain.G)
    if chain.w_f == 0.0:
        chain.tip = expand_tip(a, chain.bits, chain.order)
        return bound_tip(chain.tip, a, arb(0)).value
    return start_state(arb(chain.w_f), a, G)


def _march(chain: Chain) -> tuple[list[list[float]], list[float]]:
    """Nodes and lengths of steps, in floats."""
    state = [float(value.mid()) for value in _start(chain)]
    t_end = (chain.w_f + chain.lam) * ldexp(*chain.G)
    lengths: list[float] = []
    nodes, h = [state], 0.1
    while len(lengths) < MOST_STEPS:
        h, coefficients = _float_step(state, h, chain.bits, chain.order)
        end = [sum(series) for series in coefficients]
        z = 1.0
        if last := end[T] >= t_end:
            z = _crossing(coefficients[T], t_end)
            end = [_horner(series, z) for series in coefficients]
        lengths.append(h * z)
        nodes.append(end)
        if last:
            return nodes, lengths
        state = end
    raise Refused("WRAPPED", f"the shot takes more than {MOST_STEPS} steps")


def _horner(series: list[float], z: float) -> float:
    value = 0.0
    for coefficient in reversed(series):
        value = value * z + coefficient
    return value


def _crossing(series: list[float], level: float) -> float:
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _horner(series, middle) < level:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _float_step(state: list[float], guess: float, bits: int, order: int) -> tuple[float, list[list[float]]]:
    """A length from how fast coefficients fall, and the coefficients in z."""
    h = better = guess
    series: list[list[float]] = []
    for attempt in range(4):
        series = _float_series(state, h)
        p_size = max(abs(state[P]), h * state[R])
        sizes = [p_size, state[R], max(state[T], h * state[R]), state[R]]
        y_size = max(abs(value) / size for value, size in zip(state[4:], sizes, strict=True))
        sizes += [y_size * size for size in sizes]
        worst = max(
            (abs(part[k]) / size) ** (1.0 / k)
            for part, size in zip(series, sizes, strict=True)
            for k in (-3, -2, -1)
            for k in (len(part) + k,)
        )
        better = 2.0 ** (-bits / order) / worst * h
        if attempt and 0.5 < better / h < 2.0:
            break
        h = better
    # Few bits, so that constants are exact.
    power = exponent(better) - 6
    better_h = ldexp(int(ldexp(better, -power)), power)
    ratio = better_h / h
    return better_h, [[value * ratio**k for k, value in enumerate(part)] for part in series]


def _float_series(state: list[float], h: float) -> list[list[float]]:
    p, u, t, r, y_p, y_u, y_t, y_r = parts = [[value] for value in state]
    for k in range(FLOAT_ORDER):
        p_back, u_back, r_back = p[::-1], u[::-1], r[::-1]
        c = h / (k + 1)
        slopes = (
            u[k],
            -sum(map(mul, p_back, r)),
            r[k],
            t[k] - sum(map(mul, u_back, p)),
            y_u[k],
            -sum(map(mul, p_back, y_r)) - sum(map(mul, r_back, y_p)),
            y_r[k],
            y_t[k] - sum(map(mul, u_back, y_p)) - sum(map(mul, p_back, y_u)),
        )
        for part, slope in zip(parts, slopes, strict=True):
            part.append(c * slope)
    return parts


def _expand(chain: Chain, nodes: list[list[float]], lengths: list[float]) -> None:
    """Steps with their scales and polynomials, from nodes in floats."""
    order, bits = chain.order, chain.bits
    for k, h in enumerate(lengths):
        both = nodes[k], nodes[k + 1]
        p, t, r = (max(abs(node[part]) for node in both) for part in (P, T, R))
        scales = (
            exponent(max(p, h * r)),
            exponent(r),
            exponent(max(t, h * r)),
            exponent(r),
        )
        y_scale = exponent(max(abs(node[4 + i]) / 2.0 ** scales[i] for i in range(4) for node in both))
        step = Step((0, 0), scales, y_scale, bits)
        if k < len(lengths) - 1:
            step.h = rounded_length(h, scales)
            assert ldexp(*step.h) == h
        else:
            _set_last(step, h)
        chain.steps.append(step)
    steps, last = chain.steps, chain.steps[-1]
    scaled = [
        [ldexp(value, -(step.scales[i % 4] + (step.y_scale if i > 3 else 0))) for i, value in enumerate(node)]
        for node, step in zip(nodes, [*steps, last], strict=True)
    ]
    chain.end = [int(ldexp(value, bits)) for value in scaled[-1]]
    constants = np.array([step.real_constants() for step in steps])
    begin = np.array(scaled[:-1])
    x = _float_shots(constants, begin[:, :4], order)
    y = np.zeros((len(steps), 1, 4, order + 1))
    y[:, 0, :, 0] = begin[:, 4:]
    linear_series(constants, x, y, None)
    for k, step in enumerate(steps):
        step.x = [integers(part, bits) for part in x[k]]
        step.y = [integers(part, bits) for part in y[k, 0]]


def _columns(chain: Chain) -> Floats:
    """All steps in floats, and their columns made from those."""
    steps, bits, order = chain.steps, chain.bits, chain.order
    constants = np.array([step.real_constants() for step in steps])
    x = np.array([[floats(poly, bits, order) for poly in step.x] for step in steps])
    y = np.array([[floats(poly, bits, order) for poly in step.y] for step in steps])
    short = FLOAT_COLUMNS[0] + 1
    v, w = (np.zeros((len(steps), 4, 4, short)) for _ in range(2))
    v[:, range(4), range(4), 0] = 1.0
    linear_series(constants, x[..., :short], v, None)
    linear_series(constants, x[..., :short], w, crossed(constants, y[..., :short], v))
    for k, step in enumerate(steps):
        step.v = [[integers(part, FLOAT_COLUMNS[1]) for part in column] for column in v[k]]
        step.w = [[integers(part, FLOAT_COLUMNS[1]) for part in column] for column in w[k]]
    return Floats(constants, x, y, v, w)


def refine_columns(chain: Chain, linear: Floats) -> None:
    """Make columns of twice the digits of floats, in place.

    Parameters
    ----------
    chain : Chain
    linear : Floats
        As `find_chain` returns it.
    """
    order, bits = FINE_COLUMNS
    steps = chain.steps
    more = fmpz(1) << (bits - FLOAT_COLUMNS[1])
    x, y = linear.x[..., : order + 1], linear.y[..., : order + 1]
    for step in steps:
        step.v, step.w = ([[poly * more for poly in column] for column in columns] for columns in (step.v, step.w))
        step.column_order, step.column_bits = order, bits
    left = [column_defects(step) for step in steps]
    by = 2 * bits + chain.bits + MORE_BITS
    sources = np.array(
        [[[[floats(poly, by, order - 1) for poly in part] for part in parts] for parts in one] for one in left]
    )
    v, w = (np.zeros((len(steps), 4, 4, order + 1)) for _ in range(2))
    linear_series(linear.constants, x, v, -sources[:, :, 0])
    linear_series(linear.constants, x, w, crossed(linear.constants, y, v) - sources[:, :, 1])
    for k, step in enumerate(steps):
        for j in range(4):
            step.v[j] = [poly + integers(part, bits) for poly, part in zip(step.v[j], v[k, j], strict=True)]
            step.w[j] = [poly + integers(part, bits) for poly, part in zip(step.w[j], w[k, j], strict=True)]


def _set_last(step: Step, h: float, more: float = 0.0) -> None:
    """The last length, of as many bits as its constants hold exactly."""
    power = -(step.bits + MORE_BITS) - min(step.powers)
    old = 0
    if step.h[0]:
        shift = step.h[1] - power
        old = step.h[0] << shift if shift >= 0 else step.h[0] >> -shift
    step.h = (old + int(ldexp(h if not old else more, -power)), power)


def _float_shots(constants: Array, begin: Array, order: int) -> Array:
    """Taylor series of the shots of all steps."""
    x = np.zeros((len(begin), 4, order + 1))
    x[:, :, 0] = begin
    c = constants.T
    for k in range(order):
        back = x[:, P, k::-1]
        products_u = (back * x[:, R, : k + 1]).sum(axis=1)
        products_r = (back * x[:, U, : k + 1]).sum(axis=1)
        slopes = (
            c[0] * x[:, U, k],
            -c[1] * products_u,
            c[2] * x[:, R, k],
            c[3] * x[:, T, k] - c[1] * products_r,
        )
        for part, slope in enumerate(slopes):
            x[:, part, k + 1] = slope / (k + 1)
    return x


def _float_slopes(chain: Chain) -> Array:
    if chain.tip is not None:
        slope = bound_tip(chain.tip, binary(*chain.a), arb(0)).slope
        return np.array([[float(value.mid()), 0.0] for value in slope])
    slopes = start_slopes(arb(chain.w_f), binary(*chain.a), binary(*chain.G))
    return np.array([[float(value.mid()) for value in row] for row in slopes])


def _improve(chain: Chain, linear: Floats) -> float:
    """One step of Newton's method on all nodes and all coefficients; its size, relative."""
    steps, bits, order = chain.steps, chain.bits, chain.order
    constants, x, y, v, w = linear.constants, linear.x, linear.y, linear.v, linear.w
    by = 3 * bits + MORE_BITS
    d_x = np.array([[floats(poly, by, order - 1) for poly in own_defects(step)] for step in steps])
    d_y = np.array([[floats(p, by, order - 1) for p in defects(step, step.y, step.x, bits, bits)] for step in steps])
    xi, eta = (np.zeros((len(steps), 1, 4, order + 1)) for _ in range(2))
    linear_series(constants, x, xi, -d_x[:, None])
    linear_series(constants, x, eta, crossed(constants, y, xi) - d_y[:, None])
    xi, eta = xi[:, 0], eta[:, 0]

    sizes = np.array([_sizes(step) for step in [*steps, steps[-1]]])
    residuals, maps = [], []
    for k, step in enumerate(steps):
        ends = [sum(int(value) for value in poly.coeffs()) for poly in (*step.x, *step.y)]
        powers = [power - bits for power in step.scales]
        powers += [power + step.y_scale for power in powers]
        gaps = [binary(e, power) - value for e, power, value in zip(ends, powers, chain.node(k + 1), strict=True)]
        part = np.concatenate([xi[k].sum(axis=-1), eta[k].sum(axis=-1)]) * sizes[k]
        residuals.append(np.array([float(gap.mid()) for gap in gaps]) + part)
        a, b = v[k].sum(axis=-1).T, w[k].sum(axis=-1).T
        matrix = np.block([[a, np.zeros((4, 4))], [b, a]]) * sizes[k][:, None]
        # Columns are over what they multiply; those of y are of one scale with it.
        matrix /= sizes[k][None, :]
        maps.append(matrix)

    start = _start(chain)
    gap = np.array([float((s - node).mid()) for s, node in zip(start, chain.node(0), strict=True)])
    d, m = [gap], [_float_slopes(chain)]
    for residual, matrix in zip(residuals, maps, strict=True):
        d.append(matrix @ d[-1] + residual)
        m.append(matrix @ m[-1])
    end = chain.node(len(steps))
    misses = np.array([float(miss.mid()) for miss in end_misses(chain, end, binary(*chain.G))])
    in_state, in_unknowns = end_slopes(chain, [float(value.mid()) for value in end])
    jacobian = np.array(in_unknowns, float)
    jacobian[:, :2] += np.array(in_state) @ m[-1]
    units = np.array([ldexp(*chain.a), ldexp(*chain.G), ldexp(*steps[-1].h)])
    scaled = jacobian * units
    rows = np.abs(scaled).max(axis=1)
    if not np.isfinite(rows).all() or not rows.all():
        raise Refused("NOT_ISOLATED", "the derivative of the conditions at the fold is singular")
    right = -(misses + np.array(in_state) @ d[-1])
    try:
        step_taken = np.linalg.solve(scaled / rows[:, None], right / rows)
    except np.linalg.LinAlgError:
        raise Refused("NOT_ISOLATED", "the derivative of the conditions at the fold is singular") from None
    unknowns = step_taken * units
    moves = [shift + slopes @ unknowns[:2] for shift, slopes in zip(d, m, strict=True)]
    moves[-1] = moves[-1] + unknowns[2] * np.array(field_of([float(value.mid()) for value in end]))
    _move(chain, unknowns, moves, sizes, linear, (xi, eta))
    return float(np.abs(step_taken).max())


def _sizes(step: Step) -> list[float]:
    sizes = [2.0**power for power in step.scales]
    return sizes + [size * 2.0**step.y_scale for size in sizes]


def _move(
    chain: Chain, unknowns: Array, moves: list[Array], sizes: Array, linear: Floats, corrections: tuple[Array, Array]
) -> None:
    """Add a correction to the unknowns, the nodes and the polynomials."""
    bits, steps = chain.bits, chain.steps
    (xi, eta), v, w = corrections, linear.v, linear.w
    chain.a, chain.G = (
        (value[0] + int(ldexp(shift, -value[1])), value[1])
        for value, shift in zip((chain.a, chain.G), unknowns[:2].tolist(), strict=True)
    )
    start = _start(chain)
    short = v.shape[-1]
    stretch = unknowns[2] / ldexp(*steps[-1].h)
    for k, step in enumerate(steps):
        x_move, y_move = (moves[k] / sizes[k]).reshape(2, 4)
        # By the columns, which have fewer coefficients than the corrections.
        xi[k, :, :short] += np.einsum("j,jik->ik", x_move, v[k])
        eta[k, :, :short] += np.einsum("j,jik->ik", x_move, w[k]) + np.einsum("j,jik->ik", y_move, v[k])
        if k == len(steps) - 1:
            for part, known in ((xi, linear.x), (eta, linear.y)):
                part[k] += stretch * np.arange(chain.order + 1) * known[k]
        step.x = [poly + integers(part, bits) for poly, part in zip(step.x, xi[k], strict=True)]
        step.y = [poly + integers(part, bits) for poly, part in zip(step.y, eta[k], strict=True)]
    chain.end = [
        value + int(ldexp(shift, bits))
        for value, shift in zip(chain.end, (moves[-1] / sizes[-1]).tolist(), strict=True)
    ]
    powers = [power - bits for power in steps[0].scales]
    powers += [power + steps[0].y_scale for power in powers]
    first = [nearest(value, -power) for value, power in zip(start, powers, strict=True)]
    for polys, values in ((steps[0].x, first[:4]), (steps[0].y, first[4:])):
        for poly, value in zip(polys, values, strict=True):
            poly[0] = value
    _set_last(steps[-1], 0.0, unknowns[2])
