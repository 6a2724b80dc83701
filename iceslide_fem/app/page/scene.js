// A scene: its fields checked as they are typed, its info, its runs.

import { ask, latest, settled } from "./api.js";
import { colours, curve, draw, onColours } from "./charts.js";
import { element, fill, mark, notes, setTexts, textsIn } from "./controls.js";

const FIRST = {
  name: "my_block", model: "slice", "rubber.compound": "B", "load.pressure": "1 bar",
  "load.speed": "3 m/s", "load.duration": "7 ms", "numerics.tolerance": "1e-2",
};
const STATES = {
  running: "under way", stopping: "stopping: the step that is under way is finished and kept",
  done: "done", cancelled: "cancelled", failed: "could not go on",
};

export function makeScene({ start, changed, save }) {
  const form = document.querySelector("#scene form");
  const state = document.getElementById("scene-state");
  const get = (id) => document.getElementById(id);
  let answer = null;
  let run = null; // number, EventSource, times and frictions

  const tables = new Map();
  for (const field of start.fields) {
    const [table, name] = field.key.includes(".") ? field.key.split(".") : ["scene", field.key];
    if (!tables.has(table)) {
      const group = element("details", { class: "group", "data-table": table }, element("summary", {}, table));
      tables.set(table, group);
      form.querySelector(".fields").append(group);
    }
    tables.get(table).append(control(field, name));
  }

  function control(field, name) {
    const id = `scene-${field.key}`;
    const described = `${id}-hint`;
    const range = field.low ? `${field.low} to ${field.high}` : "";
    const usual = field.required ? "needed" : field.default ? `else ${field.default}` : "";
    const hint = [range, usual].filter(Boolean).join("; ");
    const common = { id, "data-key": field.key, "aria-describedby": described };
    let input;
    if (field.kind === "text") {
      input = element("input", { type: "text", ...common, placeholder: field.default, autocomplete: "off", spellcheck: "false" });
    } else {
      const choices = field.kind === "switch" ? ["true", "false"] : field.choices;
      input = element("select", common);
      fill(input, [["", field.default ? `${field.default} (unless chosen)` : "–"], ...choices.map((choice) => [choice, choice])]);
    }
    input.addEventListener("input", () => update());
    return element("div", { class: "field" },
      element("label", { for: id, title: field.help }, name.replaceAll("_", " ")), input,
      element("span", { class: "hint", id: described, title: field.help }, hint));
  }

  /** Open the tables of which something is given. */
  function open() {
    for (const group of form.querySelectorAll("details")) {
      const given = [...group.querySelectorAll("[data-key]")].some((field) => field.value.trim());
      group.open = given || group.dataset.table === "scene";
    }
  }

  const texts = () => Object.fromEntries(Object.entries(textsIn(form)).filter(([, text]) => text.trim()));

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
      mark(form, error.message, error.keys ?? []);
      state.textContent = "This is no scene yet.";
      notes(get("scene-notes"), []);
    }
    buttons();
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
    check();
    changed();
  }

  function buttons() {
    const running = run !== null && !run.ended;
    get("run").disabled = running || answer === null;
    get("cancel").disabled = !running;
    for (const id of ["scene-save"]) get(id).disabled = answer === null;
  }

  async function begin(resume) {
    get("run-error").hidden = true;
    get("progress-of-run").hidden = false;
    get("report").hidden = true;
    get("resume").hidden = true;
    try {
      const asked = texts();
      const { number } = await ask("run", { texts: asked, force: get("force").checked, resume });
      run = { number, time: [], mu: [], ended: false, texts: asked };
      follow();
    } catch (error) {
      failed(error.message);
      mark(form, error.message, error.keys ?? []);
    }
    buttons();
  }

  function failed(sentence) {
    get("run-error").textContent = sentence;
    get("run-error").hidden = !sentence;
  }

  function follow() {
    const mine = run;
    const source = new EventSource(`api/runs/${mine.number}/news`);
    source.addEventListener("open", () => (mine.time = mine.mu = [])); // all rows come again
    source.addEventListener("message", ({ data }) => {
      const news = JSON.parse(data);
      const rows = news.rows ?? [];
      mine.time = [...mine.time, ...rows.map((row) => row[0])];
      mine.mu = [...mine.mu, ...rows.map((row) => row[1])];
      show(mine, news);
      if (!["running", "stopping"].includes(news.state)) {
        source.close();
        mine.ended = true;
        buttons();
      }
    });
  }

  function show(mine, news) {
    const percent = Math.round(100 * (news.share ?? 0));
    get("progress").value = news.share ?? 0;
    const mu = mine.mu.length ? `, μ ${Number(mine.mu.at(-1).toPrecision(3))}` : "";
    const phase = news.state === "running" ? ` (${news.phase})` : "";
    get("run-state").textContent = `${news.name}: ${STATES[news.state] ?? news.state}${phase}, ${percent} %${mu}`;
    get("run-state").dataset.state = news.state;
    failed(news.sentence);
    get("resume").hidden = !news.goes_on;
    redraw();
    if (news.report && get("report").hidden) {
      const address = `runs/${mine.number}/report`;
      get("report-link").href = address;
      get("report-frame").src = address;
      get("report").hidden = false;
    }
  }

  function redraw() {
    if (!run || run.time.length < 2) return;
    draw("chart-run", [curve("mu", run.time, run.mu, colours.c1)], {
      x: "t (ms)", said: `Friction of the run so far: ${run.mu.length} steps`,
    });
  }

  get("run").addEventListener("click", () => begin(false));
  get("resume").addEventListener("click", () => begin(true));
  get("cancel").addEventListener("click", () => run && ask("cancel", { number: run.number }));
  get("scene-save").addEventListener("click", () => answer && save(`${texts().name}.toml`, answer.toml));
  get("scene-file").addEventListener("change", async ({ target }) => {
    const [file] = target.files;
    if (!file) return;
    try {
      const found = await ask("read", { text: await file.text() });
      setTexts(form, found.texts, true);
      open();
      update();
    } catch (error) {
      mark(form, error.message, error.keys ?? []);
    }
    target.value = "";
  });
  onColours(redraw);

  setTexts(form, Object.keys(start.scene).length ? start.scene : FIRST, true);
  let begun = false;
  return {
    state: texts,
    restore(found) {
      begun = true;
      if (Object.keys(found).length) setTexts(form, found, true);
      open();
      update();
    },
    redraw() {
      if (!begun) open();
      if (!begun) update();
      begun = true;
      redraw();
    },
    toml: () => answer?.toml,
    python: () => answer?.python,
  };
}
