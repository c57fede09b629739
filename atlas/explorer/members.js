"use strict";
// Equilibria of one cable at one speed in a vacuum, each found by its place in the count of zeros of q = dp/da along the
// shot, which falls as the offset grows: nothing is scanned, nothing missed (docs/proofs.md, Theorem 6; solve/members.py).

const LINEAR = 1e-12, BEYOND = 1.01, LAST_STEP = 1e-8, CLEAR = 1e-4, CLOSE = 0.1, ROUNDS = 200;

/** Inner or outer member of the n-th pair; n = 0 is the shape without nodes. null where the n-th fold is not passed. */
function member(lam, wf, gamma, n, outer = false, guess = NaN) {
  const gamma2 = gamma * gamma, mu = gamma2 * wf, tau = gamma2 * lam;
  const sign = n % 2 ? -1 : 1, side = outer ? -1 : 1, piece = n - (outer ? 1 : 0);
  let low = Math.log(LINEAR * Math.min(1, gamma2)), high = Math.log(BEYOND * gamma2 * (1 + lam));
  let lowEnd = null, highEnd = null, x = Math.log(guess), old = null;
  if (!(x > low && x < high)) x = 0.5 * (low + high);
  for (let round = 0; round < ROUNDS; round++) {
    const a = Math.exp(x), end = shoot(a, mu, tau);
    if (!end) return null;
    const miss = sign * end.p / gamma2 - 1, rate = sign * a * end.q / gamma2, here = end.count === piece;
    const above = end.count < piece || (here && (miss >= 0) !== outer);
    const bound = { x, count: end.count, rate, miss };
    if (above) { high = x; highEnd = bound; } else { low = x; lowEnd = bound; }
    const width = high - low, [peak, top] = tangents(n, lowEnd, highEnd);
    const beside = end.count === n || end.count === n - 1;
    const [step, reach] = stepTo(x, rate, miss, side, here, beside, old);
    const narrow = width <= 4 * EPS * Math.max(1, Math.abs(x));
    const held = lowEnd !== null && highEnd !== null && lowEnd.count === highEnd.count;
    const noise = held && old !== null && Math.abs(step) >= 0.5 * Math.abs(old.step);
    const landed = here && Math.abs(step) <= LAST_STEP && (Math.abs(step) <= CLEAR * reach || noise);
    if (landed || (held && narrow)) {
      return finished(lam, wf, gamma2, n, outer, a, landed ? step : 0, end, sign);
    }
    if ((top < 0 && width * (1 + n) < CLOSE) || narrow) return null;
    const trial = Number.isFinite(step) ? x + step : peak;
    old = { x, rate, step };
    x = trial > low && trial < high && round % 8 !== 7 ? trial : 0.5 * (low + high);
  }
  return null;
}

/** Where the tangents at two shots astride the n-th extremum meet, and a bound of its height. */
function tangents(n, low, high) {
  if (!low || !high || low.count !== n || high.count !== n - 1) return [NaN, NaN];
  const fall = low.rate - high.rate;
  if (!(fall > 0)) return [NaN, NaN];
  const share = (high.miss - low.miss - high.rate * (high.x - low.x)) / fall, top = low.miss + low.rate * share;
  return [low.x + share, top + 0.1 * (top - Math.min(low.miss, high.miss))];
}

/** Step in log a to the root whose slope has the sign of `side`, by curvature where it is known, and the way to the extremum. */
function stepTo(x, rate, miss, side, here, beside, old) {
  const newton = here && rate * side > 0 ? -miss / rate : NaN;
  if (!old || !beside) return [newton, NaN];
  const apart = x - old.x, curvature = (rate - old.rate) / apart;
  const root = side * Math.sqrt(rate * rate - 2 * curvature * miss);
  const quadratic = rate * side >= 0 ? -2 * miss / (rate + root) : (root - rate) / curvature;
  if (!(Math.abs(apart) < CLOSE && Number.isFinite(quadratic))) return [newton, NaN];
  return [quadratic, Math.abs(rate / curvature)];
}

function finished(lam, wf, gamma2, n, outer, a, shift, end, sign) {
  const mu = wf * gamma2, t = mu + end.tau, da = a * shift, scale = sign / gamma2;
  const terms = [end.f * end.v / Math.hypot(t, end.f), end.p * end.q, -mu * a / Math.hypot(1, a), -a];
  const noisy = EPS * a * terms.reduce((total, term) => total + Math.abs(term), 0) > 0.1 * end.tau;
  // Depth is a difference of H, whose slope cancels under a heavy fish; what is left of it is second order in the shift.
  const zSlope = noisy ? 0 : terms.reduce((total, term) => total + term, 0);
  const reaction = scale * (end.f + end.v * da);
  return {
    n, outer, a: a + da, R_x0: reaction, x_f: scale * (a + da), r_f: (a + da) / gamma2,
    z_f: (end.z + zSlope * da) / gamma2, tension: Math.hypot(wf + lam, reaction),
    name: n ? `${n} ${outer ? "outer" : "inner"}` : "outward",
  };
}

/** All equilibria in rising order of R_x0; null where one could not be had. */
function equilibria(lam, wf, gamma) {
  const gamma2 = gamma * gamma, linear = shoot(LINEAR * Math.min(1, gamma2), gamma2 * wf, gamma2 * lam);
  if (!linear) return null;
  const found = [], last = Math.min(linear.count, transitions(lam, wf) + 1);
  for (let n = 0; n <= last; n++) {
    const inner = member(lam, wf, gamma, n);
    if (!inner) {
      if (n === 0) return null;
      break;
    }
    found.push(inner);
    if (n > 0) {
      const outer = member(lam, wf, gamma, n, true);
      if (!outer) return null;
      found.push(outer);
    }
  }
  return found.sort((one, other) => one.R_x0 - other.R_x0);
}

/** Points (x, z, T) along a shape, from the fish up to the tow point; lengths over the tow radius. */
function curveOf(lam, wf, gamma, shape) {
  const gamma2 = gamma * gamma, mu = gamma2 * wf, scale = (shape.n % 2 ? -1 : 1) / gamma2, points = [];
  shoot(shape.a, mu, gamma2 * lam, 0, (tau, f, p, z) => {
    points.push([scale * p, z / gamma2, Math.hypot(mu + tau, f) / gamma2]);
  });
  const depth = points[points.length - 1][1];
  return points.map(([x, z, tension]) => [x, depth - z, tension]);
}
