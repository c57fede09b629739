"""The shape of one equilibrium: against 34 digits, the forward shot, the balance of forces, and in the shell."""

import csv

import matplotlib.pyplot as plt
import mpmath as mp
import numpy as np
import pytest
import reference
import xarray as xr
from helpers import forward_step, run
from hypothesis import given, settings
from hypothesis import strategies as st

import towatlas
from towatlas.plot.shape import plot_shape
from towatlas.tables.seal import read_sealed

SYSTEMS = [
    (10.0, 1.0, 0.6, "median"),
    (37.8, 1352.0, 5.94, "median"),
    (37.8, 1352.0, 5.94, "outward"),
    (20.0, 0.0, 3.0, "median"),
    (30.0, 0.01, 2.0, "median"),
    (1.5, 30.0, 0.2, "median"),
]


@pytest.mark.parametrize(("lam", "w_f", "gamma", "root"), SYSTEMS)
def test_against_34_digits(lam, w_f, gamma, root):
    s = lam * np.array([0.0, 1e-9, 0.013, 0.31, 0.5, 0.77, 0.999])
    curve = towatlas.shape(lam, w_f, gamma, root=root, s=s)
    with mp.workdps(34):
        gamma2 = mp.mpf(gamma) ** 2
        mu = gamma2 * mp.mpf(w_f)
        sign = 1 if curve.attrs["x_f"] > 0 else -1
        a = abs(mp.mpf(curve.attrs["x_f"])) * gamma2
        for _ in range(3):
            end = reference.shot(a, mu, gamma2 * mp.mpf(lam))
            a -= (end.p - sign * gamma2) / end.q
        depth = reference.shot(a, mu, gamma2 * mp.mpf(lam)).z
        scale = max(1.0, abs(curve.attrs["x_f"]))
        for k, arc in enumerate(s):
            at = reference.shot(a, mu, gamma2 * (mp.mpf(lam) - mp.mpf(arc)))
            assert abs(sign * at.p / gamma2 - curve.x.values[k]) < 1e-11 * scale
            assert abs((depth - at.z) / gamma2 - curve.z.values[k]) < 1e-11 * scale
            assert abs(sign * at.f / gamma2 - curve.R_x.values[k]) < 1e-11 * (w_f + lam + abs(at.f / gamma2))


def test_forward_shot_follows_the_shape():
    """Skop's forward shot from R_x0 passes through every point; its error falls with the fourth power of the step."""
    lam, w_f, gamma = 12.0, 5.0, 1.1
    misses, step = [], forward_step()
    for segments in (200, 800):
        curve = towatlas.shape(lam, w_f, gamma, s=np.linspace(0, lam, segments + 1))
        x, force, path = 1.0, float(curve.R_x[0]), [1.0]
        for k in range(segments):
            below = w_f + lam * (segments - k) / segments
            x, force = step(x, force, below, gamma**2, lam / segments)
            path.append(x)
        misses.append(np.abs(curve.x.values - path).max())
    assert misses[1] < misses[0] / 200
    assert misses[1] < 1e-8


@settings(max_examples=60)
@given(
    lam=st.floats(0.05, 60),
    w_f=st.one_of(st.just(0.0), st.floats(1e-6, 1e4)),
    gamma=st.floats(0.05, 6),
    outward=st.booleans(),
)
def test_invariants(lam, w_f, gamma, outward):
    """Unit tangent, the tow point, the fish, force balance as integrals, and as many nodes as the count says."""
    curve = towatlas.shape(lam, w_f, gamma, root="outward" if outward else "median", s=np.linspace(0, lam, 4001))
    x, z, s = curve.x.values, curve.z.values, curve.s.values
    assert x[0] == pytest.approx(1.0, abs=1e-10 + 10 * curve.attrs["error"])
    assert z[0] == 0.0
    assert x[-1] == pytest.approx(curve.attrs["x_f"], rel=1e-12)
    assert z[-1] == pytest.approx(curve.attrs["z_f"], rel=1e-12)
    assert float(curve.R_x[-1]) == pytest.approx(w_f * gamma**2 * x[-1], rel=1e-12, abs=1e-12)
    chords = np.hypot(np.diff(x), np.diff(z))
    assert (chords <= np.diff(s) * (1 + 1e-9) + 1e-12).all()
    # Centrifugal force on all of the cable, by the trapezoidal rule.
    force = gamma**2 * float(np.sum(0.5 * (x[1:] + x[:-1]) * np.diff(s)))
    scale = gamma**2 * lam * np.abs(x).max()
    assert float(curve.R_x[0] - curve.R_x[-1]) == pytest.approx(force, abs=1e-2 * scale)
    s_node = curve.s_node.values
    assert len(s_node) == curve.attrs["nodes"]
    assert (np.diff(s_node) > 0).all()
    if len(s_node):
        at = towatlas.shape(lam, w_f, gamma, root="outward" if outward else "median", s=s_node)
        assert (np.abs(at.x) < 1e-13 * (1 + lam)).all()
        np.testing.assert_allclose(at.z, curve.z_node, atol=1e-13 * (1 + lam))


