"""Shots one at a time, by Taylor series in sigma with jets: the march, for equations that are given.

Every coefficient of the Taylor series in sigma is itself a short polynomial, a *jet*, in the unknowns of the problem:
first and higher variations come out of the same recurrences as the solution, with no differences taken. A table of
products says which pairs of monomials give which. Compiled in a tenth of the time of kernels.lanes, for who asks about
few cables.

A set of equations is three functions, which `march_of` compiles the march with:

    expand(c, paid, parameters, jets)   coefficients of orders 1 to ORDER, into c[quantity, monomial, order]
    length(c)                           step at which the series is exact to rounding
    crossings(c, new, h)                zeros of the variation that a step passed; -1 if the step is too long

Quantities 0 and 1 of c are the cable paid out in this step and the tension, dU/d(sigma) = T; the state follows.
Jets are kept at fixed paid-out length: the step is a jet itself, whose higher coefficients see to that.
"""

from collections.abc import Callable
from math import exp, log

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.calls import ORDER, TRUNCATION
from towatlas.kernels.compiling import helper

U, T, FIRST = 0, 1, 2
EPS = 2.0**-52


@helper
def reach(last, k):
    """Step at which a term of order k, of relative size `last`, is down to rounding."""
    return exp(log(TRUNCATION / last) / k)


@helper
def value(c, quantity, first, h):
    total = c[quantity, 0, ORDER]
    for k in range(ORDER - 1, first - 1, -1):
        total = total * h + c[quantity, 0, k]
    return total


@helper
def _evaluate(c, quantity, h, jets, out):
    """Value of a quantity, a jet, after a step h, a jet too."""
    for n in range(len(h)):
        out[n] = c[quantity, n, ORDER]
    for k in range(ORDER - 1, -1, -1):
        total = 0.0
        for m in range(jets.shape[0] - 1, -1, -1):
            total += h[jets[m, 0]] * out[jets[m, 1]]
            n = jets[m, 2]
            # From the highest monomial down, so that what is still to be used is still old.
            if m == 0 or jets[m - 1, 2] != n:
                out[n] = total + c[quantity, n, k]
                total = 0.0


@helper
def _landing(c, remaining, h):
    """Step within h that pays out the remaining cable, by Newton inside a bracket."""
    low, high = 0.0, h
    s = 0.5 * h
    for _ in range(100):
        miss = s * value(c, U, 1, s) - remaining
        if miss > 0.0:
            high = s
        else:
            low = s
        trial = s - miss / value(c, T, 0, s)
        if not (low < trial < high):
            trial = 0.5 * (low + high)
        if abs(trial - s) <= 2.0 * EPS * s:
            return trial
        s = trial
    return s


@helper
def _advance(c, new, h, target, jets, degree):
    """State after the step h[0], at a paid-out length whose jet above the value is `target`; completes h, fills new."""
    for n in range(1, len(h)):
        h[n] = 0.0
    slope = value(c, T, 0, h[0])
    # Each round makes one more degree of the jet right.
    for _ in range(degree):
        _evaluate(c, U, h, jets, new[U])
        for n in range(1, len(h)):
            h[n] += (target[n] - new[U, n]) / slope
    for quantity in range(len(new)):
        if quantity != T:
            _evaluate(c, quantity, h, jets, new[quantity])


def march_of(expand: Callable, length: Callable, crossings: Callable) -> Callable:
    """The march for one set of equations."""

    @helper
    def march(c, new, parameters, jets, degree, paid, low, end, max_steps):
        """March from the state in c[:, :, 0], with paid + low of cable paid out, to that of the jet `end`.

        The state reached is left in c[:, :, 0], with the jets of `end`. Returns the zeros of the variation passed,
        steps and a status.
        """
        h = np.zeros(c.shape[1])
        still = np.zeros(c.shape[1])
        count = steps = 0
        ended = False
        while not ended:
            if steps == max_steps:
                return count, steps, status.STEP_LIMIT
            expand(c, paid + low, parameters, jets)
            h[0] = length(c)
            remaining = (end[0] - paid) - low
            # As the length paid out may overflow where the cable ends long before the step does, ask in this order.
            if not h[0] * value(c, U, 1, h[0]) < remaining:
                h[0] = _landing(c, remaining, h[0])
                ended = True
            while True:
                _advance(c, new, h, end if ended else still, jets, degree)
                passed = crossings(c, new, h[0])
                if passed >= 0:
                    break
                h[0] *= 0.5
                ended = False
            count += passed
            add = new[U, 0] + low
            total = paid + add
            part = total - paid
            low = (paid - (total - part)) + (add - part)
            paid = total
            if not np.isfinite(paid):
                return count, steps, status.BAD_INPUT
            for quantity in range(FIRST, len(new)):
                for n in range(len(h)):
                    c[quantity, n, 0] = new[quantity, n]
                    if not np.isfinite(new[quantity, n]):
                        return count, steps, status.BAD_INPUT
            steps += 1
        return count, steps, status.OK

    return march
