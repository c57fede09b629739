"""Shots along cables that trail in strong drag, where Taylor series would follow the drag in millions of steps.

There the direction of the cable relaxes at once to where drag and load balance, and explicit steps are held to the
length that this takes, not to what the shape needs. Here instead: the linearly implicit method RODAS, of fourth order
and stiffly accurate, on the force and position over arc length (`towatlas.kernels.drag` has the equations). Numbers
are complex, the derivative by log r in their imaginary parts, times TINY: one shot gives both, with no differences.

Hairer and Wanner, Solving Ordinary Differential Equations II, 2nd ed., IV.7, 1996, and their code RODAS.
"""

from math import sqrt

import numpy as np

from towatlas.kernels import status
from towatlas.kernels.calls import TINY
from towatlas.kernels.compiling import helper, kernel
from towatlas.kernels.system import B_S, C_S, C_T, LAM, C, W

# X, Y, F_x, F_y, F_z.
SIZE = 5
STAGES = 6
GAMMA = 0.25
# Weights of earlier stages in the state and, over the step, in the load of a stage.
A = np.zeros((STAGES, STAGES))
A[1, :1] = (1.544,)
A[2, :2] = 0.9466785280815826, 0.2557011698983284
A[3, :3] = 3.314825187068521, 2.896124015972201, 0.9986419139977817
A[4, :4] = 1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950
A[5, :4], A[5, 4] = A[4, :4], 1.0
B = np.zeros((STAGES, STAGES))
B[1, :1] = (-5.6688,)
B[2, :2] = -2.430093356833875, -0.2063599157091915
B[3, :3] = -0.1073529058151375, -9.594562251023355, -20.47028614809616
B[4, :4] = 7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160
B[5, :5] = 8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054
# Steps grow and shrink by no more than this, and less than the error would allow.
SHRINK, GROW, SAFETY = 0.2, 5.0, 0.9
# Of the length of the cable.
FIRST_STEP, LEAST_STEP = 1e-9, 1e-18


# numpy's root and quotient of complex numbers guard against what cannot happen here.
@helper
def _root(a):
    root = sqrt(a.real)
    return complex(root, 0.5 * a.imag / root)


@helper
def _inverse(a):
    inverse = 1.0 / a.real
    return complex(inverse, -a.imag * inverse * inverse)


@helper
def _rates(y, system, gamma2, along, jacobian, out):
    """Into out dy/du, and into jacobian, if asked for, its derivatives by y."""
    kappa, kappa_t, kappa_s = system[C] / gamma2, system[C_T] / gamma2, system[C_S] / gamma2
    beta = system[B_S] ** -2.0
    slack = _inverse(_root(y[2] * y[2] + y[3] * y[3] + y[4] * y[4]))
    tx, ty, tz = y[2] * slack, y[3] * slack, y[4] * slack
    vx, vy = -y[1], y[0]
    s = vx * tx + vy * ty
    nx, ny, nz = vx - s * tx, vy - s * ty, -s * tz
    normal2, speed2 = nx * nx + ny * ny + nz * nz, vx * vx + vy * vy
    normal, speed = _root(normal2), _root(speed2)
    # The flow along the cable never turns: s <= 0.
    pull = kappa_t * s * s
    share = speed2 * _inverse(speed2 + beta * normal2)
    side = kappa_s * share * speed
    # F x V / T.
    cx, cy, cz = -tz * vy, tz * vx, tx * vy - ty * vx
    out[0], out[1] = -tx, -ty
    out[2] = y[0] - kappa * normal * nx + pull * tx + side * cx
    out[3] = y[1] - kappa * normal * ny + pull * ty + side * cy
    out[4] = system[W] - kappa * normal * nz + pull * tz + side * cz
    if not along:
        return
    by_normal, by_speed = _inverse(normal), _inverse(speed)
    for k in range(SIZE):
        dvx, dvy = -1.0 if k == 1 else 0.0, 1.0 if k == 0 else 0.0
        fx, fy, fz = 1.0 if k == 2 else 0.0, 1.0 if k == 3 else 0.0, 1.0 if k == 4 else 0.0
        stretch = tx * fx + ty * fy + tz * fz
        dtx, dty, dtz = (fx - stretch * tx) * slack, (fy - stretch * ty) * slack, (fz - stretch * tz) * slack
        ds = dvx * tx + dvy * ty + vx * dtx + vy * dty
        dnx, dny, dnz = dvx - ds * tx - s * dtx, dvy - ds * ty - s * dty, -ds * tz - s * dtz
        dnormal = (nx * dnx + ny * dny + nz * dnz) * by_normal
        dspeed = (vx * dvx + vy * dvy) * by_speed
        dpull = 2.0 * kappa_t * s * ds
        faster = dspeed * by_speed
        fewer = 2.0 * beta * share * normal * (dnormal - normal * faster) * by_speed * by_speed
        dside = side * (faster - fewer)
        dcx, dcy, dcz = -dtz * vy - tz * dvy, dtz * vx + tz * dvx, dtx * vy + tx * dvy - dty * vx - ty * dvx
        jacobian[0, k], jacobian[1, k] = -dtx, -dty
        jacobian[2, k] = dvy - kappa * (dnormal * nx + normal * dnx) + dpull * tx + pull * dtx + dside * cx + side * dcx
        jacobian[3, k] = (
            -dvx - kappa * (dnormal * ny + normal * dny) + dpull * ty + pull * dty + dside * cy + side * dcy
        )
        jacobian[4, k] = -kappa * (dnormal * nz + normal * dnz) + dpull * tz + pull * dtz + dside * cz + side * dcz


