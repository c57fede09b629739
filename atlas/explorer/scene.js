"use strict";
// A scene pasted into the page: TOML, quantities with units, and what of it the vacuum needs, as towatlas.scene reads it.

const GRAVITY = 9.80665;
const POUND = 0.45359237, INCH = 0.0254, FOOT = 0.3048, MILE = 1852;
// Factor to SI, and powers of kg, m, s, rad.
const UNITS = {};
for (const [names, factor, kinds, prefixes] of [
  ["m meter metre", 1, "m", "k c m u µ d"], ["g gram", 1e-3, "kg", "k m u µ"], ["s sec second", 1, "s", "m u µ"],
  ["N newton", 1, "kg m s^-2", "k m M"], ["l L liter litre", 1e-3, "m^3", "m c d"], ["rad radian", 1, "rad", "m"],
  ["in inch inches", INCH, "m", ""], ["ft foot feet", FOOT, "m", ""], ["yd yard yards", 3 * FOOT, "m", ""],
  ["fathom fathoms", 6 * 1200 / 3937, "m", ""], ["nmi nautical_mile", MILE, "m", ""], ["mi mile miles", 5280 * FOOT, "m", ""],
  ["lb lbm pound pounds", POUND, "kg", ""], ["oz ounce ounces", POUND / 16, "kg", ""], ["slug", POUND * GRAVITY / FOOT, "kg", ""],
  ["t tonne", 1000, "kg", ""], ["grain", POUND / 7000, "kg", ""],
  ["lbf", POUND * GRAVITY, "kg m s^-2", ""], ["kgf", GRAVITY, "kg m s^-2", ""], ["gf", 1e-3 * GRAVITY, "kg m s^-2", ""],
  ["kip", 1000 * POUND * GRAVITY, "kg m s^-2", ""],
  ["kn kt knot knots", MILE / 3600, "m s^-1", ""], ["mph", 5280 * FOOT / 3600, "m s^-1", ""], ["kph", 1 / 3.6, "m s^-1", ""],
  ["min minute minutes", 60, "s", ""], ["h hr hour hours", 3600, "s", ""], ["day days", 86400, "s", ""],
  ["deg degree degrees °", Math.PI / 180, "rad", ""], ["rev turn revolution", 2 * Math.PI, "rad", ""],
  ["rpm RPM Rpm", Math.PI / 30, "rad s^-1", ""], ["percent %", 0.01, "", ""], ["Hz", 1, "s^-1", "k m"],
]) {
  const powers = { kg: 0, m: 0, s: 0, rad: 0 };
  for (const part of kinds.split(" ").filter(Boolean)) {
    const [name, power] = part.split("^");
    powers[name] += Number(power || 1);
  }
  const sizes = { k: 1e3, M: 1e6, d: 0.1, c: 1e-2, m: 1e-3, u: 1e-6, "µ": 1e-6 };
  for (const name of names.split(" ")) {
    UNITS[name] = { factor, powers };
    const long = { k: "kilo", M: "mega", d: "deci", c: "centi", m: "milli", u: "micro" };
    for (const prefix of prefixes.split(" ").filter(Boolean)) {
      const scaled = { factor: factor * sizes[prefix], powers };
      if (name.length <= 2 || name === "rad") UNITS[prefix + name] = scaled;
      else if (long[prefix]) UNITS[long[prefix] + name] = scaled;
    }
  }
}
const AMBIGUOUS = {
  nm: "a nanometre or a nautical mile: write nmi or 1e-9 m", gr: "a grain or a gram: write grain or g",
  Hz: "turns or radians: write rpm, rev/s or rad/s",
};
const SAMPLES = {
  m: '"120 m"', "m^2": '"0.1 m^2"', "m^3": '"12 l"', "m/s": '"3 kn"', "m/s^2": '"9.81 m/s^2"', "rad/s": '"40 rpm"',
  rad: '"30 deg"', s: '"2 min"', kg: '"14.1 g"', "kg/m": '"0.18 g/ft"', "kg/m^3": '"1025 kg/m^3"', N: '"50 N"',
  "N/m": '"2 N/m"', "": "1.2",
};

