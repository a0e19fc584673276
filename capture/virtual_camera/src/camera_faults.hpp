// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <set>
#include <string>

namespace striper::detail {

/// How a virtual camera of the tests differs from one that is in order. `Device` has the faults
/// that come and go while it runs.
struct CameraFaults {
  std::set<std::string> lacking;  ///< GenICam features that this model does not have.
  std::set<std::string> stuck;    ///< Features that take every value and keep what they have.
  std::int64_t clock_offset_ns = 0;
  std::int64_t ptp_offset_ns = 0;  ///< Of the network's PTP time against this machine's UTC as TAI.
};

}  // namespace striper::detail
