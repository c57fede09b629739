"""Steady circles by MoorDyn, lumped masses in the time domain; optional (`pip install '.[peers]'`)."""

import importlib.util
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import towatlas
from benchmarks.timing import Row, once
from towatlas.exports.moordyn import STATE, STIFF, Towed, chain_nodes, deck_text, state_bytes, turned
from towatlas.system import System

# Of unit tow radius, and of a unit mass of cable per unit length, added mass included; a density at will.
GRAVITY, DENSITY = 9.80665, 1000.0
COUPLINGS = 1000  # steps of the tow point a turn, straight each
TURNS = 3
# Fig. 3 of NRL Report 7048, a cable in air and one in water of the sample.
SYSTEMS = {
    "Fig. 3": (System(37.8, 1352, 1352, C=0.018), 2.97),
    "air": (System(18.2, 95.5, 95.5, C=4.41), 1.16),
    "water": (System(3.07, 0.0231, 0.0310, C=16.9, w=0.522), 0.258),
}

Array = np.ndarray


def missing() -> bool:
    """Whether it is not installed."""
    return importlib.util.find_spec("moordyn") is None


@contextmanager
def silent() -> Iterator[None]:
    """It writes every step to the terminal, past Python."""
    kept, nowhere = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    sys.stdout.flush()
    try:
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
        yield
    finally:
        for target, old in zip((1, 2), kept, strict=True):
            os.dup2(old, target)
            os.close(old)
        os.close(nowhere)


def _start(system: System, gamma: float, segments: int) -> tuple[Towed, Array, float, float]:
    """The problem as MoorDyn takes it, nodes along the shape that the equations have, axial stiffness, r_f."""
    towed = Towed(system, 1.0, 1.0, GRAVITY, DENSITY)
    found = towatlas.equilibria(
        system.lam, system.w_f, gamma, m_f=system.m_f, C=system.C, C_f=system.C_f, w=system.w, C_t=system.C_t
    )
    shape = towatlas.shape_of(found, found.expected, np.linspace(0.0, system.lam, segments + 1))
    places = np.stack([shape["x"].values, -shape["y"].values, -shape["z"].values - towed.depth], axis=1)
    tension = GRAVITY * shape["T"].values
    stiffness = STIFF * float(tension.max())
    nodes = chain_nodes(places, tension, system.lam / segments, stiffness)
    return towed, nodes, stiffness, float(found.r_f[found.expected])


def steady(system: System, gamma: float, segments: int, turns: int = TURNS) -> tuple[float, float]:
    """Relative error of r_f, its mean over the last turn, and the seconds of the march."""
    import moordyn

    towed, nodes, stiffness, exact = _start(system, gamma, segments)
    speed = gamma * np.sqrt(GRAVITY)
    dt = 2.0 * np.pi / speed / COUPLINGS
    angle = -2.0 * np.pi / COUPLINGS * np.arange(turns * COUPLINGS + 1)
    path = np.stack([np.cos(angle), np.sin(angle), np.full(len(angle), -towed.depth)], axis=1)
    pace = (np.diff(path, axis=0) / dt).tolist()
    radii = np.empty(len(pace))
    with tempfile.TemporaryDirectory() as folder, silent():
        (Path(folder) / STATE).write_bytes(state_bytes(nodes, turned(nodes, speed)))
        deck = Path(folder) / "deck"
        deck.write_text(deck_text(towed, nodes, stiffness))
        chain = moordyn.Create(str(deck))
        try:
            moordyn.Init_NoIC(chain, path[0].tolist(), pace[0])
            fish = moordyn.GetPoint(chain, 2)

            def march() -> None:
                for k, (place, velocity) in enumerate(zip(path[:-1].tolist(), pace, strict=True)):
                    moordyn.Step(chain, place, velocity, k * dt, dt)
                    radii[k] = np.hypot(*moordyn.GetPointPos(fish)[:2])

            spent = once(march)
        finally:
            moordyn.Close(chain)
    return abs(float(radii[-COUPLINGS:].mean()) / exact - 1.0), spent


def rows(segments: tuple[int, ...] = (20, 40, 80)) -> list[Row]:
    """The systems of this module; the equilibrium nearest to the axis of each."""
    found = []
    for count in segments:
        runs = [steady(system, gamma, count) for system, gamma in SYSTEMS.values()]
        errors, spent = map(np.array, zip(*runs, strict=True))
        setting = f"{count} segments, {TURNS} turns"
        found.append(Row("MoorDyn", setting, len(runs), {"r_f": errors}, float(spent.mean()) * 1e6))
    return found
