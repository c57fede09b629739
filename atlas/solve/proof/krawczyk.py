"""The proof: Krawczyk's operator on all nodes of a chain at once.

Unknowns are a, G = gamma^2, what sigma lacks at the end, and the states at all nodes; conditions that each node is
what the step before it leads to, that the first is what the fish asks for, and the three at the end. About the
centre U~ with conditions g and any invertible matrix L,

    |N(U) - U~| <= |L^-1| (|g(U~)| + |L - g'(box)| delta)   for N(U) = U - L^-1 g(U) and U within delta of U~,

so that N maps the box into itself, and thus has a fixed point there, which is a solution, if the right side is at most
delta. Steps are taken apart, from exact nodes: nothing wraps. L^-1 is never formed; with P_i the exact product of the
matrices of the first i steps its rows are sums of P_i P_k^-1, enclosed in balls.
"""

from dataclasses import dataclass

from towatlas.solve.proof.arithmetic import Refused, arb, arb_mat, binary, fmpz, up, working_bits
from towatlas.solve.proof.bounds import StepBounds, bound_step, largest
from towatlas.solve.proof.chain import Chain, end_misses, end_slopes, field_of, start_slopes, start_state
from towatlas.solve.proof.tip import bound_tip

EITHER = arb(0, 1)


@dataclass(frozen=True)
class Claim:
    """What is claimed about a chain.

    Attributes
    ----------
    tails : list of pair of arb
        For each step bounds of the defects of the shot and of its derivative.
    unknowns : list of arb
        Radii of the box in a, G and sigma.
    nodes : list of list of arb
        Radii at each node, of p, u, t, r and the same of y.
    """

    tails: list[tuple[arb, arb]]
    unknowns: list[arb]
    nodes: list[list[arb]]


@dataclass(frozen=True)
class _Pieces:
    """The conditions at the centre and L, in balls."""

    steps: list[StepBounds]
    gaps: list[list[arb]]
    misses: list[arb]
    slopes: list[list[arb]]
    maps: list[arb_mat]
    inverses: list[arb_mat]
    jacobian: arb_mat
    at_end: arb_mat


def _matrix(chain: Chain, k: int) -> arb_mat:
    """The matrix of step k, exactly: derivatives of the state and y at its end in those at its beginning."""
    step = chain.steps[k]
    rows = [[arb(0)] * 8 for _ in range(8)]
    scales = step.scales
    for j in range(4):
        for i in range(4):
            if step.v[j][i][0] != (1 << step.column_bits if i == j else 0) or step.w[j][i][0] != 0:
                raise Refused("WRAPPED", f"the columns of step {k} do not begin as derivatives do")
            first = sum(step.v[j][i].coeffs(), fmpz(0))
            second = sum(step.w[j][i].coeffs(), fmpz(0))
            power = scales[i] - scales[j] - step.column_bits
            rows[i][j] = rows[4 + i][4 + j] = binary(first, power)
            rows[4 + i][j] = binary(second, power + step.y_scale)
    return arb_mat(rows)


def _ends(chain: Chain, k: int, bounds: StepBounds) -> list[arb]:
    """Where step k leads to from its exact beginning."""
    step, bits = chain.steps[k], chain.bits
    x_off, y_off = bounds.off(arb(0), arb(0))
    made = []
    for polys, off, more in ((step.x, x_off, 0), (step.y, y_off, step.y_scale)):
        for poly, power in zip(polys, step.scales, strict=True):
            total = binary(sum(poly.coeffs(), fmpz(0)), power + more - bits)
            made.append(total + EITHER * off * binary(1, power + more))
    return made


# Products of many exact matrices lose up to so many bits a step.
BITS_A_STEP = 4


def _precise(chain: Chain):
    return working_bits(chain.bits + 64 + BITS_A_STEP * len(chain.steps))


