// SPDX-License-Identifier: Apache-2.0
#include "guidance/path/path_model.hpp"

#include <cmath>

namespace striper::detail {
namespace {

enum PathState : int { kLateral, kHeading, kCurvature, kSteering, kTwist };

// Where it begins: a metre off, 6 degrees, turning by 1 / 100 m beside the stripe.
constexpr double kStartLateral_m = 1.0;
constexpr double kStartHeading_rad = 0.1;
constexpr double kStartSteering_1_m = 0.01;
// A road is twisted over the length of a transition between straight and bend: 10 to 30 m. With 10
// errors in a bend of 50 ft within 8 m are .06 in (RoadRunBends).
constexpr double kTwistLength_m = 10.0;

constexpr int kWear = PathModel::kPathStates;  // The first of them.

// The covariance of what white noise of the steering makes of steering, heading and lateral
// position over a way: its integral, and the integral of that.
void add_steering(PathModel::State::Matrix& p, double s, double noise) noexcept {
  const double s2 = s * s;
  const double s3 = s2 * s;
  p(kLateral, kLateral) += noise * s2 * s3 / 20.0;
  p(kHeading, kHeading) += noise * s3 / 3.0;
  p(kSteering, kSteering) += noise * s;
  const auto add = [&](int i, int j, double value) {
    p(i, j) += value;
    p(j, i) += value;
  };
  add(kLateral, kHeading, noise * s2 * s2 / 8.0);
  add(kLateral, kSteering, noise * s3 / 6.0);
  add(kHeading, kSteering, noise * s2 / 2.0);
}

}  // namespace

PathModel::PathVector PathModel::lateral_at(double x_m) noexcept {
  PathVector weights;
  weights << 1.0, x_m, x_m * x_m / 2.0, 0.0, x_m * x_m * x_m / 6.0;
  return weights;
}

PathModel::PathVector PathModel::lateral_after(double way_m) noexcept {
  PathVector weights;
  weights << 1.0, way_m, 0.0, way_m * way_m / 2.0, 0.0;
  return weights;
}

void PathModel::begin(int wear_states, double wear_variance,
                      const Smoothness& smoothness) noexcept {
  const int states = kPathStates + wear_states;
  state_.mean = Vector::Zero(states);
  state_.covariance = State::Matrix::Zero(states, states);
  state_.covariance.diagonal().setConstant(wear_variance);
  const double start_1_m = smoothness.start_1_m;
  state_.covariance.diagonal().head<kPathStates>() << kStartLateral_m * kStartLateral_m,
      kStartHeading_rad * kStartHeading_rad, start_1_m * start_1_m,
      kStartSteering_1_m * kStartSteering_1_m, 0.0;
}

void PathModel::advance(double s, const Smoothness& smoothness) noexcept {
  Vector& mean = state_.mean;
  State::Matrix& p = state_.covariance;
  // Lateral position and heading take what the steering adds, curvature what the twist does; the
  // order is that in which none is changed before it is used.
  const auto add = [&](int to, int from, double share) {
    mean[to] += share * mean[from];
    p.row(to) += share * p.row(from);
    p.col(to) += share * p.col(from);
  };
  add(kLateral, kHeading, s);
  add(kLateral, kSteering, 0.5 * s * s);
  add(kHeading, kSteering, s);
  add(kCurvature, kTwist, s);
  const double stays = std::exp(-s / kTwistLength_m);
  mean[kTwist] *= stays;
  p.row(kTwist) *= stays;
  p.col(kTwist) *= stays;
  add_steering(p, s, smoothness.steering);
  p(kCurvature, kCurvature) += smoothness.bend * s;
  p(kTwist, kTwist) += smoothness.twist * s;
}

void PathModel::move_wear(int wear, const WearPlaces::Bridge& bridge,
                          double wear_variance) noexcept {
  State::Matrix& p = state_.covariance;
  const int own = kWear + wear;
  const int before = kWear + bridge.before;
  const int after = kWear + bridge.after;
  const auto mixed = [&](double at_before, double at_after) {
    return bridge.before_weight * at_before + bridge.after_weight * at_after;
  };
  const Vector row = bridge.before_weight * p.col(before) + bridge.after_weight * p.col(after);
  state_.mean[own] = mixed(state_.mean[before], state_.mean[after]);
  p.col(own) = row;
  p.row(own) = row.transpose();
  p(own, own) = mixed(row[before], row[after]) + bridge.unknown * wear_variance;
}

void PathModel::copy_wear(int from, int to) noexcept {
  State::Matrix& p = state_.covariance;
  const Vector row = p.col(kWear + from);
  state_.mean[kWear + to] = state_.mean[kWear + from];
  p.col(kWear + to) = row;
  p.row(kWear + to) = row.transpose();
  p(kWear + to, kWear + to) = row[kWear + from];
}

PathModel::Look PathModel::look(const PathVector& weights, double measured,
                                double variance) const noexcept {
  Look look;
  look.covariance = state_.covariance.leftCols<kPathStates>() * weights;
  look.innovation = {measured - mean(weights),
                     look.covariance.head<kPathStates>().dot(weights) + variance};
  return look;
}

PathModel::Look PathModel::look(double x_m, int wear, double lateral_m,
                                double variance) const noexcept {
  const int own = kWear + wear;
  Look sight = look(lateral_at(x_m), lateral_m - state_.mean[own], variance);
  // The sum of path and wear covaries with each as they do with one another.
  sight.innovation.variance += 2.0 * sight.covariance[own] + state_.covariance(own, own);
  sight.covariance += state_.covariance.col(own);
  return sight;
}

double PathModel::mean(const PathVector& weights) const noexcept {
  return weights.dot(state_.mean.head<kPathStates>());
}

double PathModel::variance(const PathVector& weights) const noexcept {
  return weights.dot(state_.covariance.topLeftCorner<kPathStates, kPathStates>() * weights);
}

}  // namespace striper::detail
