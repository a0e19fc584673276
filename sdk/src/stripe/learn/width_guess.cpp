// SPDX-License-Identifier: Apache-2.0
#include "stripe/learn/width_guess.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include <striper/core/robust.hpp>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr double kFwhmOfSigma = 2.3548200450309493;
constexpr int kLines = 128;
constexpr double kProminence = 4.0;  // Standard deviations of noise.
constexpr int kReach = 32;

// The mean of several scan lines' profiles about their brightest pixels, each in parts of its own
// height: a few light sources are no more than a few faint scan lines.
class MeanProfile {
 public:
  template <typename Pixel>
  void add(const LitFrame& frame, StripeAxis axis, int line_number, const BlockMaxima::Peak& peak) {
    const int across = peak.across;
    const LitLine<Pixel> line(frame, axis, line_number);
    const int first = std::max(0, across - kReach);
    const int last = std::min(line.length() - 1, across + kReach);
    for (int k = first; k <= last; ++k) {
      const auto i = static_cast<std::size_t>(k - across + kReach);
      sum_[i] += static_cast<double>(line.value(k)) / peak.prominence_dn;
      ++count_[i];
    }
  }

  double at(int k) const {
    const auto i = static_cast<std::size_t>(k + kReach);
    return count_[i] > 0 ? sum_[i] / count_[i] : std::numeric_limits<double>::quiet_NaN();
  }

  // Half the width at half height over the background, the lower quarter of the profile; 0 where
  // there is no peak.
  double sigma() {
    take_off_ramp();
    Levels levels{};
    const std::size_t known = known_levels(-kReach, kReach, levels);
    const double background = quantile(levels, known, known / 4);
    if (!(at(0) > background)) return 0.0;
    const double half = 0.5 * (at(0) + background);
    return (distance_to(half, -1) + distance_to(half, +1)) / kFwhmOfSigma;
  }

 private:
  using Levels = std::array<double, 2 * kReach + 1>;

  // What both ends say, if both are seen.
  void take_off_ramp() {
    Levels levels{};
    const std::size_t before = known_levels(-kReach, -kReach / 2, levels);
    if (before == 0) return;
    const double first = quantile(levels, before, before / 2);
    const std::size_t after = known_levels(kReach / 2, kReach, levels);
    if (after == 0) return;
    const double rise = (quantile(levels, after, after / 2) - first) / (1.5 * kReach);
    for (int k = -kReach; k <= kReach; ++k) {
      const auto i = static_cast<std::size_t>(k + kReach);
      sum_[i] -= rise * k * count_[i];
    }
  }

  std::size_t known_levels(int first, int last, Levels& levels) const {
    std::size_t known = 0;
    for (int k = first; k <= last; ++k) {
      if (std::isfinite(at(k))) levels[known++] = at(k);
    }
    return known;
  }

  static double quantile(Levels& levels, std::size_t known, std::size_t at) {
    std::span seen(levels.data(), known);
    return nth_smallest(seen, at);
  }

  // From the peak to where the profile falls below `level`, by linear interpolation.
  double distance_to(double level, int direction) const {
    for (int n = 1; n <= kReach; ++n) {
      const double previous = at((n - 1) * direction);
      const double value = at(n * direction);
      if (!std::isfinite(value)) return n - 1;
      if (value <= level) return n - 1 + (previous - level) / (previous - value);
    }
    return kReach;
  }

  std::array<double, 2 * kReach + 1> sum_{};
  std::array<int, 2 * kReach + 1> count_{};
};

}  // namespace

std::optional<double> guess_stripe_width(const LitFrame& frame, StripeAxis axis,
                                         const BlockMaxima& blocks, double noise_dn) {
  MeanProfile mean;
  int count = 0;
  const int stride = blocks.lines() / kLines + 1;
  for (int line = 0; line < blocks.lines(); line += stride) {
    const BlockMaxima::Peak peak = blocks.best(0, line);
    if (peak.prominence_dn < kProminence * noise_dn) continue;
    ++count;
    if (frame.lit.depth() == CV_8U) {
      mean.add<std::uint8_t>(frame, axis, line, peak);
    } else {
      mean.add<std::uint16_t>(frame, axis, line, peak);
    }
  }
  const double sigma = count > 0 ? mean.sigma() : 0.0;
  if (!(sigma > 0.0)) return std::nullopt;
  return std::clamp(sigma, 0.5, 8.0);
}

}  // namespace striper::detail
