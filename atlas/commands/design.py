"""`towatlas design`: the cables that put the fish at a depth, at a distance from the axis, or pull with a force."""

import argparse
import math
from typing import Any

from towatlas.commands import design_range
from towatlas.commands.common import FAILED, NO_STATE, OK, add_patience, print_json, real, say
from towatlas.commands.common import speed as dimensionless_speed
from towatlas.commands.quantities import quantity
from towatlas.commands.scene import describe_speed, scene_of
from towatlas.commands.scene_stability import verdict_object
from towatlas.scene.designs import LOOKED, UNITS, Cable, Design, design
from towatlas.scene.models import solvable_models
from towatlas.scene.ranges import POINTS
from towatlas.scene.scene import MODELS


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "design",
        help="cable lengths that put the fish of a scene at a depth",
        description="All cable lengths that put the fish at a depth below the plane of the towing circle or at a "
        "distance from the axis, or pull with a force at the tow point, by the least model that holds for each cable "
        "expected, with the nearest jump of each. The length in the scene is not used. For a range of speeds, "
        "--speed 3kn:5kn, the lengths at each of some speeds, and what each of them does, kept, over the whole range.",
    )
    parser.add_argument("--scene", required=True, metavar="FILE", help="a scene, or the name of one that is shipped")
    wanted = parser.add_mutually_exclusive_group(required=True)
    wanted.add_argument("--depth", type=quantity("m"), metavar="D", help="of the fish, as 120m; bare: m")
    wanted.add_argument("--radius", type=quantity("m"), metavar="R", help="of the fish from the axis, as 20m; bare: m")
    wanted.add_argument("--tension", type=quantity("N"), metavar="T", help="at the tow point, as 900N; bare: N")
    parser.add_argument(
        "--max-radius", type=quantity("m"), default=math.inf, metavar="R", help="farthest from the axis; default: any"
    )
    parser.add_argument(
        "--max-tension", type=quantity("N"), default=math.inf, metavar="T", help="at the tow point; default: any"
    )
    parser.add_argument(
        "--max-length",
        type=quantity("m"),
        metavar="L",
        help="longest cable searched; default 10 times the distance from the tow point to the axis at that depth",
    )
    parser.add_argument("--model", choices=MODELS, help="this one, compared with no other; default: the least")
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--speed",
        type=design_range.speeds,
        metavar="V",
        help="of the tow point, as 3kn, or a range, as 3kn:5kn; bare: m/s",
    )
    group.add_argument("--rpm", type=quantity("rad/s", "rpm"), metavar="N", help="turns a minute")
    group.add_argument("--gamma", type=dimensionless_speed, metavar="GAMMA", help="Omega sqrt(R/g)")
    parser.add_argument(
        "--points", type=int, metavar="N", help=f"speeds of a range at which lengths are found, default {POINTS}"
    )
    parser.add_argument(
        "--within",
        metavar="TOL",
        help="of a range of speeds: only lengths that keep what is wanted within so much of it, as 5m or 10%%",
    )
    parser.add_argument("--stable-only", action="store_true", help="only shapes that are known to last")
    parser.add_argument("--json", action="store_true", help="one object instead of a table")
    add_patience(parser)
    parser.set_defaults(run=_run)


def _run(options: argparse.Namespace) -> int:
    names = ("depth", "radius", "tension", "max_radius", "max_tension", "max_length")
    limits = {name: getattr(options, name) for name in names}
    if isinstance(options.speed, tuple):
        return design_range.run(options, limits)
    for name in ("points", "within"):
        if getattr(options, name) is not None:
            raise ValueError(f"--{name} is for a range of speeds, as --speed 3kn:5kn")
    scene = scene_of(options.scene, options)
    found = design(scene, **limits, model=options.model, stable_only=options.stable_only)
    rows = [_row(found, cable) for cable in found.chosen]
    reason = None if rows else _reason(found, options)
    if options.json:
        answer = {
            "file": scene.source,
            "model": found.model,
            "model_reason": found.reason,
            "gamma": scene.gamma,
            "wanted": found.quantity,
            f"{found.quantity}_{UNITS[found.quantity]}": found.value,
            "max_radius_m": real(options.max_radius),
            "max_tension_N": real(options.max_tension),
            "stable_only": options.stable_only,
            "longest_searched_m": found.longest,
            "complete": found.complete,
            "cables": rows,
            "reason": reason,
            "notes": found.notes,
        }
        print_json(answer)
    elif rows:
        print(_text(found, rows))
    for note in found.notes:
        say(note)
    if not found.complete:
        say("not everywhere made out: cables may be missing")
    if reason:
        say(reason)
        return NO_STATE if found.complete else FAILED
    return OK


