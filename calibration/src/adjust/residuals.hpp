// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include <striper/adjust/solve_joint.hpp>
#include <striper/board/observations.hpp>

#include "adjust/joint_problem.hpp"

namespace striper::detail {

/// What a state leaves unexplained, in pixels, per view and point; NaN where it predicts nothing.
struct Residuals {
  std::vector<std::vector<Eigen::Vector2d>> corner_px;  ///< Projected minus observed.
  std::vector<std::vector<double>> stripe_px;           ///< Along the scan line.
};

Residuals compute_residuals(const Observations& observations, const JointState& state);

/// How many numbers take part, and how many unknowns they determine.
struct Counts {
  double corner_numbers = 0.0;
  double stripe_numbers = 0.0;
  double camera_unknowns = 0.0;  ///< Camera, bend and poses: the corners' share.
  double plane_unknowns = 0.0;
};

Counts count(const JointWeights& weights, const JointOptions& options, const JointState& state);

/// Measures the sigmas that are not given, by medians: outliers do not count.
void estimate_sigmas(const Observations& observations, const JointOptions& options,
                     const Residuals& residuals, JointWeights& weights);

/// Sharpens them with the degrees of freedom, once the outliers are out.
void refine_sigmas(const Observations& observations, const JointOptions& options,
                   const Residuals& residuals, const Counts& counts, JointWeights& weights);

/// Takes out every point beyond `outlier_sigmas`, and takes the others in again.
void reject_outliers(const Observations& observations, const JointOptions& options,
                     const Residuals& residuals, JointWeights& weights);

/// How well the corners, and the stripes, fit.
ResidualClass corner_class(const JointWeights& weights, const Residuals& residuals,
                           const Counts& counts);
ResidualClass stripe_class(const Observations& observations, const JointWeights& weights,
                           const Residuals& residuals, const Counts& counts);

}  // namespace striper::detail
