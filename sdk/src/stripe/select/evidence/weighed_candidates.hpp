// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "stripe/select/evidence/line_support.hpp"
#include "stripe/select/evidence/mean_about.hpp"
#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// What a forest made of a frame's candidates, and what that says of each by those about it: its
/// rivals in its scan line, its neighbours in its piece, what lies on a line with it.
///
/// 20 ns a candidate, and LineSupport. No allocation after the first frame of a size.
class WeighedCandidates {
 public:
  /// Log odds of what is so improbable that it is not looked at again.
  static constexpr float kHopeless = -5.0F;

  void reserve(const StripePieces& pieces);

  /// @param odds log odds of each candidate.
  void sum_up(const StripePieces& pieces, const std::vector<float>& odds);

  const std::vector<float>& odds() const noexcept { return odds_; }
  float odds(std::size_t candidate) const noexcept { return odds_[candidate]; }
  bool is_hopeless(std::size_t candidate) const noexcept { return odds_[candidate] < kHopeless; }

  /// Log odds of the best other candidate of its scan line; Evidence::kUnknown: there is none.
  float rival(std::size_t candidate) const noexcept { return rivals_[candidate]; }
  /// Means of those about it in its piece, and of their rivals.
  float near(std::size_t candidate) const noexcept { return near_[candidate]; }
  float near_rival(std::size_t candidate) const noexcept { return near_rivals_[candidate]; }
  /// Mean of a piece, and of its rivals.
  float of_piece(std::size_t piece) const noexcept { return of_piece_[piece]; }
  float rival_of_piece(std::size_t piece) const noexcept { return rival_of_piece_[piece]; }
  /// What lies on a line with it; the most, far and near, that does with others of its scan line
  /// that are not within 3 pixels.
  const LineSupport::Support& lines(std::size_t candidate) const noexcept {
    return lines_.of(candidate);
  }
  LineSupport::Support lines_of_rivals(const StripePieces& pieces,
                                       std::size_t candidate) const noexcept;

  /// The best log odds of a scan line; Evidence::kUnknown where it has none, or beyond the image.
  float best_of_line(const StripePieces& pieces, int line) const noexcept;
  /// Part of the scan lines with something that is probably the stripe.
  float coverage() const noexcept { return coverage_; }

 private:
  std::vector<float> odds_, rivals_, near_, near_rivals_, of_piece_, rival_of_piece_;
  MeanAbout mean_about_;
  LineSupport lines_;
  float coverage_ = 0.0F;
};

}  // namespace striper::detail
