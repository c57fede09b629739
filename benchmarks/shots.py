"""First chart: the error of a shot against the time it takes."""

from collections.abc import Callable

import numpy as np

from benchmarks import methods_shots as ours
from benchmarks import peers_shots as peers
from benchmarks.samples import ShotReference, shot_reference
from benchmarks.timing import Row, once, seconds
from towatlas.kernels.calls import ORDER, forward_shots

REFERENCE_METHOD = "Taylor, this project"


def measure(rows: int = 600, slow_rows: int = 24, full: bool = True) -> list[Row]:
    """Every method on the shots of the reference; slow ones on the first `slow_rows`. Small where not `full`."""
    exact = shot_reference().head(rows)
    few = exact.head(slow_rows)
    length = ours.lengths(exact.a, exact.mu, exact.tau)
    found = [_row(REFERENCE_METHOD, f"order {ORDER}", exact, ours.march, fast=True)]

    def march_of(order: int) -> Callable:
        kernel = ours.march_of_order(order)
        return lambda *shot: ours.march(*shot, kernel)

    for order in (8, 12, 16, 24) if full else (12,):
        found.append(_row("Taylor, other orders", f"order {order}", exact, march_of(order), fast=True))
    for segments in (10, 100, 1000, 10_000, 100_000) if full else (10, 100):
        for variable in ours.RK4_FISH_UP:

            def shoot(*shot: np.ndarray, variable: str = variable, segments: int = segments) -> tuple:
                return ours.rk4_fish_up(variable, *shot, length, segments)

            found.append(_row(f"RK4 fish-up in {variable}", f"N = {segments}", exact, shoot, fast=segments <= 1000))
        found.append(_forward(exact, segments))
    for segments in (10, 100, 1000) if full else (10,):
        found.append(
            _row("order 8, fixed", f"N = {segments}", exact, lambda *shot, n=segments: ours.order_8(*shot, segments=n))
        )
    tolerances = (1e-4, 1e-7, 1e-10, 1e-13)
    for rtol in tolerances if full else (1e-7,):
        found.append(
            _row("order 8, adaptive", f"rtol {rtol:g}", exact, lambda *shot, r=rtol: ours.order_8(*shot, rtol=r))
        )
    for rtol in tolerances if full else (1e-7,):
        for method in ("DOP853", "LSODA"):
            found.append(
                _row(
                    f"SciPy {method}",
                    f"rtol {rtol:g}",
                    few,
                    lambda *shot, m=method, r=rtol: peers.scipy_shots(*shot, m, r),
                    warm=False,
                )
            )
    absent = peers.missing()
    if full and "CyRK" not in absent:  # it takes ten seconds to compile
        for rtol in tolerances:
            found.append(
                _row("CyRK DOP853", f"rtol {rtol:g}", exact.head(100), lambda *shot, r=rtol: peers.cyrk_shots(*shot, r))
            )
    if "heyoka" not in absent:
        for variable in ("t", "sigma"):
            for tolerance in (1e-5, 1e-10, 2.2e-16) if full else (2.2e-16,):
                found += _heyoka(exact, length, variable, tolerance)
        for tolerance in (1e-5, 1e-10, 2.2e-16) if full else (2.2e-16,):
            integrator = peers.Heyoka("sigma", tolerance, event=True)

            def to_event(*shot: np.ndarray, integrator: peers.Heyoka = integrator) -> tuple:
                return integrator.scalar(*shot, length)[:2]

            found.append(_row("heyoka in sigma, scalar, event", f"tol {tolerance:g}", exact, to_event, fast=True))
    return found


def _row(
    method: str, setting: str, exact: ShotReference, shoot: Callable, fast: bool = False, warm: bool = True
) -> Row:
    shot = exact.a, exact.mu, exact.tau
    answer: list[tuple] = []
    spent = seconds(lambda: answer.append(shoot(*shot))) if fast else 0.0
    if not fast:
        if warm:
            shoot(*shot)
        spent = once(lambda: answer.append(shoot(*shot)))
    p, q = answer[-1]
    return Row(method, setting, len(p), exact.errors(p, q), spent / len(p) * 1e6)


def _forward(exact: ShotReference, segments: int) -> Row:
    """Skop's shots: every end of a fish-up shot is an equilibrium, shot back down to the fish from what it says."""
    p, f = exact.p[0], exact.f
    size, rows = np.abs(p), len(p)
    errors, x, force = np.empty(rows), np.empty(rows), np.empty(rows)

    def shoot() -> None:
        cable = exact.tau / size, exact.mu / size, np.sqrt(size), np.sign(p) * f / size
        forward_shots(*cable, segments, errors, x, force, 0, rows)

    spent = seconds(shoot) if segments <= 1000 else once(shoot)
    # The offset of the fish over the amplitude there.
    amplitude = exact.a * np.sqrt(1.0 + exact.mu / np.sqrt(1.0 + exact.a**2))
    miss = np.abs(x * p - exact.a) / amplitude
    return Row("RK4 forward (Skop)", f"N = {segments}", rows, {"p": miss}, spent / rows * 1e6)


def _heyoka(exact: ShotReference, length: np.ndarray, variable: str, tolerance: float) -> list[Row]:
    rows = len(exact.a) // peers.BATCH * peers.BATCH
    exact, length = exact.head(rows), length[:rows]
    shot = exact.a, exact.mu, exact.tau
    integrator = peers.Heyoka(variable, tolerance)
    steps = integrator.scalar(*shot, length)[2]
    order = np.argsort(steps, kind="stable")
    back = np.argsort(order)
    ordered = [column[order] for column in (*shot, length)]
    found = []
    for name, run, place in (
        ("scalar", lambda: integrator.scalar(*shot, length)[:2], slice(None)),
        (f"batch of {peers.BATCH}", lambda: integrator.batch(*ordered), back),
    ):
        spent = seconds(run, 3)
        p, q = run()
        errors = exact.errors(p[place], q[place])
        found.append(Row(f"heyoka in {variable}, {name}", f"tol {tolerance:g}", rows, errors, spent / rows * 1e6))
    return found
