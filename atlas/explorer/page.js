"use strict";
// The page: its controls, and what is drawn when one of them moves.

const $ = (id) => document.getElementById(id);
const SLIDERS = [
  ["length", "Cable length", "m"], ["mass_per_length", "Cable mass", "kg/m"], ["fish_mass", "Fish mass", "kg"], ["radius", "Tow radius", "m"],
];
// Sliders move each number between a tenth and ten times that of the scene; the speed over the range of its table.
const SPAN = 10, SPEEDS = [0.25, 2];
// Of numbers in SI.
const LEAST = 1e-9, LARGEST = 1e9;
let critical = [];

function element(name, attributes = {}, text = "") {
  const found = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) found.setAttribute(key, value);
  found.textContent = text;
  return found;
}

function makeControls() {
  known.tables.forEach((table, k) => $("scene").append(element("option", { value: k }, table.scene.title || table.name)));
  $("scene").append(element("option", { value: -1 }, "your own"));
  for (const [key, label, unit] of SLIDERS) {
    const row = element("div", { class: "slider" });
    const box = element("input", { type: "number", id: key, step: "any", min: 0, inputmode: "decimal" });
    const slide = element("input", { type: "range", id: `${key}-slide`, min: 0, max: 1000, step: 1, "aria-label": label });
    row.append(element("label", { for: key }, label), box, element("span", {}, unit), slide);
    $("sliders").append(row);
    slide.addEventListener("input", () => change({ [key]: fromSlide(key, Number(slide.value)) }));
    box.addEventListener("change", () => typed(box, key, 1));
  }
  $("speed-slide").addEventListener("input", (event) => change({ speed: fromSlide("speed", Number(event.target.value)) }));
  for (const [id, unit] of [["kn", "kn"], ["rpm", "rpm"], ["m_s", "m/s"]]) {
    $(id).addEventListener("change", () => typed($(id), "speed", perUnit(unit)));
    $("unit").append(element("option", { value: unit }, unit));
  }
  $("unit").addEventListener("change", () => {
    state.unit = $("unit").value;
    draw();
  });
  $("scene").addEventListener("change", () => {
    const k = Number($("scene").value);
    if (k >= 0) show(known.tables[k].scene, k);
    else {
      state.scene = -1;
      $("paste").open = true;
      draw();
      $("toml").focus();
    }
  });
  for (const radio of document.querySelectorAll("input[name=model]")) radio.addEventListener("change", () => change({ model: radio.value }));
  $("back").addEventListener("click", () => show(tableHere().scene, state.scene));
  $("take").addEventListener("click", takeText);
  for (const id of ["diagram", "tension", "critical"]) {
    $(id).classList.add("touch");
    for (const kind of ["pointerdown", "pointermove"]) $(id).addEventListener(kind, (event) => pointed(id, event));
  }
  let width = 0;
  addEventListener("resize", () => {
    // On a phone its bars come and go: only a new width is drawn anew.
    if (innerWidth !== width) { width = innerWidth; draw(); }
  });
}

function fromSlide(key, value) {
  if (key === "speed") return middle.speed * (SPEEDS[0] + (SPEEDS[1] - SPEEDS[0]) * value / 1000);
  if (key === "fish_mass" && value === 0) return 0;
  return value === 500 ? middle[key] : Number((middle[key] * SPAN ** ((value - 500) / 500)).toPrecision(4));
}

function toSlide(key) {
  if (key === "speed") return 1000 * (state.speed / middle.speed - SPEEDS[0]) / (SPEEDS[1] - SPEEDS[0]);
  return state[key] > 0 ? 500 + 500 * Math.log(state[key] / middle[key]) / Math.log(SPAN) : 0;
}

const isUsual = (key, value) => (value >= LEAST && value <= LARGEST) || (key === "fish_mass" && value === 0);

/** A number typed into a box: refused in words where there is no such cable. */
function typed(box, key, factor) {
  const value = Number(box.value) * factor, bad = box.value.trim() === "" || !isUsual(key, value);
  box.setCustomValidity(bad ? `A number from ${LEAST} to ${LARGEST}${key === "fish_mass" ? ", or 0 for no fish" : ""}.` : "");
  if (bad) {
    box.reportValidity();
    return;
  }
  change({ [key]: value });
}

/** What the box or the slider says is on show; sliders are centred anew where they do not reach. */
function change(what) {
  Object.assign(state, what);
  for (const key of ["speed", ...CABLE_KEYS]) {
    const [low, high] = key === "speed" ? SPEEDS : [1 / SPAN, SPAN];
    if (state[key] > 0 && !(state[key] >= 0.999 * low * middle[key] && state[key] <= 1.001 * high * middle[key])) middle[key] = state[key];
  }
  state.picked = null;
  draw();
}

/** Another scene on show. */
function show(scene, k) {
  for (const key of [...CABLE_KEYS, "speed", "gravity", "title", "density", "displaced_per_length", "diameter", "drag_coefficient"]) state[key] = scene[key];
  for (const key of [...CABLE_KEYS, "speed"]) middle[key] = scene[key];
  if (!(middle.fish_mass > 0)) middle.fish_mass = scene.mass_per_length * scene.length;
  Object.assign(state, { scene: k, model: k >= 0 ? "drag" : "vacuum", picked: null });
  $("wrong").textContent = "";
  $("toml").value = tomlOf();
  draw();
}

