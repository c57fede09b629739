"""Growth rates of the shapes of many systems at once."""

from concurrent.futures import ThreadPoolExecutor
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from towatlas.effort import SECONDS, TooMuchWork, check_patience, patience
from towatlas.kernels import status
from towatlas.kernels.system import COLUMNS
from towatlas.labelled import takes_frames
from towatlas.solve.growth import REMEDY, kind_of
from towatlas.solve.many import equilibria_many
from towatlas.solve.motion import Array, Integers
from towatlas.solve.neighbours import Answer, Shapes, Zeros, solve_shapes
from towatlas.system import System

if TYPE_CHECKING:
    import xarray

# Systems that follow one another, each with the zeros of the one before; how many such chains are side by side; shapes
# whose series are held in memory at a time.
LINKS, CHAINS, AT_A_TIME = 32, 16, 64
FIELDS = {
    "growth": "growth of the leading eigenvalue over sqrt(g/R)",
    "frequency": "frequency of the leading eigenvalue over sqrt(g/R)",
    "growth_error": "estimated absolute error of growth and frequency over sqrt(g/R)",
    "unstable": "number of eigenvalues that grow, -1 if not counted",
    "index": "number of directions in which the energy falls without drag, -1 with it",
    "kind": "what becomes of a small push",
    "growth_status": "outcome of the growth rates",
}


