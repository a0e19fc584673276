// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <striper/core/event.hpp>
#include <striper/joint/observations.hpp>
#include <striper/joint/solve_joint.hpp>
#include <striper/model/striper_model.hpp>

namespace striper {

/// The bounds that a calibration is judged by. Every default is here and nowhere else.
struct TrustLimits {
  int fewest_views = 3;
  int few_views = 8;            ///< Below it, a warning.
  double least_tilt_deg = 5.0;  ///< rms of the board normals about their mean.
  double low_tilt_deg = 10.0;
  double most_focal_error = 0.010;  ///< sigma(f) / f.
  double high_focal_error = 0.004;
  double most_range_error = 0.010;  ///< sigma(range) / range at the stripe's middle depth.
  double high_range_error = 0.003;
  double least_plane_spread = 0.04;  ///< Of the stripe points in the plane: short over long axis.
  double least_coverage = 0.20;      ///< Of the picture, by the stripe, along and across.
  double low_coverage = 0.50;
  double high_corner_rms_px = 0.5;  ///< Per 640 pixels of picture width.
  double most_stripe_rms_px = 3.0;  ///< The same of the stripes' misfit to their planes.
  double bent_alike = 0.4;          ///< Correlation of neighbouring corners' errors, beyond that.
  double high_bend = 0.002;         ///< Of the board's half extent.
};

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

/// The predicted calibration error of a range.
struct RangeSigma {
  double range_m = 0.0;
  double sigma_m = 0.0;      ///< NaN where the range is not in the picture.
  Eigen::Vector2d pixel;     ///< Where it is seen, straight ahead or as near to that as there is.
  bool inside_data = false;  ///< Within the depths at which the stripe was seen on the boards.
};

/// The predicted calibration error over the picture, row by row.
struct RangeMap {
  int columns = 0;
  int rows = 0;
  std::vector<double> range_m;  ///< NaN where the ray does not meet the plane in front.
  std::vector<double> sigma_m;
};

/// Cross-validates a solution. @param options those that it was solved with.
/// Cost: at most 32 warm adjustments, on `threads`.
CrossValidation cross_validate(const Observations& observations, const JointSolution& solution,
                               const JointOptions& options, int threads);

/// The calibration error at some ranges. Precondition: the model has a covariance and the laser.
std::vector<RangeSigma> predict_range_sigma(const StriperModel& model, int laser,
                                            const std::vector<double>& ranges_m,
                                            double nearest_data_m, double farthest_data_m);
RangeMap range_map(const StriperModel& model, int laser, int columns, int rows);

/// Looks for what makes a set of pictures weak or degenerate and says which picture would help:
/// too few views, parallel boards, coincident planes, a stripe in a corner only, a focal length or
/// range that stays uncertain, a bent board, a large residual.
///
/// What is refused is a set that cannot determine the model: whether it can is judged with the
/// covariance as the pictures' geometry gives it, before it was widened by `covariance_factor` for
/// a misfit. A misfit alone is a warning, with the widened error.
std::vector<Event> check_trust(const Observations& observations, const JointSolution& solution,
                               const JointOptions& options, const StriperModel& model,
                               double covariance_factor = 1.0, const TrustLimits& limits = {});

}  // namespace striper
