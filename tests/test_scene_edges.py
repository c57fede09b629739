"""Edges of flutter as jumps of a scene, and designs and sweeps of shapes that last."""

import csv
import json

import numpy as np
import pytest
import xarray
from helpers import run

import towatlas
from towatlas.scene import edges
from towatlas.scene.designs import design
from towatlas.scene.edges import flutter_edges
from towatlas.scene.file import read_scene
from towatlas.scene.jumps import answer_scene
from towatlas.scene.ranges import design_over
from towatlas.scene.verdicts import verdicts_of
from towatlas.solve.follower import followed
from towatlas.system import System

FIG3 = read_scene("skop-fig3")


def answer_at(gamma, model="air"):
    return answer_scene(FIG3.at(gamma=gamma), model=model, asked=("nodes",))


# The published windows, gamma 3.3036311773 to 4.6342301549 and 5.1792791898 to 6.0264644564, are of lam = 37.8.
@pytest.mark.parametrize(
    ("gamma", "enters"), [(3.2, (True, True)), pytest.param(3.8, (False, False), marks=pytest.mark.slow)]
)
def test_edges_are_those_of_the_windows_of_flutter(gamma, enters):
    found = flutter_edges(answer_at(gamma))
    groups, unit = FIG3.system("air"), FIG3.speed_of(1.0)
    windows = towatlas.flutter(groups.lam, groups.w_f, (0.8 * gamma, 1.25 * gamma), C=groups.C).windows
    ends = [((one.low, one.low_kind), (one.high, one.high_kind)) for one in windows if not one.weak]
    at = [edge for both in ends for edge, kind in both if kind == "hopf"]
    assert found.complete
    for edge, below, enter in ((found.below, True, enters[0]), (found.above, False, enters[1])):
        # Overlapping windows have edges inside others.
        assert min(abs(edge.speed / unit / one - 1.0) for one in at if (one < gamma) == below) < 1e-9
        assert edge.enters == enter
        for beyond in (False, True):
            speed = edge.speed * (1.0 + 1e-4 * (1.0 if below != beyond else -1.0))
            answer = answer_scene(FIG3.at(speed=speed), model="air", asked=("nodes",))
            kind = verdicts_of(answer).shapes[answer.equilibria.expected].kind
            # Next to an edge growth is weak on the one side, and may be, by another mode, on the other.
            assert kind in (("flutter", "weak") if beyond == enter else ("stable", "weak"))


@pytest.mark.parametrize(
    ("numbers", "gamma", "end"),
    [
        ({"lam": 10.0, "w_f": 1.0}, 1.4, 0),
        ({"lam": 23.5, "w_f": 1.28, "C": 0.0115}, 1.85, 0),
        ({"lam": 3.17445, "w_f": 70.8204, "m_f": 135.257, "C": 24.3601, "w": 0.2482}, 1.05, -1),
    ],
)
def test_branches_are_looked_at_up_to_their_folds(numbers, gamma, end):
    traced, follower = followed(System.of(**numbers), 0.8 * gamma, 1.25 * gamma, at=gamma)
    t = float(np.log(1.25))
    column = min(traced.columns, key=lambda column: abs(column.t - t))
    beside = []
    for x in column.x:
        samples, *folds = follower.through(traced, t, float(x), lambda _: False)
        at = np.array([sample.t for sample in samples])
        known = np.sort([*at, *(fold.t for fold in folds if fold is not None)])
        assert np.diff(known).max() < np.log(1.0101)
        rho = follower.path.log_rho(np.array([sample.x for sample in samples]), at)[0][:, 0]
        assert np.abs(rho).max() < 1e-11
        if folds[end] is not None:
            beside.append(samples[end])
    # Two branches come to the fold, and stay two.
    first, second = beside
    assert first.t == second.t
    assert abs(first.x - second.x) > 1e-3


@pytest.mark.slow
def test_windows_that_are_barely_strong_have_their_edges():
    """Where one mode ceases to grow another does, by 0.0103 gamma at most: as `flutter` has it, that is no edge."""
    found, groups, unit = flutter_edges(answer_at(4.0)), FIG3.system("air"), FIG3.speed_of(1.0)
    windows = towatlas.flutter(groups.lam, groups.w_f, (3.2, 5.0), C=groups.C).windows
    strong = [one for one in windows if not one.weak and one.branch == windows[0].branch]
    assert len(strong) == 2
    assert 0.01 < strong[1].growth / strong[1].gamma < 0.0104
    assert strong[1].low < strong[0].high
    assert found.complete
    assert found.above is None
    assert found.below.speed / unit == pytest.approx(strong[0].low, rel=1e-9)
    assert found.high / unit == pytest.approx(5.0)


def test_a_margin_counts_edges_of_flutter(capsys):
    ask = ("scene", "skop-fig3", "--gamma", 3.2, "--model=air", "--json", "--patience", 300)
    edge = flutter_edges(answer_at(3.2)).above
    for margin, expected in ((1.01 * edge.distance, 6), (0.99 * edge.distance, 0)):
        code, out, err = run(capsys, *ask, "--margin", f"{100 * margin}%")
        answer = json.loads(out)
        assert (code, answer["margin_kept"]) == (expected, expected == 0)
        assert ("an edge of flutter above" in err) == (expected == 6)
        assert answer["flutter_edges"]["above"]["speed_m_s"] == pytest.approx(edge.speed, rel=1e-9)


