"""All equilibria of one cable at one speed, proved: each root, and that there are no others."""

from dataclasses import dataclass
from fractions import Fraction

from towatlas.checks import check_one
from towatlas.effort import check_patience, patience
from towatlas.solve.equilibria import equilibria
from towatlas.solve.proof.arithmetic import Refused, arb, binary, working_bits
from towatlas.solve.proof.certificates import (
    BITS,
    BY_THEOREM,
    CERTIFIED,
    MORE,
    NO_TRANSITION,
    NOT_ISOLATED,
    ORDER,
    certify,
    decimal,
)
from towatlas.solve.proof.covering import cover as cover_offsets
from towatlas.solve.proof.finding import find_chain, refine_columns
from towatlas.solve.proof.index import zeros
from towatlas.solve.proof.krawczyk import end_hull, prove

DIGITS = 30
BY_COVERING = "by covering"


@dataclass(frozen=True)
class CertifiedState:
    """One equilibrium proved; decimals and what they are off by at most.

    Attributes
    ----------
    branch : str
        Its pair, as "2 inner"; "outward" for the one without a pair.
    R_x0, R_x0_radius, x_f, x_f_radius : str
        Radial force at the tow point, position of the fish [-], each with its radius, > 0.
    """

    branch: str
    R_x0: str
    R_x0_radius: str
    x_f: str
    x_f_radius: str


@dataclass(frozen=True)
class CertifiedEquilibria:
    """What is proved about all equilibria of a cable.

    Attributes
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-], exactly these doubles.
    status : str
        CERTIFIED if each was proved and there are no others; else WRAPPED or NOT_ISOLATED.
    states : tuple of CertifiedState
        In rising order of R_x0, those proved.
    passed : int or None
        Number of critical speeds below gamma, proved; then there are 1 + 2 passed equilibria.
    count : str or None
        Why there are no others: "by theorem", "by covering" or "by theorem and by covering"; None if not CERTIFIED.
    reason : str
        What was proved, or why not.
    """

    lam: float
    w_f: float
    gamma: float
    status: str
    states: tuple[CertifiedState, ...]
    passed: int | None
    count: str | None
    reason: str


def certify_equilibria(lam: float, w_f: float, gamma: float, *, cover: bool = False) -> CertifiedEquilibria:
    """All equilibria of a cable in a vacuum at one speed, proved, and their number.

    Parameters
    ----------
    lam, w_f : float
        Cable length, > 0, and fish weight, >= 0 [-]; exactly these doubles.
    gamma : float
        Speed [-], > 0; exactly this double.
    cover : bool
        Whether to prove their number by a covering of all offsets of the fish besides: seconds, minutes where there are
        many. Where it gives up, and the theorem holds, `reason` says so.

    Returns
    -------
    CertifiedEquilibria

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
    Roots as folds are proved, with gamma given in place of q = 0. Their number is 1 + 2 #{n: gamma > gamma_cn} by
    theorem (docs/proofs.md, Theorem 6), and gamma_c1 < gamma_c2 < ... are certified until one lies above gamma or the
    cable has no more. Members of pair n have the sign (-1)^n at the fish and n - 1 (outer) or n zeros of q (inner). A
    covering uses no theorem on their number: docs/certify.md.

    References
    ----------
    NRL Report 7048, Eqs. (29)-(33).

    Examples
    --------
    >>> certify_equilibria(2.0, 0.0, 1.0).states[0].R_x0[:12]
    '3.8194579663'
    """
    lam, w_f, gamma = check_one("lam", lam), check_one("w_f", w_f, zero=True), check_one("gamma", gamma)
    with patience():
        found = equilibria(lam, w_f, gamma)
        states, reasons = [], []
        for branch, x_f in zip(found.branch, found.x_f, strict=True):
            check_patience("proving equilibria", "a lower speed (gamma) has fewer")
            try:
                states.append(_state(lam=lam, w_f=w_f, gamma=gamma, branch=str(branch), x_f=float(x_f)))
            except Refused as refused:
                reasons.append((refused.status, f"{branch}: {refused}"))
        passed, why = _passed(lam=lam, w_f=w_f, gamma=gamma)
        ways = [(BY_THEOREM, None if passed is None else 1 + 2 * passed, why)]
        if cover:
            ways.append((BY_COVERING, *_covered(lam=lam, w_f=w_f, gamma=gamma)))
    count, why = _count(ways)
    reasons += [] if count else [(NOT_ISOLATED, why)]
    for _, number, _ in ways:
        if not reasons and number not in (None, len(states)):
            reasons.append((NOT_ISOLATED, f"{len(states)} equilibria are proved, of {number}"))
    if reasons:
        status, why = reasons[0]
        return CertifiedEquilibria(lam, w_f, gamma, status, tuple(states), passed, None, why)
    return CertifiedEquilibria(lam, w_f, gamma, CERTIFIED, tuple(states), passed, count, f"all of them, {why}")


