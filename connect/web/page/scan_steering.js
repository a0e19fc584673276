// SPDX-License-Identifier: Apache-2.0
// Mouse, fingers and keys on the scan: zoom, pan, choose.

/** @typedef {import("./scan_view.js").ScanView} ScanView
 * @typedef {import("./scan_view.js").Pick} Pick
 * @typedef {{onMoved: () => void, onPicked: (pick: Pick | null) => void, onStep: (by: number) => void, onAsk: () => void,
 *   onMark: () => void, onFreeze: () => void}} Steered */

const A_CLICK_PX = 5; // What moves less was none.
const PAN_PX = 60;

/** @param {ScanView} view @param {Steered} told */
export function steer(view, told) {
  steerByPointer(view, told);
  view.canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || !obeyKey(event, view, told)) return;
    event.preventDefault();
    told.onMoved();
  });
  view.canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      view.port.zoom(1.0015 ** -event.deltaY, event.offsetX, event.offsetY);
      told.onMoved();
    },
    { passive: false },
  );
}

/** @param {KeyboardEvent} event @param {ScanView} view @param {Steered} told @returns {boolean} whether the key has a meaning */
function obeyKey(event, view, told) {
  /** @type {Record<string, () => void>} */
  const deeds = {
    arrowleft: () => told.onStep(event.shiftKey ? -10 : -1),
    arrowright: () => told.onStep(event.shiftKey ? 10 : 1),
    enter: told.onAsk,
    m: told.onMark,
    " ": told.onFreeze,
    0: () => view.port.reset(),
    "+": () => view.port.zoom(1.25),
    "=": () => view.port.zoom(1.25),
    "-": () => view.port.zoom(0.8),
    w: () => view.port.pan(0, PAN_PX),
    s: () => view.port.pan(0, -PAN_PX),
    a: () => view.port.pan(PAN_PX, 0),
    d: () => view.port.pan(-PAN_PX, 0),
  };
  const deed = deeds[event.key.toLowerCase()];
  deed?.();
  return deed !== undefined;
}

/** One finger or the mouse pans, two zoom, and what hardly moved chooses. @param {ScanView} view @param {Steered} told */
function steerByPointer(view, told) {
  const { canvas, port } = view;
  /** @type {Map<number, {x: number, y: number}>} */
  const down = new Map();
  let moved_px = 0;
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    if (down.size === 1) moved_px = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const from = down.get(event.pointerId);
    if (!from) return;
    const to = { x: event.offsetX, y: event.offsetY };
    moved_px += Math.hypot(to.x - from.x, to.y - from.y);
    if (down.size === 1 && moved_px > A_CLICK_PX) port.pan(to.x - from.x, to.y - from.y);
    const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
    if (other) port.zoom(Math.hypot(to.x - other.x, to.y - other.y) / Math.max(1, Math.hypot(from.x - other.x, from.y - other.y)), other.x, other.y);
    down.set(event.pointerId, to);
    told.onMoved();
  });
  const lift = (/** @type {PointerEvent} */ event) => {
    if (down.delete(event.pointerId) && event.type === "pointerup" && moved_px <= A_CLICK_PX) told.onPicked(view.pick(event.offsetX, event.offsetY));
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
}
