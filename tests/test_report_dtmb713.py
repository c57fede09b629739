"""DTMB Report 713, reproduced: its table follows from itself, fits are SciPy's, cables trail as in a closed form."""

import math

import numpy as np
import pytest
from helpers import check_stands_alone, run
from scipy.optimize import brentq, curve_fit

from towatlas.report.claims import HOLDS, PART
from towatlas.report.dtmb713.claims import all_claims
from towatlas.report.dtmb713.data import LETTERS, MISPRINTS, TABLE_3, counts, points, table_1, table_2
from towatlas.report.dtmb713.directions import all_directions
from towatlas.report.dtmb713.fits import apparent_sine_term, bend, linear, normal_force, side_force, sine_term
from towatlas.report.dtmb713.page import DRAWN, report_page
from towatlas.report.dtmb713.recompute import FOLLOWS, drag_slips, recompute_all
from towatlas.scene.library import find_type


def place(cell):
    row = table_2()[cell.row]
    return row["cable"], row["speed_kn"], cell.column


def test_every_row_is_there():
    assert counts() == dict(zip(LETTERS, (7, 8, 10, 20, 29, 23, 29, 26), strict=True))
    assert len(table_2()) == 152
    assert all(len(row) == 13 and all(row.values()) for row in table_2())
    assert list(table_1()) == list(LETTERS)


def test_table_follows_from_itself():
    """All but two misprints, rows whose direction cosines are no unit vector, and one slip of a last digit."""
    cells = recompute_all()
    assert len(cells) == 152 * len(FOLLOWS)
    off = [cell for cell in cells if not cell.agrees]
    misprints = {(wrong.cable, wrong.speed, wrong.column) for wrong in MISPRINTS}
    assert misprints <= {place(cell) for cell in off}
    rest = [cell for cell in off if place(cell) not in misprints]
    assert {place(cell) for cell in rest if cell.column != "m"} == {("G", "13.95", "phi_deg")}
    # 1 - l^2 - n^2 less m^2 of what is off as direction: by hand, of the worst.
    worst = max((cell for cell in rest if cell.column == "m"), key=lambda cell: cell.excess)
    assert place(worst) == ("G", "10.00", "m")
    assert worst.recomputed == pytest.approx(math.sqrt(1 - 0.99880**2 - 0.0476**2), rel=1e-12)
    assert worst.excess < 3.0
    assert len([cell for cell in rest if cell.column == "m"]) == 22


def test_misprints_are_mended():
    """Their rows agree with the numbers mended, and by far not as printed."""
    for wrong in MISPRINTS:
        (cell,) = (cell for cell in recompute_all() if place(cell) == (wrong.cable, wrong.speed, wrong.column))
        assert cell.printed == wrong.printed
        assert abs(cell.recomputed - float(wrong.mended)) <= cell.slack
        assert cell.excess > 10.0


def test_coefficients_by_hand():
    """Eqs. (7a), (8a) and (10a) for the first row, in SI units."""
    density, speed, diameter = 1.934 * 14.59390294 / 0.3048**3, 4.0 * 1852 / 3600, 0.0254 / 16
    weight = 0.00679 * 4.4482216152605 / 0.3048
    pressure = 0.5 * density * speed**2 * diameter
    cells = {cell.column: cell.recomputed for cell in recompute_all()[: len(FOLLOWS)]}
    assert cells["C_n"] == pytest.approx(weight * 0.1385 * 0.99035 / 0.1386 / pressure, rel=1e-7)
    assert cells["C_s"] == pytest.approx(weight * 0.00446 / 0.1386 / pressure, rel=1e-7)
    drag = 0.008 * 4.4482216152605 / 0.3048
    assert cells["C_f"] == pytest.approx((drag / 0.99035 - weight * 0.1385) / pressure, rel=1e-7)


def test_drags_off_their_curve():
    assert [place(cell)[:2] for cell in drag_slips()] == [("E", "15.99"), ("H", "12.00"), ("H", "14.00")]


@pytest.mark.parametrize("letter", LETTERS)
def test_table_3(letter):
    assert normal_force(letter).value == pytest.approx(float(TABLE_3[letter]), abs=0.005000001)


@pytest.mark.parametrize("letter", LETTERS)
def test_side_force_is_that_of_scipy(letter):
    """Values and standard errors; where the free fit has no maximum, of the line."""
    data, fit = points(letter), side_force(letter)
    with_maximum = math.isfinite(fit.b)

    def law(s, a, b=math.inf):
        return a * s / (1.0 + (s / b) ** 2)

    start = (0.1, 0.05) if with_maximum else (0.1,)
    values, covariance = curve_fit(law if with_maximum else lambda s, a: a * s, data.sin_phi, data.C_s, p0=start)
    expected = [fit.a, fit.b][: len(start)]
    # Its finite differences and its ftol of 1e-8 in the sum of squares, which is 1e-4 in what it fits.
    assert values == pytest.approx(expected, rel=1e-4)
    assert np.sqrt(np.diag(covariance)) == pytest.approx([fit.a_error, fit.b_error][: len(start)], rel=1e-3)
    assert with_maximum == (fit.bend > 0.0) == (letter != "H")


