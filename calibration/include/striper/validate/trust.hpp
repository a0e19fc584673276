// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include <striper/adjust/solve_joint.hpp>
#include <striper/board/observations.hpp>
#include <striper/core/event.hpp>
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
  double least_coverage = 0.20;      ///< Of the image, by the stripe, along and across.
  double low_coverage = 0.50;
  double high_corner_rms_px = 0.5;  ///< Per 640 pixels of image width.
  double most_stripe_rms_px = 3.0;  ///< The same of the stripes' misfit to their planes.
  double bent_alike = 0.4;          ///< Correlation of neighbouring corners' errors, beyond that.
  double high_bend = 0.002;         ///< Of the board's half extent.
  double least_rcond = 1e-12;       ///< Reciprocal condition of the adjustment.
  double least_depth_m = 0.05;      ///< Of the middle board: a square given in another unit.
  double most_depth_m = 30.0;
  int fewest_stripes = 3;  ///< Images with a laser's stripe; a warning from two on.
};

/// A check of a calibration. What is a finding, and how bad, stands here and is read from
/// here; `check_trust` computes the figures. calibration/checks.md lists them.
struct TrustCheck {
  EventCode code;
  Severity severity;          ///< As a rule: what the images are not the cause of is milder.
  std::string_view computed;  ///< The figure, in words.
  std::string_view beyond;    ///< `below` or `above`: on which side of the limit it is a finding.
  double (*limit)(const TrustLimits& limits);  ///< Null: there is none.
  std::string_view unit;
  std::string_view advice;  ///< Empty where it depends on the images.
};

/// All of them, in the order in which they are made.
std::span<const TrustCheck> trust_checks() noexcept;

/// Looks for what makes a set of images weak or degenerate and says which image would help:
/// too few views, parallel boards, coincident planes, a stripe in a corner only, a focal length or
/// range that stays uncertain, a bent board, a large residual.
///
/// What is refused is a set that cannot determine the model: whether it can is judged with the
/// covariance as the images' geometry gives it, before it was widened by `covariance_factor` for
/// a misfit. A misfit alone is a warning, with the widened error.
std::vector<Event> check_trust(const Observations& observations, const JointSolution& solution,
                               const JointOptions& options, const StriperModel& model,
                               double covariance_factor = 1.0, const TrustLimits& limits = {});

}  // namespace striper
