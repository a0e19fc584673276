// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "stripe/select/stripe_pieces.hpp"

namespace striper::detail {

/// How much of what may be the stripe lies on one straight line with a candidate, whatever lies
/// between: a surface's texture breaks the stripe into pieces, and makes others, but not along a
/// line. Each of those about it votes for the directions in which a line through it and the
/// candidate passes (Hough 1962, of lines through a point).
///
/// Of a scan line the best eight vote and have any. 4 ns a vote, .5 to 4 us a candidate. No
/// allocation after the first frame of a size.
class LineSupport {
 public:
  /// Of the direction that has most.
  struct Support {
    float far = 0.0F;    ///< Probabilities per scan line, over a tenth of the image to each side,
    float near = 0.0F;   ///< and over a fortieth.
    float hits = 0.0F;   ///< Votes per scan line,
    float stand = 0.0F;  ///< and log of 1 + all over 1 + the mean direction's.
  };

  void reserve(std::size_t most, int lines);

  /// @param odds of each candidate, log. @param hopeless those with less neither vote nor have any.
  void find(const StripePieces& pieces, const std::vector<float>& odds, float hopeless);

  const Support& of(std::size_t candidate) const noexcept { return supports_[candidate]; }

 private:
  static constexpr int kBins = 120;
  using Votes = std::array<float, kBins + 1>;

  struct Voter {
    std::size_t candidate;
    float across;
    float odds;
    float probability;
  };
  void find_voters(const StripePieces& pieces, const std::vector<float>& odds, float hopeless);
  // Of those about a candidate for the directions of lines through it.
  void vote(int line, float across, int lines);
  Support best() const;

  std::vector<Support> supports_;
  std::vector<Voter> voters_;
  std::vector<std::size_t> first_of_;   // Voter of each scan line.
  int reach_ = 0, near_reach_ = 0;      // Scan lines to each side,
  int far_lines_ = 0, near_lines_ = 0;  // and how many of these were looked at.
  Votes far_{}, near_{}, hits_{};       // Differences from bin to bin.
};

}  // namespace striper::detail
