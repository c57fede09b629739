"""Units, labels and chunks at the door: what pint, pandas, xarray and dask pass, and get back."""

import pickle

import numpy as np
import pandas as pd
import pint
import pytest
import xarray as xr

import towatlas
from towatlas.kernels import status

UNITS = pint.UnitRegistry()
Q = UNITS.Quantity
METHODS = ("critical_speed", "reaction", "fish_offset", "fish_depth", "tow_tension", "error", "status")


@pytest.fixture(scope="module")
def labels():
    lam = pd.Series([10.0, 20.0, 40.0], index=["a", "b", "c"], name="L/R")
    return lam, pd.Series([3.0, 1.0, 2.0], index=["c", "a", "b"])


@pytest.mark.parametrize(
    ("given", "plain"),
    [
        (Q(15, "m") / Q(100, "cm"), 15.0),
        (Q([1500.0, 4000.0], "cm/m"), [15.0, 40.0]),
        ([Q(15, "m") / Q(1, "m"), 40.0], [15.0, 40.0]),
        (Q(1500, "percent"), 15.0),
    ],
)
def test_a_ratio_is_made_dimensionless(atlas_file, given, plain):
    for function in (atlas_file.critical_speed, lambda *cable: towatlas.solve_critical(*cable).gamma):
        # One cable is looked up in plain numbers, which round in another order.
        np.testing.assert_allclose(function(given, 1.0), function(np.array(plain), 1.0), rtol=1e-14)
    xarray = xr.DataArray(np.atleast_1d(plain), dims="cable")
    np.testing.assert_array_equal(
        atlas_file.critical_speed(xarray, Q(100, "cm/m")), atlas_file.critical_speed(xarray, 1.0)
    )


@pytest.mark.parametrize("given", [Q(150, "m"), [Q(15, "m"), 3.0], Q([15.0, 16.0], "kg")])
def test_a_dimension_is_refused(atlas_file, given):
    functions = (
        atlas_file.critical_speed,
        atlas_file.states,
        towatlas.solve_critical,
        towatlas.excess_length,
        towatlas.equilibria_many,
        towatlas.equilibria,
        towatlas.System.of,
        lambda lam, w_f, *_: towatlas.massless_cable(lam),
    )
    for function in functions:
        more = (1.0,) if function in (towatlas.equilibria, towatlas.equilibria_many) else ()
        with pytest.raises(ValueError, match=r"lam must be dimensionless: .*, got '.*[mg]'"):
            function(given, 1.0, *more)


def test_scenes_convert_what_has_their_dimension():
    scene = towatlas.read_scene("skop-fig3")
    with pytest.raises(ValueError, match="length must be in m or what converts to it, got '3 kg'"):
        towatlas.sweep(scene, length=[Q(3, "kg"), Q(4, "kg")])


def test_series_are_aligned_by_their_labels(atlas_file, labels):
    lam, w_f = labels
    for name in METHODS:
        method = getattr(atlas_file, name)
        found = method(lam, w_f)
        assert list(found.index) == ["a", "b", "c"]
        for label in lam.index:
            assert found[label] == pytest.approx(method(lam[label], w_f[label]), rel=2e-14, abs=0)
    assert atlas_file.status(lam, w_f).dtype == np.int8
    assert atlas_file.critical_speed(lam, 1.0, 2).name == "gamma"
    # Labels that occur twice, where they are the same anyway.
    twice = pd.Series([10.0, 20.0], index=["a", "a"])
    assert list(atlas_file.critical_speed(twice, 2.0 * twice).index) == ["a", "a"]
    for function, name in ((towatlas.threshold_length, "lambda_c"), (towatlas.massless_cable, "gamma")):
        found = function(w_f + 1.0)
        assert found.name == name
        np.testing.assert_array_equal(found, function(w_f.to_numpy() + 1.0))
    excess = towatlas.excess_length(lam, w_f)
    assert excess["c"] == towatlas.excess_length(lam["c"], w_f["c"])


def test_what_is_missing_of_a_series_is_nan(atlas_file):
    lam = pd.Series([10.0, None, 20.0], dtype="Float64")
    found = atlas_file.critical_speed(lam, pd.Series([1, 1, 1]), outside="nan")
    assert list(found.isna()) == [False, True, False]
    assert atlas_file.status(lam, 1.0, outside="nan")[1] == status.BAD_INPUT


