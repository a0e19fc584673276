// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace striper::detail {

/// A pixel about which a peak is measured.
struct PeakSeed {
  std::int32_t line;
  std::int32_t across;
};

}  // namespace striper::detail
