// SPDX-License-Identifier: Apache-2.0
// A client of the Foxglove WebSocket, as far as these pages need one: it finds channels by their topics, decodes by their schemas, and comes
// back by itself.
import { readMessage } from "./cdr.js";
import { parseSchema } from "./ros_schema.js";

/**
 * @typedef {import("./ros_schema.js").Field} Field
 * @typedef {{id: number, topic: string, fields: Field[]}} Channel
 * @typedef {{onOpen: () => void, onClose: () => void, onSession: (id: string) => void, onTopics: (topics: string[]) => void,
 *   onMessage: (topic: string, decode: () => any) => void, onStatus: (text: string) => void}} Listener
 */

const MESSAGE = 1; // Opcode; then come subscription and time.
const HEADER = 13;

export class FoxgloveClient {
  /** @param {string} url @param {Listener} listener */
  constructor(url, listener) {
    this.url = url;
    this.listener = listener;
    /** @type {Map<string, Channel>} */
    this.channels = new Map();
    /** @type {Map<number, string>} */
    this.topics = new Map();
    /** @type {Set<string>} */
    this.wanted = new Set();
    this.nextId = 1;
    /** Is there before striper may be gone, so that waiting for it fills nobody's log. */
    this.probe = new Worker("probe.js");
    this.probe.onmessage = () => this.connect();
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.url, ["foxglove.websocket.v1", "foxglove.sdk.v1"]);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.listener.onOpen();
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.hearText(JSON.parse(data)) : this.hearBytes(data));
    socket.onclose = () => {
      this.forget();
      this.listener.onClose();
      this.probe.postMessage("begin");
    };
  }

  forget() {
    this.channels.clear();
    this.topics.clear();
  }

  /** Until `connect`: a window that is frozen cannot keep a connection. */
  sleep() {
    if (this.socket) this.socket.onclose = null;
    this.socket?.close();
    this.forget();
  }

  /** @param {string[]} topics */
  want(topics) {
    this.wanted = new Set(topics);
    this.agree();
  }

  /** Subscribes to what is wanted and there, and to nothing else. */
  agree() {
    const have = new Map([...this.topics].map(([id, topic]) => [topic, id]));
    const gone = [...have].filter(([topic]) => !this.wanted.has(topic)).map(([, id]) => id);
    const fresh = [...this.wanted].flatMap((topic) => (have.has(topic) ? [] : (this.channels.get(topic) ?? [])));
    for (const id of gone) this.topics.delete(id);
    const subscriptions = fresh.map((channel) => {
      const id = this.nextId++;
      this.topics.set(id, channel.topic);
      return { id, channelId: channel.id };
    });
    if (gone.length > 0) this.say({ op: "unsubscribe", subscriptionIds: gone });
    if (subscriptions.length > 0) this.say({ op: "subscribe", subscriptions });
  }

  /** @param {object} message */
  say(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** @param {any} message */
  hearText(message) {
    if (message.op === "serverInfo") {
      this.listener.onSession(message.sessionId);
    } else if (message.op === "advertise") {
      for (const { id, topic, schema } of message.channels) this.channels.set(topic, { id, topic, fields: parseSchema(schema) });
      this.listener.onTopics([...this.channels.keys()]);
      this.agree();
    } else if (message.op === "status") {
      this.listener.onStatus(message.message);
    } else if (message.op === "removeStatus") {
      this.listener.onStatus("");
    }
  }

  /** @param {ArrayBuffer} bytes */
  hearBytes(bytes) {
    const data = new DataView(bytes);
    if (data.byteLength < HEADER || data.getUint8(0) !== MESSAGE) return;
    const topic = this.topics.get(data.getUint32(1, true));
    const channel = topic === undefined ? undefined : this.channels.get(topic);
    if (channel) this.listener.onMessage(channel.topic, () => readMessage(new DataView(bytes, HEADER), channel.fields));
  }
}
