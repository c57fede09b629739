"""`towatlas scene`: a towing scene in real units."""

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from towatlas.commands import scene_margins as margins
from towatlas.commands import scene_stability as verdicts
from towatlas.commands.common import add_atlas, add_patience, print_json, real, say
from towatlas.commands.common import speed as dimensionless_speed
from towatlas.commands.quantities import Range, quantity, range_of
from towatlas.commands.scene_files import check_out, write_scene
from towatlas.commands.scene_seen import as_object, lines_of
from towatlas.kernels import status
from towatlas.results import Folds, joined
from towatlas.scene.choice import Choice, percent
from towatlas.scene.diagrams import SceneDiagram, scene_diagram
from towatlas.scene.file import read_scene, scene_of_text, shipped_scenes
from towatlas.scene.jumps import LOOKED, NEAR, Jumps, SceneAnswer, answer_scene
from towatlas.scene.library import LARGEST
from towatlas.scene.margins import margins_of
from towatlas.scene.models import QUESTIONS, Finder, check_questions, solve_jumps, with_drag
from towatlas.scene.scene import KNOT, MODELS, Scene
from towatlas.scene.sensitivities import sensitivities_of
from towatlas.scene.verdicts import verdicts_of
from towatlas.system import System
from towatlas.tables.atlas import Atlas, open_atlas
from towatlas.tables.file import default_path, is_map

MEDIA = {"vacuum": "a vacuum", "air": "a nondense fluid", "water": "a dense fluid"}
# Of an equilibrium: names in JSON, and what the table calls them.
COLUMNS = {
    "x_f_m": "x_f",
    "y_f_m": "y_f",
    "z_f_m": "z_f",
    "phase_deg": "phase_deg",
    "tension_N": "tension",
    "R_x0_N": "R_x0",
}
# Groups that are shown where there is such a force; the last has no number where there is none.
NO_FORCE = {"C_t": 0.0, "C_s": 0.0, "b_s": None}


def add(commands: Any) -> None:
    """Declare the command."""
    parser = commands.add_parser(
        "scene",
        help="critical speeds and shapes of a towing scene in real units",
        description="Dimensionless groups, critical speeds and equilibria of a scene, a TOML file in real units, by "
        "the least model whose answers are those of the larger ones within the scene's tolerance. "
        "It ends with which shapes last, the largest tension, and the nearest jumps with what they cost. "
        f"Scenes that come with the package, by name: {', '.join(shipped_scenes())}.",
    )
    parser.add_argument("file", metavar="FILE", help="a scene, - for one on standard input")
    add_speed(parser)
    parser.add_argument("--model", choices=MODELS, help="this one, compared with no other; default: the least")
    parser.add_argument(
        "--asked",
        type=_questions,
        default=QUESTIONS,
        metavar="WHAT,...",
        help=f"what the model has to answer, some of {', '.join(QUESTIONS)}; default all",
    )
    parser.add_argument(
        "--compare", action="store_true", help="also groups and critical speeds by the other models, and the comparison"
    )
    parser.add_argument(
        "--margin",
        type=margins.margin,
        metavar="M",
        help="exit code 6 if a jump is nearer to the speed than M, as 10%% or 0.5kn",
    )
    parser.add_argument(
        "--sensitivities", action="store_true", help="also how jumps, depth and tensions move with each key"
    )
    parser.add_argument(
        "--seen",
        type=range_of("m/s"),
        metavar="LOW:HIGH",
        help="also what is seen as the speed rises from LOW to HIGH, as 1kn:8kn, and falls back; takes longer",
    )
    add_atlas(parser, "; or a map of folds, DIR or FILE, in which jumps with drag are looked up")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--json", action="store_true", help="one object instead of tables, with all of it")
    where.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="instead of tables FILE.svg, .png or .pdf, all shapes from the side and from above and the jumps; "
        ".html, that figure with the tables; or .csv, the shapes in SI, a row a point",
    )
    add_patience(parser)
    parser.set_defaults(run=_run)


