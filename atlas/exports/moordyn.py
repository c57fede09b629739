"""An input deck and a state file of MoorDyn v2: a chain of lumped masses that starts in a computed shape.

A frame of MoorDyn has z up: x and the turn of the tow point stay, y and z change signs.
"""

import struct
from dataclasses import dataclass
from math import nan, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from towatlas.system import System

Array = NDArray[np.float64]

STATE = "state.bin"
# Axial stiffness over the largest tension: a strain of 1e-5, which the cable of this package does not have.
STIFF = 1e5
# Of critical damping, along each segment. Less lets it ring, and Runge-Kutta of second order needs still smaller steps.
DAMPING = 0.8
# Steps over the highest frequency of the chain: Runge-Kutta of fourth order is stable to 2.8.
PACE = 2.0
# Of a cable without buoyancy what it displaces, over its mass: MoorDyn has drag only with a diameter.
THIN = 1e-9
# The fluid of a vacuum: the drag coefficients are zero, but not the density.
STAND_IN = 1000.0


@dataclass(frozen=True)
class Towed:
    """One system in real units, as MoorDyn takes it.

    Attributes
    ----------
    system : System
        Without side force.
    unit : float
        Mass per length that masses are divided by [kg/m], > 0.
    radius : float
        Of the circle of the tow point [m], > 0.
    gravity : float
        [m/s^2], > 0.
    density : float
        Of the fluid [kg/m^3], > 0.
    displaced : float
        What the fish displaces [kg], >= 0; nan for half of what its mass with added mass exceeds its weight by: only
        that sum counts.
    """

    system: System
    unit: float
    radius: float
    gravity: float
    density: float
    displaced: float = nan

    def __post_init__(self) -> None:
        if self.system.C_s:
            raise ValueError(
                "MoorDyn has no side force on a line (cable.side_force_coefficient): leave it out of the scene, or "
                "export by --model air, which has none"
            )

    @property
    def length(self) -> float:
        """Of the cable [m]."""
        return self.system.lam * self.radius

    @property
    def depth(self) -> float:
        """Of the tow point below the surface [m]: MoorDyn drops buoyancy and drag above it without a word."""
        return 2.0 * self.length

    @property
    def diameter(self) -> float:
        """Of the cable [m]: of the circle that displaces as much."""
        displaced = 0.5 * (1.0 - self.system.w) * self.unit or THIN * self.unit
        return sqrt(4.0 * displaced / (pi * self.density))

    @property
    def mass(self) -> float:
        """Of the cable in air, per length [kg/m]."""
        return 0.5 * (1.0 + self.system.w) * self.unit

    @property
    def drag(self) -> tuple[float, float]:
        """Coefficients of the cable [-]: across on the diameter, along on the circumference."""
        scale = 2.0 * self.unit / (self.density * self.diameter * self.radius)
        return self.system.C * scale, self.system.C_t * scale / pi

    @property
    def fish(self) -> tuple[float, float, float, float]:
        """Of the fish: mass in air [kg], volume [m^3], drag coefficient by area [m^2], added mass coefficient [-]."""
        whole = self.unit * self.radius
        beyond = (self.system.m_f - self.system.w_f) * whole
        displaced = min(self.displaced, beyond) if self.displaced > 0.0 else 0.5 * beyond
        added = (beyond - displaced) / displaced if displaced else 0.0
        area = 2.0 * self.system.C_f * self.unit / self.density
        return self.system.w_f * whole + displaced, displaced / self.density, area, added

    def step(self, segments: int, stiffness: float) -> float:
        """Time step [s] of a chain.

        Parameters
        ----------
        segments : int
            > 0.
        stiffness : float
            EA [N], > 0.

        Returns
        -------
        float
        """
        return PACE / (2.0 * segments / self.length * sqrt(stiffness / self.unit))


def chain_nodes(positions: Array, tensions: Array, segment: float, stiffness: float) -> Array:
    """Nodes of a chain along a curve: its chords made as long as its segments are when they pull.

    Chords of a curve are shorter than the arc by more than the strain: on them the chain would start slack.

    Parameters
    ----------
    positions : ndarray, shape (nodes, 3)
        On the curve, evenly spaced in arc length [m].
    tensions : ndarray, shape (nodes,)
        There [N].
    segment : float
        Length of one without tension [m].
    stiffness : float
        EA [N].

    Returns
    -------
    ndarray, shape (nodes, 3)
        From the same first one [m].
    """
    chords = np.diff(positions, axis=0)
    strain = 0.5 * (tensions[1:] + tensions[:-1]) / stiffness
    chords *= (segment * (1.0 + strain) / np.linalg.norm(chords, axis=1))[:, None]
    return positions[0] + np.concatenate([np.zeros((1, 3)), np.cumsum(chords, axis=0)])


def turned(nodes: Array, rate: float) -> Array:
    """Velocities of nodes that turn about the vertical axis.

    Parameters
    ----------
    nodes : ndarray, shape (nodes, 3)
        [m], z up.
    rate : float
        [rad/s], positive to starboard, clockwise from above.

    Returns
    -------
    ndarray, shape (nodes, 3)
        [m/s].
    """
    return rate * np.stack([nodes[:, 1], -nodes[:, 0], np.zeros(len(nodes))], axis=1)


def deck_text(towed: Towed, nodes: Array, stiffness: float) -> str:
    """The input file.

    Parameters
    ----------
    towed : Towed
    nodes : ndarray, shape (nodes, 3)
        From the tow point to the fish [m], z up from the surface.
    stiffness : float
        EA [N].

    Returns
    -------
    str
    """
    segments = len(nodes) - 1
    above, below = (" ".join(f"{x:.16g}" for x in nodes[k]) for k in (0, -1))
    normal, axial = towed.drag
    mass, volume, area, added = towed.fish
    return f"""MoorDyn
---- LINE TYPES ----
Name Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(-) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
cable {towed.diameter:.16g} {towed.mass:.16g} {stiffness:.16g} {-DAMPING} 0 {normal:.16g} 1 {axial:.16g} 1
---- POINTS ----
ID Attachment X Y Z Mass Volume CdA Ca
(-) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Coupled {above} 0 0 0 0
2 Free {below} {mass:.16g} {volume:.16g} {area:.16g} {added:.16g}
---- LINES ----
ID LineType AttachA AttachB UnstrLen NumSegs Outputs
(-) (-) (-) (-) (m) (-) (-)
1 cable 1 2 {towed.length:.16g} {segments} -
---- OPTIONS ----
0 writeLog
rk4 tScheme
{towed.step(segments, stiffness):.16g} dtM
{towed.gravity!r} g
{towed.density!r} rho
{2.0 * towed.depth:.16g} WtrDpth
0 WaveKin
0 Currents
1 disableOutput
1 disableOutTime
{STATE} fileIC
---- END ----
"""


def state_bytes(nodes: Array, velocities: Array) -> bytes:
    """The state file: blocks of rows x y z vx vy vz, one for each point, then one for the inner nodes of the line.

    Parameters
    ----------
    nodes, velocities : ndarray, shape (nodes, 3)
        From the tow point to the fish [m], [m/s].

    Returns
    -------
    bytes
    """
    rows = np.concatenate([nodes, velocities], axis=1)
    blocks = [rows[:1], rows[-1:], rows[1:-1]]
    body = b"".join(struct.pack("<QQ", *block.shape) + block.astype("<f8").tobytes() for block in blocks)
    return b"MoorDyn" + struct.pack("<BBQQ", 2, 7, len(body) // 8 + 1, len(blocks)) + body
