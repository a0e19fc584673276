// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <numbers>

#include <striper/geometry/triangulator.hpp>
#include <striper/validate/range_error.hpp>

namespace striper {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kDegrees = 180.0 / std::numbers::pi;

}  // namespace

std::vector<RangeSigma> predict_range_sigma(const StriperModel& model, int laser,
                                            const std::vector<double>& ranges_m,
                                            double nearest_data_m, double farthest_data_m) {
  const Triangulator triangulator(model, laser);
  std::vector<RangeSigma> sigmas;
  for (const double range_m : ranges_m) {
    RangeSigma at{range_m, kNan, Eigen::Vector2d::Constant(kNan),
                  range_m >= nearest_data_m && range_m <= farthest_data_m};
    // Straight ahead first, then further and further to either side.
    for (int step = 0; step <= 160 && std::isnan(at.sigma_m); ++step) {
      const double bearing = 0.5 / kDegrees * (step % 2 == 0 ? step / 2 : -(step + 1) / 2);
      const Projection seen =
          triangulator.project(range_m * std::cos(bearing), range_m * std::sin(bearing));
      if (seen.status != CameraStatus::kOk || seen.pixel.minCoeff() < 0.0 ||
          seen.pixel.x() > model.camera.width() - 1 || seen.pixel.y() > model.camera.height() - 1)
        continue;
      at.pixel = seen.pixel;
      at.sigma_m = triangulator.sigma_cal_m(seen.pixel);
    }
    sigmas.push_back(at);
  }
  return sigmas;
}

RangeMap range_map(const StriperModel& model, int laser, int columns, int rows) {
  const Triangulator triangulator(model, laser);
  RangeMap map{columns, rows, {}, {}};
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d pixel((column + 0.5) * model.camera.width() / columns - 0.5,
                                  (row + 0.5) * model.camera.height() / rows - 0.5);
      const PlanePoint point = triangulator.triangulate(pixel);
      const bool ok = point.status == ReturnStatus::kOk;
      map.range_m.push_back(ok ? point.range_m() : kNan);
      map.sigma_m.push_back(ok ? triangulator.sigma_cal_m(pixel) : kNan);
    }
  return map;
}

}  // namespace striper
