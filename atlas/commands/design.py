"""`towatlas design`: the cable that puts the fish at a depth."""

import argparse
import math
from typing import Any

import numpy as np

from towatlas.commands.common import NO_STATE, OK, add_atlas, add_patience, print_json, say
from towatlas.commands.scene import add_speed, atlas_if_any, describe_speed, quantity, scene_of
from towatlas.scene.angles import angles_along, extrapolation
from towatlas.scene.choice import Choice
from towatlas.scene.designs import Design, design
from towatlas.scene.scene import MODELS, Scene
from towatlas.solve.equilibria import equilibria


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "design",
        help="cable lengths that put the fish of a scene at a depth",
        description="All cable lengths that put the fish at a depth below the plane of the towing circle, by the "
        "vacuum model, with the distance to the nearest critical speed. The length in the scene is not used. For each "
        "expected shape the least model says where the fish hangs with drag and buoyancy.",
    )
    parser.add_argument("--scene", required=True, metavar="FILE", help="a scene, or the name of one that is shipped")
    parser.add_argument("--depth", type=quantity("m"), required=True, metavar="D", help="as 120m; bare: m")
    parser.add_argument(
        "--max-radius", type=quantity("m"), default=math.inf, metavar="R", help="farthest from the axis; default: any"
    )
    parser.add_argument(
        "--max-length",
        type=quantity("m"),
        metavar="L",
        help="longest cable searched; default 10 times the distance from the tow point to the axis at that depth",
    )
    parser.add_argument(
        "--model", choices=MODELS, help="says where the fish hangs; vacuum: no other is solved; default: the least"
    )
    add_speed(parser)
    add_atlas(parser)
    parser.add_argument("--json", action="store_true", help="one object instead of a table")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    scene = scene_of(options.scene, options)
    atlas = atlas_if_any(options.atlas)
    found = design(
        scene,
        options.depth,
        options.max_radius,
        options.max_length,
        atlas,
    )
    choices = {}
    if options.model != "vacuum":
        choices = found.choices(options.model)
    rows = _rows(found, choices)
    reason = None if rows else _reason(found)
    notes = [*scene.notes, *_extrapolations(scene, choices)]
    if options.json:
        answer = {
            "file": scene.source,
            "model": "vacuum",
            "gamma": scene.gamma,
            "depth_m": found.depth,
            "max_radius_m": found.max_radius if math.isfinite(found.max_radius) else None,
            "longest_searched_m": found.longest,
            "cables": rows,
            "reason": reason,
            "notes": notes,
        }
        print_json(answer)
    elif rows:
        print(_text(found, rows))
    for note in notes:
        say(note)
    if reason:
        say(reason)
        return NO_STATE
    if (warning := _warning(rows, options.model is not None)) is not None:
        say(warning)
    return OK


def _rows(found: Design, choices: dict[int, Choice]) -> list[dict[str, Any]]:
    scene, cables = found.scene, found.cables
    force = scene.force_unit()
    rows = []
    for k in np.flatnonzero(found.chosen):
        jumps = found.jumps[k]
        row: dict[str, Any] = {
            "length_m": float(cables.lam[k] * scene.radius),
            "nodes": int(cables.nodes[k]),
            "expected": bool(found.expected[k]),
            "x_f_m": float(cables.x_f[k] * scene.radius),
            "tension_N": float(cables.tension[k] * force),
            "nearest_n": None,
            "nearest_gamma": None,
            "distance_gamma": None,
            "distance_relative": None,
            "distance_m_s": None,
            "by_model": _by_model(choices[int(k)]) if int(k) in choices else None,
        }
        at = jumps.nearest(abs(scene.gamma))
        if at >= 0:
            distance = float(jumps.gamma[at]) - abs(scene.gamma)
            row |= {
                "nearest_n": int(jumps.n[at]),
                "nearest_gamma": float(jumps.gamma[at]),
                "distance_gamma": distance,
                "distance_relative": distance / abs(scene.gamma),
                "distance_m_s": float(scene.speed_of(distance)),
            }
        rows.append(row)
    return rows


