"""Critical speeds proved: the ladder of precisions, and the answer in decimals."""

from dataclasses import dataclass, replace
from decimal import ROUND_UP, Context, Decimal
from fractions import Fraction
from typing import Any

from towatlas.checks import check_one, check_order, check_real
from towatlas.effort import check_patience, patience
from towatlas.kernels import status as codes
from towatlas.solve.critical import solve_critical
from towatlas.solve.proof.arithmetic import Refused, arb, binary, working_bits
from towatlas.solve.proof.bounds import StepBounds
from towatlas.solve.proof.chain import Chain
from towatlas.solve.proof.finding import find_chain, refine_columns
from towatlas.solve.proof.index import zeros
from towatlas.solve.proof.krawczyk import Claim, end_hull, prove

CERTIFIED, WRAPPED, NOT_ISOLATED, NO_TRANSITION = "CERTIFIED", "WRAPPED", "NOT_ISOLATED", "NO_TRANSITION_PROVED"
# Bits and coefficients of a step that 30 digits take where nothing is ill-conditioned; and how many more are tried
# next, for conditions near thresholds may lose half of the digits.
BITS, ORDER = 133, 60
MORE = ((0, 0), (87, 30), (220, 70))
MOST_DIGITS = 200
# docs/proofs.md, Theorem 5: exactly one n-th fold for each cable longer than the threshold, any n, any w_f.
BY_THEOREM, NOT_PROVED = "by theorem", "index proved, uniqueness not"


@dataclass(frozen=True)
class Certificate:
    """What is proved about one critical speed; numbers as decimals, None where there is nothing.

    Attributes
    ----------
    lam, w_f : float
        Cable length and fish weight [-], exactly these doubles.
    n : int
        Number of the transition, >= 1.
    status : str
        CERTIFIED; NO_TRANSITION_PROVED: the cable is no longer than the threshold; WRAPPED: not proved, enclosures
        stayed too wide; NOT_ISOLATED: not proved, no such fold was found.
    gamma, R_x0, x_f : str or None
        Critical speed, radial force at the tow point, position of the fish [-].
    gamma_radius, R_x0_radius, x_f_radius : str or None
        What those are off by at most [-], > 0.
    n_proved : bool
        Whether the fold is proved to be the n-th, or that there is none.
    unique : str or None
        Why there is no other n-th fold.
    reason : str
        What was proved, or why not.
    """

    lam: float
    w_f: float
    n: int
    status: str
    gamma: str | None = None
    gamma_radius: str | None = None
    R_x0: str | None = None
    R_x0_radius: str | None = None
    x_f: str | None = None
    x_f_radius: str | None = None
    n_proved: bool = False
    unique: str | None = None
    reason: str = ""


def certify(lam: float, w_f: float, n: int = 1, *, digits: int = 30) -> Certificate:
    """The n-th critical speed of a cable in a vacuum, proved.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0; exactly this double.
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0; exactly this double.
    n : int
        Number of the transition, >= 1.
    digits : int
        Wanted of gamma, 1 to 200; the radii say what came of it.

    Returns
    -------
    Certificate

    Raises
    ------
    ValueError
        For numbers out of range.
    ImportError
        Without python-flint, of the extra `certify`.
    TooMuchWork
        If it takes longer than `towatlas.patience` allows.

    Notes
    -----
    Steps of Taylor series with exact defects, Krawczyk's operator on all of their ends at once, the index by the signs
    of q and v = df/da along the shot: docs/certify.md. Tried for n to 6, w_f to 1e4, lambda 1e-3 to 1e3 beyond the
    threshold.

    References
    ----------
    The problem: NRL Report 7048, Eqs. (29)-(33). Krawczyk: Computing 4 (1969). Arb: Johansson, IEEE Trans. Comput. 66
    (2017).

    Examples
    --------
    >>> certify(10.0, 0.0, digits=15).gamma[:16]
    '0.49288967633250'
    """
    lam, w_f = check_one("lam", lam), check_one("w_f", w_f, zero=True)
    n = int(check_order(check_one("n", n)))
    count = check_real("digits", digits)
    if count.ndim or not (1 <= count <= MOST_DIGITS and count == int(count)):
        raise ValueError(f"digits must be a whole number from 1 to {MOST_DIGITS}, got {digits!r}")
    if no_transition(lam, w_f, n):
        reason = f"lambda <= {2 * n - 1} + sqrt(1 + w_f^2) - w_f, in exact arithmetic"
        return Certificate(lam, w_f, n, NO_TRANSITION, n_proved=True, reason=reason)
    with patience():
        state = solve_critical(lam, w_f, n)
        if state.status != codes.OK:
            return Certificate(lam, w_f, n, NOT_ISOLATED, reason=codes.SENTENCES[int(state.status)])
        gamma = float(state.gamma)
        return certify_about(lam, w_f, n, abs(float(state.x_f)) * gamma**2, gamma, int(digits))


