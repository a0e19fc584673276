// SPDX-License-Identifier: Apache-2.0
// The live page: the newest scan from above, the camera's image, why a scan line is what it is, and how all of it goes.
import { api } from "./api.js";
import { secondsOf } from "./cdr.js";
import { CameraView } from "./camera_view.js";
import { byId, lengthText, make, offer, showRows } from "./dom.js";
import { attempt, chooseHeads, sentence, session } from "./frame.js";
import { hasRanges, isPlaced, measure, planeOf } from "./plane.js";
import { REASONS, countReasons } from "./reasons.js";
import { steer } from "./scan_steering.js";
import { ScanView } from "./scan_view.js";
import { StripChart } from "./strip_chart.js";
import { WhyView } from "./why_view.js";

/**
 * @typedef {import("./plane.js").PolarScan} PolarScan
 * @typedef {import("./scan_view.js").Pick} Pick
 */

const PAINT_MS = 30; // More is not seen, and takes from the scanner.
const HIDDEN_MS = 1000; // Of a window that is hidden browsers ask for no frames: it is of now all the same when it is looked at.
const PIECES_MS = 500;
const CHART_MS = 500;
const ALL = "all";

const view = new ScanView(byId("above"));
const camera = new CameraView(byId("camera"));
const whyView = new WhyView(byId("why"));
const charts = {
  rate: new StripChart(byId("charts"), "Scans a second", (value) => value.toFixed(1)),
  latency: new StripChart(byId("charts"), "Latency", (value) => `${value.toFixed(1)} ms`),
  fill: new StripChart(byId("charts"), "Fill", (value) => `${(100 * value).toFixed(1)} %`),
  sigma: new StripChart(byId("charts"), "Median sigma", (value) => (isMetric() ? lengthText(value) : `${value.toFixed(3)} px`)),
  amplitude: new StripChart(byId("charts"), "Amplitude", (value) => `${value.toFixed(0)} DN`),
};

const page = {
  /** @type {Map<number, () => PolarScan>} */ waiting: new Map(),
  /** @type {Map<number, PolarScan>} */ scans: new Map(),
  /** @type {any} */ frameInfo: null,
  isFrozen: false,
  isMeasuring: false,
  isDirty: true,
  painted_ms: 0,
  drawn: 0,
  chosenLine: -1,
  chosenLaser: -1,
  hasModel: false,
  scansAtChart: 0,
};

const isMetric = () => page.hasModel;
const lineWord = () => (camera.scan?.axis === 1 ? "row" : "column");

// ---- What comes.

session.want(["polar_scan", "frame_info", "image_raw/compressed"]);
session.addEventListener("message", (event) => {
  const { topic, decode } = /** @type {CustomEvent} */ (event).detail;
  if (topic === "polar_scan") {
    keepNewest(decode);
  } else if (topic === "frame_info") {
    page.frameInfo = decode();
  } else if (!page.isFrozen) {
    takeImage(decode());
  }
});

/** Decoded when it is drawn: those that nobody sees cost nothing. @param {() => PolarScan} decode */
function keepNewest(decode) {
  if (page.isFrozen) return;
  const several = (session.headStatus()?.lasers ?? 1) > 1;
  const laser = several ? decode().laser : 0;
  page.waiting.set(laser, decode);
  page.isDirty = true;
}

/** @param {{data: Uint8Array<ArrayBuffer>}} message */
async function takeImage({ data }) {
  if (await camera.take(data, page.frameInfo)) page.isDirty = true;
}

function takeScans() {
  for (const decode of page.waiting.values()) {
    const scan = decode();
    page.scans.set(scan.laser, scan);
    if (hasRanges(scan)) page.hasModel = true;
  }
  page.waiting.clear();
}

/** @returns {PolarScan[]} those of the laser that is chosen */
function shownScans() {
  const wanted = byId("laser").value;
  return [...page.scans.values()].filter((scan) => wanted === ALL || wanted === "" || String(scan.laser) === wanted);
}

// ---- What is drawn.

function paintOnTime() {
  requestAnimationFrame(paintOnTime);
  paint(PAINT_MS);
}

