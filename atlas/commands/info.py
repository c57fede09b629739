"""`towatlas info`: what a file holds."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import OK
from towatlas.nomenclature import EQUILIBRIA
from towatlas.tables.critical import default_path, open_atlas, read_root
from towatlas.tables.fish import open_equilibria


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "info", help="what a file holds", description="Domain, versions, errors and seal of a file."
    )
    parser.add_argument(
        "file", type=Path, nargs="?", default=default_path(), metavar="FILE", help="default %(default)s"
    )
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    attributes, _, seal = read_root(options.file)
    print(f"{'file':<40}  {options.file}")
    if attributes.get("method") == "fold":
        atlas = open_atlas(options.file)
        axes = atlas.axes
        print(f"{'n':<40}  1 .. {atlas.n_max}")
        print(f"{'w_f':<40}  0 .. {axes.w_f_max:g}")
        print(f"{'lam - lambda_c':<40}  {axes.excess_min:g} .. {axes.excess_max:g}")
    elif attributes.get("method") == EQUILIBRIA:
        for name, nodes in open_equilibria(options.file).grid.items():
            print(f"{name:<40}  {nodes[0]:g} .. {nodes[-1]:g}")
    for name in sorted(attributes):
        value = attributes[name]
        print(f"{name:<40}  {format(value, '.2g') if isinstance(value, float) else value}")
    print(f"{'seal (SHA-256 of the file but the seal)':<40}  {seal}")
    return OK
