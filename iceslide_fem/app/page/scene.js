// A scene: the keys that it sets, checked as they are typed, a search for others, and its info.

import { ask, latest, settled } from "./api.js";
import { element, fill, labelled, mark, notes, setTexts, textField, textsIn } from "./controls.js";
import { makeRuns } from "./runs.js";

const FIRST = {
  name: "my_block", model: "slice", "rubber.compound": "B", "load.pressure": "1 bar",
  "load.speed": "3 m/s", "load.duration": "7 ms", "numerics.tolerance": "1e-2",
};
const MOST = 10; // keys that a search shows

export function makeScene({ start, changed, save }) {
  const get = (id) => document.getElementById(id);
  const form = document.querySelector("#scene form");
  const state = get("scene-state");
  const known = new Map(start.fields.map((field, place) => [field.key, { ...field, place }]));
  const groups = new Map();
  let answer = null;
  let begun = false;

  const rowOf = (key) => get(`scene-${key}`)?.closest(".field");

  /** The field of a key, and if need be its table, at their places. */
  function add(key, text = "") {
    if (rowOf(key)) return;
    const [table, name] = key.includes(".") ? key.split(/\.(.*)/) : ["scene", key];
    const field = known.get(key) ?? { key, kind: "text", help: "", place: known.size }; // for the program to refuse
    if (!groups.has(table)) {
      groups.set(table, element("fieldset", { class: "group", "data-place": field.place }, element("legend", {}, table)));
      insert(form.querySelector(".fields"), groups.get(table));
    }
    insert(groups.get(table), control(field, name, text));
  }

  function insert(parent, made) {
    const later = [...parent.children].find((each) => Number(each.dataset.place) > Number(made.dataset.place));
    parent.insertBefore(made, later ?? null);
  }

  function control(field, name, text) {
    const id = `scene-${field.key}`;
    let input;
    if (field.kind === "choice" || field.kind === "switch") {
      input = element("select", { id, "data-key": field.key, "aria-describedby": `${id}-help` });
      const choices = field.kind === "switch" ? ["true", "false"] : field.choices;
      fill(input, [["", field.default ? `${field.default} (unless chosen)` : "–"], ...choices.map((choice) => [choice, choice])]);
    } else if (field.kind === "list" || text.startsWith("[") || text.startsWith("{")) {
      input = element("textarea", { id, "data-key": field.key, rows: 3, spellcheck: "false", "aria-describedby": `${id}-help` });
    } else {
      input = textField(id, field.key, { placeholder: field.default });
    }
    input.addEventListener("input", () => update());
    const title = labelled(id, name.replaceAll("_", " "), field.help);
    if (!field.required) {
      const remove = element("button", { type: "button", class: "help", "aria-label": `Remove ${field.key}`, title: "remove" }, "×");
      remove.addEventListener("click", () => (take(field.key), update()));
      title.append(remove);
    }
    const range = field.low ? ` ${field.low} to ${field.high}.` : "";
    const usual = field.default ? ` Else ${field.default}.` : "";
    return element("div", { class: "field", "data-place": field.place }, title, input,
      element("span", { class: "hint" }, first(field.help), range, usual));
  }

  /** The first sentence of a meaning. */
  const first = (help) => help.replaceAll("`", "").match(/^.*?[^.]{3}\.(?= [A-Z]|$)/)?.[0] ?? help.replaceAll("`", "");

  function take(key) {
    const group = rowOf(key).parentElement;
    rowOf(key).remove();
    if (group.querySelector(".field")) return;
    group.remove();
    groups.delete(group.firstChild.textContent);
  }

  /** Show the keys of `found` and those that every scene needs, with these texts. */
  function put(found) {
    form.querySelector(".fields").replaceChildren();
    groups.clear();
    const given = Object.entries(found).filter(([, text]) => text.trim());
    for (const [key, text] of given) add(key, text);
    for (const { key, required } of known.values()) if (required) add(key);
    setTexts(form, Object.fromEntries(given));
  }

  /** Keys with all words of the search in their names and meanings, those with them in the name first. */
  function search() {
    const words = get("scene-search").value.toLowerCase().split(/[\s_.]+/).filter(Boolean);
    const has = (text) => words.every((word) => text.toLowerCase().includes(word));
    const free = words.length ? [...known.values()].filter(({ key }) => !rowOf(key)) : [];
    const named = free.filter(({ key }) => has(key));
    const found = [...named, ...free.filter((field) => !named.includes(field) && has(`${field.key} ${field.help}`))];
    get("scene-keys").replaceChildren(...found.slice(0, MOST).map((field) => {
      const button = element("button", { type: "button" }, element("b", {}, field.key), ` ${first(field.help)}`);
      button.addEventListener("click", () => choose(field.key));
      return element("li", {}, button);
    }));
    const count = found.length > MOST ? `${MOST} of ${found.length} keys: more words find fewer.` : `${found.length || "no"} other keys`;
    get("scene-found").textContent = words.length ? count : `There are ${known.size} keys; "dry", "pressure" or "mesh" finds some.`;
  }

  function choose(key) {
    add(key);
    get("scene-search").value = "";
    search();
    get(`scene-${key}`).focus();
  }

  const texts = () => Object.fromEntries(Object.entries(textsIn(form)).filter(([, text]) => text.trim()));

  /** Mark the fields that an error is about, also those that were not shown. */
  function refused({ message, keys = [] }) {
    for (const key of keys) if (known.has(key)) add(key);
    mark(form, message, keys);
  }

  const runs = makeRuns({
    texts, ready: () => answer !== null,
    refused: (error) => error.keys?.length && refused(error),
  });

  const check = latest(async (outdated) => {
    const asked = texts();
    try {
      answer = await ask("scene", { texts: asked });
      mark(form);
      state.textContent = `${asked.name} can be run.`;
      notes(get("scene-notes"), answer.notes);
      get("run-folder").textContent = answer.folder;
    } catch (error) {
      answer = null;
      refused(error);
      state.textContent = "This is no scene yet.";
      notes(get("scene-notes"), []);
    }
    get("scene-save").disabled = answer === null;
    runs.buttons();
    document.documentElement.dataset.checked = JSON.stringify(asked);
    if (answer && !outdated()) describe();
    else if (!answer) get("info").hidden = true;
  });

  const describe = settled(latest(async (outdated) => {
    const table = get("info");
    try {
      const found = await ask("info", { texts: texts() });
      if (outdated()) return;
      table.hidden = false;
      table.caption.textContent = found.title;
      table.tBodies[0].replaceChildren(...found.rows.map((row) => element("tr", {},
        ...["group", "quantity", "value", "meaning"].map((cell) => element("td", {}, row[cell])))));
      notes(get("scene-notes"), found.notes);
    } catch (error) {
      table.hidden = true;
      if (answer) state.textContent = error.message;
    }
  }), 400);

  function update() {
    begun = true;
    check();
    changed();
  }

  get("scene-search").addEventListener("input", search);
  get("scene-search").addEventListener("keydown", (event) => {
    if (event.key === "Enter") get("scene-keys").querySelector("button")?.click();
  });
  get("scene-save").addEventListener("click", () => answer && save(`${texts().name}.toml`, answer.toml));
  get("scene-file").addEventListener("change", async ({ target }) => {
    const [file] = target.files;
    if (!file) return;
    try {
      put((await ask("read", { text: await file.text() })).texts);
      update();
    } catch (error) {
      refused(error);
    }
    target.value = "";
  });

  put(Object.keys(start.scene).length ? start.scene : FIRST);
  search();
  return {
    state: texts,
    restore(found) {
      if (Object.keys(found).length) put(found);
      update();
    },
    redraw() {
      if (!begun) update();
      runs.redraw();
    },
    toml: () => answer?.toml,
    python: () => answer?.python,
  };
}
