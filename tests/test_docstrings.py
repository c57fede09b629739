"""Docstrings: those of public names are whole, and every example in any of them runs."""

import dataclasses
import doctest
import importlib
import inspect
import pkgutil
import typing

import pytest
from numpydoc.docscrape import ClassDoc, FunctionDoc

import towatlas
import towatlas.kernels

PUBLIC = {name: getattr(towatlas, name) for name in towatlas.__all__}
FUNCTIONS = [name for name, value in PUBLIC.items() if inspect.isfunction(value)]


def _types_in(annotation):
    """Every type that an annotation names: those of a union, of a list, of a tuple."""
    return [annotation, *(inner for part in typing.get_args(annotation) for inner in _types_in(part))]


def _dataclasses():
    """Dataclasses among the public names, what public functions return, and what their fields hold, by name."""
    found = {}
    left = [value for value in PUBLIC.values() if inspect.isclass(value)]
    for name in FUNCTIONS:
        hints = inspect.get_annotations(PUBLIC[name])
        left += _types_in(_resolved(hints.get("return"), PUBLIC[name].__module__))
    while left:
        one = left.pop()
        if dataclasses.is_dataclass(one) and one.__name__ not in found:
            found[one.__name__] = one
            for field in dataclasses.fields(one):
                left += _types_in(_resolved(field.type, one.__module__))
    return dict(sorted(found.items()))


def _resolved(annotation, module):
    """The type that an annotation written as a text names, None for one of a package that is not imported here."""
    if not isinstance(annotation, str):
        return annotation
    return getattr(importlib.import_module(module), annotation, None)


DATACLASSES = _dataclasses()


def _modules():
    """Every module of the package and of the kernels that has examples."""
    names = ["towatlas", "towatlas.kernels"]
    for package in (towatlas, towatlas.kernels):
        names += [found.name for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}.")]
    # Importing this one runs the command line.
    names = sorted({*names} - {"towatlas.__main__"})
    finder = doctest.DocTestFinder(exclude_empty=True)
    modules = {name: importlib.import_module(name) for name in names}
    return [name for name, module in modules.items() if any(test.examples for test in finder.find(module))]


def _parameters(function):
    kinds = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}
    parameters = inspect.signature(function).parameters.values()
    return [kinds.get(one.kind, "") + one.name for one in parameters if one.name != "self"]


def _names(section):
    """Names of a section, of which one entry may hold several."""
    return [name for entry in section for name in entry.name.split(", ")]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_function(name):
    doc = FunctionDoc(PUBLIC[name])
    assert doc["Summary"]
    assert _names(doc["Parameters"]) == _parameters(PUBLIC[name])
    assert all(entry.type and entry.desc for entry in doc["Parameters"])
    assert doc["Returns"]
    assert doc["Examples"]


@pytest.mark.parametrize("name", DATACLASSES)
def test_dataclass(name):
    entries = ClassDoc(DATACLASSES[name], config={"show_class_members": False})["Attributes"]
    assert _names(entries) == [field.name for field in dataclasses.fields(DATACLASSES[name])]
    assert all(entry.type and entry.desc for entry in entries)


@pytest.mark.parametrize("name", [name for name in vars(towatlas.Atlas) if not name.startswith("_")])
def test_method_of_atlas(name):
    method = inspect.getattr_static(towatlas.Atlas, name)
    doc = FunctionDoc(method.fget if isinstance(method, property) else method)
    assert doc["Summary"]
    if not isinstance(method, property):
        assert _names(doc["Parameters"]) == _parameters(method)
        assert doc["Returns"]


@pytest.fixture(scope="module")
def folder_with_files(atlas_path, equilibria_path, tmp_path_factory):
    folder = tmp_path_factory.mktemp("examples")
    (folder / "build").mkdir()
    (folder / "build" / "atlas.nc").symlink_to(atlas_path)
    (folder / "build" / "equilibria.nc").symlink_to(equilibria_path)
    return folder


@pytest.mark.parametrize("name", _modules())
def test_examples(name, folder_with_files, monkeypatch):
    monkeypatch.chdir(folder_with_files)
    result = doctest.testmod(importlib.import_module(name))
    assert (result.attempted > 0, result.failed) == (True, 0)
