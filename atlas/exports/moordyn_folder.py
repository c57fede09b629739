"""A folder from which MoorDyn v2 tows one shape of a scene on: deck, state, driver and what they are."""

import os
from importlib import resources
from math import atan2, ceil, copysign, degrees, hypot, pi, sqrt
from pathlib import Path
from string import Template

import numpy as np
from numpy.typing import NDArray

from towatlas.exports.moordyn import (
    DAMPING,
    PACE,
    STAND_IN,
    STATE,
    STIFF,
    Towed,
    chain_nodes,
    deck_text,
    state_bytes,
    turned,
)
from towatlas.scene.jumps import SceneAnswer

SEGMENTS = 40
# Of track.csv, a turn.
ROWS = 1000
MOST_SEGMENTS = 10_000
DECK, DRIVER, README = "deck.txt", "drive.py", "README.md"
Array = NDArray[np.float64]
Facts = dict[str, str]


def check_folder(folder: Path) -> None:
    """A folder that is empty, or can be made.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    OSError
        For a file, one with something in it, and one that cannot be written to.
    """
    if folder.exists() and not folder.is_dir():
        raise FileExistsError(f"{folder} is a file: name a folder that is empty or does not exist")
    if folder.exists() and any(folder.iterdir()):
        raise FileExistsError(f"{folder} is not empty, and nothing is written over: name another folder")
    there = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    if not there.is_dir() or not os.access(there, os.W_OK):
        raise PermissionError(f"{folder} cannot be made: {there} is no folder that can be written to")


def write_moordyn(answer: SceneAnswer, folder: Path, root: str | int = "expected", segments: int = SEGMENTS) -> None:
    """Write what MoorDyn v2 needs to tow one shape of a scene on.

    Parameters
    ----------
    answer : SceneAnswer
    folder : Path
        Empty, or made.
    root : str or int
        Which shape, as of `SceneAnswer.shape`.
    segments : int
        Of the chain, 2 to 10,000; its shapes and tensions are off by a share that falls with its square.

    Raises
    ------
    ValueError
        For a root that does not exist, segments out of range, and a model with side force, which MoorDyn has not.
    ArithmeticError
        If the shape cannot be computed.
    OSError
        As of `check_folder`.

    Examples
    --------
    >>> import tempfile
    >>> from towatlas import answer_scene, read_scene
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_moordyn(answer_scene(read_scene("skop-fig3"), model="air"), Path(folder), segments=20)
    ...     sorted(path.name for path in Path(folder).iterdir())
    ['README.md', 'deck.txt', 'drive.py', 'state.bin']
    """
    if not 2 <= segments <= MOST_SEGMENTS:
        raise ValueError(f"segments must be 2 to {MOST_SEGMENTS:,}, got {segments}")
    towed = towed_of(answer)
    # With the middle of the first segment, where MoorDyn has the tension that it gives for the tow point.
    curve = answer.shape(root, np.linspace(0.0, answer.scene.length, 2 * segments + 1))
    positions = np.stack([curve["x"].values, -curve["y"].values, -curve["z"].values - towed.depth], axis=1)
    tensions = curve["T"].values
    stiffness = STIFF * float(tensions.max())
    nodes = chain_nodes(positions[::2], tensions[::2], towed.length / segments, stiffness)
    rate = answer.equilibria.gamma * sqrt(towed.gravity / towed.radius)
    facts = _scene_facts(answer, curve.attrs["branch"]) | _chain_facts(towed, segments, stiffness, rate)
    facts |= _fish_facts(positions[-1] + [0.0, 0.0, towed.depth], rate, tensions)
    check_folder(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / DECK).write_text(deck_text(towed, nodes, stiffness), encoding="utf-8")
    (folder / STATE).write_bytes(state_bytes(nodes, turned(nodes, rate)))
    for name, template in ((DRIVER, "moordyn_drive.txt"), (README, "moordyn_readme.txt")):
        text = (resources.files("towatlas.exports") / template).read_text(encoding="utf-8")
        (folder / name).write_text(Template(text).substitute(facts), encoding="utf-8")


def _scene_facts(answer: SceneAnswer, branch: str) -> Facts:
    scene = answer.scene
    return {
        "title": scene.title or scene.source,
        "branch": branch,
        "model": answer.choice.model,
        "speed": f"{scene.speed:.6g}",
        "turn": scene.turn,
    }


def _chain_facts(towed: Towed, segments: int, stiffness: float, rate: float) -> Facts:
    step = towed.step(segments, stiffness)
    return {
        "deck": DECK,
        "state": STATE,
        "radius": repr(towed.radius),
        # Clockwise from above is negative about an axis that points up.
        "rate": repr(-rate),
        "depth": repr(towed.depth),
        "rows": str(ROWS),
        "every": str(ceil(2.0 * pi / (abs(rate) * ROWS * step))),
        "segments": str(segments),
        "step": f"{step:.4g}",
        "stiffness": f"{stiffness:.6g}",
        "stiff": f"{STIFF:g}",
        "damping": f"{DAMPING:g}",
        "pace": f"{PACE:g}",
        "density": f"{towed.density:.6g}",
    }


def _fish_facts(fish: Array, rate: float, tensions: Array) -> Facts:
    behind = degrees(atan2(fish[1], fish[0])) * copysign(1.0, rate) % 360.0
    return {
        "fish_radius": f"{hypot(fish[0], fish[1]):.6g}",
        "fish_depth": f"{-fish[2]:.6g}",
        "fish_behind": f"{behind:.4f}",
        "tension": f"{tensions[1]:.6g}",
        "tow_tension": f"{tensions[0]:.6g}",
        "largest": f"{tensions.max():.6g}",
    }


def towed_of(answer: SceneAnswer) -> Towed:
    """The scene by the model used, as MoorDyn takes it.

    Parameters
    ----------
    answer : SceneAnswer

    Returns
    -------
    Towed

    Raises
    ------
    ValueError
        For side force.
    """
    scene, model = answer.scene, answer.choice.model
    return Towed(
        system=answer.equilibria.system,
        unit=scene.mass_unit(model),
        radius=scene.radius,
        gravity=scene.gravity,
        density=scene.density or STAND_IN,
        displaced=scene.fish_displaced,
    )
