// This file is the scene editor of the page: the text, its errors, the picture of what it makes, and
// handles to drag in that picture. What is typed is checked by the program, beside the run.
"use strict";

const CHECK_AFTER = 250; // milliseconds after the last change

const scene = {
  editor: null,
  view: null, // the light view of the draft
  draft: null,
  kept: "", // the text that was opened or saved last
  savedName: null, // the file that was opened or saved last, and its version
  version: null,
  schema: null,
  waiting: 0,
  asked: 0, // number of the last check
};

async function editRequest(order) {
  const response = await post("api/editor", order);
  if (!response.ok) throw new Error(response.status === 413 ? "the text is too long" : "no answer");
  return response.json();
}

function fileName() { return $("editor-name").value.trim() || "my_scene.toml"; }

// --- opening and closing ---

// The editor is large, so it is loaded when it is needed.
function loadEditor() {
  if (window.SceneEditor) return Promise.resolve();
  return new Promise((done, failed) => document.head.append(make("script", { src: "editor.js", onload: done, onerror: failed })));
}

async function openEditor() {
  const id = $("scene").value;
  const response = await fetch(`api/scene/${encodeURIComponent(id)}`);
  if (!response.ok) { toast("this scene cannot be opened", false); return; }
  const opened = await response.json();
  await loadEditor();
  if (!scene.schema) scene.schema = await (await fetch("api/schema")).json();
  scene.kept = opened.text;
  scene.version = opened.version;
  scene.savedName = opened.version ? opened.name : null;
  $("editor-name").value = opened.version ? opened.name : `my_${opened.name.split(/[\\/]/).pop().replace(/\.toml$/, "")}.toml`;
  $("editor").hidden = false;
  $("draft").hidden = false;
  $("edit").setAttribute("aria-pressed", "true");
  document.querySelector("main").classList.add("editing");
  if (!scene.editor) {
    scene.editor = SceneEditor.createEditor({ parent: $("editor-text"), text: opened.text, changed: textChanged, entries, save: saveText });
    scene.view = new LightView($("draft"), async () => bytesOf(scene.draft.frame));
    scene.handles = draw("svg", { class: "handles", role: "group", "aria-label": "Parts that can be dragged" });
    $("draft").querySelector(".light-stage").append(scene.handles);
    $("draft").querySelector(".light-bar").hidden = true;
    scene.view.drawn = placeHandles;
  } else {
    scene.editor.setText(opened.text);
  }
  renderPlots();
  check();
  scene.editor.focus();
}

function closeEditor() {
  if (scene.editor.text() !== scene.kept && !confirm("Close the editor? The text is not saved.")) return;
  $("editor").hidden = true;
  $("draft").hidden = true;
  $("edit").setAttribute("aria-pressed", "false");
  document.querySelector("main").classList.remove("editing");
  renderPlots();
}

// --- checking ---

function textChanged() {
  clearTimeout(scene.waiting);
  scene.waiting = setTimeout(check, CHECK_AFTER);
  // The picture of the text is shown while it is edited.
  $("draft").hidden = false;
}

async function check() {
  const number = ++scene.asked;
  let found;
  try {
    found = await editRequest({ do: "check", name: fileName(), text: scene.editor.text() });
  } catch (e) {
    $("editor-says").replaceChildren(make("p", { className: "no" }, `The text is not checked: ${e.message}.`));
    return;
  }
  if (number !== scene.asked) return;
  showFaults(found.problem);
  if (!found.draft) return;
  scene.draft = found.draft;
  // Another description or frame is another run for the view.
  scene.view.update([{ id: number, description: found.draft.description, times: [0] }]);
  const { cells, unknowns, seconds_per_step: pace, effects, warnings } = found.draft;
  const cost = pace === null ? "" : `, about ${seconds(pace)} per step`;
  $("editor-says").replaceChildren(
    make("p", {}, `${cells[0]} × ${cells[1]} cells, ${count(unknowns, "unknown")}${cost}`),
    make("p", { className: "hint" }, `solved: ${effects.filter((e) => e.solved).map((e) => e.name).join(", ")}`),
    make("ul", {}, ...warnings.map((w) => make("li", {}, w))));
}

function showFaults(problem) {
  const faults = problem ? problem.faults : [];
  scene.editor.setFaults(faults.map((f) => ({
    line: f.line ? f.line[0] : 1,
    column: f.line ? f.line[1].length - f.line[1].trimStart().length : 0,
    message: f.remedy ? `${f.message}; ${f.remedy}` : f.message,
  })));
  if (!problem) return;
  $("editor-says").replaceChildren(make("ul", {}, ...faults.map((f) => {
    const line = f.line ? [make("button", { type: "button", onclick: () => scene.editor.goTo(f.line[0]) }, `line ${f.line[0]}`), ": "] : [];
    return make("li", { className: "no" }, ...line, f.message, f.remedy ? make("small", { className: "hint" }, f.remedy) : "");
  })));
}

// --- completion from the schema ---

// The keys that a table takes: [{label, detail, info}].
function entries(path) {
  const properties = propertiesOf(schemaAt(path));
  return Object.entries(properties).map(([label, part]) => {
    const meant = resolved(part);
    const facts = [["unit", part["x-unit"]], ["range", part["x-range"]], ["default", part["x-default"]]];
    const said = facts.filter(([, fact]) => fact && fact !== "1").map(([name, fact]) => `${name}: ${fact}`).join("; ");
    const meaning = (part.description || meant.description || "").replace(/\s+/g, " ").trim();
    const info = said ? `${meaning} (${said})` : meaning;
    const value = part.default === undefined || part.default === null ? "" : `default ${JSON.stringify(part.default)}`;
    return { label, detail: value, info };
  });
}

