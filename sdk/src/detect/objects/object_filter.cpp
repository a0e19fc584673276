// SPDX-License-Identifier: Apache-2.0
#include "detect/objects/object_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace striper::detail {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

// Another face is nearest where the normal turned by more than this and than it is unsure of.
constexpr double kOtherFace_rad = 0.35;
constexpr double kOtherFaceSigmas = 3.0;
// The ends are others where the width changed by more: something was hidden, or came together.
constexpr double kOtherWidth = 0.3;
// An innovation beyond so many sigma is a change of velocity: by chance in 5 % of scans.
constexpr double kManoeuvreSigmas = 2.0;
// Learning what the options do not say: how far back is looked, what is too much, how much of it is
// taken at once, how slowly it is forgotten, and what is so far out that it is an accident. Chosen
// on the recordings of objects_real_test.cpp with the default options: errors halved, pulls of 5
// now 1.5, and nothing learnt of what moves evenly.
constexpr double kShownWeight = 0.2;
constexpr double kTooMuchShown = 1.2;
constexpr double kLearnt = 0.3;
constexpr double kForget = 0.97;
constexpr double kMostShown = 3.0;

Matrix2d outer(const Vector2d& v) { return v * v.transpose(); }

}  // namespace

void ObjectFilter::start(const ObjectCluster& seen, const ObjectOptions& options) noexcept {
  const double speed = 0.5 * options.max_speed_m_s;
  kalman_.mean << seen.anchor_m, Vector2d::Zero();
  kalman_.covariance.setZero();
  kalman_.covariance.topLeftCorner<2, 2>() = seen.covariance();
  kalman_.covariance.bottomRightCorner<2, 2>() = speed * speed * Matrix2d::Identity();
  seen_ = seen;
  follows_ends_ = 0;
  max_acceleration_m_s2_ = options.max_acceleration_m_s2;
  learns_ = options.learns;
}

void ObjectFilter::predict(const OwnStep& own, const ObjectOptions& options) noexcept {
  const double dt = own.dt_s;
  dt_s_ = dt;
  Covariance advance = Covariance::Identity();
  advance.topRightCorner<2, 2>() = dt * Matrix2d::Identity();
  kalman_.mean = advance * kalman_.mean;
  kalman_.covariance = advance * kalman_.covariance * advance.transpose();
  const double a2 = options.acceleration_m_s2 * options.acceleration_m_s2 + acceleration_variance_;
  const Matrix2d unit = Matrix2d::Identity();
  kalman_.covariance.topLeftCorner<2, 2>() += 0.25 * a2 * dt * dt * dt * dt * unit;
  kalman_.covariance.topRightCorner<2, 2>() += 0.5 * a2 * dt * dt * dt * unit;
  kalman_.covariance.bottomLeftCorner<2, 2>() += 0.5 * a2 * dt * dt * dt * unit;
  kalman_.covariance.bottomRightCorner<2, 2>() += a2 * dt * dt * unit;
  if (!own.is_known) return;

  const Matrix2d back = Eigen::Rotation2Dd(-own.turn_rad).toRotationMatrix();
  Covariance turn = Covariance::Zero();
  turn.topLeftCorner<2, 2>() = back;
  turn.bottomRightCorner<2, 2>() = back;
  kalman_.mean.head<2>() -= own.shift_m;
  kalman_.mean = turn * kalman_.mean;
  kalman_.covariance = turn * kalman_.covariance * turn.transpose();
  const Vector2d across(-kalman_.mean[1], kalman_.mean[0]);
  kalman_.covariance.topLeftCorner<2, 2>() +=
      back * own.shift_covariance * back.transpose() + own.turn_variance * outer(across);
  seen_.normal = back * seen_.normal;
  seen_.closest_m = back * (seen_.closest_m - own.shift_m);
  seen_.anchor_m = back * (seen_.anchor_m - own.shift_m);
}

ObjectFilter::Feature ObjectFilter::feature_of(const ObjectCluster& seen) const noexcept {
  const double turn = std::acos(std::clamp(seen.normal.dot(seen_.normal), -1.0, 1.0));
  const double sigma = std::hypot(seen.sigma_normal_rad, seen_.sigma_normal_rad);
  if (turn > std::max(kOtherFace_rad, kOtherFaceSigmas * sigma)) return Feature::kOther;
  const double wider = std::abs(seen.width_m - seen_.width_m);
  const bool is_width_same =
      wider < kOtherWidth * std::max(seen.width_m, seen_.width_m) +
                  6.0 * std::sqrt(seen.tangent_variance + seen_.tangent_variance);
  return seen.are_ends_seen && seen_.are_ends_seen && is_width_same ? Feature::kSame
                                                                    : Feature::kSameFace;
}

