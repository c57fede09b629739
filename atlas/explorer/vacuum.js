"use strict";
// The cable in a vacuum from the fish up, lengths over g / Omega^2: the equations of docs/proofs.md and kernels/vacuum.py,
// solved as kernels/steppers.py, folds.py and solve/members.py do. All numbers dimensionless.

const ORDER = 20, TRUNCATION = 1e-16, EPS = 2 ** -52;
// Steps of one shot: what takes more is refused before it begins (workOf).
const MOST_STEPS = 200000;
const TINY_FISH = 1e-9, TIP_REACH = 1e-5;

const P = new Float64Array(ORDER + 1), H = new Float64Array(ORDER + 1), R = new Float64Array(ORDER + 1);
const Q = new Float64Array(ORDER + 1), DH = new Float64Array(ORDER + 1), DR = new Float64Array(ORDER + 1);

/** Taylor coefficients in sigma, d(sigma) = dt / r, of p, H = r + p^2 / 2, r and their derivatives in a. */
function expand(t, s) {
  const r0 = Math.hypot(t, s.f);
  P[0] = s.p; P[1] = -s.f; Q[0] = s.q; Q[1] = -s.v; H[1] = t; DH[1] = 0;
  R[0] = r0; R[1] = t + s.f * s.p; DR[0] = s.f * s.v / r0; DR[1] = s.v * s.p + s.f * s.q;
  for (let k = 2; k <= ORDER; k++) {
    const c = 1 / (k * (k - 1));
    let pr = 0, qr = 0, pp = 0, pq = 0;
    for (let j = 0, i = k - 2; i >= 0; j++, i--) {
      pr += P[j] * R[i];
      qr += Q[j] * R[i] + P[j] * DR[i];
    }
    P[k] = -c * pr;
    Q[k] = -c * qr;
    H[k] = c * R[k - 2];
    DH[k] = c * DR[k - 2];
    for (let j = 0; j <= k; j++) {
      pp += P[j] * P[k - j];
      pq += P[j] * Q[k - j];
    }
    R[k] = H[k] - 0.5 * pp;
    DR[k] = DH[k] - pq;
  }
}

/** Step at which the last two terms are down to rounding, relative to the local amplitudes. */
function stepLength(s) {
  const r0 = R[0], amplitude = Math.sqrt(s.p * s.p + s.f * s.f / r0);
  const varied = Math.sqrt(s.q * s.q + s.v * s.v / r0);
  let h = Infinity;
  for (let k = ORDER - 1; k <= ORDER; k++) {
    const size = Math.max(Math.abs(P[k]) / amplitude, Math.abs(H[k]) / r0,
      Math.abs(Q[k]) / varied, Math.abs(DH[k]) * amplitude / (varied * r0));
    h = Math.min(h, Math.exp(Math.log(TRUNCATION / size) / k));
  }
  return h;
}

function sum(c, h, first) {
  let total = c[ORDER];
  for (let k = ORDER - 1; k >= first; k--) total = total * h + c[k];
  return total;
}

function slope(c, h, first) {
  let total = ORDER * c[ORDER];
  for (let k = ORDER - 1; k >= first; k--) total = total * h + k * c[k];
  return total;
}

/** State after h of sigma; v and q at fixed t. */
function advanced(t, s, h) {
  const dt = h * slope(H, h, 2), p = sum(P, h, 0), f = -slope(P, h, 1);
  const shift = h * slope(DH, h, 2);
  return {
    dt, p, f, z: s.z + h * sum(H, h, 1), v: -slope(Q, h, 1) - p * shift,
    q: sum(Q, h, 0) + f / Math.hypot(t + dt, f) * shift,
  };
}

/** Root of a function within (0, h), by Newton inside a bracket; `value` gives it and its slope and rises or falls. */
function rootWithin(h, rises, value) {
  let low = 0, high = h, s = 0.5 * h;
  for (let round = 0; round < 100; round++) {
    const [miss, rate] = value(s);
    if (miss > 0 === rises) high = s; else low = s;
    let trial = s - miss / rate;
    if (!(low < trial && trial < high)) trial = 0.5 * (low + high);
    if (Math.abs(trial - s) <= 2 * EPS * s) return trial;
    s = trial;
  }
  return s;
}