def _extrapolations(scene: Scene, choices: dict[int, Choice]) -> list[str]:
    """What is said, once, of laws of the cable beyond the angles that they were measured at."""
    for choice in choices.values():
        found = choice.answer.equilibria
        if text := extrapolation(scene, angles_along(scene, found, found.expected)):
            return [text]
    return []


def _by_model(choice: Choice) -> dict[str, Any]:
    """Where the fish hangs by the least model."""
    answer = choice.answer
    x, y, z = answer.position.tolist()
    return {
        "model": choice.model,
        "reason": choice.reason,
        "nodes": answer.nodes,
        "x_f_m": x,
        "y_f_m": y,
        "z_f_m": z,
        "tension_N": answer.tension,
    }


def _warning(rows: list[dict[str, Any]], forced: bool) -> str | None:
    """What the vacuum model is worth here."""
    larger = [row for row in rows if row["by_model"] and row["by_model"]["model"] != "vacuum"]
    if not larger:
        return None
    first = larger[0]
    if forced:
        return (
            f"lengths are by the vacuum model; with {first['length_m']:.6g} m the fish hangs "
            f"{first['by_model']['z_f_m']:.6g} m deep by {first['by_model']['model']}"
        )
    return (
        f"lengths are by the vacuum model, which does not hold for {len(larger)} of "
        f"{sum(row['expected'] for row in rows)} expected shapes: with {first['length_m']:.6g} m, "
        f"{first['by_model']['reason']}"
    )


def _reason(found: Design) -> str:
    scene, cables = found.scene, found.cables
    if not len(cables):
        shapes = equilibria(found.longest / scene.radius, scene.system("vacuum").w_f, scene.gamma)
        deepest = float(shapes.z_f.max()) * scene.radius
        return (
            f"no cable up to {found.longest:.4g} m has an equilibrium with the fish at {found.depth:.6g} m: the "
            f"deepest of the longest one is at {deepest:.6g} m; a longer one may, with --max-length, or a slower tow"
        )
    nearest = int(np.argmin(np.abs(cables.x_f)))
    return (
        f"none of the {len(cables)} cables up to {found.longest:.4g} m with the fish at {found.depth:.6g} m has it "
        f"within {found.max_radius:.6g} m of the axis; nearest to it, {abs(cables.x_f[nearest]) * scene.radius:.6g} m, "
        f"comes a cable of {cables.lam[nearest] * scene.radius:.6g} m with {cables.nodes[nearest]} nodes"
    )


def _text(found: Design, rows: list[dict[str, Any]]) -> str:
    scene = found.scene
    lines = [
        scene.title or scene.source,
        describe_speed(scene),
        f"fish at {found.depth:.6g} m, cables up to {found.longest:.4g} m (vacuum model); nearest jump: its number, "
        "critical speed less the scene's; of expected shapes, where the fish hangs by the least model",
        "",
        f"{'length m':>13} {'nodes':>5} {'fish x m':>13} {'tension N':>13} {'n':>4} {'%':>8} {'gamma':>9} {'m/s':>9}",
    ]
    for row in rows:
        cells = f"{row['length_m']:>13.8g} {row['nodes']:>5} {row['x_f_m']:>13.6g} {row['tension_N']:>13.6g}"
        if row["nearest_n"] is None:
            jump = f" {'-':>4} {'-':>8} {'-':>9} {'-':>9}"
        else:
            jump = (
                f" {row['nearest_n']:>4} {100 * row['distance_relative']:>+8.2f} {row['distance_gamma']:>+9.4g} "
                f"{row['distance_m_s']:>+9.4g}"
            )
        by = row["by_model"]
        hangs = ""
        if by:
            hangs = f", by {by['model']} {by['z_f_m']:.6g} m deep, {by['nodes']} nodes"
            hangs = ", the vacuum model holds" if by["model"] == "vacuum" else hangs
        lines.append(cells + jump + (f"  expected{hangs}" if row["expected"] else ""))
    return "\n".join(lines)
