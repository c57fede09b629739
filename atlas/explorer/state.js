"use strict";
// What is on show: a cable and its speed in SI, and the shapes it can take, computed here or read off the scene's table.

const known = JSON.parse(document.getElementById("known").textContent);
const KNOT = 1852 / 3600;
// Work above which shapes are not looked for in a page (workOf): some seconds; and for whole curves: less for each.
const MOST_WORK = 2000, CURVE_WORK = 1000;
const MOST_STATES = 40;
const state = { scene: 0, model: "drag", picked: null, unit: "kn", length: 1, mass_per_length: 1, fish_mass: 0, radius: 1, speed: 1, gravity: GRAVITY, title: "", density: 0, displaced_per_length: 0, diameter: null, drag_coefficient: null };
// What sliders move about.
const middle = {};
const CABLE_KEYS = ["length", "mass_per_length", "fish_mass", "radius"];

const tableHere = () => known.tables[state.scene] ?? null;
/** Whether the cable on show is that of the table. */
const isTabulated = () => tableHere() !== null && [...CABLE_KEYS, "gravity"].every((key) => state[key] === tableHere().scene[key]);
const withDrag = () => state.model === "drag" && isTabulated();
/** Whether the speed lies beyond those of the table on show. */
const isBeyond = () => withDrag() && !(tableHere().low <= state.speed && state.speed <= tableHere().high);

// A fluid is dense where the cable displaces more than this share of its mass: `tolerance` of a scene that gives none.
const NONDENSE = 0.01;
/** What of the fluid the model on show leaves out. */
function leftOut() {
  const model = withDrag() ? tableHere().model : "vacuum", found = [];
  if (state.density > 0 && model === "vacuum") found.push("drag");
  if (model !== "water" && state.displaced_per_length > NONDENSE * state.mass_per_length) found.push("buoyancy");
  return found;
}

function groups() {
  const { length, mass_per_length, fish_mass, radius, speed, gravity } = state, unit = Math.sqrt(radius * gravity);
  return { lam: length / radius, wf: fish_mass / (mass_per_length * radius), gamma: speed / unit, unit, force: mass_per_length * gravity * radius };
}

const perUnit = (unit) => ({ kn: KNOT, "m/s": 1, rpm: state.radius * Math.PI / 30 })[unit];
const speedIn = (speed, unit = state.unit) => speed / perUnit(unit);
const speedText = (speed, count = 3) => `${digits(speedIn(speed), count)} ${state.unit}`;

/** Shapes at the speed, from the axis outwards, in SI; null where they are too many to look for. */
function shapesNow() {
  const found = withDrag() ? tabulatedShapes(tableHere(), state.speed) : computedShapes(groups());
  return found && found.sort((one, other) => one.r_f - other.r_f);
}

function computedShapes({ lam, wf, gamma, force }) {
  if (!(workOf(lam, wf, gamma) < MOST_WORK)) return null;
  const found = equilibria(lam, wf, gamma);
  if (!found) return null;
  const median = found.length >> 1, rate = Math.sqrt(state.gravity / state.radius);
  return found.map((shape, k) => ({
    name: shape.name, nodes: shape.n, r_f: shape.r_f * state.radius, z_f: shape.z_f * state.radius,
    tension: shape.tension * force, expected: k === median, ...inSeconds(knownVerdict(lam, wf, gamma, shape), rate),
    judge: () => judged(lam, wf, gamma, shape),
    curve: () => curveOf(lam, wf, gamma, shape).reverse().map(([x, z, tension]) => [x * state.radius, 0, z * state.radius, tension * force]),
  }));
}

// Verdicts by cable, speed and shape: those of the shape without a node and of outer ones are proved, those of others computed.
const verdicts = new Map(), MOST_VERDICTS = 5000;
const NOT_TOLD = { kind: "rotation", growth: null, frequency: null };
const verdictKey = (lam, wf, gamma, shape) => `${lam} ${wf} ${gamma} ${shape.name}`;

function knownVerdict(lam, wf, gamma, shape) {
  if (shape.outer || !shape.n) return { kind: shape.outer ? "divergence" : "stable", growth: null, frequency: null };
  return verdicts.get(verdictKey(lam, wf, gamma, shape)) ?? { kind: "pending", growth: null, frequency: null };
}

/** The verdict of a shape, computed where it is not known. A job. */
function* judged(lam, wf, gamma, shape) {
  const known = knownVerdict(lam, wf, gamma, shape);
  if (known.kind !== "pending") return known;
  const found = (yield* verdictOf(lam, wf, gamma, shape)) ?? NOT_TOLD;
  if (verdicts.size >= MOST_VERDICTS) verdicts.clear();
  verdicts.set(verdictKey(lam, wf, gamma, shape), found);
  return found;
}

const inSeconds = ({ kind, growth, frequency }, rate) => ({
  kind, growth: growth === null ? null : growth * rate, frequency: frequency === null ? null : frequency * rate / (2 * Math.PI),
});

