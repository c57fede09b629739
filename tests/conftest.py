"""The default atlas, built once for all tests that read one."""

import os
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))
matplotlib.use("Agg")
# No deadline: the first example of a test compiles kernels. The same examples every time where CI is set.
settings.register_profile("towatlas", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("towatlas")


@pytest.fixture(scope="session")
def atlas_path(tmp_path_factory):
    from towatlas.builders.critical import build_atlas

    path = tmp_path_factory.mktemp("atlas") / "atlas.nc"
    build_atlas(path, progress=False)
    return path


@pytest.fixture(scope="session")
def atlas_file(atlas_path):
    from towatlas import open_atlas

    return open_atlas(atlas_path)


@pytest.fixture(scope="session")
def equilibria_grid():
    """The default spacing on a part of its range, which holds cables of up to four folds."""
    from towatlas.builders.grids import EquilibriaGrid

    return EquilibriaGrid(
        w_f=np.concatenate([[0.0], 10.0 ** np.linspace(-2, 2, 17)]),
        lam=10.0 ** np.linspace(0, 1, 25),
        gamma=10.0 ** np.linspace(-1, 0.5, 51),
    )


@pytest.fixture(scope="session")
def equilibria_path(tmp_path_factory, equilibria_grid):
    from towatlas.builders.fish import build_equilibria

    path = tmp_path_factory.mktemp("equilibria") / "equilibria.nc"
    build_equilibria(path, grid=equilibria_grid, progress=False)
    return path
