"""Shots one at a time, by Taylor series in sigma with jets: the march written once for every set of equations.

Every coefficient of the Taylor series in sigma is itself a short polynomial, a *jet*, in the unknowns of the problem:
first and higher variations come out of the same recurrences as the solution, with no differences taken. A table of
products says which pairs of monomials give which (`towatlas.solve.jets`); it is data, so one compiled kernel serves
every kind of jet. Compiled in a tenth of the time of kernels.lanes, for who asks about few cables.

A set of equations is three functions, which `march_of` compiles the march with:

    expand(c, paid, parameters, jets)   coefficients of orders 1 to ORDER, into c[quantity, monomial, order]
    length(c)                           step at which the series is exact to rounding
    crossings(c, new, h)                zeros of the variation that a step passed; -1 if the step is too long

Quantities 0 and 1 of c are the cable paid out in this step and the tension, dU/d(sigma) = T; the state follows.
Jets are kept at fixed paid-out length: the step is a jet itself, whose higher coefficients see to that.
"""

from collections.abc import Callable
from math import exp, log, sqrt

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.compiling import helper
from towatlas.kernels.steppers import ORDER, TRUNCATION

U, T, FIRST = 0, 1, 2
EPS = 2.0**-52


# What a row of a program does with coefficient k of q, jets all: columns are the operation, a, b, q, an integer factor
# and the group, whose rows are skipped where it is switched off.
PRODUCT, RATE, RATIO, ROOT = range(4)  # q += factor a b;  q' += factor a b;  q = a / b;  q = sqrt(a)


@helper
def _add_product(c, a, b, k, first, last, factor, jets, q, at):
    """Add factor times the terms first..last-1 of coefficient k of the product of a and b to that of q at `at`."""
    for m in range(jets.shape[0]):
        left, right = c[a, jets[m, 0]], c[b, jets[m, 1]]
        total = 0.0
        for order in range(np.uint64(first), np.uint64(last)):
            total += left[order] * right[np.uint64(k) - np.uint64(order)]
        c[q, jets[m, 2], at] += factor * total


@helper
def _divide(c, d, factor, jets, q, k):
    """Divide coefficient k of q by `factor` times the leading coefficient of d, jets both."""
    # Products come sorted by their result, the one that has it as a factor last.
    for m in range(jets.shape[0]):
        i, j, n = jets[m, 0], jets[m, 1], jets[m, 2]
        if i != 0:
            c[q, n, k] -= factor * c[d, i, 0] * c[q, j, k]
        else:
            c[q, n, k] /= factor * c[d, 0, 0]


@helper
def _root(c, q, jets):
    """Replace the leading coefficient of q, a jet, by its square root."""
    c[q, 0, 0] = sqrt(c[q, 0, 0])
    for m in range(1, jets.shape[0]):
        i, j, n = jets[m, 0], jets[m, 1], jets[m, 2]
        if i == 0:
            c[q, n, 0] /= 2.0 * c[q, 0, 0]
        elif j != 0:
            c[q, n, 0] -= c[q, i, 0] * c[q, j, 0]


@helper
def run(c, program, k, jets, groups):
    """Run the rows of a program at order k; groups[g] says whether group g is on.

    A table, for it compiles in a fraction of the time of calls written out.
    """
    for row in range(program.shape[0]):
        operation, a, b, q = program[row, 0], program[row, 1], program[row, 2], program[row, 3]
        if not groups[program[row, 5]]:
            continue
        factor, first, last, at = float(program[row, 4]), 0, k + 1, k
        if operation == RATE:
            factor /= k + 1
            at = k + 1
        elif operation != PRODUCT:
            for n in range(c.shape[1]):
                c[q, n, k] = c[a, n, k]
            # The terms that hold a coefficient of the result found before.
            factor = -1.0
            last = k
            a = q
            if operation == ROOT:
                first, b = 1, q
        _add_product(c, a, b, k, first, last, factor, jets, q, at)
        if operation == ROOT and k == 0:
            _root(c, q, jets)
        elif operation != RATE and operation != PRODUCT:
            _divide(c, b, 2.0 if operation == ROOT else 1.0, jets, q, k)


@helper
def clear(c, first, last, k):
    """Set coefficient k of the quantities first..last-1 to zero."""
    for q in range(first, last):
        for n in range(c.shape[1]):
            c[q, n, k] = 0.0


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
    def march(c, new, parameters, jets, degree, paid, low, end, max_steps, trace):
        """March from the state in c[:, :, 0], with paid + low of cable paid out, to that of the jet `end`.

        The state reached is left in c[:, :, 0], with the jets of `end`. trace[i] : paid-out length and values of the
        state after step i, as many as there is room for. Returns the zeros of the variation passed, steps and a status.
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
                if steps < len(trace):
                    trace[steps, quantity - 1] = new[quantity, 0]
            if steps < len(trace):
                trace[steps, 0] = paid + low
            steps += 1
        return count, steps, status.OK

    return march
