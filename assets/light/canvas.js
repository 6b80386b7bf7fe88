// This file is the surface of pages: a canvas. Discs are drawn with WebGL 2 where a graphics card
// does it, and otherwise into the pixels of an image, which is faster than WebGL in software.
"use strict";

const FONT = 'system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif';

// The name of the graphics card that draws WebGL; "" if there is none, or as long as it is unknown.
let graphicsCard = "";

// Looks for a graphics card, beside the page: to start a program that imitates one takes seconds.
// `found` is called if there is one.
function lookForCard(found) {
  const look = `const gl = new OffscreenCanvas(1, 1).getContext("webgl2", { failIfMajorPerformanceCaveat: true });
    const info = gl && gl.getExtension("WEBGL_debug_renderer_info");
    postMessage(gl ? gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER) : "");`;
  try {
    const worker = new Worker(URL.createObjectURL(new Blob([look], { type: "text/javascript" })));
    worker.onmessage = (event) => {
      worker.terminate();
      graphicsCard = /swiftshader|llvmpipe|softpipe|software|basic render/i.test(event.data) ? "" : event.data;
      if (graphicsCard) found();
    };
  } catch (_) {
    // Without workers there is no search; the page draws without a card.
  }
}

// The drawing context of a canvas in memory: a canvas that is drawn by an imitated card is slower by
// far.
function penOf(canvas) { return canvas.getContext("2d", { willReadFrequently: true }); }

class CanvasSurface {
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = penOf(canvas);
    this.box = [0, 0, 0, 0];
    this.scratch = null;
    this.discPainter = null;
    this.coverPainter = null;
  }

  fill(x, y, w, h, colour) { this.pen.fillStyle = colour; this.pen.fillRect(x, y, w, h); }

  clip(x, y, w, h) {
    this.pen.save();
    this.pen.beginPath();
    this.pen.rect(x, y, w, h);
    this.pen.clip();
    this.box = [x, y, w, h];
  }
  unclip() { this.pen.restore(); }

  chooseDiscPainter() {
    this.discPainter = new PixelDiscs();
    this.cardTried = Boolean(graphicsCard);
    if (!graphicsCard) return;
    try {
      this.discPainter = new GlDiscs();
    } catch (_) {
      // The pixels do it.
    }
  }

  cover(x, y, radius, paint, colours) {
    const [left, top, w, h] = this.box;
    if (!this.coverPainter) this.coverPainter = new Cover();
    const image = this.coverPainter.draw(left, top, w, h, x, y, radius, paint, colours);
    this.pen.imageSmoothingEnabled = true;
    this.pen.drawImage(image, left, top, w, h);
  }

  discs(x, y, radius, paint, colours) {
    const left = Math.floor(this.box[0]);
    const top = Math.floor(this.box[1]);
    const w = Math.max(1, Math.ceil(this.box[0] + this.box[2]) - left);
    const h = Math.max(1, Math.ceil(this.box[1] + this.box[3]) - top);
    if (!this.discPainter || (graphicsCard && !this.cardTried)) this.chooseDiscPainter();
    let image = this.discPainter.draw(left, top, w, h, x, y, radius, paint, colours);
    if (!image) {
      this.discPainter = new PixelDiscs();
      image = this.discPainter.draw(left, top, w, h, x, y, radius, paint, colours);
    }
    this.pen.drawImage(image, 0, 0, w, h, left, top, w, h);
  }

  image(rgba, nx, ny, x, y, w, h) {
    if (!this.scratch) this.scratch = document.createElement("canvas");
    [this.scratch.width, this.scratch.height] = [nx, ny];
    penOf(this.scratch).putImageData(new ImageData(new Uint8ClampedArray(rgba.buffer), nx, ny), 0, 0);
    this.pen.imageSmoothingEnabled = true;
    this.pen.imageSmoothingQuality = "high";
    this.pen.drawImage(this.scratch, x, y, w, h);
  }

  line(points, width, colour) {
    if (points.length < 4) return;
    const pen = this.pen;
    [pen.strokeStyle, pen.lineWidth, pen.lineJoin, pen.lineCap] = [colour, width, "round", "round"];
    pen.beginPath();
    pen.moveTo(points[0], points[1]);
    for (let k = 2; k < points.length; k += 2) pen.lineTo(points[k], points[k + 1]);
    pen.stroke();
  }

  segments(points, width, colour) {
    const pen = this.pen;
    [pen.strokeStyle, pen.lineWidth, pen.lineCap] = [colour, width, "butt"];
    pen.beginPath();
    for (let k = 0; k + 3 < points.length; k += 4) {
      pen.moveTo(points[k], points[k + 1]);
      pen.lineTo(points[k + 2], points[k + 3]);
    }
    pen.stroke();
  }

  text(text, x, y, size, colour, anchor) {
    const pen = this.pen;
    [pen.font, pen.fillStyle, pen.textAlign] = [`${size}px ${FONT}`, colour, { start: "left", middle: "center", end: "right" }[anchor]];
    pen.fillText(text, x, y);
  }

  measure(text, size) { this.pen.font = `${size}px ${FONT}`; return this.pen.measureText(text).width; }
}

