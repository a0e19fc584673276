// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <striper/guidance/guidance_config.hpp>
#include <striper/guidance/path_filter.hpp>
#include <striper/guidance/report_path.hpp>

#include "guidance/beam/stripe_choice.hpp"

namespace striper::detail {

/// The stripe at the gun, by the method that the file asks for.
class PathFollower {
 public:
  explicit PathFollower(const GuidanceConfig& config);

  /// Goes on to where the vehicle is.
  void advance(double distance_m) noexcept;
  /// Where a beam should see the followed line. @param since_m way from its look to here.
  ExpectedLine expected(std::size_t beam, double since_m) const noexcept;
  /// @return whether it is of the path.
  bool see(const StripeSight& sight) noexcept;
  void see_yaw_rate(double yaw_rate_rad_s, double sigma_rad_s, double speed_m_s) noexcept;
  /// Ends a scan: the report's methods answer once a scan.
  void end_scan() noexcept;

  struct Answer {
    double lateral_m = std::numeric_limits<double>::quiet_NaN();
    double sigma_m = std::numeric_limits<double>::quiet_NaN();
    double unseen_m = std::numeric_limits<double>::infinity();
  };
  Answer at_gun() const noexcept;
  double after(double way_m) const noexcept;  ///< When it has gone on: by the filter; else NaN.

 private:
  Answer simple_answer() const noexcept;

  GuidanceSmoothing smoothing_;
  GuidanceStripe stripe_;
  double gun_x_m_ = 0.0;
  double count_m_ = 1.0;  // Of the converter, for the integer smoothing.
  std::optional<PathFilter> filter_;
  std::optional<ReportPath> report_;
  std::vector<double> seen_m_;       // In this scan, of each beam; NaN: not.
  std::vector<double> last_seen_m_;  // Of each beam.
  double distance_m_ = std::numeric_limits<double>::quiet_NaN();
  double seen_at_m_ = std::numeric_limits<double>::quiet_NaN();
  double turn_seen_at_m_ = -std::numeric_limits<double>::infinity();
  double answer_m_ = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace striper::detail
