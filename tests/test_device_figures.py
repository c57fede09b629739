"""Figures of the lateral force device, and the page of its paper."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from helpers import run

from towatlas import device
from towatlas.plot.device import local_curves, motion, plot_bearings, plot_diagram, plot_portrait, plot_turns
from towatlas.report.device.page import PRINTED, compare
from towatlas.solve.device.local import at_radius
from towatlas.solve.device.model import Device
from towatlas.solve.device.tangling import Line


def test_curves_are_bifurcations():
    """What is drawn at a radius is what is computed there."""
    for R in (0.4, 1.2, 1.7):
        exact = sorted(one.alpha for one in at_radius(1.0, R))
        crossings = []
        for _, alpha, radius in local_curves(1.0):
            k = np.flatnonzero((radius[:-1] - R) * (radius[1:] - R) < 0)
            share = (R - radius[k]) / (radius[k + 1] - radius[k])
            crossings += list(alpha[k] + share * (alpha[k + 1] - alpha[k]))
        assert sorted(crossings) == pytest.approx(exact, abs=1e-4)


def test_figures():
    _, axes = plt.subplots(2, 2)
    assert plot_diagram(axes[0, 0])
    assert plot_turns(axes[0, 1])
    assert plot_bearings(axes[1, 0], Line(300.0, 60.0, 300.0, 0.9), Line(150.0, 60.0, 300.0, 0.5))
    assert len(plot_portrait(axes[1, 1], Device(1.0, -1.459), 1.5, (-2.4, 0.3, -0.8, 0.8))) == 4 + 2
    plt.close("all")


def test_a_motion_ends_in_a_stable_point():
    phi, z = motion(Device(1.0, 0.0), 1.2, 0.3, 0.0, 60.0)
    (point,) = [p for p in device.points(1.0, 0.0, 1.2) if p.stable]
    assert (phi[-1], z[-1]) == pytest.approx((point.phi, 0.0), abs=1e-9)


def test_table_beside_the_printed_one():
    rows = compare()
    assert [row[1:3] for row in rows] == [one[1:] for one in PRINTED]
    assert [row[2] == row[3] for row in rows] == [False, True, True, True, True]


@pytest.mark.slow
def test_page(capsys, tmp_path):
    path = tmp_path / "device.html"
    code, _, err = run(capsys, "report", "device", "--out", path, "--patience", "1000")
    assert code == 0, err
    text = path.read_text()
    assert text.count("<svg") == 5
    for said in ("2.45458107808", "212.302651", "&minus;70.529"):
        assert said in text
    assert "src=" not in text
