// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include <striper/detect/objects.hpp>

#include "detect/objects/object_clusters.hpp"
#include "track/kalman.hpp"

namespace striper::detail {

/// How the scan frame moved from one scan to the next, in the earlier frame.
struct OwnStep {
  bool is_known = false;
  double dt_s = 0.0;
  Eigen::Vector2d shift_m{0.0, 0.0};
  double turn_rad = 0.0;
  Eigen::Matrix2d shift_covariance = Eigen::Matrix2d::Zero();
  double turn_variance = 0.0;
  Eigen::Vector2d velocity_m_s{0.0, 0.0};  ///< Of the scan's origin, in the later frame.
  Eigen::Vector2d sigma_velocity_m_s{0.0, 0.0};
};

/// A constant-velocity Kalman filter of one object: place of the anchor and velocity over ground
/// (relative where there is no motion), in the frame of the latest scan.
class ObjectFilter {
 public:
  using State = Eigen::Matrix<double, 4, 1>;
  using Covariance = Eigen::Matrix4d;

  void start(const ObjectCluster& seen, const ObjectOptions& options) noexcept;
  /// Foretells the state at the next scan, in its frame.
  void predict(const OwnStep& own, const ObjectOptions& options) noexcept;
  /// Chi-square, 2 degrees of freedom, of this being the object; `spread` gets the log of the
  /// determinant of what was expected.
  double distance2(const ObjectCluster& seen, double& spread) const noexcept;
  void update(const ObjectCluster& seen) noexcept;

  const State& state() const noexcept { return kalman_.mean; }
  const Covariance& covariance() const noexcept { return kalman_.covariance; }
  Eigen::Vector2d place() const noexcept { return kalman_.mean.head<2>(); }
  Eigen::Vector2d velocity() const noexcept { return kalman_.mean.tail<2>(); }
  const ObjectCluster& seen() const noexcept { return seen_; }
  /// Whether motion along the face was observed since the feature was last another.
  bool is_fully_observed() const noexcept { return follows_ends_ > 0; }

 private:
  enum class Feature { kSame, kSameFace, kOther };
  Feature feature_of(const ObjectCluster& seen) const noexcept;
  void learn(double innovation, double expected) noexcept;
  void explain(const Eigen::Vector2d& axis, double innovation, double variance) noexcept;
  void update_along(const Eigen::Vector2d& axis, double innovation, double variance) noexcept;
  void anchor_along(const Eigen::Vector2d& axis, double offset, double variance) noexcept;

  KalmanState<4> kalman_{State::Zero(), Covariance::Zero()};
  double dt_s_ = 0.0;
  // What the innovations showed: fading means of their squares over what was expected, and of the
  // products of two in a row; and what was learnt from them.
  int updates_ = 0;
  double last_shown_ = 0.0;
  double shown_ = 1.0;
  double shown_twice_ = 0.0;
  double shape_variance_ = 0.0;
  double acceleration_variance_ = 0.0;
  double max_acceleration_m_s2_ = 0.0;
  bool learns_ = false;
  ObjectCluster seen_;  // As last seen, moved into the latest frame.
  int follows_ends_ = 0;
};

}  // namespace striper::detail
