// SPDX-License-Identifier: Apache-2.0
// The camera's image with what was found in it: the stripe with its reasons, saturated pixels, masked scan lines, the region of the sensor.
import { colour, penFor } from "./dom.js";
import { REASONS, addMark } from "./reasons.js";

/**
 * @typedef {import("./plane.js").PolarScan} PolarScan
 * @typedef {{sensor_width: number, sensor_height: number, grid_u_offset: number, grid_u_step: number, grid_v_offset: number,
 *   grid_v_step: number, bit_depth: number, illumination: number}} FrameInfo
 */

const NEARLY_FULL = 250; // Of 255: JPEG blurs what is saturated by a few values.
const MASKED = 9; // The reason `blind`.
const IS_LIT = 0.3; // An image shows the stripe where it is so much of what the scan found.
const DARK_MS = 2000; // Dark images are left out while lit ones come.

export class CameraView {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.image = document.createElement("canvas");
    this.marks = document.createElement("canvas");
    /** @type {FrameInfo | null} */
    this.info = null;
    /** @type {PolarScan | null} */
    this.scan = null;
    this.chosenLine = -1;
    this.isBright = false;
    this.saturated = 0; // Pixels.
    this.lit_ms = -Infinity;
    this.isBusy = false;
  }

  /** Takes an image, unless the last one is not done. @param {Uint8Array<ArrayBuffer>} bytes JPEG or PNG @param {FrameInfo | null} info
   * @returns {Promise<boolean>} whether it is another one now */
  async take(bytes, info) {
    if (this.isBusy) return false;
    this.isBusy = true;
    try {
      const bitmap = await createImageBitmap(new Blob([bytes]));
      const isTaken = this.look(bitmap, info);
      bitmap.close();
      return isTaken;
    } finally {
      this.isBusy = false;
    }
  }

  /** @param {ImageBitmap} bitmap @param {FrameInfo | null} info */
  look(bitmap, info) {
    const { width, height } = bitmap;
    const room = new OffscreenCanvas(width, height);
    const pen = /** @type {OffscreenCanvasRenderingContext2D} */ (room.getContext("2d", { willReadFrequently: true }));
    pen.drawImage(bitmap, 0, 0);
    const pixels = pen.getImageData(0, 0, width, height).data;
    const deep = info && info.bit_depth > 8 ? 2 ** (16 - info.bit_depth) : 1; // Deeper images come in 16 bits.
    const isDark = info?.illumination === -1 || !this.showsStripe(pixels, width, height, deep, info);
    if (isDark && performance.now() - this.lit_ms < DARK_MS) return false;
    if (!isDark) this.lit_ms = performance.now();
    this.info = info;
    this.keep(bitmap, deep);
    this.markSaturated(pixels, width, height, NEARLY_FULL / deep);
    return true;
  }

  /** Whether what the scan found is in this image. @param {Uint8ClampedArray} pixels @param {number} width @param {number} height
   * @param {number} deep @param {FrameInfo | null} info */
  showsStripe(pixels, width, height, deep, info) {
    const { scan } = this;
    if (!scan) return true;
    let seen = 0;
    let expected = 0;
    const scale = info && info.bit_depth > 8 ? 2 ** (info.bit_depth - 8) : 1;
    for (let i = 0; i < scan.u_px.length; ++i) {
      const [column, row] = toImage(info, scan.u_px[i], scan.v_px[i]).map(Math.round);
      if (scan.status[i] !== 0 || !(column >= 0 && column < width && row >= 0 && row < height)) continue;
      const at = 4 * (row * width + column);
      seen += deep * Math.max(pixels[at], pixels[at + 1], pixels[at + 2]);
      expected += scan.intensity[i] / scale;
    }
    return seen >= IS_LIT * expected;
  }

  /** @param {ImageBitmap} bitmap @param {number} deep */
  keep(bitmap, deep) {
    const { image } = this;
    if (image.width !== bitmap.width || image.height !== bitmap.height) Object.assign(image, { width: bitmap.width, height: bitmap.height });
    const pen = /** @type {CanvasRenderingContext2D} */ (image.getContext("2d"));
    pen.filter = deep > 1 ? `brightness(${deep})` : "none";
    pen.drawImage(bitmap, 0, 0);
  }

  /** @param {Uint8ClampedArray} pixels @param {number} width @param {number} height @param {number} full */
  markSaturated(pixels, width, height, full) {
    if (this.marks.width !== width || this.marks.height !== height) Object.assign(this.marks, { width, height });
    const pen = /** @type {CanvasRenderingContext2D} */ (this.marks.getContext("2d"));
    const marks = pen.createImageData(width, height);
    const [red, green, blue] = [213, 94, 0]; // Vermilion.
    this.saturated = 0;
    for (let at = 0; at < pixels.length; at += 4) {
      if (pixels[at] < full && pixels[at + 1] < full && pixels[at + 2] < full) continue;
      ++this.saturated;
      marks.data.set([red, green, blue, 255], at);
    }
    pen.putImageData(marks, 0, 0);
  }

  /** Where the image is on the canvas: the whole sensor is shown, the image where its pixels are. */
  layout() {
    const { info, image, canvas } = this;
    const part = info && info.sensor_width > 0 ? info : wholeOf(image);
    const scale = Math.min(canvas.clientWidth / part.sensor_width, canvas.clientHeight / part.sensor_height);
    const left = (canvas.clientWidth - scale * part.sensor_width) / 2;
    const top = (canvas.clientHeight - scale * part.sensor_height) / 2;
    /** @type {(u: number, v: number) => [number, number]} */
    const place = (u, v) => [left + scale * (u + 0.5), top + scale * (v + 0.5)];
    return { part, scale, place, left, top };
  }

  draw() {
    const pen = penFor(this.canvas);
    if (this.image.width === 0) return;
    const { part, scale, place, left, top } = this.layout();
    pen.fillStyle = colour("--sensor");
    pen.fillRect(left, top, scale * part.sensor_width, scale * part.sensor_height);
    const [x, y] = place(part.grid_u_offset - 0.5, part.grid_v_offset - 0.5);
    const size = [scale * part.grid_u_step * this.image.width, scale * part.grid_v_step * this.image.height];
    pen.imageSmoothingEnabled = scale < 1;
    pen.filter = this.isBright ? "brightness(5)" : "none";
    pen.drawImage(this.image, x, y, size[0], size[1]);
    pen.filter = "none";
    pen.drawImage(this.marks, x, y, size[0], size[1]);
    pen.strokeStyle = colour("--faint");
    pen.setLineDash([4, 3]);
    pen.strokeRect(x, y, size[0], size[1]);
    pen.setLineDash([]);
    if (this.scan) this.drawScan(pen, this.scan, place, scale, [x, y, size[0], size[1]]);
  }

  /** @param {CanvasRenderingContext2D} pen @param {PolarScan} scan @param {(u: number, v: number) => [number, number]} place
   * @param {number} scale @param {number[]} box of the image */
  drawScan(pen, scan, place, scale, box) {
    const isColumns = scan.axis === 0;
    const lines = isColumns ? scan.u_px : scan.v_px;
    const [ribbon_px, step] = [6, scale * (isColumns ? (this.info?.grid_u_step ?? 1) : (this.info?.grid_v_step ?? 1))];
    for (let i = 0; i < lines.length; ++i) {
      const [x, y] = place(scan.u_px[i] || 0, scan.v_px[i] || 0);
      pen.fillStyle = REASONS[scan.status[i]] ? colourOf(scan.status[i]) : "grey";
      if (isColumns) pen.fillRect(x - step / 2, box[1] + box[3] - ribbon_px, step + 0.3, ribbon_px);
      else pen.fillRect(box[0], y - step / 2, ribbon_px, step + 0.3);
      if (scan.status[i] === MASKED) shade(pen, isColumns, x, y, step, box);
    }
    for (let code = REASONS.length - 1; code >= 0; --code) {
      pen.beginPath();
      for (let i = 0; i < lines.length; ++i) {
        const has = scan.status[i] === code && Number.isFinite(scan.u_px[i]) && Number.isFinite(scan.v_px[i]);
        if (has) addMark(pen, REASONS[code].shape, ...place(scan.u_px[i], scan.v_px[i]), 2);
      }
      pen.fillStyle = pen.strokeStyle = colourOf(code);
      pen.lineWidth = 1;
      if (REASONS[code].shape === "square") pen.fill();
      else pen.stroke();
    }
    this.drawChosen(pen, lines, isColumns, place, box);
  }

  /** @param {CanvasRenderingContext2D} pen @param {Float64Array} lines @param {boolean} isColumns
   * @param {(u: number, v: number) => [number, number]} place @param {number[]} box */
  drawChosen(pen, lines, isColumns, place, box) {
    if (!(this.chosenLine >= 0 && this.chosenLine < lines.length)) return;
    const [x, y] = place(lines[this.chosenLine], lines[this.chosenLine]);
    pen.strokeStyle = colour("--sky");
    pen.lineWidth = 1;
    pen.strokeRect(isColumns ? x : box[0], isColumns ? box[1] : y, isColumns ? 0 : box[2], isColumns ? box[3] : 0);
  }

  /** The return whose scan line is at a place on the canvas; -1 for none. @param {number} x @param {number} y */
  pick(x, y) {
    if (!this.scan || this.image.width === 0) return -1;
    const { scale, left, top } = this.layout();
    const isColumns = this.scan.axis === 0;
    const wanted = (isColumns ? x - left : y - top) / scale - 0.5;
    let best = -1;
    let least = Infinity;
    (isColumns ? this.scan.u_px : this.scan.v_px).forEach((line, i) => {
      if (Math.abs(line - wanted) < least) [best, least] = [i, Math.abs(line - wanted)];
    });
    return least < 2 ? best : -1;
  }
}