def test_series_that_do_not_fit_are_refused(atlas_file, labels):
    lam, w_f = labels
    for given, match in (
        ((lam, w_f.rename({"c": "d"})), "w_f has other labels"),
        ((lam, w_f.iloc[:2]), "w_f has other labels"),
        ((lam, pd.Series([1.0, 2.0, 3.0], index=["a", "a", "b"])), "w_f has other labels"),
        ((lam, [1.0, 2.0]), r"w_f has the shape \(2,\) beside Series of 3 values"),
        ((lam, np.ones((3, 1))), r"w_f has the shape \(3, 1\)"),
        (
            (lam.astype(str), 1.0),
            "lam must be real numbers, got a Series of str|lam must be real numbers, got a Series of obj",
        ),
        ((lam > 15.0, 1.0), "lam must be real numbers, got a Series of bool"),
        ((lam, xr.DataArray([1.0, 2.0, 3.0])), "do not go together"),
        ((lam.to_frame(), 1.0), "lam is a pandas DataFrame"),
    ):
        with pytest.raises(ValueError, match=match):
            atlas_file.critical_speed(*given)
    for function in (atlas_file.states, towatlas.solve_critical, towatlas.equilibria_many, towatlas.stability_many):
        speed = [1.0] if function in (towatlas.equilibria_many, towatlas.stability_many) else []
        with pytest.raises(ValueError, match="w_f has other labels"):
            function(lam, w_f.iloc[:2], *speed)
        with pytest.raises(ValueError, match=r"it lacks lam, w_f|w_f is a pandas DataFrame"):
            function(1.0, w_f.to_frame(name="weight"), *speed)
    with pytest.raises(ValueError, match="lam is a pandas Series"):
        towatlas.equilibria(lam, 1.0, 1.0)


def test_a_frame_for_a_whole_result(atlas_file, labels):
    lam, w_f = labels
    frame = pd.DataFrame({"w_f": w_f, "lam": lam, "n": [1, 2, 1], "ship": ["x", "y", "z"]})
    for function in (atlas_file.states, towatlas.solve_critical):
        found = function(frame)
        assert list(found.index) == list(frame.index)
        expected = function(frame.lam.to_numpy(), frame.w_f.to_numpy(), frame.n.to_numpy())
        for name in ("n", "lam", "w_f", "gamma", "x_f", "error", "status"):
            np.testing.assert_array_equal(found[name], getattr(expected, name))
        np.testing.assert_array_equal(function(frame[["lam", "w_f"]], n=2).n, 2)
    short = frame.assign(lam=1.0)
    assert set(atlas_file.states(short, outside="nan").status) == {status.NO_TRANSITION}


def test_series_for_a_whole_result(atlas_file, labels):
    lam, w_f = labels
    for function in (atlas_file.states, towatlas.solve_critical):
        found = function(lam, w_f=w_f)
        assert list(found.index) == ["a", "b", "c"]
        assert found.gamma["c"] == pytest.approx(float(function(40.0, 3.0).gamma), rel=2e-14, abs=0)


@pytest.mark.parametrize("function", [towatlas.equilibria_many, towatlas.stability_many])
def test_frames_of_many_shapes(function, labels):
    """A row a shape, under the labels of the system; one for a system that has none."""
    lam, w_f = labels
    gamma = pd.Series([2.5, 0.3, 0.5], index=["c", "a", "b"])
    frame = pd.DataFrame({"lam": lam, "w_f": w_f, "gamma": gamma, "ship": ["x", "y", "z"]})
    plain = function(frame.lam.to_numpy(), frame.w_f.to_numpy(), frame.gamma.to_numpy(), C=0.01)
    counts = plain["count"].values.tolist()
    assert len(set(counts)) > 1
    there = [(row, shape) for row, count in enumerate(counts) for shape in range(count)]
    found = function(frame, C=0.01)
    assert found.index.names == [None, "shape"]
    assert list(found.index) == [("abc"[row], shape) for row, shape in there]
    for name in ("r_f", "nodes", "kind") if "kind" in plain else ("r_f", "nodes"):
        assert found[name].tolist() == [plain[name].values[at] for at in there]
    assert found.gamma.tolist() == [gamma["abc"[row]] for row, _ in there]
    pd.testing.assert_frame_equal(function(lam, w_f, gamma, C=0.01), found)
    pd.testing.assert_frame_equal(function(frame[["w_f", "lam"]], gamma=gamma, C=0.01), found)
    broken = function(frame.assign(lam=-1.0), C=0.01)
    assert list(broken.index) == [("a", 0), ("b", 0), ("c", 0)]
    assert set(broken.status) == {status.BAD_INPUT}
    twice = pd.MultiIndex.from_tuples([("north", 1), ("north", 1)], names=["leg", "run"])
    found = function(pd.DataFrame({"lam": 3.0, "w_f": 1.0, "gamma": 0.2}, index=twice))
    assert (found.index.names, len(found)) == (["leg", "run", "shape"], 2)


