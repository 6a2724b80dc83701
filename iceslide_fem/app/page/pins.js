// Pinned curves: each with a name, by default what differs from the present values.

import { ask } from "./api.js";
import { colours, curve } from "./charts.js";
import { element } from "./controls.js";

const MOST = 4; // there are as many colours

/** Pins listed in the elements `list` and added by `button`. `named(texts)` is the default name of a pin;
 *  `changed()` is called when they have changed. */
export function makePins({ list, button, named, changed }) {
  let pins = []; // name, texts, answer, row, field
  let restored = 0;

  const name = (pin) => pin.name || named(pin.texts);

  function add(pin) {
    pin.field = element("input", { type: "text", value: pin.name, "aria-label": "Name of a pinned curve" });
    const remove = element("button", { type: "button" }, "Remove");
    pin.row = element("li", {}, element("span", { class: "swatch" }), pin.field, remove);
    pin.field.addEventListener("input", () => {
      pin.name = pin.field.value.trim();
      changed();
    });
    remove.addEventListener("click", () => {
      put(pins.filter((each) => each !== pin));
      changed();
      button.focus();
    });
    put([...pins, pin]);
  }

  function put(found) {
    pins = found;
    list.replaceChildren(...pins.map(({ row }) => row));
    button.disabled = pins.length >= MOST;
  }

  return {
    /** Pin the `answer` of the present texts. */
    pin(texts, answer) {
      add({ name: "", texts, answer });
      changed();
    },
    /** A series of every pin over time. */
    curves: (series) => pins.map((pin, i) =>
      curve(name(pin), pin.answer.series.time, pin.answer.series[series], colours[`p${i + 1}`], i % 2 ? "dashdot" : "dash")),
    /** Names and numbers of every pin. */
    numbers: () => pins.map((pin) => [name(pin), pin.answer.numbers]),
    /** Show names and colours as they are now. */
    refresh() {
      for (const [i, { row, field, texts }] of pins.entries()) {
        field.placeholder = named(texts);
        row.firstChild.style.background = colours[`p${i + 1}`];
      }
    },
    /** Pins as parts of an address: pin, pin2, ... */
    state: () => Object.fromEntries(pins.map((pin, i) =>
      [`pin${i ? i + 1 : ""}`, new URLSearchParams({ ...(pin.name && { name: pin.name }), ...pin.texts }).toString()])),
    /** The pins of an address, in place of the present ones. */
    async restore(state) {
      const mine = ++restored;
      put([]);
      const keys = Object.keys(state).filter((key) => /^pin\d*$/.test(key)).slice(0, MOST);
      const asked = keys.map((key) => Object.fromEntries(new URLSearchParams(state[key])));
      const answers = await Promise.allSettled(asked.map(({ name: _, ...texts }) => ask("point", { texts })));
      if (mine !== restored) return;
      for (const [i, { value }] of answers.entries()) {
        const { name: given = "", ...texts } = asked[i];
        if (value) add({ name: given, texts, answer: value });
      }
      if (pins.length) changed();
    },
  };
}
