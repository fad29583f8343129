"use strict";
/* The interactive part of a report. Everything that it draws stands in the element #data. */
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const kinds = {u1: Uint8Array, u2: Uint16Array, u4: Uint32Array, f4: Float32Array, f8: Float64Array};
const config = {responsive: true, displaylogo: false, modeBarButtonsToRemove: ["lasso2d", "select2d"]};
const grid = {gridcolor: "#e4e4e4", zeroline: false, automargin: true};
const cycle = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"];
const dashes = ["solid", "dash", "dot", "dashdot"];
const byId = (id) => document.getElementById(id);
/* One kind for all: what WebGL draws lies above what is drawn without it. */
const drawnBy = document.createElement("canvas").getContext("webgl") ? "scattergl" : "scatter";
const narrow = () => window.innerWidth < 700;

function unpack(packed) {
  const raw = atob(packed.bdata);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
  return new kinds[packed.dtype](bytes.buffer);
}

/* Plotly reads a small part of HTML in its texts. */
function plain(text) {
  return String(text).replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");
}

const columns = {};
for (const [name, column] of Object.entries(data.columns)) {
  const values = unpack(column.values);
  columns[name] = column.codes ? Float32Array.from(unpack(column.codes), (code) => values[code]) : values;
}
const group = unpack(data.group), ids = unpack(data.design_id), filters = unpack(data.filter_id);
const scenario = unpack(data.scenario.codes), cfa = unpack(data.cfa.codes);
const wavelength = Array.from(unpack(data.curves.wavelength_nm));
const G = Object.fromEntries(data.groups.map((name, i) => [name, i]));
const limited = {};
for (const [name, lights] of Object.entries(data.limited)) limited[name] = unpack(lights.codes);
const x = columns[data.axes.x], y = columns[data.axes.y], light = columns.cfa_sensitivity;
let overview = data.overviews[0], view = data.views[0] || null;

const shown = (name, value) => Number.isFinite(value) ? value.toFixed(data.columns[name].digits) : "-";
const title = (row) => data.names[row] ? data.names[row].long : `filter ${filters[row]}`;

const cfaOf = (row) => data.cfa.words[cfa[row]];

function rowsOf(name, every = false) {
  const at = data.scenario.words.indexOf(overview.scenario), found = [];
  const own = every || !view ? -1 : data.cfa.words.indexOf(view.cfa);
  for (let i = 0; i < group.length; i++)
    if (group[i] === G[name] && scenario[i] === at && (own < 0 || cfa[i] === own)) found.push(i);
  return found;
}

function described(row) {
  const lines = [title(row)];
  for (const name of Object.keys(data.columns)) {
    const value = columns[name][row];
    if (!Number.isFinite(value) || (name === "violation" && value <= 0)) continue;
    lines.push(`${data.columns[name].label}: ${shown(name, value)}`);
    if (lightsOf(name, row)) lines.push(`${data.limited[name].label}: ${lightsOf(name, row)}`);
  }
  return lines.slice(0, 30);
}

/* The two lights that limit a CSD of a design; none of another quantity. */
function lightsOf(name, row) {
  return name in limited ? data.limited[name].words[limited[name][row]] : "";
}

/* The design that is meant: one of the front, or with a name, within a few pixels, else the nearest. */
function meant(event, id) {
  const row = event.points[0].customdata, {xaxis, yaxis} = byId(id)._fullLayout;
  if (row === undefined) return undefined;
  const all = id === "cfas", u = all ? light : x;
  const far = (i) => Math.hypot(xaxis.d2p(u[i]) - xaxis.d2p(u[row]), yaxis.d2p(y[i]) - yaxis.d2p(y[row]));
  const names = all ? ["best", "named", "plain", "front"] : ["best", "named", "front"];
  const marked = names.flatMap((name) => rowsOf(name, all)).filter((i) => far(i) < 6);
  return marked.reduce((near, i) => near === undefined || far(i) < far(near) ? i : near, undefined) ?? row;
}

