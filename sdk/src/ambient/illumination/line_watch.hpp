// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>

#include "ambient/pixels/band_profiles.hpp"
#include "ambient/pixels/held_exposure.hpp"

namespace striper::detail {

/// Watches whether the stripe of each laser shows where the pattern has it.
class LineWatch {
 public:
  explicit LineWatch(StripeAxis axis) noexcept;

  /// Whether the pattern cannot be: the stripe is dark in `lit - dark`, or was plain and is gone,
  /// or shows in one dark exposure and not in the other.
  bool refutes(const LitFrame& lit, const Neighbours& darks);

 private:
  // Of a bright stripe and of a dark one, as LineSearch has them.
  struct Line {
    double bright;
    double dark;

    bool is_dark() const;
    bool is_bright() const;
    bool is_plainly_bright() const;
    bool is_nothing() const;
  };

  /// @param variance of the difference beyond noise; may be empty.
  Line line_of(const cv::Mat& over, const cv::Mat& under, const cv::Mat& variance);

  StripeAxis axis_;
  LineSearch search_;
  BandProfiles over_;
  BandProfiles under_;
  std::vector<bool> was_plain_;  // Per laser: its stripe, in the last exposure that it lit.
};

}  // namespace striper::detail
