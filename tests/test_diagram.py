"""Bifurcation diagrams: branches against single speeds and folds, their words, files and the figure."""

import csv

import numpy as np
import pytest
import xarray
from helpers import run
from matplotlib.figure import Figure

import towatlas
from towatlas.plot.diagram import SHOWN, plot_diagram


@pytest.fixture(scope="module")
def found():
    return towatlas.diagram(10.0, 1.0, (0.3, 0.8))


def test_branches_are_the_shapes_of_single_speeds(found):
    for gamma in (0.35, 0.5, 0.7):
        shapes = towatlas.equilibria(10.0, 1.0, gamma)
        there = [b for b in found.branches if b.points[0].value < gamma < b.points[-1].value]
        assert len(there) == len(shapes)
        for branch in there:
            k = list(shapes.branch).index(branch.name)
            # Between samples 1 % apart.
            assert np.interp(gamma, branch.gamma, branch.r_f) == pytest.approx(shapes.r_f[k], rel=1e-3)
            assert np.interp(gamma, branch.gamma, branch.tension) == pytest.approx(shapes.tension[k], rel=1e-3)


def test_samples_are_what_stability_says(found):
    for branch in found.branches:
        for i in (1, len(branch.gamma) // 2, -1):
            here = towatlas.stability(10.0, 1.0, float(branch.gamma[i]))
            k = int(np.argmin(np.abs(here.equilibria.r_f - branch.r_f[i])))
            assert here.equilibria.r_f[k] == pytest.approx(branch.r_f[i], rel=1e-9)
            assert here.kind[k] == branch.kind[i]
            assert here.growth[k] == pytest.approx(branch.growth[i], abs=1e-9)


def test_growth_between_samples_is_heard(monkeypatch):
    """All samples of the first shape are below the bound of weak growth, its top is not: as `flutter` says."""
    for module in ("growth", "follower"):
        monkeypatch.setattr(f"towatlas.solve.{module}.WEAK", 0.010295)
    found = towatlas.diagram(37.8, 1352.0, (4.79, 4.9), C=0.018)
    (first,) = (branch for branch in found.branches if branch.name == "shape 1")
    assert set(first.kind) == {"weak"}
    assert set(first.between) == {"flutter"}
    windows = towatlas.flutter(37.8, 1352.0, (4.79, 4.9), C=0.018).windows
    assert [window.weak for window in windows if window.branch == "shape 1"] == [False]


def test_no_two_branches_have_one_name():
    """With drag the number of a shape is another's after a fold."""
    found = towatlas.diagram(4.0, 1.0, (0.4, 1.2), C=0.05)
    (fold,) = {point.value for branch in found.branches for point in branch.points if point.kind == "fold"}
    names = sorted(branch.name for branch in found.branches)
    assert names == ["shape 1", f"shape 1 from {fold:.5g}", f"shape 2 from {fold:.5g}"]
    windows = towatlas.flutter(4.0, 1.0, (0.4, 1.2), C=0.05).windows
    assert {window.branch for window in windows} <= set(names)
    for branch in found.branches:
        shapes = towatlas.equilibria(4.0, 1.0, float(branch.gamma[0]), C=0.05)
        k = list(shapes.branch).index(" ".join(branch.name.split()[:2]))
        assert shapes.r_f[k] == pytest.approx(branch.r_f[0], rel=1e-9)


def test_folds_join_two_branches(found):
    fold = towatlas.folds(10.0, 1.0, gamma=(0.3, 0.8))
    ends = [point for branch in found.branches for point in branch.points if point.kind == "fold"]
    assert len(ends) == 2 * len(fold.gamma)
    for end in ends:
        assert end.value == pytest.approx(fold.gamma[0], rel=1e-11)
        assert end.r_f == pytest.approx(fold.r_f[0], rel=1e-6)


def test_words(found):
    assert [repr(branch) for branch in found.branches if branch.name == "1 inner"] == [
        "Branch '1 inner': 0.466173 (fold) stable 0.665408 (krein) flutter 0.695781 (krein) stable 0.8 (range)"
    ]


def test_files(found, tmp_path, capsys):
    cable = ("--lam=10", "--wf=1", "--gamma=0.3:0.8")
    code, out, err = run(capsys, "diagram", *cable)
    rows = list(csv.DictReader(out.splitlines()))
    assert code == 0
    assert len(rows) == sum(len(branch.gamma) for branch in found.branches)
    assert "1 % apart" in err
    code, _, _ = run(capsys, "diagram", *cable, "--out", tmp_path / "d.nc")
    assert code == 0
    with xarray.open_dataset(tmp_path / "d.nc") as data:
        assert data.sizes["branch"] == 3
        assert {"point_kind", "lasts", "growth"} <= set(data)
    assert run(capsys, "diagram", *cable, "--out", tmp_path / "d.txt")[0] == 2


@pytest.mark.parametrize("show", SHOWN)
def test_figure(found, show):
    figure = Figure(figsize=(7.2, 5.4), layout="constrained")
    axes = figure.subplots()
    lines = plot_diagram(found, axes, show)
    # One line a stretch.
    assert len(lines) == sum(len(branch.between) for branch in found.branches)
    figure.draw_without_rendering()
    if show == "r_f":
        # The shape that lasts and ends at the fold may jump to the one without nodes.
        assert len(axes.texts) == 1