function hover(event, id) {
  const box = byId("hover"), row = meant(event, id);
  if (row === undefined) return;
  box.replaceChildren(...described(row).map((line) => {
    const part = document.createElement("div");
    part.textContent = line;
    return part;
  }));
  box.hidden = false;
  const left = Math.min(event.event.clientX + 14, window.innerWidth - box.offsetWidth - 8);
  const top = Math.min(event.event.clientY + 14, window.innerHeight - box.offsetHeight - 8);
  box.style.transform = `translate(${Math.max(4, left)}px, ${Math.max(4, top)}px)`;
}

function points(rows, name, marker, extra) {
  return Object.assign({
    type: drawnBy, mode: "markers", name, marker, customdata: rows, hoverinfo: "none",
    x: rows.map((i) => x[i]), y: rows.map((i) => y[i]),
  }, extra);
}

/* What the search found at its levels, and what is proven there and between them: each step holds up to the next. */
function levelTraces(drawn) {
  const found = [];
  if (drawn.traced) found.push({type: drawnBy, mode: "markers", name: "found by the search", x: drawn.traced[0],
    y: drawn.traced[1], hoverinfo: "skip", marker: {symbol: "cross-thin-open", size: 8, color: "#000000", line: {width: 1}}});
  if (drawn.limit) found.push({type: drawnBy, mode: "lines", name: drawn.limit_name, x: drawn.limit[0],
    y: drawn.limit[1], hoverinfo: "skip", line: {shape: "hv", color: data.colors.groups.limit, dash: "dash", width: 2}});
  return found;
}

/* Names of designs, each where it lies on no marker and no other name, as far as there is room; in pixels. */
function beside(labeled, others, at, width, height) {
  const boxOf = ([u, v], r) => [u - r, v - r, u + r, v + r];
  const markers = [...labeled.map((row) => boxOf(at(row), 8)), ...others.map((place) => boxOf(place, 3))], placed = [];
  const meets = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];
  return labeled.sort((a, b) => y[b] - y[a]).map((row) => {
    const name = data.names[row] ? data.names[row].short : cfaOf(row), [u, v] = at(row);
    const text = `${name} ${y[row] < 10 ? y[row].toFixed(1) : y[row].toFixed(0)}`, long = 6.6 * text.length;
    const places = [9, 0, -9, 22, -22, 35, 48].flatMap((up) => [["left", 10, up], ["right", -10, up], ["center", 0, 1.8 * up]]);
    const rated = places.map(([anchor, right, up]) => {
      const start = u + right - {left: 0, center: long / 2, right: long}[anchor];
      const box = [start, v + up - 8, start + long, v + up + 8];
      const over = markers.filter((marker) => meets(box, marker)).length + 20 * placed.filter((other) => meets(box, other)).length;
      return {anchor, right, up, box, over: over + (box[0] < 0 || box[2] > width || box[1] < -8 || box[3] > height ? 50 : 0)};
    });
    const best = rated.reduce((least, place) => place.over < least.over ? place : least);
    placed.push(best.box);
    return {x: light[row], y: y[row], text: plain(text), showarrow: false, xanchor: best.anchor, xshift: best.right, yshift: best.up,
      font: {size: 12}, bgcolor: "rgba(255,255,255,0.75)", borderpad: 0};
  });
}

