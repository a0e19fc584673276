// SPDX-License-Identifier: Apache-2.0
#include "guidance/path/wear_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace striper::detail {
namespace {

// Wear of the last metres counts; of fewer, the length would not be known to a quarter.
constexpr double kMemory_m = 100.0;
// Until so much road has been seen the options' wear counts as if this much had shown it.
constexpr double kStart_m = 2.0;
// A width further off than so many sigma is of something else that touches the stripe.
constexpr double kMostSigmas = 4.0;
// Widths that are further apart tell nothing of the length.
constexpr double kNear_m = 0.3;
constexpr double kShortest_m = 0.01;
constexpr double kLongest_m = 1.0;

double square(double x) noexcept { return x * x; }

}  // namespace

WearEstimate::WearEstimate(double sigma_m, double length_m) noexcept
    : start_variance_(square(sigma_m)),
      length_m_(length_m),
      width_m_(std::numeric_limits<double>::quiet_NaN()) {}

void WearEstimate::add(std::size_t beam, double width_m, double sigma_m,
                       double distance_m) noexcept {
  if (beam >= kMostBeams || !std::isfinite(width_m) || !std::isfinite(distance_m)) return;
  if (std::isnan(width_m_)) width_m_ = width_m;
  Last& last = last_[beam];
  const double way_m = last.is_known ? distance_m - last.distance_m : 0.0;
  const bool is_new = last.is_known && way_m > 0.0;
  const double limit_m = kMostSigmas * 2.0 * std::hypot(this->sigma_m(), sigma_m);
  const double off_m = std::clamp(width_m - width_m_, -limit_m, limit_m);
  if (is_new) {
    // Standing teaches nothing; what is near what was seen before teaches the less.
    const double fresh_m = std::min(way_m, length_m_);
    way_m_ = std::min(way_m_ + fresh_m, kMemory_m);
    const double share = fresh_m / (way_m_ + kStart_m);
    width_m_ += share * off_m;
    variance_ += share * (square(off_m) - square(2.0 * sigma_m) - variance_);
    if (way_m < kNear_m) {
      const double before_m = std::clamp(last.width_m - width_m_, -limit_m, limit_m);
      together_ += share * (off_m * before_m - together_);
      near_variance_ += share * (0.5 * (square(off_m) + square(before_m)) - square(2.0 * sigma_m) -
                                 near_variance_);
      near_m_ += share * (way_m - near_m_);
      // After enough of it the length is as told by how alike neighbours are.
      const double alike = near_variance_ > 0.0 ? together_ / near_variance_ : 0.0;
      if (way_m_ > kStart_m && alike > 0.02 && alike < 0.999) {
        length_m_ = std::clamp(-near_m_ / std::log(alike), kShortest_m, kLongest_m);
      }
    }
  }
  last = {width_m, distance_m, true};
}

double WearEstimate::sigma_m() const noexcept {
  const double learnt = std::max(variance_, 0.0) / 4.0;
  const double share = way_m_ / (way_m_ + kStart_m);
  // `variance_` begins at zero and is short by what it has not seen yet.
  return std::sqrt(learnt + (1.0 - share) * start_variance_);
}

}  // namespace striper::detail
