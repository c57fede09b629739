"""The part of the page on NRL Report 7048 that says which of its shapes last."""

from math import ceil, isfinite, pi
from string import Template
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from towatlas.report import frame
from towatlas.report.claims import claims_table
from towatlas.report.frame import number, table
from towatlas.report.nrl7048.interpretation import all_claims
from towatlas.report.nrl7048.lasting import (
    CHANGE,
    SPACING,
    Seen,
    lasting_length,
    moved_edge,
    seen,
    stretch,
)
from towatlas.report.nrl7048.photographs import DRAG, FIG_6, PHOTOGRAPHS, TOW_RADIUS, Case, Photograph
from towatlas.report.nrl7048.text import FIG_6_WORDS, GROWTH_CAPTION, LASTING, UNEXPLAINED
from towatlas.solve.critical import solve_critical
from towatlas.solve.growth import WEAK

CABLES = tuple(dict.fromkeys(p.case.cable for p in PHOTOGRAPHS))
SIZE = (9.0, 7.6)
# Density of lead, and what the report's line weighs [g/cm^3, g/cm].
LEAD, LINE = 11.34, 0.1824 / 30.48
INCH = 2.54
# Drag constants tried besides that of the report.
LESS_DRAG, MORE_DRAG = 0.016, 0.025
LASTS, GROWS = "#1f4e9c", "#c2571a"


def section() -> str:
    """HTML of the section.

    Returns
    -------
    str
    """
    flutters = [p for p in PHOTOGRAPHS if seen(p.case).growth > 0.0]
    p3c = next(p for p in PHOTOGRAPHS if p.figure == "3c")
    needed = lasting_length(p3c) / p3c.lam - 1.0
    longer = 1.0 + ceil(needed * 1e3) / 1e3
    edge = moved_edge(p3c)
    drawing = frame.svg("lasting", "Growth over the speed of the shapes next to the axis", SIZE, _draw)
    return Template(LASTING).substitute(
        drag=DRAG,
        spacing=f"{100 * SPACING:g}",
        growth=table(
            ("Fig.", "&gamma;", "nodes", "with drag", "growth", "frequency", "turns to e", "in a vacuum", "growth"),
            [_growth_row(p) for p in PHOTOGRAPHS],
            "narrow",
            text=(0, 3, 7),
        ),
        stable=_list([p for p in PHOTOGRAPHS if p not in flutters]),
        unstable=_list(flutters),
        several=_words(len(flutters)),
        figure=frame.figure(
            "lasting-figure", "Growth over the speed", drawing, Template(GROWTH_CAPTION).substitute(drag=DRAG)
        ),
        fig6=_fig_6(),
        change=f"{100 * CHANGE:g}",
        edges=table(
            (
                "Fig.",
                "&gamma;",
                "edge",
                "from here",
                *(f"{what} +{100 * CHANGE:g} %" for what in MOVED),
                "growth inside",
            ),
            [_edge_row(p) for p in PHOTOGRAPHS],
            "narrow",
        ),
        edge=number(edge.gamma, ".4f"),
        longer=number(100.0 * needed, ".2f"),
        changed=table(
            ("Fig.", *(title for title, _, _ in changes(longer))),
            [_changed_row(p, longer) for p in PHOTOGRAPHS],
            "narrow",
        ),
        ball=number(ball(PHOTOGRAPHS[0].w_f), ".2f"),
        unexplained=_unexplained(longer),
        claims=claims_table(all_claims()),
    )


MOVED = ("&lambda;", "<i>w</i><sub>f</sub>", "<i>C</i>")


def ball(w_f: float) -> float:
    """Radius of a lead ball of the weight of a fish, over the tow radius [-].

    Parameters
    ----------
    w_f : float
        [-].

    Returns
    -------
    float

    Examples
    --------
    >>> round(ball(1352.0), 2)
    0.38
    """
    mass = w_f * LINE * TOW_RADIUS * INCH
    return float((3.0 * mass / (4.0 * pi * LEAD)) ** (1.0 / 3.0) / (TOW_RADIUS * INCH))