function drawOverview() {
  const color = data.colors.groups, found = [], labeled = [];
  const add = (name, text, marker, write) => {
    const rows = rowsOf(name, true).filter((i) => Number.isFinite(y[i]));
    if (!rows.length) return;
    if (write) labeled.push(...rows);
    found.push(points(rows, text, marker, {x: rows.map((i) => light[i])}));
  };
  /* The star lies below all others, so that it hides none. */
  add("best", "best of the search", {size: 22, symbol: "star", color: color.best, line: {color: "#000000", width: 1}}, true);
  add("front", "swept front", {size: 6, color: color.front});
  found.push(...levelTraces(overview));
  add("plain", "plain CFAs", {size: 10, symbol: "square", color: color.reference}, true);
  add("named", "named designs", {size: 10, symbol: "diamond", color: color.named}, true);
  let top = 1;
  const shown = [...labeled, ...rowsOf("front", true)].map((i) => light[i]).filter(Number.isFinite);
  for (const line of [overview.traced, overview.limit]) if (line) shown.push(...line[0]);
  for (const i of labeled) top = Math.max(top, y[i]);
  const margin = 0.1 * (Math.max(...shown) - Math.min(...shown)) || 0.1;
  const left = Math.min(...shown) - margin, right = Math.max(...shown) + 2 * margin;
  for (const line of [overview.traced, overview.limit]) if (line) top = Math.max(top, ...line[1]);
  const width = byId("cfas").clientWidth - (narrow() ? 80 : 270), height = narrow() ? 300 : 280;
  const at = (u, v) => [(u - left) / (right - left) * width, v / (1.1 * top) * height];
  const drawn = rowsOf("front", true).map((i) => at(light[i], y[i]));
  for (const line of [overview.traced, overview.limit]) if (line) drawn.push(...line[0].map((u, i) => at(u, line[1][i])));
  const notes = beside(labeled, drawn, (row) => at(light[row], y[row]), width, height);
  Plotly.react("cfas", found, {
    xaxis: Object.assign({title: {text: plain(overview.x_label).replace(": ", narrow() ? ":<br>" : ": ")}, range: [left, right]}, grid),
    yaxis: Object.assign({title: {text: plain(overview.y_label)}, range: [0, 1.1 * top]}, grid),
    height: narrow() ? 460 : 370, margin: {l: 60, r: 10, t: 30, b: 50}, hovermode: "closest", plot_bgcolor: "#fff", annotations: notes,
    legend: narrow() ? {orientation: "h", y: -0.3, font: {size: 11}} : {x: 1.01, y: 1, font: {size: 12}},
    title: {text: plain(overview.title), font: {size: narrow() ? 12 : 15}},
  }, config);
}

function traces() {
  const color = data.colors.groups, found = [];
  const count = (n) => n.toLocaleString("en");
  const bad = byId("infeasible").checked ? rowsOf("infeasible") : [];
  if (bad.length) {
    const violation = bad.map((i) => columns.violation[i]);
    const top = violation.filter(Number.isFinite).sort((a, b) => a - b)[Math.floor(0.95 * (violation.length - 1))];
    found.push(points(bad, `not feasible (${count(view.counts.infeasible)})`, {
      symbol: "x", size: 4, opacity: 0.6, color: violation, cmin: 0, cmax: top || 1,
      colorscale: [[0, "#8c8c8c"], [1, "#e6c9a8"]], showscale: !narrow(),
      colorbar: {title: {text: "violation", side: "right"}, thickness: 8, len: 0.45, y: 0.2, x: 1.0},
    }));
  }
  const good = rowsOf("feasible"), front = rowsOf("front");
  if (good.length)
    found.push(points(good, `feasible (${count(view.counts.feasible)})`, {size: 4, opacity: 0.6, color: color.feasible}));
  if (front.length) found.push(points(front, `Pareto front (${count(view.counts.front)})`, {size: 7, color: color.front}));
  found.push(...levelTraces(view));
  if (view.knee !== null)
    found.push(points([view.knee], "knee of the front",
      {size: 15, symbol: "hexagon-open", color: "#000000", line: {width: 2}}));
  const named = rowsOf("named");
  for (const some of named.length > 6 ? [named] : named.map((i) => [i]))
    found.push(points(some, some.length > 1 ? "named designs" : plain(title(some[0])),
      {size: 10, symbol: "diamond", color: color.named}));
  const best = rowsOf("best");
  if (best.length)
    found.unshift(points(best, "best of the search",
      {size: 22, symbol: "star", color: color.best, line: {color: "#000000", width: 1}}));
  return found;
}

