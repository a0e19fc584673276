// SPDX-License-Identifier: Apache-2.0
// What every page knows: whether striper is there, which heads it has, how they are, and what happened.
import { api } from "./api.js";
import { FoxgloveClient } from "./foxglove.js";

/**
 * @typedef {{name: string, state: string, source: string, model: string | null, rate_hz: number, latency_ms: number | null, dropped: number,
 *   reconnects: number, scans: number, last_scan_s: number | null, laser: number | null, lasers: number, plays: string | null}} Head
 * @typedef {{uri: string, state: string, written: number, lost: number}} Sink
 * @typedef {{version: string, uptime_s: number, heads: Head[], sinks: Sink[]}} Status
 * @typedef {{code: string, severity: string, head: string, time_s: number, message: string, advice: string}} Happening
 * @typedef {"streaming" | "stale" | "lost" | "idle"} State
 */

const STALE_MS = 1500;
const TICK_MS = 200;
const ASK_MS = 1000;
const SLEPT_MS = 5000; // A tick that comes so late: the window slept.
const MOST_KEPT = 200;

/** Dispatches "state" (five times a second), "status", "heads", "happened" (detail: the new ones, the oldest first, and whether they are old
 * news) and "message" (detail: topic, decode). */
export class Session extends EventTarget {
  constructor() {
    super();
    /** @type {Status | null} */
    this.status = null;
    /** @type {string[]} */
    this.heads = [];
    /** @type {string[]} */
    this.offered = [];
    this.head = sessionStorage.getItem("head") ?? "";
    this.scans = 0;
    this.arrived_ms = 0;
    this.isOpen = false;
    this.isLost = false;
    this.warning = "";
    this.lost_ms = 0;
    this.lastEvent = 0;
    this.sessionId = "";
    this.last_tick_ms = performance.now();
    this.slept_ms = 0;
    this.frozen_ms = 0;
    /** @type {Happening[]} */
    this.happened = [];
    /** @type {string[]} topics within the chosen head */
    this.wanted = ["polar_scan"];
    this.client = new FoxgloveClient(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/`, this.listener());
    setInterval(() => this.tick(), TICK_MS);
    setInterval(() => this.ask(), ASK_MS);
    document.addEventListener("visibilitychange", () => this.sayThatItSlept());
    document.addEventListener("freeze", () => this.sleep());
    document.addEventListener("resume", () => this.wake());
  }

  /** The browser puts this window to sleep. */
  sleep() {
    this.client.sleep();
    this.isOpen = false;
    this.frozen_ms = performance.now();
  }

  wake() {
    this.slept_ms = performance.now() - this.frozen_ms;
    this.last_tick_ms = performance.now();
    this.client.connect();
    this.sayThatItSlept(true);
  }

  /** @returns {import("./foxglove.js").Listener} */
  listener() {
    return {
      onOpen: () => this.opened(),
      onClose: () => this.closed(),
      onSession: (id) => this.greet(id),
      onTopics: (topics) => this.offerHeads(topics),
      onStatus: (text) => {
        this.warning = text;
      },
      onMessage: (topic, decode) => this.hear(topic, decode),
    };
  }

  opened() {
    this.isOpen = true;
    if (this.isLost) this.note("connection_back", "info", `striper is there again, after ${this.seconds(performance.now() - this.lost_ms)}`);
    this.isLost = false;
    this.ask();
  }

  closed() {
    if (!this.isOpen) return;
    this.isOpen = false;
    this.isLost = true;
    this.lost_ms = performance.now();
    const ended = this.happened.some((one) => one.code === "source_ended") ? "; its source had ended" : "";
    this.note("connection_lost", "warning", `striper does not answer any more${ended}: what is shown is the last that came`, "this page tries again by itself");
  }

  /** Of a program that was started again, events are counted from the start. @param {string} id */
  greet(id) {
    if (this.sessionId !== "" && this.sessionId !== id) {
      this.lastEvent = 0;
      this.note("program_restarted", "info", "striper was started again in between");
    }
    this.sessionId = id;
  }

  /** @param {string[]} topics */
  offerHeads(topics) {
    this.offered = topics.filter((topic) => topic.endsWith("/polar_scan")).map((topic) => topic.slice(1, -"/polar_scan".length));
    this.sortHeads();
  }

  /** Heads have topics from their first frame on, and keep them when they are gone: the status tells those that are there. */
  sortHeads() {
    const there = this.status?.heads.map(({ name }) => name) ?? this.offered;
    const heads = this.offered.filter((head) => there.includes(head));
    const head = heads.includes(this.head) || (this.status === null && this.head !== "") ? this.head : (heads[0] ?? "");
    if (head === this.head && heads.join() === this.heads.join()) return;
    if (head !== this.head) this.scans = 0;
    this.heads = heads;
    this.head = head;
    this.listen();
    this.dispatchEvent(new Event("heads"));
  }

  /** @param {string} head */
  choose(head) {
    this.head = head;
    sessionStorage.setItem("head", head);
    this.scans = 0;
    this.listen();
    this.dispatchEvent(new Event("heads"));
  }

  /** @param {string[]} topics within the head that is chosen, now and later */
  want(topics) {
    this.wanted = topics;
    this.listen();
  }

  listen() {
    if (this.head) this.client.want(this.wanted.map((topic) => `/${this.head}/${topic}`));
  }

  /** @param {string} topic @param {() => any} decode */
  hear(topic, decode) {
    if (topic === `/${this.head}/polar_scan`) {
      ++this.scans;
      this.arrived_ms = performance.now();
    }
    this.dispatchEvent(new CustomEvent("message", { detail: { topic: topic.slice(this.head.length + 2), decode } }));
  }

  /** Of the chosen head; of the first while none gave a scan yet. @returns {Head | undefined} */
  headStatus() {
    return this.status?.heads.find((one) => one.name === this.head) ?? this.status?.heads[0];
  }

  /** The name to ask for: heads have no topics before their first frame. */
  headName() {
    return this.head || this.headStatus()?.name || "";
  }

  /** @returns {State} */
  state() {
    if (!this.isOpen) return "lost";
    if (this.scans === 0) return "idle";
    return this.age_ms() > STALE_MS ? "stale" : "streaming";
  }

  age_ms() {
    return performance.now() - this.arrived_ms;
  }

  /** @param {number} ms */
  seconds(ms) {
    return ms < 120_000 ? `${Math.round(ms / 1000)} s` : `${Math.round(ms / 60_000)} min`;
  }

  tick() {
    const now = performance.now();
    const late_ms = now - this.last_tick_ms;
    this.last_tick_ms = now;
    if (late_ms > SLEPT_MS) this.slept_ms += late_ms;
    this.sayThatItSlept();
    this.dispatchEvent(new Event("state"));
  }

  /** When somebody can see it. @param {boolean} isAwake */
  sayThatItSlept(isAwake = document.visibilityState === "visible") {
    if (this.slept_ms === 0 || !isAwake) return;
    this.note("window_slept", "info", `this window slept for ${this.seconds(this.slept_ms)}: what is shown is of now`);
    this.slept_ms = 0;
  }

  /** @param {string} code @param {string} severity @param {string} message @param {string} [advice] */
  note(code, severity, message, advice = "") {
    this.take([{ code, severity, head: "", time_s: Date.now() / 1000, message, advice }], false);
  }

  /** @param {Happening[]} fresh @param {boolean} isOldNews of before this page was there */
  take(fresh, isOldNews) {
    if (fresh.length === 0) return;
    this.happened = [...this.happened, ...fresh].slice(-MOST_KEPT);
    this.dispatchEvent(new CustomEvent("happened", { detail: { fresh, isOldNews } }));
  }

  /** Only while the WebSocket is open: it says first that striper is gone. */
  async ask() {
    if (!this.isOpen) return;
    try {
      const isOldNews = this.lastEvent === 0;
      const [status, events] = await Promise.all([api.status(), api.events(this.lastEvent)]);
      this.status = status;
      this.sortHeads();
      this.lastEvent = Math.max(this.lastEvent, ...events.map((/** @type {{n: number}} */ one) => one.n));
      this.take(events, isOldNews);
      this.dispatchEvent(new Event("status"));
    } catch {
      // The WebSocket says so, too.
    }
  }
}
