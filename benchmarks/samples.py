"""Random cables and shots over the whole domain of the atlas, and their answers to 34 digits, kept in files.

`python -m benchmarks.samples` computes the answers anew (half an hour): docs/data/reference_shots.csv and
docs/data/reference_folds.csv, by the shots of tests/reference.py in 50 digits, which share nothing with the kernels.
`python -m benchmarks.digits` says how many digits of the files shots in 66 leave as they are.
"""

import csv
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import towatlas

ROOT = Path(__file__).parent.parent
DATA = ROOT / "docs" / "data"
SEED = 2026
# Of the answers; and of the shots, which lose some to what they amplify.
DIGITS, WORKING = 34, 50
SHOTS, FOLDS = 600, 200

Array = NDArray[np.float64]


def cables(rows: int, seed: int = SEED) -> tuple[NDArray[np.int64], Array, Array]:
    """Random (n, w_f, lam) over the domain of the atlas, uniform in the logarithms; a tenth without a fish."""
    rng = np.random.default_rng(seed)
    n = rng.integers(1, 7, rows)
    w_f = np.where(rng.random(rows) < 0.1, 0.0, 10.0 ** rng.uniform(-5, 4, rows))
    return n, w_f, towatlas.threshold_length(w_f, n) + 10.0 ** rng.uniform(-3, 3, rows)


def shots(rows: int, seed: int = SEED) -> tuple[Array, Array, Array]:
    """Random (a, mu, tau): random cables, at speeds within 2 of critical and fish offsets within 3 of the fold's."""
    n, w_f, lam = cables(rows, seed)
    states = towatlas.solve_critical(lam, w_f, n)
    rng = np.random.default_rng(seed + 1)
    gamma = states.gamma * 2.0 ** rng.uniform(-1, 1, rows)
    return np.abs(states.x_f) * states.gamma**2 * 3.0 ** rng.uniform(-1, 1, rows), w_f * gamma**2, lam * gamma**2


@dataclass(frozen=True)
class ShotReference:
    """Shots and their answers, each as a double and what the double lacks; amplitudes are what errors are over."""

    a: Array
    mu: Array
    tau: Array
    p: tuple[Array, Array]
    q: tuple[Array, Array]
    f: Array
    amplitude: Array
    q_amplitude: Array

    def errors(self, p: Array, q: Array | None = None) -> dict[str, Array]:
        """Errors over the local amplitude of p and, where given, of q; nan where the value is."""
        found = {"p": np.abs((p - self.p[0]) - self.p[1]) / self.amplitude}
        if q is not None:
            found["q"] = np.abs((q - self.q[0]) - self.q[1]) / self.q_amplitude
        return found

    def head(self, rows: int) -> "ShotReference":
        """The first rows."""
        cut: dict[str, Any] = {
            name: tuple(part[:rows] for part in value) if isinstance(value, tuple) else value[:rows]
            for name, value in vars(self).items()
        }
        return ShotReference(**cut)


@dataclass(frozen=True)
class FoldReference:
    """Cables and their critical speeds, as a double and what the double lacks."""

    n: NDArray[np.int64]
    w_f: Array
    lam: Array
    gamma: tuple[Array, Array]

    def errors(self, gamma: Array) -> Array:
        """Relative errors; nan where the value is."""
        return np.abs((gamma - self.gamma[0]) - self.gamma[1]) / self.gamma[0]


def columns(path: Path) -> dict[str, list[str]]:
    with path.open(newline="") as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    return {name: [row[name] for row in rows] for name in rows[0]}


def doubles(texts: list[str]) -> Array:
    return np.array([float(text) for text in texts])


def pair(texts: list[str]) -> tuple[Array, Array]:
    from mpmath import mp

    high = doubles(texts)
    with mp.workdps(DIGITS + 5):
        low = np.array([float(mp.mpf(text) - mp.mpf(value)) for text, value in zip(texts, high, strict=True)])
    return high, low


