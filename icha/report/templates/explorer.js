"use strict";
// The data of the page (icha/report/explorer.py): topographies, and contacts. Each contact has one run per model.
const { contacts, topographies } = JSON.parse(document.getElementById("data").textContent);
const CHOICES = ["study", "surface", "rms_slope", "material", "seed"];
const WORDS = { asperities: "asperities", boundary_elements: "boundary elements" };
const LOOKS = { asperities: { dash: "solid", symbol: "circle" }, boundary_elements: { dash: "dash", symbol: "square" } };
const CONTACT = "{{ colour }}";
// Only maps can be enlarged. On other plots a moving finger scrolls the page.
const MAP = { displaylogo: false, responsive: true, displayModeBar: true, modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]] };
const PLOT = { displayModeBar: false, responsive: true };
const byId = (id) => document.getElementById(id);
const stop = byId("stop");

const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const floats = (text) => new Float32Array(bytes(text).buffer);
// Format a number with four digits and a typographic minus sign.
const digits = (value) => (value && Math.abs(value) < 1e-4 ? value.toExponential(3) : value.toPrecision(4));
const format = (value) => digits(value).replace(/(\.\d*?)0+(e|$)/, "$1$2").replace(/\.(e|$)/, "$1").replaceAll("-", "−");

// The chosen contact, its visible runs by model, the run along which the slider moves, and ranges of axes.
let contact, runs, leading, ranges;

// Fill a list; keep the choice if it is still available.
function fill(list, values, words = {}) {
  const before = list.value;
  list.replaceChildren(...values.map((value) => new Option(words[value] || String(value), value)));
  if (values.map(String).includes(before)) list.value = before;
  list.disabled = values.length < 2;
}

// Each list offers the values that exist for the choices in the earlier lists.
function choose() {
  let left = contacts;
  for (const name of CHOICES) {
    fill(byId(name), [...new Set(left.map((each) => each[name]))]);
    left = left.filter((each) => String(each[name]) === byId(name).value);
  }
  contact = left[0];
  const models = Object.keys(contact.runs);
  fill(byId("model"), models.length > 1 ? ["both", ...models] : models, { ...WORDS, both: "both" });
  const shown = byId("model").value === "both" ? models : [byId("model").value];
  runs = Object.fromEntries(shown.map((model) => [model, opened(contact.runs[model])]));
  leading = Object.values(runs)[0];
  ranges = {};
}

// A run with its curves as numbers.
function opened(run) {
  return { ...run, ...Object.fromEntries(["pressure", "area", "gap", "force", "indentation"].filter((name) => name in run).map((name) => [name, floats(run[name])])) };
}

// The step of a run at the position of the slider; -1 without such a step.
const stepOf = (run) => (run === leading || !run.partners ? Number(stop.value) : run.partners[Number(stop.value)]);
// The latest snapshot at or before a step, if there is any. The list of snapshots has the order of the campaign.
function snapshotOf(run, step) {
  const before = run.snapshots.filter((each) => each.step <= step);
  return before.reduce((last, each) => (last && last.step >= each.step ? last : each), undefined);
}
const legOf = (run, step) => (run.leg[step] % 2 ? "unloading" : "loading") + (run.leg[step] > 1 ? ` (leg ${run.leg[step]})` : "");

// The colours of the style sheet in the present scheme of the browser, light or dark.
let colours;
function mix() {
  colours = Object.fromEntries(["ink", "soft", "line", "paper", "asperities", "boundary_elements"].map((name) => {
    document.body.style.caretColor = `var(--${name})`;
    return [name, getComputedStyle(document.body).caretColor];
  }));
}

function layoutOf(x, y, more = {}) {
  const axis = { gridcolor: colours.line, linecolor: colours.soft, zeroline: false, showline: true, mirror: true, exponentformat: "power" };
  return {
    paper_bgcolor: colours.paper, plot_bgcolor: colours.paper,
    font: { color: colours.ink, size: 13, family: "Georgia, serif" },
    margin: { l: 68, r: 14, t: 30, b: 50 }, dragmode: false, showlegend: Object.keys(runs).length > 1, legend: { orientation: "h", y: 1.02, yanchor: "bottom" },
    xaxis: { ...axis, ...x, title: { text: x.title } }, yaxis: { ...axis, ...y, title: { text: y.title } }, ...more,
  };
}
const lineOf = (model) => ({ name: WORDS[model], line: { color: colours[model], dash: LOOKS[model].dash, width: 1.6 } });

