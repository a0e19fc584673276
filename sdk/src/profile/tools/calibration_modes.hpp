// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <striper/geometry/triangulator.hpp>
#include <striper/scan/polar_scan.hpp>

#include "profile/inverse_ranges.hpp"

namespace striper::detail {

/// The independent ways in which a calibration may be wrong, by one sigma each: the columns of a
/// root of its covariance. Each moves all returns of a scan together.
class CalibrationModes {
 public:
  explicit CalibrationModes(const Triangulator& triangulator);

  std::size_t count() const noexcept { return static_cast<std::size_t>(root_.cols()); }

  /// One row per parameter, one column per mode: root * root' is the covariance.
  const Eigen::MatrixXd& root() const noexcept { return root_; }

  /// Learns how the returns move; false where they do not say at which pixel they were seen. About
  /// 2 us per element.
  bool take(const PolarScan& scan, const InverseRanges& ranges);

  /// `ranges` as they are if mode k is wrong by `sigmas`, in `moved`.
  void move(const InverseRanges& ranges, std::size_t k, double sigmas, InverseRanges& moved) const;

 private:
  const Triangulator triangulator_;
  Eigen::MatrixXd root_;
  std::vector<Eigen::Matrix2Xd> shifts_;  // Per element: a column of metres per mode.
};

}  // namespace striper::detail
