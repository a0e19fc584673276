// SPDX-License-Identifier: Apache-2.0
// Proves on rendered boards that the white paper around the print is followed to its end on each
// side, never beyond it, at most three squares, and that the stripe's light is not taken for its.
#include "laser_plane/board_paper.hpp"

#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core.hpp>

#include "support/board_picture.hpp"
#include "support/striper_session.hpp"

namespace striper {
namespace {

using testing::SyntheticStriper;

constexpr testing::BoardPose kPose{320, 230, 1.3, 25, -15, 6};

testing::BoardImageOptions paper_of(double margin_squares) {
  testing::BoardImageOptions options;
  options.samples = 3;
  options.margin_squares = margin_squares;
  return options;
}

cv::Mat render(const SyntheticStriper& striper, const testing::BoardPose& pose,
               const testing::BoardImageOptions& options) {
  return testing::render_board(striper.camera, striper.board, testing::T_cam_board(striper, pose),
                               options);
}

// Where paper was found to end beyond the print, in squares: left, top, right, bottom.
Eigen::Vector4d margins_in(const cv::Mat& image, const SyntheticStriper& striper,
                           const testing::BoardPose& pose,
                           const detail::StripeCourse& course = {}) {
  const auto paper = detail::find_paper(image, striper.board, striper.camera,
                                        testing::T_cam_board(striper, pose), course);
  const Eigen::Vector2d border = Eigen::Vector2d::Constant(striper.board.print_border_m());
  Eigen::Vector4d margins;
  margins << -paper.min() - border, paper.max() - 2.0 * striper.board.half_extent_m() - border;
  return margins / striper.board.square_m;
}

Eigen::Vector4d margins_of(const testing::BoardImageOptions& options) {
  const SyntheticStriper striper;
  return margins_in(render(striper, kPose, options), striper, kPose);
}

// The brightest row of what the laser adds to each column.
std::vector<double> brightest_rows(const cv::Mat& lit, const cv::Mat& dark) {
  const cv::Mat added = lit - dark;
  std::vector<double> rows;
  for (int column = 0; column < added.cols; ++column) {
    cv::Point at;
    cv::minMaxLoc(added.col(column), nullptr, nullptr, nullptr, &at);
    rows.push_back(at.y);
  }
  return rows;
}

class FindPaper : public ::testing::TestWithParam<double> {};

TEST_P(FindPaper, FollowsItToItsEnd) {
  testing::BoardImageOptions options = paper_of(GetParam());
  options.noise_dn = 2.0;
  const Eigen::Vector4d margins = margins_of(options);
  EXPECT_LE(margins.maxCoeff(), GetParam()) << margins.transpose();
  EXPECT_GE(margins.minCoeff(), GetParam() - 0.15) << margins.transpose();
}

INSTANTIATE_TEST_SUITE_P(Squares, FindPaper, ::testing::Values(0.5, 1.0, 2.0));

TEST(FindPaperAround, SeesNoneWhereThePrintEndsAtTheEdge) {
  EXPECT_NEAR(margins_of(paper_of(0.0)).cwiseAbs().maxCoeff(), 0.0, 1e-9);
}

TEST(FindPaperAround, GoesNoFurtherThanThreeSquaresOnAWhiteWall) {
  testing::BoardImageOptions options = paper_of(1.0);
  options.background_dn = options.white_dn;
  const Eigen::Vector4d margins = margins_of(options);
  EXPECT_TRUE(margins.isApproxToConstant(detail::kMarginSquares, 1e-9)) << margins.transpose();
}

TEST(FindPaperAround, DoesNotTakeTheLasersLightForThePapersEnd) {
  const SyntheticStriper striper;
  constexpr testing::BoardPose kStripeBelowPrint{320, 245, 1.0, 20, 0, 0};
  testing::BoardImageOptions options = paper_of(2.0);
  options.white_dn = 150.0;
  options.samples = 2;
  const cv::Mat dark = render(striper, kStripeBelowPrint, options);
  options.laser = striper.plane;
  const cv::Mat lit = render(striper, kStripeBelowPrint, options);
  const detail::StripeCourse course{StripeAxis::kColumns, brightest_rows(lit, dark), 8.0};
  const Eigen::Vector4d without_laser = margins_in(dark, striper, kStripeBelowPrint);
  EXPECT_EQ(without_laser, margins_in(lit, striper, kStripeBelowPrint, course));
  EXPECT_LT(margins_in(lit, striper, kStripeBelowPrint).w(), without_laser.w() - 0.5)
      << "the stripe lies on the paper below the print";
}

}  // namespace
}  // namespace striper
