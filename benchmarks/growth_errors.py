"""`python -m benchmarks.growth_errors`: the error stated of growth rates of random cables, against what rounding does.

The leading growth rate of each shape is solved for again with its fish moved by some last bits, and in other steps.
Another seed, or more cables, is another experiment.
"""

import argparse
from dataclasses import dataclass

import numpy as np
from tqdm import tqdm

import towatlas
from towatlas.solve.growth import reach_of
from towatlas.solve.motion import BOUND, motions
from towatlas.solve.spectrum import polish

SEED, CABLES, SHAPES = 4, 100, 9
# CPU time of a cable [s].
PATIENCE = 20.0
# Last bits that the fish is moved by, and growth within a step.
OTHERWISE = ((1, BOUND), (-1, BOUND), (3, BOUND), (-2, 1.4), (0, 1.2))

Rng = np.random.Generator


@dataclass(frozen=True)
class Shape:
    """Where a growth rate comes to otherwise, at most, and the error stated, both over gamma."""

    cable: dict[str, float]
    r_f: float
    off: float
    stated: float


def draw(rng: Rng) -> dict[str, float]:
    """A cable: lam to 80, w_f to 100, gamma to 10; half of them with a side force, more than half with drag."""
    cable = {
        "lam": 10.0 ** rng.uniform(0.2, 1.9),
        "w_f": 10.0 ** rng.uniform(-3.0, 2.0),
        "gamma": 10.0 ** rng.uniform(-0.3, 1.0),
    }
    groups = {
        "C_s": (0.5, lambda: rng.uniform(-1.0, 1.0)),
        "C": (0.6, lambda: 10.0 ** rng.uniform(-3.0, 0.5)),
        "w": (0.6, lambda: rng.uniform(0.1, 1.0)),
        "C_f": (0.3, lambda: 10.0 ** rng.uniform(-2.0, 0.0)),
        "C_t": (0.3, lambda: 10.0 ** rng.uniform(-3.0, -1.0)),
    }
    return cable | {name: value() for name, (share, value) in groups.items() if rng.random() < share}


def moved(r_f: float, ulps: int) -> float:
    """A number so many last bits away."""
    for _ in range(abs(ulps)):
        r_f = float(np.nextafter(r_f, np.inf * np.sign(ulps)))
    return r_f


def shapes_of(cable: dict[str, float]) -> list[Shape]:
    """Of the first shapes of a cable that have a growth rate, and one that D alone gives."""
    found = towatlas.stability(**cable)
    shapes, gamma = found.equilibria, np.array([cable["gamma"]])
    system, row, some = shapes.system, shapes.system.row()[None], []
    for k in range(min(len(found), SHAPES)):
        # Without drag what does not grow is put on the axis.
        if not np.isfinite(found.error[k]) or (not found.growth[k] and shapes.system.in_vacuum):
            continue
        zero = np.array([found.growth[k] + 1j * found.frequency[k]]) / gamma
        reach = max(reach_of(system, gamma[0]), 1.1 * abs(zero[0]))
        other = []
        for ulps, bound in OTHERWISE:
            body = motions(np.array([moved(shapes.r_f[k], ulps)]), gamma, row, reach, bound)[0]
            other.append(polish(body, zero, zero)[0].sigma[0])
        off = float(np.abs(np.array(other) - zero).max())
        some.append(Shape(cable, float(shapes.r_f[k]), off, float(found.error[k] / gamma[0])))
    return some


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.growth_errors", description=__doc__)
    parser.add_argument("--cables", type=int, default=CABLES)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    rng, shapes, refused = np.random.default_rng(options.seed), [], 0
    for _ in tqdm(range(options.cables), disable=None):
        try:
            with towatlas.patience(PATIENCE):
                shapes += shapes_of(draw(rng))
        except ArithmeticError:
            refused += 1
    share = np.array([shape.off / shape.stated for shape in shapes])
    median, most, largest = np.quantile(share, [0.5, 0.99, 1.0])
    print(
        f"seed {options.seed}: {options.cables} cables, {refused} refused, {len(shapes)} shapes; off over stated: "
        f"median {median:.2g}, 99 % {most:.2g}, largest {largest:.2g}; beyond what is stated {(share > 1.0).sum()}"
    )
    for k in np.argsort(-share)[:3]:
        print(f"  off {shapes[k].off:.1e}, stated {shapes[k].stated:.1e}: {shapes[k].cable}, r_f {shapes[k].r_f:.6g}")


if __name__ == "__main__":
    main()
