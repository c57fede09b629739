"""`towatlas scene`: a towing scene in real units."""

import argparse
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any

from atlas.answers import Jumps, SceneAnswer, answer_scene
from atlas.commands.common import OK, add_atlas, announce_compilation, say
from atlas.commands.common import speed as dimensionless_speed
from atlas.lookup import Atlas, open_atlas
from atlas.scene import KNOT, MODELS, Scene, read_scene, shipped_scenes
from kernels import status

MEDIA = {"vacuum": "a vacuum", "air": "a nondense fluid", "water": "a dense fluid"}


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "scene",
        help="critical speeds and shapes of a towing scene in real units",
        description="Dimensionless groups, critical speeds and equilibria of a scene, a TOML file in real units. "
        f"Scenes that come with the package, by name: {', '.join(shipped_scenes())}.",
    )
    parser.add_argument("file", metavar="FILE", help="a scene; see docs/scenes.md")
    add_speed(parser)
    add_atlas(parser)
    parser.add_argument("--json", action="store_true", help="one object instead of tables")
    parser.set_defaults(run=_run)


def quantity(unit: str, bare: str | None = None) -> Any:
    """The type of an argument with a unit, positive; a bare number is SI, or in the unit named."""

    def positive(text: str) -> float:
        from atlas.units import parse_quantity

        try:
            value: float | str = float(text)
        except ValueError:
            value = text
        try:
            number = parse_quantity("value", value, unit, bare)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error).removeprefix("value = ")) from None
        if number <= 0.0:
            raise argparse.ArgumentTypeError(f"{text} is not positive")
        return number

    return positive


