// SPDX-License-Identifier: Apache-2.0
// A scan as it is drawn: places in a plane, x forward and y to the left, each with its error bars. Without a model the plane is the image
// itself, in pixels.

/**
 * @typedef {{header: {stamp: {sec: number, nanosec: number}, frame_id: string}, sequence: bigint, laser: number, axis: number,
 *   u_px: Float64Array, v_px: Float64Array, bearing_rad: Float64Array, range_m: Float64Array, range_near_m: Float64Array,
 *   range_far_m: Float64Array, sigma_m: Float64Array, sigma_cal_m: Float64Array, x_m: Float64Array, y_m: Float64Array,
 *   intensity: Float32Array, width_px: Float32Array, row_sigma_px: Float32Array, confidence: Float32Array, status: Uint8Array}} PolarScan
 * @typedef {{unit: "m" | "px", scan: PolarScan, x: Float64Array, y: Float64Array, alongX: Float64Array, alongY: Float64Array,
 *   near: Float64Array, far: Float64Array, sigma: Float64Array, sigmaCal: Float64Array}} PlaneScan
 *   `along` is the unit vector in which the errors lie, `near` and `far` are lengths along it from the place.
 */

/** Whether there are ranges: a model. @param {PolarScan} scan */
export const hasRanges = (scan) => scan.range_m.some(Number.isFinite);

/** @param {PolarScan} scan @returns {PlaneScan} */
function inMetres(scan) {
  const size = scan.x_m.length;
  const alongX = new Float64Array(size);
  const alongY = new Float64Array(size);
  const near = new Float64Array(size);
  const far = new Float64Array(size);
  for (let i = 0; i < size; ++i) {
    const range = scan.range_m[i];
    alongX[i] = scan.x_m[i] / range;
    alongY[i] = scan.y_m[i] / range;
    near[i] = scan.range_near_m[i] - range;
    far[i] = scan.range_far_m[i] - range;
  }
  return { unit: "m", scan, x: scan.x_m, y: scan.y_m, alongX, alongY, near, far, sigma: scan.sigma_m, sigmaCal: scan.sigma_cal_m };
}

/** @param {PolarScan} scan @returns {PlaneScan} */
function inPixels(scan) {
  const size = scan.u_px.length;
  const alongRows = scan.axis === 1;
  return {
    unit: "px",
    scan,
    x: scan.v_px.map((v) => -v),
    y: scan.u_px.map((u) => -u),
    alongX: new Float64Array(size).fill(alongRows ? 0 : 1),
    alongY: new Float64Array(size).fill(alongRows ? 1 : 0),
    near: new Float64Array(size).fill(-0.5),
    far: new Float64Array(size).fill(0.5),
    sigma: Float64Array.from(scan.row_sigma_px),
    sigmaCal: new Float64Array(size).fill(NaN),
  };
}

/** @param {PolarScan} scan @param {boolean} hasModel @returns {PlaneScan} */
export const planeOf = (scan, hasModel) => (hasModel ? inMetres(scan) : inPixels(scan));

/** Whether a return has a place. @param {PlaneScan} plane @param {number} i */
export const isPlaced = (plane, i) => Number.isFinite(plane.x[i]) && Number.isFinite(plane.y[i]);

/**
 * The distance of two returns and its one-sigma errors: random (of each by itself) and of the calibration (common to both).
 * @param {PlaneScan} p @param {number} i @param {PlaneScan} q @param {number} k
 * @returns {{distance: number, sigma: number, sigmaCal: number, forward: number, left: number}}
 */
export function measure(p, i, q, k) {
  const forward = q.x[k] - p.x[i];
  const left = q.y[k] - p.y[i];
  const distance = Math.hypot(forward, left);
  const toP = (p.alongX[i] * forward + p.alongY[i] * left) / distance;
  const toQ = (q.alongX[k] * forward + q.alongY[k] * left) / distance;
  return {
    distance,
    forward,
    left,
    sigma: Math.hypot(toP * p.sigma[i], toQ * q.sigma[k]),
    sigmaCal: Math.abs(toQ * q.sigmaCal[k] - toP * p.sigmaCal[i]),
  };
}
