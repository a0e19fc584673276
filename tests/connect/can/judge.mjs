// SPDX-License-Identifier: Apache-2.0
// Reads a log of CAN frames by a DBC file with somebody else's reader of both: a line of JSON a frame.
//   node judge.mjs FILE.dbc LOG
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';

const { Dbc, Can } = createRequire(import.meta.url)('candied');
const [description, log] = process.argv.slice(2);
const dbc = new Dbc();
const can = new Can();
can.database = dbc.load(readFileSync(description, 'utf8'), true);
if (dbc.errors?.size > 0) throw new Error(`the description has errors: ${[...dbc.errors.values()].join('; ')}`);
const lines = [];
for (const line of readFileSync(log, 'utf8').split('\n').filter(Boolean)) {
  const [, id, bytes] = /^\([0-9.]+\) \w+ ([0-9A-F]+)#([0-9A-F]*)$/.exec(line);
  const frame = can.createFrame(parseInt(id, 16), bytes.match(/../g).map((byte) => parseInt(byte, 16)));
  const message = can.decode(frame);
  if (!message) throw new Error(`no message has the identifier ${id}`);
  const values = Object.fromEntries([...message.boundSignals ?? message.signals].map(([name, signal]) => [name, signal.value]));
  lines.push(JSON.stringify({ name: message.name, values }));
}
console.log(lines.join('\n'));
