"""Whether an environment holds the oldest versions that pyproject promises: run by its Python, after the installation.

A lower bound that nothing of its number can be installed for any more, or that another package rules out, is an
untested promise: an error.
"""

import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

from packaging.requirements import Requirement
from packaging.version import Version

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())["project"]
oldest: dict[str, Version] = {}
for text in project["dependencies"] + project["optional-dependencies"]["test"]:
    asked = Requirement(text)
    if asked.marker is None or asked.marker.evaluate():
        (bound,) = asked.specifier
        oldest[asked.name] = max(Version(bound.version), oldest.get(asked.name, Version("0")))
wrong = {name: bound for name, bound in oldest.items() if Version(version(name)) != bound}
for name, bound in wrong.items():
    print(f"pyproject promises {name} {bound}, the oldest to be had is {version(name)}", file=sys.stderr)
print("oldest versions:", ", ".join(f"{name} {bound}" for name, bound in oldest.items()))
sys.exit(bool(wrong))
