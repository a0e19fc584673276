// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/scan/polar_scan.hpp>

namespace striper::program {

/// What a flat target has to be.
struct FlatCriteria {
  double least_fill = 0.9;           ///< Least part of the scan lines with a return.
  double most_ratio = 2.0;           ///< Most scatter, in predicted sigmas.
  std::optional<double> distance_m;  ///< From the scan origin, square to it, where it is known.
};

/// A flat target over scans: each scan's good returns beside one straight line in 1/range, where a
/// line is linear and the noise Gaussian.
class FlatTarget {
 public:
  void add(const PolarScan& scan);

  /// Of the line, one a scan that has one.
  const std::vector<double>& distances_m() const noexcept { return distances_m_; }
  double mean_distance_m() const;

  /// What is not as it has to be, a phrase each; none where all is.
  std::vector<std::string> failures(const FlatCriteria& criteria) const;

  void say_result(const FlatCriteria& criteria) const;
  nlohmann::json to_json(const FlatCriteria& criteria) const;

 private:
  void say_bias(double bias_m) const;
  double fill() const { return lines_ > 0 ? static_cast<double>(good_) / lines_ : 0.0; }
  double flatness_m() const { return used_ > 0 ? std::sqrt(squares_m2_ / used_) : NAN; }
  double ratio() const { return used_ > 0 ? std::sqrt(squares_sigmas_ / used_) : NAN; }
  double temporal_px() const { return changes_ > 0 ? change_px_ / changes_ : NAN; }
  void compare_with_last(const PolarScan& scan);

  int scans_ = 0;
  long lines_ = 0;
  long good_ = 0;
  long used_ = 0;
  long changes_ = 0;
  double squares_m2_ = 0.0;
  double squares_sigmas_ = 0.0;
  double change_px_ = 0.0;
  double sigma_cal_m_ = NAN;
  std::vector<double> distances_m_;
  std::map<std::pair<int, int>, std::vector<double>> last_px_;  // By laser and field.
};

}  // namespace striper::program
