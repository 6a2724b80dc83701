// Runs of this program: those that are under way are followed, so that a page that is loaded again goes on.

import { ask } from "./api.js";
import { colours, curve, draw, erase, onColours } from "./charts.js";
import { element } from "./controls.js";

const STATES = {
  running: "under way", stopping: "stopping: the step that is under way is finished and kept",
  done: "done", cancelled: "cancelled", failed: "could not go on",
};
const get = (id) => document.getElementById(id);

/** Runs of the scene of `texts()`; `ready()`: it can be run; `refused(error)` marks its fields. */
export function makeRuns({ texts, ready, refused }) {
  const runs = new Map(); // number -> run: time, mu, the last news, its row in the list
  let shown = null;

  const going = (run) => ["running", "stopping"].includes(run?.news.state);

  function buttons() {
    get("run").disabled = going(shown) || !ready();
    get("cancel").disabled = !going(shown);
  }

  /** Take away what is shown of a run. */
  function clear() {
    shown = null;
    say("");
    for (const id of ["progress-of-run", "report"]) get(id).hidden = true;
    offer(false);
    for (const run of runs.values()) list(run);
    get("progress").value = 0;
    get("report-frame")?.remove();
    erase("chart-run");
  }

  /** Offer to go on with the run that is shown. */
  function offer(on) {
    get("resume").hidden = !on;
    get("run").textContent = on ? "Run from the start" : "Run";
  }

  function say(sentence, isError = false) {
    get("run-said").textContent = sentence;
    get("run-said").hidden = !sentence;
    get("run-said").classList.toggle("error", isError);
  }

  async function begin(resume) {
    clear();
    try {
      const { number } = await ask("run", { texts: texts(), force: get("force").checked, resume });
      follow({ number, name: texts().name, state: "running", phase: "starting" });
      show(number);
    } catch (error) {
      say(error.message, true);
      refused(error);
    }
    buttons();
  }

  const cancel = (number) => ask("cancel", { number }).catch((error) => say(error.message, true));

  function follow({ number, ...news }) {
    const run = { number, time: [], mu: [], news, words: element("span") };
    const look = element("button", { type: "button" }, "Show");
    run.stop = element("button", { type: "button" }, "Cancel");
    look.addEventListener("click", () => show(number));
    run.stop.addEventListener("click", () => cancel(number));
    run.row = element("li", {}, run.words, look, run.stop);
    get("runs").append(run.row);
    runs.set(number, run);
    list(run);
    const source = new EventSource(`api/runs/${number}/news`);
    source.addEventListener("open", () => (run.time = run.mu = [])); // all rows come again
    source.addEventListener("message", ({ data }) => {
      run.news = JSON.parse(data);
      const rows = run.news.rows ?? [];
      run.time = [...run.time, ...rows.map((row) => row[0])];
      run.mu = [...run.mu, ...rows.map((row) => row[1])];
      list(run);
      if (run === shown) tell();
      if (!going(run)) source.close();
    });
  }

  function words({ number, mu, news }) {
    const phase = news.state === "running" ? ` (${news.phase})` : "";
    const friction = mu.length ? `, μ ${Number(mu.at(-1).toPrecision(3))}` : "";
    return `${number}. ${news.name}: ${STATES[news.state] ?? news.state}${phase}, ${Math.round(100 * (news.share ?? 0))} %${friction}`;
  }

  function list(run) {
    run.words.textContent = words(run);
    run.stop.hidden = !going(run);
    run.row.hidden = run === shown; // it is shown below
  }

  function show(number) {
    clear();
    shown = runs.get(number);
    list(shown);
    tell();
  }

  /** Show the news of the run that is shown. */
  function tell() {
    const { number, news } = shown;
    get("progress-of-run").hidden = false;
    get("progress").value = news.share ?? 0;
    get("run-state").textContent = words(shown);
    get("run-state").dataset.state = news.state;
    say(news.sentence ?? "", news.state === "failed");
    offer(news.goes_on);
    redraw();
    buttons();
    if (!news.report || !get("report").hidden) return;
    const address = `runs/${number}/report`;
    get("report-link").href = address;
    get("report").append(element("iframe", {
      id: "report-frame", title: "Report of the run", sandbox: "allow-scripts allow-downloads", src: address,
    }));
    get("report").hidden = false;
  }

  function redraw() {
    if (!shown || shown.time.length < 2) return;
    draw("chart-run", [curve("mu", shown.time, shown.mu, colours.c1)], {
      x: "t (ms)", said: `Friction of the run so far: ${shown.mu.length} steps`,
    });
  }

  get("run").addEventListener("click", () => begin(false));
  get("resume").addEventListener("click", () => begin(true));
  get("cancel").addEventListener("click", () => shown && cancel(shown.number));
  addEventListener("beforeunload", (event) => {
    if ([...runs.values()].some(going)) event.preventDefault();
  });
  onColours(redraw);
  ask("runs").then(({ runs: found }) => {
    for (const run of found) follow(run);
    const under = found.findLast(({ state }) => state === "running");
    if (under && !shown) show(under.number);
  }, () => {});
  return { buttons, redraw };
}
