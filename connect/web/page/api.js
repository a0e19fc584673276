// SPDX-License-Identifier: Apache-2.0
// What is asked of the program by HTTP. Who was refused gets the reason as an Error.

/** @param {string} method @param {string} path @param {object} [body] @returns {Promise<any>} */
async function ask(method, path, body) {
  const answer = await fetch(path, { method, body: body === undefined ? undefined : JSON.stringify(body) });
  const made = await answer.json();
  if (!answer.ok) throw new Error(made.error ?? `the answer was ${answer.status}`);
  return made;
}

/** @param {string} head @param {string} word */
const ofHead = (head, word) => `/api/v1/heads/${encodeURIComponent(head)}/${word}`;

/** @param {string} name */
const ofRecording = (name) => `/api/v1/recordings/${encodeURIComponent(name)}`;

export const api = {
  status: () => ask("GET", "/api/v1/status"),
  /** @param {number} since */
  events: (since) => ask("GET", `/api/v1/events?since=${since}`),
  /** Whether this browser may change something. @returns {Promise<boolean>} */
  mayChange: async () => (await ask("GET", "/api/v1/login")).may_change,
  /** @param {string} token */
  login: (token) => ask("POST", "/api/v1/login", { token }),
  /** @param {string} head @param {string} command @param {object} [body] */
  command: (head, command, body) => ask("POST", ofHead(head, command), body ?? {}),
  /** @param {string} head @param {number} line */
  why: (head, line) => ask("GET", `/api/v1/why?head=${encodeURIComponent(head)}&line=${line}`),
  /** @param {string} head @param {number} laser */
  pieces: (head, laser) => ask("GET", `/api/v1/pieces?head=${encodeURIComponent(head)}&laser=${laser}`),
  /** @param {string} head */
  settings: (head) => ask("GET", ofHead(head, "settings")),
  /** @param {string} head @param {object} values */
  set: (head, values) => ask("PUT", ofHead(head, "parameters"), values),
  /** @param {string} head */
  findings: (head) => ask("GET", ofHead(head, "findings")),
  recordings: () => ask("GET", "/api/v1/recordings"),
  /** @param {string} name */
  recordingInfo: (name) => ask("GET", `${ofRecording(name)}/info`),
  /** @param {string} name */
  recordingFile: (name) => ofRecording(name),
  /** @param {string} name */
  play: (name) => ask("POST", `${ofRecording(name)}/play`, {}),
  stopPlaying: () => ask("POST", "/api/v1/playback/stop", {}),
};
