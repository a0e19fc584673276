// SPDX-License-Identifier: Apache-2.0
// Reads Striper's files with other people's readers.
//
//   node judge.mjs messages FILE.mcap EXPECTED.jsonl   every message, by index and as a stream, field by field; and what
//                                                      a file must keep to beyond what these readers check themselves
//   node judge.mjs refused FILE.mcap...                each must be refused
//   node judge.mjs points FILE.ply|pcd|las EXPECTED.json
//
// Values in EXPECTED are what C++ has, to the bit: "f64:" and "f32:" with the number's bits, "i:", "b:", "s:".
import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

function check(is_so, what) {
  if (!is_so) throw new Error(what);
}

/** Whether a value that was read is the expected one, to the bit. */
function compare(read, expected, path) {
  if (Array.isArray(expected)) {
    check(read.length === expected.length, `${path}: ${read.length} elements, ${expected.length} expected`);
    expected.forEach((value, index) => compare(read[index], value, `${path}[${index}]`));
  } else if (typeof expected === "object") {
    check(Object.keys(read).length === Object.keys(expected).length, `${path}: fields ${Object.keys(read)}`);
    for (const [name, value] of Object.entries(expected)) compare(read[name], value, `${path}.${name}`);
  } else {
    check(as_text(read, expected) === expected, `${path}: ${as_text(read, expected)}, ${expected} expected`);
  }
}

function as_text(read, like) {
  const view = new DataView(new ArrayBuffer(8));
  const kind = like.split(":")[0];
  if (kind === "f64" || kind === "f32") {
    check(typeof read === "number", `a ${typeof read} where a number is expected`);
    kind === "f64" ? view.setFloat64(0, read) : view.setFloat32(0, read);
    const bits = kind === "f64" ? view.getBigUint64(0).toString(16).padStart(16, "0") : view.getUint32(0).toString(16).padStart(8, "0");
    return `${kind}:${bits}`;
  }
  return kind === "b" ? `b:${read ? 1 : 0}` : `${kind}:${read}`;
}

/** Compares messages as they come with the lines of EXPECTED. */
class Messages {
  constructor(expected) {
    this.expected = expected;
    this.readers = new Map();
    this.next = 0;
  }

  take(message, channel, schema) {
    const expected = this.expected[this.next++];
    check(expected !== undefined, "more messages than were written");
    check(channel.topic === expected.topic, `${channel.topic}, ${expected.topic} expected`);
    check(channel.messageEncoding === "cdr" && schema.encoding === "ros2msg", "encodings");
    check(channel.metadata.get("offered_qos_profiles")?.includes("reliability: 1"), "quality of service");
    check(/^RIHS01_[0-9a-f]{64}$/.test(channel.metadata.get("topic_type_hash") ?? ""), "hash");
    check(message.sequence === expected.sequence, "sequence");
    check(message.logTime === BigInt(expected.log_time), "log time");
    let reader = this.readers.get(schema.name);
    if (!reader) {
      const text = new TextDecoder().decode(schema.data);
      reader = new MessageReader(parse(text, { ros2: true }));
      this.readers.set(schema.name, reader);
    }
    compare(reader.readMessage(message.data), expected.message, schema.name);
  }

  end() {
    check(this.next === this.expected.length, `${this.next} messages, ${this.expected.length} expected`);
    return this.readers.size;
  }
}

function readable(handle, size) {
  return {
    size: async () => BigInt(size),
    read: async (offset, length) => {
      const bytes = new Uint8Array(Number(length));
      const { bytesRead } = await handle.read(bytes, 0, bytes.length, Number(offset));
      check(bytesRead === bytes.length, "read behind the end of the file");
      return bytes;
    },
  };
}

/** By index: what Foxglove's and Lichtblick's players do. */
async function read_indexed(path, messages) {
  const handle = await open(path);
  try {
    const reader = await McapIndexedReader.Initialize({
      readable: readable(handle, (await handle.stat()).size),
      decompressHandlers: await loadDecompressHandlers(),
    });
    for await (const message of reader.readMessages({ validateCrcs: true })) {
      const channel = reader.channelsById.get(message.channelId);
      messages?.take(message, channel, reader.schemasById.get(channel.schemaId));
    }
    for await (const attachment of reader.readAttachments({ validateCrcs: true })) check(attachment.data.length > 0, "attachment");
    for await (const metadata of reader.readMetadata()) check(metadata.name.length > 0, "metadata");
    return reader;
  } finally {
    await handle.close();
  }
}