// The maps: a heat map of the heights, and an image of the contact that the slider replaces.
function drawMaps() {
  byId("maps").replaceChildren(...Object.keys(runs).map((model) => {
    const figure = document.createElement("figure");
    figure.innerHTML = `<figcaption class="${model}">${WORDS[model]}</figcaption><div class="map" id="map-${model}" role="img"></div>`;
    return figure;
  }));
  const { grid, cells, low, high, levels } = topographies[contact.topography];
  const heights = bytes(levels);
  for (const [model, run] of Object.entries(runs)) {
    const [length, unit] = unitOf(run.period), [height, heightUnit] = unitOf(run.rms_height);
    const side = run.period * length, node = side / grid, cell = side / cells;
    const scale = ((high - low) / 255) * run.rms_height * height, lowest = low * run.rms_height * height;
    const z = Array.from({ length: cells }, (_, row) => Float32Array.from(heights.subarray(row * cells, (row + 1) * cells), (level) => lowest + scale * level));
    const range = [-node / 2, side - node / 2];
    const trace = {
      type: "heatmap", z, x0: (cell - node) / 2, dx: cell, y0: (cell - node) / 2, dy: cell, colorscale: "Greys", reversescale: false,
      colorbar: { thickness: 10, outlinewidth: 0, title: { text: `height (${heightUnit})`, side: "right" } },
      hovertemplate: `x %{x:.4g} ${unit}, y %{y:.4g} ${unit}<br>height %{z:.4g} ${heightUnit}<extra></extra>`,
    };
    const layout = layoutOf(
      { title: `x (${unit})`, range, constrain: "domain", minallowed: range[0], maxallowed: range[1] },
      { title: `y (${unit})`, range, constrain: "domain", scaleanchor: "x", minallowed: range[0], maxallowed: range[1] },
      { showlegend: false, margin: { l: 50, r: 70, t: 34, b: 48 }, dragmode: window.matchMedia("(pointer: coarse)").matches ? false : "zoom" },
    );
    Plotly.newPlot(`map-${model}`, [trace], layout, MAP);
    byId(`map-${model}`).on("plotly_relayout", (change) => alike(model, change));
  }
}

// All maps show the same section of the surface.
function alike(model, change) {
  const zoomed = Object.fromEntries(Object.entries(change).filter(([key]) => /axis\d?\.(range|autorange)/.test(key)));
  if (!Object.keys(zoomed).length || alike.busy) return;
  alike.busy = true;
  Promise.all(Object.keys(runs).filter((other) => other !== model).map((other) => Plotly.relayout(`map-${other}`, zoomed)))
    .finally(() => { alike.busy = false; });
}

const PREFIXES = [[1, ""], [1e3, "m"], [1e6, "µ"], [1e9, "n"], [1e12, "p"]];
// Factor and name of the unit for a length: the largest unit in which the number is at least 1.
function unitOf(metres) {
  const [factor, prefix] = PREFIXES.find(([each]) => metres * each >= 1) || PREFIXES.at(-1);
  return [factor, `${prefix}m`];
}