// Draws discs into the pixels of an image.
class PixelDiscs {
  constructor() {
    this.canvas = document.createElement("canvas");
    this.spans = []; // rows of a disc by four times its radius: [offset, half-width] in turn
  }

  rows(quarters) {
    if (!this.spans[quarters]) {
      const r = quarters / 4;
      const rows = [];
      for (let dy = -Math.floor(r); dy <= r; dy++) rows.push(dy, Math.floor(Math.sqrt(r * r - dy * dy)));
      this.spans[quarters] = Int32Array.from(rows);
    }
    return this.spans[quarters];
  }

  // `depth`: if given, `this.depths` becomes the depth of the disc that is drawn on each pixel.
  draw(left, top, w, h, x, y, radius, paint, colours, depth = null) {
    if (depth) this.depths = new Float32Array(w * h);
    if (this.canvas.width !== w || this.canvas.height !== h) {
      [this.canvas.width, this.canvas.height] = [w, h];
      this.pen = penOf(this.canvas);
      this.data = this.pen.createImageData(w, h);
      this.pixels = new Uint32Array(this.data.data.buffer);
    }
    const pixels = this.pixels;
    pixels.fill(0);
    const words = new Uint32Array(colours.length / 3);
    for (let k = 0; k < words.length; k++) words[k] = (255 << 24) | (colours[3 * k + 2] << 16) | (colours[3 * k + 1] << 8) | colours[3 * k];
    for (let k = 0; k < x.length; k++) {
      const cx = Math.round(x[k] - left - 0.5);
      const cy = Math.round(y[k] - top - 0.5);
      const reach = radius[k] + 1;
      if (cx < -reach || cy < -reach || cx > w + reach || cy > h + reach) continue;
      const word = words[paint[k]];
      const rows = this.rows(Math.round(4 * Math.max(radius[k], 0.5)));
      for (let n = 0; n < rows.length; n += 2) {
        const row = cy + rows[n];
        if (row < 0 || row >= h) continue;
        const start = row * w + Math.max(cx - rows[n + 1], 0);
        const stop = row * w + Math.min(cx + rows[n + 1] + 1, w);
        for (let at = start; at < stop; at++) pixels[at] = word;
        if (depth) this.depths.fill(depth[k], start, Math.max(start, stop));
      }
    }
    this.pen.putImageData(this.data, 0, 0);
    return this.canvas;
  }
}

// Radii to which gaps between discs are filled: the mean radius, or that of the disc if it is larger.
const GROWTH = 2.4;

// Draws discs with the gaps between neighbours filled, on an image of half the size: what is nearer to a
// disc than GROWTH radii, less what is then nearer to the outside than this.
class Cover {
  constructor() { this.drawn = new PixelDiscs(); }

  draw(left, top, w, h, x, y, radius, paint, colours) {
    const [nx, ny] = [Math.max(1, Math.ceil(0.5 * w)), Math.max(1, Math.ceil(0.5 * h))];
    const n = x.length;
    const [X, Y, R, depth] = [new Float32Array(n), new Float32Array(n), new Float32Array(n), new Float32Array(n)];
    let sum = 0;
    for (let k = 0; k < n; k++) sum += 0.5 * radius[k];
    const mean = sum / Math.max(n, 1);
    for (let k = 0; k < n; k++) {
      [X[k], Y[k], R[k]] = [0.5 * (x[k] - left), 0.5 * (y[k] - top), 0.5 * radius[k]];
      depth[k] = GROWTH * Math.max(R[k], mean);
    }
    const image = this.drawn.draw(0, 0, nx, ny, X, Y, R, paint, colours, depth);
    const { pixels, depths } = this.drawn;
    const [far, source] = [new Uint16Array(nx * ny), new Uint32Array(nx * ny)];
    for (let k = 0; k < far.length; k++) [far[k], source[k]] = [pixels[k] ? 0 : FAR, k];
    spread(nx, ny, far, source);
    const inside = new Uint16Array(nx * ny);
    for (let k = 0; k < far.length; k++) inside[k] = far[k] < FAR && far[k] <= 3 * depths[source[k]] ? FAR : 0;
    spread(nx, ny, inside, new Uint32Array(nx * ny));
    for (let k = 0; k < far.length; k++) {
      if (far[k] > 0 && inside[k] > 3 * depths[source[k]]) pixels[k] = pixels[source[k]];
    }
    this.drawn.pen.putImageData(this.drawn.data, 0, 0);
    return image;
  }
}

