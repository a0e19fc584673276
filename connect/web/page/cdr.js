// SPDX-License-Identifier: Apache-2.0
// Messages out of CDR's bytes: the two that the page reads.

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
  u8() {
    return this.data.getUint8(this.at++);
  }
  u32() {
    this.align(4);
    this.at += 4;
    return this.data.getUint32(this.at - 4, this.little);
  }
  i32() {
    return this.u32() | 0;
  }
  text() {
    const size = this.u32();
    const bytes = new Uint8Array(this.data.buffer, this.data.byteOffset + this.at, Math.max(0, size - 1));
    this.at += size;
    return new TextDecoder().decode(bytes);
  }
}

/**
 * @typedef {{x: number, y: number, intensity: number, sigma: number, status: number}} Point
 * @typedef {{time_s: number, frame_id: string, points: Point[]}} Cloud
 */

/**
 * A sensor_msgs/msg/PointCloud2 whose fields have the offsets that the fields say.
 * @param {DataView} data
 * @returns {Cloud}
 */
export function readCloud(data) {
  const cdr = new CdrReader(data);
  const time_s = cdr.i32() + cdr.u32() / 1e9;
  const frame_id = cdr.text();
  cdr.u32(); // Height: 1.
  const width = cdr.u32();
  /** @type {Map<string, number>} */
  const offsets = new Map();
  const count = cdr.u32();
  for (let i = 0; i < count; ++i) {
    const name = cdr.text();
    offsets.set(name, cdr.u32());
    cdr.u8(); // Type.
    cdr.u32(); // Count.
  }
  cdr.u8(); // Byte order: little endian.
  const step = cdr.u32();
  cdr.u32(); // Bytes of a row.
  cdr.u32(); // Bytes in all.
  const begin = cdr.at;
  /** @type {(point: number, name: string) => number} */
  const number = (point, name) => data.getFloat32(begin + point * step + (offsets.get(name) ?? 0), true);
  const points = Array.from({ length: width }, (_, i) => ({
    x: number(i, "x"),
    y: number(i, "y"),
    intensity: number(i, "intensity"),
    sigma: number(i, "sigma"),
    status: data.getUint8(begin + i * step + (offsets.get("status") ?? 0)),
  }));
  return { time_s, frame_id, points };
}
