// SPDX-License-Identifier: Apache-2.0
#include "stripe/learn/excess_scatter.hpp"

#include <algorithm>
#include <cmath>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

constexpr std::size_t kLag = 2;
constexpr std::size_t kMemory = 1536;  // Differences.
constexpr std::size_t kFirstSamples = 384;
constexpr std::size_t kLaterSamples = 16;
constexpr std::size_t kLeastSamples = 32;
constexpr std::size_t kEvery = 24;              // Frames, once the memory is full.
constexpr double kMedianOfSquare = 0.45493642;  // Of chi squared with one degree of freedom.
constexpr double kSumOfSquares = 70.0;          // 1 + 16 + 36 + 16 + 1.
// Standard error of the root of the median of n correlated squares, times sqrt(n).
constexpr double kRelativeError = 1.6;
constexpr int kSecants = 3;
constexpr int kRounds = 3;
constexpr float kEdge = 16.0F;    // Variances.
constexpr double kLargest = 1.0;  // Pixels squared.

}  // namespace

void ExcessScatter::update(const Stripe& stripe) {
  const bool is_full = differences_.size() == kMemory;
  take_differences(stripe, is_full ? kLaterSamples : kFirstSamples);
  if (differences_.size() < kLeastSamples) return;
  if (is_full && ++frames_ % kEvery != 0) return;
  const double chance =
      1.0 + 2.0 * kRelativeError / std::sqrt(static_cast<double>(differences_.size()));
  sigma_px_ = std::sqrt(solve(chance * chance));
}

void ExcessScatter::take_differences(const Stripe& stripe, std::size_t most) {
  differences_.reserve(kMemory);
  core_.reserve(kMemory);
  scratch_.reserve(kMemory);
  const std::size_t size = stripe.size();
  const std::size_t stride = size / most + 1;
  const std::size_t first = 2 * kLag + next_ % stride;  // Other scan lines in every frame.
  const auto ok = [&](std::size_t i) { return stripe.status[i] == ReturnStatus::kOk; };
  const auto variance = [&](std::size_t i) { return stripe.sigma_px[i] * stripe.sigma_px[i]; };
  for (std::size_t i = first; i + 2 * kLag < size; i += stride) {
    const std::size_t a = i - 2 * kLag;
    const std::size_t b = i - kLag;
    const std::size_t c = i + kLag;
    const std::size_t e = i + 2 * kLag;
    if (!ok(a) || !ok(b) || !ok(i) || !ok(c) || !ok(e)) continue;
    const std::vector<double>& x = stripe.across_px;
    const double d = x[a] + x[e] - 4.0 * (x[b] + x[c]) + 6.0 * x[i];
    keep({static_cast<float>(d * d),
          variance(a) + variance(e) + 16.0F * (variance(b) + variance(c)) + 36.0F * variance(i)});
  }
}

void ExcessScatter::keep(const Difference& difference) {
  if (differences_.size() < kMemory) {
    differences_.push_back(difference);
    return;
  }
  differences_[next_] = difference;
  next_ = (next_ + 1) % kMemory;
}

// The excess that explains the scatter: none of what may be chance, all of it where it is as
// plainly more than that again, and in between what joins the two. The inverse of the ratio is
// nearly straight in the excess squared, so that three secants find it.
double ExcessScatter::solve(double chance) {
  if (is_explained(chance)) return 0.0;
  const double without = leave_out_edges();
  if (without <= chance) return 0.0;
  const double allowed = std::max(1.0, chance * chance / without);
  double variance = 0.0;
  for (const Difference& s : core_) variance += static_cast<double>(s.variance);
  variance /= static_cast<double>(core_.size());
  double at = (without / allowed - 1.0) * variance / kSumOfSquares;
  for (int n = 0; n < kSecants; ++n) {
    const double rise = 1.0 / median_ratio(at) - 1.0 / without;
    if (!(rise > 0.0)) break;
    at *= (1.0 / allowed - 1.0 / without) / rise;
  }
  return std::clamp(at, 0.0, kLargest);
}

// Whether the median is no more than chance allows, without looking for it.
bool ExcessScatter::is_explained(double allowed) const {
  const auto limit = static_cast<float>(allowed * kMedianOfSquare);
  std::size_t below = 0;
  for (const Difference& s : differences_) {
    below += static_cast<std::size_t>(s.squared <= limit * s.variance);
  }
  return below > differences_.size() / 2;
}

// Returns the median ratio of what is left.
double ExcessScatter::leave_out_edges() {
  core_ = differences_;
  double ratio = median_ratio(0.0);
  for (int round = 0; round < kRounds; ++round) {
    const float limit = kEdge * static_cast<float>(ratio);
    const auto is_edge = [=](const Difference& s) { return s.squared > limit * s.variance; };
    core_.erase(std::remove_if(core_.begin(), core_.end(), is_edge), core_.end());
    ratio = median_ratio(0.0);
  }
  return ratio;
}

double ExcessScatter::median_ratio(double excess2) {
  const auto added = static_cast<float>(kSumOfSquares * excess2);
  scratch_.clear();
  for (const Difference& s : core_) scratch_.push_back(s.squared / (s.variance + added));
  return static_cast<double>(upper_median(scratch_)) / kMedianOfSquare;
}

}  // namespace striper::detail
