// This file is the page of the explorer. Its only state is the text being typed: everything it
// shows comes from the session, so that several pages show the same.
"use strict";

const $ = (id) => document.getElementById(id);
let state = null;
let lastNews = 0;
let viewerReady = false;
const curves = new Map(); // run id -> {columns, points}

// --- communication with the session ---

function post(path, value) {
  return fetch(path, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(value) });
}

async function send(command) {
  let answer;
  try {
    answer = await (await post("api/command", command)).json();
  } catch (_) {
    answer = { accepted: false, message: "grainscope does not answer" };
  }
  if (!["ask", "list"].includes(command.do)) toast(answer.message + (answer.remedy ? ` — ${answer.remedy}` : ""), answer.accepted);
  return answer;
}

let fading = 0;
function toast(text, good) {
  const box = $("toast");
  box.textContent = text;
  box.className = `toast on${good ? "" : " no"}`;
  clearTimeout(fading);
  fading = setTimeout(() => box.classList.remove("on"), good ? 3500 : 7000);
}

function listen() {
  const events = new EventSource("api/events");
  events.onmessage = (event) => {
    $("lost").hidden = true;
    state = JSON.parse(event.data);
    if (state) render();
  };
  events.onerror = () => { $("lost").hidden = false; };
}

const fetching = new Set();
async function fetchCurves(id, points) {
  const have = curves.get(id);
  if (fetching.has(id) || (have && have.points.length >= points)) return;
  fetching.add(id);
  try {
    const from = have ? have.points.length : 0;
    const response = await fetch(`api/curves?run=${id}&from=${from}`);
    if (response.ok) {
      const part = await response.json();
      const now = curves.get(id) || { columns: part.columns, points: [] };
      if (part.from === now.points.length) now.points.push(...part.points);
      curves.set(id, now);
      renderPlots();
    }
  } catch (_) {
    // The next state from the session causes another attempt.
  } finally {
    fetching.delete(id);
  }
}

// --- the parts of the page ---

// Whether the data of a part have changed. Unchanged parts are not rendered, so that controls in
// use do not move.
const seen = new Map();
function changed(part, value) {
  const text = JSON.stringify(value);
  if (seen.get(part) === text) return false;
  seen.set(part, text);
  return true;
}

function render() {
  const { mode, run } = state;
  const words = {
    empty: "no run", running: "running", paused: "paused", stopped: "stopped",
    finished: "finished", failed: "failed",
  };
  $("mode").textContent = words[mode];
  $("mode").className = `mode ${mode}`;
  const goesOn = mode === "running" || mode === "paused";
  $("run-word").textContent = mode === "running" ? "Pause" : goesOn ? "Run" : "Run again";
  $("run").disabled = !run;
  $("step").disabled = !goesOn;
  $("stop").disabled = !goesOn;
  $("restart").disabled = !run;
  document.title = state.title ? `${state.title} – grainscope` : "grainscope";
  renderScenes();
  renderProblem();
  if (run) {
    renderNumbers(run);
    renderLights(run.lights);
    renderPhases(run.phases);
    for (const id of curves.keys()) {
      if (id !== run.id && !state.pins.some((p) => p.id === id)) curves.delete(id);
    }
    fetchCurves(run.id, run.points);
    state.pins.forEach((p) => fetchCurves(p.id, p.points));
  }
  renderKnobs();
  renderSwitches();
  renderEffects();
  renderDial();
  renderPins();
  renderSaved();
  renderWarnings();
  renderPlots();
  if (state.news && state.news.number > lastNews) {
    // Answers to requests of this page were shown already.
    if (lastNews > 0 && $("toast").textContent.split(" — ")[0] !== state.news.text) toast(state.news.text, state.news.good);
    lastNews = state.news.number;
  }
  offerViews();
  showStream();
  showLight();
}

function showStream() {
  if (viewerReady && state && state.stream) $("viewer").contentWindow.show(state.stream, state.run ? state.run.time : null, state.pins.length > 0);
}

// --- the light view ---

