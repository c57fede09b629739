"""`python -m benchmarks.after_jump`: MoorDyn inside a window of flutter and past two folds, for docs/after-the-jump.md.

Some minutes. Writes docs/after-the-jump.svg and prints the numbers of the page.
"""

import tempfile
from dataclasses import dataclass
from math import ceil, cos, hypot, pi, sin
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

import towatlas
from benchmarks.chain import Chain
from benchmarks.peers_moordyn import silent
from benchmarks.samples import ROOT
from towatlas import answer_scene, read_scene, stability_of
from towatlas.exports.moordyn import STATE, chain_nodes, deck_text, state_bytes, turned
from towatlas.exports.moordyn_folder import towed_of
from towatlas.scene.file import make_scene
from towatlas.scene.jumps import SceneAnswer
from towatlas.scene.scene import KNOT, Scene
from towatlas.solve.shapes import shape_of

# 8.2 km of cable behind a ship in a circle of 3 km: three shapes between its two folds.
DEEP = {
    "cable": {"length": 8199.12, "mass_per_length": 0.446449, "diameter": 0.0127, "drag_coefficient": 1.27},
    "fish": {
        "mass": 113.398,
        "volume": 0.0256207,
        "added_mass": 13.1306,
        "drag_coefficient": 0.2,
        "frontal_area": 0.105070,
    },
    "tow": {"radius": 3048, "speed": "4.75 kn"},
    "fluid": {"density": 1025},
}
FLUTTER, TURNS, LINKS = 5.94, 60, 40
# Of EA over the tow tension: a stretch of 1e-3, for ten times the step.
STIFF, DEEP_LINKS, LOW, HIGH = 1e3, 40, 4.75, 5.25
# Turns from the low speed to the high one, before and between.
RAMP, REST = 16, 2
ROWS = 200


@dataclass(frozen=True)
class Track:
    """Turns, speed [m/s], distance of the fish from the axis, its depth [m], tow tension [N]; ROWS a turn at first."""

    turns: np.ndarray
    speed: np.ndarray
    radius: np.ndarray
    depth: np.ndarray
    tension: np.ndarray


def march(answer: SceneAnswer, segments: int, stiff: float, speeds: np.ndarray) -> Track:
    """Tow the expected shape on; `speeds` [m/s], one for each ROWS-th of a turn at the scene's."""
    import moordyn

    towed = towed_of(answer)
    curve = answer.shape(s=np.linspace(0.0, towed.length, segments + 1))
    tension = curve["T"].values
    stiffness = stiff * float(tension.max())
    places = np.stack([curve["x"].values, -curve["y"].values, -curve["z"].values - towed.depth], axis=1)
    nodes = chain_nodes(places, tension, towed.length / segments, stiffness)
    rate = answer.scene.speed / towed.radius
    row = 2.0 * pi / rate / ROWS
    steps = ceil(row / towed.step(segments, stiffness))
    dt, angle, done = row / steps, 0.0, []
    with tempfile.TemporaryDirectory() as folder, silent():
        (Path(folder) / STATE).write_bytes(state_bytes(nodes, turned(nodes, rate)))
        deck = Path(folder) / "deck"
        deck.write_text(deck_text(towed, nodes, stiffness))
        chain = moordyn.Create(str(deck))
        place = [towed.radius, 0.0, -towed.depth]
        moordyn.Init_NoIC(chain, place, [0.0, -answer.scene.speed, 0.0])
        fish, line = moordyn.GetPoint(chain, 2), moordyn.GetLine(chain, 1)
        for k, speed in enumerate(speeds):
            for j in range(steps):
                angle -= speed / towed.radius * dt
                after = [towed.radius * cos(angle), towed.radius * sin(angle), -towed.depth]
                pace = [(b - a) / dt for a, b in zip(place, after, strict=True)]
                moordyn.Step(chain, [float(x) for x in place], pace, (k * steps + j) * dt, dt)
                place = after
            x, y, z = moordyn.GetPointPos(fish)
            pull = hypot(*moordyn.GetLineNodeTen(line, 0))
            done.append((-angle / (2.0 * pi), speed, hypot(x, y), -towed.depth - z, pull))
        moordyn.Close(chain)
    return Track(*np.array(done).T)