def _row(found: Design, cable: Cable) -> dict[str, Any]:
    scene = found.scene
    x, y, z = cable.position.tolist()
    row: dict[str, Any] = {
        "length_m": cable.length,
        "error": real(cable.error),
        "shape": cable.shape,
        "shapes": cable.shapes,
        "expected": cable.expected,
        "nodes": cable.nodes,
        "x_f_m": x,
        "y_f_m": y,
        "z_f_m": z,
        "r_f_m": cable.radius,
        "phase_deg": cable.phase_deg,
        "tension_N": cable.tension,
        "stability": None if cable.verdict is None else verdict_object(cable.verdict),
        "jumps_looked_at": [abs(scene.gamma) * share for share in LOOKED],
        "jumps_complete": cable.jumps.complete,
        "nearest_gamma": None,
        "distance_gamma": None,
        "distance_relative": None,
        "distance_m_s": None,
        "nearest_shapes_below": None,
        "nearest_shapes_above": None,
    }
    at = cable.nearest(scene.gamma)
    if at >= 0:
        nearest, speed = abs(float(cable.jumps.gamma[at])), abs(scene.gamma)
        distance = nearest - speed
        row |= {
            "nearest_gamma": nearest,
            "distance_gamma": distance,
            "distance_relative": distance / speed,
            "distance_m_s": float(scene.speed_of(distance)),
            "nearest_shapes_below": int(cable.jumps.shapes_below[at]),
            "nearest_shapes_above": int(cable.jumps.shapes_above[at]),
        }
    return row


def _reason(found: Design, options: argparse.Namespace) -> str:
    """Why there is none, and the nearest there is."""
    unit = UNITS[found.quantity]
    wanted = (
        f"up to {found.longest:.4g} m with a {found.quantity} of {found.value:.6g} {unit} by the {found.model} model"
    )
    if found.cables:
        limits = options.max_radius, options.max_tension
        within = [cable for cable in found.cables if cable.radius <= limits[0] and cable.tension <= limits[1]]
        if within:
            kinds = ", ".join(sorted({cable.verdict.kind for cable in within if cable.verdict is not None}))
            return f"none of the {len(within)} cables {wanted} within the limits is known to last: {kinds}"
        nearest = min(found.cables, key=lambda cable: max(cable.radius / limits[0], cable.tension / limits[1]))
        return (
            f"none of the {len(found.cables)} cables {wanted} is within the limits: nearest comes one of "
            f"{nearest.length:.6g} m, with the fish {nearest.radius:.6g} m from the axis and {nearest.tension:.6g} N "
            "at the tow point"
        )
    return (
        f"no cable {wanted}: there are {found.least:.6g} to {found.most:.6g} {unit}; a longer one may, with "
        "--max-length, or another speed"
    )


def _text(found: Design, rows: list[dict[str, Any]]) -> str:
    scene = found.scene
    lines = [
        scene.title or scene.source,
        describe_speed(scene),
        f"{found.quantity} of {found.value:.6g} {UNITS[found.quantity]}, cables up to {found.longest:.4g} m",
        f"model: {found.model}; {found.reason}",
        *_of_jumps(found),
        f"nearest jump: between {LOOKED[0]:g} and {LOOKED[1]:g} times the speed, its speed less the scene's",
        "",
        f"{'length m':>13} {'nodes':>5} {'fish x m':>11} {'y m':>11} {'depth m':>11} {'tension N':>11} {'shape':>7} "
        f"{'jump %':>8} {'m/s':>9} {'shapes':>8}  lasts",
    ]
    for row in rows:
        cells = (
            f"{row['length_m']:>13.8g} {row['nodes']:>5} {row['x_f_m']:>11.5g} {row['y_f_m']:>11.5g} "
            f"{row['z_f_m']:>11.5g} {row['tension_N']:>11.5g} {_of(row):>7}"
        )
        if row["nearest_gamma"] is None:
            jump = f" {'none':>8} {'-':>9} {'-':>8}"
        else:
            shapes = f"{row['nearest_shapes_below']} to {row['nearest_shapes_above']}"
            jump = f" {100 * row['distance_relative']:>+8.2f} {row['distance_m_s']:>+9.4g} {shapes:>8}"
        kind = row["stability"]["kind"]
        lines.append(f"{cells}{jump}  {kind}{'  expected' if row['expected'] else ''}")
    return "\n".join(lines)


def _of_jumps(found: Design) -> list[str]:
    """What larger models were not asked about."""
    if found.forced or found.model == solvable_models(found.scene)[0][-1]:
        return []
    return [
        f"jumps, and shapes that are not expected, are those of the {found.model} model, which was compared in the "
        "position and tension of the expected shape alone: `towatlas scene` with that length, or --model, says more"
    ]


def _of(row: dict[str, Any]) -> str:
    return f"{row['shape'] + 1} of {row['shapes']}"
