"use strict";
// What the page says: the shape at the speed, what comes as the speed rises and falls.

const KINDS = {
  stable: "lasts", weak: "lasts, while a slow swing grows a little", flutter: "flutters: swings grow", divergence: "left at once: unstable",
  rotation: "not computed for this cable; may flutter", pending: "being computed", unknown: "not known",
};
const KIND_LINES = {
  stable: "lasts", weak: "lasts, a slow swing grows a little", flutter: "flutters", divergence: "unstable: left at once",
  rotation: "not computed for this cable; may flutter", pending: "being computed",
};

const WORDS = ["no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"];
const counted = (count, what) => `${WORDS[count] ?? count} ${what}${count === 1 ? "" : "s"}`;
const nodesText = (count) => counted(count, "node");
const doublingText = (growth) => (growth > 0 ? `, doubling in ${digits(Math.LN2 / growth, 2)} s` : "");

function shapeTitle(shape) {
  const nodes = shape.nodes ? nodesText(shape.nodes) : "no node, swung out";
  return shape.name.endsWith("outer") ? `${nodes}, outer of its pair` : shape.name.endsWith("inner") ? `${nodes}, inner` : nodes;
}

/** What the cable does now: a sentence. */
function nowText(shapes) {
  const without = leftOut().length ? `, without ${leftOut().join(" and ")},` : "";
  const speed = `${digits(speedIn(state.speed, "kn"))} kn (${digits(speedIn(state.speed, "rpm"))} rpm)${without}`;
  if (!shapes) return `At ${speed} this cable has too many shapes to be looked for in a page: towatlas lists them.`;
  if (isBeyond()) return `At ${speed} no shape is tabulated: the table covers ${speedText(tableHere().low)} to ${speedText(tableHere().high)}.`;
  if (!shapes.length) return `At ${speed} no shape is tabulated.`;
  const one = shapes.find((shape) => shape.expected) ?? shapes[0];
  const many = shapes.length === 1 ? "the cable has one shape" : `the cable can take ${counted(shapes.length, "shape")}`;
  const lead = shapes.length === 1 ? "It has" : "The one to expect has";
  const where = `its fish ${lengthText(one.r_f)} from the axis and ${lengthText(one.z_f)} below the tow point`;
  return `At ${speed} ${many}. ${lead} ${nodesText(one.nodes)}, ${where}, and ${fateText(one)}.`;
}

/** How much the model on show leaves out of the fluid: a warning. */
function warningText() {
  const left = leftOut(), { gamma } = groups(), C = dragConstant(state), found = [];
  if (!left.length) return "";
  const unit = (state.mass_per_length + state.displaced_per_length) / state.mass_per_length;
  if (left.includes("drag")) {
    found.push(`the drag constant of the cable is C = ${digits(C, 2)} (0 in a vacuum), and its drag at the tow point is ${digits(C * gamma ** 2 * unit, 2)} times its weight`);
  }
  if (left.includes("buoyancy")) found.push(`the fluid takes ${digits(100 * (unit - 1), 2)} % off that weight`);
  return `This answer leaves out ${left.join(" and ")}, and may be wrong: ${found.join("; ")}. `
    + `The commands towatlas scene FILE and towatlas explore FILE include ${left.length > 1 ? "both" : "it"}.`;
}

function fateText(shape) {
  if (shape.kind === "flutter") {
    return `flutters: swings grow${doublingText(shape.growth)}${swingsText(shape)}`;
  }
  return {
    stable: "lasts", weak: "lasts", divergence: "is left at once", pending: "is held by its rotation: whether it flutters is being computed",
    rotation: "is held by nothing but its rotation: whether it flutters is not computed for this cable", unknown: "may last or not: not known",
  }[shape.kind];
}

const swingsText = ({ frequency }) => (frequency > 0 ? `, ${digits(frequency, 2)} swings a second` : "");

/** What comes next as the speed rises, and falls: a sentence. `states` are critical states without drag. */
function thenText(states) {
  if (isBeyond()) return "";
  if (withDrag()) {
    const table = tableHere(), up = nextSeen(table.rising, state.speed, true), down = nextSeen(table.falling, state.speed, false);
    return `Faster: ${up}. Slower: ${down}.`;
  }
  const { gamma, unit, lam, wf } = groups(), count = transitions(lam, wf);
  if (!count) return "The cable is too short for a jump: at every speed it has one shape.";
  const passed = states.filter((one) => one.gamma <= gamma).length, next = states[passed], last = states[passed - 1];
  const percent = (one) => `${digits(100 * Math.abs(one.gamma / gamma - 1), 2)} %`;
  const speed = gamma * unit, here = stretchesOver(passed, 0, Infinity), k = here.findIndex((one) => one.low <= speed && speed < one.high);
  const begins = k >= 0 ? here[k + 1] : null;
  const up = begins && !(next && next.gamma * unit < begins.low) ? `from ${speedText(begins.low)} on it ${FATES[begins.kind]}`
    : next ? `at ${speedText(next.gamma * unit)} (${percent(next)} more) two other shapes begin, with ${nodesText(next.n)}; the one before goes on, and nothing there forces the cable off it`
    : "no further shapes appear that this page lists";
  const down = k > 0 ? `below ${speedText(here[k].low)} it ${FATES[here[k - 1].kind]}` : last ? `at ${speedText(last.gamma * unit)} (${percent(last)} less) this shape ends, and the cable must jump` : "the cable keeps its one shape";
  return `Faster: ${up}. Slower: ${down}.`;
}

