"""Coverings of the offsets of the fish count what is there, hold independent shots, and refuse what is missing."""

import json
from fractions import Fraction

import mpmath as mp
import pytest
from reference_proof import shoot

from towatlas import certify, certify_equilibria
from towatlas.cli import main
from towatlas.solve.proof import family, states
from towatlas.solve.proof.arithmetic import Refused, arb, working_bits
from towatlas.solve.proof.certificates import CERTIFIED, NOT_ISOLATED
from towatlas.solve.proof.covering import USED, Covering, _Count, cover

CABLES = [(37.8, 1352.0, 2.0, 0.7), (10.0, 0.0, 1.2, 3.0)]


@pytest.mark.parametrize(
    ("system", "roots"),
    [
        ((37.8, 1352.0, 1.0), 3),
        ((10.0, 0.0, 0.3), 1),
        pytest.param((37.8, 1352.0, 3.45), 5, marks=pytest.mark.slow),
        pytest.param((10.0, 0.0, 1.2), 3, marks=pytest.mark.slow),
    ],
)
def test_the_number_is_proved_in_two_ways(system, roots):
    found = certify_equilibria(*system, cover=True)
    assert (found.status, found.count, len(found.states)) == (CERTIFIED, "by theorem and by covering", roots)


@pytest.mark.parametrize("lost", [0, 1, 2])
def test_a_missing_equilibrium_is_refused(monkeypatch, lost):
    """By the covering alone: the theorem is kept out."""
    solve = states.equilibria

    class Fewer:
        def __init__(self, *system):
            found, kept = solve(*system), [k for k in range(3) if k != lost]
            self.branch, self.x_f = found.branch[kept], found.x_f[kept]

    monkeypatch.setattr(states, "_passed", lambda **_: (None, "not tried"))
    whole = certify_equilibria(37.8, 1352.0, 1.0, cover=True)
    assert (whole.status, whole.count) == (CERTIFIED, "by covering")
    monkeypatch.setattr(states, "equilibria", Fewer)
    found = certify_equilibria(37.8, 1352.0, 1.0, cover=True)
    assert (found.status, found.count, found.reason) == (NOT_ISOLATED, None, "2 equilibria are proved, of 3")


def test_the_theorem_stands_where_a_covering_gives_up(monkeypatch):
    def refused(**_):
        raise Refused("WRAPPED", "too wide")

    monkeypatch.setattr(states, "cover_offsets", refused)
    found = certify_equilibria(2.0, 0.0, 1.0, cover=True)
    assert (found.status, found.count) == (CERTIFIED, "by theorem")
    assert "by covering: not proved, too wide" in found.reason
    monkeypatch.setattr(states, "cover_offsets", lambda **_: Covering(3, 1))
    assert certify_equilibria(2.0, 0.0, 1.0, cover=True).status == NOT_ISOLATED


def test_a_speed_at_a_fold_is_refused():
    """There p touches gamma^2 to within what a double leaves, and its slope vanishes."""
    gamma = float(certify(37.8, 1352.0, 1).gamma)
    with pytest.raises(Refused, match="next to the offset"):
        cover(lam=37.8, w_f=1352.0, gamma=gamma)
    for beside, roots in ((0.999, 1), (1.001, 3)):
        assert cover(lam=37.8, w_f=1352.0, gamma=gamma * beside).roots == roots


@pytest.mark.parametrize("system", [(5.0, 1.0, 1e-170), (5.0, 0.0, 1e80), (5.0, 1e200, 1e100), (5.0, 0.0, 1e-30)])
def test_extreme_numbers_are_refused_with_a_reason(system):
    lam, w_f, gamma = system
    with pytest.raises(Refused, match=r"too small or too large|next to the offset"):
        cover(lam=lam, w_f=w_f, gamma=gamma)


def _off(lam, w_f, gamma, a):
    """The bound of a family about a, and by how much shots of 45 digits leave it in p, and in q its bound by Cauchy."""
    weight, G, length = Fraction(w_f), Fraction(gamma) ** 2, Fraction(lam)
    middle, radius = Fraction(a), Fraction(a) / 16
    with working_bits(128):
        found = family.enclose(lam=length, w_f=weight, G=G, middle=middle, radius=radius)
    away = []
    with mp.workdps(45):
        coefficients = [mp.mpf(value.mid().str(40, radius=False)) for value in found.p]
        for alpha in (-USED, Fraction(1, 3), USED):
            offset = middle + alpha * radius
            exact = [mp.mpf(value.numerator) / value.denominator for value in (offset, G, length, weight)]
            _, p, q = shoot(*exact)
            z = mp.mpf(alpha.numerator) / alpha.denominator
            slope = mp.fsum(k * c * z ** (k - 1) for k, c in enumerate(coefficients) if k)
            away.append(abs(p - mp.fsum(c * z**k for k, c in enumerate(coefficients))))
            away.append(abs(q * float(radius) - slope) * float(1 - USED))
    return float(found.off), float(max(away))


@pytest.mark.parametrize("system", CABLES)
def test_independent_shots_lie_in_the_enclosures(system):
    off, away = _off(*system)
    assert away <= off < 1e-4


@pytest.mark.parametrize("system", CABLES)
@pytest.mark.parametrize(("part", "by"), [("f", 1e-10), ("q", 1e-7)])
def test_spoiled_polynomials_cost_width_and_no_truth(monkeypatch, system, part, by):
    honest = family._piece

    def spoiled(series, t, h):
        piece = honest(series, t, h)
        rows = getattr(piece, part)
        # In alpha z^3, in every step.
        rows[1][3] += int(by * max(map(abs, rows[0])))
        return piece

    before, _ = _off(*system)
    monkeypatch.setattr(family, "_piece", spoiled)
    off, away = _off(*system)
    assert away <= off
    assert off > 2 * before


def test_polynomials_of_another_root_are_refused(monkeypatch):
    """-1 / r has the right square."""
    honest = family._piece

    def spoiled(series, t, h):
        return honest([series[0], -series[1]], t, h)

    monkeypatch.setattr(family, "_piece", spoiled)
    for system in CABLES:
        with pytest.raises(Refused, match="1 / r is not enclosed"):
            _off(*system)


def test_pieces_are_counted():
    """A pair of each sign, and the outward one."""
    rise, fall = (None, 1), (None, -1)
    count = _Count(arb(1))
    count.add([(0, 0), rise, (1, 0), (1, 0), fall, fall])
    count.add([fall, (-1, 0), rise, (0, 0), rise, (0, 0), rise, (1, 0)])
    assert count.roots == 5
    for wrong in ([rise, fall], [(1, 0)], [fall, (1, 0)]):
        with pytest.raises(Refused):
            _Count(arb(1)).add(wrong)


def test_command(capsys):
    assert main(["certify", "--lam", "2", "--wf", "0", "--gamma", "1", "--cover", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["count"] == "by theorem and by covering"
    assert main(["certify", "--lam", "2", "--wf", "0", "--cover"]) == 2
    assert "name it with --gamma" in capsys.readouterr().err
