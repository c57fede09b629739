"""All bifurcations of a device: of its fixed points, its cycles and its homoclinic orbits."""

from math import acos

from towatlas.effort import patience
from towatlas.solve.device.cycle_folds import cycle_folds
from towatlas.solve.device.cycles import may_close
from towatlas.solve.device.homoclinics import homoclinics_at_alpha, homoclinics_at_radius
from towatlas.solve.device.local import Bifurcation, at_alpha, at_radius, of_family
from towatlas.solve.device.model import RIGHT_ANGLE, Device, check_device, check_radius, check_strength

# At right angles there is a family of closed motions; what moves stays so far from them [rad].
_ASIDE = 1e-6
# Where cycles are born or end; pairs of them are looked for up to this factor beyond.
_BIRTHS, _MARGIN = ("hopf", "homoclinic"), 1.3


def bifurcations(k: float, *, alpha: float | None = None, R: float | None = None) -> tuple[Bifurcation, ...]:
    """Where the motions of a device change: as its turn tightens, as its angle moves, or over both.

    Parameters
    ----------
    k : float
        Force constant of the fluid k L/m [-], 1e-4 to 1e5.
    alpha : float, optional
        Angle of the fluid's force [rad], -pi/2 to pi/2: the turning radius moves.
    R : float, optional
        Turning radius over the length of the line [-], 1e-4 to 1e6: alpha moves. Without either the points at which
        curves of bifurcations over alpha and R begin, end or change.

    Returns
    -------
    tuple of Bifurcation
        In falling order of R, of alpha where that moves. None at right angles, where the device is reversible.

    Raises
    ------
    ValueError
        For numbers out of range, and for both alpha and R.
    towatlas.TooMuchWork

    Notes
    -----
    Saddle-nodes, Hopf points and neutral saddles are closed forms or roots that are known to be all. Homoclinic orbits
    and saddle-nodes of cycles are looked for on a grid: two that nearly coincide may be missed, and of the latter what
    is nearer than 1e-10 of the way to a Hopf point or homoclinic orbit.

    Examples
    --------
    >>> [(one.kind, round(one.R, 6), one.stable_side) for one in bifurcations(1.0, alpha=-0.5)]
    [('saddle-node', 0.61761, 'above')]
    """
    if alpha is not None and R is not None:
        raise ValueError(f"bifurcations are along R at an alpha, or along alpha at an R; got both, {alpha!r} and {R!r}")
    if R is not None:
        return _along_alpha(check_strength(k), check_radius(R))
    if alpha is not None:
        return _along_radius(check_device(k, alpha))
    return tuple(sorted(of_family(k), key=lambda one: -one.R))


def _along_radius(device: Device) -> tuple[Bifurcation, ...]:
    found = at_alpha(device)
    if may_close(device):
        with patience():
            found += homoclinics_at_alpha(device)
            radii = sorted(one.R for one in found if one.kind in _BIRTHS)
            if radii:
                breaks = [radii[0] / _MARGIN, *radii, _MARGIN * radii[-1]]
                found += cycle_folds(lambda R: (device, R), breaks)
    return tuple(sorted(found, key=lambda one: -one.R))


def _along_alpha(k: float, R: float) -> tuple[Bifurcation, ...]:
    found = at_radius(k, R)
    with patience():
        found += homoclinics_at_radius(k, R)
        births = sorted(one.alpha for one in found if one.kind in _BIRTHS)
        if births:
            # Bendixson's criterion, see `may_close`.
            ends = (
                (-RIGHT_ANGLE + _ASIDE, -acos(1.0 / 3.0))
                if births[0] < 0.0
                else (acos(1.0 / 3.0), RIGHT_ANGLE - _ASIDE)
            )
            breaks = sorted({ends[0], *births, ends[1]})
            found += cycle_folds(lambda alpha: (Device(k, alpha), R), breaks)
    return tuple(sorted(found, key=lambda one: -one.alpha))