@helper
def _factor(matrix, pivots):
    """Replace a matrix by its factors, the diagonal by its inverse, rows exchanged so that pivots are large."""
    for k in range(SIZE):
        best = k
        for i in range(k + 1, SIZE):
            if abs(matrix[i, k].real) > abs(matrix[best, k].real):
                best = i
        pivots[k] = best
        for j in range(SIZE):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        inverse = _inverse(matrix[k, k])
        for i in range(k + 1, SIZE):
            matrix[i, k] *= inverse
            for j in range(k + 1, SIZE):
                matrix[i, j] -= matrix[i, k] * matrix[k, j]
        matrix[k, k] = inverse


@helper
def _substitute(matrix, pivots, b):
    for k in range(SIZE):
        b[k], b[pivots[k]] = b[pivots[k]], b[k]
    for i in range(SIZE):
        for j in range(i):
            b[i] -= matrix[i, j] * b[j]
    for i in range(SIZE - 1, -1, -1):
        for j in range(i + 1, SIZE):
            b[i] -= matrix[i, j] * b[j]
        b[i] *= matrix[i, i]


@helper
def _size(error, y):
    """Errors of position, of force and of their derivatives, the largest over what it is an error of."""
    rho = np.hypot(y[0].real, y[1].real)
    tension = np.sqrt(y[2].real ** 2 + y[3].real ** 2 + y[4].real ** 2)
    worst = 0.0
    for first, last, scale in ((0, 2, rho), (2, SIZE, tension)):
        moved = TINY * scale
        for k in range(first, last):
            moved = max(moved, abs(y[k].imag))
        for k in range(first, last):
            worst = max(worst, abs(error[k].real) / scale, abs(error[k].imag) / moved)
    return worst


@kernel
def shoot_stiff(marched, systems, tolerance, max_steps, begin, stop):
    """Rows begin..stop-1 of shots, from the lengths paid out to the ends of their cables."""
    states, paid, gamma2, angle, steps, statuses = marched
    stages = np.empty((STAGES, SIZE), np.complex128)
    jacobian = np.empty((SIZE, SIZE), np.complex128)
    trial, rates = np.empty(SIZE, np.complex128), np.empty(SIZE, np.complex128)
    pivots = np.zeros(SIZE, np.int64)
    for row in range(begin, stop):
        y, system, speed2 = states[row], systems[row], gamma2[row]
        u, end = paid[row], speed2 * system[LAM]
        h = FIRST_STEP * end
        statuses[row] = status.STEP_LIMIT
        while steps[row] < max_steps:
            steps[row] += 1
            last = not h < end - u
            if last:
                h = end - u
            _rates(y, system, speed2, True, jacobian, rates)
            for i in range(SIZE):
                for j in range(SIZE):
                    jacobian[i, j] = -jacobian[i, j]
                jacobian[i, i] += 1.0 / (GAMMA * h)
            _factor(jacobian, pivots)
            for stage in range(STAGES):
                for k in range(SIZE):
                    trial[k] = y[k]
                    for before in range(stage):
                        trial[k] += A[stage, before] * stages[before, k]
                if stage > 0:
                    _rates(trial, system, speed2, False, jacobian, rates)
                for k in range(SIZE):
                    load = rates[k]
                    for before in range(stage):
                        load += B[stage, before] / h * stages[before, k]
                    stages[stage, k] = load
                _substitute(jacobian, pivots, stages[stage])
            for k in range(SIZE):
                trial[k] += stages[STAGES - 1, k]
            wrong = _size(stages[STAGES - 1], trial) / tolerance
            if not np.isfinite(wrong):
                wrong = 1e9
            if wrong <= 1.0:
                cross = y[0].real * trial[1].real - y[1].real * trial[0].real
                angle[row] += np.arctan2(cross, y[0].real * trial[0].real + y[1].real * trial[1].real)
                for k in range(SIZE):
                    y[k] = trial[k]
                u += h
                if last:
                    statuses[row] = status.OK
                    break
            h *= min(GROW, max(SHRINK, SAFETY * (wrong + 1e-12) ** -0.25))
            if not h > LEAST_STEP * end:
                statuses[row] = status.BAD_INPUT
                break
