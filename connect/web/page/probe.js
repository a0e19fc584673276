// SPDX-License-Identifier: Apache-2.0
// A worker that asks until the server answers, says so, and ends.
const wait = (/** @type {number} */ ms) => new Promise((done) => setTimeout(done, ms));

async function probe() {
  for (let wait_ms = 250; ; wait_ms = Math.min(2000, 1.5 * wait_ms)) {
    await wait(wait_ms);
    const answer = await fetch("/healthz").catch(() => null);
    if (answer?.ok) return postMessage("there");
  }
}

probe();
