"""Equilibria of many systems at once."""

from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from towatlas.checks import check_real
from towatlas.effort import SECONDS, check_patience, patience
from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS, W_F, W
from towatlas.labelled import takes_frames
from towatlas.solve.drag_equilibria import fill, quantities
from towatlas.solve.search import BLOCK, search
from towatlas.solve.shots import REMEDY, Array

if TYPE_CHECKING:
    import xarray

# Fields over (system, shape), with their names in full; units are 1 but of the phase.
FIELDS = {
    "R_x0": "radial force of the cable at the tow point over (mu + rho A) g R",
    "R_y0": "force of the cable at the tow point along its path over (mu + rho A) g R",
    "R_z0": "force of the cable at the tow point downwards over (mu + rho A) g R",
    "x_f": "radial position of the fish over tow radius",
    "y_f": "position of the fish along the path of the tow point over tow radius",
    "z_f": "depth of the fish below the tow point over tow radius",
    "r_f": "distance of the fish from the axis over tow radius",
    "phase_deg": "angle of the fish behind the tow point, carried along the cable",
    "tension": "tension at the tow point over (mu + rho A) g R",
    "nodes": "sign changes of x along the cable",
    "near_axis": "whether the fish is within half the tow radius of the axis, nearest of all shapes",
    "error": "estimated relative error of r_f",
}


@takes_frames
def equilibria_many(
    lam: ArrayLike,
    w_f: ArrayLike,
    gamma: ArrayLike,
    *,
    C: ArrayLike = 0.0,
    m_f: ArrayLike | None = None,
    C_f: ArrayLike = 0.0,
    w: ArrayLike = 1.0,
    C_t: ArrayLike = 0.0,
    C_s: ArrayLike = 0.0,
    b_s: ArrayLike = inf,
) -> "xarray.Dataset":
    """Equilibria of many towed cables, each at one speed, in any medium; all cores are used.

    Parameters
    ----------
    lam, w_f, gamma, C, m_f, C_f, w, C_t, C_s, b_s : array_like
        As of `equilibria`; arrays that broadcast, Series, or one DataFrame with such columns.

    Returns
    -------
    xarray.Dataset or pandas.DataFrame
        Over (system, shape): the fields of `Equilibria`, shapes in rising order of R_x0, nan, -1 or False beyond the
        last. Over system: the systems, gamma, count, the number of shapes, and status, a code of
        `towatlas.kernels.status`; a system that fails does not spoil the others. Where the broadcast shape has more
        than one dimension, system_0, system_1, ... in place of system. Of Series or a DataFrame a DataFrame: a row a
        shape, its number behind the index; one row for a system without any.

    Raises
    ------
    ValueError
        For numbers that are not numbers, and shapes that do not broadcast.

    Notes
    -----
    By the search that `equilibria` uses with drag, in a vacuum as well. What is out of range has the status BAD_INPUT
    and no shapes; STEP_LIMIT beside shapes says that a part of the range of r_f could not be searched.

    A system takes some milliseconds, a long one seconds. One whose shots would take more than some 30 s has the status
    UNFINISHED and no shapes. All of them together are not limited unless `towatlas.patience` limits them.

    References
    ----------
    NRL Report 7048, Eqs. (12)-(23).

    Examples
    --------
    >>> found = equilibria_many(37.8, 1352, [2.97, 5.94], C=0.018)
    >>> found.r_f.dims, [int(n) for n in found["count"]], found.r_f.values.round(2).tolist()
    (('system', 'shape'), [3, 3], [[36.81, 0.04, 38.78], [36.81, 0.01, 38.78]])
    """
    import xarray

    given = {"lam": lam, "w_f": w_f, "m_f": w_f if m_f is None else m_f, "C": C, "C_f": C_f, "w": w, "C_t": C_t}
    given |= {"C_s": C_s, "b_s": b_s, "gamma": gamma}
    try:
        arrays = np.broadcast_arrays(*(check_real(name, value) for name, value in given.items()))
    except ValueError as error:
        if "broadcast" not in str(error) and "shape mismatch" not in str(error):
            raise
        shapes = ", ".join(f"{name} {np.shape(value)}" for name, value in given.items())
        raise ValueError(f"shapes do not broadcast together: {shapes}; add or reorder axes") from None
    shape = np.atleast_1d(arrays[0]).shape
    systems = np.stack([array.ravel() for array in arrays[:-1]], axis=1)
    speeds = arrays[-1].ravel().copy()
    with patience(inf, each=SECONDS):
        columns, count, codes = _solve(systems, speeds)
    dims = ("system",) if len(shape) == 1 else tuple(f"system_{k}" for k in range(len(shape)))
    variables: dict[str, Any] = {}
    for name, long_name in FIELDS.items():
        about = {"long_name": long_name, "units": "degree" if name == "phase_deg" else "1"}
        variables[name] = ((*dims, "shape"), columns[name].reshape(*shape, columns[name].shape[-1]), about)
    for name, column in (*zip(COLUMNS, systems.T, strict=True), ("gamma", speeds), ("count", count), ("status", codes)):
        variables[name] = (dims, column.reshape(shape), {"units": "1"})
    meanings = status.FLAG_MEANINGS
    variables["status"][2].update(flag_values=np.arange(len(meanings.split()), dtype=np.int8), flag_meanings=meanings)
    return xarray.Dataset(variables, attrs={"title": "Equilibria of towed cables", "Conventions": "CF-1.11"})


def _solve(systems: Array, gamma: Array) -> tuple[dict[str, Any], Any, Any]:
    """Columns over (system, shape), numbers of shapes, and statuses."""
    codes = np.full(len(gamma), status.BAD_INPUT, np.int8)
    known = np.flatnonzero(_in_range(systems, gamma))
    rows, parts = [], []
    for begin in range(0, len(known), BLOCK):
        check_patience("equilibria of many systems", REMEDY, done=begin, of=len(known))
        block = known[begin : begin + BLOCK]
        found = search(systems[block], gamma[block])
        codes[block] = found.status
        codes[block[(np.bincount(found.row, minlength=len(block)) == 0) & (found.status == status.OK)]] = (
            status.NOT_CONVERGED
        )
        parts.append(quantities(found.row, found.x, systems[block], gamma[block]))
        rows.append(block[found.row])
    if not parts:
        none = np.empty(0, np.int64)
        parts, rows = [quantities(none, np.empty(0), systems[:0], gamma[:0])], [none]
    row = np.concatenate(rows)
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return fill(columns, row, len(gamma)), np.bincount(row, minlength=len(gamma)), codes


def _in_range(systems: Array, gamma: Array) -> Any:
    """Whether systems and speeds are such as `equilibria` takes."""
    named = dict(zip(COLUMNS, systems.T, strict=True))
    finite = np.isfinite(np.delete(systems, COLUMNS.index("b_s"), axis=1)).all(axis=1) & np.isfinite(gamma)
    good = (
        finite & (named["lam"] > 0.0) & (gamma != 0.0) & (named["w"] > -1.0) & (named["w"] <= 1.0) & (named["b_s"] > 0)
    )
    for name in ("m_f", "C", "C_f", "C_t"):
        good &= named[name] >= 0.0
    return good & ((systems[:, W] != 0.0) | (systems[:, W_F] != 0.0))