function levels() {
  const entries = Object.entries(view.levels).sort((a, b) => a[1] - b[1]);
  const shapes = entries.map(([, level]) => (
    {type: "line", xref: "paper", x0: 0, x1: 1, y0: level, y1: level, line: {color: "#7a7a7a", width: 1, dash: "dot"}}));
  let top = 1;
  for (let i = 0; i < y.length; i++) if (y[i] > top) top = y[i];
  const merged = [];
  for (const [name, level] of entries) {
    const text = `${plain(name)} ${level.toFixed(0)}`, last = merged[merged.length - 1];
    if (last && level - last.y < 0.035 * top) last.text += `, ${text}`;
    else merged.push({xref: "paper", x: 0, y: level, text, showarrow: false, xanchor: "left", yanchor: "bottom",
      font: {size: 11, color: "#555"}, bgcolor: "rgba(255,255,255,0.7)"});
  }
  for (const row of rowsOf("named"))
    merged.push({x: x[row], y: y[row], text: plain(data.names[row].short), showarrow: false, yshift: 13, font: {size: 11}});
  if (view.bound !== null) {
    merged.push({x: view.bound, yref: "paper", y: 1, yanchor: "bottom", text: plain(view.bound_text), showarrow: false, font: {size: 11, color: "#555"}});
    shapes.push({type: "line", yref: "paper", y0: 0, y1: 1, x0: view.bound, x1: view.bound,
      line: {color: "#000000", width: 1, dash: "dash"}});
  }
  return {shapes, annotations: merged};
}

function legend() {
  return narrow() ? {orientation: "h", y: -0.28, font: {size: 11}} : {x: 1.12, y: 1, font: {size: 12}};
}

let listening = false;
function drawPareto() {
  const layout = Object.assign({
    xaxis: Object.assign({title: {text: plain(view.x_label).replace(" (", narrow() ? "<br>(" : " (")}}, grid),
    yaxis: Object.assign({title: {text: plain(view.y_label)}}, grid),
    height: narrow() ? 520 : 570, margin: {l: 60, r: 10, t: 50, b: 60}, legend: legend(), hovermode: "closest",
    plot_bgcolor: "#fff",
    title: {text: plain(view.title), font: {size: narrow() ? 12 : 15}},
  }, levels());
  Plotly.react("pareto", traces(), layout, config);
  if (!listening) listen("pareto");
  listening = true;
}

function drawCurves(row) {
  const own = Object.entries(data.curves.designs[ids[row]] || {}), found = [];
  const line = (name, packed, color, dash, width) => found.push({
    type: "scatter", mode: "lines", name: plain(name), x: wavelength, y: Array.from(unpack(packed)),
    line: {color, dash, width},
  });
  const whole = group[row] === G.plain, names = (whole ? data.curves.plain : data.curves.ends)[cfaOf(row)] || [];
  let top = 0.1;
  for (const packed of [...names.map((name) => data.curves.sensor[name]), ...own.map(([, packed]) => packed)]) top = Math.max(top, ...unpack(packed));
  for (const [type, packed] of Object.entries(data.curves.shades)) found.push({
    type: "scatter", mode: "lines", name: `${plain(type)} lights`, x: wavelength, y: Array.from(unpack(packed), (v) => v * top), fill: "tozeroy",
    line: {width: 0}, fillcolor: `${data.colors.types[type] || "#777777"}22`, hoverinfo: "skip"});
  for (const name of names)
    line(name, data.curves.sensor[name], data.colors.curves[name] || "#777777", whole ? "solid" : "dot", whole ? 2.5 : 1.5);
  if (!whole && data.curves.limits[cfaOf(row)]) line("filter at the upper bound", data.curves.limits[cfaOf(row)], "#000000", "dash", 1.2);
  own.forEach(([channel, packed], i) => line(own.length > 1 ? `${title(row)}, ${channel}` : title(row), packed, cycle[i], "solid", 2.5));
  Plotly.react("curves", found, {
    title: {text: `QE of ${plain(title(row))}`, font: {size: 14}}, height: 380, margin: {l: 50, r: 10, t: 36, b: 85},
    xaxis: Object.assign({title: {text: "wavelength / nm"}}, grid),
    yaxis: Object.assign({title: {text: "QE"}, rangemode: "tozero"}, grid), legend: {orientation: "h", yref: "container", y: 0, yanchor: "bottom"},
  }, config);
}