/** @param {number} every_ms */
function paint(every_ms) {
  const now = performance.now();
  if (!page.isDirty || now - page.painted_ms < every_ms) return;
  page.isDirty = false;
  page.painted_ms = now;
  takeScans();
  const scans = shownScans();
  view.set(scans.map((scan) => planeOf(scan, page.hasModel)));
  camera.scan = scans[0] ?? null;
  camera.chosenLine = page.chosenLine;
  view.chosen = pickOf(page.chosenLaser, page.chosenLine);
  view.measured = view.measured.flatMap((pick) => pickOf(pick.plane.scan.laser, pick.i) ?? []);
  view.draw();
  camera.draw();
  if (scans.length > 0) document.body.dataset.drawn = String(++page.drawn);
}

/** The return of a scan line as it is now. @param {number} laser @param {number} line @returns {Pick | null} */
function pickOf(laser, line) {
  const plane = view.planes.find((one) => one.scan.laser === laser);
  return plane && line >= 0 && line < plane.x.length ? { plane, i: line } : null;
}

/** @param {Pick} pick */
function returnText({ plane, i }) {
  const { scan } = plane;
  const at = `${lineWord()} ${(scan.axis === 1 ? scan.v_px : scan.u_px)[i]}`;
  const { status, words } = REASONS[scan.status[i]] ?? REASONS[8];
  if (!isPlaced(plane, i)) return `${at}: ${status}, ${words}`;
  if (plane.unit === "px") return `${at}: at ${(scan.axis === 1 ? scan.u_px : scan.v_px)[i].toFixed(2)} px ± ${scan.row_sigma_px[i].toFixed(3)}, ${status}`;
  const calibration = Number.isFinite(scan.sigma_cal_m[i]) ? `, calibration ± ${lengthText(scan.sigma_cal_m[i])}` : "";
  return `${at}: ${lengthText(scan.range_m[i])} ± ${lengthText(scan.sigma_m[i])}${calibration}, ${status}`;
}

function showReading() {
  const scans = shownScans();
  const counts = REASONS.map((_, code) => scans.reduce((sum, scan) => sum + countReasons(scan.status)[code], 0));
  const items = REASONS.flatMap(({ status, words }, code) =>
    counts[code] === 0 ? [] : [make("li", { "data-status": status, title: words }, make("b", { text: status }), ` ${counts[code]}`)],
  );
  byId("reasons").replaceChildren(...items);
  const unit = page.hasModel || scans.length === 0 ? "" : "Without a model there are no ranges: this is the stripe in the image. ";
  byId("reading").textContent = unit + (view.chosen ? returnText(view.chosen) : "");
  const lit = camera.info?.illumination === -1 ? "a dark one, " : "";
  byId("picture").textContent = camera.image.width > 0 && camera.info
    ? `${lit}${camera.image.width} x ${camera.image.height} of ${camera.info.sensor_width} x ${camera.info.sensor_height} pixels; ${camera.saturated} saturated (vermilion)`
    : "no image yet";
  showMeasured();
}

function showMeasured() {
  const [a, b] = view.measured;
  const place = byId("measured");
  if (!page.isMeasuring && !a) place.textContent = "";
  else if (!a || !b) place.textContent = a ? "Now the second point." : "Choose two points: click, or arrow keys and M.";
  else place.textContent = measuredText(a, b);
}

/** @param {Pick} a @param {Pick} b */
function measuredText(a, b) {
  const { distance, sigma, sigmaCal, forward, left } = measure(a.plane, a.i, b.plane, b.i);
  if (a.plane.unit === "px") return `Distance ${distance.toFixed(2)} px ± ${sigma.toFixed(3)} px.`;
  const calibration = Number.isFinite(sigmaCal) ? `, calibration ± ${lengthText(sigmaCal)}` : "";
  return `Distance ${lengthText(distance)} ± ${lengthText(sigma)} (one sigma)${calibration}; ${lengthText(forward)} forward, ${lengthText(left)} to the left.`;
}

/** @param {ArrayLike<number>} values */
function median(values) {
  const sorted = Array.from(values).filter(Number.isFinite).sort((a, b) => a - b);
  return sorted.length > 0 ? sorted[sorted.length >> 1] : NaN;
}