def add_speed(parser: argparse.ArgumentParser) -> None:
    """Arguments that put another speed in place of the scene's."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--speed", type=quantity("m/s"), metavar="V", help="of the tow point, as 3kn; bare: m/s")
    group.add_argument("--rpm", type=quantity("rad/s", "rpm"), metavar="N", help="turns a minute")
    group.add_argument("--gamma", type=dimensionless_speed, metavar="GAMMA", help="Omega sqrt(R/g)")


def scene_of(path: str, options: argparse.Namespace) -> Scene:
    """The scene at the speed asked for."""
    scene = read_scene(path)
    given = {"speed": options.speed, "rotation_rate": options.rpm, "gamma": options.gamma}
    return scene if all(value is None for value in given.values()) else scene.at(**given)


def atlas_if_any(path: Path) -> Atlas | None:
    """The atlas, or None where there is no such file; a damaged one is an error."""
    return open_atlas(path) if path.exists() else None


def _run(options: argparse.Namespace) -> int:
    scene = scene_of(options.file, options)
    atlas = atlas_if_any(options.atlas)
    announce_compilation("shoot_each", 5)
    answer = answer_scene(scene, atlas, lambda: announce_compilation("solve_folds"))
    print(json.dumps(_object(answer), indent=1) if options.json else _text(answer))
    for code in {int(code) for code in answer.jumps.status} - {status.OK}:
        say(f"a critical speed could not be had: {status.SENTENCES[code]}")
    return OK


def real(value: Any) -> float | None:
    """A number for JSON, which knows no nan."""
    return float(value) if math.isfinite(value) else None


def speeds(scene: Scene, gamma: float) -> dict[str, float | None]:
    """A speed in every unit."""
    speed = scene.speed_of(gamma)
    values = {"gamma": gamma, "speed_m_s": speed, "speed_kn": speed / KNOT, "rpm": scene.rpm_of(gamma)}
    return {name: real(value) for name, value in values.items()}


def _groups(scene: Scene, model: str) -> dict[str, float | None]:
    return {name: real(value) for name, value in asdict(scene.groups(model)).items()}


def _jumps(scene: Scene, jumps: Jumps) -> list[dict[str, Any]]:
    words = status.FLAG_MEANINGS.split()
    near = jumps.near(scene.gamma)
    return [
        {
            "n": int(jumps.n[k]),
            **speeds(scene, float(jumps.gamma[k])),
            "error": real(jumps.error[k]),
            "source": "atlas" if jumps.looked_up[k] else "solved",
            "near": bool(near[k]),
            "status": words[int(jumps.status[k])],
        }
        for k in range(len(jumps.n))
    ]


def _equilibria(answer: SceneAnswer) -> list[dict[str, Any]]:
    scene, found = answer.scene, answer.equilibria
    force = scene.force_unit()
    return [
        {
            "nodes": int(found.nodes[k]),
            "median": bool(found.median[k]),
            "x_f_m": float(found.x_f[k] * scene.radius),
            "z_f_m": float(found.z_f[k] * scene.radius),
            "tension_N": float(found.tension[k] * force),
            "R_x0_N": float(found.R_x0[k] * force),
            "R_x0": float(found.R_x0[k]),
        }
        for k in range(len(found))
    ]


def _object(answer: SceneAnswer) -> dict[str, Any]:
    scene = answer.scene
    return {
        "title": scene.title,
        "file": scene.source,
        "medium": scene.medium,
        "model": "vacuum",
        "groups": _groups(scene, scene.medium),
        "groups_by_model": {model: _groups(scene, model) for model in MODELS},
        "speed": speeds(scene, scene.gamma),
        "transitions": answer.jumps.existing,
        "critical_speeds": _jumps(scene, answer.jumps),
        "equilibria": _equilibria(answer),
    }


def _cell(value: float | None, digits: int = 7) -> str:
    return "-" if value is None else f"{value:.{digits}g}"


def describe_speed(scene: Scene) -> str:
    """The speed in every unit, in one line."""
    values = speeds(scene, scene.gamma)
    return (
        f"speed: {_cell(values['speed_m_s'], 5)} m/s, {_cell(values['speed_kn'], 5)} kn, "
        f"{_cell(values['rpm'], 5)} rpm, gamma = {_cell(scene.gamma)}"
    )


def _text(answer: SceneAnswer) -> str:
    scene = answer.scene
    by_model = {model: _groups(scene, model) for model in MODELS}
    lines = [scene.title or scene.source, describe_speed(scene), f"towed in {MEDIA[scene.medium]}", ""]
    lines.append(f"{'group':<8}" + "".join(f" {model:>12}" for model in MODELS))
    for name in by_model["vacuum"]:
        lines.append(f"{name:<8}" + "".join(f" {_cell(by_model[model][name]):>12}" for model in MODELS))
    lines += ["", *_jump_lines(answer), "", "equilibria (vacuum model), the fish in m, forces in N"]
    lines.append(f"{'nodes':>5} {'x_f':>13} {'z_f':>13} {'tension':>13} {'R_x0':>13}")
    for row in _equilibria(answer):
        cells = " ".join(f"{_cell(row[name], 8):>13}" for name in ("x_f_m", "z_f_m", "tension_N", "R_x0_N"))
        lines.append(f"{row['nodes']:>5} {cells}{'  median' if row['median'] else ''}")
    return "\n".join(lines)


def _jump_lines(answer: SceneAnswer) -> list[str]:
    scene, jumps = answer.scene, answer.jumps
    if not jumps.existing:
        return ["the cable is too short for a jump: it has no critical speed (vacuum model)"]
    lines = [f"critical speeds (vacuum model), {len(jumps.n)} of {jumps.existing}"]
    lines.append(f"{'n':>5} {'gamma':>13} {'m/s':>13} {'kn':>13} {'rpm':>13}  source")
    rows = _jumps(scene, jumps)
    for row in rows:
        cells = " ".join(f"{_cell(row[name], 8):>13}" for name in ("gamma", "speed_m_s", "speed_kn", "rpm"))
        known = row["source"] if row["gamma"] is not None else row["status"]
        lines.append(f"{row['n']:>5} {cells}  {known}{', within 10 % of the speed' if row['near'] else ''}")
    if not any(row["near"] for row in rows):
        lines.append("no jump lies within 10 % of the speed")
    return lines
