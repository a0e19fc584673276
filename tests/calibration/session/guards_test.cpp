// SPDX-License-Identifier: Apache-2.0
// Proves that the mistakes people make with a calibration are named: the intrinsics of another
// lens, lists that are swapped, a laser that clips, a board counted wrongly; and that how far the
// boards were is said. The images are rendered, small.
#include <gmock/gmock.h>

#include <striper/core/error.hpp>
#include <striper/session/calibrate.hpp>

#include "small_session.hpp"
#include "support/error_of.hpp"

namespace striper {
namespace {

using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::render_session;
using testing::session_options;
using testing::small_striper;
using testing::SyntheticStriper;

CalibrationInput lit_session(const SyntheticStriper& striper) {
  CalibrationInput input;
  input.board = striper.board;
  input.lasers.push_back({render_session(striper, "lit ", striper.plane), {}});
  return input;
}

// ---- Intrinsics of another lens.

class OtherLens : public ::testing::TestWithParam<double> {};

TEST_P(OtherLens, IsRefusedWhereALaserIsCalibratedWithIt) {
  const SyntheticStriper striper = small_striper();
  const double focal_px = GetParam() * striper.camera.fx();
  CalibrationOptions options;
  options.known_camera = KnownCamera{CameraModel(400, 300, focal_px, focal_px, 201.0, 148.0,
                                                 LensModel::kPlumbBob, {-0.2, 0.06, 0.0, 0.0, 0.0}),
                                     {}};
  const Calibration c = calibrate(lit_session(striper), options);
  EXPECT_FALSE(c.trustworthy());
  EXPECT_THAT(c.findings, Contains(AllOf(Field(&Event::code, EventCode("known_camera_differs")),
                                         Field(&Event::severity, Severity::kRefusal))));
}

INSTANTIATE_TEST_SUITE_P(Guards, OtherLens, ::testing::Values(0.5, 0.9, 0.97, 1.03, 1.1, 1.5));

TEST(Guards, TakesTheIntrinsicsOfThisLens) {
  const SyntheticStriper striper = small_striper();
  CalibrationOptions options;
  options.known_camera = KnownCamera{striper.camera, {}};
  const Calibration c = calibrate(lit_session(striper), options);
  EXPECT_TRUE(c.trustworthy()) << c.verdict();
  EXPECT_THAT(c.findings, Not(Contains(Field(&Event::code, EventCode("known_camera_differs")))));
}

// ---- Lists that are swapped.

TEST(Guards, NamesSwappedListsOfBoardsAndLaserImages) {
  const SyntheticStriper striper = small_striper();
  CalibrationInput input;
  input.board = striper.board;
  input.boards = render_session(striper, "lit ", striper.plane);
  input.lasers.push_back({render_session(striper, "unlit ", std::nullopt), {}});
  const Error error = testing::error_of([&] { calibrate(input, {}); });
  EXPECT_EQ(ErrorKind::kUntrustworthy, error.kind());
  EXPECT_THAT(error.what(), HasSubstr("are the lists of boards and of laser images swapped?"));
}

TEST(Guards, NamesSwappedListsOfPairs) {
  const SyntheticStriper striper = small_striper();
  CalibrationInput input;
  input.board = striper.board;
  input.lasers.push_back({render_session(striper, "off ", std::nullopt),
                          render_session(striper, "on ", striper.plane)});
  const Error error = testing::error_of([&] { calibrate(input, {}); });
  EXPECT_EQ(ErrorKind::kUntrustworthy, error.kind());
  EXPECT_THAT(error.what(), HasSubstr("are the two lists of pairs swapped?"));
}

TEST(Guards, SaysThatTheLaserIsOffWhereItIsOffEverywhere) {
  const SyntheticStriper striper = small_striper();
  CalibrationInput input;
  input.board = striper.board;
  input.boards = render_session(striper, "unlit ", std::nullopt);
  input.lasers.push_back({render_session(striper, "off ", std::nullopt),
                          render_session(striper, "off too ", std::nullopt)});
  try {
    EXPECT_FALSE(calibrate(input, {}).trustworthy());
  } catch (const Error& error) {
    EXPECT_EQ(ErrorKind::kUntrustworthy, error.kind());
    EXPECT_THAT(error.what(), Not(HasSubstr("swapped")));
  }
}

// ---- What else is said.

TEST(Guards, NamesAStripeThatIsClipped) {
  const SyntheticStriper striper = small_striper();
  CalibrationInput input;
  input.board = striper.board;
  testing::BoardImageOptions options = session_options(striper.plane);
  options.laser_dn = 240.0;
  input.lasers.push_back({render_session(striper, "clipped ", options), {}});
  const Calibration c = calibrate(input, {});
  EXPECT_THAT(c.findings, Contains(AllOf(Field(&Event::code, EventCode("stripe_clipped")),
                                         Field(&Event::message, HasSubstr("is clipped")))));
  const Calibration dim = calibrate(lit_session(striper), {});
  EXPECT_THAT(dim.findings, Not(Contains(Field(&Event::code, EventCode("stripe_clipped")))));
}

TEST(Guards, NamesTheSizeOfABoardThatWasCountedWrongly) {
  const SyntheticStriper striper = small_striper();  // 7x6.
  CalibrationInput input;
  input.boards = render_session(striper, "board ", std::nullopt);
  for (const auto& [columns, rows] : {std::pair(7, 7), {7, 5}}) {
    input.board = striper.board;
    input.board.columns = columns;
    input.board.rows = rows;
    const Error error = testing::error_of([&] { calibrate(input, {}); });
    EXPECT_EQ(ErrorKind::kUntrustworthy, error.kind());
    EXPECT_THAT(error.what(),
                AnyOf(HasSubstr("a 7x6 board is in "), HasSubstr("a 6x7 board is in ")))
        << columns << "x" << rows;
  }
}

TEST(Guards, SaysHowFarTheBoardsWere) {
  const SyntheticStriper striper = small_striper();
  const BoardDistances boards = calibrate(lit_session(striper), {}).board_distances();
  const Eigen::Vector2d middle = striper.board.centre_m();
  std::vector<double> expected;
  for (const Eigen::Isometry3d& T : testing::session_poses(striper))
    expected.push_back((T * Eigen::Vector3d(middle.x(), middle.y(), 0.0)).norm());
  std::sort(expected.begin(), expected.end());
  EXPECT_NEAR(boards.nearest_m, expected.front(), 0.005);
  EXPECT_NEAR(boards.median_m, expected[expected.size() / 2], 0.005);
  EXPECT_NEAR(boards.farthest_m, expected.back(), 0.005);
}

}  // namespace
}  // namespace striper
