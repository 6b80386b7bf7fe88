// This file draws a frame on a surface: a canvas in pages, an image in films.
//
// A surface has these functions; lengths are in pixels of the surface, y down, colours CSS texts:
//   fill(x, y, w, h, colour)                 a rectangle
//   clip(x, y, w, h), unclip()               restricts what follows to a rectangle
//   cover(x, y, radius, paint, colours)      like discs, with the gaps between neighbouring discs
//                                            filled
//   discs(x, y, radius, paint, colours)      arrays of centres and radii; the disc k has the colour
//                                            colours[3 paint[k]], ... (red, green, blue)
//   image(rgba, nx, ny, x, y, w, h)          an image, smoothly scaled; its first row is on top
//   line(points, width, colour)              a polyline x, y, x, y, ...
//   segments(points, width, colour)          lines x, y, x, y between pairs of points
//   text(text, x, y, size, colour, anchor)   anchor: "start", "middle" or "end"; y: the base line
//   measure(text, size)                      the width of a text
"use strict";

const THEMES = {
  light: { ground: "#ffffff", paper: "#f5f5f2", ink: "#1d2430", soft: "#5c6675", wall: "#26262a", dye: "#14141e", gauges: ["#b04a00", "#0b5c96", "#00694d", "#97407a", "#6a5a00", "#4b4fb5"] },
  dark: { ground: "#1c2027", paper: "#14171c", ink: "#e6e9ee", soft: "#9aa4b2", wall: "#d5d9e0", dye: "#e8eaf0", gauges: ["#ff9b4d", "#62b5f0", "#3fcf9f", "#e9a0c9", "#e6cf3c", "#a9acff"] },
};

// What is drawn. `colour` is "material" or the name of a field; `field` the name of a field behind
// the particles, or "". `centre` (m) and `zoom` choose the part of the domain; `centre` null is all.
const LOOK = { dark: false, particles: true, colour: "material", field: "", dye: true, strokes: true, gauges: true, zoom: 1, centre: null, range: null };

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

// The name of a field in words.
function inWords(name) {
  return name.replace(/_/g, " ");
}

// The unit in which times up to `end` (s) are shown: [name, seconds].
function timeUnit(end) {
  const units = [["µs", 1e-6], ["ms", 1e-3], ["s", 1], ["min", 60], ["h", 3600], ["d", 86400], ["a", 31557600]];
  let fit = units[0];
  for (const unit of units) if (end >= (unit[1] < 60 ? unit[1] : 3 * unit[1])) fit = unit;
  return end > 0 ? fit : units[2];
}

// Returns about `count` round numbers within a range, for the ticks of an axis.
function ticks(low, high, count) {
  if (!(high > low)) return [low];
  const step0 = (high - low) / count;
  const power = 10 ** Math.floor(Math.log10(step0));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= step0 * 0.999);
  const list = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) list.push(k * step);
  return list;
}

// The corners of what is shown: the domain, and its mirror image if x is the distance from an axis.
function extent({ domain: [[x0, y0], [x1, y1]], round }) {
  return [[round ? -x1 : x0, y0], [x1, y1]];
}

// The place of a picture in a rectangle of the surface: {box, scale, X, Y, x, y}; X and Y map metres
// to pixels, x and y back.
function layout(description, look, [left, top, width, height], unit) {
  const [[x0, y0], [x1, y1]] = extent(description);
  const box = [left + 52 * unit, top + 30 * unit, Math.max(width - 64 * unit, 10), Math.max(height - 100 * unit, 10)];
  const whole = Math.min(box[2] / (x1 - x0), box[3] / (y1 - y0));
  const scale = whole * look.zoom;
  const [cx, cy] = look.centre || [0.5 * (x0 + x1), 0.5 * (y0 + y1)];
  // The frame is as large as the domain or, when zoomed, as the space that there is.
  const w = Math.min(box[2], (x1 - x0) * scale);
  const h = Math.min(box[3], (y1 - y0) * scale);
  const frame = [box[0] + 0.5 * (box[2] - w), box[1] + 0.5 * (box[3] - h), w, h];
  const [mx, my] = [frame[0] + 0.5 * w, frame[1] + 0.5 * h];
  return {
    frame, scale,
    X: (x) => mx + scale * (x - cx), Y: (y) => my - scale * (y - cy),
    x: (X) => cx + (X - mx) / scale, y: (Y) => cy - (Y - my) / scale,
  };
}

