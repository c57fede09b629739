"""What is installed: names, parts, version; and that it lives beside other people's packages atlas and kernels."""

import ast
import importlib.metadata
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from fnmatch import fnmatchcase
from pathlib import Path

import pytest

import towatlas

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
SETUPTOOLS = PROJECT["tool"]["setuptools"]
# Names of folders here, and of other people's packages.
BARE = {"atlas", "kernels"}
# What packing adds to the files of the repository: the atlas, and what setuptools writes.
SHIPPED = "atlas/tables/atlas.nc"
GENERATED = re.compile(r"PKG-INFO|setup\.cfg|towatlas\.egg-info/")

# A small build, lookups in it and in the atlas of the wheel, a shipped scene: with the dependencies that pyproject
# declares, and nothing else.
VISIT = """
from pathlib import Path
import atlas, kernels, netCDF4, numpy as np, towatlas, towatlas.kernels
from towatlas.builders.critical import build_atlas
from towatlas.builders.grids import Grid, ScanSettings

for package, file in ((atlas, "atlas"), (kernels, "kernels"), (towatlas.kernels, "towatlas/kernels")):
    assert package.__file__.endswith(f"site-packages/{file}/__init__.py"), package
assert atlas.NAME == "not towatlas"
assert hasattr(kernels, "get_kernel") and not hasattr(towatlas.kernels, "get_kernel")
try:
    import towatlas.equilibria
except ModuleNotFoundError:
    pass
else:
    raise AssertionError("towatlas.equilibria is a module")

grid = Grid(n_max=1, series_w_f=6, series_excess=8, error_blocks=1, w_f=np.array([0.0, 1.0]), lam=np.array([3.0, 9.0]))
scan = ScanSettings(speeds=40, guesses=64, w_f=np.array([1.0]), lam=np.array([5.0]), n_max=1)
build_atlas(Path("small.nc"), grid=grid, scan=scan, progress=False)
assert abs(towatlas.open_atlas().critical_speed(37.8, 1352, n=2) / 3.417567056914 - 1.0) < 1e-10
assert 0.4 < towatlas.open_atlas("small.nc").critical_speed(9.0, 1.0) < 0.6
with netCDF4.Dataset("small.nc") as file:
    difference = file["gamma_c"][0, 1, 1] / towatlas.solve_critical(9.0, 1.0).gamma - 1.0
assert abs(difference) < 1e-12, difference
print("visited", towatlas.read_scene("skop-fig3").title)
"""


