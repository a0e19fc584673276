// SPDX-License-Identifier: Apache-2.0
#include "stripe/learn/laser_widths.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/pixel_box.hpp"
#include "stripe/learn/width_guess.hpp"
#include "stripe/profile/line_view.hpp"

namespace striper::detail {
namespace {

constexpr double kDefaultWidth = 1.5;
constexpr double kLeastSigma = 0.2;

}  // namespace

const ExpectedStripe* expected_of(const ExtractOptions& options, int laser) {
  const auto index = static_cast<std::size_t>(std::max(0, laser));
  return index < options.expected.size() ? &options.expected[index] : nullptr;
}

std::optional<WidthModel> known_width(const LitFrame& frame, const ExtractOptions& options) {
  if (options.stripe_sigma_px) {
    return WidthModel{with_pixel_box(*options.stripe_sigma_px), 0.0, 0.0, 0.0};
  }
  const ExpectedStripe* const expected = expected_of(options, frame.laser);
  if (expected == nullptr || !expected->sigma_px) return {};
  const AxisGrid& across = grid_across(frame.grid, options.axis);
  const double at_pivot = with_pixel_box(std::max(kLeastSigma, *expected->sigma_px / across.step));
  const double slope = expected->sigma_slope * (*expected->sigma_px / across.step) / at_pivot;
  return WidthModel{at_pivot, slope, across.index(expected->pivot_px), 0.0};
}

WidthTracker& LaserWidths::of(const FrameAtHand& at_hand, const BlockMaxima& blocks,
                              const ExtractOptions& options) {
  const auto index = static_cast<std::size_t>(std::max(0, at_hand.frame.laser));
  if (index >= widths_.size()) widths_.resize(index + 1);
  WidthTracker& width = widths_[index];
  if (width.is_known()) return width;
  const std::optional<WidthModel> known = known_width(at_hand.frame, options);
  if (options.stripe_sigma_px) {
    width.set(known->at_pivot);
  } else if (known) {
    width.expect(*known);
  } else {
    const auto guess = guess_stripe_width(at_hand.frame, options.axis, blocks, at_hand.noise_dn);
    width.set(guess.value_or(kDefaultWidth));
  }
  return width;
}

}  // namespace striper::detail
