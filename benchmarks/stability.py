"""The chart of growth rates: errors of the leading eigenvalue against time.

`python -m benchmarks.stability` measures it alone, and writes its figure, data and table; with `--exact` it computes
the reference anew, in a few minutes.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

import towatlas
from benchmarks import figures, report
from benchmarks import peers_stability as peers
from benchmarks.chain import Chain
from benchmarks.samples import DATA, ROOT, write_table
from benchmarks.timing import Row, once
from towatlas.results import Equilibria
from towatlas.solve.galerkin import matrices
from towatlas.solve.growth import reach_of
from towatlas.solve.motion import BOUND, Motion, motions
from towatlas.solve.spectrum import polish

OURS = "stability"
FILE = DATA / "reference_stability.csv"
# A guess this far off, relatively, is what Galerkin's method gives at its default.
GOOD = 1e-3

Array = np.ndarray


@dataclass(frozen=True)
class Case:
    """A shape, the one that is expected, and the mode asked for: the leading one."""

    name: str
    lam: float
    w_f: float
    gamma: float
    fluid: tuple[tuple[str, float], ...] = ()

    @property
    def found(self) -> Equilibria:
        """All shapes."""
        return _found(self)


@cache
def _found(case: Case) -> Equilibria:
    return towatlas.equilibria(case.lam, case.w_f, case.gamma, **dict(case.fluid))


CASES = (
    Case("vacuum", 37.8, 1352.0, 5.94),
    Case("air", 37.8, 1352.0, 5.94, (("C", 0.018),)),
    Case("kink", 10.0, 1.0, 1.5, (("C", 0.03),)),
    Case("water", 3.0, 0.2, 0.3, (("C", 50.0), ("w", 0.55), ("m_f", 0.3), ("C_f", 0.5), ("C_t", 1.0))),
    Case("layers", 10.0, 1.0, 8.0),
)


def motion_of(case: Case, bound: float = BOUND) -> Motion:
    """Coefficients along a shape."""
    found = case.found
    r_f = found.r_f[found.expected : found.expected + 1]
    reach = reach_of(found.system, found.gamma)
    return motions(r_f, np.array([found.gamma]), found.system.row()[None], reach, bound)[0]


def compute_reference() -> None:
    """docs/data/reference_stability.csv: with 19 digits throughout, on the mesh of this project's shots."""
    rows = []
    for case in CASES:
        motion = motion_of(case)
        lengths = (motion.series[:, :, 0] / np.arange(1, motion.series.shape[1] + 1)).sum(1) * motion.sizes
        found = towatlas.stability_of(case.found)
        guess = found.eigenvalues[case.found.expected][0] / case.gamma
        both = [peers.exact(case.found, case.found.expected, guess, np.repeat(lengths, n) / n) for n in (1, 2)]
        cells = {"growth": both[1].real, "frequency": both[1].imag, "change": abs(both[1] - both[0])}
        rows.append({"case": case.name} | {name: f"{value:.17g}" for name, value in cells.items()})
    text = "Leading eigenvalues over gamma; change: when the steps are halved."
    text += "\nWritten by python -m benchmarks.stability --exact."
    write_table(FILE, text, rows)


@cache
def reference() -> tuple[complex, ...]:
    """Leading eigenvalues of CASES, in units of Omega."""
    lines = [line.split(",") for line in FILE.read_text().splitlines() if not line.startswith("#")]
    by_name = {name: complex(float(growth), float(frequency)) for name, growth, frequency, _ in lines[1:]}
    return tuple(by_name[case.name] for case in CASES)


def _row(method: str, setting: str, solve: Callable[[Case, complex], complex], warm: bool = False) -> Row:
    """A row for a method that is given a shape and a guess of the eigenvalue."""
    answers: list[complex] = []
    jobs = [(case, exact * (1.0 + GOOD)) for case, exact in zip(CASES, reference(), strict=True)]
    if warm:
        solve(*jobs[0])

    def run() -> None:
        for job in jobs:
            with np.errstate(all="ignore"):
                answers.append(solve(*job))

    spent = once(run)
    errors = np.abs(np.array(answers) - np.array(reference()))
    errors = np.where(errors < 1.0, errors, np.nan)
    return Row(method, setting, len(jobs), {"sigma": errors}, spent / len(jobs) * 1e6)


