// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/geometry/ray_table.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/scan/scan_projector.hpp>

#include "scan/calibration_sigma_table.hpp"

namespace striper {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A ray in the homogeneous coordinates of the scan plane; w is positive where it meets the plane in
// front.
struct PlaneRay {
  double X, Y, w;
};

PlaneRay apply(const Eigen::Matrix3d& H, const Eigen::Vector2d& xy) noexcept {
  return {H(0, 0) * xy.x() + H(0, 1) * xy.y() + H(0, 2),
          H(1, 0) * xy.x() + H(1, 1) * xy.y() + H(1, 2),
          H(2, 0) * xy.x() + H(2, 1) * xy.y() + H(2, 2)};
}

double range_along(const PlaneRay& ray) noexcept {
  return ray.w > 0.0 ? std::sqrt(ray.X * ray.X + ray.Y * ray.Y) / ray.w : kInfinity;
}

// atan2(y, x) for a row of points whose directions are mostly alike: relative to one of them by a
// short series, which is three times as fast and as accurate (the first term left out is 7e-17 at
// the limit).
class BearingRow {
 public:
  double bearing_rad(double x, double y) noexcept {
    const double t = (x_ * y - y_ * x) / (x_ * x + y_ * y);
    if (!(std::abs(t) < kSeriesLimit) || x_ * x + y_ * y <= 0.0) return restart(x, y);
    const double t2 = t * t;
    return bearing_rad_ +
           t * (1.0 + t2 * (-1.0 / 3 +
                            t2 * (1.0 / 5 +
                                  t2 * (-1.0 / 7 + t2 * (1.0 / 9 + t2 * (-1.0 / 11 + t2 / 13))))));
  }

 private:
  static constexpr double kSeriesLimit = 0.1;

  double restart(double x, double y) noexcept {
    x_ = x;
    y_ = y;
    bearing_rad_ = std::atan2(y, x);
    return bearing_rad_;
  }

  double x_ = 0.0;
  double y_ = 0.0;
  double bearing_rad_ = 0.0;
};

void copy_image_values(const Stripe& stripe, std::size_t i, Return& out) noexcept {
  out.u_px = stripe.u_px(i);
  out.v_px = stripe.v_px(i);
  out.intensity_dn = stripe.amplitude_dn[i];
  out.width_px = stripe.width_px[i];
  out.row_sigma_px = stripe.sigma_px[i];
  out.confidence = stripe.confidence[i];
  out.status = stripe.status[i];
}

}  // namespace

void ScanOptions::validate() const {
  if (!(min_range_m >= 0.0 && min_range_m < max_range_m)) {
    throw Error(ErrorKind::kBadValue,
                fmt::format("min_range_m is {} and max_range_m is {}; expected 0 <= min < max",
                            min_range_m, max_range_m));
  }
}

struct ScanProjector::LaserTables {
  LaserTables(const StriperModel& model, int laser)
      : triangulator(model, laser), calibration_sigma(triangulator) {}

  Triangulator triangulator;
  detail::CalibrationSigmaTable calibration_sigma;
};

struct ScanProjector::Impl {
  const RayTable& rays_for(const Stripe& stripe);
  void project_return(const LaserTables& laser, const RayTable& rays, const Stripe& stripe,
                      std::size_t i, BearingRow& bearings, Return& out) const noexcept;
  void project_exactly(const LaserTables& laser, Return& out) const noexcept;

  StriperModel model;
  ScanOptions options;
  std::vector<LaserTables> lasers;
  std::vector<RayTable> ray_tables;  // One per image grid that was seen: two for interlaced fields.
};

ScanProjector::ScanProjector() = default;
ScanProjector::ScanProjector(ScanProjector&&) noexcept = default;
ScanProjector& ScanProjector::operator=(ScanProjector&&) noexcept = default;
ScanProjector::~ScanProjector() = default;

ScanProjector::ScanProjector(const StriperModel& model, const ScanOptions& options)
    : impl_(std::make_unique<Impl>()) {
  options.validate();
  if (model.lasers.empty()) {
    throw Error(
        ErrorKind::kBadValue,
        "the model has no laser plane (lasers is empty): it is of a camera alone; calibrate the "
        "laser to get ranges");
  }
  impl_->model = model;
  impl_->options = options;
  for (int laser = 0; laser < static_cast<int>(model.lasers.size()); ++laser) {
    impl_->lasers.emplace_back(model, laser);
  }
}

