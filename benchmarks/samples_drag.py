"""Random systems with drag, their shapes and folds in long double, kept in files.

`python -m benchmarks.samples_drag` computes the numbers of docs/data/reference_drag*.csv anew (some minutes). How many
shapes and folds there are it leaves as it finds it: that was counted by an independent code, DOP853 and Radau in double
precision, scans of 5,000 shots and more a system.
"""

import sys
from dataclasses import astuple, dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.samples import DATA, ROOT, columns, pair, write_table
from towatlas.system import System

SEED = 12
SYSTEMS = 40  # of each family
FAMILIES = ("air", "water")
NUMBERS = ("lam", "w_f", "m_f", "C", "C_f", "w", "C_t")
DIGITS = 20
# An extremum is that of the quartic through five shots this far apart in log r; its coefficients, highest first.
APART = np.longdouble(1e-4)
THROUGH = np.array(
    [[1, -4, 6, -4, 1], [-2, 4, 0, -4, 2], [-1, 16, -30, 16, -1], [2, -16, 0, 16, -2], [0, 0, 24, 0, 0]]
) / np.longdouble(24)

Array = NDArray[np.float64]


def air(rows: int, seed: int = SEED) -> tuple[list[System], Array]:
    """Random systems in air and speeds; a fifth without a fish."""
    rng = np.random.default_rng(seed)
    found, gamma = [], np.empty(rows)
    for i in range(rows):
        c, lam, w_f = 10 ** rng.uniform(-3, 2), np.exp(rng.uniform(np.log(0.5), np.log(200))), 10 ** rng.uniform(-3, 4)
        w_f = 0.0 if rng.random() < 0.2 else w_f
        gamma[i] = np.exp(rng.uniform(np.log(0.01), np.log(50)))
        found.append(System(lam, w_f, w_f, C=c))
    return found, gamma


def water(rows: int, seed: int = SEED) -> tuple[list[System], Array]:
    """Random systems in water and speeds; a fifth without the weight of a fish, half without each of its drags."""
    rng = np.random.default_rng(seed + 1000)
    found, gamma = [], np.empty(rows)
    for i in range(rows):
        w, c, gamma[i] = rng.uniform(0.1, 0.9), 10 ** rng.uniform(0, 5), 10 ** rng.uniform(-3, 0)
        lam, w_f = np.exp(rng.uniform(np.log(0.5), np.log(200))), 10 ** rng.uniform(-3, 1)
        w_f = 0.0 if rng.random() < 0.2 else w_f
        m_f = w_f * rng.uniform(1, 3)
        share = [c * rng.uniform(0, 0.05) * (rng.random() >= 0.5) for _ in range(2)]
        found.append(System(lam, w_f, m_f, C=c, C_f=share[0], w=w, C_t=share[1]))
    return found, gamma


SAMPLES = {"air": air, "water": water}


def arrays(systems: list[System]) -> dict[str, Array]:
    """Arguments of `equilibria_many` but for the speed."""
    return dict(zip(NUMBERS, np.array([astuple(system)[: len(NUMBERS)] for system in systems]).T, strict=True))


def named(system: System) -> dict[str, float]:
    """Arguments of functions that take one system but for the speed."""
    return {name: getattr(system, name) for name in NUMBERS}


