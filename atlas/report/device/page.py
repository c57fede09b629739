"""The paper on the lateral force device in one page: its table, misprints, Figs. 5 to 8, turns and tangling."""

from collections.abc import Callable
from dataclasses import dataclass
from math import acos, degrees, pi, radians
from string import Template

from matplotlib.figure import Figure

from towatlas.plot.device import plot_bearings, plot_diagram, plot_portrait, plot_turns
from towatlas.report import frame
from towatlas.report.device.text import BODY, CAPTIONS, MISPRINTS
from towatlas.report.frame import number, table
from towatlas.solve.device.bifurcations import bifurcations
from towatlas.solve.device.model import Device
from towatlas.solve.device.tangling import Line, tangle

TITLE = "The lateral force device, reproduced"
# k, R by AUTO and R from the expression, as printed.
PRINTED = (
    (0.5, "2.454374", "2.45457"),
    (1.0, "1.585319", "1.58535"),
    (1.5, "1.324478", "1.32449"),
    (2.0, "1.207344", "1.20735"),
    (3.0, "1.105772", "1.10578"),
)
# alpha [rad] and R of the portraits, and what they show.
CROSSING = ((-1.45, 1.5), (-1.459, 1.5), (-1.463, 1.5), (-1.475, 1.5), (-1.411, 1.56), (-1.418, 1.56))
CROSSING_WINDOW = (-2.4, 0.3, -0.8, 0.8)
PATHS = ((radians(-80), 3.2), (radians(-80), 2.2), (radians(-80), 1.2), (0.0, 1.2), (0.0, 0.65), (0.0, 0.5))
PATHS_WINDOW = (-3.6, pi, -2.0, 2.0)
LINES = Line(300.0, 60.0, 300.0, 0.9), Line(150.0, 60.0, 300.0, 0.5)


@dataclass(frozen=True)
class Drawn:
    """A figure of the page.

    Attributes
    ----------
    title : str
        Its heading.
    size : (float, float)
        Width and height [in].
    draw : callable
        On a Figure.
    """

    title: str
    size: tuple[float, float]
    draw: Callable[[Figure], object]


def report_page() -> str:
    """The page, as HTML with inline figures and nothing from elsewhere.

    Returns
    -------
    str
    """
    (tangled,) = tangle(*LINES)
    facts = {
        "critical": number(-degrees(acos(1.0 / 3.0)), ".3f"),
        "radius": number(tangled.R, ".6f"),
        "bearing": number(tangled.phi, ".6f"),
    }
    figures = [
        frame.figure(
            name,
            one.title,
            frame.svg(name, one.title, one.size, one.draw),
            Template(CAPTIONS[name]).substitute(facts),
        )
        for name, one in FIGURES.items()
    ]
    rows = compare()
    right = sum(row[2] == row[3] for row in rows)
    head = ("k", "AUTO, printed", "expression, printed", "recomputed, rounded", "recomputed", "AUTO less recomputed")
    body = Template(BODY).substitute(
        facts,
        verdict=f"Of the {len(rows)} values from the expression {right} are right in all digits; AUTO's all lie lower.",
        table=table(head, [[number(cell) for cell in row] for row in rows], "numbers narrow", text=()),
        misprints="".join(f"<li>{one}</li>\n" for one in MISPRINTS),
        figures="".join(figures),
    )
    return frame.page(TITLE, body)


def compare() -> list[tuple[str, ...]]:
    """The printed table beside what is recomputed.

    Returns
    -------
    list of tuple of str
        k, AUTO, expression, recomputed to the same digits and to more, and AUTO less it.
    """
    rows: list[tuple[str, ...]] = []
    for k, auto, printed in PRINTED:
        (one,) = [b for b in bifurcations(k) if b.kind == "degenerate-hopf" and b.physical]
        rows.append((f"{k:g}", auto, printed, f"{one.R:.5f}", f"{one.R:.11f}", f"{float(auto) - one.R:.1e}"))
    return rows


def _draw_diagram(figure: Figure) -> None:
    left, right = figure.subplots(1, 2)
    plot_diagram(left)
    plot_diagram(right, whole=False)


def _portraits(settings: tuple[tuple[float, float], ...], window: tuple[float, float, float, float]) -> Callable:
    def draw(figure: Figure) -> None:
        grid = figure.subplots(2, 3, sharex=True, sharey=True)
        for letter, ax, (alpha, R) in zip("abcdef", grid.flat, settings, strict=True):
            plot_portrait(ax, Device(1.0, alpha), R, window)
            ax.set_title(rf"{letter}  $\alpha = {degrees(alpha):.5g}$°, $R = {R:g}$", fontsize=9)
        for ax in grid[-1]:
            ax.set_xlabel(r"$\phi$ (degrees)")
        for ax in grid[:, 0]:
            ax.set_ylabel(r"$d\phi/dt$")

    return draw


FIGURES = {
    "diagram": Drawn("Figs. 5 and 6. Bifurcations for k = 1", (10.0, 5.0), _draw_diagram),
    "crossing": Drawn(
        "Fig. 7. Where Hopf and homoclinic curves cross", (9.5, 6.2), _portraits(CROSSING, CROSSING_WINDOW)
    ),
    "paths": Drawn("Fig. 8. Two ways to a tighter turn", (9.5, 6.2), _portraits(PATHS, PATHS_WINDOW)),
    "turns": Drawn("The tightest turn", (7.5, 5.0), lambda figure: plot_turns(figure.subplots())),
    "bearings": Drawn("Tangling", (7.0, 4.2), lambda figure: plot_bearings(figure.subplots(), *LINES)),
}
