"use strict";
/* The explorer of a report: trade-off, parallel coordinates and a table of designs, linked; data stand in #data. */
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const root = document.getElementById("explorer"), NS = "http://www.w3.org/2000/svg", MOST = 12;
const at = Object.fromEntries(data.columns.map((column, index) => [column.name, index]));
const value = (design, index) => design.v[index] === null ? null : design.v[index] * data.columns[index].factor;
const shown = number => number === null ? "" : Number(number.toPrecision(3)).toLocaleString("en-US", {maximumSignificantDigits: 3});
const state = {on: data.designs.find(design => design.best) || data.designs[0], by: at[data.y], down: true, ranges: {}, all: false};

function make(name, parent, attributes = {}, text = null) {
  const svg = ["svg", "path", "line", "circle", "text", "g", "rect"].includes(name);
  const node = svg ? document.createElementNS(NS, name) : document.createElement(name);
  for (const [key, content] of Object.entries(attributes)) node.setAttribute(key, content);
  if (text !== null) node.textContent = text;
  parent.append(node);
  return node;
}
const extent = numbers => {
  const known = numbers.filter(number => number !== null), low = Math.min(...known), high = Math.max(...known);
  const room = (high - low || Math.abs(high) || 1) * 0.06;
  return [low - room, high + room];
};
const scale = ([low, high], start, stop) => number => start + (number - low) / (high - low) * (stop - start);
function ticks([low, high], most) {
  const raw = (high - low) / most, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(factor => factor * power).find(size => size >= raw);
  const found = [];
  for (let number = Math.ceil(low / step) * step; number <= high; number += step) found.push(number);
  return found;
}
const kept = () => data.designs.filter(design => Object.entries(state.ranges).every(([index, [low, high]]) => {
  const number = value(design, index);
  return (low === null || (number !== null && number >= low)) && (high === null || (number !== null && number <= high));
}));
function line(points) {
  return points.map(([x, y], index) => `${index ? "L" : "M"}${x.toFixed(1)} ${y.toFixed(1)}`).join("");
}
function axes(svg, x, y, xs, ys, box, labels) {
  for (const number of ticks(x, 5)) {
    make("line", svg, {x1: xs(number), x2: xs(number), y1: box.top, y2: box.bottom, stroke: "#e7e8ea"});
    make("text", svg, {x: xs(number), y: box.bottom + 15, "text-anchor": "middle"}, shown(number));
  }
  for (const number of ticks(y, 5)) {
    make("line", svg, {x1: box.left, x2: box.right, y1: ys(number), y2: ys(number), stroke: "#e7e8ea"});
    make("text", svg, {x: box.left - 5, y: ys(number) + 4, "text-anchor": "end"}, shown(number));
  }
  make("text", svg, {x: box.left, y: box.top - 8}, labels[1]);
  make("text", svg, {x: (box.left + box.right) / 2, y: box.bottom + 32, "text-anchor": "middle"}, labels[0]);
}
function select(design) {
  state.on = design;
  draw();
}
function nearest(svg, event, places) {
  const box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
  const x = (event.clientX - box.left) * view.width / box.width, y = (event.clientY - box.top) * view.height / box.height;
  let best = null, least = 40 ** 2;
  for (const [design, px, py] of places) {
    const far = (px - x) ** 2 + (py - y) ** 2;
    if (far < least) [best, least] = [design, far];
  }
  if (best) select(best);
}
function scatter(parent, designs) {
  const svg = make("svg", parent, {viewBox: "0 0 520 320", role: "img", "aria-label": "trade-off"});
  const box = {left: 56, right: 510, top: 24, bottom: 276}, i = at[data.x], j = at[data.y];
  const x = extent(data.designs.map(design => value(design, i))), y = extent(data.designs.map(design => value(design, j)));
  const xs = scale(x, box.left, box.right), ys = scale(y, box.bottom, box.top), places = [];
  axes(svg, x, y, xs, ys, box, [data.columns[i].words, data.columns[j].words]);
  if (data.level && data.level[1] !== null) {
    const height = ys(data.level[1] * data.columns[j].factor);
    make("line", svg, {x1: box.left, x2: box.right, y1: height, y2: height, stroke: "#1d1d1f", "stroke-dasharray": "2 3"});
  }
  for (const design of [...designs].sort((a, b) => (a.kind !== "sweep") - (b.kind !== "sweep"))) {
    const px = xs(value(design, i)), py = ys(value(design, j)), on = design === state.on;
    places.push([design, px, py]);
    make("circle", svg, {cx: px, cy: py, r: on ? 7 : design.kind === "sweep" ? 3.5 : 6, fill: design.feasible || design.kind === "reference" ? design.color : "#c4c7cb",
      stroke: on ? "#b3400e" : "#fff", "stroke-width": on ? 2.5 : 1});
    if (design.kind !== "sweep" || on) {
      const left = px > 380;
      make("text", svg, {x: px + (left ? -10 : 10), y: py - 7, "text-anchor": left ? "end" : "start", style: on ? "font-weight:600;fill:#1d1d1f" : ""}, design.name);
    }
  }
  svg.addEventListener("click", event => nearest(svg, event, places));
}
function curves(parent) {
  const design = state.on, svg = make("svg", parent, {viewBox: "0 0 450 320", role: "img", "aria-label": `curves of ${design.name}`});
  const box = {left: 46, right: 440, top: 24, bottom: 276}, x = [data.nm[0], data.nm[data.nm.length - 1]];
  const drawn = [...design.plain.map(name => [name, data.sensor[name].color, data.sensor[name].qe, 1.4]),
    ...Object.entries(design.qe).map(([name, qe]) => [name, "#065dcb", qe, 3])];
  const top = Math.max(100, ...drawn.flatMap(([, , qe]) => qe)) / 10, y = [0, top * 1.08];
  const xs = scale(x, box.left, box.right), ys = scale(y, box.bottom, box.top);
  axes(svg, x, y, xs, ys, box, ["wavelength / nm", "quantum efficiency / %"]);
  for (const lamp of data.lamps) {
    const points = lamp.v.map((height, index) => [xs(data.nm[index]), ys(height * top / 1000)]);
    make("path", svg, {d: `${line([[points[0][0], ys(0)], ...points, [points[points.length - 1][0], ys(0)]])}Z`, fill: lamp.color, "fill-opacity": 0.4});
  }
  for (const [name, color, qe, width] of drawn) {
    make("path", svg, {d: line(qe.map((height, index) => [xs(data.nm[index]), ys(height / 10)])), fill: "none", stroke: color, "stroke-width": width});
    const peak = qe.indexOf(Math.max(...qe));
    make("text", svg, {x: xs(data.nm[peak]), y: ys(qe[peak] / 10) - 4, "text-anchor": "middle", style: `fill:${color}`}, name);
  }
}
function parallel(parent, designs) {
  const svg = make("svg", parent, {viewBox: "0 0 1000 220", role: "img", "aria-label": "parallel coordinates"}), places = [];
  const indices = data.columns.map((_, index) => index), gap = 900 / Math.max(1, indices.length - 1);
  const scales = indices.map(index => scale(extent(data.designs.map(design => value(design, index))), 180, 40));
  const path = design => indices.filter(index => design.v[index] !== null).map(index => [50 + gap * index, scales[index](value(design, index))]);
  for (const design of [...designs.filter(one => one !== state.on), ...(designs.includes(state.on) ? [state.on] : [])]) {
    const on = design === state.on, points = path(design);
    for (const [x, y] of points) places.push([design, x, y]);
    make("path", svg, {d: line(points), fill: "none", stroke: on ? "#b3400e" : design.color, "stroke-width": on ? 3 : design.kind === "sweep" ? 1 : 2, "stroke-opacity": on ? 1 : 0.55});
  }
  for (const index of indices) {
    const x = 50 + gap * index, [low, high] = extent(data.designs.map(design => value(design, index)));
    make("line", svg, {x1: x, x2: x, y1: 40, y2: 180, stroke: "#5c6066"});
    const words = data.columns[index].words.split(" / ");
    make("text", svg, {x, y: 14 + 11 * (index % 2), "text-anchor": "middle"}, words[0].length > 17 ? `${words[0].slice(0, 16)}…` : words[0]);
    make("text", svg, {x, y: 36, "text-anchor": "middle"}, shown(high));
    make("text", svg, {x, y: 195, "text-anchor": "middle"}, `${shown(low)}${words[1] ? ` ${words[1]}` : ""}`);
  }
  svg.addEventListener("click", event => nearest(svg, event, places));
}
function table(parent, designs) {
  const scroll = make("div", parent, {class: "scroll"}), node = make("table", scroll), head = make("tr", make("thead", node));
  make("th", head, {}, "design");
  data.columns.forEach((column, index) => {
    const cell = make("th", head, {"data-by": index}, `${column.words}${state.by === index ? (state.down ? " ▼" : " ▲") : ""}`);
    cell.addEventListener("click", () => { state.down = state.by === index ? !state.down : true; state.by = index; draw(); });
    const range = make("div", cell);
    ["from", "to"].forEach((end, side) => {
      const input = make("input", range, {placeholder: end, "aria-label": `${column.words}, ${end}`, inputmode: "decimal"});
      const known = (state.ranges[index] || [null, null])[side];
      input.value = known === null ? "" : known;
      input.addEventListener("click", event => event.stopPropagation());
      input.addEventListener("change", () => {
        const ends = state.ranges[index] || [null, null], number = parseFloat(input.value);
        ends[side] = Number.isFinite(number) ? number : null;
        state.ranges[index] = ends;
        draw();
      });
    });
  });
  const body = make("tbody", node), sign = state.down ? -1 : 1;
  const sorted = [...designs].sort((a, b) => sign * ((value(a, state.by) ?? -Infinity) - (value(b, state.by) ?? -Infinity)));
  for (const design of state.all ? sorted : sorted.slice(0, MOST)) {
    const row = make("tr", body, design === state.on ? {class: "on"} : {});
    make("th", row, {scope: "row"}, design.name);
    data.columns.forEach((_, index) => make("td", row, {}, shown(value(design, index))));
    row.addEventListener("click", () => select(design));
  }
  if (sorted.length > MOST) {
    const button = make("button", parent, {type: "button"}, state.all ? "show few" : `show all ${sorted.length}`);
    button.addEventListener("click", () => { state.all = !state.all; draw(); });
  }
}
function draw() {
  root.replaceChildren();
  const designs = kept(), design = state.on;
  const meets = design.kind === "reference" ? "" : design.feasible ? " Meets every constraint." : " Misses a constraint.";
  make("p", root, {class: "shown"}, `${design.name}: ${data.columns.map((column, index) => [column.words.split(" / "), value(design, index)])
    .filter(([, number]) => number !== null).slice(0, 6).map(([words, number]) => `${words[0]} ${shown(number)}${words[1] ? ` ${words[1]}` : ""}`).join(", ")}.${meets}${design.reading ? ` Nearest lamps: ${design.reading}.` : ""}`);
  const views = make("div", root, {class: "views"});
  scatter(make("div", views), designs);
  curves(make("div", views));
  make("p", root, {class: "note"}, `${designs.length} of ${data.designs.length} designs: the front and those with a name.`);
  parallel(make("div", root, {class: "scroll"}), designs);
  table(root, designs);
}
draw();
})();
