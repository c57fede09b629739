"""Steps of a shot as polynomials with integer coefficients, and their defects, exactly.

In sigma, with d(sigma) = dt / r, a shot and its derivative y in the offset a obey equations that are polynomial,

    p' = u,  u' = -p r,  t' = r,  r' = t - u p        (u = -f, r = sqrt(t^2 + f^2)),

and y' = F'(x) y. A step goes from z = 0 to 1 with sigma = h z; its quantities are over powers of two (`scales`), so
that their coefficients in z are about 1 and, times 2^bits, integers.
"""

from dataclasses import dataclass, field
from math import ldexp

import numpy as np
from numpy.typing import NDArray

from towatlas.solve.proof.arithmetic import Refused, exponent, fmpz, fmpz_poly

Array = NDArray[np.float64]
P, U, T, R = range(4)
# Coefficients of the columns of derivatives: their number, their bits, of floats and of those made better. They need
# not be as accurate as the shot: with a Jacobian right to ten digits Newton's method contracts all the same.
FLOAT_COLUMNS, FINE_COLUMNS = (36, 60), (60, 120)
# Constants of a step have so many bits more than its coefficients.
MORE_BITS = 64


@dataclass
class Step:
    """One step: what is claimed of a shot over it, nothing of it trusted.

    Attributes
    ----------
    h : tuple of int
        Length in sigma, mantissa and power of two.
    scales : tuple of int
        Powers of two by which p, u, t, r are divided.
    y_scale : int
        That by which y is divided besides.
    bits : int
        Of the coefficients.
    x, y : list of fmpz_poly
        The four quantities of the shot and of its derivative.
    v, w : list of list of fmpz_poly
        Columns of the derivative of the state with respect to that at the beginning, and of that of y.
    column_order, column_bits : int
        Of the coefficients of the columns.
    """

    h: tuple[int, int]
    scales: tuple[int, int, int, int]
    y_scale: int
    bits: int
    x: list[fmpz_poly] = field(default_factory=list)
    y: list[fmpz_poly] = field(default_factory=list)
    v: list[list[fmpz_poly]] = field(default_factory=list)
    w: list[list[fmpz_poly]] = field(default_factory=list)
    column_order: int = FLOAT_COLUMNS[0]
    column_bits: int = FLOAT_COLUMNS[1]

    @property
    def powers(self) -> tuple[int, int, int, int]:
        """Powers of two by which h is to be multiplied for the four constants."""
        p, u, t, r = self.scales
        return u - p, p + r - u, r - t, t - r

    def constants(self) -> list[int]:
        """The four constants of the scaled equations, times 2^(bits + MORE_BITS): P' = c0 U, U' = -c1 P R, T' = c2 R,
        R' = c3 T - c1 U P. Exact, or refused."""
        mantissa, power = self.h
        made = []
        for more in self.powers:
            shift = power + more + self.bits + MORE_BITS
            if shift < 0 and mantissa % (1 << -shift):
                raise Refused("WRAPPED", "a step whose length is no multiple of the last bit of its constants")
            made.append(mantissa << shift if shift >= 0 else mantissa >> -shift)
        return made

    def real_constants(self) -> list[float]:
        """The same as floats."""
        return [ldexp(self.h[0], self.h[1] + more) for more in self.powers]


def rounded_length(h: float, scales: tuple[int, int, int, int], mantissa_bits: int = 6) -> tuple[int, int]:
    """A length of few bits.

    Parameters
    ----------
    h : float
    scales : tuple of int
    mantissa_bits : int

    Returns
    -------
    tuple of int
        Mantissa and power of two.
    """
    power = exponent(h) - mantissa_bits
    return int(ldexp(h, -power)), power


def defects(
    step: Step, z: list[fmpz_poly], x: list[fmpz_poly], x_bits: int, z_bits: int, sources=()
) -> list[fmpz_poly]:
    """z' - F'(x) z - sources of the scaled equations, exactly.

    Parameters
    ----------
    step : Step
    z : list of fmpz_poly
        With `z_bits`.
    x : list of fmpz_poly
        With `x_bits`.
    x_bits, z_bits : int
    sources : sequence of pairs of lists of fmpz_poly
        Each stands for F''[first, second], firsts with `x_bits` or as they are, seconds with `z_bits`.

    Returns
    -------
    list of fmpz_poly
        Over 2^(x_bits + z_bits + bits + MORE_BITS).
    """
    constants = step.constants()
    c_bits = step.bits + MORE_BITS
    products_u = x[P] * z[R] + x[R] * z[P]
    products_r = x[U] * z[P] + x[P] * z[U]
    for first, second in sources:
        products_u += first[P] * second[R] + first[R] * second[P]
        products_r += first[U] * second[P] + first[P] * second[U]
    one, many = fmpz(1) << x_bits, fmpz(1) << (x_bits + c_bits)
    return [
        z[P].derivative() * many - z[U] * (one * constants[0]),
        z[U].derivative() * many + products_u * constants[1],
        z[T].derivative() * many - z[R] * (one * constants[2]),
        z[R].derivative() * many - z[T] * (one * constants[3]) + products_r * constants[1],
    ]


