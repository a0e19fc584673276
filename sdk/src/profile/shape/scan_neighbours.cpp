// SPDX-License-Identifier: Apache-2.0
#include "profile/shape/scan_neighbours.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include <fmt/format.h>

#include <striper/core/error.hpp>
#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

constexpr double kEdgeSpacings = 3.0;
constexpr double kEdgeSigmas = 8.0;  // Noise alone makes no edge.
constexpr double kStraight = 0.7;    // Cosine of the angle by which a surface turns at a corner.
constexpr double kSameLine = 0.5;    // Pitches.
constexpr double kNextLine = 1.5;
constexpr double kMostPitch_px = 8.0;  // Eight pixels binned; what is sparser is full of holes.
// Tables round pixels to hundredths, and a pitch of them adds up.
constexpr double kPixelError = 0.02;
constexpr double kErrorPerLine = 0.005;

bool is_whole(double pixel) { return std::abs(pixel - std::round(pixel)) < 1e-3; }

Eigen::Vector2d step_from(const Return& a, const Return& b) {
  return {b.x_m - a.x_m, b.y_m - a.y_m};
}

}  // namespace

ScanNeighbours::ScanNeighbours(const PolarScan& scan) : scan_(scan) {
  for (std::size_t i = 0; i < scan.returns.size(); ++i)
    if (scan.returns[i].status == ReturnStatus::kOk && scan.returns[i].range_m > 0.0)
      good_.push_back(i);
  find_pitch();
  std::vector<double> turns_rad;
  for (std::size_t k = 0; k + 1 < size(); ++k) turns_rad.push_back(turn_rad(k));
  if (!turns_rad.empty()) usual_turn_rad_ = upper_median(turns_rad);
  for (std::size_t k = 0; k + 1 < size(); ++k) {
    if (!pitch_px_ || !(apart_px(k) < kSameLine * *pitch_px_)) continue;
    throw Error(ErrorKind::kUsage,
                fmt::format("resample: scan {} has several returns in one scan line (pixel {:g}): "
                            "which of them a surface goes on with is not known",
                            scan.sequence, at(k).along_px(scan.axis)));
  }
}

double ScanNeighbours::apart_px(std::size_t k) const {
  return std::abs(at(k + 1).along_px(scan_.axis) - at(k).along_px(scan_.axis));
}

// The median of the least steps, if all steps are whole multiples of it. Where the pixels across
// the stripe are whole too nothing says which are which.
void ScanNeighbours::find_pitch() {
  double least_px = std::numeric_limits<double>::infinity();
  bool are_whole = size() > 0;
  for (std::size_t k = 0; k + 1 < size(); ++k) {
    if (apart_px(k) > kPixelError) least_px = std::min(least_px, apart_px(k));
    are_whole = are_whole && is_whole(at(k).across_px(scan_.axis));
  }
  if (are_whole || !std::isfinite(least_px)) return;
  std::vector<double> steps_px;
  for (std::size_t k = 0; k + 1 < size(); ++k) {
    if (apart_px(k) > kPixelError && apart_px(k) < kNextLine * least_px)
      steps_px.push_back(apart_px(k));
  }
  const double pitch_px = upper_median(steps_px);
  for (std::size_t k = 0; k + 1 < size(); ++k) {
    const double lines = std::round(apart_px(k) / pitch_px);
    if (std::abs(apart_px(k) - lines * pitch_px) > kPixelError + lines * kErrorPerLine) return;
  }
  pitch_px_ = pitch_px;
}

double ScanNeighbours::turn_rad(std::size_t k) const {
  return std::abs(
      std::remainder(at(k + 1).bearing_rad - at(k).bearing_rad, 2.0 * std::numbers::pi));
}

double ScanNeighbours::distance_m(std::size_t k) const {
  return step_from(at(k), at(k + 1)).norm();
}

// Those whose own pixel is not known are as their place says.
bool ScanNeighbours::are_neighbours(std::size_t k) const {
  if (good_[k + 1] != good_[k] + 1) return false;
  return !pitch_px_ || !(apart_px(k) > kNextLine * std::min(*pitch_px_, kMostPitch_px));
}

bool ScanNeighbours::goes_on(std::size_t k, std::size_t other) const {
  const Eigen::Vector2d own = step_from(at(k), at(k + 1));
  const Eigen::Vector2d beside = step_from(at(other), at(other + 1));
  return own.dot(beside) >= kStraight * own.norm() * beside.norm();
}

double ScanNeighbours::usual_m(std::size_t k) const {
  double usual_m =
      std::min(at(k).range_m, at(k + 1).range_m) * std::min(turn_rad(k), usual_turn_rad_);
  const auto look_at = [&](std::size_t other) {
    if (are_neighbours(other) && goes_on(k, other)) usual_m = std::max(usual_m, distance_m(other));
  };
  if (k > 0) look_at(k - 1);
  if (k + 2 < size()) look_at(k + 1);
  return usual_m;
}

bool ScanNeighbours::is_gap(std::size_t k) const {
  if (!are_neighbours(k)) return true;
  const double noise_m = kEdgeSigmas * std::max(at(k).sigma_m, at(k + 1).sigma_m);
  const double known_m = std::isfinite(noise_m) ? noise_m : 0.0;
  return distance_m(k) > kEdgeSpacings * usual_m(k) + known_m;
}

}  // namespace striper::detail
