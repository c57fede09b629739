"""A fold or an equilibrium as it is claimed: a shot cut into steps, and the conditions that it has to meet."""

from dataclasses import dataclass, field

from towatlas.solve.proof.arithmetic import arb, binary
from towatlas.solve.proof.taylor import P, R, Step, T, U
from towatlas.solve.proof.tip import Tip


@dataclass
class Chain:
    """A fold or an equilibrium and the shot to it as it is claimed; nothing of it trusted.

    Attributes
    ----------
    lam, w_f : float
        Cable length and fish weight [-], exactly these doubles.
    n : int
        Number of the transition.
    a, G : tuple of int
        Offset of the fish gamma^2 |x_f| and gamma^2, mantissa and power of two.
    bits, order : int
        Of the coefficients of the steps.
    tip : Tip or None
        The first piece where w_f = 0.
    steps : list of Step
    end : list of int
        The state and its derivative at the end, over the scales of the last step.
    speed : float or None
        Of an equilibrium, exactly this double: the condition gamma = speed takes the place of q = 0.
    """

    lam: float
    w_f: float
    n: int
    a: tuple[int, int]
    G: tuple[int, int]
    bits: int
    order: int
    tip: Tip | None = None
    steps: list[Step] = field(default_factory=list)
    end: list[int] = field(default_factory=list)
    speed: float | None = None

    @property
    def sign(self) -> int:
        """Sign of x at the fish relative to the tow point."""
        return 1 if self.n % 2 == 0 else -1

    def node(self, i: int) -> list[arb]:
        """p, u, t, r and the same of y where step i begins, exactly.

        Parameters
        ----------
        i : int
            0 to the number of steps.

        Returns
        -------
        list of arb
        """
        step = self.steps[min(i, len(self.steps) - 1)]
        powers = [power - self.bits for power in step.scales]
        powers += [power + step.y_scale for power in powers]
        values = self.end if i == len(self.steps) else [int(poly[0]) for poly in (*step.x, *step.y)]
        return [binary(value, power) for value, power in zip(values, powers, strict=True)]


def start_state(w_f: arb, a: arb, G: arb) -> list[arb]:
    """The state and its derivative in a at the fish, w_f > 0.

    Parameters
    ----------
    w_f, a, G : arb

    Returns
    -------
    list of arb
        p, u, t, r and the same of y.
    """
    mu, root = w_f * G, (1 + a * a).sqrt()
    return [a, -mu * a, mu, mu * root, arb(1), -mu, arb(0), mu * a / root]


def start_slopes(w_f: arb, a: arb, G: arb) -> list[list[arb]]:
    """Derivatives of those in a and in G.

    Parameters
    ----------
    w_f, a, G : arb

    Returns
    -------
    list of list of arb
        Eight rows of two.
    """
    mu, root = w_f * G, (1 + a * a).sqrt()
    zero = arb(0)
    in_a = [arb(1), -mu, zero, mu * a / root, zero, zero, zero, mu / root**3]
    in_g = [zero, -w_f * a, w_f, w_f * root, zero, -w_f, zero, w_f * a / root]
    return [list(row) for row in zip(in_a, in_g, strict=True)]


def end_slopes(chain: Chain, x: list) -> tuple[list[list], list[list]]:
    """Derivatives of the three conditions p = +-G, q = 0 or G given, t = (w_f + lambda) G in end state, a, G and sigma.

    Parameters
    ----------
    chain : Chain
    x : list
        The end state, eight numbers or balls.

    Returns
    -------
    in_state : list of list
        Three rows of eight.
    in_unknowns : list of list
        Three rows of three.
    """
    p, u, _, r, y_p, _, y_t, _ = x
    in_state = [
        [1, 0, 0, 0, 0, 0, 0, 0],
        [0, -y_t, 0, y_p, r, 0, -u, 0],
        [0, 0, 1, 0, 0, 0, 0, 0],
    ]
    slope = field_of(x)
    along = [sum((a * b for a, b in zip(row, slope, strict=True)), 0 * p) for row in in_state]
    exact = arb(chain.w_f) + arb(chain.lam)
    total = exact if isinstance(p, arb) else float(exact)
    if chain.speed is not None:
        in_state[1] = [0] * 8
        return in_state, [[0, -chain.sign, along[0]], [0, 1, 0], [0, -total, along[2]]]
    return in_state, [[0, -chain.sign, along[0]], [0, 0, along[1]], [0, -total, along[2]]]


def field_of(x: list) -> list:
    """The slopes of a state and its derivative.

    Parameters
    ----------
    x : list
        Eight numbers or balls.

    Returns
    -------
    list
    """
    p, u, t, r, y_p, y_u, y_t, y_r = x
    return [u, -p * r, r, t - u * p, y_u, -(p * y_r + y_p * r), y_r, y_t - (u * y_p + y_u * p)]


def end_misses(chain: Chain, x: list[arb], G: arb) -> list[arb]:
    """By how much the end state fails the three conditions.

    Parameters
    ----------
    chain : Chain
    x : list of arb
    G : arb

    Returns
    -------
    list of arb
    """
    total = arb(chain.w_f) + arb(chain.lam)
    second = x[R] * x[4 + P] - x[U] * x[4 + T] if chain.speed is None else G - arb(chain.speed) ** 2
    return [x[P] - chain.sign * G, second, x[T] - G * total]