const light = new LightView($("light"), async (run, k) => {
  const response = await fetch(`api/runs/${run.id}/${run.steps[k]}`);
  return response.ok ? new Uint8Array(await response.arrayBuffer()) : null;
});
const listings = new Map(); // run id -> listing
let listing = false;

// Shows the latest frame unless the user looks at an earlier one. Which frames there are is read
// from the program, except that one more frame is known from the state.
async function showLight() {
  if (listing || !state.run) return;
  listing = true;
  try {
    for (;;) {
      const wanted = [[state.run.id, state.run.pictures], ...state.pins.map((p) => [p.id, null])];
      if (!changed("light", wanted)) return;
      for (const id of listings.keys()) if (!wanted.some((w) => w[0] === id)) listings.delete(id);
      for (const [id, pictures] of wanted) {
        const known = listings.get(id);
        if (known && (!pictures || extended(known, pictures))) continue;
        const response = await fetch(`api/runs/${id}`);
        if (!response.ok) { seen.delete("light"); return; }
        listings.set(id, await response.json());
      }
      light.update(wanted.map((w) => listings.get(w[0])));
    }
  } catch (_) {
    // The next state from the session causes another attempt.
    seen.delete("light");
  } finally {
    listing = false;
  }
}

// Whether a listing has these pictures, after the last one was appended to it if it was missing.
function extended(known, [count, step, time]) {
  if (known.steps.length === count - 1 && known.steps[count - 2] < step) {
    known.steps.push(step);
    known.times.push(time);
  }
  return known.steps.length === count && known.steps[count - 1] === step;
}

// --- which view is shown ---

// The Rerun viewer is loaded when it is chosen, or at once where a graphics card draws it.
let chosenView = null; // the choice of the user
let decided = false;
function offerViews() {
  if (decided) return;
  decided = true;
  $("view-rerun").parentNode.hidden = !state.viewer;
  lookForCard(() => { if (state.viewer) loadViewer(); });
}

function chooseView(name) {
  chosenView = name;
  if (name === "rerun") loadViewer();
  showView();
}

function loadViewer() {
  if ($("viewer").src) return;
  $("viewer").src = "viewer/";
  $("loading").hidden = false;
}

function showView() {
  const ready = Boolean(document.body.dataset.showing);
  const rerun = chosenView ? chosenView === "rerun" && ready : ready;
  $("light").hidden = rerun;
  $("loading").hidden = rerun || chosenView === "light" || !$("viewer").src;
  $("view-light").setAttribute("aria-pressed", String(!rerun));
  $("view-rerun").setAttribute("aria-pressed", String(rerun));
  $("live").hidden = !rerun;
}

function renderScenes() {
  if (!changed("scenes", [state.scenes, state.scene])) return;
  const group = (label, preset) => {
    const entries = state.scenes.filter((s) => s.preset === preset);
    const options = entries.map((s) => make("option", { value: s.id, title: s.description, selected: s.id === state.scene }, s.name));
    return entries.length ? [make("optgroup", { label }, ...options)] : [];
  };
  $("scene").replaceChildren(...group("Presets", true), ...group(`Files of ${state.folder}`, false));
  $("scene").value = state.scene;
  const entry = state.scenes.find((s) => s.id === state.scene);
  $("scene").title = entry ? entry.description : "";
}

function renderProblem() {
  const problem = state.problem;
  if (!changed("problem", problem)) return;
  const box = $("problem");
  box.hidden = !problem;
  box.replaceChildren();
  if (!problem) return;
  box.append(make("h2", {}, problem.title));
  for (const fault of problem.faults) {
    const part = make("div", {}, make("p", {}, fault.message));
    if (fault.line) part.append(make("pre", {}, `${String(fault.line[0]).padStart(4)} | ${fault.line[1]}`));
    if (fault.remedy) part.append(make("p", { className: "remedy" }, fault.remedy));
    box.append(part);
  }
  if (problem.scene) {
    box.append(make("button", { onclick: () => send({ do: "load", scene: problem.scene }) }, "Try again"));
  }
}

// A count with its noun: 1 cell, 2 cells.
function count(n, noun) { return `${n.toLocaleString("en")} ${noun}${n === 1 ? "" : "s"}`; }

