"""The cables that bring the fish of a scene to a depth."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from towatlas.checks import check_one
from towatlas.effort import patience
from towatlas.scene.choice import Choice, least_model
from towatlas.scene.jumps import Jumps, critical_speeds
from towatlas.scene.scene import Scene, patient_with
from towatlas.solve.depths import CablesToDepth, cables_to_depth
from towatlas.tables.atlas import Atlas

# What the model of a design is chosen for: where the fish hangs.
DESIGN_QUESTIONS = ("nodes", "position", "tension")
# Cables are searched up to this many times the way from the tow point to the depth wanted, below the centre.
LONGEST = 10.0


@dataclass(frozen=True)
class Design:
    """Cables that put the fish of a scene at one depth, in rising order of length.

    Attributes
    ----------
    scene : Scene
        The scene, whose length is not used.
    depth : float
        Of the fish below the plane of the towing circle [m], > 0.
    max_radius : float
        Farthest from the axis that the fish may be [m], > 0; inf for any.
    longest : float
        Longest cable searched [m], > 0.
    cables : CablesToDepth
        All of them, dimensionless.
    chosen : ndarray of bool, shape (cables,)
        Those within the radius asked for.
    jumps : list of Jumps
        Of each cable the critical speeds about the scene's speed.
    """

    scene: Scene
    depth: float
    max_radius: float
    longest: float
    cables: CablesToDepth
    chosen: NDArray[np.bool_]
    jumps: list[Jumps]

    @property
    def expected(self) -> NDArray[np.bool_]:
        """Which of the cables have their expected shape there: in a vacuum the median root; shape (cables,)."""
        passed = np.array([jumps.passed(abs(self.scene.gamma)) for jumps in self.jumps], int)
        return (self.cables.nodes == passed) & ~self.cables.outer

    def choices(self, model: str | None = None) -> dict[int, Choice]:
        """The least model for nodes, position and tension of each cable chosen that is an expected one.

        Parameters
        ----------
        model : str, optional
            The model to use whatever the others say.

        Returns
        -------
        dict of Choice
            By row of `cables`.

        Raises
        ------
        ValueError, ArithmeticError
            As `towatlas.scene.choice.least_model`.
        """
        found = {}
        with patience():
            for k in np.flatnonzero(self.chosen & self.expected):
                length = float(self.cables.lam[k]) * self.scene.radius
                cable = replace(self.scene, length=length, given=self.scene.given | {"cable.length": f"{length:g} m"})
                with patient_with(cable):
                    found[int(k)] = least_model(cable, model, DESIGN_QUESTIONS)
        return found


def design(
    scene: Scene,
    depth: float,
    max_radius: float = np.inf,
    max_length: float | None = None,
    atlas: Atlas | None = None,
) -> Design:
    """Cable lengths that put the fish at a depth, by the vacuum model; the length of the scene is not used.

    Parameters
    ----------
    scene : Scene
        From `towatlas.read_scene`.
    depth : float
        Below the plane of the towing circle [m], > 0.
    max_radius : float
        How far from the axis the fish may be [m], > 0.
    max_length : float, optional
        Longest cable searched [m]; without it 10 times the distance from the tow point to the axis at that depth.
    atlas : Atlas, optional
        Where critical speeds are looked up if it holds them.

    Returns
    -------
    Design
        All cables found, also those outside the radius.

    Raises
    ------
    ValueError
        For numbers out of range.
    ArithmeticError
        If the computation overflows, does not converge, or takes longer than `towatlas.patience` allows (TooMuchWork).

    Examples
    --------
    >>> from towatlas import read_scene
    >>> scene = read_scene("skop-fig3").at(gamma=5.94)
    >>> found = design(scene, depth=0.6)
    >>> [round(float(lam) * scene.radius, 4) for lam in found.cables.lam[found.expected]]
    [0.6075]
    """
    depth = check_one("depth", depth)
    if not max_radius > 0.0:
        raise ValueError(f"max_radius must be positive, got {max_radius:g}")
    given = LONGEST * float(np.hypot(depth, scene.radius)) if max_length is None else max_length
    longest = check_one("length", given)
    w_f, gamma = scene.system("vacuum").w_f, abs(scene.gamma)
    with patient_with(scene, f"--depth {depth:g} m, --max-length {longest:g} m", longest / scene.radius):
        cables = cables_to_depth(w_f=w_f, gamma=gamma, z_f=depth / scene.radius, lam_max=longest / scene.radius)
        jumps = [critical_speeds(lam=float(lam), w_f=w_f, gamma=gamma, atlas=atlas) for lam in cables.lam]
    return Design(
        scene=scene,
        depth=depth,
        max_radius=max_radius,
        longest=longest,
        cables=cables,
        chosen=np.abs(cables.x_f) * scene.radius <= max_radius,
        jumps=jumps,
    )
