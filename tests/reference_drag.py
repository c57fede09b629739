"""An independent shot with drag in long double: the midpoint rule extrapolated (Bulirsch and Stoer), Eqs. (20)-(21).

Shares no code and no formulation with the kernels beyond the equations themselves: the report's variables, arc length.
"""

import numpy as np

LONG = np.longdouble
TOLERANCE = LONG(1e-18)
COLUMNS = 10
# Length of the tip taken as straight: the rest forgets it but for its square.
TIP = LONG(1e-11)


def slopes(state, gamma2, c, w, c_t, c_s=0, b_s=np.inf):
    """d(x, y, z, R)/ds, Eqs. (19)-(21); the side force of DTMB Report 713."""
    position, force = state[:3], state[3:]
    tangent = force / np.sqrt(force @ force)
    velocity = np.array([-position[1], position[0], LONG(0)])
    along = velocity @ tangent
    across = velocity - along * tangent
    load = np.array([gamma2 * position[0], gamma2 * position[1], w])
    load = load - gamma2 * (c * np.sqrt(across @ across) * across + c_t * abs(along) * along * tangent)
    if c_s:
        speed = np.sqrt(velocity @ velocity)
        sine = np.sqrt(across @ across) / speed
        load = load + gamma2 * c_s * speed / (1 + (sine / b_s) ** 2) * np.cross(tangent, velocity)
    return np.concatenate([tangent, -load])


def _midpoint(state, first, h, substeps, arguments):
    step = h / substeps
    before, now = state, state + step * first
    for _ in range(substeps - 1):
        before, now = now, before + 2 * step * slopes(now, *arguments)
    return (before + now + step * slopes(now, *arguments)) / 2


def _above_tip(r, gamma2, c, w, c_t):
    """State just above a bare tip, which lies where the load across it vanishes: bisection on its angle of trail."""
    load = np.sqrt(w * w + (gamma2 * r) ** 2)
    low, high = LONG(0), LONG(2)
    for _ in range(80):
        angle = (low + high) / 2
        heavy = load * np.sin(angle) > c * gamma2 * r * r * np.cos(angle) * abs(np.cos(angle))
        low, high = (low, angle) if heavy else (angle, high)
    tangent = np.array([np.cos(angle) * gamma2 * r / load, -np.sin(angle), np.cos(angle) * w / load])
    rise = load * np.cos(angle) + c_t * gamma2 * (r * np.sin(angle)) ** 2
    return np.concatenate([np.array([r, LONG(0), LONG(0)]) - TIP * tangent, TIP * rise * tangent])


def shot(r, gamma, system):
    """State at the tow point of a shot with the fish at (r, 0, 0), lengths over the tow radius; long doubles.

    Without a fish there must be no side force: it would turn the tip.
    """
    g2 = LONG(gamma) ** 2
    r = LONG(r)
    arguments = g2, LONG(system.C), LONG(system.w), LONG(system.C_t), LONG(system.C_s), LONG(system.b_s)
    state = np.array([r, 0, 0, g2 * LONG(system.m_f) * r, -LONG(system.C_f) * g2 * r * r, LONG(system.w_f)], dtype=LONG)
    left = LONG(system.lam)
    if not state[3:].any():
        state, left = _above_tip(r, *arguments[:4]), left - TIP
    h = min(LONG(system.lam) / 1000, left if left < 1 else LONG(1))
    if left < system.lam:
        h = TIP
    while left > 0:
        h = min(h, left)
        scale = np.concatenate([np.full(3, np.hypot(*state[:2])), np.full(3, np.sqrt(state[3:] @ state[3:]))])
        first = slopes(state, *arguments)
        rows = []
        for k in range(COLUMNS):
            row = [_midpoint(state, first, -h, 2 * k + 2, arguments)]
            for j in range(k):
                ratio = (LONG(k + 1) / LONG(k - j)) ** 2
                row.append(row[j] + (row[j] - rows[-1][j]) / (ratio - 1))
            rows.append(row)
            error = np.max(np.abs(row[-1] - row[-2]) / scale) if k else LONG(1)
            if k > 2 and error < TOLERANCE:
                break
        if error < TOLERANCE:
            state, left = rows[-1][-1], left - h
            h = h * (LONG(1.5) if len(rows) < COLUMNS - 1 else LONG(0.9))
        else:
            h = h / 2
    return state