/** Verdicts of shapes that have none yet. A job. */
function* judgedAll(shapes, done) {
  for (const shape of shapes) if (shape.kind === "pending") yield* shape.judge();
  done();
}

function tabulatedShapes(table, speed) {
  const found = [];
  for (const branch of table.branches) {
    const ends = [branch.points[0].value, branch.points[branch.points.length - 1].value];
    if (!(ends[0] <= speed && speed <= ends[1])) continue;
    const at = (name) => along(branch.value, branch[name], speed);
    const near = Math.abs(branch.value[nearest(branch.value, speed)] - speed);
    const k = branch.value.findIndex((value) => Math.abs(value - speed) === near);
    found.push({
      name: branch.name, nodes: branch.nodes[k], r_f: at("r_f"), z_f: at("z_f"), tension: at("tension"), kind: kindAt(branch, speed),
      growth: branch.growth[k], frequency: branch.frequency[k], expected: false, curve: () => tabulatedCurve(branch.shapes, speed, table.scene.length),
    });
  }
  const inner = found.filter((shape) => shape.name.endsWith("inner"));
  const order = inner.length ? inner.sort((a, b) => parseInt(b.name, 10) - parseInt(a.name, 10)) : [...found].sort((a, b) => a.r_f - b.r_f);
  if (order.length) order[0].expected = true;
  return found;
}

function kindAt(branch, speed) {
  let k = branch.points.findIndex((point) => point.value >= speed) - 1;
  k = Math.min(Math.max(k, 0), branch.between.length - 1);
  return branch.between[k];
}

function nearest(values, value) {
  let best = 0;
  values.forEach((one, k) => { if (Math.abs(one - value) < Math.abs(values[best] - value)) best = k; });
  return best;
}

/** Place of a value between two of a rising list: the lower one, and the share of the way. */
function placeOf(values, value) {
  let k = values.findIndex((one) => one > value) - 1;
  if (k < -1 || k >= values.length - 1) k = values.length - 2;
  k = Math.max(0, k);
  if (values.length < 2) return [0, 0];
  return [k, Math.min(1, Math.max(0, (value - values[k]) / (values[k + 1] - values[k])))];
}

function along(values, heights, value) {
  const [k, share] = placeOf(values, value);
  return share ? heights[k] + share * (heights[k + 1] - heights[k]) : heights[k];
}

/** Points [x, y, z, tension] from the tow point down, between two tabulated shapes. */
function tabulatedCurve(shapes, speed, length) {
  if (!shapes.whole) {
    const bytes = Uint8Array.from(atob(shapes.packed), (one) => one.charCodeAt(0)), view = new DataView(bytes.buffer);
    shapes.whole = Float64Array.from({ length: bytes.length / 2 }, (_, k) => view.getInt16(2 * k, true) / 32767);
  }
  const [row, share] = placeOf(shapes.value, speed), count = shapes.points;
  const of = (k, part, at) => shapes.whole[(k * 4 + part) * count + at] * [shapes.width, shapes.width, length, shapes.largest[k]][part];
  const next = Math.min(row + 1, shapes.value.length - 1);
  return Array.from({ length: count }, (_, at) => [0, 1, 2, 3].map((part) => (1 - share) * of(row, part, at) + share * of(next, part, at)));
}

/** A curve through points given: cubic, so that bends show no corners. */
function smooth(points, times = 4) {
  if (points.length > 200) return points;
  const found = [];
  for (let k = 0; k + 1 < points.length; k++) {
    const [a, b, c, d] = [points[Math.max(0, k - 1)], points[k], points[k + 1], points[Math.min(points.length - 1, k + 2)]];
    for (let j = 0; j < times; j++) {
      const s = j / times;
      found.push(b.map((value, i) => value + 0.5 * s * (c[i] - a[i] + s * (2 * a[i] - 5 * b[i] + 4 * c[i] - d[i] + s * (3 * (b[i] - c[i]) + d[i] - a[i])))));
    }
  }
  return [...found, points[points.length - 1]];
}

// Work in the background, a slice at a time: a new job of a name takes the place of the old one.
const jobs = new Map();
let ticking = false;

function background(name, job) {
  jobs.set(name, job);
  if (!ticking) {
    ticking = true;
    setTimeout(tick);
  }
}

function tick() {
  const until = performance.now() + 12;
  while (jobs.size && performance.now() < until) {
    const [name, job] = jobs.entries().next().value;
    if (job.next().done && jobs.get(name) === job) jobs.delete(name);
  }
  ticking = jobs.size > 0;
  if (ticking) setTimeout(tick);
}

// Points of a branch without drag; at every so many of them what becomes of the shape is computed, and between these where it
// may change: windows of flutter narrower than a share of the speed may be missed, and edges are known to one.
const ALONG = 48, JUDGED = 2, NARROW = 0.01, EDGE = 0.001;

/**
 * Branches over the speed without drag, from each fold on, in stretches of one kind: {n, outer, folded, kind, points}, points of
 * {gamma, r_f, tension}. `show` is given them first with kinds that are pending, then as they are. A job.
 */
