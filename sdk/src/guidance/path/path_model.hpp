// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "guidance/path/wear_places.hpp"
#include "track/kalman.hpp"

namespace striper::detail {

/// How smoothly truck and road run, over the root of a metre, squared: by how much change the
/// curvature of the stripe less that of the vehicle's way (1 / m^3), the stripe's own beside what
/// its twist makes of it (1 / m^3), and that twist, curvature's change a metre (1 / m^5).
struct Smoothness {
  double steering = 0.0;
  double bend = 0.0;
  double twist = 0.0;
  double start_1_m = 0.0;  ///< Curvature of the stripe that it may begin with, one sigma.
};

/// One filter of the stripe's path: a Gaussian of lateral position, heading, curvature, steering
/// (curvature of the stripe less that of the vehicle's way) and twist, y = lateral + heading x +
/// curvature x^2 / 2 + twist x^3 / 6, and of the wear at some places (`WearPlaces`).
///
/// Before a bend of 50 ft that begins within 8 m the foremost beam sees it .8 in further off than
/// any parabola has it: without a twist of its own the path is wrong by that. No allocation.
class PathModel {
 public:
  static constexpr int kPathStates = 5;
  static constexpr int kMostStates =
      kPathStates + static_cast<int>(WearPlaces::kMostBeams + WearPlaces::kMostCopies);
  using State = KalmanState<Eigen::Dynamic, kMostStates>;
  using Vector = State::Vector;
  /// Of a function of the path alone: weights of its states.
  using PathVector = Eigen::Matrix<double, kPathStates, 1>;

  /// Weights of the lateral position at a place before the vehicle.
  static PathVector lateral_at(double x_m) noexcept;
  /// Of that at x = 0 after so much way.
  static PathVector lateral_after(double way_m) noexcept;

  void begin(int wear_states, double wear_variance, const Smoothness& smoothness) noexcept;
  void advance(double way_m, const Smoothness& smoothness) noexcept;
  /// Wear state `wear` is from now on that of another place.
  void move_wear(int wear, const WearPlaces::Bridge& bridge, double wear_variance) noexcept;
  void copy_wear(int from, int to) noexcept;

  /// A measurement, and how all states covary with it.
  struct Look {
    Innovation innovation;
    Vector covariance;
  };
  /// Of what a beam sees at `x_m`, with the wear there.
  Look look(double x_m, int wear, double lateral_m, double variance) const noexcept;
  Look look(const PathVector& weights, double measured, double variance) const noexcept;
  void take(const Look& look) noexcept { state_.correct_by(look.covariance, look.innovation); }

  double mean(const PathVector& weights) const noexcept;
  double variance(const PathVector& weights) const noexcept;

 private:
  State state_;
};

}  // namespace striper::detail
