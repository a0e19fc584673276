// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <striper/geometry/line_fit.hpp>
#include <striper/stripe/stripe.hpp>

#include "stripe/report/line_odds.hpp"
#include "stripe/select/evidence/evidence.hpp"

namespace striper::detail {

/// What the ratings of a frame's returns, one a scan line, tell of each of them by those about it:
/// how sure those are, and how far it lies off the straight line through them.
///
/// Four straight lines a return. No allocation after the first frame of a size.
class RatedNeighbours {
 public:
  /// Of a frame of so many scan lines, none of which is rated.
  void begin(std::size_t lines);

  /// @param odds log odds of each scan line's return, at least kNoReturn.
  void hear(const Stripe& stripe, std::span<const float> odds);

  /// Of the return of a scan line.
  void add_to(Evidence& evidence, std::size_t line) const noexcept;

 private:
  struct Rated {
    float weight = 0.0F;    // In lines: 0 of what is not nearly sure.
    float position = 0.0F;  // Pixels.
    float right = 0.5F;     // What is off by less is right, pixels.
    int before = 0;         // Scan lines to the sure return before it,
    int after = 0;          // and to that after it.
  };
  // How far a return lies off a line of others.
  struct Off {
    float by_right = Evidence::kUnknown;  // Log, over what is right;
    float by_scatter = Evidence::kUnknown;
    float scatter = Evidence::kUnknown;  // of those others, pixels, log, and what kFlat adds.
  };

  void find_sure();
  // Of those `from` to `to` scan lines after it; before it where negative.
  LineSums sums(std::size_t line, int from, int to) const noexcept;
  Off off(std::size_t line, const LineSums& others, double least_weight) const noexcept;
  // Of those up to so many scan lines away. @param first_kind the first of four: how many they are,
  // and Off.
  void add_line(Evidence& evidence, Evidence::Kind first_kind, std::size_t line,
                int reach) const noexcept;

  std::vector<Rated> rated_;
  std::vector<float> odds_;
  float coverage_ = 0.0F;  // Part of the scan lines with what is sure,
  float mean_ = 0.0F;      // and the mean probability of all.
};

}  // namespace striper::detail
