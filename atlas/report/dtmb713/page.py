"""DTMB Report 713 reproduced in one page: what it says, the laws of its cables, its figures, its table row by row."""

from collections.abc import Callable
from fractions import Fraction
from math import isfinite, pi
from string import Template

import numpy as np
from matplotlib.figure import Figure

from towatlas.effort import check_patience
from towatlas.report import frame
from towatlas.report.claims import HOLDS, Claim, claims_table
from towatlas.report.dtmb713 import figures
from towatlas.report.dtmb713.claims import all_claims
from towatlas.report.dtmb713.data import DENSITY, LETTERS, MISPRINTS, TABLE_3, points, table_1, table_2
from towatlas.report.dtmb713.fits import normal_force, side_force
from towatlas.report.dtmb713.recompute import FOLLOWS, Cell, drag_slips, recompute_all
from towatlas.report.dtmb713.text import BODY, CAPTIONS, SLIPS
from towatlas.report.frame import number, table

TITLE = "DTMB Report 713, reproduced"
GRAVITY_DENSITY = DENSITY * 32.174  # of the water [lbf/ft^3]
HEADS = {
    "speed_kn": "speed<br>kn",
    "l": "<i>l</i>",
    "m": "<i>m</i>",
    "n": "<i>n</i>",
    "C_n": "<i>C</i><sub>n</sub>",
    "sin2_phi": "sin<sup>2</sup>&phi;",
    "C_s": "<i>C</i><sub>s</sub>",
    "sin_phi": "sin&phi;",
    "phi_deg": "&phi;<br>deg",
    "C_n_over_sin2": "<i>C</i><sub>n</sub>/<br>sin<sup>2</sup>&phi;",
    "delta": "&delta;<br>lb/ft",
    "C_f": "<i>C</i><sub>f</sub>",
}
DRAWN: tuple[tuple[str, str, Callable[[Figure], None]], ...] = (
    ("fig3", "Fig. 3. The normal force", figures.draw_normal),
    ("fig4", "Fig. 4. The side force", figures.draw_side),
    ("fig5", "Fig. 5. Is there a term with sin &phi;?", figures.draw_sine),
    ("directions", "Directions measured and by the laws", figures.draw_directions),
)


def report_page() -> str:
    """The page, as HTML with inline figures and nothing from elsewhere.

    Returns
    -------
    str
    """
    cells = recompute_all()
    claims = all_claims()
    drawn = []
    for k, (name, title, draw) in enumerate(DRAWN):
        check_patience("figures of the page", "there is no smaller page", done=k, of=len(DRAWN))
        plain = title.replace(" &phi;", " phi")
        drawn.append(frame.figure(name, title, frame.svg(name, plain, figures.SIZE, draw), CAPTIONS[name]))
    angles = np.concatenate([points(letter).phi_deg for letter in LETTERS])
    body = Template(BODY).substitute(
        verdict=_verdict(cells, claims),
        claims=claims_table(claims),
        range=f"{angles.min():.1f} to {angles.max():.1f}",
        laws=_laws(),
        figures="".join(drawn[:-1]),
        directions=drawn[-1],
        table1=_table_1(),
        table3=_table_3(),
        misprints=_misprints(cells),
        follows="; ".join(f"{HEADS[name].replace('<br>', ' ')} from {_named(of)}" for name, of in FOLLOWS.items()),
        density=f"{DENSITY:g}",
        norm=_norm(cells),
        slips=_slips(),
        table2=_table_2(cells),
    )
    return frame.page(TITLE, body)


def _named(columns: str) -> str:
    """Columns that others follow from, as their symbols."""
    symbols = {"sin^2 phi": "sin<sup>2</sup>&phi;", "sin phi": "sin&phi;", "delta": "&delta;"}
    symbols |= {name: HEADS[name] for name in ("l", "m", "n", "C_n")}
    return ", ".join(symbols.get(word, word) for word in columns.split(", "))


def _misprinted(cell: Cell) -> bool:
    row = table_2()[cell.row]
    return any((row["cable"], row["speed_kn"], cell.column) == (m.cable, m.speed, m.column) for m in MISPRINTS)


def _verdict(cells: list[Cell], claims: list[Claim]) -> str:
    wrong = [cell for cell in cells if _misprinted(cell) and not cell.agrees]
    norm = [cell for cell in cells if cell.column == "m" and not cell.agrees and cell not in wrong]
    others = [cell for cell in cells if not cell.agrees and cell not in wrong and cell not in norm]
    kept = sum(claim.verdict == HOLDS for claim in claims)
    return (
        f"<p>Of {len(cells):,} numbers of Table 2 that follow from others, {len(cells) - len(wrong + norm + others):,} "
        f"do within rounding. {len(wrong)} are misprints; in {len(norm)} rows the three direction cosines, by "
        f"themselves, are not quite those of a unit vector; {len(others)} is off by a unit of its last digit. All of "
        f"Table 3 comes out as printed. Of {len(claims)} statements {kept} hold by the report's own numbers, "
        f"{len(claims) - kept} hold in part.</p>"
    )


