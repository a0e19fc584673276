// SPDX-License-Identifier: Apache-2.0
// The scan from above: metres to scale, the ranges half a pixel nearer and farther, one-sigma bands, straight pieces, reasons by colour and shape.
import { colour, penFor } from "./dom.js";
import { isPlaced } from "./plane.js";
import { REASONS, addMark } from "./reasons.js";
import { ViewPort } from "./view_port.js";

/**
 * @typedef {import("./plane.js").PlaneScan} PlaneScan
 * @typedef {{laser: number, x1_m: number, y1_m: number, x2_m: number, y2_m: number}} Piece
 * @typedef {{plane: PlaneScan, i: number}} Pick
 */

const MOST_FAR = 3; // Bars that reach farther than so many times the range are cut off: to where there is nothing.
const PICK_PX = 24;

/** A round step of which some five fit. @param {number} span */
function roundStep(span) {
  const rough = span / 5;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * ([1, 2, 5].find((factor) => factor * power >= rough) ?? 10);
}

export class ScanView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.port = new ViewPort();
    /** @type {PlaneScan[]} */
    this.planes = [];
    /** @type {Piece[]} */
    this.pieces = [];
    /** @type {Pick | null} */
    this.chosen = null;
    /** @type {Pick[]} */
    this.measured = [];
  }

  /** @param {PlaneScan[]} planes one of each laser that is shown */
  set(planes) {
    this.planes = planes;
    this.port.resize(this.canvas.clientWidth, this.canvas.clientHeight);
    const extent = extentOf(planes);
    if (extent) this.port.fit(extent);
  }

  draw() {
    const pen = penFor(this.canvas);
    this.port.resize(this.canvas.clientWidth, this.canvas.clientHeight);
    this.drawGrid(pen);
    for (const plane of this.planes) {
      this.drawBand(pen, plane);
      this.drawBars(pen, plane);
    }
    this.drawPieces(pen);
    for (const plane of this.planes) this.drawReturns(pen, plane);
    this.drawMeasured(pen);
    if (this.chosen) this.drawRing(pen, this.chosen, 9);
  }

  /** @param {CanvasRenderingContext2D} pen */
  drawGrid(pen) {
    const { port } = this;
    const unit = this.planes[0]?.unit ?? "m";
    const step = roundStep(Math.max(port.width, port.height) / port.scale);
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    const [top, left] = port.planeAt(0, 0);
    const [bottom, right] = port.planeAt(port.width, port.height);
    pen.strokeStyle = colour("--line");
    pen.fillStyle = colour("--faint");
    pen.lineWidth = 1;
    pen.font = "12px system-ui, sans-serif";
    pen.beginPath();
    for (let k = Math.ceil(right / step); k * step <= left; ++k) {
      const at = Math.round(port.place(0, k * step)[0]) + 0.5;
      pen.moveTo(at, 0);
      pen.lineTo(at, port.height);
      pen.fillText(unit === "m" ? `y ${(k * step).toFixed(digits)} m` : `column ${(-k * step).toFixed(0)}`, at + 3, port.height - 4);
    }
    for (let k = Math.ceil(bottom / step); k * step <= top; ++k) {
      const at = Math.round(port.place(k * step, 0)[1]) + 0.5;
      pen.moveTo(0, at);
      pen.lineTo(port.width, at);
      pen.fillText(unit === "m" ? `x ${(k * step).toFixed(digits)} m` : `row ${(-k * step).toFixed(0)}`, 3, at - 3);
    }
    pen.stroke();
    if (unit === "m") this.drawSensor(pen);
  }

  /** @param {CanvasRenderingContext2D} pen */
  drawSensor(pen) {
    const [right, down] = this.port.place(0, 0);
    pen.fillStyle = colour("--ink");
    pen.fillRect(right - 6, down - 3, 12, 6);
  }

  /** The one-sigma band, along what goes on from scan line to scan line. @param {CanvasRenderingContext2D} pen @param {PlaneScan} plane */
  drawBand(pen, plane) {
    pen.fillStyle = colour("--band");
    pen.beginPath();
    for (const [begin, end] of runs(plane)) {
      for (let i = begin; i < end; ++i) this.bandPoint(pen, plane, i, 1, i === begin);
      for (let i = end - 1; i >= begin; --i) this.bandPoint(pen, plane, i, -1, false);
      pen.closePath();
    }
    pen.fill();
  }

  /** @param {CanvasRenderingContext2D} pen @param {PlaneScan} plane @param {number} i @param {number} sign @param {boolean} isFirst */
  bandPoint(pen, plane, i, sign, isFirst) {
    const by = sign * plane.sigma[i];
    const [right, down] = this.port.place(plane.x[i] + by * plane.alongX[i], plane.y[i] + by * plane.alongY[i]);
    if (isFirst) pen.moveTo(right, down);
    else pen.lineTo(right, down);
  }

  /** @param {CanvasRenderingContext2D} pen @param {PlaneScan} plane */
  drawBars(pen, plane) {
    pen.strokeStyle = colour("--bar");
    pen.lineWidth = 1;
    pen.beginPath();
    for (let i = 0; i < plane.x.length; ++i) {
      if (plane.scan.status[i] !== 0 || !isPlaced(plane, i)) continue;
      const far = Math.min(plane.far[i], MOST_FAR * Math.hypot(plane.x[i], plane.y[i]));
      pen.moveTo(...this.port.place(plane.x[i] + plane.near[i] * plane.alongX[i], plane.y[i] + plane.near[i] * plane.alongY[i]));
      pen.lineTo(...this.port.place(plane.x[i] + far * plane.alongX[i], plane.y[i] + far * plane.alongY[i]));
    }
    pen.stroke();
  }

  /** @param {CanvasRenderingContext2D} pen */
  drawPieces(pen) {
    pen.strokeStyle = colour("--piece");
    pen.lineWidth = 2;
    pen.beginPath();
    for (const { x1_m, y1_m, x2_m, y2_m } of this.pieces) {
      pen.moveTo(...this.port.place(x1_m, y1_m));
      pen.lineTo(...this.port.place(x2_m, y2_m));
    }
    pen.stroke();
  }

  /** Those that are good last, so that nothing hides them. @param {CanvasRenderingContext2D} pen @param {PlaneScan} plane */
  drawReturns(pen, plane) {
    for (let code = REASONS.length - 1; code >= 0; --code) {
      const { ink, shape } = REASONS[code];
      pen.beginPath();
      for (let i = 0; i < plane.x.length; ++i) {
        if (plane.scan.status[i] === code && isPlaced(plane, i)) addMark(pen, shape, ...this.port.place(plane.x[i], plane.y[i]), 3);
      }
      pen.fillStyle = pen.strokeStyle = colour(ink);
      pen.lineWidth = 1.5;
      if (shape === "square") pen.fill();
      else pen.stroke();
    }
  }

  /** @param {CanvasRenderingContext2D} pen */
  drawMeasured(pen) {
    const places = this.measured.map(({ plane, i }) => this.port.place(plane.x[i], plane.y[i]));
    pen.strokeStyle = colour("--ink");
    pen.lineWidth = 1.5;
    pen.setLineDash([6, 4]);
    pen.beginPath();
    places.forEach((place, k) => (k === 0 ? pen.moveTo(...place) : pen.lineTo(...place)));
    pen.stroke();
    pen.setLineDash([]);
    for (const pick of this.measured) this.drawRing(pen, pick, 6);
  }

  /** @param {CanvasRenderingContext2D} pen @param {Pick} pick @param {number} radius */
  drawRing(pen, { plane, i }, radius) {
    if (!isPlaced(plane, i)) return;
    const [right, down] = this.port.place(plane.x[i], plane.y[i]);
    pen.strokeStyle = colour("--ink");
    pen.lineWidth = 2;
    pen.beginPath();
    pen.arc(right, down, radius, 0, 2 * Math.PI);
    pen.stroke();
  }

  /** The return that is nearest to a place on the canvas; the scan line that looks there where none is near. @param {number} right_px
   * @param {number} down_px @returns {Pick | null} */
  pick(right_px, down_px) {
    let best = null;
    let least = Infinity;
    for (const plane of this.planes) {
      for (let i = 0; i < plane.x.length; ++i) {
        if (!isPlaced(plane, i)) continue;
        const [right, down] = this.port.place(plane.x[i], plane.y[i]);
        const distance = Math.hypot(right - right_px, down - down_px);
        if (distance < least) [best, least] = [{ plane, i }, distance];
      }
    }
    return least < PICK_PX ? best : (this.pickBearing(right_px, down_px) ?? best);
  }

  /** @param {number} right_px @param {number} down_px @returns {Pick | null} */
  pickBearing(right_px, down_px) {
    const [x, y] = this.port.planeAt(right_px, down_px);
    const bearing = Math.atan2(y, x);
    let best = null;
    let least = Infinity;
    for (const plane of this.planes) {
      plane.scan.bearing_rad.forEach((other, i) => {
        const distance = Math.abs(other - bearing);
        if (distance < least) [best, least] = [{ plane, i }, distance];
      });
    }
    return best;
  }
}