def _pieces(chain: Chain, steps: list[StepBounds]) -> _Pieces:
    if (chain.tip is None) == (chain.w_f == 0.0):
        raise Refused("WRAPPED", "a bare tip, and no other, begins with a piece of its own")
    a, G = binary(*chain.a), binary(*chain.G)
    if chain.tip is not None:
        tip = bound_tip(chain.tip, a, arb(0))
        start, slopes = tip.value, [[value.mid(), arb(0)] for value in tip.slope]
    else:
        w_f = arb(chain.w_f)
        start = start_state(w_f, a, G)
        slopes = [[value.mid() for value in row] for row in start_slopes(w_f, a, G)]
    count = len(chain.steps)
    nodes = [chain.node(k) for k in range(count + 1)]
    gaps = [[node - value for node, value in zip(nodes[0], start, strict=True)]]
    maps, inverses = [_unit()], [_unit()]
    for k in range(count):
        ends = _ends(chain, k, steps[k])
        gaps.append([node - value for node, value in zip(nodes[k + 1], ends, strict=True)])
        product = _matrix(chain, k) * maps[-1]
        maps.append(product)
        try:
            inverses.append(_inverse(product))
        except ZeroDivisionError:
            raise Refused("WRAPPED", f"the product of the first {k + 1} steps is not proved invertible") from None
    misses = end_misses(chain, nodes[-1], G)
    in_state, in_unknowns = end_slopes(chain, nodes[-1])
    state = arb_mat([[arb(value) for value in row] for row in in_state])
    at_end = state * maps[-1]
    through = at_end * arb_mat(slopes)
    jacobian = [[through[i, j] + in_unknowns[i][j] for j in range(2)] + [arb(in_unknowns[i][2])] for i in range(3)]
    return _Pieces(steps, gaps, misses, slopes, maps, inverses, arb_mat(jacobian), at_end)


def _unit() -> arb_mat:
    return arb_mat([[arb(int(i == j)) for j in range(8)] for i in range(8)])


def _inverse(product: arb_mat) -> arb_mat:
    """Of a matrix of blocks [[A, 0], [W, A]]."""
    a = arb_mat([[product[i, j] for j in range(4)] for i in range(4)])
    w = arb_mat([[product[4 + i, j] for j in range(4)] for i in range(4)])
    inverse = a.inv()
    corner = inverse * w * inverse
    rows = [[arb(0)] * 8 for _ in range(8)]
    for i in range(4):
        for j in range(4):
            rows[i][j] = rows[4 + i][4 + j] = inverse[i, j]
            rows[4 + i][j] = -corner[i, j]
    return arb_mat(rows)


def _absolute(matrix: arb_mat) -> arb_mat:
    return arb_mat(matrix.nrows(), matrix.ncols(), [up(value) for value in matrix.entries()])


def _apply(pieces: _Pieces, gaps: list[list[arb]], misses: list[arb]) -> tuple[list[arb], list[list[arb]]]:
    """|L^-1| on bounds of the conditions: bounds of the unknowns and of all nodes."""
    collected = arb_mat(8, 1)
    so_far = []
    for inverse, gap in zip(pieces.inverses, gaps, strict=True):
        collected = _absolute(collected + _absolute(inverse) * arb_mat([[up(value)] for value in gap]))
        so_far.append(collected)
    try:
        inverse = pieces.jacobian.inv()
    except ZeroDivisionError:
        raise Refused("NOT_ISOLATED", "the derivative of the conditions at the fold may be singular") from None
    from_end = _absolute(inverse * pieces.at_end) * collected
    unknowns = _absolute(_absolute(inverse) * arb_mat([[up(value)] for value in misses]) + from_end)
    two = arb_mat([[unknowns[0, 0]], [unknowns[1, 0]]])
    slopes = arb_mat(pieces.slopes)
    nodes = []
    for product, collected in zip(pieces.maps, so_far, strict=True):
        moved = _absolute(product * slopes) * two + _absolute(product) * collected
        nodes.append([up(value) for value in moved.entries()])
    return unknowns.entries(), nodes