def flutter() -> tuple[Track, SceneAnswer, list[complex]]:
    """Fig. 3 inside its window: in time, and eigenvalues a turn of the cable and of the chain of as many links."""
    answer = answer_scene(read_scene("skop-fig3").at(gamma=FLUTTER), model="air", asked=("position",))
    found = answer.equilibria
    moving, k = stability_of(found), found.expected
    sigma = complex(moving.growth[k], moving.frequency[k])
    chain = Chain(found.system, found.gamma, LINKS)
    rest = chain.rest(shape_of(found, k, np.linspace(0.0, found.system.lam, 4001)))
    speeds = np.full(ROWS * TURNS, answer.scene.speed)
    track = march(answer, LINKS, 1e5, speeds)
    return track, answer, [s * 2.0 * pi / FLUTTER for s in (sigma, chain.eigenvalue_near(*rest, sigma))]


def growth(track: Track, first: int, last: int) -> float:
    """Of the swing of the tension a turn, by a straight line through its logarithm, seven turns at a time."""
    middles = np.arange(first, last - 6)
    swings = []
    for turn in middles:
        part = track.tension[ROWS * turn : ROWS * (turn + 7)]
        swings.append(np.std(part - np.polyval(np.polyfit(np.arange(len(part)), part, 1), np.arange(len(part)))))
    return float(np.polyfit(middles, np.log(swings), 1)[0])


def hysteresis() -> tuple[Track, Scene]:
    """The speed up through the fold above and down through that below."""
    scene = make_scene(DEEP)
    answer = answer_scene(scene, model="water", asked=("position",))
    up = np.linspace(LOW, HIGH, ROWS * RAMP) * KNOT
    rest = [np.full(ROWS * REST, speed * KNOT) for speed in (LOW, HIGH)]
    return march(answer, DEEP_LINKS, STIFF, np.concatenate([rest[0], up, rest[1], up[::-1], rest[0]])), scene


def draw_flutter(axes: Axes) -> None:
    """The tension, and its numbers on the terminal."""
    track, answer, (cable, chain) = flutter()
    static = float(answer.shape(s=[0.0])["T"][0])
    axes.plot(track.turns, track.tension / static, lw=0.5)
    axes.set(xlabel="turns", ylabel="tension at the tow point over the steady one", title="Inside a window of flutter")
    print(f"growth a turn: cable {cable.real:.4f}, chain {chain.real:.4f}, in time {growth(track, 9, 36):.4f}")
    late = track.tension[ROWS * 50 :] / static
    print(f"after turn 50: tension {late.min():.2f} to {late.max():.2f} of the steady one")


def draw_hysteresis(axes: Axes) -> None:
    """The fish both ways over the steady shapes, and its numbers on the terminal."""
    track, scene = hysteresis()
    knots = np.linspace(LOW, HIGH, 201)
    swept = towatlas.sweep(scene, speed=knots * KNOT, model="water")
    radius, branch = swept.r_f.values[0], swept.branch.values[0]
    for number in np.unique(branch[np.isfinite(radius)]):
        value, shape = np.nonzero((branch == number) & np.isfinite(radius))
        label = "steady shapes" if number == branch[0, 0] else None
        axes.plot(knots[value], radius[value, shape], color="0.75", lw=4, label=label)
    half = len(track.speed) // 2
    for part, name in ((slice(0, half), "rising"), (slice(half, None), "falling")):
        axes.plot(track.speed[part] / KNOT, track.radius[part], lw=1, label=f"MoorDyn, {name}")
        k = np.argmax(np.abs(np.gradient(track.radius[part]))) + part.start
        at, pull = track.speed[k] / KNOT, track.tension[part]
        print(f"{name}: fastest at {at:.3f} kn; tension {pull.min():.0f} to {pull.max():.0f} N")
    ends = track.radius[[0, half, -1]]
    print(f"fish from the axis at start, turning point, end: {ends} m; folds {swept.jump.values[0] / KNOT} kn")
    axes.set(
        xlabel="speed of the tow point [kn]",
        ylabel="fish from the axis [m]",
        title="Up past one fold, down past another",
    )
    axes.legend(loc="center left", bbox_to_anchor=(0.04, 0.36))


def main() -> None:
    """The figure, and the numbers of the page."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = "towatlas"
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    draw_flutter(left)
    draw_hysteresis(right)
    figure.savefig(ROOT / "docs" / "after-the-jump.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