def test_any_order_and_every_root():
    lam, w_f, gamma = 37.8, 1352.0, 5.94
    found = towatlas.equilibria(lam, w_f, gamma)
    s = np.array([37.8, 0.0, 12.0])
    for k in range(len(found)):
        curve = towatlas.shape(lam, w_f, gamma, root=k, s=s)
        assert curve.attrs["R_x0"] == found.R_x0[k]
        assert curve.x.values[0] == pytest.approx(found.x_f[k], rel=1e-14)
        assert curve.x.values[1] == pytest.approx(1.0, abs=1e-11)
        assert float(curve["T"][1]) == pytest.approx(found.tension[k], rel=1e-13)
    assert towatlas.shape(lam, w_f, gamma).sizes["s"] == 401


@pytest.mark.parametrize(
    ("more", "match"),
    [
        ({"root": 5}, "from 0 to 4"),
        ({"root": -1}, "root must be"),
        ({"root": True}, "root must be"),
        ({"root": "mean"}, "root must be expected, median"),
        ({"root": "3 inner"}, "one of the branches 1 outer, 2 outer, 2 inner, 1 inner, outward"),
        ({"root": "median", "C": 0.018}, "got 'median'"),
        ({"s": [1.0, 38.0]}, "from 0 to lam = 37.8"),
        ({"s": [np.nan]}, "arc lengths"),
        ({"s": [[1.0]]}, "arc lengths"),
        ({"s": "a"}, "s must be a real number"),
    ],
)
def test_bad_input(more, match):
    with pytest.raises(ValueError, match=match):
        towatlas.shape(37.8, 1352, 5.94, **more)


def test_shell_files(capsys, tmp_path):
    system = ("shape", "--lam", 10, "--wf", 1, "--gamma", 0.6)
    code, out, _ = run(capsys, *system, "--points", 3)
    assert code == 0
    comment, header, *rows = out.splitlines()
    assert comment.startswith("# lam = 10.0, w_f = 1.0, gamma = 0.6, R_x0 = ")
    assert header == "s,x,y,z,R_x,R_y,R_z,T"
    assert [float(row.split(",")[0]) for row in rows] == [0, 5, 10]

    assert run(capsys, *system, "--root", "outward", "--s", 2, 7, "--out", tmp_path / "a" / "shape.csv")[0] == 0
    with (tmp_path / "a" / "shape.csv").open() as file:
        file.readline()
        rows = list(csv.DictReader(file))
    assert [float(row["s"]) for row in rows] == [2, 7]

    assert run(capsys, *system, "--out", tmp_path / "shape.nc")[0] == 0
    read_sealed(tmp_path / "shape.nc")
    with xr.open_dataset(tmp_path / "shape.nc") as file:
        curve = towatlas.shape(10, 1, 0.6)
        np.testing.assert_array_equal(file.x, curve.x)
        assert file.attrs["nodes"] == 1
        for name in ("x", "z", "R_x", "R_z", "T", "s", "s_node"):
            assert file[name].attrs["units"] == "1"
    assert run(capsys, *system, "--out", tmp_path / "shape.svg")[0] == 0
    assert (tmp_path / "shape.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize(
    "arguments", [("--out", "shape.doc"), ("--points", 1), ("--root", 7), ("--root", "upper"), ("--s", 11)]
)
def test_shell_usage(capsys, arguments):
    code, out, err = run(capsys, "shape", "--lam", 10, "--wf", 1, "--gamma", 0.6, *arguments)
    assert (code, out) == (2, "")
    assert err


def test_figure_has_true_proportions():
    curve = towatlas.shape(37.8, 1352, 5.94)
    figure, axes = plt.subplots()
    cable = plot_shape(curve, axes)
    assert axes.get_aspect() == 1.0
    assert len(cable.get_segments()) == 400
    low, high = axes.get_ylim()
    assert low > curve.z.max() > curve.z.min() > high
    nodes = next(line for line in axes.lines if line.get_label() == "node")
    np.testing.assert_array_equal(nodes.get_ydata(), curve.z_node)
    plt.close(figure)