function drawClouds(row) {
  const packed = data.clouds.designs[ids[row]], channels = data.clouds.channels[cfaOf(row)] || [];
  byId("clouds").hidden = !packed || channels.length < 2;
  if (byId("clouds").hidden) return;
  const types = data.clouds.types, n = types.length, dn = unpack(packed);
  const of = (channel) => dn.subarray(channel * n, (channel + 1) * n);
  const found = [], pairs = channels.length - 1, wide = narrow() ? 1 : pairs, rows = Math.ceil(pairs / wide);
  const layout = {
    title: {text: `Signals of ${plain(title(row))}`, font: {size: 14}}, height: 60 + 280 * rows,
    margin: {l: 50, r: 10, t: 60, b: 45}, grid: {rows, columns: wide, pattern: "independent"},
    legend: {orientation: "h", y: rows === 1 ? 1.14 : 1.03, x: 0},
  };
  let top = 1;
  for (let i = 0; i < dn.length; i++) if (dn[i] > top) top = dn[i];
  for (let pair = 0; pair < pairs; pair++) {
    const at = pair ? String(pair + 1) : "";
    [...new Set(types)].forEach((type, k) => {
      const own = types.map((t, i) => t === type ? i : -1).filter((i) => i >= 0);
      found.push({
        type: "scatter", mode: "markers", name: plain(type), legendgroup: type, showlegend: pair === 0,
        x: own.map((i) => of(0)[i]), y: own.map((i) => of(pair + 1)[i]), xaxis: `x${at}`, yaxis: `y${at}`,
        marker: {size: 6, symbol: ["circle", "square", "diamond", "triangle-up", "triangle-down", "cross"][k % 6],
          color: data.colors.types[type] || cycle[k % 7]},
      });
    });
    const near = data.nearest[ids[row]];
    if (near) {
      const ends = near.slice(0, 2).map(([type, name]) => types.findIndex((t, i) => t === type && data.clouds.names[i] === name));
      found.push({type: "scatter", mode: "lines", name: `nearest lights, ${near[2]} apart`, showlegend: pair === 0, legendgroup: "nearest",
        x: ends.map((i) => of(0)[i]), y: ends.map((i) => of(pair + 1)[i]), xaxis: `x${at}`, yaxis: `y${at}`,
        line: {color: "#000000", width: 2}, hoverinfo: "skip"});
    }
    layout[`xaxis${at}`] = Object.assign({title: {text: `${channels[0]} / DN`}, range: [0, 1.05 * top]}, grid);
    layout[`yaxis${at}`] = Object.assign({title: {text: `${channels[pair + 1]} / DN`}, range: [0, 1.05 * top]}, grid);
  }
  Plotly.react("clouds", found, layout, config);
}

