"""Answers from the atlas: accuracy against the direct solver, what is outside, types, what gets imported."""

import subprocess
import sys

import numpy as np
import pytest
import xarray as xr
from helpers import random_cables
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.polynomial.chebyshev import chebval2d

import towatlas
from towatlas.kernels import folds as extract
from towatlas.kernels import status
from towatlas.limits import threshold_length
from towatlas.numerics.cells import BLOCK, Cells, Places, Work
from towatlas.tables import critical as lookup

QUANTITIES = ("gamma", "R_x0", "x_f", "z_f", "tension")
METHODS = ("critical_speed", "reaction", "fish_offset", "fish_depth", "tow_tension", "error", "status")
FIXTURE = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


def test_lookup_is_the_direct_solution_everywhere(atlas_file):
    n, w_f, lam = random_cables(30000, 5)
    found, exact = atlas_file.states(lam, w_f, n), towatlas.solve_critical(lam, w_f, n)
    for name in QUANTITIES:
        miss = np.abs(getattr(found, name) / getattr(exact, name) - 1)
        assert miss.max() < 1e-9, name
    miss = np.abs(found.gamma / exact.gamma - 1)
    assert (miss <= found.error + exact.error).all()
    assert np.median(found.error) < 1e-10


def test_cells_are_the_series_of_the_atlas(atlas_file):
    """What lookup sums against the whole series of the file, by numpy's sum; where the states bend most, too."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-1, 1, (2, 6000))
    y[:1000] = -1 + 10.0 ** rng.uniform(-8, 0, 1000)
    x[1000:2000], y[1000:2000] = rng.uniform(-0.5, 0.0, 1000), rng.uniform(-0.3, 0.1, 1000)
    x[2000:2004], y[2000:2004] = [-1, -1, 1, 1], [-1, 1, -1, 1]
    for name in lookup.FIELDS:
        for n in (1, 2, 6):
            series = atlas_file.critical.series(name, n)
            table, work = Cells(series), Work(len(x))
            parts = [slice(begin, begin + BLOCK) for begin in range(0, len(x), BLOCK)]
            found = np.concatenate([table.sums(0, Places(x[part], y[part]), work) for part in parts])
            # Of fields to 10, whose sum rounds at 1e-14; a hundredth of the errors that the file states.
            assert np.abs(found - chebval2d(y, x, series)).max() < 2e-13, (name, n)


def as_array(atlas, lam, w_f, n, outside="raise"):
    """The state of one cable by the way of arrays."""
    return atlas.states([lam], [w_f], [n], outside=outside)


def test_one_cable_is_answered_as_many_are(atlas_file):
    """The scalar path: the same errors and status to the bit, the same values to the rounding of a sum of 45 terms."""
    n, w_f, lam = random_cables(3000, 11)
    many = atlas_file.states(lam, w_f, n)
    for k in range(len(n)):
        one = atlas_file.states(float(lam[k]), float(w_f[k]), int(n[k]))
        assert one.error == many.error[k]
        assert one.status == many.status[k] == status.OK
        for name in QUANTITIES:
            assert getattr(one, name) == pytest.approx(getattr(many, name)[k], rel=2e-14, abs=0), (k, name)
    for method, name in zip(METHODS, (*QUANTITIES, "error", "status"), strict=True):
        value = getattr(atlas_file, method)(float(lam[0]), float(w_f[0]), int(n[0]))
        assert value == pytest.approx(getattr(many, name)[0], rel=2e-14, abs=0)
        assert value.dtype == getattr(many, name).dtype


def test_one_cable_at_the_edges_is_answered_as_many_are(atlas_file):
    """At and an ulp or a few beside each end of the domain, and next to the threshold: the same points are held."""
    codes = set()
    for n in (1, 3, 6):
        for w_f in (0.0, -0.0, 5e-324, 1e-12, 1.0, 1e4, np.nextafter(1e4, np.inf), -1.0):
            threshold = float(threshold_length(abs(w_f), n))
            for excess in (0.0, 1e-16, 1e-3, 1.0, 1e3):
                for ulps in range(-9, 10, 3):
                    lam = threshold + excess
                    lam += ulps * np.spacing(lam)
                    one, many = atlas_file.states(lam, w_f, n, "nan"), as_array(atlas_file, lam, w_f, n, "nan")
                    assert one.status == many.status[0], (lam, w_f, n)
                    assert one.gamma == pytest.approx(many.gamma[0], rel=2e-14, nan_ok=True)
                    np.testing.assert_equal(float(one.error), float(many.error[0]))
                    codes.add(int(one.status))
    assert codes == {status.OK, status.OUTSIDE, status.NO_TRANSITION, status.BAD_INPUT}


@pytest.mark.parametrize(
    ("lam", "w_f", "n"),
    [
        (np.nan, 1.0, 1),
        (10.0, np.nan, 1),
        (np.inf, 1.0, 1),
        (10.0, np.inf, 1),
        (10.0, 1.0, np.nan),
        (10.0, 1.0, 0),
        (10.0, 1.0, 1.5),
        (100.0, 1.0, 7),
        (10.0, 1.0, 2**31),
        (10.0, 1.0, 2**70),
        (2**64, 1.0, 1),
        pytest.param(10**400, 1.0, 1, id="huge"),
        (True, 1.0, 1),
        (10.0, "1", 1),
        (10.0, 1.0, None),
        (5000.0, 1.0, 1),
        (-3.0, 1.0, 1),
    ],
)
def test_one_cable_is_refused_as_many_are(atlas_file, lam, w_f, n):
    with pytest.raises(ValueError, match=r"lam|w_f|n counts|n must|n =") as one:
        atlas_file.critical_speed(lam, w_f, n)
    with pytest.raises(ValueError, match=r"lam|w_f|n counts|n must|n =") as many:
        atlas_file.critical_speed([lam], w_f, n)
    # But for the brackets of an array where a value is quoted.
    assert str(one.value).split("got")[0] == str(many.value).split("got")[0]


def test_numbers_of_any_kind_are_one_cable(atlas_file):
    expected = as_array(atlas_file, 10.0, 2.0, 2)
    for kind in (float, int, np.float64, np.int64, np.int8, np.uint64, np.float32, np.longdouble, np.array):
        found = atlas_file.states(kind(10), kind(2), kind(2))
        assert found.gamma.shape == ()
        for name in ("n", "lam", "w_f", "status", *QUANTITIES):
            value = getattr(found, name)
            assert value.dtype == getattr(expected, name).dtype
            assert value == pytest.approx(getattr(expected, name)[0], rel=2e-14)
    masked = np.ma.masked_array(10.0, mask=True)
    assert np.isnan(atlas_file.critical_speed(masked, 1.0, outside="nan"))


def test_edges_and_corners_of_the_domain(atlas_file):
    for n in (1, 6):
        for w_f in (0.0, 1e-300, 1e-12, 1e4):
            lam = threshold_length(w_f, n) + np.array([1e-3, 1e3])
            found = atlas_file.states(lam, w_f, n)
            exact = towatlas.solve_critical(lam, w_f, n)
            assert set(found.status) == {status.OK}
            assert found.gamma == pytest.approx(exact.gamma, rel=1e-9)


def test_error_constants_agree():
    assert lookup.ROUNDINGS == extract.ROUNDINGS


def test_no_transition_is_an_answer(atlas_file):
    states = atlas_file.states([1.9, 2.0, 3.0], 0.0, 1)
    assert list(states.status) == [status.NO_TRANSITION, status.NO_TRANSITION, status.OK]
    assert np.isnan(states.gamma[:2]).all()
    assert states.sentence(0).startswith("no such transition")
    assert np.isnan(atlas_file.critical_speed(1.5, 0.0))


@pytest.mark.parametrize(
    ("lam", "w_f", "n", "match"),
    [
        (2.0005, 0.0, 1, r"lam = 2\.0005.* n = 1, w_f = 0 it holds lam from 2\.001 to 1002"),
        (1500.0, 0.0, 1, "lam = 1500 is outside"),
        (10.0, 2e4, 1, "w_f = 20000 is outside the atlas, 0 to 10000"),
        (100.0, 0.0, 7, "n = 7 is outside the atlas, 1 to 6"),
        (np.nan, 0.0, 1, "lam = nan is not finite and positive"),
        (10.0, np.nan, 1, "w_f = nan is not finite, or negative"),
        (np.inf, 0.0, 1, "lam = inf is not finite and positive"),
        (10.0, np.inf, 1, "w_f = inf is not finite, or negative"),
        (0.0, 0.0, 1, "lam = 0 is not finite and positive"),
        (-3.0, 0.0, 1, "lam = -3 is not finite and positive"),
        (10.0, -1.0, 1, "w_f = -1 is not finite, or negative"),
        (10.0, 0.0, 0, "n counts the transitions"),
        (10.0, 0.0, 1.5, "n counts the transitions"),
        (None, 0.0, 1, "lam must be a real number"),
        ("10", 0.0, 1, "lam must be a real number"),
        (10.0, 1j, 1, "w_f must be a real number"),
        ([10.0, 11.0], [1.0, 2.0, 3.0], 1, "do not broadcast"),
    ],
)
def test_bad_input_raises(atlas_file, lam, w_f, n, match):
    with pytest.raises(ValueError, match=match):
        atlas_file.critical_speed(lam, w_f, n)


def test_unknown_choice_for_outside(atlas_file):
    with pytest.raises(ValueError, match="outside must be one of raise, nan, solve"):
        atlas_file.critical_speed(10.0, 0.0, 1, outside="extrapolate")


def test_one_bad_point_spoils_no_other(atlas_file):
    n, w_f, lam = random_cables(20000, 9)
    good = atlas_file.critical_speed(lam, w_f, n)
    for bad, code in ((np.nan, status.BAD_INPUT), (-1.0, status.BAD_INPUT), (1e9, status.OUTSIDE)):
        spoiled = lam.copy()
        spoiled[777] = bad
        for choice in ("nan", "solve"):
            states = atlas_file.states(spoiled, w_f, n, outside=choice)
            # To rounding: a matrix product may add up in another order.
            assert np.delete(states.gamma, 777) == pytest.approx(np.delete(good, 777), rel=1e-14)
            if choice == "nan":
                assert np.isnan(states.gamma[777])
                assert states.status[777] == code
        with pytest.raises(ValueError, match="1 of 20000 points are outside"):
            atlas_file.critical_speed(spoiled, w_f, n)


def test_outside_solve_is_the_direct_solver(atlas_file):
    lam, w_f, n = np.array([2.0000001, 5000.0, 10.0, 50.0]), np.array([0.0, 3.0, 5e5, 0.0]), np.array([1, 2, 1, 9])
    found, exact = atlas_file.states(lam, w_f, n, outside="solve"), towatlas.solve_critical(lam, w_f, n)
    for name in (*QUANTITIES, "error", "status"):
        np.testing.assert_array_equal(getattr(found, name), getattr(exact, name))


def test_types_and_shapes(atlas_file):
    value = atlas_file.critical_speed(10.0, 1.0, 1)
    assert isinstance(value, float)
    assert atlas_file.critical_speed(np.int64(10), 1, np.int8(1)) == value
    assert atlas_file.critical_speed(np.float32(10), np.float32(1)) == value
    assert atlas_file.critical_speed(10, 1, 1.0) == value
    grid = atlas_file.critical_speed(np.array([5.0, 10.0])[:, None], [0, 1, 2], 1)
    assert grid.shape == (2, 3)
    assert grid[1, 1] == pytest.approx(value, rel=1e-15)
    assert atlas_file.critical_speed([], 1.0).shape == (0,)
    for name in METHODS:
        assert np.shape(getattr(atlas_file, name)([10.0, 20.0], 1.0)) == (2,)


def test_xarray_in_and_out(atlas_file):
    lam = xr.DataArray([5.0, 10.0], dims="cable", coords={"cable": ["short", "long"]})
    w_f = xr.DataArray([0.0, 1.0, 2.0], dims="fish")
    gamma = atlas_file.critical_speed(lam, w_f, 2)
    assert gamma.dims == ("cable", "fish")
    assert gamma.attrs["units"] == "1"
    assert gamma.name == "gamma"
    assert float(gamma.sel(cable="long")[1]) == pytest.approx(atlas_file.critical_speed(10.0, 1.0, 2), rel=1e-14)


def test_labelled_arrays_are_aligned_or_refused(atlas_file):
    lam = xr.DataArray([5.0, 10.0], dims="cable")
    for function in (atlas_file.states, towatlas.solve_critical):
        with pytest.raises(ValueError, match=r"lam is a labelled DataArray; .* pass lam\.values"):
            function(lam, 1.0, 1)
    for labelled in (xr.Dataset({"lam": lam}), lam.variable):
        with pytest.raises(ValueError, match="must be xarray DataArrays"):
            atlas_file.critical_speed(labelled, 1.0)


def test_masked_values_are_not_looked_up(atlas_file):
    masked = np.ma.masked_array([10.0, 20.0], mask=[False, True])
    with pytest.raises(ValueError, match="lam = nan"):
        atlas_file.critical_speed(masked, 1.0)
    assert np.isnan(atlas_file.critical_speed(masked, 1.0, outside="nan")[1])


def test_threads_may_share_an_atlas(atlas_path):
    """Eight threads open the file and look up at once, in a process of their own: the NetCDF library would crash."""
    code = (
        "import towatlas\n"
        "from concurrent.futures import ThreadPoolExecutor\n"
        f"ask = lambda lam: float(towatlas.open_atlas({str(atlas_path)!r}).critical_speed(lam, 1.0))\n"
        f"table = towatlas.open_atlas({str(atlas_path)!r})\n"
        "with ThreadPoolExecutor(8) as pool:\n"
        "    a = list(pool.map(lambda lam: float(table.critical_speed(lam, 1.0)), range(5, 50)))\n"
        "    b = list(pool.map(ask, range(5, 50)))\n"
        "assert a == b\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_atlas_can_be_pickled(atlas_file):
    import pickle

    copy = pickle.loads(pickle.dumps(atlas_file))
    assert copy.critical_speed(10.0, 1.0) == atlas_file.critical_speed(10.0, 1.0)


@FIXTURE
@given(lam=st.floats(allow_nan=True), w_f=st.floats(allow_nan=True), n=st.integers(1, 8))
def test_any_float_gets_a_value_or_a_reason(atlas_file, lam, w_f, n):
    states = atlas_file.states(lam, w_f, n, outside="nan")
    if states.status == status.OK:
        exact = towatlas.solve_critical(lam, w_f, n)
        assert states.gamma == pytest.approx(float(exact.gamma), rel=1e-9)
    else:
        assert np.isnan(states.gamma)
        if states.status != status.NO_TRANSITION:
            with pytest.raises(ValueError, match=r"outside|not finite"):
                atlas_file.critical_speed(lam, w_f, n)


def test_lookup_imports_nothing_heavy(atlas_path):
    code = (
        "import sys, towatlas\n"
        f"print(towatlas.open_atlas({str(atlas_path)!r}).critical_speed([5.0, 10.0], 0.0, 1))\n"
        "print([m for m in ('numba', 'xarray', 'matplotlib', 'scipy', 'pandas', 'tqdm') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_shell_begins_with_nothing_heavy():
    code = (
        "import sys, towatlas.cli\n"
        "print([m for m in ('numba', 'xarray', 'matplotlib', 'scipy', 'pandas', 'pint') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_nothing_within_rounding_of_the_threshold(atlas_file):
    """A few ulp beyond lambda_cn the excess length is all rounding: outside the atlas, however the ends are rounded."""
    rng = np.random.default_rng(8)
    n, w_f = rng.integers(1, 7, 300), 10.0 ** rng.uniform(-3, 3, 300)
    lam = towatlas.threshold_length(w_f, n)
    for _ in range(12):
        lam = np.nextafter(lam, np.inf)
        states = atlas_file.states(lam, w_f, n, outside="nan")
        assert set(states.status) <= {status.OUTSIDE, status.NO_TRANSITION}
        assert np.isnan(states.gamma).all()
    with pytest.raises(ValueError, match="outside the atlas"):
        atlas_file.critical_speed(lam, w_f, n)
    assert (atlas_file.states(lam, w_f, n, outside="solve").status == status.LOST_IN_ROUNDING).all()
