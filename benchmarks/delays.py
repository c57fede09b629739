"""`python -m benchmarks.delays`: how late jumps come as the speed moves, and violent flutter.

For docs/after-the-jump.md; some minutes. Writes docs/delays.svg and prints the numbers of the page.
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from scipy import sparse
from scipy.sparse.linalg import splu

import towatlas
from benchmarks.after_jump import DEEP, HIGH, LOW, ROWS, march
from benchmarks.chain import SPIN, Chain
from benchmarks.samples import ROOT
from towatlas import System, answer_scene, read_scene
from towatlas.results import Folds
from towatlas.scene.file import make_scene
from towatlas.scene.scene import KNOT
from towatlas.solve.equilibria import solve_equilibria
from towatlas.solve.shapes import shape_of

# Least zero of the Airy function: how long da/dt = t + a^2 takes to leave.
AIRY = 2.338107410459767
# Shares of the speed off a fold: at one, and a quarter of it, growth is asked for; at the other a chain begins to look.
NEAR, ASIDE = 4e-3, 0.05
# A ramp begins so many times the delay before the fold; steps a turn, of BDF2.
BEFORE, STEPS = 2.0, 10
# Turns for half a knot.
TURNS = (8, 32, 128, 512)
VIOLENT, LASTING, SETTLED = 3.9, 100, 40


@dataclass(frozen=True)
class Fold:
    """One of a cable: speed, side on which there are more shapes, distances of the fish at it and beyond, and what
    squares of growth rates about it are four times, over how far off it is in speed."""

    system: System
    gamma: float
    side: int
    r_f: float
    beyond: float
    steep: float


def fold_of(folds: Folds, k: int) -> Fold:
    """The k-th of some."""
    system, gamma = folds.system, float(folds.gamma[k])
    side = int(np.sign(folds.shapes_above[k] - folds.shapes_below[k]))
    r_f = float(folds.r_f[k])
    roots = []
    for off in (NEAR, NEAR / 4):
        moving = towatlas.stability_of(solve_equilibria(system, gamma * (1 + side * off)))
        roots.append(float(np.nanmax(moving.growth)) / np.sqrt(off * gamma))
    # Growth over the root of the distance is linear in that root.
    steep = (2 * roots[1] - roots[0]) ** 2 / 4
    beyond = solve_equilibria(system, gamma * (1 - side * NEAR)).r_f
    return Fold(system, gamma, side, r_f, float(beyond[0]), steep)


def law(fold: Fold, rate: float) -> float:
    """How far past a fold, in speed, a cable leaves where the speed moves so fast."""
    return AIRY * (rate**2 / fold.steep) ** (1 / 3)


class Ramped(Chain):
    """One whose speed moves."""

    rate = 0.0

    def load(self, r, v):
        return super().load(r, v) - self.rate * self.mass[:, None] * (r @ SPIN.T)


def started(fold: Fold, gamma: float, links: int) -> tuple[Ramped, np.ndarray, np.ndarray]:
    """A chain at rest at a speed, in the shape that ends at a fold; from a speed at which the cable has it, too."""
    off = max(NEAR, fold.side * (gamma / fold.gamma - 1))
    found = solve_equilibria(fold.system, fold.gamma * (1 + fold.side * off))
    # The shape between the two that last ends with either.
    k = int(np.argmin(found.r_f)) if fold.beyond > fold.r_f else int(np.argmax(found.r_f))
    chain = Ramped(fold.system, gamma, links)
    return chain, *chain.rest(shape_of(found, k, np.linspace(0.0, fold.system.lam, 4001)))


def own_fold(fold: Fold, links: int) -> float:
    """That of a chain."""
    gamma = fold.gamma * (1 + fold.side * ASIDE)
    found = solve_equilibria(fold.system, gamma)
    k = int(np.argmin(found.r_f)) if fold.beyond > fold.r_f else int(np.argmax(found.r_f))
    curve = shape_of(found, k, np.linspace(0.0, fold.system.lam, 4001))
    return Chain(fold.system, gamma, links).fold(curve, fold.gamma)


def delay(fold: Fold, rate: float, links: int, steps: int = STEPS) -> float:
    """How far past its own fold, in speed, the fish of a chain is half way to where it goes."""
    there = own_fold(fold, links)
    begin = there + fold.side * BEFORE * law(fold, rate)
    chain, r, tension = started(fold, begin, links)
    chain.rate = -fold.side * rate
    h, mass = 2 * np.pi / fold.gamma / steps, np.repeat(chain.mass, 3)
    before, v, v_before = r, 0 * r, 0 * r
    half = 0.5 * (fold.r_f + fold.beyond)
    outwards = fold.beyond > fold.r_f
    last = np.hypot(*r[-1, :2])
    for step in range(1, int(10 * BEFORE * law(fold, rate) / rate / h)):
        chain.gamma = begin + chain.rate * h * step
        new = 2 * r - before
        for correction in range(20):
            v_new = (3 * new - 4 * r + before) / (2 * h)
            slowed = chain.mass[:, None] * (3 * v_new - 4 * v + v_before) / (2 * h)
            residual, _ = chain.imbalance(new, tension)
            residual[: 3 * links] += (chain.load(new, v_new) - chain.load(new, 0 * new) - slowed).ravel()
            if correction % 3 == 0:
                stiffness, by_tension, constraint = chain.pull_slopes(new, tension)
                by_position, by_velocity = chain.load_slopes(new)
                top = stiffness + by_position + by_velocity * (1.5 / h) - sparse.diags_array(mass * (1.5 / h) ** 2)
                solver = splu(sparse.block_array([[top, by_tension], [constraint, None]]).tocsc())
            change = solver.solve(-residual)
            new, tension = new + change[: 3 * links].reshape(-1, 3), tension + change[3 * links :]
            if np.abs(change[: 3 * links]).max() < 1e-10:
                break
        else:
            raise ArithmeticError(f"no step at gamma = {chain.gamma}")
        before, r, v_before, v = r, new, v, (3 * new - 4 * r + before) / (2 * h)
        now = np.hypot(*r[-1, :2])
        if (now > half) == outwards:
            return abs(chain.gamma - chain.rate * h * (now - half) / (now - last) - there)
        last = now
    raise ArithmeticError("the fish did not leave")


def draw_delays(axes: Axes) -> None:
    """Delays of both folds over the rate, and their numbers on the terminal."""
    scene = make_scene(DEEP)
    knot = scene.speed / scene.gamma / KNOT
    system = scene.system("water")
    fluid = {name: getattr(system, name) for name in ("C", "m_f", "C_f", "w", "C_t")}
    folds = towatlas.folds(system.lam, system.w_f, gamma=(LOW / knot, HIGH / knot), **fluid)
    for k, name in ((1, "rising"), (0, "falling")):
        fold = fold_of(folds, k)
        chains = ", ".join(f"{links}: {own_fold(fold, links) * knot:.4f}" for links in (20, 40, 80, 160))
        print(f"{name}: fold {fold.gamma * knot:.4f} kn, of chains {chains}; K {fold.steep:.4g}")
        rates = np.array([0.5 / knot / (turns * 2 * np.pi / fold.gamma) for turns in TURNS])
        (line,) = axes.loglog(
            1 / np.array(TURNS), [law(fold, rate) * knot for rate in rates], lw=1, label=f"{name}, law"
        )
        for links, marker in ((20, "o"), (40, "x")):
            late = [delay(fold, rate, links) * knot for rate in rates]
            axes.loglog(1 / np.array(TURNS), late, marker, color=line.get_color(), mfc="none", label=f"{links} links")
            shown = ", ".join(f"{d:.4f} ({d / law(fold, r) / knot:.3f})" for d, r in zip(late, rates, strict=True))
            print(f"  {links} links, kn past its fold (over the law), turns {TURNS}: {shown}")
    axes.set(xlabel="rise or fall of the speed in a turn [0.5 kn]", ylabel="past the fold [kn]")
    axes.set_title("How late a jump comes")
    axes.legend()


def draw_violent(axes: Axes) -> None:
    """The tension of the cable of Fig. 3 where it flutters most, and its numbers on the terminal."""
    answer = answer_scene(read_scene("skop-fig3").at(gamma=VIOLENT), model="air", asked=("position",))
    static = float(answer.shape(s=[0.0])["T"][0])
    for segments, stiff in ((20, 1e3), (40, 1e3), (40, 4e3), (80, 4e3)):
        track = march(answer, segments, stiff, np.full(ROWS * LASTING, answer.scene.speed))
        tension = track.tension / static
        late = tension[ROWS * SETTLED :]
        print(
            f"{segments} segments, EA {stiff:g}: from turn {SETTLED} on tension {late.min():.2f} to {late.max():.1f}, "
            f"99 % below {np.percentile(late, 99):.1f}"
        )
        if segments < 80 and stiff == 1e3:
            axes.plot(track.turns, tension, lw=0.5, label=f"{segments} segments")
    axes.set(xlabel="turns", ylabel="tension at the tow point over the steady one", title="Violent flutter")
    axes.legend()


def main() -> None:
    """The figure, and the numbers of the page."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "towatlas"
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    draw_delays(left)
    draw_violent(right)
    figure.savefig(ROOT / "docs" / "delays.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
