// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <striper/guidance/guidance_config.hpp>

namespace striper::detail {

/// What the beams' zeros and scales, and the output's zero, not being known exactly does to the
/// lateral position at the gun. It is common to all of a job and never averages down.
///
/// A constant error of one beam comes through the path filter by a share that is found by running
/// the filter on it, straight ahead; of beams that are `old-only` the filter is run without them,
/// too, and the worse of the two counts. No allocation after construction.
class AlignmentSigma {
 public:
  /// Nothing is known of the truck's alignment where the config has no covariance: sigma is 0.
  explicit AlignmentSigma(const GuidanceConfig& config);

  /// @param beam_lateral_m where the line is in each beam's window: what its scale multiplies
  double at(std::span<const double> beam_lateral_m) const noexcept;

 private:
  Eigen::MatrixXd covariance_;
  double offset_variance_ = 0.0;
  std::vector<std::vector<double>> shares_;  // Of each beam, with and without the old-only ones.
};

}  // namespace striper::detail