/** State (tau, f, p, z, v, q) at t of a shot that starts at t = mu << t << sqrt(1 + a^2): series at the tip. */
function tipSeries(a, mu, t) {
  let w = 1 / (1 + a * a);
  const shift = mu * a * Math.sqrt(w), chain = 1 + mu * Math.sqrt(w) * w, b = a + shift;
  w = 1 / (1 + b * b);
  const s = Math.sqrt(w), g = b * s, g1 = s * w, g2 = -3 * b * g1 * w, g3 = -3 * g1 * w + 15 * b * b * g1 * w * w;
  const p1 = -g, p2 = g * g1 / 4, p3 = -(g * g1 * g1 / 36 + g2 * g * g / 24);
  const q1 = -g1, q2 = (g1 * g1 + g * g2) / 4;
  const q3 = -((g1 * g1 * g1 + 2 * g * g1 * g2) / 36 + (g3 * g * g + 2 * g2 * g * g1) / 24);
  const s1 = -b * g1, s2 = (2 * b * b - 1) * g1 * w;
  return {
    tau: t - mu,
    p: b + t * (p1 + t * (p2 + t * p3)),
    f: t * (b + t * (p1 / 2 + t * (p2 / 3 + t * p3 / 4))),
    q: chain * (1 + t * (q1 + t * (q2 + t * q3))),
    v: chain * t * (1 + t * (q1 / 2 + t * (q2 / 3 + t * q3 / 4))),
    z: s * (t - mu) + t * t * (s1 * p1 / 4 + t * (s1 * p2 / 9 + s2 * p1 * p1 / 24)),
  };
}

function start(a, mu, tauEnd) {
  const slant = Math.hypot(1, a), reach = TIP_REACH * slant, end = mu + tauEnd;
  if (mu < TINY_FISH * slant && (mu === 0 || (mu < 1e-6 * reach && mu < 1e-6 * end))) {
    return { ...tipSeries(a, mu, Math.min(reach, end)), ended: end <= reach };
  }
  return { tau: 0, f: mu * a, p: a, z: 0, v: mu, q: 1, ended: tauEnd <= 0 };
}

/**
 * Shot of offset a from t = mu over tauEnd of cable, or to its n-th zero of q where `fold` is n > 0.
 * Returns tau, f, p, z, v, q at its end and the zeros of q passed; null where it does not end. `look(tau, f, p, z)` is
 * shown `fine` points a step.
 */
function shoot(a, mu, tauEnd, fold = 0, look = null, fine = 12) {
  let s = start(a, mu, tauEnd), low = 0, count = 0;
  if (look) look(0, mu * a, a, 0);
  if (s.ended) return { ...s, count };
  for (let steps = 0; steps < MOST_STEPS; steps++) {
    const t = mu + (s.tau + low), remaining = (tauEnd - s.tau) - low;
    expand(t, s);
    let h = stepLength(s), ended = false;
    if (!(h * slope(H, h, 2) * h < Infinity)) h = Math.min(h, 1e100);
    if (!(h * slope(H, h, 2) < remaining)) {
      h = rootWithin(h, true, (x) => [x * slope(H, x, 2) - remaining, Math.hypot(H[1] + x * slope(H, x, 2), slope(P, x, 1))]);
      ended = true;
    }
    let next = advanced(t, s, h);
    // dv/dt = q: where v moved against the sign of q, two zeros of q hide in this step.
    while (s.q < 0 === next.q < 0 && s.v * next.v < 0 && (next.v - s.v) * s.q < 0) {
      h *= 0.5;
      ended = false;
      next = advanced(t, s, h);
    }
    if (!Number.isFinite(next.p) || !Number.isFinite(next.q)) return null;
    if (s.q < 0 !== next.q < 0) {
      count++;
      if (count === fold) {
        const falls = s.q > 0;
        h = rootWithin(h, !falls, (x) => {
          const at = advanced(t, s, x), tt = t + at.dt, r2 = tt * tt + at.f * at.f;
          return [at.q, -tt * tt * at.v / r2];
        });
        next = advanced(t, s, h);
        ended = true;
      }
    }
    if (look) {
      for (let k = 1; k <= fine; k++) {
        const at = advanced(t, s, h * k / fine);
        look(s.tau + low + at.dt, at.f, at.p, at.z);
      }
    }
    const add = next.dt + low, total = s.tau + add, part = total - s.tau;
    low = (s.tau - (total - part)) + (add - part);
    s = { tau: total, f: next.f, p: next.p, z: next.z, v: next.v, q: next.q };
    if (ended) return { ...s, count };
  }
  return null;
}

/** Offset of the fish at every threshold, sqrt(1 + w_f^2) - w_f. */
const thresholdOffset = (wf) => 1 / (wf + Math.hypot(1, wf));
/** Length beyond that at which the n-th transition begins, Eq. (36) for n = 1. */
const excessLength = (lam, wf, n) => (lam - (2 * n - 1)) - thresholdOffset(wf);
/** How many transitions a cable has. */
const transitions = (lam, wf) => Math.max(0, Math.ceil(0.5 * (lam + 1 - thresholdOffset(wf))) - 1);

/** Half waves of the straight cable, and shapes there may be: what a search costs (SECONDS_A_HALF_WAVE in the package). */
function workOf(lam, wf, gamma) {
  const waves = 2 / Math.PI * gamma * lam / (Math.sqrt(wf + lam) + Math.sqrt(wf));
  return waves * (1 + 2 * Math.min(transitions(lam, wf) + 1, waves));
}

