// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

namespace striper {

/// Limits outside which a range is reported as kOutOfRange.
struct ScanOptions {
  double min_range_m = 0.0;
  double max_range_m = std::numeric_limits<double>::infinity();

  /// @throws Error{kBadValue} unless 0 <= min_range_m < max_range_m.
  void validate() const;
};

}  // namespace striper
