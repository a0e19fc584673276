// SPDX-License-Identifier: Apache-2.0
// Proves on published images of boards that the camera comes out as their references have it,
// that the fit is not worse and not much slower than cv::calibrateCamera on the same corners, and
// that a degenerate set is refused. Skips where the images are absent.
#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

#include "real_support.hpp"
#include "support/instrumented.hpp"
#include "support/opencv_rival.hpp"

namespace striper {
namespace {

using ::testing::Contains;
using ::testing::Field;

// The same corners, all of them, the same five-coefficient lens.
void expect_not_worse_than_opencv(const Observations& observations) {
  const testing::Race race = testing::race_opencv(observations, 3);
  std::printf("rms %.5f px in %.3f s; cv::calibrateCamera %.5f px in %.3f s\n", race.ours_px,
              race.ours_s, race.theirs_px, race.theirs_s);
  EXPECT_LE(race.ours_px, race.theirs_px * 1.00001);
  const double most = testing::kIsInstrumented ? 20.0 : 2.0;
  EXPECT_LE(race.ours_s, most * race.theirs_s);
}

CalibrationInput boards_of(const char* set, const char* size, double square_m,
                           const std::string& folder = "", const std::string& prefix = "") {
  CalibrationInput input;
  input.board = parse_board(size, square_m);
  input.boards = testing::images_in(testing::real_data(set) / folder, prefix);
  return input;
}

TEST(RealBoards, BouguetsExampleComesOutAsPublished) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("bouguet-calib-example");
  const Calibration c = calibrate(boards_of("bouguet-calib-example", "13x12", 0.030), {});
  EXPECT_EQ(20U, c.observations.views.size());
  EXPECT_NEAR(c.model.camera.fx(), 657.46, 1.0);
  EXPECT_NEAR(c.model.camera.fy(), 657.95, 1.0);
  EXPECT_NEAR(c.model.camera.cx(), 303.1, 2.0);
  EXPECT_NEAR(c.model.camera.cy(), 242.6, 2.0);
  EXPECT_LT(c.solution.corners.rms_px, 0.2);
  EXPECT_TRUE(c.trustworthy());
  expect_not_worse_than_opencv(c.observations);
}

Observations opencv_left_corners() {
  return testing::corners_from_csv(
      testing::real_data("opencv-left-right") / "opencv_corners_left.csv",
      parse_board("9x6", 0.025), 640, 480);
}

JointOptions with_all_corners() {
  JointOptions options;
  options.remove_outliers = false;
  return options;
}

TEST(RealBoards, OpenCvsLeftCameraComesOutAsPublishedOnItsCorners) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("opencv-left-right");
  const Observations corners = opencv_left_corners();
  ASSERT_EQ(13U, corners.views.size());
  const JointSolution all = solve_joint(corners, with_all_corners());
  EXPECT_NEAR(all.camera.fx(), 535.9, 1.0);
  EXPECT_LE(all.corners.rms_px, 0.41);
  EXPECT_LT(solve_joint(corners, {}).corners.rms_px, 0.2) << "lower with the outliers out";
  expect_not_worse_than_opencv(corners);
}

// From the images themselves fx is 533.5. The published 535.9 is the pull of the corners beside
// the edge of the sheet: its outer squares are cut to half, and where they are seen obliquely the
// window of 23x23 pixels takes the edge for the corner's. In left02.jpg that moves six corners by 2
// to 6 px.
TEST(RealBoards, OpenCvsLeftCameraIsAsPublishedWithTheCornersThatItsWindowMoved) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("opencv-left-right");
  const CalibrationInput input = boards_of("opencv-left-right", "9x6", 0.025, "", "left");
  const Calibration ours = calibrate(input, {});
  ASSERT_EQ(13U, ours.observations.views.size());
  EXPECT_LT(ours.solution.corners.rms_px, 0.2);
  EXPECT_TRUE(ours.trustworthy());

  CalibrationOptions like_opencv;
  like_opencv.like_opencv = true;
  like_opencv.lens = LensModel::kPlumbBob;
  const Calibration published = calibrate(input, like_opencv);
  EXPECT_NEAR(published.model.camera.fx(), 535.9, 1.0);
  EXPECT_LE(published.solution.corners.rms_px, 0.41);

  const Observations& theirs = published.observations;
  ASSERT_EQ(13U, theirs.views.size());
  int moved = 0;
  for (std::size_t v = 0; v < theirs.views.size(); ++v) {
    ASSERT_EQ(54U, theirs.views[v].pixel.size()) << theirs.views[v].name;
    for (int i = 0; i < 54; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double apart_px =
          (theirs.views[v].pixel[k] - ours.observations.views[v].pixel[k]).norm();
      if (apart_px < 1.2) continue;
      EXPECT_TRUE(i % 9 == 0 || i % 9 == 8) << theirs.views[v].name << ", corner " << i;
      ++moved;
    }
  }
  EXPECT_GE(moved, 6);
  Observations inside = theirs;
  for (CornerView& view : inside.views) {
    const CornerView all = view;
    view.point.clear();
    view.pixel.clear();
    for (std::size_t i = 0; i < 54; ++i) {
      if (i % 9 == 0 || i % 9 == 8) continue;
      view.point.push_back(all.point[i]);
      view.pixel.push_back(all.pixel[i]);
    }
  }
  const JointSolution clear_of_edge = solve_joint(inside, with_all_corners());
  std::printf(
      "fx from our corners %.2f; from OpenCV's %.2f, rms %.3f px; %d of them moved; without "
      "those beside the edge %.2f, rms %.3f px\n",
      ours.model.camera.fx(), published.model.camera.fx(), published.solution.corners.rms_px, moved,
      clear_of_edge.camera.fx(), clear_of_edge.corners.rms_px);
  EXPECT_NEAR(clear_of_edge.camera.fx(), ours.model.camera.fx(), 1.0);
  const JointSolution cleaned = solve_joint(opencv_left_corners(), {});
  EXPECT_LT(cleaned.outliers.size(), 20U);
  EXPECT_NEAR(cleaned.camera.fx(), ours.model.camera.fx(), 1.0);
  EXPECT_NEAR(cleaned.camera.cx(), ours.model.camera.cx(), 1.0);
  EXPECT_NEAR(cleaned.camera.cy(), ours.model.camera.cy(), 1.0);
}

// A bent print, whose corners no camera explains: the adjustment has far to go.
TEST(RealBoards, CornersOfABentBoardAreFittedNoWorseThanByOpenCv) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("b33-handheld-known-distance");
  expect_not_worse_than_opencv(testing::corners_from_csv(
      testing::real_data("b33-handheld-known-distance") / "opencv_corners_cal_in.csv",
      parse_board("9x7", 0.025), 640, 480));
}

TEST(RealBoards, NearlyParallelBoardsAreRefused) {
  STRIPER_SKIP_WITHOUT_REAL_DATA("anugrah-step-scans");
  const Calibration c = calibrate(boards_of("anugrah-step-scans", "5x5", 0.005, "calibration"), {});
  EXPECT_FALSE(c.trustworthy());
  EXPECT_THAT(c.findings, Contains(Field(&Event::code, EventCode("boards_parallel"))));
  EXPECT_THAT(c.verdict(), ::testing::HasSubstr("Do not trust"));
}

}  // namespace
}  // namespace striper