function choose(row) {
  const box = byId("details"), list = document.createElement("dl");
  for (const name of Object.keys(data.columns)) {
    const value = columns[name][row];
    if (!Number.isFinite(value) || (name === "violation" && value <= 0)) continue;
    const pair = document.createElement("div"), term = document.createElement("dt"), text = document.createElement("dd");
    term.textContent = data.columns[name].label;
    text.textContent = shown(name, value);
    pair.append(term, text);
    list.append(pair);
  }
  for (const [name, {label}] of Object.entries(data.limited)) {
    if (!lightsOf(name, row)) continue;
    const part = document.createElement("div"), term = document.createElement("dt"), lights = document.createElement("dd");
    term.textContent = label;
    lights.textContent = lightsOf(name, row);
    part.className = "limits";
    part.append(term, lights);
    list.append(part);
  }
  const head = document.createElement("h3");
  head.textContent = title(row);
  const note = document.createElement("p"), kept = group[row] === G.plain || ids[row] in data.curves.designs;
  note.textContent = (kept ? "" : "This page holds no curve of this design. ") +
    `To export it as CSV and for ISETCam: sweep export ${data.folder} --design ${filters[row]}` +
    (kept && !(ids[row] in data.clouds.designs) ? `. Its signals are kept in ${data.cloud_scenario} alone.` : "");
  box.replaceChildren(head, list, note);
  box.dataset.design = ids[row];
  byId("curves").hidden = !kept;
  if (kept) drawCurves(row);
  drawClouds(row);
}

function drawParallel() {
  const box = byId("parallel");
  if (!box) return;
  const some = [...rowsOf("front"), ...rowsOf("feasible"), ...rowsOf("best")];
  const every = Math.max(1, Math.ceil(some.length / 4000));
  const rows = some.filter((row, i) => i % every === 0 || group[row] !== G.feasible);
  const names = [...data.parameters, ...Object.keys(data.columns).filter((n) => n.startsWith("csd_")), data.axes.x, data.axes.y, data.objective];
  const dimensions = [...new Set(names)].map((name) => ({name, values: rows.map((i) => columns[name] ? columns[name][i] : NaN)}))
    .filter(({values}) => values.every(Number.isFinite) && Math.max(...values) > Math.min(...values))
    .map(({name, values}) => ({label: plain(data.columns[name].label.replace(" CSD", "")), values}));
  const objective = columns[data.objective] || y;
  byId("parallel-section").classList.toggle("empty", rows.length < 2 || dimensions.length < 2);
  if (rows.length < 2 || dimensions.length < 2) return;
  box.style.minWidth = `${Math.max(600, 75 * dimensions.length)}px`;
  Plotly.react(box, [{
    type: "parcoords", dimensions, labelfont: {size: 10}, tickfont: {size: 9}, rangefont: {size: 9},
    labelangle: -20, line: {color: rows.map((i) => objective[i]), colorscale: "Viridis", showscale: true,
      colorbar: {thickness: 8, title: {text: plain(data.columns[data.objective] ? data.columns[data.objective].label : "objective"), side: "right"}}},
  }], {height: 420, margin: {l: 50, r: 20, t: 90, b: 20}}, config);
  const count = () => {
    const trace = box.data[0];
    const kept = rows.filter((row, i) => trace.dimensions.every((d) => {
      const range = d.constraintrange;
      if (!range) return true;
      const several = Array.isArray(range[0]) ? range : [range];
      return several.some(([low, high]) => d.values[i] >= low && d.values[i] <= high);
    }));
    const top = kept.reduce((best, row) => best === null || objective[row] > objective[best] ? row : best, null);
    byId("brushed").textContent = `${kept.length.toLocaleString("en")} of ${rows.length.toLocaleString("en")} feasible designs drawn are within the brushed ranges` +
      (top === null ? "." : `; the best of them: ${title(top)}, ${objective[top].toFixed(1)}.`);
  };
  box.removeAllListeners("plotly_restyle");
  box.on("plotly_restyle", count);
  count();
}