def measure(full: bool = True) -> list[Row]:
    """All methods and settings; a few cheap ones if not full."""
    for case in CASES:
        _shape(case)
    table = [_row(OURS, "order 20, default", lambda case, guess: _ours(case, guess, BOUND), warm=True)]
    for bound in (0.7, 0.35, 0.15) if full else ():
        table.append(
            _row("order 20, shorter steps", f"bound {bound:g}", lambda c, g, b=bound: _ours(c, g, b), warm=True)
        )
    for panel, degrees in ((5.0, (4, 8, 11, 14)), (2.5, (4, 8, 11)), (1e9, (10, 24, 48))) if full else ((5.0, (8,)),):
        name = "Galerkin, one panel" if panel > 1e3 else f"Galerkin, panels of {panel:g}"
        for degree in degrees:
            table.append(_row(name, f"degree {degree}", lambda c, g, d=degree, p=panel: _galerkin(c, g, d, p)))
    for method, rtols in (
        (("DOP853", (1e-4, 1e-7, 1e-10, 1e-13)), ("LSODA", (1e-4, 1e-7, 1e-10))) if full else (("DOP853", (1e-7,)),)
    ):
        for rtol in rtols:
            march = peers.by_scipy(method, rtol)
            table.append(_row(f"Evans, SciPy {method}", f"rtol {rtol:g}", lambda c, g, m=march: _evans(c, g, m)))
    for segments in (100, 400, 1600) if full else ():
        march = peers.by_rk4(segments)
        table.append(_row("Evans, RK4", f"N = {segments}", lambda c, g, m=march: _evans(c, g, m)))
    for cells in (50, 200, 800, 3200) if full else (200,):
        table.append(_row("finite differences, eigs", f"N = {cells}", lambda c, g, n=cells: _differences(c, g, n)))
    for links in (25, 100, 400, 1600) if full else (50,):
        table.append(_row("chain of links", f"N = {links}", lambda c, g, n=links: _chain(c, g, n)))
    return table


def _ours(case: Case, guess: complex, bound: float) -> complex:
    start = np.array([guess])
    return complex(polish(motion_of(case, bound), start, start)[0].sigma[0])


def _galerkin(case: Case, guess: complex, degree: int, panel: float) -> complex:
    """The nearest of all eigenvalues."""
    mass, friction, stiffness = matrices(motion_of(case), degree, panel)
    # Functions on short panels weigh little: rounding is kept small by scales, and the mass as unit.
    scale = 1.0 / np.sqrt(np.diag(mass))
    mass, friction, stiffness = (scale[:, None] * part * scale for part in (mass, friction, stiffness))
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    friction, stiffness = inverse @ friction @ inverse.T, inverse @ stiffness @ inverse.T
    size = len(mass)
    sigma = np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], [-stiffness, -friction]]))
    return complex(sigma[np.argmin(np.abs(sigma - guess))])


def _evans(case: Case, guess: complex, march: Callable) -> complex:
    return peers.by_secants(case.found, case.found.expected, guess, march)


def _differences(case: Case, guess: complex, cells: int) -> complex:
    return peers.by_finite_differences(case.found, case.found.expected, guess, cells)


@cache
def _shape(case: Case) -> object:
    return towatlas.shape_of(case.found, case.found.expected, np.linspace(0.0, case.lam, 4001))


def _chain(case: Case, guess: complex, links: int) -> complex:
    chain = Chain(case.found.system, case.gamma, links)
    try:
        return chain.eigenvalue_near(*chain.rest(_shape(case)), guess * case.gamma) / case.gamma
    except ArithmeticError:
        return complex(np.nan)


def run(say: Callable[[str], None]) -> None:
    """Measure, draw and write; one thread."""
    say("growth rates ...")
    rows = measure()
    figures.stability(rows, ROOT / "docs" / "stability_cost")
    report.chart_csv("stability_cost", rows, OURS)
    text = report.chart_table(rows, OURS, ("sigma",))
    report.put(report.METHODS, "stability", text)
    say(f"\nstability\n\n{text}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.stability", description=__doc__)
    parser.add_argument("--exact", action="store_true", help="compute the reference anew")
    if parser.parse_args().exact:
        compute_reference()
    run(lambda text: print(text, flush=True))
