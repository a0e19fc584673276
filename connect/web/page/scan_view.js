// SPDX-License-Identifier: Apache-2.0
// A scan from above: x forward is up, y to the left is left; metres to scale, one-sigma bars along the ray.

/** @typedef {import("./cdr.js").Point} Point */

const MARGIN_PX = 36;

/** A round step of which some five fit. @param {number} span */
function roundStep(span) {
  const rough = span / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * ([1, 2, 5].find((factor) => factor * power >= rough) ?? 10);
}

/** @param {HTMLCanvasElement} canvas */
function fit(canvas) {
  const ratio = devicePixelRatio;
  const width = Math.round(canvas.clientWidth * ratio);
  const height = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  return pen;
}

/** @param {string} name */
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);

/** The sensor is in the picture, and every return that is ok. @param {Point[]} good */
function extent(good) {
  const x = [0, ...good.map((p) => p.x)];
  const y = [0, ...good.map((p) => p.y)];
  return { x: [Math.min(...x), Math.max(...x)], y: [Math.min(...y), Math.max(...y)] };
}

/**
 * Draws a scan. @param {HTMLCanvasElement} canvas @param {Point[]} points
 * @returns {{good: number, doubtful: number}} how many there are
 */
export function drawScan(canvas, points) {
  const seen = points.filter((p) => Number.isFinite(p.x) && Number.isFinite(p.y));
  const good = seen.filter((p) => p.status === 0);
  const doubtful = seen.filter((p) => p.status !== 0);
  const pen = fit(canvas);
  const width = canvas.clientWidth;
  const height = canvas.clientHeight;
  pen.clearRect(0, 0, width, height);
  const { x, y } = extent(good);
  const scale = Math.min((width - 2 * MARGIN_PX) / Math.max(0.1, y[1] - y[0]), (height - 2 * MARGIN_PX) / Math.max(0.1, x[1] - x[0]));
  /** @param {number} across @param {number} forward @returns {[number, number]} */
  const place = (forward, across) => [
    width / 2 + ((y[0] + y[1]) / 2 - across) * scale,
    height / 2 - (forward - (x[0] + x[1]) / 2) * scale,
  ];
  drawGrid(pen, width, height, place, scale);
  drawBars(pen, good, place);
  drawDots(pen, doubtful, place, colour("--bad"), 1.2);
  drawDots(pen, good, place, colour("--good"), 1.6);
  return { good: good.length, doubtful: doubtful.length };
}

/**
 * @param {CanvasRenderingContext2D} pen @param {number} width @param {number} height
 * @param {(forward: number, across: number) => [number, number]} place @param {number} scale
 */
function drawGrid(pen, width, height, place, scale) {
  const [x0, y0] = place(0, 0);
  const step = roundStep(Math.max(width, height) / scale);
  pen.strokeStyle = colour("--line");
  pen.fillStyle = colour("--faint");
  pen.lineWidth = 1;
  pen.font = "12px system-ui, sans-serif";
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  for (let k = Math.ceil(-x0 / (step * scale)); x0 + k * step * scale < width; ++k) {
    const at = x0 + k * step * scale;
    pen.strokeRect(at, -1, 0, height + 2);
    pen.fillText(`y ${(-k * step).toFixed(digits)} m`, at + 3, height - 4);
  }
  for (let k = Math.ceil((y0 - height) / (step * scale)); y0 - k * step * scale > 0; ++k) {
    const at = y0 - k * step * scale;
    pen.strokeRect(-1, at, width + 2, 0);
    pen.fillText(`x ${(k * step).toFixed(digits)} m`, 3, at - 3);
  }
  pen.fillStyle = colour("--ink");
  pen.fillRect(x0 - 5, y0 - 3, 10, 6);
}

/** @param {CanvasRenderingContext2D} pen @param {Point[]} points @param {(forward: number, across: number) => [number, number]} place */
function drawBars(pen, points, place) {
  pen.strokeStyle = colour("--band");
  pen.lineWidth = 2;
  pen.beginPath();
  for (const { x, y, sigma } of points) {
    const part = sigma / Math.hypot(x, y);
    if (!(part > 0)) continue;
    pen.moveTo(...place(x * (1 - part), y * (1 - part)));
    pen.lineTo(...place(x * (1 + part), y * (1 + part)));
  }
  pen.stroke();
}

/**
 * @param {CanvasRenderingContext2D} pen @param {Point[]} points @param {(forward: number, across: number) => [number, number]} place
 * @param {string} fill @param {number} radius
 */
function drawDots(pen, points, place, fill, radius) {
  pen.fillStyle = fill;
  for (const { x, y } of points) {
    const [across, down] = place(x, y);
    pen.fillRect(across - radius, down - radius, 2 * radius, 2 * radius);
  }
}
