"""How far a scene is from trouble, for people and as JSON; what `towatlas scene` ends with."""

import argparse
import math
from typing import Any

from towatlas.commands.common import FAILED, LIMIT, OK, real, say
from towatlas.scene.edges import FlutterEdges
from towatlas.scene.jumps import LOOKED, SceneAnswer
from towatlas.scene.keys import KEYS
from towatlas.scene.margins import Cost, Hanging, Margins, NearestJump
from towatlas.scene.scene import KNOT, SPEED_KEYS, Scene
from towatlas.scene.sensitivities import Sensitivities
from towatlas.scene.units import parse_quantity, written_unit

SHAPES = ("meeting", "before", "after")
# Of the quantities of a table of sensitivities.
TITLES = {
    "jump_below": "jump below",
    "jump_above": "jump above",
    "depth": "depth",
    "tension": "tow tension",
    "largest_tension": "largest tension",
}


def margin(text: str) -> tuple[float, bool]:
    """The type of an argument that is a share, "10%", or a speed with its unit: a number, and whether it is a share."""
    share = text.strip().endswith("%")
    try:
        float(text)
    except ValueError:
        pass
    else:
        raise argparse.ArgumentTypeError(f"{text} of what? Write {text}% of the speed, or {text}kn")
    try:
        value = parse_quantity("value", text, "" if share else "m/s")
    except ValueError as error:
        problem = str(error).removeprefix("value = ")
        raise argparse.ArgumentTypeError(f"{problem}; or a share, as 10%") from None
    if value <= 0.0:
        raise argparse.ArgumentTypeError(f"{text} is not positive")
    return value, share


def distance(scene: Scene, asked: tuple[float, bool]) -> float:
    """A margin in m/s; jumps have been looked for within it on both sides."""
    value, share = asked
    widest = min(1.0 - LOOKED[0], LOOKED[1] - 1.0)
    part = value if share else value / scene.speed
    if part > widest:
        raise ValueError(
            f"--margin is {100 * part:.3g} % of the speed; jumps are looked for within {100 * widest:.3g} %"
        )
    return part * scene.speed


def judge(found: Margins, model: str, asked: float | None) -> int:
    """The exit code, and on standard error why; before it what is uncertain for nothing."""
    code = OK
    if found.idle:
        say(f"{', '.join(found.idle)}: no part of the {model} model, in which being uncertain does nothing")
    if found.scene.breaking_strength > 0.0 and math.isnan(found.largest_tension):
        say("the largest tension could not be computed: that it is below cable.breaking_strength is not known")
        code = FAILED
    elif found.breaks:
        force, unit = _units(found.scene)["N"]
        over = f"{_digits(found.largest_tension / force, 5)} {unit}"
        strength = f"{_digits(found.scene.breaking_strength / force, 5)} {unit}"
        spread = found.deviations.get("breaking_margin", 0.0)
        known = f", known to {_sd(spread, force, unit)} (1 sd)" if spread else ""
        say(f"the largest tension, {over}, is not below cable.breaking_strength, {strength}{known}")
        code = LIMIT
    if asked is None:
        return code
    for jump in found.within(asked):
        unknown = ", whose interval is not known" if math.isnan(jump.distance_deviation) else ""
        say(f"within the margin of {asked:.4g} m/s: the jump {jump.side}, {_speed(found.scene, jump.speed)}{unknown}")
        code = LIMIT
    for edge in found.edges_within(asked):
        unknown = ", whose interval is not known" if found.scene.deviations else ""
        text = f"an edge of flutter {'above' if edge.distance > 0.0 else 'below'}, {_speed(found.scene, edge.speed)}"
        say(f"within the margin of {asked:.4g} m/s: {text}{unknown}")
        code = LIMIT
    if code == OK and found.flutter is not None and not found.flutter.complete:
        say(f"that no edge of flutter is within the margin is not known: {found.flutter.failure or 'shapes were lost'}")
        return FAILED
    if code == OK and not found.complete:
        say("jumps were not everywhere made out: that none lies within the margin is not known")
        return FAILED
    return code


def as_object(found: Margins, asked: float | None, known: Sensitivities | None) -> dict[str, Any]:
    """Keys of the JSON of a scene."""
    scene = found.scene
    spread = found.deviations
    return {
        "uncertain": scene.deviations,
        "uncertain_failure": found.failure or None,
        "depth_sd_m": real(spread.get("depth", math.nan)),
        "tension_sd_N": real(spread.get("tension", math.nan)),
        "largest_tension_N": real(found.largest_tension),
        "largest_tension_at_m": real(found.at),
        "largest_tension_others_N": real(found.of_others),
        "largest_tension_sd_N": real(spread.get("largest_tension", math.nan)),
        "breaking_strength_N": real(scene.breaking_strength),
        "breaking_ratio": real(found.breaking_ratio),
        "nearest_jumps": {jump.side: _jump_object(jump) for jump in found.jumps} if found.jumps else None,
        "margin_m_s": asked,
        "flutter_edges": None if found.flutter is None else _edges_object(found.flutter),
        "margin_kept": None if asked is None else _kept(found, asked),
        "sensitivities": None if known is None else _slopes(known),
    }