def _laws() -> str:
    rows = []
    for letter in LETTERS:
        data, normal, side = points(letter), normal_force(letter), side_force(letter)
        largest = (
            f"{side.b:.4f} &plusmn; {side.b_error:.4f}"
            + ("" if side.b < data.sin_phi.max() else "<br>beyond the points")
            if isfinite(side.b)
            else "none"
        )
        rows.append(
            (
                letter,
                str(len(data)),
                f"{data.phi_deg.min():.2f} to {data.phi_deg.max():.2f}",
                f"{normal.value:.3f} &plusmn; {normal.error:.3f} ({normal.sd:.2f})",
                f"{side.a:.4f} &plusmn; {side.a_error:.4f}",
                largest,
                f"({side.sd:.4f})",
                f"{np.median(data.C_f):.4f} ({data.C_f.std(ddof=1):.3f})",
                f"{np.median(data.C_f) / normal.value:.4f}",
            )
        )
    head = (
        *("cable", "rows", "&phi; deg", "<i>C</i><sub>r</sub>", "<i>a</i>", "<i>b</i>", "of a <i>C</i><sub>s</sub>"),
        *("<i>C</i><sub>f</sub>, median", "over <i>C</i><sub>r</sub>"),
    )
    return table(head, rows)


def _table_1() -> str:
    rows = []
    for letter in LETTERS:
        row = table_1()[letter]
        weight, length = float(row["weight_lb"]), float(row["length_ft"])
        air, water = float(row["weight_per_ft"]), float(row["weight_in_water"])
        over = weight / length
        # A quotient ten times too small is that of a weight with its point one place to the left.
        shade = "<td class='n'>" if abs(over / air - 1.0) < 0.02 else '<td class="n wrong">'
        area = (air - water) / GRAVITY_DENSITY
        circle = 0.25 * pi * (float(Fraction(row["diameter_in"])) / 12.0) ** 2
        rows.append(
            (
                *(letter, row["diameter_in"], row["length_ft"], row["lay"], row["weight_lb"], row["weight_per_ft"]),
                f"{shade}{over:.5f}</td>",
                row["weight_in_water"],
                f"{air / area:.0f}",
                f"{area / circle:.2f}",
            )
        )
    head = (
        *("cable", "diameter<br>in", "length<br>ft", "lay", "weight<br>lb", "over length<br>lb/ft", "recomputed"),
        *("in water<br>lb/ft", "density<br>lb/ft<sup>3</sup>", "area over<br>circle"),
    )
    return table(head, rows, text=(0, 1, 3))


def _table_3() -> str:
    rows = (
        ("printed", *(TABLE_3[letter] for letter in LETTERS)),
        ("recomputed", *(f"{normal_force(letter).value:.4f}" for letter in LETTERS)),
    )
    return table(("cable", *LETTERS), rows, "narrow")


def _misprints(cells: list[Cell]) -> str:
    rows = [(place, printed, right, "") for place, printed, right in SLIPS]
    for wrong in MISPRINTS:
        (cell,) = (
            c
            for c in cells
            if (table_2()[c.row]["cable"], table_2()[c.row]["speed_kn"], c.column)
            == (wrong.cable, wrong.speed, wrong.column)
        )
        rows.append(
            (
                f"Table 2, {wrong.cable}, {wrong.speed} kn, {HEADS[wrong.column]}",
                wrong.printed,
                wrong.mended,
                f"{cell.recomputed:.5f} from {_named(FOLLOWS[wrong.column])}",
            )
        )
    return table(("Place", "Printed", "Right", "Recomputed"), rows, text=range(4))


def _norm(cells: list[Cell]) -> str:
    off = [cell for cell in cells if cell.column == "m" and not cell.agrees and not _misprinted(cell)]
    return (
        f"In {len(off)} rows <i>l</i>, <i>m</i> and <i>n</i> are not those of a unit vector by up to "
        f"{max(cell.excess for cell in off):.1f} times what rounding does: they were not rounded from one set."
    )


def _slips() -> str:
    found = []
    for cell in drag_slips():
        row = table_2()[cell.row]
        found.append(f"{row['cable']}, {row['speed_kn']} kn ({cell.printed}, the others suggest {cell.recomputed:.3f})")
    return f"&delta; was drawn through values at other speeds; it is off the curve of its cable at {'; '.join(found)}."


def _table_2(cells: list[Cell]) -> str:
    off = {(cell.row, cell.column): cell for cell in [*cells, *drag_slips()] if not cell.agrees}
    parts = []
    for letter in LETTERS:
        rows = [
            [_cell(text, off.get((k, name))) for name, text in row.items() if name != "cable"]
            for k, row in enumerate(table_2())
            if row["cable"] == letter
        ]
        parts.append(f"<h3>Cable {letter}</h3>\n{table(HEADS.values(), rows, text=())}")
    return "".join(parts)


def _cell(text: str, off: Cell | None) -> str:
    if off is None:
        return text
    decimals = len(text.partition(".")[2]) + 1
    return f'<td class="n wrong">{text}<br><small>{number(off.recomputed, f".{decimals}f")}</small></td>'
