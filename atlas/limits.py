"""Closed forms of the vacuum problem: thresholds and limits. Lengths over the tow radius, forces over (mu+rho A)gR."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.checks import check_broadcast, check_order, check_positive_finite, check_real
from towatlas.labelled import quantity_of
from towatlas.nomenclature import SYMBOLS

Array = NDArray[np.float64]

# Fish weight at which log(1 + w_f / W_SCALE), in which critical states are smooth, turns from linear to logarithmic.
# They have a term w_f^2 log w_f at zero: smaller, and the coordinate spans more; larger, and that term shows.
W_SCALE = 0.03


def threshold_offset(w_f: ArrayLike) -> Array:
    """Offset of the fish at every threshold, sqrt(1 + w_f^2) - w_f, without cancellation.

    Parameters
    ----------
    w_f : array_like
        Fish weight [-], >= 0; no checks.

    Returns
    -------
    ndarray
        Over tow radius [-], 0 to 1.
    """
    w_f = np.asarray(w_f, float)
    with np.errstate(over="ignore"):
        # As hypot, in a tenth of its time; the square of a heavy fish may be too large, its root is not.
        return 1.0 / (w_f + np.minimum(np.sqrt(1.0 + w_f * w_f), 1.0 + np.abs(w_f)))


def unchecked_threshold_length(w_f: ArrayLike, n: ArrayLike) -> Array:
    """`threshold_length` of numbers already checked.

    Parameters
    ----------
    w_f, n : array_like

    Returns
    -------
    ndarray
    """
    return (2.0 * np.asarray(n) - 1.0) + threshold_offset(w_f)


def unchecked_excess_length(*, lam: ArrayLike, w_f: ArrayLike, n: ArrayLike) -> Array:
    """`excess_length` of numbers already checked, or that may be bad.

    Parameters
    ----------
    lam, w_f, n : array_like

    Returns
    -------
    ndarray
    """
    return (np.asarray(lam, float) - (2.0 * np.asarray(n) - 1.0)) - threshold_offset(w_f)


def threshold_length(w_f: ArrayLike, n: ArrayLike = 1) -> Array:
    """Cable length at and below which there is no n-th transition.

    Parameters
    ----------
    w_f : array_like
        Fish weight [-], >= 0.
    n : array_like of int
        Number of the transition, >= 1.

    Returns
    -------
    ndarray
        lambda_cn [-], of the broadcast shape.

    Raises
    ------
    ValueError
        For a w_f that is negative or not finite, an n that is no whole number from 1, and what is not a number.

    Notes
    -----
    lambda_cn = 2 n - 1 + sqrt(1 + w_f^2) - w_f. Near it gamma_cn grows without bound, as (lambda - lambda_cn)^(-1/2).
    That there is none at and below it, and one beyond: docs/proofs.md, Theorems 1 and 5.

    References
    ----------
    NRL Report 7048, Eq. (36), for n = 1.

    Examples
    --------
    >>> float(threshold_length(0.0, 2))
    4.0
    """

    def plain(*, w_f: Any, n: Any) -> Array:
        w_f = check_real("w_f", w_f)
        check_positive_finite("w_f", w_f, zero=True)
        w_f, n = check_broadcast(w_f=w_f, n=check_order(n))
        return unchecked_threshold_length(w_f, n)

    return quantity_of(plain, "lambda_c", SYMBOLS["lambda_c"].long_name, float, w_f=w_f, n=n)


def excess_length(lam: ArrayLike, w_f: ArrayLike, n: ArrayLike = 1) -> Array:
    """Cable length beyond the threshold, lambda - lambda_cn(w_f); its rounding error is that of lambda.

    Parameters
    ----------
    lam : array_like
        Cable length over tow radius [-], > 0.
    w_f : array_like
        Fish weight [-], >= 0.
    n : array_like of int
        Number of the transition, >= 1.

    Returns
    -------
    ndarray
        lambda - lambda_cn [-], of the broadcast shape; there is an n-th transition where it is above zero.

    Raises
    ------
    ValueError
        For a lam that is not positive, a w_f that is negative, an n that is no whole number from 1, and what is not a
        number.

    References
    ----------
    NRL Report 7048, Eq. (36), for n = 1.

    Examples
    --------
    >>> float(excess_length(10.0, 0.0, 1))
    8.0
    """

    def plain(*, lam: Any, w_f: Any, n: Any) -> Array:
        lam, w_f = check_real("lam", lam), check_real("w_f", w_f)
        check_positive_finite("lam", lam)
        check_positive_finite("w_f", w_f, zero=True)
        lam, w_f, n = check_broadcast(lam=lam, w_f=w_f, n=check_order(n))
        return unchecked_excess_length(lam=lam, w_f=w_f, n=n)

    return quantity_of(plain, "excess", SYMBOLS["excess"].long_name, float, lam=lam, w_f=w_f, n=n)


def transitions(*, lam: float, w_f: float) -> int:
    """Number of transitions that a cable has, the n with lambda > lambda_cn(w_f).

    Parameters
    ----------
    lam, w_f : float
        Cable length and fish weight [-]; no checks.

    Returns
    -------
    int

    Examples
    --------
    >>> transitions(lam=37.8, w_f=1352.0)
    19
    """
    return max(0, math.ceil(0.5 * (lam + 1.0 - float(threshold_offset(w_f)))) - 1)


def massless_cable(lam: ArrayLike) -> Array:
    """First critical speed for w_f -> infinity.

    Parameters
    ----------
    lam : array_like
        Cable length over tow radius [-].

    Returns
    -------
    ndarray
        gamma_c1 [-], > 0; nan for lambda <= 1.

    Notes
    -----
    gamma_c1 = (lambda^(2/3) - 1)^(-3/4). The cable is then a straight rod that carries a point mass.

    Examples
    --------
    >>> round(float(massless_cable(8.0)), 12)
    0.438691337651
    """

    def plain(*, lam: Any) -> Array:
        base = np.cbrt(check_real("lam", lam)) ** 2 - 1.0
        return np.where(base > 0.0, np.abs(base), np.nan) ** -0.75

    return quantity_of(plain, "gamma", SYMBOLS["gamma"].long_name, float, lam=lam)


def long_cable(n: ArrayLike) -> Array:
    """gamma_cn^2 lambda for lambda -> infinity without a fish.

    Parameters
    ----------
    n : array_like of int
        Number of the transition, >= 1.

    Returns
    -------
    ndarray
        z_n = j_{0,n}^2 / 4 [-], with the n-th zero of J0.

    Notes
    -----
    The cable is then a hanging chain at its n-th resonance; the correction is of order lambda^(-2/3).

    Examples
    --------
    >>> round(float(long_cable(1)), 12)
    1.445796490737
    """
    n = np.asarray(n)
    # Bessel's integral by the trapezoidal rule, exact to rounding for a periodic integrand with so many points.
    angle = np.pi * (np.arange(4 * np.max(n) + 64) + 0.5) / (4 * np.max(n) + 64)
    root = np.pi * (n - 0.25) + 1.0 / (8.0 * np.pi * (n - 0.25))
    for _ in range(6):
        phase = np.multiply.outer(root, np.sin(angle))
        root = root + np.cos(phase).mean(axis=-1) / np.cos(angle - phase).mean(axis=-1)
    return 0.25 * root**2
