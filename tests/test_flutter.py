"""Windows in which shapes do not last: known edges, agreement with growth rates at single speeds, the shell."""

import json

import numpy as np
import pytest
from helpers import run

import towatlas
from towatlas.solve.follower import Follower
from towatlas.solve.growth import WEAK

AIR = {"C": 0.018}


def edges(found, branch):
    return [(w.low, w.high) for w in found.windows if w.branch == branch and not w.weak]


@pytest.mark.parametrize(
    ("span", "edge", "low"),
    [
        ((3.25, 3.36), 3.3036311773, True),
        ((4.62, 4.65), 4.6342301549, False),
        ((5.16, 5.2), 5.1792791898, True),
        ((6.0, 6.05), 6.0264644564, False),
    ],
)
def test_hopf_points_that_are_known(span, edge, low):
    found = towatlas.flutter(37.8, 1352.0, span, **AIR)
    assert found.complete
    kinds = {w.low if low else w.high: w.low_kind if low else w.high_kind for w in found.windows}
    nearest = min(kinds, key=lambda gamma: abs(gamma - edge))
    assert nearest == pytest.approx(edge, abs=1e-10)
    assert kinds[nearest] == "hopf"


@pytest.mark.parametrize("span", [(5.85, 6.05), (5.88, 6.0856), (5.9, 6.1)])
def test_an_edge_beside_another_mode_is_a_zero_of_growth(span):
    """Between the same two samples another mode begins to grow: secants that change over end where nothing is zero."""
    windows = towatlas.flutter(29.248754206543225, 1352.3444976076555, span, C=0.017969254569695718).windows
    first, second = (w for w in windows if w.branch == "shape 1")
    assert (first.high, second.low) == pytest.approx((5.99320435199, 5.92451311806), rel=1e-11)


def test_an_edge_takes_few_shots(monkeypatch):
    """Secants that keep a bracket, not halvings of it, of which 1e-13 would take forty."""
    taken, mode = [], Follower.mode
    monkeypatch.setattr(Follower, "mode", lambda *given: taken.append(given[3]) or mode(*given))
    towatlas.flutter(37.8, 1352.0, (6.0, 6.05), **AIR)
    assert 0 < len(taken) < 16


def test_weak_is_said_of_the_largest_growth():
    """Which may lie between the speeds that are looked at."""
    windows = towatlas.flutter(37.8, 1352.0, (4.7, 5.2), **AIR).windows
    assert windows
    assert all(window.weak == (window.growth < WEAK * window.gamma) for window in windows)


def test_krein_collisions_that_are_known():
    found = towatlas.flutter(37.8, 1352.0, (3.3, 5.1))
    assert found.complete
    fold = float(towatlas.solve_critical(37.8, 1352.0, 2).gamma)
    expected = [(fold, 3.643306226987), (3.887892146622, 4.635754473627), (4.797, 4.962)]
    for (low, high), window, digits in zip(edges(found, "2 inner"), expected, (1e-11, 1e-11, 1e-3), strict=True):
        assert (low, high) == pytest.approx(window, abs=digits)
    kinds = [(w.low_kind, w.high_kind) for w in found.windows if w.branch == "2 inner"]
    assert kinds == [("fold", "krein"), ("krein", "krein"), ("krein", "krein")]


def test_a_narrow_window_of_the_shape_with_one_node():
    """2 % wide, in the middle of speeds at which that shape lasts: the energy alone does not forbid it."""
    found = towatlas.flutter(37.8, 1352.0, (2.6, 2.85))
    low, high = edges(found, "1 inner")[0]
    for gamma, lasts in ((low * 0.999, True), (low * 1.001, False), (high * 0.999, False), (high * 1.001, True)):
        here = towatlas.stability(37.8, 1352.0, gamma)
        assert (here.kind[list(here.equilibria.branch).index("1 inner")] == "stable") == lasts
    assert (low, high) == pytest.approx((2.694939510, 2.751170128), abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cable", "span", "fluid"),
    [((10.0, 1.0), (0.5, 1.5), {"C": 0.03}), ((2.5, 0.5), (0.8, 4.0), {}), ((6.0, 20.0), (1.0, 2.0), {"C": 0.1})],
)
def test_windows_are_what_single_speeds_say(cable, span, fluid):
    with towatlas.patience(300.0):
        found = towatlas.flutter(*cable, span, **fluid)
    assert found.complete
    rng = np.random.default_rng(3)
    borders = sorted({edge for w in found.windows for edge in (w.low, w.high)})
    for gamma in np.exp(rng.uniform(*np.log(span), 25)):
        if min(abs(gamma / edge - 1.0) for edge in borders) < 1e-3:
            continue
        here = towatlas.stability(*cable, gamma, **fluid)
        growing = sum(kind not in ("stable", "weak") for kind in here.kind)
        inside = [w for w in found.windows if w.low < gamma < w.high and not w.weak]
        assert (growing == 0) == (not inside), (gamma, here.kind)
        assert all(window.growth >= WEAK * window.gamma for window in inside)
        if inside:
            assert max(w.growth for w in inside) > 0.999 * here.growth.max()


class TestCommand:
    def test_json_and_table(self, capsys):
        cable = ("--lam=37.8", "--wf=1352", "--gamma=4.6:4.7", "--C=0.018")
        code, out, err = run(capsys, "flutter", *cable, "--json")
        assert code == 0
        rows = json.loads(out)
        keys = {"branch", "from", "to", "from_kind", "to_kind", "frequency_from", "frequency_to", "growth_max"}
        assert keys | {"gamma_max", "weak"} <= set(rows[0])
        assert "1 % apart" in err
        code, out, _ = run(capsys, "flutter", *cable)
        assert len(out.splitlines()) == len(rows) + 1

    def test_bad_input(self, capsys):
        assert run(capsys, "flutter", "--lam=3", "--wf=1", "--gamma=2:1")[0] == 2
        code, _, err = run(capsys, "flutter", "--lam=3", "--wf=1", "--gamma=-2:-1")
        assert code == 2
        assert "two positive speeds" in err
