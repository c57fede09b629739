"""An independent shot in mpmath, to any precision: Taylor recurrences of first order, variation by series division.

Shares no code and no formulation with the kernels beyond the equations themselves. Each step is right to `digits`; a
shot and a root lose some of them to what they amplify, so that docs/data/reference_folds.csv keeps 34 of 50.
"""

from dataclasses import dataclass

import mpmath as mp

DIGITS = 34


@dataclass
class Shot:
    """State at the end of a shot; mpmath numbers."""

    t: mp.mpf
    f: mp.mpf
    p: mp.mpf
    z: mp.mpf
    v: mp.mpf
    q: mp.mpf

    @property
    def r(self):
        return mp.sqrt(self.t**2 + self.f**2)

    @property
    def amplitude(self):
        """Local amplitude of p."""
        return mp.sqrt(self.p**2 + self.f**2 / self.r)

    @property
    def q_amplitude(self):
        return mp.sqrt(self.q**2 + self.v**2 / self.r)


def _tip(a, t, order):
    """Power series in t at mu = 0, and its derivative in a by the derivative of every coefficient."""
    p, dp, s, ds = [a], [mp.mpf(1)], [], []
    w, dw = [], []
    for k in range(order):
        u = [p[j] / (j + 1) for j in range(k + 1)]
        du = [dp[j] / (j + 1) for j in range(k + 1)]
        w.append(mp.fsum(u[j] * u[k - j] for j in range(k + 1)) + (1 if k == 0 else 0))
        dw.append(2 * mp.fsum(u[j] * du[k - j] for j in range(k + 1)))
        # s = w^(-1/2): 2 w s' = -w' s, coefficient by coefficient.
        if k == 0:
            s.append(1 / mp.sqrt(w[0]))
            ds.append(-dw[0] * s[0] / (2 * w[0]))
        else:
            top = mp.fsum((-mp.mpf(j) / 2 - (k - j)) * w[j] * s[k - j] for j in range(1, k + 1))
            dtop = mp.fsum((-mp.mpf(j) / 2 - (k - j)) * (dw[j] * s[k - j] + w[j] * ds[k - j]) for j in range(1, k + 1))
            s.append(top / (k * w[0]))
            ds.append((dtop - k * dw[0] * s[k]) / (k * w[0]))
        p.append(-mp.fsum(u[j] * s[k - j] for j in range(k + 1)) / (k + 1))
        dp.append(-mp.fsum(du[j] * s[k - j] + u[j] * ds[k - j] for j in range(k + 1)) / (k + 1))
    powers = [t**k for k in range(order + 1)]
    return Shot(
        t=t,
        f=mp.fsum(p[k] * powers[k] * t / (k + 1) for k in range(order)),
        p=mp.fsum(p[k] * powers[k] for k in range(order)),
        z=mp.fsum(s[k] * powers[k] * t / (k + 1) for k in range(order)),
        v=mp.fsum(dp[k] * powers[k] * t / (k + 1) for k in range(order)),
        q=mp.fsum(dp[k] * powers[k] for k in range(order)),
    )


def _series(state, order):
    """Taylor coefficients in sigma of t, f, p, r, z, v, q."""
    t, f, p, z, v, q = ([x] for x in (state.t, state.f, state.p, state.z, state.v, state.q))
    r = [state.r]
    t2, r2, y = [], [], []

    def product(x, y, k):
        return mp.fdot(x[: k + 1], y[k::-1])

    for k in range(order):
        t2.append(product(t, t, k))
        r2.append(product(r, r, k))
        y.append((v[k] - mp.fdot(y, r2[k:0:-1])) / r2[0])
        n = k + 1
        t.append(r[k] / n)
        z.append(t[k] / n)
        f.append(product(p, r, k) / n)
        p.append(-f[k] / n)
        v.append(product(q, r, k) / n)
        q.append(-product(t2, y, k) / n)
        r.append((t[k] + product(f, p, k)) / n)
    return t, f, p, z, v, q


def _value(coefficients, x):
    total = mp.mpf(0)
    for c in reversed(coefficients):
        total = total * x + c
    return total


