"""One step of each method: the classical Runge-Kutta step forward, the Taylor step from the fish up.

The Taylor step solves, with ' = d/d(sigma) and H = r + p^2 / 2,

    p'' = -p r,   H'' = r,   r = H - p^2 / 2,   f = -p',   t = H'

so that a coefficient costs 1.5 convolutions, and its first variation (q, h, g for p, H, r) three more. It is written
out as straight-line code: loops over the order do not vectorise across lanes, this does.
"""

from math import sqrt
from typing import Any

import numpy as np

from towatlas.kernels.calls import ORDER, TRUNCATION
from towatlas.kernels.compiling import inlined
from towatlas.kernels.vacuum import forward_slopes, inverse_root_guess

# So many forward shots at once, and where in their work array each quantity of them is: weight of the fish, gamma^2
# and the length of a step; the others change.
FORWARD_LANES = 32
X, FORCE, FISH, GAMMA2, DS, DX, DFORCE, SUM_DX, SUM_DFORCE = (FORWARD_LANES * place for place in range(9))
FORWARD_WORK = FORWARD_LANES * 9
# Sums of products in the Taylor step: from this order on in two chains, but for the last so many.
SPLIT_FROM, NEWEST = 5, 4


@inlined
def _forward_slopes(work, lane, left, part):
    """Slopes of x and R_x of a lane, `part` of its step down the cable by the slopes of before."""
    h = part * work[DS + lane]
    x, force = work[X + lane] + h * work[DX + lane], work[FORCE + lane] + h * work[DFORCE + lane]
    return forward_slopes(x, force, work[FISH + lane] + left * work[DS + lane] - h, work[GAMMA2 + lane])


@inlined
def _inner_slopes(work, left):
    """Those in the middle of the step, and their share of the sums."""
    for lane in range(FORWARD_LANES):
        dx, dforce = _forward_slopes(work, lane, left, 0.5)
        work[DX + lane] = dx
        work[DFORCE + lane] = dforce
        work[SUM_DX + lane] += 2.0 * dx
        work[SUM_DFORCE + lane] += 2.0 * dforce


@inlined
def rk4_forward(work, left):
    """One classical Runge-Kutta step of Eqs. (29a, b) (NRL Report 7048), all lanes; `left` of them lead to the fish.

    One slope of all lanes after the other: a slope waits for the one before it, and meanwhile there are other lanes.
    """
    for lane in range(FORWARD_LANES):
        below = work[FISH + lane] + left * work[DS + lane]
        dx, dforce = forward_slopes(work[X + lane], work[FORCE + lane], below, work[GAMMA2 + lane])
        work[DX + lane] = dx
        work[DFORCE + lane] = dforce
        work[SUM_DX + lane] = dx
        work[SUM_DFORCE + lane] = dforce
    _inner_slopes(work, left)
    _inner_slopes(work, left)
    for lane in range(FORWARD_LANES):
        dx, dforce = _forward_slopes(work, lane, left, 1.0)
        # Times, not over: the division unit would be what these shots wait for.
        sixth = work[DS + lane] * (1.0 / 6.0)
        work[X + lane] += sixth * (work[SUM_DX + lane] + dx)
        work[FORCE + lane] += sixth * (work[SUM_DFORCE + lane] + dforce)


@inlined
def _log2(x):
    # From the bits of the number: within 0.09, and it vectorises. It only feeds the choice of a step.
    return np.float64(np.float64(x).view(np.int64)) * 2.0**-52 - 1023.0


@inlined
def _exp2(y):
    return np.int64((y + 1023.0) * 2.0**52).view(np.float64)


def _convolution(a: str, b: str, k: int) -> str:
    # Oldest coefficients first: the sum is a chain of dependent additions, and the newest, ready last, must not hold up
    # the rest of it. Long ones are two chains, which the newest follow.
    terms = [f"{a}{j} * {b}{k - j}" for j in sorted(range(k + 1), key=lambda j: max(j, k - j))]
    if k < SPLIT_FROM:
        return " + ".join(terms)
    old, new = terms[:-NEWEST], terms[-NEWEST:]
    return " + ".join([f"({' + '.join(old[::2])})", f"({' + '.join(old[1::2])})", *new])


