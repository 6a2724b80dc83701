// Friction at a point: curves over time, and a map over two parameters.

import { ask, latest, settled } from "./api.js";
import { SCALE, band, colours, curve, draw, drawMap as paintMap, moveCross, onColours, short } from "./charts.js";
import { fill, fixed, labelled, mark, notes, numbers, setTexts, slider, textOf, textsIn } from "./controls.js";
import { makePins } from "./pins.js";

const CONTACTS = { "compound B": "the table of compound B", constants: "the three sliders", table: "a table of your own" };
const ms = (seconds) => (seconds === null ? "does not happen" : `${fixed(1e3 * seconds)} ms`);

export function makePoint({ start, changed, snippet }) {
  const spec = start.point;
  const form = document.querySelector("#point form");
  const contact = document.getElementById("point-contact");
  const along = [document.getElementById("map-x"), document.getElementById("map-y")];
  const quantity = document.getElementById("map-quantity");
  const sliders = {};
  let now = null; // what is drawn: texts, answer, half, milliseconds
  let map = null;
  let begun = false; // an address computes before its tab is shown
  const pins = makePins({
    list: document.getElementById("pins"), button: document.getElementById("pin"), named: different,
    changed: () => (redraw(), changed()),
  });

  fill(contact, Object.entries(CONTACTS));
  document.querySelector("#point-table label").replaceWith(
    labelled("point-film.contact", "table (CSV file on this machine)", spec.help["film.contact"]));
  fill(quantity, Object.entries(spec.quantities));
  for (const each of spec.sliders) {
    sliders[each.key] = slider(form.querySelector(".sliders"), "point", each, spec.help[each.key], () => update());
  }
  const defaults = { ...textsIn(form), quantity: "mu_mean", x: "load.pressure", y: "load.speed" };
  for (const key of Object.keys(start.scene)) {
    if (sliders[key] || key === "film.contact") setTexts(form, { [key]: start.scene[key] });
  }
  if (start.scene["film.dry_stress"]) {
    setTexts(form, { "film.dry_softening": start.scene["film.dry_softening"] ?? "" });
  }
  if (start.scene["film.k"]) contact.value = "constants";
  if (start.scene["film.contact"]) contact.value = "table";
  contact.addEventListener("change", () => update());
  document.getElementById("point-film.contact").addEventListener("input", () => update());

  function choices() {
    const free = spec.sliders.filter((each) => contact.value === "constants" || !spec.constants.includes(each.key));
    for (const [number, select] of along.entries()) {
      const before = select.value;
      fill(select, free.map((each) => [each.key, each.label]));
      const kept = free.some((each) => each.key === before);
      select.value = kept ? before : number === 0 ? defaults.x : defaults.y;
    }
  }

  /** Texts as the server takes them: what the contact does not use is left out. */
  function texts() {
    const found = textsIn(form);
    if (found.contact !== "constants") for (const key of spec.constants) delete found[key];
    if (found.contact !== "table") delete found["film.contact"];
    return found;
  }

  function arrange() {
    document.getElementById("point-table").hidden = contact.value !== "table";
    for (const key of spec.constants) sliders[key].enable(contact.value === "constants");
    choices();
  }

  /** In what some texts differ from those of the present curve. */
  function different(other) {
    const name = (key) => sliders[key]?.spec.label.split(",")[0] ?? "";
    const keys = Object.keys({ ...now.texts, ...other }).filter((key) => other[key] !== undefined && other[key] !== now.texts[key]);
    return keys.map((key) => `${name(key)} ${CONTACTS[other[key]] ?? other[key]}`.trim()).join(", ") || "pinned";
  }

  const compute = latest(async (asked, begun, outdated) => {
    try {
      const answer = await ask("point", { texts: asked });
      mark(form);
      now = { texts: asked, answer, half: null };
      for (const [key, control] of Object.entries(sliders)) {
        if (answer.values[key] === undefined) continue; // a table, or of no effect
        if (asked[key] === undefined) control.show(answer.values[key]);
        else control.follow(answer.values[key]);
      }
      drawCurves();
      if (map) moveCross("chart-map", cross());
      await null; // the charts draw when this has ended
      document.getElementById("point-time").textContent = `Drawn in ${Math.round(performance.now() - begun)} ms.`;
      document.documentElement.dataset.drawn = String(Number(document.documentElement.dataset.drawn ?? 0) + 1);
      if (!outdated()) {
        now.half = await ask("half-space", { texts: asked });
        if (!outdated()) drawCompared();
      }
    } catch (error) {
      mark(form, error.message, error.keys ?? []);
    }
    if (!outdated()) computeMap();
  });

  const computeMap = settled(latest(async (outdated) => {
    const error = document.getElementById("map-error");
    try {
      map = await ask("map", { texts: texts(), along: along.map((select) => select.value), quantity: quantity.value });
      error.hidden = true;
      if (!outdated()) drawMap();
    } catch (refused) {
      error.hidden = (refused.keys ?? []).length > 0 && form.querySelector("[aria-invalid]") !== null;
      error.textContent = refused.message;
    }
  }), 120);

  function update() {
    begun = true;
    arrange();
    compute(texts(), performance.now());
    changed();
  }

  function shades() {
    const { melt_onset_s: melt, saturation_s: full } = now.answer.numbers;
    const end = now.answer.series.time.at(-1);
    const shapes = [];
    if (melt !== null) shapes.push(band(1e3 * melt, full === null ? end : 1e3 * full, colours.melting));
    if (full !== null) shapes.push(band(1e3 * full, end, colours.saturated));
    return shapes;
  }

  const x = "t (ms)";

  function redraw() {
    if (!now) return;
    drawCurves();
    drawMap();
  }

  function drawCurves() {
    const { series } = now.answer;
    const shapes = shades();
    pins.refresh();
    drawCompared(shapes);
    draw("chart-film", [
      curve("h", series.time, series.film, colours.c1),
      curve("squeezed out", series.time.slice(1), series.squeezed.slice(1), colours.c3),
      ...pins.curves("film"),
    ], { x, shapes, log: true, said: `Film height over time, from ${fixed(series.film[0])} to ${fixed(series.film.at(-1))} nm` });
    draw("chart-temperature", [
      curve("surface", series.time, series.temperature, colours.c1),
      ...pins.curves("temperature"),
    ], { x, shapes, said: `Temperature of the ice surface over time, from ${fixed(series.temperature[0])} to ${fixed(series.temperature.at(-1))} degrees Celsius` });
    notes(document.getElementById("point-notes"), now.answer.notes);
  }

  /** The curves that the closed form stands beside, and the numbers. */
  function drawCompared(shapes = shades()) {
    const { series, numbers: found } = now.answer;
    const half = now.half?.series;
    const said = `mean friction ${fixed(found.mu_mean)}, peak ${fixed(found.mu_peak)} at ${ms(found.mu_peak_time_s)}, ` +
      `end ${fixed(found.mu_end)}; melting begins: ${ms(found.melt_onset_s)}; saturated: ${ms(found.saturation_s)}`;
    draw("chart-mu", [
      curve("conduction resolved", series.time, series.mu, colours.c1),
      ...(half ? [curve("closed form (5.6)", half.time, half.mu, colours.c2, "dot")] : []),
      ...pins.curves("mu"),
    ], { x, shapes, said: `Friction over time: ${said}` });
    draw("chart-flux", [
      curve("friction", series.middle, series.friction_flux, colours.c4),
      curve("into the ice", series.middle, series.ice_flux, colours.c1),
      ...(half ? [
        curve("into the ice, closed form", half.middle, half.ice_flux, colours.c2, "dot"),
        curve("(5.6) from t = 0", half.closed_time, half.closed_flux, colours.c3, "dashdot"),
      ] : []),
    ], { x, shapes, log: true, said: "Heat flux over time: of friction and into the ice" });
    const beside = now.half ? ` (closed form ${fixed(now.half.numbers.mu_mean)})` : "";
    numbers(document.getElementById("point-numbers"), [
      ["mean μ", fixed(found.mu_mean) + beside],
      ["peak μ", `${fixed(found.mu_peak)} at ${ms(found.mu_peak_time_s)}`],
      ["μ at the end", fixed(found.mu_end)],
      ["melting begins", ms(found.melt_onset_s)],
      ["saturated", ms(found.saturation_s)],
      ...pins.numbers().map(([name, { mu_mean: mean }]) => [`mean μ, ${name}`, fixed(mean)]),
    ]);
  }

  /** Where the sliders stand on the map. */
  function cross() {
    return map.along.map((key) => {
      const { scale, shift } = sliders[key].spec;
      return (now.answer.values[key] - shift) / scale;
    });
  }

  function drawMap() {
    if (!map || !now) return;
    const [x, y] = map.along.map((key) => sliders[key].spec);
    const side = (each, values) => ({ values, log: each.log, label: each.unit ? `${each.label} (${each.unit})` : each.label });
    const range = paintMap("chart-map", side(x, map.x), side(y, map.y), map.z, cross(), {
      said: `Map of ${map.quantity} over ${x.label} and ${y.label}`,
      over: (i, j) => {
        const value = map.z[j]?.[i];
        document.getElementById("map-value").textContent = value === undefined ? "" :
          `${textOf(x, map.x[i])}, ${textOf(y, map.y[j])}: ${map.quantity} ${short(value)}`;
      },
      click: (i, j) => {
        for (const [key, value] of [[x.key, map.x[i]], [y.key, map.y[j]]]) {
          if (value !== undefined) sliders[key].text.value = textOf(sliders[key].spec, value);
        }
        update();
      },
    });
    if (!range) return;
    document.getElementById("map-low").textContent = short(range.low);
    document.getElementById("map-high").textContent = `${short(range.high)} ${map.quantity}`;
    document.getElementById("map-scale").style.background = SCALE;
  }

  document.getElementById("pin").addEventListener("click", () => now && pins.pin(now.texts, now.answer));
  document.getElementById("point-reset").addEventListener("click", () => restore({}));
  document.getElementById("map-python").addEventListener("click", () => {
    if (map) snippet("Lines of Python of the map", "map.py", map.python);
  });
  for (const select of [...along, quantity]) select.addEventListener("change", () => (computeMap(), changed()));
  onColours(redraw);

  function state() {
    const all = { ...texts(), quantity: quantity.value, x: along[0].value, y: along[1].value };
    const kept = Object.entries(all).filter(([key, text]) => text !== defaults[key]);
    return { ...Object.fromEntries(kept), ...pins.state() };
  }

  function restore(found) {
    if (Object.keys(found).length > 0 || now) {
      setTexts(form, { ...defaults, ...found });
      quantity.value = found.quantity ?? defaults.quantity;
    }
    arrange();
    for (const [number, name] of ["x", "y"].entries()) along[number].value = found[name] ?? defaults[name];
    pins.restore(found);
    update();
  }

  return {
    state, restore,
    redraw() {
      if (begun) redraw();
      else update();
    },
    toml: () => now?.answer.toml,
    python: () => now?.answer.python,
  };
}