/** Factor to SI of a unit as people write it, and its powers. */
function unitOf(text, name, written) {
  let total = 1;
  const powers = { kg: 0, m: 0, s: 0, rad: 0 };
  const bad = () => new Error(`${name} = ${written}: unit "${text}" is not known here; write SI units, or ft, in, lb, kn, rpm`);
  let rest = text.trim(), sign = 1;
  while (rest) {
    const one = /^(?:([*·])|(\/)\s*(10{1,6})?|([^\W\d_]+(?:_[a-z]+)*|[%°µ][^\W\d_]*)\s*(?:(?:\^|\*\*)\s*([+-]?\d)|([23])(?!\w))?|(1)(?=\s*\/))\s*/u.exec(rest);
    if (!one) throw bad();
    rest = rest.slice(one[0].length);
    if (one[2]) {
      sign = -1;
      if (one[3]) total /= Number(one[3]);
      if (!rest) throw bad();
    } else if (one[1]) {
      sign = 1;
    } else if (one[4]) {
      if (AMBIGUOUS[one[4]]) throw new Error(`${name} = ${written}: ${one[4]} may be ${AMBIGUOUS[one[4]]}`);
      const unit = Object.hasOwn(UNITS, one[4]) ? UNITS[one[4]] : null;
      if (!unit) throw bad();
      const power = sign * Number(one[5] || one[6] || 1);
      total *= unit.factor ** power;
      for (const kind in powers) powers[kind] += power * unit.powers[kind];
      // a/b c is a/b times c, as units are read elsewhere.
      sign = 1;
    }
  }
  return { factor: total, powers };
}

/** A quantity in SI; a bare number is SI, or `bare`. What stands behind +- is left out. */
function quantityOf(name, value, unit, bare = unit) {
  const written = JSON.stringify(value), sample = SAMPLES[unit];
  if (typeof value === "number") {
    if (!Number.isFinite(value)) throw new Error(`${name} = ${value} is not finite`);
    if (unit === "rad") throw new Error(`${name} = ${value}: degrees or radians? Write it as ${sample}`);
    return value * unitOf(bare, name, written).factor;
  }
  const expected = `write a number in SI or a text as ${sample}`;
  if (typeof value !== "string" || value.length > 100) throw new Error(`${name} = ${written} is no quantity; ${expected}`);
  let text = value;
  const spread = /^\s*\(?\s*(.*?)\s*(?:\+\/?-|±)\s*(.*?)\s*(?:\)(.*))?$/.exec(value);
  if (spread) {
    const behind = spread[3] || /^[\d.eE+-]+\s*(.*)$/.exec(spread[2])?.[1] || "";
    text = /[^\W\d]/.test(spread[1].replace(/[eE][+-]?\d/, "")) || behind === "%" ? spread[1] : `${spread[1]} ${behind}`;
  }
  const decimal = String.raw`(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?`;
  const parts = new RegExp(String.raw`^\s*([+-]?)\s*(?:(\d+)\s+(\d+)\/(\d+)|(${decimal})(?:\s*\/\s*(${decimal}))?)\s*(.*?)\s*$`).exec(text);
  if (!parts) throw new Error(`${name} = ${written} is no quantity; ${expected}`);
  const number = (parts[1] === "-" ? -1 : 1) *
    (parts[2] ? Number(parts[2]) + Number(parts[3]) / Number(parts[4]) : Number(parts[5]) / Number(parts[6] || 1));
  const given = unitOf(parts[7], name, written), wanted = unitOf(unit, name, written);
  if (Object.keys(given.powers).some((kind) => given.powers[kind] !== wanted.powers[kind])) {
    throw new Error(`${name} = ${written} ${parts[7] ? `is not in ${unit || "pure numbers"}` : "has no unit"}; write it as ${sample}`);
  }
  const found = number * (given.factor / wanted.factor);
  if (!Number.isFinite(found)) throw new Error(`${name} = ${written} is not finite`);
  return found;
}

