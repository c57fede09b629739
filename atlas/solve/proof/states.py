"""All equilibria of one cable at one speed, proved: each root, and that there are no others."""

from dataclasses import dataclass
from fractions import Fraction

from towatlas.checks import check_one
from towatlas.effort import check_patience, patience
from towatlas.solve.equilibria import equilibria
from towatlas.solve.proof.arithmetic import Refused, arb, binary, working_bits
from towatlas.solve.proof.certificates import (
    BITS,
    CERTIFIED,
    MORE,
    NO_TRANSITION,
    NOT_ISOLATED,
    ORDER,
    certify,
    decimal,
)
from towatlas.solve.proof.finding import find_chain, refine_columns
from towatlas.solve.proof.index import zeros
from towatlas.solve.proof.krawczyk import end_hull, prove

DIGITS = 30


@dataclass(frozen=True)
class CertifiedState:
    """One equilibrium proved; decimals and what they are off by at most.

    Attributes
    ----------
    branch : str
        Its pair, as "2 inner"; "outward" for the one without a pair.
    R_x0, x_f : str
        Radial force at the tow point, position of the fish [-].
    R_x0_radius, x_f_radius : str
        Radii [-], > 0.
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
    reason : str
        What was proved, or why not.
    """

    lam: float
    w_f: float
    gamma: float
    status: str
    states: tuple[CertifiedState, ...]
    passed: int | None
    reason: str


def certify_equilibria(lam: float, w_f: float, gamma: float) -> CertifiedEquilibria:
    """All equilibria of a cable in a vacuum at one speed, proved, and their number.

    Parameters
    ----------
    lam, w_f : float
        Cable length, > 0, and fish weight, >= 0 [-]; exactly these doubles.
    gamma : float
        Speed [-], > 0; exactly this double.

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
    cable has no more. Members of pair n have the sign (-1)^n at the fish and n - 1 (outer) or n zeros of q (inner).

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
                states.append(_state(lam, w_f, gamma, str(branch), float(x_f)))
            except Refused as refused:
                reasons.append((refused.status, f"{branch}: {refused}"))
        passed, why = _passed(lam, w_f, gamma)
    if passed is None:
        reasons.append((NOT_ISOLATED, why))
    elif not reasons and len(states) != 1 + 2 * passed:
        reasons.append((NOT_ISOLATED, f"{len(states)} equilibria are proved, of {1 + 2 * passed}"))
    if reasons:
        return CertifiedEquilibria(lam, w_f, gamma, reasons[0][0], tuple(states), passed, reasons[0][1])
    return CertifiedEquilibria(lam, w_f, gamma, CERTIFIED, tuple(states), passed, f"all of them, by theorem: {why}")


def _state(lam: float, w_f: float, gamma: float, branch: str, x_f: float) -> CertifiedState:
    name = branch.split()
    n = int(name[0]) if len(name) == 2 else 0
    refusal = Refused(NOT_ISOLATED, "not tried")
    for more, terms in MORE:
        try:
            with working_bits(BITS + more + 64):
                chain, floats = find_chain(
                    lam, w_f, n, abs(x_f) * gamma**2, gamma, BITS + more, ORDER + terms, fixed=True
                )
                try:
                    claim, steps = prove(chain)
                except Refused:
                    refine_columns(chain, floats)
                    claim, steps = prove(chain)
                index = zeros(chain, claim, steps)
                if index != n - (name[-1] == "outer"):
                    raise Refused(NOT_ISOLATED, f"q has {index} zeros, which is another branch")
                a, G = binary(*chain.a) + claim.unknowns[0] * arb(0, 1), arb(gamma) ** 2
                if not a > 0:
                    raise Refused(NOT_ISOLATED, "the offset of the fish is not proved to be positive")
                u = end_hull(chain, claim)[1]
                parts = (-chain.sign * u / G, chain.sign * a / G)
                return CertifiedState(branch, *(text for part in parts for text in decimal(part, DIGITS)))
        except Refused as refused:
            refusal = refused
    raise refusal


def _passed(lam: float, w_f: float, gamma: float) -> tuple[int | None, str]:
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
