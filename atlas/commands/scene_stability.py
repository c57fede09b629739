"""Which shapes of a scene last: the lines and the keys that `towatlas scene --stability` adds."""

import math
from typing import Any

from towatlas.commands.common import real
from towatlas.kernels import status
from towatlas.results_motion import Stability
from towatlas.scene.jumps import SceneAnswer

WORDS = {
    "stable": "stable",
    "divergence": "left without turning back",
    "flutter": "flutters",
    "weak": "grows weakly",
    "unknown": "not counted",
}


def stability_of_scene(answer: SceneAnswer) -> Stability:
    """Growth rates of the shapes of the model used."""
    from towatlas.solve.stability import stability_of

    return stability_of(answer.equilibria)


def lines_of(found: Stability, answer: SceneAnswer) -> list[str]:
    """A line for each shape, in the order of the table."""
    unit = _rate(answer)
    lines = ["which shapes last:"]
    for k, branch in enumerate(found.equilibria.branch):
        text = f"  {branch}{', expected' if k == found.equilibria.expected else ''}: {WORDS[str(found.kind[k])]}"
        growth, frequency = found.growth[k] * unit, found.frequency[k] * unit / (2.0 * math.pi)
        if math.isfinite(growth):
            turning = f" at {frequency:.4g} Hz" if frequency else ""
            if growth:
                text += f", e times {'larger' if growth > 0.0 else 'smaller'} in {1.0 / abs(growth):.4g} s{turning}"
        if found.status[k] != status.OK:
            text += f" ({found.sentence(k)})"
        lines.append(text)
    return [*lines, f"  looked at: {found.looked_at.replace('eigenvalues', 'eigenvalues, over sqrt(g/R),')}"]


def as_object(found: Stability | None, answer: SceneAnswer) -> dict[str, Any]:
    """The key of the JSON of a scene: a list in the order of its equilibria, null where not asked for."""
    if found is None:
        return {"stability": None}
    unit = _rate(answer)
    rows = []
    for k, branch in enumerate(found.equilibria.branch):
        rows.append(
            {
                "branch": str(branch),
                "kind": str(found.kind[k]),
                "unstable": int(found.unstable[k]) if found.unstable[k] >= 0 else None,
                "growth_1_s": real(found.growth[k] * unit),
                "frequency_Hz": real(found.frequency[k] * unit / (2.0 * math.pi)),
                "error_1_s": real(found.error[k] * unit),
                "status": status.FLAG_MEANINGS.split()[int(found.status[k])],
            }
        )
    return {"stability": rows}


def _rate(answer: SceneAnswer) -> float:
    """sqrt(g/R) [1/s]."""
    return math.sqrt(answer.scene.gravity / answer.scene.radius)
