"""The jumps of a scene on an axis of speeds, with the number of shapes between them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from towatlas.plot.labels import Label, place_labels
from towatlas.scene.jumps import LOOKED, SceneAnswer
from towatlas.scene.scene import KNOT

HERE, JUMP = "#c2571a", "#1f4e9c"
# So many jumps, the nearest, have their speed beside them, where there is room as near as this [points].
NAMED, REACH = 8, 18.0


def plot_speeds(answer: SceneAnswer, ax: Axes) -> Callable[[], None]:
    """The number of shapes over the speed, in m/s and kn; it changes at the jumps.

    Parameters
    ----------
    answer : SceneAnswer
        With its jumps.
    ax : Axes
        To draw on.

    Returns
    -------
    callable
        Writes the speeds of jumps beside them; to be called once the layout of the figure stands.
    """
    scene, folds = answer.scene, answer.folds
    assert folds is not None
    known = np.isfinite(folds.gamma)
    jumps = scene.speed_of(np.abs(folds.gamma[known]))
    below, above = folds.shapes_below[known], folds.shapes_above[known]
    low, high = (scene.speed * share for share in LOOKED)
    first = below[0] if len(jumps) else len(answer.equilibria)
    ax.plot(
        [low, *np.repeat(jumps, 2), high],
        [first, *np.column_stack([below, above]).ravel(), above[-1] if len(jumps) else first],
        color=JUMP,
        linewidth=1.6,
    )
    ax.plot(jumps, 0.5 * (below + above), "o", color=JUMP, markersize=3.5, zorder=4)
    ax.axvline(scene.speed, color=HERE, linewidth=1.4, zorder=3)
    counts = np.unique([first, *below, *above])
    # Labels of jumps stand above the line, and that of the speed above those.
    ax.set(xscale="log", xlim=(low, high), ylim=(0.0, 1.8 * counts[-1] + 0.5))
    ax.set_yticks(counts if len(counts) < 5 else counts[np.linspace(0, len(counts) - 1, 4).astype(int)])
    ax.set(xlabel="speed of the tow point (m/s)", ylabel="number of shapes")
    knots = ax.secondary_xaxis("top", functions=(_in_knots, _in_metres))
    for axis in (ax.xaxis, knots.xaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    knots.set_xlabel("kn")
    title = f"{'jumps' if len(jumps) else 'no jump'} from {low:.4g} to {high:.4g} m/s ({answer.choice.model} model)"
    ax.set_title(title if folds.complete else f"{title}, not everywhere made out: others may lie between")
    ax.grid(color="0.93", linewidth=0.6)

    def write() -> None:
        here = f"you are here: {scene.speed:.4g} m/s, {scene.speed / KNOT:.4g} kn"
        nearest = np.argsort(np.abs(np.log(jumps / scene.speed)))[:NAMED]
        labels = [Label(here, scene.speed, ax.get_ylim()[1], HERE)]
        labels += [Label(f"{jumps[k]:.4g}", jumps[k], max(below[k], above[k]), JUMP) for k in nearest]
        place_labels(ax, labels, reach=REACH)

    return write


def _in_knots(speed: Any) -> Any:
    return speed / KNOT


def _in_metres(speed: Any) -> Any:
    return speed * KNOT
