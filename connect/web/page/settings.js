// SPDX-License-Identifier: Apache-2.0
// Settings: the camera's controls and the scanner's options, each with what it may be; what changed since the start.
import { api } from "./api.js";
import { byId, make } from "./dom.js";
import { attempt, chooseHeads, notice, session } from "./frame.js";

/**
 * @typedef {null | boolean | number | string | number[]} Value
 * @typedef {{name: string, of: "camera" | "scanner", type: "number" | "switch" | "word" | "region" | "pose", unit: string, words: string[],
 *   minimum: (number | null)[], maximum: (number | null)[], writable: boolean, if_not_given: string, help: string, value: Value,
 *   at_start: Value}} Setting
 */

const ASK_MS = 2000;
const WRITING_MS = 4000; // Who emptied a field is about to write.
const TITLES = { camera: "Camera", scanner: "Scanner" };
const PARTS = { region: ["left", "top", "width", "height"], pose: ["x", "y", "z", "roll", "pitch", "yaw"] };

/** @type {Setting[]} */
let settings = [];
let built = "";

/** @param {Value} value */
const same = (value) => JSON.stringify(value);

/** @param {Value} value @param {Setting} setting */
function textOf(value, setting) {
  if (value === null) return setting.if_not_given || "none";
  if (typeof value === "boolean") return value ? "on" : "off";
  if (Array.isArray(value)) return value.join(", ");
  return setting.unit && typeof value === "number" ? `${value} ${setting.unit}` : String(value);
}

/** "10 to 10000 us", where there are limits. @param {Setting} setting */
function rangeText({ type, unit, minimum, maximum }) {
  if (type !== "number") return "";
  const [low, high] = [minimum[0] ?? null, maximum[0] ?? null];
  const huge = high === null || high > 1e15;
  if (low === null && huge) return unit;
  if (huge) return `${low} or more ${unit}`;
  return low === null ? `at most ${high} ${unit}` : `${low} to ${high} ${unit}`;
}

// ---- What stands in the form.

/** @param {Setting} setting @param {string} id @returns {HTMLElement} */
function fieldOf(setting, id) {
  const about = { id, name: setting.name, "aria-describedby": `${id}_about` };
  if (setting.type === "switch") return make("input", { ...about, type: "checkbox" });
  if (setting.type === "word") return make("select", about, ...setting.words.map((word) => new Option(word, word)));
  if (setting.type !== "number") return make("input", { ...about, type: "text", inputmode: "decimal", title: PARTS[setting.type].join(", ") });
  const limits = Object.entries({ min: setting.minimum[0], max: setting.maximum[0] }).filter(([, limit]) => typeof limit === "number");
  return make("input", { ...about, type: "number", step: "any", placeholder: setting.if_not_given, ...Object.fromEntries(limits.map(([key, limit]) => [key, String(limit)])) });
}

/** @param {Setting} setting */
function rowOf(setting) {
  const id = `set_${setting.name.replace(/\W/g, "_")}`;
  const field = fieldOf(setting, id);
  field.addEventListener("change", () => change(setting, field));
  const reset = make("button", { type: "button", "aria-label": `${setting.name} as at the start`, title: "as at the start" }, "Undo");
  reset.addEventListener("click", () => put(setting.name, settings.find((one) => one.name === setting.name)?.at_start ?? null));
  const about = [rangeText(setting), setting.help, setting.type === "region" || setting.type === "pose" ? PARTS[setting.type].join(", ") : ""];
  return make(
    "div", { class: "setting", "data-name": setting.name },
    make("label", { for: id, text: setting.name }), make("span", { class: "pair" }, field, reset),
    make("p", { id: `${id}_about`, class: "small", text: about.filter((text) => text !== "").join(". ") }),
  );
}

function build() {
  const groups = /** @type {("camera" | "scanner")[]} */ (["camera", "scanner"]).flatMap((of) => {
    const rows = settings.filter((one) => one.of === of).map(rowOf);
    return rows.length > 0 ? [make("fieldset", {}, make("legend", { text: TITLES[of] }), ...rows)] : [];
  });
  byId("form").replaceChildren(...groups);
}

/** @param {Setting} setting @param {any} field */
function fill(setting, field) {
  const isBeingWritten = document.activeElement === field || (field.value === "" && performance.now() - Number(field.dataset.emptied ?? -Infinity) < WRITING_MS);
  if (isBeingWritten) return;
  if (setting.type === "switch") field.checked = setting.value === true;
  else field.value = setting.value === null ? "" : String(setting.value);
}

