// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include <striper/model/striper_model.hpp>
#include <striper/scan/polar_scan.hpp>

namespace striper::program {

/// What data sheets of laser profilers say of a model alone.
struct MeasuringRange {
  double clearance_m;   ///< Nearest range on the middle scan line.
  double far_m;         ///< Farthest where half a pixel to either side is at most a tenth of it.
  double width_near_m;  ///< Across the image at the nearest,
  double width_far_m;   ///< and at the farthest.
};

/// @throws as Triangulator.
MeasuringRange measuring_range(const StriperModel& model, int laser);

/// A known distance and what was measured.
struct KnownDistance {
  double known_m;
  double measured_m;
};

/// How far measured distances are off the best straight line through them.
struct Linearity {
  double most_m = 0.0;    ///< The largest residual.
  double gain = 1.0;      ///< Measured metres per metre.
  double offset_m = 0.0;  ///< Where the known distance is 0.
};
Linearity linearity(const std::vector<KnownDistance>& distances);

/// The figures of a still target, over scans.
class VerifySheet {
 public:
  void add(const PolarScan& scan);
  /// What it took to make scans of a frame.
  void took(double seconds) { seconds_.push_back(seconds); }

  /// Names and figures, coverage factor 1, with the number of values behind each; what is not known
  /// is null. @param distances_m  of the flat target, one a scan.
  nlohmann::json to_json(const MeasuringRange& range, double rate_hz,
                         const std::vector<double>& distances_m) const;

 private:
  struct Place {
    int count = 0;
    double first = 0.0, sum = 0.0, squares = 0.0;
  };
  std::vector<double> deviations_m() const;

  std::vector<Place> places_;
  std::vector<double> spacings_m_;
  std::vector<double> seconds_;
};

/// A line for people for each figure of such a sheet, expanded by k = 2 where it is an error.
std::vector<std::string> sheet_lines(const nlohmann::json& sheet);

}  // namespace striper::program
