"""The number of a fold, proved: the zeros of q on the shot to it.

With Q = r q = r y_p - u y_t and V = -v = y_u + p y_t (v = df/da, q = dp/da at equal t) dq/dt = -(t^2 / r^3) v: at every
zero of q it crosses in the direction that the sign of v says. So a piece on which v does not vanish has one zero of q
if q has different signs at its ends, and none if not; pieces on which q does not vanish have none.
"""

from towatlas.solve.proof.arithmetic import Refused, arb, arb_poly, binary, up, working_bits
from towatlas.solve.proof.bounds import StepBounds
from towatlas.solve.proof.chain import Chain
from towatlas.solve.proof.krawczyk import Claim, end_hull, spread
from towatlas.solve.proof.taylor import P, R, T, U

# Signs need few digits.
BITS = 128
# Halvings of a step.
DEEPEST = 24


def zeros(chain: Chain, claim: Claim, steps: list[StepBounds]) -> int:
    """Number of zeros of q from the fish to the end of a verified chain: of a fold, that at the end included.

    Parameters
    ----------
    chain : Chain
    claim : Claim
        Verified.
    steps : list of StepBounds
        What `verify` returns.

    Returns
    -------
    int

    Raises
    ------
    Refused
        If signs cannot be told.
    """
    # Beyond z = 1 of the last step a shot of the box may go on, as far as sigma is not known.
    hull = end_hull(chain, claim)
    q_end, v_end = hull[R] * hull[4 + P] - hull[U] * hull[4 + T], hull[4 + U] + hull[P] * hull[4 + T]
    fold = chain.speed is None
    if not ((v_end if fold else q_end) != 0):
        raise Refused("WRAPPED", "the sign at the end of the cable is not proved")
    if not claim.unknowns[2] < binary(chain.steps[-1].h[0], chain.steps[-1].h[1] - DEEPEST - 1):
        raise Refused("WRAPPED", "the end of the cable is not proved to lie in the last piece")
    with working_bits(BITS):
        count = 0
        for k, bounds in enumerate(steps):
            q, v = _polynomials(chain, k, bounds.off(*spread(chain, k, claim.nodes[k])))
            count += _count(q, v, arb(0), arb(1), fold and k == len(steps) - 1, k)
    return count


def _polynomials(chain: Chain, k: int, off: tuple[arb, arb]):
    """Functions that enclose Q and V on a piece of step k, for all shots of the box; scaled."""
    step = chain.steps[k]
    unit = binary(1, -step.bits)
    either = arb(0, 1)
    x = [(arb_poly(poly) * unit, off[0] * either) for poly in step.x]
    y = [(arb_poly(poly) * unit, off[1] * either) for poly in step.y]
    s_p, _, s_t, s_r = (binary(1, power) for power in step.scales)
    q = x[R][0] * y[P][0] * (s_r * s_p) - x[U][0] * y[T][0] * (s_r * s_t)
    v = y[U][0] * s_r + x[P][0] * y[T][0] * (s_p * s_t)

    def size(poly):
        return sum((up(value) for value in poly.coeffs()), arb(0))

    def error(first, second, scale):
        return scale * (off[0] * size(second) + off[1] * size(first) + off[0] * off[1])

    q_error = up(error(x[R][0], y[P][0], s_r * s_p) + error(x[U][0], y[T][0], s_r * s_t))
    v_error = up(s_r * off[1] + error(x[P][0], y[T][0], s_p * s_t))
    return (lambda z: q(z) + q_error * either), (lambda z: v(z) + v_error * either)


def _count(q, v, low: arb, high: arb, last: bool, k: int, depth: int = 0) -> int:
    """Zeros of q between; `last`: the piece ends in the zero that was proved."""
    piece = (low + high) / 2 + arb(0, 1) * (high - low) / 2
    if not last and q(piece) != 0:
        return 0
    if v(piece) != 0:
        ends = [q(low)] if last else [q(low), q(high)]
        if all(value != 0 for value in ends):
            return 1 if last or (ends[0] > 0) != (ends[1] > 0) else 0
    if depth == DEEPEST:
        raise Refused("WRAPPED", f"zeros of q on step {k} cannot be told apart")
    middle = (low + high) / 2
    return _count(q, v, low, middle, False, k, depth + 1) + _count(q, v, middle, high, last, k, depth + 1)
