"""A cable, its fish and the medium: the one form in which a problem is passed."""

from dataclasses import astuple, dataclass, replace
from math import inf, isnan

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_finite, check_one, check_real
from towatlas.kernels.system import B_S, COLUMNS, LAM, M_F, W_F, W
from towatlas.kernels.system import C as DRAG

Array = NDArray[np.float64]


@dataclass(frozen=True)
class System:
    """A towed cable, dimensionless as in NRL Report 7048, Table 1; its speed goes beside it.

    Made by `System.of` from numbers to be checked, by `Scene.system` from a scene in real units.

    Attributes
    ----------
    lam : float
        Length of the cable over tow radius [-], > 0, Eq. (17).
    w_f : float
        Weight of the fish in the fluid over (mu + rho A) g R [-], negative if it floats, Eq. (16a).
    m_f : float
        Mass of the fish, added mass included, over (mu + rho A) R [-], >= 0, Eq. (16b).
    C : float
        Drag constant of the cable, (1/2) rho C_D d R / (mu + rho A) [-], >= 0, Eq. (13c).
    C_f : float
        Drag constant of the fish, (1/2) rho C_Df A_f / (mu + rho A) [-], >= 0, Eq. (16c).
    w : float
        Weight of the cable in the fluid, (mu - rho A) / (mu + rho A) [-], above -1 and at most 1, Eq. (13a).
    C_t : float
        Tangential drag constant of the cable, as C with the coefficient of the flow along it [-], >= 0.
    C_s : float
        Side force constant of a stranded cable, rho d R a / (2 (mu + rho A)) [-], positive to starboard of the track;
        a as in DTMB Report 713, where the coefficient of the side force is a sin(phi) / (1 + (sin(phi) / b_s)^2).
    b_s : float
        Sine of the angle between cable and stream at which the side force is at its largest [-], > 0; inf for a force
        that grows with the sine.
    """

    lam: float
    w_f: float
    m_f: float
    C: float = 0.0
    C_f: float = 0.0
    w: float = 1.0
    C_t: float = 0.0
    C_s: float = 0.0
    b_s: float = inf

    @classmethod
    def of(
        cls,
        lam: float,
        w_f: float,
        *,
        C: float = 0.0,
        m_f: float | None = None,
        C_f: float = 0.0,
        w: float = 1.0,
        C_t: float = 0.0,
        C_s: float = 0.0,
        b_s: float = inf,
    ) -> "System":
        """A system of numbers in range.

        Parameters
        ----------
        lam : float
            Cable length over tow radius [-], > 0.
        w_f : float
            Fish weight over (mu + rho A) g R [-]; negative for a fish that floats, whose m_f then has to be given.
        C : float
            Drag constant of the cable [-], >= 0.
        m_f : float, optional
            Fish mass over (mu + rho A) R [-], >= 0; that of its weight by default.
        C_f : float
            Drag constant of the fish [-], >= 0.
        w : float
            Weight of the cable [-], above -1 and at most 1.
        C_t : float
            Tangential drag constant of the cable [-], >= 0.
        C_s, b_s : float
            Side force constant of a stranded cable [-], and the sine at which that force is at its largest, > 0.

        Returns
        -------
        System

        Raises
        ------
        ValueError
            For numbers out of range, what is not one number, and a cable that nothing holds down or up.

        Examples
        --------
        >>> System.of(37.8, 1352, C=0.018).in_vacuum
        False
        """
        weight, sharp = check_real("w", w), check_real("b_s", b_s)
        if weight.ndim or not -1.0 < weight <= 1.0:
            raise ValueError(f"w = (mu - rho A) / (mu + rho A) must be one number above -1 and at most 1, got {w!r}")
        if sharp.ndim or not sharp > 0.0:
            raise ValueError(
                f"b_s, the sine at which the side force is largest, must be one positive number, got {b_s!r}"
            )
        lam, w_f = check_one("lam", lam), check_finite("w_f", w_f)
        if m_f is None and w_f < 0.0:
            raise ValueError(f"w_f = {w_f:g} is a fish lighter than the fluid, whose mass is its own: give m_f")
        m_f = w_f if m_f is None else check_one("m_f", m_f, zero=True)
        if weight == 0.0 and w_f == 0.0:
            raise ValueError("w = 0 and w_f = 0: nothing holds the cable down or up, it has no shape to hang in")
        return cls(
            lam=lam,
            w_f=w_f,
            m_f=m_f,
            C=check_one("C", C, zero=True),
            C_f=check_one("C_f", C_f, zero=True),
            w=float(weight),
            C_t=check_one("C_t", C_t, zero=True),
            C_s=check_finite("C_s", C_s),
            b_s=float(sharp),
        )

    def __str__(self) -> str:
        """The numbers of the cable and the fish, and of the fluid those that a vacuum does not have."""
        bare = astuple(self.vacuum)
        named = zip(COLUMNS, astuple(self), bare, strict=True)
        return ", ".join(f"{name} = {value:g}" for name, value, plain in named if name in COLUMNS[:2] or value != plain)

    @property
    def in_vacuum(self) -> bool:
        """Whether this is the report's vacuum: no drag, and weights that are masses."""
        return self == self.vacuum

    @property
    def nondense(self) -> bool:
        """Whether this is the report's nondense fluid: the drag of the cable alone, and weights that are masses."""
        return self == replace(self.vacuum, C=self.C)

    @property
    def vacuum(self) -> "System":
        """The same cable and weight of the fish in the report's vacuum."""
        return System(self.lam, self.w_f, self.w_f)

    @property
    def missing(self) -> list[str]:
        """Names of the numbers that are nan: a scene does not say enough for them."""
        return [name for name, value in zip(COLUMNS, astuple(self), strict=True) if isnan(value)]

    def row(self) -> Array:
        """The system as the kernels take it.

        Returns
        -------
        ndarray, shape (columns,)
            In the order of `towatlas.kernels.system.COLUMNS`.
        """
        return np.array(astuple(self))


def nondense_rows(*, lam: Array, w_f: Array, C: Array) -> Array:
    """Systems in a nondense fluid as the kernels take them.

    Parameters
    ----------
    lam, w_f, C : ndarray, shape (rows,)
        Cable length, fish weight and drag constant of the cable [-]; no checks.

    Returns
    -------
    ndarray, shape (rows, columns)
        In the order of `towatlas.kernels.system.COLUMNS`.
    """
    rows = np.zeros((len(lam), len(COLUMNS)))
    rows[:, LAM], rows[:, W_F], rows[:, M_F], rows[:, DRAG], rows[:, W], rows[:, B_S] = lam, w_f, w_f, C, 1.0, inf
    return rows
