"""Growth rates of many shapes: as those of each by itself, whatever neighbours they have."""

import os
import subprocess
import sys

import numpy as np
import pytest

import towatlas
from towatlas.kernels import status
from towatlas.solve.motion import Motions, motions
from towatlas.solve.winding import count_zeros

CURVES = [
    ({"lam": 37.8, "w_f": 1352.0, "C": 0.018}, np.geomspace(4.4, 4.8, 12)),
    ({"lam": 20.0, "w_f": 10.0}, np.geomspace(1.5, 2.5, 24)),
    ({"lam": 3.0, "w_f": 0.2, "C": 5.0, "w": 0.55, "m_f": 0.3}, np.geomspace(0.2, 0.4, 8)),
    # A bare end in drag is not counted, and strangers next to each other are no neighbours.
    ({"lam": [3.0, 30.0, 2.0], "w_f": [0.0, 5.0, 1.0], "C": [1.0, 0.0, 0.5]}, np.array([0.8, 0.7, 2.0])),
]


@pytest.mark.parametrize(("cable", "gamma"), CURVES)
def test_as_one_by_one(cable, gamma):
    found = towatlas.stability_many(gamma=gamma, **cable)
    for i in range(0, len(gamma), 3 if len(gamma) > 3 else 1):
        row = found.isel(system=i)
        alone = towatlas.stability(gamma=gamma[i], **{k: v[i] if isinstance(v, list) else v for k, v in cable.items()})
        assert int(row["count"]) == len(alone)
        for k, r_f in enumerate(alone.equilibria.r_f):
            j = int(np.nanargmin(np.abs(row.r_f.values / r_f - 1.0)))
            assert row.kind.values[j] == alone.kind[k]
            for mine, theirs in (("unstable", "unstable"), ("index", "index"), ("growth_status", "status")):
                assert row[mine].values[j] == getattr(alone, theirs)[k], (mine, i, k)
            apart = abs(row.growth.values[j] - alone.growth[k] + 1j * (row.frequency.values[j] - alone.frequency[k]))
            # The least that is asked of eigenvalues; no more than errors say, either.
            assert apart < 1e-10 * gamma[i]
            assert apart <= row.growth_error.values[j] + alone.error[k]


def test_what_fails_does_not_spoil_the_others():
    found = towatlas.stability_many([37.8, -1.0, 37.8], 1352.0, [2.97, 1.0, 5.94], C=0.018)
    assert found["count"].values.tolist() == [3, 0, 3]
    assert found.kind.values.tolist() == [
        ["divergence", "stable", "stable"],
        ["", "", ""],
        ["divergence", "flutter", "stable"],
    ]
    assert np.isnan(found.growth.values[1]).all()
    assert (found.growth_status.values[[0, 2]] == status.OK).all()
    with pytest.raises(ValueError, match="broadcast"):
        towatlas.stability_many([1.0, 2.0], [1.0, 2.0, 3.0], 1.0)


def test_results_do_not_depend_on_the_blocks():
    """Systems over two axes, the last one of neighbours."""
    gamma = np.linspace(5.0, 5.2, 5)
    flat = towatlas.stability_many(37.8, 1352.0, gamma)
    square = towatlas.stability_many(37.8, 1352.0, np.stack([gamma, gamma]))
    assert square.growth.dims == ("system_0", "system_1", "shape")
    for row in range(2):
        np.testing.assert_allclose(square.growth.values[row], flat.growth.values, atol=1e-10)
        assert square.kind.values[row].tolist() == flat.kind.values.tolist()


def test_a_missing_zero_is_counted():
    """The argument principle finds the zeros that nobody knows of, in drag and without."""
    for fluid in ({"C": 0.018}, {}):
        alone = towatlas.stability(37.8, 1352.0, 5.94, **fluid)
        found, system = alone.equilibria, alone.equilibria.system
        k = list(alone.kind).index("flutter")
        body = motions(found.r_f[k : k + 1], np.array([5.94]), system.row()[None], 1.02 if not fluid else 3.0)[0]
        line = np.zeros(1) if fluid else None
        known, none = alone.eigenvalues[k] / 5.94, np.empty(0, complex)
        counts = [int(count_zeros(Motions([body]), [zeros], line)[0]) for zeros in (known, none)]
        assert counts[0] == counts[1]
        assert counts[0] >= (2 if fluid else 4)


def test_shapes_damped_faster_than_the_reach():
    """Each by itself, where no line within the reach has the leading zero on its right."""
    gamma = np.linspace(0.2, 2.0, 100)[8:16]
    found = towatlas.stability_many(5.0, 1.0, gamma, C=1000.0, w=0.5, m_f=1.5)
    assert (found.kind.values == "stable").all()
    assert (found.growth_status.values == status.OK).all()
    alone = towatlas.stability(5.0, 1.0, gamma[0], C=1000.0, w=0.5, m_f=1.5)
    assert alone.kind.tolist() == ["stable"]


BLAS = """
from concurrent.futures import ThreadPoolExecutor
from towatlas.solve.galerkin import _blas, _one_blas_thread

def threads():
    return {library["num_threads"] for library in _blas().select(user_api="blas").info()}

def one(_):
    with _one_blas_thread():
        within = threads()
        with _one_blas_thread():
            return within | threads()

before = threads()
with ThreadPoolExecutor(2) as pool:
    # Both threads live on between their turns.
    seen = set().union(*pool.map(one, range(200)))
print(seen, threads() == before)
"""


def test_blas_is_limited_for_every_thread():
    """threadpoolctl lets the first thread alone set limits, as long as it lives: the last bits of others changed."""
    done = subprocess.run(
        [sys.executable, "-c", BLAS], env=os.environ | {"OPENBLAS_NUM_THREADS": "2"}, capture_output=True, text=True
    )
    assert done.stdout.split() == ["{1}", "True"], done.stderr
