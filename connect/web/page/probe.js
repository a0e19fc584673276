// SPDX-License-Identifier: Apache-2.0
// A worker that, when it is told to, asks until the server answers, and says so.
const wait = (/** @type {number} */ ms) => new Promise((done) => setTimeout(done, ms));

async function probe() {
  for (let wait_ms = 250; ; wait_ms = Math.min(2000, 1.5 * wait_ms)) {
    await wait(wait_ms);
    const answer = await fetch("/healthz").catch(() => null);
    if (answer?.ok) return postMessage("there");
  }
}

onmessage = probe;