def shot(a, mu, tau, digits=DIGITS):
    """The shot from (a, mu), doubles taken as exact, after tau of cable."""
    order = digits + 2
    small = mp.mpf(10) ** (3 - digits)
    with mp.workdps(digits):
        a, mu, end = mp.mpf(a), mp.mpf(mu), mp.mpf(mu) + mp.mpf(tau)
        if mu == 0:
            # Singular at some 2 sqrt(1 + a^2); a hundredth of that gains two digits a term.
            state = _tip(a, min(mp.mpf("0.02") * mp.sqrt(1 + a * a), end), 7 * digits // 10 + 1)
        else:
            state = Shot(t=mu, f=mu * a, p=a, z=mp.mpf(0), v=mu, q=mp.mpf(1))
        while state.t < end:
            series = _series(state, order)
            scales = (state.r, state.r, state.amplitude, state.r, abs(state.v), state.q_amplitude)
            h = min(
                (small / max(abs(c[k]) / scale for c, scale in zip(series, scales, strict=True))) ** (mp.mpf(1) / k)
                for k in (order - 1, order)
            )
            t = series[0]
            overshoots = _value(t, h) >= end
            if overshoots:
                for _ in range(60):
                    step = (_value(t, h) - end) / _value([k * t[k] for k in range(1, order + 1)], h)
                    h -= step
                    if abs(step) < small * abs(h):
                        break
            state = Shot(*(_value(c, h) for c in series))
            if overshoots:
                break
        return state


def _newton(n, w_f, lam, digits):
    """Functions: what a fold lacks at (log a, log gamma), and the slopes of that, by differences."""
    sign = 1 if n % 2 == 0 else -1

    def residual(x):
        gamma2 = mp.exp(2 * x[1])
        end = shot(mp.exp(x[0]), gamma2 * mp.mpf(w_f), gamma2 * mp.mpf(lam), digits)
        return mp.matrix([end.q / end.q_amplitude, sign * end.p / gamma2 - 1])

    def slopes(x, here):
        h = mp.mpf(10) ** (-digits // 2)
        columns = [(residual(x + h * mp.matrix(unit)) - here) / h for unit in ([1, 0], [0, 1])]
        return mp.matrix([[column[row] for column in columns] for row in (0, 1)])

    return residual, slopes


def fold_step(n, w_f, lam, a, gamma):
    """Steps in (log a, log gamma), mpmath numbers, from a critical state in double precision: one of Newton's."""
    with mp.workdps(DIGITS):
        residual, slopes = _newton(n, w_f, lam, DIGITS)
        x = mp.matrix([mp.log(mp.mpf(a)), mp.log(mp.mpf(gamma))])
        here = residual(x)
        return mp.lu_solve(slopes(x, here), -here)


def fold(n, w_f, lam, a, gamma, digits=DIGITS):
    """gamma of a fold, an mpmath number, from a critical state in double precision.

    Two steps of Newton's in few digits; then, with the slopes of the second, steps in all of them, each of which gains
    a dozen, until what the next would move is below what shots of so many can tell.
    """
    with mp.workdps(DIGITS):
        residual, slopes = _newton(n, w_f, lam, DIGITS)
        x = mp.matrix([mp.log(mp.mpf(a)), mp.log(mp.mpf(gamma))])
        for _ in range(2):
            here = residual(x)
            jacobian = slopes(x, here)
            step = mp.lu_solve(jacobian, -here)
            x += step
    with mp.workdps(digits):
        residual, _ = _newton(n, w_f, lam, digits)
        for _ in range(8):
            before, step = mp.norm(step), mp.lu_solve(jacobian, -residual(x))
            x += step
            if mp.norm(step) ** 2 < before * mp.mpf(10) ** (12 - digits):
                return mp.exp(x[1])
    raise ArithmeticError(f"no fold of {digits} digits near lam = {lam}, w_f = {w_f}, gamma = {gamma}, n = {n}")


def fold_error(n, w_f, lam, a, gamma):
    """Relative errors (of a, of gamma) of a critical state found in double precision."""
    step = fold_step(n, w_f, lam, a, gamma)
    return float(abs(step[0])), float(abs(step[1]))
