"""The number of equilibria, proved without theorems on it: the whole range of offsets is covered by pieces.

p(t_e; a) = +-G are the equilibria. |p'| = |f| / r < 1 in t leaves none beyond a = (1 + lambda) G, and that r - t +
p^2 / 2 does not grow none up to the larger of G / (1 + w_f G)^(1/2) and G / (w_f + (1 + w_f^2)^(1/2)). In between every
piece shows either that |p| is not G on it, or that p is monotone. So between neighbours of the first kind p crosses
each level once, or not at all.
"""

from dataclasses import dataclass
from fractions import Fraction

from towatlas.effort import check_patience
from towatlas.solve.proof.arithmetic import Refused, arb, arb_poly, working_bits
from towatlas.solve.proof.family import Family, ball, enclose

BITS = 128
# The part of the disc of alpha that is used. The error of p is analytic there, so that of its slope is at most the
# bound of it over 1 - USED.
USED = Fraction(7, 8)
# Radii of ranges over their lower end: the first, the largest, the least. Halvings of a range.
FIRST, LARGEST, LEAST = Fraction(1, 16), Fraction(1, 2), Fraction(1, 2048)
DEEPEST = 12
MOST_RANGES = 5000
# Powers of numbers in between do not leave the range of floats.
LARGE = Fraction(2) ** 200


@dataclass(frozen=True)
class Covering:
    """What a covering proves.

    Attributes
    ----------
    roots : int
        Number of offsets a > 0 with |p(t_e; a)| = G, exactly.
    ranges : int
        Of offsets that it took, each with an enclosure of its own.
    """

    roots: int
    ranges: int


def cover(*, lam: float, w_f: float, gamma: float) -> Covering:
    """The number of equilibria of a cable at one speed, proved.

    Parameters
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-], exactly these doubles; no checks.

    Returns
    -------
    Covering

    Raises
    ------
    Refused
        If enclosures stay too wide, or it takes too many ranges.
    TooMuchWork
        If it takes longer than `towatlas.patience` allows.
    """
    weight, G, length = Fraction(w_f), Fraction(gamma) ** 2, Fraction(lam)
    if not all(1 / LARGE < size < LARGE for size in (G, (weight + length) * G, weight * G) if size):
        raise Refused("WRAPPED", "gamma^2, or weight or length times it, is too small or too large for floats")
    with working_bits(BITS):
        low, high = _ends(lam=length, w_f=weight, G=G)
        count = _Count(ball(G))
        part, ranges = FIRST, 0
        while low < high:
            check_patience("covering offsets of the fish", "a lower speed (gamma) takes fewer ranges")
            if ranges == MOST_RANGES:
                raise Refused("WRAPPED", f"covering the offsets of the fish takes more than {MOST_RANGES} ranges")
            ranges += 1
            radius = _short(low * part)
            middle = low + USED * radius
            try:
                levels = _levels(
                    enclose(lam=length, w_f=weight, G=G, middle=middle, radius=radius), count.level, -USED, USED
                )
            except Refused as refused:
                part *= Fraction(2, 3)
                if part < LEAST:
                    raise Refused("WRAPPED", f"next to the offset {float(low):.6g} of the fish: {refused}") from None
                continue
            count.add(levels)
            low = middle + USED * radius
            part = min(LARGEST, part * Fraction(9, 8))
        # Beyond, p > G.
        count.add([(1, 0)])
    return Covering(count.roots, ranges)


def _ends(*, lam: Fraction, w_f: Fraction, G: Fraction) -> tuple[Fraction, Fraction]:
    """Between which offsets equilibria can be; the lower rounded down."""
    weight = ball(w_f)
    least = (ball(G) / (1 + weight * ball(G)).sqrt()).max(ball(G) / (weight + (1 + weight**2).sqrt()))
    return _short(Fraction(float(least.lower())) * (1 - Fraction(1, 2**40))), (1 + lam) * G


def _short(value: Fraction) -> Fraction:
    """No more than it, of few bits."""
    power = 48 - (value.numerator.bit_length() - value.denominator.bit_length())
    scale = Fraction(2) ** power
    return Fraction(int(value * scale)) / scale


class _Count:
    """Roots counted from piece to piece, from a = 0 up."""

    def __init__(self, level: arb):
        self.level, self.roots = level, 0
        self._region, self._slope = 0, 0

    def add(self, pieces: list[tuple[int | None, int]]) -> None:
        """Pieces in order, each (-1, 0 or 1 for p below -G, within or above G, or None; sign of the slope of p)."""
        for region, slope in pieces:
            if region is None:
                if self._slope not in (0, slope):
                    raise Refused("WRAPPED", "p is said to rise and to fall at one offset")
                self._slope = slope
                continue
            if region != self._region and self._slope != (1 if region > self._region else -1):
                raise Refused("WRAPPED", "p is said to be on two sides of gamma^2 at one offset")
            self.roots += abs(region - self._region)
            self._region, self._slope = region, 0


def _levels(family: Family, level: arb, low: Fraction, high: Fraction, depth: int = 0) -> list[tuple[int | None, int]]:
    """What `_Count.add` takes, for alpha from low to high."""
    piece = ball((low + high) / 2) + ball((high - low) / 2) * arb(0, 1)
    poly, either = arb_poly(family.p), arb(0, 1)
    p, q = poly(piece) + family.off * either, poly.derivative()(piece) + family.off / ball(1 - USED) * either
    if p > level:
        return [(1, 0)]
    if p < -level:
        return [(-1, 0)]
    if abs(p) < level:
        return [(0, 0)]
    if q > 0 or q < 0:
        return [(None, 1 if q > 0 else -1)]
    if depth == DEEPEST:
        raise Refused("WRAPPED", "p is not told from gamma^2 where its slope is not told from 0")
    middle = (low + high) / 2
    return _levels(family, level, low, middle, depth + 1) + _levels(family, level, middle, high, depth + 1)
