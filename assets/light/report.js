// This file is the script of a report: it shows the data that are inside the page.
"use strict";

const $ = (id) => document.getElementById(id);
const data = JSON.parse($("data").textContent);
// Summaries are inside as the texts of their files, so that no digit changes.
for (const run of data.runs) if (run.summary) run.summary = JSON.parse(run.summary);

// --- the flow ---

async function unpack(text) {
  const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const shown = data.runs.filter((run) => run.frames.length > 0);
let light = null;
if (shown.length > 0) {
  light = new LightView($("light"), (run, k) => unpack(run.frames[k]));
  light.following = false;
  light.update(shown.map((run, k) => ({ id: k, description: run.description, times: run.times, frames: run.frames })));
  for (const run of shown) for (const [name, range] of Object.entries(run.ranges)) light.widen({ name, range });
  light.same.checked = true;
  light.rescale();
  light.go(Math.min(data.start, shown[0].times.length - 1));
} else {
  $("flow").hidden = true;
}

// --- the plots ---

function renderPlots() {
  const runs = data.runs.filter((run) => run.series).map((run, k) => ({ name: run.name, color: COLORS[k % COLORS.length], width: 1.8, curves: run.series }));
  $("plots").hidden = runs.length === 0;
  if (runs.length === 0) return;
  const columns = [...new Set(runs.flatMap((run) => run.curves.columns))].filter((c) => c !== "step" && c !== "time");
  if ($("plots").children.length === 0) {
    const ending = (word) => columns.filter((c) => c.endsWith(word));
    const usual = [...ending("_rate"), ...ending("_volume"), "mean_alignment", "max_speed", "dissipation", "dt"].filter((c) => columns.includes(c));
    for (let k = 0; k < Math.min(3, columns.length); k++) {
      const title = (c) => (data.units[c] ? `${c} (${data.units[c]})` : c);
      $("plots").append(plotBox(`Curve ${k + 1}`, columns, title, usual[k] || columns[k], renderPlots));
    }
  }
  [...$("plots").children].forEach((part) => plot(part.lastChild, part.firstChild.value, runs, []));
}

// --- the tables ---

// All numbers and texts of an object, by path.
function flat(value, path = "", out = new Map()) {
  if (value === null || typeof value !== "object") out.set(path, value);
  else if (!Array.isArray(value)) for (const [key, part] of Object.entries(value)) flat(part, path ? `${path}.${key}` : key, out);
  else if (value.every((part) => typeof part === "number")) out.set(path, value.join(" × "));
  return out;
}

function table(place, runs, part, title) {
  const columns = runs.map((run) => flat(part(run) || {}));
  const keys = [...new Set(columns.flatMap((c) => [...c.keys()]))];
  if (keys.length === 0) return;
  const cell = (value) => {
    if (value === undefined || value === null) return make("td", {}, "–");
    if (typeof value !== "number") return make("td", { className: "text" }, String(value));
    return make("td", { title: String(value) }, Number.isInteger(value) ? value.toLocaleString("en") : short(value, 6));
  };
  const head = make("thead", {}, make("tr", {}, make("th", { scope: "col" }, title), ...runs.map((run) => make("th", { scope: "col" }, run.name))));
  const rows = keys.map((key) => make("tr", {}, make("th", { scope: "row" }, key.replaceAll("_", " ")), ...columns.map((c) => cell(c.get(key)))));
  const scroller = make("div", { className: "wide", tabIndex: 0, ariaLabel: title });
  scroller.setAttribute("role", "region");
  place.append(scroller);
  scroller.append(make("table", {}, head, make("tbody", {}, ...rows)));
}

function renderTables() {
  const pick = (keys) => (run) => run.summary && Object.fromEntries(keys.filter((k) => k in run.summary).map((k) => [k, run.summary[k]]));
  const end = ["ending", "error", "steps", "time", "gauges", "max_speed", "rms_speed", "mean_alignment", "particles", "cells", "unknowns", "volume_drift"];
  const parts = [["At the end (SI units)", pick(end)], ["Balances (relative errors)", pick(["balances"])], ["Time of computation (s)", pick(["seconds"])], ["Particles and frames", pick(["population", "frames"])], ["Identity", pick(["version", "scene", "scene_hash", "state_hash"])]];
  for (const [title, part] of parts) table($("tables"), data.runs, part, title);
  table($("tables"), data.runs.filter((run) => !run.summary), (run) => run.values, "At the end (SI units)");
}

function renderTexts() {
  const several = data.runs.length > 1;
  for (const run of data.runs) {
    for (const note of [...(run.summary ? run.summary.warnings : []), ...run.notes]) $("warnings").append(make("li", {}, several ? `${run.name}: ${note}` : note));
    if (!run.scene) continue;
    const copy = make("button", { type: "button", onclick: () => navigator.clipboard.writeText(run.scene) }, "Copy");
    const scene = make("details", {}, make("summary", {}, several ? `Scene of ${run.name}` : "Scene"), copy, make("pre", { tabIndex: 0 }, run.scene));
    $("scenes").append(scene);
  }
  $("warned").hidden = $("warnings").children.length === 0;
  $("again").textContent = data.again.join("\n");
}

renderPlots();
renderTables();
renderTexts();
window.addEventListener("resize", renderPlots);