function takeText() {
  try {
    const scene = sceneOf($("toml").value, known), text = $("toml").value;
    const odd = [...CABLE_KEYS, "speed", "gravity"].find((key) => !isUsual(key, scene[key]));
    if (odd) throw new Error(`${odd.replace(/_/g, " ")} of ${scene[odd]} in SI: this page draws from ${LEAST} to ${LARGEST}`);
    show(scene, -1);
    $("toml").value = text;
    $("wrong").textContent = "";
  } catch (error) {
    $("wrong").textContent = error.message;
  }
}

function pointed(id, event) {
  const chart = charts[id];
  if (!chart || (event.type === "pointermove" && !(event.buttons & 1))) return;
  const value = chart.valueAt(event);
  change(id === "critical" ? { length: Number(value.toPrecision(4)) } : { speed: value * perUnit(state.unit) });
}

const charts = {};
let spoken = 0;

/** Everything anew: at once what is quick, curves in the background. */
function draw() {
  drawControls();
  const { lam, wf, gamma, unit } = groups(), quick = workOf(lam, wf, gamma) < MOST_WORK;
  critical = quick ? criticalStates(lam, wf, gamma, MOST_STATES) : [];
  const shapes = shapesNow(), expected = shapes?.find((shape) => shape.expected);
  $("verdict").dataset.kind = expected?.kind ?? "unknown";
  $("now").textContent = nowText(shapes);
  $("warning").textContent = warningText();
  $("warning").hidden = !leftOut().length;
  clearTimeout(spoken);
  // Read out when the slider rests.
  spoken = setTimeout(() => { $("spoken").textContent = ["now", "warning", "then"].map((id) => $(id).textContent).join(" "); }, 700);
  // Before the curves.
  if (shapes?.some((shape) => shape.kind === "pending")) background("verdicts", judgedAll(shapes, draw));
  else jobs.delete("verdicts");
  drawTable(shapes ?? []);
  drawShapes(shapes ?? []);
  drawCriticalRows(critical, unit);
  drawCharts(shapes ?? [], expected);
  $("then").textContent = shapes ? thenText(critical) : "";
}

function drawControls() {
  const tabulated = isTabulated();
  const fill = (box, value) => { if (document.activeElement !== box || box.validity.valid) box.value = value; };
  $("scene").value = state.scene;
  for (const [key, label, unit] of SLIDERS) {
    fill($(key), Number(state[key].toPrecision(5)));
    $(`${key}-slide`).value = toSlide(key);
    $(`${key}-slide`).setAttribute("aria-valuetext", `${label} ${digits(state[key])} ${unit}`);
  }
  for (const [id, unit] of [["kn", "kn"], ["rpm", "rpm"], ["m_s", "m/s"]]) fill($(id), Number(speedIn(state.speed, unit).toPrecision(4)));
  $("speed-slide").value = toSlide("speed");
  $("speed-slide").setAttribute("aria-valuetext", `${digits(speedIn(state.speed, "kn"))} knots, ${digits(speedIn(state.speed, "rpm"))} rpm`);
  $("with-drag").disabled = !tabulated;
  $("with-drag").checked = withDrag();
  $("no-drag").checked = !withDrag();
  const table = tableHere();
  $("why").textContent = !table ? "There is a table for the scenes of the list only: towatlas explore makes a page for yours."
    : !tabulated ? "The cable is no longer that of the scene: its table does not hold, drag is left out."
      : isBeyond() ? `The table holds from ${speedText(table.low)} to ${speedText(table.high)}.`
        : withDrag() ? `${state.density === 0 ? "The scene is in a vacuum" : `Model: ${table.model}`}; move any slider but the speed, and drag is left out.`
          : "";
  $("back").hidden = !table || tabulated;
}

function drawTable(shapes) {
  const picked = pickedOf(shapes);
  $("rows").replaceChildren(...shapes.map((shape) => {
    const row = element("tr", shape === picked ? { class: "picked" } : {}), draws = element("td");
    const radio = element("input", { type: "radio", name: "shape", "aria-label": `Draw the shape with ${shapeTitle(shape)}` });
    radio.checked = shape === picked;
    radio.addEventListener("change", () => {
      state.picked = shape.name;
      draw();
      document.querySelector("#rows input:checked")?.focus();
    });
    draws.append(radio);
    const title = shape.expected ? `${shapeTitle(shape)} (to expect)` : shapeTitle(shape);
    const cells = [title, lengthText(shape.r_f), lengthText(shape.z_f), forceText(shape.tension), KINDS[shape.kind]];
    row.append(draws, ...cells.map((text, k) => element("td", k > 0 && k < 4 ? { class: "n" } : {}, text)));
    return row;
  }));
}

const pickedOf = (shapes) => shapes.find((shape) => shape.name === state.picked) ?? shapes.find((shape) => shape.expected) ?? shapes[0];

function drawCriticalRows(states, unit) {
  const { lam, wf, gamma } = groups();
  $("critical-rows").replaceChildren(...states.map((one) => {
    const row = element("tr"), speed = one.gamma * unit;
    const cells = [one.n, ...["kn", "rpm", "m/s"].map((name) => digits(speedIn(speed, name), 5)), digits(one.gamma, 8)];
    row.append(...cells.map((text) => element("td", { class: "n" }, text)));
    return row;
  }));
  $("groups").textContent = `Cable length over tow radius ${digits(lam, 5)}, weight of the fish over that of a cable as long as the radius `
    + `${digits(wf, 5)}, speed gamma ${digits(gamma, 5)}. ${states.length ? `The cable has ${digits(transitions(lam, wf))} critical speeds in all.` : "None."}`;
}

function begin() {
  makeControls();
  show(known.tables[0].scene, 0);
}
