// SPDX-License-Identifier: Apache-2.0
#include "stripe/edges/background_edge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr double kStripeReach = 2.5;  // Widths from the peak to where the stripe is gone.
// Few show that a bar ends, more of them how little an edge rises.
constexpr std::array kSidePixels{3, 6};
constexpr int kLeastPixels = 2;
constexpr double kPlain = 4.0;  // Sigmas of a difference.

// The background beside a place.
struct Side {
  double value = 0.0;     // Mean of lit - dark,
  double variance = 0.0;  // and the variance of one of its pixels.
  int pixels = 0;

  double sigma() const { return std::sqrt(variance / pixels); }  // Of the mean.
};

int reach_of(double width) { return static_cast<int>(std::ceil(kStripeReach * width)); }

template <typename Pixel>
Side side_of(const LitLine<Pixel>& line, const PlanNoise& noise, int first, int pixels) {
  Side side;
  const int end = std::min(first + pixels, line.length());
  for (int k = std::max(0, first); k < end; ++k) {
    if (line.clipped(k) || line.masked(k)) continue;
    side.value += line.value(k);
    side.variance += noise.model.variance_dn2(line.lit(k)) +
                     noise.dark_noise_gain * noise.model.variance_dn2(line.dark(k));
    ++side.pixels;
  }
  side.value /= std::max(1, side.pixels);
  side.variance /= std::max(1, side.pixels);
  return side;
}

// What a Gaussian at a pixel finds above a level, in sigmas of the noise of both.
template <typename Pixel>
double rise_above(const LitLine<Pixel>& line, const Side& level, double width, int across) {
  const int reach = reach_of(width);
  double response = 0.0;
  double energy = 0.0;
  double sum = 0.0;
  for (int k = std::max(0, across - reach); k <= std::min(across + reach, line.length() - 1); ++k) {
    if (line.masked(k)) continue;
    const double t = (k - across) / width;
    const double g = std::exp(-0.5 * t * t);
    response += g * (line.value(k) - level.value);
    energy += g * g;
    sum += g;
  }
  return response / std::hypot(std::sqrt(energy * level.variance), sum * level.sigma());
}

// The side that a stripe would have to rise above, if the sides contradict a straight background;
// at the border of the image there is only one.
std::optional<Side> contradicting(const Side& before, const Side& after, double level) {
  const bool has_before = before.pixels >= kLeastPixels;
  const bool has_after = after.pixels >= kLeastPixels;
  if (!has_before && !has_after) return std::nullopt;
  if (!has_before || !has_after) {
    const Side& only = has_before ? before : after;
    const bool is_plain = std::abs(only.value - level) > kPlain * only.sigma();
    return is_plain ? std::optional(only) : std::nullopt;
  }
  const double plain = kPlain * std::hypot(before.sigma(), after.sigma());
  const double step = std::abs(after.value - before.value);
  const double above = 0.5 * (before.value + after.value) - level;
  if (!(step > plain || above > 0.5 * plain)) return std::nullopt;
  return before.value > after.value ? before : after;
}

template <typename Pixel>
double above_edge(const LitLine<Pixel>& line, const PlanNoise& noise, const PeakPlace& place) {
  const int reach = reach_of(place.width);
  double least = std::numeric_limits<double>::infinity();
  for (const int pixels : kSidePixels) {
    const Side before = side_of(line, noise, place.across - reach - pixels, pixels);
    const Side after = side_of(line, noise, place.across + reach + 1, pixels);
    const std::optional<Side> side = contradicting(before, after, place.level);
    if (!side) continue;
    double rise = 0.0;
    for (const int off : {-1, 0, 1}) {
      rise = std::max(rise, rise_above(line, *side, place.width, place.across + off));
    }
    least = std::min(least, rise);
  }
  return least;
}

}  // namespace

double disturbed_by_neighbours_px(double width) { return 2 * reach_of(width) + kSidePixels.back(); }

double significance_above_edge(const LitFrame& frame, StripeAxis axis, const PlanNoise& noise,
                               const PeakPlace& place) {
  if (frame.lit.depth() == CV_8U) {
    return above_edge(LitLine<std::uint8_t>(frame, axis, place.line), noise, place);
  }
  return above_edge(LitLine<std::uint16_t>(frame, axis, place.line), noise, place);
}

}  // namespace striper::detail
