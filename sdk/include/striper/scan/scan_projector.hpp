// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include <striper/model/striper_model.hpp>
#include <striper/scan/polar_scan.hpp>
#include <striper/scan/scan_options.hpp>
#include <striper/stripe/stripe.hpp>

namespace striper {

/// Turns stripes into polar scans: bearing, range, its error bars and, without a return, the
/// reason.
///
/// The constructor makes tables for the lens of the whole sensor and for the calibration's error;
/// one for another image grid is made when that is first seen. After that no allocation, at most 30
/// ns per return (scan_bench). Not thread-safe.
class ScanProjector {
 public:
  /// @throws Error{kBadValue} where the model has no laser or the options are not valid.
  ScanProjector(const StriperModel& model, const ScanOptions& options);

  /// Without a model: only what the image gives, metric values NaN.
  ScanProjector();

  ScanProjector(ScanProjector&&) noexcept;
  ScanProjector& operator=(ScanProjector&&) noexcept;
  ~ScanProjector();

  /// Fills `scan.returns`, `scan.axis`, one return per element of `stripe`. `laser` picks the
  /// plane. A laser that the model lacks gives kOutsideModel for every return.
  void project(const Stripe& stripe, int laser, PolarScan& scan);

 private:
  struct LaserTables;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace striper