/** As a stream of records, which must end properly. */
async function read_stream(path, take) {
  const reader = new McapStreamReader({ includeChunks: true, validateCrcs: true, decompressHandlers: await loadDecompressHandlers() });
  reader.append(await readFile(path));
  for (let record; (record = reader.nextRecord()); ) take(record);
  check(reader.done(), "the stream does not end properly");
}

/** What Foxglove's `mcap doctor` looks at beyond checksums (rust/cli/src/commands/doctor.rs in foxglove/mcap). */
class Doctor {
  constructor(reader) {
    this.reader = reader;
    this.counts = new Map();
    this.times = [];
    this.chunks = [];
    this.known = new Map();
    this.groups = [];
    this.in_summary = false;
  }

  take(record) {
    if (record.type === "Header") check(record.profile === "ros2" && record.library.startsWith("striper "), "header");
    if (record.type === "DataEnd") this.in_summary = true;
    if (record.type === "Chunk") this.chunks.push(record);
    if (record.type === "Message") {
      this.counts.set(record.channelId, (this.counts.get(record.channelId) ?? 0n) + 1n);
      this.times.push(record.logTime);
      const chunk = this.chunks[this.chunks.length - 1];
      check(record.logTime >= chunk.messageStartTime && record.logTime <= chunk.messageEndTime, "times of a chunk");
    }
    if (record.type === "Schema" || record.type === "Channel") this.check_same(record);
    if (this.in_summary && record.type !== "DataEnd" && record.type !== "SummaryOffset" && record.type !== "Footer") {
      if (this.groups[this.groups.length - 1] !== record.type) this.groups.push(record.type);
    }
  }

  check_same(record) {
    const key = `${record.type} ${record.id}`;
    const text = JSON.stringify(record, (_, value) => (value instanceof Map ? [...value] : value));
    if (this.in_summary) check(this.known.get(key) === text, `${key} of the summary is another`);
    else this.known.set(key, text);
  }

  end() {
    const { statistics, chunkIndexes, channelsById, schemasById } = this.reader;
    check(new Set(this.groups).size === this.groups.length, `the summary is not grouped: ${this.groups}`);
    check(this.groups.indexOf("Channel") < this.groups.indexOf("Statistics"), "channels behind statistics");
    check(statistics !== undefined && statistics.messageCount === BigInt(this.times.length), "statistics: messages");
    check(statistics.chunkCount === this.chunks.length && chunkIndexes.length === this.chunks.length, "statistics: chunks");
    check(statistics.channelCount === channelsById.size && statistics.schemaCount === schemasById.size, "statistics: channels");
    for (const [channel, count] of this.counts) check(statistics.channelMessageCounts.get(channel) === count, "statistics: counts");
    const by_time = (a, b) => (a < b ? -1 : a > b ? 1 : 0);
    const times = [...this.times].sort(by_time);
    check(statistics.messageStartTime === times[0] && statistics.messageEndTime === times[times.length - 1], "statistics: times");
    chunkIndexes.forEach((index, i) => {
      const chunk = this.chunks[i];
      check(index.messageStartTime === chunk.messageStartTime && index.messageEndTime === chunk.messageEndTime, "chunk index: times");
      check(index.compression === chunk.compression && index.uncompressedSize === chunk.uncompressedSize, "chunk index: sizes");
      check(index.compressedSize === BigInt(chunk.records.byteLength), "chunk index: compressed size");
    });
  }
}

async function judge_messages(path, expected_path) {
  const lines = (await readFile(expected_path, "utf8")).trim().split("\n").map((line) => JSON.parse(line));
  const by_index = new Messages(lines);
  const reader = await read_indexed(path, by_index);
  const types = by_index.end();
  const doctor = new Doctor(reader);
  const as_stream = new Messages(lines);
  await read_stream(path, (record) => {
    doctor.take(record);
    if (record.type !== "Message") return;
    const channel = reader.channelsById.get(record.channelId);
    as_stream.take(record, channel, reader.schemasById.get(channel.schemaId));
  });
  as_stream.end();
  doctor.end();
  console.log(`${path}: ${lines.length} messages of ${types} types agree to the bit`);
}

/** By index and as a stream: one of them must refuse, as programs use one or the other for different parts. */
async function judge_refused(path) {
  try {
    await read_indexed(path);
    await read_stream(path, () => {});
  } catch (error) {
    console.log(`${path}: refused: ${error.message}`);
    return;
  }
  throw new Error(`${path}: was not refused`);
}

const [command, ...paths] = process.argv.slice(2);
if (command === "messages") await judge_messages(...paths);
else if (command === "refused") for (const path of paths) await judge_refused(path);
else if (command === "points") await (await import("./judge_points.mjs")).judge_points(...paths);
else throw new Error("usage: judge.mjs messages FILE EXPECTED | refused FILE... | points FILE EXPECTED");