def spread(chain: Chain, k: int, radii: list[arb]) -> tuple[arb, arb]:
    """The radii at the beginning of a step over its scales.

    Parameters
    ----------
    chain : Chain
    k : int
    radii : list of arb
        Eight.

    Returns
    -------
    tuple of arb
        Of the state and of y.
    """
    step = chain.steps[k]
    x = [radii[i] * binary(1, -step.scales[i]) for i in range(4)]
    y = [radii[4 + i] * binary(1, -step.scales[i] - step.y_scale) for i in range(4)]
    return largest(x), largest(y)


def _slack(chain: Chain, pieces: _Pieces, claim: Claim) -> tuple[list[list[arb]], list[arb]]:
    """|L - g'(box)| delta, condition by condition."""
    a, G, _ = (
        value + EITHER * radius
        for value, radius in zip((binary(*chain.a), binary(*chain.G), arb(0)), claim.unknowns, strict=True)
    )
    if chain.tip is not None:
        slopes = [[value, arb(0)] for value in bound_tip(chain.tip, binary(*chain.a), claim.unknowns[0]).slope]
    else:
        slopes = start_slopes(arb(chain.w_f), a, G)
    slack = [
        [
            up(sum((up(row[j] - centre[j]) * claim.unknowns[j] for j in range(2)), arb(0)))
            for row, centre in zip(slopes, pieces.slopes, strict=True)
        ]
    ]
    for k, bounds in enumerate(pieces.steps):
        rho, y_rho = spread(chain, k, claim.nodes[k])
        bounds.off(rho, y_rho)
        g, beta = bounds.growth, bounds.beta
        curved, turned = 2 * beta * g**2, 12 * beta**2 * g**3
        column = 4 * bounds.column + curved * rho
        x = column * rho
        y = column * y_rho + (4 * bounds.second + turned * rho * (bounds.y_size + y_rho) + curved * y_rho) * rho
        step = chain.steps[k]
        slack.append(
            [up(x * binary(1, power)) for power in step.scales]
            + [up(y * binary(1, power + step.y_scale)) for power in step.scales]
        )
    return slack, _end_slack(chain, claim)


def end_hull(chain: Chain, claim: Claim) -> list[arb]:
    """All that is reached from the box at the last node within the radius of sigma.

    Parameters
    ----------
    chain : Chain
    claim : Claim

    Returns
    -------
    list of arb
        The state and its derivative.

    Raises
    ------
    Refused
        If slopes may lead out of it.
    """
    centre, span = chain.node(len(chain.steps)), claim.unknowns[2]
    about = [value + EITHER * radius for value, radius in zip(centre, claim.nodes[-1], strict=True)]
    least = binary(1, -2 * chain.bits)
    reach = [up(2 * span * slope + least * value) for slope, value in zip(field_of(about), about, strict=True)]
    hull = [value + EITHER * radius for value, radius in zip(about, reach, strict=True)]
    if not all(span * up(slope) <= radius for slope, radius in zip(field_of(hull), reach, strict=True)):
        raise Refused("WRAPPED", "the end of the cable is not enclosed")
    return hull


def _end_slack(chain: Chain, claim: Claim) -> list[arb]:
    """The same for the three conditions at the end."""
    centre, span = chain.node(len(chain.steps)), claim.unknowns[2]
    hull = end_hull(chain, claim)
    # |derivative of the flow over so short a time - 1| <= exp(span |F'|) - 1.
    flow = (_absolute(_slopes_of_field(hull)) * span).exp() - _unit()
    in_state, in_unknowns = end_slopes(chain, hull)
    at_state, at_unknowns = end_slopes(chain, centre)
    made = []
    for i in range(3):
        total = sum((up(arb(in_unknowns[i][j]) - arb(at_unknowns[i][j])) * claim.unknowns[j] for j in range(3)), arb(0))
        for j in range(8):
            moved = sum((up(arb(in_state[i][m])) * up(flow[m, j]) for m in range(8)), arb(0))
            total += (up(arb(in_state[i][j]) - arb(at_state[i][j])) + moved) * claim.nodes[-1][j]
        made.append(up(total))
    return made


