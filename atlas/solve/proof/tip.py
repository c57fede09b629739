"""The bare tip (w_f = 0): the first piece of a shot, from t = 0, as polynomials in t.

With s = f / r, c = t / r and b(t) = (integral of tau s from 0 to t) / t^2 a shot obeys s' = -c^3 b, c' = s c^2 b, which
has no singularity; the coefficients of b are those of s over k + 2. With it go its first and second derivative in
alpha, where the offset is a + alpha 2^unit.
"""

from dataclasses import dataclass
from operator import mul

from towatlas.solve.proof.arithmetic import Refused, arb, binary, exponent, fmpz, fmpz_poly, height, norm, up

# How far a shot may be from its polynomial: what bounds the slopes of the equations about it.
NEAR = 2.0**-20


@dataclass
class Tip:
    """What is claimed of the first piece of a shot, nothing of it trusted.

    Attributes
    ----------
    h : tuple of int
        The t at which it ends, mantissa and power of two.
    scale, unit : int
        Powers of two by which c and alpha are divided.
    bits : int
        Of the coefficients.
    s, c, b : list of fmpz_poly
        The quantities and their two derivatives in alpha, in z = t / h.
    """

    h: tuple[int, int]
    scale: int
    unit: int
    bits: int
    s: list[fmpz_poly]
    c: list[fmpz_poly]
    b: list[fmpz_poly]

    @property
    def constants(self) -> tuple[arb, arb]:
        """k3 and k1 of S' = -k3 C^3 B, C' = k1 S C^2 B."""
        mantissa, power = self.h
        return binary(mantissa, power + 3 * self.scale), binary(mantissa, power + self.scale)


def _initial(a: arb, scale: int, unit: int) -> list[tuple[arb, arb]]:
    """(s, c) at t = 0 and their three derivatives in alpha, scaled."""
    c = 1 / (1 + a * a).sqrt()
    s = [a * c, c**3, -3 * a * c**5, c**7 * (12 * a**2 - 3)]
    cc = [c, -a * c**3, c**5 * (2 * a * a - 1), c**7 * (9 * a - 6 * a**3)]
    return [(s[k] * binary(1, k * unit), cc[k] * binary(1, k * unit - scale)) for k in range(4)]


def nearest(value: arb, bits: int) -> int:
    """The middle of a ball as a multiple of 2^-bits.

    Parameters
    ----------
    value : arb
    bits : int

    Returns
    -------
    int
    """
    mantissa, power = (int(part) for part in value.mid().man_exp())
    shift = power + bits
    return mantissa << shift if shift >= 0 else (mantissa + (1 << (-shift - 1))) >> -shift


