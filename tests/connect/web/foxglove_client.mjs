// SPDX-License-Identifier: Apache-2.0
// Hears a server with Foxglove's own client, decodes what it hears by the schemas that the server offers, and says everything as lines
// of JSON, so that the test decides. What it is to do comes as lines of JSON on its standard input.
//
//   node foxglove_client.mjs URL SUBPROTOCOL...
import { createInterface } from "node:readline";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import foxglove from "@foxglove/ws-protocol";
import { WebSocket } from "ws";

const [url, ...subprotocols] = process.argv.slice(2);
const plain = (_key, value) => {
  if (typeof value === "bigint") return String(value);
  if (typeof value === "number" && !Number.isFinite(value)) return Number.isNaN(value) ? null : value > 0 ? "inf" : "-inf";
  if (ArrayBuffer.isView(value)) return value instanceof Uint8Array ? Buffer.from(value).toString("base64") : [...value];
  return value;
};
const say = (what, value) => process.stdout.write(`${JSON.stringify({ what, value }, plain)}\n`);

const socket = new WebSocket(url, subprotocols);
socket.binaryType = "arraybuffer";
const client = new foxglove.FoxgloveClient({ ws: socket });
const channels = new Map();
const readers = new Map();
const services = new Map();
const decoder = new TextDecoder();

client.on("open", () => say("open", socket.protocol));
client.on("close", () => say("close", null));
client.on("error", (error) => say("error", String(error.message ?? error)));
for (const event of ["serverInfo", "status", "parameterValues", "serviceCallFailure"]) client.on(event, (value) => say(event, value));
client.on("advertise", (fresh) => {
  for (const channel of fresh) channels.set(channel.topic, channel);
  say("topics", [...channels.keys()]);
});
client.on("advertiseServices", (fresh) => {
  for (const service of fresh) services.set(service.name, service);
  say("services", [...services.keys()]);
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const { topic, reader } = readers.get(subscriptionId);
  say("message", { topic, timestamp, message: reader.readMessage(data) });
});
client.on("serviceCallResponse", ({ callId, encoding, data }) => say("serviceCallResponse", { callId, encoding, text: decoder.decode(data) }));

const subscriptions = new Map();
const deeds = {
  subscribe(topic) {
    const channel = channels.get(topic);
    const id = client.subscribe(channel.id);
    subscriptions.set(topic, id);
    readers.set(id, { topic, reader: new MessageReader(parse(channel.schema, { ros2: true })) });
  },
  unsubscribe: (topic) => client.unsubscribe(subscriptions.get(topic)),
  getParameters: (names) => client.getParameters(names, "get"),
  setParameters: (parameters) => client.setParameters(parameters, "set"),
  watchParameters: (names) => client.subscribeParameterUpdates(names),
  call: ({ name, callId, request }) =>
    client.sendServiceCallRequest({
      serviceId: services.get(name).id,
      callId,
      encoding: "json",
      data: new DataView(new TextEncoder().encode(JSON.stringify(request)).buffer),
    }),
  end: () => client.close(),
};
for await (const line of createInterface({ input: process.stdin })) {
  const { what, value } = JSON.parse(line);
  deeds[what](value);
}
client.close();
