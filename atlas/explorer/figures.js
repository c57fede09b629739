"use strict";
// The figures of the page: three views of the shapes, and the charts.

// A shape more slender than this is stretched across, by one of these.
const SLENDER = 5, FACTORS = [2, 5, 10, 20, 50, 100, 200, 500, 1000];

function drawShapes(shapes) {
  const picked = pickedOf(shapes);
  for (const id of ["side", "close", "plan"]) if (!picked) $(id).replaceChildren();
  if (!picked) return;
  const R = state.radius;
  const curves = shapes.map((shape) => ({ shape, points: smooth(shape.curve()), main: shape === picked }));
  // The one in colour on top.
  curves.sort((one, other) => one.main - other.main);
  const main = curves[curves.length - 1], tensions = main.points.map((point) => point[3]);
  const [lowest, largest] = [Math.min(...tensions), Math.max(...tensions)];
  const side = (curve) => ({ points: curve.points.map(([x, , z]) => [x, z]), tension: curve.points.map((point) => point[3]), kind: curve.shape.kind, main: curve.main });
  drawSide("side", curves.map(side), 1);
  $("side-title").textContent = shapes.length > 1 ? "From the side, all shapes" : "From the side";
  const alone = boundsOf([main.points.map(([x, , z]) => [x, z])], R);
  const ratio = (alone[3] - alone[2]) / (alone[1] - alone[0]);
  const all = boundsOf(curves.map((curve) => curve.points.map(([x, , z]) => [x, z])), R);
  const small = (alone[1] - alone[0]) < 0.3 * (all[1] - all[0]);
  const needed = ratio > SLENDER || small;
  $("close-box").hidden = !needed;
  document.querySelector(".figures").classList.toggle("two", !needed);
  if (needed) {
    const stretch = ratio > SLENDER ? FACTORS.findLast((factor) => factor <= ratio) ?? 1 : 1;
    drawSide("close", [side(main)], stretch);
    $("close-title").textContent = `The one in colour${stretch > 1 ? `, stretched across ${stretch} times` : ", closer"}`;
  }
  drawPlan(main);
  $("tension-key").replaceChildren(element("span", {}, "Tension of the one in colour:"), element("span", { class: "ends" }, `${forceText(lowest)}, least`), element("span", { class: "ramp" }),
    element("span", { class: "ends" }, `${forceText(largest)}, largest`));
  const text = `${shapeTitle(picked)}: fish ${lengthText(picked.r_f)} from the axis, ${lengthText(picked.z_f)} below the tow point.`;
  $("side").setAttribute("aria-label", `From the side, in true proportion. ${text} Numbers of all shapes are in the table below.`);
  $("close").setAttribute("aria-label", `The same shape alone. ${text}`);
  $("plan").setAttribute("aria-label", `From above, in true proportion: the circle of the tow point, of radius ${lengthText(R)}, and the cable. ${text}`);
}

function boundsOf(lists, radius) {
  const found = [-0.15 * radius, radius, 0, 0];
  for (const [across, down] of lists.flat()) {
    found[0] = Math.min(found[0], across);
    found[1] = Math.max(found[1], across);
    found[2] = Math.min(found[2], down);
    found[3] = Math.max(found[3], down);
  }
  return found;
}

function drawSide(id, cables, stretch) {
  const R = state.radius, bounds = boundsOf(cables.map((cable) => cable.points), R);
  const view = viewIn($(id), { bounds, stretch, least: 220, most: 380 });
  view.add("path", { class: "axis", d: `M${view.x(0)} 4V${view.height - 4}` });
  view.add("text", { class: "soft halo", x: view.x(0) - 4, y: view.height - 8, "text-anchor": "end" }, "axis");
  for (const cable of cables) drawCable(view, cable);
  view.add("path", { d: `M${view.x(R)} ${view.y(0)}l-6 -10h12z`, class: "dot" });
  view.add("text", { class: "halo", x: view.x(R), y: view.y(0) - 13, "text-anchor": view.x(R) > 0.7 * view.width ? "end" : "start" }, "tow point");
  const main = cables.find((cable) => cable.main);
  if (cables.length === 1) drawNodes(view, main.points);
  const [across, down] = main.points[main.points.length - 1];
  const flip = view.x(across) > view.width - 50;
  view.add("text", { class: "halo bold", x: view.x(across) + (flip ? -9 : 9), y: view.y(down) + 4, "text-anchor": flip ? "end" : "start" }, "fish");
  if (stretch === 1) drawRuler(view);
}