// The colours of a field and the ends of its scale.
function scaleOf(field, description, look) {
  const range = (look.range && look.range[field.name]) || field.range;
  const reach = Math.max(Math.abs(range[0]), Math.abs(range[1]));
  const ends = field.signed ? [-reach, reach] : range;
  return { ends, palette: field.signed ? description.signed_palette : description.palette };
}

// Index into the 256 colours of a scale.
function shade(value, [low, high]) {
  if (!(high > low)) return 128;
  return Math.max(0, Math.min(255, Math.round((255 * (value - low)) / (high - low))));
}

// The colours of a field, or of its mirror image, in which rotations have the other sign.
function fieldImage(field, description, look, mirrored) {
  const { ends, palette } = scaleOf(field, description, look);
  const { nx, ny, values } = field;
  const sign = mirrored && field.name === "rotation" ? -1 : 1;
  const rgba = new Uint8Array(4 * nx * ny);
  for (let j = 0; j < ny; j++) {
    for (let i = 0; i < nx; i++) {
      const value = sign * values[(ny - 1 - j) * nx + (mirrored ? nx - 1 - i : i)];
      if (value !== value) continue;
      const [c, to] = [3 * shade(value, ends), 4 * (j * nx + i)];
      rgba[to] = palette[c]; rgba[to + 1] = palette[c + 1]; rgba[to + 2] = palette[c + 2]; rgba[to + 3] = 255;
    }
  }
  return rgba;
}

// Draws one frame into a rectangle [left, top, width, height] of a surface. `moment` is {time, end}
// in seconds; `unit` the number of pixels of a pixel of text. Returns the layout.
function paint(surface, description, frame, moment, look, rect, unit) {
  const theme = look.dark ? THEMES.dark : THEMES.light;
  const place = layout(description, look, rect, unit);
  const { X, Y, scale } = place;
  const [fx, fy, fw, fh] = place.frame;
  const [[x0, y0], [x1, y1]] = description.domain;
  const sides = description.round ? [X, (x) => X(-x)] : [X];
  surface.fill(...rect, theme.ground);
  surface.fill(fx, fy, fw, fh, theme.paper);
  surface.clip(fx, fy, fw, fh);
  const behind = frame.fields[look.field];
  if (behind) {
    for (const [k, side] of sides.entries()) {
      const mirrored = k === 1;
      surface.image(fieldImage(behind, description, look, mirrored), behind.nx, behind.ny, side(mirrored ? x1 : x0), Y(y1), scale * (x1 - x0), scale * (y1 - y0));
    }
  }
  if (look.particles) paintParticles(surface, description, frame, look, place);
  for (const side of sides) {
    if (look.dye) for (const line of frame.lines) surface.line(map(line, side, Y), 1 * unit, theme.dye);
    if (look.strokes && frame.strokes.length) surface.segments(map(frame.strokes, side, Y), 1.2 * unit, theme.dye);
  }
  surface.unclip();
  surface.clip(fx - 2 * unit, fy - 2 * unit, fw + 4 * unit, fh + 4 * unit);
  for (const side of sides) {
    for (const wall of description.walls) surface.line(map(wall.points.flat(), side, Y), 2.5 * unit, theme.wall);
    for (const outline of frame.moving) surface.line(map(outline, side, Y), 2.5 * unit, theme.wall);
    if (look.gauges) for (const [k, gauge] of description.gauges.entries()) surface.line(map(gauge.points.flat(), side, Y), 3 * unit, gaugeColour(theme, k));
  }
  surface.unclip();
  paintAxes(surface, place, description, theme, unit);
  // Title and key are as wide as the picture, or wider if it is narrow.
  const beside = { left: fx, right: fw > 260 * unit ? fx + fw : rect[0] + rect[2] - 12 * unit, top: rect[1], bottom: rect[1] + rect[3] };
  paintHead(surface, description, moment, beside, theme, unit);
  paintKey(surface, description, frame, look, beside, place, theme, unit);
  return place;
}

