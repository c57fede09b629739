"""`towatlas design` for a range of speeds."""

import argparse
from typing import Any

import numpy as np

from towatlas.commands.common import FAILED, NO_STATE, OK, print_json, real, say
from towatlas.commands.quantities import ends_of, quantity
from towatlas.commands.scene import scene_of
from towatlas.commands.scene_stability import verdict_object
from towatlas.scene.designs import UNITS
from towatlas.scene.ranges import POINTS, KeptCable, RangeDesign, design_over
from towatlas.scene.scene import KNOT
from towatlas.scene.units import parse_quantity

Speeds = float | tuple[float, float]


def speeds(text: str) -> Speeds:
    """The type of an argument that is one speed, or two with a colon between them."""
    one = quantity("m/s")
    if ":" not in text:
        return float(one(text))
    try:
        parts = ends_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"{text} is no range of speeds, as 3kn:5kn")
    low, high = (float(one(part)) for part in parts)
    if not low < high:
        raise argparse.ArgumentTypeError(f"{text}: the lower speed first, and a higher one")
    return low, high


def tolerance(text: str, wanted: str, value: float) -> float:
    """What --within allows, in SI: a share of the value wanted, or a length or force."""
    share = text.strip().endswith("%")
    unit = UNITS[wanted]
    try:
        given: float | str = float(text)
    except ValueError:
        given = text
    number = parse_quantity("--within", given, "" if share else unit) * (value if share else 1.0)
    if number <= 0.0:
        raise ValueError(f"--within {text} is not positive")
    return number


def run(options: argparse.Namespace, limits: dict[str, Any]) -> int:
    """Answer; returns the exit code."""
    low, high = options.speed
    options.speed = None
    scene = scene_of(options.scene, options)
    points = POINTS if options.points is None else options.points
    wanted = next(name for name in UNITS if limits[name] is not None)
    allowed = None if options.within is None else tolerance(options.within, wanted, limits[wanted])
    found = design_over(scene, low, high, points=points, model=options.model, stable_only=options.stable_only, **limits)
    kept = [
        cable
        for cable in found.cables
        if (allowed is None or cable.off <= allowed)
        and all(cable.spans[name][1] <= limits[f"max_{name}"] for name in ("radius", "tension"))
    ]
    reason = None if kept else _reason(found, allowed)
    if options.json:
        print_json(_object(found, kept, allowed, reason))
    else:
        print(_text(found, kept))
    for note in found.notes:
        say(note)
    if not found.complete:
        say("not everywhere made out: cables or jumps may be missing")
    if reason:
        say(reason)
        return NO_STATE if found.complete else FAILED
    return OK


def _reason(found: RangeDesign, allowed: float | None) -> str:
    unit = UNITS[found.quantity]
    if not found.cables and any(cable.expected for one in found.designs for cable in one.chosen):
        return (
            f"no cable up to {_longest(found):.4g} m that does at one of the {len(found.speeds)} speeds is known to "
            "last over the range in the shape expected"
        )
    if not found.cables:
        return (
            f"no cable up to {_longest(found):.4g} m has a {found.quantity} of {found.value:.6g} {unit} in the shape "
            f"expected at any of the {len(found.speeds)} speeds; towatlas design --speed lists the other shapes of one"
        )
    best = min(found.cables, key=lambda cable: cable.off)
    about = "" if allowed is None else f" the {found.quantity} within {allowed:.4g} {unit} of {found.value:.6g} {unit}"
    return (
        f"no length keeps{about or ' within the limits'} over the range: nearest comes {best.length:.6g} m, within "
        f"{best.off:.4g} {unit}, with the fish up to {best.spans['radius'][1]:.4g} m from the axis and up to "
        f"{best.spans['tension'][1]:.5g} N at the tow point"
    )


def _longest(found: RangeDesign) -> float:
    return max(one.longest for one in found.designs)


