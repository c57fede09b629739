"""`python -m benchmarks.validation`: the scenes shipped beside a chain of rigid links, for docs/validation.md.

The chain shares nothing with the package but the form of a problem; its second order in 1/N is extrapolated.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.chain import Chain
from benchmarks.report import put
from benchmarks.samples import ROOT
from towatlas import answer_scene, read_scene, stability_of
from towatlas.results import Folds
from towatlas.scene.file import shipped_scenes
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.shapes import shape_of

# Links of the coarser chain; the finer has twice as many.
LINKS = 320
# How far from a fold, in speed, a chain begins to look for its own.
ASIDE = 2e-3


@dataclass(frozen=True)
class Both:
    """One number of one scene: by this package, and by the chain, extrapolated.

    size : what differences are shares of, the number itself or the eigenvalue that it is part of; change : by how much
    extrapolation changed it.
    """

    scene: str
    quantity: str
    unit: str
    ours: float
    chain: float
    size: float
    change: float

    @property
    def apart(self) -> float:
        """Relative."""
        return abs(self.chain - self.ours) / self.size


def compare(name: str, links: int = LINKS) -> list[Both]:
    """The expected shape of a shipped scene at its speed, by the air model."""
    answer = answer_scene(read_scene(name), model="air", asked=("position",))
    found, scene = answer.equilibria, answer.scene
    k = found.expected
    force, second = scene.force_unit("air"), np.sqrt(scene.radius / scene.gravity)
    moving = stability_of(found)
    sigma = complex(moving.growth[k], moving.frequency[k])
    curve = shape_of(found, k, np.linspace(0.0, found.system.lam, 4001))
    rows = []
    for count in (links, 2 * links):
        chain = Chain(found.system, found.gamma, count)
        r, tension = chain.rest(curve)
        # At the tow point itself: half a link above the first, where what a link weighs and needs is added.
        top = 1.5 * tension[0] - 0.5 * tension[1]
        mode = chain.eigenvalue_near(r, tension, sigma)
        rows.append([np.hypot(*r[-1, :2]), r[-1, 2], top, mode.real, mode.imag])
    coarse, fine = np.array(rows)
    ours = [found.r_f[k], found.z_f[k], found.tension[k], sigma.real, sigma.imag]
    names = ("fish from the axis", "its depth", "tow tension", "growth", "frequency")
    units = ("m", "m", "N", "1/s", "rad/s")
    scale = (scene.radius, scene.radius, force, 1.0 / second, 1.0 / second)
    sizes = [*np.abs(ours[:3]), abs(sigma), abs(sigma)]
    return [
        Both(name, *facts, float(a * si), float((4 * c - b) / 3 * si), float(size * si), float(abs(c - b) / 3 * si))
        for *facts, si, size, a, b, c in zip(names, units, scale, sizes, ours, coarse, fine, strict=True)
    ]


def compare_folds(name: str, links: int = LINKS) -> list[Both]:
    """The jumps about the speed of a shipped scene, by the air model."""
    answer = answer_scene(read_scene(name), model="air", asked=("position", "speeds"))
    folds, scene = answer.folds, answer.scene
    assert folds is not None
    rows = []
    for k in range(len(folds)):
        coarse, fine = (chain_fold(folds, k, count) for count in (links, 2 * links))
        ours, chain, change = scene.speed_of(
            np.array([folds.gamma[k], (4 * fine - coarse) / 3, abs(fine - coarse) / 3])
        )
        what = f"jump {k + 1}, {folds.shapes_below[k]} shapes to {folds.shapes_above[k]}"
        rows.append(Both(name, what, "m/s", float(ours), float(chain), float(ours), float(change)))
    return rows


def chain_fold(folds: Folds, k: int, links: int) -> float:
    """The k-th of some folds in speed by a chain, dimensionless."""
    gamma = float(folds.gamma[k]) * (1 + ASIDE * np.sign(folds.shapes_above[k] - folds.shapes_below[k]))
    found = solve_equilibria(folds.system, gamma)
    near = int(np.argmin(np.abs(np.log(found.r_f / folds.r_f[k]))))
    curve = shape_of(found, near, np.linspace(0.0, folds.system.lam, 4001))
    return Chain(folds.system, gamma, links).fold(curve, float(folds.gamma[k]))


def table(rows: list[Both]) -> str:
    """Markdown."""
    head = ["scene", "number", "towatlas", "chain", "apart", "extrapolation changed it by"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for row in rows:
        numbers = f"{row.ours:.8g} {row.unit} | {row.chain:.8g} {row.unit}"
        lines.append(f"| {row.scene} | {row.quantity} | {numbers} | {row.apart:.0e} | {row.change / row.size:.0e} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    names = shipped_scenes()
    rows = [row for name in names for row in (*compare(name), *compare_folds(name))]
    put(ROOT / "docs" / "validation.md", "chain", table(rows))
