"""One order of arguments everywhere, lam, w_f, gamma, and inside the package only by name: they are all floats."""

import ast
from pathlib import Path

import pytest

import towatlas

ROOT = Path(__file__).parent.parent
ORDER = ["lam", "w_f", "gamma"]
# What a user calls may take them by place.
PUBLIC = {*towatlas.__all__, "plot_drag_folds", "of"}


def functions():
    """Every function of the package, with the class it belongs to."""
    for folder in ("atlas", "kernels"):
        for path in sorted((ROOT / folder).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text())):
                owner = node.name if isinstance(node, ast.ClassDef) else ""
                for child in ast.iter_child_nodes(node):
                    if isinstance(child, ast.FunctionDef):
                        yield pytest.param(folder, owner, child, id=f"{path.stem}.{owner}.{child.name}")


def cable(arguments):
    return [argument.arg for argument in arguments if argument.arg in ORDER]


CABLES = [
    case
    for case in functions()
    if len(cable([*case.values[2].args.posonlyargs, *case.values[2].args.args, *case.values[2].args.kwonlyargs])) > 1
]


def test_there_are_some():
    assert len(CABLES) > 40


@pytest.mark.parametrize(("folder", "owner", "function"), CABLES)
def test_order_of_arguments(folder, owner, function):
    by_place, by_name = cable(function.args.args), cable(function.args.kwonlyargs)
    for names in (by_place, by_name):
        assert names == [name for name in ORDER if name in names]
    public = owner == "Atlas" or function.name in PUBLIC
    # Kernels take their arguments by place: numba does so fastest. A field of a tuple or a row is no argument.
    if folder == "atlas" and not public:
        assert len(by_place) < 2, "by name only"
