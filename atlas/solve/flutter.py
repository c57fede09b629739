"""Windows of speed in which shapes do not last, along every branch of one cable, with their edges solved for."""

from collections.abc import Sequence
from math import inf

from towatlas.checks import check_speed
from towatlas.effort import patience
from towatlas.kernels import status
from towatlas.results_motion import Flutter, Window
from towatlas.solve.follower import SPACING, followed
from towatlas.system import System


def flutter(
    lam: float,
    w_f: float,
    gamma: Sequence[float],
    *,
    C: float = 0.0,
    m_f: float | None = None,
    C_f: float = 0.0,
    w: float = 1.0,
    C_t: float = 0.0,
    C_s: float = 0.0,
    b_s: float = inf,
) -> Flutter:
    """Windows of speed in which a shape of a towed cable does not last, along each of its branches.

    Parameters
    ----------
    lam : float
        Cable length over tow radius [-], > 0.
    w_f : float
        Fish weight over (mu + rho A) g R [-].
    gamma : (float, float)
        From which speed Omega sqrt(R/g) to which [-], > 0, a turn to starboard; one to port is its mirror image, with
        -C_s.
    C, m_f, C_f, w, C_t, C_s, b_s : float
        The fluid, as in `equilibria`; a vacuum by default.

    Returns
    -------
    Flutter
        Windows branch by branch, each in rising speed.

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If shapes cannot be computed, or the work takes longer than `towatlas.patience` allows (TooMuchWork).

    Notes
    -----
    All shapes are followed from speed to speed. What grows is counted (see `stability`) at speeds no further apart than
    0.01 of them, so that no window wider than that is missed. With drag an edge is a zero of the growth of a mode, a
    Hopf point; without drag two oscillations meet there, a Krein collision, and the square of half their distance,
    which is smooth, is zero. Windows of different modes may overlap; one inside another, without an
    edge of its own, goes with it.

    Examples
    --------
    >>> found = flutter(37.8, 1352, (3.1, 3.6), C=0.018)
    >>> [(w.branch, round(w.low, 6), w.low_kind, w.high_kind) for w in found.windows if not w.weak]
    [('shape 1', 3.303631, 'hopf', 'range'), ('shape 2', 3.1, 'range', 'range')]
    """
    low, high = (check_speed(speed) for speed in gamma)
    if not 0.0 < low < high:
        raise ValueError(f"gamma must be two positive speeds, the lower first, got {gamma!r}")
    system = System.of(lam, w_f, C=C, m_f=m_f, C_f=C_f, w=w, C_t=C_t, C_s=C_s, b_s=b_s)
    with patience():
        return flutter_of(system, low, high)


def flutter_of(system: System, low: float, high: float) -> Flutter:
    """As `flutter`, of a system already checked.

    Parameters
    ----------
    system : System
    low, high : float
        Speeds [-], 0 < low < high.

    Returns
    -------
    Flutter
    """
    traced, follower = followed(system, low, high)
    windows: list[Window] = []
    counted = True
    for samples, began, ended in follower.branches(traced):
        counted &= all(sample.spectrum.status == status.OK for sample in samples)
        windows += follower.windows(follower.modes(samples, began, ended), follower.name(samples, began))
    return Flutter(
        system, low, high, tuple(windows), traced.certain and counted, looked_at(low, high, traced.certain, counted)
    )


def looked_at(low: float, high: float, certain: bool, counted: bool, moved: str = "gamma") -> str:
    """What was looked at, in words.

    Parameters
    ----------
    low, high : float
        Of what moves.
    certain, counted : bool
        Whether all shapes were made out, and what grows was counted.
    moved : str
        Its name.

    Returns
    -------
    str
    """
    text = (
        f"{moved} {low:.6g} to {high:.6g}, at values {100 * SPACING:g} % apart at most: narrower windows may be missed"
    )
    if not certain:
        text += "; not all shapes were made out"
    return text if counted else text + "; some shapes were not counted, and end their windows"