@dataclass(frozen=True)
class DragReference:
    """Systems, what is known of each beside, and their answers: a row of the system, a double and what it lacks."""

    systems: list[System]
    given: list[dict[str, float]]
    row: NDArray[np.int64]
    exact: tuple[Array, Array]

    def errors(self, found: list[Array], near: float = np.inf) -> Array:
        """Relative errors, nan where there is no answer: each is one to the nearest exact one, if as near as that."""
        errors = np.full(len(self.row), np.nan)
        for row, answers in enumerate(found):
            at = np.flatnonzero(self.row == row)
            high, low = (part[at] for part in self.exact)
            for answer in answers[np.isfinite(answers)]:
                k = int(np.argmin(np.abs(answer - high)))
                error = abs((answer - high[k]) - low[k]) / high[k]
                if error <= near:
                    errors[at[k]] = np.fmin(errors[at[k]], error)
        return errors

    def extra(self, found: list[Array], near: float) -> int:
        """How many answers are nearer than that to none of the exact ones."""
        return sum(
            int((np.abs(answer / self.exact[0][self.row == row] - 1.0) > near).all())
            for row, answers in enumerate(found)
            for answer in answers
        )

    def take(self, rows: NDArray[np.int64]) -> "DragReference":
        """Some of the systems."""
        at = np.concatenate([np.flatnonzero(self.row == row) for row in rows])
        again = np.searchsorted(rows, self.row[at])
        high, low = self.exact
        return DragReference(
            [self.systems[row] for row in rows], [self.given[row] for row in rows], again, (high[at], low[at])
        )


def _read(name: str, given: tuple[str, ...], answer: str) -> DragReference:
    c = columns(DATA / f"{name}.csv")
    keys = list(zip(*(c[key] for key in (*NUMBERS, *given)), strict=True))
    first = list(dict.fromkeys(keys))
    systems = [System(**dict(zip(NUMBERS, map(float, key), strict=False))) for key in first]  # type: ignore[arg-type]
    beside = [dict(zip(given, map(float, key[len(NUMBERS) :]), strict=True)) for key in first]
    return DragReference(systems, beside, np.array([first.index(key) for key in keys]), pair(c[answer]))


@cache
def shape_reference() -> DragReference:
    """All shapes of the first SYSTEMS systems of each sample: r_f."""
    return _read("reference_drag", ("gamma",), "r_f")


@cache
def fold_reference(kind: str) -> DragReference:
    """Folds in speed: of pairs that drag lets be ("pairs", beside: n), all within an octave ("octaves": low)."""
    return _read(f"reference_drag_{kind}", ("n",) if kind == "pairs" else ("low",), "gamma")


def long_shots() -> Any:
    """The module of the shots in long double."""
    if str(ROOT / "tests") not in sys.path:
        sys.path.insert(0, str(ROOT / "tests"))
    import reference_drag

    return reference_drag


def _log_rho(x: Any, gamma: Any, system: System) -> Any:
    state = long_shots().shot(np.exp(np.longdouble(x)), gamma, system)
    return np.log(state[0] ** 2 + state[1] ** 2) / 2


def exact_shape(r_f: float, gamma: float, system: System) -> str:
    """r_f of a shape in long double, from a double: secants."""
    x = [np.log(np.longdouble(r_f)) + np.longdouble(step) for step in (0.0, 1e-9)]
    value = [_log_rho(z, gamma, system) for z in x]
    for _ in range(4):
        if value[1] == value[0]:
            break
        x = [x[1], x[1] - value[1] * (x[1] - x[0]) / (value[1] - value[0])]
        if abs(x[1] - x[0]) < 1e-18 * max(1, abs(x[1])):
            break
        value = [value[1], _log_rho(x[1], gamma, system)]
    return np.format_float_scientific(np.exp(x[1]), DIGITS - 1)


def exact_place(r_f: float, gamma: float, system: System) -> dict[str, Any]:
    """r_f, z_f, phase_deg less whole turns and tension of a shape in long double, from a double."""
    radius = np.longdouble(exact_shape(r_f, gamma, system))
    state = long_shots().shot(radius, gamma, system)
    return {
        "r_f": radius,
        "z_f": -state[2],
        "phase_deg": np.degrees(np.arctan2(state[1], state[0])),
        "tension": np.sqrt(state[3:] @ state[3:]),
    }


def fish_at_fold(gamma: float, system: System) -> float:
    """r_f at the fold nearest to a speed, in double precision."""
    import towatlas

    found = towatlas.folds(gamma=(gamma * 0.99, gamma * 1.01), **named(system))
    return float(found.r_f[np.argmin(np.abs(found.gamma - gamma))])