const FAR = 30000; // distance of pixels for which none is known

// Spreads distances, and the pixels from which they are measured. Distances are sums of steps to neighbours,
// of length 3 along the axes and 4 along diagonals, in thirds of a pixel.
function spread(nx, ny, far, source) {
  const relax = (k, near, step) => {
    if (far[near] + step < far[k]) {
      far[k] = far[near] + step;
      source[k] = source[near];
    }
  };
  for (let j = 0; j < ny; j++) {
    for (let i = 0; i < nx; i++) {
      const k = j * nx + i;
      if (i > 0) relax(k, k - 1, 3);
      if (j > 0) {
        relax(k, k - nx, 3);
        if (i > 0) relax(k, k - nx - 1, 4);
        if (i + 1 < nx) relax(k, k - nx + 1, 4);
      }
    }
  }
  for (let j = ny - 1; j >= 0; j--) {
    for (let i = nx - 1; i >= 0; i--) {
      const k = j * nx + i;
      if (i + 1 < nx) relax(k, k + 1, 3);
      if (j + 1 < ny) {
        relax(k, k + nx, 3);
        if (i + 1 < nx) relax(k, k + nx + 1, 4);
        if (i > 0) relax(k, k + nx - 1, 4);
      }
    }
  }
}

// Draws discs with WebGL 2.
class GlDiscs {
  constructor() {
    this.canvas = document.createElement("canvas");
    const gl = this.canvas.getContext("webgl2", { alpha: true, antialias: false, preserveDrawingBuffer: true });
    this.gl = gl;
    const shader = (kind, source) => {
      const made = gl.createShader(kind);
      gl.shaderSource(made, source);
      gl.compileShader(made);
      if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
      return made;
    };
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
      in vec3 disc; in vec3 colour; uniform vec2 size; out vec3 tint; out float radius;
      void main() {
        gl_Position = vec4(2.0 * disc.x / size.x - 1.0, 1.0 - 2.0 * disc.y / size.y, 0.0, 1.0);
        radius = max(disc.z, 0.5);
        gl_PointSize = 2.0 * radius + 1.0;
        tint = colour;
      }`));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
      precision highp float; in vec3 tint; in float radius; out vec4 shown;
      void main() {
        float from = length(gl_PointCoord - 0.5) * (2.0 * radius + 1.0);
        float cover = clamp(radius + 0.5 - from, 0.0, 1.0);
        if (cover <= 0.0) discard;
        shown = vec4(tint * cover, cover);
      }`));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    const attribute = (name, kind, normalised) => {
      const buffer = gl.createBuffer();
      const at = gl.getAttribLocation(program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, kind, normalised, 0, 0);
      return buffer;
    };
    this.discs = attribute("disc", gl.FLOAT, false);
    this.tints = attribute("colour", gl.UNSIGNED_BYTE, true);
    this.size = gl.getUniformLocation(program, "size");
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  // The image; null if the graphics card no longer draws.
  draw(left, top, w, h, x, y, radius, paint, colours) {
    const gl = this.gl;
    if (gl.isContextLost()) return null;
    if (this.canvas.width !== w || this.canvas.height !== h) [this.canvas.width, this.canvas.height] = [w, h];
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const discs = new Float32Array(3 * x.length);
    const tints = new Uint8Array(3 * x.length);
    for (let k = 0; k < x.length; k++) {
      discs.set([x[k] - left, y[k] - top, radius[k]], 3 * k);
      const c = 3 * paint[k];
      tints[3 * k] = colours[c]; tints[3 * k + 1] = colours[c + 1]; tints[3 * k + 2] = colours[c + 2];
    }
    gl.uniform2f(this.size, w, h);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.discs);
    gl.bufferData(gl.ARRAY_BUFFER, discs, gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.tints);
    gl.bufferData(gl.ARRAY_BUFFER, tints, gl.DYNAMIC_DRAW);
    gl.drawArrays(gl.POINTS, 0, x.length);
    return this.canvas;
  }
}
