// This file draws plots with curves of several runs, and the sketch of the flow.
"use strict";

const SVG = "http://www.w3.org/2000/svg";
const COLORS = ["#2b6cb0", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#8c6bb1"];

function draw(tag, attributes, text) {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

// Formats a number with few characters.
function short(value, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) {
    const [m, e] = value.toExponential(digits - 1).split("e");
    return `${m.includes(".") ? m.replace(/\.?0+$/, "") : m}e${Number(e)}`;
  }
  return String(Number(value.toPrecision(digits)));
}

// Returns about `count` round numbers within a range, for the ticks of an axis.
function ticks(low, high, count) {
  const step0 = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(step0));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= step0 * 0.999);
  const list = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) list.push(k * step);
  return list;
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
  const across = ticks(x0, x1, 4);
  across.forEach((v, k) => {
    const last = k === across.length - 1;
    const anchor = X(v) > w - 30 ? "end" : "middle";
    svg.append(draw("text", { x: X(v), y: h - 3, "text-anchor": anchor }, last ? `${short(v)} s` : short(v)));
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

// Draws grains, dye and walls on a canvas.
function drawSketch(canvas, picture) {
  const box = canvas.getBoundingClientRect();
  const dense = devicePixelRatio || 1;
  [canvas.width, canvas.height] = [box.width * dense, box.height * dense];
  const pen = canvas.getContext("2d");
  const [[x0, y0], [x1, y1]] = picture.domain;
  const pad = 24 * dense;
  const scale = Math.min((canvas.width - 2 * pad) / (x1 - x0), (canvas.height - 2 * pad) / (y1 - y0));
  const X = (x) => canvas.width / 2 + scale * (x - 0.5 * (x0 + x1));
  const Y = (y) => canvas.height / 2 - scale * (y - 0.5 * (y0 + y1));
  const style = getComputedStyle(canvas);
  for (const [[r, g, b], places] of picture.grains) {
    pen.fillStyle = `rgb(${r} ${g} ${b})`;
    for (const [x, y] of places) pen.fillRect(X(x) - dense, Y(y) - dense, 2 * dense, 2 * dense);
  }
  pen.strokeStyle = style.color;
  const lines = (list, width) => {
    pen.lineWidth = width * dense;
    for (const line of list) {
      pen.beginPath();
      line.forEach(([x, y], k) => (k ? pen.lineTo(X(x), Y(y)) : pen.moveTo(X(x), Y(y))));
      pen.stroke();
    }
  };
  lines(picture.dye, 0.8);
  lines(picture.walls, 2.5);
}
