// The macroscopic line: pressure, heat, temperature and friction along the footprint.

import { makeCaseTab } from "./case_tab.js";
import { band, colours, curve, draw } from "./charts.js";
import { fixed, notes, numbers } from "./controls.js";

const WORDS = {
  gaussian: "a Gaussian", file: "a file", picture: "a row of a picture",
  "next pixel": "the next pixel, (3.3)", moving: "a source that moves",
};

export function makeLine({ start, changed }) {
  return makeCaseTab({ name: "line", spec: start.line, words: WORDS, draw: drawLine, changed });
}

/** Mixed and wet stretches, as bands. */
function shades({ x, state }) {
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

function drawLine({ series, numbers: found, notes: sentences }) {
  const shapes = shades(series);
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
  notes(document.getElementById("line-notes"), sentences);
  numbers(document.getElementById("line-numbers"), [
    ["mean μ, (4.7) to (4.9)", fixed(found.mu_mean)],
    ["μ of the balance (3.8)", fixed(found.mu_balance)],
    ...(found.film_mu === undefined ? [] : [["mean μ, film law", fixed(found.film_mu)]]),
    ["largest rise", `${fixed(found.peak_rise)} K`],
    ["leading, trailing edge", `${fixed(found.leading)}, ${fixed(found.trailing)} °C`],
    ["heat to ice, tread, water", `${[found.heat_of_ice, found.heat_of_tread, found.heat_of_water].map((q) => fixed(q)).join(", ")} W/m`],
  ]);
}
