// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <striper/adjust/solve_joint.hpp>
#include <striper/board/observations.hpp>

namespace striper {

/// What the data alone say about how well the model is known.
struct CrossValidation {
  /// Split-half: the model is solved from one half of the views and from the other, and the
  /// difference is held against the sum of the covariances: chi-square with `dof` if the covariance
  /// is right. Mean over `splits` random splits; 0 where there were too few views.
  int splits = 0;
  double nees = 0.0;
  double dof = 0.0;
  double nees_low = 0.0;  ///< 95 % band of one split.
  double nees_high = 0.0;
  /// What the covariance was multiplied by for it: 1, or more where the halves disagree beyond it.
  double covariance_factor = 1.0;

  /// Per view, from the others (all of them up to 20 views, else in 20 groups): rms of its corners
  /// with the pose solved, and of its stripes. NaN where it could not be had.
  std::vector<double> held_out_corner_px;
  std::vector<double> held_out_stripe_px;  ///< Per stripe view.

  double corner_rms_px() const;  ///< Over all held-out views.
  double stripe_rms_px() const;
};

/// Cross-validates a solution. @param options those that it was solved with.
/// Cost: at most 32 warm adjustments, on `threads`.
CrossValidation cross_validate(const Observations& observations, const JointSolution& solution,
                               const JointOptions& options, int threads);

}  // namespace striper
