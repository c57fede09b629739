"""The files that a scene is written to: its shapes as numbers, a figure, a page."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from towatlas.commands.common import FIGURE_FORMATS, save_figure, say
from towatlas.scene.jumps import SceneAnswer
from towatlas.tables.seal import check_writable

FORMATS = (*FIGURE_FORMATS, ".html", ".csv")
# Along a shape, in the order of columns.
UNITS = {"s": "m", "x": "m", "y": "m", "z": "m", "R_x": "N", "R_y": "N", "R_z": "N", "T": "N"}


def check_out(path: Path) -> None:
    """A file that can be written, before anything is computed."""
    if path.suffix.lower() not in FORMATS:
        raise ValueError(f"--out {path}: the ending must be one of {', '.join(FORMATS)}")
    check_writable(path)


def write_scene(answer: SceneAnswer, path: Path, ending: Sequence[str], compare: bool) -> None:
    """The file that its ending asks for; a page has the lines that end the text, and with `compare` all models."""
    kind = path.suffix.lower()
    if kind in FIGURE_FORMATS:
        save_scene_figure(answer, path)
        return
    if kind == ".html":
        from towatlas.commands.scene_page import scene_page

        path.write_text(scene_page(answer, ending, compare), encoding="utf-8")
    else:
        _write_shapes(answer, path)
    say(f"wrote {path}")


def save_scene_figure(answer: SceneAnswer, path: Path, branch: str | None = None) -> None:
    """All shapes of a scene, or the one named, as a figure."""
    import matplotlib

    from towatlas.plot.scene import plot_scene

    with matplotlib.rc_context({"svg.hashsalt": "towatlas"}):
        save_figure(plot_scene(answer, branch), path)


def shape_facts(curve: Any) -> str:
    """What a shape in SI is of, in one line."""
    names = list(curve.attrs)
    named = names[names.index("model") :]
    texts = [name for name in ("scene", "scene_file") if name in names]
    values = {name: curve.attrs[name] for name in (*texts, *named)}
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in values.items()}
    return ", ".join(f"{name} = {value!r}" for name, value in plain.items())


def _write_shapes(answer: SceneAnswer, path: Path) -> None:
    """A row a point of each shape."""
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["shape", "expected", *(f"{name}_{unit}" for name, unit in UNITS.items())])
        for k, branch in enumerate(answer.equilibria.branch):
            curve = answer.shape(k)
            for row in zip(*(curve[name].values.tolist() for name in UNITS), strict=True):
                table.writerow([branch, k == answer.equilibria.expected, *row])
