// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include <striper/core/frame.hpp>
#include <striper/core/stripe_axis.hpp>
#include <striper/scan/return_views.hpp>
#include <striper/scan/scan_frame.hpp>

namespace striper {

/// What one lit exposure gives: one return per column (or row), in order along the stripe.
///
/// It stands alone: it says whose it is and in which frame, may outlive what made it, and go from
/// thread to thread as `std::shared_ptr<const PolarScan>`.
struct PolarScan {
  std::shared_ptr<const ScanFrame> frame;  ///< Whose, and where; null for one made by hand.
  std::uint64_t sequence = 0;              ///< The source's number of the frame.
  FrameTime time;                          ///< Exposure midpoint.
  int laser = 0;                           ///< Which laser plane; 0 if unknown.
  Field field = Field::kProgressive;
  StripeAxis axis = StripeAxis::kColumns;
  bool is_stripe_seen = true;  ///< False: no laser's stripe is in the image; no return is kOk.
  std::vector<Return> returns;

  /// The returns of status kOk: `for (const Return& one : scan.ok())`. Like the columns below
  /// valid as long as `returns` is neither changed nor gone.
  OkReturns ok() const noexcept { return OkReturns(returns); }

  // One number of every return, NaN where it does not exist; `column(&Return::u_px)` of any other.
  ReturnColumn bearing_rad() const noexcept { return column(&Return::bearing_rad); }
  ReturnColumn range_m() const noexcept { return column(&Return::range_m); }
  ReturnColumn x_m() const noexcept { return column(&Return::x_m); }
  ReturnColumn y_m() const noexcept { return column(&Return::y_m); }
  ReturnColumn sigma_m() const noexcept { return column(&Return::sigma_m); }
  ReturnColumn column(double Return::*number) const noexcept { return {returns, number}; }

  /// Which striper it is of. Valid as long as `frame`.
  std::string_view head() const noexcept { return frame ? frame->head : kDefaultHead; }
};

}  // namespace striper
