"use strict";
// What is on show: a cable and its speed in SI, and the shapes it can take, computed here or read off the scene's table.

const known = JSON.parse(document.getElementById("known").textContent);
const KNOT = 1852 / 3600;
// Work above which shapes are not looked for in a page (workOf): some seconds; and for whole curves: less for each.
const MOST_WORK = 2000, CURVE_WORK = 1000;
const MOST_STATES = 40;
const state = { scene: 0, model: "drag", picked: null, unit: "kn", length: 1, mass_per_length: 1, fish_mass: 0, radius: 1, speed: 1, gravity: GRAVITY, title: "", density: 0 };
// What sliders move about.
const middle = {};
const CABLE_KEYS = ["length", "mass_per_length", "fish_mass", "radius"];

const tableHere = () => known.tables[state.scene] ?? null;
/** Whether the cable on show is that of the table. */
const isTabulated = () => tableHere() !== null && [...CABLE_KEYS, "gravity"].every((key) => state[key] === tableHere().scene[key]);
const withDrag = () => state.model === "drag" && isTabulated();

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
  const median = found.length >> 1;
  return found.map((shape, k) => ({
    name: shape.name, nodes: shape.n, r_f: shape.r_f * state.radius, z_f: shape.z_f * state.radius,
    tension: shape.tension * force, kind: shape.outer ? "divergence" : shape.n ? "rotation" : "stable", expected: k === median,
    growth: null, frequency: null,
    curve: () => curveOf(lam, wf, gamma, shape).reverse().map(([x, z, tension]) => [x * state.radius, 0, z * state.radius, tension * force]),
  }));
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

/** Branches over the speed without drag: lists of {gamma, r_f, tension} by name, from each fold on. */
function* branchesOf(lam, wf, low, high, done) {
  const found = [], count = 48;
  const add = (n, outer, kind, points) => found.push({ n, outer, kind, points });
  const states = criticalStates(lam, wf, high, MOST_STATES);
  for (let n = 0; n <= states.length; n++) {
    const fold = n ? states[n - 1] : null;
    if (fold && fold.gamma >= high) break;
    for (const outer of n ? [false, true] : [false]) {
      const points = fold ? [{ gamma: fold.gamma, r_f: Math.abs(fold.x_f), tension: fold.tension }] : [];
      const begin = fold ? Math.max(fold.gamma, 0.999 * low) : 0.999 * low;
      let guess = NaN;
      for (let k = fold && fold.gamma >= low ? 1 : 0; k <= count; k++) {
        const share = (k / count) ** (fold ? 2 : 1), gamma = begin + share * (high - begin);
        const shape = member(lam, wf, gamma, n, outer, guess);
        if (shape) {
          points.push({ gamma, r_f: shape.r_f, tension: shape.tension });
          guess = shape.a;
        }
        yield;
      }
      add(n, outer, outer ? "divergence" : n ? "rotation" : "stable", points);
    }
  }
  done(found, states);
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
