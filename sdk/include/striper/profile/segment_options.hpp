// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include <striper/model/striper_model.hpp>

namespace striper {

/// How a scan is cut into pieces.
struct SegmentOptions {
  /// How often a scan of one straight line may be cut although there is nothing: a part of the
  /// scans, 1e-6 to .1. Sets the penalty of a piece.
  double false_split_rate = 1e-3;

  /// Whether a surface may be rougher than the error bars say; its texture is then estimated.
  bool estimate_texture = true;

  /// Whether pieces may be circular too: pipes, wheels, rounded edges. Straight pieces that one
  /// circle explains at less cost are then joined to it.
  bool find_circles = false;

  /// The point of the scan plane through which the noise moves every return, metres, scan frame:
  /// where the camera's own v axis (stripe axis columns) or u axis (rows) through its centre meets
  /// the plane (`noise_pivot`). The scan's origin, the default, is right for a camera that is not
  /// tilted against the plane, and for scanners that measure along their bearings.
  Eigen::Vector2d pivot_m{0.0, 0.0};

  /// @throws Error{kBadValue} naming the field, the value and what was expected.
  void validate() const;
};

/// Returns SegmentOptions::pivot_m of one laser of a model; the origin where the plane is parallel
/// to that axis.
/// @throws Error{kBadValue} where the model has no such laser.
Eigen::Vector2d noise_pivot(const StriperModel& model, int laser);

/// Returns `options` for one laser's scans; as they are where there is no model or no such laser.
SegmentOptions options_for(const StriperModel* model, int laser, SegmentOptions options = {});

/// Returns what a further piece has to gain in chi2, so that a scan of one straight line with
/// `points` returns is cut in `false_split_rate` of all cases. From simulation
/// (tests/sdk/profile/false_split_test.cpp).
double piece_penalty(double false_split_rate, std::size_t points);

}  // namespace striper
