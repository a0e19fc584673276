// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include <striper/detect/curb_finding.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/model/striper_model.hpp>

#include "detect/curb/curb_lines.hpp"

namespace striper::detail {

/// What the calibration's error does to a curb's place and height.
///
/// For each independent way in which the calibration may be wrong (CalibrationModes) there is a
/// striper that is wrong so by one sigma. What it would have seen of road, face and top is fitted
/// by lines again, as the returns are: equally weighted in 1/range. About 60 us a curb and no
/// allocation; making it costs a millisecond.
class CurbCalibration {
 public:
  /// Precondition: the model has a covariance and the laser.
  /// @param pivot_m as SegmentOptions::pivot_m.
  CurbCalibration(const StriperModel& model, int laser, const Eigen::Vector2d& pivot_m);

  /// Fills in the sigma_cal of a finding; leaves one without vertices (a verge) as it is.
  void judge(CurbFinding& finding) const noexcept;

 private:
  struct Figures {
    double lateral_m, height_m;
  };
  Figures figures(const CurbFinding& finding, const Triangulator& wrong) const noexcept;
  ScanLine line(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m,
                const Triangulator& wrong) const noexcept;
  Eigen::Vector2d moved(const Eigen::Vector2d& at_m, const Triangulator& wrong) const noexcept;

  Triangulator right_;
  std::vector<Triangulator> wrong_;
  Eigen::Vector2d pivot_m_;
};

}  // namespace striper::detail
