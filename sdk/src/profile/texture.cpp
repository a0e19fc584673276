// SPDX-License-Identifier: Apache-2.0
#include "profile/texture.hpp"

#include <algorithm>
#include <cmath>

#include <striper/core/robust.hpp>

namespace striper::detail {
namespace {

// Returns on both sides from which the slope of the surface is taken.
constexpr std::size_t kSlopeReach = 8;
// Grazing beyond this (80 degrees) is more likely an edge.
constexpr double kSteepest = 6.0;
constexpr std::size_t kFewest = 20;
// Squares beyond three sigmas are left out; the mean of the rest is smaller by this.
constexpr double kTrimSigmas = 3.0;
constexpr double kMeanOfTrimmed = 0.9733;
// Variance of the mean of n squares, times n: 2 for independent ones, and neighbouring second
// differences correlate by -2/3 and 1/6.
constexpr double kVarianceOfMean = 3.9;
// A texture is believed if it stands out of chance by this many sigmas.
constexpr double kSignificance = 3.5;
constexpr int kRounds = 8;

}  // namespace

void Texture::take_differences(const InverseRanges& ranges) {
  squares_.clear();
  noise_.clear();
  for (std::size_t i = 1; i + 1 < ranges.size(); ++i) {
    const double k0 = ranges.turn(i, i + 1);
    const double k1 = ranges.turn(i - 1, i + 1);
    const double k2 = ranges.turn(i - 1, i);
    const double e = k0 * ranges.q[i - 1] - k1 * ranges.q[i] + k2 * ranges.q[i + 1];
    squares_.push_back(e * e);
    noise_.push_back(k0 * k0 * ranges.noise[i - 1] + k1 * k1 * ranges.noise[i] +
                     k2 * k2 * ranges.noise[i + 1]);
  }
}

// dq = q hypot(q, q') times the displacement across the surface; q' from the flatter of both sides,
// so that an edge does not count.
void Texture::take_leverages(const InverseRanges& ranges) {
  const std::size_t n = ranges.size();
  leverage_.resize(n);
  gain_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    double slope = kSteepest * ranges.q[i];
    if (i >= kSlopeReach)
      slope = std::min(slope, std::abs((ranges.q[i] - ranges.q[i - kSlopeReach]) /
                                       ranges.turn(i - kSlopeReach, i)));
    if (i + kSlopeReach < n)
      slope = std::min(slope, std::abs((ranges.q[i + kSlopeReach] - ranges.q[i]) /
                                       ranges.turn(i, i + kSlopeReach)));
    leverage_[i] = ranges.q[i] * ranges.q[i] * (ranges.q[i] * ranges.q[i] + slope * slope);
  }
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double k0 = ranges.turn(i, i + 1);
    const double k1 = ranges.turn(i - 1, i + 1);
    const double k2 = ranges.turn(i - 1, i);
    gain_.push_back(k0 * k0 * leverage_[i - 1] + k1 * k1 * leverage_[i] +
                    k2 * k2 * leverage_[i + 1]);
  }
}

// The trimmed mean square over the expected one, less 1.
double Texture::excess(double texture_m2) {
  ratios_.resize(squares_.size());
  for (std::size_t i = 0; i < squares_.size(); ++i) {
    const double variance = noise_[i] + (texture_m2 > 0.0 ? texture_m2 * gain_[i] : 0.0);
    ratios_[i] = squares_[i] / variance;
  }
  const double sigma2 = kSigmaOfMedianAbsolute * kSigmaOfMedianAbsolute * upper_median(ratios_);
  double sum = 0.0;
  int count = 0;
  for (const double ratio : ratios_) {
    if (ratio > kTrimSigmas * kTrimSigmas * sigma2) continue;
    sum += ratio;
    ++count;
  }
  return sum / (std::max(count, 1) * kMeanOfTrimmed) - 1.0;
}

double Texture::estimate_m(const InverseRanges& ranges) {
  if (ranges.size() < kFewest) return 0.0;
  take_differences(ranges);
  const double smooth = excess(0.0);
  const double chance = std::sqrt(kVarianceOfMean / static_cast<double>(squares_.size()));
  if (smooth < kSignificance * chance) return 0.0;
  take_leverages(ranges);
  double low = 0.0;
  double high = 0.0;
  for (std::size_t i = 0; i < noise_.size(); ++i)
    high += (1.0 + smooth) * noise_[i] / gain_[i] / static_cast<double>(noise_.size());
  for (int round = 0; round < kRounds && excess(high) > 0.0; ++round) {
    low = high;
    high *= 4.0;
  }
  for (int round = 0; round < kRounds; ++round) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0.0 ? low : high) = middle;
  }
  return std::sqrt(0.5 * (low + high));
}

void Texture::apply(double texture_m, InverseRanges& ranges) const {
  for (std::size_t i = 0; i < ranges.size(); ++i)
    ranges.weight[i] =
        1.0 / (ranges.noise[i] + (texture_m > 0.0 ? texture_m * texture_m * leverage_[i] : 0.0));
}

}  // namespace striper::detail