def exact_fold(r_f: float, gamma: float, system: System) -> str:
    """gamma of a fold in long double, from doubles: the speed at which the extremum of log rho in log r is zero."""
    x = np.log(np.longdouble(r_f))

    def extremum(at: Any) -> Any:
        nonlocal x
        for _ in range(4):
            series = THROUGH @ np.array([_log_rho(x + k * APART, at, system) for k in range(-2, 3)])
            slope, u = np.polyder(series), np.longdouble(0)
            for _ in range(6):
                u -= np.polyval(slope, u) / np.polyval(np.polyder(slope), u)
            x += u * APART
            if abs(u) < 1.0:
                break
        return np.polyval(series, u)

    speed = [np.longdouble(gamma), np.longdouble(gamma) * (1 + np.longdouble(1e-7))]
    value = [extremum(at) for at in speed]
    for _ in range(4):
        if value[1] == value[0] or abs(speed[1] / speed[0] - 1) < 1e-18:
            break
        speed = [speed[1], speed[1] - value[1] * (speed[1] - speed[0]) / (value[1] - value[0])]
        value = [value[1], extremum(speed[1])]
    return np.format_float_scientific(speed[1], DIGITS - 1)


ABOUT = (
    "Long double, extrapolated midpoint rule (tests/reference_drag.py), from roots listed by an independent code:\n"
    "DOP853 and Radau in double precision to 3e-13, "
)
SHAPES = (
    f"r_f of all shapes of the first {SYSTEMS} systems in air and in water of benchmarks.samples_drag, default_rng\n"
    f"seed {SEED}. {ABOUT}5,000 shots a system and more, residuals\n"
    "below 3e-11; in long double the roots moved by at most 4e-12. Good to 15 digits: of twelve\n"
    "of them other steps of the extrapolation moved one by 2e-16, the others by less."
)
PAIRS = (
    "gamma at which the n-th pair of shapes appears; extrema of the radius by five shots in long double\n"
    "(tests/reference_drag.py). Random cables for which solve_drag_folds finds one: lam 16 to 60, w_f 1e-2 to 2000,\n"
    "C 1e-3 to 1, n 1 to 3. Of the 20 digits 16 are good: of 12 rows at random other steps and other shots for the\n"
    "extremum (python -m benchmarks.digits 12 reference_drag_pairs) moved none by more than 2e-17, relative."
)
OCTAVES = (
    "All folds within an octave of speed from low. Counted by an independent code, DOP853 with dense scans of r_f at\n"
    "60 speeds between 0.05 and 20 (air), 0.001 and 0.3 (water), and bisection; in long double they moved by at most\n"
    "5e-8, what bisection had left (tests/reference_drag.py). Of the 20 digits 15 are good: of 12 rows at random\n"
    "other steps and other shots for the extremum (python -m benchmarks.digits 12 reference_drag_octaves) moved none\n"
    "by more than 3e-16, relative."
)


def _row(system: System, **others: str) -> dict[str, str]:
    return {name: repr(float(getattr(system, name))) for name in NUMBERS} | others


def main() -> None:
    known = shape_reference()
    write_table(
        DATA / "reference_drag.csv",
        SHAPES,
        [
            _row(known.systems[k], gamma=repr(gamma), r_f=exact_shape(r_f, gamma, known.systems[k]))
            for r_f, k in zip(known.exact[0], known.row, strict=True)
            for gamma in (known.given[k]["gamma"],)
        ],
    )
    for kind, about in (("pairs", PAIRS), ("octaves", OCTAVES)):
        known, rows = fold_reference(kind), []
        for gamma, k in zip(known.exact[0], known.row, strict=True):
            s = known.systems[k]
            beside = {name: f"{value:.17g}" for name, value in known.given[k].items()}
            rows.append(_row(s, **beside, gamma=exact_fold(fish_at_fold(gamma, s), gamma, s)))
        write_table(DATA / f"reference_drag_{kind}.csv", about, rows)


if __name__ == "__main__":
    main()
