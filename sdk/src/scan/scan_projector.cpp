// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/scan/scan_projector.hpp>

#include "geometry/ray_table.hpp"
#include "scan/calibration_sigma_table.hpp"
#include "scan/plane_kernel.hpp"

namespace striper {
namespace {

using detail::RayTable;

// Two for interlaced fields, some more for whoever switches between regions of interest.
constexpr std::size_t kMostRayTables = 8;

Return return_of_image(const Stripe& stripe, std::size_t i) noexcept {
  Return out;
  out.u_px = stripe.u_px(i);
  out.v_px = stripe.v_px(i);
  out.intensity_dn = stripe.amplitude_dn[i];
  out.width_px = stripe.width_px[i];
  out.row_sigma_px = stripe.sigma_px[i];
  out.confidence = stripe.confidence[i];
  out.status = stripe.status[i];
  return out;
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
  void project_returns(const LaserTables& laser, const Stripe& stripe,
                       std::vector<Return>& returns);
  void finish_batch(const LaserTables& laser, const Stripe& stripe, std::vector<Return>& returns,
                    int count) const noexcept;
  void project_exactly(const LaserTables& laser, Return& out) const noexcept;

  StriperModel model;
  ScanOptions options;
  std::vector<LaserTables> lasers;
  std::vector<RayTable> ray_tables;  // One per image grid that was seen, the latest last.
  detail::PlaneBatch batch{};
  std::array<std::size_t, detail::PlaneBatch::kSize>
      batch_return{};  // Which return each element is.
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
  // Most frames are of the whole sensor, and the first of a stream is as soon wanted as the others.
  const CameraModel& camera = model.camera;
  const int lines = model.axis == StripeAxis::kColumns ? camera.width() : camera.height();
  impl_->ray_tables.emplace_back(camera, model.axis, AxisGrid{}, lines);
}

void ScanProjector::project(const Stripe& stripe, int laser, PolarScan& scan) {
  scan.axis = stripe.axis;
  scan.is_stripe_seen = stripe.is_seen;
  scan.returns.resize(stripe.size());
  for (std::size_t i = 0; i < stripe.size(); ++i) scan.returns[i] = return_of_image(stripe, i);
  if (impl_ == nullptr) return;

  const bool known_laser = laser >= 0 && laser < static_cast<int>(impl_->lasers.size());
  if (!known_laser) {
    for (Return& out : scan.returns) out.status = ReturnStatus::kOutsideModel;
    return;
  }
  impl_->project_returns(impl_->lasers[static_cast<std::size_t>(laser)], stripe, scan.returns);
}

const RayTable& ScanProjector::Impl::rays_for(const Stripe& stripe) {
  const AxisGrid& along = stripe.axis == StripeAxis::kColumns ? stripe.grid.u : stripe.grid.v;
  const int lines = stripe.line_count;
  for (const RayTable& table : ray_tables) {
    if (table.serves(stripe.axis, along, lines)) return table;
  }
  // A region of interest that wanders must not fill the memory. The whole sensor's table stays.
  if (ray_tables.size() == kMostRayTables) ray_tables.erase(ray_tables.begin() + 1);
  return ray_tables.emplace_back(model.camera, stripe.axis, along, lines);
}

// In batches, so that the plane's arithmetic runs on vectors.
void ScanProjector::Impl::project_returns(const LaserTables& laser, const Stripe& stripe,
                                          std::vector<Return>& returns) {
  const RayTable& rays = rays_for(stripe);
  detail::PlaneKernelInput input{rays.numbers(),
                                 rays.inverse_step(),
                                 stripe.half_pixel_px(),
                                 laser.triangulator.homography(),
                                 1.0,
                                 0.0,
                                 0.0};
  int count = 0;
  const auto flush = [&] {
    if (count == 0) return;
    // The rest of the batch may be of another, larger table.
    std::fill(batch.node.begin() + count, batch.node.end(), batch.node[0]);
    detail::project_batch(input, batch);
    finish_batch(laser, stripe, returns, count);
    // The next batch goes on about where this one ended.
    const Return& last = returns[batch_return[static_cast<std::size_t>(count - 1)]];
    if (std::isfinite(last.bearing_rad)) {
      input.x_reference_m = last.x_m;
      input.y_reference_m = last.y_m;
      input.bearing_reference_rad = last.bearing_rad;
    }
    count = 0;
  };
  for (std::size_t i = 0; i < stripe.size(); ++i) {
    if (verdict(stripe.status[i]) == Verdict::kMissing) continue;
    const RayTable::Place place = rays.place_of(stripe.line[i], stripe.across_px[i]);
    if (place.number < 0) {
      project_exactly(laser, returns[i]);
      continue;
    }
    const auto at = static_cast<std::size_t>(count);
    batch.node[at] = place.number;
    batch.s[at] = place.s;
    batch_return[at] = i;
    if (++count == detail::PlaneBatch::kSize) flush();
  }
  flush();
}

void ScanProjector::Impl::finish_batch(const LaserTables& laser, const Stripe& stripe,
                                       std::vector<Return>& returns, int count) const noexcept {
  for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
    const std::size_t i = batch_return[k];
    Return& out = returns[i];
    if (std::isnan(batch.w[k])) {
      project_exactly(laser, out);
      continue;
    }
    if (!(batch.w[k] > 0.0)) {
      out.status = ReturnStatus::kBehind;
      continue;
    }
    out.x_m = batch.x_m[k];
    out.y_m = batch.y_m[k];
    out.range_m = batch.range_m[k];
    const double bearing_rad = batch.bearing_rad[k];
    out.bearing_rad = std::isnan(bearing_rad) ? std::atan2(out.y_m, out.x_m) : bearing_rad;
    out.range_near_m = batch.range_near_m[k];
    out.range_far_m = batch.range_far_m[k];
    out.sigma_m = std::abs(batch.drange_dacross[k]) * static_cast<double>(stripe.sigma_px[i]);
    out.sigma_cal_m = laser.calibration_sigma.sigma_m(out.u_px, out.v_px, batch.w[k]);
    const bool in_range = out.range_m >= options.min_range_m && out.range_m <= options.max_range_m;
    if (!in_range && out.status == ReturnStatus::kOk) out.status = ReturnStatus::kOutOfRange;
  }
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
