"""Steady circles by MoorDyn, lumped masses in the time domain; optional (`pip install '.[peers]'`)."""

import importlib.util
import os
import struct
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import towatlas
from benchmarks.timing import Row, once
from towatlas.system import System

# Of unit tow radius, and of a unit mass of cable per unit length, added mass included. A density at will: so little of
# it is displaced, by a thin cable of much drag, that its weight is w = 1.
GRAVITY, DENSITY, THIN = 9.80665, 1000.0, 1e-6
# MoorDyn drops buoyancy and drag above the water without a word.
DEPTH = 1000.0
# Axial stiffness over the tension at the tow point: a strain of 1e-5, which the other methods do not have.
STIFF = 1e5
COUPLINGS = 1000  # steps of the tow point a turn, straight each
TURNS = 3
STATE = "state"
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


def _deck(system: System, stiffness: float, nodes: Array) -> str:
    """An input file; nodes are positions from the tow point to the fish."""
    displaced = 0.5 * (1.0 - system.w)
    diameter = THIN if system.w == 1.0 else np.sqrt(4.0 * displaced / (np.pi * DENSITY))
    normal, axial = 2.0 * system.C / (DENSITY * diameter), 2.0 * system.C_t / (np.pi * DENSITY * diameter)
    # Half of what the mass of the fish exceeds its weight by is displaced water, half added mass.
    volume = 0.5 * (system.m_f - system.w_f) / DENSITY
    segments = len(nodes) - 1
    # RK4 is stable to 2.8 over the highest frequency of the chain.
    step = 2.0 / (2.0 * segments / system.lam * np.sqrt(stiffness))
    above, below = (" ".join(f"{x:.16g}" for x in nodes[k]) for k in (0, -1))
    mass, area = system.w_f + DENSITY * volume, 2.0 * system.C_f / DENSITY
    return f"""MoorDyn
---- LINE TYPES ----
Name Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
cable {diameter:.16g} {1.0 - displaced:.16g} {stiffness:.16g} -0.8 0 {normal:.16g} 1 {axial:.16g} 1
---- POINTS ----
ID Attachment X Y Z Mass Volume CdA Ca
(-) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Coupled {above} 0 0 0 0
2 Free {below} {mass:.16g} {volume:.16g} {area:.16g} 1
---- LINES ----
ID LineType AttachA AttachB UnstrLen NumSegs Outputs
(-) (-) (-) (-) (m) (-) (-)
1 cable 1 2 {system.lam:.16g} {segments} -
---- OPTIONS ----
2 writeLog
rk4 tScheme
{step:.16g} dtM
{GRAVITY} g
{DENSITY} rho
{2.0 * DEPTH} WtrDpth
0 WaveKin
0 Currents
0 disableOutput
{STATE} fileIC
---- END ----
"""


def _state(positions: Array, velocities: Array) -> bytes:
    """A state file: a block of rows x y z vx vy vz for each point, then one for the inner nodes of the line."""
    rows = np.concatenate([positions, velocities], axis=1)
    blocks = [rows[:1], rows[-1:], rows[1:-1]]
    body = b"".join(struct.pack("<QQ", *block.shape) + block.astype("<f8").tobytes() for block in blocks)
    return b"MoorDyn" + struct.pack("<BBQQ", 2, 7, len(body) // 8 + 1, len(blocks)) + body


@contextmanager
def _silent() -> Iterator[None]:
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


def _start(system: System, gamma: float, segments: int) -> tuple[Array, float, float]:
    """Nodes on chords of the shape that the equations have, stretched as they pull; axial stiffness; r_f."""
    found = towatlas.equilibria(
        system.lam, system.w_f, gamma, m_f=system.m_f, C=system.C, C_f=system.C_f, w=system.w, C_t=system.C_t
    )
    shape = towatlas.shape_of(found, found.expected, np.linspace(0.0, system.lam, segments + 1))
    # Chords of the curve are shorter than the segments, by more than their strain: the chain would start slack.
    chord = np.diff([shape["x"].values, shape["y"].values, -shape["z"].values], axis=1)
    tension = shape["T"].values
    strain = 0.5 * (tension[1:] + tension[:-1]) / (STIFF * tension[0])
    chord *= system.lam / segments * (1.0 + strain) / np.linalg.norm(chord, axis=0)
    nodes = np.cumsum(np.column_stack([[1.0, 0.0, -DEPTH], chord]), axis=1).T
    return nodes, STIFF * GRAVITY * float(tension[0]), float(found.r_f[found.expected])


def steady(system: System, gamma: float, segments: int, turns: int = TURNS) -> tuple[float, float]:
    """Relative error of r_f, its mean over the last turn, and the seconds of the march."""
    import moordyn

    nodes, stiffness, exact = _start(system, gamma, segments)
    speed = gamma * np.sqrt(GRAVITY)
    moving = speed * np.stack([-nodes[:, 1], nodes[:, 0], np.zeros(len(nodes))], axis=1)
    dt = 2.0 * np.pi / speed / COUPLINGS
    angle = 2.0 * np.pi / COUPLINGS * np.arange(turns * COUPLINGS + 1)
    path = np.stack([np.cos(angle), np.sin(angle), np.full(len(angle), -DEPTH)], axis=1)
    pace = (np.diff(path, axis=0) / dt).tolist()
    radii = np.empty(len(pace))
    with tempfile.TemporaryDirectory() as folder, _silent():
        (Path(folder) / STATE).write_bytes(_state(nodes, moving))
        deck = Path(folder) / "deck"
        deck.write_text(_deck(system, stiffness, nodes))
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