function seconds(s) {
  if (s === null || s === undefined) return "–";
  if (s < 0.9995) return `${short(1e3 * s, 2)} ms`;
  return s < 100 ? `${short(s, 2)} s` : `${short(s / 60, 2)} min`;
}

// A time and the end of the run, in one unit.
function duration(time, end) {
  const [name, unit] = timeUnit(end);
  return `${short(time / unit, 4)} of ${short(end / unit, 3)} ${name}`;
}

function renderNumbers(run) {
  $("bar").style.width = `${Math.min(100, (100 * run.time) / run.end)}%`;
  const rate = run.steps_per_second;
  const items = [
    ["step", String(run.step), ""],
    ["steps/s", rate === null ? "–" : short(rate, 2), ""],
    ["time", duration(run.time, run.end), "wide"],
    ["time step", `${short(run.dt / timeUnit(run.dt)[1])} ${timeUnit(run.dt)[0]}`, "wide"],
    ["limited by", run.limited_by, "wide"],
    ...run.readings.map((r) => [r.name, `${short(r.value, 4)} ${r.unit}`, "wide"]),
    ["cells", `${run.cells[0]} × ${run.cells[1]}`, ""],
    ["unknowns", run.unknowns.toLocaleString("en"), ""],
  ];
  const list = $("numbers");
  if (changed("numbers", items.map((i) => i[0]))) {
    list.replaceChildren(...items.map(([name, , kind]) =>
      make("div", { className: kind }, make("dt", {}, name), make("dd"))));
  }
  items.forEach(([, value], k) => {
    const place = list.children[k].lastChild;
    if (place.textContent !== value) place.textContent = value;
    place.title = value;
  });
}

function renderLights(lights) {
  if (!changed("lights", lights)) return;
  $("lights").replaceChildren(...lights.map((l) => make("li", {
    className: l.good ? "" : "bad",
    title: `${l.meaning}; must stay below ${short(l.bound)}`,
    ariaLabel: `${l.name} ${short(l.value, 2)}, ${l.good ? "below its bound of" : "above its bound of"} ${short(l.bound)}`,
  }, make("span", { className: "name" }, l.name), make("span", {}, short(l.value, 2)))));
}

// The scale of a slider: logarithmic for a wide range above zero, a fourth power for a wide range
// from zero, else linear. `at` maps a value to 0..1, `value` maps back.
function scale(knob) {
  const { min, max } = knob;
  if (min > 0 && max / min >= 50) {
    return { at: (v) => Math.log(v / min) / Math.log(max / min), value: (s) => min * (max / min) ** s };
  }
  const usual = Math.max(Math.abs(knob.default), 1e-300);
  if (min === 0 && max / usual >= 20) {
    return { at: (v) => (v / max) ** 0.25, value: (s) => max * s ** 4 };
  }
  return { at: (v) => (v - min) / (max - min), value: (s) => min + (max - min) * s };
}

const STEPS = 400;
function renderKnobs() {
  const knobs = state.knobs;
  const keys = knobs.map(({ value, ...rest }) => rest);
  if (changed("knobs", keys)) $("knobs").replaceChildren(...knobs.map(makeKnob));
  for (const knob of knobs) {
    const box = document.querySelector(`[data-knob="${CSS.escape(knob.key)}"]`);
    if (!box) continue;
    const [slider, field] = [box.querySelector("[type=range]"), box.querySelector("[type=text]")];
    const value = String(Number(knob.value.toPrecision(6)));
    if (document.activeElement !== field && field.value !== value && !box.dataset.turning) field.value = value;
    if (slider && !box.dataset.turning) {
      const at = String(Math.round(STEPS * Math.min(1, Math.max(0, scale(knob).at(knob.value)))));
      if (slider.value !== at) slider.value = at;
      slider.setAttribute("aria-valuetext", `${value} ${knob.unit}`);
    }
  }
}

