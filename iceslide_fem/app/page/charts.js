// Curves and maps, in the colours of the page. uPlot draws them: some milliseconds for all.

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Colours by their names in the style sheet; read again when the scheme changes. */
export let colours = read();

function read() {
  const names = ["ground", "ink", "quiet", "grid", "melting", "saturated", "c1", "c2", "c3", "c4", "p1", "p2", "p3", "p4"];
  return Object.fromEntries(names.map((name) => [name, css(`--${name}`)]));
}

const redraws = new Set();

/** Call `redraw` when the colours have changed. */
export function onColours(redraw) {
  redraws.add(redraw);
}

matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  colours = read();
  for (const redraw of redraws) redraw();
});

const DASHES = { solid: [], dot: [2, 4], dash: [8, 5], dashdot: [9, 4, 2, 4] };

/** A curve for `draw`. */
export function curve(name, x, y, colour, dash = "solid") {
  return { name, x, y, colour, dash };
}

/** Points for `draw`, without a line through them. */
export function dots(name, x, y, colour) {
  return { name, x, y, colour, dash: "dots" };
}

/** A shaded band from x0 to x1 over the whole height. */
export function band(x0, x1, colour) {
  return { x0, x1, colour };
}

/** A number as an axis or a legend shows it. */
export function short(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e5 || size < 1e-3)) return value.toExponential(1).replace(".0e", "e").replace("e+", "e");
  return String(Number(value.toPrecision(3)));
}

const charts = new Map(); // id -> { plot, kind, bands, paint }

const resized = new ResizeObserver((entries) => {
  for (const { target, contentRect } of entries) {
    const chart = charts.get(target.id);
    if (chart && contentRect.width > 0 && contentRect.width !== chart.plot.width) {
      chart.plot.setSize({ width: contentRect.width, height: height(target) });
    }
  }
});

const height = (div) => parseFloat(getComputedStyle(div).getPropertyValue("--plot-height"));

function axis(label, side) {
  return {
    label, stroke: colours.ink, grid: { stroke: colours.grid, width: 1 }, ticks: { stroke: colours.quiet, width: 1 },
    labelSize: side ? 0 : 18, size: side ? 56 : 34, font: "12px system-ui", labelFont: "12px system-ui",
    values: (_, values) => values.map((value) => (value === null ? "" : short(value))),
  };
}

/** The chart in the element of that id: kept if it is of the same `kind`, else made anew. */
function chart(id, kind, data, options) {
  const div = document.getElementById(id);
  let found = charts.get(id);
  if (found?.kind === kind) return [found, true];
  found?.plot.destroy();
  found = { kind, bands: [], paint: null };
  const hooks = {
    drawClear: [(plot) => {
      const { ctx, bbox } = plot;
      for (const { x0, x1, colour } of found.bands) {
        const [left, right] = [x0, x1].map((x) => Math.min(Math.max(plot.valToPos(x, "x", true), bbox.left), bbox.left + bbox.width));
        ctx.fillStyle = colour;
        ctx.fillRect(left, bbox.top, right - left, bbox.height);
      }
      found.paint?.(plot);
    }],
    ...options.hooks,
  };
  found.plot = new uPlot({ width: div.clientWidth, height: height(div), ...options, hooks }, data, div);
  charts.set(id, found);
  resized.observe(div);
  return [found, false];
}

/** The index next to `at` at which a curve has a value: curves have times of their own. */
function nearest(plot, series, at) {
  const values = plot.data[series];
  if (series === 0 || values[at] !== null && values[at] !== undefined) return at;
  for (let step = 1; step < values.length; step += 1) {
    if (values[at - step] !== null && values[at - step] !== undefined) return at - step;
    if (values[at + step] !== null && values[at + step] !== undefined) return at + step;
  }
  return at;
}

/** Draw curves into the element of that id; `said` is what a screen reader says of them. */
export function draw(id, curves, { x = "", shapes = [], log = false, said = "" }) {
  const div = document.getElementById(id);
  if (div.offsetParent === null) return; // in a tab that is not shown
  const positive = (y) => (log ? y.map((value) => (value > 0 ? value : null)) : y);
  const data = uPlot.join(curves.map((each) => [each.x, positive(each.y)]));
  const kind = JSON.stringify([curves.map((each) => [each.name, each.colour, each.dash]), x, log, colours.ground]);
  const [found, kept] = chart(id, kind, data, {
    scales: { x: { time: false }, y: log ? { distr: 3 } : {} },
    series: [
      { label: x, value: (_, value) => short(value) },
      ...curves.map((each) => ({
        label: each.name, stroke: each.colour, width: each.dash === "solid" ? 2 : 1.6, value: (_, value) => short(value),
        ...(each.dash === "dots"
          ? { paths: () => null, points: { show: true, size: 11, fill: each.colour } }
          : { dash: DASHES[each.dash], spanGaps: true, points: { show: false } }),
      })),
    ],
    axes: [axis(x, false), axis("", true)],
    cursor: { dataIdx: nearest, points: { size: 6 } },
  });
  found.bands = shapes;
  if (kept) found.plot.setData(data);
  else found.plot.redraw(false);
  div.setAttribute("role", "img");
  div.setAttribute("aria-label", said);
}

