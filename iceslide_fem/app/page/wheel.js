// The wheel: friction over slip, and what of its contact slides, melts and is full of water.

import { makeCaseTab } from "./case_tab.js";
import { colours, curve, dots, draw } from "./charts.js";
import { fixed, notes, numbers } from "./controls.js";

const WORDS = { even: "even", gaussian: "a Gaussian", slick: "slick", blocks: "blocks and grooves" };

export function makeWheel({ start, changed }) {
  return makeCaseTab({ name: "wheel", spec: start.wheel, words: WORDS, draw: drawWheel, changed });
}

function drawWheel({ series, numbers: found, notes: sentences }) {
  const x = "slip ratio S";
  draw("chart-wheel-mu", [
    curve("μ", series.slip, series.mu, colours.c1),
    dots("peak", [found.peak_slip], [found.mu_peak], colours.c2),
    dots("locked", [1], [found.mu_locked], colours.c3),
  ], { x, said: `Friction over slip: peak ${fixed(found.mu_peak)} at a slip ratio of ${fixed(found.peak_slip)}, locked ${fixed(found.mu_locked)}` });
  draw("chart-wheel-contact", [
    curve("slides", series.slip, series.sliding, colours.c1),
    curve("melts", series.slip, series.melting, colours.c2, "dash"),
    curve("free volume full", series.slip, series.saturated, colours.c3, "dot"),
  ], { x, said: `Of the contact of the locked wheel ${fixed(100 * series.melting.at(-1))} per cent melt` });
  draw("chart-wheel-temperature", [curve("T", series.slip, series.temperature, colours.c2)],
    { x, said: "Mean temperature of the ice below what slides, over slip" });
  draw("chart-wheel-film", [curve("h", series.slip, series.film, colours.c1)],
    { x, said: "Mean height of the films of what slides, over slip" });
  notes(document.getElementById("wheel-notes"), sentences);
  numbers(document.getElementById("wheel-numbers"), [
    ["peak μ", fixed(found.mu_peak)],
    ["at slip ratio", fixed(found.peak_slip)],
    ["locked μ", fixed(found.mu_locked)],
    ["locked over peak", fixed(found.mu_locked / found.mu_peak)],
  ]);
}