def _kept(found: Margins, asked: float) -> bool | None:
    """Whether no jump and no edge of flutter is within a margin; None where not known."""
    if found.within(asked) or found.edges_within(asked):
        return False
    return (found.complete and (found.flutter is None or found.flutter.complete)) or None


def _edges_object(found: FlutterEdges) -> dict[str, Any]:
    sides = {"below": found.below, "above": found.above}
    return {
        "model": found.model,
        **{
            side: None
            if edge is None
            else {
                "speed_m_s": edge.speed,
                "speed_kn": edge.speed / KNOT,
                "distance_relative": edge.distance,
                "flutters_beyond": edge.enters,
                "frequency_Hz": real(edge.frequency),
            }
            for side, edge in sides.items()
        },
        "followed_from_m_s": real(found.low),
        "followed_to_m_s": real(found.high),
        "complete": found.complete,
        "failure": found.failure or None,
    }


def _jump_object(jump: NearestJump) -> dict[str, Any] | None:
    if not jump.exists:
        return None
    return {
        "speed_m_s": jump.speed,
        "speed_kn": jump.speed / KNOT,
        "distance_relative": jump.distance,
        "speed_sd_m_s": real(jump.deviation),
        "distance_sd_m_s": real(jump.distance_deviation),
        "may_be_passed": jump.may_be_passed,
        "pair_ends": None if jump.cost is None else jump.cost.ends,
        "expected_shape": None if jump.cost is None else jump.cost.expected,
        **{name: None if jump.cost is None else _shape(getattr(jump.cost, name)) for name in SHAPES},
        "failure": jump.failure or None,
    }


def _shape(shape: Hanging) -> dict[str, Any]:
    return {"nodes": shape.nodes, "depth_m": shape.depth, "r_f_m": shape.radius, "tension_N": shape.tension}


def _slopes(known: Sensitivities) -> list[dict[str, Any]]:
    quantities = [one for one in known.quantities if one.name in TITLES]
    shares = {one.name: known.elasticities(one) for one in quantities}
    return [
        {
            "key": key,
            "unit": _unit_of(key),
            "value": float(known.values[k]),
            "sd": float(known.deviations[k]),
            **{
                one.name: {
                    "percent_per_percent": real(shares[one.name][k]),
                    "per_unit": real(one.slopes[k]),
                    "unit": one.unit,
                }
                for one in quantities
            },
        }
        for k, key in enumerate(known.keys)
    ]


def _unit_of(key: str) -> str:
    section, _, name = key.rpartition(".")
    unit = KEYS[section][name]
    assert isinstance(unit, str)
    return unit


def slope_lines(known: Sensitivities) -> list[str]:
    """The table of sensitivities."""
    quantities = [one for one in known.quantities if one.name in TITLES]
    lines = ["sensitivities: percent per percent of each key, and in SI per unit of it"]
    width = max(len(key) for key in known.keys)
    titles = " ".join(f"{TITLES[one.name] + ' ' + one.unit:>21}" for one in quantities)
    lines.append(f"{'key':<{width}} {'value':>11} {'sd':>9} {'unit':<6} {titles}")
    for k, row in enumerate(_slopes(known)):
        cells = []
        for one in quantities:
            share, slope = (row[one.name][name] for name in ("percent_per_percent", "per_unit"))
            cells.append(f"{_number(share, '+.3g'):>10} {_number(slope, '+.3g'):>10}")
        spread = f"{row['sd']:.3g}" if row["sd"] else "-"
        lines.append(
            f"{known.keys[k]:<{width}} {row['value']:>11.5g} {spread:>9} {row['unit'] or '-':<6} {' '.join(cells)}"
        )
    return lines


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"


def lines_of(found: Margins, answer: SceneAnswer) -> list[str]:
    """The last lines: what pulls hardest, and the nearest jumps."""
    scene, spread, units = found.scene, found.deviations, _units(found.scene)
    lines = []
    if found.failure:
        lines.append(
            f"what the uncertainty of {', '.join(scene.deviations)} does could not be computed: {found.failure}"
        )
    elif spread and len(found.idle) < len(scene.deviations):
        k = answer.equilibria.expected
        depth = float(answer.equilibria.z_f[k]) * scene.radius
        counted = [key for key in scene.deviations if key not in found.idle]
        lines.append(
            f"expected shape, +- 1 sd of {', '.join(counted)} to first order: depth "
            f"{_amount(depth, 'm', units, spread['depth'])}, tow tension "
            f"{_amount(answer.choice.answer.tension, 'N', units, spread['tension'])}"
        )
    if math.isnan(found.largest_tension):
        lines.append("largest tension along the cable, expected shape: not computed")
    else:
        place = "at the tow point" if found.at == 0.0 else f"{_amount(found.at, 'm', units)} from the tow point"
        strength = scene.breaking_strength

        def ratio(pull: float) -> str:
            return f", {100 * pull / strength:.3g} % of cable.breaking_strength" if strength > 0.0 else ""

        pull = _amount(found.largest_tension, "N", units, spread.get("largest_tension", 0.0))
        others = ""
        if found.of_others > 0.0:
            others = f"; in other shapes up to {_amount(found.of_others, 'N', units)}{ratio(found.of_others)}"
        share = ratio(found.largest_tension)
        lines.append(f"largest tension along the cable, expected shape: {pull} {place}{share}{others}")
    if found.flutter is not None:
        lines.append(_edge_line(found.flutter, scene))
    lines += [_jump_line(jump, found, answer.choice.model, units) for jump in found.jumps]
    if not found.complete:
        lines.append("jumps were not everywhere made out: others may lie between")
    return lines


