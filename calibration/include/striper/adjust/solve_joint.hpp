// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <striper/board/observations.hpp>
#include <striper/intrinsics/known_camera.hpp>
#include <striper/model/camera_model.hpp>
#include <striper/model/laser_plane.hpp>

namespace striper {

struct JointSolution;

/// How `solve_joint` adjusts. Every default is here and nowhere else.
struct JointOptions {
  LensModel lens = LensModel::kPlumbBob;
  bool hold_k3 = false;     ///< Keeps k3 at 0 (plumb_bob only): the four-parameter lens.
  bool solve_bend = false;  ///< Adds the board's parabolic bend, common to all views.
  std::optional<KnownCamera> known_camera;

  /// One-sigma error of a corner's coordinate; empty: measured from the residuals.
  std::optional<double> corner_sigma_px;
  /// Trust the stripe's own sigmas; otherwise one factor common to all is measured.
  bool trust_stripe_sigma = false;

  /// A residual beyond this many sigmas is an outlier: removed, listed.
  double outlier_sigmas = 4.5;
  bool remove_outliers = true;

  /// Where to begin, with the views of the observations; null: from nothing. Saves most of the time
  /// when a view is left out of a solution. Not kept.
  const JointSolution* start = nullptr;

  int max_iterations = 60;
  int threads = 1;
};

/// One point that the adjustment took out.
struct OutlierPoint {
  int view = 0;  ///< Index of the CornerView, or of the StripeView where `is_stripe`.
  bool is_stripe = false;
  int index = 0;  ///< Of the point in the view.
  double residual_px = 0.0;
};

/// How well one class of residuals fits.
struct ResidualClass {
  double rms_px = 0.0;        ///< Corners: of the 2-D distance; stripes: across the stripe.
  double sigma_px = 0.0;      ///< One-sigma of a coordinate that the weights stand for (median).
  double sigma_factor = 1.0;  ///< What the given sigmas were multiplied by (1 where trusted).
  double chi2 = 0.0;          ///< Of the whitened residuals.
  double dof = 0.0;           ///< Their number less their share of the unknowns.
  double chi2_per_dof() const noexcept { return dof > 0.0 ? chi2 / dof : 0.0; }
};

/// What a joint adjustment found.
struct JointSolution {
  bool converged = false;
  std::string summary;  ///< The solver's own words.

  CameraModel camera;
  std::vector<LaserPlane> planes;              ///< One per laser.
  std::vector<Eigen::Isometry3d> T_cam_board;  ///< One per view.
  Eigen::Vector2d bend_m =
      Eigen::Vector2d::Zero();  ///< Height of the middle over the ends, x and y.

  /// Of (camera parameters, then nx, ny, nz, d of each plane); a plane's 4x4 block has rank 3.
  /// Empty where the observations do not determine everything: see `weakest`.
  Eigen::MatrixXd covariance;
  /// The part of it that comes from the error of a given camera, of which no residual can tell;
  /// empty: no camera with a known error was given.
  Eigen::MatrixXd from_known_camera;
  Eigen::Matrix2d bend_covariance = Eigen::Matrix2d::Zero();

  /// Reciprocal condition of the scaled normal matrix of camera, bend and planes once the poses are
  /// eliminated, 0 to 1. Below ~1e-8 a direction of it is free.
  double rcond = 0.0;
  /// The names and weights of the least determined direction, largest first; empty where the
  /// adjustment ran away so far that its derivatives are no numbers.
  std::vector<std::pair<std::string, double>> weakest;

  ResidualClass corners;
  ResidualClass stripes;
  std::vector<OutlierPoint> outliers;

  /// Residuals in pixels, per view and point, NaN for the outliers: observed minus predicted.
  std::vector<std::vector<Eigen::Vector2d>> corner_residual_px;
  /// Distance along the scan line from the predicted stripe, per stripe view and point, NaN for
  /// the outliers.
  std::vector<std::vector<double>> stripe_residual_px;

  int unknowns = 0;

  /// rms of the corners of one view, px.
  double view_rms_px(std::size_t view) const;
  double stripe_rms_px(std::size_t stripe) const;
};

/// Adjusts camera, board poses and laser planes together (bundle adjustment by Levenberg-Marquardt,
/// poses eliminated by the Schur complement), with outliers found by a robust loss, removed, and
/// the rest adjusted by least squares.
///
/// Residuals, both in pixels over sigma: a corner against its projection, and a stripe pixel
/// against where the line in which laser plane and board meet crosses the pixel's column
/// (kColumns) or row. Unknown of a plane is w = n / d (w . p = 1), three numbers.
/// @throws Error{kBadValue} where the observations are not valid; Error{kUntrustworthy} where there
/// are too few to begin (fewer than two views, or a laser without a stripe), or no start is found.
/// Cost: an adjustment by Ceres (calibration_bench times that of the corners beside OpenCV's).
/// Allocates. Thread-safe.
JointSolution solve_joint(const Observations& observations, const JointOptions& options);

/// The poses of the boards alone, camera given: what cross-validation does with a held-out view.
/// @param corner_rms_px receives the rms of the 2-D distances, outliers included.
Eigen::Isometry3d solve_pose(const CameraModel& camera, const Board& board, const CornerView& view,
                             const Eigen::Vector2d& bend_m, double* corner_rms_px);

/// rms distance of a stripe from where camera, pose and plane put it, px along the scan line:
/// what cross-validation asks of a held-out view. NaN without a point.
double stripe_rms_px(const Observations& observations, const StripeView& stripe,
                     const CameraModel& camera, const Eigen::Isometry3d& T_cam_board,
                     const LaserPlane& plane, const Eigen::Vector2d& bend_m);

/// The stripe points that a laser's plane was fitted to, in the camera frame: where each pixel's
/// ray meets its board. Outliers are left out.
std::vector<Eigen::Vector3d> stripe_points_cam(const Observations& observations,
                                               const JointSolution& solution, int laser);

/// The names of the covariance's rows for a camera and `planes` lasers, as in the model file.
std::vector<std::string> covariance_names(const CameraModel& camera, std::size_t planes);

}  // namespace striper