/** @type {Map<number, string>} */
const colours = new Map();
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => colours.clear());

/** In the image, which is dark in any style, the bright ones of each pair. @param {number} code */
function colourOf(code) {
  const known = colours.get(code);
  if (known) return known;
  const made = code === 0 ? colour("--sky") : colour(REASONS[code].ink);
  colours.set(code, made);
  return made;
}

/** @param {HTMLCanvasElement} image @returns {FrameInfo} */
const wholeOf = (image) => ({
  sensor_width: image.width, sensor_height: image.height, grid_u_offset: 0, grid_u_step: 1, grid_v_offset: 0, grid_v_step: 1,
  bit_depth: 8, illumination: -2,
});

/** @param {FrameInfo | null} info @param {number} u @param {number} v @returns {[number, number]} */
const toImage = (info, u, v) =>
  info ? [(u - info.grid_u_offset) / info.grid_u_step, (v - info.grid_v_offset) / info.grid_v_step] : [u, v];

/** Shades a masked scan line. @param {CanvasRenderingContext2D} pen @param {boolean} isColumns @param {number} x @param {number} y
 * @param {number} step @param {number[]} box */
function shade(pen, isColumns, x, y, step, box) {
  pen.globalAlpha = 0.35;
  if (isColumns) pen.fillRect(x - step / 2, box[1], step + 0.3, box[3]);
  else pen.fillRect(box[0], y - step / 2, box[2], step + 0.3);
  pen.globalAlpha = 1;
}