function* branchesOf(lam, wf, low, high, show) {
  const found = [], states = criticalStates(lam, wf, high, MOST_STATES);
  for (let n = 0; n <= states.length; n++) {
    const fold = n ? states[n - 1] : null;
    if (fold && fold.gamma >= high) break;
    for (const outer of n ? [false, true] : [false]) {
      const points = fold ? [{ gamma: fold.gamma, r_f: Math.abs(fold.x_f), tension: fold.tension }] : [];
      const begin = fold ? Math.max(fold.gamma, 0.999 * low) : 0.999 * low;
      let guess = NaN;
      for (let k = fold && fold.gamma >= low ? 1 : 0; k <= ALONG; k++) {
        const share = (k / ALONG) ** (fold ? 2 : 1), gamma = begin + share * (high - begin);
        const shape = member(lam, wf, gamma, n, outer, guess);
        if (shape) {
          points.push({ gamma, r_f: shape.r_f, tension: shape.tension, shape });
          guess = shape.a;
        }
        yield;
      }
      found.push({ n, outer, folded: n > 0, points, kind: outer ? "divergence" : n ? "pending" : "stable" });
    }
  }
  show(found);
  if (!found.some((one) => one.kind === "pending")) return;
  const stretches = [];
  for (const branch of found) {
    if (branch.kind === "pending") stretches.push(...yield* stretchesOf(lam, wf, branch));
    else stretches.push(branch);
  }
  show(stretches);
}

/** Stretches of one kind of a branch of inner shapes. A job. */
function* stretchesOf(lam, wf, branch) {
  const at = function* (point) { return { ...point, verdict: yield* judged(lam, wf, point.gamma, point.shape) }; };
  const samples = [];
  for (const [k, point] of branch.points.entries()) {
    if (point.shape && (k % JUDGED === 0 || k === branch.points.length - 1)) samples.push(yield* at(point));
  }
  if (!samples.length) return [{ ...branch, kind: "rotation" }];
  const between = function* (one, other) {
    const differ = classOf(one) !== classOf(other);
    if (other.gamma - one.gamma < (differ ? EDGE : NARROW) * one.gamma || !(differ || mayMeet(one.verdict, other.verdict))) return [];
    const gamma = 0.5 * (one.gamma + other.gamma), shape = member(lam, wf, gamma, branch.n, false, one.shape.a);
    if (!shape) return [];
    const middle = yield* at({ gamma, shape, r_f: shape.r_f, tension: shape.tension });
    return [...yield* between(one, middle), middle, ...yield* between(middle, other)];
  };
  const all = [samples[0]];
  for (let k = 1; k < samples.length; k++) all.push(...yield* between(samples[k - 1], samples[k]), samples[k]);
  const rest = branch.points.filter((point) => !all.some((one) => one.gamma === point.gamma));
  const stretches = [];
  for (const point of [...all, ...rest].sort((one, other) => one.gamma - other.gamma)) {
    const last = stretches[stretches.length - 1];
    if (last && (!point.verdict || !last.class || classOf(point) === last.class)) last.points.push(point);
    else {
      if (last) last.points.push(point);
      stretches.push({ ...branch, folded: branch.folded && !last, points: [point] });
    }
    const now = stretches[stretches.length - 1];
    if (!point.verdict) continue;
    now.class = classOf(point);
    if (!(point.verdict.growth <= now.growth)) Object.assign(now, { kind: point.verdict.kind, growth: point.verdict.growth });
  }
  return stretches;
}

/** Kinds of which stretches are made: a window of flutter is weak only if it is so all over. */
const classOf = ({ verdict: { kind } }) => (kind === "weak" ? "flutter" : kind);

/** Whether two swings of a shape that lasts may meet between two speeds: they are no farther apart than they move. */
function mayMeet({ squares: one }, { squares: other }) {
  if (!one || !other) return false;
  return one.slice(0, Math.min(one.length, other.length)).some((s, j, all) => j > 0
    && Math.min(s - all[j - 1], other[j] - other[j - 1]) < Math.abs(s - other[j]) + Math.abs(all[j - 1] - other[j - 1]));
}

/** Critical speeds over the length: lists of [lam, gamma] for n = 1, 2 ... */
function* curvesOf(wf, low, high, gammaHigh, most, done) {
  const found = [], count = 40;
  for (let n = 1; n <= Math.min(most, transitions(high, wf)); n++) {
    const threshold = 2 * n - 1 + thresholdOffset(wf), points = [];
    const top = high - threshold, bottom = Math.max(1e-4 * threshold, low - threshold);
    let guess = null;
    for (let k = 0; k <= count; k++) {
      const lam = threshold + top * (bottom / top) ** (k / count), state = criticalState(lam, wf, n, guess);
      yield;
      if (!state) break;
      points.push([lam, state.gamma]);
      guess = state;
      if (state.gamma > gammaHigh) break;
    }
    found.push(points.reverse());
  }
  done(found);
}
