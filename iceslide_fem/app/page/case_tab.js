// A tab whose case is no scene: its fields from what the program says of them, asked as they change.

import { ask, latest } from "./api.js";
import { onColours } from "./charts.js";
import { element, fill, labelled, mark, setTexts, slider, textField, textsIn } from "./controls.js";

/** The tab `name`: `words` are those of its choices, `draw(answer)` shows what the program has answered.
 *  `then(texts, outdated)` shows what takes longer; outdated(): other texts wait. */
export function makeCaseTab({ name, spec, words, draw, then = () => {}, changed }) {
  const form = document.querySelector(`#${name} form`);
  const fields = form.querySelector(".fields");
  const sliders = {};
  let now = null;
  let begun = false; // an address computes before its tab is shown

  function add(control, label) {
    fields.append(element("div", { class: "field" }, labelled(control.id, label, spec.help[control.dataset.key]), control));
  }

  for (const [key, label, choices] of spec.choices) {
    const id = `${name}-${key}`;
    const select = element("select", { id, "data-key": key, "aria-describedby": `${id}-help` });
    fill(select, choices.map((choice) => [choice, words[choice] ?? choice]));
    select.addEventListener("change", () => update());
    add(select, label);
  }
  for (const [key, label] of spec.texts) {
    const input = textField(`${name}-${key}`, key);
    input.addEventListener("input", () => update());
    add(input, label);
  }
  for (const each of spec.sliders) sliders[each.key] = slider(fields, name, each, spec.help[each.key], () => update());
  for (const key of spec.empty) sliders[key].text.value = "";
  const defaults = textsIn(form);

  /** Fields that have no meaning with what is chosen. */
  function unused() {
    const chosen = (key) => document.getElementById(`${name}-${key}`).value;
    return Object.entries(spec.only).filter(([, [key, values]]) => !values.includes(chosen(key))).map(([key]) => key);
  }

  function texts() {
    const found = textsIn(form);
    for (const key of unused()) delete found[key];
    return found;
  }

  const compute = latest(async (asked, begun, outdated) => {
    try {
      const answer = await ask(name, { texts: asked });
      mark(form);
      now = answer;
      for (const [key, control] of Object.entries(sliders)) {
        if (answer.values[key] !== null && asked[key] !== undefined) control.follow(answer.values[key]);
      }
      draw(now);
      document.getElementById(`${name}-time`).textContent = `Drawn in ${Math.round(performance.now() - begun)} ms.`;
      const counts = document.documentElement.dataset;
      counts[`${name}s`] = String(Number(counts[`${name}s`] ?? 0) + 1);
      if (!outdated()) await then(asked, outdated);
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
    begun = true;
    arrange();
    compute(texts(), performance.now());
    changed();
  }

  function state() {
    return Object.fromEntries(Object.entries(texts()).filter(([key, text]) => text !== defaults[key]));
  }

  function restore(found) {
    setTexts(form, { ...defaults, ...found });
    update();
  }

  function redraw() {
    if (now) draw(now);
  }

  document.getElementById(`${name}-reset`).addEventListener("click", () => restore({}));
  onColours(redraw);
  return {
    state, restore,
    redraw() {
      if (begun) redraw();
      else update();
    },
    toml: () => now?.command,
    python: () => now?.python,
  };
}
