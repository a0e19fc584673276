// SPDX-License-Identifier: Apache-2.0
#include "scan/calibration_sigma_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

constexpr double kStepPx = 16.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

CalibrationSigmaTable::CalibrationSigmaTable(const Triangulator& triangulator) {
  if (!triangulator.has_covariance()) return;
  const CameraModel& camera = triangulator.camera();
  columns_ = static_cast<int>(std::ceil(camera.width() / kStepPx)) + 1;
  rows_ = static_cast<int>(std::ceil(camera.height() / kStepPx)) + 1;
  scaled_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNan);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      // The outermost nodes lie beyond the sensor, where a lens model may end: take its border
      // instead.
      const Eigen::Vector2d pixel(std::min(kStepPx * column, camera.width() - 1.0),
                                  std::min(kStepPx * row, camera.height() - 1.0));
      const Unprojection ray = camera.unproject(pixel);
      if (ray.status != CameraStatus::kOk) continue;
      const double w = triangulator.homography().row(2).dot(ray.xy.homogeneous());
      if (!(w > 0.0)) continue;
      scaled_[at(column, row)] = triangulator.sigma_cal_m(pixel) * w * w;
    }
  }
}

double CalibrationSigmaTable::sigma_m(double u_px, double v_px, double w) const noexcept {
  const double s = u_px * (1.0 / kStepPx);
  const double t = v_px * (1.0 / kStepPx);
  if (!(s >= 0.0 && t >= 0.0 && s < columns_ - 1 && t < rows_ - 1)) return kNan;
  const int i = static_cast<int>(s);
  const int j = static_cast<int>(t);
  const double fs = s - i;
  const double ft = t - j;
  const double* const upper = &scaled_[at(i, j)];
  const double* const lower = upper + columns_;
  const double above = upper[0] + fs * (upper[1] - upper[0]);
  const double below = lower[0] + fs * (lower[1] - lower[0]);
  const double scaled = above + ft * (below - above);
  return (std::isnan(scaled) ? from_known_corners(upper, fs, ft) : scaled) / (w * w);
}

// A corner beyond the horizon has no value; the others stand for it.
double CalibrationSigmaTable::from_known_corners(const double* corner, double fs,
                                                 double ft) const noexcept {
  const double weights[4] = {(1.0 - fs) * (1.0 - ft), fs * (1.0 - ft), (1.0 - fs) * ft, fs * ft};
  const double values[4] = {corner[0], corner[1], corner[columns_], corner[columns_ + 1]};
  double sum = 0.0;
  double known = 0.0;
  for (int k = 0; k < 4; ++k) {
    if (std::isnan(values[k])) continue;
    sum += weights[k] * values[k];
    known += weights[k];
  }
  return sum / known;
}

}  // namespace striper::detail
