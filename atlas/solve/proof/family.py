"""The shots of a whole range of offsets, enclosed by polynomials in t and alpha, a = middle + alpha radius.

f'' = -f / r, r = (t^2 + f^2)^(1/2). On each step polynomials F and Q are claimed, from floats. That Q^2 (t^2 + F^2) - 1
is small shows that Q is 1 / r; what F'' + F Q is bounds how far F may be off. With h = t^2 / r^3, the slope of f / r in
f, and any omega, E^2 = |e'|^2 + omega^2 |e|^2 of a difference e obeys E' <= kappa E + |F'' + F / r|, 2 omega kappa =
|h - omega^2| + |second slope| |e| / 2. Both are polynomials, computed exactly, the powers of alpha beyond those kept
with them. As sums of |coefficients| bound them, all of this holds for complex alpha too.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from towatlas.solve.proof.arithmetic import Refused, arb, binary, exponent, fmpz, fmpz_poly, norm, up

Complex = NDArray[np.complex128]
# Powers of t and of alpha, points on the circle |alpha| = 1, bits of coefficients.
ORDER, POWERS, POINTS, BITS = 18, 12, 16, 60
STRIDE = 4 * ORDER + 3
# The last term of a step over the first.
SMALL = 1e-15
# How far f may be from its polynomial, over r.
NEAR = 2.0**-16
MOST_STEPS = 1000


@dataclass(frozen=True)
class Family:
    """p(t_e; a) over a range of offsets.

    Attributes
    ----------
    p : list of arb
        Coefficients of its polynomial in alpha.
    off : arb
        What p is off by at most, for complex |alpha| <= 1 too.
    steps : int
        That it took.
    """

    p: list[arb]
    off: arb
    steps: int


@dataclass
class _Piece:
    """One step from t to t + h, z from 0 to 1: F and Q, a row a power of alpha; next to a bare tip u = f / t, t Q."""

    t: Fraction
    h: Fraction
    f: list[list[int]]
    q: list[list[int]]
    q_bits: int

    def f_at(self, z: int) -> list[arb]:
        """F at z = 0 or 1, by powers of alpha."""
        return [binary(sum(row) if z else row[0], -BITS) for row in self.f]

    def p_at(self, z: int) -> list[arb]:
        """Its slope in t."""
        h = ball(self.h)
        return [binary(sum(k * x for k, x in enumerate(row)) if z else row[1], -BITS) / h for row in self.f]


def ball(value: Fraction) -> arb:
    """A binary fraction.

    Parameters
    ----------
    value : Fraction

    Returns
    -------
    arb
    """
    return binary(value.numerator, 1 - value.denominator.bit_length())


def enclose(*, lam: Fraction, w_f: Fraction, G: Fraction, middle: Fraction, radius: Fraction) -> Family:
    """p at the tow point for all offsets within `radius` of `middle`.

    Parameters
    ----------
    lam, w_f, G, middle, radius : Fraction
        Cable length, fish weight, gamma^2, offsets; denominators powers of two.

    Returns
    -------
    Family

    Raises
    ------
    Refused
        If enclosures are too wide.
    """
    t, t_end = w_f * G, (w_f + lam) * G
    a = float(middle) + float(radius) * np.exp(2j * np.pi * np.arange(POINTS) / POINTS)
    f, p = float(t) * a, a
    known = [ball(middle), ball(radius)]
    ends = [ball(t) * value for value in known], known
    omega, off = arb(1), arb(0)
    for steps in range(1, MOST_STEPS):
        with np.errstate(all="ignore"):
            series = _tip_series(a) if t == 0 else _series(f, p, float(t))
        h = min(_length(series, float(t)), t_end - t)
        piece = _piece(series, t, h)
        if t == 0:
            omega, off = _tip_off(piece, known)
        else:
            omega, off = _off(piece, ends, omega, off)
        t, ends = t + h, (piece.f_at(1), piece.p_at(1))
        if t == t_end:
            return Family(ends[1], off, steps)
        powers = float(h) ** np.arange(ORDER + 1)
        f, p = powers @ series[0], (powers[:-1] * np.arange(1, ORDER + 1)) @ series[0][1:]
    raise Refused("WRAPPED", f"shots take more than {MOST_STEPS} steps")


def _roots(square: Complex, root: Complex, k: int) -> None:
    """Coefficient k of the series of square^(-1/2)."""
    if k == 0:
        root[0] = 1.0 / np.sqrt(square[0])
    else:
        j = np.arange(1, k + 1)
        root[k] = ((j / 2 - k)[:, None] * square[1 : k + 1] * root[k - 1 :: -1][:k]).sum(axis=0) / (k * square[0])


def _series(f0: Complex, p0: Complex, t: float) -> list[Complex]:
    """Taylor series in floats of f and 1 / r at each point of the circle."""
    f, square, root = (np.zeros((ORDER + 1, POINTS), complex) for _ in range(3))
    f[0], f[1] = f0, p0
    for k in range(ORDER + 1):
        square[k] = (f[: k + 1] * f[k::-1]).sum(axis=0) + (t * t, 2 * t, 1.0, 0.0)[min(k, 3)]
        _roots(square, root, k)
        if k < ORDER - 1:
            f[k + 2] = -(f[: k + 1] * root[k::-1]).sum(axis=0) / ((k + 1) * (k + 2))
    return [f, root]


def _tip_series(a: Complex) -> list[Complex]:
    """The same from a bare tip: f, and t / r."""
    u, square, root = (np.zeros((ORDER + 1, POINTS), complex) for _ in range(3))
    u[0] = a
    for k in range(ORDER + 1):
        square[k] = (u[: k + 1] * u[k::-1]).sum(axis=0) + (k == 0)
        _roots(square, root, k)
        if k < ORDER:
            u[k + 1] = -(u[: k + 1] * root[k::-1]).sum(axis=0) / ((k + 1) * (k + 2))
    return [np.concatenate([np.zeros((1, POINTS)), u[:-1]]), root]


def _length(series: list[Complex], t: float) -> Fraction:
    """A length of few bits, from how fast coefficients fall."""
    sizes = [np.abs(part).max(axis=1) for part in series]
    first = sizes[0][0] if t > 0 else sizes[0][1], sizes[1][0]
    worst = max(
        (size[k] / one) ** (1.0 / k)
        for size, one in zip(sizes, first, strict=True)
        for k in range(ORDER - 2, ORDER + 1)
    )
    if not (0.0 < worst < inf and all(np.isfinite(part).all() for part in series)):
        raise Refused("WRAPPED", "numbers of the shot are out of range")
    h = SMALL ** (1.0 / ORDER) / worst
    power = exponent(h) - 6
    return Fraction(int(h / 2.0**power)) * Fraction(2) ** power


def _piece(series: list[Complex], t: Fraction, h: Fraction) -> _Piece:
    q_bits = BITS - exponent(float(np.abs(series[1][0]).max()))
    scale = float(h) ** np.arange(ORDER + 1)
    made = []
    for part, bits in zip(series, (BITS, q_bits), strict=True):
        waves = np.fft.fft(part * scale[:, None], axis=1).real.T[:POWERS] / POINTS
        made.append([[int(value) for value in row] for row in np.ldexp(waves, bits).tolist()])
    return _Piece(t, h, made[0], made[1], q_bits)


def _packed(rows: list[list[int]]) -> fmpz_poly:
    """As a polynomial in z, with z^STRIDE for alpha."""
    return fmpz_poly([value for row in rows for value in row + [0] * (STRIDE - len(row))])


def _bent(rows: list[list[int]]) -> fmpz_poly:
    """Its second derivative in z."""
    return _packed([[k * (k - 1) * x for k, x in enumerate(row)][2:] for row in rows])


def _apart(one: list[arb], other: list[arb]) -> arb:
    """Bound of the difference of two polynomials in alpha."""
    length = max(len(one), len(other))
    pairs = zip(*(part + [arb(0)] * (length - len(part)) for part in (one, other)), strict=True)
    return up(sum((up(a - b) for a, b in pairs), arb(0)))


def _small(d: arb, q: fmpz_poly) -> arb:
    """|Q^2 r^2 - 1|, if that makes Q an approximation of 1 / r, and not of -1 / r."""
    if not (d < 2.0**-6 and q[0] > 0):
        raise Refused("WRAPPED", "the range of offsets is too wide: 1 / r is not enclosed")
    return up(d)


def _grown(kappa: arb, length: arb, off: arb, defect: arb) -> arb:
    return up((kappa * length).exp() * (off + length * defect))


def _off(piece: _Piece, ends: tuple[list[arb], list[arb]], before: arb, off: arb) -> tuple[arb, arb]:
    """omega and E anywhere on a step that begins at t > 0, from those of the step before and where that ends."""
    e = max(piece.t.denominator, piece.h.denominator).bit_length() - 1
    T, H = int(piece.t * 2**e), int(piece.h * 2**e)
    f, q, bits = _packed(piece.f), _packed(piece.q), piece.q_bits
    t = fmpz_poly([T, H])
    square = q * q
    shift = max(0, e - BITS)
    r = t * t * (fmpz(1) << 2 * (BITS + shift - e)) + f * f * (fmpz(1) << 2 * shift)
    d = _small(norm(square * r - (fmpz(1) << 2 * (bits + BITS + shift))) * binary(1, -2 * (bits + BITS + shift)), q)
    n_f, n_q = up(norm(f) * binary(1, -BITS)), up(norm(q) * binary(1, -bits))
    last, h = ball(piece.t + piece.h), ball(piece.h)
    defect = norm(_bent(piece.f) * (fmpz(1) << (bits + 2 * e)) + f * q * (H * H)) * binary(1, -BITS - bits) / H**2
    defect += n_f * n_q * d

    slope = square * q * t * t
    unit = binary(1, -3 * bits - 2 * e)
    omega = arb(sqrt(abs(float((slope[0] * unit).mid()))))
    away = norm(slope - slope[0]) * unit + up(slope[0] * unit - omega**2) + 2 * d * last**2 * n_q**3
    room = NEAR / n_q
    if not n_q**2 * (2 * n_f + room) * room < 0.25:
        raise Refused("WRAPPED", "the range of offsets is too wide: r may vanish")
    bend = 3.5 * last**2 * (n_f + room) * n_q**5
    began = off * (omega / before).max(arb(1)) + _apart(ends[1], piece.p_at(0)) + omega * _apart(ends[0], piece.f_at(0))
    off = _grown((away + bend * room) / (2 * omega), h, began, defect)
    if not off < omega * room:
        raise Refused("WRAPPED", "shots of the range leave the neighbourhood of the polynomials of a step")
    return omega, off


def _tip_off(piece: _Piece, start: list[arb]) -> tuple[arb, arb]:
    """The same on the first step from a bare tip: |e| / t <= |e'|, so |e'|' <= (|h t| + ...) sup |e'| + defect."""
    rows = [row[1:] for row in piece.f]
    u, q, bits = _packed(rows), _packed(piece.q), piece.q_bits
    e = piece.h.denominator.bit_length() - 1
    H, h = int(piece.h * 2**e), ball(piece.h)
    if any(row[0] for row in piece.f):
        raise Refused("WRAPPED", "the polynomials next to the tip do not begin there")
    # rows are those of u times h.
    r = u * u * (fmpz(1) << 2 * e) + fmpz_poly([(fmpz(1) << 2 * BITS) * (H * H)])
    by = 2 * (bits + BITS)
    d = _small(norm(q * q * r - (fmpz(1) << by) * (H * H)) * binary(1, -by) / H**2, q)
    n_u, n_q = up(norm(u) * binary(1, -BITS) / h), up(norm(q) * binary(1, -bits))
    bent = _bent(piece.f) * (fmpz(1) << (bits + e))
    defect = norm(bent + u * q * H) * binary(1, -BITS - bits + e) / H**2 + n_u * n_q * d
    room = NEAR / n_q
    if not n_q**2 * (2 * n_u + room) * room < 0.25:
        raise Refused("WRAPPED", "the range of offsets is too wide: r may vanish next to the tip")
    kappa = n_q**3 * (1 + 2 * d) + 3.5 * (n_u + room) * n_q**5 * room
    off = _grown(kappa, h, _apart(start, piece.p_at(0)), defect)
    if not off < room:
        raise Refused("WRAPPED", "shots of the range leave the neighbourhood of the polynomials next to the tip")
    # |e| <= h |e'|.
    omega = 1 / h
    return omega, up(2 * off)