function show() {
  const shape = JSON.stringify(settings.map(({ name, words, minimum, maximum }) => [name, words, minimum, maximum]));
  if (shape !== built) build();
  built = shape;
  const isReadOnly = document.body.dataset.access !== "change";
  for (const setting of settings) {
    const row = byId("form").querySelector(`[data-name="${CSS.escape(setting.name)}"]`);
    const field = row.querySelector("input, select");
    fill(setting, field);
    const isChanged = same(setting.value) !== same(setting.at_start);
    row.dataset.changed = String(isChanged);
    field.disabled = isReadOnly || !setting.writable;
    row.querySelector("button").disabled = field.disabled || !isChanged;
    row.querySelector("button").hidden = !isChanged;
  }
  byId("read_only").textContent = isReadOnly ? "These can be read. To change them, log in with the secret." : "";
  byId("load").disabled = isReadOnly;
  showChanges();
}

// ---- What changed, and how to begin with it.

/** @param {string} text */
const quoted = (text) => (/^[\w:./=@%+,-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);

const changes = () => settings.filter((one) => same(one.value) !== same(one.at_start));

function showChanges() {
  const items = changes().map((one) => make("li", { "data-name": one.name, text: `${one.name}: ${textOf(one.value, one)}, at the start ${textOf(one.at_start, one)}` }));
  byId("changed").replaceChildren(...(items.length > 0 ? items : [make("li", { text: "nothing" })]));
  byId("command").textContent = commandLine();
}

/** The camera's go into its address, the scanner's are options. */
function commandLine() {
  const head = session.headStatus();
  if (!head) return "";
  const changed = changes();
  const isInAddress = (/** @type {Setting} */ one) => one.of === "camera" && (one.type === "number" || one.type === "region");
  const query = changed.filter(isInAddress).map((one) => `${one.name}=${one.value}`);
  const address = head.source + (query.length > 0 ? (head.source.includes("?") ? "&" : "?") + query.join("&") : "");
  const options = changed.filter((one) => one.of === "scanner" && one.value !== null).map((one) => ` --${one.name.replaceAll("_", "-")} ${quoted(String(one.value))}`);
  const model = head.model ? ` -m ${quoted(head.model)}` : "";
  return `striper serve ${quoted(address)}${model}${options.join("")} --to web:${location.port || 80}`;
}

/** A file that Load, and PUT /api/v1/heads/H/parameters, take. */
function saveAs() {
  const values = Object.fromEntries(settings.filter((one) => one.writable && one.name !== "laser").map((one) => [one.name, one.value]));
  const link = make("a", { download: `${session.headName()}-settings.json` });
  link.href = URL.createObjectURL(new Blob([`${JSON.stringify(values, null, 2)}\n`], { type: "application/json" }));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

async function load() {
  const [file] = byId("file").files;
  if (!file) return;
  await attempt(async () => {
    await api.set(session.headName(), JSON.parse(await file.text()));
    return { message: `${file.name} holds now` };
  });
  byId("file").value = "";
  ask();
}

// ---- What people do.

/** @param {Setting} setting @param {any} field @returns {Value} */
function valueIn(setting, field) {
  if (setting.type === "switch") return field.checked;
  if (field.value.trim() === "") return null;
  if (setting.type === "word") return field.value;
  const numbers = field.value.split(",").map(Number);
  return setting.type === "number" ? numbers[0] : numbers;
}

/** @param {Setting} setting @param {any} field */
function change(setting, field) {
  const isEmpty = setting.type !== "switch" && field.value.trim() === "";
  if (isEmpty) field.dataset.emptied = String(performance.now());
  if (isEmpty && setting.of === "camera") return; // A camera's control always has a value.
  if (field.validity && !field.validity.valid && !field.validity.stepMismatch) {
    notice(`${setting.name}: ${field.validationMessage}`, "error");
    return;
  }
  put(setting.name, valueIn(setting, field));
}

/** @param {string} name @param {Value} value */
async function put(name, value) {
  await attempt(async () => {
    const all = await api.set(session.headName(), { [name]: value });
    const setting = settings.find((one) => one.name === name);
    return { message: setting ? `${name} is ${textOf(all[name], setting)} now` : "" };
  });
  ask();
}

async function ask() {
  if (!session.isOpen || !session.headName() || document.hidden) return;
  try {
    settings = await api.settings(session.headName());
    show();
  } catch (error) {
    notice(String(/** @type {Error} */ (error).message), "error");
  }
}

byId("form").addEventListener("submit", (/** @type {Event} */ event) => event.preventDefault());
byId("save_as").addEventListener("click", saveAs);
byId("load").addEventListener("click", () => byId("file").click());
byId("file").addEventListener("change", load);
byId("copy").addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText(byId("command").textContent);
    notice("copied");
  } catch {
    notice("this browser does not let a page copy: mark the line by hand", "warning");
  }
});
chooseHeads(byId("head"), ask);
session.addEventListener("status", ask, { once: true });
session.addEventListener("access", show);
setInterval(ask, ASK_MS);
