// The macroscopic line: pressure, heat, temperature and friction along the footprint.

import { ask, latest } from "./api.js";
import { band, colours, curve, draw, onColours } from "./charts.js";
import { element, fill, mark, notes, numbers, setTexts, slider, textsIn } from "./controls.js";

const WORDS = {
  gaussian: "a Gaussian", file: "a file", picture: "a row of a picture",
  "next pixel": "the next pixel, (3.3)", moving: "a source that moves",
};
const fixed = (value, digits = 3) => Number(value.toPrecision(digits)).toString();

export function makeLine({ start, changed }) {
  const spec = start.line;
  const form = document.querySelector("#line form");
  const fields = form.querySelector(".fields");
  const sliders = {};
  let now = null;

  for (const [key, label, choices] of spec.choices) {
    const select = element("select", { id: `line-${key}`, "data-key": key });
    fill(select, choices.map((choice) => [choice, WORDS[choice] ?? choice]));
    select.addEventListener("change", () => update());
    fields.append(element("div", { class: "field" }, element("label", { for: select.id }, label), select));
  }
  for (const [key, label] of spec.texts) {
    const input = element("input", { type: "text", id: `line-${key}`, "data-key": key, autocomplete: "off", spellcheck: "false" });
    input.addEventListener("input", () => update());
    fields.append(element("div", { class: "field" }, element("label", { for: input.id }, label), input));
  }
  for (const each of spec.sliders) sliders[each.key] = slider(fields, "line", each, () => update());
  for (const key of spec.empty) sliders[key].text.value = "";
  const defaults = textsIn(form);

  function unused() {
    const { profile, source, film_law: film } = Object.fromEntries(spec.choices.map(([key]) => [key, document.getElementById(`line-${key}`).value]));
    return [
      ...[...spec.gaussian, ...spec.file, ...spec.picture].filter((key) => !spec[profile].includes(key)),
      ...(source === "moving" ? spec.next_pixel : []),
      ...(film === "yes" ? [] : spec.film),
    ];
  }

  function texts() {
    const found = textsIn(form);
    for (const key of unused()) delete found[key];
    return found;
  }

  const compute = latest(async (asked, begun) => {
    try {
      const answer = await ask("line", { texts: asked });
      mark(form);
      now = answer;
      for (const [key, control] of Object.entries(sliders)) {
        if (answer.values[key] !== null && asked[key] !== undefined) control.follow(answer.values[key]);
      }
      redraw();
      document.getElementById("line-time").textContent = `Drawn in ${Math.round(performance.now() - begun)} ms.`;
      document.documentElement.dataset.lines = String(Number(document.documentElement.dataset.lines ?? 0) + 1);
    } catch (error) {
      mark(form, error.message, error.keys ?? []);
    }
  });

  function arrange() {
    const left = unused();
    for (const field of fields.querySelectorAll("[data-key]")) {
      field.closest(".field").hidden = left.includes(field.dataset.key);
    }
  }

  function update() {
    arrange();
    compute(texts(), performance.now());
    changed();
  }

  /** Mixed and wet stretches, as bands. */
  function shades() {
    const { x, state } = now.series;
    const half = x.length > 1 ? (x[1] - x[0]) / 2 : 0;
    const shapes = [];
    let first = 0;
    for (let i = 1; i <= x.length; i += 1) {
      if (i < x.length && state[i] === state[first]) continue;
      const colour = { mixed: colours.melting, wet: colours.saturated }[state[first]];
      if (colour) shapes.push(band(x[first] - half, x[i - 1] + half, colour));
      first = i;
    }
    return shapes;
  }

  function redraw() {
    if (!now) return;
    const { series, numbers: found } = now;
    const shapes = shades();
    const x = "x (mm)";
    const states = [...new Set(series.state)].join(", ");
    draw("chart-pressure", [curve("pressure", series.x, series.pressure, colours.c1)],
      { x, shapes, said: `Contact pressure along the line, up to ${fixed(Math.max(...series.pressure))} bar` });
    draw("chart-heat", [curve("Q", series.x, series.flux, colours.c2)],
      { x, shapes, said: `Friction heat along the line, up to ${fixed(Math.max(...series.flux))} watts per square metre` });
    draw("chart-line-temperature", [
      curve("model", series.x, series.temperature, colours.c1),
      ...(series.film_temperature ? [curve("film law", series.x, series.film_temperature, colours.c2, "dot")] : []),
    ], { x, shapes, said: `Temperature of the ice along the line, rising by up to ${fixed(found.peak_rise)} degrees; ${states}` });
    draw("chart-line-mu", [
      curve("(4.7) to (4.9)", series.x, series.mu, colours.c1),
      ...(series.film_mu ? [curve("film law", series.x, series.film_mu, colours.c2, "dot")] : []),
    ], { x, shapes, said: `Friction along the line, mean ${fixed(found.mu_mean)}` });
    notes(document.getElementById("line-notes"), now.notes);
    numbers(document.getElementById("line-numbers"), [
      ["mean μ, (4.7) to (4.9)", fixed(found.mu_mean)],
      ["μ of the balance (3.8)", fixed(found.mu_balance)],
      ...(found.film_mu === undefined ? [] : [["mean μ, film law", fixed(found.film_mu)]]),
      ["largest rise", `${fixed(found.peak_rise)} K`],
      ["leading, trailing edge", `${fixed(found.leading)}, ${fixed(found.trailing)} °C`],
      ["heat to ice, tread, water", `${[found.heat_of_ice, found.heat_of_tread, found.heat_of_water].map((q) => fixed(q)).join(", ")} W/m`],
    ]);
  }

  function state() {
    return Object.fromEntries(Object.entries(texts()).filter(([key, text]) => text !== defaults[key]));
  }

  function restore(found) {
    setTexts(form, { ...defaults, ...found });
    update();
  }

  document.getElementById("line-reset").addEventListener("click", () => restore({}));
  onColours(redraw);
  let begun = false;
  return {
    state, restore,
    redraw() {
      if (begun) redraw();
      else update();
      begun = true;
    },
    toml: () => now?.command,
    python: () => now?.python,
  };
}