/** The tables of a TOML text, of what a scene may hold: sections, keys, texts, numbers, true and false. */
function parseToml(text) {
  const found = Object.create(null);
  let table = found;
  text.replace(/^\uFEFF/, "").split(/\r?\n/).forEach((line, k) => {
    const at = `line ${k + 1}`;
    if (/^\s*(#.*)?$/.test(line)) return;
    const section = /^\s*\[\s*([\w-]+)\s*\]\s*(#.*)?$/.exec(line);
    if (section) {
      if (section[1] in found) throw new Error(`${at}: [${section[1]}] is there twice`);
      table = found[section[1]] = Object.create(null);
      return;
    }
    const pair = /^\s*([\w-]+)(?:\s*\.\s*([\w-]+))?\s*=\s*(.*)$/.exec(line);
    if (!pair) throw new Error(`${at} is no TOML: write [section], or key = value; a text in "quotes"`);
    let holder = table, key = pair[1];
    if (pair[2]) {
      holder = table[pair[1]] = table[pair[1]] ?? Object.create(null);
      if (typeof holder !== "object") throw new Error(`${at}: ${pair[1]} is a value already`);
      key = pair[2];
    }
    if (key in holder) throw new Error(`${at}: ${key} is there twice`);
    holder[key] = tomlValue(pair[3], key, at);
  });
  return found;
}

function tomlValue(text, key, at) {
  const end = String.raw`\s*(?:#.*)?$`;
  let one = new RegExp(String.raw`^"((?:[^"\\]|\\.)*)"${end}`).exec(text);
  if (one) {
    try {
      return JSON.parse(`"${one[1].replace(/\t/g, "\\t")}"`);
    } catch {
      throw new Error(`${at}: the text of ${key} has an escape that is none`);
    }
  }
  one = new RegExp(String.raw`^'([^']*)'${end}`).exec(text);
  if (one) return one[1];
  one = new RegExp(String.raw`^([^#"']*?)${end}`).exec(text);
  const word = one ? one[1] : text;
  if (/^[+-]?(\d+(_\d+)*)(\.\d+(_\d+)*)?([eE][+-]?\d+)?$/.test(word) && !/^[+-]?0\d/.test(word)) return Number(word.replace(/_/g, ""));
  if (/^[+-]?(inf|nan)$/.test(word)) return word.includes("nan") ? NaN : Infinity;
  if (word === "true" || word === "false") return word === "true";
  throw new Error(`${at}: ${key} = ${word.trim() || "nothing"} is no value; a text stands in "quotes"`);
}

const MAY_BE_ZERO = new Set(["drag_coefficient", "tangential_drag_coefficient", "side_force_coefficient", "mass", "volume",
  "added_mass", "frontal_area", "density"]);
const SIGNED = new Set(["submerged_weight_per_length", "submerged_weight"]);

/** All keys of a scene in SI, by section.key; `known.keys` are those of towatlas.scene.keys. */
function valuesOf(table, known) {
  const values = {}, flat = Object.create(null);
  for (const [name, value] of Object.entries(table)) {
    if (value !== null && typeof value === "object") {
      if (!name || !Object.hasOwn(known.keys, name)) throw new Error(`section [${name}] is unknown; known are cable, fish, tow, fluid`);
      for (const key in value) flat[`${name}.${key}`] = value[key];
    } else if (Object.hasOwn(known.keys, name)) {
      throw new Error(`${name} is a section; write [${name}] and its keys below`);
    } else flat[name] = value;
  }
  for (const [name, value] of Object.entries(flat)) {
    const [section, key] = name.includes(".") ? name.split(".") : ["", name];
    const keys = known.keys[section];
    if (!Object.hasOwn(keys, key)) throw new Error(`key ${name} is unknown; known are ${Object.keys(keys).join(", ")}`);
    const unit = keys[key];
    if (Array.isArray(unit)) {
      if (!unit.includes(value)) throw new Error(`${name} = ${JSON.stringify(value)} must be ${unit.join(" or ")}`);
    } else if (unit === "text") {
      if (typeof value !== "string") throw new Error(`${name} = ${JSON.stringify(value)} is not a text`);
    } else {
      values[name] = quantityOf(name, value, unit, key === "rpm" ? "rpm" : unit);
      if (!SIGNED.has(key) && (values[name] < 0 || (values[name] === 0 && !MAY_BE_ZERO.has(key)))) {
        throw new Error(`${name} = ${JSON.stringify(value)} is ${values[name] < 0 ? "negative" : "zero"}`);
      }
      continue;
    }
    values[name] = value;
  }
  return values;
}

function oneOf(values, section, names, what) {
  const given = names.filter((name) => `${section}.${name}` in values);
  if (!given.length) throw new Error(`${what} is missing: give one of ${names.map((name) => `${section}.${name}`).join(", ")}`);
  if (given.length > 1) throw new Error(`${given.map((name) => `${section}.${name}`).join(" and ")} are both given, and both are ${what}: keep one`);
  return given[0];
}

/** Drag constant C of a cable in its fluid, Eq. (13c) of NRL Report 7048; 0 in a vacuum. */
function dragConstant({ density, drag_coefficient, diameter, radius, mass_per_length, displaced_per_length }) {
  return density ? 0.5 * density * drag_coefficient * diameter * radius / (mass_per_length + displaced_per_length) : 0;
}

/** What the vacuum needs of a scene, and what tells how much it leaves out, in SI; null for what a vacuum does not need. */
function sceneOf(text, known) {
  const values = valuesOf(parseToml(text), known), gravity = values.gravity ?? GRAVITY;
  if (values["cable.library"]) throw new Error("cable.library is a file, which this page cannot open: give cable.mass_per_length");
  if ("cable.type" in values) {
    const type = values["cable.type"];
    if (!Object.hasOwn(known.cables, type)) throw new Error(`cable.type = "${type}" is unknown; known are ${Object.keys(known.cables).join(", ")}`);
    const weighed = "cable.mass_per_length" in values || "cable.submerged_weight_per_length" in values;
    for (const [key, value] of Object.entries(known.cables[type])) {
      const weight = key === "mass_per_length" || key === "displaced_area";
      if (!(weight && weighed) && !(`cable.${key}` in values)) values[`cable.${key}`] = value;
    }
  }
  const fluid = oneOf(values, "fluid", ["name", "density"], "the fluid");
  const name = String(values["fluid.name"]).trim().toLowerCase();
  if (fluid === "name" && !Object.hasOwn(known.fluids, name)) {
    throw new Error(`fluid.name = "${values["fluid.name"]}" is unknown; known are ${Object.keys(known.fluids).join(", ")}`);
  }
  const density = fluid === "density" ? values["fluid.density"] : known.fluids[name];
  if (!("cable.length" in values)) throw new Error("cable.length is missing");
  for (const key of density ? ["cable.diameter", "cable.drag_coefficient"] : []) {
    if (!(key in values)) throw new Error(`${key} is missing: in a fluid the cable needs it for its drag`);
  }
  const [radius, speed] = circleOf(values, gravity), [mass_per_length, displaced_per_length] = cableMass(values, density, gravity);
  return {
    title: values.title ?? "", length: values["cable.length"], mass_per_length, displaced_per_length,
    diameter: values["cable.diameter"] ?? null, drag_coefficient: values["cable.drag_coefficient"] ?? null,
    fish_mass: fishMass(values, density, gravity), radius, speed, gravity, density,
  };
}

function circleOf(values, gravity) {
  const kinds = ["speed", "rpm", "rotation_rate", "period", "bank_angle", "gamma"];
  const rate = (key) => (key === "period" ? 2 * Math.PI / values["tow.period"] : values[`tow.${key}`]);
  const gamma = () => {
    if ("tow.gamma" in values) return values["tow.gamma"];
    if (values["tow.bank_angle"] >= 0.5 * Math.PI) throw new Error("tow.bank_angle must be less than 90 degrees");
    return Math.sqrt(Math.tan(values["tow.bank_angle"]));
  };
  const byGravity = (key) => key === "gamma" || key === "bank_angle";
  let radius = values["tow.radius"], speed = values["tow.speed"];
  if (radius !== undefined) {
    const key = oneOf(values, "tow", kinds, "the speed of the tow point");
    if (key !== "speed") speed = byGravity(key) ? gamma() * Math.sqrt(radius * gravity) : rate(key) * radius;
  } else {
    const others = kinds.slice(1).filter((key) => `tow.${key}` in values);
    if (speed === undefined || others.length !== 1) throw new Error("tow.radius is missing: the radius of the circle of the tow point");
    radius = byGravity(others[0]) ? (speed / gamma()) ** 2 / gravity : speed / rate(others[0]);
  }
  if (!(radius > 0 && radius < Infinity && speed > 0 && speed < Infinity)) throw new Error(`the keys of [tow] make a circle of ${radius} m and a speed of ${speed} m/s`);
  return [radius, speed];
}

/** Mass of the cable and of the fluid that it displaces, over its length. */
function cableMass(values, density, gravity) {
  const mass = values["cable.mass_per_length"], weight = values["cable.submerged_weight_per_length"];
  if (mass !== undefined && weight !== undefined) {
    if (!density) throw new Error("cable.mass_per_length and cable.submerged_weight_per_length are both the mass of the cable in a vacuum: keep one");
    if (weight > mass * gravity) throw new Error("cable.submerged_weight_per_length is more than the weight of cable.mass_per_length");
    return [mass, mass - weight / gravity];
  }
  if (mass === undefined && weight === undefined) throw new Error("the mass of the cable is missing: give cable.mass_per_length");
  const area = values["cable.displaced_area"] ?? 0.25 * Math.PI * values["cable.diameter"] ** 2, displaced = density ? density * area : 0;
  const found = mass ?? weight / gravity + displaced;
  if (!(found > 0)) throw new Error("cable.submerged_weight_per_length is more buoyancy than a cable without mass would have");
  return [found, displaced];
}

function fishMass(values, density, gravity) {
  if (!Object.keys(values).some((key) => key.startsWith("fish."))) return 0;
  const mass = values["fish.mass"], weight = values["fish.submerged_weight"], diameter = values["fish.diameter"];
  const volume = values["fish.volume"] ?? (diameter === undefined ? undefined : Math.PI * diameter ** 3 / 6);
  if (mass !== undefined) {
    if (weight !== undefined && values["fish.volume"] !== undefined) throw new Error("fish.mass, fish.volume and fish.submerged_weight are all given: each follows from the other two");
    if (weight !== undefined && !density) throw new Error("fish.mass and fish.submerged_weight are both the mass of the fish in a vacuum: keep one");
    if (weight !== undefined && weight > mass * gravity) throw new Error("fish.submerged_weight is more than the weight of fish.mass");
    return mass;
  }
  if (weight === undefined) throw new Error("fish.mass is missing; without a fish leave out the section [fish]");
  if (density && volume === undefined) throw new Error("fish.mass is missing; fish.submerged_weight gives it only together with fish.volume");
  const found = weight / gravity + density * (volume ?? 0);
  if (found < 0) throw new Error("fish.submerged_weight is more buoyancy than a fish without mass would have");
  return found;
}
