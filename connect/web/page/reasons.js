// SPDX-License-Identifier: Apache-2.0
// Why a scan line has no good return: words, a colour that the colour-blind tell apart (Okabe and Ito's), and a shape.

/**
 * @typedef {"square" | "cross" | "diamond" | "triangle" | "ring" | "bar"} Shape
 * @typedef {{status: string, words: string, ink: string, shape: Shape, cure: string}} Reason
 */

/** @type {(status: string, words: string, ink: string, shape: Shape, cure?: string) => Reason} */
const reason = (status, words, ink, shape, cure = "") => ({ status, words, ink, shape, cure });

/** By the code in messages: CONVENTIONS.md's table. */
export const REASONS = [
  reason("ok", "good", "--good", "square"),
  reason("saturated", "so many pixels are saturated that the stripe's centre is not known", "--vermilion", "triangle", "shorten exposure_us, or lower gain_db"),
  reason("ambiguous", "another peak is about as likely", "--purple", "diamond", "keep other bright lines out of view; set peak, min_range, max_range"),
  reason("wide", "wider than the stripe: a light source, or a specular highlight", "--orange", "ring", "focus the lens; set width"),
  reason("narrow", "narrower than the stripe: a hot pixel", "--orange", "bar", "set width"),
  reason("weak", "hardly above the noise", "--green", "cross", "lengthen exposure_us, raise gain_db, open the iris"),
  reason("edge", "at the image's border: part of the stripe is outside", "--faint", "ring", "turn the head so that the stripe is in view"),
  reason("out_of_range", "outside the range limits that were set", "--green", "diamond", "set min_range and max_range"),
  reason("no_stripe", "nothing above the threshold", "--faint", "cross", "is the laser on, and its light in view here?"),
  reason("blind", "masked: ambient light saturates pixels where the stripe may hide", "--yellow", "bar",
    "shorten exposure_us, keep light sources and the sun out of view, fit the band-pass filter"),
  reason("behind", "the ray does not meet the laser's plane in front of the camera", "--purple", "cross", "is the model that of this striper?"),
  reason("outside_model", "the camera's model does not reach here", "--purple", "bar", "calibrate with the board in this corner, too"),
  reason("filled", "not measured: a gap that was filled", "--sky", "ring"),
  reason("outlier", "too probably something else than the stripe", "--vermilion", "cross", "keep other bright lines out of view; set min_confidence"),
];

/** @param {string} status @returns {Reason} */
export const reasonOf = (status) => REASONS.find((one) => one.status === status) ?? REASONS[8];

/** How many returns have each reason. @param {Uint8Array} status @returns {number[]} */
export function countReasons(status) {
  const counts = REASONS.map(() => 0);
  for (const code of status) if (code < counts.length) ++counts[code];
  return counts;
}

/** A mark of a reason's shape around a place, into the path. @param {CanvasRenderingContext2D} pen @param {Shape} shape
 * @param {number} x @param {number} y @param {number} r */
export function addMark(pen, shape, x, y, r) {
  if (shape === "square") {
    pen.rect(x - r / 2, y - r / 2, r, r);
  } else if (shape === "cross") {
    pen.moveTo(x - r, y - r);
    pen.lineTo(x + r, y + r);
    pen.moveTo(x - r, y + r);
    pen.lineTo(x + r, y - r);
  } else if (shape === "ring") {
    pen.moveTo(x + r, y);
    pen.arc(x, y, r, 0, 2 * Math.PI);
  } else if (shape === "bar") {
    pen.moveTo(x, y - 1.3 * r);
    pen.lineTo(x, y + 1.3 * r);
  } else {
    const down = shape === "diamond" ? r : r / 2;
    pen.moveTo(x, y - 1.2 * r);
    pen.lineTo(x + r, y + down / 2);
    if (shape === "diamond") pen.lineTo(x, y + 1.7 * down);
    pen.lineTo(x - r, y + down / 2);
    pen.closePath();
  }
}
