"use strict";
// Which shapes last in a vacuum: small motions about a shape, as exp(sigma t) in units of Omega, by the equations of
// kernels/variation.py without drag. With s = -sigma^2, and the motion across the plane of the shape over sigma, they are
// polynomials in s: D(s), zero at the motions there are, is entire, and real for real s. What grows has |s| <= 1
// (docs/proofs.md, Theorem 9), and is no s from 0 up. D on a circle around that disc gives its Taylor series, and with it
// guesses of its zeros. A shape lasts if D changes sign from 0 to the circle as often as it turns round 0 on it.

// The circle, and another where a zero lies on it; points of the upper half, twice as many as long as D turns too far between
// two or the series does not end.
const CIRCLES = [1.2, 1.1], HALVES = [16, 32, 64], FAR = 2, ENDED = 1e-9;
// Steps of the shot are shortened to this, so that waves are resolved, too; their number, and nodes, at most:
// beyond, rounding hides the zeros.
const RESOLVED = 0.9, MOST_PIECES = 200, MOST_NODES = 3;
// Zeros of the series, and of D; how far apart they may be, how far off the line a real one; and a weak growth, as in the package.
const ROUNDED = 1e-14, MOST_ROUNDS = 60, GUESSED = 1e-9, POLISHED = 1e-10, ASTRAY = 0.02, ON_LINE = 1e-5, WEAK_GROWTH = 0.01;

/** What D is made of: along each step the tension and the direction across the cable, as series scaled to the step. */
function motionOf(a, mu, tauEnd) {
  let s = start(a, mu, tauEnd);
  const tip = mu + s.tau, pieces = [];
  if (s.ended) return null;
  for (let ended = false; !ended;) {
    const t = mu + s.tau, remaining = tauEnd - s.tau;
    if (pieces.length === MOST_PIECES) return null;
    expand(t, s);
    let h = RESOLVED * stepLength(s);
    if (!(h * slope(H, h, 2) < remaining)) {
      h = rootWithin(h, true, (x) => [x * slope(H, x, 2) - remaining, Math.hypot(H[1] + x * slope(H, x, 2), slope(P, x, 1))]);
      ended = true;
    }
    const piece = { h, r: new Float64Array(ORDER), x: new Float64Array(ORDER), z: new Float64Array(ORDER) };
    for (let k = 0, power = 1; k < ORDER; k++, power *= h) {
      piece.r[k] = R[k] * power;
      let [x, z] = [(k + 1) * H[k + 1] * power, -(k + 1) * P[k + 1] * power];
      for (let j = 1; j <= k; j++) {
        x -= piece.r[j] * piece.x[k - j];
        z -= piece.r[j] * piece.z[k - j];
      }
      piece.x[k] = x / R[0];
      piece.z[k] = z / R[0];
    }
    pieces.push(piece);
    const next = advanced(t, s, h);
    if (!Number.isFinite(next.p)) return null;
    s = { ...next, tau: s.tau + next.dt };
  }
  return { tip, pieces };
}

// Positions and forces of three solutions as series: by part, of x, Y = y / sigma and z.
const WAY = [0, 1, 2].map(() => Array.from({ length: 6 }, () => new Float64Array(ORDER + 1)));
const PUSH = [0, 1, 2].map(() => Array.from({ length: 6 }, () => new Float64Array(ORDER + 1)));
const LOAD = Array.from({ length: 6 }, () => new Float64Array(ORDER + 1)), ACROSS = [new Float64Array(ORDER + 1), new Float64Array(ORDER + 1)];

/** Load of a unit of mass of order k, of one solution: by x, Y, z, real and imaginary parts. */
function load(way, k, re, im) {
  const [x, xi, y, yi, z, zi] = way;
  LOAD[0][k] = (1 + re) * x[k] - im * xi[k] - 2 * (re * y[k] - im * yi[k]);
  LOAD[1][k] = (1 + re) * xi[k] + im * x[k] - 2 * (re * yi[k] + im * y[k]);
  LOAD[2][k] = (1 + re) * y[k] - im * yi[k] - 2 * x[k];
  LOAD[3][k] = (1 + re) * yi[k] + im * y[k] - 2 * xi[k];
  LOAD[4][k] = re * z[k] - im * zi[k];
  LOAD[5][k] = re * zi[k] + im * z[k];
}