def run(command, **options):
    """Run a command; its output, or the failure with all it said."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def tracked(*patterns):
    """Files of the repository, new ones included, or of the unpacked sources, as paths relative to the root."""
    if (ROOT / ".git").exists():
        listed = run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *patterns], cwd=ROOT)
        names = listed.splitlines()
    else:
        listed = (ROOT / "towatlas.egg-info" / "SOURCES.txt").read_text()
        names = [name for name in listed.splitlines() if any(fnmatchcase(name, one) for one in patterns or ["*"])]
        names = [name for name in names if name != SHIPPED and not GENERATED.match(name)]
    return [Path(name) for name in names if (ROOT / name).exists()]


def copy_tree(target):
    """Copy the repository without what is built or ignored."""
    for path in tracked():
        (target / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / path, target / path)
    return target


@pytest.fixture(scope="module")
def registry(tmp_path_factory):
    """Skips where the package registry cannot be reached."""
    folder = tmp_path_factory.mktemp("probe")
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", folder, "kernels"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"no package registry: {done.stderr.strip().splitlines()[-1]}")


@pytest.fixture(scope="module")
def sdist(registry, tmp_path_factory, atlas_path):
    """The sources with an atlas, as `make dist` packs them, from a copy: an old build folder adds nothing."""
    source, out, tools = (tmp_path_factory.mktemp(name) for name in ("source", "sdist", "tools"))
    copy_tree(source)
    shutil.copy(atlas_path, source / SHIPPED)
    run([sys.executable, "-m", "pip", "install", "--quiet", "--target", tools, "setuptools>=69"])
    code = f"from setuptools.build_meta import build_sdist; build_sdist({str(out)!r})"
    run([sys.executable, "-c", code], cwd=source, env=os.environ | {"PYTHONPATH": str(tools)})
    (path,) = out.iterdir()
    return path


@pytest.fixture(scope="module")
def wheel(sdist, tmp_path_factory):
    """The wheel, built from the sources as they are packed."""
    out = tmp_path_factory.mktemp("wheel")
    run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", out, sdist])
    (path,) = out.iterdir()
    return path


def folder_of(package):
    """The folder that holds a package, by the mapping of pyproject."""
    mapping = SETUPTOOLS["package-dir"]
    prefix = max((name for name in mapping if f"{package}.".startswith(f"{name}.")), key=len)
    return Path(mapping[prefix], *package[len(prefix) :].strip(".").split("."))


def test_every_package_is_listed():
    listed = {folder_of(package) for package in SETUPTOOLS["packages"]}
    there = {path.parent for path in tracked("atlas/**__init__.py", "kernels/**__init__.py")}
    assert listed == there


@pytest.mark.network
def test_the_sources_hold_the_repository(sdist):
    """Tests, their data, documentation and all: whoever unpacks them can test and build."""
    with tarfile.open(sdist) as archive:
        inside = {member.name.partition("/")[2] for member in archive.getmembers() if member.isfile()}
    assert {name for name in inside if not GENERATED.match(name)} == {*map(str, tracked()), SHIPPED}


@pytest.mark.network
def test_the_description_links_nowhere_but_to_sites(wheel):
    """A package index shows it: a link to a file of the repository would lead to a page of the index."""
    archive = zipfile.ZipFile(wheel)
    (name,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
    fields, _, description = archive.read(name).decode().partition("\n\n")
    assert "Description-Content-Type: text/markdown" in fields
    assert "At what speed will a cable towed in a circle jump" in description
    targets = re.findall(r"\]\(([^)]*)\)", description)
    assert not [target for target in targets if not target.startswith("https://")]
    assert "`docs/scenes.md`" in description


@pytest.mark.network
def test_the_wheel_holds_what_the_repository_does(wheel):
    """Every module, the scenes, the types of cable, the tables of sources, the parts of the page, and the atlas."""
    kinds = ("*.py", "*.toml", "*.csv", "*.npz", "scenes/*.toml", "*.html", "*.css", "*.js", "*.txt", "*.zip")
    inside = set(zipfile.ZipFile(wheel).namelist())
    expected = {SHIPPED.replace("atlas", "towatlas", 1)}
    for package in SETUPTOOLS["packages"]:
        folder = ROOT / folder_of(package)
        files = [path for kind in kinds for path in folder.glob(kind)]
        expected |= {"/".join([*package.split("."), *path.relative_to(folder).parts]) for path in files}
    assert {".toml", ".csv"} < {Path(name).suffix for name in expected}
    assert expected == {name for name in inside if ".dist-info/" not in name}


@pytest.mark.network
def test_lives_beside_packages_named_atlas_and_kernels(wheel, tmp_path):
    """In an environment of its own, from another folder."""
    other = tmp_path / "other"
    (other / "atlas").mkdir(parents=True)
    (other / "atlas" / "__init__.py").write_text('NAME = "not towatlas"\n')
    (other / "pyproject.toml").write_text('[project]\nname = "atlas"\nversion = "1"\n')
    run([sys.executable, "-m", "venv", tmp_path / "venv"])
    python = tmp_path / "venv" / "bin" / "python"
    run([python, "-m", "pip", "install", "--quiet", wheel, "kernels", other])
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    kept = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "TOWATLAS_FILE")}
    environment = kept | {"XDG_DATA_HOME": str(elsewhere)}
    assert run([python, "-c", VISIT], cwd=elsewhere, env=environment).startswith("visited")


def test_no_public_name_is_a_module_too():
    """`towatlas.shape` is the function whether or not something has imported a module of that name."""
    modules = {module.name for module in pkgutil.iter_modules(towatlas.__path__)}
    modules |= {package.split(".")[1] for package in SETUPTOOLS["packages"] if "." in package}
    assert not modules & set(towatlas.__all__)


def test_nothing_imports_the_bare_names():
    """`import kernels` would find this repository's folder from its root, and other people's package elsewhere."""
    found = []
    for path in tracked("*.py"):
        for node in ast.walk(ast.parse((ROOT / path).read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            found += [f"{path}:{node.lineno}" for name in names if name.split(".")[0] in BARE]
    assert not found


def test_one_version():
    assert "version" in PROJECT["project"]["dynamic"]
    assert importlib.metadata.version("towatlas") == towatlas.__version__
    assert run([sys.executable, "-m", "towatlas", "--version"]).split() == ["towatlas", towatlas.__version__]


def test_citation_and_changelog_know_the_version():
    assert re.search(rf"^version: {re.escape(towatlas.__version__)}$", (ROOT / "CITATION.cff").read_text(), re.M)
    assert f"\n## {towatlas.__version__}\n" in (ROOT / "CHANGELOG.md").read_text()


def test_promised_pythons_are_the_classifiers():
    """requires-python, the check of make and the classifiers speak of the same Pythons."""
    listed = re.findall(r"Python :: 3\.(\d+)", "\n".join(PROJECT["project"]["classifiers"]))
    first, last = int(listed[0]), int(listed[-1])
    assert [int(minor) for minor in listed] == list(range(first, last + 1))
    assert PROJECT["project"]["requires-python"] == f">=3.{first},<3.{last + 1}"
    assert f"(3, {first}) <= v < (3, {last + 1})" in (ROOT / "Makefile").read_text()
    assert PROJECT["tool"]["mypy"]["python_version"] == f"3.{first}"
    assert PROJECT["tool"]["ruff"]["target-version"] == f"py3{first}"


def test_only_pythons_that_are_what_their_name_says_are_found(tmp_path):
    """On a machine with none, with one, and with one under another's name: what is missing is named."""
    mine, other = f"3.{sys.version_info[1]}", "3.12" if sys.version_info[1] != 12 else "3.11"

    def look(asked):
        environment = {"PATH": str(tmp_path), "HOME": str(tmp_path), "TOWATLAS_PYTHONS": asked}
        done = subprocess.run([sys.executable, ROOT / ".ci" / "pythons.py"], env=environment, capture_output=True)
        return done.returncode, done.stdout.decode(), done.stderr.decode()

    assert look("")[:2] == (1, "")
    for version in (mine, other):
        (tmp_path / f"python{version}").symlink_to(sys.executable)
    assert look(mine) == (0, f"{mine} {tmp_path}/python{mine}\n", "")
    code, out, complaint = look(f"{mine} {other}")
    assert (code, out) == (1, "")
    assert complaint.startswith(f"pyproject promises Python {other}, not found on this machine")


PLANT = '''

@helper
def planted(count):
    """A name that a loop of no rounds leaves without a value."""
    for k in range(count):
        last = k
    return last
'''


@pytest.mark.slow
def test_check_reports_a_name_set_only_in_a_loop(tmp_path):
    """numba for Python 3.12 and later refuses such a kernel, numba for 3.11 computes with whatever was there."""
    if not Path(sys.prefix, "bin", "mypy").exists():
        pytest.skip("mypy is not installed: pip install towatlas[check]")
    tree = copy_tree(tmp_path)
    victim = next(path for path in sorted(tree.glob("kernels/*.py")) if "import helper" in path.read_text())
    victim.write_text(victim.read_text() + PLANT)
    line = victim.read_text().splitlines().index("    return last") + 1
    command = ["make", "-C", tree, f"VENV={sys.prefix}", "-o", f"{sys.prefix}/installed", "types"]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    assert done.returncode != 0
    assert re.search(rf"{victim.name}:{line}: error: .*\[possibly-undefined\]\nFound 1 error", done.stdout), done.stdout
