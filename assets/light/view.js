// This file is the light view: one or more runs side by side on a canvas, with a time slider and
// controls. It gets its runs from a source and draws them with painter.js.
"use strict";

const MOST_DECODED = 24; // frames of a run that are kept decoded
const PLAY_EVERY = 50; // milliseconds between frames when playing

// Makes an element.
function make(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

// The bytes of a text in base 64.
function bytesOf(text) { return Uint8Array.from(atob(text), (c) => c.charCodeAt(0)); }

class LightView {
  // `load(run, k)` gives the bytes of frame k of a run. Runs are {id, description, times}; the time
  // slider is that of the first one.
  constructor(element, load) {
    this.load = load;
    this.runs = [];
    this.decoded = new Map();
    this.look = { ...LOOK, dark: matchMedia("(prefers-color-scheme: dark)").matches };
    this.k = 0;
    this.following = true;
    this.ranges = {}; // ends of the colour scales of the frames shown so far, by field
    this.shown = null; // index of the frame on the canvas
    this.drawn = null; // called after each drawing
    this.build(element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => {
      this.look.dark = event.matches;
      this.redraw();
    });
    new ResizeObserver(() => this.redraw()).observe(this.canvas);
  }

  build(element) {
    this.canvas = make("canvas", { className: "light-canvas", tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    this.surface = new CanvasSurface(this.canvas);
    this.tip = make("div", { className: "light-tip", hidden: true });
    this.tip.setAttribute("role", "status");
    this.play = make("button", { type: "button", className: "light-play", onclick: () => this.togglePlay() }, "▶");
    this.play.setAttribute("aria-label", "Play");
    this.slider = make("input", { type: "range", min: 0, max: 0, step: 1, value: 0, ariaLabel: "Time" });
    this.slider.oninput = () => this.go(Number(this.slider.value));
    this.last = make("button", { type: "button", onclick: () => this.follow() }, "Latest");
    this.time = make("output", { className: "light-time" });
    this.colour = make("select", { ariaLabel: "Colour of the particles", onchange: () => this.set("colour", this.colour.value) });
    this.field = make("select", { ariaLabel: "Field behind the particles", onchange: () => this.set("field", this.field.value) });
    const layer = (key, name) => {
      const box = make("input", { type: "checkbox", checked: this.look[key], onchange: () => this.set(key, box.checked) });
      return make("label", {}, box, name);
    };
    this.layers = { particles: layer("particles", "particles"), dye: layer("dye", "dye"), strokes: layer("strokes", "directors"), gauges: layer("gauges", "gauges") };
    this.same = make("input", { type: "checkbox", checked: false, onchange: () => this.rescale() });
    const whole = make("button", { type: "button", title: "Show the whole domain", onclick: () => this.fit() }, "Fit");
    const picture = make("button", { type: "button", title: "Save this picture as PNG", onclick: () => this.save() }, "PNG");
    this.options = make("div", { className: "light-options" },
      make("label", {}, "colour ", this.colour), make("label", {}, "field ", this.field),
      ...Object.values(this.layers), make("label", { title: "One colour scale for the frames shown so far" }, this.same, "fixed scale"), whole, picture);
    element.append(
      make("div", { className: "light-stage" }, this.canvas, this.tip), this.options,
      make("div", { className: "light-bar" }, this.play, this.slider, this.time, this.last));
    this.listen();
  }

  // Takes the runs; the run with the time slider is the first. Frames already decoded are kept.
  update(runs) {
    const before = this.runs[0];
    this.runs = runs;
    const main = runs[0];
    if (!main) return;
    for (const id of this.decoded.keys()) if (!runs.some((r) => r.id === id)) this.decoded.delete(id);
    if (!before || before.id !== main.id) {
      this.k = 0;
      this.following = true;
      this.ranges = {};
    }
    const key = JSON.stringify([main.description.fields, main.description.gauges.length]);
    if (key !== this.key) {
      this.key = key;
      this.offer();
    }
    this.slider.max = String(Math.max(main.times.length - 1, 0));
    if (this.following) this.k = main.times.length - 1;
    this.k = Math.min(this.k, main.times.length - 1);
    this.redraw();
  }

  // Fills the lists with the fields of the runs.
  offer() {
    const fields = this.runs[0].description.fields.map((f) => f.name);
    const option = (value, text) => make("option", { value }, text);
    this.colour.replaceChildren(option("material", "material"), ...fields.map((f) => option(f, inWords(f))));
    this.field.replaceChildren(option("", "none"), ...fields.map((f) => option(f, inWords(f))));
    if (!fields.includes(this.look.colour)) this.look.colour = "material";
    if (!fields.includes(this.look.field)) this.look.field = "";
    [this.colour.value, this.field.value] = [this.look.colour, this.look.field];
    this.layers.gauges.hidden = this.runs[0].description.gauges.length === 0;
  }

  set(key, value) {
    this.look[key] = value;
    // A field is hidden by the particles in front of it.
    if (key === "field" && value) this.show("particles", false);
    if (key === "field" && !value) this.show("particles", true);
    if (key === "colour") this.show("particles", true);
    this.redraw();
  }

  show(key, on) {
    this.look[key] = on;
    this.layers[key].firstChild.checked = on;
  }

  rescale() {
    this.look.range = this.same.checked ? { ...this.ranges } : null;
    this.redraw();
  }

  go(k) {
    this.k = k;
    this.following = k === this.runs[0].times.length - 1;
    this.redraw();
  }

  follow() {
    this.following = true;
    if (this.runs[0]) this.go(this.runs[0].times.length - 1);
  }

  fit() {
    [this.look.zoom, this.look.centre] = [1, null];
    this.redraw();
  }

  togglePlay() {
    clearInterval(this.playing);
    const start = !this.playing;
    this.playing = 0;
    this.play.textContent = start ? "❚❚" : "▶";
    this.play.setAttribute("aria-label", start ? "Pause" : "Play");
    if (!start || !this.runs[0]) return;
    if (this.k >= this.runs[0].times.length - 1) this.go(0);
    this.playing = setInterval(() => {
      // A frame that is still being loaded is waited for.
      if (this.busy) return;
      if (this.k >= this.runs[0].times.length - 1) this.togglePlay();
      else this.go(this.k + 1);
    }, PLAY_EVERY);
  }

  // Index of the frame of a run at the time of the slider.
  indexOf(run) {
    const main = this.runs[0];
    if (run === main) return this.k;
    const time = main.times[this.k] * (1 + 1e-9);
    let k = 0;
    while (k + 1 < run.times.length && run.times[k + 1] <= time) k++;
    return k;
  }

  async frame(run, k) {
    if (!this.decoded.has(run.id)) this.decoded.set(run.id, new Map());
    const frames = this.decoded.get(run.id);
    const key = run.times[k];
    if (!frames.has(key)) {
      const bytes = await this.load(run, k);
      if (!bytes) return null;
      frames.set(key, decodeFrame(bytes, run.description));
      if (frames.size > MOST_DECODED) frames.delete(frames.keys().next().value);
    }
    return frames.get(key);
  }

  // Loads what is to be shown and draws it; requests during this are served by one more round.
  async redraw() {
    this.wanted = true;
    if (this.busy) return;
    this.busy = true;
    try {
      while (this.wanted) {
        this.wanted = false;
        const runs = this.runs;
        const k = this.k;
        if (!runs.length || k < 0) break;
        const frames = await Promise.all(runs.map((run) => this.frame(run, this.indexOf(run))));
        // What was loaded is shown even if there are newer frames by now.
        if (runs[0].id !== this.runs[0].id || frames.some((f) => !f)) continue;
        this.panels = runs.map((run, i) => ({ description: run.description, frame: frames[i], time: run.times[this.indexOf(run)] }));
        this.shown = k;
        this.draw();
        this.say();
      }
    } catch (_) {
      // The next state or touch causes another attempt.
    } finally {
      this.busy = false;
    }
  }

  // Draws the frames that were loaded last.
  draw() {
    if (!this.panels) return;
    const box = this.canvas.getBoundingClientRect();
    const unit = Math.min(window.devicePixelRatio || 1, 2);
    const [w, h] = [Math.max(1, Math.round(box.width * unit)), Math.max(1, Math.round(box.height * unit))];
    if (this.canvas.width !== w || this.canvas.height !== h) [this.canvas.width, this.canvas.height] = [w, h];
    this.unit = unit;
    const end = this.runs[0].times[this.runs[0].times.length - 1];
    for (const panel of this.panels) {
      panel.end = end;
      for (const field of Object.values(panel.frame.fields)) this.widen(field);
    }
    paintPanels(this.surface, this.panels, this.look, [w, h], unit);
    if (this.drawn) this.drawn();
  }

  widen(field) {
    const known = this.ranges[field.name];
    this.ranges[field.name] = known ? [Math.min(known[0], field.range[0]), Math.max(known[1], field.range[1])] : field.range;
  }

  // Updates the texts beside the picture.
  say() {
    const main = this.runs[0];
    const [name, seconds] = timeUnit(main.times[main.times.length - 1]);
    this.slider.value = String(this.k);
    const time = `${short(main.times[this.k] / seconds, 4)} ${name}`;
    this.time.textContent = time;
    this.slider.setAttribute("aria-valuetext", time);
    this.last.disabled = this.following;
    this.layers.strokes.hidden = !this.panels.some((p) => p.frame.strokes.length);
    this.layers.dye.hidden = !this.panels.some((p) => p.frame.lines.length);
    this.canvas.setAttribute("aria-label", `The flow at ${time}: ${this.runs.map((r) => r.description.name).join(", ")}`);
  }

  save() {
    this.canvas.toBlob((blob) => {
      const link = make("a", { href: URL.createObjectURL(blob), download: `${this.runs[0].description.name}-${this.k}.png` });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    });
  }

  // --- pointers and keys ---

  panelAt(X, Y) {
    return (this.panels || []).find(({ rect: [l, t, w, h] }) => X >= l && X < l + w && Y >= t && Y < t + h);
  }

  at(event) {
    const box = this.canvas.getBoundingClientRect();
    return [(event.clientX - box.left) * this.unit, (event.clientY - box.top) * this.unit];
  }

  zoom(factor, X, Y) {
    const panel = this.panelAt(X, Y);
    if (!panel) return;
    const before = [panel.place.x(X), panel.place.y(Y)];
    this.look.zoom = Math.min(Math.max(this.look.zoom * factor, 1), 200);
    if (this.look.zoom === 1) this.look.centre = null;
    else {
      this.look.centre = this.look.centre || middle(panel.description);
      const place = layout(panel.description, this.look, panel.rect, this.unit);
      this.look.centre = this.look.centre.map((c, i) => c + before[i] - [place.x(X), place.y(Y)][i]);
    }
    this.redraw();
  }

  pan(dx, dy) {
    const panel = this.panels && this.panels[0];
    if (!panel || this.look.zoom === 1) return;
    const [cx, cy] = this.look.centre || middle(panel.description);
    this.look.centre = [cx - dx / panel.place.scale, cy + dy / panel.place.scale];
    this.redraw();
  }

  hover(X, Y) {
    const panel = this.panelAt(X, Y);
    const tip = this.tip;
    tip.hidden = true;
    if (!panel) return;
    const { round } = panel.description;
    const [shown, y] = [panel.place.x(X), panel.place.y(Y)];
    const x = round ? Math.abs(shown) : shown;
    const [[x0, y0], [x1, y1]] = panel.description.domain;
    if (x < x0 || x > x1 || y < y0 || y > y1) return;
    const lines = [`${round ? "radius" : "x"} ${short(x, 4)} m, y ${short(y, 4)} m`];
    const near = nearest(panel.frame, x, y);
    if (near >= 0) lines.push(panel.description.materials[panel.frame.material[near]].name);
    for (const field of Object.values(panel.frame.fields)) {
      const sign = shown < 0 && round && field.name === "rotation" ? -1 : 1;
      const value = sign * fieldAt(field, panel.description, x, y);
      if (value === value) lines.push(`${inWords(field.name)} ${short(value)} ${field.unit}`);
    }
    tip.replaceChildren(...lines.map((line) => make("div", {}, line)));
    tip.hidden = false;
    const [left, top] = [X / this.unit, Y / this.unit];
    const right = left > 0.6 * this.canvas.clientWidth;
    tip.style.left = right ? "auto" : `${left + 14}px`;
    tip.style.right = right ? `${this.canvas.clientWidth - left + 10}px` : "auto";
    tip.style.top = `${Math.max(top - 10, 4)}px`;
  }

  listen() {
    const canvas = this.canvas;
    const touches = new Map();
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-0.0015 * event.deltaY), ...this.at(event));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      touches.set(event.pointerId, this.at(event));
    });
    canvas.addEventListener("pointermove", (event) => {
      const now = this.at(event);
      const before = touches.get(event.pointerId);
      if (!before) { this.hover(...now); return; }
      touches.set(event.pointerId, now);
      this.tip.hidden = true;
      const other = [...touches].find(([id]) => id !== event.pointerId);
      if (other) {
        const apart = ([a, b]) => Math.hypot(a - other[1][0], b - other[1][1]);
        this.zoom(apart(now) / Math.max(apart(before), 1), ...other[1]);
      } else {
        this.pan(now[0] - before[0], now[1] - before[1]);
      }
    });
    const end = (event) => touches.delete(event.pointerId);
    canvas.addEventListener("pointerup", end);
    canvas.addEventListener("pointercancel", end);
    canvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    canvas.addEventListener("dblclick", () => this.fit());
    canvas.addEventListener("keydown", (event) => {
      const middleOf = [0.5 * canvas.width, 0.5 * canvas.height];
      const far = 40 * this.unit;
      const keys = {
        "+": () => this.zoom(1.25, ...middleOf), "=": () => this.zoom(1.25, ...middleOf), "-": () => this.zoom(0.8, ...middleOf), 0: () => this.fit(),
        ArrowLeft: () => this.pan(far, 0), ArrowRight: () => this.pan(-far, 0), ArrowUp: () => this.pan(0, far), ArrowDown: () => this.pan(0, -far),
      };
      if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
      event.preventDefault();
      keys[event.key]();
    });
  }
}

function middle(description) {
  const [[x0, y0], [x1, y1]] = extent(description);
  return [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
}

// The particle that covers a point; -1 if there is none.
function nearest(frame, x, y) {
  let [best, least] = [-1, 1];
  for (let k = 0; k < frame.count; k++) {
    const far = ((frame.x[k] - x) ** 2 + (frame.y[k] - y) ** 2) / frame.radius[k] ** 2;
    if (far < least) [best, least] = [k, far];
  }
  return best;
}
