// SPDX-License-Identifier: Apache-2.0
// A number over the last two minutes.
import { colour, make, penFor } from "./dom.js";

const WINDOW_S = 120;

export class StripChart {
  /** @param {HTMLElement} place @param {string} name @param {(value: number) => string} text how a value is written */
  constructor(place, name, text) {
    this.text = text;
    this.now = make("strong", { text: "-" });
    this.canvas = make("canvas", { role: "img", "aria-label": `${name} over the last two minutes` });
    place.append(make("figure", {}, make("figcaption", {}, `${name} `, this.now), this.canvas));
    /** @type {[number, number][]} seconds and value */
    this.samples = [];
  }

  /** @param {number} time_s @param {number} value NaN where there is none */
  add(time_s, value) {
    this.samples.push([time_s, value]);
    while (this.samples[0][0] < time_s - WINDOW_S) this.samples.shift();
    this.now.textContent = Number.isFinite(value) ? this.text(value) : "none";
    this.draw();
  }

  draw() {
    const pen = penFor(this.canvas);
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const values = this.samples.map(([, value]) => value).filter(Number.isFinite);
    if (values.length === 0) return;
    const most = 1.15 * Math.max(...values, 1e-9);
    const end_s = this.samples[this.samples.length - 1][0];
    /** @type {(sample: [number, number]) => [number, number]} */
    const place = ([time_s, value]) => [width - 2 + ((time_s - end_s) / WINDOW_S) * width, height - 2 - (value / most) * (height - 4)];
    pen.strokeStyle = colour("--line");
    pen.strokeRect(0.5, height - 1.5, width, 0);
    pen.strokeStyle = colour("--good");
    pen.lineWidth = 1.5;
    pen.beginPath();
    let isDown = false;
    for (const sample of this.samples) {
      if (!Number.isFinite(sample[1])) isDown = false;
      else if (isDown) pen.lineTo(...place(sample));
      else pen.moveTo(...place(sample));
      isDown = Number.isFinite(sample[1]);
    }
    pen.stroke();
  }
}
