// SPDX-License-Identifier: Apache-2.0
// Recordings: what there is, what is in it, download, play back as a head of its own.
import { api } from "./api.js";
import { byId, make, showRows } from "./dom.js";
import { attempt, notice, session } from "./frame.js";

/** @typedef {{name: string, bytes: number, time_s: number}} Recording */

const ASK_MS = 2000;
const PLAYBACK = "playback"; // The head that plays.

/** @param {number} bytes */
function sizeText(bytes) {
  if (bytes < 1e6) return `${(bytes / 1e3).toFixed(1)} kB`;
  return bytes < 1e9 ? `${(bytes / 1e6).toFixed(1)} MB` : `${(bytes / 1e9).toFixed(2)} GB`;
}

/** @param {any} info of `striper info --json` @returns {[string, string][]} */
function infoRows(info) {
  const topics = info.topics.map((/** @type {any} */ one) => `${one.name} ${one.count} (${one.rate_hz.toFixed(1)} a second)`);
  return [
    ["lasts", `${info.duration_s.toFixed(2)} s`],
    ["heads", info.heads.join(", ") || "none"],
    ["frames", String(info.frames)],
    ["scans", `${info.scans}, of laser ${info.lasers.join(", ") || "none"}`],
    ["model", info.model ? Object.values(info.model).join(", ") : "none"],
    ["topics", topics.join(", ")],
    ["damage", info.damage ? `${info.damage.reason}; striper convert saves the rest` : "none: it is whole"],
  ];
}

/** @param {string} name @param {HTMLElement} list */
async function showInfo(name, list) {
  showRows(list, [["", "reading all of it"]]);
  try {
    showRows(list, infoRows(await api.recordingInfo(name)));
  } catch (error) {
    showRows(list, [["", String(/** @type {Error} */ (error).message)]]);
  }
}

/** Plays it, and shows it. @param {string} name */
async function play(name) {
  await attempt(async () => {
    const answer = await api.play(name);
    sessionStorage.setItem("head", PLAYBACK);
    location.assign("/");
    return answer;
  });
}

/** @param {Recording} recording */
function itemOf({ name, bytes, time_s }) {
  const info = make("dl", {});
  const tell = make("button", { type: "button", "aria-label": `Info ${name}` }, "Info");
  tell.addEventListener("click", () => showInfo(name, info));
  const start = make("button", { type: "button", "aria-label": `Play ${name}` }, "Play");
  start.addEventListener("click", () => play(name));
  const load = make("a", { class: "button", href: api.recordingFile(name), download: name, "aria-label": `Download ${name}` }, "Download");
  const about = make("p", { class: "small", text: `${sizeText(bytes)}, ${new Date(1000 * time_s).toLocaleString()}` });
  return make("li", { "data-name": name, "data-bytes": String(bytes) }, make("b", { text: name }), about, make("div", { class: "bar" }, start, tell, load), info);
}

/** Items that are the same stay, with what was asked of them. @param {Recording[]} recordings */
function show(recordings) {
  const list = byId("recordings");
  /** @type {Map<string, any>} */
  const have = new Map([...list.children].map((item) => [item.dataset.name, item]));
  const items = recordings.map((one) => {
    const item = have.get(one.name);
    return item?.dataset.bytes === String(one.bytes) ? item : itemOf(one);
  });
  const isSame = items.length === list.children.length && items.every((item, i) => item === list.children[i]);
  if (!isSame) list.replaceChildren(...items);
  byId("none").hidden = items.length > 0;
}

async function ask() {
  if (!session.isOpen || document.hidden) return;
  try {
    show(await api.recordings());
  } catch (error) {
    notice(String(/** @type {Error} */ (error).message), "error");
  }
}

session.addEventListener("status", () => {
  const played = session.status?.heads.find((one) => one.plays !== null);
  byId("stop_playing").disabled = !played;
  byId("playing").textContent = played ? `Playing ${played.plays}, as the head ${played.name}: ${played.state}. What is measured goes on.` : "";
});

/** The head that measures. */
const measuring = () => session.status?.heads.find((one) => one.plays === null)?.name ?? session.headName();

byId("record").addEventListener("click", async () => {
  await attempt(() => api.command(measuring(), "record", { seconds: Number(byId("seconds").value) }));
  ask();
});
byId("stop_playing").addEventListener("click", () => attempt(api.stopPlaying));
session.addEventListener("status", ask, { once: true });
setInterval(ask, ASK_MS);
