// This file draws plots with curves of several runs.
"use strict";

const SVG = "http://www.w3.org/2000/svg";
const COLORS = ["#2b6cb0", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#8c6bb1"];

function draw(tag, attributes, text) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

// An element with a list of columns and an empty plot; `changed` is called with another choice.
function plotBox(label, columns, title, column, changed) {
  const select = make("select", { ariaLabel: label }, ...columns.map((c) => make("option", { value: c }, title(c))));
  select.value = column;
  select.onchange = () => changed(select.value);
  return make("div", { className: "plot" }, select, draw("svg", { role: "img" }));
}

// Draws one column of several runs into an SVG element.
// runs: [{name, color, width, curves: {columns, points}}]; changes: times of parameter changes.
function plot(svg, column, runs, changes) {
  const box = svg.getBoundingClientRect();
  const [w, h] = [Math.max(box.width, 60), Math.max(box.height, 40)];
  svg.setAttribute("viewBox", `0 0 ${w} ${h}`);
  const log = column.endsWith("_error");
  const of = (v) => (log ? (v > 0 ? Math.log10(v) : null) : v);
  const lines = runs.map((run) => {
    const [x, y] = ["time", column].map((name) => run.curves.columns.indexOf(name));
    const points = x < 0 || y < 0 ? [] : run.curves.points;
    const every = Math.max(1, Math.floor(points.length / 1200));
    const kept = points.filter((p, k) => k % every === 0 || k === points.length - 1);
    return { run, points: kept.map((p) => [p[x], of(p[y])]).filter((p) => Number.isFinite(p[1])) };
  });
  const all = lines.flatMap((line) => line.points);
  svg.replaceChildren();
  const label = `${column}: ${runs.map((r) => r.name).join(", ")}`;
  svg.setAttribute("aria-label", label);
  if (all.length === 0) {
    svg.append(draw("text", { x: w / 2, y: h / 2, "text-anchor": "middle" }, "no data yet"));
    return;
  }
  const range = (k) => {
    let [low, high] = [Infinity, -Infinity];
    for (const p of all) { low = Math.min(low, p[k]); high = Math.max(high, p[k]); }
    if (k === 1 && !log && low > 0 && low < 0.6 * high) low = 0;
    if (high - low < 1e-9 * Math.max(Math.abs(high), 1e-300)) {
      const pad = Math.abs(high) * 0.1 || 1;
      return [low - (k ? pad : 0), high + pad];
    }
    return k === 0 ? [0, high] : [low, high + 0.04 * (high - low)];
  };
  const [[x0, x1], [y0, y1]] = [range(0), range(1)];
  const [left, bottom, top, right] = [46, 15, 4, 6];
  const X = (v) => left + ((v - x0) / (x1 - x0)) * (w - left - right);
  const Y = (v) => h - bottom - ((v - y0) / (y1 - y0)) * (h - bottom - top);
  for (const v of ticks(y0, y1, 3)) {
    svg.append(draw("path", { class: "axis", d: `M${left} ${Y(v)}H${w - right}` }));
    const text = log ? `1e${Number(v.toPrecision(3))}` : short(v);
    svg.append(draw("text", { x: left - 4, y: Y(v) + 3, "text-anchor": "end" }, text));
  }
  const [second, seconds] = timeUnit(x1);
  const across = ticks(x0 / seconds, x1 / seconds, Math.max(1.5, Math.min(4, w / 75))).map((v) => v * seconds);
  across.forEach((v, k) => {
    const last = k === across.length - 1;
    const anchor = X(v) > w - 30 ? "end" : "middle";
    svg.append(draw("text", { x: X(v), y: h - 3, "text-anchor": anchor }, last ? `${short(v / seconds)} ${second}` : short(v / seconds)));
  });
  for (const t of changes) {
    if (t === null || t > x1) continue;
    svg.append(draw("path", { class: "change", d: `M${X(t)} ${top}V${h - bottom}` }));
  }
  for (const { run, points } of lines) {
    if (points.length === 0) continue;
    const d = points.map((p, k) => `${k ? "L" : "M"}${X(p[0]).toFixed(1)} ${Y(p[1]).toFixed(1)}`).join("");
    svg.append(draw("path", { class: "curve", d, stroke: run.color, "stroke-width": run.width }));
    const end = points[points.length - 1];
    svg.append(draw("circle", { cx: X(end[0]), cy: Y(end[1]), r: 2.2, fill: run.color }));
  }
}