function drawSeries(series, box) {
  const found = [], keyed = !narrow() || box.id === "series-0";
  Object.entries(series.lines).forEach(([name, line], i) => {
    const color = cycle[i % cycle.length], shared = {type: "scatter", x: series.x, legendgroup: name};
    if (line.upper) {
      found.push(Object.assign({mode: "lines", y: line.y, line: {width: 0}, showlegend: false, hoverinfo: "skip"}, shared));
      found.push(Object.assign({mode: "lines", y: line.upper, line: {width: 0}, fill: "tonexty", fillcolor: `${color}33`, showlegend: false, hoverinfo: "skip"}, shared));
    }
    const [x, y] = line.drawn, passed = new Set(line.passes.map(([number]) => number)), rings = x.map((number) => passed.has(number));
    const symbol = ["circle", "square", "diamond", "triangle-up", "x", "star"][i % 6];
    const marker = !passed.size ? {size: 6, symbol} : {color, opacity: 1, line: {color, width: rings.map((ring) => ring ? 2 : 0)},
      size: rings.map((ring) => ring ? 13 : 6), symbol: rings.map((ring) => ring ? "circle-open" : symbol)};
    found.push(Object.assign({}, shared, {mode: "lines+markers", x, y, name: plain(name), line: {color, width: Math.max(1.5, 4 - 0.4 * i), dash: dashes[i % 4]}, marker}));
  });
  const values = Object.values(series.lines).flatMap((line) => line.y).filter((value) => value > 0);
  const shapes = series.level === null ? [] : [{type: "line", xref: "paper", x0: 0, x1: 1, y0: series.level, y1: series.level,
    line: {color: "#666666", width: 1, dash: "dash"}}];
  Plotly.react(box, found, {
    title: {text: plain(series.title), font: {size: 14}}, height: narrow() ? (keyed ? 420 : 310) : 420, shapes, hovermode: "x unified", showlegend: keyed,
    margin: {l: 60, r: 10, t: 36, b: 50}, legend: narrow() ? {orientation: "h", y: -0.25} : {tracegroupgap: 2},
    xaxis: Object.assign({title: {text: plain(series.x_label)}, type: series.log_x ? "log" : "linear"},
      series.log_x ? logTicks(series.x) : {}, grid),
    yaxis: Object.assign({title: {text: plain(series.y_label)}, type: series.log_y ? "log" : "linear", exponentformat: "power",
      rangemode: series.from_zero && !series.log_y ? "tozero" : "normal"}, series.log_y ? logTicks(values) : {}, grid),
  }, config);
}

/* Readable ticks of a logarithmic axis; over many decades Plotly's own. */
function logTicks(values) {
  const low = Math.min(...values), high = Math.max(...values), decades = Math.log10(high / low), ticks = [];
  if (decades > 5) return {};
  const steps = decades > (narrow() ? 2 : 4) ? [1] : [1, 2, 5];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++) {
    for (const step of steps) ticks.push(Number(`${step}e${power}`));
  }
  const shown = ticks.filter((tick) => tick > 0.8 * low && tick < 1.25 * high);
  return {tickmode: "array", tickvals: shown, ticktext: shown.map((tick) => tick.toLocaleString("en-US", {maximumSignificantDigits: 3}))};
}

