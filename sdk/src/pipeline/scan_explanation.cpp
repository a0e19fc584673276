// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <striper/pipeline/scan_explanation.hpp>

namespace striper {
namespace {

// Between the rays half a pixel before and after a return, along the way that was measured.
double degrees_per_px(const CameraModel& camera, const Return& at, StripeAxis axis) {
  const auto ray = [&](double off) {
    const Eigen::Vector2d pixel = axis == StripeAxis::kColumns
                                      ? Eigen::Vector2d(at.u_px, at.v_px + off)
                                      : Eigen::Vector2d(at.u_px + off, at.v_px);
    return camera.unproject(pixel);
  };
  const Unprojection before = ray(-0.5);
  const Unprojection after = ray(0.5);
  if (before.status != CameraStatus::kOk || after.status != CameraStatus::kOk) return NAN;
  const Eigen::Vector3d a = before.xy.homogeneous().normalized();
  const Eigen::Vector3d b = after.xy.homogeneous().normalized();
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

}  // namespace

ScanExplanation explain_return(const LineExplanation& line, const PolarScan& scan) {
  ScanExplanation why{line, {}};
  const auto element = static_cast<std::size_t>(line.line);
  if (element >= scan.returns.size()) return why;
  why.result = scan.returns[element];
  const bool has_range = why.result.row_sigma_px > 0.0F && std::isfinite(why.result.sigma_m);
  if (!has_range) return why;
  why.range_m_per_px = why.result.sigma_m / static_cast<double>(why.result.row_sigma_px);
  if (scan.frame && scan.frame->model) {
    why.range_m_per_deg =
        why.range_m_per_px / degrees_per_px(scan.frame->model->camera, why.result, scan.axis);
  }
  return why;
}

}  // namespace striper