def expand_tip(a: arb, bits: int, order: int) -> Tip:
    """The polynomials, rounded.

    Parameters
    ----------
    a : arb
        Offset of the fish, exact, > 0.
    bits, order : int

    Returns
    -------
    Tip
    """
    offset = float(a.mid())
    scale, unit = exponent(1.0 / (1.0 + offset * offset) ** 0.5), exponent(max(1.0, offset))
    h = (1, unit - 2)
    tip = _series(a, h, scale, unit, bits, order)
    for _ in range(3):
        # Shrunk until the last coefficients are of the size of rounding.
        last = max(abs(int(poly[k])).bit_length() for poly in (*tip.s, *tip.c) for k in range(order - 3, order + 1))
        if last <= 8:
            break
        h = (1, h[1] - max(1, -(-(last - 4) // (order - 3))))
        tip = _series(a, h, scale, unit, bits, order)
    return tip


def _series(a: arb, h: tuple[int, int], scale: int, unit: int, bits: int, order: int) -> Tip:
    start = _initial(a, scale, unit)
    s, c = ([[nearest(start[k][part], bits)] for k in range(3)] for part in range(2))
    b: list[list[int]] = [[], [], []]
    d: list[list[int]] = [[], [], []]
    e: list[list[int]] = [[], [], []]
    k3, k1 = (h[0] << bits + h[1] + 3 * scale + 64, h[0] << bits + h[1] + scale + 64)
    pairs = [[(0, 0, 1)], [(1, 0, 1), (0, 1, 1)], [(2, 0, 1), (1, 1, 2), (0, 2, 1)]]

    def product(first: list[list[int]], second: list[list[int]], order: int) -> int:
        return sum(n * sum(map(mul, first[i], second[j][::-1])) for i, j, n in pairs[order]) >> bits

    for k in range(order):
        for m in range(3):
            b[m].append(s[m][k] // (k + 2))
            d[m].append(product(c, c, m))
        for m in range(3):
            e[m].append(product(d, b, m))
        for m in range(3):
            slope_s, slope_c = product(c, e, m), product(s, e, m)
            s[m].append((-k3 * slope_s >> bits + 64) // (k + 1))
            c[m].append((k1 * slope_c >> bits + 64) // (k + 1))
    for m in range(3):
        b[m].append(s[m][order] // (order + 2))
    return Tip(h, scale, unit, bits, *([fmpz_poly(part) for part in parts] for parts in (s, c, b)))


def _whole(value: arb) -> fmpz:
    number = value.unique_fmpz()
    if number is None or not value.is_exact():
        raise Refused("WRAPPED", "a constant of the tip is no multiple of its last bit")
    return number


def _defects(tip: Tip) -> list[arb]:
    """Bounds of what the polynomials and their derivatives fail the equations by, at each order in alpha."""
    s, c, b, bits = tip.s, tip.c, tip.b, tip.bits
    k3, k1 = tip.constants
    one = fmpz(1) << bits
    d = [c[0] * c[0], 2 * c[1] * c[0], 2 * c[2] * c[0] + 2 * c[1] * c[1]]
    e = [d[0] * b[0], d[1] * b[0] + d[0] * b[1], d[2] * b[0] + 2 * d[1] * b[1] + d[0] * b[2]]

    def product(first, second):
        return [
            first[0] * second[0],
            first[1] * second[0] + first[0] * second[1],
            first[2] * second[0] + 2 * first[1] * second[1] + first[0] * second[2],
        ]

    made = []
    x = fmpz_poly([0, 1])
    # b is not the one of s: by half of what it fails its own equation by.
    off = [height(x * b[m].derivative() + 2 * b[m] - s[m]) * binary(1, -bits) / 2 for m in range(3)]
    cube, square = product(c, d), product(s, d)
    cubes = [height(poly) * binary(1, -3 * bits) for poly in cube]
    squares = [height(poly) * binary(1, -3 * bits) for poly in square]
    for m, (ce, se) in enumerate(zip(product(c, e), product(s, e), strict=True)):
        # 2^bits k3 and k1 are whole numbers with 2^64 in hand.
        n3, n1 = (_whole(k * binary(1, bits + 64)) for k in (k3, k1))
        many = one * one * one * one * (fmpz(1) << 64)
        ds = s[m].derivative() * many + ce * n3
        dc = c[m].derivative() * many - se * n1
        weights = [1, 1, 1] if m < 2 else [1, 2, 1]
        extra3 = sum((weights[j] * cubes[m - j] * off[j] for j in range(m + 1)), arb(0))
        extra1 = sum((weights[j] * squares[m - j] * off[j] for j in range(m + 1)), arb(0))
        small = binary(1, -5 * bits - 64)
        made.append(up((height(ds) * small + k3 * extra3).max(height(dc) * small + k1 * extra1)))
    return made


@dataclass(frozen=True)
class TipBounds:
    """What is proved at the end of the tip, for every offset of the box.

    Attributes
    ----------
    value : list of arb
        The state and its derivative (p, u, t, r, and the same of y) at the centre.
    slope : list of arb
        Derivative of those in a, anywhere in the box.
    whole : list of arb
        The state and its derivative anywhere in the box.
    positive : bool
        Whether q > 0 up to here.
    """

    value: list[arb]
    slope: list[arb]
    whole: list[arb]
    positive: bool


def bound_tip(tip: Tip, a: arb, radius: arb) -> TipBounds:
    """Enclosures at the end of the tip.

    Parameters
    ----------
    tip : Tip
    a, radius : arb
        Offset, exact, and the radius of the box.

    Returns
    -------
    TipBounds

    Raises
    ------
    Refused
        If the shots may leave the neighbourhood of the polynomials.
    """
    bits, unit = tip.bits, binary(1, -tip.bits)
    k3, k1 = tip.constants
    box = a + radius * arb(0, 1)
    delta = radius * binary(1, -tip.unit)
    at, about = _initial(a, tip.scale, tip.unit), _initial(box, tip.scale, tip.unit)
    n_s, n_c, n_b = (norm(polys[0]) * unit + NEAR for polys in (tip.s, tip.c, tip.b))
    kappa = up((k3 * (3 * n_c**2 * n_b + n_c**3 / 2)).max(k1 * (n_c**2 * n_b + 2 * n_s * n_c * n_b + n_s * n_c**2 / 2)))
    beta2 = up((k3 * (6 * n_c * n_b + 3 * n_c**2)).max(k1 * (4 * n_c * n_b + n_c**2 + 2 * n_s * n_b + 2 * n_s * n_c)))
    beta3 = up((k3 * (6 * n_b + 9 * n_c)).max(k1 * (3 * n_s + 6 * n_c + 6 * n_b)))
    growth = up(kappa.exp())

    def off(k: int, values) -> arb:
        """What the k-th derivative begins off its polynomial by."""
        pairs = zip(values[k], (tip.s[k], tip.c[k]), strict=True)
        ends = [up(value - binary(poly[0], -bits)) for value, poly in pairs]
        return ends[0].max(ends[1])

    d = _defects(tip)
    if not (off(0, about) + d[0]) * growth < NEAR:
        raise Refused("WRAPPED", "shots of the box leave the neighbourhood of the polynomials next to the tip")
    x1, x2 = (up(norm(tip.s[m]).max(norm(tip.c[m])) * unit) for m in (1, 2))
    e0 = up((off(0, at) + d[0]) * growth)
    e1 = up((off(1, at) + beta2 * e0 * x1 + d[1]) * growth)
    e2 = up((off(2, at) + beta2 * (e0 * x2 + 2 * x1 * e1 + e1**2) + beta3 * e0 * x1**2 + d[2]) * growth)
    size = [up(about[k][0]).max(up(about[k][1])) for k in range(4)]
    most1 = up(size[1] * growth)
    most2 = up((size[2] + beta2 * most1**2) * growth)
    most3 = up((size[3] + 3 * beta2 * most1 * most2 + beta3 * most1**3) * growth)
    wide = [up(e0 + most1 * delta), up(e1 + most2 * delta), up(e2 + most3 * delta)]
    value = _states(tip, a, [e0, e1, e2])
    whole = _states(tip, box, wide)
    sup_c = (norm(tip.c[0]) * unit + wide[0]) * binary(1, tip.scale)
    positive = bool(binary(*tip.h) * sup_c**3 < 1)
    return TipBounds(value[:8], [*whole[4:8], *whole[8:]], whole[:8], positive)


def _states(tip: Tip, a: arb, errors: list[arb]) -> list[arb]:
    """p, u, t, r at the end and their first and second derivative in a."""
    bits, h = tip.bits, binary(*tip.h)
    either = arb(0, 1)
    s = [binary(sum(tip.s[m].coeffs(), fmpz(0)), -bits) + errors[m] * either for m in range(3)]
    c = [(binary(sum(tip.c[m].coeffs(), fmpz(0)), -bits) + errors[m] * either) * binary(1, tip.scale) for m in range(3)]
    p = []
    for m in range(3):
        total = sum((binary(value, -bits) / (k + 1) for k, value in enumerate(tip.s[m].coeffs())), arb(0))
        p.append(-h * (total + errors[m] * either))
    p[0] += a
    p[1] += binary(1, tip.unit)
    r = [h / c[0], -h * c[1] / c[0] ** 2, -h * c[2] / c[0] ** 2 + 2 * h * c[1] ** 2 / c[0] ** 3]
    f = [r[0] * s[0], r[1] * s[0] + r[0] * s[1], r[2] * s[0] + 2 * r[1] * s[1] + r[0] * s[2]]
    made: list[arb] = []
    for m in range(3):
        unit = binary(1, -m * tip.unit)
        made += [p[m] * unit, -f[m] * unit, h if m == 0 else arb(0), r[m] * unit]
    return made
