"""Which shapes of a scene last, for people and as JSON."""

from typing import Any

from towatlas.commands.common import real
from towatlas.kernels import status
from towatlas.scene.jumps import SceneAnswer
from towatlas.scene.verdicts import Verdict, Verdicts


def lines_of(found: Verdicts, answer: SceneAnswer) -> list[str]:
    """A line for each shape, in the order of the table."""
    shapes, model = answer.equilibria, answer.choice.model
    lines = [f"which shapes last ({model} model):"]
    for k, (branch, verdict) in enumerate(zip(shapes.branch, found.shapes, strict=True)):
        lines.append(f"  {branch}{', expected' if k == shapes.expected else ''}: {verdict.words}")
    for larger, verdict in found.by_larger.items():
        if verdict.kind != found.shapes[shapes.expected].kind:
            lines.append(f"  but by the {larger} model the shape expected: {verdict.words}")
    if model == "vacuum" and answer.scene.density and not found.by_larger:
        lines.append("  nothing damps in the vacuum model: in the fluid others may last; --model names a larger one")
    return [*lines, f"  looked at: {found.looked_at.replace('eigenvalues', 'eigenvalues, over sqrt(g/R),')}"]


def as_object(found: Verdicts, answer: SceneAnswer) -> dict[str, Any]:
    """Keys of the JSON of a scene: a list in the order of its equilibria, and the shape expected by larger models."""
    rows = zip(answer.equilibria.branch, found.shapes, strict=True)
    return {
        "stability": [{"branch": str(branch)} | verdict_object(verdict) for branch, verdict in rows],
        "stability_by_larger": {model: verdict_object(verdict) for model, verdict in found.by_larger.items()},
    }


def verdict_object(verdict: Verdict) -> dict[str, Any]:
    """What becomes of one shape."""
    return {
        "kind": verdict.kind,
        "unstable": verdict.unstable if verdict.unstable >= 0 else None,
        "growth_1_s": real(verdict.growth),
        "frequency_Hz": real(verdict.frequency),
        "error_1_s": real(verdict.error),
        "status": status.FLAG_MEANINGS.split()[verdict.code],
        "reason": verdict.reason or None,
    }