def changes(longer: float) -> tuple[tuple[str, float | None, float], ...]:
    """What is tried: its name, the factor on lambda, None for a line longer by the radius of a ball, and C.

    Parameters
    ----------
    longer : float
        A factor [-].

    Returns
    -------
    tuple
    """
    by = number(100.0 * (longer - 1.0), ".1f")
    return (
        ("as printed", 1.0, DRAG),
        (f"<i>C</i> = {LESS_DRAG}", 1.0, LESS_DRAG),
        (f"<i>C</i> = {MORE_DRAG}", 1.0, MORE_DRAG),
        ("longer by a ball's radius", None, DRAG),
        (f"and <i>C</i> = {MORE_DRAG}", None, MORE_DRAG),
        (f"{by} % longer", longer, DRAG),
    )


def changed(p: Photograph, factor: float | None, C: float) -> Seen:
    """How the shape of a photograph moves with another length and drag.

    Parameters
    ----------
    p : Photograph
    factor : float or None
        On lam; None for a line longer by the radius of a lead ball.
    C : float
        Drag constant [-].

    Returns
    -------
    Seen
    """
    lam = p.lam + ball(p.w_f) if factor is None else p.lam * factor
    return seen(Case(lam, p.w_f, p.gamma, C))


def _list(photographs: list[Photograph]) -> str:
    names = [p.figure for p in photographs]
    return "Figs. " + (f"{', '.join(names[:-1])} and {names[-1]}" if len(names) > 1 else names[0])


def _words(count: int) -> str:
    return ("none", "one", "two", "three", "four", "five", "six", "seven", "eight")[count]


def _growth_row(p: Photograph) -> list[str]:
    air, vacuum = seen(p.case), seen(p.case.vacuum)
    turns = number(air.turns, ".1f") if isfinite(air.turns) else ""
    return [
        p.figure,
        f"{p.gamma:.2f}",
        f"{air.nodes}",
        *_kind(air),
        number(air.frequency, ".4f"),
        turns,
        *_kind(vacuum),
    ]


def _kind(found: Seen) -> tuple[str, str]:
    shade = "<td>" if found.kind == "stable" else '<td class="wrong">'
    growth = "0" if found.growth == 0.0 else number(found.growth, ".5f" if abs(found.growth) > 1e-4 else ".1e")
    return f"{shade}{found.kind}</td>", growth


def _edge_row(p: Photograph) -> list[str]:
    edge = moved_edge(p)
    shifts = (edge.longer, edge.heavier, edge.more_drag)
    return [
        p.figure,
        f"{p.gamma:.2f}",
        number(edge.gamma, ".4f"),
        number(100.0 * (edge.gamma / p.gamma - 1.0), "+.3f") + " %",
        *(number(100.0 * (shift / edge.gamma - 1.0), "+.3f") + " %" for shift in shifts),
        number(edge.window.growth, ".3f" if edge.window.growth > 1e-3 else ".1e"),
    ]


def _changed_row(p: Photograph, longer: float) -> list[str]:
    cells = []
    for _, factor, C in changes(longer):
        found = changed(p, factor, C)
        if found.growth > 0.0:
            shade = '<td class="n wrong">' if found.growth > WEAK * p.gamma else '<td class="n">'
            cells.append(f"{shade}{number(found.growth, '.3f' if found.growth > 1e-3 else '.0e')}</td>")
        else:
            cells.append('<td class="n">stable</td>')
    return [p.figure, *cells]


def _fig_6() -> str:
    gamma, found, vacuum, one = FIG_6.gamma, seen(FIG_6), seen(FIG_6.vacuum), stretch(FIG_6.cable)
    window = max((w for w in one.windows if w.low < gamma < w.high), key=lambda w: w.growth)
    (count,) = one.shapes
    c2 = float(solve_critical(*FIG_6.cable, 2).gamma)
    between = one.one_more_node[0]
    return Template(FIG_6_WORDS).substitute(
        gamma=f"{gamma:g}",
        low=number(window.low, ".4f"),
        high=number(window.high, ".4f"),
        growth=number(found.growth, ".4f"),
        turns=number(found.turns, ".1f"),
        frequency=number(found.frequency, ".3f"),
        slowest=number(one.low, ".2f"),
        fastest=number(one.high, ".2f"),
        count=_words(count),
        before=number(between[0], ".2f"),
        after=number(between[1], ".2f"),
        c2=number(c2, ".4f"),
        below=number(100.0 * (1.0 - c2 / gamma), ".0f"),
        nodes=_words(vacuum.nodes),
        vacuum=number(vacuum.growth, ".4f"),
    )