function drawPlan(main) {
  const R = state.radius, points = main.points.map(([x, y]) => [x, y]);
  const [across, up] = [0, 1].map((k) => points.map((point) => point[k]));
  const bounds = [Math.min(-R, ...across), Math.max(R, ...across), Math.min(-R, ...up), Math.max(R, ...up)];
  const view = viewIn($("plan"), { bounds, least: 220, most: 380 });
  const size = R * view.scale, turn = tableHere()?.turn === "port" && withDrag() ? -1 : 1;
  view.add("circle", { class: "thin", cx: view.x(0), cy: view.y(0), r: size });
  view.add("path", { class: "thin", d: `M${view.x(0) - 5} ${view.y(0)}h10M${view.x(0)} ${view.y(0) - 5}v10` });
  drawCable(view, { points, tension: main.points.map((point) => point[3]), kind: main.shape.kind, main: true });
  const [x, y] = [view.x(R), view.y(0)];
  view.add("path", { d: `M${x} ${y + turn * 26}l-5 ${-turn * 9}h10z`, class: "dot" });
  view.add("path", { d: `M${x} ${y}V${y + turn * 18}`, class: "thin" });
  view.add("circle", { class: "dot", cx: x, cy: y, r: 4.5 });
  view.add("text", { class: "halo", x: Math.min(x + 8, view.width - 4), y: y - 8, "text-anchor": x > view.width - 70 ? "end" : "start" }, "tow point");
  $("plan-title").textContent = "From above";
  drawRuler(view);
}

/** Ends of an axis that holds the heights given, with some room. */
function ends(heights, room = 1.25) {
  const good = heights.filter((value) => value > 0 && value < Infinity);
  if (!good.length) return [0.1, 10];
  return [Math.min(...good) / room, Math.max(...good) * room];
}

function speedAxis() {
  const table = withDrag() ? tableHere() : null;
  const [low, high] = table ? [table.low, table.high] : SPEEDS.map((share) => share * middle.speed);
  return { low: speedIn(low), high: speedIn(high), label: `speed of the tow point, ${state.unit}` };
}

function drawCharts(shapes, expected) {
  const { lam, wf, unit, force } = groups(), axis = speedAxis();
  const reach = perUnit(state.unit), ends = [axis.low * reach, axis.high * reach];
  const key = JSON.stringify([lam, wf, ends, state.radius, force]);
  const both = (parts) => {
    drawBranches("diagram", "r_f", parts, axis, shapes, expected);
    drawBranches("tension", "tension", parts, axis, shapes, expected);
  };
  if (withDrag()) {
    both(tableHere().branches.flatMap(partsOf));
  } else if (computed.key === key) {
    both(computed.parts);
  } else {
    both([]);
    const many = !(workOf(lam, wf, ends[1] / unit) < CURVE_WORK);
    computed = { key: "", parts: [] };
    $("kinds").textContent = many ? "Too many shapes over this range for a page." : "computing";
    if (!many) {
      background("branches", branchesOf(lam, wf, ends[0] / unit, ends[1] / unit, (found) => {
        const inSi = (point) => ({ speed: point.gamma * unit, r_f: point.r_f * state.radius, tension: point.tension * force });
        computed = { key, parts: found.map((one) => ({ ...one, points: one.points.map(inSi) })) };
        draw();
      }));
    }
  }
  drawRising(ends);
  drawCritical(wf, unit, ends);
}

// Branches without drag, of the cable and the range of speeds that the key says.
let computed = { key: "", parts: [] };

/** Stretches of one kind of a tabulated branch. */
function partsOf(branch) {
  return branch.between.map((kind, k) => {
    const [from, to] = [branch.points[k], branch.points[k + 1]];
    const inner = branch.value.map((value, at) => ({ speed: value, r_f: branch.r_f[at], tension: branch.tension[at] }))
      .filter(({ speed }) => speed > from.value && speed < to.value);
    const points = [from, to].map((point) => ({ speed: point.value, r_f: point.r_f, tension: point.tension }));
    return { kind, folded: from.kind === "fold", ends: to.kind === "fold", points: [points[0], ...inner, points[1]] };
  });
}

function drawBranches(id, height, parts, axis, shapes, expected) {
  const seen = parts.flatMap((part) => part.points.map((point) => point[height])), here = shapes.map((shape) => shape[height]);
  const [low, high] = ends([...seen, ...here]);
  const label = height === "r_f" ? "fish from the axis, m" : "tension, N";
  const chart = charts[id] = chartIn($(id), { x: axis, y: { low, high, log: true, label } });
  const speed = (value) => speedIn(value);
  for (const part of parts) {
    chart.add("path", { class: part.kind, d: pathOf(part.points.map((point) => [chart.x(speed(point.speed)), chart.y(point[height])])) });
    for (const end of [part.folded && part.points[0], part.ends && part.points[part.points.length - 1]].filter(Boolean)) {
      chart.add("circle", { class: "fold", cx: chart.x(speed(end.speed)), cy: chart.y(end[height]), r: 3.5 });
    }
  }
  for (const shape of shapes) if (shape !== expected) chart.add("circle", { class: "dot", cx: chart.x(speed(state.speed)), cy: chart.y(shape[height]), r: 3.5 });
  if (expected) markHere(chart, speed(state.speed), expected[height], "you are here");
  const kinds = [...new Set(parts.map((part) => part.kind))];
  if (id === "diagram") {
    $("kinds").replaceChildren(...kinds.map((kind) => {
      const item = element("span"), line = mark("svg", { viewBox: "0 0 44 12", "aria-hidden": "true" });
      line.append(mark("path", { class: kind, d: "M3 6H41" }));
      item.append(line, KIND_LINES[kind] ?? kind);
      return item;
    }));
    if (parts.some((part) => part.folded || part.ends)) $("kinds").append(element("span", {}, "\u25CB where two shapes appear or end"));
  }
  const all = shapes.map((shape) => `${shapeTitle(shape)}: ${height === "r_f" ? lengthText(shape.r_f) : forceText(shape.tension)}`);
  $(id).setAttribute("aria-label", `${height === "r_f" ? "Distance of the fish from the axis" : "Tension at the tow point"} over the speed. At ${speedText(state.speed)}: ${all.join("; ")}.`);
}

