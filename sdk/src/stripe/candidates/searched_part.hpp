// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <striper/core/lit_frame.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/stripe/expected_stripe.hpp>

#include "stripe/candidates/peak_list.hpp"
#include "stripe/profile/ignored_pixels.hpp"

namespace striper::detail {

/// The shortest scan line that can show a stripe, in pixels.
inline constexpr int kLeastLength = 3;

/// The part of a frame, across, that can show the stripe, with the background about it; and where
/// in it each scan line can.
class SearchedPart {
 public:
  /// @param expected null, or without rows: the stripe can be anywhere. Outlives the part, and does
  ///        not change.
  /// @return the part, of the same pixels.
  LitFrame cut(const LitFrame& frame, StripeAxis axis, const ExpectedStripe* expected);

  /// Blanks what lies where the stripe cannot be.
  void refuse_outside(PeakList& peaks) const;

  /// Where, in the part, it is not looked for.
  const IgnoredPixels& ignored() const noexcept { return ignored_; }

  /// The first pixel across of the part.
  int from_px() const noexcept { return from_px_; }

  /// Whether each scan line has its limits; these are pixels of the part.
  bool is_limited() const noexcept { return !first_.empty(); }
  float first_of(int line) const noexcept { return first_[static_cast<std::size_t>(line)]; }
  float last_of(int line) const noexcept { return last_[static_cast<std::size_t>(line)]; }

 private:
  struct Extent {
    float first;
    float last;
  };
  // What the limits depend on.
  struct View {
    const ExpectedStripe* expected = nullptr;
    StripeAxis axis = StripeAxis::kColumns;
    PixelGrid grid;
    int lines = 0;
    int length = 0;
    friend bool operator==(const View&, const View&) = default;
  };
  void look_at(const View& view);
  Extent set_limits();

  // The first and last pixel across between which the stripe of each scan line can be.
  std::vector<float> first_, last_;
  int from_px_ = 0;
  int to_px_ = 0;
  View view_;
  IgnoredPixels ignored_;
};

}  // namespace striper::detail
