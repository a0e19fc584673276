// SPDX-License-Identifier: Apache-2.0
// The live page: the newest scan from above, how the head is, and what happened.
import { readCloud } from "./cdr.js";
import { FoxgloveClient } from "./foxglove.js";
import { drawScan } from "./scan_view.js";

/** @typedef {import("./cdr.js").Cloud} Cloud */

const STALE_MS = 1500;

/** @param {string} id @returns {any} */
const element = (id) => document.getElementById(id);

const state = {
  /** @type {Cloud | null} */ cloud: null,
  arrived_ms: 0,
  isOpen: false,
  isFrozen: false,
  isDirty: true,
  scans: 0,
  /** @type {any} */ status: null,
  warning: "",
  lastEvent: 0,
};

const client = new FoxgloveClient(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`, {
  onOpen() {
    state.isOpen = true;
  },
  onClose() {
    state.isOpen = false;
  },
  onStatus(text) {
    state.warning = text;
  },
  onChannels: offerHeads,
  onMessage(_topic, cdr) {
    ++state.scans;
    state.arrived_ms = performance.now();
    if (state.isFrozen) return;
    state.cloud = readCloud(cdr);
    state.isDirty = true;
  },
});

/** @param {string[]} topics */
function offerHeads(topics) {
  const select = element("head");
  const heads = topics.filter((topic) => topic.endsWith("/points")).map((topic) => topic.slice(1, -"/points".length));
  const chosen = heads.includes(select.value) ? select.value : heads[0];
  select.replaceChildren(...heads.map((head) => new Option(head, head, false, head === chosen)));
  listen();
}

function listen() {
  const head = element("head").value;
  if (head) client.want([`/${head}/points`]);
}

element("head").addEventListener("change", listen);
element("freeze").addEventListener("click", () => {
  state.isFrozen = !state.isFrozen;
  element("freeze").setAttribute("aria-pressed", String(state.isFrozen));
});
element("lasers_off").addEventListener("click", lasersOff);
addEventListener("resize", () => {
  state.isDirty = true;
});

function paint() {
  if (state.isDirty && state.cloud) {
    const { good, doubtful } = drawScan(element("above"), state.cloud.points);
    element("reading").textContent = `${good} returns ok, ${doubtful} doubtful, frame ${state.cloud.frame_id}`;
    state.isDirty = false;
  }
  requestAnimationFrame(paint);
}

/** @param {[string, string][]} rows */
function showFacts(rows) {
  element("facts").replaceChildren(
    ...rows.flatMap(([name, value]) => {
      const term = document.createElement("dt");
      const text = document.createElement("dd");
      term.textContent = name;
      text.textContent = value;
      return [term, text];
    }),
  );
}

/** Whoever may look may do this; switching them on again is not for a page that anybody opens. */
async function lasersOff() {
  const head = element("head").value || state.status?.heads[0]?.name;
  if (!head) return;
  const answer = await fetch(`/api/v1/heads/${encodeURIComponent(head)}/lasers_off`, { method: "POST" });
  const { message, error } = await answer.json();
  state.warning = error ?? message;
  setTimeout(() => {
    state.warning = "";
  }, 5000);
}

/** What the page is: streaming, stale (no scan for a while), lost (no connection) or idle (none yet). */
function stateNow() {
  if (!state.isOpen) return "lost";
  if (state.scans === 0) return "idle";
  return performance.now() - state.arrived_ms > STALE_MS ? "stale" : "streaming";
}

function say() {
  const now = stateNow();
  const age_s = ((performance.now() - state.arrived_ms) / 1000).toFixed(0);
  const words = {
    lost: "no connection to striper: trying again",
    idle: "connected, no scan yet",
    stale: `no scan for ${age_s} s: what is shown is old`,
    streaming: state.isFrozen ? "streaming, frozen here" : "streaming",
  };
  document.body.dataset.state = now;
  document.body.dataset.scans = String(state.scans);
  element("state").textContent = state.warning ? `${words[now]}; ${state.warning}` : words[now];
}

function showStatus() {
  const head = state.status?.heads.find((/** @type {any} */ one) => one.name === element("head").value) ?? state.status?.heads[0];
  if (!head) return;
  /** @type {[string, string][]} */
  const rows = [
    ["head", `${head.name}, ${head.state}`],
    ["source", head.source],
    ["model", head.model ?? "none: no ranges"],
    ["pictures", `${head.rate_hz.toFixed(1)} a second`],
    ["scans", String(head.scans)],
    ["dropped", String(head.dropped)],
    ["reconnections", String(head.reconnects)],
    ...state.status.sinks.map((/** @type {any} */ sink) => ["to", `${sink.uri}: ${sink.state}, ${sink.written} written, ${sink.lost} lost`]),
    ["version", state.status.version],
  ];
  showFacts(rows);
}

/** @param {any[]} events */
function showEvents(events) {
  const list = element("events");
  for (const event of events) {
    const item = document.createElement("li");
    item.className = event.severity;
    item.textContent = `${event.code}: ${event.message}${event.advice ? ` (${event.advice})` : ""}`;
    list.prepend(item);
    state.lastEvent = Math.max(state.lastEvent, event.n);
  }
  while (list.children.length > 100) list.lastElementChild.remove();
}

async function ask() {
  try {
    state.status = await (await fetch("/api/v1/status")).json();
    showEvents(await (await fetch(`/api/v1/events?since=${state.lastEvent}`)).json());
    showStatus();
  } catch {
    // The connection is lost: the WebSocket says so.
  }
}

paint();
say();
ask();
setInterval(say, 200);
setInterval(ask, 1000);