function map(points, X, Y) {
  const out = new Float32Array(points.length);
  for (let k = 0; k < points.length; k += 2) {
    out[k] = X(points[k]);
    out[k + 1] = Y(points[k + 1]);
  }
  return out;
}

function paintParticles(surface, description, frame, look, place) {
  const mirrored = description.round ? [false, true] : [false];
  // One drawing of both halves of a round flow fills gaps at the axis.
  const discs = mirrored.map((m) => discsOf(frame, place, m));
  const [x, y, r] = [0, 1, 2].map((c) => Float32Array.from(discs.flatMap((list) => list[c])));
  const draw = (colours, shades) => {
    const paint = Uint8Array.from(discs.flatMap(([, , , of], m) => of.map((k) => shades[m][k])));
    // Particles in stretched flow leave gaps in rows, which are no structure of the flow.
    surface.cover(x, y, r, paint, colours);
    surface.discs(x, y, r, paint, colours);
  };
  const field = frame.fields[look.colour];
  if (!field) {
    draw(description.materials.flatMap((m) => m.rgb), mirrored.map(() => frame.material));
    return;
  }
  const { ends, palette } = scaleOf(field, description, look);
  const shadesOf = (sign) => {
    const shades = new Uint8Array(frame.count);
    for (let k = 0; k < frame.count; k++) {
      // Particles at the edge of a field have a value.
      const value = sign * fieldAt(field, description, frame.x[k], frame.y[k], 1e-3);
      shades[k] = value === value ? shade(value, ends) : 128;
    }
    return shades;
  };
  draw(palette, mirrored.map((m) => shadesOf(m && field.name === "rotation" ? -1 : 1)));
}

// The discs of the particles on the surface: x, y, radius, and the particle of each disc. A particle has one
// disc, and in a column a row of discs across it, up to nine tenths of halfway to the next column.
function discsOf(frame, { X, Y, scale }, mirrored) {
  const [x, y, r, of] = [[], [], [], []];
  const [ox, oy] = [X(0), Y(0)];
  const side = mirrored ? -scale : scale;
  for (let k = 0; k < frame.count; k++) {
    const radius = frame.radius[k];
    const rows = frame.others[k];
    const reach = rows ? Math.max((0.9 * Math.sqrt(Math.PI) * (rows + 1)) / 4 - 1, 0) : 0;
    const half = Math.ceil(reach);
    const angle = (Math.PI / 32) * frame.across[k];
    const step = half ? (reach / half) * radius : 0;
    const [dx, dy] = [step * Math.cos(angle), step * Math.sin(angle)];
    for (let n = -half; n <= half; n++) {
      x.push(ox + side * (frame.x[k] + n * dx));
      y.push(oy - scale * (frame.y[k] + n * dy));
      r.push(scale * radius);
      of.push(k);
    }
  }
  return [x, y, r, of];
}

function paintAxes(surface, place, { round }, theme, unit) {
  const [fx, fy, fw, fh] = place.frame;
  const size = 11 * unit;
  const border = [fx, fy, fx + fw, fy, fx + fw, fy + fh, fx, fy + fh, fx, fy];
  surface.line(new Float32Array(border), unit, theme.soft);
  const across = ticks(place.x(fx), place.x(fx + fw), Math.max(2, Math.min(6, fw / (70 * unit))));
  const up = ticks(place.y(fy + fh), place.y(fy), Math.max(2, Math.min(6, fh / (60 * unit))));
  const marks = [];
  for (const v of across) {
    marks.push(place.X(v), fy + fh, place.X(v), fy + fh + 4 * unit);
    surface.text(short(round ? Math.abs(v) : v, 4), place.X(v), fy + fh + 15 * unit, size, theme.soft, "middle");
  }
  for (const v of up) {
    marks.push(fx - 4 * unit, place.Y(v), fx, place.Y(v));
    surface.text(short(v, 4), fx - 7 * unit, place.Y(v) + 4 * unit, size, theme.soft, "end");
  }
  surface.segments(new Float32Array(marks), unit, theme.soft);
  surface.text(round ? "radius (m)" : "x (m)", fx + 0.5 * fw, fy + fh + 29 * unit, size, theme.soft, "middle");
  surface.text("y (m)", fx - 7 * unit, fy - 8 * unit, size, theme.soft, "end");
}

