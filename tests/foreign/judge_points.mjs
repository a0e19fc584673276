// SPDX-License-Identifier: Apache-2.0
// Reads files of points with @loaders.gl.
import { readFile } from "node:fs/promises";
import { parse } from "@loaders.gl/core";
import { LASLoader } from "@loaders.gl/las";
import { PCDLoader } from "@loaders.gl/pcd";
import { PLYLoader } from "@loaders.gl/ply";

const LOADERS = { ply: PLYLoader, pcd: PCDLoader, las: LASLoader };

/** The points of a file against EXPECTED: a list of [x, y, z, intensity, ...] as C++ has them, null for NaN. */
export async function judge_points(path, expected_path) {
  const expected = JSON.parse(await readFile(expected_path, "utf8"));
  const format = path.split(".").pop();
  const bytes = await readFile(path);
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const cloud = await parse(buffer, LOADERS[format], { worker: false, las: { fp64: true, skip: 1 }, core: { worker: false } });
  const positions = cloud.attributes.POSITION.value;
  if (positions.length !== 3 * expected.length) {
    throw new Error(`${path}: ${positions.length / 3} points, ${expected.length} expected`);
  }
  // LAS keeps steps of 1e-5 m; the others the very float.
  const bound = format === "las" ? 0.51e-5 : 0;
  expected.forEach((point, index) => {
    for (let axis = 0; axis < 3; ++axis) {
      const read = positions[3 * index + axis];
      const is_so = point[axis] === null ? Number.isNaN(read) : Math.abs(read - point[axis]) <= bound;
      if (!is_so) throw new Error(`${path}: point ${index}: ${read}, ${point[axis]} expected`);
    }
  });
  judge_intensities(path, format, cloud.attributes, expected);
  console.log(`${path}: ${expected.length} points agree; attributes ${Object.keys(cloud.attributes)}`);
}

/** Where the loader gives intensities: PLY as they are, LAS scaled to 16 bits. */
function judge_intensities(path, format, attributes, expected) {
  const read = attributes.intensity?.value;
  if (read === undefined) return;
  const factor = format === "las" ? 257 : 1;
  expected.forEach((point, index) => {
    if (point[3] === null) return;
    if (Math.abs(read[index] - point[3] * factor) > (format === "las" ? 0.5 : 0)) {
      throw new Error(`${path}: intensity of point ${index}: ${read[index]}, ${point[3] * factor} expected`);
    }
  });
}
