// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace striper::detail {

/// What was seen of a straight line at one place along a drive: y = aside + turn * x.
struct LinePlace {
  struct Sight {
    std::size_t beam = 0;
    double seen_m = 0.0;  ///< By a beam whose zero is 0 and whose scale is 1.
    double sigma_m = 0.0;
  };
  struct Tape {
    double x_m = 0.0;
    double lateral_m = 0.0;
    double sigma_m = 0.0;
  };
  std::vector<Sight> sights;
  std::vector<Tape> tapes;
};

/// Zeros and scales of all beams: seen = (aside + turn x - zero) / scale + noise.
struct AlignmentFit {
  Eigen::VectorXd zeros_scales;  ///< zero 0, scale 0, zero 1, ...
  Eigen::MatrixXd covariance;
  double line_factor = 1.0;  ///< Residuals of sights over their sigma, at places without a tape.
  double line_rms_m = 0.0;
  double tape_rms = 0.0;  ///< Residuals at places with a tape over what they have of freedom.
};

/// Least squares by Gauss and Newton; each place's own two unknowns are eliminated. What the places
/// do not determine keeps a sigma of 0.1 m and of a tenth: nobody mounts a beam worse.
AlignmentFit fit_alignment(const std::vector<double>& beam_x_m,
                           const std::vector<LinePlace>& places);

}  // namespace striper::detail
