// Fields: a text each, some with a slider; the field is marked where the program refuses it.

export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== undefined) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
}

export function fill(select, choices) {
  select.replaceChildren(...choices.map(([value, text]) => element("option", { value }, text)));
}

/** The name of the field `id`, with a button that shows its `help`; the field is described by it, too. */
export function labelled(id, text, help = "") {
  const name = element("span", { class: "name" }, element("label", { for: id }, text));
  if (!help) return name;
  const meaning = help.replaceAll("`", "");
  const button = element("button", { type: "button", class: "help", title: meaning, "aria-label": `What ${text} means` }, "?");
  const tip = document.getElementById("tip");
  button.popoverTargetElement = tip;
  button.addEventListener("click", () => {
    tip.textContent = meaning;
    tip.ontoggle = ({ newState }) => newState === "open" && place(tip, button.getBoundingClientRect());
  });
  name.append(button, element("span", { id: `${id}-help`, hidden: true }, meaning));
  return name;
}

/** Put a tip below a box, or above it where the window ends. */
function place(tip, box) {
  const below = box.bottom + tip.offsetHeight + 8 < innerHeight;
  tip.style.left = `${Math.max(8, Math.min(box.left, innerWidth - tip.offsetWidth - 8))}px`;
  tip.style.top = `${below ? box.bottom + 4 : Math.max(8, box.top - tip.offsetHeight - 4)}px`;
}

const STEPS = 1000;

function position(spec, value) {
  const share = spec.log
    ? Math.log(value / spec.low) / Math.log(spec.high / spec.low)
    : (value - spec.low) / (spec.high - spec.low);
  return Math.round(STEPS * Math.min(Math.max(share, 0), 1));
}

function valueAt(spec, at) {
  if (spec.zero && at === 0) return 0;
  const share = at / STEPS;
  const value = spec.log
    ? spec.low * (spec.high / spec.low) ** share
    : spec.low + share * (spec.high - spec.low);
  return Number(value.toPrecision(3));
}

/** The text of `value` (in the slider's unit). */
export function textOf(spec, value) {
  return `${Number(value.toPrecision(4))} ${spec.unit}`.trim();
}

/** A result to so many digits; a dash of none. */
export const fixed = (value, digits = 3) => (value === null || value === undefined ? "–" : Number(value.toPrecision(digits)).toString());

/** A field with a slider in `parent`; `changed()` is called when either is moved. */
export function slider(parent, prefix, spec, help, changed) {
  const id = `${prefix}-${spec.key}`;
  const text = textField(id, spec.key);
  const range = element("input", {
    type: "range", min: 0, max: STEPS, step: 1, id: `${id}-slider`, "aria-label": `${spec.label}, slider`,
  });
  parent.append(element("div", { class: "field slider" }, labelled(id, spec.label, help), text, range));
  const tell = () => range.setAttribute("aria-valuetext", text.value || "not given");
  text.value = spec.text;
  range.value = position(spec, spec.start);
  tell();
  range.addEventListener("input", () => {
    text.value = textOf(spec, valueAt(spec, Number(range.value)));
    tell();
    changed(spec.key);
  });
  text.addEventListener("input", () => changed(spec.key));
  return {
    spec,
    text,
    range,
    /** Put the slider where an SI value stands; the text stays as it was typed. */
    follow(si) {
      range.value = position(spec, (si - spec.shift) / spec.scale);
      tell();
    },
    /** Show an SI value that comes from elsewhere. */
    show(si) {
      text.value = textOf(spec, (si - spec.shift) / spec.scale);
      this.follow(si);
    },
    enable(on) {
      text.readOnly = !on;
      range.disabled = !on;
    },
  };
}

/** A field of one line for the text of a `key`. */
export function textField(id, key, more = {}) {
  return element("input", {
    type: "text", id, "data-key": key, autocomplete: "off", spellcheck: "false", "aria-describedby": `${id}-help`, ...more,
  });
}

/** Texts of all fields in `form`, by key. */
export function textsIn(form) {
  const texts = {};
  for (const field of form.querySelectorAll("[data-key]")) texts[field.dataset.key] = field.value;
  return texts;
}

/** Put `texts` into the fields of `form`. */
export function setTexts(form, texts) {
  for (const field of form.querySelectorAll("[data-key]")) {
    const text = texts[field.dataset.key];
    if (text !== undefined) {
      if (field.tagName === "SELECT" && ![...field.options].some((option) => option.value === text)) {
        field.add(new Option(text, text)); // for the program to refuse
      }
      field.value = text;
    }
  }
}

/** Mark the fields of `keys`, say the sentence and dim the curves, which are of other values; without one, take all of it away. */
export function mark(form, sentence = "", keys = []) {
  for (const old of form.querySelectorAll(".fault")) old.remove();
  form.closest("section").classList.toggle("outdated", sentence !== "");
  const general = form.querySelector(".error");
  general.hidden = !sentence;
  general.textContent = sentence;
  for (const field of form.querySelectorAll("[data-key]")) {
    const wrong = sentence !== "" && keys.includes(field.dataset.key);
    if (!wrong) {
      field.removeAttribute("aria-invalid");
      field.removeAttribute("aria-errormessage");
      continue;
    }
    const fault = element("p", { class: "fault", id: `${field.id}-fault` }, sentence);
    field.setAttribute("aria-invalid", "true");
    field.setAttribute("aria-errormessage", fault.id);
    field.parentElement.append(fault);
    general.hidden = true;
  }
}

/** Names and values in a list of results. */
export function numbers(list, entries) {
  list.replaceChildren(
    ...entries.map(([name, value]) => element("div", {}, element("dt", {}, name), element("dd", {}, value))),
  );
}

export function notes(list, sentences) {
  list.replaceChildren(...sentences.map((sentence) => element("li", {}, `${sentence}.`)));
}
