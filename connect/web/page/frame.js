// SPDX-License-Identifier: Apache-2.0
// What stands around every page: where one is, how striper is, what happened just now, and the secret.
import { api } from "./api.js";
import { byId, offer } from "./dom.js";
import { Session } from "./session.js";

/** @typedef {import("./session.js").Happening} Happening */

export const session = new Session();

const NOTICE_MS = 10_000;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let noticeEnds;

/** @param {string} text @param {string} [severity] */
export function notice(text, severity = "info") {
  const place = byId("notice");
  place.textContent = text;
  place.dataset.severity = severity;
  clearTimeout(noticeEnds);
  noticeEnds = setTimeout(() => {
    place.textContent = "";
  }, NOTICE_MS);
}

/** @param {Happening} one */
export const sentence = (one) => `${one.message}${one.advice ? ` (${one.advice})` : ""}`;

/** Words for a state, and how old what is shown is. */
function stateWords() {
  const head = session.headStatus();
  const playing = head?.plays ? `, playing ${head.plays}` : "";
  return {
    lost: "striper does not answer",
    idle: head ? `no scan yet: the source is ${head.state}` : "connected, no scan yet",
    stale: head?.state === "streaming" ? "frames come, and no scan of them: are the lasers on?" : `no scans: the source is ${head?.state ?? "silent"}`,
    streaming: `streaming${playing}`,
  };
}

/** @param {HTMLElement} place @param {string} text */
function put(place, text) {
  if (place.textContent !== text) place.textContent = text;
}

function showState() {
  const state = session.state();
  document.body.dataset.state = state;
  document.body.dataset.scans = String(session.scans);
  put(byId("state"), session.warning ? `${stateWords()[state]}; ${session.warning}` : stateWords()[state]);
  const isOld = session.arrived_ms > 0 && (state === "stale" || state === "lost");
  put(byId("age"), isOld ? `- what is shown is ${session.seconds(session.age_ms())} old` : "");
}

/** Shows whether this browser may change something. @param {boolean} isAllowed */
function showAccess(isAllowed) {
  byId("access").setAttribute("aria-pressed", String(isAllowed));
  byId("access").textContent = isAllowed ? "Logged in" : "Log in";
  document.body.dataset.access = isAllowed ? "change" : "look";
  session.dispatchEvent(new CustomEvent("access", { detail: isAllowed }));
}

/** Asks for the secret where it is needed. @returns {Promise<boolean>} whether something may be changed now */
export async function mayChange() {
  if (await api.mayChange()) {
    showAccess(true);
    return true;
  }
  return askForToken();
}

/** @returns {Promise<boolean>} */
function askForToken() {
  const dialog = byId("login");
  byId("login_why").textContent = "";
  dialog.showModal();
  byId("token").focus();
  return new Promise((done) => {
    dialog.onclose = () => done(document.body.dataset.access === "change");
  });
}

/** @param {SubmitEvent} event */
async function login(event) {
  event.preventDefault();
  try {
    await api.login(byId("token").value.trim());
    byId("token").value = "";
    showAccess(true);
    byId("login").close();
  } catch (error) {
    byId("login_why").textContent = String(/** @type {Error} */ (error).message);
  }
}

/** Does what somebody asked for, and says what came of it. @param {() => Promise<any>} deed @param {{isFree?: boolean}} [about] */
export async function attempt(deed, { isFree = false } = {}) {
  try {
    if (!isFree && !(await mayChange())) return notice("nothing was changed: that needs the secret", "warning");
    const { message } = (await deed()) ?? {};
    if (message) notice(message);
  } catch (error) {
    notice(String(/** @type {Error} */ (error).message), "error");
  }
  session.ask();
}

/** Fills a list with the heads there are; what was chosen holds on all pages. @param {HTMLSelectElement} select @param {() => void} onChosen */
export function chooseHeads(select, onChosen) {
  const refill = () => {
    const heads = session.heads.length > 0 ? session.heads : (session.status?.heads.map(({ name }) => name) ?? []);
    offer(select, heads.map((head) => [head, head]), session.head || session.headName());
  };
  session.addEventListener("heads", refill);
  session.addEventListener("status", refill);
  select.addEventListener("change", () => {
    session.choose(select.value);
    onChosen();
  });
  refill();
}

function begin() {
  for (const link of document.querySelectorAll("nav a")) {
    if (link.getAttribute("href") === location.pathname) link.setAttribute("aria-current", "page");
  }
  byId("access").addEventListener("click", mayChange);
  byId("login_cancel").addEventListener("click", () => byId("login").close());
  byId("login").querySelector("form").addEventListener("submit", login);
  session.addEventListener("state", showState);
  session.addEventListener("happened", (event) => {
    const { fresh, isOldNews } = /** @type {CustomEvent} */ (event).detail;
    const last = fresh.at(-1);
    if (!isOldNews) notice(sentence(last), last.severity);
  });
  let knownOf = "";
  session.addEventListener("status", async () => {
    if (knownOf === session.sessionId) return;
    knownOf = session.sessionId;
    showAccess(await api.mayChange());
  });
  showState();
}

begin();