def _slopes_of_field(x: list[arb]) -> arb_mat:
    """Derivatives of the slopes of a state and its derivative."""
    p, u, _, r, y_p, y_u, _, y_r = x
    zero, one = arb(0), arb(1)
    a = [[zero, one, zero, zero], [-r, zero, zero, -p], [zero, zero, zero, one], [-u, -p, one, zero]]
    b = [[zero] * 4, [-y_r, zero, zero, -y_p], [zero] * 4, [-y_u, -y_p, zero, zero]]
    return arb_mat([[*row, *[zero] * 4] for row in a] + [[*left, *right] for left, right in zip(b, a, strict=True)])


def _claim(chain: Chain, pieces: _Pieces) -> Claim:
    """What may be claimed about a chain: twice what Newton's method moves, and tails as they are."""
    unknowns, nodes = _apply(pieces, pieces.gaps, pieces.misses)
    # Where nothing moves there must be some room all the same.
    least = binary(1, -chain.bits)
    sizes = (binary(*chain.a), binary(*chain.G), binary(*chain.steps[-1].h))
    room = [up(2 * value + least * up(size)) for value, size in zip(unknowns, sizes, strict=True)]
    wide = []
    for k, radii in enumerate(nodes):
        step = chain.steps[min(k, len(chain.steps) - 1)]
        powers = [*step.scales, *(power + step.y_scale for power in step.scales)]
        wide.append([up(2 * value + least * binary(1, power)) for value, power in zip(radii, powers, strict=True)])
    return Claim([(bounds.tail, bounds.y_tail) for bounds in pieces.steps], room, wide)


def _check(chain: Chain, claim: Claim, pieces: _Pieces) -> None:
    """That N maps the box into itself, and contracts there."""
    slack, end_slack = _slack(chain, pieces, claim)
    gaps = [[up(a) + b for a, b in zip(*pair, strict=True)] for pair in zip(pieces.gaps, slack, strict=True)]
    misses = [up(a) + b for a, b in zip(pieces.misses, end_slack, strict=True)]
    unknowns, nodes = _apply(pieces, gaps, misses)
    moved = [*unknowns, *(value for node in nodes for value in node)]
    radii = [*claim.unknowns, *(value for node in claim.nodes for value in node)]
    if not all(a < b for a, b in zip(moved, radii, strict=True)):
        raise Refused("WRAPPED", "Newton's method does not map the box into itself")


def prove(chain: Chain) -> tuple[Claim, list[StepBounds]]:
    """A claim about a chain, proved: exactly one solution of all conditions in its box.

    Parameters
    ----------
    chain : Chain

    Returns
    -------
    claim : Claim
    steps : list of StepBounds
        Of each step.

    Raises
    ------
    Refused
        If there is none that can be proved.
    """
    with _precise(chain):
        pieces = _pieces(chain, [bound_step(step) for step in chain.steps])
        claim = _claim(chain, pieces)
        _check(chain, claim, pieces)
    return claim, pieces.steps


def verify(chain: Chain, claim: Claim) -> list[StepBounds]:
    """Prove a claim made elsewhere.

    Parameters
    ----------
    chain : Chain
    claim : Claim

    Returns
    -------
    list of StepBounds
        Of each step.

    Raises
    ------
    Refused
        If it is not proved.
    """
    with _precise(chain):
        steps = [bound_step(step) for step in chain.steps]
        for k, (bounds, (tail, y_tail)) in enumerate(zip(steps, claim.tails, strict=True)):
            if not (bounds.tail <= tail and bounds.y_tail <= y_tail):
                raise Refused("WRAPPED", f"the tail of step {k} is larger than claimed")
        _check(chain, claim, _pieces(chain, steps))
    return steps
