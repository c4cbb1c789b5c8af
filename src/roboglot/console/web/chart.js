// Draws one robot's map on a canvas: grid, scan, path, drawings, truth. Metres in, pixels out; knows no socket.

/** Where the canvas looks: its middle in the map (m) and pixels a metre. @typedef {{x: number, y: number, scale: number}} Camera */

const FAR = 65535;
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** All colours of the theme, read once a change. */
export function palette() {
  const names = ["bg", "free", "occupied", "grid", "scan", "path", "goal", "robot", "ink", "muted", "wall", "track", "area", "place", "ghost", "person", "box", "plan", "furniture", "danger"];
  return Object.fromEntries(names.map((name) => [name, style(`--map-${name}`)]));
}

/** The map as a picture with one pixel a cell. @param {any} grid @param {Record<string, string>} colours */
export function picture(grid, colours) {
  const canvas = document.createElement("canvas");
  if (!grid.width || !grid.height) return null;
  [canvas.width, canvas.height] = [grid.width, grid.height];
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const image = context.createImageData(grid.width, grid.height);
  const rgb = (colour) => {
    context.fillStyle = colour;
    return String(context.fillStyle).match(/\w\w/g).map((part) => parseInt(part, 16)).concat(255); // "#rrggbb"
  };
  const shades = [[0, 0, 0, 0], rgb(colours.free), rgb(colours.occupied)];
  for (let row = 0; row < grid.height; row++) {
    for (let column = 0; column < grid.width; column++) {
      const shade = shades[grid.cells[row * grid.width + column]];
      image.data.set(shade, ((grid.height - 1 - row) * grid.width + column) * 4); // y runs up in the map
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

/** A point given in `frame` ([x, y, yaw]), outside of it. @param {number[]} frame @param {number[]} p */
export function outOf(frame, p) {
  const [c, s] = [Math.cos(frame[2]), Math.sin(frame[2])];
  return [frame[0] + c * p[0] - s * p[1], frame[1] + s * p[0] + c * p[1], (p[2] ?? 0) + frame[2]];
}

/** A point, as seen in `frame`. @param {number[]} frame @param {number[]} p */
export function into(frame, p) {
  const [c, s, x, y] = [Math.cos(frame[2]), Math.sin(frame[2]), p[0] - frame[0], p[1] - frame[1]];
  return [c * x + s * y, c * y - s * x, (p[2] ?? 0) - frame[2]];
}

export class Chart {
  /** @param {HTMLCanvasElement} canvas @param {Camera} camera */
  constructor(canvas, camera) {
    this.canvas = canvas;
    this.camera = camera;
    this.context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const ratio = Math.min(devicePixelRatio || 1, 2);
    const box = canvas.getBoundingClientRect();
    this.width = box.width;
    this.height = box.height;
    const [w, h] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
    if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  /** @param {number[]} p @returns {[number, number]} */
  at(p) {
    return [this.width / 2 + (p[0] - this.camera.x) * this.camera.scale, this.height / 2 - (p[1] - this.camera.y) * this.camera.scale];
  }

  clear(colour) {
    this.context.fillStyle = colour;
    this.context.fillRect(0, 0, this.width, this.height);
  }

  /** Lines every metre, or every five or ten when small. @param {string} colour */
  mesh(colour) {
    const { scale, x, y } = this.camera;
    const step = scale > 24 ? 1 : scale > 6 ? 5 : 10;
    const [halfWidth, halfHeight] = [this.width / 2 / scale, this.height / 2 / scale];
    this.context.strokeStyle = colour;
    this.context.lineWidth = 1;
    this.context.beginPath();
    for (let u = Math.ceil((x - halfWidth) / step) * step; u < x + halfWidth; u += step) this.segment([u, y - halfHeight], [u, y + halfHeight]);
    for (let v = Math.ceil((y - halfHeight) / step) * step; v < y + halfHeight; v += step) this.segment([x - halfWidth, v], [x + halfWidth, v]);
    this.context.stroke();
  }

  segment(from, to) {
    this.context.moveTo(...this.at(from));
    this.context.lineTo(...this.at(to));
  }

  /** @param {HTMLCanvasElement} image @param {any} grid */
  bitmap(image, grid) {
    const [left, bottom] = this.at(grid.origin);
    const size = grid.resolution * this.camera.scale;
    this.context.imageSmoothingEnabled = size < 1;
    this.context.drawImage(image, left, bottom - grid.height * size, grid.width * size, grid.height * size);
  }

  /** @param {number[][]} points @param {{stroke?: string, fill?: string, width?: number, dash?: number[], closed?: boolean}} look */
  line(points, { stroke, fill, width = 2, dash = [], closed = false }) {
    if (!points.length) return;
    const { context } = this;
    context.beginPath();
    points.forEach((p, index) => (index ? context.lineTo(...this.at(p)) : context.moveTo(...this.at(p))));
    if (closed) context.closePath();
    if (fill) { context.fillStyle = fill; context.fill(); }
    if (stroke) {
      context.setLineDash(dash);
      [context.strokeStyle, context.lineWidth, context.lineJoin] = [stroke, width, "round"];
      context.stroke();
      context.setLineDash([]);
    }
  }

  /** @param {any} scan @param {string} colour */
  scan(scan, colour) {
    const { context } = this;
    const dot = Math.max(2, Math.min(4, this.camera.scale * 0.05));
    context.fillStyle = colour;
    for (let i = 0; i < scan.ranges.length; i++) {
      if (scan.ranges[i] === FAR) continue;
      const angle = scan.from + i * scan.step, range = scan.ranges[i] / 1000;
      const [x, y] = this.at(outOf(scan.pose, [range * Math.cos(angle), range * Math.sin(angle)]));
      context.fillRect(x - dot / 2, y - dot / 2, dot, dot);
    }
  }

  /** A robot: its circle and where it looks. @param {number[]} pose @param {number} radius m @param {any} look */
  robot(pose, radius, { fill, stroke, dash = [], label = "", ink = "" }) {
    const { context } = this;
    const [x, y] = this.at(pose);
    const r = Math.max(8, radius * this.camera.scale);
    context.save();
    context.translate(x, y);
    context.rotate(-pose[2]);
    context.beginPath();
    context.arc(0, 0, r, 0, 2 * Math.PI);
    if (fill) { context.fillStyle = fill; context.fill(); }
    context.setLineDash(dash);
    [context.strokeStyle, context.lineWidth] = [stroke, 2];
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.moveTo(r * 0.72, 0);
    context.lineTo(-r * 0.36, r * 0.46);
    context.lineTo(-r * 0.14, 0);
    context.lineTo(-r * 0.36, -r * 0.46);
    context.closePath();
    context.fillStyle = stroke;
    context.fill();
    context.restore();
    if (label) this.text([pose[0], pose[1]], label, ink, r + 4);
  }

  /** @param {number[]} p @param {number} radius px @param {any} look */
  dot(p, radius, { fill, stroke, width = 2 }) {
    const [x, y] = this.at(p);
    this.context.beginPath();
    this.context.arc(x, y, radius, 0, 2 * Math.PI);
    if (fill) { this.context.fillStyle = fill; this.context.fill(); }
    if (stroke) { [this.context.strokeStyle, this.context.lineWidth] = [stroke, width]; this.context.stroke(); }
  }

  /** @param {number[]} p @param {string} text @param {string} colour @param {number} right px */
  text(p, text, colour, right = 8) {
    const [x, y] = this.at(p);
    const { context } = this;
    context.font = "600 12px system-ui, sans-serif";
    context.textBaseline = "middle";
    [context.lineWidth, context.strokeStyle, context.lineJoin] = [3, style("--map-halo"), "round"];
    context.strokeText(text, x + right, y);
    context.fillStyle = colour;
    context.fillText(text, x + right, y);
  }

  /** An arrow from a place into a direction. @param {number[]} from @param {number[]} to @param {string} colour */
  arrow(from, to, colour) {
    const [a, b] = [this.at(from), this.at(to)];
    const angle = Math.atan2(b[1] - a[1], b[0] - a[0]);
    const { context } = this;
    [context.strokeStyle, context.fillStyle, context.lineWidth] = [colour, colour, 3];
    context.beginPath();
    context.moveTo(...a);
    context.lineTo(...b);
    context.stroke();
    context.beginPath();
    context.moveTo(b[0] + 10 * Math.cos(angle), b[1] + 10 * Math.sin(angle));
    for (const turn of [2.5, -2.5]) context.lineTo(b[0] + 9 * Math.cos(angle + turn), b[1] + 9 * Math.sin(angle + turn));
    context.closePath();
    context.fill();
  }
}