def test_edges_that_were_not_looked_at_are_no_margin(capsys, monkeypatch):
    monkeypatch.setattr(edges, "SHARE", 1e-9)
    code, out, err = run(capsys, "scene", "skop-fig3", "--gamma", 3.2, "--model=vacuum", "--margin=2%", "--json")
    answer = json.loads(out)
    assert (code, answer["margin_kept"]) == (1, None)
    assert "--patience" in answer["flutter_edges"]["failure"]
    assert "that no edge of flutter is within the margin is not known" in err


def test_design_says_what_lasts_and_leaves_out_what_does_not(capsys):
    """At gamma 5.94 the depth is had in a window of flutter, by the drag of the air."""
    scene = FIG3.at(gamma=5.94)
    whole = design(scene, depth=0.6, max_length=0.8, model="air")
    assert [cable.verdict.kind for cable in whole.cables if cable.expected] == ["flutter"]
    groups = scene.system("air")
    for cable in whole.cables:
        here = towatlas.stability(cable.length / scene.radius, groups.w_f, 5.94, C=groups.C)
        assert here.kind[cable.shape] == cable.verdict.kind
    lasting = design(scene, depth=0.6, max_length=0.8, model="air", stable_only=True)
    assert [cable.length for cable in lasting.chosen] == [
        cable.length for cable in whole.cables if cable.verdict.kind == "stable"
    ]
    ask = ("design", "--scene", "skop-fig3", "--gamma", 5.94, "--depth=0.6m", "--max-length=0.65m", "--model=air")
    code, _, err = run(capsys, *ask, "--stable-only")
    assert code == 4
    assert "is known to last" in err


def test_without_damping_no_design_is_called_stable():
    """Its vacuum model answers, and a model with drag says what lasts."""
    found = design(FIG3, depth=0.635, max_length=1.0)
    assert found.model == "vacuum"
    groups = FIG3.system("air")
    for cable in found.cables:
        if cable.verdict.kind != "unknown":
            here = towatlas.stability(cable.length / FIG3.radius, groups.w_f, FIG3.gamma, C=groups.C)
            assert cable.verdict.kind in here.kind
        else:
            assert "no such shape" in cable.verdict.reason


@pytest.mark.slow
def test_a_range_of_speeds_that_flutters_keeps_no_cable():
    wanted = {"points": 2, "depth": 0.63, "max_length": 0.7, "model": "air"}
    assert design_over(FIG3, 1.4, 1.45, **wanted).cables
    assert not design_over(FIG3, 1.4, 1.45, stable_only=True, **wanted).cables
    kept = design_over(FIG3, 1.25, 1.26, stable_only=True, **wanted).cables
    assert kept
    assert all(set(cable.kinds) == {"stable"} for cable in kept)


class TestSweep:
    def test_kinds_are_those_of_the_scene(self):
        curve = towatlas.sweep(FIG3, speed=[1.3, 1.34, 1.5], model="air", stability=True)
        for i, speed in enumerate(curve.speed.values):
            answer = answer_scene(FIG3.at(speed=float(speed)), model="air", asked=("nodes",))
            verdicts = verdicts_of(answer).shapes
            order = np.argsort(answer.equilibria.r_f)
            assert [verdicts[k].kind for k in order] == curve.kind.values[0, i].tolist()
            assert curve.growth.values[0, i] == pytest.approx([verdicts[k].growth for k in order], rel=1e-6)

    def test_over_the_length(self):
        curve = towatlas.sweep(FIG3, length=[0.5, 0.73], model="air", stability=True)
        groups = FIG3.system("air")
        for i, length in enumerate(curve.length.values):
            here = towatlas.stability(length / FIG3.radius, groups.w_f, FIG3.gamma, C=groups.C)
            order = np.argsort(here.equilibria.r_f)
            assert here.kind[order].tolist() == curve.kind.values[0, i].tolist()

    def test_rows_of_those_that_last(self, capsys, tmp_path):
        ask = ("sweep", "skop-fig3", "--speed=1.3:1.4", "--points=3", "--model=air")
        every = list(csv.DictReader(run(capsys, *ask, "--stability")[1].splitlines()))
        lasting = list(csv.DictReader(run(capsys, *ask, "--stable-only")[1].splitlines()))
        assert lasting == [row for row in every if row["kind"] == "stable"]
        assert 0 < len(lasting) < len(every)
        assert "kind" not in run(capsys, *ask)[1].splitlines()[0].split(",")
        assert run(capsys, *ask, "--stable-only", "--out", tmp_path / "s.nc")[0] == 2
        assert run(capsys, *ask, "--stability", "--out", tmp_path / "s.nc")[0] == 0
        with xarray.open_dataset(tmp_path / "s.nc") as data:
            assert data.growth.attrs["units"] == "1/s"
            assert set(np.unique(data.kind)) <= {"stable", "flutter", "divergence", "weak", ""}