function nextSeen(parts, speed, rises) {
  const items = groupsOf(parts), k = items.findIndex((item) => item.what === "stretch" && item.low <= speed && speed <= item.high);
  if (k < 0) return "this speed is not met on the way";
  const next = items[k + 1], end = rises ? items[k].high : items[k].low;
  if (!next) return `no jump is seen as far as ${speedText(end)}, where the table ends`;
  return next.what === "jump" ? `at ${speedText(next.value)} ${seenText(next)}` : `from ${speedText(end)} on it ${seenText(next)}`;
}

/** Stretches of one branch that last, told together. */
function groupsOf(parts) {
  const found = [];
  for (const part of parts) {
    const last = found[found.length - 1], lasting = (one) => one.kind === "stable" || one.kind === "weak";
    if (last && part.what === "stretch" && last.what === "stretch" && last.branch === part.branch && lasting(last) && lasting(part)) {
      last.low = Math.min(last.low, part.low);
      last.high = Math.max(last.high, part.high);
      last.nodes = [Math.min(last.nodes[0], part.nodes[0]), Math.max(last.nodes[1], part.nodes[1])];
      last.weak = last.weak || part.kind === "weak";
    } else found.push({ ...part, weak: part.kind === "weak" });
  }
  return found;
}

function seenText(part) {
  if (part.what === "jump") return part.end < 0 ? "it jumps, and no shape lasts" : "it jumps";
  const [least, most] = [Math.min(...part.nodes), Math.max(...part.nodes)];
  const nodes = least === most ? nodesText(most) : `${least ? WORDS[least] ?? least : "none"} to ${nodesText(most)}, by the speed`;
  if (part.kind === "flutter") {
    return `flutters about ${nodes}${doublingText(part.growth)}${swingsText(part)}`;
  }
  if (part.kind === "unknown") return `has ${nodes}; whether it lasts is not known`;
  return `lasts with ${nodes}${part.weak ? ", a slow swing growing a little" : ""}`;
}

/** What happens as the speed rises, as items {low, high, text, kind}, in m/s. */
function risingItems(states, low, high) {
  if (withDrag()) {
    return groupsOf(tableHere().rising).map((part) => (part.what === "jump"
      ? { low: part.value, high: part.value, text: seenText(part), kind: "jump" }
      : { low: part.low, high: part.high, text: seenText(part), kind: part.kind }));
  }
  const { unit } = groups(), edges = states.map((one) => one.gamma * unit).filter((speed) => speed < high);
  return [0, ...edges].flatMap((from, n) => {
    const to = edges[n] ?? high, lead = n ? `${counted(2 * n + 1, "shape")}; of the new two, with ${nodesText(n)}, the inner one` : "one shape, without a node";
    const parts = n ? stretchesOver(n, from, to) : [];
    if (!parts.length) return [{ low: from, high: to, text: n ? `${lead} ${FATES.rotation}` : lead, kind: n ? "rotation" : "stable" }];
    return parts.map((part, k) => ({ ...part, text: `${k ? `the shape with ${nodesText(n)}` : lead} ${FATES[part.kind]}` }));
  });
}

const FATES = {
  stable: "lasts", weak: "lasts, a slow swing growing a little", flutter: "flutters", divergence: "is left at once",
  rotation: "may flutter: not computed for this cable", pending: "may flutter: being computed",
};

/** Stretches of one kind of the inner shape with n nodes between two speeds in m/s, as far as they are known. */
function stretchesOver(n, low, high) {
  return computed.parts.filter((part) => part.n === n && !part.outer && part.points.length > 1)
    .map(({ kind, points }) => ({ kind, low: Math.max(low, points[0].speed), high: Math.min(high, points[points.length - 1].speed) }))
    .filter((part) => part.low < part.high);
}

/** The scene on show as a file that towatlas reads. */
function tomlOf() {
  const lines = state.title ? [`title = ${JSON.stringify(state.title)}`] : [];
  if (state.gravity !== GRAVITY) lines.push(`gravity = ${state.gravity}`);
  if (state.density) lines.push("# without its drag and buoyancy: a file with them gives a page with a table, by towatlas explore");
  lines.push("", "[cable]", `length = "${state.length} m"`, `mass_per_length = "${state.mass_per_length} kg/m"`);
  if (state.fish_mass) lines.push("", "[fish]", `mass = "${state.fish_mass} kg"`);
  lines.push("", "[tow]", `radius = "${state.radius} m"`, `speed = "${state.speed} m/s"`, "", "[fluid]", 'name = "vacuum"', "");
  return lines.join("\n").trimStart();
}
