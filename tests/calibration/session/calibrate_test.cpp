// SPDX-License-Identifier: Apache-2.0
// Proves that images in memory become a model as the header promises: board and stripe in one
// image or in pairs, several lasers, circle grids, an image in both lists used once for each,
// and that what cannot be is refused with the image named. The images are rendered, small, and
// by another program than the simulator.
#include <gmock/gmock.h>

#include <striper/core/error.hpp>
#include <striper/session/calibrate.hpp>

#include "small_session.hpp"
#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::render_session;
using testing::small_striper;
using testing::SyntheticStriper;

double angle_deg(const LaserPlane& a, const LaserPlane& b) {
  return std::atan2(a.normal().cross(b.normal()).norm(), a.normal().dot(b.normal())) * 57.29578;
}

TEST(Calibrate, TakesBoardsAloneAndAImageInBothLists) {
  const SyntheticStriper striper = small_striper();
  CalibrationInput input;
  input.board = striper.board;
  input.boards = render_session(striper, "image ", striper.plane);
  input.lasers.push_back({input.boards, {}});
  const Calibration c = calibrate(input, {});
  EXPECT_EQ(8U, c.images.size()) << "an image in both lists is one image";
  EXPECT_EQ(8U, c.observations.views.size());
  EXPECT_GE(c.observations.stripes.size(), 7U);
  EXPECT_TRUE(c.trustworthy()) << c.verdict();
  EXPECT_NEAR(c.model.camera.fx(), 380.0, 1.0);
  EXPECT_LT(angle_deg(c.model.lasers.at(0).plane, striper.plane), 0.1);
}

TEST(Calibrate, TakesPairsOfTwoLasers) {
  const SyntheticStriper striper = small_striper();
  const LaserPlane second(Eigen::Vector3d(0.1, 0.9, 0.42).normalized(), 0.42);
  CalibrationInput input;
  input.board = striper.board;
  const auto off = render_session(striper, "off ", std::nullopt);
  input.lasers.push_back({render_session(striper, "first ", striper.plane), off});
  input.lasers.push_back({render_session(striper, "second ", second), off});
  const Calibration c = calibrate(input, {});
  EXPECT_EQ(8U, c.observations.views.size()) << "both lasers see the same poses";
  ASSERT_EQ(2U, c.model.lasers.size());
  EXPECT_TRUE(c.settings.subtract_off);
  EXPECT_LT(angle_deg(c.model.lasers[0].plane, striper.plane), 0.1);
  EXPECT_LT(angle_deg(c.model.lasers[1].plane, second), 0.1);
  EXPECT_NEAR(c.model.lasers[1].plane.distance_m(), 0.42, 0.001);
  EXPECT_EQ(9 + 8, c.model.covariance->matrix.rows());
}

TEST(Calibrate, TakesCircles) {
  const SyntheticStriper striper = small_striper(Board::Pattern::kCircles);
  CalibrationInput input;
  input.board = striper.board;
  input.boards = render_session(striper, "circles ", std::nullopt);
  const Calibration c = calibrate(input, {});
  EXPECT_EQ(8U, c.observations.views.size());
  EXPECT_NEAR(c.model.camera.fx(), 380.0, 1.0);
  EXPECT_LT(c.solution.corners.rms_px, 0.05);
  EXPECT_NEAR(c.observations.board.dot_ratio, 0.25, 0.005);
  EXPECT_TRUE(c.model.lasers.empty());
}

TEST(Calibrate, RefusesImagesOfDifferentSizes) {
  const SyntheticStriper striper = small_striper();
  CalibrationInput input;
  input.board = striper.board;
  input.boards.emplace_back("large", cv::Mat(300, 400, CV_8UC1, cv::Scalar(90)));
  input.boards.emplace_back("small", cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  CalibrationOptions options;
  options.threads = 1;
  const Error error = testing::error_of([&] { calibrate(input, options); });
  EXPECT_EQ(ErrorKind::kBadValue, error.kind());
  EXPECT_THAT(error.what(), HasSubstr("small: the image is 320x240, but large is 400x300"));
}

TEST(Calibrate, RefusesPairsThatAreNone) {
  CalibrationInput input;
  input.board = small_striper().board;
  const SessionImage image("one", cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  input.lasers.push_back({{image, image}, {image}});
  EXPECT_THROW(calibrate(input, {}), Error);
  EXPECT_THROW(calibrate({small_striper().board, {}, {}}, {}), Error);
}

TEST(Calibrate, IsEndedByWhatItsProgressThrows) {
  CalibrationInput input;
  input.board = small_striper().board;
  for (int i = 0; i < 4; ++i)
    input.boards.emplace_back("image " + std::to_string(i),
                              cv::Mat(240, 320, CV_8UC1, cv::Scalar(90)));
  CalibrationOptions options;
  options.progress = [](const std::string&, double) { throw Error(ErrorKind::kDevice, "enough"); };
  EXPECT_THROW(calibrate(input, options), Error);
}

}  // namespace
}  // namespace striper
