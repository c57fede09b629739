"""`towatlas explore`: a page that explores a scene in a browser, with no installation."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import OK, add_patience, say
from towatlas.scene.file import read_scene, shipped_scenes
from towatlas.scene.scene import MODELS
from towatlas.tables.seal import check_writable

# Of all scenes of a page, s of CPU; those shipped take a minute.
SECONDS = 180.0


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "explore",
        help="a page to explore a scene in a browser: one file, offline",
        description="One HTML file that needs nothing else, for a browser on any machine: sliders for cable, fish, "
        "circle and speed; the shapes at the speed, critical speeds, what lasts, tension. Without drag the page "
        "computes everything itself, for any cable; with drag it has tables, of SCENE and the scenes shipped, from a "
        "quarter of the speed to twice the speed.",
    )
    parser.add_argument("scene", nargs="?", metavar="SCENE", help="a scene, on show first; default: those shipped only")
    parser.add_argument("--model", choices=MODELS, help="of SCENE; default: the least that holds, with drag")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.html", help="where to")
    add_patience(parser)
    parser.set_defaults(run=_run, patience=SECONDS)


def _run(options: argparse.Namespace) -> int:
    if options.out.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"--out {options.out}: the ending must be .html or .htm")
    if options.model and options.scene is None:
        raise ValueError("--model is of SCENE: name one")
    check_writable(options.out)
    from towatlas.explorer.page import explorer_page
    from towatlas.explorer.tables import table_of

    names = dict.fromkeys([options.scene, *shipped_scenes()] if options.scene else shipped_scenes())
    tables = []
    for name in names:
        say(f"{name}: every branch over the speed")
        tables.append(table_of(read_scene(name), options.model if name == options.scene else None))
    options.out.write_text(explorer_page(tables), encoding="utf-8")
    say(f"wrote {options.out}")
    return OK