def _count(ways: list[tuple[str, int | None, str]]) -> tuple[str | None, str]:
    """By which ways the number is known, and what each says."""
    done = [way for way, number, _ in ways if number is not None]
    said = "; ".join(f"{way}: {why}" for way, _, why in ways)
    return " and ".join(done) or None, said


def _covered(*, lam: float, w_f: float, gamma: float) -> tuple[int | None, str]:
    try:
        found = cover_offsets(lam=lam, w_f=w_f, gamma=gamma)
    except Refused as refused:
        return None, f"not proved, {refused}"
    return found.roots, f"{found.roots} roots on {found.ranges} ranges of offsets"


def _state(*, lam: float, w_f: float, gamma: float, branch: str, x_f: float) -> CertifiedState:
    name = branch.split()
    n = int(name[0]) if len(name) == 2 else 0
    refusal = Refused(NOT_ISOLATED, "not tried")
    for more, terms in MORE:
        try:
            with working_bits(BITS + more + 64):
                a, bits, order = abs(x_f) * gamma**2, BITS + more, ORDER + terms
                chain, floats = find_chain(lam=lam, w_f=w_f, gamma=gamma, n=n, a=a, bits=bits, order=order, fixed=True)
                try:
                    claim, steps = prove(chain)
                except Refused:
                    refine_columns(chain, floats)
                    claim, steps = prove(chain)
                index = zeros(chain, claim, steps)
                if index != n - (name[-1] == "outer"):
                    raise Refused(NOT_ISOLATED, f"q has {index} zeros, which is another branch")
                offset, G = binary(*chain.a) + claim.unknowns[0] * arb(0, 1), arb(gamma) ** 2
                if not offset > 0:
                    raise Refused(NOT_ISOLATED, "the offset of the fish is not proved to be positive")
                u = end_hull(chain, claim)[1]
                parts = (-chain.sign * u / G, chain.sign * offset / G)
                return CertifiedState(branch, *(text for part in parts for text in decimal(part, DIGITS)))
        except Refused as refused:
            refusal = refused
    raise refusal


def _passed(*, lam: float, w_f: float, gamma: float) -> tuple[int | None, str]:
    """Number of critical speeds below gamma, proved, and what bounds it."""
    n = 1
    while True:
        found = certify(lam, w_f, n, digits=15)
        if found.status == NO_TRANSITION:
            return n - 1, f"the cable has no transition n = {n}"
        if found.gamma is None or found.gamma_radius is None:
            return None, f"gamma_c{n}: {found.reason}"
        apart = Fraction(gamma) - Fraction(found.gamma)
        if abs(apart) <= Fraction(found.gamma_radius):
            return None, f"gamma is not told from gamma_c{n}"
        if apart < 0:
            return n - 1, f"gamma_c{n} = {float(found.gamma):.15g} is above gamma"
        n += 1