double ObjectFilter::distance2(const ObjectCluster& seen, double& spread) const noexcept {
  Matrix2d expected = kalman_.covariance.topLeftCorner<2, 2>() + seen.covariance();
  const Feature feature = feature_of(seen);
  const double width = std::max(seen.width_m, seen_.width_m);
  const double place_variance = width * width / 12.0;
  // What followed the middle of one face may now have that of a face that is turned to it.
  const double turned = std::min(1.0, (seen.normal - seen_.normal).norm());
  expected += place_variance * turned * turned * outer(seen.normal);
  if (feature != Feature::kSame) expected += place_variance * outer(seen.tangent());
  // What `explain` may have to explain.
  const double push = 0.5 * max_acceleration_m_s2_ * dt_s_ * dt_s_;
  expected += push * push * Matrix2d::Identity();
  const Vector2d off = seen.anchor_m - place();
  spread = std::log(expected.determinant());
  return off.dot(expected.inverse() * off);
}

void ObjectFilter::update(const ObjectCluster& seen) noexcept {
  const Feature feature = feature_of(seen);
  const Vector2d normal = seen.normal;
  const Vector2d tangent = seen.tangent();
  const double off = normal.dot(seen.anchor_m - place());
  const double variance = seen.normal_variance + shape_variance_;
  if (feature == Feature::kOther) {
    anchor_along(normal, off, variance);
  } else {
    learn(off, normal.dot(kalman_.covariance.topLeftCorner<2, 2>() * normal) + variance);
    update_along(normal, off, seen.normal_variance + shape_variance_);  // With what was learnt.
  }
  const double along = tangent.dot(seen.anchor_m - place());
  const double tangent_variance = seen.tangent_variance + shape_variance_;
  if (feature == Feature::kSame) {
    update_along(tangent, along, tangent_variance);
    ++follows_ends_;
  } else {
    anchor_along(tangent, along, tangent_variance);
    if (!seen.are_ends_seen) follows_ends_ = 0;
  }
  seen_ = seen;
}

// Innovations that are larger than expected again and again are of a face that is less straight, or
// of a velocity that changes more, than the options say: of the latter where they go on to one
// side.
void ObjectFilter::learn(double innovation, double expected) noexcept {
  const double now = std::clamp(innovation / std::sqrt(expected), -kMostShown, kMostShown);
  const double before = std::exchange(last_shown_, now);
  if (updates_++ < 2 || !learns_)
    return;  // The first one has no velocity, the second nothing before it.
  shown_ += kShownWeight * (now * now - shown_);
  shown_twice_ += kShownWeight * (now * before - shown_twice_);
  if (shown_ < 1.0) {
    acceleration_variance_ *= kForget;
    shape_variance_ *= kForget;
  }
  if (shown_ < kTooMuchShown || !(dt_s_ > 0.0)) return;
  const double excess = kLearnt * (shown_ - 1.0) * expected;
  const double lasting = std::clamp(shown_twice_ / shown_, 0.0, 1.0);
  const double way = 0.5 * dt_s_ * dt_s_;
  const double most = max_acceleration_m_s2_ * max_acceleration_m_s2_;
  acceleration_variance_ = std::min(acceleration_variance_ + lasting * excess / (way * way), most);
  shape_variance_ += (1.0 - lasting) * excess;
}

// Gives the velocity the freedom that an innovation asks for.
void ObjectFilter::explain(const Vector2d& axis, double innovation, double variance) noexcept {
  const double expected = axis.dot(kalman_.covariance.topLeftCorner<2, 2>() * axis) + variance;
  const double square = innovation * innovation;
  if (square <= kManoeuvreSigmas * kManoeuvreSigmas * expected || !(dt_s_ > 0.0)) return;
  const double way = 0.5 * dt_s_ * dt_s_;
  const double a2 =
      std::min((square - expected) / (way * way), max_acceleration_m_s2_ * max_acceleration_m_s2_);
  State push;
  push << way * axis, dt_s_ * axis;
  kalman_.covariance += a2 * push * push.transpose();
}

// A scalar update along one axis.
void ObjectFilter::update_along(const Vector2d& axis, double innovation, double variance) noexcept {
  explain(axis, innovation, variance);
  State h = State::Zero();
  h.head<2>() = axis;
  const Innovation seen{innovation, h.dot(kalman_.covariance * h) + variance};
  kalman_.correct(h, seen);
}

// What is tracked along this axis is something else from now on: its place says nothing about the
// velocity.
void ObjectFilter::anchor_along(const Vector2d& axis, double offset, double variance) noexcept {
  kalman_.mean.head<2>() += offset * axis;
  State h = State::Zero();
  h.head<2>() = axis;
  const Covariance without = Covariance::Identity() - h * h.transpose();
  kalman_.covariance =
      (without * kalman_.covariance * without + variance * h * h.transpose()).eval();
}

}  // namespace striper::detail