function makeKnob(knob) {
  const id = `knob-${knob.key}`;
  const says = make("div", { className: "says", ariaLive: "polite" });
  const field = make("input", { type: "text", id, inputMode: "decimal", autocomplete: "off", spellcheck: false });
  const box = make("div", { className: "knob" });
  box.dataset.knob = knob.key;
  let asked = 0;
  const ask = () => {
    clearTimeout(asked);
    asked = setTimeout(async () => {
      const answer = await send({ do: "ask", key: knob.key, value: field.value });
      says.textContent = answer.message + (answer.remedy ? `: ${answer.remedy}` : "");
      says.className = `says${!answer.accepted ? " no" : answer.restarts ? " restarts" : ""}`;
    }, 120);
  };
  const apply = async () => {
    clearTimeout(asked);
    const answer = await send({ do: "set", key: knob.key, value: field.value });
    delete box.dataset.turning;
    says.textContent = answer.accepted ? "" : answer.message + (answer.remedy ? `: ${answer.remedy}` : "");
    says.className = `says${answer.accepted ? "" : " no"}`;
    if (answer.accepted) renderKnobs();
  };
  field.oninput = () => { box.dataset.turning = "1"; ask(); };
  field.onkeydown = (event) => {
    if (event.key === "Enter") apply();
    if (event.key === "Escape") { delete box.dataset.turning; says.textContent = ""; field.blur(); renderKnobs(); }
  };
  field.onblur = () => { if (box.dataset.turning) apply(); };
  const label = make("label", { htmlFor: id, title: knob.label }, knob.label);
  if (knob.restarts) {
    label.prepend(make("span", { className: "tag", title: `A change restarts the run: it changes ${knob.restarts}` }, "restarts"));
  }
  const entry = make("div", { className: knob.unit ? "box unit" : "box" }, field);
  if (knob.unit) {
    entry.append(make("span", {}, knob.unit));
    field.style.paddingRight = `max(38px, calc(${knob.unit.length}ch + 12px))`;
  }
  const turn = make("div", { className: "turn" });
  if (knob.min !== null && knob.max !== null && knob.max > knob.min) {
    const slider = make("input", { type: "range", min: 0, max: STEPS, step: 1, ariaLabel: `${knob.label}, slider` });
    slider.oninput = () => {
      box.dataset.turning = "1";
      const value = scale(knob).value(slider.value / STEPS);
      field.value = String(Number(value.toPrecision(3)));
      slider.setAttribute("aria-valuetext", `${field.value} ${knob.unit}`);
      ask();
    };
    slider.onchange = apply;
    turn.append(slider);
  } else {
    turn.classList.add("alone");
  }
  turn.append(entry);
  box.append(label, turn, says);
  return box;
}

function renderSwitches() {
  if (!changed("switches", state.switches)) return;
  const focused = document.activeElement && document.activeElement.dataset.effect;
  $("switches").replaceChildren(...state.switches.map((s) => {
    const input = make("input", { type: "checkbox", checked: s.on, id: `effect-${s.effect}` });
    input.dataset.effect = s.effect;
    input.onchange = () => {
      input.disabled = true;
      send({ do: "set", key: s.key, value: s.other }).then(() => { seen.delete("switches"); renderSwitches(); });
    };
    return make("div", { className: "switch" }, input,
      make("label", { htmlFor: input.id }, s.effect,
        make("small", {}, `${s.cost}; restarts with ${s.key} = ${short(Number(s.other))}`)));
  }));
  if (focused) { const again = document.querySelector(`[data-effect="${focused}"]`); if (again) again.focus(); }
}

function renderEffects() {
  if (!changed("effects", state.effects)) return;
  $("effects").replaceChildren(...state.effects.map((e) => make("li", { className: e.solved ? "solved" : "" },
    e.name, " ", make("small", {}, `${e.solved ? "" : "not solved: "}${e.why}${e.unknowns ? `; ${count(e.unknowns, "unknown")}` : ""}`))));
}

function renderPhases(phases) {
  if (!changed("phases", phases.map(([n, s]) => [n, s.toFixed(2)]))) return;
  const largest = Math.max(...phases.map((p) => p[1]), 1e-9);
  $("phases").replaceChildren(...phases.flatMap(([name, share]) => [
    make("span", {}, name),
    make("i", { style: `width:${(100 * share) / largest}%` }),
    make("b", {}, `${(100 * share).toFixed(0)} %`),
  ]));
}

