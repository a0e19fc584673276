// SPDX-License-Identifier: Apache-2.0
// Proves where a laser's scans lie in their head, by what the camera itself sees there.
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/geometry/triangulator.hpp>
#include <striper/scan/scan_frame.hpp>

#include "support/models.hpp"

namespace striper {
namespace {

TEST(ScanFrame, HeadLooksAlongXWithLeftAndUp) {
  const Eigen::Isometry3d T = T_head_cam();
  EXPECT_TRUE((T * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(1, 0, 0)));   // Forward.
  EXPECT_TRUE((T * Eigen::Vector3d(-1, 0, 0)).isApprox(Eigen::Vector3d(0, 1, 0)));  // Left.
  EXPECT_TRUE((T * Eigen::Vector3d(0, -1, 0)).isApprox(Eigen::Vector3d(0, 0, 1)));  // Up.
  EXPECT_NEAR(T.linear().determinant(), 1.0, 1e-15);
}

// The paper's camera stands half a metre straight above the laser's level plane.
TEST(ScanFrame, LevelPlaneLiesBelowTheHead) {
  const auto model = std::make_shared<const StriperModel>(testing::paper_model());
  const auto frame = make_scan_frame("left", 0, model);
  EXPECT_EQ(frame->head, "left");
  EXPECT_EQ(frame->frame_id, "left_scan0");
  EXPECT_EQ(frame->model, model);
  const Eigen::Vector3d p_head = frame->T_head_scan * Eigen::Vector3d(2.0, 0.3, 0.0);
  EXPECT_TRUE(p_head.isApprox(Eigen::Vector3d(2.0, 0.3, -0.5), 1e-12)) << p_head.transpose();
}

TEST(ScanFrame, MapsScansOntoTheRaysThatSawThem) {
  for (const StripeAxis axis : {StripeAxis::kColumns, StripeAxis::kRows}) {
    const auto model = std::make_shared<const StriperModel>(testing::typical_model(axis));
    const auto frame = make_scan_frame("striper", 0, model);
    const Triangulator exact(*model, 0);
    const Eigen::Vector2d pixel(300.0, 400.0);
    const PlanePoint point = exact.triangulate(pixel);
    ASSERT_EQ(point.status, ReturnStatus::kOk);
    const Eigen::Vector3d p_cam =
        T_head_cam().inverse() * frame->T_head_scan * Eigen::Vector3d(point.x_m, point.y_m, 0.0);
    EXPECT_NEAR((model->camera.project(p_cam).pixel - pixel).norm(), 0.0, 1e-6);
  }
}

TEST(ScanFrame, WithoutAModelOrALaserItStandsWhereTheHeadDoes) {
  const auto nothing = make_scan_frame("striper", 2, nullptr);
  EXPECT_EQ(nothing->frame_id, "striper_scan2");
  EXPECT_TRUE(nothing->T_head_scan.isApprox(Eigen::Isometry3d::Identity()));
  const auto lacking =
      make_scan_frame("striper", 7, std::make_shared<const StriperModel>(testing::paper_model()));
  EXPECT_TRUE(lacking->T_head_scan.isApprox(Eigen::Isometry3d::Identity()));
}

}  // namespace
}  // namespace striper