def own_defects(step: Step) -> list[fmpz_poly]:
    """x' - F(x) of the scaled equations, exactly.

    Parameters
    ----------
    step : Step

    Returns
    -------
    list of fmpz_poly
        Over 2^(3 bits + MORE_BITS).
    """
    constants = step.constants()
    x, bits = step.x, step.bits
    one, many = fmpz(1) << bits, fmpz(1) << (2 * bits + MORE_BITS)
    return [
        x[P].derivative() * many - x[U] * (one * constants[0]),
        x[U].derivative() * many + x[P] * x[R] * constants[1],
        x[T].derivative() * many - x[R] * (one * constants[2]),
        x[R].derivative() * many - x[T] * (one * constants[3]) + x[U] * x[P] * constants[1],
    ]


def shortened(step: Step, polys: list[fmpz_poly]) -> list[fmpz_poly]:
    """Polynomials of the shot with the number and the bits of the coefficients of the columns: enough for those.

    Parameters
    ----------
    step : Step
    polys : list of fmpz_poly

    Returns
    -------
    list of fmpz_poly
    """
    shift = fmpz(1) << (step.bits - step.column_bits)
    return [poly.truncate(step.column_order + 1) // shift for poly in polys]


def column_defects(step: Step) -> list[tuple[list[fmpz_poly], list[fmpz_poly]]]:
    """Defects of each column v and w, about the shortened shot, exactly.

    Parameters
    ----------
    step : Step

    Returns
    -------
    list of pair of list of fmpz_poly
        Over 2^(2 column_bits + bits + MORE_BITS).
    """
    x, y = shortened(step, step.x), shortened(step, step.y)
    short = step.column_bits
    return [
        (defects(step, v, x, short, short), defects(step, w, x, short, short, [(v, y)]))
        for v, w in zip(step.v, step.w, strict=True)
    ]


def integers(values: Array, bits: int) -> fmpz_poly:
    """A polynomial of floats.

    Parameters
    ----------
    values : ndarray, shape (order + 1,)
    bits : int

    Returns
    -------
    fmpz_poly
    """
    return fmpz_poly([int(value) for value in np.ldexp(values, bits).tolist()])


def floats(poly: fmpz_poly, bits: int, order: int) -> Array:
    """Coefficients as floats.

    Parameters
    ----------
    poly : fmpz_poly
        Over 2^bits.
    bits, order : int

    Returns
    -------
    ndarray, shape (order + 1,)
    """
    made = np.zeros(order + 1)
    # What is below 2^-1000 of the unit is nothing; so large an integer as a float would be infinite.
    low = max(0, bits - 1000)
    coefficients = [int(value) >> low for value in poly.truncate(order + 1).coeffs()]
    made[: len(coefficients)] = np.ldexp(np.array(coefficients, float), low - bits)
    return made


def linear_series(constants: Array, x: Array, z: Array, sources: Array | None) -> None:
    """Taylor series of z' = F'(x) z + sources in floats, of many steps and columns at once.

    Parameters
    ----------
    constants : ndarray, shape (steps, 4)
    x : ndarray, shape (steps, 4, order + 1)
    z : ndarray, shape (steps, columns, 4, order + 1)
        Only the first coefficients are read; the others are written.
    sources : ndarray, shape (steps, columns, 4, order), optional
    """
    c = constants.T[:, :, None]
    for k in range(z.shape[3] - 1):
        back = x[:, :, k::-1, None]
        z_p, z_u, z_r = (z[:, :, part, : k + 1] for part in (P, U, R))
        products_u = (z_r @ back[:, P] + z_p @ back[:, R])[..., 0]
        products_r = (z_p @ back[:, U] + z_u @ back[:, P])[..., 0]
        slopes = [
            c[0] * z[:, :, U, k],
            -c[1] * products_u,
            c[2] * z[:, :, R, k],
            c[3] * z[:, :, T, k] - c[1] * products_r,
        ]
        for part, slope in enumerate(slopes):
            z[:, :, part, k + 1] = (slope + (0.0 if sources is None else sources[:, :, part, k])) / (k + 1)


def crossed(constants: Array, y: Array, v: Array) -> Array:
    """F''[y, v] in floats, the sources of second derivatives.

    Parameters
    ----------
    constants : ndarray, shape (steps, 4)
    y : ndarray, shape (steps, 4, order + 1)
    v : ndarray, shape (steps, columns, 4, order + 1)

    Returns
    -------
    ndarray, shape (steps, columns, 4, order)
    """
    steps, columns, _, length = v.shape
    made = np.zeros((steps, columns, 4, length - 1))
    for k in range(length - 1):
        back = y[:, :, k::-1, None]
        v_p, v_u, v_r = (v[:, :, part, : k + 1] for part in (P, U, R))
        made[:, :, U, k] = (v_r @ back[:, P] + v_p @ back[:, R])[..., 0]
        made[:, :, R, k] = (v_p @ back[:, U] + v_u @ back[:, P])[..., 0]
    return -constants[:, 1, None, None, None] * made