def _edge_line(found: FlutterEdges, scene: Scene) -> str:
    start = f"edges of flutter of the expected shape ({found.model} model):"
    if math.isnan(found.low):
        return f"{start} not known: {found.failure}"
    parts = []
    for side, edge, end in (("below", found.below, found.low), ("above", found.above, found.high)):
        if edge is None:
            parts.append(f"none {'down' if side == 'below' else 'up'} to {end:.4g} m/s")
            continue
        verb = "begins to flutter" if edge.enters else "ceases to flutter"
        where = f"{_speed(scene, edge.speed)} ({_percent(edge.distance)})"
        parts.append(f"{side} {where}, where it {verb}, at {edge.frequency:.3g} Hz")
    return f"{start} {'; '.join(parts)}{f'; not certain: {found.failure}' if found.failure else ''}"


def _jump_line(jump: NearestJump, found: Margins, model: str, units: dict[str, tuple[float, str]]) -> str:
    start = f"nearest jump {jump.side} ({model} model):"
    if not jump.exists:
        return f"{start} none {'down' if jump.side == 'below' else 'up'} to {jump.looked:.4g} m/s"
    text = f"{start} {_speed(found.scene, jump.speed)} ({_percent(jump.distance)})"
    if jump.deviation != 0.0 or jump.distance_deviation != 0.0:
        text += f" +- {_sd(jump.deviation, 1.0, 'm/s')}"
    if jump.may_be_passed:
        text += ", so near for what is known of the scene that it may be passed already"
    if jump.cost is None:
        return f"{text}; what it costs could not be computed: {jump.failure}"
    return f"{text}; {_cost(jump.cost, units)}"


def _cost(cost: Cost, units: dict[str, tuple[float, str]]) -> str:
    meeting, before, after = (_words(getattr(cost, name), units) for name in SHAPES)
    if cost.expected == "lost":
        return f"there the expected shape ({before}) ends, and may land on the one expected beyond ({after})"
    if cost.expected == "overtaken":
        return (
            f"there two shapes begin ({after}), one of them expected beyond; the one expected before ({before}) goes on"
        )
    if cost.ends:
        return f"there two other shapes ({meeting}) end, and may land on the expected one ({after}), which goes on"
    return f"there two other shapes ({meeting}) begin; the expected one ({before}) goes on"


def _words(shape: Hanging, units: dict[str, tuple[float, str]]) -> str:
    nodes = f"{shape.nodes} node{'' if shape.nodes == 1 else 's'}"
    return (
        f"{nodes}, fish {_amount(shape.depth, 'm', units)} deep and {_amount(shape.radius, 'm', units)} from the axis, "
        f"{_amount(shape.tension, 'N', units)} at the tow point"
    )


def _units(scene: Scene) -> dict[str, tuple[float, str]]:
    """Units of the user for lengths and forces, with their sizes in SI."""
    wanted = {"m": ("cable.length", "tow.radius"), "N": ("cable.breaking_strength", "fish.submerged_weight")}
    units = {}
    for unit, keys in wanted.items():
        text = next((scene.given[key] for key in keys if key in scene.given), unit)
        name = written_unit(text) or unit
        units[unit] = (parse_quantity(unit, f"1 {name}", unit), name)
    return units


def _amount(value: float, unit: str, units: dict[str, tuple[float, str]], spread: float = 0.0) -> str:
    size, name = units[unit]
    return f"{_digits(value / size, 4)} {name}" + (f" +- {_sd(spread, size, name)}" if spread else "")


def _sd(spread: float, size: float, name: str) -> str:
    return "unknown" if math.isnan(spread) else f"{_digits(spread / size, 2)} {name}"


def _percent(share: float) -> str:
    return f"{'+' if share > 0.0 else ''}{_digits(100.0 * share, 2)} %"


def _digits(value: float, digits: int) -> str:
    """So many digits that count, without an exponent where it can be."""
    return f"{float(f'{value:.{digits}g}'):g}"


def _speed(scene: Scene, speed: float) -> str:
    """A speed in m/s, knots and the unit of the user."""
    words = [f"{speed:.5g} m/s", f"{speed / KNOT:.5g} kn"]
    key = next((key for key in SPEED_KEYS if key in scene.given), "")
    name = written_unit(scene.given.get(key, ""))
    if key == "tow.speed" and name not in ("m/s", "kn"):
        words.append(f"{speed / parse_quantity(key, f'1 {name}', 'm/s'):.5g} {name}")
    elif key == "tow.rpm":
        words.append(f"{scene.rpm_of(speed / scene.speed_of(1.0)):.5g} rpm")
    return ", ".join(words)