// A part of the schema without references.
function resolved(part) {
  let now = part;
  while (now && now.$ref) now = scene.schema.$defs[now.$ref.split("/").pop()];
  return now || {};
}

// All keys of a table, those of its alternatives too.
function propertiesOf(part) {
  const now = resolved(part);
  const all = { ...(now.properties || {}) };
  for (const other of [...(now.anyOf || []), ...(now.oneOf || []), ...(now.allOf || [])]) Object.assign(all, propertiesOf(other));
  return all;
}

function schemaAt(path) {
  let now = scene.schema;
  for (const name of path) {
    const all = propertiesOf(now);
    const whole = resolved(now);
    now = all[name] || (typeof whole.additionalProperties === "object" ? whole.additionalProperties : null);
    if (!now) return {};
    now = resolved(now);
    if (now.items) now = resolved(now.items);
  }
  return now;
}

// --- handles ---

// The place of a grip: a point, or the middle of all points along the component that does not move.
function gripPlace(points, { moves, along }) {
  const at = [...points[moves[0]]];
  if (along === null) return at;
  const other = 1 - along;
  at[other] = points.reduce((sum, point) => sum + point[other], 0) / points.length;
  return at;
}

function placeHandles() {
  if (!scene.draft || !scene.view.panels || scene.dragging) return;
  const { place } = scene.view.panels[0];
  const at = ([x, y]) => [place.X(x) / scene.view.unit, place.Y(y) / scene.view.unit];
  const parts = [];
  scene.draft.handles.forEach((handle) => {
    for (const grip of handle.grips) {
      const [x, y] = at(gripPlace(handle.points, grip));
      const where = gripPlace(handle.points, grip).map((v) => short(v, 4)).join(", ");
      const node = draw("circle", { class: "grip", cx: x, cy: y, r: handle.what === "gauge" ? 6 : 5, tabindex: 0, role: "button", "aria-label": `${handle.what} ${handle.name}, ${grip.name}: ${where} m; arrow keys move it` });
      node.append(draw("title", {}, `${handle.name}, ${grip.name}`));
      listenToGrip(node, handle, grip, place);
      parts.push(node);
    }
  });
  const focused = [...scene.handles.children].indexOf(document.activeElement);
  scene.handles.replaceChildren(...parts);
  if (focused >= 0 && parts[focused]) parts[focused].focus();
}

function listenToGrip(node, handle, grip, place) {
  const shifted = (dx, dy) => {
    const points = handle.points.map((point) => [...point]);
    for (const p of grip.moves) {
      if (grip.along !== 1) points[p][0] += dx;
      if (grip.along !== 0) points[p][1] += dy;
    }
    return points;
  };
  const pixel = scene.view.unit / place.scale; // metres of a pixel of the page
  let start = null;
  node.addEventListener("pointerdown", (event) => {
    node.setPointerCapture(event.pointerId);
    [start, scene.dragging] = [[event.clientX, event.clientY], true];
  });
  node.addEventListener("pointermove", (event) => {
    if (!start) return;
    const points = shifted((event.clientX - start[0]) * pixel, (start[1] - event.clientY) * pixel);
    const [x, y] = gripPlace(points, grip);
    node.setAttribute("cx", place.X(x) / scene.view.unit);
    node.setAttribute("cy", place.Y(y) / scene.view.unit);
  });
  const end = async (event) => {
    if (!start) return;
    const points = shifted((event.clientX - start[0]) * pixel, (start[1] - event.clientY) * pixel);
    [start, scene.dragging] = [null, false];
    await move(handle, points);
  };
  node.addEventListener("pointerup", end);
  node.addEventListener("pointercancel", () => { [start, scene.dragging] = [null, false]; placeHandles(); });
  node.addEventListener("keydown", async (event) => {
    const [[x0, y0], [x1, y1]] = scene.draft.description.domain;
    const step = Math.max(x1 - x0, y1 - y0) / 100;
    const by = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] }[event.key];
    if (!by) return;
    event.preventDefault();
    await move(handle, shifted(...by));
  });
}

async function move(handle, points) {
  try {
    const order = { id: handle.id, points };
    const { text, answer } = await editRequest({ do: "drag", text: scene.editor.text(), handle: order });
    toast(answer.message, answer.accepted);
    if (text) scene.editor.setText(text, true);
  } catch (e) {
    toast(`not moved: ${e.message}`, false);
  }
  placeHandles();
}

// --- running and saving ---

async function runText() {
  const answer = await send({ do: "try", name: fileName(), text: scene.editor.text() });
  if (answer.accepted) $("draft").hidden = true;
}

async function saveText() {
  const text = scene.editor.text();
  const known = fileName() === scene.savedName ? scene.version : null;
  try {
    const { answer, version } = await editRequest({ do: "write", name: fileName(), text, version: known });
    toast(answer.message + (answer.remedy ? ` — ${answer.remedy}` : ""), answer.accepted);
    if (!version) return;
    [scene.version, scene.kept, scene.savedName] = [version, text, fileName()];
    send({ do: "list" });
  } catch (e) {
    toast(`not saved: ${e.message}`, false);
  }
}

$("edit").onclick = () => ($("editor").hidden ? openEditor() : closeEditor());
$("editor-bar").onsubmit = (event) => { event.preventDefault(); runText(); };
$("editor-save").onclick = saveText;
$("editor-revert").onclick = () => scene.editor.setText(scene.kept, true);
window.addEventListener("beforeunload", (event) => {
  if (scene.editor && !$("editor").hidden && scene.editor.text() !== scene.kept) event.preventDefault();
});
