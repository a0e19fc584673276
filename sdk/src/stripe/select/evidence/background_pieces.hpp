// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// What the background of a frame shows: how high its candidates are, and how long its pieces.
///
/// Each candidate counts as far as it is probably not the stripe. A piece of a length that many of
/// the background's pieces have is no sign of a stripe. 5 ns a candidate. No allocation after the
/// first frame of a size.
class BackgroundPieces {
 public:
  void reserve(std::size_t most) { doubts_.reserve(most); }

  /// @param heights log of each candidate's. @param odds log odds of each that it is the stripe.
  void sum_up(const StripePieces& pieces, const std::vector<float>& heights,
              const std::vector<float>& odds);

  /// Mean log height, and the standard deviation of that.
  float height() const noexcept { return height_; }
  float spread() const noexcept { return spread_; }

  /// Log of 1 + how many background candidates per scan line are in pieces as long as this one or
  /// longer, itself left out.
  float as_long_as(const StripePieces& pieces, std::size_t piece) const noexcept;

 private:
  static constexpr std::size_t kLengths = 14;  // Powers of the root of 2 of 1 to 90 candidates.
  static std::size_t class_of(const Piece& piece) noexcept;

  std::vector<float> doubts_;  // Of each piece, its candidates'.
  std::array<float, kLengths + 1> as_long_ = {};
  float height_ = 0.0F;
  float spread_ = 0.0F;
};

}  // namespace striper::detail