def _unexplained(longer: float) -> str:
    items, least = [], len(PHOTOGRAPHS)
    for title, factor, C in changes(longer):
        growth = {p: changed(p, factor, C).growth for p in PHOTOGRAPHS}
        left = [p.figure for p in PHOTOGRAPHS if growth[p] > WEAK * p.gamma]
        weak = [p.figure for p in PHOTOGRAPHS if 0.0 < growth[p] <= WEAK * p.gamma]
        said = [f"{', '.join(some)} {how}" for some, how in ((left, "by more"), (weak, "weakly")) if some]
        items.append(f"<li>{title}: {len(left) + len(weak)} grow, {'; '.join(said)}</li>\n")
        least = min(least, len(left) + len(weak))
    verdict = "No change of this table makes all eight last:" if least else ""
    p4c = next(p for p in PHOTOGRAPHS if p.figure == "4c")
    edge, air = moved_edge(p4c), seen(p4c.case)
    less, more = changed(p4c, 1.0, LESS_DRAG), changed(p4c, longer, DRAG)
    return Template(UNEXPLAINED).substitute(
        verdict=verdict,
        items="".join(items),
        lam=f"{p4c.lam:g}",
        w_f=f"{p4c.w_f:g}",
        gamma=f"{p4c.gamma:g}",
        growth=number(air.growth, ".4f"),
        drag=LESS_DRAG,
        less=less.kind,
        more=number(more.growth, ".2f"),
        above=number(100.0 * (p4c.gamma / edge.gamma - 1.0), ".2f"),
        edge=number(edge.gamma, ".4f"),
    )


def _draw(figure: Figure) -> None:
    panels = figure.subplots(len(CABLES), 1)
    for ax, cable in zip(panels, CABLES, strict=True):
        _draw_cable(ax, cable)
    figure.supylabel("growth in a turn of the tow point, factors of e", fontsize=10)
    panels[-1].set_xlabel(r"speed $\gamma = \Omega\sqrt{R/g}$")


def _draw_cable(ax: Axes, cable: tuple[float, float]) -> None:
    found = stretch(cable)
    for window in found.windows:
        if window.growth > WEAK * window.gamma:
            ax.axvspan(window.low, window.high, color=GROWS, alpha=0.13, linewidth=0)
    ax.plot(found.gamma, found.growth, color=GROWS, linewidth=1.6)
    top = 1.25 * float(found.growth.max())
    shown = [(p.figure, p.case) for p in PHOTOGRAPHS] + [("6", FIG_6)]
    for name, case in shown:
        if case.cable != cable:
            continue
        gamma, here = case.gamma, seen(case)
        growth = 1.0 / here.turns if isfinite(here.turns) else 0.0
        mark: dict[str, Any] = {"marker": "X", "color": GROWS} if growth else {"marker": "o", "color": LASTS}
        ax.plot(gamma, growth, markersize=7.5, mec="white", mew=0.8, zorder=5, clip_on=False, **mark)
        text = f"{name}, {here.nodes} node{'s' if here.nodes > 1 else ''}"
        left = gamma > 0.8 * found.high + 0.2 * found.low
        offset = (-8, -4) if left else (4, -13) if growth > 0.2 else (8, 4)
        style: dict[str, Any] = {"fontsize": 9, "color": mark["color"], "ha": "right" if left else "left"}
        ax.annotate(text, (gamma, growth), offset, textcoords="offset points", **style)
    for n in (1, 2, 3):
        critical = float(solve_critical(*cable, n).gamma)
        if found.low < critical < found.high:
            ax.plot(critical, top, marker="v", color="0.25", markersize=6, clip_on=False)
            ax.annotate(rf"$\gamma_{{c{n}}}$", (critical, top), (6, -9), textcoords="offset points", fontsize=9)
    ax.axhline(0.0, color="0.3", linewidth=0.8)
    ax.set(xlim=(found.low, found.high), ylim=(-0.04 * top, top))
    ax.set_title(rf"$\lambda$ = {cable[0]:g}, $w_f$ = {cable[1]:g}", loc="left", fontsize=10)