@pytest.mark.parametrize("letter", LETTERS)
def test_laws_are_those_of_the_cable_types(letter):
    """Rounded as shipped: the drag coefficient to three decimals, a and b to four, standard deviations to one digit."""
    shipped, side, normal = find_type(f"pode-{letter}"), side_force(letter), normal_force(letter)
    values, sd = shipped.values, shipped.deviations
    assert normal.value == pytest.approx(values["drag_coefficient"], abs=5.001e-4)
    assert normal.sd == pytest.approx(sd["drag_coefficient"], abs=5.001e-3)
    assert side.a == pytest.approx(values["side_force_coefficient"], abs=5e-5)
    assert side.b == pytest.approx(values.get("side_force_sine", math.inf), abs=5e-5)
    assert side.sd == pytest.approx(sd["side_force"], abs=5e-5)
    assert np.median(points(letter).C_f) == values["tangential_drag_coefficient"]


def test_linear_fits_are_those_of_numpy():
    data = points("A")
    values, covariance = np.polyfit(data.sin_phi, data.C_n / data.sin_phi, 1, cov=True)
    fit = sine_term("A")
    assert fit.values[::-1] == pytest.approx(values, rel=1e-10)
    assert fit.errors[::-1] == pytest.approx(np.sqrt(np.diag(covariance)), rel=1e-10)
    assert linear(2.0 * data.sin_phi + 1e-9 * data.speed, data.sin_phi).values == pytest.approx([2.0], abs=1e-6)


def test_sine_terms():
    """Clear for A and H alone; seen from the side without the yaw for all."""
    t = {letter: sine_term(letter).t[0] for letter in LETTERS}
    assert [letter for letter in LETTERS if abs(t[letter]) > 4.0] == ["A", "H"]
    assert (t["A"], t["H"]) == (pytest.approx(11.0, abs=0.1), pytest.approx(4.7, abs=0.1))
    assert min(apparent_sine_term(letter).t[0] for letter in LETTERS) > 5.0
    assert bend("A").t[1] < 0.0 < bend("F").t[1]


def straight(letter, speed):
    """Direction cosines m, n of a straight cable by the laws: weight in balance with normal and side force."""
    normal, side = normal_force(letter).value, side_force(letter)
    data = points(letter)
    push = 0.5 * 1.934 * (speed * 1852 / 3600 / 0.3048) ** 2 * data.diameter / data.weight

    def cosines(phi):
        s = math.sin(phi)
        return normal * s * s * math.tan(phi) * push, float(side.at(np.array(s))) * s * push

    phi = brentq(lambda phi: math.hypot(*cosines(phi)) - math.sin(phi), 1e-3, 0.5, xtol=1e-14)
    return cosines(phi)


def test_cables_trail_by_the_closed_form():
    """Laws are rounded when shipped, by 3e-4 of themselves; the cable spans an angle of lam = 2e-5 of the circle."""
    for letter in LETTERS:
        data, found = points(letter), all_directions()[letter]
        expected = np.array([straight(letter, speed) for speed in data.speed])
        assert np.abs(found.by_laws[:, 1:] - expected).max() < 1e-4
        assert np.linalg.norm(found.by_laws, axis=1) == pytest.approx(1.0, abs=1e-9)
        assert np.abs(found.without_side[:, 2]).max() < 2e-5


def test_directions_measured_come_back():
    rms = [all_directions()[letter].rms_deg for letter in LETTERS]
    assert (round(min(rms), 2), round(max(rms), 2)) == (0.26, 0.46)
    assert round(float(all_directions()["G"].too_deep_deg.mean()), 1) == 3.4


def test_verdicts():
    """In part: no sine term (A, H), only a curve, proportional at first, a maximum, falls with the diameter."""
    claims = all_claims()
    assert {claim.verdict for claim in claims} == {HOLDS, PART}
    assert [k for k, claim in enumerate(claims) if claim.verdict == PART] == [6, 7, 10, 11, 15]


@pytest.mark.slow
def test_page(capsys, tmp_path):
    page = report_page()
    parsed = check_stands_alone(page)
    assert run(capsys, "report", "dtmb713", "--out", tmp_path / "page.html")[0] == 0
    assert (tmp_path / "page.html").read_bytes() == page.encode()
    text = " ".join("".join(parsed.text).split())
    for name, _, _ in DRAWN:
        assert f'<section id="{name}">' in page
        assert len([one for one in parsed.ids if one.startswith(f"{name}-")]) > 10
    for claim in all_claims():
        assert claim.found in page
    rows = parsed.rows
    for printed in table_2():
        values = [value for key, value in printed.items() if key != "cable"]
        assert any(all(cell.startswith(value) for cell, value in zip(row, values, strict=False)) for row in rows)
    for letter in LETTERS:
        fit = side_force(letter)
        assert f"{fit.a:.4f} ± {fit.a_error:.4f}" in text
    assert page.count('class="n wrong"') == sum(not cell.agrees for cell in recompute_all()) + len(drag_slips()) + 4
    assert "1,216 numbers of Table 2" in text
    assert "1,191 do within rounding" in text
