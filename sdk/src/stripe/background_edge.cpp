// SPDX-License-Identifier: Apache-2.0
#include "stripe/background_edge.hpp"

#include <algorithm>
#include <cmath>

#include "stripe/line_view.hpp"

namespace striper::detail {
namespace {

constexpr double kStripeReach = 2.5;  // Widths from the peak to where the stripe is gone.
constexpr int kSidePixels = 3;        // Few: an edge farther off leaves the peak alone.
constexpr int kLeastPixels = 2;
constexpr double kPlain = 5.0;  // Sigmas of a difference.

// The background beside a place.
struct Side {
  double value = 0.0;     // Mean of lit - dark,
  double variance = 0.0;  // and the variance of one of its pixels.
  int pixels = 0;
};

template <typename Pixel>
Side side_of(const LitLine<Pixel>& line, const PlanNoise& noise, int first) {
  Side side;
  const int end = std::min(first + kSidePixels, line.length());
  for (int k = std::max(0, first); k < end; ++k) {
    if (line.clipped(k) || line.blind(k)) continue;
    side.value += line.value(k);
    side.variance += noise.model.variance_dn2(line.lit(k)) +
                     noise.dark_noise_gain * noise.model.variance_dn2(line.dark(k));
    ++side.pixels;
  }
  side.value /= std::max(1, side.pixels);
  side.variance /= std::max(1, side.pixels);
  return side;
}

// What a Gaussian at a pixel finds above a level, in sigmas of noise.
template <typename Pixel>
double rise_above(const LitLine<Pixel>& line, const Side& level, double width, int across) {
  const int reach = static_cast<int>(std::ceil(kStripeReach * width));
  double response = 0.0;
  double energy = 0.0;
  for (int k = std::max(0, across - reach); k <= std::min(across + reach, line.length() - 1); ++k) {
    if (line.blind(k)) continue;
    const double t = (k - across) / width;
    const double g = std::exp(-0.5 * t * t);
    response += g * (line.value(k) - level.value);
    energy += g * g;
  }
  return response / std::sqrt(energy * level.variance);
}

template <typename Pixel>
bool is_edge(const LitLine<Pixel>& line, const PlanNoise& noise, const PeakPlace& place,
             double threshold) {
  const int reach = static_cast<int>(std::ceil(kStripeReach * place.width));
  const Side before = side_of(line, noise, place.across - reach - kSidePixels);
  const Side after = side_of(line, noise, place.across + reach + 1);
  if (std::min(before.pixels, after.pixels) < kLeastPixels) return false;
  const double mean_variance = before.variance / before.pixels + after.variance / after.pixels;
  const double step = std::abs(after.value - before.value);
  const double above = 0.5 * (before.value + after.value) - place.level;
  const double plain = kPlain * std::sqrt(mean_variance);
  if (!(step > plain || above > 0.5 * plain)) return false;
  const Side& brighter = before.value > after.value ? before : after;
  double rise = 0.0;
  for (const int off : {-1, 0, 1}) {
    rise = std::max(rise, rise_above(line, brighter, place.width, place.across + off));
  }
  return rise < threshold;
}

}  // namespace

bool is_edge_of_background(const LitFrame& frame, StripeAxis axis, const PlanNoise& noise,
                           const PeakPlace& place, double threshold) {
  if (frame.lit.depth() == CV_8U) {
    return is_edge(LitLine<std::uint8_t>(frame, axis, place.line), noise, place, threshold);
  }
  return is_edge(LitLine<std::uint16_t>(frame, axis, place.line), noise, place, threshold);
}

}  // namespace striper::detail
