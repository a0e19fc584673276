// SPDX-License-Identifier: Apache-2.0
#include "stripe/excess_scatter.hpp"

#include <algorithm>
#include <cmath>

namespace striper::detail {
namespace {

constexpr std::size_t kLag = 3;
constexpr std::size_t kFirstSamples = 384;
constexpr std::size_t kLaterSamples = 128;
constexpr std::size_t kLeastSamples = 32;
constexpr double kMedianOfSquare = 0.45493642;  // Of chi squared with one degree of freedom.
constexpr double kSumOfSquares = 70.0;          // 1 + 16 + 36 + 16 + 1.
// Standard error of the root of the median of n correlated squares, times sqrt(n).
constexpr double kRelativeError = 1.6;
constexpr double kMemory = 3072.0;  // Samples.
constexpr int kSecants = 3;
constexpr double kLargest = 1.0;  // Pixels squared.

}  // namespace

double ExcessScatter::median_ratio(double excess2) {
  scratch_.clear();
  for (const Difference& s : differences_) {
    scratch_.push_back(s.squared / (s.variance + kSumOfSquares * excess2));
  }
  const auto middle = scratch_.begin() + static_cast<std::ptrdiff_t>(scratch_.size() / 2);
  std::nth_element(scratch_.begin(), middle, scratch_.end());
  return *middle / kMedianOfSquare;
}

// Whether the median is no more than chance allows, without looking for it.
bool ExcessScatter::is_explained(double allowed) const {
  std::size_t below = 0;
  for (const Difference& s : differences_) {
    below += static_cast<std::size_t>(s.squared <= allowed * kMedianOfSquare * s.variance);
  }
  return below > differences_.size() / 2;
}

// The excess at which the scatter is no more than chance explains. The inverse of the ratio is
// nearly straight in the excess squared, so that three secants find it.
double ExcessScatter::solve(double allowed) {
  if (is_explained(allowed)) return 0.0;
  const double without = median_ratio(0.0);
  double variance = 0.0;
  for (const Difference& s : differences_) variance += s.variance;
  variance /= static_cast<double>(differences_.size());
  double at = (without / allowed - 1.0) * variance / kSumOfSquares;
  for (int n = 0; n < kSecants; ++n) {
    const double rise = 1.0 / median_ratio(at) - 1.0 / without;
    if (!(rise > 0.0)) return at;
    at *= (1.0 / allowed - 1.0 / without) / rise;
  }
  return std::min(at, kLargest);
}

void ExcessScatter::update(const Stripe& stripe) {
  take_differences(stripe, weight_ < kFirstSamples ? kFirstSamples : kLaterSamples);
  if (differences_.size() < kLeastSamples) return;
  const double samples = static_cast<double>(differences_.size());
  const double all = std::min(weight_ + samples, kMemory);
  const double chance = 1.0 + 2.0 * kRelativeError / std::sqrt(all);
  const double allowed = chance * chance;
  excess2_ += samples / all * (solve(allowed) - excess2_);
  weight_ = all;
  sigma_px_ = std::sqrt(excess2_);
}

void ExcessScatter::take_differences(const Stripe& stripe, std::size_t most) {
  differences_.clear();
  differences_.reserve(kFirstSamples);
  scratch_.reserve(kFirstSamples);
  const std::size_t size = stripe.size();
  const std::size_t stride = size / most + 1;
  first_ = (first_ + 1) % stride;  // Other lines in every frame.
  const auto ok = [&](std::size_t i) { return stripe.status[i] == ReturnStatus::kOk; };
  const auto variance = [&](std::size_t i) {
    return static_cast<double>(stripe.sigma_px[i]) * static_cast<double>(stripe.sigma_px[i]);
  };
  for (std::size_t i = 2 * kLag + first_; i + 2 * kLag < size && differences_.size() < most;
       i += stride) {
    const std::size_t a = i - 2 * kLag;
    const std::size_t b = i - kLag;
    const std::size_t c = i + kLag;
    const std::size_t e = i + 2 * kLag;
    if (!ok(a) || !ok(b) || !ok(i) || !ok(c) || !ok(e)) continue;
    const std::vector<double>& x = stripe.across_px;
    const double d = x[a] + x[e] - 4.0 * (x[b] + x[c]) + 6.0 * x[i];
    differences_.push_back({d * d, variance(a) + variance(e) + 16.0 * (variance(b) + variance(c)) +
                                       36.0 * variance(i)});
  }
}

}  // namespace striper::detail
