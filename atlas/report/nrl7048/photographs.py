"""The photographs of NRL Report 7048, and what they show."""

from dataclasses import dataclass, replace

# Radius of the experiment [in].
TOW_RADIUS = 11.0 / 16.0
# Its drag constant, as the report gives it.
DRAG = 0.018


@dataclass(frozen=True)
class Case:
    """A cable at one speed.

    Attributes
    ----------
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-].
    C : float
        Drag constant of the cable [-], by default that of the experiment.
    """

    lam: float
    w_f: float
    gamma: float
    C: float = DRAG

    @property
    def vacuum(self) -> "Case":
        """The same without drag."""
        return replace(self, C=0.0)

    @property
    def cable(self) -> tuple[float, float]:
        """Cable length and fish weight [-]."""
        return self.lam, self.w_f


@dataclass(frozen=True)
class Photograph:
    """One of the photographs of Figs. 3-5 for which the report states the number of nodes; all in air.

    Attributes
    ----------
    figure : str
        Its number and letter.
    lam, w_f, gamma : float
        Cable length, fish weight and speed [-].
    nodes : int
        As photographed, >= 1.
    """

    figure: str
    lam: float
    w_f: float
    gamma: float
    nodes: int

    @property
    def case(self) -> Case:
        """What is photographed."""
        return Case(self.lam, self.w_f, self.gamma)


PHOTOGRAPHS = (
    Photograph("3a", 37.8, 1352.0, 1.64, 1),
    Photograph("3b", 37.8, 1352.0, 2.97, 1),
    Photograph("3c", 37.8, 1352.0, 5.94, 2),
    Photograph("4a", 52.4, 1352.0, 2.46, 2),
    Photograph("4c", 52.4, 1352.0, 4.77, 3),
    Photograph("5a", 52.4, 1571.0, 2.60, 2),
    Photograph("5b", 52.4, 1571.0, 4.77, 2),
    Photograph("5c", 52.4, 1571.0, 7.23, 3),
)
# Fig. 6 shows a motion between one and two nodes.
FIG_6 = Case(37.8, 1352.0, 3.9)
