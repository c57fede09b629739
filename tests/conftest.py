"""The default atlas, built once for all tests that read one."""

import os
import sys
from pathlib import Path

import matplotlib
import pytest
from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent))
matplotlib.use("Agg")
# No deadline: the first example of a test compiles kernels. The same examples every time where CI is set.
settings.register_profile("towatlas", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("towatlas")


@pytest.fixture(scope="session")
def atlas_path(tmp_path_factory):
    from atlas.build import build_atlas

    path = tmp_path_factory.mktemp("atlas") / "atlas.nc"
    build_atlas(path, progress=False)
    return path


@pytest.fixture(scope="session")
def atlas_file(atlas_path):
    from atlas import open_atlas

    return open_atlas(atlas_path)
