"""NRL Report 7048, reproduced: its page stands alone and lacks nothing, and its curves are what they say they are."""

import html
import re

import matplotlib.pyplot as plt
import numpy as np
import pytest
from helpers import Page, check_stands_alone, run
from matplotlib.artist import Artist
from matplotlib.lines import Line2D

import towatlas
from towatlas.report.nrl7048.figures import DRAWN_SEGMENTS, FIG_16, WINDOWS, Cable, coarse_gap, root_names
from towatlas.report.nrl7048.page import FIGURES, MODELS, PHOTOGRAPHS, expected_nodes, report_page
from towatlas.report.nrl7048.published import PUBLISHED, compare

# Of a page that takes a dozen seconds.
pytestmark = pytest.mark.slow

CURVES = [figure for figure in FIGURES if figure.cables]


@pytest.fixture(scope="module")
def page():
    return report_page()


def plain(cell):
    """A cell of the page as the program writes it."""
    for entity, word in {"lambda": "lambda", "gamma": "gamma", "minus": "-", "nbsp": " ", "infin": "inf"}.items():
        cell = cell.replace(html.unescape(f"&{entity};"), word)
    return cell


def test_page_stands_alone(page):
    check_stands_alone(page)


def test_every_figure_is_in_the_page(page):
    assert [figure.number for figure in FIGURES] == list(range(9, 18))
    sections = re.findall(r'<section id="fig(\d+)">(.*?)</section>', page, re.S)
    assert [int(number) for number, _ in sections] == list(range(9, 18))
    for (number, section), figure in zip(sections, FIGURES, strict=True):
        assert section.count("<svg ") == section.count("<figcaption>") == 1
        assert f'aria-label="Fig. {number}: {figure.title}"' in section
        assert len(re.findall(r"<path ", section)) > 10


def test_every_published_number_is_in_the_page(page):
    table = page[page.index('<table class="numbers">') :]
    rows = {plain(row[1]): row for row in Page(table[: table.index("</table>") + 8]).rows}
    assert len(rows) == len(PUBLISHED) + 1
    for comparison in compare():
        row = rows[comparison.published.quantity]
        printed, recomputed, then = comparison.text()
        assert plain(row[0]) == comparison.published.place
        assert (plain(row[2]), plain(row[3])) == (printed, recomputed)
        assert plain(row[5]) == then + comparison.published.method
        assert plain(row[6]) == comparison.published.explanation
        if comparison.published.relation == "=":
            assert float(plain(row[4])) == pytest.approx(
                float(recomputed) - float(printed), abs=10.0 ** -len(recomputed)
            )


def test_what_differs_is_said_at_the_top(page):
    top = " ".join(Page(page[: page.index('<h2 id="numbers">')] + "</body></html>").text)
    for comparison in compare():
        if comparison.published.relation != "~":
            printed = f"printed {comparison.text()[0]}, recomputed {comparison.text()[1]}"
            assert (printed in top) == (not comparison.agrees)


def test_same_bytes_twice(page, tmp_path, capsys):
    code, out, err = run(capsys, "report", "--out", tmp_path / "new" / "report.html")
    assert (code, out) == (0, "")
    assert "wrote" in err
    assert (tmp_path / "new" / "report.html").read_bytes() == page.encode()


def test_unknown_source(capsys):
    code, _, err = run(capsys, "report", "nrl7049")
    assert code == 2
    assert "'nrl7048', 'cable-body', 'dtmb713', 'device'" in err


def test_page_of_an_unknown_kind(capsys, tmp_path):
    code, _, err = run(capsys, "report", "--out", tmp_path / "report.pdf")
    assert code == 2
    assert "ending must be .html" in err


@pytest.mark.parametrize("figure", FIGURES, ids=lambda figure: f"fig{figure.number}")
def test_draws_on_axes_given_or_new(figure):
    given = plt.figure().subplots()
    for ax in (given, None):
        before = len(plt.get_fignums())
        artists = figure.draw(ax)
        assert artists
        assert all(isinstance(artist, Artist) for artist in artists)
        homes = {artist.axes for artist in artists}
        assert all((home in [given, *given.child_axes]) == (ax is given) for home in homes)
        assert len(plt.get_fignums()) == before + (ax is None)
    plt.close("all")


