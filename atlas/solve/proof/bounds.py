"""How far a shot may be from the polynomials of a step: Gronwall's inequality on their defects.

All norms are the largest of the four scaled quantities, over z from 0 to 1. With kappa a bound of F'(x^) on the
polynomials x^, beta that of F'' / 2, d that of the defect and rho that of what the shot begins off them by, the
difference e obeys |e|' <= (kappa + beta |e|) |e| + d: as long as |e| <= NEAR it is at most (rho + d)
exp(kappa + beta NEAR), and if this is less than NEAR it never comes so far. Derivatives of a shot obey linear
equations with the same slope.
"""

from dataclasses import dataclass

from towatlas.solve.proof.arithmetic import Refused, arb, binary, height, norm, up
from towatlas.solve.proof.taylor import MORE_BITS, P, R, Step, U, column_defects, defects, own_defects, shortened

NEAR = 2.0**-20


@dataclass(frozen=True)
class StepBounds:
    """Bounds of one step, scaled; each an exact number.

    Attributes
    ----------
    tail : arb
        Of the defect of the shot.
    y_tail : arb
        Of that of y.
    growth : arb
        By how much a difference grows, exp(kappa + 2 beta NEAR).
    beta, y_size : arb
        Bounds of F'' / 2 and of the polynomials of y.
    column, second : arb
        Of the errors of columns v and w, from the shot that begins at the centre.
    """

    tail: arb
    y_tail: arb
    growth: arb
    beta: arb
    y_size: arb
    column: arb
    second: arb

    def off(self, rho: arb, y_rho: arb) -> tuple[arb, arb]:
        """How far x and y may be from their polynomials if they begin off their centres by so much.

        Parameters
        ----------
        rho, y_rho : arb

        Returns
        -------
        tuple of arb

        Raises
        ------
        Refused
            If that is too far for these bounds.
        """
        x = up((rho + self.tail) * self.growth)
        if not x < NEAR:
            raise Refused("WRAPPED", "shots of the box leave the neighbourhood of the polynomials of a step")
        return x, up((y_rho + 2 * self.beta * x * self.y_size + self.y_tail) * self.growth)


def largest(values: list[arb]) -> arb:
    """The largest, as an exact number.

    Parameters
    ----------
    values : list of arb

    Returns
    -------
    arb
    """
    most = values[0]
    for value in values[1:]:
        most = most.max(value)
    return up(most)


def bound_step(step: Step) -> StepBounds:
    """Bounds of one step, from exact defects.

    Parameters
    ----------
    step : Step

    Returns
    -------
    StepBounds
    """
    bits = step.bits
    c = [binary(value, -bits - MORE_BITS) for value in step.constants()]
    n = [norm(poly) * binary(1, -bits) for poly in step.x]
    beta = up(c[1])
    kappa = largest([c[0], c[1] * (n[P] + n[R]), c[2], c[3] + c[1] * (n[U] + n[P])])
    growth = up((kappa + 2 * beta * NEAR).exp())
    tail = largest([height(poly) for poly in own_defects(step)]) * binary(1, -3 * bits - MORE_BITS)
    y_tail = largest([height(poly) for poly in defects(step, step.y, step.x, bits, bits)])
    y_tail *= binary(1, -3 * bits - MORE_BITS)
    y_size = largest([norm(poly) * binary(1, -bits) for poly in step.y])
    off = up(tail * growth)
    y_off = up((2 * beta * off * y_size + y_tail) * growth)
    column, second = _bound_columns(step, beta, growth, off, y_off, y_size)
    return StepBounds(up(tail), up(y_tail), growth, beta, y_size, column, second)


def _bound_columns(step: Step, beta: arb, growth: arb, off: arb, y_off: arb, y_size: arb) -> tuple[arb, arb]:
    """Bounds of the errors of the columns, about polynomials of fewer and shorter coefficients."""
    bits, short = step.bits, step.column_bits
    shift, unit = 1 << (bits - short), binary(1, -bits)
    offs = []
    for polys, more in ((step.x, off), (step.y, y_off)):
        pairs = zip(polys, shortened(step, polys), strict=True)
        offs.append(up(more + largest([height(a - b * shift) for a, b in pairs]) * unit))
    x_off, y_off = offs
    columns, seconds = [], []
    small = binary(1, -2 * short - bits - MORE_BITS)
    for v, w, (v_left, w_left) in zip(step.v, step.w, column_defects(step), strict=True):
        v_size, w_size = (largest([norm(poly) for poly in z]) * binary(1, -short) for z in (v, w))
        v_defect, w_defect = (largest([height(poly) for poly in left]) * small for left in (v_left, w_left))
        v_error = up((2 * beta * x_off * v_size + v_defect) * growth)
        crossed = v_error * y_size + v_size * y_off + v_error * y_off
        columns.append(v_error)
        seconds.append(up((2 * beta * (x_off * w_size + crossed) + w_defect) * growth))
    return largest(columns), largest(seconds)
