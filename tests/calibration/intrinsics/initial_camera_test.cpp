// SPDX-License-Identifier: Apache-2.0
// Proves that the start of an adjustment is near enough to the truth for each lens, that a pose
// comes out exactly where nothing is distorted, and that what gives no pose is said to give none.
#include <gtest/gtest.h>

#include <striper/core/error.hpp>
#include <striper/intrinsics/initial_camera.hpp>

#include "support/striper_session.hpp"

namespace striper {
namespace {

using testing::SyntheticStriper;

TEST(InitialCamera, FindsTheFocalLengthOfAPinholeByZhangsForm) {
  const CameraModel truth(640, 480, 700.0, 640.0, 319.5, 239.5, LensModel::kPlumbBob,
                          {0, 0, 0, 0, 0});
  const CameraModel start = initial_camera(testing::lens_boards(truth, 8), LensModel::kPlumbBob);
  EXPECT_NEAR(start.fx(), 700.0, 3.0);
  EXPECT_NEAR(start.fy(), 640.0, 3.0);
  EXPECT_EQ(319.5, start.cx());
}

// What the lens bends is not in a pinhole: the adjustment has to come back from there.
TEST(InitialCamera, IsWithinAFifthOfADistortingLens) {
  const CameraModel truth = SyntheticStriper().camera;
  const CameraModel start = initial_camera(testing::lens_boards(truth, 8), LensModel::kPlumbBob);
  EXPECT_NEAR(start.fx() / truth.fx(), 1.0, 0.2);
}

TEST(InitialCamera, FindsAnEquidistantLensByScanningFocalLengths) {
  const CameraModel truth(640, 480, 350.0, 350.0, 319.5, 239.5, LensModel::kEquidistant,
                          {-0.02, 0.004, 0.0, 0.0});
  const CameraModel start = initial_camera(testing::lens_boards(truth, 8), LensModel::kEquidistant);
  EXPECT_NEAR(start.fx() / 350.0, 1.0, 0.12);
}

TEST(InitialCamera, RefusesViewsWithoutAPose) {
  Observations observations = testing::lens_boards(SyntheticStriper().camera, 8);
  for (CornerView& view : observations.views) {
    view.point.resize(3);
    view.pixel.resize(3);
  }
  EXPECT_THROW(initial_camera(observations, LensModel::kPlumbBob), Error);
}

TEST(InitialPose, IsExactWithoutNoise) {
  SyntheticStriper striper;
  striper.corner_sigma_px = 0.0;
  Observations observations = testing::empty_observations(striper);
  const auto truth = testing::T_cam_board(striper, {300, 250, 1.3, 30, -20, 8});
  ASSERT_TRUE(testing::add_view(striper, truth, observations, false));
  const auto found = initial_pose(striper.camera, striper.board, observations.views[0]);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((found->matrix() - truth.matrix()).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(InitialPose, IsEmptyForPointsOnALine) {
  SyntheticStriper striper;
  Observations observations = testing::empty_observations(striper);
  ASSERT_TRUE(testing::add_view(striper, testing::T_cam_board(striper, {300, 250, 1.3, 30, -20, 8}),
                                observations, false));
  CornerView row = observations.views[0];
  row.point.resize(static_cast<std::size_t>(striper.board.columns));
  row.pixel.resize(row.point.size());
  EXPECT_FALSE(initial_pose(striper.camera, striper.board, row).has_value());
}

}  // namespace
}  // namespace striper
