// SPDX-License-Identifier: Apache-2.0
// Proves that boards are read, drawn and refused as documented, that corners come out where a
// plainly rendered board has them (so that pixel (0, 0) is the centre of the first pixel), in the
// promised order, and that an image without a board says why. Real images are in
// real_boards_test.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include <striper/board/board.hpp>
#include <striper/board/find_board.hpp>
#include <striper/core/error.hpp>

#include "support/board_picture.hpp"
#include "support/error_of.hpp"
#include "support/striper_session.hpp"

namespace striper {
namespace {

using ::testing::HasSubstr;
using testing::SyntheticStriper;

TEST(ParseBoard, ReadsCornersAndCircles) {
  EXPECT_EQ("8x6", to_string(parse_board("8x6", 0.04)));
  EXPECT_EQ("circles:7x7", to_string(parse_board("circles:7x7", 0.04)));
  EXPECT_EQ(48, parse_board("8x6", 0.04).point_count());
  EXPECT_EQ(Eigen::Vector2d(0.04, 0.08), parse_board("8x6", 0.04).point_m(17));
}

TEST(ParseBoard, RefusesWhatIsNoBoard) {
  for (const char* text :
       {"", "8", "8x", "x6", "8x6x2", "8 x 6", "-8x6", "circles:", "rings:7x7"}) {
    SCOPED_TRACE(text);
    const Error error = testing::error_of([&] { parse_board(text, 0.04); });
    EXPECT_TRUE(error.kind() == ErrorKind::kUsage || error.kind() == ErrorKind::kBadValue);
  }
  EXPECT_THROW(parse_board("2x6", 0.04), Error);
  EXPECT_THROW(parse_board("8x6", 0.0), Error);
  EXPECT_THROW(parse_board("8x6", std::nan("")), Error);
}

TEST(BoardSvg, DrawsEverySquareAtTrueScale) {
  const std::string svg = board_svg(parse_board("8x6", 0.04));
  EXPECT_THAT(svg, HasSubstr("width=\"440.0000mm\""));
  EXPECT_THAT(svg, HasSubstr("8x6, square 40 mm"));
  std::size_t squares = 0;
  for (auto at = svg.find("<rect x="); at != std::string::npos; at = svg.find("<rect x=", at + 1))
    ++squares;
  EXPECT_EQ(9U * 7U / 2U + 1U, squares);
}

struct Attitude {
  double u, v, depth, x, y, z;
};

void PrintTo(const Attitude& a, std::ostream* out) {
  *out << "at (" << a.u << ", " << a.v << ") px, " << a.depth << " m, turned " << a.x << ", " << a.y
       << ", " << a.z << " degrees";
}

class FindRenderedBoard : public ::testing::TestWithParam<Attitude> {};

TEST_P(FindRenderedBoard, PutsCornersWhereTheyAre) {
  SyntheticStriper striper;
  const Attitude a = GetParam();
  const auto T = testing::T_cam_board(striper, {a.u, a.v, a.depth, a.x, a.y, a.z});
  testing::BoardImageOptions options;
  options.noise_dn = 2.0;
  options.samples = 5;
  const cv::Mat image = testing::render_board(striper.camera, striper.board, T, options);
  const BoardView view = find_board(image, striper.board);
  ASSERT_TRUE(view.found) << view.reason;
  EXPECT_LT(view.blur_px, 1.2);
  std::vector<Eigen::Vector2d> true_px;
  for (const auto& p : striper.board.points_m())
    true_px.push_back(striper.camera.project(T * Eigen::Vector3d(p.x(), p.y(), 0.0)).pixel);
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double worst = 0.0;
  double sum = 0.0;
  for (std::size_t i = 0; i < true_px.size(); ++i) {
    const Eigen::Vector2d e = view.corners_px[i] - true_px[i];
    mean += e / static_cast<double>(true_px.size());
    worst = std::max(worst, e.norm());
    sum += e.squaredNorm();
  }
  EXPECT_LT(mean.norm(), 0.01) << "a shift common to all corners is a slip of the pixel convention";
  EXPECT_LT(std::sqrt(sum / static_cast<double>(true_px.size())), 0.035);
  EXPECT_LT(worst, 0.15) << "the first corner is the same physical one, whatever the attitude";

  const BoardView quick = find_board(image, striper.board, BoardSearch::kQuick);
  ASSERT_TRUE(quick.found);
  for (std::size_t i = 0; i < true_px.size(); ++i)
    EXPECT_LT((quick.corners_px[i] - view.corners_px[i]).norm(), 0.02) << "corner " << i;
}

INSTANTIATE_TEST_SUITE_P(Attitudes, FindRenderedBoard,
                         ::testing::Values(Attitude{320, 240, 1.0, 2, 3, 4},
                                           Attitude{300, 260, 1.2, 35, 20, 8},
                                           Attitude{340, 220, 1.1, -30, -35, 170},
                                           Attitude{320, 240, 2.2, 25, 0, 95}));

// The centre of the area that a dot takes in the image, from its outline.
Eigen::Vector2d area_centre_px(const SyntheticStriper& striper, const Eigen::Isometry3d& T,
                               const Eigen::Vector2d& centre_m) {
  constexpr int kSides = 720;
  const auto outline_px = [&](int i) {
    const double angle = 2.0 * std::numbers::pi * i / kSides;
    const Eigen::Vector2d p =
        centre_m + striper.board.dot_radius_m() * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    return striper.camera.project(T * Eigen::Vector3d(p.x(), p.y(), 0.0)).pixel;
  };
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  double area = 0.0;
  const Eigen::Vector2d origin = outline_px(0);
  for (int i = 1; i + 1 < kSides; ++i) {
    const Eigen::Vector2d a = outline_px(i) - origin;
    const Eigen::Vector2d b = outline_px(i + 1) - origin;
    const double twice = a.x() * b.y() - a.y() * b.x();
    area += twice;
    moment += twice * (a + b) / 3.0;
  }
  return origin + moment / area;
}

TEST(FindBoard, FindsTheCentresOfTheAreasOfCircles) {
  SyntheticStriper striper;
  striper.board = parse_board("circles:7x7", 0.06);
  const auto T = testing::T_cam_board(striper, {320, 240, 0.9, 30, 25, 3});
  testing::BoardImageOptions options;
  options.samples = 5;
  options.noise_dn = 1.0;
  const cv::Mat image = testing::render_board(striper.camera, striper.board, T, options);
  const BoardView view = find_board(image, striper.board);
  ASSERT_TRUE(view.found) << view.reason;
  EXPECT_NEAR(view.dot_ratio, 0.25, 0.004);
  double to_area = 0.0;
  double to_centre = 0.0;
  for (int i = 0; i < striper.board.point_count(); ++i) {
    const auto p = striper.board.point_m(i);
    const auto& found = view.corners_px[static_cast<std::size_t>(i)];
    to_area += (found - area_centre_px(striper, T, p)).squaredNorm() / 49.0;
    to_centre += (found - striper.camera.project(T * Eigen::Vector3d(p.x(), p.y(), 0.0)).pixel)
                     .squaredNorm() /
                 49.0;
  }
  std::printf("dots: %.3f px rms from the centres of their areas, %.3f px from their centres\n",
              std::sqrt(to_area), std::sqrt(to_centre));
  EXPECT_LT(std::sqrt(to_area), 0.03);
  EXPECT_EQ(49, std::count(view.reliable.begin(), view.reliable.end(), 1));
}

TEST(FindBoard, SaysWhyThereIsNone) {
  const Board board = parse_board("8x6", 0.04);
  EXPECT_THAT(find_board(cv::Mat(480, 640, CV_8UC1, cv::Scalar(3)), board).reason,
              HasSubstr("too dark"));
  EXPECT_THAT(find_board(cv::Mat(480, 640, CV_8UC1, cv::Scalar(254)), board).reason,
              HasSubstr("over-exposed"));
  EXPECT_THAT(find_board(cv::Mat(480, 640, CV_8UC1, cv::Scalar(90)), board).reason,
              HasSubstr("no contrast"));
  EXPECT_THROW(find_board(cv::Mat(), board), Error);
  EXPECT_THROW(find_board(cv::Mat(48, 64, CV_32FC1, cv::Scalar(0)), board), Error);
}

TEST(FindBoard, GuessesTheSizeWhenSquaresWereCounted) {
  SyntheticStriper striper;
  const auto T = testing::T_cam_board(striper, {320, 240, 1.0, 10, 5, 3});
  testing::BoardImageOptions options;
  options.samples = 3;
  const cv::Mat image = testing::render_board(striper.camera, striper.board, T, options);
  const Board wrong = parse_board("10x7", 0.06);
  EXPECT_FALSE(find_board(image, wrong).found);
  EXPECT_EQ("9x6", guess_board_size(image, wrong));
}

}  // namespace
}  // namespace striper
