"""What is seen of a scene as its speed or its length rises and falls, for people and as JSON."""

from itertools import groupby
from typing import Any

from towatlas.commands.common import real
from towatlas.scene.diagrams import UNITS, SceneDiagram
from towatlas.solve.seen import LASTING, Jump, Stretch


def lines_of(found: SceneDiagram) -> list[str]:
    """A sentence for each way."""
    low, high = (f"{_value(found, end)} {found.unit}" for end in (found.low, found.high))
    rising, falling = found.rising(), found.falling()
    model = f" ({found.model} model)"
    lines = [f"as the {found.moved} rises from {low} to {high}{model}: {_sentence(found, rising, True)}"]
    if falling == rising[::-1]:
        lines.append(f"as it falls back to {low}: the same, the other way round")
    else:
        lines.append(f"as it falls back to {low}: {_sentence(found, falling, False)}")
    return lines if found.complete else [*lines, "not everywhere made out or counted: some may be missing"]


def as_object(found: SceneDiagram) -> dict[str, Any]:
    """The same for JSON."""
    return {
        "model": found.model,
        "moved": found.moved,
        f"low_{_key(found)}": found.low,
        f"high_{_key(found)}": found.high,
        "rising": [_object(found, part) for part in found.rising()],
        "falling": [_object(found, part) for part in found.falling()],
        "complete": found.complete,
        "looked_at": found.looked_at,
    }


def _key(found: SceneDiagram) -> str:
    return UNITS[found.moved].replace("/", "_")


def _object(found: SceneDiagram, part: Stretch | Jump) -> dict[str, Any]:
    if isinstance(part, Jump):
        return {"kind": "jump", f"at_{_key(found)}": part.value, "lands": part.end >= 0}
    return {
        "kind": part.kind,
        f"from_{_key(found)}": part.low,
        f"to_{_key(found)}": part.high,
        "nodes_least": part.nodes[0],
        "nodes_most": part.nodes[1],
        "growth_1_s": real(part.growth),
        "frequency_Hz": real(part.frequency),
    }


def _sentence(found: SceneDiagram, parts: list[Stretch | Jump], rising: bool) -> str:
    words: list[str] = []
    groups = [list(group) for _, group in groupby(parts, key=_group)]
    for group, after in zip(groups, [*groups[1:], None], strict=True):
        if isinstance(group[0], Jump):
            beyond = "" if after else ", beyond which no shape is known to last"
            words.append(f"a jump at {_value(found, group[0].value)}{beyond}")
            continue
        stretches = [part for part in group if isinstance(part, Stretch)]
        ends = stretches[0], stretches[-1]
        begin, end = (ends[0].low, ends[1].high) if rising else (ends[0].high, ends[1].low)
        start = f"{_value(found, begin)} " if words else ""
        span = f"{start}to {_value(found, end)}" if after else f"from {_value(found, begin)} on"
        span = span if after or words else "throughout"
        words.append(f"{_what(stretches)} {span}{_weakly(found, stretches)}")
    return "; ".join(words)


def _group(part: Stretch | Jump) -> tuple[str, float]:
    """What is told together: shapes that last, of one branch."""
    if isinstance(part, Jump):
        return "jump", part.value
    return ("lasts" if part.kind in LASTING else part.kind), part.branch


def _what(group: list[Stretch]) -> str:
    low, high = min(part.nodes[0] for part in group), max(part.nodes[1] for part in group)
    kind = group[0].kind
    if kind == "flutter":
        worst = max(group, key=lambda part: part.growth)
        span = f"about {_nodes(low)}" if low == high else f"between {_nodes(low)} and {_nodes(high)}"
        return f"flutter {span}, e times larger in {_time(worst)} at {worst.frequency:.3g} Hz,"
    text = _nodes(low) if low == high else f"{_nodes(low)} to {_nodes(high)},"
    return f"{text} (whether it lasts is not known)" if kind == "unknown" else text


def _weakly(found: SceneDiagram, group: list[Stretch]) -> str:
    """Where pendulum modes grow slowly."""
    weak = [part for part in group if part.kind == "weak"]
    if not weak:
        return ""
    fastest = max(weak, key=lambda part: part.growth)
    spans = " and ".join(f"{_value(found, part.low)} to {_value(found, part.high)}" for part in weak)
    where = "throughout" if len(weak) == len(group) else spans
    return f" (growing weakly {where}, e times in {_time(fastest)} or more)"


def _nodes(count: int) -> str:
    names = ("no node", "one node", "two nodes", "three nodes")
    return names[count] if count < len(names) else f"{count} nodes"


def _time(part: Stretch) -> str:
    return f"{1.0 / part.growth:.3g} s" if part.growth > 0.0 else "no time known"


def _value(found: SceneDiagram, value: float) -> str:
    return f"{value / found.size:.4g}"
