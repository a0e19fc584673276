// SPDX-License-Identifier: Apache-2.0
// Proves that the scan frame is the one that CONVENTIONS.md describes, for both stripe axes, and
// that the homography is the intersection of ray and plane written in that frame, the paper's
// d = s cot(alpha) included. It does not prove that anything downstream uses them rightly.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/model/laser_plane.hpp>

#include "support/random.hpp"

namespace striper {
namespace {

using testing::uniform;

LaserPlane random_plane() {
  Eigen::Vector3d n(uniform(-1, 1), uniform(-1, 1), uniform(-0.8, 0.8));
  return {n.normalized(), uniform(0.01, 3.0)};
}

TEST(LaserPlane, TurnsTheNormalSoThatTheDistanceIsPositive) {
  const LaserPlane plane({0.0, -1.0, 0.0}, -0.5);
  EXPECT_EQ(plane.normal(), Eigen::Vector3d(0.0, 1.0, 0.0));
  EXPECT_EQ(plane.distance_m(), 0.5);
  EXPECT_EQ(plane.signed_distance_m({0.0, 0.75, 3.0}), 0.25);
  EXPECT_FALSE(std::signbit(plane.normal().x())) << "a file would say -0";
}

TEST(LaserPlane, RefusesANormalThatIsNotAUnitVector) {
  EXPECT_THROW(LaserPlane({0.0, 0.0, 0.0}, 1.0), Error);
  EXPECT_THROW(LaserPlane({0.0, 1.00001, 0.0}, 1.0), Error);
  EXPECT_THROW(LaserPlane({0.0, std::nan(""), 0.0}, 1.0), Error);
  EXPECT_THROW(LaserPlane({0.0, 1.0, 0.0}, std::nan("")), Error);
  EXPECT_NO_THROW(LaserPlane({0.0, 1.0000005, 0.0}, 1.0));
}

// Laser below the camera, nothing tilted: x forward, y to the left, z up.
TEST(StandardScanFrame, IsForwardLeftUpForColumns) {
  const Eigen::Isometry3d T = standard_T_cam_scan({{0.0, 1.0, 0.0}, 0.4}, StripeAxis::kColumns);
  EXPECT_EQ(T.linear().col(0), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(T.linear().col(1), Eigen::Vector3d(-1, 0, 0));
  EXPECT_EQ(T.linear().col(2), Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(T.translation(), Eigen::Vector3d(0, 0.4, 0));
}

// Laser to the right of the camera: x forward, y up, z to the right.
TEST(StandardScanFrame, IsForwardUpRightForRows) {
  const Eigen::Isometry3d T = standard_T_cam_scan({{1.0, 0.0, 0.0}, 0.4}, StripeAxis::kRows);
  EXPECT_EQ(T.linear().col(0), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(T.linear().col(1), Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(T.linear().col(2), Eigen::Vector3d(1, 0, 0));
}

TEST(StandardScanFrame, ObeysItsDefinitionOnRandomPlanes) {
  for (int i = 0; i < 500; ++i) {
    const LaserPlane plane = random_plane();
    const StripeAxis axis = i % 2 == 0 ? StripeAxis::kColumns : StripeAxis::kRows;
    const Eigen::Isometry3d T = standard_T_cam_scan(plane, axis);
    const Eigen::Matrix3d R = T.linear();
    EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(R.determinant(), 1.0, 1e-14);
    EXPECT_NEAR(std::abs(R.col(2).dot(plane.normal())), 1.0, 1e-14);
    EXPECT_GT(axis == StripeAxis::kColumns ? -R(1, 2) : R(0, 2), 0.0);
    EXPECT_GT(R(2, 0), 0.0) << "x leans towards the optical axis";
    EXPECT_NEAR(plane.signed_distance_m(T.translation()), 0.0, 1e-14);
    EXPECT_LT(T.translation().cross(plane.normal()).norm(), 1e-14);
  }
}

TEST(StandardScanFrame, RefusesPlanesThatHaveNone) {
  EXPECT_THROW(standard_T_cam_scan({{0.0, 0.0, 1.0}, 1.0}, StripeAxis::kColumns), Error);
  EXPECT_THROW(standard_T_cam_scan({{1.0, 0.0, 0.0}, 1.0}, StripeAxis::kColumns), Error);
  EXPECT_THROW(standard_T_cam_scan({{0.0, 1.0, 0.0}, 1.0}, StripeAxis::kRows), Error);
}

TEST(LaserHomography, IsTheIntersectionOfRayAndPlane) {
  for (int i = 0; i < 500; ++i) {
    const LaserPlane plane = random_plane();
    Eigen::Isometry3d T = standard_T_cam_scan(plane, StripeAxis::kColumns);
    if (i % 3 == 0) {  // A frame that was moved within the plane.
      T = T * Eigen::Translation3d(uniform(-1, 1), uniform(-1, 1), 0.0) *
          Eigen::AngleAxisd(uniform(-3, 3), Eigen::Vector3d::UnitZ());
    }
    const Eigen::Matrix3d H = laser_homography(plane, T);
    EXPECT_NEAR(H.norm(), 1.0, 1e-14);
    const Eigen::Vector3d ray(uniform(-1, 1), uniform(-1, 1), 1.0);
    const double along = plane.normal().dot(ray);
    if (std::abs(along) < 0.05) continue;
    const Eigen::Vector3d p_scan = T.inverse() * (ray * plane.distance_m() / along);
    EXPECT_NEAR(p_scan.z(), 0.0, 1e-12);
    EXPECT_LT(((H * ray).hnormalized() - p_scan.head<2>()).norm(), 1e-11 * (1 + p_scan.norm()));
    EXPECT_EQ((H * ray).z() > 0.0, along > 0.0);
  }
}

// Mertz et al. 2002: with the camera straight above the laser by s, range = s cot(alpha).
TEST(LaserHomography, IsThePapersCotangentForAnUntiltedCamera) {
  const double s = 0.5;
  const LaserPlane plane({0.0, 1.0, 0.0}, s);
  const Eigen::Matrix3d H =
      laser_homography(plane, standard_T_cam_scan(plane, StripeAxis::kColumns));
  for (const double alpha : {0.05, 0.2, 0.5}) {
    const Eigen::Vector2d p = (H * Eigen::Vector3d(0.0, std::tan(alpha), 1.0)).hnormalized();
    EXPECT_NEAR(p.x(), s / std::tan(alpha), 1e-12);
    EXPECT_NEAR(p.y(), 0.0, 1e-15);
  }
}

}  // namespace
}  // namespace striper
