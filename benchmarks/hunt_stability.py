"""`python -m benchmarks.hunt_stability`: growth rates of random cables, counted or not, against another program.

Written to docs/data/hunt_stability.csv, a row a shape; a summary on standard output. The other program integrates the
equations of `benchmarks.peers_stability` by DOP853, from the fish up, in double precision.
"""

import argparse
import collections
import time
from collections.abc import Callable, Iterator

import numpy as np

import towatlas
from benchmarks import peers_stability as peers
from benchmarks.samples import DATA, write_table
from towatlas.results import Equilibria
from towatlas.results_motion import Stability

SEED = 7048
SHAPES = 100
CABLE = ("lam", "w_f", "gamma", "C", "w", "m_f", "C_t", "C_f", "C_s", "b_s")
# Shapes of one cable that are looked at, at most.
EACH = 2
RTOL, PIECES = 1e-12, 50
# Slopes that the other program may ask for, for one growth rate: some seconds.
MOST = 100_000

Rng = np.random.Generator


class TooLongError(ArithmeticError):
    """The other program would take too long."""


def draw(rng: Rng) -> dict[str, float]:
    """A cable: w_f to 1e4, lam to 200, gamma to 20, C to 1e4, a third of them without drag, a sixth without a fish; to
    half of them w to 0.05, C_t to 1, C_f to 10, |C_s| to 1 and b_s to 10."""
    cable = {
        "lam": 10.0 ** rng.uniform(-0.5, np.log10(200.0)),
        "w_f": 0.0 if rng.random() < 1.0 / 6.0 else 10.0 ** rng.uniform(-3.0, 4.0),
        "gamma": 10.0 ** rng.uniform(-1.3, np.log10(20.0)),
        "C": 0.0 if rng.random() < 1.0 / 3.0 else 10.0 ** rng.uniform(-3.0, 4.0),
        "w": 1.0,
    }
    if rng.random() < 0.5:
        cable["w"] = rng.uniform(0.05, 1.0)
        cable["m_f"] = cable["w_f"] * rng.uniform(1.0, 3.0) if cable["w_f"] else 0.0
        cable["C_t"] = 0.0 if rng.random() < 0.5 else 10.0 ** rng.uniform(-3.0, 0.0)
        cable["C_f"] = 0.0 if rng.random() < 0.5 or not cable["w_f"] else 10.0 ** rng.uniform(-3.0, 1.0)
        cable["C_s"] = rng.uniform(-1.0, 1.0)
        cable["b_s"] = np.inf if rng.random() < 0.5 else 10.0 ** rng.uniform(-0.5, 1.0)
    return cable


def limited(march: Callable) -> Callable:
    """A march that is given up after so many slopes, those of earlier marches among them."""
    asked = 0

    def marched(slopes: Callable, length: float, start: np.ndarray) -> np.ndarray:
        def counted(s: float, state: np.ndarray) -> np.ndarray:
            nonlocal asked
            asked += 1
            if asked > MOST:
                raise TooLongError("too many slopes")
            return slopes(s, state)

        return march(counted, length, start)

    return marched


def off(found: Stability, k: int) -> tuple[float, str]:
    """Distance of the leading eigenvalue from that of the other program, over gamma; or nan, and why."""
    shapes: Equilibria = found.equilibria
    if not len(found.eigenvalues[k]):
        return np.nan, "none found"
    if shapes.system.w_f == 0.0:
        return np.nan, "no fish"
    sigma = found.eigenvalues[k][0] / abs(shapes.gamma)
    march = peers.orthogonal(limited(peers.by_scipy("DOP853", RTOL)), PIECES)
    try:
        with np.errstate(all="ignore"):
            other = peers.by_secants(shapes, k, sigma * (1.0 + 1e-6), march)
    except TooLongError:
        return np.nan, "too long"
    return abs(other - sigma), "" if np.isfinite(other) else "lost"


def hunt(shapes: int, seed: int) -> Iterator[dict[str, str]]:
    """A row a shape."""
    rng, done = np.random.default_rng(seed), 0
    while done < shapes:
        cable = draw(rng)
        given = {name: f"{value:.17g}" for name, value in cable.items()}
        start = time.process_time()
        try:
            found = towatlas.stability(**cable)
        except ArithmeticError as error:
            done += 1
            yield given | {"status": f"refused: {type(error).__name__}"}
            continue
        spent = (time.process_time() - start) / len(found)
        for k in rng.permutation(len(found))[:EACH]:
            done += 1
            distance, why = off(found, int(k))
            yield given | {
                "branch": str(found.equilibria.branch[k]),
                "kind": str(found.kind[k]),
                "unstable": str(found.unstable[k]),
                "growth": f"{found.growth[k]:.9g}",
                "frequency": f"{found.frequency[k]:.9g}",
                "error": f"{found.error[k] / cable['gamma']:.1e}",
                "off": f"{distance:.1e}",
                "not_compared": why,
                "status": "" if found.status[k] == 0 else found.sentence(k),
                "milliseconds": f"{1e3 * spent:.0f}",
            }


def summary(rows: list[dict[str, str]]) -> str:
    """What was counted, and how far both programs agree."""
    kinds = collections.Counter(row.get("kind", "refused") for row in rows)
    reasons = collections.Counter(row["status"] for row in rows if row["status"])
    compared = [row for row in rows if row.get("off", "nan") != "nan"]
    distance = np.array([float(row["off"]) for row in compared])
    stated = np.array([float(row["error"]) for row in compared])
    lines = [f"{len(rows)} shapes: " + ", ".join(f"{count} {kind}" for kind, count in kinds.most_common())]
    lines += [f"  {count} not counted: {reason}" for reason, count in reasons.most_common()]
    lines.append(
        f"{len(compared)} compared: " + ", ".join(f"{(distance < d).sum()} within {d:g}" for d in (1e-12, 1e-10, 1e-8))
    )
    beyond = distance > np.maximum(10.0 * stated, 1e-11)
    lines += ["beyond both the stated error and 1e-11:"] if beyond.any() else []
    lines += [
        f"  {compared[k]['off']}, stated {compared[k]['error']}: "
        + ", ".join(f"{name} {float(compared[k][name]):.4g}" for name in CABLE if name in compared[k])
        + f", {compared[k]['branch']}"
        for k in np.flatnonzero(beyond)
    ]
    why = collections.Counter(row["not_compared"] for row in rows if row.get("not_compared"))
    lines.append("not compared: " + ", ".join(f"{count} {reason}" for reason, count in why.most_common()))
    return "\n".join(lines)


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.hunt_stability", description=__doc__)
    parser.add_argument("--shapes", type=int, default=SHAPES)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    rows = []
    for row in hunt(options.shapes, options.seed):
        rows.append(row)
        print(len(rows), row.get("kind", row["status"]), row.get("off", ""), end="\r", flush=True)
    keys = list(dict.fromkeys(key for row in rows for key in row))
    head = f"Growth rates of random cables, seed {options.seed}; off: from DOP853, rtol {RTOL:g}, over gamma, as error."
    write_table(DATA / "hunt_stability.csv", head, [{key: row.get(key, "") for key in keys} for row in rows])
    print("\n" + summary(rows))


if __name__ == "__main__":
    main()