@takes_frames
def stability_many(
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
    """Growth rates of the shapes of many towed cables, each at one speed, in any medium; all cores are used.

    Parameters
    ----------
    lam, w_f, gamma, C, m_f, C_f, w, C_t, C_s, b_s : array_like
        As of `equilibria_many`. Neighbours next to each other, the last axis first, are fastest.

    Returns
    -------
    xarray.Dataset or pandas.DataFrame
        That of `equilibria_many`, and over (system, shape) as of `Stability`: growth, frequency, unstable, index, kind;
        growth_error, their error, and growth_status, a code of `towatlas.kernels.status`; nan, -1 or "" beyond the
        last. A shape that fails does not spoil the others.

    Raises
    ------
    ValueError
        For numbers that are not numbers, and shapes that do not broadcast.

    Notes
    -----
    Zeros of the Evans function are followed from one system to the next and counted by the argument principle, in drag
    to the right of a line that the leading one is right of, without drag in the disc that holds all that grow. What
    does not follow is done by the method of `stability`: strangers take as long as with it, some milliseconds to tens
    of them a shape, neighbours a fraction.

    Examples
    --------
    >>> found = stability_many(37.8, 1352, [5.92, 5.94], C=0.018)
    >>> found.kind.values[1].tolist(), found.unstable.values.tolist()
    (['divergence', 'flutter', 'stable'], [[1, 2, 0], [1, 2, 0]])
    """
    with patience(inf, each=SECONDS):
        found = equilibria_many(lam, w_f, gamma, C=C, m_f=m_f, C_f=C_f, w=w, C_t=C_t, C_s=C_s, b_s=b_s)
        shape = found.r_f.shape
        systems = np.stack([found[name].values.ravel() for name in COLUMNS], axis=1)
        flat = {name: found[name].values.reshape(-1, shape[-1]) for name in ("r_f", "nodes", "error")}
        index = indices(systems, flat["r_f"], flat["nodes"])
        columns = growth_columns(systems, found.gamma.values.ravel(), index=index, **flat)
    variables: dict[str, Any] = {
        name: (found.r_f.dims, columns[name].reshape(shape), {"long_name": text, "units": "1"})
        for name, text in FIELDS.items()
    }
    del variables["kind"][2]["units"]
    meanings = status.FLAG_MEANINGS
    variables["growth_status"][2].update(
        flag_values=np.arange(len(meanings.split()), dtype=np.int8), flag_meanings=meanings
    )
    return found.assign(variables).assign_attrs(title="Growth rates of small motions of towed cables")


def growth_columns(
    systems: Array, gamma: Array, *, r_f: Array, nodes: Integers, index: Integers, error: Array
) -> dict[str, NDArray[Any]]:
    """Growth rates of shapes that are known, of systems of which neighbours follow each other.

    Parameters
    ----------
    systems : ndarray, shape (systems, columns)
        As of `System.row`.
    gamma : ndarray, shape (systems,)
        Speeds [-].
    r_f, error : ndarray, shape (systems, shapes)
        Distances of the fish from the axis, nan where there is no shape, and their relative errors [-].
    nodes, index : ndarray of int, shape (systems, shapes)
        As of `Stability`.

    Returns
    -------
    dict of ndarray, shape (systems, shapes)
        FIELDS.
    """
    from towatlas.kernels.sweeps import threads

    missing: dict[str, Any] = {
        "growth": np.nan,
        "frequency": np.nan,
        "growth_error": np.nan,
        "unstable": -1,
        "index": -1,
    }
    out: dict[str, NDArray[Any]] = {name: np.full(r_f.shape, value) for name, value in missing.items()}
    out["kind"] = np.full(r_f.shape, "", "<U10")
    out["growth_status"] = np.full(r_f.shape, status.OK, np.int8)
    there = np.isfinite(r_f)
    with ThreadPoolExecutor(threads()) as pool:
        for begin in range(0, len(gamma), LINKS * CHAINS):
            check_patience("growth rates of many systems", REMEDY, done=begin, of=len(gamma))
            firsts = np.arange(begin, min(begin + LINKS * CHAINS, len(gamma)), LINKS)
            known: dict[int, list[tuple[int, int, float, Zeros]]] = {}
            for link in range(LINKS):
                rows = firsts + link
                rows = rows[(rows < len(gamma)) & (rows < begin + LINKS * CHAINS)]
                row, place = np.nonzero(there[rows])
                row = rows[row]
                for part in range(0, len(row), AT_A_TIME):
                    i, k = row[part : part + AT_A_TIME], place[part : part + AT_A_TIME]
                    parents = [
                        _parent(known.get(int(a) - 1, []), int(nodes[a, b]), int(index[a, b]), float(r_f[a, b]))
                        for a, b in zip(i, k, strict=True)
                    ]
                    shapes = Shapes(systems[i], gamma[i], r_f[i, k], error[i, k], index[i, k])
                    for a, b, answer in zip(i, k, _answers(shapes, parents, pool), strict=True):
                        _put(out, (a, b), answer, abs(gamma[a]))
                        if answer.zeros is not None:
                            mine = known.setdefault(int(a), [])
                            mine.append((int(nodes[a, b]), int(index[a, b]), float(r_f[a, b]), answer.zeros))
                known = {a: shapes for a, shapes in known.items() if a in rows}
    return out


def _answers(shapes: Shapes, parents: list[Zeros | None], pool: ThreadPoolExecutor) -> list[Answer]:
    """Of some shapes; where one takes more than a call may, of each by itself, so that it spoils no other."""
    try:
        return solve_shapes(shapes, parents, pool)
    except TooMuchWork:
        if len(parents) == 1:
            return [Answer(complex(np.nan), np.nan, -1, -1, status.STEP_LIMIT, None)]
        halves = np.array_split(np.arange(len(parents)), 2)
        return [answer for half in halves for answer in _answers(shapes.part(half), [parents[k] for k in half], pool)]


def _put(out: dict[str, NDArray[Any]], at: tuple[int, int], answer: Answer, speed: float) -> None:
    out["growth"][at], out["frequency"][at] = answer.sigma.real * speed, answer.sigma.imag * speed
    out["growth_error"][at] = answer.error * speed
    out["kind"][at] = kind_of(answer.unstable, answer.sigma, answer.error)
    for name in ("unstable", "index"):
        out[name][at] = getattr(answer, name)
    out["growth_status"][at] = answer.status


def _parent(of: list[tuple[int, int, float, Zeros]], nodes: int, index: int, r_f: float) -> Zeros | None:
    """The zeros of the shape of a neighbour that is most like a shape."""
    alike = [(abs(np.log(r_f / other)), zeros) for n, i, other, zeros in of if (n, i) == (nodes, index)]
    return min(alike, key=lambda pair: pair[0])[1] if alike else None


def indices(systems: Array, r_f: Array, nodes: Integers) -> Integers:
    """Directions in which the energy of shapes in a vacuum falls.

    Parameters
    ----------
    systems : ndarray, shape (systems, columns)
        As of `System.row`.
    r_f : ndarray, shape (systems, shapes)
        Distances of the fish from the axis over tow radius [-], nan where there is no shape.
    nodes : ndarray of int, shape (systems, shapes)

    Returns
    -------
    ndarray of int, shape (systems, shapes)
        Of two with the same nodes the outer one is that farther from the axis; -1 in any other medium, and where there
        are not two of them.
    """
    index = np.full(r_f.shape, -1)
    for i, row in enumerate(systems):
        if not System(*(float(value) for value in row)).in_vacuum:
            continue
        for n in np.unique(nodes[i][nodes[i] >= 0]):
            pair = np.flatnonzero(nodes[i] == n)
            if n == 0 and len(pair) == 1:
                index[i, pair] = 0
            elif n > 0 and len(pair) == 2:
                index[i, pair[np.argsort(r_f[i, pair])]] = 2 * n, 2 * n - 1
    return index
