"""An independent shot in mpmath: 34 digits, first-order Taylor recurrences, variation at fixed t by series division.

Shares no code and no formulation with the kernels beyond the equations themselves.
"""

from dataclasses import dataclass

import mpmath as mp

DIGITS = 34
ORDER = 36


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


def _tip(a, t):
    """Power series in t at mu = 0, and its derivative in a by the derivative of every coefficient."""
    order = 24
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


def _series(state):
    """Taylor coefficients in sigma of t, f, p, r, z, v, q."""
    t, f, p, z, v, q = ([x] for x in (state.t, state.f, state.p, state.z, state.v, state.q))
    r = [state.r]
    t2, r2, y = [], [], []

    def product(x, y, k):
        return mp.fsum(x[j] * y[k - j] for j in range(k + 1))

    for k in range(ORDER):
        t2.append(product(t, t, k))
        r2.append(product(r, r, k))
        y.append((v[k] - mp.fsum(y[j] * r2[k - j] for j in range(k))) / r2[0])
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


def shot(a, mu, tau):
    """The shot from (a, mu), doubles taken as exact, after tau of cable."""
    with mp.workdps(DIGITS):
        a, mu, end = mp.mpf(a), mp.mpf(mu), mp.mpf(mu) + mp.mpf(tau)
        if mu == 0:
            state = _tip(a, min(mp.mpf("0.02") * mp.sqrt(1 + a * a), end))
        else:
            state = Shot(t=mu, f=mu * a, p=a, z=mp.mpf(0), v=mu, q=mp.mpf(1))
        while state.t < end:
            series = _series(state)
            scales = (state.r, state.r, state.amplitude, state.r, abs(state.v), state.q_amplitude)
            h = min(
                (mp.mpf(10) ** (3 - DIGITS) / max(abs(c[k]) / scale for c, scale in zip(series, scales, strict=True)))
                ** (mp.mpf(1) / k)
                for k in (ORDER - 1, ORDER)
            )
            t = series[0]
            overshoots = _value(t, h) >= end
            if overshoots:
                for _ in range(60):
                    step = (_value(t, h) - end) / _value([k * t[k] for k in range(1, ORDER + 1)], h)
                    h -= step
                    if abs(step) < mp.mpf(10) ** (3 - DIGITS) * abs(h):
                        break
            state = Shot(*(_value(c, h) for c in series))
            if overshoots:
                break
        return state


def fold_step(n, w_f, lam, a, gamma):
    """Steps in (log a, log gamma), mpmath numbers, from a critical state in double precision: one of Newton's."""
    with mp.workdps(DIGITS):
        sign = 1 if n % 2 == 0 else -1
        x = [mp.log(mp.mpf(a)), mp.log(mp.mpf(gamma))]

        def residual(log_a, log_gamma):
            gamma2 = mp.exp(2 * log_gamma)
            end = shot(mp.exp(log_a), gamma2 * mp.mpf(w_f), gamma2 * mp.mpf(lam))
            return mp.matrix([end.q / end.q_amplitude, sign * end.p / gamma2 - 1])

        h = mp.mpf(10) ** -12
        here = residual(*x)
        along_a = (residual(x[0] + h, x[1]) - here) / h
        along_gamma = (residual(x[0], x[1] + h) - here) / h
        jacobian = mp.matrix([[along_a[0], along_gamma[0]], [along_a[1], along_gamma[1]]])
        return mp.lu_solve(jacobian, -here)


def fold_error(n, w_f, lam, a, gamma):
    """Relative errors (of a, of gamma) of a critical state found in double precision."""
    step = fold_step(n, w_f, lam, a, gamma)
    return float(abs(step[0])), float(abs(step[1]))