/** What is shown: the sensor, and every good return. @param {PlaneScan[]} planes @returns {import("./view_port.js").Extent | null} */
function extentOf(planes) {
  const isMetres = planes[0]?.unit === "m";
  let [x0, x1, y0, y1] = isMetres ? [0, 0, 0, 0] : [Infinity, -Infinity, Infinity, -Infinity];
  let count = 0;
  for (const plane of planes) {
    for (let i = 0; i < plane.x.length; ++i) {
      if (plane.scan.status[i] !== 0 || !isPlaced(plane, i)) continue;
      ++count;
      [x0, x1] = [Math.min(x0, plane.x[i]), Math.max(x1, plane.x[i])];
      [y0, y1] = [Math.min(y0, plane.y[i]), Math.max(y1, plane.y[i])];
    }
  }
  return count === 0 ? null : { x: [x0, x1], y: [y0, y1] };
}

/** Neighbours that are good and no farther from each other than their bars allow: begin and end of each. @param {PlaneScan} plane
 * @returns {[number, number][]} */
function runs(plane) {
  /** @type {[number, number][]} */
  const found = [];
  let begin = -1;
  for (let i = 0; i <= plane.x.length; ++i) {
    const isGood = i < plane.x.length && plane.scan.status[i] === 0 && isPlaced(plane, i);
    if (begin >= 0 && (!isGood || isEdge(plane, i - 1, i))) {
      if (i - begin > 1) found.push([begin, i]);
      begin = -1;
    }
    if (begin < 0 && isGood) begin = i;
  }
  return found;
}

/** @param {PlaneScan} plane @param {number} i @param {number} k */
function isEdge(plane, i, k) {
  const bars = plane.far[i] - plane.near[i] + plane.far[k] - plane.near[k];
  return Math.hypot(plane.x[i] - plane.x[k], plane.y[i] - plane.y[k]) > 4 * bars;
}