function saveFront() {
  const cell = (value) => {
    const text = value === null ? "" : String(value);
    return /[",\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  };
  const lines = [data.front.columns, ...data.front.rows].map((row) => row.map(cell).join(","));
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([lines.join("\n") + "\n"], {type: "text/csv"}));
  link.download = "front.csv";
  link.click();
  URL.revokeObjectURL(link.href);
}

function select(id, words, key) {
  const box = byId(id);
  box.replaceChildren(...words.map((word) => {
    const option = document.createElement("option");
    option.value = option.textContent = word;
    return option;
  }));
  box.closest("label").hidden = words.length < 2;
  box.addEventListener("change", () => {
    const wanted = {scenario: overview.scenario, cfa: view ? view.cfa : null, [key]: box.value};
    overview = data.overviews.find((v) => v.scenario === wanted.scenario) || overview;
    view = data.views.find((v) => v.scenario === wanted.scenario && v.cfa === wanted.cfa) || view;
    drawAll();
  });
}

/* What is further down is drawn when it comes near the window, and again after another view was chosen. */
const drawers = new Map();
const near = new IntersectionObserver((entries) => entries.filter((e) => e.isIntersecting).forEach((e) => {
  near.unobserve(e.target);
  drawers.get(e.target)();
}), {rootMargin: "400px"});

function later(id, draw) {
  const box = byId(id);
  if (!box) return;
  drawers.set(box, draw);
  near.unobserve(box);
  near.observe(box);
}

function drawAll() {
  drawOverview();
  if (view) later("pareto", drawPareto);
  const best = [...rowsOf("best", true), ...rowsOf("front", true).sort((a, b) => y[b] - y[a])];
  const other = ["named", "plain", "feasible", "infeasible"].flatMap((name) => rowsOf(name, true)).sort((a, b) => y[b] - y[a]);
  const chosen = data.chosen[overview.scenario] ?? [];
  const first = [chosen, best, other].flat().find((row) => Number.isFinite(y[row]));
  if (first !== undefined) choose(first);
  if (!view) return;
  later("parallel-section", drawParallel);
}

/* Pointing and clicking at the designs of a plot, once it is drawn. */
function listen(id) {
  byId(id).on("plotly_hover", (event) => hover(event, id));
  byId(id).on("plotly_unhover", () => { byId("hover").hidden = true; });
  byId(id).on("plotly_click", (event) => {
    const row = meant(event, id);
    if (row === undefined) return;
    choose(row);
    hover(event, id);  // after a quick click Plotly does not say again what is pointed at
  });
}

/* Sections below the first screen open at a click on their heading; the plots in them are drawn then. */
function fold() {
  for (const heading of document.querySelectorAll("h2")) {
    if (heading.closest("section.first")) continue;
    const box = document.createElement("details"), head = document.createElement("summary");
    box.className = "section";
    heading.replaceWith(box);
    head.append(heading);
    box.append(head);
    box.addEventListener("toggle", () => {
      if (box.open && box.contains(byId("cfas"))) drawOverview();
      if (box.open) box.querySelectorAll(".js-plotly-plot").forEach((plot) => Plotly.Plots.resize(plot));
    });
    while (box.nextSibling && !(box.nextSibling.matches && box.nextSibling.matches("h2, :has(> h2)"))) box.append(box.nextSibling);
  }
}

fold();
select("scenario", data.overviews.map((v) => v.scenario), "scenario");
if (view) {
  select("cfa", [...new Set(data.views.map((v) => v.cfa))], "cfa");
  byId("infeasible").addEventListener("change", drawPareto);
  byId("save").addEventListener("click", saveFront);
  byId("save").disabled = data.front.rows.length === 0;
}
drawAll();
listen("cfas");
data.series.forEach((series, i) => later(`series-${i}`, () => drawSeries(series, byId(`series-${i}`))));
/* A page that is printed has every figure, as wide as the paper; the first one beside the answer, two series to a page. */
const heights = new Map();
function printed(box) {
  const wide = {width: 960}, small = {"xaxis.title.font.size": 11, "yaxis.title.font.size": 11};
  if (box.parentElement.classList.contains("screen")) return {...wide, ...small, height: 330};
  if (box.id.startsWith("series-")) return {...wide, ...small, height: 270};
  return box.id === "curves" ? {...wide, height: 340} : wide;
}
const folded = [];
function print() {
  folded.splice(0, folded.length, ...document.querySelectorAll("details:not([open])"));
  for (const box of folded) box.open = true;
  for (const [box, draw] of drawers) {
    near.unobserve(box);
    draw();
  }
  document.querySelectorAll(".js-plotly-plot").forEach((box) => {
    heights.set(box, box.layout.height);
    Plotly.relayout(box, printed(box));
  });
}
window.addEventListener("beforeprint", print);
window.addEventListener("afterprint", () => folded.forEach((box) => { box.open = false; }));
window.addEventListener("afterprint", () => document.querySelectorAll(".js-plotly-plot").forEach((box) =>
  Plotly.relayout(box, {width: null, height: heights.get(box), autosize: true, "xaxis.title.font.size": null, "yaxis.title.font.size": null})));
document.body.dataset.readyMs = Math.round(performance.now());
})();
