// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include <striper/scan/polar_scan.hpp>

namespace striper {

/// Hands out scans that come back by themselves once nobody holds them, with the memory of their
/// returns: as many are made as are held at one time, and after that nothing is allocated.
///
/// Thread-safe; scans may outlive the pool.
class ScanPool {
 public:
  ScanPool();

  /// A scan with whatever it last held.
  std::shared_ptr<PolarScan> take();

  /// How many scans there are, held or not.
  std::size_t size() const;

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace striper
