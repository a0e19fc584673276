// SPDX-License-Identifier: Apache-2.0
// Which part of a plane a canvas shows: x forward is up, y to the left is left; fitted to what there is until somebody moves it.

const MARGIN_PX = 40;
const KEEP_ABOVE = 0.6; // Of the view that was fitted: as long as what is there fills so much of it, it stays.

/** @typedef {{x: [number, number], y: [number, number]}} Extent */

export class ViewPort {
  constructor() {
    this.x = 0; // The middle.
    this.y = 0;
    this.scale = 100; // Pixels of the screen a unit of the plane.
    this.isFitted = true;
    /** @type {Extent | null} */
    this.fitted = null;
    this.width = 1;
    this.height = 1;
  }

  /** @param {number} width @param {number} height of the canvas */
  resize(width, height) {
    const isOther = width !== this.width || height !== this.height;
    Object.assign(this, { width, height });
    if (isOther && this.isFitted && this.fitted) this.show(this.fitted);
  }

  /** Shows all of what is there; stands still while it nearly does. @param {Extent} extent */
  fit(extent) {
    if (!this.isFitted || (this.fitted && this.isNearly(this.fitted, extent))) return;
    const grown = /** @type {Extent} */ ({ x: grow(extent.x), y: grow(extent.y) });
    this.fitted = grown;
    this.show(grown);
  }

  /** @param {Extent} shown @param {Extent} wanted */
  isNearly(shown, wanted) {
    const isInside = ["x", "y"].every((axis) => {
      const [a, b] = [shown[/** @type {"x"} */ (axis)], wanted[/** @type {"x"} */ (axis)]];
      return a[0] <= b[0] && b[1] <= a[1];
    });
    const part = Math.max((wanted.x[1] - wanted.x[0]) / (shown.x[1] - shown.x[0]), (wanted.y[1] - wanted.y[0]) / (shown.y[1] - shown.y[0]));
    return isInside && part > KEEP_ABOVE;
  }

  /** @param {Extent} extent */
  show({ x, y }) {
    this.x = (x[0] + x[1]) / 2;
    this.y = (y[0] + y[1]) / 2;
    const across = Math.max(this.width - 2 * MARGIN_PX, 50) / Math.max(1e-6, y[1] - y[0]);
    const up = Math.max(this.height - 2 * MARGIN_PX, 50) / Math.max(1e-6, x[1] - x[0]);
    this.scale = Math.min(across, up);
  }

  /** Fits again, from now on. */
  reset() {
    this.isFitted = true;
    this.fitted = null;
  }

  /** @param {number} right_px @param {number} down_px by which what is shown moves */
  pan(right_px, down_px) {
    this.isFitted = false;
    this.y += right_px / this.scale;
    this.x += down_px / this.scale;
  }

  /** @param {number} factor @param {number} [right_px] @param {number} [down_px] the place on the canvas that stays; default the middle */
  zoom(factor, right_px = this.width / 2, down_px = this.height / 2) {
    const [x, y] = this.planeAt(right_px, down_px);
    this.isFitted = false;
    this.scale = Math.min(1e7, Math.max(1e-2, this.scale * factor));
    const [newX, newY] = this.planeAt(right_px, down_px);
    this.x += x - newX;
    this.y += y - newY;
  }

  /** @param {number} x @param {number} y @returns {[number, number]} on the canvas, to the right and down */
  place(x, y) {
    return [this.width / 2 + (this.y - y) * this.scale, this.height / 2 + (this.x - x) * this.scale];
  }

  /** @param {number} right_px @param {number} down_px @returns {[number, number]} in the plane, x and y */
  planeAt(right_px, down_px) {
    return [this.x - (down_px - this.height / 2) / this.scale, this.y - (right_px - this.width / 2) / this.scale];
  }
}

/** @param {[number, number]} span @returns {[number, number]} */
function grow([low, high]) {
  const more = 0.08 * Math.max(high - low, 1e-3);
  return [low - more, high + more];
}