const CIVIDIS = ["#00224e", "#123570", "#3b496c", "#575d6d", "#707173", "#8a8678", "#a59c74", "#c3b369", "#e1cc55", "#fee838"];

function shade(share) {
  const at = Math.min(Math.max(share, 0), 1) * (CIVIDIS.length - 1);
  const low = Math.min(Math.floor(at), CIVIDIS.length - 2);
  const part = (colour, i) => parseInt(colour.slice(1 + 2 * i, 3 + 2 * i), 16);
  const mix = [0, 1, 2].map((i) => Math.round(part(CIVIDIS[low], i) * (1 - at + low) + part(CIVIDIS[low + 1], i) * (at - low)));
  return `rgb(${mix.join(" ")})`;
}

/** The scale of a map's colours, as a picture of the style sheet. */
export const SCALE = `linear-gradient(to right, ${CIVIDIS.join(", ")})`;

/** Edges between `values`, half-way on their scale. */
function edges(values, log) {
  const there = log ? values.map(Math.log) : values;
  const half = (there[1] - there[0]) / 2;
  const found = [there[0] - half, ...there.map((value) => value + half)];
  return log ? found.map(Math.exp) : found;
}

/** A map of z > 0 (rows of y, colours on a logarithmic scale) over x and y, each { values, log, label }, with a cross at `at`.
 *  `over` is called with the indices below the pointer, `click` with those that are clicked. */
export function drawMap(id, x, y, z, at, { said, over, click }) {
  const div = document.getElementById(id);
  if (div.offsetParent === null) return null;
  const sides = { x: { ...x, edges: edges(x.values, x.log) }, y: { ...y, edges: edges(y.values, y.log) } };
  const all = z.flat();
  const [low, high] = [Math.min(...all), Math.max(...all)];
  const share = (value) => (high > low ? Math.log(value / low) / Math.log(high / low) : 0.5);
  const fixed = (side) => ({ time: false, distr: side.log ? 3 : 1, range: [side.edges[0], side.edges.at(-1)] });
  const data = [[x.values[0], x.values.at(-1)], [y.values[0], y.values.at(-1)]];
  const index = (side, value) => side.edges.findIndex((edge, i) => i > 0 && value <= edge) - 1;
  const kind = JSON.stringify([x.label, y.label, x.values.length, colours.ground]);
  const [found, kept] = chart(id, kind, data, {
    scales: { x: fixed(sides.x), y: fixed(sides.y) },
    series: [{}, { paths: () => null, points: { show: false } }],
    axes: [
      { ...axis(x.label, false), grid: { show: false } },
      { ...axis(y.label, true), labelSize: 18, grid: { show: false } },
    ],
    legend: { show: false },
    cursor: { drag: { x: false, y: false }, points: { show: false } },
    hooks: { setCursor: [(plot) => {
      const { left, top } = plot.cursor;
      if (left >= 0) found?.over?.(...under(plot, left, top));
    }] },
  });
  function under(plot, left, top) {
    return [index(found.sides.x, plot.posToVal(left, "x")), index(found.sides.y, plot.posToVal(top, "y"))];
  }
  Object.assign(found, { sides, over, click, at });
  found.paint = (plot) => {
    const place = (side, name) => side.edges.map((edge) => Math.round(plot.valToPos(edge, name, true)));
    const [xs, ys] = [place(sides.x, "x"), place(sides.y, "y")];
    z.forEach((row, j) => row.forEach((value, i) => {
      plot.ctx.fillStyle = shade(share(value));
      plot.ctx.fillRect(xs[i], ys[j + 1], xs[i + 1] - xs[i], ys[j] - ys[j + 1]);
    }));
    const [cx, cy] = [plot.valToPos(found.at[0], "x", true), plot.valToPos(found.at[1], "y", true)];
    const size = 9 * devicePixelRatio;
    for (const [width, colour] of [[5, "#000"], [2, "#fff"]]) {
      plot.ctx.strokeStyle = colour;
      plot.ctx.lineWidth = width * devicePixelRatio;
      plot.ctx.beginPath();
      plot.ctx.moveTo(cx - size, cy);
      plot.ctx.lineTo(cx + size, cy);
      plot.ctx.moveTo(cx, cy - size);
      plot.ctx.lineTo(cx, cy + size);
      plot.ctx.stroke();
    }
  };
  if (!kept) {
    found.plot.over.addEventListener("click", () => {
      const { left, top } = found.plot.cursor;
      found.click(...under(found.plot, left, top));
    });
  }
  found.plot.redraw(true);
  div.setAttribute("role", "img");
  div.setAttribute("aria-label", said);
  return { low, high };
}

/** Take away the chart in the element of that id. */
export function erase(id) {
  charts.get(id)?.plot.destroy();
  charts.delete(id);
}

/** Put the cross of a map elsewhere. */
export function moveCross(id, at) {
  const found = charts.get(id);
  if (!found || document.getElementById(id).offsetParent === null) return;
  found.at = at;
  found.plot.redraw(false);
}
