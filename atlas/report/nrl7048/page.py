"""NRL Report 7048 reproduced: its figures and its numbers, printed and recomputed, in one page that needs no other."""

import html
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from string import Template

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from towatlas.effort import check_patience
from towatlas.report import frame
from towatlas.report.frame import maths, number
from towatlas.report.nrl7048 import lasting_page
from towatlas.report.nrl7048.figures import (
    DRAWN_SEGMENTS,
    FIG_10,
    FIG_12,
    FIG_14,
    FIG_16,
    SIZES,
    WINDOWS,
    Cable,
    coarse_gap,
    plot_experiment_curves,
    plot_experiment_shapes,
    plot_one_node_curves,
    plot_one_node_shapes,
    plot_outward_shape,
    plot_short_cables,
    plot_threshold,
    plot_two_node_curves,
    plot_two_node_shapes,
    root_names,
)
from towatlas.report.nrl7048.photographs import DRAG, PHOTOGRAPHS, TOW_RADIUS, Photograph
from towatlas.report.nrl7048.published import SEGMENTS, Comparison, compare
from towatlas.report.nrl7048.text import BODY, CAPTIONS
from towatlas.solve.critical import solve_critical
from towatlas.solve.equilibria import equilibria

# Share of the height of a curve, about the width of a line, below which a reader sees no difference.
VISIBLE = 0.005


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report.

    Attributes
    ----------
    number : int
        In the report, 9 to 17.
    title : str
        What it is called here.
    draw : callable
        From axes to the artists that carry data.
    cables : tuple of Cable
        Of the solution curves in it.
    folds : tuple of (float, float, int)
        lam, w_f and n of the transitions in it.
    """

    number: int
    title: str
    draw: Callable[[Axes | None], list[Artist]]
    cables: tuple[Cable, ...] = ()
    folds: tuple[tuple[float, float, int], ...] = ()


FIGURES = (
    ReportFigure(9, "Threshold length against the weight of the fish", plot_threshold),
    ReportFigure(10, "Solution curves of cables no longer than the threshold", plot_short_cables, FIG_10),
    ReportFigure(11, "Shape without a node", plot_outward_shape),
    ReportFigure(12, "Solution curves at the first transition", plot_one_node_curves, FIG_12, ((2.1, 0.0, 1),)),
    ReportFigure(13, "Shapes with one node", plot_one_node_shapes),
    ReportFigure(
        14, "Solution curves at two transitions", plot_two_node_curves, FIG_14, ((10.0, 0.0, 1), (10.0, 0.0, 2))
    ),
    ReportFigure(15, "Shapes with two nodes", plot_two_node_shapes),
    ReportFigure(
        16,
        "Solution curves of a cable that was photographed",
        plot_experiment_curves,
        FIG_16,
        ((37.8, 1352.0, 1), (37.8, 1352.0, 2), (37.8, 1352.0, 3)),
    ),
    ReportFigure(17, "Shapes of that cable", plot_experiment_shapes),
)


@cache
def expected_nodes(*, lam: float, w_f: float, gamma: float, C: float = 0.0) -> int:
    """Nodes of the equilibrium that is expected, in a vacuum or with drag.

    Parameters
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-].
    C : float
        Drag constant of the cable [-].

    Returns
    -------
    int
    """
    found = equilibria(lam, w_f, gamma, C=C)
    return int(found.nodes[found.expected])


# A column of the table of photographs for each model: its title, and its drag constant.
MODELS = (("in a vacuum", 0.0), ("with drag", DRAG))


def report_page() -> str:
    """The page, as HTML with inline figures and nothing from elsewhere.

    Returns
    -------
    str
    """
    rows, figures = compare(), []
    for k, figure in enumerate(FIGURES):
        check_patience("figures of the page", "there is no smaller page", done=k, of=len(FIGURES))
        figures.append(_figure(figure))
    body = Template(BODY).substitute(
        verdict=_verdict(rows),
        contents="".join(f'<li><a href="#fig{f.number}">Fig. {f.number}</a> {f.title}</li>\n' for f in FIGURES),
        numbers="".join(_number_row(row) for row in rows),
        figures="".join(figures),
        models="".join(f'<th scope="col" class="n">{title}</th>' for title, _ in MODELS),
        photographs="".join(_photograph_row(photograph) for photograph in PHOTOGRAPHS),
        failures=_failures(),
        lasting=lasting_page.section(),
        lengths=" and ".join(f"{lam * TOW_RADIUS:.1f} in" for lam in sorted({p.lam for p in PHOTOGRAPHS})),
        drag=DRAG,
        segments=SEGMENTS,
        drawn_segments=f"{DRAWN_SEGMENTS:,}",
    )
    return frame.page("NRL Report 7048, reproduced", body)


def _verdict(rows: list[Comparison]) -> str:
    """One sentence on what agrees, and a list of what does not."""
    values = [row for row in rows if row.published.relation == "="]
    bounds = [row for row in rows if row.published.relation in "<>"]
    read_off = len(rows) - len(values) - len(bounds)
    right = sum(row.agrees for row in values)
    kept = sum(row.agrees for row in bounds)
    differing = "".join(
        f"<li>{maths(row.published.quantity)}: printed {number(row.text()[0])}, recomputed {number(row.text()[1])}. "
        f"{maths(row.published.explanation)}</li>\n"
        for row in values + bounds
        if not row.agrees
    )
    return (
        f"<p>Of {len(values)} values printed as such, {right} are right in every digit; of {len(bounds)} bounds, "
        f"{kept} hold; {read_off} are given as approximate, most of them read off a figure. What differs:</p>\n"
        f"<ul>\n{differing}</ul>"
    )


def _number_row(row: Comparison) -> str:
    p = row.published
    printed, recomputed, then = row.text()
    verdict = ("agrees" if p.relation == "=" else "holds") if row.agrees else "differs"
    if p.relation == "~":
        verdict = "approximate"
    then = f"{number(then)}<br><small>{html.escape(p.method)}</small>" if then else ""
    numbers = (number(printed), number(recomputed), _difference(row), then)
    cells = "".join(f'<td class="n">{number}</td>' for number in numbers)
    return (
        f'<tr class="{verdict}"><td>{p.place.replace("Fig. ", "Fig.&nbsp;")}</td><td>{maths(p.quantity)}</td>'
        f"{cells}<td>{maths(p.explanation)}</td></tr>\n"
    )


def _difference(row: Comparison) -> str:
    """Recomputed less printed, with as many decimals as the recomputed value is shown with; of a bound nothing."""
    if row.published.relation in "<>":
        return ""
    difference = row.recomputed - row.published.printed
    decimals = len(row.text()[1].partition(".")[2])
    return "0" if difference == 0.0 else number(f"{difference:+.{decimals}f}")


def _figure(figure: ReportFigure) -> str:
    notes = [_gap_sentence(figure)] if figure.cables else []
    if figure.folds:
        speeds = ", ".join(
            f"&gamma;<sub>c{n}</sub> = {float(solve_critical(lam, w_f, n).gamma):.6f}" for lam, w_f, n in figure.folds
        )
        lam, w_f, _ = figure.folds[0]
        plural = "s" if len(figure.folds) > 1 else ""
        notes.append(f"Critical speed{plural} at &lambda; = {lam:g}, <i>w</i><sub>f</sub> = {w_f:g}: {speeds}.")
    title = f"Fig. {figure.number}. {figure.title}"
    drawing = frame.svg(
        f"fig{figure.number}",
        f"Fig. {figure.number}: {figure.title}",
        SIZES[figure.number],
        lambda drawing: figure.draw(drawing.subplots()),
    )
    caption = " ".join([CAPTIONS[figure.number], *notes])
    return frame.figure(f"fig{figure.number}", title, drawing, caption, _root_table(figure.cables))


def _gap_sentence(figure: ReportFigure) -> str:
    gap, cable, r_x0 = coarse_gap(figure.cables, WINDOWS[figure.number])
    seen = "too little to see" if gap < VISIBLE else "enough to see"
    where = f"curve {cable.name}" if cable.name else f"&gamma; = {cable.gamma:g}"
    return (
        f"With the report's {SEGMENTS} segments the curves lie within {number(format(100.0 * gap, '.2g'))} % of the "
        f"height from these, {seen}; farthest at {where}, <i>R</i><sub>x0</sub> = {number(format(r_x0, '.4g'))}."
    )


def _root_table(cables: tuple[Cable, ...]) -> str:
    if not cables:
        return ""
    rows = []
    for cable in cables:
        found = cable.equilibria
        facts = f"&lambda; = {cable.lam:g}, <i>w</i><sub>f</sub> = {cable.w_f:g}, &gamma; = {cable.gamma:g}"
        for k, name in enumerate(root_names(found)):
            head = f'<th scope="rowgroup" rowspan="{len(found)}">{cable.name} {facts}</th>' if k == 0 else ""
            columns = (found.R_x0, ".9g"), (found.x_f, ".6f"), (found.z_f, ".6f")
            cells = "".join(f'<td class="n">{number(format(column[k], form))}</td>' for column, form in columns)
            median = ", median" if k == len(found) // 2 else ""
            name = f"<i>R</i><sup>{name}</sup>{median}"
            rows.append(f'<tr>{head}<td>{name}</td>{cells}<td class="n">{found.nodes[k]}</td></tr>\n')
    return (
        '<table class="narrow"><thead><tr><th scope="col">cable</th><th scope="col">root</th>'
        '<th scope="col" class="n"><i>R</i><sub>x0</sub></th><th scope="col" class="n"><i>x</i><sub>f</sub></th>'
        '<th scope="col" class="n"><i>z</i><sub>f</sub></th><th scope="col" class="n">nodes</th></tr></thead>\n'
        f"<tbody>{''.join(rows)}</tbody></table>\n"
    )


def _photograph_row(p: Photograph) -> str:
    cells = ""
    for _, drag in MODELS:
        found = expected_nodes(lam=p.lam, w_f=p.w_f, gamma=p.gamma, C=drag)
        wrong = "" if found == p.nodes else " wrong"
        cells += f'<td class="n{wrong}">{found}</td>'
    facts = "".join(f'<td class="n">{fact}</td>' for fact in (f"{p.lam:g}", f"{p.w_f:g}", f"{p.gamma:.2f}", p.nodes))
    return f"<tr><td>{p.figure}</td>{facts}{cells}</tr>\n"


def _failures() -> str:
    """What each model gets wrong, and by how much the speed misses the transition of the vacuum."""
    sentences = []
    for title, drag in MODELS:
        nodes = {p: expected_nodes(lam=p.lam, w_f=p.w_f, gamma=p.gamma, C=drag) for p in PHOTOGRAPHS}
        wrong = [p for p in PHOTOGRAPHS if nodes[p] != p.nodes]
        sentences.append(
            f"{title.capitalize()} the number of nodes is right for {len(PHOTOGRAPHS) - len(wrong)} of the "
            f"{len(PHOTOGRAPHS)} photographs{f', wrong for {len(wrong)}' if wrong else ''}."
        )
        for p in wrong:
            found, speed = nodes[p], float(solve_critical(p.lam, p.w_f, p.nodes).gamma)
            above = 100.0 * (speed / p.gamma - 1.0)
            sentences.append(
                f"Fig. {p.figure} has {p.nodes} instead of {found}; in a vacuum {p.nodes} nodes are possible from "
                f"&gamma;<sub>c{p.nodes}</sub> = {speed:.3f} on, {above:.1f} % above the speed of the photograph."
            )
    return " ".join(sentences)
