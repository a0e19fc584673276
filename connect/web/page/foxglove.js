// SPDX-License-Identifier: Apache-2.0
// A client of the Foxglove WebSocket, as far as this page needs one: it finds channels by their topics, and comes back by itself.

/** @typedef {{id: number, topic: string, schemaName: string}} Channel */

export class FoxgloveClient {
  /**
   * @param {string} url
   * @param {{onChannels: (topics: string[]) => void, onMessage: (topic: string, cdr: DataView) => void, onOpen: () => void,
   *   onClose: () => void, onStatus: (text: string) => void}} listener
   */
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
    this.wait_ms = 250;
    this.connect();
  }

  connect() {
    const socket = new WebSocket(this.url, ["foxglove.websocket.v1", "foxglove.sdk.v1"]);
    this.socket = socket;
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.wait_ms = 250;
      this.listener.onOpen();
    };
    socket.onmessage = ({ data }) => (typeof data === "string" ? this.hearText(JSON.parse(data)) : this.hearBytes(new DataView(data)));
    socket.onclose = () => {
      this.channels.clear();
      this.topics.clear();
      this.listener.onClose();
      setTimeout(() => this.connect(), this.wait_ms);
      this.wait_ms = Math.min(5000, 2 * this.wait_ms);
    };
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
    const fresh = [...this.wanted].filter((topic) => this.channels.has(topic) && !have.has(topic));
    for (const id of gone) this.topics.delete(id);
    const subscriptions = fresh.map((topic) => {
      const id = this.nextId++;
      this.topics.set(id, topic);
      return { id, channelId: /** @type {Channel} */ (this.channels.get(topic)).id };
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
    if (message.op === "advertise") {
      for (const channel of message.channels) this.channels.set(channel.topic, channel);
      this.listener.onChannels([...this.channels.keys()]);
      this.agree();
    } else if (message.op === "status") {
      this.listener.onStatus(message.message);
    } else if (message.op === "removeStatus") {
      this.listener.onStatus("");
    }
  }

  /** @param {DataView} data */
  hearBytes(data) {
    const header = 13;
    if (data.byteLength < header || data.getUint8(0) !== 1) return;
    const topic = this.topics.get(data.getUint32(1, true));
    if (topic !== undefined) this.listener.onMessage(topic, new DataView(data.buffer, data.byteOffset + header));
  }
}
