"use strict";
// Draws the charts and fields of the page; their numbers lie in it, compressed.
(() => {
    const LOOKS = {
        light: ["#0072B2", "#B34700", "#00795A", "#7A4A9E", "#444444", "#8A6100"],
        dark: ["#56B4E9", "#F0914D", "#3CCFA0", "#D3A6F0", "#D0D0D0", "#F0E442"],
    };
    const STROKES = ["solid", "dash", "dot", "dashdot", "longdash", "longdashdot"];
    const SHADES = ["rgba(0,0,0,0)", "rgba(86,180,233,0.16)", "rgba(230,159,0,0.18)"];
    const NO_CONTACT = { light: "#c4c8cc", dark: "#59616a" };
    const PRINTED_WIDTH = 660, FEW = 6;
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const still = { responsive: true, displaylogo: false, modeBarButtonsToRemove: ["select2d", "lasso2d"] };
    let printing = false, numbers = null;

    const theme = () => (dark.matches && !printing ? "dark" : "light");
    const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    const by = (id) => document.getElementById(id);
    const said = (value) => (value === null || value === undefined ? "–" : Number(value.toPrecision(4)).toString());

    async function unpacked(id) {
        const bytes = Uint8Array.from(atob(by(id).textContent), (c) => c.charCodeAt(0));
        const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
        return new Response(stream).text();
    }

    function axis(title, more) {
        return {
            title: { text: title, standoff: 6 }, gridcolor: ink("line"), zerolinecolor: ink("line"),
            linecolor: ink("quiet"), automargin: true, exponentformat: "power", ...more,
        };
    }

    function layout(x, y, more) {
        return {
            paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
            font: { color: ink("ink"), size: 13 }, margin: { l: 56, r: 16, t: 28, b: 46 },
            hovermode: "x unified", dragmode: "zoom", uirevision: "kept",
            hoverlabel: { bgcolor: ink("paper"), font: { color: ink("ink") }, bordercolor: ink("line") },
            legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 }, showlegend: true,
            modebar: { color: ink("quiet"), activecolor: ink("link"), bgcolor: "rgba(0,0,0,0)" },
            xaxis: x, yaxis: y, ...(printing ? { width: PRINTED_WIDTH, height: 300, autosize: false } : {}), ...more,
        };
    }

    function traces(curves, marked) {
        return curves.map((curve) => ({
            type: "scatter", name: curve.name, x: curve.x, y: curve.y,
            mode: curve.marks ? "markers" : marked ? "lines+markers" : "lines",
            line: { color: LOOKS[theme()][curve.look % 6], dash: STROKES[Math.floor(curve.look / 6) % 6], width: 2 },
            marker: { color: LOOKS[theme()][curve.look % 6], size: marked ? 5 : 9, symbol: curve.look % 6 },
            hovertemplate: "%{y:.4~g}", connectgaps: false,
        }));
    }

    function shades(bands) {
        return bands.filter((band) => band[2] > band[1]).flatMap(([, start, end], i) => [{
            type: "rect", xref: "x", yref: "paper", x0: start, x1: end, y0: 0, y1: 1, layer: "below",
            line: { width: 0 }, fillcolor: SHADES[i % 3],
        }]);
    }

    function names(bands) {
        return bands.filter((band) => band[2] > band[1]).map(([name, start, end]) => ({
            x: (start + end) / 2, y: 1, xref: "x", yref: "paper", yanchor: "top", text: name, showarrow: false,
            font: { size: 11, color: ink("quiet") },
        }));
    }

    const scale = (colours) => colours.map((colour, i) => [i / (colours.length - 1), colour]);
    // One colour for each of `count` classes, in steps.
    const steps = (colours, count) => [...Array(count).keys()].flatMap((i) => {
        const colour = colours[Math.round(i * (colours.length - 1) / Math.max(count - 1, 1))];
        return [[i / count, colour], [(i + 1) / count, colour]];
    });
    const bar = (unit, classes = []) => ({
        title: { text: unit, side: "right" }, thickness: 12, outlinewidth: 0,
        ...(classes.length ? { tickvals: classes.map((_, i) => i + 1), ticktext: classes } : {}),
    });

    // Many names go beside the curves, or where there is no room are read at the pointer.
    function legend(part) {
        if (part.curves.length <= FEW) return { showlegend: part.curves.length > 1 };
        const room = printing || by(part.id).clientWidth > 700;
        return { showlegend: room, legend: { x: 1.01, y: 1, xanchor: "left" } };
    }

    const figures = {
        curves: (part) => ({
            data: traces(part.curves, false),
            layout: layout(axis(part.x, part.logarithmic.includes("x") ? { type: "log" } : {}),
                axis(part.y, part.logarithmic.includes("y") ? { type: "log" } : { rangemode: "tozero" }),
                { shapes: shades(part.bands), annotations: names(part.bands), ...legend(part) }),
        }),
        map: ({ classes = [], ...part }) => ({
            data: [{
                type: "heatmap", x: part.xs, y: part.ys, z: part.values,
                colorscale: classes.length ? steps(part.colours, classes.length) : scale(part.colours),
                colorbar: bar(part.unit, classes), hoverongaps: false,
                hovertemplate: `%{x:.4~g}, %{y:.4~g}: %{z:.4~g} ${part.unit}<extra></extra>`,
                ...(part.range ? { zmin: part.range[0], zmax: part.range[1] } : {}),
                ...(classes.length ? { zmin: 0.5, zmax: classes.length + 0.5 } : {}),
            }, ...(part.marked ? [{
                type: "heatmap", x: part.xs, y: part.ys, z: part.marked, showscale: false, hoverinfo: "skip",
                colorscale: [[0, "rgba(127, 127, 127, 0.75)"], [1, "rgba(127, 127, 127, 0.75)"]],
            }] : [])],
            layout: layout(axis(part.x, { showgrid: false, constrain: "domain" }),
                axis(part.y, { showgrid: false, constrain: "domain", ...(part.equal ? { scaleanchor: "x" } : {}) }),
                { hovermode: "closest" }),
        }),
        lines: (part, moment) => ({
            data: traces(part.frames[moment], true),
            layout: layout(axis(part.x, { range: part.xrange }), axis(part.y, { range: part.yrange }),
                { showlegend: false }),
        }),
        heat: (part, moment) => figures.map({ ...part, ...part.frames[moment] }),
        cells: (part, moment) => cells(part, part.frames[moment]),
        solid: (part, moment) => solid(part, part.frames[moment]),
    };

    function binned(part, value) {
        if (value === null) return null;
        const share = (value - part.range[0]) / (part.range[1] - part.range[0] || 1);
        return Math.max(0, Math.min(part.colours.length - 1, Math.floor(share * part.colours.length)));
    }

    // Polygons of one colour are one path: a thousand cells are as many as there are colours.
    function cells(part, frame) {
        const paths = new Map(), middle = { x: [], y: [], text: [] };
        const corners = frame.cells || part.cells;
        corners.forEach((cell, number) => {
            const bin = binned(part, frame.values[number]);
            if (!paths.has(bin)) paths.set(bin, { x: [], y: [] });
            const path = paths.get(bin), at = [...cell, cell[0]];
            for (const node of at) { path.x.push(frame.points[2 * node]); path.y.push(frame.points[2 * node + 1]); }
            path.x.push(null); path.y.push(null);
            const mean = (k) => cell.reduce((sum, node) => sum + frame.points[2 * node + k], 0) / cell.length;
            middle.x.push(mean(0)); middle.y.push(mean(1));
            middle.text.push(bin === null ? part.nothing : `${said(frame.values[number])} ${part.unit}`);
        });
        const data = [...paths].map(([bin, path]) => ({
            type: "scatter", mode: "lines", x: path.x, y: path.y, fill: "toself", hoverinfo: "skip",
            fillcolor: bin === null ? NO_CONTACT[theme()] : part.colours[bin],
            line: { width: part.edges ? 0.4 : 0.6, color: part.edges ? ink("quiet") : bin === null ? NO_CONTACT[theme()] : part.colours[bin] },
        }));
        data.push({
            type: "scatter", mode: "markers", ...middle, hovertemplate: "%{text}<extra></extra>",
            marker: {
                opacity: 0, size: 8, color: [part.range[0], part.range[1]], cmin: part.range[0], cmax: part.range[1],
                colorscale: scale(part.colours), showscale: true, colorbar: bar(part.unit),
            },
        });
        for (const line of part.outlines || []) {
            data.push({ type: "scatter", mode: "lines", x: line.x, y: line.y, hoverinfo: "skip", line: { color: ink("quiet"), dash: "dot", width: 1.2 } });
        }
        return {
            data, layout: layout(axis(part.x, { showgrid: false, zeroline: false, range: part.xrange }),
                axis(part.y, { showgrid: false, zeroline: false, range: part.yrange, ...(part.equal ? { scaleanchor: "x" } : {}) }),
                { hovermode: "closest", showlegend: false }),
        };
    }

    function solid(part, frame) {
        const axes = (k) => frame.points.filter((_, i) => i % 3 === k);
        const [x, y, z] = [0, 1, 2].map(axes), [i, j, k] = part.faces;
        const plain = { gridcolor: ink("line"), color: ink("ink"), backgroundcolor: "rgba(0,0,0,0)" };
        return {
            data: [{
                type: "mesh3d", x, y, z, i, j, k, flatshading: true, hoverinfo: "skip",
                facecolor: frame.values.map((value) => {
                    const bin = binned(part, value);
                    return bin === null ? NO_CONTACT[theme()] : part.colours[bin];
                }),
                lighting: { ambient: 0.85, diffuse: 0.3, specular: 0 },
            }, {
                type: "scatter3d", mode: "lines", hoverinfo: "skip", showlegend: false,
                ...edges(part.faces, x, y, z), line: { color: ink("quiet"), width: 1 },
            }, {
                type: "scatter3d", mode: "markers", x: [x[0]], y: [y[0]], z: [z[0]], hoverinfo: "skip", showlegend: false,
                marker: { opacity: 0, size: 0.1, color: [part.range[0]], cmin: part.range[0], cmax: part.range[1], colorscale: scale(part.colours), showscale: true, colorbar: bar(part.unit) },
            }],
            layout: layout({}, {}, {
                showlegend: false, hovermode: false, margin: { l: 0, r: 0, t: 0, b: 0 },
                scene: {
                    aspectmode: "data", uirevision: "kept", camera: { eye: { x: 1.2, y: -1.65, z: -1.1 } },
                    xaxis: { ...plain, title: { text: "x (mm)" } }, yaxis: { ...plain, title: { text: "y (mm)" } }, zaxis: { ...plain, title: { text: "z (mm)" } },
                },
            }),
        };
    }

    function edges([a, b, c], x, y, z) {
        const line = { x: [], y: [], z: [] };
        a.forEach((_, n) => {
            for (const node of [a[n], b[n], c[n], a[n]]) { line.x.push(x[node]); line.y.push(y[node]); line.z.push(z[node]); }
            line.x.push(null); line.y.push(null); line.z.push(null);
        });
        return line;
    }

    function withoutScene(part) {
        if (part.kind !== "solid" || document.createElement("canvas").getContext("webgl")) return false;
        by(part.name).textContent = "The block in 3-D needs WebGL, which this browser does not have.";
        return true;
    }

    function draw() {
        for (const [name, part] of Object.entries(numbers)) {
            if (name === "fields") {
                by("moment-said").textContent = part.moments[moment()];
                by("moment").setAttribute("aria-valuetext", part.moments[moment()]);
                for (const drawing of part.drawings) {
                    by(drawing.name).parentElement.querySelector(".now").textContent = extent(drawing);
                    by(drawing.name).setAttribute("aria-label", `${drawing.title}. ${drawing.says} ${extent(drawing)}`);
                    if (!withoutScene(drawing)) show(drawing.name, figures[drawing.kind](drawing, moment()));
                }
            } else show(name, figures[part.kind](part));
        }
    }

    function show(name, figure) {
        const box = by(name);
        if (figure.layout.showlegend === undefined) figure.layout.showlegend = false;
        Plotly.react(box, figure.data, figure.layout, still);
        box.dataset.drawn = "yes";
    }

    // What a field is at the moment, and within which values.
    const moment = () => Number(by("moment")?.value ?? 0);
    const now = (part) => (part.kind === "lines" ? { curves: part.frames[moment()] } : part.frames ? part.frames[moment()] : part);
    function extent(part) {
        const frame = now(part), values = (frame.curves ? frame.curves.flatMap((curve) => curve.y) : frame.values.flat()).filter((value) => value !== null);
        if (!values.length) return "";
        const [low, high] = values.reduce(([a, b], value) => [Math.min(a, value), Math.max(b, value)], [Infinity, -Infinity]);
        return `Now ${said(low)} to ${said(high)} ${part.unit || part.y}.`;
    }

    // Arrows read the values of curves and maps or turn the block, + and - zoom there, Home shows all.
    function keys(name, part) {
        const box = by(name), reading = box.parentElement.querySelector(".reading"), clipped = (at, count) => Math.max(0, Math.min(count - 1, at));
        const logarithmic = part.logarithmic?.includes("x");
        let place = -1, row = -1, here = null;

        function readCurves(key) {
            const step = { ArrowRight: 1, ArrowLeft: -1, PageDown: 10, PageUp: -10 }[key];
            if (!step) return false;
            const { curves } = now(part);
            const places = [...new Set(curves.flatMap((curve) => curve.x))].filter((x) => x !== null).sort((a, b) => a - b);
            place = clipped(place + step, places.length);
            const x = places[place];
            const values = curves.map((curve) => {
                const at = curve.x.reduce((best, value, i) => (Math.abs(value - x) < Math.abs(curve.x[best] - x) ? i : best), 0);
                return `${curve.name} ${said(curve.y[at])}`;
            });
            reading.textContent = `${part.x} ${said(x)}: ${values.join(", ")}`;
            here = { x: logarithmic ? Math.log10(x) : x };
            Plotly.Fx.hover(box, { xval: here.x }, "xy");
            return true;
        }

        function readMap(key) {
            const step = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
            if (!step) return false;
            const { xs, ys, values } = now(part), upwards = ys.length > 1 && ys[1] < ys[0] ? -1 : 1;
            if (place < 0) [place, row] = [xs.length >> 1, ys.length >> 1];
            else [place, row] = [clipped(place + step[0], xs.length), clipped(row + upwards * step[1], ys.length)];
            here = { x: xs[place], y: ys[row] };
            reading.textContent = `${part.x} ${said(here.x)}, ${part.y} ${said(here.y)}: ${said(values[row][place])} ${part.unit}`;
            Plotly.Fx.hover(box, [{ curveNumber: 0, pointNumber: [row, place] }]);
            return true;
        }

        function turn(key) {
            const angle = { ArrowRight: 0.2, ArrowLeft: -0.2, ArrowUp: 0.2, ArrowDown: -0.2 }[key], nearer = { "+": 0.8, "-": 1.25 }[key];
            const { x, y, z } = box.layout.scene.camera.eye, flat = Math.hypot(x, y), upright = key === "ArrowUp" || key === "ArrowDown";
            if (!angle && !nearer) return false;
            const around = Math.atan2(y, x) + (angle && !upright ? angle : 0), away = Math.hypot(flat, z) * (nearer || 1);
            const up = Math.max(-1.5, Math.min(1.5, Math.atan2(z, flat) + (upright ? angle : 0)));
            const eye = { x: away * Math.cos(up) * Math.cos(around), y: away * Math.cos(up) * Math.sin(around), z: away * Math.sin(up) };
            Plotly.relayout(box, { "scene.camera.eye": eye });
            return true;
        }

        function zoom(key) {
            const axes = part.kind === "curves" || part.kind === "lines" ? ["x"] : ["x", "y"], changes = {};
            if (key === "Home") {
                for (const axis of ["x", "y"]) Object.assign(changes, part[`${axis}range`] ? { [`${axis}axis.range`]: part[`${axis}range`] } : { [`${axis}axis.autorange`]: true });
            } else if (key === "+" || key === "-") {
                for (const axis of axes) {
                    const [low, high] = box.layout[`${axis}axis`].range, half = (high - low) * (key === "+" ? 0.25 : 1), middle = here?.[axis] ?? (low + high) / 2;
                    changes[`${axis}axis.range`] = [middle - half, middle + half];
                }
            } else return false;
            Plotly.relayout(box, changes);
            return true;
        }

        const tools = { curves: [readCurves, zoom], lines: [readCurves, zoom], map: [readMap, zoom], heat: [readMap, zoom], solid: [turn] }[part.kind] ?? [zoom];
        box.addEventListener("keydown", (event) => {
            if (tools.some((tool) => tool(event.key))) event.preventDefault();
        });
    }

    function print(now) {
        printing = now; // charts are drawn before the style of print counts
        document.documentElement.classList.toggle("printing", now);
        draw();
        if (!now) for (const box of document.querySelectorAll("[data-drawn]")) Plotly.relayout(box, { autosize: true });
    }

    async function start() {
        for (const button of document.querySelectorAll(".copy")) {
            button.addEventListener("click", async () => {
                await navigator.clipboard.writeText(button.nextElementSibling.textContent);
                button.textContent = "Copied";
            });
        }
        numbers = JSON.parse(await unpacked("numbers"));
        for (const [name, part] of Object.entries(numbers)) part.id = name;
        if (Object.keys(numbers).length) {
            const script = document.createElement("script");
            script.text = await unpacked("plotly");
            document.head.append(script);
            draw();
            for (const [name, part] of Object.entries(numbers)) {
                for (const each of name === "fields" ? part.drawings : [part]) keys(each.name ?? name, each);
            }
            if (by("moment")) by("moment").addEventListener("input", draw);
            dark.addEventListener("change", draw);
            addEventListener("beforeprint", () => print(true));
            addEventListener("afterprint", () => print(false));
        }
        document.body.dataset.ready = "yes";
    }

    start().catch((error) => {
        const trouble = by("trouble");
        trouble.textContent = `The curves could not be drawn (${error}); this browser may be too old. The tables are complete.`;
        trouble.hidden = false;
        console.error(error);
    });
})();
