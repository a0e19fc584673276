// SPDX-License-Identifier: Apache-2.0
// Why a scan line gave what it gave: a sentence, the profile with what was found in it, and every number by its name.
import { colour, lengthText, make, penFor, showRows } from "./dom.js";
import { reasonOf } from "./reasons.js";

/**
 * @typedef {{across_px: number, sigma_px: number, amplitude_dn: number, width_px: number, significance: number, snr: number,
 *   probability: number, lines: number, support: number, fate: string}} Candidate
 * @typedef {{frame: number, line: number, status: string, range_m: number | null, sigma_m: number | null, sigma_cal_m: number | null,
 *   u_px: number, v_px: number | null, confidence: number | null, range_m_per_px: number | null, range_m_per_deg: number | null,
 *   noise_dn: number, least_significance: number, expected_width_px: number, from_px: number, to_px: number, chosen_over_lines: boolean,
 *   bridged: boolean,
 *   candidates: Candidate[], sigma_px: Record<string, number | null>, first_px: number, step_px: number, lit_dn: number[],
 *   dark_dn: number[]}} Why
 */

/** @param {number} value */
const short = (value) => String(Number(value.toPrecision(4)));

/** @param {any} value @returns {string} */
function textOf(value) {
  if (value === null) return "none";
  if (typeof value === "number") return short(value);
  if (!Array.isArray(value)) return typeof value === "object" ? Object.entries(value).map(([key, one]) => `${key} ${textOf(one)}`).join(", ") : String(value);
  if (value.length === 0) return "none";
  if (typeof value[0] === "number") return `${value.length} pixels, ${short(Math.min(...value))} to ${short(Math.max(...value))}`;
  return `${value.length}: ` + value.map((one) => `${one.fate} at ${textOf(one.across_px)} px, ${textOf(one.amplitude_dn)} DN, probability ${textOf(one.probability)}`).join("; ");
}

/** What to do about it, in plain words. @param {Why} why @param {string} lineWord */
function sentenceOf(why, lineWord) {
  const { words, cure } = reasonOf(why.status);
  const begin = `Frame ${why.frame}, ${lineWord} ${why.line}:`;
  if (why.status !== "ok") return `${begin} ${why.status}, ${words}.${cure ? ` What helps: ${cure}.` : ""}`;
  if (why.range_m === null) return `${begin} the stripe is here; without a model there is no range.`;
  const sigma = why.sigma_m === null ? "" : ` ± ${lengthText(why.sigma_m)}`;
  const perPixel = why.range_m_per_px === null ? "" : `, where a pixel is ${lengthText(Math.abs(why.range_m_per_px))}`;
  return `${begin} ${lengthText(why.range_m)}${sigma}${perPixel}.`;
}

export class WhyView {
  /** @param {HTMLElement} place the region */
  constructor(place) {
    this.sentence = make("p", { role: "status" });
    this.canvas = make("canvas", { role: "img", "aria-label": "profile of this scan line", class: "profile" });
    this.rows = make("dl", {});
    const numbers = make("div", { class: "numbers", role: "group", "aria-label": "Every number", tabindex: "0" }, this.rows);
    this.details = make("div", { hidden: "" }, this.canvas, numbers);
    place.append(this.sentence, this.details);
    this.sentence.textContent = "Click on the scan or the image, or choose a scan line with the arrow keys and press Enter.";
    /** @type {Why | null} */
    this.why = null;
  }

  /** @param {Why} why @param {string} lineWord "column" or "row" */
  show(why, lineWord) {
    this.why = why;
    this.sentence.textContent = sentenceOf(why, lineWord);
    this.details.hidden = false;
    showRows(this.rows, Object.entries(why).map(([key, value]) => [key, textOf(value)]));
    this.draw();
  }

  /** @param {string} text */
  fail(text) {
    this.sentence.textContent = text;
  }

  draw() {
    const { why, canvas } = this;
    if (!why || this.details.hidden) return;
    const pen = penFor(canvas);
    const { clientWidth: width, clientHeight: height } = canvas;
    const size = why.lit_dn.length;
    const most = Math.max(10, ...why.lit_dn, ...why.dark_dn) * 1.1;
    const last_px = why.first_px + why.step_px * (size - 1);
    /** @param {number} px */
    const x = (px) => 34 + ((px - why.first_px) / Math.max(1, last_px - why.first_px)) * (width - 42);
    /** @param {number} dn */
    const y = (dn) => height - 18 - (dn / most) * (height - 26);
    this.drawFrame(pen, why, [x(Math.max(why.from_px, why.first_px)), x(Math.min(why.to_px, last_px))], y, width, height, most);
    for (const [values, ink, weight] of /** @type {[number[], string, number][]} */ ([[why.dark_dn, "--faint", 1], [why.lit_dn, "--good", 1.5]])) {
      pen.strokeStyle = colour(ink);
      pen.lineWidth = weight;
      pen.beginPath();
      values.forEach((dn, i) => pen.lineTo(x(why.first_px + i * why.step_px), y(dn)));
      pen.stroke();
    }
    for (const one of why.candidates) {
      pen.strokeStyle = colour(one.fate === "chosen" ? "--ink" : "--vermilion");
      pen.setLineDash(one.fate === "chosen" ? [] : [3, 3]);
      pen.lineWidth = 1.5;
      pen.strokeRect(x(one.across_px), 6, 0, height - 24);
    }
    pen.setLineDash([]);
  }

  /** @param {CanvasRenderingContext2D} pen @param {Why} why @param {[number, number]} searched @param {(dn: number) => number} y
   * @param {number} width @param {number} height @param {number} most */
  drawFrame(pen, why, searched, y, width, height, most) {
    pen.fillStyle = colour("--shade");
    pen.fillRect(searched[0], 6, Math.max(0, searched[1] - searched[0]), height - 24);
    pen.fillStyle = colour("--faint");
    pen.font = "12px system-ui, sans-serif";
    pen.fillText(`${most.toFixed(0)}`, 2, 14);
    pen.fillText("DN", 2, 28);
    pen.fillText(short(why.first_px), 34, height - 4);
    const last = `${short(why.first_px + why.step_px * (why.lit_dn.length - 1))} px`;
    pen.fillText(last, width - pen.measureText(last).width - 4, height - 4);
    pen.strokeStyle = colour("--line");
    pen.strokeRect(34, y(0), width - 42, 0);
  }
}