function drawRising([low, high]) {
  const items = risingItems(critical, low, high);
  $("rising").replaceChildren(...items.map((item, k) => {
    const here = item.low <= state.speed && (state.speed < item.high || (k === items.length - 1 && !isBeyond())) && item.kind !== "jump";
    const row = element("li", here ? { "aria-current": "true" } : {});
    const at = item.kind === "jump" ? speedText(item.low) : `${digits(speedIn(item.low))} to ${speedText(item.high)}`;
    row.append(element("span", { class: "at" }, at), `: ${item.text}${here ? " \u25C0 you are here" : ""}`);
    return row;
  }));
  const box = $("rising").parentNode, here = $("rising").querySelector("[aria-current]");
  box.scrollTop = here ? here.offsetTop - box.offsetTop - 60 : 0;
  const table = tableHere();
  $("looked").textContent = withDrag() ? `Along the shape to expect, by the table. ${table.complete ? "" : "Not everywhere made out: some may be missing. "}Growth by small motions; where a jump lands is a guess.`
    : `Without drag, by small motions. The shape without a node always lasts, the outer of each pair never does, which is proved; of the inner ones windows of flutter narrower than ${100 * NARROW} % of the speed may be missed.`;
}

const MOST_CURVES = 6;
let curves = { key: "", found: [] };

function drawCritical(wf, unit, [low, top]) {
  // The first critical speed is on it, if there is one.
  const high = Math.max(top, 1.3 * (critical[0]?.gamma ?? 0) * unit);
  const R = state.radius, spread = [Math.min(middle.length, state.length) / 6, Math.max(middle.length, state.length) * 4];
  const far = [spread[0] / R, spread[1] / R];
  const key = JSON.stringify([wf, far, high / unit]);
  if (curves.key !== key) {
    if (!(workOf(far[1], wf, high / unit) < 30 * CURVE_WORK)) curves = { key, found: [] };
    else {
      background("curves", curvesOf(wf, far[0], far[1], 1.5 * high / unit, MOST_CURVES, (found) => {
        curves = { key, found };
        drawCritical(wf, unit, [low, top]);
      }));
    }
  }
  const heights = critical.map((one) => one.gamma * unit).filter((speed) => speed < high);
  const [bottom] = ends([low, ...heights, ...curves.found.slice(0, 1).map((points) => (points.length ? points[points.length - 1][1] * unit : low))]);
  const chart = charts.critical = chartIn($("critical"), {
    x: { low: spread[0], high: spread[1], log: true, label: "length of the cable, m" },
    y: { low: speedIn(bottom), high: speedIn(high), log: true, label: `speed, ${state.unit}` },
  });
  const lines = curves.found.map((points) => points.map(([lam, gamma]) => [chart.x(lam * R), chart.y(speedIn(gamma * unit))]));
  for (const line of lines) {
    if (line.length < 2) continue;
    const edge = chart.right;
    chart.add("path", { d: `${pathOf(line)}L${edge} ${line[line.length - 1][1]}V${chart.top - 50}H${line[0][0]}Z`, fill: "rgba(var(--band), .12)" });
  }
  lines.forEach((line, k) => {
    if (line.length < 2) return;
    chart.add("path", { class: "curve", d: pathOf(line) });
    const above = lines[k + 1]?.length > 1 ? lines[k + 1][lines[k + 1].length - 1][1] : chart.top;
    const end = line[line.length - 1][1], room = Math.min(end, chart.bottom) - Math.max(above, chart.top);
    if (k === 0 && chart.bottom - end > 16) chart.over("text", { class: "halo soft", x: chart.right - 6, y: (chart.bottom + end) / 2 + 4, "text-anchor": "end" }, "1 shape");
    if (room > 15) chart.over("text", { class: "halo soft", x: chart.right - 6, y: (Math.min(end, chart.bottom) + Math.max(above, chart.top)) / 2 + 4, "text-anchor": "end" }, `${2 * k + 3} shapes${k + 1 === MOST_CURVES ? " or more" : ""}`);
  });
  if (!lines.length) chart.over("text", { x: chart.left + 10, y: chart.top + 20, class: "soft" }, curves.key === key ? "No curve in this range" : "computing");
  markHere(chart, state.length, speedIn(state.speed), "you are here");
  const named = critical.slice(0, MOST_CURVES).map((one) => `n = ${one.n}: ${speedText(one.gamma * unit)}`);
  $("critical").setAttribute("aria-label", `Critical speeds over the length of the cable. At ${lengthText(state.length)}: ${named.join("; ") || "none"}. You are at ${speedText(state.speed)}.`);
}
