"""The page of a scene: its figure and what `towatlas scene` prints, in one file that needs no other."""

from collections.abc import Iterable, Sequence
from html import escape
from math import isfinite
from typing import Any

from towatlas.commands.scene import NO_FORCE, head_lines, object_of
from towatlas.plot.scene import plot_scene
from towatlas.report.frame import number, page, svg, table
from towatlas.scene.choice import Choice, percent
from towatlas.scene.jumps import SceneAnswer
from towatlas.scene.scene import MODELS

# Columns: keys of JSON, and what they are called in HTML.
EQUILIBRIA = {
    "nodes": "nodes",
    "x_f_m": "<i>x</i><sub>f</sub> (m)",
    "y_f_m": "<i>y</i><sub>f</sub> (m)",
    "z_f_m": "<i>z</i><sub>f</sub> (m)",
    "phase_deg": "phase (&deg;)",
    "tension_N": "tension (N)",
    "R_x0_N": "<i>R</i><sub>x0</sub> (N)",
}
SPEEDS = {"gamma": "&gamma;", "speed_m_s": "m/s", "speed_kn": "kn", "rpm": "rpm"}
CAPTION = (
    "Left from the side, right from above, in true proportion unless a title says by how much one direction is "
    "stretched. In colour the expected shape, dashed the others. Below, the number of shapes over the speed: it "
    "changes at the jumps."
)


def scene_page(answer: SceneAnswer, ending: Sequence[str], compare: bool) -> str:
    """The page, with the lines that end the text; with `compare` the other models are on it, too."""
    known, model = object_of(answer), answer.choice.model
    title, *lines = head_lines(answer)
    drawing = svg("scene", f"Shapes of {title}", (8.0, 8.0), lambda figure: plot_scene(answer, figure=figure))
    parts = [_lines(lines), f"<figure>\n{drawing}\n<figcaption>{CAPTION}</figcaption>\n</figure>\n"]
    parts += [_lines(ending), _equilibria(known, model)]
    if model != "vacuum" and known["jumps"] is not None:
        parts.append(_jumps(known, model))
    if (compare or model == "vacuum") and known["critical_speeds"] is not None:
        parts.append(_critical_speeds(known))
    models = MODELS if compare else (model,)
    groups = [known["groups_by_model"][one] for one in models]
    rows = [
        [name, *(_cell(group[name], 7) for group in groups)]
        for name in groups[0]
        if any(name not in NO_FORCE or group[name] != NO_FORCE[name] for group in groups)
    ]
    parts.append(_section("Groups", ["group", *models], rows, kind="narrow"))
    if compare and answer.choice.differences:
        parts.append(_comparisons(answer.choice))
    if known["notes"]:
        items = "".join(f"<li>{escape(note)}</li>\n" for note in known["notes"])
        parts.append(f"<h2>Notes</h2>\n<ul>\n{items}</ul>\n")
    return page(title, "".join(parts))


def _lines(lines: Iterable[str]) -> str:
    return f"<p>{'<br>'.join(escape(line) for line in lines)}</p>\n"


def _section(
    title: str, head: Iterable[str], rows: Iterable[Sequence[Any]], text: Iterable[int] = (0,), kind: str = ""
) -> str:
    """A table under a heading; its head is HTML, the rest is escaped."""
    left = set(text)
    cells = (
        [escape(_cell(value)) if k in left else number(_cell(value)) for k, value in enumerate(row)] for row in rows
    )
    return f"<h2>{escape(title)}</h2>\n{table(head, cells, kind, text)}"


def _cell(value: Any, digits: int = 8) -> str:
    """A text as it is; of a number as many digits as `towatlas scene` prints."""
    return value if isinstance(value, str) else "-" if value is None else f"{value:.{digits}g}"


def _equilibria(known: dict[str, Any], model: str) -> str:
    rows = [
        [
            row["branch"].replace(" ", "\xa0"),
            ", ".join(mark for mark in ("expected", "extrapolated") if row[mark]),
            *(row[name] for name in EQUILIBRIA),
        ]
        for row in known["equilibria"]
    ]
    found = _section(f"Equilibria, {model} model", ["shape", "", *EQUILIBRIA.values()], rows, text=(0, 1))
    return f"{found}<p>Position of the fish, its phase behind the tow point, forces at the tow point.</p>\n"


def _jumps(known: dict[str, Any], model: str) -> str:
    low, high = (_cell(speed["speed_m_s"], 4) for speed in known["jumps_looked_at"])
    rows = [
        [
            *(row[name] for name in SPEEDS),
            f"{row['shapes_below']} to {row['shapes_above']}",
            f"vacuum, n = {row['n']}" if row["n"] else "drag",
            "within 10 % of the speed" if row["near"] else "",
        ]
        for row in known["jumps"]
    ]
    if not rows:
        return f"<h2>Jumps, {model} model</h2>\n<p>None from {low} to {high} m/s.</p>\n"
    head = [*SPEEDS.values(), "shapes", "made by", ""]
    found = _section(f"Jumps, {model} model", head, rows, text=(5, 6))
    missing = "" if known["jumps_complete"] else " Not everywhere made out: some may be missing."
    return f"{found}<p>From {low} to {high} m/s.{missing}</p>\n"


def _critical_speeds(known: dict[str, Any]) -> str:
    if not known["transitions"]:
        return "<h2>Critical speeds, vacuum model</h2>\n<p>The cable is too short for a jump.</p>\n"
    rows = [
        [
            row["n"],
            *(row[name] for name in SPEEDS),
            row["source"] if row["gamma"] is not None else row["status"],
            "within 10 % of the speed" if row["near"] else "",
        ]
        for row in known["critical_speeds"]
    ]
    title = f"Critical speeds, vacuum model, {len(rows)} of {known['transitions']}"
    return _section(title, ["n", *SPEEDS.values(), "source", ""], rows, text=(5, 6))


def _comparisons(choice: Choice) -> str:
    rows = []
    for d in choice.differences:
        apart = percent(d.relative) if isfinite(d.relative) else ""
        agrees = "" if d.agrees else "disagrees"
        rows.append([d.smaller, d.larger, d.quantity, *d.values("{:.5g}"), d.unit, apart, agrees])
    head = ["model", "against", "in", "by it", "by the larger", "unit", "differ", ""]
    return _section("Comparison of the models", head, rows, text=(0, 1, 2, 5, 7))
