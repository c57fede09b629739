"""`towatlas info`: what a file holds."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import OK
from towatlas.tables.atlas import Atlas
from towatlas.tables.certified import METHOD, read_certified
from towatlas.tables.file import default_path, read_root


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "info", help="what a file holds", description="Domain, versions, errors and seal of a file."
    )
    parser.add_argument(
        "file", type=Path, nargs="?", metavar="FILE", help="default: the atlas that is used when none is named"
    )
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    path = options.file or default_path()
    attributes, _, seal = read_root(path)
    rows = {"file": str(path)}
    if attributes.get("method") == METHOD:
        rows |= {"holds": "proofs of nodes of an atlas"} | read_certified(path).facts()
    elif attributes.get("method") != "scan":
        atlas = Atlas(path)
        rows["holds"] = ", ".join(atlas.holds)
        for part in atlas.parts:
            rows |= part.domain()
        beside = path.with_name("certified.nc")
        if beside.exists() and (proofs := read_certified(beside)).atlas_seal == seal:
            rows |= {f"{beside.name}: {name}": text for name, text in proofs.facts().items()}
    for name in sorted(attributes):
        value = attributes[name]
        rows[name] = format(value, ".2g") if isinstance(value, float) else str(value)
    rows["seal (SHA-256 of the file but the seal)"] = seal
    for name, text in rows.items():
        print(f"{name:<40}  {text}")
    return OK
