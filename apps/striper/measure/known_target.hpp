// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/model/striper_model.hpp>
#include <striper/profile/tools.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper::program {

/// A target of known size over scans: what is measured beside what is known.
class KnownTarget {
 public:
  enum class Kind { kStep, kCylinder };

  /// @param known_m  the step's height, or the cylinder's radius.
  KnownTarget(Kind kind, double known_m, std::shared_ptr<const StriperModel> model);

  void add(const PolarScan& scan);

  /// What is not as it has to be, a phrase each: found in too few scans, and why; beyond three
  /// sigmas of what is known. None where all is.
  std::vector<std::string> failures() const;

  /// For people, expanded by k = 2.
  std::string line() const;
  nlohmann::json to_json() const;

 private:
  std::string name() const { return kind_ == Kind::kStep ? "step" : "cylinder"; }
  int count() const;
  double mean_m() const;
  double sigma_m() const;

  Kind kind_;
  double known_m_;
  Measurer measurer_;
  int scans_ = 0;
  std::map<MeasureStatus, int> status_;  // Scans of each.
  double sum_m_ = 0.0;
  double variance_m2_ = 0.0;
  double sigma_cal_m_ = 0.0;
};

}  // namespace striper::program
