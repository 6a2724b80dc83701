// Tabs, the state in the address, and what leads elsewhere: links, scene files, lines of Python.

import { ask } from "./api.js";
import { makeLine } from "./line.js";
import { makePoint } from "./point.js";
import { makeScene } from "./scene.js";
import { makeWheel } from "./wheel.js";

const NAMES = ["point", "line", "wheel", "scene"];
const NO_SCENES = ["line", "wheel"]; // of which a command gives what a file does of the others
const tabs = {};
let shown = "point";
let timer;

function say(text) {
  const said = document.getElementById("said");
  said.textContent = text;
  setTimeout(() => (said.textContent = ""), 3000);
}

/** Go to a tab, as a new entry of the browser's history: Back comes back to the present one. */
function go(name) {
  if (name === shown) return;
  write();
  history.pushState(null, "", location.href);
  show(name);
}

function show(name) {
  shown = name;
  for (const each of NAMES) {
    const tab = document.getElementById(`tab-${each}`);
    tab.setAttribute("aria-selected", String(each === name));
    tab.tabIndex = each === name ? 0 : -1;
    document.getElementById(each).hidden = each !== name;
  }
  document.getElementById("show-toml").textContent = NO_SCENES.includes(name) ? "Command" : "TOML";
  document.title = `iceslide: ${document.getElementById(`tab-${name}`).textContent}`;
  tabs[name].redraw();
  write();
}

const hashOf = (name) => `#${new URLSearchParams({ tab: name, ...tabs[name].state() })}`;

/** The state of the tab that is shown, into the address. */
function write() {
  clearTimeout(timer);
  history.replaceState(null, "", hashOf(shown));
}

/** Take the state from the address; a tab that has it is left as it is. */
function read(hash, first = false) {
  const state = Object.fromEntries(new URLSearchParams(hash.replace(/^#/, "")));
  const name = NAMES.includes(state.tab) ? state.tab : "point";
  delete state.tab;
  if (first || hash !== hashOf(name)) tabs[name].restore(state);
  show(name);
}

function changed() {
  clearTimeout(timer);
  timer = setTimeout(write, 150);
}

const dialog = document.getElementById("snippet");
let file = "";

/** Show lines that may be copied or saved. */
function snippet(title, name, text) {
  document.getElementById("snippet-title").textContent = title;
  dialog.querySelector("pre").textContent = text;
  file = name;
  dialog.showModal();
}

function save(name, text) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "text/plain" }));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    say("Copied.");
  } catch {
    snippet("To copy", "link.txt", text); // the browser does not let the page do it
  }
}

document.getElementById("snippet-close").addEventListener("click", () => dialog.close());
document.getElementById("snippet-copy").addEventListener("click", async () => {
  await copy(dialog.querySelector("pre").textContent);
});
document.getElementById("snippet-save").addEventListener("click", () => save(file, dialog.querySelector("pre").textContent));
document.getElementById("copy-link").addEventListener("click", () => {
  write();
  copy(location.href);
});
document.getElementById("show-toml").addEventListener("click", async () => {
  const text = await tabs[shown].toml();
  if (text) snippet(...(NO_SCENES.includes(shown) ? ["Command line", `${shown}.sh`] : ["Scene file", "scene.toml"]), text);
});
document.getElementById("show-python").addEventListener("click", async () => {
  const text = await tabs[shown].python();
  if (text) snippet("Lines of Python", `${shown}.py`, text);
});
document.querySelector("[role=tablist]").addEventListener("keydown", (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  const name = NAMES[(NAMES.indexOf(shown) + step + NAMES.length) % NAMES.length];
  go(name);
  document.getElementById(`tab-${name}`).focus();
});
for (const form of document.forms) form.addEventListener("submit", (event) => event.preventDefault());

const start = await ask("start");
const page = { start, changed, snippet, save, say };
tabs.point = makePoint(page);
tabs.line = makeLine(page);
tabs.wheel = makeWheel(page);
tabs.scene = makeScene(page);
for (const name of NAMES) document.getElementById(`tab-${name}`).addEventListener("click", () => go(name));
addEventListener("popstate", () => {
  clearTimeout(timer);
  read(location.hash);
});
const scene = Object.keys(start.scene).length > 0;
read(location.hash || (start.link ? `#${start.link}` : scene ? "#tab=scene" : "#tab=point"), true);
document.documentElement.dataset.ready = "true";