function renderDial() {
  if (!changed("dial", state.dial.map((d) => ({ ...d, seconds_per_step: short(d.seconds_per_step, 2) })))) return;
  const focused = document.activeElement && document.activeElement.name === "cells";
  const priced = state.dial.some((d) => d.error !== null);
  const lines = state.dial.map((d) => {
    const input = make("input", { type: "radio", name: "cells", checked: d.current, value: d.cells });
    input.onchange = () => send({ do: "set", key: "accuracy.cells", value: String(d.cells) });
    const last = priced ? (d.error === null ? "–" : `${short(100 * d.error, 2)} %`) : `${short(d.unknowns / 1000, 3)} k`;
    return make("label", { className: `line${d.current ? " current" : ""}` }, input,
      make("span", {}, count(d.cells, "cell")),
      make("span", {}, d.seconds_per_step === null ? "–" : `${d.current ? "" : "≈ "}${seconds(d.seconds_per_step)} per step`),
      make("span", {}, last));
  });
  const heads = make("div", { className: "heads" }, make("span"), make("span", { title: "per domain.length_scale" }, "per length"), make("span"), make("span", {}, priced ? "error" : "unknowns"));
  const dial = make("fieldset", { className: "dial", ariaLabel: "Cells per length, coarse to fine; another choice restarts the run" }, heads, ...lines);
  $("dial").replaceChildren(dial);
  if (!priced && state.dial.length) {
    $("dial").append(make("p", { className: "hint" }, `Another choice restarts the run. For errors, run: grainscope cost ${state.title}`));
  }
  if (focused) { const again = dial.querySelector(":checked"); if (again) again.focus(); }
}

// The colour of the run (k = 0) or of pin k.
function color(k) { return k === 0 ? "var(--accent)" : COLORS[k % COLORS.length]; }

function renderPins() {
  if (!changed("pins", [state.pins, state.run && state.run.id])) return;
  const suggestion = `run ${state.pins.length + 1}`;
  $("pin-name").placeholder = suggestion;
  $("pins").replaceChildren(...state.pins.map((p, k) => make("li", {},
    make("span", { className: "swatch", style: `background:${color(k + 1)}` }),
    make("span", {}, p.name, make("small", {}, `${p.values || "values of the file"}; ${count(p.steps, "step")} to ${short(p.time)} s`)),
    make("button", { className: "small", ariaLabel: `Unpin ${p.name}`, onclick: () => send({ do: "unpin", name: p.name }) }, "Unpin"))));
}

function bytes(n) { return n < 1e6 ? `${Math.ceil(n / 1e3)} kB` : `${(n / 1e6).toFixed(1)} MB`; }

function renderSaved() {
  $("save-name").placeholder = state.title || "name";
  $("save-hint").textContent = `Recording, scene, table and plots, into ${state.out}/`;
  if (!changed("saved", state.saved)) return;
  $("saved").replaceChildren(...state.saved.map((s) => make("li", {},
    make("b", {}, s.name), ` ${count(s.steps, "step")}`,
    make("div", {}, ...s.files.filter(([name]) => !name.endsWith(".png")).map(([name, size]) =>
      make("a", { href: `api/saved/${s.name}/${name}`, download: `${s.name}-${name}`, title: bytes(size) }, name))),
    make("code", { title: `state ${s.state_hash}` }, s.command))));
}

function renderWarnings() {
  if (!changed("warnings", state.warnings)) return;
  $("warned").hidden = state.warnings.length === 0;
  $("warnings").replaceChildren(...state.warnings.map((w) => make("li", {}, w)));
}

// --- curves ---

const chosen = [null, null, null]; // columns chosen by the user; null for the default of the scene
const WORDS = { dt: "time step (s)", power_error: "power balance", volume_error: "volume error", max_speed: "largest speed (m/s)" };

