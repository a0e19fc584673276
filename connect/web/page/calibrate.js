// SPDX-License-Identifier: Apache-2.0
// The place of guided calibration: until it is there, the command line's way, with this source in it.
import { byId } from "./dom.js";
import { session } from "./frame.js";

/** @param {string} text */
const quoted = (text) => (/^[\w:./=-]+$/.test(text) ? text : `'${text}'`);

session.addEventListener("status", () => {
  const head = session.headStatus();
  if (!head) return;
  byId("record_line").textContent = `striper record ${quoted(head.source)} -o shots --when-board 8x6`;
  byId("verify_line").textContent = `striper verify ${quoted(head.source)} --model striper.yaml`;
  byId("model").hidden = head.model === null || head.scans === 0;
  byId("model").href = `/api/v1/model?head=${encodeURIComponent(head.name)}`;
  byId("model_name").textContent = head.model ?? "none, the stripe alone is found";
});
