// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/report/model_diff.hpp>

namespace striper {
namespace {

Eigen::Vector3d in_camera(const Triangulator& triangulator, const PlanePoint& point) {
  return triangulator.T_cam_scan() * Eigen::Vector3d(point.x_m, point.y_m, 0.0);
}

void summarise(ModelDifference& difference) {
  double squares = 0.0;
  double sigma_squares = 0.0;
  for (const PixelDifference& at : difference.pixels) {
    squares += at.difference_m * at.difference_m;
    sigma_squares += std::pow(at.difference_m / at.sigma_m, 2.0);
    if (std::abs(at.difference_m) <= difference.worst_m) continue;
    difference.worst_m = std::abs(at.difference_m);
    difference.worst = at;
  }
  const auto count = static_cast<double>(std::max<std::size_t>(difference.pixels.size(), 1));
  difference.rms_m = std::sqrt(squares / count);
  difference.rms_sigmas = std::sqrt(sigma_squares / count);
}

}  // namespace

ModelDifference compare_models(const StriperModel& first, const StriperModel& second, int laser,
                               double farthest_m, int columns, int rows) {
  if (first.camera.width() != second.camera.width() ||
      first.camera.height() != second.camera.height())
    throw Error(ErrorKind::kBadValue,
                fmt::format("the models are of images of {}x{} and {}x{}; expected one camera",
                            first.camera.width(), first.camera.height(), second.camera.width(),
                            second.camera.height()));
  const Triangulator a(first, laser);
  const Triangulator b(second, laser);
  ModelDifference difference;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) * first.camera.width() / columns - 0.5,
                                  (row + 0.5) * first.camera.height() / rows - 0.5);
      const PlanePoint p = a.triangulate(pixel);
      const PlanePoint q = b.triangulate(pixel);
      if (p.status != ReturnStatus::kOk || q.status != ReturnStatus::kOk) continue;
      if (p.range_m() > farthest_m) continue;
      PixelDifference at;
      at.pixel = pixel;
      at.range_m = p.range_m();
      at.difference_m = q.range_m() - p.range_m();
      at.apart_m = (in_camera(b, q) - in_camera(a, p)).norm();
      if (a.has_covariance() && b.has_covariance())
        at.sigma_m = std::hypot(a.sigma_cal_m(pixel), b.sigma_cal_m(pixel));
      difference.pixels.push_back(at);
    }
  summarise(difference);
  return difference;
}

}  // namespace striper