function chart() {
  const now_s = performance.now() / 1000;
  const scans = session.state() === "streaming" ? shownScans() : [];
  const good = scans.map((scan) => scan.status.reduce((sum, code) => sum + (code === 0 ? 1 : 0), 0));
  const lines = scans.reduce((sum, scan) => sum + scan.status.length, 0);
  /** @param {(scan: PolarScan) => ArrayLike<number>} field */
  const medianOf = (field) => median(scans.flatMap((scan) => Array.from(field(scan)).filter((_, i) => scan.status[i] === 0)));
  const head = session.headStatus();
  charts.rate.add(now_s, session.isOpen ? ((session.scans - page.scansAtChart) * 1000) / CHART_MS : NaN);
  page.scansAtChart = session.scans;
  charts.latency.add(now_s, scans.length > 0 ? (head?.latency_ms ?? NaN) : NaN);
  charts.fill.add(now_s, lines > 0 ? good.reduce((a, b) => a + b, 0) / lines : NaN);
  charts.sigma.add(now_s, medianOf((scan) => (page.hasModel ? scan.sigma_m : scan.row_sigma_px)));
  charts.amplitude.add(now_s, medianOf((scan) => scan.intensity));
  showReading();
}

async function askForPieces() {
  const wanted = byId("pieces").checked && page.hasModel && session.state() === "streaming" && !document.hidden;
  if (!wanted && !page.isFrozen) view.pieces = [];
  if (!wanted || page.isFrozen) return;
  try {
    const answers = await Promise.all(shownScans().map((scan) => api.pieces(session.headName(), scan.laser)));
    if (!page.isFrozen) view.pieces = answers.flatMap((one) => one.pieces);
  } catch {
    view.pieces = [];
  }
}

// ---- What people do.

function forgetScans() {
  page.waiting.clear();
  page.scans.clear();
  page.hasModel = false;
  view.measured = [];
  view.pieces = [];
  view.port.reset();
  page.chosenLine = -1;
  page.isDirty = true;
}

function offerLasers() {
  const { lasers = 1 } = session.headStatus() ?? {};
  const numbers = Array.from({ length: lasers }, (_, k) => String(k));
  const chosen = numbers.includes(byId("laser").value) ? byId("laser").value : ALL;
  offer(byId("laser"), [[ALL, "all"], .../** @type {[string, string][]} */ (numbers.map((one) => [one, one]))], chosen);
}

chooseHeads(byId("head"), forgetScans);
session.addEventListener("heads", offerLasers);
byId("laser").addEventListener("change", () => {
  view.port.reset();
  page.isDirty = true;
});

/** @param {string} command @param {object} [body] */
const tell = (command, body) => () => api.command(session.headName(), command, body);
byId("start").addEventListener("click", () => attempt(tell("start")));
byId("stop").addEventListener("click", () => attempt(tell("stop")));
byId("lasers_off").addEventListener("click", () => attempt(tell("lasers_off"), { isFree: true }));
byId("record").addEventListener("click", () => attempt(tell("record", { seconds: Number(byId("seconds").value) })));

/** @param {string} id @param {boolean} isOn */
const press = (id, isOn) => byId(id).setAttribute("aria-pressed", String(isOn));

function freeze() {
  page.isFrozen = !page.isFrozen;
  press("freeze", page.isFrozen);
}
byId("freeze").addEventListener("click", freeze);

byId("bright").addEventListener("click", () => {
  camera.isBright = !camera.isBright;
  press("bright", camera.isBright);
  page.isDirty = true;
});

function toggleMeasuring() {
  page.isMeasuring = !page.isMeasuring;
  view.measured = [];
  press("measure", page.isMeasuring);
  page.isDirty = true;
  showMeasured();
}
byId("measure").addEventListener("click", toggleMeasuring);

/** @param {Pick | null} pick */
function markForMeasuring(pick) {
  if (!pick || !isPlaced(pick.plane, pick.i)) return;
  page.isMeasuring = true;
  press("measure", true);
  view.measured = view.measured.length >= 2 ? [pick] : [...view.measured, pick];
  page.isDirty = true;
  showMeasured();
}

/** @param {Pick | null} pick */
function choose(pick) {
  if (!pick) return;
  page.chosenLine = pick.i;
  page.chosenLaser = pick.plane.scan.laser;
  page.isDirty = true;
  byId("reading").textContent = returnText(pick);
}