def no_transition(lam: float, w_f: float, n: int) -> bool:
    """Whether lambda <= 2 n - 1 + sqrt(1 + w_f^2) - w_f, exactly.

    Parameters
    ----------
    lam, w_f : float
        Finite [-]; no checks.
    n : int

    Returns
    -------
    bool
    """
    weight = Fraction(w_f)
    beyond = Fraction(lam) - (2 * n - 1) + weight
    return beyond <= 0 or beyond**2 <= 1 + weight**2


def certify_about(lam: float, w_f: float, n: int, a: float, gamma: float, digits: int) -> Certificate:
    """The same about a fold known in floats; no checks.

    Parameters
    ----------
    lam, w_f : float
    n : int
    a, gamma : float
        Offset of the fish gamma^2 |x_f| and speed [-], > 0.
    digits : int

    Returns
    -------
    Certificate
    """
    base = max(BITS, int(3.33 * digits) + 33)
    found = Certificate(lam, w_f, n, WRAPPED)
    for more, terms in MORE:
        check_patience("proving a critical speed", "a longer cable (lam) is farther from its threshold")
        try:
            with working_bits(base + more + 64):
                chain, floats = find_chain(lam, w_f, n, a, gamma, base + more, ORDER * base // BITS + terms)
                try:
                    proof = prove(chain)
                except Refused:
                    refine_columns(chain, floats)
                    proof = prove(chain)
                found = answer(chain, *proof, digits)
        except Refused as refused:
            if found.status != CERTIFIED:
                found = Certificate(lam, w_f, n, refused.status, reason=str(refused))
            continue
        if _reached(found, digits):
            break
    return found


def answer(chain: Chain, claim: Claim, steps: list[StepBounds], digits: int) -> Certificate:
    """What a claim says that is proved, with the index of its fold.

    Parameters
    ----------
    chain : Chain
    claim : Claim
        Verified.
    steps : list of StepBounds
        What `verify` returns.
    digits : int

    Returns
    -------
    Certificate

    Raises
    ------
    Refused
        If the index is another, or cannot be told.
    """
    with working_bits(chain.bits + 64):
        either = arb(0, 1)
        a, G = (
            binary(*value) + radius * either
            for value, radius in zip((chain.a, chain.G), claim.unknowns[:2], strict=True)
        )
        if not (a > 0 and G > 0):
            raise Refused(NOT_ISOLATED, "the offset of the fish or the speed is not proved to be positive")
        index = zeros(chain, claim, steps)
        if index != chain.n:
            raise Refused(NOT_ISOLATED, f"this fold has index {index}, not {chain.n}")
        u = end_hull(chain, claim)[1]
        parts = [G.sqrt(), -chain.sign * u / G, chain.sign * a / G]
        texts = [text for part in parts for text in decimal(part, digits)]
    names = ("gamma", "gamma_radius", "R_x0", "R_x0_radius", "x_f", "x_f_radius")
    numbers: dict[str, Any] = dict(zip(names, texts, strict=True))
    reason = f"a fold in a box about it, the zero number {index} of q on its shot; nothing is proved between such boxes"
    made = Certificate(chain.lam, chain.w_f, chain.n, CERTIFIED, n_proved=True, unique=BY_THEOREM, reason=reason)
    return replace(made, **numbers)


def _reached(found: Certificate, digits: int) -> bool:
    """Whether gamma is as good as asked for."""
    return Decimal(found.gamma_radius or "inf") <= Decimal(found.gamma or "nan") * Decimal(10) ** -digits


def decimal(value: arb, digits: int) -> tuple[str, str]:
    """A ball as a decimal, and what that is off by at most, rounded up.

    Parameters
    ----------
    value : arb
    digits : int
        Six more are written.

    Returns
    -------
    tuple of str
    """
    middle, radius = (_fraction(part) for part in (value.mid(), value.rad()))
    near = Context(prec=digits + 6).divide(Decimal(middle.numerator), Decimal(middle.denominator))
    off = radius + abs(Fraction(near) - middle)
    up = Context(prec=4, rounding=ROUND_UP)
    return str(near), str(up.divide(Decimal(off.numerator), Decimal(off.denominator)))


def _fraction(value: arb) -> Fraction:
    mantissa, power = (int(part) for part in value.man_exp())
    return Fraction(mantissa) * Fraction(2) ** power
