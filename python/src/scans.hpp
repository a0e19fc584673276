// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <striper/scan/polar_scan.hpp>

namespace striper::python {

/// How Python holds scans; it never changes one.
using SharedScan = std::shared_ptr<PolarScan>;

inline SharedScan shared_scan(std::shared_ptr<const PolarScan> scan) {
  return std::const_pointer_cast<PolarScan>(std::move(scan));
}

}  // namespace striper::python