def _half_square(a: str, k: int) -> str:
    terms = [f"0.5 * {a}{k // 2} * {a}{k // 2}"] if k % 2 == 0 else []
    return " + ".join(terms + [f"{a}{j} * {a}{k - j}" for j in range((k - 1) // 2, -1, -1)])


def _horner(coefficients: list[str], variable: str) -> str:
    text = coefficients[-1]
    for c in reversed(coefficients[:-1]):
        text = f"({text}) * {variable} + {c}"
    return text


def taylor_source(order: int) -> str:
    """Source text of `taylor_step` of the given order."""
    n = order
    lines = [
        "def taylor_step(t, f, p, v, q, h_forced):",
        "r0 = sqrt(t * t + f * f)",
        "inverse_r = 1.0 / r0",
        "p0 = p",
        "p1 = -f",
        "q0 = q",
        "q1 = -v",
        "H1 = t",
        "r1 = t + f * p",
        "g0 = f * v * inverse_r",
        "g1 = v * p + f * q",
    ]
    for k in range(2, n + 1):
        c = repr(1.0 / (k * (k - 1)))
        lines += [
            f"p{k} = -{c} * ({_convolution('p', 'r', k - 2)})",
            f"q{k} = -{c} * ({_convolution('q', 'r', k - 2)} + {_convolution('p', 'g', k - 2)})",
            f"H{k} = {c} * r{k - 2}",
            f"h{k} = {c} * g{k - 2}",
        ]
        if k <= n - 2:
            lines += [
                f"r{k} = H{k} - ({_half_square('p', k)})",
                f"g{k} = h{k} - ({_convolution('p', 'q', k)})",
            ]

    def slope(name: str, first: int) -> str:
        return _horner([f"{float(k)} * {name}{k}" for k in range(first, n + 1)], "h")

    def value(name: str, first: int) -> str:
        return _horner([f"{name}{k}" for k in range(first, n + 1)], "h")

    lines += [
        "amplitude2 = p * p + f * f * inverse_r",
        "scale_p = inverse_root_guess(amplitude2)",
        "scale_q = inverse_root_guess(q * q + v * v * inverse_r)",
        "scale_h = inverse_r * scale_q * scale_p * amplitude2",
        *(
            f"size{k} = max(max(abs(p{k}) * scale_p, abs(H{k}) * inverse_r), "
            f"max(abs(q{k}) * scale_q, abs(h{k}) * scale_h))"
            for k in (n - 1, n)
        ),
        f"h = _exp2(min((LOG2_TRUNCATION - _log2(size{n - 1})) / {float(n - 1)}, "
        f"(LOG2_TRUNCATION - _log2(size{n})) / {float(n)}))",
        "h = h_forced if h_forced != 0.0 else h",
        f"dt = h * ({slope('H', 2)})",
        f"dz = h * ({value('H', 1)})",
        f"pe = {value('p', 0)}",
        f"fe = -({slope('p', 1)})",
        # The variation comes out at fixed sigma; dt_da h is the shift in t it carries, taken out to stay at fixed t.
        f"dt_da = h * ({slope('h', 2)})",
        f"qe = {value('q', 0)}",
        f"ve = -({slope('q', 1)}) - pe * dt_da",
        "te = t + dt",
        "qe = qe + fe / sqrt(te * te + fe * fe) * dt_da",
        "return dt, dz, fe, pe, ve, qe, h",
    ]
    return "\n    ".join(lines) + "\n"


def make_taylor_step(order: int) -> Any:
    """Compile the Taylor step of the given order.

    taylor_step(t, f, p, v, q, h_forced) -> (dt, dz, f, p, v, q, h): one step of length h in sigma, chosen from the
    last two coefficients, or h_forced unless that is zero. Local error: rounding, of the amplitude of p.
    """
    namespace: dict[str, Any] = {
        "sqrt": sqrt,
        "_log2": _log2,
        "_exp2": _exp2,
        "inverse_root_guess": inverse_root_guess,
        "LOG2_TRUNCATION": float(np.log2(TRUNCATION)),
    }
    # Under this file's name, so that the cache of compiled kernels has a source to look at.
    exec(compile(taylor_source(order), __file__, "exec"), namespace)
    return inlined(namespace["taylor_step"])


taylor_step = make_taylor_step(ORDER)