def _questions(text: str) -> tuple[str, ...]:
    try:
        return check_questions([name.strip() for name in text.split(",") if name.strip()])
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def add_speed(parser: argparse.ArgumentParser, rate: Any = dimensionless_speed) -> None:
    """Arguments that put another speed in place of the scene's; `rate` is the type of a dimensionless one."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--speed", type=quantity("m/s"), metavar="V", help="of the tow point, as 3kn; bare: m/s")
    group.add_argument("--rpm", type=quantity("rad/s", "rpm"), metavar="N", help="turns a minute")
    group.add_argument("--gamma", type=rate, metavar="GAMMA", help="Omega sqrt(R/g)")


def scene_of(path: str, options: argparse.Namespace) -> Scene:
    """The scene at the speed asked for."""
    scene = scene_of_text(sys.stdin.buffer.read(LARGEST + 1), "-") if path == "-" else read_scene(path)
    given = {"speed": options.speed, "rotation_rate": options.rpm, "gamma": options.gamma}
    return scene if all(value is None for value in given.values()) else scene.at(**given)


def atlas_if_any(path: Path | None) -> Atlas | None:
    """The atlas; None where none is named and there is none, but one that is named or damaged is an error.

    Where a map is named critical speeds are looked up in that of always.
    """
    if path is not None and is_map(path):
        path = None
    if path is None and not default_path().exists():
        return None
    return open_atlas(path)


def _finder(path: Path | None) -> Finder:
    """What finds jumps with drag: a map, where one is named and tells them, else the solver."""
    if path is None or not is_map(path):
        return solve_jumps
    from towatlas.maps.folds import NotInMap
    from towatlas.maps.lookup import OutsideMap, open_map

    known = open_map(path)

    def find(system: System, slow: float, fast: float) -> Folds:
        """Within the speeds of the map by it, beyond them by the solver."""
        try:
            inside = known.folds(system, *known.speeds_within(slow, fast))
        except (OutsideMap, NotInMap) as error:
            say(f"jumps are not looked up, but solved for: {error}")
            found = solve_jumps(system, slow, fast)
            return replace(found, searched=f"{found.searched}; not looked up: {error}")
        first, last = known.speeds_within(slow, fast)
        before = [solve_jumps(system, slow, first)] if abs(slow) < abs(first) else []
        after = [solve_jumps(system, last, fast)] if abs(last) < abs(fast) else []
        return joined([*before, inside, *after])

    return find


def _run(options: argparse.Namespace) -> int:
    if options.out:
        check_out(options.out)
        if options.sensitivities:
            raise ValueError("--sensitivities are a table of the text or a key of --json, and not in a file of --out")
    scene = scene_of(options.file, options)
    asked = None if options.margin is None else margins.distance(scene, options.margin)
    if asked is not None and "speeds" not in options.asked:
        raise ValueError("--margin is a distance from jumps, which are not looked for without --asked speeds")
    atlas = atlas_if_any(options.atlas)
    answer = answer_scene(scene, atlas, options.model, options.asked, options.compare, _finder(options.atlas))
    slopes = sensitivities_of(answer) if options.sensitivities else None
    found = margins_of(answer, slopes, 0.0 if asked is None else asked / scene.speed)
    lasting = verdicts_of(answer)
    history = _history(answer, options.seen) if options.seen else None
    known = lines_of(history) if history else [_how_to_ask(scene)]
    ending = [*verdicts.lines_of(lasting, answer), *known, "", *margins.lines_of(found, answer)]
    if options.out:
        write_scene(answer, options.out, ending, options.compare)
    elif options.json:
        parts = margins.as_object(found, asked, slopes) | verdicts.as_object(lasting, answer)
        print_json(object_of(answer) | parts | {"seen": as_object(history) if history else None})
    else:
        table = [*margins.slope_lines(slopes), ""] if slopes else []
        print("\n".join([text_of(answer, options.compare), "", *table, *ending]))
    for note in answer.notes:
        say(note)
    if answer.folds is not None and options.atlas is not None and options.atlas.is_dir():
        say(f"jumps: {answer.folds.searched}")
    codes = {int(code) for code in answer.jumps.status} if answer.jumps is not None else set()
    for code in codes - {status.OK}:
        say(f"a critical speed could not be had: {status.SENTENCES[code]}")
    return margins.judge(found, answer.choice.model, asked)


def _history(answer: SceneAnswer, over: Range) -> SceneDiagram:
    """Every branch over a range of speed, by the model that answers, or in a fluid the least with drag."""
    scene, choice = answer.scene, answer.choice
    model = choice.model if choice.forced else with_drag(scene, choice.model)
    return scene_diagram(scene, speed=(over.low, over.high), model=model, unit=over.unit, size=over.size)


def _how_to_ask(scene: Scene) -> str:
    return f"what is seen as the speed rises and falls: --seen {0.5 * scene.speed:.2g}:{2.0 * scene.speed:.2g} (m/s)"


def speeds(scene: Scene, gamma: float) -> dict[str, float | None]:
    """A speed in every unit; gamma alone has the sign of the turn."""
    speed = scene.speed_of(abs(gamma))
    values = {"gamma": gamma, "speed_m_s": speed, "speed_kn": speed / KNOT, "rpm": scene.rpm_of(abs(gamma))}
    return {name: real(value) for name, value in values.items()}


def _groups(scene: Scene, model: str) -> dict[str, float | None]:
    return {name: real(value) for name, value in (asdict(scene.system(model)) | {"gamma": scene.gamma}).items()}


def _cable(scene: Scene) -> dict[str, Any] | None:
    """The type of cable, and how well its laws are known."""
    if (known := scene.cable_type) is None:
        return None
    low, high = known.angles_deg or (None, None)
    return {
        "type": known.name,
        "source": known.source,
        "standard_deviations": known.deviations,
        "measured_from_deg": low,
        "measured_to_deg": high,
    }


def _jumps(scene: Scene, jumps: Jumps) -> list[dict[str, Any]]:
    words = status.FLAG_MEANINGS.split()
    near = jumps.near(abs(scene.gamma))
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
    force = scene.force_unit(answer.choice.model)
    rows = []
    for k in range(len(found)):
        row: dict[str, Any] = {"branch": str(found.branch[k]), "nodes": int(found.nodes[k])}
        row |= {"expected": k == found.expected, "near_axis": bool(found.near_axis[k])}
        row |= {f"{name}_m": float(getattr(found, name)[k] * scene.radius) for name in ("r_f", "x_f", "y_f", "z_f")}
        row["phase_deg"] = float(found.phase_deg[k])
        row["tension_N"] = float(found.tension[k] * force)
        row |= {f"{name}_N": float(getattr(found, name)[k] * force) for name in ("R_x0", "R_y0", "R_z0")}
        row["R_x0"] = float(found.R_x0[k])
        angles = answer.angles[k]
        row["angle_min_deg"] = None if angles is None else angles.lowest
        row["angle_max_deg"] = None if angles is None else angles.highest
        row["extrapolated"] = None if angles is None else angles.extrapolated
        rows.append(row)
    return rows


def _folds(answer: SceneAnswer) -> list[dict[str, Any]]:
    """Jumps of the model used, all that there are between the speeds looked at."""
    scene, folds = answer.scene, answer.folds
    if folds is None:
        return []
    words = status.FLAG_MEANINGS.split()
    return [
        {
            **speeds(scene, float(folds.gamma[k])),
            "r_f_m": float(folds.r_f[k] * scene.radius),
            "shapes_below": int(folds.shapes_below[k]),
            "shapes_above": int(folds.shapes_above[k]),
            "n": int(folds.n[k]) or None,
            "origin": str(folds.origin[k]),
            "error": real(folds.error[k]),
            "near": abs(float(folds.gamma[k]) / scene.gamma - 1.0) <= NEAR,
            "status": words[int(folds.status[k])],
        }
        for k in range(len(folds))
    ]


def _differences(choice: Choice) -> list[dict[str, Any]]:
    # Whole numbers and speeds that do not exist have no relative difference.
    words = status.FLAG_MEANINGS.split()
    return [
        {
            "smaller": d.smaller,
            "larger": d.larger,
            "question": d.question,
            "quantity": d.quantity,
            "unit": d.unit,
            "by_smaller": real(d.by_smaller),
            "by_larger": real(d.by_larger),
            "relative_difference": real(d.relative),
            "agrees": d.agrees,
            "status_smaller": words[d.status_smaller],
            "status_larger": words[d.status_larger],
        }
        for d in choice.differences
    ]


def object_of(answer: SceneAnswer) -> dict[str, Any]:
    """Everything about a scene, for JSON."""
    scene, choice = answer.scene, answer.choice
    return {
        "title": scene.title,
        "file": scene.source,
        "notes": answer.notes,
        "medium": scene.medium,
        "turn": scene.turn,
        "cable": _cable(scene),
        "model": choice.model,
        "model_forced": choice.forced,
        "model_reason": choice.reason,
        "tolerance": choice.tolerance,
        "asked": choice.asked,
        "comparisons": _differences(choice),
        "groups": _groups(scene, scene.medium),
        "groups_by_model": {model: _groups(scene, model) for model in MODELS},
        "speed": speeds(scene, scene.gamma),
        # Of the vacuum: known where that is the model used, or compared.
        "transitions": None if answer.jumps is None else answer.jumps.existing,
        "critical_speeds_model": "vacuum",
        "critical_speeds": None if answer.jumps is None else _jumps(scene, answer.jumps),
        # None were looked for where speeds were not asked for.
        "jumps": None if answer.folds is None else _folds(answer),
        "jumps_looked_at": None if answer.folds is None else [speeds(scene, scene.gamma * share) for share in LOOKED],
        "jumps_complete": None if answer.folds is None else answer.folds.complete,
        "jumps_searched": None if answer.folds is None else answer.folds.searched,
        "equilibria": _equilibria(answer),
        "searched": answer.equilibria.searched,
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


def head_lines(answer: SceneAnswer) -> list[str]:
    """What is towed, how fast and in what; the model, and why this one."""
    scene, choice = answer.scene, answer.choice
    lines = [scene.title or scene.source, describe_speed(scene), f"towed in {MEDIA[scene.medium]}"]
    return [*lines, *_cable_lines(scene), f"{choice.model} model: {choice.reason}"]


def text_of(answer: SceneAnswer, compare: bool = False) -> str:
    """Everything about a scene, for people; what applies first, what other models say only to compare."""
    scene, choice = answer.scene, answer.choice
    lines = [*head_lines(answer), ""]
    lines.append(f"equilibria ({choice.model} model), the fish in m, forces in N, its phase behind the tow point")
    lines.append(f"{'branch':>8} {'nodes':>5} " + " ".join(f"{name:>13}" for name in COLUMNS.values()))
    for row in _equilibria(answer):
        cells = " ".join(f"{_cell(row[name], 8):>13}" for name in COLUMNS)
        marks = "".join(f"  {mark}" for mark in ("expected", "extrapolated") if row[mark])
        lines.append(f"{row['branch']:>8} {row['nodes']:>5} {cells}{marks}")
    lines.append("")
    if choice.model != "vacuum" and answer.folds is not None:
        lines += [*_fold_lines(answer), ""]
    if answer.jumps is not None:
        lines += [*_jump_lines(answer), ""]
    lines += _group_lines(scene, MODELS if compare else (choice.model,))
    if compare and choice.differences:
        lines += ["", *_difference_lines(choice)]
    return "\n".join(lines)


def _group_lines(scene: Scene, models: Sequence[str]) -> list[str]:
    """Dimensionless groups by some models."""
    by_model = {model: _groups(scene, model) for model in models}
    lines = [f"{'group':<8}" + "".join(f" {model:>12}" for model in models)]
    for name in by_model[models[0]]:
        if name in NO_FORCE and all(by_model[model][name] == NO_FORCE[name] for model in models):
            continue
        lines.append(f"{name:<8}" + "".join(f" {_cell(by_model[model][name]):>12}" for model in models))
    return lines


def _cable_lines(scene: Scene) -> list[str]:
    """The type of cable, and how well its laws are known."""
    if (known := scene.cable_type) is None:
        return []
    words = [f"cable {known.name}" + (f": {known.source}" if known.source else "")]
    if known.deviations:
        listed = ", ".join(f"{name.replace('_', ' ')} {value:g}" for name, value in known.deviations.items())
        words.append(f"standard deviations: {listed}")
    if known.angles_deg is not None:
        words.append("measured at {:.1f} to {:.1f} degrees to the stream".format(*known.angles_deg))
    return ["; ".join(words)]


def _difference_lines(choice: Choice) -> list[str]:
    """The comparison of the models."""
    lines = [f"{'model':<7} {'against':<7} {'in':<22} {'by it':>10} {'by larger':>10} {'unit':<4} {'differ':>8}"]
    for d in choice.differences:
        by_it, by_larger = d.values("{:.5g}")
        apart = percent(d.relative) if math.isfinite(d.relative) else "-"
        lines.append(
            f"{d.smaller:<7} {d.larger:<7} {d.quantity:<22} {by_it:>10} {by_larger:>10} {d.unit:<4} {apart:>8}"
            f"{'' if d.agrees else '  disagrees'}"
        )
    return lines


def _fold_lines(answer: SceneAnswer) -> list[str]:
    """Jumps with drag."""
    scene, folds = answer.scene, answer.folds
    assert folds is not None
    low, high = (_cell(scene.speed_of(abs(scene.gamma) * share), 4) for share in LOOKED)
    rows = _folds(answer)
    lines = [f"jumps ({answer.choice.model} model) from {low} to {high} m/s{'' if rows else ': none'}"]
    if rows:
        lines.append(f"{'gamma':>13} {'m/s':>13} {'kn':>13} {'rpm':>13}  {'shapes':>9}  made by")
    for row in rows:
        cells = " ".join(f"{_cell(row[name], 8):>13}" for name in ("gamma", "speed_m_s", "speed_kn", "rpm"))
        origin = f"vacuum, n = {row['n']}" if row["n"] else "drag"
        shapes = f"{row['shapes_below']} to {row['shapes_above']}"
        lines.append(f"{cells}  {shapes:>9}  {origin}{', within 10 % of the speed' if row['near'] else ''}")
    if not folds.complete:
        lines.append("not everywhere made out: some may be missing")
    return lines


def _jump_lines(answer: SceneAnswer) -> list[str]:
    scene, jumps = answer.scene, answer.jumps
    assert jumps is not None
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
