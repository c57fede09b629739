"use strict";
// Charts and views as SVG: scales, ticks, lines, the cable in true proportion.

const SVG = "http://www.w3.org/2000/svg";

/** An element of a drawing. */
function mark(name, attributes, text) {
  const found = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) found.setAttribute(key, value);
  if (text !== undefined) found.textContent = text;
  return found;
}

const pathOf = (points) => points.map(([x, y], k) => `${k ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");

/** Numbers to a few digits, without an exponent where people write none. */
function digits(value, count = 3) {
  if (!Number.isFinite(value)) return "-";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e6 || size < 1e-4) return value.toExponential(count - 1).replace("e+", "e");
  const text = value.toPrecision(count);
  return size >= 10 ** count ? Math.round(value).toLocaleString("en").replace(/,/g, "\u202f") : String(Number(text));
}

/** A length in the unit that suits it. */
function lengthText(value) {
  const size = Math.abs(value);
  if (size >= 1e3) return `${digits(value / 1e3)} km`;
  if (size >= 1 || size === 0) return `${digits(value)} m`;
  if (size >= 0.01) return `${digits(value * 100)} cm`;
  return `${digits(value * 1000)} mm`;
}

function forceText(value) {
  const size = Math.abs(value);
  if (size >= 1e3) return `${digits(value / 1e3)} kN`;
  return size >= 0.1 || size < 1e-9 ? `${digits(size < 1e-9 ? 0 : value)} N` : `${digits(value * 1e3)} mN`;
}

/** Round numbers from low to high, on an axis that may be logarithmic. */
function ticksOf(low, high, logarithmic, most = 7) {
  if (!logarithmic || high / low < 4) {
    const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw));
    const step = power * [1, 2, 5, 10].find((one) => one * power >= raw);
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
    return found;
  }
  const decades = Math.log10(high / low), found = [];
  const digitsShown = decades > 4 ? [1] : decades > 2 ? [1, 3] : [1, 2, 5];
  const every = decades > 8 ? Math.ceil(decades / 6) : 1;
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += every) {
    for (const digit of digitsShown) {
      const value = digit * 10 ** power;
      if (value >= low * (1 - 1e-9) && value <= high * (1 + 1e-9)) found.push(value);
    }
  }
  return found;
}

/** A chart with axes in an svg; `x` and `y` map numbers to its points, `add` puts marks on it. */
function chartIn(svg, { x: across, y: up, height = 300 }) {
  const width = Math.max(240, svg.clientWidth || svg.parentNode.clientWidth || 480);
  const left = 58, right = 14, top = 12, bottom = 44;
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.style.height = `${height}px`;
  const scale = ({ low, high, log }, from, to) => (value) => from + (to - from) *
    (log ? Math.log(Math.max(value, 1e-300) / low) / Math.log(high / low) : (value - low) / (high - low));
  const x = scale(across, left, width - right), y = scale(up, height - bottom, top);
  const clip = `clip-${svg.id}`, inside = mark("g", { "clip-path": `url(#${clip})` }), axes = mark("g", {});
  const box = { x: left, y: top, width: width - left - right, height: height - top - bottom };
  const area = mark("clipPath", { id: clip });
  area.append(mark("rect", box));
  svg.append(area, axes, inside);
  for (const value of ticksOf(across.low, across.high, across.log, width < 420 ? 5 : 8)) {
    axes.append(mark("path", { class: "grid", d: `M${x(value)} ${top}V${height - bottom}` }),
      mark("text", { x: x(value), y: height - bottom + 16, "text-anchor": "middle" }, digits(value)));
  }
  for (const value of ticksOf(up.low, up.high, up.log, 6)) {
    axes.append(mark("path", { class: "grid", d: `M${left} ${y(value)}H${width - right}` }),
      mark("text", { x: left - 6, y: y(value) + 4, "text-anchor": "end" }, digits(value)));
  }
  axes.append(mark("rect", { ...box, class: "frame" }),
    mark("text", { x: (left + width - right) / 2, y: height - 8, "text-anchor": "middle", class: "soft" }, across.label),
    mark("text", { x: -(top + height - bottom) / 2, y: 14, "text-anchor": "middle", class: "soft", transform: "rotate(-90)" }, up.label));
  const valueAt = (event) => {
    const at = svg.getBoundingClientRect(), place = (event.clientX - at.left) * width / at.width;
    const share = Math.min(1, Math.max(0, (place - left) / box.width));
    return across.log ? across.low * (across.high / across.low) ** share : across.low + share * (across.high - across.low);
  };
  const add = (name, attributes, text) => inside.append(mark(name, attributes, text));
  const over = (name, attributes, text) => svg.append(mark(name, attributes, text));
  return { x, y, add, over, width, height, left, right: width - right, top, bottom: height - bottom, valueAt };
}

/** Puts "you are here" on a chart. */
function markHere(chart, x, y, text) {
  const at = chart.x(x), up = Math.min(chart.bottom, Math.max(chart.top, chart.y(y)));
  const flip = at > chart.left + 0.6 * (chart.right - chart.left);
  chart.add("path", { class: "here", d: `M${at} ${chart.top}V${chart.bottom}` });
  chart.over("circle", { class: "dot", cx: at, cy: up, r: 6.5 });
  chart.over("text", {
    class: "halo bold", x: at + (flip ? -11 : 11), y: Math.max(chart.top + 13, up - 9), "text-anchor": flip ? "end" : "start",
  }, text);
}

/**
 * Cables in true proportion, or stretched across by a factor: `cables` of {points: [[across, down, tension]], kind, main},
 * `bounds` [left, right, top, bottom] in m. Returns the scale and the maps.
 */
function viewIn(svg, { bounds, stretch = 1, least = 200, most = 400 }) {
  const width = Math.max(200, svg.clientWidth || svg.parentNode.clientWidth || 320), margin = 26;
  const spans = [(bounds[1] - bounds[0]) * stretch || 1, bounds[3] - bounds[2] || 1];
  const wanted = (width - 2 * margin) / spans[0] * spans[1] + 2 * margin;
  const height = Math.min(most, Math.max(least, wanted));
  const scale = Math.min((width - 2 * margin) / spans[0], (height - 2 * margin) / spans[1]);
  svg.replaceChildren();
  svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  svg.style.height = `${height}px`;
  const middle = [0.5 * (bounds[0] + bounds[1]), 0.5 * (bounds[2] + bounds[3])];
  const x = (value) => width / 2 + (value - middle[0]) * scale * stretch;
  const y = (value) => height / 2 + (value - middle[1]) * scale;
  const add = (name, attributes, text) => svg.append(mark(name, attributes, text));
  return { x, y, add, scale, width, height };
}

/** A cable on a view: its tension, from least to largest, as colour where it is the main one; its kind where it is not. */
function drawCable(view, { points, tension, kind, main }) {
  const at = points.map(([across, down]) => [view.x(across), view.y(down)]);
  if (!main) {
    view.add("path", { class: `${kind} aside`, d: pathOf(at) });
  } else {
    const chunk = Math.max(1, Math.ceil(at.length / 60)), [least, largest] = [Math.min(...tension), Math.max(...tension)];
    for (let k = 0; k + 1 < at.length; k += chunk) {
      const share = largest > least ? 100 * (tension[k] - least) / (largest - least) : 50;
      view.add("path", {
        d: pathOf(at.slice(k, k + chunk + 1)), fill: "none", "stroke-width": 4, "stroke-linecap": "round", "stroke-linejoin": "round",
        style: `stroke: color-mix(in oklab, var(--taut) ${share.toFixed(0)}%, var(--slack))`,
      });
    }
  }
  const [across, down] = at[at.length - 1];
  view.add("circle", { class: "dot", cx: across, cy: down, r: main ? 6 : 3.5, opacity: main ? 1 : 0.6 });
}

/** Rings where the main cable crosses the axis, and the word beside the first, on the side of the axis where "fish" is not. */
function drawNodes(view, points) {
  let first = true;
  for (let k = 0; k + 1 < points.length; k++) {
    const [[x, z], [next, lower]] = [points[k], points[k + 1]];
    if (x * next >= 0) continue;
    const down = view.y(z + (lower - z) * x / (x - next));
    view.add("circle", { class: "fold", cx: view.x(0), cy: down, r: 4.5 });
    const near = Math.abs(down - view.y(points[points.length - 1][1])) < 30;
    if (first) view.add("text", { class: "halo", x: view.x(0) + (near ? -10 : 10), y: down - 5, "text-anchor": near ? "end" : "start" }, "node");
    first = false;
  }
}

/** A length of round numbers at the foot of a view. */
function drawRuler(view, stretch = 1) {
  const room = 0.35 * view.width / (view.scale * stretch), power = 10 ** Math.floor(Math.log10(room));
  const size = power * [5, 2, 1].find((one) => one * power <= room), long = size * view.scale * stretch;
  const y = view.height - 8, x = view.width - 10 - long;
  view.add("path", { class: "thin", d: `M${x} ${y - 4}V${y}H${x + long}V${y - 4}` });
  view.add("text", { x: x + long / 2, y: y - 6, "text-anchor": "middle", class: "soft halo" }, lengthText(size));
}
