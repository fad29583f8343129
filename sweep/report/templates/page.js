"use strict";
// A row of a table and the lines of its design light up together; a click on a head sorts.
(() => {
  const drawn = [...document.querySelectorAll('svg [id^="design:"]')];
  const rows = [...document.querySelectorAll("tr[data-design]")];
  const light = name => {
    for (const one of drawn) {
      const here = [...one.closest("svg").querySelectorAll('[id^="design:"]')].some(other => other.id === `design:${name}`);
      one.classList.toggle("dimmed", name !== null && here && one.id !== `design:${name}`);
    }
    for (const row of rows) row.classList.toggle("on", row.dataset.design === name);
  };
  const told = (element, name) => {
    element.addEventListener("mouseenter", () => light(name));
    element.addEventListener("mouseleave", () => light(null));
  };
  for (const row of rows) told(row, row.dataset.design);
  for (const one of drawn) told(one, one.id.slice("design:".length));
  const number = cell => {
    const found = cell.innerText.replace(/,/g, "").replace("−", "-").match(/-?\d+(\.\d+)?/);
    if (!found) return -Infinity;
    return cell.innerText.startsWith("1 in ") ? -1 / cell.innerText.replace(/[^\d.]/g, "").slice(1) : +found[0];
  };
  for (const head of document.querySelectorAll("thead tr:last-child")) {
    [...head.cells].slice(1).forEach((cell, at) => {
      cell.dataset.by = at;
      cell.addEventListener("click", () => {
        const body = head.closest("table").tBodies[0], sign = cell.dataset.sign = cell.dataset.sign === "-1" ? 1 : -1;
        const sorted = [...body.rows].sort((a, b) => sign * (number(a.cells[at + 1]) - number(b.cells[at + 1])));
        body.append(...sorted);
      });
    });
  }
})();
// The explorer: a point or a row shows the curves of a design.
(() => {
  const root = document.getElementById("explorer");
  if (!root) return;
  const data = JSON.parse(document.getElementById("designs").textContent), wide = 500, high = 300, left = 52, below = 40;
  let shown = data.designs.find(design => design.hero) || data.designs[0];
  const ends = values => {
    const known = values.filter(value => value !== null), low = Math.min(...known), top = Math.max(...known), room = (top - low || 1) * .06;
    return [low - room, top + room];
  };
  const scale = ([low, top], from, to) => value => from + (value - low) / (top - low) * (to - from);
  const text = value => value === null ? "" : (+value.toPrecision(3)).toLocaleString("en-US");
  const escaped = words => { const span = document.createElement("span"); span.textContent = words; return span.innerHTML; };
  const ticks = ([low, top]) => {
    const raw = (top - low) / 5, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].find(f => f * power >= raw) * power;
    return Array.from({ length: Math.floor(top / step) - Math.ceil(low / step) + 1 }, (_, at) => (Math.ceil(low / step) + at) * step);
  };
  const frame = (x, y, X, Y, across, up) =>
    ticks(x).map(at => `<path d="M${X(at)} 20V${high - below}" stroke="#e7e8ea"/><text x="${X(at)}" y="${high - below + 16}" text-anchor="middle">${text(at)}</text>`).join("") +
    ticks(y).map(at => `<path d="M${left} ${Y(at)}H${wide}" stroke="#e7e8ea"/><text x="${left - 5}" y="${Y(at) + 4}" text-anchor="end">${text(at)}</text>`).join("") +
    `<text x="${(left + wide) / 2}" y="${high - 4}" text-anchor="middle">${escaped(across)}</text><text x="0" y="12">${escaped(up)}</text>`;
  const svg = inner => `<figure><svg viewBox="0 0 ${wide} ${high}" font-size="13" fill="#5c6066">${inner}</svg></figure>`;
  const draw = () => {
    const x = ends(data.designs.map(design => design.values[1])), y = ends(data.designs.map(design => design.values[0]));
    const X = scale(x, left, wide), Y = scale(y, high - below, 20);
    const dots = data.designs.map((design, at) => `<circle data-at="${at}" cx="${X(design.values[1])}" cy="${Y(design.values[0])}" r="${design === shown ? 8 : 5}" fill="${design.color}" stroke="${design === shown ? "#b3400e" : "#fff"}" stroke-width="${design === shown ? 3 : 1}"/>`).join("");
    const nm = [data.nm[0], data.nm[data.nm.length - 1]], most = 1.1 * Math.max(60, ...Object.values(shown.qe).flat());
    const N = scale(nm, left, wide), Q = scale([0, most], high - below, 20);
    const path = values => values.map((value, at) => `${at ? "L" : "M"}${N(data.nm[at]).toFixed(1)} ${Q(value).toFixed(1)}`).join("");
    const lamps = data.lamps.map(lamp => `<path d="${path(lamp.values.map(value => .95 * most * value))}" fill="${lamp.color}" fill-opacity=".4"/>`).join("");
    const curves = Object.values(shown.qe).map(values => `<path d="${path(values)}" fill="none" stroke="#065dcb" stroke-width="3"/>`).join("");
    const head = data.columns.map(words => `<th>${escaped(words)}</th>`).join("");
    const body = data.designs.map((design, at) => `<tr data-at="${at}" class="${design === shown ? "on" : ""}" style="--c:${design.color}"><th>${escaped(design.name)}</th>${design.values.map(value => `<td>${text(value)}</td>`).join("")}</tr>`).join("");
    root.innerHTML = `<div class="panels">${svg(frame(x, y, X, Y, data.columns[1], data.columns[0]) + dots)}` +
      `${svg(frame(nm, [0, most], N, Q, "wavelength / nm", `${shown.name}: quantum efficiency / %`) + lamps + curves)}</div>` +
      `<div class="list"><table><thead><tr><th>design</th>${head}</tr></thead><tbody>${body}</tbody></table></div>`;
  };
  root.addEventListener("click", event => {
    const hit = event.target.closest("[data-at]");
    if (!hit) return;
    const top = root.querySelector(".list").scrollTop;
    shown = data.designs[hit.dataset.at];
    draw();
    root.querySelector(".list").scrollTop = top;
  });
  draw();
})();
