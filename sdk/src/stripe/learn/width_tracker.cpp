// SPDX-License-Identifier: Apache-2.0
#include "stripe/learn/width_tracker.hpp"

#include <algorithm>
#include <cmath>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

constexpr std::size_t kLeastSamples = 8;
constexpr std::size_t kLeastForSlope = 32;
constexpr double kOutlierDeviations = 3.0;
// What the samples may do before they are looked at anew: from outliers, and spreads.
constexpr double kMostlyInliers = 0.8;
constexpr double kLargestShift = 0.5;
constexpr double kSlopeDeviations = 4.0;  // A slope must stand out this much to be believed.
constexpr double kGain = 0.25;
constexpr double kJump = 0.08;
constexpr double kJumpDeviations = 3.0;     // Standard errors; less may be chance.
constexpr double kSigmaOfInliers = 1.0135;  // Of a normal distribution cut at 3 sigma.

}  // namespace

void WidthTracker::set(double width) {
  model_ = {width, 0.0, 0.0, 0.0};
  is_known_ = true;
  samples_.reserve(kMostSamples);
  scratch_.reserve(kMostSamples);
}

void WidthTracker::expect(const WidthModel& width) {
  set(width.at_pivot);
  model_ = width;
  is_expected_ = true;
}

double WidthTracker::finish() {
  if (samples_.size() < kLeastSamples) return 1.0;
  const WidthModel now = fit();
  const WidthModel before = model_;
  const double change = now.at_pivot / before.at(now.pivot);
  const double chance = kJumpDeviations * spread_ /
                        (before.at(now.pivot) * std::sqrt(static_cast<double>(samples_.size())));
  if (!has_samples_ || std::abs(change - 1.0) > std::max(kJump, chance)) {
    model_ = now;
  } else {
    model_.pivot = now.pivot;
    const double then = before.at(now.pivot);
    model_.at_pivot = then + kGain * (now.at_pivot - then);
    model_.slope = before.slope + kGain * (now.slope - before.slope);
  }
  const double amplitude_dn = amplitudes_dn_ / static_cast<double>(samples_.size());
  const double gain = has_samples_ ? kGain : 1.0;
  model_.amplitude_dn = before.amplitude_dn + gain * (amplitude_dn - before.amplitude_dn);
  has_samples_ = true;
  return change;
}

// As long as the samples lie about the model as they did, outliers are known without a median.
WidthModel WidthTracker::fit() {
  if (!has_samples_) return fit_anew();
  const Fit known = fit_about(model_);
  const bool is_as_before =
      static_cast<double>(known.inliers) >= kMostlyInliers * static_cast<double>(samples_.size()) &&
      std::abs(known.shift) < kLargestShift * spread_;
  if (!is_as_before) return fit_anew();
  spread_ += kGain * (std::max(0.01 * model_.at_pivot, known.spread) - spread_);
  return known.model;
}

// About the shortest interval that half of the samples are in: light sources and edges beside the
// stripe are nearly all wider than it, which moves a median.
WidthModel WidthTracker::fit_anew() {
  scratch_.clear();
  for (const Sample& s : samples_) scratch_.push_back(s.width);
  std::sort(scratch_.begin(), scratch_.end());
  const std::size_t half = scratch_.size() / 2;
  const auto length_from = [&](std::size_t i) { return scratch_[i + half] - scratch_[i]; };
  std::size_t shortest = 0;
  for (std::size_t first = 1; first + half < scratch_.size(); ++first) {
    if (length_from(first) < length_from(shortest)) shortest = first;
  }
  const double middle = scratch_[shortest + half / 2];
  for (double& width : scratch_) width = std::abs(width - middle);
  spread_ = std::max(0.01 * middle, robust_sigma(scratch_));
  return fit_about({middle, 0.0, 0.0, 0.0}).model;
}

bool WidthTracker::is_outlier(const Sample& s, const WidthModel& centre) const {
  return std::abs(s.width - centre.at(s.across)) > kOutlierDeviations * spread_;
}

// A straight line through what is no outlier; a level one where the slope does not stand out.
WidthTracker::Fit WidthTracker::fit_about(const WidthModel& centre) const {
  double n = 0.0;
  double sx = 0.0;
  double sxx = 0.0;
  double sy = 0.0;
  double sxy = 0.0;
  double syy = 0.0;
  for (const Sample& s : samples_) {
    if (is_outlier(s, centre)) continue;
    const double y = s.width - centre.at(s.across);
    n += 1.0;
    sx += s.across;
    sxx += s.across * s.across;
    sy += y;
    sxy += s.across * y;
    syy += y * y;
  }
  Fit fit;
  fit.inliers = static_cast<std::size_t>(n);
  if (fit.inliers == 0) return fit;
  fit.shift = sy / n;
  fit.spread = kSigmaOfInliers * std::sqrt(std::max(0.0, syy / n - fit.shift * fit.shift));
  const double pivot = sx / n;
  fit.model = {centre.at(pivot) + fit.shift, 0.0, pivot, 0.0};
  if (fit.inliers < kLeastForSlope) return fit;
  const double vxx = sxx - sx * sx / n;
  if (vxx < 25.0 * n) return fit;  // The stripe is level to 5 pixels: no lever.
  const double change = (sxy - sx * sy / n) / vxx;
  const double residual = std::max(1e-12, (syy - sy * sy / n - change * change * vxx) / (n - 2.0));
  const double slope = centre.slope + change;
  const bool stands_out = std::abs(slope) > kSlopeDeviations * std::sqrt(residual / vxx);
  if (stands_out && is_stripe_beyond(std::sqrt(vxx / n), pivot, centre)) fit.model.slope = slope;
  return fit;
}

// Whether what lies so far off, which is what a slope depends on, is mostly no outlier: of light
// sources and edges beside a level stripe some always have its width.
bool WidthTracker::is_stripe_beyond(double distance, double pivot, const WidthModel& centre) const {
  double all = 0.0;
  double inliers = 0.0;
  for (const Sample& s : samples_) {
    if (std::abs(s.across - pivot) < distance) continue;
    all += 1.0;
    if (!is_outlier(s, centre)) inliers += 1.0;
  }
  return inliers >= kMostlyInliers * all;
}

}  // namespace striper::detail
