// SPDX-License-Identifier: Apache-2.0
// Messages out of CDR's bytes, by their schemas. Sequences of numbers are typed arrays of their own, so that what is read outlives the bytes.

/** @typedef {import("./ros_schema.js").Field} Field */

/** @type {Record<string, [number, (data: DataView, at: number, little: boolean) => number | bigint | boolean]>} */
const NUMBERS = {
  bool: [1, (data, at) => data.getUint8(at) !== 0],
  byte: [1, (data, at) => data.getUint8(at)],
  char: [1, (data, at) => data.getUint8(at)],
  uint8: [1, (data, at) => data.getUint8(at)],
  int8: [1, (data, at) => data.getInt8(at)],
  uint16: [2, (data, at, little) => data.getUint16(at, little)],
  int16: [2, (data, at, little) => data.getInt16(at, little)],
  uint32: [4, (data, at, little) => data.getUint32(at, little)],
  int32: [4, (data, at, little) => data.getInt32(at, little)],
  uint64: [8, (data, at, little) => data.getBigUint64(at, little)],
  int64: [8, (data, at, little) => data.getBigInt64(at, little)],
  float32: [4, (data, at, little) => data.getFloat32(at, little)],
  float64: [8, (data, at, little) => data.getFloat64(at, little)],
};

/** Of these a sequence in this machine's byte order is copied at once. @type {Record<string, any>} */
const ARRAYS = { uint8: Uint8Array, byte: Uint8Array, float32: Float32Array, float64: Float64Array, int32: Int32Array, uint32: Uint32Array };

const IS_LITTLE = new Uint8Array(new Uint16Array([1]).buffer)[0] === 1;
const TEXT = new TextDecoder();

class CdrReader {
  /** @param {DataView} data with the 4 bytes of encapsulation first */
  constructor(data) {
    this.data = data;
    this.little = data.getUint8(1) === 1;
    this.at = 4;
  }

  /** @param {number} size */
  align(size) {
    this.at += (size - ((this.at - 4) % size)) % size;
  }

  /** @param {string} type */
  number(type) {
    const [size, get] = NUMBERS[type];
    this.align(size);
    this.at += size;
    return get(this.data, this.at - size, this.little);
  }

  /** @param {number} size @returns {ArrayBuffer} */
  copy(size) {
    const begin = this.data.byteOffset + this.at;
    if (this.at + size > this.data.byteLength) throw new Error("a message is cut off");
    this.at += size;
    return /** @type {ArrayBuffer} */ (this.data.buffer.slice(begin, begin + size));
  }

  text() {
    const size = Number(this.number("uint32"));
    return TEXT.decode(this.copy(size)).replace(/\0$/, "");
  }

  /** @param {Field} field @returns {any} */
  one(field) {
    if (field.parts) return this.message(field.parts);
    return field.type === "string" ? this.text() : this.number(field.type);
  }

  /** @param {Field} field @param {number} count @returns {any} */
  several(field, count) {
    const Type = this.little === IS_LITTLE ? ARRAYS[field.type] : undefined;
    if (!Type) return Array.from({ length: count }, () => this.one(field));
    if (count > 0) this.align(Type.BYTES_PER_ELEMENT);
    return new Type(this.copy(count * Type.BYTES_PER_ELEMENT));
  }

  /** @param {Field[]} fields @returns {any} */
  message(fields) {
    /** @type {Record<string, any>} */
    const made = {};
    for (const field of fields) {
      const isOne = !field.isSequence && field.length === 0;
      made[field.name] = isOne ? this.one(field) : this.several(field, field.isSequence ? Number(this.number("uint32")) : field.length);
    }
    return made;
  }
}

/** @param {DataView} data @param {Field[]} schema @returns {any} an object with the schema's names */
export function readMessage(data, schema) {
  return new CdrReader(data).message(schema);
}

/** @param {{sec: number, nanosec: number}} stamp */
export const secondsOf = (stamp) => stamp.sec + stamp.nanosec / 1e9;
