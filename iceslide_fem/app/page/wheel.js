// The wheel: friction over slip, what of its contact slides, melts and is full of water, and stops.

import { ask } from "./api.js";
import { makeCaseTab } from "./case_tab.js";
import { colours, curve, dots, draw, onColours } from "./charts.js";
import { element, fixed, notes, numbers } from "./controls.js";

const WORDS = { even: "even", gaussian: "a Gaussian", slick: "slick", blocks: "blocks and grooves" };
const CONTROLS = { locked: "locked wheel", threshold: "thresholds of slip (ABS)", ideal: "always at the peak" };
const get = (id) => document.getElementById(id);

export function makeWheel({ start, changed }) {
  const tab = makeCaseTab({
    name: "wheel", spec: start.wheel, words: WORDS, draw: drawWheel, changed,
    then: (texts, outdated) => brake(texts, outdated),
  });
  let stops = null;

  /** Stops, if they are asked for. */
  async function brake(texts, outdated) {
    const asked = texts.abs === "yes";
    get("stops").hidden = !asked;
    stops = null;
    if (!asked) return;
    get("stops").classList.add("outdated");
    get("stops-state").textContent = "Braking: this takes some seconds.";
    get("stops-error").hidden = true;
    try {
      const found = await ask("stops", { texts });
      if (outdated()) return;
      stops = found;
      drawStops();
      get("stops").classList.remove("outdated");
    } catch (error) {
      get("stops-error").textContent = error.message;
      get("stops-error").hidden = false;
    }
    get("stops-state").textContent = "";
  }

  function drawStops() {
    if (!stops) return;
    const found = Object.entries(stops.controls);
    const [first, last] = stops.ends.map((speed) => fixed(speed));
    const measured = stops.measured.map((speed) => fixed(speed)).join(" to ");
    get("stops-table").caption.textContent = `From ${first} to ${last} km/h; decelerations are means from ${measured} km/h`;
    get("stops-table").tBodies[0].replaceChildren(...found.map(([name, { distance, time, deceleration }]) => element("tr", {},
      element("th", { scope: "row" }, CONTROLS[name]), ...[distance, time, deceleration].map((value) => element("td", {}, fixed(value))))));
    draw("chart-stops", found.map(([name, { way, speed }], i) =>
      curve(CONTROLS[name], way, speed, [colours.c3, colours.c1, colours.c2][i], ["solid", "dash", "dot"][i])), {
      x: "distance (m)",
      said: `Speed over the distance of stops: ${found.map(([name, { distance }]) => `${CONTROLS[name]} ${fixed(distance)} m`).join(", ")}`,
    });
  }

  onColours(drawStops);
  return { ...tab, redraw: () => (tab.redraw(), drawStops()) };
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
  notes(get("wheel-notes"), sentences);
  numbers(get("wheel-numbers"), [
    ["peak μ", fixed(found.mu_peak)],
    ["at slip ratio", fixed(found.peak_slip)],
    ["locked μ", fixed(found.mu_locked)],
    ["locked over peak", fixed(found.mu_locked / found.mu_peak)],
  ]);
}
