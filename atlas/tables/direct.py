"""What a table does not hold, solved directly: the one place where reading a file may come to compute.

The imports stand inside the functions, so that who only looks up waits for no compiler.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from towatlas.effort import patience
from towatlas.results import DragFolds

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


def critical_states(*, lam: Array, w_f: Array, n: Integers, excess: Array) -> dict[str, NDArray[Any]]:
    """As `towatlas.solve.critical.solve_rows`.

    Parameters
    ----------
    lam, w_f, n, excess : ndarray, shape (points,)

    Returns
    -------
    dict of ndarray, shape (points,)
    """
    from towatlas.solve.critical import solve_rows

    with patience():
        return solve_rows(lam=lam, w_f=w_f, n=n, excess=excess)


def fish_positions(branch: str, *, lam: Array, w_f: Array, gamma: Array) -> dict[str, NDArray[Any]]:
    """The fish on one branch, solved directly.

    Parameters
    ----------
    branch : {"outward", "median"}
    lam, w_f, gamma : ndarray, shape (points,)

    Returns
    -------
    dict of ndarray, shape (points,)
        nodes, x_f, z_f, error and status.
    """
    from towatlas.solve.equilibria import solve_branch

    with patience():
        nodes, members = solve_branch(branch, lam=lam, w_f=w_f, gamma=gamma)
    return {"nodes": nodes} | {name: getattr(members, name) for name in ("x_f", "z_f", "error", "status")}


def drag_folds(*, lam: Array, w_f: Array, C: Array, n: Integers) -> DragFolds:
    """As `towatlas.solve_drag_folds`.

    Parameters
    ----------
    lam, w_f, C, n : ndarray, shape (points,)

    Returns
    -------
    DragFolds
    """
    from towatlas.solve.drag_folds import solve_drag_folds

    with patience():
        return solve_drag_folds(lam, w_f, C, n)


def growth_rates(*, lam: Array, w_f: Array, gamma: Array, n: Integers) -> dict[str, NDArray[Any]]:
    """Growth rates of the inner shapes of n nodes in a vacuum.

    Parameters
    ----------
    lam, w_f, gamma, n : ndarray, shape (points,)

    Returns
    -------
    dict of ndarray, shape (points,)
        growth, frequency, unstable, kind, error and status; NOT_FOUND where there is no such shape.
    """
    from towatlas.kernels import status
    from towatlas.solve.members import shoot_lanes, solve_members
    from towatlas.solve.spectra import growth_columns
    from towatlas.system import nondense_rows

    none = np.zeros(len(n), bool)
    with patience():
        shapes = solve_members(lam=lam, w_f=w_f, gamma=gamma, n=n, outer=none, shoot=shoot_lanes)
        found = growth_columns(
            nondense_rows(lam=lam, w_f=w_f, C=np.zeros(len(n))),
            gamma,
            r_f=np.where(shapes.status == status.OK, np.abs(shapes.x_f), np.nan)[:, None],
            nodes=n[:, None],
            index=2 * n[:, None],
            error=shapes.error[:, None],
        )
    codes = np.where(shapes.status == status.OK, found["growth_status"][:, 0], shapes.status)
    columns = {name: found[name][:, 0] for name in ("growth", "frequency", "unstable", "kind")}
    return columns | {"error": found["growth_error"][:, 0], "status": codes}
