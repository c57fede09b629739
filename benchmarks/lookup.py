"""Third chart: the error of a value looked up against the time it takes, for many points and for one."""

import subprocess
import sys
import timeit
from collections.abc import Callable
from pathlib import Path

import numpy as np

import towatlas
from benchmarks.samples import SEED, cables
from benchmarks.timing import Row, once, seconds
from towatlas.numerics import chebyshev
from towatlas.tables.atlas import Atlas

POINTS = 100_000
ORDER = 1  # the peers hold one n at a time
REFERENCE_METHOD = "this project"


def measure(table: Atlas, points: int = POINTS) -> tuple[list[Row], dict[str, float]]:
    """Rows for many points and for one (setting), every peer on the nodes of our series; and times to construct."""
    from scipy.interpolate import RectBivariateSpline, RegularGridInterpolator

    _, w_f, _ = cables(points)
    lam = towatlas.threshold_length(w_f, ORDER) + 10.0 ** np.random.default_rng(SEED).uniform(-3, 3, points)
    exact = towatlas.solve_critical(lam, w_f, ORDER).gamma
    axes, series = table.critical.axes, table.critical.series("gamma", ORDER)
    x, y = chebyshev.nodes(series.shape[1]), chebyshev.nodes(series.shape[0])
    values = chebyshev.on_grid(series[None], y, x)[0]

    def through(evaluate: Callable) -> Callable:
        """gamma from a peer that holds the smooth field: the same coordinates before and the same law after."""

        def speed(lam: np.ndarray, w_f: np.ndarray) -> np.ndarray:
            excess = towatlas.excess_length(lam, w_f, ORDER)
            return np.exp(evaluate(axes.excess.coordinate(excess), axes.w_f.coordinate(w_f))) / np.sqrt(excess)

        return speed

    construct: dict[str, float] = {}
    makers: dict[str, Callable] = {
        f"RegularGridInterpolator {method}": lambda method=method: _grid(
            RegularGridInterpolator((y, x), values, method=method)
        )
        for method in ("linear", "cubic")
    }
    makers["RectBivariateSpline"] = lambda: _spline(RectBivariateSpline(y, x, values))
    makers |= {f"xarray.interp {method}": lambda method=method: _xarray(x, y, values, method) for method in ("linear",)}
    methods: dict[str, Callable] = {REFERENCE_METHOD: lambda lam, w_f: table.critical_speed(lam, w_f, ORDER)}
    for name, make in makers.items():
        made: list[Callable] = []
        construct[name] = once(lambda make=make, made=made: made.append(make()))
        methods[name] = through(made[0])
    rows = []
    for name, speed in methods.items():
        errors = np.abs(speed(lam, w_f) / exact - 1.0)
        rows.append(
            Row(
                name, f"{points} points", points, {"gamma": errors}, seconds(lambda s=speed: s(lam, w_f)) / points * 1e6
            )
        )
        # The peers take arrays only.
        one = (float(lam[0]), float(w_f[0])) if name == REFERENCE_METHOD else (lam[:1], w_f[:1])
        rows.append(Row(name, "one point", points, {"gamma": errors}, single(lambda s=speed, one=one: s(*one)) * 1e6))
    return rows, construct


def single(call: Callable, calls: int = 200) -> float:
    """Seconds of a call that takes microseconds, the collector of garbage at rest."""
    return min(timeit.repeat(call, number=calls, repeat=15)) / calls


def of_one(table: Atlas) -> dict[str, float]:
    """Seconds of one cable looked up in Python."""
    return {
        "one critical speed": single(lambda: table.critical_speed(37.8, 1352.0, 2)),
        "one state, all quantities with error and status": single(lambda: table.states(37.8, 1352.0, 2)),
    }


def _grid(interpolator: Callable) -> Callable:
    return lambda x, y: interpolator(np.stack([y, x], axis=-1))


def _spline(spline: "object") -> Callable:
    return lambda x, y: spline.ev(y, x)  # type: ignore[attr-defined]


def _xarray(x: np.ndarray, y: np.ndarray, values: np.ndarray, method: str) -> Callable:
    import xarray

    table = xarray.DataArray(values, {"y": y, "x": x}, ("y", "x"))
    return lambda at_x, at_y: (
        table.interp(
            x=xarray.DataArray(at_x, dims="point"), y=xarray.DataArray(at_y, dims="point"), method=method
        ).values
    )


def shell(path: Path, repeats: int = 5) -> dict[str, float]:
    """Seconds of whole processes: one lookup in the shell, and what of it Python and its imports take."""
    python = sys.executable
    commands = {
        "towatlas critical --lam 37.8 --wf 1352 --n 2": [
            *(python, "-m", "towatlas", "critical", "--lam", "37.8", "--wf", "1352", "--n", "2", "--atlas", str(path))
        ],
        "import numpy, netCDF4": [python, "-c", "import numpy, netCDF4"],
        "import numba, xarray": [python, "-c", "import numba, xarray"],
    }
    return {
        name: seconds(lambda c=command: subprocess.run(c, check=True, capture_output=True), repeats)
        for name, command in commands.items()
    }


def whole_domain(table: Atlas, points: int = POINTS) -> dict[str, float]:
    """Largest relative difference of every quantity from the direct solution; share of error estimates that hold."""
    n, w_f, lam = cables(points)
    found, exact = table.states(lam, w_f, n), towatlas.solve_critical(lam, w_f, n)
    names = ("gamma", "R_x0", "x_f", "z_f", "tension")
    worst = {name: float(np.abs(getattr(found, name) / getattr(exact, name) - 1).max()) for name in names}
    covered = np.abs(found.gamma / exact.gamma - 1) <= found.error + exact.error
    return worst | {"error estimates that hold": float(covered.mean())}


def open_or_build(path: Path) -> Atlas:
    """The atlas at a path, built there if there is none."""
    if not path.exists():
        from towatlas.builders.critical import build_atlas

        build_atlas(path, progress=False)
    return towatlas.open_atlas(path)