function paintHead(surface, description, moment, { left, right, top }, theme, unit) {
  const size = 13 * unit;
  const [name, seconds] = timeUnit(moment.end);
  const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(Math.max(moment.end, 1e-300) / seconds) + 1e-9)));
  const time = `t = ${moment.end > 0 ? (moment.time / seconds).toFixed(digits) : 0} ${name}`;
  surface.text(time, right, top + 18 * unit, size, theme.ink, "end");
  const room = right - left - 12 * unit - surface.measure(time, size);
  let title = description.name;
  for (let n = title.length - 1; n > 0 && surface.measure(title, size) > room; n--) title = `${description.name.slice(0, n)}…`;
  if (surface.measure(title, size) <= room) surface.text(title, left, top + 18 * unit, size, theme.ink, "start");
}

// Colour of gauge k in its line and in the key.
function gaugeColour(theme, k) {
  return theme.gauges[k % theme.gauges.length];
}

// Draws what the colours mean below the picture: a colour bar, or materials and gauges.
function paintKey(surface, description, frame, look, { left, right, bottom }, place, theme, unit) {
  const size = 11 * unit;
  const y = Math.min(bottom - 30 * unit, place.frame[1] + place.frame[3] + 42 * unit);
  const field = frame.fields[look.field] || (look.particles && frame.fields[look.colour]);
  const entries = [];
  if (!frame.fields[look.colour] && look.particles) {
    const shown = description.materials.filter((m) => m.drawn);
    if (shown.length > 1 || !field) entries.push(...shown.map((m) => [m.name, `rgb(${m.rgb.join(",")})`, 5]));
  }
  if (look.gauges) entries.push(...description.gauges.map((g, k) => [g.name, gaugeColour(theme, k), 1.5]));
  let x = left;
  const end = right;
  if (field) {
    const { ends, palette } = scaleOf(field, description, look);
    const length = Math.min(220 * unit, 0.6 * (end - x));
    const bar = new Uint8Array(4 * 256).fill(255);
    for (let k = 0; k < 256; k++) for (let c = 0; c < 3; c++) bar[4 * k + c] = palette[3 * k + c];
    surface.image(bar, 256, 1, x, y, length, 8 * unit);
    const title = field.unit ? `${inWords(field.name)} (${field.unit})` : inWords(field.name);
    surface.text(short(ends[0]), x, y + 20 * unit, size, theme.soft, "start");
    surface.text(title, x + 0.5 * length, y + 20 * unit, size, theme.ink, "middle");
    surface.text(short(ends[1]), x + length, y + 20 * unit, size, theme.soft, "end");
    x += length + 18 * unit;
  }
  for (const [name, colour, half] of entries) {
    const wide = 20 * unit + surface.measure(name, size) + 14 * unit;
    if (x + wide > end + 14 * unit) break;
    surface.fill(x, y + (5 - half) * unit, 14 * unit, 2 * half * unit, colour);
    surface.text(name, x + 20 * unit, y + 9 * unit, size, theme.ink, "start");
    x += wide;
  }
}

// Columns and rows of n pictures in which the pictures are largest.
function grid(n, w, h, description) {
  const [[x0, y0], [x1, y1]] = extent(description);
  let best = [1, n, 0];
  for (let columns = 1; columns <= n; columns++) {
    const rows = Math.ceil(n / columns);
    const scale = Math.min(w / columns / (x1 - x0), h / rows / (y1 - y0));
    if (scale > best[2]) best = [columns, rows, scale];
  }
  return best;
}

// Draws several runs beside each other. A panel is {description, frame, time, end}; it gets `rect`,
// its rectangle, and `place`, the layout of its picture.
function paintPanels(surface, panels, look, [w, h], unit) {
  const [columns, rows] = grid(panels.length, w, h, panels[0].description);
  panels.forEach((panel, i) => {
    panel.rect = [(i % columns) * (w / columns), Math.floor(i / columns) * (h / rows), w / columns, h / rows];
    panel.place = paint(surface, panel.description, panel.frame, panel, look, panel.rect, unit);
  });
}
