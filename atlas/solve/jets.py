"""Kinds of jets for the kernels with drag: which monomials, and which products give which."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# Exponents of log r (radius of the fish), log gamma and a parameter of the system.
Monomial = tuple[int, int, int]


@dataclass(frozen=True)
class Jets:
    """Monomials of a truncated polynomial algebra in log r, log gamma and a parameter.

    Attributes
    ----------
    monomials : tuple of (int, int, int)
        Exponents, lower degrees first.
    products : ndarray of int, shape (products, 3)
        The factors and the result, sorted by the result, with the constant times the result itself last of its kind.
    places : ndarray of int, shape (5,)
        The monomials r, r^2, r^3, gamma and C, 0 where there is none.
    degree : int
        Highest power of log r, >= 0.
    """

    monomials: tuple[Monomial, ...]
    products: NDArray[np.int64]
    places: NDArray[np.int64]
    degree: int

    def __len__(self) -> int:
        return len(self.monomials)

    def at(self, *monomial: int) -> int:
        """Index of a monomial.

        Parameters
        ----------
        *monomial : int
            Exponents of log r, log gamma and a parameter.

        Returns
        -------
        int

        Raises
        ------
        ValueError
            If it is not among them.
        """
        return self.monomials.index(monomial)  # type: ignore[arg-type]


def jets_of(degree: int, gamma: bool = False, parameter: bool = False) -> Jets:
    """Jets to a degree in log r, and to the first in log gamma and in the parameter (with r to one degree less).

    Parameters
    ----------
    degree : int
        In log r, >= 0.
    gamma, parameter : bool
        Whether log gamma and a parameter of the system are among the unknowns.

    Returns
    -------
    Jets

    Examples
    --------
    >>> jets_of(1, gamma=True).monomials
    ((0, 0, 0), (1, 0, 0), (0, 1, 0))
    """
    monomials: list[Monomial] = [(k, 0, 0) for k in range(degree + 1)]
    monomials += [(k, 1, 0) for k in range(degree) if gamma]
    monomials += [(k, 0, 1) for k in range(degree) if parameter]
    # The kernels solve for one monomial after the other: those of lower degree come first.
    monomials.sort(key=lambda m: (sum(m), m[::-1]))
    at = {m: n for n, m in enumerate(monomials)}
    products = []
    for i, a in enumerate(monomials):
        for j, b in enumerate(monomials):
            total = tuple(x + y for x, y in zip(a, b, strict=True))
            if total in at:
                products.append((i, j, at[total]))  # type: ignore[index]
    products.sort(key=lambda product: (product[2], -product[0]))
    places = [at.get(m, 0) for m in ((1, 0, 0), (2, 0, 0), (3, 0, 0), (0, 1, 0), (0, 0, 1))]
    return Jets(tuple(monomials), np.array(products, np.int64), np.array(places, np.int64), degree)