def _object(found: RangeDesign, kept: list[KeptCable], allowed: float | None, reason: str | None) -> dict[str, Any]:
    return {
        "file": found.scene.source,
        "model": found.model,
        "wanted": found.quantity,
        f"{found.quantity}_{UNITS[found.quantity]}": found.value,
        "within": allowed,
        "longest_searched_m": _longest(found),
        "complete": found.complete,
        "speeds": [
            {
                "speed_m_s": float(speed),
                "speed_kn": float(speed) / KNOT,
                "complete": one.complete,
                "cables": [
                    {
                        "length_m": cable.length,
                        "expected": cable.expected,
                        "nodes": cable.nodes,
                        "z_f_m": float(cable.position[2]),
                        "r_f_m": cable.radius,
                        "tension_N": cable.tension,
                        "stability": None if cable.verdict is None else verdict_object(cable.verdict),
                    }
                    for cable in one.chosen
                ],
            }
            for speed, one in zip(found.speeds, found.designs, strict=True)
        ],
        "kept": [
            {
                "length_m": cable.length,
                "found_at_m_s": list(cable.speeds),
                **{
                    f"{end}_{name}_{UNITS[name]}": span[k]
                    for name, span in cable.spans.items()
                    for k, end in enumerate(("least", "most"))
                },
                "off": real(cable.off),
                "jumps": [
                    {"speed_m_s": float(speed), "speed_kn": float(speed) / KNOT, "other_expected_beyond": bool(other)}
                    for speed, other in zip(cable.jumps, cable.other_beyond, strict=True)
                ],
                "jumps_complete": cable.complete,
                "kinds": list(cable.kinds) or None,
            }
            for cable in kept
        ],
        "reason": reason,
        "notes": found.notes,
    }


def _text(found: RangeDesign, kept: list[KeptCable]) -> str:
    unit = UNITS[found.quantity]
    low, high = found.speeds[[0, -1]]
    lines = [
        found.scene.title or found.scene.source,
        f"speeds: {low:.5g} to {high:.5g} m/s, {low / KNOT:.5g} to {high / KNOT:.5g} kn",
        f"{found.quantity} of {found.value:.6g} {unit}, cables up to {_longest(found):.4g} m, {found.model} model",
        "",
        "lengths that do, at each speed",
        f"{'m/s':>9} {'kn':>9} {'length m':>13} {'nodes':>5} {'depth m':>11} {'radius m':>11} {'tension N':>11}",
    ]
    for speed, one in zip(found.speeds, found.designs, strict=True):
        start = f"{speed:>9.5g} {speed / KNOT:>9.5g}"
        lines += [
            f"{start} {cable.length:>13.8g} {cable.nodes:>5} {cable.position[2]:>11.5g} {cable.radius:>11.5g} "
            f"{cable.tension:>11.5g}{'  expected' if cable.expected else ''}"
            for cable in one.chosen
        ] or [f"{start} {'none':>13}"]
    if not kept:
        return "\n".join(lines)
    lines += [
        "",
        "one length over the whole range, in the shape expected: least and most",
        f"{'length m':>13} {'for kn':>9} {'depth m':>19} {'radius m':>19} {'tension N':>19} {'off ' + unit:>9}  jumps",
    ]
    for cable in kept:
        spans = " ".join(f"{low:>9.4g} {high:>9.4g}" for low, high in cable.spans.values())
        at = f"{cable.speeds[0] / KNOT:.5g}" if cable.speeds else "between"
        lines.append(f"{cable.length:>13.8g} {at:>9} {spans} {cable.off:>9.4g}  {_jumps(cable)}")
    best = min(kept, key=lambda cable: cable.off)
    lines += [
        "",
        f"nearest: {best.length:.6g} m keeps the {found.quantity} within {best.off:.4g} {unit} of "
        f"{found.value:.6g} {unit}{_warning(best)}",
    ]
    return "\n".join(lines)


def _jumps(cable: KeptCable) -> str:
    words = [
        f"{speed / KNOT:.5g} kn{' *' if other else ''}"
        for speed, other in zip(cable.jumps, cable.other_beyond, strict=True)
    ]
    return ", ".join(words) or "none"


def _warning(cable: KeptCable) -> str:
    """What is said of jumps inside the range."""
    if not len(cable.jumps):
        return ", without a jump in the range" if cable.complete else "; not all jumps were made out"
    where = ", ".join(f"{speed:.5g} m/s, {speed / KNOT:.5g} kn" for speed in cable.jumps[cable.other_beyond])
    if where:
        return f"; but a jump lies in the range: at {where} another shape is expected beyond"
    return f"; {np.size(cable.jumps)} jumps of other shapes lie in the range"
