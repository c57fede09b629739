"""Labels beside what they name, over nothing else."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

# Where places are tried: distances from the point named to the edge of the text [points], and directions [degrees].
DISTANCES = (6.0, 9.0, 13.0, 18.0, 25.0, 34.0, 46.0, 62.0, 84.0, 112.0, 150.0)
DIRECTIONS = np.radians([0, 180, 45, 135, -45, -135, 90, -90, 22, 158, -22, -158, 68, 112, -68, -112])
# Around a text, and between the points that stand for a line [points].
GAP, STEP = 2.0, 2.0
# A text farther from its point than BESIDE has a line to it, and keeps that distance from the points of others; without
# a line it keeps ALOOF from them. Points closer than SAME are one [points].
BESIDE, ALOOF, SAME = 9.0, 18.0, 3.0


@dataclass(frozen=True)
class Label:
    """A text and the point it names.

    Attributes
    ----------
    text : str
    x, y : float
        In data coordinates.
    colour : str
    """

    text: str
    x: float
    y: float
    colour: str = "0.2"


def place_labels(
    axes: Axes,
    labels: Iterable[Label],
    lines: Iterable[tuple[ArrayLike, ArrayLike]] = (),
    reach: float = DISTANCES[-1],
) -> list[Annotation]:
    """Write each label at the nearest place where it covers no line, no marker and no other label.

    Parameters
    ----------
    axes : Axes
        As they are going to be drawn: labels stay where they are when limits or the size change.
    labels : iterable of Label
        Those that matter most first. One without a place, and one whose point another has already named, is left out.
    lines : iterable of (array_like, array_like)
        x and y of lines not to be covered, beside those that the axes know as lines.
    reach : float
        How far from its point a label may stand [points], > 0.

    Returns
    -------
    list of Annotation
        Those that were written.
    """
    frame, gap = axes.get_window_extent(), _pixels(axes, GAP)
    extra = [_dense(axes, axes.transData.transform(np.column_stack(line))) for line in lines]
    covered = np.concatenate([np.empty((0, 2)), *_drawn(axes), *extra])
    taken: list[Bbox] = []
    written = []
    for label, anchor, strangers in _apart(axes, labels):
        note = axes.annotate(
            label.text,
            (label.x, label.y),
            xytext=(0.0, 0.0),
            textcoords="offset points",
            ha="center",
            va="center",
            color=label.colour,
            fontsize=8,
            parse_math=False,
            zorder=9,
        )
        size = note.get_window_extent()
        half = np.array([size.width, size.height]) / 2.0
        for distance, centre in _places(axes, anchor, half, reach):
            box = Bbox([centre - half - gap, centre + half + gap])
            lead = np.linspace(anchor, centre, 50)
            lead = lead[~_inside(box, lead)] if distance > BESIDE else lead[:0]
            # Beside another point it would seem to name that one.
            aloof = _pixels(axes, BESIDE if len(lead) else ALOOF)
            if (
                _free(box, frame, covered, taken)
                and not any(_inside(other, lead).any() for other in taken)
                and not _inside(box.padded(aloof), strangers).any()
            ):
                break
        else:
            note.remove()
            continue
        note.set_position(tuple((centre - anchor) * 72.0 / axes.figure.dpi))
        note.set_in_layout(False)
        if len(lead):
            ends = axes.transData.inverted().transform(lead[[0, -1]])
            axes.add_line(Line2D(*ends.T, color="0.6", linewidth=0.5, zorder=8))
            covered = np.concatenate([covered, lead])
        taken.append(box)
        written.append(note)
    return written


def _apart(axes: Axes, labels: Iterable[Label]) -> Iterator[tuple[Label, Array, Array]]:
    """Labels whose points can be told apart, the points, and those of all others [pixels]."""
    kept: list[Label] = []
    points = np.empty((0, 2))
    for label in labels:
        point = axes.transData.transform((label.x, label.y))
        if (np.hypot(*(points - point).T) >= _pixels(axes, SAME)).all():
            kept.append(label)
            points = np.concatenate([points, point[None]])
    for k, label in enumerate(kept):
        yield label, points[k], np.delete(points, k, axis=0)


def _pixels(axes: Axes, points: float) -> float:
    return points * axes.figure.dpi / 72.0


def _drawn(axes: Axes) -> Iterator[Array]:
    """Points on all lines and around all markers, in pixels."""
    turn = np.linspace(0.0, 2.0 * np.pi, 9)
    for line in axes.lines:
        points = line.get_transform().transform(line.get_xydata())
        if line.get_linestyle() not in ("None", "none", "", " "):
            yield _dense(axes, points)
        if line.get_marker() not in ("None", "none", "", " ", None):
            radius = 0.5 * _pixels(axes, float(line.get_markersize()))
            rim = radius * np.column_stack([np.cos(turn), np.sin(turn)])
            yield (points[:, None, :] + rim).reshape(-1, 2)
    for lines in axes.collections:
        if isinstance(lines, LineCollection):
            for segment in lines.get_segments():
                yield _dense(axes, lines.get_transform().transform(segment))


def _dense(axes: Axes, points: Array) -> Array:
    """The same line with points so close that no text fits between two."""
    lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    # Lines may go far beyond what is seen.
    at = np.linspace(0.0, lengths[-1], int(min(lengths[-1] / _pixels(axes, STEP), 1e5)) + 2)
    return np.column_stack([np.interp(at, lengths, column) for column in points.T])


def _places(axes: Axes, anchor: Array, half: Array, reach: float) -> Iterator[tuple[float, Array]]:
    """Distances [points] and centres [pixels] to be tried, the nearest first."""
    for distance in DISTANCES:
        if distance > reach:
            return
        for angle in DIRECTIONS:
            way = np.array([np.cos(angle), np.sin(angle)])
            # Beside, above or below the point stands the middle of an edge, in between a corner.
            corner = np.where(np.abs(way) > 0.3, np.sign(way), way)
            yield distance, anchor + way * _pixels(axes, distance) + corner * half


def _inside(box: Bbox, points: Array) -> NDArray[np.bool_]:
    x, y = points.T
    return (x > box.x0) & (x < box.x1) & (y > box.y0) & (y < box.y1)


def _free(box: Bbox, frame: Bbox, covered: Array, taken: list[Bbox]) -> bool:
    within = frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1
    return within and not any(box.overlaps(other) for other in taken) and not _inside(box, covered).any()