void ScanProjector::project(const Stripe& stripe, int laser, PolarScan& scan) {
  scan.axis = stripe.axis;
  scan.returns.resize(stripe.size());
  std::fill(scan.returns.begin(), scan.returns.end(), Return{});
  for (std::size_t i = 0; i < stripe.size(); ++i) copy_image_values(stripe, i, scan.returns[i]);
  if (impl_ == nullptr) return;

  const bool known_laser = laser >= 0 && laser < static_cast<int>(impl_->lasers.size());
  if (!known_laser) {
    for (Return& out : scan.returns) out.status = ReturnStatus::kOutsideModel;
    return;
  }
  const LaserTables& tables = impl_->lasers[static_cast<std::size_t>(laser)];
  const RayTable& rays = impl_->rays_for(stripe);
  BearingRow bearings;
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (verdict(stripe.status[i]) == Verdict::kMissing) continue;
    impl_->project_return(tables, rays, stripe, i, bearings, scan.returns[i]);
  }
}

const RayTable& ScanProjector::Impl::rays_for(const Stripe& stripe) {
  const AxisGrid& along = stripe.axis == StripeAxis::kColumns ? stripe.grid.u : stripe.grid.v;
  const int lines = stripe.line_count;
  for (const RayTable& table : ray_tables) {
    if (table.serves(stripe.axis, along, lines)) return table;
  }
  return ray_tables.emplace_back(model.camera, stripe.axis, along, lines);
}

void ScanProjector::Impl::project_return(const LaserTables& laser, const RayTable& rays,
                                         const Stripe& stripe, std::size_t i, BearingRow& bearings,
                                         Return& out) const noexcept {
  const Eigen::Matrix3d& H = laser.triangulator.homography();
  const RayTable::Segment segment = rays.at(stripe.line[i], stripe.across_px[i]);
  if (!segment.exists()) return project_exactly(laser, out);

  const PlaneRay ray = apply(H, segment.xy());
  if (!(ray.w > 0.0)) {
    out.status = ReturnStatus::kBehind;
    return;
  }
  const double inverse_w = 1.0 / ray.w;
  const double x = ray.X * inverse_w;
  const double y = ray.Y * inverse_w;
  const double range = std::sqrt(x * x + y * y);
  out.x_m = x;
  out.y_m = y;
  out.range_m = range;
  out.bearing_rad = bearings.bearing_rad(x, y);

  const double half_px = stripe.half_pixel_px();
  const double before = range_along(apply(H, segment.xy(-half_px)));
  const double after = range_along(apply(H, segment.xy(half_px)));
  out.range_near_m = std::min(before, after);
  out.range_far_m = std::max(before, after);

  const Eigen::Vector2d slope = segment.dxy_dacross();
  const double dX = H(0, 0) * slope.x() + H(0, 1) * slope.y();
  const double dY = H(1, 0) * slope.x() + H(1, 1) * slope.y();
  const double dw = H(2, 0) * slope.x() + H(2, 1) * slope.y();
  const double drange_dacross = (x * (dX - x * dw) + y * (dY - y * dw)) * inverse_w / range;
  out.sigma_m = std::abs(drange_dacross) * static_cast<double>(stripe.sigma_px[i]);
  out.sigma_cal_m = laser.calibration_sigma.sigma_m(out.u_px, out.v_px, ray.w);

  const bool in_range = range >= options.min_range_m && range <= options.max_range_m;
  if (!in_range && out.status == ReturnStatus::kOk) out.status = ReturnStatus::kOutOfRange;
}

// Within a node of where the lens model ends the table has nothing to say; the lens itself may.
// Error bars need the neighbourhood, so the return is doubtful.
void ScanProjector::Impl::project_exactly(const LaserTables& laser, Return& out) const noexcept {
  const PlanePoint point = laser.triangulator.triangulate({out.u_px, out.v_px});
  if (point.status != ReturnStatus::kOk) {
    out.status = point.status;
    return;
  }
  out.x_m = point.x_m;
  out.y_m = point.y_m;
  out.range_m = point.range_m();
  out.bearing_rad = point.bearing_rad();
  if (out.status == ReturnStatus::kOk) out.status = ReturnStatus::kEdge;
}

}  // namespace striper
