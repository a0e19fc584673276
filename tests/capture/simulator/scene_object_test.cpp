// SPDX-License-Identifier: Apache-2.0
// Proves how objects are turned and how they move, against laws of rotations and motion stepped
// in small pieces. Where their surfaces are is proved with the truth.
#include <numbers>

#include <gtest/gtest.h>

#include <striper/simulator/scene_object.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kQuarter = 0.5 * std::numbers::pi;

Vector3d random_vector(double size) {
  return {testing::uniform(-size, size), testing::uniform(-size, size),
          testing::uniform(-size, size)};
}

void expect_rotation(const Matrix3d& R) {
  EXPECT_TRUE((R.transpose() * R).isIdentity(1e-12)) << R;
  EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
}

// Flat shapes show their front along -x and have `up` along z.
TEST(Facing, TurnsTheFrontAlongTheNormalAsUprightAsItCanBe) {
  for (int trial = 0; trial < 100; ++trial) {
    const Vector3d normal = random_vector(3.0);
    const Matrix3d R = facing(normal);
    expect_rotation(R);
    EXPECT_TRUE((R * -Vector3d::UnitX()).isApprox(normal.normalized(), 1e-12));
    // No direction across the normal is nearer to the world's z.
    const Vector3d up = R * Vector3d::UnitZ();
    EXPECT_NEAR(up.z(), Vector3d::UnitZ().cross(normal.normalized()).norm(), 1e-12);
  }
}

TEST(Facing, OfAFloorOrACeilingHasUpAlongTheWorldsX) {
  for (const double z : {1.0, -1.0}) {
    const Matrix3d R = facing({0.0, 0.0, z});
    expect_rotation(R);
    EXPECT_TRUE((R * -Vector3d::UnitX()).isApprox(Vector3d(0.0, 0.0, z), 1e-12));
    EXPECT_TRUE((R * Vector3d::UnitZ()).isApprox(Vector3d(Vector3d::UnitX()), 1e-12));
  }
}

TEST(RotationFromRpy, TurnsAboutFixedAxesRollFirst) {
  // Roll takes y to z, pitch z to x, yaw x to y; in this order y goes all the way round.
  const Matrix3d all = rotation_from_rpy(kQuarter, kQuarter, kQuarter);
  EXPECT_TRUE((all * Vector3d::UnitY()).isApprox(Vector3d(Vector3d::UnitY()), 1e-12));
  EXPECT_TRUE((all * Vector3d::UnitX()).isApprox(Vector3d(-Vector3d::UnitZ()), 1e-12));
  for (int trial = 0; trial < 20; ++trial) {
    const Vector3d rpy = random_vector(3.0);
    const Matrix3d R = rotation_from_rpy(rpy.x(), rpy.y(), rpy.z());
    expect_rotation(R);
    EXPECT_TRUE(
        R.isApprox(rotation_from_rpy(0.0, 0.0, rpy.z()) * rotation_from_rpy(0.0, rpy.y(), 0.0) *
                       rotation_from_rpy(rpy.x(), 0.0, 0.0),
                   1e-12));
  }
}

// The naive way: many small steps, each along and about the world's axes.
TEST(SteadyMotion, IsWhatManySmallStepsMakeOfIt) {
  constexpr int kSteps = 100'000;
  constexpr double kTime_s = 1.7;
  SteadyMotion motion;
  motion.velocity_m_s = {3.0, -2.0, 0.5};
  motion.angular_velocity_rad_s = {0.4, -0.9, 1.3};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation_from_rpy(0.3, -0.2, 1.0);
  pose.translation() = Vector3d(1.0, 2.0, 3.0);

  const Vector3d turn = motion.angular_velocity_rad_s * (kTime_s / kSteps);
  const Matrix3d step = rotation_from_rpy(turn.x(), turn.y(), turn.z());
  Eigen::Isometry3d stepped = pose;
  for (int i = 0; i < kSteps; ++i) {
    stepped.linear() = step * stepped.linear();
    stepped.translation() += motion.velocity_m_s * (kTime_s / kSteps);
  }
  EXPECT_TRUE(motion.moved(pose, kTime_s).isApprox(stepped, 1e-4));
  EXPECT_TRUE(motion.moved(pose, 0.0).isApprox(pose, 0.0));
  EXPECT_TRUE(motion.moved(motion.moved(pose, kTime_s), -kTime_s).isApprox(pose, 1e-12));
  EXPECT_FALSE(motion.is_still());
}

TEST(SteadyMotion, WithoutAnyThePoseStaysToTheBit) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation_from_rpy(0.3, -0.2, 1.0);
  EXPECT_TRUE(SteadyMotion().is_still());
  EXPECT_EQ(SteadyMotion().moved(pose, 1e6).matrix(), pose.matrix());
}

}  // namespace
}  // namespace striper
