// SPDX-License-Identifier: Apache-2.0
// Health: what striper finds wrong now, each with its cure.
import { api } from "./api.js";
import { byId, make } from "./dom.js";
import { chooseHeads, session } from "./frame.js";

/** @typedef {{code: string, severity: "info" | "warning" | "error" | "refusal", what: string, cure: string}} Finding */

const ASK_MS = 1500;
const WORDS = { info: "good", warning: "doubtful", error: "bad", refusal: "not to be trusted" };
/** @type {Finding[]} */
const NONE = [];

/** @param {Finding} one */
function itemOf({ code, severity, what, cure }) {
  const cureLine = cure ? [make("p", { class: "cure" }, make("b", { text: "What to do: " }), cure)] : [];
  return make("li", { "data-code": code, "data-severity": severity }, make("p", {}, make("b", { text: `${WORDS[severity]}: ` }), what), ...cureLine);
}

/** @param {Finding[]} findings */
function verdict(findings) {
  const bad = findings.filter((one) => one.severity === "error" || one.severity === "refusal").length;
  const doubtful = findings.filter((one) => one.severity === "warning").length;
  if (bad + doubtful === 0) return findings.length === 0 ? "nothing was looked at yet" : "All is well.";
  return `${bad} bad, ${doubtful} doubtful: what is worst stands first.`;
}

let shown = "";

/** Only what changed is drawn. @param {Finding[]} findings */
function show(findings) {
  const wanted = JSON.stringify(findings);
  if (wanted === shown) return;
  shown = wanted;
  byId("findings").replaceChildren(...findings.map(itemOf));
  byId("verdict").textContent = verdict(findings);
}

async function ask() {
  const name = session.headName();
  if (!session.isOpen) {
    show([{ code: "connection_lost", severity: "error", what: "striper does not answer", cure: "start it again; this page comes back by itself" }]);
  } else if (name && !document.hidden) {
    show(await api.findings(name).catch(() => NONE));
  }
}

chooseHeads(byId("head"), ask);
session.addEventListener("status", ask, { once: true });
setInterval(ask, ASK_MS);