def shot_reference() -> ShotReference:
    """Answers of `shots(SHOTS)`, from their file."""
    c = columns(DATA / "reference_shots.csv")
    single = {name: doubles(c[name]) for name in ("a", "mu", "tau", "f", "amplitude", "q_amplitude")}
    return ShotReference(**single, p=pair(c["p"]), q=pair(c["q"]))


def fold_reference() -> FoldReference:
    """Answers of `cables(FOLDS)`, from their file."""
    c = columns(DATA / "reference_folds.csv")
    return FoldReference(
        n=np.array([int(text) for text in c["n"]]),
        w_f=doubles(c["w_f"]),
        lam=doubles(c["lam"]),
        gamma=pair(c["gamma"]),
    )


def exact_shots(a: Array, mu: Array, tau: Array, digits: int = WORKING) -> list[dict[str, str]]:
    """The shots; rows of a file."""
    from mpmath import mp

    slow = _mpmath_shots()
    rows = []
    for start in zip(a.tolist(), mu.tolist(), tau.tolist(), strict=True):
        end = slow.shot(*start, digits)
        with mp.workdps(DIGITS + 5):
            answers = {name: mp.nstr(getattr(end, name), DIGITS, strip_zeros=False) for name in ("p", "q", "f")}
            scales = {name: repr(float(getattr(end, name))) for name in ("amplitude", "q_amplitude")}
        rows.append(dict(zip(("a", "mu", "tau"), map(repr, start), strict=True)) | answers | scales)
    return rows


def exact_folds(n: NDArray[np.int64], w_f: Array, lam: Array, digits: int = WORKING) -> list[dict[str, str]]:
    """Critical speeds, from the direct solution by Newton's method; rows of a file."""
    from mpmath import mp

    slow = _mpmath_shots()
    states = towatlas.solve_critical(lam, w_f, n)
    rows = []
    for i in range(len(n)):
        a = abs(float(states.x_f[i])) * float(states.gamma[i]) ** 2
        gamma = slow.fold(int(n[i]), float(w_f[i]), float(lam[i]), a, float(states.gamma[i]), digits)
        with mp.workdps(DIGITS + 5):
            answer = mp.nstr(gamma, DIGITS, strip_zeros=False)
        rows.append({"n": str(n[i]), "w_f": repr(float(w_f[i])), "lam": repr(float(lam[i])), "gamma": answer})
    return rows


def _mpmath_shots() -> Any:
    sys.path.insert(0, str(ROOT / "tests"))
    import reference

    return reference


def write_table(path: Path, comment: str, rows: list[dict[str, str]]) -> None:
    """A CSV file with a comment above its header."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        file.writelines(f"# {line}\n" for line in comment.splitlines())
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def shots_of_file() -> tuple[Array, Array, Array]:
    """(a, mu, tau) of docs/data/reference_shots.csv: `shots` follow the solver of the day in their last digits."""
    c = columns(DATA / "reference_shots.csv")
    return doubles(c["a"]), doubles(c["mu"]), doubles(c["tau"])


def main() -> None:
    digits = f"{DIGITS} digits, Taylor of order {WORKING + 2} in {WORKING} digits of mpmath"
    write_table(
        DATA / "reference_folds.csv",
        f"Critical speeds gamma_cn of doubles n, w_f, lam. {digits}.\n"
        f"Sample: benchmarks.samples.cables, numpy default_rng seed {SEED}; confirmed by python -m benchmarks.digits.",
        exact_folds(*cables(FOLDS)),
    )
    write_table(
        DATA / "reference_shots.csv",
        f"Fish-up shots from (a, mu) over tau of cable, lengths over g/Omega^2: p, q = dp/da and f at their ends.\n"
        f"{digits}; confirmed by python -m benchmarks.digits.\n"
        f"Sample: benchmarks.samples.shots, numpy default_rng seed {SEED}.\n"
        "Amplitudes, doubles, are sqrt(p^2 + f^2/r) and sqrt(q^2 + v^2/r).",
        exact_shots(*shots_of_file()),
    )


if __name__ == "__main__":
    main()
