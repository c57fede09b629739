"""The device again, by other ways: Newton's laws in the plane, finite differences, SciPy, Fourier series."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def scatter(count, seed, *, k=(-1.5, 2.0)):
    """Random k, alpha and R: a third of them close to -90 degrees, where most happens."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(count):
        alpha = rng.uniform(-1.0, 1.0) * 0.5 * np.pi
        if rng.random() < 0.35:
            alpha = -0.5 * np.pi + 10.0 ** rng.uniform(-4, -0.3)
        rows.append((10.0 ** rng.uniform(*k), alpha, 10.0 ** rng.uniform(-1.0, 0.7)))
    return rows


def in_the_plane(k, alpha, R, phi, z):
    """Acceleration of phi and tension from Eqs. (1) to (10), m = L = omega = 1, at t = 0.

    Two equations of motion with the tension, and the second derivative of the constraint.
    """
    theta, rate = phi, 1.0 + z
    ship, ship_v, ship_a = np.array([R, 0.0]), np.array([0.0, R]), np.array([-R, 0.0])
    line = np.array([np.sin(theta), -np.cos(theta)])
    across = np.array([np.cos(theta), np.sin(theta)])
    v = ship_v + rate * across
    assert np.allclose(ship + line, [R + np.sin(theta), -np.cos(theta)])
    speed = np.hypot(*v)
    force = (
        k
        * speed
        * np.array([-v[0] * np.cos(alpha) + v[1] * np.sin(alpha), -v[1] * np.cos(alpha) - v[0] * np.sin(alpha)])
    )
    # x'' = ship'' + theta'' across - theta'^2 line = force - T line.
    matrix = np.column_stack([across, line])
    acceleration, T = np.linalg.solve(matrix, force - ship_a + rate**2 * line)
    return acceleration, T


def rhs(k, alpha, R, phi, z):
    """Eq. (15) as it is printed."""
    root = np.sqrt((R**2 + 2 * R * np.sin(phi) + 1) + 2 * (z * R * np.sin(phi) + z) + z**2)
    bracket = z * np.cos(alpha) + ((np.cos(alpha) * np.sin(phi) - np.sin(alpha) * np.cos(phi)) * R + np.cos(alpha))
    return -k * root * bracket + R * np.cos(phi)


def printed_b_and_c(k, alpha, R, phi):
    """Eqs. (19) and (20) as they are printed."""
    a, b, s, c = np.cos(alpha), np.sin(alpha), np.sin(phi), np.cos(phi)
    G = R**2 + 2 * R * s + 1
    B = k / np.sqrt(G) * ((a * s**2 - b * c * s + a) * R**2 + (4 * a * s - b * c) * R + 2 * a)
    inner = (b * s + a * c) * R**2 + (3 * b * s**2 + 3 * a * c * s - b) * R + b * s + 2 * a * c
    return B, k * R / np.sqrt(G) * inner + R * s


def integrate(k, alpha, R, start, time, **options):
    """A motion by DOP853."""
    return solve_ivp(
        lambda t, y: (y[1], rhs(k, alpha, R, *y)),
        (0.0, time),
        start,
        method="DOP853",
        rtol=options.pop("rtol", 1e-13),
        atol=options.pop("atol", 1e-14),
        **options,
    )


def fourier_cycle(k, alpha, R, guess, harmonics=60, free=None):
    """A cycle as a Fourier series, by collocation and Newton's method.

    `guess` is the angle over one period at equidistant times, and the period; `free` names the amplitude when alpha is
    unknown too. Returns angle, rate, period, and alpha.
    """
    count = 2 * harmonics + 1
    phi, period = guess
    phi = np.interp(np.arange(count) / count, np.arange(len(phi)) / len(phi), phi, period=1.0)
    wave = np.fft.fftfreq(count, 1.0 / count)
    first = np.real(np.fft.ifft(2j * np.pi * wave[:, None] * np.fft.fft(np.eye(count), axis=0), axis=0))
    second = first @ first
    unknowns = np.concatenate([phi, [period, alpha]])

    def residual(x):
        p, T, al = x[:count], x[count], x[count + 1]
        motion = second @ p / T**2 - rhs(k, al, R, p, first @ p / T)
        size = np.hypot(*(2.0 / count * (p @ f(2 * np.pi * np.arange(count) / count)) for f in (np.cos, np.sin)))
        phase = 2.0 / count * (p @ np.sin(2 * np.pi * np.arange(count) / count))
        return np.concatenate([motion, [phase, al - alpha if free is None else size - free]])

    for _ in range(30):
        value = residual(unknowns)
        jacobian = np.empty((count + 2, count + 2))
        for j in range(count + 2):
            h = 1e-6 * max(1.0, abs(unknowns[j]))
            plus, minus = unknowns.copy(), unknowns.copy()
            plus[j] += h
            minus[j] -= h
            jacobian[:, j] = (residual(plus) - residual(minus)) / (2 * h)
        step = np.linalg.solve(jacobian, -value)
        unknowns = unknowns + step
        if np.abs(step).max() < 1e-12:
            break
    p, T = unknowns[:count], unknowns[count]
    return p, first @ p / T, T, unknowns[count + 1]


def refined(values, factor=40):
    """A trigonometric polynomial at more points."""
    count = len(values)
    wave = np.fft.fft(values)
    half = count // 2
    padded = np.zeros(count * factor, complex)
    padded[: half + 1], padded[-half:] = wave[: half + 1], wave[-half:]
    return np.real(np.fft.ifft(padded)) * factor


def extreme(values):
    """Least value of a finely sampled smooth function, by a parabola."""
    i = int(np.argmin(values))
    a, b, c = values[i - 1], values[i], values[(i + 1) % len(values)]
    return b - (a - c) ** 2 / (8.0 * (a - 2 * b + c))


def homoclinic_alpha(k, R, saddle_of, focus_of, bracket):
    """alpha of a homoclinic orbit: manifolds from 1e-7 beside the saddle, met above the focus, DOP853."""

    def gap(alpha):
        saddle, focus = saddle_of(alpha), focus_of(alpha)
        h = 1e-6
        f_phi = (rhs(k, alpha, R, saddle + h, 0) - rhs(k, alpha, R, saddle - h, 0)) / (2 * h)
        f_z = (rhs(k, alpha, R, saddle, h) - rhs(k, alpha, R, saddle, -h)) / (2 * h)
        root = np.sqrt(0.25 * f_z**2 + f_phi)
        ends = []
        for rate, sense in ((0.5 * f_z + root, 1.0), (0.5 * f_z - root, -1.0)):

            def above(t, y):
                return y[0] - focus

            # The stable manifold passes below the focus before it comes back above.
            above.terminal, above.direction = True, sense
            done = solve_ivp(
                lambda t, y, sense=sense: (sense * y[1], sense * rhs(k, alpha, R, *y)),
                (0.0, 200.0),
                (saddle + 1e-7, rate * 1e-7),
                method="DOP853",
                rtol=1e-13,
                atol=1e-15,
                events=above,
            )
            ends.append(done.y_events[0][0][1])
        return ends[0] - ends[1]

    return brentq(gap, *bracket, xtol=1e-13)
