"""Cable lengths that put the fish at a given depth: one shot for each offset of the fish, ended at that depth.

At given speed and fish every equilibrium of every cable lies on the shots of one family (a, mu), and on each shot the
depth below the tow point grows with the cable paid out. So the shot with offset a reaches the depth wanted at one
length, and is an equilibrium where |p| = gamma^2 there: one equation in a. The search for its roots has two ends, for
r + p^2 / 2 - z is constant along a shot, whence p^2 <= a^2 (1 + mu), and a cable reaches no farther than
|x_f| <= 1 + lambda.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_one
from towatlas.effort import TooMuchWork, check_patience, patience, scaled
from towatlas.kernels import status
from towatlas.numerics.hermite import cubic
from towatlas.numerics.rows import EPS, bracket
from towatlas.solve.equilibria import FEW
from towatlas.solve.members import Shoot, extrema, shoot_lanes, shoot_singly

# Offsets tried at first, and how closely a cubic through values and slopes must meet p / gamma^2 between them.
FIRST = 400
CLOSE = 0.01
FINEST = 1e-6  # shortest interval in log a
# Shots are followed beyond the longest cable, so that none of its equilibria hides at the end of the search.
MARGIN = 1.5
# Half waves on the longest shot beyond which a search, of thousands of such shots, is refused: with the default
# patience, for it takes some twenty seconds at least; at most.
HALF_WAVES, MOST_HALF_WAVES = 500, 10**6
REMEDY = "a shorter longest cable (--max-length) or a slower tow has fewer nodes"

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class CablesToDepth:
    """Every cable, towed in a vacuum, that puts the fish at one depth, in rising order of length.

    Attributes
    ----------
    w_f : float
        Weight of the fish over (mu + rho A) g R [-], >= 0.
    gamma : float
        Speed Omega sqrt(R/g) [-], > 0.
    z_f : float
        Depth of the fish over tow radius [-], > 0.
    lam : ndarray, shape (cables,)
        Length of the cable over tow radius [-], >= z_f.
    R_x0 : ndarray, shape (cables,)
        Radial force of the cable at the tow point over (mu + rho A) g R [-].
    x_f : ndarray, shape (cables,)
        Radial position of the fish over tow radius [-].
    tension : ndarray, shape (cables,)
        At the tow point, over (mu + rho A) g R [-], > 0.
    nodes : ndarray of int, shape (cables,)
        Number of nodes [-], >= 0.
    outer : ndarray of bool, shape (cables,)
        Whether the shape is the member of its pair farther from the axis.
    """

    w_f: float
    gamma: float
    z_f: float
    lam: Array
    R_x0: Array
    x_f: Array
    tension: Array
    nodes: Integers
    outer: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.lam)


def cables_to_depth(*, w_f: float, gamma: float, z_f: float, lam_max: float) -> CablesToDepth:
    """All lengths up to lam_max of a cable, towed in a vacuum, with an equilibrium that has the fish at one depth.

    Parameters
    ----------
    w_f : float
        Fish weight over (mu + rho A) g R [-], >= 0.
    gamma : float
        Rotational frequency Omega sqrt(R/g) [-], > 0.
    z_f : float
        Depth of the fish below the plane of the towing circle over tow radius [-], > 0.
    lam_max : float
        Longest cable over tow radius [-], > 0.

    Returns
    -------
    CablesToDepth
        Empty where there is none.

    Raises
    ------
    ValueError
        For numbers out of range, and what is not one number.
    ArithmeticError
        If a shot overflows, the search does not converge, or takes longer than `towatlas.patience` allows
        (TooMuchWork).

    Notes
    -----
    The roots of p(a) = +-gamma^2 at the depth wanted are separated by its extrema, which are found from its derivative
    on a grid of offsets that is refined until a cubic tells what lies between: the tests compare with a scan of
    lengths. A root is found to rounding.

    Examples
    --------
    >>> found = cables_to_depth(w_f=0, gamma=2, z_f=10, lam_max=60)
    >>> [(round(float(lam), 4), int(nodes)) for lam, nodes in zip(found.lam, found.nodes)]
    [(13.535, 3), (21.5848, 3), (28.1156, 2)]
    """
    w_f, gamma = check_one("w_f", w_f, zero=True), check_one("gamma", gamma)
    z_f, lam_max = check_one("z_f", z_f), check_one("lam_max", lam_max)
    with patience():
        return _cables_to_depth(w_f=w_f, gamma=gamma, z_f=z_f, lam_max=lam_max)


def _cables_to_depth(*, w_f: float, gamma: float, z_f: float, lam_max: float) -> CablesToDepth:
    search = _Search(w_f=w_f, gamma=gamma, z_f=z_f, lam_max=lam_max)
    low, high = search.ends()
    empty = np.empty(0)
    x = _roots(search, low, high) if low < high and lam_max >= z_f else empty
    point = search.at(x)
    inside = point.tau <= search.gamma2 * lam_max
    order = np.argsort(point.tau[inside])
    a, tau, f, p, count = (column[inside][order] for column in (np.exp(x), point.tau, point.f, point.p, point.count))
    sign = np.sign(p)
    lam, r_x0 = tau / search.gamma2, sign * f / search.gamma2
    # p has the sign (-1)^n, and q has passed n zeros on the inner member of the n-th pair, n - 1 on the outer one.
    outer = (count % 2 == 0) != (sign > 0.0)
    return CablesToDepth(
        w_f=w_f,
        gamma=gamma,
        z_f=z_f,
        lam=lam,
        R_x0=r_x0,
        x_f=sign * a / search.gamma2,
        tension=np.hypot(w_f + lam, r_x0),
        nodes=count + outer,
        outer=outer,
    )


@dataclass(frozen=True)
class _Ends:
    """Shots where they reach the depth wanted: p / gamma^2, its slope by log a, and the state. nan: not reached."""

    value: Array
    slope: Array
    tau: Array
    f: Array
    p: Array
    count: NDArray[np.int64]


class _Search:
    """The shots of one family, as a function of log a."""

    def __init__(self, *, w_f: float, gamma: float, z_f: float, lam_max: float):
        self.gamma2 = gamma * gamma
        self.mu, self.depth = self.gamma2 * w_f, self.gamma2 * z_f
        self.lam_max = lam_max
        self.longest = MARGIN * self.gamma2 * lam_max
        self.shoot: Shoot = shoot_lanes if _half_waves(w_f=w_f, gamma=gamma, lam_max=lam_max) > FEW else shoot_singly

    def ends(self) -> tuple[float, float]:
        """Between which log a every equilibrium lies."""
        log_gamma2 = float(np.log(self.gamma2))
        slack = 0.01
        return log_gamma2 - 0.5 * float(np.log1p(self.mu)) - slack, log_gamma2 + float(np.log1p(self.lam_max)) + slack

    def at(self, x: Array) -> _Ends:
        """Shots ended at the depth wanted, by Newton in the length, inside a bracket."""
        rows, a = len(x), np.exp(x)
        state, counts = np.full((rows, 6), np.nan), np.zeros(rows, np.int64)

        def depth(tau: Array, i: Integers) -> tuple[Array, Array]:
            check_patience("shots to the depth", REMEDY)
            ends, count, codes = self.shoot(a[i], np.full(len(i), self.mu), tau)
            _check(codes)
            state[i], counts[i] = ends, count
            return ends[:, 3] - self.depth, 1.0 / np.hypot(1.0, ends[:, 1] / (self.mu + ends[:, 0]))

        # dz/dt <= 1: it takes at least as much cable as the depth.
        shortest = np.minimum(self.depth, self.longest)
        found, solved = bracket(
            depth, np.full(rows, shortest), np.full(rows, self.longest), start=self.depth * np.hypot(1.0, a)
        )
        if not solved.all():
            raise ArithmeticError(status.SENTENCES[status.NOT_CONVERGED])
        state[np.isnan(found)] = np.nan
        tau, f, p, _, v, q = state.T
        t = self.mu + tau
        # At fixed length z = r + p^2 / 2 less its value at the fish; at fixed depth the length takes that up.
        z_slope = f * v / np.hypot(t, f) + p * q - self.mu * a / np.hypot(1.0, a) - a
        slope = a * (q + f / t * z_slope)
        return _Ends(p / self.gamma2, slope / self.gamma2, tau, f, p, counts)


def _half_waves(*, w_f: float, gamma: float, lam_max: float) -> int:
    """Half waves on the longest shot; ArithmeticError where the search would take minutes."""
    highest, codes = extrema(
        lam=np.array([MARGIN * lam_max]), w_f=np.array([w_f]), gamma=np.array([gamma]), shoot=shoot_singly
    )
    _check(codes)
    if highest[0] > scaled(HALF_WAVES, MOST_HALF_WAVES):
        raise TooMuchWork(
            f"cables up to {lam_max:g} tow radii long would have shapes of up to {highest[0] / MARGIN:.0f} nodes at "
            "this speed, too many to search; name a shorter longest cable (--max-length), or go on with --patience "
            "SECONDS"
        )
    return int(highest[0])


def _check(codes: NDArray[np.int64]) -> None:
    if (codes != status.OK).any():
        raise ArithmeticError(status.SENTENCES[int(codes.max())])


def _roots(search: _Search, low: float, high: float) -> Array:
    """All log a with p = +-gamma^2."""
    x, value, slope = _sampled(search, low, high)
    k = _between(slope)
    peaks = _solved(lambda ends: (ends.slope, np.full(len(ends.slope), np.nan)), search, x[k], x[k + 1], slope[k])
    x = np.concatenate([x, peaks])
    value = np.concatenate([value, search.at(peaks).value])
    order = np.argsort(x)
    x, value = x[order], value[order]
    found = []
    for level in (1.0, -1.0):
        k = _between(value - level)

        def missed(ends: _Ends, level: float = level) -> tuple[Array, Array]:
            return ends.value - level, ends.slope

        found.append(_solved(missed, search, x[k], x[k + 1], value[k] - level))
    return np.concatenate(found)


def _solved(
    function: Callable[[_Ends], tuple[Array, Array]], search: _Search, low: Array, high: Array, at_low: Array
) -> Array:
    """Roots of a function of shots, given with its slope, in brackets."""
    rising = np.where(at_low > 0.0, -1.0, 1.0)

    def turned(x: Array, i: Integers) -> tuple[Array, Array]:
        value, slope = function(search.at(x))
        return value * rising[i], slope * rising[i]

    roots, solved = bracket(turned, low, high, resolution=4.0 * EPS)
    if not solved.all():
        raise ArithmeticError(status.SENTENCES[status.NOT_CONVERGED])
    return roots


def _between(values: Array) -> NDArray[np.int64]:
    """Intervals of a grid at whose ends the values have different signs; none beside nan."""
    known = np.isfinite(values[:-1]) & np.isfinite(values[1:])
    return np.flatnonzero(known & ((values[:-1] > 0.0) != (values[1:] > 0.0)))


def _sampled(search: _Search, low: float, high: float) -> tuple[Array, Array, Array]:
    """Offsets so close together that cubics through values and slopes tell what lies between."""
    x = np.linspace(low, high, FIRST)
    ends = search.at(x)
    value, slope = ends.value, ends.slope
    left = np.arange(FIRST - 1)
    right = left + 1
    while len(left):
        width = x[right] - x[left]
        check_patience(f"searching offsets of the fish, {len(x):,} tried and {len(left):,} to come", REMEDY)
        middle = 0.5 * (x[left] + x[right])
        ends = search.at(middle)
        between = cubic(value[left], value[right], slope[left], slope[right], width, 0.5)
        near = np.minimum(np.abs(value[left]), np.abs(value[right]))
        good = np.abs(ends.value - between) <= CLOSE * np.maximum(1.0, near)
        # Where a shot does not reach the depth, nothing beyond is wanted: only neighbours of one that does matter.
        reached = np.isfinite(value[left]) | np.isfinite(value[right]) | np.isfinite(ends.value)
        split = ~good & reached & (width > np.where(np.isfinite(between), FINEST, 1e-3))
        new = len(x) + np.arange(len(middle))
        x, value, slope = (np.concatenate(pair) for pair in ((x, middle), (value, ends.value), (slope, ends.slope)))
        left, right = np.concatenate([left[split], new[split]]), np.concatenate([new[split], right[split]])
    order = np.argsort(x)
    return x[order], value[order], slope[order]