def test_frames_that_lack_or_repeat_are_refused(atlas_file):
    frame = pd.DataFrame({"lam": [10.0], "w_f": [1.0]})
    with pytest.raises(ValueError, match=r"needs the columns lam, w_f and may have n; .*: it lacks w_f"):
        atlas_file.states(frame[["lam"]])
    for given, named in (((frame, 1.0), {}), ((frame,), {"w_f": 1.0})):
        with pytest.raises(ValueError, match="something is given twice"):
            atlas_file.states(*given, **named)


def test_units_of_a_series(atlas_file):
    pytest.importorskip("pint_pandas")
    lam = pd.Series([1000.0, 2000.0], dtype="pint[cm/m]")
    np.testing.assert_allclose(atlas_file.critical_speed(lam, 1.0), atlas_file.critical_speed([10.0, 20.0], 1.0))
    with pytest.raises(ValueError, match="lam must be dimensionless"):
        atlas_file.critical_speed(pd.Series([10.0], dtype="pint[m]"), 1.0)


def test_chunks_are_looked_up_lazily(atlas_file):
    array = pytest.importorskip("dask.array")
    lam = np.geomspace(5.0, 500.0, 1000)
    expected = atlas_file.critical_speed(lam, 1.0, 2)
    chunked = xr.DataArray(lam, dims="cable").chunk(cable=100)
    found = atlas_file.critical_speed(chunked, 1.0, 2)
    assert found.chunks == ((100,) * 10,)
    np.testing.assert_allclose(found.compute(), expected, rtol=2e-14)
    assert atlas_file.status(chunked, 1.0).dtype == np.int8
    bare = atlas_file.critical_speed(array.from_array(lam, chunks=300), 1.0, 2)
    assert isinstance(bare, array.Array)
    np.testing.assert_allclose(bare.compute(), expected, rtol=2e-14)
    # Nothing is looked up before it is asked for.
    late = atlas_file.critical_speed(-chunked, 1.0)
    with pytest.raises(ValueError, match=r"lam = .* is not finite and positive"):
        late.compute()


def test_answers_say_what_they_hold(atlas_file):
    """In a few lines, however many there are."""
    states = atlas_file.states(np.full((300, 2), 10.0), 1.0)
    lines = repr(states).splitlines()
    assert lines[0] == "CriticalStates, shape (300, 2)"
    assert len(lines) == 11
    assert max(len(line) for line in lines) < 120
    assert "gamma    0.466173 0.466173 0.466173 ... " in repr(states)
    found = towatlas.equilibria(37.8, 1352, gamma=5.94)
    assert repr(found).splitlines()[0] == "Equilibria, 5 shapes"
    assert "system          lam = 37.8, w_f = 1352\n" in repr(found)
    assert repr(atlas_file.critical) == "critical speeds: n 1 .. 6, w_f 0 .. 10000, lam - lambda_c 0.001 .. 1000"
    assert repr(pickle.loads(pickle.dumps(found))) == repr(found)
    branches = repr(towatlas.diagram(10.0, 1.0, gamma=(0.2, 0.4))).splitlines()
    assert branches == [
        "Diagram over gamma 0.2 to 0.4, 1 branches, lam = 10, w_f = 1",
        "  Branch 'outward': 0.2 (range) stable 0.4 (range)",
    ]
    lines = repr(towatlas.design(towatlas.read_scene("skop-fig3"), depth=0.6, model="vacuum")).splitlines()
    assert lines[0].startswith("Design for 'NRL Report 7048, Fig. 3': depth 0.6 m, vacuum model, ")
    assert any("m: 1 nodes, radius 0.000" in line for line in lines[1:])


def test_answers_as_datasets_and_frames(atlas_file, tmp_path):
    states = atlas_file.states([[10.0], [20.0]], [1.0, 2.0, 3.0])
    data, frame = states.to_dataset(), states.to_dataframe()
    assert data.gamma.dims == ("point_0", "point_1")
    assert data.gamma.attrs["long_name"].startswith("critical speed")
    assert list(data.status.attrs["flag_values"]) == list(range(len(data.status.attrs["flag_meanings"].split())))
    assert frame.loc[(1, 2), "gamma"] == states.gamma[1, 2] == data.gamma[1, 2]
    assert atlas_file.states(10.0, 1.0).to_dataset().gamma.dims == ()
    assert len(atlas_file.states(10.0, 1.0).to_dataframe()) == 1
    found = towatlas.stability(37.8, 1352, gamma=5.94)
    data = found.to_dataset()
    assert data.attrs["w_f"] == 1352.0
    np.testing.assert_array_equal(data.error, found.error)
    np.testing.assert_array_equal(data.equilibria_error, found.equilibria.error)
    assert list(found.to_dataframe().kind) == list(found.kind)
    data.to_netcdf(tmp_path / "found.nc")
    for name in ("branch", "kind", "near_axis", "growth"):
        np.testing.assert_array_equal(xr.open_dataset(tmp_path / "found.nc")[name], data[name])
