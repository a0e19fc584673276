// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include <striper/core/lit_frame.hpp>
#include <striper/stripe/stripe.hpp>

namespace striper::detail {

/// What the image shows about a return: its scan line and those to either side, as far across.
struct ReturnPatch {
  static constexpr std::size_t kSide = 32;  ///< Pixels along the stripe, and across it.
  enum Plane : std::size_t {
    kImage,   ///< Pixels above their median, in heights of the return.
    kReturn,  ///< Where the scan lines' returns are: 1, and less beside.
    kRated,   ///< That times how they were rated.
    kPlanes
  };

  /// Rows across the stripe, of pixels along it. The return is in the first pixel of the second
  /// half of both.
  std::array<float, kPlanes * kSide * kSide> of;

  float* row(Plane plane, std::size_t across) noexcept {
    return of.data() + (plane * kSide + across) * kSide;
  }
};

/// A frame with its returns, one a scan line.
struct RatedFrame {
  const LitFrame& frame;
  const Stripe& stripe;
  std::span<const float> odds;  ///< Of each scan line: kNoReturn where there is none.

  /// Where across a scan line's return is, in pixels of the frame.
  double position(std::size_t line) const noexcept;
};

/// Fills a patch. 3 us, no allocation. Precondition: the scan line has a return.
void look_about(const RatedFrame& rated, std::size_t line, ReturnPatch& patch) noexcept;

}  // namespace striper::detail
