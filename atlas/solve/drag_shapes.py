"""Shape and loads of one equilibrium with drag."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from towatlas.checks import check_real
from towatlas.solve.drag_equilibria import DragEquilibria, raise_failures
from towatlas.solve.drag_shots import Array, trace


@dataclass(frozen=True)
class DragShape:
    """One cable with drag at arc lengths `s` from the tow point over the tow radius; arrays of their shape.

    x, y, z : position, the tow point at (1, 0, 0), moving along y, z downwards. R_x, R_y, R_z : force of the cable,
    pointing down it. T : tension.
    """

    s: Array
    x: Array
    y: Array
    z: Array
    R_x: Array
    R_y: Array
    R_z: Array
    T: Array


def drag_shape(found: DragEquilibria, which: int, s: ArrayLike) -> DragShape:
    """Shape and loads of one equilibrium at arc lengths of one's choice.

    Parameters
    ----------
    found : DragEquilibria
    which : int
        Which of its equilibria.
    s : array_like
        Arc lengths from the tow point over the tow radius [-], 0 to lam.

    Raises
    ------
    ValueError
        For arc lengths off the cable and equilibria that are not there.

    References
    ----------
    NRL Report 7048, Eqs. (20)-(23).
    """
    s = check_real("s", s)
    if not ((s >= 0.0) & (s <= found.lam)).all():
        raise ValueError(f"s must lie on the cable, 0 to {found.lam:g}")
    if not 0 <= which < len(found):
        raise ValueError(f"which must be 0 to {len(found) - 1}, got {which}")
    gamma2 = found.gamma**2
    share = np.append((found.lam - s.ravel()) / found.lam, 1.0)
    _, points, codes = trace(found.r_f[which] * gamma2, found.gamma, found.system, share)
    raise_failures(codes, found.system, found.gamma)
    big_x, big_y, h, fx, fy, fz, tension, _ = points.T / gamma2
    angle = np.arctan2(big_y[-1], big_x[-1])
    turned = np.exp(-1j * angle)
    position, force = (big_x + 1j * big_y) * turned, (fx + 1j * fy) * turned
    columns = (position.real, position.imag, h[-1] - h, force.real, force.imag, fz, tension)
    return DragShape(s, *(column[:-1].reshape(s.shape) for column in columns))
