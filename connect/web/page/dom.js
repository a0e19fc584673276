// SPDX-License-Identifier: Apache-2.0
// Elements, shorter.

/** @param {string} id @returns {any} */
export const byId = (id) => document.getElementById(id);

/**
 * @param {string} tag @param {Record<string, string>} [attributes] "text" is what stands in it
 * @param {...(Node | string)} children @returns {any}
 */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "text") element.textContent = value;
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** Replaces the options of a list, where they are others. @param {HTMLSelectElement} select @param {[string, string][]} options value and text
 * @param {string} chosen */
export function offer(select, options, chosen) {
  const wanted = JSON.stringify([options, chosen]);
  if (select.dataset.offered === wanted) return;
  select.dataset.offered = wanted;
  select.replaceChildren(...options.map(([value, text]) => new Option(text, value, false, value === chosen)));
}

/** @param {HTMLElement} list a dl @param {[string, string][]} rows */
export function showRows(list, rows) {
  list.replaceChildren(...rows.flatMap(([term, text]) => [make("dt", { text: term }), make("dd", { text })]));
}

/** A colour of the style sheet. @param {string} name */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Makes a canvas as large as it is shown, on any screen. @param {HTMLCanvasElement} canvas @returns {CanvasRenderingContext2D} */
export function penFor(canvas) {
  const ratio = devicePixelRatio;
  const width = Math.round(canvas.clientWidth * ratio);
  const height = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
  return pen;
}

/** "12.3 mm" or "1.234 m": as many digits as tell something. @param {number} length_m */
export function lengthText(length_m) {
  if (!Number.isFinite(length_m)) return length_m > 0 ? "infinite" : "none";
  const size = Math.abs(length_m);
  if (size < 1e-3) return `${(1e6 * length_m).toPrecision(3)} µm`;
  return size < 0.1 ? `${(1e3 * length_m).toPrecision(3)} mm` : `${length_m.toFixed(4)} m`;
}
