// A line along a footprint: pressure, heat, temperature and friction.

import { makeCaseTab } from "./case_tab.js";
import { band, colours, curve, draw } from "./charts.js";
import { fixed, notes, numbers } from "./controls.js";

const WORDS = {
  gaussian: "a Gaussian", line: "a file", image: "a row of a picture",
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
  const pair = (key) => [
    curve("film law", series.x, series[key], colours.c1),
    ...(series[`model_${key}`] ? [curve("the thesis's balance", series.x, series[`model_${key}`], colours.c2, "dot")] : []),
  ];
  draw("chart-heat", pair("flux"),
    { x, shapes, said: `Friction heat along the line, up to ${fixed(Math.max(...series.flux))} watts per square metre` });
  draw("chart-line-temperature", pair("temperature"),
    { x, shapes, said: `Temperature of the ice along the line, up to ${fixed(Math.max(...series.temperature))} degrees; ${states}` });
  draw("chart-line-mu", pair("mu"), { x, shapes, said: `Friction along the line, mean ${fixed(found.mu_mean)}` });
  notes(document.getElementById("line-notes"), sentences);
  numbers(document.getElementById("line-numbers"), [
    ["mean μ", fixed(found.mu_mean)],
    ["leading, trailing edge", `${fixed(found.leading)}, ${fixed(found.trailing)} °C`],
    ...(found.mu_map === undefined ? [] : [
      ["mean μ, (4.7) to (4.9)", fixed(found.mu_map)],
      ["μ of the balance (3.8)", fixed(found.mu_balance)],
      ["largest rise", `${fixed(found.peak_rise)} K`],
      ["heat to ice, tread, water", `${[found.heat_of_ice, found.heat_of_tread, found.heat_of_water].map((q) => fixed(q)).join(", ")} W/m`],
    ]),
  ]);
}
