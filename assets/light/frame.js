// This file decodes packed frames. The format is described in src/light/pack.rs.
"use strict";

// Reads numbers from the bytes of a frame, one after the other.
class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }
  u16() { this.at += 2; return this.view.getUint16(this.at - 2, true); }
  u32() { this.at += 4; return this.view.getUint32(this.at - 4, true); }
  f32() { this.at += 4; return this.view.getFloat32(this.at - 4, true); }
  take(count) { this.at += count; return this.bytes.subarray(this.at - count, this.at); }
  // Numbers stored as differences: high bytes, then low bytes; `stride` sequences in turn.
  differences(count, stride) {
    const [high, low] = [this.take(count), this.take(count)];
    const values = new Uint16Array(count);
    for (let k = 0; k < count; k++) {
      const code = (high[k] << 8) | low[k];
      const before = k < stride ? 0 : values[k - stride];
      values[k] = before + ((code >>> 1) ^ -(code & 1));
    }
    return values;
  }
}

const NO_VALUE = 4095;
const FIELD_STEPS = 4094;
const RADIUS_STEPS = 8;

// The content of a frame, in metres: {count, x, y, material, radius (of each particle), others (number of
// others in the column of a particle, see src/light/columns.rs), across (angle of the direction across the
// column, in 32nds of half a turn), lines (flat arrays x, y, x, y, ...), strokes (x, y of both ends in
// turn), fields (by name), moving (outlines of solids that move, as lines)}.
function decodeFrame(bytes, description) {
  const r = new Reader(bytes);
  const [count, lineCount, pointCount, strokeCount, fieldCount] = [r.u32(), r.u32(), r.u32(), r.u32(), r.u32()];
  const [[x0, y0], [x1, y1]] = description.domain;
  const [sx, sy] = [(x1 - x0) / 65535, (y1 - y0) / 65535];
  const size = Math.max(x1 - x0, y1 - y0);
  const [rows, columns, lowY, lowX] = [r.take(count), r.take(count), r.take(count), r.take(count)];
  const material = r.take(count);
  const sizes = r.take(count);
  const [others, across] = [r.take(count), r.take(count)];
  const radii = new Float32Array(256);
  for (let k = 0; k < 256; k++) radii[k] = size * 2 ** (-k / RADIUS_STEPS);
  const [x, y, radius] = [new Float32Array(count), new Float32Array(count), new Float32Array(count)];
  let [row, column] = [0, 0];
  for (let k = 0; k < count; k++) {
    row = (row + rows[k]) & 255;
    column = (column + columns[k]) & 255;
    x[k] = x0 + sx * ((column << 8) | lowX[k]);
    y[k] = y0 + sy * ((row << 8) | lowY[k]);
    radius[k] = radii[sizes[k]];
  }
  const lengths = [];
  for (let k = 0; k < lineCount; k++) lengths.push(r.u32());
  const points = (n) => {
    const steps = r.differences(2 * n, 2);
    const places = new Float32Array(2 * n);
    for (let k = 0; k < 2 * n; k += 2) {
      places[k] = x0 + sx * steps[k];
      places[k + 1] = y0 + sy * steps[k + 1];
    }
    return places;
  };
  const dye = points(pointCount);
  let start = 0;
  const lines = lengths.map((n) => dye.subarray(2 * start, 2 * (start += n)));
  const strokes = points(2 * strokeCount);
  const fields = {};
  for (let f = 0; f < fieldCount; f++) {
    const [index, nx, ny] = [r.u16(), r.u16(), r.u16(), r.u16()];
    const [low, high, bottom, top] = [r.f32(), r.f32(), r.f32(), r.f32()];
    const at = r.at;
    r.take(2 * nx * ny);
    // Most fields are not shown: values are decoded when they are needed.
    let values = null;
    fields[description.fields[index].name] = {
      ...description.fields[index], nx, ny, range: [bottom, top],
      get values() {
        if (!values) {
          const part = new Reader(bytes);
          part.at = at;
          const steps = part.differences(nx * ny, 1);
          values = new Float32Array(nx * ny);
          for (let k = 0; k < steps.length; k++) values[k] = steps[k] === NO_VALUE ? NaN : low + ((high - low) * steps[k]) / FIELD_STEPS;
        }
        return values;
      },
    };
  }
  const moving = [];
  for (let left = r.u32(); left > 0; left--) {
    const outline = new Float32Array(2 * r.u32());
    for (let k = 0; k < outline.length; k++) outline[k] = r.f32();
    moving.push(outline);
  }
  return { count, x, y, material, radius, others, across, lines, strokes, fields, moving };
}

// The value of a field at a point (m) by bilinear interpolation between the centres of its samples;
// NaN outside, and where samples with a value have less than `least` of the weight.
function fieldAt(field, description, px, py, least = 0.5) {
  const [[x0, y0], [x1, y1]] = description.domain;
  const { nx, ny, values } = field;
  if (px < x0 || px > x1 || py < y0 || py > y1) return NaN;
  const tx = Math.min(Math.max(((px - x0) / (x1 - x0)) * nx - 0.5, 0), nx - 1);
  const ty = Math.min(Math.max(((py - y0) / (y1 - y0)) * ny - 0.5, 0), ny - 1);
  const [i, j] = [Math.min(Math.floor(tx), Math.max(nx - 2, 0)), Math.min(Math.floor(ty), Math.max(ny - 2, 0))];
  const [s, t] = [tx - i, ty - j];
  let [sum, total] = [0, 0];
  for (let b = 0; b < 2; b++) {
    for (let a = 0; a < 2; a++) {
      const value = values[Math.min(j + b, ny - 1) * nx + Math.min(i + a, nx - 1)];
      const weight = (a ? s : 1 - s) * (b ? t : 1 - t);
      if (value === value) { sum += weight * value; total += weight; }
    }
  }
  return total >= least ? sum / total : NaN;
}