function marchPiece({ h, r, x, z }, way, push, re, im) {
  for (let k = 0; k < ORDER; k++) {
    const step = h / (k + 1);
    load(way, k, re, im);
    for (let part = 0; part < 2; part++) {
      let across = 0, alongX = 0, alongZ = 0;
      const pushX = push[part], pushZ = push[4 + part], kept = ACROSS[part];
      for (let j = 0; j <= k; j++) across += x[j] * pushX[k - j] + z[j] * pushZ[k - j];
      kept[k] = across;
      for (let j = 0; j <= k; j++) {
        alongX += x[j] * kept[k - j];
        alongZ += z[j] * kept[k - j];
      }
      way[part][k + 1] = -step * alongX;
      way[2 + part][k + 1] = -step * push[2 + part][k];
      way[4 + part][k + 1] = -step * alongZ;
    }
    for (let row = 0; row < 6; row++) {
      let total = 0;
      const one = LOAD[row];
      for (let j = 0; j <= k; j++) total += r[j] * one[k - j];
      push[row][k + 1] = step * total;
    }
  }
}

/** D at s, as [real part, imaginary part, logarithm of what both are to be multiplied by]. */
function evans({ tip, pieces }, re, im) {
  for (let one = 0; one < 3; one++) {
    for (let row = 0; row < 6; row++) WAY[one][row][0] = row === 2 * one ? 1 : 0;
    load(WAY[one], 0, re, im);
    for (let row = 0; row < 6; row++) PUSH[one][row][0] = tip * LOAD[row][0];
  }
  let scale = 0;
  for (const piece of pieces) {
    let largest = 0;
    for (let one = 0; one < 3; one++) {
      marchPiece(piece, WAY[one], PUSH[one], re, im);
      for (const series of [...WAY[one], ...PUSH[one]]) {
        let total = series[ORDER];
        for (let k = ORDER - 1; k >= 0; k--) total += series[k];
        series[0] = total;
        largest = Math.max(largest, Math.abs(total));
      }
    }
    for (let one = 0; one < 3; one++) for (const series of [...WAY[one], ...PUSH[one]]) series[0] /= largest;
    scale += Math.log(largest);
  }
  const at = (one, row) => [WAY[one][2 * row][0], WAY[one][2 * row + 1][0]];
  const minor = (i, j) => minus(times(at(1, i), at(2, j)), times(at(1, j), at(2, i)));
  const terms = [[0, 1, 2], [1, 2, 0], [2, 0, 1]].map(([i, j, k]) => times(at(0, i), minor(j, k)));
  return [terms[0][0] + terms[1][0] + terms[2][0], terms[0][1] + terms[1][1] + terms[2][1], 3 * scale];
}

const times = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
const plus = ([a, b], [c, d]) => [a + c, b + d];
const minus = ([a, b], [c, d]) => [a - c, b - d];
const over = ([a, b], [c, d]) => times([a, b], [c / (c * c + d * d), -d / (c * c + d * d)]);
const size = ([a, b]) => Math.hypot(a, b);

/** The series of D on a circle, over exp(most), and how often D turns round 0; null where neither can be told. A job. */
function* roundOf(motion, circle) {
  let upper = [];
  for (const half of HALVES) {
    const known = upper;
    upper = [];
    for (let k = 0; k <= half; k++) {
      const angle = Math.PI * k / half;
      upper.push(known.length && k % 2 === 0 ? known[k / 2] : evans(motion, circle * Math.cos(angle), circle * Math.sin(angle)));
      yield;
    }
    const most = Math.max(...upper.map(([re, im, log]) => Math.log(size([re, im])) + log));
    if (!Number.isFinite(most)) return null;
    // Real at both ends, but for rounding.
    const values = upper.map(([re, im, log], k) => [re, k % half ? im : 0].map((part) => part * Math.exp(log - most)));
    const turns = values.slice(1).map((value, k) => { const [c, d] = over(value, values[k]); return Math.atan2(d, c); });
    const series = seriesOf(values), largest = Math.max(...series.map(Math.abs));
    if (turns.every((turn) => Math.abs(turn) < FAR) && Math.max(...series.slice(-2).map(Math.abs)) < ENDED * largest) {
      return { circle, series, most, count: Math.round(turns.reduce((total, turn) => total + turn, 0) / Math.PI) };
    }
  }
  return null;
}

/** Taylor coefficients on the circle of what is known on its upper half. */
function seriesOf(values) {
  const half = values.length - 1;
  return Array.from({ length: half }, (_, n) => {
    let total = 0;
    for (let k = 0; k <= half; k++) {
      const angle = Math.PI * ((k * n) % (2 * half)) / half;
      total += (k % half ? 2 : 1) * (values[k][0] * Math.cos(angle) + values[k][1] * Math.sin(angle));
    }
    return total / (2 * half);
  });
}