function firstGuess(lam, wf, excess, n) {
  const m = Math.sqrt(wf / lam), phase = Math.PI * (n - 1) + 1 / (m + 4 / (3 * Math.PI));
  const gamma2 = (0.5 * phase * (Math.hypot(1, m) + m)) ** 2 / excess;
  const bent = 1.5 * (1 + (n - 1) / (1 + m)) / Math.cbrt(excess);
  return [Math.log(gamma2 * thresholdOffset(wf) + bent), 0.5 * Math.log(gamma2)];
}

/**
 * The n-th critical state of a cable: {n, gamma, a, x_f, R_x0, z_f, tension}; null where there is none or it is lost in
 * rounding. `guess` is another such state, of a cable near by.
 */
function criticalState(lam, wf, n, guess = null) {
  const excess = excessLength(lam, wf, n);
  const rounding = EPS * (1 + lam / excess);
  if (!(excess > 0) || 48 * rounding > 1e-4) return null;
  const found = guess ? solveFold(lam, wf, n, excess, rounding, [Math.log(guess.a), Math.log(guess.gamma)]) : null;
  return found || solveFold(lam, wf, n, excess, rounding, firstGuess(lam, wf, excess, n));
}

function solveFold(lam, wf, n, excess, rounding, x) {
  const difference = 1e-6 + Math.sqrt(rounding);
  const shot = (logA, logGamma) => {
    const a = Math.exp(logA), mu = wf * Math.exp(2 * logGamma), end = shoot(a, mu, Infinity, n);
    if (!end) return null;
    const p = Math.abs(end.p), d = Math.max(excessLength(end.tau / p, mu / p, n), EPS * end.tau / p);
    return { a, mu, end, p, miss: [Math.log(p) - 2 * logGamma, Math.log(d / excess)] };
  };
  let jac = null, step = null, before = null, size = Infinity, retreats = 0;
  for (let round = 0; round < 60; round++) {
    const here = shot(x[0], x[1]);
    if (!here) {
      if (!step || ++retreats > 20) return null;
      step = step.map((part) => 0.5 * part);
      x = x.map((value, k) => value - step[k]);
      jac = null;
      continue;
    }
    const fresh = !jac;
    if (fresh) {
      const sides = [shot(x[0] + difference, x[1]), shot(x[0], x[1] + difference)];
      if (!sides[0] || !sides[1]) return null;
      jac = [0, 1].map((i) => sides.map((side) => (side.miss[i] - here.miss[i]) / difference));
    } else {
      // Broyden's update.
      const norm = step[0] ** 2 + step[1] ** 2;
      jac = jac.map((row, i) => {
        const off = here.miss[i] - before[i] - row[0] * step[0] - row[1] * step[1];
        return row.map((value, k) => value + off * step[k] / norm);
      });
    }
    const determinant = jac[0][0] * jac[1][1] - jac[0][1] * jac[1][0];
    let next = [(jac[0][1] * here.miss[1] - jac[1][1] * here.miss[0]) / determinant,
      (jac[1][0] * here.miss[0] - jac[0][0] * here.miss[1]) / determinant];
    const long = Math.max(Math.abs(next[0]), Math.abs(next[1]));
    if (!Number.isFinite(long)) return null;
    if (long <= 8 * rounding || (long < 1e-9 + 100 * rounding && !fresh && long > 0.5 * size)) {
      return stateOf(lam, wf, n, here);
    }
    if (!(long < 0.05 && (fresh || long < 0.5 * size))) jac = null;
    size = long;
    step = next.map((part) => part * Math.min(1, 1 / long));
    before = here.miss;
    x = x.map((value, k) => value + step[k]);
  }
  return null;
}

function stateOf(lam, wf, n, { a, end, p }) {
  const sign = n % 2 ? -1 : 1, reaction = sign * end.f / p;
  return {
    n, a, gamma: Math.sqrt(p), R_x0: reaction, x_f: sign * a / p, z_f: end.z / p, tension: Math.hypot(wf + lam, reaction),
  };
}

let lastCable = { lam: NaN, wf: NaN, states: [] };

/** Critical states of a cable in rising order, two at least, those up to gamma and one beyond; no more than `most`. */
function criticalStates(lam, wf, gamma, most) {
  if (lastCable.lam !== lam || lastCable.wf !== wf) lastCable = { lam, wf, states: [] };
  const { states } = lastCable, there = Math.min(transitions(lam, wf), most);
  // What is kept may reach beyond what is asked for now.
  const found = [];
  while (found.length < there && !(found.length >= 2 && found[found.length - 1].gamma > gamma)) {
    const state = states[found.length] ?? criticalState(lam, wf, found.length + 1);
    if (!state) break;
    states[found.length] = state;
    found.push(state);
  }
  return found;
}