@pytest.mark.parametrize("figure", CURVES, ids=lambda figure: f"fig{figure.number}")
def test_curves_cross_zero_at_the_roots_alone(figure):
    """Roots come from counting, fish up; curves from forward shots: what lies between two samples is a root."""
    lines = figure.draw(None)[: len(figure.cables)]
    plt.close("all")
    for cable, line in zip(figure.cables, lines, strict=True):
        assert isinstance(line, Line2D)
        r_x0, errors = line.get_data()
        assert (r_x0[0], r_x0[-1]) == cable.bounds
        before = np.flatnonzero((errors[:-1] > 0) != (errors[1:] > 0))
        roots = towatlas.equilibria(cable.lam, cable.w_f, cable.gamma).R_x0
        assert len(before) == len(roots)
        assert (r_x0[before] < roots).all()
        assert (roots < r_x0[before + 1]).all()


@pytest.mark.parametrize("figure", CURVES, ids=lambda figure: f"fig{figure.number}")
def test_curves_are_true_to_the_eye(figure):
    """Twice the segments move no curve by 1e-4 of the height of what it is drawn in, 1/40 of the width of the line."""
    assert coarse_gap(figure.cables, WINDOWS[figure.number], 2 * DRAWN_SEGMENTS)[0] < 1e-4
    assert coarse_gap(figure.cables, WINDOWS[figure.number], DRAWN_SEGMENTS // 200)[0] > 1e-6


def test_shapes_are_those_of_the_names():
    """Fig. 17: median roots, from the tow point to the fish."""
    lines = FIGURES[-1].draw(None)
    plt.close("all")
    for cable, line in zip(FIG_16, lines, strict=True):
        found = towatlas.equilibria(cable.lam, cable.w_f, cable.gamma)
        x, z = line.get_data()
        assert (x[0], z[0]) == (pytest.approx(1.0, abs=1e-9), 0.0)
        assert (x[-1], z[-1]) == (pytest.approx(found.x_f[found.expected]), pytest.approx(found.z_f[found.expected]))
        assert ((x[1:] > 0) != (x[:-1] > 0)).sum() == found.nodes[found.expected]


def test_inner_roots_share_the_stated_part_of_the_range():
    cable = FIG_16[2]
    share = np.ptp(cable.equilibria.R_x0[1:-1]) / np.ptp(cable.bounds)
    assert f"{100 * share:.1f}" == "0.3"


def test_names_of_roots():
    assert root_names(Cable(10.0, 0.0, 1.5).equilibria) == ["bl", "dl", "dr", "br", "a"]
    assert root_names(Cable(2.1, 0.0, 5.0).equilibria) == ["a"]


def nodes_of(photograph, drag=0.0):
    return expected_nodes(lam=photograph.lam, w_f=photograph.w_f, gamma=photograph.gamma, C=drag)


def test_photographs(page):
    """In a vacuum six of eight are right, the others miss a critical speed by less than 2 %; with drag all are."""
    wrong = [p for p in PHOTOGRAPHS if nodes_of(p) != p.nodes]
    assert [p.figure for p in wrong] == ["4c", "5a"]
    for p in wrong:
        assert 1.0 < float(towatlas.solve_critical(p.lam, p.w_f, p.nodes).gamma) / p.gamma < 1.02
    rows = [row for row in Page(page).rows if row[0] in {p.figure for p in PHOTOGRAPHS}]
    # The first of the tables with a row for each; what lasts of them comes later.
    rows = rows[: len(PHOTOGRAPHS)]
    assert [row[0] for row in rows] == [p.figure for p in PHOTOGRAPHS]
    assert [int(row[4]) for row in rows] == [p.nodes for p in PHOTOGRAPHS]
    for k, (_, drag) in enumerate(MODELS):
        assert [int(row[5 + k]) for row in rows] == [nodes_of(p, drag) for p in PHOTOGRAPHS]
    for p in wrong:
        assert f"Fig. {p.figure} has {p.nodes} instead of {nodes_of(p)}" in page
    assert "With drag the number of nodes is right for 8 of the 8 photographs." in page