/** Zeros within the unit circle of a polynomial of real coefficients, by the method of Aberth and Ehrlich. */
function zerosOf(series) {
  const most = Math.max(...series.map(Math.abs)), last = series.findLastIndex((one) => Math.abs(one) > ROUNDED * most);
  const re = Float64Array.from({ length: last }, (_, k) => Math.cos(2 * Math.PI * k / last + 0.4));
  const im = Float64Array.from({ length: last }, (_, k) => Math.sin(2 * Math.PI * k / last + 0.4));
  for (let round = 0, moved = 1; round < MOST_ROUNDS && moved > GUESSED; round++) {
    moved = 0;
    for (let i = 0; i < last; i++) {
      const x = re[i], y = im[i];
      let a = 0, b = 0, c = 0, d = 0, near = 0, beside = 0;
      for (let k = last; k >= 0; k--) {
        [c, d] = [c * x - d * y + a, c * y + d * x + b];
        [a, b] = [a * x - b * y + series[k], a * y + b * x];
      }
      for (let j = 0; j < last; j++) {
        if (j === i) continue;
        const dx = x - re[j], dy = y - im[j], square = dx * dx + dy * dy;
        near += dx / square;
        beside -= dy / square;
      }
      const newton = over([a, b], [c, d]), step = over(newton, minus([1, 0], times(newton, [near, beside])));
      if (!Number.isFinite(size(step))) continue;
      re[i] = x - step[0];
      im[i] = y - step[1];
      moved = Math.max(moved, size(step) / Math.max(1, Math.hypot(x, y)));
    }
  }
  return Array.from(re, (x, k) => [x, im[k]]).filter((zero) => size(zero) < 1);
}

/** The zero of D near s, by secants; null where there is none. */
function polished(motion, most, s) {
  const value = ([re, im]) => {
    const [a, b, log] = evans(motion, re, im);
    return [a, b].map((part) => part * Math.exp(log - most));
  };
  let before = plus(s, [1e-5, 1e-5]), here = s, old = value(before);
  for (let round = 0; round < 12; round++) {
    const now = value(here), step = times(now, over(minus(here, before), minus(now, old)));
    if (!(size(step) < ASTRAY)) return null;
    [before, here, old] = [here, minus(here, step), now];
    if (size(step) < POLISHED) return size(minus(here, s)) < ASTRAY ? here : null;
  }
  return null;
}

/** sigma of s, that which grows: its real and imaginary part. */
function sigmaOf([re, im]) {
  const length = Math.hypot(re, im);
  return [Math.sqrt(Math.max(0, 0.5 * (length - re))), Math.sqrt(Math.max(0, 0.5 * (length + re)))];
}

/**
 * What becomes of a small push to a shape of a cable at a speed: {kind, growth, frequency}, of the motion that grows most, over
 * sqrt(g/R), the kind as of towatlas.stability, and `squares`, s of the swings of one that lasts; null where it cannot be told.
 * A job: it pauses where a page may draw.
 */
function* verdictOf(lam, wf, gamma, shape) {
  if (shape.n > MOST_NODES) return null;
  const motion = motionOf(shape.a, gamma * gamma * wf, gamma * gamma * lam);
  if (!motion) return null;
  const round = (yield* roundOf(motion, CIRCLES[0])) ?? (yield* roundOf(motion, CIRCLES[1]));
  if (!round) return null;
  const zeros = zerosOf(round.series).map((zero) => zero.map((part) => round.circle * part));
  if (zeros.length !== round.count) return null;
  const onLine = (zero) => zero[0] > 0 && Math.abs(zero[1]) < ON_LINE;
  const real = zeros.filter(onLine).map(([re]) => re).sort((one, other) => one - other);
  if (real.length === round.count) {
    const between = [0, ...real.slice(1).map((one, k) => 0.5 * (one + real[k])), round.circle];
    const signs = between.map((s) => Math.sign(evans(motion, s, 0)[0]));
    return signs.every((sign, k) => k === 0 || sign === -signs[k - 1]) ? { kind: "stable", growth: 0, frequency: 0, squares: real } : null;
  }
  const found = [];
  for (const zero of zeros.filter((one) => !onLine(one) && one[1] > -ON_LINE)) {
    const at = polished(motion, round.most, zero);
    yield;
    if (!at || onLine(at) || found.some((other) => size(minus(at, other)) < ON_LINE)) return null;
    found.push(Math.abs(at[1]) < ON_LINE ? [at[0], 0] : at);
  }
  // Pairs and real ones.
  if (found.reduce((total, [, im]) => total + (im ? 2 : 1), real.length) !== round.count) return null;
  const [growth, frequency] = found.map(sigmaOf).sort((one, other) => other[0] - one[0])[0];
  return { kind: growth < WEAK_GROWTH ? "weak" : frequency ? "flutter" : "divergence", growth: growth * gamma, frequency: frequency * gamma };
}
