"""`towatlas plot`: draw a figure."""

import argparse
import os
from pathlib import Path
from typing import Any

from atlas.commands.common import OK, add_atlas, say
from atlas.lookup import open_atlas

FIGURE_FORMATS = (".svg", ".png", ".pdf")


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser("plot", help="draw a figure", description="Draw a figure from an atlas.")
    parser.add_argument("figure", choices=("critical",), help="critical speeds against cable length")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="FILE.svg, .png or .pdf")
    add_atlas(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.out.suffix.lower() not in FIGURE_FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FIGURE_FORMATS)}")
    atlas = open_atlas(options.atlas)
    os.environ["MPLBACKEND"] = "Agg"
    import matplotlib.pyplot as plt

    from atlas.plot import plot_critical

    plt.rcParams["svg.hashsalt"] = "towatlas"
    figure, axes = plt.subplots(figsize=(7.2, 4.8), layout="constrained")
    plot_critical(atlas, ax=axes)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    metadata = {"Date": None} if options.out.suffix.lower() == ".svg" else {}
    figure.savefig(options.out, dpi=200, metadata=metadata)
    say(f"wrote {options.out}")
    return OK
