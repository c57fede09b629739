"""What proofs share: balls of Arb, exact binary fractions, upper bounds. The one door to python-flint."""

try:
    import flint
    from flint import arb, arb_mat, arb_poly, fmpz, fmpz_poly
except ImportError as error:
    raise ImportError(
        "proofs need python-flint, which is not installed: pip install 'towatlas[certify]', or pip install python-flint"
    ) from error

__all__ = [
    "arb",
    "arb_mat",
    "arb_poly",
    "binary",
    "exponent",
    "fmpz",
    "fmpz_poly",
    "height",
    "norm",
    "up",
    "working_bits",
]


class Refused(ArithmeticError):
    """What was claimed is not proved.

    Attributes
    ----------
    status : str
        WRAPPED where enclosures are too wide to tell, NOT_ISOLATED where there is no such fold.
    """

    def __init__(self, status: str, reason: str):
        super().__init__(reason)
        self.status = status


def working_bits(bits: int):
    """Everything within is computed with so many bits.

    Parameters
    ----------
    bits : int

    Returns
    -------
    context manager
    """
    return flint.ctx.workprec(bits)


def binary(mantissa: int | fmpz, power: int) -> arb:
    """mantissa 2^power, exactly.

    Parameters
    ----------
    mantissa : int or fmpz
    power : int

    Returns
    -------
    arb
    """
    return arb((fmpz(mantissa), power))


def up(value: arb) -> arb:
    """Largest absolute value in a ball, as an exact number.

    Parameters
    ----------
    value : arb

    Returns
    -------
    arb
    """
    return value.abs_upper()


def height(poly: fmpz_poly) -> arb:
    """Upper bound of the sum of |coefficients| of a polynomial: their number, times a power of 2.

    Parameters
    ----------
    poly : fmpz_poly

    Returns
    -------
    arb
    """
    return binary(poly.length(), poly.height_bits()) if poly.length() else arb(0)


def norm(poly: fmpz_poly) -> arb:
    """Sum of |coefficients| of a polynomial, which bounds |it| on [0, 1].

    Parameters
    ----------
    poly : fmpz_poly

    Returns
    -------
    arb
    """
    return arb(sum(map(abs, poly.coeffs()), fmpz(0)))


def exponent(value: float) -> int:
    """Least e with |value| <= 2^e.

    Parameters
    ----------
    value : float
        Not zero.

    Returns
    -------
    int
    """
    from math import frexp

    return frexp(abs(value))[1]
