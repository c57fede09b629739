"""Which of the photographed shapes of NRL Report 7048 last: its page against what the program says elsewhere."""

import numpy as np
import pytest
from helpers import Page

import towatlas
from towatlas.report.claims import FAILS, HOLDS, PART
from towatlas.report.nrl7048 import interpretation, lasting, lasting_page
from towatlas.report.nrl7048.photographs import DRAG, PHOTOGRAPHS

P = {photograph.figure: photograph for photograph in PHOTOGRAPHS}
# Cross-checked by chains of rigid links: docs and tests of growth rates.
GROWTH = {"3c": 0.152220, "4a": 0.0104, "4c": 0.0878, "5a": 0.0406, "5c": 0.1277}


@pytest.mark.parametrize("photograph", PHOTOGRAPHS, ids=lambda photograph: photograph.figure)
def test_growth_of_the_photographed_shapes(photograph):
    p = photograph
    found = lasting.seen(p.case)
    all_of = towatlas.stability(p.lam, p.w_f, p.gamma, C=DRAG)
    k = all_of.equilibria.expected
    assert found.growth == pytest.approx(all_of.growth[k], rel=1e-9, abs=1e-12)
    assert found.kind == all_of.kind[k]
    assert found.nodes == p.nodes
    if p.figure in GROWTH:
        assert found.growth == pytest.approx(GROWTH[p.figure], abs=5e-5)
        assert found.turns == pytest.approx(p.gamma / (2.0 * np.pi * found.growth))
    else:
        assert found.kind == "stable"


def test_a_line_so_much_longer_neither_flutters_nor_lasts():
    p = P["3c"]
    length = lasting.lasting_length(p)
    growth = [
        towatlas.stability(length * factor, p.w_f, p.gamma, C=DRAG).growth[1]
        for factor in (1.0 - 1e-6, 1.0, 1.0 + 1e-6)
    ]
    # Of a secant that ends at 1e-10 of the length, with a slope of 0.3.
    assert abs(growth[1]) < 1e-8
    # Beyond the edge other modes lead, which damp less than this one.
    assert growth[0] > 10.0 * abs(growth[1])
    assert growth[2] <= 0.0


@pytest.mark.slow
@pytest.mark.parametrize("figure", ["3c", "4c"])
def test_moved_edges_are_those_of_the_changed_cables(figure):
    """Secants from a known edge, against all windows of the changed cable."""
    p = P[figure]
    edge = lasting.moved_edge(p)
    more = 1.0 + lasting.CHANGE
    changed = {
        edge.gamma: (p.lam, p.w_f, DRAG),
        edge.longer: (p.lam * more, p.w_f, DRAG),
        edge.heavier: (p.lam, p.w_f * more, DRAG),
        edge.more_drag: (p.lam, p.w_f, DRAG * more),
    }
    assert len(changed) == 4
    for gamma, (lam, w_f, C) in changed.items():
        found = towatlas.flutter(lam, w_f, (0.995 * gamma, 1.005 * gamma), C=C)
        edges = [e for w in found.windows for e, kind in ((w.low, w.low_kind), (w.high, w.high_kind)) if kind == "hopf"]
        assert min(abs(e / gamma - 1.0) for e in edges) < 1e-9


@pytest.mark.slow
def test_windows_next_to_the_axis_are_those_of_all_shapes():
    found = lasting.stretch((37.8, 1352.0))
    edges = {edge for window in found.windows for edge in (window.low, window.high)}
    for known in (3.3036311773, 4.6342301549, 5.1792791898, 6.0264644564):
        assert min(abs(edge - known) for edge in edges) < 1e-9
    assert found.shapes == (3,)
    ((before, after),) = found.one_more_node
    at_both = [towatlas.equilibria(37.8, 1352.0, gamma, C=DRAG) for gamma in (before, after)]
    assert [found.nodes[found.expected] for found in at_both] == [1, 2]


@pytest.mark.slow
def test_claims():
    """Verdicts, and what tells them from others."""
    claims = {claim.place: claim for claim in interpretation.all_claims()}
    assert {place: claim.verdict for place, claim in claims.items()} == {
        "Step 1": HOLDS,
        **{f"Step {step}": PART for step in range(2, 7)},
        "Abstract": FAILS,
        "Eq. (24)": HOLDS,
        "Eq. (25)": PART,
        "Eq. (26)": HOLDS,
        "Conclusions": PART,
    }
    lasts = 0
    places = interpretation.beside(1) + interpretation.between(1)
    for place in places:
        found = towatlas.stability(*place.case.cable, place.case.gamma)
        lasts += str(found.kind[found.equilibria.expected]) == "stable"
    assert f"lasts in {lasts} of {len(places)} cases" in claims["Step 3"].found


@pytest.mark.slow
def test_section():
    text = lasting_page.section()
    assert "$" not in text
    assert text.count("<svg ") == 1
    page = Page(f"<html><body>{text}</body></html>")
    assert [row[3] for row in page.rows if row[0] in P and len(row) == 9] == [
        lasting.seen(p.case).kind for p in PHOTOGRAPHS
    ]
    words = " ".join(page.text)
    assert "it grows by 0.1399" in words
    assert "No change of this table makes all eight last" in words
    assert "Fig. 4c" in words
