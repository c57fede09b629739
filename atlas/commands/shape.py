"""`towatlas shape`: the shape of one equilibrium, of a cable or of a scene, as a file or a figure."""

import argparse
import sys
from pathlib import Path
from typing import Any

import numpy as np

from towatlas import __version__
from towatlas.commands.common import (
    FIGURE_FORMATS,
    OK,
    add_cable,
    add_fluid,
    add_patience,
    fluid,
    new_figure,
    number,
    save_figure,
    say,
    turn,
)
from towatlas.commands.scene import add_speed, scene_of
from towatlas.commands.scene_files import UNITS, save_scene_figure, shape_facts
from towatlas.kernels.system import COLUMNS as SYSTEM
from towatlas.scene.jumps import SceneAnswer, answer_scene
from towatlas.scene.models import QUESTIONS
from towatlas.scene.scene import MODELS
from towatlas.solve.shapes import POINTS, shape

FORMATS = (".nc", ".csv", *FIGURE_FORMATS)
MOST_POINTS = 10**6
COLUMNS = tuple(UNITS)


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "shape",
        help="the shape of one equilibrium, of a cable or a scene",
        description="Position, force and tension along the cable in one of its equilibria: as a table on standard "
        "output, or as a file or a figure. Of a scene in SI, by the model that `towatlas scene` chooses; of a cable "
        "given by --lam, --wf, --gamma and its fluid dimensionless.",
    )
    parser.add_argument("scene", nargs="?", metavar="SCENE", help="a scene, the name of one that is shipped, or -")
    add_cable(parser, gamma=False, any_medium=True, required=False)
    add_speed(parser, turn)
    add_fluid(parser)
    parser.add_argument("--model", choices=MODELS, help="of a scene: this one; default: as `towatlas scene`")
    parser.add_argument(
        "--root",
        default="expected",
        metavar="ROOT",
        help="expected (the default), in a vacuum median, the name of a branch of `towatlas equilibria` or `towatlas "
        "scene` as outward or '2 inner', or a row of that list, counted from 0",
    )
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--points", type=int, default=POINTS, metavar="N", help="evenly spaced, default %(default)s")
    where.add_argument(
        "--s", type=number, nargs="+", metavar="S", help="arc lengths from the tow point [tow radii; of a scene m]"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="FILE.nc, .csv, .svg, .png or .pdf")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    if options.out and options.out.suffix.lower() not in FORMATS:
        raise ValueError(f"--out {options.out}: the ending must be one of {', '.join(FORMATS)}")
    if not 2 <= options.points <= MOST_POINTS:
        raise ValueError(f"--points {options.points}: a shape has 2 points or more, up to {MOST_POINTS:,}")
    _check_cable(options)
    root = int(options.root) if options.root.isdecimal() else options.root
    answer = _answer(options) if options.scene else None
    length = answer.scene.length if answer else options.lam
    arc = options.s if options.s else np.linspace(0.0, length, options.points)
    if answer:
        curve = answer.shape(root, arc)
    else:
        curve = shape(options.lam, options.wf, options.gamma, root=root, s=arc, **fluid(options))
    kind = options.out.suffix.lower() if options.out else ".csv"
    if kind == ".nc":
        from towatlas.builders.file import write_atlas

        write_atlas(options.out, curve.assign_attrs(history=f"towatlas {__version__}: shape"), {})
    elif kind == ".csv":
        _write_csv(curve, options.out)
    elif answer:
        save_scene_figure(answer, options.out, curve.attrs["branch"])
        return OK
    else:
        from towatlas.plot.shape import plot_shape

        figure, axes = new_figure(5.2, 6.4, "compressed")
        plot_shape(curve, axes)
        save_figure(figure, options.out)
        return OK
    if options.out:
        say(f"wrote {options.out}")
    return OK


def _check_cable(options: argparse.Namespace) -> None:
    """Either a scene or a cable, and nothing of the other."""
    cable = {"--lam": options.lam, "--wf": options.wf, "--gamma": options.gamma}
    if options.scene is None:
        if missing := [name for name, value in cable.items() if value is None]:
            raise ValueError(f"give a scene, or --lam, --wf and --gamma; missing: {', '.join(missing)}")
        alien = {"--speed": options.speed, "--rpm": options.rpm, "--model": options.model}
    else:
        groups = {f"--{name.replace('_', '-')}": value for name, value in fluid(options).items()}
        alien = {"--lam": options.lam, "--wf": options.wf} | groups
    if given := [name for name, value in alien.items() if value is not None]:
        owner, other = ("a cable", "a scene") if options.scene else ("a scene", "a cable")
        raise ValueError(f"{given[0]} goes with {owner}, and here {other} is given")


def _answer(options: argparse.Namespace) -> SceneAnswer:
    """The shapes of the scene; jumps are looked for where they have a say in the model."""
    asked = QUESTIONS if options.model is None else ("position", "tension")
    answer = answer_scene(scene_of(options.scene, options), model=options.model, asked=asked)
    for note in answer.notes:
        say(note)
    return answer


def _write_csv(curve: Any, path: Path | None) -> None:
    if "model" in curve.attrs:
        facts, header = shape_facts(curve), ",".join(f"{name}_{unit}" for name, unit in UNITS.items())
    else:
        named = ("lam", "w_f", "gamma", "R_x0", *(name for name in SYSTEM if name not in ("lam", "w_f")))
        facts = ", ".join(f"{name} = {curve.attrs[name]!r}" for name in named)
        facts += f", branch = {curve.attrs['branch']}, nodes = {curve.attrs['nodes']}"
        header = ",".join(COLUMNS)
    rows = np.stack([curve[name].values for name in COLUMNS], axis=1)
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
    np.savetxt(
        path or sys.stdout,
        rows,
        fmt="%.17g",
        delimiter=",",
        header=f"# {facts}\n{header}",
        comments="",
        encoding="utf-8",
    )