function title(column) {
  if (WORDS[column]) return WORDS[column];
  const round = state && state.run && state.run.round;
  if (column === "dissipation") return `dissipation (${round ? "W" : "W/m"})`;
  if (column.endsWith(" rate")) return `${column} (${round ? "m³" : "m²"}/s)`;
  if (column.endsWith(" volume")) return `${column} (${round ? "m³" : "m²"})`;
  return column;
}

const PLOT_EVERY = 300; // milliseconds
let plotted = 0;
let plotting = 0;
// Draws the curves, at most every PLOT_EVERY.
function renderPlots() {
  clearTimeout(plotting);
  plotting = setTimeout(drawPlots, Math.max(0, plotted + PLOT_EVERY - performance.now()));
}

function drawPlots() {
  plotted = performance.now();
  const live = state && state.run && curves.get(state.run.id);
  if (!live) return;
  const columns = live.columns.filter((c) => c !== "step" && c !== "time");
  const ending = (word) => columns.filter((c) => c.endsWith(word));
  const usual = [...ending(" rate"), ...ending(" volume"), ...ending("|n_x|"), "max_speed", "dissipation", "power_error"];
  if (changed("plots", columns) || $("plots").children.length === 0) {
    $("plots").replaceChildren(...chosen.map((wish, k) =>
      plotBox(`Curve ${k + 1}`, columns, title, columns.includes(wish) ? wish : usual[k], (column) => { chosen[k] = column; renderPlots(); })));
  }
  const runs = state.pins.map((p, k) => ({ name: p.name, color: color(k + 1), width: 1.3, curves: curves.get(p.id) }))
    .filter((r) => r.curves);
  runs.push({ name: "this run", color: color(0), width: 1.8, curves: live });
  const changes = state.run.changes.map((c) => c.time);
  [...$("plots").children].forEach((part) => plot(part.lastChild, part.firstChild.value, runs, changes));
}

// --- actions of the user ---

const toggle = () => send({ do: state && state.mode === "running" ? "pause" : "run" });
$("run").onclick = toggle;
$("step").onclick = () => send({ do: "step" });
$("restart").onclick = () => send({ do: "restart" });
$("stop").onclick = () => send({ do: "stop" });
$("view-light").onclick = () => chooseView("light");
$("view-rerun").onclick = () => chooseView("rerun");
$("live").onclick = () => { if (viewerReady) $("viewer").contentWindow.goLive(); };
$("quit").onclick = () => { if (confirm("End grainscope? Unsaved runs are lost.")) send({ do: "quit" }); };
$("scene").onchange = async (event) => {
  const answer = await send({ do: "load", scene: event.target.value });
  if (!answer.accepted) { seen.delete("scenes"); renderScenes(); }
};
$("reload").onclick = () => send({ do: "load", scene: $("scene").value });
$("pin").onsubmit = (event) => {
  event.preventDefault();
  const name = $("pin-name").value || $("pin-name").placeholder;
  send({ do: "pin", name }).then((a) => { if (a.accepted) $("pin-name").value = ""; });
};
$("save").onsubmit = (event) => {
  event.preventDefault();
  send({ do: "save", name: $("save-name").value || $("save-name").placeholder });
};

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const at = event.target;
  const typing = at.matches("input[type=text], form input, select, textarea");
  if (typing) return;
  // A control that has the focus handles the space bar itself.
  if (event.key === " " && at.matches("button, input, summary, a")) return;
  if (press(event.key)) event.preventDefault();
});

function press(key) {
  const keys = { " ": $("run"), s: $("step"), r: $("restart"), x: $("stop"), l: $("live") };
  if (key === "p") $("pin").requestSubmit();
  else if (keys[key]) keys[key].click();
  return key === "p" || key in keys;
}

window.addEventListener("message", (event) => {
  if (event.origin !== location.origin || !event.data || !event.data.viewer) return;
  if (event.data.viewer === "key") press(event.data.key);
  if (event.data.viewer === "ready") { viewerReady = true; showStream(); }
  if (event.data.viewer === "showing") { document.body.dataset.showing = event.data.recording; showView(); }
  if (event.data.viewer === "failed") { chooseView("light"); toast(`The Rerun viewer failed: ${event.data.why}`, false); }
});
window.addEventListener("resize", renderPlots);
showView();
listen();
