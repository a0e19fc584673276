// SPDX-License-Identifier: Apache-2.0
#include "stripe/width_tracker.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

constexpr std::size_t kLeastSamples = 8;
constexpr std::size_t kLeastForSlope = 32;
constexpr double kOutlierDeviations = 3.0;
constexpr double kSlopeDeviations = 4.0;  // A slope must stand out this much to be believed.
constexpr double kGain = 0.25;
constexpr double kJump = 0.08;
constexpr double kSigmaOfMedianAbsolute = 1.4826;

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

void WidthTracker::set(double width) {
  model_ = {width, 0.0, 0.0};
  is_known_ = true;
  samples_.reserve(kMostSamples);
  scratch_.reserve(kMostSamples);
}

double WidthTracker::finish() {
  if (samples_.size() < kLeastSamples) return 1.0;
  const WidthModel now = fit();
  const WidthModel before = model_;
  const double change = now.at_pivot / before.at(now.pivot);
  if (!has_samples_ || std::abs(change - 1.0) > kJump) {
    model_ = now;
  } else {
    model_.pivot = now.pivot;
    const double then = before.at(now.pivot);
    model_.at_pivot = then + kGain * (now.at_pivot - then);
    model_.slope = before.slope + kGain * (now.slope - before.slope);
  }
  has_samples_ = true;
  return change;
}

// Median and deviations first, then a straight line through what is not an outlier.
WidthModel WidthTracker::fit() {
  scratch_.clear();
  for (const Sample& s : samples_) scratch_.push_back(s.width);
  const double middle = median(scratch_);
  scratch_.clear();
  for (const Sample& s : samples_) scratch_.push_back(std::abs(s.width - middle));
  const double spread = std::max(0.01 * middle, kSigmaOfMedianAbsolute * median(scratch_));

  double n = 0.0;
  double sx = 0.0;
  double sxx = 0.0;
  double sy = 0.0;
  double sxy = 0.0;
  double syy = 0.0;
  for (const Sample& s : samples_) {
    const double y = s.width - middle;
    if (std::abs(y) > kOutlierDeviations * spread) continue;
    n += 1.0;
    sx += s.across;
    sxx += s.across * s.across;
    sy += y;
    sxy += s.across * y;
    syy += y * y;
  }
  WidthModel fitted{middle, 0.0, n > 0.0 ? sx / n : 0.0};
  if (n < static_cast<double>(kLeastForSlope)) return fitted;
  const double vxx = sxx - sx * sx / n;
  if (vxx < 25.0 * n) return fitted;  // The stripe is level to 5 pixels: no lever.
  const double slope = (sxy - sx * sy / n) / vxx;
  const double residual = std::max(1e-12, (syy - sy * sy / n - slope * slope * vxx) / (n - 2.0));
  if (std::abs(slope) > kSlopeDeviations * std::sqrt(residual / vxx)) {
    fitted.slope = slope;
    fitted.at_pivot = middle + sy / n;
  }
  return fitted;
}

}  // namespace striper::detail