// Image of the contact in a snapshot, as a URL: the stored map, or circles of the spots with their periodic images.
function pictureOf(run, snapshot) {
  if (snapshot.map) return `data:image/png;base64,${snapshot.map}`;
  if (!snapshot.circles) return "";
  const [x, y, radius] = snapshot.circles.map(floats), scale = 1000 / run.period, half = 500 / run.grid;
  const circles = Array.from(x, (_, k) => {
    const r = (radius[k] * scale).toFixed(3);
    return `M${(x[k] * scale - r).toFixed(3)} ${(y[k] * scale).toFixed(3)}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
  });
  const shifts = run.periodic ? [-1000, 0, 1000] : [0];
  const copies = shifts.flatMap((dx) => shifts.map((dy) => `<use href="#s" x="${dx}" y="${dy}"/>`));
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="2000" height="2000" viewBox="${-half} ${half - 1000} 1000 1000">`
    + `<defs><path id="s" d="${circles.join("")}"/></defs><g transform="scale(1 -1)" fill="${CONTACT}" stroke="${CONTACT}" stroke-width="0.5">${copies.join("")}</g></svg>`;
  return `data:image/svg+xml,${encodeURIComponent(svg)}`;
}

// The curves of all runs, each with the point of the present step.
// For each of the two plots of curves: its element, the names of x and y, and both axes. Indenters have forces.
function curvePlots() {
  const type = byId("log").checked ? "log" : "linear";
  const area = { title: "contact area <i>A</i>/<i>A</i><sub>0</sub>" };
  if (leading.force) {
    const x = { title: "indentation (µm)" };
    return [["area", "indentation", "area", x, area], ["separation", "indentation", "force", x, { title: "force (µN)" }]];
  }
  const load = { title: "reduced pressure <i>p</i>/(<i>E</i>*<i>h</i>′<sub>rms</sub>)", type };
  return [
    ["area", "pressure", "area", load, { ...area, type }],
    ["separation", "pressure", "gap", load, { title: "mean gap <i>u</i>/<i>h</i><sub>rms</sub>" }],
  ];
}

function drawCurves() {
  for (const [id, along, name, abscissa, axis] of curvePlots()) {
    const curves = Object.entries(runs).map(([model, run]) => ({ x: run[along], y: run[name], mode: "lines", ...lineOf(model) }));
    const points = Object.keys(runs).map((model) => ({
      x: [], y: [], mode: "markers", showlegend: false, hoverinfo: "skip",
      marker: { color: colours[model], symbol: LOOKS[model].symbol, size: 12, line: { color: colours.paper, width: 1.5 } },
    }));
    Plotly.react(id, [...curves, ...points], layoutOf(abscissa, axis), PLOT);
  }
}

// For each plot: the curve of the snapshot, both axes, and the powers of length in the units of both axes.
const DISTRIBUTIONS = {
  gap_density: ["gap", { title: "gap <i>u</i>/<i>h</i><sub>rms</sub>", type: "log" }, { title: "<i>P</i>(<i>u</i>) <i>h</i><sub>rms</sub>", type: "log" }, 0, 0],
  pressure_density: ["pressure", { title: "pressure <i>p</i>/(<i>E</i>*<i>h</i>′<sub>rms</sub>)" }, { title: "<i>P</i>(<i>p</i>) <i>E</i>*<i>h</i>′<sub>rms</sub>", type: "log" }, 0, 0],
  sizes: ["sizes", { title: "patch area <i>A</i> (UNIT²)", type: "log" }, { title: "<i>n</i>(<i>A</i>) (UNIT<sup>−4</sup>)", type: "log" }, 2, -4],
  larger: ["larger", { title: "patch area <i>A</i> (UNIT²)", type: "log" }, { title: "patches larger than <i>A</i> (UNIT<sup>−2</sup>)", type: "log" }, 2, -2],
};

function drawDistributions(now) {
  const [length, unit] = unitOf(leading.period);
  for (const [id, [name, ...axes]] of Object.entries(DISTRIBUTIONS)) {
    const curveOf = (snapshot) => snapshot[name].map((text, k) => floats(text).map((value) => value * length ** axes[2 + k]));
    const traces = now.filter(({ snapshot }) => snapshot).map(({ model, snapshot, exact }) => {
      const [x, y] = curveOf(snapshot);
      const marker = { color: colours[model], symbol: LOOKS[model].symbol, size: 5 };
      return { x, y, mode: name === "larger" ? "lines" : "lines+markers", opacity: exact ? 1 : 0.3, ...lineOf(model), marker };
    });
    // The axes cover the whole path, so that only the curves move with the slider.
    if (!ranges[id]) {
      const all = Object.values(runs).flatMap((run) => run.snapshots.map(curveOf));
      ranges[id] = [0, 1].map((k) => rangeOf(all.map((curve) => curve[k]), axes[k].type));
    }
    const [x, y] = [0, 1].map((k) => ({ ...axes[k], title: axes[k].title.replace("UNIT", unit), range: ranges[id][k] }));
    Plotly.react(id, traces, layoutOf(x, y), PLOT);
  }
}

// Range of the values in some lists, with a margin. For a logarithmic axis, plotly.js expects the exponents.
function rangeOf(lists, type) {
  const values = lists.flatMap((list) => Array.from(list, (value) => (type === "log" ? Math.log10(value) : value))).filter(Number.isFinite);
  if (!values.length) return undefined;
  const low = values.reduce((one, other) => Math.min(one, other)), high = values.reduce((one, other) => Math.max(one, other));
  const margin = 0.04 * (high - low) || 0.5;
  return [low - margin, high + margin];
}

// Everything that the slider moves: contact, points, distributions and text.
function drawStop() {
  const now = Object.entries(runs).map(([model, run]) => {
    const step = stepOf(run), snapshot = snapshotOf(run, step);
    return { model, run, step, snapshot, exact: snapshot !== undefined && snapshot.step === step };
  });
  for (const { model, run, snapshot, exact } of now) {
    const side = run.period * unitOf(run.period)[0], node = side / run.grid, source = snapshot ? pictureOf(run, snapshot) : "";
    const image = { source, xref: "x", yref: "y", x: -node / 2, y: side - node / 2, sizex: side, sizey: side, sizing: "stretch", layer: "above", opacity: exact ? 1 : 0.3 };
    Plotly.relayout(`map-${model}`, { images: source ? [image] : [] });
    byId(`map-${model}`).setAttribute("aria-label", `Topography and contact, computed with ${WORDS[model]}${exact ? "" : ", in an earlier state"}`);
  }
  const points = now.map((_, k) => now.length + k);
  for (const [id, along, name] of curvePlots()) {
    const at = (values, step) => (step < 0 ? [] : [values[step]]);
    Plotly.restyle(id, { x: now.map(({ run, step }) => at(run[along], step)), y: now.map(({ run, step }) => at(run[name], step)) }, points);
  }
  drawDistributions(now);
  printState(now);
}

// The state as text and numbers.
function printState(now) {
  const place = Number(stop.value), count = leading.pressure.length;
  const words = `${legOf(leading, place)}, p* = ${format(leading.pressure[place])}`;
  byId("state").textContent = `${place + 1} of ${count}: ${words}`;
  stop.setAttribute("aria-valuetext", `${place + 1} of ${count}, ${words}`);
  const steps = leading.snapshots.map((each) => each.step);
  byId("before").disabled = !steps.some((step) => step < place);
  byId("after").disabled = !steps.some((step) => step > place);
  const rows = now.map(({ model, run, step, exact }) => {
    const cells = step < 0 ? ["–", "–", "–", "–"] : [format(run.pressure[step]), format(run.area[step]), format(run.gap[step]), run.spots[step]];
    return `<tr><th scope="row" class="${model}">${WORDS[model]}</th>${cells.map((cell) => `<td class="num">${cell}</td>`).join("")}<td>${exact ? "yes" : "no"}</td></tr>`;
  });
  byId("values").innerHTML = "<table><thead><tr><th scope='col'>Model</th><th scope='col' class='num'><i>p</i>/(<i>E</i>*<i>h</i>′<sub>rms</sub>)</th>"
    + "<th scope='col' class='num'><i>A</i>/<i>A</i><sub>0</sub></th><th scope='col' class='num'><i>u</i>/<i>h</i><sub>rms</sub></th>"
    + `<th scope='col' class='num'>Spots or patches</th><th scope='col'>Snapshot</th></tr></thead><tbody>${rows.join("")}</tbody></table>`;
  // A notice for both models is printed once.
  const notices = new Map();
  for (const each of now) for (const text of noticesOf(each)) notices.set(text, [...(notices.get(text) || []), WORDS[each.model]]);
  byId("notices").replaceChildren(...Array.from(notices, ([text, models]) =>
    Object.assign(document.createElement("p"), { className: "notice", textContent: `With ${models.join(" and ")}: ${text}` })));
}

function noticesOf({ run, step, snapshot, exact }) {
  const found = [];
  if (run.failure) found.push(`the run failed; ${run.failure}`);
  if (step < 0) found.push("the run does not have this state.");
  else if (!run.snapshots.length) found.push("the run has no snapshots, so spots and distributions are not available.");
  else if (!snapshot) found.push(`no snapshot up to this step, so spots and distributions are not shown. The first snapshot is at p* = ${format(run.pressure[Math.min(...run.snapshots.map((each) => each.step))])}.`);
  else if (!exact) found.push(`no snapshot at this step. The pale spots and distributions belong to the previous snapshot: ${legOf(run, snapshot.step)}, p* = ${format(run.pressure[snapshot.step])}.`);
  if (snapshot && !snapshot.map && !snapshot.circles) found.push("contact maps are not shown, because the file of the run was missing.");
  return found;
}

// Draw everything for another contact, model or colour scheme.
function drawAll() {
  mix();
  drawMaps();
  drawCurves();
  drawStop();
}
function start() {
  choose();
  stop.max = leading.pressure.length - 1;
  // Start at the last snapshot.
  stop.value = Math.max(0, ...leading.snapshots.map((each) => each.step));
  byId("log").checked = Object.values(runs).every((run) => run.pressure.every((value) => value > 0));
  drawAll();
}
// Move to the nearest snapshot before (-1) or after (1) the present step.
function jump(side) {
  const steps = leading.snapshots.map((each) => each.step).filter((step) => (step - Number(stop.value)) * side > 0);
  if (steps.length) stop.value = side < 0 ? Math.max(...steps) : Math.min(...steps);
  drawStop();
}

for (const name of [...CHOICES, "model"]) byId(name).addEventListener("change", start);
// While the slider moves, draw the latest position only.
let waiting = 0;
stop.addEventListener("input", () => {
  waiting ||= requestAnimationFrame(() => { waiting = 0; drawStop(); });
});
byId("before").addEventListener("click", () => jump(-1));
byId("after").addEventListener("click", () => jump(1));
byId("log").addEventListener("change", () => { drawCurves(); drawStop(); });
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAll);
start();
