// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <vector>

#include <striper/scan/polar_scan.hpp>

#include "support/random.hpp"

namespace striper::testing {

/// A scan as files have to carry it: every status, NaN, infinity, numbers of all sizes.
inline PolarScan made_scan(std::uint64_t sequence, std::size_t columns = 40) {
  static const auto frame = make_scan_frame("striper", 0, nullptr);
  PolarScan scan;
  scan.frame = frame;
  scan.sequence = sequence;
  scan.time.monotonic_ns = 1'000'000'000 + static_cast<std::int64_t>(sequence) * 33'333'333;
  scan.time.utc_offset_ns = 1'763'000'000'000'000'123;
  for (std::size_t i = 0; i < columns; ++i) {
    Return one;
    one.u_px = static_cast<double>(i);
    one.status = static_cast<ReturnStatus>(i % kReturnStatusCount);
    if (verdict(one.status) != Verdict::kMissing) {
      for (double Return::*const member :
           {&Return::v_px, &Return::bearing_rad, &Return::range_m, &Return::range_near_m,
            &Return::range_far_m, &Return::sigma_m, &Return::x_m, &Return::y_m}) {
        one.*member = normal(0.0, std::pow(10.0, normal(0.0, 4.0)));
      }
      one.bearing_rad = std::remainder(one.bearing_rad, 2.0 * std::numbers::pi);
      if (i % 7 == 0) one.range_far_m = std::numeric_limits<double>::infinity();
      for (float Return::*const member :
           {&Return::intensity_dn, &Return::width_px, &Return::row_sigma_px, &Return::confidence}) {
        one.*member = static_cast<float>(normal(0.0, std::pow(10.0, normal(0.0, 4.0))));
      }
    }
    scan.returns.push_back(one);
  }
  return scan;
}

/// So many of them, shared as a Scanner's are.
inline std::vector<std::shared_ptr<const PolarScan>> made_scans(std::size_t count,
                                                                std::size_t columns = 40) {
  std::vector<std::shared_ptr<const PolarScan>> scans;
  for (std::size_t n = 0; n < count; ++n) {
    scans.push_back(std::make_shared<const PolarScan>(made_scan(n, columns)));
  }
  return scans;
}

}  // namespace striper::testing
