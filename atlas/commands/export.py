"""`towatlas export`: one shape of a scene for another program."""

import argparse
from pathlib import Path
from typing import Any

from towatlas.commands.common import OK, add_patience, say, turn
from towatlas.commands.scene import add_speed, scene_of
from towatlas.exports.moordyn_folder import MOST_SEGMENTS, SEGMENTS, check_folder, write_moordyn
from towatlas.scene.jumps import answer_scene
from towatlas.scene.models import QUESTIONS
from towatlas.scene.scene import MODELS


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "export",
        help="one shape of a scene for MoorDyn v2: deck, state, driver",
        description="A folder from which MoorDyn v2, lumped masses in the time domain, tows one shape of a scene on: "
        "an input deck, a state file with the computed shape and its rotation, a driver and a README. By the model "
        "that `towatlas scene` chooses.",
    )
    parser.add_argument("scene", metavar="SCENE", help="a scene, the name of one that is shipped, or -")
    parser.add_argument("--moordyn", type=Path, required=True, metavar="DIR", help="a folder that is empty, or made")
    add_speed(parser, turn)
    parser.add_argument("--model", choices=MODELS, help="this one; default: as `towatlas scene`")
    parser.add_argument(
        "--branch",
        default="expected",
        metavar="BRANCH",
        help="expected (the default), the name of a branch of `towatlas scene`, or a row of that list, counted from 0",
    )
    parser.add_argument(
        "--segments",
        type=int,
        default=SEGMENTS,
        metavar="N",
        help=f"of the chain, 2 to {MOST_SEGMENTS:,}, default %(default)s; its time grows with the square",
    )
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    check_folder(options.moordyn)
    root = int(options.branch) if options.branch.isdecimal() else options.branch
    asked = QUESTIONS if options.model is None else ("position", "tension")
    answer = answer_scene(scene_of(options.scene, options), model=options.model, asked=asked)
    for note in answer.notes:
        say(note)
    write_moordyn(answer, options.moordyn, root, options.segments)
    say(f"wrote {options.moordyn}; its README.md says what is chosen, and how to run it")
    return OK