async function askWhy() {
  const pick = pickOf(page.chosenLaser, page.chosenLine);
  if (!pick) return;
  const { scan } = pick.plane;
  const info = page.frameInfo;
  const sensor = (scan.axis === 1 ? scan.v_px : scan.u_px)[pick.i];
  const [offset, step] = !info ? [0, 1] : scan.axis === 1 ? [info.grid_v_offset, info.grid_v_step] : [info.grid_u_offset, info.grid_u_step];
  try {
    whyView.show(await api.why(session.headName(), Math.round((sensor - offset) / step)), lineWord());
  } catch (error) {
    whyView.fail(String(/** @type {Error} */ (error).message));
  }
}

/** @param {number} by */
function step(by) {
  const plane = view.planes.find((one) => one.scan.laser === page.chosenLaser) ?? view.planes[0];
  if (!plane) return;
  const from = page.chosenLine < 0 ? plane.x.length >> 1 : page.chosenLine + by;
  choose({ plane, i: Math.min(plane.x.length - 1, Math.max(0, from)) });
}

steer(view, {
  onMoved: () => {
    page.isDirty = true;
  },
  onPicked: (pick) => {
    choose(pick);
    if (page.isMeasuring) markForMeasuring(pick);
    else askWhy();
  },
  onStep: step,
  onAsk: askWhy,
  onMark: () => markForMeasuring(view.chosen),
  onFreeze: freeze,
});
byId("fit").addEventListener("click", () => {
  view.port.reset();
  page.isDirty = true;
});
for (const [id, factor] of /** @type {[string, number][]} */ ([["zoom_in", 1.5], ["zoom_out", 1 / 1.5]])) {
  byId(id).addEventListener("click", () => {
    view.port.zoom(factor);
    page.isDirty = true;
  });
}
byId("camera").addEventListener("click", (/** @type {MouseEvent} */ event) => {
  const i = camera.pick(event.offsetX, event.offsetY);
  const plane = view.planes.find((one) => one.scan === camera.scan);
  if (i < 0 || !plane) return;
  choose({ plane, i });
  askWhy();
});

// ---- How striper is.

/** Clocks that began before 2001 count from when the stream began. @param {number} time_s */
const timeText = (time_s) => (time_s < 978_307_200 ? `${time_s.toFixed(3)} s on its clock` : new Date(1000 * time_s).toISOString().replace("T", " "));

session.addEventListener("status", () => {
  const head = session.headStatus();
  if (!head) return;
  offerLasers();
  const scan = camera.scan;
  /** @type {[string, string][]} */
  const rows = [
    ["head", `${head.name}, ${head.state}`],
    ["source", head.plays ? `${head.source} (played back)` : head.source],
    ["model", head.model ?? "none: no ranges, the stripe alone"],
    ["frames", `${head.rate_hz.toFixed(1)} a second`],
    ["scans", String(head.scans)],
    ["last scan", scan ? timeText(secondsOf(scan.header.stamp)) : "none"],
    ["dropped", String(head.dropped)],
    ["reconnections", String(head.reconnects)],
    .../** @type {[string, string][]} */ ((session.status?.sinks ?? []).map(({ uri, state, written, lost }) => ["to", `${uri}: ${state}, ${written} written, ${lost} lost`])),
    ["version", session.status?.version ?? ""],
  ];
  showRows(byId("facts"), rows);
});

session.addEventListener("happened", (event) => {
  const list = byId("events");
  for (const one of /** @type {CustomEvent} */ (event).detail.fresh) {
    const time = new Date(1000 * one.time_s).toLocaleTimeString();
    list.prepend(make("li", { "data-code": one.code, "data-severity": one.severity }, make("time", { text: time }), ` ${one.code}: ${sentence(one)}`));
  }
  while (list.children.length > 100) list.lastElementChild.remove();
});

addEventListener("resize", () => {
  page.isDirty = true;
  whyView.draw();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
  page.isDirty = true;
});
offerLasers();
paintOnTime();
setInterval(() => paint(HIDDEN_MS), HIDDEN_MS);
setInterval(chart, CHART_MS);
setInterval(askForPieces, PIECES_MS);
